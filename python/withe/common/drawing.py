"""Geometry of a drawn rod: centreline, directors, and its curvature and twist."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe import _core

__all__ = [
    "check_edges",
    "default_normal",
    "drawn_frame",
    "edge_vectors",
    "natural_shape",
    "resample",
    "rotation_about",
    "rotation_between",
    "smooth_curvature",
    "transport_directors",
    "voronoi_lengths",
]

FloatArray = npt.NDArray[np.float64]


def edge_vectors(points: FloatArray, closed: bool) -> FloatArray:
    """Vectors from each node to the next, shape (edges, 3) [m]."""
    return np.roll(points, -1, axis=0) - points if closed else np.diff(points, axis=0)


def check_edges(points: FloatArray, closed: bool, owner: str) -> FloatArray:
    """Return the lengths of the edges, shape (edges,) [m].

    Raises
    ------
    ValueError
        An edge of zero length, or one that folds straight back onto the previous edge, so that the direction of the
        bend is undetermined.
    """
    edges = edge_vectors(points, closed)
    lengths = np.sqrt(np.sum(edges**2, axis=1))
    size = max(float(np.abs(points).max()), float(lengths.max(initial=0.0)))
    short = np.flatnonzero(lengths <= 1e-12 * size)
    if len(short):
        raise ValueError(
            f"points of {owner} must differ from each other: edge {short[0]} has length {lengths[short[0]]:g}"
        )
    tangents = edges / lengths[:, None]
    turn = np.sum(tangents * np.roll(tangents, -1, axis=0), axis=1)[: None if closed else -1]
    folded = np.flatnonzero(turn < -1.0 + 1e-12)
    if len(folded):
        raise ValueError(f"points of {owner} must not fold straight back, but do after edge {folded[0]}")
    return np.asarray(lengths, np.float64)


def resample(points: FloatArray, nodes: int, closed: bool) -> tuple[FloatArray, float]:
    """Return evenly spaced points along a polyline, and their distance [m]; the ends of an open polyline are kept."""
    chain = np.concatenate([points, points[:1]]) if closed else points
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain, axis=0), axis=1))])
    edges = nodes if closed else nodes - 1
    places = np.linspace(0.0, arc[-1], edges + 1)[:nodes]
    result: FloatArray = np.stack([np.interp(places, arc, chain[:, axis]) for axis in range(3)], axis=1)
    result[0] = points[0]
    if not closed:
        result[-1] = points[-1]
    return np.asarray(result, np.float64), float(arc[-1]) / edges


def default_normal(tangent: FloatArray) -> FloatArray:
    """Return a unit normal to a direction, from the first coordinate axis that is not close to it."""
    axis = np.eye(3)[int(np.flatnonzero(np.abs(tangent) <= 0.6)[0])]
    normal = axis - tangent * (tangent @ axis)
    return np.asarray(normal / np.linalg.norm(normal), np.float64)


def transport_directors(tangents: FloatArray, first: FloatArray) -> FloatArray:
    """First directors of all edges, carried from the first edge by the smallest rotations, (edges, 3)."""
    directors = np.empty_like(tangents)
    directors[0] = first
    for i in range(1, len(tangents)):
        directors[i] = _transport(directors[i - 1], tangents[i - 1], tangents[i])
        directors[i] -= tangents[i] * (tangents[i] @ directors[i])
        directors[i] /= np.sqrt(directors[i] @ directors[i])
    return directors


def _transport(d: FloatArray, t0: FloatArray, t1: FloatArray) -> FloatArray:
    """Parallel transport of rows d normal to t0 to rows normal to t1."""
    scale = np.sum(d * t1, axis=-1, keepdims=True) / (1.0 + np.sum(t0 * t1, axis=-1, keepdims=True))
    return np.asarray(d - scale * (t0 + t1), np.float64)


def voronoi_lengths(lengths: FloatArray, closed: bool) -> FloatArray:
    """Return the rest length of each stencil, the mean of its two edges, shape (stencils,) [m]."""
    if closed:
        return 0.5 * (np.roll(lengths, 1) + lengths)
    return 0.5 * (lengths[:-1] + lengths[1:])


def smooth_curvature(discrete: FloatArray, voronoi: FloatArray) -> FloatArray:
    """Curvature [1/m] of the smooth rod that turns by the same angle phi as discrete curvature 2 tan(phi / 2).

    Parameters
    ----------
    discrete : ndarray of shape (stencils, 2)
    voronoi : ndarray of shape (stencils,) [m]
    """
    return np.asarray(_core.smooth_curvatures(discrete, voronoi))


def natural_shape(
    tangents: FloatArray, directors: FloatArray, voronoi: FloatArray, closed: bool, rounding: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return curvature and twist of a rod as drawn.

    Parameters
    ----------
    tangents, directors : ndarray of shape (edges, 3)
        Unit tangents and first directors.
    voronoi : ndarray of shape (stencils,) [m]
    closed : bool
    rounding : float [rad]
        Angles below it are set to zero, so that rounding errors of a straight rod do not make it curved.

    Returns
    -------
    curvature : ndarray of shape (stencils, 2) [1/m]
        Curvature of the smooth rod, towards d1 and d2.
    twist : ndarray of shape (stencils,) [rad/m]
    """
    strains = np.asarray(_core.drawn_strains(tangents, directors, closed))
    discrete, angle = strains[:, :2].copy(), strains[:, 2].copy()
    discrete[np.sqrt(np.sum(discrete**2, axis=1)) <= rounding] = 0.0
    angle[np.abs(angle) <= rounding] = 0.0
    return smooth_curvature(discrete, voronoi), angle / voronoi


def rotation_about(vector: FloatArray) -> FloatArray:
    """Rotation by |vector| rad about vector, as a matrix."""
    angle = float(np.sqrt(vector @ vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross, np.float64)


def rotation_between(start: FloatArray, end: FloatArray, spare: FloatArray) -> FloatArray:
    """Return the smallest rotation from one unit vector to another; about `spare` if they are opposite."""
    axis = np.cross(start, end)
    sine, cosine = float(np.sqrt(axis @ axis)), float(start @ end)
    if sine < 1e-12:
        return np.eye(3) if cosine > 0.0 else rotation_about(np.pi * spare)
    return rotation_about(axis * (np.arctan2(sine, cosine) / sine))


def drawn_frame(
    tangents: FloatArray, directors: FloatArray, lengths: FloatArray, node: int, closed: bool
) -> tuple[FloatArray, FloatArray]:
    """Return tangent and first director at a node, between its two edges, or half an edge beyond the last edge."""
    edges = len(tangents)
    before = node - 1 if node > 0 else (edges - 1 if closed else -1)
    after = node if node < edges else -1
    at_start, at_end = before < 0, after < 0
    if edges == 1:
        return tangents[0], directors[0]
    if at_start:
        before, after = 0, 1
    elif at_end:
        before, after = edges - 2, edges - 1
    a = np.stack([directors[before], np.cross(tangents[before], directors[before]), tangents[before]], axis=1)
    b = np.stack([directors[after], np.cross(tangents[after], directors[after]), tangents[after]], axis=1)
    turn = _rotation_vector(b @ a.T)
    share = lengths[before] + lengths[after]
    if at_end:
        frame = rotation_about(turn * (lengths[after] / share)) @ b
    else:
        frame = rotation_about(turn * ((-1.0 if at_start else 1.0) * lengths[before] / share)) @ a
    return frame[:, 2].copy(), frame[:, 0].copy()


def _rotation_vector(matrix: FloatArray) -> FloatArray:
    """Axis times angle of a rotation matrix that turns by less than pi."""
    axis = 0.5 * np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    sine, cosine = float(np.sqrt(axis @ axis)), 0.5 * (float(np.trace(matrix)) - 1.0)
    return axis * (np.arctan2(sine, cosine) / sine) if sine > 0.0 else axis
