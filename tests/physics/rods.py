"""Scenes that several tests share: rods of unit length and unit bending stiffness, so that loads are groups."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import withe

# Strains of 1e-9 a unit load: the theory of the elastica knows none.
INEXTENSIBLE = 1e9


def stiffness(bend: Any = 1.0, twist: Any = 1.0, stretch: Any = INEXTENSIBLE, **more: Any) -> withe.Stiffness:
    return withe.Stiffness(stretch=stretch, bend=bend, twist=twist, **more)


def straight(scene: withe.Scene, edges: int, direction: Sequence[float] = (1.0, 0.0, 0.0), **more: Any) -> withe.Rod:
    """A rod of unit length from the origin, of unit stiffnesses and unit mass per length."""
    options: dict[str, Any] = {"stiffness": stiffness(), "line_density": 1.0, "radius": 1e-3} | more
    return scene.add_rod(start=(0.0, 0.0, 0.0), end=direction, nodes=edges + 1, **options)


def ring_on_slope(
    degrees: float, radius: float, thickness: float, edges: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Nodes of a ring of a rod that just touches a slope through the origin; its normal, and the way down it."""
    angle = np.radians(degrees)
    normal = np.array((np.sin(angle), 0.0, np.cos(angle)))
    down = np.array((np.cos(angle), 0.0, -np.sin(angle)))
    turn = 2.0 * np.pi * np.arange(edges) / edges
    points = (radius + thickness) * normal + radius * (np.outer(np.sin(turn), down) - np.outer(np.cos(turn), normal))
    return points, normal, down


def weightless() -> withe.Scene:
    return withe.Scene(gravity=(0.0, 0.0, 0.0))


def sharp(scene: withe.Scene, **more: Any) -> withe.Simulation:
    """A static simulation with tolerances at rounding."""
    options: dict[str, Any] = {
        "integrator": "static",
        "solver": withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    } | more
    return scene.build(**options)


def heavy_cantilever(weight: float, edges: int, **build: Any) -> tuple[withe.Simulation, withe.Rod]:
    """Level cantilever with G = w L^3 / B."""
    scene = withe.Scene(gravity=(0.0, 0.0, -weight))
    arm = straight(scene, edges)
    scene.clamp(arm.start)
    return sharp(scene, **build), arm


def rotation(axis: npt.ArrayLike, angle: float) -> np.ndarray:
    """Rotation matrix about an axis [Rodrigues]."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
