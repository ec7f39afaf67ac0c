"""Disturbances of masks and pictures: ragged borders, specks and pinholes, and objects that cover a cable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["add_frays", "add_occluder", "add_specks", "strip_across"]


def add_frays(mask: NDArray[np.bool_], rng: np.random.Generator, amount: float = 1.0) -> NDArray[np.bool_]:
    """Make the border of a mask ragged: pixels within 1.5 px of it flip at random, in proportion to `amount`."""
    result = mask.copy()
    for _ in range(2):
        padded = np.pad(result, 1, mode="edge")
        near = np.zeros(mask.shape, int)
        for dy in range(3):
            for dx in range(3):
                near += padded[dy : dy + mask.shape[0], dx : dx + mask.shape[1]]
        border = (near > 0) & (near < 9)
        flip = border & (rng.random(mask.shape) < 0.18 * amount)
        result ^= flip
    return result


def add_specks(mask: NDArray[np.bool_], rng: np.random.Generator, count: int = 40) -> NDArray[np.bool_]:
    """Add small blobs to the background and pinholes to the cables."""
    result = mask.copy()
    height, width = mask.shape
    y, x = np.mgrid[:height, :width]
    for _ in range(count):
        cx, cy, radius = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.5, 3.5)
        result |= np.hypot(x - cx, y - cy) < radius
    for _ in range(count):
        cx, cy, radius = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.4, 1.2)
        result &= np.hypot(x - cx, y - cy) >= radius
    return result


def strip_across(
    line: NDArray[np.float64], at: int, length: float, reach: float, shape: tuple[int, int]
) -> NDArray[np.bool_]:
    """Pixels of a straight strip across a line.

    Parameters
    ----------
    line : ndarray of shape (n, 2) [px]
    at : int
        Row of the line in the middle of the strip, not one of the two at its ends.
    length : float [px]
        Length of the strip along the line.
    reach : float [px]
        Half width of the strip.
    shape : (int, int)
        Height and width of the picture [px].
    """
    y, x = np.mgrid[: shape[0], : shape[1]]
    tangent = line[at + 2] - line[at - 2]
    tangent /= np.hypot(*tangent)
    along = (x - line[at, 0]) * tangent[0] + (y - line[at, 1]) * tangent[1]
    across = -(x - line[at, 0]) * tangent[1] + (y - line[at, 1]) * tangent[0]
    strip: NDArray[np.bool_] = (np.abs(along) < length / 2) & (np.abs(across) < reach)
    return strip


def add_occluder(
    picture: NDArray[np.uint8], strip: NDArray[np.bool_], rng: np.random.Generator, level: float = 120, grain: float = 6
) -> NDArray[np.uint8]:
    """Cover the part `strip` of a picture by a grey object; `grain` is the standard deviation of its noise."""
    result = picture.copy()
    grey = level + rng.normal(0, grain, (int(strip.sum()), 1)) + np.zeros(3)
    result[strip] = np.clip(np.round(grey), 0, 255).astype(np.uint8)
    return result
