"""What friction it takes to lay a cable along a pattern."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.deployment.cable import JAW, Cable
from withe.deployment.grasping import Grasp, grasp, least_friction, table
from withe.deployment.smoothing import least_tension

__all__ = ["Controller", "Feasibility", "Slip", "examine"]

FloatArray = npt.NDArray[np.float64]
Controller = Literal["exact", "least_friction"]
_BEND_STIFFNESS = 2.0  # EI in units of w Lgb^2


@dataclass(frozen=True)
class Slip:
    """A stretch of a pattern that friction will not hold.

    Attributes
    ----------
    start, end : float [m]
        Arc lengths.
    needed : float
        Greatest coefficient of friction that the stretch would need.
    test : str
        What fails first there: "floor", "lift-off" or "free end".
    """

    start: float
    end: float
    needed: float
    test: str

    def __str__(self) -> str:
        return (
            f"{1e3 * self.start:.0f} to {1e3 * self.end:.0f} mm slips ({self.test}): it would need a coefficient of"
            f" friction of {self.needed:.2f}"
        )


@dataclass(frozen=True)
class Feasibility:
    """The coefficient of friction that each place of a pattern needs, by three tests.

    Attributes
    ----------
    arc_length : ndarray of shape (nodes,) [m]
    floor : ndarray of shape (nodes,)
        Where the cable lies. With EI its stiffness, w its weight and n its tension, the floor gives
        EI kappa'' - n kappa across and n' + EI kappa kappa' along it, per length; n is 0 at the free end and else
        chosen so that the greatest need is least. (Dissertation (9.2) is the first term alone.)
    lift_off : ndarray of shape (nodes,)
        While it is the lift-off point: the floor's force there along itself, over that across. Along the floor it
        carries what the suspended part needs and the jump to the shear EI kappa' of the part that lies; where the
        curvature is constant that is |Fy| / Fz.
    free_end : ndarray of shape (nodes,)
        Between it and the free end at most friction times weight can turn and shear the cable: it needs
        2 EI kappa / (w s^2) and EI kappa' / (w s), s the way from the free end. A pattern that begins with curvature
        always slips a little.
    friction : float
        What there is.
    slips : tuple of Slip
        Stretches that need more.
    """

    arc_length: FloatArray
    floor: FloatArray
    lift_off: FloatArray
    free_end: FloatArray
    friction: float
    slips: tuple[Slip, ...]

    @property
    def needed(self) -> FloatArray:
        """The greatest of the three, shape (nodes,)."""
        return np.asarray(np.maximum.reduce([self.floor, self.lift_off, self.free_end]))

    @property
    def feasible(self) -> bool:
        """Whether friction holds the cable all along."""
        return not self.slips

    def __str__(self) -> str:
        if self.feasible:
            return f"holds at a coefficient of friction of {self.friction:g}; {self.needed.max():.2f} is needed"
        return "\n".join(str(slip) for slip in self.slips)


class Laid(Protocol):
    """What a cable is laid along: arc lengths [m] and curvatures there [1/m]."""

    @property
    def arc_length(self) -> FloatArray: ...
    @property
    def curvature(self) -> FloatArray: ...
    @property
    def length(self) -> float: ...


class Curve(Laid, Protocol):
    """With the derivatives of curvature that forces on the floor depend on."""

    @property
    def curvature_slope(self) -> FloatArray: ...
    @property
    def curvature_bend(self) -> FloatArray: ...


def examine(
    pattern: Curve, cable: Cable, friction: float, controller: Controller, force: FloatArray | None = None
) -> Feasibility:
    """What `Pattern.feasibility` does; `force` of the grasps there, shape (nodes, 3), where it is known."""
    friction = validation.positive(friction, "friction")
    validation.choice(controller, "controller", ("exact", "least_friction"))
    if force is None:
        force = grasps_along(pattern, cable, controller).force
    lgb = cable.gravito_bending_length
    s = pattern.arc_length / lgb
    curvature, slope, bend = (
        pattern.curvature * lgb,
        pattern.curvature_slope * lgb**2,
        pattern.curvature_bend * lgb**3,
    )
    floor = _floor(s, curvature, slope, bend)
    # To the left, where the pattern's curvature is positive; the frame of a grasp has y there too.
    across = force[:, 1] - _BEND_STIFFNESS * slope
    lift_off = np.hypot(force[:, 0], across) / force[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = 2.0 * _BEND_STIFFNESS * np.abs(curvature) / s**2
        sheared = _BEND_STIFFNESS * np.abs(slope) / s
    free_end = np.nan_to_num(np.maximum(turned, sheared), nan=0.0, posinf=np.inf)
    free_end[0] = free_end[1]
    slips = _slips(pattern.arc_length, {"floor": floor, "lift-off": lift_off, "free end": free_end}, friction)
    return Feasibility(pattern.arc_length, floor, lift_off, free_end, friction, slips)


def grasps_along(pattern: Laid, cable: Cable, controller: str) -> Grasp:
    """Grasps while each place of a pattern is the lift-off point [units of the cable], at the near side of a jaw.

    The middle of the jaw is at the cable's length from its free end.

    Raises
    ------
    ValueError
        The cable is shorter than the pattern, or cannot bend so tightly.
    """
    lgb = cable.gravito_bending_length
    if cable.length < pattern.length:
        raise ValueError(f"the cable is {cable.length:g} m long, the pattern {pattern.length:.4g} m")
    tightest = float(np.abs(pattern.curvature).max())
    at = 1e3 * float(pattern.arc_length[np.abs(pattern.curvature).argmax()])
    if tightest * cable.radius >= 1.0:
        raise ValueError(
            f"the pattern bends to a radius of {1e3 / tightest:.2g} mm at {at:.0f} mm, tighter than the cable's own of"
            f" {1e3 * cable.radius:.2g} mm"
        )
    limit = float(table().greatest_curvature)
    if tightest * lgb > limit:
        raise ValueError(
            f"the pattern bends to a radius of {1e3 / tightest:.2g} mm at {at:.0f} mm; this cable is laid down to"
            f" {1e3 * lgb / limit:.2g} mm, its gravito-bending length over {limit:g}"
        )
    suspended = np.maximum((cable.length - 0.5 * JAW - pattern.arc_length) / lgb, table().shortest)
    curvature = -lgb * pattern.curvature  # grasps bend to the right
    if controller == "least_friction":
        return least_friction(suspended, curvature, cable.stretch_stiffness)
    return grasp(suspended, curvature, cable.stretch_stiffness)


def _floor(s: FloatArray, curvature: FloatArray, slope: FloatArray, bend: FloatArray) -> FloatArray:
    """Friction over weight along the lying cable, for the tension that makes the greatest least."""
    middle, between, ends = (0.5 * (x[1:] + x[:-1]) for x in (curvature, bend, slope))
    size = least_tension(middle, _BEND_STIFFNESS * between, _BEND_STIFFNESS * middle * ends, s[1] - s[0])
    at_nodes = np.empty(len(s))
    at_nodes[1:-1] = np.maximum(size[1:], size[:-1])
    at_nodes[[0, -1]] = size[[0, -1]]
    return at_nodes


def _slips(arc_length: FloatArray, tests: dict[str, FloatArray], friction: float) -> tuple[Slip, ...]:
    slips = []
    for test, needed in tests.items():
        fails = np.concatenate([[False], needed > friction, [False]])
        edges = np.flatnonzero(np.diff(fails.astype(int)))
        for first, after in zip(edges[::2], edges[1::2], strict=True):
            slips.append(
                Slip(float(arc_length[first]), float(arc_length[after - 1]), float(needed[first:after].max()), test)
            )
    return tuple(sorted(slips, key=lambda slip: (slip.start, slip.end)))
