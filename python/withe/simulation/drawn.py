"""Gradients of equilibria and of runs by the nodes of a rod as it was drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import drawing
from withe.parts.kinds import FluidPart, JoinPart, ObstaclePart, RodPart, SpringPart, SupportPart
from withe.parts.rods import redrawn
from withe.simulation.session import Session

__all__ = ["DrawnNodes", "Moment", "points_reader"]

FloatArray = npt.NDArray[np.float64]

_STEP = 1e-3  # of the shortest edge, of differences that leave its fourth power


@dataclass(frozen=True, eq=False)
class Moment:
    """Where everything is at a moment, and the natural shape that rods have then.

    Attributes
    ----------
    positions : ndarray of shape (nodes, 3) [m]
    directors : list of ndarray of shape (edges, 3)
        The first ones, rod by rod.
    natural_curvature, natural_twist : list of ndarray
        Rod by rod.
    supports : dict
        Place and rotation of each, by its index.
    """

    positions: FloatArray
    directors: list[FloatArray]
    natural_curvature: list[FloatArray]
    natural_twist: list[FloatArray]
    supports: dict[int, tuple[FloatArray, FloatArray]]

    @classmethod
    def now(cls, session: Session) -> Moment:
        """The present one."""
        world, rods = session.world, range(len(session.directory.all(RodPart)))
        return cls(
            np.array(world.positions()),
            [np.array(world.directors(rod))[:, :3] for rod in rods],
            [np.array(world.natural_curvature(rod)) for rod in rods],
            [np.array(world.natural_twist(rod)) for rod in rods],
            {
                index: (np.array(world.support_position(index)), np.array(world.support_rotation(index)))
                for index, _ in session.settings.supports.values()
            },
        )


def points_reader(session: Session, part: RodPart, first: int) -> Callable[[_core.EquilibriumGradient], FloatArray]:
    """Reads derivatives of equilibria by drawn nodes, (nodes, 3) [1/m], of a rod whose edges begin with `first`."""
    nodes = DrawnNodes(session, part, first, Moment.now(session))

    def read(g: _core.EquilibriumGradient) -> FloatArray:
        nodes.add(g.parameters)
        return nodes.gradient(g)

    return read


class DrawnNodes:
    """Derivatives by drawn nodes, from those by rest lengths, natural shape, and what supports hold.

    How these follow from the nodes is geometry alone, whose differences are taken.
    """

    def __init__(self, session: Session, part: RodPart, first: int, begin: Moment, *, run: bool = False) -> None:
        """`begin`: how the equilibrium is, or the run began, whose scalar it is."""
        self._session, self._part, self._run = session, part, run
        self._edges = slice(first, first + len(part.lengths))
        self._supports = _check(session, part, begin)
        if run:
            _check_run(session, part, begin)
        self._follows = (
            np.array_equal(begin.natural_curvature[part.index], part.natural_curvature),
            np.array_equal(begin.natural_twist[part.index], part.natural_twist),
        )
        self._clear()

    @property
    def rod(self) -> str:
        """Its name."""
        return self._part.name

    def _clear(self) -> None:
        part = self._part
        self._by_length = np.zeros(len(part.lengths))
        self._by_curvature, self._by_twist = np.zeros_like(part.natural_curvature), np.zeros_like(part.natural_twist)

    def add(self, found: _core.ParameterGradient, curvature: float = 1.0, twist: float = 1.0) -> None:
        """Take in derivatives by what acted; `curvature`, `twist`: how much of the natural shape is the drawn one's."""
        part = self._part
        self._by_length += np.asarray(found.rest_length)[self._edges]
        if self._follows[0]:
            self._by_curvature += curvature * np.asarray(found.natural_curvature[part.index])
        if self._follows[1]:
            self._by_twist += twist * np.asarray(found.natural_twist[part.index])

    def gradient(self, g: _core.EquilibriumGradient | _core.InitialGradient) -> FloatArray:
        """Those that were taken in, and forgets them. `g`: by what supports hold, and by the start of a run."""
        part = self._part
        spins = [(support, np.asarray(g.held_spins)[index]) for index, support in self._supports]
        frames = [_frame(part, support) for support, _ in spins]
        by_directors = None
        if isinstance(g, _core.InitialGradient) and len(g.spins) > 0:
            by_directors = np.asarray(g.spins)[self._edges]

        def of(points: FloatArray) -> float:
            other = redrawn(part, points)
            value = self._by_length @ (other.lengths - part.lengths)
            value += np.sum(self._by_curvature * (other.natural_curvature - part.natural_curvature))
            value += self._by_twist @ (other.natural_twist - part.natural_twist)
            if by_directors is not None:
                value += by_directors @ _spins(part, other)
            for (support, spin), frame in zip(spins, frames, strict=True):
                turn = _frame(other, support) @ frame.T
                value += 0.5 * spin @ (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
            return float(value)

        out = np.asarray(g.held_nodes)[self._session.directory.layout.rows(part.index)].copy()
        step = _STEP * float(part.lengths.min())
        for place in np.ndindex(part.points.shape):
            way = np.zeros(part.points.shape)
            way[place] = step
            near = of(part.points + way) - of(part.points - way)
            far = of(part.points + 2.0 * way) - of(part.points - 2.0 * way)
            out[place] += (8.0 * near - far) / (12.0 * step)
        normal = self._session.world.plane_normal
        if normal is not None:
            out -= np.outer(out @ normal, normal)
        self._clear()
        return out


def _spins(part: RodPart, other: RodPart) -> FloatArray:
    """By how much directors are turned about their edges, beyond what carries them along with these [rad]."""
    t, now = part.tangents, other.tangents
    along = np.sum(part.directors * now, axis=1) / (1.0 + np.sum(t * now, axis=1))
    carried = part.directors - along[:, None] * (t + now)
    return np.asarray(np.sum(now * np.cross(carried, other.directors), axis=1))


def _frame(part: RodPart, support: SupportPart) -> FloatArray:
    """Directors and tangent of the end that a support holds, as columns."""
    if support.kind == "pin":
        return np.eye(3)
    if support.kind in ("clamp", "spinning_clamp"):
        tangent, director = drawing.drawn_frame(
            part.tangents, part.directors, part.lengths, support.node[1], part.closed
        )
    else:
        edge = min(support.node[1], len(part.tangents) - 1)
        tangent, director = part.tangents[edge], part.directors[edge]
    return np.stack([director, np.cross(tangent, director), tangent], axis=1)


def _refuse(part: RodPart, why: str) -> None:
    raise ValueError(f"no gradient by points of {part.owner} is known {why}")


def _check_run(session: Session, part: RodPart, begin: Moment) -> None:
    """Refuses runs that do not begin where the rod was drawn, and what moves only runs."""
    if session.directory.all(FluidPart):
        _refuse(part, "in a fluid, whose resistance goes with the whole length of a rod")
    near = 1e-9 * part.lengths.min()
    off = np.abs(begin.positions[session.directory.layout.rows(part.index)] - part.points).max() > near
    turned = session.world.plane_normal is None and np.abs(begin.directors[part.index] - part.directors).max() > 1e-9
    if off or turned:
        _refuse(part, "by a run that began elsewhere than it was drawn: run from where it is built")


def _check(session: Session, part: RodPart, begin: Moment) -> list[tuple[int, SupportPart]]:
    """The supports of a rod. Refuses what depends on drawn nodes by more than the engine has derivatives of."""

    def refuse(why: str) -> None:
        _refuse(part, why)

    if part.drawing is None or not np.array_equal(part.arcs, part.lengths):
        refuse("where nodes= found them or curvature is discrete: draw the nodes themselves")
    if session.directory.all(JoinPart):
        refuse("where rods are joined")
    if session.world.contact.rods or session.directory.all(ObstaclePart):
        refuse("where rods or obstacles touch")
    if any(load.kind in ("load", "pressure") for load in session.loads):
        refuse("under loads along rods")
    drawn = {rod.index: rod.points for rod in session.directory.all(RodPart)}
    for spring in session.directory.all(SpringPart):
        a, b = (drawn[rod][node] for rod, node in spring.nodes)
        if part.index in (spring.nodes[0][0], spring.nodes[1][0]) and np.isclose(
            spring.rest_length, np.linalg.norm(b - a), rtol=1e-12
        ):
            refuse(f"where {spring.name!r} is as long as it was drawn: give rest_length=")
    found = []
    for index, support in session.settings.supports.values():
        if support.grasp is not None:
            refuse("where a hand holds a rod")
        if support.node[0] != part.index:
            continue
        node = support.node[1]
        if support.kind != "pin" and (part.closed or node not in (0, len(part.points) - 1)):
            refuse("where an inner node is clamped")
        if index not in begin.supports:
            refuse(f"where {support.name!r} came while it ran")
        at, turn = begin.supports[index][0] - part.points[node], begin.supports[index][1] - np.eye(3)
        if np.abs(at).max() > 1e-9 * part.lengths.min() or np.abs(turn).max() > 1e-9:
            refuse(f"once {support.name!r} has moved")
        found.append((index, support))
    return found
