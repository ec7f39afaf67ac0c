"""Words that set values of other words: the order in which they are set, and the values on which each then acts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from withe.parts.contacts import BodyPair
from withe.parts.kinds import DragPart, Part, RodPart
from withe.parts.parameters import MADE_OF, ROD_WORDS
from withe.simulation.session import Session
from withe.simulation.surroundings import dragged_rods
from withe.simulation.unknowns import INITIAL_WORDS, Array, Remaining, Unknown, part_of

__all__ = ["OF_DRAGS", "arrays_of", "made_by", "order_of_setting", "remaining", "setting_rank"]

OF_DRAGS = "drag of drags"  # makes a rod's drag where add_drag's handles do


def made_by(session: Session, part: Part | BodyPair | None, word: str) -> dict[Array, set[str]]:
    """Arrays of rods that a word of a rod or a drag recomputes, each with the words that determine it."""
    if isinstance(part, RodPart) and word in ROD_WORDS:
        return {(part.name, array): words for array, words in MADE_OF.get(word, {word: {word}}).items()}
    if isinstance(part, DragPart):
        return {(rod.name, "drag"): {OF_DRAGS} for rod in dragged_rods(session, part)}
    return {}


def arrays_of(session: Session, unknown: Unknown) -> dict[Array, set[str]]:
    """Return `made_by` of one of `wrt`."""
    return {} if isinstance(unknown, str) else made_by(session, part_of(session, unknown[0]), unknown[1])


def setting_rank(session: Session, unknown: Unknown) -> tuple[int, int]:
    """Rank of an unknown. Unknowns are set in the order of rank, so that none overwrites one that was set before it.

    A drag comes before the rods whose drag it determines. The words of a rod have the order in which one call of `set`
    sets them. Positions come before velocities.
    """
    if isinstance(unknown, str):
        return 0, INITIAL_WORDS.index(unknown) if unknown in INITIAL_WORDS else 0
    if isinstance(part_of(session, unknown[0]), DragPart):
        return 0, 0
    return 1, ROD_WORDS.index(unknown[1]) if unknown[1] in ROD_WORDS else 0


def order_of_setting(session: Session, unknowns: Sequence[Unknown]) -> list[int]:
    """Return the places of the unknowns in the order of rank.

    Raises
    ------
    ValueError
        Two unknowns name the same word of the same part.
    """
    seen = set()
    for target, word in (unknown for unknown in unknowns if not isinstance(unknown, str)):
        key = part_of(session, target).name, word
        if key in seen:
            raise ValueError(f"{word!r} of {key[0]!r} is given twice")
        seen.add(key)
    return sorted(range(len(unknowns)), key=lambda place: setting_rank(session, unknowns[place]))


def remaining(session: Session, unknowns: Sequence[Unknown]) -> list[Any]:
    """Return unknowns for derivatives after all are set: `Remaining` for unknowns that another partly overwrites."""
    own = [arrays_of(session, unknown) for unknown in unknowns]
    made: dict[Array, set[str]] = {}
    for place in order_of_setting(session, unknowns):
        made |= own[place]
    found: list[Any] = []
    for unknown, mine in zip(unknowns, own, strict=True):
        kept = frozenset(array for array in mine if _word(session, unknown) in made[array])
        found.append(unknown if len(kept) == len(mine) else Remaining(unknown, kept))
    return found


def _word(session: Session, unknown: Unknown) -> str:
    """Return the name of the word in `made_by`."""
    return OF_DRAGS if isinstance(part_of(session, unknown[0]), DragPart) else unknown[1]
