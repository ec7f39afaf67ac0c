"""Paths of the lift-off point, and the poses of the jaw along them: hanging, touching down, laying."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.deployment.cable import JAW, Cable
from withe.deployment.grasping import Grasp, pivoting
from withe.deployment.pattern import Pattern

__all__ = ["Course", "Path", "Phase", "Piece", "Start", "course", "displaced", "lengthened", "upright_way", "way_along"]

FloatArray = npt.NDArray[np.float64]
Start = Literal["free", "held"]
_LAST_HELD = 0.5  # [Lgb] that still hang when the jaw lets go
_TAIL_SPACING = 0.02  # [Lgb]
_CLEARANCE = 0.02  # [m] of the free end above the floor at the beginning
_ACCELERATION = 0.0981  # [m/s^2], a hundredth of gravity's: swing then moves the cable by less than a millimetre
_PIVOT_ANGLES = 61
_UPRIGHT = 0.5 * np.pi - 1e-3


@dataclass(frozen=True)
class Phase:
    """A part of a motion.

    Attributes
    ----------
    name : str
        "hang", "touch down" or "lay".
    start, end : float [s]
        Times at which the part begins and ends.
    """

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Course:
    """The whole motion of a jaw in time: arrays of shape (n,), (n, 3), (n, 4) as quaternions (x, y, z, w), and (n,)."""

    times: FloatArray
    positions: FloatArray
    rotations: FloatArray
    laid: FloatArray
    phases: tuple[Phase, ...]


@dataclass(frozen=True)
class Path:
    """The pattern and the tail behind it, up to the last lift-off point; `grasps_along` uses it as a pattern."""

    arc_length: FloatArray
    points: FloatArray
    heading: FloatArray
    curvature: FloatArray

    @property
    def length(self) -> float:
        """Return the length of the path of the lift-off point [m]."""
        return float(self.arc_length[-1])


def lengthened(pattern: Pattern, cable: Cable, tail: float) -> Path:
    """Append a tail to a pattern; the tail becomes straight."""
    lgb = cable.gravito_bending_length
    heading = np.unwrap(np.arctan2(pattern.tangent[:, 1], pattern.tangent[:, 0]))
    more = tail - max(_LAST_HELD * lgb, JAW)
    if more <= 0.0:
        last = pattern.arc_length <= cable.length - 0.11 * lgb - 0.5 * JAW
        if last.sum() < 2:
            raise ValueError(
                f"the cable is {cable.length / lgb:.2g} of its gravito-bending lengths long, too stiff to be laid down:"
                f" is that length, {lgb:g} m, in metres?"
            )
        return Path(pattern.arc_length[last], pattern.points[last], heading[last], pattern.curvature[last])
    spacing = max(pattern.arc_length[1], _TAIL_SPACING * lgb)
    s = np.linspace(0.0, more, max(2, int(np.ceil(more / spacing))) + 1)
    behind = np.concatenate([pattern.curvature[-1:], pattern.curvature_behind])
    fading = pattern.arc_length[1] * np.arange(len(behind))  # within the tail, so that its end does not spring back
    curvature = np.interp(s, fading * min(1.0, more / max(fading[-1], 1e-300)), behind, right=0.0)
    steps = np.diff(s)
    turned = heading[-1] + np.concatenate([[0.0], np.cumsum(0.5 * (curvature[1:] + curvature[:-1]) * steps)])
    middle = 0.5 * (turned[1:] + turned[:-1])
    points = pattern.points[-1] + np.cumsum(np.stack([np.cos(middle), np.sin(middle)], 1) * steps[:, None], axis=0)
    return Path(
        np.concatenate([pattern.arc_length, pattern.length + s[1:]]),
        np.concatenate([pattern.points, points]),
        np.concatenate([heading, turned[1:]]),
        np.concatenate([pattern.curvature, curvature[1:]]),
    )


def displaced(path: Path, shift: FloatArray) -> Path:
    """Move each point of a path to its left by `shift`, shape (n,) [m]. The result has its own arc length."""
    from scipy.interpolate import make_interp_spline

    left = np.stack([-np.sin(path.heading), np.cos(path.heading)], 1)
    moved = make_interp_spline(path.arc_length, path.points + shift[:, None] * left, k=5)
    fine = np.linspace(path.arc_length[0], path.length, 4 * len(path.points))
    speed = np.linalg.norm(moved(fine, 1), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(fine))])
    s = np.linspace(0.0, min(path.length, travelled[-1]), len(path.points))
    at = np.interp(s, travelled, fine)
    first, second = moved(at, 1), moved(at, 2)
    bend = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.linalg.norm(first, axis=1) ** 3
    return Path(s, moved(at), np.unwrap(np.arctan2(first[:, 1], first[:, 0])), bend)


@dataclass(frozen=True)
class Piece:
    """Poses along a parameter that runs smoothly in time; `reach` is the length that counts for the speed [m]."""

    parameter: FloatArray
    positions: FloatArray
    quaternions: FloatArray  # (w, x, y, z), continuous
    reach: float
    laying: bool = False

    def duration(self, speed: float) -> float:
        """Return the duration at a speed [m/s], in s."""
        if not self.laying:  # a quintic's greatest speed is 1.875 times its mean, and its acceleration 10 / 3^.5
            gentle = np.sqrt(10.0 / np.sqrt(3.0) * self.reach / _ACCELERATION)
            return max(1.0, 1.875 * self.reach / speed, float(gentle))
        speed = self._reached(speed)
        return self.reach / speed + self._ramp(speed)

    def _reached(self, speed: float) -> float:
        """Return a speed, or the greatest speed that the length of the path allows."""
        return min(speed, float(np.sqrt(self.reach * _ACCELERATION / 1.875)))

    def _ramp(self, speed: float) -> float:
        return max(2.0, 1.875 * speed / _ACCELERATION)  # [s] to reach the speed, and to stop

    def _progress(self, share: FloatArray, speed: float) -> FloatArray:
        """Share of the parameter at shares of the duration."""
        if not self.laying:
            return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        duration, ramp = self.duration(speed), self._ramp(self._reached(speed))
        t = share * duration

        def ramped(time: FloatArray) -> FloatArray:  # integral of the smoothstep of fifth order over time
            u = np.clip(time / ramp, 0.0, 1.0)
            return ramp * u**4 * (2.5 - 3.0 * u + u**2) + np.maximum(time - ramp, 0.0)

        travelled = ramped(t) - ramped(t - (duration - ramp))
        return np.asarray(travelled / travelled[-1])

    def sampled(self, share: FloatArray, speed: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Times, positions, quaternions and laid length."""
        from scipy.interpolate import CubicSpline

        progress = self._progress(share, speed)
        at = self.parameter[0] + progress * (self.parameter[-1] - self.parameter[0])
        quaternions = CubicSpline(self.parameter, self.quaternions)(at)
        quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
        laid = at if self.laying else np.zeros_like(at)
        return (
            share * self.duration(speed),
            CubicSpline(self.parameter, self.positions)(at),
            quaternions[:, [1, 2, 3, 0]],
            laid,
        )

    def fastest(self) -> float:
        """Speed at which the acceleration along the piece reaches its share of gravity [m/s]."""
        from scipy.interpolate import CubicSpline

        bend = np.linalg.norm(CubicSpline(self.parameter, self.positions)(self.parameter, 2), axis=1)
        return float(np.sqrt(_ACCELERATION / max(bend.max(), 1e-6)))


def way_along(cable: Cable, path: Path, grasps: Grasp) -> Piece:
    """Poses of the jaw while each place of the path is the lift-off point."""
    forward = _about_z(path.heading)
    positions = _on_floor(cable, path) + _turned(forward, _in_jaw(cable, grasps))
    rotations = _continuous(_product(forward, _from_vectors(grasps.rotation)))
    return Piece(path.arc_length, positions, rotations, path.length, laying=True)


def upright_way(cable: Cable, path: Path) -> Piece:
    """Poses of an upright jaw above the lift-off point, at the height of the suspended length."""
    upright = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])  # x turned up
    rotations = _continuous(_product(_about_z(path.heading), np.broadcast_to(upright, (len(path.points), 4))))
    positions = _on_floor(cable, path)
    positions[:, 2] += cable.length - path.arc_length
    return Piece(path.arc_length, positions, rotations, path.length, laying=True)


def course(cable: Cable, path: Path, way: Piece, speed: float, sampling_interval: float, start: Start) -> Course:
    """Hang, touch down and lay, at a speed of the lift-off point [m/s], with a row every `sampling_interval` [s]."""
    down = _touch_down(cable, path, way, start)
    pieces, phases, clock = [], [], 0.0
    for name, piece in (("hang", _hang(down)), ("touch down", down), ("lay", way)):
        duration = piece.duration(speed)
        times, *rest = piece.sampled(
            np.linspace(0.0, 1.0, max(2, int(np.ceil(duration / sampling_interval)) + 1)), speed
        )
        pieces.append((clock + times, *rest))
        phases.append(Phase(name, clock, clock + duration))
        clock += duration
    rows = [np.concatenate([piece[i] if k == 0 else piece[i][1:] for k, piece in enumerate(pieces)]) for i in range(4)]
    return Course(rows[0], rows[1], _continuous(rows[2]), rows[3], tuple(phases))


def _in_jaw(cable: Cable, grasps: Grasp) -> FloatArray:
    """Middle of a jaw that holds the cable straight behind where it is grasped, in the frame of the lift-off point."""
    along = _turned(_from_vectors(grasps.rotation), np.broadcast_to([0.5 * JAW, 0.0, 0.0], grasps.position.shape))
    return cable.gravito_bending_length * grasps.position + along


def _on_floor(cable: Cable, path: Path) -> FloatArray:
    return np.column_stack([path.points, np.full(len(path.points), cable.radius)])


def _touch_down(cable: Cable, path: Path, way: Piece, start: Start) -> Piece:
    """Return the piece from the upright cable on its end, which rolls if it is free, to the first pose of laying."""
    suspended = (cable.length - 0.5 * JAW) / cable.gravito_bending_length
    angles = np.linspace(_UPRIGHT, 0.0, _PIVOT_ANGLES)
    found = pivoting(suspended, angles, cable.stretch_stiffness)
    heading = np.full(_PIVOT_ANGLES, path.heading[0])
    forward = _about_z(heading)
    rolls = cable.radius if start == "free" else 0.0
    rolled = np.column_stack([-rolls * angles, np.zeros((_PIVOT_ANGLES, 2))])
    base = np.append(path.points[0], cable.radius)
    positions = base + _turned(forward, rolled + _in_jaw(cable, found))
    quaternions = _product(forward, _from_vectors(found.rotation))
    # The last pose is exactly the first pose of laying, which may differ by the method or by a bent beginning.
    share = np.linspace(0.0, 1.0, _PIVOT_ANGLES)[:, None]
    blend = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    positions = positions + blend * (way.positions[0] - positions[-1])
    last = way.quaternions[0] * np.sign(way.quaternions[0] @ quaternions[-1])
    quaternions = _continuous(quaternions)
    quaternions = quaternions + blend * (last * np.sign(last @ quaternions[-1]) - quaternions[-1])
    reach = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    return Piece(share[:, 0], positions, quaternions / np.linalg.norm(quaternions, axis=1)[:, None], reach)


def _hang(down: Piece) -> Piece:
    """Straight down to where touching down begins."""
    heights = np.linspace(_CLEARANCE, 0.0, 5)
    positions = down.positions[0] + np.column_stack([np.zeros((5, 2)), heights])
    return Piece(np.linspace(0.0, 1.0, 5), positions, np.repeat(down.quaternions[:1], 5, axis=0), _CLEARANCE)


def _about_z(angle: FloatArray) -> FloatArray:
    zero = np.zeros_like(angle)
    return np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], -1)


def _from_vectors(vectors: FloatArray) -> FloatArray:
    angle = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.concatenate([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vectors], -1)


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    w = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(-1, keepdims=True)
    return np.concatenate([w, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])], -1)


def _turned(quaternions: FloatArray, vectors: FloatArray) -> FloatArray:
    twice = 2.0 * np.cross(quaternions[..., 1:], vectors)
    return np.asarray(vectors + quaternions[..., :1] * twice + np.cross(quaternions[..., 1:], twice))


def _continuous(quaternions: FloatArray) -> FloatArray:
    """Choose the sign of each quaternion that is closer to its predecessor."""
    agree = np.where((quaternions[1:] * quaternions[:-1]).sum(-1) < 0.0, -1.0, 1.0)
    return np.asarray(quaternions * np.concatenate([[1.0], np.cumprod(agree)])[:, None])
