"""Equilibria of a sheet that lies on a table and is lifted by one edge, exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from withe._core import SheetManifold
from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.folding.sheet_network import shipped
from withe.folding.sheets import Elastica, described, shared
from withe.folding.widths import EVEN, Width

__all__ = ["Manifold", "elastica"]

FloatArray = npt.NDArray[np.float64]


@lru_cache(maxsize=8)
def _table(width: Width) -> SheetManifold:
    return SheetManifold(width.engine)


@dataclass(frozen=True)
class Manifold:
    """Equilibria of a sheet that is held without moment, by positions: each from its equations, or all learned."""

    width: Width = EVEN
    learned: bool = False

    def __call__(self, x: npt.ArrayLike, z: npt.ArrayLike) -> Elastica:
        """As `elastica`."""
        if self.learned:
            return shipped()(x, z)
        first, second = validation.broadcast_arrays(x=x, z=z)
        return _solved(_table(self.width).at_position, first, second, 0.0)


def _solved(solve: Callable[..., FloatArray], first: FloatArray, second: FloatArray, moment: float) -> Elastica:
    rows = shared(lambda one, other: solve(one, other, moment), first.ravel(), second.ravel())
    return described(rows, first.shape)


@keyword_hints
def elastica(
    x: npt.ArrayLike | None = None,
    z: npt.ArrayLike | None = None,
    *,
    length: npt.ArrayLike | None = None,
    angle: npt.ArrayLike | None = None,
    tip_moment: float = 0.0,
    width: npt.ArrayLike | None = None,
) -> Elastica:
    """Find how the lifted part of a sheet hangs from a jaw.

    The sheet leaves the flat table without curvature (a table only pushes); the jaw holds its tip with a given moment.
    In units of Lgb and w, with W the weight of the part before s and b the width relative to that at which w is the
    weight per length,

        theta' = m / (2 b),  m' = (R - W) cos(theta) - T sin(theta),  theta(0) = m(0) = 0,  m(suspended) = tip_moment

    (dissertation, (7.6), with the condition at the lift-off point that it lacks), solved by multiple shooting with
    exact derivatives. Of several equilibria at one position it is the one that is reached from the flat sheet without
    a jump, the only one with theta >= 0 all along.

    Parameters
    ----------
    x, z : array_like, broadcast together [Lgb]
        The tip's way back and up from where it lay in the flat sheet.
    length, angle : array_like, broadcast together [Lgb], [rad]
        Instead of x and z: lifted length, 0.05 to 6.84, and the angle at the tip. Poses depend smoothly on these;
        on x and z they depend steeply near x = 0.
    tip_moment : float [w Lgb^2]
        Of the jaw on the sheet: twice the curvature at the tip, in 1/Lgb, that it makes there.
    width : array_like of shape (places, 2) [Lgb], [-], optional
        Distances from the tip, 0 and growing, and b there, straight between and as the last one beyond: a square
        folded over its diagonal widens from the jaw to its middle. By default 1 everywhere.

    Returns
    -------
    Elastica
        Poses, with `valid` False for refused ones. These positions are refused:

        * positions that need a lifted length outside 0.958 to 6.84 Lgb, where x and z do not name one pose
        * tips below the table
        * sheets that touch the table elsewhere or bend below it
        * taut sheets, pulled back by more than 40 w Lgb
        * by length and angle, also poses in the direction of such taut sheets: strips shorter than 0.9 Lgb that are
          lifted by only a few hundredths of a radian

    Raises
    ------
    ValueError
        Not numbers, not finite, shapes that do not broadcast, or neither x and z nor length and angle; widths that
        are not positive, places that do not grow from 0.

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
    table = _table(EVEN if width is None else _checked_width(width))
    return _solved(table.at_position if by_position else table.at_length_and_angle, first, second, moment)


def _checked_width(width: npt.ArrayLike) -> Width:
    places, widths = validation.number_array(width, "width", ("places", 2)).T
    if not len(places) or places[0] != 0.0 or (np.diff(places) <= 0.0).any():
        raise ValueError(f"width must have places that increase from 0, got {places.tolist()}")
    if (widths <= 0.0).any():
        raise ValueError(f"width must be positive everywhere, got {widths.tolist()}")
    return Width(tuple(places.tolist()), tuple(widths.tolist()))
