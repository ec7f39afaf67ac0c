"""Joins gathered into joints: who is rigid with whom, what turns about what, and how the engine is told of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common.union_find import UnionFind
from withe.parts.kinds import JoinPart, JointForm, Pass
from withe.parts.table import kind_of

__all__ = [
    "JointGroup",
    "connected",
    "describe_joint",
    "gather",
    "groups",
    "revolute_joints",
    "side_of",
]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointGroup:
    """One shared node: clusters of rigidly joined rods, and revolute links (parent, child, join) between them."""

    clusters: tuple[tuple[Pass, ...], ...]
    links: tuple[tuple[int, int, JoinPart], ...]
    form: JointForm


def connected(joins_at: Mapping[Pass, Sequence[JoinPart]], seed: Pass) -> list[JoinPart]:
    """All joins of the node to which `seed` belongs, each once, in the order of their names in the scene."""
    seen = {seed}
    pending = [seed]
    found: dict[str, JoinPart] = {}
    while pending:
        for join in joins_at.get(pending.pop(), ()):
            found[join.name] = join
            fresh = [node for node in join.nodes if node not in seen]
            seen.update(fresh)
            pending += fresh
    return list(found.values())


def gather(joins: Sequence[JoinPart]) -> JointGroup:
    """Clusters and links of one shared node.

    Raises
    ------
    ValueError
        Two nodes both rigidly joined and free to turn against each other, or two forms at one node.
    """
    nodes = sorted({node for join in joins for node in join.nodes})
    number = {node: i for i, node in enumerate(nodes)}
    roots = UnionFind(len(nodes))
    rigid = [join for join in joins if join.kind == "rigid"]
    for join in rigid:
        roots.unite(number[join.nodes[0]], number[join.nodes[1]])
    forms = sorted({join.form for join in rigid})
    if len(forms) > 1:
        raise ValueError(f"form must be the same in all joints at one node, got {forms[0]!r} and {forms[1]!r}")
    order = sorted({roots.find(i) for i in range(len(nodes))})
    clusters = tuple(tuple(node for node in nodes if roots.find(number[node]) == root) for root in order)
    for cluster in clusters:
        if sum(node[0] < 0 for node in cluster) > 1:
            raise ValueError("two bodies must not be joined rigidly: describe them by one body")

    links: dict[tuple[int, int], JoinPart] = {}
    for join in joins:
        if join.kind == "rigid":
            continue
        a, b = (order.index(roots.find(number[node])) for node in join.nodes)
        names = f"{join.node_names[0]!r} and {join.node_names[1]!r}"
        if a == b:
            raise ValueError(f"{names} cannot be both rigidly joined and {join.kind} at one node")
        if join.axis is not None:
            if (a, b) in links or (b, a) in links:
                raise ValueError(f"{names} already have a revolute joint at this node")
            links[a, b] = join
    return JointGroup(clusters, tuple((a, b, join) for (a, b), join in links.items()), forms[0] if forms else "frame")


def groups(joins: Sequence[JoinPart]) -> list[JointGroup]:
    """One group for every shared node, in the order of its first join."""
    joins_at: dict[Pass, list[JoinPart]] = {}
    for join in joins:
        for node in join.nodes:
            joins_at.setdefault(node, []).append(join)
    found: list[JointGroup] = []
    done: set[str] = set()
    for join in joins:
        if join.name not in done:
            members = connected(joins_at, join.nodes[0])
            done.update(member.name for member in members)
            found.append(gather(members))
    return found


def revolute_joints(joins: Sequence[JoinPart]) -> list[JoinPart]:
    """Those that turn about an axis, in the order in which the engine numbers them."""
    return [join for group in groups(joins) for _, _, join in group.links]


def side_of(join: JoinPart, joins: Sequence[JoinPart]) -> list[Pass] | None:
    """Nodes that stay with the second node of a join without it; None if they stay with the first node, too.

    `joins`: all joins at the node.
    """
    side, pending = {join.nodes[1]}, [join.nodes[1]]
    while pending:
        node = pending.pop()
        for other in joins:
            if other is not join and node in other.nodes:
                fresh = [each for each in other.nodes if each not in side]
                side.update(fresh)
                pending += fresh
    return None if join.nodes[0] in side else sorted(side)


def describe_joint(group: JointGroup) -> _core.JointDescription:
    """One joint as the engine takes it."""
    joint = _core.JointDescription()
    joint.clusters = [[_core.RodPass(*node) for node in cluster if node[0] >= 0] for cluster in group.clusters]
    bodies = [next((-1 - node[0] for node in cluster if node[0] < 0), -1) for cluster in group.clusters]
    joint.bodies = bodies if max(bodies) >= 0 else []
    joint.links = [_describe_link(parent, child, join) for parent, child, join in group.links]
    joint.form = group.form
    return joint


def _describe_link(parent: int, child: int, join: JoinPart) -> _core.JointLink:
    assert join.axis is not None
    link = _core.JointLink(parent, child, join.axis)
    link.slides = join.kind == "sliding"
    for word in kind_of(join).words:
        setattr(link, word.name, getattr(join, word.name))
    if join.limits is not None:
        link.set_stops(*join.limits, join.limit_stiffness, join.restitution)
    return link
