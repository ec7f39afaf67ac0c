"""From a compiled model of MuJoCo to the description of a robot."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.robots.composing import MassProperties, free_place, massless_base, united
from withe.robots.description import RobotBody, RobotDescription, RobotJoint
from withe.robots.files import CompiledRobot, compiled
from withe.robots.mujoco_joints import BALL, FREE, HINGE, SLIDE, greatest_torque, has_force_limit, stops_of
from withe.robots.mujoco_loops import connections
from withe.robots.names import name_of
from withe.robots.shapes import drawn_geoms, solid_of
from withe.robots.unsupported import listed, unsupported_content
from withe.robots.usd_reading import USD_SUFFIXES, read_usd
from withe.solids import Sphere

__all__ = ["read_robot"]

FloatArray = npt.NDArray[np.float64]

_KINDS: dict[int, Literal["pinned", "sliding", "revolute"]] = {BALL: "pinned", SLIDE: "sliding", HINGE: "revolute"}

# Mass of a body between two joints of one body, over that of this body, and its radius of gyration over the size of
# the robot. Motion changes by about this ratio. Rounding of energies grows as its inverse.
_BETWEEN_MASS_RATIO = 1e-8
_BETWEEN_RADIUS = 0.05
# Radius of its ball in pictures, over the size of the robot.
_BETWEEN_DRAWN = 1e-3

# Smallest singular value of the motions by the joints of one body, over the largest one. Below it, two combinations
# of the joints move the body alike, so that the inertia of the body does not determine their accelerations.
_DISTINCT_MOTIONS = 1e-6


def read_robot(path: str | os.PathLike[str]) -> RobotDescription:
    """Read a robot from a URDF, MJCF or USD file.

    Raises
    ------
    ValueError
        Another suffix, a file that MuJoCo or `read_usd` refuses, or joints of one body that move it alike.
    FileNotFoundError
        The file, or a mesh of it, does not exist.
    ImportError
        MuJoCo or usd-core is not installed.
    """
    if Path(path).suffix.lower() in USD_SUFFIXES:
        return read_usd(Path(path))
    robot = compiled(Path(path))
    mujoco = require("mujoco", "robots")
    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = model.qpos0
    mujoco.mj_forward(model, data)
    return _Reader(robot, data, Path(path)).description()


class _Reader:
    """Reader of one model in its reference configuration."""

    def __init__(self, robot: CompiledRobot, data: Any, path: Path) -> None:
        self._robot, self._model, self._data, self._path = robot, robot.model, data, path
        self._weld = np.asarray(robot.model.body_weldid, dtype=int)
        self._unsupported: list[str] = []

    def description(self) -> RobotDescription:
        """Return the bodies, joints and points, and the content that they lack."""
        if self._model.nbody < 2:
            raise ValueError(f"{self._path} must have a body, got none")
        model = self._model
        groups = {top: np.nonzero(self._weld == top)[0].tolist() for top in sorted(set(self._weld.tolist()))}
        groups[0].remove(0)
        self._size = self._extent()
        self._connections = connections(model, self._data, self._size)
        self._unsupported += unsupported_content(model, {each.equality for each in self._connections})
        moving = float(np.asarray(model.body_mass)[self._weld != 0].sum())
        has_base = bool(groups[0]) or any(self._needs_base(joint) for joint in range(model.njnt))
        has_base = has_base or any(self._weld[body] == 0 for each in self._connections for body in each.bodies)
        if not has_base:
            del groups[0]
        numbers = {top: i for i, top in enumerate(groups)}
        bodies = [self._body(top, members, moving) for top, members in groups.items()]
        joints = self._joints(numbers, bodies)
        points = {}
        for body in range(1, model.nbody):
            points[name_of(model, "body", body)] = (numbers[self._weld[body]], np.array(self._data.xpos[body]))
        for site in range(model.nsite):
            top = int(self._weld[model.site_bodyid[site]])
            if top in numbers:
                points[name_of(model, "site", site)] = (numbers[top], np.array(self._data.site_xpos[site]))
        gravity = np.array(model.opt.gravity, dtype=float) if self._robot.has_gravity else None
        unsupported = (*self._unsupported, *self._robot.ignored)
        return RobotDescription(self._robot.name, tuple(bodies), joints, points, self._size, gravity, unsupported)

    def _needs_base(self, joint: int) -> bool:
        """Return True if a joint to the world has a spring, a damper, a motor or a limit, which supports lack."""
        model = self._model
        body, dof = int(model.jnt_bodyid[joint]), int(model.jnt_dofadr[joint])
        is_first = joint == int(model.body_jntadr[body])  # the others connect two bodies
        is_turning = model.jnt_type[joint] in (SLIDE, HINGE)
        if self._weld[model.body_parentid[body]] != 0 or not is_first or not is_turning:
            return False
        motors = np.asarray(model.actuator_trnid, dtype=int).reshape(-1, 2)[:, 0]
        transmits = np.asarray(model.actuator_trntype, dtype=int) <= 1  # mjTRN_JOINT, mjTRN_JOINTINPARENT
        limited = stops_of(model, joint)[0] is not None
        limited = limited or has_force_limit(model, joint)
        return bool(limited or model.jnt_stiffness[joint] or model.dof_damping[dof] or joint in motors[transmits])

    def _extent(self) -> float:
        """Return the diagonal of the box around bodies, joints and shapes, without the geoms of the world."""
        model, data = self._model, self._data
        points = [np.asarray(data.xpos)[1:], np.asarray(data.xipos)[1:], np.asarray(data.xanchor)]
        own = np.asarray(model.geom_bodyid, dtype=int) > 0
        radii = np.asarray(model.geom_rbound)[own, None]
        places = np.asarray(data.geom_xpos)[own]
        corners = np.concatenate([*points, places - radii / np.sqrt(3.0), places + radii / np.sqrt(3.0)])
        return float(np.linalg.norm(np.ptp(corners, axis=0)))

    def _body(self, top: int, members: Sequence[int], moving: float) -> RobotBody:
        """Return the composite body of some bodies that are fixed to each other."""
        model, data = self._model, self._data
        first = members[0] if members else 0
        position = np.array(data.xpos[first], dtype=float)
        rotation = np.array(data.xmat[first], dtype=float).reshape(3, 3)
        properties = united([self._properties(body) for body in members])
        if properties is None:
            properties = massless_base(position, moving, self._size)
        own = properties.seen_from(position, rotation)
        geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in members]
        drawn, missing = drawn_geoms(model, geoms)
        solid, hulls = solid_of(model, data, drawn, position, rotation)
        if missing:
            self._note("shapes of geoms", (name_of(model, "geom", geom) for geom in missing))
        if hulls:
            meshes = (name_of(model, "mesh", int(model.geom_dataid[geom])) for geom in hulls)
            self._note("surfaces that are not closed, and are drawn as convex hulls, of meshes", meshes)
        names = tuple(name_of(model, "body", body) for body in members) or ("base",)
        return RobotBody(names, own.mass, own.center, own.inertia, position, rotation, solid, top == 0)

    def _properties(self, body: int) -> MassProperties:
        """Return the mass, centre and inertia of a body of MuJoCo in the axes of the world."""
        model, data = self._model, self._data
        turn = np.array(data.ximat[body], dtype=float).reshape(3, 3)
        inertia = (turn * model.body_inertia[body]) @ turn.T
        return MassProperties(float(model.body_mass[body]), np.array(data.xipos[body], dtype=float), inertia)

    def _note(self, what: str, names: Any) -> None:
        self._unsupported.append(f"{what} {listed(names)}")

    def _joints(self, numbers: dict[int, int], bodies: list[RobotBody]) -> tuple[RobotJoint, ...]:
        """Return the joints, and append the bodies between several joints of one body to `bodies`.

        The first joint of a body is the next to its parent, as in the kinematics of MuJoCo.
        """
        model, data = self._model, self._data
        used: dict[int, list[FloatArray]] = {}  # positions of joints by body
        found = []
        for body in np.nonzero(np.asarray(model.body_jntnum) > 0)[0].tolist():
            first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
            own = [joint for joint in range(first, first + count) if int(model.jnt_type[joint]) != FREE]
            self._check_distinct(body, own)
            outer = numbers[int(self._weld[body])]
            parent = numbers.get(int(self._weld[model.body_parentid[body]]))
            for joint in own:
                child = outer
                if joint != own[-1]:
                    child = len(bodies)
                    bodies.append(self._between(joint, bodies[outer]))
                kind = int(model.jnt_type[joint])
                axis = None if kind == BALL else np.array(data.xaxis[joint], dtype=float)
                at = np.array(data.xanchor[joint], dtype=float)
                owners = {child} if parent is None else {parent, child}
                taken = [point for owner in owners for point in used.get(owner, [])]
                if axis is not None:
                    at = free_place(at, axis, taken, self._size)
                for owner in owners:
                    used.setdefault(owner, []).append(at)
                name = name_of(model, "joint", joint)
                servo = (greatest_torque(model, joint), self._robot.velocities.get(name, np.inf))
                values = (*self._spring(joint), *stops_of(model, joint), *servo)
                found.append(RobotJoint(name, _KINDS[kind], parent, child, at, axis, *values))
                parent = child
        for equality, (first, second), at in self._connections:
            name = model.equality(equality).name or name_of(model, "equality", equality)
            ends = numbers[int(self._weld[first])], numbers[int(self._weld[second])]
            found.append(RobotJoint(name, "pinned", *ends, at, None))
        return tuple(found)

    def _spring(self, joint: int) -> tuple[float, float, float]:
        """Return the stiffness, the rest angle and the damping of a joint."""
        model = self._model
        if model.jnt_type[joint] == BALL:
            return 0.0, 0.0, 0.0
        place, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        stiffness = float(model.jnt_stiffness[joint])
        rest = float(model.qpos_spring[place] - model.qpos0[place]) if stiffness else 0.0
        return stiffness, rest, float(model.dof_damping[dof])

    def _between(self, joint: int, outer: RobotBody) -> RobotBody:
        """Return the body after a joint that is not the last one of its body."""
        mass = _BETWEEN_MASS_RATIO * outer.mass
        inertia = mass * (_BETWEEN_RADIUS * self._size) ** 2 * np.eye(3)
        names = (f"{outer.names[0]} after {name_of(self._model, 'joint', joint)}",)
        place = np.array(self._data.xanchor[joint], dtype=float)
        drawn = Sphere(_BETWEEN_DRAWN * self._size)
        return RobotBody(names, mass, np.zeros(3), inertia, place, np.eye(3), drawn, False, is_between=True)

    def _check_distinct(self, body: int, joints: Sequence[int]) -> None:
        """Refuse joints of one body that move it alike, such as two hinges with one axis."""
        if len(joints) < 2:
            return
        model, data = self._model, self._data
        columns: list[list[FloatArray]] = []
        for joint in joints:
            anchor = (np.array(data.xanchor[joint]) - np.array(data.xipos[body])) / self._size
            if model.jnt_type[joint] == SLIDE:
                columns.append([np.zeros(3), np.array(data.xaxis[joint])])
                continue
            axes = np.eye(3) if model.jnt_type[joint] == BALL else [np.array(data.xaxis[joint])]
            columns += [[axis, np.cross(anchor, axis)] for axis in axes]
        motions = np.reshape(columns, (-1, 6))
        values = np.linalg.svd(motions, compute_uv=False)
        if len(motions) > 6 or values[-1] < _DISTINCT_MOTIONS * values[0]:
            names = listed(name_of(model, "joint", joint) for joint in joints)
            raise ValueError(
                f"{self._path}: joints {names} of body {name_of(model, 'body', body)!r} must move it in different "
                "ways, got two that move it alike. Remove one, or give it a body of its own with a mass and an inertia"
            )
