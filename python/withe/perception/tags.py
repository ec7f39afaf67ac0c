"""AprilTags in pictures, and the plane that they lie in."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe.common import validation
from withe.common.extras import require
from withe.common.keywords import keyword_hints
from withe.common.short_repr import ShortRepr
from withe.perception.camera import Camera
from withe.perception.images import check_image, read_image
from withe.perception.tag_edges import refine_square

__all__ = ["TagDetection", "detect_tags"]

Array = NDArray[np.float64]
Family = Literal["16h5", "25h9", "36h10", "36h11"]


@dataclass(frozen=True, eq=False, repr=False)
class TagDetection(ShortRepr):
    """Tags of a picture, in the order of their numbers.

    Attributes
    ----------
    numbers : tuple of int
    corners : ndarray of shape (tags, 4, 2) [px]
        Corners of the black squares, clockwise from the upper left of the tag. The centre of the first pixel is (0, 0).
    centers : ndarray of shape (tags, 2) [px]
        Intersections of the diagonals.
    angles : ndarray of shape (tags,) [rad]
        Angles of the tags' x axes in the picture, clockwise from the x axis of the picture.
    positions : ndarray of shape (tags, 3) [m], or None
        Positions of the centres relative to the camera, on the plane that fits all tags. None without `camera_matrix`.
    normal : ndarray of shape (3,), or None
        Normal of that plane, towards the camera.
    """

    numbers: tuple[int, ...]
    corners: Array
    centers: Array
    angles: Array
    positions: Array | None
    normal: Array | None

    def pixels(self, numbers: Sequence[int]) -> Array:
        """Return the centres of the tags with these numbers.

        Parameters
        ----------
        numbers : sequence of int

        Returns
        -------
        ndarray of shape (n, 2) [px]
            NaN for tags that were not found.
        """
        places = {number: i for i, number in enumerate(self.numbers)}
        missing = np.full(2, np.nan)
        found = [self.centers[places[n]] if n in places else missing for n in numbers]
        return np.array(found, np.float64).reshape(-1, 2)


@keyword_hints
def detect_tags(
    image: ArrayLike | str | os.PathLike[str],
    camera_matrix: ArrayLike | None = None,
    size: float = 0.012,
    family: Family = "36h11",
    *,
    distortion: ArrayLike | None = None,
) -> TagDetection:
    """Find AprilTags in a picture [Olson 2011; Wang and Olson 2016], by OpenCV.

    All tags must lie in one plane, because one small tag alone determines its depth and tilt badly.

    Parameters
    ----------
    image : array_like of shape (height, width) or (height, width, 3), uint8, or path
    camera_matrix : array_like of shape (3, 3), optional [px]
        Matrix of the camera, for positions in metres.
    size : float [m]
        Side of the tags' black squares.
    family : {"16h5", "25h9", "36h10", "36h11"}
    distortion : array_like of shape (4,) or (5,), optional
        k1, k2, p1, p2 and k3 of the lens.

    Returns
    -------
    TagDetection
        Detection, which is empty if no tag was found.

    Raises
    ------
    ValueError
        Not a picture, a singular matrix, a size that is not positive, or a tag outside of the range of the distortion.
    ImportError
        OpenCV is not installed.
    """
    validation.choice(family, "family", ("16h5", "25h9", "36h10", "36h11"))
    side = validation.positive(size, "size")
    if camera_matrix is None and distortion is not None:
        raise ValueError("camera_matrix must be given where distortion is, got None")
    camera = None if camera_matrix is None else Camera(camera_matrix, distortion)
    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    numbers, corners = _quads(picture, family)
    if len({*numbers}) < len(numbers):
        again = next(number for number in numbers if numbers.count(number) > 1)
        raise ValueError(f"image must show every tag once, got tag {again} {numbers.count(again)} times")
    order = np.argsort(numbers)
    numbers, corners = [numbers[i] for i in order], corners[order]
    centers = np.array([_crossing(quad) for quad in corners]).reshape(-1, 2)
    along = (corners[:, 1] + corners[:, 2] - corners[:, 0] - corners[:, 3]) / 2.0
    angles = np.arctan2(along[:, 1], along[:, 0])
    positions = normal = None
    if camera is not None and len(numbers) > 0:
        positions, normal = _on_plane(camera._normalised(corners.reshape(-1, 2)).reshape(-1, 4, 2), side)
    return TagDetection(tuple(numbers), corners, centers, angles, positions, normal)


def _quads(picture: NDArray[np.uint8], family: str) -> tuple[list[int], Array]:
    """Numbers and corners of the black squares.

    OpenCV finds them. Of its refinements, that for AprilTags is half a pixel off in x and y, and the others 0.2 px
    on the mean: ours follows the sides.
    """
    cv2: Any = require("cv2", "vision")
    gray = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = min(0.03, 48.0 / max(gray.shape))  # tags of 12 px and more
    # Samples along a cell. With OpenCV's 4, first corners that are a pixel off made cells of 3 px illegible.
    parameters.perspectiveRemovePixelPerCell = 8
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}"))
    corners, numbers, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(gray)
    if numbers is None:
        return [], np.zeros((0, 4, 2))
    cells = dictionary.markerSize + 2
    quads = [refine_square(gray, quad, cells) for quad in np.array(corners, np.float64).reshape(-1, 4, 2)]
    return [int(number) for number in np.ravel(numbers)], np.array(quads)


def _crossing(quad: Array) -> Array:
    """Return the crossing of the diagonals of a quadrilateral, which is the image of the square's centre."""
    start, other = quad[0], quad[1]
    first, second = quad[2] - start, quad[3] - other
    share = np.linalg.solve(np.stack([first, -second], axis=1), other - start)[0]
    return np.asarray(start + share * first)


def _on_plane(directions: Array, side: float) -> tuple[Array, Array]:
    """Centres of squares in one plane, seen in these directions, and its normal.

    Least squares of the tags' corners in the directions x/z, y/z over the plane and every tag's place and turn in it,
    the squares being of one size.

    Parameters
    ----------
    directions : ndarray of shape (tags, 4, 2)
    side : float [m]
    """
    from scipy.optimize import least_squares

    tags = len(directions)
    middles = np.array([_crossing(quad) for quad in directions])
    sides = np.linalg.norm(np.roll(directions, -1, axis=1) - directions, axis=2).mean()
    square = 0.5 * side * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    across = (directions[:, 1] + directions[:, 2] - directions[:, 0] - directions[:, 3]) / 2.0
    turns = np.arctan2(across[:, 1], across[:, 0])

    def frame(tilt: Array) -> Array:
        """Two directions in the plane z = z0 + tilt . (x, y), and its normal towards the camera, as rows."""
        normal = np.array([tilt[0], tilt[1], -1.0])
        normal /= np.linalg.norm(normal)
        first = np.array([1.0, 0.0, tilt[0]]) / np.hypot(1.0, tilt[0])
        return np.stack([first, np.cross(first, normal), normal])

    def points(unknowns: Array) -> Array:
        depth, tilt = np.exp(unknowns[0]), unknowns[1:3]
        places, angles = unknowns[3 : 3 + 2 * tags].reshape(-1, 2), unknowns[3 + 2 * tags :]
        rays = np.column_stack([places, np.ones(tags)])
        distance = depth / (1.0 - places @ tilt)
        cosine, sine = np.cos(angles), np.sin(angles)
        turned = np.einsum("dct,kc->tkd", np.array([[cosine, -sine], [sine, cosine]]), square)
        return np.asarray((rays * distance[:, None])[:, None] + turned @ frame(tilt)[:2])

    def residual(unknowns: Array) -> Array:
        seen = points(unknowns)
        return np.asarray((seen[..., :2] / seen[..., 2:] - directions).ravel() / sides)

    best = None
    for tilt in ((0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)):  # a plane tilted the other way is near
        begin = np.concatenate([[np.log(side / sides)], tilt, middles.ravel(), turns])
        found = least_squares(residual, begin, xtol=1e-12, ftol=1e-12)
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    places = points(best.x).mean(axis=1)
    return places, frame(best.x[1:3])[2]
