"""How stiff a sheet is against its own weight, from how far a strip of it droops."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation

__all__ = ["Measured", "droop", "measure"]

_SIDE = (math.log(1e-20), math.log(0.5 * math.pi - 1e-5))  # angles between tip and plumb line [rad], their logarithms
_STEP = 1e-3  # of differences of these
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


def _hanging(log_angle: float) -> tuple[float, float]:
    """Length [Lgb] of a strip whose tip makes an angle with the plumb line [rad], and its droop over its length.

    Seen from the tip, u = length - s, 2 phi'' = u sin(phi), phi(0) = angle, phi'(0) = 0: the clamp is where phi is a
    right angle. The angle is given by its logarithm, for at the tip of a long strip it is tiny.
    """
    from scipy.integrate import solve_ivp

    def slopes(u: float, y: FloatArray) -> tuple[float, float, float]:
        return y[1], 0.5 * u * math.sin(y[0]), math.cos(y[0])

    def at_clamp(u: float, y: FloatArray) -> float:
        return float(y[0]) - 0.5 * math.pi

    at_clamp.terminal = True  # type: ignore[attr-defined]
    start = (math.exp(log_angle), 0.0, 0.0)
    found = solve_ivp(slopes, (0.0, 1e3), start, "DOP853", events=at_clamp, rtol=1e-11, atol=1e-30)
    (length,), ((_, _, drop),) = found.t_events[0], found.y_events[0]
    return float(length), float(drop / length)


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


def measure(*, length: float, drop: float, error: float = 5e-4) -> Measured:
    """Find a sheet's gravito-bending length Lgb = (EI / 2w)^(1/3) with a ruler.

    Clamp a strip level, at the edge of a table under a book, so that `length` of it is free: its tip then hangs `drop`
    below the clamp. The strip's equilibrium is that of an elastica under its own weight, exactly, however far it bends.

    Parameters
    ----------
    length, drop : float [m]
    error : float [m]
        Standard deviation of either.

    Returns
    -------
    Measured
        With the error that follows from those of the ruler, to first order.

    Warns
    -----
    UserWarning
        The strip is so short or so long that its droop says little: cut one of 1.5 to 3 Lgb.

    Raises
    ------
    ValueError
        Lengths that are not positive, a drop that no strip of the length can have.

    Examples
    --------
    >>> import withe
    >>> found = withe.folding.measure(length=0.1, drop=0.043)
    >>> print(f"{1e3 * found.gravito_bending_length:.1f} mm, give or take {1e3 * found.error:.1f}")
    49.7 mm, give or take 0.4
    """
    length, drop = validation.positive(length, "length"), validation.positive(drop, "drop")
    error = validation.non_negative(error, "error")
    if not 1e-5 < drop / length < 0.98:
        raise ValueError(
            f"drop is {drop / length:.2g} of length, which tells nothing: strips that tell most droop by .2 to .7 of it"
        )

    angle = _angle_where(1, drop / length)
    strip = _hanging(angle)[0]
    if not _TELLING[0] < strip < _TELLING[1]:
        low, high = (1e3 * bound * length / strip for bound in _TELLING)
        warnings.warn(
            f"the strip is {strip:.2g} Lgb long, and its droop says little: measure one of {low:.0f} to {high:.0f} mm",
            UserWarning,
            stacklevel=2,
        )
    ahead, back = _hanging(angle + _STEP), _hanging(angle - _STEP)
    slope = (ahead[0] - back[0]) / (ahead[1] - back[1])  # of the strip by its droop over its length
    by_length = (1.0 + drop / length * slope / strip) / strip
    by_drop = -slope / strip**2
    return Measured(length / strip, error * math.hypot(by_length, by_drop), strip)
