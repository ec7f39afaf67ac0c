"""Measurements: read-outs of a simulation at any moment, as copies."""

from __future__ import annotations

from typing import overload

import numpy as np
import numpy.typing as npt

from withe.knots import link
from withe.parts.contacts import contact_table
from withe.parts.handles import Hand, Joint, NodeHandle, Obstacle, Rod, Spring, Support, Tendon
from withe.parts.kinds import ObstaclePart, RodPart, SpringPart, TendonPart
from withe.simulation.hands import (
    Deflection,
    HeldPose,
    Passage,
    hand_deflection,
    hand_wrench,
    ring_passage,
    support_pose,
)
from withe.simulation.joints import find_joint
from withe.simulation.readouts import Energy, Momentum, Plan, Reaction, RodEnergy, Statistics
from withe.simulation.session import Session
from withe.simulation.springs import spring_tension
from withe.simulation.supports import find_support
from withe.simulation.tendons import tendon_length, tendon_points

__all__ = ["Measurements"]

FloatArray = npt.NDArray[np.float64]


class Measurements:
    """Methods of `Simulation` that read shapes, motions, forces and energies."""

    _session: Session

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Return the handles of all rods, in the order of the scene."""
        return self._session.directory.rods

    def positions(self, rod: Rod | str | None = None) -> FloatArray:
        """Return the positions of the nodes of a rod, or of all nodes of the scene.

        Returns
        -------
        ndarray of shape (nodes, 3) [m]
            Without a rod, every node of the scene once; `rod.rows` are the rows of a rod.

        Raises
        ------
        ValueError
            Not a rod of this scene.
        """
        positions = self._session.world.positions()
        return (
            positions
            if rod is None
            else positions[self._session.directory.layout.rows(self._session.directory.rod(rod).index)]
        )

    def obstacle_position(self, obstacle: Obstacle | str) -> FloatArray:
        """Return the position of an obstacle, shape (3,) [m].

        This is the point of a plane, the centre of a sphere, or the start of a capsule.

        Raises
        ------
        ValueError
            Not an obstacle of this scene.
        """
        part = self._session.directory.find(obstacle, ObstaclePart, "obstacle")
        return np.array(self._session.world.obstacle_position(self._session.directory.all(ObstaclePart).index(part)))

    def velocities(self, rod: Rod | str | None = None) -> FloatArray:
        """Return the velocities of the nodes of a rod, or of all nodes of the scene, shape (nodes, 3) [m/s]."""
        velocities = self._session.world.velocities()
        return (
            velocities
            if rod is None
            else velocities[self._session.directory.layout.rows(self._session.directory.rod(rod).index)]
        )

    def directors(self, rod: Rod | str) -> FloatArray:
        """Return the material frames of the edges, shape (edges, 3, 3), with rows d1, d2, tangent."""
        return self._session.world.directors(self._session.directory.rod(rod).index).reshape(-1, 3, 3)

    def curvatures(self, rod: Rod | str) -> FloatArray:
        """Return the curvatures towards d1 and d2, shape (stencils, 2) [1/m]."""
        return self._session.world.curvatures(self._session.directory.rod(rod).index)

    def twists(self, rod: Rod | str) -> FloatArray:
        """Return the twists per length, shape (stencils,) [rad/m]."""
        return self._session.world.twists(self._session.directory.rod(rod).index)

    def tensions(self, rod: Rod | str) -> FloatArray:
        """Return the tension of each edge, positive in tension, shape (edges,) [N].

        After an implicit midpoint step, the tension is the one in the middle of the step, where the forces balance. An
        edge that turns by w in a step ends with the spurious strain w^2 / 8. After other steps the tension is the one
        of the state.
        """
        return self._session.world.tensions(self._session.directory.rod(rod).index)

    def spring_tension(self, spring: Spring | str) -> float:
        """Return the force of a spring and its damper, positive in tension [N].

        Raises
        ------
        ValueError
            Not a spring of this scene.
        """
        return spring_tension(self._session, self._session.directory.find(spring, SpringPart, "spring"))

    def tendon_length(self, tendon: Tendon | str) -> float:
        """Return the length of a tendon from its first guide to its last [m].

        The forces of a tendon are minus the gradient of its tension times this length. At a free end, the last half
        edge of length l / 2 counts as bent by the tension T at the offset r, which adds T r^2 l / (2 EI).

        Raises
        ------
        ValueError
            Not a tendon of this scene.
        """
        return tendon_length(self._session, self._session.directory.find(tendon, TendonPart, "tendon"))

    def tendon_points(self, tendon: Tendon | str) -> FloatArray:
        """Return the positions of the guides of a tendon, shape (guides, 3) [m].

        Raises
        ------
        ValueError
            Not a tendon of this scene.
        """
        return tendon_points(self._session, self._session.directory.find(tendon, TendonPart, "tendon"))

    def joint_angle(self, joint: Joint | str) -> float:
        """Return the angle of a revolute joint since the drawing [rad].

        The angle is the rotation of the second rod relative to the first, by the right-hand rule, whole turns included.

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._session.world.joint_angle(find_joint(self._session, joint))

    def joint_rate(self, joint: Joint | str) -> float:
        """Return the rate of `joint_angle` [rad/s].

        The rate is the mean over the last step; with "fourth_order", over its last inner step. Before the first step,
        and after a state was set, the rate follows from the velocities of the edges at the joint.

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._session.world.joint_rate(find_joint(self._session, joint))

    def joint_torque(self, joint: Joint | str) -> float:
        """Return the torque of motor, spring and damper on the second rod of a revolute joint [N m]. See `Scene.join`.

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._session.world.joint_torque(find_joint(self._session, joint))

    def spins(self, rod: Rod | str) -> FloatArray:
        """Return the angular velocities of the edges about their tangents, shape (edges,) [rad/s]."""
        return self._session.world.spins(self._session.directory.rod(rod).index)

    @overload
    def energy(self) -> Energy: ...

    @overload
    def energy(self, rod: Rod | str) -> RodEnergy: ...

    def energy(self, rod: Rod | str | None = None) -> Energy | RodEnergy:
        """Return the energies of the scene, or of one rod [J].

        Parameters
        ----------
        rod : Rod or str, optional
            Rod whose energies are returned.

        Returns
        -------
        Energy or RodEnergy
            Energies of the scene without a rod, or of the rod. Loads, contact, work and dissipation belong to the scene
            only.
        """
        if rod is not None:
            part = self._session.world.rod_energy(self._session.directory.rod(rod).index)
            return RodEnergy(**{name: getattr(part, name) for name in RodEnergy.__dataclass_fields__})
        energy = self._session.world.energy()
        return Energy(**{name: getattr(energy, name) for name in Energy.__dataclass_fields__})

    def momentum(self) -> Momentum:
        """Return the linear momentum of the scene, and its angular momentum about the origin.

        The masses are the ones of the equations of motion, supported nodes included. The angular momentum is the sum of
        x cross (M v) over nodes, with the mass matrix M, and of I omega t over edges, with spin omega about the
        tangent t. The angular momentum of joint frames is added.

        Returns
        -------
        Momentum

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene(gravity=(0, 0, 0))
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> baton = scene.add_rod(start=(-0.1, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=rubber)
        >>> simulation = scene.build()
        >>> simulation.set_velocities(baton, [(0, 20 * x, 0) for x, _, _ in simulation.positions(baton)])
        >>> print(f"{simulation.momentum().angular[2]:.6f} kg m^2/s")  # m L^2 / 12 times 20 rad/s
        0.001047 kg m^2/s
        """
        momentum = self._session.world.momentum()
        return Momentum(np.array(momentum.linear), np.array(momentum.angular))

    def reaction(self, support: Support | NodeHandle | str) -> Reaction:
        """Return the force and moment of a support on its rod.

        During motion these are means over the last time step, inner steps included: together with all other forces they
        account for the change of momentum. The moment is about the node.

        Parameters
        ----------
        support : Support, NodeHandle or str
            The support, or its node.

        Raises
        ------
        ValueError
            The node has no support.

        Notes
        -----
        Force times displacement plus moment times rotation of a step without subdivision is the work in
        ``energy().work``, to second order in the time step. A support that starts or stops at full speed applies an
        impulse, which is part of the force of this step. Its work is the impulse times the mean of both velocities,
        half of the force times the displacement.
        """
        index, _ = find_support(self._session, support)
        reaction = self._session.world.reaction(index)
        return Reaction(np.array(reaction.force), np.array(reaction.moment))

    def wrench(self, hand: Hand | str, about: npt.ArrayLike | None = None) -> Reaction:
        """Return the total force and moment of a hand on its rod.

        During motion these are means over the last time step, inner steps included: together with all other forces they
        account for the change of linear and angular momentum.

        Parameters
        ----------
        hand : Hand or str
            The hand.
        about : array_like of shape (3,) [m]
            Point about which the moment is taken. By default the position of the hand.

        Raises
        ------
        ValueError
            Not a hand, or a released one.
        """
        return hand_wrench(self._session, hand, about)

    def deflection(self, hand: Hand | str) -> Deflection:
        """Return the displacement of the held part of the rod relative to the hand. Zero for a rigid hand.

        Raises
        ------
        ValueError
            Not a hand, or a released one.
        """
        return hand_deflection(self._session, hand)

    def passage(self, ring: Hand | str) -> Passage:
        """Return the place where a rod passes a ring, and the forces of the ring on the rod.

        Raises
        ------
        ValueError
            Not a ring, or one that was released or left by its rod.

        Examples
        --------
        >>> ring = simulation.grasp(arm, at=0.2, slides=True, friction=0.3)
        >>> round(simulation.passage(ring).at, 9)
        0.2
        """
        return ring_passage(self._session, ring)

    def pose(self, support: Support | NodeHandle | str) -> HeldPose:
        """Return the present position and rotation of a support or hand.

        For a support with `free`, the position is the one from which its node slides.

        Raises
        ------
        ValueError
            The node has no support.
        """
        return support_pose(self._session, support)

    def contacts(self) -> npt.NDArray[np.void]:
        """Return the present contacts, as of the end of the last step.

        Returns
        -------
        structured ndarray, one row per contact
            * "pair", "edge": names of the two bodies, and their edges (-1 for an obstacle)
            * "distance", "gap": distance of the centrelines and of the surfaces [m]
            * "point": point between the surfaces [m]
            * "normal": unit vector from the second body to the first
            * "normal_force", "friction": forces on the first body [N]
            * "sticking": True if the contact does not slip
        """
        return contact_table(self._session.directory, self._session.world.contacts())

    def link(self, rod: Rod | str) -> float:
        """Return the link of a rod, which is the sum of its twist and writhe [turns].

        The link of a closed rod is constant as long as no rod passes through it; so is the link of an open rod whose
        ends are held and do not spin [Calugareanu 1961]. An open rod is extended straight at both ends.

        Returns
        -------
        float
        """
        index = self._session.directory.rod(rod).index
        closed = self._session.directory.layout.rods[index].closed
        return link(self.positions(rod), self.directors(rod), closed)

    @property
    def statistics(self) -> Statistics:
        """Return counts and times of the work so far."""
        statistics = self._session.world.statistics
        return Statistics(**{name: getattr(statistics, name) for name in Statistics.__dataclass_fields__})

    @property
    def plan(self) -> Plan:
        """Return the decisions of `build` for this scene, to be printed."""
        plan, parts = self._session.world.plan, self._session.directory.all(RodPart)
        length = sum(float(part.arcs.sum()) for part in parts)
        rods = zip(parts, self._session.settings.rods, strict=True)
        mass = sum(float(np.sum(numbers.line_density * part.arcs)) for part, numbers in rods)
        mass += sum(self._session.settings.masses.values())
        return Plan(
            planar=plan.planar,
            plane_normal=np.array(plan.plane_normal) if plan.planar else None,
            unknowns=plan.unknowns,
            solver=plan.solver,
            stable_step=plan.stable_step or None,
            notes=(f"{length:.4g} m of rod, {mass:.4g} kg in all", *plan.notes),
        )
