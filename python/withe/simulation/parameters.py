"""Numbers of the parts of a simulation, set and read by their words while it runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from withe.common import validation
from withe.parts.contacts import touching
from withe.parts.description import added_mass, drag
from withe.parts.handles import Drag, Fluid, Joint, Load, Mass, Obstacle, Rod, Spring, Support, Tendon
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
from withe.parts.parameters import NATURAL_WORDS, ROD_WORDS, in_order_of_setting
from withe.parts.rods import curvature_given, stretch_array, twist_array
from withe.parts.springs import SPRING_WORDS
from withe.simulation.hands import ring_friction, set_ring_friction
from withe.simulation.joints import joint_value, set_joint
from withe.simulation.loads import load_index, set_load
from withe.simulation.session import Session
from withe.simulation.springs import set_spring, spring_value
from withe.simulation.supports import find_support, move_support
from withe.simulation.surfaces import (
    OBSTACLE_WORDS,
    SCENE_WORDS,
    obstacle_value,
    pair_value,
    scene_value,
    set_obstacle,
    set_pair_friction,
    set_scene,
)
from withe.simulation.tendons import set_tendon, tendon_tension

__all__ = ["Settable", "get_value", "set_values"]

Settable = (
    Rod
    | Load
    | Mass
    | Spring
    | Tendon
    | Joint
    | Drag
    | Fluid
    | Obstacle
    | Support
    | tuple[Rod | Obstacle | str, Rod | Obstacle | str]
)
_POSE = ("position", "rotation")  # of supports
_FLUID = ("viscosity", "regularization")
_SET_ROD = (*ROD_WORDS, *NATURAL_WORDS)


def set_values(session: Session, target: Settable | str | None, values: dict[str, Any]) -> None:
    """Change parameters; see `Simulation.set`."""
    if not values:
        raise ValueError("set needs at least one parameter, such as youngs_modulus=1e6")
    if isinstance(target, tuple):
        _set_between(session, target, values)
        return
    part = None if target is None else session.directory.find_any(target, "target")
    if isinstance(part, SupportPart):
        _set_support(session, part, values)
        return
    if isinstance(part, RodPart):
        values = {word: values[word] for word in in_order_of_setting(values)}
    _set_values(session, part, values)
    session.note("set", part, values)


def _set_support(session: Session, part: SupportPart, values: dict[str, Any]) -> None:
    _only(values, _words_of(part), f"support {part.name!r}")
    friction = None
    if "friction" in values:
        friction = validation.non_negative(values["friction"], f"friction of {part.name!r}")
        find_support(session, part.name)
    if values.keys() & set(_POSE):
        move_support(session, part.name, values.get("position"), values.get("rotation"), None, None, 0.0, None)
    if friction is not None:
        set_ring_friction(session, part.name, friction)


def _set_between(session: Session, bodies: tuple[Any, ...], values: dict[str, Any]) -> None:
    if len(bodies) != 2:
        raise ValueError(f"target must be a part or a pair of bodies, got {len(bodies)} bodies")
    _only(values, ("friction",), "a pair of bodies")
    set_pair_friction(session, *bodies, values["friction"])


def _between(session: Session, bodies: tuple[Any, ...], word: str) -> Any:
    if len(bodies) != 2 or word != "friction":
        raise ValueError(f"a pair of bodies has 'friction' only, got {word!r} of {len(bodies)} bodies")
    given = pair_value(session, *bodies)
    if given is not None:
        return given
    obstacle = next((body for body in bodies if isinstance(touching(session.directory, body), ObstaclePart)), None)
    return get_value(session, "friction", None) if obstacle is None else get_value(session, obstacle, word)


def _set_values(session: Session, part: Part | None, values: dict[str, Any]) -> None:
    if part is None:
        _only(values, ("gravity", *SCENE_WORDS), "the scene")
        gravity = validation.vector(values["gravity"], "gravity") if "gravity" in values else None
        if values.keys() & set(SCENE_WORDS):
            set_scene(session, values)
        if gravity is not None:
            session.world.set_gravity(gravity)
            session.settings.gravity = gravity
        return
    if isinstance(part, RodPart):
        _set_rod(session, part, values)
    elif isinstance(part, LoadPart):
        _only(values, (part.kind,), f"{part.kind} {part.name!r}")
        set_load(session, part, values[part.kind])
    elif isinstance(part, MassPart):
        _only(values, ("mass",), f"mass {part.name!r}")
        masses = session.settings.masses | {part.name: validation.non_negative(values["mass"], f"mass {part.name!r}")}
        session.world.set_added_mass(added_mass(session.directory, masses))
        session.settings.masses = masses
    elif isinstance(part, SpringPart):
        _only(values, SPRING_WORDS, f"spring {part.name!r}")
        set_spring(session, part, values)
    elif isinstance(part, TendonPart):
        _only(values, ("tension",), f"tendon {part.name!r}")
        set_tendon(session, part, values["tension"])
    elif isinstance(part, JoinPart) and part.axis is not None:
        _only(values, JOINT_WORDS, f"joint {part.name!r}")
        set_joint(session, part, values)
    elif isinstance(part, DragPart):
        _only(values, ("drag",), f"drag {part.name!r}")
        _set_drag(session, part, validation.non_negative(values["drag"], f"drag {part.name!r}"))
    elif isinstance(part, FluidPart):
        _only(values, _FLUID, f"fluid {part.name!r}")
        _set_fluid(session, part, values)
    elif isinstance(part, ObstaclePart):
        _only(values, OBSTACLE_WORDS, f"obstacle {part.name!r}")
        set_obstacle(session, part, values)
    else:
        raise ValueError(_nothing_to_set(part))


def get_value(session: Session, target: Settable | Support | str, word: str | None) -> Any:
    """The present value of a parameter; see `Simulation.get`."""
    if word is None:
        if isinstance(target, str) and target in SCENE_WORDS:
            return scene_value(session, target)
        if not isinstance(target, str) or target != "gravity":
            raise ValueError("get needs a parameter, such as get(arm, 'youngs_modulus')")
        return session.settings.gravity.copy()
    if isinstance(target, tuple):
        return _between(session, target, word)
    part = session.directory.find_any(target, "target")
    if isinstance(part, RodPart):
        if word in NATURAL_WORDS:
            values = np.array(session.world.parameter(word, part.index))
            return values if word == "natural_curvature" else values[:, 0]
        if word in ROD_WORDS:
            return session.settings.rods[part.index].get(word)
        if word == "radius":
            return part.section.radii.copy()
    elif isinstance(part, LoadPart) and word == part.kind:
        value = np.array(session.world.load(load_index(session, part))).reshape(part.value.shape)
        if part.axis is None:
            return value
        along = value @ part.axis
        return along if along.ndim else float(along)
    elif isinstance(part, MassPart) and word == "mass":
        return session.settings.masses[part.name]
    elif isinstance(part, SpringPart) and word in SPRING_WORDS:
        return spring_value(session, part, word)
    elif isinstance(part, TendonPart) and word == "tension":
        return tendon_tension(session, part)
    elif isinstance(part, JoinPart) and part.axis is not None and word in JOINT_WORDS:
        return joint_value(session, part, word)
    elif isinstance(part, DragPart) and word == "drag":
        return session.settings.drags[part.name]
    elif isinstance(part, FluidPart) and word == "viscosity":
        return session.settings.fluids[part.name]
    elif isinstance(part, FluidPart) and word == "regularization":
        return float(session.world.parameter("fluid_regularization")[0, 0]) or None
    elif isinstance(part, SupportPart) and word in _POSE:
        index, _ = find_support(session, part.name)
        world = session.world
        return np.array(world.support_position(index) if word == "position" else world.support_rotation(index))
    elif isinstance(part, SupportPart) and word in _words_of(part):
        return ring_friction(session, part.name)
    elif isinstance(part, ObstaclePart) and word in ("position", "turn"):
        index = session.directory.all(ObstaclePart).index(part)
        world = session.world
        return np.array(world.obstacle_position(index) if word == "position" else world.obstacle_turn(index))
    elif isinstance(part, ObstaclePart) and word in OBSTACLE_WORDS:
        return obstacle_value(session, part, word)
    words = _words_of(part)
    if not words:
        raise ValueError(_nothing_to_set(part))
    raise ValueError(f"{part.name!r} has no {word!r}; it has {', '.join(words)}")


def _set_rod(session: Session, part: RodPart, values: dict[str, Any]) -> None:
    _only(values, _SET_ROD, part.owner)
    before = parameters = session.settings.rods[part.index]
    natural = {}
    for word, value in values.items():
        if word == "natural_curvature":
            natural[word] = curvature_given(value, len(part.voronoi), part.owner)
        elif word == "natural_twist":
            natural[word] = twist_array(value, part.voronoi, part.owner)
        elif word == "natural_stretch":
            natural[word] = stretch_array(value, len(part.lengths), part.owner)
        else:
            parameters = parameters.with_value(word, value, part.section, part.owner)
    session.world.set(part.index, natural if parameters is before else parameters.acting(before) | natural)
    session.settings.rods[part.index] = parameters


def _set_fluid(session: Session, part: FluidPart, values: dict[str, Any]) -> None:
    numbers = {word: validation.positive(value, f"{word} of {part.name!r}") for word, value in values.items()}
    if "regularization" in numbers and part.model != "stokeslets":
        raise ValueError(f"regularization of {part.name!r} needs model='stokeslets', got model={part.model!r}")
    session.world.set(0, {f"fluid_{word}": number for word, number in numbers.items()})
    if "viscosity" in numbers:
        session.settings.fluids = session.settings.fluids | {part.name: numbers["viscosity"]}


def _set_drag(session: Session, part: DragPart, coefficient: float) -> None:
    drags = session.settings.drags | {part.name: coefficient}
    for rod in session.directory.all(RodPart):
        if part.rods is None or rod.index in part.rods:
            _set_rod(session, rod, {"drag": drag(session.directory, drags, rod)})
    session.settings.drags = drags


def _words_of(part: Part) -> tuple[str, ...]:
    """The words of `get` that a part takes."""
    if isinstance(part, RodPart):
        return (*ROD_WORDS, *NATURAL_WORDS, "radius")
    if isinstance(part, LoadPart):
        return (part.kind,)
    if isinstance(part, SupportPart):
        rubs = part.grasp is not None and part.grasp.slides and part.grasp.feed_rate is None
        return (*_POSE, "friction") if rubs else _POSE
    if isinstance(part, JoinPart):
        return JOINT_WORDS if part.axis is not None else ()
    words: dict[type[Any], tuple[str, ...]] = {
        MassPart: ("mass",),
        SpringPart: SPRING_WORDS,
        TendonPart: ("tension",),
        DragPart: ("drag",),
        FluidPart: _FLUID,
        ObstaclePart: (*OBSTACLE_WORDS, "position", "turn"),
    }
    return words.get(type(part), ())


_SETTABLE = (
    "set takes rods (youngs_modulus, natural_curvature, ...), loads (force, moment, load), masses (mass), "
    "springs (stiffness, rest_length, damping), tendons (tension), revolute joints (stiffness, rest_angle, damping, "
    "moment), drags (drag), fluids (viscosity, regularization), obstacles (friction, rolling_friction, restitution), "
    "supports (position, rotation; of rings friction), and None for the scene "
    "(gravity, friction, slip_tolerance, restitution, contact_stiffness)"
)


def _nothing_to_set(part: Part) -> str:
    """Return a hint on how to drive a part that has nothing to set."""
    if isinstance(part, JoinPart):
        first, second = part.node_names
        return (
            f"joint {part.name!r} is {part.kind} and has nothing to set: only revolute joints have a motor, a spring "
            f"and a damper. To drive the joint, add opposite moments, scene.add_moment({first}, ...) and "
            f"scene.add_moment({second}, ...), and change them by set(load, moment=...). Or actuate a rod beside it by "
            "set_natural_curvature, or clamp its node and move the clamp"
        )
    return f"{part.name!r} has nothing to set. {_SETTABLE}"


def _only(values: dict[str, Any], words: tuple[str, ...], owner: str) -> None:
    for word in values:
        if word not in words:
            raise ValueError(f"{owner} has no {word!r} to set; it has {', '.join(words)}")
