"""Places where a scene can be shown: a window, a notebook, or memory only."""

from __future__ import annotations

import importlib.util
import io
import os
import sys
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.common.user_warnings import warn

__all__ = ["LiveScreen", "Place", "check_display", "has_trame", "in_notebook", "live_screen", "place_to_show"]

Place = Literal["window", "notebook", "memory"]
_NO_DISPLAY = (
    "no display was found, so {what} shows a still picture: its image() returns it. "
    "Use a machine with a display, or a notebook, to {do}"
)
_NO_TRAME = (
    "the package trame is not installed, so {what} shows a still picture in this notebook. "
    'Install it with pip install "pyvista[jupyter]" to {do}'
)


def in_notebook() -> bool:
    """Return True in a Jupyter kernel."""
    try:
        shell = require("IPython", "view").get_ipython()
    except ImportError:
        return False
    return shell is not None and hasattr(shell, "kernel")


def place_to_show(what: str, do: str, *, interactive: bool) -> Place:
    """Return the place where a scene can be shown, with a warning if it cannot be shown as intended.

    Parameters
    ----------
    what : str
        What is shown, for the warning.
    do : str
        What the user cannot do with a still picture.
    interactive : bool
        True if a notebook needs a server that answers the mouse.

    Returns
    -------
    {"window", "notebook", "memory"}
    """
    if in_notebook():
        if interactive and not has_trame():
            warn(_NO_TRAME.format(what=what, do=do))
        return "notebook"
    if require("pyvista", "view").OFF_SCREEN:  # asked for, for example to build documentation
        return "memory"
    if not _has_display():
        warn(_NO_DISPLAY.format(what=what, do=do))
        return "memory"
    return "window"


def has_trame() -> bool:
    """Return True if PyVista can answer the mouse in a notebook."""
    return importlib.util.find_spec("trame") is not None


def _has_display() -> bool:
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def check_display() -> None:
    """Refuse to open a window where none can be opened.

    Raises
    ------
    RuntimeError
        No display was found, and PyVista was not asked to draw off screen.
    """
    if not require("pyvista", "view").OFF_SCREEN and not _has_display():
        raise RuntimeError('no display was found: use picture("a.png") for a picture, or animate("a.mp4") for a film')


class LiveScreen(Protocol):
    """Screen of a scene that changes while the program runs."""

    @property
    def is_closed(self) -> bool:
        """True if the user has closed the screen."""

    def refresh(self) -> None:
        """Show the present scene."""

    def finish(self) -> None:
        """Leave the last scene to the user."""


def live_screen(place: Place, plotter: Any) -> LiveScreen:
    """Return the screen of a plotter, opened."""
    if place == "window":
        return _Window(plotter)
    return _Cell(plotter) if place == "notebook" else _Memory(plotter)


class _Memory:
    """Screen that nobody sees."""

    is_closed = False

    def __init__(self, plotter: Any) -> None:
        self._plotter = plotter

    def refresh(self) -> None:
        self._plotter.render()

    def finish(self) -> None:
        """Nothing to leave."""


class _Window:
    """Window that answers the mouse between two steps of the program."""

    def __init__(self, plotter: Any) -> None:
        self._plotter = plotter
        plotter.show(interactive_update=True, auto_close=False)

    @property
    def is_closed(self) -> bool:
        return self._plotter.render_window is None or bool(self._plotter.iren.interactor.GetDone())

    def refresh(self) -> None:
        self._plotter.update()

    def finish(self) -> None:
        """Wait until the user closes the window."""
        if not self.is_closed:
            self._plotter.iren.start()


class _Cell:
    """Picture in the output of a cell, replaced while the cell runs: a server would answer after the cell only."""

    is_closed = False

    def __init__(self, plotter: Any) -> None:
        self._plotter = plotter
        self._handle = require("IPython.display", "view").display(self._picture(), display_id=True)

    def refresh(self) -> None:
        self._handle.update(self._picture())

    def finish(self) -> None:
        """The last picture stays in the cell."""

    def _picture(self) -> Any:
        self._plotter.render()
        pixels: npt.NDArray[np.uint8] = self._plotter.screenshot(return_img=True)[..., :3]
        data = io.BytesIO()
        require("PIL.Image", "view").fromarray(np.ascontiguousarray(pixels)).save(data, "jpeg", quality=90)
        return require("IPython.display", "view").Image(data.getvalue(), format="jpeg")
