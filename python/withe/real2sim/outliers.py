"""Outliers: tags that jump in one frame relative to their residuals in the neighbouring frames."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from withe.real2sim.least_squares import Decomposed, FrameSolution
from withe.real2sim.results import Outlier

__all__ = ["find_outliers"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_AROUND = 6  # frames, nearest to one, with which a tag is compared
_ALIGNMENTS = 2  # number of alignments of frames with each other; further ones change little
_FEWEST = 4  # least number of frames; one of them may have an outlier
_JUMP = 4.0  # times the usual error; of normal ones, 7 sigma in pixels and 9 in space
_LEVERAGE = 0.1  # least visible share of a jump: below it, the other data hardly determine the tag


def find_outliers(
    residuals: FloatArray, solutions: dict[int, FrameSolution], per_frame: BoolArray, least: float
) -> tuple[tuple[Outlier, ...], BoolArray]:
    """Find tags that jump, and the tags that could be checked.

    A tag is compared with a line through its residuals in the neighbouring frames. These residuals are first aligned
    with each other, because other tags may be missing in each frame. A tag that jumps also pulls the fit, and thereby
    displaces other tags. Let H be the projector onto the range of the frame's unknowns, and r the jumps. If tag i is
    left out, the jumps become r + H_i (1 - H_ii)^-1 r_i [Cook and Weisberg 1982]. The sum of squares then decreases by
    r_i^T (1 - H_ii)^-1 r_i. This decrease, over the variance of the line's prediction, is the squared error of the tag,
    independent of its leverage and frame. Among the tags with too great an error, the tag with the greatest decrease is
    left out first.

    Parameters
    ----------
    residuals : ndarray of shape (frames, tags, 2 or 3) [px or m]
    solutions : dict of int to FrameSolution
    per_frame : ndarray of bool
        True for unknowns that differ from frame to frame.
    least : float [px or m]
        Lower bound of the usual error.

    Returns
    -------
    outliers : tuple of Outlier
    checked : ndarray of bool of shape (frames, tags)
        False for tags that were not seen, or that too few neighbouring frames or other tags can check.
    """
    own = {
        frame: s.jacobian[:, per_frame] if s.jacobian.shape[1] == len(per_frame) else s.jacobian
        for frame, s in solutions.items()
    }
    expected, spread = _lines(residuals)
    for _ in range(_ALIGNMENTS):
        expected, spread = _lines(_aligned(residuals, expected, own))
    frames = {f: _Frame(residuals[f] - expected[f], jacobian, spread[f]) for f, jacobian in own.items()}
    sizes = np.full(residuals.shape[:2], np.nan)
    for frame, each in frames.items():
        sizes[frame] = each.left_out(each.compared).errors
    checked = np.isfinite(sizes)
    if not checked.any():
        return (), checked
    usual = max(1.4826 * float(np.median(sizes[checked])), least)
    found = [
        Outlier(frame, tag, jump, usual)
        for frame, each in frames.items()
        if np.nanmax(sizes[frame], initial=0.0) > _JUMP * usual
        for tag, jump in each.jumping(_JUMP * usual)
    ]
    return tuple(found), checked


def _lines(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Predict each value from the neighbouring frames by a line, because errors of the model drift.

    The line is fitted by repeated medians, which a few outliers do not move [Siegel 1982]. NaN with too few frames.

    Returns
    -------
    expected : ndarray of shape (frames, tags, dimension)
    spread : ndarray of shape (frames, tags)
        Variance of (value - expected), over the variance of a value, as for a line by least squares.
    """
    expected, spread = np.full_like(values, np.nan), np.full(values.shape[:2], np.nan)
    for tag in range(values.shape[1]):
        seen = np.flatnonzero(np.isfinite(values[:, tag]).all(axis=1))
        count = min(_AROUND, len(seen) - 1)
        if count < _FEWEST:
            continue
        at = seen[_others(seen, count)]
        away = (at - seen[:, None]).astype(float)
        there = values[at, tag]
        pairs = np.array([[j for j in range(count) if j != i] for i in range(count)])
        rises = (there[:, pairs] - there[:, :, None]) / (away[:, pairs] - away[:, :, None])[..., None]
        slope = np.median(np.median(rises, axis=2), axis=1)
        expected[seen, tag] = np.median(there - away[:, :, None] * slope[:, None], axis=1)
        middle = away.mean(axis=1)
        spread[seen, tag] = 1.0 + 1.0 / count + middle**2 / ((away - middle[:, None]) ** 2).sum(axis=1)
    expected[spread > 1.0 / _LEVERAGE] = np.nan
    return expected, spread


def _aligned(residuals: FloatArray, expected: FloatArray, own: dict[int, FloatArray]) -> FloatArray:
    """Return residuals after the change of the unknowns of each frame that is closest to expected residuals.

    A model has residuals in every frame. If a tag is missing, the unknowns compensate less of them, and all residuals
    of the frame shift. This function removes the shift, so that frames with different visible tags are comparable.
    """
    aligned = residuals.copy()
    for frame, jacobian in own.items():
        away = (expected[frame] - residuals[frame]).ravel()
        compared = Decomposed(np.where(np.isfinite(away)[:, None], jacobian, 0.0))
        aligned[frame] += (jacobian @ compared.bounded(np.nan_to_num(away), np.inf)).reshape(aligned[frame].shape)
    return aligned


def _others(seen: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.int64]:
    """For each of some frames, which others of them are nearest to it: consecutive ones, shape (frames, count)."""
    own = np.arange(len(seen))
    first = np.clip(own[:, None] - np.arange(count + 1), 0, len(seen) - 1 - count)
    farthest = np.maximum(seen[first + count] - seen[:, None], seen[:, None] - seen[first])
    others = first[own, farthest.argmin(axis=1)][:, None] + np.arange(count)
    return np.asarray(others + (others >= own[:, None]))


class _LeftOut(NamedTuple):
    """Return the error of each tag if the fit omits it, the decrease of the sum of squares, and the jump of the tag.

    Errors and decreases are NaN for tags that no other data can check.
    """

    errors: FloatArray
    explained: FloatArray
    jumps: FloatArray


class _Frame:
    """Distances of a frame's tags from their prediction, shape (tags, dimension), and the range of the unknowns."""

    def __init__(self, jumps: FloatArray, jacobian: FloatArray, spread: FloatArray) -> None:
        self._jumps, self._jacobian, self._spread = np.nan_to_num(jumps), jacobian, spread
        self.compared: BoolArray = np.asarray(np.isfinite(jumps).all(axis=1))

    def left_out(self, kept: BoolArray) -> _LeftOut:
        """Return the errors of each kept tag if this tag is left out."""
        tags, dimension = self._jumps.shape
        basis = Decomposed(self._jacobian * np.repeat(kept, dimension)[:, None]).range
        jump = np.where(kept[:, None], self._jumps, 0.0).ravel()
        rest = (jump - basis @ (basis.T @ jump)).reshape(tags, dimension)
        rows = basis.reshape(tags, dimension, basis.shape[1])
        alone = np.eye(dimension) - rows @ rows.transpose(0, 2, 1)
        told = kept & (np.linalg.eigvalsh(alone)[:, 0] >= _LEVERAGE)
        alone[~told] = np.eye(dimension)
        deleted = np.linalg.solve(alone, rest[:, :, None])[:, :, 0]
        explained = np.where(told, (rest * deleted).sum(axis=1), np.nan)
        return _LeftOut(np.sqrt(explained / self._spread), explained, np.linalg.norm(deleted, axis=1))

    def jumping(self, limit: float) -> list[tuple[int, float]]:
        """Tags to leave out, one after the other, half of them at most, each with how far it jumps."""
        kept = self.compared.copy()
        found: list[tuple[int, float]] = []
        while 2 * len(found) < np.count_nonzero(self.compared):
            errors, explained, jumps = self.left_out(kept)
            if not np.nanmax(errors, initial=0.0) > limit:
                break
            tag = int(np.argmax(np.where(errors > limit, explained, 0.0)))
            found.append((tag, float(jumps[tag])))
            kept[tag] = False
        return found
