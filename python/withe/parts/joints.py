"""Joins gathered into joints: who is rigid with whom, and what turns about what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.parts.handles import UnionFind
from withe.parts.kinds import JoinPart, JointForm, Pass

__all__ = ["JointGroup", "connected", "gather"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointGroup:
    """One shared node: clusters of rigidly joined rods, and revolute links (parent, child, axis) between them."""

    clusters: tuple[tuple[Pass, ...], ...]
    links: tuple[tuple[int, int, FloatArray], ...]
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

    links: dict[tuple[int, int], FloatArray] = {}
    for join in joins:
        if join.kind == "rigid":
            continue
        a, b = (order.index(roots.find(number[node])) for node in join.nodes)
        names = f"{join.node_names[0]!r} and {join.node_names[1]!r}"
        if a == b:
            raise ValueError(f"{names} cannot be both rigidly joined and {join.kind} at one node")
        if join.axis is not None:
            if (a, b) in links or (b, a) in links:
                raise ValueError(f"{names} already turn against each other about an axis")
            links[a, b] = join.axis
    return JointGroup(clusters, tuple((a, b, axis) for (a, b), axis in links.items()), forms[0] if forms else "frame")
