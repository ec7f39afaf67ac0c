"""AprilTags are found where they were drawn."""

import numpy as np
import pytest

from rendered_tags import render_tags, turned_tags
from withe.perception import detect_tags

cv2 = pytest.importorskip("cv2")


@pytest.mark.parametrize("width", [24.0, 31.0, 45.0, pytest.param(80.0, marks=pytest.mark.slow)])
def test_tags_are_found_to_a_fraction_of_a_pixel(width):
    off, turned = [], []
    for seed in (0, 1, 2, 3, 104):  # in the last a tag of 24 px whose first corners are a pixel off
        picture, truth = turned_tags(cv2, np.random.default_rng(seed), width, seed=seed)
        found = detect_tags(picture)
        assert found.numbers == tuple(truth)
        for center, angle, (drawn, turn) in zip(found.centers, found.angles, truth.values(), strict=True):
            off.append(center - drawn)
            turned.append(abs((angle - turn + np.pi) % (2 * np.pi) - np.pi))
    assert np.percentile(np.linalg.norm(off, axis=1), 95) < 0.1
    assert np.abs(np.mean(off, axis=0)).max() < 0.03  # of the half pixel that the refinement for AprilTags is off
    assert np.degrees(np.median(turned)) < 0.1


def test_corners_go_clockwise_from_the_upper_left():
    picture, truth = turned_tags(cv2, np.random.default_rng(1), 60.0)
    found = detect_tags(picture)
    for corners, (center, angle) in zip(found.corners, truth.values(), strict=True):
        along, down = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        upper_left = center - 30.0 * (along + down)
        assert corners[0] == pytest.approx(upper_left, abs=0.3)
        assert corners[1] == pytest.approx(upper_left + 60.0 * along, abs=0.3)


def test_one_plane_for_all_tags_gives_their_places_in_metres():
    matrix = np.array([[1400.0, 0, 640], [0, 1400, 360], [0, 0, 1]])
    normal = np.array([0.3, -0.2, -1.0]) / np.linalg.norm([0.3, -0.2, -1.0])
    right = np.array([1.0, 0.0, 0.3]) / np.hypot(1.0, 0.3)
    down = np.cross(right, normal)
    numbers = range(20, 26)
    places = {
        n: (0.0, 0.0, 0.5) + (0.06 * (i % 3) - 0.06) * right + (0.06 * (i // 3) - 0.03) * down
        for i, n in enumerate(numbers)
    }
    rays = np.linalg.inv(matrix)

    def to_tag(number, x, y):
        sight = np.stack([x, y, np.ones_like(x)], axis=-1) @ rays.T
        points = sight * ((places[number] @ normal) / (sight @ normal))[..., None] - places[number]
        return points @ right / 0.012, points @ down / 0.012

    seen = {n: (p[:2] / p[2] * 1400 + (640, 360), 45) for n, p in places.items()}
    found = detect_tags(render_tags(cv2, seen, to_tag), matrix, size=0.012)
    assert found.numbers == tuple(numbers)
    assert found.positions == pytest.approx(np.array(list(places.values())), abs=1.5e-3)
    apart = np.linalg.norm(np.diff(found.positions[:3], axis=0), axis=1)
    assert apart == pytest.approx(0.06, rel=5e-3)
    assert np.degrees(np.arccos(min(found.normal @ normal, 1.0))) < 3.0


def test_pixels_are_asked_for_by_number_and_are_nan_for_what_was_not_found():
    picture, truth = turned_tags(cv2, np.random.default_rng(2), 40.0)
    pixels = detect_tags(picture).pixels([103, 7, 101])
    assert pixels[0] == pytest.approx(truth[103][0], abs=0.2)
    assert np.isnan(pixels[1]).all()
    assert pixels[2] == pytest.approx(truth[101][0], abs=0.2)


def test_a_picture_without_tags_has_none():
    found = detect_tags(np.full((60, 80, 3), 128, np.uint8), np.eye(3))
    assert found.numbers == ()
    assert found.corners.shape == (0, 4, 2)
    assert found.pixels([1]).shape == (1, 2)
    assert found.positions is None


def test_a_tag_in_a_file_and_in_colour(tmp_path):
    picture, truth = turned_tags(cv2, np.random.default_rng(3), 40.0)
    cv2.imwrite(str(tmp_path / "tags.png"), picture)
    assert detect_tags(tmp_path / "tags.png").numbers == tuple(truth)
    assert detect_tags(np.repeat(picture[..., None], 3, axis=2)).numbers == tuple(truth)


@pytest.mark.parametrize(
    ("image", "options", "message"),
    [
        (np.zeros((5, 5)), {}, "image must be of type uint8"),
        ("none.png", {}, "image must be a file that can be read"),
        (np.zeros((5, 5), np.uint8), {"family": "36h12"}, "family must be"),
        (np.zeros((5, 5), np.uint8), {"size": 0}, "size must be positive"),
        (np.zeros((5, 5), np.uint8), {"camera_matrix": np.zeros((3, 3))}, "matrix must be invertible"),
        (np.zeros((5, 5), np.uint8), {"distortion": [0, 0, 0, 0]}, "camera_matrix must be given where distortion is"),
    ],
)
def test_bad_input_is_refused(image, options, message):
    with pytest.raises(ValueError, match=message):
        detect_tags(image, **options)


def test_the_same_tag_twice_is_refused():
    def to_tag(number, x, y):
        return (x % 100 - 50) / 40, (y - 50) / 40

    picture = render_tags(cv2, {5: ((50, 50), 45)}, to_tag, size=(120, 100))
    with pytest.raises(ValueError, match="got tag 5 2 times"):
        detect_tags(np.hstack([picture, picture]))
