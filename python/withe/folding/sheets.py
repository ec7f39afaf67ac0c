"""Equilibria of the suspended part of a sheet, computed in batches, in units of Lgb and w."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.folding.widths import EVEN, Width

__all__ = [
    "LONGEST",
    "SHORTEST",
    "Elastica",
    "at_forces",
    "at_poses",
    "described",
    "drag",
    "forces_of",
    "join",
    "of_other",
    "poses_of",
    "shared",
    "slides_to_rest",
    "take",
]

FloatArray = npt.NDArray[np.float64]
SHORTEST, LONGEST = _core.SheetManifold.shortest, _core.SheetManifold.longest
"""Suspended lengths between which the position of a tip without moment determines one pose [Lgb]. Shorter parts are
bent
too sharply, and no method plans over them [Choi, dissertation, 7.8.5]."""
_LEAST_SHARE = 500  # sheets that are worth a thread of their own


@dataclass(frozen=True, eq=False)
class Elastica:
    """Hanging sheets, pose by pose. All arrays have the shape of the arguments.

    If `valid` is False the other numbers are NaN, and `stable` is False.

    Attributes
    ----------
    x, z : ndarray of shape (...) [Lgb]
        Displacement of the tip from its place in the flat sheet: back, and up from the table.
    angle : ndarray of shape (...) [rad]
        Angle of the tangent at the tip above the direction in which the sheet leaves the table.
    suspended : ndarray of shape (...) [Lgb]
        Suspended length.
    normal_force, tangential_force : ndarray of shape (...) [w Lgb]
        Force of the table on the sheet at the lift-off point: upwards, and in the direction in which the sheet leaves.
        The tangential force is positive if it compresses the sheet, and negative if it pulls the sheet taut. w is the
        weight per length, at width 1 if the width varies.
    force_ratio : ndarray of shape (...) [-]
        Absolute tangential force over normal force. The sheet behind the lift-off point presses on the table too. A
        sheet of length L therefore slips if the tangential force exceeds friction * (normal_force + L - suspended).
    max_curvature : ndarray of shape (...) [1/Lgb]
        Greatest absolute curvature.
    tip_moment : ndarray of shape (...) [w Lgb^2]
        Moment of the jaw on the sheet.
    valid : ndarray of bool of shape (...)
        True if the pose exists; `elastica` lists the refused positions.
    stable : ndarray of bool of shape (...)
        True if the energy is a minimum while the jaw holds position and angle.
    """

    x: FloatArray
    z: FloatArray
    angle: FloatArray
    suspended: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    force_ratio: FloatArray
    max_curvature: FloatArray
    tip_moment: FloatArray
    valid: npt.NDArray[np.bool_]
    stable: npt.NDArray[np.bool_]


def described(rows: FloatArray, shape: tuple[int, ...], *, keep: bool = False) -> Elastica:
    """Name the columns of the engine's table; `shape` has as many entries as there are rows."""
    valid = rows[:, 7] > 0
    columns = [np.where(valid | keep, rows[:, i], np.nan).reshape(shape) for i in (0, 1, 2, 3, 4, 5, 6, 9)]
    x, z, angle, suspended, normal, tangential, curvature, moment = columns
    return Elastica(
        x=x,
        z=z,
        angle=angle,
        suspended=suspended,
        normal_force=normal,
        tangential_force=tangential,
        force_ratio=np.asarray(np.abs(tangential) / normal),
        max_curvature=curvature,
        tip_moment=moment,
        valid=valid.reshape(shape),
        stable=(valid & (rows[:, 8] > 0)).reshape(shape),
    )


def join(first: Elastica, second: Elastica) -> Elastica:
    """Concatenate two sets of sheets."""
    return Elastica(**{name: np.concatenate([value, getattr(second, name)]) for name, value in vars(first).items()})


def take(sheet: Elastica, index: npt.NDArray[np.generic] | slice) -> Elastica:
    """Select some of the sheets."""
    return Elastica(**{name: value[index] for name, value in vars(sheet).items()})


def shared(solve: Callable[..., FloatArray], *columns: FloatArray) -> FloatArray:
    """Solve rows of many sheets on several threads: the engine releases the interpreter."""
    parts = max(1, min(os.cpu_count() or 1, len(columns[0]) // _LEAST_SHARE))
    if parts == 1:
        return solve(*columns)
    shares = zip(*(np.array_split(column, parts) for column in columns), strict=True)
    with ThreadPoolExecutor(parts) as pool:
        return np.concatenate(list(pool.map(lambda share: solve(*share), shares)))


def forces_of(sheet: Elastica) -> FloatArray:
    """The three numbers that name an equilibrium, of shape (..., 3): normal force, tangential force, lifted length."""
    return np.stack([sheet.normal_force, sheet.tangential_force, sheet.suspended], axis=-1)


def of_other(forces: FloatArray, factor: float) -> FloatArray:
    """Forces of nearly the same sheet if Lgb grows by a factor, in its own units, as an initial guess.

    For long parts these forces are their weight, for short parts their bending.
    """
    weighs = np.minimum(1.0, 0.5 * forces[:, 2:])
    scale = weighs / factor + (1.0 - weighs) * factor**2
    scales: FloatArray = np.concatenate([scale, scale, np.full_like(scale, 1.0 / factor)], axis=1)
    return forces * scales


def poses_of(sheet: Elastica) -> FloatArray:
    """Poses of the tip, of shape (..., 3): x, z, angle."""
    return np.stack([sheet.x, sheet.z, sheet.angle], axis=-1)


def at_forces(forces: npt.ArrayLike, width: Width = EVEN, *, keep: bool = False) -> Elastica:
    """Equilibria by the numbers of `forces_of`. This is an initial value problem with free moment at the tip.

    `keep` also returns numbers that are not valid, for searches that pass through them.
    """
    forces = np.asarray(forces, dtype=float)
    rows = shared(lambda share: _core.sheets_at_forces(share, width.engine), forces.reshape(-1, 3))
    return described(rows, forces.shape[:-1], keep=keep)


def at_poses(poses: npt.ArrayLike, forces: npt.ArrayLike, width: Width = EVEN) -> Elastica:
    """Equilibria of sheets held at poses (x, z, angle), each reached without a jump from given forces."""
    poses, forces = np.broadcast_arrays(np.asarray(poses, dtype=float), np.asarray(forces, dtype=float))
    rows = shared(
        lambda share, known: _core.sheets_at_poses(share, known, width.engine),
        poses.reshape(-1, 3),
        forces.reshape(-1, 3),
    )
    return described(rows, poses.shape[:-1])


def drag(
    poses: npt.ArrayLike, forces: npt.ArrayLike, friction: float, length: float, width: Width = EVEN
) -> tuple[Elastica, FloatArray]:
    """Move the tip of a sheet from pose to pose slowly. The lying part slides as a rigid body by Coulomb's law.

    Return the equilibria, and the slide of the sheet towards its far edge [Lgb]. Equilibria are invalid from the first
    jump on.
    """
    rows, slides = _core.dragged_sheet(
        np.asarray(poses, dtype=float), np.asarray(forces, dtype=float), friction, length, width.engine
    )
    return described(rows, (len(rows),)), slides


def slides_to_rest(sheet: Elastica, friction: float, length: float, width: Width = EVEN) -> FloatArray:
    """Slides of sheets, with jaws at rest, until friction holds them [Lgb]; infinite for sheets that snap.

    The lying part, of sheets `length` long, slides as a rigid body by Coulomb's law. `sheet` has shape (n,).
    """

    def solve(forces: FloatArray) -> FloatArray:
        return _core.slides_to_rest(forces, friction, length, width.engine)

    return np.nan_to_num(np.abs(shared(solve, forces_of(sheet))), nan=np.inf)
