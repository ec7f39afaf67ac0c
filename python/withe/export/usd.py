"""USD: rods as curves with widths, rigid bodies as meshes, obstacles as shapes, all with time samples.

`pxr` is imported on first use.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.common.frames import Frames, edges_to_nodes
from withe.common.outlines import BodyOutline, ObstacleOutline, RodOutline
from withe.export.gltf import node_frames, quaternions
from withe.view import scenery
from withe.view.bodies import body_points, shaded
from withe.view.colors import PLANE_COLOR, SOLID_COLOR, body_color, linear, rgb, rod_color

__all__ = ["write_usd"]

FloatArray = npt.NDArray[np.float64]

_STILL_RATE = 30.0  # frames per second of a record whose time stands still [1/s]


def write_usd(record: Frames, path: Path) -> None:
    """Write a USD stage: metres, z up, and one time sample per frame.

    Parameters
    ----------
    record : Record
    path : pathlib.Path
        File to write, ending in .usda (text) or .usdc (binary).

    Raises
    ------
    ImportError
        The package usd-core is not installed.
    """
    usd, geometry = require("pxr.Usd", "export"), require("pxr.UsdGeom", "export")
    stage = usd.Stage.CreateNew(str(path))
    geometry.SetStageMetersPerUnit(stage, 1.0)
    geometry.SetStageUpAxis(stage, geometry.Tokens.z)
    rate, codes = _time_codes(record.times)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(codes[0])
    stage.SetEndTimeCode(codes[-1])
    stage.SetDefaultPrim(geometry.Xform.Define(stage, "/withe").GetPrim())
    taken: set[str] = set()
    for index, rod in enumerate(record.rods):
        _add_rod(stage, _path_of(rod.name, taken), record, rod, codes, rod_color(index))
    for index, body in enumerate(record.bodies):
        _add_body(stage, _path_of(body.name, taken), record, body, codes, body_color(index))
    nodes = np.concatenate([record.positions().reshape(-1, 3), body_points(record)])
    for obstacle in record.obstacles:
        _add_obstacle(stage, _path_of(obstacle.name, taken), record, obstacle, nodes, codes)
    stage.GetRootLayer().Save()


def _time_codes(times: FloatArray) -> tuple[float, list[float]]:
    """Time codes per second, and the code of each frame: whole numbers where frames are evenly spaced."""
    steps = np.diff(times)
    if np.any(steps <= 0.0):
        return _STILL_RATE, np.arange(len(times), dtype=float).tolist()
    rate = 1.0 / float(np.median(steps)) if len(steps) else _STILL_RATE
    rate = round(rate) if abs(rate - round(rate)) < 1e-6 * rate else rate
    codes = times * rate
    whole = np.rint(codes)
    return float(rate), np.where(np.abs(codes - whole) < 1e-6, whole, codes).tolist()


def _path_of(name: str, taken: set[str]) -> str:
    """Return the path of a prim for a part. USD allows letters, digits and underscores, so names may collide."""
    valid = require("pxr.Tf", "export").MakeValidIdentifier(name)
    found, number = valid, 1
    while found in taken:
        number += 1
        found = f"{valid}_{number}"
    taken.add(found)
    return f"/withe/{found}"


def _add_rod(stage: Any, path: str, record: Frames, rod: RodOutline, codes: list[float], color: FloatArray) -> None:
    geometry, arrays = require("pxr.UsdGeom", "export"), require("pxr.Vt", "export")
    curves = geometry.BasisCurves.Define(stage, path)
    curves.GetPrim().SetCustomDataByKey("rod", rod.name)
    curves.CreateTypeAttr(geometry.Tokens.cubic)
    curves.CreateBasisAttr(geometry.Tokens.catmullRom)
    curves.CreateWrapAttr(geometry.Tokens.periodic if rod.closed else geometry.Tokens.pinned)
    curves.CreateCurveVertexCountsAttr([len(rod.rows)])
    _paint(curves, color)
    widths = 2.0 * rod.radii if rod.widths is None else rod.widths.max(axis=1)
    at_nodes = edges_to_nodes(widths[None], rod.closed)[0]
    curves.CreateWidthsAttr(arrays.FloatArray.FromNumpy(at_nodes.astype(np.float32)))
    curves.SetWidthsInterpolation(geometry.Tokens.vertex)
    positions, velocities = record.positions(rod), record.velocities(rod)
    samples = {"points": curves.CreatePointsAttr(), "velocities": curves.CreateVelocitiesAttr()}
    values = {"points": positions, "velocities": velocities}
    if rod.widths is not None:  # a ribbon, which normals make flat
        thin = int(np.argmin(rod.widths.mean(axis=0)))
        samples["normals"] = curves.CreateNormalsAttr()
        curves.SetNormalsInterpolation(geometry.Tokens.vertex)
        values["normals"] = node_frames(positions, record.directors(rod)[:, :, 0], rod.closed)[:, :, thin]
    reach = 0.5 * float(widths.max())
    samples["extent"] = curves.CreateExtentAttr()
    values["extent"] = np.stack([positions.min(axis=1) - reach, positions.max(axis=1) + reach], axis=1)
    for name, attribute in samples.items():
        for code, value in zip(codes, values[name].astype(np.float32), strict=True):
            attribute.Set(arrays.Vec3fArray.FromNumpy(np.ascontiguousarray(value)), code)


def _add_body(stage: Any, path: str, record: Frames, body: BodyOutline, codes: list[float], color: FloatArray) -> None:
    """Add a body as a mesh that moves and turns."""
    vectors = require("pxr.Gf", "export")
    shape = _define_mesh(stage, path, body)
    shape.GetPrim().SetCustomDataByKey("body", body.name)
    _paint(shape, color)
    move, turn = shape.AddTranslateOp(), shape.AddOrientOp()
    turns = quaternions(np.swapaxes(record.body_rotation(body), -1, -2)[:, None])[:, 0]
    for code, place, (x, y, z, w) in zip(codes, record.body_position(body).tolist(), turns.tolist(), strict=True):
        move.Set(vectors.Vec3d(*place), code)
        turn.Set(vectors.Quatf(w, x, y, z), code)


def _define_mesh(stage: Any, path: str, part: BodyOutline | ObstacleOutline) -> Any:
    geometry, arrays = require("pxr.UsdGeom", "export"), require("pxr.Vt", "export")
    shape = geometry.Mesh.Define(stage, path)
    shape.CreatePointsAttr(arrays.Vec3fArray.FromNumpy(part.vertices.astype(np.float32)))
    shape.CreateFaceVertexCountsAttr(arrays.IntArray.FromNumpy(np.full(len(part.triangles), 3, np.int32)))
    shape.CreateFaceVertexIndicesAttr(arrays.IntArray.FromNumpy(part.triangles.ravel().astype(np.int32)))
    shape.CreateNormalsAttr(arrays.Vec3fArray.FromNumpy(shaded(part)[1].astype(np.float32)))
    shape.SetNormalsInterpolation(geometry.Tokens.faceVarying)
    shape.CreateSubdivisionSchemeAttr(geometry.Tokens.none)
    shape.CreateExtentAttr(geometry.PointBased.ComputeExtent(shape.GetPointsAttr().Get()))
    return shape


def _add_obstacle(
    stage: Any, path: str, record: Frames, obstacle: ObstacleOutline, nodes: FloatArray, codes: list[float]
) -> None:
    geometry, vectors = require("pxr.UsdGeom", "export"), require("pxr.Gf", "export")
    places = record.obstacle_position(obstacle)
    if not len(scenery.framing(obstacle, places, nodes)):
        return  # far away or huge, so that it would move the cameras of viewers
    if obstacle.kind == "plane":
        shape = geometry.Mesh.Define(stage, path)
        corners = (scenery.patch(obstacle, places[0], nodes) - places[0]).tolist()
        shape.CreatePointsAttr([vectors.Vec3f(*corner) for corner in corners])
        shape.CreateFaceVertexCountsAttr([4])
        shape.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
        shape.CreateDoubleSidedAttr(True)
        shape.CreateSubdivisionSchemeAttr(geometry.Tokens.none)
        shape.CreateExtentAttr(geometry.PointBased.ComputeExtent(shape.GetPointsAttr().Get()))
        _paint(shape, rgb(PLANE_COLOR))
    elif obstacle.kind == "shape":
        shape = _define_mesh(stage, path, obstacle)
        shape.CreateDoubleSidedAttr(True)
        _paint(shape, rgb(SOLID_COLOR))
    else:
        length = float(np.linalg.norm(obstacle.axis))
        shape = (geometry.Capsule if length > 0.0 else geometry.Sphere).Define(stage, path)
        shape.CreateRadiusAttr(obstacle.radius)
        if length > 0.0:
            shape.CreateHeightAttr(length)
            shape.CreateAxisAttr(geometry.Tokens.z)
        reach = np.array([obstacle.radius, obstacle.radius, obstacle.radius + 0.5 * length])
        shape.CreateExtentAttr([vectors.Vec3f(*(-reach).tolist()), vectors.Vec3f(*reach.tolist())])
        places = places + 0.5 * obstacle.axis  # a capsule of USD stands about its middle
        _paint(shape, rgb(SOLID_COLOR))
    shape.GetPrim().SetCustomDataByKey("obstacle", obstacle.name)
    move = shape.AddTranslateOp()
    still = not np.ptp(places, axis=0).any()
    for code, place in zip([None] if still else codes, places.tolist(), strict=False):
        at = () if code is None else (code,)
        move.Set(vectors.Vec3d(*place), *at)
    if obstacle.kind == "capsule" and np.any(obstacle.axis):
        turn = vectors.Rotation(vectors.Vec3d(0.0, 0.0, 1.0), vectors.Vec3d(*obstacle.axis.tolist())).GetQuat()
        shape.AddOrientOp().Set(vectors.Quatf(turn))


def _paint(shape: Any, color: FloatArray) -> None:
    """Give a shape a colour."""
    vectors = require("pxr.Gf", "export")
    shape.CreateDisplayColorAttr([vectors.Vec3f(*linear(color).tolist())])
