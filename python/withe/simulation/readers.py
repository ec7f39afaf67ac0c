"""Reads derivatives by a word of a part from what the engine finds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from withe import _core

__all__ = ["OfRun", "Reader", "of_equilibrium"]


@dataclass(frozen=True)
class OfRun:
    """Derivatives of a scalar of a run by what acted in it, or in a part of it."""

    parameters: _core.ParameterGradient


Reader = Callable[[_core.EquilibriumGradient | OfRun], Any]
"""Reads a derivative, shaped like `get`."""


def of_equilibrium(gradient: _core.EquilibriumGradient | OfRun, name: str) -> _core.EquilibriumGradient:
    """Derivatives of an equilibrium, by where a support or an obstacle is.

    Raises
    ------
    ValueError
        Derivatives of a step.
    """
    if isinstance(gradient, OfRun):
        raise ValueError(
            f"step_jacobian is not available with respect to the pose of {name!r}; gradients of equilibria, runs "
            "and calls of move are"
        )
    return gradient
