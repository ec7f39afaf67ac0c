"""Springs while a simulation runs: what is read."""

from __future__ import annotations

from withe.parts.kinds import SpringPart
from withe.simulation.numbers import number_of
from withe.simulation.session import Session

__all__ = ["spring_tension"]


def spring_tension(session: Session, part: SpringPart) -> float:
    """The axial force [N], pulling is positive."""
    return session.world.spring_tension(number_of(session, part))
