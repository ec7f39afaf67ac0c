"""Friction coefficients: one for all directions, or others along a rod, either way, than across it."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.friction_fields import FrictionField, edge_shares, field_shares

__all__ = [
    "Coefficients",
    "Directions",
    "Friction",
    "as_given",
    "by_given",
    "check_law",
    "check_rolling",
    "coefficients",
    "obstacle_friction",
    "own_friction",
    "pair_between",
]

Friction = float | tuple[float, float] | tuple[float, float, float] | npt.NDArray[np.float64] | FrictionField
Directions = tuple[float, float, float]
"""Coefficients of a rod that slides towards its end, towards its start, and across itself."""


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Friction of two bodies as it was given.

    Attributes
    ----------
    directions : (float, float, float)
        See `Directions`; 1 where they vary.
    edges : ndarray of shape (edges,), or None
        Along the rod.
    field : callable, or None
        Over the obstacle.
    """

    directions: Directions
    edges: npt.NDArray[np.float64] | None = None
    field: FrictionField | None = None

    def shares(self, nodes: npt.NDArray[np.float64], closed: bool, what: str) -> npt.NDArray[np.float64] | None:
        """Return the shares of the coefficients at nodes and edges of a rod, if they vary; see `field_shares`."""
        if self.field is not None:
            return field_shares(self.field, nodes, closed, what)
        return None if self.edges is None else edge_shares(self.edges, closed)

    @property
    def given(self) -> Friction:
        """Return the value that a user gave."""
        if self.field is not None:
            return self.field
        return as_given(self.directions) if self.edges is None else self.edges.copy()


def coefficients(
    value: Friction | npt.ArrayLike, what: str, *, directed: bool = True, edges: int | None = None
) -> Coefficients:
    """Friction between two bodies, checked.

    Parameters
    ----------
    value : float, pair or tuple of three of float, array_like of shape (edges,), or callable
    what : str
        Named in errors.
    directed : bool
        True for one rod and an obstacle.
    edges : int, optional
        Of that rod, where there is one.

    Raises
    ------
    ValueError
        Negative, not finite, or more than a number where two rods meet.
    """
    if callable(value) and directed:
        return Coefficients((1.0, 1.0, 1.0), field=value)
    if edges is not None and _is_of_edges(value, edges):
        rows = validation.number_array(value, what, (edges,))
        if rows.min() < 0.0:
            raise ValueError(f"{what} must not be negative, got {rows.min():g} at edge {int(rows.argmin())}")
        return Coefficients((1.0, 1.0, 1.0), edges=rows)
    return Coefficients(_directions(value, what, directed=directed))


def _is_of_edges(value: object, edges: int) -> bool:
    """Return True for a coefficient per edge, not per direction."""
    size = np.size(value) if np.ndim(value) == 1 else 0  # type: ignore[arg-type]
    if size == 3:
        return edges == 3 and not isinstance(value, tuple)
    return size > 0 and size != 2 and edges != 2


def _directions(value: Friction | npt.ArrayLike, what: str, *, directed: bool) -> Directions:
    """Coefficients of each direction: of a number, of two along and across a rod, or of three."""
    if validation.is_scalar(value) or value is None or isinstance(value, str):
        same = validation.non_negative(value, what)
        return same, same, same
    if not directed:
        raise ValueError(
            f"{what} must be one number, got {value!r:.80}: friction along and across a rod is defined on "
            "obstacles only"
        )
    if np.size(value) == 3:  # type: ignore[arg-type]
        words = "towards the end of a rod", "towards its start", "across it"
        numbers = validation.number_array(value, what, (3,))
        forward, backward, across = map(validation.non_negative, numbers, (f"{what} {word}" for word in words))
        return forward, backward, across
    if np.size(value) != 2:  # type: ignore[arg-type]
        raise ValueError(
            f"{what} must be one number, two (along and across a rod), or three (towards its end, towards its start, "
            f"across it), got {value!r:.80}"
        )
    along, across = validation.number_array(value, what, (2,))
    along = validation.non_negative(along, f"{what} along")
    return along, along, validation.non_negative(across, f"{what} across")


def as_given(directions: Directions) -> float | tuple[float, float] | Directions:
    """One number where all are the same, two where both ways along a rod are."""
    forward, backward, across = directions
    if forward != backward:
        return directions
    return across if forward == across else (forward, across)


def by_given(by_directions: npt.NDArray[np.float64], shape: tuple[int, ...]) -> npt.NDArray[np.float64] | float:
    """Derivatives by coefficients as they were given, from those by each direction."""
    forward, backward, across = by_directions
    if shape == (3,):
        return by_directions
    return np.array((forward + backward, across)) if shape == (2,) else float(by_directions.sum())


def check_law(directions: Directions, friction_model: str, what: str) -> None:
    """Refuse directions where friction is that of the step's start."""
    if len(set(directions)) > 1 and friction_model in ("lagged", "semi_explicit"):
        raise ValueError(
            f"{what} along and across a rod must be the same with friction_model={friction_model!r}: use "
            "'anchored' or 'implicit' for different values"
        )


def check_rolling(rolling_friction: float, friction_model: str, name: str) -> None:
    """Refuse rolling friction where friction is that of the step's start."""
    if rolling_friction > 0.0 and friction_model in ("lagged", "semi_explicit"):
        raise ValueError(
            f"rolling_friction of {name!r} needs friction_model 'anchored' or 'implicit', got {friction_model!r}"
        )


def _numbers(row: npt.NDArray[np.float64]) -> Directions:
    forward, backward, across = map(float, row)
    return forward, backward, across


def obstacle_friction(contact: _core.ContactDescription, index: int) -> Directions:
    """Present coefficients of an obstacle."""
    return _numbers(contact.obstacle_friction[index])


def own_friction(pair: _core.ContactPairDescription | None) -> Directions | None:
    """Coefficients that two bodies have of their own, if any; of what `pair_between` finds."""
    if pair is None or pair.friction[0] < 0.0:
        return None
    return _numbers(pair.friction)


def pair_between(
    pairs: Iterable[_core.ContactPairDescription], bodies: Collection[int]
) -> _core.ContactPairDescription | None:
    """Return the coefficients that two bodies have of their own, if any."""
    return next((own for own in pairs if {own.first, own.second} == set(bodies)), None)
