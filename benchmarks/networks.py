"""Shared parts of the comparisons of networks with exact solutions."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from reporting import OUT, kilobytes

SOURCE_SECONDS = 120.0  # training time of a source's network, if tools/train_networks.py has not made a file
PUBLISHED_SIZE = "1900"  # size of a source's network [kB]


def torch_is_there() -> bool:
    """Return True if networks are available. Otherwise print a note."""
    there = importlib.util.find_spec("torch") is not None
    if not there:
        print("\nNetworks: torch is not installed")
    return there


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def loaded(kind: Any, train: Callable[..., Any], name: str, quick: bool, samples: int) -> dict[str, Any]:
    """The small network as shipped, and the source's: trained before, or here for a while, on few samples if quick."""
    file = OUT.parent / "networks" / f"{name}_source.pt"
    if file.exists() and not quick:
        source = kind.load(file)
    else:
        limit = 0.1 if quick else SOURCE_SECONDS
        source = train("source", samples=samples if quick else None, time_limit=limit)
    return {"small": kind.load(), "source": source}


def cells(numbers: Iterable[Iterable[float]]) -> list[str]:
    """Errors, of each quantity median, 95 % and so on."""
    return [" ".join(f"{value:.1e}" for value in each) for each in numbers]


def size_and_training(network: Any, shipped: Path | None) -> tuple[str, str]:
    """[kB], and how long it was trained [s] and what ended that; a network that is not shipped is written for it."""
    training = network.network.training
    OUT.mkdir(parents=True, exist_ok=True)
    file = network.save(OUT / "network_of_the_source.pt") if shipped is None else shipped
    return kilobytes(file), f"{training.seconds:.0f} ({training.stopped})"


def percentiles(error: np.ndarray) -> np.ndarray:
    """Median, 95 % and greatest; NaN of a network that is hardly trained and refuses all."""
    return np.percentile(error, (50, 95, 100)) if len(error) else np.full(3, np.nan)
