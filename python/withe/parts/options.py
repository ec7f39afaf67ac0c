"""Options of `Scene.build`: their words, and what is refused."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

from withe import _core
from withe.common import validation
from withe.common.keywords import keyword_hints

__all__ = ["Bending", "BuildOptions", "Integrator", "Solver", "check_tolerances"]

Integrator = Literal["implicit_midpoint", "backward_euler", "energy_momentum", "fourth_order", "verlet", "static"]
LinearSolver = Literal["automatic", "band", "sparse"]
Bending = Literal["angle", "tangent"]


@keyword_hints
@dataclass(frozen=True, kw_only=True)
class Solver:
    """Options of Newton's method, of its linear equations and of the subdivision of steps.

    The defaults suit almost every scene. `Scene.build` takes a `Solver` as `solver=`.

    Parameters
    ----------
    linear_solver : {"automatic", "band", "sparse"}
        Solver of the linear equations.
    mixed : bool
        True to solve for axial forces as separate unknowns in Newton's method.
    step_tolerance : float [-]
        Bound on the last Newton step, relative to the length of the scene.
    force_tolerance : float [-]
        Bound on the residual, relative to the forces in the scene.
    max_iterations : int
        Maximum number of iterations of one Newton solve.
    max_halvings : int
        Bound on subdivision: the smallest step is time_step / 2^max_halvings. By default 12, and 20 with a
        tolerance. If a smaller step is needed, the run raises :class:`withe.ConvergenceError`.
    max_steps : int
        Maximum number of inner steps in one time step with a tolerance. By default 3e7 over the number of nodes,
        about half a minute on one core. More raise :class:`withe.ConvergenceError`.

    Raises
    ------
    ValueError
        An option out of range.

    See Also
    --------
    Scene.build : Build a simulation with these options.

    Examples
    --------
    >>> import withe
    >>> tight = withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
    >>> simulation = scene.build(solver=tight)
    """

    linear_solver: LinearSolver = "automatic"
    mixed: bool = True
    step_tolerance: float = 1e-9
    force_tolerance: float = 1e-8
    max_iterations: int = 40
    max_halvings: int | None = None
    max_steps: int | None = None

    def __post_init__(self) -> None:
        validation.choice(self.linear_solver, "linear_solver", get_args(LinearSolver))
        checked: dict[str, object] = {
            "mixed": validation.truth(self.mixed, "mixed"),
            "max_iterations": validation.integer(self.max_iterations, "max_iterations", 1, 10_000),
        }
        for name in ("step_tolerance", "force_tolerance"):
            checked[name] = validation.positive(getattr(self, name), name)
        for name, low, high in (("max_halvings", 0, 40), ("max_steps", 1, 2**62)):
            value = getattr(self, name)
            checked[name] = None if value is None else validation.integer(value, name, low, high)
        for name, value in checked.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class BuildOptions:
    """Arguments of `Scene.build`, which describes them."""

    integrator: Integrator
    time_step: float
    adaptive: bool
    tolerance: float | None
    planar: bool | None
    duration: float | None
    bending: Bending
    threads: int
    solver: Solver

    def checked(self) -> BuildOptions:
        """Return the same options as plain numbers.

        Raises
        ------
        ValueError
            An option out of range, or tolerance with a scheme that takes none.
        """
        for name, literal in (("integrator", Integrator), ("bending", Bending)):
            validation.choice(getattr(self, name), name, get_args(literal))
        if not isinstance(self.solver, Solver):
            raise ValueError(f"solver must be a withe.Solver, got {type(self.solver).__name__}")
        checked = replace(
            self,
            time_step=validation.positive(self.time_step, "time_step"),
            tolerance=None if self.tolerance is None else validation.positive(self.tolerance, "tolerance"),
            duration=None if self.duration is None else validation.positive(self.duration, "duration"),
            adaptive=validation.truth(self.adaptive, "adaptive"),
            planar=None if self.planar is None else validation.truth(self.planar, "planar"),
            threads=validation.integer(self.threads, "threads", 1, 256),
        )
        if checked.tolerance is not None and self.integrator in ("verlet", "static"):
            raise ValueError(f"tolerance must be None with integrator={self.integrator!r}")
        if checked.duration is not None and checked.tolerance is None:
            raise ValueError("duration needs a tolerance: give tolerance= too")
        if self.solver.max_steps is not None and checked.tolerance is None:
            raise ValueError("max_steps needs a tolerance: give tolerance= too")
        return checked

    def engine(self) -> _core.Options:
        """Return the options of the engine. The measure of bending belongs to the description of the scene."""
        solver = self.solver
        values = vars(self) | vars(solver) | {"solver": solver.linear_solver}
        if solver.max_halvings is None:
            values["max_halvings"] = 12 if self.tolerance is None else 20
        result = _core.Options()
        for name in values.keys() - {"bending", "linear_solver"}:
            setattr(result, name, values[name])
        return result


def check_tolerances(options: BuildOptions, longest: float, shortest: float) -> None:
    """Refuse tolerances with which any state is a solution.

    Parameters
    ----------
    options : BuildOptions
    longest, shortest : float [m]
        Length of the longest rod, and of the shortest edge.

    Raises
    ------
    ValueError
        A step_tolerance or tolerance that an edge or a rod fits into, or a force_tolerance of 1 or more.
    """
    greatest = shortest / longest
    if options.solver.step_tolerance > greatest:
        raise ValueError(
            f"step_tolerance must not exceed the shortest edge over the longest rod, {greatest:.3g}, "
            f"got {options.solver.step_tolerance:g}"
        )
    if options.solver.force_tolerance >= 1.0:
        raise ValueError(f"force_tolerance must be less than 1, got {options.solver.force_tolerance:g}")
    if options.tolerance is not None and options.tolerance > longest:
        raise ValueError(
            f"tolerance must not exceed the length of the longest rod, {longest:.3g} m, got {options.tolerance:g} m"
        )
