"""Read-outs of a batch: those of `Simulation` with one more axis in front."""

from __future__ import annotations

from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from withe.batch.lanes import Lanes, output
from withe.parts.handles import (
    Body,
    Drag,
    Fluid,
    Hand,
    Joint,
    Load,
    Mass,
    NodeHandle,
    Obstacle,
    Rod,
    Spring,
    Support,
    Tendon,
)
from withe.parts.torsion_springs import TorsionSpring
from withe.simulation.readouts import Energy, Momentum, Reaction, RodEnergy, Statistics
from withe.simulation.typed_words import (
    DragWord,
    FluidNumber,
    JointWord,
    LoadVector,
    MassWord,
    MaterialWord,
    ObstacleNumber,
    ObstacleVector,
    PairNumber,
    RodArray,
    SceneNumber,
    SpringWord,
    SupportVector,
    TendonWord,
    TorsionWord,
    Toucher,
)

__all__ = ["Reading"]

FloatArray = npt.NDArray[np.float64]


class Reading:
    """Methods of `Batch` that read. An argument `out` is an array of the user that is filled and returned."""

    _lanes: Lanes

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Return the handles of all rods, in the order of the scene."""
        return self._lanes.first.rods

    @property
    def time(self) -> FloatArray:
        """Return the time of every simulation since its start, shape (n,) [s]."""
        times = np.empty(len(self._lanes))
        self._lanes.engine.read("time", -1, times)
        return times

    def positions(self, rod: Rod | str | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return the positions of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default all nodes of the scene.
        out : ndarray of shape (n, nodes, 3), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, nodes, 3) [m]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.

        See Also
        --------
        velocities : Velocities of the same nodes.
        Simulation.positions : Positions in one simulation.

        Examples
        --------
        >>> batch = scene.build_batch(3)
        >>> batch.positions(arm).shape
        (3, 31, 3)
        """
        return _of_nodes(self._lanes, "positions", rod, out)

    def velocities(self, rod: Rod | str | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return the velocities of the nodes of a rod, or of all nodes of the scene.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod to read. By default all nodes of the scene.
        out : ndarray of shape (n, nodes, 3), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, nodes, 3) [m/s]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.

        See Also
        --------
        positions : Positions of the same nodes.
        """
        return _of_nodes(self._lanes, "velocities", rod, out)

    def directors(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the material frames of the edges of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.
        out : ndarray of shape (n, edges, 3, 3), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, edges, 3, 3)
            The rows of each frame are the unit vectors d1, d2 and the tangent.

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.
        """
        part = self._lanes.rod(rod)
        return _read(self._lanes, "directors", part.index, (len(part.lengths), 3, 3), out)

    def curvatures(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the curvatures of a rod towards its directors d1 and d2.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.
        out : ndarray of shape (n, stencils, 2), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, stencils, 2) [1/m]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.
        """
        part = self._lanes.rod(rod)
        return _read(self._lanes, "curvatures", part.index, (len(part.voronoi), 2), out)

    def twists(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the twists per length of a rod.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.
        out : ndarray of shape (n, stencils), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, stencils) [rad/m]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.
        """
        part = self._lanes.rod(rod)
        return _read(self._lanes, "twists", part.index, (len(part.voronoi),), out)

    def tensions(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the tension of each edge of a rod. See `Simulation.tensions`.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.
        out : ndarray of shape (n, edges), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, edges) [N]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.
        """
        part = self._lanes.rod(rod)
        return _read(self._lanes, "tensions", part.index, (len(part.lengths),), out)

    def spins(self, rod: Rod | str, out: FloatArray | None = None) -> FloatArray:
        """Return the angular velocities of the edges of a rod about their tangents.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.
        out : ndarray of shape (n, edges), float64, optional
            Array that is filled and returned.

        Returns
        -------
        ndarray of shape (n, edges) [rad/s]

        Raises
        ------
        ValueError
            Not a rod of this scene, or an `out` of another shape, type or layout.
        """
        part = self._lanes.rod(rod)
        return _read(self._lanes, "spins", part.index, (len(part.lengths),), out)

    def energy(self, rod: Rod | str | None = None) -> Energy | RodEnergy:
        """Return the energies of every simulation, or of one rod in each.

        Parameters
        ----------
        rod : Rod or str, optional
            Rod whose energies are returned.

        Returns
        -------
        Energy or RodEnergy
            Each field has shape (n,) [J].

        Raises
        ------
        ValueError
            Not a rod of this scene.

        See Also
        --------
        Simulation.energy : Energies of one simulation.
        """
        return self._lanes.gathered(lambda s: s.energy() if rod is None else s.energy(rod))  # type: ignore[no-any-return]

    def momentum(self) -> Momentum:
        """Return the linear and angular momentum of every simulation.

        Returns
        -------
        Momentum
            Each field has shape (n, 3), linear [kg m/s] and angular [kg m^2/s].

        See Also
        --------
        Simulation.momentum : Momentum of one simulation.
        """
        return self._lanes.gathered(lambda s: s.momentum())  # type: ignore[no-any-return]

    def reaction(self, support: Support | NodeHandle | Body | Joint | str) -> Reaction:
        """Return the force and moment of a support on its rod or body, or of a joint on its second part.

        Parameters
        ----------
        support : Support, NodeHandle, Body, Joint or str
            The support, its node, or the body that it holds; or a joint at a rigid body.

        Returns
        -------
        Reaction
            Force of shape (n, 3) [N] and moment of shape (n, 3) [N m].

        Raises
        ------
        ValueError
            The node has no support, or the reaction of the joint is not known.

        See Also
        --------
        Simulation.reaction : Reaction in one simulation.
        """
        return self._lanes.gathered(lambda s: s.reaction(support))  # type: ignore[no-any-return]

    def wrench(self, hand: Hand | str) -> Reaction:
        """Return the total force and moment of a hand on its rod, about the hand.

        Parameters
        ----------
        hand : Hand or str
            The hand.

        Returns
        -------
        Reaction
            Force of shape (n, 3) [N] and moment of shape (n, 3) [N m].

        Raises
        ------
        ValueError
            Not a hand, or a released one.

        See Also
        --------
        Simulation.wrench : Force and moment in one simulation.
        """
        return self._lanes.gathered(lambda s: s.wrench(hand))  # type: ignore[no-any-return]

    def spring_tension(self, spring: Spring | str) -> FloatArray:
        """Return the force of a spring and its damper, positive in tension.

        Parameters
        ----------
        spring : Spring or str
            Spring to read.

        Returns
        -------
        ndarray of shape (n,) [N]

        Raises
        ------
        ValueError
            Not a spring of this scene.
        """
        return self._lanes.gathered(lambda s: s.spring_tension(spring))  # type: ignore[no-any-return]

    def tendon_length(self, tendon: Tendon | str) -> FloatArray:
        """Return the length of a tendon from its first guide to its last.

        Parameters
        ----------
        tendon : Tendon or str
            Tendon to read.

        Returns
        -------
        ndarray of shape (n,) [m]

        Raises
        ------
        ValueError
            Not a tendon of this scene.
        """
        return self._lanes.gathered(lambda s: s.tendon_length(tendon))  # type: ignore[no-any-return]

    def tendon_points(self, tendon: Tendon | str) -> FloatArray:
        """Return the positions of the guides of a tendon.

        Parameters
        ----------
        tendon : Tendon or str
            Tendon to read.

        Returns
        -------
        ndarray of shape (n, guides, 3) [m]

        Raises
        ------
        ValueError
            Not a tendon of this scene.
        """
        return self._lanes.gathered(lambda s: s.tendon_points(tendon))  # type: ignore[no-any-return]

    def joint_angle(self, joint: Joint | str) -> FloatArray:
        """Return the angle of a revolute joint since the drawing.

        Parameters
        ----------
        joint : Joint or str
            Revolute joint to read.

        Returns
        -------
        ndarray of shape (n,) [rad]

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._lanes.gathered(lambda s: s.joint_angle(joint))  # type: ignore[no-any-return]

    def joint_rate(self, joint: Joint | str) -> FloatArray:
        """Return the rate of `joint_angle`.

        Parameters
        ----------
        joint : Joint or str
            Revolute joint to read.

        Returns
        -------
        ndarray of shape (n,) [rad/s]

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._lanes.gathered(lambda s: s.joint_rate(joint))  # type: ignore[no-any-return]

    def joint_torque(self, joint: Joint | str) -> FloatArray:
        """Return the torque of a revolute joint on its second rod.

        Parameters
        ----------
        joint : Joint or str
            Revolute joint to read.

        Returns
        -------
        ndarray of shape (n,) [N m]

        Raises
        ------
        ValueError
            Not a revolute joint of this scene.
        """
        return self._lanes.gathered(lambda s: s.joint_torque(joint))  # type: ignore[no-any-return]

    def position(self, body: Body | str) -> FloatArray:
        """Return the position of the origin of the axes of a rigid body. See `Simulation.position`.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (n, 3) [m]

        Raises
        ------
        ValueError
            Not a body of this scene.

        See Also
        --------
        rotation : Orientations of a body.
        """
        return self._lanes.gathered(lambda s: s.position(body))  # type: ignore[no-any-return]

    def rotation(self, body: Body | str) -> FloatArray:
        """Return the axes, as columns of matrices, of a rigid body. See `Simulation.rotation`.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (n, 3, 3)

        Raises
        ------
        ValueError
            Not a body of this scene.

        See Also
        --------
        position : Positions of a body.
        """
        return self._lanes.gathered(lambda s: s.rotation(body))  # type: ignore[no-any-return]

    def velocity(self, body: Body | str) -> FloatArray:
        """Return the velocity of the origin of the axes of a rigid body. See `Simulation.velocity`.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (n, 3) [m/s]

        Raises
        ------
        ValueError
            Not a body of this scene.

        See Also
        --------
        angular_velocity : Angular velocities of a body.
        """
        return self._lanes.gathered(lambda s: s.velocity(body))  # type: ignore[no-any-return]

    def angular_velocity(self, body: Body | str) -> FloatArray:
        """Return the angular velocity of a rigid body. See `Simulation.angular_velocity`.

        Parameters
        ----------
        body : Body or str
            Body to read.

        Returns
        -------
        ndarray of shape (n, 3) [rad/s]

        Raises
        ------
        ValueError
            Not a body of this scene.

        See Also
        --------
        velocity : Velocities of a body.
        """
        return self._lanes.gathered(lambda s: s.angular_velocity(body))  # type: ignore[no-any-return]

    def obstacle_position(self, obstacle: Obstacle | str) -> FloatArray:
        """Return the position of an obstacle. See `Simulation.obstacle_position`.

        Parameters
        ----------
        obstacle : Obstacle or str
            Obstacle to read.

        Returns
        -------
        ndarray of shape (n, 3) [m]

        Raises
        ------
        ValueError
            Not an obstacle of this scene.
        """
        return self._lanes.gathered(lambda s: s.obstacle_position(obstacle))  # type: ignore[no-any-return]

    def contacts(self) -> list[npt.NDArray[np.void]]:
        """Return the contacts of every simulation.

        Returns
        -------
        list of structured ndarray of shape (contacts,)
            One table per simulation, as `Simulation.contacts` returns it.

        See Also
        --------
        Simulation.contacts : Columns of a table.
        """
        return [simulation.contacts() for simulation in self._lanes.simulations]

    @property
    def statistics(self) -> Statistics:
        """Return counts and times of the work so far; each field has shape (n,)."""
        return self._lanes.gathered(lambda s: s.statistics)  # type: ignore[no-any-return]

    @overload
    def get(self, target: Rod, word: MaterialWord) -> Any: ...

    @overload
    def get(self, target: Rod, word: RodArray) -> FloatArray: ...

    @overload
    def get(self, target: Load, word: LoadVector) -> Any: ...

    @overload
    def get(self, target: Load, word: Literal["pressure"]) -> Any: ...

    @overload
    def get(self, target: Mass, word: MassWord) -> FloatArray: ...

    @overload
    def get(self, target: Spring, word: SpringWord) -> FloatArray: ...

    @overload
    def get(self, target: Tendon, word: TendonWord) -> FloatArray: ...

    @overload
    def get(self, target: Joint, word: JointWord) -> FloatArray: ...

    @overload
    def get(self, target: TorsionSpring, word: TorsionWord) -> FloatArray: ...

    @overload
    def get(self, target: Drag, word: DragWord) -> FloatArray: ...

    @overload
    def get(self, target: Fluid, word: FluidNumber) -> FloatArray: ...

    @overload
    def get(self, target: Fluid, word: Literal["regularization"]) -> Any: ...

    @overload
    def get(self, target: Obstacle, word: ObstacleNumber) -> FloatArray: ...

    @overload
    def get(self, target: Obstacle, word: ObstacleVector) -> FloatArray: ...

    @overload
    def get(self, target: Obstacle, word: Literal["friction"]) -> Any: ...

    @overload
    def get(self, target: Support, word: SupportVector) -> FloatArray: ...

    @overload
    def get(self, target: Support, word: Literal["friction"]) -> FloatArray: ...

    @overload
    def get(self, target: tuple[Toucher, Toucher], word: PairNumber) -> FloatArray: ...

    @overload
    def get(self, target: tuple[Toucher, Toucher], word: Literal["friction", "contact_stiffness"]) -> Any: ...

    @overload
    def get(self, target: Literal["gravity"], word: None = None) -> FloatArray: ...

    @overload
    def get(self, target: SceneNumber, word: None = None) -> FloatArray: ...

    @overload
    def get(self, target: Literal["contact_stiffness"], word: None = None) -> Any: ...

    @overload
    def get(self, target: str, word: str | None = None) -> Any: ...

    def get(self, target: Any, word: str | None = None) -> Any:
        """Return the present value of a parameter of `set` in every simulation.

        Parameters
        ----------
        target : handle or str
            Part to read, as in `Simulation.get`.
        word : str
            Parameter, as in `Simulation.get`.

        Returns
        -------
        ndarray of shape (n, ...)
            Values; a tuple if they are not numbers.

        Raises
        ------
        ValueError
            A parameter that the target does not have.

        See Also
        --------
        set : Change a parameter.
        Simulation.get : The parameters, and the value of each.
        """
        return self._lanes.gathered(lambda s: s.get(target, word))


def _of_nodes(lanes: Lanes, what: str, rod: Rod | str | None, out: FloatArray | None) -> FloatArray:
    if rod is None:
        return _read(lanes, what, -1, (lanes.first._session.directory.layout.node_count, 3), out)
    index = lanes.rod(rod).index
    return _read(lanes, what, index, (lanes.nodes(index), 3), out)


def _read(lanes: Lanes, what: str, rod: int, shape: tuple[int, ...], out: FloatArray | None) -> FloatArray:
    result = output(out, (len(lanes), *shape))
    lanes.engine.read(what, rod, result)
    return result
