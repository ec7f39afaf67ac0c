"""The loop of a run: frames, callbacks, progress."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Generic, TypeVar

import numpy.typing as npt

from withe.common import validation
from withe.recording.record import Record
from withe.recording.recorder import Moving, Recorder
from withe.simulation.gradients import RunDerivatives
from withe.simulation.logs import run_logged
from withe.simulation.outlines import outlines_of
from withe.simulation.stepping import Stepping

__all__ = ["Run"]

S = TypeVar("S", bound=Moving)

_CHUNK_TIME = 0.05  # between two looks at the clock [s]
_MAX_FRAMES = 10_000_000


class Run(Generic[S]):
    """One run: checked arguments, and the loop around `stepping`. Callbacks receive the simulation."""

    def __init__(
        self,
        simulation: S,
        stepping: Stepping,
        duration: float,
        record_every: float | None,
        before_step: Callable[[S], object] | None,
        until: Callable[[S], object] | None,
        record: Mapping[str, Callable[[S], npt.ArrayLike]] | None,
        differentiable: bool = False,
        longest_step: Callable[[S], float] | None = None,
    ) -> None:
        self.duration: float = validation.positive(duration, "duration")
        step = stepping.session.options.time_step
        steps = self.duration / step
        # Shorter than the rounding error of the time or of a step: 1 / duration may not be a finite number.
        if steps < 2.0**-53 or stepping.time + self.duration == stepping.time:
            raise ValueError(f"duration must be long enough for the time_step, {step:g} s, got {self.duration:g} s")
        if steps > 2.0**53:
            raise ValueError(f"time_step must fit the duration, {self.duration:g} s, got {step:g}")
        if record_every is None:
            self._interval = step * max(1, math.ceil(0.01 * steps - 1e-9))
        elif isinstance(record_every, float) and record_every == math.inf:
            self._interval = self.duration
        else:
            self._interval = validation.positive(record_every, "record_every")
        if self.duration / self._interval > _MAX_FRAMES:
            raise ValueError(f"record_every must fit the duration, {self.duration:g} s, got {self._interval:g}")
        for name, value in (("before_step", before_step), ("until", until), ("longest_step", longest_step)):
            if value is not None:
                validation.function(value, name)
        if record is not None and not isinstance(record, Mapping):
            raise ValueError(f"record must be a mapping of names to functions, got {type(record).__name__}")
        self._simulation = simulation
        self._before_step, self._longest_step = before_step, longest_step
        self._until = until
        self._stepping = stepping
        directory = stepping.session.directory
        self._recorder = Recorder(
            simulation,
            record,
            *outlines_of(directory),
        )
        self._start = stepping.time
        self._ended = False
        self._differentiable = validation.truth(differentiable, "differentiable")

    def go(self, report: Callable[[float], object], stopped: Callable[[], bool]) -> None:
        """Run to the end; `report` receives the completed time [s], and `stopped` may end the run."""
        with self._stepping.in_run(), run_logged(self._stepping.session):
            self._go(report, stopped)

    def _go(self, report: Callable[[float], object], stopped: Callable[[], bool]) -> None:
        stepping = self._stepping
        stepping.recorder = self._recorder
        self._report, self._stopped = report, stopped
        derivatives = RunDerivatives(stepping.session) if self._differentiable else None
        self._recorder.derivatives = derivatives
        self._capture()
        done, frame = 0.0, 0
        try:
            while done < self.duration and not self._ended:
                frame += 1
                after = frame * self._interval
                if after > self.duration * (1.0 - 1e-12) or self.duration - after < 1e-9 * self._interval:
                    after = self.duration
                self._advance(done, after)
                if not self._ended:
                    # Time steps add up to the time of the frame, up to rounding. A frame has the exact time.
                    stepping.frame_time = stepping.session.world.time, self._start + after
                self._capture()
                done = after
                report(done)
        finally:
            stepping.frame_time = None
            if derivatives is not None:
                derivatives.end()

    def _capture(self) -> None:
        self._recorder.capture()
        if self._recorder.derivatives is not None:
            self._recorder.derivatives.note_frame()

    def _advance(self, begin: float, end: float) -> None:
        """From one frame to the next; both count from the start of the run [s]."""
        step = self._stepping.session.options.time_step
        if self._longest_step is not None:
            self._steps_no_longer_than(self._longest_step, self._start + end, step)
            return
        ratio = (end - begin) / step
        whole = round(ratio)
        if whole >= 1 and abs(ratio - whole) < 1e-9 * whole:
            self._whole_steps(begin, int(whole), step)
            return
        count = max(1, math.ceil(ratio - 1e-9))
        start = self._stepping.session.world.time
        target = self._start + end
        for i in range(1, count + 1):
            self._before()
            self._stepping.advance_to(target if i == count else start + (target - start) * i / count)
            self._after(begin + (end - begin) * i / count)
            if self._ended:
                return

    def _steps_no_longer_than(self, longest_step: Callable[[S], float], target: float, step: float) -> None:
        """To a time."""
        while not self._ended:
            self._before()
            longest = min(step, validation.positive(longest_step(self._simulation), "longest_step"))
            then = self._stepping.session.world.time + longest
            if then >= target - 1e-9 * longest:
                then = target
            self._stepping.advance_to(then)
            self._after(then - self._start)
            if then == target:
                return

    def _whole_steps(self, begin: float, count: int, step: float) -> None:
        taken, chunk = 0, 1
        single = self._before_step is not None or self._until is not None
        while taken < count and not self._ended:
            chunk = 1 if single else min(chunk, count - taken)
            self._before()
            clock = time.monotonic()
            self._stepping.step(chunk)
            taken += chunk
            self._after(begin + taken * step)
            # Few looks at the clock, but often enough for the bar and for Ctrl-C in other threads.
            chunk = 2 * chunk if time.monotonic() - clock < _CHUNK_TIME else max(1, chunk // 2)

    def _before(self) -> None:
        if self._before_step is not None:
            self._before_step(self._simulation)

    def _after(self, done: float) -> None:
        self._report(min(done, self.duration))
        if self._stopped():
            raise KeyboardInterrupt
        if self._until is not None and self._until(self._simulation):
            self._ended = True

    @property
    def record(self) -> Record:
        """Return the frames recorded so far."""
        return self._recorder.record
