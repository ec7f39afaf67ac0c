"""Measurements: read-outs of a simulation at any moment, as copies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast, overload

import numpy as np
import numpy.typing as npt

from withe.knots import link
from withe.parts.contacts import contact_table
from withe.parts.handles import Body, Hand, Joint, NodeHandle, Obstacle, Rod, Spring, Support, Tendon
from withe.parts.kinds import ObstaclePart, RodPart, SpringPart, TendonPart
from withe.parts.supports import free_rods
from withe.simulation.bodies import body_position, body_rotation, body_spin, body_velocity
from withe.simulation.hands import (
    Deflection,
    HeldPose,
    Passage,
    hand_deflection,
    hand_wrench,
    ring_passage,
    support_pose,
)
from withe.simulation.joints import find_joint, is_joint, joint_reaction
from withe.simulation.readouts import Energy, Momentum, Plan, Reaction, RodEnergy, Statistics
from withe.simulation.session import Session
from withe.simulation.springs import spring_tension
from withe.simulation.supports import find_support
from withe.simulation.tendons import tendon_length, tendon_points

__all__ = ["Measurements"]

FloatArray = npt.NDArray[np.float64]
_LISTED = 5  # names of rods in a note of a plan


class Measurements:
    """Methods of `Simulation` that read shapes, motions, forces and energies."""

    _session: Session

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Return the handles of all rods, in the order of the scene."""
        return self._session.directory.rods

    def position(self, body: Body | str) -> FloatArray:
        """Return the position of the origin of a rigid body's axes.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (3,) [m]

        Raises
        ------
        ValueError
            No body of this scene.

        See Also
        --------
        rotation : Orientation of a body.
        positions : Positions of the nodes of rods.
        """
        return body_position(self._session, body)

    def rotation(self, body: Body | str) -> FloatArray:
        """Return the orientation of a rigid body: its axes as the columns of a matrix.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (3, 3)

        Raises
        ------
        ValueError
            No body of this scene.

        See Also
        --------
        position : Position of a body.
        angular_velocity : Angular velocity of a body.
        """
        return body_rotation(self._session, body)

    def velocity(self, body: Body | str) -> FloatArray:
        """Return the velocity of the origin of a rigid body's axes.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (3,) [m/s]

        Raises
        ------
        ValueError
            No body of this scene.

        See Also
        --------
        set_velocity : Set the motion of a body.
        """
        return body_velocity(self._session, body)

    def angular_velocity(self, body: Body | str) -> FloatArray:
        """Return the angular velocity of a rigid body, in the axes of the world.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (3,) [rad/s]

        Raises
        ------
        ValueError
            No body of this scene.

        See Also
        --------
        set_velocity : Set the motion of a body.
        """
        return body_spin(self._session, body)

    def positions(self, rod: Rod | str | None = None) -> FloatArray:
        """Return the positions of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (nodes, 3) [m]
            Without a rod, every node of the scene once; `rod.rows` are the rows of a rod.

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        velocities : Velocities of the same nodes.
        directors : Material frames of the edges.
        Record.positions : Positions at every frame of a run.
        """
        positions = self._session.world.positions()
        return (
            positions
            if rod is None
            else positions[self._session.directory.layout.rows(self._session.directory.rod(rod).index)]
        )

    def obstacle_position(self, obstacle: Obstacle | str) -> FloatArray:
        """Return the position of an obstacle.

        This is the point of a plane, the centre of a sphere, or the start of a capsule.

        Parameters
        ----------
        obstacle : Obstacle or str
            Obstacle to read.

        Returns
        -------
        ndarray of shape (3,) [m]

        Raises
        ------
        ValueError
            Not an obstacle of this scene.

        See Also
        --------
        move : Move an obstacle.
        """
        part = self._session.directory.find(obstacle, ObstaclePart, "obstacle")
        return np.array(self._session.world.obstacle_position(self._session.directory.all(ObstaclePart).index(part)))

    def velocities(self, rod: Rod | str | None = None) -> FloatArray:
        """Return the velocities of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default every node of the scene.

        Returns
        -------
        ndarray of shape (nodes, 3) [m/s]

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        positions : Positions of the same nodes.
        set_velocities : Set the velocities.
        """
        velocities = self._session.world.velocities()
        return (
            velocities
            if rod is None
            else velocities[self._session.directory.layout.rows(self._session.directory.rod(rod).index)]
        )

    def directors(self, rod: Rod | str) -> FloatArray:
        """Return the material frames of the edges of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (edges, 3, 3)
            The rows of each frame are the unit vectors d1, d2 and the tangent.

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        curvatures : Curvatures towards d1 and d2.
        twists : Twist of the frames about the tangent.
        """
        return self._session.world.directors(self._session.directory.rod(rod).index).reshape(-1, 3, 3)

    def curvatures(self, rod: Rod | str) -> FloatArray:
        """Return the curvatures of a rod towards its directors d1 and d2.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (stencils, 2) [1/m]

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        get : Return the natural curvature, ``get(rod, "natural_curvature")``.
        twists : Twists per length.
        """
        return self._session.world.curvatures(self._session.directory.rod(rod).index)

    def twists(self, rod: Rod | str) -> FloatArray:
        """Return the twists per length of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (stencils,) [rad/m]

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        link : Link of a rod, the sum of its twist and writhe.
        curvatures : Curvatures towards d1 and d2.
        """
        return self._session.world.twists(self._session.directory.rod(rod).index)

    def tensions(self, rod: Rod | str) -> FloatArray:
        """Return the tension of each edge of a rod, positive in tension.

        After an implicit midpoint step, the tension is the one in the middle of the step, where the forces balance. An
        edge that turns by w in a step ends with the spurious strain w^2 / 8. After other steps the tension is the one
        of the state.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (edges,) [N]

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        reaction : Force and moment of a support.
        """
        return self._session.world.tensions(self._session.directory.rod(rod).index)

    def spring_tension(self, spring: Spring | str) -> float:
        """Return the force of a spring and its damper, positive in tension.

        Parameters
        ----------
        spring : Spring or str
            Spring to read.

        Returns
        -------
        float [N]

        Raises
        ------
        ValueError
            Not a spring of this scene.

        See Also
        --------
        Scene.add_spring : Add a spring.
        """
        return spring_tension(self._session, self._session.directory.find(spring, SpringPart, "spring"))

    def tendon_length(self, tendon: Tendon | str) -> float:
        """Return the length of a tendon from its first guide to its last.

        The forces of a tendon are minus the gradient of its tension times this length. At a free end, the last half
        edge of length l / 2 counts as bent by the tension T at the offset r, which adds T r^2 l / (2 EI).

        Parameters
        ----------
        tendon : Tendon or str
            Tendon to read.

        Returns
        -------
        float [m]

        Raises
        ------
        ValueError
            Not a tendon of this scene.

        See Also
        --------
        Scene.add_tendon : Add a tendon.
        tendon_points : Positions of its guides.
        """
        return tendon_length(self._session, self._session.directory.find(tendon, TendonPart, "tendon"))

    def tendon_points(self, tendon: Tendon | str) -> FloatArray:
        """Return the positions of the guides of a tendon.

        Parameters
        ----------
        tendon : Tendon or str
            Tendon to read.

        Returns
        -------
        ndarray of shape (guides, 3) [m]

        Raises
        ------
        ValueError
            Not a tendon of this scene.

        See Also
        --------
        tendon_length : Length of the tendon.
        """
        return tendon_points(self._session, self._session.directory.find(tendon, TendonPart, "tendon"))

    def joint_angle(self, joint: Joint | str) -> float:
        """Return the angle of a revolute joint since the drawing.

        The angle is the rotation of the second rod relative to the first, by the right-hand rule, whole turns included.

        Parameters
        ----------
        joint : Joint or str
            Revolute joint to read.

        Returns
        -------
        float [rad]

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.

        See Also
        --------
        joint_rate : Rate of this angle.
        joint_torque : Torque of the joint.
        Scene.join : Join nodes, also by a revolute joint.
        """
        return self._session.world.joint_angle(find_joint(self._session, joint))

    def joint_rate(self, joint: Joint | str) -> float:
        """Return the rate of `joint_angle`.

        The rate is the mean over the last step; with "fourth_order", over its last inner step. Before the first step,
        and after a state was set, the rate follows from the velocities of the edges at the joint.

        Parameters
        ----------
        joint : Joint or str
            Revolute joint to read.

        Returns
        -------
        float [rad/s]

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.

        See Also
        --------
        joint_angle : The angle.
        """
        return self._session.world.joint_rate(find_joint(self._session, joint))

    def joint_torque(self, joint: Joint | str) -> float:
        """Return the torque of motor, spring and damper on the second rod of a revolute joint. See `Scene.join`.

        Parameters
        ----------
        joint : Joint or str
            Revolute joint to read.

        Returns
        -------
        float [N m]

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.

        See Also
        --------
        joint_angle : The angle on which the torque depends.
        Scene.join : The equation of the torque.
        """
        return self._session.world.joint_torque(find_joint(self._session, joint))

    def spins(self, rod: Rod | str) -> FloatArray:
        """Return the angular velocities of the edges of a rod about their tangents.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        ndarray of shape (edges,) [rad/s]

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        set_state : Set the spins.
        """
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

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        Record.energy : Energies at every frame of a run.
        momentum : Linear and angular momentum.
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

        See Also
        --------
        energy : Energies.

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

    def reaction(self, support: Support | NodeHandle | Body | Joint | str) -> Reaction:
        """Return the force and moment of a support on its rod or body, or of a joint on its second part.

        During motion these are means over the last time step, inner steps included: together with all other forces they
        account for the change of momentum. The moment is about the node of the support or joint.

        Parameters
        ----------
        support : Support, NodeHandle, Body, Joint or str
            The support, its node, or the body that it holds; or a joint at a rigid body.

        Returns
        -------
        Reaction
            Force of shape (3,) [N] and moment of shape (3,) [N m]. Those of ``join(a, b)`` act on `b`, and their
            opposites on `a`. The moment contains the torque about the axis, `joint_torque`.

        Raises
        ------
        ValueError
            The node has no support. A joint of rods without a body; a joint with rods on both sides, or with supports
            on both sides at its node.

        See Also
        --------
        wrench : Total force and moment of a hand.
        joint_torque : Torque about the axis of a joint.
        tensions : Tensions of the edges of a rod.
        contacts : Forces of contacts.

        Notes
        -----
        Force times displacement plus moment times rotation of a step without subdivision is the work in
        ``energy().work``, to second order in the time step. A support that starts or stops at full speed applies an
        impulse, which is part of the force of this step. Its work is the impulse times the mean of both velocities,
        half of the force times the displacement.

        The reaction of a joint follows from the balance of everything beyond the joint. A force that a user puts on a
        body at the node of a joint acts on this body. A spring, tendon, follower or custom force at this node counts as
        one on the rods there.

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene()
        >>> frame, lamp = scene.add_body(mass=1.0, inertia=0.01), scene.add_body(mass=2.0, inertia=0.01)
        >>> support = scene.clamp(frame)
        >>> hook = scene.join(frame, lamp, "pinned", at=(0, 0, 0.1))
        >>> simulation = scene.build(integrator="static")
        >>> print(simulation.reaction(hook).force.round(6))
        [ 0.    0.   19.62]
        """
        if is_joint(self._session, support):
            return joint_reaction(self._session, cast(Joint, support))
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

        Returns
        -------
        Reaction
            Force of shape (3,) [N] and moment of shape (3,) [N m].

        Raises
        ------
        ValueError
            Not a hand, or a released one.

        See Also
        --------
        grasp : Grasp a rod by a hand.
        deflection : Displacement of the rod in a compliant hand.
        reaction : Force and moment of any support, about its node.
        """
        return hand_wrench(self._session, hand, about)

    def deflection(self, hand: Hand | str) -> Deflection:
        """Return the displacement of the held part of the rod relative to the hand. Zero for a rigid hand.

        Parameters
        ----------
        hand : Hand or str
            Hand to read.

        Returns
        -------
        Deflection
            Shift [m], turn [rad] and slip [m], each of shape (3,), in the axes of the hand.

        Raises
        ------
        ValueError
            Not a hand, or a released one.

        See Also
        --------
        wrench : Force and moment of the hand.
        """
        return hand_deflection(self._session, hand)

    def passage(self, ring: Hand | str) -> Passage:
        """Return the place where a rod passes a ring, and the forces of the ring on the rod.

        Parameters
        ----------
        ring : Hand or str
            Ring to read, a hand with ``slides=True``.

        Returns
        -------
        Passage
            Arc length [m], forces [N] and feed rate [m/s].

        Raises
        ------
        ValueError
            Not a ring, or one that was released or left by its rod.

        See Also
        --------
        grasp : Make a ring by ``slides=True``.
        feed : Set the feed rate.

        Examples
        --------
        >>> ring = simulation.grasp(arm, at=0.2, slides=True, friction=0.3)
        >>> round(simulation.passage(ring).at, 9)
        0.2
        """
        return ring_passage(self._session, ring)

    def pose(self, support: Support | NodeHandle | Body | str) -> HeldPose:
        """Return the present position and rotation of a support or hand.

        For a support with `free`, the position is the one from which its node slides.

        Parameters
        ----------
        support : Support, NodeHandle, Body or str
            Support or hand to read, or its node.

        Returns
        -------
        HeldPose
            Position of shape (3,) [m] and rotation matrix of shape (3, 3).

        Raises
        ------
        ValueError
            The node has no support.

        See Also
        --------
        move : Move a support.
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

        See Also
        --------
        reaction : Force and moment of a support.
        Scene.enable_contact : Enable contact between rods.
        """
        return contact_table(self._session.directory, self._session.world.contacts())

    def link(self, rod: Rod | str) -> float:
        """Return the link of a rod, which is the sum of its twist and writhe.

        The link of a closed rod is constant as long as no rod passes through it; so is the link of an open rod whose
        ends are held and do not spin [Calugareanu 1961]. An open rod is extended straight at both ends.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.

        Returns
        -------
        float [turns]

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        withe.knots.link : Link of any centreline with directors.
        withe.knots.writhe : Writhe alone.
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
        free = free_rods(self._session.directory, [part for _, part in self._session.settings.supports.values()])
        return Plan(
            planar=plan.planar,
            plane_normal=np.array(plan.plane_normal) if plan.planar else None,
            unknowns=plan.unknowns,
            solver=plan.solver,
            stable_step=plan.stable_step or None,
            notes=(f"{length:.4g} m of rod, {mass:.4g} kg in all", *_note_of_free(free), *plan.notes),
        )


def _note_of_free(rods: Sequence[RodPart]) -> list[str]:
    """Return the note of a plan on rods without support."""
    if not rods:
        return []
    if len(rods) == 1:
        return [f"no support holds {rods[0].owner}: it is free"]
    listed = ", ".join(repr(rod.name) for rod in rods[:_LISTED])
    others = len(rods) - _LISTED
    return [f"no support holds rods {listed}{f' and {others} others' if others > 0 else ''}: they are free"]
