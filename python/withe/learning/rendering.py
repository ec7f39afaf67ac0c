"""Pictures of the first robot of a batch while it learns, by matplotlib."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.batch import Batch
from withe.common.extras import require
from withe.common.outlines import ObstacleOutline
from withe.common.user_warnings import warn
from withe.simulation.obstacles import obstacle_outlines
from withe.view import style
from withe.view.scenery import patch

__all__ = ["Screen"]

_SIZE = (640, 480)  # [px]
_TICKS = 5
_HALF = 0.5 / 3.0**0.5  # side of a cube over twice its diagonal
_LINES = 13


class Screen:
    """A figure that shows the first robot.

    Parameters
    ----------
    robots : Batch
    draw : callable
        Function of axes and robots that draws the task.
    window : bool
        True for a window, False for pictures.
    """

    def __init__(self, robots: Batch, draw: Callable[[Any, Batch], None], window: bool) -> None:
        self._robots, self._draw = robots, draw
        self._window = window
        self._figure: Any = None

    def picture(self) -> npt.NDArray[np.uint8]:
        """Return a picture of the present state, shape (480, 640, 3)."""
        with style.context():
            self._paint()
            self._figure.canvas.draw()
        return np.array(self._figure.canvas.buffer_rgba())[..., :3]

    def show(self) -> None:
        """Update the window; warn if there is no screen for it."""
        if self._figure is None and str(require("matplotlib", "view").get_backend()).lower() == "agg":
            warn(
                'render_mode="human" shows nothing, because matplotlib has no screen to open a window on: use '
                '"rgb_array"',
                cause="screen",
            )
        with style.context():
            self._paint()
        require("matplotlib.pyplot", "view").pause(1e-3)

    def close(self) -> None:
        """Close the figure."""
        if self._figure is not None and self._window:
            require("matplotlib.pyplot", "view").close(self._figure)
        self._figure = None

    def _paint(self) -> None:
        if self._figure is None:
            size = (_SIZE[0] / 100.0, _SIZE[1] / 100.0)
            if self._window:
                self._figure = require("matplotlib.pyplot", "view").figure(figsize=size, dpi=100, layout="none")
            else:
                self._figure = require("matplotlib.figure", "view").Figure(figsize=size, dpi=100, layout="none")
                require("matplotlib.backends.backend_agg", "view").FigureCanvasAgg(self._figure)
            self._axes = self._figure.add_axes((0.0, 0.07, 0.92, 0.91), projection="3d")
            self._reach = self._extent()
        axes, colors = self._axes, style.colors("light")
        axes.clear()
        simulation = self._robots[0]
        low, high = self._reach
        for axis, bottom, top in zip("xyz", low, high, strict=True):
            axes.set(**{f"{axis}lim": (bottom, top)})
            # More ticks than this run into each other along the axes that go into the picture.
            getattr(axes, f"{axis}axis").get_major_locator().set_params(nbins=_TICKS)
        style.label(axes, x=("x", "m"), y=("y", "m"), z=("z", "m"))
        axes.set_box_aspect(high - low)
        scale = 0.55 * _SIZE[1] * 0.72 / float((high - low).max())  # points a metre, about
        for number, rod in enumerate(simulation.rods):
            x = simulation.positions(rod)
            width = float(np.clip(2.0 * np.mean(simulation.get(rod, "radius")) * scale, 1.5, 40.0))
            axes.plot(*x.T, color=colors.cycle[number % len(colors.cycle)], linewidth=width, solid_capstyle="round")
        self._obstacles(simulation, scale)
        self._draw(axes, self._robots)
        axes.text2D(0.02, 0.95, f"{simulation.time:.2f} s", transform=axes.transAxes)

    def _obstacles(self, simulation: Any, scale: float) -> None:
        for outline in obstacle_outlines(simulation._session.directory):
            start = simulation.obstacle_position(outline.name)
            if outline.kind == "plane":
                self._plane(outline, start)
                continue
            width = float(np.clip(2.0 * outline.radius * scale, 1.5, 80.0))
            look: dict[str, Any] = {"color": style.colors("light").grey, "alpha": 0.45}
            if not outline.axis.any():  # a sphere
                self._axes.plot(*start[:, None], "o", markersize=width, markeredgewidth=0.0, **look)
            else:
                ends = np.array([start, start + outline.axis])
                self._axes.plot(*ends.T, linewidth=width, solid_capstyle="round", **look)

    def _plane(self, outline: ObstacleOutline, place: npt.NDArray[np.float64]) -> None:
        """Draw the part of a plane that lies in the box, if any."""
        low, high = self._reach
        normal = outline.axis / np.linalg.norm(outline.axis)
        if abs(normal @ (0.5 * (low + high) - place)) < 0.5 * float(np.abs(normal) @ (high - low)):
            first, second, _, fourth = patch(outline, place, np.stack([low, high]), _HALF)
            # matplotlib draws surfaces over all lines, whichever is nearer: a filled one would veil the robot.
            for corner, along, across in (
                (first, second - first, fourth - first),
                (first, fourth - first, second - first),
            ):
                for share in np.linspace(0.0, 1.0, _LINES):
                    start = corner + share * across
                    self._axes.plot(
                        *np.stack([start, start + along]).T,
                        color=style.colors("light").grey,
                        alpha=0.5,
                        linewidth=0.8,
                        zorder=1,
                    )

    def _extent(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """A box that the robot stays in, for all it is known: as far as its rods reach from where they are held."""
        simulation = self._robots[0]
        x = simulation.positions()
        length = sum(
            float(np.linalg.norm(np.diff(simulation.positions(rod), axis=0), axis=1).sum()) for rod in simulation.rods
        )
        reach = min(length, 1.2 * float(np.ptp(x, axis=0).max()))
        middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
        half = np.maximum(0.5 * np.ptp(x, axis=0), 0.75 * reach)
        return middle - half, middle + half
