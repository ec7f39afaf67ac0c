"""Motions of a gripper that lay a cable along a pattern."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.deployment.cable import Cable
from withe.deployment.drawing import draw_plan
from withe.deployment.feasibility import Controller, Feasibility, examine, grasps_along
from withe.deployment.grasping import Grasp, pivoting
from withe.deployment.pattern import Pattern

__all__ = ["Phase", "Plan", "PlanController", "plan"]

FloatArray = npt.NDArray[np.float64]
PlanController = Literal["exact", "least_friction", "intuitive"]
_GRAVITY = 9.81
_TAIL = 4.0  # [Lgb] of cable beyond the pattern, where there is so much: shorter ends need much friction
_LAST_HELD = 0.5  # [Lgb] that still hang when the jaw lets go
_JAW = 0.010  # [m], its width
_CLEARANCE = 0.02  # [m] of the free end above the floor at the beginning
_MOST_FRICTION = 3.0  # no floor has more
_FASTEST_SHARE = 0.01  # of the acceleration of gravity: swing then moves the cable by less than a millimetre
_PIVOT_ANGLES = 61
_UPRIGHT = 0.5 * np.pi - 1e-3


@dataclass(frozen=True)
class Phase:
    """A part of a motion: "hang", "touch down" or "lay", and when it begins and ends [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Plan:
    """The path of a jaw that lays a cable; at its end the jaw opens. The floor is the plane z = 0.

    Attributes
    ----------
    times : ndarray of shape (n,) [s]
    positions : ndarray of shape (n, 3) [m]
        Of the cable's centreline in the jaw.
    rotations : ndarray of shape (n, 4)
        Quaternions (x, y, z, w). A jaw's first axis is the cable's tangent, away from its free end; at lift-off of a
        straight cable that lies along x its axes would be x, y, z.
    laid : ndarray of shape (n,) [m]
        Arc length of the lift-off point; zero before laying.
    phases : tuple of Phase
    cable : Cable
        As long as what is between its free end and the jaw.
    pattern : Pattern
    tail : float [m]
        How much of the cable lies beyond the pattern, straight on.
    controller : str
    speed : float [m/s]
        Of the lift-off point along the pattern.
    fastest : float [m/s]
        The speed at which the jaw's acceleration while it lays reaches a hundredth of gravity's. Faster, the cable
        swings, and that, not friction, soon decides how well it lies.
    needed_friction : ndarray of shape (pattern's nodes,)
        Coefficient that each place of the pattern needs; NaN for "intuitive", which is not computed from forces.
    """

    times: FloatArray
    positions: FloatArray
    rotations: FloatArray
    laid: FloatArray
    phases: tuple[Phase, ...]
    cable: Cable
    pattern: Pattern
    tail: float
    controller: str
    speed: float
    fastest: float
    needed_friction: FloatArray

    def feasibility(self, friction: float) -> Feasibility:
        """Say where friction holds the cable and where it will slip; see `Pattern.feasibility`."""
        return examine(
            self.pattern, self.cable, friction, "least_friction" if self.controller == "least_friction" else "exact"
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion to a file.

        Parameters
        ----------
        path : str or Path
            ``.csv``, with the header t,x,y,z,qx,qy,qz,qw [s, m], or ``.json``, with phases, cable and pattern beside.

        Raises
        ------
        ValueError
            Another ending.
        """
        path = Path(path)
        if path.suffix == ".csv":
            rows = np.column_stack([self.times, self.positions, self.rotations])
            np.savetxt(path, rows, delimiter=",", header="t,x,y,z,qx,qy,qz,qw", comments="", fmt="%.9g")
        elif path.suffix == ".json":
            path.write_text(json.dumps(self.to_dict()), encoding="utf-8")
        else:
            raise ValueError(f"path must end in .csv or .json, got {path.name!r}")

    def plot(self, friction: float) -> Any:
        """Draw the pattern coloured by the friction that it needs, the jaw's way, and each test along the cable.

        Parameters
        ----------
        friction : float
            Coefficient that there is; stretches that need more are shaded.

        Returns
        -------
        matplotlib.figure.Figure
        """
        title = f"{self.controller}, {1e3 * self.speed:.0f} mm/s"
        return draw_plan(self.pattern, self.positions, self.feasibility(friction), title)

    def to_dict(self) -> dict[str, object]:
        """All numbers as lists, for JSON. SI units."""
        return {
            "controller": self.controller,
            "speed": self.speed,
            "fastest": self.fastest,
            "phases": [{"name": phase.name, "start": phase.start, "end": phase.end} for phase in self.phases],
            "cable": {
                "length": self.cable.length,
                "radius": self.cable.radius,
                "gravito_bending_length": self.cable.gravito_bending_length,
                "tail": self.tail,
            },
            "pattern": {
                "points": self.pattern.points.tolist(),
                "curvature": self.pattern.curvature.tolist(),
                "deviation": self.pattern.deviation,
                "needed_friction": [None if not np.isfinite(x) else x for x in self.needed_friction.tolist()],
            },
            "motion": {
                "t": self.times.tolist(),
                "position": self.positions.tolist(),
                "quaternion_xyzw": self.rotations.tolist(),
            },
        }

    def __repr__(self) -> str:
        return f"Plan({self.controller}, {self.pattern.length:.3f} m in {self.times[-1]:.1f} s)"


def plan(
    cable: Cable,
    pattern: Pattern,
    controller: PlanController = "exact",
    *,
    speed: float = 0.025,
    tail: float | None = None,
    crossings: Literal["refuse", "over"] = "refuse",
    time_step: float = 0.02,
) -> Plan:
    """Plan the whole motion: hang, touch down by pivoting on the free end, lay, let go.

    While the cable is laid, the jaw is where `grasp` puts it for the place of the pattern that lifts off (Choi,
    dissertation, Alg. 12). Before, the cable hangs with its free end above the pattern's beginning, is lowered, and
    leans over until it lies, without a force along the floor; a round end rolls by its radius times the angle, so that
    it stands that much before its place. Behind the pattern the cable is laid straight on until the jaw lets go.

    Parameters
    ----------
    cable : Cable
    pattern : Pattern
    controller : {"exact", "least_friction", "intuitive"}
        No force along the cable where it lifts off; the push that needs least friction; or the jaw straight above the
        lift-off point at the height of what still hangs, upright, the baseline of the dissertation (figure 9.2).
    speed : float [m/s]
        Of the lift-off point.
    tail : float [m]
        How much cable is laid beyond the pattern: the jaw holds it pattern.length + tail from its free end. None:
        4 Lgb, or all that there is.
    crossings : {"refuse", "over"}
        Whether the pattern may cross itself: the cable is then laid over itself, as if it had no thickness.
    time_step : float [s]
        Between the rows of the plan.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        The cable is shorter than pattern and tail, or cannot bend so tightly; the pattern crosses itself; no floor has
        the friction that the pattern needs; speed, tail or time step not positive.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> x = np.linspace(0.0, 0.5, 101)
    >>> wave = withe.deployment.Pattern(np.stack([x, 0.03 * np.sin(4 * np.pi * x)], 1))
    >>> motion = withe.deployment.plan(withe.deployment.Cable.dlo(2), wave)
    >>> print([phase.name for phase in motion.phases], f"{motion.needed_friction.max():.1f}")
    ['hang', 'touch down', 'lay'] 0.2
    """
    validation.choice(controller, "controller", ("exact", "least_friction", "intuitive"))
    speed = validation.positive(speed, "speed")
    time_step = validation.positive(time_step, "time_step")
    held, tail = _held(cable, pattern, tail)
    validation.choice(crossings, "crossings", ("refuse", "over"))
    if len(pattern.crossings) and crossings == "refuse":
        first, second = 1e3 * pattern.crossings[0]
        where = f"it does at {first:.0f} and {second:.0f} mm"
        raise ValueError(f"the pattern must not cross itself, {where}; crossings='over' lays it so")
    path = _lengthened(pattern, held, tail)
    if controller == "intuitive":
        needed, way = np.full(len(pattern.points), np.nan), _upright_way(held, path)
    else:
        grasps = grasps_along(path, held, controller)
        needed, way = _needed(pattern, held, controller, grasps), _way(held, path, grasps)
    down = _touch_down(held, path, way)
    pieces, phases, clock = [], [], 0.0
    for name, piece in (("hang", _hang(held, down, speed)), ("touch down", down), ("lay", way)):
        duration = piece.duration(speed)
        pieces.append(piece.sampled(np.linspace(0.0, 1.0, max(2, int(np.ceil(duration / time_step)) + 1)), speed))
        phases.append(Phase(name, clock, clock + duration))
        pieces[-1] = (clock + pieces[-1][0], *pieces[-1][1:])
        clock += duration
    times, positions, rotations, laid = (
        np.concatenate([piece[i] if k == 0 else piece[i][1:] for k, piece in enumerate(pieces)]) for i in range(4)
    )
    return Plan(
        times=times,
        positions=positions,
        rotations=_continuous(rotations),
        laid=np.minimum(laid, pattern.length),
        phases=tuple(phases),
        cable=held,
        pattern=pattern,
        tail=tail,
        controller=controller,
        speed=speed,
        fastest=way.fastest(),
        needed_friction=needed,
    )


def _needed(pattern: Pattern, cable: Cable, controller: Controller, grasps: Grasp) -> FloatArray:
    """Friction that each place of the pattern needs."""
    count = len(pattern.points)
    force = np.concatenate([grasps.force, np.repeat(grasps.force[-1:], count, axis=0)])[:count]
    found = examine(pattern, cable, _MOST_FRICTION, controller, force)
    hopeless = [slip for slip in found.slips if slip.test != "free end"]
    if hopeless:
        raise ValueError(f"no floor holds this cable on this pattern: {max(hopeless, key=lambda slip: slip.needed)}")
    return found.needed


def _held(cable: Cable, pattern: Pattern, tail: float | None) -> tuple[Cable, float]:
    """The cable up to the jaw, and how much of it lies beyond the pattern."""
    room = cable.length - pattern.length
    if room < 0.0:
        raise ValueError(f"the cable is {cable.length:g} m long, the pattern {pattern.length:.4g} m")
    if tail is None:
        tail = min(room, _TAIL * cable.gravito_bending_length)
    tail = validation.non_negative(tail, "tail")
    if tail > room:
        raise ValueError(f"the cable is {cable.length:g} m long, pattern and tail {pattern.length + tail:.4g} m")
    return replace(cable, length=pattern.length + tail), tail


@dataclass(frozen=True)
class _Path:
    """The pattern and the tail behind it, as far as the lift-off point goes; `grasps_along` sees a pattern in it."""

    arc_length: FloatArray
    points: FloatArray
    heading: FloatArray
    curvature: FloatArray

    @property
    def length(self) -> float:
        return float(self.arc_length[-1])


def _lengthened(pattern: Pattern, cable: Cable, tail: float) -> _Path:
    lgb = cable.gravito_bending_length
    heading = np.unwrap(np.arctan2(pattern.tangent[:, 1], pattern.tangent[:, 0]))
    more = tail - max(_LAST_HELD * lgb, _JAW)
    if more <= 0.0:
        last = pattern.arc_length <= cable.length - max(0.11 * lgb, 0.5 * _JAW)
        return _Path(pattern.arc_length[last], pattern.points[last], heading[last], pattern.curvature[last])
    spacing = pattern.arc_length[1]
    s = np.linspace(0.0, more, max(2, int(np.ceil(more / spacing))) + 1)
    share = np.minimum(s / min(more, 2.0 * lgb), 1.0)  # the curvature fades out
    curvature = pattern.curvature[-1] * (1.0 - 3.0 * share**2 + 2.0 * share**3)
    steps = np.diff(s)
    turned = heading[-1] + np.concatenate([[0.0], np.cumsum(0.5 * (curvature[1:] + curvature[:-1]) * steps)])
    middle = 0.5 * (turned[1:] + turned[:-1])
    points = pattern.points[-1] + np.cumsum(np.stack([np.cos(middle), np.sin(middle)], 1) * steps[:, None], axis=0)
    return _Path(
        np.concatenate([pattern.arc_length, pattern.length + s[1:]]),
        np.concatenate([pattern.points, points]),
        np.concatenate([heading, turned[1:]]),
        np.concatenate([pattern.curvature, curvature[1:]]),
    )


@dataclass(frozen=True)
class _Piece:
    """Poses along a parameter that runs smoothly in time; `reach` is the way that the speed counts along it [m]."""

    parameter: FloatArray
    positions: FloatArray
    quaternions: FloatArray  # (w, x, y, z), continuous
    reach: float
    laying: bool = False

    def duration(self, speed: float) -> float:
        if not self.laying:
            return max(1.0, 1.875 * self.reach / speed)  # a quintic's greatest speed is 1.875 times its mean
        return self.reach / speed + self._ramp()

    def _ramp(self) -> float:
        return 2.0  # [s] to reach the speed, and to stop

    def _progress(self, share: FloatArray, speed: float) -> FloatArray:
        """Share of the parameter at shares of the duration."""
        if not self.laying:
            return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        duration, ramp = self.duration(speed), self._ramp()
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
        """Speed at which the acceleration along the piece reaches its share of gravity's [m/s]."""
        from scipy.interpolate import CubicSpline

        bend = np.linalg.norm(CubicSpline(self.parameter, self.positions)(self.parameter, 2), axis=1)
        return float(np.sqrt(_FASTEST_SHARE * _GRAVITY / max(bend.max(), 1e-6)))


def _way(cable: Cable, path: _Path, grasps: Grasp) -> _Piece:
    """Poses of the jaw while each place of the path is the lift-off point."""
    forward = _about_z(path.heading)
    positions = _on_floor(cable, path) + cable.gravito_bending_length * _turned(forward, grasps.position)
    rotations = _continuous(_product(forward, _from_vectors(grasps.rotation)))
    return _Piece(path.arc_length, positions, rotations, path.length, laying=True)


def _upright_way(cable: Cable, path: _Path) -> _Piece:
    """The jaw straight above the lift-off point, as high as what still hangs is long."""
    upright = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])  # x turned up
    rotations = _continuous(_product(_about_z(path.heading), np.broadcast_to(upright, (len(path.points), 4))))
    positions = _on_floor(cable, path)
    positions[:, 2] += cable.length - path.arc_length
    return _Piece(path.arc_length, positions, rotations, path.length, laying=True)


def _on_floor(cable: Cable, path: _Path) -> FloatArray:
    return np.column_stack([path.points, np.full(len(path.points), cable.radius)])


def _touch_down(cable: Cable, path: _Path, way: _Piece) -> _Piece:
    """From the upright cable that stands on its free end to the first pose of laying."""
    lgb = cable.gravito_bending_length
    suspended = cable.length / lgb
    angles = np.linspace(_UPRIGHT, 0.0, _PIVOT_ANGLES)
    found = pivoting(suspended, angles, cable.stretch_stiffness)
    heading = np.full(_PIVOT_ANGLES, path.heading[0])
    forward = _about_z(heading)
    rolled = np.column_stack([-cable.radius * angles, np.zeros((_PIVOT_ANGLES, 2))])
    base = np.append(path.points[0], cable.radius)
    positions = base + _turned(forward, rolled + lgb * found.position)
    quaternions = _product(forward, _from_vectors(found.rotation))
    # The last pose is that of laying, exactly: a controller or a bent beginning may differ from the straight one.
    share = np.linspace(0.0, 1.0, _PIVOT_ANGLES)[:, None]
    blend = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    positions = positions + blend * (way.positions[0] - positions[-1])
    last = way.quaternions[0] * np.sign(way.quaternions[0] @ quaternions[-1])
    quaternions = _continuous(quaternions)
    quaternions = quaternions + blend * (last * np.sign(last @ quaternions[-1]) - quaternions[-1])
    reach = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    return _Piece(share[:, 0], positions, quaternions / np.linalg.norm(quaternions, axis=1)[:, None], reach)


def _hang(cable: Cable, down: _Piece, speed: float) -> _Piece:
    """Straight down to where touching down begins."""
    heights = np.linspace(_CLEARANCE, 0.0, 5)
    positions = down.positions[0] + np.column_stack([np.zeros((5, 2)), heights])
    return _Piece(np.linspace(0.0, 1.0, 5), positions, np.repeat(down.quaternions[:1], 5, axis=0), _CLEARANCE)


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
    """Of both signs of each quaternion the one near its predecessor."""
    agree = np.where((quaternions[1:] * quaternions[:-1]).sum(-1) < 0.0, -1.0, 1.0)
    return np.asarray(quaternions * np.concatenate([[1.0], np.cumprod(agree)])[:, None])
