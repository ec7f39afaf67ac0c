"""Soft shadow of a scene on a level ground."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Shadow"]

FloatArray = npt.NDArray[np.float64]

_BLURS = (0.008, 0.016, 0.028, 0.044)  # widths over the side of the ground, by height above it


class Shadow:
    """A square under the rods, clear where no shadow falls.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    cells : int
        Cells of the shadow along each side.
    """

    def __init__(self, pyvista: Any, plotter: Any, cells: int) -> None:
        self._pyvista, self._cells = pyvista, cells
        self._ground = pyvista.PolyData(np.zeros((4, 3)), [4, 0, 1, 2, 3])
        self._ground.active_texture_coordinates = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        blank = pyvista.Texture(np.zeros((cells, cells, 4), np.uint8))
        self._actor = plotter.add_mesh(self._ground, texture=blank, lighting=False, reset_camera=False)
        self._actor.ForceTranslucentOn()

    def cast(
        self, points: FloatArray, areas: FloatArray, bounds: tuple[FloatArray, FloatArray, float], extent: float
    ) -> None:
        """Lay points flat on the cells and blur them, the more the higher they are.

        Parameters
        ----------
        points : ndarray of shape (n, 3) [m]
        areas : ndarray of shape (n,) [m^2]
            Area that each point covers, seen from the side.
        bounds : (ndarray, ndarray, float) [m]
            Low and high corner of the ground, x and y, and its height.
        extent : float [m]
            Height of a point with the widest blur.
        """
        from scipy.ndimage import gaussian_filter

        low, high, height = bounds
        corners = np.column_stack([[low[0], high[0], high[0], low[0]], [low[1], low[1], high[1], high[1]]])
        self._ground.points = np.column_stack([corners, np.full(4, height)])
        cells = self._cells
        shade = np.zeros((cells, cells))
        columns, rows = np.floor((points[:, :2] - low) / (high - low) * cells).astype(np.int64).T
        inside = (columns >= 0) & (columns < cells) & (rows >= 0) & (rows < cells)
        weights = areas / np.prod((high - low) / cells)
        level = np.clip((points[:, 2] - height) / extent * len(_BLURS), 0, len(_BLURS) - 1).astype(int)
        for index, blur in enumerate(_BLURS):
            here = (level == index) & inside
            if here.any():
                cover = np.bincount(rows[here] * cells + columns[here], weights[here], cells**2).reshape(cells, cells)
                shade += gaussian_filter(cover, blur * cells, mode="constant")
        pixels = np.empty((cells, cells, 4), np.uint8)
        pixels[..., :3] = (62, 74, 86)
        pixels[..., 3] = 255.0 * 0.42 * -np.expm1(-1.4 * shade[::-1])
        texture = self._pyvista.Texture(pixels)
        texture.interpolate = True
        self._actor.texture = texture
