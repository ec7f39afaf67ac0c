"""The surface on which a function on a grid is zero, as triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["surface_net"]

FloatArray = npt.NDArray[np.float64]


def surface_net(values: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return the surface between negative and positive values of a grid.

    Each cell that the surface cuts has one vertex, the mean of the points at which the surface cuts its edges
    [Gibson 1998, Constrained elastic surface nets].

    Parameters
    ----------
    values : ndarray of shape (nx, ny, nz)
    low, high : ndarray of shape (3,) [m]
        First and last point of the grid.

    Returns
    -------
    vertices : ndarray of shape (n, 3) [m]
    triangles : ndarray of int, shape (m, 3)
        Rows of the vertices, counter-clockwise from the positive side.
    """
    shape = np.array(values.shape)
    inside = values < 0.0
    total, count = np.zeros((*(shape - 1), 3)), np.zeros(shape - 1)
    crossings = []
    for axis in range(3):
        tail, head = (np.take(values, range(start, start + shape[axis] - 1), axis=axis) for start in (0, 1))
        places = np.argwhere((tail < 0.0) != (head < 0.0))
        index = tuple(places.T)
        share = tail[index] / (tail[index] - head[index])
        points = places.astype(float)
        points[:, axis] += share
        crossings.append((places, inside[index]))
        others = [k for k in range(3) if k != axis]
        for first in (0, 1):
            for second in (0, 1):
                cells = places.copy()
                cells[:, others[0]] -= first
                cells[:, others[1]] -= second
                known = ((cells >= 0) & (cells < shape - 1)).all(axis=1)
                np.add.at(total, tuple(cells[known].T), points[known])
                np.add.at(count, tuple(cells[known].T), 1.0)
    cut = count > 0.0
    number = np.full(shape - 1, -1)
    number[cut] = np.arange(int(cut.sum()))
    vertices = low + total[cut] / count[cut][:, None] * (high - low) / (shape - 1)
    triangles = []
    for axis, (places, leaves) in enumerate(crossings):
        # The four cells about an edge, counter-clockwise as seen from its head.
        first, second = (axis + 1) % 3, (axis + 2) % 3
        around = []
        for back, aside in ((0, 0), (1, 0), (1, 1), (0, 1)):
            cells = places.copy()
            cells[:, first] -= back
            cells[:, second] -= aside
            around.append(cells)
        inner = np.all([((cells >= 0) & (cells < shape - 1)).all(axis=1) for cells in around], axis=0)
        a, b, c, d = (number[tuple(cells[inner].T)] for cells in around)
        out = leaves[inner][:, None]
        for corners in ((a, b, c), (a, c, d)):
            triangle = np.column_stack(corners)
            triangles.append(np.where(out, triangle, triangle[:, ::-1]))
    return vertices, np.concatenate(triangles)
