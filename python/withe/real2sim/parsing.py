"""Parsing and checks of the unknowns of fits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from withe.real2sim.shape_unknowns import DrawnShape, NaturalCurvature, NaturalTwist, Pose
from withe.real2sim.unknowns import POSITIVE, Parameter, Unknown
from withe.simulation.overlaps import remaining
from withe.simulation.simulation import Simulation
from withe.simulation.unknowns import Remaining

__all__ = ["parse_unknowns"]


def parse_unknowns(
    simulation: Simulation, unknowns: Sequence[Any], what: str = "unknowns", others: Sequence[Unknown] = ()
) -> list[Unknown]:
    """Return the unknowns of a user's tuples (part, word) or (rod, "points", basis).

    Raises
    ------
    ValueError
        Another type, a word that cannot be fitted, an unknown given twice, or one that others replace completely.
    """
    if isinstance(unknowns, str) or not isinstance(unknowns, Sequence):
        raise ValueError(f"{what} must be a list such as [(arm, 'natural_curvature', 'constant')], got {unknowns!r}")
    shapes = {"natural_curvature": NaturalCurvature, "natural_twist": NaturalTwist, "points": DrawnShape}
    found: list[Unknown] = []
    seen: set[tuple[str, str]] = set()
    for item in unknowns:
        if not isinstance(item, tuple) or len(item) not in (2, 3) or not isinstance(item[1], str):
            raise ValueError(
                f"{what} must be tuples (part, word), or (rod, word, basis) for {', '.join(shapes)}, got {item!r}"
            )
        rod, word, *basis = item
        if word in shapes:
            unknown: Unknown = shapes[word](simulation, rod, *basis)
        elif word in ("position", "rotation") and not basis:
            unknown = Pose(simulation, rod, word, [*others, *found])
        elif word in POSITIVE and not basis:
            unknown = Parameter(simulation, list(rod) if isinstance(rod, tuple | list) else [rod], word)
        else:
            words = ", ".join((*shapes, "position", "rotation", *POSITIVE))
            raise ValueError(f"{what} must be of {words}, only the first three with a basis, got {item[1:]!r}")
        for name in unknown.rods:
            if (name, word) in seen:
                raise ValueError(f"{what} must be different, got {word} of rod {name!r} twice")
            seen.add((name, word))
        found.append(unknown)
    _check_shapes([*others, *found])
    _check_parameters(simulation, [*others, *found])
    return found


def _check_shapes(unknowns: list[Unknown]) -> None:
    """Rods as they were drawn have natural curvature and supports with them."""
    for shape in (unknown for unknown in unknowns if isinstance(unknown, DrawnShape)):
        rod = shape.rods[0]
        for other in unknowns:
            if isinstance(other, Pose) and other.rods[0] in shape.supports:
                raise ValueError(
                    f"points of {rod!r} determine its supports: leave out {other.word} of {other.rods[0]!r}"
                )
            if isinstance(other, NaturalCurvature | NaturalTwist) and other.rods[0] == rod:
                raise ValueError(
                    f"points of {rod!r} determine its {other.word}: leave one of them out. To turn the base only, "
                    "use (support, 'rotation') instead of points"
                )


def _check_parameters(simulation: Simulation, unknowns: list[Unknown]) -> None:
    """Each sets something that no other unknown replaces."""
    parameters = [unknown for unknown in unknowns if isinstance(unknown, Parameter)]
    kept = iter(remaining(simulation._session, [word for parameter in parameters for word in parameter.words]))
    for parameter in parameters:
        own = [next(kept) for _ in parameter.words]
        if all(isinstance(word, Remaining) and not word.arrays for word in own):
            raise ValueError(
                f"{parameter.names[0]} cannot be unknown, because other unknowns determine all of its values: "
                "leave it out"
            )
