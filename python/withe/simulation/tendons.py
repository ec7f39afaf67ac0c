"""Read-outs of tendons."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.parts.kinds import TendonPart
from withe.simulation.numbers import number_of
from withe.simulation.session import Session

__all__ = ["tendon_length", "tendon_points"]

FloatArray = npt.NDArray[np.float64]


def tendon_length(session: Session, part: TendonPart) -> float:
    """From its first guide to its last [m]."""
    return session.world.tendon_length(number_of(session, part))


def tendon_points(session: Session, part: TendonPart) -> FloatArray:
    """Return the positions of the guides, shape (guides, 3) [m]."""
    return np.array(session.world.tendon_points(number_of(session, part)))
