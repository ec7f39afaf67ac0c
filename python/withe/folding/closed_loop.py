"""A fold with camera corrections, after which the rest is replanned [dissertation, Alg. 8]."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import overload

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.folding.paper import require_length
from withe.folding.plans import FoldPlan
from withe.folding.seeing import camera_over, find_edge
from withe.folding.simulated_sheet import Fold, SimulatedSheet
from withe.folding.watching import TOLERANCE, watched_parts
from withe.folding.wide_sheet import WideFold, WideSheet
from withe.perception.camera import Camera

__all__ = ["fold"]

FloatArray = npt.NDArray[np.float64]
_NEAR = 0.01  # least visible distance between the lifted edge and an edge on the table [m]


@overload
def fold(
    plan: FoldPlan,
    sheet: SimulatedSheet,
    *,
    replans: int = 5,
    camera: Camera | None = None,
    tolerance: float = TOLERANCE,
    progress: bool = True,
) -> Fold: ...


@overload
def fold(
    plan: FoldPlan,
    sheet: WideSheet,
    *,
    replans: int = 5,
    camera: Camera | None = None,
    tolerance: float = TOLERANCE,
    progress: bool = True,
) -> WideFold: ...


@keyword_hints
def fold(
    plan: FoldPlan,
    sheet: SimulatedSheet | WideSheet,
    *,
    replans: int = 5,
    camera: Camera | None = None,
    tolerance: float = TOLERANCE,
    progress: bool = True,
) -> Fold | WideFold:
    """Carry out a plan in parts, and plan the rest again after each part from the slide that a camera sees.

    The edge comes down on the sheet in its present place. A plunge is not planned again: the camera looks at the sheet
    before the plunge, and the plunge is shifted to the place of the sheet.

    Parameters
    ----------
    plan : FoldPlan
        Plan to carry out.
    sheet : SimulatedSheet or WideSheet
        Sheet to fold. For a wide sheet the camera follows the middle of the far edge.
    replans : int
        Number of stops at which the camera looks at the sheet, at equal distances of the way. N - 1 in the
        dissertation.
    camera : withe.perception.Camera, optional
        Camera over the table. By default an `overhead_camera` over the sheet's far edge, with pixels of 0.5 mm on the
        table. For an edge wider than 0.218 m the camera hangs higher, so that both corners are in the picture.
    tolerance : float [m]
        Slide below which the plan is kept. The plan is also kept if the far edge is not visible.
    progress : bool
        True to show a progress bar.

    Returns
    -------
    Fold or WideFold
        Result with the slides that the camera saw; `WideFold` for a wide sheet.

    Raises
    ------
    ValueError
        Not a plan or a sheet, a negative tolerance, or no path from the place of the sheet.
    ImportError
        OpenCV is not installed.

    Warns
    -----
    UserWarning
        The camera never saw the far edge, so no slide was corrected.

    Notes
    -----
    The new poses begin at the pose of the jaw. The difference of the jaw's angle from that of the manifold decreases to
    zero evenly along the way [dissertation, (7.14)-(7.16)]. If the jaw cannot hold the sheet after its slide, the old
    plan continues until the jaw can.

    Examples
    --------
    >>> import withe
    >>> paper = withe.folding.Paper.a4()
    >>> sheet = withe.folding.SimulatedSheet(paper, seed=1, noise=withe.folding.Noise())
    >>> folded = withe.folding.fold(withe.folding.plan(paper), sheet)  # doctest: +SKIP
    """
    if not isinstance(plan, FoldPlan):
        raise ValueError(f"plan must be a FoldPlan, got {plan!r:.80}")
    if not isinstance(sheet, SimulatedSheet | WideSheet):
        raise ValueError(f"sheet must be a SimulatedSheet or a WideSheet, got {sheet!r:.80}")
    require_length(sheet.paper, plan.paper)
    stops = validation.integer(replans, "replans", 0, 1000)
    watched = camera_over(plan.paper) if camera is None else camera
    least = validation.non_negative(tolerance, "tolerance")
    seen: list[float] = []

    def look(pose: FloatArray) -> float:
        seen.append(_slide(sheet, watched, plan, pose))
        return seen[-1]

    parts = watched_parts(plan, stops, look, least)
    folded = sheet.carry_out(parts, plan.target, duration=float(plan.times[-1]), progress=progress)
    if seen and np.isnan(seen).all():
        warnings.warn(
            "the camera never saw the sheet's far edge, so no slide was corrected: while the sheet lies flat, both "
            "corners of that edge must be in the picture",
            UserWarning,
            stacklevel=2,
        )
    return replace(folded, seen_slides=tuple(seen))


def _slide(sheet: SimulatedSheet | WideSheet, camera: Camera, plan: FoldPlan, pose: FloatArray) -> float:
    """Return the slide of the sheet, as a camera sees it; NaN if its far edge is hidden.

    The lifted edge, at a pose of the jaw, has corners like those of the far edge, and hides these in the end.
    """
    lifted = camera.to_plane(camera.project(pose[None, :3]))[0, 0]
    try:
        seen = find_edge(sheet.picture(camera), camera, plan.paper).x
    except ValueError:
        return float("nan")
    return seen - plan.paper.length if seen > lifted + _NEAR else float("nan")
