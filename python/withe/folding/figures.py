"""Pictures of plans: side views of the sheet at some of its poses, from the exact equilibria."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.folding.widths import Width
from withe.view import style

__all__ = ["draw_fold", "side_view"]

FloatArray = npt.NDArray[np.float64]
_STEPS = 400


def side_view(forces: FloatArray, length: float, width: Width) -> FloatArray:
    """Points of a sheet from its far end to the jaw's inner edge, of shape (points, 2), x and z in Lgb.

    `forces` are R, H and the suspended length of one equilibrium. The integration is a fourth-order Runge-Kutta method.
    """
    normal, tangential, suspended = forces
    places, lifted = suspended - np.linspace(0.0, suspended, 2 * _STEPS + 1), float(width.weight(suspended))
    weights, widths = lifted - width.weight(places), np.interp(places, width.places, width.widths)

    def slope(place: int, y: FloatArray) -> FloatArray:  # places are half steps apart
        sine, cosine = np.sin(y[0]), np.cos(y[0])
        moment = (normal - weights[place]) * cosine - tangential * sine
        return np.array([0.5 * y[1] / widths[place], moment, cosine, sine])

    states = [np.zeros(4)]
    h = suspended / _STEPS
    for i in range(_STEPS):
        s, y = 2 * i, states[-1]
        a = slope(s, y)
        b = slope(s + 1, y + h / 2 * a)
        c = slope(s + 1, y + h / 2 * b)
        d = slope(s + 2, y + h * c)
        states.append(y + h / 6 * (a + 2 * b + 2 * c + d))
    hanging = np.array(states)[:, 2:]
    points = np.stack([suspended - hanging[:, 0], hanging[:, 1]], axis=1)
    return np.concatenate([[[length, 0.0]], points])


def draw_fold(
    axes: Any, sheets: list[FloatArray], outer: FloatArray, way: FloatArray, table: tuple[float, float]
) -> None:
    """Draw sheets (points in m) in the order of time, the held part of each as a bar, and the path of the edge."""
    colors, shades = style.colors(), style.ramp()(np.linspace(0.0, 1.0, len(sheets)))
    axes.plot(table, (0, 0), color=colors.pale, linewidth=5, zorder=0, solid_capstyle="butt")
    axes.plot(way[:, 0], way[:, 1], color=colors.red, linewidth=1, linestyle=":", label="path of the edge")
    for points, edge, shade in zip(sheets, outer, shades, strict=True):
        axes.plot(points[:, 0], points[:, 1], color=shade, linewidth=1.5)
        axes.plot([points[-1, 0], edge[0]], [points[-1, 1], edge[1]], color=colors.ink, linewidth=2.5)
    axes.set_aspect("equal")
    style.label(axes, x=("x", "m"), y=("z", "m"))
    style.legend(axes, side="top", loc="lower right", bbox_to_anchor=(1.0, 1.0))  # beside a title
