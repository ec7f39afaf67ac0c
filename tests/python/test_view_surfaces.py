"""Surfaces of rods: tubes and bars enclose what they should, and face outwards."""

import numpy as np
import pytest

from curling_motion import CURVATURE_RATE, CurlingSimulation
from withe.common.outlines import RodOutline
from withe.recording.recorder import present
from withe.view.surfaces import Surface, _spline


def outline(nodes, radius=0.01, closed=False, widths=None):
    edges = nodes if closed else nodes - 1
    widths = None if widths is None else np.tile(widths, (edges, 1)).astype(float)
    return RodOutline("rod", np.arange(nodes), closed, np.full(edges, radius), widths)


def enclosed_volume(surface, points):
    """Volume inside a closed surface of quadrilaterals, positive where they face outwards."""
    a, b, c, d = (points[surface.faces[:, corner]] for corner in range(4))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.linalg.det(triangles).sum() / 6.0


def test_a_straight_round_rod_encloses_a_cylinder_and_two_half_spheres():
    nodes = np.linspace([0, 0, 0], [0, 0, 1.0], 11)
    surface = Surface(outline(11, 0.1), nodes, 4, sides=96)
    points, _ = surface.mesh(nodes, np.tile([1.0, 0, 0], (10, 1)))
    exact = np.pi * 0.1**2 * 1.0 + 4 / 3 * np.pi * 0.1**3
    assert enclosed_volume(surface, points) == pytest.approx(exact, rel=3e-3)


def test_a_ring_encloses_a_torus():
    angles = 2 * np.pi * np.arange(24) / 24
    nodes = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    surface = Surface(outline(24, 0.1, closed=True), nodes, 6, sides=96)
    points, _ = surface.mesh(nodes, np.tile([0, 0, 1.0], (24, 1)))
    assert enclosed_volume(surface, points) == pytest.approx(2 * np.pi**2 * 0.1**2, rel=3e-3)


def test_a_rectangle_has_its_width_along_d1_and_its_height_along_d2():
    nodes = np.linspace([0, 0, 0], [0, 0, 1.0], 5)
    surface = Surface(outline(5, 0.1, widths=(0.2, 0.05)), nodes)
    points, normals = surface.mesh(nodes, np.tile([0, 1.0, 0], (4, 1)))
    np.testing.assert_allclose(np.ptp(points, axis=0), [0.05, 0.2, 1.0], atol=1e-12)
    assert enclosed_volume(surface, points) == pytest.approx(0.2 * 0.05 * 1.0)
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1.0, atol=1e-12)


def test_normals_are_of_unit_length_and_point_outwards():
    simulation = CurlingSimulation(0.5)
    rod = present(simulation).rods[0]
    surface = Surface(rod, simulation.positions("arm"))
    points, normals = surface.mesh(simulation.positions("arm"), simulation.directors("arm")[:, 0])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    assert enclosed_volume(surface, points + 1e-4 * normals) > enclosed_volume(surface, points)


def test_the_surface_lies_one_radius_from_a_circular_centreline():
    kappa = CURVATURE_RATE * 0.8
    simulation = CurlingSimulation(0.8)
    nodes = simulation.positions("arm")
    rod = outline(21, 0.004)
    points, _ = Surface(rod, nodes, 5).mesh(nodes, simulation.directors("arm")[:, 0])
    body = points[(points[:, 2] < -0.01) & (points[:, 2] > nodes[-1, 2] + 0.01)]
    to_axis = np.hypot(body[:, 0] - 1 / kappa, body[:, 2]) - 1 / kappa
    np.testing.assert_allclose(np.hypot(to_axis, body[:, 1]), 0.004, rtol=1e-3)


@pytest.mark.parametrize("count", [2, 3])
def test_the_shortest_rods_have_a_surface(count):
    nodes = np.linspace([0, 0, 0], [0.1, 0, 0], count)
    points, _ = Surface(outline(count), nodes).mesh(nodes, np.tile([0, 0, 1.0], (count - 1, 1)))
    assert np.isfinite(points).all()


@pytest.mark.parametrize(
    ("closed", "nodes"), [(False, 2), (False, 3), (False, 4), (False, 5), (False, 40), (True, 3), (True, 4), (True, 40)]
)
def test_splines_are_those_of_scipy(closed, nodes):
    from scipy.interpolate import CubicSpline

    rng = np.random.default_rng(nodes)
    values = rng.normal(size=(nodes, 3))
    knots = np.cumsum(10.0 ** rng.uniform(-2, 1, nodes + closed))
    samples = np.sort(np.append(rng.uniform(knots[0], knots[-1], 200), knots))
    points, tangents = _spline(knots, samples, closed)
    all_values = np.concatenate([values, values[:1]]) if closed else values
    expected = CubicSpline(knots, all_values, bc_type="periodic" if closed else "not-a-knot")
    np.testing.assert_allclose(points @ values, expected(samples), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(tangents @ values, expected(samples, 1), rtol=1e-7, atol=1e-7)
