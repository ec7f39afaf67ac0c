"""Paths of the lift-off point that are improved by runs of the rod engine, until the cable lies on its pattern."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import get_args

import numpy as np
import numpy.typing as npt

from withe.common.progress import Progress
from withe.deployment.cable import Cable
from withe.deployment.feasibility import Method
from withe.deployment.motion import Path, Start, displaced
from withe.deployment.pattern import Pattern
from withe.deployment.world import Motion, Setup, lay
from withe.errors import ConvergenceError

__all__ = ["Trial", "optimised", "runs"]

FloatArray = npt.NDArray[np.float64]
MotionOf = Callable[[Path, Method], Motion]
_KNOTS = 1.0  # [Lgb] between the knots of the shift
_COLOURS = 7  # knots so far apart are shifted at the same time: each moves the cable 3.5 knots to either side
_PROBE = 5e-4  # [m], shift of knots for differences
_NODES, _NODES_PER_LGB = 100, 4  # nodes of the cable in the engine
_TIME_STEP = 0.2  # [s]
_PATH_POINTS_PER_LGB = 5
_DAMPING = 0.03  # relative to the greatest diagonal entry
_ROUNDS = 3  # number of derivatives by differences
_STEPS = 4  # steps of Gauss-Newton's method with each
_GOOD = 2e-4  # [m], below the accuracy of the engine with this mesh
_GAIN = 0.97  # greatest ratio of errors after and before a step; otherwise the search ends


@dataclass(frozen=True)
class Trial:
    """Shift of a path, its method of planning, and the distances of the laid cable from its places.

    The shapes are (knots + 3,), whose last three components move the path as a whole, and (nodes, 2) [m].
    """

    shift: FloatArray
    method: Method
    away: FloatArray

    @property
    def error(self) -> float:
        """Root mean square distance [m]."""
        return float(np.sqrt((self.away**2).sum(1).mean()))


class _Engine:
    """Simulation that lays the cable quasi-statically along paths, and returns its final positions."""

    def __init__(self, path: Path, setup: Setup, pattern: Pattern, motion_of: MotionOf, shown: Progress) -> None:
        self.setup, self.motion_of, self.shown = setup, motion_of, shown
        self.path = _thinned(path, _PATH_POINTS_PER_LGB / setup.cable.gravito_bending_length)
        self.spacing = _KNOTS * setup.cable.gravito_bending_length
        self.centres = _centres(path, pattern, self.spacing)
        self.basis = _splines(self.path, self.centres, self.spacing)
        s = self.setup.arc_length
        self.s = s[s <= pattern.length]
        self.places = np.stack([np.interp(self.s, pattern.arc_length, pattern.points[:, i]) for i in range(2)], 1)

    def trial(self, shift: FloatArray, method: Method) -> Trial | None:
        """Return a trial; None if there is no such path, or if the engine finds no equilibrium on it."""
        self.shown.advance(1)
        try:
            motion = self.motion_of(_shifted(self.path, self.basis, shift), method)
            _, laid, _ = lay(self.setup, motion, progress=False)
        except (ConvergenceError, ValueError):
            return None
        return Trial(shift, method, laid[: len(self.s), :2] - self.places)

    def aligned(self, trial: Trial) -> Trial:
        """The trial moved as a whole to where it misses least, which takes no run: the floor is the same everywhere.

        The laid cable turns and moves with its path, whose first point turns in its place.
        """
        first = self.path.points[0]
        back = _turn(-trial.shift[-1] / self.path.length)
        laid = (trial.away + self.places - first - trial.shift[-3:-1]) @ back  # without the rigid motion
        wanted = self.places - first
        centred, target = laid - laid.mean(0), wanted - wanted.mean(0)
        turned = np.stack([-centred[:, 1], centred[:, 0]], 1)
        angle = float(np.arctan2((turned * target).sum(), (centred * target).sum()))
        way = wanted.mean(0) - laid.mean(0) @ _turn(angle)
        shift = np.concatenate([trial.shift[:-3], way, [angle * self.path.length]])
        return Trial(shift, trial.method, way + laid @ _turn(angle) - wanted)

    def slopes(self, now: Trial) -> FloatArray:
        """Derivative of all distances by the shift, shape (2 nodes, knots + 3).

        By differences for knots. A path that moves as a whole takes the laid cable with it.
        """
        colours = min(len(self.centres), _COLOURS)
        owner = np.abs(self.s[:, None] - self.centres)
        slopes = np.zeros((len(self.s), 2, len(self.centres)))
        for colour in range(colours):
            knots = np.arange(colour, len(self.centres), colours)
            probe = now.shift.copy()
            probe[knots] += _PROBE
            trial = self.trial(probe, now.method)
            if trial is None:
                continue
            nearest = knots[owner[:, knots].argmin(1)]
            rows = np.flatnonzero(np.abs(self.s - self.centres[nearest]) < 0.5 * _COLOURS * self.spacing)
            slopes[rows, :, nearest[rows]] = (trial.away - now.away)[rows] / _PROBE
        laid = now.away + self.places
        arm = (laid - self.path.points[0] - now.shift[-3:-1]) / self.path.length
        turned = np.stack([-arm[:, 1], arm[:, 0]], 1)
        moved = np.broadcast_to(np.eye(2), (len(laid), 2, 2))
        return np.concatenate([slopes, moved, turned[:, :, None]], axis=2).reshape(2 * len(self.s), -1)


def optimised(
    path: Path,
    cable: Cable,
    pattern: Pattern,
    friction: float,
    motion_of: MotionOf,
    start: Start,
    shown: Progress,
) -> tuple[Path, Method]:
    """Shift a path sideways so that the cable comes to lie on its pattern, friction permitting.

    The shift is a cubic spline with a knot each Lgb, and a motion of the whole path. Finite differences give the
    response of the engine to a shift of each knot. Several distant knots share one run, because a shift moves the cable
    only nearby. Damped least squares [Levenberg 1944, Marquardt 1963] reduces the distances of the laid cable from its
    places. The derivative is updated after each trial [Broyden 1965]. The search starts from the better of the two
    controllers.

    Raises
    ------
    ConvergenceError
        The engine finds no equilibrium for either controller.
    """
    setup = Setup(
        cable=cable,
        friction=friction,
        nodes=max(_NODES, round(_NODES_PER_LGB * cable.length / cable.gravito_bending_length)),
        time_step=_TIME_STEP,
        quasi_static=True,
        start_held=start == "held",
    )
    engine = _Engine(path, setup, pattern, motion_of, shown)
    unshifted = np.zeros(len(engine.centres) + 3)
    tried = [trial for method in get_args(Method) if (trial := engine.trial(unshifted, method))]
    if not tried:
        raise ConvergenceError("the rod engine found no equilibrium along the path to be optimised")
    best = engine.aligned(min(tried, key=lambda trial: trial.error))
    for _ in range(_ROUNDS):
        if best.error < _GOOD:
            break
        before = best.error
        best = _descended(engine, best)
        if best.error > _GAIN * before:
            break
    return _shifted(path, _splines(path, engine.centres, engine.spacing), best.shift), best.method


def runs(path: Path, cable: Cable, pattern: Pattern) -> int:
    """Return the greatest number of runs of the engine."""
    knots = len(_centres(path, pattern, _KNOTS * cable.gravito_bending_length))
    return 2 + _ROUNDS * (min(knots, _COLOURS) + _STEPS)


def _thinned(path: Path, density: float) -> Path:
    """The path with fewer points, as many a length [1/m]."""
    count = max(20, round(density * path.length))
    s = np.linspace(0.0, path.length, min(count, len(path.points)))
    points = np.stack([np.interp(s, path.arc_length, path.points[:, i]) for i in range(2)], 1)
    return Path(s, points, *(np.interp(s, path.arc_length, row) for row in (path.heading, path.curvature)))


def _centres(path: Path, pattern: Pattern, spacing: float) -> FloatArray:
    """Arc lengths of the middles of splines; they leave the path's end alone, where the jaw lets go [m]."""
    last = min(pattern.length + spacing, path.length - 2.0 * spacing)
    return np.arange(-spacing, max(last, 0.0), spacing)


def _splines(path: Path, centres: FloatArray, spacing: float) -> FloatArray:
    """Cubic B-splines along the path, shape (points, knots)."""
    u = np.abs(path.arc_length[:, None] - centres) / spacing
    near, far = 2.0 / 3.0 - u**2 + 0.5 * u**3, np.maximum(2.0 - u, 0.0) ** 3 / 6.0
    return np.where(u < 1.0, near, far)


def _shifted(path: Path, basis: FloatArray, shift: FloatArray) -> Path:
    """The path shifted to its left, then moved, and turned about its beginning by an angle times its length."""
    bent = displaced(path, basis @ shift[:-3])
    angle = shift[-1] / path.length
    points = path.points[0] + shift[-3:-1] + (bent.points - path.points[0]) @ _turn(angle)
    return Path(bent.arc_length, points, bent.heading + angle, bent.curvature)


def _turn(angle: float) -> FloatArray:
    """Return the matrix that turns row vectors by an angle when multiplied from the right."""
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def _descended(engine: _Engine, best: Trial) -> Trial:
    """A few steps of damped least squares, from new slopes."""
    damping, slopes = _DAMPING, engine.slopes(best)
    for _ in range(_STEPS):
        square = slopes.T @ slopes
        scale = float(square.diagonal().max())
        step = -np.linalg.solve(square + damping * scale * np.eye(len(square)), slopes.T @ best.away.ravel())
        trial = engine.trial(best.shift + step, best.method)
        if trial is None:
            damping *= 10.0
            continue
        missed = (trial.away - best.away).ravel() - slopes @ step
        slopes = slopes + np.outer(missed, step) / (step @ step)
        if trial.error >= best.error:
            damping *= 10.0
            continue
        damping *= 0.3
        enough = trial.error < _GOOD or trial.error > _GAIN * best.error
        best = trial
        if enough:
            break
    return best
