"""The stress test: violent scenes over the whole range of parameters, every result judged.

    python benchmarks/robustness.py [--cases 500] [--first 0] [--case 123] [--set undamped] [--seed 20240917]

There are two sets of cases: without damping, and the same scenes with a viscosity that damps the slowest mode by 0.1 to
10 % of its critical damping, as that of materials does.

A case is accepted when it ends within 5 s (processor time) with default settings, every number is finite, and
- the energy never exceeds what start, supports, loads and actuation have put in by more than 1 %;
- energy-momentum steps close the balance of energy to 1e-6;
- forces balance when they are summed again by `balance`, which shares no code with the engine;
- a static or error-controlled result agrees with a finer run to 2 % of the length.

Chaotic motion is compared only until two finer runs part by 2 % of the length. A twin, whose event is weaker by 1e-9,
must part from its finer run by as much, or the motion does not count as chaotic. All other conditions hold for the
whole run. A result is also accepted if the finer run takes longer than 30 s; the report counts these results.

A refusal is accepted where a read-out of the scene confirms the reason: an event that changes the curvature at once by
so much that the inner fibre is compressed to nothing. Other named errors are not accepted, but are no defects as long
as the world stays usable. Each case may be run by its number.
"""

from __future__ import annotations

import collections
import functools
import math
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import balance
import numpy as np
from judging import CRASH, case_options, judge_all, judge_one, report_verdicts
from reporting import Report
from stress_cases import METHODS, SEED, StressCase, build, draw_case, events, natural_curvature_of

import withe

LIMIT = 5.0  # [s]
APART = 0.02  # greatest distance of two results of a motion, over the length
TWIN = 1e-9  # by how much the event of a twin is weaker
SETS = ("undamped", "damped")


@dataclass
class Verdict:
    """Result of a case: `reason` is empty if it was accepted.

    `balanced`: true if its forces were summed again. `refused`: true if an accepted case ended in a refusal.
    `compared`: false if the finer run took too long. `horizon`: share of the run in which a chaotic motion was
    compared.
    """

    number: int
    reason: str = ""
    detail: str = ""
    seconds: float = 0.0
    excess: float = 0.0
    residual: float = 0.0
    balanced: bool = False
    apart: float = 0.0
    dimensions: int = 3
    refused: bool = False
    compared: bool = True
    horizon: float = 1.0


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
    """Positions after each step of a dynamic case; the clock counts building and stepping only."""
    start = time.thread_time()
    simulation = build(case)
    spent = time.thread_time() - start
    shapes = []
    verdict.dimensions = 2 if simulation.plan.planar else 3
    ledger = _Ledger(simulation, case)
    for i in range(case.steps):
        start = time.thread_time()
        if i in (0, case.steps // 2):
            events(case, simulation, int(i > 0))
        spent += time.thread_time() - start
        before = balance.look(simulation) if i == case.steps - 1 else None
        start = time.thread_time()
        try:
            simulation.step()
        except withe.ConvergenceError as error:
            if "inner fibre" not in str(error):
                raise
            _check_refusal(case, simulation, i, str(error))
            verdict.refused = True
            return []
        spent += time.thread_time() - start
        shapes.append(simulation.positions())
        verdict.seconds = spent
        if spent > LIMIT:
            raise _RejectedError("slow", f"{100 * (i + 1) / case.steps:.0f} % done after {LIMIT:g} s")
        ledger.check()
        verdict.excess = ledger.excess
        if before is not None:
            _check_balance(case, simulation, before, verdict)
    _check_finite(simulation)
    return shapes


def _check_refusal(case: StressCase, simulation: withe.Simulation, step: int, message: str) -> None:
    """Reject a refusal that a read-out does not confirm."""
    natural = natural_curvature_of(case, int(step >= case.steps // 2))
    change = np.linalg.norm(simulation.curvatures("rod") - natural, axis=1).max()
    if step not in (0, case.steps // 2) or change * case.radius < 0.99:
        raise _RejectedError("unfounded refusal", message)


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
    """Compare static and error-controlled results with a finer run; one that takes too long is no judge."""
    if case.method == "static":
        finer = _within_limit(case, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-11))
    elif case.method == "error-controlled":
        finer = _within_limit(case, tolerance=1e-4 * case.length)
    else:
        return
    verdict.compared = finer is not None
    if finer is None:
        return
    # A motion is compared at its end, equilibria are compared after each event.
    apart = _apart(case, finer, shapes)
    verdict.apart = apart.max() if case.method == "static" else apart[-1]
    if verdict.apart > APART and case.method == "error-controlled":
        verdict.horizon = _horizon(case, finer)
        verdict.apart = apart[: round(verdict.horizon * case.steps)].max(initial=0.0)
    if verdict.apart > APART:
        raise _RejectedError("differs from a finer run", f"{100 * verdict.apart:.2g} % of the length")


def _horizon(case: StressCase, finer: list[np.ndarray]) -> float:
    """Return the share of a run after which a chaotic motion cannot be known; 1 where it is not chaotic."""
    finest = _within_limit(case, tolerance=3e-5 * case.length)
    strength = case.curvature * case.length if case.event == "flip" else case.strength  # curvatures have a bound
    twin = _within_limit(replace(case, strength=(1.0 - TWIN) * strength), tolerance=1e-4 * case.length)
    if finest is None or twin is None or _apart(case, twin, finer).max() <= APART:
        return 1.0
    apart = _apart(case, finest, finer) > APART
    return float(np.argmax(apart) if apart.any() else len(apart)) / case.steps


def _within_limit(case: StressCase, **changes: object) -> list[np.ndarray] | None:
    """Return the shapes of a case with other options; None if it takes too long."""
    try:
        with _clock(6 * LIMIT):
            return _shapes(case, build(case, **changes))
    except _RejectedError:
        return None
    except withe.ConvergenceError as error:
        raise _RejectedError("finer run failed", str(error)) from None


def _shapes(case: StressCase, simulation: withe.Simulation) -> list[np.ndarray]:
    """Positions after each event, or after each step of the motion."""
    shapes = []
    for i in range(2 if case.method == "static" else case.steps):
        if case.method == "static":
            events(case, simulation, i)
            simulation.equilibrium()
        else:
            if i in (0, case.steps // 2):
                events(case, simulation, int(i > 0))
            simulation.step()
        shapes.append(simulation.positions())
    return shapes


def _apart(case: StressCase, a: list[np.ndarray], b: list[np.ndarray]) -> np.ndarray:
    """Greatest distances of nodes, over the length, per shape."""
    return np.array([np.linalg.norm(p - q, axis=1).max() for p, q in zip(a, b, strict=True)]) / case.length


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


def judge(number: int, draw: Callable[[int], StressCase] = draw_case) -> Verdict:
    """Run a case and return its outcome."""
    case, verdict = draw(number), Verdict(number)
    try:
        with _clock(1.5 * LIMIT):
            shapes = (_static if case.method == "static" else _run)(case, verdict)
        if not verdict.refused:
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


def _report_set(report: Report, name: str, cases: list[StressCase], verdicts: list[Verdict]) -> Counter[str]:
    """Write the tables and goals of a set, and return how often each reason was given."""
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
        name,
    )
    kinds = collections.Counter(
        (case.method, verdict.reason) for case, verdict in zip(cases, verdicts, strict=True) if verdict.reason
    )
    rows = [(method, reason, count) for (method, reason), count in sorted(kinds.items())]
    report.table(f"Not accepted, by method and reason: {name}", ("method", "reason", "cases"), rows)
    unseen = [v for v in verdicts if not v.reason and not v.compared]
    chaotic = [v for v in verdicts if not v.reason and v.horizon < 1.0]
    report.table(
        f"Accepted with a remark: {name}",
        ("remark", "cases", "numbers"),
        [
            ("refused: the inner fibre would be compressed to nothing", *_listed(v for v in verdicts if v.refused)),
            ("not compared: the finer run takes longer than 30 s", *_listed(unseen)),
            ("chaotic, compared for a share of the run", *_listed(chaotic)),
        ],
    )
    if chaotic:
        report.table(
            f"Horizon of chaotic motion: {name}",
            ("case", "share of the run that was compared"),
            [(verdict.number, f"{verdict.horizon:.2f}") for verdict in chaotic],
        )
    good = [not verdict.reason for verdict in verdicts]
    controlled = [ok for ok, case in zip(good, cases, strict=True) if case.method == "error-controlled"]
    damped = name == "damped"
    report.goal(f"accepted of all {name} cases", sum(good) / len(good), 0.97 if damped else 0.93)
    if controlled:
        report.goal(
            f"accepted of {name} error-controlled cases",
            sum(controlled) / len(controlled),
            0.95 if damped else 0.88,
        )
    report.goal(f"accepted without a comparison, {name}", len(unseen) / len(good), 0.02, at_least=False)
    return reasons


def _listed(verdicts: Iterable[Verdict]) -> tuple[int, str]:
    """Return how many verdicts there are, and their numbers."""
    numbers = [verdict.number for verdict in verdicts]
    return len(numbers), " ".join(map(str, numbers))


def main() -> None:
    """Judge cases and report."""
    options = case_options(
        __doc__,
        500,
        ("--set", {"choices": SETS, "help": "only this set (default: both)"}),
        ("--seed", {"type": int, "default": SEED, "help": "of the drawn scenes (default: %(default)s)"}),
    )
    sets = SETS if options.set is None else (options.set,)
    if options.case is not None:
        draw = functools.partial(draw_case, seed=options.seed, damped=sets[-1] == "damped" and len(sets) == 1)
        judge_one(functools.partial(judge, draw=draw), draw, options.case)
    count = 2 if options.quick else options.cases
    report = Report("robustness", quick=options.quick)
    reasons: Counter[str] = collections.Counter()
    for name in sets:
        draw = functools.partial(draw_case, seed=options.seed, damped=name == "damped")
        numbers = list(range(options.first, options.first + count))
        verdicts = judge_all(functools.partial(judge, draw=draw), Verdict, numbers, f"stress test, {name}")
        reasons += _report_set(report, name, [draw(number) for number in numbers], verdicts)
    report.goal("crashes, hangs, NaN", reasons[CRASH] + reasons["not finite"], 0, at_least=False)
    report.goal("energy out of nowhere", reasons["energy out of nowhere"], 0, at_least=False)
    report.goal("refusals without a reason", reasons["unfounded refusal"], 0, at_least=False)
    report.write()


if __name__ == "__main__":
    main()
