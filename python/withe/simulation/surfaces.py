"""Contact and friction, set and read during a simulation."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.contacts import Body, BodyPair, body_of, pair_friction, pair_of, touching
from withe.parts.friction import (
    Coefficients,
    Friction,
    as_given,
    check_law,
    check_rolling,
    coefficients,
    obstacle_friction,
    own_friction,
    pair_between,
    pair_in,
    with_obstacle,
    with_pair,
)
from withe.parts.kinds import ObstaclePart, RodPart
from withe.simulation.session import Session

__all__ = [
    "OBSTACLE_WORDS",
    "SCENE_WORDS",
    "find_friction_fields",
    "follow_friction_fields",
    "obstacle_value",
    "pair_value",
    "scene_value",
    "set_obstacle",
    "set_pair_friction",
    "set_pair_restitution",
    "set_pair_stiffness",
    "set_scene",
]

FloatArray = npt.NDArray[np.float64]

SCENE_WORDS = ("friction", "slip_tolerance", "restitution", "contact_stiffness")
OBSTACLE_WORDS = ("friction", "restitution", "rolling_friction")


def set_scene(session: Session, values: dict[str, Any]) -> None:
    """Change what all rods have with each other, and the slip tolerance and stiffness of all contact."""
    contact = session.world.contact
    for word in ("friction", "restitution"):
        if word in values:
            check = validation.non_negative if word == "friction" else validation.share
            setattr(contact, word, check(values[word], word))
            if not contact.rods:
                raise ValueError(
                    f"{word} of the scene applies to contact between rods, which is off: call Scene.enable_contact "
                    "before build"
                )
    if "slip_tolerance" in values:
        contact.slip_tolerance = validation.positive(values["slip_tolerance"], "slip_tolerance")
    if "contact_stiffness" in values:
        stiffness = values["contact_stiffness"]
        if not (contact.rods or contact.obstacles):
            raise ValueError("contact_stiffness cannot be set, because this scene has no contact")
        contact.stiffness = 0.0 if stiffness is None else validation.positive(stiffness, "contact_stiffness")
    session.world.set_contact(contact)


def scene_value(session: Session, word: str) -> float | None:
    """Return the value of `set_scene`; None for a contact stiffness that is found by the rule."""
    contact = session.world.contact
    if word == "contact_stiffness":
        return float(contact.stiffness) or None
    return float(getattr(contact, word))


def set_obstacle(session: Session, part: ObstaclePart, values: dict[str, Any]) -> None:
    """Change friction, rolling friction and restitution of an obstacle, all or none."""
    contact = session.world.contact
    index = session.directory.all(ObstaclePart).index(part)
    given = None
    if "friction" in values:
        given = coefficients(values["friction"], f"friction of {part.name!r}")
        contact = _with_obstacle_friction(session, part, given, contact)
    if "restitution" in values:
        restitution = np.array(contact.obstacle_restitution)
        share = validation.share(values["restitution"], f"restitution of {part.name!r}")
        restitution[index] = share
        contact.obstacle_restitution = restitution
    if "rolling_friction" in values:
        rolling = np.array(contact.obstacle_rolling)
        rolling[index] = validation.non_negative(values["rolling_friction"], f"rolling_friction of {part.name!r}")
        check_rolling(rolling[index], contact.friction_law, part.name)
        contact.obstacle_rolling = rolling
    session.world.set_contact(contact)
    if given is not None:
        _note_field(session, (part.name,), given)


def _with_obstacle_friction(
    session: Session, part: ObstaclePart, given: Coefficients, contact: _core.ContactDescription
) -> _core.ContactDescription:
    """The same with other friction of an obstacle, and of rods that have none of their own with it."""
    check_law(given.directions, contact.friction_law, f"friction of {part.name!r}")
    index = session.directory.all(ObstaclePart).index(part)
    contact = with_obstacle(contact, index, given.directions)
    for rod in session.directory.all(RodPart):
        bodies = rod.index, -1 - index
        own = pair_between(contact.pairs, bodies)
        shares = _shares_now(session, rod, part, given)
        if (own is None and shares is None) or own_friction(own) is not None:
            continue
        contact = with_pair(contact, bodies, None, shares)
    return contact


def obstacle_value(session: Session, part: ObstaclePart, word: str) -> Friction:
    """Return the value of `set_obstacle`."""
    contact = session.world.contact
    index = session.directory.all(ObstaclePart).index(part)
    if word == "restitution":
        return float(contact.obstacle_restitution[index])
    if word == "rolling_friction":
        return float(contact.obstacle_rolling[index])
    given = session.settings.frictions.get((part.name,))
    if given is not None:
        return given.given
    return as_given(obstacle_friction(contact, index))


def set_pair_friction(session: Session, a: Body, b: Body, friction: Friction) -> None:
    """Give two bodies another friction coefficient of their own; see `Simulation.set_friction`."""
    first, second, contact = _pair(session, a, b, "friction")
    given = pair_friction(session.directory, a, b, friction)
    check_law(given.directions, contact.friction_law, f"friction of {first.name!r} and {second.name!r}")
    rod, obstacle = (first, second) if isinstance(first, RodPart) else (second, first)
    shares = None
    if isinstance(rod, RodPart) and isinstance(obstacle, ObstaclePart):
        shares = _shares_now(session, rod, obstacle, given)
    bodies = body_of(session.directory, first), body_of(session.directory, second)
    session.world.set_contact(with_pair(contact, bodies, given.directions, shares))
    _note_field(session, pair_of(session.directory, a, b), given)
    session.note("set_friction", BodyPair(first, second), {"friction": friction})


def pair_value(session: Session, a: Body, b: Body) -> Friction | None:
    """Friction that two bodies have of their own, as it was given; None where they have none."""
    names = pair_of(session.directory, a, b)
    parts = [touching(session.directory, name) for name in names]
    first, second = (body_of(session.directory, part) for part in parts)
    own = pair_between(session.contact.pairs, (first, second))
    directions = own_friction(own)
    if own is None or directions is None:
        return None
    if not len(own.shares):
        return as_given(directions)
    if names in session.settings.frictions:
        return session.settings.frictions[names].given
    edges = next(len(part.lengths) for part in parts if isinstance(part, RodPart))
    return np.array(own.shares)[-edges:]


def set_pair_restitution(session: Session, a: Body, b: Body, restitution: float) -> None:
    """Give two bodies another restitution of their own; see `Simulation.set_restitution`."""
    first, second, contact = _pair(session, a, b, "restitution")
    share = validation.share(restitution, f"restitution of {first.name!r} and {second.name!r}")
    _set_pair(session, first, second, contact, restitution=share)


def set_pair_stiffness(session: Session, a: Body, b: Body, stiffness: float) -> None:
    """Give two bodies another contact stiffness of their own; see `Simulation.set_contact_stiffness`."""
    first, second, contact = _pair(session, a, b, "contact stiffness")
    given = validation.positive(stiffness, f"contact stiffness of {first.name!r} and {second.name!r}")
    _set_pair(session, first, second, contact, stiffness=given)


def _pair(
    session: Session, a: Body, b: Body, word: str
) -> tuple[RodPart | ObstaclePart, RodPart | ObstaclePart, _core.ContactDescription]:
    """Two bodies that may touch."""
    first, second = (touching(session.directory, body) for body in (a, b))
    if isinstance(first, ObstaclePart) and isinstance(second, ObstaclePart):
        raise ValueError(
            f"{first.name!r} and {second.name!r} are both obstacles, which never touch: name at least one rod"
        )
    contact = session.world.contact
    if isinstance(first, RodPart) and isinstance(second, RodPart) and not contact.rods:
        raise ValueError(
            f"{word} of {first.name!r} and {second.name!r} cannot be set, because contact between rods is off: "
            "call Scene.enable_contact before build"
        )
    return first, second, contact


def _set_pair(
    session: Session,
    first: RodPart | ObstaclePart,
    second: RodPart | ObstaclePart,
    contact: _core.ContactDescription,
    **numbers: float,
) -> None:
    """Rods are called by their index, obstacles by -1 - index."""
    bodies = body_of(session.directory, first), body_of(session.directory, second)
    pairs = list(contact.pairs)
    found = pair_in(pairs, bodies)
    for word, number in numbers.items():
        setattr(found, word, number)
    contact.pairs = pairs
    session.world.set_contact(contact)


def _note_field(session: Session, names: tuple[str, ...], given: Coefficients) -> None:
    """Remember what was set, of an obstacle or of a rod and one, if it is a field; the engine keeps other friction."""
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
