"""Joints of a USD stage, in the axes of the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.robots.usd_masses import StageUnits, rotation_of, world_axes

__all__ = ["UsdJoint", "joint_of", "unsupported_of_joint"]

FloatArray = npt.NDArray[np.float64]
Kind = Literal["fixed", "revolute", "sliding", "pinned"]

_KINDS: dict[str, Kind] = {
    "PhysicsFixedJoint": "fixed",
    "PhysicsRevoluteJoint": "revolute",
    "PhysicsPrismaticJoint": "sliding",
    "PhysicsSphericalJoint": "pinned",
}
_COLUMNS = {"X": 0, "Y": 1, "Z": 2}

# Distance of the two frames of a joint as drawn, over the size of the robot, and their angle [rad], at most. USD has
# places of joints in single precision.
_APART = 1e-4
_ASKEW = 1e-3


@dataclass(frozen=True, eq=False)
class UsdJoint:
    """A joint of two bodies of a stage, or of a body and the world.

    Attributes
    ----------
    prim : pxr.Usd.Prim
    kind : {"fixed", "revolute", "sliding", "pinned"}
    bodies : tuple of (int or None)
        Indices of the bodies, None for the world.
    at : ndarray of shape (3,) [m]
    axis : ndarray of shape (3,) or None
        The second body turns or moves positively about or along it.
    stiffness, rest_angle, damping : float
        As in `Scene.join`, for the second body against the first.
    max_torque : float
        Greatest torque [N m] or force [N] of the drive.
    """

    prim: Any
    kind: Kind
    bodies: tuple[int | None, int | None]
    at: FloatArray
    axis: FloatArray | None
    stiffness: float
    rest_angle: float
    damping: float
    max_torque: float


def joint_of(prim: Any, body_at: Callable[[Any], int | None], units: StageUnits, size: float) -> UsdJoint | None:
    """Return a joint; None for a kind that is not supported.

    Parameters
    ----------
    prim : pxr.Usd.Prim
    body_at : callable
        Index of the body to which a prim belongs.
    units : StageUnits
    size : float [m]
        Size of the robot.

    Raises
    ------
    ValueError
        The frames of the joint on its bodies are apart, or both are on one body.
    """
    kind = _KINDS.get(str(prim.GetTypeName()))
    if kind is None:
        return None
    ends = [_end(prim, i, units) for i in (0, 1)]
    bodies = (_body_of(ends[0].prim, body_at), _body_of(ends[1].prim, body_at))
    if bodies[0] == bodies[1]:
        raise ValueError(f"joint {prim.GetPath()} must connect two bodies, or a body and the world, got one twice")
    apart = ends[1].place - ends[0].place
    axis = None
    if kind in ("revolute", "sliding"):
        column = _COLUMNS[str(prim.GetAttribute("physics:axis").Get())]
        axis, other = ends[0].turn[:, column], ends[1].turn[:, column]
        if np.linalg.norm(np.cross(axis, other)) > _ASKEW or axis @ other < 0.0:
            raise ValueError(
                f"axes of joint {prim.GetPath()} on its two bodies differ by "
                f"{np.degrees(np.arccos(np.clip(axis @ other, -1.0, 1.0))):.3g} degrees: turn one of the bodies"
            )
    # A fixed joint holds its bodies as they are drawn.
    across = apart - (apart @ axis) * axis if kind == "sliding" and axis is not None else apart
    if kind != "fixed" and np.linalg.norm(across) > _APART * size:
        raise ValueError(
            f"places of joint {prim.GetPath()} on its two bodies are {np.linalg.norm(across):.3g} m apart: move one of "
            "the bodies"
        )
    # A body that is not fixed has the origin of the joint that moves with it.
    at = ends[1].place if bodies[1] is not None else ends[0].place
    spring = (0.0, 0.0, 0.0) if axis is None else _spring(prim, kind, ends, axis, units)
    most = np.inf if axis is None else _greatest_torque(prim, kind, units)
    if bodies[1] is None:  # the second body is the one that moves
        bodies, axis = (None, bodies[0]), None if axis is None else -axis
    return UsdJoint(prim, kind, bodies, at, axis, *spring, most)


@dataclass(frozen=True, eq=False)
class _End:
    """Frame of a joint on one of its bodies: the prim of the body or None, the origin, and the axes as columns."""

    prim: Any
    place: FloatArray
    turn: FloatArray


def _end(prim: Any, index: int, units: StageUnits) -> _End:
    targets = prim.GetRelationship(f"physics:body{index}").GetTargets()
    place = np.array(prim.GetAttribute(f"physics:localPos{index}").Get() or (0.0, 0.0, 0.0), dtype=float)
    quaternion = prim.GetAttribute(f"physics:localRot{index}").Get()
    turn = np.eye(3) if quaternion is None else rotation_of(quaternion)
    if not targets:
        return _End(None, units.length * units.upright @ place, units.upright @ turn)
    target = prim.GetStage().GetPrimAtPath(targets[0])
    if not target:
        raise ValueError(f"joint {prim.GetPath()} names the body {targets[0]}, which does not exist")
    matrix, origin = world_axes(target, units)
    return _End(target, matrix @ place + origin, matrix / np.linalg.norm(matrix, axis=0) @ turn)


def _body_of(target: Any, body_at: Callable[[Any], int | None]) -> int | None:
    return None if target is None else body_at(target)


def _drive(prim: Any, kind: Kind) -> str:
    """Return the beginning of the names of the attributes of the drive along the free axis."""
    return f"drive:{'angular' if kind == 'revolute' else 'linear'}:physics:"


def _number(prim: Any, word: str, default: float = 0.0) -> float:
    value = prim.GetAttribute(word).Get() if prim.HasAttribute(word) else None
    return default if value is None else float(value)


def _spring(prim: Any, kind: Kind, ends: list[_End], axis: FloatArray, units: StageUnits) -> tuple[float, float, float]:
    """Return stiffness, rest angle and damping of the drive: stiffness (target - angle) + damping (0 - rate).

    Angles of USD are in degrees, also in stiffness and damping.
    """
    word = _drive(prim, kind)
    if _is_by_acceleration(prim, kind):
        return 0.0, 0.0, 0.0
    degrees = kind == "revolute"
    rate = units.mass * units.length**2 * np.degrees(1.0) if degrees else units.mass
    stiffness, damping = rate * _number(prim, word + "stiffness"), rate * _number(prim, word + "damping")
    target = _number(prim, word + "targetPosition") * (np.radians(1.0) if degrees else units.length)
    if not stiffness:
        return 0.0, 0.0, damping
    if degrees:
        side = (_across(axis), np.cross(axis, _across(axis)))
        turn = ends[1].turn @ ends[0].turn.T
        now = np.arctan2(side[1] @ turn @ side[0], side[0] @ turn @ side[0])
    else:
        now = (ends[1].place - ends[0].place) @ axis
    return stiffness, float(target - now), damping


def _greatest_torque(prim: Any, kind: Kind, units: StageUnits) -> float:
    """Return the greatest torque or force of the drive, or infinity."""
    limit = _number(prim, _drive(prim, kind) + "maxForce", np.inf)
    if not limit > 0.0 or _is_by_acceleration(prim, kind):
        return np.inf
    return limit * units.mass * (units.length**2 if kind == "revolute" else units.length)


def _is_by_acceleration(prim: Any, kind: Kind) -> bool:
    return str(prim.GetAttribute(_drive(prim, kind) + "type").Get() or "force") != "force"


def _across(axis: FloatArray) -> FloatArray:
    """Return a unit vector across an axis."""
    other = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return np.asarray(other / np.linalg.norm(other))


def unsupported_of_joint(prim: Any) -> list[str]:
    """Return what a joint has that joints of a scene lack, as words that the name of the joint follows."""
    kind = _KINDS.get(str(prim.GetTypeName()))
    if kind is None:
        return [f"joints of type {prim.GetTypeName()}"]
    found = []
    low, high = _number(prim, "physics:lowerLimit", -np.inf), _number(prim, "physics:upperLimit", np.inf)
    cones = [_number(prim, f"physics:coneAngle{i}Limit", -1.0) for i in (0, 1)]
    if np.isfinite([low, high]).any() or max(cones) >= 0.0:
        found.append("limits of joints")
    if kind in ("revolute", "sliding"):
        word = _drive(prim, kind)
        most = _number(prim, word + "maxForce", np.inf)
        if _is_by_acceleration(prim, kind):
            found.append("drives by acceleration of joints")
        if np.isfinite(most) and (_is_by_acceleration(prim, kind) or not most > 0.0):
            found.append("force limits of joints")
        if _number(prim, word + "targetVelocity"):
            found.append("target velocities of joints")
    finite = [np.isfinite(_number(prim, f"physics:break{word}", np.inf)) for word in ("Force", "Torque")]
    if any(finite):
        found.append("breaking forces of joints")
    return found
