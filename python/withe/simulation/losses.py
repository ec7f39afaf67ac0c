"""Losses: derivatives of a scalar by read-outs of a simulation, checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.handles import NodeHandle, Rod, Support
from withe.parts.kinds import RodPart
from withe.simulation.session import Session
from withe.simulation.supports import find_support

__all__ = ["READOUTS", "check_in_plane", "readout_adjoints", "readout_shape", "spoken"]

FloatArray = npt.NDArray[np.float64]

_NODAL = ("positions", "velocities")
_OF_EDGES = {"directors": (3, 3), "tensions": (), "spins": ()}
_OF_STENCILS = {"curvatures": (2,), "twists": ()}
_OF_SUPPORTS = {"reaction_forces": (3,), "reaction_moments": (3,)}
READOUTS = (*_NODAL, *_OF_EDGES, *_OF_STENCILS, *_OF_SUPPORTS)


def readout_shape(session: Session, of: Rod | Support | NodeHandle | str, word: str) -> tuple[int, ...]:
    """Return the shape of a read-out of a rod or a support at a moment."""
    if word in _OF_SUPPORTS:
        find_support(session, of)
        return _OF_SUPPORTS[word]
    part = session.directory.rod(_as_rod(of))
    if word in _NODAL:
        return part.points.shape
    if word in _OF_EDGES:
        return (len(part.tangents), *_OF_EDGES[word])
    if word in _OF_STENCILS:
        return (len(part.voronoi), *_OF_STENCILS[word])
    raise ValueError(f"{part.owner} has no read-out {word!r}; its read-outs are {', '.join(READOUTS)}")


def readout_adjoints(
    session: Session, by: Mapping[str, Any], frames: int, *, in_plane: bool = False
) -> list[_core.ReadoutAdjoint]:
    """Return one adjoint per frame, from arrays by words of read-outs whose first axis is the frame.

    `in_plane` refuses derivatives by nodes of a planar scene that point out of its plane.
    """
    if not isinstance(by, Mapping) or not by or not set(by) <= set(READOUTS):
        got = ", ".join(map(repr, by)) or "none" if isinstance(by, Mapping) else type(by).__name__
        raise ValueError(f"gradient needs derivatives with respect to {', '.join(READOUTS)}, got {got}")
    tables = {word: _table(session, word, value, frames) for word, value in by.items()}
    for word in set(tables) & set(_NODAL) if in_plane else ():
        check_in_plane(session, tables[word], word)
    out = []
    for frame in range(frames):
        adjoint = _core.ReadoutAdjoint()
        for word, table in tables.items():
            # The first frame of a run has no reactions to differentiate.
            if word not in _OF_SUPPORTS or table[frame].any():
                setattr(adjoint, word, table[frame])
        out.append(adjoint)
    return out


def check_in_plane(session: Session, array: FloatArray, name: str) -> None:
    """Refuse derivatives that point out of the plane in which a planar scene moves."""
    normal = session.world.plane_normal
    if normal is None or not array.size:
        return
    if np.abs(array @ normal).max() > 1e-9 * max(np.abs(array).max(), 1e-300):
        raise ValueError(
            f"{name} must lie in the plane of the scene: set the component along the normal {normal} to zero, or "
            "build with planar=False"
        )


def _table(session: Session, word: str, value: Any, frames: int) -> FloatArray:
    """Return derivatives by every node, edge, stencil or support, for the engine: (frames, rows, ...)."""
    if word in _NODAL and not isinstance(value, Mapping):
        nodes = session.directory.layout.node_count
        return validation.number_array(value, word, (frames, nodes, 3))
    if not isinstance(value, Mapping):
        whose = "supports" if word in _OF_SUPPORTS else "rods"
        raise ValueError(f"derivatives by {word} must be given for {whose}, such as {{{word!r}: {{arm: array}}}}")
    return _of_parts(session, word, value, frames)


def _of_parts(session: Session, word: str, value: Mapping[Any, Any], frames: int) -> FloatArray:
    shapes = {target: (frames, *readout_shape(session, target, word)) for target in value}
    table = np.zeros((frames, *_whole_shape(session, word)))
    for target, given in value.items():
        array = validation.number_array(given, f"derivatives by {word} of {spoken(target)}", shapes[target])
        rows = _rows(session, target, word)
        # A rod may pass a node twice.
        for frame, part in zip(table, array.reshape(frames, len(rows), *table.shape[2:]), strict=True):
            np.add.at(frame, rows, part)
    return table


def _whole_shape(session: Session, word: str) -> tuple[int, ...]:
    if word in _NODAL:
        return (session.directory.layout.node_count, 3)
    if word in _OF_SUPPORTS:
        return (1 + max(index for index, _ in session.settings.supports.values()), 3)
    parts = session.directory.all(RodPart)
    if word in _OF_EDGES:
        return (sum(len(part.tangents) for part in parts), *((9,) if word == "directors" else ()))
    return (sum(len(part.voronoi) for part in parts), *_OF_STENCILS[word])


def _rows(session: Session, target: Any, word: str) -> npt.NDArray[np.int64]:
    """Return the rows of a part in the arrays of the whole scene."""
    if word in _OF_SUPPORTS:
        return np.array([find_support(session, target)[0]])
    part = session.directory.rod(_as_rod(target))
    if word in _NODAL:
        return session.directory.layout.rows(part.index)
    parts = session.directory.all(RodPart)
    counts = [len(each.tangents if word in _OF_EDGES else each.voronoi) for each in parts]
    return np.arange(sum(counts[: part.index]), sum(counts[: part.index + 1]))


def _as_rod(target: Any) -> Rod | str:
    if not isinstance(target, Rod | str):
        raise ValueError(f"read-outs must be given for rods, got {target!r}")
    return target


def spoken(target: Any) -> str:
    """Return the name of a part in messages."""
    return repr(target if isinstance(target, str) else getattr(target, "name", target))
