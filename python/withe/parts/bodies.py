"""Rigid bodies: how they are made, checked and described to the engine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.common.union_find import UnionFind
from withe.parts.body_surfaces import core_of, make_surface
from withe.parts.directory import Directory
from withe.parts.kinds import BodyPart, JoinPart, SupportPart
from withe.solids import Field, Tube
from withe.solids.bodies import Solid

__all__ = ["describe_bodies", "make_body"]

FloatArray = npt.NDArray[np.float64]
_OF_SOLIDS = ("volume", "center", "inertia_per_mass", "surface")


def make_body(
    name: str,
    index: int,
    solid: Solid | None,
    density: float | None,
    mass: float | None,
    inertia: npt.ArrayLike | None,
    center: npt.ArrayLike | None,
    position: npt.ArrayLike,
    rotation: npt.ArrayLike | None,
    friction: float | None = None,
    restitution: float | None = None,
    touches: bool = True,
) -> BodyPart:
    """Make and check a body; see `Scene.add_body`."""
    owner = f"body {name!r}"
    origin = validation.vector(position, f"position of {owner}")
    axes = np.eye(3) if rotation is None else validation.rotation_matrix(rotation, f"rotation of {owner}")
    if isinstance(solid, Tube | Field):
        raise ValueError(f"solid of {owner} is a {type(solid).__name__.lower()}, an obstacle: use add_obstacle")
    if solid is not None and (isinstance(solid, type) or not all(hasattr(solid, word) for word in _OF_SOLIDS)):
        raise ValueError(
            f"solid of {owner} must be one of withe.solids, for example withe.solids.Box((0.1, 0.1, 0.1)), got "
            f"{solid!r:.80}"
        )
    if solid is not None and inertia is None:
        if center is not None:
            raise ValueError(f"center of {owner} follows from its solid, unless inertia= is given too")
        if (density is None) == (mass is None):
            raise ValueError(f"{owner} must have either density= or mass=, got {'neither' if mass is None else 'both'}")
        if mass is not None:
            kilograms = validation.positive(mass, f"mass of {owner}")
        else:
            kilograms = solid.volume * validation.positive(density, f"density of {owner}")
        moment, middle = kilograms * solid.inertia_per_mass, solid.center
    else:  # a solid is only drawn
        if solid is not None and (mass is None or density is not None):
            raise ValueError(f"inertia of {owner} needs mass= and no density=, because its solid is then only drawn")
        if density is not None:
            raise ValueError(f"density of {owner} needs a solid, for example withe.solids.Box((0.1, 0.1, 0.1))")
        if mass is None or inertia is None:
            raise ValueError(f"{owner} must have mass= and inertia=, or a solid with density=")
        kilograms = validation.positive(mass, f"mass of {owner}")
        moment = _inertia(inertia, owner)
        middle = np.zeros(3) if center is None else validation.vector(center, f"center of {owner}")
    surface = None
    core = core_of(solid)
    is_to_touch = validation.truth(touches, f"touches of {owner}") and solid is not None
    if is_to_touch and core is not None:
        surface = make_surface(core, owner, origin, axes, friction, restitution)
    elif friction is not None or restitution is not None:
        word = "restitution" if friction is None else "friction"
        raise ValueError(
            f"{word} of {owner} has no effect, because it touches nothing: use a sphere, capsule, box, hull or mesh"
        )
    turned = axes @ moment @ axes.T
    drawn_only = is_to_touch and surface is None
    return BodyPart(name, index, kilograms, turned, origin + axes @ middle, origin, axes, solid, surface, drawn_only)


def _inertia(value: npt.ArrayLike, owner: str) -> FloatArray:
    """Return a moment of inertia, (3, 3), from one number, three principal moments or a matrix."""
    given = validation.number_array(value, f"inertia of {owner}", (), (3,), (3, 3))
    moment = given * np.eye(3) if given.ndim < 2 else given
    size = float(np.abs(moment).max())
    if np.abs(moment - moment.T).max() > 1e-9 * size:
        raise ValueError(f"inertia of {owner} must be symmetric, got {given.tolist()} kg m^2")
    moment = 0.5 * (moment + moment.T)
    principal = np.linalg.eigvalsh(moment)
    if not principal[0] > 0.0:
        raise ValueError(f"inertia of {owner} must be positive, got principal moments {principal.tolist()} kg m^2")
    if principal[0] + principal[1] < principal[2] * (1.0 - 1e-9):
        raise ValueError(
            f"inertia of {owner} belongs to no body: the sum of two principal moments must not be less than the "
            f"third, got {principal.tolist()} kg m^2"
        )
    return moment


def describe_bodies(directory: Directory) -> list[_core.BodyDescription]:
    """All bodies for the engine, each after those that carry it.

    Raises
    ------
    ValueError
        Bodies that joints connect to a closed loop.
    """
    bodies = directory.all(BodyPart)
    places = {body: (base, carrier) for body, base, carrier in _bases(directory, bodies)}
    slid = _slid_rows(directory)
    _check_held_once(directory, bodies, {body: base for body, (base, _) in places.items()}, slid)
    given = [(body.index, body.name, body.inertia) for body in bodies]
    copies = [
        (loop.copy, f"copy of {bodies[loop.body].name} at {loop.joint}", np.zeros((3, 3))) for loop in directory.loops
    ]
    found = []
    for index, name, inertia in given + copies:
        rows = directory.layout.rows(-1 - index)
        description = _core.BodyDescription()
        description.name = name
        description.center = directory.row((-1 - index, 0))
        description.node, description.carrier = places[index]
        description.carried = sorted(int(row) for row in rows if row != description.node and row not in slid[index])
        description.inertia = inertia
        found.append(description)
    return found


def _slid_rows(directory: Directory) -> dict[int, set[int]]:
    """Rows of sliding joints of each body, and of copies of bodies at closed loops."""
    rows: dict[int, set[int]] = {index: set() for index in range(len(directory.layout.body_points))}
    for join in directory.all(JoinPart):
        for node in join.nodes if join.kind == "sliding" else ():
            if node[0] < 0:
                rows[-1 - node[0]].add(directory.row(node))
    return rows


def _check_held_once(
    directory: Directory, bodies: list[BodyPart], bases: dict[int, int], slid: dict[int, set[int]]
) -> None:
    """Refuse supports at a second point of a body, and of a second body of those that joints connect."""
    supports = [support for support in directory.all(SupportPart) if support.grasp is None]
    holders = {directory.row(support.node): support.name for support in supports}
    for body in bodies:
        base = bases[body.index]
        rows = set(directory.layout.rows(-1 - body.index).tolist()) - slid[body.index] - {base}
        other = next((holders[row] for row in sorted(rows) if row in holders), None)
        if other is None:
            continue
        if base in holders:
            raise ValueError(
                f"{holders[base]!r} and {other!r} hold two points of body {body.name!r}: remove one of the supports"
            )
        raise ValueError(
            f"{other!r} holds body {body.name!r}, and joints connect this body to another one that is held. Such a "
            "closed loop is not supported: remove one of the supports"
        )


def _closed(directory: Directory, first: BodyPart, second: BodyPart) -> str:
    """Return the message about two bodies between which joints make a closed loop."""
    points = {body.index: set(directory.layout.rows(-1 - body.index).tolist()) for body in (first, second)}
    shared = points[first.index] & points[second.index]
    joints = [join.name for join in directory.all(JoinPart) if directory.row(join.nodes[0]) in shared]
    return (
        f"joints connect bodies {first.name!r} and {second.name!r} to a closed loop, which is not supported: remove "
        f"one of its joints, such as {joints[-1]!r}"
    )


def _bases(directory: Directory, bodies: list[BodyPart]) -> Iterator[tuple[int, int, int]]:
    """Yield the index of each body, the row of its base, and the body on whose hinge it is, or -1.

    The base is the point that is held, else the point that joins it to the body before, else its first joint. A rod
    with a body at its end then keeps its band.
    """
    held = {directory.row(support.node) for support in directory.all(SupportPart)}
    joined = [node for join in directory.all(JoinPart) for node in join.nodes if node[0] < 0]
    count = len(directory.layout.body_points)
    rows = {body: [directory.row(node) for node in joined if node[0] == -1 - body] for body in range(count)}
    holds = {body: sorted(int(r) for r in directory.layout.rows(-1 - body) if r in held) for body in range(count)}
    owners: dict[int, list[int]] = {}
    for body, own in rows.items():
        for row in dict.fromkeys(own):
            owners.setdefault(row, []).append(body)
    loops = UnionFind(count)
    for shared in owners.values():
        for other in shared[1:]:
            if loops.find(shared[0]) == loops.find(other):
                raise ValueError(_closed(directory, bodies[shared[0]], bodies[other]))
            loops.unite(shared[0], other)
    done: set[int] = set()
    hinged = {
        frozenset(-1 - node[0] for node in join.nodes)
        for join in directory.all(JoinPart)
        if join.axis is not None and all(node[0] < 0 for node in join.nodes)
    }
    slid = _slid_rows(directory)
    # A body that a support names carries others at the same point.
    named = {-1 - support.node[0] for support in directory.all(SupportPart)}
    starts = sorted(rows, key=lambda body: (not holds[body], body not in named))
    for start in starts:
        if start in done:
            continue
        fixed = [row for row in rows[start] if row not in slid[start]]
        first = next(iter([*holds[start], *fixed]), None)
        pending = [(start, directory.row((-1 - start, 0)) if first is None else first, -1)]
        while pending:
            body, base, before = pending.pop(0)
            if body in done:
                continue
            done.add(body)
            yield body, base, before if frozenset((body, before)) in hinged else -1
            for row in dict.fromkeys(rows[body]):
                pending += [(other, row, body) for other in owners[row] if other not in done]
