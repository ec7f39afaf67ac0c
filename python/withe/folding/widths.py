"""Widths of sheets along their length, for sheets without uniform width."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from withe._core import SheetWidth
from withe.folding.paper import Paper

__all__ = ["EVEN", "Width", "free_width"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Width:
    """Width of a sheet over the distance from its tip, in straight pieces, constant beyond the last place.

    Bending stiffness and weight per length are proportional to the width.

    Attributes
    ----------
    places : tuple of float [Lgb]
        Distances from the tip, which begin at 0 and grow.
    widths : tuple of float
    """

    places: tuple[float, ...] = (0.0,)
    widths: tuple[float, ...] = (1.0,)

    @property
    def even(self) -> bool:
        """Return True if the width is 1 everywhere."""
        return all(width == 1.0 for width in self.widths)

    @cached_property
    def engine(self) -> SheetWidth:
        """Return the width for the engine."""
        return SheetWidth() if self.even else SheetWidth(list(self.places), list(self.widths))

    def __getstate__(self) -> dict[str, object]:
        """Return the state without data for the engine, which files and copies do not contain."""
        return {"places": self.places, "widths": self.widths}

    def weight(self, place: FloatArray | float) -> FloatArray:
        """Return the weight of the part from the tip to places [w Lgb]."""
        if self.even:
            return np.asarray(place, dtype=float)
        places, widths = np.array(self.places), np.array(self.widths)
        sums = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(places) * (widths[1:] + widths[:-1]))])
        piece = np.clip(np.searchsorted(places, place, side="right") - 1, 0, len(places) - 1)
        return np.asarray(
            sums[piece] + 0.5 * (place - places[piece]) * (widths[piece] + np.interp(place, places, widths))
        )

    def lying(self, lifted: FloatArray, length: float) -> FloatArray:
        """Weight of the lying part of a sheet of some length, for a suspended length [w Lgb]."""
        return np.asarray(self.weight(length) - self.weight(lifted))

    def of_other(self, factor: float) -> Width:
        """Return the width of the same sheet if Lgb grows by a factor."""
        return self if self.even else Width(tuple(place / factor for place in self.places), self.widths)


EVEN = Width()


def free_width(paper: Paper, depth: float) -> Width:
    """Width of the part of a paper that hangs freely from a jaw, relative to the width of the paper."""
    if paper.is_strip:
        return EVEN  # one object serves strips of every length
    lgb = paper.gravito_bending_length
    shares, widths = np.array(paper.outline).T
    beyond = shares * paper.length > depth
    places = np.append(0.0, (shares[beyond] * paper.length - depth) / lgb)
    return Width(tuple(places.tolist()), (float(paper.width_at(depth)) / paper.width, *widths[beyond].tolist()))
