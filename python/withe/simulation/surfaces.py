"""Contact and friction, set and read during a simulation."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.contacts import BodyPair, Touching, body_of, pair_friction, pair_of, touching
from withe.parts.friction import (
    Coefficients,
    as_given,
    by_given,
    check_law,
    check_rolling,
    coefficients,
    obstacle_friction,
    own_friction,
    pair_between,
)
from withe.parts.kinds import ObstaclePart, RodPart
from withe.simulation.readers import Reader, of_equilibrium
from withe.simulation.session import Session

__all__ = [
    "find_friction_fields",
    "follow_friction_fields",
    "obstacle_reader",
    "obstacle_value",
    "pair_reader",
    "pair_value",
    "scene_reader",
    "scene_value",
    "set_obstacle",
    "set_pair",
    "set_scene",
]

FloatArray = npt.NDArray[np.float64]
Shape = tuple[int, ...]


def set_scene(session: Session, part: None, values: dict[str, Any]) -> None:
    """Change gravity, the coefficients between all rods, and the slip tolerance and stiffness of all contacts."""
    contact = session.world.contact
    settings: dict[str, Any] = {}
    for word, check in (("friction", validation.non_negative), ("restitution", validation.share)):
        if word in values:
            settings[word] = check(values[word], word)
            if not contact.rods:
                raise ValueError(
                    f"{word} of the scene applies to contact between rods, which is off: call Scene.enable_contact "
                    "before build"
                )
    if "slip_tolerance" in values:
        settings["slip_tolerance"] = validation.positive(values["slip_tolerance"], "slip_tolerance")
    if "contact_stiffness" in values:
        stiffness = values["contact_stiffness"]
        if not (contact.rods or contact.obstacles):
            raise ValueError("contact_stiffness cannot be set, because this scene has no contact")
        settings["contact_stiffness"] = (
            0.0 if stiffness is None else validation.positive(stiffness, "contact_stiffness")
        )
    gravity = validation.vector(values["gravity"], "gravity") if "gravity" in values else None
    if gravity is not None:
        settings["gravity"] = gravity
    session.world.set(0, settings)
    if gravity is not None:
        session.settings.gravity = gravity


def scene_value(session: Session, part: None, word: str) -> Any:
    """Return the value of `set_scene`; None for a contact stiffness that is found by the rule."""
    if word == "gravity":
        return session.settings.gravity.copy()
    contact = session.world.contact
    if word == "contact_stiffness":
        return float(contact.stiffness) or None
    return float(getattr(contact, word))


def set_obstacle(session: Session, part: ObstaclePart, values: dict[str, Any]) -> None:
    """Change friction, rolling friction and restitution of an obstacle, all or none."""
    law, owner = session.world.contact.friction_law, repr(part.name)
    settings: dict[str, Any] = {}
    index = session.directory.all(ObstaclePart).index(part)
    given: Coefficients | None = None
    shares: dict[tuple[int, int], FloatArray] = {}
    if "friction" in values:
        given = coefficients(values["friction"], f"friction of {owner}")
        check_law(given.directions, law, f"friction of {owner}")
        settings["obstacle_friction"] = given.directions
        shares = _shares_of_obstacle(session, part, given)
    if "restitution" in values:
        settings["obstacle_restitution"] = validation.share(values["restitution"], f"restitution of {owner}")
    if "rolling_friction" in values:
        rolling = validation.non_negative(values["rolling_friction"], f"rolling_friction of {owner}")
        check_rolling(rolling, law, part.name)
        settings["obstacle_rolling"] = rolling
    session.world.set(index, settings)
    for bodies, of_rod in shares.items():
        session.world.set_friction_shares(session.world.own_contact(*bodies), of_rod)
    if given is not None:
        _note_field(session, (part.name,), given)


def _shares_of_obstacle(session: Session, part: ObstaclePart, given: Coefficients) -> dict[tuple[int, int], FloatArray]:
    """Return the shares of an obstacle's friction for the rods that have none of their own with the obstacle."""
    index, out = session.directory.all(ObstaclePart).index(part), {}
    for rod in session.directory.all(RodPart):
        own = pair_between(session.world.contact.pairs, (rod.index, -1 - index))
        shares = _shares_now(session, rod, part, given)
        if own_friction(own) is None and not (own is None and shares is None):
            out[rod.index, -1 - index] = np.zeros(0) if shares is None else shares
    return out


def obstacle_value(session: Session, part: ObstaclePart, word: str) -> Any:
    """Return the value of `set_obstacle`, or the pose of an obstacle."""
    world = session.world
    contact = world.contact
    index = session.directory.all(ObstaclePart).index(part)
    if word in ("position", "turn"):
        return np.array(world.obstacle_position(index) if word == "position" else world.obstacle_turn(index))
    if word == "restitution":
        return float(contact.obstacle_restitution[index])
    if word == "rolling_friction":
        return float(contact.obstacle_rolling[index])
    given = session.settings.frictions.get((part.name,))
    if given is not None:
        return given.given
    return as_given(obstacle_friction(contact, index))


def set_pair(session: Session, pair: BodyPair, values: dict[str, Any]) -> None:
    """Give two bodies friction, restitution or a contact stiffness of their own, all or none."""
    first, second = pair.first, pair.second
    directory, world, names = session.directory, session.world, f"{first.name!r} and {second.name!r}"
    given, shares = None, None
    settings: dict[str, Any] = {}
    for word in values:
        _check_pair(first, second, world.contact, word.replace("_", " "))
    if "friction" in values:
        given = pair_friction(directory, first.name, second.name, values["friction"])
        check_law(given.directions, world.contact.friction_law, f"friction of {names}")
        settings["pair_friction"] = given.directions
        rod, obstacle = (first, second) if isinstance(first, RodPart) else (second, first)
        if isinstance(rod, RodPart) and isinstance(obstacle, ObstaclePart):
            shares = _shares_now(session, rod, obstacle, given)
    for word, check in (("restitution", validation.share), ("contact_stiffness", validation.positive)):
        if word in values:
            settings[f"pair_{word}"] = check(values[word], f"{word.replace('_', ' ')} of {names}")
    index = world.own_contact(body_of(directory, first), body_of(directory, second))
    world.set(index, settings)
    if given is not None:
        world.set_friction_shares(index, np.zeros(0) if shares is None else shares)
        _note_field(session, pair_of(directory, first.name, second.name), given)


def pair_value(session: Session, pair: BodyPair, word: str) -> Any:
    """Return a parameter of two bodies: the one of their pair, or else that of the obstacle or the scene."""
    names = pair_of(session.directory, pair.first.name, pair.second.name)
    parts = [touching(session.directory, name) for name in names]
    first, second = (body_of(session.directory, part) for part in parts)
    own = pair_between(session.contact.pairs, (first, second))
    obstacle = next((part for part in parts if isinstance(part, ObstaclePart)), None)
    if word == "contact_stiffness":
        return own.stiffness if own is not None and own.stiffness > 0.0 else scene_value(session, None, word)
    if word == "restitution" and own is not None and own.restitution >= 0.0:
        return own.restitution
    directions = own_friction(own)
    if word == "restitution" or own is None or directions is None:
        return scene_value(session, None, word) if obstacle is None else obstacle_value(session, obstacle, word)
    if not len(own.shares):
        return as_given(directions)
    if names in session.settings.frictions:
        return session.settings.frictions[names].given
    edges = next(len(part.lengths) for part in parts if isinstance(part, RodPart))
    return np.array(own.shares)[-edges:]


def _check_pair(first: Touching, second: Touching, contact: _core.ContactDescription, word: str) -> None:
    """Refuse two bodies that never touch."""
    if isinstance(first, ObstaclePart) and isinstance(second, ObstaclePart):
        raise ValueError(
            f"{first.name!r} and {second.name!r} are both obstacles, which never touch: name at least one rod"
        )
    if isinstance(first, RodPart) and isinstance(second, RodPart) and not contact.rods:
        raise ValueError(
            f"{word} of {first.name!r} and {second.name!r} cannot be set, because contact between rods is off: "
            "call Scene.enable_contact before build"
        )


def _note_field(session: Session, names: tuple[str, ...], given: Coefficients) -> None:
    """Store fields of friction, of an obstacle or of a rod and an obstacle. The engine stores all other friction."""
    if given.field is None:
        session.settings.frictions.pop(names, None)
    else:
        session.settings.frictions[names] = given
    find_friction_fields(session)


def find_friction_fields(session: Session) -> None:
    """Find which pairs of the engine have friction that varies over an obstacle."""
    obstacles, rods = session.directory.all(ObstaclePart), session.directory.all(RodPart)
    frictions, fields = session.settings.frictions, session.settings.friction_fields
    fields.clear()
    if not frictions:
        return
    for number, pair in enumerate(session.world.contact.pairs):
        if not len(pair.shares):
            continue
        rod, obstacle = rods[max(pair.first, pair.second)], obstacles[-1 - min(pair.first, pair.second)]
        names = (obstacle.name,) if own_friction(pair) is None else pair_of(session.directory, rod.name, obstacle.name)
        if names in frictions:
            fields[number] = rod.index, obstacle.name, frictions[names]


def follow_friction_fields(session: Session) -> None:
    """Take friction that varies over obstacles from where rods are now."""
    obstacles = {part.name: part for part in session.directory.all(ObstaclePart)}
    rods = session.directory.all(RodPart)
    for number, (rod, name, given) in session.settings.friction_fields.items():
        shares = _shares_now(session, rods[rod], obstacles[name], given)
        if shares is not None:
            session.world.set_friction_shares(number, shares)


def _shares_now(session: Session, rod: RodPart, obstacle: ObstaclePart, given: Coefficients) -> FloatArray | None:
    """Return the shares of a coefficient at nodes and edges of a rod; fields move and turn with their obstacle."""
    nodes = np.array(session.world.positions())[session.directory.layout.rows(rod.index)]
    if given.field is not None:
        index = session.directory.all(ObstaclePart).index(obstacle)
        place, turn = np.array(session.world.obstacle_position(index)), np.array(session.world.obstacle_turn(index))
        nodes = nodes - place
        if turn.any():
            from scipy.spatial.transform import Rotation

            nodes = Rotation.from_rotvec(-turn).apply(nodes)
        nodes = nodes + obstacle.point
    return given.shares(nodes, rod.closed, f"friction of {obstacle.name!r}")


def obstacle_reader(session: Session, part: ObstaclePart, word: str, shape: Shape | None) -> Reader:
    """Return the reader of the derivative by a friction, or by the position, of an obstacle."""
    index = session.directory.all(ObstaclePart).index(part)
    if word == "friction":
        own = obstacle_friction(session.contact, index)
        return _by_directions(lambda g: g.parameters.obstacle_friction[index], own, shape, part.name)
    if word == "position":
        return lambda g: np.array(of_equilibrium(g, part.name).obstacle_positions[index])
    check_rubs(float(session.contact.obstacle_rolling[index]), f"{part.name}, of rods that roll,")
    return lambda g: float(g.parameters.obstacle_rolling[index])


def pair_reader(session: Session, pair: BodyPair, word: str, shape: Shape | None) -> Reader:
    """Return the reader of the derivative by the friction of a pair of bodies."""
    bodies, pairs = pair.bodies(session.directory), session.contact.pairs
    own = own_friction(pair_between(pairs, bodies))
    if own is None:
        raise ValueError(
            f"{pair.name} have no friction of their own to differentiate by: call set((a, b), friction=...) first"
        )
    index = next(i for i, each in enumerate(pairs) if {each.first, each.second} == bodies)
    return _by_directions(lambda g: g.parameters.pair_friction[index], own, shape, pair.name)


def _by_directions(read: Reader, own: Any, shape: Shape | None, name: str) -> Reader:
    """Derivatives by a friction as it was given: of that shape, or as `get` returns it."""
    if shape is None:
        given = as_given(own)
        check_rubs(np.max(given), name)
        shape = np.shape(given)
    return lambda g: by_given(np.array(read(g)), shape)


def scene_reader(session: Session, part: None, word: str, shape: Shape | None) -> Reader:
    """Return the reader of the derivative by a parameter of the scene."""
    if word == "gravity":
        return lambda g: np.array(g.parameters.gravity)
    if word == "friction" and shape is None:
        check_rubs(session.contact.friction, "rods")
    return lambda g: float(getattr(g.parameters, word))


def check_rubs(friction: float, what: str) -> None:
    """Refuse a friction by which there is no derivative."""
    if not friction > 0.0:
        raise ValueError(f"friction of {what} must be positive to differentiate by, got 0: set a small value")
