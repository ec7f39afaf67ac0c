"""Lenses from pictures of boards by a known camera, and centrelines in space from two views."""

import numpy as np
import pytest

from cable_films import mask_of
from rendered_boards import DISTORTION, MATRIX, pictures, poses
from two_views import VIEWS, curve
from withe.folding import Paper, measure
from withe.perception import Camera, CharucoBoard, Chessboard, trace_mask, triangulate

cv2 = pytest.importorskip("cv2")

from withe.folding.views import strip_picture  # noqa: E402

CHESS = Chessboard(9, 6, 0.03)
CHARUCO = CharucoBoard(8, 6, 0.03, 0.022)


@pytest.fixture(scope="module", params=[CHESS, CHARUCO], ids=["chess", "charuco"])
def calibrated(request):
    """A board, its pictures, and the camera that they give."""
    images = pictures(request.param, 8, seed=0)
    return request.param, images, Camera.calibrate(images, request.param)


def test_a_lens_is_found_from_pictures_of_a_board(calibrated):
    _, _, camera = calibrated
    assert np.diag(camera.matrix)[:2] == pytest.approx(np.diag(MATRIX)[:2], rel=3e-3)
    assert camera.matrix[:2, 2] == pytest.approx(MATRIX[:2, 2], abs=3.0)
    assert 0.0 < camera.reprojection_error < 0.2
    random = np.random.default_rng(1)
    pixels = random.uniform((60.0, 45.0), (580.0, 435.0), (200, 2))
    true = Camera(MATRIX, DISTORTION)
    apart = np.linalg.norm(camera.directions(pixels) - true.directions(pixels), axis=1)
    ideal = Camera(MATRIX).directions(pixels)
    without = np.linalg.norm(ideal - true.directions(pixels), axis=1)
    # A shift of the principal point is hardly seen by boards: it acts as a turn of the camera.
    assert np.median(apart) < 3.0 / MATRIX[0, 0]
    assert without.max() > 10.0 / MATRIX[0, 0]


def test_distances_on_a_board_come_back_in_metres(calibrated):
    board, images, camera = calibrated
    random = np.random.default_rng(0)
    for image, (rotation, place) in zip(images[:3], poses(board, 3, random), strict=True):
        seen, known = board.find(image)
        posed = Camera.from_points(seen, known, camera.matrix, camera.distortion)
        found = posed.to_plane(seen)[:, :2]
        assert np.abs(found - known).max() < 4e-4
        assert np.linalg.norm(found[-1] - found[0]) == pytest.approx(np.linalg.norm(known[-1] - known[0]), abs=3e-4)
        assert posed.translation == pytest.approx(place, abs=4e-3)
        assert posed.rotation == pytest.approx(rotation, abs=0.01)


def test_files_grey_pictures_and_pictures_without_a_board_are_accepted(calibrated, tmp_path):
    board, images, camera = calibrated
    cv2.imwrite(str(tmp_path / "0.png"), images[0])
    coloured = np.repeat(images[1][..., None], 3, axis=2)
    blank = np.full_like(images[0], 128)
    again = Camera.calibrate([tmp_path / "0.png", coloured, blank, *images[2:]], board)
    assert again.matrix == pytest.approx(camera.matrix, rel=1e-9)
    assert again.distortion == pytest.approx(camera.distortion, abs=1e-9)


def test_equal_pictures_give_equal_bits(calibrated):
    board, images, camera = calibrated
    threads = cv2.getNumThreads()
    again = Camera.calibrate(images, board)
    assert again.distortion.tobytes() == camera.distortion.tobytes()
    assert cv2.getNumThreads() == threads


def test_pictures_that_do_not_determine_a_lens_are_refused(calibrated):
    board, images, _ = calibrated
    with pytest.raises(ValueError, match="at least 3 pictures, got 2 of 3"):
        Camera.calibrate([*images[:2], np.full_like(images[0], 128)], board)
    with pytest.raises(ValueError, match="at least 3 pictures, got 0 of 0"):
        Camera.calibrate([], board)
    with pytest.raises(ValueError, match=r"images\[1\] must have 480 rows and 640 columns as the first picture"):
        Camera.calibrate([images[0], images[1][:-10]], board)
    with pytest.raises(ValueError, match="boards that are all parallel"):
        Camera.calibrate([images[0]] * 3, board)
    with pytest.raises(ValueError, match="board must be a Chessboard"):
        Camera.calibrate(images, (9, 6))
    with pytest.raises(ValueError, match="got one path"):
        Camera.calibrate("board.png", board)
    with pytest.raises(ValueError, match=r"images\[0\] must be a file that can be read"):
        Camera.calibrate(["none.png"], board)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Chessboard(3, 6, 0.03), r"columns must lie in 4\.\.100"),
        (lambda: Chessboard(9, 6, 0.0), "square must be positive"),
        (lambda: CharucoBoard(8, 6, 0.03, 0.03), "marker must be smaller than square"),
        (lambda: CharucoBoard(8, 6, 0.03, 0.02, "9X9_50"), "dictionary must be"),
        (lambda: CharucoBoard(12, 12, 0.03, 0.02), "dictionary must hold 72 markers"),
        (lambda: CHESS.picture(2), "pixels must lie in"),
    ],
)
def test_bad_boards_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_strip_is_measured_through_a_lens_with_distortion():
    scale, a4 = 3000.0, Paper.a4()
    plain = strip_picture(a4, 0.0, 0.1, scale, np.random.default_rng(3))
    height, width = plain.shape[:2]
    middle = -0.5, 0.5 * (height - 1)  # on the border where the strip is clamped, which remains straight
    focal = 500.0
    matrix = [[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]]
    pose = {"rotation": np.diag([1.0, -1.0, -1.0]), "translation": (0.0, 0.0, focal / scale)}
    lens = Camera(matrix, (0.25, 0.0, 0.0, 0.0), **pose)
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    ideal = lens.directions(np.column_stack([x.ravel(), y.ravel()])) * focal + middle
    places = ideal.reshape(height, width, 2).astype(np.float32)
    seen = cv2.remap(plain, places[..., 0], places[..., 1], cv2.INTER_LINEAR, None, cv2.BORDER_REPLICATE)
    true = measure(image=plain, scale=scale).gravito_bending_length
    found = measure(image=seen, camera=lens).gravito_bending_length
    wrong = measure(image=seen, scale=scale).gravito_bending_length
    assert found == pytest.approx(true, rel=0.01)
    assert abs(wrong - true) > 3.0 * abs(found - true)
    assert measure(image=plain, camera=Camera(matrix, **pose)).gravito_bending_length == pytest.approx(true, rel=1e-9)
    with pytest.raises(ValueError, match="image and scale, or image and camera"):
        measure(image=plain, camera=lens, scale=scale)


@pytest.mark.parametrize("seed", [10, 11, 12])
def test_two_views_give_a_centreline_in_metres(seed):
    truth = curve(seed)
    first, second = (trace_mask(mask_of([camera.project(truth)])) for camera in VIEWS)
    found = first.triangulate(VIEWS[0], second, VIEWS[1])
    apart = np.sqrt(((found.points[:, None] - truth[None]) ** 2).sum(axis=2)).min(axis=1)
    pixel = 1e-3  # of the pictures, at the cable [m]
    assert apart.mean() < 1.2 * pixel
    assert apart.max() < 8.0 * pixel
    length = np.linalg.norm(np.diff(truth, axis=0), axis=1).sum()
    assert found.length == pytest.approx(length, rel=0.01)
    assert found.rms < 1.0


def test_lines_without_noise_give_the_centreline_in_either_direction():
    truth = curve(5)
    lines = [camera.project(truth) for camera in VIEWS]
    for other, turned in ((lines[1], False), (lines[1][::-1], True)):
        found = triangulate([lines[0], other], VIEWS)
        assert found.reversed is turned
        apart = np.sqrt(((found.points[:, None] - truth[None]) ** 2).sum(axis=2)).min(axis=1)
        assert apart.max() < 1e-3
        assert np.linalg.norm(found.points[0] - truth[0]) < 5e-4


def test_views_that_do_not_determine_a_centreline_are_refused():
    truth = curve(5)
    lines = [camera.project(truth) for camera in VIEWS]
    flat = Camera.from_points([(0, 0), (640, 0), (640, 480), (0, 480)], [(0, 0), (0.6, 0), (0.6, 0.5), (0, 0.5)])
    for given, cameras, message in [
        (lines[:1], VIEWS, "lines and cameras must be pairs"),
        (lines, (VIEWS[0], flat), "cameras must have matrices"),
        (lines, (VIEWS[0], 3.0), "cameras must be of type"),
        (lines, (VIEWS[0], VIEWS[0]), "cameras must be in two places"),
        ([lines[0], lines[1][:3]], VIEWS, r"lines\[1\] must have at least 4 points"),
        ([lines[0], lines[1] + [60.0, 0.0]], VIEWS, "lines must be views of one cable"),
    ]:
        with pytest.raises(ValueError, match=message):
            triangulate(given, cameras)
    tracing = trace_mask(mask_of([lines[0]]))
    with pytest.raises(ValueError, match="other_cable must be from 0 to 0, got 1"):
        tracing.triangulate(VIEWS[0], tracing, VIEWS[1], other_cable=1)
    with pytest.raises(ValueError, match="other must be a Tracing"):
        tracing.triangulate(VIEWS[0], 3.0, VIEWS[1])
