"""Springs while a simulation runs: what is set, and what is read."""

from __future__ import annotations

from typing import Any

from withe.common.outlines import SpringOutline
from withe.parts.directory import Directory
from withe.parts.kinds import SpringPart
from withe.parts.springs import checked_number
from withe.simulation.session import Session

__all__ = ["set_spring", "spring_outlines", "spring_tension", "spring_value"]


def set_spring(session: Session, part: SpringPart, values: dict[str, Any]) -> None:
    """Change stiffness, rest length or damping, all or none."""
    index = _index(session, part)
    spring = session.world.spring(index)
    for word, value in values.items():
        setattr(spring, word, checked_number(part.name, word, value))
    session.world.set_spring(index, spring)


def spring_value(session: Session, part: SpringPart, word: str) -> float:
    """The present stiffness [N/m], rest_length [m] or damping [N s/m]."""
    return float(getattr(session.world.spring(_index(session, part)), word))


def spring_tension(session: Session, part: SpringPart) -> float:
    """The axial force [N], pulling is positive."""
    return session.world.spring_tension(_index(session, part))


def spring_outlines(directory: Directory) -> list[SpringOutline]:
    """Return the outlines of springs for records."""
    return [
        SpringOutline(part.name, (directory.row(part.nodes[0]), directory.row(part.nodes[1])))
        for part in directory.all(SpringPart)
    ]


def _index(session: Session, part: SpringPart) -> int:
    return session.scene.all(SpringPart).index(part)
