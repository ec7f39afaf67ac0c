"""Motion of rigid bodies."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.outlines import BodyOutline
from withe.parts.directory import Directory
from withe.parts.handles import Body
from withe.parts.kinds import BodyPart
from withe.simulation.session import Session
from withe.solids import Sphere

__all__ = [
    "body_outlines",
    "body_position",
    "body_rotation",
    "body_spin",
    "body_velocity",
    "set_body_velocity",
]

FloatArray = npt.NDArray[np.float64]


def _find(session: Session, body: Body | str) -> BodyPart:
    return session.directory.find(body, BodyPart, "body")


def _center(session: Session, part: BodyPart) -> int:
    """Return the row of the centre of mass among the nodes."""
    return session.directory.row((-1 - part.index, 0))


def base_point(session: Session, node: object) -> FloatArray | None:
    """Return the point, as drawn, at which a support holds a body of a running scene; None for nodes of rods."""
    if not isinstance(node, Body | str) or not session.directory.is_body(node):
        return None
    part = _find(session, node)
    rows = session.directory.layout.rows(-1 - part.index)
    place = int(np.flatnonzero(rows == session.world.body_base(part.index))[0])
    return session.directory.layout.body_points[part.index][place]


def body_rotation(session: Session, body: Body | str) -> FloatArray:
    """Return the axes of a body, (3, 3); see `Simulation.rotation`."""
    part = _find(session, body)
    return np.asarray(session.world.body_rotation(part.index)) @ part.rotation


def body_position(session: Session, body: Body | str) -> FloatArray:
    """Return the origin of the axes of a body; see `Simulation.position`."""
    part = _find(session, body)
    turned = np.asarray(session.world.body_rotation(part.index))
    return np.asarray(session.world.positions()[_center(session, part)] + turned @ (part.position - part.center))


def body_spin(session: Session, body: Body | str) -> FloatArray:
    """Return the angular velocity of a body; see `Simulation.angular_velocity`."""
    return np.array(session.world.body_spin(_find(session, body).index))


def body_velocity(session: Session, body: Body | str) -> FloatArray:
    """Return the velocity of the origin of a body; see `Simulation.velocity`."""
    part = _find(session, body)
    spin = np.array(session.world.body_spin(part.index))
    arm = np.asarray(session.world.body_rotation(part.index)) @ (part.position - part.center)
    return np.asarray(session.world.velocities()[_center(session, part)] + np.cross(spin, arm))


def set_body_velocity(
    session: Session, body: Body | str, velocity: npt.ArrayLike | None, angular: npt.ArrayLike | None
) -> None:
    """Set the motion of a body; see `Simulation.set_velocity`."""
    part = _find(session, body)
    owner = f"body {part.name!r}"
    v = body_velocity(session, body) if velocity is None else validation.vector(velocity, f"velocity of {owner}")
    spin = body_spin(session, body) if angular is None else validation.vector(angular, f"angular velocity of {owner}")
    base = session.world.body_base(part.index)
    arm = np.asarray(session.world.positions()[base]) - body_position(session, body)
    moved = v + np.cross(spin, arm)
    held = moved if velocity is not None else np.asarray(session.world.velocities()[base])
    session.world.set_body_motion(part.index, moved, spin, held)


def body_outlines(directory: Directory) -> list[BodyOutline]:
    """Return the surfaces of bodies for records, each in the axes of its body."""
    return [_outline(part) for part in directory.all(BodyPart)]


def _outline(part: BodyPart) -> BodyOutline:
    """Return the surface of the solid; without a solid, a ball about the centre of mass.

    The radius of the ball is the radius of gyration, sqrt((J1 + J2 + J3) / (3 m)).
    """
    if part.solid is not None:
        vertices, triangles = part.solid.surface()
    else:
        vertices, triangles = Sphere(float(np.sqrt(np.trace(part.inertia) / (3.0 * part.mass)))).surface()
        vertices = vertices + part.rotation.T @ (part.center - part.position)
    return BodyOutline(part.name, *_cleaned(np.array(vertices, float), np.array(triangles, np.int64)))


def _cleaned(vertices: FloatArray, triangles: npt.NDArray[np.int64]) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Merge coincident vertices, and drop triangles without area: the poles of a ball are many points."""
    grid = np.rint(vertices / (1e-9 * np.abs(vertices).max()))
    _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    merged = inverse.reshape(-1)[triangles]
    has_area = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    return vertices[first], merged[has_area]
