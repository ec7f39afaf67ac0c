"""Flagella whose tops turn find each other through the fluid and bundle; without it they turn for ever as if alone.

Helices that hang in a viscous fluid, their tops on a regular polygon, turned at 15 rad/s. With regularized Stokeslet
segments every flagellum stirs the fluid around the others, and they wind around each other until they touch. With
resistive-force theory none knows of the others: each does exactly what its neighbour does, and they stay as far apart
as they were. Both are checked. Writes out/flagella.png.

flagella_contact.py compares two treatments of contact once the flagella bundle. At 15 turns a minute (`--count 3 --rate
1.5708 --duration 60 --step 1e-2`), three flagella first touch after 49.6 s. Choi's dissertation, section 5.6, states
15 rad/s, at which they touch within seconds. Its table 5.1, however, has 6.04e5 iterations at 3.01 per step of 1 ms
with contact, in 250 s. Contact therefore began after 49.3 s there.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

RADIUS, PITCH, HEIGHT, NODES = 0.01, 0.05, 0.2, 68  # of a helix [m], [m], [m], [-]
THICKNESS, SIDE, RATE = 1e-3, 0.03, 15.0  # radius of a flagellum [m], side of the polygon [m], turning [rad/s]
VISCOSITY, REGULARIZATION = 0.1, 1.02e-3  # [Pa s], [m]
TURN_LENGTH = float(np.hypot(2.0 * np.pi * RADIUS, PITCH))


def turn(angle: float) -> np.ndarray:
    """Rotation about the z axis."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def build(
    count: int,
    fluid: withe.parts.FluidModel,
    time_step: float,
    rate: float = RATE,
    *,
    contact: withe.parts.ContactModel = "imcv2",
    friction: float = 0.0,
) -> withe.Simulation:
    """Right-handed helices, free of stress as drawn; contact only where the fluid can bring them together."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=3e6, poisson_ratio=0.5, density=1000.0)
    scene.add_fluid(VISCOSITY, model=fluid, regularization=REGULARIZATION, wavelength=TURN_LENGTH)
    scene.enable_contact(rods=False)  # flagella_contact.py lets them touch
    angles = 2.0 * np.pi * HEIGHT / PITCH * np.linspace(0.0, 1.0, NODES)
    helix = np.stack([RADIUS * np.cos(angles), -RADIUS * np.sin(angles), -PITCH * angles / (2.0 * np.pi)], axis=1)
    place = 0.5 * SIDE / np.sin(np.pi / count)
    centres = [turn(2.0 * np.pi * k / count) @ (place, 0.0, 0.0) for k in range(count)]
    grips = []
    for centre in centres:
        flagellum = scene.add_rod(points=helix + centre, radius=THICKNESS, material=rubber)
        grips.append(scene.clamp(flagellum.start))
    if fluid == "stokeslets":
        scene.enable_contact(model=contact, friction=friction, distance_tolerance=1e-5, slip_tolerance=1e-4)
    simulation = scene.build(integrator="backward_euler", time_step=time_step)
    for grip, centre in zip(grips, centres, strict=True):
        simulation.move(grip, path=lambda t, centre=centre: (centre + turn(rate * t) @ helix[0], turn(rate * t)))
    return simulation


def touching(simulation: withe.Simulation) -> int:
    """Number of contacts between two flagella."""
    pairs = simulation.contacts()["pair"]
    return int(np.sum(pairs[:, 0] != pairs[:, 1]))


def distances(record: withe.Record) -> tuple[np.ndarray, np.ndarray]:
    """Between the same nodes of two flagella next to each other: mean and greatest change, per frame [m]."""
    x = [record.positions(rod) for rod in record.rods]
    pairs = list(itertools.pairwise(range(len(x)))) + ([(0, len(x) - 1)] if len(x) > 2 else [])
    apart = np.stack([np.linalg.norm(x[a] - x[b], axis=2) for a, b in pairs])
    return apart.mean(axis=(0, 2)), np.abs(apart - SIDE).max(axis=(0, 2))


def draw(records: dict[str, withe.Record], path: Path) -> None:
    """The flagella at the end under both models, and how far apart they were."""
    colors = style.use()
    figure, boxes = plt.figure(figsize=(10.4, 4.4)), []
    titles = {"stokeslets": "Stokeslet segments", "resistive": "resistive-force theory"}
    colors = {"stokeslets": colors.blue, "resistive": colors.red}
    for place, (model, record) in enumerate(records.items()):
        shapes = [1e2 * record.positions(rod)[-1] for rod in record.rods]
        axes = figure.add_subplot(1, 3, place + 1, projection="3d")
        for shape in shapes:
            axes.plot(*shape.T, linewidth=2.0)
        axes.set_title(titles[model])
        style.label(axes, x=("x", "cm"), y=("y", "cm"), z=("z", "cm"))
        axes.view_init(elev=8, azim=-70)
        boxes.append((axes, shapes))
    axes = figure.add_subplot(1, 3, 3)
    for model, record in records.items():
        axes.plot(record.times, 1e2 * distances(record)[0], color=colors[model], label=titles[model])
    axes.set(title="mean distance of the same nodes", ylim=(0.0, None))
    style.label(axes, x=("time", "s"), y=("distance", "cm"))
    style.legend(axes, side="top", ncols=1)
    for box, _ in boxes:
        style.fill_frame(box, [each for _, every in boxes for each in every])
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Turn the tops under both models, compare, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2, help="number of flagella, two or more")
    parser.add_argument("--duration", type=float, default=12.0, help="seconds of turning")
    parser.add_argument("--step", type=float, default=1e-3, help="time step [s]")
    parser.add_argument("--rate", type=float, default=RATE, help="turning of the tops [rad/s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    if arguments.count < 2:
        parser.error("--count must be 2 or more")
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 40 s.", flush=True)

    records = {}
    for model in ("stokeslets", "resistive"):
        simulation = build(arguments.count, model, arguments.step, arguments.rate)
        started = time.perf_counter()
        records[model] = simulation.run(
            duration=arguments.duration, record_every=0.05, progress=True, record={"touching": touching}
        )
        seconds, steps = time.perf_counter() - started, simulation.statistics.steps
        mean, _ = distances(records[model])
        energy = simulation.energy()
        print(
            f"{model:10s}  {1e3 * seconds / steps:.2f} ms a step; same nodes {1e2 * mean[-1]:.2f} cm apart at the end, "
            f"{1e2 * SIDE:.0f} at the start; {len(simulation.contacts())} contacts; "
            f"{energy.dissipated / energy.work:.1%} of the work at the tops went into the fluid"
        )
    first = records["stokeslets"].times[np.flatnonzero(records["stokeslets"]["touching"])[:1]]
    print(f"first contact after {first[0]:.2f} s" if len(first) else "no contact between flagella")
    draw(records, arguments.out / "flagella.png")
    print(f"Wrote {arguments.out / 'flagella.png'}.")
    drawn_together = 1.0 - distances(records["stokeslets"])[0].min() / SIDE
    alone = distances(records["resistive"])[1].max() / SIDE
    print(f"drawn together by {drawn_together:.0%}; under resistive-force theory by {alone:.1e}")
    if drawn_together < 0.2 or alone > 1e-6:
        sys.exit("Flagella should be drawn together by Stokeslets, and by nothing else.")


if __name__ == "__main__":
    main()
