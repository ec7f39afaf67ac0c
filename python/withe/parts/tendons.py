"""Tendons through guides on rods, and how the engine is told of them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.handles import EdgeHandle, Handle, NodeHandle, Rod, parse_place, parse_point
from withe.parts.kinds import Guide, RodPart, TendonPart
from withe.parts.plausibility import check_offset
from withe.parts.table import checked, tendon_outline

__all__ = ["Guides", "make_tendon"]

FloatArray = npt.NDArray[np.float64]
Guides = Rod | str | Iterable[EdgeHandle | NodeHandle | str]  # a BodyPoint is a NodeHandle


def make_tendon(
    directory: Directory, guides: Guides, offset: npt.ArrayLike | None, tension: float, name: str | None
) -> TendonPart:
    """A tendon, checked; see `Scene.add_tendon`. Not yet in the directory."""
    name = directory.new_name(name, "tendon")
    places = _places(directory, guides, name)
    if len(places) < 2:
        raise ValueError(f"tendon {name!r} must have at least two guides, got {len(places)}")
    offsets = _offsets(offset, places, name)
    tension_of = checked(TendonPart, "tension", tension, name)
    part = TendonPart(name, places, offsets, tension_of)
    points = _drawn(directory, part)
    for index, length in enumerate(np.linalg.norm(np.diff(points, axis=0), axis=1)):
        if length <= 1e-12 * np.abs(points).max():
            raise ValueError(
                f"guides {index} and {index + 1} of tendon {name!r} must not coincide, but both are at {points[index]}"
            )
    rods = {rod.index: rod for rod in directory.all(RodPart)}
    on_rods = [i for i, place in enumerate(places) if place[0] >= 0]
    if not on_rods:
        return part
    radii = np.array([rods[places[i][0]].section.radii[places[i][1]] for i in on_rods])
    along = len(places) > 2 and isinstance(guides, Rod | str) and not rods[places[0][0]].closed
    length = sum(float(rods[rod].lengths.sum()) for rod in {places[i][0] for i in on_rods})
    check_offset(
        part.offsets[on_rods], radii, length, pulls_all_along=along and part.tension > 0.0, owner=f"tendon {name!r}"
    )
    return part


def _offsets(offset: npt.ArrayLike | None, places: tuple[Guide, ...], name: str) -> FloatArray:
    """Return the offset of each guide, which is zero at points of bodies, shape (guides, 2) [m]."""
    on_bodies = np.array([rod < 0 for rod, _, _ in places])
    if offset is None:
        if not on_bodies.all():
            raise ValueError(f"offset of tendon {name!r} must be given, because it has guides on rods")
        return np.zeros((len(places), 2))
    given = validation.number_array(offset, f"offset of tendon {name!r}", (2,), (len(places), 2))
    if given.ndim == 2 and np.any(given[on_bodies]):
        raise ValueError(
            f"offset of tendon {name!r} must be zero at guides on bodies, which are points of the bodies: use "
            "body.at(point) with another point"
        )
    found = np.array(np.broadcast_to(given, (len(places), 2)))
    found[on_bodies] = 0.0
    return found


def _places(directory: Directory, guides: Guides, name: str) -> tuple[Guide, ...]:
    if isinstance(guides, NodeHandle | EdgeHandle) or (isinstance(guides, str) and parse_place(guides) is not None):
        raise ValueError(f"guides of tendon {name!r} must be a rod or several edges, got {guides!r:.80} alone")
    if isinstance(guides, Handle | str):
        return _along(directory.rod(guides, f"guides of tendon {name!r}"))
    if not isinstance(guides, Iterable):
        raise ValueError(
            f"guides of tendon {name!r} must be a rod or edges such as arm.edge(3), got {type(guides).__name__}"
        )
    return tuple(_place(directory, guide, f"guide of tendon {name!r}") for guide in guides)


def _along(rod: RodPart) -> tuple[Guide, ...]:
    edges: list[Guide] = [(rod.index, edge, "middle") for edge in range(len(rod.lengths))]
    if rod.closed:
        return (*edges, edges[0])
    return ((rod.index, 0, "start"), *edges, (rod.index, len(edges) - 1, "end"))


def _place(directory: Directory, guide: EdgeHandle | NodeHandle | str, what: str) -> Guide:
    if directory.is_body(guide):
        raise ValueError(f"{what} must be a point of a body, such as hand.at((0, 0, 0.1)), got the body {guide!r:.80}")
    point = parse_point(guide) if isinstance(guide, str) else None
    place = parse_place(guide) if isinstance(guide, str) else None
    if point is None and not (isinstance(guide, NodeHandle) or (place is not None and place[1] == "node")):
        return (*directory.edge(guide, what), "middle")
    (index, node), node_name = directory.node(guide, what, or_body=True)
    if index < 0:
        return index, node, "middle"
    rod = next(part for part in directory.all(RodPart) if part.index == index)
    if rod.closed or node not in (0, len(rod.lengths)):
        raise ValueError(f"{what} must be an edge, or an end of a rod, got {node_name!r}")
    return (index, 0, "start") if node == 0 else (index, node - 1, "end")


def _drawn(directory: Directory, part: TendonPart) -> FloatArray:
    """Return the drawn positions of the guides, shape (guides, 3) [m]."""
    rods = {rod.index: rod for rod in directory.all(RodPart)}
    frames = {
        index: np.stack([rod.directors, np.cross(rod.tangents, rod.directors), rod.tangents], axis=1)
        for index, rod in rods.items()
    }
    points = {index: rod.points for index, rod in rods.items()}
    on_bodies = [(rod, point) for rod, point, _ in part.guides if rod < 0]
    points[-1] = np.array([directory.point(place) for place in on_bodies]).reshape(-1, 3)
    return tendon_outline(part, on_bodies.index).points(points, frames)
