"""From the solutions of frames to what a user gets: values, covariances, what was not told, what jumped."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.real2sim.least_squares import FrameSolution, reduced, seen, weaknesses
from withe.real2sim.outliers import find_outliers
from withe.real2sim.results import Fit, Outlier, Unobservable
from withe.real2sim.targets import Tags, Target
from withe.real2sim.unknowns import Coordinates

__all__ = ["gather"]

FloatArray = npt.NDArray[np.float64]


def gather(
    stills: Coordinates,
    targets: list[Target],
    solutions: dict[int, FrameSolution],
    solves: dict[int, int],
    rows: int,
    frames: int,
) -> Fit:
    """The result of a fit."""
    count = len(stills.names)
    coordinates = np.full((frames, count), np.nan)
    residuals = np.full((frames, rows), np.nan)
    for frame, solution in solutions.items():
        coordinates[frame] = solution.coordinates
        residuals[frame, : len(solution.residual)] = solution.residual
    with_data = {f: s for f, s in solutions.items() if len(s.residual)}
    seen_in = (
        list(with_data) if frames == targets[0].frames else list(range(targets[0].frames))
    )  # a motion is one frame
    variance = _variance(stills, targets, with_data, seen_in)
    values, covariance = np.full_like(coordinates, np.nan), np.full((frames, count, count), np.nan)
    spread = _spreads(stills, with_data)
    for frame, solution in solutions.items():
        slopes = np.empty(count)
        for unknown, place in zip(stills.unknowns, stills.slices, strict=True):
            values[frame, place] = unknown.value(solution.coordinates[place])
            slopes[place] = unknown.slope(solution.coordinates[place])
        if frame in spread:
            scales = slopes * stills.scales
            covariance[frame] = variance * spread[frame] * np.outer(scales, scales)
    reasons = {f: "nothing was seen" for f in range(frames) if f not in solutions}
    reasons |= {f: s.reason for f, s in solutions.items() if s.reason}
    return Fit(
        names=stills.names,
        values=values,
        residuals=residuals,
        covariance=covariance,
        solves=np.array([solves.get(f, 0) for f in range(frames)]),
        iterations=np.array([solutions[f].iterations if f in solutions else 0 for f in range(frames)]),
        converged=np.array([f in solutions and solutions[f].converged for f in range(frames)]),
        reasons=reasons,
        unobservable=_unobservable(stills, with_data),
        outliers=_outliers(stills, targets, residuals, with_data),
        _unknowns=tuple(stills.unknowns),
        _coordinates=coordinates,
    )


def _rows(solutions: dict[int, FrameSolution]) -> int:
    return sum(int(np.isfinite(solution.residual).sum()) for solution in solutions.values())


def _square(solutions: dict[int, FrameSolution]) -> float:
    return sum(float(np.sum(seen(solution.residual) ** 2)) for solution in solutions.values())


def _variance(
    stills: Coordinates, targets: list[Target], solutions: dict[int, FrameSolution], seen_in: list[int]
) -> float:
    """Of a residual: 1 where sigma was given, else what all frames leave over the degrees of freedom."""
    if all(target.sigma is not None for target in targets):
        return 1.0
    told = sum(target.told(frame) for target in targets for frame in seen_in)
    free = told - int(stills.per_frame.sum()) * len(solutions) - int((~stills.per_frame).sum())
    return _square(solutions) / free if free > 0 else np.nan


def _inverse(matrix: FloatArray) -> FloatArray:
    """(A^T A)^-1, infinite for unknowns that A does not reach."""
    _, values, vectors = np.linalg.svd(matrix, full_matrices=True)
    values = np.concatenate([values, np.zeros(matrix.shape[1] - len(values))])
    good = values > 1e-9 * values.max(initial=1e-300)
    inverse = (vectors[good].T / values[good] ** 2) @ vectors[good]
    lost = (vectors[~good] ** 2).sum(axis=0) > 1e-6
    inverse[lost], inverse[:, lost] = np.nan, np.nan
    inverse[lost, lost] = np.inf
    return np.asarray(inverse)


def _spreads(stills: Coordinates, solutions: dict[int, FrameSolution]) -> dict[int, FloatArray]:
    """Covariance of every frame's coordinates over their scales, for residuals of variance 1."""
    local = stills.per_frame
    if local.all():
        return {frame: _inverse(solution.jacobian) for frame, solution in solutions.items()}
    common = _inverse(reduced(solutions, local)[0])
    spreads = {}
    for frame, solution in solutions.items():
        own = solution.jacobian[:, local]
        carried = -np.linalg.pinv(own) @ solution.jacobian[:, ~local]  # how a frame's own follow what is shared
        spread = np.empty((len(local), len(local)))
        spread[np.ix_(~local, ~local)] = common
        spread[np.ix_(local, ~local)] = carried @ common
        spread[np.ix_(~local, local)] = (carried @ common).T
        spread[np.ix_(local, local)] = _inverse(own) + carried @ common @ carried.T
        spreads[frame] = spread
    return spreads


def _unobservable(stills: Coordinates, solutions: dict[int, FrameSolution]) -> tuple[Unobservable, ...]:
    """Combinations of shared unknowns, and of the frames' own, that move targets by less than the misfit."""
    rows = _rows(solutions)
    if rows == 0:
        return ()
    misfit = float(np.sqrt(_square(solutions) / rows))
    local = stills.per_frame
    found = []
    if not local.all():
        names = [name for name, own in zip(stills.names, local, strict=True) if not own]
        for weakness in weaknesses(reduced(solutions, local)[0], rows, misfit):
            found.append(Unobservable(_weights(names, weakness.direction), weakness.effect, misfit))
    names = [name for name, own in zip(stills.names, local, strict=True) if own]
    lone: dict[tuple[str, ...], tuple[Unobservable, list[int]]] = {}
    for frame, solution in solutions.items():
        own = solution.jacobian[:, local] if solution.jacobian.shape[1] == len(local) else solution.jacobian
        for weakness in weaknesses(own, int(np.isfinite(solution.residual).sum()), misfit):
            weights = _weights(names, weakness.direction)
            lone.setdefault(tuple(weights), (Unobservable(weights, weakness.effect, misfit), []))[1].append(frame)
    found += [
        Unobservable(first.weights, first.effect, misfit, tuple(where) if len(where) < len(solutions) else ())
        for first, where in lone.values()
    ]
    return tuple(found)


def _weights(names: list[str], direction: FloatArray) -> dict[str, float]:
    return {name: float(weight) for name, weight in zip(names, direction, strict=True) if abs(weight) > 0.1}


def _outliers(
    stills: Coordinates, targets: list[Target], residuals: FloatArray, solutions: dict[int, FrameSolution]
) -> tuple[Outlier, ...]:
    """Tags that jump, where tags are all there is."""
    if len(targets) != 1 or not isinstance(targets[0], Tags):
        return ()
    if len(residuals) != targets[0].frames:  # a motion, all of it one fit
        return ()
    scale = targets[0].sigma or 1.0
    places = scale * residuals.reshape(len(residuals), len(targets[0].places), -1)
    return find_outliers(places, solutions, stills.per_frame)
