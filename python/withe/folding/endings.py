"""Plans of folds with their endings: slow, or a plunge that simulations have found."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.user_warnings import warn
from withe.folding.jaw import Jaw
from withe.folding.paper import Paper
from withe.folding.planning import Grasp, Method, Source, least_friction, slow_plan
from withe.folding.plans import FoldPlan
from withe.folding.plunging import plunge

__all__ = ["plan"]

Ending = Literal["auto", "slow", "plunge"]
_BEARABLE = 1e-3  # slide [m]
_UNSEEN = 0.5  # distance from the target within which the lifted edge hides the sheet below [Lgb]


@keyword_hints
def plan(
    paper: Paper,
    target: float | str = "half",
    *,
    method: Method = "ucs",
    grasp: Grasp = "moment_free",
    uncertainty: tuple[float, float] = (0.1, 0.5),
    curvature: float | None = None,
    jaw: Jaw | None = None,
    manifold: Source = "exact",
    ending: Ending = "auto",
    replans: int = 0,
    speed: float = 0.05,
    acceleration: float = 0.2,
    turning: float = 1.0,
    progress: bool = True,
) -> FoldPlan:
    """Plan how a jaw lifts one edge of a sheet and lays it down on the sheet.

    Parameters
    ----------
    paper : Paper
    target : float [m] or str
        Distance from the lifted edge in the flat sheet to its target (C of the dissertation); the crease is in the
        middle. Or the share of the sheet that is folded over: "half", "third", "quarter", or a fraction up to a half
        such as "2/5". Long sheets do not reach "half" without a moment; the error then names the possible targets.
    method : {"ucs", "slip", "local", "intuitive"}
        * "ucs": path of least accumulated ratio of tangential to normal force of the table, on a grid of positions
          [dissertation, Alg. 7, with costs that accumulate].
        * "slip": path without predicted slide, if one exists, or else with the least slide, to 2e-3 Lgb. Among these
          the path is short, with little curvature.
        * "local": from each pose to the next one of least tangential force, after Petrik et al. 2016.
        * "intuitive": half a circle [dissertation, (7.18)].
    grasp : {"moment_free", "free"}
        "moment_free": the jaw holds the edge at the angle without moment [dissertation, (7.6)]. "free", for method
        "slip" only: the jaw may apply any moment, and the curvature of the sheet is bounded.
    uncertainty : pair of float [-]
        For method "slip": relative error of Lgb (either sign) and of friction (less) of the paper. With a free moment,
        a path without slide is one on which no such paper slides.
    ending : {"auto", "slow", "plunge"}
        "plunge" always ends in a `plunge`; "slow" never does. "auto" depends on the method:

        * method "slip" with a free moment: a plunge if some paper within the uncertainty would slide by more than 1 mm
          (`FoldPlan.worst_slide`) on the slow way.
        * other methods, with `replans`: a plunge if the last part, which no camera corrects, needs more friction than
          there may be. Without `replans`: slow.

        A plunge is tested on simulated sheets, for about 8 s. If no plunge is found, the plan is slow, and its
        `blocked` states the reason.
    replans : int
        Number of camera corrections that `fold` will make. Simulated sheets for plunges are corrected as often.
    curvature : float [1/Lgb]
        Bound on the curvature of the sheet with grasp "free". By default 2.5.
    jaw : Jaw, optional
        Jaw that holds the sheet. By default it holds 10 mm of the sheet.
    manifold : {"exact", "network"}
        Source of equilibria without moment: their equations, or the network `SheetNetwork`, which needs torch.
    speed, acceleration : float [m/s], [m/s^2]
        Maximum speed and acceleration of the sheet's outer edge.
    turning : float [rad/s]
        Maximum rate of rotation.
    progress : bool
        True to show a progress bar while plunges are tested.

    Returns
    -------
    FoldPlan

    Raises
    ------
    ValueError
        A target outside of the sheet, or one that the grasp cannot reach; the message names the possible targets. A
        size or limit that is not positive. A curvature without ``grasp="free"``, or one that is too low. No path, with
        the reason. No plunge within bounds, with ending "plunge".

    Warns
    -----
    UserWarning
        The sheet slides on every path of method "slip"; the message names the friction that would be enough. Or
        another paper within the uncertainty slides. Or the sheet jumps (`FoldPlan.jumps_at`), except with "intuitive".

    Examples
    --------
    >>> import withe
    >>> folded = withe.folding.plan(withe.folding.Paper.a4(), method="slip", grasp="free")
    >>> folded.poses.shape
    (251, 7)
    >>> print(f"{1e3 * abs(folded.slide).max():.1f} mm")
    0.0 mm
    """
    validation.choice(ending, "ending", ("auto", "slow", "plunge"))
    replans = validation.integer(replans, "replans", 0, 1000)
    slow = slow_plan(
        paper,
        target,
        method=method,
        grasp=grasp,
        uncertainty=uncertainty,
        curvature=curvature,
        jaw=jaw,
        manifold=manifold,
        speed=speed,
        acceleration=acceleration,
        turning=turning,
    )
    if ending == "plunge":
        return plunge(slow, replans=replans, progress=progress)
    said = None
    if method == "slip":
        said = _slides(slow)
        if slow.slip_ratio.max() > paper.friction:
            needed = (
                np.ceil(1e3 * least_friction(slow)) / 1e3
            )  # rounded up, so that the number in the message is enough
            said = (
                f"the sheet slides: the fold needs a friction coefficient of {needed:.3f}, and the paper has "
                f"{paper.friction:g}"
            )
    elif method != "intuitive" and replans:
        said = _unseen(slow)
    if said is None:
        if method not in ("slip", "intuitive") and slow.jumps_at is not None:
            warn(_jumps(slow), cause="jumps")
        return slow
    if ending == "auto" and (grasp == "free" or replans):
        try:
            return plunge(slow, replans=replans, progress=progress)
        except ValueError as error:
            said = f"{said}; {error}"
            slow = replace(slow, blocked=said)
    warn(said, cause="slides")
    return slow


def _slides(slow: FoldPlan) -> str | None:
    """By how much the worst paper within the uncertainty slides, where that is too much."""
    slide, paper = slow.worst_slide
    if slide <= _BEARABLE:
        return None
    how = f"by {1e3 * slide:.1f} mm" if np.isfinite(slide) else "and jumps"
    lgb = paper.gravito_bending_length
    return (
        f"the sheet slides {how} for a paper within the uncertainty, with Lgb {lgb:.4g} m and friction "
        f"{paper.friction:.3g}"
    )


def _jumps(slow: FoldPlan) -> str:
    """Return the text that the sheet jumps before the end, and which option may help."""
    free = "" if slow.grasp == "free" else ": use method='slip' with grasp='free', which also applies a moment"
    return f"the sheet jumps at {slow.jumps_at:.1f} of {slow.times[-1]:.1f} s, where its equilibrium ends{free}"


def _unseen(slow: FoldPlan) -> str | None:
    """Return a complaint if the last part, which no camera sees, needs too much friction; else None."""
    lgb, (_, share) = slow.paper.gravito_bending_length, slow.uncertainty
    least = slow.paper.friction * (1.0 - share)
    needed = float(slow.slip_ratio[slow.poses[:, 0] > slow.poses[-1, 0] - _UNSEEN * lgb].max())
    if needed <= least:
        return None
    return (
        f"the end of the fold needs friction {needed:.3f}, but may have only {least:.3g}, and no camera sees the "
        "sheet slide there"
    )
