"""Results of fits from the solutions of frames: values, covariances, unobservable combinations, outliers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from withe.real2sim.least_squares import FrameSolution, Spectrum, reduced, spectra, weaknesses
from withe.real2sim.outliers import find_outliers
from withe.real2sim.results import Fit, Outlier, Unobservable
from withe.real2sim.targets import Tags, Target
from withe.real2sim.unknowns import Coordinates

__all__ = ["gather", "persistence"]

FloatArray = npt.NDArray[np.float64]

_MISFIT = 3.0  # times sigma: residuals beyond it, root of the mean square, are too great for it ...
_BESIDE = 10.0  # times sigma and the residuals in the plane of a scene: greatest distance of targets from the plane
_CHANCE = 1e-6  # ... if normal errors are as great with a probability below this
_PERSISTENT = 5.0  # standard deviations of a correlation, beyond which residuals of successive frames are not noise
_OF_SCALE = 0.01  # possible error over the scale of an unknown, from which on a reason names its cause
_RESOLVED = 1e-6  # relative to the extent of all tags: resolution of fits, and least usual error


def gather(
    stills: Coordinates,
    targets: list[Target],
    solutions: dict[int, FrameSolution],
    solves: dict[int, int],
    rows: int,
    frames: int,
    step_error: FloatArray | None = None,
) -> Fit:
    """Return the result of a fit.

    Parameters
    ----------
    step_error : ndarray of shape (residuals,), optional
        For a motion: error of the residuals due to the time step.
    """
    count = len(stills.names)
    coordinates = np.full((frames, count), np.nan)
    residuals = np.full((frames, rows), np.nan)
    for frame, solution in solutions.items():
        coordinates[frame] = solution.coordinates
        residuals[frame, : len(solution.residual)] = solution.residual
    with_data = {f: s for f, s in solutions.items() if len(s.residual)}
    own, common = _spectra(stills, with_data)
    values, slopes = np.empty_like(coordinates), np.empty_like(coordinates)
    for unknown, place in zip(stills.unknowns, stills.slices, strict=True):
        values[:, place] = unknown.value(coordinates[:, place])
        slopes[:, place] = unknown.slope(coordinates[:, place])
    slopes *= stills.scales
    covariance = np.full((frames, count, count), np.nan)
    for frame, spread in _spreads(stills, with_data, own, common).items():
        covariance[frame] = spread
    told = {f: _told(targets, f, residuals, stills.simulation._session.world.plane_normal) for f in with_data}
    variance = _variance(stills, targets, list(told.values()))
    systematic = {f: _systematic(each) for f, each in told.items()}
    by_step: dict[int, FloatArray] = {}
    for frame in with_data:
        spread = covariance[frame].copy()
        covariance[frame] = (variance + systematic[frame]) * spread
        if step_error is not None:
            by_step[frame] = np.linalg.pinv(with_data[frame].jacobian) @ step_error
            covariance[frame] += np.outer(by_step[frame], by_step[frame])
        known = np.diag(spread)[np.isfinite(np.diag(spread))]
        systematic[frame] *= float(known.max(initial=0.0))
    covariance *= slopes[:, :, None] * slopes[:, None]
    reasons = {f: "nothing was seen" for f in range(frames) if f not in solutions}
    reasons |= (
        _of_discretisation(told, systematic, by_step)
        | _misfits(stills, targets, told)
        | _off_plane(targets, told)
        | {f: s.reason for f, s in solutions.items() if s.reason}
    )
    outliers, unchecked = _outliers(stills, targets, residuals, with_data)
    return Fit(
        names=stills.names,
        values=values,
        residuals=residuals,
        covariance=covariance,
        solves=np.array([solves.get(f, 0) for f in range(frames)]),
        iterations=np.array([solutions[f].iterations if f in solutions else 0 for f in range(frames)]),
        converged=np.array([f in solutions and solutions[f].converged for f in range(frames)]),
        reasons=reasons,
        unobservable=_unobservable(stills, residuals, told, own, common),
        outliers=outliers,
        unchecked=unchecked,
        _unknowns=tuple(stills.unknowns),
        _coordinates=coordinates,
    )


class _Told(NamedTuple):
    """Number of observations in one fit, and the sum of squares of their residuals.

    The same two numbers exist for the components across the plane of a planar scene, which no fit can reduce.
    """

    numbers: int
    squares: float
    numbers_across: int = 0
    squares_across: float = 0.0
    persistence: float = 0.0  # correlation of residuals of successive frames of a motion; 0 where chance explains it

    @property
    def beside(self) -> float:
        """Root of the mean square across the plane."""
        return float(np.sqrt(self.squares_across / max(self.numbers_across, 1)))


def _told(targets: list[Target], fitted: int, residuals: FloatArray, normal: FloatArray | None) -> _Told:
    """Count one row of residuals: a frame, or a whole motion. Components across the plane are counted apart."""
    from scipy.linalg import block_diag

    seen_in = range(targets[0].frames) if len(residuals) != targets[0].frames else [fitted]  # a motion is one frame
    numbers = sum(target.told(frame) for target in targets for frame in seen_in)
    rows = residuals[fitted].reshape(len(seen_in), -1)
    inside = np.nan_to_num(rows)
    if normal is None:
        return _Told(numbers, float(np.sum(inside**2)), persistence=persistence(rows))
    across = block_diag(*(target.across(normal) for target in targets))
    seen = np.isfinite(rows) @ across**2 > 1.0 - 1e-9
    beside = np.where(seen, inside @ across, 0.0)
    inside = inside - beside @ across.T
    lost = int(seen.sum())
    together = persistence(np.where(np.isfinite(rows), inside, np.nan))
    return _Told(numbers - lost, float(np.sum(inside**2)), lost, float(np.sum(beside**2)), together)


def persistence(rows: FloatArray) -> float:
    """Correlation of residuals of successive frames or points, shape (n, numbers) -> [-]; 0 if chance explains it."""
    first, second = rows[:-1].ravel(), rows[1:].ravel()
    both = np.isfinite(first) & np.isfinite(second) & ((first != 0.0) | (second != 0.0))
    first, second = first[both], second[both]
    squares = 0.5 * float(first @ first + second @ second)
    if squares == 0.0:
        return 0.0
    products = first * second
    found = float(products.sum()) / squares
    # The standard deviation of the sum of independent products is the root of the sum of their squares.
    return found if found * squares > _PERSISTENT * np.sqrt(float(products @ products)) else 0.0


def _systematic(told: _Told) -> float:
    """Return the ratio of the variance of the mean of correlated residuals to that of independent residuals.

    Kish's design effect, 1 + (n - 1) rho, with the mean square of the residuals [Kish: Survey sampling, 1965, 5.4].
    """
    return told.persistence * told.squares * (1.0 - 1.0 / max(told.numbers, 1))


def _of_discretisation(
    told: dict[int, _Told], systematic: dict[int, float], by_step: dict[int, FloatArray]
) -> dict[int, str]:
    """Motions of which the discretisation may move the unknowns by more than a hundredth of their scales."""
    found = {}
    for frame, each in told.items():
        by_time = float(np.abs(by_step[frame]).max(initial=0.0)) if frame in by_step else 0.0
        by_mesh = float(np.sqrt(systematic[frame]))
        if by_time > _OF_SCALE and by_time >= 0.5 * by_mesh:
            found[frame] = (
                "time step too long for this motion: half of the time step changes the result by up to "
                f"{100.0 * by_time:.2g} % of its scale, which the sigmas include. Use a shorter time_step"
            )
        elif by_mesh > _OF_SCALE:
            found[frame] = (
                "mesh too coarse for this motion, or the model differs from the targets: residuals of successive "
                f"frames are correlated ({each.persistence:.2f}) and may change the result by "
                f"{100.0 * by_mesh:.2g} % of its scale, which the sigmas include. Try more nodes"
            )
    return found


def _misfits(stills: Coordinates, targets: list[Target], told: dict[int, _Told]) -> dict[int, str]:
    """Frames whose residuals are too great for sigma: their sum of squares is beyond any likely chi-squared."""
    if any(target.sigma is None for target in targets):
        return {}
    from scipy.special import chdtrc

    found = {}
    for frame, each in told.items():
        free = each.numbers - int(stills.per_frame.sum())
        if free > 0 and each.squares > _MISFIT**2 * free and chdtrc(free, each.squares) < _CHANCE:
            found[frame] = (
                f"residuals are {np.sqrt(each.squares / free):.2g} times sigma, more than noise explains. Possible "
                "causes: a local minimum (try another initial guess or method), outliers, a wrong model (such as "
                "too coarse a mesh), or too small a sigma"
            )
    return found


def _off_plane(targets: list[Target], told: dict[int, _Told]) -> dict[int, str]:
    """Return frames whose targets are much farther from the plane of the scene than the residuals in the plane."""
    known = all(target.sigma is not None for target in targets)
    found = {}
    for frame, each in told.items():
        within = max(float(known), float(np.sqrt(each.squares / max(each.numbers, 1))))
        if each.beside > _BESIDE * within:
            found[frame] = (
                f"targets lie outside of the plane of the scene by {each.beside:.2g} "
                f"{'times sigma' if known else 'm'}, which no planar fit can follow: give the targets in the axes "
                "of the scene, or use build(planar=False)"
            )
    return found


def _variance(stills: Coordinates, targets: list[Target], told: list[_Told]) -> float:
    """Variance of a residual: 1 with sigma, else the sum of squares of all frames per degree of freedom."""
    if all(target.sigma is not None for target in targets):
        return 1.0
    numbers = sum(each.numbers for each in told)
    free = numbers - int(stills.per_frame.sum()) * len(told) - int((~stills.per_frame).sum())
    return sum(each.squares for each in told) / free if free > 0 else np.nan


def _inverse(spectrum: Spectrum) -> FloatArray:
    """(A^T A)^-1, infinite for unknowns that A does not reach."""
    values, vectors = spectrum
    good = values > 1e-9 * values.max(initial=1e-300)
    inverse = (vectors[good].T / values[good] ** 2) @ vectors[good]
    if not good.all():
        lost = (vectors[~good] ** 2).sum(axis=0) > 1e-6
        inverse[lost], inverse[:, lost] = np.nan, np.nan
        inverse[lost, lost] = np.inf
    return np.asarray(inverse)


def _spectra(stills: Coordinates, solutions: dict[int, FrameSolution]) -> tuple[dict[int, Spectrum], Spectrum | None]:
    """Spectra of the derivatives by every frame's own coordinates, and by the shared coordinates, if there are any."""
    local = stills.per_frame
    if not solutions:
        return {}, None
    own = [s.jacobian[:, local] if s.jacobian.shape[1] == len(local) else s.jacobian for s in solutions.values()]
    common = None if local.all() else spectra([reduced(solutions, local)[0]])[0]
    return dict(zip(solutions, spectra(own), strict=True)), common


def _spreads(
    stills: Coordinates, solutions: dict[int, FrameSolution], spectra_own: dict[int, Spectrum], common: Spectrum | None
) -> dict[int, FloatArray]:
    """Covariance of every frame's coordinates over their scales, for residuals of variance 1."""
    own = {frame: _inverse(spectrum) for frame, spectrum in spectra_own.items()}
    if common is None:
        return own
    local, shared = stills.per_frame, _inverse(common)
    spreads = {}
    for frame, solution in solutions.items():
        carried = -np.linalg.pinv(solution.jacobian[:, local]) @ solution.jacobian[:, ~local]  # own ones follow shared
        spread = np.empty((len(local), len(local)))
        spread[np.ix_(~local, ~local)] = shared
        spread[np.ix_(local, ~local)] = carried @ shared
        spread[np.ix_(~local, local)] = (carried @ shared).T
        spread[np.ix_(local, local)] = own[frame] + carried @ shared @ carried.T
        spreads[frame] = spread
    return spreads


def _unobservable(
    stills: Coordinates,
    residuals: FloatArray,
    told: dict[int, _Told],
    own: dict[int, Spectrum],
    common: Spectrum | None,
) -> tuple[Unobservable, ...]:
    """Combinations of shared unknowns, and of the frames' own, that move targets by less than the misfit."""
    counts = np.isfinite(residuals).sum(axis=1)
    for frame, each in told.items():
        counts[frame] -= each.numbers_across
    rows = int(counts.sum())
    if rows == 0:
        return ()
    within = np.nansum(residuals**2) - sum(each.squares_across for each in told.values())
    misfit = float(np.sqrt(max(within, 0.0) / rows))
    local = stills.per_frame
    found = []
    if common is not None:
        names = [name for name, mine in zip(stills.names, local, strict=True) if not mine]
        for weakness in weaknesses(common, rows, misfit):
            found.append(Unobservable(_weights(names, weakness.direction), weakness.effect, misfit))
    names = [name for name, mine in zip(stills.names, local, strict=True) if mine]
    lone: dict[tuple[str, ...], tuple[Unobservable, list[int]]] = {}
    for frame, spectrum in own.items():
        for weakness in weaknesses(spectrum, int(counts[frame]), misfit):
            weights = _weights(names, weakness.direction)
            lone.setdefault(tuple(weights), (Unobservable(weights, weakness.effect, misfit), []))[1].append(frame)
    found += [
        Unobservable(first.weights, first.effect, misfit, tuple(where) if len(where) < len(own) else ())
        for first, where in lone.values()
    ]
    return tuple(found)


def _weights(names: list[str], direction: FloatArray) -> dict[str, float]:
    return {name: float(weight) for name, weight in zip(names, direction, strict=True) if abs(weight) > 0.1}


def _outliers(
    stills: Coordinates, targets: list[Target], residuals: FloatArray, solutions: dict[int, FrameSolution]
) -> tuple[tuple[Outlier, ...], tuple[tuple[int, int], ...]]:
    """Return tags that jump, and tags whose jumps cannot be detected, if all targets are tags."""
    if len(targets) != 1 or not isinstance(targets[0], Tags):
        return (), ()
    if len(residuals) != targets[0].frames:  # a motion, all of it one fit
        return (), ()
    target, points = targets[0], np.asarray(targets[0].points)
    places = (target.sigma or 1.0) * residuals.reshape(*points.shape)
    seen = np.isfinite(places).all(axis=2)
    if not seen.any():
        return (), ()
    least = target.sigma or _RESOLVED * float(np.ptp(points[seen], axis=0).max())
    found, checked = find_outliers(places, solutions, stills.per_frame, least)
    return found, tuple((int(frame), int(tag)) for frame, tag in np.argwhere(seen & ~checked))
