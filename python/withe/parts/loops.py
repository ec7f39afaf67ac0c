"""Closed loops of joints between rigid bodies, found as a scene is built."""

from __future__ import annotations

from dataclasses import replace

from withe import _core
from withe.common.union_find import UnionFind
from withe.parts.directory import Directory
from withe.parts.kinds import BodyPart, ClosedLoop, JoinPart, Pass, SupportPart

__all__ = ["describe_loops", "open_loops"]


def open_loops(directory: Directory) -> None:
    """Give each joint that closes a loop a massless copy of its second body, so that all joints form a tree.

    A scene without loops, or whose loops are already open, stays as it is. Supported bodies count as connected: a
    joint between two of them closes a loop, too.

    Raises
    ------
    ValueError
        Rods on both sides of a joint that closes a loop.
    """
    if not directory.all(BodyPart):
        return
    joins = directory.all(JoinPart)
    supports = [support for support in directory.all(SupportPart) if support.grasp is None]
    nodes = [*(node for join in joins for node in join.nodes), *(support.node for support in supports)]
    place_of = {node: i for i, node in enumerate(dict.fromkeys(nodes))}
    ground = len(directory.layout.body_points)
    part_of = {node: -1 - node[0] if node[0] < 0 else ground + 1 + i for node, i in place_of.items()}
    places, parts = UnionFind(len(place_of)), UnionFind(ground + 1 + len(place_of))
    for support in supports:
        parts.unite(part_of[support.node], ground)
    for join in joins:
        first, second = join.nodes
        if places.find(place_of[first]) == places.find(place_of[second]):
            continue
        if parts.find(part_of[first]) == parts.find(part_of[second]):
            _open(directory, join)
            continue
        places.unite(place_of[first], place_of[second])
        parts.unite(part_of[first], part_of[second])


def _open(directory: Directory, join: JoinPart) -> None:
    """Replace a body at a joint by a copy."""
    own = next((i for i in (1, 0) if join.nodes[i][0] < 0), None)
    if own is None:
        raise ValueError(
            f"joint {join.name!r} closes a loop of bodies, but joins two rods: join one of the bodies instead"
        )
    node = join.nodes[own]
    layout = directory.layout
    layout.split(*join.nodes)
    copy = layout.add_copy(layout.body_points[-1 - node[0]][node[1]])
    nodes: list[Pass] = list(join.nodes)
    nodes[own] = (-1 - copy, 1)
    layout.merge(nodes[0], nodes[1])
    directory.parts[join.name] = replace(join, nodes=(nodes[0], nodes[1]))
    directory.loops = (*directory.loops, ClosedLoop(join.name, -1 - node[0], copy, node))


def describe_loops(directory: Directory) -> list[_core.LoopDescription]:
    """Closed loops for the engine."""
    return [
        _core.LoopDescription(loop.copy, loop.body, directory.row((-1 - loop.copy, 0)), directory.row(loop.node))
        for loop in directory.loops
    ]
