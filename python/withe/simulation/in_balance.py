"""Rods that are in balance as drawn: the natural shape for which the drawn rod does not move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from withe.parts.directory import Directory
from withe.parts.kinds import RodPart
from withe.parts.options import BuildOptions
from withe.simulation.session import Session

__all__ = ["find_balance"]

FloatArray = npt.NDArray[np.float64]

_MOST_ITERATIONS = 20
_RIDGE = 1e-6  # relative to the trace: energy decides motions of nodes below 0.001 of those of strains
_PROBE = 1e-4  # strain by which the residual is probed


@dataclass(frozen=True, eq=False)
class _Strains:
    """One kind of natural strain of a rod, and how stiff the rod is against it.

    Attributes
    ----------
    value : ndarray of shape (n, m)
    step : ndarray of shape (n, m)
        By which the residual is probed.
    weight : ndarray of shape (n, m)
        Square root of twice the energy of a unit of it.
    put : callable
        Gives it to the session, to be reached after a time.
    """

    value: FloatArray
    step: FloatArray
    weight: FloatArray
    put: Callable[[FloatArray, float], None]


def _strains_of(session: Session, part: RodPart) -> list[_Strains]:
    """Curvature, twist and stretch."""
    world, index = session.world, part.index
    stencils, edges = part.voronoi, part.lengths

    def at_nodes(value: FloatArray) -> FloatArray:
        """Return nodal values of edges: the mean of both at a node."""
        return 0.5 * (value + np.roll(value, -1, axis=0))[: len(stencils)]

    ours = part.parameters
    weights = (
        at_nodes(ours.bend_stiffness) * stencils[:, None],
        at_nodes(ours.twist_stiffness[:, None]) * stencils[:, None],
        (ours.stretch_stiffness * edges)[:, None],
    )
    values = (part.natural_curvature, part.natural_twist[:, None], np.ones((len(edges), 1)))
    lengths = (stencils[:, None], stencils[:, None], np.ones((len(edges), 1)))
    setters = (world.set_natural_curvature, world.set_natural_twist, world.set_natural_stretch)
    return [
        _Strains(value, np.broadcast_to(_PROBE / length, value.shape), np.sqrt(weight), partial(setter, index))
        for value, length, weight, setter in zip(values, lengths, weights, setters, strict=True)
    ]


def _columns(session: Session, strains: list[_Strains]) -> FloatArray:
    """Derivatives of the residual by each strain, scaled so that one unit stores a unit of energy; one per column."""
    start, columns = np.array(session.world.equilibrium_residual()), []
    for kind in strains:
        for i in np.ndindex(*kind.value.shape):
            value = kind.value.copy()
            value[i] += kind.step[i]
            kind.put(value, 0.0)
            columns.append((np.array(session.world.equilibrium_residual()) - start) / (kind.step[i] * kind.weight[i]))
        kind.put(kind.value, 0.0)
    return np.column_stack(columns)


def _put_in_balance(session: Session, strains: list[_Strains]) -> None:
    """Find the natural strains, and set them in the session.

    At a given configuration the forces are r + A y, nearly linear in the natural strains y, which are scaled so that
    y^2 / 2 is elastic energy. The solution leaves every node in its place, u = K^-1 (r + A y) = 0, with the least
    energy: y = -B^T m, B B^T m = K^-1 r, B = K^-1 A. Beside clamps the solution is one of least squares, with u of
    second order in the length of an edge, because there the natural strain of the next stencil bends the clamp.
    """
    from scipy.linalg import cho_factor, cho_solve

    world, columns, least = session.world, _columns(session, strains), np.inf
    ends = np.cumsum([kind.value.size for kind in strains])
    for _ in range(_MOST_ITERATIONS):
        residuals = np.column_stack([world.equilibrium_residual(), columns])
        moved = -np.array(world.equilibrium_responses(residuals, np.zeros_like(residuals)))
        off = float(np.abs(moved[:, 0]).max())
        if off >= 0.5 * least:
            return
        least = off
        by_strains = moved[:, 1:]
        normal = by_strains @ by_strains.T
        normal[np.diag_indices_from(normal)] += _RIDGE * np.trace(normal)
        changes = -by_strains.T @ cho_solve(cho_factor(normal), moved[:, 0])
        for i, (kind, change) in enumerate(zip(strains, np.split(changes, ends[:-1]), strict=True)):
            value = kind.value + change.reshape(kind.value.shape) / kind.weight
            strains[i] = replace(kind, value=value)
            kind.put(value, 0.0)


def find_balance(directory: Directory, gravity: FloatArray, options: BuildOptions) -> list[tuple[int, FloatArray]]:
    """Set natural shapes in `directory` for rods that are to be in balance as drawn.

    Return the index of each such rod, and its ratios of natural to drawn lengths, of shape (edges, 1) [-].

    Raises
    ------
    ValueError
        No natural shape holds a rod as drawn, or none can be found: for rods that touch, and with custom forces.
    """
    parts = [part for part in directory.all(RodPart) if part.in_balance]
    if not parts:
        return []
    plane = Session.begin(directory.copy(), gravity, options).world.plane_normal
    session = Session.begin(directory.copy(), gravity, replace(options, integrator="static", planar=False))
    strains = [kind for part in parts for kind in _strains_of(session, part)]
    try:
        _put_in_balance(session, strains)
    except ValueError as error:
        names = ", ".join(repr(part.name) for part in parts)
        raise ValueError(f"natural='in_balance' finds no shape that holds {names} as drawn: {error}") from None
    found = []
    for k, part in enumerate(parts):
        curvature, twist, stretch = (kind.value for kind in strains[3 * k : 3 * k + 3])
        if plane is not None:
            twist, across = np.zeros_like(twist), np.cross(plane, part.tangents)
            towards = [(across * d).sum(axis=1) for d in (part.directors, np.cross(part.tangents, part.directors))]
            along = np.column_stack(towards)[: len(curvature)]
            curvature = (curvature * along).sum(axis=1)[:, None] * along
        directory.parts[part.name] = replace(part, natural_curvature=curvature, natural_twist=twist[:, 0])
        found.append((part.index, stretch))
    return found
