"""A simulated sheet while a jaw carries it: the end of the motion, and the detection of failed folds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from withe.common.progress import progress as progress_bar
from withe.common.user_warnings import warn
from withe.errors import ConvergenceError
from withe.folding.jaw_motion import JawMotion
from withe.parts.handles import Rod
from withe.simulation.simulation import Simulation

__all__ = ["FRAMES", "Watch", "carried"]

FRAMES = 0.05  # time between frames of a record [s]
_SETTLING = 0.5  # time after the last motion [s]
_SNAP = 10.0  # a sheet snaps if it is this many times as fast as the recent jaw,
_FAST = 0.2  # and faster than this [m/s]
_LONGEST = 600.0  # [s], or twice the expected duration, if that is longer
_SLIPS = 1e-3  # least slip in the jaw that causes a warning [m]


class Watch:
    """Watch a sheet after every step: request the next motion, and detect snaps.

    Attributes
    ----------
    max_speed : float [m/s]
    max_curvature : float [1/m]
        Greatest values so far.
    slip : float [m]
        Greatest slip of the sheet in the jaw.
    failure : str or None
        Reason of a failed fold.
    over : bool
        True if the fold has ended.
    """

    max_speed: float
    max_curvature: float
    slip: float
    over: bool

    def __init__(self, jaw: JawMotion, rods: Sequence[Rod]) -> None:
        self._jaw, self._rods = jaw, rods
        self._end: float | None = None
        self.max_speed = self.max_curvature = self.slip = 0.0
        self.over = False
        self.failure: str | None = None

    def __call__(self, simulation: Simulation) -> bool:
        """Return True if the fold is over."""
        speed = max(float((simulation.velocities(rod) ** 2).sum(axis=1).max()) for rod in self._rods) ** 0.5
        curvature = max(float(np.abs(simulation.curvatures(rod)).max()) for rod in self._rods)
        self.max_speed = max(self.max_speed, speed)
        self.max_curvature = max(self.max_curvature, curvature)
        if speed > _FAST and speed > _SNAP * self._jaw.lately(simulation.time):
            self.failure = f"snapped at {simulation.time:.2f} s"
        if self._end is None and simulation.time > self._jaw.end - 1e-9 and not self._jaw.go_on():
            self._end = self._jaw.end + _SETTLING
        self.over = self.failure is not None or (self._end is not None and simulation.time > self._end - 1e-9)
        return self.over


def carried(
    simulation: Simulation,
    jaw: JawMotion,
    rods: Sequence[Rod],
    hands: Sequence[str],
    duration: float,
    progress: bool,
    record_every: float = FRAMES,
) -> Watch:
    """Run until the jaw has done its motions and the sheet has settled, or until it snaps.

    `hands` are the parts of the jaw. `duration` [s] is the expected duration for a progress bar. `record_every` [s] is
    that of `Simulation.run`.

    Warns
    -----
    UserWarning
        The sheet slipped in the jaw.
    """
    watch = Watch(jaw, rods)
    longest = max(_LONGEST, 2.0 * duration)
    with progress_bar(duration + _SETTLING, "folding", progress) as bar:

        def ended(simulation: Simulation) -> bool:
            bar.update(simulation.time)
            return watch(simulation)

        def longest_step(simulation: Simulation) -> float:
            return jaw.longest_step(simulation.time, simulation.time_step)

        try:
            simulation.run(longest, record_every, progress=False, until=ended, longest_step=longest_step)
        except ConvergenceError as error:
            watch.failure = f"no solution: {error}"
    if not watch.over and watch.failure is None:
        watch.failure = f"not over after {simulation.time:.0f} s"
    watch.slip = max(float(np.linalg.norm(simulation.deflection(hand).slip)) for hand in hands)
    if watch.slip > _SLIPS:
        warn(
            f"the sheet slipped by {1e3 * watch.slip:.1f} mm in the jaw: increase force_limit of the Jaw",
            cause="slipped in the jaw",
        )
    return watch
