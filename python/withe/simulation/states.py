"""Rods put elsewhere while a simulation runs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.handles import Rod
from withe.parts.kinds import RodPart
from withe.recording.record import Record
from withe.simulation.session import Session

__all__ = ["restore_frame", "set_state", "set_velocities"]

FloatArray = npt.NDArray[np.float64]


def set_state(
    session: Session,
    rod: Rod | str,
    positions: npt.ArrayLike | None,
    velocities: npt.ArrayLike | None,
    twist: npt.ArrayLike | None,
    directors: npt.ArrayLike | None,
    spins: npt.ArrayLike | None,
) -> None:
    """Put a rod elsewhere; see `Simulation.set_state`."""
    part = session.directory.rod(rod)
    state = _core.RodState()
    state.rod = part.index
    if twist is not None and directors is not None:
        raise ValueError(f"twist of {part.owner} must not be given together with directors")
    if velocities is not None:
        state.velocities = validation.number_array(
            np.broadcast_to(
                validation.number_array(velocities, f"velocities of {part.owner}", part.points.shape, (3,)),
                part.points.shape,
            ),
            "velocities",
            part.points.shape,
        )
    if spins is not None:
        state.spins = validation.per_item(spins, f"spins of {part.owner}", len(part.tangents), "edges", sign=True)
    if positions is not None or twist is not None or directors is not None:
        _place(session, part, state, positions, twist, directors)
    session.world.set_state([state], None)


def set_velocities(session: Session, rod: Rod | str | None, velocities: npt.ArrayLike) -> None:
    """Set velocities of nodes; see `Simulation.set_velocities`."""
    now = np.array(session.world.velocities())
    if rod is None:
        now[:] = validation.number_array(velocities, "velocities", now.shape, (3,))
    else:
        part = session.directory.rod(rod)
        shape = part.points.shape
        now[session.directory.layout.rows(part.index)] = validation.number_array(
            velocities, f"velocities of {part.owner}", shape, (3,)
        )
    session.world.set_velocities(now)


def _place(
    session: Session,
    part: RodPart,
    state: _core.RodState,
    positions: npt.ArrayLike | None,
    twist: npt.ArrayLike | None,
    directors: npt.ArrayLike | None,
) -> None:
    """Fill in where a rod is to be, frames included."""
    points = session.world.positions()[session.directory.layout.rows(part.index)]
    if positions is not None:
        points = validation.number_array(positions, f"positions of {part.owner}", part.points.shape)
    tangents = _tangents(points, part)
    turns = np.zeros(len(part.voronoi))
    if directors is not None:
        first = _first_directors(directors, tangents, part)
    else:
        now = session.world.directors(part.index).reshape(-1, 3, 3)[0]
        plan = session.world.plan
        normal = np.array(plan.plane_normal) if plan.planar else now[0]
        start = _carried(now[0], now[2], tangents[0], normal)
        if twist is None:
            turns = np.array(session.world.twists(part.index)) * part.voronoi
        else:
            turns = _per_stencil(twist, part) * part.voronoi
        first, turns = _laid(start, tangents, turns, part, must_close=twist is not None)
    state.positions, state.directors, state.twists = points, first, turns / part.voronoi


def restore_frame(session: Session, record: Record, frame: int) -> None:
    """Make a frame of a record the present state; see `Simulation.restore`."""
    parts = session.directory.all(RodPart)
    if len(record.rods) != len(parts) or any(
        outline.name != part.name
        or outline.closed != part.closed
        or not np.array_equal(outline.rows, session.directory.layout.rows(part.index))
        for outline, part in zip(record.rods, parts, strict=True)
    ):
        raise ValueError("record belongs to another scene: its rods differ")
    count = len(record)
    frame = validation.integer(frame, "frame", -count, count - 1)
    states = []
    for part in parts:
        state = _core.RodState()
        state.rod = part.index
        state.positions = record.positions(part.name)[frame]
        state.velocities = record.velocities(part.name)[frame]
        state.directors = record.directors(part.name)[frame, :, 0]
        state.twists = record.twists(part.name)[frame]
        state.spins = record.spins(part.name)[frame]
        states.append(state)
    session.world.set_state(states, float(record.times[frame]))


def _tangents(points: FloatArray, part: RodPart) -> FloatArray:
    edges = np.diff(points, axis=0, append=points[:1]) if part.closed else np.diff(points, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    if not lengths.min() > 1e-6 * part.lengths.min():
        raise ValueError(
            f"positions of {part.owner} must not give an edge zero length, but do for edge {int(lengths.argmin())}"
        )
    return np.asarray(edges / lengths[:, None])


def _first_directors(directors: npt.ArrayLike, tangents: FloatArray, part: RodPart) -> FloatArray:
    """Return first directors, made exactly normal to the tangents. Refuse deviations above 1e-6."""
    edges = len(tangents)
    given = validation.number_array(directors, f"directors of {part.owner}", (edges, 3, 3), (edges, 3))
    if given.ndim == 3:
        off = max(np.abs(given[:, 2] - tangents).max(), np.abs(np.cross(given[:, 2], given[:, 0]) - given[:, 1]).max())
        if off > 1e-6:
            raise ValueError(f"directors of {part.owner} must be d1, d2 and the tangent of each edge, off by {off:.3g}")
        given = given[:, 0]
    along = np.sum(given * tangents, axis=1)
    if max(np.abs(along).max(), np.abs(np.linalg.norm(given, axis=1) - 1.0).max()) > 1e-6:
        raise ValueError(f"directors of {part.owner} must be unit vectors normal to their edges")
    normal = given - along[:, None] * tangents
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def _per_stencil(twist: npt.ArrayLike, part: RodPart) -> FloatArray:
    return validation.per_item(twist, f"twist of {part.owner}", len(part.voronoi), "stencils", sign=True)


def _carried(director: FloatArray, start: FloatArray, end: FloatArray, axis: FloatArray) -> FloatArray:
    """A director turned by the smallest turn from one tangent to another; right round: about the axis."""
    cosine = float(start @ end)
    if cosine < -1.0 + 1e-12:
        turned = 2.0 * axis * float(axis @ director) - director
    else:
        across = np.cross(start, end)
        turned = cosine * director + np.cross(across, director) + across * float(across @ director) / (1.0 + cosine)
    turned = turned - end * float(end @ turned)
    return np.asarray(turned / np.linalg.norm(turned))


def _laid(
    start: FloatArray, tangents: FloatArray, turns: FloatArray, part: RodPart, *, must_close: bool
) -> tuple[FloatArray, FloatArray]:
    """Return first directors, turned by `turns` [rad] at each stencil from the first edge on, and these turns.

    In a closed rod, turns that do not close are corrected evenly, or refused.
    """
    directors = np.empty_like(tangents)
    directors[0] = start
    inner = turns[1:] if part.closed else turns
    spread = 0.0
    for _ in range(2):
        for edge in range(1, len(tangents)):
            flat = _carried(directors[edge - 1], tangents[edge - 1], tangents[edge], directors[edge - 1])
            angle = inner[edge - 1] - spread
            directors[edge] = np.cos(angle) * flat + np.sin(angle) * np.cross(tangents[edge], flat)
        if not part.closed:
            return directors, turns
        flat = _carried(directors[-1], tangents[-1], tangents[0], directors[-1])
        found = float(np.arctan2(np.cross(flat, start) @ tangents[0], flat @ start))
        excess = float(turns[0] - spread - found)
        excess -= 2.0 * np.pi * round(excess / (2.0 * np.pi))
        if must_close and abs(excess) > 1e-6:
            raise ValueError(
                f"twist of {part.owner} must close the rod, but the last edge is turned by {excess:.6g} rad "
                "against the first: give directors instead, or spread the difference over the rod"
            )
        if abs(excess) < 1e-12:
            break
        spread += excess / len(turns)
    return directors, turns - spread
