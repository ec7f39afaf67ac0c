"""Closed loops of a model of MuJoCo: points of two bodies that an equality constraint connects."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["BODY_OBJECT", "Connection", "connections"]

FloatArray = npt.NDArray[np.float64]

_CONNECT = 0  # mjEQ_CONNECT
BODY_OBJECT = 1  # mjOBJ_BODY: the constraint names bodies, not sites
_DRAWN_APART = 1e-9  # greatest distance of two points that are one, over the size of the robot


class Connection(NamedTuple):
    """A ball joint that closes a loop: number of its constraint, its two bodies in MuJoCo, and its position [m]."""

    equality: int
    bodies: tuple[int, int]
    at: FloatArray


def connections(model: Any, data: Any, size: float) -> list[Connection]:
    """Return the active constraints of type connect whose two points coincide in the reference configuration.

    Parameters
    ----------
    model, data : MjModel, MjData
    size : float [m]
        Size of the robot.
    """
    found = []
    weld = np.asarray(model.body_weldid, dtype=int)
    for i in np.nonzero(np.asarray(model.eq_type) == _CONNECT)[0].tolist():
        objects = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
        if int(model.eq_objtype[i]) == BODY_OBJECT:
            bodies = objects
            anchors = np.asarray(model.eq_data[i], dtype=float)[:6].reshape(2, 3)
            turns = (np.asarray(data.xmat[body], dtype=float).reshape(3, 3) for body in bodies)
            points = [
                data.xpos[body] + turn @ anchor for body, turn, anchor in zip(bodies, turns, anchors, strict=True)
            ]
        else:
            bodies = int(model.site_bodyid[objects[0]]), int(model.site_bodyid[objects[1]])
            points = [np.array(data.site_xpos[site], dtype=float) for site in objects]
        apart = float(np.linalg.norm(points[0] - points[1]))
        if model.eq_active0[i] and weld[bodies[0]] != weld[bodies[1]] and apart <= _DRAWN_APART * size:
            found.append(Connection(i, bodies, np.asarray(points[0], dtype=float)))
    return found
