"""Turns what a user says about a rod into the arrays of a `RodPart`."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import drawing, validation
from withe.parts.kinds import Drawing, RodPart
from withe.parts.materials import Material, Stiffness
from withe.parts.parameters import RodParameters
from withe.parts.plausibility import check_length
from withe.parts.sections import Circle, Section, SectionProperties, check_section

__all__ = ["Natural", "curvature_array", "curvature_given", "make_rod", "redrawn", "stretch_array", "twist_array"]

FloatArray = npt.NDArray[np.float64]
Natural = Literal["as_built", "straight", "in_balance"]

_MAX_NODES = 10_000_000
_THICKEST = 10.0  # radius over length; stubs to which others are joined are thicker than long


def make_rod(
    name: str,
    index: int,
    *,
    start: npt.ArrayLike | None,
    end: npt.ArrayLike | None,
    points: npt.ArrayLike | None,
    nodes: int | None,
    closed: bool,
    normal: npt.ArrayLike | None,
    radius: npt.ArrayLike | None,
    section: Section | None,
    contact_radius: npt.ArrayLike | None,
    material: Material | None,
    stiffness: Stiffness | None,
    line_density: npt.ArrayLike | None,
    natural: Natural,
    natural_curvature: npt.ArrayLike | None,
    natural_twist: npt.ArrayLike | None,
    discrete: bool,
) -> RodPart:
    """The arrays of a rod; see `Scene.add_rod` for the arguments.

    Raises
    ------
    ValueError
        Something that cannot be a rod.
    """
    owner = f"rod {name!r}"
    closed = validation.truth(closed, f"closed of {owner}")
    centreline, spacing = _centreline(start, end, points, nodes, closed, owner)
    lengths = drawing.check_edges(centreline, closed, owner)
    tangents = drawing.edge_vectors(centreline, closed) / lengths[:, None]
    directors = _directors(normal, tangents, owner)
    properties = _section(radius, section, len(lengths), owner)
    touching = properties.touching
    _check_thickness(touching, lengths, "radius" if section is None else "half the thickness", owner)
    if contact_radius is not None:
        touching = validation.per_item(contact_radius, f"contact_radius of {owner}", len(lengths), "edges")
        _check_thickness(touching, lengths, "contact_radius", owner)
    check_length(float(lengths.sum()), float(properties.radii.max()), owner)
    parameters = _parameters(material, stiffness, line_density, properties, owner)

    validation.choice(natural, f"natural of {owner}", get_args(Natural))
    in_balance = natural == "in_balance"
    if in_balance and (natural_curvature is not None or natural_twist is not None):
        raise ValueError(f"natural='in_balance' finds the natural curvature and twist of {owner}: give neither")
    as_built = natural != "straight"
    arcs = lengths
    if spacing is not None and as_built and natural_curvature is None:
        arcs = np.maximum(lengths, spacing)
    voronoi = drawing.voronoi_lengths(arcs, closed)
    curvature, twist = np.zeros((len(voronoi), 2)), np.zeros(len(voronoi))
    if as_built:
        # Differences of coordinates leave this much of a turn in a straight rod.
        rounding = 16.0 * np.finfo(float).eps * max(1.0, float(np.abs(centreline).max() / lengths.min()))
        curvature, twist = drawing.natural_shape(tangents, directors, voronoi, closed, rounding)
    discrete = validation.truth(discrete, "discrete")
    if natural_curvature is not None:
        curvature = curvature_array(natural_curvature, voronoi, discrete, owner)
    if natural_twist is not None:
        twist = twist_array(natural_twist, voronoi, owner)
    as_drawn = None
    if spacing is None and not in_balance and not (discrete and natural_curvature is not None):
        given = None if normal is None else np.array(normal, float)
        as_drawn = Drawing(given, as_built and natural_curvature is None, as_built and natural_twist is None)
    return RodPart(
        drawing=as_drawn,
        name=name,
        index=index,
        closed=closed,
        points=centreline,
        tangents=tangents,
        directors=directors,
        lengths=lengths,
        arcs=arcs,
        voronoi=voronoi,
        section=properties,
        contact_radius=touching,
        parameters=parameters,
        natural_curvature=curvature,
        natural_twist=twist,
        in_balance=in_balance,
    )


def redrawn(part: RodPart, points: FloatArray) -> RodPart:
    """Return a rod with other nodes, drawn as this one: lengths, directors, natural shape."""
    how = part.drawing
    assert how is not None
    lengths = drawing.check_edges(points, part.closed, part.owner)
    tangents = drawing.edge_vectors(points, part.closed) / lengths[:, None]
    directors = _directors(how.normal, tangents, part.owner)
    voronoi = drawing.voronoi_lengths(lengths, part.closed)
    built = drawing.natural_shape(tangents, directors, voronoi, part.closed, 0.0)
    return replace(
        part,
        points=points,
        tangents=tangents,
        directors=directors,
        lengths=lengths,
        arcs=lengths,
        voronoi=voronoi,
        natural_curvature=built[0] if how.natural_curvature else part.natural_curvature,
        natural_twist=built[1] if how.natural_twist else part.natural_twist,
    )


def curvature_given(value: npt.ArrayLike, stencils: int, owner: str) -> FloatArray:
    """Natural curvature as it was given: one pair for all stencils, of shape (2,), or one for each, (stencils, 2)."""
    return validation.number_array(value, f"natural_curvature of {owner}", (2,), (stencils, 2))


def curvature_array(value: npt.ArrayLike, voronoi: FloatArray, discrete: bool, owner: str) -> FloatArray:
    """Natural curvature as an array of shape (stencils, 2) [1/m], of the smooth rod.

    Raises
    ------
    ValueError
        Another shape, not finite, or a turn of pi or more at a node.
    """
    stencils = len(voronoi)
    given = np.broadcast_to(curvature_given(value, stencils, owner), (stencils, 2))
    if discrete:
        return drawing.smooth_curvature(given, voronoi)
    _core.check_turns(given, voronoi, f"natural_curvature of {owner}")
    return np.array(given)


def twist_array(value: npt.ArrayLike, voronoi: FloatArray, owner: str) -> FloatArray:
    """Natural twist as an array of shape (stencils,) [rad/m]."""
    return validation.per_item(value, f"natural_twist of {owner}", len(voronoi), "stencils", sign=True)


def stretch_array(value: npt.ArrayLike, edges: int, owner: str) -> FloatArray:
    """Natural stretch as an array of shape (edges,) [-]."""
    return validation.per_item(value, f"natural_stretch of {owner}", edges, "edges")


def _centreline(
    start: npt.ArrayLike | None,
    end: npt.ArrayLike | None,
    points: npt.ArrayLike | None,
    nodes: int | None,
    closed: bool,
    owner: str,
) -> tuple[FloatArray, float | None]:
    """Nodes, and how far they are apart along the curve that they were taken from, if they were."""
    if (points is None) == (start is None and end is None):
        raise ValueError(f"{owner} must have either points, or start and end")
    least = 3 if closed else 2
    if points is None:
        first = validation.vector(start, f"start of {owner}")
        last = validation.vector(end, f"end of {owner}")
        if closed:
            raise ValueError(f"closed of {owner} must be False for a rod from start to end: give points")
        if nodes is None:
            raise ValueError(f"nodes of {owner} must be given for a rod from start to end")
        count = validation.integer(nodes, f"nodes of {owner}", least, _MAX_NODES)
        share = np.linspace(0.0, 1.0, count)[:, None]
        return np.asarray((1.0 - share) * first + share * last, np.float64), None
    line = validation.number_array(points, f"points of {owner}", ("n", 3))
    if closed and len(line) > 1 and np.abs(line[0] - line[-1]).max() <= 1e-9 * np.ptp(line, axis=0).max():
        line = line[:-1]
    if len(line) < (least if nodes is None else 2):
        raise ValueError(f"points of {owner} must be {least} or more, got {len(line)}")
    if nodes is None:
        return line, None
    count = validation.integer(nodes, f"nodes of {owner}", least, _MAX_NODES)
    if closed and len(line) < least:
        raise ValueError(f"points of {owner} must be {least} or more, got {len(line)}")
    drawing.check_edges(line, closed, owner)
    return drawing.resample(line, count, closed)


def _directors(normal: npt.ArrayLike | None, tangents: FloatArray, owner: str) -> FloatArray:
    if normal is None:
        return drawing.transport_directors(tangents, drawing.default_normal(tangents[0]))
    what = f"normal of {owner}"
    given = validation.number_array(normal, what, (3,), tangents.shape)
    single = given.ndim == 1
    rows = np.atleast_2d(given)
    along = tangents[:1] if single else tangents
    rows = np.array([validation.unit_vector(row, what) for row in rows])
    rows -= along * np.sum(rows * along, axis=1, keepdims=True)
    sizes = np.sqrt(np.sum(rows**2, axis=1, keepdims=True))
    if np.any(sizes < 1e-6):
        raise ValueError(f"{what} must not lie along edge {int(np.argmin(sizes))}")
    rows /= sizes
    return drawing.transport_directors(tangents, rows[0]) if single else rows


def _section(radius: npt.ArrayLike | None, section: Section | None, edges: int, owner: str) -> SectionProperties:
    if radius is not None and section is None:
        shape: Section = Circle(radius)
    elif section is not None and radius is None:
        shape = check_section(section, owner)
    else:
        raise ValueError(f"{owner} must have either a radius or a section")
    with np.errstate(over="ignore", under="ignore"):
        return shape.properties(edges, owner)


def _check_thickness(radii: FloatArray, lengths: FloatArray, what: str, owner: str) -> None:
    """Refuse a rod that is far thicker than long: millimetres, as a rule, where metres were expected."""
    thick, length = float(radii.max()), float(lengths.sum())
    if thick > _THICKEST * length:
        raise ValueError(
            f"{what} of {owner} must be no more than {_THICKEST:g} times the length of the rod, {length:g} m, got "
            f"{thick:g} m: are all lengths in metres?"
        )


def _parameters(
    material: Material | None,
    stiffness: Stiffness | None,
    line_density: npt.ArrayLike | None,
    properties: SectionProperties,
    owner: str,
) -> RodParameters:
    if (material is None) == (stiffness is None):
        raise ValueError(f"{owner} must have either a material or a stiffness")
    if (stiffness is None) != (line_density is None):
        raise ValueError(
            f"line_density of {owner} must be given with stiffness=, and must not be given with a material"
        )
    if line_density is not None:
        if not isinstance(stiffness, Stiffness):
            raise ValueError(f"stiffness of {owner} must be a withe.Stiffness, got {type(stiffness).__name__}")
        return RodParameters.from_stiffness(stiffness, line_density, properties, owner)
    if not isinstance(material, Material):
        raise ValueError(f"material of {owner} must be a withe.Material, got {type(material).__name__}")
    return RodParameters.from_material(material, properties, owner)
