"""Contact settings of a scene for the engine, and contacts from the engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.body_surfaces import surfaces_of
from withe.parts.directory import Directory
from withe.parts.friction import Coefficients, Friction, check_law, check_rolling, coefficients
from withe.parts.handles import Body, Obstacle, Rod
from withe.parts.kinds import (
    BodyPart,
    ContactSettings,
    ObstaclePart,
    PairSettings,
    RodPart,
)
from withe.parts.obstacle_shapes import shape_of
from withe.solids import Field, Tube

__all__ = [
    "CONTACT",
    "BodyPair",
    "Toucher",
    "Touching",
    "body_of",
    "contact_table",
    "describe_contact",
    "drawn_frictions",
    "make_obstacle",
    "pair_friction",
    "pair_of",
    "touching",
]

FloatArray = npt.NDArray[np.float64]
Toucher = Rod | Body | Obstacle | str
Touching = RodPart | ObstaclePart | BodyPart

CONTACT = np.dtype(
    [
        ("pair", "U64", (2,)),
        ("edge", np.int64, (2,)),
        ("distance", float),
        ("gap", float),
        ("point", float, (3,)),
        ("normal", float, (3,)),
        ("normal_force", float),
        ("friction", float, (3,)),
        ("sticking", bool),
    ]
)


def make_obstacle(
    name: str,
    kind: Literal["plane", "capsule", "shape"],
    point: FloatArray,
    other: FloatArray,
    radius: float,
    friction: Friction,
    restitution: float,
    rolling_friction: float,
    solid: Tube | Field | None = None,
) -> ObstaclePart:
    """An obstacle, checked; not yet in the directory."""
    both = coefficients(friction, f"friction of {name!r}")
    restitution = validation.share(restitution, f"restitution of {name!r}")
    rolling = validation.non_negative(rolling_friction, f"rolling_friction of {name!r}")
    return ObstaclePart(name, kind, point, other, radius, both, restitution, rolling, solid)


def pair_of(directory: Directory, a: Toucher, b: Toucher) -> tuple[str, str]:
    """Names of two bodies that may touch, in the order by which `ContactSettings.pairs` knows them.

    Raises
    ------
    ValueError
        Two obstacles, or something that touches nothing.
    """
    first, second = touching(directory, a), touching(directory, b)
    if isinstance(first, ObstaclePart) and isinstance(second, ObstaclePart):
        raise ValueError(
            f"{first.name!r} and {second.name!r} are both obstacles, which never touch: name at least one rod"
        )
    return (first.name, second.name) if first.name <= second.name else (second.name, first.name)


def pair_friction(directory: Directory, a: Toucher, b: Toucher, friction: Friction) -> Coefficients:
    """Friction of two bodies, checked; see `Scene.set_friction`."""
    parts = [touching(directory, body) for body in (a, b)]
    rods = [part for part in parts if isinstance(part, RodPart)]
    directed = len(rods) == 1
    what = f"friction of {parts[0].name!r} and {parts[1].name!r}"
    return coefficients(friction, what, directed=directed, edges=len(rods[0].lengths) if directed else None)


def touching(directory: Directory, handle: Toucher) -> Touching:
    """Return the rod, obstacle or rigid body of a handle or name.

    Raises
    ------
    ValueError
        Something else, or a body without a surface that touches.
    """
    part = directory.find_any(handle, "what touches")
    if not isinstance(part, RodPart | ObstaclePart | BodyPart):
        raise ValueError(f"bodies in contact must be rods, rigid bodies or obstacles, got {part.name!r}")
    if isinstance(part, BodyPart) and part.surface is None:
        raise ValueError(f"body {part.name!r} touches nothing: only spheres and capsules of withe.solids do")
    return part


@dataclass(frozen=True)
class BodyPair:
    """Two that may touch."""

    first: Touching
    second: Touching

    @property
    def name(self) -> str:
        """The same in either order."""
        return ", ".join(sorted((self.first.name, self.second.name)))

    def bodies(self, directory: Directory) -> set[int]:
        """Return the numbers of the bodies in the engine."""
        return {body_of(directory, self.first), body_of(directory, self.second)}


def body_of(directory: Directory, part: Touching) -> int:
    """Return the number in the engine: of a rod its index, of a body one after all rods, of an obstacle -1 - index."""
    if isinstance(part, BodyPart):
        return len(directory.all(RodPart)) + surfaces_of(directory).index(part)
    return part.index if isinstance(part, RodPart) else -1 - directory.all(ObstaclePart).index(part)


def describe_contact(directory: Directory) -> _core.ContactDescription:
    """Return the description of contact for the engine.

    Raises
    ------
    ValueError
        A distance tolerance above the contact radius of a rod.
    """
    settings: ContactSettings = directory.contact
    contact = _core.ContactDescription()
    contact.rods = bool(settings.rods)
    contact.warns_of_crossings = settings.rods is None
    contact.friction = settings.friction
    contact.restitution = settings.restitution
    contact.law = settings.model
    contact.friction_law = settings.friction_model
    contact.distance_tolerance = settings.distance_tolerance or 0.0
    contact.slip_tolerance = settings.slip_tolerance
    if settings.stiffness == "source":
        contact.stiffness_rule = "source"
    else:
        contact.stiffness = settings.stiffness or 0.0
    contact.centreline_friction = settings.centreline_friction
    contact.overlap = settings.overlap
    obstacles = directory.all(ObstaclePart)
    rods = directory.all(RodPart)
    for rod in rods:
        smallest = float(rod.contact_radius.min())
        if settings.distance_tolerance is not None and settings.distance_tolerance > smallest:
            raise ValueError(
                f"distance_tolerance must not exceed the contact radius of rod {rod.name!r}, {smallest:g} m, "
                f"got {settings.distance_tolerance:g} m"
            )
    contact.obstacles = [_describe_obstacle(part) for part in obstacles]
    for part in obstacles:
        check_law(part.friction.directions, settings.friction_model, f"friction of {part.name!r}")
        check_rolling(part.rolling_friction, settings.friction_model, part.name)
    contact.obstacle_friction = np.array([part.friction.directions for part in obstacles], dtype=float).reshape(-1, 3)
    contact.obstacle_rolling = np.array([part.rolling_friction for part in obstacles], dtype=float)
    contact.obstacle_restitution = np.array([part.restitution for part in obstacles], dtype=float)
    bodies = {rod.name: rod.index for rod in rods} | {part.name: -1 - i for i, part in enumerate(obstacles)}
    bodies |= {body.name: len(rods) + i for i, body in enumerate(surfaces_of(directory))}
    for (a, b), own in settings.pairs.items():
        if own.friction is not None:
            check_law(own.friction.directions, settings.friction_model, f"friction of {a!r} and {b!r}")
    owned = {(bodies[a], bodies[b]): own for (a, b), own in settings.pairs.items()}
    pairs = [_pair(first, second, own) for (first, second), own in owned.items()]
    _vary_friction(pairs, owned, rods, obstacles)
    members = list(settings.groups.items())
    for i, (a, group) in enumerate(members):
        pairs += [_pair(bodies[a], bodies[b], PairSettings(ignored=True)) for b, other in members[i:] if other == group]
    contact.pairs = pairs
    return contact


def _describe_obstacle(part: ObstaclePart) -> _core.ObstacleDescription:
    obstacle = _core.ObstacleDescription()
    obstacle.kind = part.kind
    obstacle.point = part.point
    obstacle.other = part.other
    obstacle.radius = part.radius
    obstacle.name = part.name
    if part.solid is not None:
        obstacle.set_shape(shape_of(part.solid))
    return obstacle


def _pair(first: int, second: int, own: PairSettings) -> _core.ContactPairDescription:
    pair = _core.ContactPairDescription()
    pair.first, pair.second = first, second
    pair.ignored = own.ignored
    if own.friction is not None:
        pair.friction = np.array(own.friction.directions)
    pair.stiffness = own.stiffness or 0.0
    pair.restitution = -1.0 if own.restitution is None else own.restitution
    return pair


def _vary_friction(
    pairs: list[_core.ContactPairDescription],
    owned: dict[tuple[int, int], PairSettings],
    rods: list[RodPart],
    obstacles: list[ObstaclePart],
) -> None:
    """Give rods and obstacles what their friction is where it varies; pairs that have nothing else of their own too."""
    for i, obstacle in enumerate(obstacles):
        for rod in rods:
            bodies = {rod.index, -1 - i}
            place = next((k for k, both in enumerate(owned) if set(both) == bodies), None)
            own = None if place is None else pairs[place]
            friction = None if place is None else list(owned.values())[place].friction
            shares = (friction or obstacle.friction).shares(rod.points, rod.closed, f"friction of {obstacle.name!r}")
            if shares is None:
                continue
            if own is None:
                own = _pair(rod.index, -1 - i, PairSettings())
                pairs.append(own)
            own.shares = shares


def drawn_frictions(scene: Directory) -> dict[tuple[str, ...], Coefficients]:
    """Friction that varies over obstacles, and that of pairs that does so, as it was drawn."""
    found: dict[tuple[str, ...], Coefficients] = {(part.name,): part.friction for part in scene.all(ObstaclePart)}
    found |= {names: own.friction for names, own in scene.contact.pairs.items() if own.friction is not None}
    return {names: friction for names, friction in found.items() if friction.field is not None}


def contact_table(directory: Directory, table: _core.ContactTable) -> npt.NDArray[np.void]:
    """Contacts of the engine as a structured array with names."""
    rods = [rod.name for rod in directory.layout.rods] + [body.name for body in surfaces_of(directory)]
    obstacles = [part.name for part in directory.all(ObstaclePart)]
    contacts = np.zeros(len(table.bodies), CONTACT)
    bodies, numbers = table.bodies, table.numbers
    for i, (a, _, b, _, _) in enumerate(bodies):
        contacts["pair"][i] = rods[a], rods[b] if b >= 0 else obstacles[-1 - b]
    contacts["edge"] = bodies[:, [1, 3]]
    contacts["sticking"] = bodies[:, 4] != 0
    contacts["distance"], contacts["gap"] = numbers[:, 0], numbers[:, 1]
    contacts["point"], contacts["normal"] = numbers[:, 2:5], numbers[:, 5:8]
    contacts["normal_force"], contacts["friction"] = numbers[:, 8], numbers[:, 9:12]
    return contacts
