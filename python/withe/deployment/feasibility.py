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
_PER_CENT = 10.0  # what is more has been given so
_BEND_STIFFNESS = 2.0  # EI in units of w Lgb^2
_NEIGHBOURS = 4.0  # radii along a cable within which its parts are no obstacle to each other, times pi


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
        What fails first there: "floor", "lift-off", "free end", "tail" or "overlap".
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
    """The coefficient of friction that each place of a pattern needs, by three tests, and what two more say.

    None of them says how a cable rolls. Its lower side, stretched where it bends up to the jaw, contracts as it is laid
    down: friction along it is used up at the lift-off point, however little is needed, and leaves a tension of up to
    friction times the force there. In a bend that pushes to the inside, below the centreline, and what lies rolls. Of
    a cable whose radius is a tenth of Lgb a millimetre comes together over a letter, which the stiff tail pulls back.

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
        curvature is constant that is |Fy| / Fz. A push along the cable is taken up by up to 3 Lgb of what lies behind
        too.
    free_end : ndarray of shape (nodes,)
        Between it and the free end at most friction times weight can turn and shear the cable: it needs
        2 EI kappa / (w s^2) and EI kappa' / (w s), s the way from the free end. A pattern that begins with curvature
        always slips a little.
    tail : ndarray of shape (nodes,)
        The greatest need at lift-off of all places before. Where a bend slips inwards by c while it is laid, what is
        laid behind it runs ahead by the integral of the curvature times c, for the cable does not stretch. The jaw
        knows nothing of that. As long as much hangs, this gives; the stiff rest, from some 2.5 Lgb on, pulls
        all that lies behind the bend back along itself, straight or not.
    overlap : ndarray of bool of shape (nodes,)
        Where the pattern comes nearer to itself than the cable is thick: it cannot lie there, and pushes itself aside.
        Pushed by at most four radii, from one side of itself to the other, it keeps its direction there, and moves
        along (144 Lgb^3 4 radius / friction)^(1/4) to either side, as a beam does that friction loads: its deflection y
        has EI d^4y/ds^4 = -friction w, with y, its slope and its curvature 0 where it begins to move, and the slope 0
        where it is pushed. That much more slips.
    friction : float
        What there is.
    slips : tuple of Slip
        Stretches that need more.
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
    """Where a curve comes nearer to a part of itself than two radii, which is not its neighbour."""
    away = np.linalg.norm(points[:, None] - points[None], axis=-1)
    far = np.abs(arc_length[:, None] - arc_length[None]) > _NEIGHBOURS * np.pi * radius
    return np.asarray(((away < 2.0 * radius) & far).any(1))


def _pushed(
    overlap: npt.NDArray[np.bool_], arc_length: FloatArray, cable: Cable, friction: float
) -> npt.NDArray[np.bool_]:
    """What moves with the stretches that overlap."""
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
