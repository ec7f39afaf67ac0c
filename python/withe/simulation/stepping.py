"""A simulation's way through time: its steps, its equilibria, its run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

from withe import _core
from withe.common.log import logs_debug
from withe.common.user_warnings import warn
from withe.errors import (
    BranchChangedWarning,
    CoarseMeshWarning,
    CoarseStepWarning,
    ConvergenceError,
    EnergyDriftWarning,
    OutOfPlaneWarning,
    RingLeftWarning,
    RodCrossingWarning,
    SqueezedRodWarning,
)
from withe.recording.recorder import Recorder
from withe.simulation.functions import apply_functions, force_function, step_callback
from withe.simulation.gradients import equilibrium_gradient, equilibrium_jacobian
from withe.simulation.hands import forget_left_rings
from withe.simulation.linearisation import Linearisation, Stability
from withe.simulation.loads import load_index
from withe.simulation.logs import StepLog, log_equilibrium, log_failure
from withe.simulation.paths import EquilibriumPath, PathOptions, path_of
from withe.simulation.readouts import Equilibrium
from withe.simulation.schedule import apply_due, next_time, steps_until_next
from withe.simulation.session import Session
from withe.simulation.supports import find_support
from withe.simulation.unknowns import Unknown

__all__ = ["Stepping", "convergence_error", "pass_on", "report_left"]


class Stepping:
    """Stepping of a session.

    Parameters
    ----------
    session : Session

    Attributes
    ----------
    recorder : Recorder or None
        Of the last run.
    frame_time : (float, float) or None
        Time of the engine at the last frame of a run, and the time of that frame: steps add up to it, up to rounding.
    watchers : list of callable
        Called after every time step, for example to draw the scene. Copies have none.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.recorder: Recorder[Any] | None = None
        self.frame_time: tuple[float, float] | None = None
        self.watchers: list[Callable[[], None]] = []
        self._running = False

    def copy(self) -> Stepping:
        """Return the stepping of a copied session, outside of any run."""
        other = Stepping(self.session.copy())
        other.frame_time = self.frame_time
        return other

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        now = self.session.world.time
        if self.frame_time is not None and self.frame_time[0] == now:
            return self.frame_time[1]
        return now

    def step(self, count: int) -> None:
        """Advance by time steps: one by one if they are logged or watched, with the same result."""
        single = bool(self.watchers) or logs_debug()
        while count > 0:
            steps = 1 if single else count
            if self.session.scene.actuations:
                apply_due(self.session)
                steps = steps_until_next(self.session, steps)
            self._advance(partial(self.session.world.step, steps))
            count -= steps

    def advance_to(self, time: float) -> None:
        """Advance to a time, with steps of equal length that are no longer than the time step."""
        then = -math.inf
        while then < time:
            then = time
            if self.session.scene.actuations:
                apply_due(self.session)
                then = min(time, next_time(self.session))
            self._advance(partial(self.session.world.advance_to, then))

    def _advance(self, advance: Callable[[Any, Any], None]) -> None:
        """Call a function of the engine that advances, with the callbacks of the session."""
        callback = step_callback(self.session)
        log = StepLog(self.session, callback) if logs_debug() else None
        with self._convergence():
            try:
                advance(callback if log is None else log.before_step, force_function(self.session))
            finally:
                if log is not None:
                    log.write()
        for watcher in tuple(self.watchers):
            watcher()

    def equilibrium(self, stable: bool) -> Equilibrium:
        """Go to the equilibrium that the present state leads to; see `Simulation.equilibrium`."""
        world = self.session.world
        begun = [name for (_, name), time in self.session.settings.ramps.items() if time == world.time]
        if begun:
            warn(
                f"the ramp of {begun[0]!r} (over=) has not begun, and time does not advance in equilibrium(): "
                "leave out over= to apply the target at once, or call step() or run() first",
                cause="over",
            )
        apply_functions(self.session, world.time, world.time)
        with self._convergence():
            found = world.equilibrium(stable, None, force_function(self.session))
        stability: Stability = "stable" if found.stable else "diverges"
        if not found.decided:
            stability = self.linearise().stability
        gradient, jacobian = self._derivatives()
        result = Equilibrium(
            stable=stability == "stable",
            stability=stability,
            branch_changed=found.branch_changed,
            iterations=found.iterations,
            residual=found.residual,
            _gradient=gradient,
            _jacobian=jacobian,
        )
        log_equilibrium(self.session, result)
        return result

    def _derivatives(
        self,
    ) -> tuple[Callable[[Any, Sequence[Unknown]], list[Any]], Callable[[Any, Sequence[Unknown]], list[Any]]]:
        """Gradient and Jacobian of the equilibrium that the session is in now."""
        session = self.session
        found = session.world.positions().tobytes()

        def check() -> None:
            if session.world.positions().tobytes() != found:
                raise ValueError(
                    "the simulation has left this equilibrium: compute gradients before the next step or change"
                )

        def gradient(dL_dx: Any, wrt: Sequence[Unknown]) -> list[Any]:
            check()
            return equilibrium_gradient(session, dL_dx, wrt)

        def jacobian(of: Any, wrt: Sequence[Unknown]) -> list[Any]:
            check()
            return equilibrium_jacobian(session, of, wrt)

        return gradient, jacobian

    def path(self, wanted: PathOptions) -> EquilibriumPath:
        """Go along a path of equilibria."""
        session = self.session
        apply_functions(session, session.world.time, session.world.time)
        loads = [load_index(session, part) for part in wanted.loads]
        with self._convergence():
            found = session.world.equilibrium_path(
                loads, wanted.start, wanted.end, wanted.steps + 1, wanted.turn, None, force_function(session)
            )
        return path_of(
            found,
            lambda rod: session.directory.layout.rows(session.directory.rod(rod).index),
            lambda support: find_support(session, support)[0],
        )

    def linearise(self) -> Linearisation:
        """Equations of motion linearised about the present configuration."""
        found = self.session.world.linearise(force_function(self.session))
        return Linearisation(
            found.geometric,
            found.gradients,
            found.stiffnesses,
            found.mass,
            found.displacement,
            found.turn,
            found.imbalance,
        )

    @contextmanager
    def in_run(self) -> Iterator[None]:
        """While this lasts, only the loop of `run` may advance the simulation."""
        self.refuse_in_run("run")
        self._running = True
        try:
            yield
        finally:
            self._running = False

    def refuse_in_run(self, what: str) -> None:
        """Refuse changes of the time or the state during a run, which would make its record wrong."""
        if self._running:
            raise RuntimeError(
                f"{what} cannot be called while the simulation runs. before_step may read, set values and hold "
                "rods; until and record may only read. Use a copy() for everything else"
            )

    @contextmanager
    def _convergence(self) -> Iterator[None]:
        """Give the engine's failures the names of this scene, and pass on its warnings."""
        world = self.session.world
        try:
            yield
        except _core.ConvergenceFailure as failure:
            error = convergence_error(self.session, failure.args)
            log_failure(error)
            raise error from None
        finally:
            forget_left_rings(self.session, world.take_left_rings())
            left, self.session.left_rings = self.session.left_rings, []
            pass_on([self.session], world.take_warnings())
            if left:
                rings = " and ".join(f"ring {name!r} (time {time:.6g} s)" for name, time in left)
                report_left(f"{rings}: released")


def convergence_error(session: Session, numbers: tuple[Any, ...]) -> ConvergenceError:
    """A failure of the engine, with the names of a scene."""
    message, time, step, rod, node, residual = numbers
    rods = session.directory.layout.rods
    of_rod = 0 <= rod < len(rods)  # else of a body, or of nothing
    name = rods[rod].name if of_rod else None
    return ConvergenceError(message, time, step, name, node if of_rod and node >= 0 else None, residual)


def pass_on(sessions: Sequence[Session], found: _core.Warnings) -> None:
    """Give the warnings of the engine: meshes, steps for motion and impacts, energy, branches and planes."""
    if found.mesh:
        warn(found.mesh, CoarseMeshWarning)
    for cause, coarse in ("motion", found.steps), ("impact", found.impact):
        if coarse and any(session.options.time_step > session.longest_meant for session in sessions):
            warn(coarse, CoarseStepWarning, cause)
    if found.drift:
        warn(found.drift, EnergyDriftWarning)
    if found.crossing:
        warn(found.crossing, RodCrossingWarning)
    if found.squeeze:
        warn(found.squeeze, SqueezedRodWarning)
    if found.branch:
        warn(found.branch, BranchChangedWarning)
    if found.plane:
        warn(found.plane, OutOfPlaneWarning)


def report_left(what: str) -> None:
    """Warn that a rod has left a ring, with the name of the ring and the consequence."""
    warn(f"the end of a rod has left {what}", RingLeftWarning)
