"""A trefoil knot is pulled tight, with friction and without, and let loose: what it takes, and where it locks.

A rope of bending stiffness B and radius h is tied loosely and pulled slowly at its ends, which may spin. With e its
length minus the distance of its ends, the pull F only depends on e / h and on friction. Audoly, Clauvelin and Neukirch
(2007) give the limit of loose knots, with epsilon = sqrt(2 pi h / e): F h^2 / B = epsilon^4 / 2 +- 0.492 mu epsilon^3.
The sign is plus while the knot tightens. Tighter knots pull harder (knot_limit.py goes towards that limit).

Fails in any of these cases:

- A pull is more than 6 % off the pull of an independent code, which shares nothing with this code but the knot.
- Without friction, a pull is more than 3 % off the energy stored over the way, -dU/de.
- Friction does not lock the knot as it loosens.

Writes out/knot.png and out/knot_plot.png. `--speed 1e-3` is half the speed: no pull changes by 1 %.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

LENGTH, RADIUS, MODULUS = 1.0, 1.6e-3, 1.8e5  # [m], [m], [Pa]
BENDING = MODULUS * np.pi * RADIUS**4 / 4.0  # [N m^2]
TIME_STEP = 5e-3  # [s]
DRAWN, LOOSE = 375, 450  # e / h at first, and in the end
# F h^2 / B over e / h, found without twist and with edges no longer than h.
INDEPENDENT = {
    0.0: {300: 2.65e-4, 200: 6.3e-4, 150: 1.165e-3, 100: 2.87e-3, 75: 5.5e-3},
    0.1: {300: 5.4e-4, 200: 1.21e-3, 150: 2.17e-3, 100: 5.0e-3, 75: 9.1e-3},
}
COLORS = {0.0: "C0", 0.1: "C1"}
TOLERANCE, ENERGY_TOLERANCE = 0.06, 0.03


class Way(NamedTuple):
    """Measurements while the grips moved from one distance to another."""

    shortening: np.ndarray  # e / h
    force: np.ndarray  # F h^2 / B
    energy: np.ndarray  # stored, U h / B

    def near(self, shortening: float) -> float:
        """Mean force about an e / h."""
        return mean_near(self.shortening, self.force, shortening)


def mean_near(shortening: np.ndarray, force: np.ndarray, at: float) -> float:
    """Mean force within 2 %: edges that slide over edges catch, and the pull has teeth."""
    return float(force[np.abs(shortening / at - 1.0) < 0.02].mean())


class Tied(NamedTuple):
    """A knot in a rope, and the grips at its ends."""

    simulation: withe.Simulation
    rope: withe.Rod
    grips: list[withe.Support]


def tie(n: int, nodes: int, shortening: float, friction: float, drag: float) -> Tied:
    """A loose overhand knot, at rest, its end edges held by grips that spin; drawn at e / h, with a drag for later."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=1180.0)
    points = withe.knots.overhand_knot(n, length=LENGTH, radius=RADIUS, shortening=shortening * RADIUS, nodes=nodes)
    rope = scene.add_rod(points=points, radius=RADIUS, material=rubber, natural="straight", name="rope")
    grips = [scene.clamp(node, hold="edge", spin=True) for node in (rope.start, rope.end)]
    damping = scene.add_drag(0.0)
    # The slip tolerance is far below the speed of the grips. Stiffness: a depth of a hundredth of a radius, in a tight
    # knot.
    scene.enable_contact(
        friction=friction, friction_model="lagged", slip_tolerance=1e-5, stiffness=9.0 * BENDING / RADIUS**3
    )
    simulation = scene.build(integrator="backward_euler", time_step=TIME_STEP)
    # With the second drag, waves of the tails decay fastest. Without it they change the pull by 4 %.
    for duration, slowing in ((4.0, 0.2), (10.0, 0.02)):
        simulation.set(damping, drag=slowing)
        simulation.step(round(duration / TIME_STEP))
    simulation.set(damping, drag=drag)
    return Tied(simulation, rope, grips)


def pulled(knot: Tied, target: float, speed: float) -> Iterator[tuple[np.ndarray, float]]:
    """Move both grips along their line until e / h is `target`, each at a speed [m/s].

    After every time step: where the rope lies (nodes, 3) [m], and the mean pull of the grips [N].
    """
    simulation, rope, grips = knot
    x = simulation.positions(rope)
    distance = float(np.linalg.norm(x[-1] - x[0]))
    axis = (x[-1] - x[0]) / distance
    way = 0.5 * (LENGTH - distance - target * RADIUS)
    for grip, at, sign in zip(grips, (x[0], x[-1]), (-1.0, 1.0), strict=True):
        simulation.move(grip, position=at + sign * way * axis, over=abs(way) / speed)
    for _ in withe.track(range(round(abs(way) / speed / TIME_STEP)), "pulling", unit="steps"):
        simulation.step()
        difference = simulation.reaction(grips[1]).force - simulation.reaction(grips[0]).force
        yield simulation.positions(rope), 0.5 * float(difference @ axis)


def shortening_of(x: np.ndarray) -> float:
    """Length minus distance of the ends [m]."""
    return LENGTH - float(np.linalg.norm(x[-1] - x[0]))


def move(knot: Tied, target: float, speed: float) -> Way:
    """Move the grips until e / h is `target`, each at a speed [m/s], and note the pull and the energy on the way."""
    rows = []
    for x, pull in pulled(knot, target, speed):
        energy = knot.simulation.energy()
        rows.append((shortening_of(x), pull, energy.total - energy.kinetic))
    shortening, force, stored = np.array(rows).T
    return Way(shortening / RADIUS, force * RADIUS**2 / BENDING, stored * RADIUS / BENDING)


def energy_gap(way: Way, targets: list[int]) -> float:
    """Greatest relative difference of the mean pull between two targets and the energy stored there over the way."""
    worst = 0.0
    for loose, tight in itertools.pairwise(targets):
        between = (way.shortening < loose) & (way.shortening > tight)
        stored = np.ptp(np.interp([-loose, -tight], -way.shortening, way.energy)) / (loose - tight)
        worst = max(worst, abs(way.force[between].mean() / stored - 1.0))
    return worst


def draw(tightened: dict[float, Way], loosened: Way | None, path: Path) -> None:
    """Pull over shortening, in numbers without unit."""
    colors = style.use()
    figure, axes = plt.subplots(figsize=(6.8, 4.6))
    epsilon = np.sqrt(2.0 * np.pi / np.geomspace(70.0, 400.0, 100))
    ways = [(way, friction, f"friction {friction:g}, tightened") for friction, way in tightened.items()]
    if loosened is not None:
        ways.append((loosened, -0.1, "friction 0.1, loosened"))
    for way, friction, label in ways:
        color = COLORS[abs(friction)]
        inside = np.abs(np.log(way.shortening / way.shortening[0])) > 0.08
        places = np.geomspace(way.shortening[inside].min() * 1.02, way.shortening[inside].max() * 0.98, 80)
        forces = [way.near(e) for e in places]
        axes.loglog(places, forces, color=color, linestyle="-" if friction >= 0.0 else "-.", label=label)
        limit = 0.5 * epsilon**4 + 0.492 * friction * epsilon**3
        axes.loglog(2.0 * np.pi / epsilon**2, np.where(limit > 0.0, limit, np.nan), ":", color=color)
        if friction >= 0.0:
            axes.loglog(*zip(*INDEPENDENT[friction].items(), strict=True), "s", color=color, fillstyle="none")
    axes.plot([], [], ":", color=colors.grey, label="limit of loose knots (2007)")
    axes.plot([], [], "s", color=colors.grey, fillstyle="none", label="independent code")
    axes.set_ylim(5e-6, 2e-2)
    style.label(axes, x="shortening over radius, e / h", y="pull, F h² / B")
    axes.set_xticks([75, 100, 150, 200, 300, 400], labels=["75", "100", "150", "200", "300", "400"])
    axes.minorticks_off()
    style.legend(axes)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Pull, compare, let loose, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=627, help="627: edges as long as the radius")
    parser.add_argument("--points", type=int, default=5, help="how many of the pulls to measure, 2 to 5")
    parser.add_argument("--speed", type=float, default=2e-3, help="of each grip [m/s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    if not 2 <= arguments.points <= 5:
        parser.error("--points must be 2 to 5")
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 200 s.", flush=True)

    tightened, worst, gap, locked = {}, 0.0, 0.0, None
    loosened = None
    for friction, known in INDEPENDENT.items():
        targets = list(known)[: arguments.points]
        knot = tie(1, arguments.nodes, DRAWN, friction, drag=5e-4)
        way = move(knot, 0.975 * targets[-1], arguments.speed)
        tightened[friction] = way
        print(f"friction {friction:g}\n  e / h    F h^2 / B   independent   difference")
        for target in targets:
            pull = way.near(target)
            off = pull / known[target] - 1.0
            worst = max(worst, abs(off))
            print(f"  {target:5.0f}   {pull:10.3e}    {known[target]:10.3e}     {off:+7.1%}", flush=True)
        if friction == 0.0:
            gap = energy_gap(way, targets)
            print(f"the pull is that of the stored energy, -dU/de, within {gap:.1%}")
            continue
        knot.simulation.picture(arguments.out / "knot.png", size=(1280, 360), camera="top")
        if arguments.points == 5:
            loosened = move(knot, LOOSE, arguments.speed)
            places = np.arange(100, int(0.97 * LOOSE))
            locked = next((e for e in places if loosened.near(e) <= 0.0), None)
            print(f"loosened, it locks at e / h = {locked}: no pull is left that would open it farther")
    draw(tightened, loosened, arguments.out / "knot_plot.png")
    print(f"Wrote {arguments.out / 'knot_plot.png'} and {arguments.out / 'knot.png'}.")
    if worst > TOLERANCE or gap > ENERGY_TOLERANCE:
        sys.exit(f"A pull is {worst:.1%} off another code, or {gap:.1%} off its energy.")
    if loosened is not None and locked is None:
        sys.exit("The knot does not lock.")


if __name__ == "__main__":
    main()
