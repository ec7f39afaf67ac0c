"""Turns what a user says about a hand into a `SupportPart`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.handles import Body, Rod
from withe.parts.kinds import Grasp, Pass, RodPart, SupportPart

__all__ = ["Sliding", "check_free", "held_edges", "make_hand", "pose_of", "touched_edges"]

FloatArray = npt.NDArray[np.float64]

_TOUCHED = 1e-9  # of an edge's length: less than that is rounding


class Sliding(NamedTuple):
    """Options of a ring."""

    slides: bool
    friction: float
    feed_rate: float | None


def make_hand(
    directory: Directory,
    rod: Rod | str,
    at: float,
    length: float,
    pose: Any,
    stiffness: npt.ArrayLike | None,
    force_limit: float | None,
    sliding: Sliding,
    name: str | None,
    by: Body | str | None = None,
) -> SupportPart:
    """A hand, checked; not yet in the directory. `by`: a body that carries it."""
    name = directory.new_name(name, "hand")
    part = directory.rod(rod, "rod to grasp")
    at = validation.number(at, f"at of {name!r}")
    length = validation.non_negative(length, f"length of {name!r}")
    whole = float(part.arcs.sum())
    slack = _TOUCHED * whole
    if part.closed:
        if not -slack <= at <= whole + slack or length > whole + slack:
            raise ValueError(
                f"{name!r} must lie on {part.owner}, from 0 to {whole:g} m, and must not be longer than the rod, "
                f"got at={at:g} m and length={length:g} m"
            )
    elif at - 0.5 * length < -slack or at + 0.5 * length > whole + slack:
        raise ValueError(
            f"{name!r} must lie on {part.owner}, from 0 to {whole:g} m, got {at - 0.5 * length:g} to "
            f"{at + 0.5 * length:g} m (at={at:g}, length={length:g})"
        )
    place = None if pose is None else pose_of(pose, f"pose of {name!r}")
    if validation.truth(sliding.slides, f"slides of {name!r}"):
        grasp = _make_ring(part, at, length, place, stiffness, force_limit, sliding, name)
        if by is not None:
            grasp = replace(grasp, by=_place_on_body(directory, part, at, place, by, name))
        edge = touched_edges(part, at, 0.0)[0]
        return SupportPart(name, "hand", (part.index, edge), f"{part.name}.node({edge})", np.zeros((3, 3)), grasp)
    if by is not None:
        raise ValueError(
            f"by of {name!r} needs a ring: use slides=True, or hold the rod by a joint, "
            f"scene.join({part.name}.node(i), body)"
        )
    for word, value in (("friction", sliding.friction or None), ("feed_rate", sliding.feed_rate)):
        if value is not None:
            raise ValueError(f"{word} of {name!r} needs a ring: use slides=True, which lets the rod slide")
    stiff = None if stiffness is None else _stiffness(stiffness, f"stiffness of {name!r}")
    limit = math.inf
    if force_limit is not None:
        limit = validation.positive(force_limit, f"force_limit of {name!r}")
        if stiff is None:
            raise ValueError(f"force_limit of {name!r} needs a hand that yields: give stiffness= too")
    edges = touched_edges(part, at, length)
    grasp = Grasp(at, length, place, stiff, limit, edges)
    node = (part.index, edges[0])
    return SupportPart(name, "hand", node, f"{part.name}.node({edges[0]})", np.zeros((3, 3)), grasp)


def _make_ring(
    rod: RodPart,
    at: float,
    length: float,
    pose: tuple[FloatArray, FloatArray] | None,
    stiffness: npt.ArrayLike | None,
    force_limit: float | None,
    sliding: Sliding,
    name: str,
) -> Grasp:
    if length != 0.0:
        raise ValueError(f"length of {name!r} must be 0 for a ring, got {length:g} m")
    if stiffness is None:
        # An edge stretches by more than the rod is off the middle of the ring then.
        edge = touched_edges(rod, at, 0.0)[0]
        k = float(rod.parameters.stretch_stiffness[edge] / rod.lengths[edge])
    elif not validation.is_scalar(stiffness):
        raise ValueError(
            f"stiffness of {name!r} must be one number [N/m], because a ring does not hold directions, got "
            f"{stiffness!r:.80}"
        )
    else:
        k = validation.positive(stiffness, f"stiffness of {name!r}")
    friction = validation.non_negative(sliding.friction, f"friction of {name!r}")
    rate = None if sliding.feed_rate is None else validation.number(sliding.feed_rate, f"feed_rate of {name!r}")
    if rate is not None and friction > 0.0:
        raise ValueError(
            f"friction of {name!r} must be 0 with a drive (feed_rate=): use force_limit=, above which the drive slips"
        )
    limit = math.inf
    if force_limit is not None:
        limit = validation.positive(force_limit, f"force_limit of {name!r}")
        if rate is None:
            raise ValueError(f"force_limit of {name!r} needs a drive: give feed_rate= too, or use friction= instead")
    return Grasp(at, 0.0, pose, np.full(6, k), limit, (), True, friction, rate)


def _place_on_body(
    directory: Directory,
    rod: RodPart,
    at: float,
    pose: tuple[FloatArray, FloatArray] | None,
    body: Body | str,
    name: str,
) -> Pass:
    """Return the point of a body where a rod passes its ring as drawn."""
    if pose is not None:
        raise ValueError(f"pose of {name!r} must not be given with by=: the ring is where the rod is drawn")
    if not directory.is_body(body):
        raise ValueError(f"by of {name!r} must be a rigid body of the scene, got {body!r:.80}")
    return directory.place(body, _spline_point(rod, at), f"by of {name!r}")[0]


def _spline_point(rod: RodPart, at: float) -> FloatArray:
    """Return the drawn point of the smooth curve of a rod at an arc length (3,); see geometry/rod_spline.hpp."""
    arcs, count = rod.arcs, len(rod.points)
    begins = np.concatenate([[0.0], np.cumsum(arcs)])
    middles = 0.5 * (begins[:-1] + begins[1:])
    if rod.closed:
        whole = float(begins[-1])
        node = int(np.searchsorted(middles, at % whole)) % count
        arc = (at - begins[node] + 0.5 * whole) % whole - 0.5 * whole
    else:
        node = int(np.clip(np.searchsorted(middles, at), 0, count - 1))
        arc = at - float(begins[node])
    before, after = node - 1, (node + 1) % count
    if not rod.closed and node in (0, count - 1):
        edge = 0 if node == 0 else len(arcs) - 1
        way = (at - float(begins[edge])) / float(arcs[edge])
        return np.asarray((1.0 - way) * rod.points[edge] + way * rod.points[edge + 1])
    first, second = float(arcs[before]), float(arcs[node])
    s = arc + 0.5 * first
    a = 2.0 * s / (first + np.sqrt(first**2 + 2.0 * (second - first) * s))
    b = 1.0 - a
    weights = np.array([0.5 * b * b, 0.5 + a * b, 0.5 * a * a])
    return np.asarray(weights @ rod.points[[before, node, after]])


def pose_of(pose: Any, what: str) -> tuple[FloatArray, FloatArray]:
    """Position and rotation, from a pair of them, seven numbers, or a matrix of shape (4, 4)."""
    if isinstance(pose, tuple | list) and len(pose) == 2:
        return (
            validation.vector(pose[0], f"position in the {what}"),
            validation.rotation_matrix(pose[1], f"rotation in the {what}"),
        )
    array = validation.number_array(pose, what, (7,), (4, 4))
    if array.shape == (7,):
        return array[:3], validation.quaternion_matrix(array[3:], what)
    if np.abs(array[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-9:
        raise ValueError(f"{what} must have the last row 0 0 0 1, got {array[3]}")
    return array[:3, 3].copy(), validation.rotation_matrix(array[:3, :3], f"rotation in the {what}")


def touched_edges(rod: RodPart, at: float, length: float) -> tuple[int, ...]:
    """Edges of a rod that a hand touches, in their order."""
    count, arcs = len(rod.arcs), rod.arcs
    turns = (-1, 0, 1) if rod.closed else (0,)
    whole = float(arcs.sum())
    begins = np.concatenate([[0.0], np.cumsum(arcs)])
    found = []
    for turn in turns:
        low = np.maximum(at - 0.5 * length, begins[:-1] + turn * whole)
        high = np.minimum(at + 0.5 * length, begins[1:] + turn * whole)
        found += [int(edge) for edge in np.flatnonzero(high - low > _TOUCHED * arcs)]
    if not found:
        place = at % whole if rod.closed else at
        edge = int(np.searchsorted(begins[1:] - _TOUCHED * arcs, place, side="right"))
        found = [min(edge, count - 1)]
    return tuple(dict.fromkeys(found))


def check_free(directory: Directory, part: SupportPart, others: list[SupportPart]) -> None:
    """Refuse a hand on what is held already, and a support on what a hand holds.

    Two that hold edges may hold neighbours: who came first holds the node between them. A hand that yields holds no
    node, but nothing else may hold its edges. A ring holds nothing.

    Raises
    ------
    ValueError
        What it would hold is held by one of the others.
    """
    edges, nodes = held_edges(directory, part), _nodes(directory, part)
    for other in others:
        if (part.grasp is None and other.grasp is None) or _is_ring(part) or _is_ring(other):
            continue
        theirs, rows = held_edges(directory, other), _nodes(directory, other)
        if edges & theirs:
            raise ValueError(
                f"{part.name!r} overlaps {other.name!r}, and both would hold an edge: release {other.name!r} first"
            )
        hard = {row for row in nodes & rows if not (edges and theirs)}
        if hard:
            raise ValueError(
                f"{part.name!r} overlaps {other.name!r} at {other.node_name!r}: release {other.name!r} first"
            )


def _is_ring(part: SupportPart) -> bool:
    return part.grasp is not None and part.grasp.slides


def held_edges(directory: Directory, part: SupportPart) -> set[tuple[int, int]]:
    """Edges that a support holds, as (rod, edge)."""
    index, node = part.node
    if part.grasp is not None:
        return {(index, edge) for edge in part.grasp.edges}
    if part.kind in ("hold_edge", "spinning_edge"):
        rod = directory.layout.rods[index]
        return {(index, node if node + 1 < rod.nodes or rod.closed else node - 1)}
    return set()


def _nodes(directory: Directory, part: SupportPart) -> set[int]:
    """Rows of the nodes that it touches."""
    index, _ = part.node
    edges = held_edges(directory, part)
    if not edges:
        return {directory.row(part.node)}
    count = directory.layout.rods[index].nodes
    return {directory.row((index, (edge + step) % count)) for _, edge in edges for step in (0, 1)}


def _stiffness(stiffness: npt.ArrayLike, what: str) -> FloatArray:
    """Six numbers, from one pair, or from three along and three about."""
    if isinstance(stiffness, tuple | list) and len(stiffness) == 2:
        parts = [
            np.full(3, validation.positive(item, f"{what} {word}"))
            if validation.is_scalar(item)
            else validation.per_item(item, f"{what} {word}", 3, "directions")
            for item, word in zip(stiffness, ("along directions", "about them"), strict=True)
        ]
        return np.concatenate(parts)
    if validation.is_scalar(stiffness):
        raise ValueError(f"{what} must be a pair, (N/m, N m/rad), or six numbers, got {stiffness!r:.80}")
    return validation.per_item(stiffness, what, 6, "directions")
