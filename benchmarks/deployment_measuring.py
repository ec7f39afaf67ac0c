"""Properties of cables as planners of noisy trials know them: measured from rendered pictures."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from withe.deployment import Cable, measure, trial_cable
from withe.perception.synthetic import render_mask

MARGIN = 40  # [px]
PIXEL, NEAR_PIXEL = 5e-4, 2.5e-4  # [m], in pictures of a hanging cable and of a loop


def looped(cable: Cable, seed: int) -> Cable:
    """With the gravito-bending length that `measure` reads from a picture of the loop of a trial's cable."""
    true, random = trial_cable(cable, seed), np.random.default_rng((seed, 2))
    line = true.gravito_bending_length * loop()
    found = measure(image=photographed(line, true.radius, random, NEAR_PIXEL, above=MARGIN), scale=NEAR_PIXEL)
    return replace(cable, gravito_bending_length=found.gravito_bending_length)


def photographed(
    line: np.ndarray, radius: float, random: np.random.Generator, pixel: float = PIXEL, above: int = 0
) -> np.ndarray:
    """A picture from the side of a line before a plain background; x and height [m]. It ends `above` the line [px]."""
    corner = np.array([line[:, 0].min() - MARGIN * pixel, line[:, 1].max() + above * pixel])
    seen = (line - corner) * [1.0, -1.0] / pixel + random.uniform(0.0, 1.0, 2) * [1.0, 0.0]
    columns, rows = np.ceil(seen.max(0) + MARGIN).astype(int)
    mask = render_mask([seen], [2.0 * radius / pixel], [False], (rows, columns))
    image = np.where(mask[..., None], (60, 60, 70), (225, 230, 230)) + random.normal(0.0, 4.0, (rows, columns, 3))
    return np.clip(image, 0, 255).astype(np.uint8)


@cache
def loop() -> np.ndarray:
    """A cable that is folded back over itself: x and height [Lgb].

    theta'' = (R - s) cos(theta) / 2 from the table to the layer below, where theta is back at pi and the height at 0.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    def turned(_s: float, y: np.ndarray) -> float:
        return y[0] - np.pi

    turned.terminal, turned.direction = True, -1  # type: ignore[attr-defined]

    def over(reaction: float):
        def slopes(s: float, y: np.ndarray) -> list[float]:
            return [y[1], 0.5 * (reaction - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(slopes, (0.0, 9.0), [0.0] * 4, events=turned, rtol=1e-9, atol=1e-10, dense_output=True)

    found = over(brentq(lambda reaction: over(reaction).y[3, -1], 4.6, 4.85, xtol=1e-10))
    line = found.sol(np.linspace(0.0, found.t[-1], 401))[2:].T
    return np.concatenate([[[-3.0, 0.0]], line, [[line[-1, 0] - 2.0, 0.0]]])  # both layers continue
