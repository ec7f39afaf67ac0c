"""Paths of equilibria: results of `Simulation.equilibrium` with path="arc_length"."""

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
        Factor of the loads. Without loads: the completed share of moved supports, changed shapes, and of the initial
        imbalance.
    stable : ndarray of shape (points,) of bool
        True if every small motion is resisted, at the loads and supports of the point. Motions out of the plane of a
        planar scene count too, as in `Equilibrium`. With follower loads or moments in space, True means only that the
        stiffness can be inverted.
    limit_points : ndarray of shape (limits,) of int
        Points at which the load factor has an extremum, accurate to nine digits of the load factor. A bifurcation, at
        which a symmetric branch only becomes unstable, is not a limit point; `stable` shows it.
    finished : bool
        True if the path reached the requested load factor or number of points. False if the solver lost the path.
    iterations : int
        Number of iterations of Newton's method.

    See Also
    --------
    Simulation.equilibrium : Follow a path by ``path="arc_length"``.
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
        """Return the positions of the nodes of a rod, or of every node once.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (points, nodes, 3) [m]

        Raises
        ------
        ValueError
            Not a rod of this scene.
        """
        return self._positions.copy() if rod is None else self._positions[:, self._rows(rod)]

    def forces(self, support: Support | NodeHandle | str) -> FloatArray:
        """Return the force of a support on the rod.

        Parameters
        ----------
        support : Support, NodeHandle or str
            The support, or its node.

        Returns
        -------
        ndarray of shape (points, 3) [N]

        Raises
        ------
        ValueError
            The node has no support.
        """
        return self._reactions[0][:, self._support(support)].copy()

    def moments(self, support: Support | NodeHandle | str) -> FloatArray:
        """Return the moment of a support on the rod, about its node.

        Parameters
        ----------
        support : Support, NodeHandle or str
            The support, or its node.

        Returns
        -------
        ndarray of shape (points, 3) [N m]

        Raises
        ------
        ValueError
            The node has no support.
        """
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
    """Check the arguments of a path; `functions` has the names of loads that are functions of time.

    Raises
    ------
    ValueError
        An object that is not a load, a load that is a function of time, or numbers out of range.
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
    """Return the path of the engine, with the rows of a rod's nodes in all positions, and the index of a support."""
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
