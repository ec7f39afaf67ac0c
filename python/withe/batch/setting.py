"""Actuation and parameters of a batch: the methods of `Simulation` that set, with a row for each simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.batch.lanes import IntArray, Lanes, row
from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.handles import NodeHandle, Obstacle, Rod, Support

__all__ = ["Setting"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
class Setting:
    """Methods of `Batch` that actuate and set. `lanes` says which simulations: a mask of all, or numbers."""

    _lanes: Lanes

    def set_natural_curvature(
        self,
        rod: Rod | str,
        curvature: npt.ArrayLike,
        over: float = 0.0,
        *,
        discrete: bool = False,
        lanes: npt.ArrayLike | None = None,
    ) -> None:
        """Actuate a rod of every simulation by the curvature at which it is free of stress.

        Parameters
        ----------
        rod : Rod or str
        curvature : array_like of shape (n, 2) or (n, stencils, 2) [1/m]
            A row for each simulation, or for each of `lanes`: see `Simulation.set_natural_curvature`.
        over : float [s]
            Reached after so long, evenly; at once by default.
        discrete : bool
            Whether the curvature is 2 tan(phi / 2) [-], phi the angle between two edges.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Which simulations; all by default.

        Raises
        ------
        ValueError
            Wrong shape, not finite, a turn of pi or more at a node (then nothing is changed), or out of the plane of a
            simulation that was built with planar=True.

        Examples
        --------
        >>> batch = scene.build_batch(3)
        >>> batch.set_natural_curvature(arm, [(0, 2.0), (0, 4.0), (0, 6.0)], over=0.2)
        """
        part = self._lanes.rod(rod)
        numbers, stencils = self._lanes.chosen(lanes), len(part.voronoi)
        what = f"natural_curvature of {part.owner}"
        values = validation.number_array(curvature, what, (len(numbers), 2), (len(numbers), stencils, 2))
        if values.ndim == 2:
            values = np.repeat(values[:, None], stencils, axis=1)
        self._lanes.engine.set_natural_curvature(
            numbers,
            part.index,
            values,
            validation.non_negative(over, "over"),
            self._lanes.voronoi(part),
            validation.truth(discrete, "discrete"),
            what,
        )

    def set_natural_twist(
        self, rod: Rod | str, twist: npt.ArrayLike, over: float = 0.0, *, lanes: npt.ArrayLike | None = None
    ) -> None:
        """Actuate a rod of every simulation by the twist at which it is free of stress.

        Parameters
        ----------
        rod : Rod or str
        twist : array_like of shape (n,) or (n, stencils) [rad/m]
        over : float [s]
        lanes : array_like, optional
            Which simulations; all by default.

        Raises
        ------
        ValueError
            Wrong shape, not finite, or not zero in a simulation that was built with planar=True.
        """
        part = self._lanes.rod(rod)
        numbers = self._lanes.chosen(lanes)
        values = _spread(twist, f"natural_twist of {part.owner}", len(numbers), len(part.voronoi))
        _lead(self._lanes.engine.set_natural_twist, part.index, values, over, numbers)

    def set_natural_stretch(
        self, rod: Rod | str, stretch: npt.ArrayLike, over: float = 0.0, *, lanes: npt.ArrayLike | None = None
    ) -> None:
        """Actuate a rod of every simulation by the length at which it is free of stress.

        Parameters
        ----------
        rod : Rod or str
        stretch : array_like of shape (n,) or (n, edges) [-]
            Natural over drawn length.
        over : float [s]
        lanes : array_like, optional
            Which simulations; all by default.

        Raises
        ------
        ValueError
            Wrong shape, not finite, or not positive.
        """
        part = self._lanes.rod(rod)
        numbers, what = self._lanes.chosen(lanes), f"natural_stretch of {part.owner}"
        values = _spread(stretch, what, len(numbers), len(part.lengths))
        if np.any(values <= 0.0):
            raise ValueError(f"{what} must be positive, got {values.min():g}")
        _lead(self._lanes.engine.set_natural_stretch, part.index, values, over, numbers)

    def set(self, target: Any = None, /, *, lanes: npt.ArrayLike | None = None, **values: Any) -> None:
        """Change parameters of every simulation, such as a modulus for each (domain randomisation).

        Parameters
        ----------
        target : handle or str
            As `Simulation.set` takes it.
        lanes : array_like, optional
            Which simulations; all by default.
        **values
            Words of `Simulation.set`. An array has a row for each simulation; a number, a function or None is for all.

        Raises
        ------
        ValueError
            A word that the target does not have, a value out of range, or an array without a row for each simulation.
            Simulations before the one that refuses keep what was set.

        Examples
        --------
        >>> batch = scene.build_batch(3)
        >>> batch.set(arm, youngs_modulus=[0.8e6, 1.0e6, 1.2e6])
        """
        numbers = self._lanes.chosen(lanes)
        rows = [
            {word: row(value, place, len(numbers), word) for word, value in values.items()}
            for place in range(len(numbers))
        ]
        for place, simulation in self._lanes.each(numbers):
            simulation.set(target, **rows[place])

    def move(
        self,
        support: Support | NodeHandle | Obstacle | str,
        position: npt.ArrayLike | None = None,
        rotation: npt.ArrayLike | None = None,
        *,
        tangent: npt.ArrayLike | None = None,
        roll: npt.ArrayLike | None = None,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
    ) -> None:
        """Move a support or an obstacle of every simulation.

        Parameters
        ----------
        support : Support, NodeHandle, Obstacle or str
        position : array_like of shape (n, 3) [m]
        rotation : array_like of shape (n, 3, 3)
            Relative to the orientation as drawn.
        tangent : array_like of shape (n, 3)
            Where the rod is to point, instead; of a sphere, the axis about which it rolls.
        roll : float or array_like of shape (n,) [rad]
            A turn about the tangent, or of an obstacle about its axis; one number is for all simulations.
        over : float [s]
            Reached after so long, evenly; within the next step by default.
        lanes : array_like, optional
            Which simulations; all by default. For paths move one: ``batch[i].move(..., path=path)``.

        Raises
        ------
        ValueError
            See `Simulation.move`; or not a row for each simulation. Simulations before the one that refuses move.

        Examples
        --------
        >>> batch = scene.build_batch(2)
        >>> batch.move(arm.start, [(0, 0, 0.01), (0, 0, 0.02)], roll=[0.5, -0.5], over=0.1)
        """
        numbers = self._lanes.chosen(lanes)
        count = len(numbers)
        places = None if position is None else validation.number_array(position, "position", (count, 3))
        turns = None if rotation is None else validation.number_array(rotation, "rotation", (count, 3, 3))
        tangents = None if tangent is None else validation.number_array(tangent, "tangent", (count, 3))
        rolls = None if roll is None else validation.per_item(roll, "roll", count, "lanes", sign=True)
        for place, simulation in self._lanes.each(numbers):
            simulation.move(
                support,
                None if places is None else places[place],
                None if turns is None else turns[place],
                tangent=None if tangents is None else tangents[place],
                roll=None if rolls is None else float(rolls[place]),
                over=over,
            )


def _lead(put: Callable[..., None], rod: int, values: FloatArray, over: float, numbers: IntArray) -> None:
    put(numbers, rod, values, validation.non_negative(over, "over"))


def _spread(value: npt.ArrayLike, what: str, count: int, size: int) -> FloatArray:
    """A row for each simulation: one number each, or one for every part of a rod."""
    values = validation.number_array(value, what, (count,), (count, size))
    return np.repeat(values[:, None], size, axis=1) if values.ndim == 1 else values
