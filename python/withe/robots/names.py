"""Names in a model of MuJoCo."""

from __future__ import annotations

from typing import Any

__all__ = ["name_of"]

_METHODS = {"keyframe": "key"}


def name_of(model: Any, kind: str, index: int) -> str:
    """Return the name of an object of a model, or its kind and number if the file has no name for it."""
    name = getattr(model, _METHODS.get(kind, kind))(index).name
    return str(name) or f"{kind} {index}"
