"""Mechanical description of a cable, by which a tracker predicts its hidden parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from withe.common import validation

__all__ = ["RodPrior"]

_LONGEST = 100.0  # greatest length of a cable that a picture shows [m]


@dataclass(frozen=True)
class RodPrior:
    """Elastic rod in the plane z = 0 of a camera, as the prior of a `Tracker`.

    Parameters
    ----------
    length : float [m]
        Length from end to end.
    bend_stiffness : float [N m^2]
        Bending stiffness in the plane.
    line_density : float [kg/m]
        Mass per length.
    gravity : (float, float) [m/s^2]
        Components of gravity along x and y of the plane. Zero for a plane that is level.
    natural_curvature : float [1/m]
        Curvature of the rod without load, positive if the rod turns from x to y on its way.
    damping : float [1/s]
        Drag force per mass and velocity.

    Raises
    ------
    ValueError
        A length, stiffness or density that is not positive, a length above 100 m, or values that are not finite.

    Examples
    --------
    >>> rope = RodPrior(length=0.6, bend_stiffness=2e-4, line_density=0.02)
    >>> rope.gravity
    (0.0, -9.81)
    """

    length: float
    bend_stiffness: float
    line_density: float
    gravity: tuple[float, float] = (0.0, -9.81)
    natural_curvature: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name in ("length", "bend_stiffness", "line_density"):
            object.__setattr__(self, name, validation.positive(getattr(self, name), name))
        if self.length > _LONGEST:
            raise ValueError(f"length must be at most {_LONGEST:g} m, got {self.length:g} m: are all sizes in metres?")
        x, y = validation.number_array(self.gravity, "gravity", (2,))
        object.__setattr__(self, "gravity", (float(x), float(y)))
        curvature = validation.number(self.natural_curvature, "natural_curvature")
        object.__setattr__(self, "natural_curvature", curvature)
        object.__setattr__(self, "damping", validation.non_negative(self.damping, "damping"))

    @property
    def weight(self) -> float:
        """Return the weight per length in the plane [N/m]."""
        return self.line_density * float(np.hypot(*self.gravity))
