"""A guidewire is pushed through a bent vessel: its push, and where the work of the hand goes.

The vessel is a tube whose axis is a spline in space: a straight piece, an arch out of the plane, and a straight piece
again. A nitinol wire of 0.36 mm enters through the mouth of the vessel. A hand pushes its other end at 50 mm/s. The
wire touches the outer wall of the arch with its tip, and then both walls. Part of the push bends the wire, and the rest
goes into friction.

The work of the hand is the sum of force times way over all steps. The example compares it with the energy that the wire
has gained and with what friction has dissipated. It fails if the difference is above 1 % of the work.

Writes out/guidewire.png and, with --film, out/guidewire.mp4.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

INNER_RADIUS, WALL, FRICTION = 2e-3, 5e-4, 0.1  # of the vessel [m], [m], [-]
WIRE_RADIUS, LENGTH, NODES = 1.8e-4, 0.19, 191  # [m]
NITINOL = withe.Material(youngs_modulus=7.5e10, density=6450.0, viscosity=7.5e6)
SPEED, INSERTION = 0.05, 0.15  # of the hand [m/s], [m]
TIME_STEP = 2e-3  # [s]
MOST_LOST = 0.01  # of the work, unaccounted for


def axis() -> np.ndarray:
    """Return points of the axis of the vessel, shape (n, 3) [m]."""
    places = np.linspace(0.0, 1.0, 61)
    turn = 0.85 * np.pi * np.clip((places - 0.25) / 0.5, 0.0, 1.0)
    directions = np.column_stack([np.cos(turn), 0.9 * np.sin(turn), 0.436 * np.sin(turn)])
    steps = 0.2 / 60 * 0.5 * (directions[1:] + directions[:-1])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def scene() -> tuple[withe.Scene, withe.Rod, withe.Support]:
    """Return the scene, the wire and the hand that holds its end."""
    made = withe.Scene(gravity=(0.0, 0.0, 0.0))
    vessel = withe.solids.Tube(axis(), radius=INNER_RADIUS, wall=WALL)
    made.add_obstacle(vessel, friction=FRICTION, name="vessel")
    wire = made.add_rod(
        start=(0.01 - LENGTH, 0, 0), end=(0.01, 0, 0), nodes=NODES, radius=WIRE_RADIUS, material=NITINOL, name="wire"
    )
    return made, wire, made.clamp(wire.start, name="hand")


def push(made: withe.Scene, hand: withe.Support, insertion: float) -> tuple[withe.Record, np.ndarray, withe.Energy]:
    """Return the motion, the way [m] and push [N] of the hand in each step, shape (steps, 2), and the energies."""
    simulation = made.build(integrator="backward_euler", time_step=TIME_STEP)
    start = 0.01 - LENGTH
    simulation.move(hand, position=(start + insertion, 0, 0), over=insertion / SPEED)
    pushes = []

    def note(now: withe.Simulation) -> None:
        if now.time > 0.0:
            pushes.append((now.positions("wire")[0, 0] - start, now.reaction(hand).force[0]))

    record = simulation.run(insertion / SPEED, record_every=0.02, before_step=note)
    note(simulation)
    return record, np.array(pushes), simulation.energy()


def draw(record: withe.Record, pushes: np.ndarray, path: Path) -> None:
    """Draw the wire in the vessel from above at several times, and its push."""
    colors = style.use()
    figure, (seen, forces) = plt.subplots(1, 2, figsize=(10.8, 4.4), width_ratios=(1.25, 1.0), layout="constrained")
    along = axis()
    normal = np.gradient(along[:, :2], axis=0) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    normal *= INNER_RADIUS / np.linalg.norm(normal, axis=1, keepdims=True)
    walls = along[:, :2] + normal, along[:, :2] - normal
    seen.fill(*np.concatenate([walls[0], walls[1][::-1]]).T * 1e3, facecolor=colors.pale, edgecolor="none")
    for wall in walls:
        seen.plot(*wall.T * 1e3, color=colors.grey, linewidth=1.2)
    moments = np.linspace(0, len(record) - 1, 6).round().astype(int)
    for frame, shade in zip(moments, style.ramp()(np.linspace(0.0, 1.0, len(moments))), strict=True):
        seen.plot(*record.positions("wire")[frame][:, :2].T * 1e3, color=shade, linewidth=1.8)
    seen.set(aspect="equal", xlim=(-45, None), title=f"seen from above: 0 to {record.times[-1]:.1f} s, light to dark")
    style.label(seen, x=("x", "mm"), y=("y", "mm"))
    forces.plot(pushes[:, 0] * 1e3, pushes[:, 1] * 1e3, color=colors.blue)
    forces.set(ylim=(0.0, None), title="push of the hand")
    style.label(forces, x=("insertion", "mm"), y=("force", "mN"))
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Push, compare energies, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--insertion", type=float, default=INSERTION, help="[m]")
    parser.add_argument("--film", action="store_true", help="write out/guidewire.mp4 too")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 3 s.", flush=True)

    made, _, hand = scene()
    record, pushes, energy = push(made, hand, arguments.insertion)
    ways = np.diff(pushes[:, 0], prepend=0.0)
    work = float(pushes[:, 1] @ ways)
    lost = (energy.total + energy.dissipated - work) / work
    print(f"push at most {1e3 * pushes[:, 1].max():.1f} mN, {1e3 * pushes[-1, 1]:.1f} mN at the end")
    print(
        f"work {1e3 * work:.3f} mJ: {1e3 * energy.total:.3f} mJ in the wire, {1e3 * energy.dissipated:.3f} mJ "
        f"dissipated, {100 * lost:+.2f} % unaccounted for"
    )
    draw(record, pushes, arguments.out / "guidewire.png")
    print(f"Wrote {arguments.out / 'guidewire.png'}.")
    if arguments.film:
        print(f"Wrote {record.animate(arguments.out / 'guidewire.mp4')}.")
    if abs(lost) > MOST_LOST:
        sys.exit("The energies are not the work of the hand.")


if __name__ == "__main__":
    main()
