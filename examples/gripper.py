"""An entanglement gripper: five limbs that hang side by side curl up and wind around each other.

Limbs of silicone get a random natural curvature each, which grows over ten seconds; from then on they hold each other.
The scene is that of section 6.4.1.2 of Choi's dissertation, with friction and without, except for the curvature. The
dissertation draws it for each stencil alone, which kinks the limbs; here it is drawn at twelve points of a limb and
interpolated. The example fails when limbs overlap by more than a twentieth of their radius, when energy is gained
beyond the work, or when a second run gives other bits.

Writes out/gripper.png.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import withe

LIMBS, NODES, LENGTH, RADIUS = 5, 60, 0.3, 5e-3  # [m]
SIDE = 0.015  # side of the pentagon of their tops [m]
LARGEST = np.radians(39.0)  # turn of a stencil, half of which is reached
DRAWN = 12  # points of a limb at which its curvature is drawn
CURLING = 10.0  # [s]
TIME_STEP = 2.5e-3  # [s]
DEEPEST = 0.05  # relative to a radius


def build(friction: float, seed: int, drawn: int = DRAWN) -> tuple[withe.Simulation, list[withe.Rod], np.ndarray]:
    """The gripper at rest, and the natural curvatures to come, (limbs, stencils, 2) [1/m].

    The curvature of a limb is drawn at some points of its length, and linear in between; NODES - 2 draws each stencil.
    """
    scene = withe.Scene(gravity=(0.0, 0.0, -9.8))
    silicone = withe.Material(youngs_modulus=3e5, poisson_ratio=0.5, density=1200.0)
    turns = 2.0 * np.pi * np.arange(LIMBS) / LIMBS
    tops = SIDE / (2.0 * np.sin(np.pi / LIMBS)) * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    limbs = []
    for index, top in enumerate(tops):
        end = top - (0.0, 0.0, LENGTH)
        limb = scene.add_rod(start=top, end=end, nodes=NODES, radius=RADIUS, material=silicone, name=f"limb {index}")
        scene.clamp(limb.start, hold="edge")
        limbs.append(limb)
    scene.add_drag(5.0)
    scene.enable_contact(friction=friction, distance_tolerance=5e-4, slip_tolerance=1e-3, friction_model="lagged")
    edge = LENGTH / (NODES - 1)
    stencils, points = np.linspace(0.0, 1.0, NODES - 2), np.linspace(0.0, 1.0, drawn)
    draws = np.random.default_rng(seed).uniform(0.0, LARGEST, (LIMBS, drawn))
    angles = np.array([np.interp(stencils, points, of_limb) for of_limb in draws])
    curvature = 2.0 * np.tan(0.25 * angles[..., None]) / edge * np.ones(2)
    return scene.build(integrator="backward_euler", time_step=TIME_STEP), limbs, curvature


def grip(friction: float, seed: int, duration: float, progress: bool) -> tuple[withe.Simulation, withe.Record, float]:
    """Curl the limbs up; also returns the least distance of surfaces on the way, over the radius."""
    simulation, limbs, curvature = build(friction, seed)
    for limb, own in zip(limbs, curvature, strict=True):
        simulation.set(limb, natural_curvature=own, over=CURLING)

    def clearance(simulation: withe.Simulation) -> float:
        return float(simulation.contacts()["gap"].min(initial=np.inf)) / RADIUS

    record = simulation.run(duration, record_every=0.05, progress=progress, record={"clearance": clearance})
    return simulation, record, float(record["clearance"].min())


def main() -> None:
    """Grip twice, with friction and without, and show it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=15.0, help="seconds to simulate")
    parser.add_argument("--seed", type=int, default=5, help="of the limbs' curvatures")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 40 s.", flush=True)

    for friction in (0.0, 0.5):
        started = time.perf_counter()
        simulation, record, clearance = grip(friction, arguments.seed, arguments.duration, progress=True)
        seconds = time.perf_counter() - started
        again, _, _ = grip(friction, arguments.seed, arguments.duration, progress=True)
        energy = simulation.energy()
        gained = energy.total - record.energy().total[0] - energy.work + energy.dissipated
        contacts = len(simulation.contacts())
        print(f"friction {friction}: {contacts} contacts, nearest {clearance:+.3f} radii, simulated in {seconds:.1f} s")
        if clearance < -DEEPEST:
            sys.exit("Limbs overlap.")
        if gained > 0.01 * abs(energy.work):
            sys.exit(f"Energy appears from nowhere: {gained:.2e} J.")
        if not np.array_equal(simulation.positions(), again.positions()):
            sys.exit("The second run went elsewhere.")
        print("              a second run ends on the same bits")
    simulation.picture(arguments.out / "gripper.png", camera=(0.4, -1.0, 0.1))
    print(f"Wrote {arguments.out / 'gripper.png'}.")


if __name__ == "__main__":
    main()
