"""What the rods of a scene may touch: the methods of `Scene` that are about contact and friction.

Its numbered equations are those of Andrew Choi's doctoral dissertation, University of California, Los Angeles, whose
chapters on contact follow Tong, Choi, Joo, Jawed: A fully implicit method for robust frictional contact handling in
elastic rods, Extreme Mechanics Letters 58, 2023.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, cast, get_args

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.contacts import Body, make_obstacle, pair_friction, pair_of
from withe.parts.directory import Directory
from withe.parts.friction import Coefficients, Friction
from withe.parts.handles import Obstacle, Rod
from withe.parts.kinds import ContactModel, FrictionModel, Overlap, PairSettings

__all__ = ["Contacts"]


@keyword_hints
class Contacts:
    """Obstacles, contact of rods, and friction of a scene: methods of `Scene` that need its parts alone."""

    _directory: Directory

    def add_floor(
        self,
        height: float = 0.0,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        rolling_friction: float = 0.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a floor at a height [m], with its normal along +z.

        Parameters
        ----------
        height : float [m]
        friction : float, pair or tuple of three of float, or callable
            Coefficient between the floor and every rod; see `set_friction` for single rods. Two coefficients are those
            along and across a rod, as of snakes and of bristles: for a slip in the direction s on rods with the tangent
            t, friction is the normal force times mu_along (s . t) t + mu_across (s - (s . t) t) [Hu et al. 2009, PNAS
            106]. Three are those of a rod that slides towards its end, towards its start, and across itself: mu_along
            is the first or the second. A callable has friction vary over the floor: `f(points)`, points of shape (n, 3)
            [m], answers n coefficients, or an image of it does, a `FrictionMap`. It is asked before each step, where
            nodes and edges are then, and moves and turns with its obstacle.
        restitution : float
            Speed after an impact over that before it, from 0 to 1; see `enable_contact`.
        rolling_friction : float
            Of rods that roll on it: a couple of at most this times the rod's radius times the normal force
            [Johnson 1985, Contact Mechanics, section 9.1]. "anchored" and "implicit" friction have it.
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
        return cast(
            Obstacle,
            self._directory.add(
                make_obstacle(
                    name, "plane", np.array([0.0, 0.0, height]), up, 0.0, friction, restitution, rolling_friction
                )
            ),
        )

    def add_plane(
        self,
        point: npt.ArrayLike,
        normal: npt.ArrayLike,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        rolling_friction: float = 0.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a plane through a point; what is behind it, against its normal, is solid.

        It touches the smooth curve of a rod that its nodes stand for, and not their corners.

        Parameters
        ----------
        point : array_like of shape (3,) [m]
        normal : array_like of shape (3,)
            Of any length.
        friction : float, pair or tuple of three of float, or callable
        restitution, rolling_friction : float
        name : str

        Returns
        -------
        Obstacle
        """
        name = self._directory.new_name(name, "plane")
        where = validation.vector(point, f"point of {name!r}")
        across = validation.unit_vector(normal, f"normal of {name!r}")
        return cast(
            Obstacle,
            self._directory.add(
                make_obstacle(name, "plane", where, across, 0.0, friction, restitution, rolling_friction)
            ),
        )

    def add_sphere(
        self,
        center: npt.ArrayLike,
        radius: float,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        rolling_friction: float = 0.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a solid sphere.

        With a radius of an edge's length and more (its rod's included) it touches the smooth curve of a rod, or its
        edges where it is smaller.

        Parameters
        ----------
        center : array_like of shape (3,) [m]
        radius : float [m]
        friction : float, pair or tuple of three of float, or callable
        restitution, rolling_friction : float
        name : str

        Returns
        -------
        Obstacle
        """
        name = self._directory.new_name(name, "sphere")
        where = validation.vector(center, f"center of {name!r}")
        radius = validation.positive(radius, f"radius of {name!r}")
        return cast(
            Obstacle,
            self._directory.add(
                make_obstacle(name, "capsule", where, where, radius, friction, restitution, rolling_friction)
            ),
        )

    def add_capsule(
        self,
        start: npt.ArrayLike,
        end: npt.ArrayLike,
        radius: float,
        *,
        friction: Friction = 0.0,
        restitution: float = 1.0,
        rolling_friction: float = 0.0,
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
        friction : float, pair or tuple of three of float, or callable
        restitution, rolling_friction : float
        name : str

        Returns
        -------
        Obstacle
        """
        name = self._directory.new_name(name, "capsule")
        first, last = validation.vector(start, f"start of {name!r}"), validation.vector(end, f"end of {name!r}")
        radius = validation.positive(radius, f"radius of {name!r}")
        return cast(
            Obstacle,
            self._directory.add(
                make_obstacle(name, "capsule", first, last, radius, friction, restitution, rolling_friction)
            ),
        )

    def enable_contact(
        self,
        *,
        rods: bool = True,
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
        rods : bool
            Whether rods touch each other and themselves; False leaves them to obstacles alone, with what is said here
            of contact and friction.
        friction : float
            Coefficient between rods.
        restitution : float
            Speed at which surfaces part after an impact over that at which they met, from 0 to 1; see Notes.
        model : {"imcv2", "barrier", "imcv1", "spillmann_teschner"}
            Energy of contact: the smooth penalty of Choi's dissertation, (5.2), or a barrier, (5.1), which gives way
            by what yields under growing loads. Archival, for
            comparison: its first penalty, (4.16), and the baseline of its 4.7, a penalty without a tolerance
            that leads out of a depth within one step.
        friction_model : {"anchored", "implicit", "lagged", "semi_explicit"}
            An elastic stick that holds a load without creep, and gives by a twentieth of the distance tolerance before
            it slips; a force that grows with the slip velocity, at the end of
            the step, exactly, under which what is held creeps; the same with the forces of the step's start, which
            keeps the equations symmetric; or, archival, with the forces and the direction of slip of its start (4.5
            of Choi's dissertation), which holds nothing that is at rest.
        distance_tolerance : float [m]
            Surfaces nearer than this press on each other. By default it follows the load: 0.005 of the smaller radius
            where that is light, and up to a tenth for forces that bend rods, 1e-4 EI / radius^2 and more. With
            integrator "verlet" it is a tenth always.
        slip_tolerance : float [m/s]
            Slip slower than this counts as sticking, with less friction than the coefficient allows.
        stiffness : float [N/m] or "source"
            Of contact; by default it follows the forces, so that surfaces are about a tenth of the distance tolerance
            deep in each other; ten times that where a load grows a thousandfold, for what becomes stiffer under it goes
            on pressing as hard as before. Between bodies that hardly yield, where that depth decides how hard
            they press, give it. "source" is the rule (5.17) of Choi's dissertation: 1e5 / m times the
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
        Impacts are elastic by default. In implicit midpoint and energy-momentum steps the force of a step does as much
        work as contact stores [Gonzalez 1996; Laursen and Chawla 1997], so that they are elastic at any time step,
        those of rods mostly to a thousandth; seldom, once in some hundred impacts, a coarse step takes some percent.
        Steps are cut where two bodies that meet would pass around each other within one; and rods that slide over each
        other are braked by friction alone. Backward Euler, and "lagged" and "semi_explicit" friction, lose most of an
        impact shorter than a few steps, and nothing in the limit of short ones. A restitution e below 1 is the
        energetic coefficient: contact gives back e^2 of the work that pressed it together [Stronge 1990, Proc. R. Soc.
        A 431]; steps are cut until an impact is resolved, which takes hundreds of times as many where rods come to rest
        on balls and posts, unless ``adaptive=False`` or `max_halvings` of `build` ends that. Weight works over the
        depth p too, v1^2 = e^2 v0^2 - (1 - e^2) 2 g p, which is no longer e v0 for falls of some depths only. Rods
        shake within after an impact, so that as a whole they part more slowly than e says. Surfaces that meet more
        slowly than sqrt(g r / 100), r the smaller radius, or than the slip tolerance, rest on each other, and so do
        those that stay in contact for longer than an impact lasts. What contact takes for good is part of
        `Simulation.energy().dissipated`, and what it stores is `.contact`. Contact and friction between rods in flight
        keep their momenta in implicit midpoint and energy-momentum steps; "lagged" and "semi_explicit" friction, which
        act where a step begins, keep the linear one, and the angular one at first order in the step: to some
        thousandths in an impact of rods that cross, in steps of 2 ms.

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
            rods=validation.truth(rods, "rods"),
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

        Parameters
        ----------
        a, b : Rod, Obstacle or str
        friction : float, pair or tuple of three of float, array_like of shape (edges,), or callable
            One coefficient; of a rod and an obstacle also two, along and across the rod, or three, of a rod that slides
            towards its end, towards its start, and across itself; one for each edge of the rod (as an array, where it
            has three edges); or a function of position on the obstacle. See `add_floor`.

        Raises
        ------
        ValueError
            Two obstacles, friction that is negative or not finite, or more than one coefficient for two rods.

        Examples
        --------
        >>> import numpy, withe
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> snake = scene.add_rod(start=(0, 0, 0.01), end=(0.3, 0, 0.01), nodes=31, radius=0.01, material=rubber)
        >>> floor = scene.add_floor()
        >>> scene.set_friction(snake, floor, numpy.linspace(0.1, 0.5, 30))
        """
        own = pair_friction(self._directory, a, b, friction)
        _set_pair(self._directory, a, b, friction=own)

    def set_restitution(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, restitution: float) -> None:
        """Give two rods, or a rod and an obstacle, a coefficient of restitution of their own, from 0 to 1."""
        _set_pair(self._directory, a, b, restitution=validation.share(restitution, "restitution"))

    def set_contact_stiffness(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, stiffness: float) -> None:
        """Give two rods, or a rod and an obstacle, a contact stiffness of their own [N/m].

        It stays as it is, and grows only where a step would end with surfaces too deep in each other.
        """
        _set_pair(self._directory, a, b, stiffness=validation.positive(stiffness, "stiffness of contact"))

    def ignore_contact(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str) -> None:
        """Let two rods, or a rod and an obstacle, pass through each other; a rod and itself too."""
        _set_pair(self._directory, a, b, ignored=True)

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


def _optional(value: float | None, what: str) -> float | None:
    return None if value is None else validation.positive(value, what)


def _set_pair(
    directory: Directory,
    a: Body,
    b: Body,
    *,
    ignored: bool = False,
    friction: Coefficients | None = None,
    restitution: float | None = None,
    stiffness: float | None = None,
) -> None:
    """Give two bodies something of their own, besides what they have."""
    key = pair_of(directory, a, b)
    settings = directory.contact
    pair = settings.pairs.get(key, PairSettings())
    pair = PairSettings(
        ignored,
        pair.friction if friction is None else friction,
        pair.restitution if restitution is None else restitution,
        pair.stiffness if stiffness is None else stiffness,
    )
    directory.contact = replace(settings, pairs={**settings.pairs, key: pair})
