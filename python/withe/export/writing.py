"""Choice of a format by the suffix of a file."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from withe.common.frames import Frames
from withe.export.gltf import write_glb
from withe.export.tables import write_csv
from withe.export.usd import write_usd
from withe.io import write_collection, written_beside

__all__ = ["export"]

Writer = Callable[[Frames, Path], object]


def _write_pvd(record: Frames, path: Path) -> None:
    write_collection(record, path, path.with_suffix(""))


def _at_once(write: Writer) -> Writer:
    def written(record: Frames, path: Path) -> None:
        with written_beside(path) as temporary:
            write(record, temporary)

    return written


_WRITERS: dict[str, Writer] = {
    ".csv": _at_once(write_csv),
    ".glb": _at_once(write_glb),
    ".pvd": _write_pvd,
    ".usda": _at_once(write_usd),
    ".usdc": _at_once(write_usd),
}


def export(record: Frames, path: str | os.PathLike[str]) -> Path:
    """Write a record for another program, in the format of the suffix; see `Record.export`."""
    path = Path(path)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        known = ", ".join(_WRITERS)
        own = "; to read the record again, use save" if path.suffix.lower() == ".npz" else ""
        raise ValueError(f"path must end in one of {known}, got {str(path)!r}{own}")
    if len(record) == 0:
        raise ValueError("record has no frames to write")
    write(record, path)
    return path
