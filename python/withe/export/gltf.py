"""Animated binary glTF 2.0: rods as skinned meshes, rigid bodies and obstacles as meshes.

A rod has one joint per node. Its mesh is drawn along the z axis, and the joints move it. A point at the place s of an
edge of length l, from 0 to 1, has the weights 1 - s and s. The nodes of the drawn mesh are l / 2 apart. Linear blending
of the joints then gives

    x = (1 - s) x0 + s x1 + (l / 2) s (1 - s) (t0 - t1),

with the positions x0, x1 and the tangents t0, t1 of the nodes: a parabola that is tangent to an arc at both nodes.

The file needs no package: a header, JSON and one block of numbers [Khronos Group 2021, glTF 2.0, sections 4.4 and 3.7].
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from withe._core import __version__
from withe.common.frames import Frames
from withe.common.outlines import BodyOutline, ObstacleOutline, RodOutline
from withe.view import scenery
from withe.view.bodies import body_points, shaded
from withe.view.colors import PLANE_COLOR, SOLID_COLOR, body_color, linear, rgb, rod_color
from withe.view.surfaces import end_caps, rectangle_section, ring_faces, round_section, unit

__all__ = ["node_frames", "quaternions", "write_glb"]

FloatArray = npt.NDArray[np.float64]

_SAMPLES, _SIDES = 4, 16  # rings per edge, corners of a round section
_STILL_RATE = 30.0  # frames per second of a record whose time stands still [1/s]
_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_VERTICES, _INDICES = 34962, 34963
_UPRIGHT = [-float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5))]  # turns z up into y up


def write_glb(record: Frames, path: Path) -> None:
    """Write an animated binary glTF.

    Parameters
    ----------
    record : Record
    path : pathlib.Path
    """
    document = _Document()
    times = _film_times(record.times)
    clock = document.numbers(times, _FLOAT, limits=True) if len(times) > 1 else None
    root = document.node(name="withe", rotation=_UPRIGHT, children=[])
    document.scene.append(root)
    for index, rod in enumerate(record.rods):
        _add_rod(document, record, rod, clock, root, document.material(rod.name, rod_color(index)))
    for index, body in enumerate(record.bodies):
        _add_body(document, record, body, clock, root, document.material(body.name, body_color(index)))
    nodes = np.concatenate([record.positions().reshape(-1, 3), body_points(record)])
    for obstacle in record.obstacles:
        _add_obstacle(document, record, obstacle, nodes, clock, root)
    document.write(path)


def node_frames(positions: FloatArray, first: FloatArray, closed: bool) -> FloatArray:
    """Return a frame for each node: the mean of its edges. End tangents continue the turn of the first and last edge.

    Parameters
    ----------
    positions : ndarray of shape (frames, nodes, 3) [m]
    first : ndarray of shape (frames, edges, 3)
        First director of each edge.
    closed : bool

    Returns
    -------
    ndarray of shape (frames, nodes, 3, 3)
        Rows d1, d2, tangent.
    """
    edges = unit(np.diff(positions, axis=1, append=positions[:, :1] if closed else positions[:, :0]))
    tangents = _mean_of_edges(edges, closed)
    if not closed and edges.shape[1] > 1:
        for end, inner in ((0, 1), (-1, -2)):
            along = np.sum(edges[:, end] * tangents[:, inner], axis=-1, keepdims=True)
            tangents[:, end] = 2.0 * along * edges[:, end] - tangents[:, inner]
    directors = _mean_of_edges(first, closed)
    directors -= np.sum(directors * tangents, axis=-1, keepdims=True) * tangents
    directors = unit(directors)
    return np.stack([directors, np.cross(tangents, directors), tangents], axis=-2)


def _mean_of_edges(vectors: FloatArray, closed: bool) -> FloatArray:
    """Unit vectors of nodes between those of their edges; that of the next edge where both are opposite."""
    before = np.roll(vectors, 1, axis=1) if closed else np.concatenate([vectors[:, :1], vectors], axis=1)
    after = vectors if closed else np.concatenate([vectors, vectors[:, -1:]], axis=1)
    mean = before + after
    opposite = np.linalg.norm(mean, axis=-1, keepdims=True) < 1e-6
    return unit(np.where(opposite, after, mean))


def _add_rod(document: _Document, record: Frames, rod: RodOutline, clock: int | None, root: int, material: int) -> None:
    positions = record.positions(rod)
    frames = node_frames(positions, record.directors(rod)[:, :, 0], rod.closed)
    if rod.closed:  # a joint has one place in the drawn mesh, so the first node is also a last one
        positions, frames = (np.concatenate([values, values[:, :1]], axis=1) for values in (positions, frames))
    lengths = np.linalg.norm(np.diff(positions, axis=1), axis=-1).mean(axis=0)
    drawn = np.concatenate([[0.0], np.cumsum(0.5 * lengths)])
    rotations = quaternions(frames)
    joints = []
    for index in range(positions.shape[1]):
        places, turns = positions[:, index], rotations[:, index]
        joint = document.node(name=f"{rod.name} {index}", translation=places[0].tolist(), rotation=turns[0].tolist())
        joints.append(joint)
        if clock is not None:
            document.animate(joint, "translation", clock, places)
            document.animate(joint, "rotation", clock, turns)
    document.gltf["nodes"][root]["children"] += joints
    inverse = np.tile(np.eye(4), (len(drawn), 1, 1))
    inverse[:, 3, 2] = -drawn  # glTF has columns first
    skin = document.add(
        "skins",
        {
            "name": rod.name,
            "joints": joints,
            "skeleton": root,
            "inverseBindMatrices": document.numbers(inverse.reshape(-1, 16), _FLOAT),
        },
    )
    mesh = document.mesh(rod.name, material, *_tube(rod, lengths, drawn))
    document.scene.append(document.node(name=f"{rod.name} surface", mesh=mesh, skin=skin))


def _tube(
    rod: RodOutline, lengths: FloatArray, drawn: FloatArray
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64], npt.NDArray[np.int64], FloatArray]:
    """Points, normals, triangles, joints and weights of the mesh of a rod, drawn along the z axis."""
    share = np.arange(_SAMPLES) / _SAMPLES
    edge = np.append(np.repeat(np.arange(rod.edges), _SAMPLES), rod.edges - 1)
    share = np.append(np.tile(share, rod.edges), 1.0)
    centres = (1.0 - share) * drawn[edge] + share * drawn[edge + 1]
    half = 0.5 * rod.widths if rod.widths is not None else np.stack([rod.radii, rod.radii], axis=1)
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    middles, samples = 0.5 * (knots[1:] + knots[:-1]), knots[edge] + share * lengths[edge]
    period = knots[-1] if rod.closed else None
    half = np.stack([np.interp(samples, middles, side, period=period) for side in half.T], axis=1)
    section, section_normals = round_section(_SIDES) if rod.widths is None else rectangle_section()
    caps = np.zeros((0, 3)) if rod.closed else end_caps(rod.widths is None)

    count = len(caps)
    rings = np.concatenate([np.zeros(count, int), np.arange(len(samples)), np.full(count, len(samples) - 1)])
    none = np.zeros(len(samples))
    scale = np.concatenate([caps[:, 0], none + 1.0, caps[::-1, 0]])
    along = np.concatenate([-caps[:, 1], none, caps[::-1, 1]])
    lean = np.concatenate([-caps[:, 2], none, caps[::-1, 2]])
    corners = section * (half[rings] * scale[:, None])[:, None]
    heights = np.broadcast_to((centres[rings] + along * half[rings, 0])[:, None, None], (*corners.shape[:2], 1))
    flat = np.sqrt(1.0 - lean**2)[:, None, None]
    normals = np.concatenate(
        [flat * section_normals, np.broadcast_to(lean[:, None, None], (*corners.shape[:2], 1))], axis=-1
    )
    faces = ring_faces(len(rings), len(section), False)
    weights = np.stack([1.0 - share, share], axis=1)
    joints = np.where(weights > 0.0, np.stack([edge, edge + 1], axis=1), 0)  # joint 0 where the weight is 0
    return (
        np.concatenate([corners, heights], axis=-1).reshape(-1, 3),
        normals.reshape(-1, 3),
        np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]]),
        np.repeat(np.pad(joints[rings], [(0, 0), (0, 2)]), len(section), axis=0),
        np.repeat(np.pad(weights[rings], [(0, 0), (0, 2)]), len(section), axis=0),
    )


def _add_body(
    document: _Document, record: Frames, body: BodyOutline, clock: int | None, root: int, material: int
) -> None:
    """Add a body as a node that moves and turns."""
    places = record.body_position(body)
    turns = quaternions(np.swapaxes(record.body_rotation(body), -1, -2)[:, None])[:, 0]
    points, normals = shaded(body)
    mesh = document.mesh(body.name, material, points, normals, np.arange(len(points)).reshape(-1, 3))
    node = document.node(name=body.name, mesh=mesh, translation=places[0].tolist(), rotation=turns[0].tolist())
    document.gltf["nodes"][root]["children"].append(node)
    if clock is not None:
        document.animate(node, "translation", clock, places)
        document.animate(node, "rotation", clock, turns)


def _add_obstacle(
    document: _Document, record: Frames, obstacle: ObstacleOutline, nodes: FloatArray, clock: int | None, root: int
) -> None:
    places = record.obstacle_position(obstacle)
    if not len(scenery.framing(obstacle, places, nodes)):
        return  # far away or huge, so that it would move the cameras of viewers
    origin = np.zeros(3)
    if obstacle.kind == "plane":
        points = scenery.patch(obstacle, places[0], nodes) - places[0]
        normals = np.tile(obstacle.axis / np.linalg.norm(obstacle.axis), (4, 1))
        triangles = np.array([[0, 1, 2], [0, 2, 3]])
        material = document.material(obstacle.name, rgb(PLANE_COLOR), two_sided=True)
    elif obstacle.kind == "shape":
        points, normals = shaded(obstacle)
        triangles = np.arange(len(points)).reshape(-1, 3)
        material = document.material(obstacle.name, rgb(SOLID_COLOR), two_sided=True)
    else:
        grid = scenery.surface(obstacle, origin)
        first, second = scenery.ends(obstacle, origin)
        square = float((second - first) @ (second - first))
        share = np.clip(grid @ (second - first) / square, 0.0, 1.0) if square > 0.0 else np.zeros(grid.shape[:2])
        normals = unit(grid - share[..., None] * (second - first)).reshape(-1, 3)
        points = grid.reshape(-1, 3)
        ring, side = (index.ravel() for index in np.indices((grid.shape[0] - 1, grid.shape[1] - 1)))
        first_corner = ring * grid.shape[1] + side
        above = first_corner + grid.shape[1]
        triangles = np.concatenate(
            [
                np.stack([first_corner, first_corner + 1, above + 1], axis=1),
                np.stack([first_corner, above + 1, above], axis=1),
            ]
        )
        material = document.material(obstacle.name, rgb(SOLID_COLOR))
    mesh = document.mesh(obstacle.name, material, points, normals, triangles)
    node = document.node(name=obstacle.name, mesh=mesh, translation=places[0].tolist())
    document.gltf["nodes"][root]["children"].append(node)
    if clock is not None and np.ptp(places, axis=0).any():
        document.animate(node, "translation", clock, places)


def _film_times(times: FloatArray) -> FloatArray:
    """Times of the frames from the first on [s]; evenly spaced if the time does not advance."""
    advances = np.all(np.diff(times) > 0.0)
    return np.asarray(times - times[0] if advances else np.arange(len(times)) / _STILL_RATE, np.float64)


def quaternions(frames: FloatArray) -> FloatArray:
    """Return quaternions x, y, z, w without changes of sign from frame to frame, shape (frames, nodes, 4).

    Parameters
    ----------
    frames : ndarray of shape (frames, nodes, 3, 3)
        Unit vectors as rows.
    """
    from scipy.spatial.transform import Rotation

    matrices = np.swapaxes(frames, -1, -2).reshape(-1, 3, 3)
    found = Rotation.from_matrix(matrices).as_quat().reshape(*frames.shape[:2], 4)
    same = np.sign(np.sum(found[1:] * found[:-1], axis=-1))
    signs = np.cumprod(np.concatenate([np.ones((1, found.shape[1])), np.where(same == 0.0, 1.0, same)]), axis=0)
    return np.asarray(found * signs[..., None], np.float64)


class _Document:
    """JSON of a glTF file and its block of numbers."""

    def __init__(self) -> None:
        self.scene: list[int] = []
        self.gltf: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"withe {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": self.scene}],
            "nodes": [],
        }
        self._block = bytearray()

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Append an entry to a list of the document, and return its index."""
        entries = self.gltf.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def node(self, **entry: Any) -> int:
        """Append a node, and return its index."""
        return self.add("nodes", entry)

    def numbers(self, values: npt.NDArray[Any], component: int, target: int | None = None, limits: bool = False) -> int:
        """Append an array of numbers, and return its index; `limits` states their range."""
        packed = np.ascontiguousarray(values, {_FLOAT: "<f4", _USHORT: "<u2", _UINT: "<u4"}[component])
        view = {"buffer": 0, "byteOffset": len(self._block), "byteLength": packed.nbytes}
        if target is not None:
            view["target"] = target
        self._block += packed.tobytes()
        self._block += bytes(-len(self._block) % 4)
        entry = {
            "bufferView": self.add("bufferViews", view),
            "componentType": component,
            "count": len(packed),
            "type": _SHAPES[1 if packed.ndim == 1 else packed.shape[1]],
        }
        if limits:
            low, high = np.atleast_1d(packed.min(axis=0)), np.atleast_1d(packed.max(axis=0))
            entry |= {"min": low.tolist(), "max": high.tolist()}
        return self.add("accessors", entry)

    def material(self, name: str, color: FloatArray, two_sided: bool = False) -> int:
        """Append a matt material, and return its index."""
        surface = {"baseColorFactor": [*linear(color).tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6}
        return self.add("materials", {"name": name, "pbrMetallicRoughness": surface, "doubleSided": two_sided})

    def mesh(
        self,
        name: str,
        material: int,
        points: FloatArray,
        normals: FloatArray,
        triangles: npt.NDArray[np.int64],
        joints: npt.NDArray[np.int64] | None = None,
        weights: FloatArray | None = None,
    ) -> int:
        """Append a mesh of triangles, and return its index."""
        attributes = {
            "POSITION": self.numbers(points, _FLOAT, _VERTICES, limits=True),
            "NORMAL": self.numbers(normals, _FLOAT, _VERTICES),
        }
        if joints is not None and weights is not None:
            attributes["JOINTS_0"] = self.numbers(joints, _USHORT, _VERTICES)
            attributes["WEIGHTS_0"] = self.numbers(weights, _FLOAT, _VERTICES)
        corners = self.numbers(triangles.ravel(), _UINT, _INDICES)
        primitive = {"attributes": attributes, "indices": corners, "material": material}
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def animate(self, node: int, path: str, clock: int, values: FloatArray) -> None:
        """Move a node over time: a row of values for each frame."""
        if "animations" not in self.gltf:
            self.add("animations", {"name": "motion", "samplers": [], "channels": []})
        motion = self.gltf["animations"][0]
        sampler = {"input": clock, "output": self.numbers(values, _FLOAT), "interpolation": "LINEAR"}
        motion["channels"].append({"sampler": len(motion["samplers"]), "target": {"node": node, "path": path}})
        motion["samplers"].append(sampler)

    def write(self, path: Path) -> None:
        """Write the binary file."""
        self.gltf["buffers"] = [{"byteLength": len(self._block)}]
        text = json.dumps(self.gltf, separators=(",", ":"), ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(self._block)
        with path.open("wb") as stream:
            stream.write(struct.pack("<4sII", b"glTF", 2, size))
            stream.write(struct.pack("<I4s", len(text), b"JSON") + text)
            stream.write(struct.pack("<I4s", len(self._block), b"BIN\0") + self._block)
