"""The stress test: violent scenes over the whole range of parameters, every result judged.

    python benchmarks/robustness.py [--cases 500] [--first 0] [--case 123]

A case is accepted when it ends within 5 s (processor time) with default settings, every number is finite, and
- the energy never exceeds what start, supports, loads and actuation have put in by more than 1 %;
- energy-momentum steps close the balance of energy to 1e-6;
- forces balance when they are summed again by `balance`, which shares no code with the engine;
- a static or error-controlled result agrees with a finer run to 2 % of the length.
A named error is not accepted, but is no defect as long as the world stays usable. Each case may be run by its number.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import balance
import numpy as np
from judging import CRASH, case_options, judge_all, judge_one, report_verdicts
from reporting import Report
from stress_cases import METHODS, StressCase, build, draw_case, events

import withe

LIMIT = 5.0  # [s]


@dataclass
class Verdict:
    """Result of a case: `reason` is empty if it was accepted, `balanced` is true if its forces were summed again."""

    number: int
    reason: str = ""
    detail: str = ""
    seconds: float = 0.0
    excess: float = 0.0
    residual: float = 0.0
    balanced: bool = False
    apart: float = 0.0
    dimensions: int = 3


class _RejectedError(Exception):
    """Why a result is not accepted."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(reason)
        self.reason, self.detail = reason, detail


@contextmanager
def _clock(seconds: float) -> Iterator[None]:
    """Stop a run after a given processor time, like Ctrl-C, also within the engine."""

    def ring(*_: object) -> None:
        raise _RejectedError("slow", f"not done after {seconds:g} s")

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


class _Ledger:
    """Energy in store against energy put in."""

    def __init__(self, simulation: withe.Simulation, case: StressCase) -> None:
        self._simulation, self._case = simulation, case
        energy = simulation.energy()
        self._start = self._stored(energy) + energy.gravity + energy.loads - energy.work
        self._gravity, self._loads = energy.gravity, energy.loads
        # Rounding errors cause some energy even at rest: a rod bent by 1e-4 rad has more.
        self._scale = max(self._stored(energy), 1e-9 * case.stiffness / case.length)
        self.excess = 0.0

    @staticmethod
    def _stored(energy: withe.Energy) -> float:
        return energy.kinetic + energy.stretch + energy.bend + energy.twist

    def check(self) -> None:
        """Judge the present state."""
        energy = self._simulation.energy()
        stored = self._stored(energy)
        put_in = self._start + energy.work - energy.gravity - energy.loads
        self._scale = max(self._scale, abs(put_in))
        excess = (stored + energy.dissipated - put_in) / self._scale
        if not math.isfinite(excess):
            raise _RejectedError("not finite", f"energy {energy}")
        exact = self._case.method == "energy_momentum"
        self.excess = max(self.excess, abs(excess) if exact else excess)
        if excess > 0.01:
            raise _RejectedError("energy out of nowhere", f"{100 * excess:.3g} % at t = {self._simulation.time:g} s")
        if exact and abs(excess) > 1e-6:
            raise _RejectedError("balance of energy", f"{excess:.2g} at t = {self._simulation.time:g} s")


def _check_finite(simulation: withe.Simulation) -> None:
    for name in ("positions", "velocities"):
        if not np.all(np.isfinite(getattr(simulation, name)())):
            raise _RejectedError("not finite", name)


def _run(case: StressCase, verdict: Verdict) -> list[np.ndarray]:
    """All of a dynamic case; the clock counts building and stepping only."""
    start = time.thread_time()
    simulation = build(case)
    spent = time.thread_time() - start
    verdict.dimensions = 2 if simulation.plan.planar else 3
    ledger = _Ledger(simulation, case)
    for i in range(case.steps):
        start = time.thread_time()
        if i in (0, case.steps // 2):
            events(case, simulation, int(i > 0))
        spent += time.thread_time() - start
        before = balance.look(simulation) if i == case.steps - 1 else None
        start = time.thread_time()
        simulation.step()
        spent += time.thread_time() - start
        verdict.seconds = spent
        if spent > LIMIT:
            raise _RejectedError("slow", f"{100 * (i + 1) / case.steps:.0f} % done after {LIMIT:g} s")
        ledger.check()
        verdict.excess = ledger.excess
        if before is not None:
            _check_balance(case, simulation, before, verdict)
    _check_finite(simulation)
    return [simulation.positions()]


def _check_balance(case: StressCase, simulation: withe.Simulation, before: balance.Look, verdict: Verdict) -> None:
    _judge_balance(balance.residual(case, simulation, before), verdict)


def _judge_balance(found: float | None, verdict: Verdict) -> None:
    if found is None:
        return
    verdict.balanced = True
    verdict.residual = max(verdict.residual, found)
    if not found < 1.0:
        raise _RejectedError("forces out of balance", f"{found:.2g} times what is allowed")


def _static(case: StressCase, verdict: Verdict) -> list[np.ndarray]:
    start = time.thread_time()
    simulation = build(case)
    verdict.dimensions = 2 if simulation.plan.planar else 3
    shapes = []
    for moment in (0, 1):
        events(case, simulation, moment)
        found = simulation.equilibrium()
        verdict.seconds = time.thread_time() - start
        if verdict.seconds > LIMIT:
            raise _RejectedError("slow", f"{verdict.seconds:.1f} s, {found.iterations} iterations")
        _check_finite(simulation)
        # A planar scene need not be stable against motion out of the plane.
        if not found.stable and not (simulation.plan.planar and simulation.linearise().stability == "stable"):
            raise _RejectedError("unstable equilibrium", f"after {found.iterations} iterations")
        _judge_balance(balance.static_residual(case, simulation, moment), verdict)
        shapes.append(simulation.positions())
    return shapes


def _compare(case: StressCase, shapes: list[np.ndarray], verdict: Verdict) -> None:
    """Static and error-controlled results with a finer run; one that takes too long is no judge."""
    if case.method == "static":
        finer = build(case, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-11))
    elif case.method == "error-controlled":
        finer = build(case, tolerance=1e-4 * case.length)
    else:
        return
    try:
        with _clock(6 * LIMIT):
            found = _shapes(case, finer)
    except _RejectedError:
        return
    except withe.ConvergenceError as error:
        raise _RejectedError("finer run failed", str(error)) from None
    verdict.apart = max(_apart(case, a, b) for a, b in zip(found, shapes, strict=True))
    if verdict.apart > 0.02:
        raise _RejectedError("differs from a finer run", f"{100 * verdict.apart:.2g} % of the length")


def _shapes(case: StressCase, simulation: withe.Simulation) -> list[np.ndarray]:
    """After each event, or at the end of the motion."""
    shapes = []
    for moment in (0, 1):
        events(case, simulation, moment)
        if case.method == "static":
            simulation.equilibrium()
        else:
            simulation.step(case.steps - case.steps // 2 if moment else case.steps // 2)
        shapes.append(simulation.positions())
    return shapes if case.method == "static" else shapes[-1:]


def _apart(case: StressCase, a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b, axis=1).max()) / case.length


def _usable(case: StressCase) -> str:
    """Return the defect of a world after a named error; empty if there is none."""
    simulation = build(case)
    try:
        with _clock(3 * LIMIT):
            _shapes(case, simulation)
    except _RejectedError:
        return ""
    except withe.ConvergenceError:
        finite = all(np.all(np.isfinite(value)) for value in (simulation.positions(), simulation.velocities()))
        simulation.reset()
        simulation.energy()
        return "" if finite else "state is not finite after an error"
    return ""


def judge(number: int) -> Verdict:
    """Run a case and return its outcome."""
    case, verdict = draw_case(number), Verdict(number)
    try:
        with _clock(1.5 * LIMIT):
            shapes = (_static if case.method == "static" else _run)(case, verdict)
        _compare(case, shapes, verdict)
    except _RejectedError as error:
        verdict.reason, verdict.detail = error.reason, error.detail
    except withe.ConvergenceError as error:
        verdict.reason, verdict.detail = "ConvergenceError", str(error)
        if verdict.seconds < LIMIT:
            trouble = _usable(case)
            verdict.reason = trouble or verdict.reason
    except Exception as error:
        verdict.reason, verdict.detail = type(error).__name__, str(error)
    return verdict


def main() -> None:
    """Judge cases and report."""
    options = case_options(__doc__, 500)
    if options.case is not None:
        judge_one(judge, draw_case, options.case)
    count = 2 if options.quick else options.cases
    verdicts = judge_all(judge, Verdict, list(range(options.first, options.first + count)), "stress test")
    report = Report("robustness", quick=options.quick)
    cases = [draw_case(verdict.number) for verdict in verdicts]
    reasons = report_verdicts(
        report,
        cases,
        verdicts,
        {
            "method": ("method", tuple(dict.fromkeys(METHODS))),
            "event": ("event", sorted({case.event for case in cases})),
        },
        {
            "method": lambda c: c.method,
            "event": lambda c: c.event,
            "nodes": lambda c: c.nodes,
            "slenderness": lambda c: f"{c.slenderness:.0f}",
            "coarseness": lambda c: f"{c.coarseness:.3g}",
            "strength": lambda c: f"{c.strength:.3g}",
        },
    )
    report.goal("accepted of all cases", sum(not verdict.reason for verdict in verdicts) / count, 0.95)
    report.goal("crashes, hangs, NaN", reasons[CRASH] + reasons["not finite"], 0, at_least=False)
    report.goal("energy out of nowhere", reasons["energy out of nowhere"], 0, at_least=False)
    report.write()


if __name__ == "__main__":
    main()
