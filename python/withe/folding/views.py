"""Camera pictures of a simulated sheet: a hanging strip, and the sheet on the table. Drawn by OpenCV."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.folding.paper import Paper
from withe.folding.paper_rods import add_paper
from withe.perception.camera import Camera
from withe.scene.scene import Scene

__all__ = ["strip_picture", "table_picture"]

FloatArray = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]
_FINE = 4  # pixels of the drawing per pixel of the picture
_SHIFT = 6  # bits of the fractions of these
_GRAIN = 3.0  # standard deviation of the sensor [grey levels]
_PAPER, _BACK, _TABLE, _WALL = (236, 233, 226), (222, 226, 233), (38, 74, 62), (52, 60, 78)
_STRIP_NODES = 121
_MARGIN = 0.02  # round a strip [m]


def strip_picture(paper: Paper, curl: float, length: float, scale: float, random: np.random.Generator) -> Picture:
    """Picture of a strip from the side, clamped level at the left border; `scale` in px/m."""
    scene = Scene()
    strip = add_paper(scene, paper, np.linspace(0.0, length, _STRIP_NODES), curl)
    scene.clamp(strip.start)
    simulation = scene.build(planar=True)
    simulation.equilibrium()
    points = simulation.positions(strip)[:, [0, 2]] * [1.0, -1.0]
    width, height = points.max(axis=0) + _MARGIN + [0.0, _MARGIN]
    size = int(np.ceil(width * scale)), int(np.ceil(height * scale))
    pixels = (points + np.array([0.0, _MARGIN])) * scale - 0.5
    pixels = np.vstack([pixels[0] - [5.0, 0.0], pixels])  # the strip continues into the clamp, beyond the border
    half = 0.5 * max(1.5, paper.thickness * scale)
    way = np.gradient(pixels, axis=0)
    across = half * way[:, ::-1] * [-1.0, 1.0] / np.linalg.norm(way, axis=1)[:, None]
    quads = [
        np.stack(
            [pixels[i] - across[i], pixels[i + 1] - across[i + 1], pixels[i + 1] + across[i + 1], pixels[i] + across[i]]
        )
        for i in range(len(pixels) - 1)
    ]
    return _painted(quads, [_PAPER] * len(quads), _WALL, size, random)


def table_picture(
    sides: Sequence[FloatArray], camera: Camera, size: tuple[int, int], random: np.random.Generator
) -> Picture:
    """Picture of a sheet on the table: its upper face bright, its lower face bluish, steep parts darker."""
    positions = 0.5 * (sides[0] + sides[1])
    steps = np.diff(positions, axis=0)
    seen = [camera.project(side) for side in sides]
    order = np.argsort(positions[:-1, 2] + positions[1:, 2], kind="stable")
    quads, colours = [], []
    for i in order:
        level = steps[i, 0] / np.hypot(steps[i, 0], steps[i, 2])
        colour = np.array(_PAPER if level > 0 else _BACK) * (0.55 + 0.45 * abs(level))
        quads.append(np.stack([seen[0][i], seen[0][i + 1], seen[1][i + 1], seen[1][i]]))
        colours.append(tuple(float(c) for c in colour))
    return _painted(quads, colours, _TABLE, size, random)


def _painted(
    quads: list[FloatArray],
    colours: list[tuple[float, ...]],
    ground: tuple[int, ...],
    size: tuple[int, int],
    random: np.random.Generator,
) -> Picture:
    """Areas one over the other; a pixel's value is the mean over it, blurred as by a lens, with a sensor's noise."""
    cv2 = require("cv2", "vision")
    canvas = np.full((size[1] * _FINE, size[0] * _FINE, 3), ground, np.uint8)
    for quad, colour in zip(quads, colours, strict=True):
        # OpenCV's whole numbers are middles of pixels; ours are so in the picture, too.
        corners = np.round(((quad + 0.5) * _FINE - 0.5) * 2**_SHIFT).astype(np.int32)
        cv2.fillConvexPoly(canvas, corners, colour, cv2.LINE_8, _SHIFT)
    picture = cv2.resize(canvas, size, interpolation=cv2.INTER_AREA)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.6).astype(float)
    noisy = picture + random.normal(0.0, _GRAIN, picture.shape)
    return np.asarray(np.clip(np.round(noisy), 0, 255), dtype=np.uint8)
