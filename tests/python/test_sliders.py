"""Sliders: values become equilibria, errors do not end the sliding, and pictures follow without a new scene."""

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, same_state, tripod
from withe.common.extras import require
from withe.simulation.sliders import EquilibriumSliders
from withe.view import screens


def finger(**build):
    """A hanging arm with a tendon at its side and a force at its tip: simulation, arm, cord, load."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.2), nodes=15, radius=6e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start, name="wall")
    cord = scene.add_tendon(arm, offset=(5e-3, 0), name="cord")
    load = scene.add_force(arm.end, (0, 0, 0), name="pull")
    return scene.build(**build), arm, cord, load


# Without graphics


def test_a_slider_for_a_number_and_one_for_each_component_of_a_vector():
    simulation, _, cord, load = finger()
    model = EquilibriumSliders(
        simulation,
        [(cord, "tension", 0, 5), ("arm", "natural_curvature", (-10, 10)), (load, "force", (0, 0, -1), (0, 0, 1))],
    )
    assert [(slider.title, slider.low, slider.high) for slider in model.sliders] == [
        ("tension of cord [N]", 0.0, 5.0),
        ("natural curvature of arm towards d1 [1/m]", -10.0, 10.0),
        ("natural curvature of arm towards d2 [1/m]", -10.0, 10.0),
        ("force of pull z [N]", -1.0, 1.0),
    ]
    assert model.values == [0.0, 0.0, 0.0, 0.0]


def test_a_move_is_set_and_equilibrium():
    simulation, arm, cord, _ = finger()
    model = EquilibriumSliders(simulation, [(cord, "tension", (0, 5)), (arm, "natural_curvature", (-10, 10))])
    model.move(0, 2.0)
    model.move(2, 4.0)
    assert model.values == [2.0, 0.0, 4.0]
    other, arm, cord, _ = finger()
    other.equilibrium()
    other.set(cord, tension=2.0)
    other.equilibrium()
    other.set(arm, natural_curvature=(0.0, 4.0))
    other.equilibrium()
    np.testing.assert_allclose(simulation.positions(), other.positions(), atol=1e-12)
    np.testing.assert_array_equal(simulation.get("arm", "natural_curvature"), np.tile((0.0, 4.0), (13, 1)))
    np.testing.assert_array_equal(model.present().positions()[0], simulation.positions())


@pytest.mark.parametrize(
    ("target", "word", "ends", "titles"),
    [
        (None, "gravity", (-9.81, 9.81), ["gravity x [m/s^2]", "gravity y [m/s^2]", "gravity z [m/s^2]"]),
        ("arm", "youngs_modulus", (5e5, 2e6), ["youngs modulus of arm [Pa]"]),
        ("arm", "stretch_stiffness", (50.0, 200.0), ["stretch stiffness of arm [N]"]),
        ("arm", "natural_twist", (-9.0, 9.0), ["natural twist of arm [rad/m]"]),
        ("arm", "natural_stretch", (0.9, 1.1), ["natural stretch of arm"]),
        (
            "arm",
            "bend_stiffness",
            (1e-3, 2e-3),
            [f"bend stiffness of arm against curvature towards {d} [N m^2]" for d in ("d1", "d2")],
        ),
        ("wall", "position", (-0.05, 0.05), [f"position of wall {axis} [m]" for axis in "xyz"]),
    ],
)
def test_parameters_of_every_kind_of_part_have_sliders(target, word, ends, titles):
    simulation, *_ = finger()
    model = EquilibriumSliders(simulation, [(target, word, ends)])
    assert [slider.title for slider in model.sliders] == titles
    for index in range(len(titles)):
        model.move(index, ends[1])
    value = simulation.get(word) if target is None else simulation.get(target, word)
    np.testing.assert_allclose(value, ends[1])
    assert model.message == ""


def test_sliders_begin_at_the_present_values_or_at_the_nearest_in_range():
    simulation, arm, cord, load = finger()
    simulation.set(cord, tension=1.5)
    simulation.set(load, force=(0.0, 0.0, -0.3))
    curvature = np.zeros((13, 2))
    curvature[:, 0] = np.linspace(0.0, 2.0, 13)
    simulation.set(arm, natural_curvature=curvature)
    model = EquilibriumSliders(
        simulation, [(cord, "tension", 0, 5), (arm, "natural_curvature", (-10, 10)), (load, "force", (-0.1, 0.1))]
    )
    assert model.values == pytest.approx([1.5, 1.0, 0.0, 0.0, 0.0, -0.1])
    np.testing.assert_array_equal(simulation.get(arm, "natural_curvature"), curvature)  # until it is moved
    np.testing.assert_array_equal(simulation.get(load, "force"), (0.0, 0.0, -0.1))


def test_without_an_equilibrium_the_last_one_stays_and_later_moves_work():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    load = scene.add_force(arm.end, (0, 0, 0), follower=True, name="jet")
    simulation = scene.build()
    model = EquilibriumSliders(simulation, [(load, "force", (-1e6, 1e6)), (arm, "natural_twist", (-5, 5))])
    before = simulation.positions()
    model.move(0, -1e6)
    assert "no equilibrium at force of jet x [N] = -1e+06: the last one is shown" in model.message
    np.testing.assert_array_equal(simulation.positions(), before)
    np.testing.assert_array_equal(simulation.get(load, "force"), 0.0)
    assert model.values[0] == -1e6
    model.move(0, 1e-3)
    assert model.message == ""
    np.testing.assert_array_equal(simulation.get(load, "force"), (1e-3, 0.0, 0.0))


def test_a_jump_to_another_branch_is_told():
    scene = withe.Scene(gravity=(0, 0, 0))
    angle = np.linspace(-np.pi / 2, np.pi / 2, 41)
    arc = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
    arch = scene.add_rod(points=arc, radius=5e-3, material=steel)
    scene.pin(arch.start), scene.pin(arch.end)
    load = scene.add_force(arch.node(20), (0, 0, 0), name="weight")
    model = EquilibriumSliders(
        scene.build(integrator="static", planar=True), [(load, "force", (0, 0, -1500), (0, 0, 0))]
    )
    model.move(0, -500.0)
    assert model.message == ""
    model.move(0, -1200.0)  # above the limit load of 992 N
    assert model.message == "the scene has jumped to another branch of equilibria"


def test_the_extremes_leave_the_simulation_as_it_is():
    simulation, arm, cord, _ = finger()
    model = EquilibriumSliders(simulation, [(cord, "tension", 0, 5), (arm, "natural_curvature", (-10, 10))])
    before = simulation.copy()
    record = model.extremes()
    assert same_state(simulation, before)
    assert len(record) == 1 + 2 * 3 + 2
    tips = record.positions(arm)[:, -1]
    assert np.ptp(tips[:, 0]) > 0.05
    assert np.ptp(tips[:, 1]) > 0.05


@pytest.mark.parametrize(
    ("sliders", "message"),
    [
        ([], "sliders must be a list of"),
        ("cord", "sliders must be a list of"),
        (("cord", "tension", 0, 5), "sliders must be a list of"),
        ([("cord", "tension")], r"sliders\[0\] must be \(part, word, low, high\) or"),
        ([("cord", "tension", 5)], r"sliders\[0\] must be \(part, word, low, high\) or"),
        ([("cord", 3, 0, 5)], r"sliders\[0\] must be \(part, word, low, high\) or"),
        (
            [("cord", "tenson", 0, 5)],
            r"sliders\[0\]: tendon 'cord' has no 'tenson' to set; it has tension. Did you mean",
        ),
        ([("arm", "radius", 0, 5)], "rod 'arm' has no 'radius' to set"),
        ([("nobody", "tension", 0, 5)], "nobody"),
        ([("cord", "tension", 5, 5)], r"low of sliders\[0\] must be below high, got 5 and 5"),
        ([("cord", "tension", 0, 1), ("cord", "tension", 5, 0)], r"low of sliders\[1\] must be below high"),
        ([("arm", "natural_curvature", (0, 1), (0, -1))], r"low of sliders\[0\] must be below high"),
        ([("cord", "tension", 0, np.nan)], r"high of sliders\[0\] must be finite"),
        ([("cord", "tension", -1, 5)], r"sliders\[0\]: tension of tendon 'cord' must not be negative, got -1"),
        ([("wall", "rotation", -1, 1)], "rotation of support 'wall' is neither a number nor a vector"),
        ([("arm", "discrete_curvature", -1, 1)], "so it has no slider; use natural_curvature"),
    ],
)
def test_a_slider_that_cannot_be_is_refused_by_its_number(sliders, message):
    simulation, *_ = finger()
    before = simulation.copy()
    with pytest.raises(ValueError, match=message):
        EquilibriumSliders(simulation, sliders)
    assert same_state(simulation, before)


def test_a_scene_without_equilibrium_is_refused_at_the_start():
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER, name="arm")
    with pytest.raises(withe.ConvergenceError):
        EquilibriumSliders(scene.build(), [("arm", "natural_twist", 0, 1)])


# With graphics


@pytest.fixture
def memory(renderer, monkeypatch):
    """Draw into memory, as documentation does."""
    monkeypatch.setattr(require("pyvista", "view"), "OFF_SCREEN", True)


def test_a_moved_slider_moves_the_tube_in_the_same_scene(memory):
    simulation, arm, cord, _ = finger()
    view = simulation.view(
        sliders=[(cord, "tension", 0, 5), (arm, "natural_curvature", (-10, 10))], size=(320, 200), color_by="tension"
    )
    try:
        (mesh,) = view._stage._meshes
        actors = list(view._stage.plotter.actors)
        first = view.image()
        view.move("tension of cord [N]", 4.0)
        view.move(2, 5.0)
        assert view._stage._meshes == [mesh]
        assert list(view._stage.plotter.actors) == actors
        points = np.asarray(mesh.points)
        centres = view._stage._surfaces[0]._position_weights @ simulation.positions(arm)
        rings = points.reshape(len(view._stage._surfaces[0]._ring_samples), -1, 3)[6:-6]
        np.testing.assert_allclose(rings.mean(axis=1), centres, atol=1e-6)
        assert np.abs(view.image().astype(int) - first).max() > 40
        assert view.values == {
            "tension of cord [N]": 4.0,
            "natural curvature of arm towards d1 [1/m]": 0.0,
            "natural curvature of arm towards d2 [1/m]": 5.0,
        }
        assert "tension of cord [N] = 4" in repr(view)
    finally:
        view.close()


def test_a_slider_follows_the_mouse(memory):
    simulation, arm, cord, _ = finger()
    view = simulation.view(sliders=[(cord, "tension", 0, 1)], size=(640, 400))
    plotter = view._stage.plotter
    plotter.show(auto_close=False)
    try:
        mouse = plotter.iren.interactor

        def at(share, event):
            mouse.SetEventInformation(round(share * 640), round(0.9 * 400), 0, 0, "\0", 0, None)
            mouse.InvokeEvent(event)

        at(0.035, "MouseMoveEvent")
        at(0.035, "LeftButtonPressEvent")
        tips = []
        for share in (0.08, 0.14, 0.3):
            at(share, "MouseMoveEvent")
            tips.append(simulation.positions(arm)[-1, 0])
        at(0.3, "LeftButtonReleaseEvent")
        assert 0.005 < tips[0] < tips[1] < tips[2]
        assert simulation.get(cord, "tension") == view.values["tension of cord [N]"] == 1.0
    finally:
        view.close()


def test_in_a_notebook_a_server_draws_the_sliders(memory, monkeypatch):
    monkeypatch.setattr(screens, "in_notebook", lambda: True)
    simulation, _, cord, _ = finger()
    shown = []
    for trame, backend in ((True, "server"), (False, "static")):
        for module in ("screens", "sliders"):
            monkeypatch.setattr(f"withe.view.{module}.has_trame", lambda trame=trame: trame)
        if trame:
            view = simulation.view(sliders=[(cord, "tension", 0, 5)], size=(160, 120))
        else:
            with pytest.warns(UserWarning, match="the package trame is not installed"):
                view = simulation.view(sliders=[(cord, "tension", 0, 5)], size=(160, 120))
        monkeypatch.setattr(view._stage.plotter, "show", lambda **options: shown.append(options))
        view._ipython_display_()
        assert shown.pop() == {"jupyter_backend": backend}
        view.close()


def test_in_a_notebook_a_live_view_replaces_one_picture(memory, monkeypatch):
    display = pytest.importorskip("IPython.display")
    monkeypatch.setattr(screens, "in_notebook", lambda: True)
    pictures = []

    class Handle:
        def update(self, picture):
            pictures.append(picture.data)

    def show(picture, display_id):
        pictures.append(picture.data)
        return Handle()

    monkeypatch.setattr(display, "display", show)
    simulation, *_ = finger(time_step=5e-3)
    simulation.set("pull", force=(0.2, 0.0, 0.0))
    with simulation.view(live=True, size=(160, 120)) as view:
        simulation.run(0.1, progress=False)
    view.close()
    assert len(pictures) >= 3
    assert all(data[:2] == b"\xff\xd8" for data in pictures)  # JPEG
    assert pictures[-1] != pictures[0]


def test_both_ends_of_every_slider_are_in_view(memory):
    simulation, arm, _, _ = finger()
    view = simulation.view(sliders=[(arm, "natural_curvature", (-10, 10))], size=(320, 200))
    try:
        matrix = view._stage.plotter.camera.GetCompositeProjectionTransformMatrix(1.6, -1, 1)
        projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
        for index in (0, 1):
            for end in (-10.0, 10.0):
                view.move(index, end)
                points = np.column_stack([simulation.positions(), np.ones(15)]) @ projection.T
                across = points[:, :2] / points[:, 3:]
                assert np.abs(across).max() < 0.95
                assert across[:, 0].min() > -0.5  # beside the sliders
    finally:
        view.close()


def test_a_failure_while_sliding_is_a_text_in_the_picture(memory):
    _, arm, simulation = cantilever()
    load = simulation.add_force(arm.end, (0, 0, 0), follower=True, name="jet")
    view = simulation.view(sliders=[(load, "force", (-1e6, 1e6))], size=(320, 200))
    try:
        view.move(0, -1e6)
        assert view.message.startswith("no equilibrium at force of jet x [N] = -1e+06: the last one is shown")
        assert view._stage._label.input == view.message
        view.move(0, 0.0)
        assert view.message == view._stage._label.input == ""
    finally:
        view.close()


def test_a_picture_of_the_sliders_and_wrong_moves(memory, tmp_path):
    simulation, _, cord, _ = finger()
    view = simulation.view(sliders=[(cord, "tension", 0, 5)], size=(160, 120))
    try:
        assert view.picture(tmp_path / "sliders.png").stat().st_size > 1000
        with pytest.raises(ValueError, match=r"value of 'tension of cord \[N\]' must lie in 0\.\.5, got 6"):
            view.move(0, 6.0)
        for slider in (1, "tension"):
            with pytest.raises(ValueError, match=r"slider must be one of 'tension of cord \[N\]' or its number"):
                view.move(slider, 1.0)
        with pytest.raises(ValueError, match=r"must end in \.png"):
            view.picture(tmp_path / "sliders.jpg")
    finally:
        view.close()


def test_a_run_is_drawn_while_it_goes(memory):
    simulation, *_ = finger(time_step=5e-3)
    simulation.set("pull", force=(0.2, 0.0, 0.0))
    with simulation.view(live=True, size=(160, 120)) as view:
        view._interval = view._next = 0.0  # after every step
        first, drawn = view.image(), view.redraws
        ends = []
        view.update = lambda draw=view.update: (draw(), ends.append(view._stage._meshes[0].points[-1].copy()))
        record = simulation.run(0.05, record_every=0.05, progress=False)
        view._next = 0.0
        simulation.step()
    assert view.redraws > drawn
    assert np.abs(view.image().astype(int) - first).max() > 40
    np.testing.assert_allclose(ends[-1], simulation.positions()[-1], atol=7e-3)
    assert simulation._stepping.watchers == []
    view.close()
    alone, *_ = finger(time_step=5e-3)
    alone.set("pull", force=(0.2, 0.0, 0.0))
    np.testing.assert_array_equal(alone.run(0.05, 0.05, progress=False).positions(), record.positions())


def test_a_live_view_keeps_to_its_rate(memory, monkeypatch):
    simulation, *_ = finger(time_step=5e-3)
    clock = [0.0]
    monkeypatch.setattr("withe.view.live.time.monotonic", lambda: clock[0])
    with simulation.view(live=True, size=(160, 120)) as view:
        assert view.redraws == 1
        simulation.step(3)
        assert view.redraws == 1
        clock[0] = 0.034
        simulation.step(3)
        assert view.redraws == 2
    assert view.redraws == 3  # the end is always drawn
    view.close()


@pytest.mark.parametrize(("speed", "duration"), [(1.0, 0.1), (0.25, 0.4), (np.inf, 0.0)])
def test_a_live_run_is_not_faster_than_its_speed(memory, monkeypatch, speed, duration):
    """Watched places alone wait; here a clock that only sleep advances stands for one."""
    clock, slept = [5.0], []

    def sleep(seconds):
        slept.append(seconds)
        clock[0] += seconds

    monkeypatch.setattr("withe.view.live.time.monotonic", lambda: clock[0])
    monkeypatch.setattr("withe.view.live.time.sleep", sleep)
    simulation, *_ = finger(time_step=5e-3)
    with simulation.view(live=True, size=(160, 120), speed=speed) as view:
        assert not view._waits  # nobody sees it
        view._waits = np.isfinite(speed)
        simulation.run(0.1, progress=False)
        assert clock[0] == pytest.approx(5.0 + duration)
        assert view.redraws == pytest.approx(1 + 30.0 * duration, abs=1.0)
        assert max(slept, default=0.0) <= 1.0 / 30.0
    view.close()
    with pytest.raises(ValueError, match=r"speed must be positive, got 0"):
        simulation.view(live=True, speed=0)


def test_the_camera_of_a_live_view_follows_rods_that_leave_the_picture(memory):
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    simulation = scene.build(time_step=5e-3)
    with simulation.view(live=True, size=(320, 200)) as view:
        view._interval = view._next = 0.0
        simulation.run(0.4, progress=False)  # falls by four of its lengths
        camera = view._stage.plotter.camera
    matrix = camera.GetCompositeProjectionTransformMatrix(1.6, -1, 1)
    projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    points = np.column_stack([simulation.positions(), np.ones(11)]) @ projection.T
    assert np.abs(points[:, :2] / points[:, 3:]).max() < 0.95
    view.close()


def test_an_error_in_a_run_ends_its_live_view(memory):
    _, _, simulation = tripod(time_step=5e-3)

    def fail(simulation):
        raise KeyError("mine")

    view = simulation.view(live=True, size=(160, 120))
    with pytest.raises(KeyError), view:
        simulation.run(0.1, before_step=fail, progress=False)
    assert simulation._stepping.watchers == []
    view.close()


def test_a_closed_live_view_does_not_stop_the_run(memory):
    simulation, *_ = finger(time_step=5e-3)
    with simulation.view(live=True, size=(160, 120)) as view:
        view.close()
        simulation.step(2)
    assert simulation.time == pytest.approx(0.01)


def test_without_a_display_a_warning_says_how_to_see_the_scene(renderer, monkeypatch):
    monkeypatch.setattr(require("pyvista", "view"), "OFF_SCREEN", False)
    monkeypatch.setattr(screens, "_has_display", lambda: False)
    simulation, _, cord, _ = finger()
    with pytest.warns(UserWarning, match=r"no display was found, so view\(sliders=\.\.\.\) shows a still picture"):
        view = simulation.view(sliders=[(cord, "tension", 0, 5)], size=(160, 120))
    assert view.image().shape == (120, 160, 3)
    view.close()
    with pytest.warns(UserWarning, match=r"no display was found, so view\(live=True\) shows a still picture"):
        view = simulation.view(live=True, size=(160, 120))
    with view:
        simulation.step()
    assert view.image().shape == (120, 160, 3)
    view.close()


def test_a_window_answers_during_the_run_and_stays_until_it_is_closed():
    calls = []

    class Interactor:
        done = False

        def GetDone(self):
            return self.done

        def start(self):
            calls.append("start")

    class Plotter:
        render_window = object()

        def __init__(self):
            self.iren = Interactor()
            self.iren.interactor = self.iren

        def show(self, **options):
            calls.append(options)

        def update(self):
            calls.append("update")

    plotter = Plotter()
    window = screens.live_screen("window", plotter)
    window.refresh()
    window.finish()
    assert calls == [{"interactive_update": True, "auto_close": False}, "update", "start"]
    plotter.iren.done = True
    assert window.is_closed
    window.finish()
    assert calls[-1] == "start"
    assert len(calls) == 3


def test_a_wrong_option_of_a_view_is_named(memory):
    simulation, _, cord, _ = finger()
    with pytest.raises(TypeError, match=r"SliderView\(\) has no keyword 'colour_by'; did you mean color_by="):
        simulation.view(sliders=[(cord, "tension", 0, 5)], colour_by="tension")
    with pytest.raises(TypeError, match=r"LiveView\(\) has no keyword 'colour_by'; did you mean color_by="):
        simulation.view(live=True, colour_by="tension")


def test_sliders_and_live_exclude_each_other():
    simulation, _, cord, _ = finger()
    with pytest.raises(ValueError, match="sliders and live must not be given together"):
        simulation.view(sliders=[(cord, "tension", 0, 5)], live=True)
    with pytest.raises(ValueError, match="live must be True or False"):
        simulation.view(live=1)
