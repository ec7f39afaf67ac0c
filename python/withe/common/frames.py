"""Recorded frames for files and pictures: any object with the read-outs of a `Record`."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
import numpy.typing as npt

from withe.common.outlines import BodyOutline, Named, ObstacleOutline, RodOutline, SpringOutline, TendonOutline
from withe.common.short_repr import ShortRepr

__all__ = ["ENERGIES", "EnergyHistory", "Frames", "edges_to_nodes", "stencils_to_nodes"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class EnergyHistory(ShortRepr):
    """Energies of every frame of a `Record`.

    Attributes
    ----------
    kinetic, stretch, bend, twist, gravity, loads, contact, spring : ndarray of shape (frames,) [J]
        Energies of the scene by kind.
    total : ndarray of shape (frames,) [J]
        Sum of these energies.
    work : ndarray of shape (frames,) [J]
        Work of supports and actuation since the start of the simulation.
    dissipated : ndarray of shape (frames,) [J]
        Energy dissipated since the start of the simulation.
    """

    kinetic: FloatArray
    stretch: FloatArray
    bend: FloatArray
    twist: FloatArray
    gravity: FloatArray
    loads: FloatArray
    contact: FloatArray
    spring: FloatArray
    total: FloatArray
    work: FloatArray
    dissipated: FloatArray


ENERGIES = tuple(field.name for field in fields(EnergyHistory))


class Frames(Protocol):
    """Motion of a scene, frame by frame. Rods, bodies and obstacles are given by outline, by handle or by name."""

    def __len__(self) -> int:
        """Number of frames."""

    @property
    def times(self) -> FloatArray:
        """Times of the frames, shape (frames,) [s]."""

    @property
    def rods(self) -> tuple[RodOutline, ...]:
        """Rods in the order of the scene."""

    @property
    def bodies(self) -> tuple[BodyOutline, ...]:
        """Rigid bodies in the order of the scene."""

    @property
    def obstacles(self) -> tuple[ObstacleOutline, ...]:
        """Obstacles in the order of the scene."""

    @property
    def springs(self) -> tuple[SpringOutline, ...]:
        """Springs in the order of the scene."""

    @property
    def tendons(self) -> tuple[TendonOutline, ...]:
        """Tendons in the order of the scene."""

    def positions(self, rod: Named | None = None) -> FloatArray:
        """Positions of the nodes of a rod, or of all, shape (frames, nodes, 3) [m]."""

    def velocities(self, rod: Named | None = None) -> FloatArray:
        """Velocities of the nodes of a rod, or of all, shape (frames, nodes, 3) [m/s]."""

    def directors(self, rod: Named) -> FloatArray:
        """Material frames of the edges, shape (frames, edges, 3, 3), rows d1, d2, tangent."""

    def curvatures(self, rod: Named) -> FloatArray:
        """Curvatures towards d1 and d2, shape (frames, stencils, 2) [1/m]."""

    def twists(self, rod: Named) -> FloatArray:
        """Twists per length, shape (frames, stencils) [rad/m]."""

    def tensions(self, rod: Named) -> FloatArray:
        """Axial forces of the edges, shape (frames, edges) [N]."""

    def body_position(self, body: Named) -> FloatArray:
        """Origin of the axes of a body, shape (frames, 3) [m]."""

    def body_rotation(self, body: Named) -> FloatArray:
        """Axes of a body as the columns of matrices, shape (frames, 3, 3)."""

    def obstacle_position(self, obstacle: Named) -> FloatArray:
        """Positions of an obstacle: a plane's point, a sphere's centre or a capsule's start, shape (frames, 3) [m]."""

    def energy(self) -> EnergyHistory:
        """Energies, each an array of shape (frames,) [J]."""


def edges_to_nodes(values: npt.NDArray[np.float64], closed: bool) -> npt.NDArray[np.float64]:
    """Return the mean of the two edges at each node. The end nodes of an open rod take the value of their only edge.

    Parameters
    ----------
    values : ndarray of shape (frames, edges, ...)
    closed : bool

    Returns
    -------
    ndarray of shape (frames, nodes, ...)
    """
    if closed:
        return 0.5 * (values + np.roll(values, 1, axis=1))
    inner = 0.5 * (values[:, :-1] + values[:, 1:])
    return np.concatenate([values[:, :1], inner, values[:, -1:]], axis=1)


def stencils_to_nodes(values: npt.NDArray[np.float64], closed: bool) -> npt.NDArray[np.float64]:
    """Extend the values at the inner nodes of an open rod to its ends; shape (frames, nodes, ...)."""
    if closed:
        return values
    padding = [(0, 0), (1, 1)] + [(0, 0)] * (values.ndim - 2)
    return np.pad(values, padding, mode="edge" if values.shape[1] else "constant")
