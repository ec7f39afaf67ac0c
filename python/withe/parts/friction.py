"""Friction coefficients: one for all directions, or one along a rod and one across it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation

__all__ = ["Friction", "as_given", "check_law", "friction_pair", "obstacle_friction", "with_obstacle"]

Friction = float | tuple[float, float]


def friction_pair(value: Friction | npt.ArrayLike, what: str, *, directed: bool = True) -> tuple[float, float]:
    """Coefficients along and across a rod.

    Parameters
    ----------
    value : float or pair of float
    what : str
        Named in errors.
    directed : bool
        Whether there is one rod whose directions are meant.

    Raises
    ------
    ValueError
        Negative, not a number, or a pair where two rods meet.
    """
    if validation.is_scalar(value) or value is None or isinstance(value, str):
        both = validation.non_negative(value, what)
        return both, both
    if not directed:
        raise ValueError(
            f"{what} must be one number: along and across are directions of a rod on an obstacle, got {value!r:.80}"
        )
    along, across = validation.number_array(value, what, (2,))
    return validation.non_negative(along, f"{what} along"), validation.non_negative(across, f"{what} across")


def as_given(pair: tuple[float, float]) -> Friction:
    """One number where both are the same."""
    return pair[0] if pair[0] == pair[1] else pair


def check_law(pair: tuple[float, float], friction_model: str, what: str) -> None:
    """Refuse directions where friction is that of the step's start."""
    if pair[0] != pair[1] and friction_model in ("lagged", "semi_explicit"):
        raise ValueError(
            f"{what} along and across a rod must be the same with friction_model={friction_model!r}: take 'anchored' "
            "or 'implicit'"
        )


def obstacle_friction(contact: _core.ContactDescription, index: int) -> tuple[float, float]:
    """Present coefficients of an obstacle."""
    across = contact.obstacle_across if len(contact.obstacle_across) else contact.obstacle_friction
    return float(contact.obstacle_friction[index]), float(across[index])


def with_obstacle(contact: _core.ContactDescription, index: int, pair: tuple[float, float]) -> _core.ContactDescription:
    """The same with other coefficients of an obstacle."""
    both = np.array([obstacle_friction(contact, i) for i in range(len(contact.obstacles))])
    both[index] = pair
    contact.obstacle_friction, contact.obstacle_across = both[:, 0], both[:, 1]
    return contact
