"""Hanging cables: their natural curvature from how they hang."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.deployment.cable import pixel_size
from withe.perception.images import check_image, read_image
from withe.perception.masks import border_filter

__all__ = ["MeasuredCurvature", "measure_curvature"]

FloatArray = npt.NDArray[np.float64]
_SEEN = 5.0  # [Lgb] of the cable, from its free end, that a picture must show: above it hangs straight
_USED = 8.0  # [Lgb]: farther up the jaw may bend it
_ERROR = 5e-4  # [m]
# Lengths below are in (EI / w)^(1/3) = 2^(1/3) Lgb.
_TOP = 10.0  # height above the free end at which slopes are small
_STRONGEST = 6.6  # slope at the top of a cable with the greatest measurable curl, relative to Ai
_SEEN_ASIDE = 1.08  # for a free end at 73 degrees: each row of a picture then shows one point of the cable


@dataclass(frozen=True)
class MeasuredCurvature:
    """A natural curvature with its standard deviation.

    Attributes
    ----------
    curvature, error : float [1/m]
    """

    curvature: float
    error: float


@keyword_hints
def measure_curvature(
    gravito_bending_length: float,
    *,
    aside: float | None = None,
    image: str | os.PathLike[str] | npt.ArrayLike | None = None,
    scale: float | None = None,
    depth: float = 0.0,
    error: float | None = None,
) -> MeasuredCurvature:
    """Find the natural curvature of a cable, with a ruler or a camera.

    Let the cable hang from its jaw, with the free end off the floor. The weight straightens the cable except for the
    last few Lgb. There the end hangs aside, towards the side to which the cable bends. The distance is 2.044 curvature
    Lgb^2 for a small curvature, and less for a cable that curls. Make two measurements at right angles, one seen along
    y and one seen along x, for `Cable.natural_curvature`.

    The model is theta'' = u sin theta with u = s / (2^(1/3) Lgb), where s is the arc length above the free end. The
    boundary conditions are theta' = curvature at the end and theta = 0 far above.

    Parameters
    ----------
    gravito_bending_length : float [m]
        See `measure`.
    aside : float [m]
        Distance of the free end from the straight part above it, positive towards the measured axis. At most 1.93 Lgb:
        beyond that distance the end curls up, and more curvature brings it back.
    image : str, Path or array_like of shape (height, width, 3)
        Picture from the side, instead of `aside`. It shows the lower 5 Lgb or more of the hanging cable before a plain
        background, and nothing else. Its columns run along the measured axis. The end of the cable may hang at 70
        degrees at most.
    scale : float [m]
        Size of one pixel of the image.
    depth : float [m]
        Distance of the free end along the line of sight. If the cable bends by more than 0.3 / Lgb, each of the two
        measurements needs the reading of the other.
    error : float [m]
        Standard deviation of the readings `aside` and `depth`. The default is 0.5 mm. The default for an image is half
        a pixel plus the uncertainty of the shape of the cable's end.

    Returns
    -------
    MeasuredCurvature

    Raises
    ------
    ValueError
        None or both of aside and image, an image without scale or without 5 Lgb of a cable, a cable that curls more
        than it may, numbers that are not positive or finite.

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
    length = 2.0 ** (1.0 / 3.0) * lgb
    away = validation.number(depth, "depth") / length
    if image is not None:
        x, off = _seen_aside(image, pixel_size(scale) / length, away)
    else:
        x, off = validation.number(aside, "aside") / length, _ERROR / length
    off = off if error is None else validation.non_negative(error, "error") / length
    total = float(np.hypot(x, away))
    if total > (most := float(_known().x[-1])):
        raise ValueError(
            f"aside must be at most {most * length:.3g} m, depth included, got {total * length:.3g} m: the cable "
            "curls up, so that aside does not determine its curvature"
        )
    (curvature, _), (slope, _) = _known()(total), _known()(total, 1)
    # It hangs in the plane of its bending: curvature and offset have the same direction.
    ratio = curvature / total if total > 0.0 else slope
    along, across = (x / total, away / total) if total > 0.0 else (1.0, 0.0)
    known = off * np.hypot(slope * along**2 + ratio * across**2, (slope - ratio) * along * across)
    return MeasuredCurvature(float(ratio * x / length), float(known / length))


@dataclass(frozen=True)
class _Hanging:
    """Shape of a hanging cable: curvature and slope [rad] at its free end, and points down to it, shape (n,)."""

    curvature: float
    tilt: float
    aside: FloatArray
    height: FloatArray


def _hanging(strength: float) -> _Hanging:
    """The elastica theta'' = u sin theta, integrated from far above, where theta = strength Ai(u), to its end."""
    from scipy.integrate import solve_ivp
    from scipy.special import airy

    def slopes(u: float, y: FloatArray) -> list[float]:
        return [y[1], u * np.sin(y[0]), -np.sin(y[0]), np.cos(y[0])]

    value, slope, *_ = airy(_TOP)
    begin = [strength * value, strength * slope, 0.0, 0.0]
    places = np.linspace(_TOP, 0.0, 501)
    found = solve_ivp(slopes, (_TOP, 0.0), begin, "DOP853", places, rtol=1e-10, atol=1e-14).y
    return _Hanging(-float(found[1, -1]), float(found[0, -1]), found[2], found[3] - found[3, -1])


@cache
def _known() -> Any:
    """Curvature and strength by how far aside the end is, a spline."""
    from scipy.interpolate import CubicSpline

    strengths = np.linspace(0.0, _STRONGEST, 67)
    shapes = [_hanging(strength) for strength in strengths]
    values = np.column_stack([[shape.curvature for shape in shapes], strengths])
    return CubicSpline([shape.aside[-1] for shape in shapes], values)


def _seen_aside(image: str | os.PathLike[str] | npt.ArrayLike, scale: float, depth: float) -> tuple[float, float]:
    """Return the distance of the free end from the line above it, by least squares over all rows, and its error.

    The line may lean a little, because the camera may. The end lies below the end of the centreline by an unknown part
    of the radius, which depends on the cut of the cable.
    """
    from scipy.optimize import least_squares

    above, seen, radius = _centreline(image, scale)
    most = np.sqrt(max(_SEEN_ASIDE**2 - depth**2, 1e-6))

    def hanging(aside: float) -> _Hanging:
        return _hanging(float(_known()(np.hypot(aside, depth))[1]))

    def off(unknown: FloatArray) -> FloatArray:
        aside, lower, offset, lean = unknown
        shape = hanging(aside)
        line = np.interp(above - lower, shape.height[::-1], shape.aside[::-1])
        return np.asarray(line * aside / max(shape.aside[-1], 1e-9) + offset + lean * above - seen)

    far = seen[above > 0.7 * above.max()].mean()
    guess = np.clip(seen[-1] - far, -0.9 * most, 0.9 * most)
    low, high = [-most, 0.0, -np.inf, -1.0], [most, radius, np.inf, 1.0]
    found = least_squares(off, [guess, 0.5 * radius, far, 0.0], bounds=(low, high), x_scale=[1.0, radius, 1.0, 1.0])
    end = float(found.x[0])
    if abs(end) > 0.99 * most:
        raise ValueError("image must show a cable whose end hangs at 70 degrees at most: give aside= instead")
    return end, float(np.hypot(0.5 * scale, radius / np.sqrt(12.0) * np.tan(hanging(end).tilt)))


def _centreline(image: str | os.PathLike[str] | npt.ArrayLike, scale: float) -> tuple[FloatArray, FloatArray, float]:
    """Heights of rows above the lowest pixel and the cable's middle there, without its end; and its radius."""
    lgb = 2.0 ** (-1.0 / 3.0)
    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    mask = border_filter(picture)
    rows = np.flatnonzero(mask.any(1))
    height = scale * (rows[-1] - rows) if rows.size else np.zeros(1)
    if height.max() < _SEEN * lgb:
        raise ValueError(
            f"image must show {_SEEN:g} Lgb of a hanging cable, {_SEEN * lgb / scale:.0f} pixels,"
            f" got {height.max() / scale:.0f}"
        )
    rows, height = rows[height <= _USED * lgb], height[height <= _USED * lgb]
    thickness = mask[rows].sum(1)
    middle = scale * (mask[rows] @ np.arange(mask.shape[1])) / thickness
    radius = 0.5 * scale * float(np.median(thickness))
    clear = height > 2.0 * radius
    if 2.0 * clear.sum() < len(rows):
        raise ValueError(f"image must show a cable thinner than {_SEEN / 2.0:g} Lgb, got {2.0 * radius / lgb:.1f} Lgb")
    return height[clear], middle[clear], radius
