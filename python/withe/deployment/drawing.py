"""Figures of planned patterns by matplotlib, which is imported on first use."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.deployment.feasibility import Feasibility
from withe.deployment.pattern import Pattern
from withe.view import style

__all__ = ["draw_plan"]

FloatArray = npt.NDArray[np.float64]
_MOST_SHOWN = 2.0  # coefficients of friction, by colours
_MOST_DRAWN = 3.3  # by lines: a little above the greatest friction that plans accept


def draw_plan(pattern: Pattern, jaw: FloatArray, found: Feasibility, title: str) -> Any:
    """Draw `LayPlan.plot`; `jaw` are the positions of the jaw, shape (n, 3) [m]."""
    pyplot = require("matplotlib.pyplot", "view")
    with style.context() as colors:
        figure, (floor, needs) = pyplot.subplots(1, 2, figsize=(11.0, 5.2))
        _draw_floor(figure, floor, pattern, jaw, found, colors)
        _draw_needs(needs, found, title, colors)
    return figure


def _draw_floor(
    figure: Any, axes: Any, pattern: Pattern, jaw: FloatArray, found: Feasibility, colors: style.Colors
) -> None:
    collections = require("matplotlib.collections", "view")
    axes.plot(1e3 * jaw[:, 0], 1e3 * jaw[:, 1], color=colors.grey, lw=1.0, label="jaw, seen from above")
    axes.plot(
        1e3 * pattern.raw[:, 0],
        1e3 * pattern.raw[:, 1],
        color=colors.ink,
        lw=1.0,
        ls=":",
        zorder=3,
        label="given pattern",
    )
    points = 1e3 * pattern.points
    lines = collections.LineCollection(
        np.stack([points[:-1], points[1:]], 1),
        array=np.minimum(found.needed[:-1], _MOST_SHOWN),
        cmap="cividis",
        lw=4.0,
        clim=(0.0, min(_MOST_SHOWN, max(found.friction, float(found.needed.max())))),
        capstyle="round",
    )
    axes.add_collection(lines)
    axes.plot(*points[0], "o", color=colors.ink, ms=6, label="free end")
    axes.set(title="pattern", aspect="equal")
    style.label(axes, x=("x", "mm"), y=("y", "mm"))
    axes.margins(0.08)
    figure.colorbar(lines, ax=axes, label="needed coefficient of friction", location="bottom", aspect=40)
    style.legend(axes, side="top")


def _draw_needs(axes: Any, found: Feasibility, title: str, colors: style.Colors) -> None:
    s = 1e3 * found.arc_length
    for name, needed in (("floor", found.floor), ("lift-off", found.lift_off), ("free end", found.free_end)):
        axes.plot(s, needed, label=name, lw=1.5)
    axes.axhline(found.friction, color=colors.ink, ls="--", lw=1.0, label="available")
    for slip in found.slips:
        axes.axvspan(1e3 * slip.start, 1e3 * slip.end, color=colors.red, alpha=0.15, lw=0)
    most = float(np.max(np.maximum(found.floor, found.lift_off)))
    top = max(1.3 * found.friction, min(_MOST_DRAWN, 1.1 * most))
    cut = f", up to {top:.1f}" if most > top else ""
    axes.set(title=title, ylim=(0.0, top), xlim=(0.0, s[-1]))
    style.label(axes, x=("arc length from the free end", "mm"), y=f"needed coefficient of friction{cut}")
    style.legend(axes, side="top", ncols=4)
