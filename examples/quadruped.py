"""A quadruped of rods trots over a floor with friction: eight servo hinges move its legs.

Each leg is a thigh and a shank of rubber. Hip and knee are revolute joints with a stiffness: servos, whose `rest_angle`
the controller moves in every time step. A foot goes back along the floor for 0.6 of a period, then forwards through the
air. Inverse kinematics of two links of length l gives the angles a of the hip and b of the knee for a foot at (x, z):

    cos b = (x^2 + z^2) / (2 l^2) - 1,    a = atan2(-x, -z) - b / 2.

Diagonal legs move together. Coulomb friction holds the feet that stand. The example fails if the robot walks less than
one body length, or falls. Writes out/quadruped.png and out/quadruped_plot.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

BODY, WIDTH, LINK, RADIUS = 0.16, 0.09, 0.05, 4e-3  # length and width of the body, length of a link, radius [m]
HEIGHT, STRIDE, LIFT = 0.082, 0.05, 0.02  # of a hip over its foot, of a step, of a foot in the air [m]
PERIOD, STANCE, START = 0.5, 0.6, 0.3  # [s]; share of a period on the floor; time to stand [s]
STIFFNESS, DAMPING, FRICTION = 1.0, 5e-3, 0.8  # of a servo [N m/rad], [N m s/rad]; of the floor
LEGS = {"front left": (1, 1), "front right": (1, -1), "hind left": (-1, 1), "hind right": (-1, -1)}  # signs of x and y


def angles(x: float, z: float) -> np.ndarray:
    """Angles of hip and knee for a foot at (x, z) [m] from its hip."""
    knee = np.arccos(np.clip((x * x + z * z) / (2.0 * LINK**2) - 1.0, -1.0, 1.0))
    return np.array([np.arctan2(-x, -z) - 0.5 * knee, knee])


def foot(phase: float) -> tuple[float, float]:
    """Place of a foot relative to its hip in the course of a period [m]."""
    if phase < STANCE:
        return STRIDE * (0.5 - phase / STANCE), -HEIGHT
    share = (phase - STANCE) / (1.0 - STANCE)
    return -0.5 * STRIDE * np.cos(np.pi * share), -HEIGHT + LIFT * np.sin(np.pi * share) ** 2


def build() -> withe.Simulation:
    """The robot as it stands."""
    scene = withe.Scene()
    nylon = withe.Material(youngs_modulus=2e9, poisson_ratio=0.4, density=1140.0, viscosity=1e5)
    rubber = withe.Material(youngs_modulus=2e8, poisson_ratio=0.5, density=1100.0, viscosity=1e5)
    top, turn = HEIGHT + RADIUS, np.cumsum(angles(0.0, -HEIGHT))
    front, hind = (0.5 * BODY, 0.0, top), (-0.5 * BODY, 0.0, top)
    spine = scene.add_rod(start=front, end=hind, nodes=9, radius=1.5 * RADIUS, material=nylon, name="spine")
    bars, across = {}, np.array([0.0, 0.5 * WIDTH, 0.0])
    for side, node, place in ((1, spine.start, front), (-1, spine.end, hind)):
        bars[side] = scene.add_rod(start=place + across, end=place - across, nodes=5, radius=RADIUS, material=nylon)
        scene.join(node, bars[side].node(2))
    link, servo = {"nodes": 6, "radius": RADIUS, "material": rubber}, {"stiffness": STIFFNESS, "damping": DAMPING}
    for name, (side, left) in LEGS.items():
        hip = np.array([0.5 * side * BODY, 0.5 * left * WIDTH, top])
        knee, sole = (hip - LINK * sum(np.array([np.sin(a), 0.0, np.cos(a)]) for a in turn[:k]) for k in (1, 2))
        thigh = scene.add_rod(start=hip, end=knee, name=f"{name} thigh", **link)
        shank = scene.add_rod(start=knee, end=sole, name=f"{name} shank", **link)
        end = bars[side].start if left > 0 else bars[side].end
        scene.join(end, thigh.start, "revolute", axis=(0, 1, 0), name=f"{name} hip", **servo)
        scene.join(thigh.end, shank.start, "revolute", axis=(0, 1, 0), name=f"{name} knee", **servo)
    scene.add_floor(friction=FRICTION)
    return scene.build(integrator="backward_euler", time_step=2e-3)


def walk(duration: float) -> withe.Record:
    """Stand, then trot."""

    def steer(now: withe.Simulation) -> None:
        pace = min(max(now.time - START, 0.0) / PERIOD, 1.0)  # steps grow to their length within a period
        for name, (side, left) in LEGS.items():
            x, z = foot(((now.time - START) / PERIOD + (0.5 if side == left else 0.0)) % 1.0)
            hip, knee = angles(pace * x, pace * z - (1.0 - pace) * HEIGHT) - angles(0.0, -HEIGHT)
            now.set(f"{name} hip", rest_angle=hip)  # [rad]
            now.set(f"{name} knee", rest_angle=knee)

    return build().run(duration, record_every=0.02, before_step=steer)


def draw(record: withe.Record, path: Path) -> None:
    """Draw the distance that the body walked, and the heights of the feet."""
    style.use()
    figure, (body, feet) = plt.subplots(2, 1, figsize=(7.2, 4.6), sharex=True)
    body.plot(record.times, record.positions("spine")[:, :, 0].mean(axis=1) / BODY)
    for name in LEGS:
        feet.plot(record.times, 1e3 * (record.positions(f"{name} shank")[:, -1, 2] - RADIUS), label=name)
    style.label(body, y="distance / body length")
    style.label(feet, x=("time", "s"), y=("height of a foot", "mm"))
    style.legend(feet)
    figure.savefig(path)


def main() -> None:
    """Walk, check, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=3.0, help="[s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 8 s.", flush=True)

    record = walk(arguments.duration)
    middle, path = record.positions("spine").mean(axis=1), arguments.out / "quadruped.png"
    walked, aside, _ = middle[-1] - middle[0]
    print(f"walked {walked / BODY:.2f} body lengths in {record.times[-1]:.1f} s, {1e3 * abs(aside):.0f} mm sideways")
    draw(record, arguments.out / "quadruped_plot.png")
    record.picture(path, ghosts=(0, len(record) // 2), camera=(0.35, -1.0, 0.4), size=(1280, 480))
    print(f"Wrote {path} and {arguments.out / 'quadruped_plot.png'}.")
    if walked < BODY or middle[:, 2].min() < 0.5 * HEIGHT:
        sys.exit("The robot must walk at least one body length, and stay on its feet.")


if __name__ == "__main__":
    main()
