"""Finds the parts of a scene by handle or by name."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.validation import near_word
from withe.parts.handles import EdgeHandle, Handle, Layout, NodeHandle, Rod, parse_place, parse_point
from withe.parts.kinds import Actuation, BodyPart, ClosedLoop, ContactSettings, Part, Pass, RodPart
from withe.parts.table import handle_of, kind_of

__all__ = ["Directory"]

P = TypeVar("P", bound=Part)


class Directory:
    """The named parts of one scene. A simulation keeps its own copy, so the scene may go on changing."""

    def __init__(self, scene_id: str) -> None:
        self.scene_id = scene_id
        self.layout: Layout = Layout()
        self.parts: dict[str, Part] = {}
        self.contact: ContactSettings = ContactSettings()
        self.actuations: tuple[Actuation, ...] = ()  # in the order of time
        self.loops: tuple[ClosedLoop, ...] = ()  # found when the scene is built
        self._retired: dict[str, int] = {}  # greatest number of a released part that was named by one, by its word

    def copy(self) -> Directory:
        """A directory that no longer changes with this one."""
        other = Directory(self.scene_id)
        other.layout = self.layout.copy()
        other.parts = dict(self.parts)
        other.contact = self.contact
        other.actuations = self.actuations
        other.loops = self.loops
        other._retired = dict(self._retired)
        return other

    def all(self, kind: type[P]) -> list[P]:
        """Parts of one kind, in the order they were added."""
        return [part for part in self.parts.values() if isinstance(part, kind)]

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Handles of all rods."""
        return tuple(Rod(self.scene_id, part.name, self.layout, part.index) for part in self.all(RodPart))

    def add(self, part: Part) -> Handle:
        """Take in a part whose name is new, and return its handle."""
        self.parts[part.name] = part
        return handle_of(part, self.scene_id, self.layout)

    def remove(self, name: str) -> None:
        """Take a part out. A name that was made for it is not made again, so that its handle stays without a part."""
        del self.parts[name]
        word, _, number = name.rpartition(" ")
        if number.isdecimal():
            self._retired[word] = max(self._retired.get(word, 0), int(number))

    def new_name(self, name: str | None, word: str) -> str:
        """A name that is free: the one given, or the word and a number.

        Raises
        ------
        ValueError
            Not text, taken, or a name that nodes and edges have.
        """
        if name is None:
            number = self._retired.get(word, 0) + 1
            while f"{word} {number}" in self.parts:
                number += 1
            return f"{word} {number}"
        if not isinstance(name, str) or not name or not name.isprintable():
            raise ValueError(f"name of the {word} must be printable text, got {name!r:.80}")
        if name in self.parts:
            raise ValueError(
                f"name of the {word} must be new: {name!r} is already the name of a {kind_of(self.parts[name]).noun}"
            )
        if parse_place(name) is not None or parse_point(name) is not None:
            raise ValueError(f"name of the {word} must not look like the name of a node or edge, got {name!r}")
        return name

    def find(self, handle: Handle | str, kind: type[P], what: str) -> P:
        """The part that a handle or a name stands for.

        Raises
        ------
        ValueError
            A handle of another scene, of another kind of part, or an unknown name.
        """
        part = self.find_any(handle, what)
        if not isinstance(part, kind):
            raise ValueError(f"{what} must be a {kind_of(kind).noun}, got the {kind_of(part).noun} {part.name!r}")
        return part

    def find_any(self, handle: Handle | str, what: str) -> Part:
        """The part of any kind that a handle or a name stands for."""
        name = self._name(handle, what)
        if isinstance(handle, NodeHandle | EdgeHandle):
            raise ValueError(f"{what} must not be a node or an edge, got {name!r}")
        part = self.parts.get(name)
        if part is None:
            known = ", ".join(map(repr, sorted(self.parts)[:12])) or "nothing"
            near = near_word(name, self.parts)
            meant = "" if near is None else f"; did you mean {near!r}?"
            raise ValueError(f"{what} {name!r:.80} is not in the scene, which has {known}{meant}")
        return part

    def handle(self, name: str) -> Any:
        """The handle of the part, node or edge of that name."""
        if not isinstance(name, str):
            raise ValueError(f"name must be text, got {type(name).__name__}")
        part = self.parts.get(name)
        if part is not None:
            return handle_of(part, self.scene_id, self.layout)
        place = parse_place(name)
        if place is not None and place[1] == "edge":
            rod, edge = self.edge(name, "name")
            return self.rods[rod].edge(edge)
        (index, node), _ = self.node(name, "name")
        return self.rods[index].node(node)

    def rod(self, handle: Handle | str, what: str = "rod") -> RodPart:
        """The rod that a handle or a name stands for."""
        if what == "rod" and isinstance(body := self.find_any(handle, what), BodyPart):
            raise ValueError(
                f"rod must be a rod, got the body {body.name!r}: use `position`, `velocity` and `rotation` of bodies"
            )
        return self.find(handle, RodPart, what)

    def node(self, handle: Handle | str, what: str = "node", or_body: bool = False) -> tuple[Pass, str]:
        """The node that a handle or a name such as "arm.end" stands for: (rod, node of the rod), its name.

        With `or_body`, errors state that a body is possible too.
        """
        name = self._name(handle, what)
        point = parse_point(name)
        if point is not None and self.is_body(point[0]):
            return self.place(point[0], point[1], what)
        if isinstance(handle, NodeHandle):
            place: tuple[str, str, int] | None = (handle.rod, "node", handle.index)
        else:
            place = parse_place(name)
        if place is None or place[1] != "node" or isinstance(handle, EdgeHandle):
            near = near_word(name, [part.name for part in self.all(BodyPart)]) if or_body else None
            raise ValueError(
                f"{what} must be a node of a rod, such as arm.end or arm.node(3){', or a body' if or_body else ''}, "
                f"got {name!r:.80}{'' if near is None else f'; did you mean {near!r}?'}"
            )
        found = self._rod_of(place[0], name, what)
        if isinstance(handle, str) and name.endswith((".start", ".end")):
            node = found.start if place[2] == 0 else found.end
        else:
            node = found.node(place[2])
        return (found.index, node.index), node.name

    def is_body(self, handle: object) -> bool:
        """True of the handle or the name of a body."""
        name = handle.name if isinstance(handle, Handle) else handle
        return isinstance(name, str) and isinstance(self.parts.get(name), BodyPart)

    def place(self, handle: Handle | str, at: npt.ArrayLike | None, what: str) -> tuple[Pass, str]:
        """The node of a rod, or the point of a body at `at` as drawn, by default its centre of mass; and its name."""
        if not self.is_body(handle):
            found = self.node(handle, what, or_body=True)
            if at is not None:
                raise ValueError(f"at= is a point of a body, but {found[1]!r} is a node of a rod")
            return found
        body = self.find(handle, BodyPart, what)
        point = body.center if at is None else validation.vector(at, f"at of body {body.name!r}")
        near = 1e-9 * float(np.linalg.norm(point - body.center)) + 1e-12 * float(np.linalg.norm(point))
        return self.layout.body_point(body.index, point, near), body.name

    def edge(self, handle: Handle | str, what: str = "edge") -> tuple[int, int]:
        """The edge that a handle or a name such as "arm.edge(3)" stands for: rod, edge of the rod."""
        name = self._name(handle, what)
        place = parse_place(name)
        if place is None or place[1] != "edge" or isinstance(handle, NodeHandle):
            raise ValueError(f"{what} must be an edge of a rod, such as arm.edge(3), got {name!r:.80}")
        rod = self._rod_of(place[0], name, what)
        return rod.index, rod.edge(place[2]).index

    def _rod_of(self, rod: str, name: str, what: str) -> Rod:
        """The rod of the node or edge of a name."""
        part = self.parts.get(rod)
        if not isinstance(part, RodPart):
            raise ValueError(f"{what} {name!r:.80} is not in the scene: it has no rod {rod!r:.80}")
        return Rod(self.scene_id, part.name, self.layout, part.index)

    def point(self, node: Pass) -> npt.NDArray[np.float64]:
        """Return the drawn position of a node of a rod, or of a point of a body, (3,) [m]."""
        if node[0] < 0:
            return self.layout.body_points[-1 - node[0]][node[1]]
        return np.asarray(self.rod(self.layout.rods[node[0]].name).points[node[1]])

    def row(self, node: Pass) -> int:
        """The row of a node in the positions of the scene."""
        return int(self.layout.rows(node[0])[node[1]])

    def _name(self, handle: Handle | str, what: str) -> str:
        if isinstance(handle, Handle):
            if handle.scene_id != self.scene_id:
                raise ValueError(f"{what} {handle.name!r} is a handle of another scene")
            return handle.name
        if isinstance(handle, str):
            return handle
        raise ValueError(f"{what} must be a handle or a name, got {type(handle).__name__}")
