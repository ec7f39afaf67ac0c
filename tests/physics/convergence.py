"""Orders of convergence: what separates a right discretisation from one that is merely close."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cases import measured_order


def observed_orders(errors: Sequence[float], ratio: float = 2.0) -> np.ndarray:
    """Orders p seen in errors of runs whose edge or step shrinks by `ratio` from each to the next."""
    sizes = np.abs(np.asarray(errors, dtype=float))
    return np.log(sizes[:-1] / sizes[1:]) / np.log(ratio)


def assert_order(errors: Sequence[float], order: float = 2.0, slack: float = 0.15, ratio: float = 2.0) -> None:
    """The errors fall at the order given, within the slack, in every refinement."""
    orders = observed_orders(errors, ratio)
    measured_order(orders)
    assert np.all(np.abs(orders - order) <= slack), f"errors {list(errors)} fall at orders {orders}, not {order}"


def assert_order_at_least(errors: Sequence[float], order: float, slack: float = 0.15, ratio: float = 2.0) -> None:
    """The errors fall at the order given or faster, less the slack, in every refinement."""
    orders = observed_orders(errors, ratio)
    measured_order(orders)
    assert np.all(orders >= order - slack), f"errors {list(errors)} fall at orders {orders}, less than {order}"


def zero_crossing(loads: Sequence[float], responses: Sequence[float]) -> float:
    """Load at which the stiffness against a small disturbance, 1 / response, would vanish.

    The polynomial through (stiffness, load) is read off at zero stiffness; a stiffness that falls through a
    simple zero is smooth there, where the response itself has a pole.
    """
    stiffness = 1.0 / np.asarray(responses, dtype=float)
    # Scaled, so that the fit is well conditioned; a full-degree fit is Lagrange's interpolation.
    scale = np.abs(stiffness).max()
    return float(np.polyval(np.polyfit(stiffness / scale, loads, len(loads) - 1), 0.0))
