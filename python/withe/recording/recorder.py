"""Recorder of frames from a running simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.frames import ENERGIES
from withe.common.outlines import BodyOutline, ObstacleOutline, RodOutline, SpringOutline, TendonOutline
from withe.recording.record import ROD_READOUTS, Record, RunGradient

__all__ = ["Recorder", "present"]


class Energies(Protocol):
    """Energies of a moment, with the names of `ENERGIES`."""

    @property
    def total(self) -> float:
        """Sum of the stored energies [J]."""


class Drawn(Protocol):
    """Handle of a rod."""

    @property
    def name(self) -> str:
        """Name of the rod."""

    @property
    def rows(self) -> npt.NDArray[np.int64]:
        """Rows of the rod among the nodes of the scene, shape (nodes,)."""

    @property
    def closed(self) -> bool:
        """True if an edge joins the last node to the first."""

    @property
    def radii(self) -> npt.NDArray[np.float64]:
        """Radii of the edges, shape (edges,) [m]."""


class Moving(Protocol):
    """Object with the read-outs of `Simulation`, also those of `ROD_READOUTS` by the name of a rod."""

    @property
    def time(self) -> float:
        """Present time [s]."""

    @property
    def rods(self) -> Sequence[Drawn]:
        """Rods in the order of the scene."""

    def positions(self) -> npt.NDArray[np.float64]:
        """Positions of all nodes, shape (nodes, 3) [m]."""

    def velocities(self) -> npt.NDArray[np.float64]:
        """Velocities of all nodes, shape (nodes, 3) [m/s]."""

    def position(self, body: str, /) -> npt.NDArray[np.float64]:
        """Origin of the axes of a rigid body, shape (3,) [m]."""

    def rotation(self, body: str, /) -> npt.NDArray[np.float64]:
        """Axes of a rigid body as columns, shape (3, 3)."""

    def obstacle_position(self, obstacle: str, /) -> npt.NDArray[np.float64]:
        """Position of an obstacle, shape (3,) [m]."""

    def energy(self) -> Energies:
        """Energies of the whole scene."""


class Derivatives(RunGradient, Protocol):
    """Data that a differentiable run keeps."""

    def note_frame(self) -> None:
        """A frame has been taken."""


S = TypeVar("S", bound=Moving)


class _Column:
    """An array that grows by whole frames."""

    def __init__(self, first: npt.NDArray[Any]) -> None:
        self._values = np.empty((16, *first.shape), first.dtype)

    def check(self, name: str, value: npt.NDArray[Any]) -> None:
        if value.shape != self._values.shape[1:]:
            raise ValueError(f"record[{name!r}] must keep its shape {self._values.shape[1:]}, got {value.shape}")

    def write(self, frame: int, value: npt.NDArray[Any]) -> None:
        if frame == len(self._values):
            self._values = np.concatenate([self._values, np.empty_like(self._values)])
        if not np.can_cast(value.dtype, self._values.dtype):
            self._values = self._values.astype(np.result_type(value, self._values))
        self._values[frame] = value

    def values(self, frames: int) -> npt.NDArray[Any]:
        return self._values[:frames].copy()


class Recorder(Generic[S]):
    """Takes frames from a simulation while it runs.

    Parameters
    ----------
    simulation
        Answers to the read-outs of `Simulation`.
    extra : mapping of str to callable
        Called with the simulation at every frame; each returns a number or an array, of one shape.
    obstacles : iterable of ObstacleOutline
        Whose positions to record.
    springs : iterable of SpringOutline
        To be drawn between their nodes.
    tendons : iterable of TendonOutline
        To be drawn through their guides.
    bodies : iterable of BodyOutline
        Rigid bodies, whose positions and rotations to record.

    Raises
    ------
    ValueError
        A name that is not text, or something that cannot be called.
    """

    def __init__(
        self,
        simulation: S,
        extra: Mapping[str, Callable[[S], npt.ArrayLike]] | None = None,
        obstacles: Iterable[ObstacleOutline] = (),
        springs: Iterable[SpringOutline] = (),
        tendons: Iterable[TendonOutline] = (),
        bodies: Iterable[BodyOutline] = (),
    ) -> None:
        self._simulation = simulation
        self._obstacles = tuple(obstacles)
        self._springs = tuple(springs)
        self._tendons = tuple(tendons)
        self._bodies = tuple(bodies)
        self._extra = dict(extra or {})
        for name, function in self._extra.items():
            if not isinstance(name, str):
                raise ValueError(f"names in record must be text, got {name!r}")
            if not callable(function):
                raise ValueError(f"record[{name!r}] must be a function, got {function!r}")
        self._rods = tuple(_outline(rod) for rod in simulation.rods)
        self._columns: dict[str, _Column] = {}
        self._frames = 0
        self.derivatives: Derivatives | None = None  # only in a differentiable run

    def capture(self) -> None:
        """Take one frame. A callback's exception propagates, and then no part of the frame is kept.

        Raises
        ------
        ValueError
            An extra that is not numbers, or changes its shape.
        """
        frame = self._frame()
        for index, name in enumerate(self._extra):
            if self._columns:
                self._columns[f"extra_{index}"].check(name, frame[f"extra_{index}"])
        if not self._columns:
            self._columns = {name: _Column(values) for name, values in frame.items()}
        for name, values in frame.items():
            self._columns[name].write(self._frames, values)
        self._frames += 1  # last, so that an interrupt leaves no half of a frame

    def _frame(self) -> dict[str, npt.NDArray[Any]]:
        simulation = self._simulation
        frame: dict[str, npt.NDArray[Any]] = {
            "times": np.array(simulation.time, float),
            "positions": simulation.positions(),
            "velocities": simulation.velocities(),
        }
        for index, rod in enumerate(self._rods):
            for readout in ROD_READOUTS:
                frame[f"rod_{index}_{readout}"] = getattr(simulation, readout)(rod.name)
        for index, obstacle in enumerate(self._obstacles):
            frame[f"obstacle_{index}_place"] = simulation.obstacle_position(obstacle.name)
        for index, body in enumerate(self._bodies):
            frame[f"body_{index}_position"] = simulation.position(body.name)
            frame[f"body_{index}_rotation"] = simulation.rotation(body.name)
        energy = simulation.energy()
        for name in ENERGIES:
            frame[f"energy_{name}"] = np.array(getattr(energy, name), float)
        for index, (name, function) in enumerate(self._extra.items()):
            frame[f"extra_{index}"] = _numbers(name, function(simulation))
        return frame

    @property
    def record(self) -> Record:
        """The frames taken so far."""
        if self._columns:
            arrays = {name: column.values(self._frames) for name, column in self._columns.items()}
        else:
            arrays = {name: values[None][:0].copy() for name, values in self._frame().items()}
        return Record(
            self._rods,
            arrays,
            self._extra,
            self._obstacles,
            self._springs,
            self._tendons,
            self.derivatives,
            self._bodies,
        )


def _numbers(name: str, value: npt.ArrayLike) -> npt.NDArray[Any]:
    if validation.has_masked(value):
        raise ValueError(f"record[{name!r}] must have a value everywhere, got a masked array with masked entries")
    try:
        array = np.array(value)
    except ValueError:
        array = np.array(None)
    if array.dtype.kind not in "biufc":
        raise ValueError(f"record[{name!r}] must return numbers of one shape, got {value!r}")
    return array


def present(
    simulation: Moving,
    obstacles: Iterable[ObstacleOutline] = (),
    springs: Iterable[SpringOutline] = (),
    tendons: Iterable[TendonOutline] = (),
    bodies: Iterable[BodyOutline] = (),
) -> Record:
    """A record of one frame: the present state of a simulation."""
    recorder = Recorder(simulation, None, obstacles, springs, tendons, bodies)
    recorder.capture()
    return recorder.record


def _outline(rod: Drawn) -> RodOutline:
    rows = np.array(rod.rows, np.int64)
    edges = len(rows) - (0 if rod.closed else 1)
    widths = getattr(rod, "widths", None)
    return RodOutline(
        name=rod.name,
        rows=rows,
        closed=bool(rod.closed),
        radii=np.array(np.broadcast_to(np.asarray(rod.radii, float), (edges,))),
        widths=None if widths is None else np.array(np.broadcast_to(widths, (edges, 2)), float),
    )
