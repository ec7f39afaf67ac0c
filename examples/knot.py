"""A trefoil knot is pulled tight without friction: what it takes, against another code and against theory.

A rope of bending stiffness B and radius h is tied loosely and pulled at its ends, which may spin. With e its length
minus the distance of its ends, the pull F only depends on e / h. Audoly, Clauvelin and Neukirch (2007) give the limit
of loose knots, F h^2 / B = epsilon^4 / 2 with epsilon = sqrt(2 pi h / e); tighter ones pull harder. Fails when a pull
is more than 6 % off what an independent code found, one that shares nothing with this one but the knot.

Writes out/knot.png and out/knot_plot.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import withe

LENGTH, RADIUS, MODULUS = 1.0, 1.6e-3, 1.8e5  # [m], [m], [Pa]
STIFFNESS = MODULUS * np.pi * RADIUS**4 / 4.0  # [N m^2]
SPEED = 0.04  # of each grip [m/s]
# e / h and F h^2 / B, found without twist and with edges no longer than h.
INDEPENDENT = np.array([[300, 2.65e-4], [200, 6.3e-4], [150, 1.165e-3], [100, 2.87e-3], [75, 5.5e-3]])
TOLERANCE = 0.06


def tie(nodes: int) -> tuple[withe.Simulation, withe.Rod, list[withe.Support]]:
    """A loose trefoil, at rest, its end edges held by grips that spin."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=1180.0)
    points = withe.shapes.overhand_knot(1, length=LENGTH, radius=RADIUS, shortening=320 * RADIUS, nodes=nodes)
    rope = scene.add_rod(points=points, radius=RADIUS, material=rubber, natural="straight", name="rope")
    grips = [scene.clamp(node, hold="edge", spin=True) for node in (rope.start, rope.end)]
    scene.add_drag(0.2)
    scene.enable_contact()
    simulation = scene.build(integrator="backward_euler", time_step=2.5e-3)
    simulation.step(800)
    return simulation, rope, grips


def shortening(simulation: withe.Simulation, rope: withe.Rod) -> float:
    """Length minus distance of the ends, over the radius."""
    x = simulation.positions(rope)
    return float(LENGTH - np.linalg.norm(x[-1] - x[0])) / RADIUS


def pull_to(simulation: withe.Simulation, rope: withe.Rod, grips: list[withe.Support], target: float) -> float:
    """Pull the grips apart until e / h is `target`, and return F h^2 / B at rest there."""
    x = simulation.positions(rope)
    axis = (x[-1] - x[0]) / np.linalg.norm(x[-1] - x[0])
    way = 0.5 * (shortening(simulation, rope) - target) * RADIUS
    for grip, end, sign in zip(grips, (x[0], x[-1]), (-1.0, 1.0), strict=True):
        simulation.move(grip, position=end + sign * way * axis, over=way / SPEED)
    simulation.step(round(way / SPEED / simulation.time_step) + 200)
    simulation.equilibrium()
    pull = 0.5 * (simulation.reaction(grips[1]).force - simulation.reaction(grips[0]).force) @ axis
    return float(pull) * RADIUS**2 / STIFFNESS


def draw(measured: np.ndarray, path: Path) -> None:
    """Pull over shortening, in numbers without unit."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    e = np.linspace(70.0, 320.0, 200)
    axes.loglog(e, 0.5 * (2.0 * np.pi / e) ** 2, color="#8a9299", linestyle="--", label="limit of loose knots (2007)")
    axes.loglog(*INDEPENDENT.T, "s", color="#d1495b", markerfacecolor="none", markersize=9, label="independent code")
    axes.loglog(*measured.T, "o-", color="#00798c", label="withe")
    axes.set_xlabel("shortening over radius, e / h")
    axes.set_ylabel("pull, F h² / B")
    axes.set_xticks([75, 100, 150, 200, 300], labels=["75", "100", "150", "200", "300"])
    axes.set_yticks([3e-4, 1e-3, 3e-3], labels=["0.0003", "0.001", "0.003"])
    axes.minorticks_off()
    axes.grid(True, color="#e3e7ea")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def main() -> None:
    """Pull, compare, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=601, help="601: edges about as long as the radius")
    parser.add_argument("--points", type=int, default=len(INDEPENDENT), help="how many of the pulls to measure")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    simulation, rope, grips = tie(arguments.nodes)
    measured, worst = [], 0.0
    print("  e / h    F h^2 / B   independent   difference   contacts")
    for target, known in INDEPENDENT[: arguments.points]:
        pull = pull_to(simulation, rope, grips, target)
        measured.append((shortening(simulation, rope), pull))
        worst = max(worst, abs(pull / known - 1.0))
        contacts = len(simulation.contacts())
        print(f"  {target:5.0f}   {pull:10.3e}    {known:10.3e}     {pull / known - 1.0:+7.1%}   {contacts:8d}")
    draw(np.array(measured), arguments.out / "knot_plot.png")
    simulation.picture(arguments.out / "knot.png")
    print(f"Wrote {arguments.out / 'knot_plot.png'} and {arguments.out / 'knot.png'}.")
    if worst > TOLERANCE:
        sys.exit(f"A pull is {worst:.1%} off.")


if __name__ == "__main__":
    main()
