"""Hints for wrong arguments: the argument that the user may have meant.

Words are compared with the words of other packages, and with similar words.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection
from difflib import get_close_matches
from functools import wraps
from types import FunctionType
from typing import Any, TypeVar

__all__ = ["keyword_hints"]

T = TypeVar("T", bound=Callable[..., Any])

_OWN = ("self", "cls")

# Our names for the words of other packages (PyElastica, DisMech, MuJoCo), textbooks and habit. A hint names only words
# that the called function has.
_ELSEWHERE: dict[str, tuple[str, ...]] = {
    "dt": ("time_step",),
    "h": ("time_step", "height"),
    "timestep": ("time_step",),
    "step_size": ("time_step",),
    "method": ("integrator",),
    "stepper": ("integrator",),
    "timestepper": ("integrator",),
    "max_iter": ("max_iterations", "solver"),
    "maxiter": ("max_iterations", "solver"),
    "iterations": ("max_iterations", "solver"),
    "tol": ("step_tolerance", "force_tolerance", "tolerance", "solver"),
    "dtol": ("step_tolerance", "solver"),
    "ftol": ("force_tolerance", "solver"),
    "two_d_sim": ("planar",),
    "two_d": ("planar",),
    "t": ("duration",),
    "T": ("duration",),
    "time": ("duration",),
    "t_end": ("duration",),
    "t_final": ("duration",),
    "final_time": ("duration",),
    "sim_time": ("duration",),
    "total_time": ("duration",),
    "callback": ("before_step",),
    "log_step": ("record_every",),
    "save_every": ("record_every",),
    "step_skip": ("record_every",),
    "n": ("nodes", "count"),
    "steps": ("count",),
    "n_steps": ("count",),
    "n_nodes": ("nodes",),
    "num_nodes": ("nodes",),
    "vertices": ("points", "nodes"),
    "centerline": ("points",),
    "centreline": ("points",),
    "base_length": ("end",),
    "length": ("end",),
    "direction": ("end", "normal"),
    "r": ("radius",),
    "base_radius": ("radius",),
    "rod_radius": ("radius",),
    "outer": ("outer_radius",),
    "inner": ("inner_radius",),
    "E": ("youngs_modulus", "material"),
    "young": ("youngs_modulus", "material"),
    "young_modulus": ("youngs_modulus", "material"),
    "youngs_modulus": ("material",),
    "nu": ("poisson_ratio", "material"),
    "poissons_ratio": ("poisson_ratio", "material"),
    "poisson_ratio": ("material",),
    "rho": ("density", "material"),
    "density": ("material",),
    "eta": ("viscosity", "material"),
    "damping": ("viscosity", "material"),
    "damping_constant": ("viscosity", "material"),
    "viscosity": ("material",),
    "EA": ("stretch", "stiffness"),
    "EI": ("bend", "stiffness"),
    "GJ": ("twist", "stiffness"),
    "kappa": ("natural_curvature",),
    "rest_kappa": ("natural_curvature",),
    "rest_curvature": ("natural_curvature",),
    "rest_twist": ("natural_twist",),
    "mu": ("friction",),
    "friction_coefficient": ("friction",),
    "k": ("stiffness",),
    "g": ("gravity",),
    "gravity_vector": ("gravity",),
    "pos": ("position",),
    "quat": ("rotation", "path"),
    "orientation": ("rotation",),
    "F": ("force",),
    "M": ("moment",),
    "torque": ("moment",),
    "duration": ("over",),
    "filename": ("path",),
    "frames": ("shapes",),
}
# Words for numbers that ours count otherwise, and how to come from one to the other.
_COUNTED_OTHERWISE: dict[str, tuple[str, str]] = {
    "G": ("poisson_ratio", "poisson_ratio= with youngs_modulus=, where G = E / (2 (1 + nu))"),
    "shear_modulus": ("poisson_ratio", "poisson_ratio= with youngs_modulus=, where G = E / (2 (1 + nu))"),
    "diameter": ("radius", "radius=, half of the diameter"),
    "elements": ("nodes", "nodes=, one more than the edges"),
    "edges": ("nodes", "nodes=, one more than the edges"),
    "n_elem": ("nodes", "nodes=, one more than the edges"),
    "n_elements": ("nodes", "nodes=, one more than the edges"),
    "n_segments": ("nodes", "nodes=, one more than the edges"),
    "num_elements": ("nodes", "nodes=, one more than the edges"),
}


def keyword_hints(target: T) -> T:
    """Make a function, or the constructor and public methods of a class, suggest a keyword for an unknown one.

    For too many positional arguments, and for missing ones, the message names the keywords. The decorator costs one
    additional call: signatures are inspected only after Python has refused the arguments. Exceptions of the function
    itself, also TypeErrors, pass through.

    Parameters
    ----------
    target : function or class
        A decorated function keeps its signature and docstring. For a class, the functions defined in it are decorated.

    Examples
    --------
    >>> @keyword_hints
    ... def simulate(time_step): ...
    >>> simulate(dt=0.01)
    Traceback (most recent call last):
    TypeError: simulate() has no keyword 'dt'; did you mean time_step=?
    """
    if not isinstance(target, type):
        hinted: T = _hinted(target, target.__name__)
        return hinted
    for name, function in list(vars(target).items()):
        if isinstance(function, FunctionType) and (name == "__init__" or not name.startswith("_")):
            setattr(target, name, _hinted(function, target.__name__ if name == "__init__" else name))
        elif isinstance(function, classmethod) and not name.startswith("_"):
            setattr(target, name, classmethod(_hinted(function.__func__, name)))
    return target


def _hinted(function: Callable[..., Any], name: str) -> Any:
    @wraps(function)
    def call(*arguments: Any, **keywords: Any) -> Any:
        try:
            return function(*arguments, **keywords)
        except TypeError as error:
            # Python itself raises the error of a wrong argument, with no frame below this one.
            if error.__traceback__ is None or error.__traceback__.tb_next is not None:
                raise
            message = _explained(function, name, len(arguments), keywords)
            if message is None:
                raise
        raise TypeError(message)

    return call


def _explained(function: Callable[..., Any], name: str, given: int, keywords: Collection[str]) -> str | None:
    """Explain an error in the arguments of a call, `given` of them by position; None if Python explains it best."""
    parameters = list(inspect.signature(function).parameters.values())
    kinds = [each.kind for each in parameters]
    takes_any = inspect.Parameter.VAR_KEYWORD in kinds
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    known = [each.name for each in parameters if each.kind in named and each.name not in _OWN]
    unknown = [word for word in keywords if word not in known and not takes_any]
    if unknown:
        return "\n".join(f"{name}() has no keyword {word!r}; {_meant(word, known)}" for word in unknown)
    missing = [
        each.name
        for place, each in enumerate(parameters)
        if each.kind in named
        and each.default is each.empty
        and each.name not in keywords
        and (each.kind is each.KEYWORD_ONLY or place >= given)
    ]
    by_name = [each.name for each in parameters if each.kind is each.KEYWORD_ONLY and each.name not in keywords]
    places = len(parameters) - kinds.count(inspect.Parameter.KEYWORD_ONLY) - takes_any
    if given <= places and missing:
        return f"{name}() is missing {' and '.join(f'{word}=' for word in missing)}"
    if given <= places or not by_name or inspect.Parameter.VAR_POSITIONAL in kinds:
        return None
    selves = sum(each.name in _OWN for each in parameters)
    example = ", ".join(f"{word}=..." for word in by_name[: given - places])
    return (
        f"{name}() takes {places - selves or 'no'} argument{'' if places - selves == 1 else 's'} by position, "
        f"got {given - selves}: name {'the others' if places > selves else 'them'}, as in {name}({example})"
    )


def _meant(word: str, known: list[str]) -> str:
    """Return the likely meaning of a word, as the end of a sentence; else all known words."""
    if word in _COUNTED_OTHERWISE and _COUNTED_OTHERWISE[word][0] in known:
        return f"did you mean {_COUNTED_OTHERWISE[word][1]}?"
    near = [ours for ours in _ELSEWHERE.get(word, ()) if ours in known] or get_close_matches(word.lower(), known, 1)
    if near:
        return f"did you mean {' or '.join(f'{ours}=' for ours in near)}?"
    return f"it has {', '.join(f'{ours}=' for ours in known) or 'none'}"
