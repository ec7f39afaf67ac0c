"""Content of a robot's file that has no counterpart in a scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Set
from typing import Any

import numpy as np

from withe.robots.mujoco_joints import BALL, greatest_torque, has_force_limit, stops_of
from withe.robots.mujoco_loops import BODY_OBJECT
from withe.robots.names import name_of

__all__ = ["listed", "unsupported_content"]

_EQUALITIES = ("connect", "weld", "joint", "tendon", "flex", "flexvert", "flexstrain")
_NAMED = {"actuator": "nu", "tendon": "ntendon", "sensor": "nsensor", "keyframe": "nkey", "pair": "npair"}
_PLURAL = {"keyframe": "keyframes", "pair": "contact pairs"}
_COUNTED = {"nflex": "flexes", "nskin": "skins", "nplugin": "plugins"}


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return names for a message, the first few of many."""
    known = [repr(name) for name in names]
    more = f" and {len(known) - most} more" if len(known) > most else ""
    return ", ".join(known[:most]) + more


def unsupported_content(model: Any, closed: Set[int]) -> Iterator[str]:
    """Yield what a model has that a scene of rigid bodies and joints lacks, with names.

    `closed`: equality constraints that become joints.
    """
    yield from _of_joints(model)
    yield from _of_equalities(model, closed)
    for kind, count in _NAMED.items():
        number = int(getattr(model, count))
        if number:
            yield f"{_PLURAL.get(kind, kind + 's')} {listed(name_of(model, kind, i) for i in range(number))}"
    for count, word in _COUNTED.items():
        if getattr(model, count):
            yield f"{word} ({getattr(model, count)})"
    yield from _of_bodies(model)
    yield from _of_options(model)
    touching = _touching(model)
    if touching:
        yield f"contact of bodies, such as {touching[0]!r} with {touching[1]!r}"


def _of_joints(model: Any) -> Iterator[str]:
    dof_joint = np.asarray(model.dof_jntid, dtype=int)
    kind = np.asarray(model.jnt_type, dtype=int)

    def of_dofs(values: Any) -> set[int]:
        rows = np.asarray(values).reshape(len(dof_joint), -1)
        return set(dof_joint[(rows != 0.0).any(axis=1)].tolist())

    def of_joints(values: Any) -> set[int]:
        rows = np.asarray(values).reshape(len(kind), -1)
        return set(np.nonzero((rows != 0.0).any(axis=1))[0].tolist())

    limited = of_joints(model.jnt_limited)
    without_spring = set(np.nonzero(kind <= BALL)[0].tolist())
    found = {
        "limits of ball joints": limited & without_spring,
        "limits that exclude the drawn place of joints": {
            joint for joint in limited - without_spring if stops_of(model, joint)[0] is None
        },
        "force limits of joints": {
            joint
            for joint in range(len(kind))
            if has_force_limit(model, joint) and not np.isfinite(greatest_torque(model, joint))
        },
        "armature of joints": of_dofs(model.dof_armature),
        "friction loss of joints": of_dofs(model.dof_frictionloss),
        "damping of ball and free joints": of_dofs(model.dof_damping) & without_spring,
        "stiffness of ball and free joints": of_joints(model.jnt_stiffness) & without_spring,
        "nonlinear stiffness of joints": of_joints(_optional(model, "jnt_stiffnesspoly", len(kind))),
        "nonlinear damping of joints": of_dofs(_optional(model, "dof_dampingpoly", len(dof_joint))),
        "yield of joint springs": of_joints(_optional(model, "jnt_springyield", len(kind))),
    }
    for what, joints in found.items():
        if joints:
            yield f"{what} {listed(name_of(model, 'joint', joint) for joint in sorted(joints))}"


def _optional(model: Any, word: str, count: int) -> Any:
    """Return an array that older versions of MuJoCo lack."""
    return getattr(model, word, np.zeros(count))


def _of_equalities(model: Any, closed: Set[int]) -> Iterator[str]:
    kinds = {i: kind for i, kind in enumerate(np.asarray(model.eq_type, dtype=int).tolist()) if i not in closed}
    for kind in sorted(set(kinds.values())):
        word = _EQUALITIES[kind] if kind < len(_EQUALITIES) else f"kind {kind}"
        names = []
        for i in (number for number, own in kinds.items() if own == kind):
            first = int(model.eq_obj1id[i])
            of = {"connect": "body", "weld": "body", "joint": "joint", "tendon": "tendon"}.get(word, "equality")
            if word in ("connect", "weld") and int(model.eq_objtype[i]) != BODY_OBJECT:
                of = "site"
            names.append(model.equality(i).name or name_of(model, of, first if of != "equality" else i))
        also = ", which the mimic of URDF is too" if word == "joint" else ""
        yield f"equality constraints of type {word} {listed(names)}{also}"


def _of_bodies(model: Any) -> Iterator[str]:
    floating = np.nonzero(np.asarray(model.body_gravcomp) != 0.0)[0].tolist()
    if floating:
        yield f"gravity compensation of bodies {listed(name_of(model, 'body', body) for body in floating)}"
    mocap = np.nonzero(np.asarray(model.body_mocapid) >= 0)[0].tolist()
    if mocap:
        yield f"motion of mocap bodies {listed(name_of(model, 'body', body) for body in mocap)}, which are fixed"
    world = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] == 0]
    if world:
        yield f"geoms of the world {listed(name_of(model, 'geom', geom) for geom in world)}"


def _of_options(model: Any) -> Iterator[str]:
    option = model.opt
    for word in ("wind", "density", "viscosity"):
        if np.any(np.asarray(getattr(option, word)) != 0.0):
            yield f"{word} of the surrounding medium"
    if int(option.disableflags) != 0:
        yield "disabled parts of the simulation (option flag)"
    if int(option.enableflags) != 0:
        yield "options of contact and of the solver (option flag)"


def _touching(model: Any) -> tuple[str, str] | None:
    """Return the names of two bodies that may touch in MuJoCo.

    Bodies that a joint connects do not touch, unless one of them is fixed to the world.
    """
    weld = np.asarray(model.body_weldid, dtype=int)
    own = np.asarray(model.geom_bodyid, dtype=int)
    group = weld[own]
    parent = weld[np.asarray(model.body_parentid, dtype=int)[group]]
    kinds, others = (np.asarray(values, dtype=int) for values in (model.geom_contype, model.geom_conaffinity))
    excluded = set(np.asarray(model.exclude_signature, dtype=int).tolist())
    for i in range(model.ngeom):
        can = ((kinds[i] & others) | (kinds & others[i])) != 0
        can &= group != group[i]
        joined = (parent == group[i]) | (parent[i] == group)
        can &= ~joined | (group == 0) | (group[i] == 0)
        for j in np.nonzero(can)[0].tolist():
            first, second = sorted((int(own[i]), int(own[j])))
            if (first << 16) + second not in excluded:
                return name_of(model, "body", int(own[i])), name_of(model, "body", int(own[j]))
    return None
