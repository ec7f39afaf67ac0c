"""Hands of a simulation: put on, moved, read and taken off by their own methods."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.handles import Hand, Handle
from withe.parts.kinds import Grasp
from withe.simulation.motion import PathLike, RotationLike
from withe.simulation.readouts import Reaction
from withe.simulation.session import Session
from withe.simulation.supports import find_support, forget, move_support, release

__all__ = [
    "Deflection",
    "HeldPose",
    "Passage",
    "RunningHand",
    "feed_ring",
    "find_hand",
    "forget_left_rings",
    "hand_deflection",
    "hand_wrench",
    "ring_friction",
    "ring_passage",
    "set_ring_friction",
    "support_pose",
]

FloatArray = npt.NDArray[np.float64]


class HeldPose(NamedTuple):
    """Pose of a support.

    Attributes
    ----------
    position : ndarray of shape (3,) [m]
    rotation : ndarray of shape (3, 3)
        Of a hand: its axes as columns. Of a clamp: from the orientation as drawn.
    """

    position: FloatArray
    rotation: FloatArray


class Deflection(NamedTuple):
    """Displacement of the held part of the rod relative to the hand, in the hand's axes; the mean of a long hand.

    Attributes
    ----------
    shift : ndarray of shape (3,) [m]
        Which the stiffness resists.
    turn : ndarray of shape (3,) [rad]
        As a rotation vector.
    slip : ndarray of shape (3,) [m]
        By how much it has slipped besides, beyond the force limit.
    """

    shift: FloatArray
    turn: FloatArray
    slip: FloatArray


class Passage(NamedTuple):
    """Passage of a rod through a ring.

    Attributes
    ----------
    at : float [m]
        Arc length of the rod where the ring is, undeformed.
    pull : float [N]
        Of friction or a drive, backwards along the rod; negative: forwards. 0 where nothing holds the rod along itself.
    press : float [N]
        Force across the rod.
    feed_rate : float or None [m/s]
        Of the drive; None without one.
    """

    at: float
    pull: float
    press: float
    feed_rate: float | None


@keyword_hints
@dataclass(frozen=True)
class RunningHand(Hand):
    """A hand of a simulation, as `Simulation.grasp` returns it: its handle, which acts on that simulation.

    Copies and pickles are plain handles. A copy of the simulation has a hand of the same name:
    ``copy.hand(hand.name)``.

    Examples
    --------
    >>> hand = simulation.grasp(arm, at=0.2, length=0.02)
    >>> hand.move(position=hand.pose.position + (0, 0, 0.1), over=0.5)
    >>> simulation.step(10)
    >>> hand.wrench().force.shape
    (3,)
    >>> hand.release()
    """

    session: Session = field(repr=False, compare=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return Hand, (self.scene_id, self.name)

    @property
    def pose(self) -> HeldPose:
        """Return the pose of the hand. See `Simulation.pose`."""
        return support_pose(self.session, self)

    def move(
        self,
        position: npt.ArrayLike | None = None,
        rotation: RotationLike | None = None,
        *,
        tangent: npt.ArrayLike | None = None,
        roll: float | None = None,
        over: float = 0.0,
        path: PathLike | None = None,
    ) -> None:
        """Move the hand. See `Simulation.move`; its rotation is that of its axes in the world."""
        move_support(self.session, self, position, rotation, tangent, roll, over, path)

    def wrench(self, about: npt.ArrayLike | None = None) -> Reaction:
        """Force and moment of the hand on the rod, as one. See `Simulation.wrench`."""
        return hand_wrench(self.session, self, about)

    @property
    def deflection(self) -> Deflection:
        """Return the displacement of the rod in the hand. See `Simulation.deflection`."""
        return hand_deflection(self.session, self)

    @property
    def passage(self) -> Passage:
        """Return the passage of the rod through this ring. See `Simulation.passage`."""
        return ring_passage(self.session, self)

    def feed(self, rate: float) -> None:
        """Feed the rod at a rate from now on. See `Simulation.feed`."""
        feed_ring(self.session, self, rate)

    def release(self) -> None:
        """Let go. See `Simulation.release`."""
        release(self.session, self)


def find_hand(session: Session, hand: Handle | str) -> int:
    """Index of a hand in the engine.

    Raises
    ------
    ValueError
        No hand, or released.
    """
    index, part = find_support(session, hand)
    if part.grasp is None:
        raise ValueError(f"hand must be a hand returned by grasp, got the support {part.name!r}")
    return index


def hand_wrench(session: Session, hand: Handle | str, about: npt.ArrayLike | None) -> Reaction:
    """Force and moment of a hand on the rod; see `Simulation.wrench`."""
    index = find_hand(session, hand)
    found = session.world.reaction(index)
    force, moment = np.array(found.force), np.array(found.moment)
    if about is not None:
        point = validation.vector(about, "about")
        moment += np.cross(np.array(session.world.support_position(index)) - point, force)
    return Reaction(force, moment)


def hand_deflection(session: Session, hand: Handle | str) -> Deflection:
    """Return the displacement of the rod in a hand; see `Simulation.deflection`."""
    found = session.world.deflection(find_hand(session, hand))
    return Deflection(np.array(found.shift), np.array(found.turn), np.array(found.slip))


def ring_passage(session: Session, hand: Handle | str) -> Passage:
    """Return the passage of a rod through a ring; see `Simulation.passage`."""
    index, grasp = _find_ring(session, hand)
    found = session.world.passage(index)
    return Passage(found.at, found.pull, found.press, None if grasp.feed_rate is None else found.feed_rate)


def feed_ring(session: Session, hand: Handle | str, rate: float) -> None:
    """Set what a drive feeds; see `Simulation.feed`."""
    index, grasp = _find_ring(session, hand)
    name = hand if isinstance(hand, str) else hand.name
    if grasp.feed_rate is None:
        raise ValueError(f"hand {name!r} has no drive: use grasp with slides=True and feed_rate=0")
    session.world.feed(index, validation.number(rate, f"rate of {name!r}"))


def ring_friction(session: Session, ring: Handle | str) -> float:
    """Coefficient of friction of a ring."""
    return _find_ring(session, ring)[1].friction


def set_ring_friction(session: Session, ring: Handle | str, friction: float) -> None:
    """Set it, of a ring without a drive."""
    index, grasp = _find_ring(session, ring)
    session.world.set_ring_friction(index, friction)
    name = ring if isinstance(ring, str) else ring.name
    part = replace(session.settings.supports[name][1], grasp=replace(grasp, friction=friction))
    session.settings.supports[name] = index, part
    session.directory.parts[name] = part


def forget_left_rings(session: Session, left: Iterable[tuple[int, float]]) -> None:
    """Note that the engine has released rings, by their index and when, since rods have left them."""
    for released, time in left:
        name, part = next((n, part) for n, (index, part) in session.settings.supports.items() if index == released)
        forget(session, part)
        session.left_rings.append((name, time))


def _find_ring(session: Session, hand: Handle | str) -> tuple[int, Grasp]:
    index, part = find_support(session, hand)
    if part.grasp is None or not part.grasp.slides:
        raise ValueError(f"hand must be a ring returned by grasp(slides=True), got {part.name!r}")
    return index, part.grasp


def support_pose(session: Session, support: Handle | str) -> HeldPose:
    """Return the pose of a support; see `Simulation.pose`."""
    index, _ = find_support(session, support)
    world = session.world
    return HeldPose(np.array(world.support_position(index)), np.array(world.support_rotation(index)))
