"""Plans of a gripper that lays a cable: the motion, its files, the command line, and what is refused."""

import copy
import json
import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from withe.__main__ import main
from withe.deployment import Cable, LayPlan, Pattern, Post, deploy, plan
from withe.deployment.motion import lengthened

CABLE = Cable.dlo(2)
JAW = 0.01  # [m] that are held


def wave(height=0.03, count=300):
    x = np.linspace(0.0, 0.5, count)
    return np.stack([x, height * np.sin(4 * np.pi * x)], 1)


@pytest.fixture(scope="module")
def motion():
    return plan(CABLE, Pattern(wave()))


def phase(motion, name):
    return next(phase for phase in motion.phases if phase.name == name)


def during(motion, name):
    part = phase(motion, name)
    return (motion.times >= part.start) & (motion.times <= part.end)


def test_each_pose_of_laying_is_the_grasp_of_its_place(motion):
    # Algorithm 12, written anew with matrices: q = qC + R_t q*, R = R_t exp(e), and half a jaw further.
    pattern, lgb = motion.pattern, CABLE.gravito_bending_length
    rows = np.flatnonzero(during(motion, "lay") & (motion.laid > 0.01) & (motion.laid < pattern.length - 0.01))[::40]
    for row in rows:
        s = motion.laid[row]
        point, tangent = (
            np.array([np.interp(s, pattern.arc_length, x[:, i]) for i in range(2)])
            for x in (pattern.points, pattern.tangent)
        )
        curvature = np.interp(s, pattern.arc_length, pattern.curvature)
        found = withe.deployment.grasp(
            (motion.cable.length - 0.5 * JAW - s) / lgb,
            -curvature * lgb,
            CABLE.stretch_stiffness,
            radius=CABLE.radius / lgb,
        )
        x = np.append(tangent, 0.0) / np.linalg.norm(tangent)
        frame = np.stack([x, np.cross([0, 0, 1], x), [0, 0, 1]], 1)
        rotation = frame @ Rotation.from_rotvec(found.rotation).as_matrix()
        position = np.append(point, CABLE.radius) + lgb * frame @ found.position + 0.5 * JAW * rotation[:, 0]
        np.testing.assert_allclose(motion.positions[row], position, atol=2e-5)
        np.testing.assert_allclose(Rotation.from_quat(motion.rotations[row]).as_matrix(), rotation, atol=2e-3)


def test_the_motion_begins_hanging_and_has_no_jumps(motion):
    names = [part.name for part in motion.phases]
    assert names == ["hang", "touch down", "lay"]
    assert all(before.end == after.start for before, after in pairwise(motion.phases))
    tangent = Rotation.from_quat(motion.rotations[0]).as_matrix()[:, 0]
    np.testing.assert_allclose(tangent, [0.0, 0.0, 1.0], atol=5e-3)
    assert motion.positions[0, 2] > motion.cable.length
    np.testing.assert_allclose(np.linalg.norm(motion.rotations, axis=1), 1.0, rtol=1e-12)
    assert np.diff(motion.times).min() > 0.5 * np.diff(motion.times).max()
    # Velocities are continuous: no change between rows above a few mm/s.
    velocity = np.diff(motion.positions, axis=0) / np.diff(motion.times)[:, None]
    assert np.abs(np.diff(velocity, axis=0)).max() < 6e-3
    assert np.linalg.norm(velocity[[0, -1]], axis=1).max() < 2e-3


def test_the_free_end_rolls_to_its_place_while_the_cable_leans_over(motion):
    row = np.flatnonzero(during(motion, "touch down"))[0]
    heading = motion.pattern.tangent[0]
    behind = (motion.positions[row, :2] - motion.pattern.points[0]) @ heading
    assert behind == pytest.approx(-0.5 * np.pi * CABLE.radius, abs=1e-4)  # upright, above its free end


def test_the_lift_off_point_goes_at_the_speed_that_was_asked_for():
    motion = plan(CABLE, Pattern(wave()), speed=0.05)
    lay = phase(motion, "lay")
    middle = (motion.times > lay.start + 3.0) & (motion.laid < 0.4) & (motion.laid > 0.1)
    np.testing.assert_allclose(np.diff(motion.laid[middle]) / np.diff(motion.times[middle]), 0.05, rtol=1e-3)


def test_intuitive_holds_the_cable_straight_above_the_lift_off_point():
    motion = plan(CABLE, Pattern(wave()), "intuitive")
    row = np.searchsorted(motion.laid, 0.2)
    s = motion.laid[row]
    above = [np.interp(s, motion.pattern.arc_length, motion.pattern.points[:, i]) for i in range(2)]
    height = motion.cable.length - s + CABLE.radius
    np.testing.assert_allclose(motion.positions[row], [*above, height], atol=1e-5)
    assert np.isnan(motion.needed_friction).all()


def test_least_friction_needs_no_more_than_exact(motion):
    pushed = plan(CABLE, motion.pattern, "least_friction")
    exact, least = (laid.feasibility(0.4).lift_off for laid in (motion, pushed))
    assert least.max() < exact.max()


def test_files_hold_the_motion(motion, tmp_path):
    motion.save(tmp_path / "motion.csv")
    motion.save(tmp_path / "motion.json")
    with open(tmp_path / "motion.csv") as file:
        assert file.readline() == "t,x,y,z,qx,qy,qz,qw\n"
    rows = np.loadtxt(tmp_path / "motion.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 1:4], motion.positions, atol=1e-8)
    held = json.loads((tmp_path / "motion.json").read_text())
    np.testing.assert_array_equal(held["motion"]["quaternion_xyzw"], motion.rotations)
    assert [part["name"] for part in held["phases"]] == [part.name for part in motion.phases]
    with pytest.raises(ValueError, match=r"must end in .csv or .json"):
        motion.save(tmp_path / "motion.txt")


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda motion: pickle.loads(pickle.dumps(motion))])
def test_plans_are_pickled_and_copied(copied, motion):
    assert len(motion.pattern.crossings) == 0  # which is kept
    again = copied(motion)
    assert again.cable == motion.cable
    np.testing.assert_array_equal(again.path, motion.path)
    np.testing.assert_array_equal(again.feasibility(0.3).needed, motion.feasibility(0.3).needed)


@pytest.mark.parametrize("options", [{}, {"method": "intuitive"}, {"start": "held", "posts": (Post(0.1, -0.1),)}])
def test_a_plan_is_read_back_as_it_was(options, tmp_path):
    cable = Cable(0.885, 1.6e-3, 0.032, natural_curvature=(0.3, -0.1))
    motion = plan(cable, Pattern(wave(), lead_in=0.02), **options)
    motion.save(tmp_path / "motion.json")
    again = LayPlan.load(tmp_path / "motion.json")
    assert vars(again).keys() == vars(motion).keys()
    for name in vars(motion).keys() - {"pattern"}:
        np.testing.assert_array_equal(getattr(again, name), getattr(motion, name))
    for name, value in vars(motion.pattern).items():
        np.testing.assert_array_equal(value, getattr(again.pattern, name))
    assert str(again.feasibility(0.1)) == str(motion.feasibility(0.1))
    if not options:
        laid = [
            deploy(each, friction=0.4, nodes=40, quasi_static=True, progress=False).laid for each in (again, motion)
        ]
        np.testing.assert_array_equal(*laid)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda text: text[:-200], "is not a withe file, or damaged: it is not JSON"),
        (lambda text: text.replace("plan of a deployment", "plan of a fold"), "expected a withe plan of a deployment"),
        (lambda text: text.replace('"laid"', '"lain"'), "is a damaged plan of a deployment: it has no 'laid'"),
        (lambda text: text.replace('"radius": 0.0016', '"radius": -1'), "damaged .*: radius must be positive"),
        (lambda text: text.replace('"name": "lay"', '"name": "fly"'), "damaged .*: name of a phase must be"),
        (lambda text: text.replace('"t": [', '"t": [-1.0, '), "damaged .*: t must be two or more values that increase"),
        (lambda text: text.replace('"arc_length": [', '"arc_length": [-1.0, '), "damaged .*: arc_length must increase"),
    ],
)
def test_a_plan_that_is_damaged_is_refused(damage, message, motion, tmp_path):
    motion.save(tmp_path / "motion.json")
    text = (tmp_path / "motion.json").read_text()
    assert damage(text) != text
    (tmp_path / "motion.json").write_text(damage(text))
    with pytest.raises(ValueError, match=message):
        LayPlan.load(tmp_path / "motion.json")


def test_the_command_line_plans_and_says_what_holds(tmp_path, capsys):
    source = tmp_path / "wave.csv"
    np.savetxt(source, wave(), delimiter=",", header="x,y", comments="")
    pytest.importorskip("matplotlib").use("agg")
    quick = ["--dlo", "2", "--nodes", "101", "--out", str(tmp_path)]
    assert main(["deploy", str(source), *quick, "--friction", "0.7"]) == 0
    out = capsys.readouterr().out
    assert "holds at a coefficient of friction of 0.7" in out
    for ending in ("csv", "json", "png"):
        assert (tmp_path / f"wave_plan.{ending}").stat().st_size > 1000
    assert main(["deploy", str(source), "--length", "0.885", "--out", str(tmp_path)]) == 2
    assert "needs --dlo, or --length, --radius and --lgb" in capsys.readouterr().err
    assert main(["deploy", str(tmp_path / "wave_plan.csv"), "--dlo", "2"]) == 2  # a motion, whose t, x are no x, y
    assert "wave_plan.csv must begin with a row x,y or x,y,z, or with numbers, got 't,x,y," in capsys.readouterr().err
    y_first = tmp_path / "y_first.csv"
    np.savetxt(y_first, wave()[:, ::-1], delimiter=",", header="y [m],x [m]", comments="")
    assert main(["deploy", str(y_first), *quick, "--no-picture"]) == 0
    assert (tmp_path / "y_first_plan.csv").read_text() == (tmp_path / "wave_plan.csv").read_text()
    y_first.write_text(y_first.read_text(), encoding="utf-8-sig")  # as spreadsheets save it
    assert main(["deploy", str(y_first), *quick, "--no-picture"]) == 0
    assert (tmp_path / "y_first_plan.csv").read_text() == (tmp_path / "wave_plan.csv").read_text()
    with_heights = tmp_path / "with_heights.csv"
    for header in ("x,y,z", "x [m],y [m],z [m]", ""):
        np.savetxt(with_heights, np.c_[wave(), np.zeros(len(wave()))], delimiter=",", header=header, comments="")
        with_heights.write_text(with_heights.read_text().lstrip())
        assert main(["deploy", str(with_heights), *quick, "--no-picture"]) == 0
        assert (tmp_path / "with_heights_plan.csv").read_text() == (tmp_path / "wave_plan.csv").read_text()
    with_heights.write_text("x,y,z\n0,0,0\n0.1,0\n")
    assert main(["deploy", str(with_heights), "--dlo", "2"]) == 2
    assert "rows x,y,z, got '0.1,0'" in capsys.readouterr().err
    source.write_text("x,y\n0,0\nfar,away\n")
    assert main(["deploy", str(source), "--dlo", "2"]) == 2
    assert "rows x,y, got 'far,away'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("header", "size"),
    [
        ("x [mm], y [mm]", 1e-3),
        ("x_cm,y_cm", 1e-2),
        ('"x (in)","y (in)"', 0.0254),
        ("x/m,y/m", 1.0),
        ("X [MM],Y [MM]", 1e-3),
    ],
)
def test_a_table_of_points_is_in_the_unit_that_its_header_says(header, size, tmp_path):
    (tmp_path / "points.csv").write_text(header + "\n" + "\n".join(f"{x},{y}" for x, y in (wave() / size).tolist()))
    out = ["--dlo", "2", "--out", str(tmp_path), "--no-picture"]
    assert main(["deploy", str(tmp_path / "points.csv"), *out]) == 0
    found = LayPlan.load(tmp_path / "points_plan.json").pattern
    np.testing.assert_allclose(found.raw, wave(), atol=1e-12)


def test_the_command_line_warns_and_refuses_in_one_line(tmp_path, capsys):
    source, out = tmp_path / "wave.csv", ["--dlo", "2", "--out", str(tmp_path), "--no-picture"]
    np.savetxt(source, 1e3 * wave(), delimiter=",")
    assert main(["deploy", str(source), *out]) == 2
    said = capsys.readouterr().err
    assert "longer than the pattern, 517.3 m" in said
    assert said.strip().endswith("is the pattern in metres?")
    assert all(line.startswith("withe: ") for line in said.splitlines())
    np.savetxt(source, wave(), delimiter=",")
    assert main(["deploy", str(source), *out, "--friction", "0.05", "--nodes", "101"]) == 0
    assert capsys.readouterr().err.startswith("withe: the cable slips: ")
    assert len(LayPlan.load(tmp_path / "wave_plan.json").pattern.points) == 101
    source.write_text("x [km],y [km]\n0,0\n1,1\n")
    assert main(["deploy", str(source), *out]) == 2
    assert capsys.readouterr().err == "withe: a pattern must be in m, mm, cm, in, got a column 'x [km]'\n"
    assert main(["deploy", str(source), "--dlo", "2", "--out", str(source)]) == 2
    assert "out must be a folder" in capsys.readouterr().err


def loop(count=300):
    angle = np.linspace(-0.5, 2 * np.pi + 0.5, count)
    return np.stack([0.02 * angle + 0.08 * np.sin(angle), 0.08 * (1 - np.cos(angle))], 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plan(Cable(0.4, 1.6e-3, 0.032), Pattern(wave())), "the cable must be longer than the pattern, 0.5"),
        (lambda: plan(CABLE, Pattern(wave()), tail=0.5), "pattern and tail"),
        (lambda: plan(CABLE, Pattern(wave()), tail=-0.1), "tail must not be negative"),
        (lambda: plan(CABLE, Pattern(wave()), "clever"), "method must be"),
        (lambda: plan(CABLE, Pattern(wave()), speed=0.0), "speed must be positive"),
        (lambda: plan(CABLE, Pattern(wave()), friction=-5.0), "friction must be positive, got -5"),
        (lambda: plan(CABLE, Pattern(wave()), "intuitive", friction="a"), "friction must be a number, got 'a'"),
        (lambda: plan(CABLE, Pattern(wave()), "optimised"), "'optimised' needs friction"),
        (lambda: plan(CABLE, Pattern(wave()), sampling_interval=-1.0), "sampling_interval must be positive"),
        (lambda: plan(CABLE, Pattern(loop())), "must not cross itself"),
        (lambda: plan(Cable.dlo(5), Pattern(wave(0.12))), "no friction is enough to keep this cable on this pattern"),
        (
            lambda: plan(Cable(1.5, 0.015, 0.1), Pattern(wave(0.2))),
            "no friction is enough to keep this cable .*: no grasp found",
        ),
        (
            lambda: plan(Cable(1.5, 0.04, 0.09), Pattern(wave(0.2)), "intuitive"),
            "less than the radius of the cable, 40",
        ),
        (lambda: plan(CABLE, wave()), "pattern must be a withe.deployment.Pattern, got ndarray"),
        (
            lambda: plan(Cable(1.2, 1.6e-3, 0.01), Pattern(arc_of(0.1))),
            "stretch by an eighth .* is 6.2 times the radius",
        ),
        (lambda: plan(2, Pattern(wave())), "cable must be a withe.deployment.Cable, got int"),
    ],
)
def test_bad_input_says_what_is_wrong(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("controller", ["exact", "least_friction"])
def test_a_plan_that_needs_more_friction_than_there_is_says_so(controller, recwarn):
    pattern = Pattern(wave())
    needed = float(plan(CABLE, pattern, controller).needed_friction.max())
    plan(CABLE, pattern, controller, friction=1.01 * needed)
    assert not recwarn.list
    with pytest.warns(
        UserWarning, match=rf"the cable slips: \d+ % .* than friction 0\.05, up to {needed:.2f} at \d+ mm"
    ):
        plan(CABLE, pattern, controller, friction=0.05)


def test_lines_of_what_a_pattern_needs_are_drawn_whole():
    pytest.importorskip("matplotlib").use("Agg")
    angle = np.linspace(0, 2 * np.pi, 200)
    eight = plan(CABLE, Pattern(np.stack([0.12 * np.sin(angle), 0.06 * np.sin(2 * angle)], 1)), crossings="over")
    needs = eight.plot(0.4).axes[1]
    floor = next(line for line in needs.lines if line.get_label() == "floor").get_ydata()
    assert 2.0 < floor.max() < needs.get_ylim()[1]


def arc_of(radius):
    """Three quarters of a circle."""
    angle = np.linspace(0.0, 1.5 * np.pi, 300)
    return radius * np.stack([np.sin(angle), 1.0 - np.cos(angle)], 1)


def nearly_a_circle(turns, radius):
    """A straight piece, and so many turns towards it."""
    s = np.linspace(0.0, 1.0, 300)
    angle = 2 * np.pi * turns * np.clip(s - 0.35, 0.0, None) / 0.65
    way = 2 * np.pi * turns * radius / 0.65 * np.stack([np.cos(angle), np.sin(angle)], 1) / 300
    return np.concatenate([[[0.0, 0.0]], np.cumsum(way, axis=0)])


def test_a_pattern_that_only_lacks_a_tail_says_so():
    hook = Pattern(nearly_a_circle(0.93, 0.07))
    cable = Cable(hook.length + 0.3, 1.6e-3, 0.032)
    lacking = r"no friction .* \(lift-off\): .* The tail is too short: with 128 mm .* instead of {} mm, .* of 0\.\d\d"
    with pytest.raises(ValueError, match=lacking.format(16)):
        plan(cable, hook)  # a longer one would cross it
    with pytest.raises(ValueError, match=lacking.format(0)):
        plan(cable, hook, tail=0.0)
    with pytest.raises(ValueError, match=r"no friction (?!.*The tail is too short)"):
        plan(Cable.dlo(5), Pattern(wave(0.12)), tail=0.0)  # which a tail does not hold either


def test_a_pattern_that_crosses_itself_is_laid_over_itself_on_request():
    pattern = Pattern(loop())
    assert pattern.crossings.shape == (1, 2)
    assert plan(CABLE, pattern, "intuitive", crossings="over").laid[-1] == pytest.approx(pattern.length)


def test_a_tail_that_would_cross_the_pattern_is_shortened_or_refused():
    pattern = Pattern(nearly_a_circle(0.9, 0.069))
    with pytest.raises(ValueError, match="the tail must not cross the pattern"):
        plan(CABLE, pattern, "intuitive", tail=0.17)
    assert plan(CABLE, pattern, "intuitive").tail < 0.12
    assert plan(CABLE, pattern, "intuitive", tail=0.17, crossings="over").tail == 0.17


@pytest.mark.parametrize("turns", [(90,), (90, -90), (180,)])
@pytest.mark.parametrize("nodes", [301, 601])
def test_a_tail_lies_straight_on_behind_a_pattern_that_ends_straight(turns, nodes):
    """The jaw lays the tail along the direction of the last straight piece of the input."""
    legs = [0.1] * (len(turns) + 1)
    pattern = Pattern.bends(np.radians(turns), [0.06] * len(turns), legs, nodes=nodes)
    motion = plan(CABLE, pattern)
    heading = np.radians(sum(turns))
    along, aside = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    jaw = motion.positions[-1, :2] - pattern.raw[-1]
    assert jaw @ along > 0.5 * motion.tail
    assert abs(jaw @ aside) < 1.5e-3  # half a millimetre more than the smoothing


def test_a_bend_at_the_end_fades_out_within_the_tail():
    """From 0.05 to nothing; the end that the jaw lets go does not spring back."""
    angle = np.linspace(0.0, np.pi, 200)
    half = Pattern(0.08 * np.stack([np.sin(angle), 1.0 - np.cos(angle)], 1))
    path = lengthened(half, CABLE, 4.0 * CABLE.gravito_bending_length)
    behind = path.curvature[path.arc_length > half.length]
    assert np.abs(behind).max() <= 1.01 * abs(half.curvature[-1])
    assert abs(behind[-1]) < 0.05 * abs(half.curvature).max()


@pytest.mark.parametrize("speed", [0.01, 0.05, 0.2])
def test_the_jaw_starts_and_stops_gently_at_any_speed(speed):
    """By a hundredth of gravity's acceleration, but for pieces that last a second."""
    motion = plan(CABLE, Pattern(np.stack([np.linspace(0.0, 0.5, 101), np.zeros(101)], 1)), speed=speed)
    down = motion.phases[1]
    inside = (motion.times >= down.start) & (motion.times <= down.end)
    acceleration = np.diff(motion.positions[inside], 2, axis=0) / np.diff(motion.times[inside]).mean() ** 2
    assert np.linalg.norm(acceleration, axis=1).max() < 1.5 * 0.0981


def test_a_greater_speed_never_takes_longer():
    line = Pattern(np.stack([np.linspace(0.0, 0.5, 101), np.zeros(101)], 1))
    durations = [plan(CABLE, line, speed=speed).times[-1] for speed in (0.02, 0.05, 0.1, 0.2, 0.5, 2.0)]
    assert (np.diff(durations) <= 1e-9).all()
