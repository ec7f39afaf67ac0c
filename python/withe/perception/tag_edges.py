"""Edges of black squares in a picture, to a few hundredths of a pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["refine_square"]

Array = NDArray[np.float64]

_SAMPLES = 32  # profiles across a side
_ROUNDS = 10
_DONE = 0.003  # px
_REACH = 0.55  # relative to a cell, on both sides of an edge: the inner cells must have no influence


def refine_square(gray: NDArray[np.uint8], quad: Array, cells: int) -> Array:
    """Find the corners of a black square on white, from lines through its four sides.

    Across a side the brightness I goes from black b at -h to white w at h. The integral of (I - b) / (w - b) between
    these limits is h minus the position of the edge, if that position is 0 or if h is beyond the blur. The search is
    therefore repeated around the edges that it found. The lines through the edges meet at the corners.

    Parameters
    ----------
    gray : ndarray of shape (height, width), uint8
    quad : ndarray of shape (4, 2) [px]
        Corners, clockwise in the picture, accurate to a pixel or two.
    cells : int
        Length of a side in cells of the tag. The black border, and the white around it, are one cell wide.

    Returns
    -------
    ndarray of shape (4, 2) [px]
        Corners. They are unchanged if a side is not fully visible.
    """
    corners = quad
    for _ in range(_ROUNDS):
        lines = [_side(gray, corners[i], corners[(i + 1) % 4], cells) for i in range(4)]
        if any(line is None for line in lines):
            return quad
        found = np.array([_meet(lines[i - 1], lines[i]) for i in range(4)])
        if not np.isfinite(found).all() or np.abs(found - quad).max() > 3.0:
            return quad
        done = np.abs(found - corners).max() < _DONE
        corners = found
        if done:
            break
    return corners


def _side(gray: NDArray[np.uint8], start: Array, end: Array, cells: int) -> tuple[Array, Array] | None:
    """A point and the direction of the line through a side; None where it leaves the picture or there is no edge."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / max(length, 1e-9)
    outward = np.array([along[1], -along[0]])  # of corners clockwise, y down
    half = min(_REACH * length / cells, 3.0)
    shares = np.linspace(0.0, 1.0, _SAMPLES + 2)[1:-1]
    margin = min(half / max(length, 1e-9) + 0.02, 0.3)
    places = (margin + (1.0 - 2.0 * margin) * shares) * length
    steps = np.linspace(-half, half, int(np.ceil(8 * half)) + 1)
    points = start + places[:, None, None] * along + steps[None, :, None] * outward
    profile = _bilinear(gray, points)
    if profile is None:
        return None
    black, white = float(np.median(profile[:, 0])), float(np.median(profile[:, -1]))
    if white - black < 10.0:
        return None
    light = (profile - black) / (white - black)
    width = steps[1] - steps[0]
    area = width * (light.sum(axis=1) - 0.5 * (light[:, 0] + light[:, -1]))
    slope, offset = np.polyfit(places, half - area, 1)
    direction = along + slope * outward
    return start + offset * outward, direction / np.linalg.norm(direction)


def _bilinear(gray: NDArray[np.uint8], points: Array) -> Array | None:
    """Brightness between pixels, whose middles are at whole numbers; None outside the picture."""
    height, width = gray.shape
    x, y = points[..., 0], points[..., 1]
    if x.min() < 0.0 or y.min() < 0.0 or x.max() >= width - 1 or y.max() >= height - 1:
        return None
    left, top = x.astype(int), y.astype(int)
    right, down = x - left, y - top
    upper = (1.0 - right) * gray[top, left] + right * gray[top, left + 1]
    lower = (1.0 - right) * gray[top + 1, left] + right * gray[top + 1, left + 1]
    return np.asarray((1.0 - down) * upper + down * lower)


def _meet(first: tuple[Array, Array] | None, second: tuple[Array, Array] | None) -> Array:
    """Return the intersection of two lines; NaN if they are nearly parallel."""
    assert first is not None
    assert second is not None
    cross = first[1][0] * second[1][1] - first[1][1] * second[1][0]
    if abs(cross) < 1e-3:
        return np.full(2, np.nan)
    apart = second[0] - first[0]
    share = (apart[0] * second[1][1] - apart[1] * second[1][0]) / cross
    return np.asarray(first[0] + share * first[1])
