"""Values that were set during a simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from withe.parts.friction import Coefficients
from withe.parts.kinds import LoadPart, SupportPart
from withe.parts.parameters import RodParameters
from withe.simulation.motion import PathTable

__all__ = ["Settings"]

FloatArray = npt.NDArray[np.float64]


@dataclass
class Settings:
    """Settings of a simulation that the engine does not keep in its state, or keeps in another form.

    Attributes
    ----------
    rods : list of RodParameters
    masses, drags, fluids : dict
        Present value of each part, by name.
    gravity : ndarray of shape (3,) [m/s^2]
    supports : dict of str to (int, SupportPart)
        Active supports, with their index in the engine.
    functions : dict of str to callable
        Functions of loads that vary, by name.
    paths : dict of (str, {"position", "rotation"}) to callable
        Paths of supports and obstacles, by name and moved word.
    friction_fields : dict of int to (int, str, Coefficients)
        Friction that varies over an obstacle: index of the pair in the engine, rod, name of the obstacle, and field.
    frictions : dict of tuple of str to Coefficients
        Fields of friction of obstacles, by their name, and of a rod and an obstacle, by both names. The engine stores
        all other friction.
    loads : dict of str to LoadPart
        Loads that were added during the simulation, in order.
    ramps : dict of (str, str or None) to float [s]
        Time of the last ramp, by word (or "move") and part.
    actuated : float [s]
        Time up to which the actuations of the scene have been applied.
    """

    rods: list[RodParameters]
    masses: dict[str, float]
    drags: dict[str, float]
    fluids: dict[str, float]
    gravity: FloatArray
    supports: dict[str, tuple[int, SupportPart]]
    functions: dict[str, Callable[[float], npt.ArrayLike]] = field(default_factory=dict)
    paths: PathTable = field(default_factory=dict)
    friction_fields: dict[int, tuple[int, str, Coefficients]] = field(default_factory=dict)
    frictions: dict[tuple[str, ...], Coefficients] = field(default_factory=dict)
    loads: dict[str, LoadPart] = field(default_factory=dict)
    ramps: dict[tuple[str, str | None], float] = field(default_factory=dict)
    actuated: float = -math.inf

    def copy(self) -> Settings:
        """Return an independent copy. Values are never changed in place."""
        return Settings(
            list(self.rods),
            dict(self.masses),
            dict(self.drags),
            dict(self.fluids),
            self.gravity.copy(),
            dict(self.supports),
            dict(self.functions),
            dict(self.paths),
            dict(self.friction_fields),
            dict(self.frictions),
            dict(self.loads),
            dict(self.ramps),
            self.actuated,
        )
