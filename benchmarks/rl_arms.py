"""The arm of the learning tasks under seeded actions: how far its tip is from a converged run, and how fast it goes."""

from __future__ import annotations

import time
from functools import lru_cache
from typing import Any

import numpy as np

import withe
from withe.learning.arms import Arm

__all__ = [
    "ACTIONS",
    "FreeArm",
    "PlanarArm",
    "actions_of",
    "control_steps",
    "converged_tips",
    "penetration",
    "references_agree",
    "settled_tip",
    "tip_error",
    "tips",
]

ACTIONS = 60
FINE = 32  # shorter steps of the converged run
AGREE = 2e-3  # difference from a run with steps twice as long [m]: chaotic runs do not converge
WARM = 10  # control steps before the clock runs


class FreeArm(withe.learning.Follow):
    """The arm that follows, for any step length and options."""


class PlanarArm(withe.learning.Obstacles2D):
    """The planar arm in steps of 0.1 s, without obstacles."""

    control_step = 0.1
    time_step = 0.05
    bend_step = 0.05
    places = ()


def actions_of(seed: int, size: int, count: int = ACTIONS) -> np.ndarray:
    """Seeded actions, shape (count, size)."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, size))


def _converged(task: Arm, fine: int) -> Arm:
    """The same in short steps, solved tightly."""
    task.time_step = task.time_step / fine
    build = task.build

    def tight(generator: np.random.Generator) -> withe.Simulation:
        original = withe.Scene.build

        def strictly(scene: withe.Scene, **options: Any) -> withe.Simulation:
            return original(scene, **(options | {"solver": withe.Solver(step_tolerance=1e-9, force_tolerance=1e-8)}))

        withe.Scene.build = strictly
        try:
            return build(generator)
        finally:
            withe.Scene.build = original

    task.build = tight
    return task


def tips(task: Arm, seed: int, count: int = ACTIONS) -> np.ndarray:
    """Tip after each action, shape (count, 3) [m]."""
    env = withe.learning.Environment(task)
    env.reset(seed=seed)
    found = []
    for action in actions_of(seed, task.action_size, count):
        env.step(action)
        found.append(env.simulation.positions("arm")[-1])
    return np.array(found)


@lru_cache(maxsize=64)
def converged_tips(kind: type[Arm], seed: int, count: int = ACTIONS, fine: int = FINE) -> np.ndarray:
    """Tip after each action in short steps, shape (count, 3) [m]."""
    return tips(_converged(kind(), fine), seed, count)


def references_agree(kind: type[Arm], seed: int, count: int = ACTIONS) -> bool:
    """True if runs in short steps and in half as long steps agree."""
    return _apart(converged_tips(kind, seed, count), converged_tips(kind, seed, count, FINE // 2)) < AGREE


def settled_tip(turns: np.ndarray, gravity: float) -> np.ndarray:
    """Tip of the free arm at rest, bent by these turns of its nodes, shape (2, 19) [m]."""
    arm = FreeArm().build(np.random.default_rng(0))
    arm.set(gravity=(0.0, 0.0, -gravity))
    arm.set("arm", natural_curvature=20.0 * turns.T)
    arm.equilibrium()
    return arm.positions("arm")[-1]


def tip_error(kind: type[Arm], seed: int, count: int = ACTIONS) -> float:
    """Return the RMS distance of the tip from the tip of a converged run [m]."""
    return _apart(tips(kind(), seed, count), converged_tips(kind, seed, count))


def _apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum((first - second) ** 2, axis=1))))


def penetration(kind: type[Arm], seed: int, radius: float, count: int = 50) -> float:
    """Deepest that the arm sinks into an obstacle, over the smaller radius."""
    env = withe.learning.Environment(kind())
    env.reset(seed=seed)
    deepest = 0.0
    for action in actions_of(seed, env.task.action_size, count):
        env.step(action)
        contacts = env.simulation.contacts()
        if len(contacts):
            deepest = max(deepest, -float(contacts["gap"].min()))
    return deepest / radius


def control_steps(kind: type[Arm], count: int, workers: int, steps: int) -> float:
    """Control steps a second of `count` environments, Python included; after some that bring arms into motion."""
    envs = withe.learning.VectorEnvironment(kind(), count, workers)
    envs.reset(seed=1)
    generator = np.random.default_rng(0)
    every = generator.uniform(-1.0, 1.0, (steps + WARM, count, envs.task.action_size))
    for actions in every[:WARM]:
        envs.step(actions)
    start = time.perf_counter()
    for actions in every[WARM:]:
        envs.step(actions)
    return count * steps / (time.perf_counter() - start)
