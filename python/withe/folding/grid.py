"""The manifold of sheets held without moment on a grid of positions, made once; and searches over it.

All in Lgb. The grid is that of the dissertation, 7.8.5: blocks of .0548, a pose at the middle of each. Beside it
stands the lift: sheets raised from the table without tangential force, the smooth way from flat into the grid, whose
positions say little where so short a part is lifted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from withe.folding.manifold import elastica
from withe.folding.sheets import Elastica, at_forces, join, take

__all__ = ["SPACING", "Grid", "gentle", "lift", "make_grid", "shortest_path"]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.intp]

SPACING = 0.0548
_WIDE, _HIGH = 10.3, 4.7  # [Lgb] of what sheets of up to 6.84 Lgb reach
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
        How many nodes belong to the lift.
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


@cache
def lift() -> Elastica:
    """Sheets raised without tangential force and without moment at the tip, by lifted length: the gentle branch."""
    normal = np.minimum(_LIFTS / 2, 1.5)
    ahead = normal + 1e-3
    zeros = np.zeros_like(normal)
    for _ in range(30):  # the secant method on the moment at the tip
        moment, next_moment = (
            at_forces(np.stack([force, zeros, _LIFTS], axis=1)).tip_moment for force in (normal, ahead)
        )
        change = np.where(np.abs(ahead - normal) > 1e-15, next_moment - moment, 1.0)
        step = np.where(change == 0, 0.0, -next_moment * (ahead - normal) / np.where(change == 0, 1.0, change))
        normal, ahead = ahead, ahead + step
        if np.abs(step).max() < 1e-13:
            break
    return at_forces(np.stack([ahead, zeros, _LIFTS], axis=1))


def gentle(lifted: FloatArray) -> FloatArray:
    """Normal force of the lift at lengths between its nodes."""
    from scipy.interpolate import CubicSpline

    raised = lift()
    return np.asarray(CubicSpline(raised.suspended, raised.normal_force)(lifted))


@cache
def make_grid(spacing: float = SPACING) -> Grid:
    """Solve the middles of all blocks; edges join neighbours, also over corners, and the lift with blocks nearby."""
    columns, rows = int(_WIDE / spacing), int(_HIGH / spacing)
    x, z = np.meshgrid(spacing * (np.arange(columns) + 0.5), spacing * (np.arange(rows) + 0.5), indexing="ij")
    blocks = elastica(x, z)
    raised = lift()
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
        edges.append(links(pose, raised.x[k], raised.z[k], spacing, int(k), len(raised.x)))
    joined = np.concatenate(edges)
    way = [getattr(pose, axis)[joined[:, 1]] - getattr(pose, axis)[joined[:, 0]] for axis in ("x", "z")]
    return Grid(spacing, len(raised.x), pose, joined, np.hypot(*way))


def links(pose: Elastica, x: float, z: float, spacing: float, name: int, first: int) -> IndexArray:
    """Edges from one node to all blocks nearby, `first` the first of these."""
    near = first + np.flatnonzero(np.hypot(pose.x[first:] - x, pose.z[first:] - z) < 1.5 * spacing)
    return np.stack([np.full_like(near, name), near], axis=1)


def shortest_path(
    grid: Grid, cost: FloatArray, allowed: npt.NDArray[np.bool_], start: Elastica | None, goal: Elastica
) -> Elastica | None:
    """Nodes of the path of least accumulated cost times length, uniform cost search [dissertation, Alg. 7, mended].

    From flat, or from a pose; to a pose. `cost` per length, of shape (nodes,), as `allowed`. None where no path is.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    ends = [end for end in (start, goal) if end is not None]
    pose, edges, lengths = grid.pose, [grid.edges], [grid.lengths]
    count = len(pose.x)
    for i, end in enumerate(ends):
        joined = links(pose, end.x[0], end.z[0], grid.spacing, count + i, grid.lifts)
        edges.append(joined)
        lengths.append(np.hypot(pose.x[joined[:, 1]] - end.x, pose.z[joined[:, 1]] - end.z))
    for end in ends:
        pose = join(pose, end)
    if start is not None and np.hypot(start.x - goal.x, start.z - goal.z)[0] < 1.5 * grid.spacing:
        edges.append(np.array([[count, count + 1]]))
        lengths.append(np.hypot(start.x - goal.x, start.z - goal.z))
    pairs, length = np.concatenate(edges), np.concatenate(lengths)
    ratio = np.concatenate([cost, [c for end in ends for c in end.force_ratio]])
    inside = np.concatenate([allowed, np.ones(len(ends), dtype=bool)])
    kept = inside[pairs].all(axis=1)
    pairs, length = pairs[kept], length[kept]
    weight = length * (0.5 * ratio[pairs].sum(axis=1) + _LEAST_COST)
    graph = csr_array((weight, (pairs[:, 0], pairs[:, 1])), shape=(len(inside), len(inside)))
    source, target = (count if start is not None else 0), len(inside) - 1
    _, before = dijkstra(graph, directed=False, indices=source, return_predecessors=True)
    if before[target] < 0:
        return None
    way = [target]
    while way[-1] != source:
        way.append(int(before[way[-1]]))
    return take(pose, np.array(way[::-1]))
