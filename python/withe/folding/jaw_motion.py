"""Pose of the jaw of a simulated robot over time: planned poses, one motion after another, and the tracking errors."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from copy import copy
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.folding.noise import Drawn
from withe.simulation.hands import RunningHand

__all__ = ["JawMotion", "Motion", "lead"]

FloatArray = npt.NDArray[np.float64]
_COMES_IN = 0.1  # share of the first motion over which the errors of the jaw grow
_FOLLOWS = 0.2  # [s]
_RINGS = 5  # times that, until oscillations have decayed
_RESOLVED = 2e-3  # longest path of an edge in a step [m]
_LANDING = 0.1  # time after a fast motion of an edge until steps may be longer [s]
_JUMP = np.array([1e-3, 1e-3, 0.05])  # between motions, at most [m], [m], [rad]


class Motion(Protocol):
    """Poses and times of the sheet's outer edge, as a `FoldPlan` has them."""

    @property
    def times(self) -> FloatArray:
        """Shape (n,) [s]."""

    @property
    def poses(self) -> FloatArray:
        """Return positions x, y, z [m] and quaternions x, y, z, w, shape (n, 7)."""


class _Way:
    """One motion: x, z [m] and angle by time."""

    def __init__(self, motion: Motion, begin: float, before: FloatArray) -> None:
        """From a time on; `before` is where the jaw is then."""
        times = validation.number_array(motion.times, "times of a motion", ("n",))
        poses = validation.number_array(motion.poses, "poses of a motion", (len(times), 7))
        if len(times) < 2 or (np.diff(times) <= 0).any():
            raise ValueError("times of a motion must be two or more increasing values")
        angles = np.unwrap(2.0 * np.arctan2(poses[:, 4], poses[:, 6]))
        angles += 2.0 * np.pi * np.round((before[2] - angles[0]) / (2.0 * np.pi))
        self.times = times - times[0] + begin
        self.poses = np.stack([poses[:, 0], poses[:, 2], angles], axis=1)
        if (np.abs(self.poses[0] - before) > _JUMP).any():
            where, asked = (f"({x:.4g} m, {z:.4g} m, {angle:.3g} rad)" for x, z, angle in (before, self.poses[0]))
            raise ValueError(f"poses of a motion must begin where the jaw is, at {where}, got {asked}")
        self._instants = self.times.tolist()
        self._speeds = np.hypot(*np.diff(self.poses[:, :2], axis=0).T) / np.diff(times)

    def speed(self, begin: float, end: float) -> float:
        """Greatest within a time [m/s]."""
        return float(self._speeds[self._part(begin) : self._part(end) + 1].max())

    def _part(self, time: float) -> int:
        """Between which two of its poses it is."""
        return min(max(bisect_right(self._instants, time) - 1, 0), len(self._speeds) - 1)

    def __call__(self, time: float) -> FloatArray:
        i = self._part(time)
        begin, end = self._instants[i], self._instants[i + 1]
        share = min(max((time - begin) / (end - begin), 0.0), 1.0)
        return np.asarray(self.poses[i] + share * (self.poses[i + 1] - self.poses[i]))


class JawMotion:
    """Successive motions. Each is requested when the previous one has ended, so it may depend on the result."""

    def __init__(self, motions: Iterable[Motion], drawn: Drawn) -> None:
        self._motions: Iterator[Any] = iter(motions)
        self._drawn = drawn
        self._way = _Way(next(self._motions), 0.0, np.zeros(3))
        self._comes_in = _COMES_IN * (self._way.times[-1] - self._way.times[0])

    def on_from_here(self, motions: Iterable[Motion]) -> JawMotion:
        """Other motions from the end of the present one on, for a jaw with the same past."""
        other = copy(self)
        other._motions = iter(motions)
        other.go_on()
        return other

    def lately(self, time: float) -> float:
        """Greatest recent speed of the edge [m/s], over the response time of the sheet.

        Earlier speeds count less and less, as the vibration of the sheet decays.
        """
        ages = _FOLLOWS * np.arange(_RINGS)
        return max(float(np.exp(-age / _FOLLOWS)) * self._way.speed(time - age - _FOLLOWS, time - age) for age in ages)

    def longest_step(self, time: float, longest: float) -> float:
        """Return the longest time step that resolves the motion of the jaw and the vibration that it excites [s].

        No time step goes beyond the end of a motion.
        """
        left = self.end - time
        longest = left if 1e-9 < left < longest else longest
        speed = self._way.speed(time - _LANDING, time + longest)
        return longest if speed * longest <= _RESOLVED else _RESOLVED / speed

    @property
    def end(self) -> float:
        """End of the present motion [s]."""
        return float(self._way.times[-1])

    def go_on(self) -> bool:
        """Start the next motion; return False if there is none."""
        motion = next(self._motions, None)
        if motion is None:
            return False
        self._way = _Way(motion, self.end, self._way.poses[-1])
        return True

    def __call__(self, time: float) -> FloatArray:
        """Return the pose of the outer edge at a time: x, z [m], angle. The table may displace the held part."""
        return self._way(time) + self._drawn.off(time, min(1.0, time / self._comes_in))


def lead(hand: RunningHand, flat: FloatArray, jaw: JawMotion, depth: float, y: float = 0.0) -> None:
    """Move a hand with a jaw that holds `depth` of a sheet, at y. The hand is at the middle of this part.

    `flat` is the rotation of the hand while the sheet is flat.
    """
    middle = 0.5 * depth

    def path(time: float) -> tuple[FloatArray, FloatArray]:
        x, z, angle = jaw(time)
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
        return np.array([x + middle * cosine, y, z - middle * sine]), turn @ flat

    hand.move(path=path)
