"""A satellite with four booms turns by its wheel, and the booms bend: frequencies by a transcendental equation.

The hub of inertia J and radius a carries four beams of length L, bending stiffness EI and mass per length m. Where the
hub turns and all booms bend alike, each is a beam w = A cos + B sin + C cosh + D sinh of b x / L with a free end. Its
root moves with the hub: w(0) = a w'(0). The balance of moments about the axis of the hub is

    4 EI (w''(0) - a w'''(0)) = -omega^2 J w'(0),    omega = b^2 (EI / m)^(1/2) / L^2.

The wheel accelerates the hub and brakes it again, so that the satellite turns by 30 degrees. At once, the booms go on
to vibrate. In two halves, half a period of the first mode apart, both vibrations cancel [Singer and Seering 1990].

The example fails if one of three frequencies is wrong by more than 0.1 %. It also fails if the angular momentum does
not vanish in the end, or if the booms vibrate after the second manoeuvre.

Writes out/satellite.png.
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

RADIUS, HEIGHT, HUB_DENSITY = 0.25, 0.4, 140.0  # of the hub [m], [m], [kg/m^3]
LENGTH, BENDING, LINE_DENSITY, NODES = 2.0, 10.0, 0.2, 31  # of a boom [m], [N m^2], [kg/m]
TURN, PULSE = np.radians(30.0), 1.0  # [rad], of acceleration and of braking, each [s]
TIME_STEP, UNTIL = 0.01, 6.0  # [s]
FREQUENCY_ERROR, REST = 1e-3, 0.05  # allowed errors
INERTIA = 0.5 * np.pi * HUB_DENSITY * HEIGHT * RADIUS**4  # of the hub [kg m^2]
OF_BOOMS = 4.0 * LINE_DENSITY * ((RADIUS + LENGTH) ** 3 - RADIUS**3) / 3.0  # as rigid bars [kg m^2]
SHARES = {"at once": ((1.0, 0.0),), "in two halves": ((0.5, 0.0), (0.5, 1.0))}  # share of the torque, half periods


def satellite() -> tuple[withe.Simulation, withe.Load]:
    """Return the satellite at rest, and the moment of its wheel."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    hub = scene.add_body(withe.solids.Cylinder(RADIUS, HEIGHT), density=HUB_DENSITY, name="hub")
    carbon = withe.Stiffness(stretch=1e6, bend=BENDING, twist=BENDING)
    for k, (x, y) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1))):
        root, tip = (np.array([x, y, 0.0]) * r for r in (RADIUS, RADIUS + LENGTH))
        boom = scene.add_rod(
            start=root,
            end=tip,
            nodes=NODES,
            radius=0.015,
            stiffness=carbon,
            line_density=LINE_DENSITY,
            name=f"boom {k + 1}",
        )
        scene.join(boom.start, hub)
    wheel = scene.add_moment(hub, (0.0, 0.0, 1e-6), name="wheel")
    simulation = scene.build(planar=True, time_step=TIME_STEP)
    simulation.set(wheel, moment=(0.0, 0.0, 0.0))
    return simulation, wheel


def theory(count: int) -> np.ndarray:
    """Return the frequencies of the modes in which the hub turns [Hz]."""
    a, inertia = RADIUS / LENGTH, INERTIA / (LINE_DENSITY * LENGTH**3)

    def determinant(b: float) -> float:
        c, s, ch, sh = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        slope = b * np.array([0.0, 1.0, 0.0, 1.0])
        bending = b**2 * np.array([-1.0, 0.0, 1.0, 0.0])
        shear = b**3 * np.array([0.0, -1.0, 0.0, 1.0])
        root = np.array([1.0, 0.0, 1.0, 0.0]) - a * slope
        balance = 4.0 * (bending - a * shear) + b**4 * inertia * slope
        return float(np.linalg.det([[-c, -s, ch, sh], [s, -c, sh, ch], root, balance]) / ch)

    grid = np.linspace(0.3, 14.0, 3000)
    values = [determinant(b) for b in grid]
    roots = [brentq(determinant, grid[i], grid[i + 1]) for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0.0]
    return np.square(roots[:count]) * np.sqrt(BENDING / LINE_DENSITY) / LENGTH**2 / (2.0 * np.pi)


def torque(time: float, shares: tuple[tuple[float, float], ...], half_period: float) -> float:
    """Return the torque of the wheel [N m]: a pulse forth and one back for each share, after its delay."""
    greatest = TURN * (INERTIA + OF_BOOMS) / PULSE**2
    total = 0.0
    for share, delay in shares:
        since = time - delay * half_period
        total += share * greatest * ((0.0 <= since < PULSE) - float(PULSE <= since < 2.0 * PULSE))
    return total


def turn(
    simulation: withe.Simulation, wheel: withe.Load, shares: tuple[tuple[float, float], ...], half: float
) -> withe.Record:
    """Turn the satellite; the record has the torque and the angular momentum about the axis."""
    simulation.reset()
    step = simulation.time_step

    def drive(now: withe.Simulation) -> None:
        # The mean over the step, so that the impulse is exact at any step.
        times = now.time + step * (np.arange(20) + 0.5) / 20.0
        now.set(wheel, moment=(0.0, 0.0, float(np.mean([torque(t, shares, half) for t in times]))))

    return simulation.run(
        UNTIL,
        2.0 * TIME_STEP,
        before_step=drive,
        record={
            "momentum": lambda now: now.momentum().angular[2],
            "torque": lambda now: torque(now.time, shares, half),
        },
        progress=False,
    )


def angle(record: withe.Record) -> np.ndarray:
    """Return the angle of the hub [rad]."""
    axes = record.body_rotation("hub")
    return np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))


def tips(record: withe.Record) -> np.ndarray:
    """Return the deflection of the tip of the first boom from the axis of the hub [m]."""
    axis = record.body_rotation("hub")[:, :, 1]
    return np.einsum("ij,ij->i", record.positions("boom 1")[:, -1] - record.body_position("hub"), axis)


def draw(records: dict[str, withe.Record], path: Path) -> None:
    """Draw the satellite from above, the angle of the hub, and the deflection of the tips."""
    colors = style.use()
    figure = plt.figure(figsize=(10.4, 5.2), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.25))
    seen = figure.add_subplot(grid[:, 0])
    above, below = (figure.add_subplot(grid[row, 1]) for row in range(2))
    fast = records["at once"]
    moments = np.searchsorted(fast.times, (0.0, 0.5, 1.0, 1.5, 2.0))
    rim = RADIUS * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 60))
    for frame, shade in zip(moments, style.ramp()(np.linspace(0.0, 1.0, len(moments))), strict=True):
        for rod in fast.rods:
            seen.plot(*fast.positions(rod)[frame, :, :2].T, color=shade, linewidth=2.2)
    seen.fill(rim.real, rim.imag, facecolor=colors.pale, edgecolor=colors.ink, linewidth=1.6, zorder=3)
    seen.set(aspect="equal", title="at once: 0 to 2 s, light to dark")
    for (name, record), color in zip(records.items(), (colors.red, colors.blue), strict=True):
        above.plot(record.times, np.degrees(angle(record)), color=color, label=name)
        below.plot(record.times, 1e3 * tips(record), color=color)
    above.set_title("angle of the hub")
    below.set_title("deflection of the tips")
    style.label(seen, x=("x", "m"), y=("y", "m"))
    style.label(above, x=("time", "s"), y=("angle", "degrees"))
    style.label(below, x=("time", "s"), y=("deflection", "mm"))
    style.legend(above)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Compare frequencies, turn the satellite twice, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 3 s.", flush=True)

    simulation, wheel = satellite()
    expected = theory(3)
    found = np.asarray(simulation.linearise().frequencies(16))
    nearest = np.array([found[np.argmin(np.abs(found / each - 1.0))] for each in expected])
    off = float(np.abs(nearest / expected - 1.0).max())
    print("frequencies " + ", ".join(f"{f:.3f}" for f in nearest) + f" Hz, theory within {100 * off:.3f} %")
    half = 0.5 / float(expected[0])
    records = {name: turn(simulation, wheel, shares, half) for name, shares in SHARES.items()}
    quiet = records["at once"].times > 2.0 * PULSE + half + 0.05
    shake = {name: float(np.ptp(tips(record)[quiet])) for name, record in records.items()}
    left = max(float(np.abs(record["momentum"][-1])) for record in records.values())
    most = max(float(np.abs(record["momentum"]).max()) for record in records.values())
    print(f"the tips shake by {1e3 * shake['at once']:.1f} mm, and by {1e3 * shake['in two halves']:.2f} mm in halves")
    print(f"angular momentum at the end: {left / most:.1e} of its greatest value")
    draw(records, arguments.out / "satellite.png")
    print(f"Wrote {arguments.out / 'satellite.png'}.")
    if off > FREQUENCY_ERROR:
        sys.exit("The frequencies are not those of theory.")
    if left > 1e-6 * most:
        sys.exit("The angular momentum is not that which the wheel gave.")
    if shake["in two halves"] > REST * shake["at once"]:
        sys.exit("The satellite goes on to shake.")


if __name__ == "__main__":
    main()
