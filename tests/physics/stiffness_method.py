"""Frames by the stiffness method: what small loads do to straight members between rigid joints, without a mesh.

[Przemieniecki: Theory of matrix structural analysis, chapter 5]; a member has EA, EI about both axes, and GJ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt


def member_stiffness(vector: np.ndarray, stretch: float, bend: float, twist: float) -> np.ndarray:
    """Stiffness of a round member, in world axes: three displacements and three rotations at either end."""
    length = float(np.linalg.norm(vector))
    along = np.outer(vector, vector) / length**2
    across = np.eye(3) - along
    x, y, z = vector / length
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # turn @ a is the cross product with the axis
    shear = 12.0 * bend / length**3 * across + stretch / length * along
    mixed = 6.0 * bend / length**2 * turn
    near = 4.0 * bend / length * across + twist / length * along
    far = 2.0 * bend / length * across - twist / length * along
    return np.block(
        [
            [shear, -mixed, -shear, -mixed],
            [mixed, near, -mixed, far],
            [-shear, mixed, shear, mixed],
            [mixed, far, -mixed, near],
        ]
    )


def displacements(
    joints: npt.ArrayLike,
    members: Sequence[tuple[int, int]],
    clamped: Sequence[int],
    forces: Mapping[int, npt.ArrayLike],
    *,
    stretch: float,
    bend: float,
    twist: float,
) -> np.ndarray:
    """Displacements of the joints, shape (joints, 3), under forces at them."""
    points = np.asarray(joints, dtype=float)
    stiffness = np.zeros((6 * len(points), 6 * len(points)))
    for a, b in members:
        unknowns = np.r_[6 * a : 6 * a + 6, 6 * b : 6 * b + 6]
        stiffness[np.ix_(unknowns, unknowns)] += member_stiffness(points[b] - points[a], stretch, bend, twist)
    load = np.zeros(6 * len(points))
    for joint, force in forces.items():
        load[6 * joint : 6 * joint + 3] = force
    free = np.setdiff1d(np.arange(len(load)), [6 * joint + i for joint in clamped for i in range(6)])
    moved = np.zeros_like(load)
    moved[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
    return moved.reshape(-1, 6)[:, :3]
