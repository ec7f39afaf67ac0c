"""Joints of a model of MuJoCo: their types, and the stops of those that have limits."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["BALL", "FREE", "HINGE", "SLIDE", "stops_of"]

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
