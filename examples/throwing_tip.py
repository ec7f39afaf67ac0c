"""An arm that lies on the floor throws its tip through three points: trajectory optimisation by exact gradients.

Two muscles, the natural curvatures of the arm's lower and upper half, take a new value every 10 ms for a second: 200
controls u. They are found by L-BFGS-B, within what the muscles can do, for the least of

    J(u) = sum_i |x_tip(t_i) - p_i|^2 / a^2 + w sum_k |u_k - u_(k-1)|^2,

with points p_i, times t_i, and an accuracy a that is worth as much as the second term, which prefers smooth controls.
The run is differentiable. One backward pass (the adjoint method) gives the derivative of J by the value of every call
that set a curvature during the run. It passes through contact with the floor too, which has a given stiffness and no
friction. The example fails if the tip misses a point, if derivatives differ from finite differences, or if the arm does
not leave the floor and come back.

Writes out/throwing_tip.png.
"""

from __future__ import annotations

import argparse
import sys
from itertools import count
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize

import withe
from withe.view import style

LENGTH, RADIUS, NODES = 0.3, 1e-2, 25  # [m]
FOOT = 0.03  # height of the clamp [m]
INTERVALS, INTERVAL, STEPS = 100, 10e-3, 2  # [s]; of each interval
STRONGEST = 15.0  # natural curvature [1/m]
POINTS = np.array([(0.22, 0.14), (0.29, 0.02), (0.08, 0.24)])  # x and z of the tip [m]
TIMES = (0.35, 0.6, 1.0)  # [s]
REACHED = np.array([round(t / INTERVAL) for t in TIMES])  # the interval at whose end
ACCURACY, SMOOTH = 1e-3, 1e-3  # a [m], w [m^2]
MISS = 1e-3  # allowed distance from a point [m]
STEP = 2e-6  # step of differences [1/m]: down to this step their error decreases with its square


class Thrown(NamedTuple):
    """A run of all intervals."""

    record: withe.Record  # a frame at the beginning and at the end of every interval
    touching: np.ndarray  # contacts with the floor in the middle of each

    @property
    def misses(self) -> np.ndarray:
        """From the tip to each point, when it should be there (points, 2) [m]."""
        return self.record.positions()[REACHED][:, -1, ::2] - POINTS


def resting() -> withe.Simulation:
    """The arm, clamped at a low foot, when it has come to rest on the floor."""
    scene = withe.Scene(gravity=(0.0, 0.0, -9.81))
    rubber = withe.Material(youngs_modulus=3e6, poisson_ratio=0.5, density=1100.0, viscosity=1000.0)
    start, end = (0.0, 0.0, FOOT), (LENGTH, 0.0, FOOT)
    arm = scene.add_rod(start=start, end=end, nodes=NODES, radius=RADIUS, material=rubber, name="arm")
    scene.clamp(arm.start)
    scene.add_floor(0.0)
    scene.enable_contact(stiffness=2e5, distance_tolerance=2e-3)
    # Solved to rounding error, so that differences between runs approximate derivatives.
    tolerances = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
    simulation = scene.build(
        integrator="backward_euler", planar=True, time_step=INTERVAL / STEPS, adaptive=False, **tolerances
    )
    simulation.run(3.0, progress=False)
    return simulation


def muscles() -> np.ndarray:
    """Natural curvature of every stencil for a unit of each muscle's, shape (2, stencils, 2): upwards."""
    upper = np.arange(NODES - 2) >= (NODES - 2) // 2
    return np.stack([np.outer(part, (0.0, 1.0)) for part in (~upper, upper)])


def throw(simulation: withe.Simulation, controls: np.ndarray, differentiable: bool = False) -> Thrown:
    """Run all intervals from a simulation, which does not change; controls have the shape (intervals, 2)."""
    shapes, touching, steps = muscles(), [], count()

    def act(now: withe.Simulation) -> None:
        interval, step = divmod(next(steps), STEPS)
        if step == 0:
            now.set("arm", natural_curvature=np.tensordot(controls[interval], shapes, 1))
        else:
            touching.append(len(now.contacts()))

    record = simulation.copy().run(
        len(controls) * INTERVAL, INTERVAL, before_step=act, progress=False, differentiable=differentiable
    )
    return Thrown(record, np.array(touching))


def objective(controls: np.ndarray, simulation: withe.Simulation) -> tuple[float, np.ndarray]:
    """J and its derivatives by all controls, (2 intervals,) each."""
    controls = controls.reshape(-1, 2)
    thrown, shapes = throw(simulation, controls, differentiable=True), muscles()
    jumps = np.diff(controls, axis=0, prepend=0.0)
    value = (thrown.misses**2).sum() / ACCURACY**2 + SMOOTH * (jumps**2).sum()
    by_controls = 2.0 * SMOOTH * (jumps - np.append(jumps[1:], np.zeros((1, 2)), axis=0))
    by_positions = np.zeros((len(controls) + 1, NODES, 3))
    by_positions[REACHED, -1, ::2] = 2.0 * thrown.misses / ACCURACY**2
    for k, call in enumerate(thrown.record.gradient({"positions": by_positions}, []).calls):
        by_controls[k] += np.tensordot(shapes, call.gradients["natural_curvature"], 2)
    return float(value), by_controls.ravel()


def error_of_derivatives(simulation: withe.Simulation, controls: np.ndarray) -> float:
    """By how much they differ from central differences along random directions, relative to the greatest."""
    random = np.random.default_rng(1)
    gradient = objective(controls, simulation)[1]
    exact, differences = [], []
    for way in random.normal(size=(4, controls.size)):
        ahead, back = (objective(controls + h * way, simulation)[0] for h in (STEP, -STEP))
        exact.append(gradient @ way)
        differences.append((ahead - back) / (2.0 * STEP))
    return float(np.abs(np.subtract(exact, differences)).max() / np.abs(differences).max())


def draw(thrown: Thrown, controls: np.ndarray, path: Path) -> None:
    """Draw the arm, the path of its tip, the points, and the controls of the muscles."""
    colors = style.use()
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.0), width_ratios=(1.2, 1))
    x = 100.0 * thrown.record.positions()
    axes[0].axhspan(-3.0, 0.0, color=colors.pale)
    for k in range(0, len(x), 4):
        axes[0].plot(x[k, :, 0], x[k, :, 2], color=colors.blue, alpha=0.2, linewidth=2)
    for k in REACHED:
        axes[0].plot(x[k, :, 0], x[k, :, 2], color=colors.blue, linewidth=5, solid_capstyle="round")
    axes[0].plot(x[:, -1, 0], x[:, -1, 2], color=colors.orange, linewidth=1.5)
    box = {"facecolor": colors.paper, "edgecolor": "none", "pad": 1.5}
    for point, time in zip(100.0 * POINTS, TIMES, strict=True):
        axes[0].plot(*point, "o", color=colors.red, zorder=3)
        axes[0].annotate(f"{time:g} s", point, (8, 8), textcoords="offset points", bbox=box)
    axes[0].set(aspect="equal", xlim=(-2, 36), ylim=(-3, 27))
    style.label(axes[0], x=("x", "cm"), y=("z", "cm"))
    times = INTERVAL * np.arange(len(controls))
    for values, name, color in zip(controls.T, ("lower half", "upper half"), (colors.blue, colors.orange), strict=True):
        axes[1].step(times, values, where="post", color=color, label=name)
    axes[1].fill_between(
        times,
        0,
        1,
        where=thrown.touching > 0,
        transform=axes[1].get_xaxis_transform(),
        color=colors.pale,
        label="on floor",
    )
    style.label(axes[1], x=("time", "s"), y=("natural curvature", "1/m"))
    style.legend(axes[1], side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Optimise, check, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--iterations", type=int, default=400, help="of L-BFGS-B, at most")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 30 s.", flush=True)

    simulation = resting()
    bar = withe.track(range(arguments.iterations), "optimising", unit="iterations")
    found = minimize(
        objective,
        np.zeros(2 * INTERVALS),
        args=(simulation,),
        jac=True,
        method="L-BFGS-B",
        bounds=[(-STRONGEST, STRONGEST)] * (2 * INTERVALS),
        options={"maxiter": arguments.iterations, "maxfun": 2 * arguments.iterations, "maxcor": 30},
        callback=lambda _: next(bar, None),
    )
    bar.close()
    controls = found.x.reshape(-1, 2)
    thrown = throw(simulation, controls)
    greatest = np.linalg.norm(thrown.misses, axis=1).max()
    aloft = np.flatnonzero(thrown.touching == 0)
    touched = 0 if not len(aloft) else int((thrown.touching[aloft[0] :] > 0).sum())
    error = error_of_derivatives(simulation, found.x)
    print(f"{found.x.size} controls, {found.nit} iterations, {found.nfev} runs with gradients; J = {found.fun:.3f}")
    print(f"the tip passes within {1e3 * greatest:.3f} mm of each point")
    print(f"on the floor for {thrown.touching.astype(bool).sum()} of {INTERVALS} intervals, {touched} after it left it")
    print(f"derivatives {error:.1e} from central differences")
    draw(thrown, controls, arguments.out / "throwing_tip.png")
    print(f"Wrote {arguments.out / 'throwing_tip.png'}.")
    if greatest > MISS:
        sys.exit("The tip misses a point.")
    if touched == 0 or error > 1e-6:
        sys.exit("The arm does not come back to the floor, or the derivatives are not those of differences.")


if __name__ == "__main__":
    main()
