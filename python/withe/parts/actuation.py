"""Actuation over time: values that a simulation sets when their time has come."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.kinds import Actuation, Part
from withe.parts.table import kind_of

__all__ = ["add_actuation"]


def add_actuation(directory: Directory, target: Any, at: float, over: float, values: Mapping[str, Any]) -> None:
    """Add an actuation to a scene, in the order of time; see `Scene.actuate`."""
    if not values:
        raise ValueError("actuate needs at least one parameter, such as natural_curvature=(0, 10)")
    name: str | tuple[str, str] | None = None
    if isinstance(target, tuple | list):
        if len(target) != 2:
            raise ValueError(f"target of the actuation must be a part or a pair of bodies, got {len(target)} bodies")
        first, second = (directory.find_any(body, "target of the actuation").name for body in target)
        name = first, second
    elif target is not None:
        name = directory.find_any(target, "target of the actuation").name
    if isinstance(name, str):
        for word, value in values.items():
            _check_word(directory.parts[name], word, value, over)
    new = Actuation(name, validation.non_negative(at, "at"), validation.non_negative(over, "over"), dict(values))
    directory.actuations = tuple(sorted((*directory.actuations, new), key=lambda each: each.at))


def _check_word(part: Part, word: str, value: Any, over: float) -> None:
    """Refuse a parameter that the part does not have, or one that `over` does not ramp; see `Scene.actuate`."""
    kind = kind_of(part)
    found = kind.find(part, word)
    owner = f"{kind.noun} {part.name!r}"
    if found is None or not found.is_set:
        known = [each.name for each in kind.words_of(part) if each.is_set]
        hint = validation.meant(word, known, f"it has {', '.join(known) or 'none'}")
        raise ValueError(f"{owner} has no {word!r} to set; {hint}")
    if over > 0.0 and not found.is_ramped:
        raise ValueError(f"over must be 0 for {word} of {owner}, which has no ramp")
    if found.check is not None and not callable(value):
        found.check(value, f"{word} of {owner}")
