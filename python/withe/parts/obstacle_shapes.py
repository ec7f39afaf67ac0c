"""Tubes and fields for the engine, and the checks of rods beside them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.body_surfaces import ignored
from withe.parts.directory import Directory
from withe.parts.kinds import ObstaclePart, RodPart
from withe.solids import Field, Tube

__all__ = ["check_channels", "shape_of"]

FloatArray = npt.NDArray[np.float64]


@lru_cache(maxsize=16)
def shape_of(solid: Tube | Field) -> _core.Shape:
    """Return a solid as the engine has it."""
    if isinstance(solid, Tube):
        return _core.Tube(*solid.curves(), float(solid.radius), solid.thickness)
    low, high = np.asarray(solid.bounds, float)
    values = solid.values
    spacing = (high - low) / (np.array(values.shape) - 1)
    for axis in range(3):
        values = _spline(values, axis)
    return _core.DistanceField(values.ravel(), list(np.array(values.shape) - 2), low, spacing)


def check_channels(directory: Directory) -> None:
    """Refuse rods that do not fit the tubes in which they are drawn.

    Raises
    ------
    ValueError
        A rod inside of a tube that is no wider.
    """
    for obstacle in directory.all(ObstaclePart):
        tube = obstacle.solid
        if not isinstance(tube, Tube):
            continue
        axis = obstacle.point + tube.axis()
        for rod in directory.all(RodPart):
            radius = float(rod.contact_radius.max())
            if radius < tube.radius or ignored(directory, rod.name, obstacle.name):
                continue
            gaps = np.linalg.norm(rod.points[:, None] - axis[None], axis=2).min(axis=1)
            if (gaps < 0.9 * tube.radius).any():
                raise ValueError(
                    f"rod {rod.name!r} with a contact radius of {radius:g} m is drawn inside of {obstacle.name!r}, "
                    f"whose inner radius is {tube.radius:g} m: give a thinner rod or a wider tube, or leave the pair "
                    "out with ignore_contact"
                )


def _spline(values: FloatArray, axis: int) -> FloatArray:
    """Coefficients of the natural cubic spline through values along an axis, of which there are two more."""
    from scipy.linalg import solve_banded

    rows = np.moveaxis(values, axis, 0)
    count = len(rows)
    # (c[i - 1] + 4 c[i] + c[i + 1]) / 6 = v[i]; at both ends, without a second derivative, c = v.
    bands = np.array([[1.0], [4.0], [1.0]]) / 6.0 * np.ones(count)
    bands[0, 1] = bands[2, -2] = 0.0
    bands[1, [0, -1]] = 1.0
    inner = solve_banded((1, 1), bands, rows.reshape(count, -1)).reshape(rows.shape)
    whole = np.concatenate([2.0 * inner[:1] - inner[1:2], inner, 2.0 * inner[-1:] - inner[-2:-1]])
    return np.moveaxis(whole, 0, axis)
