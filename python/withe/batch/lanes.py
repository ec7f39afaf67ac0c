"""The simulations of a batch, by number: selection for a call, and values with a row for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.handles import Rod
from withe.parts.kinds import RodPart
from withe.simulation.simulation import Simulation

__all__ = ["Lanes", "output", "row", "stacked"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intc]


class Lanes:
    """The simulations of a batch and the engine's view of them.

    Attributes
    ----------
    simulations : list of Simulation
    engine : _core.Batch
    """

    def __init__(self, simulations: list[Simulation], workers: int) -> None:
        self.simulations = simulations
        self.engine: _core.Batch = _core.Batch([each._session.world for each in simulations], workers)
        self._all = np.arange(len(simulations), dtype=np.intc)
        self._all.flags.writeable = False
        self._rods: dict[str, RodPart] = {}
        self._voronoi: dict[int, FloatArray] = {}
        self._restorations = np.zeros(len(simulations), np.int64)  # counts at which simulations failed
        self._nodes = [len(self.first._session.directory.layout.rows(rod.index)) for rod in self.first.rods]

    def __len__(self) -> int:
        return len(self.simulations)

    @property
    def first(self) -> Simulation:
        """Return the first simulation, which has the shape of all."""
        return self.simulations[0]

    def replace(self, number: int, simulation: Simulation) -> None:
        """Replace a simulation by another one of the same shape."""
        self.engine.replace(number, simulation._session.world)
        self.simulations[number] = simulation
        self._rods.clear()
        self._voronoi.clear()

    def rod(self, rod: Rod | str) -> RodPart:
        """Return the rod of the first simulation for a handle or a name. Each name is searched once.

        Raises
        ------
        ValueError
            The rod does not exist.
        """
        if not isinstance(rod, str):
            return self.first._session.directory.rod(rod)
        part = self._rods.get(rod)
        if part is None:
            part = self._rods[rod] = self.first._session.directory.rod(rod)
        return part

    def nodes(self, rod: int) -> int:
        """Return the number of nodes of a rod."""
        return self._nodes[rod]

    def voronoi(self, rod: RodPart) -> FloatArray:
        """Voronoi lengths of a rod in every simulation, shape (n, stencils) [m]."""
        found = self._voronoi.get(rod.index)
        if found is None:
            own = [simulation._session.directory.rod(rod.name).voronoi for simulation in self.simulations]
            found = self._voronoi[rod.index] = np.array(own)
        return found

    def chosen(self, given: npt.ArrayLike | None, what: str = "lanes") -> IntArray:
        """Return the numbers of selected simulations: None for all, a mask, or numbers.

        Raises
        ------
        ValueError
            A mask of another length, or a number that does not exist or is given twice.
        """
        if given is None or given is self._all:
            return self._all
        size = len(self)
        array = np.asarray(given)
        if array.dtype == np.bool_:
            if array.shape != (size,):
                raise ValueError(f"{what} must have shape ({size},) as a mask, got {array.shape}")
            return np.flatnonzero(array).astype(np.intc)
        if array.size == 0:
            return self._all[:0]
        if array.dtype.kind not in "iu" or array.ndim > 1:
            raise ValueError(f"{what} must be a mask of shape ({size},), or numbers of simulations, got {given!r:.80}")
        numbers = np.atleast_1d(array)
        for number in numbers[(numbers < -size) | (numbers >= size)]:
            raise ValueError(f"{what} must lie in {-size}..{size - 1}, got {number}")
        numbers = (numbers % size).astype(np.intc)
        if len(np.unique(numbers)) < len(numbers):
            raise ValueError(
                f"{what} must be different numbers of simulations, got {given!r:.80}: a mask must hold booleans"
            )
        return numbers

    @property
    def numbers(self) -> IntArray:
        """Return the numbers of all simulations."""
        return self._all

    def each(self, numbers: IntArray) -> Iterator[tuple[int, Simulation]]:
        """Yield the place in a call's values, and the simulation, of each lane of a call."""
        for place, number in enumerate(numbers):
            yield place, self.simulations[number]

    def note_failures(self) -> None:
        """Note simulations that have failed in a step; they are skipped until they are restored."""
        for number in self.engine.failed().nonzero()[0]:
            self._restorations[number] = self.simulations[number]._session.restorations

    def forgive_restored(self) -> None:
        """Continue failed simulations that were restored individually."""
        for number in self.engine.failed().nonzero()[0]:
            if self.simulations[number]._session.restorations != self._restorations[number]:
                self.engine.forgive(number)

    def refuse_in_run(self, what: str) -> None:
        """Refuse a change of a simulation during its run."""
        for simulation in self.simulations:
            simulation._stepping.refuse_in_run(what)

    def gathered(self, read: Callable[[Simulation], Any]) -> Any:
        """Return the read-outs of all simulations, stacked."""
        return stacked([read(simulation) for simulation in self.simulations])


def row(value: Any, index: int, count: int, what: str) -> Any:
    """Return the value for one simulation: its row of an array; or a number, word, function or None that is for all.

    Raises
    ------
    ValueError
        An array without a row for each simulation.
    """
    if value is None or isinstance(value, str | float | int) or callable(value):
        return value
    if isinstance(value, Sequence | np.ndarray):
        if np.ndim(value) == 0:
            return value
        if len(value) != count:
            raise ValueError(f"{what} must have a row for each of {count} simulations, got {len(value)}")
        return value[index]
    return value


def stacked(answers: list[Any]) -> Any:
    """Stack results of one kind along a new first axis: arrays, numbers, or objects of these."""
    first = answers[0]
    if is_dataclass(first) and not isinstance(first, type):
        return type(first)(**{f.name: stacked([getattr(a, f.name) for a in answers]) for f in fields(first)})
    if isinstance(first, np.ndarray | float | int | bool) and all(np.shape(a) == np.shape(first) for a in answers):
        return np.stack(answers)
    return tuple(answers)


def output(out: FloatArray | None, shape: tuple[int, ...]) -> FloatArray:
    """Return the array for a read-out: the user's, or a new one.

    Raises
    ------
    ValueError
        An array of another shape, type or layout.
    """
    if out is None:
        return np.empty(shape)
    if not isinstance(out, np.ndarray) or out.dtype != np.float64 or out.shape != shape:
        came = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise ValueError(f"out must be a float64 array of shape {shape}, got {came}")
    if not (out.flags.c_contiguous and out.flags.writeable):
        raise ValueError("out must be contiguous (order C) and writeable")
    return out
