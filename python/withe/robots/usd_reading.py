"""From a USD stage to the description of a robot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.robots.composing import MassProperties, free_place, massless_base, united
from withe.robots.description import RobotBody, RobotDescription, RobotJoint
from withe.robots.shapes import Shape, combined
from withe.robots.unsupported import listed
from withe.robots.usd_joints import UsdJoint, joint_of, unsupported_of_joint
from withe.robots.usd_masses import StageUnits, UsdShape, mass_properties, shape_of, world_axes

__all__ = ["USD_SUFFIXES", "read_usd"]

FloatArray = npt.NDArray[np.float64]

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_WORLD = -1
# Turn of a stage whose up axis is y.
_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_GRAVITY = 9.81  # [m/s^2], of UsdPhysics where a stage states none
_OTHER_SCHEMAS = ("Physx", "Newton", "Mjc")
"""Beginnings of the names of schemas that extend UsdPhysics."""


def read_usd(path: Path) -> RobotDescription:
    """Read a robot from a stage with the schemas of UsdPhysics.

    Raises
    ------
    ValueError
        No rigid body, a body without mass and colliders, mirrored axes of a body, or frames of a joint that are apart.
    FileNotFoundError
        The file, or one that it refers to, does not exist.
    ImportError
        The package usd-core is not installed.
    """
    if not path.is_file():
        raise FileNotFoundError(f"file of the robot does not exist: {path}")
    usd, tf = require("pxr.Usd", "robots"), require("pxr.Tf", "robots")
    try:
        stage = usd.Stage.Open(str(path))
    except tf.ErrorException as error:
        raise ValueError(f"{path} is not a USD file: {' '.join(str(error).split())}") from None
    missing = [str(error) for error in stage.GetCompositionErrors()]
    if missing:
        raise FileNotFoundError(f"{path}: a file that the stage refers to cannot be read: {missing[0]}")
    return _Reader(stage, path).description()


class _Reader:
    """Reader of one stage, at its default time."""

    def __init__(self, stage: Any, path: Path) -> None:
        self._stage, self._path = stage, path
        self._geometry, self._physics = require("pxr.UsdGeom", "robots"), require("pxr.UsdPhysics", "robots")
        up = str(self._geometry.GetStageUpAxis(stage))
        self._units = StageUnits(
            float(self._geometry.GetStageMetersPerUnit(stage)),
            float(self._physics.GetStageKilogramsPerUnit(stage)),
            _Y_UP if up == "Y" else np.eye(3),
        )
        usd = require("pxr.Usd", "robots")
        self._prims = list(usd.PrimRange.Stage(stage, usd.TraverseInstanceProxies()))
        self._bodies = [prim for prim in self._prims if self._is_body(prim)]
        self._index = {prim.GetPath(): i for i, prim in enumerate(self._bodies)}
        self._noted: dict[str, list[str]] = {}

    def description(self) -> RobotDescription:
        """Return the bodies, joints and points, and the content that they lack."""
        if not self._bodies:
            raise ValueError(f"{self._path} must have a rigid body (PhysicsRigidBodyAPI), got none")
        self._names = self._unique_names(self._bodies)
        shapes = self._shapes()
        joints = self._find_joints(self._extent([shape for own in shapes.values() for shape in own]))
        labels, moving_joints = self._tree(joints)
        self._note_content()
        self._note_contact(joints, labels)
        tops = sorted(set(labels) - {_WORLD})
        has_base = _WORLD in labels or any(
            None in joint.bodies and (joint.stiffness or joint.damping) for joint in moving_joints
        )
        numbers = {top: i + has_base for i, top in enumerate(tops)}
        if has_base:
            numbers[_WORLD] = 0
        properties = self._properties(shapes)
        moving = sum(part.mass for part, label in zip(properties, labels, strict=True) if part and label != _WORLD)
        bodies = []
        for top in sorted(numbers, key=lambda top: numbers[top]):
            members = [i for i, label in enumerate(labels) if label == top]
            bodies.append(self._body(members, properties, shapes, moving, top == _WORLD))
        found = self._joints(moving_joints, labels, numbers)
        points = {
            self._names[i]: (numbers[label], world_axes(self._bodies[i], self._units)[1])
            for i, label in enumerate(labels)
        }
        for name, prim, body in self._frames():
            points.setdefault(name, (numbers[labels[body]], world_axes(prim, self._units)[1]))
        unsupported = tuple(f"{what} {listed(names)}" if names else what for what, names in self._noted.items())
        doubts: tuple[str, ...] = ()
        if not self._geometry.StageHasAuthoredMetersPerUnit(self._stage):
            doubts = (
                "has no metersPerUnit, so its unit is 0.01 m, as USD defines. Write metersPerUnit = 1 if it is in m",
            )
        return RobotDescription(
            self._name(), tuple(bodies), found, points, self._size, self._gravity(), unsupported, doubts
        )

    def _name(self) -> str:
        default = self._stage.GetDefaultPrim()
        return str(default.GetName()) if default else self._path.stem

    def _is_body(self, prim: Any) -> bool:
        if not prim.HasAPI(self._physics.RigidBodyAPI):
            return False
        return bool(self._physics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get())

    def _body_at(self, prim: Any) -> int | None:
        """Return the index of the body that a prim is, or is a part of; None for the world."""
        while prim and prim.GetPath() not in self._index:
            prim = prim.GetParent()
        return self._index[prim.GetPath()] if prim else None

    def _unique_names(self, prims: Iterable[Any]) -> list[str]:
        """Return the name of each prim, or its path if another one has its name."""
        prims = list(prims)
        names = [str(prim.GetName()) for prim in prims]
        return [str(p.GetPath()) if names.count(name) > 1 else name for p, name in zip(prims, names, strict=True)]

    def _note(self, what: str, *names: str) -> None:
        self._noted.setdefault(what, []).extend(names)

    def _shapes(self) -> dict[int, list[UsdShape]]:
        """Return the shapes of each body, and note those of the world."""
        found: dict[int, list[UsdShape]] = {i: [] for i in range(len(self._bodies))}
        for prim in self._prims:
            if not prim.IsA(self._geometry.Gprim):
                continue
            name, is_collider = str(prim.GetName()), prim.HasAPI(self._physics.CollisionAPI)
            body = self._body_at(prim)
            if body is None:
                if is_collider:
                    self._note("colliders of the world", name)
                continue
            shape = shape_of(prim, self._units)
            if shape is None:
                self._note("shapes of prims", name)
                continue
            if shape.is_hull:
                self._note("surfaces that are not closed, and are replaced by convex hulls, of meshes", name)
            found[body].append(shape)
        return found

    def _extent(self, shapes: Iterable[UsdShape]) -> float:
        """Return the diagonal of the box around the origins and shapes of the bodies."""
        points = [world_axes(prim, self._units)[1][None] for prim in self._bodies]
        points += [each.shape.surface[0] @ each.shape.turn.T + each.shape.place for each in shapes]
        self._size = float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))
        return self._size

    def _find_joints(self, size: float) -> list[UsdJoint]:
        """Return the joints, those outside of articulations last."""
        found = []
        for prim in self._prims:
            if not prim.IsA(self._physics.Joint):
                continue
            joint = self._physics.Joint(prim)
            name = str(prim.GetName())
            if not joint.GetJointEnabledAttr().Get():
                self._note("disabled joints", name)
                continue
            for what in unsupported_of_joint(prim):
                self._note(what, name)
            found.append(joint_of(prim, self._body_at, self._units, size))
        joints = [joint for joint in found if joint is not None]
        return sorted(joints, key=lambda joint: bool(joint.prim.GetAttribute("physics:excludeFromArticulation").Get()))

    def _tree(self, joints: list[UsdJoint]) -> tuple[list[int], list[UsdJoint]]:
        """Return the first of the bodies to which each body is fixed, and the joints that move.

        Bodies that are fixed to the world have the label of the world. Joints that close a loop are noted.
        """
        kinematic = [bool(self._physics.RigidBodyAPI(prim).GetKinematicEnabledAttr().Get()) for prim in self._bodies]
        for name, is_moved in zip(self._names, kinematic, strict=True):
            if is_moved:
                self._note("motion of kinematic bodies, which are fixed,", name)
        labels = [_WORLD if is_moved else i for i, is_moved in enumerate(kinematic)]

        def label(body: int | None) -> int:
            return _WORLD if body is None else labels[body]

        for joint in joints:
            if joint.kind == "fixed":
                first, second = sorted(label(body) for body in joint.bodies)
                labels = [first if each == second else each for each in labels]
        connected = list(labels)  # by moving joints too
        kept = []
        for joint in joints:
            if joint.kind == "fixed":
                continue
            ends = [_WORLD if body is None else connected[body] for body in joint.bodies]
            if ends[0] == ends[1]:
                self._note("closed loops by joints", str(joint.prim.GetName()))
                continue
            connected = [min(ends) if each in ends else each for each in connected]
            kept.append(joint)
        return labels, kept

    def _properties(self, shapes: dict[int, list[UsdShape]]) -> list[MassProperties | None]:
        """Return the mass properties of each body; None for a body without mass."""
        found = []
        for i, prim in enumerate(self._bodies):
            matrix, _ = world_axes(prim, self._units)
            if np.linalg.det(matrix) <= 0.0:
                raise ValueError(f"axes of body {prim.GetPath()} must not be mirrored: give it a positive scale")
            colliders = [shape for shape in shapes[i] if shape.prim.HasAPI(self._physics.CollisionAPI)]
            found.append(mass_properties(prim, colliders, self._units))
        return found

    def _body(
        self,
        members: list[int],
        properties: list[MassProperties | None],
        shapes: dict[int, list[UsdShape]],
        moving: float,
        is_fixed: bool,
    ) -> RobotBody:
        """Return the composite body of some bodies that are fixed to each other."""
        position, rotation = np.zeros(3), np.eye(3)
        if members:
            matrix, position = world_axes(self._bodies[members[0]], self._units)
            rotation = matrix / np.linalg.norm(matrix, axis=0)
        whole = united([part for i in members if (part := properties[i]) is not None])
        names = tuple(self._names[i] for i in members) or ("base",)
        if whole is None:
            if not is_fixed:
                raise ValueError(
                    f"{self._path}: body {names[0]!r} has neither a mass (PhysicsMassAPI) nor a collider: add one"
                )
            whole = massless_base(position, moving, self._size)
        own = whole.seen_from(position, rotation)
        mine = [shape for i in members for shape in shapes[i]]
        visual = [shape for shape in mine if not shape.prim.HasAPI(self._physics.CollisionAPI)]
        drawn = [
            Shape(
                each.shape.solid,
                each.shape.surface,
                rotation.T @ (each.shape.place - position),
                rotation.T @ each.shape.turn,
            )
            for each in visual or mine
        ]
        return RobotBody(names, own.mass, own.center, own.inertia, position, rotation, combined(drawn), is_fixed)

    def _joints(self, joints: list[UsdJoint], labels: list[int], numbers: dict[int, int]) -> tuple[RobotJoint, ...]:
        names = self._unique_names(joint.prim for joint in joints)
        used: dict[int, list[FloatArray]] = {}  # positions of joints by body
        found = []
        for name, joint in zip(names, joints, strict=True):
            parent, child = (numbers.get(_WORLD if body is None else labels[body]) for body in joint.bodies)
            axis, rest = joint.axis, joint.rest_angle
            if child is None or (
                child == numbers.get(_WORLD) and parent is not None
            ):  # the child is the one that moves
                parent, child = child, parent
                axis = None if axis is None else -axis
            owners = [body for body in (parent, child) if body is not None]
            taken = [point for owner in owners for point in used.get(owner, [])]
            at = joint.at if axis is None else free_place(joint.at, axis, taken, self._size)
            for owner in owners:
                used.setdefault(owner, []).append(at)
            assert child is not None
            assert joint.kind != "fixed"  # `_tree` leaves these joints out
            spring = (joint.stiffness, rest, joint.damping)
            found.append(RobotJoint(name, joint.kind, parent, child, at, axis, *spring, max_torque=joint.max_torque))
        return tuple(found)

    def _frames(self) -> Iterator[tuple[str, Any, int]]:
        """Yield the name, prim and body of each frame of a body: a transform without shapes."""
        for prim in self._prims:
            if str(prim.GetTypeName()) != "Xform" or prim.GetPath() in self._index or prim.GetChildren():
                continue
            body = self._body_at(prim)
            if body is not None:
                yield str(prim.GetName()), prim, body

    def _gravity(self) -> FloatArray | None:
        """Return the acceleration of free fall [m/s^2]; None if the stage has no physics scene."""
        scene = next((prim for prim in self._prims if prim.IsA(self._physics.Scene)), None)
        if scene is None:
            return None
        words = self._physics.Scene(scene)
        direction = np.array(words.GetGravityDirectionAttr().Get(), dtype=float)
        # A number of single precision, by its shortest decimal form: 9.81 instead of 9.8100004.
        magnitude = float(str(np.float32(words.GetGravityMagnitudeAttr().Get())))
        size = magnitude * self._units.length if np.isfinite(magnitude) and magnitude >= 0.0 else _GRAVITY
        if not direction.any():
            return np.array([0.0, 0.0, -size])
        return np.asarray(size * self._units.upright @ direction / np.linalg.norm(direction))

    def _note_content(self) -> None:
        """Note what the stage has besides bodies, shapes and joints."""
        for prim in self._prims:
            name = str(prim.GetName())
            for schema in prim.GetPrimTypeInfo().GetAppliedAPISchemas():  # with those that usd-core lacks
                if str(schema).startswith(_OTHER_SCHEMAS):
                    self._note(f"schema {schema} of prims", name)
            if str(prim.GetTypeName()).startswith(_OTHER_SCHEMAS):
                self._note(f"prims of type {prim.GetTypeName()}", name)
            if prim.GetPath() in self._index:
                body = self._physics.RigidBodyAPI(prim)
                speeds = [body.GetVelocityAttr().Get(), body.GetAngularVelocityAttr().Get()]
                if any(value is not None and any(value) for value in speeds):
                    self._note("initial velocities of bodies", name)
                if self._geometry.Xformable(prim).TransformMightBeTimeVarying():
                    self._note("animation of bodies", name)

    def _note_contact(self, joints: list[UsdJoint], labels: list[int]) -> None:
        """Note two bodies that may touch. Joined bodies do not, unless `collisionEnabled` of the joint is true."""
        own = {self._body_at(prim) for prim in self._prims if prim.HasAPI(self._physics.CollisionAPI)}
        colliding = sorted(body for body in own if body is not None)
        joined = {
            frozenset(joint.bodies) for joint in joints if not joint.prim.GetAttribute("physics:collisionEnabled").Get()
        }
        for i, first in enumerate(colliding):
            others: list[int | None] = [*colliding[i + 1 :]]
            for second in [*others, None] if None in own else others:
                label = _WORLD if second is None else labels[second]
                if frozenset((first, second)) not in joined and label != labels[first]:
                    other = "world" if second is None else self._names[second]
                    self._note(f"contact of bodies, such as {self._names[first]!r} with {other!r}")
                    return
