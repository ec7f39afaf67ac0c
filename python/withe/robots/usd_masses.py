"""Shapes of a USD stage, and masses of its rigid bodies by the rules of UsdPhysics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.robots.composing import MassProperties, united
from withe.robots.shapes import Shape, closed_surface, welded
from withe.solids import Box, Capsule, Cylinder, Mesh, Sphere
from withe.solids.bodies import Solid

__all__ = ["StageUnits", "UsdShape", "mass_properties", "shape_of", "world_axes"]

FloatArray = npt.NDArray[np.float64]

# Density of a collider for which the file states neither mass nor density [kg/m^3], as in UsdPhysics.
_DEFAULT_DENSITY = 1000.0
# Largest difference between the scales along the axes of a prim at which its shape keeps its kind.
_EQUAL_SCALES = 1e-6
# Turns of the z axis of our solids to the axis of a capsule or cylinder, as columns.
_TO_AXIS = {
    "X": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "Y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "Z": np.eye(3),
}


@dataclass(frozen=True, eq=False)
class StageUnits:
    """Units of a stage, and the turn by which its up axis becomes z.

    Attributes
    ----------
    length : float [m]
    mass : float [kg]
    upright : ndarray of shape (3, 3)
    """

    length: float
    mass: float
    upright: FloatArray


def world_axes(prim: Any, units: StageUnits) -> tuple[FloatArray, FloatArray]:
    """Return the matrix and the origin of a prim: x = matrix @ local + origin, with x in m, local in stage units."""
    geometry, usd = require("pxr.UsdGeom", "robots"), require("pxr.Usd", "robots")
    rows = np.array(geometry.Xformable(prim).ComputeLocalToWorldTransform(usd.TimeCode.Default()), dtype=float)
    return units.length * units.upright @ rows[:3, :3].T, units.length * units.upright @ rows[3, :3]


@dataclass(frozen=True, eq=False)
class UsdShape:
    """A shape in the axes of the world, with its mass properties at a density of 1 kg/m^3.

    Attributes
    ----------
    prim : pxr.Usd.Prim
    shape : Shape
    unit : MassProperties
    is_hull : bool
        True if the mesh of the file is not closed and its convex hull stands for it.
    """

    prim: Any
    shape: Shape
    unit: MassProperties
    is_hull: bool


def shape_of(prim: Any, units: StageUnits) -> UsdShape | None:
    """Return the shape of a prim; None for kinds that are not supported, such as cones and planes."""
    kind = prim.GetTypeName()
    matrix, origin = world_axes(prim, units)
    if kind == "Mesh":
        vertices, triangles = _mesh(prim)
        if np.linalg.det(matrix) < 0.0:
            triangles = triangles[:, ::-1]
        surface, is_hull = closed_surface(*welded(vertices @ matrix.T, triangles))
        mesh = Mesh(*surface)
        unit = MassProperties(mesh.volume, mesh.center + origin, mesh.volume * mesh.inertia_per_mass)
        return UsdShape(prim, Shape(None, surface, origin, np.eye(3)), unit, is_hull)
    own = _solid(prim, kind)
    if own is None:
        return None
    solid, local = own
    # An affine map changes the covariance of a solid to A C A^T, with J = tr(C) 1 - C.
    inertia = solid.inertia_per_mass
    matrix = matrix @ local
    spread = matrix @ (0.5 * np.trace(inertia) * np.eye(3) - inertia) @ matrix.T
    volume = solid.volume * abs(np.linalg.det(matrix))
    unit = MassProperties(volume, origin, volume * (np.trace(spread) * np.eye(3) - spread))
    scales = np.linalg.norm(matrix, axis=0)
    turn = matrix / scales
    vertices, triangles = welded(*solid.surface())
    is_turned = np.abs(turn.T @ turn - np.eye(3)).max() < _EQUAL_SCALES and np.linalg.det(turn) > 0.0
    kept = _scaled(solid, scales) if is_turned else None
    if kept is not None:
        return UsdShape(prim, Shape(kept, welded(*kept.surface()), origin, turn), unit, False)
    if np.linalg.det(matrix) < 0.0:
        triangles = triangles[:, ::-1]
    return UsdShape(prim, Shape(None, (vertices @ matrix.T, triangles), origin, np.eye(3)), unit, False)


def _solid(prim: Any, kind: str) -> tuple[Solid, FloatArray] | None:
    """Return the solid of a prim in its own units, and the turn from the axes of the solid to those of the prim."""

    def number(word: str) -> float:
        return float(prim.GetAttribute(word).Get())

    if kind == "Sphere":
        return Sphere(number("radius")), np.eye(3)
    if kind == "Cube":
        return Box((number("size"),) * 3), np.eye(3)
    if kind not in ("Capsule", "Cylinder"):
        return None
    solid = Capsule if kind == "Capsule" else Cylinder
    return solid(number("radius"), number("height")), _TO_AXIS[str(prim.GetAttribute("axis").Get())]


def _scaled(solid: Solid, scales: FloatArray) -> Solid | None:
    """Return a solid that is scaled along its axes, if it keeps its kind."""
    if isinstance(solid, Box):
        a, b, c = (float(size * scale) for size, scale in zip(solid.size, scales, strict=True))
        return Box((a, b, c))
    across = abs(scales[0] - scales[1]) < _EQUAL_SCALES * scales.max()
    if isinstance(solid, Cylinder) and across:
        return Cylinder(float(solid.radius * scales[0]), float(solid.length * scales[2]))
    if not across or abs(scales[0] - scales[2]) > _EQUAL_SCALES * scales.max():
        return None
    if isinstance(solid, Sphere):
        return Sphere(float(solid.radius * scales[0]))
    return (
        Capsule(float(solid.radius * scales[0]), float(solid.length * scales[0]))
        if isinstance(solid, Capsule)
        else None
    )


def _mesh(prim: Any) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return the vertices and triangles of a mesh in the axes of its prim. Polygons become fans."""
    vertices = np.array(prim.GetAttribute("points").Get() or np.zeros((0, 3)), dtype=float)
    corners = np.array(prim.GetAttribute("faceVertexIndices").Get() or [], dtype=np.int64)
    counts = np.array(prim.GetAttribute("faceVertexCounts").Get() or [], dtype=np.int64)
    if len(counts) == 0 or counts.sum() != len(corners) or corners.min() < 0 or corners.max() >= len(vertices):
        raise ValueError(f"mesh {prim.GetPath()} must have points and faces that are rows of the points")
    starts = np.cumsum(counts) - counts
    rows = [
        corners[[start, start + i, start + i + 1]]
        for start, count in zip(starts, counts, strict=True)
        for i in range(1, count - 1)
    ]
    triangles = np.array(rows, dtype=np.int64)
    is_left = str(prim.GetAttribute("orientation").Get()) == "leftHanded"
    return vertices, triangles[:, ::-1] if is_left else triangles


def mass_properties(prim: Any, colliders: Sequence[UsdShape], units: StageUnits) -> MassProperties | None:
    """Return the mass, centre and inertia of a rigid body in the axes of the world; None if the file has no mass.

    A mass of the body overrides those of its colliders, and a density of a collider overrides that of the body
    [UsdPhysics, rigid body physics in USD, mass properties].
    """
    mass, density = (_positive(prim, word) for word in ("physics:mass", "physics:density"))
    parts = []
    for collider in colliders:
        own = _positive(collider.prim, "physics:mass") * units.mass
        if not own:
            per_volume = _positive(collider.prim, "physics:density") or density or _density_of_material(collider.prim)
            own = collider.unit.mass * (per_volume * units.mass / units.length**3 or _DEFAULT_DENSITY)
        ratio = own / collider.unit.mass
        parts.append(MassProperties(own, collider.unit.center, ratio * collider.unit.inertia))
    whole = united(parts)
    if whole is None and not mass:
        return None
    total = mass * units.mass or (whole.mass if whole else 0.0)
    matrix, origin = world_axes(prim, units)
    turn = matrix / np.linalg.norm(matrix, axis=0)
    center = whole.center if whole else origin
    inertia = whole.inertia * (total / whole.mass) if whole else None
    stated = prim.GetAttribute("physics:centerOfMass").Get() if prim.HasAttribute("physics:centerOfMass") else None
    if stated is not None and np.isfinite(np.array(stated)).all():
        place = matrix @ np.array(stated, dtype=float) + origin
        if inertia is not None:  # of the shapes, about another point
            arm = place - center
            inertia = inertia + total * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        center = place
    principal = (
        prim.GetAttribute("physics:diagonalInertia").Get() if prim.HasAttribute("physics:diagonalInertia") else None
    )
    if principal is not None and np.any(np.array(principal) != 0.0):
        axes = prim.GetAttribute("physics:principalAxes").Get()
        own_turn = turn @ rotation_of(axes) if axes is not None and axes.GetLength() > 0.0 else turn
        moments = np.array(principal, dtype=float) * units.mass * units.length**2
        inertia = (own_turn * moments) @ own_turn.T
    if inertia is None:
        raise ValueError(
            f"body {prim.GetPath()} has a mass, but neither diagonalInertia nor a collider: add one of them"
        )
    return MassProperties(total, center, inertia)


def _positive(prim: Any, word: str) -> float:
    """Return an attribute that counts only if it is positive, else zero."""
    value = prim.GetAttribute(word).Get() if prim.HasAttribute(word) else None
    return float(value) if value is not None and value > 0.0 else 0.0


def _density_of_material(prim: Any) -> float:
    shade = require("pxr.UsdShade", "robots")
    material, _ = shade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    return _positive(material.GetPrim(), "physics:density") if material else 0.0


def rotation_of(quaternion: Any) -> FloatArray:
    """Return the rotation matrix of a quaternion of USD, which has single precision in most attributes."""
    w, (x, y, z) = quaternion.GetReal(), quaternion.GetImaginary()
    w, x, y, z = np.array([w, x, y, z], dtype=float) / np.linalg.norm([w, x, y, z])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
