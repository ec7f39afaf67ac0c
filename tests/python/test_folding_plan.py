"""Plans of how paper is folded: what they promise, against what their poses say by themselves."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import withe
from cases import measured
from planned_folds import PAPERS, freely, planned
from withe.__main__ import main
from withe.folding import FoldPlan, Jaw, Paper, elastica, plan, replan
from withe.folding.grid import make_grid
from withe.folding.sheets import at_poses, forces_of


def inner_edges(folded):
    """Path of the inner edge of the jaw in a plan, from its poses as its docstring defines them: x, z [m]."""
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


def test_strips_of_any_length_are_planned_over_one_manifold():
    plan(Paper.a4())
    made = make_grid.cache_info().misses
    plan(replace(Paper.us_letter(), gravito_bending_length=0.0517))
    assert make_grid.cache_info().misses == made


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


@pytest.mark.case("planners", "Predicted slide of three folds", source="independent model: elastica and Coulomb")
def test_predicted_slides_are_those_of_a_model_of_its_own():
    """Rigid lying sheet, elastica and Coulomb, computed without this code: open loop, half folds [mm]."""
    measured(
        np.subtract(
            [
                1000.0 * planned("a4").slide[-1],
                1000.0 * planned("a4", 0.25).slide[-1],
                1000.0 * planned("us_letter").slide[-1],
            ],
            [7.6, 7.6, 9.6],
        ),
        "mm",
    )
    assert 1e3 * planned("a4").slide[-1] == pytest.approx(7.6, abs=0.5)
    assert 1e3 * planned("a4", 0.25).slide[-1] == pytest.approx(7.6, abs=0.5)
    assert 1e3 * planned("us_letter").slide[-1] == pytest.approx(9.6, abs=0.5)


def test_half_a_circle_slides_far_and_snaps():
    folded = planned("a4", method="intuitive")
    radius = np.hypot(folded.poses[:-1, 0] - 0.1485, folded.poses[:-1, 2])
    np.testing.assert_allclose(radius, 0.1485, rtol=1e-12)
    assert np.nanmax(folded.slide) > 0.1
    assert np.isnan(folded.slide[-1])


@pytest.mark.parametrize(("paper", "target"), [("a4", "half"), ("a4", 0.25)])
def test_a_free_moment_needs_no_friction_and_bears_another_stiffness(paper, target):
    folded = freely(paper, target)
    assert np.abs(folded.sheet.tangential_force).max() == 0.0
    assert np.abs(folded.slide).max() == 0.0
    lgb = folded.paper.gravito_bending_length
    assert folded.max_curvature.max() * lgb < 2.5
    inner = (inner_edges(folded) - [folded.jaw.depth, 0])[1:]
    for factor in (0.9, 0.95, 1.05, 1.1):  # the same poses, another paper, half of the friction
        other = lgb * factor
        poses = np.column_stack([inner / other, folded.angles[1:]])
        sheet = at_poses(poses, forces_of(folded.sheet)[1:])
        assert sheet.valid.all()
        assert sheet.stable.all()
        lying = (folded.paper.length - folded.jaw.depth) / other - sheet.suspended
        ratio = np.abs(sheet.tangential_force) / (sheet.normal_force + lying)
        assert ratio.max() < 1.1 * 0.5 * folded.paper.friction
        assert ratio.max() > 1e-3  # the stiffness does matter


@pytest.mark.parametrize("stiffer", [0.9639, 0.9645, 1.0, 1.03])
def test_an_edge_with_a_free_moment_comes_down_where_it_is_to_lie_and_grazes_nothing_before(stiffer):
    """At 0.9639 and 0.9645 the shortest way was on the sheet over its last 15 mm, which it pushed 11 mm along."""
    paper = replace(Paper.a4(), gravito_bending_length=stiffer * Paper.a4().gravito_bending_length)
    found = plan(paper, method="slip", grasp="free", progress=False)
    x, _, z = found.poses[:, :3].T
    looks_back = (found.angles > 0.5 * np.pi) & (x < found.target - 0.01)
    assert looks_back.sum() > 50
    assert z[looks_back].min() > 1e-3


def test_curvature_of_2_11_folds_a4_in_half():
    assert freely("a4", "half", 2.11).max_curvature.max() * 0.048 < 2.11


def test_us_letter_is_folded_in_half_without_slide_if_it_is_as_thought():
    with pytest.warns(UserWarning, match=r"the sheet slides .* for a paper within the uncertainty, with Lgb 0\.066 m"):
        folded = freely("us_letter")
    assert 0 < folded.slip_ratio.max() < 0.12
    assert np.abs(folded.slide).max() == 0.0


def test_a_bound_of_curvature_that_is_too_low_says_which_would_do():
    with pytest.raises(ValueError, match="the least possible curvature there is") as raised:
        plan(Paper.cardboard(), method="slip", grasp="free", curvature=3.5)
    least = float(str(raised.value).split()[-1])
    assert 3.5 < least < 4.2
    with pytest.warns(UserWarning, match="the sheet slides"):
        bent = plan(Paper.cardboard(), method="slip", grasp="free", curvature=1.05 * least, ending="slow")
    assert bent.max_curvature.max() * 0.132 < 1.1 * least


@pytest.mark.parametrize(
    ("paper", "target", "curvature", "least"),
    [("us_letter", 0.2, 2.5, 0.275), ("cardboard", "half", 4.0, 0.66), ("cardboard", 0.2, 6.5, 0.51)],
)
def test_the_least_friction_that_a_free_moment_needs_is_found(paper, target, curvature, least):
    """By a search of its own: bottleneck paths over equilibria with any moment, curvature bounded."""
    with pytest.warns(UserWarning, match="the sheet slides"):
        folded = freely(paper, target, curvature)
    assert folded.slip_ratio.max() < 1.05 * least


def test_the_rest_of_a_fold_without_slide_goes_on_without_slide():
    folded = freely("a4")
    pushed = folded.poses[120] + [0.002, 0, 0.001, 0, 0, 0, 0]  # where the jaw is instead
    rest = replan(folded, pushed, 0.001)
    np.testing.assert_allclose(rest.poses[0], pushed, atol=1e-8)
    np.testing.assert_allclose(rest.poses[-1], folded.poses[-1] + [0.001, 0, 0, 0, 0, 0, 0], atol=1e-6)
    later = len(rest) // 3 + 1
    assert np.abs(rest.sheet.tangential_force[later:]).max() < 1e-9
    assert rest.slip_ratio[0] > 1e-4


def test_least_slide_without_a_moment_is_less_than_that_of_least_force():
    with pytest.warns(UserWarning, match="the sheet slides"):
        folded = plan(Paper.a4(), method="slip")
    assert 0 < folded.slide[-1] < planned("a4").slide[-1]


@pytest.mark.filterwarnings("ignore:the sheet slides")
@pytest.mark.parametrize(
    ("paper", "frictions"), [pytest.param("a4", (0.12, 0.3), marks=pytest.mark.slow), ("us_letter", (0.28, 0.36))]
)
def test_more_friction_gives_no_worse_plan(paper, frictions):
    """At 0.24, 0.26 and 0.275 A4 slid by 0.03 to 0.08 mm on ways that were without slide at their nodes alone."""
    sheet = PAPERS[paper]()
    plans = [
        plan(replace(sheet, friction=friction), method="slip", uncertainty=(0.0, 0.0))
        for friction in np.linspace(*frictions, 19)
    ]
    slides = np.array([np.abs(folded.slide).max() for folded in plans])
    assert slides[0] > 1e-3
    assert np.diff(slides).max() < 2e-3 * sheet.gravito_bending_length  # the room that a way has to be short
    free = int(np.argmin(slides))
    assert slides[free] == 0.0
    assert 0 < free < 15
    assert (slides[free:] == 0.0).all()


@pytest.mark.filterwarnings("ignore:the sheet slides by")
@pytest.mark.parametrize(("friction", "target"), [(0.12, "half"), (0.2, "half"), (0.2, 0.25)])
def test_the_friction_that_a_warning_names_is_the_least_that_is_enough(friction, target):
    """A bottleneck search of its own over lengths and angles, `benchmarks/folding.py`, finds 0.22955 for A4."""
    options = {"target": target, "method": "slip", "uncertainty": (0.0, 0.0)}
    with pytest.warns(UserWarning, match="the fold needs a friction coefficient of") as warned:
        plan(replace(Paper.a4(), friction=friction), **options)
    needed = float(str(warned[0].message).split("coefficient of ")[1].split(",")[0])
    assert needed == pytest.approx(0.22955, abs=1e-3)
    assert np.abs(plan(replace(Paper.a4(), friction=needed), **options).slide).max() == 0.0
    with pytest.warns(UserWarning, match=f"needs a friction coefficient of {needed:.3f}"):
        less = plan(replace(Paper.a4(), friction=0.99 * needed), **options)
    assert np.abs(less.slide).max() > 1e-4


@pytest.mark.parametrize("way", ["ucs", "intuitive", "local", "replan"])
def test_sheets_are_drawn_where_they_are_predicted_to_be_and_joined_to_the_jaw(way):
    """They were drawn without slide, and half a circle's hung from black bars of up to 190 mm."""
    pytest.importorskip("matplotlib").use("Agg")
    folded = replan(planned("a4"), planned("a4").poses[100], 0.004) if way == "replan" else planned("a4", method=way)
    axes = folded.plot(poses=11)
    lines = [line.get_xydata() for line in axes.lines]
    bars = np.array([line for line in lines if len(line) == 2 and line[0, 1] + line[1, 1] > 1e-6])
    sheets = [line for line in lines if len(line) > 300]
    np.testing.assert_allclose(np.linalg.norm(np.diff(bars, axis=1)[:, 0], axis=1), 0.01, rtol=1e-2)
    shown = np.linspace(0, len(folded) - 1, 11).astype(int)
    known = shown[np.isfinite(folded.slide[shown])]
    assert len(sheets) == len(known)
    assert (len(known) < 11) == (way in ("intuitive", "local"))
    far = [points[0, 0] for points in sheets]  # of the sheet
    np.testing.assert_allclose(far, folded.paper.length + folded.offset + folded.slide[known], atol=1e-6)
    axes.figure.canvas.draw()
    assert axes.get_legend().get_window_extent().y0 >= axes.get_window_extent().y1


def test_what_is_said_of_half_a_circle_is_known():
    assert "nan" not in repr(planned("a4", method="intuitive"))


@pytest.mark.parametrize(("paper", "target"), [("us_letter", 0.2), ("cardboard", "half"), ("cardboard", 0.2)])
def test_a_path_on_which_the_sheet_jumps_says_so_and_promises_no_slide(paper, target):
    """In simulation US Letter at 0.20 m slides back by 88 mm at 0.24 m/s, and cardboard snaps."""
    folded = planned(paper, target)
    assert 0.5 * folded.times[-1] < folded.jumps_at < folded.times[-1]
    before = folded.times < folded.jumps_at
    assert np.isfinite(folded.slide[before]).all()
    assert np.isnan(folded.slide[~before]).all()
    assert np.nanmax(np.abs(folded.slide)) < 0.03
    assert np.isfinite(folded.slip_ratio).all()  # what the path asks for is known all the same
    assert planned("a4").jumps_at is None


def test_looking_one_step_ahead_lifts_the_whole_sheet():
    folded = plan(Paper.a4(), method="local")
    lifted = folded.sheet.suspended / ((folded.paper.length - folded.jaw.depth) / folded.paper.gravito_bending_length)
    assert lifted[np.searchsorted(folded.times, folded.jumps_at)] > 0.99
    assert folded.jumps_at < 0.6 * folded.times[-1]
    assert folded.poses[-1, 0] == pytest.approx(0.297, abs=1e-8)


@pytest.mark.parametrize(("at", "slide"), [(100, 0.004), (160, 0.004), (200, -0.003)])
def test_the_rest_of_a_fold_is_planned_anew_from_where_the_sheet_slid(at, slide):
    folded = planned("a4")
    rest = replan(folded, folded.poses[at], slide)
    np.testing.assert_allclose(rest.poses[0], folded.poses[at], atol=1e-9)
    np.testing.assert_allclose(rest.poses[-1], folded.poses[-1] + [slide, 0, 0, 0, 0, 0, 0], atol=1e-6)
    lgb = folded.paper.gravito_bending_length
    inner = inner_edges(rest) - [rest.jaw.depth + slide, 0]
    off = rest.angles - elastica(inner[:, 0] / lgb, inner[:, 1] / lgb).angle
    np.testing.assert_allclose(off, off[0] * np.linspace(1, 0, len(rest)), atol=1e-6)
    assert np.abs(np.diff(rest.angles)).max() < 0.1
    again = replan(rest, rest.poses[50], slide)
    assert again.target == pytest.approx(rest.target)


@pytest.mark.parametrize(("paper", "target"), [(Paper.origami(), "half"), (Paper.a4(), 0.02), (Paper.cardboard(), 0.1)])
@pytest.mark.filterwarnings("ignore:the sheet jumps")
def test_a_target_out_of_reach_is_refused_with_those_that_can_be_reached(paper, target):
    with pytest.raises(ValueError, match=r"targets from 0\.\d+ to 0\.\d+ m can be reached$") as refused:
        plan(paper, target)
    words = str(refused.value).split()
    for reached in (float(words[-7]), float(words[-5])):
        assert plan(paper, reached).poses[-1, 0] == pytest.approx(reached, abs=1e-8)


def test_that_a_sheet_jumps_on_every_way_is_told_from_that_there_is_none():
    with pytest.raises(ValueError, match=r"no path .*: the sheet jumps on every path"):
        plan(Paper.cardboard(), method="slip")


def test_a_pose_far_from_any_sheet_is_refused():
    folded = planned("a4")
    with pytest.raises(ValueError, match="pose must be near a pose without moment"):
        replan(folded, [2.0, 0, 0.1, 0, 0, 0, 1], 0.0)
    with pytest.raises(ValueError, match="slide must"):
        replan(folded, folded.poses[100], float("nan"))


def test_the_command_writes_a_plan(tmp_path, capsys):
    out = tmp_path / "fold.csv"
    assert (
        main(["fold", "--paper", "a4", "--target", "half", "--method", "slip", "--grasp", "free", "--out", f"{out}"])
        == 0
    )
    assert "slides 0.0 mm" in capsys.readouterr().out
    np.testing.assert_allclose(np.loadtxt(out, delimiter=",", skiprows=1)[:, 1:], freely("a4").poses, atol=1e-8)
    assert main(["fold", "--target", "0.5", "--out", f"{out}"]) == 2
    assert "target must be on the sheet" in capsys.readouterr().err
    assert main(["fold", "--lgb", "-1", "--out", f"{out}"]) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "foo.txt"], "withe: out must end in .csv or .json, got 'foo.txt'"),
        (["--out", "nowhere/foo.csv"], "withe: out must be in an existing folder, got 'nowhere/foo.csv'"),
        (
            ["--lgb", "48"],
            "withe: gravito_bending_length must be at most 10 lengths, got 48 m: are all sizes in metres?",
        ),
        (["--thickness", "0.1"], "withe: thickness must be at most a tenth of the length"),
        (["--curvature", "3"], "withe: curvature needs grasp='free'"),
        (["--paper", "origami"], "m can be reached"),
    ],
)
def test_the_command_refuses_in_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["fold", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_command_says_what_a_target_may_be(capsys):
    with pytest.raises(SystemExit):
        main(["fold", "--target", "abc"])
    assert (
        "argument --target: target, if not in m or a fraction such as '1/3', must be 'half' or 'third'"
        in capsys.readouterr().err
    )


def test_the_command_takes_any_size_of_paper_and_warns_in_one_line(tmp_path, capsys):
    sizes = ["--length", "0.28", "--width", "0.1", "--thickness", "2e-4", "--lgb", "0.05", "--friction", "0.2"]
    assert main(["fold", *sizes, "--method", "slip", "--out", str(tmp_path / "fold.json")]) == 0
    folded = FoldPlan.load(tmp_path / "fold.json")
    assert folded.paper == Paper(0.28, 0.1, 0.05, friction=0.2, thickness=2e-4)
    said = capsys.readouterr().err
    assert said.startswith("withe: the sheet slides: the fold needs a friction coefficient of 0.")
    assert said.count("\n") == 1


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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"paper": "a4"}, "paper must be a Paper"),
        ({"target": 0.4}, "target must be on the sheet"),
        ({"target": -0.1}, "target must be positive"),
        ({"target": float("nan")}, "target must"),
        ({"target": "fifth"}, "target, if not in m or a fraction such as '1/3', must be 'half'"),
        ({"target": 0.02}, "target must be reachable without moment, got 0.02 m"),
        ({"method": "best"}, "method must be"),
        ({"grasp": "tight"}, "grasp must be"),
        ({"ending": "soft"}, "ending must be"),
        ({"grasp": "free"}, "grasp 'free' needs method='slip'"),
        ({"uncertainty": (0.1, 1.5)}, "uncertainty must be at most 0.3 for Lgb"),
        ({"uncertainty": 0.1}, "uncertainty must"),
        ({"curvature": 0.0}, "curvature must be positive"),
        (
            {"curvature": 3.0},
            "curvature needs grasp='free', whose moment is not limited otherwise, got grasp='moment_free'",
        ),
        ({"curvature": 2.5, "method": "intuitive"}, "curvature needs grasp='free'"),
        ({"speed": 0.0}, "speed must be positive"),
        ({"acceleration": float("nan")}, "acceleration must"),
        ({"jaw": Jaw(depth=0.1)}, "jaw must hold less than a fifth"),
        ({"paper": Paper(1.2, 0.2, 0.048)}, "target must be reachable without moment"),
    ],
)
def test_bad_input_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        plan(**{"paper": Paper.a4(), **arguments})


def test_the_planner_knows_no_simulated_sheet():
    """Simulations check the plan, so the planner must not have seen them."""
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


@pytest.mark.parametrize(
    ("words", "share"),
    [("half", 0.5), ("third", 1 / 3), ("quarter", 0.25), ("1/3", 1 / 3), ("2/5", 0.4), ("1 / 2", 0.5)],
)
def test_a_target_may_be_the_share_of_the_sheet_that_is_folded_over(words, share):
    paper = Paper(length=0.2, width=0.1, gravito_bending_length=0.06)
    found = plan(paper, words, method="intuitive", progress=False)
    assert found.target == pytest.approx(2.0 * share * 0.2, rel=1e-15)
    assert found.target == plan(paper, 2.0 * share * 0.2, method="intuitive", progress=False).target


@pytest.mark.parametrize(
    ("target", "message"),
    [("thrid", "did you mean 'third'"), ("2/3", "fraction up to 1/2"), ("0/3", "fraction up to 1/2"), ("1/0", "up to")],
)
def test_shares_that_cannot_be_folded_are_refused(target, message):
    with pytest.raises(ValueError, match=message):
        plan(Paper.a4(), target)
