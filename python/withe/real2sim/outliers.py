"""Tags that jump in one frame against what a fit leaves of them in the frames around."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.real2sim.least_squares import Decomposed, FrameSolution
from withe.real2sim.results import Outlier

__all__ = ["find_outliers"]

FloatArray = npt.NDArray[np.float64]

_REACH = 3  # frames before and after, of which the running median is taken
_JUMP = 10.0  # times the usual scatter
_LEVERAGE = 0.1  # of 1 - H_ii: below it, hardly anything else tells what the tag does


def find_outliers(
    residuals: FloatArray, solutions: dict[int, FrameSolution], per_frame: npt.NDArray[np.bool_]
) -> tuple[Outlier, ...]:
    """Tags that jump.

    A tag that jumps pulls the fit with it, and other tags away. With H the projector onto what the frame's unknowns can
    explain, leaving tag i out changes the residuals r to r + H_i (1 - H_ii)^-1 r_i [Cook and Weisberg 1982]. The tag
    that explains most of a jump is left out first.

    Parameters
    ----------
    residuals : ndarray of shape (frames, tags, 2 or 3) [px or m]
    solutions : dict of int to FrameSolution
    per_frame : ndarray of bool
        Which unknowns every frame has of its own.
    """
    jumps = residuals - _running_median(residuals)
    sizes = np.linalg.norm(jumps, axis=2)
    if not np.isfinite(sizes).any():
        return ()
    usual = 1.4826 * float(np.nanmedian(sizes))
    found = []
    for frame in np.flatnonzero(np.nan_to_num(sizes).max(axis=1) > _JUMP * usual):
        jacobian = solutions[int(frame)].jacobian
        own = jacobian[:, per_frame] if jacobian.shape[1] == len(per_frame) else jacobian
        for tag, jump in _jumping(np.nan_to_num(jumps[frame]), own, _JUMP * usual):
            found.append(Outlier(int(frame), tag, jump, usual))
    return tuple(found)


def _running_median(values: FloatArray) -> FloatArray:
    """Median over frames as many before as after, which a steady drift does not move, in which the same tags were seen.

    What a model leaves in every frame shifts all residuals when a tag is missing. NaN where no two such frames are
    beside one: nothing is known of what is usual there.
    """
    medians = np.full_like(values, np.nan)
    seen = np.asarray(np.isfinite(values).all(axis=2))
    for frame in range(len(values)):
        alike = [
            other
            for step in range(1, _REACH + 1)
            for other in (frame - step, frame + step)
            if step <= min(frame, len(values) - 1 - frame) and np.array_equal(seen[other], seen[frame])
        ]
        if len(alike) >= 2:
            medians[frame] = np.median(values[[frame, *alike]], axis=0)
    return medians


def _jumping(jump: FloatArray, jacobian: FloatArray, limit: float) -> list[tuple[int, float]]:
    """Tags of a frame to leave out, one after the other, each with how far it jumps when it pulls no more."""
    tags, dimension = jump.shape
    rest, left_out = jump.copy(), np.zeros(tags, bool)
    found: list[tuple[int, float]] = []
    while True:
        kept = np.repeat(~left_out, dimension)
        basis = Decomposed(jacobian * kept[:, None]).range
        best, most, without = -1, 0.0, rest
        for tag in np.flatnonzero(~left_out & (np.linalg.norm(rest, axis=1) > 0.0)):
            rows = slice(tag * dimension, (tag + 1) * dimension)
            alone = np.eye(dimension) - basis[rows] @ basis[rows].T
            if np.linalg.eigvalsh(alone)[0] < _LEVERAGE:
                continue
            deleted = np.linalg.solve(alone, rest[tag])
            if rest[tag] @ deleted > most:
                best, most = int(tag), float(rest[tag] @ deleted)
                without = rest + (basis @ (basis[rows].T @ deleted)).reshape(tags, dimension)
        if most <= limit**2 or 2 * len(found) >= tags:
            return found
        found.append((best, float(np.linalg.norm(without[best]))))
        rest, left_out[best] = without, True
        rest[best] = 0.0
        if np.linalg.norm(rest, axis=1).max() <= limit:
            return found
