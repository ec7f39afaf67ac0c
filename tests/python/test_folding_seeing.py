"""Measurements from pictures of simulated sheets: the stiffness of a strip, the position of a sheet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from withe.folding import Noise, Paper, SimulatedSheet, find_edge, measure, overhead_camera
from withe.perception import Camera

cv2 = pytest.importorskip("cv2")

from withe.folding.seeing import camera_over  # noqa: E402
from withe.folding.views import strip_picture, table_picture  # noqa: E402

A4 = Paper.a4()
SCALE = 4000.0
PLAIN = np.full((60, 80, 3), 90, np.uint8)


def both_sides(positions, width):
    """Edges of a sheet that lies along x."""
    across = np.array([0.0, 0.5 * width, 0.0])
    return [positions - across, positions + across]


def lying(paper: Paper, slide: float) -> np.ndarray:
    x = np.linspace(0.0, paper.length, 100) + slide
    return np.stack([x, 0 * x, 0 * x], axis=1)


def drawn_camera(random: np.random.Generator, x: float) -> Camera:
    """Some 0.6 m over the far edge, tilted by some degrees, with a lens that distorts."""
    down = Rotation.from_rotvec(random.uniform(-0.06, 0.06, 3)).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    height = random.uniform(0.58, 0.62)
    place = np.array([x - 0.02, 0.0, 0.0]) + down[2] * height / down[2, 2]
    matrix = [[1200.0, 0.0, 319.5], [0.0, 1200.0, 239.5], [0.0, 0.0, 1.0]]
    distortion = (random.uniform(-0.05, 0.05), 0.0, 0.0, 0.0)
    return Camera(matrix, distortion, rotation=down, translation=-down @ place)


def test_a_strip_in_a_picture_says_how_stiff_it_is_within_its_error():
    random = np.random.default_rng(2)
    scaled = []
    for paper in [Paper.a4(), Paper.cardboard()] * 5:
        length = random.uniform(1.6, 2.9) * paper.gravito_bending_length
        found = measure(image=strip_picture(paper, 0.0, length, SCALE, random), scale=SCALE)
        scaled.append((found.gravito_bending_length - paper.gravito_bending_length) / found.error)
        assert found.error < 0.003 * paper.gravito_bending_length
        assert found.strip * found.gravito_bending_length == pytest.approx(length, abs=3e-4)
    assert np.sqrt(np.mean(np.square(scaled))) < 1.3
    assert np.abs(scaled).max() < 3.0


def test_a_picture_may_be_mirrored_or_a_file(tmp_path):
    image = strip_picture(A4, 0.0, 0.1, SCALE, np.random.default_rng(0))
    found, mirrored = measure(image=image, scale=SCALE), measure(image=image[:, ::-1], scale=SCALE)
    assert mirrored.gravito_bending_length == pytest.approx(found.gravito_bending_length, rel=1e-6)
    path = tmp_path / "strip.png"
    cv2.imwrite(str(path), image[..., ::-1])
    assert measure(image=path, scale=SCALE) == found
    with pytest.raises(ValueError, match="scale must be in pixels per metre"):
        measure(image=path, scale=1.0 / SCALE)


def test_the_error_of_a_picture_is_that_of_its_readings():
    random = np.random.default_rng(7)
    image = strip_picture(A4, 0.0, 0.11, SCALE, random)
    once, twice = (measure(image=image, scale=SCALE, error=error).error for error in (1e-4, 2e-4))
    assert twice == pytest.approx(2 * once)
    assert measure(image=image, scale=SCALE).error == pytest.approx(0.3 / SCALE / 1e-4 * once)


def test_what_the_planner_must_not_see_is_measured():
    for seed in range(3):
        sheet = SimulatedSheet(A4, seed, replace(Noise.none(), gravito_bending_length=0.05), edges=20)
        found = measure(image=sheet.strip_picture(), scale=SCALE)
        assert found.gravito_bending_length == pytest.approx(sheet.truth.gravito_bending_length, rel=3e-3)


@pytest.mark.slow
def test_a_strip_that_curls_is_as_stiff_as_it_is_when_both_of_its_sides_are_seen():
    random = np.random.default_rng(3)
    scaled, curls = [], []
    for paper in [A4, Paper.cardboard()] * 5:
        curl = random.uniform(-1.0, 1.0)  # upwards
        length = random.uniform(1.6, 2.9) * paper.gravito_bending_length
        image, turned = (strip_picture(paper, sign * curl, length, SCALE, random) for sign in (1.0, -1.0))
        found = measure(image=image, turned=turned, scale=SCALE)
        scaled.append((found.gravito_bending_length - paper.gravito_bending_length) / found.error)
        curls.append((found.curl + curl) / found.curl_error)
        assert found.error < 2e-3 * paper.gravito_bending_length
        assert found.strip * found.gravito_bending_length == pytest.approx(length, abs=3e-4)
    assert np.sqrt(np.mean(np.square(scaled))) < 1.3
    assert np.sqrt(np.mean(np.square(curls))) < 1.3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"image": PLAIN, "scale": SCALE}, "a picture without a sheet"),
        ({"image": cv2.circle(PLAIN.copy(), (40, 30), 9, (255, 255, 255), -1), "scale": SCALE}, "touches neither"),
        ({"image": cv2.line(PLAIN.copy(), (0, 30), (79, 30), (255, 255, 255), 2), "scale": SCALE}, "touches both"),
        ({"image": cv2.line(PLAIN.copy(), (0, 50), (60, 10), (255, 255, 255), 2), "scale": SCALE}, "hangs down"),
        ({"image": PLAIN, "scale": -1.0}, "scale must be positive"),
        ({"image": PLAIN}, "length and drop, or image and scale"),
        ({"image": PLAIN, "scale": SCALE, "length": 0.1}, "length and drop, or image and scale"),
    ],
)
def test_pictures_that_tell_nothing_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        measure(**arguments)


def test_the_far_edge_is_found_within_half_a_millimetre_at_half_a_millimetre_a_pixel():
    random = np.random.default_rng(4)
    off = []
    for paper in [Paper.a4(), Paper.us_letter()] * 15:
        slide = random.uniform(-0.02, 0.06)
        camera = drawn_camera(random, paper.length + slide)
        seen = find_edge(
            table_picture(both_sides(lying(paper, slide), paper.width), camera, (640, 480), random), camera, paper
        )
        off.append(seen.x - paper.length - slide)
        assert abs(seen.angle) < np.radians(0.2)
        assert np.hypot(*(seen.corners[1] - seen.corners[0])) == pytest.approx(paper.width, abs=5e-4)
    assert np.abs(off).max() < 5e-4
    assert np.abs(np.mean(off)) < 1e-4


def test_the_camera_of_a_watched_fold_sees_the_far_edge_of_sheets_of_any_width():
    random = np.random.default_rng(60)
    for _ in range(20):
        width = random.uniform(0.1, 0.6)
        paper, slide = Paper(np.sqrt(2.0) * width, width, 0.06), random.uniform(-0.03, 0.03)
        camera = camera_over(paper)
        pixel = float(np.ptp(camera.to_plane([[319.0, 239.5], [320.0, 239.5]])[:, 0]))
        picture = table_picture(both_sides(lying(paper, slide), width), camera, (640, 480), random)
        assert find_edge(picture, camera, paper).x - paper.length == pytest.approx(slide, abs=0.5 * pixel)
        assert pixel < 1.001 * max(5e-4, width / 400)


def test_a_layer_that_is_folded_over_does_not_hide_the_edge():
    turn = np.linspace(-np.pi / 2, np.pi / 2, 30)
    back = np.stack([0.03 * np.cos(turn), 0 * turn, 0.03 + 0.03 * np.sin(turn)], axis=1) * [-1, 1, 1]
    over = np.stack([np.linspace(0.13, 0.0, 20), np.zeros(20), np.full(20, 0.06)], axis=1)
    positions = np.vstack([over[:-1], back[::-1], [[0.16, 0.0, 0.0]]])
    positions[:, 0] += 0.137
    camera = overhead_camera(0.297)
    image = table_picture(both_sides(positions, A4.width), camera, (640, 480), np.random.default_rng(0))
    assert find_edge(image, camera, A4).x == pytest.approx(0.297, abs=3e-4)


def test_a_turned_edge_says_by_how_much():
    image = np.full((480, 640, 3), 40, np.uint8)
    camera = overhead_camera(0.3)
    turn = Rotation.from_euler("z", 2.0, degrees=True).as_matrix()
    corners = (turn @ np.array([[0.0, -0.105, 0], [0.0, 0.105, 0], [-0.15, 0.105, 0], [-0.15, -0.105, 0]]).T).T
    pixels = camera.project(corners + np.array([0.33, 0.0, 0.0]))
    cv2.fillConvexPoly(image, np.round(pixels * 64).astype(np.int32), (230, 230, 230), cv2.LINE_AA, 6)
    seen = find_edge(image, camera, A4)
    assert seen.angle == pytest.approx(np.radians(2.0), abs=1e-3)
    assert seen.x == pytest.approx(0.33, abs=3e-4)


def test_a_picture_without_a_sheet_is_refused():
    camera = overhead_camera(0.297)
    with pytest.raises(ValueError, match="a picture without a sheet"):
        find_edge(np.full((480, 640, 3), 60, np.uint8), camera, A4)
    with pytest.raises(ValueError, match="no two that are so"):
        find_edge(
            table_picture(both_sides(lying(A4, 0.0), 0.1), camera, (640, 480), np.random.default_rng(0)), camera, A4
        )
    with pytest.raises(ValueError, match="height must be positive"):
        overhead_camera(0.3, height=0.0)


def test_pictures_of_a_sheet_repeat_with_its_seed():
    camera = overhead_camera(0.297)
    first, second = (SimulatedSheet(A4, 3, edges=20).picture(camera) for _ in range(2))
    assert (first == second).all()
    assert (first != SimulatedSheet(A4, 4, edges=20).picture(camera)).any()
