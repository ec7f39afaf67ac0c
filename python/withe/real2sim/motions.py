"""Numbers for which a run looks like what a camera saw of a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.progress import Progress
from withe.common.progress import progress as progress_bar
from withe.errors import ConvergenceError
from withe.real2sim.gathering import gather
from withe.real2sim.least_squares import lone_frame
from withe.real2sim.results import Fit
from withe.real2sim.targets import Residual, Target, bind, frames_of
from withe.real2sim.unknowns import Coordinates, Delay, Unknown, parse_unknowns
from withe.simulation.simulation import Simulation

__all__ = ["fit_motion"]

FloatArray = npt.NDArray[np.float64]

_DIFFERENCE = 1e-4  # of the scale of an unknown
_RUNS = 6  # iterations that a progress bar counts on


def fit_motion(
    simulation: Simulation,
    targets: Target | Sequence[Target],
    unknowns: Sequence[Any],
    *,
    begin: Callable[[Simulation], object] | None = None,
    delay: float = 0.0,
    max_iterations: int = 50,
    progress: bool | Literal["always"] = True,
) -> Fit:
    """Find unknowns with which a run looks like targets, all frames together.

    Gauss-Newton on the residuals of all frames, by central differences of runs. Between time steps positions are those
    of cubic polynomials through positions and velocities.

    Parameters
    ----------
    simulation : Simulation
        In the state in which the motion begins; its numbers are the first guess. It is left as it is.
    targets : Tags, Centrelines, Curvatures, or several
        With the times of their frames, from the start of the motion.
    unknowns : sequence
        As in `fit`; viscosity, viscous_time, drag and friction show here too. Or "delay": how much later than the run's
        the clock of the targets began, so that their time t is t + delay in the run, never less than 0.
    begin : callable, optional
        Called with a simulation before each run, when its numbers are set: to find the equilibrium from which it is let
        go, which depends on them, and to let it go.
    delay : float [s]
        Of the clocks; the first guess if it is unknown.
    max_iterations : int
    progress : bool or "always"

    Returns
    -------
    Fit
        With one row of values, for the whole motion; `solves` counts runs.

    Raises
    ------
    ValueError
        Targets without times, or what cannot be unknown.

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
    with progress_bar(_RUNS * (2 * len(parsed) + 1), "fitting", progress, unit="runs") as bar:
        motion = _Motion(copy, parsed, bind(listed, copy), times, late, begin, bar)
        free = np.ones(len(motion.names), bool)
        solution = lone_frame(motion, 0, motion.begin(), free, 1e-12, limit)
    motion.per_frame = free
    return gather(motion, listed, {0: solution}, {0: motion.runs}, len(solution.residual), 1)


def _tuples(unknowns: Sequence[Any]) -> list[Any]:
    return [unknown for unknown in unknowns if not isinstance(unknown, str)]


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
        self.runs = 0

    def residual(self, coordinates: FloatArray, frame: int) -> tuple[FloatArray, FloatArray] | None:
        """Residuals of all times, one after the other; None where the run fails."""
        try:
            self.simulation.restore(self._start)
            self.forget()
            self.write(coordinates)
            if self._begin is not None:
                self._begin(self.simulation)
            positions = self._positions(coordinates)
        except (ConvergenceError, ValueError):
            return None
        values = [self._residual.value(shape, time) for time, shape in enumerate(positions)]
        return np.concatenate(values), positions

    def jacobian(self, coordinates: FloatArray, state: FloatArray, frame: int) -> FloatArray:
        """By central differences."""
        columns = []
        for i, scale in enumerate(self.scales):
            step = np.zeros_like(coordinates)
            step[i] = _DIFFERENCE * scale
            ahead, behind = self.residual(coordinates + step, frame), self.residual(coordinates - step, frame)
            if ahead is None or behind is None:
                raise ConvergenceError(
                    f"a run fails for {self.names[i]} a little off what it is: shorten its time step"
                )
            columns.append((ahead[0] - behind[0]) / (2.0 * step[i]))
        return np.stack(columns, axis=1)

    def _positions(self, coordinates: FloatArray) -> FloatArray:
        """Shapes at the times of the targets, (times, nodes, 3) [m]."""
        delay = self._delay
        for unknown, place in zip(self.unknowns, self.slices, strict=True):
            if isinstance(unknown, Delay):
                delay = float(coordinates[place][0])
        asked = self._times + delay
        if asked[0] < 0.0:
            raise ValueError("before the run")
        step = self.simulation.time_step
        duration = step * max(np.ceil(asked[-1] / step), 1.0)
        start = self.simulation.time
        record = self.simulation.run(float(duration), record_every=step, progress=False)
        self.runs += 1
        self._bar.advance(1)
        knots, points, speeds = record.times - start, record.positions(), record.velocities()
        left = np.clip(np.searchsorted(knots, asked, side="right") - 1, 0, len(knots) - 2)
        gap = (knots[left + 1] - knots[left])[:, None, None]
        share = (asked - knots[left])[:, None, None] / gap
        # Cubic Hermite polynomials.
        return np.asarray(
            (1 + 2 * share) * (1 - share) ** 2 * points[left]
            + share**2 * (3 - 2 * share) * points[left + 1]
            + gap * share * (1 - share) * ((1 - share) * speeds[left] - share * speeds[left + 1])
        )
