"""Motion of obstacles during a simulation."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.outlines import ObstacleOutline
from withe.parts.directory import Directory
from withe.parts.handles import Handle, Obstacle
from withe.parts.kinds import ObstaclePart
from withe.simulation.motion import Path
from withe.simulation.session import Session

__all__ = [
    "find_obstacle",
    "move_obstacle",
    "obstacle_outlines",
    "obstacle_pose",
]

FloatArray = npt.NDArray[np.float64]


def find_obstacle(directory: Directory, handle: Handle | str) -> tuple[int, str] | None:
    """Return index and name of an obstacle; None if the handle is not an obstacle."""
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
    part = session.directory.all(ObstaclePart)[index]
    if path is not None:
        if any(value is not None for value in (position, tangent, roll)) or over != 0.0:
            raise ValueError(f"path of {name!r} must not be combined with position, tangent, roll or over")
        validation.function(path, f"path of {name!r}")
        _, turned = obstacle_pose(session, index, path, session.world.time)
        session.settings.paths[name, "position"] = path
        if turned is not None:
            session.settings.paths[name, "rotation"] = path
        session.note("move", part, {}, 0.0)
        return
    if position is None and roll is None:
        raise ValueError(f"position, roll or path of {name!r} must be given")
    place = None if position is None else validation.vector(position, f"position of {name!r}")
    turn, axis = None, part.axis
    if part.kind == "shape" and (roll is not None or tangent is not None):
        raise ValueError(f"{name!r} can be moved, but not turned: leave out roll and tangent")
    if (tangent is None) != (axis is not None or roll is None):
        what = "a sphere needs a tangent as the axis of its roll"
        raise ValueError(
            f"tangent of {name!r} must be given: {what}"
            if tangent is None
            else f"tangent of {name!r} must be None: only a sphere takes a tangent"
        )
    if roll is not None:
        about = validation.unit_vector(tangent, f"tangent of {name!r}") if axis is None else axis
        turn = validation.number(roll, f"roll of {name!r}") * about
    session.world.move_obstacle(index, place, turn, over)
    # A motion that is not given continues.
    if place is not None:
        session.settings.paths.pop((name, "position"), None)
    if turn is not None:
        session.settings.paths.pop((name, "rotation"), None)
    session.note("move", part, {} if place is None else {"position": place}, over)


def obstacle_pose(session: Session, index: int, path: Path, time: float) -> tuple[FloatArray, FloatArray | None]:
    """Return the position of an obstacle on its path, and its rotation since the drawing [rad], if given."""
    part = session.directory.all(ObstaclePart)[index]
    value = path(time)
    what = f"path of {part.name!r} at t = {time:g}"
    if not (isinstance(value, tuple | list) and len(value) == 2):
        return validation.vector(value, what), None
    place, roll = validation.vector(value[0], f"position on the {what}"), f"roll on the {what}"
    if part.axis is None:
        return place, validation.vector(value[1], roll)
    return place, validation.number(value[1], roll) * part.axis


def obstacle_outlines(directory: Directory) -> list[ObstacleOutline]:
    """Return the outlines of obstacles for records."""
    return [
        ObstacleOutline(
            part.name,
            part.kind,
            np.array(part.other if part.kind == "plane" else part.other - part.point, float),
            float(part.radius),
            *(part.solid.surface() if part.solid is not None else ()),
        )
        for part in directory.all(ObstaclePart)
    ]
