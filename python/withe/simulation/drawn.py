"""Gradients of equilibria and of runs by the drawn nodes of a rod."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.kinds import FluidPart, RodPart, SpringPart
from withe.parts.rods import redrawn
from withe.parts.torsion_springs import TorsionPart
from withe.simulation.numbers import number_value
from withe.simulation.session import Session

__all__ = ["DrawnNodes", "Moment", "points_reader"]

FloatArray = npt.NDArray[np.float64]

_STEP = 1e-3  # step of differences, relative to the shortest edge; their error is its fourth power


@dataclass(frozen=True, eq=False)
class Moment:
    """Positions and natural shapes at a moment.

    Attributes
    ----------
    positions : ndarray of shape (nodes, 3) [m]
    directors : list of ndarray of shape (edges, 3)
        First directors, rod by rod.
    natural_curvature, natural_twist : list of ndarray
        Natural shapes, rod by rod.
    supports : dict
        Position and rotation of each support, by its index.
    spring_lengths : list of float [m]
        Rest lengths of springs.
    frames_as_drawn : bool
        True if joints and clamps are oriented as drawn.
    """

    positions: FloatArray
    directors: list[FloatArray]
    natural_curvature: list[FloatArray]
    natural_twist: list[FloatArray]
    supports: dict[int, tuple[FloatArray, FloatArray]]
    spring_lengths: list[float]
    frames_as_drawn: bool

    @classmethod
    def now(cls, session: Session) -> Moment:
        """Return the present moment."""
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
            [number_value(session, spring, "rest_length") for spring in session.directory.all(SpringPart)],
            world.frames_as_drawn,
        )


Share = Callable[[str, str], float]
"""Share of the drawn shape in the present value of a word of a part: 1, or less after the value was set."""


def points_reader(session: Session, part: RodPart) -> Callable[[_core.EquilibriumGradient], FloatArray]:
    """Return a function that reads derivatives of equilibria by drawn nodes of a rod, (nodes, 3) [1/m]."""
    nodes = DrawnNodes(session, part, Moment.now(session))

    def read(g: _core.EquilibriumGradient) -> FloatArray:
        nodes.add(g.parameters)
        return nodes.gradient(g)

    return read


class DrawnNodes:
    """Return derivatives by drawn nodes, from derivatives by rest lengths, natural shape and directions of edges.

    The drawn nodes determine these quantities by geometry alone, so finite differences give the chain rule. Rods that
    are joined to the rod share nodes with it, and are drawn again together with it.
    """

    def __init__(self, session: Session, part: RodPart, begin: Moment, *, run: bool = False) -> None:
        """`begin` is the state of the equilibrium, or the state at the start of the run."""
        if session.directory.all(TorsionPart):
            raise ValueError(
                f"gradients by points of {part.owner} are not available in a scene with torsion springs, whose angles "
                "depend on the drawn edges"
            )
        rows = session.directory.layout.rows
        self._session, self._part, self._rows = session, part, rows(part.index)
        self._shapes = []
        edge = 0
        for rod in session.directory.all(RodPart):
            edges = slice(edge, edge + len(rod.lengths))
            edge = edges.stop
            if np.isin(rows(rod.index), self._rows).any():
                shared = [np.flatnonzero(rows(rod.index) == row) for row in self._rows]
                self._shapes.append(_Shape(rod, edges, shared, begin))
        for shape in self._shapes:
            _check(session, part, shape.part, begin)
            if run:
                _check_run(session, part, shape.part, begin)
        self._springs = _springs_as_drawn(session, [shape.part for shape in self._shapes], begin)
        self._by_springs = np.zeros(len(self._springs))

    def add(self, found: _core.ParameterGradient, share: Share = lambda name, word: 1.0) -> None:
        """Add derivatives by the natural shape, rest lengths and springs."""
        for shape in self._shapes:
            shape.add(found, share)
        for i, spring in enumerate(self._springs):
            self._by_springs[i] += share(spring.name, "rest_length") * found.spring_rest_length[spring.index]

    def gradient(self, g: _core.EquilibriumGradient | _core.InitialGradient) -> FloatArray:
        """Return the sum of the derivatives and reset it. `g` holds derivatives by quantities that stay as drawn."""
        by_nodes = np.asarray(g.drawn_nodes).copy()
        for spring, by in zip(self._springs, self._by_springs, strict=True):
            by_nodes[spring.rows[1]] += by * spring.direction
            by_nodes[spring.rows[0]] -= by * spring.direction
        out = by_nodes[self._rows]
        for shape in self._shapes:
            shape.by_turn += np.asarray(g.edge_turn)[shape.edges]
            shape.add_slopes(out)
            shape.clear()
        self._by_springs[:] = 0.0
        normal = self._session.world.plane_normal
        if normal is not None:
            out -= np.outer(out @ normal, normal)
        return np.asarray(out)


class _Shape:
    """A rod that is drawn again with nodes of another rod or its own, and derivatives by its drawn shape."""

    def __init__(self, part: RodPart, edges: slice, shared: list[npt.NDArray[np.intp]], begin: Moment) -> None:
        """`edges` of the scene; `shared` lists for each node of the other rod the nodes that move with it."""
        self.part, self.edges, self._shared = part, edges, shared
        self._follows = (
            np.array_equal(begin.natural_curvature[part.index], part.natural_curvature),
            np.array_equal(begin.natural_twist[part.index], part.natural_twist),
        )
        self.clear()

    def clear(self) -> None:
        """Reset all sums."""
        part = self.part
        self._by_length, self.by_turn = np.zeros(len(part.lengths)), np.zeros_like(part.tangents)
        self._by_curvature, self._by_twist = np.zeros_like(part.natural_curvature), np.zeros_like(part.natural_twist)

    def add(self, found: _core.ParameterGradient, share: Share) -> None:
        """See `DrawnNodes.add`."""
        rod, name = self.part.index, self.part.name
        self._by_length += np.asarray(found.rest_length)[self.edges]
        self.by_turn += np.asarray(found.edge_turn)[self.edges]
        self._by_curvature += np.asarray(found.drawn_curvature[rod])
        self._by_twist += np.asarray(found.drawn_twist[rod])
        if self._follows[0]:
            self._by_curvature += share(name, "natural_curvature") * np.asarray(found.natural_curvature[rod])
        if self._follows[1]:
            self._by_twist += share(name, "natural_twist") * np.asarray(found.natural_twist[rod])

    def add_slopes(self, out: FloatArray) -> None:
        """Add the derivatives by the nodes of the other rod to `out`, (nodes, 3)."""
        step = _STEP * float(self.part.lengths.min())
        for node, nodes in enumerate(self._shared):
            for axis in range(3) if len(nodes) else ():
                way = np.zeros(self.part.points.shape)
                way[nodes, axis] = step
                near, far = (self._of(times * way) - self._of(-times * way) for times in (1.0, 2.0))
                out[node, axis] += (8.0 * near - far) / (12.0 * step)

    def _of(self, way: FloatArray) -> float:
        part = self.part
        other = redrawn(part, part.points + way)
        value = self._by_length @ (other.lengths - part.lengths) + np.sum(self.by_turn * _turns(part, other))
        value += np.sum(self._by_curvature * (other.natural_curvature - part.natural_curvature))
        return float(value + self._by_twist @ (other.natural_twist - part.natural_twist))


def _turns(part: RodPart, other: RodPart) -> FloatArray:
    """Return the rotation of the frame of each edge, as rotation vectors up to the third power of the rotation."""
    out = np.zeros_like(part.tangents)
    for rod, new in (
        (part.directors, other.directors),
        (np.cross(part.tangents, part.directors), np.cross(other.tangents, other.directors)),
        (part.tangents, other.tangents),
    ):
        out += 0.5 * np.cross(rod, new)
    return out


@dataclass(frozen=True, eq=False)
class _DrawnSpring:
    name: str
    index: int
    rows: tuple[int, int]
    direction: FloatArray  # from the first node to the second


def _springs_as_drawn(session: Session, parts: list[RodPart], begin: Moment) -> list[_DrawnSpring]:
    """Springs at nodes of these rods that begin as long at rest as they were drawn."""
    drawn, rods = {rod.index: rod.points for rod in session.directory.all(RodPart)}, {rod.index for rod in parts}
    found = []
    for index, spring in enumerate(session.directory.all(SpringPart)):
        a, b = (drawn[rod][node] for rod, node in spring.nodes)
        length = float(np.linalg.norm(b - a))
        if rods.isdisjoint(rod for rod, _ in spring.nodes) or length == 0.0:
            continue
        if spring.as_drawn and begin.spring_lengths[index] == spring.rest_length:
            rows = (session.directory.row(spring.nodes[0]), session.directory.row(spring.nodes[1]))
            found.append(_DrawnSpring(spring.name, index, rows, (b - a) / length))
    return found


def _refuse(part: RodPart, why: str) -> None:
    raise ValueError(f"no gradient with respect to points of {part.owner} is available {why}")


def _check_run(session: Session, asked: RodPart, part: RodPart, begin: Moment) -> None:
    """Refuse runs that do not begin at the drawn positions, and motions that exist only in runs."""
    if session.directory.all(FluidPart):
        _refuse(asked, "in a fluid, whose resistance depends on the whole length of a rod")
    near = 1e-9 * part.lengths.min()
    off = np.abs(begin.positions[session.directory.layout.rows(part.index)] - part.points).max() > near
    turned = session.world.plane_normal is None and np.abs(begin.directors[part.index] - part.directors).max() > 1e-9
    if off or turned or not begin.frames_as_drawn:
        _refuse(asked, "for a run that began away from the drawn state: run from the state after build")


def _check(session: Session, asked: RodPart, part: RodPart, begin: Moment) -> None:
    """Refuse parts that depend on drawn nodes through quantities without derivatives in the engine."""

    def refuse(why: str) -> None:
        _refuse(asked, why)

    if part.drawing is None or not np.array_equal(part.arcs, part.lengths):
        whose = "" if part is asked else f"of {part.owner}, which is joined to the rod,"
        refuse(f"when nodes= resampled the points{whose} or curvature is discrete: draw one point per node")
    for index, support in session.settings.supports.values():
        if support.node[0] != part.index:
            continue
        if support.grasp is not None:
            refuse("when a hand holds a rod")
        if support.kind in ("spinning_clamp", "spinning_edge"):
            refuse(f"when {support.name!r} lets the rod spin about its drawn tangent")
        if index not in begin.supports:
            refuse(f"when {support.name!r} was added during the run")
        at, turn = begin.supports[index][0] - part.points[support.node[1]], begin.supports[index][1] - np.eye(3)
        if np.abs(at).max() > 1e-9 * part.lengths.min() or np.abs(turn).max() > 1e-9:
            refuse(f"after {support.name!r} has moved")
