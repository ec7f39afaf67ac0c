"""Forces, moments, loads along rods and pressure, on a scene or on a simulation that runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.directory import Directory
from withe.parts.handles import Body, Load, NodeHandle, Rod
from withe.parts.kinds import LoadKind, LoadPart, Pass, RodPart

__all__ = ["AppliedLoads", "Bearer", "load_values"]

FloatArray = npt.NDArray[np.float64]
Value = npt.ArrayLike | Callable[[float], npt.ArrayLike]


class Bearer(Protocol):
    """Bearer of loads: a scene, or a running simulation."""

    @property
    def directory(self) -> Directory:
        """Its parts."""

    @property
    def time(self) -> float:
        """When a load begins to act [s]."""

    def take(self, part: LoadPart) -> Load:
        """Let a load act from now on."""


@keyword_hints
class AppliedLoads(ABC):
    """Methods of `Scene` and of `Simulation` that put loads on what `_bearer` is."""

    @property
    @abstractmethod
    def _bearer(self) -> Bearer:
        """Return the bearer of loads."""

    def add_force(
        self,
        node: NodeHandle | Body | str,
        force: Value,
        *,
        at: npt.ArrayLike | None = None,
        follower: bool = False,
        name: str | None = None,
    ) -> Load:
        """Add a force at a node, or at a point of a rigid body.

        Parameters
        ----------
        node : NodeHandle, Body or str
            Node or body on which the force acts.
        force : array_like of shape (3,) [N], or a function of time [s] that returns it
            Force in world axes, as drawn.
        at : array_like of shape (3,) [m]
            Point of a body at which the force acts, as drawn. By default its centre of mass.
        follower : bool
            True if the force turns with the rod, half of it with each edge at the node.
        name : str
            Name of the load. By default "force 1", ...

        Returns
        -------
        Load

        Raises
        ------
        ValueError
            Not a node of this scene, a wrong shape, or a value that is not finite.

        See Also
        --------
        Simulation.set : Change the force during a simulation.
        add_load : Add a distributed force.
        """
        return _put_at_node(self._bearer, "force", node, force, follower, name, at)

    def add_moment(
        self,
        node: NodeHandle | Body | str,
        moment: Value,
        *,
        follower: bool = False,
        name: str | None = None,
    ) -> Load:
        """Add a moment at a node, or on a rigid body.

        Parameters
        ----------
        node : NodeHandle, Body or str
            Node or body on which the moment acts.
        moment : array_like of shape (3,) [N m], or a function of time [s] that returns it
            Moment in world axes, as drawn. The function is called once before every step; if it is added to a
            simulation, it may read the state of the simulation for an explicit feedback torque.
        follower : bool
            True if the moment turns with the joint or clamp at the node, or else half of it with each edge there.
        name : str
            Name of the load. By default "moment 1", ...

        Returns
        -------
        Load

        Raises
        ------
        ValueError
            Not a node of this scene, a wrong shape, or a value that is not finite.

        See Also
        --------
        Simulation.set : Change the moment during a simulation.
        add_force : Add a force.
        """
        return _put_at_node(self._bearer, "moment", node, moment, follower, name)

    def add_load(self, rod: Rod | str, load: Value, *, follower: bool = False, name: str | None = None) -> Load:
        """Add a distributed force along a rod, constant or per edge.

        Parameters
        ----------
        rod : Rod or str
            Rod on which the load acts.
        load : array_like of shape (3,) or (edges, 3) [N/m], or a function of time [s] that returns it
            Force per length of the drawn rod, in world axes: one for all edges, or one per edge.
        follower : bool
            True if the load turns with the edges.
        name : str
            Name of the load. By default "load 1", ...

        Returns
        -------
        Load

        Raises
        ------
        ValueError
            Not a rod of this scene, a wrong shape, or a value that is not finite.

        See Also
        --------
        add_force : Add a force at a node.
        add_pressure : Add a pressure.
        """
        part = self._bearer.directory.rod(rod, "rod of the load")
        follows = validation.truth(follower, "follower")
        return _put(self._bearer, "load", (part.index, 0), load, follows, name, edges=len(part.lengths))

    def add_pressure(
        self,
        rod: Rod | str,
        pressure: npt.ArrayLike | Callable[[float], npt.ArrayLike],
        *,
        normal: npt.ArrayLike | None = None,
        name: str | None = None,
    ) -> Load:
        """Add a pressure on the side of a rod.

        The force per present length is the pressure times normal x tangent, and follows the rod, as fluid pressure on a
        ring does, which buckles at 3 EI / R^3 [Levy 1884]. For a closed rod, the work is the pressure times the
        decrease of the area, seen along the normal.

        Parameters
        ----------
        rod : Rod or str
            Rod on which the pressure acts.
        pressure : float or array_like of shape (edges,) [N/m], or a function of time [s] that returns it
            Force per length on all edges, or on each edge. Positive values push into a closed rod.
        normal : array_like of shape (3,)
            Fixed normal of the plane in which the pressure acts; seen from its tip, the force is to the left along the
            rod. By default the normal about which a closed rod runs counter-clockwise, as drawn.
        name : str
            Name of the load. By default "pressure 1", ...

        Returns
        -------
        Load

        Raises
        ------
        ValueError
            No normal is given for an open rod, or for a closed rod that encloses no area.

        See Also
        --------
        add_load : Add a distributed force in any direction.
        """
        part = self._bearer.directory.rod(rod, "rod of the pressure")
        if normal is None:
            axis = _area_normal(part)
        else:
            axis = validation.unit_vector(normal, f"normal of the pressure on {part.owner}")
        return _put(self._bearer, "pressure", (part.index, 0), pressure, False, name, axis, len(part.lengths))


def _put_at_node(
    bearer: Bearer,
    kind: LoadKind,
    node: NodeHandle | Body | str,
    value: Value,
    follower: bool,
    name: str | None,
    at: npt.ArrayLike | None = None,
) -> Load:
    place, owner = bearer.directory.place(node, at, f"node of the {kind}")
    follows = validation.truth(follower, "follower")
    if follows and place[0] < 0:
        raise ValueError(f"follower=True is for loads on rods, got body {owner!r}: give a function of time instead")
    return _put(bearer, kind, place, value, follows, name)


def _put(
    bearer: Bearer,
    kind: LoadKind,
    node: Pass,
    value: Value,
    follower: bool,
    name: str | None,
    axis: FloatArray | None = None,
    edges: int | None = None,
) -> Load:
    name = bearer.directory.new_name(name, kind)
    function = value if callable(value) else None
    now = bearer.time
    what = f"{kind} {name!r}" + (f" at t = {now:g}" if function else "")
    first = load_values(value(now) if callable(value) else value, axis, edges, what)
    return bearer.take(LoadPart(name, kind, node, first, function, follower, axis))


def load_values(value: npt.ArrayLike, axis: FloatArray | None, edges: int | None, what: str) -> FloatArray:
    """A load as three numbers, or, along a rod of so many edges, three an edge; a pressure is along its normal."""
    if axis is None:
        return validation.number_array(value, what, *([(3,)] if edges is None else [(3,), (edges, 3)]))
    if edges is None or validation.is_scalar(value):
        return validation.number(value, what) * axis
    return validation.number_array(value, what, (edges,))[:, None] * axis


def _area_normal(part: RodPart) -> FloatArray:
    if not part.closed:
        raise ValueError(f"normal of the pressure on {part.owner} must be given, because the rod is open")
    points = part.points - part.points.mean(axis=0)
    area = 0.5 * np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    size = float(np.linalg.norm(area))
    if size < 1e-9 * float(part.lengths.sum()) ** 2:
        raise ValueError(
            f"normal of the pressure on {part.owner} must be given, because the closed rod encloses no area"
        )
    return np.asarray(area / size)
