"""Ways over the manifold of sheets that are held without moment [dissertation, 7.5]. All in Lgb."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.folding.grid import lift, make_grid, shortest_path
from withe.folding.manifold import elastica
from withe.folding.sheets import Elastica, at_forces, forces_of, join, take

__all__ = ["PENALTY", "along", "goal_pose", "smoothed", "uniform_cost"]

FloatArray = npt.NDArray[np.float64]
PENALTY = 0.958  # [Lgb] shorter lifted parts would be bent too sharply [7.8.5]
_SPREAD = 3.0  # of the smoothing, in blocks


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
    lifted = grid.pose.suspended
    allowed = (lifted < length) & (lifted > PENALTY)
    allowed[: grid.lifts] = lift().suspended < length
    return shortest_path(grid, grid.pose.force_ratio, allowed, start, goal)


def smoothed(nodes: Elastica, length: float, spacing: float) -> Elastica:
    """A path through nodes without their grid's corners, densely; ends stay. What is lifted little is left as it is."""
    from scipy.ndimage import gaussian_filter1d

    short = int(np.searchsorted(nodes.suspended > 1.2, True)) if nodes.suspended[0] < 1.2 else 0
    rest = take(nodes, slice(short, None))
    way = np.stack([rest.x, rest.z], axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    count = max(3, int(2 * travelled[-1] / spacing))
    even = np.linspace(0.0, travelled[-1], count)
    way = np.stack([np.interp(even, travelled, way[:, i]) for i in range(2)], axis=1)
    spread = _SPREAD * spacing
    while True:
        sigma = min(spread / (even[1] - even[0]), count / 8)
        pad = min(count - 1, int(4 * sigma) + 1)
        padded = np.concatenate([2 * way[0] - way[pad:0:-1], way, 2 * way[-1] - way[-2 : -pad - 2 : -1]])
        smooth = gaussian_filter1d(padded, sigma, axis=0)[pad : pad + count]
        pose = elastica(smooth[:, 0], smooth[:, 1])
        if (pose.valid & (pose.suspended < length)).all():
            break
        spread /= 2
        if spread < 0.1 * spacing:
            pose = rest
            break
    return join(take(nodes, slice(0, short)), pose)


def along(path: Elastica, places: FloatArray) -> Elastica:
    """Exact poses at places of a path, which are indices with fractions."""
    index = np.arange(len(path.x))
    short = int(np.searchsorted(path.suspended > 1.2, True)) if path.suspended[0] < 1.2 else 0
    low, high = places[places < short], places[places >= short]
    forces = forces_of(path)
    head = at_forces(np.stack([np.interp(low, index, forces[:, i]) for i in range(3)], axis=1))
    rest = elastica(np.interp(high, index, path.x), np.interp(high, index, path.z))
    return join(head, rest)
