"""Plans of deployments in files: conversion from the content of JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

import numpy as np

from withe.common import validation
from withe.deployment.cable import Cable
from withe.deployment.motion import Phase, Start
from withe.deployment.pattern import Pattern
from withe.deployment.posts import Post
from withe.io import increasing_times, with_gaps

__all__ = ["KIND", "VERSION", "parts_of"]

KIND, VERSION = "plan of a deployment", 1
_METHODS = ("exact", "least_friction", "optimised", "network", "intuitive")
_UNIT = 1e-9  # of quaternions


def parts_of(content: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a plan from the result of its `to_dict`.

    Raises
    ------
    KeyError, TypeError, ValueError
        Content that is missing, of a wrong type, or inconsistent.
    """
    motion, cable = content["motion"], dict(content["cable"])
    times = increasing_times(motion["t"], "t")
    rotations = validation.number_array(motion["quaternion_xyzw"], "quaternion_xyzw", (len(times), 4))
    if (np.abs(np.linalg.norm(rotations, axis=1) - 1.0) > _UNIT).any():
        raise ValueError("quaternion_xyzw must have length 1")
    tail = validation.non_negative(cable.pop("tail"), "tail")
    pattern = Pattern.from_dict(content["pattern"])
    needed = with_gaps(content["pattern"]["needed_friction"], "needed_friction", len(pattern.points))
    return {
        "times": times,
        "positions": validation.number_array(motion["position"], "position", (len(times), 3)),
        "rotations": rotations,
        "laid": validation.number_array(motion["laid"], "laid", (len(times),)),
        "phases": tuple(_phase(phase) for phase in content["phases"]),
        "cable": Cable(**cable),
        "pattern": pattern,
        "tail": tail,
        "method": validation.choice(content["controller"], "method", _METHODS),
        "start": validation.choice(content["start"], "start", get_args(Start)),
        "speed": validation.positive(content["speed"], "speed"),
        "fastest": validation.positive(content["fastest"], "fastest"),
        "needed_friction": needed,
        "posts": tuple(Post(**post) for post in content["posts"]),
    }


def _phase(phase: Mapping[str, Any]) -> Phase:
    name = validation.choice(phase["name"], "name of a phase", ("hang", "touch down", "lay"))
    return Phase(name, validation.number(phase["start"], "start"), validation.number(phase["end"], "end"))
