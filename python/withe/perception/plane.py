"""Coordinates in the plane of the cables: pixels without a camera, scaled metres with a camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from withe.perception.camera import Camera

__all__ = ["Plane"]

Array = NDArray[np.float64]


class Plane:
    """Coordinates of cables in the plane z = 0, scaled so that a unit is about a pixel.

    Parameters
    ----------
    camera : Camera or None
        None for coordinates that are pixels.
    """

    def __init__(self, camera: Camera | None) -> None:
        self.camera = camera
        self.scale = 1.0  # [px/m], or 1 without a camera

    def set_scale(self, line: Array) -> None:
        """Set the scale to the mean scale along a line, shape (n, 2) [px]."""
        if self.camera is not None:
            metric = self.camera.to_plane(line)[:, :2]
            self.scale = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) / float(
                np.linalg.norm(np.diff(metric, axis=0), axis=1).sum()
            )

    def coordinates(self, pixels: Array) -> Array:
        """Return coordinates of pixels, shape (n, 2)."""
        return pixels.copy() if self.camera is None else self.camera.to_plane(pixels)[:, :2] * self.scale

    def points(self, x: Array) -> Array:
        """Return positions in the world, shape (n, 3) [m]."""
        return np.column_stack([x / self.scale, np.zeros(len(x))])

    def pixels(self, x: Array) -> Array:
        """Return the pixels of coordinates, shape (n, 2)."""
        return x.copy() if self.camera is None else self.camera.project(self.points(x))

    def pixels_and_slopes(self, x: Array) -> tuple[Array, Array]:
        """Return the pixels of coordinates, and their derivatives by the coordinates, shape (n, 2, 2)."""
        if self.camera is None:
            return x.copy(), np.broadcast_to(np.eye(2), (len(x), 2, 2))
        count, step = len(x), 0.5
        moved = np.concatenate([x, x + np.array([step, 0.0]), x + np.array([0.0, step])])
        here, first, second = self.pixels(moved).reshape(3, count, 2)
        return here, np.stack([first - here, second - here], axis=2) / step
