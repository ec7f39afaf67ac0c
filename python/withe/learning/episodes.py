"""Episodes of a task: their start, the simulation of actions, and their end."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, TypeVar
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np
import numpy.typing as npt

from withe.batch import Batch
from withe.common import validation
from withe.common.user_warnings import Cause, each_cause_once, warn
from withe.errors import PlausibilityWarning
from withe.learning.task import Task
from withe.simulation.simulation import Simulation

__all__ = ["Episodes", "Outcome"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intc]
Number = TypeVar("Number", np.float32, np.float64, np.bool_)
BoolArray = npt.NDArray[np.bool_]

_ROUNDING = 1e-6  # rounding error of numbers about 1 after a few operations in single precision


@dataclass(frozen=True)
class Outcome:
    """Result of actions, with an entry for each robot.

    Attributes
    ----------
    reward : ndarray of shape (n,)
        Rewards after the actions.
    terminated, truncated, failed : ndarray of shape (n,), bool
        Ends of episodes. `failed` is true if the simulation found no solution; the episode is then truncated.
    """

    reward: FloatArray
    terminated: BoolArray
    truncated: BoolArray
    failed: BoolArray


class _Causes(set[Cause]):
    """A set that may be referred to weakly."""


_causes_of: WeakKeyDictionary[type[Task], WeakValueDictionary[str, _Causes]] = WeakKeyDictionary()


def _shared_causes(task: type[Task]) -> _Causes:
    """Causes of warnings that were given in a training run, which lasts as long as any environment of its task."""
    held = _causes_of.setdefault(task, WeakValueDictionary())
    causes = held.get("run", _Causes())
    held["run"] = causes
    return causes


class Episodes:
    """Robots that perform a task, each at its own stage of its episode.

    Parameters
    ----------
    task : Task
        Task, of which this object uses a deep copy with its own data of each robot.
    count : int
        Number of robots.
    workers : int, optional
        Number of threads.
    most : int, optional
        Number of actions after which an episode is truncated, if it is below that of the task.
    """

    task: Task
    robots: Batch
    begun: npt.NDArray[np.bool_]
    action_size: int
    steps: int

    def __init__(self, task: Task, count: int, workers: int | None, most: int | None = None) -> None:
        if not isinstance(task, Task):
            got = f"the class {task.__name__} itself" if isinstance(task, type) else type(task).__name__
            raise ValueError(f"task must be a withe.learning.Task, got {got}")
        number = validation.integer(count, "number of environments", 1, 1_000_000)
        try:
            self.task = task = copy.deepcopy(task)
        except TypeError as error:
            raise ValueError(f"task must be one that copy.deepcopy can copy: {type(task).__name__}, {error}") from error
        self._causes = _shared_causes(type(task))
        first = self._first()
        self.robots = Batch([first, *(first.copy() for _ in range(number - 1))], workers)
        self.begun = np.zeros(number, bool)
        self._taken = np.zeros(number, np.int64)
        ratio = validation.positive(task.control_step, "control_step") / first.time_step
        self._count = round(ratio)
        if self._count < 1 or abs(ratio - self._count) > 1e-6 * ratio:
            raise ValueError(
                f"control_step must be a whole number of time steps of {first.time_step:g} s, "
                f"got {task.control_step:g} s"
            )
        self.action_size = validation.integer(task.action_size, "action_size", 1, 1_000_000)
        self.steps = validation.integer(task.steps, "steps", 1, 2**31 - 1)
        if most is not None:
            self.steps = min(self.steps, validation.integer(most, "max_episode_steps", 1, 2**31 - 1))
        task.prepare(self.robots)
        self._seen: tuple[int, ...] | None = None  # shape of observations, once it is known

    def __len__(self) -> int:
        return len(self.robots)

    def begin(self, chosen: IntArray, generators: list[np.random.Generator]) -> None:
        """Begin episodes of some robots, each with its own random generator."""
        with each_cause_once(self._causes):
            if self.task.redraw:
                for lane, generator in zip(chosen, generators, strict=True):
                    self.robots[int(lane)] = self._built(generator)
            else:
                self.robots.reset(chosen)
            self._taken[chosen] = 0
            self.begun[chosen] = True
            self.task.begin(self.robots, chosen, generators)

    def observe(self) -> npt.NDArray[np.float32]:
        """Return the observations of every robot.

        Raises
        ------
        ValueError
            The task returns a shape other than (n, ...) or than at first, or values that are not finite numbers.
        """
        seen = self._returned(self.task.observe(self.robots), "observe", np.float32)
        if seen.shape[:1] != (len(self),):
            raise ValueError(f"{self._name('observe')} must return shape ({len(self)}, ...), got {seen.shape}")
        if self._seen is None:
            self._seen = seen.shape
        self._check(seen, "observe", self._seen)
        return seen

    def act(self, actions: FloatArray, chosen: IntArray) -> Outcome:
        """Apply one action to each chosen robot; other robots do not change.

        Raises
        ------
        ValueError
            The task returns rewards or ends of another shape than (n,), or rewards that are not finite.
        """
        if chosen.size > 0:  # a task is not called for an empty choice
            with each_cause_once(self._causes):
                self.task.act(self.robots, actions, chosen)
                self.robots.step(self._count, chosen)
            self._taken[chosen] += 1
        failed = self.robots.failed
        reward = self._returned(self.task.reward(self.robots), "reward", np.float64)
        finished = self._returned(self.task.finished(self.robots), "finished", np.bool_)
        self._check(reward, "reward", (len(self),))
        self._check(finished, "finished", (len(self),))
        return Outcome(reward, finished & ~failed, (self._taken >= self.steps) | failed, failed)

    def _name(self, method: str) -> str:
        return f"{type(self.task).__name__}.{method}"

    def _first(self) -> Simulation:
        """The robot that all are copies of, unless each episode has its own."""
        generator = np.random.default_rng(0)
        before = generator.bit_generator.state
        with each_cause_once(self._causes):
            built = self._built(generator)
            if not self.task.redraw and generator.bit_generator.state != before:
                warn(
                    f"{self._name('build')} draws random numbers, but redraw is False: all robots and episodes use "
                    "the scene of the first draw. Set redraw = True to build a scene for each episode",
                    PlausibilityWarning,
                    "redraw",
                )
        return built

    def _built(self, generator: np.random.Generator) -> Simulation:
        """A robot of the task as it begins."""
        built: Any = self.task.build(generator)
        if not isinstance(built, Simulation):
            raise ValueError(
                f"{self._name('build')} must return a withe.Simulation, as scene.build(...) does, "
                f"got {type(built).__name__}"
            )
        return built

    def _returned(self, found: Any, method: str, kind: type[Number]) -> npt.NDArray[Number]:
        """Return the result of a method of the task, as an array."""
        try:
            return np.asarray(found, kind)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"{self._name(method)} must return an array of numbers, got {type(found).__name__}: {error}"
            ) from error

    def _check(self, found: npt.NDArray[Any], method: str, shape: tuple[int, ...]) -> None:
        """Refuse results of a method of the task that have a wrong shape or are not finite."""
        if found.shape != shape:
            raise ValueError(f"{self._name(method)} must return shape {shape}, got {found.shape}")
        finite = np.isfinite(found)
        if not finite.all():
            robot = int(np.argwhere(~finite)[0, 0])
            raise ValueError(f"{self._name(method)} must be finite, got {found[~finite][0]} of robot {robot}")

    def checked(self, actions: npt.ArrayLike, *robots: int) -> FloatArray:
        """Return valid actions of some robots, or of one, from -1 to 1, after clipping errors of single precision.

        Raises
        ------
        ValueError
            A wrong shape, values that are not finite, or values outside of the box.
        """
        values = validation.number_array(actions, "action", (*robots, self.action_size))
        most = np.abs(values).max(initial=0.0)
        if most > 1.0 + _ROUNDING:
            raise ValueError(f"action must lie in -1..1, got {values.flat[np.abs(values).argmax()]:.9g}")
        return np.clip(values, -1.0, 1.0) if most > 1.0 else values
