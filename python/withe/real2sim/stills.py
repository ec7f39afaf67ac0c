"""Equilibria for unknown numbers, how far they are from what was seen, and how that changes with the numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from withe.errors import ConvergenceError
from withe.real2sim.targets import Residual
from withe.real2sim.unknowns import Unknown
from withe.simulation.simulation import Simulation

__all__ = ["Conditions", "Equilibria", "Stills"]

FloatArray = npt.NDArray[np.float64]
Conditions = Callable[[Simulation, int], object]

_DIFFERENCE = 1e-4  # of the scale of an unknown: truncation 1e-8 of it squared, rounding about as much


class Equilibria:
    """The equilibrium of every frame.

    Parameters
    ----------
    simulation : Simulation
        It is changed.
    unknowns : list of Unknown
    conditions : callable, optional
        Called with the simulation and the frame before an equilibrium is looked for.

    Attributes
    ----------
    names, scales
        Of all coordinates, in the order of the unknowns.
    per_frame : ndarray of bool
        Which of them every frame has of its own.
    solves : int
        Equilibria so far.
    """

    def __init__(
        self,
        simulation: Simulation,
        unknowns: Sequence[Unknown],
        conditions: Conditions | None = None,
    ) -> None:
        self.simulation, self.unknowns = simulation, list(unknowns)
        self._conditions = conditions
        self.names = tuple(name for unknown in self.unknowns for name in unknown.names)
        self.scales = np.concatenate([unknown.scales for unknown in self.unknowns])
        self.per_frame = np.repeat([unknown.per_frame for unknown in self.unknowns], [len(u) for u in self.unknowns])
        ends = np.cumsum([0, *(len(unknown) for unknown in self.unknowns)])
        self.slices = [slice(a, b) for a, b in pairwise(ends)]
        self.solves = 0
        self._written = np.full(len(self.names), np.nan)

    def begin(self) -> FloatArray:
        """Coordinates of what the simulation has now."""
        return np.concatenate([unknown.read(self.simulation) for unknown in self.unknowns])

    def positions(self, coordinates: FloatArray, frame: int) -> FloatArray:
        """Where the nodes come to rest, shape (nodes, 3) [m].

        Raises
        ------
        ConvergenceError
            Nowhere; the simulation is then where it was before, with other numbers.
        ValueError
            There are no such numbers.
        """
        try:
            return self._go(coordinates, frame)
        except (ConvergenceError, ValueError):
            self._written[:] = np.nan
            raise

    def _go(self, coordinates: FloatArray, frame: int) -> FloatArray:
        for unknown, place in zip(self.unknowns, self.slices, strict=True):
            if not np.array_equal(coordinates[place], self._written[place]):
                unknown.write(self.simulation, coordinates[place])
                self._written[place] = coordinates[place]
        if self._conditions is not None:
            self._conditions(self.simulation, frame)
        self.solves += 1
        self.simulation.equilibrium()
        return self.simulation.positions()

    def changes(self, coordinates: FloatArray, frame: int) -> FloatArray:
        """Derivatives of positions by coordinates, shape (nodes, 3, n), by central differences of equilibria."""
        columns = []
        for i, scale in enumerate(self.scales):
            step = np.zeros_like(coordinates)
            step[i] = _DIFFERENCE * scale
            ahead = self.positions(coordinates + step, frame)
            behind = self.positions(coordinates - step, frame)
            columns.append((ahead - behind) / (2.0 * step[i]))
        return np.stack(columns, axis=2)


class Stills(Equilibria):
    """The equilibrium of every frame, and how far it is from a target."""

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
        """Residual of a frame and positions; None where there is no equilibrium, or none of such numbers."""
        try:
            positions = self.positions(coordinates, frame)
        except (ConvergenceError, ValueError):
            return None
        return self._residual.value(positions, frame), positions

    def jacobian(self, coordinates: FloatArray, positions: FloatArray, frame: int) -> FloatArray:
        """Derivatives of the residual by the coordinates, shape (residuals, n), at the present equilibrium."""
        return self._residual.derivative(positions, self.changes(coordinates, frame), frame)
