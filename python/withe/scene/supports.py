"""What holds the rods of a scene."""

from __future__ import annotations

from typing import Any, Literal, cast

import numpy.typing as npt

from withe.common.keywords import keyword_hints
from withe.parts.directory import Directory
from withe.parts.handles import Hand, NodeHandle, Rod, Support
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
        node: NodeHandle | str,
        *,
        hold: Literal["frame", "edge"] = "frame",
        free: npt.ArrayLike | None = None,
        spin: bool = False,
        name: str | None = None,
    ) -> Support:
        """Hold a node in place, and the direction and roll of its rod.

        Parameters
        ----------
        node : NodeHandle or str
        hold : {"frame", "edge"}
            Clamp the rod at the node itself, as a wall does, or hold its end edge: both its nodes and
            its angle.
        free : array_like of shape (3,) or (2, 3)
            Directions along which the clamp may slide.
        spin : bool
            Whether it may turn about the rod's tangent, which it goes on holding.
        name : str

        Returns
        -------
        Support

        Raises
        ------
        ValueError
            A node that is held already.
        """
        return _hold(self._directory, make_clamp(self._directory, node, hold, free, spin, name))

    def pin(self, node: NodeHandle | str, *, free: npt.ArrayLike | None = None, name: str | None = None) -> Support:
        """Hold a node in place, and leave its rod free to turn.

        Arguments, result and refusals are those of `clamp`.
        """
        return _hold(self._directory, make_pin(self._directory, node, free, name))

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
    ) -> Hand:
        """Take hold of a rod by a hand, anywhere along it.

        The hand holds every edge that its length touches: a short one that between two nodes. They are held as one
        rigid piece, of the shape that it has then. A hand that yields holds them by a bed of springs as long
        as itself instead; what springs resist a turn of a long hand by, k length^2 / 12 for stiffness k across it,
        adds to the stiffness about. Its energy is in `energy().spring`, and what hands do in ``energy().work``.
        `Simulation.move`, `release`, `wrench`, `deflection` and `pose` take it.

        Parameters
        ----------
        rod : Rod or str
        at : float [m]
            Arc length from the start of the rod, undeformed.
        length : float [m]
            Of the rod that is held, half of it on either side. With 0 a point.
        pose : pair of array_like of shape (3,) [m] and rotation, array_like of shape (7,) or (4, 4)
            Where the hand is: its position and its axes in the world. A rotation is a matrix of shape (3, 3) or a SciPy
            Rotation; seven numbers are x, y, z, qw, qx, qy, qz, a matrix is homogeneous. By default
            the hand is at the rod's point, and its axes are d1, d2 and the tangent there.
        stiffness : pair, or array_like of shape (6,) [N/m, N m/rad]
            Along d1, d2 and the tangent of what is held, and about them; of a pair each is one number for all three
            or three. By default the hand does not yield.
        force_limit : float [N]
            Beyond which what is held slips through a hand that yields, as dry friction lets it; or a drive.
        slides : bool
            Whether it is a ring, which the rod passes through: it holds the rod across, by one stiffness [N/m], and
            neither along itself nor its direction. By default it is as stiff as an edge there is to stretching.
            Two rings hold a direction. Rods leave a ring whose end passes it, with a `RingLeftWarning`.
        friction : float
            Coulomb's coefficient of a ring that is not driven.
        feed_rate : float [m/s]
            Of a drive in the ring, which holds the rod along itself: by how much of its undeformed length it feeds the
            rod towards its end, forwards through the ring. 0 holds it, until ``hand.feed`` sets another.
        name : str

        Returns
        -------
        Hand

        Raises
        ------
        ValueError
            Off the rod, an edge that is held already (two hands may hold neighbours: who came first holds the node
            between them), a node that a clamp or a pin holds, a stiffness or force limit that is not positive,
            friction that is negative, friction of a ring that is driven, or either without a ring.

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
        part = make_hand(self._directory, rod, at, length, pose, stiffness, force_limit, sliding, name)
        return cast(Hand, _hold(self._directory, part))


def _hold(directory: Directory, part: SupportPart) -> Support:
    check_not_held(directory, part, directory.all(SupportPart))
    return cast(Support, directory.add(part))
