"""Fits of parameters to a motion that a camera saw."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.progress import Progress
from withe.common.progress import progress as progress_bar
from withe.common.user_warnings import warn
from withe.errors import CoarseStepWarning, ConvergenceError
from withe.real2sim.gathering import gather
from withe.real2sim.least_squares import Secants, lone_frame, seen
from withe.real2sim.parsing import parse_unknowns
from withe.real2sim.results import Fit
from withe.real2sim.scalar_methods import minimise_by
from withe.real2sim.targets import Residual, Target, bind, frames_of
from withe.real2sim.unknowns import Coordinates, Delay, Unknown
from withe.recording.record import Record
from withe.simulation.motion import POSE_WORDS
from withe.simulation.simulation import Simulation
from withe.simulation.snapshots import Snapshot

__all__ = ["fit_motion"]

FloatArray = npt.NDArray[np.float64]

_DIFFERENCE = 1e-4  # step of differences, relative to the scale of an unknown
_RUNS = 8  # iterations that a progress bar counts on
_MANY_STEPS = 100_000  # greatest number of steps of a run
_MANY_SWINGS = 10.0  # greatest number of oscillations between frames
_ORDERS = {"backward_euler": 1, "fourth_order": 4}  # orders of integrators in the time step; others have order 2
_CHANGE = 1e-9  # relative to the sum of squares: least change in an iteration of L-BFGS


@keyword_hints
def fit_motion(
    simulation: Simulation,
    targets: Target | Sequence[Target],
    unknowns: Sequence[Any],
    *,
    begin: Callable[[Simulation], object] | None = None,
    delay: float = 0.0,
    method: Literal["gauss_newton", "lbfgs"] = "gauss_newton",
    max_iterations: int = 50,
    progress: bool = True,
) -> Fit:
    """Fit parameters so that a run matches targets in all frames.

    The result is the local minimum near the initial guess. A ringing rod has many minima: with two or three times the
    true stiffness, the run is soon a whole period ahead. If sigma is given and residuals are much larger than sigma,
    `Fit.reasons` reports it: fit the first periods only and begin with their result, try another initial guess, or use
    ``method="lbfgs"``.

    Parameters
    ----------
    simulation : Simulation
        Simulation in the initial state of the motion; its values are the initial guess. It is not changed.
    targets : Tags, Centrelines, Curvatures, or several
        Targets with the times of their frames, from the start of the motion.
    unknowns : sequence
        Unknowns as in `fit`, also viscosity, viscous_time, drag, damping and friction. Natural curvature is constant
        during the motion. With unknown supports, `begin` must find an equilibrium. "delay" is the delay of the clock of
        the targets: their time t is t + delay in the run, never less than 0.
    begin : callable, optional
        Called with a simulation before each run, after its parameters are set, to find the initial equilibrium and to
        release it.
    delay : float [s]
        Delay of the clocks, or its initial guess.
    method : {"gauss_newton", "lbfgs"}
        "lbfgs" needs a run with a gradient, a planar scene if `begin` is given, and no unknown poses of supports or
        drawn nodes.
    max_iterations : int
        Maximum number of iterations.
    progress : bool
        True to show a progress bar on a terminal and in a notebook.

    Returns
    -------
    Fit
        Result with one row of values for the whole motion. `solves` counts runs. Outliers are not detected.

    Raises
    ------
    ValueError
        Targets without times or data, or an unknown that cannot be fitted.
    ConvergenceError
        The run fails with the initial guess.

    Warns
    -----
    UserWarning
        Frames are more than ten periods of the slowest mode apart, and a run has 100,000 time steps or more: the times
        may not be in seconds.

    Notes
    -----
    "gauss_newton" finds derivatives by finite differences at the beginning and at the end, one run per unknown, and
    updates them by secants in between. Derivatives by the delay are velocities. Positions between time steps follow
    from cubic polynomials. The method "lbfgs" finds the gradient by one pass backwards through each run
    (`Record.gradient`) for any number of unknowns, and makes one run per unknown at the end, for the covariance.

    The covariance includes errors of the discretisation. A run with half the time step estimates the error of the time
    step. Residuals that are correlated from frame to frame indicate an error of the mesh or model. `Fit.reasons` names
    an error that may change an unknown by more than 1 % of its scale.

    Examples
    --------
    >>> ringing = withe.real2sim.Tags(record.positions(arm)[1:, -1:], [arm.end], times=record.times[1:])
    >>> found = withe.real2sim.fit_motion(simulation, ringing, [(arm, "youngs_modulus")], progress=False)
    >>> print(f"{found.values[0, 0]:.4g} Pa")
    1e+06 Pa
    """
    listed = frames_of(targets)
    if any(target.times is None for target in listed):
        raise ValueError("times of targets must be given: give times= to each")
    times = np.asarray(listed[0].times)
    if any(not np.array_equal(target.times, times) for target in listed):
        raise ValueError("times of all targets must be the same")
    if not any(target.told(frame) for target in listed for frame in range(target.frames)):
        raise ValueError(f"targets must show something at some time, got nothing at all {len(times)}")
    copy = simulation.copy()
    late = validation.number(delay, "delay")
    words = [unknown for unknown in unknowns if isinstance(unknown, str)] if not isinstance(unknowns, str) else []
    if any(word != "delay" for word in words) or len(words) > 1:
        raise ValueError(f"unknowns must be tuples, or 'delay' once, got {words}")
    parsed: list[Unknown] = parse_unknowns(copy, unknowns if isinstance(unknowns, str) else _tuples(unknowns))
    if words:
        parsed.append(Delay(late, float(times[-1])))
    if not parsed:
        raise ValueError("unknowns must be at least one, got none")
    if times[0] + late < 0.0:
        raise ValueError(f"times plus delay must not be negative, got {times[0] + late:g} s")
    limit = validation.integer(max_iterations, "max_iterations", 1, 2**31 - 1)
    if method not in ("gauss_newton", "lbfgs"):
        raise ValueError(f"method must be 'gauss_newton' or 'lbfgs', got {method!r}")
    by_gradients = method == "lbfgs"
    if by_gradients:
        _check_gradients(copy, parsed, begin)
    _check_unit(copy, times)
    with progress_bar(_RUNS + 2 * len(parsed), "fitting", progress, unit="runs") as bar:
        motion = _Motion(copy, parsed, bind(listed, copy), times, late, begin, bar)
        free = np.ones(len(motion.names), bool)
        if by_gradients:
            motion.differentiable = True
            solution = minimise_by(motion, 0, motion.begin(), motion.slope, _CHANGE, limit)
        else:
            solution = lone_frame(motion, 0, motion.begin(), free, 1e-12, limit, Secants())
        step_error = motion.step_error(solution.coordinates, solution.residual)
    motion.per_frame = free
    return gather(motion, listed, {0: solution}, {0: motion.solves}, len(solution.residual), 1, step_error)


def _check_unit(simulation: Simulation, times: FloatArray) -> None:
    """Warn of times that may be in milliseconds: runs of very many steps, seen once in many of the slowest swings."""
    steps = float(times[-1]) / simulation.time_step
    between = float(np.diff(times).min() if len(times) > 1 else times[0])
    if steps < _MANY_STEPS:
        return
    slowest = abs(simulation.linearise().frequencies(1)[0])
    if between * slowest > _MANY_SWINGS:
        warn(
            f"times of targets are at least {between:.3g} s apart, which is {between * slowest:.3g} periods of the "
            f"slowest mode, and each run takes {steps:,.0f} time steps: are the times in milliseconds?",
            cause="times",
        )


def _check_gradients(
    simulation: Simulation, unknowns: list[Unknown], begin: Callable[[Simulation], object] | None
) -> None:
    instead = "use method='gauss_newton'"
    for unknown in unknowns:
        if any(isinstance(word, tuple) and word[1] in POSE_WORDS for word in unknown.words):
            raise ValueError(
                f"{unknown.names[0]} cannot be unknown with method='lbfgs', because supports move: {instead}"
            )
    if begin is not None and not simulation.plan.planar:
        raise ValueError(
            "begin with method='lbfgs' needs a planar scene, because in space directors turn with begin: " + instead
        )


def _tuples(unknowns: Sequence[Any]) -> list[Any]:
    return [unknown for unknown in unknowns if not isinstance(unknown, str)]


def _with_half_the_step(simulation: Simulation, start: Snapshot) -> Simulation:
    """Another of the same scene, at the same start, whose time step is half as long."""
    state = simulation.__getstate__()
    other = Simulation.__new__(Simulation)
    options = replace(state["options"], time_step=0.5 * simulation.time_step)
    other.__setstate__(state | {"options": options, "snapshot": start})
    return other


class _Motion(Coordinates):
    """One run, as the only frame of a fit."""

    def __init__(
        self,
        simulation: Simulation,
        unknowns: list[Unknown],
        residual: Residual,
        times: FloatArray,
        delay: float,
        begin: Callable[[Simulation], object] | None,
        bar: Progress,
    ) -> None:
        super().__init__(simulation, unknowns)
        self._start, self._begin, self._bar = simulation.snapshot(), begin, bar
        self._residual, self._times, self._delay = residual, times, delay
        self.solves, self._ran = 0, False
        self.differentiable = False
        self._record: Record
        self._left, self._share, self._gap = np.zeros(0, np.int64), np.zeros(0), np.zeros(0)

    def residual(self, coordinates: FloatArray, frame: int) -> tuple[FloatArray, FloatArray] | None:
        """Residuals of all times, one after the other, and `_shapes`; None where the run fails, but the first one."""
        try:
            self.simulation.restore(self._start)
            self.forget()
            self.write(coordinates)
            if self._begin is not None:
                self._begin(self.simulation)
            shapes = self._shapes(coordinates)
        except (ConvergenceError, ValueError):
            if not self._ran:
                raise
            return None
        self._ran = True
        return self._values(shapes[0]), shapes

    def jacobian(self, coordinates: FloatArray, state: FloatArray, frame: int) -> FloatArray:
        """By forward differences of runs, and by velocities."""
        now, columns = seen(self._values(state[0])), []
        late = self._place_of_delay()
        for i, scale in enumerate(self.scales):
            if i == late:
                columns.append(self._by_delay(state))
                continue
            step = np.zeros_like(coordinates)
            step[i] = _DIFFERENCE * scale
            ahead = self.residual(coordinates + step, frame)
            if ahead is None:
                raise ConvergenceError(f"a run with a small change of {self.names[i]} fails: use a shorter time step")
            columns.append((seen(ahead[0]) - now) / step[i])
        return np.stack(columns, axis=1)

    def step_error(self, coordinates: FloatArray, residual: FloatArray) -> FloatArray | None:
        """Error of residuals that the time step makes, by a run with half of it; None where that run fails.

        [Richardson 1911]: an error of order p is 2^p / (2^p - 1) times the difference.
        """
        half = _Motion(
            _with_half_the_step(self.simulation, self._start),
            self.unknowns,
            self._residual,
            self._times,
            self._delay,
            self._begin,
            self._bar,
        )
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", CoarseStepWarning)  # the fit itself has given it, of its own step
                found = half.residual(coordinates, 0)
        except (ConvergenceError, ValueError):
            return None
        assert found is not None
        order = _ORDERS.get(self.simulation._session.options.integrator, 2)
        return (seen(residual) - seen(found[0])) * (2.0**order / (2.0**order - 1.0))

    def slope(self, coordinates: FloatArray, state: FloatArray, residual: FloatArray) -> FloatArray:
        """Derivatives of half the sum of squares of the last run, by the adjoint method."""
        by_points = np.zeros_like(self._record.positions())
        by_speeds = np.zeros_like(by_points)
        first = 0
        by_seen = np.empty_like(state[0])
        for time, shape in enumerate(state[0]):
            derivative = np.nan_to_num(self._residual.derivative(shape, time))
            rows = slice(first, first + len(derivative))
            by_seen[time] = np.tensordot(residual[rows], derivative, 1)
            first = rows.stop
        s, gap = self._share, self._gap
        np.add.at(by_points, self._left + 1, (3 - 2 * s) * s**2 * by_seen)
        np.add.at(by_points, self._left, (1 - (3 - 2 * s) * s**2) * by_seen)
        np.add.at(by_speeds, self._left, gap * s * (1 - s) ** 2 * by_seen)
        np.add.at(by_speeds, self._left + 1, -gap * s**2 * (1 - s) * by_seen)
        *found, by_start, by_start_speeds = self._record.gradient(
            {"positions": self.in_plane(by_points), "velocities": self.in_plane(by_speeds)},
            [*self.words, "initial_positions", "initial_velocities"],
        )
        out, first = np.zeros(len(coordinates)), 0
        for unknown, place in zip(self.unknowns, self.slices, strict=True):
            if isinstance(unknown, Delay):
                out[place] = np.sum(by_seen * state[1])
                continue
            own = [[each] for each in found[first : first + len(unknown.words)]]
            out[place] = unknown.chain(coordinates[place], own)[0]
            first += len(unknown.words)
        if self._begin is not None:
            starts = self._starts(coordinates)
            out += np.tensordot(starts[0], by_start, 2) + np.tensordot(starts[1], by_start_speeds, 2)
        return out

    def _starts(self, coordinates: FloatArray) -> FloatArray:
        """Derivatives of positions and velocities at the start by the coordinates, (2, n, nodes, 3): differences."""
        assert self._begin is not None
        late, out = self._place_of_delay(), []
        for i, scale in enumerate(self.scales):
            ends = []
            for step in () if i == late else (_DIFFERENCE * scale, -_DIFFERENCE * scale):
                there = coordinates.copy()
                there[i] += step
                self.simulation.restore(self._start)
                self.forget()
                self.write(there)
                self._begin(self.simulation)
                ends.append(np.stack([self.simulation.positions(), self.simulation.velocities()]))
            nothing = np.zeros((2, *self.simulation.positions().shape))
            out.append((ends[0] - ends[1]) / (2.0 * _DIFFERENCE * scale) if ends else nothing)
        return np.stack(out, axis=1)

    def _values(self, positions: FloatArray) -> FloatArray:
        return np.concatenate([self._residual.value(shape, time) for time, shape in enumerate(positions)])

    def _by_delay(self, state: FloatArray) -> FloatArray:
        """Derivatives of the residual by the delay: everything is seen later, where it has moved on."""
        moving = zip(*state, strict=True)
        return np.concatenate(
            [
                np.tensordot(self._residual.derivative(shape, time), velocities, axes=2)
                for time, (shape, velocities) in enumerate(moving)
            ]
        )

    def _place_of_delay(self) -> int | None:
        places = zip(self.unknowns, self.slices, strict=True)
        return next((place.start for unknown, place in places if isinstance(unknown, Delay)), None)

    def _shapes(self, coordinates: FloatArray) -> FloatArray:
        """Positions [m] and velocities [m/s] at the times of the targets, (2, times, nodes, 3)."""
        late = self._place_of_delay()
        asked = self._times + (self._delay if late is None else float(coordinates[late]))
        if asked[0] < 0.0:
            raise ValueError("before the run")
        step = self.simulation.time_step
        duration = step * max(np.ceil(asked[-1] / step), 1.0)
        start = self.simulation.time
        record = self.simulation.run(
            float(duration), record_every=step, progress=False, differentiable=self.differentiable
        )
        self._record = record
        self.solves += 1
        self._bar.advance(1)
        knots, points, speeds = record.times - start, record.positions(), record.velocities()
        left = np.clip(np.searchsorted(knots, asked, side="right") - 1, 0, len(knots) - 2)
        self._left = left
        gap = (knots[left + 1] - knots[left])[:, None, None]
        share = (asked - knots[left])[:, None, None] / gap
        self._share, self._gap = share, gap
        # Cubic Hermite polynomials and their derivatives.
        jump = points[left + 1] - points[left]
        before, after = gap * speeds[left], gap * speeds[left + 1]
        positions = (
            points[left]
            + (3 - 2 * share) * share**2 * jump
            + share * (1 - share) * ((1 - share) * before - share * after)
        )
        velocities = (
            6 * share * (1 - share) * jump + (1 - share) * (1 - 3 * share) * before - share * (2 - 3 * share) * after
        ) / gap
        return np.stack([positions, velocities])
