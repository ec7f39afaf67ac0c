"""Centrelines have the curvature, torsion and length that they were asked for."""

import numpy as np
import pytest

import withe
from withe.knots import overhand_knot, signed_crossings
from withe.shapes import arc, circle, helix


def test_a_helix_has_its_radius_pitch_and_length():
    points = helix(radius=0.02, pitch=0.05, length=0.5, nodes=4001)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 0.02, rtol=1e-12)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(0.5, rel=1e-5)
    turns = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))[-1] / (2 * np.pi)
    assert points[-1, 2] == pytest.approx(0.05 * turns)
    assert turns > 0
    mirrored = helix(0.02, 0.05, 0.5, 4001, left_handed=True)
    np.testing.assert_array_equal(mirrored * [1, -1, 1], points)


def test_a_circle_does_not_repeat_its_first_point():
    points = circle(2.0, 8)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 2.0)
    gaps = np.linalg.norm(np.diff(points, axis=0, append=points[:1]), axis=1)
    np.testing.assert_allclose(gaps, gaps[0])


@pytest.mark.parametrize("curvature", [0.0, 1e-12, 3.0, -3.0, 20.0])
def test_an_arc_has_its_curvature_and_length(curvature):
    points = arc((1, 2, 3), (0, 0, -2), (1, 0, 5), curvature, length=0.4, nodes=2001)
    np.testing.assert_allclose(points[0], [1, 2, 3])
    edges = np.diff(points, axis=0)
    assert np.linalg.norm(edges, axis=1).sum() == pytest.approx(0.4, rel=1e-5)
    angles = np.unwrap(np.arctan2(edges[:, 0], -edges[:, 2]))
    np.testing.assert_allclose(np.diff(angles) / (0.4 / 2000), curvature, atol=1e-6 * abs(curvature) + 1e-7)
    np.testing.assert_allclose(points[:, 1], 2.0)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: helix(0.0, 0.1, 1.0, 10), "radius"),
        (lambda: helix(0.1, -0.1, 1.0, 10), "pitch"),
        (lambda: helix(0.1, 0.1, np.nan, 10), "length"),
        (lambda: helix(0.1, 0.1, 1.0, 1), "nodes"),
        (lambda: helix(0.1, 0.1, 1.0, 2.5), "nodes"),
        (lambda: circle(-1.0, 10), "radius"),
        (lambda: circle(1.0, 2), "nodes"),
        (lambda: arc((0, 0), (0, 0, 1), (1, 0, 0), 1.0, 1.0, 5), "start"),
        (lambda: arc((0, 0, 0), (0, 0, 0), (1, 0, 0), 1.0, 1.0, 5), "tangent"),
        (lambda: arc((0, 0, 0), (0, 0, 1), (0, 0, 3), 1.0, 1.0, 5), "towards"),
        (lambda: arc((0, 0, 0), (0, 0, 1), (1, 0, 0), np.inf, 1.0, 5), "curvature"),
    ],
)
def test_what_has_no_shape_is_refused_by_name(make, name):
    with pytest.raises(ValueError, match=f"^{name} must"):
        make()


@pytest.mark.parametrize("n", range(1, 7))
def test_an_overhand_knot_of_any_kind_has_defaults_that_leave_it_loose(n):
    points = overhand_knot(n)
    assert abs(signed_crossings(points, (0.0, 1.0, 0.01))) == 2 * n + 1
    assert np.linalg.norm(points[-1] - points[0]) > 0.2
    scene = withe.Scene()
    scene.add_rod(points=points, radius=1.6e-3, material=withe.Material(youngs_modulus=1e6, density=1000.0))
    scene.enable_contact()
    assert len(scene.build().contacts()) == 0


def test_an_overhand_knot_of_a_short_thin_rod_is_short():
    points = overhand_knot(length=0.2, radius=2e-4)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(0.2)
    assert np.linalg.norm(points[-1] - points[0]) == pytest.approx(0.08, rel=0.05)
