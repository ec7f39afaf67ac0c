"""Free scenes for conservation.py, drawn from a number."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import withe

__all__ = ["KINDS", "Case", "draw", "held", "spinning_rod"]

KINDS = ("rod", "joint", "ring", "curl", "contact")


@dataclass(frozen=True)
class Case:
    """A drawn scene: its kind, whether it lies in a plane, whether its material is viscous."""

    number: int
    kind: str
    flat: bool
    viscous: bool

    def _random(self) -> np.random.Generator:
        return np.random.default_rng(1000 + self.number)

    def _scene(self) -> withe.Scene:
        r = self._random()
        scene = withe.Scene(gravity=(0, 0, 0))
        length, slenderness = 10.0 ** r.uniform(-1.5, 0.0), 10.0 ** r.uniform(1.3, 2.3)
        material = withe.Material(
            youngs_modulus=10.0 ** r.uniform(5.5, 7.5), poisson_ratio=r.uniform(0.2, 0.5), density=1000.0,
            viscosity=10.0 ** r.uniform(1.0, 3.0) if self.viscous else 0.0,
        )  # fmt: skip
        options = {"material": material, "radius": length / slenderness}
        out = 0.0 if self.flat else 1.0
        count = int(r.integers(6, 25))
        s = np.linspace(0.0, 1.0, count)
        bend = r.uniform(0.1, 0.6)
        arc = length * np.stack([s - 0.5, out * 0.3 * bend * s**3, bend * s**2], axis=1)
        if self.kind in ("rod", "joint"):
            body = scene.add_rod(points=arc, natural="as_built", **options)
        if self.kind == "joint":
            up = np.array((0.1, 0.3 * out, 1.0))
            limb = scene.add_rod(
                start=arc[-1], end=arc[-1] + 0.6 * length * up, nodes=max(count // 2, 4), **options
            )  # fmt: skip
            kind = ("rigid", "pinned", "revolute")[self.number // 5 % 3]
            scene.join(body.end, limb.start, kind, **({"axis": (0, 1, 0)} if kind == "revolute" else {}))
        elif self.kind == "ring":
            angle = 2.0 * np.pi * np.arange(count) / count
            ring = 0.3 * length * np.stack([np.cos(angle), 0.2 * out * np.sin(2.0 * angle), np.sin(angle)], axis=1)
            scene.add_rod(points=ring, closed=True, **options)
        elif self.kind == "curl":
            scene.add_rod(points=arc, natural="straight", **options)
        elif self.kind == "contact":
            first = length * np.stack([s - 0.5, 0.0 * s, 0.0 * s], axis=1)
            gap = np.array((0.1 * length, 0.0, 5.0 * options["radius"]))
            turn = np.array((0.8, 0.6 * out, 0.1))
            scene.add_rod(points=first, name="lower", **options)
            scene.add_rod(
                points=length * np.outer(s - 0.5, turn) + gap + (0, 0, 0.05 * length), name="upper", **options
            )
            scene.enable_contact()
        return scene

    @cached_property
    def period(self) -> float:
        """Period of the slowest elastic mode of the scene as drawn [s]."""
        simulation = self._scene().build(planar=self.flat or None)
        count = len(simulation.linearise().mass)
        frequencies = simulation.linearise().frequencies(count)
        elastic = frequencies[frequencies > 1e-5 * frequencies[-1]]  # the rest move as bodies or mechanisms
        return float(1.0 / elastic[0])

    def build(self, integrator: str, time_step: float, *, tight: bool = False) -> tuple[withe.Simulation, float]:
        """The scene in flight, and its mass [kg]."""
        scene = self._scene()
        sharp = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13)} if tight else {}
        simulation = scene.build(integrator=integrator, time_step=time_step, planar=self.flat, **sharp)
        r = self._random()
        positions = simulation.positions()
        size = float(np.ptp(positions, axis=0).max())
        simulation.set_velocities(None, np.broadcast_to((1.0, 0.0, 0.0), positions.shape))
        mass = float(simulation.momentum().linear[0])
        rate = r.uniform(0.3, 2.0) / self.period  # up to a third of a turn a period
        omega = rate * r.normal(size=3)
        drift = rate * size * r.normal(size=3)
        strain = 0.1 * rate * r.normal(size=(3, 3))
        if self.flat:
            omega *= (0, 1, 0)
            drift[1] = strain[1] = 0.0
        velocities = np.cross(omega, positions) + drift + positions @ strain.T
        if self.kind == "contact":
            upper = scene.rods[1].rows
            velocities[upper] -= (0.0, 0.0, 0.5 * size * rate)
        simulation.set_velocities(None, velocities)
        return simulation, mass


def draw(number: int) -> Case:
    """A case: all kinds in turn, in a plane and in space, viscous and not."""
    kind = KINDS[number % 5]
    return Case(number, kind, flat=number // 5 % 2 == 0, viscous=number // 10 % 2 == 1)


def spinning_rod(integrator: str, periods: float, steps: int) -> tuple[withe.Simulation, withe.Rod, np.ndarray, float]:
    """A bent rod that turns in its plane, its mass matrix (nodes, nodes) [kg], and its turn's period [s].

    Edges of mass m couple their nodes by m / 6 [[2, 1], [1, 2]] [any textbook on finite elements].
    """
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=1e6, density=1000.0)
    s = np.linspace(-0.15, 0.15, 13)
    points = np.stack([s, 0.0 * s, 1.5 * s**2], axis=1)
    rod = scene.add_rod(points=points, radius=5e-3, material=material)
    rate = 8.0
    period = 2.0 * np.pi / rate
    simulation = scene.build(
        integrator=integrator,
        time_step=periods * period / steps,
        planar=True,
        adaptive=False,
        solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
    )
    simulation.set_velocities(rod, np.cross((0.0, rate, 0.0), points) + np.array((0.02, 0.0, -0.01)))
    mass = np.zeros((13, 13))
    for edge, length in enumerate(np.linalg.norm(np.diff(points, axis=0), axis=1)):
        mass[edge : edge + 2, edge : edge + 2] += 1000.0 * np.pi * 5e-3**2 * length / 6.0 * np.array([[2, 1], [1, 2]])
    return simulation, rod, mass, period


def held(number: int, integrator: str, time_step: float) -> withe.Simulation:
    """A conservative robot that falls from rest: three rods from a clamp or a pin, in joints, on hinges and tendons.

    Nothing is viscous, nothing drags or rubs, and what holds it stands still.
    """
    r = np.random.default_rng([62, number])
    scene = withe.Scene(gravity=6.0 * r.normal(size=3))

    def curve(start: np.ndarray, length: float, nodes: int) -> np.ndarray:
        s = np.linspace(0.0, 1.0, nodes)[:, None]
        way, bow = r.normal(size=(2, 3))
        return start + length * (s * way / np.linalg.norm(way) + 0.15 * s**2 * bow)

    trunk = curve(np.zeros(3), 0.2, int(r.integers(6, 14)))
    rods = []
    for points in (
        trunk,
        curve(trunk[-1], 0.15, int(r.integers(5, 10))),
        curve(trunk[-1], 0.12, int(r.integers(5, 9))),
    ):
        width, height = r.uniform(5e-3, 1e-2, 2)
        material = withe.Material(
            youngs_modulus=10.0 ** r.uniform(5.3, 6.5), poisson_ratio=r.uniform(0.2, 0.5), density=r.uniform(800, 1500)
        )
        section = withe.Rectangle(width=width, height=height) if r.random() < 0.5 else withe.Circle(radius=0.5 * width)
        curvature = r.normal(0.0, 3.0, (len(points) - 2, 2)) if r.random() < 0.5 else None
        rods.append(scene.add_rod(points=points, section=section, material=material, natural_curvature=curvature))
    (scene.clamp if number % 3 else scene.pin)(rods[0].start)
    kind = ("rigid", "pinned", "revolute")[number % 3]
    for arm in rods[1:]:
        if kind == "revolute":
            spring = {"stiffness": 10.0 ** r.uniform(-4.0, -1.5), "rest_angle": r.uniform(-0.5, 0.5)}
            scene.join(rods[0].end, arm.start, kind, axis=r.normal(size=3), **spring)
        else:
            scene.join(rods[0].end, arm.start, kind)
    scene.add_mass(rods[1].end, r.uniform(0.0, 5e-3))
    if r.random() < 0.5:
        scene.add_tendon(rods[0], offset=r.uniform(-4e-3, 4e-3, 2), tension=r.uniform(0.05, 0.5))
    if r.random() < 0.5:
        scene.add_spring(rods[1].end, rods[2].end, stiffness=10.0 ** r.uniform(-1.0, 1.0), rest_length=0.1)
    return scene.build(integrator=integrator, time_step=time_step, planar=False)
