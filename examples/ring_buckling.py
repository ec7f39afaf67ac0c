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

import withe

RADIUS = 0.1  # of the ring [m]
BENDING, TWISTING = 2.0e-3, 1.6e-3  # [N m^2]
CRITICAL = 2.0 * np.pi * np.sqrt(3.0) * BENDING / TWISTING  # [rad]


def build(nodes: int, integrator: str = "static") -> tuple[withe.Simulation, withe.Rod]:
    """A ring closed without twist. Holding one node takes away its rigid motions and nothing else."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    stiffness = withe.Stiffness(stretch=500.0, bend=(BENDING, BENDING), twist=TWISTING)
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


def is_flat(simulation: withe.Simulation, ring: withe.Rod) -> bool:
    """A flat ring cannot change its twist: what it loses goes into writhe, the coiling of its centreline in space."""
    return abs(simulation.twists(ring).mean()) * 2.0 * np.pi * RADIUS < 0.05


def critical_twist(nodes: int, tolerance: float = 1e-3) -> float:
    """Total twist at which the flat ring stops being stable [rad], by bisection."""
    low, high = 0.8 * CRITICAL, 1.2 * CRITICAL
    while high - low > tolerance * CRITICAL:
        middle = 0.5 * (low + high)
        simulation, ring = build(nodes)
        simulation.set_natural_twist(ring, middle / (2.0 * np.pi * RADIUS))
        simulation.equilibrium()
        if is_flat(simulation, ring):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def main() -> None:
    """Measure the critical twist, and show a ring beyond it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=120)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)

    measured = critical_twist(arguments.nodes)
    print(f"critical twist   {measured:.3f} rad; Michell {CRITICAL:.3f} rad ({100 * (measured / CRITICAL - 1):+.2f} %)")

    simulation, ring = build(arguments.nodes, "backward_euler")
    simulation.set_natural_twist(ring, 1.1 * CRITICAL / (2.0 * np.pi * RADIUS), over=1.0)
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
