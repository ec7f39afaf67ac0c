"""Actuation and parameters of a batch: the methods of `Simulation` that set values, with a row for each simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Unpack, overload

import numpy as np
import numpy.typing as npt

from withe.batch.lanes import IntArray, Lanes, row
from withe.common import validation
from withe.common.deprecation import old_word
from withe.common.keywords import keyword_hints
from withe.parts.handles import Body, Drag, Fluid, Joint, Load, Mass, NodeHandle, Obstacle, Rod, Spring, Support, Tendon
from withe.parts.parameters import NATURAL_WORDS
from withe.parts.torsion_springs import TorsionSpring
from withe.simulation.typed_words import (
    DragWords,
    FluidWords,
    Frictions,
    JointWords,
    LoadWords,
    MassWords,
    ObstacleWords,
    PairWords,
    RodWords,
    Rotations,
    SceneWords,
    SpringWords,
    SupportWords,
    TendonWords,
    TorsionWords,
    Toucher,
    Values,
)

__all__ = ["Setting"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
class Setting:
    """Methods of `Batch` that actuate and set. `lanes` selects simulations: a mask of all, or numbers."""

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
        """Deprecated: use ``set(rod, natural_curvature=..., over=...)``, or discrete_curvature.

        Parameters
        ----------
        rod : Rod or str
            Rod to actuate.
        curvature : array_like of shape (n, 2) or (n, stencils, 2) [1/m]
            Natural curvature towards d1 and d2, one row per simulation.
        over : float [s]
            Duration of a linear ramp to the value. By default the change is immediate.
        discrete : bool
            True if the curvature is given as 2 tan(phi / 2) [-], with phi the angle between two edges.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to change. By default all.

        Raises
        ------
        ValueError
            See `set`.

        See Also
        --------
        set : The method to use instead.
        """
        old_word("set_natural_curvature", "set(rod, natural_curvature=..., over=...)")
        _curve(self._lanes, rod, curvature, over, lanes, discrete=validation.truth(discrete, "discrete"))

    def set_natural_twist(
        self, rod: Rod | str, twist: npt.ArrayLike, over: float = 0.0, *, lanes: npt.ArrayLike | None = None
    ) -> None:
        """Deprecated: use ``set(rod, natural_twist=..., over=...)``.

        Parameters
        ----------
        rod : Rod or str
            Rod to actuate.
        twist : array_like of shape (n,) or (n, stencils) [rad/m]
            Natural twist, one row per simulation.
        over : float [s]
            Duration of a linear ramp to the value. By default the change is immediate.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to change. By default all.

        Raises
        ------
        ValueError
            See `set`.

        See Also
        --------
        set : The method to use instead.
        """
        old_word("set_natural_twist", "set(rod, natural_twist=..., over=...)")
        _twist(self._lanes, rod, twist, over, lanes)

    def set_natural_stretch(
        self, rod: Rod | str, stretch: npt.ArrayLike, over: float = 0.0, *, lanes: npt.ArrayLike | None = None
    ) -> None:
        """Deprecated: use ``set(rod, natural_stretch=..., over=...)``.

        Parameters
        ----------
        rod : Rod or str
            Rod to actuate.
        stretch : array_like of shape (n,) or (n, edges) [-]
            Natural length over drawn length, one row per simulation.
        over : float [s]
            Duration of a linear ramp to the value. By default the change is immediate.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to change. By default all.

        Raises
        ------
        ValueError
            See `set`.

        See Also
        --------
        set : The method to use instead.
        """
        old_word("set_natural_stretch", "set(rod, natural_stretch=..., over=...)")
        _stretch(self._lanes, rod, stretch, over, lanes)

    @overload
    def set(
        self, target: Rod, /, *, over: float = 0.0, lanes: npt.ArrayLike | None = None, **values: Unpack[RodWords]
    ) -> None: ...

    @overload
    def set(
        self,
        target: Load,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[LoadWords[Values]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Mass,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[MassWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Spring,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[SpringWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Tendon,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[TendonWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Joint,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[JointWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: TorsionSpring,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[TorsionWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Drag,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[DragWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Fluid,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[FluidWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Obstacle,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[ObstacleWords[npt.ArrayLike, Frictions]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: Support,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[SupportWords[npt.ArrayLike, Rotations]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: tuple[Toucher, Toucher],
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[PairWords[npt.ArrayLike, Frictions]],
    ) -> None: ...

    @overload
    def set(
        self,
        target: None = None,
        /,
        *,
        over: float = 0.0,
        lanes: npt.ArrayLike | None = None,
        **values: Unpack[SceneWords[npt.ArrayLike]],
    ) -> None: ...

    @overload
    def set(self, target: str, /, *, over: float = 0.0, lanes: npt.ArrayLike | None = None, **values: Any) -> None: ...

    def set(
        self, target: Any = None, /, *, over: float = 0.0, lanes: npt.ArrayLike | None = None, **values: Any
    ) -> None:
        """Set parameters of every simulation, such as a modulus for each (domain randomisation).

        Parameters
        ----------
        target : handle or str
            Target, as in `Simulation.set`.
        over : float [s]
            Duration of a linear ramp to the values that `Simulation.set` can ramp. By default the change is immediate.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Mask or numbers of the simulations. By default all.
        **values
            Words of `Simulation.set`. An array has one row per simulation; a number, a function or None is for all.
            Natural shapes of a rod are arrays with one row per simulation: natural_curvature of shape (n, 2) or
            (n, stencils, 2) [1/m], natural_twist (n,) or (n, stencils) [rad/m], natural_stretch (n,) or (n, edges) [-].

        Raises
        ------
        ValueError
            A word that the target does not have, a value out of range, or an array without a row for each simulation.
            Simulations before the one that refuses its value keep their new values.

        See Also
        --------
        get : Return the present values.
        move : Move a support or an obstacle.
        Simulation.set : The parameters of each kind of part.

        Examples
        --------
        >>> batch = scene.build_batch(3)
        >>> batch.set(arm, youngs_modulus=[0.8e6, 1.0e6, 1.2e6])
        >>> batch.set(arm, natural_curvature=[(0, 2.0), (0, 4.0), (0, 6.0)], over=0.2)
        """
        numbers = self._lanes.chosen(lanes)
        natural = _natural(self._lanes, target, values)
        if "natural_curvature" in natural and "discrete_curvature" in natural:
            raise ValueError("natural_curvature and discrete_curvature must not be given together")
        for word, value in natural.items():
            del values[word]
            given = np.full(len(numbers), value) if np.ndim(value) == 0 else value
            if word == "natural_twist":
                _twist(self._lanes, target, given, over, lanes)
            elif word == "natural_stretch":
                _stretch(self._lanes, target, given, over, lanes)
            else:
                _curve(self._lanes, target, given, over, lanes, discrete=word == "discrete_curvature")
        if natural and not values:
            return
        rows = [
            {word: row(value, place, len(numbers), word) for word, value in values.items()}
            for place in range(len(numbers))
        ]
        for place, simulation in self._lanes.each(numbers):
            simulation.set(target, over=over, **rows[place])

    def move(
        self,
        support: Support | NodeHandle | Body | Obstacle | str,
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
        support : Support, NodeHandle, Body, Obstacle or str
            Support, node or obstacle, as in `Simulation.move`.
        position : array_like of shape (n, 3) [m]
            Target positions.
        rotation : array_like of shape (n, 3, 3)
            Target rotations, relative to the drawn orientation.
        tangent : array_like of shape (n, 3)
            Target directions of the rod, instead of rotations. For a sphere, the axes of `roll`.
        roll : float or array_like of shape (n,) [rad]
            Rotations about the tangent, or about the axis of an obstacle; one number is for all simulations.
        over : float [s]
            Duration of the ramp to the targets. By default they are reached within the next step.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to move. By default all. For paths move one: ``batch[i].move(..., path=path)``.

        Raises
        ------
        ValueError
            See `Simulation.move`; or an array without a row for each simulation. Simulations before the one that
            refuses its target do move.

        See Also
        --------
        set : Set parameters.
        Simulation.move : Move a support of one simulation, also along a path.

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


def _curve(
    owner: Lanes, rod: Rod | str, curvature: npt.ArrayLike, over: float, lanes: npt.ArrayLike | None, *, discrete: bool
) -> None:
    part = owner.rod(rod)
    numbers, stencils = owner.chosen(lanes), len(part.voronoi)
    what = f"natural_curvature of {part.owner}"
    values = validation.number_array(curvature, what, (len(numbers), 2), (len(numbers), stencils, 2))
    if values.ndim == 2:
        values = np.repeat(values[:, None], stencils, axis=1)
    owner.engine.set_natural_curvature(
        numbers,
        part.index,
        values,
        validation.non_negative(over, "over"),
        owner.voronoi(part),
        discrete,
        what,
    )


def _twist(owner: Lanes, rod: Rod | str, twist: npt.ArrayLike, over: float, lanes: npt.ArrayLike | None) -> None:
    part = owner.rod(rod)
    numbers = owner.chosen(lanes)
    values = _spread(twist, f"natural_twist of {part.owner}", len(numbers), len(part.voronoi))
    _lead(owner.engine.set_natural_twist, part.index, values, over, numbers)


def _stretch(owner: Lanes, rod: Rod | str, stretch: npt.ArrayLike, over: float, lanes: npt.ArrayLike | None) -> None:
    part = owner.rod(rod)
    numbers, what = owner.chosen(lanes), f"natural_stretch of {part.owner}"
    values = _spread(stretch, what, len(numbers), len(part.lengths))
    if np.any(values <= 0.0):
        raise ValueError(f"{what} must be positive, got {values.min():g}")
    _lead(owner.engine.set_natural_stretch, part.index, values, over, numbers)


def _natural(owner: Lanes, target: Any, values: dict[str, Any]) -> dict[str, Any]:
    """Values of natural shapes, which the engine sets for all simulations at once."""
    if not isinstance(target, Rod | str) or target not in {
        *owner.first.rods,
        *(r.name for r in owner.first.rods),
    }:
        return {}
    return {word: value for word, value in values.items() if word in (*NATURAL_WORDS, "discrete_curvature")}


def _lead(put: Callable[..., None], rod: int, values: FloatArray, over: float, numbers: IntArray) -> None:
    put(numbers, rod, values, validation.non_negative(over, "over"))


def _spread(value: npt.ArrayLike, what: str, count: int, size: int) -> FloatArray:
    """A row for each simulation: one number each, or one for every part of a rod."""
    values = validation.number_array(value, what, (count,), (count, size))
    return np.repeat(values[:, None], size, axis=1) if values.ndim == 1 else values
