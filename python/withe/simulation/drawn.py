"""Gradients of equilibria by the nodes of a rod as it was drawn."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import drawing
from withe.parts.kinds import JoinPart, ObstaclePart, RodPart, SpringPart, SupportPart
from withe.parts.rods import redrawn
from withe.simulation.session import Session

__all__ = ["points_reader"]

FloatArray = npt.NDArray[np.float64]

_STEP = 1e-3  # of the shortest edge, of differences that leave its fourth power


def points_reader(session: Session, part: RodPart, first: int) -> Callable[[_core.EquilibriumGradient], FloatArray]:
    """Reads derivatives by drawn nodes, (nodes, 3) [1/m], of a rod whose edges begin with `first`.

    What the engine knows is derivatives by rest lengths, natural shape, and what supports hold. How these follow from
    the nodes is geometry alone, whose differences are taken.
    """
    supports = _check(session, part)
    follows = [
        np.array_equal(session.world.natural_curvature(part.index), part.natural_curvature),
        np.array_equal(session.world.natural_twist(part.index), part.natural_twist),
    ]

    def read(g: _core.EquilibriumGradient) -> FloatArray:
        by_length = np.asarray(g.parameters.rest_length)[first : first + len(part.lengths)]
        by_curvature = np.asarray(g.parameters.natural_curvature[part.index]) * follows[0]
        by_twist = np.asarray(g.parameters.natural_twist[part.index]) * follows[1]
        spins = [(support, np.asarray(g.held_spins)[index]) for index, support in supports]
        frames = [_frame(part, support) for support, _ in spins]

        def of(points: FloatArray) -> float:
            other = redrawn(part, points)
            value = by_length @ (other.lengths - part.lengths)
            value += np.sum(by_curvature * (other.natural_curvature - part.natural_curvature))
            value += by_twist @ (other.natural_twist - part.natural_twist)
            for (support, spin), frame in zip(spins, frames, strict=True):
                turn = _frame(other, support) @ frame.T
                value += 0.5 * spin @ (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
            return float(value)

        out = np.asarray(g.held_nodes)[session.directory.layout.rows(part.index)].copy()
        step = _STEP * float(part.lengths.min())
        for place in np.ndindex(part.points.shape):
            way = np.zeros(part.points.shape)
            way[place] = step
            near = of(part.points + way) - of(part.points - way)
            far = of(part.points + 2.0 * way) - of(part.points - 2.0 * way)
            out[place] += (8.0 * near - far) / (12.0 * step)
        plan = session.world.plan
        if plan.planar:
            normal = np.asarray(plan.plane_normal)
            out -= np.outer(out @ normal, normal)
        return out

    return read


def _frame(part: RodPart, support: SupportPart) -> FloatArray:
    """Directors and tangent of the end that a support holds, as columns."""
    if support.kind == "pin":
        return np.eye(3)
    if support.kind in ("clamp", "spinning_clamp"):
        tangent, director = drawing.drawn_frame(
            part.tangents, part.directors, part.lengths, support.node[1], part.closed
        )
    else:
        edge = min(support.node[1], len(part.tangents) - 1)
        tangent, director = part.tangents[edge], part.directors[edge]
    return np.stack([director, np.cross(tangent, director), tangent], axis=1)


def _check(session: Session, part: RodPart) -> list[tuple[int, SupportPart]]:
    """The supports of a rod. Refuses what depends on drawn nodes by more than the engine has derivatives of."""

    def refuse(why: str) -> None:
        raise ValueError(f"no gradient by points of {part.owner} is known {why}")

    if part.drawing is None or not np.array_equal(part.arcs, part.lengths):
        refuse("where nodes= found them or curvature is discrete: draw the nodes themselves")
    if session.directory.all(JoinPart):
        refuse("where rods are joined")
    if session.world.contact.rods or session.directory.all(ObstaclePart):
        refuse("where rods or obstacles touch")
    if any(load.kind in ("load", "pressure") for load in session.loads):
        refuse("under loads along rods")
    drawn = {rod.index: rod.points for rod in session.directory.all(RodPart)}
    for spring in session.directory.all(SpringPart):
        a, b = (drawn[rod][node] for rod, node in spring.nodes)
        if part.index in (spring.nodes[0][0], spring.nodes[1][0]) and np.isclose(
            spring.rest_length, np.linalg.norm(b - a), rtol=1e-12
        ):
            refuse(f"where {spring.name!r} is as long as it was drawn: give rest_length=")
    found = []
    for index, support in session.settings.supports.values():
        if support.grasp is not None:
            refuse("where a hand holds a rod")
        if support.node[0] != part.index:
            continue
        node = support.node[1]
        if support.kind != "pin" and (part.closed or node not in (0, len(part.points) - 1)):
            refuse("where an inner node is clamped")
        at = np.array(session.world.support_position(index)) - part.points[node]
        turn = np.array(session.world.support_rotation(index)) - np.eye(3)
        if np.abs(at).max() > 1e-9 * part.lengths.min() or np.abs(turn).max() > 1e-9:
            refuse(f"once {support.name!r} has moved")
        found.append((index, support))
    return found
