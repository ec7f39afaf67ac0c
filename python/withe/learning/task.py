"""Tasks for learning: a scene, actions, observations and a reward."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.batch import Batch
from withe.simulation.simulation import Simulation

__all__ = ["Task"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intc]


class Task(ABC):
    """Task of many robots: each method is given a `withe.Batch`, of one robot or of hundreds.

    A subclass says how the scene is built, what an action does, what is observed, and how good that is; arrays have a
    row for each robot. `Environment` makes one Gymnasium environment of it, `VectorEnvironment` many in one.

    Each environment works on a deep copy of the task, its attribute `task`. So one task may be given to several, and
    what a task remembers of its robots is read there: ``env.task``. A subclass that holds what cannot be copied, or
    what environments are to share, defines ``__deepcopy__``.

    Attributes
    ----------
    action_size : int
        How many numbers an action has, each from -1 to 1.
    control_step : float [s]
        From one action to the next; a whole number of time steps of the simulation.
    steps : int
        Actions in an episode, which is then truncated.
    redraw : bool
        Whether each episode begins with a scene of its own, from `build`, instead of a reset. Where it is false,
        a `build` that draws random numbers is warned of, with `withe.PlausibilityWarning`: all robots are equal.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> class Touch(withe.learning.Task):
    ...     '''The tip of an arm is to touch a point.'''
    ...
    ...     action_size, control_step, steps = 2, 0.1, 50
    ...     goal = np.array([0.1, 0.0, 0.25])
    ...
    ...     def build(self, generator):
    ...         scene = withe.Scene()
    ...         rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=1e3)
    ...         arm = scene.add_rod(
    ...             start=(0, 0, 0), end=(0, 0, 0.3), nodes=16, radius=1e-2, material=rubber, name="arm"
    ...         )
    ...         scene.clamp(arm.start)
    ...         return scene.build(time_step=0.02)
    ...
    ...     def act(self, robots, actions, chosen):
    ...         robots.set("arm", natural_curvature=6.0 * actions, over=self.control_step, lanes=chosen)
    ...
    ...     def observe(self, robots):
    ...         return np.hstack([robots.positions("arm")[:, -1], robots.velocities("arm")[:, -1]])
    ...
    ...     def reward(self, robots):
    ...         return -np.linalg.norm(robots.positions("arm")[:, -1] - self.goal, axis=1)
    >>> env = withe.learning.Environment(Touch())  # doctest: +SKIP
    >>> envs = withe.learning.VectorEnvironment(Touch(), 100, workers=2)  # doctest: +SKIP
    """

    action_size: int = 1
    control_step: float = 0.1
    steps: int = 100
    redraw: bool = False

    @abstractmethod
    def build(self, generator: np.random.Generator) -> Simulation:
        """A robot as it is at the start of an episode; where `redraw` is true, by random numbers of the generator."""

    @abstractmethod
    def act(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        """Set what actions of the chosen robots mean, shape (chosen, action_size), for the coming control step."""

    @abstractmethod
    def observe(self, robots: Batch) -> npt.NDArray[np.floating[Any]]:
        """Return the observations of every robot, shape (n, ...), finite."""

    @abstractmethod
    def reward(self, robots: Batch) -> FloatArray:
        """Return the reward of the present state of every robot, shape (n,), finite."""

    def finished(self, robots: Batch) -> npt.NDArray[np.bool_]:
        """Whose episode has come to its end (terminated, not truncated), shape (n,); none by default."""
        return np.zeros(len(robots), bool)

    def prepare(self, robots: Batch) -> None:  # noqa: B027
        """Make room for what the task remembers of each robot. Called once; nothing by default."""

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:  # noqa: B027
        """An episode begins for the chosen robots, each with its generator of random numbers; nothing by default."""

    def draw(self, axes: Any, robots: Batch) -> None:  # noqa: B027
        """Add to a picture of the first robot, on 3D axes of matplotlib; nothing by default."""
