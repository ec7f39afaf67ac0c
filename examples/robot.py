"""A six-legged robot of soft rods walks by changing the natural curvature of its legs.

The legs are arches that meet in one rigid joint. A leg has no motors but two muscles: where hip and knee would
be, its natural curvature can be changed, which bends it sideways or in its own plane. Three feet hold the ground
(as suction cups would) while the other three are lifted, swung forward and set down; then they change parts.

Writes out/robot.png, out/robot_plot.png, and with --film out/robot.mp4 and the film of the README, out/robot.gif (kept
in examples/pictures).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import withe

LEG_LENGTH = 0.16  # [m]
LEG_RADIUS = 5e-3  # [m]
NODES = 25
RISE, FALL = np.radians(35.0), np.radians(-80.0)  # slope of a leg at the body and at the foot
ARCH = (FALL - RISE) / LEG_LENGTH  # drawn curvature in the leg's plane [1/m]
HIP, KNEE = slice(0, 6), slice(10, 16)  # stencils that can be bent
STRIDE, LIFT = 0.045, 0.02  # [m]
HALF_STEP = 0.6  # time for which three feet hold [s]


@dataclass
class Leg:
    """One leg: its rod, the direction it points to, and where its joints are relative to the foot."""

    rod: withe.Rod
    azimuth: float
    foothold: withe.Support | None = None
    lowering: bool = False

    def curvature(self, forward: float, up: float) -> np.ndarray:
        """Natural curvature that moves the foot forward and up relative to the body.

        Parameters
        ----------
        forward, up : float [m]

        Returns
        -------
        ndarray of shape (stencils, 2) [1/m]
        """
        arch = leg_centreline(self.azimuth)
        radial = (arch - arch[0]) @ np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0])
        heights = arch[:, 2] - arch[0, 2]
        outward, sideways = forward * np.cos(self.azimuth), -forward * np.sin(self.azimuth)
        # A small turn at a hinge moves the foot at right angles to the line that joins them.
        hinges = [(HIP.start + HIP.stop) // 2, (KNEE.start + KNEE.stop) // 2]
        turns = np.linalg.solve(
            [[heights[h] - heights[-1] for h in hinges], [radial[-1] - radial[h] for h in hinges]], [outward, up]
        )
        spacing = LEG_LENGTH / (NODES - 1)
        curvature = np.zeros((NODES - 2, 2))
        curvature[:, 1] = ARCH
        for stencils, turn in zip((HIP, KNEE), turns, strict=True):
            curvature[stencils, 1] += turn / (spacing * (stencils.stop - stencils.start))
        curvature[HIP, 0] = sideways / radial[-1] / (spacing * (HIP.stop - HIP.start))
        return curvature


def leg_centreline(azimuth: float) -> np.ndarray:
    """An arch from the body to the ground, shape (nodes, 3) [m]."""
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    upward = np.array([0.0, 0.0, 1.0])
    points = withe.shapes.arc(
        start=(0.0, 0.0, 0.0),
        tangent=np.cos(RISE) * outward + np.sin(RISE) * upward,
        towards=upward,
        curvature=ARCH,
        length=LEG_LENGTH,
        nodes=NODES,
    )
    return points - points[-1, 2] * upward


def build() -> tuple[withe.Simulation, list[Leg]]:
    """Six legs in one joint, standing on their feet."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1.5e7, poisson_ratio=0.5, density=1180.0, viscosity=5.0e4)
    legs = []
    for index, azimuth in enumerate(np.radians([30.0, 90.0, 150.0, 210.0, 270.0, 330.0])):
        rod = scene.add_rod(
            points=leg_centreline(azimuth),
            normal=(-np.sin(azimuth), np.cos(azimuth), 0.0),
            radius=LEG_RADIUS,
            material=rubber,
            name=f"leg {index}",
        )
        legs.append(Leg(rod, azimuth))
    for leg in legs[1:]:
        scene.join(legs[0].rod.start, leg.rod.start)
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    for leg in legs:
        leg.foothold = simulation.pin(leg.rod.end)
    return simulation, legs


def gait(steps: int) -> list[tuple[float, int, Callable[[withe.Simulation, Leg], None]]]:
    """Events of the gait: the time, the legs (even or odd), and a function of the simulation and each of them."""

    def bend(forward: float, up: float, over: float) -> Callable[[withe.Simulation, Leg], None]:
        return lambda simulation, leg: simulation.set(leg.rod, natural_curvature=leg.curvature(forward, up), over=over)

    events = []
    for step in range(steps):
        start, swinging, holding = 0.2 + step * HALF_STEP, step % 2, (step + 1) % 2
        events += [
            (start, swinging, bend(-STRIDE / 2, LIFT, 0.10)),
            (start + 0.08, swinging, let_go),  # once the leg pulls up, so that it does not spring down
            (start + 0.10, holding, bend(-STRIDE / 2, 0.0, 0.35)),
            (start + 0.15, swinging, bend(STRIDE / 2, LIFT, 0.20)),
            (start + 0.35, swinging, set_down),
            (start + 0.35, swinging, bend(STRIDE / 2, -LIFT / 2, 0.25)),
        ]
    return sorted(events, key=lambda event: event[0])


def let_go(simulation: withe.Simulation, leg: Leg) -> None:
    """Free the foot, wherever it is."""
    if leg.foothold is not None:
        simulation.release(leg.foothold)
    leg.foothold, leg.lowering = None, False


def set_down(simulation: withe.Simulation, leg: Leg) -> None:
    """From now on, the foot holds as soon as it touches the ground."""
    leg.lowering = True


def walk(steps: int, progress: bool = True) -> withe.Record:
    """Let the robot walk: every half step, three feet hold and three swing."""
    simulation, legs = build()
    events = gait(steps)

    def controller(simulation: withe.Simulation) -> None:
        while events and simulation.time >= events[0][0] - 1e-9:
            _, parity, action = events.pop(0)
            for leg in legs[parity::2]:
                action(simulation, leg)
        for leg in legs:
            if leg.lowering and simulation.positions(leg.rod)[-1, 2] <= 0.0:
                leg.foothold, leg.lowering = simulation.pin(leg.rod.end), False
                simulation.set(leg.rod, natural_curvature=leg.curvature(STRIDE / 2, 0.0), over=0.1)

    return simulation.run(
        duration=0.4 + steps * HALF_STEP, record_every=0.02, progress=progress, before_step=controller
    )


def main() -> None:
    """Walk, and show it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=12, help="how often three feet change parts")
    parser.add_argument("--film", action="store_true", help="also render out/robot.mp4 and out/robot.gif")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 10 s.", flush=True)

    started = time.perf_counter()
    record = walk(arguments.steps)
    seconds = time.perf_counter() - started
    body = record.positions("leg 0")[:, 0]
    print(f"walked {100 * (body[-1, 0] - body[0, 0]):.1f} cm in {record.times[-1]:.1f} s, simulated in {seconds:.1f} s")

    record.plot().savefig(arguments.out / "robot_plot.png", dpi=130)
    view = {"camera": (0.35, -1.0, 0.55), "ground": -LEG_RADIUS}
    last = len(record) - 1
    record.picture(arguments.out / "robot.png", size=(1120, 490), frame=last - 30, ghosts=(0, last // 2 - 10), **view)
    if arguments.film:
        record.animate(arguments.out / "robot.mp4", **view)
        record.animate(arguments.out / "robot.gif", size=(720, 306), fps=12.5, quality="high", **view)
    print(f"wrote {', '.join(sorted(str(path) for path in arguments.out.glob('robot*')))}")


if __name__ == "__main__":
    main()
