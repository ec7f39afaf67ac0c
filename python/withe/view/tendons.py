"""Tendons in pictures: lines through their guides."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames
from withe.common.outlines import TendonOutline

__all__ = ["TENDON_COLOR", "TendonLines", "tendon_points"]

FloatArray = npt.NDArray[np.float64]
TENDON_COLOR = "#c2255c"  # of no rod


def tendon_points(record: Frames, tendon: TendonOutline) -> FloatArray:
    """Return the positions of the guides in each frame, shape (frames, guides, 3) [m]."""
    rods = {rod: record.rods[rod] for rod, _, _ in tendon.guides if rod >= 0}
    positions = {index: record.positions(rod) for index, rod in rods.items()}
    if len(rods) < len({rod for rod, _, _ in tendon.guides}):
        positions[-1] = record.positions()
    return tendon.points(positions, {index: record.directors(rod) for index, rod in rods.items()})


class TendonLines:
    """The tendons of a record on a stage.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    record : Frames
    width : float [px]
        Width of their lines.

    Attributes
    ----------
    motions : list of ndarray of shape (frames, guides, 3) [m]
        Positions of the guides of each tendon.
    """

    def __init__(self, pyvista: Any, plotter: Any, record: Frames, width: float) -> None:
        self.motions: list[FloatArray] = [tendon_points(record, tendon) for tendon in record.tendons]
        self._meshes = [pyvista.lines_from_points(points[0]) for points in self.motions]
        for mesh in self._meshes:
            plotter.add_mesh(mesh, color=TENDON_COLOR, line_width=width, lighting=False, reset_camera=False)

    def show(self, guides: list[FloatArray]) -> None:
        """Move the tendons to the positions of their guides, shape (guides, 3) [m] each."""
        for mesh, points in zip(self._meshes, guides, strict=True):
            mesh.points = points
