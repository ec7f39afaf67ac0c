"""Tendons in pictures: lines through their guides."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames
from withe.common.outlines import TendonOutline

__all__ = ["TendonLines", "tendon_points"]

FloatArray = npt.NDArray[np.float64]


def tendon_points(record: Frames, tendon: TendonOutline) -> FloatArray:
    """Return the positions of the guides in each frame, shape (frames, guides, 3) [m]."""
    rods = {rod: record.rods[rod] for rod, _, _ in tendon.guides}
    positions = {index: record.positions(rod) for index, rod in rods.items()}
    return tendon.points(positions, {index: record.directors(rod) for index, rod in rods.items()})


class TendonLines:
    """The tendons of a record on a stage.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    record : Frames
    """

    def __init__(self, pyvista: Any, plotter: Any, record: Frames) -> None:
        self._points = [tendon_points(record, tendon) for tendon in record.tendons]
        self._meshes = [pyvista.lines_from_points(points[0]) for points in self._points]
        for mesh in self._meshes:
            plotter.add_mesh(mesh, color="#33383d", line_width=3.0, reset_camera=False)

    def show(self, before: int, after: int, share: float) -> None:
        """Move the tendons to a place between two frames."""
        for mesh, points in zip(self._meshes, self._points, strict=True):
            mesh.points = (1.0 - share) * points[before] + share * points[after]
