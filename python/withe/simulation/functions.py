"""Functions of the user: loads and paths that vary with time, and custom forces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from withe.parts.handles import CustomForce
from withe.parts.kinds import CustomForcePart, RodPart
from withe.simulation.custom_forces import CustomForces
from withe.simulation.hands import forget_left_rings
from withe.simulation.loads import new_values
from withe.simulation.motion import Path, Turn, Waypoints, evaluate_path, paths_by_owner
from withe.simulation.obstacles import find_obstacle, obstacle_pose
from withe.simulation.session import Session
from withe.simulation.surfaces import follow_friction_fields

__all__ = ["apply_functions", "check_jacobian", "force_function", "step_callback"]

FloatArray = npt.NDArray[np.float64]


def step_callback(session: Session) -> Callable[[float, float], None] | None:
    """Return the function to call before every inner step, if any."""
    now = session.world.time
    moving = any(not _finished(path, now) for path in session.settings.paths.values())
    if moving or session.settings.functions or session.settings.friction_fields:
        return lambda force_time, end_time: apply_functions(session, force_time, end_time)
    return None


def apply_functions(session: Session, force_time: float, end_time: float) -> None:
    """Evaluate loads and paths for the coming inner step."""
    forget_left_rings(session, session.world.take_left_rings())
    if session.settings.functions:
        for index, part in enumerate(session.loads):
            function = session.settings.functions.get(part.name)
            if function is not None:
                what = f"{part.kind} {part.name!r} at t = {force_time:g}"
                value = new_values(session, part, function(force_time), what)
                _check_in_plane(session, value, what, along_normal=part.kind in ("moment", "pressure"))
                session.world.set_load(index, value)
    if session.settings.friction_fields:
        follow_friction_fields(session)
    for name, path, words in paths_by_owner(session.settings.paths):
        if name not in session.settings.supports and (obstacle := find_obstacle(session.directory, name)) is not None:
            place, turn = obstacle_pose(session, obstacle[0], path, end_time)
            session.world.prescribe_obstacle(
                obstacle[0], place if "position" in words else None, turn if "rotation" in words else None
            )
            continue
        index, support = session.settings.supports[name]
        if _finished(path, min(session.world.time, end_time)):
            continue
        owner = f"{'hand' if support.grasp is not None else 'support'} {name!r}"
        position, rotation = evaluate_path(path, end_time, support.kind != "pin", owner)
        session.world.prescribe_support(
            index, position if "position" in words else None, rotation if "rotation" in words else None
        )


def force_function(session: Session) -> CustomForces | None:
    """Return the function that computes the custom forces, if any."""
    if not session.custom_forces:
        return None
    shortest = min(float(rod.lengths.min()) for rod in session.directory.all(RodPart))
    return CustomForces(
        session.custom_forces,
        shortest,
        lambda forces, what: _check_in_plane(session, forces, what),
        lambda moments, what: _check_in_plane(session, moments, what, along_normal=True),
    )


def check_jacobian(session: Session, force: CustomForce | str | None) -> None:
    """Compare a jacobian with differences; see `Simulation.check_jacobian`."""
    given = [part for part in session.custom_forces if part.jacobian is not None]
    if force is not None:
        given = [session.directory.find(force, CustomForcePart, "custom force")]
    custom = force_function(session)
    if custom is None or not given:
        raise ValueError("scene has no jacobian to check: use add_custom_force(jacobian=)")
    positions, velocities = np.array(session.world.positions()), np.array(session.world.velocities())
    for part in given:
        custom.check(part, session.world.time, positions, velocities)


def _check_in_plane(session: Session, value: FloatArray, what: str, along_normal: bool = False) -> None:
    """Refuse values of a function that leave the plane of a simulation built with planar=True."""
    if not session.options.planar:
        return
    normal = np.array(session.world.plan.plane_normal)
    out = value - np.outer(value @ normal, normal).reshape(value.shape) if along_normal else value @ normal
    if np.linalg.norm(out) > 1e-8 * np.linalg.norm(value):
        must = "along the normal of" if along_normal else "in"
        raise ValueError(
            f"{what} must stay {must} the plane of a scene built with planar=True, whose normal is "
            f"({normal[0]:g}, {normal[1]:g}, {normal[2]:g}), got {np.array2string(value, threshold=9)}"
        )


def _finished(path: Path, time: float) -> bool:
    """Return True if a path has ended and was followed to its end."""
    if not isinstance(path, Turn | Waypoints):
        return False
    begin, end = path.times.min(), path.times.max()
    return bool(time > end or (time == end and begin < end))
