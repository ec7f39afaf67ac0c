"""A rod at rest on a floor is pushed along itself, with 44 forces: it sticks, or slides as a block does.

A force F pushes a block of mass m for a time t over a floor with friction mu. Above F = mu m g = 3.92 N the block gains
the kinetic energy (F - mu m g)^2 t^2 / (2 m), and none below. The rod is that of section 6.3.3 of Choi's dissertation.
Friction is regularised, as there. Anchors, the default, would yield by a twentieth of the distance tolerance before
they slip. A block under a sudden force gains some 8 mm/s on this way, which is 4 % of the energy of the slowest block
here. The example fails if a rod that should stick has more than 0.0001 J, or a sliding rod is more than 1 % off.

Writes out/friction.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

LENGTH, RADIUS, DENSITY, GRAVITY, FRICTION = 1.0, 2.5e-2, 509.2985, 9.8, 0.4
MASS = DENSITY * np.pi * RADIUS**2 * LENGTH  # 1 kg
LIMIT = FRICTION * MASS * GRAVITY  # [N]
DURATION = 1.5  # [s]
STICKING, SLIDING = 1e-4, 0.01  # [J], relative


def resting() -> tuple[withe.Simulation, withe.Load]:
    """The rod in equilibrium on the floor, not pushed yet."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    foam = withe.Material(youngs_modulus=1e5, poisson_ratio=0.5, density=DENSITY)
    rod = scene.add_rod(start=(0, 0, RADIUS), end=(LENGTH, 0, RADIUS), nodes=26, radius=RADIUS, material=foam)
    scene.add_floor(friction=FRICTION)
    scene.enable_contact(friction_model="implicit", distance_tolerance=5e-4, slip_tolerance=1e-3)
    push = scene.add_load(rod, (0.0, 0.0, 0.0), name="push")
    simulation = scene.build(time_step=5e-3)
    simulation.equilibrium()
    return simulation, push


def draw(forces: np.ndarray, energies: np.ndarray, path: Path) -> None:
    """Kinetic energy over force, beside the block's."""
    colors = style.use()
    figure, axes = plt.subplots(figsize=(6.4, 4.0))
    fine = np.linspace(forces[0], forces[-1], 400)
    axes.plot(fine, block(fine), color=colors.grey, label="block with Coulomb's friction")
    axes.plot(forces, energies, "o", color=colors.blue, markersize=4, label="withe")
    axes.axvline(LIMIT, color=colors.red, linestyle=":", label=f"limit, {LIMIT:.2f} N")
    style.label(axes, x=("force", "N"), y=(f"kinetic energy after {DURATION:g} s", "J"))
    style.legend(axes, side="top")
    figure.savefig(path)
    plt.close(figure)


def block(forces: np.ndarray) -> np.ndarray:
    """Kinetic energy of a block [J]."""
    return DURATION**2 / (2.0 * MASS) * np.maximum(forces - LIMIT, 0.0) ** 2


def main() -> None:
    """Push, compare, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--forces", type=int, default=44)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    # The nearest one above the limit is 5 % above it.
    below = round(arguments.forces * 16 / 44)
    stuck = np.linspace(0.0, 0.995 * LIMIT, below)
    sliding = np.linspace(4.121, 10.0, arguments.forces - below)
    forces = np.concatenate([stuck, sliding])
    start, push = resting()
    simulations = [start.copy() for _ in forces]
    for simulation, force in zip(simulations, forces, strict=True):
        simulation.set(push, load=(force / LENGTH, 0.0, 0.0))
    withe.run_many(simulations, DURATION)
    energies = np.array([simulation.energy().kinetic for simulation in simulations])

    most = energies[:below].max()
    off = np.abs(energies[below:] / block(sliding) - 1.0)
    draw(forces, energies, arguments.out / "friction.png")
    print(
        f"{below} forces below the limit: at most {most:.1e} J. {len(sliding)} above it: at most {off.max():.2%} off."
    )
    print(f"Wrote {arguments.out / 'friction.png'}.")
    if most > STICKING or off.max() > SLIDING:
        sys.exit("That is not how a block slides.")


if __name__ == "__main__":
    main()
