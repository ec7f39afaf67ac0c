"""Two jaws pinch a box and lift it from the floor by friction, with different forces.

Jaws, box and hand are rigid bodies. The jaws slide on the hand, and a force F presses each of them on the box. Friction
bears at most 2 mu F, so the box stays behind if F is below m g / (2 mu). The example lifts with forces from 0.8 to 1.5
of that limit. It fails if the box comes along below the limit, or slips above it.

Writes out/pinch_box.png and out/pinch_box_heights.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

GRAVITY = 9.81  # [m/s^2]
SIDE, MASS, FRICTION = 0.05, 0.2, 0.5  # of the box [m], [kg], [-]
JAW = (0.01, 0.04, 0.07)  # [m]
SHARES = (0.8, 0.95, 1.05, 1.5)  # of the least force
CLOSE, LIFT, HEIGHT = 0.2, 1.2, 0.06  # durations [s], [m]
TIME_STEP = 2e-3  # [s]


def build(force: float) -> tuple[withe.Simulation, withe.Support]:
    """Return the jaws beside the box, which a force presses on it [N], and what holds the hand."""
    scene = withe.Scene(gravity=(0, 0, -GRAVITY))
    scene.enable_contact(friction=FRICTION)
    scene.add_floor(friction=FRICTION)
    scene.add_body(withe.solids.Box((SIDE,) * 3), mass=MASS, position=(0, 0, 0.5 * SIDE), name="box")
    hand = scene.add_body(withe.solids.Box((0.16, 0.04, 0.02)), mass=0.5, position=(0, 0, 0.1065), name="hand")
    for side, name in ((-1, "left jaw"), (1, "right jaw")):
        middle = 0.5 * (SIDE + JAW[0]) + 2e-3
        jaw = scene.add_body(withe.solids.Box(JAW), mass=0.05, position=(side * middle, 0, 0.06), name=name)
        at, inwards = (side * middle, 0, 0.095), (-side, 0, 0)
        scene.join(hand, jaw, "sliding", at=at, axis=inwards, moment=force, damping=20.0)
    arm = scene.clamp(hand, name="arm")
    return scene.build(time_step=TIME_STEP), arm


def lift(force: float) -> tuple[withe.Simulation, withe.Record]:
    """Close the jaws and lift; return the simulation at its end and its motion."""
    simulation, arm = build(force)
    x, y, z = simulation.position("hand")

    def path(time: float) -> tuple[float, float, float]:
        share = float(np.clip((time - CLOSE) / LIFT, 0.0, 1.0))
        return x, y, z + HEIGHT * share**2 * (3.0 - 2.0 * share)

    simulation.move(arm, path=path)
    record = simulation.run(CLOSE + LIFT, record_every=0.01, progress=False)
    return simulation, record


def draw(records: dict[float, withe.Record], path: Path) -> None:
    """Draw the heights of the box and of the hand."""
    colors = style.use()
    figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
    shades = style.ramp()(np.linspace(0.15, 1.0, len(records)))
    widths = np.linspace(4.5, 1.5, len(records))
    for (share, record), shade, width in zip(records.items(), shades, widths, strict=True):
        height = record.body_position("box")[:, 2] - 0.5 * SIDE
        axes.plot(record.times, 1e3 * height, color=shade, linewidth=width, label=f"{share:g} of m g / (2 mu)")
    hand = record.body_position("hand")[:, 2]
    axes.plot(record.times, 1e3 * (hand - hand[0]), color=colors.grey, linestyle="--", label="hand", zorder=1)
    axes.set(title="height of the box above the floor")
    style.label(axes, x=("time", "s"), y=("height", "mm"))
    style.legend(axes)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Lift with each force, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 8 s.", flush=True)

    least = MASS * GRAVITY / (2.0 * FRICTION)
    records, wrong = {}, []
    for share in SHARES:
        simulation, records[share] = lift(share * least)
        raised = records[share].body_position("box")[-1, 2] - 0.5 * SIDE
        print(
            f"{share:.2f} of the least force, {share * least:.2f} N: the box is {1e3 * raised:.2f} mm above the floor"
        )
        if (raised > 0.9 * HEIGHT) != (share > 1.0):
            wrong.append(share)
    simulation.picture(arguments.out / "pinch_box.png", camera=(0.9, -1.0, 0.4))
    draw(records, arguments.out / "pinch_box_heights.png")
    print(f"Wrote {arguments.out / 'pinch_box.png'} and {arguments.out / 'pinch_box_heights.png'}.")
    if wrong:
        sys.exit(f"The box does not do what friction says at {wrong} of the least force.")


if __name__ == "__main__":
    main()
