"""Centrelines in space, from two views of one cable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.short_repr import ShortRepr
from withe.perception.camera import Camera
from withe.perception.chain import resample

__all__ = ["CableInSpace", "triangulate"]

Array = NDArray[np.float64]

_MATCHED = 241  # points of each line that are matched
_SIDEWAYS = 0.5  # cost of a step along one line only [px^2]
_WINDOW = 0.06  # greatest change of a node's place on a line in an iteration, relative to the length
_ITERATIONS = 12
_SMOOTH = 1.0  # weight of third differences of nodes, and of differences of edges, over that of distances in pixels
_DAMPING = 1e-6
_FAR_OFF = 5.0  # greatest root mean square distance of two views of one cable [px]
_LEAST_BASELINE = 1e-3  # least distance of the cameras, relative to the distance of the cable
_FEWEST_POINTS = 4


@dataclass(frozen=True, eq=False, repr=False)
class CableInSpace(ShortRepr):
    """Centreline of a cable in space.

    Attributes
    ----------
    points : ndarray of shape (nodes, 3) [m]
        Points at about equal distances, in the direction of the first line.
    residuals : ndarray of shape (nodes, 2) [px]
        Distance of each point, seen by either camera, from the line in its picture. For both ends, the distance from
        the end of the line.
    reversed : bool
        True if the second line runs in the other direction.
    """

    points: Array
    residuals: Array
    reversed: bool

    @property
    def length(self) -> float:
        """Return the length of the centreline [m]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())

    @property
    def rms(self) -> float:
        """Return the root mean square of the residuals [px]."""
        return float(np.sqrt(np.mean(self.residuals**2)))


@keyword_hints
def triangulate(lines: Sequence[ArrayLike], cameras: Sequence[Camera], *, nodes: int = 101) -> CableInSpace:
    """Find the centreline of a cable in space from two views.

    Parameters
    ----------
    lines : pair of array_like of shape (n, 2) [px]
        Centreline of the whole cable in either picture, from end to end, in any direction.
    cameras : pair of Camera
        Cameras with matrices and poses in one world, by `Camera.from_points` with a matrix or by their parameters.
    nodes : int
        Number of points.

    Returns
    -------
    CableInSpace

    Raises
    ------
    ValueError
        Not two lines and two cameras, a camera that is calibrated on a plane only, or cameras in one place. Lines that
        are not views of one cable: the root mean square of the residuals is above 5 px, or that of an end above 10 px.

    Notes
    -----
    A point of one line lies on the epipolar line of its partner in the other picture. The partners advance along both
    lines from end to end. Dynamic programming finds the pairs with the least epipolar distances. The Gauss-Newton
    method then fits points in space to both lines, with small weights of third differences and of different distances
    between points. These weights decide where a line is parallel to its epipolar lines, since the pictures do not
    determine the depth there. The depth is most exact if the cameras are displaced across the cable.
    """
    if len(lines) != 2 or len(cameras) != 2:
        raise ValueError(f"lines and cameras must be pairs, got {len(lines)} lines and {len(cameras)} cameras")
    count = validation.integer(nodes, "nodes", 8, 1000)
    for camera in cameras:
        if not isinstance(camera, Camera):
            raise ValueError(f"cameras must be of type withe.perception.Camera, got {type(camera).__name__}")
        if camera.flat:
            raise ValueError("cameras must have matrices: pass matrix= to Camera.from_points, by Camera.calibrate")
    given = [validation.number_array(line, f"lines[{i}]", ("n", 2)) for i, line in enumerate(lines)]
    for i, line in enumerate(given):
        if len(line) < _FEWEST_POINTS:
            raise ValueError(f"lines[{i}] must have at least {_FEWEST_POINTS} points, got {len(line)}")
    ahead = _matched(given, cameras)
    back = _matched([given[0], given[1][::-1]], cameras)
    turned = back[0] < ahead[0]
    views = [given[0], given[1][::-1] if turned else given[1]]
    points, residuals = _fitted(views, cameras, (back if turned else ahead)[1], count)
    found = CableInSpace(points, residuals, turned)
    off = max(found.rms, 0.5 * float(residuals[[0, -1]].max()))
    if not off < _FAR_OFF:
        raise ValueError(
            f"lines must be views of one cable, but their residuals are {off:.3g} px: check that both show the "
            "same whole cable, and the poses of the cameras"
        )
    return found


def _matched(lines: list[Array], cameras: Sequence[Camera]) -> tuple[float, Array]:
    """Match two lines by epipolar distances; return the mean cost [px^2] and the points in space, shape (n, 3)."""
    first, second = (resample(line, _MATCHED) for line in lines)
    rays = [
        np.column_stack([camera.directions(line), np.ones(len(line))])
        for camera, line in zip(cameras, (first, second), strict=True)
    ]
    turn = cameras[1].rotation @ cameras[0].rotation.T
    shift = cameras[1].translation - turn @ cameras[0].translation
    x, y, z = shift
    essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ turn
    in_second, in_first = rays[0] @ essential.T, rays[1] @ essential
    sizes = (in_second[:, None, :2] ** 2).sum(axis=2) + (in_first[None, :, :2] ** 2).sum(axis=2)
    focal = np.mean([np.sqrt(abs(np.linalg.det(camera.matrix[:2, :2]))) for camera in cameras])
    costs = focal**2 * (in_second @ rays[1].T) ** 2 / np.maximum(sizes, 1e-300)
    cost, pairs = _cheapest_path(costs)
    points = _intersections(rays[0][pairs[:, 0]], rays[1][pairs[:, 1]], cameras)
    distance = np.median(np.linalg.norm(points @ cameras[0].rotation.T + cameras[0].translation, axis=1))
    if not np.linalg.norm(shift) > _LEAST_BASELINE * distance:
        raise ValueError(
            f"cameras must be in two places, got a distance of {np.linalg.norm(shift):.3g} m between them: move one "
            "camera, or pass the poses of both in one world"
        )
    return cost, points


def _cheapest_path(costs: Array) -> tuple[float, NDArray[np.intp]]:
    """Return the mean cost and the steps, shape (n, 2), of the cheapest monotone path through a square matrix."""
    count = len(costs)
    total = np.full((count + 1, count + 1), np.inf)
    total[0, 0] = 0.0
    for diagonal in range(2 * count - 1):
        i = np.arange(max(0, diagonal - count + 1), min(diagonal, count - 1) + 1)
        j = diagonal - i
        before = np.minimum(total[i, j], np.minimum(total[i, j + 1], total[i + 1, j]) + _SIDEWAYS)
        total[i + 1, j + 1] = before + costs[i, j]
    row = column = count - 1
    path = [(row, column)]
    while row > 0 or column > 0:
        beside = total[row, column + 1] + _SIDEWAYS, total[row + 1, column] + _SIDEWAYS
        best = int(np.argmin((total[row, column], *beside)))
        row, column = row - (best != 2), column - (best != 1)
        path.append((row, column))
    return float(total[-1, -1] / count), np.array(path[::-1], np.intp)


def _intersections(first: Array, second: Array, cameras: Sequence[Camera]) -> Array:
    """Return the points that are nearest to pairs of lines of sight, shape (n, 3)."""
    ways = [rays @ camera.rotation for rays, camera in zip((first, second), cameras, strict=True)]
    eyes = [-camera.rotation.T @ camera.translation for camera in cameras]
    normals = [np.eye(3) - w[:, :, None] * w[:, None, :] / (w**2).sum(axis=1)[:, None, None] for w in ways]
    right = sum((n @ eye for n, eye in zip(normals, eyes, strict=True)), np.zeros(3))
    return np.asarray(np.linalg.solve(sum(normals) + _DAMPING * np.eye(3), right[..., None])[..., 0])


def _fitted(lines: list[Array], cameras: Sequence[Camera], points: Array, count: int) -> tuple[Array, Array]:
    """Fit points in space to both lines; return them and their distances from the lines [px]."""
    dense = [resample(line, max(401, int(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()))) for line in lines]
    x = resample(_smoothed(points), count)
    places = [np.linspace(0.0, 1.0, count)] * 2
    window = 0.5  # wide at first: points at equal distances in space are not so in the pictures
    residuals = np.zeros((count, 2))
    for _ in range(_ITERATIONS):
        rows, misfits = [], []
        for k in (0, 1):
            pixels, slopes = _seen(cameras[k], x)
            target, normal, places[k] = _nearest(dense[k], pixels, places[k], window)
            residuals[:, k] = ((pixels - target) * normal).sum(axis=1)
            jacobian = np.zeros((count, count, 3))
            jacobian[np.arange(count), np.arange(count)] = np.einsum("nij,ni->nj", slopes, normal)
            rows.append(jacobian.reshape(count, -1))
            misfits.append(residuals[:, k])
            for node, end in ((0, dense[k][0]), (count - 1, dense[k][-1])):
                ends = np.zeros((2, count, 3))
                ends[:, node] = slopes[node]
                rows.append(ends.reshape(2, -1))
                misfits.append(pixels[node] - end)
        scale = float(np.mean(np.linalg.norm(slopes, axis=(1, 2)))) / np.sqrt(2.0)  # [px/m]
        for matrix, misfit in _regular(x, _SMOOTH * scale):
            rows.append(matrix)
            misfits.append(misfit)
        step = np.linalg.lstsq(np.vstack(rows), -np.concatenate(misfits), rcond=1e-12)[0].reshape(-1, 3)
        x = x + step
        window = _WINDOW
        if np.abs(step).max() * scale < 0.01:
            break
    for k in (0, 1):
        pixels = cameras[k].project(x)
        target, normal, places[k] = _nearest(dense[k], pixels, places[k], window)
        residuals[:, k] = np.abs(((pixels - target) * normal).sum(axis=1))
        residuals[[0, -1], k] = np.linalg.norm(pixels[[0, -1]] - dense[k][[0, -1]], axis=1)
    return x, residuals


def _smoothed(points: Array) -> Array:
    """Return means over windows along a line, so that its length is not that of its noise."""
    reach = max(1, len(points) // 40)
    padded = np.concatenate([[points[0]] * reach, points, [points[-1]] * reach])
    sums = np.cumsum(np.vstack([np.zeros(3), padded]), axis=0)
    return np.asarray((sums[2 * reach + 1 :] - sums[: -2 * reach - 1]) / (2 * reach + 1))


def _seen(camera: Camera, x: Array) -> tuple[Array, Array]:
    """Return the pixels of points and their derivatives, shape (n, 2, 3) [px/m]."""
    count = len(x)
    step = 1e-5 * float(np.linalg.norm(x @ camera.rotation.T + camera.translation, axis=1).mean())
    moved = np.concatenate([x, *(x + step * axis for axis in np.eye(3))])
    here, *beside = camera.project(moved).reshape(4, count, 2)
    return here, np.stack([(each - here) / step for each in beside], axis=2)


def _nearest(line: Array, pixels: Array, places: Array, window: float) -> tuple[Array, Array, Array]:
    """Return the nearest points of a line about known places, the normals there, and the new places, 0 to 1."""
    arc = np.linspace(0.0, 1.0, len(line))
    squares = ((pixels[:, None] - line[None]) ** 2).sum(axis=2)
    squares[np.abs(places[:, None] - arc[None]) > window] = np.inf
    at = np.argmin(squares, axis=1)
    tangents = np.gradient(line, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1), 1e-9)[:, None]
    normals = np.column_stack([-tangents[:, 1], tangents[:, 0]])
    return line[at], normals[at], arc[at]


def _regular(x: Array, weight: float) -> list[tuple[Array, Array]]:
    """Rows and residuals of third differences and of differences of the lengths of neighbouring edges."""
    count = len(x)
    third = np.diff(np.eye(count), n=3, axis=0)
    matrix = weight * np.kron(third, np.eye(3))
    edges = np.diff(x, axis=0)
    lengths = np.maximum(np.linalg.norm(edges, axis=1), 1e-12)
    slope = np.zeros((count - 1, count, 3))
    index = np.arange(count - 1)
    slope[index, index + 1] = edges / lengths[:, None]
    slope[index, index] = -edges / lengths[:, None]
    even: Array = weight * np.diff(slope, axis=0).reshape(count - 2, -1)
    turns, uneven = matrix @ x.ravel(), weight * np.diff(lengths)
    return [(np.asarray(matrix, np.float64), np.asarray(turns, np.float64)), (even, np.asarray(uneven, np.float64))]
