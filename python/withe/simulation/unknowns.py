"""Parameters of gradients, in the words of `set` and `get`, and their readers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.contacts import Body, BodyPair, touching
from withe.parts.friction import as_given, by_given, obstacle_friction, own_friction, pair_between
from withe.parts.handles import Drag, Fluid, Joint, Load, Mass, NodeHandle, Obstacle, Rod, Spring, Support, Tendon
from withe.parts.joints import JOINT_WORDS
from withe.parts.kinds import (
    DragPart,
    FluidPart,
    JoinPart,
    LoadPart,
    MassPart,
    ObstaclePart,
    Part,
    RodPart,
    SpringPart,
    SupportPart,
    TendonPart,
)
from withe.parts.parameters import ACTING_WORDS, NATURAL_WORDS, ROD_WORDS, RodParameters
from withe.parts.springs import SPRING_WORDS
from withe.simulation.drawn import points_reader
from withe.simulation.joints import joint_index
from withe.simulation.loads import load_rows
from withe.simulation.motion import POSE_WORDS
from withe.simulation.session import Session
from withe.simulation.tendons import tendon_index

__all__ = [
    "INITIAL_WORDS",
    "SCENE_WORDS",
    "Array",
    "OfRun",
    "Reader",
    "Remaining",
    "Unknown",
    "check_list",
    "dragged_rods",
    "edges_of",
    "friction_reader",
    "is_points",
    "part_of",
    "reader_of",
    "rod_slopes",
    "scene_reader",
    "sum_of_slopes",
    "unknown_reader",
    "unknown_readers",
]

FloatArray = npt.NDArray[np.float64]
Unknown = (
    tuple[
        Rod | Load | Mass | Drag | Fluid | Spring | Tendon | Joint | Support | Obstacle | str | tuple[Body, Body], str
    ]
    | str
)
"""Parameter of a gradient: a part and a word of `set`, two bodies and "friction", or a word of the scene."""


Array = tuple[str, str]
"""Name of a rod, and of what the engine works with of it."""


@dataclass(frozen=True)
class Remaining:
    """A word of a rod or a drag as far as other words leave what it sets: it acts through some arrays alone."""

    unknown: Unknown
    arrays: frozenset[Array]


@dataclass(frozen=True)
class OfRun:
    """Derivatives of a scalar of a run by what acted in it, or in a part of it."""

    parameters: _core.ParameterGradient


Reader = Callable[[_core.EquilibriumGradient | OfRun], Any]
"""Reads a derivative, shaped like `get`."""

HAND_WORDS = ("stiffness", "force_limit")
INITIAL_WORDS = ("initial_positions", "initial_velocities")
SCENE_WORDS = ("gravity", "friction", "slip_tolerance")


def unknown_readers(session: Session, wrt: Sequence[Unknown]) -> list[Reader]:
    """For each of `wrt` what reads its derivative, shaped like `get`, from what the engine finds."""
    check_list(wrt)
    return [unknown_reader(session, unknown) for unknown in wrt]


def check_list(wrt: Sequence[Unknown], *, may_be_empty: bool = False) -> None:
    """Refuse what is no list, or empty."""
    if isinstance(wrt, str) or not isinstance(wrt, Sequence) or not (wrt or may_be_empty):
        raise ValueError('wrt must be a list of parameters, such as [(arm, "youngs_modulus"), "gravity"]')


def is_points(unknown: Unknown) -> bool:
    """Return True if the parameter is the drawn nodes of a rod."""
    return isinstance(unknown, tuple) and len(unknown) == 2 and isinstance(unknown[1], str) and unknown[1] == "points"


def unknown_reader(session: Session, unknown: Unknown | Remaining) -> Reader:
    """Return the reader of the derivative by one of `wrt`."""
    if isinstance(unknown, Remaining):
        return _remaining_reader(session, unknown)
    if isinstance(unknown, str):
        return scene_reader(session, unknown)
    if not isinstance(unknown, tuple) or len(unknown) != 2 or not isinstance(unknown[1], str):
        raise ValueError(f"wrt must hold pairs of a part and a parameter, or parameters of the scene, got {unknown!r}")
    target, word = unknown
    if isinstance(target, NodeHandle):
        raise ValueError(f"wrt must name a part, got the node {target.name}: name the support at the node, or the rod")
    return reader_of(session, part_of(session, target), word)


def part_of(session: Session, target: Any) -> Part | BodyPair:
    """Return the part, or pair of bodies, that `wrt` names."""
    if isinstance(target, tuple):
        if len(target) != 2:
            raise ValueError(f"wrt must name two bodies by a pair, got {target!r}")
        return BodyPair(*(touching(session.directory, body) for body in target))
    return session.directory.find_any(target, "wrt")


def reader_of(session: Session, part: Part | BodyPair, word: str) -> Reader:
    """Return the reader of the derivative by a parameter of a part."""
    if isinstance(part, RodPart):
        return _rod_reader(session, part, word)
    if isinstance(part, ObstaclePart | BodyPair) and word == "friction":
        given = _friction_given(session, part)
        read = friction_reader(session, part)
        return lambda g: by_given(read(g), np.shape(given))
    if isinstance(part, ObstaclePart) and word == "rolling_friction":
        index = session.directory.all(ObstaclePart).index(part)
        _check_rubs(float(session.contact.obstacle_rolling[index]), f"{part.name}, of rods that roll,")
        return lambda g: float(g.parameters.obstacle_rolling[index])
    if isinstance(part, FluidPart) and word == "viscosity":
        return lambda g: float(g.parameters.fluid_viscosity)
    if isinstance(part, LoadPart) and word == part.kind:
        return _load_reader(session, part)
    if isinstance(part, MassPart) and word == "mass":
        row = session.directory.row(part.node)
        return lambda g: float(g.parameters.added_mass[row])
    if isinstance(part, SpringPart) and word in SPRING_WORDS:
        spring = session.scene.all(SpringPart).index(part)
        return lambda g: float(getattr(g.parameters, f"spring_{word}")[spring])
    if isinstance(part, TendonPart) and word == "tension":
        tendon = tendon_index(session, part)
        return lambda g: float(g.parameters.tendon_tension[tendon])
    if isinstance(part, JoinPart) and part.axis is not None and word in JOINT_WORDS:
        joint = joint_index(session, part)
        return lambda g: float(getattr(g.parameters, f"joint_{word}")[joint])
    if isinstance(part, DragPart) and word == "drag":
        edges = np.concatenate([np.arange(*edges_of(session, rod.index)) for rod in dragged_rods(session, part)])
        return lambda g: float(g.parameters.drag[edges].sum())
    if isinstance(part, ObstaclePart) and word == "position":
        return _place_reader(session, part)
    if isinstance(part, SupportPart) and word in POSE_WORDS:
        return _pose_reader(session, part, word)
    if isinstance(part, SupportPart) and word in HAND_WORDS:
        return _hand_reader(session, part, word)
    raise ValueError(f"no gradient with respect to {word!r} of {part.name!r} is available")


def _remaining_reader(session: Session, remaining: Remaining) -> Reader:
    part, word = part_of(session, remaining.unknown[0]), remaining.unknown[1]
    if isinstance(part, RodPart):
        return _rod_reader(session, part, word, {array for _, array in remaining.arrays})
    rods = {rod for rod, _ in remaining.arrays}
    dragged = [edges_of(session, rod.index) for rod in session.directory.all(RodPart) if rod.name in rods]
    return lambda g: float(sum(g.parameters.drag[first:last].sum() for first, last in dragged))


def _load_reader(session: Session, part: LoadPart) -> Reader:
    rows, axis, shape = load_rows(session, part), part.axis, part.value.shape
    if part.name in session.settings.functions:
        raise ValueError(
            f"no gradient with respect to {part.name!r} is available, because {part.name!r} is a function of time"
        )
    if axis is None:
        return lambda g: g.parameters.loads[rows].reshape(shape)
    return lambda g: (g.parameters.loads[rows].reshape(shape) @ axis)[()]


def _pose_reader(session: Session, part: SupportPart, word: str) -> Reader:
    index = session.settings.supports[part.name][0]

    def read(gradient: _core.EquilibriumGradient | OfRun) -> FloatArray:
        found = _of_equilibrium(gradient, part.name)
        return np.array(found.support_positions[index] if word == "position" else found.support_rotations[index])

    return read


def _place_reader(session: Session, part: ObstaclePart) -> Reader:
    index = session.directory.all(ObstaclePart).index(part)
    return lambda g: np.array(_of_equilibrium(g, part.name).obstacle_positions[index])


def _of_equilibrium(gradient: _core.EquilibriumGradient | OfRun, name: str) -> _core.EquilibriumGradient:
    if isinstance(gradient, OfRun):
        raise ValueError(
            f"step_jacobian is not available with respect to the pose of {name!r}; gradients of equilibria, runs "
            "and calls of move are"
        )
    return gradient


def _hand_reader(session: Session, part: SupportPart, word: str) -> Reader:
    grasp = part.grasp
    if grasp is None or grasp.stiffness is None:
        raise ValueError(
            f"{part.name!r} has no {word} to differentiate by, because {part.name!r} is not a hand that yields"
        )
    if grasp.slides:
        raise ValueError(
            f"no gradient with respect to the {word} of {part.name!r} is available, because {part.name!r} is a ring"
        )
    index = session.settings.supports[part.name][0]
    if word == "stiffness":
        return lambda g: np.array(g.parameters.hand_stiffness[index])
    if not np.isfinite(grasp.force_limit):
        raise ValueError(f"{part.name!r} has no force_limit to differentiate by")
    return lambda g: float(g.parameters.hand_limit[index])


def friction_reader(session: Session, part: ObstaclePart | BodyPair) -> Reader:
    """Return the reader of the derivative by the coefficients of each direction, shape (3,)."""
    if isinstance(part, ObstaclePart):
        obstacle = session.directory.all(ObstaclePart).index(part)
        return lambda g: np.array(g.parameters.obstacle_friction[obstacle])
    bodies = part.bodies(session.directory)
    pair = next(i for i, own in enumerate(session.contact.pairs) if {own.first, own.second} == bodies)
    return lambda g: np.array(g.parameters.pair_friction[pair])


def _friction_given(session: Session, part: ObstaclePart | BodyPair) -> float | tuple[float, ...]:
    contact = session.contact
    if isinstance(part, ObstaclePart):
        given = as_given(obstacle_friction(contact, session.directory.all(ObstaclePart).index(part)))
    else:
        directions = own_friction(pair_between(contact.pairs, part.bodies(session.directory)))
        if directions is None:
            raise ValueError(f"{part.name} have no friction of their own to differentiate by: call set_friction first")
        given = as_given(directions)
    _check_rubs(np.max(given), part.name)
    return given


def _check_rubs(friction: float, what: str) -> None:
    if not friction > 0.0:
        raise ValueError(f"friction of {what} must be positive to differentiate by, got 0: set a small value")


def scene_reader(session: Session, word: str) -> Reader:
    """Return the reader of the derivative by a parameter of the scene."""
    if word == "gravity":
        return lambda g: np.array(g.parameters.gravity)
    if word in SCENE_WORDS:
        if word == "friction":
            _check_rubs(session.contact.friction, "rods")
        return lambda g: float(getattr(g.parameters, word))
    if word not in INITIAL_WORDS:
        words = ", ".join((*SCENE_WORDS, *INITIAL_WORDS))
        raise ValueError(f"wrt must hold {words}, or pairs of a part and a parameter, got {word!r}")

    def refuse(gradient: _core.EquilibriumGradient | OfRun) -> Any:
        raise ValueError(f"{word} is a parameter of runs, not of equilibria")

    return refuse


def edges_of(session: Session, rod: int) -> tuple[int, int]:
    """First edge of a rod among those of the scene, and the one after its last."""
    counts = [len(part.section.area) for part in session.directory.all(RodPart)]
    return sum(counts[:rod]), sum(counts[: rod + 1])


def dragged_rods(session: Session, part: DragPart) -> list[RodPart]:
    """Those on which a drag acts."""
    return [rod for rod in session.directory.all(RodPart) if part.rods is None or rod.index in part.rods]


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


def _rod_reader(session: Session, part: RodPart, word: str, arrays: Iterable[str] | None = None) -> Reader:
    """`arrays`: through which the word acts; all by default."""
    if word == "points":
        return _points_reader(session, part)
    if word in NATURAL_WORDS:
        return lambda g: np.array(getattr(g.parameters, word)[part.index])
    if word not in (*ROD_WORDS, "radius"):
        words = ", ".join((*ROD_WORDS, *NATURAL_WORDS, "radius", "points"))
        raise ValueError(f"{part.name!r} has no {word!r} to differentiate by; it has {words}")
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
    """Derivatives of what the engine works with by a word, or the radius, of a rod as it is set now, edge by edge."""
    parameters = session.settings.rods[part.index]
    return _radius_slopes(session, part, parameters) if word == "radius" else _slopes(parameters, word)


def sum_of_slopes(
    found: _core.ParameterGradient, slopes: dict[str, FloatArray], word: str, first: int, last: int
) -> FloatArray:
    """By a word of a rod, whose edges are those from `first` to before `last`; one an edge, or a pair."""
    out = np.zeros((last - first, 2) if word == "bend_stiffness" else last - first)
    for name, slope in slopes.items():
        part = np.asarray(getattr(found, name))[first:last] * slope
        out += part if part.ndim == out.ndim else part.sum(axis=1)
    return out


def _slopes(parameters: RodParameters, word: str) -> dict[str, FloatArray]:
    """Derivatives of what the engine works with by a word, edge by edge; see `RodParameters`."""
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
    """Derivatives of what the engine works with by the radius of each edge.

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
