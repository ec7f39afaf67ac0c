"""Minimax problems: the curve near given points, and the tension along a cable, that a floor holds most easily."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["fourth_differences", "least_tension", "smooth"]

FloatArray = npt.NDArray[np.float64]
_POWERS = (2, 4, 8)  # powers of the norm that replaces the greatest value
_ROUNDS = 12  # iterations of Newton's method at each
_BARRIER = 1e-2


class _Norm:
    """Sum of |r|^p / p over rows r in the plane, r = matrix x + offset with all first components before all second."""

    def __init__(self, matrix: Any, offset: FloatArray) -> None:
        self.matrix, self.offset = matrix, offset
        self.power, self.scale = 2, 1.0

    def sizes(self, x: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm((self.matrix @ x + self.offset).reshape(2, -1), axis=0))

    def rounding(self, x: FloatArray) -> float:
        """Return a bound on the rounding error of the rows."""
        return float(np.finfo(float).eps * (abs(self.matrix) @ np.abs(x) + np.abs(self.offset)).max())

    def value(self, x: FloatArray) -> float:
        return float(((self.sizes(x) / self.scale) ** self.power).sum() / self.power)

    def derivatives(self, x: FloatArray) -> tuple[FloatArray, Any]:
        """Gradient |r|^(p-2) r, through the matrix, and B of the Hessian B^T B.

        B = (|r|^(p-2) (1 + (p-2) rr / |r|^2))^(1/2) matrix.
        """
        rows = (self.matrix @ x + self.offset).reshape(2, -1)
        size = np.linalg.norm(rows, axis=0)
        weight = (size / self.scale) ** (self.power - 2) / self.scale**2
        direction = rows / np.maximum(size, 1e-300)
        root = np.sqrt(weight)
        inner = _blocks(root, (np.sqrt(self.power - 1.0) - 1.0) * root, direction)
        return self.matrix.T @ (weight * rows).ravel(), inner @ self.matrix


def _blocks(plain: FloatArray, along: FloatArray, direction: FloatArray) -> Any:
    """Matrix of 2 x 2 blocks plain I + along dd, one a point, over all first and then all second components."""
    from scipy import sparse

    count = direction.shape[1]
    mixed = along * direction[0] * direction[1]
    blocks = [[plain + along * direction[0] ** 2, mixed], [mixed, plain + along * direction[1] ** 2]]
    # The two entries of a row follow each other. `bmat` of four diagonal matrices takes twenty times as long.
    columns = np.tile(np.arange(2 * count).reshape(2, count).T.ravel(), 2)
    starts = np.arange(0, 4 * count + 1, 2)
    return sparse.csr_matrix((np.moveaxis(np.array(blocks), 1, 2).ravel(), columns, starts), (2 * count, 2 * count))


def _solved(root: Any, rest: Any, right: FloatArray) -> FloatArray:
    """Solves (B^T B + rest) x = right, y = B x being unknown too.

    Fourth differences over short spacings know nothing of straight lines, and their squares, 1 / spacing^8, are above
    the rest by more than rounding bears [Bjorck 1996, sec. 2.5.3].
    """
    from scipy import sparse
    from scipy.sparse.linalg import splu

    unit = float(np.sqrt(rest.diagonal().max()))
    matrix = sparse.bmat([[unit * sparse.identity(root.shape[0]), -root], [root.T, rest / unit]], format="csc")
    found = splu(matrix).solve(np.concatenate([np.zeros(root.shape[0]), right / unit]))
    return np.asarray(found[root.shape[0] :])


def _minimised(norm: _Norm, x: FloatArray, extra: Any) -> FloatArray:
    """Minimise norms of increasing power by Newton's method. `extra(x)` is an additional term with its derivatives."""
    for power in _POWERS:
        scale = float(norm.sizes(x).max())
        if scale <= norm.rounding(x):  # a straight line
            break
        norm.power, norm.scale = power, scale
        for _ in range(_ROUNDS):
            added, slope, bend = extra(x)
            gradient, root = norm.derivatives(x)
            step = -_solved(root, bend, gradient + slope)
            value, length = norm.value(x) + added, 1.0
            while length > 1e-4 and not norm.value(x + length * step) + extra(x + length * step)[0] < value:
                length /= 2
            if length <= 1e-4:
                break
            x = x + length * step
    return x


def smooth(points: FloatArray, spacing: float, deviation: FloatArray) -> FloatArray:
    """Move evenly spaced points of a curve, each by at most its `deviation`, to minimise the force on the floor.

    Without tension, the force per length of a floor on an elastic rod is EI x'''', with x'' = x''' = 0 at both ends.
    Its greatest size is a convex function of the points. The function minimises its 8-norm, with a logarithmic barrier
    at `deviation`.

    Parameters
    ----------
    points : ndarray of shape (n, 2) [m]
    spacing : float [m]
    deviation : ndarray of shape (n,) [m]

    Returns
    -------
    ndarray of shape (n, 2) [m]
    """
    from scipy import sparse

    fourth = fourth_differences(len(points)) / spacing**4
    both = sparse.block_diag([fourth, fourth]).tocsr()
    raw = points.T.ravel()

    def barrier(x: FloatArray) -> tuple[float, FloatArray, Any]:
        away = (x - raw).reshape(2, -1) / deviation
        room = 1.0 - (away**2).sum(0)
        if not np.all(room > 0.0):
            return np.inf, away.ravel(), sparse.identity(len(x))
        slope = 2.0 * _BARRIER / deviation * away / room
        bend = _blocks(2 * _BARRIER / (deviation**2 * room), 4 * _BARRIER / (deviation * room) ** 2, away)
        return float(-_BARRIER * np.log(room).sum()), slope.ravel(), bend

    start = _quadratic(both, raw, deviation)
    return _minimised(_Norm(both, np.zeros(2 * len(points))), start, barrier).reshape(2, -1).T


def least_tension(middle: FloatArray, across: FloatArray, along: FloatArray, spacing: float) -> FloatArray:
    """Size of (across - middle n, along + n') on each interval, for the n that minimises the greatest size.

    Parameters
    ----------
    middle, across, along : ndarray of shape (intervals,)
        Values on the intervals; n is 0 at the beginning of the first one.
    spacing : float

    Returns
    -------
    ndarray of shape (intervals,)
    """
    from scipy import sparse

    count = len(middle)
    shape = (count, count)
    mean = sparse.diags([0.5 * middle[1:], 0.5 * middle], [-1, 0], shape=shape)
    slope = sparse.diags([-1.0 / spacing, 1.0 / spacing], [-1, 0], shape=shape)
    norm = _Norm(sparse.vstack([-mean, slope]).tocsr(), np.concatenate([across, along]))
    light = 1e-9 * sparse.identity(count)  # otherwise any tension would be a solution where none is needed

    def ridge(x: FloatArray) -> tuple[float, FloatArray, Any]:
        return 0.5e-9 * float(x @ x), 1e-9 * x, light

    return norm.sizes(_minimised(norm, np.zeros(count), ridge))


def fourth_differences(count: int) -> Any:
    """Fourth differences at every point.

    Before the first point and behind the last one the curve continues straight, as at a free end.
    """
    from scipy import sparse

    matrix = sparse.diags([1.0, -4.0, 6.0, -4.0, 1.0], [-2, -1, 0, 1, 2], shape=(count, count)).tolil()
    # x(-1) = 2 x0 - x1, x(-2) = 3 x0 - 2 x1.
    matrix[0, :3] = [6 - 8 + 3, -4 + 4 - 2, 1]
    matrix[1, :4] = [-4 + 2, 6 - 1, -4, 1]
    matrix[count - 2 :] = matrix[:2][::-1, ::-1]
    return matrix.tocsr()


def _quadratic(both: Any, raw: FloatArray, deviation: FloatArray) -> FloatArray:
    """Return least squares of floor forces and distances, weighted such that the greatest distance is 0.9."""
    from scipy import sparse

    near = np.tile((deviation.min() / deviation) ** 2, 2)

    def solved(log_weight: float) -> FloatArray:
        return _solved(np.exp(0.5 * log_weight) * both, sparse.diags(near), near * raw)

    def farthest(x: FloatArray) -> float:
        return float((np.linalg.norm((x - raw).reshape(2, -1), axis=0) / deviation).max())

    low, high = np.log(1e-30), np.log(1e-4)
    if farthest(solved(high)) <= 0.9:
        return solved(high)
    for _ in range(20):
        middle = 0.5 * (low + high)
        if farthest(solved(middle)) > 0.9:
            high = middle
        else:
            low = middle
    return solved(low)
