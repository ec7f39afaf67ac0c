"""The fluid that the rods of a scene move through."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from withe import _core
from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.kinds import FluidModel, FluidPart, RodPart

__all__ = ["describe_fluid", "make_fluid"]


def make_fluid(
    directory: Directory,
    viscosity: float,
    model: FluidModel,
    regularization: float | None,
    wavelength: float | None,
    name: str | None,
) -> FluidPart:
    """The fluid of a scene, checked; see `Scene.add_fluid`. Not yet in the directory."""
    others = directory.all(FluidPart)
    if others:
        raise ValueError(f"fluid must be the only one, but the scene already has {others[0].name!r}")
    name = directory.new_name(name, "fluid")
    validation.choice(model, "model of the fluid", get_args(FluidModel))
    return FluidPart(
        name,
        model,
        validation.positive(viscosity, "viscosity of the fluid"),
        None if regularization is None else validation.positive(regularization, "regularization of the fluid"),
        None if wavelength is None else validation.positive(wavelength, "wavelength of the fluid"),
    )


def describe_fluid(directory: Directory) -> _core.FluidDescription:
    """The fluid of a scene as the engine takes it.

    Raises
    ------
    ValueError
        No regularization, and rods of several radii.
    """
    description = _core.FluidDescription()
    for part in directory.all(FluidPart):
        description.model = part.model
        description.viscosity = part.viscosity
        description.wavelength = part.wavelength or 0.0
        if part.model == "stokeslets":
            description.regularization = part.regularization or _regularization(directory)
    return description


def _regularization(directory: Directory) -> float:
    """That of a cylinder: along a line of Stokeslets 4 ln(l / eps) must be the 4 ln(l / a) - 2 of slender bodies."""
    radii = np.concatenate([rod.section.radii for rod in directory.all(RodPart)])
    if np.ptp(radii) > 1e-9 * radii.max():
        raise ValueError(
            f"regularization of the fluid must be given when radii differ, got radii from {radii.min():g} to "
            f"{radii.max():g} m"
        )
    return math.sqrt(math.e) * float(radii.max())
