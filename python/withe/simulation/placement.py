"""What is put where while a simulation runs: supports, obstacles, rods."""

from __future__ import annotations

from typing import Any, Literal

import numpy.typing as npt

from withe.common.keywords import keyword_hints
from withe.parts.friction import Friction
from withe.parts.handles import NodeHandle, Obstacle, Rod, Support
from withe.parts.hands import Sliding, make_hand
from withe.parts.supports import make_clamp, make_pin
from withe.simulation.hands import RunningHand, feed_ring, find_hand
from withe.simulation.motion import PathLike, RotationLike
from withe.simulation.obstacles import find_obstacle, move_obstacle
from withe.simulation.session import Session
from withe.simulation.states import set_state, set_velocities
from withe.simulation.supports import hold as put_on
from withe.simulation.supports import move_support, release
from withe.simulation.surfaces import set_pair_friction, set_pair_restitution, set_pair_stiffness

__all__ = ["Placement"]


@keyword_hints
class Placement:
    """Methods of `Simulation` that hold, move and place; what they do is done by functions of the session."""

    _session: Session

    def clamp(
        self,
        node: NodeHandle | str,
        *,
        hold: Literal["frame", "edge"] = "frame",
        free: npt.ArrayLike | None = None,
        spin: bool = False,
        name: str | None = None,
    ) -> Support:
        """Hold a node where it is now, and the direction and roll of its rod. See `Scene.clamp`.

        Raises
        ------
        ValueError
            A node that is held already.
        """
        return put_on(self._session, make_clamp(self._session.directory, node, hold, free, spin, name))

    def pin(self, node: NodeHandle | str, *, free: npt.ArrayLike | None = None, name: str | None = None) -> Support:
        """Hold a node where it is now. See `Scene.pin`.

        Raises
        ------
        ValueError
            A node that is held already.
        """
        return put_on(self._session, make_pin(self._session.directory, node, free, name))

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
        """Take hold of a rod by a hand, where it is and as it is now: nothing jumps. See `Scene.grasp`.

        A hand that does not yield brings what it holds to rest, or to its own motion, within the next time step.

        Returns
        -------
        RunningHand
            A handle with methods of its own: ``move``, ``wrench``, ``release``, ``pose``, ``deflection``, of a ring
            ``passage`` and ``feed``.

        Raises
        ------
        ValueError
            As `Scene.grasp`.

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
        """A hand of this simulation, by its handle or name, with the methods of what `grasp` returns.

        Raises
        ------
        ValueError
            No hand, or released.

        Examples
        --------
        >>> _ = simulation.grasp(arm, at=0.2, name="left")
        >>> simulation.hand("left").release()
        """
        find_hand(self._session, hand)
        name = hand if isinstance(hand, str) else hand.name
        return RunningHand(self._session.directory.scene_id, name, self._session)

    def feed(self, ring: Support | str, rate: float) -> None:
        """Let the drive of a ring feed its rod from now on; see ``feed_rate`` of `Scene.grasp`.

        Parameters
        ----------
        ring : Hand or str
        rate : float [m/s]
            Undeformed length of the rod that goes through the ring towards its end; negative: back.

        Raises
        ------
        ValueError
            A ring without a drive, or released.
        """
        feed_ring(self._session, ring, rate)

    def release(self, support: Support | NodeHandle | str) -> None:
        """Let go of a node.

        Parameters
        ----------
        support : Support, NodeHandle or str
            A support, or the node that it holds.

        Raises
        ------
        ValueError
            Nothing holds that node.
        """
        release(self._session, support)

    def move(
        self,
        support: Support | NodeHandle | Obstacle | str,
        position: npt.ArrayLike | None = None,
        rotation: RotationLike | None = None,
        *,
        tangent: npt.ArrayLike | None = None,
        roll: float | None = None,
        over: float = 0.0,
        path: PathLike | None = None,
    ) -> None:
        """Move a support or an obstacle, or let it move along a path from now on.

        What is not given goes on as it does: a position, a tangent, a rotation or a roll that is on its way arrives
        when it was to arrive, and a path goes on in what else it gives.

        Parameters
        ----------
        support : Support, NodeHandle, Obstacle or str
            A support, the node that it holds, or a floor, plane, sphere or capsule: its position is that of the point
            of a plane, the centre of a sphere, the start of a capsule. What it does to rods is part of
            ``energy().work``.
        position : array_like of shape (3,) [m]
        rotation : array_like of shape (4,) or (3, 3), or a SciPy Rotation
            A unit quaternion (w, x, y, z), a matrix, or a Rotation.
            Relative to the orientation as drawn; of a hand, its axes in the world as columns.
        tangent : array_like of shape (3,)
            Where the rod is to point, instead: the smallest turn from the drawn tangent, and then ...
        roll : float [rad]
            ... a turn about it. Full turns count, and take time: at most half a turn in a time step. With
            integrator="static" they need no time: `equilibrium` and a step follow a roll of any size that is given
            without `over`. An obstacle turns so about the normal of a plane, the axis of a capsule from start to end,
            or the tangent that is given for a sphere: rollers, drums and turntables, which drag rods by friction. A
            belt is a plane that moves along itself.
        over : float [s]
            Reached after so long, evenly; within the next step by default.
        path : callable, pair of callables, or array_like of shape (poses, 4) or (poses, 8)
            Instead of all these: a function of time [s] that returns a position, a position and a
            rotation, or seven numbers x, y, z, qw, qx, qy, qz; or one for the position and one for the rotation, such
            as a CubicSpline and a RotationSpline of SciPy; of an obstacle, a function that returns a position and a
            roll (of a sphere, times the axis, shape (3,)). Or rows (t, x, y, z) or (t, x, y, z, qw, qx, qy, qz), times
            of the simulation [s] that grow, and unit quaternions with the scalar first: evenly from one to the next,
            at rest before the first and after the last. What a path does not give when it is set goes on as it did.
            `path` of a plan has such rows, and `withe.io.load_poses` reads them from tables of poses, which have the
            scalar last.

        Raises
        ------
        ValueError
            Nothing holds that node, a direction for a pin or an obstacle, or arguments that contradict each other.

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

    def set_friction(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, friction: Friction) -> None:
        """Give two rods, or a rod and an obstacle, another friction coefficient of their own. See `Scene.set_friction`.

        Raises
        ------
        ValueError
            Two obstacles, negative friction, or two coefficients for two rods.
        """
        set_pair_friction(self._session, a, b, friction)

    def set_restitution(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, restitution: float) -> None:
        """Give two rods, or a rod and an obstacle, another coefficient of restitution of their own.

        It acts from the next step on, on impacts that are under way too.

        Raises
        ------
        ValueError
            Two obstacles, or a number outside 0 to 1.

        Examples
        --------
        >>> simulation.set_restitution(arm, floor, 0.5)
        """
        set_pair_restitution(self._session, a, b, restitution)

    def set_contact_stiffness(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, stiffness: float) -> None:
        """Give two rods, or a rod and an obstacle, another contact stiffness of their own [N/m].

        What that does to the energy of surfaces that press is work of actuation; see `Scene.set_contact_stiffness`.

        Raises
        ------
        ValueError
            Two obstacles, or a stiffness that is not positive.

        Examples
        --------
        >>> simulation.set_contact_stiffness(arm, floor, 2e3)
        """
        set_pair_stiffness(self._session, a, b, stiffness)

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
        """Put a rod elsewhere, at once. What is not given stays as it is.

        Joints turn with the edges at them. The energy that this puts in does not count as work: the balance of
        ``energy()`` begins anew. What a rod whose nodes move touches is met anew, as in a drawing; other contacts go
        on. A state out of the plane of a planar simulation makes it three-dimensional, unless
        it was built with planar=True.

        Parameters
        ----------
        rod : Rod or str
        positions : array_like of shape (nodes, 3) [m]
            The first director of the first edge follows by the smallest turn. Nodes that a support holds must stay, or
            go to the position to which `move` moved the support without `over`.
        velocities : array_like of shape (nodes, 3) or (3,) [m/s]
            A support that moves otherwise stops the nodes that it holds, or carries them along, in the next step.
        twist : float or array_like of shape (stencils,) [rad/m]
            As `twists` reads it. By default that of now; a closed rod spreads evenly what new positions
            change of it, so that it is closed again.
        directors : array_like of shape (edges, 3, 3) or (edges, 3)
            Instead of twist: as `directors` reads them, or the first ones alone. Each stencil then has the least of
            the twists that fit, less than half a turn.
        spins : float or array_like of shape (edges,) [rad/s]
            Angular velocities of the edges about their tangents.

        Raises
        ------
        ValueError
            Wrong shapes, not finite, directors that are not normal to their edges, twist that does not close a
            closed rod, an edge without length, a rod that folds right back, a node that is held, surfaces that
            would overlap, or what leaves the plane of a simulation built with planar=True. Then nothing is changed.

        Examples
        --------
        >>> simulation.set_state(arm, spins=np.linspace(0.0, 5.0, 30))
        """
        set_state(self._session, rod, positions, velocities, twist, directors, spins)

    def set_velocities(self, rod: Rod | str | None, velocities: npt.ArrayLike) -> None:
        """Set the velocities of the nodes of a rod.

        A support that moves otherwise stops the nodes that it holds, or carries them along, in the next step:
        `reaction` contains that impulse divided by the duration of the time step. A rod and its support that move
        together from the start need both: the velocities here and the way of the support by `move(path=)`.

        Parameters
        ----------
        rod : Rod or str
            None for every node of the scene.
        velocities : array_like of shape (nodes, 3) or (3,) [m/s]

        Raises
        ------
        ValueError
            Wrong shape, or not finite.
        """
        set_velocities(self._session, rod, velocities)
