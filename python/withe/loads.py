"""What pulls, pushes and slows the rods of a scene: the half of `Scene` that loads them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import cast

import numpy as np
import numpy.typing as npt

from withe import validation
from withe.applied_loads import AppliedLoads
from withe.handles import CustomForce, Drag, Mass, NodeHandle, Rod
from withe.parts import CustomForcePart, DragPart, MassPart

__all__ = ["Loads"]

FloatArray = npt.NDArray[np.float64]


class Loads(AppliedLoads):
    """Forces, moments, masses and drag of a scene."""

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
