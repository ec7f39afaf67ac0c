"""Places of sheets in pictures from above."""

from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.common.keywords import keyword_hints
from withe.folding.paper import Paper
from withe.perception.camera import Camera
from withe.perception.images import check_image, read_image
from withe.perception.masks import MaskFunction, border_filter

__all__ = ["SeenEdge", "camera_over", "find_edge", "overhead_camera"]

FloatArray = npt.NDArray[np.float64]
_CORNERS, _QUALITY, _APART = 40, 0.05, 12.0  # greatest number; least quality, relative to the best; least distance [px]
_BLUR, _BLOCK = 1.5, 7  # [px], since steps of single pixels along an edge look like corners
_WINDOW = (5, 5)  # half size of the window that refines a corner [px]
_BORDER = 8  # distance from the border of the picture at which a sheet is cut off [px]
_PICTURE = (640, 480)  # width and height of a picture [px]
_HEIGHT, _PIXEL = 0.6, 5e-4  # height of an overhead camera, and size of a pixel on the table [m]
_EDGE_SHARE = 1 / 1.1  # greatest length of a far edge, relative to the height of a picture
_OFF = 0.01  # allowed error of the distance of two corners, relative to the width
_TURN = np.radians(20.0)  # greatest angle of an edge


@dataclass(frozen=True)
class SeenEdge:
    """The far edge of a sheet, as a camera sees it; of one that ends in a corner, that.

    Attributes
    ----------
    x : float [m]
        Of its middle.
    angle : float [rad]
        By which it is turned on the table, from y towards -x; NaN of a corner.
    corners : ndarray of shape (2, 2), or (1, 2) [m]
        x and y; that of less y first.
    """

    x: float
    angle: float
    corners: FloatArray


@keyword_hints
def overhead_camera(x: float, *, height: float = _HEIGHT, pixel: float = _PIXEL) -> Camera:
    """Make a camera of 640 by 480 pixels over the table that looks straight down on the middle of an edge.

    Parameters
    ----------
    x : float [m]
        Of the point under it.
    height : float [m]
        Over the table.
    pixel : float [m]
        Size of a pixel there.

    Returns
    -------
    withe.perception.Camera
        Whose rows run along x.

    Raises
    ------
    ValueError
        Sizes that are not positive.

    Examples
    --------
    >>> import withe
    >>> withe.folding.overhead_camera(0.297).project([[0.297, 0.0, 0.0]])
    array([[319.5, 239.5]])
    """
    height, pixel = validation.positive(height, "height"), validation.positive(pixel, "pixel")
    focal, down = height / pixel, np.diag([1.0, -1.0, -1.0])
    place = np.array([validation.number(x, "x"), 0.0, height])
    middle = 0.5 * (_PICTURE[0] - 1), 0.5 * (_PICTURE[1] - 1)
    lens = [[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]]
    return Camera(lens, rotation=down, translation=-down @ place)


def camera_over(paper: Paper) -> Camera:
    """Return an `overhead_camera` over the far edge of a flat sheet, hung as high as the edge's width asks for.

    Both corners of the edge have to be in the picture: `find_edge` knows the edge by them.
    """
    wide = float(paper.width_at(paper.length))
    higher = max(1.0, wide / (_EDGE_SHARE * _PICTURE[1] * _PIXEL))
    return overhead_camera(paper.length, height=higher * _HEIGHT, pixel=higher * _PIXEL)


@keyword_hints
def find_edge(
    image: npt.ArrayLike | str | os.PathLike[str], camera: Camera, paper: Paper, *, mask: MaskFunction | None = None
) -> SeenEdge:
    """Find the far edge of a sheet that lies on the table.

    The sheet is told from the table by colour, and its corners are those of Shi and Tomasi, refined [dissertation,
    7.6.2]. Of all pairs of corners that are as far from each other as the sheet is wide there it is the farthest; of a
    sheet that ends in a corner, the farthest corner.

    Parameters
    ----------
    image : path, or array_like of shape (height, width, 3) of uint8
        Red, green, blue.
    camera : withe.perception.Camera
        Over the table, z = 0.
    paper : Paper
    mask : callable, optional
        From the image to where the sheet is, such as a `withe.perception.color_filter`; by default what differs from
        the picture's border.

    Returns
    -------
    SeenEdge

    Raises
    ------
    ValueError
        A picture in which there is no such edge.
    ImportError
        OpenCV is not installed.

    Examples
    --------
    >>> import withe
    >>> sheet = withe.folding.SimulatedSheet(withe.folding.Paper.a4())
    >>> camera = withe.folding.overhead_camera(0.297)
    >>> seen = withe.folding.find_edge(sheet.picture(camera), camera, sheet.paper)
    >>> bool(abs(seen.x - 0.297) < 5e-4)
    True
    """
    cv2 = require("cv2", "vision")
    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    inside = np.asarray((border_filter if mask is None else mask)(picture), dtype=bool)
    if not inside.any():
        raise ValueError("image must show a sheet on a table of another colour, got a picture without a sheet")
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    near = cv2.dilate(inside.astype(np.uint8), np.ones((7, 7), np.uint8))
    near[:_BORDER], near[-_BORDER:], near[:, :_BORDER], near[:, -_BORDER:] = 0, 0, 0, 0
    soft = cv2.GaussianBlur(inside.astype(np.uint8) * 255, (0, 0), _BLUR)
    found = cv2.goodFeaturesToTrack(soft, _CORNERS, _QUALITY, _APART, mask=near, blockSize=_BLOCK)
    corners = np.empty((0, 2)) if found is None else _refined(cv2, grey, found)
    places = camera.to_plane(corners)[:, :2] if len(corners) else corners
    wide = float(paper.width_at(paper.length))
    best = _farthest_edge(places, wide) if wide > 0.0 else _farthest_corner(places)
    if best is None and wide == 0.0:
        raise ValueError("image must show the sheet's far corner, got no corner")
    if best is None:
        raise ValueError(
            f"image must show the corners of the sheet's far edge, {wide:g} m apart, got {len(places)} corners "
            "and no two that are so"
        )
    return best


def _farthest_corner(places: FloatArray) -> SeenEdge | None:
    if not len(places):
        return None
    far = places[np.argmax(places[:, 0])]
    return SeenEdge(float(far[0]), float("nan"), far[None])


def _farthest_edge(places: FloatArray, width: float) -> SeenEdge | None:
    best: SeenEdge | None = None
    for i, j in combinations(range(len(places)), 2):
        pair = places[[i, j]] if places[i, 1] < places[j, 1] else places[[j, i]]
        along = pair[1] - pair[0]
        angle = float(np.arctan2(-along[0], along[1]))
        fits = abs(np.hypot(*along) / width - 1.0) < _OFF and abs(angle) < _TURN
        if fits and (best is None or pair[:, 0].mean() > best.x):
            best = SeenEdge(float(pair[:, 0].mean()), angle, pair)
    return best


def _refined(cv2: Any, grey: npt.NDArray[np.uint8], found: npt.NDArray[np.float32]) -> FloatArray:
    """Corners to fractions of a pixel: where edges around them meet."""
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    return np.asarray(cv2.cornerSubPix(grey, found.copy(), _WINDOW, (-1, -1), stop), dtype=float).reshape(-1, 2)
