"""Edges and flat faces of closed surfaces of triangles, by which bodies touch."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from withe.common.union_find import UnionFind

__all__ = ["Core", "convex_hull", "inside", "polyhedron_core", "trails"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
# Sine of the angle between two triangles up to which they are one flat face.
_FLAT = 1e-6
# Outlines of faces reach over their rounded edges by at most this, over the thinnest extent: corners of equal boxes on
# each other then lie within them.
_MARGIN = 2e-4


@dataclass(frozen=True, eq=False)
class Core:
    """The part of a solid that touches: all points at a distance from segments, and flat faces.

    Parameters
    ----------
    points : ndarray of shape (n, 3) [m]
        Ends of segments.
    segments : ndarray of int, shape (m, 2)
        Rows of the ends.
    radius : float [m]
        Distance of the surface from the segments.
    faces : tuple of (ndarray of shape (k, 2, 3) [m], ndarray of shape (3,))
        Outline of each face as segments in the plane of the face, and the normal of the face.
    beside : ndarray of int, shape (m, 2)
        Faces on the left and on the right of each segment, as seen from outside; empty without faces.
    triangles : ndarray of int, shape (k, 3)
        Rows of `points` of the surface that is moved inwards by the radius; empty without faces.
    """

    points: FloatArray
    segments: IntArray
    radius: float
    faces: tuple[tuple[FloatArray, FloatArray], ...] = ()
    beside: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    triangles: IntArray = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))


def polyhedron_core(vertices: FloatArray, triangles: IntArray, rounding: float) -> Core:
    """Return the core of a closed surface whose convex edges are rounded.

    Parameters
    ----------
    vertices : ndarray of shape (n, 3) [m]
    triangles : ndarray of int, shape (m, 3)
        Counter-clockwise from outside.
    rounding : float [m]
        Radius of the rounded edges.

    Returns
    -------
    Core
        Its segments are the convex edges, moved inwards so that rounded edges end where faces are.
    """
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    owner = {(int(t[i]), int(t[(i + 1) % 3])): k for k, t in enumerate(triangles) for i in range(3)}
    flat = UnionFind(len(triangles))
    for (a, b), k in owner.items():
        other = owner[b, a]
        if a < b and np.linalg.norm(np.cross(normals[k], normals[other])) < _FLAT and normals[k] @ normals[other] > 0.0:
            flat.unite(k, other)
    roots, face = np.unique([flat.find(k) for k in range(len(triangles))], return_inverse=True)
    outwards = _outwards(vertices, triangles, normals[roots], face)
    margin = min(rounding, _MARGIN * float(np.ptp(vertices, axis=0).min()))
    inset, drawn = vertices - rounding * outwards, vertices + (margin - rounding) * outwards
    borders: list[list[tuple[int, int]]] = [[] for _ in roots]
    segments, beside = [], []
    for (a, b), k in owner.items():
        left, right = face[k], face[owner[b, a]]
        if left == right:
            continue
        borders[left].append((a, b))
        if a < b and np.cross(normals[roots[left]], normals[roots[right]]) @ (vertices[b] - vertices[a]) > 0.0:
            segments.append((a, b))
            beside.append((left, right))
    outlines = []
    for root, border in zip(roots, borders, strict=True):
        outline = drawn[np.array(border)]
        height = (corners[root, 0] - outline) @ normals[root]
        outlines.append((outline + height[..., None] * normals[root], normals[root]))
    return Core(inset, _pairs(segments), rounding, tuple(outlines), _pairs(beside), triangles)


def trails(segments: IntArray) -> list[int]:
    """Return segments as one walk, as few steps longer as is easy.

    Parameters
    ----------
    segments : ndarray of int, shape (m, 2)

    Returns
    -------
    list of int
        Points of the walk, one after the other. Two points that follow each other are a segment the first time that
        they are one of `segments`, else a jump.
    """
    left: dict[int, set[int]] = {point: set() for point in segments.ravel().tolist()}
    for a, b in segments.tolist():
        left[a].add(b)
        left[b].add(a)
    starts = sorted(left, key=lambda point: len(left[point]) % 2 == 0)  # a walk from an odd point is longer
    walk: list[int] = []
    for start in starts:
        while left[start]:
            here = start
            walk.append(here)
            while left[here]:
                there = min(left[here])
                left[here].discard(there)
                left[there].discard(here)
                walk.append(there)
                here = there
    return walk


def inside(vertices: FloatArray, triangles: IntArray, points: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which points are inside of a closed surface.

    Parameters
    ----------
    vertices : ndarray of shape (n, 3) [m]
    triangles : ndarray of int, shape (m, 3)
    points : ndarray of shape (k, 3) [m]

    Returns
    -------
    ndarray of bool, shape (k,)

    References
    ----------
    A. van Oosterom and J. Strackee, The solid angle of a plane triangle, IEEE Trans. Biomed. Eng. 30 (1983) 125-126.
    """
    found = np.zeros(len(points), dtype=bool)
    near = ((points > vertices.min(axis=0)) & (points < vertices.max(axis=0))).all(axis=1)
    for k in np.flatnonzero(near):
        a, b, c = np.moveaxis(vertices[triangles] - points[k], 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        scale = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        found[k] = 2.0 * np.arctan2(volume, scale).sum() > 2.0 * np.pi
    return found


def convex_hull(points: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the convex hull of points.

    Parameters
    ----------
    points : ndarray of shape (n, 3) [m]

    Returns
    -------
    vertices : ndarray of shape (m, 3) [m]
    triangles : ndarray of int, shape (k, 3)
        Rows of the vertices, counter-clockwise from outside.
    """
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    rows = hull.simplices.astype(np.int64)
    corners = points[rows]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    rows[inwards] = rows[inwards, ::-1]
    used, triangles = np.unique(rows, return_inverse=True)
    return points[used], triangles.reshape(-1, 3)


def _outwards(vertices: FloatArray, triangles: IntArray, normals: FloatArray, face: IntArray) -> FloatArray:
    """Return how far vertices move as all faces move by one along their normals."""
    around: list[set[int]] = [set() for _ in vertices]
    for k, triangle in enumerate(triangles):
        for vertex in triangle:
            around[vertex].add(int(face[k]))
    moved = np.zeros_like(vertices)
    for i, faces in enumerate(around):
        moved[i] = np.linalg.pinv(normals[sorted(faces)], rcond=0.1).sum(axis=1)
    return moved


def _pairs(rows: list[tuple[int, int]]) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(-1, 2)
