"""Limit loads of plane frames and arches: the elastica from hinge to hinge, by shooting, without a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.optimize import root


@dataclass(frozen=True)
class LoadedCurve:
    """A chain of rods in a plane, loaded at one place; limit loads by shooting.

    The equations are x' = (1 + n.t / EA) cos theta, z' = (1 + n.t / EA) sin theta, theta' = M + k0 and M' = z' n_x - x'
    n_z. The force n on the part before s is constant, except for the load -P at `loaded`.
    """

    pieces: tuple[tuple[float, float], ...]  # length and turn before it [rad], in order
    loaded: int  # the load sits before this piece
    start: float  # direction there when unloaded [rad]
    natural: float  # curvature
    stretch: float
    clamped: bool  # or hinged, at the start; always hinged at the end

    def end(self, unknowns: np.ndarray) -> tuple[np.ndarray, float]:
        """x, z, M at the far end and the height of the load, of (n_x, n_z, M or theta at the start, P)."""
        nx, nz, free, load = unknowns
        turned, moment = (0.0, free) if self.clamped else (free, 0.0)
        y = np.array([0.0, 0.0, self.start + turned, moment])
        height = np.nan
        for i, (length, turn) in enumerate(self.pieces):
            if i == self.loaded:
                height, nz = y[1], nz + load
            y[2] += turn

            def rates(s: float, y: np.ndarray, nz: float = nz) -> list[float]:
                c, n = np.cos(y[2]), np.sin(y[2])
                longer = 1.0 + (nx * c + nz * n) / self.stretch
                return [longer * c, longer * n, y[3] + self.natural, longer * (n * nx - c * nz)]

            y = solve_ivp(rates, (0.0, length), y, rtol=1e-10, atol=1e-11, method="DOP853").y[:, -1]
        return y[[0, 1, 3]], float(height)

    def limit_load(self, drops: np.ndarray) -> float:
        """Greatest P on the path of falling heights that starts unloaded, between the last five drops about it."""
        unloaded = np.zeros(4)
        goal, top = self.end(unloaded)
        found = [unloaded]
        for drop in drops:

            def missed(unknowns: np.ndarray, drop: float = drop) -> np.ndarray:
                there, height = self.end(unknowns)
                return np.append(there - goal * (1.0, 1.0, 0.0), height - top + drop)

            guess = 2.0 * found[-1] - found[-2] if len(found) > 1 else found[-1]
            solution = root(missed, guess, tol=1e-11)
            if np.abs(solution.fun).max() > 1e-8:
                raise ArithmeticError(f"no equilibrium found at a drop of {drop}")
            found.append(solution.x)
        return peak(drops, [unknowns[3] for unknowns in found[1:]])


def peak(where: npt.ArrayLike, values: npt.ArrayLike) -> float:
    """Greatest value, by the parabola of fourth degree through the five about the greatest."""
    values = np.asarray(values, dtype=float)
    top = int(np.argmax(values))
    if not 2 <= top < len(values) - 2:
        raise ArithmeticError("the greatest value is at an end")
    near = slice(top - 2, top + 3)
    offset = (np.asarray(where)[near] - np.asarray(where)[top]) / np.ptp(np.asarray(where)[near])
    fit = np.polynomial.Polynomial.fit(offset, values[near], 4)
    return float(fit(np.linspace(-0.5, 0.5, 20001)).max())


# Column of length 1, a right angle, a fifth of the beam, the load, the rest; EA L^2 / EI as in 120 long, 2 x 3.
LEE = LoadedCurve(((1.0, 0.0), (0.2, -0.5 * np.pi), (0.8, 0.0)), 2, 0.5 * np.pi, 0.0, 3.0 * 120.0**2, False)
# 215 degrees of a circle, clamped at its left, hinged at its right, loaded at its crown.
ARCH = LoadedCurve(((np.radians(107.5), 0.0), (np.radians(107.5), 0.0)), 1, np.radians(107.5), -1.0, 1e6, True)
