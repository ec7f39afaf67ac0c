"""Simulations of plans, and the error of the laid cable."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.deprecation import renamed
from withe.common.keywords import keyword_hints
from withe.deployment.cable import Cable
from withe.deployment.motion import lengthened
from withe.deployment.pattern import distances
from withe.deployment.placing import passed
from withe.deployment.planning import LayPlan
from withe.deployment.world import ROLLING_FRICTION, Setup, lay
from withe.deployment.world import hang as hang_in_world
from withe.deployment.world import place as place_in_world
from withe.recording import Record

__all__ = ["DRAWN", "Deployment", "deploy", "drawn_setup", "hang", "place", "trial_cable"]

FloatArray = npt.NDArray[np.float64]
# Standard deviations of the errors of a trial that a planner does not know, at noise 1.
DRAWN = 10  # numbers of a trial
_LGB, _FRICTION = 0.05, 0.20  # shares
_LYING = 1.1  # [radii], greatest height of the centreline of a lying cable
_CURVATURE, _OFFSET, _TURN = 0.5, 5e-4, np.radians(0.5)  # [1/m], [m], [rad]


@dataclass(frozen=True, eq=False)
class Deployment:
    """Result of a deployment: the laid cable.

    Attributes
    ----------
    laid : ndarray of shape (nodes, 3) [m]
        Centreline of the cable from the free end, after the jaw let go.
    error, std : float [m]
        Mean and standard deviation of the distance of each point from its place on the plan's pattern
        (dissertation (9.11), whose sum under the root lacks a square).
    nearest_error, nearest_std : float [m]
        Mean and standard deviation of the distance from the nearest point of the user's pattern.
    slipped : ndarray of shape (nodes,) [m]
        Slide of each point of the pattern along the floor after it was laid. Zero beyond the pattern, and where the
        cable lies over itself.
    released : float [m]
        Greatest displacement of the pattern when the jaw let go.
    record : Record
        Record of the motion, with the rod "cable".
    passed : ndarray of bool of shape (posts,)
        True if the cable lies on the floor beside each post of the plan, on the same side as the pattern.
    """

    laid: FloatArray
    error: float
    std: float
    nearest_error: float
    nearest_std: float
    slipped: FloatArray
    released: float
    record: Record
    passed: npt.NDArray[np.bool_]


@renamed(floor="friction")
def deploy(
    plan: LayPlan,
    cable: Cable | None = None,
    *,
    friction: float,
    rolling_friction: float = ROLLING_FRICTION,
    seed: int = 0,
    noise: float = 0.0,
    nodes: int = 200,
    time_step: float | None = None,
    quasi_static: bool = False,
    progress: bool = True,
) -> Deployment:
    """Simulate a plan in the rod engine: the whole cable in space, from hanging to laid, on a floor with friction.

    The simulation takes only the motion of the jaw from the plan. The cable has thickness, weight, torsion and inertia,
    and rolls on the floor with anchored friction at its surface.

    Parameters
    ----------
    plan : LayPlan
    cable : Cable
        True cable, if it differs from the planner's. The jaw holds it at the length of the plan.
    friction : float [-]
        Coefficient of friction between cable and floor. Without any, nothing stays where it is laid.
    rolling_friction : float [-]
        Rolling friction of the floor, see `Scene.add_floor`. Without it, a straight cable that is released under
        tension, at a small angle, rolls aside by millimetres.
    seed : int
        Seed of the noise.
    noise : float [-]
        Scale of deviations that the planner does not know, drawn once per trial. With 1 the standard deviations are 5 %
        in Lgb, 20 % in friction, 0.5 / m in natural curvature, and 0.5 mm and 0.5 degrees of the jaw on each axis.
    nodes : int
        Number of nodes of the rod, 20 to 2000.
    time_step : float [s]
        Time step. By default 0.01, or 0.1 for quasi-static motion.
    quasi_static : bool
        True if the cable passes through equilibria. This is about four times as fast, and without swing.
    progress : bool
        True to show a progress bar.

    Returns
    -------
    Deployment

    Raises
    ------
    ValueError
        Friction that is not positive, negative noise or rolling friction, a cable shorter than the plan's, or a number
        of nodes out of range.

    Notes
    -----
    The simulation takes backward Euler steps with a density of 1180 kg/m^3 and a Kelvin-Voigt time of 0.02 s. The jaw
    holds 10 mm of the cable. Its pads yield by 0.5 mm/N and 20 rad/(N m), and less under heavy and stiff cables, by
    1e-4 Lgb^3 / EI and Lgb / (300 EI). A jaw that is too low therefore rests on the floor.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> line = withe.deployment.Pattern(np.stack([np.linspace(0.0, 0.1, 50), np.zeros(50)], 1))
    >>> motion = withe.deployment.plan(withe.deployment.Cable(0.3, 1.6e-3, 0.02), line, speed=0.06)
    >>> found = withe.deployment.deploy(motion, friction=0.5, nodes=30, progress=False)
    >>> print(found.error < 1e-3)
    True
    """
    _require_plan(plan)
    if cable is not None and not isinstance(cable, Cable):
        raise ValueError(f"cable must be a withe.deployment.Cable, got {cable!r:.80}")
    friction = validation.positive(friction, "friction")
    noise = validation.non_negative(noise, "noise")
    nodes = validation.integer(nodes, "nodes", 20, 2000)
    true = plan.cable if cable is None else cable
    if true.length < plan.cable.length:
        raise ValueError(
            f"the cable must be as long as planned, {plan.cable.length:g} m, or longer, got {true.length:g} m"
        )
    setup = drawn_setup(
        plan,
        true,
        friction,
        _drawn(seed, noise),
        nodes=nodes,
        time_step=_time_step(time_step, quasi_static),
        quasi_static=quasi_static,
        rolling_friction=validation.non_negative(rolling_friction, "rolling_friction"),
    )
    held, laid, record = lay(setup, plan, progress=progress)
    return _compared(plan, setup.arc_length, held, laid, record)


@renamed(floor="friction")
def place(
    plan: LayPlan,
    *,
    friction: float,
    rolling_friction: float = ROLLING_FRICTION,
    nodes: int = 200,
    time_step: float | None = None,
    quasi_static: bool = True,
    progress: bool = True,
) -> Deployment:
    """Put the cable of a plan on its pattern as if by hand, and simulate how the floor holds it.

    The cable begins as a rod without stress that lies on the pattern and its tail. Its natural curvature then becomes
    zero within a second. Both ends are free. The cable moves where friction cannot hold it. Where a pattern crosses
    itself, the cable passes through itself.

    Parameters
    ----------
    plan : LayPlan
        Plan whose cable, pattern and tail are used.
    friction, rolling_friction, nodes, time_step, quasi_static, progress
        See `deploy`.

    Returns
    -------
    Deployment
        Result in which `released` is zero, and `slipped` is the motion of the cable.

    Raises
    ------
    ValueError
        Not a plan, friction that is not positive, negative rolling friction, or a number of nodes out of range.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> angle = np.linspace(0.0, 1.2, 100)
    >>> arc = withe.deployment.Pattern(0.2 * np.stack([np.sin(angle), 1 - np.cos(angle)], 1))
    >>> motion = withe.deployment.plan(withe.deployment.Cable.dlo(2), arc)
    >>> found = withe.deployment.place(motion, friction=0.4, nodes=60, progress=False)
    >>> print(found.error < 2e-4)
    True
    """
    _require_plan(plan)
    setup = Setup(
        cable=plan.cable,
        friction=validation.positive(friction, "friction"),
        rolling_friction=validation.non_negative(rolling_friction, "rolling_friction"),
        nodes=validation.integer(nodes, "nodes", 20, 2000),
        time_step=_time_step(time_step, quasi_static),
        quasi_static=quasi_static,
    )
    path = lengthened(plan.pattern, plan.cable, plan.tail)
    s = setup.arc_length
    end = np.array([np.cos(path.heading[-1]), np.sin(path.heading[-1])])
    points = np.stack([np.interp(s, path.arc_length, path.points[:, i]) for i in range(2)], 1)
    points += np.maximum(s - path.length, 0.0)[:, None] * end
    laid, record = place_in_world(setup, points, progress=progress)
    found = _compared(plan, s, laid, laid, record)
    moved = np.where(s <= plan.pattern.length, np.linalg.norm(laid[:, :2] - points, axis=1), 0.0)
    return replace(found, slipped=moved)


def trial_cable(cable: Cable, seed: int, noise: float = 1.0) -> Cable:
    """Return the cable of a noisy trial of `deploy`, for planners that measure it beforehand.

    Parameters
    ----------
    cable : Cable
        Cable that is passed to `deploy`.
    seed, noise
        Seed and noise of the trial.

    Returns
    -------
    Cable

    Raises
    ------
    ValueError
        A negative seed or noise.

    Examples
    --------
    >>> import withe
    >>> nominal = withe.deployment.Cable.dlo(2)
    >>> true = withe.deployment.trial_cable(nominal, seed=1)
    >>> print(f"{1e3 * nominal.gravito_bending_length:.1f} {1e3 * true.gravito_bending_length:.1f} mm")
    32.0 32.6 mm
    """
    return _cable_of(cable, _drawn(seed, validation.non_negative(noise, "noise")))


@keyword_hints
def hang(cable: Cable, *, nodes: int = 200) -> FloatArray:
    """Return the shape in which a cable hangs from a jaw at its end, at rest, as a camera would see it.

    Parameters
    ----------
    cable : Cable
        Cable to hang.
    nodes : int
        Number of nodes, 20 to 2000.

    Returns
    -------
    ndarray of shape (nodes, 3) [m]
        Centreline of the cable from the free end; the jaw is upright above the origin.

    Raises
    ------
    ValueError
        A number of nodes that is not from 20 to 2000.

    Examples
    --------
    >>> import withe
    >>> bent = withe.deployment.Cable(0.87, 1.8e-3, 0.08, natural_curvature=(0.5, 0.0))
    >>> print(withe.deployment.hang(bent)[0].round(3) + 0.0)
    [0.007 0.    0.   ]
    """
    return hang_in_world(Setup(cable=cable, friction=0.0, nodes=validation.integer(nodes, "nodes", 20, 2000)))


def _require_plan(plan: object) -> None:
    if not isinstance(plan, LayPlan):
        raise ValueError(f"plan must be a withe.deployment.LayPlan, got {plan!r:.80}")


def _drawn(seed: int, noise: float) -> FloatArray:
    """Deviations of a trial, in standard deviations."""
    return noise * np.random.default_rng(validation.integer(seed, "seed", 0, 2**63 - 1)).normal(size=DRAWN)


def _cable_of(cable: Cable, drawn: FloatArray) -> Cable:
    bent = np.asarray(cable.natural_curvature) + _CURVATURE * drawn[2:4]
    longer = float(np.exp(_LGB * drawn[0]))
    return replace(
        cable,
        gravito_bending_length=cable.gravito_bending_length * longer,
        natural_curvature=(float(bent[0]), float(bent[1])),
    )


def drawn_setup(
    plan: LayPlan,
    cable: Cable,
    friction: float,
    drawn: FloatArray,
    *,
    nodes: int,
    time_step: float,
    quasi_static: bool,
    rolling_friction: float = ROLLING_FRICTION,
) -> Setup:
    """Setup of a trial from `DRAWN` numbers of standard normal distribution, times the noise."""
    return Setup(
        cable=replace(_cable_of(cable, drawn), length=plan.cable.length),
        friction=friction * float(np.exp(_FRICTION * drawn[1])),
        rolling_friction=rolling_friction,
        nodes=nodes,
        time_step=time_step,
        jaw_offset=(_OFFSET * drawn[4], _OFFSET * drawn[5], _OFFSET * drawn[6]),
        jaw_turn=(_TURN * drawn[7], _TURN * drawn[8], _TURN * drawn[9]),
        quasi_static=quasi_static,
        start_held=plan.start == "held",
        posts=plan.posts,
    )


def _time_step(given: float | None, quasi_static: bool) -> float:
    if given is None:
        return 0.1 if quasi_static else 0.01
    return validation.positive(given, "time_step")


def _compared(plan: LayPlan, s: FloatArray, held: FloatArray, laid: FloatArray, record: Record) -> Deployment:
    pattern = plan.pattern
    on = s <= pattern.length
    places = np.stack([np.interp(s[on], pattern.arc_length, pattern.points[:, i]) for i in range(2)], 1)
    away = np.linalg.norm(laid[on, :2] - places, axis=1)
    nearest = distances(laid[on, :2], pattern.raw)
    slipped = np.zeros(len(laid))
    slipped[on] = _slipped(plan, record, laid, s)[on]
    return Deployment(
        laid=laid,
        error=float(away.mean()),
        std=float(away.std()),
        nearest_error=float(nearest.mean()),
        nearest_std=float(nearest.std()),
        slipped=slipped,
        released=float(np.linalg.norm((laid - held)[on], axis=1).max()),
        record=record,
        passed=passed(plan.posts, pattern, plan.cable, laid[on]),
    )


def _slipped(plan: LayPlan, record: Record, laid: FloatArray, s: FloatArray) -> FloatArray:
    """From where each point is in the first frame from which on it lies on the floor, and behind the lift-off point."""
    frames = record.positions("cable")
    lift_off = np.interp(record.times, plan.times, plan.laid)
    above = frames[..., 2] > _LYING * plan.cable.radius
    lies = len(frames) - above[::-1].argmax(0)
    lies[~above.any(0)] = 0
    first = np.minimum(np.maximum(np.searchsorted(lift_off, s, side="right"), lies), len(frames) - 1)
    there = frames[first, np.arange(len(s)), :2]
    return np.asarray(np.linalg.norm(laid[:, :2] - there, axis=1))
