"""Unknowns of fits as coordinates: parameters of rods in the words of `set`, a tilt, a delay."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.parts.handles import Handle
from withe.parts.table import KINDS
from withe.real2sim.places import rod_part, turning_axis
from withe.simulation.overlaps import arrays_of, order_of_setting, remaining, setting_rank
from withe.simulation.simulation import Simulation
from withe.simulation.unknowns import Array

__all__ = ["POSITIVE", "Coordinates", "Delay", "Parameter", "Tilt", "Unknown", "order_of_writing"]

FloatArray = npt.NDArray[np.float64]

POSITIVE = tuple(dict.fromkeys(word.name for kind in KINDS for word in kind.words if word.is_positive))


class Unknown(ABC):
    """Fitted numbers of a simulation.

    Attributes
    ----------
    word, rods : str, tuple of str
        Name of the parameter, and its rods.
    names : tuple of str
        Name of each number.
    scales : ndarray of shape (n,)
        A change of each coordinate that counts as large: its whole effect must be visible.
    """

    word: str
    rods: tuple[str, ...]
    names: tuple[str, ...]
    scales: FloatArray
    per_frame: bool

    def __len__(self) -> int:
        return len(self.names)

    @abstractmethod
    def read(self, simulation: Simulation) -> FloatArray:
        """Coordinates of the present value, shape (n,)."""

    @abstractmethod
    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Set the value of coordinates."""

    @property
    @abstractmethod
    def words(self) -> list[Any]:
        """Return the parameters whose gradients determine the gradients by the coordinates."""

    @abstractmethod
    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Return derivatives of m scalars by the coordinates, shape (m, n), from m derivatives by each word."""

    def value(self, coordinates: FloatArray) -> FloatArray:
        """Return the value of coordinates, of shape (..., n), in SI units."""
        return coordinates

    def slope(self, coordinates: FloatArray) -> FloatArray:
        """Derivatives of `value`."""
        return np.ones_like(coordinates)


def order_of_writing(simulation: Simulation, unknowns: Sequence[Unknown]) -> list[int]:
    """Places of unknowns in the order of writing, in which none overwrites an earlier one."""
    session = simulation._session
    ranks = [max((setting_rank(session, word) for word in unknown.words), default=(0, 0)) for unknown in unknowns]
    return sorted(range(len(ranks)), key=ranks.__getitem__)


class Coordinates:
    """All unknowns of a simulation as one vector.

    Attributes
    ----------
    names, scales
        Names and scales of all coordinates, in the order of the unknowns.
    slices : list of slice
        Slice of each unknown.
    per_frame : ndarray of bool
        True for coordinates that differ from frame to frame.
    words : list
        Arguments for derivatives by all unknowns, without values that another unknown replaces.
    """

    simulation: Simulation
    unknowns: list[Unknown]
    names: tuple[str, ...]
    scales: FloatArray
    per_frame: npt.NDArray[np.bool_]
    slices: list[slice]
    words: list[Any]

    def __init__(self, simulation: Simulation, unknowns: Sequence[Unknown]) -> None:
        self.simulation, self.unknowns = simulation, list(unknowns)
        self.names = tuple(name for unknown in self.unknowns for name in unknown.names)
        self.scales = np.concatenate([unknown.scales for unknown in self.unknowns])
        self.per_frame = np.repeat([unknown.per_frame for unknown in self.unknowns], [len(u) for u in self.unknowns])
        ends = np.cumsum([0, *(len(unknown) for unknown in self.unknowns)])
        self.slices = [slice(a, b) for a, b in pairwise(ends)]
        self._written = np.full(len(self.names), np.nan)
        session = simulation._session
        self.words = remaining(session, [word for unknown in self.unknowns for word in unknown.words])
        self._order = order_of_writing(simulation, self.unknowns)
        self._arrays = [{array for word in u.words for array in arrays_of(session, word)} for u in self.unknowns]

    def begin(self) -> FloatArray:
        """Return the coordinates of the present values."""
        return np.concatenate([unknown.read(self.simulation) for unknown in self.unknowns])

    def write(self, coordinates: FloatArray) -> None:
        """Set changed values, and again the values that these changes have reset."""
        made: set[Array] = set()
        for index in self._order:
            place, arrays = self.slices[index], self._arrays[index]
            if made & arrays or not (coordinates[place] == self._written[place]).all():
                self.unknowns[index].write(self.simulation, coordinates[place])
                self._written[place] = coordinates[place]
                made |= arrays

    def in_plane(self, by_positions: FloatArray) -> FloatArray:
        """Return derivatives by positions, shape (..., 3), without the parts along the normal of a planar scene."""
        normal = self.simulation._session.world.plane_normal
        if normal is None:
            return by_positions
        return np.asarray(by_positions - (by_positions @ normal)[..., None] * normal)

    def forget(self) -> None:
        """Forget the value that was set last: it may have been changed elsewhere."""
        self._written[:] = np.nan


class Parameter(Unknown):
    """A positive parameter of one or several parts; the coordinate is the logarithm of its factor."""

    word: str
    names: tuple[str, ...]
    rods: tuple[str, ...]
    scales: FloatArray
    per_frame = False

    def __init__(self, simulation: Simulation, handles: Sequence[Handle | str], word: str) -> None:
        session = simulation._session
        listed = [session.directory.find_any(handle, "unknowns") for handle in handles]
        parts = [listed[place] for place in order_of_setting(session, [(part.name, word) for part in listed])]
        self.word, self.rods = word, tuple(part.name for part in parts)
        self._first: dict[str, Any] = {}
        for part in parts:
            value = simulation.get(part.name, word)
            if value is None:
                raise ValueError(
                    f"{word} of {part.name!r} cannot be unknown, because the stiffness of the rod was given "
                    "without a material"
                )
            if not (np.asarray(value) > 0.0).all():
                raise ValueError(
                    f"{word} of {part.name!r} must have a positive initial value, because its logarithm is fitted: "
                    f"set a guess, simulation.set({part.name!r}, {word}=...)"
                )
            self._first[part.name] = np.asarray(value, np.float64) if np.ndim(value) else float(value)
        self._mean = float(np.mean([np.mean(value) for value in self._first.values()]))
        self.names = (f"{word} of {', '.join(map(repr, self.rods))}",)
        self.scales = np.ones(1)

    def read(self, simulation: Simulation) -> FloatArray:
        """Return the logarithm of the present value over the first."""
        name = self.rods[0]
        return np.array([np.log(np.mean(simulation.get(name, self.word)) / np.mean(self._first[name]))])

    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Multiply the first value."""
        for name, first in self._first.items():
            simulation.set(name, **{self.word: first * float(np.exp(coordinates[0]))})

    @property
    def words(self) -> list[Any]:
        """The parameter of each rod."""
        return [(name, self.word) for name in self.rods]

    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Derivatives by the common factor of all values."""
        factor, firsts = float(np.exp(coordinates[0])), self._first.values()
        shares = [[np.sum(one * first * factor) for one in by] for by, first in zip(found, firsts, strict=True)]
        return np.asarray(np.sum(shares, axis=0))[:, None]

    def value(self, coordinates: FloatArray) -> FloatArray:
        """Return the mean over the parts, in SI units."""
        return np.asarray(self._mean * np.exp(coordinates))

    def slope(self, coordinates: FloatArray) -> FloatArray:
        """Return the value itself, because the coordinate is a logarithm."""
        return self.value(coordinates)


class Tilt(Unknown):
    """Tilt of the base of a robot in a plane, as an opposite rotation of gravity."""

    names: tuple[str, ...]
    rods: tuple[str, ...]
    scales: FloatArray
    word: str = "gravity"
    per_frame: bool = False
    name = "tilt of the base"

    def __init__(self, simulation: Simulation) -> None:
        part = rod_part(simulation, simulation.rods[0])
        plane = turning_axis(simulation, part)
        assert plane is not None
        self._axis, self._first = plane[1], simulation.get("gravity")
        self.rods, self.names, self.scales = (), (self.name,), np.ones(1)

    def read(self, simulation: Simulation) -> FloatArray:
        """Return zero, the initial guess."""
        return np.zeros(1)

    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Turn gravity."""
        simulation.set(gravity=self.gravity(float(coordinates[0])))

    @property
    def words(self) -> list[Any]:
        """Gravity."""
        return ["gravity"]

    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Derivatives by the rotation of gravity."""
        change = -np.cross(self._axis, self.gravity(float(coordinates[0])))
        return np.asarray(np.array(found[0]) @ change)[:, None]

    def gravity(self, tilt: float) -> FloatArray:
        """Return gravity relative to a tilted base [m/s^2]."""
        along = self._axis * (self._axis @ self._first)
        across = np.cross(self._axis, self._first)
        return np.asarray(along + np.cos(tilt) * (self._first - along) - np.sin(tilt) * across)


class Delay(Unknown):
    """Delay of the clock of the targets after the start of a run [s]."""

    names: tuple[str, ...]
    rods: tuple[str, ...]
    scales: FloatArray
    word: str = "delay"
    per_frame: bool = False

    def __init__(self, first: float, duration: float) -> None:
        self._first = first
        self.rods, self.names, self.scales = (), ("delay",), np.array([duration / 100.0])

    def read(self, simulation: Simulation) -> FloatArray:
        """Return the initial guess."""
        return np.array([self._first])

    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Do nothing: the delay is not part of the simulation."""

    @property
    def words(self) -> list[Any]:
        """Return no parameters, since the delay is not a parameter of the engine."""
        return []

    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Return zero: equilibria do not depend on the delay."""
        return np.zeros((0, 1))
