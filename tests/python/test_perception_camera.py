"""Pixels to metres and back, distortion included, and cables lifted over each other."""

import numpy as np
import pytest

from withe.perception import Camera, trace, trace_mask
from withe.perception.synthetic import SyntheticScene, make_case, render, render_mask

MATRIX = np.array([[900.0, 0, 320], [0, 905.0, 240], [0, 0, 1]])
DISTORTION = (-0.18, 0.05, 0.001, -0.0015, 0.004)


def tilted(degrees=30.0, distance=0.9):
    """A camera that looks down at the origin, tilted from the vertical; y of the picture points to -y of the world."""
    angle = np.radians(degrees)
    down = np.diag([1.0, -1.0, -1.0])
    tilt = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    return Camera(MATRIX, DISTORTION, tilt @ down, (0, 0, distance))


def test_to_plane_inverts_project_with_distortion():
    camera = tilted()
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.25, 0.25, (50, 2)), rng.uniform(0, 0.05, 50)])
    assert camera.to_plane(camera.project(points), points[:, 2]) == pytest.approx(points, abs=1e-9)


@pytest.mark.parametrize(
    ("distortion", "radius"),
    [
        ((0.6, 0.3, 0, 0), 1.2),  # pincushions, which fixed points of the distortion run away from
        ((1.0, 0, 0, 0), 1.5),
        ((-0.3, 0, 0, 0), 1.05),  # turns back at 1.054
        ((-0.5, 0.1, 0, 0), 0.99),  # turns back at 1, and goes on beyond 1.414
        ((-0.4, 0.15, 0.01, -0.02, 0.03), 0.9),
    ],
)
def test_distortion_is_removed_wherever_the_lens_does_not_turn_back(distortion, radius):
    camera = Camera(MATRIX, distortion, np.diag([1.0, -1.0, -1.0]), (0, 0, 1.0))
    random = np.random.default_rng(5)
    angle, r = random.uniform(0.0, 2.0 * np.pi, 200), radius * np.sqrt(random.uniform(0.0, 1.0, 200))
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(200)])
    assert camera.to_plane(camera.project(points)) == pytest.approx(points, abs=1e-9)


@pytest.mark.parametrize("distortion", [(-0.3, 0, 0, 0), (-0.5, 0.1, 0, 0)])
def test_pixels_where_the_lens_shows_nothing_are_refused(distortion):
    camera = Camera(MATRIX, distortion, np.diag([1.0, -1.0, -1.0]), (0, 0, 1.0))
    r = np.linspace(0.0, 1.4, 5000)
    farthest = 900.0 * (r * (1.0 + distortion[0] * r**2 + distortion[1] * r**4)).max()
    seen = np.array([[320.0, 240.0], [320.0 + farthest - 0.01, 240.0]])
    assert camera.project(camera.to_plane(seen)) == pytest.approx(seen, abs=1e-6)
    with pytest.raises(ValueError, match="where the lens distortion is invertible"):
        camera.to_plane([*seen, (320.0 + farthest + 0.01, 240.0)])


@pytest.mark.case("inverse", "Projection of a camera with distortion", source="OpenCV")
def test_projection_agrees_with_opencv():
    cv2 = pytest.importorskip("cv2")
    camera = tilted()
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (20, 3))
    rotation, _ = cv2.Rodrigues(camera.rotation)
    expected, _ = cv2.projectPoints(points, rotation, camera.translation, MATRIX, np.array(DISTORTION))
    assert camera.project(points) == pytest.approx(expected[:, 0], abs=1e-6)


def test_a_camera_is_found_from_points_in_three_ways():
    camera = tilted()
    rng = np.random.default_rng(2)
    flat = np.column_stack([rng.uniform(-0.2, 0.2, (12, 2)), np.zeros(12)])
    solid = flat + [0, 0, 1] * rng.uniform(0, 0.2, (12, 1))
    seen = camera.project(flat)
    plain = Camera(MATRIX, None, camera.rotation, camera.translation)
    plane_only = Camera.from_points(plain.project(flat), flat[:, :2])
    assert plane_only.to_plane(plain.project(flat)) == pytest.approx(flat, abs=1e-9)
    assert plane_only.project(flat) == pytest.approx(plain.project(flat), abs=1e-6)
    with pytest.raises(ValueError, match="height must be 0"):
        plane_only.to_plane(seen, 0.1)
    known = Camera.from_points(seen, flat[:, :2], MATRIX, DISTORTION)
    assert known.rotation == pytest.approx(camera.rotation, abs=1e-6)
    assert known.translation == pytest.approx(camera.translation, abs=1e-6)
    whole = Camera.from_points(plain.project(solid), solid)
    assert whole.to_plane(plain.project(solid), solid[:, 2]) == pytest.approx(solid, abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ((np.eye(2),), "matrix must have shape"),
        ((np.zeros((3, 3)),), "matrix must be invertible"),
        ((2.0 * MATRIX,), "matrix must have the last row 0, 0, 1"),
        ((np.eye(3), (1, 2, 3)), "distortion must have 4 or 5"),
        ((np.eye(3), None, 2 * np.eye(3)), "rotation must be a rotation matrix"),
        ((np.eye(3), None, np.eye(3), (0, np.nan, 0)), "translation must be finite"),
    ],
)
def test_bad_cameras_are_refused(arguments, problem):
    with pytest.raises(ValueError, match=problem):
        Camera(*arguments)


def test_bad_points_are_refused():
    with pytest.raises(ValueError, match="pixels must hold at least 4"):
        Camera.from_points(np.zeros((3, 2)), np.zeros((3, 2)))
    with pytest.raises(ValueError, match="metres must determine"):
        Camera.from_points(np.arange(12.0).reshape(6, 2), np.arange(12.0).reshape(6, 2))
    with pytest.raises(ValueError, match="metres must have shape"):
        Camera.from_points(np.zeros((4, 2)), np.zeros((5, 2)))
    with pytest.raises(ValueError, match="pixels must see the plane"):
        Camera(MATRIX, None, np.eye(3), (0, 0, -1)).to_plane([[320.0, 240.0]])


def scene_in_metres():
    """Two cables on the table that cross, and how a tilted camera with distortion sees them."""
    t = np.linspace(-0.2, 0.2, 400)
    world = [
        np.column_stack([t, 0.05 * np.sin(9 * t) + 0.02, np.zeros(400)]),
        np.column_stack([0.03 * np.cos(11 * t), 0.7 * t, np.zeros(400)]),
    ]
    camera = tilted()
    lines = [camera.project(points) for points in world]
    closed = [False, False]
    mask = render_mask(lines, [9.0, 9.0], closed, (480, 640))
    return world, camera, SyntheticScene(mask, lines, [9.0, 9.0], closed, [], [True, True])


def test_a_picture_by_a_tilted_camera_comes_back_in_metres():
    world, camera, scene = scene_in_metres()
    tracing = trace(render(scene, np.random.default_rng(3)), mask=scene.mask)
    assert len(tracing) == 2
    pixel = 0.9 / 900
    for i in range(2):
        points = tracing.points(i, camera)
        assert points.shape == (len(tracing.centrelines[i]), 3)
        errors = [
            np.hypot(*(points[:, None, :2] - truth[None, :, :2]).transpose(2, 0, 1)).min(axis=1) for truth in world
        ]
        error = min(errors, key=np.mean)
        assert error.mean() < pixel
        assert error.max() < 3 * pixel


def test_the_upper_cable_is_lifted_over_the_lower_one():
    _, camera, scene = scene_in_metres()
    tracing = trace(render(scene, np.random.default_rng(3)), mask=scene.mask)
    radius = 0.004
    (over, row), (under, other) = tracing.crossings[0].over, tracing.crossings[0].under
    upper, lower = tracing.points(over, camera, 0.01, radius), tracing.points(under, camera, 0.01, radius)
    assert upper[row, 2] - lower[other, 2] == pytest.approx(2.1 * radius)
    assert lower[:, 2] == pytest.approx(0.01)
    assert upper[[0, -1], 2] == pytest.approx(0.01)
    distance = np.sqrt(((upper[:, None] - lower[None]) ** 2).sum(axis=2)).min()
    assert distance > 2 * radius


def test_points_of_no_cable_or_radius_are_refused():
    tracing = trace_mask(make_case("loop", 2).mask)
    with pytest.raises(ValueError, match="cable must be"):
        tracing.points(1, tilted())
    with pytest.raises(ValueError, match="radius must be positive"):
        tracing.points(0, tilted(), radius=0.0)


@pytest.mark.parametrize("matrix", [None, np.array([[1000.0, 0.0, 320.0], [0.0, 1000.0, 240.0], [0.0, 0.0, 1.0]])])
@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_picture_is_one_from_above_or_from_below(matrix, up):
    pixels = np.array([(0.0, 0.0), (640.0, 0.0), (640.0, 480.0), (0.0, 480.0)])
    camera = Camera.from_points(pixels, 1e-3 * pixels * [1.0, -up], matrix=matrix)
    np.testing.assert_array_equal(camera.looks_from(pixels[:2]), [up, up])


def test_points_in_another_order_are_refused():
    pixels = np.array([(0.0, 0.0), (640.0, 0.0), (640.0, 480.0), (0.0, 480.0)])
    with pytest.raises(ValueError, match="must be in the same order"):
        Camera.from_points(pixels, 1e-3 * pixels[[0, 1, 3, 2]])
