"""A thousand arms of different stiffness sag under their own weight, in one batch, against the elastica.

The arms differ in Young's modulus only. Their shape depends on one number, G = w L^3 / EI, with the weight w per
length, the length L and the bending stiffness EI. The elastica of an inextensible arm is

    theta'' = -G (1 - s) cos(theta),    theta(0) = 0,    theta'(1) = 0,

and a stiff arm sags by G L / 8. A batch finds all equilibria in one call, on all cores. Each arm starts straight.
The example fails if a tip is more than 1e-3 L off the elastica. Writes out/stiffness_sweep.png.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

import withe
from withe.view import style

LENGTH, RADIUS, DENSITY, GRAVITY = 0.3, 2e-3, 1100.0, 9.81  # [m], [m], [kg/m^3], [m/s^2]
NODES, ARMS = 81, 1000
LOADS = (0.1, 100.0)  # least and greatest G
TOLERANCE = 1e-3  # relative to the length


def modulus(load: float | np.ndarray) -> float | np.ndarray:
    """Young's modulus of an arm with that G [Pa]."""
    weight = DENSITY * GRAVITY * np.pi * RADIUS**2
    return weight * LENGTH**3 / load / (0.25 * np.pi * RADIUS**4)


def sweep(loads: np.ndarray) -> np.ndarray:
    """Shapes at rest in the plane of sagging, in lengths, shape (arms, nodes, 2)."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    rubber = withe.Material(youngs_modulus=float(modulus(loads[0])), poisson_ratio=0.5, density=DENSITY)
    arm = scene.add_rod(start=(0, 0, 0), end=(LENGTH, 0, 0), nodes=NODES, radius=RADIUS, material=rubber, name="arm")
    scene.clamp(arm.start)
    arms = scene.build_batch(len(loads), integrator="static", planar=True)
    arms.set(arm, youngs_modulus=modulus(loads))  # one row for each arm
    found = arms.equilibrium()
    if not np.all(found.stable):
        raise RuntimeError("Every arm must have a stable equilibrium.")
    return arms.positions(arm)[:, :, [0, 2]] / LENGTH


def elastica(load: float) -> np.ndarray:
    """Tip of the elastica, in lengths, shape (2,)."""
    s = np.linspace(0.0, 1.0, 201)
    guess = np.zeros((4, len(s)))
    for part in np.geomspace(min(1.0, load), load, 8):  # continuation in G
        solution = solve_bvp(
            lambda s, y, g=part: [y[1], -g * (1.0 - s) * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])],
            lambda a, b: [a[0], b[1], a[2], a[3]],
            s,
            guess,
            tol=1e-8,
            max_nodes=20_000,
        )
        guess = solution.sol(s)
    return guess[2:, -1]


def draw(loads: np.ndarray, shapes: np.ndarray, some: np.ndarray, theory: np.ndarray, path: Path) -> None:
    """Shapes of some arms, and the sag of all tips."""
    colors = style.use()
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2))
    shades = style.ramp()
    for k in np.linspace(0, len(loads) - 1, 25).astype(int):
        left.plot(*shapes[k].T, color=shades(k / (len(loads) - 1)), linewidth=2.5)
    left.set(aspect="equal", title="25 of the arms, stiff (light) to soft (dark)")
    style.label(left, x="x / L", y="z / L")
    right.loglog(loads, -shapes[:, -1, 1], color=colors.blue, linewidth=4, label=f"withe, {len(loads)} arms")
    right.loglog(loads[some], -theory[:, 1], "o", color=colors.ink, fillstyle="none", label="elastica")
    stiff = loads[loads < 6.0]
    right.loglog(stiff, stiff / 8.0, "--", color=colors.red, label="small deflections, G / 8")
    style.label(right, x="G = w L³ / EI", y="sag of the tip / L")
    right.set_title("sag of the tip")
    style.legend(right, side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Sweep, compare, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arms", type=int, default=ARMS)
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 4 s.", flush=True)

    loads = np.geomspace(*LOADS, arguments.arms)
    started = time.perf_counter()
    shapes = sweep(loads)
    print(f"{len(loads)} equilibria in {time.perf_counter() - started:.2f} s")
    some = np.linspace(0, len(loads) - 1, 13).astype(int)
    theory = np.array([elastica(loads[k]) for k in some])
    print("      E [Pa]          G   sag / L   elastica")
    for k, tip in zip(some, theory, strict=True):
        print(f"  {modulus(loads[k]):10.3e}  {loads[k]:9.3f}   {-shapes[k, -1, 1]:7.5f}   {-tip[1]:8.5f}")
    off = float(np.linalg.norm(shapes[some, -1] - theory, axis=1).max())
    print(f"tips within {off:.1e} L of theory")
    draw(loads, shapes, some, theory, arguments.out / "stiffness_sweep.png")
    print(f"Wrote {arguments.out / 'stiffness_sweep.png'}.")
    if off > TOLERANCE:
        sys.exit(f"Every tip must be within {TOLERANCE:g} L of the elastica.")


if __name__ == "__main__":
    main()
