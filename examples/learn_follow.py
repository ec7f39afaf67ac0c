"""An arm learns to follow a target: soft actor-critic, its learning curve, and the learned arm as a film.

An action adds to the bends, so that noise of actions adds up. With deviations of 1 the tip is 12 cm off after 0.3 s and
27 cm after 1 s; rewards begin within 10 cm. Soft actor-critic learns how much noise each state tolerates. It learns
from all steps that it remembers, not from the last steps only.

python examples/learn_follow.py [STEPS] [SEED] [FOLDER]; 1,300,000 steps by default, in out/learn_follow, which take
some 20 minutes of one processor.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from pathlib import Path
from typing import Any

import numpy as np

import withe
from withe.view import style

DISCOUNT = 0.99
HORIZON = 0.9  # discount of the training: effects of an action are visible within a second
PUBLISHED = 99.0  # discounted return after 3e6 steps [arXiv 2511.06667]
BETWEEN = 50_000  # control steps from one look to the next


class Aimed(withe.learning.Follow):
    """Task `Follow` with the additional observation of the target relative to the tip, enlarged within 0.1 m."""

    def observe(self, robots: withe.Batch) -> np.ndarray:
        """Observations of each robot, shape (n, 79)."""
        seen = super().observe(robots)
        apart = seen[:, 70:73] - seen[:, 27:30]
        return np.hstack([seen, np.tanh(apart / 0.1)])


def discounted_return(choose: Any, episodes: int = 16, seed: int = 1000, task: Any = None) -> float:
    """Mean over episodes of sum 0.99^i r_i, of actions = choose(observations, robots)."""
    task = task or withe.learning.Follow()
    robots = withe.learning.VectorEnvironment(task, episodes)
    seen, _ = robots.reset(seed=seed)
    total, going = np.zeros(episodes), np.ones(episodes, bool)
    for step in withe.track(range(task.steps), "measuring", unit="steps"):
        seen, rewards, terminated, truncated, _ = robots.step(choose(seen, robots.robots))
        total += DISCOUNT**step * rewards * going
        going &= ~(terminated | truncated)
    robots.close()
    return float(total.mean())


class Curve:
    """Score of a policy while it learns, by steps and time of all processors; the latest policy is stored in a file."""

    def __init__(self, folder: Path, between: int = BETWEEN, task: Any = None) -> None:
        self.folder, self.between, self.task, self.rows = folder, between, task, []
        self.start = time.process_time()
        folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, policy: Any) -> None:
        """Now and then: measure, and save."""
        steps = policy.num_timesteps
        if self.rows and steps < self.rows[-1][0] + self.between:
            return
        spent = time.process_time() - self.start
        found = discounted_return(lambda seen, _: policy.predict(seen, deterministic=True)[0], task=self.task)
        self.start += time.process_time() - self.start - spent  # looking is no part of learning
        self.rows.append((steps, spent, found))
        policy.save(self.folder / "policy.zip")
        header = "steps,processor seconds,return"
        np.savetxt(self.folder / "curve.csv", self.rows, delimiter=",", header=header, comments="")
        print(f"{steps:10,} steps {spent / 60:6.1f} processor minutes   discounted return {found:6.1f}", flush=True)


def draw_curve(folder: Path, title: str) -> None:
    """The learning curve, curve.png."""
    import matplotlib.pyplot as plt

    colors = style.use()
    steps, _, returns = np.loadtxt(folder / "curve.csv", delimiter=",", skiprows=1, unpack=True, ndmin=2)
    figure, axes = plt.subplots(figsize=(6.4, 4.0))
    axes.plot(steps / 1e6, returns, color=colors.blue, label="learned")
    axes.axhline(PUBLISHED, color=colors.grey, linestyle="--", label="published after 3 million steps")
    axes.axhline(0.8 * PUBLISHED, color=colors.grey, linestyle=":", label="80 % of it")
    axes.set_title(f"Follow: {title}, one seed")
    style.label(axes, x=("control steps", "million"), y="discounted return")
    style.legend(axes, side="top")
    figure.savefig(folder / "curve.png")
    plt.close(figure)


def film(choose: Any, path: Path, seconds: float = 20.0, seed: int = 5, task: Any = None) -> None:
    """The arm by actions = choose(observations, robots), one picture a control step; .mp4 or .gif."""
    import imageio_ffmpeg
    from PIL import Image

    env = withe.learning.Environment(task or withe.learning.Follow(), render_mode="rgb_array")
    seen, _ = env.reset(seed=seed)
    pictures = []
    for _ in range(round(seconds / env.task.control_step)):
        seen, *_ = env.step(choose(seen[None], [env.simulation])[0])
        pictures.append(env.render())
    env.close()
    if path.suffix == ".gif":
        first, *others = (Image.fromarray(picture) for picture in pictures)
        first.save(path, save_all=True, append_images=others, duration=100, loop=0)
        return
    height, width, _ = pictures[0].shape
    writer = imageio_ffmpeg.write_frames(str(path), (width, height), fps=10, macro_block_size=2)
    writer.send(None)
    for picture in pictures:
        writer.send(np.ascontiguousarray(picture))
    writer.close()


def asked(text: str, steps: int, folder: Path) -> tuple[int, int, Path]:
    """Steps, seed and folder of the command line."""
    parser = argparse.ArgumentParser(description=text.splitlines()[0])
    parser.add_argument("steps", type=int, nargs="?", default=steps, help=f"control steps; {steps:,}")
    parser.add_argument("seed", type=int, nargs="?", default=0, help="0")
    parser.add_argument("folder", type=Path, nargs="?", default=folder, help=f"of the curve and the film; {folder}")
    arguments = parser.parse_args()
    return arguments.steps, arguments.seed, arguments.folder


def check_tools() -> None:
    """Report missing packages for the film before a long run."""
    missing = [name for name in ("imageio_ffmpeg", "matplotlib") if importlib.util.find_spec(name) is None]
    if missing:
        raise SystemExit(f"the film needs {', '.join(missing)}: pip install 'withe[view]' (make view)")


def main() -> None:
    """Learn, draw, film."""
    steps, seed, folder = asked(__doc__, 1_300_000, Path("out/learn_follow"))
    check_tools()
    print("Takes about 20 minutes.", flush=True)
    policy = withe.learning.train_policy(
        Aimed(),
        steps,
        environments=64,
        seed=seed,
        callback=Curve(folder, task=Aimed()),
        gamma=HORIZON,
        gradient_steps=4,
        batch_size=512,
        tau=0.01,
        policy_kwargs={"net_arch": [64, 64]},
    )
    draw_curve(folder, "soft actor-critic")
    film(lambda seen, _: policy.predict(seen, deterministic=True)[0], folder / "learned.mp4", task=Aimed())


if __name__ == "__main__":
    main()
