"""A snake crawls over a floor that its scales hold more across it, and backwards, than forwards.

Its muscles bend it by a couple that travels from its head to its tail, B(s) sin(2 pi (t / T - s / L)): natural
curvature of that couple over EI. Friction is the weight times mu forwards, 1.5 mu backwards and 2 mu across, so that
it crawls with its head in front [Hu, Nirody, Scott and Shelley 2009, PNAS 106]. Sizes, muscles and friction are those
of the continuum snake of PyElastica [Gazzola, Dudte, McCormick and Mahadevan 2018, R. Soc. open sci. 5], whose version
1.0 crawls at PEER. Fails where that is more than 3 % off, or where the snake crawls on another floor on which friction
is the same in all directions.

Writes out/snake.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import BSpline

import withe
from withe.view import style

LENGTH, RADIUS, DENSITY, MODULUS, GRAVITY = 0.35, 0.35 * 0.011, 1000.0, 1e6, 9.80665
PERIOD, FROUDE = 2.0, 0.1
FRICTION = LENGTH / (PERIOD**2 * GRAVITY * FROUDE)
COUPLES = (3.4e-3, 3.3e-3, 4.2e-3, 2.6e-3, 3.6e-3, 3.5e-3)  # coefficients of a cubic B-spline from tail to head [N m]
PEER = 0.0278  # [m/s]


def crawl(
    friction: tuple[float, float, float], nodes: int, time_step: float, periods: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shapes, shape (frames, nodes, 3), 50 a period, and the mean speed of each period [m/s]."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    flesh = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=DENSITY)
    snake = scene.add_rod(
        start=(0, 0, RADIUS),
        end=(LENGTH, 0, RADIUS),
        nodes=nodes,
        radius=RADIUS,
        material=flesh,
        normal=(0, 1, 0),
        name="snake",
    )
    scene.add_floor(friction=friction)
    simulation = scene.build(time_step=time_step)
    s = (np.arange(snake.stencils) + 1.0) / (nodes - 1)
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, len(COUPLES) - 2), np.ones(3)])
    couple = BSpline(knots, COUPLES, 3)(1.0 - s)
    stiffness = MODULUS * np.pi * RADIUS**4 / 4.0

    def bend(now: withe.Simulation) -> None:
        t = now.time + 0.5 * time_step
        wave = couple * np.sin(2.0 * np.pi * (t / PERIOD - (1.0 - s))) * min(t / PERIOD, 1.0)
        now.set(snake, natural_curvature=np.column_stack([wave / stiffness, np.zeros_like(s)]))

    record = simulation.run(periods * PERIOD, record_every=PERIOD / 50, before_step=bend)
    shapes = record.positions(snake)
    middles = shapes[::50, :, :2].mean(axis=1)
    return shapes, np.linalg.norm(np.diff(middles, axis=0), axis=1) / PERIOD


def draw(shapes: np.ndarray, speeds: np.ndarray, path: Path) -> None:
    """Draw the positions of the snake from above, and its speed."""
    colors = style.use()
    figure, (above, below) = plt.subplots(2, 1, figsize=(7.2, 4.6), height_ratios=(3, 2))
    chosen = shapes[:: 50 + 12]
    for shape, shade in zip(chosen, style.ramp()(np.linspace(0.0, 1.0, len(chosen))), strict=True):
        above.plot(*shape[:, :2].T, color=shade, linewidth=3.0)
        above.plot(*shape[-1, :2], "o", color=colors.red, markersize=6)
    above.plot(*shapes[:, :, :2].mean(axis=1).T, color=colors.grey, linestyle=":", label="middle")
    above.set(aspect="equal", title="from above, light at first; heads are dots")
    style.label(above, x=("x", "m"), y=("y", "m"))
    style.legend(above, side="top")
    below.plot(np.arange(len(speeds)) + 0.5, 1e3 * speeds, "o-", color=colors.blue, label="withe")
    below.axhline(1e3 * PEER, color=colors.red, linestyle="--", label="PyElastica")
    below.set_ylim(0, None)
    style.label(below, x="period", y=("mean speed", "mm/s"))
    style.legend(below, side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Crawl, compare, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=51)
    parser.add_argument("--step", type=float, default=5e-3)
    parser.add_argument("--periods", type=int, default=6)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 5 s.", flush=True)

    options = arguments.nodes, arguments.step, arguments.periods
    shapes, speeds = crawl((FRICTION, 1.5 * FRICTION, 2.0 * FRICTION), *options)
    _, nowhere = crawl((FRICTION,) * 3, *options)
    draw(shapes, speeds, arguments.out / "snake.png")
    off = speeds[-1] / PEER - 1.0
    print(
        f"Crawls at {1e3 * speeds[-1]:.2f} mm/s, {off:+.1%} of PyElastica's; on even friction {1e3 * nowhere[-1]:.2f}."
    )
    print(f"Wrote {arguments.out / 'snake.png'}.")
    if abs(off) > 0.03 or nowhere[-1] > 0.1 * speeds[-1]:
        sys.exit("That is not how this snake crawls.")


if __name__ == "__main__":
    main()
