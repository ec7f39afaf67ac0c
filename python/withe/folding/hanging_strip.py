"""Stiffness of a sheet against its own weight, from the droop of a strip."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.user_warnings import warn
from withe.folding.strip_pictures import strip_ends
from withe.perception.camera import Camera

__all__ = ["Measured", "droop", "measure"]

_SIDE = (math.log(1e-20), math.log(0.5 * math.pi - 1e-5))  # angles between tip and plumb line [rad], their logarithms
_STEP = 1e-3  # step of differences of these
_CHANGE = 1e-5  # relative step of differences of Lgb, lengths and curls
_MOST_STEPS = 30  # greatest number of steps to the angle of a tip
_LONGEST_REACH = 10.0  # [m], for a strip of paper
_READ = 0.3  # standard deviation of readings from a picture [px]
FloatArray = npt.NDArray[np.float64]
_TELLING = (1.5, 3.0)  # lengths of strips [Lgb] whose droop depends steeply on Lgb


@dataclass(frozen=True)
class Measured:
    """A length with its standard deviation.

    Attributes
    ----------
    gravito_bending_length, error : float [m]
    strip : float [Lgb]
        Length of the measured strip.
    curl, curl_error : float [1/m] or None
        Natural curvature of a strip that was also measured turned over, positive if it bends down before the turn.
    """

    gravito_bending_length: float
    error: float
    strip: float
    curl: float | None = None
    curl_error: float | None = None


def _slopes(u: float | FloatArray, y: FloatArray) -> FloatArray:
    """Derivatives of phi, phi', the drop and the reach by arc length from the tip, where 2 phi'' = u sin(phi)."""
    sine = np.sin(y[0])
    return np.array([y[1], 0.5 * u * sine, np.cos(y[0]), sine])


def _hanging(log_angle: float) -> tuple[float, float, float]:
    """Length [Lgb] of a strip whose tip makes an angle with the plumb line [rad]; its droop over length, and reach.

    Seen from the tip, u = length - s, 2 phi'' = u sin(phi), phi(0) = angle, phi'(0) = 0: the clamp is where phi is a
    right angle. The angle is given by its logarithm, for at the tip of a long strip it is tiny.
    """
    from scipy.integrate import solve_ivp

    def at_clamp(u: float, y: FloatArray) -> float:
        return float(y[0]) - 0.5 * math.pi

    at_clamp.terminal = True  # type: ignore[attr-defined]
    start = (math.exp(log_angle), 0.0, 0.0, 0.0)
    found = solve_ivp(_slopes, (0.0, 1e3), start, "DOP853", events=at_clamp, rtol=1e-11, atol=1e-30)
    (length,), ((_, _, drop, reach),) = found.t_events[0], found.y_events[0]
    return float(length), float(drop / length), float(reach / length)


def _angle_where(of: int, value: float) -> float:
    """Logarithm of the tip's angle at which `_hanging` has a value."""
    from scipy.optimize import brentq

    return float(brentq(lambda angle: _hanging(angle)[of] - value, *_SIDE, xtol=1e-12, rtol=1e-14))


def droop(length: float) -> float:
    """Return the drop of the tip of a hanging strip below its level clamp [Lgb].

    Parameters
    ----------
    length : float [Lgb]
        Length of the strip, 0.05 to 20.

    Returns
    -------
    float [Lgb]

    Raises
    ------
    ValueError
        A length out of range.
    """
    length = validation.positive(length, "length")
    if not 0.05 <= length <= 20.0:
        raise ValueError(f"length must be from 0.05 to 20 Lgb, got {length:g} Lgb")
    return length * _hanging(_angle_where(0, length))[1]


@keyword_hints
def measure(
    *,
    length: float | None = None,
    drop: float | None = None,
    image: npt.ArrayLike | str | os.PathLike[str] | None = None,
    turned: float | npt.ArrayLike | str | os.PathLike[str] | None = None,
    scale: float | None = None,
    camera: Camera | None = None,
    error: float | None = None,
) -> Measured:
    """Find a sheet's gravito-bending length Lgb = (EI / 2w)^(1/3) with a ruler, or from a picture.

    Clamp a strip level, at the edge of a table under a book, so that `length` of it is free. Its tip then hangs `drop`
    below the clamp. The model is the exact elastica under its own weight, for any bending.

    Paper curls, and a curl of 0.5 / m changes the apparent Lgb by 1.5 to 4 %. Clamp the strip a second time, turned
    over:
    both readings together give Lgb and the curl.

    Parameters
    ----------
    length, drop : float [m]
        Length of the free strip, and drop of its tip below the clamp.
    image : path, or array_like of shape (height, width, 3) of uint8
        Picture of the strip, instead of length and drop: from the side, level, before a plain background, and cut off
        at the clamp, so that the strip enters at the left or right border. The measurement uses the distance of the tip
        from there, across and down.
    turned : float [m], path or array_like
        Reading of the same strip turned over: its drop if the first reading is by ruler, else its picture.
    scale : float [px/m]
        Pixels per metre of the pictures, at the strip.
    camera : withe.perception.Camera
        Camera whose plane z = 0 is the plane of the strip, with y vertical, instead of `scale`. Its lens distortion is
        removed.
    error : float [m]
        Standard deviation of either length. By default 0.5 mm, or 0.3 pixels of a picture.

    Returns
    -------
    Measured
        Lgb with its standard deviation, by linear propagation of the errors of the readings.

    Raises
    ------
    ValueError
        Missing input: pass length and drop, or an image and its scale or camera. Lengths that are not positive or above
        10 m, or a drop that no strip of this length can have. A picture without a sheet, or readings of two different
        strips.
    ImportError
        An image file is given, and OpenCV is not installed.

    Warns
    -----
    UserWarning
        The strip is too short or too long for a precise result: cut one of 1.5 to 3 Lgb.

    Examples
    --------
    >>> import withe
    >>> found = withe.folding.measure(length=0.1, drop=0.043)
    >>> print(f"{1e3 * found.gravito_bending_length:.1f} mm, give or take {1e3 * found.error:.1f}")
    49.7 mm, give or take 0.4
    """
    by_ruler = length is not None and drop is not None and image is None and scale is None and camera is None
    by_picture = image is not None and (scale is None) != (camera is None) and length is None and drop is None
    if not by_ruler and not by_picture:
        raise ValueError("measure needs length and drop, or image and scale, or image and camera")
    if by_ruler:
        along = validation.positive(length, "length")
        if not along < _LONGEST_REACH:
            raise ValueError(
                f"length must be less than {_LONGEST_REACH:g} m, got {along:g} m: are all sizes in metres?"
            )
        readings = {"drop": drop, "turned": turned}
        drops = [_checked_drop(down, along, name) for name, down in readings.items() if down is not None]
        error = validation.non_negative(5e-4 if error is None else error, "error")
        down = float(np.mean(drops))
        flat = _measured(_angle_where(1, down / along), along, down, error, by_reach=False)
        return flat if turned is None else _uncurled(flat, np.array([along, *drops]), error)
    factor = 1.0 if scale is None else validation.positive(scale, "scale")
    pixels = [strip_ends(x) for x in (image, turned) if x is not None]
    metric = [ends / factor if camera is None else camera.to_plane(ends)[:, :2] for ends in pixels]
    per_metre = float(np.linalg.norm(np.diff(pixels[0], axis=0)) / np.linalg.norm(np.diff(metric[0], axis=0)))
    error = validation.non_negative(_READ / per_metre if error is None else error, "error")
    ends = np.abs([each[1] - each[0] for each in metric])
    across, down = (float(x) for x in ends.mean(axis=0))
    if not across < _LONGEST_REACH:
        wrong = "camera must be in metres" if scale is None else f"scale must be in pixels per metre, got {scale:g}"
        raise ValueError(f"{wrong}: the strip would reach {across:.3g} m")
    flat = _measured(_angle_where_tip_is(across, down), across, down, error, by_reach=True)
    return flat if turned is None else _uncurled(flat, ends.ravel(), error)


def _checked_drop(drop: object, length: float, name: str) -> float:
    down = validation.positive(drop, name)
    if not 1e-5 < down / length < 0.98:
        raise ValueError(
            f"{name} does not determine Lgb at {down / length:.2g} of length: use a strip that droops by 0.2 to "
            "0.7 of its length"
        )
    return down


def _uncurled(flat: Measured, read: FloatArray, error: float) -> Measured:
    """Lgb, length and curl of a strip from readings of both of its sides; `flat` is the same strip without curl.

    Readings are its length and both drops, or reach and drop of one side and of the other.
    """
    from scipy.optimize import least_squares

    size = flat.gravito_bending_length
    scales = np.array([size, size, 1.0 / size])
    angles = np.full((2, 1), 0.5)  # angles of the tips, from the last solution

    def misfits(unknowns: FloatArray) -> FloatArray:
        """Misfits of columns of unknowns."""
        lgb, length, curl = unknowns * scales[:, None]
        found, drops, reaches = _curled(length / lgb, np.stack([curl * lgb, -curl * lgb]), angles)
        angles[:] = found[:, :1]
        sides = lgb * np.stack([reaches, drops], axis=1).reshape(4, -1)
        expected = np.vstack([length, sides[1::2]]) if len(read) == 3 else sides
        return np.asarray((expected - read[:, None]) / size)

    def slopes(unknowns: FloatArray) -> FloatArray:
        changes = _CHANGE * np.eye(3)
        ahead, back = np.hsplit(misfits(unknowns[:, None] + np.hstack([changes, -changes])), 2)
        return np.asarray((ahead - back) / (2.0 * _CHANGE))

    begin = [1.0, flat.strip, 0.0]
    try:
        found = least_squares(lambda x: misfits(x[:, None])[:, 0], begin, slopes, method="lm", xtol=1e-10)
    except RuntimeError as none:
        raise ValueError(
            "argument turned must be a reading of the same strip, turned over and clamped at the same distance from "
            "its tip"
        ) from none
    lgb, length, curl = found.x * scales
    if not found.success or lgb <= 0.0 or np.abs(found.fun).max() > max(0.02, 10.0 * error / lgb):
        raise ValueError(
            "argument turned must be a reading of the same strip, turned over and clamped at the same distance from "
            "its tip"
        )
    spread = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac))) * error / size * scales
    return Measured(float(lgb), float(spread[0]), float(length / lgb), float(curl), float(spread[2]))


def _curled(strip: FloatArray, curl: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles of tips, drops and reaches [Lgb] of strips that bend down by themselves by `curl` [1/Lgb].

    Lengths [Lgb] of shape (n,), curls of shape (sides, n), angles to begin with of shape (sides, 1). The clamp is
    level: by Newton's method on the tip's angle.
    """
    angle, change = near + np.zeros_like(curl), 1e-6
    for _ in range(_MOST_STEPS):
        turned, *places = _hung(np.tile(strip, 2), np.tile(curl, 2), np.hstack([angle, angle + change]))
        here, ahead = np.hsplit(turned - 0.5 * math.pi, 2)
        if np.abs(here).max() < 1e-10:
            drop, reach = (place[:, : len(strip)] for place in places)
            return angle, drop, reach
        angle = angle - change * here / (ahead - here)
    raise RuntimeError("no elastic strip hangs like this: check length and drop")


def _hung(strip: FloatArray, curl: FloatArray, angle: FloatArray) -> FloatArray:
    """Angles at the clamp, drops and reaches [Lgb] of strips that bend down by themselves by `curl` [1/Lgb].

    Like `_hanging`, but with phi'(0) = curl: the tip has no moment. Lengths [Lgb] have the shape (n,). Curls and angles
    of tips have the shape (sides, n), and the result (3, sides, n).
    """
    from scipy.integrate import solve_ivp

    def slopes(share: float, y: FloatArray) -> FloatArray:
        return np.asarray(strip * _slopes(share * strip, y.reshape(begin.shape))).ravel()

    begin = np.stack([angle, curl, np.zeros_like(angle), np.zeros_like(angle)])
    run = solve_ivp(slopes, (0.0, 1.0), begin.ravel(), "DOP853", rtol=1e-10, atol=1e-12)
    return np.asarray(run.y[:, -1].reshape(begin.shape)[[0, 2, 3]])


def _angle_where_tip_is(reach: float, drop: float) -> float:
    """Logarithm of the tip's angle at which it is so far from the clamp, across and down."""
    from scipy.optimize import brentq

    if not 1e-5 < drop / reach < 50.0:
        raise ValueError(
            f"image must show a strip that bends under its weight, got one that drops {drop / reach:.2g} of its reach"
        )
    return float(brentq(lambda angle: math.log(_ratio(angle) * reach / drop), *_SIDE, xtol=1e-12, rtol=1e-14))


def _ratio(angle: float) -> float:
    _, drop, reach = _hanging(angle)
    return drop / reach


def _measured(angle: float, over: float, drop: float, error: float, by_reach: bool) -> Measured:
    """Return Lgb, and its error from the errors of length and drop, or of reach and drop if these were read.

    `angle`: logarithm of the angle of the tip. `over`: length or reach.
    """
    strip, fall, reach = _hanging(angle)
    length = over / reach if by_reach else over
    if not _TELLING[0] < strip < _TELLING[1]:
        low, high = (1e3 * bound * length / strip for bound in _TELLING)
        warn(
            f"the strip is {strip:.2g} Lgb long, and its droop is not sensitive to Lgb: measure a strip of "
            f"{low:.0f} to {high:.0f} mm",
            cause="strip",
        )
    ahead, back = _hanging(angle + _STEP), _hanging(angle - _STEP)
    # With p the angle, a = length or reach, b = drop: b / a = r(p) and b = Lgb f(p), f = the drop in Lgb.
    first, second = (drops / reaches if by_reach else drops for _, drops, reaches in (ahead, back))
    ratio_slope = first - second
    fall *= strip
    fall_slope = ahead[0] * ahead[1] - back[0] * back[1]
    ratio = drop / over
    lgb = length / strip
    by_drop = 1.0 / fall - lgb / fall * fall_slope / ratio_slope / over
    by_over = lgb / fall * fall_slope / ratio_slope * ratio / over
    return Measured(lgb, error * math.hypot(by_drop, by_over), strip)
