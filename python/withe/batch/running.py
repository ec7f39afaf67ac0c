"""The loop of a batch's run: frames, callbacks, ends of simulations."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from withe.batch.lanes import Lanes
from withe.batch.records import BatchRecord
from withe.common import validation
from withe.recording.recorder import Recorder
from withe.simulation.outlines import outlines_of
from withe.simulation.simulation import Simulation

__all__ = ["BatchRun"]

IntArray = npt.NDArray[np.intc]


class Stepped(Protocol):
    """A batch."""

    @property
    def time_step(self) -> float:
        """Return the time step of all simulations [s]."""


B = TypeVar("B", bound=Stepped)


class BatchRun(Generic[B]):
    """One run: checked arguments, and the loop. Callbacks receive the batch."""

    def __init__(
        self,
        batch: B,
        lanes: Lanes,
        numbers: IntArray,
        duration: float,
        record_every: float | None,
        before_step: Callable[[B], object] | None,
        until: Callable[[B], npt.ArrayLike] | None,
        record: Mapping[str, Callable[[B], npt.ArrayLike]] | None,
    ) -> None:
        self.duration: float = validation.positive(duration, "duration")
        self._batch, self._lanes = batch, lanes
        self._steps = self._whole(self.duration, "duration")
        every = None if record_every is None else validation.positive(record_every, "record_every")
        self._interval = max(1, math.ceil(0.01 * self._steps)) if every is None else self._whole(every, "record_every")
        for name, value in (("before_step", before_step), ("until", until)):
            if value is not None:
                validation.function(value, name)
        if record is not None and not isinstance(record, Mapping):
            raise ValueError(f"record must be a mapping of names to functions, got {type(record).__name__}")
        self._before_step, self._until = before_step, until
        self._extras = {name: validation.function(value, f"record[{name!r}]") for name, value in (record or {}).items()}
        self._rows: dict[str, npt.NDArray[Any]] = {}
        self._going = [int(number) for number in numbers if not lanes.engine.failed()[number]]
        self._recorders = {int(number): self._recorder(int(number)) for number in numbers}
        self._starts = {number: self._simulation(number).time for number in self._recorders}

    def _whole(self, time: float, what: str) -> int:
        ratio = time / self._batch.time_step
        count = round(ratio)
        if count < 1 or abs(ratio - count) > 1e-9 * count:
            raise ValueError(
                f"{what} of a batch must be a whole number of time steps of {self._batch.time_step:g} s, got {time:g} s"
            )
        return count

    def _simulation(self, number: int) -> Simulation:
        return self._lanes.simulations[number]

    def _recorder(self, number: int) -> Recorder[Simulation]:
        simulation = self._simulation(number)
        directory = simulation._session.directory
        rows = {name: self._row_of(name, number) for name in self._extras}
        return Recorder(simulation, rows, *outlines_of(directory))

    def _row_of(self, name: str, number: int) -> Callable[[Simulation], npt.ArrayLike]:
        return lambda _: np.asarray(self._rows[name][number])

    def go(self, advance: Callable[[IntArray, int], None], report: Callable[[float], object]) -> None:
        """Run to the end: `advance` steps simulations by numbers, and `report` receives the completed time [s]."""
        with ExitStack() as runs:
            for number, recorder in self._recorders.items():
                stepping = self._simulation(number)._stepping
                runs.enter_context(stepping.in_run())
                stepping.recorder = recorder
            self._capture(list(self._recorders), 0)
            single = self._before_step is not None or self._until is not None
            done = 0
            while done < self._steps and self._going:
                count = min(self._interval - done % self._interval, self._steps - done)
                if single:
                    count = 1
                if self._before_step is not None:
                    self._before_step(self._batch)
                advance(np.array(self._going, np.intc), count)
                done += count
                failed = self._lanes.engine.failed()
                self._going = [number for number in self._going if not failed[number]]
                ended = self._ended()
                at_frame = done % self._interval == 0 or done == self._steps
                self._capture(self._going if at_frame else ended, done)
                self._going = [number for number in self._going if number not in ended]
                report(done * self._batch.time_step)

    def _ended(self) -> list[int]:
        """Return the running simulations that end at this frame."""
        if self._until is None:
            return []
        answer = np.asarray(self._until(self._batch))
        if answer.shape not in ((), (len(self._lanes),)):
            raise ValueError(
                f"until must return one boolean or an array of shape ({len(self._lanes)},), got shape {answer.shape}"
            )
        ends = np.broadcast_to(answer.astype(bool), (len(self._lanes),))
        return [number for number in self._going if ends[number]]

    def _capture(self, numbers: list[int], done: int) -> None:
        """Record a frame of simulations. Time steps add up to its time, up to rounding."""
        if not numbers:
            return
        for name, function in self._extras.items():
            rows = np.asarray(function(self._batch))
            if rows.shape[:1] != (len(self._lanes),):
                raise ValueError(f"record[{name!r}] must return shape ({len(self._lanes)}, ...), got {rows.shape}")
            self._rows[name] = rows
        for number in numbers:
            stepping = self._simulation(number)._stepping
            stepping.frame_time = stepping.session.world.time, self._starts[number] + done * self._batch.time_step
            self._recorders[number].capture()
            stepping.frame_time = None

    @property
    def record(self) -> BatchRecord:
        """Return the frames recorded so far."""
        return BatchRecord([recorder.record for recorder in self._recorders.values()])
