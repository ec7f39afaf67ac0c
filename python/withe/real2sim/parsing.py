"""What a user says is unknown, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from withe.real2sim.shape_unknowns import DrawnShape, NaturalCurvature, Pose
from withe.real2sim.unknowns import POSITIVE, Parameter, Unknown
from withe.simulation.simulation import Simulation

__all__ = ["parse_unknowns"]


def parse_unknowns(
    simulation: Simulation, unknowns: Sequence[Any], what: str = "unknowns", others: Sequence[Unknown] = ()
) -> list[Unknown]:
    """Unknowns of what a user gave: tuples (part, word) or (rod, "points", basis).

    Raises
    ------
    ValueError
        Something else, a word that cannot be unknown, or the same one twice.
    """
    if isinstance(unknowns, str) or not isinstance(unknowns, Sequence):
        raise ValueError(f"{what} must be a list such as [(arm, 'natural_curvature', 'constant')], got {unknowns!r}")
    shapes = {"natural_curvature": NaturalCurvature, "points": DrawnShape}
    found: list[Unknown] = []
    seen: set[tuple[str, str]] = set()
    for item in unknowns:
        if not isinstance(item, tuple) or len(item) not in (2, 3) or not isinstance(item[1], str):
            raise ValueError(f"{what} must be tuples (rod, word) or (rod, 'natural_curvature', basis), got {item!r}")
        rod, word, *basis = item
        if word in shapes:
            unknown: Unknown = shapes[word](simulation, rod, *basis)
        elif word in ("position", "rotation") and not basis:
            unknown = Pose(simulation, rod, word, [*others, *found])
        elif word in POSITIVE and not basis:
            unknown = Parameter(simulation, list(rod) if isinstance(rod, tuple | list) else [rod], word)
        else:
            words = ", ".join((*shapes, "position", "rotation", *POSITIVE))
            raise ValueError(f"{what} must be of {words}, only the first two with a basis, got {item[1:]!r}")
        for name in unknown.rods:
            if (name, word) in seen:
                raise ValueError(f"{what} must be different, got {word} of rod {name!r} twice")
            seen.add((name, word))
        found.append(unknown)
    shapes_drawn = [unknown for unknown in (*others, *found) if isinstance(unknown, DrawnShape)]
    for pose in (unknown for unknown in (*others, *found) if isinstance(unknown, Pose)):
        for shape in shapes_drawn:
            if pose.rods[0] in shape.supports:
                raise ValueError(
                    f"points of {shape.rods[0]!r} move its supports: leave out {pose.word} of {pose.rods[0]!r}"
                )
    return found
