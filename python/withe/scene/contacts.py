"""Contact and friction: the methods of `Scene` for obstacles and pairs of bodies.

The equation numbers are those of Andrew Choi's doctoral dissertation, University of California, Los Angeles. Its
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
from withe.parts.contacts import Toucher, make_obstacle, pair_friction, pair_of
from withe.parts.directory import Directory
from withe.parts.friction import Coefficients, Friction
from withe.parts.handles import Body, Obstacle, Rod
from withe.parts.kinds import ContactModel, FrictionModel, Overlap, PairSettings
from withe.solids import Capsule, Field, Sphere, Tube

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
            Height of the floor.
        friction : float, pair or tuple of three of float [-], or callable
            Friction coefficient between the floor and every rod; `set_friction` sets it for one rod.

            * Two coefficients act along and across a rod. For slip in direction s on a rod with tangent t, friction is
              the normal force times mu_along (s . t) t + mu_across (s - (s . t) t) [Hu et al. 2009, PNAS 106].
            * Three coefficients act on a rod that slides towards its end, towards its start, and across itself.
            * A callable varies friction over the floor: ``f(points)``, with points of shape (n, 3) [m], returns n
              coefficients. It is called before each step, and moves and turns with the obstacle. A `FrictionMap` is
              such a callable, made from an image.
        restitution : float [-]
            Speed after an impact over the speed before, from 0 to 1; see `enable_contact`.
        rolling_friction : float [-]
            Coefficient of rolling friction. The resisting couple is at most the coefficient times the radius of the
            rod times the normal force [Johnson 1985, Contact Mechanics, section 9.1]. Needs "anchored" or "implicit"
            friction.
        name : str
            Name of the floor. By default "floor 1", ...

        Returns
        -------
        Obstacle

        Raises
        ------
        ValueError
            A height that is not a number, negative friction, or a restitution outside of 0 to 1.

        See Also
        --------
        add_plane : Add a plane in any direction.
        set_friction : Set the friction between the floor and one rod.
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
        """Add a plane through a point. The half space behind the plane, against the normal, is solid.

        Contact acts on the smooth curve through the nodes of a rod, not on its corners.

        Parameters
        ----------
        point : array_like of shape (3,) [m]
            A point of the plane.
        normal : array_like of shape (3,)
            Normal of any length, out of the solid.
        friction : float, pair or tuple of three of float [-], or callable
            Friction coefficient, as in `add_floor`.
        restitution, rolling_friction : float [-]
            Coefficients of restitution and rolling friction, as in `add_floor`.
        name : str
            Name of the plane. By default "plane 1", ...

        Returns
        -------
        Obstacle

        Raises
        ------
        ValueError
            A point or normal that is not finite, a normal of length zero, negative friction, or a restitution outside
            of 0 to 1.

        See Also
        --------
        add_floor : Add a horizontal plane.
        Simulation.move : Move the plane.
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

        If the radii of sphere and rod together are at least the length of an edge, contact acts on the smooth curve
        through the nodes of the rod. For smaller spheres contact acts on the straight edges.

        Parameters
        ----------
        center : array_like of shape (3,) [m]
            Center of the sphere.
        radius : float [m]
            Radius of the sphere.
        friction : float, pair or tuple of three of float [-], or callable
            Friction coefficient, as in `add_floor`.
        restitution, rolling_friction : float [-]
            Coefficients of restitution and rolling friction, as in `add_floor`.
        name : str
            Name of the sphere. By default "sphere 1", ...

        Returns
        -------
        Obstacle

        Raises
        ------
        ValueError
            A center that is not finite, a radius that is not positive, negative friction, or a restitution outside of
            0 to 1.

        See Also
        --------
        add_capsule : Add a cylinder with round ends.
        Simulation.move : Move the sphere.
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
        """Add a solid capsule, which is a cylinder with round ends.

        If the radii of capsule and rod together are at least the length of an edge, contact acts on the smooth curve
        through the nodes of the rod. For thinner capsules contact acts on the straight edges.

        Parameters
        ----------
        start, end : array_like of shape (3,) [m]
            Ends of the axis.
        radius : float [m]
            Radius of the capsule.
        friction : float, pair or tuple of three of float [-], or callable
            Friction coefficient, as in `add_floor`.
        restitution, rolling_friction : float [-]
            Coefficients of restitution and rolling friction, as in `add_floor`.
        name : str
            Name of the capsule. By default "capsule 1", ...

        Returns
        -------
        Obstacle

        Raises
        ------
        ValueError
            An end that is not finite, a radius that is not positive, negative friction, or a restitution outside of 0
            to 1.

        See Also
        --------
        add_sphere : Add a sphere.
        Simulation.move : Move the capsule.
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

    def add_obstacle(
        self,
        solid: Tube | Field,
        *,
        position: npt.ArrayLike = (0.0, 0.0, 0.0),
        friction: Friction = 0.0,
        restitution: float = 1.0,
        rolling_friction: float = 0.0,
        name: str | None = None,
    ) -> Obstacle:
        """Add a tube, or a solid that is given by its signed distance.

        Contact acts on the smooth curve through the nodes of a rod. `Simulation.move` moves the obstacle without
        turning it.

        Parameters
        ----------
        solid : Tube or Field of withe.solids
            Shape of the obstacle.
        position : array_like of shape (3,) [m]
            Where the origin of the solid's axes is.
        friction : float, pair or tuple of three of float [-], or callable
            Friction coefficient, as in `add_floor`.
        restitution, rolling_friction : float [-]
            Coefficients of restitution and rolling friction, as in `add_floor`.
        name : str
            Name of the obstacle. By default "tube 1", "field 1", ...

        Returns
        -------
        Obstacle

        Raises
        ------
        ValueError
            Another solid, a position that is not finite, negative friction, or a restitution outside of 0 to 1. The
            simulation refuses a rod that is drawn inside of a tube that is no wider, and a body with faces.

        See Also
        --------
        add_sphere, add_capsule : Add round obstacles.
        Scene.add_body : Add a box, hull or mesh, which `clamp` holds.

        Examples
        --------
        >>> import numpy as np
        >>> import withe
        >>> scene = withe.Scene(gravity=(0,0,0))
        >>> vessel = scene.add_obstacle(withe.solids.Tube([(0, 0, 0), (0.2, 0, 0)], radius=0.002), friction=0.1)
        >>> steel = withe.Material(youngs_modulus=2e11, density=7800)
        >>> wire = scene.add_rod(start=(0.01, 0, 0), end=(0.19, 0, 0), nodes=61, radius=2e-4, material=steel)
        """
        if not isinstance(solid, Tube | Field):
            instead = (
                "use add_sphere or add_capsule"
                if isinstance(solid, Sphere | Capsule)
                else "use add_body, and hold the body with clamp"
            )
            raise ValueError(
                f"solid of an obstacle must be a Tube or Field of withe.solids, got {solid!r:.80}: {instead}"
            )
        name = self._directory.new_name(name, type(solid).__name__.lower())
        where = validation.vector(position, f"position of {name!r}")
        part = make_obstacle(name, "shape", where, where, 0.0, friction, restitution, rolling_friction, solid)
        return cast(Obstacle, self._directory.add(part))

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
        """Enable contact of rods with each other and themselves, and set the contact model.

        Contact with obstacles is always on and uses the same model and tolerances. Places of one rod that are closer
        than (pi / 2) (2 radius + tolerance) along the rod, joints included, do not touch each other.

        Parameters
        ----------
        rods : bool
            True if rods touch each other and themselves. False enables contact with obstacles only.
        friction : float [-]
            Friction coefficient between rods.
        restitution : float [-]
            Speed after an impact between rods over the speed before, from 0 to 1; see Notes.
        model : {"imcv2", "barrier", "imcv1", "spillmann_teschner"}
            Contact energy: the smooth penalty (5.2) of Choi's dissertation, or its barrier (5.1). For comparison, its
            first penalty (4.16), and the baseline of its section 4.7, which removes a penetration within one step.
        friction_model : {"anchored", "implicit", "lagged", "semi_explicit"}
            * "anchored": elastic sticking without creep. A contact yields by a twentieth of the distance tolerance
              before it slips.
            * "implicit": the friction force grows with the slip velocity at the end of the step. Loaded contacts creep.
            * "lagged": as "implicit", with the normal forces of the start of the step, so that the equations stay
              symmetric.
            * "semi_explicit": normal forces and slip direction of the start of the step (archival; section 4.5 of
              Choi's dissertation). Does not model static friction.
        distance_tolerance : float [m]
            Distance of surfaces below which they press on each other. By default it follows the load: 0.005 of the
            smaller radius for light loads, up to 0.1 of the radius for forces that bend rods (1e-4 EI / radius^2 and
            more). With integrator "verlet" always 0.1 of the radius.
        slip_tolerance : float [m/s]
            Slip velocity below which a contact sticks, with less friction than the coefficient allows.
        stiffness : float [N/m] or "source"
            Contact stiffness. By default it follows the forces, so that surfaces penetrate each other by about a tenth
            of the distance tolerance (up to ten times more if a load grows by a factor of 1000). Give a value if rigid
            bodies press a rod between them, because the penetration then determines the force. "source" is rule (5.17)
            of Choi's dissertation: 1e5 / m times the greatest contact force on a node.
        centreline_friction : bool
            True if friction acts on the centrelines, as in Choi's dissertation, instead of the surfaces.
        overlap : {"error", "separate"}
            Treatment of surfaces that are drawn inside each other: `build` raises `ValueError`, or moves the rods apart
            quasi-statically, with supports fixed. The natural shape stays as drawn, so moved rods are stressed.

        Raises
        ------
        ValueError
            Negative friction, a restitution outside of 0 to 1, a tolerance or stiffness that is not positive, or a
            tolerance above a radius. `build` raises it for overlapping surfaces, naming both edges and the depth, and
            for a restitution below 1 with integrator "verlet".

        See Also
        --------
        set_friction : Set the friction of two bodies.
        ignore_contact : Disable contact of two bodies.
        Simulation.contacts : Places and forces of contacts.

        Notes
        -----
        Energy. Impacts are elastic by default. In implicit midpoint and energy-momentum steps the contact force does as
        much work as contact stores [Gonzalez 1996; Laursen and Chawla 1997], so impacts are elastic at any time step.
        Impacts of rods lose mostly less than 0.1 %; about one in some hundred loses a few percent in coarse steps.
        Backward Euler, and "lagged" and "semi_explicit" friction, lose most of an impact that is shorter than a few
        steps. Energy removed by contact is reported in `Simulation.energy().dissipated`, stored energy in `.contact`.

        Restitution. With a coefficient e below 1, surfaces part at e times the speed at which they met [Newton; Moreau
        1988]. Each impact is one event within one time step, with Coulomb's friction. The time step is not subdivided
        for it. Impacts never return more energy than they take: where friction, or several contacts at once, would
        gain energy, all rebounds of the step are weaker. Rods vibrate after an impact, so their mean velocity is less
        than e times the velocity before. Surfaces come to rest on each other if they meet more slowly than the slip
        tolerance, or more slowly than sqrt(g r / 100) with the smaller radius r. So do surfaces that would come back
        within a time step.

        Momentum. Contact and friction between rods conserve linear and angular momentum in implicit midpoint and
        energy-momentum steps. "lagged" and "semi_explicit" friction conserve linear momentum, and angular momentum to
        first order in the time step. Steps are subdivided if two bodies would pass around each other within a step.

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

    def set_friction(self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str, friction: Friction) -> None:
        """Set the friction coefficient of two rods or bodies, or of one of them and an obstacle.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies.
        friction : float, pair or tuple of three of float [-], array_like of shape (edges,), or callable
            One coefficient. For a rod and an obstacle also two or three coefficients by direction, or a function of
            position on the obstacle, as in `add_floor`. Also one coefficient per edge of the rod (as an array if the
            rod has three edges).

        Raises
        ------
        ValueError
            Two obstacles, friction that is negative or not finite, or more than one coefficient for two rods.

        See Also
        --------
        Simulation.set : Change the friction during a simulation.
        enable_contact : Set the friction between all rods.

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

    def set_restitution(
        self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str, restitution: float
    ) -> None:
        """Set the coefficient of restitution of two rods or bodies, or of one of them and an obstacle.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies.
        restitution : float [-]
            Speed after an impact over the speed before, from 0 to 1; see `enable_contact`.

        Raises
        ------
        ValueError
            Two obstacles, or a restitution outside of 0 to 1.

        See Also
        --------
        enable_contact : Set the restitution between all rods.
        """
        _set_pair(self._directory, a, b, restitution=validation.share(restitution, "restitution"))

    def set_contact_stiffness(
        self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str, stiffness: float
    ) -> None:
        """Set the contact stiffness of two rods or bodies, or of one of them and an obstacle.

        The stiffness is constant, except that it grows if surfaces would penetrate each other too deeply in a step.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies.
        stiffness : float [N/m]
            Contact force per penetration of the surfaces.

        Raises
        ------
        ValueError
            Two obstacles, or a stiffness that is not positive.

        See Also
        --------
        enable_contact : Set the stiffness of all contacts.
        """
        _set_pair(self._directory, a, b, stiffness=validation.positive(stiffness, "stiffness of contact"))

    def ignore_contact(self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str) -> None:
        """Disable contact of two rods or bodies, of one of them and an obstacle, or of a rod with itself.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies, or one rod twice.

        Raises
        ------
        ValueError
            Two obstacles, or a body that is not in the scene.

        See Also
        --------
        set_contact_group : Disable contact within a group of rods.
        """
        _set_pair(self._directory, a, b, ignored=True)

    def set_contact_group(self, rod: Rod | str, group: str) -> None:
        """Put a rod into a group. Rods of one group do not touch each other or themselves.

        Parameters
        ----------
        rod : Rod or str
            Rod to put into the group.
        group : str
            Name of the group.

        Raises
        ------
        ValueError
            The first argument is not a rod, or the group is not text.

        See Also
        --------
        ignore_contact : Disable contact of two bodies.
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
    a: Toucher,
    b: Toucher,
    *,
    ignored: bool = False,
    friction: Coefficients | None = None,
    restitution: float | None = None,
    stiffness: float | None = None,
) -> None:
    """Give a pair of bodies its own values, in addition to those that it has."""
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
