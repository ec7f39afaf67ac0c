"""Answers that need no rod code: closed forms, and the equations of the elastica solved to rounding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.special import jv


@dataclass(frozen=True)
class Elastica:
    """Tip of a cantilever of unit length, clamped level."""

    down: float
    inward: float
    tip_angle: float  # [rad]


def elastica(moment_rate: Callable[[float, float], float], highest: float = 40.0) -> Elastica:
    """Shoot theta'' = moment_rate(s, theta), theta(0) = theta'(1) = 0, for the branch with the smallest theta'(0)."""

    def end(slope: float) -> np.ndarray:
        def rates(s: float, y: np.ndarray) -> list[float]:
            return [y[1], moment_rate(s, y[0]), np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(rates, (0.0, 1.0), [0.0, slope, 0.0, 0.0], rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]

    low = 0.0
    high = 1e-6
    while end(high)[1] < 0.0:
        low, high = high, 1.5 * high
        if high > highest:
            raise ArithmeticError("no elastica found")
    slope = brentq(lambda s: end(s)[1], low, high, xtol=1e-14, rtol=1e-14)
    theta, _, x, z = end(slope)
    return Elastica(down=z, inward=1.0 - x, tip_angle=theta)


def tip_loaded(load: float) -> Elastica:
    """Cantilever with a = P L^2 / B at its tip [Bisshopp and Drucker 1945]."""
    return elastica(lambda s, theta: -load * np.cos(theta))


def self_weight(weight: float) -> Elastica:
    """Cantilever under its own weight, G = w L^3 / B."""
    return elastica(lambda s, theta: -weight * (1.0 - s) * np.cos(theta), highest=400.0)


@dataclass(frozen=True)
class FoldLoop:
    """Lengths in units of Lgb = (B / 2w)^(1/3), forces in w Lgb."""

    length: float
    end: float  # how far behind lift-off it comes down
    height: float
    greatest_curvature: float
    lift: float  # force at lift-off, upwards
    pull: float  # force at lift-off, along the strip
    angle: Callable[[np.ndarray], np.ndarray]  # of the tangent, over arc length

    def tangents(self, edges: int) -> np.ndarray:
        """Directions at the middle of every edge, shape (edges, 3)."""
        theta = self.angle((np.arange(edges) + 0.5) / edges * self.length)
        return np.stack([np.cos(theta), np.zeros(edges), np.sin(theta)], axis=1)


def fold_loop() -> FoldLoop:
    """theta'' = [(R - s) cos theta + H sin theta] / 2, theta from 0 to pi, level and free of moment at both ends."""

    def strip(lift: float, pull: float, length: float) -> Any:
        def rates(s: float, y: np.ndarray) -> list[float]:
            theta, curvature = y[:2]
            moment_rate = (lift - s) * np.cos(theta) + pull * np.sin(theta)
            return [curvature, 0.5 * moment_rate, np.cos(theta), np.sin(theta)]

        return solve_ivp(rates, (0.0, length), np.zeros(4), rtol=1e-12, atol=1e-13, method="DOP853", dense_output=True)

    def missed(unknowns: np.ndarray) -> np.ndarray:
        theta, curvature, _, z = strip(*unknowns).y[:, -1]
        return np.array([theta - np.pi, curvature, z])

    lift, pull, length = root(missed, (4.5, 0.3, 6.0), tol=1e-12).x
    shape = strip(lift, pull, length).sol
    _, curvature, x, z = shape(np.linspace(0.0, length, 20001))
    return FoldLoop(length, x[-1], z.max(), curvature.max(), lift, pull, lambda s: shape(s)[0])


# Smallest P L^2 / B of a column [Euler]; clamped-pinned solves tan x = x.
EULER_LOADS = {
    "pinned": np.pi**2,
    "free": np.pi**2 / 4.0,
    "clamped": 4.0 * np.pi**2,
    "clamped-pinned": brentq(lambda x: np.sin(x) - x * np.cos(x), 4.4, 4.6, xtol=1e-15) ** 2,
}

# w L^3 / B at which a column buckles under its own weight [Greenhill 1881].
GREENHILL = 2.25 * brentq(lambda x: jv(-1.0 / 3.0, x), 1.5, 2.2, xtol=1e-15) ** 2


# P L^2 / sqrt(B C) of a narrow cantilever with a load at its end [Prandtl 1899, Michell 1899]: J_(-1/4)(P / 2) = 0.
TIPPING_LOAD = 2.0 * brentq(lambda x: jv(-0.25, x), 1.5, 2.5, xtol=1e-14)


def critical_twisting_moment(tension: float) -> float:
    """Smallest M L / B at which a straight rod with clamped ends and tension T L^2 / B buckles.

    B u'''' - i M u''' - T u'' = 0 for the complex deflection u = y + i z, u = u' = 0 at both ends.
    """

    def determinant(moment: float) -> float:
        root = np.sqrt(complex(moment**2 - 4.0 * tension))
        k = 0.5 * (moment + np.array([root, -root]))
        if tension == 0.0:
            x = 0.5 * moment
            return float(x * np.cos(x) - np.sin(x))
        # Columns 1, x, exp(i k1 x), exp(i k2 x); multiplied by a phase the determinant is real.
        e = np.exp(1j * k)
        matrix = np.array([[1, 0, 1, 1], [0, 1, 1j * k[0], 1j * k[1]], [1, 1, *e], [0, 1, *(1j * k * e)]])
        return float((np.linalg.det(matrix) * np.exp(-0.5j * moment) / (k[0] - k[1]) * 1j).real)

    start = 2.0 * np.sqrt(tension) * (1.0 + 1e-9) if tension else 6.5
    grid = np.linspace(start, start + 9.5 if tension == 0.0 else 1.6 * start + 10.0, 4000)
    values = np.array([determinant(m) for m in grid])
    first = int(np.flatnonzero(values[:-1] * values[1:] < 0.0)[0])
    return brentq(determinant, grid[first], grid[first + 1], xtol=1e-13)


# b_n of a clamped-free beam, cos b cosh b = -1; omega_n = (b_n / L)^2 sqrt(B / (rho A)).
CANTILEVER_ROOTS = tuple(
    brentq(lambda b: np.cos(b) + 1.0 / np.cosh(b), low, high, xtol=1e-14)
    for low, high in ((1.5, 2.2), (4.4, 5.0), (7.5, 8.2))
)


def cantilever_mode(s: np.ndarray, n: int = 0) -> np.ndarray:
    """Shape of mode n of a clamped-free beam of unit length, 1 at its tip."""
    b = CANTILEVER_ROOTS[n]
    ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))

    def shape(x: np.ndarray) -> np.ndarray:
        return np.cosh(b * x) - np.cos(b * x) - ratio * (np.sinh(b * x) - np.sin(b * x))

    return shape(s) / shape(np.array(1.0))


def follower_column(load: float, frequency: complex, mass: float = 0.0) -> complex:
    """Function with zeros at the frequencies w of a cantilever under a force that follows its end, with a mass there.

    The arguments are P L^2 / B, w L^2 sqrt(m / B) and M / (m L). The equation is y'''' + P y'' = w^2 y, with
    y = y' = 0 at the wall. At the tip y'' = 0 and y''' = -M w^2 y, because the force has no part across the column
    [Beck 1952; Pflueger 1955]. The solution is y = A (cosh a s - cos b s) + C (sinh a s / a - sin b s / b) with a^2,
    b^2 = (P^2 / 4 + w^2)^(1/2) -+ P / 2. The function is the determinant of the two conditions at the tip.
    """
    half = 0.5 * load
    size = np.sqrt(half**2 + frequency**2 + 0j)
    a, b = np.sqrt(size - half), np.sqrt(size + half)
    sinh, cosh, sin, cos = np.sinh(a), np.cosh(a), np.sin(b), np.cos(b)
    inertia = mass * frequency**2
    bent = a**2 * cosh + b**2 * cos
    sheared = a**3 * sinh - b**3 * sin + inertia * (cosh - cos)
    return complex(bent * (bent + inertia * (sinh / a - sin / b)) - (a * sinh + b * sin) * sheared)


def flutter_load(mass: float = 0.0) -> float:
    """P L^2 / B at which the lowest two frequencies of `follower_column` meet."""

    def both_left(load: float) -> bool:
        values = [follower_column(load, w, mass).real for w in np.linspace(0.05, 20.0, 4001)]
        return bool(np.count_nonzero(np.diff(np.sign(values))) >= 2)

    low, high = 10.0, 25.0
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if both_left(middle) else (low, middle)
    return 0.5 * (low + high)


def flutter(load: float) -> tuple[float, float]:
    """Frequency and growth, w and its imaginary part, of the lowest pair beyond Beck's load."""

    def parts(y: np.ndarray) -> list[float]:
        value = follower_column(load, y[0] + 1j * y[1])
        return [value.real, value.imag]

    frequency, growth = root(parts, [11.0, 5.0], tol=1e-13).x
    return float(frequency), float(growth)
