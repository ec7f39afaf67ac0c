"""A ring is twisted until it leaves its plane (Michell 1889, Zajac 1962).

A straight rod is bent into a ring and closed after turning one end about its tangent. The ring stays in its plane
until the total twist reaches 2 pi sqrt(3) B / C, with B the bending and C the twisting stiffness. Here the ring is
closed without twist, and its natural twist is changed instead, which strains it in the same way.

Writes out/ring.png and out/ring_plot.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import withe

RADIUS = 0.1  # radius of the ring [m]
BENDING, TWISTING = 2.0e-3, 1.6e-3  # [N m^2]


def michell(twisting: float) -> float:
    """The critical total twist of a ring of that twisting stiffness [rad]."""
    return float(2.0 * np.pi * np.sqrt(3.0) * BENDING / twisting)


def build(nodes: int, integrator: str = "static", twisting: float = TWISTING) -> tuple[withe.Simulation, withe.Rod]:
    """Return a ring that is closed without twist. One held node removes only its rigid motions."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    stiffness = withe.Stiffness(stretch=500.0, bend=(BENDING, BENDING), twist=twisting)
    ring = scene.add_rod(
        points=withe.shapes.circle(RADIUS, nodes),
        closed=True,
        normal=(0.0, 0.0, 1.0),
        natural="straight",
        radius=4e-3,
        stiffness=stiffness,
        line_density=0.05,
        name="ring",
    )
    scene.clamp(ring.node(0))
    scene.add_drag(0.05)
    return scene.build(integrator=integrator, time_step=0.01, planar=False), ring


def critical_twist(nodes: int, twisting: float = TWISTING) -> float:
    """Total twist at which the flat ring stops being stable [rad]: where its lowest frequency passes zero.

    A flat ring is in equilibrium at any twist. A ring of a round, straight rod may also turn inside out about any of
    its tangents without an effort; holding the node opposite to the clamp in the plane takes that motion away.
    """
    simulation, ring = build(nodes, twisting=twisting)
    simulation.pin(ring.node(nodes // 2), free=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])

    def square(twist: float) -> float:
        simulation.set(ring, natural_twist=twist / (2.0 * np.pi * RADIUS))
        lowest = simulation.linearise().frequencies(1)[0]  # negative where it grows
        return float(lowest * abs(lowest))

    critical = michell(twisting)
    return float(brentq(square, 0.8 * critical, 1.2 * critical, rtol=1e-6))


def main() -> None:
    """Measure the critical twist, and show a ring beyond it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=120)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 7 s.", flush=True)

    for ratio in withe.track((TWISTING / BENDING, 1.0, 2.0, 3.0), "twisting", unit="rings"):
        expected, measured = michell(ratio * BENDING), critical_twist(arguments.nodes, ratio * BENDING)
        share = 100.0 * (measured / expected - 1.0)
        print(f"C/B = {ratio:3.1f}: critical twist {measured:6.3f} rad; Michell {expected:6.3f} rad ({share:+.3f} %)")

    simulation, ring = build(arguments.nodes, "backward_euler")
    simulation.set(ring, natural_twist=1.1 * michell(TWISTING) / (2.0 * np.pi * RADIUS), over=1.0)
    record = simulation.run(
        duration=3.0,
        record_every=0.01,
        until=lambda s: np.ptp(s.positions(ring)[:, 2]) > RADIUS,  # soon after, its strands would meet
    )
    record.plot().savefig(arguments.out / "ring_plot.png", dpi=130)
    record.picture(arguments.out / "ring.png", color_by="curvature")
    print(f"wrote {arguments.out / 'ring.png'}, {arguments.out / 'ring_plot.png'}")


if __name__ == "__main__":
    main()
