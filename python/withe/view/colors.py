"""Colours of rods, by rod or by a quantity along them, and its scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames, edges_to_nodes, stencils_to_nodes
from withe.view import style

__all__ = [
    "BARS",
    "PLANE_COLOR",
    "SOLID_COLOR",
    "ColorBy",
    "body_color",
    "color_limits",
    "linear",
    "nice_limits",
    "nodal_values",
    "rgb",
    "rod_color",
]

FloatArray = npt.NDArray[np.float64]
ColorBy = Literal["rod", "tension", "curvature", "twist", "speed"]

_PALETTE = style.colors("light").cycle
PLANE_COLOR, SOLID_COLOR = "#e3e8ec", "#b4bdc5"
_BODY_COLORS = ("#5c7186", "#8497a9", "#3f5266", "#a3b2c0")
BARS = {
    "tension": ("tension [N]", "viridis"),
    "curvature": ("curvature [1/m]", "viridis"),
    "twist": ("twist [rad/m]", "viridis"),
    "speed": ("speed [m/s]", "viridis"),
}


def rod_color(rod: int) -> FloatArray:
    """Red, green, blue from 0 to 1 of a rod by its number."""
    return rgb(_PALETTE[rod % len(_PALETTE)])


def body_color(body: int) -> FloatArray:
    """Red, green, blue from 0 to 1 of a rigid body by its number: shades of slate, which no rod has."""
    return rgb(_BODY_COLORS[body % len(_BODY_COLORS)])


def rgb(code: str) -> FloatArray:
    """Red, green, blue from 0 to 1 of a code such as "#2a9d8f"."""
    return np.array([int(code[place : place + 2], 16) / 255.0 for place in (1, 3, 5)])


def linear(color: FloatArray) -> FloatArray:
    """Return the linear intensities of a colour of pictures, which is sRGB [IEC 61966-2-1]."""
    return np.asarray(np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4), np.float64)


def nodal_values(record: Frames, rod: Any, color_by: ColorBy) -> FloatArray:
    """The quantity that colours a rod, at its nodes, shape (frames, nodes)."""
    if color_by == "tension":
        return edges_to_nodes(record.tensions(rod), rod.closed)
    if color_by == "twist":
        return stencils_to_nodes(record.twists(rod), rod.closed)
    if color_by == "curvature":
        return stencils_to_nodes(np.linalg.norm(record.curvatures(rod), axis=-1), rod.closed)
    speeds: FloatArray = np.linalg.norm(record.velocities(rod), axis=-1)
    return speeds


def color_limits(values: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the limits of a scale for all values, symmetric about zero if both signs occur, without rounding errors.

    Parameters
    ----------
    values : sequence of ndarray
        Values of each rod.
    """
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    least = 1e-9 * max(-low, high)
    low, high = (0.0 if abs(end) <= least else end for end in (low, high))
    if low < -0.05 * high and high > 0.0:
        return -max(-low, high), max(-low, high)
    return low, high if high > low else low + 1e-12


def nice_limits(low: float, high: float) -> tuple[float, float, int, str]:
    """Return the limits of a scale that begins and ends at round numbers.

    Parameters
    ----------
    low, high : float
        Range that the scale must contain.

    Returns
    -------
    low, high : float
    labels : int
        Number of labels at round numbers, ends included.
    format : str
        Format with the needed digits.
    """
    size = max(abs(low), abs(high), high - low)
    if not (1e-9 * size < high - low and 1e-290 < size < 1e290):
        return low, high, 2, "%.3g"
    unit = 10.0 ** np.floor(np.log10(high - low))
    even = low == -high  # keeps zero in the middle, with a label
    for step in unit * np.array([0.2, 0.25, 0.5, 1.0, 2.0, 2.5]):
        first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
        if last - first <= (4 if even else 5):
            break
    decimals = next((d for d in range(5) if abs(round(step, d) - step) < 1e-6 * step), None)
    greatest = max(abs(first), abs(last)) * step
    plain = decimals is not None and greatest < 1e5
    # From the first digit of the greatest label to the last of a step, which has two where it begins with 2.5.
    significant = max(3, int(np.floor(np.log10(greatest) + 1e-9) - np.floor(np.log10(step) + 1e-9)) + 2)
    form = f"%.{decimals}f" if plain else f"%.{significant}g"
    return float(first * step), float(last * step), int(last - first) + 1, form
