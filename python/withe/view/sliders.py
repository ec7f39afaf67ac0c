"""A scene with sliders. A model gives the sliders and the scene; this module draws them by PyVista."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.common.frames import Frames
from withe.common.keywords import keyword_hints
from withe.io import written_beside
from withe.view.colors import ColorBy, rgb, rod_color
from withe.view.pinhole import Pinhole
from withe.view.rendering import Stage
from withe.view.screens import has_trame, place_to_show

__all__ = ["Slider", "SliderModel", "SliderView"]

_INK, _BAR = "#33383d", "#9aa3ab"
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.03, 0.25, 0.9, 0.14  # column of the sliders, in shares of the picture
_PITCH = 0.15
_LINES = 85  # of text that fill the picture


@dataclass(frozen=True)
class Slider:
    """A number that can be changed.

    Attributes
    ----------
    title : str
        Name of the number, with its unit.
    low, high : float [unit of the title]
        Range of the number.
    """

    title: str
    low: float
    high: float


class SliderModel(Protocol):
    """Scene that depends on numbers."""

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """Sliders, from top to bottom."""

    @property
    def values(self) -> list[float]:
        """Present value of each slider."""

    @property
    def message(self) -> str:
        """Text about the present scene, empty if all is well."""

    def move(self, slider: int, value: float) -> None:
        """Set the value of a slider, and solve."""

    def present(self) -> Frames:
        """Return the present scene."""

    def extremes(self) -> Frames:
        """Return the scene now, and with each slider at its ends."""


@keyword_hints
class SliderView:
    """A scene with a slider for each number. `Simulation.view` with ``sliders=`` returns it.

    Parameters
    ----------
    model : SliderModel
    size, color_by, camera, ground
        As in `withe.view.picture`. At first the scene at both ends of each slider is in view.
    backend : str, optional
        PyVista's backend in a notebook. By default "server", or "static" without trame.

    Raises
    ------
    ValueError
        An option out of range.
    ImportError
        PyVista is not installed.

    Examples
    --------
    >>> view = simulation.view(sliders=[(cord, "tension", 0, 5)])  # doctest: +SKIP
    >>> view.values  # doctest: +SKIP
    {'tension of cord [N]': 3.2}
    """

    def __init__(
        self,
        model: SliderModel,
        *,
        size: Sequence[int] = (1024, 640),
        color_by: ColorBy = "rod",
        camera: Pinhole | str | npt.ArrayLike | None = None,
        ground: float | None = None,
        backend: str | None = None,
    ) -> None:
        self._model, self._backend = model, backend
        self._place = place_to_show("view(sliders=...)", "move the sliders", interactive=True)
        self._stage = Stage(
            model.extremes(),
            size=size,
            color_by=color_by,
            camera=camera,
            ground=ground,
            off_screen=self._place != "window",
            supersampling=1,
            multisampling=self._place == "window",
            live=True,
            left=_RIGHT,
        )
        self._widgets: list[Any] = []
        for index, slider in enumerate(model.sliders):
            self._widgets.append(self._add(index, slider))
        self._stage.plotter.add_axes(color=_INK, viewport=(0.84, 0.0, 1.0, 0.2))
        self._redraw()

    def _add(self, index: int, slider: Slider) -> Any:
        count = len(self._model.sliders)
        height = _TOP - index * min(_PITCH, (_TOP - _BOTTOM) / max(1, count - 1))
        step = (slider.high - slider.low) / 100.0
        decimals = max(0, min(6, int(np.ceil(-np.log10(step)))))
        widget = self._stage.plotter.add_slider_widget(
            lambda value: self._moved(index, value),
            rng=(slider.low, slider.high),
            value=self._model.values[index],
            title=slider.title,
            color=_INK,
            pointa=(_LEFT, height),
            pointb=(_RIGHT, height),
            interaction_event="always",
            slider_width=0.02,
            tube_width=0.004,
            title_height=0.018,
            fmt=f"%.{decimals}f" if 1e-6 < step < 1e4 else "%.3g",
        )
        look = widget.GetRepresentation()
        look.SetSliderLength(0.012)
        look.SetEndCapLength(0.002)
        look.SetEndCapWidth(0.016)
        look.SetLabelHeight(0.018)
        look.GetSelectedProperty().SetColor(*rod_color(1))
        for line in (look.GetTubeProperty(), look.GetCapProperty()):
            line.SetColor(*rgb(_BAR))
        for text in (look.GetTitleProperty(), look.GetLabelProperty()):
            text.SetBold(False)
            text.SetShadow(False)
        return widget

    def _moved(self, index: int, value: float) -> None:
        """Solve and redraw, when the user moves a slider."""
        if index < len(self._widgets):  # PyVista calls this function once while it adds the widget
            slider = self._model.sliders[index]
            self._model.move(index, float(np.clip(value, slider.low, slider.high)))
            self._redraw()

    def _redraw(self) -> None:
        self._stage.show_present(self._model.present())
        self._stage.label(self._model.message, _LINES)

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """Return the sliders, from top to bottom."""
        return self._model.sliders

    @property
    def values(self) -> dict[str, float]:
        """Return the value of each slider by its title, in the unit of the title, shape () each."""
        titles = (slider.title for slider in self._model.sliders)
        return dict(zip(titles, self._model.values, strict=True))

    @property
    def message(self) -> str:
        """Return the text in the picture: the reason why a scene is not the one of the sliders, or empty."""
        return self._model.message

    def move(self, slider: int | str, value: float) -> None:
        """Move a slider as the mouse does: set, solve and redraw.

        Parameters
        ----------
        slider : int or str
            Number of the slider from the top, or its title.
        value : float [unit of the title]
            Value in the range of the slider.

        Raises
        ------
        ValueError
            No such slider, or a value out of its range.
        """
        titles = [each.title for each in self._model.sliders]
        known = isinstance(slider, str) and slider in titles
        if not known and (isinstance(slider, str) or not 0 <= slider < len(titles)):
            raise ValueError(f"slider must be one of {', '.join(map(repr, titles))} or its number, got {slider!r}")
        index = titles.index(slider) if isinstance(slider, str) else int(slider)
        each, number = self._model.sliders[index], validation.number(value, "value")
        if not each.low <= number <= each.high:
            raise ValueError(f"value of {each.title!r} must lie in {each.low:g}..{each.high:g}, got {number:g}")
        widget = self._widgets[index]
        widget.GetRepresentation().SetValue(number)
        widget.InvokeEvent("InteractionEvent")
        self._stage.plotter.render()

    def image(self) -> npt.NDArray[np.uint8]:
        """Return the present picture.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
        """
        return self._stage.image()

    def picture(self, path: str | os.PathLike[str]) -> Path:
        """Write the present picture into a .png file.

        Parameters
        ----------
        path : str or path
            File to write.

        Returns
        -------
        pathlib.Path
            Path of the file.

        Raises
        ------
        ValueError
            Another suffix.
        ImportError
            matplotlib is not installed.
        OSError
            The picture cannot be written.
        """
        path = validation.file_path(path, ".png")
        with written_beside(path) as temporary:
            require("matplotlib.image", "view").imsave(temporary, self.image())
        return path

    def show(self) -> SliderView:
        """Open the window, and wait until the user closes it. In a notebook and without a display: do nothing.

        Returns
        -------
        SliderView
            This view.
        """
        if self._place == "window":
            self._stage.plotter.show()
        return self

    def close(self) -> None:
        """Close the view."""
        self._stage.close()

    def _ipython_display_(self) -> None:
        """Show the view in the output of a cell; the sliders answer through a server of trame."""
        # The server renders, because sliders of VTK do not answer in the browser.
        server = "server" if has_trame() else "static"
        self._stage.plotter.show(jupyter_backend=self._backend or server)

    def __repr__(self) -> str:
        return f"SliderView({', '.join(f'{title} = {value:.4g}' for title, value in self.values.items())})"
