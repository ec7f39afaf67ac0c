"""Paths over the manifold of sheets that are held without moment [dissertation, 7.5]. All quantities are in Lgb."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from heapq import heappop, heappush

import numpy as np
import numpy.typing as npt

from withe.folding.free_moment import Holding
from withe.folding.grid import (
    IndexArray,
    Network,
    Ways,
    gentle,
    lift,
    make_grid,
    make_network,
    nodes_near,
    shortest_path,
    ways_to,
)
from withe.folding.manifold import Manifold
from withe.folding.sheets import SHORTEST, Elastica, at_forces, join, poses_of, slides_to_rest, take
from withe.folding.widths import Width

__all__ = ["SMOOTHING", "connects", "goal_pose", "greedy", "least_ratio", "least_slide", "smoothed", "uniform_cost"]

FloatArray = npt.NDArray[np.float64]
_MOST_STEPS = 2000
_ROOM = 2e-3  # additional slide that is allowed for a shorter path [Lgb]
SMOOTHING = 1.02
"""Largest friction of a smoothed path, relative to the friction that the nodes of the path need."""


@lru_cache(maxsize=8)
def goal_pose(solve: Manifold, x: float, z: float, depth: float, finger: float) -> Elastica | None:
    """Pose without moment whose outer edge is at x, and a finger's height over z; None if there is none.

    `depth` is the held length. `finger` is the thickness of the finger between the edge and the layer below.
    """
    angle = last_angle = np.pi
    last_change = 0.0
    for i in range(60):  # the secant method
        inner = (x - depth + depth * np.cos(angle), z + finger * abs(np.cos(angle)) - depth * np.sin(angle))
        pose = solve([inner[0]], [inner[1]])
        if not pose.valid[0]:
            return None
        change = float(pose.angle[0]) - angle
        if abs(change) < 1e-10:
            return pose
        slope = (change - last_change) / (angle - last_angle) if i and angle != last_angle else -1.0
        last_angle, last_change = angle, change
        angle -= change / slope
    return None


def uniform_cost(solve: Manifold, holding: Holding, goal: Elastica, start: Elastica | None = None) -> Elastica | None:
    """Nodes of the path with the least accumulated force ratio, from flat or a pose to a goal, over valid sheets."""
    return shortest_path(_ways_by_ratio(solve, holding, goal), start)


@lru_cache(maxsize=8)
def _ways_by_ratio(solve: Manifold, holding: Holding, goal: Elastica) -> Ways:
    return ways_to(_by_ratio(solve, holding), goal)


@lru_cache(maxsize=8)
def _by_ratio(solve: Manifold, holding: Holding) -> Network:
    grid = make_grid(solve)
    return make_network(grid, grid.pose.force_ratio, _allowed(solve, holding))


def connects(solve: Manifold, holding: Holding, goal: Elastica) -> bool:
    """Return True if there is a path from flat to a goal."""
    label = _parts(solve, holding)
    return bool((label[nodes_near(_by_ratio(solve, holding), goal)] == label[0]).any())


@lru_cache(maxsize=8)
def _parts(solve: Manifold, holding: Holding) -> IndexArray:
    """Label each node of the grid by its connected part."""
    from scipy.sparse.csgraph import connected_components

    return np.asarray(connected_components(_by_ratio(solve, holding).graph, directed=False)[1])


def _allowed(solve: Manifold, holding: Holding) -> npt.NDArray[np.bool_]:
    """Nodes of the grid that are part of a sheet's manifold, and at which the jaw does not reach into the table."""
    grid = make_grid(solve)
    lifted = grid.pose.suspended
    allowed = (lifted < holding.length) & (lifted > SHORTEST) & holding.has_room(grid.pose)
    allowed[: grid.lifts] = lift(solve.width).suspended < holding.length
    return allowed


def least_ratio(
    solve: Manifold, holding: Holding, enough: float, goal: Elastica, start: Elastica | None = None
) -> Elastica | None:
    """Nodes of the shortest path, bends counted, that needs no more than sufficient friction.

    If every path needs more friction, the path has the least greatest ratio.
    """
    ratio = holding.ratio(make_grid(solve).pose)
    return _shortest_within(solve, holding, lambda nodes: ratio[nodes], (enough, 0.0), goal, start)


def least_slide(
    solve: Manifold, holding: Holding, friction: float, goal: Elastica, start: Elastica | None = None
) -> Elastica | None:
    """Nodes of the shortest path on which the sheet slides least, bends counted.

    Friction holds the sheet within an interval of slides at each pose, and the sheet slides only to the nearer end of
    this interval. The slide of a path is therefore the largest distance of these ends from 0.
    """
    slides = _needed_slides(solve, holding.length, friction)
    return _shortest_within(solve, holding, slides.at, (0.0, _ROOM), goal, start)


def _shortest_within(
    solve: Manifold,
    holding: Holding,
    needed: Callable[[IndexArray], FloatArray],
    bounds: tuple[float, float],
    goal: Elastica,
    start: Elastica | None,
) -> Elastica | None:
    """Return nodes of the shortest path over the nodes with the least need; `bounds` as in `_spread`."""
    grid = make_grid(solve)
    cost, allowed = 1.0 + 0.4 * grid.pose.max_curvature, _allowed(solve, holding)
    network = make_network(grid, cost, allowed)
    begin = np.array([0]) if start is None else nodes_near(network, start)
    within = _spread(network, needed, bounds, begin, nodes_near(network, goal))
    return None if within is None else shortest_path(ways_to(make_network(grid, cost, within), goal), start)


def _spread(
    network: Network,
    needed: Callable[[IndexArray], FloatArray],
    bounds: tuple[float, float],
    begin: IndexArray,
    ends: IndexArray,
) -> npt.NDArray[np.bool_] | None:
    """Return nodes on paths to an end with the least possible need; None if every path has an infinite need.

    `needed`: need of each node. `bounds`: need that is always allowed, and allowed excess over the least need. The
    search continues from the nodes with the least need, like Prim's algorithm, with all equally good nodes at once.
    """
    first, neighbours = network.graph.indptr, network.graph.indices
    seen, reached, is_end = np.zeros((3, len(network.allowed)), dtype=bool)
    is_end[ends] = True
    waiting: list[tuple[float, int]] = []
    bound, room = bounds
    found, next_nodes = False, begin
    while True:
        new = next_nodes[~seen[next_nodes]]
        seen[new] = True
        for need, node in zip(needed(new), new, strict=True):
            if np.isfinite(need):
                heappush(waiting, (float(need), int(node)))
        if not waiting or (found and waiting[0][0] > bound):
            return reached if found else None
        bound = max(bound, waiting[0][0])
        wave = []
        while waiting and waiting[0][0] <= bound:
            wave.append(heappop(waiting)[1])
        reached[wave] = True
        if not found and is_end[wave].any():
            found, bound = True, bound + room
        next_nodes = np.concatenate([neighbours[first[node] : first[node + 1]] for node in wave])
        if len(wave) > 1:  # the neighbours of one node differ
            next_nodes = np.unique(next_nodes)


class _NeededSlides:
    """Slide at which friction holds the sheet, at nodes of the grid [Lgb]. Each slide is computed on first use.

    A path visits few nodes, and the computation is slow for sheets that snap, whose slide is infinite.
    """

    def __init__(self, pose: Elastica, friction: float, length: float, width: Width) -> None:
        self._pose, self._friction, self._length, self._width = pose, friction, length, width
        ratio = np.abs(pose.tangential_force) / (pose.normal_force + width.lying(pose.suspended, length))
        self._slide = np.where(ratio > friction, np.nan, 0.0)

    def at(self, nodes: IndexArray) -> FloatArray:
        """Infinite where the sheet snaps."""
        unknown = nodes[np.isnan(self._slide[nodes])]
        if len(unknown):
            some = take(self._pose, unknown)
            self._slide[unknown] = slides_to_rest(some, self._friction, self._length, self._width)
        return self._slide[nodes]


@lru_cache(maxsize=8)
def _needed_slides(solve: Manifold, length: float, friction: float) -> _NeededSlides:
    return _NeededSlides(make_grid(solve).pose, friction, length, solve.width)


def greedy(solve: Manifold, holding: Holding, goal: Elastica) -> Elastica | None:
    """Go from pose to pose, always to the neighbour with the least tangential force, back over the sheet [Petrik 2016].

    Each step looks one block ahead, within 60 degrees of its direction, and the path descends when it is over the goal.
    None if the path ends before.
    """
    grid = make_grid(solve)
    raised = lift(solve.width)
    way = take(
        raised, slice(0, int(np.searchsorted(raised.suspended, 0.95 * holding.length)))
    )  # no force: the least need
    heading, turns = 0.5 * np.pi, np.linspace(-np.pi / 3, np.pi / 3, 25)
    while goal.x[0] - way.x[-1] > grid.spacing:
        if len(way.x) > _MOST_STEPS:
            return None
        around = heading + turns
        x, z = way.x[-1] + grid.spacing * np.cos(around), way.z[-1] + grid.spacing * np.sin(around)
        ahead = (x >= way.x[-1]) & (z > 0)
        pose = solve(x[ahead], z[ahead])
        good = pose.valid & (pose.suspended < holding.length) & holding.has_room(pose)
        if not good.any():
            return None
        best = np.argmin(np.where(good, np.abs(pose.tangential_force), np.inf))
        heading = around[ahead][best]
        way = join(way, take(pose, slice(best, best + 1)))
    down = np.arange(way.z[-1] - grid.spacing, goal.z[0], -grid.spacing)
    pose = solve(np.full_like(down, goal.x[0]), down)
    return join(join(way, pose), goal) if (pose.valid & (pose.suspended < holding.length)).all() else None


def _head(nodes: Elastica) -> int:
    """Return the number of initial nodes without tangential force. Their positions hardly determine forces."""
    pulls = np.abs(nodes.tangential_force) > 1e-9
    return int(np.argmax(pulls)) if pulls.any() else 0


def smoothed(
    solve: Manifold,
    nodes: Elastica,
    holding: Holding,
    cut: Callable[[FloatArray], FloatArray],
) -> Elastica:
    """Poses along a path through nodes, without the corners of their grid; the ends and the lift are kept.

    `cut` returns places (fractional indices) on poses of shape (n, 3) near the path. Where corners can be smoothed, the
    needed friction is at most `SMOOTHING` times that of the nodes. Some poses may not be valid.
    """
    from scipy.ndimage import gaussian_filter1d

    spacing = make_grid(solve).spacing
    head = max(0, _head(nodes) - 1)
    known = poses_of(nodes)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(known[head:, :2], axis=0).T))])
    count = 2 * max(2, int(travelled[-1] / spacing)) + 1
    even = np.linspace(0.0, travelled[-1], count)
    way = np.stack([np.interp(even, travelled, known[head:, i]) for i in range(3)], axis=1)
    bound, room = SMOOTHING * holding.ratio(nodes).max(), -0.1 * spacing
    for spread in (3.0, 1.5, 0.75, 0.4):
        sigma = min(2 * spread, count / 8)
        pad = min(count - 2, int(4 * sigma) + 1)
        padded = np.concatenate([2 * way[0] - way[pad:0:-1], way, 2 * way[-1] - way[-2 : -pad - 2 : -1]])
        smooth = gaussian_filter1d(padded, sigma, axis=0)[pad : pad + count]
        sheet = _along(solve, nodes, head, smooth, cut)
        good = sheet.valid & (sheet.suspended < holding.length) & holding.has_room(sheet, room)
        if good.all() and holding.ratio(sheet).max() <= bound:
            return sheet
    return _along(solve, nodes, head, way, cut)


def _along(
    solve: Manifold, nodes: Elastica, head: int, way: FloatArray, cut: Callable[[FloatArray], FloatArray]
) -> Elastica:
    """Return poses without moment on a path after the first `head` nodes, which belong to the lift."""
    from scipy.interpolate import CubicSpline

    places = cut(np.concatenate([poses_of(nodes)[:head], way]))
    low, high = places[places < head], places[places >= head]
    lifted = np.interp(low, np.arange(head + 1), nodes.suspended[: head + 1])
    lift_part = at_forces(np.stack([gentle(lifted, solve.width), np.zeros_like(lifted), lifted], axis=1), solve.width)
    x, z = CubicSpline(np.arange(len(way)), way[:, :2])(high - head).T
    return join(lift_part, solve(x, z))
