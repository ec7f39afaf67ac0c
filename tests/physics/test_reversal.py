"""A rod drawn from its other end is the same rod: its motion does not depend on which end is its start."""

from typing import Any

import numpy as np
import pytest

import withe


def carried(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """First directors of the edges of a curve, of shape (edges, 3)."""
    tangents = np.diff(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    normals = normal - (tangents @ normal)[:, None] * tangents
    return np.asarray(normals / np.linalg.norm(normals, axis=1)[:, None])


def moved(seed: int, backwards: bool, integrator: Any) -> np.ndarray:
    """Positions and twists of a drawn rod after it was let go, from the end that is clamped on."""
    draw = np.random.default_rng([61, seed])
    nodes = int(draw.integers(7, 13))
    s = np.linspace(0.0, 1.0, nodes)[:, None]
    points = 0.2 * np.hstack([s, draw.normal(0.0, 0.2) * np.sin(2.0 * s), draw.normal(0.0, 0.2) * s**2])
    normals = carried(points, draw.normal(size=3))
    curvature, twist = draw.normal(0.0, 5.0, (nodes - 2, 2)), draw.normal(0.0, 5.0, nodes - 2)
    width, height = draw.uniform(4e-3, 9e-3, 2)
    viscosity = 0.0 if integrator == "fourth_order" else draw.choice([0.0, 200.0])
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0, viscosity=viscosity)
    if backwards:
        points, normals = points[::-1], normals[::-1]
        curvature, twist = curvature[::-1] * [1.0, -1.0], twist[::-1]
    scene = withe.Scene(gravity=draw.normal(0.0, 6.0, 3))
    rod = scene.add_rod(
        points=points,
        normal=normals,
        section=withe.Rectangle(width=width, height=height),
        material=material,
        natural_curvature=curvature,
        natural_twist=twist,
    )
    if seed % 2:
        scene.clamp(rod.end if backwards else rod.start)
    simulation = scene.build(integrator=integrator, time_step=2e-3, planar=False)
    simulation.step(25)
    positions, twists = simulation.positions(rod), simulation.twists(rod)
    if backwards:
        positions, twists = positions[::-1], twists[::-1]
    return np.concatenate([positions.ravel(), 1e-3 * twists])


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("integrator", ["energy_momentum", "fourth_order", "implicit_midpoint", "backward_euler"])
@pytest.mark.parametrize("seed", range(8))
def test_a_rod_drawn_from_its_other_end_moves_alike(seed: int, integrator: Any) -> None:
    forth, back = (moved(seed, backwards, integrator) for backwards in (False, True))
    assert np.abs(forth - back).max() < 1e-10 * 0.2
