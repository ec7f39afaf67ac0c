"""Centrelines that are tedious to write by hand, as points for `Scene.add_rod(points=...)`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from withe.common.deprecation import old_names
from withe.common.keywords import keyword_hints
from withe.common.validation import integer, non_negative, number, positive, unit_vector, vector

__all__ = ["arc", "circle", "helix"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
def helix(radius: float, pitch: float, length: float, nodes: int, *, left_handed: bool = False) -> FloatArray:
    """Points on a helix about the z axis that starts at (radius, 0, 0) and rises.

    Parameters
    ----------
    radius : float [m]
        Radius of the cylinder of the helix.
    pitch : float [m]
        Rise in one turn.
    length : float [m]
        Length along the helix.
    nodes : int
        Number of points, evenly spaced along it.
    left_handed : bool

    Returns
    -------
    ndarray of shape (nodes, 3) [m]

    Raises
    ------
    ValueError
        A length that is not positive, a negative pitch, or fewer than two nodes.

    Examples
    --------
    >>> helix(radius=0.02, pitch=0.05, length=0.5, nodes=100)[0]
    array([0.02, 0.  , 0.  ])
    """
    positive(radius, "radius")
    positive(length, "length")
    non_negative(pitch, "pitch")
    turns = length / np.hypot(2.0 * np.pi * radius, pitch)
    angles = 2.0 * np.pi * turns * np.linspace(0.0, 1.0, integer(nodes, "nodes", 2, 10**7))
    sideways = -np.sin(angles) if left_handed else np.sin(angles)
    return np.stack([radius * np.cos(angles), radius * sideways, pitch * angles / (2.0 * np.pi)], axis=1)


def circle(radius: float, nodes: int) -> FloatArray:
    """Points on a circle about the origin in the x-y plane, for a closed rod. The first point is not repeated.

    Parameters
    ----------
    radius : float [m]
    nodes : int
        Number of points, three or more.

    Returns
    -------
    ndarray of shape (nodes, 3) [m]

    Raises
    ------
    ValueError
        A radius that is not positive, or fewer than three nodes.
    """
    positive(radius, "radius")
    angles = 2.0 * np.pi * np.arange(integer(nodes, "nodes", 3, 10**7)) / nodes
    return radius * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)


def arc(
    start: npt.ArrayLike, tangent: npt.ArrayLike, towards: npt.ArrayLike, curvature: float, length: float, nodes: int
) -> FloatArray:
    """Points on an arc of a circle, or on a straight line if the curvature is zero.

    Parameters
    ----------
    start, tangent, towards : array_like of shape (3,)
        Start [m], direction at the start, and side to which the arc bends. `towards` need not be normal to `tangent`.
    curvature : float [1/m]
    length : float [m]
    nodes : int
        Number of points, evenly spaced along the arc.

    Returns
    -------
    ndarray of shape (nodes, 3) [m]

    Raises
    ------
    ValueError
        A tangent of length zero, a side along the tangent, a length that is not positive, or fewer than two nodes.
    """
    positive(length, "length")
    origin, along, side = vector(start, "start"), unit_vector(tangent, "tangent"), vector(towards, "towards")
    side = side - (side @ along) * along
    if np.linalg.norm(side) <= 1e-12:
        raise ValueError("towards must not lie along tangent")
    side = side / np.linalg.norm(side)
    number(curvature, "curvature")
    distances = np.linspace(0.0, length, integer(nodes, "nodes", 2, 10**7))
    half = 0.5 * curvature * distances
    # sin(x) / x, so that a straight line needs no case of its own
    chords = distances * np.sinc(half / np.pi)
    points: FloatArray = origin + np.outer(chords * np.cos(half), along) + np.outer(chords * np.sin(half), side)
    return points


if not TYPE_CHECKING:  # an old name stays an error to type checkers
    __getattr__ = old_names(
        __name__,
        granny_knot="withe.knots.granny_knot",
        overhand_knot="withe.knots.overhand_knot",
        reef_knot="withe.knots.reef_knot",
    )
