"""Exact equilibria of a sheet that lies on a table and is lifted by one edge."""

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
    """Equilibria of a sheet that is held without moment, by positions: solved, or predicted by a network."""

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
    """Return the equilibrium of the suspended part of a sheet that a jaw holds.

    The sheet leaves the flat table without curvature, because a table can only push. The jaw applies a given moment to
    the tip. Units are Lgb and w. With W the weight of the part before s, and b the width relative to the width at which
    w is the weight per length, the equations are

        theta' = m / (2 b),  m' = (R - W) cos(theta) - T sin(theta),  theta(0) = m(0) = 0,  m(suspended) = tip_moment

    (dissertation, (7.6), with the missing condition at the lift-off point). Multiple shooting with exact derivatives
    solves them. If one position has several equilibria, the result is the one that the flat sheet reaches without a
    jump. It is the only one with theta >= 0 everywhere.

    Parameters
    ----------
    x, z : array_like, broadcast together [Lgb]
        Displacement of the tip from its place in the flat sheet, back and up.
    length, angle : array_like, broadcast together [Lgb], [rad]
        Suspended length, 0.05 to 6.84, and the angle at the tip, instead of x and z. Poses depend smoothly on these
        two. On x and z they depend steeply near x = 0.
    tip_moment : float [w Lgb^2]
        Moment of the jaw on the sheet. It is twice the curvature at the tip, in 1/Lgb.
    width : array_like of shape (places, 2) [Lgb], [-], optional
        Distances from the tip, which begin at 0 and grow, and the width b there. The width is linear in between and
        constant beyond the last place. Example: a square folded over its diagonal widens from the jaw to its middle. By
        default 1 everywhere.

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
        Arguments that are not finite numbers or do not broadcast. Neither x and z, nor length and angle. Widths that
        are not positive, or places that do not begin at 0 and grow.

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
