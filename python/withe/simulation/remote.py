"""Many simulations on other machines, by a client of Dask."""

from __future__ import annotations

from typing import Any, Literal

from withe.common.extras import require
from withe.common.progress import progress as progress_bar
from withe.recording.record import Record
from withe.simulation.simulation import Simulation
from withe.simulation.snapshots import Snapshot

__all__ = ["run_on"]


def _run(simulation: Simulation, duration: float, options: dict[str, Any]) -> tuple[Record, Snapshot]:
    """On a worker: what was recorded, and the state that it ended in."""
    record = simulation.run(duration, progress=False, **options)
    return record, simulation.snapshot()


def run_on(
    client: Any,
    simulations: list[Simulation],
    duration: float,
    errors: str,
    progress: bool | Literal["always"],
    options: dict[str, Any],
) -> list[Record | Exception]:
    """Run each on a worker of the client, and bring back its record and its state.

    Parameters
    ----------
    client : dask.distributed.Client
    simulations : list of Simulation
    duration : float [s]
    errors, progress
        As in `run_many`.
    options : dict
        Of `Simulation.run`.

    Raises
    ------
    ValueError
        Not a client.
    ImportError
        Dask is not installed.
    """
    distributed = require("distributed", "cluster")
    if not isinstance(client, distributed.Client):
        raise ValueError(f"client must be a dask.distributed.Client, got {type(client).__name__}")
    futures = [client.submit(_run, simulation, duration, options, pure=False) for simulation in simulations]
    place = {future.key: index for index, future in enumerate(futures)}
    found: list[Record | Exception | None] = [None] * len(futures)
    try:
        with progress_bar(len(futures), "simulating", progress, unit="runs") as bar:
            for future in distributed.as_completed(futures):
                index, error = place[future.key], future.exception()
                if error is None:
                    found[index], state = future.result()
                    simulations[index].restore(state)
                elif errors == "raise" or not isinstance(error, Exception):
                    raise error
                else:
                    found[index] = error
                future.release()
                bar.advance(1)
    finally:
        client.cancel(futures)
    return [each for each in found if each is not None]
