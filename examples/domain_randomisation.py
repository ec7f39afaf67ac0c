"""Domain randomisation in Gymnasium: no two episodes have the same arm, and only feedback reaches the goal in all.

The tip of a hanging arm is to reach a point. `Reach` is a `withe.learning.Task`, whose method `begin` draws the arm of
an episode: Young's modulus, density and the mass of a tool. `VectorEnvironment` steps all arms in one batch. Two
controllers know the nominal arm only. One applies the action that brings the nominal arm to the goal. The other
observes the tip and corrects the action. A policy from `withe.learning.train_policy` could take their place. Fails if
feedback does not end ten times closer on the mean. Needs Gymnasium. Writes out/domain_randomisation.png.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.view import style

GOAL, GAIN = np.array([0.10, 0.06]), 0.15  # x and y of the tip [m]; share of the error removed in a control step


class Reach(withe.learning.Task):
    """The tip of an arm is to reach a point. The arm is random, or nominal with `spread` 0."""

    action_size, control_step, steps = 2, 0.1, 50

    def __init__(self, spread: float = 1.0) -> None:
        self.spread = spread

    def build(self, generator: np.random.Generator) -> withe.Simulation:
        """The nominal arm."""
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=1e5)
        arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.3), nodes=16, radius=1e-2, material=rubber, name="arm")
        scene.clamp(arm.start)
        scene.add_drag(1.0)
        scene.add_mass(arm.end, 0.01, name="tool")
        return scene.build(integrator="backward_euler", time_step=0.01)

    def begin(self, robots: withe.Batch, chosen: np.ndarray, generators: list[np.random.Generator]) -> None:
        """Draw an arm for each episode that begins."""
        drawn = self.spread * np.array([generator.uniform(-1.0, 1.0, 3) for generator in generators])
        modulus, density = 1e6 * 2.0 ** drawn[:, 0], 1000.0 * 1.2 ** drawn[:, 1]  # half to twice the nominal modulus
        robots.set("arm", youngs_modulus=modulus, density=density, lanes=chosen)
        robots.set("tool", mass=0.01 * (1.0 + drawn[:, 2]), lanes=chosen)

    def act(self, robots: withe.Batch, actions: np.ndarray, chosen: np.ndarray) -> None:
        """Bend the arm."""
        robots.set("arm", natural_curvature=15.0 * actions, over=self.control_step, lanes=chosen)

    def observe(self, robots: withe.Batch) -> np.ndarray:
        """Tip relative to the goal, (n, 2) [m]."""
        return robots.positions("arm")[:, -1, :2] - GOAL

    def reward(self, robots: withe.Batch) -> np.ndarray:
        """Minus the distance to the goal [m]."""
        return -np.linalg.norm(self.observe(robots), axis=1)


def episodes(task: Reach, count: int, choose: Callable[..., np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """One episode of each arm by choose(errors, last actions): errors (steps + 1, n, 2) [m], last actions (n, 2)."""
    arms, actions = withe.learning.VectorEnvironment(task, count), np.zeros((count, 2))
    errors = [arms.reset(seed=7)[0]]
    for _ in withe.track(range(task.steps), "episodes", unit="steps"):
        actions = np.clip(choose(errors[-1], actions), -1.0, 1.0)
        errors.append(arms.step(actions)[0])
    return np.array(errors, float), actions


def draw(found: dict[str, np.ndarray], path: Path) -> None:
    """Draw the ends of the tips, and their distances to the goal over time."""
    colors = style.use()
    figure, (above, over_time) = plt.subplots(1, 2, figsize=(10.0, 4.2))
    for (name, errors), color in zip(found.items(), (colors.red, colors.blue), strict=True):
        apart = 1e3 * np.linalg.norm(errors, axis=2)
        times = Reach.control_step * np.arange(len(apart))
        above.plot(*1e3 * (errors[-1] + GOAL).T, ".", color=color, alpha=0.6, label=name)
        over_time.fill_between(times, *np.quantile(apart, (0.05, 0.95), axis=1), color=color, alpha=0.25, lw=0)
        over_time.plot(times, np.median(apart, axis=1), color=color, label=name)
    above.plot(*1e3 * GOAL, "+", color=colors.ink, markersize=14, label="goal")
    above.set(aspect="equal", title="tips at the end, from above")
    over_time.set(title="distance to the goal: median, 90 % of the arms", ylim=(0.0, None))
    for axes, labels in ((above, (("x", "mm"), ("y", "mm"))), (over_time, (("time", "s"), ("distance", "mm")))):
        style.label(axes, *labels)
        style.legend(axes, side="top", ncols=3)
    figure.savefig(path)


def main() -> None:
    """Probe the nominal arm, control random arms in both ways, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arms", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    print("Takes about 8 s.", flush=True)

    probed, _ = episodes(Reach(0.0), 3, lambda error, last: 0.3 * np.eye(3, 2))
    response = (probed[-1, :2] - probed[-1, 2]) / 0.3  # displacement of the nominal tip by each action [m]

    def feedback(error: np.ndarray, last: np.ndarray) -> np.ndarray:
        return last - GAIN * error @ np.linalg.inv(response)

    _, nominal = episodes(Reach(0.0), 1, feedback)
    ways = {"same action": lambda error, last: nominal + 0.0 * last, "feedback": feedback}
    found = {name: episodes(Reach(), arguments.arms, choose)[0] for name, choose in ways.items()}
    means = {name: 1e3 * np.linalg.norm(errors[-1], axis=1).mean() for name, errors in found.items()}
    print(", ".join(f"{name}: {mean:.2f} mm off on the mean" for name, mean in means.items()))
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw(found, arguments.out / "domain_randomisation.png")
    if means["feedback"] > 0.1 * means["same action"]:
        sys.exit("Feedback should reach the goal with every arm.")


if __name__ == "__main__":
    main()
