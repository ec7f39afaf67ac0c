"""The jaw that holds a sheet by its edge: where it is, and what room it takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation

__all__ = ["Jaw", "inner_edge", "outer_edge"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Jaw:
    """Two flat fingers that hold the last part of a sheet straight.

    Parameters
    ----------
    depth : float [m]
        Of the sheet between the fingers. What hangs freely ends at the inner edge of the jaw.
    finger : float [m]
        Thickness of either finger.
    reach : float [m]
        Length of the fingers beyond the sheet's edge, to where the gripper is out of the way.

    Raises
    ------
    ValueError
        A size that is negative.

    Examples
    --------
    >>> import withe
    >>> withe.folding.Jaw(depth=0.01, finger=0.001)
    Jaw(depth=0.01, finger=0.001, reach=0.06)
    """

    depth: float = 0.01
    finger: float = 5e-4
    reach: float = 0.06

    def __post_init__(self) -> None:
        for name in ("depth", "finger", "reach"):
            object.__setattr__(self, name, validation.non_negative(getattr(self, name), name))

    def clearance(self, x: FloatArray, z: FloatArray, angle: FloatArray, side: str) -> FloatArray:
        """Height of the lowest point of the fingers over the table [m], the sheet's outer edge being at (x, z).

        `side` "edge": the fingers come from beyond the outer edge, in line with what they hold. "side": from the side
        of the sheet, across it, so that beyond the edge there is nothing of them.
        """
        beyond = self.reach if side == "edge" else 0.0
        sine, cosine = np.sin(angle), np.abs(np.cos(angle))
        return np.asarray(z + np.minimum(beyond * sine, -self.depth * sine) - self.finger * cosine)


def inner_edge(poses: FloatArray, depth: float) -> FloatArray:
    """Where the free part of a sheet ends: x from where that lay in the flat sheet, z, angle; from outer edges."""
    x, z, angle = poses.T
    return np.stack([x - depth + depth * np.cos(angle), z - depth * np.sin(angle), angle], axis=1)


def outer_edge(poses: FloatArray, depth: float) -> FloatArray:
    """Undo `inner_edge`."""
    x, z, angle = poses.T
    return np.stack([x + depth - depth * np.cos(angle), z + depth * np.sin(angle), angle], axis=1)
