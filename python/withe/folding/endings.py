"""Plans of folds, ended as the sheet bears it: slowly, or by a plunge that simulations have found."""

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
from withe.folding.plans import Plan
from withe.folding.plunging import plunge

__all__ = ["plan"]

Ending = Literal["auto", "slow", "plunge"]
_BEARABLE = 1e-3  # slide [m]
_UNSEEN = 0.5  # from the target, in which a lifted edge hides what it comes down on [Lgb]


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
) -> Plan:
    """Plan how a jaw lifts one edge of a sheet and lays it down on the sheet.

    Parameters
    ----------
    paper : Paper
    target : float [m] or str
        Where the lifted edge comes down, from where it lay (the dissertation's C); the crease is in the middle. Or the
        share of the sheet that is folded over: "half", "third", "quarter", or a fraction up to a half such as "2/5",
        whose C is twice that share of the length. "half" is on the far edge, which long sheets do not reach without a
        moment: what is refused says which targets can be.
    method : {"ucs", "slip", "local", "intuitive"}
        "ucs": least accumulated ratio of the table's tangential to its normal force, on a grid of positions
        [dissertation, Alg. 7, with costs that accumulate]. "slip": no predicted slide where such a way exists, or else
        as little as can be, to 2e-3 Lgb; then short and little bent. "local": from each pose to the next one of least
        tangential force, after Petrik et al. 2016, with the right stiffness. "intuitive": half a circle [dissertation,
        (7.18)].
    grasp : {"moment_free", "free"}
        "moment_free": the angle of the jaw is that at which the sheet ends without curvature [dissertation, (7.6)].
        "free", of method "slip": the jaw turns the edge as it likes, and curvature is bounded.
    uncertainty : pair of float
        Of method "slip": shares by which Lgb may be more or less, and friction less, than the paper's. With a free
        moment a way without slide is one on which no such sheet slides.
    ending : {"auto", "slow", "plunge"}
        "auto": of method "slip" with a free moment, a `plunge` where any paper within the uncertainty is predicted to
        slide by more than 1 mm (`Plan.worst_slide`) on the way that comes down slowly, which it does where that asks
        for more friction than there may be; elsewhere slow. A plunge is tried on simulated sheets, which takes some
        8 s. Where none is found either, the plan comes down slowly, and its `blocked` says why. "plunge": always.
        Of other methods "auto" is slow, but for sheets that will be looked at on the way: there it is a plunge where
        the last part, which no look mends, needs more friction than there may be.
    replans : int
        How often that will be, by `fold`. Sheets on which plunges are tried are led so.
    curvature : float [1/Lgb]
        Bound of the sheet's curvature with grasp "free", by default 2.5; without moment there is none.
    jaw : Jaw, optional
        How it holds the sheet; by default 10 mm of it.
    manifold : {"exact", "network"}
        Of grasps without moment: where equilibria come from, each from its equations, or all from the network that
        comes with withe (`SheetNetwork`), as the dissertation has them. No slower without it; it needs torch.
    speed, acceleration : float [m/s], [m/s^2]
        At most; of the sheet's outer edge.
    turning : float [rad/s]
        Rate of turning, at most.
    progress : bool
        Whether to show a progress bar while plunges are tried.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        A target outside the sheet, or one that no pose of the grasp has, with those that some have; sizes and limits
        that are not positive; a bound of curvature without a moment to keep it, or one that is too low, with the least
        that would do; no path, with what blocks it; with ending "plunge", that none is within bounds.

    Warns
    -----
    UserWarning
        Every way of method "slip" slides: with the least friction at which one would not. Also where the paper does not
        slide, but another within the uncertainty: with which, and by how much. And where the sheet will jump
        (`Plan.jumps_at`), but for method "intuitive", which often does.

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
            needed = np.ceil(1e3 * least_friction(slow)) / 1e3  # as said it is enough
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


def _slides(slow: Plan) -> str | None:
    """By how much the worst paper within the uncertainty slides, where that is too much."""
    slide, paper = slow.worst_slide
    if slide <= _BEARABLE:
        return None
    how = f"by {1e3 * slide:.1f} mm" if np.isfinite(slide) else "and jumps"
    lgb = paper.gravito_bending_length
    return f"within its uncertainty the sheet slides {how}, for Lgb {lgb:.4g} m and friction {paper.friction:.3g}"


def _jumps(slow: Plan) -> str:
    """That the sheet will not follow to the end, and what may."""
    free = "" if slow.grasp == "free" else ": use method='slip' with grasp='free', which also applies a moment"
    return f"the sheet jumps at {slow.jumps_at:.1f} of {slow.times[-1]:.1f} s, where its equilibrium ends{free}"


def _unseen(slow: Plan) -> str | None:
    """What the last part asks for, of which a camera sees nothing, where that is too much."""
    lgb, (_, share) = slow.paper.gravito_bending_length, slow.uncertainty
    least = slow.paper.friction * (1.0 - share)
    needed = float(slow.slip_ratio[slow.poses[:, 0] > slow.poses[-1, 0] - _UNSEEN * lgb].max())
    if needed <= least:
        return None
    return (
        f"the end of the fold needs friction {needed:.3f}, but may have only {least:.3g}, and no camera sees the "
        "sheet slide there"
    )
