"""Handles: names for the parts of a scene, that hold nothing else and so survive copy, pickle and file.

A handle, or its name, is accepted wherever a part is asked for. It belongs to one scene, and serves every
simulation built from it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.attributes import of_a_simulation
from withe.common.union_find import UnionFind

__all__ = [
    "Body",
    "BodyPoint",
    "CustomForce",
    "Drag",
    "EdgeHandle",
    "Fluid",
    "Hand",
    "Handle",
    "Joint",
    "Layout",
    "Load",
    "Mass",
    "NodeHandle",
    "Obstacle",
    "Rod",
    "RodPlace",
    "Spring",
    "Support",
    "Tendon",
    "parse_place",
    "parse_point",
]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RodPlace:
    """Place of a rod in a scene's layout."""

    name: str
    nodes: int
    closed: bool
    radii: FloatArray
    widths: FloatArray | None


class Layout:
    """Which row of `positions()` each node of each rod has; joined nodes share one.

    Points of bodies have rows too, after those of rods. A body stands for the number -1 - index.
    """

    def __init__(self) -> None:
        self.rods: list[RodPlace] = []
        self.body_points: list[tuple[FloatArray, ...]] = []  # per body, the centre of mass first (3,) [m]
        self._merges: list[tuple[tuple[int, int], tuple[int, int]]] = []
        self._rows: list[npt.NDArray[np.int64]] | None = None
        self._node_count = 0
        self._is_open = True  # whether bodies may get new points

    def copy(self) -> Layout:
        """A layout that no longer changes with this one."""
        other = Layout()
        other.rods = list(self.rods)
        other.body_points = list(self.body_points)
        other._is_open = False
        other._merges = list(self._merges)
        return other

    def add(self, rod: RodPlace) -> int:
        """Append a rod; returns its index."""
        self.rods.append(rod)
        self._rows = None
        return len(self.rods) - 1

    def add_body(self, center: FloatArray) -> int:
        """Append a body by its centre of mass; returns its index."""
        self.body_points.append((center,))
        self._rows = None
        return len(self.body_points) - 1

    def body_point(self, body: int, position: FloatArray, near: float) -> tuple[int, int]:
        """Return the point of a body at a position, or as near to it, which is a new one if there is none."""
        points = self.body_points[body]
        for i, point in enumerate(points):
            if np.linalg.norm(point - position) <= near:
                return -1 - body, i
        if not self._is_open:
            raise ValueError(
                f"a body of a running simulation has no new points, got {position.tolist()}: place joints, supports "
                "and loads there before build()"
            )
        self.body_points[body] = (*points, position)
        self._rows = None
        return -1 - body, len(points)

    def add_surface(self, body: int, positions: FloatArray) -> tuple[tuple[int, int], ...]:
        """Add points of the surface of a body as a scene is built, and return them."""
        points = self.body_points[body]
        self.body_points[body] = (*points, *positions)
        self._rows = None
        return tuple((-1 - body, len(points) + i) for i in range(len(positions)))

    def restore_points(self, points: list[tuple[FloatArray, ...]]) -> None:
        """Take back points that bodies got for a joint that was refused."""
        self.body_points = list(points)
        self._rows = None

    def merge(self, a: tuple[int, int], b: tuple[int, int]) -> None:
        """Make two nodes, each (rod, node), one."""
        self._merges.append((a, b))
        self._rows = None

    def split(self, a: tuple[int, int], b: tuple[int, int]) -> None:
        """Make two nodes two again that were made one by one joint."""
        self._merges.remove((a, b))
        self._rows = None

    def add_copy(self, position: FloatArray) -> int:
        """Append a copy of a body at a joint as a scene is built: its first point is the body's, its second the joint.

        Returns its index.
        """
        self.body_points.append((position, position))
        self._rows = None
        return len(self.body_points) - 1

    def rows(self, rod: int) -> npt.NDArray[np.int64]:
        """Rows of the nodes of a rod, or of the points of a body."""
        return self._numbered()[rod if rod >= 0 else len(self.rods) - 1 - rod]

    @property
    def node_count(self) -> int:
        """Number of nodes, shared ones counted once."""
        self._numbered()
        return self._node_count

    def _numbered(self) -> list[npt.NDArray[np.int64]]:
        if self._rows is None:
            self._rows = self._number()
            self._node_count = max((int(rows.max()) for rows in self._rows), default=-1) + 1
        return self._rows

    def _number(self) -> list[npt.NDArray[np.int64]]:
        counts = [rod.nodes for rod in self.rods] + [len(points) for points in self.body_points]
        ranks = [_ranks(points) for points in self.body_points]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(int)
        roots = UnionFind(int(starts[-1]))

        def place(node: tuple[int, int]) -> int:
            if node[0] >= 0:
                return int(starts[node[0]]) + node[1]
            return int(starts[len(self.rods) - 1 - node[0]]) + int(ranks[-1 - node[0]][node[1]])

        for a, b in self._merges:
            roots.unite(place(a), place(b))
        root = np.array([roots.find(i) for i in range(int(starts[-1]))], dtype=np.int64)
        # Rows in order of first appearance: a root is the first of its group.
        is_first = root == np.arange(len(root))
        row_of_root = np.cumsum(is_first) - 1
        rows = row_of_root[root]
        found = [rows[starts[i] : starts[i + 1]] for i in range(len(counts))]
        return [
            *found[: len(self.rods)],
            *(own[rank] for own, rank in zip(found[len(self.rods) :], ranks, strict=True)),
        ]


def _ranks(points: tuple[FloatArray, ...]) -> npt.NDArray[np.int64]:
    """Order of a body's points among its rows: the centre of mass, then the others by their coordinates.

    The order of calls does not matter, so a scene from a file has the rows of the scene that was saved.
    """
    others = np.array(points[1:]).reshape(-1, 3)
    ranks = np.zeros(len(points), np.int64)
    ranks[1 + np.lexsort(others.T[::-1])] = np.arange(1, len(points))
    return ranks


@dataclass(frozen=True)
class Handle:
    """A part of a scene, by name."""

    scene_id: str = field(repr=False)
    name: str

    if not TYPE_CHECKING:  # a misspelt attribute stays an error to type checkers

        def __getattr__(self, word: str) -> Any:
            what = f"{type(self).__name__} {self.__dict__.get('name')!r}"
            public = not word.startswith("_")
            raise of_a_simulation(
                what, word, f"simulation.{{}}({self.__dict__.get('name')!r}, ...)", self._places() if public else ""
            )

    def _places(self) -> str:
        """Return the attributes that are handles of places, for an error message; empty without any."""
        return ""


@dataclass(frozen=True)
class Joint(Handle):
    """Handle of a joint, made by `Scene.join`: nodes that are one."""


@dataclass(frozen=True)
class Support(Handle):
    """Handle of a support, made by `Scene.clamp` and `Scene.pin`."""


@dataclass(frozen=True)
class Hand(Support):
    """Handle of a hand, made by `Scene.grasp`."""


@dataclass(frozen=True)
class Load(Handle):
    """Handle of a load, made by `Scene.add_force`, `add_moment`, `add_load` and `add_pressure`."""


@dataclass(frozen=True)
class Mass(Handle):
    """Handle of a mass at a node, made by `Scene.add_mass`."""


@dataclass(frozen=True)
class Spring(Handle):
    """Handle of a spring between two nodes, made by `Scene.add_spring`."""


@dataclass(frozen=True)
class Tendon(Handle):
    """Handle of a tendon, made by `Scene.add_tendon`."""


@dataclass(frozen=True)
class Drag(Handle):
    """Handle of the viscous drag on some rods, made by `Scene.add_drag`."""


@dataclass(frozen=True)
class Fluid(Handle):
    """Handle of the viscous fluid around all rods, made by `Scene.add_fluid`."""


@dataclass(frozen=True)
class CustomForce(Handle):
    """Handle of forces that a function of the user computes, made by `Scene.add_custom_force`."""


@dataclass(frozen=True)
class Obstacle(Handle):
    """Handle of an obstacle, made by `Scene.add_floor`, `add_plane`, `add_sphere`, `add_capsule`, `add_obstacle`."""


@dataclass(frozen=True)
class NodeHandle(Handle):
    """Handle of a node of a rod, made by `Rod.node`, `Rod.start` and `Rod.end`.

    Attributes
    ----------
    rod : str
        Name of the rod.
    index : int
        Zero or more.
    name : str
        "arm.start", "arm.end" or "arm.node(3)".
    """

    rod: str = field(repr=False)
    index: int = field(repr=False)


@dataclass(frozen=True)
class BodyPoint(NodeHandle):
    """Handle of a point of a rigid body, made by `Body.at`. It is accepted wherever a node is.

    Attributes
    ----------
    name : str
        "plug.at(0.1, 0.0, 0.2)".
    rod : str
        Name of the body.
    index : int
        Always -1.
    position : tuple of three floats [m]
        Place of the point as the scene is drawn.
    """

    position: tuple[float, float, float] = field(repr=False)


@dataclass(frozen=True)
class Body(Handle):
    """Handle of a rigid body, made by `Scene.add_body`.

    See Also
    --------
    Scene.add_body : Add a body.
    Scene.join : Join it to rods and other bodies.
    """

    def at(self, position: npt.ArrayLike) -> BodyPoint:
        """Return the point of the body at a place of the drawn scene.

        Parameters
        ----------
        position : array_like of shape (3,) [m]
            Place in the axes of the world, as the scene is drawn. The point moves with the body.

        Returns
        -------
        BodyPoint

        Raises
        ------
        ValueError
            A wrong shape, or a value that is not finite.

        Examples
        --------
        >>> plug = scene.add_body(withe.solids.Sphere(0.01), mass=0.01, position=(0.1, 0, 0), name="plug")
        >>> plug.at((0.11, 0, 0))
        BodyPoint(name='plug.at(0.11, 0.0, 0.0)')
        """
        x, y, z = validation.vector(position, f"point of body {self.name!r}").tolist()
        return BodyPoint(self.scene_id, f"{self.name}.at({x!r}, {y!r}, {z!r})", self.name, -1, (x, y, z))


@dataclass(frozen=True)
class EdgeHandle(Handle):
    """Handle of the edge of a rod from node `index` to the next, made by `Rod.edge`.

    Attributes
    ----------
    name : str
        "arm.edge(3)".
    rod : str
        Name of the rod.
    index : int
        Number of the edge, zero or more.
    """

    rod: str = field(repr=False)
    index: int = field(repr=False)


@dataclass(frozen=True)
class Rod(Handle):
    """Handle of a rod of a scene, made by `Scene.add_rod`.

    See Also
    --------
    Scene.add_rod : Add a rod.
    Simulation.positions : Positions of the nodes of a rod.

    Examples
    --------
    >>> import withe
    >>> scene = withe.Scene()
    >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    >>> arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -1), nodes=5, radius=0.01, material=rubber, name="arm")
    >>> arm.node(-1) == arm.end
    True
    >>> arm.rows
    array([0, 1, 2, 3, 4])
    """

    layout: Layout = field(repr=False, compare=False)
    index: int = field(repr=False, compare=False)

    @property
    def _place(self) -> RodPlace:
        return self.layout.rods[self.index]

    @property
    def closed(self) -> bool:
        """Return True if an edge joins the last node to the first."""
        return self._place.closed

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self._place.nodes

    @property
    def edges(self) -> int:
        """Number of edges."""
        return self.nodes - (0 if self.closed else 1)

    @property
    def stencils(self) -> int:
        """Number of nodes at which the rod bends, the inner ones or all of a closed rod."""
        return self.nodes - (0 if self.closed else 2)

    @property
    def rows(self) -> npt.NDArray[np.int64]:
        """Rows of the rod's nodes in `positions()` of the whole scene, shape (nodes,)."""
        return self.layout.rows(self.index).copy()

    @property
    def radii(self) -> FloatArray:
        """Radius of each edge (half the larger side of a rectangle), shape (edges,) [m]."""
        return self._place.radii.copy()

    @property
    def widths(self) -> FloatArray | None:
        """Sides of a rectangular section along d1 and d2, shape (edges, 2) [m]; None for a round one."""
        return None if self._place.widths is None else self._place.widths.copy()

    @property
    def start(self) -> NodeHandle:
        """The first node of an open rod."""
        return self._end("start", 0)

    @property
    def end(self) -> NodeHandle:
        """The last node of an open rod."""
        return self._end("end", self.nodes - 1)

    def _places(self) -> str:
        if "index" not in self.__dict__:  # a copy that is being made
            return ""
        return "node(i) or edge(i)" if self.closed else "start, end, node(i) or edge(i)"

    def _end(self, word: str, index: int) -> NodeHandle:
        if self.closed:
            raise ValueError(f"rod {self.name!r} is closed and has no {word}: use one of its nodes, node(i)")
        return self.node(index)

    def node(self, index: int) -> NodeHandle:
        """Return a node by its index. Negative indices count from the end.

        Parameters
        ----------
        index : int
            Index of the node.

        Returns
        -------
        NodeHandle

        Raises
        ------
        ValueError
            An index out of range.
        """
        i = validation.integer(index, f"node of rod {self.name!r}", -self.nodes, self.nodes - 1) % self.nodes
        word = f"node({i})"
        if not self.closed:
            word = {0: "start", self.nodes - 1: "end"}.get(i, word)
        return NodeHandle(self.scene_id, f"{self.name}.{word}", self.name, i)

    def edge(self, index: int) -> EdgeHandle:
        """Return an edge by its index. Negative indices count from the end.

        Parameters
        ----------
        index : int
            Index of the edge.

        Returns
        -------
        EdgeHandle

        Raises
        ------
        ValueError
            An index out of range.
        """
        i = validation.integer(index, f"edge of rod {self.name!r}", -self.edges, self.edges - 1) % self.edges
        return EdgeHandle(self.scene_id, f"{self.name}.edge({i})", self.name, i)


_PLACE = re.compile(r"(?P<rod>.+)\.(?:(?P<end>start|end)|(?P<kind>node|edge)\((?P<index>-?\d{1,9})\))")


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_POINT = re.compile(rf"(?P<body>.+)\.at\((?P<x>{_NUMBER}), *(?P<y>{_NUMBER}), *(?P<z>{_NUMBER})\)")


def parse_point(name: str) -> tuple[str, tuple[float, float, float]] | None:
    """Split the name of a point of a body into body and position; None if it is no such name."""
    match = _POINT.fullmatch(name)
    if match is None:
        return None
    return match["body"], (float(match["x"]), float(match["y"]), float(match["z"]))


def parse_place(name: str) -> tuple[str, str, int] | None:
    """Split the name of a node or edge into rod, "node" or "edge", and index; None if it is no such name."""
    match = _PLACE.fullmatch(name)
    if match is None:
        return None
    if match["end"]:
        return match["rod"], "node", 0 if match["end"] == "start" else -1
    return match["rod"], match["kind"], int(match["index"])
