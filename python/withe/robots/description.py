"""Description of a robot as values: what its file says, in the axes of the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.solids.bodies import Solid

__all__ = ["RobotBody", "RobotDescription", "RobotJoint"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RobotBody:
    """A body that moves as one, from one or several bodies of the file.

    Attributes
    ----------
    names : tuple of str
        Names in the file. The first one is that of the body to which the others are fixed.
    mass : float [kg]
    center : ndarray of shape (3,) [m]
        Centre of mass in the axes of the body.
    inertia : ndarray of shape (3, 3) [kg m^2]
        About the centre of mass, in the axes of the body.
    position : ndarray of shape (3,) [m]
        Origin of the axes of the body.
    rotation : ndarray of shape (3, 3)
        Axes of the body, as columns.
    solid : Solid or None
        Shape in the axes of the body, for pictures.
    is_fixed : bool
        True if the body is fixed to the world.
    is_between : bool
        True if the body only stands between two joints of one body of the file. It has a negligible mass.
    """

    names: tuple[str, ...]
    mass: float
    center: FloatArray
    inertia: FloatArray
    position: FloatArray
    rotation: FloatArray
    solid: Solid | None
    is_fixed: bool
    is_between: bool = False


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """A joint of two bodies, or of a body and the world.

    Attributes
    ----------
    name : str
    kind : {"revolute", "sliding", "pinned"}
    parent : int or None
        Index of the body that carries the joint; None for the world.
    child : int
        Index of the body that moves.
    at : ndarray of shape (3,) [m]
    axis : ndarray of shape (3,) or None
        Unit vector; None for a pinned joint.
    stiffness, rest_angle, damping : float
        As in `Scene.join`.
    limits : (float, float), or None
        Least and greatest angle [rad], or displacement [m].
    limit_stiffness : float or None
        Stiffness of the stops [N m/rad], or [N/m].
    max_torque, max_speed : float
        Greatest torque [N m] or force [N] of what drives the joint, and its greatest rate [rad/s] or [m/s].
    """

    name: str
    kind: Literal["revolute", "sliding", "pinned"]
    parent: int | None
    child: int
    at: FloatArray
    axis: FloatArray | None
    stiffness: float = 0.0
    rest_angle: float = 0.0
    damping: float = 0.0
    limits: tuple[float, float] | None = None
    limit_stiffness: float | None = None
    max_torque: float = np.inf
    max_speed: float = np.inf


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """A robot in the axes of its file.

    Attributes
    ----------
    name : str
    bodies : tuple of RobotBody
    joints : tuple of RobotJoint
    points : mapping of str to (int, ndarray of shape (3,) [m])
        Index of the body and position of each site, and of the origin of each body of the file.
    size : float [m]
        Diagonal of the box around the origins, joints and shapes of the robot.
    gravity : ndarray of shape (3,) [m/s^2], or None
        Acceleration of free fall in the file; None if the file states none.
    unsupported : tuple of str
        Content of the file that the description lacks.
    doubts : tuple of str
        What is probably not meant, as sentences about the robot.
    """

    name: str
    bodies: tuple[RobotBody, ...]
    joints: tuple[RobotJoint, ...]
    points: Mapping[str, tuple[int, FloatArray]]
    size: float
    gravity: FloatArray | None
    unsupported: tuple[str, ...]
    doubts: tuple[str, ...] = ()
