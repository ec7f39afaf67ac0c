"""A quadruped with a rigid trunk and four soft legs trots over a floor with friction.

The trunk is a box. A leg is an arch of rubber that is clamped to the side of the trunk. It has no joints: its natural
curvature changes at the hip, sideways, and at the hip and the knee, in its own plane. Diagonal legs move together.
A foot goes back along the floor for 0.6 of a period, then forwards through the air.

On a floor without friction the trunk stands on vertical forces N = (M g + 4 w L) / 4. Each leg is then an elastica with
the slope a, the natural curvature k and the weight w per length,

    EI (a' - k)' = -(N - w (L - s)) cos a,    a(0) = a0,    a'(L) = k.

Its solution by collocation gives the sag of the trunk, which must be right within 0.1 %. The loads on the feet at rest
must equal the weight within 1e-6. The robot must walk at least the length of its trunk. Otherwise the example fails.

Writes out/soft_legs.png and out/soft_legs_plot.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

import withe
from withe.view import style

TRUNK, TRUNK_DENSITY = (0.18, 0.08, 0.035), 300.0  # [m], [kg/m^3]
LENGTH, RADIUS, NODES = 0.15, 5e-3, 31  # of a leg [m]
RISE, FALL = np.radians(30.0), np.radians(-85.0)  # slope of a leg at the trunk and at the foot
ARCH = (FALL - RISE) / LENGTH  # natural curvature in the plane of the leg [1/m]
HIP, KNEE = slice(0, 8), slice(12, 20)  # stencils that bend
STRIDE, LIFT = 0.05, 0.03  # of a foot [m]
PERIOD, STANCE, START = 0.35, 0.6, 0.5  # [s]; share of a period on the floor; time to stand [s]
FRICTION, GRAVITY = 0.8, 9.81  # of the floor; [m/s^2]
RUBBER = withe.Material(youngs_modulus=8e7, poisson_ratio=0.5, density=1100.0, viscosity=1.6e5)
LEGS = {"front left": (1, 1), "front right": (1, -1), "hind left": (-1, 1), "hind right": (-1, -1)}  # signs of x and y
HEIGHT_ERROR, LOAD_ERROR = 1e-3, 1e-6  # allowed errors


def centreline(side: int, left: int) -> np.ndarray:
    """Return a leg as it is drawn, from the side of the trunk to the floor, shape (nodes, 3) [m]."""
    outward, up = np.array([0.0, float(left), 0.0]), np.array([0.0, 0.0, 1.0])
    points = withe.shapes.arc(
        start=(0.38 * side * TRUNK[0], 0.5 * left * TRUNK[1], 0.0),
        tangent=np.cos(RISE) * outward + np.sin(RISE) * up,
        towards=up,
        curvature=ARCH,
        length=LENGTH,
        nodes=NODES,
    )
    return points - (points[-1, 2] - RADIUS) * up


def build(friction: float, is_on_rail: bool = False) -> withe.Simulation:
    """Return the robot as it is drawn, free or with its trunk on a vertical rail."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    place = (0.0, 0.0, centreline(1, 1)[0, 2])
    trunk = scene.add_body(withe.solids.Box(TRUNK), density=TRUNK_DENSITY, position=place, name="trunk")
    for name, (side, left) in LEGS.items():
        leg = scene.add_rod(
            points=centreline(side, left), normal=(-left, 0.0, 0.0), radius=RADIUS, material=RUBBER, name=name
        )
        scene.join(leg.start, trunk)
    if is_on_rail:
        scene.clamp(trunk, free=(0, 0, 1))
    scene.add_floor(friction=friction)
    return scene.build(integrator="backward_euler", time_step=2e-3)


def weight(length: float = LENGTH) -> float:
    """Return the weight of the robot, by the length of a leg [N]."""
    return GRAVITY * (TRUNK_DENSITY * np.prod(TRUNK) + 4.0 * RUBBER.density * np.pi * RADIUS**2 * length)


def theory() -> tuple[float, float]:
    """Return the height of the roots of the legs over their feet, with the weight and without it [m]."""
    per_length, bending = RUBBER.density * np.pi * RADIUS**2 * GRAVITY, RUBBER.youngs_modulus * np.pi * RADIUS**4 / 4.0

    def slopes(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the derivatives of the slope, its derivative and the height."""
        force = 0.25 * weight() - per_length * (LENGTH - s)
        return np.array([y[1], -force * np.cos(y[0]) / bending, np.sin(y[0])])

    def ends(root: np.ndarray, tip: np.ndarray) -> np.ndarray:
        return np.array([root[0] - RISE, tip[1] - ARCH, root[2]])

    s = np.linspace(0.0, LENGTH, 101)
    a = RISE + ARCH * s
    drawn = (np.cos(RISE) - np.cos(FALL)) / ARCH
    found = solve_bvp(slopes, ends, s, [a, np.full_like(s, ARCH), (np.cos(RISE) - np.cos(a)) / ARCH], tol=1e-10)
    return -float(found.y[2, -1]), -drawn


def standing() -> tuple[float, float]:
    """Return the height of the trunk over the feet [m] without friction, and the error of the loads with friction."""
    simulation = build(0.0, is_on_rail=True)
    simulation.equilibrium()
    height = simulation.position("trunk")[2] - simulation.positions("front left")[-1, 2]
    simulation = build(FRICTION)
    simulation.step(500)
    simulation.equilibrium()
    loads = simulation.contacts()
    pressed = (loads["normal_force"] * loads["normal"][:, 2] + loads["friction"][:, 2]).sum()
    chords = np.linalg.norm(np.diff(centreline(1, 1), axis=0), axis=1).sum()  # a rod is as long as its edges
    return float(height), float(abs(pressed / weight(chords) - 1.0))


def curvature(left: int, forward: float, up: float) -> np.ndarray:
    """Return the natural curvature that moves a foot forward and up, shape (stencils, 2) [1/m].

    A small turn at a hinge moves the foot at right angles to the line from the hinge to the foot.
    """
    points = centreline(1, 1)
    hinges = [(part.start + part.stop) // 2 + 1 for part in (HIP, KNEE)]
    arms = points[-1] - points[hinges]
    turns = np.linalg.solve([-arms[:, 2], arms[:, 1]], [0.0, up])
    sweep = -left * forward / arms[0, 1]
    over = LENGTH / (NODES - 1) * np.array([part.stop - part.start for part in (HIP, KNEE)])
    found = np.zeros((NODES - 2, 2))
    found[:, 1] = ARCH
    found[HIP, 1] += turns[0] / over[0]
    found[KNEE, 1] += turns[1] / over[1]
    found[HIP, 0] = sweep / over[0]
    return found


def foot(phase: float) -> tuple[float, float]:
    """Return the displacement of a foot forward and up in the course of a period [m]."""
    if phase < STANCE:
        return STRIDE * (0.5 - phase / STANCE), 0.0
    share = (phase - STANCE) / (1.0 - STANCE)
    return -0.5 * STRIDE * np.cos(np.pi * share), LIFT * np.sin(np.pi * share) ** 2


def walk(duration: float) -> withe.Record:
    """Stand, then trot."""

    def steer(now: withe.Simulation) -> None:
        pace = min(max(now.time - START, 0.0) / PERIOD, 1.0)  # steps grow to their length within a period
        for name, (side, left) in LEGS.items():
            forward, up = foot(((now.time - START) / PERIOD + (0.5 if side == left else 0.0)) % 1.0)
            now.set(name, natural_curvature=curvature(left, pace * forward, pace * up))

    return build(FRICTION).run(duration, record_every=0.02, before_step=steer, progress=False)


def draw(record: withe.Record, path: Path) -> None:
    """Draw the distance that the trunk walked, and the heights of the feet."""
    style.use()
    figure, (trunk, feet) = plt.subplots(2, 1, figsize=(7.2, 4.6), sharex=True)
    trunk.plot(record.times, record.body_position("trunk")[:, 0] / TRUNK[0])
    for name in LEGS:
        feet.plot(record.times, 1e3 * (record.positions(name)[:, -1, 2] - RADIUS), label=name)
    style.label(trunk, y="distance / trunk length")
    style.label(feet, x=("time", "s"), y=("height of a foot", "mm"))
    style.legend(feet)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Stand, check, walk, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=5.5, help="[s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    height, load_error = standing()
    expected, drawn = theory()
    off = abs(height - expected) / (drawn - expected)
    print(f"the trunk sags by {1e3 * (drawn - height):.3f} mm, theory within {100 * off:.3f} %")
    print(f"loads on the feet: the weight of {weight():.3f} N within {load_error:.1e}")
    record = walk(arguments.duration)
    trunk = record.body_position("trunk")
    walked, aside, _ = trunk[-1] - trunk[0]
    print(
        f"walked {walked / TRUNK[0]:.2f} trunk lengths in {record.times[-1]:.1f} s, {1e3 * abs(aside):.0f} mm sideways"
    )
    draw(record, arguments.out / "soft_legs_plot.png")
    path = arguments.out / "soft_legs.png"
    record.picture(path, ghosts=(0, len(record) // 2), camera=(0.35, -1.0, 0.45), size=(1280, 520))
    print(f"Wrote {path} and {arguments.out / 'soft_legs_plot.png'}.")
    if off > HEIGHT_ERROR or load_error > LOAD_ERROR:
        sys.exit("The robot does not stand as theory has it.")
    if walked < TRUNK[0]:
        sys.exit("The robot must walk at least the length of its trunk.")


if __name__ == "__main__":
    main()
