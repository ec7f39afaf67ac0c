"""Obstacles, moved while a simulation runs, and friction, changed then."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.outlines import ObstacleOutline
from withe.parts.contacts import Body, BodyPair, body_of, touching
from withe.parts.directory import Directory
from withe.parts.friction import Friction, check_law, friction_pair, with_obstacle, with_pair
from withe.parts.handles import Handle, Obstacle
from withe.parts.kinds import ObstaclePart, RodPart
from withe.simulation.motion import Path
from withe.simulation.session import Session

__all__ = [
    "find_obstacle",
    "move_obstacle",
    "obstacle_outlines",
    "obstacle_pose",
    "set_obstacle_friction",
    "set_pair_friction",
    "set_scene_friction",
]

FloatArray = npt.NDArray[np.float64]


def find_obstacle(directory: Directory, handle: Handle | str) -> tuple[int, str] | None:
    """Index and name of an obstacle; None where it is something else."""
    name = directory.find(handle, ObstaclePart, "obstacle").name if isinstance(handle, Obstacle) else handle
    names = [part.name for part in directory.all(ObstaclePart)]
    return (names.index(name), name) if isinstance(name, str) and name in names else None


def move_obstacle(
    session: Session,
    index: int,
    name: str,
    position: npt.ArrayLike | None,
    tangent: npt.ArrayLike | None,
    roll: float | None,
    over: float,
    path: Path | None,
) -> None:
    """Move an obstacle; see `Simulation.move`."""
    over = validation.non_negative(over, "over")
    if path is not None:
        if any(value is not None for value in (position, tangent, roll)) or over != 0.0:
            raise ValueError(f"path of {name!r} must be given alone")
        validation.function(path, f"path of {name!r}")
        obstacle_pose(session, index, path, session.world.time)
        session.settings.paths[name] = path
        return
    if position is None and roll is None:
        raise ValueError(f"position, roll or path of {name!r} must be given")
    place, turn = np.array(session.world.obstacle_position(index)), np.array(session.world.obstacle_turn(index))
    if position is not None:
        place = validation.vector(position, f"position of {name!r}")
    axis = session.directory.all(ObstaclePart)[index].axis
    if (tangent is None) != (axis is not None or roll is None):
        what = "a sphere turns about the tangent that is given with a roll"
        raise ValueError(
            f"tangent of {name!r} must be given: {what}"
            if tangent is None
            else f"tangent of {name!r} must be None: only {what}, others about their axis"
        )
    if roll is not None:
        about = validation.unit_vector(tangent, f"tangent of {name!r}") if axis is None else axis
        turn = validation.number(roll, f"roll of {name!r}") * about
    session.world.move_obstacle(index, place, turn, over)
    session.settings.paths.pop(name, None)


def obstacle_pose(session: Session, index: int, path: Path, time: float) -> tuple[FloatArray, FloatArray]:
    """Where the path of an obstacle leads, and how it has turned since it was drawn [rad]."""
    part = session.directory.all(ObstaclePart)[index]
    value = path(time)
    what = f"path of {part.name!r} at t = {time:g}"
    if not (isinstance(value, tuple | list) and len(value) == 2):
        return validation.vector(value, what), np.array(session.world.obstacle_turn(index))
    place, roll = validation.vector(value[0], f"position on the {what}"), f"roll on the {what}"
    if part.axis is None:
        return place, validation.vector(value[1], roll)
    return place, validation.number(value[1], roll) * part.axis


def obstacle_outlines(directory: Directory) -> list[ObstacleOutline]:
    """What records keep of obstacles."""
    return [
        ObstacleOutline(
            part.name,
            part.kind,
            np.array(part.other if part.kind == "plane" else part.other - part.point, float),
            float(part.radius),
        )
        for part in directory.all(ObstaclePart)
    ]


def set_pair_friction(session: Session, a: Body, b: Body, friction: Friction) -> None:
    """Give two bodies another friction coefficient of their own; see `Simulation.set_friction`."""
    first, second = (touching(session.directory, body) for body in (a, b))
    if isinstance(first, ObstaclePart) and isinstance(second, ObstaclePart):
        raise ValueError(f"{first.name!r} and {second.name!r} are both obstacles, which never touch")
    what = f"friction of {first.name!r} and {second.name!r}"
    rods = isinstance(first, RodPart) and isinstance(second, RodPart)
    pair = friction_pair(friction, what, directed=not rods)
    contact = session.world.contact
    if rods and not contact.rods:
        raise ValueError(f"{what} cannot be set: rods do not touch in this scene, see Scene.enable_contact")
    check_law(pair, contact.friction_law, what)
    bodies = body_of(session.directory, first), body_of(session.directory, second)
    session.world.set_friction(with_pair(contact, bodies, pair))
    session.note("set_friction", BodyPair(first, second), {"friction": friction})


def set_obstacle_friction(session: Session, part: ObstaclePart, value: Friction) -> None:
    """Change the friction coefficients of an obstacle."""
    what = f"friction of {part.name!r}"
    pair = friction_pair(value, what)
    contact = session.world.contact
    check_law(pair, contact.friction_law, what)
    index = session.directory.all(ObstaclePart).index(part)
    session.world.set_friction(with_obstacle(contact, index, pair))


def set_scene_friction(session: Session, values: dict[str, Any]) -> None:
    """Change the friction coefficient of all rods with each other, and the slip tolerance of all friction."""
    contact = session.world.contact
    if "friction" in values:
        contact.friction = validation.non_negative(values["friction"], "friction")
        if not contact.rods:
            raise ValueError("friction of the scene is that between rods, which do not touch: see Scene.enable_contact")
    if "slip_tolerance" in values:
        contact.slip_tolerance = validation.positive(values["slip_tolerance"], "slip_tolerance")
    session.world.set_friction(contact)
