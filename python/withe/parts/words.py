"""Row of a kind of part in the table of parts, and its words; see `withe.parts.table`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.outlines import SpringOutline, TendonOutline
from withe.parts.handles import Handle
from withe.parts.kinds import Part, Pass
from withe.parts.plausibility import check_angle

__all__ = ["DirectorsOf", "Outline", "PartKind", "RowOf", "Word", "angle", "limit"]

Check = Callable[[Any, str], Any]
RowOf = Callable[[Pass], int]
DirectorsOf = Callable[[int], npt.NDArray[np.float64]]
Outline = SpringOutline | TendonOutline


def _every(part: Any) -> bool:
    return True


@dataclass(frozen=True)
class Word:
    """A word of `Simulation.set` and `get`.

    Attributes
    ----------
    name, unit : str
    check : callable or None
        Returns the value that is set, from what was given and what errors call it; None: the kind checks its own.
    of : callable
        True of parts of the kind that have the word.
    is_set, is_read : bool
        True if `set` changes it, and `get` returns it.
    has_gradient : bool
        True if gradients by it are known.
    has_one_side : bool
        True if there is no derivative where it is zero.
    is_linear : bool
        True if forces in equilibrium are linear in it.
    is_ramped : bool
        True if ``set(..., over=)`` leads it evenly to its value.
    is_positive : bool
        True if it is looked for as a logarithm when a model is fitted.
    measure : callable or None
        Value of a word that is read out and not set, as a function of the part and of a function that returns the
        directors of a rod, of shape (edges, 3, 3).
    """

    name: str
    unit: str
    check: Check | None = None
    of: Callable[[Any], bool] = _every
    is_set: bool = True
    is_read: bool = True
    has_gradient: bool = True
    has_one_side: bool = False
    is_linear: bool = False
    is_ramped: bool = False
    is_positive: bool = False
    measure: Callable[[Any, DirectorsOf], Any] | None = None


@dataclass(frozen=True)
class PartKind:
    """A kind of part.

    Attributes
    ----------
    part, handle : type
    noun, plural : str
        What errors call one of them, and several.
    words : tuple of Word
    numbers : str or None
        Of kinds that have one number a part for each word: the engine's parameter is ``f"{numbers}_{word}"``.
    outline : callable or None
        What records and pictures keep of a part besides the motion of rods, by the part and a function that returns
        the row of a node.
    described : (str, callable) or None
        Attribute of `_core.SceneDescription` that lists the parts, and the function that describes one of them.
    """

    part: type[Part]
    handle: type[Handle]
    noun: str
    plural: str
    words: tuple[Word, ...] = ()
    numbers: str | None = None
    outline: Callable[[Any, RowOf], Outline] | None = None
    described: tuple[str, Callable[[Any], Any]] | None = None

    def words_of(self, part: Part) -> Iterator[Word]:
        """Words that a part of this kind has."""
        return (word for word in self.words if word.of(part))

    def find(self, part: Part, name: str) -> Word | None:
        """The word of that name, if the part has it."""
        return next((word for word in self.words_of(part) if word.name == name), None)


def angle(value: Any, what: str) -> float:
    """A finite angle [rad], with a warning where it looks like degrees."""
    number = validation.number(value, what)
    check_angle(number, what)
    return number


def limit(value: Any, what: str) -> float:
    """A positive number; infinity is no limit."""
    if isinstance(value, float | np.floating) and value == np.inf:
        return np.inf
    return validation.positive(value, what)
