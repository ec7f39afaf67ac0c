"""Table of a motion: one row per frame and node or body, with units in the header."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames, edges_to_nodes
from withe.export.gltf import quaternions

__all__ = ["write_csv"]

FloatArray = npt.NDArray[np.float64]

_COLUMNS = (
    "time [s]",
    "rod",
    "node",
    "x [m]",
    "y [m]",
    "z [m]",
    "vx [m/s]",
    "vy [m/s]",
    "vz [m/s]",
    "tension [N]",
    "curvature_1 [1/m]",
    "curvature_2 [1/m]",
    "twist [rad/m]",
)
_BODY_COLUMNS = ("body", "qw [-]", "qx [-]", "qy [-]", "qz [-]")


def write_csv(record: Frames, path: Path) -> None:
    """Write a table with a row for each frame, rod and node, and for each frame and rigid body.

    Numbers have all their digits. The tension of a node is the mean of its edges. The ends of an open rod have no
    curvature and no twist, so these cells are empty. Bodies have their name, the position of their origin and a unit
    quaternion, in columns that tables without bodies do not have.

    Parameters
    ----------
    record : Record
    path : pathlib.Path
    """
    blocks = [(rod.name, _values(record, rod)) for rod in record.rods]
    bodies = [(body.name, record.body_position(body), _turns(record, body)) for body in record.bodies]
    beyond = [""] * len(_BODY_COLUMNS) if bodies else []
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_COLUMNS + (_BODY_COLUMNS if bodies else ()))
        for frame, time in enumerate(record.times.tolist()):
            for name, values in blocks:
                # Empty where a value is NaN, which spreadsheets read as text.
                rows = ([number if number == number else "" for number in row] for row in values[frame].tolist())
                writer.writerows([time, name, node, *row, *beyond] for node, row in enumerate(rows))
            for name, places, turns in bodies:
                x, y, z, w = turns[frame].tolist()
                writer.writerow([time, "", "", *places[frame].tolist(), *[""] * 7, name, w, x, y, z])


def _values(record: Frames, rod: Any) -> FloatArray:
    """Numbers of a rod after its name, shape (frames, nodes, 10)."""
    return np.concatenate(
        [
            record.positions(rod),
            record.velocities(rod),
            edges_to_nodes(record.tensions(rod), rod.closed)[..., None],
            _at_nodes(record.curvatures(rod), rod.closed),
            _at_nodes(record.twists(rod)[..., None], rod.closed),
        ],
        axis=-1,
    )


def _turns(record: Frames, body: Any) -> FloatArray:
    """Quaternions x, y, z, w of a body, shape (frames, 4)."""
    return quaternions(np.swapaxes(record.body_rotation(body), -1, -2)[:, None])[:, 0]


def _at_nodes(values: FloatArray, closed: bool) -> FloatArray:
    """Values of stencils at the nodes; NaN at the ends of an open rod."""
    return values if closed else np.pad(values, [(0, 0), (1, 1), (0, 0)], constant_values=np.nan)
