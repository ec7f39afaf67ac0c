"""Friction coefficients: one for all directions, or one along a rod and one across it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.friction_fields import FrictionField, edge_shares, field_shares

__all__ = [
    "Coefficients",
    "Friction",
    "as_given",
    "check_law",
    "check_rolling",
    "coefficients",
    "friction_pair",
    "obstacle_friction",
    "pair_between",
    "pair_in",
    "with_obstacle",
    "with_pair",
]

Friction = float | tuple[float, float] | npt.NDArray[np.float64] | FrictionField


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Friction of two bodies as it was given.

    Attributes
    ----------
    pair : (float, float)
        Along and across a rod; 1 where they vary.
    edges : ndarray of shape (edges,), or None
        Along the rod.
    field : callable, or None
        Over the obstacle.
    """

    pair: tuple[float, float]
    edges: npt.NDArray[np.float64] | None = None
    field: FrictionField | None = None

    def shares(self, nodes: npt.NDArray[np.float64], closed: bool, what: str) -> npt.NDArray[np.float64] | None:
        """What nodes and edges of a rod have of the coefficients, where they vary; see `field_shares`."""
        if self.field is not None:
            return field_shares(self.field, nodes, closed, what)
        return None if self.edges is None else edge_shares(self.edges, closed)

    @property
    def given(self) -> Friction:
        """What a user gave."""
        if self.field is not None:
            return self.field
        return as_given(self.pair) if self.edges is None else self.edges.copy()


def coefficients(
    value: Friction | npt.ArrayLike, what: str, *, directed: bool = True, edges: int | None = None
) -> Coefficients:
    """Friction between two bodies, checked.

    Parameters
    ----------
    value : float, pair of float, array_like of shape (edges,), or callable
    what : str
        Named in errors.
    directed : bool
        Whether there is one rod, and an obstacle.
    edges : int, optional
        Of that rod, where there is one.

    Raises
    ------
    ValueError
        Negative, not finite, or more than a number where two rods meet.
    """
    if callable(value) and directed:
        return Coefficients((1.0, 1.0), field=value)
    if edges is not None and edges != 2 and np.ndim(value) == 1 and np.size(value) != 2:  # type: ignore[arg-type]
        rows = validation.number_array(value, what, (edges,))
        if rows.min() < 0.0:
            raise ValueError(f"{what} must not be negative, got {rows.min():g} at edge {int(rows.argmin())}")
        return Coefficients((1.0, 1.0), edges=rows)
    return Coefficients(friction_pair(value, what, directed=directed))


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


def as_given(pair: tuple[float, float]) -> float | tuple[float, float]:
    """One number where both are the same."""
    return pair[0] if pair[0] == pair[1] else pair


def check_law(pair: tuple[float, float], friction_model: str, what: str) -> None:
    """Refuse directions where friction is that of the step's start."""
    if pair[0] != pair[1] and friction_model in ("lagged", "semi_explicit"):
        raise ValueError(
            f"{what} along and across a rod must be the same with friction_model={friction_model!r}: take 'anchored' "
            "or 'implicit'"
        )


def check_rolling(rolling_friction: float, friction_model: str, name: str) -> None:
    """Refuse rolling friction where friction is that of the step's start."""
    if rolling_friction > 0.0 and friction_model in ("lagged", "semi_explicit"):
        raise ValueError(
            f"rolling_friction of {name!r} needs friction_model 'anchored' or 'implicit', got {friction_model!r}"
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


def with_pair(
    contact: _core.ContactDescription,
    bodies: tuple[int, int],
    pair: tuple[float, float],
    shares: npt.NDArray[np.float64] | None = None,
) -> _core.ContactDescription:
    """The same with other coefficients of two bodies.

    Bodies are rods by their index and obstacles by -1 - index; `shares` are what nodes and edges have of the
    coefficients.
    """
    pairs = list(contact.pairs)
    found = pair_in(pairs, bodies)
    found.friction, found.across = pair
    found.shares = np.zeros(0) if shares is None else shares
    contact.pairs = pairs
    return contact


def pair_in(pairs: list[_core.ContactPairDescription], bodies: tuple[int, int]) -> _core.ContactPairDescription:
    """What two bodies have of their own; where that is nothing, a new one behind the others."""
    found = pair_between(pairs, bodies)
    if found is None:
        found = _core.ContactPairDescription()
        found.first, found.second = bodies
        pairs.append(found)
    return found


def pair_between(
    pairs: Iterable[_core.ContactPairDescription], bodies: tuple[int, int]
) -> _core.ContactPairDescription | None:
    """What two bodies have of their own, if anything."""
    return next((own for own in pairs if {own.first, own.second} == set(bodies)), None)
