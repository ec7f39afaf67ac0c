"""Motions of supports: paths and rotations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from withe.common import drawing, validation

__all__ = [
    "POSE_WORDS",
    "Path",
    "PathLike",
    "PathTable",
    "Pose",
    "PoseWord",
    "RotationLike",
    "Turn",
    "Waypoints",
    "axis_angle",
    "evaluate_path",
    "make_path",
    "oriented",
    "paths_by_owner",
]

FloatArray = npt.NDArray[np.float64]
# Position (3,) [m], rotation (3, 3) from the drawn orientation; None: not given.
Pose = tuple[FloatArray | None, FloatArray | None]
Path = Callable[[float], Any]
PoseWord = Literal["position", "rotation"]
POSE_WORDS: tuple[PoseWord, ...] = ("position", "rotation")
PathTable = dict[tuple[str, PoseWord], Path]  # by the name of the moved part, and the moved pose word
PathLike = Path | npt.ArrayLike | tuple[Path, Path]


class HasMatrix(Protocol):
    """A rotation of SciPy."""

    def as_matrix(self) -> npt.NDArray[Any]:
        """Shape (3, 3)."""


RotationLike = npt.ArrayLike | HasMatrix


def oriented(drawn_tangent: FloatArray, drawn_director: FloatArray, tangent: FloatArray, roll: float) -> FloatArray:
    """Rotation from the drawn tangent to another one by the smallest turn, followed by a roll about the new tangent."""
    swing = drawing.rotation_between(drawn_tangent, tangent, drawn_director)
    return np.asarray(drawing.rotation_about(roll * tangent) @ swing, np.float64)


@dataclass(frozen=True, eq=False)
class Turn:
    """A ramp of rotation to a tangent and a roll. Unlike a rotation matrix, it counts full turns.

    Attributes
    ----------
    tangents : shape (2, 3)
    rolls : shape (2,) [rad]
    times : shape (2, 2) [s]
        Start and end of the ramp of the tangent, and of the roll.
    drawn : shape (2, 3)
        Tangent and first director as drawn.
    """

    tangents: FloatArray
    rolls: FloatArray
    times: FloatArray
    drawn: FloatArray

    def __call__(self, time: float) -> FloatArray:
        """Rotation at a time."""
        share = self._share(0, time)
        swing = drawing.rotation_between(self.tangents[0], self.tangents[1], self._spare())
        axis, angle = axis_angle(swing)
        tangent = drawing.rotation_about(share * angle * axis) @ self.tangents[0]
        return oriented(self.drawn[0], self.drawn[1], tangent, self.roll_at(time))

    def roll_at(self, time: float) -> float:
        """Return the roll at a time [rad]."""
        share = self._share(1, time)
        return (1.0 - share) * float(self.rolls[0]) + share * float(self.rolls[1])

    def arrived(self, time: float) -> Turn:
        """Return the end of the ramp at a time, as a ramp without further motion that still counts full turns."""
        return Turn(
            tangents=np.stack([self.tangents[1]] * 2),
            rolls=np.full(2, self.rolls[1]),
            times=np.array([(time - 1.0, time)] * 2),
            drawn=self.drawn,
        )

    def _share(self, way: int, time: float) -> float:
        begin, end = self.times[way]
        return float(min(max((time - begin) / (end - begin), 0.0), 1.0)) if end > begin else 1.0

    def _spare(self) -> FloatArray:
        return drawing.default_normal(self.tangents[0])

    def arrays(self) -> dict[str, FloatArray]:
        """Return all numbers, for a file."""
        return {
            "tangents": self.tangents,
            "rolls": self.rolls,
            "times": self.times,
            "drawn": self.drawn,
        }


@dataclass(frozen=True, eq=False)
class Waypoints:
    """Motion of a support through poses at given times, with constant velocity and rate of rotation in between.

    Attributes
    ----------
    times : shape (poses,) [s]
    positions : shape (poses, 3) [m]
    rotations : shape (poses, 3, 3), or (0, 3, 3) if only positions are given
    """

    times: FloatArray
    positions: FloatArray
    rotations: FloatArray

    def __call__(self, time: float) -> Any:
        """Return the position, and the rotation if there are rotations, at a time."""
        after = int(np.clip(np.searchsorted(self.times, time, side="right"), 1, len(self.times) - 1))
        begin, end = self.times[after - 1 : after + 1]
        share = min(max((time - float(begin)) / float(end - begin), 0.0), 1.0)
        position = (1.0 - share) * self.positions[after - 1] + share * self.positions[after]
        if not len(self.rotations):
            return position
        before = self.rotations[after - 1]
        axis, angle = axis_angle(self.rotations[after] @ before.T)
        return position, drawing.rotation_about(share * angle * axis) @ before

    def arrays(self) -> dict[str, FloatArray]:
        """Return all numbers, for a file."""
        return {"times": self.times, "positions": self.positions, "rotations": self.rotations}


def paths_by_owner(paths: PathTable) -> list[tuple[str, Path, set[PoseWord]]]:
    """Return each path once, with its owner and the words that it moves."""
    found: dict[tuple[str, int], tuple[str, Path, set[PoseWord]]] = {}
    for (name, word), path in paths.items():
        found.setdefault((name, id(path)), (name, path, set()))[2].add(word)
    return list(found.values())


def make_path(path: PathLike, turns: bool, owner: str) -> Path:
    """Return a user's path as a function of time.

    Raises
    ------
    ValueError
        Not a path: it must be a function, a pair of functions, or rows (t, x, y, z) or (t, x, y, z, qw, qx, qy, qz)
        with increasing times.
    """
    if callable(path):
        return path
    what = f"path of {owner}"
    if isinstance(path, tuple) and len(path) == 2 and all(callable(part) for part in path):
        return Both(*path)
    rows = validation.number_array(path, what, ("poses", 4), ("poses", 8))
    if len(rows) < 2:
        raise ValueError(f"{what} must have at least two rows, got {len(rows)}")
    steps = np.diff(rows[:, 0])
    if steps.min() <= 0.0:
        row = int(np.argmin(steps))
        raise ValueError(f"{what} must have increasing times, got {rows[row, 0]:g} s and then {rows[row + 1, 0]:g} s")
    if rows.shape[1] == 8 and not turns:
        raise ValueError(f"{what} must have positions only, (t, x, y, z), because a pin does not hold directions")
    turned = [
        validation.quaternion_matrix(row[4:], f"row {i} of the {what}") for i, row in enumerate(rows) if len(row) == 8
    ]
    return Waypoints(rows[:, 0].copy(), rows[:, 1:4].copy(), np.array(turned).reshape(-1, 3, 3))


@dataclass(frozen=True, eq=False)
class Both:
    """A function for the position and one for the rotation, such as a CubicSpline and a RotationSpline of SciPy."""

    position: Path
    rotation: Path

    def __call__(self, time: float) -> Any:
        """Both at a time."""
        return self.position(time), self.rotation(time)


def axis_angle(rotation: FloatArray) -> tuple[FloatArray, float]:
    """Return unit vector and angle of a rotation, from 0 to pi."""
    cosine = min(max(0.5 * (float(np.trace(rotation)) - 1.0), -1.0), 1.0)
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    size = float(np.linalg.norm(axis))
    if size > 1e-9:
        return axis / size, float(np.arctan2(0.5 * size, cosine))
    if cosine > 0.0:
        return np.array([1.0, 0.0, 0.0]), 0.0
    values, vectors = np.linalg.eigh(0.5 * (rotation + rotation.T))
    return np.asarray(vectors[:, int(np.argmax(values))], np.float64), np.pi


def evaluate_path(path: Path, time: float, turns: bool, owner: str) -> Pose:
    """Return the checked position and rotation of a path.

    Parameters
    ----------
    path : callable
        Function that returns a position, a position and a rotation, or seven numbers x, y, z, qw, qx, qy, qz.
    time : float [s]
    turns : bool
        True if the support holds a direction.
    owner : str
        Name for errors.

    Raises
    ------
    ValueError
        Another result, or a rotation for a support that does not hold a direction.
    """
    if isinstance(path, Turn):
        return None, path(time)
    what = f"path of {owner} at t = {time:g}"
    value = path(time)
    if turns and isinstance(value, np.ndarray) and value.shape == (7,):
        value = validation.number_array(value, what, (7,))
        value = value[:3], validation.quaternion_matrix(value[3:], what)
    if isinstance(value, tuple | list) and len(value) == 2:
        position = validation.vector(value[0], f"position on the {what}")
        if not turns:
            raise ValueError(f"{what} must be a position only, because a pin does not hold directions")
        return position, validation.rotation_matrix(value[1], f"rotation on the {what}")
    return validation.vector(value, what), None
