"""Torsion springs between two edges: part, handle, row of the table of parts and description for the engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.common.outlines import TendonOutline
from withe.parts.handles import Handle
from withe.parts.kinds import Part, RodPart
from withe.parts.words import DirectorsOf, PartKind, RowOf, Word, angle

__all__ = ["TORSION_SPRING", "TorsionPart", "TorsionSpring", "make_torsion_spring"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TorsionSpring(Handle):
    """Handle of a torsion spring between two edges, made by `Scene.add_torsion_spring`."""


@dataclass(frozen=True, eq=False)
class TorsionPart(Part):
    """A torsion spring between two edges."""

    edges: tuple[tuple[int, int], tuple[int, int]]  # of each: rod, edge of the rod
    axis: FloatArray  # unit vector, as it is drawn, (3,)
    reference: FloatArray  # unit vector normal to it, from which the angle counts, (3,)
    carried: FloatArray  # along d1, d2, t: reference and axis x reference of the first edge, reference of the second
    stiffness: float  # [N m/rad]
    rest_angle: float  # [rad]


def make_torsion_spring(
    name: str,
    first: tuple[RodPart, int],
    second: tuple[RodPart, int],
    axis: npt.ArrayLike | None,
    stiffness: float,
    rest_angle: float,
) -> TorsionPart:
    """Make and check a torsion spring; see `Scene.add_torsion_spring`."""
    owner = f"torsion spring {name!r}"
    (rod, edge), (other, other_edge) = first, second
    if (rod.index, edge) == (other.index, other_edge):
        raise ValueError(f"{owner} must act between two edges, got edge {edge} of {rod.owner} twice")
    frames = [_frame(*each) for each in (first, second)]
    tangent = frames[1][2]
    if axis is None:
        normal = np.cross(frames[0][2], tangent)
        size = float(np.linalg.norm(normal))
        if size < 1e-6:
            raise ValueError(f"axis of {owner} must be given, since both edges are drawn along one line")
        direction = normal / size
    else:
        direction = validation.unit_vector(axis, f"axis of {owner}")
    # The second edge where it is far from the axis, else its first director.
    candidates = [vector - direction * (direction @ vector) for vector in (tangent, frames[1][0])]
    sizes = [float(np.linalg.norm(vector)) for vector in candidates]
    reference = candidates[0] / sizes[0] if sizes[0] > 0.5 else candidates[1] / sizes[1]
    reference -= direction * (direction @ reference)
    reference /= np.linalg.norm(reference)
    vectors = ((0, reference), (0, np.cross(direction, reference)), (1, reference))
    return TorsionPart(
        name,
        ((rod.index, edge), (other.index, other_edge)),
        direction,
        reference,
        np.stack([frames[which] @ vector for which, vector in vectors]),
        validation.non_negative(stiffness, f"stiffness of {owner}"),
        angle(rest_angle, f"rest_angle of {owner}"),
    )


def _frame(rod: RodPart, edge: int) -> FloatArray:
    """Return d1, d2 and tangent of an edge as drawn, as rows."""
    tangent, d1 = rod.tangents[edge], rod.directors[edge]
    return np.stack([d1, np.cross(tangent, d1), tangent])


def _angle(part: TorsionPart, directors: DirectorsOf) -> float:
    """Return the angle between the edges since they were drawn, from -pi to pi [rad]."""
    (rod, edge), (other, other_edge) = part.edges
    u, v = part.carried[:2] @ directors(rod)[edge]
    w = part.carried[2] @ directors(other)[other_edge]
    return float(np.arctan2(w @ v, w @ u))


def _describe(part: TorsionPart) -> _core.TorsionDescription:
    """Return the description of a torsion spring for the engine."""
    rods, edges = zip(*part.edges, strict=True)
    return _core.TorsionDescription(list(rods), list(edges), part.axis, part.reference, part.stiffness, part.rest_angle)


def _line(part: TorsionPart, row_of: RowOf) -> TendonOutline:
    """Return a line from the middle of one edge to the middle of the other."""
    (rod, edge), (other, other_edge) = part.edges
    return TendonOutline(part.name, ((rod, edge, 0.5), (other, other_edge, 0.5)), np.zeros((2, 2)))


TORSION_SPRING = PartKind(
    TorsionPart,
    TorsionSpring,
    "torsion spring",
    "torsion springs",
    (
        Word("stiffness", "N m/rad", validation.non_negative, is_linear=True, is_ramped=True, is_positive=True),
        Word("rest_angle", "rad", angle, is_ramped=True),
        Word("angle", "rad", is_set=False, has_gradient=False, measure=_angle),
    ),
    numbers="torsion",
    outline=_line,
    described=("torsions", _describe),
)
