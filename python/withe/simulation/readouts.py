"""Read-outs of a simulation: small constant values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

__all__ = ["Energy", "Equilibrium", "Momentum", "Plan", "Reaction", "RodEnergy", "Statistics"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Energy:
    """Energies of a scene [J].

    Time steps account for all work. `equilibrium` and static steps do not: they add nothing to `loads` and
    `dissipated`, and no work of supports to `work`.

    Attributes
    ----------
    kinetic, stretch, bend, twist, gravity, contact, spring
    loads
        Minus the work of loads, motors of joints, tendons and custom forces since the start.
    total
        Sum of the above.
    work
        Work of supports and actuation since the start.
    dissipated
        Energy removed by viscosity, drag, dampers, fluids and contact since the start.
    """

    kinetic: float
    stretch: float
    bend: float
    twist: float
    gravity: float
    loads: float
    contact: float
    spring: float
    total: float
    work: float
    dissipated: float


@dataclass(frozen=True, eq=False)
class Momentum:
    """Linear and angular momentum of a scene, with the spin of edges and the frames of joints.

    Attributes
    ----------
    linear : ndarray of shape (3,) [kg m/s]
    angular : ndarray of shape (3,) [kg m^2/s]
        About the origin.
    """

    linear: FloatArray
    angular: FloatArray


@dataclass(frozen=True, eq=False)
class Reaction:
    """Force and moment of a support on its rod.

    Attributes
    ----------
    force : ndarray of shape (3,) [N]
    moment : ndarray of shape (3,) [N m]
        About the node.
    """

    force: FloatArray
    moment: FloatArray


@dataclass(frozen=True)
class RodEnergy:
    """Energies of one rod [J]. The energies of all rods add up to those of the scene.

    Kinetic energy and weight of a shared node are divided by the masses of the half edges at the node, and bending
    energy across a joint in equal parts. Loads, contact, work and dissipation belong to the scene; see `Energy`.

    Attributes
    ----------
    kinetic, stretch, bend, twist, gravity
    total
        Sum of the above.
    """

    kinetic: float
    stretch: float
    bend: float
    twist: float
    gravity: float
    total: float


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Result of `Simulation.equilibrium`: stability, convergence, and derivatives of the equilibrium.

    Attributes
    ----------
    stable : bool
        True if no small motion would grow. Motions out of the plane of a planar scene count too, and an unstable one
        warns with `OutOfPlaneWarning`; they do not count with planar=True, friction, custom forces or follower loads.
    stability : {"stable", "diverges", "flutters"}
        Growth of the unstable motion: steady, or oscillating, which needs follower loads. See
        `Linearisation.stability`. Friction enters by its stiffness.
    branch_changed : bool
        True if the equilibrium lies on another branch than the state before. The branch ended at a limit point, or lost
        its stability at a bifurcation, and the scene moved dynamically to another equilibrium.
    iterations : int
        Number of iterations of Newton's method.
    residual : float [N]
        Greatest residual force.
    """

    stable: bool
    stability: Literal["stable", "diverges", "flutters"]
    branch_changed: bool
    iterations: int
    residual: float
    _gradient: Callable[[npt.ArrayLike | Mapping[str, Any], Sequence[Any]], list[Any]] = field(repr=False)
    _jacobian: Callable[[Any, Sequence[Any]], list[FloatArray]] = field(repr=False)

    def gradient(self, dL_dx: npt.ArrayLike | Mapping[str, Any], wrt: Sequence[Any]) -> list[Any]:
        """Return derivatives of a scalar L of this equilibrium, by the adjoint method.

        The cost is one linear solve for any number of parameters.

        Parameters
        ----------
        dL_dx : array_like of shape (nodes, 3) [1/m], or mapping
            Derivative of L by the positions of all nodes, as `Simulation.positions()` returns them. Or a mapping from
            read-outs to derivatives, each shaped like the read-out:

            * "positions", for all nodes or for rods
            * "directors", "curvatures", "twists", "tensions" of rods
            * "reaction_forces" [1/N] and "reaction_moments" [1/(N m)] of supports and hands, as in
              `Simulation.reaction` and `Simulation.wrench`

            For example ``{"curvatures": {arm: dL_dk}, "reaction_forces": {wall: dL_dF}}``.
        wrt : sequence
            Parameters: pairs of a part and a word of `Simulation.get`, or "gravity".

            * rod: natural_curvature, natural_twist, natural_stretch, youngs_modulus, poisson_ratio, density,
              bend_stiffness and so on; "radius" [m] per edge of a withe.Circle; and "points" [m], the drawn nodes of
              shape (nodes, 3) with the joined ends of other rods
            * load: its value; mass: "mass"
            * support or hand: "position" [m] and "rotation" (rotation vector about its position [rad])
            * compliant hand: "stiffness" (six values, as in `Scene.grasp`) and "force_limit"
            * obstacle: "position" [m]

        Returns
        -------
        list
            Derivative of L by each item of `wrt`, shaped like `Simulation.get`.

        Raises
        ------
        ValueError
            The simulation has left this equilibrium. The equilibrium is not determined by the parameters (a rod that
            can spin freely, a limit point, friction, or a hand at its force limit). Contact without a given stiffness,
            a wrong shape, a parameter without a gradient, or derivatives out of the plane with planar=True.

        Notes
        -----
        With the derivative g of L by all unknowns q of the equilibrium R(q, p) = 0, the adjoint r = -K^-T g gives
        dL/dp = r^T dR/dp [Giles and Pierce 2000, 2.1]. Direct dependence of a read-out on a parameter, as of a tension
        on the stiffness, is included. Motions out of the plane of a planar scene count as in space, except with
        planar=True.

        Examples
        --------
        >>> import numpy as np
        >>> import withe
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
        >>> arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=21, radius=4e-3, material=rubber)
        >>> wall = scene.clamp(arm.start)
        >>> simulation = scene.build()
        >>> height = np.zeros((21, 3))
        >>> height[-1, 2] = 1.0  # of the tip
        >>> (by_modulus,) = simulation.equilibrium().gradient(height, wrt=[(arm, "youngs_modulus")])
        >>> bool(by_modulus > 0.0)
        True
        """
        return self._gradient(dL_dx, wrt)

    def jacobian(self, of: Any, wrt: Sequence[Any]) -> list[FloatArray]:
        """Return derivatives of positions, or of another read-out, of this equilibrium.

        Parameters
        ----------
        of : handle of a node or rod, or name; or a pair
            Node or rod whose positions are differentiated. Or a pair of a rod or support and a read-out of `gradient`,
            such as ``(arm, "curvatures")``.
        wrt : sequence
            Parameters, as in `gradient`.

        Returns
        -------
        list of ndarray of shape (3, ...) or (nodes, 3, ...)
            Derivative by each item of `wrt`: first the axes of the read-out, then those of `Simulation.get`.

        Raises
        ------
        ValueError
            See `gradient`.
        """
        return self._jacobian(of, wrt)


@dataclass(frozen=True)
class Statistics:
    """Counts and times of the work of a simulation so far.

    Attributes
    ----------
    steps, rejected_steps : int
        Accepted and rejected inner steps. A subdivided time step counts several.
    iterations, evaluations, factorizations : int
        Iterations of Newton's method, evaluations of its residual, and factorisations of its matrix.
    largest_turn : float [rad]
        Greatest turn of an edge within one inner step.
    energy_momentum_steps : int
        Inner steps of the energy-momentum rule: all steps of the default integrator and of "fourth_order".
    fourth_order_steps : int
        Fourth-order steps. Under `tolerance=` the solver takes them where they cost less than steps of second order.
    unresolved_amplitude : float [m]
        Greatest amplitude so far of vibrations whose phase the steps under `tolerance=` do not resolve. The error that
        these vibrations cause is at most twice as large.
    branch_changes : int
        Number of equilibria with `Equilibrium.branch_changed`.
    assembly_time, solve_time, fluid_time, total_time : float [s]
        Times of assembly, linear solves, Stokeslets, and in total.
    """

    steps: int
    rejected_steps: int
    iterations: int
    evaluations: int
    factorizations: int
    largest_turn: float
    energy_momentum_steps: int
    fourth_order_steps: int
    unresolved_amplitude: float
    branch_changes: int
    assembly_time: float
    solve_time: float
    fluid_time: float
    total_time: float


@dataclass(frozen=True, eq=False)
class Plan:
    """Decisions of `Scene.build` for a scene. ``print(plan)`` shows them.

    Attributes
    ----------
    planar : bool
        True if the scene is solved in a plane.
    plane_normal : ndarray of shape (3,), or None
        Normal of this plane.
    unknowns : int
        Number of unknowns.
    solver : str
        Solver of the linear equations.
    stable_step : float or None [s]
        Stable step of the explicit scheme in the drawn state.
    notes : tuple of str
        Decisions and their reasons.
    """

    planar: bool
    plane_normal: FloatArray | None
    unknowns: int
    solver: str
    stable_step: float | None
    notes: tuple[str, ...]

    def __str__(self) -> str:
        where = "3D"
        if self.plane_normal is not None:
            normal = ", ".join(f"{value + 0.0:.3g}" for value in self.plane_normal)
            where = f"planar, normal ({normal})"
        lines = [f"{where}; {self.unknowns} unknowns; solver: {self.solver}"]
        if self.stable_step is not None:
            lines.append(f"explicit steps are stable up to {self.stable_step:.3g} s")
        return "\n".join([*lines, *(f"- {note}" for note in self.notes)])
