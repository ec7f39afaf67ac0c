"""How stiff a sheet is against its own weight, from how far a strip of it droops."""

from __future__ import annotations

import math
import os
import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.folding.strip_pictures import strip_ends

__all__ = ["Measured", "droop", "measure"]

_SIDE = (math.log(1e-20), math.log(0.5 * math.pi - 1e-5))  # angles between tip and plumb line [rad], their logarithms
_STEP = 1e-3  # of differences of these
_READ = 0.3  # standard deviation of what is read off a picture [px]
FloatArray = npt.NDArray[np.float64]
_TELLING = (1.5, 3.0)  # lengths of strips [Lgb] whose droop depends steeply on Lgb


@dataclass(frozen=True)
class Measured:
    """A length with its standard deviation.

    Attributes
    ----------
    gravito_bending_length, error : float [m]
    strip : float [Lgb]
        Length of the strip that was measured.
    """

    gravito_bending_length: float
    error: float
    strip: float


def _hanging(log_angle: float) -> tuple[float, float, float]:
    """Length [Lgb] of a strip whose tip makes an angle with the plumb line [rad]; its droop over length, and reach.

    Seen from the tip, u = length - s, 2 phi'' = u sin(phi), phi(0) = angle, phi'(0) = 0: the clamp is where phi is a
    right angle. The angle is given by its logarithm, for at the tip of a long strip it is tiny.
    """
    from scipy.integrate import solve_ivp

    def slopes(u: float, y: FloatArray) -> tuple[float, float, float, float]:
        return y[1], 0.5 * u * math.sin(y[0]), math.cos(y[0]), math.sin(y[0])

    def at_clamp(u: float, y: FloatArray) -> float:
        return float(y[0]) - 0.5 * math.pi

    at_clamp.terminal = True  # type: ignore[attr-defined]
    start = (math.exp(log_angle), 0.0, 0.0, 0.0)
    found = solve_ivp(slopes, (0.0, 1e3), start, "DOP853", events=at_clamp, rtol=1e-11, atol=1e-30)
    (length,), ((_, _, drop, reach),) = found.t_events[0], found.y_events[0]
    return float(length), float(drop / length), float(reach / length)


def _angle_where(of: int, value: float) -> float:
    """Logarithm of the tip's angle at which `_hanging` has a value."""
    from scipy.optimize import brentq

    return float(brentq(lambda angle: _hanging(angle)[of] - value, *_SIDE, xtol=1e-12, rtol=1e-14))


def droop(length: float) -> float:
    """Find how far the tip of a strip hangs below its clamp, which is level.

    Parameters
    ----------
    length : float [Lgb]
        .05 to 20.

    Returns
    -------
    float [Lgb]

    Raises
    ------
    ValueError
        No such length.
    """
    length = validation.positive(length, "length")
    if not 0.05 <= length <= 20.0:
        raise ValueError(f"length is {length:g} Lgb, not from .05 to 20")
    return length * _hanging(_angle_where(0, length))[1]


def measure(
    *,
    length: float | None = None,
    drop: float | None = None,
    image: npt.ArrayLike | str | os.PathLike[str] | None = None,
    scale: float | None = None,
    error: float | None = None,
) -> Measured:
    """Find a sheet's gravito-bending length Lgb = (EI / 2w)^(1/3) with a ruler, or from a picture.

    Clamp a strip level, at the edge of a table under a book, so that `length` of it is free: its tip then hangs `drop`
    below the clamp. The strip's equilibrium is that of an elastica under its own weight, exactly, however far it bends.

    Parameters
    ----------
    length, drop : float [m]
    image : path, or array_like of shape (height, width, 3) of uint8
        Instead of these: the strip from the side, level, before a plain background, cut off at the clamp, so that the
        strip comes in from the left or the right border. What counts is how far from there the tip is, across and down.
    scale : float [px/m]
        Of the picture, where the strip is.
    error : float [m]
        Standard deviation of either length; by default .5 mm, and .3 pixels of a picture.

    Returns
    -------
    Measured
        With the error that follows from those of the readings, to first order.

    Warns
    -----
    UserWarning
        The strip is so short or so long that its droop says little: cut one of 1.5 to 3 Lgb.

    Raises
    ------
    ValueError
        Neither length and drop nor image and scale, lengths that are not positive, a drop that no strip of the length
        can have, a picture without a sheet.

    Examples
    --------
    >>> import withe
    >>> found = withe.folding.measure(length=0.1, drop=0.043)
    >>> print(f"{1e3 * found.gravito_bending_length:.1f} mm, give or take {1e3 * found.error:.1f}")
    49.7 mm, give or take 0.4
    """
    by_ruler = length is not None and drop is not None and image is None and scale is None
    by_picture = image is not None and scale is not None and length is None and drop is None
    if not by_ruler and not by_picture:
        raise ValueError("measure needs length and drop, or image and scale")
    if by_ruler:
        along, down = validation.positive(length, "length"), validation.positive(drop, "drop")
        error = validation.non_negative(5e-4 if error is None else error, "error")
        if not 1e-5 < down / along < 0.98:
            raise ValueError(
                f"drop is {down / along:.2g} of length, which tells nothing: strips that tell most droop by .2 to .7 "
                "of it"
            )
    else:
        per_metre = validation.positive(scale, "scale")
        error = validation.non_negative(_READ / per_metre if error is None else error, "error")
        across, down = strip_ends(image)  # type: ignore[arg-type]
        along, down = _length_of(across, down) / per_metre, down / per_metre
    return _measured(along, down, error, by_picture)


def _length_of(reach: float, drop: float) -> float:
    """Length of a strip whose tip is so far from its clamp, across and down."""
    from scipy.optimize import brentq

    if not 1e-5 < drop / reach < 50.0:
        raise ValueError(
            f"image must show a strip that bends under its weight, got one that drops {drop / reach:.2g} of its reach"
        )
    angle = brentq(lambda angle: math.log(_ratio(angle) * reach / drop), *_SIDE, xtol=1e-12, rtol=1e-14)
    return drop / _hanging(angle)[1]


def _ratio(angle: float) -> float:
    _, drop, reach = _hanging(angle)
    return drop / reach


def _measured(length: float, drop: float, error: float, by_reach: bool) -> Measured:
    """Lgb, and its error by those of length and drop; or of reach and drop, where these were read."""
    angle = _angle_where(1, drop / length)
    strip, _, reach = _hanging(angle)
    if not _TELLING[0] < strip < _TELLING[1]:
        low, high = (1e3 * bound * length / strip for bound in _TELLING)
        warnings.warn(
            f"the strip is {strip:.2g} Lgb long, and its droop says little: measure one of {low:.0f} to {high:.0f} mm",
            UserWarning,
            stacklevel=3,
        )
    ahead, back = _hanging(angle + _STEP), _hanging(angle - _STEP)
    # With p the angle, a = length or reach, b = drop: b / a = r(p) and b = Lgb f(p), f = the drop in Lgb.
    first, second = (drops / reaches if by_reach else drops for _, drops, reaches in (ahead, back))
    ratio_slope = first - second
    fall = strip * drop / length
    fall_slope = ahead[0] * ahead[1] - back[0] * back[1]
    over = length * (reach if by_reach else 1.0)
    ratio = drop / over
    lgb = length / strip
    by_drop = 1.0 / fall - lgb / fall * fall_slope / ratio_slope / over
    by_over = lgb / fall * fall_slope / ratio_slope * ratio / over
    return Measured(lgb, error * math.hypot(by_drop, by_over), strip)
