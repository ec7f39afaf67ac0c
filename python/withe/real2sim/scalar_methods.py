"""Other methods to fit a frame: L-BFGS, and the published gradient descent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import numpy.typing as npt

from withe.real2sim.least_squares import FrameSolution, Problem, seen
from withe.real2sim.stills import Stills

__all__ = ["Slope", "descend", "minimise", "minimise_by"]

FloatArray = npt.NDArray[np.float64]
Slope = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Derivatives of half the sum of squared residuals by coordinates, from coordinates, state, and residuals without
gaps."""

_FIRST_STEP = 0.1  # first step of Algorithm 6
_INCREMENT = 1e-3  # its epsilon, which is not published [rad]; values from 1e-6 to 1e-2 work


class Counted(Problem, Protocol):
    """A problem that counts its solved equilibria or runs."""

    solves: int


def minimise(stills: Stills, frame: int, start: FloatArray, tolerance: float, max_iterations: int) -> FrameSolution:
    """Minimise half the sum of squared residuals by SciPy's L-BFGS-B."""

    def slope(coordinates: FloatArray, state: FloatArray, residual: FloatArray) -> FloatArray:
        return residual @ np.nan_to_num(stills.jacobian(coordinates, state, frame))

    return minimise_by(stills, frame, start, slope, tolerance**2, max_iterations)


def minimise_by(
    problem: Counted, frame: int, start: FloatArray, slope: Slope, change: float, max_iterations: int
) -> FrameSolution:
    """Minimise a problem; end when an iteration changes the sum relatively by at most `change`."""
    from scipy.optimize import minimize

    def loss(unit: FloatArray) -> tuple[float, FloatArray]:
        coordinates = unit * problem.scales
        found = problem.residual(coordinates, frame)
        if found is None:
            return 1e30, np.zeros_like(unit)
        residual = seen(found[0])
        return 0.5 * float(residual @ residual), slope(coordinates, found[1], residual) * problem.scales

    options = {"maxiter": max_iterations, "ftol": change, "gtol": 1e-12, "maxcor": 20}
    result = minimize(loss, start / problem.scales, jac=True, method="L-BFGS-B", options=options)
    end, reason = result.x * problem.scales, str(result.message)
    return _closed(problem, frame, end, int(result.nit), bool(result.success), reason)


def descend(stills: Stills, frame: int, start: FloatArray, tolerance: float, max_iterations: int) -> FrameSolution:
    """Minimise the sum of absolute residuals by gradient descent with forward differences [Algorithm 6].

    The unknowns are the total rotations of limbs, natural curvature times length [rad]. The step begins at 0.1 in every
    frame, and is halved whenever the loss grows.
    """
    turns = start / stills.scales
    step, previous = _FIRST_STEP, np.inf

    def loss(turns: FloatArray) -> float:
        found = stills.residual(turns * stills.scales, frame)
        return np.inf if found is None else float(np.abs(seen(found[0])).sum())

    for iteration in range(max_iterations + 1):
        now = loss(turns)
        if now < tolerance:
            return _closed(stills, frame, turns * stills.scales, iteration, True, "")
        if not np.isfinite(now):
            break
        if now > previous:
            step *= 0.5
        previous = now
        increments = _INCREMENT * np.eye(len(turns))
        gradient = np.array([loss(turns + increment) - now for increment in increments]) / _INCREMENT
        turns = turns - step * gradient
    return _closed(stills, frame, turns * stills.scales, max_iterations, False, "the loss stayed above the tolerance")


def _closed(
    problem: Counted, frame: int, coordinates: FloatArray, iterations: int, converged: bool, reason: str
) -> FrameSolution:
    """Result of a search. Solutions that only the covariance needs are not counted."""
    solves = problem.solves
    found = problem.residual(coordinates, frame)
    if found is None:
        empty = np.zeros((0, len(coordinates)))
        return FrameSolution(coordinates, np.zeros(0), empty, iterations, False, "no equilibrium there")
    residual, state = found
    jacobian = problem.jacobian(coordinates, state, frame) * problem.scales
    jacobian[np.isnan(residual)] = 0.0
    problem.solves = solves
    return FrameSolution(coordinates, residual, jacobian, iterations, converged, "" if converged else reason)
