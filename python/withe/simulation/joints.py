"""Revolute joints while a simulation runs: what is set, and what is read."""

from __future__ import annotations

from typing import Any

from withe.parts.handles import Joint
from withe.parts.joints import JOINT_WORDS, checked_number, revolute_joints
from withe.parts.kinds import JoinPart
from withe.simulation.session import Session

__all__ = ["find_joint", "joint_index", "joint_value", "set_joint"]


def set_joint(session: Session, part: JoinPart, values: dict[str, Any]) -> None:
    """Change stiffness, rest_angle, damping or moment, all or none."""
    index = joint_index(session, part)
    settings = {}
    for word in JOINT_WORDS:
        if word in values:
            numbers = session.world.parameter(f"joint_{word}")
            numbers[index] = checked_number(part.name, word, values[word])
            settings[f"joint_{word}"] = numbers
    session.world.set(0, settings)


def joint_value(session: Session, part: JoinPart, word: str) -> float:
    """The present stiffness [N m/rad], rest_angle [rad], damping [N m s/rad] or moment [N m]."""
    return float(session.world.parameter(f"joint_{word}")[joint_index(session, part), 0])


def joint_index(session: Session, part: JoinPart) -> int:
    """The engine's number of a revolute joint."""
    return revolute_joints(session.scene.all(JoinPart)).index(part)


def find_joint(session: Session, joint: Joint | str) -> int:
    """The same, by its handle or name.

    Raises
    ------
    ValueError
        Not a joint of this scene, or one without an axis.
    """
    part = session.directory.find(joint, JoinPart, "joint")
    if part.axis is None:
        raise ValueError(f"joint {part.name!r} must be revolute to have an angle, got kind {part.kind}")
    return joint_index(session, part)
