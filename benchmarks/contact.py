"""Contact: a gripper, a knot, flagella in a fluid, and piles of more and more rods.

python benchmarks/contact.py [--quick]

Processor time of one thread. The public code takes 65.7 s for the gripper without friction, 6.5 ms a step for the knot
without friction, and 9.8 ms for two flagella. A pile is layers of short rods, each laid across the one below, a
hundredth of a radius apart, that fall onto each other.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

import numpy as np
from reporting import HAVE_ELASTICA, ROOT, Report, arguments, bar

import withe

sys.path.insert(0, str(ROOT / "examples"))
import flagella
import gripper

PILE_LENGTH, PILE_RADIUS, PILE_LAYERS = 0.1, 2e-3, 10  # [m]
KNOT = {"length": 1.0, "radius": 1.6e-3, "shortening": 0.6}  # [m]
KNOT_MODULUS, KNOT_DENSITY, KNOT_SPEED, KNOT_STEP = 1.8e5, 1180.0, 1e-2, 2.5e-3  # [Pa], [kg/m^3], of a grip [m/s], [s]


def _timed(simulation: withe.Simulation, steps: int, warm: int = 0) -> tuple[float, int]:
    """Seconds a step, and the contacts at the end."""
    simulation.step(warm)
    start = time.thread_time()
    simulation.step(steps)
    return (time.thread_time() - start) / steps, len(simulation.contacts())


def grippers(report: Report, quick: bool) -> None:
    """6,000 steps of `examples/gripper.py`, without friction and with, with the curvature drawn for each stencil."""
    steps = 50 if quick else 6000
    rows = []
    for friction, most in ((0.0, 6.6), (0.5, 18.0)):
        simulation, limbs, curvature = gripper.build(friction, seed=1, drawn=gripper.NODES - 2)
        for limb, own in zip(limbs, curvature, strict=True):
            simulation.set(limb, natural_curvature=own, over=gripper.CURLING)
        seconds, contacts = _timed(simulation, steps)
        rows.append((friction, f"{seconds * steps:.2f}", contacts))
        report.goal(f"gripper, friction {friction:g} [s]", None if quick else seconds * steps, most, at_least=False)
    report.table(f"Gripper, {steps:,} steps", ("friction", "s", "contacts"), rows)


def knot(friction: float, law: withe.parts.FrictionModel) -> withe.Simulation:
    """An overhand knot of 301 nodes whose ends are pulled apart at 2 cm/s."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=KNOT_MODULUS, poisson_ratio=0.5, density=KNOT_DENSITY)
    points = withe.knots.overhand_knot(n=1, **KNOT)
    rope = scene.add_rod(points=points, nodes=301, radius=KNOT["radius"], material=rubber, natural="straight")
    grips = [scene.clamp(end, hold="edge", spin=True) for end in (rope.start, rope.end)]
    scene.enable_contact(friction=friction, friction_model=law)
    simulation = scene.build(integrator="backward_euler", time_step=KNOT_STEP)
    ends = simulation.positions(rope)[[0, -1]]
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    for grip, end, sign in zip(grips, ends, (-1.0, 1.0), strict=True):
        simulation.move(grip, position=end + sign * 20.0 * KNOT_SPEED * along, over=20.0)
    return simulation


def knots(report: Report, quick: bool) -> None:
    """A knot being tightened, by law of friction."""
    steps = 20 if quick else 2000
    rows = []
    for name, friction, law, most in (
        ("none", 0.0, "lagged", 0.65),
        ("lagged", 0.1, "lagged", 0.65),
        ("implicit", 0.1, "implicit", 1.0),
    ):
        seconds, contacts = _timed(knot(friction, law), steps)
        rows.append((name, f"{1e3 * seconds:.2f}", contacts))
        report.goal(f"knot, friction {name} [ms a step]", None if quick else 1e3 * seconds, most, at_least=False)
    report.table("Overhand knot, 301 nodes", ("friction", "ms a step", "contacts"), rows)


def beside_elastica(report: Report, quick: bool) -> None:
    """The knot without friction, and the same in PyElastica at the largest step that survives half a second."""
    if not HAVE_ELASTICA or quick:
        return
    from elastica_contact import KnotRun, largest_stable_step

    radius, points = KNOT["radius"], withe.knots.overhand_knot(n=1, **KNOT)
    run = {
        "points": points,
        "radius": radius,
        "youngs_modulus": KNOT_MODULUS,
        "density": KNOT_DENSITY,
        "stiffness": 9.0 * KNOT_MODULUS * math.pi * radius / 4.0,  # as in the examples: 9 B / radius^3
        "speed": KNOT_SPEED,
    }
    sound = float(np.linalg.norm(points[1] - points[0])) / math.sqrt(KNOT_MODULUS / KNOT_DENSITY)
    step = largest_stable_step(run, 0.6 * sound, 0.5)
    other = KnotRun(**run, time_step=step)
    other.seconds_per_step(200)
    theirs, (ours, _) = other.seconds_per_step(500), _timed(knot(0.0, "lagged"), 200, 200)
    rows = [
        (name, f"{1e3 * size:.3g}", f"{1e3 * seconds:.2f}", f"{seconds / size:.2f}")
        for name, size, seconds in (("ours", KNOT_STEP, ours), ("PyElastica", step, theirs))
    ]
    report.table(
        "The knot without friction, beside PyElastica's rod on itself", ("", "step [ms]", "ms a step", "s per s"), rows
    )


def fluids(report: Report, quick: bool) -> None:
    """Flagella that turn in a fluid of Stokeslets."""
    rows = []
    for count, most in ((2, 2.5), (10, 60.0)):
        seconds, _ = _timed(flagella.build(count, "stokeslets", 1e-3), 3 if quick else 200 if count == 2 else 40, 3)
        rows.append((count, f"{1e3 * seconds:.2f}"))
        report.goal(f"{count} flagella [ms a step]", None if quick else 1e3 * seconds, most, at_least=False)
    report.table("Flagella of 68 nodes in a fluid", ("flagella", "ms a step"), rows)


def pile(rods: int, threads: int = 1) -> withe.Simulation:
    """Rods of 20 nodes, laid crosswise in layers on a floor."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    random = np.random.default_rng(0)
    across, along = 0.2 * PILE_LENGTH, 1.1 * PILE_LENGTH
    rows = max(1, round(math.sqrt(rods / PILE_LAYERS * across / along)))
    for i in range(rods):
        layer, place = i % PILE_LAYERS, i // PILE_LAYERS
        middle = np.array([along * (place % rows), across * (place // rows)]) + 0.1 * across * random.random(2)
        ends = middle + 0.5 * PILE_LENGTH * np.array([[-1.0, 0.0], [1.0, 0.0]])
        height = (1.005 + 2.005 * layer) * PILE_RADIUS
        flat = ends if layer % 2 == 0 else ends[:, ::-1]
        points = np.column_stack([flat, np.full(2, height)])
        scene.add_rod(start=points[0], end=points[1], nodes=20, radius=PILE_RADIUS, material=rubber)
    scene.add_floor(friction=0.3)
    scene.enable_contact(friction=0.3, friction_model="lagged")
    return scene.build(integrator="backward_euler", time_step=1e-3, threads=threads)


def piles(report: Report, quick: bool) -> None:
    """Measure the time of a step of settling piles by the number of rods, in total and without linear solves."""
    counts, fall, steps = ((10, 20), 1, 1) if quick else ((250, 500, 1000), 20, 100)
    rows, seconds, rest = [], [], []
    for count in counts:
        simulation = pile(count)
        simulation.step(fall)
        before = simulation.statistics
        each, contacts = _timed(simulation, steps)
        after = simulation.statistics
        iterations = (after.iterations - before.iterations) / steps
        unsolved = after.total_time - before.total_time - (after.solve_time - before.solve_time)
        seconds.append(each)
        rest.append(unsolved / steps / max(iterations, 1.0))
        rows.append((count, f"{1e3 * each:.0f}", f"{iterations:.1f}", f"{1e3 * rest[-1]:.2f}", contacts))
    report.table(
        "Piles of rods of 20 nodes that settle",
        ("rods", "ms a step", "iterations", "ms an iteration but for linear solves", "contacts"),
        rows,
    )
    exponent, exponent_of_rest = (float(np.polyfit(np.log(counts), np.log(values), 1)[0]) for values in (seconds, rest))
    report.goal("1,000 rods [s a step]", None if quick else seconds[-1], 2.0, at_least=False)
    report.goal("exponent of a step over rods", None if quick else exponent, 1.4, at_least=False)
    report.goal(
        "the same but for linear solves, an iteration", None if quick else exponent_of_rest, 1.15, at_least=False
    )


def main() -> None:
    """All five."""
    quick = arguments(__doc__).quick
    report = Report("contact", quick=quick)
    parts: tuple[Callable[[Report, bool], None], ...] = (grippers, knots, beside_elastica, fluids, piles)
    with bar(len(parts), "contact", "parts") as shown:
        for part in parts:
            part(report, quick)
            shown.advance(1)
    report.write()


if __name__ == "__main__":
    main()
