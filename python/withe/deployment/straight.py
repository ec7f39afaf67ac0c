"""All poses in which a straight line can be laid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from withe._core import StraightRod
from withe.common import validation
from withe.deployment.grasping import TWIST_STIFFNESS, require_stiff

__all__ = ["StraightLine", "StraightPose"]

FloatArray = npt.NDArray[np.float64]
_ANGLE_STEP = 0.1  # [rad] between the rays that outline the region


@dataclass(frozen=True)
class StraightPose:
    """Pose of a jaw that holds a rod which leaves the floor straight. Arrays have the shape of the arguments.

    If `valid` is False the other numbers are NaN, and `stable` is False.

    Attributes
    ----------
    x, z : ndarray of shape (...) [Lgb]
        Position of the held end, relative to the lift-off point.
    angle : ndarray of shape (...) [rad]
        Angle of the tangent at the held end above the floor.
    force : ndarray of shape (..., 2) [w Lgb]
        Force of the floor on the rod at lift-off, along the rod and up.
    stable : ndarray of bool of shape (...)
        True if the energy is a minimum while the jaw holds position and rotation, also against motion out of the plane.
    valid : ndarray of bool of shape (...)
        True if the rod stays above the floor and the floor pushes (dissertation (9.6)).
    residual : ndarray of shape (...)
        Largest error of the boundary value problem.
    """

    x: FloatArray
    z: FloatArray
    angle: FloatArray
    force: FloatArray
    stable: npt.NDArray[np.bool_]
    valid: npt.NDArray[np.bool_]
    residual: FloatArray


class StraightLine:
    """Poses that lay a straight line with a given suspended length (Choi, dissertation, 9.3.1).

    The rod leaves the floor flat and without curvature. The jaw may bend it, and its rotation follows from its
    position. In two of these poses the floor applies no axial force and the jaw no moment. One pose bends gently. The
    other is folded over and, for a long suspended part, buckles out of its plane.

    Parameters
    ----------
    suspended : float [Lgb]
        Suspended length, 0.3 to 50.
    stretch_stiffness : float [-]
        EA Lgb^2 / EI, as in `grasp`.

    Attributes
    ----------
    gentle, folded : StraightPose
        The gentle and the folded optimum.

    Raises
    ------
    ValueError
        Arguments out of range.

    Examples
    --------
    >>> import withe
    >>> line = withe.deployment.StraightLine(17.68)
    >>> for pose in (line.gentle, line.folded):
    ...     print(f"x {pose.x:.3f}, force {pose.force[1]:.3f}, stable: {pose.stable}")
    x 2.566, force 1.515, stable: True
    x -3.657, force 4.913, stable: False
    """

    gentle: StraightPose
    folded: StraightPose

    def __init__(self, suspended: float, stretch_stiffness: float = 2087.0) -> None:
        self.suspended: float = validation.number(suspended, "suspended")
        if not StraightRod.shortest <= self.suspended <= StraightRod.longest:
            limits = f"from {StraightRod.shortest:g} to {StraightRod.longest:g} Lgb"
            raise ValueError(f"suspended must be {limits}, got {self.suspended:g}")
        self.stretch_stiffness: float = validation.number(stretch_stiffness, "stretch_stiffness")
        require_stiff(np.array([self.suspended]), np.array([self.stretch_stiffness]))
        self._rod = StraightRod(self.suspended, 2.0 * self.stretch_stiffness)
        rows = self._rod.optima(TWIST_STIFFNESS)
        self.gentle, self.folded = (_described(rows[i], ()) for i in range(2))

    def pose(self, x: npt.ArrayLike, z: npt.ArrayLike) -> StraightPose:
        """Return the shape of the rod for given positions of the jaw.

        Parameters
        ----------
        x, z : array_like, broadcast together [Lgb]
            Positions of the jaw.

        Returns
        -------
        StraightPose
            The pose, if there are several, that the nearer optimum reaches without a jump.

        Raises
        ------
        ValueError
            Arguments that are not finite numbers or do not broadcast.
        """
        x, z = validation.broadcast_arrays(x=x, z=z)
        rows = self._rod.poses(np.stack([x.ravel(), z.ravel()], 1), TWIST_STIFFNESS)
        return _described(rows, x.shape)

    @cached_property
    def outline(self) -> FloatArray:
        """Outline of the region of valid positions, found on rays from the lift-off point, shape (points, 2) [Lgb].

        At its far side the floor would begin to pull, and at its near side the rod touches the floor elsewhere. The
        loop of a short rod may return to the lift-off point.
        """
        rays = self._rod.outline(_ANGLE_STEP)
        return np.concatenate([rays[:, 2:], rays[::-1, :2]])

    def points(self, x: float, z: float) -> FloatArray:
        """Return the points of the rod of one pose.

        Parameters
        ----------
        x, z : float [Lgb]
            Position of the held end, relative to the lift-off point.

        Returns
        -------
        ndarray of shape (n, 3) [Lgb]

        Raises
        ------
        ValueError
            No pose exists there.
        """
        return np.asarray(self._rod.points(validation.number(x, "x"), validation.number(z, "z"))[:, 1:4])


def _described(rows: FloatArray, shape: tuple[int, ...]) -> StraightPose:
    rows = rows.reshape(*shape, 8)
    valid = rows[..., 6] > 0
    x, z, angle, along, up, residual = (np.where(valid, rows[..., i], np.nan) for i in range(6))
    return StraightPose(x, z, angle, np.stack([along, up], -1), valid & (rows[..., 7] > 0), valid, residual)
