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
    """Task of many robots. Each method receives a `withe.Batch`, of one robot or of hundreds.

    A subclass defines the scene, the effect of an action, the observations and the reward. Arrays have a row for each
    robot. `Environment` makes one Gymnasium environment of a task, and `VectorEnvironment` many in one.

    Each environment works on a deep copy of the task, its attribute `task`. Several environments can therefore share
    one task object, and the data of their robots are in ``env.task``. A subclass with members that cannot be copied, or
    that environments should share, defines ``__deepcopy__``.

    Attributes
    ----------
    action_size : int
        Size of an action. Each number is from -1 to 1.
    control_step : float [s]
        Time from one action to the next; a whole number of time steps of the simulation.
    steps : int
        Number of actions in an episode, which is then truncated.
    redraw : bool
        True if each episode begins with a new scene from `build`, instead of a reset. If it is false and `build` draws
        random numbers, `withe.PlausibilityWarning` warns that all robots are equal.

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
        """Build a robot in its state at the start of an episode, with random numbers if `redraw` is true.

        Parameters
        ----------
        generator : numpy.random.Generator
            Source of random numbers.

        Returns
        -------
        Simulation
        """

    @abstractmethod
    def act(self, robots: Batch, actions: FloatArray, chosen: IntArray) -> None:
        """Apply actions of the chosen robots for the next control step.

        Parameters
        ----------
        robots : Batch
            All robots.
        actions : ndarray of shape (chosen, action_size) [-]
            Actions, each number from -1 to 1.
        chosen : ndarray of int of shape (chosen,)
            Numbers of the robots that act.
        """

    @abstractmethod
    def observe(self, robots: Batch) -> npt.NDArray[np.floating[Any]]:
        """Return the observations of every robot.

        Parameters
        ----------
        robots : Batch
            All robots.

        Returns
        -------
        ndarray of shape (n, ...)
            Finite numbers, in any units.
        """

    @abstractmethod
    def reward(self, robots: Batch) -> FloatArray:
        """Return the reward of the present state of every robot.

        Parameters
        ----------
        robots : Batch
            All robots.

        Returns
        -------
        ndarray of shape (n,) [-]
            Finite numbers.
        """

    def finished(self, robots: Batch) -> npt.NDArray[np.bool_]:
        """Return True for each robot whose episode has terminated (not truncated); none by default.

        Parameters
        ----------
        robots : Batch
            All robots.

        Returns
        -------
        ndarray of bool of shape (n,)
        """
        return np.zeros(len(robots), bool)

    def prepare(self, robots: Batch) -> None:  # noqa: B027
        """Allocate data of each robot. Called once. By default it does nothing.

        Parameters
        ----------
        robots : Batch
            All robots.
        """

    def begin(self, robots: Batch, chosen: IntArray, generators: list[np.random.Generator]) -> None:  # noqa: B027
        """Begin an episode of the chosen robots, each with its random generator. By default it does nothing.

        Parameters
        ----------
        robots : Batch
            All robots.
        chosen : ndarray of int of shape (chosen,)
            Numbers of the robots whose episode begins.
        generators : list of numpy.random.Generator
            Source of random numbers of each chosen robot.
        """

    def draw(self, axes: Any, robots: Batch) -> None:  # noqa: B027
        """Add to a picture of the first robot, on 3D axes of matplotlib. By default it does nothing.

        Parameters
        ----------
        axes : mpl_toolkits.mplot3d.Axes3D
            Axes of the picture.
        robots : Batch
            All robots.
        """
