"""Shared parts of all benchmarks: timing, printed tables, and the JSON file with the results.

``out/benchmarks/NAME.json`` holds machine, compiler, command, date, every figure with its spread, and `goals`: a list
of ``{name, value, target, met}``.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import importlib.util
import json
import os
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import withe
from withe.common.progress import Progress, progress

__all__ = [
    "DATA",
    "HAVE_ELASTICA",
    "HAVE_MUJOCO",
    "OUT",
    "RESUME",
    "Lines",
    "Report",
    "Timing",
    "arguments",
    "bar",
    "interleaved",
    "kilobytes",
    "once",
    "processor_seconds",
]

ROOT = Path(__file__).resolve().parent.parent
DATA = ROOT / "benchmarks" / "data"
LOADED = time.monotonic()
HAVE_ELASTICA = importlib.util.find_spec("elastica") is not None
HAVE_MUJOCO = importlib.util.find_spec("mujoco") is not None
OUT = Path(os.environ.get("WITHE_BENCHMARK_OUT", ROOT / "out" / "benchmarks"))
RESUME = ("--resume", {"action": "store_true", "help": "keep what an earlier run with the same withe left"})


def arguments(doc: str | None, *extra: tuple[str, dict]) -> argparse.Namespace:
    """Return the command line of a benchmark: ``--quick`` for all, and its own options."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a few seconds: shows that it works, measures nothing")
    for flag, options in extra:
        parser.add_argument(flag, **options)
    return parser.parse_args()


def bar(total: float, description: str, unit: str = "runs") -> Progress:
    """A progress bar on a terminal, by rich where it is installed; a context manager."""
    return progress(total, description, unit=unit)


# --- time ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Timing:
    """Seconds of several runs of the same thing."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """Middle of all runs [s]."""
        return float(np.median(self.seconds))

    @property
    def spread(self) -> float:
        """Half the distance between quartiles, over the median."""
        low, high = np.percentile(self.seconds, (25, 75))
        return float(0.5 * (high - low) / self.median) if self.median > 0 else 0.0

    def as_json(self) -> dict:
        """For the report."""
        return {"median": self.median, "spread": self.spread, "runs": len(self.seconds)}


def once(action: Callable[[], object]) -> float:
    """Processor time of one run of an action on this thread [s].

    Not the time on the wall: another program on the machine would count, and differently for each of those that are
    compared. For work on one thread of a quiet machine both are the same.
    """
    start = time.thread_time()
    action()
    return time.thread_time() - start


def processor_seconds(call: Callable[[], object], repeats: int) -> float:
    """Processor time of all threads, in the fastest of some runs, because the machine may be busy."""
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return min(seconds)


def interleaved(actions: dict[str, Callable[[], float]], rounds: int, advance: Callable[[], object] = lambda: None):
    """Timings of actions that each return seconds, taken in turns so that a slow spell of the machine meets all."""
    seconds: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(rounds):
        for name, action in actions.items():
            seconds[name].append(action())
            advance()
    return {name: Timing(tuple(values)) for name, values in seconds.items()}


def kilobytes(path: Path) -> str:
    """Size of a file."""
    return f"{path.stat().st_size / 1e3:.0f}"


# --- partial results of interrupted runs -------------------------------------------------------------------------


class Lines:
    """Results of a long benchmark, each a line of ``out/benchmarks/NAME.jsonl`` as soon as it is there.

    Parameters
    ----------
    name : str
        Of the file.
    resume : bool
        Whether those of an earlier run are kept.

    Attributes
    ----------
    known : list of dict
        Of the earlier run.
    """

    def __init__(self, name: str, *, resume: bool) -> None:
        OUT.mkdir(parents=True, exist_ok=True)
        self._file = OUT / f"{name}.jsonl"
        self.known: list[dict] = []
        lines = self._file.read_text().splitlines() if resume and self._file.exists() else []
        for line in lines:
            with contextlib.suppress(json.JSONDecodeError):  # the last one may have been cut off
                self.known.append(json.loads(line))
        if not resume or len(self.known) < len(lines):
            self._file.write_text("".join(json.dumps(line) + "\n" for line in self.known))

    def add(self, line: dict) -> None:
        """Write one."""
        with self._file.open("a") as stream:
            stream.write(json.dumps(line) + "\n")


# --- the report ------------------------------------------------------------------------------------------------


def _first_line(*command: str) -> str:
    if shutil.which(command[0]) is None:
        return "none"
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.partition("\n")[0]


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    found = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in text.splitlines())}
    flags = found.get("flags", "").split()
    widest = next((name for name in ("avx512f", "avx2", "sse2") if name in flags), platform.machine())
    return f"{found.get('model name', platform.machine())}, {widest}"


def _command() -> str:
    script, *rest = sys.argv
    path = Path(script).resolve()
    return " ".join(["python", str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else path.name, *rest])


def _load() -> float | None:
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


class Report:
    """Figures of one benchmark as they come in, then a file and a text.

    Parameters
    ----------
    name : str
        Of the file in ``out/benchmarks``.
    quick : bool
        Whether this was the short form, whose figures say nothing.
    """

    def __init__(self, name: str, *, quick: bool = False) -> None:
        self.name = name
        self.goals: list[dict] = []
        self.figures: dict[str, object] = {}
        self.tables: dict[str, list[list[str]]] = {}
        self._quick = quick
        self._start = LOADED
        self._load = _load()

    def goal(self, name: str, value: float | None, target: float, *, at_least: bool = True) -> None:
        """Hold a figure against its target. No value: it could not be measured, and is not met."""
        value = None if value is None or not np.isfinite(value) else float(value)
        met = value is not None and (value >= target if at_least else value <= target)
        sign = "at least" if at_least else "at most"
        self.goals.append({"name": name, "value": value, "target": target, "sign": sign, "met": bool(met)})

    def table(self, title: str, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
        """Print a table, and keep it."""
        cells = [list(map(str, header)), *([str(cell) for cell in row] for row in rows)]
        self.tables[title] = cells
        widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
        print(f"\n{title}")
        for row in cells:
            print("  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())

    def keep_points(self, points: Iterable[Any]) -> None:
        """Keep each point of a diagram of error against time, and which PyElastica it was measured with."""
        self.figures["points"] = [point.as_json() for point in points]
        if HAVE_ELASTICA:
            from elastica_rods import version

            self.figures["PyElastica"] = "not run" if self._quick else version()

    def write(self) -> Path:
        """Print goals, and write the file."""
        print(f"\nGoals of {self.name}" + (" (quick: these figures say nothing)" if self._quick else ""))
        for goal in self.goals:
            value = "not measured" if goal["value"] is None else f"{goal['value']:.4g}"
            word = "met" if goal["met"] else "NOT MET"
            print(f"  {goal['name']:60s} {value:>14s}   {goal['sign']} {goal['target']:g}   {word}")
        OUT.mkdir(parents=True, exist_ok=True)
        path = OUT / f"{self.name}.json"
        path.write_text(json.dumps(self._content(), indent=1, default=float) + "\n")
        print(f"  written to {path}")
        return path

    def _content(self) -> dict:
        return {
            "name": self.name,
            "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "command": _command(),
            "quick": self._quick,
            "machine": {"processor": _processor(), "processors": os.cpu_count(), "system": platform.platform()},
            "load": {"at the start": self._load, "at the end": _load()},
            "compiler": _first_line("c++", "--version"),
            "versions": {"withe": withe.__version__, "python": platform.python_version(), "numpy": np.__version__},
            "simd": os.environ.get("WITHE_SIMD", "chosen by the engine"),
            "took": round(time.monotonic() - self._start, 1),
            "goals": self.goals,
            "figures": self.figures,
            "tables": self.tables,
        }
