"""Obstacles and springs in pictures: a patch of each plane, spheres and capsules, zigzags. Pure functions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common.outlines import ObstacleOutline

__all__ = ["cloud", "ends", "framing", "patch", "profile", "spring_width", "surface", "zigzag"]

FloatArray = npt.NDArray[np.float64]

_FAR = 1.5  # diagonals of the visible region


def _box(points: FloatArray) -> tuple[FloatArray, float]:
    """Middle and diagonal of the box around points."""
    low, high = points.min(axis=0), points.max(axis=0)
    return 0.5 * (low + high), float(np.linalg.norm(high - low))


def ends(outline: ObstacleOutline, place: FloatArray) -> FloatArray:
    """Both ends of the axis of a sphere or capsule at a position, shape (2, 3) [m]."""
    return np.stack([place, place + outline.axis])


def patch(outline: ObstacleOutline, place: FloatArray, points: FloatArray, share: float = 0.75) -> FloatArray:
    """Corners of the square of a plane that lies under or behind points.

    Parameters
    ----------
    outline : ObstacleOutline
        Outline of a plane.
    place : ndarray of shape (3,) [m]
        Position of the plane.
    points : ndarray of shape (points, 3) [m]
        Points in view.
    share : float
        Half a side of the square, over the diagonal of the view.

    Returns
    -------
    ndarray of shape (4, 3) [m]
    """
    normal = outline.axis / np.linalg.norm(outline.axis)
    middle, diagonal = _box(points)
    middle = middle - normal * (normal @ (middle - place))
    level = np.array([1.0, 0.0, 0.0]) if abs(normal[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    first = np.cross(normal, level)
    first *= share * diagonal / np.linalg.norm(first)
    second = np.cross(normal, first)
    return np.stack([middle + a * first + b * second for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def framing(outline: ObstacleOutline, places: FloatArray, points: FloatArray) -> FloatArray:
    """Return the part of an obstacle that a picture should show; none if it is far away or much larger than the rods.

    Parameters
    ----------
    outline : ObstacleOutline
    places : ndarray of shape (frames, 3) [m]
    points : ndarray of shape (points, 3) [m]
        Points of rods.

    Returns
    -------
    ndarray of shape (any, 3) [m]
    """
    middle, diagonal = _box(points)
    if outline.kind == "plane":
        normal = outline.axis / np.linalg.norm(outline.axis)
        heights = (places - middle) @ normal
        near = heights[np.abs(heights) <= _FAR * diagonal]
        if not len(near):
            return np.zeros((0, 3))
        rows = points[:: max(1, len(points) // 2000)]
        above = (rows - middle) @ normal
        return np.concatenate([rows + np.outer(height - above, normal) for height in (near.min(), near.max())])
    if outline.kind == "shape":
        found = (places[[0, -1], None] + outline.vertices).reshape(-1, 3)
        return np.asarray(found[np.linalg.norm(found - middle, axis=1) <= _FAR * diagonal])
    sides = outline.radius * np.concatenate([np.eye(3), -np.eye(3)])
    size = float(np.linalg.norm(outline.axis)) + 2.0 * outline.radius
    found = (places[:, None] + ends(outline, np.zeros(3))).reshape(-1, 3)
    near = np.linalg.norm(found - middle, axis=1) <= _FAR * diagonal + outline.radius
    if size > 2.0 * diagonal or not near.any():
        return np.zeros((0, 3))
    return (found[:, None] + sides).reshape(-1, 3)


def cloud(outline: ObstacleOutline, place: FloatArray) -> FloatArray:
    """Points spread over a sphere or capsule, by which it casts a shadow, shape (points, 3) [m]."""
    length = float(np.linalg.norm(outline.axis))
    along = np.linspace(0.0, 1.0, 1 + min(200, int(np.ceil(4.0 * length / outline.radius))))
    count = 300 + 3000 // len(along)
    turns = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * turns / count, turns * np.pi * (3.0 - np.sqrt(5.0))  # a spiral of golden angles
    level = np.sqrt(1.0 - height**2)
    ball = outline.radius * np.stack([level * np.cos(angle), level * np.sin(angle), height], axis=1)
    return np.asarray((place + np.outer(along, outline.axis)[:, None] + ball).reshape(-1, 3), np.float64)


def surface(outline: ObstacleOutline, place: FloatArray) -> FloatArray:
    """A sphere or capsule as a grid of points, shape (rings, sides, 3) [m]."""
    length = float(np.linalg.norm(outline.axis))
    along = outline.axis / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    first = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    first /= np.linalg.norm(first)
    second = np.cross(along, first)
    latitude = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 24)[:, None, None]
    angle = np.linspace(0.0, 2.0 * np.pi, 33)[None, :, None]
    ring = np.cos(angle) * first + np.sin(angle) * second
    centre = place + np.where(latitude > 0.0, 1.0, 0.0) * outline.axis
    return np.asarray(centre + outline.radius * (np.cos(latitude) * ring + np.sin(latitude) * along), np.float64)


def profile(first: FloatArray, second: FloatArray, radius: float) -> FloatArray:
    """Outline of a capsule in a plane: two half circles and the lines between them.

    Parameters
    ----------
    first, second : ndarray of shape (2,) [m]
        Ends of its axis, which are equal for a circle.
    radius : float [m]

    Returns
    -------
    ndarray of shape (points, 2) [m]
        Closed outline.
    """
    along = second - first
    start = float(np.arctan2(along[1], along[0])) + 0.5 * np.pi
    angles = start + np.linspace(0.0, np.pi, 40)
    half = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([first + half, second - half, first + half[:1]])


def zigzag(ends: FloatArray, width: float, normal: FloatArray) -> FloatArray:
    """A spring between two points as a zigzag line.

    Parameters
    ----------
    ends : ndarray of shape (2, 3) [m]
    width : float [m]
        Width of the zigzag.
    normal : ndarray of shape (3,)
        Normal of the plane of the zigzag, as nearly as its ends allow.

    Returns
    -------
    ndarray of shape (points, 3) [m]
        Points, whose number does not depend on the position.
    """
    turns = 8
    along = ends[1] - ends[0]
    side = np.cross(normal, along)
    if np.linalg.norm(side) <= 1e-6 * np.linalg.norm(normal) * np.linalg.norm(along):
        side = np.cross(np.eye(3)[int(np.argmin(np.abs(along)))], along)
    length = float(np.linalg.norm(side))
    if length > 0.0:
        side = side / length
    places = np.concatenate([[0.0], np.linspace(0.15, 0.85, 2 * turns + 1), [1.0]])
    offsets = np.zeros(len(places))
    offsets[2:-2:2], offsets[3:-2:2] = 0.5, -0.5
    return np.asarray(ends[0] + np.outer(places, along) + width * np.outer(offsets, side), np.float64)


def spring_width(ends: FloatArray) -> float:
    """Return the drawn width of a spring [m], from its ends in all frames, shape (frames, 2, 3) [m]."""
    return 0.08 * float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1).max())
