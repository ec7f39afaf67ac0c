"""Poses that lay a straight line: both optima against tables, the region of poses, what is refused."""

from pathlib import Path

import numpy as np
import pytest

from withe.deployment import StraightLine, grasp

DATA = Path(__file__).resolve().parent.parent / "data"
BRANCHES = np.genfromtxt(DATA / "sheet_branches_without_tangential_force.csv", delimiter=",", names=True)
INEXTENSIBLE = 1e9


@pytest.mark.case("planners", "Both optima of a straight line", source="table, five decimals")
@pytest.mark.parametrize("branch", [1, 2])
def test_both_optima_are_those_of_the_table(branch):
    rows = BRANCHES[(BRANCHES["branch"] == branch) & (BRANCHES["lsbar"] > 2) & (BRANCHES["tip_z_over_Lgb"] > 0)]
    checked = 0
    for row in rows[::5]:
        line = StraightLine(row["lsbar"], INEXTENSIBLE)
        pose = line.gentle if branch == 1 else line.folded
        if branch == 2 and not pose.valid:
            continue  # the table has those that dip below the floor
        found = [pose.x, pose.z, pose.angle, pose.force[1]]
        wanted = [row[name] for name in ("tip_X_from_qC_over_Lgb", "tip_z_over_Lgb", "alpha_rad", "Fn_over_wLgb")]
        np.testing.assert_allclose(found, wanted, atol=3e-5)
        assert abs(pose.force[0]) < 1e-9
        checked += 1
    assert checked > 5


def test_long_rods_have_the_known_optima():
    line = StraightLine(20.0, INEXTENSIBLE)
    np.testing.assert_allclose([line.gentle.force[1], line.gentle.x], [1.515310, 2.566219], atol=1e-5)
    np.testing.assert_allclose([line.folded.force[1], line.folded.x], [4.913426, -3.656735], atol=1e-5)
    assert line.gentle.stable
    assert not line.folded.stable


def test_the_gentle_optimum_is_the_grasp_without_curvature():
    line, found = StraightLine(6.0), grasp(6.0, 0.0)
    np.testing.assert_allclose([line.gentle.x, line.gentle.z], found.position[[0, 2]], atol=1e-9)
    assert line.pose(line.gentle.x, line.gentle.z).force[1] == pytest.approx(found.force[2], abs=1e-8)


def test_the_energy_integral_holds_along_each_rod():
    line = StraightLine(5.0, INEXTENSIBLE)
    pose = line.pose([2.0, 2.6, -1.0], [3.5, 3.4, 2.0])
    assert pose.valid.all()
    for i in range(3):
        points = line.points(pose.x[i], pose.z[i])
        s = np.linspace(0.0, 5.0, len(points))
        slope = np.gradient(points, s, axis=0, edge_order=2)
        angle = np.unwrap(np.arctan2(slope[:, 2], slope[:, 0]))
        curvature = np.gradient(angle, s, edge_order=2)
        integral = curvature**2 + (slope * [1, 0, 1]) @ [-pose.force[i, 0], 0.0, -pose.force[i, 1]]
        integral += s * slope[:, 2] - points[:, 2]  # m.m / 4 + n.t - z
        np.testing.assert_allclose(integral[3:-3], integral[3], atol=2e-2)
        assert angle[-1] == pytest.approx(pose.angle[i], abs=2e-2)


def test_the_outline_bounds_valid_poses():
    line = StraightLine(4.0)
    outline = line.outline
    rays = len(outline) // 2
    far = outline[3 : rays - 3]
    inside, outside = line.pose(*(0.99 * far).T), line.pose(*(1.02 * far).T)
    assert inside.valid.all()
    assert not outside.valid.any()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: StraightLine(0.0), "suspended must be from 0.3 to 50"),
        (lambda: StraightLine(float("nan")), "suspended"),
        (lambda: StraightLine(5.0, 1.0), "stretch_stiffness"),
        (lambda: StraightLine(5.0).pose([1.0, 2.0], [1.0, 2.0, 3.0]), "broadcast"),
        (lambda: StraightLine(5.0).points(30.0, 1.0), "no pose there"),
    ],
)
def test_bad_input_says_what_is_wrong(call, message):
    with pytest.raises(ValueError, match=message):
        call()
