"""Custom forces for the engine: forces, moments, and their derivatives, given or by finite differences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.kinds import CustomForcePart

__all__ = ["CustomForces"]

FloatArray = npt.NDArray[np.float64]
Answer = tuple[FloatArray, FloatArray | None, Any, Any]  # forces, moments, by positions, by velocities

_LITTLE = float(np.finfo(float).eps) ** (1.0 / 3.0)  # relative step of a central difference; its error is the square
_WRONG = 1e-4  # relative to the greatest entry


class CustomForces:
    """The sum of all custom forces of a scene.

    Parameters
    ----------
    parts : sequence of CustomForcePart
    length : float [m]
        Length of the shortest edge. Finite differences use a small part of it.
    check_forces, check_moments : callable
        Functions of an array and its name that refuse components out of the plane of the scene.
    """

    def __init__(
        self,
        parts: Sequence[CustomForcePart],
        length: float,
        check_forces: Callable[[FloatArray, str], None],
        check_moments: Callable[[FloatArray, str], None],
    ) -> None:
        self._parts = parts
        self._length = length
        self._check_forces = check_forces
        self._check_moments = check_moments
        self._moments = any(part.moments for part in parts)

    def __call__(self, time: float, positions: FloatArray, velocities: FloatArray, derivatives: bool) -> Answer:
        """Return forces for the engine; derivatives are SciPy matrices of 3 (with moments 6) rows a node, or None."""
        total = np.zeros((2 if self._moments else 1, *positions.shape))
        by_positions, by_velocities = [], []
        for part in self._parts:
            total[: 2 if part.moments else 1] += self._check(self._value(part, time, positions, velocities), part, time)
            if not derivatives:
                continue
            found = (
                (self._by_differences(part, time, positions, velocities, 0), None)
                if part.jacobian is None
                else self._given(part, time, positions, velocities)
            )
            by_positions.append(self._padded(found[0], positions.size))
            if found[1] is not None:
                by_velocities.append(self._padded(found[1], positions.size))
        moments = total[1] if self._moments else None
        return total[0], moments, _sum(by_positions), _sum(by_velocities)

    def check(self, part: CustomForcePart, time: float, positions: FloatArray, velocities: FloatArray) -> None:
        """Compare a Jacobian with finite differences of its function.

        Raises
        ------
        ValueError
            The Jacobian differs; the message names the entry with the greatest error.
        """
        if part.jacobian is None:
            raise ValueError(f"custom force {part.name!r} has no jacobian to check")
        words = ("position", "N/m"), ("velocity", "N s/m")
        for which, given in enumerate(self._given(part, time, positions, velocities)):
            if given is None:
                continue
            expected = self._by_differences(part, time, positions, velocities, which).toarray()
            found = np.zeros_like(expected)
            found[: given.shape[0]] = given.toarray()
            off = np.abs(found - expected)
            row, column = np.unravel_index(int(np.argmax(off)), off.shape)
            if off[row, column] <= _WRONG * max(float(np.abs(expected).max()), float(np.abs(found).max())):
                continue
            count, (word, unit) = len(positions), words[which]
            kind = "force" if row < 3 * count else "moment"
            raise ValueError(
                f"jacobian of custom force {part.name!r} must be the derivative of the returned forces and "
                f"moments: for the {kind} on node {row // 3 % count} along {'xyz'[row % 3]} by the {word} of node "
                f"{column // 3} along {'xyz'[column % 3]}, the jacobian has {found[row, column]:.6g} {unit} and "
                f"finite differences give {expected[row, column]:.6g} {unit}"
            )

    def _value(self, part: CustomForcePart, time: float, positions: FloatArray, velocities: FloatArray) -> FloatArray:
        """Forces, and moments if it has any, shape (1 or 2, nodes, 3)."""
        value = part.function(time, positions.copy(), velocities.copy())
        what = f"custom force {part.name!r}"
        if not part.moments:
            return validation.number_array(value, what, positions.shape)[None]
        if not isinstance(value, tuple) or len(value) != 2:
            raise ValueError(f"{what} with moments=True must return (forces, moments), got {value!r:.80}")
        forces = validation.number_array(value[0], f"forces of {what}", positions.shape)
        moments = validation.number_array(value[1], f"moments of {what}", positions.shape)
        return np.stack([forces, moments])

    def _check(self, value: FloatArray, part: CustomForcePart, time: float) -> FloatArray:
        """Refuse forces and moments that leave the plane of the scene."""
        what = f"custom force {part.name!r} at t = {time:g}"
        self._check_forces(value[0], what)
        if part.moments:
            self._check_moments(value[1], f"moments of {what}")
        return value

    def _given(
        self, part: CustomForcePart, time: float, positions: FloatArray, velocities: FloatArray
    ) -> tuple[Any, Any]:
        """Derivatives by positions and by velocities as the user's function returns them; the latter may be None."""
        assert part.jacobian is not None
        value = part.jacobian(time, positions.copy(), velocities.copy())
        first, second = value if isinstance(value, tuple) and len(value) == 2 else (value, None)
        return _matrix(first, part, positions.size), None if second is None else _matrix(second, part, positions.size)

    def _by_differences(
        self, part: CustomForcePart, time: float, positions: FloatArray, velocities: FloatArray, which: int
    ) -> Any:
        """Central differences by positions (0) or velocities (1)."""
        from scipy import sparse

        state = [positions.copy(), velocities.copy()]
        speed = max(float(np.abs(velocities).max(initial=0.0)), self._length)
        little = _LITTLE * (self._length if which == 0 else speed)
        rows, columns, slopes = [], [], []
        for column, index in enumerate(np.ndindex(*positions.shape)):
            kept = state[which][index]
            ends = []
            for sign in (1.0, -1.0):
                state[which][index] = kept + sign * little
                ends.append(self._value(part, time, *state).ravel())
            state[which][index] = kept
            change = ends[0] - ends[1]
            found = np.flatnonzero(change)
            rows.append(found)
            columns.append(np.full(len(found), column))
            slopes.append(change[found] / (2.0 * little))
        shape = (len(change), positions.size)
        return sparse.csc_matrix((np.concatenate(slopes), (np.concatenate(rows), np.concatenate(columns))), shape)

    def _padded(self, matrix: Any, size: int) -> Any:
        """With rows for moments, where another force has some."""
        from scipy import sparse

        rows = (2 if self._moments else 1) * size
        if matrix.shape[0] == rows:
            return matrix
        return sparse.vstack([matrix, sparse.csc_matrix((rows - matrix.shape[0], size))], format="csc")


def _sum(matrices: list[Any]) -> Any:
    return sum(matrices[1:], matrices[0]) if matrices else None


def _matrix(value: Any, part: CustomForcePart, size: int) -> Any:
    """Return a derivative as a SciPy matrix of `size` rows, or of twice as many with the rows of moments."""
    from scipy import sparse

    what = f"jacobian of custom force {part.name!r}"
    shapes = [(size, size), *([(2 * size, size)] if part.moments else [])]
    if not sparse.issparse(value):
        return sparse.csc_matrix(validation.number_array(value, what, *shapes))
    if value.shape not in shapes:
        wanted = " or ".join(str(shape) for shape in shapes)
        raise ValueError(f"{what} must have the shape {wanted}, got {value.shape}")
    matrix = sparse.csc_matrix(value, dtype=float)
    if not np.isfinite(matrix.data).all():
        raise ValueError(f"{what} must be finite")
    return matrix
