"""Loose trefoil knots, looser and looser: the limit that Audoly, Clauvelin and Neukirch found for them.

A knot without friction in a rope of radius h and bending stiffness B, its ends pulled. Let e be the shortening (length
minus distance of the ends) and epsilon = sqrt(2 pi h / e). In the limit of small epsilon the pull F satisfies
F h^2 / B = epsilon^4 / 2, and normal forces sum to 0.492 epsilon^3 B / h^2 (2007). Knots of epsilon from 0.13 to 0.07
come to rest here. A parabola is fitted to their pulls and forces over those of the limit, and is read off at
epsilon = 0. Fails when either value is more than 0.03 off.

The strands rest on each other's corners, so that the force in the grips scatters by some percent from knot to knot.
Their energies U do not: the mean pull between two knots is their difference over that of the shortenings, -dU/de, and
the forces in the grips must agree with it on average (to 3 %). Writes out/knot_limit.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

RADIUS, MODULUS, DENSITY = 1e-3, 1e6, 1000.0  # [m], [Pa], [kg/m^3]
BENDING = MODULUS * np.pi * RADIUS**4 / 4.0  # [N m^2]
LINE_DENSITY = DENSITY * np.pi * RADIUS**2  # [kg/m]
TAIL = 1.3  # length over e; bending decays within 0.22 e
NORMAL_FORCES = 0.492
TOLERANCE = 0.03


class Knot(NamedTuple):
    """A knot at rest."""

    epsilon: float
    shortening: float  # e [m]
    energy: float  # [J]
    pull: float  # pull of the grips, relative to that of the limit
    normal_forces: float  # relative to epsilon^3 B / h^2


def centreline(epsilon: float) -> np.ndarray:
    """A drawn knot: edges as long as the radius where strands touch, longer ones in the loop and the tails."""
    e = 2.0 * np.pi * RADIUS / epsilon**2
    length = e * (1.0 + 2.0 * TAIL)
    line = withe.knots.overhand_knot(length=length, radius=RADIUS, shortening=e, nodes=int(length / RADIUS))
    along = np.linspace(0.0, length, len(line))
    sparse = slice(None, None, 4)
    apart = np.linalg.norm(line[sparse, None] - line[None, sparse], axis=2)
    apart[np.abs(along[sparse, None] - along[None, sparse]) < 20.0 * RADIUS] = np.inf
    braid = along[sparse][apart.min(axis=1) < 6.0 * RADIUS]
    second = braid[braid > 0.5 * length].mean()
    places = [0.5 * length]
    while places[-1] < length:  # the other half is its mirror image
        outside = max(abs(places[-1] - second) - 9.0 * RADIUS / epsilon, 0.0)
        places.append(places[-1] + min(RADIUS + 0.1 * outside, e / 120.0))
    half = (np.array(places) - 0.5 * length) * 0.5 * length / (places[-1] - 0.5 * length)
    chosen = 0.5 * length + np.concatenate([-half[:0:-1], half])
    return np.stack([np.interp(chosen, along, line[:, k]) for k in range(3)], axis=1)


def rest(epsilon: float) -> tuple[Knot, withe.Simulation]:
    """A knot whose grips hold its end edges, and let them spin, comes to rest."""
    points = centreline(epsilon)
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=DENSITY)
    rope = scene.add_rod(points=points, radius=RADIUS, material=rubber, natural="straight", name="rope")
    grips = [scene.clamp(node, hold="edge", spin=True) for node in (rope.start, rope.end)]
    size = 2.0 * np.pi * RADIUS / epsilon**2
    time = size**2 * np.sqrt(LINE_DENSITY / BENDING) / 20.0  # time of bending waves around the loop
    scene.add_drag(3.0 * LINE_DENSITY / time)
    # Forces spread over some hundred edges, surfaces a hundredth of a radius deep.
    scene.enable_contact(stiffness=0.75 * epsilon**3 * BENDING / RADIUS**3)
    simulation = scene.build(integrator="backward_euler", time_step=8e-3 * time)
    simulation.step(1500)
    simulation.equilibrium()
    x = simulation.positions(rope)
    distance = float(np.linalg.norm(x[-1] - x[0]))
    e = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) - distance
    epsilon = float(np.sqrt(2.0 * np.pi * RADIUS / e))
    reaction = 0.5 * (simulation.reaction(grips[1]).force - simulation.reaction(grips[0]).force)
    pull = float(reaction @ (x[-1] - x[0])) / distance * RADIUS**2 / BENDING / (0.5 * epsilon**4)
    forces = float(simulation.contacts()["normal_force"].sum()) * RADIUS**2 / BENDING / epsilon**3
    return Knot(epsilon, e, float(simulation.energy().total), pull, forces), simulation


def pulls_between(knots: list[Knot]) -> tuple[np.ndarray, np.ndarray]:
    """Return epsilon, and the mean pull between neighbours, relative to the limit 2 pi^2 B / e^2."""
    e, energy = np.array([k.shortening for k in knots]), np.array([k.energy for k in knots])
    limit = 2.0 * np.pi**2 * BENDING * np.diff(1.0 / e)
    return np.sqrt(2.0 * np.pi * RADIUS / np.sqrt(e[1:] * e[:-1])), np.diff(energy) / limit


def draw(knots: list[Knot], path: Path) -> None:
    """Both over epsilon, with the parabolas down to zero."""
    colors = style.use()
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.8))
    epsilon = np.array([k.epsilon for k in knots])
    fine = np.linspace(0.0, 0.135, 100)
    middle, pulls = pulls_between(knots)
    left.plot(epsilon, [k.pull for k in knots], "x", color=colors.grey, label="force in the grips")
    for axes, x, y in ((left, middle, pulls), (right, epsilon, np.array([k.normal_forces for k in knots]))):
        axes.plot(fine, np.polyval(np.polyfit(x, y, 2), fine), color=colors.blue, linewidth=1.0)
        axes.plot(x, y, "o", color=colors.blue, label="difference of energies" if axes is left else "sum of forces")
    for axes, limit, label in (
        (left, 1.0, "pull, F h² / B / (ε⁴ / 2)"),
        (right, NORMAL_FORCES, "normal forces, P h² / B / ε³"),
    ):
        axes.plot(0.0, limit, "s", color=colors.red, markersize=8, clip_on=False, label="Audoly et al. (2007)")
        axes.set_xlim(0.0, 0.135)
        style.label(axes, x="ε", y=label)
        style.legend(axes, side="top", ncols=2)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Let knots come to rest, fit, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=13, help="number of knots, four or more")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    if arguments.points < 4:
        parser.error("--points must be 4 or more")
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 60 s.", flush=True)

    knots = []
    print("epsilon   pull of the grips   normal forces   contacts   (over those of the limit, epsilon^3 B / h^2)")
    for epsilon in withe.track(np.linspace(0.13, 0.07, arguments.points), "coming to rest", unit="knots"):
        knot, simulation = rest(epsilon)
        knots.append(knot)
        contacts = len(simulation.contacts())
        print(f"{knot.epsilon:.4f}   {knot.pull:17.4f}   {knot.normal_forces:13.4f}   {contacts:8d}", flush=True)
    draw(knots, arguments.out / "knot_limit.png")
    print(f"Wrote {arguments.out / 'knot_limit.png'}.")

    middle, pulls = pulls_between(knots)
    parabola = np.polyfit(middle, pulls, 2)
    grips = np.mean([k.pull / np.polyval(parabola, k.epsilon) for k in knots]) - 1.0
    epsilon, forces = np.array([(k.epsilon, k.normal_forces) for k in knots]).T
    limits = float(parabola[2]), float(np.polyfit(epsilon, forces, 2)[2])
    print(f"at epsilon = 0: pull {limits[0]:.3f} of the limit's, normal forces {limits[1]:.3f} ({NORMAL_FORCES})")
    print(f"the grips pull {grips:+.1%} of -dU/de on average")
    if max(abs(limits[0] - 1.0), abs(limits[1] - NORMAL_FORCES), abs(grips)) > TOLERANCE:
        sys.exit("That is not the limit of loose knots.")


if __name__ == "__main__":
    main()
