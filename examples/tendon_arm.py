"""A continuum robot on tendons: one that winds about its backbone against theory, and three that lead the tip.

The robot is that of Rucker and Webster 2011 (IEEE Trans. Robot. 27, 1033): a backbone of spring steel, 0.8 mm thick and
242 mm long, with tendons 8 mm beside it. A tendon that winds once round the backbone bends and twists it. Without
weight each section has the strains that minimise

    EI |k|^2 / 2 + GJ u^2 / 2 + EA (v - 1)^2 / 2 + T |v t + u x r + dr/ds|,

with no regard to its neighbours; the shape follows by integration of the frame. Then the robot hangs from its base with
three straight tendons, and tensions are sought that lead its tip through points under its weight and that of a tool,
by least squares with `equilibrium().gradient`. Fails when the tip of the first is off theory by more than 0.1 mm, or
that of the second off its points by more than 0.1 mm.

Writes out/tendon_arm.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares, minimize
from scipy.spatial.transform import Rotation

import withe
from withe.view import style

LENGTH, RADIUS, OFFSET, NODES = 0.242, 0.4e-3, 8e-3, 61  # [m]
STEEL = withe.Material(youngs_modulus=210e9, poisson_ratio=0.3125, density=7850.0)
AREA, INERTIA = np.pi * RADIUS**2, 0.25 * np.pi * RADIUS**4
TENSION, TOOL = 3.0, 5e-3  # [N], [kg]
ERROR = 1e-4  # allowed error [m]


def backbone(scene: withe.Scene, tool: float = 0.0) -> withe.Rod:
    """From its base down, first director along x."""
    rod = scene.add_rod(
        start=(0, 0, 0), end=(0, 0, -LENGTH), nodes=NODES, radius=RADIUS, normal=(1, 0, 0), material=STEEL, name="arm"
    )
    scene.clamp(rod.start)
    scene.add_mass(rod.end, tool)
    return rod


def winding(s: np.ndarray) -> np.ndarray:
    """Offset of the tendon that winds, at arc lengths s."""
    angle = 2.0 * np.pi * s / LENGTH
    return OFFSET * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def wound() -> tuple[withe.Simulation, withe.Rod]:
    """At rest, pulled by the tendon that winds."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = backbone(scene)
    edge = LENGTH / (NODES - 1)
    places = np.array([0.0, *(np.arange(NODES - 1) + 0.5), NODES - 1]) * edge
    tendon = scene.add_tendon(rod, offset=winding(places), name="winding")
    simulation = scene.build(integrator="static")
    simulation.set(tendon, tension=TENSION)
    simulation.equilibrium()
    return simulation, rod


def theory(sections: int = 400) -> np.ndarray:
    """The tip of the backbone with the tendon that winds."""
    bend, twist = STEEL.youngs_modulus * INERTIA, STEEL.youngs_modulus / (1.0 + STEEL.poisson_ratio) * INERTIA
    stretch = STEEL.youngs_modulus * AREA
    rate = 2.0 * np.pi / LENGTH

    def energy(x: np.ndarray, r: np.ndarray) -> float:
        slope = rate * np.array((-r[1], r[0]))
        along = np.cross(x[:3], (*r, 0.0)) + np.array((*slope, 1.0 + 1e-3 * x[3]))
        kept = 0.5 * bend * (x[0] ** 2 + x[1] ** 2) + 0.5 * twist * x[2] ** 2 + 0.5 * stretch * (1e-3 * x[3]) ** 2
        return float(kept + TENSION * np.linalg.norm(along))

    step, place, frame = LENGTH / sections, np.zeros(3), np.diag((1.0, -1.0, -1.0))
    strains = np.zeros(4)
    for s in (np.arange(sections) + 0.5) * step:
        strains = minimize(energy, strains, args=(winding(s),), options={"gtol": 1e-9}).x
        half = Rotation.from_rotvec(0.5 * step * strains[:3]).as_matrix()
        frame = frame @ half
        place = place + step * (1.0 + 1e-3 * strains[3]) * frame[:, 2]
        frame = frame @ half
    return place


def hanging() -> tuple[withe.Simulation, withe.Rod, list[withe.Tendon]]:
    """Return the backbone with three straight tendons, its weight and the weight of a tool."""
    scene = withe.Scene()
    rod = backbone(scene, TOOL)
    angles = 2.0 * np.pi * np.arange(3) / 3
    tendons = [
        scene.add_tendon(rod, offset=(OFFSET * np.cos(a), OFFSET * np.sin(a)), name=f"tendon {i}")
        for i, a in enumerate(angles)
    ]
    return scene.build(integrator="static"), rod, tendons


def lead(
    simulation: withe.Simulation, rod: withe.Rod, tendons: list[withe.Tendon], points: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray], int]:
    """Tensions that bring the tip to each point as near as they can, the shapes, and how many equilibria it took.

    Of the points x and y count: three tendons bend the backbone in any direction, and their common part is idle.
    """
    wrt = [(tendon, "tension") for tendon in tendons]
    count = 0

    def settle(tensions: np.ndarray) -> withe.Equilibrium:
        nonlocal count
        count += 1
        for tendon, tension in zip(tendons, tensions, strict=True):
            simulation.set(tendon, tension=max(float(tension), 0.0))
        return simulation.equilibrium()

    found, shapes, tensions = [], [], np.full(3, 1.0)
    for point in points:

        def residual(x: np.ndarray, point: np.ndarray = point) -> np.ndarray:
            settle(x)
            off = simulation.positions(rod)[-1, :2] - point
            return np.append(1e3 * off, 1e-6 * x.sum())

        def jacobian(x: np.ndarray) -> np.ndarray:
            by = settle(x).jacobian(rod.end, wrt)
            return np.vstack([1e3 * np.stack(by, axis=-1)[:2], np.full(3, 1e-6)])

        tensions = least_squares(residual, tensions, jac=jacobian, bounds=(0.0, 20.0), xtol=1e-10).x
        settle(tensions)
        found.append(tensions)
        shapes.append(simulation.positions(rod))
    return found, shapes, count


def draw(simulation: withe.Simulation, shapes: list[np.ndarray], points: np.ndarray, path: Path) -> None:
    """The wound backbone with its tendon, and the tips of the other through its points."""
    colors = style.use()
    figure = plt.figure(figsize=(9.6, 5.2))
    left = figure.add_subplot(1, 2, 1, projection="3d")
    cord = 1e3 * simulation.tendon_points("winding")
    left.plot(*(1e3 * simulation.positions("arm")).T, color=colors.ink, linewidth=3, label="backbone")
    left.plot(*cord.T, color=colors.red, linewidth=1.5, label="tendon")
    left.set_title(f"wound once, {TENSION:g} N")
    right = figure.add_subplot(1, 2, 2, projection="3d")
    for shape in shapes:
        right.plot(*(1e3 * shape).T, color=colors.ink, alpha=0.6, linewidth=1.5)
    tips = 1e3 * np.array([shape[-1] for shape in shapes])
    level = np.full(len(points), tips[:, 2].mean())
    right.plot(*(1e3 * points).T, level, "x", color=colors.red, markersize=9, label="points")
    right.plot(*tips.T, "o", color=colors.blue, label="tips")
    right.set_title(f"three tendons, a tool of {1e3 * TOOL:g} g")
    for axes in (left, right):
        style.label(axes, x=("x", "mm"), y=("y", "mm"), z=("z", "mm"))
        style.legend(axes)
    style.fill_frame(left, np.concatenate([1e3 * simulation.positions("arm"), cord]))
    style.fill_frame(right, 1e3 * np.array(shapes))
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Wind, compare, lead the tip, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=16, help="of the circle that the tip is led through")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 6 s.", flush=True)

    simulation, rod = wound()
    tip, expected = simulation.positions(rod)[-1], theory()
    drawn, off = np.array((0, 0, -LENGTH)), float(np.linalg.norm(tip - expected))
    print(f"wound: the tip went {1e3 * np.linalg.norm(tip - drawn):.1f} mm, {1e3 * off:.3f} mm off theory")
    angles = 2.0 * np.pi * np.arange(arguments.points) / arguments.points
    points = 0.08 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    robot, arm, tendons = hanging()
    tensions, shapes, count = lead(robot, arm, tendons, points)
    missed = float(max(np.linalg.norm(shape[-1, :2] - point) for shape, point in zip(shapes, points, strict=True)))
    print(
        f"led: {len(points)} points of a circle of 80 mm within {1e3 * missed:.4f} mm, by up to "
        f"{np.max(tensions):.2f} N; {count} equilibria"
    )
    draw(simulation, shapes, points, arguments.out / "tendon_arm.png")
    print(f"Wrote {arguments.out / 'tendon_arm.png'}.")
    if off > ERROR:
        sys.exit("The wound arm is not that of theory.")
    if missed > ERROR:
        sys.exit("The tip misses its points.")


if __name__ == "__main__":
    main()
