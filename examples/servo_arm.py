"""A flexible arm on a servo swings through a right angle and stands still: input shaping by its own frequency.

The servo is a revolute joint with a stiffness k, whose rest angle is led from 0 to 90 degrees within 0.2 s. The arm, a
rod of nylon, goes on swinging about that. Shaped, the same command comes in three parts, 1/4, 1/2 and 1/4 of
it, half a period of the arm's first mode apart (zero vibration and derivative [Singer and Seering 1990, J. Dyn. Syst.
Meas. Control 112]), and what they set in motion cancels. The period is that of `linearise()`. In theory a beam with a
spring k at its root and a free end vibrates with w = b^2 (EI / m)^(1/2) / L^2, where

    (k L / EI) (1 + cos b cosh b) = b (sin b cosh b - cos b sinh b),

between a beam that is pinned (k = 0) and one that is clamped. Fails when the first three frequencies are not those, or
when the shaped arm swings on by more than a twentieth of what the other does.

Writes out/servo_arm.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import withe
from withe.view import style

LENGTH, RADIUS, NODES = 0.6, 4e-3, 41  # [m]
MODULUS, DENSITY = 3e9, 1140.0  # nylon [Pa], [kg/m^3]
STIFFNESS = 6.0  # stiffness of the servo [N m/rad]
ANGLE, RISE = 0.5 * np.pi, 0.2  # [rad], [s]
UNTIL = 1.6  # [s]
FREQUENCY_ERROR, REST = 2e-3, 0.05  # allowed errors


def add_arm(scene: withe.Scene, x: float = 0.0, number: int = 1) -> withe.Joint:
    """Add the arm on its servo, whose axis is vertical, on a short stiff post at x [m]."""
    nylon = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.3, density=DENSITY)
    steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
    name = "arm" if number == 1 else f"arm {number}"
    post = scene.add_rod(start=(x - 0.02, 0, 0), end=(x, 0, 0), nodes=3, radius=2e-2, material=steel)
    rod = scene.add_rod(start=(x, 0, 0), end=(x + LENGTH, 0, 0), nodes=NODES, radius=RADIUS, material=nylon, name=name)
    servo = scene.join(post.end, rod.start, "revolute", axis=(0, 0, 1), stiffness=STIFFNESS, name=f"servo of {name}")
    scene.clamp(post.start)
    return servo


def arm() -> tuple[withe.Simulation, withe.Joint]:
    """Return the arm on its servo."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    servo = add_arm(scene)
    return scene.build(planar=True, integrator="energy_momentum", time_step=1e-3), servo


def theory(count: int) -> np.ndarray:
    """Frequencies of a beam with a spring at its root [Hz]."""
    area, inertia = np.pi * RADIUS**2, 0.25 * np.pi * RADIUS**4
    ratio = STIFFNESS * LENGTH / (MODULUS * inertia)

    def residual(b: float) -> float:
        spring = ratio * (1.0 + np.cos(b) * np.cosh(b))
        return float((spring - b * (np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b))) / np.cosh(b))

    grid = np.linspace(1e-3, 4.0 * (count + 1), 400 * (count + 1))
    values = [residual(b) for b in grid]
    roots = [
        brentq(residual, a, b) for a, b, u, v in zip(grid, grid[1:], values, values[1:], strict=False) if u * v < 0.0
    ]
    speed = np.sqrt(MODULUS * inertia / (DENSITY * area)) / LENGTH**2
    return np.array(roots[:count]) ** 2 * speed / (2.0 * np.pi)


def rise(time: float) -> float:
    """From 0 to 1 within RISE, with neither speed nor acceleration at its ends."""
    s = min(max(time / RISE, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def swing(simulation: withe.Simulation, servo: withe.Joint, parts: list[tuple[float, float]]) -> withe.Record:
    """Lead the servo by a command in parts: (share, delay [s])."""
    simulation.reset()
    half = 0.5 * simulation.time_step

    def lead(now: withe.Simulation) -> None:
        command = sum(share * rise(now.time + half - delay) for share, delay in parts)
        now.set(servo, rest_angle=ANGLE * command)

    record = {"angle": lambda now: now.joint_angle(servo), "command": lambda now: now.get(servo, "rest_angle")}
    return simulation.run(UNTIL, 2e-3, before_step=lead, record=record, progress=False)


def deflection(record: withe.Record) -> np.ndarray:
    """Deflection of the tip from its place at a right angle, across the arm [m]."""
    return np.asarray(record.positions("arm")[:, -1, 0])


def draw(records: dict[str, withe.Record], path: Path) -> None:
    """The arm on its way, the command, and how far the tip is aside."""
    colors = style.use()
    figure = plt.figure(figsize=(10.4, 5.2))
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.3))
    seen = figure.add_subplot(grid[:, 0])
    angle, tip = (figure.add_subplot(grid[row, 1]) for row in range(2))
    shaped = records["shaped"]
    moments = np.searchsorted(shaped.times, np.arange(0.0, 0.67, 0.06))
    for k, shade in zip(moments, style.ramp()(np.linspace(0.0, 1.0, len(moments))), strict=True):
        seen.plot(*100.0 * shaped.positions("arm")[k, :, :2].T, color=shade, linewidth=3)
    for (name, record), color in zip(records.items(), (colors.red, colors.blue), strict=True):
        angle.plot(record.times, np.degrees(record["command"]), color=color, linestyle=":", label=f"{name}, command")
        angle.plot(record.times, np.degrees(record["angle"]), color=color, label=f"{name}, joint")
        tip.plot(record.times, 1e3 * deflection(record), color=color)
    seen.set(aspect="equal", title="shaped swing: light at first, dark at last")
    angle.set_title("servo")
    tip.set(title="deflection of the tip from its goal", ylim=(-650, 650))
    style.label(seen, x=("x", "cm"), y=("y", "cm"))
    style.label(angle, x=("time", "s"), y=("angle", "degrees"))
    style.label(tip, x=("time", "s"), y=("deflection", "mm"))
    style.legend(angle)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Find the frequencies, swing both ways, compare, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 2 s.", flush=True)

    simulation, servo = arm()
    simulation.equilibrium()
    found, expected = simulation.linearise().frequencies(3), theory(3)
    off = float(np.abs(found / expected - 1.0).max())
    print("frequencies " + ", ".join(f"{f:.2f}" for f in found) + f" Hz, theory within {100 * off:.3f} %")
    half = 0.5 / found[0]
    records = {
        "unshaped": swing(simulation, servo, [(1.0, 0.0)]),
        "shaped": swing(simulation, servo, [(0.25, 0.0), (0.5, half), (0.25, 2.0 * half)]),
    }
    over = records["shaped"].times > RISE + 2.0 * half + 0.05
    left = {name: float(np.abs(deflection(record)[over]).max()) for name, record in records.items()}
    print(
        f"the tip swings on by {1e3 * left['unshaped']:.1f} mm, and by {1e3 * left['shaped']:.2f} mm where it is shaped"
    )
    draw(records, arguments.out / "servo_arm.png")
    print(f"Wrote {arguments.out / 'servo_arm.png'}.")
    if off > FREQUENCY_ERROR:
        sys.exit("The frequencies are not those of theory.")
    if left["shaped"] > REST * left["unshaped"]:
        sys.exit("The shaped arm does not stand still.")


if __name__ == "__main__":
    main()
