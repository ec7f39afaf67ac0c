"""The jaw that holds a sheet by its edge: its poses and its size."""

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
        Length of the sheet between the fingers. The free part of the sheet ends at the inner edge of the jaw.
    finger : float [m]
        Thickness of either finger.
    reach : float [m]
        Length of the fingers beyond the edge of the sheet. Farther out, the gripper is out of the way.
    stiffness : (float, float), optional [N/m, N m/rad]
        Stiffness with which the fingers hold the sheet, against displacement and rotation. A jaw that comes too low
        yields, and rests on the table. Plans assume a rigid jaw. The default is 2000 and 10, which is thousands of
        times the stiffness of office paper, or 5000 EI / Lgb^3 and 10000 EI / Lgb for heavier and stiffer sheets.
    force_limit : float [N]
        Largest force with which the fingers press on the table; beyond it the sheet slips in the jaw.

    Raises
    ------
    ValueError
        A size that is negative, a stiffness or a force limit that is not positive.

    Examples
    --------
    >>> import withe
    >>> withe.folding.Jaw(depth=0.01, finger=0.001)
    Jaw(depth=0.01, finger=0.001, reach=0.06, stiffness=None, force_limit=10.0)
    """

    depth: float = 0.01
    finger: float = 5e-4
    reach: float = 0.06
    stiffness: tuple[float, float] | None = None
    force_limit: float = 10.0

    def __post_init__(self) -> None:
        for name in ("depth", "finger", "reach"):
            object.__setattr__(self, name, validation.non_negative(getattr(self, name), name))
        if self.stiffness is not None:
            along, about = self.stiffness
            pair = validation.positive(along, "stiffness along"), validation.positive(about, "stiffness about")
            object.__setattr__(self, "stiffness", pair)
        object.__setattr__(self, "force_limit", validation.positive(self.force_limit, "force_limit"))

    def clearance(self, x: FloatArray, z: FloatArray, angle: FloatArray, side: str) -> FloatArray:
        """Return the height of the lowest point of the fingers over the table.

        With `side` "edge" the fingers come from beyond the outer edge, in line with the sheet. With "side" they come
        across the sheet, and nothing of them is beyond the edge.

        Parameters
        ----------
        x, z : ndarray of shape (n,) [m]
            Position of the outer edge of the sheet.
        angle : ndarray of shape (n,) [rad]
            Angle of the held part of the sheet above the table.
        side : {"edge", "side"}
            Direction from which the fingers come.

        Returns
        -------
        ndarray of shape (n,) [m]
        """
        beyond = self.reach if side == "edge" else 0.0
        sine, cosine = np.sin(angle), np.abs(np.cos(angle))
        return np.asarray(z + np.minimum(beyond * sine, -self.depth * sine) - self.finger * cosine)


def inner_edge(poses: FloatArray, depth: float) -> FloatArray:
    """Return the inner edges of the jaw, from its outer edges: x from its position in the flat sheet, z, angle."""
    x, z, angle = poses.T
    return np.stack([x - depth + depth * np.cos(angle), z - depth * np.sin(angle), angle], axis=1)


def outer_edge(poses: FloatArray, depth: float) -> FloatArray:
    """Undo `inner_edge`."""
    x, z, angle = poses.T
    return np.stack([x + depth - depth * np.cos(angle), z + depth * np.sin(angle), angle], axis=1)
