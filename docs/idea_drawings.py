"""Draw the pictures of the page "The ideas" into docs/static/ideas: python docs/idea_drawings.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

FOLDER = Path(__file__).parent / "static" / "ideas"
ROD, FIRST, SECOND, GREY = "#0072b2", "#d55e00", "#009e73", "#808080"  # of Okabe and Ito; grey reads on white and black
plt.rcParams |= {"svg.fonttype": "path", "svg.hashsalt": "withe", "font.size": 11, "text.color": GREY}


def canvas(width: float, height: float) -> tuple[Any, Any]:
    """Return a figure and axes of equal scales without a frame, which show 0 to width and 0 to height."""
    figure, axes = plt.subplots(figsize=(width, height))
    figure.subplots_adjust(0, 0, 1, 1)
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axes.axis("off")
    return figure, axes


def save(figure: Any, name: str) -> None:
    """Write a figure without a date, so that equal drawings are equal files."""
    figure.savefig(FOLDER / f"{name}.svg", transparent=True, metadata={"Date": None, "Creator": None})
    plt.close(figure)


def arrow(axes: Any, start: Any, way: Any, color: str, label: str = "", aside: Any = (0.08, 0.08)) -> None:
    """Draw an arrow with a label at its tip."""
    start, way = np.asarray(start, float), np.asarray(way, float)
    axes.annotate(
        "", start + way, start, arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    )
    axes.text(*(start + way + aside), label, color=color, ha="center", va="center", fontweight="bold")


def rod(axes: Any, points: Any, nodes: bool = True, color: str = ROD) -> None:
    """Draw a rod through points."""
    x, y = np.asarray(points, float).T
    axes.plot(x, y, color=color, lw=4, solid_capstyle="round", zorder=2)
    if nodes:
        axes.plot(x, y, "o", color=color, mec="white", mew=1.2, ms=9, zorder=3)


def out_of_page(axes: Any, point: Any, color: str, label: str, into: bool = False) -> None:
    """Draw a direction towards the reader (a dot), or away from the reader (a cross)."""
    x, y = point
    axes.plot(x, y, "o", ms=13, mfc="none", mec=color, mew=1.8, zorder=5)
    axes.plot(x, y, "x" if into else ".", color=color, ms=8 if into else 7, mew=1.8, zorder=5)
    axes.text(x + 0.2, y - 0.17, label, color=color, ha="center", va="center", fontweight="bold")


def directors() -> None:
    """Draw a rod with nodes, edges and the directors of one edge."""
    figure, axes = canvas(6.4, 2.2)
    rod(axes, [(0.6, 0.7), (2.1, 0.9), (3.7, 0.9), (5.2, 0.7)])
    middle = np.array([2.9, 0.9])
    arrow(axes, middle, (0, 0.85), FIRST, "d1", (0.22, -0.05))
    arrow(axes, middle, (0.62, 0), GREY, "t", (0.0, 0.17))
    out_of_page(axes, middle, SECOND, "d2")
    axes.text(0.6, 0.36, "node", ha="center")
    axes.text(1.35, 0.5, "edge", ha="center")
    axes.text(3.5, 1.6, "d1 x d2 = t, d2 points to the reader", ha="left", fontsize=9.5)
    save(figure, "directors")


def natural_curvature() -> None:
    """Draw the bend by the first component, seen along -d2, and by the second, seen along d1."""
    figure, axes = canvas(7.4, 2.6)
    for left, color, other, title, into in (
        (0.5, FIRST, SECOND, "natural_curvature=(5, 0)", False),
        (4.2, SECOND, FIRST, "natural_curvature=(0, 5)", True),
    ):
        start = np.array([left, 0.7])
        angle = np.linspace(0.0, 0.95, 8)
        bent = start + 2.5 * np.stack([np.sin(angle), 1.0 - np.cos(angle)], axis=1)
        axes.plot([left, left + 2.4], [0.7, 0.7], color=GREY, lw=2, ls=(0, (2, 2)), zorder=1)
        rod(axes, bent, nodes=False)
        axes.plot([left, left], [0.42, 0.98], color=GREY, lw=4)
        arrow(axes, start, (0, 1.0), color, "d1" if color == FIRST else "d2", (0.2, -0.02))
        out_of_page(axes, start, other, "d2" if other == SECOND else "d1", into)
        axes.text(left + 1.3, 0.2, title, ha="center", family="monospace", fontsize=9.5)
    save(figure, "natural_curvature")


def joints() -> None:
    """Draw the three kinds of joints, each drawn and after a load."""
    figure, axes = canvas(7.4, 2.3)
    for left, kind, turn, note in (
        (0.3, '"rigid"', 0.0, "the angle stays"),
        (2.8, '"pinned"', -0.7, "turns freely"),
        (5.2, '"revolute"', -0.7, "turns about an axis"),
    ):
        corner = np.array([left + 0.9, 1.35])
        rod(axes, [(left, 1.35), corner], nodes=False)
        if turn:
            rod(axes, [corner, corner + 0.85 * np.array([np.cos(0.6), np.sin(0.6)])], nodes=False, color="#9fc5df")
        way = 0.85 * np.array([np.cos(0.6 + turn), np.sin(0.6 + turn)])
        rod(axes, [corner, corner + way], nodes=False, color=FIRST)
        if kind == '"rigid"':
            axes.plot(*corner, "s", color=GREY, ms=10, zorder=4)
        elif kind == '"pinned"':
            axes.plot(*corner, "o", color="white", mec=GREY, mew=2.2, ms=11, zorder=4)
        else:
            axes.plot(*corner, "o", color=GREY, mec="white", mew=1.5, ms=12, zorder=4)
            axes.plot(
                [corner[0] - 0.28, corner[0] + 0.28],
                [corner[1] + 0.5, corner[1] - 0.5],
                color=GREY,
                lw=1.4,
                ls=(0, (4, 2)),
            )
        axes.text(left + 0.9, 0.6, kind, ha="center", family="monospace", fontsize=9.5)
        axes.text(left + 0.9, 0.28, note, ha="center", fontsize=9.5)
    save(figure, "joints")


def supports() -> None:
    """Draw a pin, a clamp, a hand and a ring."""
    figure, axes = canvas(7.4, 2.2)
    s = np.linspace(0, 1, 20)
    for left, name, note in (
        (0.2, "pin", "holds a position"),
        (2.0, "clamp", "and the direction"),
        (3.8, "grasp", "holds a length"),
        (5.6, "grasp(slides=True)", "a ring: the rod slides"),
    ):
        y = 1.35
        if name == "pin":
            rod(axes, np.stack([left + 0.2 + 1.1 * s, y - 0.5 * s - 0.12 * s * (1 - s)], axis=1), nodes=False)
            axes.plot(left + 0.2, y, "o", color="white", mec=GREY, mew=2.2, ms=11, zorder=4)
        elif name == "clamp":
            rod(axes, np.stack([left + 0.2 + 1.1 * s, y - 0.45 * s**2], axis=1), nodes=False)
            axes.fill_between([left + 0.02, left + 0.2], y - 0.3, y + 0.3, color=GREY, lw=0)
        else:
            rod(axes, np.stack([left + 0.1 + 1.3 * s, y - 0.9 * (s - 0.5) ** 2], axis=1), nodes=False)
            middle = left + 0.75
            if name == "grasp":
                for side in (-1, 1):
                    axes.plot(
                        [middle - 0.2, middle + 0.2], [y + 0.13 * side] * 2, color=FIRST, lw=5, solid_capstyle="round"
                    )
            else:
                axes.plot(middle, y, "o", ms=24, mfc="none", mec=FIRST, mew=3, zorder=4)
        axes.text(left + 0.75, 0.55, name, ha="center", family="monospace", fontsize=9.5)
        axes.text(left + 0.75, 0.25, note, ha="center", fontsize=9.5)
    save(figure, "supports")


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    directors()
    natural_curvature()
    joints()
    supports()
