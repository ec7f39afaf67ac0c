"""Rods as they are drawn: nodes, directors, natural shape, sections and stiffness."""

import numpy as np
import pytest

import withe
from withe.common import drawing
from withe.parts.kinds import RodPart

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.3, density=1000.0, viscosity=50.0)


def rod(**options):
    options = {"radius": 5e-3, "material": RUBBER} | options
    if "section" in options or options["radius"] is None:
        options.pop("radius")
    scene = withe.Scene()
    scene.add_rod(**options)
    return scene._directory.all(RodPart)[0]


def arc(angle, radius, nodes):
    a = np.linspace(0, angle, nodes)
    return radius * np.stack([np.sin(a), 0 * a, 1 - np.cos(a)], axis=1)


def random_rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def test_a_straight_rod_has_evenly_spaced_nodes_and_exact_ends():
    part = rod(start=(0.1, 0.2, 0.3), end=(1, -1, 0.7), nodes=8)
    assert np.array_equal(part.points[0], (0.1, 0.2, 0.3))
    assert np.array_equal(part.points[-1], (1, -1, 0.7))
    assert np.ptp(part.lengths) < 1e-15


def test_points_are_the_nodes_unless_nodes_resamples_them():
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 3, 0)], float)
    assert np.array_equal(rod(points=points).points, points)
    part = rod(points=points, nodes=9)
    assert len(part.points) == 9
    assert np.array_equal(part.points[[0, -1]], points[[0, -1]])
    assert np.allclose(part.points[2], points[1])
    assert np.allclose(part.lengths, 0.5)


def test_resampling_a_fine_arc_spaces_nodes_evenly_along_it():
    part = rod(points=arc(2.0, 0.5, 4001), nodes=41)
    assert np.ptp(part.lengths) < 1e-7
    assert np.allclose(np.linalg.norm(part.points - (0, 0, 0.5), axis=1), 0.5, atol=1e-7)


@pytest.mark.parametrize("repeat", [False, True])
def test_a_closed_rod_may_repeat_its_first_point(repeat):
    a = np.linspace(0, 2 * np.pi, 13)
    ring = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    part = rod(points=ring if repeat else ring[:-1], closed=True)
    assert len(part.points) == len(part.lengths) == len(part.natural_twist) == 12
    assert len(rod(points=ring if repeat else ring[:-1], closed=True, nodes=24).points) == 24


@pytest.mark.parametrize("seed", range(20))
def test_directors_are_unit_and_normal_whatever_the_direction(seed):
    rng = np.random.default_rng(seed)
    part = rod(points=np.cumsum(rng.normal(size=(12, 3)), axis=0))
    assert np.allclose(np.sum(part.directors * part.tangents, axis=1), 0, atol=1e-15)
    assert np.allclose(np.linalg.norm(part.directors, axis=1), 1)


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (1, 1, 1), (-1, 2, 1e-9)])
def test_the_default_normal_does_not_jump_for_small_changes_of_direction(direction):
    end = np.array(direction, float)
    here, there = (rod(start=(0, 0, 0), end=e, nodes=2).directors[0] for e in (end, end + 1e-7))
    assert np.linalg.norm(here - there) < 1e-6


def test_a_normal_is_made_normal_to_the_first_edge_and_transported():
    part = rod(points=arc(1.5, 0.5, 31), normal=(0.2, 1, 0))
    expected = np.array([0.2, 1, 0]) - part.tangents[0] * (part.tangents[0] @ (0.2, 1, 0))
    assert np.allclose(part.directors[0], expected / np.linalg.norm(expected))
    # Transport along a planar curve keeps the angle to the plane.
    assert np.allclose(part.directors[:, 1], part.directors[0, 1])


def test_a_normal_may_be_given_for_every_edge():
    normals = np.tile((0.3, 1.0, 0.0), (4, 1))
    part = rod(start=(0, 0, 0), end=(1, 0, 0), nodes=5, normal=normals)
    assert np.allclose(part.directors, (0, 1, 0))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shift", [0.0, 100.0])
def test_a_straight_rod_as_built_is_exactly_straight(seed, shift):
    end = random_rotation(seed)[0] + shift
    part = rod(start=np.full(3, shift), end=end, nodes=201)
    assert not part.natural_curvature.any()
    assert not part.natural_twist.any()


def test_an_arc_as_built_has_its_own_curvature_towards_its_centre():
    part = rod(points=arc(1.2, 0.25, 25), normal=(0, 0, 1))
    assert np.allclose(np.linalg.norm(part.natural_curvature, axis=1), 1.2 / 24 / part.voronoi)
    # The centre lies at +z of the start, where d1 points to: the arc bends towards d1.
    assert np.all(part.natural_curvature[:, 0] > 0)
    assert np.allclose(part.natural_curvature[:, 1], 0, atol=1e-9)
    assert np.allclose(part.natural_twist, 0)
    other = rod(points=arc(1.2, 0.25, 25), normal=(0, 1, 0))
    assert np.allclose(np.abs(other.natural_curvature[:, 1]), part.natural_curvature[:, 0])


def test_curvature_as_built_is_that_of_the_smooth_rod():
    fine = rod(points=arc(1.2, 0.25, 1001), normal=(0, 0, 1))
    coarse = rod(points=arc(1.2, 0.25, 4), normal=(0, 0, 1))
    assert np.allclose(fine.natural_curvature[:, 0], 1 / 0.25, rtol=1e-6)
    chord = 2 * 0.25 * np.sin(0.2)
    assert np.allclose(coarse.natural_curvature[:, 0], 0.4 / chord)
    assert np.array_equal(coarse.arcs, coarse.lengths)


def test_nodes_along_a_curve_have_its_lengths_and_curvature():
    curve, chord = arc(1.2, 0.25, 10_001), 2 * 0.25 * np.sin(0.2)
    part = rod(points=curve, nodes=4, normal=(0, 0, 1))
    assert np.allclose(part.arcs, 0.25 * 0.4, rtol=1e-8)
    assert np.allclose(part.lengths, chord, rtol=1e-7)
    assert np.allclose(part.natural_curvature[:, 0], 1 / 0.25, rtol=1e-7)
    edges = part.without_arcs()
    assert np.allclose(edges.natural_curvature[:, 0], 0.4 / chord, rtol=1e-7)
    assert np.array_equal(edges.arcs, part.lengths)
    # A rod that is drawn straight, or has a given natural curvature, has arcs as long as its edges.
    for more in ({"natural": "straight"}, {"natural_curvature": (4.0, 0.0)}):
        assert np.array_equal(rod(points=curve, nodes=4, normal=(0, 0, 1), **more).arcs, part.lengths)


def test_twist_as_built_is_the_turn_of_the_directors_per_length():
    angles = np.array([0.0, 0.1, 0.3, 0.2])
    normals = np.stack([0 * angles, np.cos(angles), np.sin(angles)], axis=1)
    part = rod(start=(0, 0, 0), end=(2, 0, 0), nodes=5, normal=normals)
    assert np.allclose(part.natural_twist, np.array([0.1, 0.2, -0.1]) / 0.5)


def test_a_closed_rod_out_of_a_plane_closes_with_the_twist_of_its_holonomy():
    a = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = np.stack([np.cos(a), np.sin(a), 0.3 * np.sin(2 * a) + 0.2 * np.cos(a) ** 3], axis=1)
    part = rod(points=ring, closed=True)
    assert np.allclose(part.natural_twist[1:], 0, atol=1e-9)
    assert abs(part.natural_twist[0]) > 1e-3
    flat = rod(points=ring * (1, 1, 0), closed=True)
    assert not flat.natural_twist.any()


def test_natural_straight_and_given_shapes():
    points = arc(1.2, 0.25, 5)
    assert not rod(points=points, natural="straight").natural_curvature.any()
    part = rod(points=points, natural_curvature=(1, 2), natural_twist=0.5)
    assert np.array_equal(part.natural_curvature, np.tile((1.0, 2.0), (3, 1)))
    assert np.array_equal(part.natural_twist, np.full(3, 0.5))
    rows = np.arange(6.0).reshape(3, 2)
    assert np.array_equal(rod(points=points, natural_curvature=rows).natural_curvature, rows)


def test_discrete_curvature_is_taken_as_twice_the_tangent_of_half_the_angle():
    phi = 0.7
    part = rod(start=(0, 0, 0), end=(1, 0, 0), nodes=5, natural_curvature=(0, 2 * np.tan(phi / 2)), discrete=True)
    assert np.allclose(part.natural_curvature, (0, phi / 0.25))


def test_shear_modulus_and_stiffness_of_a_circle():
    part = rod(start=(0, 0, 0), end=(1, 0, 0), nodes=3, radius=2e-3)
    area, moment = np.pi * 4e-6, np.pi * 16e-12 / 4
    p = part.parameters
    assert np.allclose(p.stretch_stiffness, 1e6 * area)
    assert np.allclose(p.bend_stiffness, 1e6 * moment)
    assert np.allclose(p.twist_stiffness, 1e6 / 2.6 * 2 * moment)
    assert np.allclose(p.line_density, 1000 * area)
    assert np.allclose(p.rotary_inertia, 1000 * 2 * moment)
    assert np.allclose(p.viscous_time, 50e-6)


def test_a_tube_is_a_circle_less_a_circle():
    tube = rod(start=(0, 0, 0), end=(1, 0, 0), nodes=2, section=withe.Tube(outer_radius=3e-3, inner_radius=2e-3))
    big, small = (rod(start=(0, 0, 0), end=(1, 0, 0), nodes=2, radius=r) for r in (3e-3, 2e-3))
    for name in ("stretch_stiffness", "bend_stiffness", "twist_stiffness", "line_density", "rotary_inertia"):
        difference = getattr(big.parameters, name) - getattr(small.parameters, name)
        assert np.allclose(getattr(tube.parameters, name), difference, rtol=1e-12)


def test_the_width_of_a_rectangle_lies_along_d1():
    part = rod(start=(0, 0, 0), end=(1, 0, 0), nodes=2, section=withe.Rectangle(width=2e-2, height=1e-3))
    assert np.allclose(part.parameters.bend_stiffness, [[1e6 * 1e-3 * 8e-6 / 12, 1e6 * 2e-2 * 1e-9 / 12]])
    assert np.allclose(part.section.widths, [[2e-2, 1e-3]])
    assert np.allclose(part.section.radii, 1e-2)


@pytest.mark.parametrize(("ratio", "beta"), [(1, 0.140577), (2, 0.228682), (4, 0.280813), (10, 0.312325), (1e4, 1 / 3)])
def test_torsion_of_a_rectangle_agrees_with_tables(ratio, beta):
    for width, height in [(ratio * 1e-3, 1e-3), (1e-3, ratio * 1e-3)]:
        section = withe.Rectangle(width=width, height=height).properties(1, "rod")
        assert section.torsion[0] == pytest.approx(beta * ratio * 1e-12, rel=1e-4)


def test_per_segment_arrays():
    radii = np.array([1e-3, 2e-3, 3e-3])
    part = rod(start=(0, 0, 0), end=(1, 0, 0), nodes=4, radius=radii)
    assert np.allclose(part.parameters.stretch_stiffness, 1e6 * np.pi * radii**2)
    stiff = withe.Stiffness(stretch=[1, 2, 3], bend=[[1, 2], [3, 4], [5, 6]], twist=7, viscous_time=0.1)
    part = rod(
        start=(0, 0, 0), end=(1, 0, 0), nodes=4, radius=0.1, stiffness=stiff, line_density=[1, 2, 4], material=None
    )
    assert np.array_equal(part.parameters.bend_stiffness, [[1, 2], [3, 4], [5, 6]])
    assert np.array_equal(part.parameters.twist_stiffness, [7, 7, 7])
    assert np.allclose(part.parameters.rotary_inertia, np.array([1, 2, 4]) * 0.01 / 2)
    assert np.array_equal(part.parameters.viscous_time, [0.1] * 3)


@pytest.mark.parametrize("bend", [2.0, (2.0, 2.0)])
def test_bend_stiffness_may_be_one_number_or_a_pair(bend):
    part = rod(
        start=(0, 0, 0),
        end=(1, 0, 0),
        nodes=4,
        radius=0.1,
        stiffness=withe.Stiffness(stretch=1, bend=bend, twist=1),
        line_density=1,
        material=None,
    )
    assert np.array_equal(part.parameters.bend_stiffness, np.full((3, 2), 2.0))


@pytest.mark.parametrize("seed", range(5))
def test_the_smallest_rotation_takes_one_vector_to_another(seed):
    a, b, _ = random_rotation(seed)
    b = (a + 0.3 * b) / np.linalg.norm(a + 0.3 * b)
    turn = drawing.rotation_between(a, b, drawing.default_normal(a))
    assert np.allclose(turn @ a, b)
    assert np.allclose(turn @ turn.T, np.eye(3))
    axis = np.cross(a, b)
    assert np.allclose(turn @ axis, axis)
    back = drawing.rotation_between(a, -a, drawing.default_normal(a))
    assert np.allclose(back @ a, -a)


def test_the_drawn_frame_at_an_end_is_extrapolated_by_half_an_edge():
    part = rod(points=arc(1.0, 1.0, 21), normal=(0, 1, 0))
    for node, angle in [(0, 0.0), (10, 0.5), (20, 1.0)]:
        tangent, director = drawing.drawn_frame(part.tangents, part.directors, part.lengths, node, False)
        assert np.allclose(tangent, (np.cos(angle), 0, np.sin(angle)), atol=1e-12)
        assert np.allclose(director, (0, 1, 0))
