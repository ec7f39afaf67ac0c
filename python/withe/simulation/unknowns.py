"""Parameters of gradients, in the words of `set` and `get`, and their readers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from withe import _core
from withe.parts.contacts import BodyPair, Toucher, touching
from withe.parts.handles import Handle, NodeHandle
from withe.parts.kinds import Part, RodPart
from withe.parts.table import SCENE_WORDS
from withe.simulation.access import reader_of, word_of
from withe.simulation.readers import OfRun, Reader
from withe.simulation.rods import edges_of, rod_reader
from withe.simulation.session import Session

__all__ = [
    "INITIAL_WORDS",
    "Array",
    "Remaining",
    "Unknown",
    "check_list",
    "is_points",
    "part_of",
    "unknown_reader",
    "unknown_readers",
]

Unknown = tuple[Handle | str | tuple[Toucher, Toucher], str] | str
"""Parameter of a gradient: a part and a word of `set`, two bodies and "friction", or a word of the scene."""


Array = tuple[str, str]
"""Name of a rod, and of one of its parameters in the engine."""


@dataclass(frozen=True)
class Remaining:
    """A word of a rod or a drag that acts only through some arrays, because other words have set the others."""

    unknown: Unknown
    arrays: frozenset[Array]


INITIAL_WORDS = ("initial_positions", "initial_velocities")


def unknown_readers(session: Session, wrt: Sequence[Unknown]) -> list[Reader]:
    """Return readers for `wrt`, which take derivatives, in the shape of `get`, from results of the engine."""
    check_list(wrt)
    return [unknown_reader(session, unknown) for unknown in wrt]


def check_list(wrt: Sequence[Unknown], *, may_be_empty: bool = False) -> None:
    """Refuse an empty list, or an object that is not a list."""
    if isinstance(wrt, str) or not isinstance(wrt, Sequence) or not (wrt or may_be_empty):
        raise ValueError('wrt must be a list of parameters, such as [(arm, "youngs_modulus"), "gravity"]')


def is_points(unknown: Unknown) -> bool:
    """Return True if the parameter is the drawn nodes of a rod."""
    return isinstance(unknown, tuple) and len(unknown) == 2 and isinstance(unknown[1], str) and unknown[1] == "points"


def unknown_reader(session: Session, unknown: Unknown | Remaining) -> Reader:
    """Return the reader of the derivative by one of `wrt`."""
    if isinstance(unknown, Remaining):
        return _remaining_reader(session, unknown)
    if isinstance(unknown, str):
        return _scene_reader(session, unknown)
    if not isinstance(unknown, tuple) or len(unknown) != 2 or not isinstance(unknown[1], str):
        raise ValueError(f"wrt must hold pairs of a part and a parameter, or parameters of the scene, got {unknown!r}")
    target, word = unknown
    if isinstance(target, NodeHandle):
        raise ValueError(f"wrt must name a part, got the node {target.name}: name the support at the node, or the rod")
    return reader_of(session, part_of(session, target), word)


def part_of(session: Session, target: Any) -> Part | BodyPair:
    """Return the part, or pair of bodies, that `wrt` names."""
    if isinstance(target, tuple):
        if len(target) != 2:
            raise ValueError(f"wrt must name two bodies by a pair, got {target!r}")
        return BodyPair(*(touching(session.directory, body) for body in target))
    return session.directory.find_any(target, "wrt")


def _remaining_reader(session: Session, remaining: Remaining) -> Reader:
    part, word = part_of(session, remaining.unknown[0]), remaining.unknown[1]
    if isinstance(part, RodPart):
        return rod_reader(session, part, word, {array for _, array in remaining.arrays})
    rods = {rod for rod, _ in remaining.arrays}
    dragged = [edges_of(session, rod.index) for rod in session.directory.all(RodPart) if rod.name in rods]
    return lambda g: float(sum(g.parameters.drag[first:last].sum() for first, last in dragged))


def _scene_reader(session: Session, word: str) -> Reader:
    """Return the reader of the derivative by a parameter of the scene."""
    if word in INITIAL_WORDS:
        return _refuse_start(word)
    known = word_of(None, word)
    if known is None or not known.has_gradient:
        words = ", ".join((*(each.name for each in SCENE_WORDS if each.has_gradient), *INITIAL_WORDS))
        raise ValueError(f"wrt must hold {words}, or pairs of a part and a parameter, got {word!r}")
    return reader_of(session, None, word)


def _refuse_start(word: str) -> Reader:
    def refuse(gradient: _core.EquilibriumGradient | OfRun) -> Any:
        raise ValueError(f"{word} is a parameter of runs, not of equilibria")

    return refuse
