"""From a compiled model of MuJoCo to the description of a robot."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.robots.description import RobotBody, RobotDescription, RobotJoint
from withe.robots.files import CompiledRobot, compiled
from withe.robots.names import name_of
from withe.robots.shapes import drawn_geoms, solid_of
from withe.robots.unsupported import listed, unsupported_content

__all__ = ["read_robot"]

FloatArray = npt.NDArray[np.float64]

_FREE, _BALL, _SLIDE, _HINGE = 0, 1, 2, 3
_KINDS: dict[int, Literal["pinned", "sliding", "revolute"]] = {_BALL: "pinned", _SLIDE: "sliding", _HINGE: "revolute"}

# Mass of a fixed body without a mass, over that of the robot. The body does not move, so its mass only adds a
# constant to the energy and a weight to the reaction of its clamp, which must be small.
_FIXED_MASS_RATIO = 1e-6

# Distance between joints of one body that would be at the same point, over the size of the robot. A hinge may be
# anywhere on its axis, and the position of a sliding joint has no effect.
_ANCHOR_SHIFT = 0.01


def read_robot(path: str | os.PathLike[str]) -> RobotDescription:
    """Read a robot from a URDF or MJCF file.

    Raises
    ------
    ValueError
        A suffix other than .urdf and .xml, a file that MuJoCo refuses, or several joints between two bodies.
    FileNotFoundError
        The file, or a mesh of it, does not exist.
    ImportError
        MuJoCo is not installed.
    """
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
        self._check_single_joints()
        model = self._model
        self._unsupported += unsupported_content(model)
        groups = {top: np.nonzero(self._weld == top)[0].tolist() for top in sorted(set(self._weld.tolist()))}
        groups[0].remove(0)
        self._size = self._extent()
        moving = float(np.asarray(model.body_mass)[self._weld != 0].sum())
        has_base = bool(groups[0]) or any(self._needs_base(joint) for joint in range(model.njnt))
        if not has_base:
            del groups[0]
        numbers = {top: i for i, top in enumerate(groups)}
        bodies = tuple(self._body(top, members, moving) for top, members in groups.items())
        joints = self._joints(numbers)
        points = {}
        for body in range(1, model.nbody):
            points[name_of(model, "body", body)] = (numbers[self._weld[body]], np.array(self._data.xpos[body]))
        for site in range(model.nsite):
            top = int(self._weld[model.site_bodyid[site]])
            if top in numbers:
                points[name_of(model, "site", site)] = (numbers[top], np.array(self._data.site_xpos[site]))
        gravity = np.array(model.opt.gravity, dtype=float) if self._robot.has_gravity else None
        unsupported = (*self._unsupported, *self._robot.ignored)
        return RobotDescription(self._robot.name, bodies, joints, points, self._size, gravity, unsupported)

    def _check_single_joints(self) -> None:
        model = self._model
        if model.nbody < 2:
            raise ValueError(f"{self._path} must have a body, got none")
        for body in range(1, model.nbody):
            count, first = int(model.body_jntnum[body]), int(model.body_jntadr[body])
            if count > 1:
                names = listed(name_of(model, "joint", first + i) for i in range(count))
                raise ValueError(
                    f"{self._path}: joints {names} connect body {name_of(model, 'body', body)!r} to its parent, which "
                    "must be one joint. Give each joint a body of its own, with a small mass and inertia"
                )

    def _needs_base(self, joint: int) -> bool:
        """Return True if a joint to the world has a spring, a damper or a motor, which supports of a scene lack."""
        model = self._model
        body, dof = int(model.jnt_bodyid[joint]), int(model.jnt_dofadr[joint])
        if self._weld[model.body_parentid[body]] != 0 or model.jnt_type[joint] not in (_SLIDE, _HINGE):
            return False
        motors = np.asarray(model.actuator_trnid, dtype=int).reshape(-1, 2)[:, 0]
        transmits = np.asarray(model.actuator_trntype, dtype=int) <= 1  # mjTRN_JOINT, mjTRN_JOINTINPARENT
        return bool(model.jnt_stiffness[joint] or model.dof_damping[dof] or joint in motors[transmits])

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
        masses = np.asarray(model.body_mass, dtype=float)[list(members)]
        mass = float(masses.sum())
        if mass > 0.0:
            centers = np.asarray(data.xipos, dtype=float)[list(members)]
            center = masses @ centers / mass
            inertia = np.zeros((3, 3))
            for body, kilograms, place in zip(members, masses, centers, strict=True):
                turn = np.array(data.ximat[body], dtype=float).reshape(3, 3)
                arm = place - center
                inertia += (turn * model.body_inertia[body]) @ turn.T
                inertia += kilograms * (arm @ arm * np.eye(3) - np.outer(arm, arm))  # parallel axes
        else:
            mass = _FIXED_MASS_RATIO * moving if moving > 0.0 else 1.0
            center = position
            inertia = mass * (0.1 * self._size or 0.1) ** 2 * np.eye(3)
        geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in members]
        drawn, missing = drawn_geoms(model, geoms)
        solid, hulls = solid_of(model, data, drawn, position, rotation)
        if missing:
            self._note("shapes of geoms", (name_of(model, "geom", geom) for geom in missing))
        if hulls:
            meshes = (name_of(model, "mesh", int(model.geom_dataid[geom])) for geom in hulls)
            self._note("surfaces that are not closed, and are drawn as convex hulls, of meshes", meshes)
        names = tuple(name_of(model, "body", body) for body in members) or ("base",)
        inertia = rotation.T @ inertia @ rotation
        center = rotation.T @ (center - position)
        return RobotBody(names, mass, center, 0.5 * (inertia + inertia.T), position, rotation, solid, top == 0)

    def _note(self, what: str, names: Any) -> None:
        self._unsupported.append(f"{what} {listed(names)}")

    def _joints(self, numbers: dict[int, int]) -> tuple[RobotJoint, ...]:
        model, data = self._model, self._data
        used: dict[int, list[FloatArray]] = {}  # positions of joints by body
        found = []
        for joint in range(model.njnt):
            kind = int(model.jnt_type[joint])
            if kind == _FREE:
                continue
            body = int(model.jnt_bodyid[joint])
            parent = numbers.get(int(self._weld[model.body_parentid[body]]))
            child = numbers[int(self._weld[body])]
            axis = None if kind == _BALL else np.array(data.xaxis[joint], dtype=float)
            at = np.array(data.xanchor[joint], dtype=float)
            owners = {child} if parent is None else {parent, child}
            taken = [point for owner in owners for point in used.get(owner, [])]
            if axis is not None:
                at = _free_place(at, axis, taken, _ANCHOR_SHIFT * self._size)
            for owner in owners:
                used.setdefault(owner, []).append(at)
            values = (0.0, 0.0, 0.0)
            if kind != _BALL:
                place, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
                stiffness = float(model.jnt_stiffness[joint])
                rest = float(model.qpos_spring[place] - model.qpos0[place]) if stiffness else 0.0
                values = (stiffness, rest, float(model.dof_damping[dof]))
            found.append(RobotJoint(name_of(model, "joint", joint), _KINDS[kind], parent, child, at, axis, *values))
        return tuple(found)


def _free_place(at: FloatArray, axis: FloatArray, taken: Sequence[FloatArray], shift: float) -> FloatArray:
    """Return the nearest place on an axis that is not taken."""
    steps = [0, *(sign * step for step in range(1, len(taken) + 1) for sign in (1, -1))]
    places = [at + step * shift * axis for step in steps]
    return next(place for place in places if all(np.linalg.norm(place - other) > 0.1 * shift for other in taken))
