"""A twisted rod under tension winds up about itself: its helices against the theory of plectonemes.

Supports hold the ends of a rod so that it keeps its link, and pull it with a force F. Two of its strands wind about
each other, at a distance of 2 R. The bending stiffness is B. The theory of Clauvelin, Audoly and Neukirch (2009)
depends on F R^2 / B alone. It gives the angle a of the strands to their common axis, the twisting moment M, and the
contact force p per length of strand:

    F R^2 / B = sin^3 a (cos a tan 2a - sin(a) / 2),   M R / B = (2 / sin 2a) (sin^4(a) / 2 + F R^2 / B),
    p R^3 / B = F R^2 / B - sin^4(a) / 2.

Fails when the angle or the moment is more than 3 % off, or the contact force 5 %. The measured part lies between the
ends of the plectoneme, where the theory holds. Writes out/plectoneme.png and out/plectoneme_plot.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.knots import writhe
from withe.view import style

RADIUS, MODULUS, DENSITY = 1e-3, 1e6, 1000.0  # [m], [Pa], [kg/m^3]
BENDING = MODULUS * np.pi * RADIUS**4 / 4.0  # [N m^2]
TWISTING = BENDING / 1.5  # for an incompressible material
FORCES = (0.001, 0.005, 0.01, 0.03)  # F h^2 / B, h the radius of the rod
TOLERANCES = {"angle": 0.03, "moment": 0.03, "pressure": 0.05}


class Plectoneme(NamedTuple):
    """Angle a [rad], moment M R / B and contact force p R^3 / B at a force F R^2 / B."""

    force: float
    angle: float
    moment: float
    pressure: float


def theory(angle: float | np.ndarray) -> Plectoneme:
    """All that belongs to an angle between strands and axis."""
    sine = np.sin(angle)
    force = sine**3 * (np.cos(angle) * np.tan(2.0 * angle) - 0.5 * sine)
    return Plectoneme(force, angle, 2.0 / np.sin(2.0 * angle) * (0.5 * sine**4 + force), force - 0.5 * sine**4)


def theory_at(force: float) -> Plectoneme:
    """Plectoneme of a force F R^2 / B. The force increases with the angle, so bisection finds the angle."""
    low, high = 0.0, 0.7
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if theory(middle).force < force else (low, middle)
    return theory(low)


def centreline(expected: Plectoneme, turns: int, edge: float) -> np.ndarray:
    """A plectoneme as drawn: tails along x, two strands about y that do not touch yet, and a loop."""
    r, bend = 1.1 * RADIUS, 1.1 * RADIUS / np.sqrt(expected.force)
    turn = np.linspace(0.0, 2.0 * np.pi * turns, 200 * turns)
    strand = r * np.stack([-np.cos(turn), turn / np.tan(expected.angle), np.sin(turn)], axis=1)
    corner = np.linspace(0.5 * np.pi, 0.0, 40)
    tail = np.stack([-r - bend * (1.0 - np.cos(corner)), -bend * np.sin(corner), 0.0 * corner], axis=1)
    tail = np.concatenate([tail[:1] - [6.0 * bend, 0.0, 0.0], tail])
    widening = np.linspace(0.0, np.pi / 3.0, 40)
    neck = np.stack([-r - bend * (1.0 - np.cos(widening)), bend * np.sin(widening), 0.0 * widening], axis=1)
    neck[:, 1] += strand[-1, 1]
    size = -neck[-1, 0] / np.cos(widening[-1])
    round_ = np.linspace(np.pi + widening[-1], -widening[-1], 120)[1:-1]
    loop = size * np.stack([np.cos(round_), np.sin(round_) + np.sin(widening[-1]), 0.0 * round_], axis=1)
    loop[:, 1] += neck[-1, 1]
    half = np.concatenate([tail[:-1], strand[:-1], neck])
    line = np.concatenate([half, loop, (half * [-1.0, 1.0, -1.0])[::-1]])
    places = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    even = np.linspace(0.0, places[-1], int(np.ceil(places[-1] / (edge * RADIUS))) + 1)
    return np.stack([np.interp(even, places, line[:, k]) for k in range(3)], axis=1)


def wind(force: float, turns: int, edge: float) -> tuple[withe.Simulation, withe.Rod]:
    """The plectoneme at rest, from the drawn one, at constant pull and link."""
    expected, pull = theory_at(force), force * BENDING / RADIUS**2
    points = centreline(expected, turns, edge)
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=DENSITY)
    rod = scene.add_rod(points=points, radius=RADIUS, material=rubber, natural="straight", name="rod")
    scene.clamp(rod.start, hold="edge")
    scene.clamp(rod.end, hold="edge", free=(1.0, 0.0, 0.0))
    scene.add_force(rod.end, (pull, 0.0, 0.0))
    # Waves run through the rod in this time. The drag lets it creep: strands that slide by an edge a step catch.
    line_density = DENSITY * np.pi * RADIUS**2
    wave_time = length * np.sqrt(line_density / pull)
    scene.add_drag(15.0 * line_density / wave_time)
    # Surfaces about a hundredth of a radius deep. One that followed the forces would change as edges slide past edges.
    stiffness = expected.pressure * BENDING * edge / RADIUS**2 / (2.0 * 0.01 * RADIUS)
    scene.enable_contact(stiffness=stiffness)
    simulation = scene.build(integrator="backward_euler", time_step=wave_time / 40.0)
    # The rod is drawn without twist. The moment of the theory causes this twist.
    twist = expected.moment * BENDING / RADIUS / TWISTING
    simulation.set(rod, natural_twist=-np.sign(writhe(points)) * twist)
    simulation.step(1200)
    simulation.equilibrium()
    return simulation, rod


def measure(simulation: withe.Simulation, rod: withe.Rod) -> tuple[Plectoneme, float]:
    """Properties of the middle two fifths of a plectoneme, and half the distance of its strands [m]."""
    contacts = simulation.contacts()
    middle = contacts["point"].mean(axis=0)
    axis = np.linalg.svd(contacts["point"] - middle)[2][0]
    places = (contacts["point"] - middle) @ axis
    low, high = np.quantile(places, [0.0, 1.0]) @ np.array([[0.7, 0.3], [0.3, 0.7]])
    inside = contacts[(places > low) & (places < high)]
    half = 0.5 * float(inside["distance"].mean())
    x = simulation.positions(rod)
    tangents = np.diff(x, axis=0) / np.linalg.norm(np.diff(x, axis=0), axis=1, keepdims=True)
    along = (0.5 * (x[1:] + x[:-1]) - middle) @ axis
    cosine = float(np.abs(tangents[(along > low) & (along < high)] @ axis).mean())
    # The far end is free to slide and carries the pull: it has no force of its own along x.
    pull = -float(simulation.reaction(rod.start).force[0])
    moment = abs(float(simulation.reaction(rod.start).moment[0]))
    pressure = float(inside["normal_force"].sum()) / ((high - low) / cosine)
    found = Plectoneme(
        pull * half**2 / BENDING, float(np.arccos(cosine)), moment * half / BENDING, pressure * half**3 / BENDING
    )
    return found, half


def draw(found: list[Plectoneme], path: Path) -> None:
    """Angle, moment and contact force over the pull."""
    colors = style.use()
    curve = theory(np.linspace(0.13, 0.39, 200))
    figure, panels = plt.subplots(1, 3, figsize=(9.6, 3.4))
    labels = {
        "angle": ("angle of the strands", "rad"),
        "moment": "moment, M R / B",
        "pressure": "contact force, p R³ / B",
    }
    for axes, (name, label) in zip(panels, labels.items(), strict=True):
        axes.plot(curve.force, getattr(curve, name), color=colors.grey, label="Clauvelin et al. (2009)")
        axes.plot([p.force for p in found], [getattr(p, name) for p in found], "o", color=colors.blue, label="withe")
        axes.set_xscale("log")
        style.label(axes, x="pull, F R² / B", y=label)
        if name != "angle":
            axes.set_yscale("log")
    style.legend(panels[0], side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Wind, compare, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--forces", type=float, nargs="+", default=FORCES, help="F h^2 / B, h the rod's radius")
    parser.add_argument("--turns", type=int, default=3, help="of each strand, as drawn")
    parser.add_argument("--edge", type=float, default=1.0, help="length of an edge over the radius")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 20 s.", flush=True)

    found, worst = [], dict.fromkeys(TOLERANCES, 0.0)
    print("F R^2 / B   angle [rad]      M R / B          p R^3 / B         contacts")
    for force in withe.track(arguments.forces, "winding", unit="forces"):
        simulation, rod = wind(force, arguments.turns, arguments.edge)
        here, _ = measure(simulation, rod)
        found.append(here)
        known, row = theory_at(here.force), f"{here.force:9.5f} "
        for name in TOLERANCES:
            off = getattr(here, name) / getattr(known, name) - 1.0
            worst[name] = max(worst[name], abs(off))
            row += f"  {getattr(here, name):.5f} {off:+6.2%}"
        print(row, f"  {len(simulation.contacts())}", flush=True)
    draw(found, arguments.out / "plectoneme_plot.png")
    simulation.picture(arguments.out / "plectoneme.png", camera=(0.0, 0.0, 1.0))
    print(f"Wrote {arguments.out / 'plectoneme_plot.png'} and {arguments.out / 'plectoneme.png'}.")
    print(", ".join(f"{name} at most {value:.2%} off" for name, value in worst.items()))
    if any(worst[name] > tolerance for name, tolerance in TOLERANCES.items()):
        sys.exit("That is not how a plectoneme winds.")


if __name__ == "__main__":
    main()
