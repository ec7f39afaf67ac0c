"""Plans of folds in files: conversion to and from the content of JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.folding.jaw import Jaw
from withe.folding.paper import Paper
from withe.folding.sheets import Elastica
from withe.io import increasing_times, listed, with_gaps

__all__ = ["KIND", "VERSION", "parts_of", "sheet_listed"]

FloatArray = npt.NDArray[np.float64]
KIND, VERSION = "plan of a fold", 1
_LIMITS = ("speed", "turning", "acceleration")
_SHARES = ("gravito_bending_length", "friction")
_FLAGS = ("valid", "stable")
_ROUNDED = 1e-6  # rounding error of angles from quaternions [rad]


def sheet_listed(sheet: Elastica | None) -> dict[str, list[Any]] | None:
    """List the predicted sheet of a plan, pose by pose."""
    if sheet is None:
        return None
    return {name: value.tolist() if name in _FLAGS else listed(value) for name, value in vars(sheet).items()}


def parts_of(content: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a plan from the result of its `to_dict`.

    Raises
    ------
    KeyError, TypeError, ValueError
        Content that is missing, of a wrong type, or inconsistent.
    """
    times = increasing_times(content["times"], "times")
    count = len(times)
    poses = validation.number_array(content["poses"], "poses", (count, 7))
    angles = validation.number_array(content["angles"], "angles", (count,))
    turned = np.stack([np.sin(0.5 * angles), np.zeros(count), np.cos(0.5 * angles)], axis=1)
    if (np.abs(poses[:, 4:] - turned) > _ROUNDED).any() or poses[:, 3].any():
        raise ValueError("poses must be turned about y by angles")
    jaw = dict(content["jaw"])
    side = validation.choice(jaw.pop("side"), "side", ("edge", "side"))
    clearance = validation.number(jaw.pop("clearance"), "clearance")
    plunges_at, blocked = content["plunges_at"], content["blocked"]
    if blocked is not None and not isinstance(blocked, str):
        raise ValueError("blocked must be text or null")
    methods = ("intuitive", "local", "ucs", "slip")
    sheet = _sheet(content["sheet"], count)
    if (sheet is None) != (content["method"] == "intuitive"):
        raise ValueError("sheet must be given, except for method 'intuitive'")
    return {
        "paper": Paper(**content["paper"]),
        "target": validation.number(content["target"], "target"),
        "method": validation.choice(content["method"], "method", methods),
        "grasp": validation.choice(content["grasp"], "grasp", ("moment_free", "free")),
        "jaw": Jaw(**jaw),
        "limits": tuple(validation.positive(content["limits"][name], name) for name in _LIMITS),
        "offset": validation.number(content["offset"], "offset"),
        "rise": validation.non_negative(content["rise"], "rise"),
        "side": side,
        "clearance": clearance,
        "uncertainty": tuple(validation.share(content["uncertainty"][name], f"{name} share") for name in _SHARES),
        "curvature": validation.positive(content["curvature"], "curvature"),
        "manifold": validation.choice(content["manifold"], "manifold", ("exact", "network")),
        "poses": poses,
        "angles": angles,
        "times": times,
        "plunges_at": None if plunges_at is None else validation.positive(plunges_at, "plunges_at"),
        "plunge_slide": validation.number(content["plunge_slide"], "plunge_slide"),
        "blocked": blocked,
        "_foreseen": sheet,
    }


def _sheet(columns: Mapping[str, Any] | None, count: int) -> Elastica | None:
    if columns is None:
        return None
    arrays: dict[str, Any] = {}
    for name in Elastica.__dataclass_fields__:
        values = columns[name]
        if not isinstance(values, list) or len(values) != count:
            raise ValueError(f"{name} of sheet must be {count} values, one a pose")
        if name in _FLAGS:
            arrays[name] = np.array([validation.truth(value, f"{name} of sheet") for value in values])
        else:
            arrays[name] = with_gaps(values, f"{name} of sheet", count)
    return Elastica(**arrays)
