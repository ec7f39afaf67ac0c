"""Shapes of a robot's bodies: one solid of several, and those of the geoms of MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.polyhedra import convex_hull
from withe.solids import Box, Capsule, Cylinder, Mesh, Sphere
from withe.solids.bodies import Solid

__all__ = ["Shape", "closed_surface", "combined", "drawn_geoms", "solid_of", "welded"]

FloatArray = npt.NDArray[np.float64]
Surface = tuple[FloatArray, npt.NDArray[np.int64]]

# Types of geoms, mjtGeom of MuJoCo.
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = 2, 3, 4, 5, 6, 7
DRAWN = (_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH)


def drawn_geoms(model: Any, geoms: Sequence[int]) -> tuple[list[int], list[int]]:
    """Return the geoms that stand for a body in pictures, and those that have no picture.

    Geoms that touch nothing are visual shapes. If a body has one, the others are left out.
    """
    known = [geom for geom in geoms if model.geom_type[geom] in DRAWN]
    visual = [geom for geom in known if not (model.geom_contype[geom] or model.geom_conaffinity[geom])]
    return visual or known, [geom for geom in geoms if geom not in known]


@dataclass(frozen=True, eq=False)
class Shape:
    """A shape in the axes of a body.

    Attributes
    ----------
    solid : Solid or None
        Solid in axes of its own; None for a surface.
    surface : tuple of (ndarray of shape (n, 3) [m], ndarray of int of shape (m, 3))
        Vertices and triangles, in the axes of the solid.
    place : ndarray of shape (3,) [m]
        Origin of these axes.
    turn : ndarray of shape (3, 3)
        These axes, as columns.
    """

    solid: Solid | None
    surface: Surface
    place: FloatArray
    turn: FloatArray


def solid_of(
    model: Any, data: Any, geoms: Sequence[int], position: FloatArray, rotation: FloatArray
) -> tuple[Solid | None, list[int]]:
    """Return the solid of some geoms in the axes of a body, and the geoms whose open mesh became its convex hull.

    Parameters
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
    geoms : sequence of int
    position : ndarray of shape (3,) [m]
        Origin of the axes of the body.
    rotation : ndarray of shape (3, 3)
        Axes of the body, as columns.
    """
    hulls: list[int] = []
    shapes: list[Shape] = []
    for geom in geoms:
        place = rotation.T @ (data.geom_xpos[geom] - position)
        turn = rotation.T @ data.geom_xmat[geom].reshape(3, 3)
        plain = _plain(int(model.geom_type[geom]), model.geom_size[geom])
        if plain is not None:
            surface = welded(*plain.surface())
        elif model.geom_type[geom] == _ELLIPSOID:
            vertices, triangles = welded(*Sphere(1.0).surface())
            surface = (vertices * model.geom_size[geom], triangles)
        else:
            surface, is_hull = closed_surface(*_mesh(model, int(model.geom_dataid[geom])))
            if is_hull:
                hulls.append(geom)
        shapes.append(Shape(plain, surface, place, turn))
    return combined(shapes), hulls


def combined(shapes: Sequence[Shape]) -> Solid | None:
    """Return one solid of some shapes; None without shapes."""
    if not shapes:
        return None
    first = shapes[0]
    is_in_place = np.abs(first.place).max() < 1e-12 and np.abs(first.turn - np.eye(3)).max() < 1e-9
    if len(shapes) == 1 and first.solid is not None and is_in_place:
        return first.solid
    vertices = [shape.surface[0] @ shape.turn.T + shape.place for shape in shapes]
    starts = np.cumsum([0, *(len(rows) for rows in vertices)])
    triangles = [shape.surface[1] + start for shape, start in zip(shapes, starts, strict=False)]
    return Mesh(np.concatenate(vertices), np.concatenate(triangles))


def _plain(kind: int, size: FloatArray) -> Solid | None:
    """Return the solid of a geom about the origin; None for an ellipsoid or a mesh."""
    a, b, c = map(float, size)
    if kind == _SPHERE:
        return Sphere(a)
    if kind == _CAPSULE:
        return Capsule(a, 2.0 * b)
    if kind == _CYLINDER:
        return Cylinder(a, 2.0 * b)
    return Box((2.0 * a, 2.0 * b, 2.0 * c)) if kind == _BOX else None


def _mesh(model: Any, mesh: int) -> Surface:
    """Return a mesh of the model in the axes of its geom."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = np.array(model.mesh_vert[first : first + count], dtype=float)
    return welded(vertices, np.array(model.mesh_face[face : face + faces], dtype=np.int64))


def welded(vertices: FloatArray, triangles: npt.NDArray[np.int64]) -> Surface:
    """Return a surface without repeated vertices and without triangles that have no area."""
    scale = float(np.abs(vertices).max()) or 1.0
    _, first, place = np.unique(np.round(vertices / scale, 7), axis=0, return_index=True, return_inverse=True)
    rows = place.reshape(-1)[triangles]
    distinct = (rows[:, 0] != rows[:, 1]) & (rows[:, 1] != rows[:, 2]) & (rows[:, 2] != rows[:, 0])
    return vertices[first], rows[distinct]


def closed_surface(vertices: FloatArray, triangles: npt.NDArray[np.int64]) -> tuple[Surface, bool]:
    """Return a surface that is closed with its normals outwards, and True if it is the convex hull."""
    for rows in (triangles, triangles[:, ::-1]):
        try:
            Mesh(vertices, rows)
        except ValueError:
            continue
        return (vertices, rows), False
    flat = np.linalg.matrix_rank(vertices - vertices[0], tol=1e-6 * float(np.abs(vertices).max())) < 3
    if flat:  # a sheet gets a thickness, because a hull has a volume
        normal = np.linalg.svd(vertices - vertices[0])[2][2] * 1e-3 * float(np.ptp(vertices, axis=0).max())
        vertices = np.concatenate([vertices - normal, vertices + normal])
    return convex_hull(vertices), True
