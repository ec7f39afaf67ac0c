"""What a simulation answers: small values that do not change any more."""

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
    """Energies [J].

    Work is booked by time steps. `equilibrium` and static steps go from one balance to the next by paths of their own:
    they add nothing to `loads` and `dissipated`, and to `work` nothing of what supports do.

    Attributes
    ----------
    kinetic, stretch, bend, twist, gravity, contact, spring
    loads
        Minus the work done by loads, motors of joints, tendons and custom forces since the start.
    total
        Sum of the above.
    work
        Done by supports and actuation since the start.
    dissipated
        By viscosity, drag, dampers, fluids and contact since the start.
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
    """Momenta of everything in a scene: nodes, the mass along edges, their spin, the frames of joints.

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
    """What a support does to the rod.

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
    """Energies of one rod [J]; those of all rods sum up to what the scene has of each.

    What rods share is divided: a node's kinetic energy and weight, with any mass added there, by the masses of the
    half edges that meet at it, and bending across a joint by halves. Loads, contact, work and dissipation belong to
    the scene: see `Energy`.

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
    """How a static equilibrium was found, and how it depends on what acts.

    Attributes
    ----------
    stable : bool
        Whether no small motion would grow. A scene that is solved in a plane, as its `plan` says, stays in it, but
        motions out of it count too, with an `OutOfPlaneWarning` where one would grow; not so if it was built with
        planar=True, or under friction, custom forces and loads that turn with the rod.
    stability : {"stable", "diverges", "flutters"}
        Where one grows, whether steadily or swinging, which only loads that turn with the rod can make it do; see
        `Linearisation.stability`. Friction counts as what it does to the stiffness.
    branch_changed : bool
        Whether the equilibrium lies on another branch than the state before: the path of equilibria along which
        supports move and loads change ended on the way (at a limit point), or lost its stability (at a bifurcation);
        the scene then went on dynamically, losing energy, to what it settled in.
    iterations : int
        Of Newton's method.
    residual : float [N]
        Greatest force out of balance that is left.
    """

    stable: bool
    stability: Literal["stable", "diverges", "flutters"]
    branch_changed: bool
    iterations: int
    residual: float
    _gradient: Callable[[npt.ArrayLike | Mapping[str, Any], Sequence[Any]], list[Any]] = field(repr=False)
    _jacobian: Callable[[Any, Sequence[Any]], list[FloatArray]] = field(repr=False)

    def gradient(self, dL_dx: npt.ArrayLike | Mapping[str, Any], wrt: Sequence[Any]) -> list[Any]:
        """Derivatives of a scalar L of this equilibrium, by the adjoint method.

        One solve with the transposed stiffness, whatever the number of unknowns: with g the derivative of L by all
        unknowns q of the equilibrium R(q, p) = 0, r = -K^-T g gives dL/dp = r^T dR/dp [Giles and Pierce 2000, 2.1].

        Parameters
        ----------
        dL_dx : array_like of shape (nodes, 3) [1/m], or mapping
            Derivative of L by the positions of all nodes of the scene, as `Simulation.positions()` has them. Or words
            of read-outs with derivatives by them: "positions", so or by rods; of rods "directors", "curvatures",
            "twists", "tensions", of supports and hands "reaction_forces" [1/N] and "reaction_moments" [1/(N m)], as
            `Simulation.reaction` and `Simulation.wrench` answer, such as
            ``{"curvatures": {arm: dL_dk}, "reaction_forces": {wall: dL_dF}}``, each shaped like the read-out. A number
            that a read-out depends on directly, as a tension does on the stiffness, counts with that too.
        wrt : sequence
            Pairs of a part and a word of `Simulation.get`: of a rod natural_curvature, natural_twist, natural_stretch,
            youngs_modulus, poisson_ratio, density, bend_stiffness and so on, and "radius" [m] of a withe.Circle, one an
            edge, and "points" [m], the nodes as they were drawn, (nodes, 3), both as if the scene were built anew, the
            latter with ends of other rods that are joined there; of a load its value; of a mass "mass"; of a support or
            a hand "position" [m] and "rotation" (a rotation vector [rad], about where it is); of a hand that yields
            "stiffness", all six as `Scene.grasp` takes them, and "force_limit"; of an obstacle "position" [m]. Or
            "gravity".

        Returns
        -------
        list
            For each of `wrt`, dL over it, shaped like `Simulation.get`.

        Raises
        ------
        ValueError
            The simulation has left this equilibrium, or it follows not from what acts (a rod free to spin, a limit
            point, friction or a hand at its force limit that holds it); contact whose stiffness was not given; a wrong
            shape; something without a gradient; positions off the plane of a scene built with planar=True.

        Notes
        -----
        What leads out of the plane of a planar scene counts, as if it were built in space; with planar=True nothing
        does.

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
        """Derivatives of positions, or of another read-out, in this equilibrium.

        Parameters
        ----------
        of : handle of a node or rod, or name; or a pair
            Of a rod or support and a word of `gradient`, such as ``(arm, "curvatures")``.
        wrt : sequence
            See `gradient`.

        Returns
        -------
        list of ndarray of shape (3, ...) or (nodes, 3, ...)
            For each of `wrt`, the position of the node (or of the rod's nodes), or the read-out, over it: first the
            axes of these, then those of `Simulation.get`.

        Raises
        ------
        ValueError
            See `gradient`.
        """
        return self._jacobian(of, wrt)


@dataclass(frozen=True)
class Statistics:
    """What the work of a simulation took so far.

    Attributes
    ----------
    steps, rejected_steps : int
        Inner steps: a time step that had to be cut counts several.
    iterations, evaluations, factorizations : int
        Of Newton's method, its residual (with or without the matrix), its matrix.
    largest_turn : float [rad]
        Greatest turn of an edge within one inner step.
    energy_momentum_steps : int
        Inner steps of the energy-momentum rule: all of those of the default integrator and of "fourth_order".
    branch_changes : int
        Equilibria that lie on another branch than the state before; see `Equilibrium.branch_changed`.
    assembly_time, solve_time, fluid_time, total_time : float [s]
        Fluid: of Stokeslets, whose equations are solved once a step.
    """

    steps: int
    rejected_steps: int
    iterations: int
    evaluations: int
    factorizations: int
    largest_turn: float
    energy_momentum_steps: int
    branch_changes: int
    assembly_time: float
    solve_time: float
    fluid_time: float
    total_time: float


@dataclass(frozen=True, eq=False)
class Plan:
    """What was decided for a scene. `print(plan)` says it in a few lines.

    Attributes
    ----------
    planar : bool
    plane_normal : ndarray of shape (3,), or None
    unknowns : int
    solver : str
        Of the linear equations.
    stable_step : float or None
        Of the explicit scheme, as drawn [s].
    notes : tuple of str
        What is left out or was decided, and why.
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
