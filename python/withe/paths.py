"""Paths of equilibria: what `Simulation.equilibrium` answers with path="arc_length"."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.handles import NodeHandle, Rod, Support

__all__ = ["EquilibriumPath"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EquilibriumPath:
    """Equilibria one after another, through limit points.

    Attributes
    ----------
    load_factors : ndarray of shape (points,)
        By which loads are multiplied; or, of supports that move and of what was out of balance at the start, the
        fraction that is reached.
    stable : ndarray of shape (points,) of bool
        Whether every small motion would be pushed back, at the point's loads and supports. With follower loads or
        moments in space that says no more than that the stiffness can be inverted.
    limit_points : ndarray of shape (limits,) of int
        Points at which the load factor has an extremum: they are found to nine digits of the load factor.
    finished : bool
        Whether the path came to the load factor or to the number of points that were asked for; False where it was
        lost on the way.
    iterations : int
        Of Newton's method.
    """

    load_factors: FloatArray
    stable: npt.NDArray[np.bool_]
    limit_points: npt.NDArray[np.int64]
    finished: bool
    iterations: int
    _positions: FloatArray
    _reactions: tuple[FloatArray, FloatArray]
    _rows: Callable[[Any], Any]
    _support: Callable[[Any], int]

    def positions(self, rod: Rod | str | None = None) -> FloatArray:
        """Positions of the nodes of a rod, or of every node once, shape (points, nodes, 3) [m]."""
        return self._positions.copy() if rod is None else self._positions[:, self._rows(rod)]

    def forces(self, support: Support | NodeHandle | str) -> FloatArray:
        """Force of a support on the rod, shape (points, 3) [N]."""
        return self._reactions[0][:, self._support(support)].copy()

    def moments(self, support: Support | NodeHandle | str) -> FloatArray:
        """Moment of a support on the rod, about its node, shape (points, 3) [N m]."""
        return self._reactions[1][:, self._support(support)].copy()
