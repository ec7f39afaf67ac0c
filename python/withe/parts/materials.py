"""Materials, and stiffnesses given directly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.parts.sections import Circle, Rectangle, Section, Tube

__all__ = ["Circle", "Material", "Rectangle", "Section", "Stiffness", "Tube"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
@dataclass(frozen=True, kw_only=True)
class Material:
    """A linear elastic, Kelvin-Voigt viscous material.

    Parameters
    ----------
    youngs_modulus : float [Pa]
    poisson_ratio : float [-]
        In (-1, 0.5]; 0.5, the default, keeps the volume.
    density : float [kg/m^3]
    viscosity : float [Pa s]
        Stress per rate of strain. Stretching, bending and twisting are damped by their own stiffness
        times viscosity / youngs_modulus.

    Raises
    ------
    ValueError
        A modulus or density that is not positive, a negative viscosity, a Poisson ratio out of range.

    See Also
    --------
    Stiffness : Stiffnesses given directly.
    Scene.add_rod : Add a rod of a material.

    Examples
    --------
    >>> silicone = Material(youngs_modulus=1.0e6, density=1200.0)
    >>> silicone.shear_modulus
    333333.3333333333
    """

    youngs_modulus: float
    poisson_ratio: float = 0.5
    density: float
    viscosity: float = 0.0

    def __post_init__(self) -> None:
        check_poisson_ratio(self.poisson_ratio, "poisson_ratio of the material")
        for name in ("youngs_modulus", "density"):
            object.__setattr__(self, name, validation.positive(getattr(self, name), f"{name} of the material"))
        object.__setattr__(self, "viscosity", validation.non_negative(self.viscosity, "viscosity of the material"))
        object.__setattr__(self, "poisson_ratio", float(self.poisson_ratio))

    @property
    def shear_modulus(self) -> float:
        """E / (2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


def check_poisson_ratio(value: float, what: str) -> float:
    """A Poisson ratio in (-1, 0.5]."""
    ratio = validation.number(value, what)
    if not -1.0 < ratio <= 0.5:
        raise ValueError(f"{what} must lie in (-1, 0.5], got {ratio:g}")
    return ratio


@keyword_hints
@dataclass(frozen=True, kw_only=True)
class Stiffness:
    """Stiffnesses of a rod given directly, instead of by a material.

    Parameters
    ----------
    stretch : float or array_like of shape (edges,) [N]
        EA.
    bend : float, pair, or array_like of shape (edges, 2) [N m^2]
        EI1 and EI2, which resist curvature towards d1 and d2; one number for both.
    twist : float or array_like of shape (edges,) [N m^2]
        GJ.
    viscous_time : float or array_like of shape (edges,) [s]
        Kelvin-Voigt damping: every stiffness times this time resists the rate of its strain.

    See Also
    --------
    Material : Stiffness and mass from a material.
    """

    stretch: npt.ArrayLike
    bend: npt.ArrayLike
    twist: npt.ArrayLike
    viscous_time: npt.ArrayLike = 0.0


def bend_stiffness(value: npt.ArrayLike, what: str, edges: int) -> FloatArray:
    """Bending stiffnesses as an array of shape (edges, 2) [N m^2]."""
    if validation.is_scalar(value):
        return np.full((edges, 2), validation.positive(value, what))
    array = validation.number_array(value, what, (2,), (edges, 2))
    if np.any(array <= 0.0):
        raise ValueError(f"{what} must be positive, got {array[array <= 0.0][0]:g}")
    return np.array(np.broadcast_to(array, (edges, 2)))
