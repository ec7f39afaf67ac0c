"""Pictures with the results of tracing."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe.common.extras import require
from withe.perception.images import check_image
from withe.perception.results import Tracing
from withe.perception.tracker import TrackedCable

__all__ = ["draw", "draw_tracked"]

_FRACTION_BITS = 4  # OpenCV draws between pixels when coordinates are scaled by a power of two


def cable_colour(index: int) -> tuple[int, int, int]:
    """Return a bright colour of a cable, red, green, blue."""
    red, green, blue = colorsys.hsv_to_rgb((0.58 + 0.618034 * index) % 1.0, 0.85, 1.0)
    return round(255 * red), round(255 * green), round(255 * blue)


def draw(image: ArrayLike, tracing: Tracing) -> NDArray[np.uint8]:
    """Draw cables, their direction, crossings, joints and doubts over a picture.

    Parameters
    ----------
    image : array_like of shape (height, width, 3)
        Red, green, blue as uint8; grey and alpha are accepted.
    tracing : Tracing

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        A dot marks the first row of an open cable, a ring its last; at a crossing the upper cable is drawn last, with
        a dark seam; squares are joints, triangles ambiguous places.

    Raises
    ------
    ValueError
        The argument is not an image.
    ImportError
        OpenCV is not installed.
    """
    cv2 = require("cv2", "vision")
    picture = np.ascontiguousarray(check_image(image) // 2 + 20)

    def line(points: NDArray[np.float64], closed: bool, colour: tuple[int, int, int], thickness: int) -> None:
        cv2.polylines(picture, [_fixed(points)[:, None]], closed, colour, thickness, cv2.LINE_AA, _FRACTION_BITS)

    for index, (points, closed) in enumerate(zip(tracing.centrelines, tracing.closed, strict=True)):
        line(points, closed, cable_colour(index), 2)
    for crossing in tracing.crossings:
        cable, row = crossing.over
        points = tracing.centrelines[cable]
        reach = max(3, int(tracing.widths[cable][row]))
        rows = np.arange(row - reach, row + reach + 1)
        if tracing.closed[cable]:
            rows %= len(points)
        else:
            rows = rows[(rows >= 0) & (rows < len(points))]
        line(points[rows], False, (0, 0, 0), 5)
        line(points[rows], False, cable_colour(cable), 3)
    for index, (points, closed) in enumerate(zip(tracing.centrelines, tracing.closed, strict=True)):
        if closed:
            continue
        for point, filled in ((points[0], -1), (points[-1], 2)):
            center = tuple(int(v) for v in _fixed(point)[0])
            cv2.circle(picture, center, 5 << _FRACTION_BITS, cable_colour(index), filled, cv2.LINE_AA, _FRACTION_BITS)
    for joint in tracing.joints:
        x, y = (int(v) for v in np.round(joint.point))
        cv2.rectangle(picture, (x - 6, y - 6), (x + 6, y + 6), (255, 255, 255), 1)
    for doubt in tracing.ambiguous:
        corners = doubt.point + 10 * np.array([[0.0, -1.0], [0.87, 0.5], [-0.87, 0.5]])
        line(corners, True, (255, 255, 0), 1)
    return picture


def _fixed(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return points in fractions of a pixel, for OpenCV."""
    return np.round(np.atleast_2d(points) * (1 << _FRACTION_BITS)).astype(np.int32)


def draw_tracked(image: ArrayLike, cables: Sequence[TrackedCable]) -> NDArray[np.uint8]:
    """Draw tracked cables over a frame of a film.

    Parameters
    ----------
    image : array_like of shape (height, width, 3)
        Red, green, blue as uint8; grey and alpha are accepted.
    cables : sequence of TrackedCable

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Lines where cables are visible, rings at nodes that only the prior determines. A dot marks the first node, and
        the name stands beside it.

    Raises
    ------
    ValueError
        The argument is not an image.
    ImportError
        OpenCV is not installed.
    """
    cv2 = require("cv2", "vision")
    picture = np.ascontiguousarray(check_image(image) // 2 + 20)
    bits = _FRACTION_BITS

    for index, cable in enumerate(cables):
        colour = cable_colour(index)
        both = cable.visible[:-1] & cable.visible[1:]
        for i in np.flatnonzero(both):
            cv2.polylines(picture, [_fixed(cable.nodes[i : i + 2])[:, None]], False, colour, 2, cv2.LINE_AA, bits)
        for node, visible in zip(_fixed(cable.nodes), cable.visible, strict=True):
            if not visible:
                cv2.circle(picture, (int(node[0]), int(node[1])), 3 << bits, colour, 1, cv2.LINE_AA, bits)
        x, y = (int(v) for v in _fixed(cable.nodes[0])[0])
        cv2.circle(picture, (x, y), 5 << bits, colour, -1, cv2.LINE_AA, bits)
        column, row = (int(v) for v in np.round(cable.nodes[0]))
        place = min(max(column + 8, 2), picture.shape[1] - 90), min(max(row - 8, 14), picture.shape[0] - 4)
        cv2.putText(picture, cable.name, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)
    return picture
