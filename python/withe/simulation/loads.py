"""Loads that are added, changed and removed during a simulation."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import numpy.typing as npt

from withe.parts.applied_loads import load_values
from withe.parts.description import describe_load
from withe.parts.directory import Directory
from withe.parts.handles import Load
from withe.parts.kinds import LoadPart
from withe.simulation.readers import Reader
from withe.simulation.session import Session

__all__ = [
    "RunningLoads",
    "load_index",
    "load_reader",
    "load_rows",
    "load_value",
    "new_values",
    "remove_load",
    "set_load",
]

FloatArray = npt.NDArray[np.float64]


class RunningLoads:
    """A simulation as the methods for loads use it: new loads act from now on, until a reset."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @property
    def directory(self) -> Directory:
        """Parts of the simulation."""
        return self._session.directory

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._session.world.time

    def take(self, part: LoadPart) -> Load:
        """Add a load that acts from now on."""
        self._session.world.add_load(describe_load(self._session.directory, part))
        self._session.settings.loads[part.name] = part
        if part.function is not None:
            self._session.settings.functions[part.name] = part.function
        return cast(Load, self._session.directory.add(part))


def load_index(session: Session, part: LoadPart) -> int:
    """Return the index of a load in the engine."""
    return session.loads.index(part)


def load_rows(session: Session, part: LoadPart) -> slice:
    """Rows of a load among the rows of all loads."""
    first = sum(len(np.atleast_2d(other.value)) for other in session.loads[: load_index(session, part)])
    return slice(first, first + len(np.atleast_2d(part.value)))


def new_values(session: Session, part: LoadPart, value: npt.ArrayLike, what: str) -> FloatArray:
    """Return a value for a load, with as many rows as its first value.

    Raises
    ------
    ValueError
        A value of another shape, or one row per edge if the first value had one row for all.
    """
    rows = len(np.atleast_2d(part.value)) if part.value.ndim == 2 else None
    values = load_values(value, part.axis, rows, what)
    return np.broadcast_to(values, part.value.shape if rows else values.shape).reshape(-1, 3)


def remove_load(session: Session, load: Load | str) -> None:
    """Remove a load; see `Simulation.remove`."""
    part = session.directory.find(load, LoadPart, "load")
    if part.name not in session.settings.loads:
        raise ValueError(
            f"load {part.name!r} belongs to the scene and cannot be removed: use set({part.name!r}, "
            f"{part.kind}=...) to make it zero"
        )
    session.world.remove_load(load_index(session, part))
    del session.settings.loads[part.name]
    session.settings.functions.pop(part.name, None)
    session.directory.remove(part.name)


def set_load(session: Session, part: LoadPart, values: dict[str, Any]) -> None:
    """Change a load to a constant or a function of time."""
    value = values[part.kind]
    what = f"{part.kind} {part.name!r}"
    function = value if callable(value) else None
    now = new_values(session, part, value(session.world.time) if callable(value) else value, what)
    session.world.set_load(load_index(session, part), now)
    if function is None:
        session.settings.functions.pop(part.name, None)
    else:
        session.settings.functions[part.name] = function


def load_value(session: Session, part: LoadPart, word: str) -> Any:
    """Return the present value of a load, in the shape of its first value."""
    value = np.array(session.world.load(load_index(session, part))).reshape(part.value.shape)
    if part.axis is None:
        return value
    along = value @ part.axis
    return along if along.ndim else float(along)


def load_reader(session: Session, part: LoadPart, word: str) -> Reader:
    """Return the reader of the derivative by the value of a load."""
    rows, axis, shape = load_rows(session, part), part.axis, part.value.shape
    if part.name in session.settings.functions:
        raise ValueError(
            f"no gradient with respect to {part.name!r} is available, because {part.name!r} is a function of time"
        )
    if axis is None:
        return lambda g: g.parameters.loads[rows].reshape(shape)
    return lambda g: (g.parameters.loads[rows].reshape(shape) @ axis)[()]
