"""What the rods of a scene may touch: the part of `Scene` that is about contact and friction.

Its numbered equations are those of Andrew Choi's doctoral dissertation, University of California, Los Angeles, whose
chapters on contact follow Tong, Choi, Joo, Jawed: A fully implicit method for robust frictional contact handling in
elastic rods, Extreme Mechanics Letters 58, 2023.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, cast, get_args

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.friction import Friction, check_law, friction_pair
from withe.parts.handles import Obstacle, Rod
from withe.parts.kinds import (
    ContactModel,
    ContactSettings,
    FrictionModel,
    ObstaclePart,
    Overlap,
    PairSettings,
    RodPart,
)

__all__ = ["CONTACT", "Contacts", "body_of", "contact_table", "describe_contact", "touching"]

FloatArray = npt.NDArray[np.float64]

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


class Contacts:
    """Obstacles, contact of rods, and friction of a scene."""

    _directory: Directory

    def add_floor(
        self, height: float = 0.0, *, friction: Friction = 0.0, restitution: float = 1.0, name: str | None = None
    ) -> Obstacle:
        """Add a floor at a height [m], with its normal along +z.

        Parameters
        ----------
        height : float [m]
        friction : float or pair of float
            Coefficient between the floor and every rod; see `set_friction` for single rods. Two coefficients are those
            along and across a rod, as of snakes and of bristles: for a slip in the direction s on rods with the tangent
            t, friction is the normal force times mu_along (s . t) t + mu_across (s - (s . t) t)
            [Hu et al. 2009, PNAS 106].
        restitution : float
            Speed after an impact over that before it, from 0 to 1; see `enable_contact`.
        name : str

        Returns
        -------
        Obstacle

        Raises
        ------
        ValueError
            A height that is no number, negative friction, or a restitution outside 0 to 1.
        """
        height = validation.number(height, "height of the floor")
        name = self._directory.new_name(name, "floor")
        up = np.array([0.0, 0.0, 1.0])
        return self._obstacle(name, "plane", np.array([0.0, 0.0, height]), up, 0.0, friction, restitution)

    def add_plane(
        self,
        point: npt.ArrayLike,
        normal: npt.ArrayLike,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a plane through a point; what is behind it, against its normal, is solid.

        It touches the smooth curve of a rod that its nodes stand for, and not their corners.

        Parameters
        ----------
        point : array_like of shape (3,) [m]
        normal : array_like of shape (3,)
            Of any length.
        friction : float or pair of float
        restitution : float
        name : str

        Returns
        -------
        Obstacle
        """
        name = self._directory.new_name(name, "plane")
        where = validation.vector(point, f"point of {name!r}")
        across = validation.unit_vector(normal, f"normal of {name!r}")
        return self._obstacle(name, "plane", where, across, 0.0, friction, restitution)

    def add_sphere(
        self,
        center: npt.ArrayLike,
        radius: float,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a solid sphere.

        With a radius of an edge's length and more (its rod's included) it touches the smooth curve of a rod, or its
        edges where it is smaller.

        Parameters
        ----------
        center : array_like of shape (3,) [m]
        radius : float [m]
        friction : float or pair of float
        restitution : float
        name : str

        Returns
        -------
        Obstacle
        """
        name = self._directory.new_name(name, "sphere")
        where = validation.vector(center, f"center of {name!r}")
        radius = validation.positive(radius, f"radius of {name!r}")
        return self._obstacle(name, "capsule", where, where, radius, friction, restitution)

    def add_capsule(
        self,
        start: npt.ArrayLike,
        end: npt.ArrayLike,
        radius: float,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a solid cylinder with round ends.

        With a radius of an edge's length and more (its rod's included) it touches the smooth curve of a rod, or its
        edges where it is smaller.

        Parameters
        ----------
        start, end : array_like of shape (3,) [m]
            Of its axis.
        radius : float [m]
        friction : float or pair of float
        restitution : float
        name : str

        Returns
        -------
        Obstacle
        """
        name = self._directory.new_name(name, "capsule")
        first, last = validation.vector(start, f"start of {name!r}"), validation.vector(end, f"end of {name!r}")
        radius = validation.positive(radius, f"radius of {name!r}")
        return self._obstacle(name, "capsule", first, last, radius, friction, restitution)

    def enable_contact(
        self,
        *,
        friction: float = 0.0,
        restitution: float = 1.0,
        model: ContactModel = "imcv2",
        friction_model: FrictionModel = "anchored",
        distance_tolerance: float | None = None,
        slip_tolerance: float = 1e-3,
        stiffness: float | Literal["source"] | None = None,
        centreline_friction: bool = False,
        overlap: Overlap = "error",
    ) -> None:
        """Let rods touch each other and themselves. Obstacles need no such word; its tolerances are theirs too.

        A rod does not touch itself within (pi / 2) (2 radius + tolerance) along it, joints included.

        Parameters
        ----------
        friction : float
            Coefficient between rods.
        restitution : float
            Speed at which surfaces part after an impact over that at which they met, from 0 to 1; see Notes.
        model : {"imcv2", "barrier", "imcv1", "spillmann_teschner"}
            Energy of contact: the smooth penalty of Choi's dissertation, (5.2), or a barrier, (5.1). Archival, for
            comparison: its first penalty, (4.16), and the baseline of its 4.7, a penalty without a tolerance
            that leads out of a depth within one step.
        friction_model : {"anchored", "implicit", "lagged", "semi_explicit"}
            An elastic stick that holds a load without creep; a force that grows with the slip velocity, at the end of
            the step, exactly, under which what is held creeps; the same with the forces of the step's start, which
            keeps the equations symmetric; or, archival, with the forces and the direction of slip of its start (4.5
            of Choi's dissertation), which holds nothing that is at rest.
        distance_tolerance : float [m]
            Surfaces nearer than this press on each other; by default a tenth of the smaller radius.
        slip_tolerance : float [m/s]
            Slip slower than this counts as sticking, with less friction than the coefficient allows.
        stiffness : float [N/m] or "source"
            Of contact; by default it follows the forces, so that surfaces are about a hundredth of the
            smaller radius deep in each other. "source" is the rule (5.17) of Choi's dissertation: 1e5 / m times the
            greatest force on a node in contact, for all contacts; it has a scale, that of its flagella.
        centreline_friction : bool
            Let friction act on the centrelines, as in Choi's dissertation, and not where surfaces touch.
        overlap : {"error", "separate"}
            What `build` does with surfaces that are drawn inside each other: refuse them, or move rods apart,
            quasi-statically, with supports where they are. What is moved is stressed: its natural shape stays
            that of the drawing.

        Raises
        ------
        ValueError
            Negative friction, a restitution outside 0 to 1, a tolerance or stiffness that is not positive, a tolerance
            above a radius; from `build`, surfaces inside each other, with both edges and the depth, and a restitution
            below 1 with integrator "verlet".

        Notes
        -----
        Impacts are elastic by default. In implicit midpoint and energy-momentum steps they are so at any time step:
        the force of a step does as much work as contact stores [Gonzalez 1996; Laursen and Chawla 1997]. Backward
        Euler, and "lagged" and "semi_explicit" friction, lose most of an impact shorter than a few steps, and nothing
        in the limit of short ones. With a
        restitution e below 1 contact gives back e^2 of the energy that it took; steps are cut until an impact is
        resolved, unless ``adaptive=False``. Rods shake within after an impact, so that as a whole they part more slowly
        than e says. Surfaces that meet more slowly than sqrt(g r / 100), r the smaller radius, or than the slip
        tolerance, rest on each other, and so do those that stay in contact for longer than an impact lasts. What
        contact takes for good is part of `Simulation.energy().dissipated`, and what it stores is `.contact`.

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> rod = scene.add_rod(start=(0, 0, 0.01), end=(0.3, 0, 0.01), nodes=31, radius=5e-3, material=rubber)
        >>> floor = scene.add_floor(friction=0.4, restitution=0.0)
        >>> scene.enable_contact(friction=0.3)
        >>> simulation = scene.build(time_step=5e-3)
        >>> simulation.step(40)
        >>> len(simulation.contacts()) > 0
        True
        """
        settings = self._directory.contact
        self._directory.contact = replace(
            settings,
            rods=True,
            friction=validation.non_negative(friction, "friction"),
            restitution=validation.share(restitution, "restitution"),
            model=cast(ContactModel, validation.choice(model, "model of contact", get_args(ContactModel))),
            friction_model=cast(
                FrictionModel, validation.choice(friction_model, "friction_model", get_args(FrictionModel))
            ),
            distance_tolerance=_optional(distance_tolerance, "distance_tolerance"),
            slip_tolerance=validation.positive(slip_tolerance, "slip_tolerance"),
            stiffness=stiffness if stiffness == "source" else _optional(stiffness, "stiffness of contact"),
            centreline_friction=validation.truth(centreline_friction, "centreline_friction"),
            overlap=cast(Overlap, validation.choice(overlap, "overlap", get_args(Overlap))),
        )

    def set_friction(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, friction: Friction) -> None:
        """Give two rods, or a rod and an obstacle, a friction coefficient of their own.

        A rod and an obstacle may have two, along and across the rod; see `add_floor`.
        """
        rods = all(isinstance(touching(self._directory, body), RodPart) for body in (a, b))
        self._set_pair(a, b, ignored=False, friction=friction_pair(friction, "friction", directed=not rods))

    def set_restitution(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, restitution: float) -> None:
        """Give two rods, or a rod and an obstacle, a coefficient of restitution of their own, from 0 to 1."""
        self._set_pair(a, b, ignored=False, restitution=validation.share(restitution, "restitution"))

    def set_contact_stiffness(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, stiffness: float) -> None:
        """Give two rods, or a rod and an obstacle, a contact stiffness of their own [N/m].

        It stays as it is, and grows only where a step would end with surfaces too deep in each other.
        """
        self._set_pair(a, b, ignored=False, stiffness=validation.positive(stiffness, "stiffness of contact"))

    def ignore_contact(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str) -> None:
        """Let two rods, or a rod and an obstacle, pass through each other; a rod and itself too."""
        self._set_pair(a, b, ignored=True)

    def set_contact_group(self, rod: Rod | str, group: str) -> None:
        """Put a rod into a group, whose members do not touch each other or themselves.

        Raises
        ------
        ValueError
            Not a rod, or a group whose name is no text.
        """
        part = self._directory.rod(rod)
        if not isinstance(group, str) or not group:
            raise ValueError(f"group of rod {part.name!r} must be text, got {group!r:.80}")
        settings = self._directory.contact
        self._directory.contact = replace(settings, groups={**settings.groups, part.name: group})

    def _set_pair(self, a: Any, b: Any, **own: Any) -> None:
        first, second = touching(self._directory, a), touching(self._directory, b)
        if isinstance(first, ObstaclePart) and isinstance(second, ObstaclePart):
            raise ValueError(f"{first.name!r} and {second.name!r} are both obstacles, which never touch")
        settings = self._directory.contact
        key = (first.name, second.name) if first.name <= second.name else (second.name, first.name)
        pair = replace(settings.pairs.get(key, PairSettings()), **own)
        self._directory.contact = replace(settings, pairs={**settings.pairs, key: pair})

    def _obstacle(
        self,
        name: str,
        kind: Literal["plane", "capsule"],
        point: FloatArray,
        other: FloatArray,
        radius: float,
        friction: Friction,
        restitution: float,
    ) -> Obstacle:
        both = friction_pair(friction, f"friction of {name!r}")
        restitution = validation.share(restitution, f"restitution of {name!r}")
        part = ObstaclePart(name, kind, point, other, radius, both, restitution)
        return cast(Obstacle, self._directory.add(part))


def touching(directory: Directory, handle: Any) -> RodPart | ObstaclePart:
    """What a handle or name of something that touches means.

    Raises
    ------
    ValueError
        Neither a rod nor an obstacle.
    """
    part = directory.find_any(handle, "what touches")
    if not isinstance(part, RodPart | ObstaclePart):
        raise ValueError(f"what touches must be a rod or an obstacle, got {part.name!r}")
    return part


def body_of(directory: Directory, part: RodPart | ObstaclePart) -> int:
    """How the engine calls a rod (its index) or an obstacle (-1 - index)."""
    return part.index if isinstance(part, RodPart) else -1 - directory.all(ObstaclePart).index(part)


def _optional(value: float | None, what: str) -> float | None:
    return None if value is None else validation.positive(value, what)


def describe_contact(directory: Directory) -> _core.ContactDescription:
    """What touches, for the engine.

    Raises
    ------
    ValueError
        A distance tolerance above the radius of a rod.
    """
    settings: ContactSettings = directory.contact
    contact = _core.ContactDescription()
    contact.rods = settings.rods
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
        smallest = float(rod.section.radii.min())
        if settings.distance_tolerance is not None and settings.distance_tolerance > smallest:
            raise ValueError(
                f"distance_tolerance must not exceed the radius of rod {rod.name!r}, {smallest:g} m, "
                f"got {settings.distance_tolerance:g} m"
            )
    contact.obstacles = [_describe_obstacle(part) for part in obstacles]
    for part in obstacles:
        check_law(part.friction, settings.friction_model, f"friction of {part.name!r}")
    contact.obstacle_friction = np.array([part.friction[0] for part in obstacles], dtype=float)
    contact.obstacle_across = np.array([part.friction[1] for part in obstacles], dtype=float)
    contact.obstacle_restitution = np.array([part.restitution for part in obstacles], dtype=float)
    bodies = {rod.name: rod.index for rod in rods} | {part.name: -1 - i for i, part in enumerate(obstacles)}
    for (a, b), own in settings.pairs.items():
        if own.friction is not None:
            check_law(own.friction, settings.friction_model, f"friction of {a!r} and {b!r}")
    pairs = [_pair(bodies[a], bodies[b], own) for (a, b), own in settings.pairs.items()]
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
    return obstacle


def _pair(first: int, second: int, own: PairSettings) -> _core.ContactPairDescription:
    pair = _core.ContactPairDescription()
    pair.first, pair.second = first, second
    pair.ignored = own.ignored
    pair.friction, pair.across = (-1.0, -1.0) if own.friction is None else own.friction
    pair.stiffness = own.stiffness or 0.0
    pair.restitution = -1.0 if own.restitution is None else own.restitution
    return pair


def contact_table(directory: Directory, table: _core.ContactTable) -> npt.NDArray[np.void]:
    """Contacts of the engine as a structured array with names."""
    rods = [rod.name for rod in directory.layout.rods]
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
