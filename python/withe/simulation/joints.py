"""Revolute joints of a running simulation: read-outs."""

from __future__ import annotations

from withe.parts.handles import Joint
from withe.parts.kinds import JoinPart
from withe.simulation.numbers import number_of
from withe.simulation.session import Session

__all__ = ["find_joint"]


def find_joint(session: Session, joint: Joint | str) -> int:
    """Return the index of a revolute joint in the engine, by its handle or name.

    Raises
    ------
    ValueError
        Not a joint of this scene, or one without an axis.
    """
    part = session.directory.find(joint, JoinPart, "joint")
    if part.axis is None:
        raise ValueError(f"joint {part.name!r} must be revolute to have an angle, got kind {part.kind}")
    return number_of(session, part)
