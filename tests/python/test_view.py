"""Pictures: what is drawn is the record, options are checked, and what is missing is named."""

import builtins
import importlib
import itertools
import os
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest

import withe
from curling_motion import CurlingSimulation
from withe.common.extras import require
from withe.common.outlines import ObstacleOutline, RodOutline
from withe.recording import Record
from withe.recording.recorder import Recorder, present
from withe.view import colors, films, ghosts, graphics, rendering, scenery, style


@pytest.fixture
def record():
    simulation = CurlingSimulation()
    recorder = Recorder(simulation)
    for _ in range(6):
        recorder.capture()
        simulation.step(0.1)
    return recorder.record


# Figures


def test_the_figure_has_shapes_and_energies_with_units(record):
    pytest.importorskip("matplotlib").use("Agg")
    figure = record.plot(shapes=4)
    shapes, energies = figure.axes[0], figure.axes[1]
    assert shapes.get_xlabel() == "x [mm]"
    assert shapes.get_zlabel() == "z [mm]"
    assert len(shapes.lines) == 4 * 3
    labels = {axes.get_xlabel() for axes in figure.axes} | {axes.get_ylabel() for axes in figure.axes}
    assert {"time [s]", "energy [mJ]"} <= labels
    drawn = {line.get_label(): line for axes in figure.axes for line in axes.lines}
    np.testing.assert_allclose(drawn["bend"].get_ydata(), 1e3 * record.energy().bend)
    assert "stretch" not in drawn
    assert energies is not shapes


@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (1.0, 1.0, 8.0), (0.1, 1.0, 1.0), (8.0, 1.0, 1.0)])
def test_no_label_of_a_box_is_cut_off(size):
    pytest.importorskip("matplotlib").use("Agg")
    simulation = CurlingSimulation(0.3)
    simulation.positions = lambda rod=None: CurlingSimulation(0.3).positions(rod) * size
    figure = present(simulation).plot()
    figure.draw_without_rendering()
    drawn, page = figure.axes[0].get_tightbbox(), figure.bbox
    assert page.x0 <= drawn.x0 < drawn.x1 <= page.x1
    assert page.y0 <= drawn.y0 < drawn.y1 <= page.y1


def test_a_planar_motion_is_drawn_in_its_plane(record):
    pytest.importorskip("matplotlib").use("Agg")
    simulation = CurlingSimulation()
    simulation.rods = simulation.rods[:2]
    simulation.positions = lambda rod=None: CurlingSimulation(simulation.time).positions(rod)[:31]
    simulation.velocities = lambda rod=None: CurlingSimulation(simulation.time).velocities(rod)[:31]
    recorder = Recorder(simulation)
    for _ in range(3):
        recorder.capture()
        simulation.step(0.1)
    axes = recorder.record.plot(shapes=2).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "z [mm]")
    assert axes.get_aspect() == 1.0
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 1e3 * recorder.record.positions("arm")[0, :, 2])


@pytest.mark.parametrize(("lift", "names"), [(0.0, ("x", "y")), (2e-3, ("x", "y", "z"))])
def test_a_rod_that_lies_on_a_floor_is_drawn_from_above_and_one_that_is_lifted_in_space(lift, names):
    """It sinks in by much less than it is thick, but by more than rounding."""
    pytest.importorskip("matplotlib").use("Agg")
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=2e3)
    arm = scene.add_rod(start=(0, 0, 5e-3), end=(0.3, 0, 5e-3), nodes=31, radius=5e-3, material=rubber)
    scene.add_floor(0.0, friction=0.3)
    hand = scene.clamp(arm.start)
    simulation = scene.build()
    simulation.move(hand, position=(0, 0.05, 5e-3 + lift), over=0.1)
    record = simulation.run(0.1, progress=False)
    assert np.ptp(record.positions()[..., 2]) > 1e-6
    axes = record.plot().axes[0]
    labels = [getattr(axes, f"get_{axis}label")() for axis in "xyz" if hasattr(axes, f"get_{axis}label")]
    assert labels == [f"{name} [mm]" for name in names]
    if lift == 0.0:
        assert axes.get_aspect() == 1.0
        np.testing.assert_allclose(axes.lines[-1].get_ydata(), 1e3 * record.positions()[-1, :, 1])


def test_the_present_state_is_one_frame_without_energies_over_time():
    pytest.importorskip("matplotlib").use("Agg")
    figure = present(CurlingSimulation(0.3)).plot()
    assert len(figure.axes) == 1


# Pictures and films


def test_a_picture_shows_the_rods_on_a_light_ground(record, renderer, tmp_path):
    path = record.picture(tmp_path / "arm.png", size=(320, 240), label="t = 0.5 s")
    image = require("matplotlib.image", "view").imread(path)[..., :3]
    assert image.shape == (240, 320, 3)
    assert np.median(image) > 0.85
    teal = (image[..., 1] > image[..., 0] + 0.2) & (image[..., 1] > 0.3)
    assert teal.sum() > 100


def test_frames_differ_and_the_last_is_the_default(record, renderer, tmp_path):
    first, last, default = (
        record.picture(tmp_path / f"{name}.png", size=(160, 120), **options).read_bytes()
        for name, options in (("first", {"frame": 0}), ("last", {"frame": 5}), ("default", {}))
    )
    assert first != last
    assert last == default


def test_only_what_has_moved_has_a_ghost(renderer, tmp_path):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=2e3)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=8e-3, material=rubber)
    post = scene.add_rod(start=(0, 0.1, 0), end=(0, 0.1, -0.3), nodes=31, radius=8e-3, material=rubber)
    for end in (arm.start, post.start, post.end):
        scene.clamp(end)
    record = scene.build().run(0.1, 0.05, progress=False)
    stage = rendering.Stage(record, size=(160, 120), frame=2, ghosts=(0, 1))
    try:
        assert len(stage._ghosts) == 2  # of the arm at both times
        for frame, (points, shadows) in enumerate(stage._ghosts):
            way = np.linalg.norm(record.positions(arm)[frame] - record.positions(arm)[2], axis=1)
            first = int(np.flatnonzero(way > 0.1 * 8e-3)[0])
            assert 0 < first < 20
            assert points[shadows > 0.0][:, 0].min() == pytest.approx(0.01 * first, abs=0.01)
        layered = stage._layered()
        behind = stage._rendered().copy()
        for actor in itertools.chain(*stage._layers):
            actor.SetVisibility(False)
        present = stage._rendered().copy()
        for actor in stage._present:
            actor.SetVisibility(False)
        rods = (present != stage._rendered()).any(axis=2)
    finally:
        stage.close()
    assert rods.sum() > 500
    np.testing.assert_array_equal(layered[rods], present[rods])  # no ghost covers the present rods
    assert (behind[rods] != present[rods]).any()  # although ghosts are nearer to the camera
    assert ((layered != present).any(axis=2) & ~rods).sum() > 500
    still = scene.build().run(0.005, progress=False)
    pyplot = pytest.importorskip("matplotlib.pyplot")
    plain, ghostly = (
        pyplot.imread(still.picture(tmp_path / f"{len(others)}.png", ghosts=others, size=(160, 120)))
        for others in ((), (1, 0))
    )
    # The camera has all poses in view: 0.1 mm of motion moves it by less than a pixel.
    np.testing.assert_allclose(plain, ghostly, rtol=0, atol=1.5 / 255)


def test_a_rod_that_slides_along_itself_stands_out_where_it_was_not_before():
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = 0.1 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    closed = RodOutline("ring", np.arange(24), True, np.full(24, 1e-2))
    on_edges = 0.5 * (ring + np.roll(ring, -1, axis=0))
    assert not ghosts.stands_out(closed, on_edges, [ring]).any()
    assert ghosts.stands_out(closed, ring + np.array((0, 0, 1.1e-3)), [ring]).all()
    assert not ghosts.stands_out(closed, ring + np.array((0, 0, 1.1e-3)), [ring, ring + np.array((0, 0, 1e-3))]).any()
    line = np.outer(np.arange(11), (0.01, 0, 0))
    widths = np.tile((0.05, 0.01), (10, 1))
    band = RodOutline("band", np.arange(11), False, np.full(10, 0.025), widths)
    assert ghosts.stands_out(band, line + np.array((0.034, 0, 0)), [line]).tolist() == [False] * 7 + [True] * 4
    assert ghosts.stands_out(band, line + np.array((0, 0, 6e-4)), [line]).all()
    assert not ghosts.stands_out(band, line + np.array((0, 0, 4e-4)), [line]).any()


@pytest.mark.parametrize("color_by", ["tension", "curvature", "twist", "speed"])
def test_every_quantity_can_colour_the_rods(record, renderer, tmp_path, color_by):
    path = record.picture(tmp_path / "arm.png", size=(200, 150), color_by=color_by, camera="front")
    assert path.stat().st_size > 1000


@pytest.mark.parametrize(
    ("values", "limits"),
    [
        ([[7e-17, 2.0], [1.0]], (0.0, 2.0)),
        ([[-3.0, -2.0], [-1e-16]], (-3.0, 0.0)),
        ([[-1.0, 2.0]], (-2.0, 2.0)),
        ([[-0.01, 2.0]], (-0.01, 2.0)),
        ([[1.0, 2.0]], (1.0, 2.0)),
    ],
)
def test_a_scale_of_colours_begins_and_ends_at_values_or_at_zero(values, limits):
    assert colors.color_limits([np.array(rod) for rod in values]) == limits


def test_a_scale_of_colours_has_a_width():
    low, high = colors.color_limits([np.zeros(3)])
    assert low < high


@pytest.mark.parametrize("camera", [None, "front", "side", "top", "oblique", (1.0, 2.0, 3.0)])
def test_all_frames_are_in_view_from_everywhere(record, renderer, camera):
    stage = rendering.Stage(record, size=(320, 200), camera=camera)
    try:
        matrix = stage.plotter.camera.GetCompositeProjectionTransformMatrix(1.6, -1, 1)
        projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    finally:
        stage.close()
    points = record.positions().reshape(-1, 3)
    seen = np.column_stack([points, np.ones(len(points))]) @ projection.T
    across = np.abs(seen[:, :2] / seen[:, 3:])
    assert across.max() < 0.95
    assert across.max() > 0.6


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_films_have_the_pictures_of_their_duration(record, renderer, tmp_path, suffix):
    encoder = pytest.importorskip("imageio_ffmpeg")
    path = record.animate(tmp_path / f"arm{suffix}", fps=10, size=(161, 120), progress=False)
    reader = encoder.read_frames(str(path))
    assert next(reader)["size"] == (160, 120)
    pictures = list(reader)
    assert len(pictures) == 6
    assert pictures[0] != pictures[-1]


def test_a_film_of_high_quality_differs_in_smooth_edges_alone(record, renderer, tmp_path):
    encoder = pytest.importorskip("imageio_ffmpeg")
    films_of = {}
    for quality in ("draft", "high"):
        path = record.animate(tmp_path / f"{quality}.mp4", fps=10, size=(320, 240), quality=quality, progress=False)
        reader = encoder.read_frames(str(path))
        next(reader)
        films_of[quality] = np.array([np.frombuffer(picture, np.uint8) for picture in reader], float)
    change = np.abs(films_of["high"] - films_of["draft"])
    assert 0.0 < change.mean() < 1.0
    with pytest.raises(ValueError, match="quality must be 'draft' or 'high', got 'best'"):
        record.animate(tmp_path / "arm.mp4", quality="best")


def test_a_film_interpolates_between_frames_at_its_own_speed():
    times = np.array([0.0, 0.1, 0.3])
    np.testing.assert_allclose(films.film_places(times, 0.05), [0, 0.5, 1, 1.25, 1.5, 1.75, 2])
    np.testing.assert_allclose(films.film_places(times, 0.2), [0, 1.5])
    np.testing.assert_array_equal(films.film_places(np.zeros(3), 0.05), [0, 1, 2])
    np.testing.assert_array_equal(films.film_places(np.zeros(1), 0.05), [0])


def test_an_exception_while_rendering_ends_ffmpeg(record, renderer, tmp_path, monkeypatch):
    pytest.importorskip("imageio_ffmpeg")

    def interrupt(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(rendering.Stage, "image", interrupt)
    with pytest.raises(KeyboardInterrupt):
        record.animate(tmp_path / "arm.mp4", size=(160, 120), progress=False)


def test_a_failure_of_ffmpeg_is_told(record, renderer, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(RuntimeError, match="ffmpeg failed"):
        record.animate(tmp_path / "missing" / "arm.mp4", size=(160, 120), progress=False)


def test_smooth_edges_are_means_of_rendered_pixels():
    fine = np.random.default_rng(1).integers(0, 256, (12, 18, 3), np.uint8)
    for step in (1, 2, 3):
        blocks = fine.reshape(12 // step, step, 18 // step, step, 3).astype(float).mean(axis=(1, 3))
        np.testing.assert_allclose(rendering.mean_of_blocks(fine, step), blocks, atol=0.5)
    assert [rendering.fine_supersampling(size) for size in ((640, 480), (1920, 1080), (3840, 2160))] == [3, 3, 2]


# Refused arguments


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"frame": 6}, r"frame must lie in -6\.\.5, got 6"),
        ({"frame": 0.5}, "frame must lie in"),
        ({"size": (10,)}, "size must be two integers"),
        ({"size": (0, 100)}, "size must lie between"),
        ({"color_by": "mood"}, "color_by must be one of 'rod', 'tension'"),
        ({"camera": "below"}, "camera must be one of 'front'"),
        ({"camera": (0, 0, 0)}, "camera must be a direction"),
        ({"camera": (0, np.nan, 1)}, "camera must be a direction"),
    ],
)
def test_options_out_of_range_are_refused_by_name(record, tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        record.picture(tmp_path / "arm.png", **options)


@pytest.mark.parametrize("options", [{"fps": 0}, {"fps": np.inf}, {"speed": -1.0}, {"speed": np.nan}])
def test_rates_must_be_positive(record, tmp_path, options):
    with pytest.raises(ValueError, match="must be positive"):
        record.animate(tmp_path / "arm.mp4", **options)


def test_other_suffixes_are_refused(record, tmp_path):
    with pytest.raises(ValueError, match=r"path must end in \.mp4 or \.gif"):
        record.animate(tmp_path / "arm.avi")
    with pytest.raises(ValueError, match=r"path must end in \.png"):
        record.picture(tmp_path / "arm.jpg")


def test_a_record_without_frames_has_nothing_to_show(tmp_path):
    empty = Recorder(CurlingSimulation()).record
    for show in (empty.plot, empty.view, lambda: empty.animate(tmp_path / "a.mp4")):
        with pytest.raises(ValueError, match="no frames"):
            show()


def test_a_missing_package_names_its_extra(record, monkeypatch, tmp_path):
    for name in [name for name in sys.modules if name.split(".")[0] in ("pyvista", "matplotlib")]:
        monkeypatch.delitem(sys.modules, name)

    def without(real):
        def imported(name, *args, **kwargs):
            if name.split(".")[0] in ("pyvista", "matplotlib"):
                raise ModuleNotFoundError(f"No module named {name!r}", name=name.split(".")[0])
            return real(name, *args, **kwargs)

        return imported

    monkeypatch.setattr(builtins, "__import__", without(builtins.__import__))
    monkeypatch.setattr("importlib.import_module", without(importlib.import_module))
    with pytest.raises(ImportError, match=r'in a clone of withe, run pip install "\.\[view\]" or make view'):
        record.plot()
    with pytest.raises(ImportError, match=r'in a clone of withe, run pip install "\.\[view\]" or make view'):
        record.picture(tmp_path / "arm.png")


def test_a_missing_package_inside_a_package_is_not_blamed_on_the_extra(monkeypatch, tmp_path):
    (tmp_path / "broken_package.py").write_text("import not_there_at_all")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="not_there_at_all"):
        require("broken_package", "view")


@pytest.mark.parametrize(
    ("output", "package"),
    [
        ("ImportError: libGL.so.1: cannot open shared object file", "libgl1"),
        ("ImportError: libXrender.so.1: cannot open shared object file", "libxrender1"),
        ("vtkEGLRenderWindow: no devices found", "libegl1"),
        ("", "libegl1"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="names packages of Debian")
def test_a_first_render_that_fails_or_crashes_names_the_package_to_install(record, monkeypatch, output, package):
    def crash(command, **options):
        return subprocess.CompletedProcess(command, -11, "", output)

    forget_probe()
    monkeypatch.setattr(subprocess, "run", crash)
    try:
        with pytest.raises(RuntimeError, match=f"apt install {package}"):
            graphics.probe_rendering()
    finally:
        forget_probe()


def forget_probe():
    graphics.probe_rendering.cache_clear()
    graphics._searched.cache_clear()


def test_the_first_render_is_tested_once_and_in_the_background(monkeypatch):
    begun, allowed = [], threading.Event()

    def render(command, **options):
        assert allowed.wait(60)
        begun.append(options["env"].get("VTK_DEFAULT_OPENGL_WINDOW", ""))
        return subprocess.CompletedProcess(command, 0, "", "")

    forget_probe()
    monkeypatch.setattr(subprocess, "run", render)
    try:
        graphics.begin_probe()  # returns although the render has not been allowed yet
        graphics.begin_probe()
        allowed.set()
        assert graphics.probe_rendering() == graphics.probe_rendering() == begun[0]
        assert len(begun) == 1
    finally:
        forget_probe()


def test_a_first_render_that_failed_is_tested_again(monkeypatch):
    code = 1

    def render(command, **options):
        return subprocess.CompletedProcess(command, code, "", "")

    forget_probe()
    monkeypatch.setattr(subprocess, "run", render)
    try:
        with pytest.raises(RuntimeError, match="cannot render off-screen"):
            graphics.probe_rendering()
        code = 0  # after the missing package was installed
        assert isinstance(graphics.probe_rendering(), str)
    finally:
        forget_probe()


def test_importing_the_views_imports_no_heavy_package():
    code = (
        "import sys, withe.view, withe.recording, withe.io, withe.shapes\n"
        "heavy = {'matplotlib', 'pyvista', 'vtk', 'vtkmodules', 'imageio_ffmpeg', 'rich', 'IPython', 'scipy'}\n"
        "print(sorted(heavy & {name.split('.')[0] for name in sys.modules}))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert result.stdout.strip() == "[]"


# Obstacles


@pytest.fixture(scope="module")
def scenes():
    """Records of a rod among obstacles: in space, where a sphere moves, and in a plane."""
    rubber = withe.Material(youngs_modulus=5e5, density=1000.0, viscosity=200.0)
    space = withe.Scene()
    space.add_rod(points=withe.shapes.helix(0.03, 0.02, 0.3, 30), radius=4e-3, material=rubber)
    space.add_floor(height=-0.03, name="floor")
    space.add_sphere((0.06, 0.02, 0.0), 0.02, name="ball")
    space.add_capsule((-0.08, -0.05, 0), (-0.08, 0.06, 0), 0.012, name="bar")
    simulation = space.build()
    simulation.move("ball", (0.06, 0.02, 0.05), over=0.04)
    plane = withe.Scene()
    plane.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=4e-3, material=rubber)
    plane.add_plane((0, 0, -0.12), (-0.3, 0, 1), name="slope")
    plane.add_sphere((0.1, 0, -0.045), 0.03, name="ball")
    plane.add_sphere((0, 0, -20.0), 19.8, name="hill")
    return simulation.run(0.04, 0.01, progress=False), plane.build().run(0.04, 0.01, progress=False)


def test_a_record_knows_where_obstacles_were(scenes, tmp_path):
    record = scenes[0]
    for kept in (record, Record.load(record.save(tmp_path / "kept.npz")), pickle.loads(pickle.dumps(record))):
        assert [(o.name, o.kind, o.radius) for o in kept.obstacles] == [
            ("floor", "plane", 0.0),
            ("ball", "capsule", 0.02),
            ("bar", "capsule", 0.012),
        ]
        np.testing.assert_allclose(kept.obstacles[2].axis, (0, 0.11, 0))
        np.testing.assert_allclose(kept.obstacle_position("ball")[:, 2], 0.05 * np.arange(5) / 4, atol=1e-12)
        np.testing.assert_array_equal(kept.obstacle_position("bar")[:, 1], -0.05)
    with pytest.raises(ValueError, match="obstacle must be one of 'floor', 'ball', 'bar' or its handle, got 'wall'"):
        record.obstacle_position("wall")


def test_obstacles_stand_in_the_picture_and_move_with_their_record(scenes, renderer, tmp_path):
    record = scenes[0]
    bare = Record(record.rods, {k: v for k, v in record._arrays.items() if not k.startswith("obstacle")})
    stage = rendering.Stage(record, size=(160, 120))
    empty = rendering.Stage(bare, size=(160, 120))
    try:
        first = stage.image()
        stage.show(4.0)
        moved = [actor for actor, *_ in stage._obstacles if np.any(actor.position)]
        assert [actor.position for actor in moved] == [pytest.approx((0, 0, 0.05), abs=1e-12)]
        assert np.abs(stage.image().astype(int) - first).max() > 40
        assert np.abs(empty.image().astype(int) - first).max() > 40
        assert stage._ground == pytest.approx(-0.03, abs=1e-3)  # the shadow falls on the floor
    finally:
        stage.close()
        empty.close()
    assert record.picture(tmp_path / ("n" * 251 + ".png"), size=(64, 48)).stat().st_size > 500


def test_a_floor_fades_into_the_background(scenes, renderer):
    stage = rendering.Stage(scenes[0], size=(160, 120), camera="side")
    try:
        image = stage.image().astype(int)
    finally:
        stage.close()
    background, beside = image[0, 0], image[:, 4]  # a column that shows the floor alone
    assert (image[0] == background).all()
    assert (background - beside[-1]).min() > 5
    assert np.abs(np.diff(beside, axis=0)).max() <= 4


def test_a_floor_reaches_as_far_as_the_camera_sees_and_moves_with_its_plane(scenes, renderer):
    stage = rendering.Stage(scenes[0], size=(64, 48))
    try:
        floor = stage._floor
        side, meshes = floor._side, (floor._rest, floor._square)
        stage.keep_in_view(3.0 * scenes[0].positions()[0])
        assert floor._side > 1.3 * side
        assert all(np.allclose(mesh.points[:, 2], -0.03) for mesh in meshes)
        floor.lift(-0.05)
        assert all(np.allclose(mesh.points[:, 2], -0.05) for mesh in meshes)
    finally:
        stage.close()


def test_without_a_floor_there_is_no_shadow_and_with_a_ground_there_is(record, renderer):
    coloured, dark = [], []
    for ground in (None, -0.32):
        stage = rendering.Stage(record, size=(160, 120), ground=ground)
        try:
            image = stage.image().astype(int)
        finally:
            stage.close()
        grey = np.ptp(image, axis=2) < 15
        coloured.append((~grey).sum())
        dark.append((grey & (image.max(axis=2) < 232)).sum())  # a floor is at most as dark
    assert min(coloured) > 50
    assert dark[0] < 10
    assert dark[1] > 30


def test_figures_show_obstacles_near_the_rods(scenes):
    space, plane = scenes
    axes = plane.plot().axes[0]
    assert len(axes.get_lines()) == 5 + 1  # five shapes, a slope
    ball, hill = (a for a in axes.get_children() if type(a).__name__ == "Polygon")
    np.testing.assert_allclose(np.ptp(ball.get_xy(), axis=0), 60.0, rtol=5e-3)
    assert np.ptp(hill.get_xy()[:, 0]) > 1e4
    assert np.ptp(axes.get_xlim()) < 1000.0  # which leaves the limits as they are
    solids = [a for a in space.plot().axes[0].collections if type(a).__name__ == "Poly3DCollection"]
    assert len(solids) == 1 + 5 + 1  # floor, ball at five times, bar


def test_a_picture_keeps_away_from_what_is_far_or_large():
    points = np.array([[0.0, 0, 0], [0.1, 0, 0.1]])
    floor = ObstacleOutline("floor", "plane", np.array([0.0, 0, 2.0]), 0.0)
    assert len(scenery.framing(floor, np.array([[5.0, 5.0, -10.0]]), points)) == 0
    np.testing.assert_allclose(scenery.framing(floor, np.array([[5.0, 5.0, -0.1]]), points)[:, 2], -0.1)
    corners = scenery.patch(floor, np.array([5.0, 5.0, -0.1]), points)
    np.testing.assert_allclose(corners[:, 2], -0.1)
    np.testing.assert_allclose(corners[:, :2].mean(axis=0), (0.05, 0.0), atol=1e-12)
    earth = ObstacleOutline("earth", "capsule", np.zeros(3), 100.0)
    assert len(scenery.framing(earth, np.array([[0.0, 0.0, -100.0]]), points)) == 0
    ball = ObstacleOutline("ball", "capsule", np.zeros(3), 0.05)
    assert np.ptp(scenery.framing(ball, np.zeros((1, 3)), points), axis=0) == pytest.approx([0.1, 0.1, 0.1])


def test_a_capsule_is_drawn_at_its_radius_from_its_axis():
    bar = ObstacleOutline("bar", "capsule", np.array([0.0, 0.2, 0.1]), 0.03)
    place = np.array([1.0, 0.0, 0.0])
    for points in (scenery.surface(bar, place).reshape(-1, 3), scenery.cloud(bar, place)):
        share = np.clip((points - place) @ bar.axis / (bar.axis @ bar.axis), 0.0, 1.0)
        distance = np.linalg.norm(points - place - share[:, None] * bar.axis, axis=1)
        assert distance.max() == pytest.approx(0.03)
    assert np.linalg.norm(scenery.surface(bar, place).reshape(-1, 3) - place, axis=1).max() > 0.2


# Round numbers


@pytest.mark.parametrize(
    ("limits", "nice"),
    [
        ((0.0, 33.9), (0.0, 40.0, 5, "%.0f")),
        ((0.0, 6.08), (0.0, 8.0, 5, "%.0f")),
        ((-1.52, 1.52), (-2.0, 2.0, 5, "%.0f")),
        ((0.0, 0.0152), (0.0, 0.02, 5, "%.3f")),
        ((21.0, 47.0), (20.0, 50.0, 4, "%.0f")),
        ((0.0, 3.04e7), (0.0, 4e7, 5, "%.3g")),
        ((5.0, 5.0), (5.0, 5.0, 2, "%.3g")),
    ],
)
def test_scales_begin_and_end_at_round_numbers(limits, nice):
    assert colors.nice_limits(*limits) == pytest.approx(nice)


def test_every_label_of_a_scale_is_a_round_number():
    rng = np.random.default_rng(3)
    for _ in range(600):
        middle, half = rng.normal(size=2) * 10.0 ** rng.uniform(-6, 6) * (1.0, 10.0 ** rng.uniform(-7, 0))
        low, high = middle - abs(half), middle + abs(half)  # values that hardly differ among them
        first, last, labels, digits = colors.nice_limits(low, high)
        assert first <= low + 1e-6 * (high - low)
        assert last >= high - 1e-6 * (high - low)
        assert 3 <= labels <= 6
        for value in np.linspace(first, last, labels):
            assert float(digits % value) == pytest.approx(value, abs=1e-6 * (high - low))


@pytest.mark.parametrize("limits", [(-58.0, 65.0), (0.0, 1.0), (-0.3, 47.0)])
def test_ticks_of_a_box_keep_away_from_the_corners_where_labels_would_meet(limits):
    low, high = limits
    for count in (1, 2, 4):
        ticks = style._ticks(low, high, count)
        assert len(ticks) >= min(count, 2)
        assert low + 0.1 * (high - low) <= min(ticks)
        assert max(ticks) <= high - 0.1 * (high - low)


def test_a_film_that_fails_leaves_what_was_there(record, renderer, tmp_path, monkeypatch):
    encoder = pytest.importorskip("imageio_ffmpeg")
    broken = tmp_path / "encoder"
    broken.write_text(
        "#!/bin/sh\nfor target; do :; done\necho part > \"$target\"\necho 'No space left on device' >&2\nexit 1\n"
    )
    broken.chmod(0o755)
    monkeypatch.setattr(encoder, "get_ffmpeg_exe", lambda: str(broken))
    film = tmp_path / "arm.mp4"
    film.write_bytes(b"an older film")
    with pytest.raises(RuntimeError, match="ffmpeg failed, and no film was written: No space left on device"):
        record.animate(film, size=(64, 48), progress=False)
    assert film.read_bytes() == b"an older film"
    assert sorted(tmp_path.iterdir()) == [film, broken]


def test_the_views_have_help_without_another_import():
    script = "import withe; assert 'matplotlib' in (withe.view.__doc__ or ''); help(withe.view.plot)"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert "Draw the shapes of the rods" in result.stdout


def test_a_view_without_a_display_says_what_to_do(record, monkeypatch):
    pyvista = pytest.importorskip("pyvista")
    monkeypatch.setattr(pyvista, "OFF_SCREEN", False)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if sys.platform == "linux":
        with pytest.raises(RuntimeError, match="no display was found: use picture"):
            record.view()
