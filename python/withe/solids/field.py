"""Solids that are given by a signed distance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.surface_nets import surface_net

__all__ = ["Field"]

FloatArray = npt.NDArray[np.float64]

# Points of the grid along the longest side, and in all.
_POINTS = 97
_MOST = 20_000_000
# Deviation of the gradient from 1 that most of the points near the surface may have.
_MOST_OFF = 0.1


@dataclass(frozen=True, eq=False)
class Field:
    """A solid by its signed distance: positive outside, zero on the surface, negative inside.

    The distance is kept on a grid, and is a cubic spline between the points of the grid. Rods touch the smooth surface
    of this spline, so details below some three spacings are rounded. Edges of rods should be shorter than the details.

    Parameters
    ----------
    distance : callable, or array_like of shape (nx, ny, nz) [m]
        The function ``f(points)``, with points of shape (n, 3) [m], returns n distances. An array has the distances at
        the points of a grid that fills the bounds, with indices along x, y and z.
    bounds : array_like of shape (2, 3) [m]
        Lowest and highest corner of the grid. Beyond it the distance goes on linearly, so leave some radii of a rod
        around the surface.
    spacing : float [m]
        Distance of the grid's points. By default the longest side has 97 points. An array has its own.

    Raises
    ------
    ValueError
        Distances that are not finite, no surface within the bounds, or a gradient that differs from 1 by more than a
        tenth at one of ten points near the surface. Divide such a function by the length of its gradient.

    See Also
    --------
    Scene.add_obstacle : Add the field to a scene.
    Tube : A tube about a curved axis.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> ring = withe.solids.Field(
    ...     lambda p: np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.03, p[:, 2]) - 0.01,
    ...     bounds=[(-0.05, -0.05, -0.02), (0.05, 0.05, 0.02)],
    ... )
    >>> ring.values.shape
    (97, 97, 40)
    """

    distance: Callable[[FloatArray], npt.ArrayLike] | npt.ArrayLike
    bounds: npt.ArrayLike
    spacing: float | None = None

    def __post_init__(self) -> None:
        bounds = validation.number_array(self.bounds, "bounds of the field", (2, 3))
        if not (bounds[1] > bounds[0]).all():
            raise ValueError(f"bounds of the field must be a lowest and a highest corner, got {bounds.tolist()}")
        values = self._sampled(bounds) if callable(self.distance) else self._given()
        _check(values, bounds)
        object.__setattr__(self, "bounds", bounds)
        object.__setattr__(self, "_values", values)

    @property
    def values(self) -> FloatArray:
        """Distances at the points of the grid, shape (nx, ny, nz) [m]."""
        return cast(FloatArray, self.__dict__["_values"]).copy()

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        low, high = np.asarray(self.bounds, float)
        return surface_net(self.__dict__["_values"], low, high)

    def _sampled(self, bounds: FloatArray) -> FloatArray:
        """Distances by the function."""
        sides = bounds[1] - bounds[0]
        if self.spacing is None:
            spacing = sides.max() / (_POINTS - 1)
        else:
            spacing = validation.positive(self.spacing, "spacing of the field")
        counts = np.maximum(np.ceil(sides / spacing - 1e-9).astype(int) + 1, 4)
        if np.prod(counts.astype(float)) > _MOST:
            raise ValueError(
                f"spacing of the field would need {np.prod(counts.astype(float)):.3g} points, more than {_MOST:,}: "
                "give a greater spacing or smaller bounds"
            )
        axes = [np.linspace(low, high, n) for low, high, n in zip(bounds[0], bounds[1], counts, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        function = cast("Callable[[FloatArray], npt.ArrayLike]", self.distance)
        values = np.asarray(function(points), dtype=float)
        if values.shape != (len(points),):
            raise ValueError(
                f"distance of the field must return one number for each point, shape ({len(points)},), got shape "
                f"{values.shape}"
            )
        if not np.isfinite(values).all():
            place = points[int(np.argmin(np.isfinite(values)))]
            raise ValueError(f"distance of the field is not finite at ({', '.join(f'{x:.4g}' for x in place)}) m")
        return values.reshape(counts)

    def _given(self) -> FloatArray:
        """Distances that were given."""
        if self.spacing is not None:
            raise ValueError("spacing of the field must be None beside an array, whose points fill the bounds")
        values = validation.number_array(self.distance, "distance of the field", ("nx", "ny", "nz"))
        if min(values.shape) < 4:
            raise ValueError(f"distance of the field must have four points and more each way, got {values.shape}")
        return values


def _check(values: FloatArray, bounds: FloatArray) -> None:
    """Refuse distances without a surface, or that are no distances."""
    if not (values.min() < 0.0 < values.max()):
        side = "outside of" if values.min() >= 0.0 else "inside"
        raise ValueError(f"the field has no surface within its bounds: all of its points lie {side} the solid")
    spacing = (bounds[1] - bounds[0]) / (np.array(values.shape) - 1)
    slopes = [np.asarray(each, float) for each in np.gradient(values, *spacing, edge_order=2)]
    slope = np.linalg.norm(np.stack(slopes), axis=0)
    near = slope[(values >= 0.0) & (values <= 3.0 * spacing.max())]
    off = float(np.quantile(np.abs(near - 1.0), 0.9)) if near.size else 0.0
    if off > _MOST_OFF:
        raise ValueError(
            f"distance of the field must be a distance, with a gradient of length 1. Near the surface the length is "
            f"{np.median(near):.3g} in the median, and differs from 1 by {off:.2g} and more at a tenth of the points. "
            "Divide the function by the length of its gradient, or measure the distance from the surface"
        )
