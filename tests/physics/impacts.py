"""Drawn impacts: rods that drop, meet head on or graze, over two decades of steps.

    python tests/physics/impacts.py [--cases COUNT]

What each integrator gains and gives back in more of them than the tests have time for, and how fast its loss in an
elastic impact falls with the step.
"""

from __future__ import annotations

import argparse
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import withe

KINDS = ("drop", "head_on", "graze")
LAYS = ("parallel", "crossed", "tilted")
CONSERVING = ("energy_momentum", "implicit_midpoint")
INTEGRATORS = (*CONSERVING, "backward_euler")
DEPTH = 0.01  # to which an impact presses surfaces, over the radius


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
    def least_time(self) -> float:
        """Half a swing of an edge on its contact, which lasts as long at least [s]."""
        return float(np.pi * DEPTH * self.radius / self.speed)

    @property
    def even(self) -> bool:
        """True if all edges meet at the same time, so that no vibration takes energy."""
        return self.lay == "parallel" and (self.on_floor or self.kind != "graze")

    def build(
        self, integrator: Any, restitution: float = 1.0, gravity: bool = True, **options: Any
    ) -> withe.Simulation:
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
            aside = 0.0 if self.lay == "parallel" else random.uniform(-0.3, 0.3) * length
            off = np.array((aside, 0.0, 0.0)) + apart
            half = 0.5 * length
            rods = [
                scene.add_rod(start=(-half, 0.0, -apart[2]), end=(half, 0.0, -apart[2]), **shape),
                scene.add_rod(start=off - half * along, end=off + half * along, **shape),
            ]
            scene.enable_contact(restitution=restitution)
        simulation = scene.build(integrator=integrator, time_step=self.time_step, **options)
        if not falls:
            relative = np.array((self.slide, 0.3 * self.slide, -self.speed))
            share = random.uniform(0.0, 1.0)
            for rod, part in zip(rods, (1.0,) if self.on_floor else (share - 1.0, share), strict=True):
                simulation.set_velocities(rod, np.tile(part * relative, (shape["nodes"], 1)))
        return simulation

    def duration(self, *, falls: bool) -> float:
        """Until surfaces have parted again [s]."""
        way = 2.2 * self.speed / 9.81 if falls else 2.5 * self.gap / self.speed
        return way + 8.0 * (self.least_time + self.time_step)


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
    speed = (2.0 * 9.81 * radius * log(0.1, 5.0)) ** 0.5 if kind == "drop" else log(0.05, 5.0)
    slide = speed * random.uniform(0.3, 3.0) if kind == "graze" else 0.0
    impact = Impact(number, kind, lay, log(1e5, 1e8), radius, speed, radius * log(0.03, 0.5), slide, 0.0)
    return replace(impact, time_step=impact.least_time * log(0.1, 10.0))


@dataclass(frozen=True)
class Outcome:
    """Result of an impact, relative to the greatest kinetic energy during it."""

    gained: float  # greatest energy above that at the start
    unbooked: float  # greatest error of energy plus dissipation
    lost: float  # energy at the end
    given_back: float  # speed at which centres of mass part, over that at which they came
    slid: float  # momentum along a floor, or all of two rods, over what there is: by how much it changed


def run(impact: Impact, integrator: Any, restitution: float = 1.0, gravity: bool = True) -> Outcome:
    """Lets it happen."""
    simulation = impact.build(integrator, restitution, gravity)
    start, before = simulation.energy(), simulation.momentum().linear
    gained = unbooked = -np.inf
    most = start.kinetic
    while simulation.time < impact.duration(falls=impact.kind == "drop" and gravity):
        simulation.step()
        energy = simulation.energy()
        most = max(most, energy.kinetic)
        gained = max(gained, energy.total - start.total)
        unbooked = max(unbooked, abs(energy.total + energy.dissipated - energy.work - start.total))
    change = simulation.momentum().linear - before
    if impact.on_floor:
        change = change[:2]
    up = [float((0.5 * (v[1:, 2] + v[:-1, 2])).mean()) for v in map(simulation.velocities, simulation.rods)]
    given_back = (up[-1] - up[0] if len(up) > 1 else up[0]) / impact.speed
    slid = float(np.abs(change).max()) / (2.0 * most / max(impact.speed, impact.slide))
    return Outcome(gained / most, unbooked / most, (start.total - energy.total) / most, given_back, slid)


def report(integrator: Any, impacts: list[Impact]) -> None:
    """Print the results of an integrator."""
    elastic = [run(impact, integrator) for impact in impacts]
    print(f"{integrator}, {len(impacts)} elastic impacts:")
    for what in ("gained", "unbooked", "lost", "slid"):
        values = np.array([getattr(outcome, what) for outcome in elastic])
        worst = impacts[int(values.argmax())]
        print(f"  {what}: {np.median(values):.1e} (median), {values.max():.1e} at most, by {worst}")
    even = [impact for impact in impacts if impact.even]
    for restitution in (0.3, 0.5, 0.8):
        off = np.abs([run(i, integrator, restitution, gravity=False).given_back / restitution - 1.0 for i in even])
        print(f"  restitution {restitution}: {np.median(off):.2%} off (median), {off.max():.2%} at most")


def losses(impact: Impact, integrator: Any, steps: list[float]) -> np.ndarray:
    """Energy losses in one elastic impact, for steps relative to the shortest duration of an impact."""
    return np.array([run(replace(impact, time_step=step * impact.least_time), integrator).lost for step in steps])


def main() -> None:
    """All cases by all integrators, and the order at which crossed rods lose less."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=300)
    impacts = [draw(number) for number in range(parser.parse_args().cases)]
    warnings.simplefilter("ignore", withe.CoarseStepWarning)
    for integrator in INTEGRATORS:
        report(integrator, impacts)
    steps = [3.0, 1.0, 0.3, 0.1, 0.03]
    for integrator in CONSERVING:
        for number in (4, 7, 13):
            lost = losses(draw(number), integrator, steps)
            print(f"{integrator}, impact {number}, loss at steps of {steps} of the least time:", lost)


if __name__ == "__main__":
    main()
