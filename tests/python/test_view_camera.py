"""Pictures by a camera of given pose and matrix: pixels are where its `project` says, and metres come back."""

import numpy as np
import pytest
from matplotlib.image import imread

import withe
from withe.perception import Camera, trace_mask

pytest.importorskip("pyvista")

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
SIZE = (640, 480)
HEIGHT = 0.05


def looking_at(target, place, roll, matrix):
    forward = np.subtract(target, place)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (np.sin(roll), np.cos(roll), 0.3))
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Camera(matrix, rotation=rotation, translation=-rotation @ place)


def curved_record(radius):
    s = np.linspace(-1, 1, 41)
    points = np.stack([0.1 * s, 0.04 * np.sin(2.5 * s), np.full_like(s, HEIGHT)], axis=1)
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_rod(points=points, radius=radius, material=RUBBER, name="rope")
    return scene.build(time_step=1e-3).run(duration=1e-3, progress=False)


def silhouette(record, camera, path):
    """Share of each pixel that the rod covers: nothing else differs from the background."""
    record.picture(path, camera=camera, size=SIZE)
    pixels = imread(path)[..., :3]
    return np.clip(np.abs(pixels - pixels[0, 0]).max(axis=2) / 0.5, 0.0, 1.0)


def centre_near(cover, pixel, across, reach):
    """The middle of what is covered on a line across the rod [px], and how much that is."""
    way = np.linspace(-reach, reach, 40 * int(reach) + 1)
    x, y = pixel[0] + way * across[0], pixel[1] + way * across[1]
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = x - i, y - j
    value = (1 - b) * ((1 - a) * cover[j, i] + a * cover[j, i + 1])
    value += b * ((1 - a) * cover[j + 1, i] + a * cover[j + 1, i + 1])
    return float((value * way).sum() / value.sum()), float(value.sum() * (way[1] - way[0]))


@pytest.mark.parametrize(
    "camera",
    [
        looking_at((0, 0, 0.05), (0.0, 0.0, 0.5), 0.3, [[900, 0, 319.5], [0, 900, 239.5], [0, 0, 1]]),
        looking_at((0, 0, 0.05), (0.25, -0.2, 0.4), 0.8, [[900, 15, 300.2], [0, 780, 260.7], [0, 0, 1]]),
    ],
    ids=["above", "aside, with skew and a middle of its own"],
)
def test_projected_nodes_lie_in_the_middle_of_what_is_drawn(camera, tmp_path):
    radius = 2e-3
    record = curved_record(radius)
    nodes = record.positions("rope")[-1]
    cover = silhouette(record, camera, tmp_path / "rope.png")
    pixels = camera.project(nodes)
    assert pixels.min() > 20
    assert (pixels < np.array(SIZE) - 20).all()  # all in view
    for i in range(3, len(nodes) - 3):
        along = pixels[i + 1] - pixels[i - 1]
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        off, width = centre_near(cover, pixels[i], across, 16)
        assert abs(off) < 0.5
        # Points one radius aside of the line of sight, across the rod, are at its rim.
        tangent, sight = nodes[i + 1] - nodes[i - 1], nodes[i] + camera.rotation.T @ camera.translation
        rim = radius * np.cross(tangent, sight) / np.linalg.norm(np.cross(tangent, sight))
        rims = camera.project(nodes[i] + np.array([1, -1])[:, None] * rim)
        assert width == pytest.approx(abs((rims[0] - rims[1]) @ across), abs=1.5)


def test_a_picture_is_read_back_in_metres(tmp_path):
    camera = looking_at((0, 0, 0.05), (0.15, -0.2, 0.4), 0.5, [[900, 0, 310.0], [0, 850, 250.0], [0, 0, 1]])
    record = curved_record(2e-3)
    tracing = trace_mask(silhouette(record, camera, tmp_path / "rope.png") > 0.5)
    (line,) = tracing.centrelines
    metres = camera.to_plane(line, HEIGHT)
    nodes = record.positions("rope")[-1]
    fine = np.stack([np.interp(np.linspace(0, 40, 4001), np.arange(41), x) for x in nodes.T], axis=1)
    apart = np.linalg.norm(metres[:, None] - fine[None], axis=2).min(axis=1)
    pixel = 0.5 / 850  # [m] at that distance
    assert np.median(apart) < pixel
    assert apart.max() < 3 * pixel


def test_cameras_without_a_pose_with_a_lens_or_the_rods_behind_them_are_refused(tmp_path):
    record, matrix = curved_record(2e-3), [[900, 0, 320], [0, 900, 240], [0, 0, 1]]
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    for camera, message in [
        (Camera(matrix, distortion=[0.1, 0, 0, 0], translation=(0, 0, 1)), "distortion of the camera must be zero"),
        (Camera.from_points(100 * corners + 50, corners), "camera must have a pose"),
        (Camera(matrix, translation=(0, 0, -1)), "camera must see the rods"),
    ]:
        with pytest.raises(ValueError, match=message):
            record.picture(tmp_path / "none.png", camera=camera, size=SIZE)
