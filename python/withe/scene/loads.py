"""Masses, springs, tendons, drag, custom forces and fluids of a scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.directory import Directory
from withe.parts.fluid import make_fluid
from withe.parts.handles import CustomForce, Drag, EdgeHandle, Fluid, Mass, NodeHandle, Rod, Spring, Tendon
from withe.parts.kinds import CustomForcePart, DragPart, FluidModel, MassPart, RodPart
from withe.parts.springs import make_spring
from withe.parts.tendons import Guides, make_tendon
from withe.parts.torsion_springs import TorsionSpring, make_torsion_spring

__all__ = ["Loads"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
class Loads:
    """Masses, springs, tendons, drag, custom forces and the fluid: methods of `Scene` that need its parts alone."""

    _directory: Directory

    def add_mass(self, node: NodeHandle | str, mass: float, *, name: str | None = None) -> Mass:
        """Add a point mass to a node.

        Parameters
        ----------
        node : NodeHandle or str
            Node that carries the mass.
        mass : float [kg]
            The mass, zero or more.
        name : str
            Name of the mass. By default "mass 1", ...

        Returns
        -------
        Mass

        Raises
        ------
        ValueError
            Not a node of this scene, or a mass that is negative or not finite.

        See Also
        --------
        Simulation.set : Change the mass.
        """
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
        """Add a spring with a parallel damper (Kelvin-Voigt) between two nodes.

        At length l the tension is stiffness (l - rest_length) + damping dl/dt, along the line between the nodes. The
        energy stiffness (l - rest_length)^2 / 2 is part of `energy().spring`. A spring has no mass and no contact.

        Parameters
        ----------
        a, b : NodeHandle or str
            Nodes of one rod or of two rods, supported or free, or points of rigid bodies. For a fixed point, use a node
            of a pinned rod.
        stiffness : float [N/m]
            Stiffness of the spring.
        rest_length : float [m]
            Length without tension. By default the drawn distance of the nodes. With 0 the tension is proportional to
            the distance.
        damping : float [N s/m]
            Damping coefficient.
        name : str
            Name of the spring. By default "spring 1", ...

        Returns
        -------
        Spring
            `Simulation.set` changes stiffness, rest_length and damping; `Simulation.spring_tension` returns the
            tension.

        Raises
        ------
        ValueError
            A node given twice, a number that is negative or not finite, or a positive rest_length between nodes that
            coincide.

        See Also
        --------
        add_torsion_spring : Add a spring between the directions of two edges.
        Simulation.spring_tension : Force of a spring.

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

    def add_torsion_spring(
        self,
        a: EdgeHandle | str,
        b: EdgeHandle | str,
        *,
        stiffness: float,
        rest_angle: float = 0.0,
        axis: npt.ArrayLike | None = None,
        name: str | None = None,
    ) -> TorsionSpring:
        """Add a torsion spring without mass between two edges, of one rod or of two.

        The angle phi is the rotation of edge b against edge a since both were drawn, about an axis that edge a carries.
        The spring stores the energy stiffness (phi - rest_angle)^2 / 2, part of `energy().spring`, and applies opposite
        moments to both edges. It does not constrain their positions or rotations about other axes.

        Parameters
        ----------
        a, b : EdgeHandle or str
        stiffness : float [N m/rad]
        rest_angle : float [rad]
            Angle at which the spring is free of stress. The angle as drawn is 0.
        axis : array_like of shape (3,), optional
            Axis as drawn, in the axes of the scene; phi is positive by the right-hand rule. By default, the cross
            product of the tangents of a and b.
        name : str

        Returns
        -------
        TorsionSpring
            `Simulation.set` changes stiffness and rest_angle; ``simulation.get(spring, "angle")`` returns phi [rad].

        Raises
        ------
        ValueError
            If `a` and `b` are the same edge, if both lie along one line and `axis` is not given, or if a number is out
            of range.

        See Also
        --------
        add_spring : Add a spring between two nodes.
        join : Join rods by a revolute joint with a spring.

        Notes
        -----
        Edge a carries the axis, a unit vector u normal to the axis, and v = axis x u. Edge b carries a unit vector w.
        As drawn, w = u. Then phi = atan2(w . v, w . u), the angle of w in the plane normal to the axis. Where the edges
        rotate about the axis alone, phi is the angle of a revolute joint. The deviation phi - rest_angle is taken from
        -pi to pi, so the spring does not count full turns. phi is not defined where w is parallel to the axis. A planar
        simulation needs an axis normal to its plane. An angle is that of the middle of an edge, so results of flexible
        rods converge at first order in the length of the two edges.

        The force is exact in the sense of the energy-momentum method: its work over a step is the change of the stored
        energy [Gonzalez 1996, J. Nonlinear Sci. 6].

        Examples
        --------
        >>> stiff = withe.Stiffness(stretch=100.0, bend=1e-3, twist=1e-3)
        >>> lid = scene.add_rod(points=[(0, 0, 0.1), (0.1, 0, 0.1)], radius=0.01, stiffness=stiff, line_density=1)
        >>> scene.add_torsion_spring(arm.edge(0), lid.edge(0), axis=(0, 1, 0), stiffness=0.1, name="hinge")
        TorsionSpring(name='hinge')
        """
        directory, rods = self._directory, self._directory.all(RodPart)
        name = directory.new_name(name, "torsion spring")
        (rod, edge), (other, other_edge) = (
            directory.edge(each, f"{which} edge of torsion spring {name!r}")
            for each, which in ((a, "first"), (b, "second"))
        )
        part = make_torsion_spring(name, (rods[rod], edge), (rods[other], other_edge), axis, stiffness, rest_angle)
        return cast(TorsionSpring, directory.add(part))

    def add_tendon(
        self,
        guides: Guides,
        *,
        offset: npt.ArrayLike | None = None,
        tension: float = 0.0,
        name: str | None = None,
    ) -> Tendon:
        """Add a tendon that runs through guides on rods and rigid bodies, without friction and mass.

        Each guide sits at an offset from the centreline, along the material directors of an edge, and turns with the
        edge. At the end of a rod that is clamped or rigidly joined, a guide turns with the support or joint. The tendon
        is straight between guides, and fixed at the first and the last guide. Its tension T is constant along its
        length, so its forces are minus the gradient of T times its length [Rucker and Webster 2011, IEEE Trans. Robot.
        27]: a tendon beside a slender rod, at the offset h, bends the rod with the moment T h. The forces and moments
        of a tendon on its rods are in balance. A tendon has no contact and is never slack.

        Parameters
        ----------
        guides : Rod, str, or iterable of EdgeHandle, NodeHandle or str
            A rod, for guides at its start, in the middle of every edge, and at its end. Or edges (guides in their
            middle), ends of rods and points of rigid bodies, such as ``hand.at((0, 0, 0.1))``, in the order of the
            tendon.
        offset : array_like of shape (2,) or (guides, 2) [m]
            Offset of all guides on rods, or of each guide, along d1 and d2. A guide on a body has none.
        tension : float [N]
            Tension, not negative.
        name : str
            Name of the tendon. By default "tendon 1", ...

        Returns
        -------
        Tendon
            `Simulation.set` changes the tension; `Simulation.tendon_length` and `tendon_points` return the geometry.
            The work of the tension is part of `energy().loads`.

        Raises
        ------
        ValueError
            Fewer than two guides, two consecutive guides at one point, an inner node, or a body without a point. An
            offset of a guide on a body, or none for a guide on a rod. A number that is not finite, or a negative
            tension.

        See Also
        --------
        Simulation.tendon_length : Length of a tendon.
        Simulation.set : Change the tension.

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
        """Add viscous drag, which is a force per length against the velocity. Several drags on one rod add up.

        Parameters
        ----------
        coefficient : float [Pa s]
            Force per length and velocity.
        rods : iterable of Rod or str
            Rods with this drag. By default every rod, also rods that are added later.
        name : str
            Name of the drag. By default "drag 1", ...

        Returns
        -------
        Drag

        Raises
        ------
        ValueError
            A coefficient that is negative or not finite, or rods that are not rods of this scene.

        See Also
        --------
        add_fluid : Drag of a viscous fluid, from its viscosity.
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
        """Add forces that a Python function computes, for example magnets or buoyancy.

        Without `jacobian`, the function is called once per step, with extrapolated positions and velocities. With
        `jacobian`, the forces are implicit and stable at any time step: the function is called in every iteration.

        Parameters
        ----------
        function : callable
            ``function(time, positions, velocities)`` returns the force on every node of the scene, shape (nodes, 3)
            [N], at a time [s], for positions [m] and velocities [m/s] of shape (nodes, 3). The function must be
            deterministic; it is also called for states that no step ends in.
        jacobian : callable
            ``jacobian(time, positions, velocities)`` returns the derivative of the forces by positions. The derivative
            is a SciPy sparse matrix or an array of shape (3 nodes, 3 nodes) [N/m], in the order x, y, z of the first
            node, then of the second. The function may also return a pair with the derivative by velocities [N s/m].
            `Simulation.check_jacobian` compares the jacobian with finite differences.
        moments : bool
            True if the function returns a pair (forces, moments), with moments of shape (nodes, 3) [N m] in world axes.
            Each moment acts on the joint or clamp at its node, or in equal parts on the edges there. The jacobian may
            then have 6 nodes rows, forces first.
        name : str
            Name of the force. By default "custom force 1", ...

        Returns
        -------
        CustomForce

        Raises
        ------
        ValueError
            A function or jacobian that cannot be called.

        See Also
        --------
        Simulation.check_jacobian : Compare the jacobian with finite differences.

        Notes
        -----
        Without `jacobian`, positions and velocities are extrapolated to the middle of an implicit midpoint or
        energy-momentum step, and to the end of a backward Euler or Verlet step. The method is then of second order, and
        an oscillation of angular frequency w keeps its amplitude for w time_step < 2. For modes in which neighbouring
        nodes move against each other, w^2 is up to three times the stiffness over the mass at a node. If one force of a
        scene has a jacobian, all custom forces are implicit. Verlet steps do not use the jacobian.

        Equilibria balance custom forces exactly. Without `jacobian`, the derivative is found by finite differences with
        six calls per node. Custom forces need not have a potential, so an equilibrium may be unstable; see
        `Equilibrium.stability`.

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

        The fluid has no buoyancy (change `gravity` for this), and does not resist spin about the tangent of a rod. The
        energy that it removes is part of `energy().dissipated`.

        Parameters
        ----------
        viscosity : float [Pa s]
            Dynamic viscosity mu.
        model : {"stokeslets", "resistive"}
            * "stokeslets": regularized Stokeslet segments [Cortez 2018, J. Comput. Phys. 375], by which rods move each
              other. The dense equations are solved once per step, and an implicit local drag keeps the step stable. The
              cost grows with the square of the number of nodes.
            * "resistive": resistive-force theory, with the force -mu (c_t v_t + c_n v_n) per length, exact and
              implicit. Rods do not interact through the fluid.
        regularization : float [m]
            Length over which a Stokeslet is spread, for "stokeslets" only. By default sqrt(e) = 1.65 times the radius,
            for which a thin rod has the resistance of a cylinder in slender-body theory; all radii must then be equal.
            Edges must be at least a third of this length.
        wavelength : float [m]
            Wavelength of the rods, such as the length of one turn of a helix, for "resistive" only:
            c_t = 2 pi / ln(0.18 wavelength / radius), c_n = 4 pi / (ln(0.18 wavelength / radius) + 1/2)
            [Lighthill 1976]. By default rods count as straight, and rods joined in a row as one rod:
            c_t = 2 pi / (ln(length / radius) - 1/2), c_n = 4 pi / (ln(length / radius) + 1/2), as of spheroids
            [Happel and Brenner 1965].
        name : str
            Name of the fluid. By default "fluid 1".

        Returns
        -------
        Fluid
            `Simulation.set` changes the viscosity.

        Raises
        ------
        ValueError
            A second fluid, a number out of range, or an unknown model.

        See Also
        --------
        add_drag : Drag by coefficients.

        Examples
        --------
        >>> glycerol = scene.add_fluid(viscosity=1.4, regularization=1e-3)
        """
        part = make_fluid(self._directory, viscosity, model, regularization, wavelength, name)
        return cast(Fluid, self._directory.add(part))
