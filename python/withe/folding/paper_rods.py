"""Paper as rods of the engine."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.folding.jaw import Jaw
from withe.folding.paper import Paper
from withe.parts.handles import Rod
from withe.parts.materials import Stiffness
from withe.scene.scene import Scene

__all__ = ["add_paper", "jaw_stiffness", "strip_numbers"]

FloatArray = npt.NDArray[np.float64]

_DENSITY = 800.0  # density of paper [kg/m^3]
_GRAVITY = 9.81  # [m/s^2], by which Lgb is defined


def strip_numbers(paper: Paper) -> tuple[float, float, float]:
    """Mass per length, bending and stretching stiffness of a sheet at its largest width [kg/m], [N m^2], [N].

    The bending stiffness is EI = 2 w Lgb^3, with w the weight per length. The stretching stiffness is that of a uniform
    strip of its thickness h, EA = 12 EI / h^2.
    """
    line_density = _DENSITY * paper.thickness * paper.width
    bend = 2.0 * line_density * _GRAVITY * paper.gravito_bending_length**3
    return line_density, bend, 12.0 * bend / paper.thickness**2


def jaw_stiffness(jaw: Jaw, paper: Paper) -> tuple[float, float]:
    """Stiffness of a jaw that holds a sheet, for displacement and rotation [N/m], [N m/rad]; plans assume rigidity."""
    if jaw.stiffness is not None:
        return jaw.stiffness
    lgb = paper.gravito_bending_length
    _, bend, _ = strip_numbers(paper)
    return max(2e3, 5e3 * bend / lgb**3), max(10.0, 1e4 * bend / lgb)


def add_paper(scene: Scene, paper: Paper, places: FloatArray, curl: float) -> Rod:
    """Add a flat sheet, seen from its side, with nodes at places along x, as rod "sheet".

    `curl` is its natural curvature [1/m], about -y.
    """
    line_density, bend, stretch = strip_numbers(paper)
    width: float | FloatArray = 1.0
    if not paper.is_strip:
        width = paper.width_at(0.5 * (places[1:] + places[:-1])) / paper.width
    bends = np.multiply.outer(width, (bend, bend))
    stiffness = Stiffness(stretch=stretch * width, bend=bends, twist=bend * width)
    zero = np.zeros_like(places)
    return scene.add_rod(
        points=np.stack([places, zero, zero], axis=1),
        normal=(0.0, 1.0, 0.0),
        radius=0.5 * paper.thickness,
        stiffness=stiffness,
        line_density=line_density * width,
        natural_curvature=(0.0, curl),
        name="sheet",
    )
