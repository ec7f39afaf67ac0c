"""Networks that predict the grasp that lays a rod in its place, instead of exact grasps.

There are two networks. "small" is shipped with withe. "source" is that of Choi, dissertation, 9.3.3, and users train it
themselves. Both have the interface of `grasp` and have gradients. A pattern of 200 nodes takes a hundredth of the time.
They do not predict forces. All quantities are in Lgb.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.deployment.grasping import Grasp
from withe.learning.surrogates import Form, Surrogate

__all__ = ["CURVATURES", "FORMS", "LENGTHS", "SHIPPED", "STIFFNESSES", "GraspNetwork", "shipped", "side"]

FloatArray = npt.NDArray[np.float64]
SHIPPED = Path(__file__).parent / "small.pt"
LENGTHS = (0.1, 50.0)  # [Lgb], range of training and of answers
CURVATURES = (0.0, 4.0)  # [1/Lgb], to either side
STIFFNESSES = (300.0, 8000.0)
_LEAST_FORCE = 0.01  # [w Lgb]
_NAMES = ("x", "y", "z", "ex", "ey", "ez")


def side(module: Any, curvature: Any) -> Any:
    """Odd function of curvature that multiplies the outputs, so that straight rods are laid straight."""
    return module.tanh(curvature)


def _string(module: Any, length: Any, curvature: Any, stretch: Any) -> tuple[Any, Any]:
    """Return the horizontal and vertical distance of the end of a hanging string that stretches slightly [Lgb].

    The horizontal force is that of a rod whose bend is so tight that weight is negligible, EI curvature^2 / 2, here
    curvature^2. A small constant is added so that straight rods are not a special case.
    """
    force = curvature * curvature + _LEAST_FORCE
    size = module.sqrt(length * length + force * force)
    sideways = force * module.log((length + size) / force) + 0.5 * force * length / stretch
    return sideways, size - force + 0.25 * length * length / stretch


def _tell(module: Any, length: Any, curvature: Any, stretch: Any, said: tuple[Any, ...]) -> dict[str, Any]:
    x, y, z, ex, ey, ez = said
    turned = side(module, curvature)
    sideways, high = _string(module, length, curvature, stretch)
    return dict(zip(_NAMES, (x, turned * (y - sideways), z + high, turned * ex, ey, turned * ez), strict=True))


def _tell_mirrored(module: Any, length: Any, curvature: Any, stretch: Any, said: tuple[Any, ...]) -> dict[str, Any]:
    x, y, z, ex, ey, ez = said
    turned = module.sign(curvature)
    return dict(zip(_NAMES, (x, turned * y, z, turned * ex, ey, turned * ez), strict=True))


def _learn(solutions: tuple[FloatArray, FloatArray, FloatArray, Grasp]) -> tuple[FloatArray, ...]:
    length, curvature, stretch, found = solutions
    (x, y, z), (ex, ey, ez), turned = found.position.T, found.rotation.T, side(np, curvature)
    sideways, high = _string(np, length, curvature, stretch)
    return x, y / turned + sideways, z - high, ex / turned, ey, ez / turned


FORMS = {
    # A rod of many Lgb hangs like a string: the network learns the difference from a string.
    "small": Form(
        ("log of suspended length", "size of curvature", "log of stretch stiffness"),
        ("x", "y beside a string", "z above a string", "ex over side", "ey", "ez over side"),
        lambda module, length, curvature, stretch: (module.log(length), abs(curvature), module.log(stretch)),
        _tell,
        _learn,
    ),
    "source": Form(
        ("suspended length", "size of curvature", "stretch stiffness"),
        _NAMES,
        lambda module, length, curvature, stretch: (length, abs(curvature), stretch),
        _tell_mirrored,
        lambda solutions: (*solutions[3].position.T, *solutions[3].rotation.T),
    ),
}


class GraspNetwork(Surrogate):
    """Network that predicts grasps that lay a rod. `train` makes one, `load` reads one.

    Its results approximate those of `grasp(suspended, curvature, stretch_stiffness)`, mirrored for negative curvature.

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
    >>> network = withe.deployment.GraspNetwork.load()  # doctest: +SKIP
    >>> network(5.0, 0.25).position  # doctest: +SKIP
    """

    FORMS: ClassVar[Mapping[str, Form]] = FORMS
    SHIPPED: ClassVar[Path] = SHIPPED
    LEARNED: ClassVar[str] = "grasps"

    def __call__(
        self, suspended: npt.ArrayLike, curvature: npt.ArrayLike, stretch_stiffness: npt.ArrayLike = 2087.0
    ) -> Grasp:
        """Grasps that lay a rod with given curvatures.

        Parameters
        ----------
        suspended : array_like [Lgb]
            Length that hangs, 0.1 to 50.
        curvature : array_like [1/Lgb]
            At lift-off, -4 to 4; see `grasp` for its sign.
        stretch_stiffness : array_like
            300 to 8000.

        Returns
        -------
        Grasp
            As `grasp` has it. A network knows no forces: these and the residual are NaN. All exact grasps in its range
            are stable, and so its own are called.

        Raises
        ------
        ValueError
            Not numbers, beyond what the network has learned, or shapes that do not broadcast.
        """
        asked = validation.broadcast_arrays(
            suspended=suspended, curvature=curvature, stretch_stiffness=stretch_stiffness
        )
        require_learned(*asked)
        rows = np.stack(self._form.ask(np, *asked), axis=-1)
        known = self._form.tell(np, *asked, tuple(np.moveaxis(self.network(rows), -1, 0)))
        columns = [known[name] for name in _NAMES]
        shape = asked[0].shape
        return Grasp(
            position=np.stack(columns[:3], axis=-1),
            rotation=np.stack(columns[3:], axis=-1),
            force=np.full((*shape, 3), np.nan),
            stable=np.ones(shape, bool),
            residual=np.full(shape, np.nan),
        )

    def tensors(self, suspended: Any, curvature: Any, stretch_stiffness: Any) -> dict[str, Any]:
        """Predict with torch tensors, with gradients.

        Parameters
        ----------
        suspended, curvature, stretch_stiffness : Tensor
            Floating point tensors, broadcast together. Values out of range give meaningless results and no error.

        Returns
        -------
        dict of Tensor
            "x", "y", "z" [Lgb] of the position, and "ex", "ey", "ez" [rad] of the rotation vector.

        Raises
        ------
        ValueError
            Not floating point tensors, or shapes that do not broadcast.
        ImportError
            torch is not installed.

        Examples
        --------
        >>> network.tensors(length, curvature, stiffness)["z"].sum().backward()  # doctest: +SKIP
        """
        torch = require("torch", "learn")
        asked = (suspended, curvature, stretch_stiffness)
        if not all(isinstance(values, torch.Tensor) for values in asked):
            raise ValueError(
                "suspended, curvature and stretch_stiffness must be tensors: for arrays, call the network itself"
            )
        asked = torch.broadcast_tensors(*asked)
        said = self.network(torch.stack(self._form.ask(torch, *asked), dim=-1))
        return self._form.tell(torch, *asked, said.unbind(-1))


def require_learned(suspended: FloatArray, curvature: FloatArray, stretch_stiffness: FloatArray) -> None:
    """Refuse arguments outside of the range that the networks have learned."""
    for values, name, (low, high) in (
        (suspended, "suspended", LENGTHS),
        (np.abs(curvature), "the size of curvature", CURVATURES),
        (stretch_stiffness, "stretch_stiffness", STIFFNESSES),
    ):
        beyond = values[(values < low) | (values > high)]
        if beyond.size:
            raise ValueError(
                f"{name} must be from {low:g} to {high:g} for a network, got {beyond[0]:g}: use grasp for other values"
            )


@cache
def shipped() -> GraspNetwork:
    """Return the small network that is shipped with withe."""
    return GraspNetwork.load()
