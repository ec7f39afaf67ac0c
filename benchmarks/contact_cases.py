"""Scenes of the stress test of contact: drawn by number from a fixed seed.

Stiffness, size, slenderness, friction, speed and step are drawn over the whole range that the package promises to bear,
most of them evenly in their logarithms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import withe

__all__ = ["KINDS", "LAWS", "METHODS", "ContactCase", "build", "draw_case"]

SEED = 20_260_311
KINDS = ("floor", "crossing", "post", "pile", "knot")
METHODS = ("backward_euler", "energy_momentum")
LAWS = ("implicit", "lagged", "anchored")
STEPS = 60


@dataclass(frozen=True)
class ContactCase:
    """One case.

    Attributes
    ----------
    number : int
    kind : str
        A rod thrown on a floor, two that cross and are thrown at each other, one thrown on a post, rods dropped in a
        pile, or a knot pulled past tight.
    method, law : str
        Integrator and model of friction.
    youngs_modulus : float [Pa]
    radius, length : float [m]
    nodes, count : int
        Of a rod; rods of a pile.
    friction : float
    speed : float [m/s]
        Of the impact; a knot is pulled tight within the time simulated.
    coarseness : float
        Time step over a five-hundredth of the slowest period of a free rod.
    """

    number: int
    kind: str
    method: str
    law: str
    youngs_modulus: float
    radius: float
    length: float
    nodes: int
    count: int
    friction: float
    speed: float
    coarseness: float

    @property
    def period(self) -> float:
        """Period of the slowest bending mode of a free rod [s]."""
        stiffness = self.youngs_modulus * math.pi * self.radius**4 / 4.0
        return 2.0 * math.pi / 22.373 * self.length**2 * math.sqrt(1000.0 * math.pi * self.radius**2 / stiffness)

    @property
    def time_step(self) -> float:
        """Time step [s]."""
        return 0.002 * self.coarseness * self.period


def draw_case(number: int) -> ContactCase:
    """The case of a number: always the same."""
    rng = np.random.default_rng([SEED, number])

    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    kind = KINDS[number % len(KINDS)]
    radius = log(1e-4, 0.02)
    slenderness = log(400.0, 700.0) if kind == "knot" else log(10.0, 200.0)
    return ContactCase(
        number=number,
        kind=kind,
        method=str(rng.choice(METHODS)),
        law=str(rng.choice(LAWS)),
        youngs_modulus=log(1e5, 1e10),
        radius=radius,
        length=radius * slenderness,
        nodes=round(slenderness / rng.uniform(0.8, 2.0)) if kind == "knot" else round(log(4, 60)),
        count=int(rng.integers(4, 12)),
        friction=float(rng.uniform(0.0, 1.0)),
        speed=log(0.1, 100.0),
        coarseness=log(1.0, 100.0),
    )


def build(case: ContactCase) -> withe.Simulation:
    """The simulation of a case as it starts."""
    gravity = 9.8 if case.kind == "pile" else 0.0
    scene = withe.Scene(gravity=(0.0, 0.0, -gravity))
    throw = {"floor": _floor, "crossing": _crossing, "post": _post, "pile": _pile, "knot": _knot}[case.kind]
    rods = throw(case, scene)
    scene.enable_contact(friction=case.friction, friction_model=case.law)
    simulation = scene.build(integrator=case.method, time_step=case.time_step)
    for rod, velocity in rods:
        simulation.set_velocities(rod, np.tile(velocity, (case.nodes, 1)))
    if case.kind == "knot":
        _pull(case, simulation)
    return simulation


def _straight(case: ContactCase, scene: withe.Scene, middle: np.ndarray, direction: np.ndarray) -> withe.Rod:
    half = 0.5 * case.length * direction / np.linalg.norm(direction)
    material = withe.Material(youngs_modulus=case.youngs_modulus, poisson_ratio=0.5, density=1000.0)
    return scene.add_rod(
        start=middle - half, end=middle + half, nodes=case.nodes, radius=case.radius, material=material
    )


def _random(case: ContactCase) -> np.random.Generator:
    return np.random.default_rng([SEED, case.number, 1])


Thrown = list[tuple[withe.Rod, np.ndarray]]


def _floor(case: ContactCase, scene: withe.Scene) -> Thrown:
    """Slanted, down and along."""
    rng = _random(case)
    direction = np.array([1.0, 0.0, rng.uniform(-1.0, 1.0)])
    height = 0.5 * case.length * abs(direction[2]) / np.linalg.norm(direction) + 1.5 * case.radius
    scene.add_floor(friction=case.friction)
    rod = _straight(case, scene, np.array([0.0, 0.0, height]), direction)
    return [(rod, case.speed * np.array([rng.uniform(-1.0, 1.0), 0.0, -1.0]))]


def _crossing(case: ContactCase, scene: withe.Scene) -> Thrown:
    """At any angle, almost parallel too."""
    angle = _random(case).uniform(0.0, math.pi)
    gap = np.array([0.0, 0.0, 1.3 * case.radius])
    below = _straight(case, scene, -gap, np.array([1.0, 0.0, 0.0]))
    above = _straight(case, scene, gap, np.array([math.cos(angle), math.sin(angle), 0.0]))
    return [(below, np.array([0.0, 0.0, 0.5 * case.speed])), (above, np.array([0.0, 0.0, -0.5 * case.speed]))]


def _post(case: ContactCase, scene: withe.Scene) -> Thrown:
    """Off its middle, on a post as thick as a few rods."""
    rng = _random(case)
    size = case.radius * rng.uniform(1.0, 5.0)
    reach = 2.0 * case.length
    scene.add_capsule((0.0, -reach, 0.0), (0.0, reach, 0.0), size, friction=case.friction)
    place = np.array([rng.uniform(-0.3, 0.3) * case.length, 0.0, size + 1.5 * case.radius])
    rod = _straight(case, scene, place, np.array([1.0, rng.uniform(-0.5, 0.5), 0.0]))
    return [(rod, np.array([0.0, 0.0, -case.speed]))]


def _pile(case: ContactCase, scene: withe.Scene) -> Thrown:
    """One above the other, each turned, dropped."""
    rng = _random(case)
    scene.add_floor(friction=case.friction)
    for k in range(case.count):
        angle = rng.uniform(0.0, math.pi)
        place = np.array([*rng.uniform(-0.1, 0.1, 2) * case.length, (1.5 + 2.5 * k) * case.radius])
        _straight(case, scene, place, np.array([math.cos(angle), math.sin(angle), 0.0]))
    return []


def _knot(case: ContactCase, scene: withe.Scene) -> Thrown:
    """A loose overhand knot, its ends in grips."""
    points = withe.knots.overhand_knot(
        1 + case.number % 2, length=case.length, radius=case.radius, shortening=0.6 * case.length, nodes=case.nodes
    )
    material = withe.Material(youngs_modulus=case.youngs_modulus, poisson_ratio=0.5, density=1000.0)
    rope = scene.add_rod(points=points, radius=case.radius, material=material, natural="straight", name="rope")
    scene.clamp(rope.start, hold="edge", name="left")
    scene.clamp(rope.end, hold="edge", name="right")
    return []


def _pull(case: ContactCase, simulation: withe.Simulation) -> None:
    """Until ten diameters are left: less than a knot needs."""
    x = simulation.positions("rope")
    apart = float(np.linalg.norm(x[-1] - x[0]))
    axis = (x[-1] - x[0]) / apart
    way = 0.5 * (case.length - 20.0 * case.radius - apart) * axis
    duration = STEPS * case.time_step
    simulation.move("left", position=x[0] - way, over=duration)
    simulation.move("right", position=x[-1] + way, over=duration)
