"""Fits of parameters to the equilibria that a camera saw."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.progress import Progress
from withe.common.progress import progress as progress_bar
from withe.errors import ConvergenceError
from withe.real2sim.gathering import gather
from withe.real2sim.least_squares import FrameSolution, all_frames, lone_frame
from withe.real2sim.parsing import parse_unknowns
from withe.real2sim.results import Fit
from withe.real2sim.scalar_methods import descend, minimise
from withe.real2sim.stills import Conditions, Stills
from withe.real2sim.targets import Target, bind, frames_of
from withe.simulation.simulation import Simulation

__all__ = ["fit"]

FloatArray = npt.NDArray[np.float64]
Method = Literal["gauss_newton", "lbfgs", "source"]


@keyword_hints
def fit(
    simulation: Simulation,
    targets: Target | Sequence[Target],
    unknowns: Sequence[Any],
    method: Method = "gauss_newton",
    *,
    shared: Sequence[Any] = (),
    conditions: Conditions | None = None,
    tolerance: float | None = None,
    max_iterations: int | None = None,
    progress: bool = True,
) -> Fit:
    """Fit parameters so that equilibria match targets, frame by frame.

    The fit minimises the squares of the residuals of all targets, divided by their sigma. Each frame begins with the
    result of the frame before. Natural curvature and twist belong to each frame; all other unknowns are shared.

    The result is the local minimum near the initial guess. If sigma is given and residuals are much larger than sigma,
    `Fit.reasons` reports it: try another initial guess.

    Parameters
    ----------
    simulation : Simulation
        Simulation whose values are the initial guess. It is not changed; `Fit.apply` sets the result.
    targets : Curvatures, Tags, Centrelines, or several
        Targets of the fit.
    unknowns : sequence of tuples
        * ``(rod, "natural_curvature", basis)``: basis "constant", "linear" (values at both ends), "segment" (one per
          stencil), or functions along the rod of shape (stencils, n). In space each function counts for both directors.
        * ``(rod, "natural_twist", basis)``: in space only.
        * ``(part, word)``: a positive parameter of a part, or of a tuple of parts that share one factor. Examples are
          youngs_modulus, density or bend_stiffness of rods, mass, friction of an obstacle, stiffness and damping of
          revolute joints and springs.
        * ``(rod, "points", basis)``: the drawn shape of a rod in a plane, by rotations of its edges over functions of
          shape (edges, n). Natural curvature and supports follow the drawing.
        * ``(support, "position")`` and ``(support, "rotation")``: pose of a support.

        If one unknown sets another (see `Simulation.set`), as youngs_modulus sets twist_stiffness, it acts on the
        remaining values only.
    method : {"gauss_newton", "lbfgs", "source"}
        "source" is gradient descent by forward differences on the sum of absolute residuals [Choi, doctoral
        dissertation, University of California, Los Angeles, Algorithm 6]. It fits constant natural curvature in a
        plane, as the whole turn of a limb in radians, with a first step of 0.1.
    shared : sequence of tuples
        Further unknowns that all frames share, such as the natural curvature of one rod under several loads.
    conditions : callable, optional
        Called with a simulation and the frame before each equilibrium, to set loads or move supports. It is called once
        more with a copy and the first frame, so that its errors are raised early.
    tolerance : float [unit of the residuals], optional
        Norm of residuals below which a frame has converged. By default 1e-10; with "source" the sum of absolute
        residuals, 2.5e-3.
    max_iterations : int, optional
        Maximum number of iterations per frame. By default 50, or 1000 with "lbfgs" and "source".
    progress : bool
        True to show a progress bar on a terminal and in a notebook.

    Returns
    -------
    Fit

    Raises
    ------
    ValueError
        Targets with different numbers of frames or without any data, or an unknown that cannot be fitted, or not
        together with the others.

    Examples
    --------
    >>> arm_tip = withe.real2sim.Tags([[(0.28, 0.0, -0.08)]], [arm.end])
    >>> still = scene.build(integrator="static")
    >>> found = withe.real2sim.fit(still, arm_tip, [(arm, "natural_curvature", "constant")])
    >>> bool(found.converged.all())
    True
    """
    validation.choice(method, "method", ("gauss_newton", "lbfgs", "source"))
    listed = frames_of(targets)
    copy = simulation.copy()
    own = parse_unknowns(copy, unknowns)
    common = parse_unknowns(copy, shared, "shared", own)
    for unknown in common:
        unknown.per_frame = False
        if any(unknown.word == other.word and set(unknown.rods) & set(other.rods) for other in own):
            raise ValueError(f"{unknown.names[0]} must be in unknowns or in shared, got both")
    if not own + common:
        raise ValueError("unknowns must be at least one, got none")
    residual = bind(listed, copy)
    stills = Stills(copy, own + common, residual, conditions)
    start = stills.begin()
    blank = residual.value(copy.positions(), 0)
    good = [frame for frame in range(listed[0].frames) if any(target.told(frame) for target in listed)]
    if not good:
        raise ValueError(f"targets must show something in some frame, got nothing in all {listed[0].frames}")
    if conditions is not None:
        with suppress(ConvergenceError):
            conditions(simulation.copy(), good[0])  # if it raises ValueError, the cause is not a single frame
    limit = (50 if method == "gauss_newton" else 1000) if max_iterations is None else max_iterations
    limit = validation.integer(limit, "max_iterations", 1, 2**31 - 1)
    goal = validation.positive(
        (2.5e-3 if method == "source" else 1e-10) if tolerance is None else tolerance, "tolerance"
    )
    if method != "gauss_newton" and not stills.per_frame.all():
        raise ValueError(f"method must be 'gauss_newton' where frames share unknowns, got {method!r}")
    with progress_bar(len(good), "fitting", progress, unit="frames") as bar:
        solutions, solves = _frame_by_frame(stills, good, start, method, goal, limit, bar)
        if not stills.per_frame.all():
            bar.update(0)
            before = stills.solves
            begin = {f: solutions[f].coordinates for f in good}
            together = all_frames(stills, good, begin, goal, limit, lambda: bar.advance(1))
            solutions = {f: together.get(f, _without(begin[f])) for f in good}
            for frame in good:
                solves[frame] += (stills.solves - before) // len(good)
    return gather(stills, listed, solutions, solves, len(blank), listed[0].frames)


def _without(coordinates: FloatArray) -> FrameSolution:
    """A frame that has no equilibrium, or no derivatives there."""
    empty = np.zeros((0, len(coordinates)))
    return FrameSolution(coordinates, np.zeros(0), empty, 0, False, "no equilibrium at the initial guess")


def _frame_by_frame(
    stills: Stills, frames: list[int], start: FloatArray, method: str, goal: float, limit: int, bar: Progress
) -> tuple[dict[int, FrameSolution], dict[int, int]]:
    """Fit every frame separately. Each fit begins with the result of the frame before it."""
    solutions: dict[int, FrameSolution] = {}
    solves = {}
    guess, nearby = start, None
    for frame in frames:
        before = stills.solves
        if not stills.per_frame.any():
            solutions[frame] = FrameSolution(start, np.zeros(0), np.zeros((0, 0)), 0, True)
        elif method == "gauss_newton":
            solutions[frame] = lone_frame(stills, frame, guess, stills.per_frame, goal, limit, first=nearby)
        elif method == "lbfgs":
            solutions[frame] = minimise(stills, frame, guess, goal, limit)
        else:
            solutions[frame] = descend(stills, frame, guess, goal, limit)
        if solutions[frame].converged:
            guess = solutions[frame].coordinates
            all_seen = np.isfinite(solutions[frame].residual).all()
            nearby = solutions[frame].linear if all_seen and stills.conditions is None else None
        solves[frame] = stills.solves - before
        bar.advance(1)
    return solutions, solves
