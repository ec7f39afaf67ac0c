"""Where a moving support is to be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from withe.common import drawing, validation

__all__ = ["Path", "Pose", "RotationLike", "Turn", "axis_angle", "evaluate_path", "oriented"]

FloatArray = npt.NDArray[np.float64]
Pose = tuple[FloatArray, FloatArray]  # position (3,) [m], rotation (3, 3) from the drawn orientation
Path = Callable[[float], Any]


class HasMatrix(Protocol):
    """A rotation as SciPy has them."""

    def as_matrix(self) -> npt.NDArray[Any]:
        """Shape (3, 3)."""


RotationLike = npt.ArrayLike | HasMatrix


def oriented(drawn_tangent: FloatArray, drawn_director: FloatArray, tangent: FloatArray, roll: float) -> FloatArray:
    """Rotation that takes the drawn tangent to another by the smallest turn, and then rolls about it."""
    swing = drawing.rotation_between(drawn_tangent, tangent, drawn_director)
    return np.asarray(drawing.rotation_about(roll * tangent) @ swing, np.float64)


@dataclass(frozen=True, eq=False)
class Turn:
    """A support on its way to a tangent and a roll; unlike a rotation matrix, it counts full turns.

    Attributes
    ----------
    positions : shape (2, 3) [m]
    tangents : shape (2, 3)
    rolls : shape (2,) [rad]
    times : shape (2,) [s]
    drawn : shape (2, 3)
        Tangent and first director as drawn.
    """

    positions: FloatArray
    tangents: FloatArray
    rolls: FloatArray
    times: FloatArray
    drawn: FloatArray

    def __call__(self, time: float) -> Pose:
        """Position and rotation at a time."""
        span = float(self.times[1] - self.times[0])
        share = min(max((time - float(self.times[0])) / span, 0.0), 1.0) if span > 0.0 else 1.0
        swing = drawing.rotation_between(self.tangents[0], self.tangents[1], self._spare())
        axis, angle = axis_angle(swing)
        tangent = drawing.rotation_about(share * angle * axis) @ self.tangents[0]
        position = (1.0 - share) * self.positions[0] + share * self.positions[1]
        roll = (1.0 - share) * float(self.rolls[0]) + share * float(self.rolls[1])
        return position, oriented(self.drawn[0], self.drawn[1], tangent, roll)

    def roll_at(self, time: float) -> float:
        """Roll at a time [rad]."""
        return float(np.interp(time, self.times, self.rolls)) if self.times[1] > self.times[0] else float(self.rolls[1])

    def _spare(self) -> FloatArray:
        return drawing.default_normal(self.tangents[0])

    def arrays(self) -> dict[str, FloatArray]:
        """Its numbers, for a file."""
        return {
            "positions": self.positions,
            "tangents": self.tangents,
            "rolls": self.rolls,
            "times": self.times,
            "drawn": self.drawn,
        }


def axis_angle(rotation: FloatArray) -> tuple[FloatArray, float]:
    """Unit vector and angle of a rotation, from 0 to pi."""
    cosine = min(max(0.5 * (float(np.trace(rotation)) - 1.0), -1.0), 1.0)
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    size = float(np.linalg.norm(axis))
    if size > 1e-9:
        return axis / size, float(np.arctan2(0.5 * size, cosine))
    if cosine > 0.0:
        return np.array([1.0, 0.0, 0.0]), 0.0
    values, vectors = np.linalg.eigh(0.5 * (rotation + rotation.T))
    return np.asarray(vectors[:, int(np.argmax(values))], np.float64), np.pi


def evaluate_path(path: Path, time: float, present: FloatArray, turns: bool, owner: str) -> Pose:
    """Position and rotation that a path gives, checked.

    Parameters
    ----------
    path : callable
        Returns a position, or a position and a rotation.
    time : float [s]
    present : ndarray of shape (3, 3)
        Rotation to keep where the path gives none.
    turns : bool
        Whether the support holds a direction at all.
    owner : str
        Named in errors.

    Raises
    ------
    ValueError
        Anything else, or a rotation for a support that holds none.
    """
    if isinstance(path, Turn):
        return path(time)
    what = f"path of {owner} at t = {time:g}"
    value = path(time)
    if isinstance(value, tuple | list) and len(value) == 2:
        position = validation.vector(value[0], f"position on the {what}")
        if not turns:
            raise ValueError(f"{what} must be a position only: a pin holds no direction")
        return position, validation.rotation_matrix(value[1], f"rotation on the {what}")
    return validation.vector(value, what), present
