"""The stress test of contact: impacts, piles and knots over the whole range of parameters, every step judged.

    python benchmarks/contact_robustness.py [--cases 100] [--first 0] [--case 12]

A case is accepted when its 60 steps end within 10 s (processor time) with default settings, and after every step
- no surfaces are deeper in each other than a twentieth of a radius;
- the energy, less what supports have put in, has not grown by more than 1 % of the greatest;
- every number is finite.
A named error is not accepted, but is no defect. There is one exception. A knot cannot be pulled as far as its grips are
told to go. An error is accepted there if the grips have reached the tight knot, and nothing else was wrong before.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from contact_cases import KINDS, LAWS, METHODS, STEPS, ContactCase, build, draw_case
from judging import case_options, judge_all, judge_one, report_verdicts
from reporting import Report

import withe

LIMIT = 10.0  # [s]
DEEPEST, GROWTH = 0.05, 0.01
# Length minus distance of the ends of a tight knot, over the radius: n = 1, 2.
TIGHT = (45.0, 80.0)


@dataclass
class Verdict:
    """Result of a case: `reason` is empty if it was accepted."""

    number: int
    reason: str = ""
    detail: str = ""
    seconds: float = 0.0
    steps: int = 0
    deepest: float = 0.0
    growth: float = 0.0


def _is_tight(case: ContactCase, simulation: withe.Simulation) -> bool:
    if case.kind != "knot":
        return False
    x = simulation.positions("rope")
    return bool(case.length - np.linalg.norm(x[-1] - x[0]) < TIGHT[case.number % 2] * case.radius)


def judge(number: int) -> Verdict:
    """Run a case and return its outcome."""
    case, verdict = draw_case(number), Verdict(number)
    simulation = build(case)
    energy = simulation.energy()
    least = energy.total - energy.work
    greatest = abs(energy.kinetic + energy.stretch + energy.bend + energy.twist)
    start = time.thread_time()
    try:
        for _ in range(STEPS):
            simulation.step()
            verdict.steps += 1
            verdict.seconds = time.thread_time() - start
            energy = simulation.energy()
            if not np.isfinite(energy.total) or not np.isfinite(simulation.positions()).all():
                verdict.reason = "not finite"
            gaps = simulation.contacts()["gap"]
            verdict.deepest = max(verdict.deepest, -float(gaps.min(initial=0.0)) / case.radius)
            greatest = max(greatest, energy.kinetic + energy.stretch + energy.bend + energy.twist)
            kept = energy.total - energy.work
            verdict.growth = max(verdict.growth, (kept - least) / greatest)
            least = min(least, kept)
            if verdict.deepest > DEEPEST:
                verdict.reason, verdict.detail = "too deep", f"{verdict.deepest:.3f} of a radius"
            elif verdict.growth > GROWTH:
                verdict.reason, verdict.detail = "energy grows", f"{100.0 * verdict.growth:.2g} %"
            elif verdict.seconds > LIMIT:
                verdict.reason, verdict.detail = "slow", f"{verdict.steps} of {STEPS} steps in {LIMIT:g} s"
            if verdict.reason:
                break
    except withe.ConvergenceError as error:
        if not _is_tight(case, simulation):
            verdict.reason, verdict.detail = "ConvergenceError", str(error)
    except Exception as error:
        verdict.reason, verdict.detail = type(error).__name__, str(error)
    return verdict


def main() -> None:
    """Judge cases and report."""
    options = case_options(__doc__, 100)
    if options.case is not None:
        judge_one(judge, draw_case, options.case)
    count = len(KINDS) if options.quick else options.cases
    numbers = list(range(options.first, options.first + count))
    verdicts = judge_all(judge, Verdict, numbers, "stress test of contact")
    report = Report("contact_robustness", quick=options.quick)
    reasons = report_verdicts(
        report,
        [draw_case(number) for number in numbers],
        verdicts,
        {"kind": ("kind", KINDS), "integrator": ("method", METHODS), "friction model": ("law", LAWS)},
        {
            "kind": lambda c: c.kind,
            "method": lambda c: c.method,
            "friction": lambda c: f"{c.law} {c.friction:.2f}",
            "nodes": lambda c: c.nodes,
            "speed": lambda c: f"{c.speed:.3g}",
            "coarseness": lambda c: f"{c.coarseness:.3g}",
        },
    )
    report.goal("accepted of all cases", sum(not v.reason for v in verdicts) / count, 0.9)
    report.goal("too deep where accepted", reasons["too deep"], 0, at_least=False)
    report.goal("energy grows", reasons["energy grows"], 0, at_least=False)
    report.write()


if __name__ == "__main__":
    main()
