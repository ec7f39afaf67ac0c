"""Sheets that hang from a jaw, against tables of the continuum equations, closed forms and limits."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import withe
from withe.folding import elastica

DATA = Path(__file__).resolve().parent.parent / "data"
POSES = np.genfromtxt(DATA / "sheet_poses.csv", delimiter=",", names=True)
BRANCHES = np.genfromtxt(DATA / "sheet_branches_without_tangential_force.csv", delimiter=",", names=True)


def scattered(count, seed):
    """Positions over the workspace."""
    random = np.random.default_rng(seed)
    pose = elastica(10 * random.random(count), 5 * random.random(count))
    return pose.x[pose.valid], pose.z[pose.valid]


@pytest.mark.case("planners", "Poses of a hanging sheet", source="table of the elastica, five decimals")
def test_every_row_of_the_table_is_found():
    pose = elastica(POSES["xbar"], POSES["zbar"])
    assert pose.valid.all()
    np.testing.assert_allclose(pose.angle, POSES["alpha_rad"], atol=1e-5)
    np.testing.assert_allclose(pose.suspended, POSES["lsbar"], atol=1e-5)
    np.testing.assert_allclose(pose.force_ratio, POSES["lambda"], atol=1e-5)
    np.testing.assert_allclose(pose.normal_force, POSES["Fn_over_wLgb"], rtol=1e-5)
    np.testing.assert_allclose(pose.tangential_force, POSES["Ft_over_wLgb"], rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(pose.max_curvature, POSES["max_abs_kappa_Lgb"], rtol=1e-5, atol=6e-5)


def test_the_first_integral_holds():
    pose = elastica(*scattered(2000, 1))
    left = (pose.suspended - pose.normal_force) * np.sin(pose.angle)
    right = pose.z - pose.tangential_force * (1 - np.cos(pose.angle))
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-8)


def test_a_position_and_its_length_and_angle_name_the_same_pose():
    x, z = scattered(500, 2)
    pose = elastica(x, z)
    again = elastica(length=pose.suspended, angle=pose.angle)
    there = again.valid & (pose.suspended < 6.5)  # beyond, two poses share length and angle near their greatest angle
    assert there.sum() > 0.9 * len(x)
    np.testing.assert_allclose(again.x[there], x[there], atol=1e-7)
    np.testing.assert_allclose(again.z[there], z[there], atol=1e-7)


@pytest.mark.case("planners", "Sheets that hang without tangential force", source="table, five decimals")
def test_the_branch_without_tangential_force_is_met():
    rows = BRANCHES[(BRANCHES["branch"] == 1) & (BRANCHES["lsbar"] > 1) & (BRANCHES["lsbar"] < 6.8)]
    pose = elastica(length=rows["lsbar"], angle=rows["alpha_rad"])
    assert pose.valid.all()
    np.testing.assert_allclose(pose.z, rows["tip_z_over_Lgb"], atol=1e-5)
    long = rows["lsbar"] > 2.0  # short strips need the angle to more digits than the table has
    np.testing.assert_allclose(pose.tangential_force[long], 0, atol=5e-5)
    np.testing.assert_allclose(pose.normal_force[long], rows["Fn_over_wLgb"][long], atol=5e-5)
    np.testing.assert_allclose(pose.x[long], rows["xbar_NFM"][long], atol=1e-5)


@pytest.mark.case("planners", "Hanging sheet that is short", source="F = w L / 2, z = L^4 / 48")
def test_a_short_strip_has_half_its_weight_on_the_table():
    length = np.array([0.95, 1.0])
    pose = elastica(length=length, angle=length**3 / 24)  # beam theory: EI = 2, w = 1, no tangential force
    np.testing.assert_allclose(pose.normal_force, length / 2, rtol=1e-2)
    np.testing.assert_allclose(pose.z, length**4 / 48, rtol=1e-2)


def test_without_gravity_in_it_shapes_scale():
    small, smaller = elastica(length=0.1, angle=2.0), elastica(length=0.05, angle=2.0)
    np.testing.assert_allclose(small.x / 0.1, smaller.x / 0.05, rtol=1e-4)
    np.testing.assert_allclose(small.normal_force * 0.1**2, smaller.normal_force * 0.05**2, rtol=1e-3)
    np.testing.assert_allclose(small.max_curvature * 0.1, smaller.max_curvature * 0.05, rtol=1e-4)


def test_poses_do_not_depend_on_the_way_to_them():
    x, z = scattered(1500, 3)
    there, back = elastica(x, z), elastica(x[::-1], z[::-1])
    np.testing.assert_array_equal(there.angle, back.angle[::-1])
    np.testing.assert_array_equal(there.suspended[:1], elastica(x[:1], z[:1]).suspended)


def test_neighbours_are_neighbours_all_over_the_workspace():
    x, z = scattered(3000, 4)
    x, z = x[x > 0.5], z[x > 0.5]
    pose, near = elastica(x, z), elastica(x + 1e-5, z)
    both = pose.valid & near.valid
    assert both.mean() > 0.99
    assert np.abs(near.angle - pose.angle)[both].max() < 1e-3


def test_a_moment_at_the_tip_bends_it_there():
    free, bent = elastica(3.0, 2.0), elastica(3.0, 2.0, tip_moment=0.5)
    assert bent.valid
    assert bent.angle > free.angle + 0.1


WIDTHS = [(0.0, 0.15), (2.0, 0.4), (3.5, 1.0), (7.0, 0.1)]


@pytest.mark.case("planners", "Hanging sheet of varying width", source="elastica, integrated by SciPy")
def test_a_sheet_of_any_width_obeys_its_equations():
    """Integrated anew from the lift-off point, by SciPy, piece by piece."""
    x, z = scattered(40, 6)
    pose = elastica(x, z, width=WIDTHS)
    assert pose.valid.sum() > 25
    places, widths = np.array(WIDTHS).T
    weight = CubicSpline(np.linspace(0, 7, 70001), np.interp(np.linspace(0, 7, 70001), places, widths)).antiderivative()
    for i in np.flatnonzero(pose.valid):
        length, up, forward = pose.suspended[i], pose.normal_force[i], pose.tangential_force[i]

        def slope(s, y, length=length, up=up, forward=forward):
            before = weight(length) - weight(length - s)
            turn = 0.5 * y[1] / np.interp(length - s, places, widths)
            return turn, (up - before) * np.cos(y[0]) - forward * np.sin(y[0]), np.cos(y[0]), np.sin(y[0])

        angle, moment, along, height = solve_ivp(
            slope, (0.0, length), np.zeros(4), "DOP853", rtol=1e-9, atol=1e-11, max_step=0.02
        ).y[:, -1]
        assert (angle, moment) == pytest.approx((pose.angle[i], 0.0), abs=2e-5)
        assert (length - along, height) == pytest.approx((x[i], z[i]), abs=2e-6)


def test_a_sheet_twice_as_wide_hangs_the_same_way_with_twice_the_forces():
    x, z = scattered(100, 7)
    once, twice = elastica(x, z, width=WIDTHS), elastica(x, z, width=np.array(WIDTHS) * [1.0, 2.0])
    assert (once.valid == twice.valid).all()
    np.testing.assert_allclose(twice.angle, once.angle, atol=1e-8)
    np.testing.assert_allclose(twice.normal_force, 2.0 * once.normal_force, rtol=1e-7, atol=1e-9)
    even = elastica(x, z, width=[(0.0, 1.0), (3.0, 1.0)])
    np.testing.assert_allclose(even.angle, elastica(x, z).angle, atol=1e-9)


@pytest.mark.parametrize(
    ("x", "z"), [(50.0, 2.0), (-0.5, 1.0), (3.0, -0.1), (0.0, 0.0), (0.1, 0.1), (0.0, 3.0), (10.5, 4.5)]
)
def test_positions_outside_the_manifold_are_refused(x, z):
    pose = elastica(x, z)
    assert not pose.valid
    assert not pose.stable
    assert np.isnan(pose.angle)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x": 1.0}, "x and z, or length and angle"),
        ({"x": 1.0, "z": 1.0, "length": 2.0}, "x and z, or length and angle"),
        ({"x": [1.0, 2.0], "z": [1.0, 2.0, 3.0]}, "broadcast"),
        ({"x": float("nan"), "z": 1.0}, "x must"),
        ({"x": "far", "z": 1.0}, "x must"),
        ({"x": 1.0, "z": 1.0, "width": [(0.0, -1.0)]}, "width must be positive"),
        ({"x": 1.0, "z": 1.0, "width": [(0.0, 1.0), (0.0, 2.0)]}, "width must have places that increase from 0"),
        ({"x": 1.0, "z": 1.0, "width": [(1.0, 1.0)]}, "width must have places that increase from 0"),
        ({"x": 1.0, "z": 1.0, "width": 2.0}, "width"),
    ],
)
def test_bad_input_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        elastica(**arguments)


def test_arrays_keep_their_shape_and_may_be_empty():
    pose = elastica(np.full((2, 1), 3.0), np.array([1.0, 2.0, 2.5]))
    assert pose.angle.shape == (2, 3)
    assert elastica([], []).angle.shape == (0,)
    assert elastica(3.0, 2.0).force_ratio.shape == ()
    assert withe.folding.Elastica is type(pose)
