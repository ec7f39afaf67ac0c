"""Supports put on, moved and taken off while a simulation runs."""

from __future__ import annotations

from typing import cast

import numpy as np
import numpy.typing as npt

from withe.common import drawing, validation
from withe.parts.description import describe_support
from withe.parts.handles import Handle, NodeHandle, Support
from withe.parts.kinds import BodyPart, SupportPart
from withe.parts.plausibility import check_angle
from withe.parts.supports import check_not_held
from withe.simulation.motion import (
    POSE_WORDS,
    PathLike,
    RotationLike,
    Turn,
    axis_angle,
    evaluate_path,
    make_path,
    oriented,
)
from withe.simulation.session import Session

__all__ = ["find_support", "forget", "hold", "move_support", "release"]

FloatArray = npt.NDArray[np.float64]


def hold(session: Session, part: SupportPart) -> Support:
    """Put a support on."""
    check_not_held(session.directory, part, (other for _, other in session.settings.supports.values()))
    index = session.world.add_support(describe_support(session.directory, part))
    session.settings.supports[part.name] = index, part
    return cast(Support, session.directory.add(part))


def release(session: Session, support: Handle | str) -> None:
    """Take a support off; see `Simulation.release`."""
    index, part = find_support(session, support)
    session.world.remove_support(index)
    forget(session, part)


def forget(session: Session, part: SupportPart) -> None:
    """Delete the data of a support that the engine has released."""
    del session.settings.supports[part.name]
    session.settings.ramps.pop(("move", part.name), None)
    for word in POSE_WORDS:
        session.settings.paths.pop((part.name, word), None)
    if part.name not in session.scene.parts:
        session.directory.remove(part.name)


def find_support(session: Session, support: Handle | str) -> tuple[int, SupportPart]:
    """Index and part of a support, given by itself, by its node or by the rigid body that it holds."""
    if session.directory.is_body(support):
        body = session.directory.find(support, BodyPart, "body")
        for index, part in session.settings.supports.values():
            if part.node[0] == -1 - body.index:
                return index, part
        raise ValueError(f"body {body.name!r} is not held: clamp or pin it first")
    if isinstance(support, NodeHandle) or (
        isinstance(support, str) and support not in session.directory.parts and "." in support
    ):
        node, name = session.directory.node(support, "node")
        row = session.directory.row(node)
        for index, part in session.settings.supports.values():
            if session.directory.row(part.node) == row:
                return index, part
        raise ValueError(f"node {name!r} is not held: clamp or pin the node first")
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
    raise ValueError(f"support {name!r} is released and no longer in the scene")


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
    if part.grasp is not None and part.grasp.by is not None:
        raise ValueError(f"ring {part.name!r} is on a body and moves with the body: move the support of the body")
    turns = part.kind != "pin"
    owner = _owner(part)
    if path is not None:
        if any(value is not None for value in (position, rotation, tangent, roll)) or over != 0.0:
            raise ValueError(f"path of {owner} must not be combined with position, rotation, tangent, roll or over")
        way = make_path(path, turns, owner)
        _, turned = evaluate_path(way, session.world.time, turns, owner)
        session.settings.paths[part.name, "position"] = way
        if turned is not None:
            session.settings.paths[part.name, "rotation"] = way
        session.note("move", part, {})
        return
    if rotation is not None and (tangent is not None or roll is not None):
        raise ValueError(f"rotation of {owner} must not be given together with tangent or roll")
    if not turns and any(value is not None for value in (rotation, tangent, roll)):
        raise ValueError(f"rotation, tangent and roll of {owner} must be None, because a pin does not hold directions")
    over = validation.non_negative(over, "over")
    target = None if position is None else validation.vector(position, f"position of {owner}")
    matrix = None if rotation is None else validation.rotation_matrix(rotation, f"rotation of {owner}")
    turn = None if tangent is None and roll is None else _turn(session, index, part, tangent, roll, over)
    given = {} if target is None else {"position": target}
    if matrix is not None and session.journal is not None:
        axis, angle = axis_angle(matrix @ np.array(session.world.support_rotation(index)).T)
        given["rotation"] = angle * axis
    counted = np.zeros(3)
    if turn is not None and turn.times.max() <= session.world.time:
        # The engine moves an immediate target at a constant rate over the next time step, even if that step is cut.
        matrix, rolled = turn(session.world.time), float(turn.rolls[1] - turn.rolls[0])
        if abs(rolled) > np.pi:
            counted = rolled * turn.drawn[0]
        turn = turn.arrived(session.world.time)
    session.world.move_support(index, target, matrix, over, counted)
    # A motion that is not given continues.
    if target is not None:
        session.settings.paths.pop((part.name, "position"), None)
    if matrix is not None:
        session.settings.paths.pop((part.name, "rotation"), None)
    if turn is not None:
        session.settings.paths[part.name, "rotation"] = turn
    session.note("move", part, given, over)


def _turn(
    session: Session,
    index: int,
    part: SupportPart,
    tangent: npt.ArrayLike | None,
    roll: float | None,
    over: float,
) -> Turn:
    """Return the path of a support from its present pose to a tangent and a roll. One that is not given continues."""
    rod = session.directory.rod(session.directory.layout.rods[part.node[0]].name)
    if part.grasp is not None:
        drawn = np.eye(3)[2], np.eye(3)[0]
    elif part.kind in ("clamp", "spinning_clamp"):
        drawn = drawing.drawn_frame(rod.tangents, rod.directors, rod.lengths, part.node[1], rod.closed)
    else:
        edge = min(part.node[1], len(rod.tangents) - 1)
        drawn = rod.tangents[edge], rod.directors[edge]
    now = session.world.time
    start_tangent, start_roll = _tangent_and_roll(np.array(session.world.support_rotation(index)), drawn)
    # The motion before this call.
    before = session.settings.paths.get((part.name, "rotation"))
    if isinstance(before, Turn):
        start_roll = _beside(before.roll_at(now), start_roll)
        end_tangent, end_roll = before.tangents[1], float(before.rolls[1])
        tangent_end, roll_end = np.maximum(before.times[:, 1], now)
    else:
        leads_to, end = session.world.support_turn(index)
        end_tangent, end_roll = _tangent_and_roll(np.array(leads_to), drawn)
        end_roll = _beside(start_roll, end_roll)
        tangent_end = roll_end = max(end, now)
    owner = _owner(part)
    if tangent is not None:
        end_tangent, tangent_end = validation.unit_vector(tangent, f"tangent of {owner}"), now + over
    if roll is not None:
        end_roll, roll_end = validation.number(roll, f"roll of {owner}"), now + over
        check_angle(end_roll, f"roll of {owner}")
        _check_turns(session, end_roll - start_roll, over, owner)
    return Turn(
        tangents=np.stack([start_tangent, end_tangent]),
        rolls=np.array([start_roll, end_roll]),
        times=np.array([(now, tangent_end), (now, roll_end)]),
        drawn=np.stack(drawn),
    )


def _tangent_and_roll(rotation: FloatArray, drawn: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, float]:
    """Return the direction of a rotation, and its roll about this direction, from -pi to pi."""
    tangent = rotation @ drawn[0]
    tangent /= np.linalg.norm(tangent)
    flat = oriented(drawn[0], drawn[1], tangent, 0.0) @ drawn[1]
    turned = rotation @ drawn[1]
    return tangent, float(np.arctan2(np.cross(flat, turned) @ tangent, flat @ turned))


def _beside(known: float, roll: float) -> float:
    """A roll, and full turns, that is nearest to another."""
    full_turn = 2.0 * np.pi
    return roll + full_turn * float(np.round((known - roll) / full_turn))


def _check_turns(session: Session, way: float, over: float, owner: str) -> None:
    """Refuse full turns within one step, which its two end rotations do not show. Equilibria count them."""
    step = float(session.options.time_step)
    if over == 0.0 and session.options.integrator == "static":
        return
    if abs(way) * min(step / over if over > 0.0 else 1.0, 1.0) > np.pi:
        raise ValueError(
            f"roll of {owner} must be at most half a turn per time step, got {way:g} rad "
            f"{'at once' if over == 0.0 else f'over {over:g} s'}: use over={1.5 * abs(way) / np.pi * step:.2g} or "
            "more and call step, or build(integrator='static') for equilibria, which count full turns at once"
        )


def _owner(part: SupportPart) -> str:
    return f"{'hand' if part.grasp is not None else 'support'} {part.name!r}"
