"""Lines of the logger `withe` about builds, steps, equilibria and runs. Nothing is computed for a silent logger."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from withe.common.log import logger, logs_debug, logs_info
from withe.simulation.readouts import Equilibrium, Plan
from withe.simulation.session import Session

__all__ = ["StepLog", "log_build", "log_equilibrium", "log_failure", "run_logged"]

StepCallback = Callable[[float, float], None]


def log_build(plan: Plan) -> None:
    """Log the main decisions of a build in one line, and the others with their reasons as details."""
    head, *notes = str(plan).splitlines()
    logger.info("build: %s", head)
    for note in notes:
        logger.debug("build: %s", note.removeprefix("- "))


class StepLog:
    """Log of one time step: a line if the solver subdivides the step.

    Parameters
    ----------
    session : Session
    callback : callable or None
        Function that the engine calls before every inner step.
    """

    def __init__(self, session: Session, callback: StepCallback | None) -> None:
        self._session = session
        self._callback = callback
        self._start = session.world.time
        self._shortest = math.inf
        before = session.world.statistics
        self._before = before.steps, before.rejected_steps, before.iterations

    def before_step(self, force_time: float, end_time: float) -> None:
        """Note the length of an inner step, and call the function before it."""
        self._shortest = min(self._shortest, end_time - self._session.world.time)
        if self._callback is not None:
            self._callback(force_time, end_time)

    def write(self) -> None:
        """Write the line."""
        now = self._session.world.statistics
        steps, rejected, iterations = (
            after - before
            for after, before in zip((now.steps, now.rejected_steps, now.iterations), self._before, strict=True)
        )
        if steps <= 1 and not rejected:
            return
        # The fourth-order rule composes a step of parts, some of which go backwards, and static steps have no length.
        has_length = self._session.options.integrator not in ("fourth_order", "static")
        logger.debug(
            "step from t = %.6g s: subdivided into %d inner steps%s, %d rejected, %d iterations",
            self._start,
            steps,
            f" (shortest {self._shortest:.3g} s)" if has_length and math.isfinite(self._shortest) else "",
            rejected,
            iterations,
        )


def log_failure(error: Exception) -> None:
    """Log a step or an equilibrium that did not converge."""
    if logs_debug():
        logger.debug("no convergence: %s", error)


def log_equilibrium(session: Session, found: Equilibrium) -> None:
    """Log the work of an equilibrium and its result."""
    if logs_debug():
        logger.debug(
            "equilibrium at t = %.6g s: %d iterations, residual %.2g N, %s%s",
            session.world.time,
            found.iterations,
            found.residual,
            found.stability,
            ", on another branch" if found.branch_changed else "",
        )


@contextmanager
def run_logged(session: Session) -> Iterator[None]:
    """Log a summary at the end of a run, also if the run ends early."""
    if not logs_info():
        yield
        return
    clock, start, before = time.perf_counter(), session.world.time, session.world.statistics
    try:
        yield
    finally:
        now = session.world.statistics
        logger.info(
            "run from t = %.6g to %.6g s: %d steps, %d rejected, %d iterations, in %.3g s",
            start,
            session.world.time,
            now.steps - before.steps,
            now.rejected_steps - before.rejected_steps,
            now.iterations - before.iterations,
            time.perf_counter() - clock,
        )
