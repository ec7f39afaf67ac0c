"""Placement of supports, obstacles and rods during a simulation."""

from __future__ import annotations

from typing import Any, Literal

import numpy.typing as npt

from withe.common.deprecation import old_word
from withe.common.keywords import keyword_hints
from withe.parts.friction import Friction
from withe.parts.handles import Body, NodeHandle, Obstacle, Rod, Support
from withe.parts.hands import Sliding, make_hand
from withe.parts.supports import make_clamp, make_pin
from withe.simulation.bodies import base_point, set_body_velocity
from withe.simulation.hands import RunningHand, feed_ring, find_hand
from withe.simulation.motion import PathLike, RotationLike
from withe.simulation.obstacles import find_obstacle, move_obstacle
from withe.simulation.parameters import set_values
from withe.simulation.session import Session
from withe.simulation.states import set_state, set_velocities
from withe.simulation.supports import hold as put_on
from withe.simulation.supports import move_support, release

__all__ = ["Placement"]


@keyword_hints
class Placement:
    """Methods of `Simulation` that hold, move and place parts. They call functions of the session."""

    _session: Session

    def clamp(
        self,
        node: NodeHandle | Body | str,
        *,
        hold: Literal["frame", "edge"] = "frame",
        free: npt.ArrayLike | None = None,
        spin: bool | npt.ArrayLike = False,
        name: str | None = None,
    ) -> Support:
        """Clamp a node in its present position and direction. See `Scene.clamp`.

        Parameters
        ----------
        node : NodeHandle, Body or str
            Node to clamp, or body, which is held at its base.
        hold : {"frame", "edge"}
            "frame" clamps the rod at the node, as a wall does. "edge" holds the end edge: both of its nodes and its
            angle.
        free : array_like of shape (3,) or (2, 3)
            Directions along which the clamp may slide.
        spin : bool, or array_like of shape (3,)
            True if the rod may spin about its tangent, whose direction stays held. For a body the axis about which it
            may turn, as drawn.
        name : str
            Name of the support. By default "clamp 1", ...

        Returns
        -------
        Support

        Raises
        ------
        ValueError
            The node already has a support.

        See Also
        --------
        Scene.clamp : Clamp a node before the simulation is built.
        move : Move the clamp.
        release : Remove the clamp.
        """
        return put_on(
            self._session,
            make_clamp(self._session.directory, node, hold, free, spin, name, base_point(self._session, node)),
        )

    def pin(
        self, node: NodeHandle | Body | str, *, free: npt.ArrayLike | None = None, name: str | None = None
    ) -> Support:
        """Pin a node in its present position. See `Scene.pin`.

        Parameters
        ----------
        node : NodeHandle, Body or str
            Node to pin, or body, which is held at its base.
        free : array_like of shape (3,) or (2, 3)
            Directions along which the pin may slide.
        name : str
            Name of the support. By default "pin 1", ...

        Returns
        -------
        Support

        Raises
        ------
        ValueError
            The node already has a support.

        See Also
        --------
        clamp : Hold the direction of the rod too.
        release : Remove the pin.
        """
        return put_on(
            self._session, make_pin(self._session.directory, node, free, name, base_point(self._session, node))
        )

    def grasp(
        self,
        rod: Rod | str,
        at: float,
        length: float = 0.0,
        *,
        pose: Any = None,
        stiffness: npt.ArrayLike | None = None,
        force_limit: float | None = None,
        slides: bool = False,
        friction: float = 0.0,
        feed_rate: float | None = None,
        name: str | None = None,
    ) -> RunningHand:
        """Grasp a rod by a hand in its present pose. See `Scene.grasp`.

        A rigid hand brings the held edges to rest, or to its own motion, within the next time step.

        Parameters
        ----------
        rod : Rod or str
            Rod to grasp.
        at : float [m]
            Undeformed arc length from the start of the rod to the middle of the hand.
        length : float [m]
            Undeformed length of the rod that is held. With 0 the hand holds one point.
        pose : pair of array_like of shape (3,) [m] and rotation, array_like of shape (7,) or (4, 4)
            Position and axes of the hand in the world. By default the hand is at the point of the rod, with its frame.
        stiffness : pair, or array_like of shape (6,) [N/m, N m/rad]
            Stiffness along d1, d2 and the tangent of the held rod, and about these axes. By default the hand is rigid.
        force_limit : float [N]
            Force above which the rod slips through a compliant hand, or a drive slips.
        slides : bool
            True for a ring, through which the rod slides.
        friction : float [-]
            Coulomb friction coefficient of a ring without a drive.
        feed_rate : float [m/s]
            Undeformed length per time that a drive in the ring feeds towards the end of the rod.
        name : str
            Name of the hand. By default "hand 1", ...

        Returns
        -------
        RunningHand
            A handle with the methods ``move``, ``wrench``, ``release``, ``pose`` and ``deflection``; a ring also has
            ``passage`` and ``feed``.

        Raises
        ------
        ValueError
            See `Scene.grasp`.

        See Also
        --------
        Scene.grasp : Details of each argument.
        hand : Return a hand by its name.
        wrench : Force and moment of a hand.

        Examples
        --------
        >>> hand = simulation.grasp(arm, at=0.2, stiffness=(500.0, 0.1), force_limit=2.0)
        >>> simulation.step(10)
        >>> hand.deflection.shift.shape
        (3,)
        """
        sliding = Sliding(slides, friction, feed_rate)
        part = make_hand(self._session.directory, rod, at, length, pose, stiffness, force_limit, sliding, name)
        handle = put_on(self._session, part)
        return RunningHand(handle.scene_id, handle.name, self._session)

    def hand(self, hand: Support | str) -> RunningHand:
        """Return a hand of this simulation by its handle or name, with the methods of `RunningHand`.

        Parameters
        ----------
        hand : Hand or str
            Hand to return.

        Returns
        -------
        RunningHand

        Raises
        ------
        ValueError
            Not a hand of this simulation, or a released one.

        See Also
        --------
        grasp : Make a hand.

        Examples
        --------
        >>> _ = simulation.grasp(arm, at=0.2, name="left")
        >>> simulation.hand("left").release()
        """
        find_hand(self._session, hand)
        name = hand if isinstance(hand, str) else hand.name
        return RunningHand(self._session.directory.scene_id, name, self._session)

    def feed(self, ring: Support | str, rate: float) -> None:
        """Set the feed rate of a ring with a drive; see ``feed_rate`` of `Scene.grasp`.

        Parameters
        ----------
        ring : Hand or str
            A ring with a drive.
        rate : float [m/s]
            Undeformed length per time that is fed towards the end of the rod. Negative rates feed backwards.

        Raises
        ------
        ValueError
            A ring without a drive, or released.

        See Also
        --------
        passage : Place of the rod in the ring.
        """
        feed_ring(self._session, ring, rate)

    def release(self, support: Support | NodeHandle | Body | str) -> None:
        """Remove a support.

        Parameters
        ----------
        support : Support, NodeHandle, Body or str
            The support, or its node.

        Raises
        ------
        ValueError
            The node has no support.

        See Also
        --------
        clamp : Clamp a node again.
        """
        release(self._session, support)

    def move(
        self,
        support: Support | NodeHandle | Body | Obstacle | str,
        position: npt.ArrayLike | None = None,
        rotation: RotationLike | None = None,
        *,
        tangent: npt.ArrayLike | None = None,
        roll: float | None = None,
        over: float = 0.0,
        path: PathLike | None = None,
    ) -> None:
        """Move a support or an obstacle to a target, or along a path.

        Ramps and paths of other quantities continue: for example, a position that is still ramping arrives as planned
        when only a rotation is given. The work on the rods is part of ``energy().work``.

        Parameters
        ----------
        support : Support, NodeHandle, Body, Obstacle or str
            A support, its node or the body that it holds, or a floor, plane, sphere or capsule. The position of an
            obstacle is the point of a plane, the centre of a sphere, or the start of a capsule.
        position : array_like of shape (3,) [m]
            Target position.
        rotation : array_like of shape (4,) or (3, 3), or a SciPy Rotation
            Target rotation: a unit quaternion (w, x, y, z), a matrix or a Rotation, relative to the drawn orientation.
            For a hand, its axes in the world, as columns.
        tangent : array_like of shape (3,)
            Target direction of the rod, instead of a rotation: the smallest turn from the drawn tangent, followed by
            `roll`. For a sphere, the axis of `roll`.
        roll : float [rad]
            Rotation about the tangent, full turns included: at most half a turn per time step. With
            integrator="static", `equilibrium` and steps follow any roll without `over`. A plane rolls about its
            normal, a capsule about its axis from start to end, and drags rods by friction.
        over : float [s]
            Duration of the ramp to the target. By default the target is reached within the next step.
        path : callable, pair of callables, or array_like of shape (poses, 4) or (poses, 8)
            Path, instead of the targets above.

            * A function of time [s] that returns a position; a position and a rotation; or the seven numbers
              x, y, z, qw, qx, qy, qz.
            * Two functions of time, one for the position and one for the rotation, such as a CubicSpline and a
              RotationSpline of SciPy.
            * For an obstacle, a function that returns a position and a roll; for a sphere the roll times its axis.
            * Rows (t, x, y, z) or (t, x, y, z, qw, qx, qy, qz), with increasing times of the simulation [s] and unit
              quaternions, scalar first. Poses are interpolated, and constant before the first and after the last row.
              `withe.io.load_poses` reads such rows from tables with the scalar last.

        Raises
        ------
        ValueError
            The node has no support, a direction is given for a pin or an obstacle, or arguments contradict each other.

        See Also
        --------
        pose : Present pose of a support.
        set : Set parameters other than poses.
        Batch.move : Move supports of many simulations.

        Examples
        --------
        >>> hand = simulation.clamp(arm.end)
        >>> simulation.move(hand, position=(0.1, 0, 0.2), roll=np.pi, over=0.5)
        """
        obstacle = find_obstacle(self._session.directory, support)
        if obstacle is None:
            move_support(self._session, support, position, rotation, tangent, roll, over, path)
            return
        if path is not None and not callable(path):
            raise ValueError(f"path of {obstacle[1]!r} must be a function of time")
        if rotation is not None:
            raise ValueError(
                f"rotation of {obstacle[1]!r} must be None, because an obstacle turns by a roll about its axis"
            )
        move_obstacle(self._session, *obstacle, position, tangent, roll, over, path)

    def set_friction(self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str, friction: Friction) -> None:
        """Deprecated: use ``set((a, b), friction=...)``.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies.
        friction : float, pair or tuple of three of float [-], array_like of shape (edges,), or callable
            Friction coefficient, as in `Scene.set_friction`.

        Raises
        ------
        ValueError
            See `set`.

        See Also
        --------
        set : The method to use instead.
        """
        old_word("set_friction", "set((a, b), friction=...)")
        set_values(self._session, (a, b), {"friction": friction})

    def set_restitution(
        self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str, restitution: float
    ) -> None:
        """Deprecated: use ``set((a, b), restitution=...)``.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies.
        restitution : float [-]
            Coefficient of restitution, from 0 to 1.

        Raises
        ------
        ValueError
            See `set`.

        See Also
        --------
        set : The method to use instead.
        """
        old_word("set_restitution", "set((a, b), restitution=...)")
        set_values(self._session, (a, b), {"restitution": restitution})

    def set_contact_stiffness(
        self, a: Rod | Body | Obstacle | str, b: Rod | Body | Obstacle | str, stiffness: float
    ) -> None:
        """Deprecated: use ``set((a, b), contact_stiffness=...)``.

        Parameters
        ----------
        a, b : Rod, Body, Obstacle or str
            The two bodies.
        stiffness : float [N/m]
            Contact stiffness.

        Raises
        ------
        ValueError
            See `set`.

        See Also
        --------
        set : The method to use instead.
        """
        old_word("set_contact_stiffness", "set((a, b), contact_stiffness=...)")
        set_values(self._session, (a, b), {"contact_stiffness": stiffness})

    def set_state(
        self,
        rod: Rod | str,
        positions: npt.ArrayLike | None = None,
        velocities: npt.ArrayLike | None = None,
        *,
        twist: npt.ArrayLike | None = None,
        directors: npt.ArrayLike | None = None,
        spins: npt.ArrayLike | None = None,
    ) -> None:
        """Set the state of a rod. Arguments that are not given keep their present values.

        Joints turn with their edges. The energy balance of ``energy()`` restarts, without counting the change as work.
        Contacts of the moved rod lose their history, as at the start; other contacts keep theirs. A state
        out of the plane of a planar simulation makes the simulation three-dimensional, unless it was built with
        planar=True.

        Parameters
        ----------
        rod : Rod or str
            Rod to change.
        positions : array_like of shape (nodes, 3) [m]
            Positions of the nodes. The first director of the first edge follows by the smallest turn. Supported nodes
            must stay, or be at the place to which `move` moved their support without `over`.
        velocities : array_like of shape (nodes, 3) or (3,) [m/s]
            Velocities of the nodes. Supports impose their own velocity on their nodes in the next step.
        twist : float or array_like of shape (stencils,) [rad/m]
            Twist per length, as `twists` returns it. By default the present twist; in a closed rod, a difference due to
            new positions is spread evenly.
        directors : array_like of shape (edges, 3, 3) or (edges, 3)
            Directors, instead of twist: as `directors` returns them, or the first ones only. The twist of each stencil
            is then less than half a turn.
        spins : float or array_like of shape (edges,) [rad/s]
            Angular velocities of the edges about their tangents.

        Raises
        ------
        ValueError
            A wrong shape or a value that is not finite. Directors that are not normal to their edges, or twist that
            does not close a closed rod. An edge of zero length or folded back, a moved supported node, or overlapping
            surfaces. A state out of the plane with planar=True. In all these cases nothing is changed.

        See Also
        --------
        set_velocities : Set velocities only.
        restore : Restore the whole state of a snapshot.

        Examples
        --------
        >>> simulation.set_state(arm, spins=np.linspace(0.0, 5.0, 30))
        """
        set_state(self._session, rod, positions, velocities, twist, directors, spins)

    def set_velocity(
        self, body: Body | str, velocity: npt.ArrayLike | None = None, *, angular: npt.ArrayLike | None = None
    ) -> None:
        """Set the motion of a rigid body. Rods that are joined to it keep their velocities except at the joint.

        If the motion contradicts a support of the body, an impulse of the support makes both consistent in the next
        step. For a bar on a hinge of the world, a velocity of its centre then becomes a rotation about the hinge.

        Parameters
        ----------
        body : Body or str
            Body to change.
        velocity : array_like of shape (3,) [m/s]
            Velocity of the origin of the body's axes. By default it stays, or, if a support holds a point of the body,
            the velocity of that point: a body on a hinge of the world then turns about the hinge.
        angular : array_like of shape (3,) [rad/s]
            Angular velocity in the axes of the world. By default it stays.

        Raises
        ------
        ValueError
            No body of this scene, a wrong shape, or a value that is not finite.

        See Also
        --------
        velocity : Velocity of a body.
        angular_velocity : Angular velocity of a body.
        """
        set_body_velocity(self._session, body, velocity, angular)

    def set_velocities(self, rod: Rod | str | None, velocities: npt.ArrayLike) -> None:
        """Set the velocities of the nodes of a rod.

        Supports impose their own velocity on their nodes in the next step; `reaction` then contains the impulse divided
        by the time step. If a rod and its support move together from the start, set the velocities here and the motion
        of the support by `move(path=)`.

        Parameters
        ----------
        rod : Rod or str or None
            Rod to change. None for every node of the scene.
        velocities : array_like of shape (nodes, 3) or (3,) [m/s]
            Velocities of the nodes, or one velocity for all.

        Raises
        ------
        ValueError
            A wrong shape, or a value that is not finite.

        See Also
        --------
        set_state : Set positions, velocities and directors.
        """
        set_velocities(self._session, rod, velocities)
