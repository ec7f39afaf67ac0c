"""Equilibria of a sheet that lies on a table and is lifted by one edge, exactly."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from withe._core import SheetManifold
from withe.common import validation
from withe.folding.sheets import Elastica, described, shared

__all__ = ["elastica"]

FloatArray = npt.NDArray[np.float64]


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
    given = {"x": x, "z": z} if by_position else {"length": length, "angle": angle}
    first, second = validation.broadcast_arrays(**given)
    moment = validation.number(tip_moment, "tip_moment")
    growth = validation.non_negative(width_growth, "width_growth")
    manifold = _manifold()
    solve = manifold.at_position if by_position else manifold.at_length_and_angle
    rows = shared(lambda one, other: solve(one, other, growth, moment), first.ravel(), second.ravel())
    return described(rows, first.shape)
