"""Springs in rendered pictures: zigzags between their nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames
from withe.view import scenery

__all__ = ["SpringLines"]

FloatArray = npt.NDArray[np.float64]


class SpringLines:
    """The springs of a record on a stage.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    record : Frames
    direction : ndarray of shape (3,)
        Direction from which the camera looks.
    width : float [px]
        Width of their lines.
    """

    def __init__(self, pyvista: Any, plotter: Any, record: Frames, direction: FloatArray, width: float) -> None:
        self._direction = direction
        positions = record.positions()
        self._rows = [list(spring.rows) for spring in record.springs]
        self._widths = [scenery.spring_width(positions[:, rows]) for rows in self._rows]
        self._meshes = [pyvista.lines_from_points(points) for points in self._points(positions[0])]
        for mesh in self._meshes:
            plotter.add_mesh(mesh, color="#6b7680", line_width=width, reset_camera=False)

    def show(self, positions: FloatArray) -> None:
        """Move the springs to the nodes of the scene, shape (nodes, 3) [m]."""
        for mesh, points in zip(self._meshes, self._points(positions), strict=True):
            mesh.points = points

    def _points(self, positions: FloatArray) -> list[FloatArray]:
        return [
            scenery.zigzag(positions[rows], width, self._direction)
            for rows, width in zip(self._rows, self._widths, strict=True)
        ]
