"""Setting, reading and differentiating the words of each kind of part during a simulation.

Kinds of parts with one number per part in the engine need no row here: see `withe.simulation.numbers`. The table
`withe.parts.table` lists the words of each kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from withe.common.validation import it_has
from withe.parts.contacts import BodyPair
from withe.parts.kinds import (
    DragPart,
    FluidPart,
    JoinPart,
    LoadPart,
    MassPart,
    ObstaclePart,
    Part,
    RodPart,
    SupportPart,
)
from withe.parts.table import KINDS, PAIR_WORDS, SCENE_WORDS, kind_of
from withe.parts.words import PartKind, Word
from withe.simulation import hands, loads, numbers, rods, surfaces, surroundings
from withe.simulation.readers import Reader
from withe.simulation.session import Session

__all__ = ["Target", "get_word", "nothing_to_set", "owner_of", "reader_of", "set_words", "word_of", "words_of"]

Target = Part | BodyPair | None
"""A part, two bodies, or the scene."""
Shape = tuple[int, ...]


@dataclass(frozen=True)
class _Access:
    set: Callable[[Session, Any, dict[str, Any], float], None]
    get: Callable[[Session, Any, str], Any]
    reader: Callable[[Session, Any, str, Shape | None], Reader]


def _at_once(
    change: Callable[[Session, Any, dict[str, Any]], None],
) -> Callable[[Session, Any, dict[str, Any], float], None]:
    return lambda session, part, values, over: change(session, part, values)


def _whatever_shape(
    reader: Callable[[Session, Any, str], Reader],
) -> Callable[[Session, Any, str, Shape | None], Reader]:
    return lambda session, part, word, shape: reader(session, part, word)


_NUMBERS = _Access(numbers.set_numbers, numbers.number_value, _whatever_shape(numbers.number_reader))
_ACCESS: dict[type[Any], _Access] = {
    **{kind.part: _NUMBERS for kind in KINDS if kind.numbers is not None},
    RodPart: _Access(rods.set_rod, rods.rod_value, _whatever_shape(rods.rod_reader)),
    LoadPart: _Access(_at_once(loads.set_load), loads.load_value, _whatever_shape(loads.load_reader)),
    MassPart: _Access(
        _at_once(surroundings.set_mass), surroundings.mass_value, _whatever_shape(surroundings.mass_reader)
    ),
    DragPart: _Access(
        _at_once(surroundings.set_drag), surroundings.drag_value, _whatever_shape(surroundings.drag_reader)
    ),
    FluidPart: _Access(
        _at_once(surroundings.set_fluid), surroundings.fluid_value, _whatever_shape(surroundings.fluid_reader)
    ),
    SupportPart: _Access(hands.set_support, hands.support_value, _whatever_shape(hands.support_reader)),
    ObstaclePart: _Access(_at_once(surfaces.set_obstacle), surfaces.obstacle_value, surfaces.obstacle_reader),
    BodyPair: _Access(_at_once(surfaces.set_pair), surfaces.pair_value, surfaces.pair_reader),
    type(None): _Access(_at_once(surfaces.set_scene), surfaces.scene_value, surfaces.scene_reader),
}


def words_of(target: Target) -> Iterable[Word]:
    """Words of a part, of two bodies or of the scene."""
    if target is None:
        return SCENE_WORDS
    return PAIR_WORDS if isinstance(target, BodyPair) else kind_of(target).words_of(target)


def word_of(target: Target, name: str) -> Word | None:
    """A word by its name; None where the target does not have it."""
    return next((word for word in words_of(target) if word.name == name), None)


def owner_of(target: Target) -> str:
    """Return the name of a target in errors."""
    if target is None:
        return "the scene"
    if isinstance(target, BodyPair):
        return "a pair of bodies"
    noun = target.kind if isinstance(target, LoadPart) else kind_of(target).noun
    return f"{noun} {target.name!r}"


def set_words(session: Session, target: Target, values: dict[str, Any], over: float) -> None:
    """Change values of a target, all or none, over a duration [s].

    Raises
    ------
    ValueError
        A word that the target does not have, one that is not ramped with `over`, or a value out of range.
    """
    known = {word.name: word for word in words_of(target) if word.is_set}
    names = list(known)
    if not names and isinstance(target, Part):
        raise ValueError(nothing_to_set(target))
    for word in values:
        if word not in names:
            raise ValueError(f"{owner_of(target)} has no {word!r} to set; {it_has(word, names)}")
        if over > 0.0 and not known[word].is_ramped:
            ramped = ", ".join(name for name, each in known.items() if each.is_ramped) or "none"
            raise ValueError(f"{word} of {owner_of(target)} must be set without over=; words with over= are {ramped}")
    _ACCESS[type(target)].set(session, target, values, over)


def get_word(session: Session, target: Target, word: str) -> Any:
    """The present value of a word of a target that has it."""
    known = word_of(target, word)
    if known is not None and known.measure is not None:
        return known.measure(target, lambda rod: np.array(session.world.directors(rod)).reshape(-1, 3, 3))
    return _ACCESS[type(target)].get(session, target, word)


def reader_of(session: Session, target: Target, word: str, shape: Shape | None = None) -> Reader:
    """Return the reader of the derivative by a word, shaped like `get` or like a given value.

    Raises
    ------
    ValueError
        The word has no gradient.
    """
    if isinstance(target, RodPart):
        return rods.rod_reader(session, target, word)  # it also knows "points", and lists all words
    known = word_of(target, word)
    if known is None or not known.has_gradient:
        name = owner_of(target) if target is None else repr(target.name)
        raise ValueError(f"no gradient with respect to {word!r} of {name} is available")
    return _ACCESS[type(target)].reader(session, target, word, shape)


def nothing_to_set(part: Part) -> str:
    """Return a hint how to drive a part without parameters."""
    if isinstance(part, JoinPart):
        first, second = part.node_names
        return (
            f"joint {part.name!r} is {part.kind} and has nothing to set: only revolute joints have a motor, a spring "
            f"and a damper. To drive the joint, add opposite moments, scene.add_moment({first}, ...) and "
            f"scene.add_moment({second}, ...), and change them by set(load, moment=...). Or actuate a rod beside it by "
            "set(rod, natural_curvature=...), or clamp its node and move the clamp"
        )
    kinds = ", ".join(f"{kind.plural} ({_listed(kind)})" for kind in KINDS if kind.words)
    scene = ", ".join(word.name for word in SCENE_WORDS)
    return f"{part.name!r} has nothing to set. set takes {kinds}, and None for the scene ({scene})"


def _listed(kind: PartKind) -> str:
    if kind.part is RodPart:
        return "youngs_modulus, natural_curvature, ..."
    return ", ".join(word.name for word in kind.words if word.is_set)
