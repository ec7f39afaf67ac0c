"""Options of `Scene.build`: their words, and what is refused."""

from __future__ import annotations

from typing import Any, Literal, get_args

from withe import _core, validation

__all__ = ["Bending", "Integrator", "LineSearch", "Solver", "check_tolerances", "engine_options", "make_options"]

Integrator = Literal["implicit_midpoint", "backward_euler", "energy_momentum", "fourth_order", "verlet", "static"]
LineSearch = Literal["automatic", "goldstein_price"]
Solver = Literal["automatic", "band", "sparse"]
Bending = Literal["angle", "tangent"]


def make_options(**options: Any) -> dict[str, Any]:
    """Options of `Scene.build`, checked.

    Raises
    ------
    ValueError
        An option out of range, or tolerance with a scheme that takes none.
    """
    checked = dict(options)
    words = {"integrator": Integrator, "solver": Solver, "line_search": LineSearch, "bending": Bending}
    for name, literal in words.items():
        validation.choice(options[name], name, get_args(literal))
    for name in ("time_step", "step_tolerance", "force_tolerance"):
        checked[name] = validation.positive(options[name], name)
    for name in ("tolerance", "duration"):
        checked[name] = None if options[name] is None else validation.positive(options[name], name)
    for name in ("adaptive", "mixed"):
        checked[name] = validation.truth(options[name], name)
    if options["planar"] is not None:
        checked["planar"] = validation.truth(options["planar"], "planar")
    checked["max_iterations"] = validation.integer(options["max_iterations"], "max_iterations", 1, 10_000)
    if options["max_halvings"] is None:
        checked["max_halvings"] = 12 if options["tolerance"] is None else 20
    else:
        checked["max_halvings"] = validation.integer(options["max_halvings"], "max_halvings", 0, 40)
    if checked["tolerance"] is not None and options["integrator"] in ("verlet", "static"):
        raise ValueError(f"tolerance must be None with integrator={options['integrator']!r}")
    if checked["duration"] is not None and checked["tolerance"] is None:
        raise ValueError("duration must be given with a tolerance, and only then")
    return checked


def check_tolerances(options: dict[str, Any], longest: float, shortest: float) -> None:
    """Refuse tolerances with which any state is a solution.

    Parameters
    ----------
    options : dict
        As `make_options` returned them.
    longest, shortest : float [m]
        Length of the longest rod, and of the shortest edge.

    Raises
    ------
    ValueError
        A step_tolerance or tolerance that an edge or a rod fits into, or a force_tolerance of 1 or more.
    """
    greatest = shortest / longest
    if options["step_tolerance"] > greatest:
        raise ValueError(
            f"step_tolerance must not exceed the shortest edge over the longest rod, {greatest:.3g}, "
            f"got {options['step_tolerance']:g}"
        )
    if options["force_tolerance"] >= 1.0:
        raise ValueError(f"force_tolerance must be less than 1, got {options['force_tolerance']:g}")
    if options["tolerance"] is not None and options["tolerance"] > longest:
        raise ValueError(
            f"tolerance must not exceed the length of the longest rod, {longest:.3g} m, got {options['tolerance']:g} m"
        )


def engine_options(options: dict[str, Any]) -> _core.Options:
    """Checked options as the engine takes them; what bending is belongs to the description of the scene."""
    result = _core.Options()
    for name, value in options.items():
        if name != "bending":
            setattr(result, name, value)
    return result
