"""Equilibria for given unknowns, their residuals, and the derivatives of the residuals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from withe.errors import ConvergenceError
from withe.real2sim.targets import Residual
from withe.real2sim.unknowns import Coordinates, Unknown
from withe.simulation.gradients import equilibrium_gradients
from withe.simulation.simulation import Simulation

__all__ = ["Conditions", "Equilibria", "Stills"]

FloatArray = npt.NDArray[np.float64]
Conditions = Callable[[Simulation, int], object]

_DIFFERENCE = 1e-4  # step relative to the scale of an unknown; truncation and rounding errors are about 1e-8


class Equilibria(Coordinates):
    """The equilibrium of every frame.

    Parameters
    ----------
    simulation : Simulation
        It is changed.
    unknowns : list of Unknown
    conditions : callable, optional
        Function of the simulation and the frame that is called before each equilibrium.

    Attributes
    ----------
    solves : int
        Number of equilibria so far.
    """

    def __init__(
        self,
        simulation: Simulation,
        unknowns: Sequence[Unknown],
        conditions: Conditions | None = None,
    ) -> None:
        super().__init__(simulation, unknowns)
        self.conditions = conditions
        self.solves: int = 0

    def positions(self, coordinates: FloatArray, frame: int) -> FloatArray:
        """Return the positions of the nodes at rest, shape (nodes, 3) [m].

        Raises
        ------
        ConvergenceError
            No equilibrium was found. The simulation keeps its previous state, with other parameters.
        ValueError
            The unknowns are out of range.
        """
        try:
            return self._go(coordinates, frame)
        except (ConvergenceError, ValueError):
            self.forget()
            raise

    def _go(self, coordinates: FloatArray, frame: int) -> FloatArray:
        if self.conditions is None and (coordinates == self._written).all():
            return self.simulation.positions()
        self.write(coordinates)
        if self.conditions is not None:
            self.conditions(self.simulation, frame)
        self.solves += 1
        self.simulation.equilibrium()
        return self.simulation.positions()

    def derivatives(self, by_positions: FloatArray, coordinates: FloatArray, frame: int) -> FloatArray:
        """Derivatives of m scalars of the present equilibrium by the coordinates, shape (m, n).

        The adjoint method computes them, or central differences of equilibria if the engine has no gradient.

        Parameters
        ----------
        by_positions : ndarray of shape (m, nodes, 3)
            Derivatives of the scalars by positions.
        coordinates : ndarray of shape (n,)
            Coordinates of that equilibrium.
        frame : int

        Raises
        ------
        ConvergenceError
            The branch of equilibria ends here.
        """
        try:
            found = equilibrium_gradients(self.simulation._session, self.in_plane(by_positions), self.words)
        except ValueError:
            changes = self._differences(coordinates, frame)
            return np.asarray(np.tensordot(by_positions, changes, axes=2))
        columns, first = [], 0
        for unknown, place in zip(self.unknowns, self.slices, strict=True):
            columns.append(unknown.chain(coordinates[place], found[first : first + len(unknown.words)]))
            first += len(unknown.words)
        return np.concatenate(columns, axis=1)

    def _differences(self, coordinates: FloatArray, frame: int) -> FloatArray:
        """Derivatives of positions by coordinates, shape (nodes, 3, n), by central differences."""
        columns = []
        for i, scale in enumerate(self.scales):
            step = np.zeros_like(coordinates)
            step[i] = _DIFFERENCE * scale
            ahead = self.positions(coordinates + step, frame)
            behind = self.positions(coordinates - step, frame)
            columns.append((ahead - behind) / (2.0 * step[i]))
        return np.stack(columns, axis=2)


class Stills(Equilibria):
    """The equilibrium of every frame, and its residual."""

    def __init__(
        self,
        simulation: Simulation,
        unknowns: Sequence[Unknown],
        residual: Residual,
        conditions: Conditions | None = None,
    ) -> None:
        super().__init__(simulation, unknowns, conditions)
        self._residual = residual

    def residual(self, coordinates: FloatArray, frame: int) -> tuple[FloatArray, FloatArray] | None:
        """Residual of a frame, and positions; None if there is no equilibrium or the unknowns are out of range."""
        try:
            positions = self.positions(coordinates, frame)
        except (ConvergenceError, ValueError):
            return None
        return self._residual.value(positions, frame), positions

    def jacobian(self, coordinates: FloatArray, positions: FloatArray, frame: int) -> FloatArray:
        """Derivatives of the residual by the coordinates, shape (residuals, n), at the present equilibrium."""
        return self.derivatives(self._residual.derivative(positions, frame), coordinates, frame)
