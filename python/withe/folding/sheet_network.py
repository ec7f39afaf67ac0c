"""Networks that predict sheets which hang from a jaw without moment, in place of exact equilibria.

There are two networks. "small" is shipped with withe. "source" is that of Choi, dissertation, 7.5.2, and users train it
themselves. Both have the interface of `elastica` and have gradients. A batch of a thousand takes a fiftieth of the
time. Plans need neither. All quantities are in Lgb and w Lgb.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from withe._core import SheetManifold
from withe.common import validation
from withe.common.extras import require
from withe.folding.sheets import LONGEST, SHORTEST, Elastica
from withe.learning.surrogates import Form, Surrogate

__all__ = ["FORMS", "SHIPPED", "SheetNetwork", "shipped", "straight"]

FloatArray = npt.NDArray[np.float64]
SHIPPED = Path(__file__).parent / "small.pt"


def straight(x: Any, z: Any) -> Any:
    """Length of a straight sheet from the table to the tip [Lgb], which is the shortest possible one.

    From x = l (1 - cos phi) and z = l sin phi follows l = (x^2 + z^2) / 2x. Suspended lengths are 1.2 to 2 times this
    length, and both vary steeply with x near x = 0.
    """
    return (x * x + z * z) / (2.0 * x)


def _from_straight(module: Any, x: Any, z: Any) -> tuple[Any, ...]:
    return module.log(straight(x, z)), module.arctan2(x, z)


def _with_straight(module: Any, x: Any, z: Any, said: tuple[Any, ...]) -> dict[str, Any]:
    angle, share, direction, size, curvature = said
    force = module.exp(size)
    return {
        "angle": angle,
        "suspended": straight(x, z) * module.exp(share),
        "normal_force": force * module.cos(direction),
        "tangential_force": force * module.sin(direction),
        "force_ratio": abs(module.tan(direction)),
        "max_curvature": module.exp(curvature),
    }


FORMS = {
    # Forces by direction and size: the ratio is the tangent of the direction, and neither is large anywhere.
    "small": Form(
        ("log of straight length", "angle from the vertical"),
        ("angle", "log of length to straight length", "direction of force", "log of force", "log of curvature"),
        _from_straight,
        _with_straight,
        lambda pose: (
            pose.angle,
            np.log(pose.suspended / straight(pose.x, pose.z)),
            np.arctan2(pose.tangential_force, pose.normal_force),
            np.log(np.hypot(pose.tangential_force, pose.normal_force)),
            np.log(pose.max_curvature),
        ),
    ),
    "source": Form(
        ("x", "z"),
        ("force ratio", "angle", "suspended"),
        lambda module, x, z: (x, z),
        lambda module, x, z, said: dict(zip(("force_ratio", "angle", "suspended"), said, strict=True)),
        lambda pose: (pose.force_ratio, pose.angle, pose.suspended),
    ),
}


class SheetNetwork(Surrogate):
    """Network that predicts sheets which hang from a jaw without moment. `train` makes one, `load` reads one.

        Its results approximate those of `elastica(x, z)`. The network does not detect sheets that touch the table
        elsewhere. It therefore also returns results at x > 9.1, z < 0.8, where `elastica` refuses most positions.

    Attributes
    ----------
    network : withe.learning.Network

    Raises
    ------
    ValueError
        A network that has learned something else.

    Examples
    --------
    >>> import withe
    >>> network = withe.folding.SheetNetwork.load()  # doctest: +SKIP
    >>> network(3.0, 2.25).angle  # doctest: +SKIP
    """

    FORMS: ClassVar[Mapping[str, Form]] = FORMS
    SHIPPED: ClassVar[Path] = SHIPPED
    LEARNED: ClassVar[str] = "sheets"

    def __call__(self, x: npt.ArrayLike, z: npt.ArrayLike) -> Elastica:
        """Return hanging sheets with tips at positions.

        Parameters
        ----------
        x, z : array_like, broadcast together [Lgb]

        Returns
        -------
        Elastica
            As `elastica` has it, and refused where that refuses, as far as the network knows; all that is valid is
            called stable. What a network has not learned is NaN.

        Raises
        ------
        ValueError
            Not numbers, not finite, or shapes that do not broadcast.
        """
        x, z = validation.broadcast_arrays(x=x, z=z)
        there = (x > 0) & (z > 0)
        x_there, z_there = x[there], z[there]
        asked = np.stack(self._form.ask(np, x_there, z_there), axis=-1)
        said = self.network(asked.astype(np.float32)).astype(float)
        known = self._form.tell(np, x_there, z_there, tuple(said.T))
        inside = ((asked >= self.network.domain[0]) & (asked <= self.network.domain[1])).all(axis=1)
        inside &= (known["suspended"] > SHORTEST) & (known["suspended"] < LONGEST)
        inside &= known.get("tangential_force", 0.0) > -SheetManifold.greatest_pull
        valid = np.zeros(x.shape, bool)
        valid[there] = inside

        def column(name: str) -> FloatArray:
            values = np.full(x.shape, np.nan)
            if name in known:
                values[valid] = known[name][inside]
            return values

        names = ("angle", "suspended", "normal_force", "tangential_force", "force_ratio", "max_curvature")
        return Elastica(
            x=np.where(valid, x, np.nan),
            z=np.where(valid, z, np.nan),
            **{name: column(name) for name in names},
            tip_moment=np.where(valid, 0.0, np.nan),
            valid=valid,
            stable=valid.copy(),
        )

    def tensors(self, x: Any, z: Any) -> dict[str, Any]:
        """Predict with torch tensors, with gradients.

        Parameters
        ----------
        x, z : Tensor [Lgb]
            Floating point tensors, broadcast together. Values that are not positive, or far out of range, give
            meaningless results and no error.

        Returns
        -------
        dict of Tensor
            The names are those of `Elastica`: "angle", "suspended", "force_ratio". The small network adds
            "normal_force", "tangential_force" and "max_curvature".

        Raises
        ------
        ValueError
            Not floating point tensors, or shapes that do not broadcast.
        ImportError
            torch is not installed.

        Examples
        --------
        >>> network.tensors(x, z)["force_ratio"].sum().backward()  # doctest: +SKIP
        """
        torch = require("torch", "learn")
        if not isinstance(x, torch.Tensor) or not isinstance(z, torch.Tensor):
            raise ValueError("x and z must be tensors: for arrays, call the network itself")
        x, z = torch.broadcast_tensors(x, z)
        said = self.network(torch.stack(self._form.ask(torch, x, z), dim=-1))
        return self._form.tell(torch, x, z, said.unbind(-1))


@cache
def shipped() -> SheetNetwork:
    """Return the small network that is shipped with withe."""
    return SheetNetwork.load()
