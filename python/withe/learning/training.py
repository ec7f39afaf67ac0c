"""Controllers trained by Stable-Baselines3: the connection to robots of withe."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from withe.common import validation
from withe.common.extras import require
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.common.user_warnings import warn
from withe.learning.environments import environment_class
from withe.learning.network_training import own_torch
from withe.learning.task import Task

__all__ = ["train_policy"]


@keyword_hints
def train_policy(
    task: Task,
    steps: int,
    *,
    environments: int = 16,
    workers: int | None = None,
    seed: int = 0,
    normalize: bool = True,
    callback: Callable[[Any], None] | None = None,
    progress: bool = True,
    **options: Any,
) -> Any:
    """Train a controller by soft actor-critic [Haarnoja et al. 2018], on robots that are stepped in parallel.

    This is a thin example: `VectorEnvironment` works with all other methods of Stable-Baselines3 too.

    Parameters
    ----------
    task : Task
        Task, of which the robots use a deep copy, ``policy.get_env().get_attr("task")[0]``.
    steps : int
        Number of control steps of all robots together.
    environments : int
        Number of robots.
    workers : int, optional
        Number of threads that step them; by default one per processor.
    seed : int
        Seed. Equal seeds give equal controllers if torch runs the same. The random generators of torch, NumPy and
        Python, and the threads of torch, are restored.
    normalize : bool
        True to scale observations by their running mean and deviation, as a part of the policy.
    callback : callable, optional
        Function of the policy that is called before each control step and at the end, to save or evaluate the policy.
    progress : bool
        True to show a progress bar on a terminal.
    **options
        Options of ``stable_baselines3.SAC``, such as gamma and learning_rate. By default there is an update with 256
        stored steps for every 4 control steps. The weight of the entropy is small from the start, for rewards of about
        1.

    Returns
    -------
    stable_baselines3.SAC
        Policy. ``action, _ = policy.predict(observation, deterministic=True)`` returns an action; ``save`` and ``load``
        store the policy. ``policy.ep_info_buffer`` holds the rewards of the last episodes. Ctrl-C ends training with a
        warning and returns the present policy.

    Raises
    ------
    ValueError
        Not a task, numbers below 1, or a seed that is negative or beyond 32 bits.
    ImportError
        Gymnasium, torch or Stable-Baselines3 is not installed.

    Examples
    --------
    >>> policy = withe.learning.train_policy(withe.learning.Follow(), 300_000)  # doctest: +SKIP
    """
    total = validation.integer(steps, "steps", 1, 2**31 - 1)
    number = validation.integer(environments, "environments", 1, 1_000_000)
    chance = validation.integer(seed, "seed", 0, 2**32 - 1)
    baselines = require("stable_baselines3", "learn")
    robots = environment_class("VectorEnvironment")(task, number, workers, autoreset="same_step")
    monitor = require("stable_baselines3.common.vec_env", "learn").VecMonitor
    given: dict[str, Any] = {
        "train_freq": max(1, 4 // number),
        "gradient_steps": max(1, number // 4),
        "learning_starts": min(5000, total // 10),
        "learning_rate": 1e-3,
        "buffer_size": max(number, min(total, 1_000_000)),
        "ent_coef": "auto_0.02",  # with the default of 1, policies first learn to be random
        "device": "cpu",
    }
    given |= options
    if normalize:
        shared = {"features_extractor_class": _scaling(), "share_features_extractor": True}
        given["policy_kwargs"] = shared | given.get("policy_kwargs", {})
    with _own_generators(chance):
        policy = baselines.SAC("MlpPolicy", monitor(_adapter()(robots)), seed=chance, **given)
        _learn(policy, total, callback, normalize, progress)
    return policy


@contextmanager
def _own_generators(seed: int) -> Iterator[None]:
    """Limit torch to one thread for Stable-Baselines3. Restore threads and random generators afterwards."""
    numpy, python = np.random.get_state(), random.getstate()  # noqa: NPY002 (that is the one it draws from)
    try:
        with own_torch(1, seed):  # small networks lose by more threads
            yield
    finally:
        np.random.set_state(numpy)  # noqa: NPY002
        random.setstate(python)


def _learn(policy: Any, total: int, callback: Callable[[Any], None] | None, normalize: bool, progress: bool) -> None:
    """Train for a number of control steps, or until Ctrl-C."""
    base = require("stable_baselines3.common.callbacks", "learn").BaseCallback

    class Report(base):  # type: ignore[misc,valid-type]
        def _on_rollout_start(self) -> None:
            if callback is not None:
                callback(policy)

        def _on_step(self) -> bool:
            if normalize:
                policy.actor.features_extractor.take_in(self.locals["new_obs"])
            bar.update(min(self.num_timesteps, total))
            return True

    with progress_bar(total, "training", progress, unit="steps") as bar:
        try:
            policy.learn(total, callback=Report())
        except KeyboardInterrupt:
            reached = f"{policy.num_timesteps} of {total} control steps"
            warn(f"training was interrupted: the policy is as it was after {reached}", cause="interrupted")
    if callback is not None:
        callback(policy)


@cache
def _scaling() -> Any:
    """Scale observations by their running mean and deviation [Chan, Golub and LeVeque 1983]. Imports torch."""
    torch = require("torch", "learn")
    base = require("stable_baselines3.common.torch_layers", "learn").BaseFeaturesExtractor

    class Scaling(base):  # type: ignore[misc,valid-type]
        most = 10.0  # deviations

        def __init__(self, observation_space: Any) -> None:
            size = math.prod(observation_space.shape)
            super().__init__(observation_space, size)
            # Stable-Baselines3 copies buffers whose names begin with "running" to the target critics.
            for name, value in (("count", 0.0), ("mean", 0.0), ("variance", 1.0)):
                self.register_buffer(f"running_{name}", torch.full((size,), value))

        def take_in(self, observations: Any) -> None:
            """Add observations of some robots, of shape (..., size) or of the shape of the observation space."""
            mean, variance = self.running_mean, self.running_variance
            seen = torch.as_tensor(observations, dtype=mean.dtype).reshape(-1, len(mean))
            count = self.running_count + len(seen)
            apart = seen.mean(0) - mean
            within = self.running_count * variance + len(seen) * seen.var(0, correction=0)
            variance.copy_((within + apart**2 * self.running_count * len(seen) / count) / count)
            mean.add_(apart * len(seen) / count)
            self.running_count.copy_(count)

        def forward(self, observations: Any) -> Any:
            scaled = (observations.flatten(1) - self.running_mean) / (self.running_variance + 1e-8).sqrt()
            return scaled.clamp(-self.most, self.most)

    return Scaling


@cache
def _adapter() -> Any:
    """A vector environment as Stable-Baselines3 wants it; made when that is there."""
    base = require("stable_baselines3.common.vec_env", "learn").VecEnv

    class Adapter(base):  # type: ignore[misc,valid-type]
        def __init__(self, robots: Any) -> None:
            self.robots = robots
            super().__init__(robots.num_envs, robots.single_observation_space, robots.single_action_space)

        def reset(self) -> Any:
            seeds = [int(seed) if seed is not None else None for seed in self._seeds]
            observations, _ = self.robots.reset(seed=seeds)
            self._reset_seeds()
            return observations

        def step_async(self, actions: Any) -> None:
            self._actions = actions

        def step_wait(self) -> Any:
            seen, rewards, terminated, truncated, infos = self.robots.step(self._actions)
            over = terminated | truncated
            each: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
            for lane in np.flatnonzero(over):
                each[lane] = {
                    "terminal_observation": infos["final_obs"][lane],
                    "TimeLimit.truncated": bool(truncated[lane] and not terminated[lane]),
                }
            return seen, rewards.astype(np.float32), over, each

        def close(self) -> None:
            self.robots.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [getattr(self.robots, attr_name, None)] * len(list(self._get_indices(indices)))

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise AttributeError(
                "robots on one batch share their attributes: set them on their task, get_attr('task')[0]"
            )

        def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **options: Any) -> list[Any]:
            raise AttributeError("robots on one batch have no methods of their own: call methods of the task")

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * len(list(self._get_indices(indices)))

    return Adapter
