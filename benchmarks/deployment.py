"""Cables that are laid down: how exact grasps are and how long they take, and what friction published patterns need.

python benchmarks/deployment.py [--quick]
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from deployment_network import compare
from reporting import Report, arguments, bar, processor_seconds

from withe.deployment import Cable, Feasibility, Pattern, StraightLine, grasp, plan

DATA = Path(__file__).resolve().parent.parent / "tests" / "data"
PATTERNS = ("line", "circle", "sine", "letterU", "letterC", "letterL", "letterA")
LONG = 45.0  # [Lgb]; the rods of the experiments are up to 49 long


def _table(report: Report) -> None:
    """Every tabulated grasp, and the known optima of a straight line."""
    rows = np.genfromtxt(DATA / "rod_grasps.csv", delimiter=",", names=True)
    found = grasp(rows["lsbar"], rows["kappabar"], rows["ksbar"])

    def off(values: np.ndarray, *names: str) -> float:
        return float(np.abs(values - np.stack([rows[name] for name in names], -1)).max())

    report.goal("table: position, most off [Lgb]", off(found.position, "x", "y", "z"), 1e-4, at_least=False)
    report.goal("table: rotation vector, most off [rad]", off(found.rotation, "ex", "ey", "ez"), 1e-4, at_least=False)
    force = off(found.force[:, 1:], "Fy_over_wLgb", "Fz_over_wLgb")
    report.goal("table: force, most off [w Lgb]", force, 1e-4, at_least=False)
    line = StraightLine(20.0, 1e9)
    numbers = [line.gentle.force[1], line.gentle.x, line.folded.force[1], line.folded.x]
    apart = np.abs(np.array(numbers) - [1.515310, 2.566219, 4.913426, -3.656735]).max()
    report.goal("straight line: both optima, most off", apart, 1e-5, at_least=False)
    curvature = np.linspace(0.0, 4.0, 17)
    change = np.abs(grasp(7.0, curvature).force - grasp(LONG, curvature).force).max()
    report.goal("forces: change beyond 7 Lgb [w Lgb]", change, 1e-3, at_least=False)


def _speed(report: Report, quick: bool) -> None:
    """One thread: a grasp, and a whole pattern."""
    count, repeats = (20, 1) if quick else (200, 7)
    curvature = np.linspace(0.0, 4.0, count)
    grasp(1.0, 0.0)  # makes the table
    rows = []
    for suspended in (1.5, 4.0, 7.0, 14.0, 28.0, 50.0):
        took = 1e3 * processor_seconds(lambda length=suspended: grasp(length, curvature), repeats) / count
        rows.append((f"{suspended:g}", f"{took:.3f}"))
        if suspended in (7.0, 50.0):
            report.goal(f"a grasp at {suspended:g} Lgb [ms]", took, {7.0: 0.3, 50.0: 2.0}[suspended], at_least=False)
    report.table("A grasp, mean over curvatures to 4 / Lgb", ("suspended [Lgb]", "ms"), rows)
    pattern = Pattern(_points("sine"), nodes=200)
    cable = Cable.dlo(2)
    suspended = (cable.length - pattern.arc_length) / cable.gravito_bending_length
    bends = -pattern.curvature * cable.gravito_bending_length
    took = processor_seconds(lambda: grasp(suspended, bends, cable.stretch_stiffness), repeats)
    report.goal("a pattern of 200 nodes exactly, DLO 2 [s]", took, 0.15, at_least=False)
    report.figures["plan of the sine, whole motion [s]"] = processor_seconds(
        lambda: plan(cable, pattern), min(3, repeats)
    )


def _points(name: str) -> np.ndarray:
    return np.genfromtxt(DATA / "patterns" / f"{name}.csv", delimiter=",", skip_header=1)


def _friction(report: Report, quick: bool) -> None:
    """Needed coefficients of the seven patterns: on the floor, at lift-off, and there with a push along the cable."""
    names = PATTERNS[1:2] if quick else PATTERNS
    numbers = (2,) if quick else (1, 2, 3)
    rows, saved = [], []
    with bar(len(names) * len(numbers), "patterns") as shown:
        for name in names:
            pattern = Pattern(_points(name))
            for number in numbers:
                cable = Cable.dlo(number)
                exact = pattern.feasibility(cable, 0.4)
                pushed = pattern.feasibility(cable, 0.4, "least_friction")
                inner = slice(3, -3)
                needs = [found[inner].max() for found in (exact.floor, exact.lift_off, pushed.lift_off)]
                saved.append(needs[2] / needs[1] if needs[1] > 0.05 else 1.0)
                slips, pulled = (_stretch(exact, tests) for tests in (("floor", "lift-off"), ("tail", "overlap")))
                rows.append((name, number, *(f"{need:.2f}" for need in needs), f"{slips:.0f}", f"{pulled:.0f}"))
                shown.advance(1)
    slipping = ("slips at .4 [mm]", "else pulled or pushed aside by itself [mm]")
    header = ("pattern", "DLO", "floor", "lift-off", "lift-off, least friction", *slipping)
    report.table("Needed coefficient of friction, greatest along the pattern (smoothed by 1 mm)", header, rows)
    report.figures["friction with a push over without, median"] = float(np.median(saved))


def _stretch(found: Feasibility, tests: tuple[str, ...]) -> float:
    """Length of a pattern that fails at least one of some tests [mm]."""
    s = found.arc_length
    fails = np.zeros(len(s), bool)
    for slip in found.slips:
        if slip.test in tests:
            fails |= (s >= slip.start) & (s <= slip.end)
    return 1e3 * float(s[1] * fails.sum())


def main() -> None:
    """Measure, print and write."""
    options = arguments(__doc__)
    report = Report("deployment", quick=options.quick)
    _table(report)
    _speed(report, options.quick)
    compare(report, options.quick)
    _friction(report, options.quick)
    report.write()


if __name__ == "__main__":
    main()
