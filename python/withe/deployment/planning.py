"""Motions of a gripper that lay a cable along a pattern."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Literal, get_args

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.deprecation import old_word, renamed
from withe.common.progress import progress as bar
from withe.common.user_warnings import warn
from withe.deployment.cable import JAW, Cable
from withe.deployment.drawing import draw_plan
from withe.deployment.feasibility import Feasibility, Method, Slip, examine, grasps_along, require_bendable
from withe.deployment.grasping import Grasp, table
from withe.deployment.motion import Course, Path, Phase, Start, course, lengthened, upright_way, way_along
from withe.deployment.optimising import optimised, runs
from withe.deployment.pattern import Pattern
from withe.deployment.pattern import crossings as crossings_of
from withe.deployment.placing import require_room
from withe.deployment.plan_files import KIND, VERSION, parts_of
from withe.deployment.posts import Post
from withe.io import PlanFile, listed

__all__ = ["LayPlan", "PlanMethod", "plan"]

FloatArray = npt.NDArray[np.float64]
PlanMethod = Literal["exact", "least_friction", "optimised", "network", "intuitive"]
_TAIL_SHARES = (1.0, 0.5, 0.5, 0.5)  # length relative to the previous one, if a tail crosses
_TAIL = 4.0  # [Lgb], preferred length of cable beyond the pattern: shorter ends need much friction
_OPTIMISING_SPEED, _OPTIMISING_STEP = 0.025, 0.04  # [m/s], [s]: of quasi-static runs, where only the way counts
_MUCH_LONGER = 50.0  # length of a pattern relative to its cable; above it, the pattern is in millimetres
_MOST_FRICTION = 3.0  # no floor has more


@dataclass(frozen=True, eq=False)
class LayPlan(PlanFile):
    """The path of a jaw that lays a cable; at its end the jaw opens. The floor is the plane z = 0.

    Attributes
    ----------
    times : ndarray of shape (n,) [s]
        Times of the poses.
    positions : ndarray of shape (n, 3) [m]
        Positions of the cable's centreline in the middle of the jaw, which holds 10 mm of the cable.
    rotations : ndarray of shape (n, 4)
        Quaternions (x, y, z, w) of the jaw. The first axis of the jaw is the cable's tangent, away from the free end.
        At the lift-off point of a straight cable that lies along x, the axes would be x, y, z.
    laid : ndarray of shape (n,) [m]
        Arc length of the lift-off point; zero before laying.
    phases : tuple of Phase
    cable : Cable
        Cable from its free end to the middle of the jaw.
    pattern : Pattern
    tail : float [m]
        Length of the cable beyond the pattern.
    method : str
    start : str
        "free", or "held" if the free end may slide only vertically.
    speed : float [m/s]
        Speed of the lift-off point along the pattern, if the pattern is long enough to reach it.
    fastest : float [m/s]
        Speed at which the acceleration of the jaw while laying reaches a hundredth of gravity. At a higher speed the
        cable swings, and the swing, not friction, soon determines the error.
    needed_friction : ndarray of shape (pattern's nodes,)
        Friction coefficient that each place of the pattern needs. NaN for "intuitive" and "network", which do not
        compute forces (`feasibility` does). An "optimised" plan has the values of its initial plan, and compensates the
        slips of that plan.
    posts : tuple of Post
        Posts between which the cable is laid.
    """

    times: FloatArray
    positions: FloatArray
    rotations: FloatArray
    laid: FloatArray
    phases: tuple[Phase, ...]
    cable: Cable
    pattern: Pattern
    tail: float
    method: str
    start: str
    speed: float
    fastest: float
    needed_friction: FloatArray
    posts: tuple[Post, ...] = ()

    KIND: ClassVar[str] = KIND
    VERSION: ClassVar[int] = VERSION
    _parts_of = staticmethod(parts_of)

    @property
    def _saved_poses(self) -> FloatArray:
        return np.column_stack([self.positions, self.rotations])

    @property
    def controller(self) -> str:
        """Deprecated name of `method`."""
        old_word("LayPlan.controller", "LayPlan.method")
        return self.method

    def feasibility(self, friction: float) -> Feasibility:
        """Predict where friction holds the cable and where it slips; see `Pattern.feasibility`.

        Parameters
        ----------
        friction : float [-]
            Friction coefficient between cable and floor.

        Returns
        -------
        Feasibility

        Raises
        ------
        ValueError
            Friction that is negative or above 10.
        """
        return examine(
            self.pattern,
            self.cable,
            friction,
            "least_friction" if self.method in ("least_friction", "optimised") else "exact",
        )

    def plot(self, friction: float) -> Any:
        """Draw the pattern coloured by the friction that it needs, the path of the jaw, and each test along the cable.

        Parameters
        ----------
        friction : float [-]
            Available friction coefficient. Parts that need more are shaded.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ValueError
            Friction that is negative or above 10.
        ImportError
            matplotlib is not installed.
        """
        title = f"{self.method}, {1e3 * self.speed:.0f} mm/s"
        return draw_plan(self.pattern, self.positions, self.feasibility(friction), title)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as lists, for JSON. SI units.

        Returns
        -------
        dict
            All fields by name.
        """
        return {
            "controller": self.method,
            "start": self.start,
            "speed": self.speed,
            "fastest": self.fastest,
            "phases": [{"name": phase.name, "start": phase.start, "end": phase.end} for phase in self.phases],
            "cable": {
                "length": self.cable.length,
                "radius": self.cable.radius,
                "gravito_bending_length": self.cable.gravito_bending_length,
                "natural_curvature": list(self.cable.natural_curvature),
                "tail": self.tail,
            },
            "pattern": {
                **self.pattern.to_dict(),
                "needed_friction": listed(self.needed_friction),
            },
            "posts": [asdict(post) for post in self.posts],
            "motion": {
                "t": self.times.tolist(),
                "laid": self.laid.tolist(),
                "position": self.positions.tolist(),
                "quaternion_xyzw": self.rotations.tolist(),
            },
        }

    def __repr__(self) -> str:
        return f"LayPlan({self.method}, {self.pattern.length:.3f} m in {self.times[-1]:.1f} s)"


@renamed(controller="method", time_step="sampling_interval")
def plan(
    cable: Cable,
    pattern: Pattern,
    method: PlanMethod = "exact",
    *,
    friction: float | None = None,
    speed: float = 0.025,
    tail: float | None = None,
    start: Start = "free",
    crossings: Literal["refuse", "over"] = "refuse",
    posts: Sequence[Post] = (),
    sampling_interval: float = 0.02,
    progress: bool = True,
) -> LayPlan:
    """Plan the whole motion of a gripper that lays a cable along a pattern: hang, touch down, lay, release.

    First, the cable hangs with its free end above the start of the pattern, is lowered, and pivots on its end until it
    lies on the floor. Then the jaw follows the poses of `grasp` for each lift-off point of the pattern (Choi,
    dissertation, Alg. 12). Behind the pattern the cable is laid straight on until the jaw releases it.

    Parameters
    ----------
    cable : Cable
        Cable to lay.
    pattern : Pattern
        Curve on the floor.
    method : {"exact", "least_friction", "optimised", "network", "intuitive"}
        * "exact": no force along the cable at the lift-off point.
        * "least_friction": the push along the cable that needs the least friction.
        * "optimised": the better of these, on a path that is shifted until the cable lies on its pattern in the rod
          engine (about 40 quasi-static runs).
        * "network": "exact" for thin cables from a small network, without friction. Needs torch.
        * "intuitive": the jaw upright above the lift-off point, at the height of the suspended length; the baseline of
          the dissertation (figure 9.2).
    friction : float [-]
        Friction coefficient between cable and floor. Needed by "optimised"; "exact" and "least_friction" warn where it
        is too low.
    speed : float [m/s]
        Speed of the lift-off point.
    tail : float [m]
        Length of cable beyond the pattern: the middle of the jaw is at pattern.length + tail from the free end. By
        default 4 Lgb, or less if the cable is shorter or the tail would cross the pattern.
    start : {"free", "held"}
        Free end of the cable: "free" stands on the floor. "held" may slide vertically only and does not roll, until the
        jaw opens.
    crossings : {"refuse", "over"}
        "over" allows crossings of pattern and tail, without the thickness of the cable.
    posts : sequence of Post
        Posts between which the cable is laid. Posts help to hold the cable, so the needed friction may be high.
    sampling_interval : float [s]
        Interval between the rows of the plan.
    progress : bool
        True to show a progress bar with "optimised".

    Returns
    -------
    LayPlan

    Raises
    ------
    ValueError
        The cable is shorter than pattern and tail, or the pattern bends too tightly. Pattern or tail cross, a post is
        too close, or no friction is enough. A speed, tail, time step or friction is not positive. The method
        is "optimised" without friction, or "network" outside of its range.
    ConvergenceError
        No grasp was found for a part of the pattern.

    Warns
    -----
    UserWarning
        The pattern needs more than the given friction, without posts or "optimised".

    Notes
    -----
    While the cable pivots, no force acts along the floor. A round end rolls by its radius times the angle, so it stands
    that much before its place.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> x = np.linspace(0.0, 0.5, 101)
    >>> wave = withe.deployment.Pattern(np.stack([x, 0.03 * np.sin(4 * np.pi * x)], 1))
    >>> motion = withe.deployment.plan(withe.deployment.Cable.dlo(2), wave)
    >>> print([phase.name for phase in motion.phases], f"{motion.needed_friction.max():.1f}")
    ['hang', 'touch down', 'lay'] 0.1
    """
    validation.choice(method, "method", get_args(PlanMethod))
    speed = validation.positive(speed, "speed")
    sampling_interval = validation.positive(sampling_interval, "sampling_interval")
    validation.choice(crossings, "crossings", ("refuse", "over"))
    validation.choice(start, "start", get_args(Start))
    for given, name, kind in ((cable, "cable", Cable), (pattern, "pattern", Pattern)):
        if not isinstance(given, kind):
            raise ValueError(f"{name} must be a withe.deployment.{kind.__name__}, got {type(given).__name__}")
    friction = None if friction is None else validation.positive(friction, "friction")
    require_bendable(pattern, cable)
    require_room(posts, pattern, cable)
    if crossings == "refuse":
        held, tail, path = _uncrossed(pattern, cable, tail)
    else:
        held, tail = _held(cable, pattern, tail)
        path = lengthened(pattern, held, tail)
    unknown = np.full(len(pattern.points), np.nan)
    if method == "intuitive":
        needed, way = unknown, upright_way(held, path)
    elif method == "network":
        needed, way = unknown, way_along(held, path, grasps_along(path, held, method))
    elif method == "optimised":
        if friction is None:
            raise ValueError("method 'optimised' needs friction, the floor's coefficient")
        path, followed = _improved(held, pattern, path, friction, start, progress)
        needed = _needed(pattern, held, followed, grasps_along(pattern, held, followed), bool(posts))
        way = way_along(held, path, grasps_along(path, held, followed))
    else:
        grasps = grasps_along(path, held, method)
        needed, way = _needed(pattern, held, method, grasps, bool(posts)), way_along(held, path, grasps)
        if friction is not None and not posts and needed.max() > friction:
            warn(_slips(pattern, needed, friction), cause="slips")
    motion = course(held, path, way, speed, sampling_interval, start)
    return LayPlan(
        times=motion.times,
        positions=motion.positions,
        rotations=motion.rotations,
        laid=np.minimum(motion.laid, pattern.length),
        phases=motion.phases,
        cable=held,
        pattern=pattern,
        tail=tail,
        method=method,
        start=start,
        speed=speed,
        fastest=way.fastest(),
        needed_friction=needed,
        posts=tuple(posts),
    )


def _improved(
    cable: Cable, pattern: Pattern, path: Path, friction: float, start: Start, progress: bool
) -> tuple[Path, Method]:
    """The path that lays best in the engine, and which method goes along it."""

    def motion_of(tried: Path, method: Method) -> Course:
        way = way_along(cable, tried, grasps_along(tried, cable, method))
        return course(cable, tried, way, _OPTIMISING_SPEED, _OPTIMISING_STEP, start)

    with bar(runs(path, cable, pattern), "optimising", progress, unit="runs") as shown:
        return optimised(path, cable, pattern, friction, motion_of, start, shown)


def _needed(pattern: Pattern, cable: Cable, method: Method, grasps: Grasp, helped: bool) -> FloatArray:
    """Return the friction that each place of the pattern needs. Unless `helped`, refuse impossible friction."""
    count = len(pattern.points)
    force = np.concatenate([grasps.force, np.repeat(grasps.force[-1:], count, axis=0)])[:count]
    found = examine(pattern, cable, _MOST_FRICTION, method, force)
    worst = _worst_slip(found)
    if worst is not None and not helped:
        missing = _missing_tail(pattern, cable, method, worst)
        raise ValueError(f"no friction is enough to keep this cable on this pattern: {worst}{missing}")
    return found.needed


def _slips(pattern: Pattern, needed: FloatArray, friction: float) -> str:
    """Describe the share of a pattern that needs more friction, and the place that needs most."""
    share, most = 100.0 * float((needed > friction).mean()), int(needed.argmax())
    where = f"{needed[most]:.2f} at {1e3 * pattern.arc_length[most]:.0f} mm"
    return f"the cable slips: {share:.0f} % of the pattern needs more than friction {friction:g}, up to {where}"


def _worst_slip(found: Feasibility) -> Slip | None:
    """Return the stretch with the greatest needed friction, among stretches that no floor holds."""
    slips = [slip for slip in found.slips if slip.test in ("floor", "lift-off")]
    return max(slips, key=lambda slip: slip.needed, default=None)


def _missing_tail(pattern: Pattern, cable: Cable, method: Method, worst: Slip) -> str:
    """Describe the effect of a tail of the usual length, if friction would then be enough."""
    lgb = cable.gravito_bending_length
    usual, there = _TAIL * lgb, cable.length - pattern.length
    longer = replace(cable, length=pattern.length + usual)
    if there >= usual or longer.length > table().longest * lgb:
        return ""
    found = examine(pattern, longer, _MOST_FRICTION, method)
    if _worst_slip(found) is not None:
        return ""
    stretch = (found.arc_length >= worst.start) & (found.arc_length <= worst.end)
    return (
        f". The tail is too short: with {1e3 * usual:.0f} mm of cable beyond the pattern instead of "
        f"{1e3 * there:.0f} mm, a coefficient of {found.needed[stretch].max():.2f} is enough. Give a longer "
        "tail or cable, or use crossings='over', which lets the tail cross the pattern"
    )


def _held(cable: Cable, pattern: Pattern, tail: float | None) -> tuple[Cable, float]:
    """The cable up to the middle of the jaw, and how much of it lies beyond the pattern."""
    room = cable.length - 0.5 * JAW - pattern.length
    if room < 0.0:
        hint = f": the jaw holds {1e3 * JAW:g} mm of the cable"
        if pattern.length > _MUCH_LONGER * cable.length:
            hint = ": is the pattern in metres?"
        raise ValueError(
            f"the cable must be longer than the pattern, {pattern.length:.4g} m, got {cable.length:g} m{hint}"
        )
    if tail is None:
        tail = min(room, _TAIL * cable.gravito_bending_length)
    tail = validation.non_negative(tail, "tail")
    if tail > room:
        both = f"pattern and tail, {pattern.length + tail:.4g} m, plus {1e3 * JAW:g} mm in the jaw"
        raise ValueError(f"the cable must be longer than {both}, got {cable.length:g} m")
    return replace(cable, length=pattern.length + tail), tail


def _uncrossed(pattern: Pattern, cable: Cable, tail: float | None) -> tuple[Cable, float, Path]:
    """Return the longest of a few tails that does not cross the pattern or itself, or the requested tail."""
    if len(pattern.crossings):
        first, second = 1e3 * pattern.crossings[0]
        where = f"but does at {first:.0f} and {second:.0f} mm"
        raise ValueError(f"the pattern must not cross itself, {where}: use crossings='over' to allow crossings")
    held, given = _held(cable, pattern, tail)
    shares = (1.0,) if tail is not None else _TAIL_SHARES
    for share in shares:
        held, given = _held(cable, pattern, share * given)
        path = lengthened(pattern, held, given)
        found = crossings_of(path.points, path.arc_length)
        if not len(found):
            return held, given, path
    first, second = 1e3 * found[0]
    where = f"but {second:.0f} mm from the free end it crosses the cable at {first:.0f} mm"
    raise ValueError(f"the tail must not cross the pattern, {where}: give a shorter tail, or use crossings='over'")
