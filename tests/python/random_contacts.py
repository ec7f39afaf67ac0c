"""Scenes in which a rod meets what moves, drawn from a number, and their gradients against differences.

python tests/python/random_contacts.py FIRST LAST checks more of them than the tests do.
"""

from __future__ import annotations

import sys
import warnings
from itertools import count

import numpy as np

import withe
from gradient_scenes import TIGHT, move_with_directors

MODULUS, DENSITY = 1e6, 1200.0
ROUNDING = 1e-13  # of what is differentiated, in steps solved to 1e-13
LAWS = ("none", "implicit", "lagged", "directed", "scaly")
INTEGRATORS = ("backward_euler", "implicit_midpoint", "energy_momentum")
OBSTACLES = ("plane", "sphere", "capsule", "post", "rod")
SUPPORTS = ("none", "none", "none", "frame", "edge", "pin", "hand", "yielding hand")
STIFFNESS = np.array((300.0, 400.0, 500.0, 0.2, 0.3, 0.25))


class Drawn:
    """A rod that flies at one or two obstacles or a rod, free or held, with a branch or none; all of it may move."""

    def __init__(self, number):
        self.random = random = np.random.default_rng(number)
        self.planar = bool(random.random() < 0.35)
        self.flat = np.array((1, 0 if self.planar else 1, 1))
        self.law, self.integrator = str(random.choice(LAWS)), str(random.choice(INTEGRATORS))
        self.nodes, self.radius = int(random.integers(6, 13)), float(random.choice([5e-3, 1e-2]))
        self.tolerance = self.radius * float(random.choice([0.2, 0.4]))
        friction = 0.0 if self.law == "none" else float(random.uniform(0.1, 0.8))
        directions = {"directed": (1.0, 1.7), "scaly": (1.0, 1.4, 1.7)}.get(self.law)
        self.friction = friction if directions is None else tuple(friction * share for share in directions)
        self.scene = withe.Scene()
        viscosity = float(random.choice([0.0, 100.0]))
        self.material = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.4, density=DENSITY, viscosity=viscosity)
        s, bent = np.linspace(0.0, 1.0, self.nodes), 0.03 * random.normal(size=2)
        out = 0.0 * s if self.planar else bent[0] * np.sin(3.0 * s)
        self.points = np.stack([0.3 * s, out, bent[1] * s * (1.0 - s)], 1)
        kinds = random.choice(OBSTACLES, size=int(random.integers(1, 3)), replace=False)
        self.obstacles = [made for kind in kinds if (made := self._add_obstacle(kind)) is not None]
        self.arm = self.scene.add_rod(points=self.points, radius=self.radius, material=self.material, name="arm")
        self.support = self._add_support()
        self.branched = random.random() < 0.3
        if self.branched:
            self._add_branch()
        self.simulation = self._build()
        self.start = self.simulation.snapshot()

    def _add_obstacle(self, kind):
        """Below the rod, near it; nothing for a rod that lies across a planar scene."""
        random, scene = self.random, self.scene
        gap = self.radius * float(random.uniform(0.02, 0.6)) + 0.2 * self.tolerance
        at = int(random.integers(2, self.nodes - 1))
        top = self.points[at - 1 : at + 2, 2].min() - self.radius - gap - 3e-3
        x, y = self.points[at, 0], self.points[at, 1]
        along = np.array((0.01 * random.normal(), 0.1, 0.01 * random.normal())) * (1, 1, 1)
        if self.planar:
            along[[0, 2]] = 0.0
        if kind == "plane":
            normal = np.array((0.1 * random.normal(), 0.1 * random.normal(), 1.0)) * self.flat
            normal /= np.linalg.norm(normal)
            distance = (self.points @ normal).min() - self.radius - gap
            return scene.add_plane(distance * normal, normal, friction=self.friction)
        if kind == "sphere":
            size = float(random.choice([0.02, 0.06]))
            return scene.add_sphere((x, y, top - size), size, friction=self.friction)
        if kind == "rod":
            if not self.planar:
                middle = np.array((x, y, top - self.radius))
                rod = scene.add_rod(
                    start=middle - along, end=middle + along, nodes=6, radius=self.radius, material=self.material
                )
                scene.clamp(rod.start)
            return None
        size = 0.03 if kind == "capsule" else 8e-3
        middle = np.array((x, y, top - size))
        return scene.add_capsule(middle - along, middle + along, size, friction=self.friction)

    def _add_support(self):
        kind, scene, arm = str(self.random.choice(SUPPORTS)), self.scene, self.arm
        self.held = {"none": [], "frame": [0], "edge": [0, 1], "pin": [0]}.get(kind)
        if kind == "frame":
            return scene.clamp(arm.start)
        if kind == "edge":
            return scene.clamp(arm.start, hold="edge")
        if kind == "pin":
            return scene.pin(arm.start)
        return (
            None
            if kind == "none"
            else scene.grasp(arm, 0.25, 0.03, **({"stiffness": STIFFNESS} if " " in kind else {}))
        )

    def _add_branch(self):
        node, kind = int(self.random.integers(1, self.nodes - 1)), str(self.random.choice(["rigid", "pinned"]))
        tip = self.points[node] + (0.02, 0.0 if self.planar else 0.05, 0.1)
        branch = self.scene.add_rod(
            start=self.points[node], end=tip, nodes=4, radius=0.7 * self.radius, material=self.material
        )
        self.scene.join(self.arm.node(node), branch.start, kind)

    def _build(self):
        random = self.random
        self.slip_tolerance = 1e-3 if self.law == "none" else float(random.choice([1e-2, 0.1]))
        self.scene.enable_contact(
            stiffness=float(random.choice([3e4, 2e5])),
            distance_tolerance=self.tolerance,
            friction=0.0 if self.law in ("directed", "scaly") else self.friction,
            slip_tolerance=self.slip_tolerance,
            friction_model="lagged" if self.law == "lagged" else "implicit",
        )
        self.time_step, self.steps = float(random.choice([1e-3, 2e-3])), 2 * int(random.integers(5, 11))
        simulation = self.scene.build(
            integrator=self.integrator,
            planar=self.planar or None,
            time_step=self.time_step,
            adaptive=False,
            **TIGHT,
        )
        self.velocity = np.zeros((self.nodes, 3))
        speed = np.array((0.3 * random.normal(), 0.2 * random.normal(), -0.05 - 0.5 * abs(random.normal())))
        if self.support is None:
            self.velocity[:] = speed * self.flat
        simulation.set_velocities(self.arm, self.velocity)
        names = [*self.obstacles, *([] if self.support is None else [self.support])]
        ways = 4e-3 * random.normal(size=(len(names), 3)) * self.flat
        self.targets = [(body, simulation.get(body, "position") + way) for body, way in zip(names, ways, strict=True)]
        return simulation

    def run(self, displaced=None, way=0.0, **options):
        """All that may move sets out before the third step. `displaced`: whose target is elsewhere, by `way`."""
        steps = count()

        def before_step(simulation):
            if next(steps) == 2:
                for i, (body, target) in enumerate(self.targets):
                    over = 0.6 * self.steps * self.time_step * (i % 2 == 0)
                    simulation.move(body, position=target + (way if i == displaced else 0.0), over=over)

        duration = self.steps * self.time_step
        return self.simulation.run(duration, 0.5 * duration, before_step=before_step, progress=False, **options)

    def cases(self, found, random):
        """Names, derivatives along a direction, how to change it before a run or in it, and by about how much."""
        sim, arm, rows = self.simulation, self.arm, self.arm.rows
        way = random.normal(size=(self.nodes, 3)) * self.flat
        yield "youngs_modulus", found[0] * MODULUS, lambda h: sim.set(arm, youngs_modulus=MODULUS * (1.0 + h)), 3e-5
        yield "density", found[1] * DENSITY, lambda h: sim.set(arm, density=DENSITY * (1.0 + h)), 3e-5
        yield "gravity", found[2][2], lambda h: sim.set(None, gravity=(0.0, 0.0, -9.81 + h)), 4e-4
        tolerance = self.slip_tolerance
        yield (
            "slip_tolerance",
            found[3] * tolerance,
            lambda h: sim.set(None, slip_tolerance=tolerance * (1.0 + h)),
            1e-4,
        )
        if self.held is not None and not self.branched:
            way[self.held] = 0.0
            speeds, places = (float((by[rows] * way).sum()) for by in found[4:6])
            yield "initial_velocities", speeds, lambda h: sim.set_velocities(arm, self.velocity + h * way), 2e-6
            if self.support is None:
                yield "initial_positions", places, lambda h: move_with_directors(sim, arm, h * way), 4e-8
        if len(found) > 6:
            along = np.array((1.0, 0.7, -0.4))[: np.size(self.friction)].reshape(np.shape(self.friction))
            now, first = np.asarray(self.friction), self.obstacles[0]
            yield "friction", np.sum(found[6] * along), lambda h: sim.set(first, friction=now + h * along), 1e-5

    def errors(self):
        """Relative differences of all derivatives of a weighted sum of positions and velocities, by their names."""
        random, sim = np.random.default_rng(self.nodes), self.simulation
        wrt = [(self.arm, "youngs_modulus"), (self.arm, "density"), "gravity", "slip_tolerance"]
        wrt += ["initial_velocities", "initial_positions"]
        if np.max(self.friction) > 0.0 and self.obstacles:
            wrt.append((self.obstacles[0], "friction"))
        record = self.run(differentiable=True)
        weights = random.normal(size=(2, *record.positions().shape)) * self.flat
        weights[1] *= 0.01
        found = record.gradient({"positions": weights[0], "velocities": weights[1]}, wrt)

        def of(change=None, **displaced):
            sim.restore(self.start)
            if change is not None:
                change()
            other = self.run(**displaced)
            return float((weights[0] * other.positions()).sum() + (weights[1] * other.velocities()).sum())

        out = {}
        for name, exact, change, size in self.cases(found, random):
            out[name] = least_error(exact, lambda h, change=change: of(lambda: change(h)), size)
        for i, call in enumerate(found.calls):
            way = random.normal(size=3) * self.flat
            exact = float(call.gradients["position"] @ way)
            out[call.target] = least_error(exact, lambda h, i=i, way=way: of(displaced=i, way=h * way), 1e-7)
        return out


def least_error(exact, of, about):
    """Between a derivative and extrapolated differences of several sizes, beyond what rounding makes of these.

    Contacts pass from class to class within some runs, where differences are those of another function; so the least.
    """
    errors = []
    for size in (about, 3.0 * about, about / 4.0, about / 20.0, about / 100.0):
        wide, near = ((of(h) - of(-h)) / (2.0 * h) for h in (2.0 * size, size))
        expected = (4.0 * near - wide) / 3.0
        beyond = max(abs(exact - expected) - ROUNDING / size, 0.0)
        errors.append(beyond / max(abs(expected), abs(exact)) if beyond > 0.0 else 0.0)
        if errors[-1] < 1e-6:
            break
    return min(errors)


def drawn(number):
    """A scene; None where it cannot be drawn or run, or has no gradient, for it stiffened or is pressed too deep."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            scene = Drawn(number)
            scene.run(differentiable=True).gradient(
                {"positions": np.zeros((3, *scene.simulation.positions().shape))}, []
            )
        except (ValueError, withe.ConvergenceError):
            return None
        scene.simulation.restore(scene.start)
        return scene


if __name__ == "__main__":
    checked = 0
    for number in range(int(sys.argv[1]), int(sys.argv[2])):
        scene = drawn(number)
        if scene is None:
            continue
        checked += 1
        wrong = {name: error for name, error in scene.errors().items() if error > 1e-5}
        if wrong:
            print(number, scene.integrator, scene.law, wrong, flush=True)
    print(f"{checked} scenes checked")
