"""Work handed to a client of Dask, as `concurrent.futures` has it."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from withe.common.extras import require

__all__ = ["cluster_executor", "require_client"]


def require_client(client: Any) -> None:
    """Refuse what is no client.

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
    """Workers of a client; what they have not ended is dropped where an exception leaves the context."""
    executor: Executor = client.get_executor(pure=False)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False)  # which cancels them, in Dask
        raise
    executor.shutdown()
