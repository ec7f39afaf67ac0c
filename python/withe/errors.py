"""Exceptions and warnings that are withe's own. Bad input is a `ValueError`, Ctrl-C a `KeyboardInterrupt`."""

from __future__ import annotations

__all__ = [
    "BranchChangedWarning",
    "CoarseMeshWarning",
    "CoarseStepWarning",
    "ConvergenceError",
    "EnergyDriftWarning",
    "OutOfPlaneWarning",
    "PlausibilityWarning",
    "RingLeftWarning",
    "RodCrossingWarning",
    "SqueezedRodWarning",
]


class BranchChangedWarning(UserWarning):
    """A step of the static integrator has left its branch of equilibria: the scene jumps within it.

    Which of other equilibria it goes to depends on the motion, that such a step does not follow. Given once a
    simulation; `statistics.branch_changes` counts them. Of `equilibrium` it is the result that says so.
    """


class CoarseMeshWarning(UserWarning):
    """Somewhere an edge turns by more than 120 degrees against the next, or twists so: the rod needs more nodes there.

    What folds over is far too stiff. Twist counts beyond the natural twist, so that a rod whose natural twist grows
    may turn as a motor does; natural twist itself where it winds natural curvature, or an uneven section, about a rod.
    Given once a simulation, at an equilibrium or within 64 steps.
    """


class CoarseStepWarning(UserWarning):
    """Time steps are too long for what moves: much of its energy swings with w dt > 1, w the angular frequency.

    Such vibrations are not resolved: midpoint steps give them other frequencies, and backward Euler damps them within a
    step or two. Says which step would do. Resistance that stops motion within a step counts too under the midpoint
    rules, whose velocities then turn round from step to step. Stiff vibrations that carry no energy do not count, nor
    what touches. Given once a simulation, within 24 steps.

    Or an impact is over within a step. Nodes that strike one after the other send waves to each other meanwhile, which
    take up most of their motion and damp out; in a step in which a rod comes down by more than the distance tolerance
    of contact, and bending goes farther than from a node to the next, all of it is sent off again, as if it were rigid.
    Given once a simulation too; not under backward Euler, nor where obstacles have a restitution below 1.
    """


class EnergyDriftWarning(UserWarning):
    """The energy of implicit midpoint steps has changed by more than 1 % of the greatest kinetic energy.

    The midpoint rule conserves energy to second order in the time step, and not where edges turn by more than about
    0.1 rad in a step. The engine compares ``energy().total - energy().work + energy().dissipated`` with its first value
    every 16 steps, and warns once a simulation. `integrator="energy_momentum"` conserves energy at any time step.
    """


class OutOfPlaneWarning(UserWarning):
    """An equilibrium of a scene that is solved in its plane is not stable against motions out of it.

    In space the scene would buckle or tip over sideways, as a deep beam does, or a truss that nothing holds there.
    ``build(planar=False)`` lets it; ``build(planar=True)`` says that something keeps it in its plane. Given once a
    simulation.
    """


class PlausibilityWarning(UserWarning):
    """A number is possible, and beyond anything that is usual: mostly of another unit than SI.

    Names the number and the likely slip. Given of

    - a rod of more than 100 m with a radius below 10 mm,
    - a density below 10 or above 30,000 kg/m^3 under gravity,
    - a Young's modulus below 100 Pa, of a rod that it cannot hold against its weight,
    - a tendon whose offset is more than 50 radii of its rod, or one that pulls along a centreline,
    - a rest angle or a roll of more than a full turn that is a multiple of 15, as angles in degrees are,
    - a time step above ten of the slowest periods of the scene, without a fluid or drag,
    - `withe.learning.Task.build` that draws random numbers without `redraw`, so that all robots are equal.

    ``warnings.simplefilter("ignore", withe.PlausibilityWarning)`` leaves them out.
    """


class RingLeftWarning(UserWarning):
    """An end of a rod has passed out of a ring that let it slide: the ring is released."""


class RodCrossingWarning(UserWarning):
    """Two rods pass through each other, as nothing said whether rods touch.

    ``scene.enable_contact()`` lets rods touch each other, ``scene.enable_contact(rods=False)`` lets them pass. The
    engine compares rods after each time step, and warns once a simulation when centrelines are nearer than half the sum
    of the contact radii. It leaves out rods that share a node, that overlap at the start, or that are in
    `Scene.ignore_contact`.
    """


class SqueezedRodWarning(UserWarning):
    """Two obstacles squeeze a rod by a stiffness of contact that is not given.

    Obstacles do not yield, and a rod has no stiffness across its section, so that only the stiffness of contact says
    how hard they press. A round section resists with about Young's modulus times the length in contact times the
    depth: half of Young's modulus times the length of an edge is that as `stiffness` of `Scene.enable_contact`. Given
    once a simulation, within 16 steps, where obstacles leave less room than the rod is thick.
    """


class ConvergenceError(RuntimeError):
    """No solution was found, not even with the smallest step. The message ends with what to try.

    The simulation is left in its last accepted state, so it can be looked at, changed and continued.

    Attributes
    ----------
    time : float [s]
        Time of that state.
    step : float [s]
        The step that was too long; 0 in an equilibrium.
    rod : str or None
        Name of the rod where the residual is greatest, if that is known.
    node : int or None
        Node of that rod.
    residual : float [N]
        Greatest force out of balance.
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
