"""Hands a scene to the engine: the parts of a directory as the plain arrays of `_core`."""

from __future__ import annotations

from typing import cast

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.parts.bodies import describe_bodies
from withe.parts.body_surfaces import check_surfaces, describe_surfaces
from withe.parts.contacts import describe_contact
from withe.parts.directory import Directory
from withe.parts.fluid import describe_fluid
from withe.parts.hands import check_free
from withe.parts.joints import describe_joint, groups
from withe.parts.kinds import (
    BodyPart,
    CustomForcePart,
    DragPart,
    Grasp,
    JoinPart,
    LoadPart,
    MassPart,
    Pass,
    RodPart,
    SupportPart,
    TendonPart,
)
from withe.parts.loops import describe_loops
from withe.parts.obstacle_shapes import check_channels
from withe.parts.options import Bending
from withe.parts.parameters import RodParameters
from withe.parts.springs import describe_springs
from withe.parts.supports import held_rows
from withe.parts.table import KINDS

__all__ = ["added_mass", "describe", "describe_load", "describe_support", "drag", "parameters_of"]

FloatArray = npt.NDArray[np.float64]


def describe(directory: Directory, gravity: FloatArray, bending: Bending = "angle") -> _core.SceneDescription:
    """The whole scene.

    Raises
    ------
    ValueError
        A scene without rods, or two supports, or a spring, at nodes that were joined later.
    """
    rods = directory.all(RodPart)
    if not rods and not directory.all(BodyPart):
        raise ValueError("the scene must have at least one rod: add one with add_rod")
    scene = _core.SceneDescription()
    positions = np.empty((directory.layout.node_count, 3))
    for body, points in enumerate(directory.layout.body_points):
        positions[directory.layout.rows(-1 - body)] = points
    for rod in reversed(rods):  # the first rod at a shared node places it
        positions[directory.layout.rows(rod.index)] = rod.points
    scene.positions = positions
    scene.gravity = gravity
    scene.bending = bending
    scene.added_mass = added_mass(directory, {mass.name: mass.mass for mass in directory.all(MassPart)})
    coefficients = {part.name: part.coefficient for part in directory.all(DragPart)}
    scene.rods = [_describe_rod(directory, rod, drag(directory, coefficients, rod)) for rod in rods]
    check_surfaces(directory)
    check_channels(directory)
    scene.rods += describe_surfaces(directory)
    scene.bodies = describe_bodies(directory)
    scene.loops = describe_loops(directory)
    scene.joints = [describe_joint(group) for group in groups(directory.all(JoinPart))]
    scene.supports = _describe_supports(directory)
    scene.loads = [describe_load(directory, load) for load in directory.all(LoadPart)]
    scene.springs = describe_springs(directory)
    scene.tendons = [_describe_tendon(directory, part) for part in directory.all(TendonPart)]
    for kind in KINDS:
        if kind.described is not None:
            word, describe_part = kind.described
            setattr(scene, word, [describe_part(part) for part in directory.all(kind.part)])
    custom = directory.all(CustomForcePart)
    scene.has_custom_force = bool(custom)
    scene.custom_implicit = any(part.jacobian is not None for part in custom)
    scene.custom_moments = any(part.moments for part in custom)
    scene.contact = describe_contact(directory)
    scene.fluid = describe_fluid(directory)
    return scene


def added_mass(directory: Directory, masses: dict[str, float]) -> FloatArray:
    """Point masses of every node of the scene [kg], from the present mass of each part."""
    total = np.zeros(directory.layout.node_count)
    for part in directory.all(MassPart):
        total[directory.row(part.node)] += masses[part.name]
    for body in directory.all(BodyPart):
        total[directory.row((-1 - body.index, 0))] += body.mass
    return total


def drag(directory: Directory, coefficients: dict[str, float], rod: RodPart) -> float:
    """Drag of a rod [Pa s], the sum of all parts that act on it."""
    # By name: a look through all parts for every rod would take most of the time of a build.
    found = [(cast(DragPart, directory.parts[name]), value) for name, value in coefficients.items()]
    return sum(
        (value for part, value in found if part.rods is None or rod.index in part.rods),
        0.0,
    )


def parameters_of(directory: Directory) -> list[RodParameters]:
    """Parameters of all rods as described, drag included."""
    coefficients = {part.name: part.coefficient for part in directory.all(DragPart)}
    return [
        rod.parameters.changed("drag", drag(directory, coefficients, rod), rod.section, rod.owner)
        for rod in directory.all(RodPart)
    ]


def describe_support(directory: Directory, part: SupportPart) -> _core.SupportDescription:
    """One support."""
    support = _core.SupportDescription()
    support.kind = part.kind
    support.pass_ = _pass(directory, part.node)
    if part.axis is not None:
        support.axis = part.axis
    support.free = part.free
    if part.grasp is not None:
        support.hand = _describe_hand(part.grasp)
        if part.grasp.by is not None:
            support.hand.node = directory.row(part.grasp.by)
    return support


def _pass(directory: Directory, node: Pass) -> _core.RodPass:
    """A node as the engine takes it: a point of a body by its row."""
    return _core.RodPass(node[0], directory.row(node) if node[0] < 0 else node[1])


def _describe_hand(grasp: Grasp) -> _core.HandDescription:
    hand = _core.HandDescription()
    hand.at, hand.length = grasp.at, grasp.length
    if grasp.pose is not None:
        hand.posed = True
        hand.position, hand.rotation = grasp.pose
    if grasp.stiffness is not None:
        hand.yields = True
        hand.stiffness = grasp.stiffness.tolist()
        hand.force_limit = grasp.force_limit
    hand.slides, hand.friction = grasp.slides, grasp.friction
    if grasp.feed_rate is not None:
        hand.feeds, hand.feed_rate = True, grasp.feed_rate
    return hand


def _describe_rod(directory: Directory, rod: RodPart, coefficient: float) -> _core.RodDescription:
    description = _core.RodDescription()
    description.name = rod.name
    description.nodes = directory.layout.rows(rod.index).tolist()
    description.closed = rod.closed
    description.directors = rod.directors
    description.rest_lengths = rod.lengths
    description.arc_lengths = rod.arcs
    description.natural_curvature = rod.natural_curvature
    description.natural_twist = rod.natural_twist
    description.contact_radius = rod.contact_radius
    description.fluid_radius = rod.section.radii
    if rod.parameters.youngs_modulus is not None:
        description.fibre_distance = rod.section.fibres
    _fill(description, rod.parameters.changed("drag", coefficient, rod.section, rod.owner))
    return description


def _fill(description: _core.RodDescription, parameters: RodParameters) -> None:
    description.stretch_stiffness = parameters.stretch_stiffness
    description.bend_stiffness = parameters.bend_stiffness
    description.twist_stiffness = parameters.twist_stiffness
    description.line_density = parameters.line_density
    description.rotary_inertia = parameters.rotary_inertia
    description.viscous_time = parameters.viscous_time
    description.drag = parameters.drag


def _describe_supports(directory: Directory) -> list[_core.SupportDescription]:
    holder: dict[int, SupportPart] = {}
    hands = [part for part in directory.all(SupportPart) if part.grasp is not None]
    for hand in hands:  # rods may have been joined since
        check_free(directory, hand, [part for part in directory.all(SupportPart) if part is not hand])
    for part in directory.all(SupportPart):
        if part.grasp is not None:
            continue
        for row in held_rows(directory, part):
            other = holder.setdefault(row, part)
            if other is not part:
                raise ValueError(_held_twice(directory, other, part))
    return [describe_support(directory, part) for part in directory.all(SupportPart)]


def _held_twice(directory: Directory, first: SupportPart, second: SupportPart) -> str:
    if directory.row(first.node) == directory.row(second.node):
        return (
            f"joined nodes {first.node_name!r} and {second.node_name!r} must have one support, got both "
            f"{first.name!r} and {second.name!r}: remove one of the supports"
        )
    return (
        f"{first.name!r} at {first.node_name!r} and {second.name!r} at {second.node_name!r} hold the same node, "
        "because rods were joined (hold='edge' holds both nodes of an edge): remove one of the supports"
    )


def _describe_tendon(directory: Directory, part: TendonPart) -> _core.TendonDescription:
    guides = [(rod, edge if rod >= 0 else directory.row((rod, edge)), place) for rod, edge, place in part.guides]
    return _core.TendonDescription(guides, part.offsets, part.tension)


def describe_load(directory: Directory, part: LoadPart) -> _core.LoadDescription:
    """One load."""
    load = _core.LoadDescription()
    load.kind = "distributed" if part.kind == "load" else part.kind
    load.pass_ = _pass(directory, part.node)
    load.values = np.atleast_2d(part.value)
    load.follower = part.follower
    load.varies = part.function is not None
    return load
