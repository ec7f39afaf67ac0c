"""Trials of folding, many in parallel: sheets that differ from the planner's paper, plans, and results."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from withe.common import validation
from withe.common.cluster import cluster_executor, require_client
from withe.common.deprecation import renamed
from withe.common.progress import progress as progress_bar
from withe.folding.closed_loop import fold
from withe.folding.endings import plan
from withe.folding.hanging_strip import measure
from withe.folding.noise import Noise
from withe.folding.paper import Paper
from withe.folding.plans import FoldPlan
from withe.folding.simulated_sheet import SimulatedSheet

__all__ = ["Outcome", "Trial", "run_trials"]

_SCALE = 4000.0  # scale of the picture of a strip [px/m]


@dataclass(frozen=True)
class Trial:
    """One complete fold: a strip is photographed from both sides, a motion is planned and carried out.

    Parameters
    ----------
    paper : Paper
        Paper as it is believed to be. The planner knows its Lgb only from the photographs.
    target : float [m] or str
        Target as in `plan`.
    seed : int
        Seed of the deviations of the sheet.
    noise : Noise
        Size of the deviations.
    replans : int
        Number of camera corrections on the way; 0 means open loop.
    planner : mapping
        Options of `plan`.
    sheet : mapping
        Options of `SimulatedSheet`.
    believed : Paper, optional
        Paper that the planner assumes, except for its Lgb. By default `paper`.
    name : str
        Label for the user.

    Examples
    --------
    >>> import withe
    >>> paper = withe.folding.Paper.a4()
    >>> free = {"method": "slip", "grasp": "free"}
    >>> trials = [withe.folding.Trial(paper, seed=seed, planner=free) for seed in range(9)]
    >>> errors = [outcome.error for outcome in withe.folding.run_trials(trials)]  # doctest: +SKIP
    """

    paper: Paper
    target: float | str = "half"
    seed: int = 0
    noise: Noise = field(default_factory=Noise)
    replans: int = 0
    planner: Mapping[str, Any] = field(default_factory=dict)
    sheet: Mapping[str, Any] = field(default_factory=dict)
    believed: Paper | None = None
    name: str = ""


@dataclass(frozen=True)
class Outcome:
    """Result of a trial.

    Attributes
    ----------
    trial : Trial
    gravito_bending_length : float [m]
        Measured value.
    needed_friction : float [-]
        Least friction at which the sheet does not slide on the planned path, before a plunge. NaN without a plan.
    plunges : bool
        True if the plan ends in a plunge.
    blocked : str or None
        Reason why the plan fails within its uncertainty, as `FoldPlan.blocked`.
    error, length, slide : float [m]
    max_curvature : float [1/m]
        Values of `Fold`; NaN without a plan.
    failure : str or None
        Error of the planner or the sheet that prevented the fold. It begins with "no plan" if it is the planner's.
    seconds : float [s]
        Processor time on the thread of the trial, without other trials. Trials of one sheet share its photographs and
        plans.
    """

    trial: Trial
    gravito_bending_length: float = np.nan
    needed_friction: float = np.nan
    plunges: bool = False
    blocked: str | None = None
    error: float = np.nan
    length: float = np.nan
    slide: float = np.nan
    max_curvature: float = np.nan
    failure: str | None = None
    seconds: float = 0.0


@renamed(processes="workers")
def run_trials(
    trials: Sequence[Trial], *, workers: int | None = None, client: Any | None = None, progress: bool = True
) -> Iterator[Outcome]:
    """Carry out trials in parallel, and yield each result when its trial ends.

    Results that were yielded before Ctrl-C remain. The result of a trial does not depend on the other trials.

    Parameters
    ----------
    trials : sequence of Trial
    workers : int, optional
        Number of processes. By default one per processor; 1 runs the trials in this process. A script that uses
        more must begin under ``if __name__ == "__main__":``.
    client : dask.distributed.Client, optional
        Cluster that carries out the trials instead. It needs withe installed.
    progress : bool
        True to show a progress bar on a terminal.

    Returns
    -------
    iterator of Outcome
        Results in the order of completion; ``outcome.trial`` identifies the trial.

    Raises
    ------
    ValueError
        Arguments that are not trials, both workers and a client, or a client of another type.
    ImportError
        A client without Dask installed.
    """
    trials = list(trials)
    for each in trials:
        if not isinstance(each, Trial):
            raise ValueError(f"trials must be Trials, got {each!r:.80}")
    if client is not None and workers is not None:
        raise ValueError("workers and client must not be given together")
    if client is not None:
        require_client(client)
    count = validation.integer(os.cpu_count() or 1 if workers is None else workers, "workers", 1, 10_000)
    return _run(trials, min(count, len(trials)), client, progress)


def _run(trials: list[Trial], processes: int, client: Any | None, progress: bool) -> Iterator[Outcome]:
    with progress_bar(len(trials), "folding", progress, unit="folds") as bar:
        if processes <= 1 and client is None:
            for trial in trials:
                yield carry_out(trial)
                bar.advance(1)
            return
        with _workers(processes) if client is None else cluster_executor(client) as workers:
            for future in as_completed([workers.submit(_carry_out_all, group) for group in _alike(trials)]):
                for outcome in future.result():
                    yield outcome
                    bar.advance(1)


@contextmanager
def _workers(processes: int) -> Iterator[Executor]:
    """Processes of our own, which end at once if we are interrupted, and not when their fold is done."""
    before = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_begin)
    try:
        yield pool
    except BaseException:  # a generator that is closed early, too
        pool.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
        raise
    pool.shutdown()


def _begin() -> None:
    """End worker processes silently at Ctrl-C, which reaches every process. The main process reports its results."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _alike(trials: list[Trial]) -> list[list[Trial]]:
    """Group trials with the same sheet and the same plan, watched or not, so that each group plans only once."""
    groups: dict[Any, list[Trial]] = {}
    for trial in trials:
        planner, sheet = _hashable(trial.planner), _hashable(trial.sheet)
        asked = (trial.paper, trial.target, trial.seed, trial.noise, planner, sheet, trial.believed)
        groups.setdefault(asked, []).append(trial)
    return list(groups.values())


def _carry_out_all(trials: list[Trial]) -> list[Outcome]:
    return [carry_out(trial) for trial in trials]


def carry_out(trial: Trial) -> Outcome:
    """Carry out one trial in this process."""
    began = time.thread_time()
    done = _carried_out(trial)
    return replace(done, seconds=done.seconds + time.thread_time() - began)


@lru_cache(maxsize=4)
def _measured(paper: Paper, seed: int, noise: Noise, options: tuple[tuple[str, Any], ...]) -> tuple[float, float]:
    """Lgb of a sheet by photographs of a strip of it, and the seconds that it took."""
    began = time.thread_time()
    sheet = SimulatedSheet(paper, seed, noise, **dict(options))
    image, turned = (sheet.strip_picture(scale=_SCALE, turned=side) for side in (False, True))
    found = measure(image=image, turned=turned, scale=_SCALE).gravito_bending_length
    return found, time.thread_time() - began


@lru_cache(maxsize=4)
def _planned(paper: Paper, target: float | str, options: tuple[tuple[str, Any], ...]) -> tuple[FoldPlan, float]:
    """Return a plan, and its computing time [s]. Trials of one sheet, watched or not, share it."""
    began = time.thread_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # predicted slide is not reported, since it is measured here
        found = plan(paper, target, progress=False, **dict(options))
    return found, time.thread_time() - began


def _hashable(options: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    return tuple((name, tuple(value) if isinstance(value, list) else value) for name, value in sorted(options.items()))


def _carried_out(trial: Trial) -> Outcome:
    sheet = SimulatedSheet(trial.paper, trial.seed, trial.noise, **trial.sheet)
    began = time.thread_time()
    measured, measuring = _measured(trial.paper, trial.seed, trial.noise, _hashable(trial.sheet))
    outcome = Outcome(trial, measured)
    paper = replace(trial.believed or trial.paper, gravito_bending_length=measured)
    try:
        planned, planning = _planned(paper, trial.target, _hashable(trial.planner))
    except ValueError as error:
        return replace(outcome, failure=f"no plan: {error}")
    outcome = replace(
        outcome,
        needed_friction=float(np.nanmax(planned.slip_ratio)),
        plunges=planned.plunges_at is not None,
        blocked=planned.blocked,
        seconds=measuring + planning - (time.thread_time() - began),
    )
    try:
        if trial.replans:
            done = fold(planned, sheet, replans=trial.replans, progress=False)
        else:
            done = sheet.fold(planned, progress=False)
    except ValueError as error:
        return replace(outcome, failure=f"no plan on the way: {error}")
    return replace(
        outcome,
        error=done.error,
        length=done.length,
        slide=done.slide,
        max_curvature=done.max_curvature,
        failure=done.failure,
    )
