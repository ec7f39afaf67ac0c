"""The last part of a fold whose edge would have to be pressed down: quickly, and found by trying it on a simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.progress import progress as progress_bar
from withe.folding.plans import Plan
from withe.folding.sheets import at_forces, forces_of
from withe.folding.simulated_sheet import Fold, SimulatedSheet

__all__ = ["plunge"]

FloatArray = npt.NDArray[np.float64]
_HEIGHTS = (1.0, 0.6)  # from which it goes down [Lgb]
_DURATIONS = (0.1, 0.05)  # [s]
_CORRECTIONS = 4
_ENOUGH = 2e-4  # [m]
_HOLDING = 0.3  # in the end [s]


def plunge(plan: Plan, *, press: float = 5e-4, sheet: Mapping[str, Any] | None = None, progress: bool = True) -> Plan:
    """End a plan quickly, and with the edge pressed onto the sheet that it comes down on.

    Where more friction is needed in the end than there is, the edge is drawn back or pushed on as it comes down slowly.
    It is led down within .05 or .1 s instead, before the sheet can follow, and `press` lower than it can go: the jaw
    yields, and presses both layers on the table with that times its stiffness, up to its force limit, so that they
    stay. From where, how fast, and how much to the side it goes is tried on a `SimulatedSheet` of the plan's paper
    without noise: of four ways that on which the sheet slides least, corrected by where the edge comes down.

    Parameters
    ----------
    plan : Plan
    press : float [m]
    sheet : mapping, optional
        Options of `SimulatedSheet`.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    Plan
        What is predicted of its last part is NaN. Its speed there is beyond its limits.

    Raises
    ------
    ValueError
        Not a plan, or one that is not over its target in the end; a press that is not positive; no way on which the
        simulated sheet is folded.

    Examples
    --------
    >>> import withe
    >>> paper = withe.folding.Paper.us_letter()
    >>> slow = withe.folding.plan(paper, 0.2, method="slip", grasp="free")  # doctest: +SKIP
    >>> withe.folding.SimulatedSheet(paper).fold(withe.folding.plunge(slow)).error  # doctest: +SKIP
    """
    if not isinstance(plan, Plan):
        raise ValueError(f"plan must be a Plan, got {plan!r:.80}")
    press = validation.positive(press, "press")
    ways = list(product(_HEIGHTS, _DURATIONS))
    with progress_bar(len(ways) + _CORRECTIONS, "plunging", progress) as bar:

        def tried(height: float, duration: float, aside: float) -> tuple[Plan, Fold]:
            way = _plunging(plan, height, duration, aside, press)
            done = SimulatedSheet(plan.paper, jaw=plan.jaw, **(sheet or {})).fold(way, progress=False)
            bar.advance(1)
            return way, done

        first = [(way, tried(*way, 0.0)) for way in ways]
        folded = [(way, found) for way, found in first if found[1].failure is None]
        if not folded:
            reasons = ", ".join(dict.fromkeys(str(found[1].failure) for _, found in first))
            raise ValueError(f"plan must end where an edge can be pressed down: no plunge folds the sheet ({reasons})")
        (height, duration), best = min(folded, key=lambda each: abs(each[1][1].slide))
        aside, last = 0.0, best
        for _ in range(_CORRECTIONS):
            if abs(best[1].error) < _ENOUGH or last[1].failure is not None:
                break
            aside -= 2.0 * last[1].error
            last = tried(height, duration, aside)
            if last[1].failure is None and abs(last[1].error) < abs(best[1].error):
                best = last
    return best[0]


def _plunging(plan: Plan, height: float, duration: float, aside: float, press: float) -> Plan:
    """The plan down to a height [Lgb], then straight to its end, `aside` further in x, and `press` too low."""
    z = plan.poses[:, 2]
    over = (plan.angles > 0.5 * np.pi) & (z < height * plan.paper.gravito_bending_length)
    if not over.any():
        raise ValueError("plan must come down in the end: its edge is never low and turned over")
    keep = max(2, int(np.argmax(over)))
    x_end, z_end, angle = plan.target + aside, plan.paper.thickness - press, plan.angles[-1]
    end = np.array([x_end, 0.0, z_end, 0.0, np.sin(0.5 * angle), 0.0, np.cos(0.5 * angle)])
    start = plan.times[keep - 1]
    times = [*plan.times[:keep], start + duration, start + duration + _HOLDING]
    known = forces_of(plan.sheet)[:keep]
    foreseen = at_forces(np.vstack([known, np.full((2, 3), np.nan)]))
    return replace(
        plan,
        poses=np.vstack([plan.poses[:keep], end, end]),
        angles=np.concatenate([plan.angles[:keep], [angle, angle]]),
        times=np.array(times),
        _foreseen=foreseen,
    )
