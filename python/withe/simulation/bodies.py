"""Motion of rigid bodies."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.handles import Body
from withe.parts.kinds import BodyPart
from withe.simulation.session import Session

__all__ = ["body_position", "body_rotation", "body_spin", "body_velocity", "set_body_velocity"]

FloatArray = npt.NDArray[np.float64]


def _find(session: Session, body: Body | str) -> BodyPart:
    return session.directory.find(body, BodyPart, "body")


def _center(session: Session, part: BodyPart) -> int:
    """Return the row of the centre of mass among the nodes."""
    return session.directory.row((-1 - part.index, 0))


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
    session.world.set_body_motion(part.index, v + np.cross(spin, arm), spin)
