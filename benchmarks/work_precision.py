"""Error against run time, for the beams and helices of table 6.1: every integrator of ours, and PyElastica.

    python benchmarks/work_precision.py [--quick] [--case "helix a"]

With --case, the other cases keep the values in the file of figures. The error is the RMS over time of the tip's
distance from the method's own limit in space and time (`limits.py`), over the RMS of that motion. Both simulators
choose nodes and steps freely. A run whose error exceeds half of the motion does not count. Time is processor time of
one run on one thread, without recording. Runs are interleaved, and the table shows medians.

PyElastica runs without damping and callbacks, after numba has compiled, with n = 25 to 400 elements. It uses its
largest stable step and half of it, with its own clamp and with its wall moved by half an element. If one of its runs
takes more than 2 s, five times 2 s are measured and scaled by steps (marked *).
"""

from __future__ import annotations

import concurrent.futures
import json
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field

from limits import load_limits
from reporting import HAVE_ELASTICA, OUT, Report, Timing, arguments, bar, interleaved
from rods_in_motion import CASES, Case, integrators, record, run_time, steps_of

SATURATED = 0.5
ROUNDS = 5
SLICE = 2.0  # [s]
_ENDLESS = 1e9  # a finite number, since JSON has no infinity


@dataclass
class Point:
    """One choice of method, mesh and step: its error, and its time once measured."""

    case: str
    method: str
    edges: int
    step: float
    error: float = math.inf
    time: float = math.inf
    spread: float = 0.0
    scaled: bool = False
    own_nodes: bool = field(default=False)  # the source's choice

    @property
    def theirs(self) -> bool:
        """True if the method is PyElastica's."""
        return self.method.startswith("PyElastica")

    def as_json(self) -> dict:
        """All of it; `_last_points` reads it again."""
        return asdict(self) | {"error": min(self.error, _ENDLESS), "time": min(self.time, _ENDLESS)}

    @property
    def label(self) -> str:
        """Mesh and step."""
        return f"{self.edges} edges, {self.step:.3g} s"


# --- which runs ------------------------------------------------------------------------------------------------


def _our_points(case: Case, quick: bool) -> list[Point]:
    """A grid over meshes and steps for each integrator, and the source's choice."""
    meshes = (
        (6, 8, 10, 12, 16, 24, 32, 45, 64, 90, 128) if case.kind == "beam" else (28, 40, 56, 80, 113, 160, 226, 320)
    )
    halvings = range(-2, 8)
    if quick:
        meshes, halvings = (16, 24), range(-1, 1)
    points = []
    for method in integrators():
        for edges in meshes:
            if method == "verlet":
                points += [Point(case.name, method, edges, 0.0)] if edges <= 40 and not quick else []
                continue
            # Fourth order and the rest need steps of different size; both grids step by the root of two.
            largest = case.time_step * (4.0 if method == "fourth_order" else 1.0)
            points += [Point(case.name, method, edges, largest * 2 ** (-k / 2)) for k in halvings]
    for method in integrators():
        if method != "verlet":
            points.append(Point(case.name, method, case.edges, case.time_step, own_nodes=True))
    return points


def _their_points(case: Case, quick: bool) -> list[Point]:
    """Each mesh at its largest stable step (given as 1) and half of it (0.5, where that is quick), with both clamps."""
    points = []
    for wall in ("own clamp", "moved wall"):
        for elements in (25,) if quick else (25, 50, 100, 200, 400):
            points.append(Point(case.name, f"PyElastica, {wall}", elements, 1.0))
            if elements <= 100 and not quick:
                points.append(Point(case.name, f"PyElastica, {wall}", elements, 0.5))
        if not quick:
            points.append(
                Point(case.name, f"PyElastica, {wall}", case.edges + (case.kind == "helix"), case.elastica_step)
            )
            points[-1].own_nodes = True
    return points


def _stable_step(case: Case, edges: int) -> float:
    """Return the stable step of Verlet, from the plan of a build; planned at once for all runs."""
    from rods_in_motion import simulation

    plan = simulation(case, edges, integrator="verlet", time_step=1e-9).plan
    return 0.9 * float(plan.stable_step)


# --- errors ----------------------------------------------------------------------------------------------------


def _measure(point: Point, duration: float) -> Point:
    """Return the error of a point. Converts the step of PyElastica and of Verlet to seconds."""
    case = CASES[point.case]
    try:
        motion = _their_motion(case, point, duration) if point.theirs else _our_motion(case, point, duration)
    except Exception as error:
        print(f"  {point.case}, {point.method}, {point.label}: {error}")
        return point
    if motion is not None:
        limit, _ = load_limits("elastica" if point.theirs else "withe")[point.case]
        point.error = motion.error(limit)
    return point


def _our_motion(case: Case, point: Point, duration: float):
    if point.method == "verlet":
        point.step = _stable_step(case, point.edges)
    return record(case, point.edges, duration, integrator=point.method, time_step=point.step)


def _their_motion(case: Case, point: Point, duration: float):
    from elastica_rods import ElasticaRun, largest_stable_step

    moved = point.method.endswith("moved wall")
    if point.own_nodes:
        return ElasticaRun(case, point.edges, duration, point.step, moved_wall=moved).record()
    fraction = point.step
    largest = largest_stable_step(case, point.edges, moved_wall=moved)
    # A step that survives a short run may still fail in a long run.
    for shrink in (1.0, 0.93, 0.8, 0.6):
        point.step = fraction * shrink * largest
        motion = ElasticaRun(case, point.edges, duration, point.step, moved_wall=moved).record()
        if motion is not None:
            return motion
    return None


def _errors(points: list[Point], durations: dict[str, float], workers: int | None) -> list[Point]:
    # Long runs first, so that no processor waits at the end.
    points = sorted(points, key=lambda p: (p.theirs, p.edges), reverse=True)
    with bar(len(points), "errors") as shown, concurrent.futures.ProcessPoolExecutor(workers) as pool:
        futures = [pool.submit(_measure, point, durations[point.case]) for point in points]
        for _ in concurrent.futures.as_completed(futures):
            shown.advance(1)
    return [future.result() for future in futures]


# --- times -----------------------------------------------------------------------------------------------------


def _our_run(point: Point, duration: float) -> Callable[[], float]:
    case = CASES[point.case]
    return lambda: run_time(case, point.edges, duration, limit=SLICE, integrator=point.method, time_step=point.step)


def _their_run(point: Point, duration: float) -> Callable[[], float]:
    from elastica_rods import ElasticaRun

    def run() -> float:
        whole = ElasticaRun(
            CASES[point.case], point.edges, duration, point.step, moved_wall=point.method.endswith("moved wall")
        )
        per_step = whole.time_per_step(SLICE)
        point.scaled = per_step * whole.count > SLICE
        return per_step * whole.count

    return run


def _quick_guess(points: Iterable[Point], durations: dict[str, float]) -> None:
    """Run each briefly, and omit those that cannot be on a front."""
    for point in points:
        case, duration = CASES[point.case], durations[point.case]
        point.time = run_time(case, point.edges, duration, limit=0.02, integrator=point.method, time_step=point.step)


def _promising(points: list[Point]) -> list[Point]:
    """Points of one method that are no more than a quarter slower than one that is better."""
    good = [p for p in points if p.error < SATURATED]
    return [p for p in good if p.own_nodes or not any(q.error < p.error and 1.25 * q.time < p.time for q in good)]


def _times(points: list[Point], durations: dict[str, float], rounds: int) -> None:
    """Interleaved: every round passes through all runs."""
    clampless = [p for p in points if not (p.theirs and p.method.endswith("own clamp"))]
    actions = {str(i): (_their_run if p.theirs else _our_run)(p, durations[p.case]) for i, p in enumerate(clampless)}
    with bar(rounds * len(actions), "times") as shown:
        timings = interleaved(actions, rounds, lambda: shown.advance(1))
    per_step: dict[tuple[str, int], Timing] = {}
    for i, point in enumerate(clampless):
        timing = timings[str(i)]
        point.time, point.spread = timing.median, timing.spread
        if point.theirs:
            count = steps_of(durations[point.case], point.step)
            per_step[point.case, point.edges] = Timing(tuple(t / count for t in timing.seconds))
    # Both clamps are the same code with other numbers: a step takes the same.
    for point in points:
        if point.theirs and point.method.endswith("own clamp"):
            timing = per_step[point.case, point.edges]
            point.time = timing.median * steps_of(durations[point.case], point.step)
            point.spread, point.scaled = timing.spread, True


# --- fronts ----------------------------------------------------------------------------------------------------


def front(points: Iterable[Point]) -> list[Point]:
    """Points that no other beats in both error and time, from quick to slow."""
    best: list[Point] = []
    for point in sorted(points, key=lambda p: (p.time, p.error)):
        if point.error < SATURATED and point.time < math.inf and (not best or point.error < best[-1].error):
            best.append(point)
    return best


def time_at(points: Iterable[Point], error: float) -> float | None:
    """Time at which a front reaches an error, read between its points on logarithmic axes; None where it does not."""
    line = front(points)
    for before, after in zip([None, *line], line, strict=False):
        if after.error <= error:
            if before is None:
                return after.time
            share = math.log(before.error / error) / math.log(before.error / after.error)
            return math.exp((1 - share) * math.log(before.time) + share * math.log(after.time))
    return None


def shown_time(value: float | None) -> str:
    """A time [s] for people."""
    if value is None:
        return "not reached"
    return f"{1e3 * value:.3g} ms" if value < 1.0 else f"{value:.3g} s"


def _ratio(case: Case, points: list[Point], mark: float) -> tuple[float | None, float | None, float | None]:
    ours = time_at([p for p in points if p.case == case.name and not p.theirs], mark)
    theirs = time_at([p for p in points if p.case == case.name and p.theirs], mark)
    return ours, theirs, None if ours is None or theirs is None else theirs / ours


# --- the report ------------------------------------------------------------------------------------------------


def _last_points(anew: set[str]) -> list[Point]:
    """Points of the other cases, of the last run."""
    path = OUT / "work_precision.json"
    figures = json.loads(path.read_text())["figures"] if path.exists() else {"points": []}

    def endless(value: float) -> float:
        return math.inf if value >= _ENDLESS else value

    return [
        Point(**(kept | {"error": endless(kept["error"]), "time": endless(kept["time"])}))
        for kept in figures["points"]
        if kept["case"] not in anew
    ]


def _report_fronts(report: Report, points: list[Point]) -> None:
    rows = []
    present = {p.case for p in points}
    for case in (case for case in CASES.values() if case.name in present):
        for mark in case.marks:
            ours, theirs, ratio = _ratio(case, points, mark)
            by = min(
                {p.method for p in points if p.case == case.name and not p.theirs},
                key=lambda m: time_at([p for p in points if p.case == case.name and p.method == m], mark) or math.inf,
                default="-",
            )
            rows.append(
                (case.name, f"{mark:g}", shown_time(ours), by, shown_time(theirs), f"{ratio:.0f}" if ratio else "-")
            )
            if mark == (1e-2 if case.kind == "beam" else 3e-2):
                target = 300 if case.kind == "beam" else 50
                report.goal(f"{case.name}: times faster than PyElastica at {mark:g}", ratio, target)
    report.table("Front against front", ("case", "error", "ours", "by", "PyElastica", "times faster"), rows)


def _report_points(report: Report, points: list[Point]) -> None:
    def row(p: Point) -> tuple[object, ...]:
        error = "saturated" if not p.error < SATURATED else f"{p.error:.2e}"
        time = f"{shown_time(p.time)}{'*' if p.scaled else ''}" if p.time < math.inf else "-"
        return p.case, p.method, p.edges, f"{p.step:.3g}", error, time, f"{100 * p.spread:.0f} %"

    header = ("case", "method", "edges", "step [s]", "error", "time", "spread")
    report.table("At the source's nodes and steps", header, [row(p) for p in points if p.own_nodes])
    chosen = []
    for name in CASES:
        for method in sorted({p.method for p in points}):
            chosen += front(p for p in points if p.case == name and p.method == method)
    report.table("Fronts (* five parts of 2 s, scaled by steps)", header, [row(p) for p in chosen])


def _report_limits(report: Report) -> None:
    ours, theirs = load_limits("withe"), load_limits("elastica")
    rows = []
    for name in CASES:
        apart = theirs[name][0].error(ours[name][0])
        rows.append((name, f"{ours[name][1]:.1e}", f"{theirs[name][1]:.1e}", f"{apart:.2e}"))
    title = "Limits: of two extrapolations, their distance; and how far apart the two limits are (nobody's error)"
    report.table(title, ("case", "ours", "PyElastica", "apart"), rows)


def _plot(points: list[Point]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    cases = [case for case in CASES.values() if case.name in {p.case for p in points}]
    size = (4 + 3 * len(cases), 4.2)
    figure, axes = plt.subplots(1, len(cases), figsize=size, sharey=True, squeeze=False, layout="constrained")
    axes = axes[0]
    methods = sorted({p.method for p in points}, key=lambda m: (m.startswith("PyElastica"), m))
    for axis, case in zip(axes, cases, strict=True):
        for i, method in enumerate(methods):
            line = front(p for p in points if p.case == case.name and p.method == method)
            style = "s--" if method.startswith("PyElastica") else "o-"
            axis.loglog([p.time for p in line], [p.error for p in line], style, ms=3, color=f"C{i}", label=method)
        axis.set(title=case.name, xlabel="run time [s]")
        axis.grid(alpha=0.3)
        for mark in case.marks:
            axis.axhline(mark, color="0.8", lw=0.7, zorder=0)
    axes[0].set_ylabel("error of the tip / motion")
    figure.legend(*axes[0].get_legend_handles_labels(), fontsize=8, loc="outside right center")
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "work_precision.png", dpi=130)
    plt.close(figure)


def main() -> None:
    """Errors, then times, then the report."""
    options = arguments(
        __doc__,
        ("--case", {"choices": list(CASES), "action": "append", "help": "only this one (may be repeated)"}),
        ("--workers", {"type": int, "help": "processes that measure errors (times are measured in one)"}),
    )
    quick = options.quick
    cases = [CASES[name] for name in options.case or CASES]
    durations = {case.name: case.duration * (0.05 if quick and case.kind == "beam" else 1.0) for case in cases}
    if quick:
        cases = [case for case in cases if case.kind == "beam"][:1]
    points = [p for case in cases for p in _our_points(case, quick)]
    if HAVE_ELASTICA and not quick:
        points += [p for case in cases for p in _their_points(case, quick)]
    points = _errors(points, durations, options.workers)
    _quick_guess([p for p in points if not p.theirs and p.error < SATURATED], durations)
    timed = [p for p in points if p.theirs and p.error < math.inf]
    for case in cases:
        for method in {p.method for p in points if not p.theirs}:
            timed += _promising([p for p in points if p.case == case.name and p.method == method])
    kept = {id(p) for p in timed}
    for point in points:
        if id(point) not in kept:
            point.time = math.inf
    _times(timed, durations, 1 if quick else ROUNDS)
    if options.case and not quick:
        points += _last_points({case.name for case in cases})
    report = Report("work_precision", quick=quick)
    _report_fronts(report, points)
    _report_points(report, points)
    _report_limits(report)
    report.keep_points(points)
    _plot(points)
    report.write()


if __name__ == "__main__":
    main()
