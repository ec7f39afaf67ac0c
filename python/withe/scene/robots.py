"""Robots of a scene: bodies and joints from files."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.user_warnings import warn
from withe.errors import PlausibilityWarning, UnsupportedRobotWarning
from withe.parts.bodies import make_body
from withe.parts.handles import Body, BodyPoint, Joint, Support, parse_place, parse_point
from withe.robots import RobotDescription, RobotJoint, read_robot

__all__ = ["Robot", "add_robot"]

FloatArray = npt.NDArray[np.float64]

# Size [m] and mass of a body [kg] above which the unit of the file is probably not SI.
_LARGEST_SIZE = 20.0
_LARGEST_MASS = 1e4
# Difference of gravity [m/s^2] that is not reported: USD has numbers of single precision.
_EQUAL_GRAVITY = 1e-6


@dataclass(frozen=True, eq=False)
class Robot:
    """Bodies and joints of a robot in a scene, made by `Scene.add_robot`.

    ``robot["gripper"]`` is the body, joint or point of that name in the file.

    Attributes
    ----------
    name : str
    bodies : mapping of str to Body
        Bodies by their names in the file. Bodies of the file that are fixed to each other are one body of the scene,
        which has all of their names.
    joints : mapping of str to Joint or Support
        Joints by their names in the file. Joints to the world are supports, unless they carry a spring, damper or
        motor, or the robot has a fixed body.
    points : mapping of str to BodyPoint
        Sites of the file, and the origins of its bodies, as points of the bodies of the scene.

    Examples
    --------
    >>> robot = scene.add_robot("arm.xml")  # doctest: +SKIP
    >>> scene.join(cable.start, robot["gripper"])  # doctest: +SKIP
    """

    name: str
    bodies: Mapping[str, Body] = field(repr=False)
    joints: Mapping[str, Joint | Support] = field(repr=False)
    points: Mapping[str, BodyPoint] = field(repr=False)

    def __getitem__(self, name: str) -> Any:
        """Return the body, joint or point of a name in the file, in this order.

        Raises
        ------
        ValueError
            The file has no such name.
        """
        for found in (self.bodies, self.joints, self.points):
            if name in found:
                return found[name]
        known = list(dict.fromkeys([*self.bodies, *self.joints, *self.points]))
        hint = validation.meant(str(name), known, f"it has {', '.join(map(repr, known[:12]))}")
        raise ValueError(f"robot {self.name!r} has no {name!r:.80}; {hint}")


def add_robot(
    scene: Any,
    path: str | os.PathLike[str],
    position: npt.ArrayLike,
    rotation: npt.ArrayLike | None,
    name: str | None,
) -> Robot:
    """Add a robot from a file; see `Scene.add_robot`."""
    origin = validation.vector(position, "position of the robot")
    axes = np.eye(3) if rotation is None else validation.rotation_matrix(rotation, "rotation of the robot")
    if name is not None and (not isinstance(name, str) or not name or not name.isprintable()):
        raise ValueError(f"name of the robot must be printable text, got {name!r:.80}")
    description = read_robot(path)
    for body in description.bodies:  # checked before one is added
        make_body(
            body.names[0], 0, body.solid, None, body.mass, body.inertia, body.center, body.position, body.rotation
        )
    own = description.name if name is None else name
    _warn(scene, path, description)
    taken = set(scene._directory.parts)

    def new_name(of_file: str, word: str) -> str:
        found = _new_name(of_file, own, word, taken)
        taken.add(found)
        return found

    bodies = [
        scene.add_body(
            body.solid,
            touches=False,
            mass=body.mass,
            inertia=body.inertia,
            center=body.center,
            position=origin + axes @ body.position,
            rotation=axes @ body.rotation,
            name=new_name(body.names[0], "body"),
        )
        for body in description.bodies
    ]
    for handle, body in zip(bodies, description.bodies, strict=True):
        if body.is_fixed:
            scene.clamp(handle, name=new_name(f"{handle.name} clamp", "clamp"))
    joints = {}
    for joint in description.joints:
        at = origin + axes @ joint.at
        axis = None if joint.axis is None else axes @ joint.axis
        joints[joint.name] = _add_joint(scene, bodies, joint, at, axis, new_name(joint.name, "joint"))
    points = {each: bodies[index].at(origin + axes @ place) for each, (index, place) in description.points.items()}
    names = {each: bodies[i] for i, body in enumerate(description.bodies) if not body.is_between for each in body.names}
    return Robot(own, MappingProxyType(names), MappingProxyType(joints), MappingProxyType(points))


def _add_joint(
    scene: Any, bodies: list[Body], joint: RobotJoint, at: FloatArray, axis: FloatArray | None, name: str
) -> Joint | Support:
    child = bodies[joint.child]
    if joint.parent is not None:
        own = ("stiffness", "rest_angle", "damping", "limits", "limit_stiffness", "max_torque", "max_speed")
        words = {} if axis is None else {word: getattr(joint, word) for word in own}
        found: Joint = scene.join(bodies[joint.parent], child, joint.kind, at=at, axis=axis, name=name, **words)
        return found
    hold: Callable[..., Support] = scene.pin if joint.kind == "pinned" else scene.clamp
    words = {"pinned": {}, "revolute": {"spin": axis}, "sliding": {"free": axis}}[joint.kind]
    return hold(child, at=at, name=name, **words)


def _new_name(of_file: str, robot: str, word: str, taken: set[str]) -> str:
    """Return a name that the scene does not have, which is the one of the file if possible."""
    plain = "".join(letter if letter.isprintable() else "_" for letter in of_file)
    if parse_place(plain) is not None or parse_point(plain) is not None:  # names of nodes have dots
        plain = plain.replace(".", "_")
    candidates = (plain, f"{robot} {plain}", f"{robot} {word} {plain}")
    free = next((each for each in candidates if each not in taken), None)
    number = 2
    while free is None:
        free = f"{robot} {number} {plain}"
        if free in taken:
            free = None
        number += 1
    return free


def _warn(scene: Any, path: str | os.PathLike[str], description: RobotDescription) -> None:
    heavy = [body.names[0] for body in description.bodies if body.mass > _LARGEST_MASS]
    if description.size > _LARGEST_SIZE or heavy:
        what = f"has a size of {description.size:.3g} m" if not heavy else f"has the body {heavy[0]!r} of "
        if heavy:
            what += f"{max(body.mass for body in description.bodies):.3g} kg"
        warn(
            f"robot {description.name!r} {what}, so its unit is probably not SI. Units are m, kg and s: give meshes in "
            "mm the scale 0.001",
            PlausibilityWarning,
            "size of a robot",
        )
    for doubt in description.doubts:
        warn(f"robot {description.name!r} {doubt}", PlausibilityWarning, "units of a robot")
    unsupported = list(description.unsupported)
    gravity = description.gravity
    if gravity is not None and np.abs(gravity - scene.gravity).max() > _EQUAL_GRAVITY:
        unsupported.append(f"gravity {tuple(gravity.tolist())} m/s^2, because that of the scene is used")
    if unsupported:
        content = "".join(f"\n- {each}" for each in unsupported)
        warn(
            f"robot {description.name!r} has content that withe does not support. The robot of {os.fspath(path)} has "
            f"been added without:{content}",
            UnsupportedRobotWarning,
            description.name,
        )
