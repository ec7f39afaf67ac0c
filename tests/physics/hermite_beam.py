"""A beam with large bending and stretching in a plane, by C1 elements and explicit steps: slow, and unlike our rods.

Hermite cubics describe the centreline by its position and slope at either end of an element [Shabana: Dynamics of
multibody systems, chapter 7]. The energy is EA e^2 / 2 + B k^2 / 2, where k is the rotation of the tangent per
undeformed length. There is neither shear nor rotary inertia. Integrals use Gauss's rule, and time an eighth-order
Runge-Kutta method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import cho_factor, cho_solve


def fly(
    length: float,
    elements: int,
    stretch: float,
    bend: float,
    *,
    direction: tuple[float, float],
    gravity: tuple[float, float] = (0.0, 0.0),
    pinned: bool = False,
    load: Callable[[float], tuple[float, float, float]] = lambda t: (0.0, 0.0, 0.0),
    times: Sequence[float],
) -> np.ndarray:
    """Both ends of a beam of unit mass per length that starts straight and at rest from the origin, (times, 2, 2).

    The load is a force and a moment at its far end, by time; the moment turns x towards z.
    """
    step = length / elements
    points, weights = np.polynomial.legendre.leggauss(5)
    x, w = 0.5 * (points + 1.0), 0.5 * step * weights
    shape = np.array([1 - 3 * x**2 + 2 * x**3, step * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, step * (x**3 - x**2)])
    slope = (
        np.array([6 * x**2 - 6 * x, step * (1 - 4 * x + 3 * x**2), 6 * x - 6 * x**2, step * (3 * x**2 - 2 * x)]) / step
    )
    turn = np.array([12 * x - 6, step * (6 * x - 4), 6 - 12 * x, step * (6 * x - 2)]) / step**2
    rows = 2 * np.arange(elements)[:, None] + np.arange(4)
    count = 2 * (elements + 1)
    mass, weight = np.zeros((count, count)), np.zeros(count)
    for own in rows:
        mass[np.ix_(own, own)] += (shape * w) @ shape.T
        weight[own] += shape @ w
    free = np.arange(1 if pinned else 0, count)
    factor = cho_factor(mass[np.ix_(free, free)])

    def accelerations(q: np.ndarray, t: float) -> np.ndarray:
        d = np.einsum("ak,eac->ekc", slope, q[rows])
        dd = np.einsum("ak,eac->ekc", turn, q[rows])
        size = np.hypot(d[..., 0], d[..., 1])[..., None]
        bent = (d[..., 0] * dd[..., 1] - d[..., 1] * dd[..., 0])[..., None] / size**2
        # Derivatives of k = (r' x r'') / |r'|^2 by r' and r''.
        by_slope = np.stack([dd[..., 1], -dd[..., 0]], -1) / size**2 - 2.0 * bent / size**2 * d
        by_turn = np.stack([-d[..., 1], d[..., 0]], -1) / size**2
        first = stretch * (size - 1.0) * d / size + bend * bent * by_slope
        held = np.einsum("ak,k,ekc->eac", slope, w, first)
        held += np.einsum("ak,k,ekc->eac", turn, w, bend * bent * by_turn)
        total = np.outer(weight, gravity)
        np.add.at(total, rows, -held)
        *force, moment = load(t)
        total[-2] += force
        end = q[-1]
        total[-1] += moment * np.array([-end[1], end[0]]) / (end @ end)
        out = np.zeros_like(q)
        out[free] = cho_solve(factor, total[free])
        return out

    q = np.zeros((count, 2))
    q[::2] = np.outer(np.linspace(0.0, length, elements + 1), direction)
    q[1::2] = direction

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[2 * count :], accelerations(y[: 2 * count].reshape(count, 2), t).ravel()])

    start = np.concatenate([q.ravel(), np.zeros(2 * count)])
    found = solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, rtol=1e-8, atol=1e-9, method="DOP853").y
    return found[: 2 * count].T.reshape(-1, count, 2)[:, [0, -2]]
