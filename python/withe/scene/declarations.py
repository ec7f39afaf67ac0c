"""Declarations: the calls that described a scene, as values, from which a scene file is written."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeVar

import numpy as np

from withe.parts.handles import Handle

__all__ = ["Declaration", "declares"]

T = TypeVar("T", bound=type)


@dataclass(frozen=True, eq=False)
class Declaration:
    """One call of a method of a scene.

    Attributes
    ----------
    method : str
        Name of the method, such as "add_rod".
    arguments : mapping of str to object
        Arguments that the user gave, by name. Handles are replaced by their names.
    names : tuple of str
        Names of the parts that the call added.
    """

    method: str
    arguments: Mapping[str, Any]
    names: tuple[str, ...]


def declares(*methods: str) -> Callable[[T], T]:
    """Make methods of a class append their successful calls to the list `_declarations` of the object.

    Parameters
    ----------
    *methods : str
        Names of the methods, which may be inherited.
    """

    def decorate(scene: T) -> T:
        for name in methods:
            setattr(scene, name, _declaring(getattr(scene, name), name))
        return scene

    return decorate


def _declaring(method: Callable[..., Any], name: str) -> Any:
    signature = inspect.signature(method)

    @wraps(method)
    def call(self: Any, *arguments: Any, **keywords: Any) -> Any:
        # Before the call: an iterator can be read once only.
        arguments = tuple(map(_listed, arguments))
        keywords = {word: _listed(value) for word, value in keywords.items()}
        result = method(self, *arguments, **keywords)
        bound = dict(signature.bind(self, *arguments, **keywords).arguments)
        del bound["self"]
        bound |= bound.pop("values", {})  # words of `actuate`
        given = {word: _kept(value) for word, value in bound.items()}
        self._declarations.append(Declaration(name, given, tuple(_names(result))))
        return result

    return call


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, Iterator) else value


def _kept(value: Any) -> Any:
    """Return a value that later changes of the user's objects do not affect."""
    if isinstance(value, Handle):
        return value.name
    if isinstance(value, list | tuple):
        return type(value)(map(_kept, value)) if type(value) in (list, tuple) else value
    return value.copy() if isinstance(value, np.ndarray) else value


def _names(result: Any) -> Iterator[str]:
    for part in result if isinstance(result, tuple) else (result,):
        if isinstance(part, Handle):
            yield part.name
