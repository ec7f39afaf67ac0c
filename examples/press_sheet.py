"""A jaw that yields folds a sheet of paper over and presses its edge down, though it comes 2 mm too low.

The sheet is A4, planar, and touches the table and itself with friction. A rigid jaw that is led below the table could
not move, which is an error. This jaw holds the edge by springs, and slips at a force limit. The example checks two
forces. The jaw presses with its stiffness times its depth below the table, and in the end with its limit. The table
carries the weight of the sheet and the force of the jaw.

Writes out/press_sheet.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

LENGTH, WIDTH, THICKNESS, LGB = 0.297, 0.21, 1e-4, 0.048  # [m]
WEIGHT = 0.08 * WIDTH * 9.81  # weight of 80 g/m^2 [N/m]
DEPTH = 0.01  # depth of the sheet between the fingers [m]
STIFFNESS, LIMIT = 2e3, 3.0  # stiffness and force limit of the jaw [N/m], [N]
FOLDING, LOWERING, HOLDING = 6.0, 1.0, 0.5  # [s]
LOW = 2e-3  # error of the height of the jaw, downwards [m]
FINGER = 2e-3  # radius of a finger [m]
FINGERS = {"upper finger": 1.1 * FINGER, "lower finger": -1.1 * FINGER}  # heights over the flat sheet [m]


def scene_of(edges: int) -> tuple[withe.Scene, withe.Rod]:
    """Return the sheet on the table, and two fingers without contact, which show the position of the jaw."""
    scene = withe.Scene()
    bend = 2.0 * WEIGHT * LGB**3
    stiff = withe.Stiffness(
        stretch=12.0 * bend / THICKNESS**2, bend=(bend * (WIDTH / THICKNESS) ** 2, bend), twist=bend
    )
    sheet = scene.add_rod(
        start=(0.0, 0.0, 0.5 * THICKNESS),
        end=(LENGTH, 0.0, 0.5 * THICKNESS),
        nodes=edges + 1,
        normal=(0.0, 1.0, 0.0),
        section=withe.Rectangle(WIDTH, THICKNESS),
        stiffness=stiff,
        line_density=WEIGHT / 9.81,
        name="sheet",
    )
    scene.add_floor(friction=0.6, restitution=0.0)
    scene.enable_contact(friction=0.3, friction_model="anchored", restitution=0.0)
    for name, side in FINGERS.items():
        x, z = LENGTH - 0.5 * DEPTH, 0.5 * THICKNESS + side
        ends = (x, -0.6 * WIDTH, z), (x, 0.6 * WIDTH, z)
        scene.ignore_contact(sheet, scene.add_capsule(*ends, FINGER, name=name))
    return scene, sheet


def way(t: float) -> tuple[float, float]:
    """Path of the sheet's outer edge along half a circle: its angle [rad], and how far it is led below that [m]."""
    share = np.clip(t / FOLDING, 0.0, 1.0)
    lower = np.clip((t - FOLDING) / LOWERING, 0.0, 1.0)
    return float(np.pi * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))), float(LOW * lower)


def pose(t: float, middle: np.ndarray, axes: np.ndarray, off: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Pose of the jaw, or of a point at a distance `off` from its middle across the sheet [m]."""
    angle, lower = way(t)
    reach = 0.25 * LENGTH
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    rise = middle[2] + THICKNESS * angle / np.pi - lower
    edge = np.array([LENGTH - reach + reach * cosine, 0.0, rise + reach * sine])
    return edge + turn @ (-0.5 * DEPTH, 0.0, off), turn @ axes


def draw(record: withe.Record, low: np.ndarray, pressing: np.ndarray, path: Path) -> None:
    """Draw the sheet while it is pressed, and the force on it."""
    colors = style.use()
    record.picture(path, camera=(0.12, -0.42, 0.1), size=(1200, 800))
    figure, (seen, force) = plt.subplots(1, 2, figsize=(10.4, 4.2), width_ratios=(1.4, 1.0))
    seen.imshow(plt.imread(path)[250:680, 180:1000])
    seen.axis("off")
    middle = pressing[np.argmin(np.abs(low - 1e-3))]
    force.axline((1.0, middle), slope=1e-3 * STIFFNESS, color=colors.grey, label="stiffness of the jaw")
    force.axhline(LIMIT, color=colors.red, linestyle="--", label="force limit")
    force.plot(1e3 * low, pressing, ".-", label="force of the jaw")
    force.set_ylim(-0.1, 1.15 * LIMIT)
    style.label(force, x=("error of the height", "mm"), y=("force", "N"))
    style.legend(force, side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Fold, press, check, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--edges", type=int, default=150)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 6 s.", flush=True)

    scene, sheet = scene_of(arguments.edges)
    simulation = scene.build(integrator="backward_euler", time_step=0.01, planar=True)
    jaw = simulation.grasp(
        sheet, at=LENGTH - 0.5 * DEPTH, length=DEPTH, stiffness=(STIFFNESS, 10.0), force_limit=LIMIT, name="jaw"
    )
    middle, axes = jaw.pose
    jaw.move(path=lambda t: pose(t, middle, axes))
    for name, side in FINGERS.items():
        begin = simulation.obstacle_position(name) - pose(0.0, middle, axes, side)[0]
        simulation.move(name, path=lambda t, b=begin, s=side: (b + pose(t, middle, axes, s)[0], 0.0))
    record = simulation.run(
        FOLDING + LOWERING + HOLDING, 0.05, record={"pressing": lambda s: -s.wrench("jaw").force[2]}
    )

    low = np.array([way(t)[1] for t in record.times])
    pressing = record["pressing"]
    begun = np.flatnonzero((low > 0.0) & (pressing > 0.2) & (pressing < 0.9 * LIMIT))
    slope = np.polyfit(low[begun], pressing[begun], 1)[0]
    contacts = simulation.contacts()
    on_table = contacts[contacts["edge"][:, 1] < 0]
    borne = float((on_table["normal_force"] * on_table["normal"][:, 2]).sum())
    weight = WEIGHT * LENGTH
    slipped = 1e3 * np.linalg.norm(jaw.deflection.slip)
    print(f"the jaw presses with {slope / 1e3:.2f} N for each mm that it is too low, up to {pressing[-1]:.2f} N")
    print(
        f"the table bears {borne:.2f} N, the sheet's {weight:.2f} N among it; it slips by {slipped:.2f} mm in the jaw"
    )
    path = arguments.out / "press_sheet.png"
    draw(record, low, pressing, path)
    print(f"Wrote {path}.")
    if abs(borne - weight - pressing[-1]) > 0.01 or pressing.max() > LIMIT * (1.0 + 1e-9) or slope > STIFFNESS:
        sys.exit("What the jaw presses with and the sheet weighs must be borne by the table.")


if __name__ == "__main__":
    main()
