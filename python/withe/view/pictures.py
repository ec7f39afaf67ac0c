"""Pictures, films and a viewer of recorded frames, by PyVista, which is imported on first use."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.common.frames import Frames
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.io import written_beside
from withe.view.colors import ColorBy
from withe.view.films import Film, film_places
from withe.view.pinhole import Pinhole
from withe.view.rendering import Stage, fine_supersampling
from withe.view.screens import check_display, in_notebook

__all__ = ["animate", "picture", "view"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
def picture(
    record: Frames,
    path: str | os.PathLike[str],
    *,
    frame: int = -1,
    ghosts: Sequence[int] = (),
    size: Sequence[int] = (1280, 960),
    color_by: ColorBy = "rod",
    camera: Pinhole | str | npt.ArrayLike | None = None,
    ground: float | None = None,
    label: str | None = None,
) -> Path:
    """Render one frame into a .png file: rods as tubes, rigid bodies, planes, spheres and capsules.

    A plane is drawn around the rods, and fades into the background. Objects that are far away, or much larger than the
    rods, do not move the camera.

    Parameters
    ----------
    record : Record
    path : path
        File to write, ending in .png.
    frame : int
        Index of the frame; negative numbers count from the last one.
    ghosts : sequence of int
        Other frames, drawn faintly where rods differ from `frame` by more than a tenth of their radius. Each is
        behind the next one, and all are behind `frame`.
    size : pair of int [px]
    color_by : {"rod", "tension", "curvature", "twist", "speed"}
        One colour per rod, or the quantity with its scale, which is the same for all frames.
    camera : str, array_like of shape (3,) or Camera, optional
        Direction of view: "front", "side", "top", "oblique" or a vector. By default along the normal of a planar
        motion, and oblique otherwise. Or a `withe.perception.Camera` without distortion, whose picture has the given
        `size`. Pixels then agree with its `project`, and its `to_plane` converts them to metres.
    ground : float, optional [m]
        Height of a level floor, on which shadows fall. By default that of a level plane near the rods; without such a
        plane there is neither a floor nor a shadow.
    label : str, optional
        Text in the lower left corner.

    Returns
    -------
    pathlib.Path
        The written file.

    Raises
    ------
    ValueError
        A record without frames, a missing frame, another suffix, or an option out of range.
    ImportError
        PyVista is not installed.
    RuntimeError
        Rendering is not possible here; the message names the package to install.
    OSError
        The picture cannot be written.
    """
    path = validation.file_path(path, ".png")
    number = _frame(record, frame)
    others = [_frame(record, ghost) for ghost in ghosts]
    stage = Stage(
        record,
        size=size,
        color_by=color_by,
        camera=camera,
        ground=ground,
        frame=number,
        frames=[*others, number],
        ghosts=others,
        supersampling=fine_supersampling(size),
    )
    try:
        if label:
            stage.label(label)
        pyplot_image = require("matplotlib.image", "view")
        with written_beside(path) as temporary:
            pyplot_image.imsave(temporary, stage.image(), pil_kwargs={"optimize": True})
    finally:
        stage.close()
    return path


@keyword_hints
def animate(
    record: Frames,
    path: str | os.PathLike[str],
    *,
    fps: float | None = None,
    speed: float = 1.0,
    size: Sequence[int] = (1280, 720),
    color_by: ColorBy = "rod",
    camera: Pinhole | str | npt.ArrayLike | None = None,
    ground: float | None = None,
    quality: Literal["draft", "high"] = "draft",
    progress: bool = True,
) -> Path:
    """Render a film: rods as tubes, rigid bodies, planes, spheres and capsules in motion.

    Parameters
    ----------
    record : Record
    path : path
        File to write, ending in .mp4 or .gif.
    fps : float, optional [1/s]
        Pictures per second of film; 30 for .mp4, 20 for .gif. The rods are interpolated between two frames of the
        record.
    speed : float [-]
        Seconds of the simulation shown in one second of film.
    size, color_by, camera, ground
        As in `picture`. The camera stands still, with all frames in view.
    quality : {"draft", "high"}
        "high" smooths edges as `picture` does, and takes about 1.5 times as long.
    progress : bool
        True to show a progress bar, as in `Simulation.run`.

    Returns
    -------
    pathlib.Path
        The written file.

    Raises
    ------
    ValueError
        A record without frames, another suffix, or an option out of range.
    ImportError
        PyVista or imageio-ffmpeg is not installed.
    RuntimeError
        Rendering is not possible here, or ffmpeg fails, for example on a full disk. The message gives the reason, and
        the previous content of the file is kept.
    OSError
        The film cannot be written.
    """
    path = validation.file_path(path, ".mp4", ".gif")
    fps = float(fps if fps is not None else (30.0 if path.suffix.lower() == ".mp4" else 20.0))
    for name, value in (("fps", fps), ("speed", speed)):
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be positive, got {value!r}")
    if quality not in ("draft", "high"):
        raise ValueError(f"quality must be 'draft' or 'high', got {quality!r}")
    encoder = require("imageio_ffmpeg", "view").get_ffmpeg_exe()
    size = _even(size)
    supersampling = fine_supersampling(size) if quality == "high" else 2
    stage = Stage(record, size=size, color_by=color_by, camera=camera, ground=ground, supersampling=supersampling)
    try:
        places = film_places(stage.times, speed / fps)
        with (
            written_beside(path) as temporary,
            Film(encoder, temporary, stage.size, fps) as film,
            progress_bar(len(places), "rendering", progress, unit="pictures") as bar,
        ):
            for place in places:
                stage.show(place)
                stage.label(f"t = {np.interp(place, np.arange(len(stage.times)), stage.times):.2f} s")
                film.write(stage.image())
                bar.advance(1)
    finally:
        stage.close()
    return path


@keyword_hints
def view(
    record: Frames,
    *,
    size: Sequence[int] = (1024, 640),
    color_by: ColorBy = "rod",
    camera: Pinhole | str | npt.ArrayLike | None = None,
    ground: float | None = None,
    backend: str | None = None,
) -> Any:
    """Show the rods in a notebook or a window, with controls for the view and the time.

    Parameters
    ----------
    record : Record
    size, color_by, camera, ground
        As in `picture`. At first the camera has all frames in view.
    backend : str, optional
        PyVista's backend in a notebook, such as "trame" or "static". By default PyVista chooses.

    Returns
    -------
    widget
        The viewer in a notebook; None elsewhere.

    Raises
    ------
    ValueError, ImportError, RuntimeError
        As in `picture`.
    """
    notebook = in_notebook()
    if len(record) and not notebook:  # an empty record has an error of its own
        check_display()
    stage = Stage(
        record, size=size, color_by=color_by, camera=camera, ground=ground, off_screen=notebook, supersampling=1
    )
    if len(record) > 1 and backend != "static":
        stage.plotter.add_slider_widget(
            lambda time: stage.show(float(np.interp(time, stage.times, np.arange(len(stage.times))))),
            rng=(float(stage.times[0]), float(stage.times[-1])),
            value=float(stage.times[0]),
            title="time [s]",
            color="#33383d",
            pointa=(0.3, 0.1),
            pointb=(0.7, 0.1),
            slider_width=0.02,
            tube_width=0.004,
            title_height=0.02,
            fmt="%.2f",
        )
    stage.plotter.add_axes(color="#33383d", viewport=(0.0, 0.0, 0.16, 0.2))
    options = {"jupyter_backend": backend} if notebook and backend else {}
    return stage.plotter.show(**options)


def _frame(record: Frames, frame: int) -> int:
    count = len(record)
    if int(frame) != frame or not -count <= frame < count:
        raise ValueError(f"frame must lie in {-count}..{count - 1}, got {frame!r}")
    return int(frame) % count


def _even(size: Sequence[int]) -> Sequence[int]:
    """Films need even sides."""
    try:
        return [int(side) // 2 * 2 for side in size]
    except (TypeError, ValueError):
        return size
