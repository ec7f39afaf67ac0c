"""Supports put on, moved and taken off while a simulation runs."""

from __future__ import annotations

from typing import cast

import numpy as np
import numpy.typing as npt

from withe.common import drawing, validation
from withe.parts.description import describe_support
from withe.parts.handles import Handle, NodeHandle, Support
from withe.parts.kinds import SupportPart
from withe.parts.supports import check_not_held
from withe.simulation.motion import PathLike, RotationLike, Turn, axis_angle, evaluate_path, make_path, oriented
from withe.simulation.session import Session

__all__ = ["find_support", "hold", "move_support", "release"]

FloatArray = npt.NDArray[np.float64]


def hold(session: Session, part: SupportPart) -> Support:
    """Put a support on."""
    check_not_held(session.directory, part, (other for _, other in session.settings.supports.values()))
    index = session.world.add_support(describe_support(part))
    session.settings.supports[part.name] = index, part
    return cast(Support, session.directory.add(part))


def release(session: Session, support: Handle | str) -> None:
    """Take a support off; see `Simulation.release`."""
    index, part = find_support(session, support)
    session.world.remove_support(index)
    del session.settings.supports[part.name]
    session.settings.paths.pop(part.name, None)
    if part.name not in session.scene.parts:
        session.directory.remove(part.name)


def find_support(session: Session, support: Handle | str) -> tuple[int, SupportPart]:
    """Index and part of a support, given by itself or by its node."""
    if isinstance(support, NodeHandle) or (
        isinstance(support, str) and support not in session.directory.parts and "." in support
    ):
        node, name = session.directory.node(support, "node")
        row = session.directory.row(node)
        for index, part in session.settings.supports.values():
            if session.directory.row(part.node) == row:
                return index, part
        raise ValueError(f"node {name!r} is not held: clamp or pin it first")
    # One that came while running leaves the directory when it goes.
    gone = (
        isinstance(support, Support)
        and support.scene_id == session.directory.scene_id
        and support.name not in session.directory.parts
    )
    if not gone:
        part = session.directory.find(support, SupportPart, "support")
        if part.name in session.settings.supports:
            return session.settings.supports[part.name]
    name = support if isinstance(support, str) else support.name
    raise ValueError(f"support {name!r} is released: it is not in the scene any more")


def move_support(
    session: Session,
    support: Handle | str,
    position: npt.ArrayLike | None,
    rotation: RotationLike | None,
    tangent: npt.ArrayLike | None,
    roll: float | None,
    over: float,
    path: PathLike | None,
) -> None:
    """Move a support; see `Simulation.move`."""
    index, part = find_support(session, support)
    turns = part.kind != "pin"
    owner = _owner(part)
    if path is not None:
        if any(value is not None for value in (position, rotation, tangent, roll)) or over != 0.0:
            raise ValueError(f"path of {owner} must be given alone")
        way = make_path(path, turns, owner)
        evaluate_path(way, session.world.time, session.world.support_rotation(index), turns, owner)
        session.settings.paths[part.name] = way
        session.note("move", part, {})
        return
    if rotation is not None and (tangent is not None or roll is not None):
        raise ValueError(f"rotation of {owner} must not be given together with tangent or roll")
    if not turns and any(value is not None for value in (rotation, tangent, roll)):
        raise ValueError(f"rotation, tangent and roll of {owner} must be None: a pin holds no direction")
    over = validation.non_negative(over, "over")
    target = np.array(session.world.support_position(index))
    if position is not None:
        target = validation.vector(position, f"position of {owner}")
    if tangent is None and roll is None:
        matrix = np.array(session.world.support_rotation(index))
        if rotation is not None:
            matrix = validation.rotation_matrix(rotation, f"rotation of {owner}")
        given = {"position": target} if position is not None else {}
        if rotation is not None and session.journal is not None:
            axis, angle = axis_angle(matrix @ np.array(session.world.support_rotation(index)).T)
            given["rotation"] = angle * axis
        session.world.move_support(index, target, matrix, over)
        session.settings.paths.pop(part.name, None)
        session.note("move", part, given, over)
        return
    session.settings.paths[part.name] = _turn(session, index, part, target, tangent, roll, over)
    session.note("move", part, {})


def _turn(
    session: Session,
    index: int,
    part: SupportPart,
    target: FloatArray,
    tangent: npt.ArrayLike | None,
    roll: float | None,
    over: float,
) -> Turn:
    """The way of a support from where it is to a tangent and a roll."""
    rod = session.directory.rod(session.directory.layout.rods[part.node[0]].name)
    if part.grasp is not None:
        drawn = np.eye(3)[2], np.eye(3)[0]
    elif part.kind in ("clamp", "spinning_clamp"):
        drawn = drawing.drawn_frame(rod.tangents, rod.directors, rod.lengths, part.node[1], rod.closed)
    else:
        edge = min(part.node[1], len(rod.tangents) - 1)
        drawn = rod.tangents[edge], rod.directors[edge]
    now = session.world.time
    matrix = np.array(session.world.support_rotation(index))
    start_tangent = matrix @ drawn[0]
    start_tangent /= np.linalg.norm(start_tangent)
    flat = oriented(drawn[0], drawn[1], start_tangent, 0.0) @ drawn[1]
    turned = matrix @ drawn[1]
    start_roll = float(np.arctan2(np.cross(flat, turned) @ start_tangent, flat @ turned))
    before = session.settings.paths.get(part.name)
    if isinstance(before, Turn):
        full_turn = 2.0 * np.pi
        start_roll += full_turn * float(np.round((before.roll_at(now) - start_roll) / full_turn))
    owner = _owner(part)
    end_tangent = start_tangent if tangent is None else validation.unit_vector(tangent, f"tangent of {owner}")
    end_roll = start_roll if roll is None else validation.number(roll, f"roll of {owner}")
    # Rotations at the ends of a step do not tell full turns between them.
    step = float(session.options.time_step)
    way = abs(end_roll - start_roll)
    if way * min(step / over if over > 0.0 else 1.0, 1.0) > np.pi:
        raise ValueError(
            f"roll of {owner} must turn by at most half a turn in a time step, got {end_roll - start_roll:g} rad "
            f"{'at once' if over == 0.0 else f'over {over:g} s'}: take over={1.5 * way / np.pi * step:.2g} or more"
        )
    return Turn(
        positions=np.stack([np.array(session.world.support_position(index)), target]),
        tangents=np.stack([start_tangent, end_tangent]),
        rolls=np.array([start_roll, end_roll]),
        times=np.array([now, now + over]),
        drawn=np.stack(drawn),
    )


def _owner(part: SupportPart) -> str:
    return f"{'hand' if part.grasp is not None else 'support'} {part.name!r}"
