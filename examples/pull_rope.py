"""A rope is drawn through an eye: up from the floor, around the eye with friction, and down to the hand that draws it.

The eye takes the rope near its end and rises; the hand takes the end and walks away. What is checked is that the rope
goes through the eye by what the hand has drawn, that friction holds it back by its coefficient times what presses, and
that energies add up.

Writes out/pull_rope.png.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path

import numpy as np

import withe

LENGTH, RADIUS, NODES = 1.2, 6e-3, 121  # [m]
EYE, RISE, FRICTION = 0.2, 0.3, 0.25  # [m] from the rope's end, [m], [-]
RISEN, WALKED, AWAY = 1.0, 2.0, 0.5  # [s], [s], [m]
GAP, WIRE = 1.6 * RADIUS, 0.4 * RADIUS  # of the drawn eye [m]


def scene_of() -> tuple[withe.Scene, withe.Rod]:
    """Return the rope on the floor with a held end, and an eye drawn as eight short wires without contact."""
    scene = withe.Scene()
    cotton = withe.Material(youngs_modulus=1.5e6, poisson_ratio=0.4, density=700.0, viscosity=6e3)
    start, end = (-LENGTH, 0.0, RADIUS), (0.0, 0.0, RADIUS)
    rope = scene.add_rod(start=start, end=end, nodes=NODES, radius=RADIUS, material=cotton, name="rope")
    scene.add_floor(0.0, friction=0.4)
    scene.enable_contact(friction=0.3)
    scene.grasp(rope, LENGTH - EYE, slides=True, friction=FRICTION, name="eye")
    scene.grasp(rope, LENGTH, stiffness=(2e3, 1e-3), name="hand")
    corners = np.linspace(0.0, 2.0 * np.pi, 9)
    ring = np.stack([np.full(9, -EYE), GAP * np.cos(corners), RADIUS + GAP * np.sin(corners)], axis=1)
    for number, (a, b) in enumerate(itertools.pairwise(ring)):
        scene.ignore_contact(rope, scene.add_capsule(a, b, WIRE, name=f"wire {number}"))
    return scene, rope


def eased(t: float, begin: float, end: float) -> float:
    """From 0 to 1, at rest at both ends."""
    share = float(np.clip((t - begin) / (end - begin), 0.0, 1.0))
    return share**2 * (3.0 - 2.0 * share)


def main() -> None:
    """Draw the rope through the eye, check, draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--step", type=float, default=5e-3, help="[s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    scene, rope = scene_of()
    simulation = scene.build(integrator="backward_euler", time_step=arguments.step)
    up = np.array([0.0, 0.0, RISE])
    for name in ("eye", *(f"wire {number}" for number in range(8))):
        place = simulation.pose("eye").position if name == "eye" else simulation.obstacle_position(name)
        path = {"eye": lambda t, place=place: place + eased(t, 0.0, RISEN) * up}.get(
            name, lambda t, place=place: (place + eased(t, 0.0, RISEN) * up, 0.0)
        )
        simulation.move(name, path=path)
    held = simulation.pose("hand").position
    away = np.array([AWAY, 0.0, 0.0])
    simulation.move("hand", path=lambda t: held + eased(t, RISEN, RISEN + WALKED) * away)
    readings = {word: lambda s, word=word: getattr(s.passage("eye"), word) for word in ("at", "pull", "press")}
    record = simulation.run(RISEN + WALKED, record_every=0.05, record=readings)
    at, pull, press = (np.array(record[word]) for word in readings)
    walking = (record.times > RISEN + 0.3 * WALKED) & (record.times < RISEN + 0.7 * WALKED)
    rubs = np.abs(pull[walking] / (FRICTION * press[walking]) - 1.0).max()
    end = simulation.positions(rope)[-1] - simulation.pose("eye").position
    drawn, straight = LENGTH - at[-1], float(np.linalg.norm(end))
    energy = simulation.energy()
    print(f"{1e2 * drawn:.1f} cm of the rope are through the eye, {1e2 * straight:.1f} cm from the hand")
    print(f"it is drawn with up to {press.max():.2f} N on the eye; friction is off its law by {rubs:.0e}")
    print(f"hand and eye did {energy.work:.3f} J, of which {energy.dissipated:.3f} J are lost")
    path = arguments.out / "pull_rope.png"
    record.picture(path, frame=-1, ghosts=(20, 40), camera=(0.6, -1.7, 0.6), size=(1280, 720))
    print(f"Wrote {path}.")
    if rubs > 1e-6 or not straight - 0.01 < drawn < 1.2 * straight:
        sys.exit("The rope must go through the eye as it is drawn, against Coulomb's friction.")


if __name__ == "__main__":
    main()
