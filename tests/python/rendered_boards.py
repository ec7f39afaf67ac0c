"""Pictures of calibration boards, by a known camera with lens distortion."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

MATRIX = np.array([[620.0, 0.0, 325.0], [0.0, 615.0, 236.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.16, 0.04, 0.001, -0.0008, 0.0])
SIZE = (640, 480)  # width and height [px]
_PIXELS = 40  # of the drawing per square
_FINE = 2  # samples per pixel and axis


@lru_cache(maxsize=2)
def directions(size, matrix, distortion):
    """Directions x/z, y/z of the samples of all pixels, by a fixed point of the distortion."""
    shift = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    columns, rows = ((np.arange(count)[:, None] + shift).ravel() for count in size)
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    (fx, _, cx), (_, fy, cy), _ = matrix
    k1, k2, p1, p2, k3 = distortion
    distorted = (pixels - [cx, cy]) / [fx, fy]
    ideal = distorted.copy()
    for _ in range(15):
        x, y = ideal.T
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        sideways = np.column_stack(
            [2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y]
        )
        ideal = (distorted - sideways) / radial[:, None]
    return ideal


def picture_of(board, rotation, translation, random=None, matrix=MATRIX, distortion=DISTORTION, size=SIZE):
    """Picture of a board whose first square begins at the origin of its axes: a mean over samples of each pixel."""
    import cv2

    drawing = board.picture(_PIXELS)
    rays = directions(size, tuple(map(tuple, matrix)), tuple(distortion))
    rays = np.column_stack([rays, np.ones(len(rays))]) @ rotation  # in the axes of the board
    eye = -rotation.T @ translation
    depth = -eye[2] / rays[:, 2]
    place = (eye + depth[:, None] * rays)[:, :2]
    at = (place / board.square + 1.0) * _PIXELS - 0.5
    shape = (_FINE * size[1], _FINE * size[0], 2)
    at = np.where((depth > 0.0)[:, None], at, -1e3).reshape(shape).astype(np.float32)
    grey = cv2.remap(drawing, at[..., 0], at[..., 1], cv2.INTER_LINEAR, None, cv2.BORDER_CONSTANT, 90)
    grey = cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(float)
    if random is not None:
        grey += random.normal(0.0, 2.0, grey.shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)


def poses(board, count, random):
    """Poses in which the board is tilted and fills much of the picture."""
    wide, high = board.columns * board.square, board.rows * board.square
    for _ in range(count):
        tilt = Rotation.from_euler("xyz", random.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3])).as_matrix()
        middle = np.array([random.uniform(-0.12, 0.12) * wide, random.uniform(-0.1, 0.1) * high, 1.35 * wide])
        yield tilt, middle - tilt @ np.array([0.5 * wide, 0.5 * high, 0.0])


def pictures(board, count=8, seed=0):
    """Pictures of a board from random directions."""
    random = np.random.default_rng(seed)
    return [picture_of(board, rotation, place, random) for rotation, place in list(poses(board, count, random))]
