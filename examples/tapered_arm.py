"""A gripper's arm whose taper is optimised: it is to curl round an object and to carry it, by exact gradients.

A tendon that ends at the tip bends the arm with one moment M all along, so that radii alone decide where it curls:
curvature is M / EI with EI ~ r^4. Radii r at nine places and M are found by SLSQP for the least of

    J(r, M) = mean over the outer half of (|x_i - c| - R - r_i - gap)^2,

the clearance between the arm's surface and an object of radius R about c, in equilibrium under the arm's own weight.
Constraints: the arm is no heavier than the cylinder that it begins with, and what it holds pulls it down by no more
than SAG, in a second equilibrium. Both have exact derivatives by the radius of every edge and by the moment
(`Equilibrium.gradient`). Fails when the arm does not lie closely round the object, when a constraint is violated, when
derivatives are not those of differences, or when a mesh four times as fine says otherwise.

Writes out/tapered_arm.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import OptimizeResult, minimize

import withe
from withe.view import style

LENGTH, EDGES, PLACES = 0.3, 48, 9  # [m]
DENSITY, MODULUS = 1100.0, 2.6e7  # printed polyurethane [kg/m^3], [Pa]
CYLINDER = 6.5e-3  # radius of the arm to begin with [m]
THINNEST, THICKEST = 3.5e-3, 12e-3  # [m]
OBJECT, ROUND, GAP = np.array([0.16, -0.055]), 0.035, 2e-3  # centre, x and z; radius; clearance [m]
WEIGHT, SAG = 0.5, 0.015  # weight of the object [N], allowed sag of the arm [m]
STRONGEST = 0.3  # moment of the tendon [N m]
FIRST, FIRST_MOMENT = (8.0, 4.0), 100.0  # radii at both ends [mm] and moment [mN m] to begin with
CLOSE = 1e-3  # required error of the clearance, RMS [m]
PLACE_OF_EDGE = (np.arange(EDGES) + 0.5) / EDGES
TENTS = np.stack([np.interp(PLACE_OF_EDGE, np.linspace(0, 1, PLACES), row) for row in np.eye(PLACES)], axis=1)


class Held(NamedTuple):
    """An equilibrium of the arm."""

    positions: np.ndarray  # (nodes, 3) [m]
    found: object
    arm: withe.Rod
    tendon: object


def hold(radii: np.ndarray, moment: float, weight: float) -> Held:
    """The arm at rest, for radii of its edges, bent by its tendon, with a weight spread over its outer half."""
    nodes = len(radii) + 1
    scene = withe.Scene(gravity=(0.0, 0.0, -9.81))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=DENSITY)
    arm = scene.add_rod(
        start=(0.0, 0.0, 0.0), end=(LENGTH, 0.0, 0.0), nodes=nodes, radius=radii, material=rubber, name="arm"
    )
    scene.clamp(arm.start)
    tendon = scene.add_moment(arm.end, (0.0, moment, 0.0))
    for node in outer(nodes):
        scene.add_force(arm.node(int(node)), (0.0, 0.0, -weight / len(outer(nodes))))
    # Solved to rounding error, so that differences approximate derivatives.
    simulation = scene.build(
        integrator="static", planar=True, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
    )
    found = simulation.equilibrium()
    return Held(simulation.positions(), found, arm, tendon)


def outer(nodes: int) -> np.ndarray:
    """Nodes of the outer half."""
    return np.arange(nodes // 2, nodes)


def at_nodes(radii: np.ndarray) -> np.ndarray:
    """Radii where edges meet, and of the last edge."""
    return np.concatenate([radii[:1], 0.5 * (radii[1:] + radii[:-1]), radii[-1:]])


def clearances(held: Held, radii: np.ndarray) -> np.ndarray:
    """Between the surfaces of the outer half and of the object, less GAP [m]."""
    nodes = outer(len(radii) + 1)
    apart = np.linalg.norm(held.positions[nodes][:, ::2] - OBJECT, axis=1)
    return apart - ROUND - at_nodes(radii)[nodes] - GAP


def gradient(held: Held, by_positions: np.ndarray) -> np.ndarray:
    """Derivatives by the radii of all edges, and by the moment."""
    by_radii, by_moment = held.found.gradient(by_positions, wrt=[(held.arm, "radius"), (held.tendon, "moment")])
    return np.append(by_radii, np.asarray(by_moment)[1])


class Design:
    """J, the sag and the mass of a design, each with its derivatives by radii at places [mm] and the moment [mN m]."""

    def __init__(self, basis: np.ndarray) -> None:
        self.basis = basis  # functions for the radii of the edges
        self.equilibria = 0
        self._last: tuple[bytes, tuple[Held, Held]] = (b"", ())

    def radii(self, design: np.ndarray) -> np.ndarray:
        """Radii of all edges [m]."""
        return 1e-3 * self.basis @ design[:-1]

    def arms(self, design: np.ndarray) -> tuple[Held, Held]:
        """Build the arm without and with the weight."""
        if self._last[0] != design.tobytes():
            radii, moment = self.radii(design), 1e-3 * design[-1]
            self._last = design.tobytes(), (hold(radii, moment, 0.0), hold(radii, moment, WEIGHT))
            self.equilibria += 2
        return self._last[1]

    def by_design(self, by_all: np.ndarray) -> np.ndarray:
        """Chain rule."""
        return 1e-3 * np.append(by_all[:-1] @ self.basis, by_all[-1])

    def objective(self, design: np.ndarray) -> tuple[float, np.ndarray]:
        """J [mm^2]."""
        (held, _), radii = self.arms(design), self.radii(design)
        nodes, off = outer(EDGES + 1), clearances(held, radii)
        slope = 2e6 * off / len(off)
        ways = held.positions[nodes][:, ::2] - OBJECT
        by_positions = np.zeros_like(held.positions)
        by_positions[nodes, ::2] = slope[:, None] * ways / np.linalg.norm(ways, axis=1)[:, None]
        by_radii = -slope @ np.stack([at_nodes(row) for row in np.eye(EDGES)], axis=1)[nodes]
        return 1e6 * float(np.mean(off**2)), self.by_design(gradient(held, by_positions) + np.append(by_radii, 0.0))

    def sag(self, design: np.ndarray) -> tuple[float, np.ndarray]:
        """By which the weight pulls the outer half down [mm]."""
        free, loaded = self.arms(design)
        nodes = outer(EDGES + 1)
        down = np.zeros_like(free.positions)
        down[nodes, 2] = -1e3 / len(nodes)
        value = float(np.sum(down * (loaded.positions - free.positions)))
        return value, self.by_design(gradient(loaded, down) - gradient(free, down))

    def mass(self, design: np.ndarray) -> tuple[float, np.ndarray]:
        """Mass of the arm [g]."""
        radii, edge = self.radii(design), 1e3 * DENSITY * np.pi * LENGTH / EDGES
        return edge * float(np.sum(radii**2)), self.by_design(np.append(2.0 * edge * radii, 0.0))

    def optimise(self, start: np.ndarray) -> OptimizeResult:
        """By SLSQP."""
        limits = ((self.sag, 1e3 * SAG), (self.mass, heaviest()))
        return minimize(
            self.objective,
            start,
            jac=True,
            method="SLSQP",
            bounds=[(1e3 * THINNEST, 1e3 * THICKEST)] * (len(start) - 1) + [(0.0, 1e3 * STRONGEST)],
            constraints=[
                {"type": "ineq", "fun": lambda x, f=f, m=m: m - f(x)[0], "jac": lambda x, f=f: -f(x)[1]}
                for f, m in limits
            ],
            options={"maxiter": 300, "ftol": 1e-7},
        )


def heaviest() -> float:
    """Mass of the cylinder [g]."""
    return 1e3 * DENSITY * np.pi * CYLINDER**2 * LENGTH


def error_of_derivatives(design: Design, at: np.ndarray) -> float:
    """By how much they differ from central differences, relative to the greatest."""
    worst = 0.0
    for of in (design.objective, design.sag):
        exact, step = of(at)[1], 1e-5
        ways = step * np.eye(len(at))
        differences = np.array([(of(at + way)[0] - of(at - way)[0]) / (2.0 * step) for way in ways])
        worst = max(worst, float(np.abs(exact - differences).max() / np.abs(differences).max()))
    return worst


def draw(shown: list[tuple[str, Design, np.ndarray]], path: Path) -> None:
    """Both arms round the object, alone and with its weight, and their radii."""
    colors = style.use()
    figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.3), width_ratios=(1.1, 1.1, 1))
    for axis, (name, design, at), color in zip(axes, shown, (colors.grey, colors.blue), strict=False):
        radii = at_nodes(design.radii(at))
        for held, alpha in zip(design.arms(at), (1.0, 0.25), strict=True):
            x = 100.0 * held.positions[:, ::2]
            along = np.gradient(x, axis=0)
            normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
            sides = x + 100.0 * radii[:, None] * normal, x - 100.0 * radii[:, None] * normal
            outline = np.concatenate([sides[0], sides[1][::-1]])
            axis.fill(*outline.T, color=color, alpha=alpha, linewidth=0)
        axis.add_patch(plt.Circle(100.0 * OBJECT, 100.0 * ROUND, color=colors.orange))
        title = f"{name} (pale: with {WEIGHT:g} N)"
        axis.set(title=title, aspect="equal", xlim=(-1, 24), ylim=(-13, 5), yticks=(-10, -5, 0, 5))
        style.label(axis, x=("x", "cm"), y=("z", "cm"))
        places = 100.0 * LENGTH * np.linspace(0, 1, len(radii))
        axes[2].plot(places, 1e3 * radii, color=color, label=name)
    axes[2].set(title="radius along the arm", ylim=(0, None))
    style.label(axes[2], x=("arc length", "cm"), y=("radius", "mm"))
    style.legend(axes[2], side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Optimise a cylinder's moment and then radii too, check, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 3 s.", flush=True)

    cylinder, tapered = Design(np.ones((EDGES, 1))), Design(TENTS)
    tried = [np.array([1e3 * CYLINDER, moment]) for moment in np.linspace(0.0, 1000.0, 51)]
    even = min(tried, key=lambda design: cylinder.objective(design)[0])
    found = tapered.optimise(np.append(np.linspace(*FIRST, PLACES), FIRST_MOMENT))
    for name, design, at in (("cylinder", cylinder, even), ("tapered", tapered, found.x)):
        print(
            f"{name}: clearance off by {np.sqrt(design.objective(at)[0]):.2f} mm RMS; sags by {design.sag(at)[0]:.2f} "
            f"mm under {WEIGHT:g} N; {design.mass(at)[0]:.1f} g; tendon {at[-1]:.2f} mN m"
        )
    print(f"radii {', '.join(f'{r:.2f}' for r in found.x[:-1])} mm; {found.nit} iterations of SLSQP, ", end="")
    print(f"{tapered.equilibria} equilibria")
    error = error_of_derivatives(tapered, found.x)
    print(f"derivatives {error:.1e} from central differences")
    fine = hold(np.repeat(tapered.radii(found.x), 4), 1e-3 * found.x[-1], 0.0).positions[::4]
    moved = 1e3 * np.linalg.norm(fine - tapered.arms(found.x)[0].positions, axis=1).max()
    print(f"four times as many edges move no node by more than {moved:.2f} mm")
    shown = [("cylinder", cylinder, even), ("tapered", tapered, found.x)]
    draw(shown, arguments.out / "tapered_arm.png")
    print(f"Wrote {arguments.out / 'tapered_arm.png'}.")
    if np.sqrt(tapered.objective(found.x)[0]) > 1e3 * CLOSE or moved > 1e3 * CLOSE:
        sys.exit("The arm does not lie closely round the object.")
    if tapered.sag(found.x)[0] > 1e3 * SAG + 1e-3 or tapered.mass(found.x)[0] > heaviest() + 1e-3 or error > 1e-6:
        sys.exit("A constraint is violated, or the derivatives are not those of differences.")


if __name__ == "__main__":
    main()
