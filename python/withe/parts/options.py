"""Options of `Scene.build`: their words, and what is refused."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Literal, get_args

from withe import _core
from withe.common import validation

__all__ = ["Bending", "BuildOptions", "Integrator", "Solver", "check_tolerances"]

Integrator = Literal["implicit_midpoint", "backward_euler", "energy_momentum", "fourth_order", "verlet", "static"]
Solver = Literal["automatic", "band", "sparse"]
Bending = Literal["angle", "tangent"]


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
    solver: Solver
    mixed: bool
    step_tolerance: float
    force_tolerance: float
    max_iterations: int
    max_halvings: int | None
    max_steps: int | None = None

    def checked(self) -> BuildOptions:
        """The same as plain numbers, with the number of halvings that a tolerance asks for.

        Raises
        ------
        ValueError
            An option out of range, or tolerance with a scheme that takes none.
        """
        words = {"integrator": Integrator, "solver": Solver, "bending": Bending}
        for name, literal in words.items():
            validation.choice(getattr(self, name), name, get_args(literal))
        checked = replace(
            self,
            time_step=validation.positive(self.time_step, "time_step"),
            step_tolerance=validation.positive(self.step_tolerance, "step_tolerance"),
            force_tolerance=validation.positive(self.force_tolerance, "force_tolerance"),
            tolerance=None if self.tolerance is None else validation.positive(self.tolerance, "tolerance"),
            duration=None if self.duration is None else validation.positive(self.duration, "duration"),
            adaptive=validation.truth(self.adaptive, "adaptive"),
            mixed=validation.truth(self.mixed, "mixed"),
            planar=None if self.planar is None else validation.truth(self.planar, "planar"),
            max_iterations=validation.integer(self.max_iterations, "max_iterations", 1, 10_000),
            max_halvings=self._halvings(),
            max_steps=None if self.max_steps is None else validation.integer(self.max_steps, "max_steps", 1, 2**62),
        )
        if checked.tolerance is not None and self.integrator in ("verlet", "static"):
            raise ValueError(f"tolerance must be None with integrator={self.integrator!r}")
        if checked.duration is not None and checked.tolerance is None:
            raise ValueError("duration needs a tolerance: give tolerance= too")
        if checked.max_steps is not None and checked.tolerance is None:
            raise ValueError("max_steps needs a tolerance: give tolerance= too")
        return checked

    def _halvings(self) -> int:
        if self.max_halvings is None:
            return 12 if self.tolerance is None else 20
        return validation.integer(self.max_halvings, "max_halvings", 0, 40)

    def engine(self) -> _core.Options:
        """As the engine takes them; what bending is belongs to the description of the scene."""
        result = _core.Options()
        for field in fields(self):
            if field.name != "bending":
                setattr(result, field.name, getattr(self, field.name))
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
    if options.step_tolerance > greatest:
        raise ValueError(
            f"step_tolerance must not exceed the shortest edge over the longest rod, {greatest:.3g}, "
            f"got {options.step_tolerance:g}"
        )
    if options.force_tolerance >= 1.0:
        raise ValueError(f"force_tolerance must be less than 1, got {options.force_tolerance:g}")
    if options.tolerance is not None and options.tolerance > longest:
        raise ValueError(
            f"tolerance must not exceed the length of the longest rod, {longest:.3g} m, got {options.tolerance:g} m"
        )
