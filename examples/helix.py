"""A helix of silicone, held by its top, sags under its own weight and then swings.

Its shape at rest is compared with the one that an independent public rod code finds [Choi and others,
"DisMech", 2024]. Writes out/helix.png, out/helix_plot.png, and with --film out/helix.mp4.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import withe

REST_TIP = (-0.016275, -0.000590, -0.198762)  # result of the public code [m]


def centreline() -> np.ndarray:
    """A short stem that is held, a horizontal run, and four turns of a helix, shape (106, 3) [m]."""
    stem = [(0.0, 0.0, 0.0250546), (0.0, 0.0, 0.0)]
    run = [(0.0, y, 0.02 * y) for y in (0.004, 0.008, 0.012, 0.016)]
    angles = -0.2348261 * np.arange(100)
    coil = np.stack([-0.02 * np.sin(angles), 0.02 * np.cos(angles), -0.00186869 * np.arange(100)], axis=1)
    return np.concatenate([stem, run, coil])


def build(integrator: str, time_step: float = 5e-3) -> withe.Simulation:
    """Return the helix, drawn without stress, with its first edge clamped."""
    scene = withe.Scene(gravity=(0.0, 0.0, -9.8))
    silicone = withe.Material(youngs_modulus=1.0e7, poisson_ratio=0.5, density=1273.52)
    helix = scene.add_rod(points=centreline(), radius=5e-3, material=silicone, name="helix")
    scene.clamp(helix.start, hold="edge")
    # Bending as the public code measures it.
    return scene.build(integrator=integrator, time_step=time_step, bending="tangent")


def main() -> None:
    """Find the shape at rest, then let go from the drawn shape."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--film", action="store_true", help="also render out/helix.mp4")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    resting = build("static")
    started = time.perf_counter()
    result = resting.equilibrium()
    seconds = time.perf_counter() - started
    tip = resting.positions("helix")[-1]
    error = np.linalg.norm(tip - REST_TIP)
    print(f"tip at rest      {np.round(tip, 6)} m, {1e6 * error:.0f} um from the public code")
    print(f"                 {result.iterations} iterations, {1e3 * seconds:.1f} ms, stable: {result.stable}")

    swinging = build("energy_momentum")
    started = time.perf_counter()
    record = swinging.run(duration=2.0, record_every=0.02, progress=True)
    seconds = time.perf_counter() - started
    total = record.energy().total
    drift = np.ptp(total) / record.energy().kinetic.max()
    print(f"2 s of swinging  in {seconds:.2f} s; total energy constant to {drift:.1e} of the greatest kinetic energy")

    record.plot().savefig(arguments.out / "helix_plot.png", dpi=130)
    record.picture(arguments.out / "helix.png", frame=15, size=(900, 1100))
    if arguments.film:
        record.animate(arguments.out / "helix.mp4", size=(720, 900))
    print(f"wrote {', '.join(sorted(str(path) for path in arguments.out.glob('helix*')))}")


if __name__ == "__main__":
    main()
