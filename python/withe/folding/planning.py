"""Plans how a jaw folds a sheet over. Knows equilibria of the continuum, and no simulated sheet."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.folding import moment_free
from withe.folding.grid import SPACING
from withe.folding.jaw import Jaw, outer_edge
from withe.folding.paper import Paper
from withe.folding.plans import Plan
from withe.folding.sheets import Elastica, poses_of
from withe.folding.timing import evenly, travel_times

__all__ = ["plan"]

FloatArray = npt.NDArray[np.float64]
Method = Literal["intuitive", "ucs"]
Grasp = Literal["moment_free"]
_POSES = 251


def plan(
    paper: Paper,
    target: float | Literal["half"] = "half",
    *,
    method: Method = "ucs",
    grasp: Grasp = "moment_free",
    jaw: Jaw | None = None,
    speed: float = 0.05,
    acceleration: float = 0.2,
    turning: float = 1.0,
) -> Plan:
    """Plan how a jaw lifts one edge of a sheet and lays it down on the sheet.

    Parameters
    ----------
    paper : Paper
    target : float or "half" [m]
        Where the lifted edge comes down, from where it lay (the dissertation's C); the crease is in the middle. "half":
        on the far edge.
    method : {"ucs", "intuitive"}
        "ucs": least accumulated ratio of the table's tangential to its normal force, on a grid of positions
        [dissertation, Alg. 7, with costs that accumulate]. "intuitive": half a circle [dissertation, (7.18)].
    grasp : {"moment_free"}
        The angle of the jaw is that at which the sheet ends without curvature [dissertation, (7.6)].
    jaw : Jaw, optional
        How it holds the sheet; by default 10 mm of it.
    speed, acceleration : float [m/s], [m/s^2]
        At most; of the sheet's outer edge.
    turning : float [rad/s]
        Rate of turning, at most.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        A target outside the sheet, or one that no pose of the grasp has; sizes and limits that are not positive; no
        path, with what blocks it.

    Examples
    --------
    >>> import withe
    >>> folded = withe.folding.plan(withe.folding.Paper.a4())
    >>> folded.poses.shape
    (251, 7)
    """
    if not isinstance(paper, Paper):
        raise ValueError(f"paper must be a Paper, got {paper!r}")
    jaw = Jaw() if jaw is None else jaw
    validation.choice(method, "method", ("intuitive", "ucs"))
    validation.choice(grasp, "grasp", ("moment_free",))
    limits = (
        validation.positive(speed, "speed"),
        validation.positive(turning, "turning"),
        validation.positive(acceleration, "acceleration"),
    )
    where = _target(paper, target)
    if jaw.depth > 0.2 * paper.length:
        raise ValueError(f"jaw must hold less than a fifth of the sheet, {paper.length:g} m long, got {jaw.depth:g} m")
    if method == "intuitive":
        angles = np.linspace(0.0, np.pi, _POSES)
        outer = np.stack([0.5 * where * (1 - np.cos(angles)), 0.5 * where * np.sin(angles), angles], axis=1)
        outer[-1, 1] = paper.thickness + jaw.finger
        return _finished(paper, where, method, grasp, jaw, outer, None, limits)
    return _over_manifold(paper, where, method, grasp, jaw, limits)


def _target(paper: Paper, target: float | str) -> float:
    if isinstance(target, str):
        validation.choice(target, "target", ("half",))
        return paper.length
    where = validation.positive(target, "target")
    if where > paper.length:
        raise ValueError(f"target must be on the sheet, which is {paper.length:g} m long, got {where:g} m")
    return where


def _over_manifold(
    paper: Paper, where: float, method: str, grasp: str, jaw: Jaw, limits: tuple[float, float, float]
) -> Plan:
    lgb = paper.gravito_bending_length
    length = (paper.length - jaw.depth) / lgb
    goal = moment_free.goal_pose(where / lgb, paper.thickness / lgb, jaw.depth / lgb, jaw.finger / lgb)
    goal = _checked_goal(goal, where, length, paper)
    nodes = moment_free.uniform_cost(length, goal)
    if nodes is None:
        raise ValueError(
            f"no path to {where:g} m: poses without moment that lift less than {length:.2f} Lgb do not connect"
        )
    path = moment_free.smoothed(nodes, length, SPACING)
    scale = np.array([lgb, lgb, 1.0])
    outer = outer_edge(poses_of(path) * scale, jaw.depth)
    sheet = moment_free.along(path, evenly(outer, _POSES, limits[0], limits[1]))
    outer = outer_edge(poses_of(sheet) * scale, jaw.depth)
    return _finished(paper, where, method, grasp, jaw, outer, sheet, limits)


def _checked_goal(goal: Elastica | None, where: float, length: float, paper: Paper) -> Elastica:
    if goal is None:
        raise ValueError(
            f"target is {where:g} m, {where / paper.gravito_bending_length:.2f} Lgb: no pose without moment that lifts "
            "less than 6.84 Lgb, and more than .958, brings the edge there"
        )
    lifted = float(goal.suspended[0])
    for bound, wrong, what in (
        (length, lifted >= length, "less than the sheet has"),
        (moment_free.PENALTY, lifted <= moment_free.PENALTY, "more, so as not to be bent too sharply"),
    ):
        if wrong:
            raise ValueError(f"target is {where:g} m: there {lifted:.2f} Lgb are lifted, not {what}: {bound:.2f}")
    return goal


def _finished(
    paper: Paper,
    where: float,
    method: str,
    grasp: str,
    jaw: Jaw,
    outer: FloatArray,
    sheet: Elastica | None,
    limits: tuple[float, float, float],
) -> Plan:
    """Put times to outer edges (x, z [m], angle), and see to the jaw's room."""
    speed, turning, acceleration = limits
    x, z, angle = outer.T
    back = angle > 0.5 * np.pi
    side, clearance = "edge", float(jaw.clearance(x, z, angle, "edge")[back].min())
    if clearance < 0:
        side, clearance = "side", float(jaw.clearance(x, z, angle, "side")[back].min())
    zero = np.zeros_like(x)
    return Plan(
        paper=paper,
        target=where,
        method=method,
        grasp=grasp,
        jaw=jaw,
        side=side,
        clearance=clearance,
        poses=np.stack([x, zero, z, zero, np.sin(0.5 * angle), zero, np.cos(0.5 * angle)], axis=1),
        angles=angle,
        times=travel_times(outer, speed, turning, acceleration),
        _foreseen=sheet,
    )
