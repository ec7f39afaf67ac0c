"""The last part of a fold whose edge would have to be pressed down: quickly, and found by trying it on simulations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.progress import progress as progress_bar
from withe.folding.planning import plan_above
from withe.folding.plans import Plan
from withe.folding.sheets import at_forces, forces_of
from withe.folding.simulated_sheet import Held, SimulatedSheet
from withe.folding.widths import free_width

__all__ = ["plunge"]

FloatArray = npt.NDArray[np.float64]
_HEIGHTS = (0.4, 0.6, 0.8, 1.0)  # over the target, from which it goes down [Lgb]
_NO_SLIDE = 1e-4  # [m]
_SHORT = 0.2  # of the target, of a second try [Lgb]: where a sheet has slid back, it must lie under its edge
_CORRECTIONS = 4
_ENOUGH = 5e-5  # [m]
_HOLDING = 0.3  # in the end [s]
_COARSE = {"edges": 75}  # of sheets at the bounds, whose creases need not be known to a tenth of a millimetre


@dataclass(frozen=True)
class _Part:
    """Of a plan's poses."""

    times: FloatArray
    poses: FloatArray


class _Tried:
    """One sheet that a paper may be: led slowly to where plunges begin, once, and from there by every one of them."""

    def __init__(self, slow: Plan, sheet: SimulatedSheet) -> None:
        self._sheet, self._target = sheet, slow.target
        self._held: Held | None = None

        def motions() -> Iterator[Plan]:
            yield slow
            self._held = sheet.hold()

        sheet.carry_out(motions(), slow.target, duration=float(slow.times[-1]), progress=False)

    def missed(self, way: _Part) -> tuple[float, float]:
        """How far the crease is off, and how far the sheet slides [m]; infinite where it snaps."""
        fold = None if self._held is None else self._sheet.carry_on(self._held, [way], self._target)
        return (np.inf, np.inf) if fold is None or fold.failure is not None else (fold.error, fold.slide)


def plunge(
    plan: Plan,
    *,
    press: float = 2e-3,
    duration: float | Sequence[float] = (0.025, 0.05),
    within: float = 5e-3,
    sheet: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Plan:
    """End a plan quickly, and with the edge pressed onto the sheet that it comes down on.

    Where more friction is needed in the end than there is, the edge is drawn back or pushed on as it comes down slowly.
    It is led down within a `duration` instead, before the sheet can follow, and `press` lower than it can go: the jaw
    yields, and presses both layers on the table with that times its stiffness, up to its force limit, so that they
    stay. It goes down from over the target: from the least height to which the sheet is led without slide, whatever of
    the plan's `uncertainty` it is, or from where least friction is needed. A plan with a free moment is made anew up to
    there, others are cut off. How much to the side it goes, within what time, and whether the edge ends level or as the
    plan has it, is tried on simulated sheets without noise, those of `Plan.papers`: aimed so that the paper as it is
    thought to be is folded right, it is the way on which the worst of them is best, by how far its crease is off and
    by half of how far it slides, of those that fold all of them.

    Parameters
    ----------
    plan : Plan
    press : float [m]
    duration : float or sequence of float [s]
        Of the way down, or those that are tried. The longer it takes the farther the sheet may slide meanwhile, the
        shorter, the more it is thrown.
    within : float [m]
        How far off the crease may be on the worst of these sheets.
    sheet : mapping, optional
        Options of `SimulatedSheet`; by default sheets at the bounds have 75 edges.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    Plan
        With `plunges_at`. What is predicted of its last part is NaN. Its speed there is beyond its limits.

    Raises
    ------
    ValueError
        Not a plan, one that plunges already, or that is not over its target in the end; numbers that are not positive;
        no way on which all of the simulated sheets are folded within bounds, with the friction that the slow way needs.

    Examples
    --------
    >>> import withe
    >>> paper = withe.folding.Paper.us_letter()
    >>> slow = withe.folding.plan(paper, 0.2, method="slip", grasp="free", ending="slow")  # doctest: +SKIP
    >>> withe.folding.SimulatedSheet(paper).fold(withe.folding.plunge(slow)).error  # doctest: +SKIP
    """
    if not isinstance(plan, Plan):
        raise ValueError(f"plan must be a Plan, got {plan!r:.80}")
    if plan.plunges_at is not None:
        raise ValueError(f"plan must come down slowly, it plunges at {plan.plunges_at:.2f} s already")
    press = validation.positive(press, "press")
    bound = validation.positive(within, "within")
    durations = np.atleast_1d(validation.number_array(duration, "duration", (), ("n",)))
    if not durations.size or durations.min() <= 0.0:
        raise ValueError(f"duration must be positive, got {duration!r:.80}")
    slow, papers, lgb = _above(plan), plan.papers, plan.paper.gravito_bending_length
    angles = (np.pi, float(plan.angles[-1]))
    ways = [partial(_down, slow, angle, press, time) for angle, time in product(angles, durations.tolist())]
    with progress_bar(len(papers) + 2 * len(ways), "plunging", progress) as bar:
        tried: list[_Tried] = []
        for paper in papers:
            options = sheet if sheet is not None else _COARSE if tried else {}
            tried.append(_Tried(slow, SimulatedSheet(paper, jaw=plan.jaw, **options)))
            bar.advance(1)

        best: _Part | None = None
        least = nearest = np.inf  # of the best way, and how far the crease is off on that which comes nearest
        for down in ways:
            way = down(_aimed(tried[0], down, _SHORT * lgb))
            bar.advance(1)
            error = off = 0.0
            for each in tried:
                crease, slide = each.missed(way)
                error, off = max(error, abs(crease)), max(off, abs(crease), 0.5 * abs(slide))
                hopeless = error >= nearest if best is None else error > bound or off >= least
                if hopeless:
                    break
            else:
                nearest = min(nearest, error)
                best, least = (way, off) if error <= bound else (best, least)
            bar.advance(1)
    if best is None:
        raise ValueError(_missed(plan, nearest, bound))
    return _ended(slow, best)


def _aimed(sheet: _Tried, down: Callable[[float], _Part], short: float) -> float:
    """How far to the side the edge goes down so that a crease is where it should be [m]."""
    aside = 0.0
    error, _ = sheet.missed(down(aside))
    if not abs(error) <= short:  # its sheet slides back from under the edge
        aside = -short
        error, _ = sheet.missed(down(aside))
    share = 1.0
    for _ in range(_CORRECTIONS):
        if abs(error) < _ENOUGH or not abs(error) <= short:
            break
        other = aside - 2.0 * share * error
        found, _ = sheet.missed(down(other))
        if abs(found) < abs(error):
            aside, error = other, found
        else:  # too far: an edge may miss the sheet
            share *= 0.5
    return aside


def _above(plan: Plan) -> Plan:
    """The slow way to over the target."""
    lgb = plan.paper.gravito_bending_length
    best: tuple[tuple[float, float], Plan] | None = None
    for height in _HEIGHTS:
        slow = plan_above(plan, height * lgb) if plan.grasp == "free" else _cut(plan, height * lgb)
        slides = slow.worst_slide[0], float(np.nanmax(slow.slip_ratio))
        if best is None or slides < best[0]:
            best = slides, slow
        if slides[0] <= _NO_SLIDE:
            break
    assert best is not None
    return best[1]


def _cut(plan: Plan, height: float) -> Plan:
    """Up to where a plan is last so high."""
    low = (plan.angles > 0.5 * np.pi) & (plan.poses[:, 2] < height)
    if not low.any():
        raise ValueError("plan must come down in the end: its edge is never low and turned over")
    keep = slice(0, max(2, int(np.argmax(low))))
    foreseen = at_forces(forces_of(plan.sheet)[keep], free_width(plan.paper, plan.jaw.depth))
    return replace(plan, poses=plan.poses[keep], angles=plan.angles[keep], times=plan.times[keep], _foreseen=foreseen)


def _down(slow: Plan, angle: float, press: float, duration: float, aside: float) -> _Part:
    """From its last pose straight down to the target, `aside` further in x and `press` too low, and pressed there."""
    end = [slow.target + aside, 0.0, slow.paper.thickness - press, 0.0, np.sin(0.5 * angle), 0.0, np.cos(0.5 * angle)]
    times = slow.times[-1] + np.array([0.0, duration, duration + _HOLDING])
    return _Part(times, np.vstack([slow.poses[-1], end, end]))


def _ended(slow: Plan, way: _Part) -> Plan:
    """A plan with a way down."""
    added = len(way.times) - 1
    angle = 2.0 * np.arctan2(way.poses[-1, 4], way.poses[-1, 6])
    forces = np.vstack([forces_of(slow.sheet), np.full((added, 3), np.nan)])
    return replace(
        slow,
        poses=np.vstack([slow.poses, way.poses[1:]]),
        angles=np.concatenate([slow.angles, np.full(added, angle)]),
        times=np.concatenate([slow.times, way.times[1:]]),
        plunges_at=float(slow.times[-1]),
        _foreseen=at_forces(forces, free_width(slow.paper, slow.jaw.depth)),
    )


def _missed(plan: Plan, worst: float, bound: float) -> str:
    lgb, friction = (100.0 * share for share in plan.uncertainty)
    sheets = f"all sheets with Lgb off by up to {lgb:g} % and friction less by up to {friction:g} %"
    how = f"the best is off by {1e3 * worst:.1f} mm on one of them" if np.isfinite(worst) else "on each way one snaps"
    needed = float(np.nanmax(plan.slip_ratio))
    return (
        f"no plunge folds {sheets} within {1e3 * bound:g} mm: {how}; led down slowly, it would need friction "
        f"{needed:.3f}, and the paper has {plan.paper.friction:g}"
    )
