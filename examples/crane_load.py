"""A crane carries a container on two slings and sets it down without swing: frequencies of a double pendulum.

The trolley, the hook and the container are a double pendulum. The rope of length L and mass m carries the hook, a mass
M1. The container, a body of mass M2 and inertia J, hangs the distance d below the hook, and turns
about the hook with its slings. Small angles p of the rope and q of the container obey, with M = M1 + M2,

    [(M + m / 3) L^2   M2 L d    ] p''   [(M + m / 2) g L   0      ] p
    [ M2 L d           M2 d^2 + J] q'' + [0                 M2 g d ] q = 0.

The trolley moves by 16 m. Shaped, its command comes in four parts, a pair for each of both frequencies, which cancel
the swing that each of them leaves [Singer and Seering 1990]. The example fails if a frequency is wrong by more than
0.5 %, or if the container swings on by more than a tenth of the unshaped swing.

Writes out/crane_load.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import eigh

import withe
from withe.view import style

GRAVITY = 9.81  # [m/s^2]
ROPE, ROPE_DENSITY, NODES = 12.0, 2.0, 16  # [m], [kg/m]
HOOK = 400.0  # [kg]
LOAD, LOAD_SIZE, DROP = 5000.0, (4.0, 2.4, 2.2), 2.5  # [kg], [m], from the hook to the lid [m]
AWAY, RISE = 16.0, 6.0  # of the trolley [m], [s]
TIME_STEP, UNTIL = 0.01, 26.0  # [s]
FREQUENCY_ERROR, REST = 5e-3, 0.1  # allowed errors


def crane() -> tuple[withe.Simulation, withe.Support]:
    """Return the crane with its load, and the trolley."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    steel = withe.Stiffness(stretch=2e8, bend=5.0, twist=5.0)
    words = {"radius": 0.02, "stiffness": steel, "line_density": ROPE_DENSITY}
    rope = scene.add_rod(start=(0, 0, 0), end=(0, 0, -ROPE), nodes=NODES, name="rope", **words)
    trolley = scene.pin(rope.start, name="trolley")
    scene.add_mass(rope.end, HOOK, name="hook")
    lid = -ROPE - DROP
    middle = (0, 0, lid - 0.5 * LOAD_SIZE[2])
    load = scene.add_body(withe.solids.Box(LOAD_SIZE), mass=LOAD, position=middle, name="load")
    for side in (-0.5, 0.5):
        corner = (side * LOAD_SIZE[0], 0, lid)
        sling = scene.add_rod(
            start=(0, 0, -ROPE), end=corner, nodes=6, name=f"sling {'left' if side < 0 else 'right'}", **words
        )
        scene.join(rope.end, sling.start, "pinned")
        scene.join(load, sling.end, "pinned")
    return scene.build(planar=True, time_step=TIME_STEP), trolley


def theory() -> np.ndarray:
    """Return both frequencies of the double pendulum [Hz]."""
    below, rope = DROP + 0.5 * LOAD_SIZE[2], ROPE_DENSITY * ROPE
    inertia = LOAD * (LOAD_SIZE[0] ** 2 + LOAD_SIZE[2] ** 2) / 12.0
    total = HOOK + LOAD
    mass = [
        [(total + rope / 3.0) * ROPE**2, LOAD * ROPE * below],
        [LOAD * ROPE * below, LOAD * below**2 + inertia],
    ]
    weight = np.diag([(total + 0.5 * rope) * GRAVITY * ROPE, LOAD * GRAVITY * below])
    return np.sqrt(eigh(weight, mass, eigvals_only=True)) / (2.0 * np.pi)


def rise(time: float) -> float:
    """Go from 0 to 1 within RISE, without velocity and acceleration at the ends."""
    s = min(max(time / RISE, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def shaper(frequencies: np.ndarray) -> list[tuple[float, float]]:
    """Return the parts of a command that leave none of the frequencies: (share, delay [s])."""
    parts = [(1.0, 0.0)]
    for each in frequencies:
        parts = [(0.5 * share, delay + late) for share, delay in parts for late in (0.0, 0.5 / each)]
    return parts


def carry(simulation: withe.Simulation, trolley: withe.Support, parts: list[tuple[float, float]]) -> withe.Record:
    """Move the trolley by a command in parts."""
    simulation.reset()
    simulation.equilibrium()
    simulation.move(
        trolley, path=lambda time: (AWAY * sum(share * rise(time - delay) for share, delay in parts), 0.0, 0.0)
    )
    record = {"trolley": lambda now: now.positions("rope")[0, 0]}
    return simulation.run(UNTIL, 0.05, record=record, progress=False)


def sway(record: withe.Record) -> np.ndarray:
    """Return the horizontal distance of the load from the trolley [m]."""
    return np.asarray(record.body_position("load")[:, 0] - record["trolley"])


def outline(record: withe.Record, frame: int) -> np.ndarray:
    """Return the outline of the load in the plane of its motion, shape (5, 2) [m]."""
    box = 0.5 * np.array([(a, 0.0, b) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]) * np.array(LOAD_SIZE)
    return (record.body_position("load")[frame] + box @ record.body_rotation("load")[frame].T)[:, [0, 2]]


def draw(records: dict[str, withe.Record], path: Path) -> None:
    """Draw the load on its way, the trolley, and the sway of the load."""
    colors = style.use()
    figure = plt.figure(figsize=(11.0, 5.2), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.1, 1.0))
    seen = figure.add_subplot(grid[:, 0])
    above, below = (figure.add_subplot(grid[row, 1]) for row in range(2))
    record = records["shaped"]
    moments = np.searchsorted(record.times, (0.0, 4.5, 7.0, 18.0))
    for frame, shade in zip(moments, style.ramp()(np.linspace(0.0, 1.0, len(moments))), strict=True):
        for rod in record.rods:
            seen.plot(*record.positions(rod)[frame][:, [0, 2]].T, color=shade, linewidth=1.8)
        seen.plot(*record.positions("rope")[frame, -1, [0, 2]], color=shade, marker="o", markersize=6)
        seen.fill(*outline(record, frame).T, facecolor=colors.pale, edgecolor=shade, linewidth=1.6, zorder=3, alpha=0.9)
    seen.plot((-4.0, AWAY + 4.0), (0.0, 0.0), color=colors.ink, linewidth=4.0, solid_capstyle="butt", zorder=2.5)
    seen.set(aspect="equal", title="shaped: 0, 4.5, 7 and 18 s, light to dark")
    for (name, each), color in zip(records.items(), (colors.red, colors.blue), strict=True):
        above.plot(each.times, each["trolley"], color=color, label=name)
        below.plot(each.times, sway(each), color=color)
    above.set_title("trolley")
    below.set_title("load beside the trolley")
    style.label(seen, x=("x", "m"), y=("z", "m"))
    style.label(above, x=("time", "s"), y=("x", "m"))
    style.label(below, x=("time", "s"), y=("sway", "m"))
    style.legend(above)
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Compare frequencies, carry the load twice, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 4 s.", flush=True)

    simulation, trolley = crane()
    simulation.equilibrium()
    found, expected = np.asarray(simulation.linearise().frequencies(2)), theory()
    off = float(np.abs(found / expected - 1.0).max())
    print("frequencies " + ", ".join(f"{f:.4f}" for f in found) + f" Hz, theory within {100 * off:.2f} %")
    parts = {"unshaped": [(1.0, 0.0)], "shaped": shaper(found)}
    records = {name: carry(simulation, trolley, each) for name, each in parts.items()}
    after = records["shaped"].times > RISE + max(delay for _, delay in parts["shaped"])
    left = {name: float(np.abs(sway(record)[after]).max()) for name, record in records.items()}
    print(f"the load swings on by {left['unshaped']:.2f} m, and by {left['shaped']:.3f} m where it is shaped")
    draw(records, arguments.out / "crane_load.png")
    print(f"Wrote {arguments.out / 'crane_load.png'}.")
    if off > FREQUENCY_ERROR:
        sys.exit("The frequencies are not those of theory.")
    if left["shaped"] > REST * left["unshaped"]:
        sys.exit("The load goes on to swing.")


if __name__ == "__main__":
    main()
