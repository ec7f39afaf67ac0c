"""What may be read of a simulation at any moment. Read-outs are copies."""

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
        """Handles of all rods, in the order of the scene."""
        return self._session.directory.rods

    def positions(self, rod: Rod | str | None = None) -> FloatArray:
        """Positions of the nodes of a rod, or of every node of the scene once.

        Returns
        -------
        ndarray of shape (nodes, 3) [m]
            Of the whole scene without a rod; `rod.rows` are a rod's rows there.

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
        """Where an obstacle is: the point of a plane, a sphere's centre, a capsule's start, shape (3,) [m].

        Raises
        ------
        ValueError
            Not an obstacle of this scene.
        """
        part = self._session.directory.find(obstacle, ObstaclePart, "obstacle")
        return np.array(self._session.world.obstacle_position(self._session.directory.all(ObstaclePart).index(part)))

    def velocities(self, rod: Rod | str | None = None) -> FloatArray:
        """Velocities of the nodes of a rod, or of every node once, shape (nodes, 3) [m/s]."""
        velocities = self._session.world.velocities()
        return (
            velocities
            if rod is None
            else velocities[self._session.directory.layout.rows(self._session.directory.rod(rod).index)]
        )

    def directors(self, rod: Rod | str) -> FloatArray:
        """Material frames of the edges, shape (edges, 3, 3), rows d1, d2, tangent."""
        return self._session.world.directors(self._session.directory.rod(rod).index).reshape(-1, 3, 3)

    def curvatures(self, rod: Rod | str) -> FloatArray:
        """Curvatures towards d1 and d2, shape (stencils, 2) [1/m]."""
        return self._session.world.curvatures(self._session.directory.rod(rod).index)

    def twists(self, rod: Rod | str) -> FloatArray:
        """Twists, shape (stencils,) [rad/m]."""
        return self._session.world.twists(self._session.directory.rod(rod).index)

    def tensions(self, rod: Rod | str) -> FloatArray:
        """Axial forces of the edges, pulling is positive, shape (edges,) [N].

        After a step by the midpoint rule those in its middle, where forces are in balance, as reactions are: an edge
        that turns by w in a step is longer at its end by w^2 / 8, which takes no force. Else those of the state.
        """
        return self._session.world.tensions(self._session.directory.rod(rod).index)

    def spring_tension(self, spring: Spring | str) -> float:
        """Axial force of a spring and its damper, pulling is positive [N].

        Raises
        ------
        ValueError
            Not a spring of this scene.
        """
        return spring_tension(self._session, self._session.directory.find(spring, SpringPart, "spring"))

    def tendon_length(self, tendon: Tendon | str) -> float:
        """From its first guide to its last, along a tendon [m]: what a motor that shortens it has to take in.

        Forces are minus the gradient of the tension times this. Half an edge at a free end is straight in the rod's
        energy; counted is the arc l / 2 as which it bends under the tension T at an offset r, T r^2 l / (2 EI).

        Raises
        ------
        ValueError
            Not a tendon of this scene.
        """
        return tendon_length(self._session, self._session.directory.find(tendon, TendonPart, "tendon"))

    def tendon_points(self, tendon: Tendon | str) -> FloatArray:
        """Where the guides of a tendon are, shape (guides, 3) [m].

        Raises
        ------
        ValueError
            Not a tendon of this scene.
        """
        return tendon_points(self._session, self._session.directory.find(tendon, TendonPart, "tendon"))

    def joint_angle(self, joint: Joint | str) -> float:
        """By how much the second rod of a revolute joint has turned about its axis since it was drawn [rad].

        Seen from the first, by the right-hand rule; whole turns are counted.

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._session.world.joint_angle(find_joint(self._session, joint))

    def joint_rate(self, joint: Joint | str) -> float:
        """The rate of `joint_angle` [rad/s]: the mean of the last step (by fourth order, of its last part).

        Before the first one, and where a state was set, by how the edges at either side turn.

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._session.world.joint_rate(find_joint(self._session, joint))

    def joint_torque(self, joint: Joint | str) -> float:
        """By what its motor, spring and damper turn the second rod of a revolute joint, see `Scene.join` [N m].

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._session.world.joint_torque(find_joint(self._session, joint))

    def spins(self, rod: Rod | str) -> FloatArray:
        """Angular velocities of the edges about their tangents, shape (edges,) [rad/s]."""
        return self._session.world.spins(self._session.directory.rod(rod).index)

    @overload
    def energy(self) -> Energy: ...

    @overload
    def energy(self, rod: Rod | str) -> RodEnergy: ...

    def energy(self, rod: Rod | str | None = None) -> Energy | RodEnergy:
        """Energies of the whole scene, or of one rod [J].

        Parameters
        ----------
        rod : Rod or str, optional

        Returns
        -------
        Energy
            Without a rod.
        RodEnergy
            Of a rod; loads, contact, work and dissipation belong to the scene.
        """
        if rod is not None:
            part = self._session.world.rod_energy(self._session.directory.rod(rod).index)
            return RodEnergy(**{name: getattr(part, name) for name in RodEnergy.__dataclass_fields__})
        energy = self._session.world.energy()
        return Energy(**{name: getattr(energy, name) for name in Energy.__dataclass_fields__})

    def momentum(self) -> Momentum:
        """Linear momentum, and angular momentum about the origin, of the whole scene.

        By the masses that the equations of motion have, nodes that supports hold included. Sum of x cross (M v) over
        nodes, M the mass matrix, of I omega t over edges that spin at omega about their tangents t, and of what the
        frames of joints carry.

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
        """Force and moment of a support on the rod.

        In motion, the means over the last time step, of all its parts where it was cut (`statistics.steps` counts
        parts): with all other forces, those by which momentum grew in that time. The moment is about the node,
        wherever that goes. Times the way and the turn of a step
        that was not cut they are what ``energy().work`` counts, to second order in the step. A support that starts or
        stops at full speed gives what it holds its speed by an impulse, which is part of the force of that step: its
        work is that times the mean of both speeds, half of what the way of the step would say.

        Parameters
        ----------
        support : Support, NodeHandle or str
            A support, or the node that it holds.

        Raises
        ------
        ValueError
            Nothing holds that node.
        """
        index, _ = find_support(self._session, support)
        reaction = self._session.world.reaction(index)
        return Reaction(np.array(reaction.force), np.array(reaction.moment))

    def wrench(self, hand: Hand | str, about: npt.ArrayLike | None = None) -> Reaction:
        """Force and moment of a hand on the rod, of all that it holds as one.

        In motion, the means over the last time step, of all its parts where it was cut. Together with gravity and other
        forces they are by what momentum and angular momentum grew.

        Parameters
        ----------
        hand : Hand or str
        about : array_like of shape (3,) [m]
            The point of the world that the moment is about; by default where the hand is.

        Raises
        ------
        ValueError
            No hand, or released.
        """
        return hand_wrench(self._session, hand, about)

    def deflection(self, hand: Hand | str) -> Deflection:
        """How far what a hand that yields holds has gone from where it was grasped; zero of one that does not.

        Raises
        ------
        ValueError
            No hand, or released.
        """
        return hand_deflection(self._session, hand)

    def passage(self, ring: Hand | str) -> Passage:
        """How a rod passes a ring now: where along itself, and what the ring does to it there.

        Raises
        ------
        ValueError
            No ring, or released, or left by its rod.

        Examples
        --------
        >>> ring = simulation.grasp(arm, at=0.2, slides=True, friction=0.3)
        >>> round(simulation.passage(ring).at, 9)
        0.2
        """
        return ring_passage(self._session, ring)

    def pose(self, support: Support | NodeHandle | str) -> HeldPose:
        """Position and rotation of a support or a hand now; with `free`, where its node slides from.

        Raises
        ------
        ValueError
            Nothing holds that node.
        """
        return support_pose(self._session, support)

    def contacts(self) -> npt.NDArray[np.void]:
        """What touches now.

        Returns
        -------
        structured ndarray, a row per contact
            "pair" (two names) and "edge" (their edges, -1 for an obstacle), "distance" of the centrelines
            and "gap" of the surfaces [m], "point" between them [m], "normal" from the second to the first,
            "normal_force" [N] and "friction" on the first [N], as the last step ended, "sticking".
        """
        return contact_table(self._session.directory, self._session.world.contacts())

    def link(self, rod: Rod | str) -> float:
        """Link of a rod [turns]: its twist and its writhe.

        Kept by a closed rod, and by an open one whose ends are held and do not spin, as long as nothing
        passes through it [Calugareanu 1961]. An open rod is carried on straight from both ends.

        Returns
        -------
        float
        """
        index = self._session.directory.rod(rod).index
        closed = self._session.directory.layout.rods[index].closed
        return link(self.positions(rod), self.directors(rod), closed)

    @property
    def statistics(self) -> Statistics:
        """What the work so far took."""
        statistics = self._session.world.statistics
        return Statistics(**{name: getattr(statistics, name) for name in Statistics.__dataclass_fields__})

    @property
    def plan(self) -> Plan:
        """What was decided for this scene: ``print(simulation.plan)``."""
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
