"""A hand picks a rope off the floor in its middle, carries it aside and lets go.

The rope lies straight. One path leads the hand: it takes 2 cm of the rope, lifts, carries, lowers and opens. The
example checks three things. Grasp and release do not change the energy. The hand carries the part of the weight that
the floor does not. In the end the rope rests on the floor again.

Writes out/carry_rope.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import withe

LENGTH, RADIUS, NODES = 0.9, 6e-3, 91  # [m]
LIFT, ASIDE = 0.3, 0.35  # [m]
PICKED = np.array([(0.0, 0.0), (0.7, LIFT), (1.2, LIFT), (1.7, 0.10)])  # time [s], height over the floor [m]
CARRIED = (0.5, 1.5)  # begin and end of the way aside [s]
SETTLED = 1.5  # after the hand has opened [s]
STIFFNESS = (2e3, 2.0)  # stiffness of the hand [N/m], [N m/rad]
FINGER = 0.03  # [m]


def scene_of() -> tuple[withe.Scene, withe.Rod]:
    """Return the rope on the floor, and two fingers without contact, which show the position of the hand."""
    scene = withe.Scene()
    cotton = withe.Material(youngs_modulus=1.5e6, poisson_ratio=0.4, density=700.0, viscosity=6e3)
    start, end = (-0.5 * LENGTH, 0.0, RADIUS), (0.5 * LENGTH, 0.0, RADIUS)
    rope = scene.add_rod(start=start, end=end, nodes=NODES, radius=RADIUS, material=cotton, name="rope")
    scene.add_floor(0.0, friction=0.4)
    scene.enable_contact(friction=0.3)
    for name, side in (("left finger", -1.0), ("right finger", 1.0)):
        y = 1.9 * side * RADIUS
        finger = scene.add_capsule((0.0, y, RADIUS), (0.0, y, RADIUS + 3.0 * FINGER), 0.8 * RADIUS, name=name)
        scene.ignore_contact(rope, finger)
    return scene, rope


def way(t: float) -> np.ndarray:
    """From where the hand began, at a time after it [m]."""
    share = np.clip((t - CARRIED[0]) / (CARRIED[1] - CARRIED[0]), 0.0, 1.0)
    height = np.interp(t, PICKED[:, 0], PICKED[:, 1])
    return np.array([0.0, ASIDE * share**2 * (3.0 - 2.0 * share), height])


def main() -> None:
    """Carry the rope, check, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--step", type=float, default=5e-3, help="[s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    scene, rope = scene_of()
    simulation = scene.build(integrator="backward_euler", time_step=arguments.step)
    before = simulation.energy().total
    hand = simulation.grasp(rope, at=0.5 * LENGTH, length=0.02, stiffness=STIFFNESS, name="hand")
    jump = abs(simulation.energy().total - before)
    origin = hand.pose.position
    hand.move(path=lambda t: origin + way(t))
    fingers = {name: simulation.obstacle_position(name) for name in ("left finger", "right finger")}
    for name, place in fingers.items():
        simulation.move(name, path=lambda t, place=place: (place + way(t), 0.0))
    carried = PICKED[-1, 0]
    record = simulation.run(carried, record_every=0.05, record={"lift": lambda s: s.wrench("hand").force})
    weight = 9.81 * 700.0 * np.pi * RADIUS**2 * LENGTH
    lifted = record["lift"][:, 2].max() / weight
    kinetic = simulation.energy().kinetic
    hand.release()
    jump = max(jump, abs(simulation.energy().kinetic - kinetic))
    for name in fingers:
        simulation.move(name, position=np.add(simulation.obstacle_position(name), (0.0, 0.0, 0.2)), over=0.5)
    simulation.run(SETTLED, record_every=0.05)
    moved, high = simulation.positions(rope)[:, 1:].max(axis=0)
    print(f"the hand carries up to {100 * lifted:.0f}% of the weight; grasp and release change energy by {jump:.0e} J")
    print(f"the rope rests {100 * moved:.0f} cm aside, its nodes at most {1e3 * high:.0f} mm high")
    path = arguments.out / "carry_rope.png"
    record.picture(path, frame=-10, ghosts=(0, 12), camera=(0.9, -1.6, 0.7), size=(1280, 720))
    print(f"Wrote {path}.")
    if jump > 1e-12 or not 0.3 < lifted < 1.3 or simulation.energy().kinetic > 1e-5:
        sys.exit("A hand that grasps or lets go must change nothing, and the rope come to rest.")


if __name__ == "__main__":
    main()
