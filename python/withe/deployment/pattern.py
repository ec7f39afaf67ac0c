"""Patterns on a floor along which a cable is laid."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.deprecation import renamed
from withe.common.keywords import keyword_hints
from withe.common.user_warnings import warn
from withe.deployment.cable import Cable
from withe.deployment.feasibility import Feasibility, Method, examine
from withe.deployment.letters import written
from withe.deployment.smoothing import fourth_differences, smooth
from withe.perception import trace

__all__ = ["Pattern"]

FloatArray = npt.NDArray[np.float64]
_COLUMNS: dict[str, tuple[int, ...]] = {  # arrays of a pattern, by node
    "arc_length": (),
    "points": (2,),
    "tangent": (2,),
    "curvature": (),
    "curvature_slope": (),
    "curvature_bend": (),
}
_FUNCTION_SAMPLES = 2001
_SLOWEST = 0.15  # least speed of the curve relative to the given points, reached where it turns back by 160 degrees
_MUCH_FARTHER = 1.5
_AT_ONCE = 500  # points whose distances from all pieces of a curve are in memory
_AVERAGED = 101  # samples of an average
_REACH = 0.02  # relative to the length: chord at an end
_ENOUGH = 10.0  # [smoothing], for a direction
_LEAST_BEHIND, _MOST_BEHIND = (
    0.1,
    0.5,
)  # relative to the length of a pattern: distance over which the continuation becomes straight
_BENT_START = 1.0  # [rad]: curvature at the start of a function times its length; above it a lead-in is added


@keyword_hints
class Pattern:
    """A curve on the floor, smoothed and resampled by its length.

    Exactly one of `points`, `function` and `image` defines the curve. The cable's free end lies at its beginning.

    Parameters
    ----------
    points : array_like of shape (n, 2) or (n, 3) [m]
        Points in order along the curve. A third column, the height, is ignored.
    function : callable
        Function from an array of shape (n,) of shares of the path, 0 to 1, to points of shape (n, 2) [m].
    image : str, Path or array_like of shape (height, width, 3)
        Picture of a drawn curve, traced by `withe.perception`, with y upwards. The longest curve is used. Needs
        `scale`.
    scale : float [m]
        Size of one pixel.
    smoothing : float [m]
        Largest distance of the pattern from the given curve, at its nodes. Among all such curves, the pattern is the
        one that a floor holds with the least friction: its greatest EI x'''' is least. A free end has no moment, so a
        curve that begins with curvature begins a little straighter. Behind the given curve the cable is laid straight;
        if the curve ends with curvature, the curvature decays to zero.
    lead_in : float [m]
        Length of an extra piece before the beginning, along which the curvature grows from zero. By default none. For a
        `function` that begins with curvature, the default is the length over which the cable turns by one radian.
    nodes : int
        Number of points of the pattern, 50 to 2000.

    Attributes
    ----------
    raw : ndarray of shape (m, 2) [m]
        Given points, lead-in included.
    arc_length : ndarray of shape (nodes,) [m]
        Arc lengths of the nodes, uniform.
    points : ndarray of shape (nodes, 2) [m]
        Nodes of the pattern.
    tangent : ndarray of shape (nodes, 2)
        Unit tangents at the nodes.
    curvature : ndarray of shape (nodes,) [1/m]
        Curvature, positive to the left of the direction of the pattern.
    curvature_slope, curvature_bend : ndarray of shape (nodes,) [1/m^2], [1/m^3]
        First and second derivative of the curvature by arc length.
    curvature_behind : ndarray of shape (n,) [1/m]
        Curvature of the tail behind the pattern, in steps of `arc_length`. Beyond these steps the tail is straight.
    deviation : float [m]
        Greatest distance of a raw point from the pattern.
    lead_in : float [m]

    Raises
    ------
    ValueError
        None or several of the three, fewer than 3 points, repeated points, points that turn back, NaN, or a picture
        without a curve.

    Warns
    -----
    UserWarning
        The pattern departs by more than the smoothing, because it has too few nodes.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> x = np.linspace(0.0, 0.5, 101)
    >>> pattern = withe.deployment.Pattern(np.stack([x, 0.03 * np.sin(4 * np.pi * x)], 1))
    >>> print(f"{pattern.length:.3f} m, radius {1 / abs(pattern.curvature).max():.2f} m, {pattern.deviation < 1e-3}")
    0.517 m, radius 0.21 m, True
    """

    arc_length: FloatArray
    points: FloatArray
    deviation: float
    lead_in: float

    def __init__(
        self,
        points: npt.ArrayLike | None = None,
        *,
        function: Callable[[FloatArray], npt.ArrayLike] | None = None,
        image: str | os.PathLike[str] | npt.ArrayLike | None = None,
        scale: float | None = None,
        smoothing: float = 1e-3,
        lead_in: float | None = None,
        nodes: int = 301,
    ) -> None:
        if sum(given is not None for given in (points, function, image)) != 1:
            raise ValueError("a pattern needs exactly one of points, function and image")
        smoothing = validation.positive(smoothing, "smoothing")
        nodes = validation.integer(nodes, "nodes", 50, 2000)
        if points is not None:
            raw = _checked(points, "points")
        elif function is not None:
            share = np.linspace(0.0, 1.0, _FUNCTION_SAMPLES)
            raw = _checked(validation.function(function, "function")(share), "the values of function")
        else:
            raw = _drawn(image, scale)
        start = _start_curvature(raw, _REACH * float(_lengths(raw)[-1]))
        if lead_in is None:
            turns = abs(start) * _lengths(raw)[-1]
            lead_in = 2.0 / abs(start) if function is not None and turns > _BENT_START else 0.0
        self.lead_in = validation.non_negative(lead_in, "lead_in")
        if self.lead_in > 0.0:
            raw = np.concatenate([_lead_in(raw, start, self.lead_in), raw])
        self.raw = raw
        self._resample(smoothing, nodes)

    @classmethod
    def bends(
        cls,
        turns: npt.ArrayLike,
        radii: npt.ArrayLike,
        straights: npt.ArrayLike,
        *,
        easing: float = 0.1,
        smoothing: float = 1e-3,
        nodes: int = 301,
    ) -> Pattern:
        """Make a pattern of straight pieces and bends in turn, from the origin along x, with smooth curvature.

        Parameters
        ----------
        turns : array_like of shape (bends,) [rad]
            Angle of each bend, positive to the left.
        radii : array_like of shape (bends,) [m]
            Radii of the bends, before the curvature is smoothed.
        straights : array_like of shape (bends + 1,) [m]
            Lengths of the straight pieces before, between and after the bends.
        easing : float [m]
            Length over which the curvature is averaged, with the weights of a cosine.
        smoothing, nodes
            See `Pattern`.

        Returns
        -------
        Pattern

        Raises
        ------
        ValueError
            Numbers of bends that do not match, radii or easing that are not positive, negative straight pieces, or less
            than half of the easing before the first bend or after the last one.

        Examples
        --------
        >>> import numpy as np
        >>> import withe
        >>> letter = withe.deployment.Pattern.bends([np.pi], [0.1], [0.15, 0.15])
        >>> print(f"{letter.length:.2f} m, ends at y = {letter.points[-1, 1]:.2f} m")
        0.61 m, ends at y = 0.20 m
        """
        turned = validation.number_array(turns, "turns", ("bends",))
        bent = validation.number_array(radii, "radii", (len(turned),))
        straight = validation.number_array(straights, "straights", (len(turned) + 1,))
        easing = validation.positive(easing, "easing")
        if not np.all(bent > 0.0):
            raise ValueError(f"radii must be positive, got {bent.min():g}")
        if straight.min() < 0.0 or min(straight[0], straight[-1]) < 0.5 * easing:
            raise ValueError(
                f"straights must not be negative, and first and last at least half of easing, {0.5 * easing:g} m,"
                f" got {straight}"
            )
        lengths = np.empty(2 * len(turned) + 1)
        lengths[::2], lengths[1::2] = straight, np.abs(turned) * bent
        ends = np.concatenate([[0.0], np.cumsum(lengths)])
        s = np.linspace(0.0, ends[-1], _FUNCTION_SAMPLES)
        headings = np.concatenate([[0.0, 0.0], np.repeat(np.cumsum(turned), 2)])

        def heading_at(at: FloatArray) -> FloatArray:
            return np.asarray(np.interp(at, ends, headings))

        share = (np.arange(_AVERAGED) + 0.5) / _AVERAGED - 0.5
        weights = 1.0 + np.cos(2.0 * np.pi * share)
        heading = sum(w * heading_at(s + easing * u) for w, u in zip(weights / weights.sum(), share, strict=True))
        middle = 0.5 * (heading[1:] + heading[:-1])
        steps = s[1] * np.stack([np.cos(middle), np.sin(middle)], 1)
        points = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        return cls(points, smoothing=smoothing, nodes=nodes)

    @classmethod
    def word(cls, text: str, height: float, *, smoothing: float = 1e-3, nodes: int = 301) -> Pattern:
        """Make a pattern of a word in small letters, written without lifting the pen.

        Parameters
        ----------
        text : str
            Letters a to z and spaces. Dots, and the bars of f and t, are left out.
        height : float [m]
            Height of a small x. Letters are about 4 heights long, and have bends with a radius of a third of the
            height. A floor with friction 1 holds these if the radius is some 4 gravito-bending lengths of the cable.
        smoothing, nodes
            See `Pattern`.

        Returns
        -------
        Pattern
            Pattern with crossings in its loops. `plan(..., crossings="over")` lays the cable over itself there.

        Raises
        ------
        ValueError
            No text, other characters, or a height that is not positive.

        Examples
        --------
        >>> import withe
        >>> word = withe.deployment.Pattern.word("lace", height=0.05)
        >>> print(f"{word.length:.2f} m, crosses itself {len(word.crossings)} times")
        0.96 m, crosses itself 7 times
        """
        return cls(written(text, validation.positive(height, "height")), smoothing=smoothing, nodes=nodes)

    def _resample(self, smoothing: float, nodes: int) -> None:
        from scipy.interpolate import make_interp_spline

        lengths = _lengths(self.raw)
        even = np.linspace(0.0, lengths[-1], nodes)
        sampled = np.stack([np.interp(even, lengths, self.raw[:, i]) for i in range(2)], 1)
        # Input points may be wrong by as much as the smoothing moves them.
        reach = max(min(_REACH * even[-1], _ENOUGH * smoothing), 2.0 * even[1])
        end = -_start_curvature(sampled[::-1], reach)
        behind = _straight_on(sampled, end, reach)
        ways = even[1] * np.arange(1, len(behind) + 1)
        # As far aside as the circle of the end is, along which the bend may fade out.
        room = smoothing + np.concatenate([np.zeros(nodes), 0.5 * abs(end) * ways**2])
        given = np.concatenate([even, even[-1] + ways])
        curve = make_interp_spline(given, smooth(np.concatenate([sampled, behind]), even[1], room), k=5)
        fine = np.linspace(0.0, given[-1], 20 * len(given))
        speed = np.linalg.norm(curve(fine, 1), axis=1)
        _require_smooth(speed, fine)
        travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(fine))])
        spacing = np.interp(even[-1], fine, travelled) / (nodes - 1)
        s = spacing * np.arange(int(travelled[-1] / spacing) + 1)
        curve = make_interp_spline(s, curve(np.interp(s, travelled, fine)), k=5)
        points, first, second, third = (curve(s, order) for order in range(4))
        fourth = fourth_differences(len(s)) @ points / spacing**4  # smoothing keeps it small
        curvature = _cross(first, second)
        self.arc_length, self.points = s[:nodes], points[:nodes]
        self.tangent: FloatArray = (first / np.linalg.norm(first, axis=1)[:, None])[:nodes]
        self.curvature: FloatArray = curvature[:nodes]
        self.curvature_slope: FloatArray = _cross(first, third)[:nodes]
        self.curvature_bend: FloatArray = (_cross(first, fourth) + _cross(second, third))[:nodes]
        self.curvature_behind: FloatArray = curvature[nodes:]
        self.deviation = float(distances(self.raw, self.points).max())
        if self.deviation > _MUCH_FARTHER * smoothing:
            away, asked = 1e3 * self.deviation, 1e3 * smoothing
            warn(
                f"the pattern deviates by {away:.1f} mm from the given points, for a smoothing of {asked:.1f} mm: "
                f"{nodes} nodes, one every {1e3 * even[1]:.1f} mm, are too coarse for the bends. Give more nodes",
                cause="pattern",
            )

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as lists, for JSON. SI units.

        Returns
        -------
        dict
            All fields by name.
        """
        columns = {name: getattr(self, name).tolist() for name in ("raw", "curvature_behind", *_COLUMNS)}
        return {**columns, "deviation": self.deviation, "lead_in": self.lead_in}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Pattern:
        """Return the pattern of a `to_dict`, to the last digit. It is not smoothed again.

        Parameters
        ----------
        content : mapping
            Fields, as `to_dict` returns them.

        Returns
        -------
        Pattern

        Raises
        ------
        KeyError, TypeError, ValueError
            Content that is missing, not numeric, or inconsistent.
        """
        pattern = cls.__new__(cls)
        pattern.raw = validation.number_array(content["raw"], "raw", ("m", 2))
        pattern.arc_length = validation.number_array(content["arc_length"], "arc_length", ("nodes",))
        count = len(pattern.arc_length)
        if count < 2 or pattern.arc_length[0] != 0.0 or (np.diff(pattern.arc_length) <= 0.0).any():
            raise ValueError("arc_length must increase from 0")
        for name, shape in _COLUMNS.items():
            setattr(pattern, name, validation.number_array(content[name], name, (count, *shape)))
        behind = content.get("curvature_behind", [0.0])  # absent in older files
        pattern.curvature_behind = validation.number_array(behind, "curvature_behind", ("n",))
        pattern.deviation = validation.non_negative(content["deviation"], "deviation")
        pattern.lead_in = validation.non_negative(content["lead_in"], "lead_in")
        return pattern

    @property
    def length(self) -> float:
        """Length of the pattern, lead-in included [m]."""
        return float(self.arc_length[-1])

    @cached_property
    def crossings(self) -> FloatArray:
        """Pairs of arc lengths at which the pattern crosses itself, shape (crossings, 2) [m]."""
        return crossings(self.points, self.arc_length)

    @renamed(controller="method")
    def feasibility(self, cable: Cable, friction: float, method: Method = "exact") -> Feasibility:
        """Predict where friction holds the cable on the pattern while it is laid.

        Parameters
        ----------
        cable : Cable
        friction : float [-]
            Friction coefficient between cable and floor.
        method : {"exact", "least_friction"}
            Method by which the cable is laid.

        Returns
        -------
        Feasibility

        Raises
        ------
        ValueError
            Friction that is negative or above 10; a cable shorter than the pattern, or one that cannot bend so tightly.

        Examples
        --------
        >>> import withe
        >>> angle = np.linspace(0.0, 1.6 * np.pi, 200)
        >>> circle = withe.deployment.Pattern(0.09 * np.stack([np.sin(angle), 1 - np.cos(angle)], 1), lead_in=0.15)
        >>> found = circle.feasibility(withe.deployment.Cable.dlo(2), friction=0.4)
        >>> print(found.feasible, f"{found.lift_off.max():.2f}")
        True 0.26
        """
        return examine(self, cable, friction, method)

    def __repr__(self) -> str:
        away = f"{1e3 * self.deviation:.1f} mm from what was given"
        return f"Pattern({self.length:.3f} m, {len(self.points)} points, {away})"


def crossings(points: FloatArray, arc_length: FloatArray) -> FloatArray:
    """Pairs of arc lengths at which a polyline crosses itself, shape (crossings, 2) [m]."""
    a, b = points[:-1], points[1:]
    way = b - a
    apart = a[None] - a[:, None]
    turn = way[:, None, 0] * way[None, :, 1] - way[:, None, 1] * way[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (apart[..., 0] * way[None, :, 1] - apart[..., 1] * way[None, :, 0]) / turn
        other = (apart[..., 0] * way[:, None, 1] - apart[..., 1] * way[:, None, 0]) / turn
    first, second = np.nonzero((along >= 0) & (along < 1) & (other >= 0) & (other < 1))
    later = second > first + 1
    first, second = first[later], second[later]
    places = np.stack([first + along[first, second], second + other[first, second]], 1)
    return np.interp(places, np.arange(len(arc_length)), arc_length)


def distances(points: FloatArray, curve: FloatArray) -> FloatArray:
    """Distance of each point from a polyline, shapes (n, 2) and (m, 2)."""
    start, way = curve[:-1], np.diff(curve, axis=0)
    size = (way**2).sum(1)

    def nearest(some: FloatArray) -> FloatArray:
        apart = some[:, None] - start
        along = np.clip((apart * way).sum(-1) / size, 0.0, 1.0)
        return np.asarray(np.linalg.norm(apart - along[..., None] * way, axis=-1).min(1))

    parts = range(0, len(points), _AT_ONCE)
    return np.concatenate([nearest(points[first : first + _AT_ONCE]) for first in parts])


def _require_smooth(speed: FloatArray, s: FloatArray) -> None:
    """Refuse curves whose speed vanishes where they turn back [m]."""
    slowest = int(speed.argmin())
    if speed[slowest] < _SLOWEST:
        raise ValueError(
            f"a pattern must not turn back on itself, but does at {1e3 * s[slowest]:.0f} mm: draw a bend there"
        )


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _lengths(points: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _checked(points: Any, what: str) -> FloatArray:
    array = validation.number_array(points, what, ("n", 2), ("n", 3))[:, :2]
    if len(array) < 3:
        raise ValueError(f"{what} must be at least 3, got {len(array)}")
    same = np.flatnonzero((np.diff(array, axis=0) == 0.0).all(1))
    if same.size:
        raise ValueError(f"{what} must not repeat: rows {same[0]} and {same[0] + 1} are the same")
    return array


def _drawn(image: Any, scale: float | None) -> FloatArray:
    """The longest curve of a picture [m], y upwards."""
    if scale is None:
        raise ValueError("a pattern from an image needs scale, the size of a pixel in m")
    size = validation.positive(scale, "scale")
    tracing = trace(image, mask="ground")  # drawn lines are no cables to the learned mask
    curves = [line for line in tracing.centrelines if len(line) >= 3]
    if not curves:
        raise ValueError("image must show a curve, but no curve was found")
    longest = max(curves, key=lambda line: float(_lengths(line)[-1]))
    return np.asarray(size * longest * [1.0, -1.0])


def _start_curvature(points: FloatArray, reach: float) -> float:
    """Return the curvature of the circle through the points at arc lengths 0, `reach` and 2 `reach`."""
    a, b, c = (_along(points, way) for way in (0.0, reach, 2.0 * reach))
    area = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
    sides = np.linalg.norm(b - a) * np.linalg.norm(c - b) * np.linalg.norm(c - a)
    return float(2.0 * area / sides) if sides > 0.0 else 0.0


def _straight_on(points: FloatArray, curvature: float, reach: float) -> FloatArray:
    """Points behind the last one, along its direction as far as twice the radius of the end, spaced as the last two."""
    lengths = _lengths(points)
    length, spacing = float(lengths[-1]), float(lengths[-1] - lengths[-2])
    heading = _start_heading(points[::-1], -curvature, reach) + np.pi
    far = 2.0 / max(abs(curvature), 1e-300)
    count = min(int(np.ceil(np.clip(far, _LEAST_BEHIND * length, _MOST_BEHIND * length) / spacing)), len(points))
    ways = spacing * np.arange(1, count + 1)
    return np.asarray(points[-1] + ways[:, None] * [np.cos(heading), np.sin(heading)])


def _start_heading(points: FloatArray, curvature: float, reach: float) -> float:
    """Direction of a curve at its beginning, from a chord of the circle there."""
    chord = _along(points, reach) - points[0]
    return float(np.arctan2(chord[1], chord[0]) - 0.5 * curvature * reach)


def _along(points: FloatArray, way: float) -> FloatArray:
    """The point so far along a polyline."""
    lengths = _lengths(points)
    return np.array([np.interp(way, lengths, points[:, i]) for i in range(2)])


def _lead_in(points: FloatArray, curvature: float, length: float) -> FloatArray:
    """Points before the first one: curvature falls smoothly to zero, backwards from there."""
    count = 200
    back = np.linspace(0.0, 1.0, count + 1)
    heading = _start_heading(points, curvature, _REACH * float(_lengths(points)[-1]))
    # Curvature (1 - 3 u^2 + 2 u^3) of its value, u from 0 at the beginning of the pattern to 1 where it is straight.
    angle = heading - curvature * length * (back - back**3 + 0.5 * back**4)
    middle = 0.5 * (angle[1:] + angle[:-1])
    steps = -np.stack([np.cos(middle), np.sin(middle)], 1) * length / count
    return np.asarray((points[0] + np.cumsum(steps, axis=0))[::-1])
