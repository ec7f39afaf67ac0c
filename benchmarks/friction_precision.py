"""Error against run time of a rod pushed along a floor, the friction column of table 6.1: ours, and PyElastica.

    python benchmarks/friction_precision.py [--quick]

A force F pushes a block of mass m for a time t over a floor with friction mu. Above the limit F = mu m g the block
gains the kinetic energy (F - mu m g)^2 t^2 / (2 m), and none below. This is (6.2) of Andrew Choi's doctoral
dissertation (University of California, Los Angeles), the source here. The error is the greatest relative error over
seven forces from 5 % above the limit. Four forces below the limit show the energy of a rod that should stick.

Both simulators choose nodes and steps freely, up to a tenth of the push, and have their own friction law, regularised
below 1 mm/s. Friction of withe acts on the surface, and so bends the rod. The rows "on centrelines" use the law of the
source and PyElastica. Time is processor time of one push of 1.5 s on one thread, without build and recording. Runs are
interleaved, and the table shows medians. PyElastica runs without damping and callbacks, after numba has compiled. It
uses the largest step within half of (6.2), and 0.9, 0.8 and 0.5 of that step.

Speed grows linearly, so every stable step is accurate; for PyElastica, whose rod does not deform here, to rounding. The
benchmark therefore compares the largest steps and their cost. The source reports 0.036 s per push, and 0.169 s for
PyElastica, which is 4.7 times as long.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from reporting import HAVE_ELASTICA, OUT, ROOT, Report, arguments, bar, interleaved
from rods_in_motion import steps_of
from work_precision import ROUNDS, SATURATED, Point, front, shown_time, time_at

import withe

sys.path.insert(0, str(ROOT / "examples"))
from friction import DENSITY, DURATION, FRICTION, GRAVITY, LENGTH, LIMIT, RADIUS, block

YOUNGS_MODULUS = 1e5  # [Pa]
SLIDING = np.linspace(4.121, 10.0, 7)  # [N]
STICKING = np.array([1.0, 2.0, 3.0, 0.995 * LIMIT])  # [N]
EDGES, TIME_STEP, ELASTICA_STEP = 25, 5e-3, 1e-4  # the source's; steps in s
MESHES = (2, 3, 5, 10, 25, 50)
STEPS = (0.15, 0.05, 0.015, 0.005)  # [s]
MARKS = (3e-2, 1e-2, 3e-3)
ROUNDING = 1e-16
ON_CENTRELINES = ", on centrelines"
METHODS = (
    "implicit_midpoint",
    "energy_momentum",
    "backward_euler",
    f"implicit_midpoint{ON_CENTRELINES}",
    f"backward_euler{ON_CENTRELINES}",
)


@dataclass
class Pushed(Point):
    """A point, and the greatest kinetic energy [J] of a rod that should stick."""

    sticking: float = math.inf


# --- runs ------------------------------------------------------------------------------------------------------


def resting(point: Point) -> tuple[withe.Simulation, withe.Load]:
    """Our rod in equilibrium on the floor, not pushed yet."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    foam = withe.Material(youngs_modulus=YOUNGS_MODULUS, poisson_ratio=0.5, density=DENSITY)
    ends = {"start": (0.0, 0.0, RADIUS), "end": (LENGTH, 0.0, RADIUS)}
    rod = scene.add_rod(**ends, nodes=point.edges + 1, radius=RADIUS, material=foam)
    scene.add_floor(friction=FRICTION)
    scene.enable_contact(
        distance_tolerance=5e-4,
        slip_tolerance=1e-3,
        friction_model="implicit",  # anchors give before they slip, and a block gathers speed on that way
        centreline_friction=point.method.endswith(ON_CENTRELINES),
    )
    push = scene.add_load(rod, (0.0, 0.0, 0.0), name="push")
    simulation = scene.build(integrator=point.method.removesuffix(ON_CENTRELINES), time_step=point.step)
    simulation.equilibrium()
    return simulation, push


def _our_push(start: withe.Simulation, push: withe.Load, point: Point, force: float) -> tuple[float, float]:
    """Kinetic energy after it [J], and its processor time [s]."""
    simulation = start.copy()
    simulation.set(push, load=(force / LENGTH, 0.0, 0.0))
    begin = time.thread_time()
    simulation.step(steps_of(DURATION, point.step))
    took = time.thread_time() - begin
    return simulation.energy().kinetic, took


def _their_push(point: Point, force: float) -> tuple[float, float]:
    """The same of PyElastica's."""
    from elastica_friction import PushRun

    rod = {"length": LENGTH, "radius": RADIUS, "density": DENSITY, "youngs_modulus": YOUNGS_MODULUS}
    scene = {"friction": FRICTION, "gravity": GRAVITY, "duration": DURATION}
    run = PushRun(rod, point.edges, **scene, force=force, time_step=point.step)
    took = run.run()
    return run.kinetic_energy, took


def pusher(point: Point) -> Callable[[float], tuple[float, float]]:
    """Kinetic energy [J] and time [s] of a push, by its force [N]."""
    if point.theirs:
        return lambda force: _their_push(point, force)
    start, push = resting(point)
    return lambda force: _our_push(start, push, point, force)


# --- errors and times ------------------------------------------------------------------------------------------


def _our_points(quick: bool) -> list[Pushed]:
    if quick:
        return [Pushed("friction", method, 5, STEPS[0]) for method in METHODS]
    points = [Pushed("friction", method, edges, step) for method in METHODS for edges in MESHES for step in STEPS]
    for point in points:
        point.own_nodes = point.edges == EDGES and point.step == TIME_STEP
    return points


def _their_points() -> list[Pushed]:
    points = [Pushed("friction", "PyElastica", EDGES, ELASTICA_STEP, own_nodes=True)]
    with bar(len(MESHES), "stable steps") as shown:
        for edges in MESHES:
            largest = _largest_stable_step(edges)
            points += [Pushed("friction", "PyElastica", edges, largest * share) for share in (1.0, 0.9, 0.8, 0.5)]
            shown.advance(1)
    return points


def _largest_stable_step(edges: int) -> float:
    """PyElastica's largest step [s] that stays within half of (6.2) at all forces, to 7 %, searched downwards."""
    edge, speed = LENGTH / edges, math.sqrt(YOUNGS_MODULUS / DENSITY)
    step = min(2.0 * edge / speed, STEPS[0])
    while step > 1e-9:
        if greatest_error(pusher(Point("friction", "PyElastica", edges, step))) < SATURATED:
            return step
        step *= 0.93
    raise RuntimeError(f"no stable step of PyElastica found for friction with {edges} elements")


def greatest_error(pushed: Callable[[float], tuple[float, float]]) -> float:
    """Greatest relative error in kinetic energy of the rods that slide."""
    energies = np.array([pushed(force)[0] for force in SLIDING])
    error = float(np.abs(energies / block(SLIDING) - 1.0).max())
    return max(error, ROUNDING) if math.isfinite(error) else math.inf


def _measure(point: Pushed) -> None:
    """The errors of a point."""
    try:
        pushed = pusher(point)
        point.error = greatest_error(pushed)
        point.sticking = max(pushed(force)[0] for force in STICKING)
    except withe.ConvergenceError as error:
        print(f"  {point.method}, {point.label}: {error}")


def _times(points: list[Pushed], rounds: int) -> None:
    """Interleaved: every round passes through all runs. Iterations depend on the force: ours is the mean of all."""

    def timed(point: Pushed) -> Callable[[], float]:
        pushed, forces = pusher(point), SLIDING[3:4] if point.theirs else SLIDING
        return lambda: float(np.mean([pushed(force)[1] for force in forces]))

    actions = {str(i): timed(point) for i, point in enumerate(points)}
    with bar(rounds * len(actions), "times") as shown:
        timings = interleaved(actions, rounds, lambda: shown.advance(1))
    for i, point in enumerate(points):
        point.time, point.spread = timings[str(i)].median, timings[str(i)].spread


# --- the report ------------------------------------------------------------------------------------------------


def _report_fronts(report: Report, points: list[Pushed]) -> None:
    rows = []
    for mesh, those in (("any mesh", points), (f"{EDGES} edges", [p for p in points if p.edges == EDGES])):
        for mark in MARKS:
            ours = {m: t for m in METHODS if (t := time_at([p for p in those if p.method == m], mark)) is not None}
            by = min(ours, key=ours.__getitem__, default="-")
            theirs = time_at([p for p in those if p.theirs], mark)
            ratio = theirs / ours[by] if ours and theirs else None
            times = f"{ratio:.1f}" if ratio else "-"
            rows.append((mesh, f"{mark:g}", shown_time(ours.get(by)), by, shown_time(theirs), times))
            if mark == 1e-2:
                report.goal(f"friction, {mesh}: times faster than PyElastica at {mark:g}", ratio, 1)
    report.table("Front against front", ("mesh", "error", "ours", "by", "PyElastica", "times faster"), rows)


def _report_points(report: Report, points: list[Pushed]) -> None:
    header = ("method", "edges", "step [s]", "error", "below the limit [J]", "time", "spread")

    def table(title: str, chosen: Iterable[Pushed]) -> None:
        rows = []
        for p in chosen:
            step, error, sticking = f"{p.step:.3g}", f"{p.error:.1e}", f"{p.sticking:.1e}"
            rows.append((p.method, p.edges, step, error, sticking, shown_time(p.time), f"{100 * p.spread:.0f} %"))
        report.table(title, header, rows)

    by_method = [[p for p in points if p.method == method] for method in (*METHODS, "PyElastica")]
    quickest = []
    for meshes in (MESHES, (EDGES,)):
        for those in by_method:
            good = [p for p in those if p.edges in meshes and p.error <= 1e-2]
            quickest += sorted(good, key=lambda p: p.time)[:1]
    table(f"Quickest with an error of at most 0.01: with any mesh, then with {EDGES} edges", quickest)
    own = [p for p in points if p.own_nodes]
    table("At the source's nodes and steps", own)
    table("Fronts", (p for those in by_method for p in front(those)))
    theirs = next((p.time for p in own if p.theirs), None)
    ours = next((p.time for p in own if p.method == METHODS[0]), None)
    ratio = theirs / ours if ours and theirs else None
    report.goal("friction, the source's nodes and steps: times faster", ratio, 1)


def _plot(points: list[Pushed]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharex=True, sharey=True, layout="constrained")
    panels = (("any mesh", points), (f"{EDGES} edges", [p for p in points if p.edges == EDGES]))
    for axis, (title, shown) in zip(axes, panels, strict=True):
        for i, method in enumerate((*METHODS, "PyElastica")):
            those = [p for p in shown if p.method == method]
            style = "s" if method == "PyElastica" else "o"
            axis.loglog([p.time for p in those], [p.error for p in those], style, ms=4, color=f"C{i}", label=method)
        axis.set(title=title, xlabel="run time of a push [s]")
        axis.grid(alpha=0.3)
        axis.axhline(1e-2, color="0.8", lw=0.7, zorder=0)
    axes[0].set_ylabel("error of the kinetic energy")
    figure.legend(*axes[0].get_legend_handles_labels(), fontsize=8, loc="outside right center")
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "friction_precision.png", dpi=130)
    plt.close(figure)


def main() -> None:
    """Errors, then times, then the report."""
    quick = arguments(__doc__).quick
    points = _our_points(quick)
    if HAVE_ELASTICA and not quick:
        points += _their_points()
    with bar(len(points), "errors") as shown:
        for point in points:
            _measure(point)
            shown.advance(1)
    points = [point for point in points if point.error < SATURATED]
    _times(points, 1 if quick else ROUNDS)
    report = Report("friction_precision", quick=quick)
    _report_fronts(report, points)
    _report_points(report, points)
    report.keep_points(points)
    _plot(points)
    report.write()


if __name__ == "__main__":
    main()
