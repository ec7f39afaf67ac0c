"""Loads put on, changed and taken off while a simulation runs."""

from __future__ import annotations

from typing import Any, cast

from withe.parts.applied_loads import load_vector
from withe.parts.description import describe_load
from withe.parts.directory import Directory
from withe.parts.handles import Load
from withe.parts.kinds import LoadPart
from withe.simulation.session import Session

__all__ = ["RunningLoads", "load_index", "remove_load", "set_load"]


class RunningLoads:
    """A simulation as loads see it: they act from now on, until it is reset."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @property
    def directory(self) -> Directory:
        """Parts of the simulation."""
        return self._session.directory

    @property
    def time(self) -> float:
        """Now [s]."""
        return self._session.world.time

    def take(self, part: LoadPart) -> Load:
        """Let a load act from now on."""
        self._session.world.add_load(describe_load(part))
        self._session.settings.loads[part.name] = part
        if part.function is not None:
            self._session.settings.functions[part.name] = part.function
        return cast(Load, self._session.directory.add(part))


def load_index(session: Session, part: LoadPart) -> int:
    """How the engine calls a load."""
    return session.loads.index(part)


def remove_load(session: Session, load: Load | str) -> None:
    """Take a load off; see `Simulation.remove`."""
    part = session.directory.find(load, LoadPart, "load")
    if part.name not in session.settings.loads:
        raise ValueError(
            f"load {part.name!r} was drawn with the scene, and stays: set({part.name!r}, {part.kind}=...) to zero"
        )
    session.world.remove_load(load_index(session, part))
    del session.settings.loads[part.name]
    session.settings.functions.pop(part.name, None)
    session.directory.remove(part.name)


def set_load(session: Session, part: LoadPart, value: Any) -> None:
    """Change a load that acts, to a constant or a function of time."""
    what = f"{part.kind} {part.name!r}"
    function = value if callable(value) else None
    now = load_vector(value(session.world.time) if callable(value) else value, part.axis, what)
    session.world.set_load(load_index(session, part), now)
    if function is None:
        session.settings.functions.pop(part.name, None)
    else:
        session.settings.functions[part.name] = function
