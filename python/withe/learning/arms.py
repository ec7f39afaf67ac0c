"""Tasks of a soft arm: following a target, reaching a pose, and passing obstacles [arXiv 2511.06667].

An upright arm of 1 m is held at its lowest edge and bent in five segments. An action adds to the sum of the discrete
curvature of each segment, spread evenly over its nodes. Unlike in the source, Newton's method is not stopped early, and
the twist stays in range.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.batch import Batch
from withe.learning.task import IntArray, Task
from withe.parts.kinds import ObstaclePart
from withe.parts.materials import Material
from withe.parts.options import Solver
from withe.scene.scene import Scene
from withe.simulation.simulation import Simulation

__all__ = ["Follow", "Obstacles2D", "Obstacles3D", "Reach"]

FloatArray = npt.NDArray[np.float64]

_NODES, _LENGTH, _RADIUS = 21, 1.0, 0.05  # [-], [m], [m]
_MODULUS, _DENSITY, _DRAG = 1e7, 1000.0, 10.0  # [Pa], [kg/m^3], [Pa s]
_SEGMENTS = (3, 4, 4, 4, 4)  # inner nodes of each
_SEGMENT_OF, _SHARES = np.repeat(np.arange(5), _SEGMENTS), 1.0 / np.array(_SEGMENTS)
_MOST_BEND, _MOST_TWIST = 2.0, 0.5 * np.pi  # greatest totals of a segment [-], [rad]
_SEEN = slice(2, None, 2)  # nodes whose positions and velocities are observed
_LOW, _HIGH = np.array([-0.6, -0.6, 0.3]), np.array([0.6, 0.6, 0.9])  # box of targets [m]
_NEAR, _CLOSE = 0.1, 0.05  # distances of the tip from its target [m]
_BOUNDS, _BONUSES = np.array([_CLOSE, _NEAR]), np.array([2.0, 0.5, 0.0])  # distances [m], and rewards between them
_TWIST_STEP = 0.05  # greatest change per action [rad]


class Arm(Task):
    """Base of the arm tasks: the arm, its segments, its observations.

    Attributes
    ----------
    bend_step : float [-]
        Increase of a segment's total discrete curvature for an action of 1.
    axes : slice
        Coordinates in the observations: two in a plane.
    components : int
        Number of actuated components of curvature.
    time_step : float [s]
        Time step of the simulation.
    longest_meant : float [s]
        Longest time step without a `CoarseStepWarning`. A longer step does not resolve the vibration of the arm, which
        is intended here: the tip stays within 1 cm RMS of a run with short steps (`benchmarks/rl_throughput.py`). In
        `Follow` the velocities of nodes are then wrong by 0.2 to 0.4 m/s RMS, because fast modes lose their phase. The
        velocities themselves are 0.5 to 0.8 m/s.
    """

    control_step: float = 0.1
    steps = 100
    bend_step: float = 0.05
    axes: slice = slice(None)
    components = 2
    planar = False
    twisted = False
    time_step: float = 1.0 / 40.0
    longest_meant: float = 1.0 / 40.0
    action_size: int
    bends: FloatArray
    twists: FloatArray
    target: FloatArray

    def __init__(self) -> None:
        self.action_size = 5 * (self.components + self.twisted)

    def build(self, generator: np.random.Generator) -> Simulation:
        """Build the arm, upright, among the obstacles of the task."""
        scene = Scene()
        rubber = Material(youngs_modulus=_MODULUS, poisson_ratio=0.5, density=_DENSITY)
        arm = scene.add_rod(
            start=(0, 0, 0),
            end=(0, 0, _LENGTH),
            nodes=_NODES,
            radius=_RADIUS,
            normal=(1, 0, 0),
            material=rubber,
            name="arm",
        )
        scene.clamp(arm.start, hold="edge")
        scene.add_drag(_DRAG, rods=[arm])
        self.add_obstacles(scene, generator)
        built = scene.build(
            # Edges turn by more in a step than midpoint conserves energy for. Its steps, at 0.7 of the cost, lead the
            # tip as well where energy is not watched, but velocities are twice as far off, and extreme actions make
            # the arm blow up.
            integrator="energy_momentum",
            time_step=self.time_step,
            planar=self.planar,
            # A step tolerance of 0.1 mm causes 1 % of the error of the time step, and saves a fifth of the work.
            solver=Solver(step_tolerance=1e-4, force_tolerance=1e-3),
        )
        built._session.longest_meant = self.longest_meant
        return built

    def add_obstacles(self, scene: Scene, generator: np.random.Generator) -> None:
        """Add obstacles to the scene; none by default.

        Parameters
        ----------
        scene : Scene
            Scene with the arm.
        generator : numpy.random.Generator
            Source of random numbers.
        """

    def prepare(self, robots: Batch) -> None:
        """Allocate bends and targets of all robots."""
        count = len(robots)
        self.bends = np.zeros((count, 5, self.components))
        self.twists = np.zeros((count, 5))
        self.target = np.zeros((count, 3))
        self._x = np.empty((count, _NODES, 3))
        self._v = np.empty((count, _NODES, 3))

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:
        """Start with a straight arm and a target from each generator."""
        self.bends[chosen] = 0.0
        self.twists[chosen] = 0.0
        for lane, generator in zip(chosen, generators, strict=True):
            self.aim(int(lane), generator)

    @abstractmethod
    def aim(self, lane: int, generator: np.random.Generator) -> None:
        """Choose the target of a robot at the start of its episode.

        Parameters
        ----------
        lane : int
            Number of the robot.
        generator : numpy.random.Generator
            Source of random numbers.
        """

    def act(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        """Ramp the natural curvatures and twists."""
        rows = _rows(robots, chosen)
        parts = actions.reshape(len(chosen), -1, 5).swapaxes(1, 2)
        bends = self.bends[rows] + self.bend_step * parts[..., : self.components]
        self.bends[rows] = bends = np.minimum(np.maximum(bends, -_MOST_BEND), _MOST_BEND)
        curvature = (bends * _SHARES[:, None]).take(_SEGMENT_OF, axis=1)
        if self.components == 1:
            curvature = np.concatenate([curvature, np.zeros_like(curvature)], axis=2)
        robots.set("arm", discrete_curvature=curvature, over=self.control_step, lanes=chosen)
        if self.twisted:
            twists = np.clip(self.twists[rows] + _TWIST_STEP * parts[..., -1], -_MOST_TWIST, _MOST_TWIST)
            self.twists[rows] = twists
            rates = (twists * _SHARES).take(_SEGMENT_OF, axis=1) * ((_NODES - 1) / _LENGTH)
            robots.set("arm", natural_twist=rates, over=self.control_step, lanes=chosen)

    def observe(self, robots: Batch) -> npt.NDArray[np.float32]:
        """Return positions and velocities of every second node, bends, twists, and additions of the task."""
        count = len(robots)
        x, v = robots.positions("arm", out=self._x), robots.velocities("arm", out=self._v)
        parts = [x[:, _SEEN, self.axes], v[:, _SEEN, self.axes], self.bends]
        if self.twisted:
            parts.append(self.twists)
        rows = [part.reshape(count, -1) for part in parts + self.seen(robots)]
        return np.concatenate(rows, axis=1, dtype=np.float32, casting="same_kind")

    def seen(self, robots: Batch) -> list[FloatArray]:
        """Return observations besides the arm: arrays with a row for each robot.

        Parameters
        ----------
        robots : Batch
            All robots.

        Returns
        -------
        list of ndarray of shape (n, ...)
        """
        return [self.target[:, self.axes]]

    def distances(self, robots: Batch) -> FloatArray:
        """Return the distance of every tip from its target.

        Parameters
        ----------
        robots : Batch
            All robots.

        Returns
        -------
        ndarray of shape (n,) [m]
        """
        apart = (robots.positions("arm", out=self._x)[:, -1] - self.target)[:, self.axes]
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", apart, apart)))

    def reward(self, robots: Batch) -> FloatArray:
        """Return minus the squared distance, plus a bonus near the target."""
        d = self.distances(robots)
        return _BONUSES.take(_BOUNDS.searchsorted(d, side="right")) - d * d

    def draw(self, axes: Any, robots: Batch) -> None:
        """Draw the target."""
        axes.plot(*self.target[:1].T, "o", color="C1", markersize=9)


class Follow(Arm):
    """Follow a target with the tip. The target moves at 0.5 m/s and turns now and then.

    Actions: increases of the curvature of each segment, towards x and then towards y, (10,). Observations: positions
    and velocities of nodes 2, 4 .. 20, bends of the segments, position and velocity of the target, (76,). Reward: -d^2,
    plus 0.5 within 0.1 m or 2 within 0.05 m. An episode has 500 steps of 0.1 s.

    Examples
    --------
    >>> env = gymnasium.make("withe/Follow-v0")  # doctest: +SKIP
    """

    steps = 500
    speed: float = 0.5  # [m/s]
    turning: float = 0.025  # chance of a new direction, an action

    def prepare(self, robots: Batch) -> None:
        """Allocate the motions of targets, which are drawn at the start of an episode."""
        super().prepare(robots)
        count = len(robots)
        self.way: FloatArray = np.zeros((count, 3))  # velocity of the target [m/s]
        self._taken = np.zeros(count, np.int64)
        self._turns = np.zeros((count, self.steps), bool)
        self._ways = np.zeros((count, self.steps + 1, 3))

    def aim(self, lane: int, generator: np.random.Generator) -> None:
        """Draw a position and a direction of motion anywhere."""
        self.target[lane] = generator.uniform(_LOW, _HIGH)
        ways = generator.normal(size=(self.steps + 1, 3))
        self._ways[lane] = self.speed * ways / np.linalg.norm(ways, axis=1, keepdims=True)
        self._turns[lane] = generator.random(self.steps) < self.turning
        self._taken[lane] = 0
        self.way[lane] = self._ways[lane, -1]

    def act(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        """Move the arm and the target; walls reflect the target."""
        super().act(robots, actions, chosen)
        rows = _rows(robots, chosen)
        taken = self._taken[rows] % self.steps
        turns = self._turns[chosen, taken]
        if turns.any():
            self.way[chosen[turns]] = self._ways[chosen[turns], taken[turns]]
        way, here = self.way[rows], self.target[rows]
        there = here + self.control_step * way
        outside = (there < _LOW) | (there > _HIGH)
        if outside.any():
            self.way[rows] = np.where(outside, -way, way)
            there = np.where(outside, here, there)
        self.target[rows] = there
        self._taken[rows] += 1

    def seen(self, robots: Batch) -> list[FloatArray]:
        """Return the target and its velocity."""
        return [self.target, self.way]


class Reach(Arm):
    """Move the tip to a pose: a position, and an upright orientation with a yaw of up to 90 degrees.

    Actions: curvatures and twist of each segment, (15,). Observations besides the arm: twists, quaternion of the tip,
    position and quaternion of the target, scalar last, (86,). With o = 1 - (q . q*)^2 the reward is -d^2 - o^2 / 2,
    plus a bonus near the target. The bonus within 0.1 m is 1 - o / 2 (1.5 if o < 0.1). Within 0.05 m it is 4 - 2 o
    instead (4.5 if o < 0.1, 6 if o < 0.05). An episode has 100 steps of 0.1 s.

    Examples
    --------
    >>> env = gymnasium.make("withe/Reach-v0")  # doctest: +SKIP
    """

    twisted = True

    def prepare(self, robots: Batch) -> None:
        """Allocate orientations of the targets."""
        super().prepare(robots)
        self.goal: FloatArray = np.tile((0.0, 0.0, 0.0, 1.0), (len(robots), 1))

    def aim(self, lane: int, generator: np.random.Generator) -> None:
        """Draw a position anywhere and a yaw."""
        self.target[lane] = generator.uniform(_LOW, _HIGH)
        yaw = generator.uniform(-0.5 * np.pi, 0.5 * np.pi)
        self.goal[lane] = (0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw))

    def orientations(self, robots: Batch) -> FloatArray:
        """Return quaternions of the last edges, scalar last. The drawn arm has (0, 0, 0, 1).

        Parameters
        ----------
        robots : Batch
            All robots.

        Returns
        -------
        ndarray of shape (n, 4)
        """
        from scipy.spatial.transform import Rotation

        frames = robots.directors("arm")[:, -1].swapaxes(1, 2)
        q = Rotation.from_matrix(frames).as_quat()
        return np.asarray(q * np.where(q[:, 3:] < 0.0, -1.0, 1.0))

    def seen(self, robots: Batch) -> list[FloatArray]:
        """Return the orientation of the tip and the pose of the target."""
        return [self.orientations(robots), self.target, self.goal]

    def reward(self, robots: Batch) -> FloatArray:
        """Return the reward of position and orientation."""
        d = self.distances(robots)
        o = 1.0 - np.sum(self.orientations(robots) * self.goal, axis=1) ** 2
        near = np.where(o < 0.1, 1.5, 1.0) - 0.5 * o
        close = np.where(o < 0.05, 6.0, np.where(o < 0.1, 4.5, 4.0)) - 2.0 * o
        bonus = np.where(d < _CLOSE, close, np.where(d < _NEAR, near, 0.0))
        return np.asarray(-(d**2) - 0.5 * o**2 + bonus)


class _Obstructed(Arm):
    """The tip is to come to a goal behind obstacles; steps of 0.5 s."""

    control_step: float = 0.5
    steps = 50
    bend_step: float = 0.25
    time_step: float = 1.0 / 30.0
    longest_meant: float = 1.0 / 30.0  # led over 0.5 s an arm swings less
    aimed_at: tuple[float, float, float] = (0.8, 0.0, 0.15)  # [m]

    def aim(self, lane: int, generator: np.random.Generator) -> None:
        """Always there."""
        self.target[lane] = self.aimed_at


class Obstacles2D(_Obstructed):
    """Move the tip to (0.8, 0.15) m in the plane of x and z, past six round obstacles of radius 0.1 m.

    Actions: increases of the curvature of each segment, (5,). Observations: positions and velocities of nodes
    2, 4 .. 20, bends, the goal, (47,). Reward as in `Follow`. An episode has 50 steps of 0.5 s.

    Examples
    --------
    >>> env = gymnasium.make("withe/Obstacles2D-v0")  # doctest: +SKIP
    """

    axes: slice = slice(None, None, 2)  # x and z
    components = 1
    planar = True
    time_step: float = 1.0 / 36.0
    longest_meant: float = 1.0 / 36.0  # with 1/30 s, which impacts cut, the tip is wrong by 13 mm
    places: tuple[tuple[float, float], ...] = (  # x, z [m]
        (0.2, 0.12),
        (0.6, 0.12),
        (0.4, 0.0),
        (0.4, 0.37),
        (0.4, 0.57),
        (0.4, 0.77),
    )

    def add_obstacles(self, scene: Scene, generator: np.random.Generator) -> None:
        """Add capsules across the plane."""
        for x, z in self.places:
            scene.add_capsule((x, -0.2, z), (x, 0.2, z), 0.1)


class Obstacles3D(_Obstructed):
    """Move the tip to (0.8, 0, 0.35) m through eight capsules of radius 0.03 m. Each episode draws other capsules.

    Actions as in `Follow`, (10,). Observations: positions and velocities of nodes 2, 4 .. 20, bends, the goal, ends of
    the capsules, (121,). Reward as in `Follow`. An episode has 50 steps of 0.5 s.

    Examples
    --------
    >>> env = gymnasium.make("withe/Obstacles3D-v0")  # doctest: +SKIP
    """

    redraw = True
    aimed_at: tuple[float, float, float] = (0.8, 0.0, 0.35)
    low: FloatArray = np.array([0.3, -0.6, -0.1])  # box of the capsules [m]
    high: FloatArray = np.array([0.6, 0.6, 0.8])
    count: int = 8
    radius: float = 0.03  # [m]
    length: float = 1.0  # [m]
    apart: float = 0.015  # [m]

    def prepare(self, robots: Batch) -> None:
        """Allocate the obstacles for observations."""
        super().prepare(robots)
        self.ends: FloatArray = np.zeros((len(robots), self.count * 6))

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:
        """Store the positions of the capsules."""
        super().begin(robots, chosen, generators)
        for lane in chosen:
            capsules = robots[int(lane)]._session.directory.all(ObstaclePart)
            self.ends[lane] = np.ravel([(capsule.point, capsule.other) for capsule in capsules])

    def seen(self, robots: Batch) -> list[FloatArray]:
        """Return the goal and the obstacles."""
        return [self.target, self.ends]

    def add_obstacles(self, scene: Scene, generator: np.random.Generator) -> None:
        """Add capsules of random direction whose axes are in the box, and not too near each other."""
        for start, end in self._drawn(generator):
            scene.add_capsule(start, end, self.radius)

    def _drawn(self, generator: np.random.Generator) -> list[tuple[FloatArray, FloatArray]]:
        found: list[tuple[FloatArray, FloatArray]] = []
        while len(found) < self.count:
            middles = generator.uniform(self.low, self.high, (64, 3))
            ways = generator.normal(size=(64, 3))
            ways *= 0.5 * self.length / np.linalg.norm(ways, axis=1, keepdims=True)
            starts, ends = middles - ways, middles + ways
            inside = (np.minimum(starts, ends) >= self.low) & (np.maximum(starts, ends) <= self.high)
            for place in np.flatnonzero(inside.all(axis=1)):
                start, end = starts[place], ends[place]
                clear = all(_segment_distance(start, end, *other) >= self.apart for other in found)
                if clear and len(found) < self.count:
                    found.append((start, end))
        return found


def _rows(robots: Batch, chosen: IntArray) -> IntArray | slice:
    """Places of the chosen robots in arrays that have a row for each."""
    return slice(None) if chosen is robots.lanes else chosen


def _segment_distance(a0: FloatArray, a1: FloatArray, b0: FloatArray, b1: FloatArray) -> float:
    """Distance of two segments [m]: of the nearest points of their lines if both are inside, else of an end."""
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, uv, vv, uw, vw = u @ u, u @ v, v @ v, u @ w, v @ w
    determinant = uu * vv - uv * uv
    if determinant > 1e-12 * uu * vv:
        s, t = (uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return float(np.linalg.norm(w + s * u - t * v))
    ends = [(a0, b0, v), (a1, b0, v), (b0, a0, u), (b1, a0, u)]
    shares = [float(np.clip((point - start) @ way / (way @ way), 0.0, 1.0)) for point, start, way in ends]
    return min(float(np.linalg.norm(p - x - s * y)) for (p, x, y), s in zip(ends, shares, strict=True))
