"""Tubes, in and around which rods move."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation

__all__ = ["Tube"]

FloatArray = npt.NDArray[np.float64]

# Greatest turn of a piece of the axis, between two of its ends [rad].
_TURN = 0.05
_SIDES = 40


@dataclass(frozen=True, eq=False)
class Tube:
    """A tube about a smooth axis, open at both ends: a vessel, a catheter, a hole in a wall.

    The axis is the cubic spline through the points. Rods touch the tube from inside and from outside. The rims at both
    ends are round, with half the thickness of the wall as their radius.

    Parameters
    ----------
    points : array_like of shape (n, 3) [m]
        Points of the axis, in order; two give a straight tube.
    radius : float [m]
        Inner radius.
    wall : float [m]
        Thickness of the wall. By default a tenth of the radius.

    Raises
    ------
    ValueError
        Points at one place, an axis that bends tighter than the tube is wide, or a tube that passes through itself.

    See Also
    --------
    Scene.add_obstacle : Add the tube to a scene.
    Field : A solid by its signed distance.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> angle = np.linspace(0.0, np.pi / 2.0, 9)
    >>> bend = withe.solids.Tube(0.05 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), radius=0.002)
    >>> round(bend.length, 5)
    0.07854
    """

    points: npt.ArrayLike
    radius: float
    wall: float | None = None

    def __post_init__(self) -> None:
        points = validation.number_array(self.points, "points of the tube", ("n", 3))
        radius = validation.positive(self.radius, "radius of the tube")
        wall = 0.1 * radius if self.wall is None else validation.positive(self.wall, "wall of the tube")
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if len(points) < 2 or not (steps > 0.0).all():
            raise ValueError("points of the tube must be two and more, and no two that follow each other may be equal")
        ends, middles = _axis(points, np.concatenate([[0.0], np.cumsum(steps)]))
        _check_axis(ends, middles, radius + wall)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "_curves", (ends, middles))

    @property
    def thickness(self) -> float:
        """Thickness of the wall [m]."""
        return 0.1 * float(self.radius) if self.wall is None else float(self.wall)

    @property
    def length(self) -> float:
        """Length of the axis [m]."""
        along, _, _ = self._frames()
        return float(np.linalg.norm(np.diff(along, axis=0), axis=1).sum())

    def axis(self) -> FloatArray:
        """Return points along the axis, at most a radius apart.

        Returns
        -------
        ndarray of shape (n, 3) [m]
        """
        along, _, _ = self._frames()
        places = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(along, axis=0), axis=1))])
        at = np.unique(np.concatenate([places, np.arange(0.0, places[-1], float(self.radius))]))
        return np.column_stack([np.interp(at, places, along[:, k]) for k in range(3)])

    def curves(self) -> tuple[FloatArray, FloatArray]:
        """Return the axis as quadratic Bezier curves with continuous directions.

        Returns
        -------
        ends : ndarray of shape (m + 1, 3) [m]
            Where curves begin and end.
        middles : ndarray of shape (m, 3) [m]
            Their middle control points.
        """
        ends, middles = self.__dict__["_curves"]
        return ends.copy(), middles.copy()

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the middle of the wall for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside. The ends are open.
        """
        along, first, second = self._frames()
        angles = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)[None, :, None]
        middle = float(self.radius) + 0.5 * self.thickness
        rings = along[:, None] + middle * (np.cos(angles) * first[:, None] + np.sin(angles) * second[:, None])
        ring, side = (index.ravel() for index in np.indices((len(along) - 1, _SIDES)))
        here, after = ring * _SIDES + side, ring * _SIDES + (side + 1) % _SIDES
        triangles = np.concatenate(
            [
                np.column_stack([here, after, after + _SIDES]),
                np.column_stack([here, after + _SIDES, here + _SIDES]),
            ]
        )
        return rings.reshape(-1, 3), triangles

    def _frames(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points of the axis, and two directions across it that turn with it."""
        ends, middles = self.__dict__["_curves"]
        along = np.concatenate([np.stack([ends[:-1], _at_half(ends, middles)], axis=1).reshape(-1, 3), ends[-1:]])
        tangents = np.gradient(along, axis=0)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        first = np.zeros_like(along)
        first[0] = np.cross(tangents[0], np.eye(3)[int(np.argmin(np.abs(tangents[0])))])
        for i in range(len(along)):
            across = first[max(i - 1, 0)]
            across = across - (across @ tangents[i]) * tangents[i]
            first[i] = across / np.linalg.norm(across)
        return along, first, np.cross(tangents, first)


def _at_half(ends: FloatArray, middles: FloatArray) -> FloatArray:
    """Middle of each curve."""
    return np.asarray(0.25 * (ends[:-1] + 2.0 * middles + ends[1:]), np.float64)


def _axis(points: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The cubic spline through points as quadratic curves: a pair for each of its pieces that turns by `_TURN`.

    Both have the directions of the spline at the ends of a piece, and meet with one direction.
    """
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(places, points, k=min(3, len(points) - 1))
    slope = spline.derivative()
    cuts = [places[:1]]
    for low, high in itertools.pairwise(places):
        tangents = slope(np.linspace(low, high, 33))
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        turn = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(tangents, axis=0), axis=1), 0.0, 1.0)).sum()
        cuts.append(np.linspace(low, high, max(1, int(np.ceil(turn / _TURN))) + 1)[1:])
    cut = np.concatenate(cuts)
    at, quarter = spline(cut), 0.25 * np.diff(cut)[:, None] * np.ones(3)
    slopes = slope(cut)
    first, second = at[:-1] + quarter * slopes[:-1], at[1:] - quarter * slopes[1:]
    ends = np.concatenate([np.stack([at[:-1], 0.5 * (first + second)], axis=1).reshape(-1, 3), at[-1:]])
    return ends, np.stack([first, second], axis=1).reshape(-1, 3)


def _check_axis(ends: FloatArray, middles: FloatArray, outer: float) -> None:
    """Refuse an axis that bends tighter than the tube is wide, and a tube that passes through itself."""
    from scipy.spatial import KDTree

    into, out = middles - ends[:-1], ends[1:] - middles
    bend = np.linalg.norm(np.cross(into, out), axis=1)
    # The curvature of a quadratic curve is greatest at an end, or where its control polygon is nearest to its middle.
    lengths = np.linalg.norm(into, axis=1), np.linalg.norm(out, axis=1)
    curvature = 0.5 * bend / np.minimum(*lengths) ** 3
    tightest = int(np.argmax(curvature))
    if curvature[tightest] * outer >= 1.0:
        place = ", ".join(f"{x:.4g}" for x in middles[tightest])
        raise ValueError(
            f"the axis of the tube bends with a radius of {1.0 / curvature[tightest]:.3g} m near ({place}) m, less "
            f"than the outer radius of the tube, {outer:.3g} m: give a thinner tube, or points of a smoother axis"
        )
    along = np.concatenate([[0.0], np.cumsum(lengths[0] + lengths[1])])
    count = int(np.clip(np.ceil(4.0 * along[-1] / outer), 2, 20000))
    at = np.linspace(0.0, along[-1], count)
    points = np.column_stack([np.interp(at, along, ends[:, k]) for k in range(3)])
    pairs = KDTree(points).query_pairs(1.9 * outer, output_type="ndarray")
    crossing = pairs[np.abs(at[pairs[:, 0]] - at[pairs[:, 1]]) > np.pi * outer] if len(pairs) else pairs
    if len(crossing):
        place = ", ".join(f"{x:.4g}" for x in points[crossing[0, 0]])
        raise ValueError(f"the tube passes through itself near ({place}) m: give a thinner tube, or two tubes")
