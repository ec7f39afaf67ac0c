"""Joints of a model of MuJoCo: their types, their stops, and the greatest torques of what drives them."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["BALL", "FREE", "HINGE", "SLIDE", "greatest_torque", "has_force_limit", "stops_of"]

FREE, BALL, SLIDE, HINGE = 0, 1, 2, 3  # mjtJoint


def stops_of(model: Any, joint: int) -> tuple[tuple[float, float] | None, float | None]:
    """Return the limits of a hinge or slide, from its place in the drawing, and the stiffness of its stops.

    MuJoCo's limit yields under a resting load by the load over m k d / (1 - d), where m is the inertia of the joint,
    k the stiffness of `solref`, and d the impedance. The impedance grows with the yield; here it is the mean of both
    values of `solimp`.
    """
    if not model.jnt_limited[joint] or model.jnt_type[joint] not in (SLIDE, HINGE):
        return None, None
    drawn = float(model.qpos0[int(model.jnt_qposadr[joint])])
    low, high = (float(limit) - drawn for limit in model.jnt_range[joint])
    inverse = float(model.dof_invweight0[int(model.jnt_dofadr[joint])])
    if not low <= 0.0 <= high or low == high or not inverse > 0.0:
        return None, None
    first, second = map(float, model.jnt_solref[joint])
    impedances = np.clip(model.jnt_solimp[joint][:2], 1e-4, 1.0 - 1e-4)
    impedance, greatest = float(impedances.mean()), float(impedances[1])
    rate = (1.0 / (first * second) ** 2 if first > 0.0 else -first) / greatest**2
    return (low, high), rate * impedance / ((1.0 - impedance) * inverse)


def has_force_limit(model: Any, joint: int) -> bool:
    """Return True if the forces of what drives a joint have a limit that is not zero."""
    return bool(_force_limits(model, joint))


def greatest_torque(model: Any, joint: int) -> float:
    """Return the greatest torque of what drives a hinge or slide, as `Scene.join` has it for a servo; else infinity.

    It is the least of the limit of the joint, which is the effort of URDF, and those of its actuators, times their
    gears. Of two different limits in both directions it is the smaller one. A spring of the file is no part of what
    drives the joint. A joint with such a spring therefore has no limit.
    """
    if model.jnt_stiffness[joint] or model.jnt_type[joint] not in (SLIDE, HINGE):
        return np.inf
    return min(_force_limits(model, joint), default=np.inf)


def _force_limits(model: Any, joint: int) -> list[float]:
    ranges = [model.jnt_actfrcrange[joint]] if model.jnt_actfrclimited[joint] else []
    for actuator in range(model.nu):
        drives = model.actuator_trntype[actuator] <= 1 and model.actuator_trnid[actuator][0] == joint
        if drives and model.actuator_forcelimited[actuator]:
            ranges.append(model.actuator_gear[actuator][0] * model.actuator_forcerange[actuator])
    limits = [float(min(-min(pair), max(pair))) for pair in ranges]
    return [each for each in limits if each > 0.0]
