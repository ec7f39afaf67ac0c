"""Last part of a fold whose edge must be pressed down: a quick plunge, found by trials on simulated sheets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.folding.jaw_motion import Motion
from withe.folding.planning import plan_above
from withe.folding.plans import FoldPlan
from withe.folding.sheets import at_forces, forces_of
from withe.folding.simulated_sheet import Held, SimulatedSheet
from withe.folding.watching import Part, shifted, watched_parts
from withe.folding.widths import free_width

__all__ = ["plunge"]

FloatArray = npt.NDArray[np.float64]
_HEIGHTS = (0.4, 0.6, 0.8, 1.0)  # heights over the target at which a plunge begins [Lgb]
_NO_SLIDE = 1e-4  # [m]
_SHORT = 0.2  # distance before the target in a second try [Lgb]: the sheet must lie under the edge
_CORRECTIONS = 4
_ENOUGH = 5e-5  # [m]
_CREASE = 0.5  # motion of the crease, relative to the edge
_HOLDING = 0.3  # time at the end [s]
_BESIDE = (0.0, -5e-4, 5e-4, 5e-4, -5e-4)  # errors of the jaw for sheets at the bounds [m]
_COARSE = {"edges": 75, "time_step": 0.02}  # for sheets at the bounds; creases have errors of about 0.02 mm


class _Tried:
    """One possible sheet of a paper. It is folded slowly once to the place where every plunge begins."""

    def __init__(self, slow: FoldPlan, sheet: SimulatedSheet, looks: int) -> None:
        self._sheet, self._target = sheet, slow.target
        self._held: Held | None = None
        self._from = slow.poses[-1:]
        self.slide = 0.0  # slide before a plunge begins [m]
        self._known = 0.0  # visible part of this slide [m]

        def motions() -> Iterator[Motion]:
            if not looks:
                yield slow
            else:
                for part in watched_parts(slow, looks, lambda _: sheet.slide):
                    yield part
                    self._from, self._known = part.poses[-1:], sheet.slide
            self._held, self.slide = sheet.hold(), sheet.slide

        sheet.carry_out(motions(), slow.target, duration=float(slow.times[-1]), progress=False)

    @property
    def snapped(self) -> bool:
        """Return True if the sheet snaps before a plunge could begin."""
        return self._held is None

    def missed(self, way: Part, aside: float = 0.0) -> tuple[float, float]:
        """Return the error of the crease and the slide beyond the seen slide [m]; infinite if the sheet snaps."""
        if self._held is None:
            return np.inf, np.inf
        own = Part(way.times, np.vstack([self._from, shifted(way.poses[1:], aside)]))
        fold = self._sheet.carry_on(self._held, [own], self._target)
        return (np.inf, np.inf) if fold.failure is not None else (fold.error, fold.slide - self._known)


@keyword_hints
def plunge(
    plan: FoldPlan,
    *,
    press: float = 2e-3,
    duration: float | Sequence[float] = (0.025, 0.05),
    within: float = 5e-3,
    replans: int = 0,
    sheet: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> FoldPlan:
    """End a plan by a quick motion that presses the edge onto the sheet.

    A slow end pulls the edge back or pushes it on if it needs more friction than there is. A plunge leads the edge down
    within `duration`, before the sheet can follow, and to `press` below the sheet. The jaw yields, and presses both
    layers on the table by `press` times its stiffness, up to its force limit, so that they stay in place.

    The plunge begins above the target. Its height is the least to which the jaw leads every sheet within the plan's
    `uncertainty` without slide, or the height of least friction. The plan is recomputed up to that height.

    Trials on simulated sheets without noise, those of `FoldPlan.papers`, choose the way down. They vary the sideways
    motion of the edge, the duration, and the final angle (level or as in the plan). Each way is aimed so that the
    nominal paper is folded exactly. Among the ways that fold all sheets, the chosen way has the smallest error on its
    worst sheet: the error of the crease plus half of the slide. For sheets at the bounds, the trials also displace the
    jaw by 0.5 mm to either side, so that the edge comes down on the sheet and not beside it.

    Parameters
    ----------
    plan : FoldPlan
        Plan with a slow end.
    press : float [m]
        Depth below the sheet to which the plunge leads the edge.
    duration : float or sequence of float [s]
        Duration of the way down, or the durations to try. The sheet slides farther in a longer plunge and is thrown
        more in a shorter one.
    within : float [m]
        Largest error of the crease on the worst of these sheets.
    replans : int
        Number of times that `fold` will look at the sheet and replan on the way. The trials replan as often, and only
        the slide during the plunge counts.
    sheet : mapping, optional
        Options of `SimulatedSheet`. By default sheets at the bounds have 75 edges.
    progress : bool
        True to show a progress bar.

    Returns
    -------
    FoldPlan
        Plan with `plunges_at`. The predictions of its last part are NaN, and its speed there exceeds the limits.

    Raises
    ------
    ValueError
        Not a plan, a plan that plunges already or does not end over its target, or numbers that are not positive. Also
        if no way folds all simulated sheets within bounds at the friction that the slow way needs.

    Examples
    --------
    >>> import withe
    >>> paper = withe.folding.Paper.us_letter()
    >>> slow = withe.folding.plan(paper, 0.2, method="slip", grasp="free", ending="slow")  # doctest: +SKIP
    >>> withe.folding.SimulatedSheet(paper).fold(withe.folding.plunge(slow)).error  # doctest: +SKIP
    """
    if not isinstance(plan, FoldPlan):
        raise ValueError(f"plan must be a FoldPlan, got {plan!r:.80}")
    if plan.plunges_at is not None:
        raise ValueError(f"plan must end slowly, but already plunges at {plan.plunges_at:.2f} s")
    press = validation.positive(press, "press")
    bound = validation.positive(within, "within")
    looks = validation.integer(replans, "replans", 0, 1000)
    durations = np.atleast_1d(validation.number_array(duration, "duration", (), ("n",)))
    if not durations.size or durations.min() <= 0.0:
        raise ValueError(f"duration must be positive, got {duration!r:.80}")
    slow, papers, lgb = _above(plan), plan.papers, plan.paper.gravito_bending_length
    angles = (np.pi, float(plan.angles[-1]))
    ways = [partial(_down, slow, angle, press, time) for angle, time in product(angles, durations.tolist())]
    with progress_bar(len(papers) + 2 * len(ways), "plunging", progress) as bar:
        tried: list[_Tried] = []
        for paper in papers:
            options = {"record_every": np.inf, **(sheet if sheet is not None else _COARSE if tried else {})}
            tried.append(_Tried(slow, SimulatedSheet(paper, jaw=plan.jaw, **options), looks))
            bar.advance(1)
            if tried[0].snapped:
                raise ValueError(f"no plunge is possible: the sheet snaps before the plunge begins; {_needs(plan)}")

        best: Part | None = None
        begin = 0.0  # shift of the last path that folds the sheet
        least = nearest = np.inf  # errors of the best path, and of the path with the nearest crease
        for down in ways:
            aside, aimed = _aimed(tried[0], down, _SHORT * lgb, begin)
            way, begin = down(aside), aside if abs(aimed[0]) <= bound else 0.0
            bar.advance(1)
            error = off = 0.0
            for each, beside in zip(tried, _BESIDE, strict=False):
                seen = each.slide - tried[0].slide if looks else 0.0
                crease, slide = aimed if each is tried[0] else each.missed(way, seen + beside)
                missed = abs(crease - 0.5 * beside)
                error, off = max(error, missed), max(off, missed, 0.5 * abs(slide))
                no_better = error >= nearest if best is None else error > bound or off >= least
                if no_better:
                    break
            else:
                nearest = min(nearest, error)
                best, least = (way, off) if error <= bound else (best, least)
            bar.advance(1)
    if best is None:
        raise ValueError(_missed(plan, nearest, bound))
    return _ended(slow, best, tried[0].slide)


def _aimed(
    sheet: _Tried, down: Callable[[float], Part], short: float, aside: float
) -> tuple[float, tuple[float, float]]:
    """Return the sideways shift of the edge that puts the crease in its place [m], and the remaining errors.

    The secant method starts from `aside`. The crease moves by about half of the shift of the edge.
    """
    missed = sheet.missed(down(aside))
    if not abs(missed[0]) <= short:  # the sheet slides back from under the edge
        aside = -short
        missed = sheet.missed(down(aside))
    slope = _CREASE
    for _ in range(_CORRECTIONS):
        if abs(missed[0]) < _ENOUGH or not abs(missed[0]) <= short:
            break
        other = aside - missed[0] / slope
        found = sheet.missed(down(other))
        if abs(found[0]) < abs(missed[0]):
            slope = float(np.clip((found[0] - missed[0]) / (other - aside), 0.5 * _CREASE, 2.0 * _CREASE))
            aside, missed = other, found
        else:  # too far: an edge may miss the sheet
            slope *= 2.0
    return aside, missed


def _above(plan: FoldPlan) -> FoldPlan:
    """The slow way to over the target."""
    best: tuple[tuple[float, float], FoldPlan] | None = None
    for height in _HEIGHTS:
        try:
            slow = plan_above(plan, height * plan.paper.gravito_bending_length)
        except ValueError:  # no pose of the grasp is there, or none connects with the flat sheet
            continue
        slides = slow.worst_slide[0], float(np.nanmax(slow.slip_ratio))
        if best is None or slides < best[0]:
            best = slides, slow
        if slides[0] <= _NO_SLIDE:
            break
    if best is None:
        raise ValueError(f"no plunge is possible: no path leads above the target; {_needs(plan)}")
    return best[1]


def _down(slow: FoldPlan, angle: float, press: float, duration: float, aside: float) -> Part:
    """From its last pose straight down to the target, `aside` further in x and `press` too low, and pressed there."""
    end = [slow.target + aside, 0.0, slow.paper.thickness - press, 0.0, np.sin(0.5 * angle), 0.0, np.cos(0.5 * angle)]
    times = slow.times[-1] + np.array([0.0, duration, duration + _HOLDING])
    return Part(times, np.vstack([slow.poses[-1], end, end]))


def _ended(slow: FoldPlan, way: Part, slide: float) -> FoldPlan:
    """A plan with a way down, for a sheet that has slid so far until then."""
    added = len(way.times) - 1
    angle = 2.0 * np.arctan2(way.poses[-1, 4], way.poses[-1, 6])
    forces = np.vstack([forces_of(slow.sheet), np.full((added, 3), np.nan)])
    return replace(
        slow,
        poses=np.vstack([slow.poses, way.poses[1:]]),
        angles=np.concatenate([slow.angles, np.full(added, angle)]),
        times=np.concatenate([slow.times, way.times[1:]]),
        plunges_at=float(slow.times[-1]),
        plunge_slide=slide,
        _foreseen=at_forces(forces, free_width(slow.paper, slow.jaw.depth)),
    )


def _missed(plan: FoldPlan, worst: float, bound: float) -> str:
    lgb, friction = (100.0 * share for share in plan.uncertainty)
    sheets = f"all sheets with Lgb off by up to {lgb:g} % and friction less by up to {friction:g} %"
    how = (
        f"the best misses by {1e3 * worst:.1f} mm for one sheet"
        if np.isfinite(worst)
        else "every path snaps for one sheet"
    )
    return f"no plunge folds {sheets} within {1e3 * bound:g} mm: {how}; without a plunge, {_needs(plan)}"


def _needs(plan: FoldPlan) -> str:
    needed = float(np.nanmax(plan.slip_ratio))
    return f"the fold would need friction {needed:.3f}, and the paper has {plan.paper.friction:g}"
