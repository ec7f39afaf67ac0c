"""Parameters of rods in a running simulation: set, read and differentiated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.kinds import FluidPart, ObstaclePart, RodPart
from withe.parts.parameters import ACTING_WORDS, NATURAL_WORDS, ROD_WORDS, RodParameters, in_order_of_setting
from withe.parts.rods import curvature_array, curvature_given, stretch_array, twist_array
from withe.simulation.drawn import points_reader
from withe.simulation.readers import OfRun, Reader
from withe.simulation.session import Session

__all__ = ["edges_of", "in_order", "rod_reader", "rod_slopes", "rod_value", "set_rod", "sum_of_slopes"]

FloatArray = npt.NDArray[np.float64]


def set_rod(session: Session, part: RodPart, values: dict[str, Any], over: float = 0.0) -> None:
    """Change parameters of a rod, all or none; natural shapes ramp over a duration [s]."""
    before = parameters = session.settings.rods[part.index]
    natural = {}
    for word, value in in_order(part, values).items():
        if word == "natural_curvature":
            natural[word] = curvature_given(value, len(part.voronoi), part.owner)
        elif word == "natural_twist":
            natural[word] = twist_array(value, part.voronoi, part.owner)
        elif word == "natural_stretch":
            natural[word] = stretch_array(value, len(part.lengths), part.owner)
        else:
            parameters = parameters.with_value(word, value, part.section, part.owner)
    acting = {} if parameters is before else parameters.acting(before)
    session.world.set(part.index, acting | natural, over)
    session.settings.rods[part.index] = parameters


def in_order(part: RodPart, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values in the order in which none overwrites an earlier one, with discrete curvature converted to smooth.

    Raises
    ------
    ValueError
        Both curvatures, or a discrete curvature of a wrong shape or not finite.
    """
    found = {word: values[word] for word in in_order_of_setting(values)}
    if "discrete_curvature" in found:
        if "natural_curvature" in found:
            raise ValueError(f"natural_curvature and discrete_curvature of {part.owner} must not be given together")
        found["natural_curvature"] = curvature_array(found.pop("discrete_curvature"), part.voronoi, True, part.owner)
    return found


def rod_value(session: Session, part: RodPart, word: str) -> Any:
    """Return the present value of a word of a rod."""
    if word == "radius":
        return part.section.radii.copy()
    if word not in NATURAL_WORDS:
        return session.settings.rods[part.index].get(word)
    values = np.array(session.world.parameter(word, part.index))
    return values if word == "natural_curvature" else values[:, 0]


def edges_of(session: Session, rod: int) -> tuple[int, int]:
    """Return the first edge of a rod among the edges of the scene, and the edge after its last one."""
    counts = [len(part.section.area) for part in session.directory.all(RodPart)]
    return sum(counts[:rod]), sum(counts[: rod + 1])


def _points_reader(session: Session, part: RodPart) -> Reader:
    read = points_reader(session, part)

    def checked(gradient: _core.EquilibriumGradient | OfRun) -> FloatArray:
        if isinstance(gradient, OfRun):
            raise ValueError(
                f"step_jacobian is not available with respect to points of {part.owner}; gradients of equilibria and "
                "runs are"
            )
        return read(gradient)

    return checked


def rod_reader(session: Session, part: RodPart, word: str, arrays: Iterable[str] | None = None) -> Reader:
    """Return the reader of the derivative by a word of a rod, through the arrays by which it acts (all by default)."""
    if word == "points":
        return _points_reader(session, part)
    if word in NATURAL_WORDS:
        return lambda g: np.array(getattr(g.parameters, word)[part.index])
    if word not in (*ROD_WORDS, "radius"):
        hint = validation.it_has(word, (*ROD_WORDS, *NATURAL_WORDS, "radius", "points"))
        raise ValueError(f"{part.name!r} has no {word!r} to differentiate by; {hint}")
    first, last = edges_of(session, part.index)
    slopes = rod_slopes(session, part, word)
    if arrays is not None:
        slopes = {name: slope for name, slope in slopes.items() if name in arrays}
    scalar = word != "radius" and np.ndim(session.settings.rods[part.index].get(word)) == 0

    def read(gradient: _core.EquilibriumGradient | OfRun) -> Any:
        found = gradient.parameters
        if not scalar:
            return sum_of_slopes(found, slopes, word, first, last)
        total = 0.0
        for name, slope in slopes.items():
            total += float(np.vdot(getattr(found, name)[first:last], slope))
        return total

    return read


def rod_slopes(session: Session, part: RodPart, word: str) -> dict[str, FloatArray]:
    """Derivatives of the engine's arrays by a word, or the radius, of a rod with its present values, edge by edge."""
    parameters = session.settings.rods[part.index]
    return _radius_slopes(session, part, parameters) if word == "radius" else _slopes(parameters, word)


def sum_of_slopes(
    found: _core.ParameterGradient, slopes: dict[str, FloatArray], word: str, first: int, last: int
) -> FloatArray:
    """Return derivatives by a word of a rod with the edges `first` to `last` - 1: a value, or a pair, per edge."""
    out = np.zeros((last - first, 2) if word == "bend_stiffness" else last - first)
    for name, slope in slopes.items():
        part = np.asarray(getattr(found, name))[first:last] * slope
        out += part if part.ndim == out.ndim else part.sum(axis=1)
    return out


def _slopes(parameters: RodParameters, word: str) -> dict[str, FloatArray]:
    """Return derivatives of the parameters of the engine by a word, for each edge; see `RodParameters`."""
    p = parameters
    if word == "line_density":
        return {word: np.ones_like(p.line_density), "rotary_inertia": p.rotary_inertia / p.line_density}
    if word in ACTING_WORDS:
        return {word: np.ones_like(getattr(p, word))}
    if p.youngs_modulus is None or p.poisson_ratio is None or p.density is None:
        raise ValueError(
            f"no gradient with respect to {word} is available, because the stiffness of the rod was given directly, "
            "without a material"
        )
    softness = 1.0 / p.youngs_modulus
    if word == "youngs_modulus":
        return {
            "stretch_stiffness": p.stretch_stiffness * softness,
            "bend_stiffness": (p.bend_stiffness.T * softness).T,  # bending has a column a director
            "twist_stiffness": p.twist_stiffness * softness,
            "viscous_time": p.viscous_time * -softness,
        }
    if word == "poisson_ratio":
        return {"twist_stiffness": -p.twist_stiffness / (1.0 + p.poisson_ratio)}
    if word == "density":
        return {"line_density": p.line_density / p.density, "rotary_inertia": p.rotary_inertia / p.density}
    return {"viscous_time": softness * np.ones(len(p.viscous_time))}


def _radius_slopes(session: Session, part: RodPart, parameters: RodParameters) -> dict[str, FloatArray]:
    """Return derivatives of the parameters of the engine by the radius of each edge.

    A = pi r^2, I = pi r^4 / 4, J = 2 I. Stiffness and line density that were given directly do not depend on it; rotary
    inertia does.
    """
    section, p = part.section, parameters
    if section.widths is not None or not np.allclose(section.area, np.pi * section.radii**2, rtol=1e-12):
        raise ValueError(
            f"no gradient with respect to radius is available, because the section of {part.owner} is not a "
            "withe.Circle"
        )
    if session.world.contact.rods or session.directory.all(ObstaclePart):
        raise ValueError(
            f"no gradient with respect to radius of {part.owner} is available with contact, because the surfaces "
            "would move with the radius"
        )
    if session.directory.all(FluidPart):
        raise ValueError(
            f"no gradient with respect to radius of {part.owner} is available in a fluid, because the resistance would "
            "change with the radius"
        )
    per_radius = 1.0 / section.radii
    if p.youngs_modulus is None:
        return {"rotary_inertia": 2.0 * p.rotary_inertia * per_radius}
    powers = {"stretch_stiffness": 2, "bend_stiffness": 4, "twist_stiffness": 4, "line_density": 2, "rotary_inertia": 4}
    return {
        name: power * (getattr(p, name).T * per_radius).T  # bending has a column a director
        for name, power in powers.items()
    }
