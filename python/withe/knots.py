"""Centrelines of knots, and invariants that distinguish knots: crossings, Alexander polynomial, signature, writhe."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from withe.common import diagrams, validation
from withe.common.drawing import natural_shape
from withe.common.keywords import keyword_hints

__all__ = [
    "alexander_polynomial",
    "granny_knot",
    "link",
    "overhand_knot",
    "reef_knot",
    "signature",
    "signed_crossings",
    "writhe",
]

FloatArray = npt.NDArray[np.float64]
Tails = Literal["up", "sideways"]

# Radius of the helices of two braided strands, over the radius of the rod. The strands do not touch.
_BRAID_RADIUS = 2.5
# Rise of a strand along the braid while it turns by pi, over the circumference of half a turn.
_BRAID_SLOPE = 1.5
# Longest edge over the radius of the rod. Its chord leaves the helix of the braid, whose radius of curvature rho is
# 3.25 braid radii, by h^2 / (8 rho) = 1.25 radii. Strands are 4.8 radii apart after the corners are rounded, so they do
# not touch.
_LONGEST_EDGE = 9.0
_NODES = 301  # least number by default
# Default length of a rod over the length of its knot.
_TAIL_ROOM = 1.25
# Distance of points, over the largest coordinate, below which they count as equal.
_ROUNDING = 1e-12


@keyword_hints
def overhand_knot(
    n: int = 1,
    *,
    length: float | None = None,
    radius: float = 1.6e-3,
    shortening: float | None = None,
    nodes: int | None = None,
) -> FloatArray:
    """Points of a loose overhand knot along the x axis with straight tails, to be tightened by its ends.

    Two strands wind about each other by (2 n + 1) half turns. With n = 1 the knot is the trefoil; the closed curve is
    the torus knot (2, 2 n + 1).

    Parameters
    ----------
    n : int
        Number of times that the tail passes through the loop.
    length : float [m]
        Length of the whole rod. By default 1 m, or more if the knot and its tails need it.
    radius : float [m]
        Radius of the section.
    shortening : float [m]
        Length minus the distance of the ends. By default 0.6 of the length, or more if the knot needs it.
    nodes : int
        Number of nodes. By default 301, or more if edges would be longer than 9 radii, which would cut off the bends.

    Returns
    -------
    ndarray of shape (nodes, 3) [m]
        Evenly spaced points.

    Raises
    ------
    ValueError
        A shortening too small for the knot, a length too small for the shortening, or too few nodes for the length.

    Examples
    --------
    >>> import numpy as np
    >>> x = overhand_knot(length=1.0, shortening=0.6)
    >>> x.shape
    (301, 3)
    >>> bool(abs(np.linalg.norm(x[-1] - x[0]) - 0.4) < 1e-2)
    True
    """
    n = validation.integer(n, "n of the knot", 1, 50)
    radius = validation.positive(radius, "radius of the rod")
    braid_radius = _BRAID_RADIUS * radius
    half_turns = 2 * n + 1
    braid = _BRAID_SLOPE * np.pi * braid_radius * half_turns

    def whole(loop: float, tail: float) -> FloatArray:
        phase = np.linspace(0.0, half_turns * np.pi, 40 * half_turns)
        along = phase / phase[-1] * braid
        first = np.stack([along, braid_radius * np.cos(phase), braid_radius * np.sin(phase)], axis=1)
        second = first * [1.0, -1.0, -1.0]
        turn = np.linspace(0.0, np.pi, 60)[1:-1]
        right = np.stack(
            [
                braid + 2.0 * radius + loop * np.sin(turn),
                -braid_radius - loop * (1.0 - np.cos(turn)),
                np.zeros_like(turn),
            ],
            axis=1,
        )
        left = np.stack(
            [
                -2.0 * radius - loop * np.sin(turn),
                -braid_radius - loop * (1.0 + np.cos(turn)),
                np.zeros_like(turn),
            ],
            axis=1,
        )
        ends = np.array([[-tail, braid_radius, 0.0]]), np.array([[braid + tail, braid_radius, 0.0]])
        return np.concatenate([ends[0], first, right, left, second, ends[1]])

    def excess(loop: float) -> float:
        return _length(whole(loop, braid)) - 3.0 * braid

    smallest = 3.0 * braid_radius
    least = excess(smallest)
    if length is None:
        wanted = 1.2 * least if shortening is None else validation.positive(shortening, "shortening")
        length = max(1.0, _TAIL_ROOM * (wanted + braid))
    length = validation.positive(length, "length of the rod")
    shortening = max(0.6 * length, 1.2 * least) if shortening is None else validation.positive(shortening, "shortening")
    if least > shortening:
        raise ValueError(f"shortening must be at least {least:.3g} m for this knot, got {shortening:g} m")
    low, high = smallest, length
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < shortening else (low, middle)
    tail = 0.5 * (length - shortening - braid)
    if tail <= 4.0 * braid_radius:
        raise ValueError(f"length of the rod must leave tails beside the braid, got {length:g} m, which is too short")
    return _even(whole(low, tail), _node_count(nodes, length, radius), length, braid_radius)


@keyword_hints
def reef_knot(
    *, length: float = 1.0, radius: float = 2e-3, nodes: int | None = None, tails: Tails = "up"
) -> FloatArray:
    """Points of a loose reef knot: two half knots of opposite handedness, the first around the middle of the rod.

    Parameters
    ----------
    length : float [m]
        Length of the whole rod.
    radius : float [m]
        Radius of the section.
    nodes : int
        Number of nodes. By default 301, or more if edges would be longer than 9 radii, which would cut off the bends.
    tails : {"up", "sideways"}
        Direction of the ends: along +z, or along x, away from each other, as if they were pulled apart.

    Returns
    -------
    ndarray of shape (nodes, 3) [m]
        Evenly spaced points; the loop hangs below. The knot is symmetric under half a turn about z.

    Raises
    ------
    ValueError
        A length too small for the knot, too few nodes for the length, or unknown tails.
    """
    return _two_half_knots(-1.0, length, radius, nodes, tails)


@keyword_hints
def granny_knot(
    *, length: float = 1.0, radius: float = 2e-3, nodes: int | None = None, tails: Tails = "up"
) -> FloatArray:
    """Return the points of a loose granny knot: like `reef_knot`, with two half knots of the same handedness.

    Parameters
    ----------
    length : float [m]
        Length of the whole rod.
    radius : float [m]
        Radius of the section.
    nodes : int
        Number of nodes. By default 301, or more if edges would be longer than 9 radii, which would cut off the bends.
    tails : {"up", "sideways"}
        Direction of the ends: along +z, or along x, away from each other, as if they were pulled apart.

    Returns
    -------
    ndarray of shape (nodes, 3) [m]
        Evenly spaced points; the loop hangs below.

    Raises
    ------
    ValueError
        A length too small for the knot, too few nodes for the length, or unknown tails.
    """
    return _two_half_knots(1.0, length, radius, nodes, tails)


def _two_half_knots(second_hand: float, length: float, radius: float, nodes: int | None, tails: Tails) -> FloatArray:
    length = validation.positive(length, "length of the rod")
    radius = validation.positive(radius, "radius of the rod")
    validation.choice(tails, "tails of the knot", get_args(Tails))
    r = _BRAID_RADIUS * radius
    width = _BRAID_SLOPE * np.pi * r * 3.0
    rise = 8.0 * r  # between the braids

    def strand(height: float, hand: float) -> FloatArray:
        """From the left end below to the right end above, by three half turns about the x axis."""
        phase = np.linspace(0.0, 3.0 * np.pi, 120)
        return np.stack(
            [width * (phase / phase[-1] - 0.5), hand * r * np.sin(phase), height - r * np.cos(phase)], axis=1
        )

    mirror = np.array([-1.0, -1.0, 1.0])  # half a turn about z takes one strand into the other
    first, second = strand(0.0, 1.0), strand(rise, second_hand)

    def side(start: FloatArray, end: FloatArray, reach: float) -> FloatArray:
        """From an end of one braid to the end of the next above it, out to one side and back."""
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 30)[1:-1]
        sign = np.sign(start[0])
        middle, half = 0.5 * (start + end), 0.5 * (end[2] - start[2])
        return np.stack(
            [middle[0] + sign * reach * np.cos(angle), np.zeros_like(angle), middle[2] + half * np.sin(angle)], axis=1
        )

    # One half: up through the first braid to the right, out and back, through the second to the left; and its tail.
    begin, end = first[0], second[0] * mirror
    half = np.concatenate([first, side(first[-1], end, rise), second * mirror])
    top = half[-1]
    used = 2.0 * _length(half)
    loop = 0.3 * (length - used)
    if loop < rise:
        least = used + 4.0 * rise
        raise ValueError(f"length of the rod must be at least {least:.3g} m for this knot, got {length:g} m")
    # The loop below: half an ellipse from one braid's left end to its right end.
    angle = np.linspace(0.0, 0.5 * np.pi, 60)
    depth = 0.5 * loop
    bottom = np.stack(
        [
            begin[0] * np.cos(angle) - 0.25 * loop * np.sin(2.0 * angle),
            np.zeros_like(angle),
            begin[2] - depth * np.sin(angle),
        ],
        axis=1,
    )[1:]
    arm = np.concatenate([bottom[::-1], half])
    tail = 0.5 * length - _length(arm)
    if tail <= 0.0:
        raise ValueError(f"length of the rod must be greater for this knot, got {length:g} m")
    if tails == "sideways":
        arm = np.concatenate([arm, top + np.array([[-tail, 0.0, 0.0]])])
    else:
        angle = np.linspace(0.0, 0.5 * np.pi, 30)[1:]
        bend = top + 4.0 * r * np.stack([-np.sin(angle), np.zeros_like(angle), 1.0 - np.cos(angle)], axis=1)
        up = bend[-1] + np.array([[0.0, 0.0, max(tail - 2.0 * np.pi * r, radius)]])
        arm = np.concatenate([arm, bend, up])
    return _even(np.concatenate([(arm * mirror)[::-1], arm[1:]]), _node_count(nodes, length, radius), length, r)


def _node_count(nodes: int | None, length: float, radius: float) -> int:
    """Number of nodes of a knot: those that are asked for, if its edges are short enough, or as many as it takes."""
    least = int(np.ceil(length / (_LONGEST_EDGE * radius))) + 1
    asked = validation.integer(max(_NODES, least) if nodes is None else nodes, "nodes", 10, 10**7)
    if asked < least:
        raise ValueError(
            f"nodes must be at least {least} for a knot in {length:g} m of radius {radius:g} m, got {asked}: edges"
            f" longer than {_LONGEST_EDGE:g} radii cut through its bends"
        )
    return asked


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _even(points: FloatArray, nodes: int, length: float, braid_radius: float) -> FloatArray:
    """Points at even distances along a smoothed line, as long as it should be."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    places = np.concatenate([[0.0], np.cumsum(steps)])
    fine = np.linspace(0.0, places[-1], 20 * max(nodes, int(places[-1] / braid_radius)))
    line = np.stack([np.interp(fine, places, points[:, k]) for k in range(3)], axis=1)
    # Corners between the pieces: a running mean over the width of a braid, however long the rod is; ends kept.
    width = max(3, int(1.5 * braid_radius / places[-1] * len(fine)) | 1)
    ends = line[:1], line[-1:]
    half = width // 2
    padded = np.concatenate([2 * ends[0] - line[half:0:-1], line, 2 * ends[1] - line[-2 : -half - 2 : -1]])
    kernel = np.ones(width) / width
    line = np.stack([np.convolve(padded[:, k], kernel, "valid") for k in range(3)], axis=1)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    places = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.linspace(0.0, places[-1], nodes)
    line = np.stack([np.interp(even, places, line[:, k]) for k in range(3)], axis=1)
    return line * (length / _length(line))


def writhe(points: npt.ArrayLike, closed: bool = False) -> float:
    """Return the writhe of a polygon. The ends of an open polygon are continued straight to infinity.

    The Gauss integral over each pair of edges is the area that their directions sweep on the sphere
    [Klenin and Langowski 2000, method 1a].

    Parameters
    ----------
    points : array_like of shape (nodes, 3) [m]
    closed : bool
        True if the last point is joined to the first, which may be repeated at the end.

    Returns
    -------
    float [turns]

    Raises
    ------
    ValueError
        A wrong shape, values that are not finite, or fewer than 3 different points in a row.
    """
    x = _polygon(points, 3, closed)
    if not closed:
        far = 1e4 * _length(x)
        first, last = x[0] - x[1], x[-1] - x[-2]
        x = np.concatenate([x[:1] + far * first / np.linalg.norm(first), x, x[-1:] + far * last / np.linalg.norm(last)])
    start, end = (x, np.roll(x, -1, axis=0)) if closed else (x[:-1], x[1:])
    total = 0.0
    for i in range(len(start) - 2):  # edges that share a node lie in a plane and sweep nothing
        last = len(start) - (1 if closed and i == 0 else 0)
        total += float(_gauss(start[i], end[i], start[i + 2 : last], end[i + 2 : last]).sum())
    return total / (2.0 * np.pi)


def link(points: FloatArray, directors: FloatArray, closed: bool) -> float:
    """Return the twist of material frames over parallel transport, plus the writhe of the polygon.

    Parameters
    ----------
    points : ndarray of shape (nodes, 3) [m]
        Nodes of the rod.
    directors : ndarray of shape (edges, 3, 3)
        Material frames of the edges, with rows d1, d2, tangent.
    closed : bool
        True if the last point is joined to the first.

    Returns
    -------
    float [turns]

    Raises
    ------
    ValueError
        See `writhe`.

    See Also
    --------
    writhe : Writhe alone.
    """
    first, tangent = directors[:, 0], directors[:, 2]
    stencils = len(first) - (0 if closed else 1)
    _, twists = natural_shape(tangent, first, np.ones(stencils), closed)
    return float(twists.sum()) / (2.0 * np.pi) + writhe(points, closed)


def _gauss(a0: FloatArray, a1: FloatArray, b0: FloatArray, b1: FloatArray) -> FloatArray:
    """Signed area on the sphere that the directions from one edge to others sweep, shape (edges,)."""
    sides = [b0 - a0, b1 - a0, b1 - a1, b0 - a1]
    normals = []
    for k in range(4):
        normal = np.cross(sides[k], sides[(k + 1) % 4])
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        normals.append(np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0))
    area = np.zeros(len(b0))
    for k in range(4):
        area += np.arcsin(np.clip(np.sum(normals[k] * normals[(k + 1) % 4], axis=1), -1.0, 1.0))
    sign = np.sign(np.einsum("ij,j,ij->i", np.cross(b1 - b0, a1 - a0), np.ones(3), sides[0]))
    return np.where(sign == 0.0, 0.0, sign * area)


def signed_crossings(points: npt.ArrayLike, direction: npt.ArrayLike = (0.0, 0.0, 1.0)) -> int:
    """Return the sum of the signs of the crossings of a curve seen from a direction: the writhe of its diagram.

    Parameters
    ----------
    points : array_like of shape (nodes, 3)
        Points of a closed curve, with the first one repeated at the end.
    direction : array_like of shape (3,)
        Direction from which the curve is seen.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        A wrong shape, values that are not finite, or a direction of length zero.
    """
    x = _polygon(points, 1, False)
    view = validation.unit_vector(direction, "direction")
    first = np.cross(view, np.eye(3)[int(np.argmin(np.abs(view)))])
    first /= np.linalg.norm(first)
    flat = np.stack([x @ first, x @ np.cross(view, first)], axis=1)
    height = x @ view
    a, edge = flat[:-1], np.diff(flat, axis=0)
    ends_meet = not _moves(x)[0]
    count = 0
    for i in range(len(a)):  # edges that share a node do not cross
        j = np.arange(i + 2, len(a) - (1 if ends_meet and i == 0 else 0))
        area = edge[i, 0] * edge[j, 1] - edge[i, 1] * edge[j, 0]
        gap = a[j] - a[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (gap[:, 0] * edge[j, 1] - gap[:, 1] * edge[j, 0]) / area
            t = (gap[:, 0] * edge[i, 1] - gap[:, 1] * edge[i, 0]) / area
        for k in np.flatnonzero((s >= 0) & (s < 1) & (t >= 0) & (t < 1)):
            above = height[i] + s[k] * (height[i + 1] - height[i])
            below = height[j[k]] + t[k] * (height[j[k] + 1] - height[j[k]])
            count += int(np.sign(area[k]) * np.sign(above - below))
    return count


def alexander_polynomial(points: npt.ArrayLike, closed: bool = False) -> npt.NDArray[np.int64]:
    """Return the Alexander polynomial of a knot: 1 for no knot, 1 - t + t^2 for a trefoil.

    Parameters
    ----------
    points : array_like of shape (nodes, 3)
    closed : bool
        True if the last point is joined to the first, which may be repeated at the end. The ends of an open curve are
        joined on the outside, straight away from the middle of the curve.

    Returns
    -------
    ndarray of int of shape (degree + 1,)
        Coefficients from the lowest power of t on. The first is not zero, and they sum to 1.

    Raises
    ------
    ValueError
        A wrong shape, values that are not finite, or far more crossings than knots that are tied by hand.

    Examples
    --------
    >>> import withe
    >>> withe.knots.alexander_polynomial(withe.knots.overhand_knot())
    array([ 1, -1,  1])
    """
    return diagrams.alexander(_diagram(points, closed))


def signature(points: npt.ArrayLike, closed: bool = False) -> int:
    """Return the signature of a knot, which changes sign in a mirror. A granny knot has 4 or -4, a reef knot 0.

    Parameters
    ----------
    points : array_like of shape (nodes, 3)
    closed : bool
        See `alexander_polynomial`.

    Returns
    -------
    int
        Signature; -2 for the right-handed trefoil.

    Raises
    ------
    ValueError
        A wrong shape, or values that are not finite.

    Examples
    --------
    >>> import withe
    >>> withe.knots.signature(withe.knots.reef_knot())
    0
    """
    return diagrams.signature(_diagram(points, closed))


def _polygon(points: npt.ArrayLike, least: int, closed: bool) -> FloatArray:
    """Points without those that are where the one before is; round a closed curve that of the first is the last."""
    given = validation.number_array(points, "points", ("n", 3))
    moves = _moves(given)
    if not closed:
        moves[:1] = True
    if moves.sum() < least:
        raise ValueError(f"points must have at least {least} different rows, got {moves.sum()}")
    return given[moves]


def _moves(points: FloatArray) -> npt.NDArray[np.bool_]:
    """Which points are elsewhere than those before them, the first than the last."""
    apart = np.abs(points - np.roll(points, 1, axis=0))
    return np.asarray((apart > _ROUNDING * np.abs(points).max(initial=0.0)).any(1))


def _diagram(points: npt.ArrayLike, closed: bool) -> diagrams.Diagram:
    curve = _polygon(points, 4, closed)
    return diagrams.diagram(curve if closed else diagrams.closed_far_away(curve))
