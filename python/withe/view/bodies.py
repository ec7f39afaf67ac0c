"""Rigid bodies in pictures: shaded surfaces with sharp edges, and what casts their shadows."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames
from withe.common.outlines import BodyOutline, ObstacleOutline
from withe.view.colors import body_color

__all__ = ["BodySurfaces", "Pose", "body_points", "mixed_rotations", "shaded", "silhouette", "triangle_normals"]

FloatArray = npt.NDArray[np.float64]
Pose = tuple[FloatArray, FloatArray]  # position (3,) [m] and rotation (3, 3)

_SHARP = 35.0  # angle between faces above which the edge between them is drawn sharp [degrees]
_SHADOW_POINTS = 3000  # that cast the shadow of one body
_FRAMED_VERTICES, _FRAMED_FRAMES = 60, 100  # of each body, for the camera
_MOVED = 0.1  # displacement of a ghost, relative to the size of its body
_PAPER = np.array([0.93, 0.94, 0.95])


class BodySurfaces:
    """The bodies of a record on a stage.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    record : Frames

    Attributes
    ----------
    positions : list of ndarray of shape (frames, 3) [m]
    rotations : list of ndarray of shape (frames, 3, 3)
        Motion of each body.
    """

    def __init__(self, pyvista: Any, plotter: Any, record: Frames) -> None:
        self._pyvista, self._plotter, self._bodies = pyvista, plotter, record.bodies
        self.positions: list[FloatArray] = [record.body_position(body) for body in record.bodies]
        self.rotations: list[FloatArray] = [record.body_rotation(body) for body in record.bodies]
        self._actors = [self._add(body, body_color(index)) for index, body in enumerate(record.bodies)]
        self._spread = [_spread(body) for body in record.bodies]
        self._at_rest: list[tuple[FloatArray, FloatArray]] = []  # shadows of ghosts
        self._casting: list[tuple[FloatArray, FloatArray]] = []

    def _add(self, body: BodyOutline, color: FloatArray) -> Any:
        actor = self._plotter.add_mesh(
            shaded_mesh(self._pyvista, body),
            color=color,
            ambient=0.3,
            diffuse=0.8,
            specular=0.2,
            specular_power=20.0,
            reset_camera=False,
        )
        actor.prop.interpolation = "Phong"
        return actor

    def add_ghost(self, frame: int, later: list[int], strength: float) -> list[Any]:
        """Add the bodies of one frame in pale colours, at rest, where they differ from those of later frames.

        Returns the actors.
        """
        actors = []
        for index, body in enumerate(self._bodies):
            poses = body.placed(self.positions[index], self.rotations[index])
            size = float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
            moved = [np.linalg.norm(poses[frame] - poses[other], axis=1).max() > _MOVED * size for other in later]
            if not all(moved):
                continue
            place, turn = self.positions[index][frame], self.rotations[index][frame]
            actor = self._add(body, strength * body_color(index) + (1.0 - strength) * _PAPER)
            actor.user_matrix = _matrix(place, turn)
            self._at_rest.append(_cast(self._spread[index], place, turn))
            actors.append(actor)
        return actors

    def show(self, poses: list[Pose]) -> None:
        """Move the bodies to positions, shape (3,) [m], and rotations, shape (3, 3)."""
        self._casting = list(self._at_rest)
        for actor, spread, (place, turn) in zip(self._actors, self._spread, poses, strict=True):
            actor.user_matrix = _matrix(place, turn)
            self._casting.append(_cast(spread, place, turn))

    @property
    def casting(self) -> list[tuple[FloatArray, FloatArray]]:
        """Return points that cast shadows, shape (points, 3) [m], and the area of each seen from above [m^2]."""
        return self._casting


def body_points(record: Frames, frames: list[int] | None = None) -> FloatArray:
    """Return points on the surfaces of all bodies in some frames, by default all, for the camera, (any, 3) [m]."""
    found = [np.zeros((0, 3))]
    for body in record.bodies:
        chosen = frames
        if chosen is None:
            count = min(len(record), _FRAMED_FRAMES)
            chosen = np.unique(np.linspace(0, len(record) - 1, count).round().astype(int)).tolist()
        step = -(-len(body.vertices) // _FRAMED_VERTICES)
        few = BodyOutline(body.name, body.vertices[::step], body.triangles)
        found.append(few.placed(record.body_position(body)[chosen], record.body_rotation(body)[chosen]).reshape(-1, 3))
    return np.concatenate(found)


def mixed_rotations(before: FloatArray, after: FloatArray, share: float) -> FloatArray:
    """Return the rotation between two, shape (3, 3): the one that is nearest to their weighted mean."""
    left, _, right = np.linalg.svd((1.0 - share) * before + share * after)
    left[:, -1] *= np.sign(np.linalg.det(left @ right))
    return np.asarray(left @ right)


def triangle_normals(points: FloatArray, triangles: npt.NDArray[np.int64]) -> FloatArray:
    """Return outward normals of triangles, whose length is twice the area, shape (triangles, 3) [m^2]."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.asarray(np.cross(b - a, c - a))


def shaded_mesh(pyvista: Any, body: BodyOutline | ObstacleOutline) -> Any:
    """Return a surface with its normals, as PyVista has it."""
    points, normals = shaded(body)
    faces = np.column_stack([np.full(len(body.triangles), 3), np.arange(len(points)).reshape(-1, 3)])
    mesh = pyvista.PolyData(points, faces.ravel())
    mesh.point_data.active_normals = normals
    return mesh


def shaded(body: BodyOutline | ObstacleOutline) -> tuple[FloatArray, FloatArray]:
    """Return the corners of all triangles and their normals: smooth surfaces between sharp edges.

    Returns
    -------
    points, normals : ndarrays of shape (3 * triangles, 3)
        In the axes of the body.
    """
    normals = triangle_normals(body.vertices, body.triangles)
    units = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    vertices = body.triangles.ravel()
    order = np.argsort(vertices, kind="stable")
    found = np.empty((len(vertices), 3))
    for corners in np.split(order, np.flatnonzero(np.diff(vertices[order])) + 1):
        faces = corners // 3
        found[corners] = (units[faces] @ units[faces].T > np.cos(np.radians(_SHARP))) @ normals[faces]
    return body.vertices[vertices], found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300)


def silhouette(points: FloatArray, triangles: npt.NDArray[np.int64], towards: FloatArray) -> npt.NDArray[np.int64]:
    """Return the edges of a closed surface between triangles that face a viewer and those that do not.

    Parameters
    ----------
    points : ndarray of shape (points, 3) [m]
    triangles : ndarray of int, shape (triangles, 3)
    towards : ndarray of shape (3,)
        Direction to the viewer, far away.

    Returns
    -------
    ndarray of int, shape (edges, 2)
        Rows of `points`.
    """
    normals = triangle_normals(points, triangles)
    # A face on edge does not face the viewer, whatever rounding says.
    shown = triangles[normals @ towards > 1e-9 * np.linalg.norm(normals, axis=1)]
    edges = np.concatenate([shown[:, [0, 1]], shown[:, [1, 2]], shown[:, [2, 0]]])
    _, first, counts = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(edges[first[counts == 1]])


def _matrix(place: FloatArray, turn: FloatArray) -> FloatArray:
    """Homogeneous matrix of a pose, shape (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, place
    return matrix


def _spread(body: BodyOutline) -> tuple[FloatArray, FloatArray]:
    """Points evenly spread over a surface, and the area of each times its normal, in the axes of the body."""
    normals = 0.5 * triangle_normals(body.vertices, body.triangles)
    areas = np.linalg.norm(normals, axis=1)
    counts = np.maximum(1, np.rint(_SHADOW_POINTS * areas / areas.sum()).astype(int))
    which = np.repeat(np.arange(len(areas)), counts)
    # Even in a square by the sequence of the plastic number, and folded into a triangle [Roberts 2018].
    u, v = (np.arange(len(which))[:, None] * np.array([0.7548776662466927, 0.5698402909980532]) % 1.0).T
    beyond = u + v > 1.0
    u, v = np.where(beyond, 1.0 - u, u), np.where(beyond, 1.0 - v, v)
    a, b, c = (body.vertices[body.triangles[which, corner]] for corner in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points, normals[which] / counts[which, None]


def _cast(spread: tuple[FloatArray, FloatArray], place: FloatArray, turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points that cast a shadow and the area of each seen from above; both sides of a body share the area."""
    points, normals = spread
    return points @ turn.T + place, 0.5 * np.abs(normals @ turn[2])
