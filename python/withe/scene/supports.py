"""Supports of a scene: clamps, pins and hands."""

from __future__ import annotations

from typing import Any, Literal, cast

import numpy.typing as npt

from withe.common.keywords import keyword_hints
from withe.parts.directory import Directory
from withe.parts.handles import Body, Hand, NodeHandle, Rod, Support
from withe.parts.hands import Sliding, make_hand
from withe.parts.kinds import SupportPart
from withe.parts.supports import check_not_held, make_clamp, make_pin

__all__ = ["Supports"]


@keyword_hints
class Supports:
    """Clamps, pins and hands of a scene: methods of `Scene` that need its parts alone."""

    _directory: Directory

    def clamp(
        self,
        node: NodeHandle | Body | str,
        *,
        at: npt.ArrayLike | None = None,
        hold: Literal["frame", "edge"] = "frame",
        free: npt.ArrayLike | None = None,
        spin: bool | npt.ArrayLike = False,
        name: str | None = None,
    ) -> Support:
        """Fix the position of a node, and the direction and roll of its rod; or a rigid body.

        Parameters
        ----------
        node : NodeHandle, Body or str
            Node or body to clamp.
        at : array_like of shape (3,) [m]
            Point at which a body is held, as drawn. By default its centre of mass.
        hold : {"frame", "edge"}
            "frame" clamps the rod at the node, as a wall does. "edge" holds the end edge: both of its nodes and its
            angle.
        free : array_like of shape (3,) or (2, 3)
            Directions along which the clamp may slide.
        spin : bool, or array_like of shape (3,)
            True if the rod may spin about its tangent, whose direction stays held. For a body the axis about which it
            may turn: a hinge to the world.
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
        pin : Fix the position only.
        grasp : Hold a length of a rod by a hand.
        Simulation.move : Move the clamp.
        Simulation.reaction : Force and moment of the clamp.
        """
        return _hold(self._directory, make_clamp(self._directory, node, hold, free, spin, name, at))

    def pin(
        self,
        node: NodeHandle | Body | str,
        *,
        at: npt.ArrayLike | None = None,
        free: npt.ArrayLike | None = None,
        name: str | None = None,
    ) -> Support:
        """Fix the position of a node, or of a point of a rigid body. The rod or the body is free to turn.

        Arguments, return value and errors are those of `clamp`.

        Parameters
        ----------
        node : NodeHandle, Body or str
            Node or body to pin.
        at : array_like of shape (3,) [m]
            Point at which a body is held, as drawn. By default its centre of mass.
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
        Simulation.move : Move the pin.
        """
        return _hold(self._directory, make_pin(self._directory, node, free, name, at))

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
        by: Body | str | None = None,
        name: str | None = None,
    ) -> Hand:
        """Grasp a rod anywhere along its length by a hand.

        A hand holds every edge that its length covers, and at least one, as one rigid piece with the present shape.
        With `stiffness` the hand is compliant and holds the edges by a bed of springs along its length. The springs
        also resist rotation, with k length^2 / 12 for stiffness k across the rod, in addition to the given stiffness.
        Their energy is part of `energy().spring`; the work of hands is part of ``energy().work``.
        `Simulation.move`, `release`, `wrench`, `deflection` and `pose` accept hands.

        Parameters
        ----------
        rod : Rod or str
            Rod to grasp.
        at : float [m]
            Undeformed arc length from the start of the rod to the middle of the hand.
        length : float [m]
            Undeformed length of the rod that is held. With 0 the hand holds one point.
        pose : pair of array_like of shape (3,) [m] and rotation, array_like of shape (7,) or (4, 4)
            Position and axes of the hand in the world. A rotation is a matrix of shape (3, 3) or a SciPy Rotation.
            Seven numbers are x, y, z, qw, qx, qy, qz; a matrix of shape (4, 4) is homogeneous. By default the hand is
            at the point of the rod, with the axes d1, d2 and tangent.
        stiffness : pair, or array_like of shape (6,) [N/m, N m/rad]
            Stiffness along d1, d2 and the tangent of the held rod, and about these axes. Each item of a pair is one
            number for all three axes, or three numbers. By default the hand is rigid.
        force_limit : float [N]
            Force above which the rod slips through a compliant hand, as with dry friction, or a drive slips.
        slides : bool
            True for a ring, through which the rod slides. A ring holds the rod across by one stiffness [N/m], by
            default the stretching stiffness of an edge, but neither along the rod nor its direction. If the end of the
            rod passes the ring, the ring is released with a `RingLeftWarning`.
        friction : float [-]
            Coulomb friction coefficient of a ring without a drive.
        feed_rate : float [m/s]
            Undeformed length per time that a drive in the ring feeds towards the end of the rod. 0 holds the rod;
            ``hand.feed`` changes the rate.
        by : Body or str
            Rigid body that carries a ring, at the point where the rod is drawn at `at`. The ring pulls the body as it
            pulls the rod. By default the ring is in the world.
        name : str
            Name of the hand. By default "hand 1", ...

        Returns
        -------
        Hand

        Raises
        ------
        ValueError
            A place off the rod, an edge that is already held, or a node that a clamp or pin holds. A stiffness or
            force limit that is not positive, negative friction, friction of a driven ring, or a ring option without
            ``slides=True``. A body for a hand that is no ring, or a pose with a body. Two hands may hold neighbouring
            edges; the first hand holds their common node.

        See Also
        --------
        clamp : Clamp a node.
        Simulation.wrench : Force and moment of a hand.
        Simulation.feed : Change the feed rate of a drive.

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> rope = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=41, radius=0.01, material=rubber, name="rope")
        >>> scene.grasp(rope, at=0.5, length=0.02, stiffness=(1e3, 1.0), force_limit=5.0)
        Hand(name='hand 1')
        """
        sliding = Sliding(slides, friction, feed_rate)
        part = make_hand(self._directory, rod, at, length, pose, stiffness, force_limit, sliding, name, by)
        return cast(Hand, _hold(self._directory, part))


def _hold(directory: Directory, part: SupportPart) -> Support:
    check_not_held(directory, part, directory.all(SupportPart))
    return cast(Support, directory.add(part))
