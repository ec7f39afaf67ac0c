"""Tendons through guides on rods, and how the engine is told of them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.handles import EdgeHandle, Handle, NodeHandle, Rod, parse_place
from withe.parts.kinds import Guide, RodPart, TendonPart
from withe.parts.plausibility import check_offset
from withe.parts.table import checked, tendon_outline

__all__ = ["Guides", "make_tendon"]

FloatArray = npt.NDArray[np.float64]
Guides = Rod | str | Iterable[EdgeHandle | NodeHandle | str]


def make_tendon(
    directory: Directory, guides: Guides, offset: npt.ArrayLike, tension: float, name: str | None
) -> TendonPart:
    """A tendon, checked; see `Scene.add_tendon`. Not yet in the directory."""
    name = directory.new_name(name, "tendon")
    places = _places(directory, guides, name)
    if len(places) < 2:
        raise ValueError(f"tendon {name!r} must have at least two guides, got {len(places)}")
    given = validation.number_array(offset, f"offset of tendon {name!r}", (2,), (len(places), 2))
    tension_of = checked(TendonPart, "tension", tension, name)
    part = TendonPart(name, places, np.array(np.broadcast_to(given, (len(places), 2))), tension_of)
    points = _drawn(directory, part)
    for index, length in enumerate(np.linalg.norm(np.diff(points, axis=0), axis=1)):
        if length <= 1e-12 * np.abs(points).max():
            raise ValueError(
                f"guides {index} and {index + 1} of tendon {name!r} must not coincide, but both are at {points[index]}"
            )
    rods = {rod.index: rod for rod in directory.all(RodPart)}
    radii = np.array([rods[rod].section.radii[edge] for rod, edge, _ in places])
    along = len(places) > 2 and isinstance(guides, Rod | str) and not rods[places[0][0]].closed
    length = sum(float(rods[rod].lengths.sum()) for rod in {rod for rod, _, _ in places})
    check_offset(part.offsets, radii, length, pulls_all_along=along and part.tension > 0.0, owner=f"tendon {name!r}")
    return part


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
    place = parse_place(guide) if isinstance(guide, str) else None
    if not (isinstance(guide, NodeHandle) or (place is not None and place[1] == "node")):
        return (*directory.edge(guide, what), "middle")
    (index, node), node_name = directory.node(guide, what)
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
    return tendon_outline(part).points({index: rod.points for index, rod in rods.items()}, frames)
