"""Springs between nodes, and how the engine is told of them."""

from __future__ import annotations

import numpy as np

from withe import _core
from withe.parts.directory import Directory
from withe.parts.handles import NodeHandle
from withe.parts.kinds import SpringPart
from withe.parts.table import checked, kind_of

__all__ = ["describe_springs", "make_spring"]


def make_spring(
    directory: Directory,
    a: NodeHandle | str,
    b: NodeHandle | str,
    stiffness: float,
    rest_length: float | None,
    damping: float,
    name: str | None,
) -> SpringPart:
    """A spring, checked; see `Scene.add_spring`. Not yet in the directory."""
    name = directory.new_name(name, "spring")
    first, first_name = directory.node(a, "first node of the spring")
    second, second_name = directory.node(b, "second node of the spring")
    if directory.row(first) == directory.row(second):
        raise ValueError(_one_node(name, first_name, second_name))
    distance = float(np.linalg.norm(directory.point(second) - directory.point(first)))
    part = SpringPart(
        name,
        (first, second),
        (first_name, second_name),
        checked(SpringPart, "stiffness", stiffness, name),
        checked(SpringPart, "rest_length", distance if rest_length is None else rest_length, name),
        checked(SpringPart, "damping", damping, name),
        rest_length is None,
    )
    if distance == 0.0 and part.rest_length > 0.0:
        raise ValueError(
            f"rest_length of spring {name!r} must be 0, because the nodes of the spring coincide, got "
            f"{part.rest_length:g}: draw the nodes apart, or leave rest_length out"
        )
    return part


def describe_springs(directory: Directory) -> list[_core.SpringDescription]:
    """The springs of a scene as the engine takes them.

    Raises
    ------
    ValueError
        A spring between nodes that were joined since it was added.
    """
    springs = []
    for part in directory.all(SpringPart):
        spring = _core.SpringDescription()
        first, second = (directory.row(node) for node in part.nodes)
        if first == second:
            raise ValueError(_one_node(part.name, *part.node_names))
        spring.nodes = [first, second]
        for word in kind_of(part).words:
            setattr(spring, word.name, getattr(part, word.name))
        springs.append(spring)
    return springs


def _one_node(name: str, first: str, second: str) -> str:
    joined = "which is one node" if first == second else "which are joined to one node"
    return f"spring {name!r} must act between two nodes, got {first!r} and {second!r}, {joined}"
