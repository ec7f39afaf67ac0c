"""Many simulations on other machines, by a client of Dask."""

from __future__ import annotations

from concurrent.futures import as_completed
from typing import Any

from withe.common.cluster import cluster_executor, require_client
from withe.common.progress import progress as progress_bar
from withe.recording.record import Record
from withe.simulation.simulation import Simulation
from withe.simulation.snapshots import Snapshot

__all__ = ["run_on"]


def _run(simulation: Simulation, duration: float, options: dict[str, Any]) -> tuple[Record, Snapshot]:
    """Run on a worker. Return the recorded data and the final state."""
    record = simulation.run(duration, progress=False, **options)
    return record, simulation.snapshot()


def run_on(
    client: Any,
    simulations: list[Simulation],
    duration: float,
    errors: str,
    progress: bool,
    options: dict[str, Any],
) -> list[Record | Exception]:
    """Run each simulation on a worker of the client, and return its record and its state.

    Parameters
    ----------
    client : dask.distributed.Client
    simulations : list of Simulation
    duration : float [s]
    errors, progress
        Arguments of `run_many`.
    options : dict
        Options of `Simulation.run`.

    Raises
    ------
    ValueError
        Not a client.
    ImportError
        Dask is not installed.
    """
    require_client(client)
    found: list[Record | Exception | None] = [None] * len(simulations)
    with (
        progress_bar(len(simulations), "simulating", progress, unit="runs") as bar,
        cluster_executor(client) as workers,
    ):
        place = {
            workers.submit(_run, simulation, duration, options): index for index, simulation in enumerate(simulations)
        }
        for future in as_completed(place):
            index, error = place[future], future.exception()
            if error is None:
                found[index], state = future.result()
                simulations[index].restore(state)
            elif errors == "raise" or not isinstance(error, Exception):
                raise error
            else:
                found[index] = error
            bar.advance(1)
    return [each for each in found if each is not None]
