"""Style of all plots: colours for the colour-blind, units, legends beside curves, 3D axes that fill their frame.

`use` sets the style for a script, `context` for a block of code. Both return the colours of the theme, "light" or
"dark". matplotlib is imported on first use. The colours of curves are those of Okabe and Ito (2008), "Color Universal
Design".

Examples
--------
>>> from withe.view import style
>>> colors = style.use()  # doctest: +SKIP
>>> figure, axes = plt.subplots()  # doctest: +SKIP
>>> axes.plot(record.times, 1e3 * record.positions(arm)[:, -1, 2], label="tip")  # doctest: +SKIP
>>> style.label(axes, x=("time", "s"), y=("height", "mm"))  # doctest: +SKIP
>>> style.legend(axes)  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require

__all__ = ["Colors", "Theme", "colors", "context", "fill_frame", "label", "legend", "ramp", "use"]

FloatArray = npt.NDArray[np.float64]
Theme = Literal["light", "dark"]
Quantity = str | tuple[str, str]
_ROUNDS = 6  # of the fit of a box to its frame; each halves the remaining error at least
_EDGE = 3.0  # kept free around a box [pt]


@dataclass(frozen=True)
class Colors:
    """Colours of a theme, as codes such as "#0072b2". Made by `use`, `context` and `colors`.

    Attributes
    ----------
    blue, red, green, orange, purple, sky, yellow : str
        Colours of curves.
    ink, grey, pale, paper : str
        Text and the most important curves; axes and references; areas and grids; background.
    """

    blue: str
    red: str
    green: str
    orange: str
    purple: str
    sky: str
    yellow: str
    ink: str
    grey: str
    pale: str
    paper: str

    @property
    def cycle(self) -> tuple[str, ...]:
        """Colours of curves, in their order in a plot."""
        return self.blue, self.red, self.green, self.orange, self.purple, self.sky, self.grey


_COLORS: dict[str, Colors] = {
    "light": Colors(
        blue="#0072b2",
        red="#d55e00",
        green="#009e73",
        orange="#e69f00",
        purple="#cc79a7",
        sky="#56b4e9",
        yellow="#f0e442",
        ink="#22282d",
        grey="#687077",
        pale="#e4e8eb",
        paper="#ffffff",
    ),
    "dark": Colors(
        blue="#4aa3df",
        red="#f0843c",
        green="#2fc79a",
        orange="#f2b632",
        purple="#dd94bc",
        sky="#9bd6f7",
        yellow="#f0e442",
        ink="#e8ecef",
        grey="#828b93",
        pale="#343b42",
        paper="#16191d",
    ),
}


def colors(theme: Theme | None = None) -> Colors:
    """Return the colours of a theme, by default of the theme in use.

    Parameters
    ----------
    theme : {"light", "dark"}, optional

    Returns
    -------
    Colors

    Raises
    ------
    ValueError
        Unknown theme.
    ImportError
        matplotlib is not installed, and no theme is given.
    """
    if theme is None:
        theme = (
            "dark" if require("matplotlib", "view").rcParams["figure.facecolor"] == _COLORS["dark"].paper else "light"
        )
    return _COLORS[validation.choice(theme, "theme", ("light", "dark"))]


def use(theme: Theme = "light") -> Colors:
    """Set the style for all later figures of the program.

    Parameters
    ----------
    theme : {"light", "dark"}

    Returns
    -------
    Colors
        Colours of the theme.

    Raises
    ------
    ValueError
        Unknown theme.
    ImportError
        matplotlib is not installed.

    Examples
    --------
    >>> colors = withe.view.style.use("dark")  # doctest: +SKIP
    """
    found = colors(theme)
    require("matplotlib", "view").rcParams.update(_settings(found))
    return found


@contextmanager
def context(theme: Theme = "light") -> Iterator[Colors]:
    """Set the style for figures that the body creates.

    Parameters
    ----------
    theme : {"light", "dark"}

    Yields
    ------
    Colors
        Colours of the theme.

    Raises
    ------
    ValueError
        Unknown theme.
    ImportError
        matplotlib is not installed.

    Examples
    --------
    >>> with withe.view.style.context() as colors:  # doctest: +SKIP
    ...     figure = simulation.plot()
    """
    found = colors(theme)
    with require("matplotlib", "view").rc_context(_settings(found)):
        yield found


def _settings(found: Colors) -> dict[str, Any]:
    """Return the settings of matplotlib for a theme."""
    ticks = {f"{axis}tick.{word}": found.grey for axis in "xy" for word in ("color", "labelcolor")}
    return {
        **ticks,
        "axes.axisbelow": True,
        "axes.edgecolor": found.grey,
        "axes.facecolor": found.paper,
        "axes.grid": True,
        "axes.labelcolor": found.ink,
        "axes.labelsize": 10.0,
        "axes.prop_cycle": require("matplotlib", "view").cycler(color=found.cycle),
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlelocation": "left",
        "axes.titlesize": 10.5,
        "axes.titleweight": "normal",
        "figure.constrained_layout.use": True,
        "figure.constrained_layout.h_pad": 0.08,
        "figure.constrained_layout.w_pad": 0.08,
        "figure.edgecolor": found.paper,
        "figure.facecolor": found.paper,
        "font.size": 10.0,
        "grid.color": found.pale,
        "grid.linewidth": 0.8,
        "image.cmap": "cividis",
        "legend.fontsize": 9.0,
        "legend.frameon": False,
        "legend.handlelength": 1.7,
        "lines.linewidth": 1.8,
        "lines.markersize": 5.0,
        "lines.solid_capstyle": "round",
        "savefig.dpi": 150.0,
        "text.color": found.ink,
        "xtick.labelsize": 9.0,
        "ytick.labelsize": 9.0,
    }


def ramp(theme: Theme | None = None) -> Any:
    """Return a colormap from early to late: late values stand out from the background most.

    Parameters
    ----------
    theme : {"light", "dark"}, optional
        By default the theme in use.

    Returns
    -------
    matplotlib.colors.Colormap
        Its lightness is monotonic, so that all readers see the order.

    Raises
    ------
    ValueError
        Unknown theme.
    ImportError
        matplotlib is not installed.
    """
    shares = np.linspace(0.3, 1.0, 64) if colors(theme) is _COLORS["light"] else np.linspace(0.85, 0.1, 64)
    shades = require("matplotlib", "view").colormaps["YlGnBu"](shares)
    return require("matplotlib.colors", "view").LinearSegmentedColormap.from_list("early to late", shades)


def label(axes: Any, x: Quantity | None = None, y: Quantity | None = None, z: Quantity | None = None) -> None:
    """Label axes with quantity and unit, such as "time [s]".

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    x, y, z : (str, str) or str, optional
        Quantity and unit; a text without unit for a number. Axes without a value keep their labels.

    Examples
    --------
    >>> withe.view.style.label(axes, x=("time", "s"), y="turns")  # doctest: +SKIP
    """
    for name, quantity in (("x", x), ("y", y), ("z", z)):
        if quantity is not None:
            text = quantity if isinstance(quantity, str) else "{} [{}]".format(*quantity)
            getattr(axes, f"set_{name}label")(text)


def legend(axes: Any, side: Literal["right", "top"] = "right", **options: Any) -> Any:
    """Add a legend beside the curves: to the right of the axes, or in rows above them and below their title.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Set its title before. The legend of 3D axes is above them always.
    side : {"right", "top"}
    **options
        Options of `matplotlib.axes.Axes.legend`, such as `ncols` of a legend above the axes, by default 3.

    Returns
    -------
    matplotlib.legend.Legend

    Raises
    ------
    ValueError
        Unknown side.
    """
    if validation.choice(side, "side", ("right", "top")) == "right" and axes.name != "3d":
        return axes.legend(**{"loc": "upper left", "bbox_to_anchor": (1.02, 1.0), "borderaxespad": 0.0, **options})
    _move_title(axes)
    columns = options.pop("ncols", 3)
    found = axes.legend(
        **{
            "loc": "lower left",
            "bbox_to_anchor": (0.0, 1.0),
            "borderaxespad": 0.3,
            "borderpad": 0.1,
            "columnspacing": 1.2,
            "ncols": columns,
            **options,
        }
    )
    if axes.get_title(loc="left"):
        axes.figure.draw_without_rendering()
        height = found.get_window_extent().height * 72.0 / axes.figure.dpi
        axes.set_title(axes.get_title(loc="left"), loc="left", pad=height + 6.0)
    return found


def _move_title(axes: Any) -> None:
    """Move the title of 3D axes, which matplotlib sets in their middle, to the left as that of all other axes."""
    if axes.name == "3d" and (text := axes.get_title()):
        axes.set_title("", loc="center")
        axes.set_title(text, loc="left")


def fill_frame(axes: Any, points: npt.ArrayLike) -> None:
    """Make 3D axes fill their frame, with equal scales and few ticks.

    Call this last for each figure: the layout of the figure is fixed afterwards.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.axes3d.Axes3D
    points : array_like of shape (..., 3)
        Points that the axes must contain, in the units of the axes.

    Raises
    ------
    ImportError
        matplotlib is not installed.
    """
    _box(axes, np.asarray(points, float).reshape(-1, 3))
    _move_title(axes)
    figure, page = axes.figure, axes.figure.bbox
    axes.set_anchor("N")
    axes.set_axis_off()  # the labels are within the frame in the end, so the layout needs no room for them
    figure.draw_without_rendering()
    axes.set_axis_on()
    figure.set_layout_engine("none")
    for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.texts):
        artist.set_clip_on(False)  # the frame is wider than the square that matplotlib clips to
    edge = _EDGE * figure.dpi / 72.0
    place = axes.get_position(original=True)
    low = np.array([place.x0 * page.width + edge, place.y0 * page.height + edge])
    high = np.array([place.x1 * page.width - edge, place.y1 * page.height - edge])
    width = float(np.ptp(axes.viewLim.intervalx))
    for rounds in range(_ROUNDS):
        _set_pads(axes, width / float(np.ptp(axes.viewLim.intervalx)))
        first, last = _drawn(axes)
        scale = float(np.min((high - low) / (last - first)))
        if rounds == _ROUNDS - 1:
            scale = min(scale, 1.0)
        _look_at(axes, 0.5 * (first + last), 0.5 * (low + high), scale)


def _look_at(axes: Any, seen: FloatArray, wanted: FloatArray, scale: float) -> None:
    """Change the window of 3D axes so that a place [px] comes to another one, and everything is larger."""
    inverse = axes.transData.inverted()
    square = axes.get_window_extent()
    middle = np.array([0.5 * (square.x0 + square.x1), 0.5 * (square.y0 + square.y1)])
    centre = inverse.transform(seen + (middle - wanted) / scale)
    for name, value in zip(("intervalx", "intervaly"), centre, strict=True):
        half = 0.5 * np.ptp(getattr(axes.viewLim, name)) / scale
        setattr(axes.viewLim, name, (value - half, value + half))


def _drawn(axes: Any) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the part of a figure that a box and its labels take [px]."""
    axes.figure.draw_without_rendering()
    renderer = axes.figure.canvas.get_renderer()
    corners = np.array(np.meshgrid(axes.get_xlim(), axes.get_ylim(), axes.get_zlim())).reshape(3, -1)
    transform = require("mpl_toolkits.mplot3d.proj3d", "view").proj_transform
    flat = np.array(transform(*corners, axes.get_proj())[:2]).T
    boxes = [axes.transData.transform(flat)]
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        box = axis.get_tightbbox(renderer)
        if box is not None:
            boxes.append(np.array([box.min, box.max]))
    found = np.concatenate(boxes)
    return found.min(axis=0), found.max(axis=0)


def _box(axes: Any, points: FloatArray) -> None:
    """Set three axes of equal scale around all points, with few ticks if there is little space."""
    size = np.ptp(points, axis=0)
    spans = np.maximum(1.05 * size, 0.1 * size.max())
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes.set_box_aspect(tuple(spans))  # changes an array in its place
    for axis, centre, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), middle, spans, strict=True):
        axis.set_view_interval(centre - 0.5 * span, centre + 0.5 * span, ignore=True)
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.set_ticks(_ticks(centre - 0.5 * span, centre + 0.5 * span, max(1, round(4.0 * span / spans.max()))))


def _set_pads(axes: Any, zoom: float) -> None:
    """Set the distances of labels from their axes, which do not grow with the box."""
    spans = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), spans, strict=True):
        # matplotlib measures these distances, and its own 8 and 21 points, by the spans of the other two axes.
        others = spans.max() / np.sqrt(0.5 * (spans @ spans - span**2)) / zoom
        axis.set_tick_params(pad=8.0 * others - 8.0)
        axis.labelpad = 20.0 * others - 21.0


def _ticks(low: float, high: float, count: int) -> list[float]:
    """Return round numbers, not near both ends, where their labels would overlap those of the next axis."""
    ticker = require("matplotlib.ticker", "view")
    room = 0.1 * (high - low)
    for wanted in range(count, count + 6):
        ticks = [float(t) for t in ticker.MaxNLocator(wanted).tick_values(low, high) if low + room <= t <= high - room]
        if len(ticks) >= min(2, count):
            break
    return ticks[len(ticks) // 2 :][:1] if count == 1 else ticks
