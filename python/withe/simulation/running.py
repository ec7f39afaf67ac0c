"""Parallel runs of many simulations."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from typing import Any, Literal

import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.common.user_warnings import located_at, user_place
from withe.recording.record import Record
from withe.simulation.loop import Run
from withe.simulation.remote import run_on
from withe.simulation.simulation import Simulation

__all__ = ["listed_simulations", "run_many", "thread_count"]


@keyword_hints
def run_many(
    simulations: Iterable[Simulation],
    duration: float,
    *,
    workers: int | None = None,
    client: Any = None,
    errors: Literal["raise", "return"] = "raise",
    record_every: float | None = None,
    progress: bool = True,
    before_step: Callable[[Simulation], object] | None = None,
    until: Callable[[Simulation], object] | None = None,
    record: Mapping[str, Callable[[Simulation], npt.ArrayLike]] | None = None,
) -> list[Record | Exception]:
    """Run many simulations in parallel, on threads, with one progress bar.

    Parameters
    ----------
    simulations : iterable of Simulation
        Different simulations; `Simulation.copy` makes copies.
    duration : float [s]
        Duration of each run.
    workers : int
        Number of threads. By default one per processor.
    client : dask.distributed.Client, optional
        Client whose workers run the simulations instead of threads, in other processes or on other machines that have
        withe. Each simulation ends in the final state of its run, with the same bits on equal processors.
        `Simulation.record` does not change. Functions are sent to the workers.
    errors : {"raise", "return"}
        With "raise" the first exception ends all runs. With "return" an exception takes the place of its record.
    record_every, progress, before_step, until, record
        Arguments of `Simulation.run`.

    Returns
    -------
    list of Record
        Records in the order of the simulations; with errors="return" also exceptions.

    Raises
    ------
    ValueError
        An object that is not a simulation, a simulation given twice, workers beside a client, or not a client.
    ImportError
        A client is given and Dask is not installed.
    ConvergenceError, KeyboardInterrupt, or what a callback raised
        Only with errors="raise". Every simulation keeps its frames until then. On a client, simulations that did not
        end keep their initial state.

    Examples
    --------
    >>> from dask.distributed import Client  # doctest: +SKIP
    >>> records = withe.run_many(simulations, 2.0, client=Client("tcp://scheduler:8786"))  # doctest: +SKIP
    """
    listed = listed_simulations(simulations)
    if len({id(simulation) for simulation in listed}) < len(listed):
        raise ValueError("simulations must be different objects, got one twice: use a copy()")
    validation.choice(errors, "errors", ("raise", "return"))
    if client is not None:
        if workers is not None:
            raise ValueError("workers must not be given with client: workers are threads of this process")
        options = {"record_every": record_every, "before_step": before_step, "until": until, "record": record}
        return run_on(client, listed, duration, errors, progress, options)
    threads = thread_count(workers)
    runs = [
        Run(simulation, simulation._stepping, duration, record_every, before_step, until, record)
        for simulation in listed
    ]
    if not runs:
        return []

    stop, place = threading.Event(), user_place()
    with progress_bar(sum(each.duration for each in runs), "simulating", progress) as bar:

        def work(each: Run[Simulation]) -> Record:
            task = bar.task(each.duration)
            try:
                with located_at(place):
                    each.go(task.update, stop.is_set)
            finally:
                task.finish()
            return each.record

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


def listed_simulations(simulations: Iterable[Simulation]) -> list[Simulation]:
    """Return the simulations of a user as a list.

    Raises
    ------
    ValueError
        Not a list, or an object in it that is not a simulation.
    """
    try:
        listed = list(simulations)
    except TypeError:
        raise ValueError(f"simulations must be a list, got {type(simulations).__name__}") from None
    for index, simulation in enumerate(listed):
        if not isinstance(simulation, Simulation):
            raise ValueError(f"simulations must be withe.Simulation, got {type(simulation).__name__} at [{index}]")
    return listed


def thread_count(workers: int | None) -> int:
    """Return the number of threads. By default as many as the processors that this process may use."""
    if workers is not None:
        return validation.integer(workers, "workers", 1, 4096)
    affinity: Any = getattr(os, "sched_getaffinity", None)
    return max(1, len(affinity(0)) if affinity is not None else os.cpu_count() or 1)
