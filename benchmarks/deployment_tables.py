"""Tables 9.2 and 9.3 of the dissertation from simulation: seven patterns, cables and floors, and ways to lay.

python benchmarks/deployment_tables.py [--quick] [--whole] [--cables 2] [--patterns circle ...] [--trials 0] [--resume]
                                       [--known] [--refine]

By default the benchmark runs cable 2 alone, in some 10 minutes on two cores. --whole runs cables 1 to 3 and three noisy
trials of each cell. It takes half an hour with --ways placed exact network intuitive, and an hour with "optimised".
Runs are parallel, one per core. Each run is printed, and appended to out/benchmarks/deployment_tables.jsonl, when it
ends. After Ctrl-C the tables contain the finished runs, and --resume runs the rest.

Cables are laid quasi-statically. The intuitive way and noisy trials run dynamically instead, at 2.5 cm/s in steps of
20 ms: an upright cable buckles, falls and swings, and no sequence of equilibria follows it. In noisy trials the planner
measures the cable by a picture of its loop. Errors are those of (9.11), point by point: the distance of each point of
the cable from its place on the pattern. The way "network" needs torch, and is skipped without it.
"""

from __future__ import annotations

import importlib.util
import os
import signal
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from deployment_measuring import looped
from deployment_refining import refine
from reporting import OUT, RESUME, Lines, Report, arguments, bar

from withe.deployment import Cable, Deployment, LayPlan, Pattern, Slip, deploy, place, plan
from withe.errors import ConvergenceError

Key = tuple[str, int, float, str]  # pattern, cable, friction, way

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
NOISY_WAYS = ("exact", "intuitive", "network")
NOISY_SPEED = 0.025  # [m/s]
IN_TIME = 0.02  # [s], time step of dynamic runs: errors are within 0.1 mm of those at 0.0025 s
SLIPPED = 1.0  # [mm], least slip that a plan should predict
LARGE = 5.0  # [mm]: mean error above which a cell is explained
NEAR = 2.0  # [Lgb] beside a stretch that friction does not hold, which moves with it
COLOURS = {
    "exact": "#3465a4",
    "network": "#75507b",
    "least_friction": "#e08214",
    "optimised": "#2e8b57",
    "intuitive": "#b2182b",
}


@dataclass(frozen=True)
class Run:
    """One cable, laid or placed once along one pattern on one floor, as a line of a file; lengths in mm.

    Where the engine found no equilibrium, errors are NaN and nothing is laid.
    """

    pattern: str
    cable: int
    friction: float
    way: str
    seed: int | None  # seed of the unknown errors; None: no errors
    nodes: int
    error: float = np.nan
    std: float = np.nan
    nearest_error: float = np.nan
    nearest_std: float = np.nan
    laid: list[tuple[float, float]] = field(default_factory=list)
    slipped: list[float] = field(default_factory=list)

    @property
    def key(self) -> Key:
        """Pattern, cable, friction and way of a run, without noise."""
        return self.pattern, self.cable, self.friction, self.way

    @property
    def planned(self) -> str:
        """Way by which the plan is made: of what is placed, the exact one, on whose pattern and cable it lies."""
        return "exact" if self.way == "placed" else self.way

    @property
    def balanced(self) -> bool:
        """True if the engine found equilibria."""
        return bool(np.isfinite(self.error))

    def of(self, found: Deployment) -> Run:
        """With what came of it."""
        sizes = found.error, found.std, found.nearest_error, found.nearest_std
        error, std, nearest_error, nearest_std = (round(1e3 * size, 4) for size in sizes)
        return replace(
            self,
            error=error,
            std=std,
            nearest_error=nearest_error,
            nearest_std=nearest_std,
            laid=(1e3 * found.laid[:, :2]).round(3).tolist(),
            slipped=(1e3 * found.slipped).round(4).tolist(),
        )

    def __str__(self) -> str:
        noise = "" if self.seed is None else f", trial {self.seed}"
        return f"{self.pattern}, cable {self.cable}, {self.friction:g}, {self.way}{noise}: {self.error:.2f} mm"


@dataclass(frozen=True)
class Cell:
    """A way to lay a cable along a pattern on a floor: without noise, and in noisy trials."""

    run: Run
    motion: LayPlan
    noisy: tuple[Run, ...] = ()

    @property
    def foretold(self) -> bool:
        """True if tests of feasibility predict the slips."""
        return self.run.way in ("exact", "network", "least_friction")

    @property
    def marks(self) -> str:
        """Return the tests that predict slip: f floor (9.2), l lift-off, e free end, t tail, o overlap."""
        failed = {slip.test for slip in self._said}
        letters = {"floor": "f", "lift-off": "l", "free end": "e", "tail": "t", "overlap": "o"}
        return "".join(letter for test, letter in letters.items() if test in failed)

    def unforeseen(self) -> float:
        """Greatest slip away from all stretches that were said to slip [mm], zero below a millimetre."""
        near = NEAR * self.motion.cable.gravito_bending_length
        s = np.linspace(0.0, self.motion.cable.length, len(self.run.slipped))
        away = np.ones(len(s), bool)
        for slip in self._said:
            away &= (s < slip.start - near) | (s > slip.end + near)
        worst = float(np.array(self.run.slipped)[away].max(initial=0.0))
        return worst if worst > SLIPPED else 0.0

    def slips(self) -> list[tuple[str, str, str]]:
        """Stretches that slipped, by how much at most [mm], and which tests foresaw it."""
        s = 1e3 * np.linspace(0.0, self.motion.cable.length, len(self.run.slipped))
        size = np.array(self.run.slipped)
        near = 1e3 * NEAR * self.motion.cable.gravito_bending_length
        rows = []
        edges = np.flatnonzero(np.diff(np.concatenate([[False], size > SLIPPED, [False]]).astype(int)))
        for first, after in zip(edges[::2], edges[1::2], strict=True):
            start, end = s[first], s[after - 1]
            tests = {x.test for x in self._said if 1e3 * x.start - near <= end and 1e3 * x.end + near >= start}
            said = ", ".join(sorted(tests)) or "none"
            rows.append((f"{start:.0f} to {end:.0f}", f"{size[first:after].max():.1f}", said))
        return rows

    @cached_property
    def _said(self) -> tuple[Slip, ...]:
        return self.motion.feasibility(self.run.friction).slips

    def __str__(self) -> str:
        if not self.run.balanced:
            return "none"
        noisy = f" ({np.mean([run.error for run in self.noisy]):.1f})" if self.noisy else ""
        return f"{self.run.error:.2f} ± {self.run.std:.2f}{noisy}"

    def nearest(self) -> str:
        """Format the error from the nearest point of the given pattern."""
        if not self.run.balanced:
            return "none"
        return f"{self.run.nearest_error:.2f} ± {self.run.nearest_std:.2f}"


class Patterns:
    """Patterns, and plans that do not depend on the floor, each made once; of trials, for the cable as measured."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes
        self._patterns: dict[str, Pattern] = {}
        self._plans: dict[tuple[str, int, str, int | None], LayPlan] = {}

    def pattern(self, name: str) -> Pattern:
        """As published, smoothed by at most a millimetre."""
        if name not in self._patterns:
            points = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", skip_header=1)
            self._patterns[name] = Pattern(points, nodes=self.nodes)
        return self._patterns[name]

    def plan(self, name: str, number: int, way: str, friction: float, seed: int | None = None) -> LayPlan:
        """The published circle ends on its own beginning: laid over itself."""
        key = (name, number, way if way != "optimised" else f"{way} {friction}", seed)
        if key not in self._plans:
            cable = Cable.dlo(number)
            self._plans[key] = plan(
                cable if seed is None else looped(cable, seed),
                self.pattern(name),
                way,
                friction=friction if way == "optimised" else None,  # the table shows that the others slip
                speed=NOISY_SPEED,
                crossings="over",
                progress=False,
            )
        return self._plans[key]


def carried_out(run: Run, patterns: Patterns) -> Run:
    """Lay through equilibria, or dynamically: with noise, or if no sequence of equilibria exists."""
    try:
        motion = patterns.plan(run.pattern, run.cable, run.planned, run.friction, run.seed)
        if run.way == "placed":
            return run.of(place(motion, friction=run.friction, nodes=run.nodes, progress=False))
        static = run.seed is None and run.way != "intuitive"
        found = deploy(
            motion,
            Cable.dlo(run.cable),
            friction=run.friction,
            noise=0.0 if run.seed is None else 1.0,
            seed=run.seed or 0,
            quasi_static=static,
            time_step=None if static else IN_TIME,
            nodes=run.nodes,
            progress=False,
        )
    except ConvergenceError:
        return run
    return run.of(found)


def cells_of(runs: list[Run], patterns: Patterns, trials: int) -> dict[Key, Cell]:
    """Return cases without noise, and cases with noisy trials if all trials are complete."""
    cells = {}
    for run in runs:
        if run.seed is None:
            noisy = [other for other in runs if other.key == run.key and other.seed is not None]
            planned = "exact" if run.way == "optimised" else run.planned
            motion = patterns.plan(run.pattern, run.cable, planned, run.friction)
            cells[run.key] = Cell(run, motion, tuple(noisy) if len(noisy) == trials else ())
    return cells


def tables(report: Report, cells: dict[Key, Cell], ways: tuple[str, ...]) -> None:
    """Return means and standard deviations, per point and from the nearest point, with the published values."""
    rows, nearest, slipped = [], [], []
    for key in dict.fromkeys(key[:3] for key in cells):
        here = [cells.get((*key, way)) for way in ways]
        exact = cells.get((*key, "exact"))
        marks = "" if exact is None else exact.marks or "-"
        rows.append((*key, *("" if cell is None else cell for cell in here), marks, PUBLISHED[key[0]][key[1]]))
        nearest.append((*key, *("" if cell is None else cell.nearest() for cell in here)))
    for key, cell in cells.items():
        if cell.foretold and cell.run.error > LARGE:
            slipped += [(*key, f"{cell.run.error:.1f}", *row) for row in cell.slips()]
    header = ("pattern", "DLO", "friction")
    report.table(
        "Mean and standard deviation, point by point; mean of noisy trials [mm]",
        (*header, *ways, "will slip", "published: intuitive, optimal"),
        rows,
    )
    report.table("Distance from the nearest point of the given pattern [mm]", (*header, *ways), nearest)
    report.table(
        f"Parts that slip where the mean is above {LARGE:g} mm, and the tests that predict it",
        (*header, "way", "mean", "stretch [mm]", "slips by", "tests"),
        slipped,
    )
    unforeseen = {key: cell.unforeseen() for key, cell in cells.items() if cell.foretold}
    rows = [(*key, f"{size:.1f}") for key, size in unforeseen.items() if size]
    report.table("Slips that no test foresaw [mm]", (*header, "way", "slip"), rows)
    report.figures["without equilibrium"] = [" ".join(map(str, key)) for key in cells if not cells[key].run.balanced]


def goals(report: Report, cells: dict[Key, Cell]) -> None:
    """Add the goals that compare the ways of laying."""
    error = {key: cell.run.error for key, cell in cells.items()}
    keys = [key for key in dict.fromkeys(key[:3] for key in cells) if (*key, "exact") in cells]

    def over_exact(way: str, among: list) -> list[float]:
        ratios = [error[(*key, way)] / error[(*key, "exact")] for key in among if (*key, way) in error]
        return [ratio for ratio in ratios if np.isfinite(ratio)]

    def median(values: list[float]) -> float | None:
        return float(np.median(values)) if values else None

    held = []
    for name, number, friction in keys:
        motion = cells[name, number, friction, "exact"].motion
        lift_off = motion.feasibility(friction).lift_off[3:-3].max()
        if name != "letterC" and friction > lift_off + 0.1 and (name, number, friction, "placed") in error:
            held.append(error[name, number, friction, "exact"] - error[name, number, friction, "placed"])
    report.goal("exact beyond placed where friction holds, most [mm]", max(held, default=None), 1.5, at_least=False)
    slipping = [key for key in keys if error[(*key, "exact")] > 1.0]
    report.goal(
        "least_friction over exact, median above 1 mm",
        median(over_exact("least_friction", slipping)),
        0.75,
        at_least=False,
    )
    letter = over_exact("least_friction", [key for key in slipping if key[0] == "letterA"])
    name = "least_friction over exact, letter A, worst above 1 mm"
    report.goal(name, max(letter, default=None), 0.5, at_least=False)
    report.goal(
        "optimised over exact, median above 1 mm", median(over_exact("optimised", slipping)), 0.4, at_least=False
    )
    learned = [abs(error[(*key, "network")] - error[(*key, "exact")]) for key in keys if (*key, "network") in error]
    learned = [away for away in learned if np.isfinite(away)]
    report.goal("network from exact, most [mm]", max(learned, default=None), 0.5, at_least=False)
    report.goal("intuitive over exact, median", median(over_exact("intuitive", keys)), 6.0)
    unforeseen = sum(cell.unforeseen() > 0.0 for cell in cells.values() if cell.foretold)
    report.goal("cells with a slip that no test foresaw", unforeseen, 0, at_least=False)
    noisy = [
        float(np.mean([run.error for run in cells[(*key, "exact")].noisy]))
        for key in keys
        if cells[(*key, "exact")].noisy and error[(*key, "exact")] <= 2.0
    ]
    if noisy:
        report.goal("noisy trials where exact misses by at most 2 mm, most [mm]", max(noisy), 5.0, at_least=False)


def draw(cells: list[Cell], patterns: Patterns, number: int) -> None:
    """Laid shapes over the patterns, a row a pattern and a column a floor."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(cell.run.pattern for cell in cells))
    frictions = list(dict.fromkeys(cell.run.friction for cell in cells))
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
            run = cell.run
            if (run.pattern, run.friction) == (name, friction) and run.laid and run.way in COLOURS:
                s = np.linspace(0.0, cell.motion.cable.length, len(run.laid))
                laid = np.array(run.laid)[s <= pattern.length]
                panel.plot(
                    *laid.T, "--" if run.way == "intuitive" else "-", color=COLOURS[run.way], lw=1, label=run.way
                )
                errors.append(f"{run.error:.1f}")
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
        ("--whole", {"action": "store_true", "help": "cables 2, 1, 3, and three noisy trials of each cell"}),
        ("--cables", {"nargs": "*", "type": int, "choices": (1, 2, 3), "default": [2]}),
        ("--patterns", {"nargs": "*", "choices": PATTERNS, "default": list(PATTERNS)}),
        ("--frictions", {"nargs": "*", "type": float, "default": list(FRICTIONS)}),
        ("--ways", {"nargs": "*", "choices": WAYS, "default": list(WAYS)}),
        ("--trials", {"type": int, "default": 0, "help": "noisy trials of each cell"}),
        ("--noisy-ways", {"nargs": "*", "choices": WAYS[1:], "default": list(NOISY_WAYS), "help": "that have them"}),
        ("--nodes", {"type": int, "default": 200, "help": "of the cable"}),
        RESUME,
        ("--known", {"action": "store_true", "help": "lay nothing: tables of what an earlier run left"}),
        ("--refine", {"action": "store_true", "help": "instead: meshes and half the speed, in five cells"}),
    )
    if options.refine:
        report = Report("deployment_refining")
        refine(report, Patterns(301).plan)
        report.write()
        return
    cables, trials = ([2, 1, 3], 3) if options.whole else (options.cables, options.trials)
    ways = tuple(way for way in WAYS if way in options.ways or way in ("placed", "exact"))
    if importlib.util.find_spec("torch") is None:
        ways = tuple(way for way in ways if way != "network")
    names, frictions, nodes = options.patterns, options.frictions, options.nodes
    if options.quick:
        names, frictions, ways, nodes = ["letterU"], [0.4], ("placed", "exact"), 60
    report = Report("deployment_tables", quick=options.quick)
    patterns = Patterns(101 if options.quick else 301)
    wanted = [
        Run(name, number, friction, way, None, nodes)
        for number, name, friction, way in product(cables, names, frictions, ways)
    ]
    noisy_ways = [way for way in options.noisy_ways if way in ways]
    wanted += [
        Run(name, number, friction, way, seed, nodes)
        for number, way, name, friction, seed in product(cables, noisy_ways, names, frictions, range(trials))
    ]
    known, workers = options.known, 1 if options.quick else os.cpu_count() or 1
    runs = laid(wanted, patterns, Lines("deployment_tables", resume=options.resume or options.known), known, workers)
    if len(runs) < len(wanted):
        report.figures["interrupted"] = f"{len(runs)} of {len(wanted)} runs"
    cells = cells_of(runs, patterns, trials)
    if not cells:
        return
    tables(report, cells, ways)
    goals(report, cells)
    for number in dict.fromkeys(cell.run.cable for cell in cells.values()):
        draw([cell for cell in cells.values() if cell.run.cable == number], patterns, number)
    report.write()


_here: list[Patterns] = []  # patterns of a worker


def begin(nodes: int) -> None:
    """Initialise a worker with its own patterns. It ignores Ctrl-C: the main process lets it end its task."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _here.append(Patterns(nodes))


def carried_out_here(run: Run) -> Run:
    """Carry out a run in a worker."""
    return carried_out(run, _here[0])


def laid(wanted: list[Run], patterns: Patterns, lines: Lines, known: bool, workers: int) -> list[Run]:
    """Carry out runs in `workers` processes, and print and write each at its end. Return the completed ones."""
    done = {(run.key, run.seed, run.nodes): run for run in (Run(**line) for line in lines.known)}
    left = [run for run in wanted if (run.key, run.seed, run.nodes) not in done]
    if not known and left:
        os.environ.setdefault("OMP_NUM_THREADS", "1")  # for workers, also for torch
        pool = ProcessPoolExecutor(
            min(workers, len(left)), get_context("spawn"), initializer=begin, initargs=(patterns.nodes,)
        )
        try:
            with bar(len(left), "laying", "runs") as shown:
                for ended in as_completed([pool.submit(carried_out_here, run) for run in left]):
                    found = ended.result()
                    done[found.key, found.seed, found.nodes] = found
                    lines.add(asdict(found))
                    print(found, flush=True)
                    shown.advance(1)
        except KeyboardInterrupt:
            print("\ninterrupted: --resume goes on", flush=True)
        finally:
            pool.shutdown(cancel_futures=True)
    return [done[name] for run in wanted if (name := (run.key, run.seed, run.nodes)) in done]


if __name__ == "__main__":
    main()
