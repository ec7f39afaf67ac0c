"""What drives a simulation while it runs: natural shapes, parameters, loads."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.handles import CustomForce, Load, Rod, Support
from withe.parts.rods import curvature_array, curvature_given, stretch_array, twist_array
from withe.simulation.functions import check_jacobian
from withe.simulation.loads import remove_load
from withe.simulation.parameters import Settable, get_value, set_values
from withe.simulation.session import Session

__all__ = ["Control"]


@keyword_hints
class Control:
    """Methods of `Simulation` that actuate and set; what they do is done by functions of the session."""

    _session: Session

    # Natural shape

    def set_natural_curvature(
        self, rod: Rod | str, curvature: npt.ArrayLike, over: float = 0.0, *, discrete: bool = False
    ) -> None:
        """Actuate a rod by changing the curvature at which it is free of stress.

        A curvature out of the plane of a planar simulation makes it three-dimensional, unless it was
        built with planar=True.

        Parameters
        ----------
        rod : Rod or str
        curvature : array_like of shape (2,) or (stencils, 2) [1/m]
            Towards the two directors; one pair for the whole rod, or one a stencil.
        over : float [s]
            Reached after so long, evenly; at once by default.
        discrete : bool
            Whether the curvature is 2 tan(phi / 2) [-], phi the angle between two edges.

        Raises
        ------
        ValueError
            Wrong shape, not finite, a turn of pi or more at a node, or out of the plane of a simulation
            that was built with planar=True.

        Examples
        --------
        >>> simulation.set_natural_curvature(arm, (0.0, 12.5), over=0.2)
        """
        part = self._session.directory.rod(rod)
        if validation.truth(discrete, "discrete"):
            values = curvature_array(curvature, part.voronoi, True, part.owner)
        else:
            values = curvature_given(curvature, len(part.voronoi), part.owner).reshape(-1, 2)
        self._session.world.set_natural_curvature(part.index, values, validation.non_negative(over, "over"))
        given = values if discrete else np.asarray(curvature)
        self._session.note("set_natural_curvature", part, {"natural_curvature": given}, float(over))

    def set_natural_twist(self, rod: Rod | str, twist: npt.ArrayLike, over: float = 0.0) -> None:
        """Actuate a rod by changing the twist at which it is free of stress.

        Parameters
        ----------
        rod : Rod or str
        twist : float or array_like of shape (stencils,) [rad/m]
        over : float [s]
            Reached after so long, evenly; at once by default.

        Raises
        ------
        ValueError
            Wrong shape, not finite, or not zero in a simulation that was built with planar=True.
        """
        part = self._session.directory.rod(rod)
        values = twist_array(twist, part.voronoi, part.owner)
        self._session.world.set_natural_twist(part.index, values, validation.non_negative(over, "over"))
        self._session.note("set_natural_twist", part, {"natural_twist": np.asarray(twist)}, float(over))

    def set_natural_stretch(self, rod: Rod | str, stretch: npt.ArrayLike, over: float = 0.0) -> None:
        """Actuate a rod by changing the length at which it is free of stress, as a muscle or a bellows does.

        The axial force is then n = EA (l / L - s), with s the natural stretch and L the drawn length of an edge: the
        reference strain of a Cosserat rod along its tangent [Antman 2005, chapter 8]. Mass and what resists bending and
        twisting stay those of the drawn lengths.

        Parameters
        ----------
        rod : Rod or str
        stretch : float or array_like of shape (edges,) [-]
            Natural length over drawn length: 1 as drawn, 0.9 for a muscle that shortens by a tenth.
        over : float [s]
            Reached after so long, evenly; at once by default.

        Raises
        ------
        ValueError
            Wrong shape, not finite, or not positive.

        Examples
        --------
        >>> simulation.set_natural_stretch(arm, 1.02, over=0.5)
        """
        part = self._session.directory.rod(rod)
        values = stretch_array(stretch, len(part.lengths), part.owner)
        self._session.world.set_natural_stretch(part.index, values, validation.non_negative(over, "over"))
        self._session.note("set_natural_stretch", part, {"natural_stretch": np.asarray(stretch)}, float(over))

    # Parameters

    def set(self, target: Settable | str | None = None, /, **values: Any) -> None:
        """Change parameters while the simulation runs.

        Parameters
        ----------
        target : handle or str
            None for what belongs to the whole scene; two bodies, such as `(arm, floor)`, for what is between them.
        **values
            Of a rod: youngs_modulus, poisson_ratio, density, viscosity, stretch_stiffness, bend_stiffness,
            twist_stiffness, line_density, viscous_time, drag (numbers, or one an edge), natural_curvature,
            natural_twist, natural_stretch (natural over drawn length; see `set_natural_stretch`). Of a load: force,
            moment, load or pressure, constant or a function of time. Of a mass: mass. Of a spring: stiffness,
            rest_length, damping. Of a tendon: tension. Of a revolute joint: stiffness, rest_angle, damping, moment, as
            `Scene.join` has them. Of a drag: drag. Of a fluid: viscosity, and the regularization [m] of Stokeslets. Of
            an obstacle: friction, as `Scene.add_floor` takes it, rolling_friction and restitution. Of two bodies:
            friction, as `Scene.set_friction` takes it. Of a support: position, rotation, as `move` takes them, and the
            friction of a ring. Of the scene: gravity, friction and restitution between rods, the slip_tolerance of
            friction, and the contact_stiffness [N/m], or None for one that follows the forces. See `set_restitution`
            and `set_contact_stiffness` for two bodies.

            Of a rod, youngs_modulus sets stretch_stiffness, bend_stiffness, twist_stiffness and viscous_time too,
            poisson_ratio twist_stiffness, density line_density, and viscosity viscous_time. Where one call has both,
            the latter are as given, in whatever order; a later call of the former makes them anew.

        Raises
        ------
        ValueError
            A word that the target does not have, or a value out of range; then nothing is changed.

        Examples
        --------
        >>> simulation.set(arm, youngs_modulus=2e6, natural_stretch=1.01)
        >>> simulation.set(tip_load, force=lambda t: (0, 0, -t))
        """
        set_values(self._session, target, values)

    def get(self, target: Settable | Support | str, word: str | None = None) -> Any:
        """The present value of what `set` sets.

        Parameters
        ----------
        target : handle or str
            Or "gravity", "friction" or "restitution" of rods with each other, "slip_tolerance", "contact_stiffness".
        word : str
            As in `set`; of an obstacle "position" and "turn" too, which `move` changes; of a rod its "radius".

        Returns
        -------
        float or ndarray
            Stiffnesses and what else belongs to edges one an edge, (edges,); natural curvature
            (stencils, 2) and twist (stencils,), natural stretch (edges,); loads (3,), or (edges, 3)
            where they were so put on; positions (3,) [m], rotations (3, 3) and turns (3,) [rad] from
            what was drawn. What belongs to a material as it was set.

        Raises
        ------
        ValueError
            A word that the target does not have.

        Examples
        --------
        >>> simulation.get(arm, "natural_curvature").shape
        (29, 2)
        """
        return get_value(self._session, target, word)

    # Loads and custom forces

    def remove(self, load: Load | str) -> None:
        """Take off a load that was put on while running; it acts no more from now on.

        Parameters
        ----------
        load : Load or str
            As `add_force`, `add_moment`, `add_load` or `add_pressure` of the simulation returned it.

        Raises
        ------
        ValueError
            A load that is not there any more, or one of the scene as it was drawn.

        Examples
        --------
        >>> wind = simulation.add_load(arm, (0.1, 0, 0))
        >>> simulation.remove(wind)
        """
        remove_load(self._session, load)

    def check_jacobian(self, force: CustomForce | str | None = None) -> None:
        """Compare the jacobian of a custom force with differences of its function, at the present state.

        Parameters
        ----------
        force : CustomForce or str
            By default all that have a jacobian, one after the other.

        Raises
        ------
        ValueError
            A jacobian that is wrong, with the entry that is farthest off; or none.
        """
        check_jacobian(self._session, force)
