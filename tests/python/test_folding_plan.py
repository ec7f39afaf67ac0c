"""Plans of how paper is folded: what they promise, against what their poses say by themselves."""

import ast
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.folding import Jaw, Paper, elastica, plan

PAPERS = {"a4": Paper.a4, "us_letter": Paper.us_letter, "cardboard": Paper.cardboard}


@cache
def planned(paper, target="half", method="ucs"):
    return plan(PAPERS[paper](), target, method=method)


def inner_edges(folded):
    """Where a plan has the inner edge of the jaw, from its poses by the words of its docstring: x, z [m]."""
    _, qy, _, qw = folded.poses[:, 3:].T
    along = np.stack([1 - 2 * qy**2, -2 * qy * qw], axis=1)  # x axis of the frame, in the plane of x and z
    return folded.poses[:, [0, 2]] + folded.jaw.depth * along


@pytest.mark.parametrize(
    ("paper", "target", "where"),
    [("a4", "half", 0.297), ("a4", 0.25, 0.25), ("us_letter", 0.2, 0.2), ("cardboard", "half", 0.2794)],
)
def test_a_fold_begins_flat_and_ends_on_its_target(paper, target, where):
    folded = planned(paper, target)
    np.testing.assert_allclose(folded.poses[0], [0, 0, 0, 0, 0, 0, 1], atol=1e-4)
    assert folded.poses[-1, 0] == pytest.approx(where, abs=1e-8)
    assert 0 < folded.poses[-1, 2] < 1e-3
    assert folded.target == where


def test_poses_hold_the_sheet_without_moment():
    folded = planned("a4")
    lgb = folded.paper.gravito_bending_length
    inner = inner_edges(folded) - [folded.jaw.depth, 0]
    pose = elastica(inner[:, 0] / lgb, inner[:, 1] / lgb)
    lifted = folded.sheet.suspended > 1.2
    assert pose.valid[lifted].all()
    np.testing.assert_allclose(pose.angle[lifted], folded.angles[lifted], atol=1e-7)
    length = (folded.paper.length - folded.jaw.depth) / lgb
    ratio = np.abs(pose.tangential_force) / (pose.normal_force + length - pose.suspended)
    np.testing.assert_allclose(ratio[lifted], folded.slip_ratio[lifted], atol=1e-6)
    np.testing.assert_allclose(folded.poses[:, 4], np.sin(folded.angles / 2), atol=1e-12)
    assert np.abs(folded.sheet.tip_moment).max() < 1e-3


def test_a_rough_table_holds_the_sheet_where_it_is():
    paper = Paper(0.297, 0.21, 0.048, friction=50.0)
    assert np.abs(plan(paper).slide).max() == 0.0


def test_predicted_slides_are_those_of_a_model_of_its_own():
    """Rigid lying sheet, elastica and Coulomb, computed without this code: open loop, half folds [mm]."""
    assert 1e3 * planned("a4").slide[-1] == pytest.approx(7.6, abs=0.5)
    assert 1e3 * planned("a4", 0.25).slide[-1] == pytest.approx(7.6, abs=0.5)
    assert 1e3 * planned("us_letter").slide[-1] == pytest.approx(9.6, abs=0.5)


def test_half_a_circle_slides_far_and_snaps():
    folded = planned("a4", method="intuitive")
    radius = np.hypot(folded.poses[:-1, 0] - 0.1485, folded.poses[:-1, 2])
    np.testing.assert_allclose(radius, 0.1485, rtol=1e-12)
    assert np.nanmax(folded.slide) > 0.1
    assert np.isnan(folded.slide[-1])


def test_limits_of_speed_and_acceleration_hold():
    slow = plan(Paper.a4(), speed=0.03, acceleration=0.05, turning=0.4)
    velocity = np.diff(slow.poses[:, [0, 2]], axis=0) / np.diff(slow.times)[:, None]
    middle = 0.5 * (slow.times[1:] + slow.times[:-1])
    acceleration = np.diff(velocity, axis=0) / np.diff(middle)[:, None]
    assert np.linalg.norm(velocity, axis=1).max() < 0.03 * 1.001
    assert np.linalg.norm(acceleration, axis=1).max() < 0.05 * 1.05
    assert np.abs(np.diff(slow.angles) / np.diff(slow.times)).max() < 0.4 * 1.001
    assert slow.times[0] == 0
    assert np.all(np.diff(slow.times) > 0)
    assert slow.times[-1] > planned("a4").times[-1]


def test_an_edge_that_is_pressed_into_the_table_is_held_from_the_side():
    folded = planned("a4")
    assert folded.angles[-1] > 3.7
    assert folded.side == "side"
    assert folded.clearance > -1e-4
    x, z = folded.poses[-1, [0, 2]]
    assert folded.jaw.clearance(x, z, folded.angles[-1], "edge") < -0.02
    assert planned("a4", method="intuitive").side == "edge"


def test_saved_tables_hold_the_plan(tmp_path):
    folded = planned("a4")
    rows = np.genfromtxt(folded.save(tmp_path / "fold.csv"), delimiter=",", names=True)
    assert rows.dtype.names == ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
    np.testing.assert_allclose(rows["t"], folded.times, atol=1e-6)
    np.testing.assert_allclose(rows["qw"], folded.poses[:, 6], atol=1e-8)
    content = json.loads(folded.save(tmp_path / "fold.json").read_text())
    assert content["paper"]["gravito_bending_length"] == 0.048
    assert content["units"]["length"] == "m"
    np.testing.assert_allclose(content["prediction"]["slide"], folded.slide)
    json.loads(planned("a4", method="intuitive").save(tmp_path / "snaps.json").read_text(), parse_constant=pytest.fail)
    with pytest.raises(ValueError, match=r"\.csv or \.json"):
        folded.save(tmp_path / "fold.txt")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"paper": "a4"}, "paper must be a Paper"),
        ({"target": 0.4}, "target must be on the sheet"),
        ({"target": -0.1}, "target must be positive"),
        ({"target": float("nan")}, "target must"),
        ({"target": "third"}, "target must be 'half'"),
        ({"target": 0.02}, "target is 0.02 m"),
        ({"method": "best"}, "method must be"),
        ({"grasp": "tight"}, "grasp must be"),
        ({"speed": 0.0}, "speed must be positive"),
        ({"acceleration": float("nan")}, "acceleration must"),
        ({"jaw": Jaw(depth=0.1)}, "jaw must hold less than a fifth"),
        ({"paper": Paper(1.2, 0.2, 0.048)}, "no pose without moment"),
    ],
)
def test_bad_input_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        plan(**{"paper": Paper.a4(), **arguments})


def test_the_planner_knows_no_simulated_sheet():
    """What it says is checked by simulations, which it must not have seen."""
    package = Path(withe.__file__).parent
    pending, seen = ["withe.folding.planning"], set()
    while pending:
        name = pending.pop()
        if name in seen:
            continue
        seen.add(name)
        file = package.parent / Path(*name.split(".")).with_suffix(".py")
        if not file.is_file():
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("withe"):
                pending += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            elif isinstance(node, ast.Import):
                pending += [alias.name for alias in node.names if alias.name.startswith("withe")]
    assert "withe.folding.sheets" in seen
    for name in seen:
        assert not name.startswith(("withe.simulation", "withe.scene", "withe.parts")), name
        assert "simulated" not in name, name
