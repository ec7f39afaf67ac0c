"""Kirchhoff's rod as a boundary value problem, by shooting from the wall: bent, twisted and stretched, not sheared.

With directors d1, d2, t and curvatures t' = k1 d1 + k2 d2 [Antman: Nonlinear problems of elasticity, chapter 8]
    r' = (1 + n.t / EA) t,    d' = w x d,    w = -k2 d1 + k1 d2 + tau t,    m' = -r' x n,
    m = -B2 (k2 - k2') d1 + B1 (k1 - k1') d2 + C (tau - tau') t,
where a prime on the right marks what is free of stress.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.optimize import root


@dataclass(frozen=True)
class Cantilever:
    """A rod clamped at the origin, with a force at its other end; units as those of what it is compared with."""

    length: float = 1.0
    bend: tuple[float, float] = (1.0, 1.0)
    twist: float = 1.0
    stretch: float = np.inf
    natural: tuple[float, float, float] = (0.0, 0.0, 0.0)  # k1, k2, tau
    frame: npt.ArrayLike = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))  # rows d1, d2, t at the wall

    def shape(self, force: npt.ArrayLike, moment: npt.ArrayLike) -> np.ndarray:
        """Position, directors and moment at the end, shape (15,), under a moment at the wall."""
        n = np.asarray(force, dtype=float)

        def rates(s: float, y: np.ndarray) -> np.ndarray:
            d1, d2, t = directors = y[3:12].reshape(3, 3)
            m1, m2, m3 = directors @ y[12:]
            k1 = m2 / self.bend[0] + self.natural[0]
            k2 = -m1 / self.bend[1] + self.natural[1]
            tau = m3 / self.twist + self.natural[2]
            along = (1.0 + n @ t / self.stretch) * t
            turned = np.cross(-k2 * d1 + k1 * d2 + tau * t, directors)
            return np.concatenate([along, turned.ravel(), -np.cross(along, n)])

        start = np.concatenate([np.zeros(3), np.asarray(self.frame, dtype=float).ravel(), moment])
        return solve_ivp(rates, (0.0, self.length), start, rtol=1e-11, atol=1e-11, method="DOP853").y[:, -1]

    def tip(self, force: npt.ArrayLike, steps: int = 4) -> np.ndarray:
        """Position of the free end; the branch that the force leads to in so many steps."""
        moment = np.zeros(3)
        scale = np.linalg.norm(force) * self.length
        for share in np.arange(1, steps + 1) / steps:
            load = share * np.asarray(force, dtype=float)
            found = root(lambda m, load=load: self.shape(load, m * scale)[12:] / scale, moment / scale, tol=1e-11)
            if not np.abs(found.fun).max() < 1e-6:
                raise ArithmeticError("no equilibrium found")
            moment = found.x * scale
        return self.shape(force, moment)[:3]


def follower_tip(load: float) -> tuple[float, float, float]:
    """Inward, sideways and angle at the end of a unit cantilever under P L^2 / B that stays normal to its end.

    Backwards from the end there is nothing to shoot for: theta'' = -P cos(theta - theta_end), theta' = 0 there.
    """

    def rates(s: float, y: np.ndarray) -> list[float]:
        theta, curvature = y[:2]
        return [curvature, load * np.cos(theta), np.cos(theta), np.sin(theta)]

    # From the end, where the tangent is x, back along it: s grows towards the wall, the way turns by pi.
    theta, _, x, z = solve_ivp(rates, (0.0, 1.0), [0.0, 0.0, 0.0, 0.0], rtol=1e-11, atol=1e-12, method="DOP853").y[
        :, -1
    ]
    # Seen from the wall, whose tangent is turned by theta.
    along = np.cos(theta) * x + np.sin(theta) * z
    across = np.sin(theta) * x - np.cos(theta) * z
    return 1.0 - along, across, theta
