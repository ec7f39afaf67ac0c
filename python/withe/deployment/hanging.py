"""How a cable that is bent by itself hangs from its jaw, and what that tells of it."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.deployment.cable import pixel_size
from withe.perception.masks import border_filter
from withe.perception.tracing import check_image, read_image

__all__ = ["MeasuredCurvature", "measure_curvature"]

FloatArray = npt.NDArray[np.float64]
_SEEN = 5.0  # [Lgb] of the cable, from its free end, that a picture must show: above it hangs straight
_USED = 8.0  # [Lgb]: farther up the jaw may bend it
_ERROR = 5e-4  # [m]


@dataclass(frozen=True)
class MeasuredCurvature:
    """A natural curvature with its standard deviation.

    Attributes
    ----------
    curvature, error : float [1/m]
    """

    curvature: float
    error: float


def measure_curvature(
    gravito_bending_length: float,
    *,
    aside: float | None = None,
    image: str | os.PathLike[str] | npt.ArrayLike | None = None,
    scale: float | None = None,
    error: float | None = None,
) -> MeasuredCurvature:
    """Find how a cable bends by itself, with a ruler or a camera.

    Let it hang from its jaw, the free end off the floor. Its weight pulls it straight but for the last few Lgb, and
    the end hangs 2.044 curvature Lgb^2 aside, towards the side to which the cable bends. (With u = s / (2^(1/3) Lgb), s
    the height above the free end, small slopes obey theta'' = u theta, theta' = curvature at the end: an Airy
    function.) Two measurements at right angles make `Cable.natural_curvature`: seen along y, and along x.

    Parameters
    ----------
    gravito_bending_length : float [m]
        See `measure`.
    aside : float [m]
        How far the free end is beside the straight part above it, positive towards the axis that is measured.
    image : str, Path or array_like of shape (height, width, 3)
        Instead: a picture from the side of the hanging cable's lower 5 Lgb or more, and nothing else before a plain
        background, its columns along the axis that is measured.
    scale : float [m]
        Of one pixel of the image.
    error : float [m]
        Standard deviation of what is read; by default .5 mm, or half a pixel of an image.

    Returns
    -------
    MeasuredCurvature

    Raises
    ------
    ValueError
        None or both of aside and image, an image without scale or without 5 Lgb of a cable, numbers that are not
        positive or finite.

    Examples
    --------
    >>> import withe
    >>> found = withe.deployment.measure_curvature(0.08, aside=0.0065)
    >>> print(f"{found.curvature:.2f} / m, give or take {found.error:.2f}")
    0.50 / m, give or take 0.04
    """
    lgb = validation.positive(gravito_bending_length, "gravito_bending_length")
    if (aside is None) == (image is None):
        raise ValueError("measure_curvature needs exactly one of aside and image")
    if image is not None:
        pixel = pixel_size(scale)
        error = 0.5 * pixel if error is None else error
        aside = _aside(image, pixel, lgb)
    across = _across(np.zeros(1), lgb)[0]
    error = validation.non_negative(_ERROR if error is None else error, "error")
    return MeasuredCurvature(validation.number(aside, "aside") / across, error / across)


def _across(height: FloatArray, lgb: float) -> FloatArray:
    """How far aside the cable is at heights above its end, per natural curvature [m^2].

    theta = curvature length Ai(u) / Ai'(0), integrated from above.
    """
    from scipy.special import airy, itairy

    length = 2.0 ** (1.0 / 3.0) * lgb
    below, *_ = itairy(np.asarray(height) / length)  # integral of Ai from 0; over all of it a third
    return np.asarray(length**2 * (1.0 / 3.0 - below) / -airy(0.0)[1])


def _aside(image: str | os.PathLike[str] | npt.ArrayLike, scale: float, lgb: float) -> float:
    """How far the free end is beside the line above it [m], by least squares over all rows of a picture.

    The line may lean a little, as a camera does.
    """
    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    mask = border_filter(picture)
    rows = np.flatnonzero(mask.any(1))
    height = scale * (rows[-1] - rows) if rows.size else np.zeros(1)
    if height.max() < _SEEN * lgb:
        shown = f"{1e3 * height.max():.0f} mm"
        raise ValueError(f"image must show {_SEEN:g} Lgb of a hanging cable, {1e3 * _SEEN * lgb:.0f} mm, got {shown}")
    used = height <= _USED * lgb
    columns = np.arange(mask.shape[1])
    middle = scale * (mask[rows[used]] @ columns) / mask[rows[used]].sum(1)
    shape = _across(height[used], lgb)
    known = np.stack([shape, np.ones(used.sum()), height[used]], 1)
    return float(np.linalg.lstsq(known, middle, rcond=None)[0][0] * _across(np.zeros(1), lgb)[0])
