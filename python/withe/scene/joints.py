"""Nodes of a scene that were made one."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.handles import Body, NodeHandle
from withe.parts.joints import connected, gather
from withe.parts.kinds import BodyPart, JoinKind, JoinPart, JointForm, Pass
from withe.parts.table import checked, kind_of

__all__ = ["JoinedNodes"]

FloatArray = npt.NDArray[np.float64]

Stops = tuple[tuple[float, float] | None, float | None, float]
"""Limits, stiffness and restitution of stops, as given."""
Numbers = tuple[float, float, float, float, float, float]
"""Values of the words of a joint, in their order."""

_ORDINALS = ("first", "second", "third", "fourth")


class JoinedNodes:
    """The joins of a scene by their nodes, so that a new one is compared only with those at its own node."""

    def __init__(self, directory: Directory) -> None:
        self._directory = directory
        self._joins_at: dict[Pass, list[JoinPart]] = {}
        self._measured = 0  # rods whose points lie between the corners
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def join(
        self,
        nodes: Sequence[NodeHandle | Body | str],
        at: npt.ArrayLike | None,
        kind: JoinKind,
        axis: npt.ArrayLike | None,
        form: JointForm,
        numbers: Numbers,
        stops: Stops,
        name: str | None,
    ) -> list[JoinPart]:
        """Joins of the first node with each of the others, checked, and all merged; not yet in the directory.

        All or none; see `Scene.join`.
        """
        names = self._new_names(name, len(nodes) - 1)
        layout = self._directory.layout
        points = list(layout.body_points)
        try:
            first, *others = self._places(nodes, at, kind)
            pairs = zip(names, others, strict=True)
            parts = [self._part(own, first, other, kind, axis, form, numbers, stops) for own, other in pairs]
            joins = {
                join.name: join for part in parts for node in part.nodes for join in connected(self._joins_at, node)
            }
            gather([*joins.values(), *parts])
        except ValueError:
            layout.restore_points(points)
            raise
        for part in parts:
            for node in part.nodes:
                self._joins_at.setdefault(node, []).append(part)
            layout.merge(*part.nodes)
        return parts

    def _places(
        self, nodes: Sequence[NodeHandle | Body | str], at: npt.ArrayLike | None, kind: JoinKind
    ) -> list[tuple[Pass, str]]:
        """The nodes of rods, and the points of bodies where the joint is; each with its name."""
        layout = self._directory.layout
        point = None if at is None else validation.vector(at, "at of the joint")
        places: list[tuple[Pass, str] | BodyPart] = []
        for i, node in enumerate(nodes):
            if self._directory.is_body(node):
                places.append(self._directory.find(node, BodyPart, "body to join"))
                continue
            what = f"{_ORDINALS[i] if i < len(_ORDINALS) else 'another'} node to join"
            places.append(self._directory.node(node, what, or_body=True))
        drawn = next((self._directory.point(place[0]) for place in places if not isinstance(place, BodyPart)), None)
        if all(not isinstance(place, BodyPart) for place in places):
            if point is not None:
                raise ValueError("at of the joint is for bodies: rods are joined at their nodes")
        elif drawn is None and point is None:
            raise ValueError(
                "at must be given to join bodies: the point of the joint as drawn, for example at=(0, 0, 0.1)"
            )
        elif drawn is not None and point is not None and np.linalg.norm(drawn - point) > 1e-9 * self._extent():
            raise ValueError(f"at of the joint must be the node, but is {np.linalg.norm(drawn - point):g} m away")
        where = drawn if drawn is not None else point
        found = []
        for place in places:
            if isinstance(place, BodyPart):
                assert where is not None
                # A part that slides leaves the other points of a body.
                near = -1.0 if kind == "sliding" else 1e-9 * self._extent()
                found.append((layout.body_point(place.index, where, near), place.name))
            else:
                found.append(place)
        return found

    def _new_names(self, name: str | None, count: int) -> list[str]:
        """One name for one joint; for several a number follows it."""
        if count == 1:
            return [self._directory.new_name(name, "joint")]
        if name is not None:
            return [self._directory.new_name(f"{name} {i + 1}", "joint") for i in range(count)]
        word, _, number = self._directory.new_name(None, "joint").rpartition(" ")
        free = (f"{word} {i}" for i in itertools.count(int(number)))
        return list(itertools.islice((each for each in free if each not in self._directory.parts), count))

    def _part(
        self,
        name: str,
        a: tuple[Pass, str],
        b: tuple[Pass, str],
        kind: JoinKind,
        axis: npt.ArrayLike | None,
        form: JointForm,
        numbers: Numbers,
        stops: Stops,
    ) -> JoinPart:
        (node_a, name_a), (node_b, name_b) = a, b
        validation.choice(kind, "kind of the joint", ("rigid", "pinned", "revolute", "sliding"))
        validation.choice(form, "form of the joint", ("frame", "pairs"))
        has_axis = kind in ("revolute", "sliding")
        if has_axis != (axis is not None):
            raise ValueError(
                "axis of the joint must be given for kind='revolute' and kind='sliding', and for no other kind, got "
                f"kind={kind!r}"
            )
        if kind == "sliding" and min(node_a[0], node_b[0]) >= 0:
            raise ValueError("a sliding joint must slide on a body: a rod slides through a ring of grasp(slides=True)")
        words = [word.name for word in kind_of(JoinPart).words]
        values = {word: checked(JoinPart, word, value, name) for word, value in zip(words, numbers, strict=True)}
        given = next((word for word in words if values[word] != getattr(JoinPart, word)), None)
        if given is not None and not has_axis:
            raise ValueError(f"{given} of joint {name!r} needs kind='revolute' or kind='sliding', got kind={kind!r}")
        if form == "pairs" and min(node_a[0], node_b[0]) < 0:
            raise ValueError(f"form of the joint must be 'frame' for a body, got form={form!r}")
        if form == "pairs" and kind != "rigid":
            raise ValueError(f"form of the joint must be 'frame' when kind={kind!r}")
        if node_a == node_b:
            raise ValueError(f"nodes to join must be two, got {name_a!r} twice")
        distance = float(np.linalg.norm(self._directory.point(node_a) - self._directory.point(node_b)))
        if distance > 1e-9 * self._extent():
            raise ValueError(
                f"nodes {name_a!r} and {name_b!r} must coincide to be joined, but are {distance:g} m apart"
            )
        direction = None if axis is None else validation.unit_vector(axis, "axis of the joint")
        limits, stiffness, restitution = _stops(stops, name, kind if has_axis else None)
        return JoinPart(
            name,
            (node_a, node_b),
            (name_a, name_b),
            kind,
            direction,
            form,
            **values,
            limits=limits,
            limit_stiffness=stiffness,
            restitution=restitution,
        )

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
        low, high = self._low, self._high
        for body in self._directory.layout.body_points:
            low, high = np.minimum(low, body[0]), np.maximum(high, body[0])
        return float(np.linalg.norm(high - low))


def _stops(stops: Stops, name: str, kind: str | None) -> tuple[tuple[float, float] | None, float, float]:
    """Return checked limits, stiffness and restitution of stops; `kind` is None for a joint without an axis."""
    limits, stiffness, given = stops
    restitution = validation.share(given, f"restitution of joint {name!r}")
    if limits is None:
        word = "limit_stiffness" if stiffness is not None else "restitution" if restitution < 1.0 else None
        if word is not None:
            raise ValueError(f"{word} of joint {name!r} needs limits=")
        return None, 0.0, 1.0
    if kind is None:
        raise ValueError(f"limits of joint {name!r} need kind='revolute' or kind='sliding'")
    try:
        low, high = map(float, limits)
    except (TypeError, ValueError):
        raise ValueError(f"limits of joint {name!r} must be two angles, got {limits!r:.80}") from None
    if not low <= 0.0 <= high or low == high:
        raise ValueError(f"limits of joint {name!r} must contain the drawn angle, 0, got ({low:g}, {high:g})")
    if stiffness is None:
        raise ValueError(
            f"limits of joint {name!r} need limit_stiffness=: the greatest torque that the stops must bear, over the "
            "angle by which they may yield"
        )
    return (low, high), validation.positive(stiffness, f"limit_stiffness of joint {name!r}"), restitution
