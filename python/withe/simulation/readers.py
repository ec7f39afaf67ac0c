"""Readers of derivatives by a word of a part from the results of the engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from withe import _core

__all__ = ["OfRun", "Reader", "of_equilibrium"]


@dataclass(frozen=True)
class OfRun:
    """Derivatives of a scalar of a run by parameters of the run, or of a part of it."""

    parameters: _core.ParameterGradient


Reader = Callable[[_core.EquilibriumGradient | OfRun], Any]
"""Function that reads a derivative, shaped like `get`."""


def of_equilibrium(gradient: _core.EquilibriumGradient | OfRun, name: str) -> _core.EquilibriumGradient:
    """Return derivatives of an equilibrium, by the pose of a support or an obstacle.

    Raises
    ------
    ValueError
        The derivatives belong to a step.
    """
    if isinstance(gradient, OfRun):
        raise ValueError(
            f"step_jacobian is not available with respect to the pose of {name!r}; gradients of equilibria, runs "
            "and calls of move are"
        )
    return gradient
