"""Friction that varies: along a rod, edge by edge, or over the surface of an obstacle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation

__all__ = ["FrictionField", "FrictionMap", "edge_shares", "field_shares"]

FloatArray = npt.NDArray[np.float64]
FrictionField = Callable[[FloatArray], npt.ArrayLike]


@dataclass(frozen=True, eq=False)
class FrictionMap:
    """Friction over a floor, from an image of it: linear between the middles of pixels, and constant beyond the last.

    Parameters
    ----------
    image : array_like of shape (rows, columns) [-]
        Coefficients, as `matplotlib.pyplot.imshow` shows them from above: x to the right, y up, the first row on top.
    extent : sequence of four floats [m]
        Left, right, bottom and top of the image.

    Raises
    ------
    ValueError
        No image, a coefficient that is negative or not finite, or an extent that encloses nothing.

    Examples
    --------
    >>> import withe
    >>> scene = withe.Scene()
    >>> table = withe.FrictionMap([[0.1, 0.5]], extent=(0, 1, 0, 1))
    >>> round(float(table([(0.5, 0.2, 0.0)])[0]), 3)
    0.3
    >>> floor = scene.add_floor(friction=table)
    """

    image: npt.ArrayLike
    extent: Sequence[float]

    def __post_init__(self) -> None:
        image = np.array(self.image, float)
        if image.ndim != 2 or image.size == 0:
            raise ValueError(f"image of friction must have shape (rows, columns), got {image.shape}")
        if not np.all(np.isfinite(image) & (image >= 0.0)):
            raise ValueError(
                f"image of friction must be finite and not negative, got {image.min():g} to {image.max():g}"
            )
        left, right, bottom, top = validation.number_array(self.extent, "extent of friction", (4,))
        if not (left < right and bottom < top):
            raise ValueError(f"extent of friction must be left < right, bottom < top, got {tuple(self.extent)}")
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "extent", (float(left), float(right), float(bottom), float(top)))

    def __call__(self, points: npt.ArrayLike) -> FloatArray:
        """Coefficients at points of shape (n, 2) or (n, 3) [m]."""
        from scipy.ndimage import map_coordinates

        image, (left, right, bottom, top) = np.asarray(self.image, float), self.extent
        rows, columns = image.shape
        x, y = np.asarray(points, float).T[:2]
        place = [rows * (top - y) / (top - bottom) - 0.5, columns * (x - left) / (right - left) - 0.5]
        found: FloatArray = map_coordinates(image, place, order=1, mode="nearest")
        return found


def edge_shares(values: FloatArray, closed: bool) -> FloatArray:
    """Numbers of edges as the engine takes them: those of nodes, means of the edges beside them, then theirs."""
    before, behind = (np.roll(values, 1), values) if closed else (np.r_[values[:1], values], np.r_[values, values[-1:]])
    return np.concatenate([0.5 * (before + behind), values])


def field_shares(field: FrictionField, nodes: FloatArray, closed: bool, what: str) -> FloatArray:
    """A field at the nodes of a rod, then in the middles of its edges.

    Raises
    ------
    ValueError
        Not one number a point, or one that is negative or not finite.
    """
    ends = np.roll(nodes, -1, axis=0) if closed else nodes[1:]
    points = np.concatenate([nodes, 0.5 * (nodes[: len(ends)] + ends)])
    found = field(points.copy())
    try:
        given = np.asarray(found, float)
    except (TypeError, ValueError):
        raise ValueError(f"{what} must return numbers, got {found!r:.80}") from None
    if given.ndim == 0:
        given = np.broadcast_to(given, (len(points),))
    if given.shape != (len(points),):
        raise ValueError(f"{what} must return one number per point, of shape ({len(points)},), got {given.shape}")
    wrong = np.flatnonzero(~(np.isfinite(given) & (given >= 0.0)))
    if len(wrong):
        x, y, z = points[wrong[0]]
        raise ValueError(f"{what} must be finite and not negative, got {given[wrong[0]]:g} at ({x:g}, {y:g}, {z:g})")
    return np.array(given)
