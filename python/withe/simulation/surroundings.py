"""Masses, drag and fluids while a simulation runs: set, read and differentiated."""

from __future__ import annotations

from typing import Any

import numpy as np

from withe.common import validation
from withe.parts.description import added_mass, drag
from withe.parts.kinds import DragPart, FluidPart, MassPart, RodPart
from withe.parts.table import checked
from withe.simulation.readers import Reader
from withe.simulation.rods import edges_of, set_rod
from withe.simulation.session import Session

__all__ = [
    "drag_reader",
    "drag_value",
    "dragged_rods",
    "fluid_reader",
    "fluid_value",
    "mass_reader",
    "mass_value",
    "set_drag",
    "set_fluid",
    "set_mass",
]


def set_mass(session: Session, part: MassPart, values: dict[str, Any]) -> None:
    """Change a mass [kg]."""
    masses = session.settings.masses | {part.name: checked(MassPart, "mass", values["mass"], part.name)}
    session.world.set_added_mass(added_mass(session.directory, masses))
    session.settings.masses = masses


def mass_value(session: Session, part: MassPart, word: str) -> float:
    """Return the present mass [kg]."""
    return session.settings.masses[part.name]


def mass_reader(session: Session, part: MassPart, word: str) -> Reader:
    """Return the reader of the derivative by a mass."""
    row = session.directory.row(part.node)
    return lambda g: float(g.parameters.added_mass[row])


def set_drag(session: Session, part: DragPart, values: dict[str, Any]) -> None:
    """Change the drag of the rods on which a part acts [Pa s]."""
    drags = session.settings.drags | {part.name: checked(DragPart, "drag", values["drag"], part.name)}
    for rod in dragged_rods(session, part):
        set_rod(session, rod, {"drag": drag(session.directory, drags, rod)})
    session.settings.drags = drags


def drag_value(session: Session, part: DragPart, word: str) -> float:
    """Return the present drag [Pa s]."""
    return session.settings.drags[part.name]


def drag_reader(session: Session, part: DragPart, word: str) -> Reader:
    """Return the reader of the derivative by a drag."""
    edges = np.concatenate([np.arange(*edges_of(session, rod.index)) for rod in dragged_rods(session, part)])
    return lambda g: float(g.parameters.drag[edges].sum())


def dragged_rods(session: Session, part: DragPart) -> list[RodPart]:
    """Return the rods on which a drag acts."""
    return [rod for rod in session.directory.all(RodPart) if part.rods is None or rod.index in part.rods]


def set_fluid(session: Session, part: FluidPart, values: dict[str, Any]) -> None:
    """Change viscosity and regularization, all or none."""
    numbers = {word: validation.positive(value, f"{word} of {part.name!r}") for word, value in values.items()}
    if "regularization" in numbers and part.model != "stokeslets":
        raise ValueError(f"regularization of {part.name!r} needs model='stokeslets', got model={part.model!r}")
    session.world.set(0, {f"fluid_{word}": number for word, number in numbers.items()})
    if "viscosity" in numbers:
        session.settings.fluids = session.settings.fluids | {part.name: numbers["viscosity"]}


def fluid_value(session: Session, part: FluidPart, word: str) -> float | None:
    """Return the present viscosity [Pa s] or regularization [m]."""
    if word == "viscosity":
        return session.settings.fluids[part.name]
    return float(session.world.parameter("fluid_regularization")[0, 0]) or None


def fluid_reader(session: Session, part: FluidPart, word: str) -> Reader:
    """Return the reader of the derivative by a viscosity."""
    return lambda g: float(g.parameters.fluid_viscosity)
