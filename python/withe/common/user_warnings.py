"""Warnings at the line of the user that caused them, with each cause once if many simulations share it."""

from __future__ import annotations

import sys
import sysconfig
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import FrameType
from typing import Any

__all__ = ["Place", "each_cause_once", "located_at", "user_place", "warn"]

# Files of packages and of the standard library: no user edits them.
_LIBRARIES = tuple(
    {f"{sysconfig.get_path(name)}/" for name in ("stdlib", "platstdlib", "purelib", "platlib")} | {"<frozen "}
)
Cause = tuple[type[Warning], str]

_heard: ContextVar[set[Cause] | None] = ContextVar("heard", default=None)
_place: ContextVar[Place | None] = ContextVar("place", default=None)


@dataclass(frozen=True, eq=False)
class Place:
    """A line of code, in the form of `warnings.warn_explicit`."""

    filename: str
    line: int
    module: str
    registry: dict[Any, Any]


def user_place() -> Place:
    """Return the innermost line outside of withe and of all installed packages, or else outside of withe."""
    frames = list(_frames_outside())
    frame = next((each for each in frames if not each.f_code.co_filename.startswith(_LIBRARIES)), frames[0])
    registry = frame.f_globals.setdefault("__warningregistry__", {})
    return Place(frame.f_code.co_filename, frame.f_lineno, frame.f_globals.get("__name__", "<unknown>"), registry)


def warn(message: str, category: type[Warning] = UserWarning, cause: str = "") -> None:
    """Give a warning at the user's line.

    Parameters
    ----------
    message : str
        Message whose first clause names the problem in at most twelve words.
    category : type of Warning
    cause : str
        Distinguishes warnings of one category: within `each_cause_once` each cause is reported once.
    """
    heard = _heard.get()
    if heard is not None:
        if (category, cause) in heard:
            return
        heard.add((category, cause))
    place = _place.get() or user_place()
    warnings.warn_explicit(message, category, place.filename, place.line, module=place.module, registry=place.registry)


@contextmanager
def each_cause_once(heard: set[Cause]) -> Iterator[None]:
    """Omit the warnings whose cause is in `heard`, and add the causes of the others."""
    token = _heard.set(heard)
    try:
        yield
    finally:
        _heard.reset(token)


@contextmanager
def located_at(place: Place) -> Iterator[None]:
    """Locate warnings at a line. Warnings of a thread are located at the line that started the thread."""
    token = _place.set(place)
    try:
        yield
    finally:
        _place.reset(token)


def _frames_outside() -> Iterator[FrameType]:
    """Frames that are not of withe, from the innermost on."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if frame.f_globals.get("__name__", "").split(".")[0] != "withe":
            yield frame
        frame = frame.f_back
