"""A hanging strip in a picture from the side: the positions of its clamp and its tip."""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from withe.perception.images import check_image, read_image
from withe.perception.masks import border_filter

__all__ = ["strip_ends"]

FloatArray = npt.NDArray[np.float64]
_TIP = 10.0  # length at the end that determines the tip [px], at least four times the thickness


def strip_ends(image: npt.ArrayLike | str | os.PathLike[str]) -> FloatArray:
    """Pixels of the clamp, where the strip enters the picture at its border, and of the tip, shape (2, 2).

    The centre of the first pixel is (0, 0), so that the left border is at x = -0.5.

    Raises
    ------
    ValueError
        A picture without a strip that comes in from the left or the right and hangs down.
    """
    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    mask = _strip(border_filter(picture))
    left, right = mask[:, 0].any(), mask[:, -1].any()
    if left == right:
        raise ValueError(
            "image must show a strip that enters level from the left or right border, where it is clamped, and "
            f"ends inside, but the foreground touches {'both' if left else 'neither'} of the two borders"
        )
    if right:
        picture, mask = picture[:, ::-1], mask[:, ::-1]
    ink = _ink(picture, mask)
    rows = np.arange(len(ink)) + 0.5
    clamp = float((ink[:, :2].sum(axis=1) * rows).sum() / ink[:, :2].sum())
    x, y = _tip(ink)
    if y <= clamp or mask[-1].any() or mask[0].any():
        raise ValueError("image must show a strip that hangs down and ends inside, got one that does not")
    ends = np.array([(0.0, clamp), (x, y)]) - 0.5
    if right:
        ends[:, 0] = picture.shape[1] - 1.0 - ends[:, 0]
    return ends


def _strip(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """The largest thing in a mask."""
    from scipy.ndimage import label

    names, count = label(mask, np.ones((3, 3)))
    if count == 0:
        raise ValueError("image must show a strip before a plain background, got a picture without a sheet")
    largest = 1 + int(np.argmax(np.bincount(names.ravel())[1:]))
    return np.asarray(names == largest)


def _ink(picture: npt.NDArray[np.uint8], mask: npt.NDArray[np.bool_]) -> FloatArray:
    """Share of each pixel that the strip covers, up to a factor."""
    from scipy.ndimage import binary_dilation

    near = binary_dilation(mask, iterations=2)
    background = np.median(picture[~near], axis=0)
    colour = np.median(picture[mask], axis=0) - background
    ink = (picture - background) @ colour / (colour @ colour)
    return np.where(near, np.maximum(ink, 0.0), 0.0)


def _tip(ink: FloatArray) -> tuple[float, float]:
    """End of a strip that goes right and down, x and y [px]: as far on as its ink reaches at its thickness."""
    rows, columns = np.nonzero(ink > 0.3 * ink.max())
    points = np.stack([columns, rows], axis=1) + 0.5
    last = points[np.argmax(points.sum(axis=1))]
    reach = max(_TIP, 4.0 * len(points) / float(np.ptp(points, axis=0).max() + 1.0))
    y, x = np.nonzero(ink)
    places, weights = np.stack([x, y], axis=1) + 0.5, ink[y, x]
    near = np.linalg.norm(places - last, axis=1) < 2.0 * reach
    places, weights = places[near], weights[near]
    centre = np.average(places, axis=0, weights=weights)
    _, axes = np.linalg.eigh(np.cov(places.T, aweights=weights))
    way = axes[:, 1] * np.sign(axes[:, 1] @ (last - centre))
    along = (places - centre) @ way
    end = (last - centre) @ way
    begin, middle = end - 1.5 * reach, end - 0.5 * reach
    density = weights[(along > begin) & (along < middle)].sum() / (middle - begin)
    tip = centre + (middle + weights[along > middle].sum() / density) * way
    return float(tip[0]), float(tip[1])
