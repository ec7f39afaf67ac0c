"""Gradients of equilibria and of runs, in the words of `set` and `get`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.handles import NodeHandle
from withe.parts.kinds import RodPart, SupportPart
from withe.simulation.access import word_of
from withe.simulation.calls import Gradients, Ledger, RunJournal
from withe.simulation.drawn import DrawnNodes, Moment
from withe.simulation.losses import check_in_plane, readout_adjoints, readout_shape, spoken
from withe.simulation.motion import POSE_WORDS
from withe.simulation.parameters import get_value, set_values
from withe.simulation.session import Session
from withe.simulation.unknowns import (
    INITIAL_WORDS,
    Unknown,
    check_list,
    is_points,
    unknown_reader,
    unknown_readers,
)

__all__ = [
    "Loss",
    "RunDerivatives",
    "equilibrium_gradient",
    "equilibrium_gradients",
    "equilibrium_jacobian",
]

FloatArray = npt.NDArray[np.float64]

_DRIVES = 1e-11  # share of the work over any motion, above which work over a neutral one is no rounding

Loss = npt.ArrayLike | Mapping[str, Any]
"""Derivatives of a scalar: by positions of every node, or by words of read-outs; see `Equilibrium.gradient`."""


def _poses_unknown(session: Session) -> bool:
    """Return True if derivatives of reaction moments by poses are not available.

    Reactions contain the inertia of rotating supports and of held edges in space, at other rates than the equations of
    a midpoint step. The stages of a fourth-order step take moments about the position of the hand in each stage.
    """
    if session.options.integrator in ("implicit_midpoint", "fourth_order"):
        return True
    held = any(part.kind == "hold_edge" for part in session.directory.all(SupportPart))
    return held and not session.world.plan.planar


def equilibrium_gradient(session: Session, by: Loss, wrt: Sequence[Unknown]) -> list[Any]:
    """Derivatives of a scalar of the present equilibrium; see `Equilibrium.gradient`."""
    in_plane = session.options.planar is True
    if isinstance(by, Mapping):
        frames = {word: _with_frame(value) for word, value in by.items()}
        adjoints = readout_adjoints(session, frames, 1, in_plane=in_plane)
    else:
        by_positions = validation.number_array(by, "dL_dx", (session.directory.layout.node_count, 3))
        if in_plane:
            check_in_plane(session, by_positions, "dL_dx")
        adjoints = [_by_positions(by_positions)]
    return [value for (value,) in _gradients(session, adjoints, wrt)]


def equilibrium_gradients(session: Session, by_positions: FloatArray, wrt: Sequence[Unknown]) -> list[list[Any]]:
    """Derivatives of several scalars of the present equilibrium: for each of `wrt`, one per scalar.

    `by_positions` has the shape (scalars, nodes, 3), is finite, and lies in the plane of a planar scene. The stiffness
    is factorised once for all scalars.
    """
    return _gradients(session, [_by_positions(each) for each in by_positions], wrt)


def _gradients(session: Session, by: list[_core.ReadoutAdjoint], wrt: Sequence[Unknown]) -> list[list[Any]]:
    """Return the derivatives of every scalar by each of `wrt`.

    Raises
    ------
    ValueError
        An unknown that drives a neutral motion, such as the spin of a rod that can spin freely.
    """
    readers = unknown_readers(session, wrt)
    scalars, works = session.world.equilibrium_gradients(by)
    out = []
    for unknown, read in zip(wrt, readers, strict=True):
        if works:
            drives, typical = (np.abs(np.asarray(read(work))).max(initial=0.0) for work in works)
            if drives > _DRIVES * typical:
                name = unknown if isinstance(unknown, str) else f"{unknown[1]} of {spoken(unknown[0])}"
                raise ValueError(
                    f"no gradient with respect to {name} is available, because {name} drives a motion without "
                    "resistance: support the rods so that none can move or spin freely"
                )
        out.append([read(gradient) for gradient in scalars])
    return out


def _by_positions(values: FloatArray) -> _core.ReadoutAdjoint:
    adjoint = _core.ReadoutAdjoint()
    adjoint.positions = values
    return adjoint


def equilibrium_jacobian(session: Session, of: Any, wrt: Sequence[Unknown]) -> list[FloatArray]:
    """Derivatives of a read-out in the present equilibrium; see `Equilibrium.jacobian`."""
    if isinstance(of, NodeHandle) or (isinstance(of, str) and "." in of):
        node, _ = session.directory.node(of, "of")
        shape: tuple[int, ...] = (3,)
        by = np.zeros((3, session.directory.layout.node_count, 3))
        by[:, session.directory.row(node)] = np.eye(3)
        tables: dict[str, Any] = {"positions": by}
    else:
        if isinstance(of, tuple) and len(of) == 2 and isinstance(of[1], str):
            target, word = of
        else:
            target, word = of, "positions"
        shape = readout_shape(session, target, word)
        count = int(np.prod(shape))
        tables = {word: {target: np.eye(count).reshape(count, *shape)}}
    if tables.keys() == {"positions"}:
        rows = [session.directory.row(node)] if len(shape) == 1 else _rows_of(session, target)
        if (forward := _forward_jacobian(session, np.asarray(rows), wrt)) is not None:
            return [found.reshape(*shape, *found.shape[2:]) for found in forward]
    out = []
    for found in _gradients(session, readout_adjoints(session, tables, int(np.prod(shape))), wrt):
        values = np.array(found)
        out.append(values.reshape(*shape, *values.shape[1:]))
    return out


def _rows_of(session: Session, rod: Any) -> npt.NDArray[np.int64]:
    return session.directory.layout.rows(session.directory.rod(rod).index)


def _forward_jacobian(session: Session, rows: npt.NDArray[np.int64], wrt: Sequence[Unknown]) -> list[FloatArray] | None:
    """Derivatives of positions of nodes, one (nodes, 3, ...) for each of `wrt`, by one linear solve per unknown number.

    Return None if the adjoint method takes fewer solves or is more general. It is more general where the residual is
    not linear in an unknown (so that a difference is no derivative), where rods touch, and for free motions.
    """
    if session.options.planar is not True and session.world.plane_normal is not None:
        return None  # derivatives out of the plane need the adjoint method
    unknown_readers(session, wrt)  # raises for unknowns without a gradient
    if session.world.equilibrium_gradients([])[1]:
        return None
    changes: list[FloatArray] = []
    helds: list[FloatArray] = []
    shapes: list[tuple[int, ...]] = []
    try:
        copy = session.copy()
        start = np.array(copy.world.equilibrium_residual())
        for unknown in wrt:
            found = _directions(copy, unknown, start, 3 * len(rows) - sum(len(each) for each in changes))
            if found is None:
                return None
            changes.append(found[0])
            helds.append(found[1])
            shapes.append(found[2])
        moved = session.world.equilibrium_responses(np.concatenate(changes).T, np.concatenate(helds).T)
    except ValueError:
        return None  # the adjoint method gives the reason, or has derivatives
    by_rows = np.asarray(moved).reshape(-1, 3, moved.shape[1])[rows]
    ends = np.cumsum([len(each) for each in changes])
    parts = np.split(by_rows, ends[:-1], axis=2)
    return [part.reshape(*part.shape[:2], *shape) for part, shape in zip(parts, shapes, strict=True)]


def _directions(
    copy: Session, unknown: Unknown, start: FloatArray, most: int
) -> tuple[FloatArray, FloatArray, tuple[int, ...]] | None:
    """Return changes of the residual and of supported unknowns by each number of an unknown, and its shape.

    None where there are `most` numbers or more, or the residual is not linear in them.
    """
    target, word = (None, unknown) if isinstance(unknown, str) else unknown
    if isinstance(target, tuple):
        return None
    part = None if target is None else copy.directory.find_any(target, "wrt")
    if isinstance(part, SupportPart) and word in POSE_WORDS and most > 3:
        index = copy.settings.supports[part.name][0]
        held = np.array(copy.world.support_directions(index)).T[slice(0, 3) if word == "position" else slice(3, 6)]
        return np.zeros_like(held), held, (3,)
    known = word_of(part, word)
    if known is None or not known.is_linear:
        return None
    value = np.array(get_value(copy, word, None) if part is None else get_value(copy, part.name, word), np.float64)
    if value.size >= most or (isinstance(part, RodPart) and value.ndim > 0):
        return None
    name = None if part is None else part.name
    size = float(np.abs(value).max()) or 1.0
    set_values(copy, name, {word: value[()]})
    if not np.array_equal(copy.world.equilibrium_residual(), start):
        return None  # it sets more than its value, such as stiffnesses that were given after it
    columns = np.zeros((value.size, len(start)))
    for column, step in zip(columns, size * np.eye(value.size), strict=True):
        set_values(copy, name, {word: (value + step.reshape(value.shape))[()]})
        column[:] = (np.array(copy.world.equilibrium_residual()) - start) / size
    set_values(copy, name, {word: value[()]})
    return columns, np.zeros_like(columns), value.shape


def _with_frame(value: Any) -> Any:
    """With the axis of frames that read-outs of runs have."""
    if isinstance(value, Mapping):
        return {target: _with_frame(each) for target, each in value.items()}
    return np.asarray(value)[None]


class RunDerivatives:
    """Data of a differentiable run: its tape, the values that were set, and the step of each frame."""

    def __init__(self, session: Session) -> None:
        self._session = replace(
            session, settings=session.settings.copy(), journal=None, contact_then=session.world.contact
        )
        self._running = session
        self._begin = Moment.now(session)
        self._tape = session.world.start_tape()
        self._journal = session.journal = RunJournal(self._tape, session)
        self._steps: list[int] = []
        self._calls: list[int] = []

    def note_frame(self) -> None:
        """Note that a frame was recorded."""
        self._running.world.note_moment()
        self._steps.append(self._tape.count)
        self._calls.append(len(self._journal.calls))

    def end(self) -> None:
        """End the run."""
        self._running.world.stop_tape()
        self._running.journal = None

    def gradient(self, by: Mapping[str, Any], wrt: Sequence[Unknown]) -> Gradients:
        """See `Record.gradient`."""
        check_list(wrt, may_be_empty=bool(self._journal.calls))
        drawn = {place: self._drawn(unknown) for place, unknown in enumerate(wrt) if is_points(unknown)}
        acting = [place for place, unknown in enumerate(wrt) if unknown not in INITIAL_WORDS and place not in drawn]
        kept = [wrt[place] for place in acting]
        adjoints = readout_adjoints(self._session, by, len(self._steps), in_plane=True)
        ledger = Ledger(
            self._session,
            self._journal,
            self._calls,
            kept,
            [unknown_reader(self._session, unknown) for unknown in kept],
            drawn=list(drawn.values()),
            by_moves=not ("reaction_moments" in by and _poses_unknown(self._session)),
        )
        initial = self._tape.gradient(
            [_core.MomentAdjoint(steps, each) for steps, each in zip(self._steps, adjoints, strict=True)],
            ledger.visit,
            ledger.visit_poses if ledger.moves else None,
        )
        ledger.add_start(initial.poses)
        values: list[Any] = [None] * len(wrt)
        for place, value in zip(acting, ledger.sums, strict=True):
            values[place] = value
        for place, nodes in drawn.items():
            values[place] = nodes.gradient(initial)
        for place, unknown in enumerate(wrt):
            if unknown in INITIAL_WORDS:
                values[place] = np.array(getattr(initial, unknown.removeprefix("initial_")))
        return Gradients(values, ledger.calls)

    def _drawn(self, unknown: Any) -> DrawnNodes:
        part = self._session.directory.rod(unknown[0])
        if any(isinstance(call.part, SupportPart) for call in self._journal.calls):
            raise ValueError(
                f"no gradient with respect to points of {part.owner} is available after a support has moved"
            )
        return DrawnNodes(self._session, part, self._begin, run=True)
