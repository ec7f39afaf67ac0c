"""An arm learns to follow a target: proximal policy optimisation, its learning curve, and the learned arm as a film.

python examples/learn_follow.py [STEPS] [SEED] [FOLDER]; 3,000,000 steps by default, in out/learn_follow.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import withe

DISCOUNT = 0.99
HORIZON = 0.98  # discount that is learned with: returns of the next 5 s vary less than those of the next 10
PUBLISHED = 99.0  # discounted return after 3e6 steps [arXiv 2511.06667]
BETWEEN = 100_000  # control steps from one look to the next


def discounted_return(choose: Any, episodes: int = 16, seed: int = 1000, task: Any = None) -> float:
    """Mean over episodes of sum 0.99^i r_i, of actions = choose(observations, robots)."""
    task = task or withe.learning.Follow()
    robots = withe.learning.VectorEnvironment(task, episodes)
    seen, _ = robots.reset(seed=seed)
    total, going = np.zeros(episodes), np.ones(episodes, bool)
    for step in range(task.steps):
        seen, rewards, terminated, truncated, _ = robots.step(choose(seen, robots.robots))
        total += DISCOUNT**step * rewards * going
        going &= ~(terminated | truncated)
    robots.close()
    return float(total.mean())


class Curve:
    """How good a policy is while it learns; the latest is kept in a file."""

    def __init__(self, folder: Path, between: int = BETWEEN) -> None:
        self.folder, self.between, self.rows, self.start = folder, between, [], time.perf_counter()
        folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, policy: Any) -> None:
        """Now and then: measure, and save."""
        steps = policy.num_timesteps
        if self.rows and steps < self.rows[-1][0] + self.between:
            return
        found = discounted_return(lambda seen, _: policy.predict(seen, deterministic=True)[0])
        self.rows.append((steps, time.perf_counter() - self.start, found))
        policy.save(self.folder / "policy.zip")
        np.savetxt(self.folder / "curve.csv", self.rows, delimiter=",", header="steps,seconds,return", comments="")
        print(f"{steps:10,} steps {self.rows[-1][1]:7.0f} s   discounted return {found:7.1f}", flush=True)


def draw_curve(folder: Path, title: str) -> None:
    """The learning curve, curve.png."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    steps, _, returns = np.loadtxt(folder / "curve.csv", delimiter=",", skiprows=1, unpack=True, ndmin=2)
    figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
    axes.plot(steps / 1e6, returns, color="#00798c", label="learned")
    axes.axhline(PUBLISHED, color="#8d96a3", linestyle="--", label="published after 3 million steps")
    axes.axhline(0.8 * PUBLISHED, color="#8d96a3", linestyle=":", label="80 % of it")
    axes.set(xlabel="control steps [million]", ylabel="discounted return", title=f"Follow: {title}, one seed")
    axes.legend(frameon=False)
    axes.grid(color="#dddddd", linewidth=0.5)
    figure.savefig(folder / "curve.png", dpi=150)
    plt.close(figure)


def film(choose: Any, path: Path, seconds: float = 20.0, seed: int = 5) -> None:
    """The arm by actions = choose(observations, robots), one picture a control step; .mp4 or .gif."""
    import imageio.v2 as imageio

    env = withe.learning.Environment(withe.learning.Follow(), render_mode="rgb_array")
    seen, _ = env.reset(seed=seed)
    timing = {"duration": 100, "loop": 0} if path.suffix == ".gif" else {"fps": 10}
    with imageio.get_writer(path, **timing) as writer:
        for _ in range(round(seconds / env.task.control_step)):
            seen, *_ = env.step(choose(seen[None], [env.simulation])[0])
            writer.append_data(env.render())
    env.close()


def main() -> None:
    """Learn, draw, film."""
    steps, seed = int(sys.argv[1]) if len(sys.argv) > 1 else 3_000_000, int(sys.argv[2]) if len(sys.argv) > 2 else 0
    folder = Path(sys.argv[3]) if len(sys.argv) > 3 else Path("out/learn_follow")
    warnings.simplefilter("ignore", withe.CoarseStepWarning)  # steps are as long as a tip within 1 cm allows
    policy = withe.learning.train_policy(
        withe.learning.Follow(),
        steps,
        environments=64,
        seed=seed,
        callback=Curve(folder),
        n_steps=128,
        batch_size=2048,
        n_epochs=6,
        gamma=HORIZON,
        learning_rate=lambda left: 1e-3 * left,
        policy_kwargs={"net_arch": [128, 128]},
    )
    draw_curve(folder, "proximal policy optimisation")
    film(lambda seen, _: policy.predict(seen, deterministic=True)[0], folder / "learned.mp4")


if __name__ == "__main__":
    main()
