"""Three soft fingers curl about a ball, lift it from the floor and hold it.

The ball is a free rigid body. Fingers and ball touch by contact with friction only. While the fingers hold the ball at
rest, the forces of the fingers on the ball add up to its weight. The forces of the palm on the fingers add up to the
weight of ball and fingers. The example fails if either sum is wrong by more than 0.1 %, or if the ball has not been
lifted by as much as the palm.

Writes out/lift_ball.png and out/lift_ball_forces.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt

import withe
from withe.view import style

Array = npt.NDArray[np.float64]
GRAVITY = 9.81  # [m/s^2]
BALL, MASS = 0.03, 0.03  # radius and mass of the ball [m], [kg]
FINGERS, NODES, RADIUS = 3, 24, 6e-3  # [m]
TOP, TIP, APART = 0.13, 0.014, 0.048  # heights of the ends of a finger, distance from the axis [m]
CURVATURE, FRICTION = 5.0, 0.7  # [1/m], [-]
CURL, LIFT, HOLD, HEIGHT = 0.5, 0.6, 1.5, 0.08  # durations [s], [m]
TIME_STEP = 2e-3  # [s]
ERROR = 1e-3  # allowed, relative


def build() -> tuple[withe.Simulation, list[withe.Rod], list[withe.Support]]:
    """Return the fingers about the ball, straight, with their clamps."""
    scene = withe.Scene(gravity=(0, 0, -GRAVITY))
    scene.enable_contact(friction=FRICTION)
    scene.add_floor(friction=FRICTION)
    rubber = withe.Material(youngs_modulus=8e6, poisson_ratio=0.5, density=1100.0, viscosity=4e4)
    scene.add_body(withe.solids.Sphere(BALL), mass=MASS, position=(0, 0, BALL), name="ball")
    fingers, palm = [], []
    for k in range(FINGERS):
        angle = 2.0 * np.pi * k / FINGERS
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        finger = scene.add_rod(
            start=APART * out + (0, 0, TOP),
            end=APART * out + (0, 0, TIP),
            nodes=NODES,
            radius=RADIUS,
            material=rubber,
            name=f"finger {k + 1}",
        )
        palm.append(scene.clamp(finger.start))
        fingers.append(finger)
    return scene.build(time_step=TIME_STEP), fingers, palm


def lift(
    simulation: withe.Simulation, fingers: list[withe.Rod], palm: list[withe.Support], hold: float = HOLD
) -> withe.Record:
    """Close the fingers, lift and hold; return the motion, with the force on the ball and the lift of the palm."""
    for finger in fingers:
        inwards = -simulation.positions(finger)[0] * (1, 1, 0) / APART
        d1, d2, _ = simulation.directors(finger)[0]
        simulation.set(finger, natural_curvature=CURVATURE * np.array([inwards @ d1, inwards @ d2]), over=CURL)
    for support in palm:
        top = simulation.pose(support).position

        def lifted(time: float, top: Array = top) -> Array:
            """Return the position of a clamp."""
            share = np.clip((time - CURL) / LIFT, 0.0, 1.0)
            return top + HEIGHT * share**2 * (3.0 - 2.0 * share) * np.array([0.0, 0.0, 1.0])

        simulation.move(support, path=lifted)
    start = float(simulation.pose(palm[0]).position[2])
    return simulation.run(
        CURL + LIFT + hold,
        record_every=0.02,
        progress=False,
        record={"force": on_ball, "lift": lambda now: now.pose(palm[0]).position[2] - start},
    )


def on_ball(simulation: withe.Simulation) -> Array:
    """Return the force of the fingers on the ball, shape (3,) [N]."""
    contacts = simulation.contacts()
    force = contacts["normal_force"][:, None] * contacts["normal"] + contacts["friction"]  # on the first of a pair
    first, second = contacts["pair"].T
    fingers = np.char.startswith(first, "finger") & (second == "ball")
    return -force[fingers].sum(axis=0)


def draw(record: withe.Record, weight: float, path: Path) -> None:
    """Draw the height of the ball, and the force that lifts it."""
    colors = style.use()
    figure, (height, force) = plt.subplots(2, 1, figsize=(7.0, 5.6), sharex=True, layout="constrained")
    height.plot(record.times, 1e3 * record.body_position("ball")[:, 2], color=colors.blue, label="centre of the ball")
    height.plot(
        record.times, 1e3 * (BALL + record["lift"]), color=colors.grey, linestyle="--", label="lift of the palm"
    )
    style.label(height, y=("height", "mm"))
    style.legend(height)
    force.plot(record.times, record["force"][:, 2], color=colors.orange, label="fingers on the ball, vertical")
    force.axhline(weight, color=colors.grey, linestyle=":", label="weight of the ball")
    style.label(force, x=("time", "s"), y=("force", "N"))
    style.legend(force)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Lift the ball, compare forces with weights, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    simulation, fingers, palm = build()
    record = lift(simulation, fingers, palm)
    weight = MASS * GRAVITY
    whole = weight + sum(1100.0 * np.pi * RADIUS**2 * (TOP - TIP) * GRAVITY for _ in fingers)
    held = sum(simulation.reaction(support).force[2] for support in palm)
    off = max(abs(on_ball(simulation)[2] / weight - 1.0), abs(held / whole - 1.0))
    risen = simulation.position("ball")[2] - BALL
    print(f"the ball has risen by {1e3 * risen:.1f} mm; forces equal weights within {100 * off:.3f} %")
    simulation.picture(arguments.out / "lift_ball.png", camera=(1.0, -0.8, 0.35))
    draw(record, weight, arguments.out / "lift_ball_forces.png")
    print(f"Wrote {arguments.out / 'lift_ball.png'} and {arguments.out / 'lift_ball_forces.png'}.")
    if off > ERROR:
        sys.exit("The forces on the ball are not its weight.")
    if risen < HEIGHT:
        sys.exit("The ball was not lifted.")


if __name__ == "__main__":
    main()
