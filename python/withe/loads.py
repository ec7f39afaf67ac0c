"""What pulls, pushes and slows the rods of a scene: the half of `Scene` that loads them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import cast

import numpy as np
import numpy.typing as npt

from withe import validation
from withe.directory import Directory
from withe.handles import CustomForce, Drag, Load, Mass, NodeHandle, Rod
from withe.parts import CustomForcePart, DragPart, LoadKind, LoadPart, MassPart, Pass

__all__ = ["Loads"]

FloatArray = npt.NDArray[np.float64]
Value = npt.ArrayLike | Callable[[float], npt.ArrayLike]


class Loads:
    """Forces, moments, masses and drag of a scene."""

    _directory: Directory

    def add_force(
        self, node: NodeHandle | str, force: Value, *, follower: bool = False, name: str | None = None
    ) -> Load:
        """Add a force at a node.

        Parameters
        ----------
        node : NodeHandle or str
        force : array_like of shape (3,) [N], or a function of time [s] that returns it
        follower : bool
            Whether it turns with the edge that ends at the node (or starts there, at the first node).
        name : str

        Returns
        -------
        Load
        """
        place, _ = self._directory.node(node, "node of the force")
        return self._load("force", place, force, validation.truth(follower, "follower"), name)

    def add_moment(self, node: NodeHandle | str, moment: Value, *, name: str | None = None) -> Load:
        """Add a moment at a node, in world axes.

        Parameters
        ----------
        node : NodeHandle or str
        moment : array_like of shape (3,) [N m], or a function of time [s] that returns it
        name : str

        Returns
        -------
        Load
        """
        place, _ = self._directory.node(node, "node of the moment")
        return self._load("moment", place, moment, False, name)

    def add_load(self, rod: Rod | str, load: Value, *, follower: bool = False, name: str | None = None) -> Load:
        """Add a force spread evenly along a rod.

        Parameters
        ----------
        rod : Rod or str
        load : array_like of shape (3,) [N/m], or a function of time [s] that returns it
        follower : bool
            Whether it turns with the edges.
        name : str

        Returns
        -------
        Load
        """
        part = self._directory.rod(rod, "rod of the load")
        return self._load("load", (part.index, 0), load, validation.truth(follower, "follower"), name)

    def _load(self, kind: LoadKind, node: Pass, value: Value, follower: bool, name: str | None) -> Load:
        name = self._directory.new_name(name, kind)
        what = f"{kind} {name!r}"
        function = value if callable(value) else None
        first = validation.vector(value(0.0) if callable(value) else value, what + (" at t = 0" if function else ""))
        return cast(Load, self._directory.add(LoadPart(name, kind, node, first, function, follower)))

    def add_mass(self, node: NodeHandle | str, mass: float, *, name: str | None = None) -> Mass:
        """Add a point mass [kg] to a node."""
        name = self._directory.new_name(name, "mass")
        place, node_name = self._directory.node(node, "node of the mass")
        part = MassPart(name, place, validation.non_negative(mass, f"mass at {node_name!r}"))
        return cast(Mass, self._directory.add(part))

    def add_drag(self, coefficient: float, *, rods: Iterable[Rod | str] | None = None, name: str | None = None) -> Drag:
        """Add viscous drag: a force per length against the velocity. Drags on one rod add up.

        Parameters
        ----------
        coefficient : float [Pa s]
        rods : iterable of Rod or str
            By default every rod, those added later included.
        name : str

        Returns
        -------
        Drag
        """
        name = self._directory.new_name(name, "drag")
        coefficient = validation.non_negative(coefficient, "drag coefficient")
        indices = None
        if rods is not None:
            if isinstance(rods, str) or not isinstance(rods, Iterable):
                raise ValueError(f"rods of the drag must be a list of rods, got {rods!r:.80}")
            indices = tuple(dict.fromkeys(self._directory.rod(rod, "rod of the drag").index for rod in rods))
        return cast(Drag, self._directory.add(DragPart(name, coefficient, indices)))

    def add_custom_force(
        self, function: Callable[[float, FloatArray, FloatArray], npt.ArrayLike], *, name: str | None = None
    ) -> CustomForce:
        """Add forces that a function computes: springs, magnets, buoyancy.

        They are found once a step, where the scheme's own forces act, for positions and velocities
        extrapolated to then: to the middle of an implicit midpoint or energy-momentum step (second order;
        an oscillation of angular frequency w, in radians a second, keeps its amplitude for w time_step < 2;
        where neighbours go to and fro, edges carry a third of their mass, and w^2 is up to three times the
        spring constant over the mass at a node), to the end of a backward Euler step, and at the end that
        a Verlet step reaches. In an equilibrium they are those at the present state.

        Parameters
        ----------
        function : callable
            ``function(time, positions, velocities)`` returns the force on every node of the scene,
            shape (nodes, 3) [N]; time [s], positions [m] and velocities [m/s] are those at which the force
            shall act.
        name : str

        Returns
        -------
        CustomForce
        """
        name = self._directory.new_name(name, "custom force")
        part = CustomForcePart(name, validation.function(function, "custom force"))
        return cast(CustomForce, self._directory.add(part))
