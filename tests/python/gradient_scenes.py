"""Scenes with everything that has a gradient, and central differences of what they do."""

from typing import ClassVar

import numpy as np

import withe

TIGHT = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
NODES = 11


def extrapolated(of, size):
    """Central difference at zero, of fourth order."""
    wide, near = ((of(h) - of(-h)) / (2.0 * h) for h in (2.0 * size, size))
    return (4.0 * near - wide) / 3.0


class Drawn:
    """A curved arm, alone or with a branch, in a plane or in space, with everything that can be set."""

    HINGE: ClassVar = {"stiffness": 0.03, "rest_angle": 0.4, "moment": 4e-3}

    def __init__(self, *, planar, joint, integrator, support="frame", viscosity=0.0, radius=1.5e-2, **options):
        self.planar, self.support, self.damping = planar, support, None
        scene = withe.Scene()
        material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=viscosity)
        s = np.linspace(0.0, 1.0, NODES)
        points = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
        self.arm = scene.add_rod(points=points, radius=radius, material=material, name="arm")
        self.wall = None
        if support == "frame":
            self.wall = scene.clamp(self.arm.start)
        elif support == "edge":
            self.wall = scene.clamp(self.arm.start, hold="edge")
        if joint:
            tip = points[6] + [0.02, 0.0 if planar else 0.1, 0.1]
            branch = scene.add_rod(start=points[6], end=tip, nodes=5, radius=0.7 * radius, material=material)
            kind = joint if isinstance(joint, str) else "rigid"
            turns = {}
            if kind == "revolute":
                axis = (0.0, -1.0, 0.0) if planar else (0.2, 0.9, -0.3)
                self.damping = 0.0 if integrator in ("fourth_order", "static") else 2e-3
                turns = {"axis": axis, "damping": self.damping, **self.HINGE}
            self.hinge = scene.join(self.arm.node(6), branch.start, kind, **turns)
        self.force = scene.add_force(self.arm.end, (0, 0, 0.3 * (radius / 1.5e-2) ** 4), name="force")
        self.mass = scene.add_mass(self.arm.node(7), 0.01)
        self.drag = scene.add_drag(0.2)
        damping = 0.0 if integrator == "fourth_order" else 0.5
        ends = self.arm.node(3), self.arm.node(9)
        self.spring = scene.add_spring(*ends, stiffness=20.0, rest_length=0.1, damping=damping)
        self.tension = 0.4 * (radius / 1.5e-2) ** 4
        offset = (0.0, radius) if planar else (0.6 * radius, 0.8 * radius)
        self.tendon = scene.add_tendon(self.arm, offset=offset, tension=self.tension)
        self.simulation = scene.build(integrator=integrator, planar=planar or None, **TIGHT, **options)

    def vectors(self, random, count):
        """Random vectors of so many nodes, in the plane of a planar scene."""
        out = random.normal(size=(count, 3))
        if self.planar:
            out[:, 1] = 0.0
        return out

    def bent(self, random):
        """A direction in which natural curvature may change."""
        now = self.simulation.get(self.arm, "natural_curvature")
        if not self.planar:
            return random.normal(size=now.shape)
        return np.outer(random.normal(size=len(now)), now[0] / np.linalg.norm(now[0]))


def weighted(record, weights):
    """A scalar of a record: the sum of its read-outs by words, times weights."""
    return float(sum((weight * getattr(record, name)()).sum() for name, weight in weights.items()))


def difference(simulation, of, change, size):
    """Central difference of `of()` over `change(+-size)`, from and back to the present state."""
    start, ends = simulation.snapshot(), []
    for step in (size, -size):
        simulation.restore(start)
        change(step)
        ends.append(of())
    simulation.restore(start)
    return (ends[0] - ends[1]) / (2.0 * size)


def settings(drawn, random):
    """Pairs of what `wrt` says with what its gradient is multiplied by, how to change it, and by how much."""
    sim, arm = drawn.simulation, drawn.arm
    curvature, twist = sim.get(arm, "natural_curvature"), sim.get(arm, "natural_twist")
    bend = sim.get(arm, "bend_stiffness")
    bent, turned = drawn.bent(random), 0.0 if drawn.planar else random.normal(size=twist.shape)
    uneven = random.uniform(0.5, 1.5, size=bend.shape)
    yield (arm, "youngs_modulus"), 1.0, lambda h: sim.set(arm, youngs_modulus=1e6 + h), 100.0
    yield (arm, "density"), 1.0, lambda h: sim.set(arm, density=1200.0 + h), 0.1
    yield (arm, "bend_stiffness"), uneven * bend, lambda h: sim.set(arm, bend_stiffness=bend * (1.0 + h * uneven)), 1e-4
    yield (arm, "natural_curvature"), bent, lambda h: sim.set(arm, natural_curvature=curvature + h * bent), 1e-3
    stretch, longer = sim.get(arm, "natural_stretch"), np.random.default_rng(23).normal(size=NODES - 1)
    yield (arm, "natural_stretch"), longer, lambda h: sim.set(arm, natural_stretch=stretch + h * longer), 1e-4
    yield (arm, "natural_twist"), turned, lambda h: sim.set(arm, natural_twist=twist + h * turned), 1e-3
    yield (drawn.force, "force"), np.array([0, 0, 1.0]), lambda h: sim.set(drawn.force, force=(0, 0, 0.3 + h)), 1e-4
    yield (drawn.mass, "mass"), 1.0, lambda h: sim.set(drawn.mass, mass=0.01 + h), 3e-6
    for word, value, size in (("stiffness", 20.0, 1e-2), ("rest_length", 0.1, 1e-4)):
        yield (drawn.spring, word), 1.0, lambda h, w=word, v=value: sim.set(drawn.spring, **{w: v + h}), size
    yield (drawn.tendon, "tension"), 1.0, lambda h: sim.set(drawn.tendon, tension=drawn.tension + h), 1e-3
    if drawn.damping is not None:
        for word, value in drawn.HINGE.items():
            yield (drawn.hinge, word), 1.0, lambda h, w=word, v=value: sim.set(drawn.hinge, **{w: v + h}), 2e-2 * value
    if drawn.damping:
        yield (drawn.hinge, "damping"), 1.0, lambda h: sim.set(drawn.hinge, damping=drawn.damping + h), 2e-5
    yield "gravity", np.array([0, 0, 1.0]), lambda h: sim.set(None, gravity=(0, 0, -9.81 + h)), 2e-3


def move_with_directors(simulation, rod, way):
    """Nodes moved, directors turned along with their edges by the smallest turn."""
    positions, directors = simulation.positions(rod), simulation.directors(rod)[:, 0]
    spins, velocities = simulation.spins(rod), simulation.velocities(rod)

    def tangents(x):
        e = np.diff(x, axis=0)
        return e / np.linalg.norm(e, axis=1)[:, None]

    before, after = tangents(positions), tangents(positions + way)
    along = np.sum(directors * after, axis=1) / (1.0 + np.sum(before * after, axis=1))
    turned = directors - along[:, None] * (before + after)
    simulation.set_state(rod, positions=positions + way, directors=turned, velocities=velocities, spins=spins)
