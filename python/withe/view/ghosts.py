"""Visible parts of earlier poses. Coincident surfaces would be speckled with the colours of both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from withe.common.outlines import RodOutline

__all__ = ["stands_out"]

FloatArray = npt.NDArray[np.float64]
_NEAR = 0.1  # relative to the radius of a rod


def stands_out(rod: RodOutline, pose: FloatArray, others: Sequence[FloatArray]) -> npt.NDArray[np.bool_]:
    """Return True for nodes that are away from the centrelines of all other poses of the rod, shape (nodes,).

    A rod that slides along itself keeps its place, although its nodes move.

    Parameters
    ----------
    rod : RodOutline
    pose : ndarray of shape (nodes, 3) [m]
    others : sequence of ndarray of shape (nodes, 3) [m]
    """
    half = rod.radii if rod.widths is None else 0.5 * rod.widths.min(axis=1)
    before = np.roll(half, 1) if rod.closed else np.append(half[:1], half)
    after = half if rod.closed else np.append(half, half[-1:])
    near = _NEAR * np.minimum(before, after)
    away = np.ones(len(pose), bool)
    for other in others:
        away &= _distances(pose, other, rod.closed) > near
    return away


def _distances(points: FloatArray, nodes: FloatArray, closed: bool) -> FloatArray:
    """Distances of points from a polyline, shape (points,) [m]: from the segments at the node that is nearest."""
    from scipy.spatial import KDTree

    found, nearest = KDTree(nodes).query(points)
    for step in (-1, 1):
        beside = nearest + step
        beside = beside % len(nodes) if closed else np.clip(beside, 0, len(nodes) - 1)
        start, way = nodes[nearest], nodes[beside] - nodes[nearest]
        size = np.maximum(np.sum(way**2, axis=1), 1e-300)  # none at an end
        share = np.clip(np.sum((points - start) * way, axis=1) / size, 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(points - start - share[:, None] * way, axis=1))
    return np.asarray(found, np.float64)
