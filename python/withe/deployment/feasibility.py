"""Friction that is needed to lay a cable along a pattern."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.deployment.cable import JAW, Cable
from withe.deployment.grasp_network import shipped
from withe.deployment.grasping import (
    Grasp,
    carrying,
    grasp,
    least_friction,
    least_stiffness,
    needed_friction,
    table,
    thickened,
)
from withe.deployment.smoothing import least_tension
from withe.errors import ConvergenceError

__all__ = ["Feasibility", "Method", "Slip", "examine"]

FloatArray = npt.NDArray[np.float64]
Method = Literal["exact", "least_friction"]
_PER_CENT = 10.0  # a larger number is probably given in per cent
_BEND_STIFFNESS = 2.0  # EI in units of w Lgb^2
_NEIGHBOURS = 4.0  # radii along a cable within which its parts are no obstacle to each other, times pi


@dataclass(frozen=True)
class Slip:
    """Part of a pattern that friction does not hold.

    Attributes
    ----------
    start, end : float [m]
        Arc lengths of both ends of the part.
    needed : float [-]
        Largest friction coefficient that the part needs.
    test : str
        Test with the largest need: "floor", "lift-off", "free end", "tail" or "overlap".
    """

    start: float
    end: float
    needed: float
    test: str

    def __str__(self) -> str:
        where = f"{1e3 * self.start:.0f} to {1e3 * self.end:.0f} mm"
        if self.test == "overlap":
            return f"{where} lies on another part of the cable, which is pushed aside"
        return f"{where} slips ({self.test}): a friction coefficient of {self.needed:.2f} is needed"


@dataclass(frozen=True, eq=False)
class Feasibility:
    """Friction coefficient that each place of a pattern needs, by three tests, and the results of two more tests.

    No test predicts rolling. The lower side of the cable is stretched where the cable bends up to the jaw, and
    contracts as the cable is laid down. This contraction uses up the friction along the cable at the lift-off point,
    and leaves a tension of up to friction times the force there. In a bend the tension pushes the cable inwards, below
    the centreline, and the laid cable rolls. A cable with a radius of 0.1 Lgb shifts by about a millimetre over a
    letter, and the stiff tail pulls this slack back.

    Attributes
    ----------
    arc_length : ndarray of shape (nodes,) [m]
    floor : ndarray of shape (nodes,)
        Need of the lying cable. Let EI be its stiffness, w its weight per length and n its tension. Per length, the
        floor applies EI kappa'' - n kappa across the cable and n' + EI kappa kappa' along it. The tension is 0 at the
        free end, and otherwise minimizes the greatest need. (Dissertation (9.2) is the first term alone.)
    lift_off : ndarray of shape (nodes,)
        Need while the place is the lift-off point: tangential over normal force of the floor. The tangential force
        carries the suspended part and the jump to the shear EI kappa' of the lying part. For a constant curvature the
        ratio is ``|Fy| / Fz``. Up to 3 Lgb of the cable behind the lift-off point help to carry a push along the cable.
    free_end : ndarray of shape (nodes,)
        Need of the part between the place and the free end. Friction times weight must turn and shear this part. With s
        the distance from the free end, this takes 2 EI kappa / (w s^2) and EI kappa' / (w s). A pattern that begins
        with curvature always slips a little.
    tail : ndarray of shape (nodes,)
        Greatest need at lift-off of all earlier places. If a bend slips inwards by c while it is laid, the cable behind
        it runs ahead by the integral of the curvature times c, because the cable does not stretch. The jaw does not
        correct for this. A long suspended part yields. A suspended part of about 2.5 Lgb or less is stiff, and pulls
        the cable behind the bend back along itself, straight or not.
    overlap : ndarray of bool of shape (nodes,)
        True where the pattern approaches itself by less than the thickness of the cable. The cable pushes itself aside
        there. The push is at most four radii, from one side of the other part to its other side. The cable keeps its
        direction at the push, and moves along (144 Lgb^3 4 radius / friction)^(1/4) on either side. This is the length
        of a beam under a friction load: EI d^4y/ds^4 = -friction w, where the slope vanishes at the push. At the other
        end the deflection y, its slope and its curvature vanish. That length slips as well.
    friction : float [-]
        Friction coefficient of the floor.
    slips : tuple of Slip
        Parts that need more friction.
    """

    arc_length: FloatArray
    floor: FloatArray
    lift_off: FloatArray
    free_end: FloatArray
    tail: FloatArray
    overlap: npt.NDArray[np.bool_]
    friction: float
    slips: tuple[Slip, ...]

    @property
    def needed(self) -> FloatArray:
        """The greatest of floor, lift-off and free end, shape (nodes,)."""
        return np.asarray(np.maximum.reduce([self.floor, self.lift_off, self.free_end]))

    @property
    def feasible(self) -> bool:
        """Return True if friction holds the cable everywhere."""
        return not self.slips

    def __str__(self) -> str:
        if self.feasible:
            return f"holds at a coefficient of friction of {self.friction:g}; {self.needed.max():.2f} is needed"
        return "\n".join(str(slip) for slip in self.slips)


class Laid(Protocol):
    """Path of a laid cable: arc lengths [m] and curvatures there [1/m]."""

    @property
    def arc_length(self) -> FloatArray: ...
    @property
    def curvature(self) -> FloatArray: ...
    @property
    def length(self) -> float: ...


class Curve(Laid, Protocol):
    """With its points, and the derivatives of curvature that forces on the floor depend on."""

    @property
    def points(self) -> FloatArray: ...
    @property
    def curvature_slope(self) -> FloatArray: ...
    @property
    def curvature_bend(self) -> FloatArray: ...


def examine(
    pattern: Curve, cable: Cable, friction: float, method: Method, force: FloatArray | None = None
) -> Feasibility:
    """Return `Pattern.feasibility`; `force`: forces of the grasps, shape (nodes, 3), if known."""
    friction = validation.positive(friction, "friction")
    if friction > _PER_CENT:
        raise ValueError(f"friction must be at most {_PER_CENT:g}, got {friction:g}: is it in per cent?")
    validation.choice(method, "method", ("exact", "least_friction"))
    if force is None:
        force = grasps_along(pattern, cable, method).force
    lgb = cable.gravito_bending_length
    s = pattern.arc_length / lgb
    curvature, slope, bend = (
        pattern.curvature * lgb,
        pattern.curvature_slope * lgb**2,
        pattern.curvature_bend * lgb**3,
    )
    floor = _floor(s, curvature, slope, bend)
    # To the left, where the pattern's curvature is positive; the frame of a grasp has y there too.
    lift_off = needed_friction(force, _BEND_STIFFNESS * slope, carrying(s, curvature))
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = 2.0 * _BEND_STIFFNESS * np.abs(curvature) / s**2
        sheared = _BEND_STIFFNESS * np.abs(slope) / s
    free_end = np.nan_to_num(np.maximum(turned, sheared), nan=0.0, posinf=np.inf)
    free_end[0] = free_end[1]
    tail = np.maximum.accumulate(np.concatenate([[0.0], lift_off[:-1]]))
    overlap = _overlap(pattern.points, pattern.arc_length, cable.radius)
    tests = {
        "floor": floor,
        "lift-off": lift_off,
        "free end": free_end,
        "tail": np.where(lift_off > friction, 0.0, tail),
        "overlap": np.where(_pushed(overlap, pattern.arc_length, cable, friction), np.inf, 0.0),
    }
    slips = _slips(pattern.arc_length, tests, friction)
    return Feasibility(pattern.arc_length, floor, lift_off, free_end, tail, overlap, friction, slips)


def grasps_along(pattern: Laid, cable: Cable, method: str) -> Grasp:
    """Grasps while each place of a pattern is the lift-off point [units of the cable], at the near side of a jaw.

    The middle of the jaw is at the cable's length from its free end.

    Raises
    ------
    ValueError
        The cable is shorter than the pattern, or cannot bend so tightly, or no floor holds it so, or it is beyond what
        the network has learned.
    """
    lgb = cable.gravito_bending_length
    if cable.length < pattern.length:
        raise ValueError(
            f"the cable must be at least as long as the pattern, {pattern.length:.4g} m, got {cable.length:g} m"
        )
    tightest, at = require_bendable(pattern, cable)
    limit = float(table().greatest_curvature)
    if tightest * lgb > limit:
        raise ValueError(
            f"the pattern bends to a radius of {1e3 / tightest:.2g} mm at {at:.0f} mm, but this cable needs at "
            f"least {1e3 * lgb / limit:.2g} mm, which is its gravito-bending length over {limit:g}"
        )
    suspended = np.maximum((cable.length - 0.5 * JAW - pattern.arc_length) / lgb, table().shortest)
    if suspended.max() > table().longest:
        raise ValueError(
            f"the cable must be at most {table().longest:g} gravito-bending lengths long, got "
            f"{suspended.max():.0f}: hold the cable nearer to its free end, or check that the gravito-bending "
            f"length of {lgb:g} m is in metres"
        )
    if np.any(cable.stretch_stiffness < least_stiffness(suspended)):
        raise ValueError(
            f"the cable would stretch by an eighth under its own weight: {lgb * suspended.max():.2g} m hang, and "
            f"the gravito-bending length, {lgb:g} m, is {lgb / cable.radius:.2g} times the radius. Hold the cable "
            "nearer to its free end, or check that both are in metres"
        )
    curvature = -lgb * pattern.curvature  # grasps bend to the right
    thick = cable.radius / lgb
    if method == "network":
        network = shipped()
        return thickened(
            lambda length, bend: network(length, bend, cable.stretch_stiffness), suspended, curvature, thick
        )
    try:
        if method == "least_friction":
            shear = _BEND_STIFFNESS * lgb**2 * np.gradient(pattern.curvature, pattern.arc_length)
            laid = pattern.arc_length / lgb
            return least_friction(suspended, curvature, shear, laid, cable.stretch_stiffness, thick)
        return grasp(suspended, curvature, cable.stretch_stiffness, radius=thick)
    except ConvergenceError as error:
        bend = f"whose bend at {at:.0f} mm has a radius of {1e3 / tightest:.2g} mm"
        raise ValueError(f"no friction is enough to keep this cable on this pattern, {bend}: {error}") from error


def require_bendable(pattern: Laid, cable: Cable) -> tuple[float, float]:
    """Refuse bends tighter than the cable is thick; the tightest curvature [1/m] and where it is [mm]."""
    sizes = np.abs(pattern.curvature)
    tightest, at = float(sizes.max()), 1e3 * float(pattern.arc_length[sizes.argmax()])
    if tightest * cable.radius >= 1.0:
        raise ValueError(
            f"the pattern bends to a radius of {1e3 / tightest:.2g} mm at {at:.0f} mm, less than the radius of "
            f"the cable, {1e3 * cable.radius:.2g} mm: draw wider bends, or increase smoothing= of the Pattern "
            "if the points are noisy"
        )
    return tightest, at


def _floor(s: FloatArray, curvature: FloatArray, slope: FloatArray, bend: FloatArray) -> FloatArray:
    """Friction over weight along the lying cable, for the tension that makes the greatest least."""
    middle, between, ends = (0.5 * (x[1:] + x[:-1]) for x in (curvature, bend, slope))
    size = least_tension(middle, _BEND_STIFFNESS * between, _BEND_STIFFNESS * middle * ends, s[1] - s[0])
    at_nodes = np.empty(len(s))
    at_nodes[1:-1] = np.maximum(size[1:], size[:-1])
    at_nodes[[0, -1]] = size[[0, -1]]
    return at_nodes


def _overlap(points: FloatArray, arc_length: FloatArray, radius: float) -> npt.NDArray[np.bool_]:
    """True where a curve approaches a part of itself that is not its neighbour to less than two radii."""
    away = np.linalg.norm(points[:, None] - points[None], axis=-1)
    far = np.abs(arc_length[:, None] - arc_length[None]) > _NEIGHBOURS * np.pi * radius
    return np.asarray(((away < 2.0 * radius) & far).any(1))


def _pushed(
    overlap: npt.NDArray[np.bool_], arc_length: FloatArray, cable: Cable, friction: float
) -> npt.NDArray[np.bool_]:
    """True for nodes that move together with the parts that overlap."""
    reach = (576.0 * cable.gravito_bending_length**3 * cable.radius / friction) ** 0.25
    return np.asarray((np.abs(arc_length[:, None] - arc_length[overlap]) <= reach).any(1))


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
