"""Execution on a client of Dask, with the interface of `concurrent.futures`."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from withe.common.extras import require

__all__ = ["cluster_executor", "require_client"]


def require_client(client: Any) -> None:
    """Refuse an object that is not a client.

    Raises
    ------
    ValueError
        Not a dask.distributed.Client.
    ImportError
        Dask is not installed.
    """
    if not isinstance(client, require("distributed", "cluster").Client):
        raise ValueError(f"client must be a dask.distributed.Client, got {type(client).__name__}")


@contextmanager
def cluster_executor(client: Any) -> Iterator[Executor]:
    """Yield the workers of a client. If an exception leaves the context, unfinished work is dropped."""
    executor: Executor = client.get_executor(pure=False)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False)  # in Dask this cancels them
        raise
    executor.shutdown()
