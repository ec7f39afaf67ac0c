"""Cables tied into knots: laid down one after the other, then picked and placed by grippers at given points."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.deprecation import renamed
from withe.deployment.cable import JAW
from withe.deployment.deploying import DRAWN, drawn_setup
from withe.deployment.planning import LayPlan
from withe.deployment.world import Setup, hung, jaw_path, jaw_stiffness
from withe.parts.handles import Rod
from withe.recording import Record
from withe.recording.recorder import Recorder
from withe.simulation import Simulation
from withe.simulation.hands import RunningHand
from withe.simulation.outlines import outlines_of

__all__ = ["Move", "Tying", "tie"]

FloatArray = npt.NDArray[np.float64]
_OPENING = 0.012  # [m], greatest distance at which a gripper still grasps a cable
_HIGHER = 1.2  # [m], additional height of a hanging cable above the one that is laid before it
_LOWERED = 3.0  # [s], time of its lowering
_RESTS = 0.5  # [s], after grippers have opened
_LEG = 2.0  # [s] from point to point
_RECORD_EVERY = 0.1  # [s]


@dataclass(frozen=True)
class Move:
    """Move of one gripper: it grips a cable, carries it from point to point, and releases it.

    Parameters
    ----------
    cable : int
        Index of the cable, in the order of the plans.
    at : float [m]
        Arc length from the free end of the cable to the grip.
    by : array_like of shape (legs, 3) [m]
        End of each leg, relative to the grip on the lying cable; z is up. A leg takes two seconds.
    turn : array_like of shape (legs,) [rad]
        Rotation of the gripper about the vertical after each leg. By default none.

    Raises
    ------
    ValueError
        A negative cable or arc length, a wrong shape, or values that are not finite.
    """

    cable: int
    at: float
    by: npt.ArrayLike
    turn: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "cable", validation.integer(self.cable, "cable of a move", 0, 100))
        object.__setattr__(self, "at", validation.non_negative(self.at, "at of a move"))
        by = validation.number_array(self.by, "by of a move", ("legs", 3))
        turn = np.zeros(len(by)) if self.turn is None else self.turn
        object.__setattr__(self, "by", by)
        object.__setattr__(self, "turn", validation.number_array(turn, "turn of a move", (len(by),)))


@dataclass(frozen=True)
class Tying:
    """Result of tying: the laid cables.

    Attributes
    ----------
    names : tuple of str
        Names of the stages: "laid 0", ..., "step 0", ...
    shapes : tuple of tuple of ndarray of shape (nodes, 3) [m]
        Centrelines after each stage, cable by cable, with all grippers open.
    picks : tuple of tuple of ndarray of shape (3,) [m]
        Positions that the grippers reached for, step by step.
    missed : tuple of (int, int)
        Step and move of each gripper that found no cable.
    record : Record
        Record of the whole motion, about every tenth of a second, with the rods "cable 0", "cable 1", ...
    """

    names: tuple[str, ...]
    shapes: tuple[tuple[FloatArray, ...], ...]
    picks: tuple[tuple[FloatArray, ...], ...]
    missed: tuple[tuple[int, int], ...]
    record: Record

    @property
    def centrelines(self) -> tuple[FloatArray, ...]:
        """Final centrelines, each of shape (nodes, 3) [m], from the free ends. `withe.knots` identifies their knot."""
        return self.shapes[-1]


@renamed(floor="friction")
def tie(
    plans: Sequence[LayPlan],
    steps: Sequence[Sequence[Move]],
    *,
    friction: float,
    picks: Sequence[Sequence[npt.ArrayLike]] | None = None,
    seed: int = 0,
    noise: float = 0.0,
    nodes: int = 130,
    time_step: float = 0.01,
) -> Tying:
    """Lay cables on one floor, one after the other, then pick and place them.

    Everything runs in the rod engine, in time, as in `deploy`. All grippers of a step begin together and go from point
    to point together. One may therefore lift a strand while another leads an end below it. Grippers have no sensors.
    Without `picks` each gripper grips its cable where the cable is, which is a rehearsal. With the picks of a rehearsal
    it reaches there, and grips a cable within 12 mm, or nothing.

    Parameters
    ----------
    plans : sequence of LayPlan
        One plan per cable; later cables are laid over earlier ones.
    steps : sequence of sequences of Move
        Moves of each step.
    friction : float [-]
        Friction coefficient of cables with the floor and each other.
    picks : sequence of sequences of array_like of shape (3,) [m], optional
        `Tying.picks` of a rehearsal.
    seed, noise
        Seed and noise, as in `deploy`. Deviations are drawn for each cable and its gripper, and once for friction.
    nodes : int
        Number of nodes of each cable, 20 to 2000.
    time_step : float [s]
        Time step.

    Returns
    -------
    Tying

    Raises
    ------
    ValueError
        Not a plan, a move of a missing cable or beyond the end of a cable, or moves of one step with different numbers
        of legs. Also picks that do not match the steps, friction that is not positive, or negative noise.
    """
    _check(plans, steps, picks)
    friction = validation.positive(friction, "friction")
    noise = validation.non_negative(noise, "noise")
    random = np.random.default_rng(validation.integer(seed, "seed", 0, 2**63 - 1))
    setups = [
        drawn_setup(
            plan,
            plan.cable,
            friction,
            noise * random.normal(size=DRAWN),
            nodes=validation.integer(nodes, "nodes", 20, 2000),
            time_step=validation.positive(time_step, "time_step"),
            quasi_static=False,
        )
        for plan in plans
    ]
    table = _Table(plans, setups)
    for number in range(len(plans)):
        table.lay(number)
    for number, step in enumerate(steps):
        table.carry(number, step, None if picks is None else [np.asarray(pick, float) for pick in picks[number]])
    return Tying(tuple(table.names), tuple(table.shapes), tuple(table.picks), tuple(table.missed), table.end_record())


def _check(
    plans: Sequence[LayPlan], steps: Sequence[Sequence[Move]], picks: Sequence[Sequence[npt.ArrayLike]] | None
) -> None:
    if isinstance(plans, LayPlan) or not plans or not all(isinstance(plan, LayPlan) for plan in plans):
        raise ValueError(f"plans must be one or more withe.deployment.LayPlan in a list, got {plans!r:.80}")
    for number, step in enumerate(steps):
        if isinstance(step, Move):
            raise ValueError(f"step {number} must be a list of simultaneous moves, got one Move")
        for move in step:
            if not isinstance(move, Move):
                raise ValueError(f"step {number} must hold withe.deployment.Move, got {move!r:.80}")
            if move.cable >= len(plans):
                raise ValueError(f"cable of step {number} must be less than {len(plans)}, got {move.cable}")
            longest = plans[move.cable].cable.length + 0.5 * JAW
            if move.at > longest:
                raise ValueError(
                    f"step {number} must hold cable {move.cable} at most at {longest:.4g} m, where its jaw is, got "
                    f"{move.at:g} m"
                )
        if len({len(np.asarray(move.by)) for move in step}) > 1:
            raise ValueError(f"moves of step {number} must have the same number of legs")
    if picks is not None and [len(step) for step in steps] != [len(step) for step in picks]:
        raise ValueError("picks must be one for each move of each step")


class _Table:
    """The floor, its lying and hanging cables, and the moves so far."""

    def __init__(self, plans: Sequence[LayPlan], setups: Sequence[Setup]) -> None:
        self.plans, self.setups = plans, setups
        self.heights = [_HIGHER * number for number in range(len(plans))]
        self.simulation: Simulation
        self.cables: list[Rod]
        self.jaws: list[RunningHand]
        self.simulation, self.cables, self.jaws = hung(setups, plans, self.heights)
        self.names: list[str] = []
        self.shapes: list[tuple[FloatArray, ...]] = []
        self.picks: list[tuple[FloatArray, ...]] = []
        self.missed: list[tuple[int, int]] = []
        self._recorder = Recorder(self.simulation, None, *outlines_of(self.simulation._session.directory))
        self._recorder.capture()
        self._next_frame = _RECORD_EVERY

    def end_record(self) -> Record:
        """Take the last frame, and return the record."""
        self._recorder.capture()
        return self._recorder.record

    def _run(self, duration: float) -> None:
        """Advance, and record frames beyond the end of single runs."""
        self.simulation.run(duration, record_every=math.inf, before_step=self._capture_when_due, progress=False)

    def _capture_when_due(self, simulation: Simulation) -> None:
        if simulation.time >= self._next_frame:
            self._recorder.capture()
            self._next_frame = simulation.time + _RECORD_EVERY

    def lay(self, number: int) -> None:
        """Lower a cable to where its motion begins, lay it, and let go."""
        jaw, plan, height = self.jaws[number], self.plans[number], self.heights[number]
        lowered = _LOWERED if height > 0.0 else 0.0
        begin = self.simulation.time
        path = jaw_path(self.setups[number], plan, jaw.pose.rotation)

        def at(time: float) -> tuple[FloatArray, object]:
            position, rotation = path(time - begin - lowered)
            left = 1.0 - _smooth((time - begin) / lowered) if lowered else 0.0
            return position + np.array([0.0, 0.0, height * left]), rotation

        jaw.move(path=at)
        self._run(lowered + float(plan.times[-1]))
        jaw.release()
        self._rest(f"laid {number}")

    def carry(self, number: int, step: Sequence[Move], picks: list[FloatArray] | None) -> None:
        """Take hold, carry all together, and let go."""
        reached, hands = [], []
        for index, move in enumerate(step):
            pick, hand = self._taken(move, None if picks is None else picks[index], f"step {number} move {index}")
            reached.append(pick)
            if hand is None:
                self.missed.append((number, index))
                continue
            hand.move(path=_legs(hand, self.simulation.time, np.asarray(move.by), np.asarray(move.turn)))
            hands.append(hand)
        self.picks.append(tuple(reached))
        self._run(_LEG * max((len(np.asarray(move.by)) for move in step), default=0))
        for hand in hands:
            hand.release()
        self._rest(f"step {number}")

    def _taken(self, move: Move, pick: FloatArray | None, name: str) -> tuple[FloatArray, RunningHand | None]:
        """Return the position that a gripper reaches, and the hand that holds the cable there."""
        setup, cable = self.setups[move.cable], self.cables[move.cable]
        points, s = self.simulation.positions(cable), setup.arc_length
        if pick is None:
            at = move.at
            pick = np.array([np.interp(at, s, points[:, axis]) for axis in range(3)])
        else:
            away = np.linalg.norm(points[:, :2] - (pick + np.array(setup.jaw_offset))[:2], axis=1)
            if away.min() > _OPENING:
                return pick, None
            at = float(s[away.argmin()])
        at = float(np.clip(at, 0.5 * JAW, s[-1] - 0.5 * JAW))
        return pick, self.simulation.grasp(cable, at=at, length=JAW, stiffness=jaw_stiffness(setup.cable), name=name)

    def _rest(self, name: str) -> None:
        self._run(_RESTS)
        self.names.append(name)
        self.shapes.append(tuple(self.simulation.positions(cable) for cable in self.cables))


def _smooth(share: float) -> float:
    """From 0 to 1, at rest at both ends."""
    u = min(max(share, 0.0), 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _legs(hand: RunningHand, begin: float, by: FloatArray, turn: FloatArray) -> Callable[[float], Any]:
    """Pose by time, at rest after each leg."""
    from scipy.spatial.transform import Rotation

    place, held = np.array(hand.pose.position), Rotation.from_matrix(hand.pose.rotation)
    points, angles = np.concatenate([np.zeros((1, 3)), by]), np.concatenate([[0.0], turn])

    def at(time: float) -> tuple[FloatArray, object]:
        legs = min(max((time - begin) / _LEG, 0.0), len(by) - 1e-9)
        leg = int(legs)
        share = _smooth(legs - leg)
        moved = points[leg] + share * (points[leg + 1] - points[leg])
        turned = angles[leg] + share * (angles[leg + 1] - angles[leg])
        return place + moved, Rotation.from_rotvec([0.0, 0.0, turned]) * held

    return at
