"""A progress bar on stderr, drawn by rich if it is installed, and otherwise as plain text.

Nothing is drawn when stderr is not a terminal, so that a log file stays readable. One bar may serve many threads: each
has a task, which is a share of the bar's total.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO, TypeVar

from withe.common import validation
from withe.common.deprecation import old_word
from withe.common.keywords import keyword_hints

__all__ = ["Progress", "Task", "progress", "track"]

T = TypeVar("T")
_REDRAW_INTERVAL = 0.1  # [s]
_drawn = threading.Lock()  # held by the one bar on the screen; a nested bar stays silent


class Progress:
    """Counter of completed work from any thread, which draws nothing. See `progress`."""

    def __init__(self, total: float, description: str = "", unit: str = "s") -> None:
        if not total >= 0.0:
            raise ValueError(f"total of a progress bar must be zero or more, got {total!r}")
        self.total: float = float(total)
        self.description = description
        self.unit = unit
        self._completed = 0.0
        self._lock = threading.Lock()
        self._next_draw = 0.0

    @property
    def completed(self) -> float:
        """Return the completed part in the units of the total, never above the total."""
        return min(self._completed, self.total)

    @property
    def fraction(self) -> float:
        """Return the completed part, from 0 to 1."""
        return self.completed / self.total if self.total > 0.0 else 1.0

    def advance(self, amount: float) -> None:
        """Add to the completed part."""
        with self._lock:
            self._completed += amount
            self._draw_when_due()

    def update(self, completed: float) -> None:
        """Set the completed part."""
        with self._lock:
            self._completed = float(completed)
            self._draw_when_due()

    def task(self, total: float) -> Task:
        """Return a share of the bar, for one of several parallel tasks."""
        return Task(self, total)

    def _draw_when_due(self) -> None:
        now = time.monotonic()
        if now >= self._next_draw:
            self._next_draw = now + _REDRAW_INTERVAL
            self._draw()

    def _open(self) -> None:
        """Before the first drawing."""

    def _draw(self) -> None:
        """Draw the present state."""

    def _close(self) -> None:
        """After the last drawing."""


class Task:
    """One share of a bar. Update it from one thread only."""

    def __init__(self, bar: Progress, total: float) -> None:
        self._bar = bar
        self._total = float(total)
        self._completed = 0.0

    def update(self, completed: float) -> None:
        """Set the completed part of this share, at most the whole share."""
        completed = min(float(completed), self._total)
        self._bar.advance(completed - self._completed)
        self._completed = completed

    def finish(self) -> None:
        """Complete the whole share: the rest of it will not run."""
        self.update(self._total)


class _PlainProgress(Progress):
    """One line of text that is written over itself."""

    def __init__(self, total: float, description: str, unit: str, stream: TextIO) -> None:
        super().__init__(total, description, unit)
        self._stream = stream
        self._started = time.monotonic()
        self._width = 0

    def _line(self) -> str:
        filled = int(24 * self.fraction)
        line = (
            f"{self.description}  [{'#' * filled}{'.' * (24 - filled)}] {100 * self.fraction:3.0f} %"
            f"  {self.completed:.3g} of {self.total:.3g} {self.unit}"
        )
        elapsed = time.monotonic() - self._started
        if 0.0 < self.fraction < 1.0 and elapsed > 1.0:
            line += f", {elapsed * (1.0 / self.fraction - 1.0):.0f} s left"
        return line.lstrip()

    def _draw(self) -> None:
        line = self._line()
        self._stream.write("\r" + line.ljust(self._width))
        self._stream.flush()
        self._width = len(line)

    def _close(self) -> None:
        self._draw()
        self._stream.write("\n")
        self._stream.flush()


class _RichProgress(Progress):
    """A bar drawn by rich, on a terminal or in a notebook."""

    def __init__(self, total: float, description: str, unit: str, console: Any) -> None:
        from rich.progress import (
            BarColumn,
            TaskProgressColumn,
            TextColumn,
            TimeRemainingColumn,
        )
        from rich.progress import (
            Progress as RichBar,
        )

        super().__init__(total, description, unit)
        self._bar = RichBar(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn(f"{{task.completed:.3g}} of {{task.total:.3g}} {unit}"),
            TimeRemainingColumn(),
            console=console,
        )
        self._row = self._bar.add_task(description, total=self.total)

    def _open(self) -> None:
        self._bar.start()

    def _draw(self) -> None:
        self._bar.update(self._row, completed=self.completed)

    def _close(self) -> None:
        self._draw()
        self._bar.stop()


@contextmanager
def progress(
    total: float,
    description: str = "",
    enabled: bool = True,
    *,
    unit: str = "s",
) -> Iterator[Progress]:
    """Show the completed part of a total while the body runs.

    Parameters
    ----------
    total : float
        Amount of the whole work, such as the duration of a run.
    description : str
        Text before the bar.
    enabled : bool
        True draws on a terminal or in a notebook, and nothing elsewhere. False draws nothing.
    unit : str
        Unit of the total.

    Yields
    ------
    Progress
        Its `update(completed)` and `advance(amount)` may be called often and from any thread. `task(total)` returns a
        share for one of several runs.

    Raises
    ------
    ValueError
        A negative total, or `enabled` that is not a boolean.

    Examples
    --------
    >>> with progress(2.0, "simulating", enabled=False) as bar:
    ...     bar.update(0.5)
    ...     bar.fraction
    0.25
    """
    force = _draws_always(enabled)
    alone = (force or validation.truth(enabled, "progress")) and _drawn.acquire(blocking=False)
    try:
        bar = _drawing(total, description, unit, force) if alone else Progress(total, description, unit)
        bar._open()
        try:
            yield bar
        finally:
            bar._close()
    finally:
        if alone:
            _drawn.release()


@keyword_hints
def track(items: Iterable[T], description: str = "", enabled: bool = True, *, unit: str = "items") -> Iterator[T]:
    """Yield the items, and show how many the body of a loop has completed.

    Parameters
    ----------
    items : iterable
        Items of a loop, as many as a list can hold.
    description : str
        Text before the bar.
    enabled : bool
        True draws on a terminal or in a notebook, and nothing elsewhere. False draws nothing.
    unit : str
        Name of the items.

    Yields
    ------
    item
        Each of the items. Bars of runs in the body of the loop draw nothing.

    Raises
    ------
    ValueError
        `enabled` is not a boolean.

    Examples
    --------
    >>> [2 * force for force in track([1.0, 2.0], "pulling", unit="forces")]
    [2.0, 4.0]
    """
    listed = list(items)
    with progress(len(listed), description, enabled, unit=unit) as bar:
        for item in listed:
            yield item
            bar.advance(1)


def _draws_always(enabled: object) -> bool:
    """True if the deprecated value "always" was given, which draws wherever stderr goes."""
    if enabled != "always":
        return False
    old_word('progress="always"', "progress=True, which draws on a terminal and in a notebook")
    return True


def _drawing(total: float, description: str, unit: str, force: bool) -> Progress:
    stream = sys.stderr
    terminal = stream.isatty()
    try:
        from rich.console import Console
    except ImportError:
        if terminal or force:
            return _PlainProgress(total, description, unit, stream)
        return Progress(total, description, unit)
    console = Console(stderr=True)
    if console.is_jupyter or console.is_terminal:
        return _RichProgress(total, description, unit, console)
    if force:
        return _PlainProgress(total, description, unit, stream)
    return Progress(total, description, unit)
