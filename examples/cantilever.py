"""A soft cantilever sags under its own weight, as far as theory says.

The one dimensionless number is G = w L^3 / B, with w the weight per length, L the length and B the bending
stiffness. At G = 10 the tip of an inextensible rod comes down by 0.70020 L and in by 0.34365 L.

Run it with `make demo`, or `python examples/cantilever.py`. It fails when the tip is more than 1e-4 L off.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

import withe
from withe.view import style

LENGTH = 0.3  # [m]
RADIUS = 2e-4  # [m]
DENSITY = 1100.0  # [kg/m^3]
GRAVITY = 9.81  # [m/s^2]
G = 10.0
TIP = np.array([1.0 - 0.34365, -0.70020])  # theory, in lengths
TOLERANCE = 1e-4  # in lengths


def sagging_rod(nodes: int) -> tuple[withe.Simulation, float]:
    """A rod that is clamped level and hangs in equilibrium, and how long it took to find it [s]."""
    weight = DENSITY * math.pi * RADIUS**2 * GRAVITY
    bending_stiffness = weight * LENGTH**3 / G
    silicone = withe.Material(youngs_modulus=4.0 * bending_stiffness / (math.pi * RADIUS**4), density=DENSITY)

    scene = withe.Scene(gravity=(0, 0, -GRAVITY))
    arm = scene.add_rod(start=(0, 0, 0), end=(LENGTH, 0, 0), nodes=nodes, radius=RADIUS, material=silicone, name="arm")
    scene.clamp(arm.start)
    simulation = scene.build(integrator="static")
    clock = time.perf_counter()
    simulation.equilibrium()
    return simulation, time.perf_counter() - clock


def shape(simulation: withe.Simulation) -> np.ndarray:
    """Nodes in the plane of sagging, in lengths, shape (nodes, 2)."""
    return simulation.positions("arm")[:, [0, 2]] / LENGTH


def elastica() -> np.ndarray:
    """The same by theory: theta'' = -G (1 - s) cos(theta), theta(0) = 0, theta'(1) = 0; shape (n, 2)."""
    s = np.linspace(0.0, 1.0, 201)
    solution = solve_bvp(
        lambda s, y: [y[1], -G * (1.0 - s) * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])],
        lambda a, b: [a[0], b[1], a[2], a[3]],
        s,
        np.stack([s, 1.0 - s, s, -s]),
        tol=1e-10,
        max_nodes=100_000,
    )
    return solution.sol(s)[2:].T


def draw(simulation: withe.Simulation, path: Path) -> None:
    """The shape against theory, and how the error of the tip falls with the number of nodes."""
    colors = style.use()
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.6), width_ratios=(1.25, 1))
    theory, nodes = elastica(), shape(simulation)
    left.plot([0, 1], [0, 0], color=colors.pale, linewidth=5, solid_capstyle="round", label="without weight")
    left.plot(*nodes.T, color=colors.blue, linewidth=5, solid_capstyle="round", label=f"withe, {len(nodes)} nodes")
    left.plot(*theory.T, color=colors.ink, linewidth=1.3, linestyle=(0, (5, 4)), label="elastica")
    left.plot(*TIP, "o", markersize=11, markerfacecolor="none", color=colors.red, label="tip by theory")
    left.axvline(0.0, color=colors.grey, linewidth=2)
    left.set(title=f"A rod under its own weight, w L³ / B = {G:g}", aspect="equal")
    style.label(left, x="x / L", y="z / L")
    style.legend(left, side="top", ncols=4)

    counts = np.array([11, 21, 41, 81, 161, 321])
    errors = [np.linalg.norm(shape(sagging_rod(count)[0])[-1] - theory[-1]) for count in counts]
    right.loglog(counts - 1, errors, "o-", color=colors.blue, linewidth=1.8, label="withe")
    right.loglog(counts - 1, errors[-1] * (320.0 / (counts - 1)) ** 2, "--", color=colors.grey, label="second order")
    right.axhline(TOLERANCE, color=colors.red, linewidth=1.2, label="tolerance")
    right.set(title="Edges half as long: a quarter of the error")
    style.label(right, x="number of edges", y="error of the tip / L")
    style.legend(right, side="top")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)


def main() -> int:
    """Compare, draw, and return whether the results agree."""
    print("Takes about 2 s.", flush=True)
    simulation, seconds = sagging_rod(nodes=201)
    tip = shape(simulation)[-1]
    error = float(np.linalg.norm(tip - TIP))
    print(f"A cantilever of {LENGTH} m under its own weight, w L^3 / B = {G:g}, 201 nodes")
    print(f"  tip, simulated: down {-tip[1]:.5f} L, in {1.0 - tip[0]:.5f} L")
    print(f"  tip, theory:    down {-TIP[1]:.5f} L, in {1.0 - TIP[0]:.5f} L")
    print(f"  error {error:.1e} L, solved in {1e3 * seconds:.2f} ms")
    path = Path("out") / "cantilever.png"
    draw(simulation, path)
    print(f"  picture: {path}")
    if not error <= TOLERANCE:
        print(f"the tip must be within {TOLERANCE:g} L of theory", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
