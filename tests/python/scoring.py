"""Agreement of a tracing with the truth of a synthetic scene."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment


@dataclass
class Score:
    """Result of a comparison; distances in px, infinite if the count or the order is wrong."""

    right: bool
    count: int
    distance: float
    tip: float


def _resampled(line, closed):
    line = np.vstack([line, line[:1]]) if closed else line
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    places = np.arange(0, arc[-1])
    if not closed:
        places = np.append(places, arc[-1])
    return np.stack([np.interp(places, arc, line[:, k]) for k in (0, 1)], axis=1)


def _to_segments(points, line):
    start, d = line[:-1], np.diff(line, axis=0)
    t = np.clip(np.einsum("psk,sk->ps", points[:, None] - start, d) / np.maximum((d * d).sum(1), 1e-12), 0, 1)
    apart = points[:, None] - start - t[..., None] * d
    return np.hypot(apart[..., 0], apart[..., 1])


def _one_way(line, other, skip, closed):
    """Largest distance of a line to the same stretch of the other one: lines in another order are far apart."""
    distance = _to_segments(line, np.vstack([other, other[:1]]) if closed else other)
    place = np.arange(len(line))[:, None] * (len(other) - 1) / max(len(line) - 1, 1)
    apart = np.abs(place - np.arange(distance.shape[1]))
    if closed:
        apart = np.minimum(apart, len(other) - apart)
    nearest = np.where(apart < 15, distance, np.inf).min(axis=1)
    nearest = nearest if closed else nearest[skip : len(line) - skip]
    return nearest.max(initial=0)


def _compare(found, found_closed, true, true_closed, scale):
    if found_closed != true_closed or len(found) < 2:
        return np.inf, np.inf
    found, true = _resampled(found, found_closed), _resampled(true, true_closed)
    best = (np.inf, np.inf)
    skip = round(12 * scale)
    for line in (found, found[::-1]):
        if true_closed:
            line = np.roll(line, -np.argmin(np.hypot(*(line - true[0]).T)), axis=0)
            tip = 0.0
        else:
            tip = max(np.hypot(*(line[0] - true[0])), np.hypot(*(line[-1] - true[-1])))
            if tip > 30:
                continue
        distance = max(_one_way(line, true, skip, true_closed), _one_way(true, line, skip, true_closed))
        best = min(best, (distance, tip))
    return best


def score(scene, tracing, tolerance=2.0, tip_tolerance=5.0):
    """Right when the count is, every centreline is in order within the tolerance of the true one, and it of ours."""
    scale = max(1.0, np.mean(scene.widths) / 10)
    count = len(tracing.centrelines)
    if count != len(scene.centrelines):
        return Score(False, count, np.inf, np.inf)
    pairs = [
        [
            _compare(tracing.centrelines[i], tracing.closed[i], scene.centrelines[j], scene.closed[j], scale)
            for j in range(count)
        ]
        for i in range(count)
    ]
    cost = np.array([[min(pair[0], 1e3) for pair in row] for row in pairs])
    rows, columns = linear_sum_assignment(cost)
    distance = max(pairs[i][j][0] for i, j in zip(rows, columns, strict=True))
    tip = max(pairs[i][j][1] for i, j in zip(rows, columns, strict=True))
    return Score(distance <= tolerance and tip <= tip_tolerance, count, float(distance), float(tip))
