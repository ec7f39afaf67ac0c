"""Grasps that lay a rod, against tables of the continuum equations, limits and closed forms."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import withe
from withe.deployment import grasp

DATA = Path(__file__).resolve().parent.parent / "data"
ROWS = np.genfromtxt(DATA / "rod_grasps.csv", delimiter=",", names=True)


def columns(*names):
    return np.stack([ROWS[name] for name in names], -1)


@pytest.mark.case("planners", "63 grasps of a cable in space", source="table of Kirchhoff's equations, four decimals")
def test_every_row_of_the_table_is_found():
    found = grasp(ROWS["lsbar"], ROWS["kappabar"], ROWS["ksbar"])
    np.testing.assert_allclose(found.position, columns("x", "y", "z"), rtol=0, atol=1e-4)
    np.testing.assert_allclose(found.rotation, columns("ex", "ey", "ez"), rtol=0, atol=1e-4)
    np.testing.assert_allclose(found.force[:, 1:], columns("Fy_over_wLgb", "Fz_over_wLgb"), rtol=0, atol=1e-4)
    np.testing.assert_array_equal(found.force[:, 0], 0.0)
    assert found.stable.all()
    assert found.residual.max() < 1e-5


def test_a_long_straight_line_is_laid_from_its_known_optimum():
    found = grasp([9.5, 20.0, 45.0], 0.0, 1e9)  # the constants are those of a rod that does not stretch
    np.testing.assert_allclose(found.force[:, 2], 1.515310, atol=1e-5)
    np.testing.assert_allclose(found.position[:, 0], 2.566219, atol=1e-5)


@pytest.mark.case("planners", "Grasp of a short cable", source="F = w L / 2, z = L^4 / 48")
def test_a_short_rod_rests_half_its_weight_on_the_floor():
    length = 0.1
    found = grasp(length, 0.0)
    np.testing.assert_allclose(found.force[2], length / 2, rtol=1e-4)  # beam theory: EI = 2, w = 1
    np.testing.assert_allclose(found.position[2], length**4 / 48, rtol=1e-3)


def test_forces_beyond_seven_lengths_no_longer_change():
    curvature = np.linspace(0.0, 4.0, 9)
    long = grasp(50.0, curvature).force
    for suspended in (7.0, 12.0, 25.0):
        np.testing.assert_allclose(grasp(suspended, curvature).force, long, rtol=0, atol=1e-3)


def test_mirrored_curvature_mirrors_the_grasp():
    right, left = grasp(4.0, 0.8), grasp(4.0, -0.8)
    np.testing.assert_array_equal(left.position, right.position * [1, -1, 1])
    np.testing.assert_array_equal(left.force, right.force * [1, -1, 1])
    np.testing.assert_array_equal(left.rotation, right.rotation * [-1, 1, -1])


def test_the_jaws_force_balances_the_couple_at_lift_off():
    # About the upright axis through the lift-off point, where weight and the floor's force have no moment.
    curvature = np.array([0.2, 0.7, 3.0])
    found = grasp(6.0, curvature)
    jaw = [0.0, 0.0, 6.0] - found.force
    about_z = found.position[:, 0] * jaw[:, 1] - found.position[:, 1] * jaw[:, 0]
    np.testing.assert_allclose(about_z, -2.0 * curvature, rtol=1e-6)


@pytest.mark.case(
    "planners", "Grasp of a thick cable that friction twists", source="Kirchhoff's equations, integrated by SciPy"
)
@pytest.mark.parametrize("axial_force", [0.0, 0.3])
@pytest.mark.parametrize(("suspended", "curvature", "radius"), [(6.0, 0.6, 0.05), (2.0, -1.1, 0.1), (1.5, 0.4, 0.0)])
def test_a_thick_rod_is_twisted_by_the_friction_at_its_surface(suspended, curvature, radius, axial_force):
    # Kirchhoff's equations in space, integrated from lift-off with the forces that were found.
    stretch, bend, twist = 2000.0, 2.0, 2.0 / 1.5  # EI, GJ of an incompressible round rod [w Lgb^2]
    found = grasp(suspended, curvature, stretch, axial_force=axial_force, radius=radius)
    force = found.force

    def slopes(s, y):
        r, moment = y[3:12].reshape(3, 3), y[12:]
        t, n = r[:, 0], [-force[0], -force[1], s - force[2]]
        longer = 1.0 + n @ t / (bend * stretch)
        along = moment @ t
        turning = (moment - along * t) / bend + along / twist * t
        return np.concatenate([longer * t, np.cross(turning, r.T).T.ravel(), -longer * np.cross(t, n)])

    # Couple of the floor about the centreline at lift-off; force_y acts some way behind.
    couple = np.cross([0.0, 0.0, -radius], force)
    couple += np.cross([-radius * np.sqrt(bend / twist), 0.0, 0.0], [0.0, force[1], 0.0])
    start = np.concatenate([np.zeros(3), np.eye(3).ravel(), [0.0, 0.0, -bend * curvature] - couple])
    end = solve_ivp(slopes, (0.0, suspended), start, rtol=1e-10, atol=1e-11).y[:, -1]
    rotation = Rotation.from_rotvec(found.rotation).as_matrix()
    np.testing.assert_allclose(found.position, end[:3], atol=2e-6)
    np.testing.assert_allclose(rotation, end[3:12].reshape(3, 3), atol=2e-6)
    np.testing.assert_allclose(end[12:], -radius * force[1] * rotation[:, 0], atol=1e-5)  # the jaw twists, no more
    assert found.stable


def test_thick_rods_are_solved_all_over_the_range():
    random = np.random.default_rng(2)
    suspended, curvature = random.uniform(0.1, 50, 300), random.uniform(-2, 2, 300)
    radius = random.uniform(0.0, 0.1, 300)
    found = grasp(suspended, curvature, 4.0 / np.maximum(radius, 0.02) ** 2, radius=radius)
    assert found.residual.max() < 1e-4
    with pytest.raises(withe.ConvergenceError, match="no grasp found"):  # twisted so hard that the floor would pull
        grasp(7.0, 5.0, radius=0.1)


def test_curvature_needs_more_friction_the_shorter_the_rod_hangs():
    np.testing.assert_allclose(grasp([7.0, 3.0, 2.0, 1.5, 1.0], 0.5).friction, [0.30, 0.34, 0.56, 0.94, 2.0], rtol=0.03)


def test_a_push_along_the_rod_saves_friction():
    curvature = np.array([0.5, 0.75, 1.0])
    pushed = grasp(7.0, curvature, axial_force=0.82 * curvature**2)
    np.testing.assert_allclose(pushed.friction, [0.26, 0.39, 0.52], atol=0.01)
    np.testing.assert_allclose(grasp(7.0, curvature).friction, [0.30, 0.55, 0.93], atol=0.01)


def test_neighbours_are_neighbours():
    random = np.random.default_rng(1)
    suspended, curvature = random.uniform(0.1, 50, 400), random.uniform(-6, 6, 400)
    stretch = random.uniform(300, 8000, 400)
    here, there = grasp(suspended, curvature, stretch), grasp(suspended + 1e-5, curvature, stretch)
    assert np.abs(here.position - there.position).max() < 1e-4
    assert here.residual.max() < 1e-4
    assert here.stable.all()


def test_one_grasp_is_that_of_many():
    many = grasp([3.0, 9.0], [0.2, 2.0])
    one = grasp(9.0, 2.0)
    assert one.position.shape == (3,)
    assert one.stable.shape == ()
    np.testing.assert_array_equal(one.position, many.position[1])
    assert grasp([], []).rotation.shape == (0, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"suspended": 0.0, "curvature": 0.0}, "suspended must be from 0.1"),
        ({"suspended": -2.0, "curvature": 0.0}, "suspended must be from 0.1"),
        ({"suspended": float("nan"), "curvature": 0.0}, "suspended"),
        ({"suspended": 3.0, "curvature": 7.0}, "curvature must be from 0 to 6"),
        ({"suspended": [3.0, 2.0], "curvature": [0.0, 0.1, 0.2]}, "broadcast"),
        ({"suspended": 3.0, "curvature": 0.0, "stretch_stiffness": 0.0}, "stretch_stiffness"),
        ({"suspended": 3.0, "curvature": 0.0, "radius": -0.1}, "radius must be from 0 to 0.25 Lgb, got -0.1"),
        ({"suspended": 90.0, "curvature": 0.0, "stretch_stiffness": 300.0}, "stretch_stiffness"),
    ],
)
def test_bad_input_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        grasp(**arguments)


def test_an_impossible_push_is_said():
    with pytest.raises(withe.ConvergenceError, match="no grasp found for suspended=7"):
        grasp(7.0, 0.25, axial_force=50.0)
