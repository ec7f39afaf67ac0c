"""Objects that refuse new attributes, because a misspelt name would have no effect."""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches
from typing import Any, TypeVar

__all__ = ["known_attributes", "of_a_simulation"]

T = TypeVar("T", bound=type)

SIMULATION_WORDS = frozenset(
    [
        "check_jacobian",
        "contacts",
        "curvatures",
        "deflection",
        "directors",
        "energy",
        "equilibrium",
        "feed",
        "get",
        "hand",
        "joint_angle",
        "joint_rate",
        "joint_torque",
        "linearise",
        "link",
        "momentum",
        "move",
        "obstacle_position",
        "passage",
        "picture",
        "plan",
        "plot",
        "pose",
        "positions",
        "reaction",
        "record",
        "release",
        "remove",
        "reset",
        "restore",
        "run",
        "set",
        "set_state",
        "set_velocities",
        "snapshot",
        "spins",
        "spring_tension",
        "statistics",
        "step",
        "step_jacobian",
        "tendon_length",
        "tendon_points",
        "tensions",
        "time",
        "time_step",
        "twists",
        "velocities",
        "view",
        "wrench",
    ]
)
"""Attributes of a simulation that new users look for on scenes and handles."""


def of_a_simulation(owner: str, name: str, call: str, own: str = "") -> AttributeError:
    """Return the error for an attribute that a scene or a handle lacks, and the way to get it from a simulation.

    Parameters
    ----------
    owner : str
        Name of the object in the message, such as "rod 'arm'".
    name : str
        Name of the attribute.
    call : str
        Call on a simulation, with {} for the attribute, such as "simulation.{}(arm)".
    own : str
        Attributes that the object has, for the message; empty to list none.
    """
    if name not in SIMULATION_WORDS:
        return AttributeError(f"{owner} has no attribute {name!r}" + (own and f": use {own}"))
    how = f"simulation = scene.build(), then {call.format(name)}"
    return AttributeError(f"{owner} has no {name!r}: build the scene first, {how}")


def known_attributes(instead: str) -> Callable[[T], T]:
    """Make a class, but not its subclasses, refuse public attributes that it does not define.

    Parameters
    ----------
    instead : str
        Advice for the message if no name of the class is similar.

    Returns
    -------
    callable
        Decorator of the class.

    Examples
    --------
    >>> @known_attributes("build makes another")
    ... class Model:
    ...     pass
    >>> Model().gravity = 9.81
    Traceback (most recent call last):
        ...
    AttributeError: Model has no attribute 'gravity' to assign: build makes another
    """

    def refusing(known: T) -> T:
        def assign(self: Any, name: str, value: Any) -> None:
            own = type(self) is known  # derived classes may have any attributes
            if own and not name.startswith("_") and not hasattr(known, name):
                near = get_close_matches(name, [word for word in dir(known) if not word.startswith("_")], 1)
                meant = f"did you mean {near[0]}?" if near else instead
                raise AttributeError(f"{known.__name__} has no attribute {name!r} to assign: {meant}")
            object.__setattr__(self, name, value)

        known.__setattr__ = assign  # type: ignore[assignment, method-assign]
        return known

    return refusing
