"""Bodies that move as one, and places of joints on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["MassProperties", "free_place", "massless_base", "united"]

FloatArray = npt.NDArray[np.float64]

# Mass of a fixed body without a mass, over that of the robot. The body does not move, so its mass only adds a
# constant to the energy and a weight to the reaction of its clamp, which must be small.
_FIXED_MASS_RATIO = 1e-6

# Distance between joints of one body that would be at the same point, over the size of the robot. A hinge may be
# anywhere on its axis, and the position of a sliding joint has no effect.
_ANCHOR_SHIFT = 0.01


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre and inertia of a rigid body, in some axes.

    Attributes
    ----------
    mass : float [kg]
    center : ndarray of shape (3,) [m]
        Centre of mass.
    inertia : ndarray of shape (3, 3) [kg m^2]
        About the centre of mass.
    """

    mass: float
    center: FloatArray
    inertia: FloatArray

    def seen_from(self, position: FloatArray, rotation: FloatArray) -> MassProperties:
        """Return the properties in the axes of a body, whose origin and axes (columns) are given."""
        inertia = rotation.T @ self.inertia @ rotation
        return MassProperties(self.mass, rotation.T @ (self.center - position), 0.5 * (inertia + inertia.T))


def united(parts: Sequence[MassProperties]) -> MassProperties | None:
    """Return the mass, centre and inertia of parts that move as one; None without mass."""
    mass = float(sum(part.mass for part in parts))
    if not mass > 0.0:
        return None
    center = sum((part.mass * part.center for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = part.center - center
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))  # parallel axes
    return MassProperties(mass, center, inertia)


def massless_base(position: FloatArray, moving: float, size: float) -> MassProperties:
    """Return the properties of a fixed body that the file gives no mass.

    Parameters
    ----------
    position : ndarray of shape (3,) [m]
    moving : float [kg]
        Mass of all bodies that move.
    size : float [m]
        Size of the robot.
    """
    mass = _FIXED_MASS_RATIO * moving if moving > 0.0 else 1.0
    return MassProperties(mass, position, mass * (0.1 * size or 0.1) ** 2 * np.eye(3))


def free_place(at: FloatArray, axis: FloatArray, taken: Sequence[FloatArray], size: float) -> FloatArray:
    """Return the nearest place of a joint on its axis that no other joint of its bodies has taken.

    Parameters
    ----------
    at, axis : ndarray of shape (3,)
    taken : sequence of ndarray of shape (3,) [m]
    size : float [m]
        Size of the robot.
    """
    shift = _ANCHOR_SHIFT * size
    steps = [0, *(sign * step for step in range(1, len(taken) + 1) for sign in (1, -1))]
    places = [at + step * shift * axis for step in steps]
    return next(place for place in places if all(np.linalg.norm(place - other) > 0.1 * shift for other in taken))
