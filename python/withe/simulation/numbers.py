"""Parameters with one number per part in the engine: set, read and differentiated by the table of parts alone."""

from __future__ import annotations

from typing import Any

from withe.parts.joints import revolute_joints
from withe.parts.kinds import JoinPart, Part
from withe.parts.table import checked, kind_of
from withe.simulation.readers import Reader
from withe.simulation.session import Session

__all__ = ["number_of", "number_reader", "number_value", "parameter_of", "set_numbers"]


def set_numbers(session: Session, part: Part, values: dict[str, Any], over: float) -> None:
    """Change numbers of a part, all or none, over a duration [s]."""
    settings = {parameter_of(part, word): checked(type(part), word, value, part.name) for word, value in values.items()}
    session.world.set(number_of(session, part), settings, over)


def number_value(session: Session, part: Part, word: str) -> float:
    """Return the present value of a number."""
    return float(session.world.parameter(parameter_of(part, word), number_of(session, part))[0, 0])


def number_reader(session: Session, part: Part, word: str) -> Reader:
    """Return the reader of the derivative by a number."""
    index, name = number_of(session, part), parameter_of(part, word)
    return lambda g: float(getattr(g.parameters, name)[index])


def number_of(session: Session, part: Part) -> int:
    """Return the index of a part among the parts of its kind in the engine."""
    if isinstance(part, JoinPart):
        return revolute_joints(session.scene.all(JoinPart)).index(part)
    return session.scene.all(type(part)).index(part)


def parameter_of(part: Part, word: str) -> str:
    """Return the name of a number in the engine."""
    return f"{kind_of(part).numbers}_{word}"
