"""Search of a mask along the normals of a centreline, and beyond its ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sightings", "end_of_mask", "search_normals"]

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

_SAME = 2.0  # greatest difference of a cross-section from the width of a cable of which it is the whole [px]
_WIDEST = 2.6  # greatest width of a cross-section that determines a centre, relative to the width of the cable
_NARROWEST = 0.35
_FINE = 2  # samples per pixel beyond an end
_ACROSS = np.array([-0.3, -0.15, 0.0, 0.15, 0.3])  # places across the end of a cable, relative to the width
_RAGGED = 3.0  # greatest distance of a border of an end from that on the middle line [px]
_ONE_BORDER = 0.3  # weight of a centre that follows from one border only


@dataclass
class Sightings:
    """Possible centres of a cable on normals of its predicted centreline.

    Attributes
    ----------
    row : ndarray of int, shape (centres,)
        Number of the normal.
    offset : ndarray of shape (centres,) [px]
        Offset of the centre along the normal.
    weight : ndarray of shape (centres,)
        1 where both borders are seen, less where one is seen.
    """

    row: NDArray[np.intp]
    offset: Array
    weight: Array


def _values(mask: Mask, points: Array) -> NDArray[np.bool_]:
    """Values of a mask at points, shape (..., 2); False outside."""
    height, width = mask.shape
    x, y = np.rint(points[..., 0]).astype(np.intp), np.rint(points[..., 1]).astype(np.intp)
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    x[~inside] = 0
    y[~inside] = 0
    return np.asarray((mask[y, x] != 0) & inside)


def search_normals(
    mask: Mask, covered: Mask | None, points: Array, normals: Array, reach: int, width: float
) -> Sightings:
    """Find possible centres of a cable on each normal.

    A run of the mask along a normal that is as wide as the cable has its centre in the middle. Another run has two
    possible centres, half a width from either border: a wider run shows a second cable beside this cable, and a
    narrower run is covered in part. A border of a run beside a covered pixel is not a border of the cable.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
    covered : ndarray of uint8, shape (height, width), or None
        Pixels where something may cover the cable.
    points, normals : ndarray of shape (samples, 2) [px]
    reach : int [px]
        Greatest offset.
    width : float [px]
        Width of the cable.
    """
    steps = np.arange(-reach, reach + 1)
    places = points[:, None] + steps[None, :, None] * normals[:, None]
    seen = _values(mask, places)
    padded = np.zeros((len(points), len(steps) + 2), np.int8)
    padded[:, 1:-1] = seen
    change = np.diff(padded, axis=1)
    rows, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[1] - 1
    left, right = steps[first] - 0.5, steps[last] + 0.5
    across = right - left
    has_left, has_right = first > 0, last < len(steps) - 1
    if covered is not None:
        behind = _values(covered, places)
        has_left &= ~behind[rows, np.maximum(first - 1, 0)]
        has_right &= ~behind[rows, np.minimum(last + 1, len(steps) - 1)]
    whole = has_left & has_right & (np.abs(across - width) <= max(_SAME, 0.25 * width))
    usable = (across <= _WIDEST * width) & (across >= _NARROWEST * width) & ~whole
    good = np.concatenate([whole, usable & has_left, usable & has_right])
    return Sightings(
        np.concatenate([rows, rows, rows])[good],
        np.concatenate([0.5 * (left + right), left + 0.5 * width, right - 0.5 * width])[good],
        np.repeat([1.0, _ONE_BORDER, _ONE_BORDER], len(rows))[good],
    )


def end_of_mask(mask: Mask, end: Array, direction: Array, reach: int, width: float) -> float:
    """Return how far the mask continues beyond the end of a centreline [px].

    The value is a mean over parallel lines within the cable, so that it is finer than a pixel. It is negative if the
    mask ends before the end. It is NaN if the mask does not show the centreline before its end, or continues beyond the
    reach.
    """
    steps = np.arange(-reach * _FINE, reach * _FINE + 1) / _FINE
    middle = reach * _FINE
    across = width * _ACROSS[:, None] * np.array([-direction[1], direction[0]])
    seen = _values(mask, end + across[:, None] + steps[None, :, None] * direction)
    padded = np.zeros((len(across), len(steps) + 2), np.int8)
    padded[:, 1:-1] = seen
    change = np.diff(padded, axis=1)
    begins, ends = change[:, : middle + 1] == 1, change == -1
    begun = begins.any(axis=1)
    begin = middle - np.argmax(begins[:, ::-1], axis=1)  # of the last run that begins before the end
    ends &= np.arange(ends.shape[1]) > begin[:, None]
    last = np.argmax(ends, axis=1) - 1
    good = begun & (last < len(steps) - 1)
    if not good[len(_ACROSS) // 2]:
        return np.nan
    middle_line = steps[last[len(_ACROSS) // 2]]
    found = steps[last[good]]
    return float(found[np.abs(found - middle_line) < _RAGGED].mean()) + 0.5 / _FINE
