"""Floors and other planes in rendered pictures. They fade into the background, and a level one shows shadows."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["BACKGROUND", "Floor", "add_faded_patch"]

FloatArray = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.floating[Any]]

BACKGROUND = "#f5f7f9"
_FLOOR = (226.0, 232.0, 237.0)  # red, green, blue of 255
_SHADOW = (62.0, 74.0, 86.0)
_DARKEST = 0.42  # share of the shadow's colour where it is deepest
_REACH = 1.1  # distance of the rim of a floor from what is in view, over the extent of the scene
_WHOLE = 0.4  # share of the radius within which a floor has its full colour
_PATCH_CELLS = 256
_BLURS = (0.008, 0.016, 0.028, 0.044)  # standard deviations over the side of the square, by height above the floor
_LARGEST_PRODUCT = 1 << 18  # multiplications that OpenBLAS does not share among threads
_SQUARE, _FACE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([4, 0, 1, 2, 3])
_BEYOND = 0.15  # margin of the shadow around what casts it, over the extent of the scene


class Floor:
    """A level floor that fades into the background, and the shadow of what is above it.

    Everything is opaque, because a software renderer takes three times as long for translucent surfaces. The shadow is
    the texture of a square in the middle; eight faces around the square are the rest of the floor.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    cells : int
        Cells of the shadow along each side.
    """

    def __init__(self, pyvista: Any, plotter: Any, cells: int) -> None:
        self._pyvista, self._cells = pyvista, cells
        first = np.array([4 * row + column for row in range(3) for column in range(3) if (row, column) != (1, 1)])
        faces = np.column_stack([np.full(8, 4), first, first + 1, first + 5, first + 4])
        self._rest, _ = _add(pyvista, plotter, np.zeros((16, 3)), faces, np.zeros((16, 2)), _colours(_disc()))
        self._bare = np.zeros((cells, cells, 3), np.float32)
        self._square, self._actor = _add(pyvista, plotter, np.zeros((4, 3)), _FACE, _SQUARE, self._bare)
        self._blurs = [_blur(share * cells, cells) for share in _BLURS]

    def place(self, points: FloatArray, height: float, extent: float) -> None:
        """Lay the floor under a scene.

        Parameters
        ----------
        points : ndarray of shape (points, 3) [m]
            Everything in view.
        height : float [m]
        extent : float [m]
            Diagonal of the scene, which is also the height of a point with the widest blur.
        """
        self._height, self._extent = height, extent
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        middle, half = 0.5 * (low + high), 0.5 * float((high - low).max()) + _BEYOND * extent
        radii = 0.5 * (high - low) + _REACH * extent
        self._low, self._side = middle - half, 2.0 * half

        ticks = middle + np.outer((-1.0, 0.0, 0.0, 1.0), radii) + np.outer((0.0, -1.0, 1.0, 0.0), (half, half))
        x, y = np.meshgrid(ticks[:, 0], ticks[:, 1])
        corners = np.column_stack([x.ravel(), y.ravel(), np.full(16, height)])
        self._rest.points = corners
        self._rest.active_texture_coordinates = 0.5 + 0.5 * (corners[:, :2] - middle) / radii
        self._square.points = np.column_stack([self._low + self._side * _SQUARE, np.full(4, height)])
        along = self._low[:, None] + self._side * (np.arange(self._cells) + 0.5) / self._cells
        x, y = (along - middle[:, None]) / radii[:, None]
        self._bare = _colours(np.hypot(x[None], y[::-1, None]))

    def lift(self, height: float) -> None:
        """Move the floor to another height [m]."""
        if height == self._height:
            return
        self._height = height
        for mesh in (self._rest, self._square):
            mesh.points = np.column_stack([mesh.points[:, :2], np.full(mesh.n_points, height)])

    def cast(self, points: FloatArray, areas: FloatArray) -> None:
        """Show the shadow of points: what they cover, laid flat on a grid and blurred, the more the higher they are.

        Parameters
        ----------
        points : ndarray of shape (points, 3) [m]
        areas : ndarray of shape (points,) [m^2]
            Area of the surface around each point, seen from above.
        """
        count = self._cells
        places = ((points[:, :2] - self._low) / self._side * count).astype(int)
        inside = ((places >= 0) & (places < count)).all(axis=1)
        columns, rows = places[inside].T
        levels = (points[inside, 2] - self._height) / self._extent * len(_BLURS)
        levels = np.clip(levels, 0.0, len(_BLURS) - 1.0)
        shade = np.zeros((count, count), np.float32)
        if inside.any():  # products of the covered part alone, which is a small part of the grid
            left, right, low, high = columns.min(), columns.max() + 1, rows.min(), rows.max() + 1
            shape = high - low, right - left
            cells = (rows - low) * shape[1] + columns - left
        for level, blur in enumerate(self._blurs):
            shares = np.maximum(1.0 - np.abs(levels - level), 0.0)  # between two levels, a part of both
            if shares.any():
                cover = np.bincount(cells, shares * areas[inside], shape[0] * shape[1]).reshape(shape)
                shade += _product(blur[:, low:high], _product(cover.astype(np.float32), blur[left:right]))
        shade *= (count / self._side) ** 2
        dark = -_DARKEST * np.expm1(-1.4 * shade[::-1, :, None])
        self._actor.texture = _texture(self._pyvista, self._bare + dark * (np.array(_SHADOW, np.float32) - self._bare))


def add_faded_patch(pyvista: Any, plotter: Any, corners: FloatArray) -> Any:
    """Add a square that fades towards its rim, such as a slope or a wall; corners of shape (4, 3) [m].

    Other planes and solids are seen through its rim, which is therefore translucent.
    """
    opacity = 255.0 * _share(_disc())[..., None]
    pixels = np.concatenate([np.broadcast_to(_FLOOR, (*opacity.shape[:2], 3)), opacity], axis=2)
    _, actor = _add(pyvista, plotter, corners, _FACE, _SQUARE, pixels)
    actor.ForceTranslucentOn()
    return actor


def _add(
    pyvista: Any, plotter: Any, corners: FloatArray, faces: npt.NDArray[Any], places: FloatArray, pixels: Pixels
) -> tuple[Any, Any]:
    """Add faces with a texture; return their mesh and their actor."""
    mesh = pyvista.PolyData(corners, faces.ravel())
    mesh.active_texture_coordinates = places
    return mesh, plotter.add_mesh(mesh, texture=_texture(pyvista, pixels), lighting=False, reset_camera=False)


def _texture(pyvista: Any, pixels: Pixels) -> Any:
    texture = pyvista.Texture((pixels + 0.5).astype(np.uint8))
    texture.interpolate = True
    texture.SetEdgeClamp(True)  # else opposite edges mix
    return texture


def _disc() -> FloatArray:
    """Distance from the middle of a patch over its radius, shape (cells, cells)."""
    along = 2.0 * (np.arange(_PATCH_CELLS) + 0.5) / _PATCH_CELLS - 1.0
    return np.asarray(np.hypot(along[None], along[:, None]), np.float64)


def _share(distance: FloatArray) -> FloatArray:
    """Share of a floor's own colour at distances from its middle over its radius."""
    left = np.clip((1.0 - distance) / (1.0 - _WHOLE), 0.0, 1.0)
    return np.asarray(left**3 * (10.0 - 15.0 * left + 6.0 * left**2), np.float64)


def _colours(distance: FloatArray) -> npt.NDArray[np.float32]:
    """Colours of a floor at distances from its middle over its radius, shape (..., 3)."""
    paper = np.array([int(BACKGROUND[place : place + 2], 16) for place in (1, 3, 5)], float)
    return np.asarray(paper + _share(distance)[..., None] * (np.array(_FLOOR) - paper), np.float32)


def _product(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the product of two matrices, by parts of the first that BLAS multiplies without threads of its own.

    Such threads spin between products: a shadow would take six times the processor time.
    """
    rows = max(1, _LARGEST_PRODUCT // b.size)
    return np.concatenate([a[first : first + rows] @ b for first in range(0, len(a), rows)])


def _blur(sigma: float, count: int) -> npt.NDArray[np.float32]:
    """Matrix that blurs the rows of a grid of some cells by a Gaussian; nothing comes in from outside."""
    apart = np.subtract.outer(np.arange(count), np.arange(count)) / sigma
    return np.asarray(np.exp(-0.5 * apart**2) / (sigma * np.sqrt(2.0 * np.pi)), np.float32)
