"""A plan in parts, whose rest is replanned after each part [dissertation, Alg. 8]."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.folding.planning import replan
from withe.folding.plans import FoldPlan
from withe.folding.timing import travel_times

__all__ = ["TOLERANCE", "Part", "shifted", "watched_parts"]

FloatArray = npt.NDArray[np.float64]
TOLERANCE = 5e-4  # a plan stays where the sheet has slid by less since it was made [m]


@dataclass(frozen=True)
class Part:
    """Poses from one stop of the jaw to the next."""

    times: FloatArray
    poses: FloatArray


def watched_parts(
    plan: FoldPlan,
    looks: int,
    look: Callable[[FloatArray], float],
    tolerance: float = TOLERANCE,
) -> Iterator[Part]:
    """Yield one part after the other. Each part is carried out before the next is requested.

    Parameters
    ----------
    plan : FoldPlan
    looks : int
        Number of looks, at equal distances along the path. The last look before a plunge shifts the plunge.
    look : callable
        Function of the jaw's pose that returns the slide of the sheet [m], NaN if it is not seen.
    tolerance : float [m]
    """
    present, plunge = plan.before_plunge(), _plunge(plan)
    poses, known = present.poses, plan.offset
    latest = known
    for left in range(looks, -1, -1):
        last = int(np.ceil((len(poses) - 1) / (max(left, 1) if plan.rise > 0.0 else left + 1)))
        yield _timed(poses[: last + 1], plan)
        poses = poses[last:]
        if left == 0:
            break
        seen = look(poses[0])
        if np.isfinite(seen):
            latest = seen
        if abs(latest - known) > tolerance:
            known = latest
            if len(poses) > 1:
                present, poses = _rest_of_plan(present, poses, known)
        if len(poses) == 1:
            break
    if plunge is not None:
        farther = latest - plan.offset - plan.plunge_slide  # additional slide since the plunge was planned
        yield Part(plunge.times, np.vstack([poses[-1:], shifted(plunge.poses[1:], farther)]))


def _rest_of_plan(present: FoldPlan, poses: FloatArray, slide: float) -> tuple[FoldPlan, FloatArray]:
    """Recompute the rest of a plan. Return it, and the poses from the first one at which the sheet can be held.

    Where the jaw is now, a sheet that has slid may be beyond the border of the manifold without moment.
    """

    def from_pose(begin: int) -> tuple[FoldPlan, FloatArray]:
        rest = replan(present, poses[begin], slide)
        return rest, np.vstack([poses[: begin + 1], rest.poses[1:]])

    last = len(poses) - 2
    for begin in range(last):
        try:
            return from_pose(begin)
        except ValueError:
            continue
    return from_pose(last)


def shifted(poses: FloatArray, slide: float) -> FloatArray:
    """Poses of a sheet that has slid so far along x."""
    moved = poses.copy()
    moved[:, 0] += slide
    return moved


def _plunge(plan: FoldPlan) -> Part | None:
    if plan.plunges_at is None:
        return None
    last = plan.times >= plan.plunges_at
    return Part(plan.times[last], plan.poses[last])


def _timed(poses: FloatArray, plan: FoldPlan) -> Part:
    angles = np.unwrap(2.0 * np.arctan2(poses[:, 4], poses[:, 6]))
    places = np.stack([poses[:, 0], poses[:, 2], angles], axis=1)
    return Part(travel_times(places, *plan.limits), poses)
