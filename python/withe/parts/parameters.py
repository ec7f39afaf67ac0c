"""The numbers of a rod that may change while a simulation runs, by the words of `set` and `get`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.materials import Material, Stiffness, bend_stiffness, check_poisson_ratio
from withe.parts.sections import SectionProperties

__all__ = [
    "ACTING_WORDS",
    "MADE_OF",
    "MATERIAL_WORDS",
    "NATURAL_WORDS",
    "ROD_WORDS",
    "RodParameters",
    "in_order_of_setting",
]

FloatArray = npt.NDArray[np.float64]

MATERIAL_WORDS = ("youngs_modulus", "poisson_ratio", "density", "viscosity")
ROD_WORDS = (
    *MATERIAL_WORDS,
    "stretch_stiffness",
    "bend_stiffness",
    "twist_stiffness",
    "line_density",
    "viscous_time",
    "drag",
)

NATURAL_WORDS = ("natural_curvature", "natural_twist", "natural_stretch")  # the shape free of stress

ACTING_WORDS = (
    "stretch_stiffness",
    "bend_stiffness",
    "twist_stiffness",
    "line_density",
    "rotary_inertia",
    "viscous_time",
    "drag",
)

MADE_OF: dict[str, dict[str, set[str]]] = {  # what else of ACTING_WORDS a word makes anew, and of which words
    "youngs_modulus": {
        "stretch_stiffness": {"youngs_modulus"},
        "bend_stiffness": {"youngs_modulus"},
        "twist_stiffness": {"youngs_modulus", "poisson_ratio"},
        "viscous_time": {"youngs_modulus", "viscosity"},
    },
    "poisson_ratio": {"twist_stiffness": {"youngs_modulus", "poisson_ratio"}},
    "density": {"line_density": {"density"}, "rotary_inertia": {"density"}},
    "viscosity": {"viscous_time": {"youngs_modulus", "viscosity"}},
    "line_density": {"line_density": {"line_density"}, "rotary_inertia": {"line_density"}},
}


def in_order_of_setting(words: Iterable[str]) -> list[str]:
    """Words of a rod as they are to be set together: in the order of ROD_WORDS, in which none undoes one before it.

    Materials make stiffnesses, line density and viscous time anew (MADE_OF); these make nothing of a material.
    """
    return sorted(words, key=lambda word: ROD_WORDS.index(word) if word in ROD_WORDS else len(ROD_WORDS))


@dataclass(frozen=True)
class RodParameters:
    """Stiffness, inertia and damping of a rod.

    The first group is what a user gave: a number, or an array of shape (edges,), and None where the rod
    has its stiffness given directly. The second is what the engine works with, arrays of shape (edges,).
    """

    youngs_modulus: float | FloatArray | None  # [Pa]
    poisson_ratio: float | None
    density: float | FloatArray | None  # [kg/m^3]
    viscosity: float | FloatArray | None  # [Pa s]

    stretch_stiffness: FloatArray  # [N]
    bend_stiffness: FloatArray  # (edges, 2) [N m^2]
    twist_stiffness: FloatArray  # [N m^2]
    line_density: FloatArray  # [kg/m]
    rotary_inertia: FloatArray  # [kg m]
    viscous_time: FloatArray  # [s]
    drag: FloatArray  # [Pa s]

    @classmethod
    def from_material(cls, material: Material, section: SectionProperties, owner: str) -> RodParameters:
        """Parameters of a rod of one material."""
        edges = len(section.area)
        zero = np.zeros(edges)
        empty = cls(None, material.poisson_ratio, None, None, zero, np.zeros((edges, 2)), zero, zero, zero, zero, zero)
        values = {word: getattr(material, word) for word in ("youngs_modulus", "density", "viscosity")}
        return empty._derived(values, section)._checked(owner)

    @classmethod
    def from_stiffness(
        cls, stiffness: Stiffness, line_density: npt.ArrayLike, section: SectionProperties, owner: str
    ) -> RodParameters:
        """Parameters of a rod whose stiffness is given directly."""
        edges = len(section.area)
        density = validation.per_item(line_density, f"line_density of {owner}", edges, "edges")
        return cls(
            youngs_modulus=None,
            poisson_ratio=None,
            density=None,
            viscosity=None,
            stretch_stiffness=validation.per_item(stiffness.stretch, f"stretch stiffness of {owner}", edges, "edges"),
            bend_stiffness=bend_stiffness(stiffness.bend, f"bend stiffness of {owner}", edges),
            twist_stiffness=validation.per_item(stiffness.twist, f"twist stiffness of {owner}", edges, "edges"),
            line_density=density,
            rotary_inertia=_rotary_inertia(density, section),
            viscous_time=validation.per_item(
                stiffness.viscous_time, f"viscous_time of {owner}", edges, "edges", zero=True
            ),
            drag=np.zeros(edges),
        )._checked(owner)

    def changed(self, word: str, value: Any, section: SectionProperties, owner: str) -> RodParameters:
        """A copy with one word changed, and all that follows from it.

        Raises
        ------
        ValueError
            An unknown word, a word of a material for a rod that has none, or a value out of range.
        """
        return self.with_value(word, value, section, owner)._checked(owner)

    def with_value(self, word: str, value: Any, section: SectionProperties, owner: str) -> RodParameters:
        """The same for the engine, which refuses what follows from the value and has over- or underflowed."""
        if word not in ROD_WORDS:
            raise ValueError(f"a rod has no parameter {word!r}; its parameters are {', '.join(ROD_WORDS)}")
        edges = len(section.area)
        what = f"{word} of {owner}"
        if word in MATERIAL_WORDS and self.youngs_modulus is None:
            raise ValueError(
                f"{what} cannot be set, because the stiffness of the rod was given directly, without a material"
            )
        if word == "poisson_ratio":
            return self._derived({word: check_poisson_ratio(value, what)}, section)
        if word == "bend_stiffness":
            return replace(self, bend_stiffness=bend_stiffness(value, what, edges))
        zero = word in ("viscosity", "viscous_time", "drag")
        if word in MATERIAL_WORDS:
            if validation.is_scalar(value):
                check = validation.non_negative if zero else validation.positive
                return self._derived({word: check(value, what)}, section)
            return self._derived({word: validation.per_item(value, what, edges, "edges", zero=zero)}, section)
        array = validation.per_item(value, what, edges, "edges", zero=zero)
        if word == "line_density":
            return replace(self, line_density=array, rotary_inertia=_rotary_inertia(array, section))
        values: dict[str, Any] = {word: array}
        return replace(self, **values)

    def acting(self, before: RodParameters) -> dict[str, FloatArray]:
        """Return the parameters of the engine that differ from those of `before`, by their names in the engine."""
        return {word: mine for word in ACTING_WORDS if (mine := getattr(self, word)) is not getattr(before, word)}

    def get(self, word: str) -> Any:
        """Return a copy of the present value of a word."""
        value = getattr(self, word)
        return value.copy() if isinstance(value, np.ndarray) else value

    def arrays(self) -> dict[str, FloatArray]:
        """Return all values as arrays, for a file."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: np.asarray(value, np.float64) for name, value in values.items() if value is not None}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray], edges: int, owner: str) -> RodParameters:
        """Return the parameters that `arrays` wrote.

        Raises
        ------
        ValueError
            A value is missing, not finite or of another shape.
        """
        values: dict[str, Any] = {}
        for word in (*MATERIAL_WORDS, *(field.name for field in fields(cls)[4:])):
            if word in MATERIAL_WORDS and word not in arrays:
                values[word] = None
                continue
            shapes: list[tuple[int | str, ...]] = [(edges, 2) if word == "bend_stiffness" else (edges,)]
            if word in MATERIAL_WORDS:
                shapes.append(())
            array = validation.number_array(arrays.get(word), f"{word} of {owner}", *shapes)
            values[word] = float(array) if array.ndim == 0 else array
        return cls(**values)._checked(owner)

    def equals(self, other: RodParameters) -> bool:
        """Return True if every number is the same."""
        mine, theirs = self.arrays(), other.arrays()
        return mine.keys() == theirs.keys() and all(np.array_equal(mine[name], theirs[name]) for name in mine)

    def _derived(self, given: dict[str, Any], section: SectionProperties) -> RodParameters:
        """With stiffness and inertia from the material, for the words that changed."""
        values: dict[str, Any] = dict(given)
        modulus = given.get("youngs_modulus", self.youngs_modulus)
        assert modulus is not None
        with np.errstate(over="ignore", invalid="ignore"):
            if "density" in given:
                values["line_density"] = given["density"] * section.area
                values["rotary_inertia"] = given["density"] * (section.moment1 + section.moment2)
            if "youngs_modulus" in given:
                values["stretch_stiffness"] = modulus * section.area
                per_edge = modulus[:, None] if isinstance(modulus, np.ndarray) else modulus
                values["bend_stiffness"] = per_edge * section.moments
            if "youngs_modulus" in given or "poisson_ratio" in given:
                poisson = given.get("poisson_ratio", self.poisson_ratio)
                assert poisson is not None
                values["twist_stiffness"] = modulus / (2.0 * (1.0 + poisson)) * section.torsion
            viscosity = given.get("viscosity", self.viscosity)
            if viscosity is not None and ("viscosity" in given or "youngs_modulus" in given):
                time = viscosity / modulus
                values["viscous_time"] = np.full(len(section.area), time) if validation.is_scalar(time) else time
        return replace(self, **values)

    def _checked(self, owner: str) -> RodParameters:
        """Itself, if nothing over- or underflowed on the way."""
        for word in ("stretch_stiffness", "bend_stiffness", "twist_stiffness", "line_density"):
            values = getattr(self, word)
            if not (np.isfinite(values).all() and (values > 0.0).all()):
                raise ValueError(f"{word} of {owner} must be positive and finite, got {values.flat[0]:g}")
        for word in ("rotary_inertia", "viscous_time", "drag"):
            values = getattr(self, word)
            if not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise ValueError(f"{word} of {owner} must be finite and not negative, got {values.flat[0]:g}")
        return self


def _rotary_inertia(line_density: FloatArray, section: SectionProperties) -> FloatArray:
    return np.asarray(line_density * (section.moment1 + section.moment2) / section.area, np.float64)
