"""How surfaces press and rub, set and read while a simulation runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from withe import _core
from withe.common import validation
from withe.parts.contacts import Body, body_of, touching
from withe.parts.friction import Friction, as_given, check_law, friction_pair, obstacle_friction, with_obstacle
from withe.parts.kinds import ObstaclePart, RodPart
from withe.simulation.session import Session

__all__ = [
    "OBSTACLE_WORDS",
    "SCENE_WORDS",
    "obstacle_value",
    "scene_value",
    "set_obstacle",
    "set_pair_friction",
    "set_pair_restitution",
    "set_pair_stiffness",
    "set_scene",
]

SCENE_WORDS = ("friction", "slip_tolerance", "restitution", "contact_stiffness")
OBSTACLE_WORDS = ("friction", "restitution")


def set_scene(session: Session, values: dict[str, Any]) -> None:
    """Change what all rods have with each other, and the slip tolerance and stiffness of all contact."""
    contact = session.world.contact
    for word in ("friction", "restitution"):
        if word in values:
            check = validation.non_negative if word == "friction" else validation.share
            setattr(contact, word, check(values[word], word))
            if not contact.rods:
                raise ValueError(
                    f"{word} of the scene is that between rods, which do not touch: see Scene.enable_contact"
                )
    if "slip_tolerance" in values:
        contact.slip_tolerance = validation.positive(values["slip_tolerance"], "slip_tolerance")
    if "contact_stiffness" in values:
        stiffness = values["contact_stiffness"]
        if not (contact.rods or contact.obstacles):
            raise ValueError("contact_stiffness cannot be set: nothing touches in this scene")
        contact.stiffness = 0.0 if stiffness is None else validation.positive(stiffness, "contact_stiffness")
    session.world.set_contact(contact)


def scene_value(session: Session, word: str) -> float | None:
    """What `set_scene` sets; None for a contact stiffness that is found by the rule."""
    contact = session.world.contact
    if word == "contact_stiffness":
        return float(contact.stiffness) or None
    return float(getattr(contact, word))


def set_obstacle(session: Session, part: ObstaclePart, values: dict[str, Any]) -> None:
    """Change friction and restitution of an obstacle, all or none."""
    contact = session.world.contact
    index = session.directory.all(ObstaclePart).index(part)
    if "friction" in values:
        what = f"friction of {part.name!r}"
        pair = friction_pair(values["friction"], what)
        check_law(pair, contact.friction_law, what)
        contact = with_obstacle(contact, index, pair)
    if "restitution" in values:
        restitution = np.array(contact.obstacle_restitution)
        restitution[index] = validation.share(values["restitution"], f"restitution of {part.name!r}")
        contact.obstacle_restitution = restitution
    session.world.set_contact(contact)


def obstacle_value(session: Session, part: ObstaclePart, word: str) -> Friction:
    """What `set_obstacle` sets."""
    contact = session.world.contact
    index = session.directory.all(ObstaclePart).index(part)
    if word == "restitution":
        return float(contact.obstacle_restitution[index])
    return as_given(obstacle_friction(contact, index))


def set_pair_friction(session: Session, a: Body, b: Body, friction: Friction) -> None:
    """Give two bodies another friction coefficient of their own; see `Simulation.set_friction`."""
    first, second, contact = _pair(session, a, b, "friction")
    what = f"friction of {first.name!r} and {second.name!r}"
    rods = isinstance(first, RodPart) and isinstance(second, RodPart)
    along, across = friction_pair(friction, what, directed=not rods)
    check_law((along, across), contact.friction_law, what)
    _set_pair(session, first, second, contact, friction=along, across=across)


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
        raise ValueError(f"{first.name!r} and {second.name!r} are both obstacles, which never touch")
    contact = session.world.contact
    if isinstance(first, RodPart) and isinstance(second, RodPart) and not contact.rods:
        raise ValueError(
            f"{word} of {first.name!r} and {second.name!r} cannot be set: rods do not touch in this scene, see "
            "Scene.enable_contact"
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
    found = next((own for own in pairs if {own.first, own.second} == set(bodies)), None)
    if found is None:
        found = _core.ContactPairDescription()
        found.first, found.second = bodies
        pairs.append(found)
    for word, number in numbers.items():
        setattr(found, word, number)
    contact.pairs = pairs
    session.world.set_contact(contact)
