"""Robots of several limbs: a crawler on six legs, and a gripper that wraps its limbs around a ball."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe import shapes
from withe.batch import Batch
from withe.learning.task import IntArray, Task
from withe.parts.materials import Material
from withe.scene.scene import Scene
from withe.simulation.simulation import Simulation

__all__ = ["Crawl", "Wrap"]

FloatArray = npt.NDArray[np.float64]


class _Limbs(Task):
    """Limbs whose parts are bent: an action leads each part's change of natural curvature to a share of its most."""

    limbs: tuple[str, ...]
    parts: tuple[slice, ...]  # stencils of a limb that are bent as one
    ways: tuple[tuple[int, int], ...]  # (part, component of curvature) of each number of an action of a limb
    most: float  # change of natural curvature [1/m]
    actions: FloatArray  # last actions, (n, action_size) [-]
    drawn: FloatArray  # natural curvature as it was drawn, (stencils, 2) [1/m]

    def _bend(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        own = actions.reshape(len(chosen), len(self.limbs), len(self.ways))
        for index, limb in enumerate(self.limbs):
            curvature = np.repeat(self.drawn[None], len(chosen), axis=0)
            for number, (part, component) in enumerate(self.ways):
                curvature[:, self.parts[part], component] += self.most * own[:, index, number, None]
            robots.set(limb, natural_curvature=curvature, over=self.control_step, lanes=chosen)
        self.actions[chosen] = actions

    def prepare(self, robots: Batch) -> None:
        """Remembers actions."""
        self.actions = np.zeros((len(robots), self.action_size))

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:
        """As drawn."""
        self.actions[chosen] = 0.0


class Crawl(_Limbs):
    """Crawl along x with a robot of six soft legs that meet in one joint, on a floor with friction.

    Actions: for each leg the sideways and upward bend of the hip and the bend of the knee, as shares of their maxima,
    (18,). Observations: height and velocity of the body; positions of feet and knees relative to the body, and their
    velocities; the last action, (94,). Reward: motion of the body along x in centimetres, minus 0.5 times the sideways
    motion, minus 1 % of the squared action. An episode has 100 steps of 0.1 s.

    Examples
    --------
    >>> env = gymnasium.make("withe/Crawl-v0")  # doctest: +SKIP
    """

    action_size: int = 18
    control_step: float = 0.1
    steps: int = 100
    limbs: tuple[str, ...] = tuple(f"leg {i}" for i in range(6))
    parts: tuple[slice, ...] = (slice(0, 4), slice(6, 10))
    ways: tuple[tuple[int, int], ...] = ((0, 0), (0, 1), (1, 1))
    most: float = 12.0
    length: float = 0.16  # of a leg [m]
    radius: float = 5e-3  # of a leg [m]
    nodes: int = 17  # of a leg
    rise: float = np.radians(35.0)  # slope at the body
    fall: float = np.radians(-80.0)  # slope at the foot
    friction: float = 0.8
    before: FloatArray  # positions of the bodies before the last action, (n, 3) [m]

    def build(self, generator: np.random.Generator) -> Simulation:
        """Build the robot on its feet, as drawn.

        Raises
        ------
        ValueError
            An attribute of a derived class is out of range.
        """
        scene = Scene()
        rubber = Material(youngs_modulus=1.5e7, poisson_ratio=0.5, density=1180.0, viscosity=5.0e4)
        arch = (self.fall - self.rise) / self.length
        self.drawn: FloatArray = np.tile((0.0, arch), (self.nodes - 2, 1))
        rods = []
        for name, azimuth in zip(self.limbs, np.radians([30.0, 90.0, 150.0, 210.0, 270.0, 330.0]), strict=True):
            outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            points = shapes.arc(
                start=(0.0, 0.0, 0.0),
                tangent=np.cos(self.rise) * outward + np.sin(self.rise) * np.array([0.0, 0.0, 1.0]),
                towards=(0.0, 0.0, 1.0),
                curvature=arch,
                length=self.length,
                nodes=self.nodes,
            )
            normal = (-np.sin(azimuth), np.cos(azimuth), 0.0)
            rods.append(scene.add_rod(points=points, normal=normal, radius=self.radius, material=rubber, name=name))
        for rod in rods[1:]:
            scene.join(rods[0].start, rod.start)
        scene.add_floor(float(points[-1, 2]) - self.radius, friction=self.friction)
        return scene.build(integrator="backward_euler", time_step=5e-3)

    def prepare(self, robots: Batch) -> None:
        """Allocate the previous positions of the bodies."""
        super().prepare(robots)
        self.before = np.zeros((len(robots), 3))

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:
        """Store the start of the body at the origin."""
        super().begin(robots, chosen, generators)
        self.before[chosen] = 0.0

    def act(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        """Bend hips and knees."""
        self.before[chosen] = robots.positions(self.limbs[0])[chosen, 0]
        self._bend(robots, actions, chosen)

    def observe(self, robots: Batch) -> FloatArray:
        """Return the body, the feet and knees relative to it, and the last action."""
        places, speeds = [], []
        for limb in self.limbs:
            x, v = robots.positions(limb), robots.velocities(limb)
            places += [x[:, self.nodes // 2] - x[:, 0], x[:, -1] - x[:, 0]]
            speeds += [v[:, self.nodes // 2], v[:, -1]]
        body = np.hstack([x[:, 0, 2:], v[:, 0]])
        return np.hstack([body, *places, *speeds, self.actions])

    def reward(self, robots: Batch) -> FloatArray:
        """Return the reward for the motion along x."""
        way = robots.positions(self.limbs[0])[:, 0] - self.before
        return np.asarray(100.0 * (way[:, 0] - 0.5 * np.abs(way[:, 1])) - 0.01 * np.sum(self.actions**2, axis=1))


class Wrap(_Limbs):
    """Wrap the five hanging limbs of a gripper around a ball, which is at another place in each episode.

    Actions: for each limb the bends of its upper and lower half towards d1 and d2, as shares of their maxima, (20,).
    Observations: positions of five nodes of each limb, position of the ball, the last action, (98,). Reward: the mean
    over nodes in the lower halves of exp(-gap / 1 cm), from 0 (far) to 1 (all touch). An episode has 60 steps of 0.1 s.

    Examples
    --------
    >>> env = gymnasium.make("withe/Wrap-v0")  # doctest: +SKIP
    """

    action_size: int = 20
    control_step: float = 0.1
    steps: int = 60
    redraw: bool = True
    limbs: tuple[str, ...] = tuple(f"limb {i}" for i in range(5))
    parts: tuple[slice, ...] = (slice(0, 10), slice(10, 19))
    ways: tuple[tuple[int, int], ...] = ((0, 0), (0, 1), (1, 0), (1, 1))
    most: float = 25.0
    length: float = 0.3  # of a limb [m]
    radius: float = 5e-3  # of a limb [m]
    nodes: int = 21  # of a limb
    side: float = 0.09  # of the pentagon of the tops of the limbs [m]
    ball: float = 0.04  # radius of the ball [m]
    depth: float = -0.2  # height of the ball [m]
    spread: float = 0.02  # greatest horizontal distance of the ball from the middle [m]
    balls: FloatArray  # positions of the balls, (n, 3) [m]

    def build(self, generator: np.random.Generator) -> Simulation:
        """Build the hanging gripper with the ball somewhere between its limbs."""
        scene = Scene()
        silicone = Material(youngs_modulus=3e5, poisson_ratio=0.5, density=1200.0, viscosity=3e3)
        turns = 2.0 * np.pi * np.arange(5) / 5
        tops = self.side / (2.0 * np.sin(np.pi / 5)) * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
        self.drawn: FloatArray = np.zeros((self.nodes - 2, 2))
        for name, top, turn in zip(self.limbs, tops, turns, strict=True):
            limb = scene.add_rod(
                start=top,
                end=top - np.array([0.0, 0.0, self.length]),
                nodes=self.nodes,
                normal=(np.cos(turn), np.sin(turn), 0.0),
                radius=self.radius,
                material=silicone,
                name=name,
            )
            scene.clamp(limb.start, hold="edge")
        scene.add_drag(0.5)
        aside, turn = self.spread * np.sqrt(generator.random()), 2.0 * np.pi * generator.random()
        scene.add_sphere((aside * np.cos(turn), aside * np.sin(turn), self.depth), self.ball, name="ball")
        scene.enable_contact()
        return scene.build(integrator="backward_euler", time_step=1e-2)

    def prepare(self, robots: Batch) -> None:
        """Allocate the positions of the balls."""
        super().prepare(robots)
        self.balls = np.zeros((len(robots), 3))

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:
        """Store the positions of the balls."""
        super().begin(robots, chosen, generators)
        for lane in chosen:
            self.balls[lane] = robots[int(lane)].obstacle_position("ball")

    def act(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        """Bend both halves of each limb."""
        self._bend(robots, actions, chosen)

    def observe(self, robots: Batch) -> FloatArray:
        """Return the limbs, the ball and the last action."""
        nodes = np.arange(4, self.nodes, 4)
        limbs = [robots.positions(limb)[:, nodes].reshape(len(robots), -1) for limb in self.limbs]
        return np.hstack([*limbs, self.balls, self.actions])

    def reward(self, robots: Batch) -> FloatArray:
        """Return the share of the limbs that is near the ball."""
        x = np.concatenate([robots.positions(limb)[:, self.nodes // 2 :] for limb in self.limbs], axis=1)
        gaps = np.linalg.norm(x - self.balls[:, None], axis=2) - self.ball - self.radius
        return np.asarray(np.exp(-np.maximum(gaps, 0.0) / 0.01).mean(axis=1))

    def draw(self, axes: Any, robots: Batch) -> None:
        """Draw the ball."""
        axes.plot(*self.balls[:1].T, "o", color="C1", markersize=4)
