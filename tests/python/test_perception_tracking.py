"""Tracking of cables through films: hidden parts, crossings, bad frames, files and the command line."""

import csv
import warnings
from dataclasses import replace

import numpy as np
import pytest

import withe
from cable_films import NODES, RATE, SHAPE, camera, crossing_film, hanging_film, mask_of
from withe.__main__ import main
from withe.perception import Camera, RodPrior, Tracker, draw_tracked, read_film
from withe.perception.chain import Chain, Pulls, resample

ROPE = RodPrior(length=0.4, bend_stiffness=2e-4, line_density=0.02)


def apart(nodes, truth):
    """Distances of nodes from true nodes, in the direction in which they are nearer."""
    ways = [np.hypot(*(line - truth).T) for line in (nodes, nodes[::-1])]
    return min(ways, key=np.mean)


def arc(shift=0.0, bend=1.0, points=161):
    """A cable of 480 px that bends and moves down by a shift, shape (points, 2)."""
    turn = bend * np.linspace(-0.5, 0.5, points)
    way = np.column_stack([np.cos(turn), np.sin(turn)]) * 480.0 / (points - 1)
    line = np.vstack([[0.0, 0.0], np.cumsum(0.5 * (way[1:] + way[:-1]), axis=0)])
    return line - line.mean(axis=0) + [448.0, 330.0 + shift]


def hidden_errors(film, rod):
    """Errors of the hidden nodes while they are hidden, shape (frames, nodes) [px]."""
    tracker = Tracker(camera(), rod, frame_rate=RATE)
    first, last = film.hidden_frames
    covered = np.zeros(NODES, bool)
    covered[(film.hidden[0] + 3) // 4 : film.hidden[1] // 4 + 1] = True
    found = []
    turned = False
    for frame, mask in enumerate(film.masks()):
        if frame == last:
            break
        (cable,) = tracker.update(mask=mask)
        truth = film.lines[frame, 0, ::4]
        if frame == 0:
            turned = np.hypot(*(cable.nodes[0] - truth[0])) > np.hypot(*(cable.nodes[-1] - truth[0]))
        nodes = cable.nodes[::-1] if turned else cable.nodes
        if frame >= first:
            assert not cable.visible[:: -1 if turned else 1][covered][2:-2].any()
            found.append(np.hypot(*(nodes - truth).T)[covered])
    return np.array(found)


def test_nodes_follow_a_moving_cable_in_order_and_at_equal_distances():
    tracker = Tracker()
    for frame in range(20):
        truth = arc(shift=4.0 * frame, bend=1.0 + 0.05 * frame)
        (cable,) = tracker.update(mask=mask_of([truth]))
        error = np.hypot(*(cable.nodes - truth[::4]).T)
        if frame == 0 and error.mean() > 100.0:
            pytest.fail("the first node must be at the same end as in the trace of this film")
        assert error.mean() < 1.0
        assert error.max() < 2.5
        steps = np.hypot(*np.diff(cable.nodes, axis=0).T)
        assert steps == pytest.approx(steps.mean(), rel=0.02)
    assert cable.visible.all()
    assert cable.name == "cable 0"
    assert cable.points is None
    assert tracker.seen


def test_a_hidden_part_keeps_its_shape_without_a_rod():
    tracker = Tracker()
    for frame in range(30):
        truth = arc(shift=2.0 * frame)
        parts = [truth] if frame < 5 else [truth[:50], truth[114:]]
        (cable,) = tracker.update(mask=mask_of(parts))
    assert not cable.visible[15:26].any()
    assert cable.visible[:10].all()
    assert apart(cable.nodes, truth[::4]).max() < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [101, 102, 103])
def test_a_rod_predicts_the_hidden_two_fifths_of_a_moving_cable(seed):
    film = hanging_film(seed)
    (rod,) = film.rods
    assert hidden_errors(film, rod).mean() < 2.0
    for factor in (0.7, 1.3):
        assert hidden_errors(film, replace(rod, bend_stiffness=factor * rod.bend_stiffness)).mean() < 8.0


def test_the_chain_hangs_as_the_rod_of_the_engine():
    scene = withe.Scene()
    points = np.column_stack([np.linspace(0, 0.4, 41), np.zeros(41), -0.2 * np.sin(np.linspace(0, np.pi, 41))])
    stiffness = withe.Stiffness(stretch=1e4, bend=4e-4, twist=1.0)
    rod = scene.add_rod(
        points=points, nodes=41, radius=3e-3, stiffness=stiffness, line_density=0.02, natural="straight"
    )
    scene.pin(rod.start)
    scene.pin(rod.end)
    simulation = scene.build(planar=True)
    simulation.equilibrium()
    truth = simulation.positions(rod)[:, [0, 2]]
    spacing = np.linalg.norm(np.diff(truth, axis=0), axis=1).mean()
    bend, mass = 4e-4 / spacing**3, 0.02 * spacing
    chain = Chain(spacing, bend, mass, mass * np.array([0.0, -9.81]), 0.0, np.zeros(41), 1e4)
    ends = Pulls(
        np.array([0, 0, 39, 39]),
        np.array([0.0, 0.0, 1.0, 1.0]),
        np.array([[1.0, 0], [0, 1.0]] * 2),
        truth[[0, 0, -1, -1]],
        np.full(4, 1e6),
    )
    x = resample(points[:, [0, 2]], 41)
    for _ in range(40):
        x = chain.settle(x, x, np.full(41, 1e-3), ends, 20, 1e-9)
    assert np.abs(x - truth).max() < 1e-4
    straight = truth[0] + np.linspace(0, 1, 41)[:, None] * (truth[-1] - truth[0])
    assert np.abs(straight - truth).max() > 0.05


def test_the_force_of_bending_is_the_slope_of_a_positive_energy():
    random = np.random.default_rng(0)
    curvature = random.normal(0.0, 2.0, 9)
    chain = Chain(0.1, 3.0, 0.0, np.zeros(2), 0.0, curvature, 1.0)
    x, step = random.normal(0.0, 1.0, (9, 2)), random.normal(0.0, 1.0, (9, 2))

    def energy(scale):
        at = x + scale * step
        return 0.5 * float((at * chain.bending_force(at)).sum())  # quadratic and homogeneous

    slope = (energy(1e-4) - energy(-1e-4)) / 2e-4
    assert slope == pytest.approx(float((step * chain.bending_force(x)).sum()), rel=1e-6)
    assert energy(0.0) > 0.0


@pytest.mark.parametrize(
    "seed", [201, pytest.param(202, marks=pytest.mark.slow), pytest.param(203, marks=pytest.mark.slow)]
)
def test_two_cables_that_cross_keep_their_names_and_ends(seed):
    film = crossing_film(seed)
    tracker = Tracker(names=("first", "second"))
    for mask in film.masks():
        cables = tracker.update(mask=mask)
    assert [cable.name for cable in cables] == ["first", "second"]
    begin = Tracker(names=("first", "second")).update(mask=next(film.masks()))
    for start, cable in zip(begin, cables, strict=True):
        errors = [np.hypot(*(start.nodes - line[::way][::4]).T).mean() for line in film.lines[0] for way in (1, -1)]
        which = int(np.argmin(errors))
        truth = film.lines[-1][which // 2][:: (1, -1)[which % 2]][::4]
        assert np.hypot(*(cable.nodes - truth).T).mean() < 3.0


def test_a_tracker_that_sees_nothing_keeps_its_state_and_warns_once():
    tracker = Tracker()
    (before,) = tracker.update(mask=mask_of([arc()]))
    empty = np.zeros(SHAPE, bool)
    with pytest.warns(withe.LostCableWarning, match="the frame shows no cable"):
        (held,) = tracker.update(mask=empty)
    assert not tracker.seen
    assert not held.visible.any()
    assert np.isnan(held.residual)
    np.testing.assert_array_equal(held.nodes, before.nodes)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (held,) = tracker.update(mask=empty)
    np.testing.assert_array_equal(held.nodes, before.nodes)
    (again,) = tracker.update(mask=mask_of([arc(shift=5.0)]))
    assert tracker.seen
    assert np.hypot(*(again.nodes - before.nodes - [0.0, 5.0]).T).mean() < 1.0


def test_a_cable_that_reappears_far_away_is_found_again():
    tracker = Tracker()
    (before,) = tracker.update(mask=mask_of([arc()]))
    (cable,) = tracker.update(mask=mask_of([arc(shift=150.0)]))
    assert tracker.seen
    assert np.hypot(*(cable.nodes - before.nodes - [0.0, 150.0]).T).mean() < 1.5


def test_nothing_is_tracked_until_a_cable_appears():
    tracker = Tracker()
    with pytest.warns(withe.LostCableWarning):
        assert tracker.update(mask=np.zeros(SHAPE, bool)) == []
    assert not tracker.seen
    assert len(tracker.update(mask=mask_of([arc()]))) == 1
    assert tracker.seen


def test_a_covered_end_does_not_follow_the_border_of_what_covers_it():
    ends = []
    for given in (True, False):
        tracker = Tracker()
        hidden = np.zeros(SHAPE, bool)
        for frame in range(25):
            hidden[:, : 200 + 4 * frame] = True
            mask = mask_of([arc()]) & ~hidden
            (cable,) = tracker.update(mask=mask, hidden=hidden if given else None)
        ends.append(apart(cable.nodes, arc()[::4]).max())
    assert ends[0] < 2.0


def test_positions_in_metres_are_those_of_a_tilted_camera_with_distortion():
    angle = np.radians(25.0)
    tilt = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    lens = Camera(
        [[900.0, 0, 447.5], [0, 900.0, 335.5], [0, 0, 1]],
        (-0.2, 0.05, 0.001, -0.001),
        tilt @ np.diag([1.0, -1.0, -1.0]),
        (0, 0, 0.8),
    )
    rod = RodPrior(length=0.4, bend_stiffness=2e-3, line_density=0.02, gravity=(0.0, 0.0))
    tracker = Tracker(lens, rod)
    for frame in range(10):
        line = (arc(bend=0.3) - [448.0, 330.0]) / 1200.0 + [0.0, 0.002 * frame]
        world = np.column_stack([line, np.zeros(len(line))])
        (cable,) = tracker.update(mask=mask_of([lens.project(world)]))
    assert cable.points.shape == (NODES, 3)
    ways = [np.linalg.norm(points - world[::4], axis=1) for points in (cable.points, cable.points[::-1])]
    assert min(way.max() for way in ways) < 2e-3
    assert np.linalg.norm(np.diff(cable.points, axis=0), axis=1).sum() == pytest.approx(0.4, rel=5e-3)


def test_grey_pictures_are_tracked():
    tracker = Tracker()
    for frame in range(3):
        picture = np.full(SHAPE, 30, np.uint8)
        picture[mask_of([arc(shift=2.0 * frame)])] = 220
        (cable,) = tracker.update(picture)
    assert apart(cable.nodes, arc(shift=4.0)[::4]).mean() < 1.0
    assert draw_tracked(picture, [cable]).shape == (*SHAPE, 3)


@pytest.mark.parametrize("frame", [np.zeros((1, 1, 3), np.uint8), np.zeros((1, 1), np.uint8)])
def test_pictures_of_one_pixel_show_no_cable(frame):
    tracker = Tracker()
    with pytest.warns(withe.LostCableWarning):
        assert tracker.update(frame) == []


def test_frames_that_do_not_follow_are_refused_and_change_nothing():
    tracker = Tracker()
    (before,) = tracker.update(mask=mask_of([arc()]), time=1.0)
    for arguments, message in [
        ({"mask": mask_of([arc()]), "time": 1.0}, "time must increase from frame to frame, got 1 s after 1 s"),
        ({"mask": mask_of([arc()]), "time": 0.5}, "time must increase"),
        ({"mask": mask_of([arc()]), "time": np.nan}, "time must be finite"),
        ({"mask": np.zeros((10, 10), bool)}, "mask must have 672 rows and 896 columns as the first frame"),
        ({"image": np.zeros((10, 10, 3), np.uint8)}, "image must have 672 rows"),
        ({"mask": mask_of([arc()]), "hidden": np.zeros((3, 3), bool)}, "hidden must have 672 rows"),
        ({}, "update needs a picture or a mask"),
        ({"mask": np.zeros((0, 5), bool)}, "mask must have 672 rows"),
    ]:
        with pytest.raises(ValueError, match=message):
            tracker.update(**arguments)
    assert tracker.time == 1.0
    (after,) = tracker.cables
    np.testing.assert_array_equal(after.nodes, before.nodes)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rod": ROPE}, "rod needs a camera"),
        ({"rod": 3.0, "camera": camera()}, "rod must be a RodPrior"),
        ({"camera": 3.0}, "camera must be a withe.perception.Camera"),
        ({"nodes": 3}, "nodes must lie in 5..1000"),
        ({"names": ("a", "a")}, "names must be different"),
        ({"names": ()}, "names must be different"),
        ({"frame_rate": 0.0}, "frame_rate must be positive"),
        ({"mask": 3.0}, "mask must be a function"),
    ],
)
def test_bad_trackers_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Tracker(**arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"length": 0.0}, "length must be positive"),
        ({"length": 400.0}, "length must be at most 100 m"),
        ({"bend_stiffness": -1.0}, "bend_stiffness must be positive"),
        ({"gravity": (0.0, 0.0, -9.81)}, "gravity must have shape"),
        ({"damping": -1.0}, "damping must not be negative"),
    ],
)
def test_bad_rods_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        replace(ROPE, **arguments)


def test_first_frames_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"must show the whole of 'cable 0', 0\.4 m long, got 0\.48"):
        Tracker(camera(), ROPE).update(mask=mask_of([arc()]))
    with pytest.raises(ValueError, match="must show 2 cables of at least 40 px, got 1"):
        Tracker(names=("left", "right")).update(mask=mask_of([arc()]))
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = np.column_stack([448.0 + 150.0 * np.cos(turn), 330.0 + 150.0 * np.sin(turn)])
    with pytest.raises(ValueError, match="must show open cables, got a ring about"):
        Tracker().update(mask=mask_of([ring]))


def film_of(path, masks, rate=25.0):
    """Write masks as a film."""
    cv2 = pytest.importorskip("cv2")
    masks = list(masks)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), rate, masks[0].shape[::-1])
    assert writer.isOpened()
    for mask in masks:
        frame = np.full((*mask.shape, 3), (40, 36, 30), np.uint8)
        frame[mask] = (60, 90, 230)
        writer.write(frame)
    writer.release()


def test_a_film_becomes_a_table_and_an_overlay(tmp_path, capsys):
    path = tmp_path / "film.avi"
    film_of(path, [mask_of([arc(shift=3.0 * frame)]) for frame in range(6)])
    frames = list(read_film(path))
    assert [frame.time for frame in frames] == pytest.approx(0.04 * np.arange(6))
    assert frames[0].image.shape == (*SHAPE, 3)
    assert tuple(frames[0].image[0, 0] // 20) == (1, 1, 2)  # red, green, blue
    assert main(["track", str(path), "--nodes", "21", "--names", "rope", "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.startswith("1 cable in 6 frames\n")
    with (tmp_path / "out" / "film_cables.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 * 21
    assert rows[0]["cable"] == "rope"
    last = np.array([[float(row["x"]), float(row["y"])] for row in rows if row["frame"] == "5"])
    assert apart(last, arc(shift=15.0)[::8]).mean() < 1.5
    overlay = list(read_film(tmp_path / "out" / "film_cables.mp4"))
    assert len(overlay) == 6


@pytest.mark.parametrize("content", [None, b"", b"no film"])
def test_files_that_are_no_films_are_refused(tmp_path, capsys, content):
    pytest.importorskip("cv2")
    path = tmp_path / "film.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match="path must be a film that can be read"):
        next(read_film(path))
    assert main(["track", str(path)]) == 2
    assert "path must be a film that can be read" in capsys.readouterr().err


def test_ends_stay_in_place_while_a_known_board_hides_a_part_that_bends():
    tracker = Tracker()
    hidden = np.zeros(SHAPE, bool)
    for frame in range(25):
        truth = arc(bend=1.0 + 0.03 * frame)
        if frame == 5:
            hidden[:, 360:536] = True
        (cable,) = tracker.update(mask=mask_of([truth]) & ~hidden, hidden=hidden)
    error = apart(cable.nodes, truth[::4])
    assert error[[0, -1]].max() < 1.5
    assert error.mean() < 4.0
    assert not cable.visible[18:23].any()
