"""Paths of equilibria: what `Simulation.equilibrium` answers with path="arc_length"."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.common.short_repr import ShortRepr
from withe.parts.directory import Directory
from withe.parts.handles import Load, NodeHandle, Rod, Support
from withe.parts.kinds import LoadPart

__all__ = ["EquilibriumPath", "PathOptions", "path_of", "path_options"]

FloatArray = npt.NDArray[np.float64]

_MAX_STEPS = 2**31 - 2


@dataclass(frozen=True, eq=False, repr=False)
class EquilibriumPath(ShortRepr):
    """Equilibria one after another, through limit points.

    Attributes
    ----------
    load_factors : ndarray of shape (points,)
        By which loads are multiplied; or, of supports that move and of what was out of balance at the start, the
        fraction that is reached.
    stable : ndarray of shape (points,) of bool
        Whether every small motion would be pushed back, at the point's loads and supports; those out of the plane of a
        planar scene too, as in `Equilibrium`. With follower loads or moments in space that
        says no more than that the stiffness can be inverted.
    limit_points : ndarray of shape (limits,) of int
        Points at which the load factor has an extremum: they are found to nine digits of the load factor. A
        bifurcation, where a symmetric branch only becomes unstable, is none: `stable` tells of it.
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
    _positions: FloatArray = field(repr=False)
    _reactions: tuple[FloatArray, FloatArray] = field(repr=False)
    _rows: Callable[[Rod | str], npt.NDArray[np.int64]] = field(repr=False)
    _support: Callable[[Support | NodeHandle | str], int] = field(repr=False)

    def positions(self, rod: Rod | str | None = None) -> FloatArray:
        """Positions of the nodes of a rod, or of every node once, shape (points, nodes, 3) [m]."""
        return self._positions.copy() if rod is None else self._positions[:, self._rows(rod)]

    def forces(self, support: Support | NodeHandle | str) -> FloatArray:
        """Force of a support on the rod, shape (points, 3) [N]."""
        return self._reactions[0][:, self._support(support)].copy()

    def moments(self, support: Support | NodeHandle | str) -> FloatArray:
        """Moment of a support on the rod, about its node, shape (points, 3) [N m]."""
        return self._reactions[1][:, self._support(support)].copy()


@dataclass(frozen=True)
class PathOptions:
    """Options of a path: checked arguments of `Simulation.equilibrium`."""

    loads: list[LoadPart]
    start: float
    end: float
    steps: int
    turn: float


def path_options(
    directory: Directory,
    functions: Container[str],
    load: Load | str | Sequence[Load | str] | None,
    start: float,
    to: float,
    steps: int,
    turn: float,
) -> PathOptions:
    """Check what path is wanted; `functions` has the names of loads that are functions of time.

    Raises
    ------
    ValueError
        A load that is none or a function of time, or numbers out of range.
    """
    handles = [] if load is None else [load] if isinstance(load, Load | str) else list(load)
    parts = [directory.find(handle, LoadPart, "load") for handle in handles]
    for part in parts:
        if part.name in functions:
            raise ValueError(f"load {part.name!r} must be constant to be scaled along a path, got a function of time")
    begin, end = validation.number(start, "start"), validation.number(to, "to")
    if begin == end:
        raise ValueError(f"to must differ from start, got {end} for both")
    if begin != 0.0 and not parts:
        raise ValueError(f"start must be 0 when no load is given, got {begin}")
    count = validation.integer(steps, "steps", 1, _MAX_STEPS)
    return PathOptions(parts, begin, end, count, validation.positive(turn, "turn"))


def path_of(
    found: _core.EquilibriumPath,
    rows: Callable[[Rod | str], npt.NDArray[np.int64]],
    support: Callable[[Support | NodeHandle | str], int],
) -> EquilibriumPath:
    """The engine's path; `rows` of a rod's nodes in all positions, and the index of a support."""
    points = found.points
    return EquilibriumPath(
        load_factors=np.array([point.factor for point in points]),
        stable=np.array([point.stable for point in points]),
        limit_points=np.flatnonzero([point.limit for point in points]),
        finished=found.finished,
        iterations=found.iterations,
        _positions=np.array([point.positions for point in points]),
        _reactions=(np.array([point.forces for point in points]), np.array([point.moments for point in points])),
        _rows=rows,
        _support=support,
    )
