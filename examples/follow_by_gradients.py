"""An arm learns to follow a target by analytic policy gradients: the simulation says how each action should have been.

Some arms go on for a short horizon under the policy. The run of each is differentiable, and one way back through it
(`record.gradient`) gives the derivatives of

    L = sum_k sqrt(d_k^2 + e^2),    d_k from the tip to the target after control step k, e = 3 cm,

by every action a_k of the horizon. The policy's weights then take a step of Adam down sum_k dL/da_k . pi(o_k), with the
observations o_k as recorded. The effect of an action on later observations is ignored, and so is everything beyond the
horizon. Both make the gradient cheap and less noisy, at the cost of foresight beyond the horizon.

python examples/follow_by_gradients.py [STEPS] [SEED] [FOLDER]; 300,000 control steps by default.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from learn_follow import Aimed, Curve, asked, check_tools, draw_curve, film

import withe

ARMS, HORIZON, CONTROL_STEP = 16, 8, 0.1  # [-], control steps, [s]
SEGMENTS, BEND_STEP, MOST_BEND = np.array([3, 4, 4, 4, 4]), 0.05, 2.0
EDGES = 20  # on 1 m
LOW, HIGH, SPEED, TURNING = (
    np.array([-0.6, -0.6, 0.3]),
    np.array([0.6, 0.6, 0.9]),
    0.5,
    0.025,
)  # limits, speed and turning of the target
NEAR = 0.03  # e [m]
LENGTH_OF_EPISODE = 500


class Policy:
    """A small network with the interface of policies of Stable-Baselines3."""

    def __init__(self, seed: int) -> None:
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        sizes = (79, 128, 128, 10)
        layers: list[Any] = []
        for size, after in pairwise(sizes):
            layers += [torch.nn.Linear(size, after), torch.nn.Tanh()]
        self.network = torch.nn.Sequential(*layers)
        with torch.no_grad():
            layers[-2].weight.mul_(0.1)
        self.num_timesteps = 0

    def predict(self, seen: np.ndarray, deterministic: bool = True) -> tuple[np.ndarray, None]:
        """Actions for observations."""
        with torch.no_grad():
            return self.network(torch.as_tensor(np.asarray(seen, np.float32))).numpy(), None

    def save(self, path: Path) -> None:
        """Keep the weights."""
        torch.save(self.network.state_dict(), path)


class Pursuit:
    """An arm, its bends and its target, as in `Follow`."""

    def __init__(self, drawn: withe.Simulation, generator: np.random.Generator) -> None:
        self.drawn, self.random = drawn, generator
        self.begin()

    def begin(self) -> None:
        """Upright, a target anywhere."""
        self.arm, self.bends = self.drawn.copy(), np.zeros((5, 2))
        self.target, self.way = self.random.uniform(LOW, HIGH), self._direction()
        self.left = int(self.random.integers(LENGTH_OF_EPISODE // 2, LENGTH_OF_EPISODE))

    def _direction(self) -> np.ndarray:
        way = self.random.normal(size=3)
        return SPEED * way / np.linalg.norm(way)

    def lead_target(self) -> None:
        """Walls send it back."""
        if self.random.random() < TURNING:
            self.way = self._direction()
        there = self.target + CONTROL_STEP * self.way
        outside = (there < LOW) | (there > HIGH)
        self.way, self.target = np.where(outside, -self.way, self.way), np.where(outside, self.target, there)

    def seen(self, arm: withe.Simulation) -> np.ndarray:
        """As `Aimed` is observed, shape (79,)."""
        nodes, aim = slice(2, None, 2), np.tanh((self.target - arm.positions("arm")[-1]) / 0.1)
        parts = (arm.positions("arm")[nodes], arm.velocities("arm")[nodes], self.bends, self.target, self.way, aim)
        return np.concatenate([part.ravel() for part in parts]).astype(np.float32)

    def go(self, policy: Policy) -> tuple[np.ndarray, np.ndarray]:
        """Return observations (HORIZON, 79) of one horizon, and derivatives of L by its actions (HORIZON, 10)."""
        steps, count = round(CONTROL_STEP / self.arm.time_step), iter(range(10**9))
        seen, targets, free, slopes = [], [], [], []

        def act(now: withe.Simulation) -> None:
            if next(count) % steps:
                return
            seen.append(self.seen(now))
            action = policy.predict(seen[-1])[0]
            wanted = self.bends + BEND_STEP * action.reshape(2, 5).T
            self.bends = np.clip(wanted, -MOST_BEND, MOST_BEND)
            free.append(wanted == self.bends)
            curvature = np.repeat(self.bends / SEGMENTS[:, None], SEGMENTS, axis=0)
            now.set("arm", discrete_curvature=curvature, over=CONTROL_STEP)
            # Derivatives are by smooth curvatures k: k V = 2 arctan(kappa / 2) of each component.
            slopes.append(EDGES / (1.0 + 0.25 * (self.bends / SEGMENTS[:, None]) ** 2))
            self.lead_target()
            targets.append(self.target)

        record = self.arm.run(
            HORIZON * CONTROL_STEP, CONTROL_STEP, before_step=act, progress=False, differentiable=True
        )
        apart = record.positions("arm")[1:, -1] - np.array(targets)
        by_positions = np.zeros((HORIZON + 1, *record.positions("arm").shape[1:]))
        by_positions[1:, -1] = apart / np.sqrt((apart**2).sum(axis=1, keepdims=True) + NEAR**2)
        calls = record.gradient({"positions": {"arm": by_positions}}, []).calls
        first = np.cumsum(SEGMENTS) - SEGMENTS
        by_bends = [
            np.add.reduceat(call.gradients["natural_curvature"], first) / SEGMENTS[:, None] * slope
            for call, slope in zip(calls, slopes, strict=True)
        ]
        by_actions = np.zeros((HORIZON, 5, 2))
        later = np.zeros((5, 2))
        for k in reversed(range(HORIZON)):
            later = (by_bends[k] + later) * free[k]
            by_actions[k] = BEND_STEP * later
        self.left -= HORIZON
        return np.array(seen), by_actions.swapaxes(1, 2).reshape(HORIZON, 10)


def learn(steps: int, seed: int, curve: Curve) -> Policy:
    """Return the policy after a total number of control steps of all arms."""
    policy, generator = Policy(seed), np.random.default_rng(seed)
    drawn = withe.learning.Follow().build(generator)
    pursuits = [Pursuit(drawn, each) for each in generator.spawn(ARMS)]
    adam = torch.optim.Adam(policy.network.parameters(), 3e-3)
    schedule = torch.optim.lr_scheduler.LinearLR(adam, 1.0, 0.1, steps // (ARMS * HORIZON))
    while policy.num_timesteps < steps:
        curve(policy)
        seen, wanted = [], []
        for pursuit in pursuits:
            if pursuit.left <= 0:
                pursuit.begin()
            try:
                observations, gradients = pursuit.go(policy)
            except withe.ConvergenceError:
                pursuit.begin()
                continue
            seen.append(observations)
            wanted.append(gradients)
        adam.zero_grad()
        weights = torch.as_tensor(np.concatenate(wanted), dtype=torch.float32)
        (weights * policy.network(torch.as_tensor(np.concatenate(seen)))).sum(1).mean().backward()
        torch.nn.utils.clip_grad_norm_(policy.network.parameters(), 0.1)
        adam.step()
        schedule.step()
        policy.num_timesteps += ARMS * HORIZON
    curve(policy)
    return policy


def main() -> None:
    """Learn, draw, film."""
    steps, seed, folder = asked(__doc__, 300_000, Path("out/follow_by_gradients"))
    check_tools()
    print("Takes about 12 minutes.", flush=True)
    policy = learn(steps, seed, Curve(folder, between=10_000, task=Aimed()))
    draw_curve(folder, "analytic policy gradients")
    film(lambda seen, _: policy.predict(seen, deterministic=True)[0], folder / "learned.mp4", task=Aimed())


if __name__ == "__main__":
    main()
