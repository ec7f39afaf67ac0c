"""Tables 9.2 and 9.3 of the dissertation from simulation: seven patterns, cables and floors, and ways to lay.

python benchmarks/deployment_tables.py [--quick] [--whole] [--cables 2] [--patterns circle ...] [--trials 0] [--refine]

By default cable 2 alone, which takes some 20 minutes of one thread; --whole takes cables 1 to 3 and three noisy trials
of each cell, and hours. Ctrl-C makes the tables of what there is. Cables are laid quasi-statically, but for the
intuitive way and noisy trials, at 2.5 cm/s: an upright cable buckles, falls and swings, and no row of equilibria
follows it. Errors are those of (9.11), point by point: the distance of each point of the cable from its place on the
pattern. The way "network" needs torch, and is left out without it.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from deployment_refining import refine
from reporting import OUT, Report, arguments, bar

from withe.deployment import Cable, Deployment, Pattern, Plan, deploy, place, plan
from withe.errors import ConvergenceError

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "data" / "patterns"
PATTERNS = ("line", "circle", "sine", "letterU", "letterC", "letterL", "letterA")
FRICTIONS = (0.2, 0.4, 0.7)
WAYS = ("placed", "exact", "network", "least_friction", "optimised", "intuitive")
# Mean errors of tables 9.2 and 9.3 [mm]: intuitive, then optimal, on fabric, steel and foam.
PUBLISHED = {
    "line": {1: "4-14, 1.4-2.5", 2: "5-17, 1.3-2.7", 3: "16-45, 4.7-7.8"},
    "circle": {1: "6-23, 1.5-2.2", 2: "16-25, 1.6-2.2", 3: "11-19, 2.7-2.9"},
    "sine": {1: "17-28, 2.7-2.9", 2: "16-42, 2.0-5.4", 3: "38-51, 4.6-4.7"},
    "letterU": {1: "14-36, 2.2-2.4", 2: "37-54, 1.7-2.1", 3: "37-45, 3.2-4.7"},
    "letterC": {1: "22-39, 2.2-4.1", 2: "46-67, 1.9-7.4", 3: "34-60, 3.5-5.6"},
    "letterL": {1: "9-11, 3.5-4.2", 2: "17-21, 2.9-6.6", 3: "24-33, 3.3-5.1"},
    "letterA": {1: "36-48, 4.7-5.8", 2: "50-52, 3.2-4.3", 3: "43-46, 5.2-8.1"},
}
NOISY_SPEED = 0.025  # [m/s]
SLIPPED = 1e-3  # [m]: what counts as a slip that should have been foreseen
NEAR = 2.0  # [Lgb] beside a stretch that friction does not hold, which moves with it
COLOURS = {
    "exact": "#3465a4",
    "network": "#75507b",
    "least_friction": "#e08214",
    "optimised": "#2e8b57",
    "intuitive": "#b2182b",
}


@dataclass(frozen=True)
class Cell:
    """One way to lay one cable along one pattern on one floor; no result where the engine found no equilibrium."""

    pattern: str
    cable: int
    friction: float
    way: str
    result: Deployment | None = None
    marks: str = ""
    unforeseen: float = 0.0  # [mm] of slip where no test foresaw any
    noisy: tuple[float, ...] = ()  # mean errors of trials [mm]

    @property
    def error(self) -> float:
        """Mean, point by point [mm]."""
        return np.nan if self.result is None else 1e3 * self.result.error

    def __str__(self) -> str:
        if self.result is None:
            return "none"
        noisy = f" ({np.mean(self.noisy):.1f})" if self.noisy else ""
        return f"{self.error:.2f} ± {1e3 * self.result.std:.2f}{noisy}"

    def nearest(self) -> str:
        """As text, from the nearest point of what was given."""
        if self.result is None:
            return "none"
        return f"{1e3 * self.result.nearest_error:.2f} ± {1e3 * self.result.nearest_std:.2f}"


class Patterns:
    """Patterns, and plans that do not depend on the floor, each made once."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes
        self._patterns: dict[str, Pattern] = {}
        self._plans: dict[tuple[str, int, str], Plan] = {}

    def pattern(self, name: str) -> Pattern:
        """As published, smoothed by at most a millimetre."""
        if name not in self._patterns:
            points = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", skip_header=1)
            self._patterns[name] = Pattern(points, nodes=self.nodes)
        return self._patterns[name]

    def plan(self, name: str, number: int, way: str, friction: float) -> Plan:
        """The published circle ends on its own beginning: laid over itself."""
        key = (name, number, way if way != "optimised" else f"{way} {friction}")
        if key not in self._plans:
            self._plans[key] = plan(
                Cable.dlo(number),
                self.pattern(name),
                way,
                friction=friction,
                speed=NOISY_SPEED,
                crossings="over",
                progress=False,
            )
        return self._plans[key]


def marks(motion: Plan, friction: float) -> str:
    """Tests that say that it will slip: f the floor, which is (9.2), l lift-off, e the free end, t tail, o overlap."""
    failed = {slip.test for slip in motion.feasibility(friction).slips}
    letters = {"floor": "f", "lift-off": "l", "free end": "e", "tail": "t", "overlap": "o"}
    return "".join(letter for test, letter in letters.items() if test in failed)


def unforeseen(motion: Plan, friction: float, found: Deployment) -> float:
    """Greatest slip away from all stretches that were said to slip [mm], zero below a millimetre."""
    near = NEAR * motion.cable.gravito_bending_length
    s = np.linspace(0.0, motion.cable.length, len(found.laid))
    away = np.ones(len(s), bool)
    said = motion.feasibility(friction)
    for slip in said.slips:
        away &= (s < slip.start - near) | (s > slip.end + near)
    worst = float(found.slipped[away].max(initial=0.0))
    return 1e3 * worst if worst > SLIPPED else 0.0


def carried_out(cell: Cell, patterns: Patterns, nodes: int, trials: int) -> Cell:
    """Lay through equilibria, or in time, and with noise in time."""
    planned = "exact" if cell.way == "placed" else cell.way
    try:
        motion = patterns.plan(cell.pattern, cell.cable, planned, cell.friction)
        if cell.way == "placed":
            return Cell(*_key(cell), result=place(motion, floor=cell.friction, nodes=nodes, progress=False))
        static = cell.way != "intuitive"
        found = deploy(motion, floor=cell.friction, quasi_static=static, nodes=nodes, progress=False)
    except ConvergenceError:
        return Cell(*_key(cell))
    foretold = cell.way in ("exact", "network", "least_friction")
    noisy = [
        1e3 * deploy(motion, floor=cell.friction, noise=1.0, seed=seed, nodes=nodes, progress=False).error
        for seed in range(trials)
    ]
    return Cell(
        *_key(cell),
        result=found,
        marks=marks(motion, cell.friction) if foretold else "",
        unforeseen=unforeseen(motion, cell.friction, found) if foretold else 0.0,
        noisy=tuple(noisy),
    )


def _key(cell: Cell) -> tuple[str, int, float, str]:
    return cell.pattern, cell.cable, cell.friction, cell.way


def tables(report: Report, cells: list[Cell], ways: tuple[str, ...]) -> None:
    """Means and standard deviations, point by point and from the nearest point, beside what was published."""
    rows, nearest = [], []
    found = {_key(cell): cell for cell in cells}
    for key in dict.fromkeys(_key(cell)[:3] for cell in cells):
        here = [found[(*key, way)] for way in ways]
        exact = found[(*key, "exact")]
        rows.append((*key, *here, exact.marks or "-", PUBLISHED[key[0]][key[1]]))
        nearest.append((*key, *(cell.nearest() for cell in here)))
    header = ("pattern", "DLO", "friction", *ways)
    report.table(
        "Mean and standard deviation, point by point [mm]",
        (*header, "will slip", "published: intuitive, optimal"),
        rows,
    )
    report.table("The same, from the nearest point of what was given [mm]", header, nearest)
    report.figures["slips that no test foresaw"] = [
        f"{c.pattern}, DLO {c.cable}, {c.friction:g}, {c.way}: {c.unforeseen:.1f} mm" for c in cells if c.unforeseen
    ]
    report.figures["without equilibrium"] = [" ".join(map(str, _key(cell))) for cell in cells if cell.result is None]


def goals(report: Report, cells: list[Cell], patterns: Patterns) -> None:
    """What the ways of laying are to reach beside each other."""
    error = {_key(cell): cell.error for cell in cells}
    keys = list(dict.fromkeys(_key(cell)[:3] for cell in cells))

    def over_exact(way: str, among: list) -> list[float]:
        ratios = [error[(*key, way)] / error[(*key, "exact")] for key in among if (*key, way) in error]
        return [ratio for ratio in ratios if np.isfinite(ratio)]

    def median(values: list[float]) -> float | None:
        return float(np.median(values)) if values else None

    held = []
    for name, number, friction in keys:
        lift_off = patterns.plan(name, number, "exact", friction).feasibility(friction).lift_off[3:-3].max()
        if name != "letterC" and friction > lift_off + 0.1:
            held.append(error[name, number, friction, "exact"] - error[name, number, friction, "placed"])
    report.goal("exact beyond placed where friction holds, most [mm]", max(held, default=None), 1.5, at_least=False)
    slipping = [key for key in keys if error[(*key, "exact")] > 1.0]
    report.goal(
        "least_friction over exact, median above 1 mm",
        median(over_exact("least_friction", slipping)),
        0.75,
        at_least=False,
    )
    letter = over_exact("least_friction", [key for key in keys if key[0] == "letterA"])
    report.goal("least_friction over exact, letter A, worst", max(letter, default=None), 0.5, at_least=False)
    report.goal(
        "optimised over exact, median above 1 mm", median(over_exact("optimised", slipping)), 0.4, at_least=False
    )
    learned = [abs(error[(*key, "network")] - error[(*key, "exact")]) for key in keys if (*key, "network") in error]
    learned = [away for away in learned if np.isfinite(away)]
    report.goal("network from exact, most [mm]", max(learned, default=None), 0.5, at_least=False)
    report.goal("intuitive over exact, median", median(over_exact("intuitive", keys)), 6.0)
    report.goal(
        "cells with a slip that no test foresaw", sum(cell.unforeseen > 0.0 for cell in cells), 0, at_least=False
    )
    noisy = [float(np.mean(cell.noisy)) for cell in cells if cell.noisy and cell.way == "exact" and cell.error <= 2.0]
    if noisy:
        report.goal("noisy trials where exact misses by at most 2 mm, most [mm]", max(noisy), 5.0, at_least=False)


def draw(cells: list[Cell], patterns: Patterns, number: int) -> None:
    """Laid shapes over the patterns, a row a pattern and a column a floor."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(cell.pattern for cell in cells))
    frictions = list(dict.fromkeys(cell.friction for cell in cells))
    figure, axes = plt.subplots(
        len(frictions),
        len(names),
        figsize=(2.4 * len(names), 2.6 * len(frictions) + 0.5),
        squeeze=False,
        layout="constrained",
    )
    for (row, friction), (column, name) in product(enumerate(frictions), enumerate(names)):
        panel = axes[row, column]
        pattern = patterns.pattern(name)
        panel.plot(*(1e3 * pattern.raw.T), color="0.8", lw=5, solid_capstyle="round", label="pattern")
        errors = []
        for cell in cells:
            if (
                (cell.pattern, cell.cable, cell.friction) == (name, number, friction)
                and cell.result
                and cell.way in COLOURS
            ):
                s = np.linspace(0.0, 1.0, len(cell.result.laid))
                on = s * patterns.plan(name, number, "exact", friction).cable.length <= pattern.length
                line = "--" if cell.way == "intuitive" else "-"
                panel.plot(*(1e3 * cell.result.laid[on, :2].T), line, color=COLOURS[cell.way], lw=1, label=cell.way)
                errors.append(f"{cell.error:.1f}")
        panel.set_title(" / ".join(errors) + " mm", fontsize=8)
        panel.set(aspect="equal", xticks=[], yticks=[])
        if column == 0:
            panel.set_ylabel(f"friction {friction:g}")
        if row == len(frictions) - 1:
            panel.set_xlabel(f"{name}, {1e3 * pattern.length:.0f} mm")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    figure.suptitle(f"Cable {number} as it was laid, and mean errors in the order of the legend", fontsize=10)
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / f"deployment_tables_{number}.png", dpi=150)
    plt.close(figure)


def main() -> None:
    """Lay, list, compare."""
    options = arguments(
        __doc__,
        ("--whole", {"action": "store_true", "help": "cables 1 to 3, and three noisy trials of each cell"}),
        ("--cables", {"nargs": "*", "type": int, "choices": (1, 2, 3), "default": [2]}),
        ("--patterns", {"nargs": "*", "choices": PATTERNS, "default": list(PATTERNS)}),
        ("--frictions", {"nargs": "*", "type": float, "default": list(FRICTIONS)}),
        ("--ways", {"nargs": "*", "choices": WAYS, "default": list(WAYS)}),
        ("--trials", {"type": int, "default": 0, "help": "noisy trials of each cell"}),
        ("--nodes", {"type": int, "default": 200, "help": "of the cable"}),
        ("--refine", {"action": "store_true", "help": "instead: meshes and half the speed, in five cells"}),
    )
    if options.refine:
        report = Report("deployment_refining")
        refine(report, Patterns(301).plan)
        report.write()
        return
    cables, trials = ([1, 2, 3], 3) if options.whole else (options.cables, options.trials)
    ways = tuple(way for way in WAYS if way in options.ways or way in ("placed", "exact"))
    if importlib.util.find_spec("torch") is None:
        ways = tuple(way for way in ways if way != "network")
    names, frictions, nodes = options.patterns, options.frictions, options.nodes
    if options.quick:
        names, frictions, ways, nodes = ["letterU"], [0.4], ("placed", "exact"), 60
    report = Report("deployment_tables", quick=options.quick)
    patterns, cells = Patterns(100 if options.quick else 301), []
    todo = [
        [Cell(name, number, friction, way) for way in ways]
        for number, name, friction in product(cables, names, frictions)
    ]
    with bar(len(todo), "laying", "floors") as shown:
        try:
            for row in todo:
                found = [carried_out(cell, patterns, nodes, trials) for cell in row]
                cells += found
                print(*_key(row[0])[:3], *found, found[ways.index("exact")].marks, sep="  ", flush=True)
                shown.advance(1)
        except KeyboardInterrupt:
            report.figures["interrupted"] = f"{len(cells) // len(ways)} of {len(todo)} rows"
    if not cells:
        return
    tables(report, cells, ways)
    goals(report, cells, patterns)
    for number in dict.fromkeys(cell.cable for cell in cells):
        draw([cell for cell in cells if cell.cable == number], patterns, number)
    report.write()


if __name__ == "__main__":
    main()
