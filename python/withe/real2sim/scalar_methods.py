"""Other ways to fit a frame: L-BFGS, and the gradient descent that was published."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.real2sim.least_squares import FrameSolution, seen
from withe.real2sim.stills import Stills

__all__ = ["descend", "minimise"]

FloatArray = npt.NDArray[np.float64]

_FIRST_STEP = 0.1  # of Algorithm 6
_INCREMENT = 1e-3  # its epsilon, which is not printed [rad]; 1e-6 to 1e-2 all do


def minimise(stills: Stills, frame: int, start: FloatArray, tolerance: float, max_iterations: int) -> FrameSolution:
    """Half the sum of squared residuals by SciPy's L-BFGS-B."""
    from scipy.optimize import minimize

    def loss(unit: FloatArray) -> tuple[float, FloatArray]:
        coordinates = unit * stills.scales
        found = stills.residual(coordinates, frame)
        if found is None:
            return 1e30, np.zeros_like(unit)
        residual = seen(found[0])
        gradient = residual @ np.nan_to_num(stills.jacobian(coordinates, found[1], frame)) * stills.scales
        return 0.5 * float(residual @ residual), gradient

    options = {"maxiter": max_iterations, "ftol": tolerance**2, "gtol": 1e-12, "maxcor": 20}
    result = minimize(loss, start / stills.scales, jac=True, method="L-BFGS-B", options=options)
    return _closed(stills, frame, result.x * stills.scales, int(result.nit), bool(result.success), str(result.message))


def descend(stills: Stills, frame: int, start: FloatArray, tolerance: float, max_iterations: int) -> FrameSolution:
    """Gradient descent on the sum of absolute residuals, by forward differences [Algorithm 6].

    The unknowns are whole turns, natural curvature times a limb's length [rad]. The step begins at .1 in every frame,
    and is halved whenever the loss grew.
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
    stills: Stills, frame: int, coordinates: FloatArray, iterations: int, converged: bool, reason: str
) -> FrameSolution:
    """The end of a search. Equilibria for the covariance alone do not count."""
    solves = stills.solves
    found = stills.residual(coordinates, frame)
    if found is None:
        empty = np.zeros((0, len(coordinates)))
        return FrameSolution(coordinates, np.zeros(0), empty, iterations, False, "no equilibrium there")
    residual, positions = found
    jacobian = stills.jacobian(coordinates, positions, frame) * stills.scales
    jacobian[np.isnan(residual)] = 0.0
    stills.solves = solves
    return FrameSolution(coordinates, residual, jacobian, iterations, converged, "" if converged else reason)
