"""Exceptions and warnings that are withe's own. Bad input is a `ValueError`, Ctrl-C a `KeyboardInterrupt`."""

from __future__ import annotations

__all__ = [
    "BranchChangedWarning",
    "CoarseMeshWarning",
    "CoarseStepWarning",
    "ConvergenceError",
    "EnergyDriftWarning",
    "LostCableWarning",
    "OutOfPlaneWarning",
    "PlausibilityWarning",
    "PoorMaskWarning",
    "RingLeftWarning",
    "RodCrossingWarning",
    "SqueezedRodWarning",
    "UnsupportedRobotWarning",
]


class BranchChangedWarning(UserWarning):
    """Warn that a step of the static integrator left its branch of equilibria: the scene jumps within the step.

    The equilibrium after a jump depends on the motion, which a static step does not resolve. The warning is given once
    per simulation; `statistics.branch_changes` counts all changes. `equilibrium` sets `branch_changed` of its result
    instead.
    """


class CoarseMeshWarning(UserWarning):
    """Warn that an edge turns or twists by more than 120 degrees against the next: the rod needs more nodes there.

    Folded edges are much too stiff. Twist counts relative to the natural twist, so that a growing natural twist may
    turn a rod like a motor. Natural twist itself counts if it winds natural curvature, or an uneven section, about the
    rod. The warning is given once per simulation, at an equilibrium or within 64 steps.
    """


class CoarseStepWarning(UserWarning):
    """Warn that the time step is too long for a motion or an impact, and name a time step that is short enough.

    Motion: much of the energy vibrates at angular frequencies w with w dt > 1. Midpoint steps change the frequency of
    such vibrations, and backward Euler damps them within one or two steps. With the midpoint rules, resistance that
    stops a motion within a step counts too. Vibrations without energy and contacts do not count. The warning is given
    once per simulation, within 24 steps.

    Impact: in a real impact the nodes of a rod strike one after the other, and bending waves take up most of the
    motion. In a step that is longer than the impact, the whole rod rebounds as if it were rigid. The warning is given
    once per simulation, but not with backward Euler or a restitution below 1.
    """


class EnergyDriftWarning(UserWarning):
    """Warn that implicit midpoint steps changed the energy by more than 1 % of the greatest kinetic energy.

    The midpoint rule conserves energy to second order in the time step, while edges turn by less than about 0.1 rad in
    a step. The engine compares ``energy().total - energy().work + energy().dissipated`` with its first value
    every 16 steps, and warns once per simulation. `integrator="energy_momentum"` conserves energy at any time step.
    """


class LostCableWarning(UserWarning):
    """Warn that a frame of a film shows no cable, so a tracker keeps its last state.

    `withe.perception.Tracker.seen` is False for each such frame. The warning is given once per tracker. Check the mask:
    the argument `mask` of `Tracker` takes a filter, and `update(mask=...)` an array.
    """


class OutOfPlaneWarning(UserWarning):
    """Warn that the equilibrium of a planar scene is not stable against motions out of its plane.

    In space the scene would buckle or tip over sideways, as a deep beam or an unsupported truss does. Use
    ``build(planar=False)`` to allow this motion, or ``build(planar=True)`` if a guide keeps the scene in its plane. The
    warning is given once per simulation.
    """


class PlausibilityWarning(UserWarning):
    """Warn that a number is far outside of the usual range, mostly because its unit is not SI.

    The message names the number and the likely mistake. The warning is given for

    - a rod of more than 100 m with a radius below 10 mm,
    - a density below 10 or above 30,000 kg/m^3 under gravity,
    - a Young's modulus below 100 Pa, if the rod cannot carry its weight,
    - a rod that is thicker than long and joined to no other rod,
    - a tendon whose offset is zero or more than 50 radii of its rod,
    - a tendon whose offset is more than 8 radii of its rod and more than a quarter of the length of its rods,
    - a rest angle or roll above a full turn that is a multiple of 15, as angles in degrees are,
    - a robot from a file that is larger than 20 m, or has a body above 10,000 kg,
    - a body that is a cylinder, and so touches nothing, in a scene with obstacles or other bodies that touch,
    - a time step above ten of the slowest periods of the scene, without a fluid or drag,
    - a `withe.learning.Task.build` that draws random numbers without `redraw`, so that all robots are equal.

    ``warnings.simplefilter("ignore", withe.PlausibilityWarning)`` disables the warning.
    """


class PoorMaskWarning(UserWarning):
    """The mask of a picture does not look like cables, so the tracing is probably wrong.

    The message names what is unlike cables: the share of the picture, parts without a cable, many short pieces, or very
    different widths. For the default filter it also names a blurred picture, a ground that varies as much as the
    cables, or lines as straight as seams. Give `mask=` to `withe.perception.trace`: a filter by colour
    (`color_filter`), a network (`network_mask`), or an array. `Tracing.mask_quality` has the numbers.
    """


class RingLeftWarning(UserWarning):
    """Warn that the end of a rod passed through a ring, and that the ring was released."""


class RodCrossingWarning(UserWarning):
    """Warn that two rods pass through each other because contact between rods was not enabled.

    ``scene.enable_contact()`` enables contact between rods; ``scene.enable_contact(rods=False)`` allows rods to pass
    through each other. The engine checks rods after each time step, and warns once per simulation when the distance of
    centrelines is below half the sum of the contact radii. Rods that share a node, that overlap at the start, or that
    are named in `Scene.ignore_contact` are not checked.
    """


class SqueezedRodWarning(UserWarning):
    """Warn that two obstacles squeeze a rod, but no contact stiffness was given.

    Obstacles are rigid, and rods have no stiffness across their section, so the contact stiffness alone determines the
    force. A round section resists with about Young's modulus times the length in contact times the penetration. This
    corresponds to ``Scene.enable_contact(stiffness=)`` with half of Young's modulus times the length of an edge. The
    warning is given once per simulation, within 16 steps, if the gap of the obstacles is smaller than the rod.
    """


class UnsupportedRobotWarning(UserWarning):
    """Warn that the file of a robot has content that a scene lacks, such as limits of joints or actuators.

    `Scene.add_robot` adds the bodies and joints without this content. The message lists the content with the names in
    the file. The warning is given once per call.
    """


class ConvergenceError(RuntimeError):
    """Report that no solution was found, even with the smallest step. The message ends with a remedy.

    The simulation keeps its last accepted state, so it can be read, changed and continued.

    Parameters
    ----------
    message : str
        Text of the error.

    Attributes
    ----------
    time : float [s]
        Time of the last accepted state.
    step : float [s]
        Size of the step that did not converge; 0 for an equilibrium.
    rod : str or None
        Name of the rod with the greatest residual, if known.
    node : int or None
        Node with the greatest residual, if known.
    residual : float [N]
        Greatest residual force.
    """

    def __init__(
        self,
        message: str,
        time: float = 0.0,
        step: float = 0.0,
        rod: str | None = None,
        node: int | None = None,
        residual: float = float("nan"),
    ) -> None:
        # All of it goes to args, so that the exception pickles.
        super().__init__(message, time, step, rod, node, residual)
        self.time = time
        self.step = step
        self.rod = rod
        self.node = node
        self.residual = residual

    def __str__(self) -> str:
        return str(self.args[0])
