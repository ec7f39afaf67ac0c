"""Logs of experiments: pixels and times of tags."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.short_repr import ShortRepr

__all__ = ["Log", "read_log"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Log(ShortRepr):
    """Log of tags that a camera saw.

    Attributes
    ----------
    times : ndarray of shape (frames,) [s]
        Times since the first frame.
    pixels : ndarray of shape (frames, tags, 2) [px]
        Centres of the tags, x to the right and y down; NaN for tags that were not seen.
    valid : ndarray of bool of shape (frames, tags)
        True for tags that were seen.
    tags : tuple of int
        Numbers of the tags, in the order of the arrays.
    """

    times: FloatArray
    pixels: FloatArray
    valid: npt.NDArray[np.bool_]
    tags: tuple[int, ...]


@keyword_hints
def read_log(
    path: str | os.PathLike[str],
    tags: Iterable[int],
    skip: int = 0,
    *,
    time: str | None = None,
    time_unit: float = 1e-3,
) -> Log:
    """Read a log of tags in pixels from a file of comma-separated values, with one row per frame.

    The first row names the columns: tagid_x_101 and tagid_y_101 for tag 101. A tag without values, or with two zeros,
    was not seen. Empty rows at the end are ignored.

    Parameters
    ----------
    path : str or path
    tags : iterable of int
        Numbers of the tags to read, along the rod.
    skip : int
        Number of rows to skip after the names.
    time : str, optional
        Name of the column of times. By default the first column.
    time_unit : float [s]
        Unit of the times. By default milliseconds.

    Returns
    -------
    Log

    Raises
    ------
    ValueError
        The file or a column is missing, a value is not a number, times do not increase, or no frame shows a tag.

    Examples
    --------
    >>> log = withe.real2sim.read_log("soft_limb_data.csv", tags=range(101, 110), skip=7)  # doctest: +SKIP
    >>> log.pixels.shape  # doctest: +SKIP
    (169, 9, 2)
    """
    numbers = tuple(validation.integer(tag, "tags", 0, 2**31 - 1) for tag in tags)
    if not numbers or len(set(numbers)) != len(numbers):
        raise ValueError(f"tags must be different numbers, at least one, got {numbers}")
    skip = validation.integer(skip, "skip", 0, 2**31 - 1)
    unit = validation.positive(time_unit, "time_unit")
    names, rows = _table(path)
    rows = rows[skip:]
    if not rows:
        raise ValueError(
            f"path must hold more than skip={skip} rows after the names of columns, got {os.fspath(path)!r}"
        )
    times = _column(names, rows, names[0] if time is None else time, skip)
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise ValueError(
            f"times of {os.fspath(path)!r} must be numbers that increase from row to row: give time= or skip="
        )
    pixels = np.stack(
        [np.stack([_column(names, rows, f"tagid_{axis}_{tag}", skip) for axis in "xy"], axis=1) for tag in numbers],
        axis=1,
    )
    valid = np.isfinite(pixels).all(axis=2) & (pixels != 0.0).any(axis=2)
    if not valid.any():
        raise ValueError(f"tags must be seen in some frame of {os.fspath(path)!r}, got none of {numbers}")
    pixels[~valid] = np.nan
    return Log(unit * (times - times[0]), pixels, valid, numbers)


def _table(path: str | os.PathLike[str]) -> tuple[list[str], list[list[str]]]:
    """Names of columns, and the rows down to the last that is not empty."""
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.reader(stream))
    except OSError as error:
        raise ValueError(f"path must be a file that can be read, got {os.fspath(path)!r}: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"path must be a text file with commas, got {os.fspath(path)!r}: {error}") from None
    while rows and not any(cell.strip() for cell in rows[-1]):
        rows.pop()
    if not rows:
        raise ValueError(f"path must hold names of columns and rows, got {os.fspath(path)!r}, which is empty")
    names = [name.strip() for name in rows[0]]
    for number, row in enumerate(rows[1:], 1):
        if any(cell.strip() for cell in row[len(names) :]):
            raise ValueError(
                f"path must name every column, got {len(row)} cells and {len(names)} names in row {number}"
            )
    return names, rows[1:]


def _column(names: list[str], rows: list[list[str]], name: str, skip: int) -> FloatArray:
    """A column as numbers, NaN where a cell is empty."""
    if name not in names:
        raise ValueError(f"path must have a column {name!r}; it has {', '.join(names)}")
    place = names.index(name)
    values = np.full(len(rows), np.nan)
    for i, row in enumerate(rows):
        cell = row[place].strip() if place < len(row) else ""
        if not cell:
            continue
        try:
            values[i] = float(cell)
        except ValueError:
            raise ValueError(f"column {name!r} must hold numbers, got {cell!r} in row {skip + i}") from None
    return values
