"""Gradients of equilibria and of runs, in the words of `set` and `get`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.parts.handles import Drag, Load, Mass, NodeHandle, Rod, Spring, Support
from withe.parts.kinds import DragPart, LoadPart, MassPart, ObstaclePart, RodPart, SpringPart, SupportPart
from withe.parts.parameters import ACTING_WORDS, ROD_WORDS, RodParameters
from withe.parts.springs import SPRING_WORDS
from withe.simulation.loads import load_rows
from withe.simulation.session import Session

__all__ = [
    "RunDerivatives",
    "Unknown",
    "equilibrium_gradient",
    "equilibrium_gradients",
    "equilibrium_jacobian",
    "positions_adjoint",
    "unknown_readers",
]

FloatArray = npt.NDArray[np.float64]
Unknown = tuple[Rod | Load | Mass | Drag | Spring | Support | str, str] | str
"""What to differentiate by: a part and a word of `set`, or "gravity", "initial_positions", "initial_velocities"."""

_NATURAL_WORDS = ("natural_curvature", "natural_twist")
_INITIAL_WORDS = ("initial_positions", "initial_velocities")

_READOUTS = ("positions", "velocities")


def equilibrium_gradient(session: Session, by_positions: FloatArray, wrt: Sequence[Unknown]) -> list[Any]:
    """Derivatives of a scalar of the present equilibrium; see `Equilibrium.gradient`."""
    return [found[0] for found in equilibrium_gradients(session, [by_positions], wrt)]


def equilibrium_gradients(
    session: Session, by_positions: Sequence[FloatArray], wrt: Sequence[Unknown]
) -> list[list[Any]]:
    """Derivatives of several scalars of the present equilibrium, for each of `wrt` one a scalar.

    The stiffness is factorised once for all of them.
    """
    readers = unknown_readers(session, wrt)
    found = session.world.equilibrium_gradients(list(by_positions))
    return [[read(gradient) for gradient in found] for read in readers]


def equilibrium_jacobian(session: Session, rows: npt.NDArray[np.int64], wrt: Sequence[Unknown]) -> list[FloatArray]:
    """Derivatives of positions of nodes in the present equilibrium; see `Equilibrium.jacobian`."""
    nodes = session.directory.layout.node_count
    axes = _axes(session)
    adjoints = []
    for row in rows:
        for axis in axes:
            by = np.zeros((nodes, 3))
            by[row] = axis
            adjoints.append(by)
    out = []
    for found in equilibrium_gradients(session, adjoints, wrt):
        values = np.array(found)
        along = values.reshape(len(rows), len(axes), *values.shape[1:])
        out.append(np.moveaxis(np.tensordot(along, axes, axes=(1, 0)), -1, 1))
    return out


def positions_adjoint(session: Session, value: npt.ArrayLike, name: str, rows: int | None = None) -> FloatArray:
    """A derivative by positions of every node (or so many rows), checked."""
    array = validation.number_array(value, name, (rows or session.directory.layout.node_count, 3))
    plan = session.world.plan
    if plan.planar:
        normal = np.asarray(plan.plane_normal)
        if np.abs(array @ normal).max() > 1e-9 * max(np.abs(array).max(), 1e-300):
            raise ValueError(
                f"{name} must lie in the plane of the scene, where it moves: build with planar=False, or leave out "
                f"what points along its normal, {normal}"
            )
    return array


class RunDerivatives:
    """What a differentiable run keeps: its tape, what acted, and after how many steps each frame was taken."""

    def __init__(self, session: Session) -> None:
        self._session = replace(session, settings=session.settings.copy())
        self._world = session.world
        self._tape = session.world.start_tape()
        self._steps: list[int] = []

    def note_frame(self) -> None:
        """A frame has been taken."""
        self._steps.append(self._tape.count)

    def end(self) -> None:
        """The run is over."""
        self._world.stop_tape()

    def gradient(self, by: Mapping[str, npt.ArrayLike], wrt: Sequence[Unknown]) -> list[Any]:
        """See `Record.gradient`."""
        if not isinstance(by, Mapping) or not by or not set(by) <= set(_READOUTS):
            raise ValueError(f"what a gradient is of must be derivatives by {' and '.join(_READOUTS)}, got {by!r}")
        readers = unknown_readers(self._session, wrt)
        nodes, frames = self._session.directory.layout.node_count, len(self._steps)
        none = np.empty((0, 3))
        arrays = {name: validation.number_array(value, name, (frames, nodes, 3)) for name, value in by.items()}
        for name, array in arrays.items():
            positions_adjoint(self._session, array.reshape(-1, 3), name, rows=len(array) * nodes)
        moments = [
            _core.MomentAdjoint(steps, *(arrays[name][k] if name in arrays else none for name in _READOUTS))
            for k, steps in enumerate(self._steps)
        ]
        found = self._tape.gradient(moments)
        return [read(found) for read in readers]


def _axes(session: Session) -> FloatArray:
    """Directions in which nodes move, a row each."""
    plan = session.world.plan
    if not plan.planar:
        return np.eye(3)
    normal = np.asarray(plan.plane_normal)
    first = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def unknown_readers(session: Session, wrt: Sequence[Unknown]) -> list[Callable[[Any], Any]]:
    """For each of `wrt` what reads its derivative, shaped like `get`, from what the engine finds."""
    if isinstance(wrt, str) or not isinstance(wrt, Sequence) or not wrt:
        raise ValueError('wrt must be a list of what to differentiate by, such as [(arm, "youngs_modulus"), "gravity"]')
    return [_reader(session, unknown) for unknown in wrt]


def _reader(session: Session, unknown: Unknown) -> Callable[[Any], Any]:
    if isinstance(unknown, str):
        return _scene_reader(unknown)
    if not isinstance(unknown, tuple) or len(unknown) != 2 or not isinstance(unknown[1], str):
        raise ValueError(f"wrt must hold pairs of a part and a word of set, or words of the scene; got {unknown!r}")
    target, word = unknown
    if isinstance(target, NodeHandle):
        raise ValueError(f"wrt must name a part, got the node {target.name}: the support there, or its rod")
    part = session.directory.find_any(target, "wrt")
    if isinstance(part, RodPart):
        return _rod_reader(session, part, word)
    if isinstance(part, LoadPart) and word == part.kind:
        rows, axis, shape = load_rows(session, part), part.axis, part.value.shape
        if part.name in session.settings.functions:
            raise ValueError(f"{part.name!r} is a function of time: no gradient by its one value")
        if axis is None:
            return lambda g: g.parameters.loads[rows].reshape(shape)
        return lambda g: (g.parameters.loads[rows].reshape(shape) @ axis)[()]
    if isinstance(part, MassPart) and word == "mass":
        row = session.directory.row(part.node)
        return lambda g: float(g.parameters.added_mass[row])
    if isinstance(part, SpringPart) and word in SPRING_WORDS:
        spring = session.scene.all(SpringPart).index(part)
        return lambda g: float(getattr(g.parameters, f"spring_{word}")[spring])
    if isinstance(part, DragPart) and word == "drag":
        edges = np.concatenate(
            [
                np.arange(*_edges(session, rod.index))
                for rod in session.directory.all(RodPart)
                if part.rods is None or rod.index in part.rods
            ]
        )
        return lambda g: float(g.parameters.drag[edges].sum())
    if isinstance(part, SupportPart) and word in ("position", "rotation"):
        index = session.settings.supports[part.name][0]
        if word == "position":
            return _of_equilibria(lambda g: np.array(g.support_positions[index]), part.name)
        return _of_equilibria(lambda g: np.array(g.support_rotations[index]), part.name)
    raise ValueError(f"no gradient is known by {word!r} of {part.name!r}")


def _of_equilibria(read: Callable[[Any], Any], name: str) -> Callable[[Any], Any]:
    def checked(gradient: Any) -> Any:
        if not isinstance(gradient, _core.EquilibriumGradient):
            raise ValueError(f"no gradient of a run by the pose of {name!r} is known yet; equilibria have one")
        return read(gradient)

    return checked


def _scene_reader(word: str) -> Callable[[Any], Any]:
    if word == "gravity":
        return lambda g: np.array(g.parameters.gravity)
    if word not in _INITIAL_WORDS:
        raise ValueError(
            f"wrt knows gravity, {', '.join(_INITIAL_WORDS)}, and pairs of a part and a word; got {word!r}"
        )

    def read(gradient: Any) -> FloatArray:
        if not isinstance(gradient, _core.RunGradient):
            raise ValueError(f"an equilibrium has no {word}; a run has")
        return np.array(getattr(gradient, word))

    return read


def _edges(session: Session, rod: int) -> tuple[int, int]:
    """First edge of a rod among those of the scene, and the one after its last."""
    counts = [len(part.section.area) for part in session.directory.all(RodPart)]
    return sum(counts[:rod]), sum(counts[: rod + 1])


def _rod_reader(session: Session, part: RodPart, word: str) -> Callable[[Any], Any]:
    if word in _NATURAL_WORDS:
        return lambda g: np.array(getattr(g.parameters, word)[part.index])
    if word not in (*ROD_WORDS, "radius"):
        words = ", ".join((*ROD_WORDS, *_NATURAL_WORDS, "radius"))
        raise ValueError(f"{part.name!r} has no {word!r} to differentiate by; it has {words}")
    first, last = _edges(session, part.index)
    parameters = session.settings.rods[part.index]
    if word == "radius":
        slopes, scalar = _radius_slopes(session, part, parameters), False
    else:
        slopes, scalar = _slopes(parameters, word), np.ndim(parameters.get(word)) == 0

    def read(gradient: Any) -> Any:
        parts = [np.asarray(getattr(gradient.parameters, name))[first:last] * slope for name, slope in slopes.items()]
        if word == "bend_stiffness":
            return parts[0]
        by_edge = sum(part.reshape(len(part), -1).sum(axis=1) for part in parts)
        return float(by_edge.sum()) if scalar else by_edge

    return read


def _slopes(parameters: RodParameters, word: str) -> dict[str, FloatArray]:
    """Derivatives of what the engine works with by a word, edge by edge; see `RodParameters`."""
    p = parameters
    if word == "line_density":
        return {word: np.ones_like(p.line_density), "rotary_inertia": p.rotary_inertia / p.line_density}
    if word in ACTING_WORDS:
        return {word: np.ones_like(getattr(p, word))}
    if p.youngs_modulus is None or p.poisson_ratio is None or p.density is None:
        raise ValueError(f"no gradient by {word}: the rod's stiffness was given directly, without a material")
    modulus = p.youngs_modulus * np.ones(len(p.stretch_stiffness))
    if word == "youngs_modulus":
        return {
            "stretch_stiffness": p.stretch_stiffness / modulus,
            "bend_stiffness": p.bend_stiffness / modulus[:, None],
            "twist_stiffness": p.twist_stiffness / modulus,
            "viscous_time": -p.viscous_time / modulus,
        }
    if word == "poisson_ratio":
        return {"twist_stiffness": -p.twist_stiffness / (1.0 + p.poisson_ratio)}
    if word == "density":
        return {"line_density": p.line_density / p.density, "rotary_inertia": p.rotary_inertia / p.density}
    return {"viscous_time": 1.0 / modulus}


def _radius_slopes(session: Session, part: RodPart, parameters: RodParameters) -> dict[str, FloatArray]:
    """Derivatives of what the engine works with by the radius of each edge.

    A = pi r^2, I = pi r^4 / 4, J = 2 I. Stiffness and line density that were given directly do not depend on it; rotary
    inertia does.
    """
    section, p = part.section, parameters
    if section.widths is not None or not np.allclose(section.area, np.pi * section.radii**2, rtol=1e-12):
        raise ValueError(f"no gradient by radius: the section of {part.owner} is no withe.Circle")
    if session.world.contact.rods or session.directory.all(ObstaclePart):
        raise ValueError(
            f"no gradient by radius of {part.owner} where rods or obstacles touch: their surfaces would move with it"
        )
    per_radius = 1.0 / section.radii
    if p.youngs_modulus is None:
        return {"rotary_inertia": 2.0 * p.rotary_inertia * per_radius}
    powers = {"stretch_stiffness": 2, "bend_stiffness": 4, "twist_stiffness": 4, "line_density": 2, "rotary_inertia": 4}
    return {
        name: power * (getattr(p, name).T * per_radius).T  # bending has a column a director
        for name, power in powers.items()
    }
