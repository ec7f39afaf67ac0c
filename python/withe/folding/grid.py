"""The manifold of sheets held without moment on a grid of positions, and searches over it.

All quantities are in Lgb. The grid is that of the dissertation, 7.8.5: blocks of 0.0548 with a pose at the middle of
each. The "lift" is the smooth path from the flat sheet into the grid: sheets raised from the table without tangential
force. Positions hardly determine the equilibrium of such short suspended parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.folding.manifold import Manifold
from withe.folding.sheets import Elastica, at_forces, join, take
from withe.folding.widths import EVEN, Width

__all__ = [
    "HIGH",
    "SPACING",
    "WIDE",
    "Grid",
    "IndexArray",
    "Network",
    "Ways",
    "gentle",
    "lift",
    "make_grid",
    "make_network",
    "nodes_near",
    "shortest_path",
    "ways_to",
]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.intp]
SPACING = 0.0548
WIDE, HIGH = 10.3, 4.7  # [Lgb], reached by sheets of up to 6.84 Lgb
_LIFTS = np.linspace(0.1, 3.0, 59)  # lifted lengths
_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1))
_LEAST_COST = 1e-6  # an edge without cost would be no edge


@dataclass(frozen=True)
class Grid:
    """Nodes, those of the lift first, and the edges between neighbours.

    Attributes
    ----------
    spacing : float [Lgb]
    lifts : int
        Number of nodes of the lift.
    pose : Elastica
        Arrays of shape (nodes,).
    edges : ndarray of shape (edges, 2)
    lengths : ndarray of shape (edges,) [Lgb]
    """

    spacing: float
    lifts: int
    pose: Elastica
    edges: IndexArray
    lengths: FloatArray


@lru_cache(maxsize=8)
def lift(width: Width = EVEN) -> Elastica:
    """Return sheets that are raised without tangential force and without moment at the tip, by lifted length."""
    normal = np.zeros_like(_LIFTS)
    for i, lifted in enumerate(_LIFTS):
        # First guess: force of a short strip, which hardly turns; then extrapolation from the lengths before.
        guess = _least_lift(lifted, width) if i < 2 else 2.0 * normal[i - 1] - normal[i - 2]
        normal[i] = _without_moment(lifted, guess, width)
    return at_forces(np.stack([normal, np.zeros_like(normal), _LIFTS], axis=1), width)


def _least_lift(lifted: float, width: Width) -> float:
    """Mean of the weight before s, which makes the moment at the tip zero where angles are small."""
    before = width.lying(np.linspace(0.0, lifted, 201), lifted)
    return float(np.trapezoid(before, dx=1.0 / 200))


def _without_moment(lifted: float, normal: float, width: Width) -> float:
    """Normal force, by the secant method on the moment at the tip."""
    ahead = normal * (1.0 + 1e-3)
    for _ in range(30):
        moment, next_moment = at_forces([(force, 0.0, lifted) for force in (normal, ahead)], width).tip_moment
        change = next_moment - moment
        step = -next_moment * (ahead - normal) / change if change != 0.0 else 0.0
        normal, ahead = ahead, ahead + step
        if abs(step) < 1e-13:
            break
    return ahead


@lru_cache(maxsize=8)
def _gentle(width: Width) -> Any:
    from scipy.interpolate import CubicSpline

    raised = lift(width)
    return CubicSpline(raised.suspended, raised.normal_force)


def gentle(lifted: FloatArray, width: Width) -> FloatArray:
    """Normal force of the lift at suspended lengths between its nodes."""
    return np.asarray(_gentle(width)(lifted))


@lru_cache(maxsize=8)
def make_grid(solve: Manifold, spacing: float = SPACING) -> Grid:
    """Solve the middles of all blocks. Edges join neighbours, also diagonal ones, and the lift with nearby blocks."""
    columns, rows = int(WIDE / spacing), int(HIGH / spacing)
    x, z = np.meshgrid(spacing * (np.arange(columns) + 0.5), spacing * (np.arange(rows) + 0.5), indexing="ij")
    blocks = solve(x, z)
    raised = lift(solve.width)
    name = np.full((columns, rows), -1)
    name[blocks.valid] = len(raised.x) + np.arange(blocks.valid.sum())
    edges = [np.stack([np.arange(len(raised.x) - 1), np.arange(1, len(raised.x))], axis=1)]
    for i, j in _STEPS:
        near = name[: columns - i, max(0, -j) : rows - max(0, j)]
        far = name[i:, max(0, j) : rows + min(0, j)]
        both = (near >= 0) & (far >= 0)
        edges.append(np.stack([near[both], far[both]], axis=1))
    pose = join(raised, take(blocks, blocks.valid))
    for k in np.flatnonzero(raised.suspended > 1.0):
        near = np.flatnonzero(np.hypot(pose.x - raised.x[k], pose.z - raised.z[k]) < 1.5 * spacing)
        near = near[near >= len(raised.x)]
        edges.append(np.stack([np.full_like(near, k), near], axis=1))
    joined = np.concatenate(edges)
    way = [getattr(pose, axis)[joined[:, 1]] - getattr(pose, axis)[joined[:, 0]] for axis in ("x", "z")]
    return Grid(spacing, len(raised.x), pose, joined, np.hypot(*way))


@dataclass(frozen=True)
class Network:
    """Allowed nodes of a grid, and the cost from each to its neighbours, shared by successive searches.

    Attributes
    ----------
    grid : Grid
    cost : ndarray of shape (nodes,)
        Cost per length.
    allowed : ndarray of bool, shape (nodes,)
    graph : scipy.sparse.csr_array of shape (nodes, nodes)
        Cost of each edge, in both directions.
    """

    grid: Grid
    cost: FloatArray
    allowed: npt.NDArray[np.bool_]
    graph: Any


def make_network(grid: Grid, cost: FloatArray, allowed: npt.NDArray[np.bool_]) -> Network:
    """Join the allowed nodes. `cost` is per length; `cost` and `allowed` have the shape (nodes,)."""
    from scipy.sparse import csr_array

    kept = allowed[grid.edges].all(axis=1)
    first, second = grid.edges[kept].T
    weight = _weights(grid.lengths[kept], cost[first], cost[second])
    there_and_back = (np.concatenate([first, second]), np.concatenate([second, first]))
    graph = csr_array((np.tile(weight, 2), there_and_back), shape=(len(allowed), len(allowed)))
    return Network(grid, cost, allowed, graph)


def _weights(lengths: FloatArray, first: FloatArray | float, second: FloatArray | float) -> FloatArray:
    return np.asarray(lengths * (0.5 * (first + second) + _LEAST_COST))


def _away(grid: Grid, end: Elastica) -> FloatArray:
    return np.asarray(np.hypot(grid.pose.x - end.x[0], grid.pose.z - end.z[0]))


def nodes_near(network: Network, end: Elastica) -> IndexArray:
    """Allowed blocks around a pose."""
    return _near(network, end)[0]


def _near(network: Network, end: Elastica) -> tuple[IndexArray, FloatArray]:
    """The same, and how far they are [Lgb]."""
    away = _away(network.grid, end)
    near = network.allowed & (away < 1.5 * network.grid.spacing)
    near[: network.grid.lifts] = False
    nodes = np.flatnonzero(near)
    return nodes, away[nodes]


def _links(network: Network, end: Elastica) -> tuple[IndexArray, FloatArray]:
    """Blocks around a pose, and the cost of the way to each."""
    nodes, away = _near(network, end)
    return nodes, _weights(away, network.cost[nodes], float(end.force_ratio[0]))


@dataclass(frozen=True)
class Ways:
    """Paths of least cost from every node to a goal.

    Attributes
    ----------
    network : Network
    goal : Elastica
    cost : ndarray of shape (nodes,)
        Cost of the path from a node; infinite if there is none.
    following : ndarray of int, shape (nodes,)
        Next node on each path. The number of nodes stands for the goal.
    """

    network: Network
    goal: Elastica
    cost: FloatArray
    following: IndexArray


def ways_to(network: Network, goal: Elastica) -> Ways:
    """Search by uniform cost from a goal backwards, with cost times length [dissertation, Alg. 7, mended].

    The search is the same for every start, so a plan and its replans share it.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    graph, count = network.graph, network.graph.shape[0]
    nodes, costs = _links(network, goal)
    rows = np.append(graph.indptr, graph.indptr[-1] + len(nodes))
    parts = (np.append(graph.data, costs), np.append(graph.indices, nodes), rows)
    cost, following = dijkstra(csr_array(parts, shape=(count + 1, count + 1)), indices=count, return_predecessors=True)
    return Ways(network, goal, cost[:count], following[:count])


def shortest_path(ways: Ways, start: Elastica | None) -> Elastica | None:
    """Nodes of the path of least cost from flat, or from a pose; None if there is none."""
    grid, goal = ways.network.grid, ways.goal
    if start is None:
        nodes, costs = np.array([0]), np.zeros(1)
    elif np.hypot(start.x - goal.x, start.z - goal.z)[0] < 1.5 * grid.spacing:
        return join(start, goal)
    else:
        nodes, costs = _links(ways.network, start)
    total = ways.cost[nodes] + costs
    if not len(nodes) or not np.isfinite(total).any():
        return None
    way = [int(nodes[np.argmin(total)])]
    while ways.following[way[-1]] < len(ways.following):
        way.append(int(ways.following[way[-1]]))
    path = join(take(grid.pose, np.array(way)), goal)
    return path if start is None else join(start, path)
