"""Turns what a user says about a support into a `SupportPart`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.union_find import UnionFind
from withe.parts.directory import Directory
from withe.parts.handles import Body, NodeHandle
from withe.parts.hands import check_free
from withe.parts.kinds import JoinPart, Pass, RodPart, SupportKind, SupportPart

__all__ = ["check_not_held", "free_rods", "held_rows", "make_clamp", "make_pin"]

FloatArray = npt.NDArray[np.float64]


def make_clamp(
    directory: Directory,
    node: NodeHandle | Body | str,
    hold: Literal["frame", "edge"],
    free: npt.ArrayLike | None,
    spin: bool | npt.ArrayLike,
    name: str | None,
    at: npt.ArrayLike | None = None,
) -> SupportPart:
    """A clamp, checked; not yet in the directory."""
    name = directory.new_name(name, "clamp")
    place, node_name = directory.place(node, at, "node to clamp")
    validation.choice(hold, "hold of the clamp", ("frame", "edge"))
    if place[0] < 0:
        return _clamp_of_body(name, place, node_name, hold, free, spin)
    kinds: dict[tuple[str, bool], SupportKind] = {
        ("frame", False): "clamp",
        ("frame", True): "spinning_clamp",
        ("edge", False): "hold_edge",
        ("edge", True): "spinning_edge",
    }
    if np.ndim(spin) > 0:
        raise ValueError("spin of the clamp must be True or False: an axis is for bodies")
    kind = kinds[hold, validation.truth(spin, "spin of the clamp")]
    return SupportPart(name, kind, place, node_name, _projector(free, "free of the clamp"))


def _clamp_of_body(
    name: str, place: Pass, body: str, hold: str, free: npt.ArrayLike | None, spin: bool | npt.ArrayLike
) -> SupportPart:
    """A clamp of a body, which lets it turn about an axis where `spin` gives one."""
    if hold != "frame":
        raise ValueError(f"hold='edge' is for rods, got body {body!r}")
    free_of = _projector(free, "free of the clamp")
    if np.ndim(spin) == 0:
        if validation.truth(spin, "spin of the clamp"):
            raise ValueError(f"spin of a clamp of body {body!r} must be the axis, for example spin=(0, 0, 1)")
        return SupportPart(name, "clamp", place, body, free_of)
    axis = validation.unit_vector(spin, "spin of the clamp")
    return SupportPart(name, "spinning_clamp", place, body, free_of, axis=axis)


def make_pin(
    directory: Directory,
    node: NodeHandle | Body | str,
    free: npt.ArrayLike | None,
    name: str | None,
    at: npt.ArrayLike | None = None,
) -> SupportPart:
    """A pin, checked; not yet in the directory."""
    name = directory.new_name(name, "pin")
    place, node_name = directory.place(node, at, "node to pin")
    return SupportPart(name, "pin", place, node_name, _projector(free, "free of the pin"))


def check_not_held(directory: Directory, part: SupportPart, others: Iterable[SupportPart]) -> None:
    """Refuse a second support of one node.

    Raises
    ------
    ValueError
        A node that it would hold, or one that is joined to it, is held by one of the others.
    """
    others = list(others)
    check_free(directory, part, others)
    held = held_rows(directory, part)
    for other in others:
        if part.grasp is not None or other.grasp is not None:
            continue
        if directory.row(other.node) == directory.row(part.node):
            raise ValueError(f"node {part.node_name!r} is already held by {other.name!r}: release {other.name!r} first")
        if not held.isdisjoint(held_rows(directory, other)):
            raise ValueError(
                f"{part.name!r} at {part.node_name!r} would hold a node that {other.name!r} at {other.node_name!r} "
                f"already holds: release {other.name!r} first (hold='edge' holds both nodes of an edge)"
            )


def held_rows(directory: Directory, part: SupportPart) -> set[int]:
    """Rows of the nodes that a support holds: with hold="edge" also that at the other end of the edge."""
    index, node = part.node
    held = {directory.row(part.node)}
    if part.kind in ("hold_edge", "spinning_edge"):
        rod = directory.layout.rods[index]
        beyond = node + 1 if node + 1 < rod.nodes or rod.closed else node - 1
        held.add(directory.row((index, beyond % rod.nodes)))
    return held


def _projector(free: npt.ArrayLike | None, what: str) -> FloatArray:
    """Projector onto the span of one or two directions."""
    if free is None:
        return np.zeros((3, 3))
    directions = validation.number_array(free, what, (3,), (1, 3), (2, 3)).reshape(-1, 3)
    units = np.array([validation.unit_vector(row, what) for row in directions])
    u, sizes, _ = np.linalg.svd(units.T, full_matrices=False)
    if sizes.min() < 1e-6:
        raise ValueError(f"{what} must be directions that are not parallel")
    return np.asarray(u @ u.T, np.float64)


def free_rods(directory: Directory, supports: Iterable[SupportPart]) -> list[RodPart]:
    """Return the rods that no support holds, also not through the rods and bodies that they are joined to."""
    rods = directory.all(RodPart)
    groups = UnionFind(len(rods) + len(directory.layout.body_points))

    def number(node: Pass) -> int:
        return node[0] if node[0] >= 0 else len(rods) - 1 - node[0]

    for join in directory.all(JoinPart):
        groups.unite(*map(number, join.nodes))
    for loop in directory.loops:
        groups.unite(len(rods) + loop.body, len(rods) + loop.copy)
    held = {groups.find(number(part.node)) for part in supports}
    return [rod for rod in rods if groups.find(rod.index) not in held]
