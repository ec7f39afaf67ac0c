"""Hands of a simulation, with methods to move, read and release them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.handles import Hand, Handle
from withe.parts.kinds import Grasp, SupportPart
from withe.simulation.motion import POSE_WORDS, PathLike, RotationLike
from withe.simulation.readers import OfRun, Reader, of_equilibrium
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
    "set_support",
    "support_pose",
    "support_reader",
    "support_value",
]

FloatArray = npt.NDArray[np.float64]


class HeldPose(NamedTuple):
    """Pose of a support.

    Attributes
    ----------
    position : ndarray of shape (3,) [m]
    rotation : ndarray of shape (3, 3)
        For a hand: its axes as columns. For a clamp: its rotation since the drawing.
    """

    position: FloatArray
    rotation: FloatArray


class Deflection(NamedTuple):
    """Displacement of the held part of the rod relative to the hand, in the axes of the hand; the mean for a long hand.

    Attributes
    ----------
    shift : ndarray of shape (3,) [m]
        Elastic displacement, which the stiffness resists.
    turn : ndarray of shape (3,) [rad]
        Elastic rotation, as a rotation vector.
    slip : ndarray of shape (3,) [m]
        Additional slip beyond the force limit.
    """

    shift: FloatArray
    turn: FloatArray
    slip: FloatArray


class Passage(NamedTuple):
    """Passage of a rod through a ring.

    Attributes
    ----------
    at : float [m]
        Undeformed arc length of the rod at the ring.
    pull : float [N]
        Force of friction or a drive along the rod, positive backwards. 0 if no force acts along the rod.
    press : float [N]
        Transverse force on the rod.
    feed_rate : float or None [m/s]
        Feed rate of the drive; None without a drive.
    """

    at: float
    pull: float
    press: float
    feed_rate: float | None


@keyword_hints
@dataclass(frozen=True)
class RunningHand(Hand):
    """A hand of a simulation, as `Simulation.grasp` returns it: a handle with methods that act on this simulation.

    Copies and pickles are plain handles. A copy of the simulation has a hand of the same name:
    ``copy.hand(hand.name)``.

    See Also
    --------
    Simulation.grasp : Make a hand.
    Hand : The plain handle, which scenes return.

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
        """Return the pose of the hand. See `Simulation.pose`.

        Raises
        ------
        ValueError
            The hand was released.
        """
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
        """Move the hand. See `Simulation.move`; `rotation` has the axes of the hand in the world.

        Parameters
        ----------
        position : array_like of shape (3,) [m]
            Target position.
        rotation : array_like of shape (4,) or (3, 3), or a SciPy Rotation
            Axes of the hand in the world: a unit quaternion (w, x, y, z), a matrix or a Rotation.
        tangent : array_like of shape (3,)
            Target direction of the rod, instead of a rotation.
        roll : float [rad]
            Rotation about the tangent.
        over : float [s]
            Duration of the ramp to the target. By default the target is reached within the next step.
        path : callable, pair of callables, or array_like of shape (poses, 4) or (poses, 8)
            Path, instead of the targets above.

        Raises
        ------
        ValueError
            The hand was released, or arguments contradict each other.
        """
        move_support(self.session, self, position, rotation, tangent, roll, over, path)

    def wrench(self, about: npt.ArrayLike | None = None) -> Reaction:
        """Return the total force and moment of the hand on the rod. See `Simulation.wrench`.

        Parameters
        ----------
        about : array_like of shape (3,) [m]
            Point about which the moment is taken. By default the position of the hand.

        Returns
        -------
        Reaction
            Force of shape (3,) [N] and moment of shape (3,) [N m].

        Raises
        ------
        ValueError
            The hand was released.
        """
        return hand_wrench(self.session, self, about)

    @property
    def deflection(self) -> Deflection:
        """Return the displacement of the rod in the hand. See `Simulation.deflection`.

        Raises
        ------
        ValueError
            The hand was released.
        """
        return hand_deflection(self.session, self)

    @property
    def passage(self) -> Passage:
        """Return the passage of the rod through this ring. See `Simulation.passage`.

        Raises
        ------
        ValueError
            Not a ring, or one that was released or left by its rod.
        """
        return ring_passage(self.session, self)

    def feed(self, rate: float) -> None:
        """Set the feed rate. See `Simulation.feed`.

        Parameters
        ----------
        rate : float [m/s]
            Undeformed length per time that is fed towards the end of the rod.

        Raises
        ------
        ValueError
            A hand without a drive, or a released one.
        """
        feed_ring(self.session, self, rate)

    def release(self) -> None:
        """Release the rod. See `Simulation.release`.

        Raises
        ------
        ValueError
            The hand was released before.
        """
        release(self.session, self)


def find_hand(session: Session, hand: Handle | str) -> int:
    """Return the index of a hand in the engine.

    Raises
    ------
    ValueError
        Not a hand, or a released one.
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
    """Set the feed rate of a ring; see `Simulation.feed`."""
    index, grasp = _find_ring(session, hand)
    name = hand if isinstance(hand, str) else hand.name
    if grasp.feed_rate is None:
        raise ValueError(f"hand {name!r} has no drive: use grasp with slides=True and feed_rate=0")
    session.world.feed(index, validation.number(rate, f"rate of {name!r}"))


def ring_friction(session: Session, ring: Handle | str) -> float:
    """Return the friction coefficient of a ring."""
    return _find_ring(session, ring)[1].friction


def set_ring_friction(session: Session, ring: Handle | str, friction: float) -> None:
    """Set the friction coefficient of a ring without a drive."""
    index, grasp = _find_ring(session, ring)
    session.world.set_ring_friction(index, friction)
    name = ring if isinstance(ring, str) else ring.name
    part = replace(session.settings.supports[name][1], grasp=replace(grasp, friction=friction))
    session.settings.supports[name] = index, part
    session.directory.parts[name] = part


def forget_left_rings(session: Session, left: Iterable[tuple[int, float]]) -> None:
    """Note rings that the engine has released, by index and time, because their rods have left them."""
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


def set_support(session: Session, part: SupportPart, values: dict[str, Any], over: float) -> None:
    """Move a support over a duration [s], or within the next step; or change the friction of a ring."""
    friction = None
    if "friction" in values:
        friction = validation.non_negative(values["friction"], f"friction of {part.name!r}")
        find_support(session, part.name)
    if values.keys() & set(POSE_WORDS):
        move_support(session, part.name, values.get("position"), values.get("rotation"), None, None, over, None)
    if friction is not None:
        set_ring_friction(session, part.name, friction)


def support_value(session: Session, part: SupportPart, word: str) -> Any:
    """Return the pose of a support, or the friction of a ring."""
    if word not in POSE_WORDS:
        return ring_friction(session, part.name)
    pose = support_pose(session, part.name)
    return pose.position if word == "position" else pose.rotation


def support_reader(session: Session, part: SupportPart, word: str) -> Reader:
    """Return the reader of the derivative by the pose of a support, or by the stiffness of a hand."""
    if word in POSE_WORDS:
        return _pose_reader(session, part, word)
    return _hand_reader(session, part, word)


def _pose_reader(session: Session, part: SupportPart, word: str) -> Reader:
    index = session.settings.supports[part.name][0]

    def read(gradient: _core.EquilibriumGradient | OfRun) -> FloatArray:
        found = of_equilibrium(gradient, part.name)
        return np.array(found.support_positions[index] if word == "position" else found.support_rotations[index])

    return read


def _hand_reader(session: Session, part: SupportPart, word: str) -> Reader:
    grasp = part.grasp
    if grasp is None or grasp.stiffness is None:
        raise ValueError(
            f"{part.name!r} has no {word} to differentiate by, because {part.name!r} is not a hand that yields"
        )
    if grasp.slides:
        raise ValueError(
            f"no gradient with respect to the {word} of {part.name!r} is available, because {part.name!r} is a ring"
        )
    index = session.settings.supports[part.name][0]
    if word == "stiffness":
        return lambda g: np.array(g.parameters.hand_stiffness[index])
    if not np.isfinite(grasp.force_limit):
        raise ValueError(f"{part.name!r} has no force_limit to differentiate by")
    return lambda g: float(g.parameters.hand_limit[index])
