"""Ways over the manifold of sheets that are held without moment [dissertation, 7.5]. All in Lgb."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from withe.folding.grid import gentle, lift, make_grid, shortest_path
from withe.folding.manifold import elastica
from withe.folding.sheets import Elastica, at_forces, drag, forces_of, join, poses_of, take

__all__ = ["PENALTY", "Path", "goal_pose", "greedy", "least_slide", "smoothed", "uniform_cost"]

FloatArray = npt.NDArray[np.float64]
PENALTY = 0.958  # [Lgb] shorter lifted parts would be bent too sharply [7.8.5]
_MOST_STEPS = 2000


def goal_pose(x: float, z: float, depth: float, finger: float) -> Elastica | None:
    """Pose without moment whose outer edge, `depth` beyond, is at x and finger's height over z; None if there is none.

    `finger`: thickness of that between the edge and what lies under it.
    """
    angle = np.pi
    for _ in range(60):
        inner = (x - depth + depth * np.cos(angle), z + finger * abs(np.cos(angle)) - depth * np.sin(angle))
        pose = elastica([inner[0]], [inner[1]])
        if not pose.valid[0]:
            return None
        change = float(pose.angle[0]) - angle
        angle += change
        if abs(change) < 1e-10:
            return pose
    return None


def uniform_cost(length: float, goal: Elastica, start: Elastica | None = None) -> Elastica | None:
    """Nodes from flat, or a pose, to a goal over a sheet's part of the manifold, at least accumulated force ratio."""
    grid = make_grid()
    return shortest_path(grid, grid.pose.force_ratio, _allowed(length), start, goal)


def _allowed(length: float) -> npt.NDArray[np.bool_]:
    """Nodes of the grid that are part of a sheet's manifold."""
    grid = make_grid()
    lifted = grid.pose.suspended
    allowed = (lifted < length) & (lifted > PENALTY)
    allowed[: grid.lifts] = lift().suspended < length
    return allowed


def least_slide(length: float, friction: float, goal: Elastica, start: Elastica | None = None) -> Elastica | None:
    """Nodes of the shortest path on which the sheet slides least, bends counted.

    At each pose there is a range of slides at which friction holds the sheet, and it slides no further than to the
    nearer end of that; so what a path slides is the farthest of these ends from 0.
    """
    grid = make_grid()
    slide, allowed = _needed_slide(length, friction), _allowed(length)
    cost = 1.0 + 0.4 * grid.pose.max_curvature
    low, high = 0.0, float(slide[allowed & np.isfinite(slide)].max())
    best = shortest_path(grid, cost, allowed & (slide <= 0.0), start, goal)
    if best is not None:
        return best
    best = shortest_path(grid, cost, allowed & (slide <= high), start, goal)
    while best is not None and high - low > 2e-3:
        middle = 0.5 * (low + high)
        nodes = shortest_path(grid, cost, allowed & (slide <= middle), start, goal)
        low, high, best = (middle, high, best) if nodes is None else (low, middle, nodes)
    return best


@lru_cache(maxsize=8)
def _needed_slide(length: float, friction: float) -> FloatArray:
    """How far a sheet must have slid at each node of the grid, for friction to hold it there [Lgb]."""
    pose = make_grid().pose
    ratio = np.abs(pose.tangential_force) / (pose.normal_force + length - pose.suspended)
    slide = np.zeros(len(ratio))
    for node in np.flatnonzero(_allowed(length) & (ratio > friction)):
        one = take(pose, slice(node, node + 1))
        sheet, slid = drag(poses_of(one), forces_of(one)[0], friction, length)
        slide[node] = abs(slid[0]) if sheet.valid[0] else np.inf
    return slide


def greedy(length: float, goal: Elastica) -> Elastica | None:
    """From pose to pose next to it, always that of least tangential force, back over the sheet [Petrik 2016].

    Looks no further than one step of a block, within 60 degrees of where it goes, and comes down when it is over the
    goal; None where it comes to an end before.
    """
    grid = make_grid()
    raised = lift()
    way = take(raised, slice(0, int(np.searchsorted(raised.suspended, 0.95 * length))))  # no force: nothing is less
    heading, turns = 0.5 * np.pi, np.linspace(-np.pi / 3, np.pi / 3, 25)
    while goal.x[0] - way.x[-1] > grid.spacing:
        if len(way.x) > _MOST_STEPS:
            return None
        around = heading + turns
        x, z = way.x[-1] + grid.spacing * np.cos(around), way.z[-1] + grid.spacing * np.sin(around)
        ahead = (x >= way.x[-1]) & (z > 0)
        pose = elastica(x[ahead], z[ahead])
        good = pose.valid & (pose.suspended < length)
        if not good.any():
            return None
        best = np.argmin(np.where(good, np.abs(pose.tangential_force), np.inf))
        heading = around[ahead][best]
        way = join(way, take(pose, slice(best, best + 1)))
    down = np.arange(way.z[-1] - grid.spacing, goal.z[0], -grid.spacing)
    pose = elastica(np.full_like(down, goal.x[0]), down)
    return join(join(way, pose), goal) if (pose.valid & (pose.suspended < length)).all() else None


def _head(nodes: Elastica) -> int:
    """How many nodes at the start are lifted without tangential force: places of these say little of forces."""
    pulls = np.abs(nodes.tangential_force) > 1e-9
    return int(np.argmax(pulls)) if pulls.any() else 0


@dataclass(frozen=True)
class Path:
    """Poses, densely; the first `head` of them lifted without tangential force."""

    pose: Elastica
    head: int

    def at(self, places: FloatArray) -> Elastica:
        """Exact poses at places, which are indices with fractions."""
        index = np.arange(len(self.pose.x))
        low, high = places[places <= self.head - 1], places[places > self.head - 1]
        lifted = np.interp(low, index, self.pose.suspended)
        head = at_forces(np.stack([gentle(lifted), np.zeros_like(lifted), lifted], axis=1))
        rest = elastica(np.interp(high, index, self.pose.x), np.interp(high, index, self.pose.z))
        return join(head, rest)


def smoothed(nodes: Elastica, length: float, needed: Callable[[Elastica], FloatArray]) -> Path:
    """A path through nodes without their grid's corners; ends stay, and what is lifted without tangential force.

    Nothing that is `needed` of its poses is made greater than at the nodes.
    """
    from scipy.ndimage import gaussian_filter1d

    spacing = make_grid().spacing
    head = _head(nodes)
    rest = take(nodes, slice(max(0, head - 1), None))
    way = np.stack([rest.x, rest.z], axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    count = max(5, int(2 * travelled[-1] / spacing))
    even = np.linspace(0.0, travelled[-1], count)
    way = np.stack([np.interp(even, travelled, way[:, i]) for i in range(2)], axis=1)
    bound = 1.02 * needed(rest).max()
    pose = rest
    for spread in (3.0, 1.5, 0.75, 0.4):
        sigma = min(2 * spread, count / 8)
        pad = min(count - 2, int(4 * sigma) + 1)
        padded = np.concatenate([2 * way[0] - way[pad:0:-1], way, 2 * way[-1] - way[-2 : -pad - 2 : -1]])
        smooth = gaussian_filter1d(padded, sigma, axis=0)[pad : pad + count]
        tried = elastica(smooth[1:, 0], smooth[1:, 1])
        if (tried.valid & (tried.suspended < length)).all() and needed(tried).max() <= bound:
            pose = join(take(rest, slice(0, 1)), tried)
            break
    return Path(join(take(nodes, slice(0, max(0, head - 1))), pose), head)
