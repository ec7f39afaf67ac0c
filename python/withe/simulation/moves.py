"""Motions of supports by calls of `move`, and their derivatives by the values of these calls."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.common.drawing import rotation_about

__all__ = ["Way"]

FloatArray = npt.NDArray[np.float64]
_Weights = dict[int, FloatArray]  # per call, (3, 3): derivative of the pose by the value of the call


@dataclass(frozen=True, eq=False)
class Way:
    """Ramp of a position, or of a rotation, at a constant rate.

    Attributes
    ----------
    call : int or None
        Call that set the target. None for a constant pose, or one that no call determines.
    begin, over : float [s]
    turn : ndarray of shape (3,)
        Rotation vector from the start to the target.
    start : dict
        Weights of calls in the start of the ramp; -1 stands for the value at the start of the run.
    """

    word: Literal["position", "rotation"]
    call: int | None
    begin: float
    over: float
    turn: FloatArray = field(default_factory=lambda: np.zeros(3))
    start: _Weights = field(default_factory=dict)

    def reached(self, time: float) -> float:
        """Return the completed share of the ramp at the end of a time step, from 0 to 1."""
        if self.over == 0.0:
            return float(time > self.begin)
        return min(max((time - self.begin) / self.over, 0.0), 1.0)

    def weights(self, share: float) -> _Weights:
        """Return the weight of every call, for a completed share."""
        if self.call is None:
            return self.start
        if self.word == "position":
            of_target, of_start = share * np.eye(3), (1.0 - share) * np.eye(3)
        else:
            # R = exp(s v) R0 with exp(v) = R1 R0^T, by spins of R, R0 and R1.
            of_turn = share * _left_jacobian(share * self.turn)
            of_target = of_turn @ np.linalg.inv(_left_jacobian(self.turn))
            of_start = rotation_about(share * self.turn) - of_target @ rotation_about(self.turn)
        out = {call: of_start @ weight for call, weight in self.start.items()}
        out[self.call] = of_target
        return out


def _cross(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _left_jacobian(v: FloatArray) -> FloatArray:
    """exp(v + dv) = exp(J dv) exp(v)."""
    a, k = float(np.linalg.norm(v)), _cross(v)
    second = (a - np.sin(a)) / a**3 if a > 1e-3 else 1.0 / 6.0 - a**2 / 120.0
    return np.asarray(np.eye(3) + 0.5 * np.sinc(0.5 * a / np.pi) ** 2 * k + second * k @ k)
