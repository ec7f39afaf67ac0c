"""Centrelines of rods as targets, and the fit of the rest shape of a sagging rod."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.short_repr import ShortRepr
from withe.parts.handles import Rod
from withe.perception.camera import Camera
from withe.real2sim.fitting import fit
from withe.real2sim.gathering import persistence
from withe.real2sim.places import lines_of, node_count, rod_part
from withe.real2sim.results import Fit
from withe.real2sim.targets import Residual, Target, across_of_points, checked_times, pixel_derivative
from withe.simulation.simulation import Simulation

__all__ = ["Centrelines", "rest_shape"]

FloatArray = npt.NDArray[np.float64]

_RESOLVED = 1e-6  # relative to the extent of a centreline: resolution of fits
_FOLLOWED = 1e-3  # relative to that extent: largest deviation of a fit that counts as followed
_ON_THE_WAY = 12  # iterations of fits with fewer functions than the last
_CHANCE = 1e-6  # a gain by more functions is significant if its probability by chance is below this


@dataclass(eq=False, repr=False)
class Centrelines(ShortRepr, Target):
    """Points seen along rods, without their arc lengths.

    A residual is the vector from an observed point to the nearest point of the simulated line. In pixels it is the
    distance, positive to the left of the line. With `ends`, the first and the last point are the ends of the line, in
    either order.

    Parameters
    ----------
    points : sequence of array_like of shape (n, 2) [px] or (n, 3) [m]
        Points of each frame, such as the centrelines of `perception.trace`. A frame without data has no points. Pixels
        need a camera.
    rods : Rod, str, or several
        Rods that continue each other end to end.
    camera : perception.Camera, optional
    ends : bool
        True if the whole line was seen.
    samples : int
        Largest number of points to use per centreline, about evenly spaced.
    sigma : float, optional [px or m]
        Standard deviation of a coordinate. By default estimated from the residuals.
    times : array_like of shape (frames,), optional [s]

    Raises
    ------
    ValueError
        Wrong shapes, or numbers that are not finite.
    """

    points: Sequence[npt.ArrayLike]
    rods: Rod | str | Sequence[Rod | str]
    camera: Camera | None = None
    ends: bool = True
    samples: int = 50
    sigma: float | None = None
    times: Any = None

    def __post_init__(self) -> None:
        dimension = 3 if self.camera is None else 2
        self.samples = validation.integer(self.samples, "samples", 2, 10**6)
        checked = []
        for frame, points in enumerate(self.points):
            if np.size(points) == 0:
                checked.append(np.zeros((0, dimension)))
                continue
            line = validation.number_array(points, f"points of frame {frame}", ("n", dimension))
            checked.append(_evenly(line, self.samples, frame))
        self.points = checked
        self.ends = validation.truth(self.ends, "ends")
        self.sigma = None if self.sigma is None else validation.positive(self.sigma, "sigma")
        self.times = checked_times(self.times, len(checked))

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.points)

    def told(self, frame: int) -> int:
        """Number of observations in a frame: a point determines the line across itself, an end in all directions."""
        points = np.asarray(self.points[frame])
        return points.size - len(points) + (2 if self.ends and len(points) else 0)

    def across(self, normal: FloatArray) -> FloatArray:
        """Return the normal at each point, or None in pixels."""
        return across_of_points(self.samples, normal, self.camera is None)

    def bind(self, simulation: Simulation) -> Residual:
        """Return the residual for the nodes of a simulation.

        Raises
        ------
        ValueError
            Rods that are not joined end to end.
        """
        given = [self.rods] if isinstance(self.rods, Rod | str) else list(self.rods)
        lines = lines_of(simulation, [rod_part(simulation, rod) for rod in given])
        if len(lines) != 1:
            raise ValueError(f"rods of Centrelines must be joined end to end as one line, got {len(lines)} lines")
        return _LineResidual(self, lines[0].rows, node_count(simulation))


class _LineResidual(Residual):
    def __init__(self, target: Centrelines, rows: npt.NDArray[np.int64], nodes: int) -> None:
        self._seen = [np.asarray(points) for points in target.points]
        self._camera, self._ends, self._sigma = target.camera, target.ends, target.sigma or 1.0
        self._rows, self._nodes, self._samples = rows, nodes, target.samples

    def value(self, positions: FloatArray, frame: int) -> FloatArray:
        line, seen = self._line(positions), self._seen[frame]
        if len(seen) == 0:
            return np.full(self._samples * line.shape[1], np.nan)
        edges, shares, _ = self._nearest(line, seen)
        nearest = line[edges] + shares[:, None] * (line[edges + 1] - line[edges])
        values = np.full((self._samples, line.shape[1]), np.nan)
        values[: len(seen)] = (nearest - seen) / self._sigma
        inner = self._inner(len(seen))
        if line.shape[1] == 2:
            left = self._left(line, seen, edges, nearest)
            values[inner, 0] = (left * (nearest - seen)).sum(axis=1)[inner] / self._sigma
            values[inner, 1] = np.nan
        return values.ravel()

    def _inner(self, count: int) -> slice:
        """Points that may be anywhere along the line."""
        return slice(1, count - 1) if self._ends else slice(0, count)

    @staticmethod
    def _left(line: FloatArray, seen: FloatArray, edges: npt.NDArray[np.int64], nearest: FloatArray) -> FloatArray:
        """Unit vectors along the way between each point and the nearest one of the line, to the left of it."""
        chord, away = line[edges + 1] - line[edges], nearest - seen
        normal = np.stack([-chord[:, 1], chord[:, 0]], axis=1) / np.linalg.norm(chord, axis=1)[:, None]
        distance = np.linalg.norm(away, axis=1)
        far = distance > 1e-9 * np.linalg.norm(chord, axis=1)
        sign = np.where((away * normal).sum(axis=1) < 0.0, -1.0, 1.0)
        return np.where(far[:, None], sign[:, None] * away / np.where(far, distance, 1.0)[:, None], normal)

    def derivative(self, positions: FloatArray, frame: int) -> FloatArray:
        line, seen = self._line(positions), self._seen[frame]
        dimension = line.shape[1]
        derivative = np.zeros((self._samples, dimension, self._nodes, 3))
        if len(seen) == 0:
            return derivative.reshape(-1, self._nodes, 3)
        edges, shares, slides = self._nearest(line, seen)
        chord = line[edges + 1] - line[edges]
        length = np.linalg.norm(chord, axis=1)[:, None]
        # The nearest point slides along its edge, but at ends and corners: only what goes across counts, less the
        # turn of the edge, as the way to it stays at right angles.
        tangent = np.where(slides[:, None], chord / length, 0.0)
        away = line[edges] + shares[:, None] * chord - seen
        across = np.eye(dimension) - tangent[:, :, None] * tangent[:, None]
        turned = tangent[:, :, None] * away[:, None] / length[:, :, None]
        if dimension == 2:  # a distance changes with what goes along the way alone
            inner = self._inner(len(seen))
            left = self._left(line, seen, edges, line[edges] + shares[:, None] * chord)
            across[inner], turned[inner] = 0.0, 0.0
            across[inner, 0] = left[inner]
        by_node = np.broadcast_to(np.eye(3), (len(self._rows), 3, 3))
        if self._camera is not None:
            by_node = pixel_derivative(self._camera, positions[self._rows])
        at = np.arange(len(seen))
        for end, share, sign in ((edges, 1.0 - shares, 1.0), (edges + 1, shares, -1.0)):
            by_end = share[:, None, None] * across + sign * turned
            derivative[at, :, self._rows[end]] += by_end @ by_node[end] / self._sigma
        return derivative.reshape(-1, self._nodes, 3)

    def _line(self, positions: FloatArray) -> FloatArray:
        points = positions[self._rows]
        return points if self._camera is None else self._camera.project(points)

    def _nearest(self, line: FloatArray, seen: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray, FloatArray]:
        """Edge and share of it where the line is nearest to each point, and whether that may slide."""
        chord = np.diff(line, axis=0)
        way = seen[:, None] - line[None, :-1]
        shares = np.clip((way * chord).sum(axis=2) / (chord**2).sum(axis=1), 0.0, 1.0)
        distance = np.linalg.norm(way - shares[:, :, None] * chord, axis=2)
        edges = distance.argmin(axis=1)
        at = np.arange(len(seen))
        share = shares[at, edges]
        if self._ends:
            same = np.linalg.norm(line[[0, -1]] - seen[[0, -1]]) <= np.linalg.norm(line[[-1, 0]] - seen[[0, -1]])
            last = len(line) - 2
            edges[[0, -1]] = (0, last) if same else (last, 0)
            share[[0, -1]] = (0.0, 1.0) if same else (1.0, 0.0)
        return edges, share, (share > 0.0) & (share < 1.0)


@keyword_hints
def rest_shape(
    simulation: Simulation,
    rod: Rod | str,
    centreline: npt.ArrayLike,
    camera: Camera | None = None,
    basis: Any = None,
    *,
    unknown: Literal["natural_curvature", "points"] = "natural_curvature",
    ends: bool = True,
    sigma: float | None = None,
    progress: bool = False,
) -> Fit:
    """Fit the rest shape of a rod, without its weight, to a photograph of the sagging rod.

    Parameters
    ----------
    simulation : Simulation
        Simulation of the supported rod with its stiffness and weight. It is not changed.
    rod : Rod or str
        Rod to fit.
    centreline : array_like of shape (n, 2) [px] or (n, 3) [m]
        Points along the rod, such as `perception.trace(picture).centrelines[0]`. Pixels need the camera.
    camera : perception.Camera, optional
        Camera of the photograph.
    basis : optional
        Basis of natural curvature, or of the rotations of edges, as in `fit`. By default "linear", to which cosines are
        added for natural curvature. The number of functions doubles until the centreline is followed to within `sigma`,
        or until more functions are not significant (F test).
    unknown : {"natural_curvature", "points"}
        "points" fits the drawn shape of the rod with its supports, including the angle of a clamp.
    ends : bool
        True if the centreline goes from end to end.
    sigma : float, optional [px or m]
        Standard deviation of a coordinate of the centreline. By default estimated from the residuals.
    progress : bool
        True to show a progress bar on a terminal and in a notebook.

    Returns
    -------
    Fit
        Result with one frame. `found.apply(simulation)` sets the rest shape. With ``unknown="points"``,
        `found.points(rod)` returns the drawn nodes. `Fit.reasons` names a basis that does not follow the centreline.

    Raises
    ------
    ValueError
        A centreline of another shape, or pixels without a camera.

    Examples
    --------
    >>> hanging = scene.build(integrator="static")
    >>> found = withe.real2sim.rest_shape(hanging, arm, [(0, 0, 0), (0.15, 0, -0.03), (0.25, 0, -0.12)], ends=False)
    >>> found.names[0]
    "natural_curvature of 'arm' [0]"
    """
    validation.choice(unknown, "unknown", ("natural_curvature", "points"))
    target = Centrelines([centreline], rod, camera, ends, sigma=sigma)
    given = "linear" if basis is None else basis
    found = fit(simulation, target, [(rod, unknown, given)], progress=progress)
    if basis is None and unknown == "natural_curvature":
        found = _refined(simulation, target, rod, found, progress)
    return _with_misfit_named(found, target)


def _refined(simulation: Simulation, target: Centrelines, rod: Rod | str, found: Fit, progress: bool) -> Fit:
    """Return the fit with as many functions as the centreline determines, beginning with linear functions."""
    voronoi = rod_part(simulation, rod).voronoi
    least = _RESOLVED * _extent(target) if target.sigma is None else target.sigma
    told, count, worse = target.told(0), 2, 0
    functions: list[Any] = []
    per_function = len(found.names) // count
    # Neither 2 nor 4 functions describe a curl of several turns. Therefore only two steps without gain end the search.
    while worse < 2 and _square(found, target) > told * least**2:
        count *= 2
        if count > len(voronoi) or per_function * count >= told:
            break
        unknowns = [(rod, "natural_curvature", _functions(voronoi, count))]
        # The fits from the drawn shape and from the coarser fit may end in different minima.
        coarser = simulation.copy()
        found.apply(coarser)
        fits = [
            fit(start, target, unknowns, max_iterations=_ON_THE_WAY, progress=progress)
            for start in (simulation, coarser)
        ]
        finer = min(fits, key=lambda each: _square(each, target))
        if _tells_more(finer, found, target):
            found, functions, worse = finer, unknowns, 0
        else:
            worse += 1
    if functions and not found.converged[0]:
        last = simulation.copy()
        found.apply(last)
        found = fit(last, target, functions, progress=progress)
    return found


def _functions(voronoi: FloatArray, count: int) -> FloatArray:
    """Linear functions at stencils, and cosines, whose sum approaches a smooth function as 1 / count^3."""
    share = (np.cumsum(voronoi) - 0.5 * voronoi) / voronoi.sum()
    waves = np.cos(np.pi * np.outer(share, np.arange(1, count - 1)))
    return np.concatenate([np.stack([1.0 - share, share], axis=1), waves], axis=1)


def _square(found: Fit, target: Centrelines) -> float:
    """Return the sum of the squared residuals of a fit [m^2 or px^2]."""
    return float(np.nansum(found.residuals[0] ** 2)) * (target.sigma or 1.0) ** 2


def _tells_more(finer: Fit, coarser: Fit, target: Centrelines) -> bool:
    """Return True if chance does not explain the gain of a fit with more functions, by the F test."""
    from scipy.special import fdtrc

    free, more = target.told(0) - len(finer.names), len(finer.names) - len(coarser.names)
    left = _square(finer, target)
    gain = _square(coarser, target) - left
    return gain > 0.0 and (left == 0.0 or bool(fdtrc(more, free, gain / more / (left / free)) < _CHANCE))


def _with_misfit_named(found: Fit, target: Centrelines) -> Fit:
    """The same fit, with a reason where neighbouring points are missed together, and by more than their error."""
    residuals = found.residuals[0].reshape(target.samples, -1)
    together = persistence(residuals)
    off = np.sqrt(_square(found, target) / max(target.told(0), 1))
    if 0 in found.reasons or not together or off <= (target.sigma or _FOLLOWED * _extent(target)):
        return found
    reason = (
        f"the basis does not follow the centreline: errors of neighbouring points are correlated ({together:.2f}), "
        f"with {off:.2g} {'m' if target.camera is None else 'px'} root mean square. Use more functions"
    )
    return replace(found, reasons={**found.reasons, 0: reason})


def _extent(target: Centrelines) -> float:
    """Greatest extent of the points that were seen [m or px]."""
    return float(np.ptp(np.asarray(target.points[0]), axis=0).max())


def _evenly(line: FloatArray, samples: int, frame: int) -> FloatArray:
    """Points of a line, about evenly along it; none in between, which were not seen and would share errors."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    if not lengths[-1] > 0.0:
        raise ValueError(f"points of frame {frame} must differ from each other")
    at = np.linspace(0.0, lengths[-1], samples)
    after = np.clip(np.searchsorted(lengths, at), 1, len(line) - 1)
    nearest = np.where(at - lengths[after - 1] < lengths[after] - at, after - 1, after)
    return np.asarray(line[np.unique(nearest)])
