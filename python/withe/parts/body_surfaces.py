"""Surfaces of rigid bodies that touch: how they are made, and described to the engine."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.common.polyhedra import Core, inside, polyhedron_core, trails
from withe.common.union_find import UnionFind
from withe.parts.directory import Directory
from withe.parts.kinds import BodyFace, BodyPart, BodySurface, JoinPart, ObstaclePart, RodPart
from withe.solids import Box, Capsule, Hull, Mesh, Sphere

__all__ = [
    "check_surfaces",
    "core_of",
    "describe_surfaces",
    "ignored",
    "make_surface",
    "place_surfaces",
    "surfaces_of",
]

FloatArray = npt.NDArray[np.float64]
# Length of the core of a ball over its radius: the ball turns with it, and it must not show.
_POINT = 1e-3
# Depth of the planes of faces over the radius of edges: what yields in impacts does not bring a corner to the plane.
_DEPTH = 2.0
# Default radius of rounded edges over the thinnest extent.
_SHARP = 2e-4


def core_of(solid: object) -> Core | None:
    """Return what a solid touches by; None: it is only drawn."""
    if isinstance(solid, Sphere | Capsule):
        radius = float(solid.radius)
        half = 0.5 * (_POINT * radius if isinstance(solid, Sphere) else float(solid.length))
        return Core(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), np.array([[0, 1]]), radius)
    if isinstance(solid, Box | Hull | Mesh):
        vertices, triangles = solid.surface()
        sharp = _SHARP * float(np.ptp(vertices, axis=0).min())
        return polyhedron_core(vertices, triangles, sharp if solid.rounding is None else float(solid.rounding))
    return None


def make_surface(
    core: Core, owner: str, origin: FloatArray, axes: FloatArray, friction: float | None, restitution: float | None
) -> BodySurface:
    """Make the surface of a body from the core of its solid; see `Scene.add_body`.

    It is one chain of nodes: a walk along the segments of the core, and the normals of its faces. Edges that only
    connect others have no radius.
    """
    walk = trails(core.segments)
    left = {frozenset(segment): k for k, segment in enumerate(core.segments.tolist())}
    radii, beside = [], []
    for tail, head in itertools.pairwise(walk):
        segment = left.pop(frozenset((tail, head)), None)
        radii.append(0.0 if segment is None else core.radius)
        faces_beside = [-1, -1] if segment is None or not core.faces else core.beside[segment].tolist()
        is_reversed = segment is not None and core.segments[segment, 0] != tail
        beside.append(faces_beside[::-1] if is_reversed else faces_beside)
    points = [core.points[walk]]
    faces, depth = [], _DEPTH * core.radius
    for surface, normal in core.faces:
        outline = surface - depth * normal
        middle = 0.5 * (outline.min(axis=(0, 1)) + outline.max(axis=(0, 1)))
        middle += ((outline[0, 0] - middle) @ normal) * normal
        size = float(np.linalg.norm(outline - middle, axis=-1).max())
        ways = core.points[walk] - middle
        flat = ways - (ways @ normal)[:, None] * normal
        aside = int(np.linalg.norm(flat, axis=1).argmax())
        first = flat[aside] / np.linalg.norm(flat[aside])
        plane = (outline - middle) @ np.column_stack([first, np.cross(normal, first)])
        radii += [0.0, 0.0]
        beside += [[-1, -1], [-1, -1]]
        points.append(np.array([middle, middle + size * normal]))
        faces.append(BodyFace(len(radii) - 1, aside, depth, plane.reshape(-1, 4)))
    return BodySurface(
        core,
        origin + np.concatenate(points) @ axes.T,
        np.array(radii),
        tuple(faces),
        beside if faces else [],
        None if friction is None else validation.non_negative(friction, f"friction of {owner}"),
        None if restitution is None else validation.share(restitution, f"restitution of {owner}"),
    )


def surfaces_of(directory: Directory) -> list[BodyPart]:
    """Bodies that touch others, in the order in which the engine has their surfaces after all rods.

    Without contact and obstacles, surfaces serve to warn of parts that pass through each other. Faces do not warn, and
    are left out, so that such a scene may be planar.
    """
    touch = _has_contact(directory)
    surfaces = [(body, body.surface) for body in directory.all(BodyPart)]
    return [body for body, surface in surfaces if surface is not None and (touch or not surface.faces)]


def place_surfaces(directory: Directory) -> None:
    """Give the bodies of a scene that is built the points of their surfaces, where these may touch something."""
    for body in surfaces_of(directory) if _may_touch(directory) else ():
        if body.surface is not None and not body.surface.nodes:
            nodes = directory.layout.add_surface(body.index, body.surface.points)
            directory.parts[body.name] = replace(body, surface=replace(body.surface, nodes=nodes))


def describe_surfaces(directory: Directory) -> list[_core.RodDescription]:
    """Surfaces of bodies for the engine: edges without mass and stiffness that their bodies carry.

    Empty where they cannot touch anything, so that such a scene may be planar.
    """
    found = []
    for body in surfaces_of(directory):
        surface = body.surface
        if surface is None or not surface.nodes:
            continue
        ways = np.diff(surface.points, axis=0)
        lengths = np.linalg.norm(ways, axis=1)
        aside = np.cross(ways, np.eye(3)[np.abs(ways).argmin(axis=1)])
        edges = len(ways)
        description = _core.RodDescription()
        description.name, description.body = body.name, body.index
        description.nodes = [directory.row(node) for node in surface.nodes]
        description.directors = aside / np.linalg.norm(aside, axis=1)[:, None]
        description.rest_lengths = description.arc_lengths = lengths
        description.contact_radius = surface.radii
        for word in ("stretch_stiffness", "twist_stiffness", "line_density", "rotary_inertia", "viscous_time", "drag"):
            setattr(description, word, np.zeros(edges))
        description.bend_stiffness = np.zeros((edges, 2))
        description.fluid_radius = np.zeros(edges)
        description.natural_curvature, description.natural_twist = np.zeros((edges - 1, 2)), np.zeros(edges - 1)
        description.friction = -1.0 if surface.friction is None else surface.friction
        description.restitution = -1.0 if surface.restitution is None else surface.restitution
        description.faces = [_describe_face(face) for face in surface.faces]
        description.edge_faces = surface.beside
        found.append(description)
    return found


def check_surfaces(directory: Directory) -> None:
    """Refuse what faces of bodies do not touch, and what is drawn inside of bodies.

    Raises
    ------
    ValueError
        An obstacle other than a plane beside a body with faces, or a rod or body inside of such a body.
    """
    surfaces = [(body, body.surface) for body in surfaces_of(directory) if body.surface is not None]
    with_faces = [(body, surface.core) for body, surface in surfaces if surface.faces]
    for body, _ in with_faces:
        for obstacle in directory.all(ObstaclePart):
            if obstacle.kind != "plane" and not ignored(directory, body.name, obstacle.name):
                instead = (
                    "Add it as a body, by add_body and a sphere or capsule of withe.solids, and hold it with clamp; or"
                    if obstacle.kind == "capsule"
                    else "Use a sphere or capsule as body, or"
                )
                raise ValueError(
                    f"obstacle {obstacle.name!r} does not touch the faces of body {body.name!r}. {instead} leave the "
                    "pair out with ignore_contact"
                )
    if not directory.contact.rods:
        return
    lines = [(rod.name, rod.index, "rod", rod.points[None]) for rod in directory.all(RodPart)]
    for body, surface in surfaces:
        ends = (body.position + surface.core.points @ body.rotation.T)[surface.core.segments]
        lines.append((body.name, -1 - body.index, "body", ends))
    for body, core in with_faces:
        step = 0.5 * float(np.ptp(core.points, axis=0).min())
        rows = directory.layout.rows(-1 - body.index)
        for name, owner, what, polylines in lines:
            if np.intersect1d(directory.layout.rows(owner), rows).size or ignored(directory, body.name, name):
                continue
            points = np.concatenate([_along(polyline, step) for polyline in polylines])
            if inside(core.points, core.triangles, (points - body.position) @ body.rotation).any():
                raise ValueError(
                    f"{what} {name!r} is drawn inside of body {body.name!r}: draw them apart, join them, or leave the "
                    "pair out with ignore_contact"
                )


def _along(points: FloatArray, step: float) -> FloatArray:
    """Return points along a polyline, not farther than a step from each other."""
    counts = np.ceil(np.linalg.norm(np.diff(points, axis=0), axis=1) / step).astype(int).clip(1, 1000)
    found = [
        start + np.arange(count)[:, None] / count * (end - start)
        for start, end, count in zip(points, points[1:], counts, strict=False)
    ]
    return np.concatenate([*found, points[-1:]])


def ignored(directory: Directory, first: str, second: str) -> bool:
    """Return True if two parts may not touch each other."""
    contact = directory.contact
    pair = contact.pairs.get((first, second)) or contact.pairs.get((second, first))
    groups = contact.groups
    return (pair is not None and pair.ignored) or (first in groups and groups.get(first) == groups.get(second))


def _describe_face(face: BodyFace) -> _core.FaceDescription:
    description = _core.FaceDescription()
    description.edge, description.aside = face.edge, face.aside
    description.depth, description.outline = face.depth, face.outline
    return description


def _has_contact(directory: Directory) -> bool:
    return bool(directory.contact.rods or directory.contact.pairs or directory.all(ObstaclePart))


def _may_touch(directory: Directory) -> bool:
    """Return True if there is contact, or if parts that are not joined may pass through each other without it."""
    if _has_contact(directory):
        return True
    if directory.contact.rods is not None:
        return False
    rods = len(directory.layout.rods)
    count = rods + len(directory.layout.body_points)
    parts = UnionFind(count)
    for loop in directory.loops:
        parts.unite(rods + loop.body, rods + loop.copy)
    place = [owner if owner >= 0 else rods - 1 - owner for join in directory.all(JoinPart) for owner, _ in join.nodes]
    for first, second in zip(place[::2], place[1::2], strict=True):
        parts.unite(first, second)
    return len({parts.find(i) for i in range(count)}) > 1
