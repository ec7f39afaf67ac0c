"""Outlines of rods, bodies, obstacles, springs and tendons for pictures and files, without their motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from withe.common.short_repr import ShortRepr

__all__ = ["BodyOutline", "Named", "ObstacleOutline", "RodOutline", "SpringOutline", "TendonOutline", "index_of"]

FloatArray = npt.NDArray[np.float64]


class HasName(Protocol):
    """An outline, or a handle."""

    @property
    def name(self) -> str:
        """Name of a part of the scene."""


Named = str | HasName


@dataclass(frozen=True, repr=False)
class RodOutline(ShortRepr):
    """Outline of a rod for pictures and files, without its motion.

    Attributes
    ----------
    name : str
    rows : ndarray of int, shape (nodes,)
        Rows of the rod among the nodes of the scene.
    closed : bool
        True if an edge joins the last node to the first.
    radii : ndarray of shape (edges,) [m]
    widths : ndarray of shape (edges, 2) [m], or None
        Sides of a rectangular section along d1 and d2; None for a round one.
    """

    name: str
    rows: npt.NDArray[np.int64]
    closed: bool
    radii: FloatArray
    widths: FloatArray | None = None

    @property
    def edges(self) -> int:
        """Number of edges."""
        return len(self.rows) - (0 if self.closed else 1)

    @property
    def stencils(self) -> int:
        """Number of nodes at which the rod bends."""
        return len(self.rows) - (0 if self.closed else 2)


@dataclass(frozen=True, repr=False)
class ObstacleOutline(ShortRepr):
    """Outline of an obstacle for pictures, without its motion.

    Attributes
    ----------
    name : str
    kind : {"plane", "capsule", "shape"}
        Kind of the obstacle; a sphere is a capsule of length zero.
    axis : ndarray of shape (3,)
        Normal of a plane; or the vector from the start of a capsule's axis to its end [m].
    radius : float [m]
    vertices : ndarray of shape (vertices, 3) [m]
        Of a shape, from its position; otherwise none.
    triangles : ndarray of int, shape (triangles, 3)
        Rows of `vertices`, counter-clockwise from outside.
    """

    name: str
    kind: str
    axis: FloatArray
    radius: float
    vertices: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    triangles: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))


@dataclass(frozen=True, repr=False)
class SpringOutline(ShortRepr):
    """Outline of a spring for pictures, without the motion of its nodes.

    Attributes
    ----------
    name : str
    rows : pair of int
        Rows of its nodes among the nodes of the scene.
    """

    name: str
    rows: tuple[int, int]


@dataclass(frozen=True, repr=False)
class TendonOutline(ShortRepr):
    """Outline of a tendon for pictures and read-outs, without the motion of its rods.

    Attributes
    ----------
    name : str
    guides : tuple of (int, int, float [-])
        Position of each guide: index of the rod in the scene, edge of the rod, and place along the edge, from 0 to 1.
        The rod -1 stands for a point of a rigid body; then its row among the nodes of the scene, and 0.
    offsets : ndarray of shape (guides, 2) [m]
        Offsets along the directors of the edge.
    """

    name: str
    guides: tuple[tuple[int, int, float], ...]
    offsets: FloatArray

    def points(self, positions: Mapping[int, FloatArray], directors: Mapping[int, FloatArray]) -> FloatArray:
        """Return the positions of the guides, from nodes and directors of the rods.

        Parameters
        ----------
        positions : mapping of int to ndarray of shape (..., nodes, 3) [m]
            Positions of the nodes of each rod with a guide; of all nodes of the scene under -1.
        directors : mapping of int to ndarray of shape (..., edges, 3, 3)

        Returns
        -------
        ndarray of shape (..., guides, 3) [m]
        """
        points = []
        for (rod, edge, share), offset in zip(self.guides, self.offsets, strict=True):
            if rod < 0:
                points.append(positions[-1][..., edge, :])
                continue
            tail, head = (positions[rod][..., node % positions[rod].shape[-2], :] for node in (edge, edge + 1))
            points.append((1.0 - share) * tail + share * head + offset @ directors[rod][..., edge, :2, :])
        return np.stack(points, axis=-2)


@dataclass(frozen=True, repr=False)
class BodyOutline(ShortRepr):
    """Surface of a rigid body for pictures and files, in the axes of the body.

    Attributes
    ----------
    name : str
    vertices : ndarray of shape (vertices, 3) [m]
    triangles : ndarray of int, shape (triangles, 3)
        Rows of `vertices`, counter-clockwise from outside.
    """

    name: str
    vertices: FloatArray
    triangles: npt.NDArray[np.int64]

    def placed(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Return the vertices in the world.

        Parameters
        ----------
        positions : ndarray of shape (..., 3) [m]
            Origin of the axes of the body.
        rotations : ndarray of shape (..., 3, 3)
            Axes of the body, as columns.

        Returns
        -------
        ndarray of shape (..., vertices, 3) [m]
        """
        return np.asarray(positions[..., None, :] + self.vertices @ np.swapaxes(rotations, -1, -2))


def index_of(
    outlines: tuple[RodOutline, ...] | tuple[BodyOutline, ...] | tuple[ObstacleOutline, ...], handle: Named, what: str
) -> int:
    """Return the index of a rod, a body or an obstacle in a record, by its name or its handle."""
    name = handle if isinstance(handle, str) else getattr(handle, "name", None)
    names = [outline.name for outline in outlines]
    if name not in names:
        known = ", ".join(map(repr, names)) or "none"
        wanted = repr(handle) if name is None else repr(name)
        raise ValueError(f"{what} must be one of {known} or its handle, got {wanted}")
    return names.index(name)
