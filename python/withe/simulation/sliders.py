"""Sliders of a simulation: their values, the equilibrium that belongs to them, and the scene to draw."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.errors import ConvergenceError
from withe.parts.contacts import BodyPair
from withe.parts.kinds import LoadPart, RodPart
from withe.recording.record import Record
from withe.recording.recorder import Moving, Recorder, present
from withe.simulation.access import Target, owner_of, word_of, words_of
from withe.simulation.outlines import outlines_of
from withe.simulation.parameters import find_target
from withe.simulation.readouts import Equilibrium
from withe.simulation.session import Session
from withe.view.sliders import Slider

__all__ = ["EquilibriumSliders"]

FloatArray = npt.NDArray[np.float64]

_FORMS = "(part, word, low, high) or (part, word, (low, high))"
_COMPONENTS = {
    "natural_curvature": ("towards d1", "towards d2"),
    "bend_stiffness": ("against curvature towards d1", "against curvature towards d2"),
}


class Solvable(Moving, Protocol):
    """A simulation."""

    _session: Session

    def set(self, target: Any, /, **values: Any) -> None:
        """Set parameters."""

    def get(self, target: Any, word: str | None = None) -> Any:
        """Return a parameter."""

    def equilibrium(self) -> Equilibrium:
        """Find the equilibrium."""

    def snapshot(self) -> Any:
        """Return the whole state."""

    def restore(self, snapshot: Any) -> None:
        """Restore the state of a snapshot."""

    def copy(self) -> Self:
        """Return an independent simulation in the same state."""


@dataclass(frozen=True)
class _Parameter:
    """A parameter with a slider for each component whose range is not empty.

    Attributes
    ----------
    target, word
        As in `Simulation.set`.
    name : str
        Name in errors and titles.
    components : tuple of str
        Name of each component; one empty name for a number.
    low, high : ndarray of shape (components,)
    """

    target: Any
    word: str
    name: str
    unit: str
    components: tuple[str, ...]
    low: FloatArray
    high: FloatArray

    @property
    def moving(self) -> list[int]:
        """Components that have a slider."""
        return [int(index) for index in np.flatnonzero(self.high > self.low)]

    def slider(self, component: int) -> Slider:
        """Return the slider of a component."""
        part = f" {self.components[component]}" if self.components[component] else ""
        unit = "" if self.unit == "-" else f" [{self.unit}]"
        return Slider(f"{self.name}{part}{unit}", float(self.low[component]), float(self.high[component]))

    def value(self, numbers: FloatArray) -> Any:
        """Return the value for `Simulation.set`."""
        return numbers.copy() if len(self.components) > 1 else float(numbers[0])


class EquilibriumSliders:
    """Sliders that set parameters of a simulation, which then goes to its equilibrium.

    Parameters
    ----------
    simulation : Simulation
        Its state and parameters change.
    sliders : sequence of tuple
        See `Simulation.view`.

    Raises
    ------
    ValueError
        A slider of another form, of a parameter that cannot be set, or with a low end that is not below its high end.
    ConvergenceError
        No equilibrium at the start.
    """

    def __init__(self, simulation: Solvable, sliders: Sequence[Any]) -> None:
        self._simulation = simulation
        given = list(sliders) if isinstance(sliders, Sequence) and not isinstance(sliders, str) else None
        if not given or not all(isinstance(each, tuple | list) for each in given):
            raise ValueError(f"sliders must be a list of {_FORMS}, got {sliders!r}")
        self._parameters = [_parameter(simulation, each, f"sliders[{index}]") for index, each in enumerate(given)]
        self._places = [
            (index, component) for index, parameter in enumerate(self._parameters) for component in parameter.moving
        ]
        self._wanted = [_start(simulation, parameter) for parameter in self._parameters]
        self._applied: list[FloatArray | None] = [numbers.copy() for numbers in self._wanted]
        for index, parameter in enumerate(self._parameters):
            now = _present_value(simulation, parameter)
            if now is None or np.any(now < parameter.low) or np.any(now > parameter.high):
                self._applied[index] = None  # moved into its range
        self._check_ends()
        self._last_good: Any = None
        self._message = ""
        self._solve(simulation)
        self._last_good = simulation.snapshot()

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """Return the sliders: components of the first parameter, then those of the next."""
        return tuple(self._parameters[index].slider(component) for index, component in self._places)

    @property
    def values(self) -> list[float]:
        """Return the value of each slider."""
        return [float(self._wanted[index][component]) for index, component in self._places]

    @property
    def message(self) -> str:
        """Return the reason why the scene is not the equilibrium of the sliders, or a jump; empty otherwise."""
        return self._message

    def move(self, slider: int, value: float) -> None:
        """Set a slider and go to the equilibrium. Without one, the simulation returns to the last equilibrium."""
        index, component = self._places[slider]
        if self._wanted[index][component] == value and not self._message:
            return
        self._wanted[index][component] = value
        before = [None if numbers is None else numbers.copy() for numbers in self._applied]
        try:
            found = self._solve(self._simulation)
        except (ConvergenceError, ValueError) as error:
            self._simulation.restore(self._last_good)
            self._applied = before
            title = self.sliders[slider].title
            self._message = f"no equilibrium at {title} = {value:.4g}: the last one is shown\n{_reason(error)}"
            return
        self._last_good = self._simulation.snapshot()
        self._message = "the scene has jumped to another branch of equilibria" if found.branch_changed else ""

    def present(self) -> Record:
        """Return the present scene as a record of one frame."""
        return present(self._simulation, *outlines_of(self._simulation._session.directory))

    def extremes(self) -> Record:
        """Return the present scene, and those with each slider and with all sliders at their ends, where they exist."""
        copy = self._simulation.copy()
        recorder: Recorder[Any] = Recorder(copy, None, *outlines_of(copy._session.directory))
        recorder.capture()
        start = copy.snapshot()
        ends = [(place, end) for place in self._places for end in ("low", "high")]
        for places, end in [*(([place], end) for place, end in ends), (self._places, "low"), (self._places, "high")]:
            numbers = [values.copy() for values in self._wanted]
            for index, component in places:
                numbers[index][component] = getattr(self._parameters[index], end)[component]
            try:
                for parameter, values in zip(self._parameters, numbers, strict=True):
                    copy.set(parameter.target, **{parameter.word: parameter.value(values)})
                copy.equilibrium()
                recorder.capture()
            except (ConvergenceError, ValueError):
                pass
            copy.restore(start)
        return recorder.record

    def _solve(self, simulation: Solvable) -> Equilibrium:
        """Set the parameters that differ from those of the sliders, and find the equilibrium."""
        for index, (parameter, wanted) in enumerate(zip(self._parameters, self._wanted, strict=True)):
            applied = self._applied[index]
            if applied is None or not np.array_equal(applied, wanted):
                simulation.set(parameter.target, **{parameter.word: parameter.value(wanted)})
                self._applied[index] = wanted.copy()
        return simulation.equilibrium()

    def _check_ends(self) -> None:
        """Refuse ranges with values that a parameter cannot have."""
        copy = self._simulation.copy()
        for number, parameter in enumerate(self._parameters):
            for end in (parameter.low, parameter.high):
                try:
                    copy.set(parameter.target, **{parameter.word: parameter.value(end)})
                except ValueError as error:
                    raise ValueError(f"sliders[{number}]: {error}") from None


def _parameter(simulation: Solvable, given: Sequence[Any], what: str) -> _Parameter:
    """Check one slider of the user."""
    if len(given) not in (3, 4) or not isinstance(given[1], str):
        raise ValueError(f"{what} must be {_FORMS}, got {tuple(given)!r}")
    target, word = given[0], given[1]
    part = find_target(simulation._session, target)
    known = word_of(part, word)
    if known is None or not known.is_set:
        hint = validation.it_has(word, [each.name for each in words_of(part) if each.is_set])
        raise ValueError(f"{what}: {owner_of(part)} has no {word!r} to set; {hint}")
    components = _components(simulation, part, target, word, what)
    ends = given[2:] if len(given) == 4 else given[2]
    try:
        low_end, high_end = ends
    except (TypeError, ValueError):
        raise ValueError(f"{what} must be {_FORMS}, got {tuple(given)!r}") from None
    shape = (len(components),)
    low, high = (
        np.broadcast_to(validation.number_array(end, f"{name} of {what}", (), shape), shape)
        for name, end in (("low", low_end), ("high", high_end))
    )
    if np.any(low > high) or not np.any(low < high):
        raise ValueError(f"low of {what} must be below high, got {low_end!r} and {high_end!r}")
    return _Parameter(target, word, f"{word.replace('_', ' ')}{_of(part)}", known.unit, components, low, high)


def _components(simulation: Solvable, part: Target, target: Any, word: str, what: str) -> tuple[str, ...]:
    """Return the names of the components of a parameter."""
    if word in _COMPONENTS:
        return _COMPONENTS[word]
    if word not in ("rotation", "discrete_curvature"):
        value = _get(simulation, target, word)
        if isinstance(part, RodPart) or value is None:
            return ("",)
        if isinstance(value, float | int) or (isinstance(part, LoadPart) and part.axis is not None):
            return ("",)
        if isinstance(value, np.ndarray) and value.shape[-1:] == (3,):
            return ("x", "y", "z")
    other = "; use natural_curvature" if word == "discrete_curvature" else ""
    raise ValueError(f"{what}: {word} of {owner_of(part)} is neither a number nor a vector, so it has no slider{other}")


def _get(simulation: Solvable, target: Any, word: str) -> Any:
    return simulation.get(word) if target is None else simulation.get(target, word)


def _of(part: Target) -> str:
    if part is None:
        return ""
    if isinstance(part, BodyPair):
        return f" of {part.first.name} and {part.second.name}"
    return f" of {part.name}"


def _present_value(simulation: Solvable, parameter: _Parameter) -> FloatArray | None:
    """Return the present value of each component, the mean over the rod; None for a value that a rule chooses."""
    value = _get(simulation, parameter.target, parameter.word)
    if value is None:
        return None
    values = np.asarray(value, float)
    count = len(parameter.components)
    return values.reshape(-1, count).mean(axis=0) if values.size % count == 0 else np.full(count, values.mean())


def _start(simulation: Solvable, parameter: _Parameter) -> FloatArray:
    """Return the first value of each component: the present one, or the nearest in its range."""
    now = _present_value(simulation, parameter)
    return np.clip(parameter.low if now is None else now, parameter.low, parameter.high)


def _reason(error: Exception) -> str:
    """Return a message in lines that fit in a picture."""
    return "\n".join(textwrap.wrap(str(error) or type(error).__name__, 110, max_lines=3, placeholder=" ..."))
