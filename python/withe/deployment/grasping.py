"""Grasps: poses of a jaw that lays a rod in its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from withe._core import GraspTable
from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.errors import ConvergenceError

__all__ = ["Grasp", "grasp"]

FloatArray = npt.NDArray[np.float64]
_BEND_STIFFNESS = 2.0  # EI in units of w Lgb^2
_SHARES = (
    0.0,
    0.15,
    0.3,
    0.45,
    0.6,
    0.75,
    0.9,
    1.05,
    1.2,
    1.4,
    1.7,
)  # pushes that are tried, relative to the curvature [w Lgb^2]
_CARRYING = 3.0  # [Lgb] along which a push is carried back at most
_SLICK = 0.2  # coefficient of friction of the slickest floor that is planned for: it is to hold every push
_THICKEST = 0.25  # [Lgb]: a rod's radius
_ENOUGH = 8.0  # [Lgb] of suspended length: for longer ones forces are the same
TWIST_STIFFNESS = _BEND_STIFFNESS / 1.5  # GJ of a round rod of incompressible material


@dataclass(frozen=True, eq=False)
class Grasp:
    """Grasp of the suspended part of a rod. The arrays have the shape of the arguments, then (3,).

    The frame is that of the lift-off point: x is the direction in which the rod leaves the floor, and z points up.

    Attributes
    ----------
    position : ndarray of shape (..., 3) [Lgb]
        Position of the held end.
    rotation : ndarray of shape (..., 3) [rad]
        Rotation vector from the frame at lift-off to the frame of the jaw, whose first axis is the tangent there.
    force : ndarray of shape (..., 3) [w Lgb]
        Force of the floor on the suspended part at lift-off.
    stable : ndarray of bool of shape (...)
        True if the energy is a minimum while the jaw holds position and rotation, also against motion out of the plane.
    residual : ndarray of shape (...)
        Largest error of the boundary value problem: of tangents, and of moments in w Lgb^2.
    """

    position: FloatArray
    rotation: FloatArray
    force: FloatArray
    stable: npt.NDArray[np.bool_]
    residual: FloatArray

    @property
    def friction(self) -> FloatArray:
        """Friction coefficient that lift-off needs, shape (...) [-]: tangential over normal force of the floor."""
        return np.asarray(np.hypot(self.force[..., 0], self.force[..., 1]) / self.force[..., 2])


@cache
def table() -> GraspTable:
    """Return the table of initial guesses, which is computed once."""
    return GraspTable()


@keyword_hints
def grasp(
    suspended: npt.ArrayLike,
    curvature: npt.ArrayLike,
    stretch_stiffness: npt.ArrayLike = 2087.0,
    *,
    axial_force: npt.ArrayLike = 0.0,
    radius: npt.ArrayLike = 0.0,
) -> Grasp:
    """Find the grasp that lays a rod with a given curvature at its lift-off point.

    The rod is straight and round. It hangs between a flat floor, which it leaves along x with a curvature in the plane
    of the floor, and a jaw that applies no moment. Lengths are in units of Lgb = (EI / 2w)^(1/3), forces in w Lgb, with
    the weight w per length.

    Parameters
    ----------
    suspended : array_like [Lgb]
        Suspended length, 0.1 to 100. Forces no longer depend on it beyond 7.
    curvature : array_like [1/Lgb]
        Curvature at the lift-off point, -6 to 6. **A positive curvature bends the rod towards -y**, to the right of its
        way, as in the tables of the dissertation's public code. (9.1) has the opposite sign.
    stretch_stiffness : array_like [-]
        EA Lgb^2 / EI, which is 4 (Lgb / radius)^2 for a round rod (9.10). At least 100, and at least 4 times the
        suspended length.
    axial_force : array_like [w Lgb]
        Force of the floor on the suspended part along x. A push of about 0.82 curvature^2 needs the least friction at
        the lift-off point.
    radius : array_like [Lgb]
        Distance from the centreline down to the floor's force, at most 0.25; 0 in the dissertation. GJ is that of a
        round rod of incompressible material.

    Returns
    -------
    Grasp

    Raises
    ------
    ValueError
        Not numbers, out of range, or shapes that do not broadcast.
    ConvergenceError
        No grasp exists: the axial force is too large, or the twist of a thick bent rod lifts it off the floor.

    Notes
    -----
    The equations are

        t' = m x t / 2,  m' = -(1 + e) t x n,  n = -force + s z,  e = n.t / (2 stretch_stiffness),  r' = (1 + e) t,
        t(0) = x,  m(0) = -2 curvature z,  m(suspended) = 0

    (Choi, dissertation, (9.1) and (9.3)), solved by multiple shooting with exact derivatives. The two unknowns are the
    forces of the floor across the rod, along y and z.

    A rod of radius r rests on its surface, where friction acts: m(0) has the additional part r (force_x y - force_y x),
    and -r force_y twists the suspended part. The jaw is turned by this twist, so that the laid rod rolls only close
    behind the lift-off point. There the rod moves aside as it rolls. The friction f across the rod bends it,
    EI d^4y/ds^4 = f, and turns it, GJ d^2y/ds^2 = r^2 f. So f decays as exp(-s / b) with b = r sqrt(EI / GJ), force_y
    acts b behind the lift-off point, and m(0) has the additional part b force_y z. This part is not in the
    dissertation, whose cables are thin.

    Examples
    --------
    >>> import withe
    >>> found = withe.deployment.grasp(7.0, [0.0, 0.5])
    >>> print(found.position.round(3), found.friction.round(3))
    [[ 2.566  0.     5.488]
     [ 2.307 -1.699  5.334]] [0.    0.302]
    """
    length, bend, stretch, axial, lever = validation.broadcast_arrays(
        suspended=suspended,
        curvature=curvature,
        stretch_stiffness=stretch_stiffness,
        axial_force=axial_force,
        radius=radius,
    )
    solver = table()
    _require_within(length, "suspended", solver.shortest, solver.longest, "Lgb")
    _require_within(np.abs(bend), "the size of curvature", 0.0, solver.greatest_curvature, "/ Lgb")
    _require_within(lever, "radius", 0.0, _THICKEST, "Lgb")
    require_stiff(length, stretch)
    questions = np.stack([length, bend, 2.0 * stretch, axial, np.zeros_like(axial), lever], -1).reshape(-1, 6)
    return _described(solver.grasps(questions, TWIST_STIFFNESS), questions, length.shape)


def least_stiffness(suspended: FloatArray) -> FloatArray:
    """Stretch stiffness at which the suspended part stretches by an eighth under its own weight."""
    return np.maximum(100.0, 4.0 * suspended)


def require_stiff(suspended: FloatArray, stretch: FloatArray) -> None:
    """Refuse rods that would stretch by an eighth under their own weight."""
    if not np.all(stretch >= least_stiffness(suspended)):
        raise ValueError(
            f"stretch_stiffness must be at least 100 and 4 times suspended, got {stretch.min():g}: such a rod"
            " would stretch by an eighth under its own weight"
        )


def _require_within(values: FloatArray, name: str, low: float, high: float, unit: str) -> None:
    out = values[(values < low) | (values > high)]
    if out.size:
        raise ValueError(f"{name} must be from {low:g} to {high:g} {unit}, got {out[0]:g}")


def _described(rows: FloatArray, questions: FloatArray, shape: tuple[int, ...]) -> Grasp:
    unsolved = np.flatnonzero(rows[:, 11] == 0)
    if unsolved.size:
        suspended, curvature, _, axial, _, _ = questions[unsolved[0]]
        raise ConvergenceError(
            f"no grasp found for suspended={suspended:g}, curvature={curvature:g}, axial_force={axial:g}"
        )
    vectors = (*shape, 3)
    return Grasp(
        position=rows[:, :3].reshape(vectors).copy(),
        rotation=rotation_vectors(rows[:, 3:7]).reshape(vectors),
        force=rows[:, 7:10].reshape(vectors).copy(),
        stable=(rows[:, 12] > 0).reshape(shape),
        residual=rows[:, 10].reshape(shape).copy(),
    )


def carrying(laid: FloatArray, curvature: FloatArray) -> FloatArray:
    """Length behind the lift-off point that carries a push along the rod back, shape (n,) [Lgb].

    At most 3 Lgb carry the push: farther back, a bent rod yields sideways. The length next to the free end carries
    nothing, because friction is needed there to turn the rod. A moment of at most friction l^2 / 2 acts over a length
    l, so a curvature takes 2 (curvature / friction)^(1/2). Half of this length is subtracted.
    """
    return np.clip(laid - np.sqrt(np.abs(curvature) / _SLICK), 0.0, _CARRYING)


def needed_friction(force: FloatArray, shear: FloatArray, carried: FloatArray) -> FloatArray:
    """Friction coefficient that each lift-off point needs, including the lying rod behind it, shape (n,).

    `force` is the force of the floor on the suspended part, shape (n, 3) [w Lgb]. `shear` is the transverse force,
    along y, of the lying part on the suspended part [w Lgb]; the floor need not apply it. The lift-off point must hold
    the transverse force alone. The lying part shares a push along the rod over a length `carried` [Lgb]. The friction
    per weight is then the same everywhere, push / (force_z + carried).
    """
    up = force[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.hypot(force[:, 0] / (up + carried), (force[:, 1] - shear) / up)


def least_friction(
    suspended: FloatArray,
    curvature: FloatArray,
    shear: FloatArray,
    laid: FloatArray,
    stretch_stiffness: float,
    radius: float,
) -> Grasp:
    """Grasps with the push along the rod that needs least friction, shapes (n,); see `grasp`, `needed_friction`.

    `laid` is the length behind the lift-off point [Lgb]. For a single pose the push is a share of the curvature: the
    best of a few shares, improved by the parabola through it and its neighbours. Along a whole path the push is bounded
    in three ways:

    - It is nowhere below the push of the single poses.
    - It changes by no more than a slippery floor holds, because the laid rod keeps the push with which it was laid.
    - It is at most what such a floor holds behind the lift-off point, because otherwise the whole rod moves back.
    """
    near = np.minimum(suspended, _ENOUGH)
    bend, carried = np.abs(curvature), carrying(laid, curvature)

    def rows_at(push: FloatArray, length: FloatArray = near) -> tuple[FloatArray, FloatArray]:
        stretch, angle, lever = (np.full(len(push), value) for value in (2.0 * stretch_stiffness, 0.0, radius))
        questions = np.stack([length, curvature, stretch, np.minimum(push, _SLICK * carried), angle, lever], -1)
        rows = np.asarray(table().grasps(questions, TWIST_STIFFNESS))
        good = (rows[:, 11] > 0) & (rows[:, 12] > 0) & (rows[:, 9] > 0)
        return rows, np.where(good, needed_friction(rows[:, 7:10], shear, carried), np.inf)

    tried = [rows_at(share * bend) for share in _SHARES]
    needed = np.stack([need for _, need in tried])
    best = np.clip(needed.argmin(0), 1, len(_SHARES) - 2)
    column = np.arange(len(bend))
    shares = np.array(_SHARES)
    x = np.stack([shares[best + i] for i in (-1, 0, 1)])
    y = np.stack([needed[best + i, column] for i in (-1, 0, 1)])
    with np.errstate(divide="ignore", invalid="ignore"):
        left, right = (x[1] - x[0]) * (y[1] - y[2]), (x[1] - x[2]) * (y[1] - y[0])
        lowest = x[1] - 0.5 * ((x[1] - x[0]) * left - (x[1] - x[2]) * right) / (left - right)
    refined = rows_at(bend * np.where(np.isfinite(lowest), np.clip(lowest, x[0], x[2]), x[1]))
    candidates = [refined, *tried]
    choice = np.stack([need for _, need in candidates]).argmin(0)
    own = np.stack([rows for rows, _ in candidates])[choice, column, 7]
    along = (own - _SLICK * np.abs(laid[:, None] - laid)).max(1)
    _, need = rows_at(along)
    push = np.where(np.isfinite(need), along, own)  # without such a grasp (too sharp a bend) its own push
    chosen, _ = rows_at(push, suspended)
    return _described(chosen, np.stack([suspended, curvature, push, push, push, push], -1), suspended.shape)


def thickened(
    solve: Callable[[FloatArray, FloatArray], Grasp], suspended: FloatArray, curvature: FloatArray, radius: float
) -> Grasp:
    """Grasps of a thick rod, approximated by those that `solve` returns for a thin rod, without axial force.

    Since force_y acts behind the lift-off point, the curvature there is smaller. The rod is twisted as `grasp` states.
    The couples at lift-off and of the jaw balance about the upright axis: force_y x = m(0)_z - radius force_y t_z. The
    bending of the rod by its twist is neglected. It is some 0.3 radius at the jaw for a curvature of 0.5 / Lgb.
    """
    from scipy.spatial.transform import Rotation

    behind = radius * np.sqrt(_BEND_STIFFNESS / TWIST_STIFFNESS)

    def across(found: Grasp) -> FloatArray:
        up = Rotation.from_rotvec(found.rotation).as_matrix()[:, 2, 0]
        return np.asarray(_BEND_STIFFNESS * curvature / (found.position[:, 0] + radius * up + behind))

    first = across(solve(suspended, curvature))
    found = solve(suspended, curvature - behind * first / _BEND_STIFFNESS)
    held = Rotation.from_rotvec(found.rotation)
    angle = -radius * across(found) * suspended / TWIST_STIFFNESS
    return replace(found, rotation=(held * Rotation.from_rotvec(angle[:, None] * [1.0, 0.0, 0.0])).as_rotvec())


def pivoting(suspended: float, angles: FloatArray, stretch_stiffness: float) -> Grasp:
    """Grasps of a rod whose free end stands on the floor at given angles, without axial force; shape (n,).

    Rotations are relative to the frame of the floor.
    """
    count = len(angles)
    questions = np.zeros((count, 6))
    questions[:, 0], questions[:, 2], questions[:, 4] = suspended, 2.0 * stretch_stiffness, angles
    return _described(table().grasps(questions, TWIST_STIFFNESS), questions, (count,))


def rotation_vectors(quaternions: FloatArray) -> FloatArray:
    """Rotation vectors of unit quaternions (w, x, y, z), shapes (n, 3) and (n, 4) [rad]."""
    size = np.linalg.norm(quaternions[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(size, quaternions[:, 0])
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = np.where(size > 0.0, angle / size, 2.0)
    return np.asarray(factor[:, None] * quaternions[:, 1:])
