"""The command `withe track`."""

from __future__ import annotations

import argparse
import csv
import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np

from withe.common.extras import require
from withe.perception.drawing import draw_tracked
from withe.perception.film import FilmFrame, read_film
from withe.perception.tracker import Tracker

__all__ = ["add_parser", "run"]

_COLUMNS = ("frame", "time", "cable", "node", "x", "y", "visible")


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `track` to the commands of a parser."""
    parser = commands.add_parser(
        "track",
        help="follow cables through a film",
        description="Follow every cable of the first frame through a film; write NAME_cables.csv (one row per node and "
        "frame, in pixels) and NAME_cables.mp4 (overlay).",
    )
    parser.add_argument("film", type=Path, help="the film")
    parser.add_argument("--nodes", type=int, default=41, help="nodes of each cable (default: 41)")
    parser.add_argument("--names", nargs="+", help="names of the cables, longest first")
    parser.add_argument("--out", type=Path, default=Path("."), help="folder to write to (default: here)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Track the cables, write both files and print a summary."""
    cv2 = require("cv2", "vision")
    tracker = Tracker(nodes=arguments.nodes, names=arguments.names)
    frames = read_film(arguments.film)
    first = next(frames)
    arguments.out.mkdir(parents=True, exist_ok=True)
    stem = arguments.out / f"{arguments.film.stem}_cables"
    table, film = stem.with_suffix(".csv"), stem.with_suffix(".mp4")
    size = first.image.shape[1], first.image.shape[0]
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter_fourcc(*"mp4v"), first.rate, size)
    if not writer.isOpened():
        raise ValueError(f"out must take an MP4 file, could not write {film}")
    count = unseen = 0
    try:
        with table.open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(_COLUMNS)
            for count, frame in enumerate(itertools.chain([first], frames), 1):
                _add(frame, count - 1, tracker, rows, writer)
                unseen += not tracker.seen
    finally:
        writer.release()
    cables = len(tracker.cables)
    nothing = f", {unseen} without a cable" if unseen else ""
    sys.stdout.write(f"{cables} cable{'' if cables == 1 else 's'} in {count} frames{nothing}\n{table}\n{film}\n")
    return 0


def _add(frame: FilmFrame, number: int, tracker: Tracker, rows: Any, writer: Any) -> None:
    """Track one frame, and write its rows and its picture."""
    cables = tracker.update(frame.image, time=frame.time)
    for cable in cables:
        for node, ((x, y), visible) in enumerate(zip(cable.nodes, cable.visible, strict=True)):
            rows.writerow([number, f"{frame.time:.6g}", cable.name, node, f"{x:.3f}", f"{y:.3f}", int(visible)])
    writer.write(np.ascontiguousarray(draw_tracked(frame.image, cables)[..., ::-1]))
