"""Equilibria of a sheet that lies on a table and is lifted by one edge, exactly."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from withe._core import SheetManifold
from withe.common import validation

__all__ = ["Elastica", "elastica"]

FloatArray = npt.NDArray[np.float64]
_LEAST_SHARE = 500  # poses that are worth a thread of their own


@dataclass(frozen=True)
class Elastica:
    """How a sheet hangs, pose by pose. All arrays have the shape of what was asked for.

    Where `valid` is False the other numbers are NaN, and `stable` is False.

    Attributes
    ----------
    x, z : ndarray [Lgb]
        How far the tip is back from where it lay in the flat sheet, and up from the table.
    angle : ndarray [rad]
        Of the tangent at the tip above the direction in which the sheet leaves the table.
    suspended : ndarray [Lgb]
        Length that is lifted.
    normal_force, tangential_force : ndarray [w Lgb]
        Of the table on the sheet at the lift-off point: upwards, and in the direction in which the sheet leaves
        (positive where the sheet is pushed together, negative where it is pulled taut).
    force_ratio : ndarray
        Size of the tangential force over the normal one. The sheet behind the lift-off point presses on the table
        too: a sheet of length L slips where the tangential force exceeds
        friction * (normal_force + L - suspended).
    max_curvature : ndarray [1/Lgb]
        Greatest size of the curvature.
    valid : ndarray of bool
        Whether there is such a pose; `elastica` says what is refused.
    stable : ndarray of bool
        Whether it is a minimum of the energy while the jaw holds position and angle.
    """

    x: FloatArray
    z: FloatArray
    angle: FloatArray
    suspended: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    force_ratio: FloatArray
    max_curvature: FloatArray
    valid: npt.NDArray[np.bool_]
    stable: npt.NDArray[np.bool_]


@cache
def _manifold() -> SheetManifold:
    return SheetManifold()


def elastica(
    x: npt.ArrayLike | None = None,
    z: npt.ArrayLike | None = None,
    *,
    length: npt.ArrayLike | None = None,
    angle: npt.ArrayLike | None = None,
    tip_moment: float = 0.0,
    width_growth: float = 0.0,
) -> Elastica:
    """Find how the lifted part of a sheet hangs from a jaw.

    The sheet leaves the flat table without curvature (a table only pushes); the jaw holds its tip with a given moment.
    In units of Lgb and w, with W the weight of the part before s and b the width relative to the tip's,

        theta' = m / (2 b),  m' = (R - W) cos(theta) - T sin(theta),  theta(0) = m(0) = 0,  m(suspended) = tip_moment

    (dissertation, (7.6), with the condition at the lift-off point that it lacks), solved by multiple shooting with
    exact derivatives. Of several equilibria at one position it is the one that is reached from the flat sheet without
    a jump, the only one with theta >= 0 all along.

    Parameters
    ----------
    x, z : array_like, broadcast together [Lgb]
        The tip's way back and up from where it lay in the flat sheet.
    length, angle : array_like, broadcast together [Lgb], [rad]
        Instead of x and z: lifted length, .05 to 6.84, and the angle at the tip. Poses depend smoothly on these;
        on x and z they depend steeply near x = 0.
    tip_moment : float [w Lgb^2]
        Of the jaw on the sheet: twice the curvature at the tip, in 1/Lgb, that it makes there.
    width_growth : float [1/Lgb]
        The width is 1 + width_growth * (distance from the tip) times that at the tip, and w the weight per length
        there: a square folded over its diagonal widens from the jaw on.

    Returns
    -------
    Elastica
        Refused (`valid` False) are positions that need a lifted length outside .958 to 6.84 Lgb, where x and z do not
        name one pose, tips below the table, sheets that touch the table elsewhere or bend below it, and taut
        sheets, pulled back by more than 40 w Lgb. By length and angle also what has the direction of such taut
        sheets: strips shorter than .9 Lgb that are lifted by only a few hundredths of a radian.

    Raises
    ------
    ValueError
        Not numbers, not finite, shapes that do not broadcast, or neither x and z nor length and angle; width_growth
        negative.

    Examples
    --------
    >>> import withe
    >>> withe.folding.elastica([3.0, 50.0], 2.25).valid
    array([ True, False])
    """
    by_position = x is not None and z is not None and length is None and angle is None
    by_length = x is None and z is None and length is not None and angle is not None
    if not by_position and not by_length:
        raise ValueError("elastica needs x and z, or length and angle")
    names = ("x", "z") if by_position else ("length", "angle")
    first, second = _broadcast(names, (x, z) if by_position else (length, angle))
    moment = validation.number(tip_moment, "tip_moment")
    growth = validation.non_negative(width_growth, "width_growth")
    manifold = _manifold()
    solve = manifold.at_position if by_position else manifold.at_length_and_angle
    parts = max(1, min(os.cpu_count() or 1, first.size // _LEAST_SHARE))
    shares = zip(np.array_split(first.ravel(), parts), np.array_split(second.ravel(), parts), strict=True)
    with ThreadPoolExecutor(parts) as pool:  # the engine releases the interpreter
        rows = np.concatenate(list(pool.map(lambda share: solve(share[0], share[1], growth, moment), shares)))
    return _described(rows, first.shape)


def _broadcast(names: tuple[str, str], values: tuple[Any, Any]) -> tuple[FloatArray, FloatArray]:
    arrays = []
    for name, value in zip(names, values, strict=True):
        ndim = np.ndim(value)
        arrays.append(validation.number_array(value, name, tuple(f"n{i}" for i in range(ndim))))
    try:
        first, second = np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise ValueError(f"{names[0]} and {names[1]} must have shapes that broadcast, got {shapes}") from None
    return first, second


def _described(rows: FloatArray, shape: tuple[int, ...]) -> Elastica:
    valid = rows[:, 7] > 0
    columns = [np.where(valid, rows[:, i], np.nan).reshape(shape) for i in range(7)]
    x, z, angle, suspended, normal, tangential, curvature = columns
    return Elastica(
        x=x,
        z=z,
        angle=angle,
        suspended=suspended,
        normal_force=normal,
        tangential_force=tangential,
        force_ratio=np.asarray(np.abs(tangential) / normal),
        max_curvature=curvature,
        valid=valid.reshape(shape),
        stable=(valid & (rows[:, 8] > 0)).reshape(shape),
    )
