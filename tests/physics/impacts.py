"""Drawn impacts: rods that drop, meet head on or graze, over two decades of steps.

    python tests/physics/impacts.py [--cases COUNT]

What each integrator gains and gives back in more of them than the tests have time for, and how fast its loss in an
elastic impact falls with the step.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np

import withe

KINDS = ("drop", "head_on", "graze")
LAYS = ("parallel", "crossed", "tilted")
INTEGRATORS = ("energy_momentum", "implicit_midpoint", "backward_euler")
# An edge whose contact takes a hundredth of the radius at the speed v is stopped and thrown back within pi / v of that.
LEAST_DEPTH = 0.01


@dataclass(frozen=True)
class Impact:
    """A rod that meets a floor, or another: parallel to it, across it, or tilted against it."""

    number: int
    kind: str
    lay: str
    youngs_modulus: float  # [Pa]
    radius: float  # [m]
    speed: float  # at which surfaces meet [m/s]
    gap: float  # at the start [m]
    slide: float  # speed along the surfaces [m/s]
    time_step: float  # [s]

    @property
    def on_floor(self) -> bool:
        """Rods that drop, and every other one that grazes, meet a floor."""
        return self.kind == "drop" or (self.kind == "graze" and self.number % 2 == 0)

    @property
    def even(self) -> bool:
        """Whether all edges meet at once, so that no vibration takes a share."""
        return self.lay == "parallel"

    def build(self, integrator: Any, restitution: float = 1.0, gravity: bool = True) -> withe.Simulation:
        """The scene on its way; a drop without gravity is thrown."""
        random = np.random.default_rng([20, self.number, 1])
        falls = self.kind == "drop" and gravity
        scene = withe.Scene(gravity=(0.0, 0.0, -9.81 if falls else 0.0))
        material = withe.Material(youngs_modulus=self.youngs_modulus, poisson_ratio=0.5, density=1200.0)
        length = self.radius * random.uniform(15.0, 40.0)
        shape = {"nodes": int(random.integers(5, 12)), "radius": self.radius, "material": material}
        angle = random.uniform(0.02, 0.3)
        if self.on_floor:
            way = self.speed**2 / (2.0 * 9.81) if falls else self.gap
            along = np.array((np.cos(angle), 0.0, np.sin(angle)) if self.lay == "tilted" else (1.0, 0.0, 0.0))
            middle = np.array((0.0, 0.0, self.radius + way + 0.5 * length * along[2]))
            rods = [scene.add_rod(start=middle - 0.5 * length * along, end=middle + 0.5 * length * along, **shape)]
            scene.add_floor(restitution=restitution)
        else:
            turned = {"parallel": 0.0, "crossed": 0.5 * np.pi - angle, "tilted": angle}[self.lay]
            along = np.array((np.cos(turned), np.sin(turned), 0.0))
            apart = np.array((0.0, 0.0, self.radius + 0.5 * self.gap))
            aside = 0.0 if self.even else random.uniform(-0.3, 0.3) * length
            off = np.array((aside, 0.0, 0.0)) + apart
            half = 0.5 * length
            rods = [
                scene.add_rod(start=(-half, 0.0, -apart[2]), end=(half, 0.0, -apart[2]), **shape),
                scene.add_rod(start=off - half * along, end=off + half * along, **shape),
            ]
            scene.enable_contact(restitution=restitution)
        simulation = scene.build(integrator=integrator, time_step=self.time_step)
        if not falls:
            relative = np.array((self.slide, 0.3 * self.slide, -self.speed))
            share = random.uniform(0.0, 1.0)
            for rod, part in zip(rods, (1.0,) if self.on_floor else (share - 1.0, share), strict=True):
                simulation.set_velocities(rod, np.tile(part * relative, (shape["nodes"], 1)))
        return simulation

    def duration(self, *, falls: bool) -> float:
        """Until surfaces have parted again [s]."""
        way = 2.2 * self.speed / 9.81 if falls else 2.5 * self.gap / self.speed
        return way + 8.0 * np.pi * LEAST_DEPTH * self.radius / self.speed + 8.0 * self.time_step


def draw(number: int) -> Impact:
    """The impact of a number: always the same."""
    random = np.random.default_rng([20, number])

    def log(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    kind, lay = KINDS[number % 3], LAYS[number // 3 % 3]
    if kind == "drop" and lay == "crossed":
        lay = "parallel"  # to a floor
    radius = log(1e-3, 2e-2)
    # From within the distance tolerance, a tenth of the radius, to five of them.
    speed = np.sqrt(2.0 * 9.81 * radius * log(0.1, 5.0)) if kind == "drop" else log(0.05, 5.0)
    slide = speed * random.uniform(0.3, 3.0) if kind == "graze" else 0.0
    least = np.pi * LEAST_DEPTH * radius / speed
    return Impact(
        number, kind, lay, log(1e5, 1e8), radius, speed, radius * log(0.03, 0.5), slide, least * log(0.1, 10.0)
    )


@dataclass(frozen=True)
class Outcome:
    """Of an impact, over what moves before it (a drop: over what weight will do)."""

    gained: float  # the most that energy was above that at the start
    unbooked: float  # the most that energy with what is booked as dissipated was off it
    lost: float  # at the end
    given_back: float  # speed of parting over that of approach, of centres of mass
    slid: float  # change of what moves along the floor, and of all momentum of two rods


def run(impact: Impact, integrator: Any, restitution: float = 1.0, gravity: bool = True) -> Outcome:
    """Lets it happen."""
    falls = impact.kind == "drop" and gravity
    simulation = impact.build(integrator, restitution, gravity)
    start = simulation.energy()
    before = simulation.momentum().linear
    simulation_mass = _mass(simulation)
    scale = start.kinetic or simulation_mass * 0.5 * impact.speed**2
    gained = unbooked = -np.inf
    while simulation.time < impact.duration(falls=falls):
        simulation.step()
        energy = simulation.energy()
        gained = max(gained, (energy.total - start.total) / scale)
        balance = energy.total + energy.dissipated - energy.work - start.total
        unbooked = max(unbooked, abs(balance) / scale)
    after = simulation.momentum().linear
    kept = (after - before)[:2] if impact.on_floor else after - before
    up = [float(_centre_velocity(simulation.velocities(rod))[2]) for rod in simulation.rods]
    given_back = (up[-1] - up[0] if len(up) > 1 else up[0]) / impact.speed
    slid = float(np.abs(kept).max()) / (simulation_mass * max(impact.speed, impact.slide))
    return Outcome(gained, unbooked, (start.total - energy.total) / scale, given_back, slid)


def _mass(simulation: withe.Simulation) -> float:
    copy = simulation.copy()
    for rod in copy.rods:
        copy.set_velocities(rod, np.tile((1.0, 0.0, 0.0), (len(copy.positions(rod)), 1)))
    return float(copy.momentum().linear[0])


def _centre_velocity(velocities: np.ndarray) -> np.ndarray:
    return np.asarray((0.5 * (velocities[1:] + velocities[:-1])).mean(axis=0))


def main() -> None:
    """A line an integrator, over all cases; and the loss of one elastic impact by step."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=300)
    impacts = [draw(number) for number in range(parser.parse_args().cases)]
    for integrator in INTEGRATORS:
        elastic = [run(impact, integrator) for impact in impacts]
        print(
            f"{integrator}: {len(impacts)} elastic impacts gain at most {max(o.gained for o in elastic):.1e} of their "
            f"energy, {max(o.unbooked for o in elastic):.1e} beside what is booked, lose {np.median([o.lost for o in elastic]):.1e} "
            f"(median), {max(o.lost for o in elastic):.1e} (most), and change what slides by {max(o.slid for o in elastic):.1e}"
        )
        worst = np.argsort([-o.gained for o in elastic])[:5]
        print("   most gain:", [(int(i), f"{elastic[i].gained:.1e}") for i in worst])
        worst = np.argsort([-o.unbooked for o in elastic])[:5]
        print("   unbooked:", [(int(i), f"{elastic[i].unbooked:.1e}") for i in worst])
        worst = np.argsort([-o.lost for o in elastic])[:8]
        print("   lost:", [(int(i), impacts[i].kind, impacts[i].lay, f"{elastic[i].lost:.1e}") for i in worst])
        for restitution in (0.3, 0.5, 0.8):
            off = [
                run(impact, integrator, restitution, gravity=False).given_back / restitution - 1.0
                for impact in impacts
                if impact.even
            ]
            worst = np.argsort(-np.abs(off))[:5]
            print(f"   restitution {restitution}: at most {np.abs(off).max():.2%} off", [([i for i in impacts if i.even][w].number, f"{off[w]:.3%}") for w in worst])


if __name__ == "__main__":
    main()
