"""Planning of folds. It uses equilibria of the continuum, and no simulated sheet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.folding import free_moment, moment_free
from withe.folding.free_moment import Holding, Way
from withe.folding.jaw import Jaw, inner_edge, outer_edge
from withe.folding.manifold import Manifold
from withe.folding.paper import Paper, folded_share
from withe.folding.plans import SHORT, FoldPlan, flat_forces
from withe.folding.sheets import LONGEST, SHORTEST, Elastica, at_forces, at_poses, forces_of, join, poses_of, take
from withe.folding.timing import evenly, travel_times
from withe.folding.widths import Width, free_width

__all__ = ["Grasp", "Method", "Source", "least_friction", "plan_above", "replan", "slow_plan"]

FloatArray = npt.NDArray[np.float64]
Method = Literal["intuitive", "local", "ucs", "slip"]
Grasp = Literal["moment_free", "free"]
Source = Literal["exact", "network"]
_POSES = 251
_POSES_OF_REST = 101
_TARGETS = 150  # number of targets along a sheet that are tested for a message
_CURVATURE = 2.5  # [1/Lgb], default of the greatest curvature
_CLEARANCE = 2e-3  # [m] of an edge on its way over the sheet


@dataclass(frozen=True)
class _Task:
    """Checked arguments of a plan."""

    paper: Paper
    target: float
    method: str
    grasp: str
    jaw: Jaw
    uncertainty: tuple[float, float]
    curvature: float
    manifold: str
    speed: float
    turning: float
    acceleration: float
    rise: float = 0.0

    @property
    def length(self) -> float:
        """Return the length of the sheet beyond the jaw [Lgb]."""
        return (self.paper.length - self.jaw.depth) / self.paper.gravito_bending_length

    @property
    def width(self) -> Width:
        """Return the width of the freely hanging part."""
        return free_width(self.paper, self.jaw.depth)

    @property
    def solve(self) -> Manifold:
        """Return the solver of equilibria without moment."""
        return Manifold(self.width, learned=self.manifold == "network")

    @property
    def holding(self) -> Holding:
        lgb, jaw = self.paper.gravito_bending_length, self.jaw
        sizes = (jaw.depth / lgb, jaw.finger / lgb, self.paper.thickness / lgb)
        return Holding(self.length, *sizes, self.curvature, self.uncertainty[0], self.width)

    @property
    def free_holding(self) -> Holding:
        """With a moment, by which the edge comes as it likes."""
        lgb = self.paper.gravito_bending_length
        return replace(self.holding, clearance=_CLEARANCE / lgb, goal=self.target / lgb)

    def outer(self, inner: FloatArray) -> FloatArray:
        """Outer edges (x, z [m], angle) from the jaw's inner edges [Lgb]."""
        lgb = self.paper.gravito_bending_length
        return outer_edge(inner * [lgb, lgb, 1.0], self.jaw.depth)

    def cut(self, count: int) -> Callable[[FloatArray], FloatArray]:
        """Find places along inner edges that are as far from each other, in time."""
        return lambda inner: evenly(self.outer(inner), count, self.speed, self.turning)


def slow_plan(
    paper: Paper,
    target: float | str,
    *,
    method: Method,
    grasp: Grasp,
    uncertainty: tuple[float, float],
    curvature: float | None,
    jaw: Jaw | None,
    manifold: Source,
    speed: float,
    acceleration: float,
    turning: float,
) -> FoldPlan:
    """Plan a fold whose edge comes down slowly. Arguments and errors are those of `plan`."""
    if not isinstance(paper, Paper):
        raise ValueError(f"paper must be a Paper, got {paper!r}")
    jaw = Jaw() if jaw is None else jaw
    validation.choice(method, "method", ("intuitive", "local", "ucs", "slip"))
    validation.choice(grasp, "grasp", ("moment_free", "free"))
    if grasp == "free" and method != "slip":
        raise ValueError(f"grasp 'free' needs method='slip', got method={method!r}")
    bound = _CURVATURE if curvature is None else validation.positive(curvature, "curvature")
    if curvature is not None and grasp != "free":
        raise ValueError(f"curvature needs grasp='free', whose moment is not limited otherwise, got grasp={grasp!r}")
    validation.choice(manifold, "manifold", ("exact", "network"))
    if manifold == "network" and (grasp == "free" or method == "intuitive"):
        raise ValueError(
            f"manifold 'network' covers grasps without moment only, got method={method!r} with grasp={grasp!r}"
        )
    if not paper.is_strip and (manifold == "network" or grasp == "free"):
        what = "manifold 'network'" if manifold == "network" else "grasp 'free'"
        raise ValueError(f"{what} needs a sheet of uniform width, but the paper has an outline")
    lgb_share, friction_share = validation.number_array(uncertainty, "uncertainty", (2,))
    if not (0 <= lgb_share <= 0.3 and 0 <= friction_share < 1):
        raise ValueError(f"uncertainty must be at most 0.3 for Lgb and below 1 for friction, got {uncertainty}")
    if jaw.depth > 0.2 * paper.length:
        raise ValueError(f"jaw must hold less than a fifth of the sheet, {paper.length:g} m long, got {jaw.depth:g} m")
    if paper.width_at(jaw.depth) <= 0.0:
        raise ValueError(f"jaw must have a positive depth to hold a sheet by its corner, got {jaw.depth:g} m")
    task = _Task(
        paper=paper,
        target=_target(paper, target),
        method=method,
        grasp=grasp,
        jaw=jaw,
        uncertainty=(float(lgb_share), float(friction_share)),
        curvature=bound,
        manifold=manifold,
        speed=validation.positive(speed, "speed"),
        turning=validation.positive(turning, "turning"),
        acceleration=validation.positive(acceleration, "acceleration"),
    )
    return _planned(task)


def _planned(task: _Task) -> FoldPlan:
    if task.method == "intuitive":
        return _half_circle(task)
    return _free(task) if task.grasp == "free" else _over_manifold(task)


def _target(paper: Paper, target: float | str) -> float:
    if isinstance(target, str):
        return 2.0 * folded_share(target) * paper.length
    where = validation.positive(target, "target")
    if where > paper.length:
        raise ValueError(f"target must be on the sheet, which is {paper.length:g} m long, got {where:g} m")
    return where


def _half_circle(task: _Task) -> FoldPlan:
    angles = np.linspace(0.0, np.pi, _POSES)
    radius = 0.5 * task.target
    outer = np.stack([radius * (1 - np.cos(angles)), radius * np.sin(angles), angles], axis=1)
    outer[-1, 1] = task.paper.thickness + task.jaw.finger
    outer[:, 1] += task.rise * angles / np.pi
    return _finished(task, outer, None)


def _over_manifold(task: _Task) -> FoldPlan:
    goal = _checked_goal(_goal(task), task)
    if task.method == "slip":
        sheet = _least_sliding(task, goal, None, _POSES)
    else:
        search = moment_free.uniform_cost if task.method == "ucs" else moment_free.greedy
        sheet = _smoothed(task, search(task.solve, task.holding, goal), _POSES)
    if sheet is None:
        ends = (
            "the step of least force does not reach the target"
            if task.method == "local"
            else "these poses do not connect"
        )
        if task.method == "slip" and moment_free.connects(task.solve, task.holding, goal):
            ends = "the sheet jumps on every path"
        raise ValueError(f"no path to {task.target:g} m over poses that lift less than {task.length:.2f} Lgb: {ends}")
    if not sheet.valid.all():
        raise ValueError(f"no path to {task.target:g} m: some steps between poses of the grid have no equilibrium")
    return _finished(task, task.outer(poses_of(sheet)), sheet)


def _smoothed(task: _Task, nodes: Elastica | None, count: int) -> Elastica | None:
    return None if nodes is None else moment_free.smoothed(task.solve, nodes, task.holding, task.cut(count))


def _least_sliding(task: _Task, goal: Elastica, start: Elastica | None, count: int) -> Elastica | None:
    """Poses without moment of the shortest way on which friction holds the sheet, or else on which it slides least.

    What holds at nodes need not hold between them, along a border above all: so nodes leave the room that smoothing
    takes. The way of least friction is asked last: a paper with more friction has that too.
    """
    friction = task.paper.friction
    for enough in (friction / moment_free.SMOOTHING, 0.0):
        sheet = _with_friction(task, enough, goal, start, count)
        if sheet is not None and sheet.valid.all() and task.holding.ratio(sheet).max() <= friction:
            return sheet
    nodes = moment_free.least_slide(task.solve, task.holding, friction, goal, start)
    return _smoothed(task, nodes, count)


def _with_friction(task: _Task, enough: float, goal: Elastica, start: Elastica | None, count: int) -> Elastica | None:
    """Poses without moment that ask for no more friction at nodes than is enough, or for the least that there is."""
    return _smoothed(task, moment_free.least_ratio(task.solve, task.holding, enough, goal, start), count)


def least_friction(present: FoldPlan) -> float:
    """Friction with which a plan of method "slip" to the same target has no slide."""
    if present.grasp == "free":  # A free grasp already needs least friction.
        return float(present.slip_ratio.max())
    task = _task_of(present)
    sheet = _with_friction(task, 0.0, _checked_goal(_goal(task), task), None, _POSES)
    return np.inf if sheet is None or not sheet.valid.all() else float(task.holding.ratio(sheet).max())


def replan(present: FoldPlan, pose: npt.ArrayLike, slide: float) -> FoldPlan:
    """Plan the rest of a fold again, from the present pose of the jaw and the present slide of the sheet.

    For a grasp without moment the planner searches the manifold again: by least slide if the present plan is of method
    "slip", and otherwise by least accumulated force ratio. The difference between the present angle and the angle of
    the manifold is removed evenly along the way [dissertation, (7.14)-(7.16)]. For a grasp with free moment the present
    plan continues. The difference between its forces and the forces at the pose is removed over a third of the rest.

    Parameters
    ----------
    present : FoldPlan
    pose : array_like of shape (7,) [m], [-]
        Pose of the sheet's outer edge, as in `present`.
    slide : float [m]
        Slide of the sheet towards +x since the first plan was made.

    Returns
    -------
    FoldPlan
        Plan in the same frame, from the pose on, with the remaining target and times.

    Raises
    ------
    ValueError
        A pose that no sheet without moment can approach, or from which there is no path. With a free moment, a pose
        that is too far from those of the present plan.

    Examples
    --------
    >>> import withe
    >>> folded = withe.folding.plan(withe.folding.Paper.a4())
    >>> rest = withe.folding.replan(folded, folded.poses[150], slide=0.004)
    >>> print(f"{rest.poses[-1, 0] - folded.poses[-1, 0]:.4f} m")
    0.0040 m
    """
    x, _, z, _, qy, _, qw = validation.number_array(pose, "pose", (7,))
    slide = validation.number(slide, "slide")
    task = replace(_task_of(present), method="slip" if present.method == "slip" else "ucs")
    lgb = task.paper.gravito_bending_length
    angle = 2.0 * np.arctan2(qy, qw) % (2.0 * np.pi)
    inner = inner_edge(np.array([[x - slide, z, angle]]), task.jaw.depth)[0] / [lgb, lgb, 1.0]
    wanted, forces = _on_from(present, inner, task.width) if task.grasp == "free" else _anew_from(task, inner)
    sheet = at_poses(wanted, forces, task.width)
    if not sheet.valid.all():
        raise ValueError(
            f"pose must be nearer to the poses of a plan: the sheet has no equilibrium on the way from {x:g}, {z:g} m"
        )
    return _finished(task, task.outer(poses_of(sheet)), sheet, offset=slide)


def _task_of(present: FoldPlan) -> _Task:
    """Return the task of a plan, relative to the present position of the sheet."""
    return _Task(
        paper=present.paper,
        target=present.target - present.offset,
        method=present.method,
        grasp=present.grasp,
        jaw=present.jaw,
        uncertainty=present.uncertainty,
        curvature=present.curvature,
        manifold=present.manifold,
        speed=present.limits[0],
        turning=present.limits[1],
        acceleration=present.limits[2],
        rise=present.rise,
    )


def plan_above(present: FoldPlan, height: float) -> FoldPlan:
    """Plan with the same task up to a height over the target [m], without the last part.

    The last part needs friction if the edge must be pressed down.
    """
    return _planned(replace(_task_of(present), rise=height))


def _anew_from(task: _Task, inner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return poses of the inner edge of the jaw, and approximate forces of the sheet, by a search over the manifold."""
    start = task.solve([inner[0]], [inner[1]])
    if not start.valid[0]:
        raise ValueError(
            f"pose must be near a pose without moment: none exists with the jaw's inner edge at {inner[0]:.2f}, "
            f"{inner[1]:.2f} Lgb"
        )
    goal = _checked_goal(_goal(task), task)
    if task.method == "slip":
        sheet = _least_sliding(task, goal, start, _POSES_OF_REST)
    else:
        nodes = moment_free.uniform_cost(task.solve, task.holding, goal, start)
        sheet = _smoothed(task, nodes, _POSES_OF_REST)
    if sheet is None:
        raise ValueError(f"no path without moment leads from this pose to {task.target:g} m")
    wanted = poses_of(sheet)
    wanted[:, 2] += np.linspace(1.0, 0.0, len(wanted)) * (inner[2] - start.angle[0])
    return wanted, forces_of(sheet)


def _on_from(present: FoldPlan, inner: FloatArray, width: Width) -> tuple[FloatArray, FloatArray]:
    """The same, for a jaw that takes a moment, by going over to the present plan."""
    known = present.sheet
    away = np.abs(poses_of(known) - inner).max(axis=1)
    begin = int(np.argmin(np.where(known.suspended > SHORT, away, np.inf)))
    forces = forces_of(known)[begin:]
    start = at_poses([inner], forces[:1], width)
    if not start.valid[0]:
        raise ValueError(f"pose must be near those of the plan: the nearest is off by {away[begin]:.2f} Lgb or rad")
    index = np.linspace(0.0, len(forces) - 1.0, _POSES_OF_REST)
    way = np.stack([np.interp(index, np.arange(len(forces)), forces[:, i]) for i in range(3)], axis=1)
    left = np.clip(1.0 - 3.0 * np.linspace(0.0, 1.0, _POSES_OF_REST), 0.0, None)
    way += np.outer(left, forces_of(start)[0] - forces[0])
    sheet = at_forces(way, width)
    return poses_of(sheet), forces_of(sheet)


def _goal(task: _Task) -> Elastica | None:
    paper, jaw, lgb = task.paper, task.jaw, task.paper.gravito_bending_length
    sizes = ((paper.thickness + task.rise) / lgb, jaw.depth / lgb, jaw.finger / lgb)
    return moment_free.goal_pose(task.solve, task.target / lgb, *sizes)


def _checked_goal(goal: Elastica | None, task: _Task) -> Elastica:
    where, lgb = task.target, task.paper.gravito_bending_length
    if goal is None:
        raise ValueError(
            f"target must be reachable without moment, got {where:g} m ({where / lgb:.2f} Lgb): no pose that lifts "
            f"less than {LONGEST:g} Lgb and more than {SHORTEST:g} brings the edge there{_reachable(task)}"
        )
    lifted = float(goal.suspended[0])
    for bound, wrong, what in (
        (task.length, lifted >= task.length, "less than the length of the sheet"),
        (SHORTEST, lifted <= SHORTEST, "more than needed to avoid a sharp bend"),
    ):
        if wrong:
            raise ValueError(
                f"target must be reachable, got {where:g} m: the lifted length there is {lifted:.2f} Lgb, but must "
                f"be {what}, {bound:.2f} Lgb{_reachable(task)}"
            )
    return goal


def _reachable(task: _Task) -> str:
    """Return a text with the range of targets that a path reaches, from targets evenly along the sheet."""

    def reaches(target: float) -> bool:
        goal = _goal(replace(task, target=target))
        if goal is None or not SHORTEST < float(goal.suspended[0]) < task.length:
            return False
        return moment_free.connects(task.solve, task.holding, goal)

    targets = np.linspace(0.0, task.paper.length, _TARGETS + 1)[1:]
    there = np.flatnonzero([reaches(float(target)) for target in targets])
    if not len(there):
        return "; no target can be reached without moment"
    least, most = np.ceil(1e3 * targets[there[0]]) / 1e3, np.floor(1e3 * targets[there[-1]]) / 1e3
    return f"; targets from {least:.3f} to {most:.3f} m can be reached"


def _free(task: _Task) -> FoldPlan:
    """Plan without friction of the table if possible, else with friction, else for the nominal sheet only."""
    friction = task.paper.friction
    limit = friction * (1 - task.uncertainty[1])
    holding = task.free_holding
    exact = replace(holding, share=0.0)
    level = _free_way(task, holding, False, friction)
    if level is not None and level.ratio <= limit:
        return _along(task, level, holding, limit)
    thought = _free_way(task, exact, True, np.inf)
    # If even the nominal sheet slides, plan for it alone: other sheets within the uncertainty need more friction.
    if thought is not None and thought.ratio <= friction:
        pulled = _free_way(task, holding, True, friction)
        ways = [way for way in (level, pulled) if way is not None and way.ratio <= friction]
        if ways:
            return _along(task, min(ways, key=lambda way: way.ratio), holding, limit)
    if thought is None:
        raise ValueError(_blocked(task))
    return _along(task, thought, exact, limit)


def _free_way(task: _Task, holding: Holding, pulls: bool, most: float) -> Way | None:
    lgb = task.paper.gravito_bending_length
    lattice = free_moment.make_lattice(holding, pulls, most if pulls else np.inf)
    raised = replace(holding, thickness=holding.thickness + task.rise / lgb)
    found = free_moment.goals(lattice, raised, task.target / lgb)
    found = take(found, holding.bearable(found))
    limit = task.paper.friction * (1 - task.uncertainty[1])
    return free_moment.way_to(lattice, holding, found, holding.worst_ratio(found), limit) if len(found.x) else None


def _along(task: _Task, way: Way, holding: Holding, limit: float) -> FoldPlan:
    places = free_moment.smoothed(way, holding, limit)
    sheet = at_forces(free_moment.forces_at(places))
    index = task.cut(_POSES - 1)(poses_of(sheet))
    even = np.stack([np.interp(index, np.arange(len(places)), places[:, i]) for i in range(3)], axis=1)
    sheet = join(at_forces([flat_forces(task.width)]), at_forces(free_moment.forces_at(even)))
    return _finished(task, task.outer(poses_of(sheet)), sheet)


def _blocked(task: _Task) -> str:
    """Why no pose brings the edge there, or which bound would."""
    said = f"no path brings the edge to {task.target:g} m with curvature of at most {task.curvature:g} / Lgb"
    for factor in (1.5, 2.25, 3.4):
        holding = replace(task.free_holding, share=0.0, curvature=factor * task.curvature)
        lattice = free_moment.make_lattice(holding, True)
        found = free_moment.goals(lattice, holding, task.target / task.paper.gravito_bending_length)
        found = take(found, holding.bearable(found))
        if len(found.x):
            least = float(found.max_curvature.min())
            if least > task.curvature:
                return f"{said}: the least possible curvature there is {least:.2f}"
            break
    return f"{said} and a lifted length below {task.length:.2f} Lgb: no such pose connects with the flat sheet"


def _finished(task: _Task, outer: FloatArray, sheet: Elastica | None, offset: float = 0.0) -> FoldPlan:
    """Put times to outer edges (x, z [m], angle), and see to the jaw's room."""
    x, z, angle = outer.T
    back = angle > 0.5 * np.pi
    side, clearance = "edge", float(task.jaw.clearance(x, z, angle, "edge")[back].min())
    if clearance < 0:
        side, clearance = "side", float(task.jaw.clearance(x, z, angle, "side")[back].min())
    zero = np.zeros_like(x)
    return FoldPlan(
        paper=task.paper,
        target=task.target + offset,
        method=task.method,
        grasp=task.grasp,
        jaw=task.jaw,
        limits=(task.speed, task.turning, task.acceleration),
        offset=offset,
        rise=task.rise,
        side=side,
        clearance=clearance,
        uncertainty=task.uncertainty,
        curvature=task.curvature,
        manifold=task.manifold,
        poses=np.stack([x + offset, zero, z, zero, np.sin(0.5 * angle), zero, np.cos(0.5 * angle)], axis=1),
        angles=angle,
        times=travel_times(outer, task.speed, task.turning, task.acceleration),
        _foreseen=sheet,
    )
