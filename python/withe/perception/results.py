"""What tracing an image gives."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Ambiguity", "Crossing", "Joint", "Tracing"]

Array = NDArray[np.float64]


@dataclass
class Crossing:
    """One strand over another.

    Attributes
    ----------
    point : ndarray of shape (2,) [px]
    over, under : (int, int)
        Cable and row of its centreline; the same cable twice where it crosses itself.
    confidence : float
        That `over` is over: 0 where nothing is known, as from a mask alone, up to 1.
    """

    point: Array
    over: tuple[int, int]
    under: tuple[int, int]
    confidence: float


@dataclass
class Joint:
    """The end of a cable on the flank of another, half a width from its centreline.

    Attributes
    ----------
    point : ndarray of shape (2,) [px]
        The end.
    end, through : (int, int)
        Cable and row of the cable that ends and of the one that goes on.
    """

    point: Array
    end: tuple[int, int]
    through: tuple[int, int]


@dataclass
class Ambiguity:
    """A place where another reading of the picture is almost as good.

    Attributes
    ----------
    point : ndarray of shape (2,) [px]
    reason : str
    """

    point: Array
    reason: str


@dataclass
class Tracing:
    """Every cable of an image, in order.

    Pixels are x to the right, y downwards; (0, 0) is the centre of the first pixel.

    Attributes
    ----------
    centrelines : list of ndarray of shape (n, 2) [px]
        x, y from end to end, rows at most 2 px apart.
    widths : list of ndarray of shape (n,) [px]
    closed : list of bool
        A ring; its first row is not repeated at the end.
    labels : ndarray of int32, shape (height, width)
        0 is background, cable i has i + 1.
    crossings : list of Crossing
        Every two strands that cross; three cables at one point are three crossings.
    joints : list of Joint
    ambiguous : list of Ambiguity
    timings : dict of str to float [s]
        Time by step.
    """

    centrelines: list[Array] = field(default_factory=list)
    widths: list[Array] = field(default_factory=list)
    closed: list[bool] = field(default_factory=list)
    labels: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 0), np.int32))
    crossings: list[Crossing] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    ambiguous: list[Ambiguity] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.centrelines)

    def __repr__(self) -> str:
        return f"<Tracing: {len(self)} cables, {len(self.crossings)} crossings, {len(self.joints)} joints>"
