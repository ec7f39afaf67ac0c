"""Calls that set values during a differentiable run, and gradients by these values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.contacts import BodyPair
from withe.parts.kinds import DragPart, LoadPart, Part, RodPart
from withe.parts.parameters import ACTING_WORDS, NATURAL_WORDS
from withe.parts.table import kind_of
from withe.simulation.access import reader_of, word_of, words_of
from withe.simulation.drawn import DrawnNodes
from withe.simulation.motion import POSE_WORDS
from withe.simulation.moves import Way
from withe.simulation.numbers import number_of, parameter_of
from withe.simulation.obstacles import find_obstacle
from withe.simulation.overlaps import OF_DRAGS, made_by
from withe.simulation.readers import OfRun, Reader
from withe.simulation.rods import edges_of, rod_slopes, sum_of_slopes
from withe.simulation.session import Session
from withe.simulation.surroundings import dragged_rods
from withe.simulation.unknowns import Remaining, part_of

__all__ = ["CallGradient", "Gradients", "Ledger", "RunJournal"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CallGradient:
    """Derivatives of a scalar of a run by the values of one call during the run.

    Attributes
    ----------
    time : float [s]
        Time of the call.
    call : {"set", "move"}
    target : str or None
        Name of the part, or of both bodies ("arm, floor"); None: the scene.
    over : float [s]
        Duration of the ramp to the value; 0 without a ramp.
    gradients : dict
        For each word: the derivative of L by the value of the call, in the shape of this value. It includes only the
        time in which the value acted. For discrete_curvature the key is natural_curvature, and the derivative is by the
        curvature [1/m] of every stencil. For a rotation it is by a rotation vector, (3,) [1/rad], that turns the
        target. Words without a gradient are missing (functions of time, paths, tangents and rolls, a friction of 0).
    """

    time: float
    call: str
    target: str | None
    over: float
    gradients: dict[str, Any]


class Gradients(list[Any]):
    """Derivatives of a scalar of a run, one for each of `wrt`.

    Attributes
    ----------
    calls : list of CallGradient
        Derivatives by the values of calls of `set` and `move` during the run, in their order.
    """

    def __init__(self, values: Sequence[Any], calls: list[CallGradient]) -> None:
        super().__init__(values)
        self.calls = calls


@dataclass(frozen=True, eq=False)
class _Call:
    step: int
    time: float
    method: str
    part: Part | BodyPair | None
    values: Mapping[str, Any]
    over: float
    session: Session  # as it was at the end


class RunJournal:
    """Journal of the values that are set during a run; see `Session.journal`."""

    def __init__(self, tape: _core.Tape, session: Session) -> None:
        self._tape = tape
        self.calls: list[_Call] = []
        self.ramps: dict[_Key, _Ramp] = _ramps_on_their_way(session)

    def note(
        self, session: Session, method: str, part: Part | BodyPair | None, values: Mapping[str, Any], over: float
    ) -> None:
        """Note the values of a call."""
        self._tape.divide()
        after = replace(session, settings=session.settings.copy(), journal=None)
        self.calls.append(_Call(self._tape.count, session.world.time, method, part, dict(values), over, after))


_Key = tuple[str, str]  # name of a part ("": the scene), and word
_Weights = dict[int, float]  # weights of calls in an acting value; _START: weight of the start
_START = -1
_BEFORE = -2  # a call before the run


@dataclass
class _Ramp:
    """Ramp of a value at a constant rate from its previous value to that of a call."""

    start: _Weights
    call: int
    begin: float
    over: float

    def at(self, time: float) -> _Weights:
        share = 1.0 if self.over == 0.0 else min(max((time - self.begin) / self.over, 0.0), 1.0)
        weights = {call: (1.0 - share) * weight for call, weight in self.start.items() if share < 1.0}
        weights[self.call] = share
        return weights


def _ramps_on_their_way(session: Session) -> dict[_Key, _Ramp]:
    """Return numbers that ramp at the start of a run to values that were set before it."""
    out, now = {}, session.world.time
    for part in session.directory.parts.values():
        for word in words_of(part):
            if not _is_ramp(part, word.name):
                continue
            if isinstance(part, RodPart):
                due = session.world.due(word.name, part.index)
            else:
                due = session.world.due(parameter_of(part, word.name), number_of(session, part))
            if due is not None and due > now:
                out[part.name, word.name] = _Ramp({_START: 1.0}, _BEFORE, now, due - now)
    return out


def _is_ramp(part: Part | BodyPair | None, word: str) -> bool:
    """True of numbers that the engine leads to their values."""
    if isinstance(part, RodPart):
        return word in NATURAL_WORDS
    known = word_of(part, word)
    return isinstance(part, Part) and kind_of(part).numbers is not None and known is not None and known.is_ramped


@dataclass
class _Epoch:
    """Which calls the numbers come from that act between two calls."""

    session: Session
    live: dict[_Key, int] = field(default_factory=dict)
    ramps: dict[_Key, _Ramp] = field(default_factory=dict)
    made_of: dict[_Key, set[str]] = field(default_factory=dict)  # arrays of rods that were created again
    ways: dict[_Key, Way] = field(default_factory=dict)

    def follow(self, index: int, call: _Call) -> _Epoch:
        """The next one, after a call."""
        out = _Epoch(call.session, dict(self.live), dict(self.ramps), dict(self.made_of), dict(self.ways))
        name = "" if call.part is None else call.part.name
        if call.method == "move":
            out._set_on_way(index, call, name)
            return out
        for word in call.values:
            key = (name, word)
            if _is_ramp(call.part, word):
                out.ramps[key] = _Ramp(self.weights(key, call.time), index, call.time, call.over)
                continue
            out.live[key] = index
            out.made_of |= made_by(call.session, call.part, word)
        return out

    def _set_on_way(self, index: int, call: _Call, name: str) -> None:
        for word in POSE_WORDS:
            if word in call.values:
                before = self.ways.get((name, word))
                start = before.weights(before.reached(call.time)) if before is not None else {_START: np.eye(3)}
                turn = call.values[word] if word == "rotation" else np.zeros(3)
                self.ways[name, word] = Way(word, index, call.time, call.over, turn, start)
            elif (name, word) in call.session.settings.paths:
                self.ways[name, word] = Way(word, None, call.time, 0.0)

    def weights(self, key: _Key, time: float) -> _Weights:
        """Return the share of each call in a natural shape at a time."""
        return self.ramps[key].at(time) if key in self.ramps else {_START: 1.0}

    def share_of_start(self, key: _Key, time: float) -> float:
        """Return the share of the initial value of a parameter that acts at a time."""
        return 0.0 if key in self.live else self.weights(key, time).get(_START, 0.0)

    def arrays(self, rod: RodPart, word: str, *, initial: bool) -> set[str]:
        """Return the arrays of a rod that depend on a word as it was set, or as it was at the start of the run."""
        return {
            array
            for array in ACTING_WORDS
            if (word in self.made_of[rod.name, array] if (rod.name, array) in self.made_of else initial)
        }


class Ledger:
    """Sums of derivatives, step by step: by initial values, and by the values of calls."""

    def __init__(
        self,
        session: Session,
        journal: RunJournal,
        frames: Sequence[int],
        wrt: Sequence[Any],
        readers: list[Reader],
        *,
        drawn: Sequence[DrawnNodes],
        by_moves: bool,
    ) -> None:
        """`frames` counts the calls before each frame. `by_moves` is true if derivatives by poses are available."""
        calls = journal.calls
        self._session, self._calls, self._frames, self._drawn = session, calls, frames, drawn
        self._unknowns = list(zip(wrt, readers, strict=True))
        self.sums: list[Any] = [None] * len(self._unknowns)
        self._epochs = [_Epoch(session, ramps=journal.ramps)]
        for index, call in enumerate(calls):
            self._epochs.append(self._epochs[-1].follow(index, call))
        self._steps = [call.step for call in calls]
        self._by_calls: list[dict[str, Any]] = [
            {word: _of_shape(np.zeros(np.shape(value)), np.shape(value)) for word, value in call.values.items()}
            if by_moves or call.method != "move"
            else {}
            for call in calls
        ]
        for call, sums in zip(calls, self._by_calls, strict=True):
            for word in [word for word in sums if not _has_gradient(call, word)]:
                del sums[word]
        self._poses = {
            place: (part_of(session, unknown[0]).name, unknown[1])
            for place, unknown in enumerate(wrt)
            if isinstance(unknown, tuple) and unknown[1] in POSE_WORDS
        }
        if self._poses and not by_moves:
            raise ValueError(
                "no gradient of reaction moments with respect to the pose of a support or obstacle is available "
                "with integrator='implicit_midpoint' or 'fourth_order', nor in space with hold='edge': use "
                "integrator='energy_momentum' or 'backward_euler', and hold='frame'"
            )
        for place in self._poses:
            self.sums[place] = np.zeros(3)
        moved = any(call.method == "move" and call.values for call in calls)
        self.moves: bool = by_moves and (moved or bool(self._poses))

    def visit(self, step: int, moment: int, time: float, found: _core.ParameterGradient) -> None:
        """Add derivatives by parameters from a step on, or of a read-out at a moment."""
        after = self._frames[moment] if moment >= 0 else int(np.searchsorted(self._steps, step, side="right"))
        epoch = self._epochs[after]
        for place, (unknown, reader) in enumerate(self._unknowns):
            if place in self._poses:
                continue
            value = self._of_start(epoch, unknown, reader, time, found)
            self.sums[place] = value if self.sums[place] is None else self.sums[place] + value
        for nodes in self._drawn:
            nodes.add(found, lambda name, word: epoch.share_of_start((name, word), time))
        for key in epoch.live:
            self._add_live(epoch, key, found)
        for key, ramp in epoch.ramps.items():
            for index, weight in ramp.at(time).items():
                if index >= 0 and weight != 0.0:
                    call = self._calls[index]
                    read = reader_of(call.session, call.part, key[1])
                    self._add(index, key[1], weight * np.asarray(read(OfRun(found))))

    def visit_poses(self, step: int, reached: _core.Reached, found: _core.PoseAdjoint) -> None:
        """Add derivatives by poses of supports and obstacles at the end of a step."""
        epoch = self._epochs[int(np.searchsorted(self._steps, step, side="right"))]
        for key, way in epoch.ways.items():
            by = self._by_pose(epoch.session, key, found)
            share = _share(epoch.session, key, reached)
            for call, weight in way.weights(share).items():
                if call >= 0:
                    sums = self._by_calls[call]
                    sums[key[1]] = sums[key[1]] + weight.T @ by
                else:
                    self._add_pose(key, weight.T @ by)
        for key in set(self._poses.values()) - epoch.ways.keys():
            self._add_pose(key, self._by_pose(epoch.session, key, found))

    def add_start(self, found: _core.PoseAdjoint) -> None:
        """Add derivatives by the initial poses of supports."""
        for key in set(self._poses.values()):
            self._add_pose(key, self._by_pose(self._session, key, found))

    @staticmethod
    def _by_pose(session: Session, key: _Key, found: _core.PoseAdjoint) -> FloatArray:
        obstacle = find_obstacle(session.directory, key[0])
        if obstacle is not None:
            return np.array(found.obstacles[obstacle[0]])
        index = session.settings.supports[key[0]][0]
        return np.array((found.positions if key[1] == "position" else found.rotations)[index])

    def _add_pose(self, key: _Key, by: FloatArray) -> None:
        for place, own in self._poses.items():
            if own == key:
                self.sums[place] = self.sums[place] + by

    @property
    def calls(self) -> list[CallGradient]:
        """Return the gradients by each call."""
        out = []
        for call, found in zip(self._calls, self._by_calls, strict=True):
            gradients = {word: found[word] for word in call.values if word in found}
            name = None if call.part is None else call.part.name
            out.append(CallGradient(call.time, call.method, name, call.over, gradients))
        return out

    def _of_start(self, epoch: _Epoch, unknown: Any, reader: Reader, time: float, found: Any) -> Any:
        """Return the derivatives by an initial value of the run, as far as it acts."""
        if isinstance(unknown, str):
            return reader(OfRun(found)) * (0.0 if ("", unknown) in epoch.live else 1.0)
        if isinstance(unknown, Remaining):  # requested by a function whose runs have no calls
            return reader(OfRun(found))
        part, word = part_of(self._session, unknown[0]), unknown[1]
        key = (part.name, word)
        if _is_ramp(part, word):
            return reader(OfRun(found)) * epoch.weights(key, time).get(_START, 0.0)
        if isinstance(part, RodPart):
            if not any(name == part.name for name, _ in epoch.made_of):
                return reader(OfRun(found))
            if word == "radius":
                raise ValueError(
                    f"no gradient with respect to radius of {part.owner} is available, because parameters of the "
                    "rod were set during the run"
                )
            arrays = set() if key in epoch.live else epoch.arrays(part, word, initial=True)
            return self._by_rod(epoch, part, word, arrays, np.shape(reader(OfRun(found))), found)
        if isinstance(part, DragPart):
            return _by_drag(epoch, part, found, initial=True) if key not in epoch.live else 0.0
        return reader(OfRun(found)) * (0.0 if key in epoch.live else 1.0)

    def _add_live(self, epoch: _Epoch, key: _Key, found: Any) -> None:
        index = epoch.live[key]
        call, word = self._calls[index], key[1]
        if word not in self._by_calls[index]:
            return
        shape = np.shape(call.values[word])
        if isinstance(call.part, RodPart):
            arrays = epoch.arrays(call.part, word, initial=False)
            self._add(index, word, self._by_rod(epoch, call.part, word, arrays, shape, found))
        elif isinstance(call.part, DragPart):
            self._add(index, word, _by_drag(epoch, call.part, found, initial=False))
        elif not (isinstance(call.part, LoadPart) and call.part.name in epoch.session.settings.functions):
            self._add(index, word, reader_of(call.session, call.part, word, shape)(OfRun(found)))

    def _add(self, index: int, word: str, value: Any) -> None:
        shaped = _of_shape(value, np.shape(self._calls[index].values[word]))
        self._by_calls[index][word] = self._by_calls[index][word] + shaped

    def _by_rod(
        self, epoch: _Epoch, part: RodPart, word: str, arrays: set[str], shape: tuple[int, ...], found: Any
    ) -> Any:
        slopes = rod_slopes(epoch.session, part, word) if arrays else {}
        kept = {array: slope for array, slope in slopes.items() if array in arrays}
        first, last = edges_of(epoch.session, part.index)
        return _of_shape(sum_of_slopes(found, kept, word, first, last), shape)


def _share(session: Session, key: _Key, reached: _core.Reached) -> float:
    """Share of its motion that a pose has completed."""
    obstacle = find_obstacle(session.directory, key[0])
    if obstacle is not None:
        return float(reached.obstacles[obstacle[0]]) if len(reached.obstacles) else 1.0
    index = session.settings.supports[key[0]][0]
    return float(reached.supports[index, POSE_WORDS.index(key[1])]) if len(reached.supports) else 1.0


def _has_gradient(call: _Call, name: str) -> bool:
    word, value = word_of(call.part, name), call.values[name]
    if word is None or not word.has_gradient or callable(value):
        return False
    return not word.has_one_side or bool(np.max(value) > 0.0)


def _by_drag(epoch: _Epoch, part: DragPart, found: Any, *, initial: bool) -> float:
    total = 0.0
    for rod in dragged_rods(epoch.session, part):
        words = epoch.made_of.get((rod.name, "drag"))
        if (OF_DRAGS in words) if words is not None else initial:
            first, last = edges_of(epoch.session, rod.index)
            total += float(np.asarray(found.drag)[first:last].sum())
    return total


def _of_shape(full: Any, shape: tuple[int, ...]) -> Any:
    """Return the derivatives by a value that was broadcast: sums over the axes of the broadcast."""
    array = np.asarray(full)
    padded = (1,) * (array.ndim - len(shape)) + shape
    axes = tuple(i for i, size in enumerate(padded) if size == 1 and array.shape[i] != 1)
    summed = array.sum(axis=axes, keepdims=True).reshape(shape)
    return float(summed) if summed.ndim == 0 else summed
