"""Nodes of a scene that were made one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.handles import NodeHandle
from withe.parts.joints import JOINT_WORDS, checked_number, connected, gather
from withe.parts.kinds import JoinKind, JoinPart, JointForm, Pass

__all__ = ["JoinedNodes"]

FloatArray = npt.NDArray[np.float64]


class JoinedNodes:
    """The joins of a scene by their nodes, so that a new one is compared with those at its own node alone."""

    def __init__(self, directory: Directory) -> None:
        self._directory = directory
        self._joins_at: dict[Pass, list[JoinPart]] = {}
        self._measured = 0  # rods whose points lie between the corners
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def join(
        self,
        a: NodeHandle | str,
        b: NodeHandle | str,
        kind: JoinKind,
        axis: npt.ArrayLike | None,
        form: JointForm,
        numbers: tuple[float, float, float, float],
        name: str | None,
    ) -> JoinPart:
        """A join, checked, and its nodes merged; not yet in the directory. See `Scene.join`."""
        name = self._directory.new_name(name, "joint")
        node_a, name_a = self._directory.node(a, "first node to join")
        node_b, name_b = self._directory.node(b, "second node to join")
        validation.choice(kind, "kind of the joint", ("rigid", "pinned", "revolute"))
        validation.choice(form, "form of the joint", ("frame", "pairs"))
        if (kind == "revolute") != (axis is not None):
            raise ValueError(f"axis of the joint must be given when kind='revolute', and only then; kind is {kind!r}")
        values = {word: checked_number(name, word, value) for word, value in zip(JOINT_WORDS, numbers, strict=True)}
        given = next((word for word in JOINT_WORDS if values[word] != 0.0), None)
        if given is not None and kind != "revolute":
            raise ValueError(
                f"{given} of joint {name!r} is that of a joint with an axis: take kind='revolute', or leave it out; "
                f"kind is {kind!r}"
            )
        if form == "pairs" and kind != "rigid":
            raise ValueError(f"form of the joint must be 'frame' when kind={kind!r}")
        if node_a == node_b:
            raise ValueError(f"nodes to join must be two, got {name_a!r} twice")
        distance = float(np.linalg.norm(self._point(node_a) - self._point(node_b)))
        if distance > 1e-9 * self._extent():
            raise ValueError(
                f"nodes {name_a!r} and {name_b!r} must coincide to be joined, they are {distance:g} m apart"
            )
        direction = None if axis is None else validation.unit_vector(axis, "axis of the joint")
        part = JoinPart(name, (node_a, node_b), (name_a, name_b), kind, direction, form, **values)
        joins = {join.name: join for node in part.nodes for join in connected(self._joins_at, node)}
        gather([*joins.values(), part])
        for node in part.nodes:
            self._joins_at.setdefault(node, []).append(part)
        self._directory.layout.merge(node_a, node_b)
        return part

    def _point(self, node: Pass) -> FloatArray:
        rod = self._directory.layout.rods[node[0]].name
        return np.asarray(self._directory.rod(rod).points[node[1]])

    def _extent(self) -> float:
        """Diagonal of the box around all rods [m]."""
        rods = self._directory.layout.rods
        for place in rods[self._measured :]:
            points = self._directory.rod(place.name).points
            self._low, self._high = (
                np.minimum(self._low, points.min(axis=0)),
                np.maximum(self._high, points.max(axis=0)),
            )
        self._measured = len(rods)
        return float(np.linalg.norm(self._high - self._low))
