"""Numbers of parts that are possible, and point to a slip: a `PlausibilityWarning` each."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from withe.common.user_warnings import warn
from withe.errors import PlausibilityWarning

__all__ = ["check_angle", "check_length", "check_offset"]

FloatArray = npt.NDArray[np.float64]

_LONGEST = 100.0  # m
_THIN = 1e-2  # m: radii that are said in mm
_FARTHEST = 50.0  # offset of a tendon over the radius of its rod: on disks along a thin backbone some 25, in mm 1000
_OUTSIDE, _WIDE = 8.0, 0.25  # offset of a tendon over the radius and over the length of its rods, both exceeded
_DEGREES = 15.0  # that angles are mostly a whole multiple of, where they are in degrees


def check_length(length: float, radius: float, owner: str) -> None:
    """Warn of a rod that is as long as a street, with a radius of millimetres."""
    if length > _LONGEST and radius < _THIN:
        _warn(f"{owner} is {length:.4g} m long at a radius of {1e3 * radius:.3g} mm", "is the length in millimetres?")


def check_offset(offsets: FloatArray, radii: FloatArray, length: float, *, pulls_all_along: bool, owner: str) -> None:
    """Warn of a tendon that runs far beside its rods, or that pulls along a centreline.

    An offset is far above 50 radii. An offset of more than 8 radii is also far if it exceeds a quarter of the length
    of the rods: disks along a thin backbone are smaller.

    Parameters
    ----------
    offsets : ndarray of shape (guides, 2) [m]
    radii : ndarray of shape (guides,) [m]
        Of the rods at the guides.
    length : float [m]
        Length of all rods of the tendon.
    pulls_all_along : bool
        True if the tendon has a tension, and no stretch of its rod can buckle between two guides.
    owner : str
    """
    far = np.linalg.norm(offsets, axis=1)
    guide = int(np.argmax(far / radii))
    if far[guide] == 0.0 and pulls_all_along:
        _warn(f"offset of {owner} is zero at every guide", "a tendon on the centreline bends nothing")
        return
    times = far[guide] / radii[guide]
    if times > _FARTHEST or (times > _OUTSIDE and far[guide] > _WIDE * length):
        slip = "is it in millimetres?" if times > _FARTHEST else "is it in metres, from the centreline?"
        _warn(f"offset of {owner} is {far[guide]:g} m, {times:.3g} radii of its rod", slip)


def check_angle(angle: float, what: str) -> None:
    """Warn of an angle [rad] of more than a full turn that is a round number of degrees."""
    if abs(angle) > 2.0 * math.pi and angle % _DEGREES == 0.0:
        _warn(f"{what} is {angle:g} rad, more than a full turn", "is it in degrees?")


def _warn(wrong: str, slip: str) -> None:
    warn(f"{wrong}: {slip}", PlausibilityWarning, wrong.split(" is ")[0])
