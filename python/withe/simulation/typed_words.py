"""Types of the words of `set` and `get`, for each kind of part: misspelt words are errors to type checkers.

A `TypedDict` lists what `Simulation.set` and `Batch.set` change of one kind, and a `Literal` what `get` returns. The
tests compare them with the table of parts (`withe.parts.table`), in which a new word is written first. `N` stands for
the type of a number: a number of one simulation, or an array with a row for each simulation of a batch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, Literal, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from withe.parts.applied_loads import Value
from withe.parts.contacts import Toucher
from withe.parts.friction import Friction
from withe.simulation.motion import RotationLike

__all__ = [
    "DragWord",
    "DragWords",
    "FluidNumber",
    "FluidWords",
    "Frictions",
    "JointWord",
    "JointWords",
    "LoadVector",
    "LoadWords",
    "MassWord",
    "MassWords",
    "MaterialWord",
    "Number",
    "ObstacleNumber",
    "ObstacleVector",
    "ObstacleWords",
    "PairNumber",
    "PairWords",
    "RodArray",
    "RodWords",
    "Rotations",
    "SceneNumber",
    "SceneWords",
    "SpringWord",
    "SpringWords",
    "SupportVector",
    "SupportWords",
    "TendonWord",
    "TendonWords",
    "TorsionWord",
    "TorsionWords",
    "Toucher",
    "Values",
]

Number = float | np.floating[Any] | np.integer[Any]
# Values of a batch: one for all simulations, or a row for each.
Values = Value | Sequence[Callable[[float], npt.ArrayLike]]
Frictions = Friction | npt.ArrayLike | Sequence[Friction]
Rotations = RotationLike | Sequence[RotationLike]

N = TypeVar("N")  # number
V = TypeVar("V")  # value of a load
F = TypeVar("F")  # friction of a body
R = TypeVar("R")  # rotation


class RodWords(TypedDict, total=False):
    """Words of a rod that `set` changes."""

    youngs_modulus: npt.ArrayLike
    poisson_ratio: npt.ArrayLike
    density: npt.ArrayLike
    viscosity: npt.ArrayLike
    stretch_stiffness: npt.ArrayLike
    bend_stiffness: npt.ArrayLike
    twist_stiffness: npt.ArrayLike
    line_density: npt.ArrayLike
    viscous_time: npt.ArrayLike
    drag: npt.ArrayLike
    natural_curvature: npt.ArrayLike
    natural_twist: npt.ArrayLike
    natural_stretch: npt.ArrayLike
    discrete_curvature: npt.ArrayLike


class LoadWords(TypedDict, Generic[V], total=False):
    """Words of a load that `set` changes: the one of its kind."""

    force: V
    moment: V
    load: V
    pressure: V


class MassWords(TypedDict, Generic[N], total=False):
    """Words of a mass that `set` changes."""

    mass: N


class SpringWords(TypedDict, Generic[N], total=False):
    """Words of a spring that `set` changes."""

    stiffness: N
    rest_length: N
    damping: N


class TendonWords(TypedDict, Generic[N], total=False):
    """Words of a tendon that `set` changes."""

    tension: N


class JointWords(TypedDict, Generic[N], total=False):
    """Words of a revolute joint that `set` changes."""

    stiffness: N
    rest_angle: N
    damping: N
    moment: N
    max_torque: N
    max_speed: N


class TorsionWords(TypedDict, Generic[N], total=False):
    """Words of a torsion spring that `set` changes."""

    stiffness: N
    rest_angle: N


class DragWords(TypedDict, Generic[N], total=False):
    """Words of a drag that `set` changes."""

    drag: N


class FluidWords(TypedDict, Generic[N], total=False):
    """Words of a fluid that `set` changes."""

    viscosity: N
    regularization: N


class ObstacleWords(TypedDict, Generic[N, F], total=False):
    """Words of an obstacle that `set` changes."""

    friction: F
    restitution: N
    rolling_friction: N


class SupportWords(TypedDict, Generic[N, R], total=False):
    """Words of a support that `set` changes."""

    position: npt.ArrayLike
    rotation: R
    friction: N


class PairWords(TypedDict, Generic[N, F], total=False):
    """Words of two bodies that `set` changes."""

    friction: F
    restitution: N
    contact_stiffness: N


class SceneWords(TypedDict, Generic[N], total=False):
    """Words of the scene that `set` changes."""

    gravity: npt.ArrayLike
    friction: N
    slip_tolerance: N
    restitution: N
    contact_stiffness: N | None


MaterialWord = Literal["youngs_modulus", "poisson_ratio", "density", "viscosity"]
RodArray = Literal[
    "stretch_stiffness",
    "bend_stiffness",
    "twist_stiffness",
    "line_density",
    "viscous_time",
    "drag",
    "natural_curvature",
    "natural_twist",
    "natural_stretch",
    "radius",
]
LoadVector = Literal["force", "moment", "load"]
MassWord = Literal["mass"]
SpringWord = Literal["stiffness", "rest_length", "damping"]
TendonWord = Literal["tension"]
JointWord = Literal["stiffness", "rest_angle", "damping", "moment", "max_torque", "max_speed"]
TorsionWord = Literal["stiffness", "rest_angle", "angle"]
DragWord = Literal["drag"]
FluidNumber = Literal["viscosity"]
ObstacleNumber = Literal["restitution", "rolling_friction"]
ObstacleVector = Literal["position", "turn"]
SupportVector = Literal["position", "rotation"]
PairNumber = Literal["restitution"]
SceneNumber = Literal["friction", "restitution", "slip_tolerance"]
