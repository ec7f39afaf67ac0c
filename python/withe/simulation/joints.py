"""Joints of a running simulation: read-outs."""

from __future__ import annotations

import numpy as np

from withe import _core
from withe.parts.handles import Handle, Joint
from withe.parts.joints import connected, groups, side_of
from withe.parts.kinds import JoinPart, Pass
from withe.simulation.numbers import number_of
from withe.simulation.readouts import Reaction
from withe.simulation.session import Session

__all__ = ["find_joint", "is_joint", "joint_reaction"]


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


def is_joint(session: Session, handle: Handle | str) -> bool:
    """Return True of the handle or the name of a joint."""
    if isinstance(handle, Handle):
        return isinstance(handle, Joint)
    return isinstance(session.directory.parts.get(handle), JoinPart)


def joint_reaction(session: Session, joint: Joint | str) -> Reaction:
    """Return the force and moment of a joint on its second part; see `Simulation.reaction`."""
    part = session.directory.find(joint, JoinPart, "joint")
    joins = session.directory.all(JoinPart)
    number = next(i for i, group in enumerate(groups(joins)) if any(part.nodes[0] in each for each in group.clusters))
    joins_at: dict[Pass, list[JoinPart]] = {}
    for join in joins:
        for node in join.nodes:
            joins_at.setdefault(node, []).append(join)
    at_node = connected(joins_at, part.nodes[0])
    if all(node[0] >= 0 for each in at_node for node in each.nodes):
        raise ValueError(
            f"reaction of joint {part.name!r} is known where a joint has a rigid body, got joined rods: read the "
            "tensions of their edges by tensions(rod)"
        )
    side = side_of(part, at_node)
    if side is None:
        raise ValueError(
            f"reaction of joint {part.name!r} is not determined, because other joints at the node connect the same "
            "parts: remove one of the joints"
        )
    try:
        found = session.world.joint_reaction(number, [_core.RodPass(rod, node) for rod, node in side])
    except ValueError as error:
        raise ValueError(f"reaction of joint {part.name!r} is not known: {error}") from None
    return Reaction(np.array(found.force), np.array(found.moment))
