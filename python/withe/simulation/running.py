"""The loop around a simulation: frames, callbacks, progress; and many simulations side by side."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from typing import Any, Literal

import numpy.typing as npt

from withe.common import validation
from withe.common.progress import progress as progress_bar
from withe.recording.record import Record
from withe.recording.recorder import Recorder
from withe.simulation.simulation import Simulation

__all__ = ["run", "run_many"]

_CHUNK_TIME = 0.05  # between two looks at the clock [s]
_MAX_FRAMES = 10_000_000


def run(
    simulation: Simulation,
    duration: float,
    *,
    record_every: float | None,
    progress: bool | Literal["always"],
    before_step: Callable[[Simulation], object] | None,
    until: Callable[[Simulation], object] | None,
    record: Mapping[str, Callable[[Simulation], npt.ArrayLike]] | None,
) -> Record:
    """See `Simulation.run`."""
    plan = _Run(simulation, duration, record_every, before_step, until, record)
    with progress_bar(plan.duration, "simulating", progress) as bar:
        plan.go(bar.update, lambda: False)
    return simulation.record


class _Run:
    """One run: checked arguments, and the loop."""

    def __init__(
        self,
        simulation: Simulation,
        duration: float,
        record_every: float | None,
        before_step: Callable[[Simulation], object] | None,
        until: Callable[[Simulation], object] | None,
        record: Mapping[str, Callable[[Simulation], npt.ArrayLike]] | None,
    ) -> None:
        self.duration = validation.positive(duration, "duration")
        step = simulation.time_step
        steps = self.duration / step
        # Shorter than what rounding leaves of the time or of a step: 1 / duration need not be a number.
        if steps < 2.0**-53 or simulation.time + self.duration == simulation.time:
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
        for name, value in (("before_step", before_step), ("until", until)):
            if value is not None:
                validation.function(value, name)
        if record is not None and not isinstance(record, Mapping):
            raise ValueError(f"record must be a mapping of names to functions, got {type(record).__name__}")
        self._simulation = simulation
        self._before_step = before_step
        self._until = until
        self._recorder = Recorder(simulation, record, simulation._obstacle_outlines())
        self._start = simulation.time
        self._ended = False

    def go(self, report: Callable[[float], object], stopped: Callable[[], bool]) -> None:
        """Run to the end; `report` hears how much is done [s], and `stopped` may end it."""
        with self._simulation._in_run():
            self._go(report, stopped)

    def _go(self, report: Callable[[float], object], stopped: Callable[[], bool]) -> None:
        simulation = self._simulation
        simulation._recorder = self._recorder
        self._report, self._stopped = report, stopped
        self._recorder.capture()
        done, frame = 0.0, 0
        try:
            while done < self.duration and not self._ended:
                frame += 1
                after = frame * self._interval
                if after > self.duration * (1.0 - 1e-12) or self.duration - after < 1e-9 * self._interval:
                    after = self.duration
                self._advance(done, after)
                if not self._ended:
                    # Time steps add up to the frame's time but for rounding; a frame says the time itself.
                    simulation._exact_time = simulation._world.time, self._start + after
                self._recorder.capture()
                done = after
                report(done)
        finally:
            simulation._exact_time = None

    def _advance(self, begin: float, end: float) -> None:
        """From one frame to the next; both count from the start of the run [s]."""
        step = self._simulation.time_step
        ratio = (end - begin) / step
        whole = round(ratio)
        if whole >= 1 and abs(ratio - whole) < 1e-9 * whole:
            self._whole_steps(begin, int(whole), step)
            return
        count = max(1, math.ceil(ratio - 1e-9))
        start = self._simulation._world.time
        target = self._start + end
        for i in range(1, count + 1):
            self._before()
            self._simulation._advance_to(target if i == count else start + (target - start) * i / count)
            self._after(begin + (end - begin) * i / count)
            if self._ended:
                return

    def _whole_steps(self, begin: float, count: int, step: float) -> None:
        taken, chunk = 0, 1
        single = self._before_step is not None or self._until is not None
        while taken < count and not self._ended:
            chunk = 1 if single else min(chunk, count - taken)
            self._before()
            clock = time.monotonic()
            self._simulation._step(chunk)
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


def run_many(
    simulations: Iterable[Simulation],
    duration: float,
    *,
    workers: int | None = None,
    errors: Literal["raise", "return"] = "raise",
    record_every: float | None = None,
    progress: bool | Literal["always"] = True,
    before_step: Callable[[Simulation], object] | None = None,
    until: Callable[[Simulation], object] | None = None,
    record: Mapping[str, Callable[[Simulation], npt.ArrayLike]] | None = None,
) -> list[Record | Exception]:
    """Run many simulations side by side, in threads, with one progress bar.

    Parameters
    ----------
    simulations : iterable of Simulation
        All different; `Simulation.copy` makes more of one.
    duration : float [s]
    workers : int
        Number of threads; by default one a processor.
    errors : {"raise", "return"}
        Whether the first exception ends everything, or takes the place of its record.
    record_every, progress, before_step, until, record
        As in `Simulation.run`.

    Returns
    -------
    list of Record
        In the order of the simulations; with errors="return", exceptions among them.

    Raises
    ------
    ValueError
        Something that is not a simulation, or one that is there twice.
    ConvergenceError, KeyboardInterrupt, or what a callback raised
        With errors="raise"; every simulation keeps what it recorded until then.
    """
    try:
        listed = list(simulations)
    except TypeError:
        raise ValueError(f"simulations must be a list, got {type(simulations).__name__}") from None
    for index, simulation in enumerate(listed):
        if not isinstance(simulation, Simulation):
            raise ValueError(f"simulations must be withe.Simulation, got {type(simulation).__name__} at [{index}]")
    if len({id(simulation) for simulation in listed}) < len(listed):
        raise ValueError("simulations must differ: one is there twice, take a copy()")
    validation.choice(errors, "errors", ("raise", "return"))
    threads = _processors() if workers is None else validation.integer(workers, "workers", 1, 4096)
    runs = [_Run(simulation, duration, record_every, before_step, until, record) for simulation in listed]
    if not runs:
        return []

    stop = threading.Event()
    with progress_bar(sum(each.duration for each in runs), "simulating", progress) as bar:

        def work(each: _Run) -> Record:
            task = bar.task(each.duration)
            try:
                each.go(task.update, stop.is_set)
            finally:
                task.finish()
            return each._simulation.record

        pool = ThreadPoolExecutor(min(threads, len(runs)), thread_name_prefix="withe")
        try:
            futures = [pool.submit(work, each) for each in runs]
            _wait(futures, errors == "raise")
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
    return [_result(future, errors) for future in futures] if errors == "return" else _all(futures)


def _wait(futures: list[Future[Record]], first_error: bool) -> None:
    """Wait in slices, so that Ctrl-C reaches this thread."""
    pending = set(futures)
    while pending:
        done, pending = wait(pending, timeout=0.1, return_when=FIRST_EXCEPTION)
        if first_error and any(future.exception() is not None for future in done):
            return


def _all(futures: list[Future[Record]]) -> list[Record | Exception]:
    failed = [future.exception() for future in futures if future.done() and not future.cancelled()]
    # A run that was stopped because of another's error is not the cause.
    causes = [error for error in failed if error is not None and not isinstance(error, KeyboardInterrupt)]
    for error in causes or [error for error in failed if error is not None]:
        raise error
    return [future.result() for future in futures]


def _result(future: Future[Record], errors: str) -> Record | Exception:
    error = future.exception()
    if error is not None and not isinstance(error, Exception):
        raise error
    return error if error is not None else future.result()


def _processors() -> int:
    affinity: Any = getattr(os, "sched_getaffinity", None)
    return max(1, len(affinity(0)) if affinity is not None else os.cpu_count() or 1)
