"""Numbers of the parts of a simulation, set and read by their words while it runs."""

from __future__ import annotations

from typing import Any

from withe.common import validation
from withe.parts.contacts import BodyPair, touching
from withe.parts.handles import Body, Handle, Obstacle, Rod
from withe.parts.kinds import RodPart, SupportPart
from withe.simulation.access import Target, get_word, nothing_to_set, set_words, word_of, words_of
from withe.simulation.rods import in_order
from withe.simulation.session import Session

__all__ = ["Settable", "find_target", "get_value", "set_values"]

Settable = Handle | tuple[Rod | Body | Obstacle | str, Rod | Body | Obstacle | str]


def set_values(session: Session, target: Settable | str | None, values: dict[str, Any], over: float = 0.0) -> None:
    """Change parameters; see `Simulation.set`."""
    if not values:
        raise ValueError("set needs at least one parameter, such as youngs_modulus=1e6")
    part = find_target(session, target)
    over = validation.non_negative(over, "over")
    if isinstance(part, RodPart):
        values = in_order(part, values)
    set_words(session, part, values, over)
    if not isinstance(part, SupportPart):  # `move` has noted where it goes
        session.note("set", part, values, over)


def get_value(session: Session, target: Settable | str, word: str | None) -> Any:
    """The present value of a parameter; see `Simulation.get`."""
    if word is None:
        if not isinstance(target, str) or word_of(None, target) is None:
            raise ValueError("get needs a parameter, such as get(arm, 'youngs_modulus')")
        return get_word(session, None, target)
    part = find_target(session, target)
    known = word_of(part, word)
    if part is None or (known is not None and known.is_read):
        return get_word(session, part, word)
    words = [each.name for each in words_of(part) if each.is_read]
    if isinstance(part, BodyPair):
        raise ValueError(f"a pair of bodies has {', '.join(map(repr, words))} only, got {word!r}")
    if not words:
        raise ValueError(nothing_to_set(part))
    raise ValueError(f"{part.name!r} has no {word!r}; {validation.it_has(word, words)}")


def find_target(session: Session, target: Settable | str | None) -> Target:
    """Return the part or the pair of bodies that a user names; None for the scene."""
    if target is None:
        return None
    if not isinstance(target, tuple):
        return session.directory.find_any(target, "target")
    if len(target) != 2:
        raise ValueError(f"target must be a part or a pair of bodies, got {len(target)} bodies")
    return BodyPair(*(touching(session.directory, body) for body in target))
