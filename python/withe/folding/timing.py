"""Timing of a jaw: from a path to times, within limits of speed and acceleration."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["evenly", "travel_times"]

FloatArray = npt.NDArray[np.float64]


def _lengths(poses: FloatArray, speed: float, turning: float) -> FloatArray:
    """Duration of each piece at full speed and full rate of turning [s]."""
    steps = np.diff(poses, axis=0)
    return np.asarray(np.sqrt((steps[:, 0] ** 2 + steps[:, 1] ** 2) / speed**2 + (steps[:, 2] / turning) ** 2))


def evenly(poses: FloatArray, count: int, speed: float, turning: float) -> FloatArray:
    """Places along a path (x, z, angle) that divide it into parts of equal travel, as fractional indices."""
    travelled = np.concatenate([[0.0], np.cumsum(_lengths(poses, speed, turning))])
    return np.interp(np.linspace(0.0, travelled[-1], count), travelled, np.arange(len(poses)))


def travel_times(poses: FloatArray, speed: float, turning: float, acceleration: float) -> FloatArray:
    """Times [s] at which a path from rest to rest passes its poses (x, z [m], angle).

    The path is p(q), where q is the time at full speed. With the rate u = dq/dt, dp/dt = p' u and d2p/dt2 = p'' u^2 +
    p' du/dt. Each of the two parts is bounded by half of the acceleration, and u <= 1. Angles count as lengths of speed
    / turning.
    """
    q = np.concatenate([[0.0], np.cumsum(np.maximum(_lengths(poses, speed, turning), 1e-9))])
    scaled = poses * [1.0, 1.0, speed / turning]
    slope = np.gradient(scaled, q, axis=0)
    bend = np.linalg.norm(np.gradient(slope, q, axis=0), axis=1)
    half = 0.5 * acceleration
    square = np.minimum(1.0, half / np.maximum(bend, 1e-12))  # u^2
    square[0] = square[-1] = 0.0
    gain = 2.0 * half / speed * np.diff(q)  # change of u^2 over a piece, at |p'| = speed
    for i in range(1, len(q)):
        square[i] = min(square[i], square[i - 1] + gain[i - 1])
    for i in range(len(q) - 1, 0, -1):
        square[i - 1] = min(square[i - 1], square[i] + gain[i - 1])
    rate = np.sqrt(square)
    return np.concatenate([[0.0], np.cumsum(2.0 * np.diff(q) / (rate[1:] + rate[:-1]))])
