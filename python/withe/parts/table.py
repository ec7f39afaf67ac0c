"""The table of parts: each kind of part states here, once, what it is called and which words it has.

A `PartKind` names a kind, its handle, and its words. A `Word` states its unit, the check of its values, and whether it
can be set, read, differentiated and ramped (both in `withe.parts.words`). `Simulation.set` and `get`, gradients, error
texts, records and pictures walk the table, and none of them names a kind.

Most kinds have one number a part in the engine, `f"{numbers}_{word}"` of cpp/model/parameter_index.cpp: the table is
all that these need. What else a kind does when its words are set, read or differentiated is one row of
`withe.simulation.access`.

A new kind needs one module like `withe.parts.torsion_springs` (its part, handle, row and description), its row in
`KINDS`, and the method of `Scene` that adds it. In the engine it needs its rows of the parameter index and a term
(cpp/steps/terms.cpp).
"""

from __future__ import annotations

from typing import Any

from withe.common import validation
from withe.common.outlines import SpringOutline, TendonOutline
from withe.parts.handles import (
    Body,
    CustomForce,
    Drag,
    Fluid,
    Hand,
    Handle,
    Joint,
    Layout,
    Load,
    Mass,
    Obstacle,
    Rod,
    Spring,
    Support,
    Tendon,
)
from withe.parts.kinds import (
    LOAD_KINDS,
    BodyPart,
    CustomForcePart,
    DragPart,
    FluidPart,
    GuidePlace,
    JoinPart,
    LoadPart,
    MassPart,
    ObstaclePart,
    Part,
    RodPart,
    SpringPart,
    SupportPart,
    TendonPart,
)
from withe.parts.parameters import NATURAL_WORDS, ROD_WORDS
from withe.parts.torsion_springs import TORSION_SPRING
from withe.parts.words import PartKind, RowOf, Word, angle, limit

__all__ = [
    "KINDS",
    "PAIR_WORDS",
    "SCENE_WORDS",
    "checked",
    "handle_of",
    "kind_of",
    "tendon_outline",
]


def _zigzag(part: SpringPart, row_of: RowOf) -> SpringOutline:
    return SpringOutline(part.name, (row_of(part.nodes[0]), row_of(part.nodes[1])))


def _line(part: TendonPart, row_of: RowOf) -> TendonOutline:
    return tendon_outline(part, row_of)


_SHARES: dict[GuidePlace, float] = {"start": 0.0, "middle": 0.5, "end": 1.0}
"""Place of a guide along its edge, from 0 to 1."""


def tendon_outline(part: TendonPart, row_of: RowOf) -> TendonOutline:
    """Return the outline of a tendon for pictures and files. `row_of`: row of a point of a body."""
    guides = tuple(
        (rod, edge, _SHARES[place]) if rod >= 0 else (-1, row_of((rod, edge)), 0.0) for rod, edge, place in part.guides
    )
    return TendonOutline(part.name, guides, part.offsets)


def _turns(part: JoinPart) -> bool:
    return part.axis is not None


def _is_ring(part: SupportPart) -> bool:
    return part.grasp is not None and part.grasp.slides and part.grasp.feed_rate is None


_POSITIVE = tuple(word for word in ROD_WORDS if word != "poisson_ratio")
_ROD_UNITS = {
    "youngs_modulus": "Pa",
    "poisson_ratio": "-",
    "density": "kg/m^3",
    "viscosity": "Pa s",
    "stretch_stiffness": "N",
    "bend_stiffness": "N m^2",
    "twist_stiffness": "N m^2",
    "line_density": "kg/m",
    "viscous_time": "s",
    "drag": "Pa s",
    "natural_curvature": "1/m",
    "natural_twist": "rad/m",
    "natural_stretch": "-",
}
_LOAD_UNITS = {"force": "N", "moment": "N m", "load": "N/m", "pressure": "N/m"}


def _load_word(name: str) -> Word:
    def of(part: LoadPart) -> bool:
        return part.kind == name

    return Word(name, _LOAD_UNITS[name], of=of, is_linear=True)


KINDS: tuple[PartKind, ...] = (
    PartKind(
        RodPart,
        Rod,
        "rod",
        "rods",
        (
            *(
                Word(
                    name,
                    _ROD_UNITS[name],
                    is_linear=name in ("youngs_modulus", "density"),
                    is_ramped=name in NATURAL_WORDS,
                    is_positive=name in _POSITIVE,
                )
                for name in (*ROD_WORDS, *NATURAL_WORDS)
            ),
            Word("radius", "m", is_set=False),
            Word("discrete_curvature", "-", is_read=False, has_gradient=False, is_ramped=True),
        ),
    ),
    PartKind(BodyPart, Body, "body", "bodies"),
    PartKind(LoadPart, Load, "load", "loads", tuple(map(_load_word, LOAD_KINDS))),
    PartKind(
        MassPart,
        Mass,
        "mass",
        "masses",
        (Word("mass", "kg", validation.non_negative, is_linear=True, is_positive=True),),
    ),
    PartKind(
        SpringPart,
        Spring,
        "spring",
        "springs",
        (
            Word("stiffness", "N/m", validation.non_negative, is_linear=True, is_ramped=True, is_positive=True),
            Word("rest_length", "m", validation.non_negative, is_linear=True, is_ramped=True, is_positive=True),
            Word("damping", "N s/m", validation.non_negative, is_ramped=True, is_positive=True),
        ),
        numbers="spring",
        outline=_zigzag,
    ),
    PartKind(
        TendonPart,
        Tendon,
        "tendon",
        "tendons",
        (Word("tension", "N", validation.non_negative, is_linear=True, is_ramped=True),),
        numbers="tendon",
        outline=_line,
    ),
    PartKind(
        JoinPart,
        Joint,
        "joint",
        "revolute joints",
        (
            Word(
                "stiffness",
                "N m/rad",
                validation.non_negative,
                _turns,
                is_linear=True,
                is_ramped=True,
                is_positive=True,
            ),
            Word("rest_angle", "rad", angle, _turns, is_ramped=True),
            Word("damping", "N m s/rad", validation.non_negative, _turns, is_ramped=True, is_positive=True),
            Word("moment", "N m", validation.number, _turns, is_linear=True, is_ramped=True),
            Word("max_torque", "N m", limit, _turns),
            Word("max_speed", "rad/s", limit, _turns, has_gradient=False),
        ),
        numbers="joint",
    ),
    TORSION_SPRING,
    PartKind(DragPart, Drag, "drag", "drags", (Word("drag", "Pa s", validation.non_negative),)),
    PartKind(
        FluidPart,
        Fluid,
        "fluid",
        "fluids",
        (
            Word("viscosity", "Pa s", validation.positive),
            Word("regularization", "m", validation.positive, has_gradient=False),
        ),
    ),
    PartKind(CustomForcePart, CustomForce, "custom force", "custom forces"),
    PartKind(
        ObstaclePart,
        Obstacle,
        "obstacle",
        "obstacles",
        (
            Word("friction", "-", has_one_side=True, is_positive=True),
            Word("restitution", "-", validation.share, has_gradient=False),
            Word("rolling_friction", "-", validation.non_negative, has_one_side=True),
            Word("position", "m", is_set=False, is_ramped=True),
            Word("turn", "rad", is_set=False, is_ramped=True, has_gradient=False),
        ),
    ),
    PartKind(
        SupportPart,
        Support,
        "support",
        "supports",
        (
            Word("position", "m", is_ramped=True),
            Word("rotation", "rad", is_ramped=True),
            Word("friction", "-", validation.non_negative, _is_ring, has_gradient=False),
            Word("stiffness", "N/m, N m/rad", is_set=False, is_read=False),
            Word("force_limit", "N", is_set=False, is_read=False),
        ),
    ),
)

_BY_PART = {kind.part: kind for kind in KINDS}

PAIR_WORDS = (
    Word("friction", "-", has_one_side=True),
    Word("restitution", "-", validation.share, has_gradient=False),
    Word("contact_stiffness", "N/m", validation.positive, has_gradient=False),
)
"""Words of two bodies that touch."""

SCENE_WORDS = (
    Word("gravity", "m/s^2", is_linear=True),
    Word("friction", "-", validation.non_negative, has_one_side=True),
    Word("slip_tolerance", "m/s", validation.positive),
    Word("restitution", "-", validation.share, has_gradient=False),
    Word("contact_stiffness", "N/m", validation.positive, has_gradient=False),
)
"""Words of the whole scene."""


def kind_of(part: Part | type[Part]) -> PartKind:
    """The row of a part, or of its class."""
    return _BY_PART[part if isinstance(part, type) else type(part)]


def checked(part: type[Part], word: str, value: Any, name: str) -> Any:
    """A number of a part called `name`, checked as its word says."""
    kind = kind_of(part)
    check = next(each.check for each in kind.words if each.name == word)
    assert check is not None
    owner = f"{kind.noun} {name!r}"
    return check(value, owner if word == kind.noun else f"{word} of {owner}")


def handle_of(part: Part, scene_id: str, layout: Layout) -> Handle:
    """The handle of a part."""
    if isinstance(part, RodPart):
        return Rod(scene_id, part.name, layout, part.index)
    if isinstance(part, SupportPart) and part.grasp is not None:
        return Hand(scene_id, part.name)
    return kind_of(part).handle(scene_id, part.name)
