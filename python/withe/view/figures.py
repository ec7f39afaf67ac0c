"""Figures of recorded frames: shapes and energies, by matplotlib, which is imported on first use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.common.frames import Frames
from withe.common.keywords import keyword_hints
from withe.common.outlines import BodyOutline, ObstacleOutline, RodOutline
from withe.view import scenery, style
from withe.view.bodies import body_points, silhouette
from withe.view.tendons import tendon_points

__all__ = ["plot"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
def plot(record: Frames, *, shapes: int = 6, theme: style.Theme = "light") -> Any:
    """Draw the shapes of the rods and rigid bodies at several times, and the energies over time.

    Obstacles near the rods are drawn too: in two dimensions planes as lines, and spheres and capsules as outlines; in
    three dimensions transparent. Moving obstacles, springs and tendons are drawn at the same times as the rods, in the
    same colours.

    Parameters
    ----------
    record : Record
    shapes : int
        Number of times, evenly chosen, with the first and last among them.
    theme : {"light", "dark"}
        Colours of the figure; see `withe.view.style`.

    Returns
    -------
    matplotlib.figure.Figure
        Figure in two dimensions if the motion stays in a coordinate plane, to a twentieth of the thickness of the
        thinnest rod, and bodies turn about its normal; otherwise in three dimensions.

    Raises
    ------
    ValueError
        A record without frames, fewer than one shape, or an unknown theme.
    ImportError
        matplotlib is not installed.

    Examples
    --------
    >>> record.plot(shapes=4).savefig("arm.png")
    """
    if len(record) == 0:
        raise ValueError("record has no frames to plot")
    if int(shapes) != shapes or shapes < 1:
        raise ValueError(f"shapes must be a positive integer, got {shapes!r}")
    pyplot = require("matplotlib.pyplot", "view")
    # Load the backend before rc_context: that of notebooks sets rcParams["interactive"], which rc_context would reset.
    # The notebook would then show no later figure.
    pyplot.draw_if_interactive()
    with style.context(theme) as colors:
        single = len(record) == 1
        figure = pyplot.figure(figsize=(5.5, 4.6) if single else (11.0, 4.6))
        size = np.ptp(_points(record), axis=0)
        share = 0.7 if size[2] > 2.0 * max(size[:2]) else 1.1  # tall shapes need less room
        grid = figure.add_gridspec(1, 1 if single else 2, width_ratios=[1] if single else [share, 1.0])
        axes, around = _plot_shapes(figure, grid[0], record, int(shapes), colors)
        if not single:
            _plot_energies(figure.add_subplot(grid[1]), record, colors)
        if axes.name == "3d":
            style.fill_frame(axes, around)
    if "inline" in pyplot.get_backend():
        pyplot.close(figure)  # a notebook would show it twice, since it also shows the returned figure
    return figure


_UNSEEN = 0.05  # relative to the thickness of a rod
_ENERGY_COLORS = {  # names of colours; energies of one colour differ in their dashes
    "kinetic": "red",
    "stretch": "orange",
    "bend": "green",
    "twist": "purple",
    "gravity": "blue",
    "loads": "sky",
    "contact": "grey",
    "spring": "purple",
    "total": "ink",
}
_LEAST_RANGE = 1e-6  # of the axis of energies, over the largest energy
_DASHED = {"spring": "-.", "total": "--"}


def _plot_shapes(figure: Any, place: Any, record: Frames, count: int, colors: style.Colors) -> tuple[Any, FloatArray]:
    """Return the axes, and the points that they are to contain in three dimensions."""
    normalize = require("matplotlib.colors", "view").Normalize
    cm = require("matplotlib.cm", "view")
    positions, times = record.positions(), record.times
    frames = np.unique(np.linspace(0, len(record) - 1, count).round().astype(int))
    nodes = _points(record)
    size = float(np.ptp(nodes, axis=0).max())
    factor, prefix = _prefix(size, (1.0, 1e-3, 1e-6))
    axes_shown = _plane(positions, _thinnest(record.rods), [record.body_rotation(body) for body in record.bodies])
    three = axes_shown is None
    shown = list(range(3)) if axes_shown is None else axes_shown
    axes = figure.add_subplot(place, projection="3d" if three else None)
    start = times[0] if times[-1] > times[0] else times[-1] - 1.0
    scale = cm.ScalarMappable(normalize(start, times[-1]), style.ramp())
    tendons = [tendon_points(record, tendon) for tendon in record.tendons]
    for frame in frames:
        for rod in record.rods:
            points = positions[frame, rod.rows][:, shown] * factor
            if rod.closed:
                points = np.concatenate([points, points[:1]])
            axes.plot(*points.T, color=scale.to_rgba(times[frame]), linewidth=2.2)
        for spring in record.springs:
            ends = positions[:, list(spring.rows)]
            normal = np.eye(3)[2 if three else 3 - sum(shown)]
            points = scenery.zigzag(ends[frame], scenery.spring_width(ends), normal)
            axes.plot(*(points[:, shown] * factor).T, color=scale.to_rgba(times[frame]), linewidth=0.9)
        for points in tendons:
            axes.plot(*(points[frame][:, shown] * factor).T, color=scale.to_rgba(times[frame]), linewidth=0.9)
    for body in record.bodies:
        poses = body.placed(record.body_position(body)[frames], record.body_rotation(body)[frames])
        still = bool(np.all(poses == poses[0]))
        for points, time in zip(poses[: 1 if still else None], times[frames], strict=False):
            ink = colors.grey if still else scale.to_rgba(time)
            _draw_body(axes, body, points, None if three else shown, factor, ink, colors)
    around = []
    for obstacle in record.obstacles:
        places = record.obstacle_position(obstacle)[frames]
        around.append(scenery.framing(obstacle, places, nodes))
        still = bool(np.all(places == places[0]))
        for place, time in zip(places[: 1 if still else None], times[frames], strict=False):
            ink = colors.grey if still else scale.to_rgba(time)
            if obstacle.kind == "shape":
                _draw_body(axes, obstacle, place + obstacle.vertices, None if three else shown, factor, ink, colors)
            elif three:
                _draw_solid(axes, obstacle, place, np.concatenate([nodes, *around]), factor, ink, colors)
            else:
                _draw_section(axes, obstacle, place, nodes, shown, factor, ink, colors)
    style.label(axes, *(("xyz"[axis], f"{prefix}m") for axis in shown))
    if not three:
        axes.set_aspect("equal", adjustable="datalim")
    if len(frames) > 1:
        bar = figure.colorbar(scale, ax=axes, shrink=0.75, pad=0.03)
        bar.set_label("time [s]")
        bar.outline.set_visible(False)
    return axes, np.concatenate([nodes, *around]) * factor


def _points(record: Frames) -> FloatArray:
    """Nodes in all frames and points on bodies, shape (any, 3) [m]."""
    return np.concatenate([record.positions().reshape(-1, 3), body_points(record)])


def _draw_body(
    axes: Any,
    body: BodyOutline | ObstacleOutline,
    points: FloatArray,
    shown: list[int] | None,
    factor: float,
    ink: Any,
    colors: style.Colors,
) -> None:
    """A body by its silhouette along the coordinate that is not shown; in three dimensions by its shaded surface."""
    if shown is None:
        alpha = 0.6 if isinstance(body, BodyOutline) else 0.15
        axes.plot_trisurf(*(points * factor).T, triangles=body.triangles, color=ink, alpha=alpha, linewidth=0.0)
        return
    towards = np.cross(np.eye(3)[shown[0]], np.eye(3)[shown[1]])
    flat = points[:, shown] * factor
    collections = require("matplotlib.collections", "view")
    faces = collections.PolyCollection(flat[body.triangles], facecolor=colors.pale, edgecolor=colors.pale, zorder=1.6)
    edges = collections.LineCollection(
        flat[silhouette(points, body.triangles, towards)], color=ink, linewidth=1.4, capstyle="round", zorder=1.7
    )
    axes.add_collection(faces)
    axes.add_collection(edges)
    axes.update_datalim(flat)


def _draw_section(
    axes: Any,
    obstacle: ObstacleOutline,
    place: FloatArray,
    nodes: FloatArray,
    shown: list[int],
    factor: float,
    ink: Any,
    colors: style.Colors,
) -> None:
    """An obstacle where it is seen along one coordinate: the line of a plane, the outline of a sphere or capsule."""
    if obstacle.kind == "capsule":
        first, second = (end[shown] * factor for end in scenery.ends(obstacle, place))
        outline = scenery.profile(first, second, obstacle.radius * factor)
        shape = require("matplotlib.patches", "view").Polygon(
            outline, facecolor=colors.pale, edgecolor=ink, linewidth=1.2, zorder=1.5
        )
        axes.add_artist(shape)
        if len(scenery.framing(obstacle, place[None], nodes)):
            axes.update_datalim(outline)
        return
    normal = obstacle.axis[shown]
    if np.linalg.norm(normal) <= 1e-9 * np.linalg.norm(obstacle.axis):
        return  # it faces the reader
    if len(scenery.framing(obstacle, place[None], nodes)):
        foot = nodes[:, shown].mean(axis=0)
        foot = foot - normal * (normal @ (foot - place[shown])) / (normal @ normal)
        # The line has no ends; both points count for the limits, so they are near each other.
        beside = 1e-3 * np.ptp(nodes[:, shown], axis=0).max() * np.array([-normal[1], normal[0]])
        axes.axline(foot * factor, (foot + beside) * factor, color=ink, linewidth=1.6, zorder=1.5)


def _draw_solid(
    axes: Any,
    obstacle: ObstacleOutline,
    place: FloatArray,
    nodes: FloatArray,
    factor: float,
    ink: Any,
    colors: style.Colors,
) -> None:
    """An obstacle in three dimensions, see-through: a patch of a plane, a sphere or a capsule."""
    if not len(scenery.framing(obstacle, place[None], nodes)):
        return
    if obstacle.kind == "plane":
        corners = scenery.patch(obstacle, place, nodes, 0.3)[[0, 1, 3, 2]].reshape(2, 2, 3) * factor
        axes.plot_surface(*np.moveaxis(corners, -1, 0), color=colors.pale, alpha=0.5, shade=False)
        return
    grid = scenery.surface(obstacle, place) * factor
    axes.plot_surface(*np.moveaxis(grid, -1, 0), color=ink, alpha=0.35, linewidth=0.0)


def _plot_energies(axes: Any, record: Frames, colors: style.Colors) -> None:
    energy, times = record.energy(), record.times
    curves = {name: getattr(energy, name) for name in _ENERGY_COLORS}
    # Heights have no zero of their own: gravity counts from the first frame.
    curves["total"] = curves["total"] - energy.gravity[0]
    curves["gravity"] = curves["gravity"] - energy.gravity[0]
    largest = max(float(np.abs(values).max()) for values in curves.values())
    factor, prefix = _prefix(largest, (1.0, 1e-3, 1e-6, 1e-9))
    for name, values in curves.items():
        if name == "total" or np.abs(values).max() > 2e-3 * largest:
            text = "gravity, from the start" if name == "gravity" else name
            color = getattr(colors, _ENERGY_COLORS[name])
            axes.plot(times, values * factor, _DASHED.get(name, "-"), color=color, label=text)
    low, high = axes.get_ylim()
    if high - low < _LEAST_RANGE * largest * factor:  # constant up to rounding, which an axis would magnify
        axes.set_ylim(min(0.0, 1.1 * low), max(0.0, 1.1 * high))
    style.label(axes, x=("time", "s"), y=("energy", f"{prefix}J"))
    axes.margins(x=0.0)
    style.legend(axes, side="top")


def _prefix(largest: float, units: tuple[float, ...]) -> tuple[float, str]:
    """A factor and its prefix that bring the largest value to one or more."""
    prefixes = {1.0: "", 1e-3: "m", 1e-6: "\N{MICRO SIGN}", 1e-9: "n"}
    unit = next((unit for unit in units if largest >= unit), units[-1] if largest > 0.0 else 1.0)
    return 1.0 / unit, prefixes[unit]


def _plane(positions: FloatArray, thickness: float, rotations: Sequence[FloatArray] = ()) -> list[int] | None:
    """Return the two coordinates of a motion in a coordinate plane; None for any other motion.

    Motion out of the plane is ignored if it is far below the thickness of rods: rods on a floor sink in slightly.
    Rotations of bodies, of shape (frames, 3, 3) each, must be about the normal of the plane.
    """
    extents = np.ptp(positions.reshape(-1, 3), axis=0)
    stays = np.full(3, True)
    for turns in rotations:
        since = turns @ turns[0].T
        stays &= np.abs(since - np.eye(3)).max(axis=(0, 1)) <= 1e-6
    flat = (extents <= 1e-6 * extents.max()) & stays
    if flat.any():
        missing = 1 if flat[1] else int(np.flatnonzero(flat)[0])
    elif not stays[extents.argmin()]:
        return None
    elif extents.min() <= _UNSEEN * thickness:
        missing = int(extents.argmin())
    else:
        return None
    return [axis for axis in range(3) if axis != missing]


def _thinnest(rods: Sequence[RodOutline]) -> float:
    """Smallest thickness of any rod [m]."""
    return min((float(rod.radii.min() * 2.0 if rod.widths is None else rod.widths.min()) for rod in rods), default=0.0)
