"""The fluid that the rods of a scene move through: the part of `Scene` that is about it."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from withe import _core
from withe.common import validation
from withe.parts.directory import Directory
from withe.parts.handles import Fluid
from withe.parts.kinds import FluidModel, FluidPart, RodPart

__all__ = ["Fluids", "describe_fluid"]


class Fluids:
    """The fluid of a scene."""

    _directory: Directory

    def add_fluid(
        self,
        viscosity: float,
        *,
        model: FluidModel = "stokeslets",
        regularization: float | None = None,
        wavelength: float | None = None,
        name: str | None = None,
    ) -> Fluid:
        """Surround all rods by a viscous fluid without inertia, at rest far away (Stokes flow).

        It neither carries (for buoyancy, change `gravity`) nor resists spin about a rod's tangent. What rods lose to it
        is in `energy().dissipated`.

        Parameters
        ----------
        viscosity : float [Pa s]
        model : {"stokeslets", "resistive"}
            With "stokeslets" every piece of a rod moves the fluid at all others: regularized Stokeslet segments
            [Cortez 2018, J. Comput. Phys. 375], whose dense equations are solved once a step, for velocities as
            they are then; what these change within the step meets a local drag, so steps stay stable. The work of a
            step grows with the square of the number of nodes. With "resistive" each piece is resisted as if alone,
            -mu (c_t v_t + c_n v_n) per length, exactly and implicitly; rods do not feel each other.
        regularization : float [m]
            Of "stokeslets" (not used by the other): the length over which a point force is spread. By default sqrt(e)
            = 1.65 times the radius, for which a thin rod has the resistance that slender-body theory gives to a
            cylinder; then the radius must be the same all over the scene. Edges of a third of it or more are needed.
        wavelength : float [m]
            Of "resistive" (not used by the other): of waves along the rods, such as the length of one turn of a helix,
            for c_t = 2 pi / ln(.18 wavelength / radius), c_n = 4 pi / (ln(.18 wavelength / radius) + 1/2)
            [Lighthill 1976]. By default rods are taken as straight: c_t = 2 pi / (ln(length / radius) - 1/2), c_n =
            4 pi / (ln(length / radius) + 1/2), as of spheroids [Happel and Brenner 1965].
        name : str

        Returns
        -------
        Fluid
            `Simulation.set` changes its viscosity.

        Raises
        ------
        ValueError
            A second fluid, a number out of range, or an unknown model.

        Examples
        --------
        >>> glycerol = scene.add_fluid(viscosity=1.4, regularization=1e-3)
        """
        others = self._directory.all(FluidPart)
        if others:
            raise ValueError(f"fluid must be the only one: the scene has {others[0].name!r}")
        name = self._directory.new_name(name, "fluid")
        part = FluidPart(
            name,
            cast(FluidModel, validation.choice(model, "model of the fluid", ("stokeslets", "resistive"))),
            validation.positive(viscosity, "viscosity of the fluid"),
            None if regularization is None else validation.positive(regularization, "regularization of the fluid"),
            None if wavelength is None else validation.positive(wavelength, "wavelength of the fluid"),
        )
        return cast(Fluid, self._directory.add(part))


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
            "regularization of the fluid must be given where radii differ, "
            f"here from {radii.min():g} to {radii.max():g} m"
        )
    return math.sqrt(math.e) * float(radii.max())
