"""Gymnasium environments of a task: of one robot, and of many on one batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.learning.episodes import Episodes
from withe.learning.rendering import Screen
from withe.learning.task import Task

__all__ = ["environment_class", "maker", "vector_maker"]

FloatArray = npt.NDArray[np.float64]
RENDER_MODES = ("rgb_array", "human")


def _require() -> Any:
    return require("gymnasium", "learn")


def _boxes(episodes: Episodes) -> tuple[Any, Any]:
    """Return the observation and action spaces of Gymnasium."""
    box = _require().spaces.Box
    seen = episodes.observe()
    return (
        box(-np.inf, np.inf, seen.shape[1:], np.float32),
        box(-1.0, 1.0, (episodes.action_size,), np.float32),
    )


def _screen(render_mode: str | None, episodes: Episodes) -> Screen | None:
    if render_mode is None:
        return None
    if render_mode not in RENDER_MODES:
        raise ValueError(f"render_mode must be {' or '.join(map(repr, RENDER_MODES))} or None, got {render_mode!r}")
    return Screen(episodes.robots, episodes.task.draw, window=render_mode == "human")


class _Environment:
    """One robot that performs a task, as a Gymnasium environment.

    Parameters
    ----------
    task : Task
        Task, of which the environment uses a deep copy.
    render_mode : {"rgb_array", "human"}, optional
        With "rgb_array", `render` returns pictures of shape (480, 640, 3), uint8. With "human" it shows a window.

    Raises
    ------
    ValueError
        Not a task, a task whose control step is not a whole number of time steps, or an unknown render mode. In `step`:
        an action of wrong shape, not finite, or outside of -1..1. In any method: a task whose methods return wrong
        shapes, or observations or rewards that are not finite.
    ImportError
        Gymnasium is not installed.

    Examples
    --------
    >>> env = withe.learning.Environment(withe.learning.Follow())  # doctest: +SKIP
    >>> observation, info = env.reset(seed=7)  # doctest: +SKIP
    >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())  # doctest: +SKIP
    """

    np_random: np.random.Generator

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        self._episodes = Episodes(task, 1, 1)
        self.render_mode = render_mode
        self._screen = _screen(render_mode, self._episodes)
        self._lane = self._episodes.robots.lanes
        self._closed = False
        self._episodes.begin(self._lane, [np.random.default_rng(0)])
        self.observation_space, self.action_space = _boxes(self._episodes)
        self._episodes.begun[:] = False
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": round(1.0 / task.control_step)}

    @property
    def task(self) -> Task:
        """Return the environment's own copy of its task."""
        return self._episodes.task

    @property
    def simulation(self) -> Any:
        """The robot."""
        return self._episodes.robots[0]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; equal seeds give equal episodes.

        Parameters
        ----------
        seed : int, optional
            Seed of the random numbers of this and later episodes.
        options : dict, optional
            Not used.

        Returns
        -------
        observation : ndarray of shape (...)
            Observation of the task.
        info : dict
            Empty.
        """
        self._check(False)
        super().reset(seed=seed)  # type: ignore[misc]
        self._episodes.begin(self._lane, [self.np_random])
        self._show()
        return self._episodes.observe()[0], {}

    def step(self, action: npt.ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Apply an action for one control step.

        Parameters
        ----------
        action : array_like of shape (action_size,) [-]
            Action, each number from -1 to 1.

        Returns
        -------
        observation : ndarray of shape (...)
            Observation of the task.
        reward : float [-]
            Reward of the task.
        terminated, truncated : bool
            True if the episode has terminated, or has reached its last step.
        info : dict
            "failed" is True if the simulation did not converge.

        Raises
        ------
        ValueError
            An action of wrong shape, not finite, or outside of -1 to 1.
        """
        self._check(True)
        outcome = self._episodes.act(self._episodes.checked(action)[None], self._lane)
        self._show()
        info = {"failed": True} if outcome.failed[0] else {}
        return (
            self._episodes.observe()[0],
            float(outcome.reward[0]),
            bool(outcome.terminated[0]),
            bool(outcome.truncated[0]),
            info,
        )

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return a picture of the robot.

        Returns
        -------
        ndarray of shape (480, 640, 3), uint8, or None
            None for a window, and without a render mode.
        """
        self._check(True)
        if self._screen is None or self.render_mode == "human":
            return None
        return self._screen.picture()

    def close(self) -> None:
        """Close the window. Later calls of other methods are refused."""
        if self._screen is not None:
            self._screen.close()
        self._closed = True

    def _show(self) -> None:
        if self.render_mode == "human" and self._screen is not None:
            self._screen.show()

    def _check(self, begun: bool) -> None:
        errors = _require().error
        if self._closed:
            raise errors.ClosedEnvironmentError("the environment is closed: make another one")
        if begun and not self._episodes.begun[0]:
            raise errors.ResetNeeded("call reset before step or render")


class _VectorEnvironment:
    """Many robots that perform a task, each in its own episode, as a Gymnasium vector environment.

    One call steps all robots. The episodes of robot i equal those of `Environment` with the seed of i, for any number
    of workers.

    Parameters
    ----------
    task : Task
        Task, of which the environment uses a deep copy.
    num_envs : int
        Number of robots.
    workers : int, optional
        Number of threads. By default one per processor.
    render_mode : {"rgb_array", "human"}, optional
        Pictures of the first robot.
    autoreset : {"next_step", "same_step", "disabled"} or gymnasium.vector.AutoresetMode
        Time at which the next episode of a robot begins, as in Gymnasium. With "disabled" it begins when
        ``reset(options={"reset_mask": mask})`` is called.
    max_episode_steps : int, optional
        Number of actions after which an episode is truncated, if it is below `steps` of the task.

    Raises
    ------
    ValueError
        As in `Environment`; also workers below 1, or a mask of wrong length.
    ImportError
        Gymnasium is not installed.

    Examples
    --------
    >>> robots = withe.learning.VectorEnvironment(withe.learning.Follow(), 64, workers=2)  # doctest: +SKIP
    >>> observations, infos = robots.reset(seed=7)  # doctest: +SKIP
    >>> observations, rewards, *_ = robots.step(robots.action_space.sample())  # doctest: +SKIP
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        workers: int | None = None,
        render_mode: str | None = None,
        autoreset: Any = "next_step",
        max_episode_steps: int | None = None,
    ) -> None:
        gymnasium = _require()
        modes = {mode.name.lower(): mode for mode in gymnasium.vector.AutoresetMode}
        if isinstance(autoreset, gymnasium.vector.AutoresetMode):
            autoreset = autoreset.name.lower()
        if autoreset not in modes:
            raise ValueError(f"autoreset must be {' or '.join(map(repr, modes))}, got {autoreset!r}")
        self._episodes = Episodes(task, num_envs, workers, max_episode_steps)
        self._autoreset = autoreset
        self.num_envs = num_envs
        self.render_mode = render_mode
        self._screen = _screen(render_mode, self._episodes)
        self._all = self._episodes.robots.lanes
        self._episodes.begin(self._all, [np.random.default_rng(0) for _ in range(num_envs)])
        self.single_observation_space, self.single_action_space = _boxes(self._episodes)
        self._episodes.begun[:] = False
        batch_space = gymnasium.vector.utils.batch_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self._over = np.zeros(num_envs, bool)
        self.metadata = {
            "render_modes": list(RENDER_MODES),
            "render_fps": round(1.0 / task.control_step),
            "autoreset_mode": modes[autoreset],
        }

    @property
    def task(self) -> Task:
        """Return the environment's own copy of its task."""
        return self._episodes.task

    @property
    def robots(self) -> Any:
        """The robots, a `withe.Batch`."""
        return self._episodes.robots

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes of all robots, or of the robots in ``options["reset_mask"]``, shape (n,), bool.

        Seeds are one number per robot, or one number: then robot i has the seed ``seed + i``.

        Parameters
        ----------
        seed : int or sequence of int, optional
            One number per robot, or one number.
        options : dict, optional
            "reset_mask" of shape (n,), bool, chooses robots.

        Returns
        -------
        observations : ndarray of shape (n, ...)
            Observations of the task.
        infos : dict
            Empty.

        Raises
        ------
        ValueError
            A mask of another shape or type, or a wrong number of seeds.
        """
        self._check(False)
        chosen = self._all
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
                raise ValueError(
                    f"reset_mask must be bool of shape ({self.num_envs},), got {mask.dtype} of shape {mask.shape}"
                )
            chosen = self._all[mask]
        seeds = self._seeds(seed)
        for lane in chosen:
            if seeds[lane] is not None:
                self._generators[lane] = np.random.default_rng(seeds[lane])
        self._begin(chosen)
        self._show()
        return self._episodes.observe(), {}

    def _seeds(self, seed: Any) -> list[int | None]:
        """Return one seed per robot; None for a robot whose random numbers continue."""
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, str) or (not isinstance(seed, Sequence) and np.ndim(seed) == 0):
            first = validation.integer(seed, "seed", 0, 2**63 - 1)
            return [first + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed must be one number, or one for each of {self.num_envs} robots, got {len(seed)}")
        return [
            None if each is None else validation.integer(each, f"seed of robot {i}", 0, 2**63 - 1)
            for i, each in enumerate(seed)
        ]

    def step(self, actions: npt.ArrayLike) -> tuple[Any, FloatArray, Any, Any, dict[str, Any]]:
        """Apply an action of every robot for one control step. A robot whose episode is over begins another instead.

        Parameters
        ----------
        actions : array_like of shape (n, action_size) [-]
            Actions, each number from -1 to 1.

        Returns
        -------
        observations : ndarray of shape (n, ...)
            Observations of the task.
        rewards : ndarray of shape (n,) [-]
            Rewards of the task.
        terminated, truncated : ndarray of bool of shape (n,)
            True if the episode of a robot has terminated, or has reached its last step.
        infos : dict
            "failed" marks robots whose simulation did not converge. With ``autoreset="same_step"``, "final_obs" holds
            the last observations of the episodes that ended.

        Raises
        ------
        ValueError
            Actions of wrong shape, not finite, or outside of -1 to 1; or, with ``autoreset="disabled"``, an episode
            that is over.
        """
        self._check(True)
        values = self._episodes.checked(actions, self.num_envs)
        over = self._over.copy()
        if self._autoreset == "disabled" and over.any():
            raise ValueError(f"episodes of robots {np.flatnonzero(over).tolist()} are over: reset them")
        chosen = self._all[~over] if over.any() else self._all
        outcome = self._episodes.act(values[chosen], chosen)
        rewards, terminated, truncated = outcome.reward, outcome.terminated, outcome.truncated
        infos: dict[str, Any] = {}
        if (failed := outcome.failed & ~over).any():
            infos |= {"failed": failed, "_failed": failed}
        if over.any():
            self._begin(self._all[over])
            rewards[over], terminated[over], truncated[over] = 0.0, False, False
        self._over = terminated | truncated
        if self._autoreset == "same_step" and self._over.any():
            ended = self._over.copy()
            infos |= {
                "final_obs": self._episodes.observe(),
                "_final_obs": ended,
                "final_info": {},
                "_final_info": ended,
            }
            self._begin(self._all[ended])
        self._show()
        return self._episodes.observe(), rewards, terminated, truncated, infos

    def render(self) -> Any:
        """Return a picture of the first robot, in a tuple as Gymnasium defines it.

        Returns
        -------
        tuple of one ndarray of shape (480, 640, 3), uint8, or None
            None for a window, and without a render mode.
        """
        self._check(True)
        if self._screen is None or self.render_mode == "human":
            return None
        return (self._screen.picture(),)

    def close_extras(self, **options: Any) -> None:
        """Close the window.

        Parameters
        ----------
        **options
            Not used.
        """
        if self._screen is not None:
            self._screen.close()

    def _begin(self, chosen: npt.NDArray[np.intc]) -> None:
        self._episodes.begin(chosen, [self._generators[lane] for lane in chosen])
        self._over[chosen] = False

    def _show(self) -> None:
        if self.render_mode == "human" and self._screen is not None:
            self._screen.show()

    def _check(self, begun: bool) -> None:
        errors = _require().error
        if self.closed:  # type: ignore[attr-defined]
            raise errors.ClosedEnvironmentError("the environment is closed: make another one")
        if begun and not self._episodes.begun.all():
            raise errors.ResetNeeded("call reset before step or render")


@cache
def environment_class(name: str) -> Any:
    """Return the environment class of that name, a subclass of Gymnasium's."""
    gymnasium = _require()
    own, base = {
        "Environment": (_Environment, gymnasium.Env),
        "VectorEnvironment": (_VectorEnvironment, gymnasium.vector.VectorEnv),
    }[name]
    return type(name, (own, base), {"__doc__": own.__doc__, "__module__": "withe.learning"})


def maker(task: Callable[..., Task]) -> Callable[..., Any]:
    """Return the function for `gymnasium.make`, with options of the environment; a task has none."""

    def make(render_mode: str | None = None, **others: Any) -> Any:
        _refuse(task, others, "Environment", "render_mode")
        return environment_class("Environment")(task(), render_mode)

    return make


def vector_maker(task: Callable[..., Task]) -> Callable[..., Any]:
    """Return the function for `gymnasium.make_vec`; as in `gymnasium.make`, max_episode_steps=-1 sets no limit."""

    def make(
        num_envs: int = 1,
        workers: int | None = None,
        render_mode: str | None = None,
        autoreset: Any = "next_step",
        max_episode_steps: int | None = None,
        **others: Any,
    ) -> Any:
        _refuse(task, others, "VectorEnvironment", "num_envs, workers, render_mode, autoreset, max_episode_steps")
        most = None if max_episode_steps == -1 else max_episode_steps
        return environment_class("VectorEnvironment")(task(), num_envs, workers, render_mode, autoreset, most)

    return make


def _refuse(task: Callable[..., Task], others: dict[str, Any], environment: str, known: str) -> None:
    """Refuse options with unknown names. The message says how to change the numbers of a task."""
    for name in others:
        raise TypeError(
            f"withe/{task.__name__}-v0 has no option {name!r}; its options are {known}. To change the task, derive "
            f"class Other(withe.learning.{task.__name__}) and use withe.learning.{environment}(Other())"
        )
