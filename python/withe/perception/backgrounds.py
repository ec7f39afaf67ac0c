"""Grounds for made pictures of cables: plain colours under uneven light, and planks of wood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["cast_shadow", "plain", "wood"]

Array = NDArray[np.float64]


def plain(rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Return a ground of one colour under uneven light, with a fine texture, shape (height, width, 3) [grey levels]."""
    color = 0.3 * rng.uniform(90, 225, 3) + 0.7 * rng.uniform(90, 225)
    x, y = _places(shape)
    angle = rng.uniform(0, 2 * np.pi)
    light = 1 + rng.uniform(0, 0.25) * (np.cos(angle) * x + np.sin(angle) * y)
    light += rng.uniform(-0.15, 0.05) * (x**2 + y**2)
    light *= 1 + 0.01 * _noise(rng, shape, 1.5)
    return np.asarray(color * light[..., None])


def wood(rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Return planks of wood with grain and dark seams, shape (height, width, 3) [grey levels]."""
    from scipy.ndimage import rotate

    angle = rng.uniform(0, np.pi)
    x, y = _places(shape)
    across = shape[1] * (np.cos(angle) * y * shape[0] / shape[1] - np.sin(angle) * x)
    width = rng.uniform(50, 140)
    plank = np.floor(across / width).astype(int)
    plank -= plank.min()
    tone = rng.uniform(0.8, 1.15, plank.max() + 1)[plank]
    phase = rng.uniform(0, 2 * np.pi, plank.max() + 1)[plank]
    waved = across + 8 * _noise(rng, shape, 40)
    rate = rng.uniform(0.08, 0.3)
    grain = 0.1 * np.sin(2 * rate * waved + phase) + 0.05 * np.sin(2.7 * rate * waved + 2 * phase)
    size = int(np.ceil(np.hypot(*shape)))
    fibres = rotate(_noise(rng, (size, size), (0.8, 30.0)), -np.degrees(angle), reshape=False, order=1, mode="reflect")
    top, left = (size - shape[0]) // 2, (size - shape[1]) // 2
    grain += 0.06 * fibres[top : top + shape[0], left : left + shape[1]]
    color = np.array([rng.uniform(150, 200), rng.uniform(105, 150), rng.uniform(60, 100)]) * rng.uniform(0.7, 1.15)
    picture = color * (tone * (1 + grain))[..., None]
    seams = np.abs(across / width - np.round(across / width)) * width < rng.uniform(0.8, 2)
    picture[seams] *= 0.45
    return np.asarray(picture)


def cast_shadow(
    ground: Array, mask: NDArray[np.bool_], rng: np.random.Generator, darkness: float | None = None
) -> Array:
    """Return a ground darkened by the soft shadow of the cables of a mask.

    Parameters
    ----------
    ground : ndarray of shape (height, width, 3)
    mask : ndarray of bool, shape (height, width)
    rng : numpy.random.Generator
        Random generator of the direction, length and softness of the shadow.
    darkness : float, optional
        Share of the light that the shadow takes, from 0 to 1; by default 0.3 to 0.6 at random.
    """
    from scipy.ndimage import gaussian_filter, shift

    length, angle = rng.uniform(3, 12), rng.uniform(0, 2 * np.pi)
    moved = shift(mask.astype(float), length * np.array([np.sin(angle), np.cos(angle)]), order=1)
    soft = gaussian_filter(moved, rng.uniform(1.5, 5))
    share = rng.uniform(0.3, 0.6) if darkness is None else darkness
    return np.asarray(ground * (1 - share * soft)[..., None])


def _places(shape: tuple[int, int]) -> tuple[Array, Array]:
    """Return x and y of the pixels from -1/2 to 1/2."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return x / shape[1] - 0.5, y / shape[0] - 0.5


def _noise(rng: np.random.Generator, shape: tuple[int, int], sigma: float | tuple[float, float]) -> Array:
    """Return smooth noise of unit variance."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(rng.standard_normal(shape), sigma)
    return np.asarray(noise / noise.std())
