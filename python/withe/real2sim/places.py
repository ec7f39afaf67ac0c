"""Points of rods that a camera identifies: nodes, and places between nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.handles import NodeHandle, Rod
from withe.parts.kinds import RodPart
from withe.simulation.simulation import Simulation

__all__ = ["Line", "Place", "Places", "lines_of", "node_count", "rod_part", "turning_axis"]

FloatArray = npt.NDArray[np.float64]
Place = NodeHandle | str | tuple[Rod | str, float]


def rod_part(simulation: Simulation, rod: Rod | str) -> RodPart:
    """Return the part of a rod."""
    return simulation._session.directory.rod(rod)


def node_count(simulation: Simulation) -> int:
    """Number of nodes of the scene."""
    return simulation._session.directory.layout.node_count


@dataclass(eq=False)
class Line:
    """Rods that continue each other end to end, as one line of nodes."""

    rods: list[RodPart]
    offsets: list[float]  # length at which each rod begins [m]
    rows: npt.NDArray[np.int64]  # rows of its nodes in the positions of the scene
    ends: FloatArray  # length along it at every node [m]


def lines_of(simulation: Simulation, rods: Sequence[RodPart]) -> list[Line]:
    """Join rods, in the given order, to as few lines as possible; a rod may start at the end of the previous one."""
    layout = simulation._session.directory.layout
    lines: list[Line] = []
    for part in rods:
        rows = layout.rows(part.index)
        rows = np.append(rows, rows[0]) if part.closed else rows
        ends = np.concatenate([[0.0], np.cumsum(part.lengths)])
        if lines and lines[-1].rows[-1] == rows[0]:
            line = lines[-1]
            line.rods.append(part)
            line.offsets.append(float(line.ends[-1]))
            line.rows = np.concatenate([line.rows, rows[1:]])
            line.ends = np.concatenate([line.ends, line.ends[-1] + ends[1:]])
        else:
            lines.append(Line([part], [0.0], rows, ends))
    return lines


class Places:
    """Points on rods as weighted means of nodes.

    Parameters
    ----------
    simulation : Simulation
    places : sequence
        Nodes, or pairs of a rod and a length along it from its start as drawn [m].

    Attributes
    ----------
    lines : list of Line
        Line of each place.
    arcs : ndarray of shape (places,) [m]
        Arc length of each place on its line.
    """

    rods: list[RodPart]
    lines: list[Line]
    arcs: FloatArray

    def __init__(self, simulation: Simulation, places: Sequence[Place]) -> None:
        directory = simulation._session.directory
        self._nodes = directory.layout.node_count
        found: list[tuple[RodPart, float]] = []
        for i, place in enumerate(places):
            if isinstance(place, tuple):
                if len(place) != 2:
                    raise ValueError(f"place {i} must be a node, or a rod and a length along it, got {place!r}")
                part = directory.rod(place[0])
                arc = validation.number(place[1], f"place {i} along {part.owner}")
            else:
                (rod, node), _ = directory.node(place, f"place {i}")
                part = directory.all(RodPart)[rod]
                arc = float(part.lengths[:node].sum())
            length = float(part.lengths.sum())
            if not -1e-9 * length <= arc <= (1.0 + 1e-9) * length:
                raise ValueError(f"place {i} must lie on {part.owner}, from 0 to {length:g} m, got {arc:g}")
            found.append((part, arc))
        self.rods = list({part.name: part for part, _ in found}.values())
        lines = lines_of(simulation, self.rods)
        where = {part.name: (line, at) for line in lines for part, at in zip(line.rods, line.offsets, strict=True)}
        self.lines = [where[part.name][0] for part, _ in found]
        self.arcs = np.array([arc + where[part.name][1] for part, arc in found])

    def __len__(self) -> int:
        return len(self.arcs)

    def weights(self, arcs: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Weights of nodes, and their derivatives by the lengths along the lines.

        Places lie on the straight edges between nodes; beyond the ends, on the line of the last edge.

        Returns
        -------
        weights : ndarray of shape (places, nodes)
        derivatives : ndarray of shape (places, nodes) [1/m]
        """
        weights = np.zeros((len(self), self._nodes))
        derivatives = np.zeros_like(weights)
        for i, (line, arc) in enumerate(zip(self.lines, self.arcs if arcs is None else arcs, strict=True)):
            edge = int(np.clip(np.searchsorted(line.ends, arc, side="right") - 1, 0, len(line.ends) - 2))
            length = line.ends[edge + 1] - line.ends[edge]
            share = (arc - line.ends[edge]) / length
            weights[i, line.rows[edge : edge + 2]] = 1.0 - share, share
            derivatives[i, line.rows[edge : edge + 2]] = -1.0 / length, 1.0 / length
        return weights, derivatives


def turning_axis(simulation: Simulation, part: RodPart) -> tuple[FloatArray, FloatArray] | None:
    """Components of curvature in the plane, shape (2,), and the axis of positive curvature, for a planar scene.

    None in space.
    """
    plan = simulation.plan
    if plan.plane_normal is None:
        return None
    d1, d2, tangent = simulation.directors(part.name)[0]
    inward = np.cross(plan.plane_normal, tangent)
    components = np.array([d1 @ inward, d2 @ inward])
    components *= np.sign(components[np.abs(components).argmax()])
    return components, np.cross(tangent, components[0] * d1 + components[1] * d2)
