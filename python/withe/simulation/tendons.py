"""Tendons while a simulation runs: what is set, and what is read."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common.outlines import TendonOutline
from withe.parts.directory import Directory
from withe.parts.kinds import TendonPart
from withe.parts.tendons import checked_tension, outline_of
from withe.simulation.session import Session

__all__ = ["set_tendon", "tendon_index", "tendon_length", "tendon_outlines", "tendon_points", "tendon_tension"]

FloatArray = npt.NDArray[np.float64]


def set_tendon(session: Session, part: TendonPart, tension: float) -> None:
    """Change the tension [N]."""
    tensions = session.world.parameter("tendon_tension")
    tensions[tendon_index(session, part)] = checked_tension(part.name, tension)
    session.world.set(0, {"tendon_tension": tensions})


def tendon_tension(session: Session, part: TendonPart) -> float:
    """The present tension [N]."""
    return float(session.world.parameter("tendon_tension")[tendon_index(session, part), 0])


def tendon_index(session: Session, part: TendonPart) -> int:
    """The engine's number of a tendon."""
    return session.scene.all(TendonPart).index(part)


def tendon_length(session: Session, part: TendonPart) -> float:
    """From its first guide to its last [m]."""
    return session.world.tendon_length(tendon_index(session, part))


def tendon_points(session: Session, part: TendonPart) -> FloatArray:
    """Return the positions of the guides, shape (guides, 3) [m]."""
    return np.array(session.world.tendon_points(tendon_index(session, part)))


def tendon_outlines(directory: Directory) -> list[TendonOutline]:
    """Return the outlines of tendons for records."""
    return [outline_of(part) for part in directory.all(TendonPart)]
