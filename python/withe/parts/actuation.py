"""Actuation over time: values that a simulation sets when their time has come."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.kinds import Actuation

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
    new = Actuation(name, validation.non_negative(at, "at"), validation.non_negative(over, "over"), dict(values))
    directory.actuations = tuple(sorted((*directory.actuations, new), key=lambda each: each.at))
