"""Quality of a mask: whether its shapes are those of cables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["MaskQuality", "measure_quality"]

Array = NDArray[np.float64]

# Bounds for masks of cables. The 99 labelled photographs of the benchmark reach 0.1, 0, 0 and 0.53; masks made of
# drawn cables 0.08, 0.11, 0 and 0.51. Tiles, keyboards, printed text and gravel exceed at least one of the bounds.
_GREATEST_COVER = 0.3
_GREATEST_UNEXPLAINED = 0.15
_GREATEST_SHORT = 0.3
_GREATEST_SPREAD = 0.7
_SHORT_LENGTH = 10.0  # a cable is short below this length over width
_FEW_SHORT = 3  # so many short cables may lie in any picture
_FEW_WIDTHS = 6  # widths of so many cables may differ


@dataclass(frozen=True)
class MaskQuality:
    """Measures that tell a mask of cables from a mask of something else. The masks of cables have small values.

    Attributes
    ----------
    cover : float [-]
        Share of the picture that is in the mask, from 0 to 1.
    unexplained : float [-]
        Share of the mask that belongs to no cable, from 0 to 1. Specks of single pixels do not count.
    short : float [-]
        Share of the cables that are shorter than ten widths, from 0 to 1.
    width_spread : float [-]
        Difference of the 90 % and 10 % quantiles of the widths over their median.
    reasons : tuple of str
        Reasons why the mask is poor; empty for a good mask.
    """

    cover: float
    unexplained: float
    short: float
    width_spread: float
    reasons: tuple[str, ...] = ()

    @property
    def is_good(self) -> bool:
        """Return True if the mask looks like cables."""
        return not self.reasons


def measure_quality(
    cover: float, labelled: float, centrelines: Sequence[Array], widths: Sequence[Array]
) -> MaskQuality:
    """Return the quality of a mask from what was traced in it.

    Parameters
    ----------
    cover, labelled : float
        Share of the picture in the mask, and share of the mask in cables.
    centrelines : sequence of ndarray of shape (n, 2) [px]
    widths : sequence of ndarray of shape (n,) [px]
    """
    lengths = np.array([np.hypot(*np.diff(line, axis=0).T).sum() for line in centrelines])
    middle = np.array([np.median(rows) for rows in widths])
    is_short = lengths < _SHORT_LENGTH * middle
    short = float(is_short.mean()) if len(lengths) else 0.0
    spread = 0.0
    if len(lengths):
        low, median, high = np.percentile(np.concatenate(list(widths)), [10, 50, 90])
        spread = float((high - low) / max(median, 1e-9))
    reasons = []
    if cover > _GREATEST_COVER:
        reasons.append(f"it covers {100 * cover:.0f} % of the picture")
    if 1.0 - labelled > _GREATEST_UNEXPLAINED:
        reasons.append(f"{100 * (1.0 - labelled):.0f} % of it belongs to no cable")
    if short > _GREATEST_SHORT and is_short.sum() >= _FEW_SHORT:
        reasons.append(f"{is_short.sum()} of {len(lengths)} cables are shorter than {_SHORT_LENGTH:.0f} widths")
    if spread > _GREATEST_SPREAD and len(lengths) > _FEW_WIDTHS:
        reasons.append(f"the widths of {len(lengths)} cables differ by {100 * spread:.0f} %")
    return MaskQuality(cover, 1.0 - labelled, short, spread, tuple(reasons))
