"""What pulls, pushes and slows the rods of a scene, besides loads that a simulation may also take."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.directory import Directory
from withe.parts.fluid import make_fluid
from withe.parts.handles import CustomForce, Drag, Fluid, Mass, NodeHandle, Rod, Spring, Tendon
from withe.parts.kinds import CustomForcePart, DragPart, FluidModel, MassPart
from withe.parts.springs import make_spring
from withe.parts.tendons import Guides, make_tendon

__all__ = ["Loads"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
class Loads:
    """Masses, springs, tendons, drag, custom forces and the fluid: methods of `Scene` that need its parts alone."""

    _directory: Directory

    def add_mass(self, node: NodeHandle | str, mass: float, *, name: str | None = None) -> Mass:
        """Add a point mass [kg] to a node."""
        name = self._directory.new_name(name, "mass")
        place, node_name = self._directory.node(node, "node of the mass")
        part = MassPart(name, place, validation.non_negative(mass, f"mass at {node_name!r}"))
        return cast(Mass, self._directory.add(part))

    def add_spring(
        self,
        a: NodeHandle | str,
        b: NodeHandle | str,
        *,
        stiffness: float,
        rest_length: float | None = None,
        damping: float = 0.0,
        name: str | None = None,
    ) -> Spring:
        """Add a spring without mass, with a damper beside it (Kelvin and Voigt), between two nodes.

        At length l it pulls them together by stiffness (l - rest_length) + damping dl/dt, along the line between them,
        and stores stiffness (l - rest_length)^2 / 2, which is `energy().spring`. Nothing touches it.

        Parameters
        ----------
        a, b : NodeHandle or str
            Of one rod or of two; held or free. To a place in the room: of a rod that is pinned there.
        stiffness : float [N/m]
        rest_length : float [m]
            By default the distance as drawn. With 0 the force is proportional to that between the nodes.
        damping : float [N s/m]
        name : str

        Returns
        -------
        Spring
            `Simulation.set` changes stiffness, rest_length and damping; `Simulation.spring_tension` is its force.

        Raises
        ------
        ValueError
            One and the same node, a number that is negative or not finite, or a rest_length above zero between nodes
            that coincide.

        Examples
        --------
        A stay from the middle of the arm to a post:

        >>> stiff = withe.Stiffness(stretch=100.0, bend=1e-3, twist=1e-3)
        >>> post = scene.add_rod(points=[(0, 0, 0.1), (0, 0, 0.2)], radius=0.01, stiffness=stiff, line_density=1)
        >>> scene.add_spring(arm.node(15), post.start, stiffness=100.0, name="stay")
        Spring(name='stay')
        """
        return cast(
            Spring, self._directory.add(make_spring(self._directory, a, b, stiffness, rest_length, damping, name))
        )

    def add_tendon(
        self,
        guides: Guides,
        *,
        offset: npt.ArrayLike,
        tension: float = 0.0,
        name: str | None = None,
    ) -> Tendon:
        """Add a tendon that runs through guides on rods, without friction and without mass.

        Its guides sit at their own offsets from the centreline, along the material directors of an edge, and turn with
        it; at the end of a rod that is clamped, or rigid with a joint, with what holds it. From one guide to the next
        the tendon runs straight; at the first and the last it is fixed. It pulls with the same tension T all along, so
        that its forces are minus the gradient of T times its length [Rucker and Webster 2011, IEEE Trans. Robot. 27]:
        straight beside a slender rod, at the offset h, it bends that with the moment T h. What it pulls at is the rods
        alone: forces and moments of a whole tendon are in balance, as are those of a motor that sits at the base.
        Nothing touches it, and it is never slack.

        Parameters
        ----------
        guides : Rod, str, or iterable of EdgeHandle, NodeHandle or str
            Of a rod: from its start through the middle of every edge to its end. Else edges, in the middle of each,
            and ends of rods, in the order in which the tendon runs through them: disks of a robot, say.
        offset : array_like of shape (2,) or (guides, 2) [m]
            Of all guides, or of each, along d1 and d2.
        tension : float [N]
        name : str

        Returns
        -------
        Tendon
            `Simulation.set` changes its tension; `Simulation.tendon_length` and `tendon_points` read it. What it does
            is in `energy().loads`, as the work of loads is.

        Raises
        ------
        ValueError
            Fewer than two guides, two in a row at one point, an inner node, a number that is not finite, or a tension
            below zero.

        Examples
        --------
        A tendon 6 mm beside the centreline, and one through four disks:

        >>> tendon = scene.add_tendon(arm, offset=(6e-3, 0), tension=0.0, name="tendon")
        >>> disks = [arm.start, arm.edge(9), arm.edge(19), arm.end]
        >>> scene.add_tendon(disks, offset=(0, 6e-3), name="other")
        Tendon(name='other')
        >>> simulation = scene.build()
        >>> simulation.set(tendon, tension=0.01)
        """
        return cast(Tendon, self._directory.add(make_tendon(self._directory, guides, offset, tension, name)))

    def add_drag(self, coefficient: float, *, rods: Iterable[Rod | str] | None = None, name: str | None = None) -> Drag:
        """Add viscous drag: a force per length against the velocity. Drags on one rod add up.

        Parameters
        ----------
        coefficient : float [Pa s]
        rods : iterable of Rod or str
            By default every rod, those added later included.
        name : str

        Returns
        -------
        Drag
        """
        name = self._directory.new_name(name, "drag")
        coefficient = validation.non_negative(coefficient, "drag coefficient")
        indices = None
        if rods is not None:
            if isinstance(rods, str) or not isinstance(rods, Iterable):
                raise ValueError(f"rods of the drag must be a list of rods, got {rods!r:.80}")
            indices = tuple(dict.fromkeys(self._directory.rod(rod, "rod of the drag").index for rod in rods))
        return cast(Drag, self._directory.add(DragPart(name, coefficient, indices)))

    def add_custom_force(
        self,
        function: Callable[[float, FloatArray, FloatArray], Any],
        *,
        jacobian: Callable[[float, FloatArray, FloatArray], Any] | None = None,
        moments: bool = False,
        name: str | None = None,
    ) -> CustomForce:
        """Add forces that a function computes: springs, magnets, buoyancy.

        Without `jacobian` they are found once a step, where the scheme's own forces act, for positions and velocities
        extrapolated to then: to the middle of an implicit midpoint or energy-momentum step (second order;
        an oscillation of angular frequency w, in radians a second, keeps its amplitude for w time_step < 2;
        where neighbours go to and fro, edges carry a third of their mass, and w^2 is up to three times the
        spring constant over the mass at a node), to the end of a backward Euler step, and at the end that
        a Verlet step reaches.

        With `jacobian` they are solved for with everything else, at every iterate of an implicit step: second order
        too, and stable at any time step. One force of a scene that has a jacobian is enough for all of them to be asked
        for so often. Verlet steps have no use for it.

        Equilibria balance them exactly: where there is no jacobian it is found by differences, which takes six calls a
        node for every matrix. Such forces need not have a potential, so what is in balance is not always stable; see
        `Equilibrium.stability`.

        Parameters
        ----------
        function : callable
            ``function(time, positions, velocities)`` returns the force on every node of the scene,
            shape (nodes, 3) [N]; time [s], positions [m] and velocities [m/s] are those at which the force
            shall act. It may be asked for states that no step ends in, and must give the same for the same.
        jacobian : callable
            ``jacobian(time, positions, velocities)`` returns the derivative of forces by positions, a SciPy sparse
            matrix or an array of shape (3 nodes, 3 nodes) [N/m], both in the order x, y, z of the first node, then of
            the second; or a pair of that and the derivative by velocities [N s/m]. `Simulation.check_jacobian`
            compares it with differences.
        moments : bool
            Whether the function returns a pair (forces, moments), moments of shape (nodes, 3) [N m] in world axes, as
            those of `add_moment`: each acts on the joint or clamp at its node, or else in equal parts on the edges
            there. The jacobian may then have 6 nodes rows, forces first.
        name : str

        Returns
        -------
        CustomForce

        Examples
        --------
        >>> import numpy as np
        >>> import withe
        >>> from scipy import sparse
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> rod = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=3, radius=5e-3, material=rubber)
        >>> stiff = 1000.0  # N/m, at every node
        >>> springs = scene.add_custom_force(lambda t, x, v: -stiff * (x - [(0, 0, 0), (0.05, 0, 0), (0.1, 0, 0)]),
        ...                                  jacobian=lambda t, x, v: -stiff * sparse.identity(9))
        >>> simulation = scene.build(integrator="static")
        >>> simulation.check_jacobian(springs)
        >>> _ = simulation.equilibrium()
        >>> weight = 9.81 * 1000 * np.pi * 5e-3**2 * 0.1
        >>> bool(abs(simulation.positions(rod)[:, 2].sum() + weight / stiff) < 1e-9)
        True
        """
        name = self._directory.new_name(name, "custom force")
        validation.function(function, "custom force")
        if jacobian is not None:
            validation.function(jacobian, f"jacobian of {name!r}")
        part = CustomForcePart(name, function, jacobian, validation.truth(moments, "moments"))
        return cast(CustomForce, self._directory.add(part))

    def add_fluid(
        self,
        viscosity: float,
        *,
        model: FluidModel = "stokeslets",
        regularization: float | None = None,
        wavelength: float | None = None,
        name: str | None = None,
    ) -> Fluid:
        """Surround all rods by a viscous fluid without inertia, at rest far away (Stokes flow).

        It neither carries (for buoyancy, change `gravity`) nor resists spin about a rod's tangent. What rods lose to it
        is in `energy().dissipated`.

        Parameters
        ----------
        viscosity : float [Pa s]
        model : {"stokeslets", "resistive"}
            With "stokeslets" every piece of a rod moves the fluid at all others: regularized Stokeslet segments
            [Cortez 2018, J. Comput. Phys. 375], whose dense equations are solved once a step, for velocities as
            they are then; what these change within the step meets a local drag, so steps stay stable. The work of a
            step grows with the square of the number of nodes. With "resistive" each piece is resisted as if alone,
            -mu (c_t v_t + c_n v_n) per length, exactly and implicitly; rods do not feel each other.
        regularization : float [m]
            Of "stokeslets" (not used by the other): the length over which a point force is spread. By default sqrt(e)
            = 1.65 times the radius, for which a thin rod has the resistance that slender-body theory gives to a
            cylinder; then the radius must be the same all over the scene. Edges of a third of it or more are needed.
        wavelength : float [m]
            Of "resistive" (not used by the other): of waves along the rods, such as the length of one turn of a helix,
            for c_t = 2 pi / ln(.18 wavelength / radius), c_n = 4 pi / (ln(.18 wavelength / radius) + 1/2)
            [Lighthill 1976]. By default rods are taken as straight, those that are joined in a row as one of their
            whole length: c_t = 2 pi / (ln(length / radius) - 1/2), c_n = 4 pi / (ln(length / radius) + 1/2), as of
            spheroids [Happel and Brenner 1965].
        name : str

        Returns
        -------
        Fluid
            `Simulation.set` changes its viscosity.

        Raises
        ------
        ValueError
            A second fluid, a number out of range, or an unknown model.

        Examples
        --------
        >>> glycerol = scene.add_fluid(viscosity=1.4, regularization=1e-3)
        """
        part = make_fluid(self._directory, viscosity, model, regularization, wavelength, name)
        return cast(Fluid, self._directory.add(part))
