"""Fit of camera data of a robot of two soft limbs: its camera, and how its muscles bend it over time.

Two silicone limbs, one after the other, are bent by wires of a shape-memory alloy; a camera follows nine tags on them
[Pacheco Garcia et al. 2023]. Half of the 169 frames calibrate the camera with the robot's own shapes. Then two numbers
a frame, the natural curvatures of the limbs, explain where all tags are, in frames that the camera was not calibrated
with too. What the frames cannot tell is said: the limbs' stiffness, and whether camera or base is tilted.

Writes out/soft_limb.png: tags as seen and limbs as simulated, and the curvatures over time.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe import real2sim
from withe.view import style

LOG = Path(__file__).resolve().parent.parent / "tests" / "data" / "soft_limb_data.csv"
LIMB = 0.075  # length of a limb [m]
TAGS = [("upper", LIMB * i / 4) for i in range(5)] + [("lower", LIMB * i / 4) for i in range(1, 5)]
LIMBS = ("upper", "lower")
CALIBRATED = slice(0, 85)


def robot() -> withe.Simulation:
    """The limbs, drawn straight and level."""
    scene = withe.Scene(gravity=(0, 0, -9.8))
    silicone = withe.Material(youngs_modulus=1.793e6, density=1240.0)
    upper = scene.add_rod(start=(0, 0, 0), end=(LIMB, 0, 0), nodes=25, radius=0.01, material=silicone, name="upper")
    lower = scene.add_rod(
        start=(LIMB, 0, 0), end=(2 * LIMB, 0, 0), nodes=25, radius=0.01, material=silicone, name="lower"
    )
    scene.join(upper.end, lower.start)
    scene.clamp(upper.start, hold="edge")
    return scene.build(integrator="static")


def draw(log: real2sim.Log, camera: real2sim.Calibration, found: real2sim.Fit, path: Path) -> None:
    """Five frames, and all curvatures."""
    colors = style.use()
    figure, (seen, over_time) = plt.subplots(1, 2, figsize=(11, 4.2))
    simulation = robot()
    for frame in range(0, len(log.times), 42):
        found.apply(simulation, frame)
        simulation.equilibrium()
        line = camera.project(simulation.positions())
        shade = style.ramp()(log.times[frame] / log.times[-1])
        seen.plot(*line.T, color=shade, lw=6, alpha=0.5, label=f"{log.times[frame]:.0f} s")
        seen.plot(*log.pixels[frame].T, "o", color=shade, markersize=4)
    seen.invert_yaxis()
    seen.set(aspect="equal", title="Tags as seen (dots), limbs as simulated")
    style.label(seen, x=("x", "px"), y=("y", "px"))
    style.legend(seen)
    for limb in LIMBS:
        value, sigma = found.value(limb)[:, 0], found.sigma(limb)[:, 0]
        over_time.plot(log.times, value, label=f"{limb} limb")
        over_time.fill_between(log.times, value - 2 * sigma, value + 2 * sigma, alpha=0.3)
    over_time.axvline(log.times[CALIBRATED.stop], color=colors.grey, lw=0.8, ls="--", label="end of the calibration")
    over_time.set_title("Natural curvature (band: two standard deviations)")
    style.label(over_time, x=("time", "s"), y=("natural curvature", "1/m"))
    style.legend(over_time)
    figure.savefig(path)


def main() -> None:
    """Calibrate, fit, and print unobservable unknowns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the picture")
    parser.add_argument("--basis", choices=("constant", "linear"), default="constant", help="curvature along a limb")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 15 s.", flush=True)

    log = real2sim.read_log(LOG, tags=range(101, 110), skip=7)
    simulation = robot()
    unknowns = [(limb, "natural_curvature", arguments.basis) for limb in LIMBS]
    camera = real2sim.calibrate(simulation, real2sim.Tags(log.pixels, TAGS), CALIBRATED, unknowns=unknowns)
    print(f"camera: rolled by {np.degrees(camera.roll):.1f} degrees, {camera.scale / 1000:.2f} px/mm")
    for combination in camera.unobservable:
        print(f"  not told: {combination} px")

    tags = real2sim.Tags(log.pixels, camera.places, camera)
    found = real2sim.fit(simulation, tags, unknowns)
    off = 1e3 * np.linalg.norm(found.residuals.reshape(len(log.times), -1, 2), axis=2)[CALIBRATED.stop :] / camera.scale
    print(
        f"frames that did not calibrate: tip {off[:, -1].mean():.2f} mm off on the mean, {off[:, -1].max():.2f} at "
        f"most; all tags {np.sqrt((off**2).mean()):.2f} mm (RMS)"
    )
    worst = max(found.outliers, key=lambda outlier: outlier.jump)
    print(f"{len(found.outliers)} tags jump, most: tag {log.tags[worst.tag]}, {worst}")

    with_stiffness = real2sim.fit(simulation, tags, [*unknowns, (LIMBS, "youngs_modulus")])
    for combination in with_stiffness.unobservable:
        print(f"not told by these stills: {combination} px")
    draw(log, camera, found, arguments.out / "soft_limb.png")
    print(f"wrote {arguments.out / 'soft_limb.png'}")


if __name__ == "__main__":
    main()
