"""Gauss-Newton: frame by frame, or all frames at once if they share unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from withe.errors import ConvergenceError

__all__ = [
    "Decomposed",
    "FrameSolution",
    "Problem",
    "Secants",
    "Spectrum",
    "Weakness",
    "all_frames",
    "lone_frame",
    "reduced",
    "seen",
    "spectra",
    "weaknesses",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_RANK = 1e-9  # relative to the greatest: smaller singular values belong to unobservable directions
_SMALL = 1e-5  # a step that would lessen the residual by less than this share of it is the last
_TRIALS = 8
_TRIALS_OF_INEXACT = 2  # trials with derivatives that are updated or of another frame, before new ones are computed
_WORTH = 0.01
_SMALL_OF_SECANTS = 1e-2  # share of the residual of each observed number below which a step with secants is the last
# Distances from lines of noisy points have kinks: a step is the last if it reduces the square of the residual by less
# than this share of what new derivatives predict.
_SMALL_AT_KINK, _USEFUL = 5e-2, 0.1


class Problem(Protocol):
    """Residuals of frames, in units of their standard deviation; NaN for missing data."""

    scales: FloatArray
    per_frame: BoolArray

    def residual(self, coordinates: FloatArray, frame: int) -> tuple[FloatArray, FloatArray] | None:
        """Return residual and state of a frame, or None if there is no solution."""

    def jacobian(self, coordinates: FloatArray, state: FloatArray, frame: int) -> FloatArray:
        """Return derivatives of the residual by the coordinates, at the state that was computed last."""


@dataclass(eq=False)
class FrameSolution:
    """Result of one frame. Derivatives are by coordinates divided by their scales."""

    coordinates: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    iterations: int
    converged: bool
    reason: str = ""
    linear: Decomposed | None = None  # the derivatives, where they were decomposed last


@dataclass(eq=False)
class Weakness:
    """A direction of scaled coordinates that the targets determine badly or not at all."""

    direction: FloatArray
    effect: float  # root mean square change of the residuals by one scale
    frames: list[int] = field(default_factory=list)


class Spectrum(NamedTuple):
    """Singular values of a matrix, as many as it has columns, and its right singular vectors as rows."""

    values: FloatArray
    vectors: FloatArray


class Secants:
    """Secant updates of a Jacobian that is expensive to compute [Broyden 1965, eq. 4.5].

    Coordinates are divided by their scales. A search never ends with an updated Jacobian.

    Attributes
    ----------
    updated : bool
        True if the last Jacobian was updated, not computed.
    """

    def __init__(self) -> None:
        self.updated: bool = False
        self._gain = np.inf  # gain of the last step
        self._last: tuple[FloatArray, FloatArray, FloatArray] | None = None  # coordinates, residual, derivatives

    def jacobian(
        self, problem: Problem, coordinates: FloatArray, residual: FloatArray, state: FloatArray, frame: int
    ) -> FloatArray:
        """Return the Jacobian: of the problem at first and after `renew`, else updated by Broyden's formula."""
        self.updated = self._last is not None
        if self._last is None:
            found = problem.jacobian(coordinates, state, frame)
        else:
            before, old, found = self._last
            way = (coordinates - before) / problem.scales
            missed = seen(residual) - old - found @ (coordinates - before)
            found = found + np.outer(missed, way / problem.scales) / (way @ way)
        self._last = (coordinates.copy(), seen(residual), found)
        return found

    def are_worth_renewing(self, gain: float, count: int) -> bool:
        """Return True if a new Jacobian costs less than the steps that the updated Jacobian still needs.

        At its present rate the updated Jacobian would need more steps to reduce the gain to a hundredth.
        """
        rate, self._gain = gain / self._gain, gain
        return self.updated and rate ** (count + 1) > _WORTH

    def renew(self) -> bool:
        """Discard an updated Jacobian, so that the problem computes the next one. Return True if there was one."""
        self._last = None if self.updated else self._last
        return self.updated


def seen(residual: FloatArray) -> FloatArray:
    """Replace gaps in a residual by zero."""
    return np.where(np.isnan(residual), 0.0, residual)


def _seen_rows(jacobian: FloatArray, residual: FloatArray) -> FloatArray:
    return np.where(np.isnan(residual)[:, None], 0.0, jacobian)


def _norm(numbers: FloatArray) -> float:
    return math.sqrt(numbers @ numbers)


def _size(residual: FloatArray) -> float:
    return _norm(seen(residual))


class Decomposed:
    """A matrix with its singular value decomposition, for least squares with several right-hand sides.

    Attributes
    ----------
    matrix : ndarray
    range, values, vectors : ndarray
        Left singular vectors as columns, which are an orthonormal basis of the range; the singular values that are not
        zero to rounding; right singular vectors as rows.
    """

    matrix: FloatArray
    range: FloatArray
    values: FloatArray
    vectors: FloatArray

    def __init__(self, matrix: FloatArray) -> None:
        self.matrix = matrix
        u, values, vectors = np.linalg.svd(matrix, full_matrices=False)
        rank = int(np.count_nonzero(values > _RANK * values[0])) if values.size else 0
        self.range, self.values, self.vectors = u[:, :rank], values[:rank], vectors[:rank]

    def bounded(self, right: FloatArray, radius: float) -> FloatArray:
        """Return the x of least |matrix x - right| whose coordinates are within a radius, by Levenberg's damping."""
        values, along = self.values, right @ self.range

        def step(damping: float) -> FloatArray:
            return np.asarray((values * along / (values**2 + damping)) @ self.vectors)

        whole = np.asarray((along / values) @ self.vectors)
        if np.abs(whole).max(initial=0.0) <= radius:
            return whole
        low, high = values[-1] ** 2 * 1e-6, values[0] ** 2 * max(1.0, np.linalg.norm(along / values) / radius)
        while high > 1.1 * low:
            middle = np.sqrt(low * high)
            low, high = (middle, high) if np.abs(step(middle)).max() > radius else (low, middle)
        return step(high)


def lone_frame(
    problem: Problem,
    frame: int,
    start: FloatArray,
    free: BoolArray,
    tolerance: float,
    max_iterations: int,
    secants: Secants | None = None,
    first: Decomposed | None = None,
) -> FrameSolution:
    """Fit one frame, with fixed values of the coordinates that are not free.

    A step changes each coordinate by at most its scale, and by a quarter of that after a step without progress. The
    first step may use scaled derivatives of a nearby frame, but no search ends with them.
    """
    which: BoolArray | slice = slice(None) if free.all() else free
    scales = problem.scales[which]
    found = problem.residual(start, frame)
    if found is None:
        empty = np.full(0, np.nan)
        return FrameSolution(start, empty, np.zeros((0, len(scales))), 0, False, "no equilibrium at the initial guess")
    coordinates, (residual, state) = start.copy(), found
    size = _size(residual)
    for iteration in range(1, max_iterations + 1):
        lagged = first is not None
        try:
            if first is not None:
                linear = Decomposed(_seen_rows(first.matrix, residual)) if np.isnan(residual).any() else first
                first = None
            else:
                if secants is None:
                    derivatives = problem.jacobian(coordinates, state, frame)
                else:
                    derivatives = secants.jacobian(problem, coordinates, residual, state, frame)
                linear = Decomposed(_seen_rows(derivatives[:, which] * scales, residual))
        except ConvergenceError as error:
            empty = np.zeros((len(residual), len(scales)))
            return FrameSolution(
                coordinates, residual, empty, iteration, False, f"no derivatives at these values: {error}"
            )
        jacobian, right = linear.matrix, -seen(residual)
        step = linear.bounded(right, 1.0)
        gain = _norm(jacobian @ step)
        small = _SMALL if secants is None else _SMALL_OF_SECANTS / np.sqrt(np.isfinite(residual).sum())
        if gain <= small * size or gain <= tolerance:
            if lagged or (secants is not None and secants.renew()):
                continue
            return FrameSolution(coordinates, residual, jacobian, iteration, True, linear=linear)
        if secants is not None and secants.are_worth_renewing(gain, len(scales)) and secants.renew():
            continue
        inexact = lagged or (secants is not None and secants.updated)
        at_kink = not inexact and gain <= _SMALL_AT_KINK * size / np.sqrt(np.isfinite(residual).sum())
        for _ in range(_TRIALS_OF_INEXACT if inexact or at_kink else _TRIALS):
            trial = coordinates.copy()
            trial[which] += scales * step
            found = problem.residual(trial, frame)
            if found is not None and (smaller := _size(found[0])) < size:
                at_kink = at_kink and size**2 - smaller**2 < _USEFUL * gain**2
                coordinates, (residual, state), size = trial, found, smaller
                break
            step = linear.bounded(right, 0.25 * float(np.abs(step).max()))
        else:
            if not lagged and (secants is None or not secants.renew()):
                reason = "" if at_kink else "no step reduces the residual"
                return FrameSolution(coordinates, residual, jacobian, iteration, at_kink, reason)
        if at_kink or (secants is None and not lagged and size <= tolerance):
            return FrameSolution(coordinates, residual, jacobian, iteration, True, linear=linear)
    return FrameSolution(coordinates, residual, jacobian, max_iterations, False, "max_iterations were reached")


def all_frames(
    problem: Problem,
    frames: list[int],
    start: dict[int, FloatArray],
    tolerance: float,
    max_iterations: int,
    progress: Callable[[], None] = lambda: None,
) -> dict[int, FrameSolution]:
    """Fit all frames at once, with shared coordinates and coordinates of each frame.

    The coordinates of each frame are eliminated frame by frame. With U the range of J_local, the shared coordinates
    minimise the squares of (I - U U^T) (J_shared x + r), stacked over frames.
    """
    local = problem.per_frame
    points = {frame: start[frame].copy() for frame in frames}
    solutions = _linearised(problem, points, progress)
    frames = list(solutions)  # frames that have an initial equilibrium
    if not frames:
        return {}
    for iteration in range(1, max_iterations + 1):
        size = _total(solutions)
        steps = _joint_step(solutions, local, 1.0)
        gain = np.sqrt(sum(float(np.sum((solutions[f].jacobian @ steps[f]) ** 2)) for f in frames))
        if gain <= _SMALL * size or gain <= tolerance:
            return _closed(solutions, iteration, True)
        for _ in range(_TRIALS):
            trial = {f: solutions[f].coordinates + problem.scales * steps[f] for f in frames}
            tried = _linearised(problem, trial, progress)
            if len(tried) == len(frames) and _total(tried) < size:
                break
            farthest = max(float(np.abs(step).max()) for step in steps.values())
            steps = _joint_step(solutions, local, 0.25 * farthest)
        else:
            return _closed(solutions, iteration, False, "no step reduces the residual")
        solutions = tried
    return _closed(solutions, max_iterations, False, "max_iterations were reached")


def _linearised(
    problem: Problem, points: dict[int, FloatArray], progress: Callable[[], None]
) -> dict[int, FrameSolution]:
    """Residuals and derivatives of all frames that have them."""
    found = {}
    for frame, point in points.items():
        evaluated = problem.residual(point, frame)
        if evaluated is None:
            continue
        residual, state = evaluated
        try:
            jacobian = _seen_rows(problem.jacobian(point, state, frame) * problem.scales, residual)
        except ConvergenceError:
            continue
        found[frame] = FrameSolution(point, residual, jacobian, 0, False)
        progress()
    return found


def _total(solutions: dict[int, FrameSolution]) -> float:
    return float(np.sqrt(sum(_size(solution.residual) ** 2 for solution in solutions.values())))


class _Frame:
    """Derivatives of a frame. Derivatives by its own coordinates are stored by their singular values.

    Of the least |J_shared x + J_own y + r|^2 + damping |y|^2 over y is left (J_shared x + r)^T W (J_shared x + r),
    W = I - U (S^2 / (S^2 + damping)) U^T with J_own = U S V^T.
    """

    def __init__(self, solution: FrameSolution, local: BoolArray) -> None:
        self._shared, self._residual = solution.jacobian[:, ~local], seen(solution.residual)
        self._own = Decomposed(solution.jacobian[:, local])

    def left(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """The square root of W times J_shared, and times r."""
        basis, values = self._own.range, self._own.values
        taken = 1.0 - np.sqrt(damping / (values**2 + damping))
        rows = self._shared - basis @ (taken[:, None] * (basis.T @ self._shared))
        return rows, self._residual - basis @ (taken * (basis.T @ self._residual))

    def own(self, shared: FloatArray, damping: float) -> FloatArray:
        """The least y."""
        values = self._own.values
        along = self._own.range.T @ (self._shared @ shared + self._residual)
        return np.asarray(-(values / (values**2 + damping) * along) @ self._own.vectors)


def reduced(solutions: dict[int, FrameSolution], local: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives by shared coordinates, and residuals, after elimination of the coordinates of each frame."""
    return _stacked([_Frame(solution, local) for solution in solutions.values()], 0.0)


def _stacked(frames: Iterable[_Frame], damping: float) -> tuple[FloatArray, FloatArray]:
    rows, right = zip(*(frame.left(damping) for frame in frames), strict=True)
    return np.concatenate(rows), np.concatenate(right)


def _joint_step(solutions: dict[int, FrameSolution], local: BoolArray, radius: float) -> dict[int, FloatArray]:
    """Return steps of all frames together, with enough Levenberg damping that no coordinate exceeds a radius."""
    greatest = max(float(np.sum(solution.jacobian**2)) for solution in solutions.values())
    frames = {number: _Frame(solution, local) for number, solution in solutions.items()}
    damping = 0.0
    while True:
        steps = _damped_step(frames, local, damping)
        if not max(float(np.abs(step).max()) for step in steps.values()) > radius:
            return steps
        damping = 3.0 * damping or 1e-9 * greatest


def _damped_step(frames: dict[int, _Frame], local: BoolArray, damping: float) -> dict[int, FloatArray]:
    """Minimise sum |J s + r|^2 + damping |s|^2 over the steps s: first shared ones, then those of each frame."""
    matrix, right = _stacked(frames.values(), damping)
    free = matrix.shape[1]
    if damping > 0.0:
        matrix = np.concatenate([matrix, np.sqrt(damping) * np.eye(free)])
        right = np.concatenate([right, np.zeros(free)])
    shared = Decomposed(matrix).bounded(-right, np.inf)
    steps = {}
    for number, frame in frames.items():
        step = np.empty(len(local))
        step[~local], step[local] = shared, frame.own(shared, damping)
        steps[number] = step
    return steps


def _closed(
    solutions: dict[int, FrameSolution], iterations: int, converged: bool, reason: str = ""
) -> dict[int, FrameSolution]:
    for solution in solutions.values():
        solution.iterations, solution.converged, solution.reason = iterations, converged, reason
    return solutions


def spectra(matrices: Sequence[FloatArray]) -> list[Spectrum]:
    """Spectra of matrices of one shape, all at once."""
    rows, count = matrices[0].shape
    _, values, vectors = np.linalg.svd(np.stack(matrices), full_matrices=rows < count)
    values = np.concatenate([values, np.zeros((len(values), count - values.shape[1]))], axis=1)
    return [Spectrum(*pair) for pair in zip(values, vectors, strict=True)]


def weaknesses(spectrum: Spectrum, rows: int, misfit: float) -> list[Weakness]:
    """Directions in which a change by one scale moves the targets by less than the misfit, or than rounding errors.

    If the misfit were systematic, the error of the fit in these directions could exceed the scale.

    Parameters
    ----------
    spectrum : Spectrum
        Spectrum of the derivatives by scaled coordinates.
    rows : int
        Number of observed residuals.
    misfit : float
        Root mean square of the residuals.
    """
    if rows == 0:
        return []
    effects = spectrum.values / np.sqrt(rows)
    least = max(misfit, _RANK * float(effects.max(initial=0.0)))
    weak = (effects < least) | (effects == 0.0)
    return [Weakness(spectrum.vectors[i], float(effects[i])) for i in np.flatnonzero(weak)]
