"""Springs of a running simulation: read-outs."""

from __future__ import annotations

from withe.parts.kinds import SpringPart
from withe.simulation.numbers import number_of
from withe.simulation.session import Session

__all__ = ["spring_tension"]


def spring_tension(session: Session, part: SpringPart) -> float:
    """Return the axial force [N], positive in tension."""
    return session.world.spring_tension(number_of(session, part))
