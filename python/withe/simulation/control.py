"""Control of a running simulation: natural shapes, parameters, loads."""

from __future__ import annotations

from typing import Any, Literal, Unpack, overload

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.deprecation import old_word
from withe.common.keywords import keyword_hints
from withe.parts.applied_loads import Value
from withe.parts.friction import Friction
from withe.parts.handles import (
    CustomForce,
    Drag,
    Fluid,
    Joint,
    Load,
    Mass,
    Obstacle,
    Rod,
    Spring,
    Support,
    Tendon,
)
from withe.parts.torsion_springs import TorsionSpring
from withe.simulation.functions import check_jacobian
from withe.simulation.loads import remove_load
from withe.simulation.motion import RotationLike
from withe.simulation.parameters import Settable, get_value, set_values
from withe.simulation.session import Session
from withe.simulation.typed_words import (
    DragWord,
    DragWords,
    FluidNumber,
    FluidWords,
    JointWord,
    JointWords,
    LoadVector,
    LoadWords,
    MassWord,
    MassWords,
    MaterialWord,
    Number,
    ObstacleNumber,
    ObstacleVector,
    ObstacleWords,
    PairNumber,
    PairWords,
    RodArray,
    RodWords,
    SceneNumber,
    SceneWords,
    SpringWord,
    SpringWords,
    SupportVector,
    SupportWords,
    TendonWord,
    TendonWords,
    TorsionWord,
    TorsionWords,
    Toucher,
)

__all__ = ["Control"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
class Control:
    """Methods of `Simulation` that actuate and set parameters. They call functions of the session."""

    _session: Session

    # Natural shape

    def set_natural_curvature(
        self, rod: Rod | str, curvature: npt.ArrayLike, over: float = 0.0, *, discrete: bool = False
    ) -> None:
        """Deprecated: use ``set(rod, natural_curvature=..., over=...)``, or discrete_curvature.

        Parameters
        ----------
        rod : Rod or str
            Rod to actuate.
        curvature : array_like of shape (2,) or (stencils, 2) [1/m]
            Natural curvature towards d1 and d2: one pair for the whole rod, or one per stencil.
        over : float [s]
            Duration of a linear ramp to the value. By default the change is immediate.
        discrete : bool
            True if the curvature is given as 2 tan(phi / 2) [-], with phi the angle between two edges.

        Raises
        ------
        ValueError
            Not a rod of this scene, a wrong shape, or a value that is not finite.

        See Also
        --------
        set : The method to use instead.
        """
        word = "discrete_curvature" if validation.truth(discrete, "discrete") else "natural_curvature"
        _set_rod(self._session, "set_natural_curvature", rod, word, curvature, over)

    def set_natural_twist(self, rod: Rod | str, twist: npt.ArrayLike, over: float = 0.0) -> None:
        """Deprecated: use ``set(rod, natural_twist=..., over=...)``.

        Parameters
        ----------
        rod : Rod or str
            Rod to actuate.
        twist : float or array_like of shape (stencils,) [rad/m]
            Natural twist: one value for the whole rod, or one per stencil.
        over : float [s]
            Duration of a linear ramp to the value. By default the change is immediate.

        Raises
        ------
        ValueError
            Not a rod of this scene, a wrong shape, or a value that is not finite.

        See Also
        --------
        set : The method to use instead.
        """
        _set_rod(self._session, "set_natural_twist", rod, "natural_twist", twist, over)

    def set_natural_stretch(self, rod: Rod | str, stretch: npt.ArrayLike, over: float = 0.0) -> None:
        """Deprecated: use ``set(rod, natural_stretch=..., over=...)``.

        Parameters
        ----------
        rod : Rod or str
            Rod to actuate.
        stretch : float or array_like of shape (edges,) [-]
            Natural length over drawn length.
        over : float [s]
            Duration of a linear ramp to the value. By default the change is immediate.

        Raises
        ------
        ValueError
            Not a rod of this scene, a wrong shape, or a value that is not positive.

        See Also
        --------
        set : The method to use instead.
        """
        _set_rod(self._session, "set_natural_stretch", rod, "natural_stretch", stretch, over)

    # Parameters

    @overload
    def set(self, target: Rod, /, *, over: float = 0.0, **values: Unpack[RodWords]) -> None: ...

    @overload
    def set(self, target: Load, /, *, over: float = 0.0, **values: Unpack[LoadWords[Value]]) -> None: ...

    @overload
    def set(self, target: Mass, /, *, over: float = 0.0, **values: Unpack[MassWords[Number]]) -> None: ...

    @overload
    def set(self, target: Spring, /, *, over: float = 0.0, **values: Unpack[SpringWords[Number]]) -> None: ...

    @overload
    def set(self, target: Tendon, /, *, over: float = 0.0, **values: Unpack[TendonWords[Number]]) -> None: ...

    @overload
    def set(self, target: Joint, /, *, over: float = 0.0, **values: Unpack[JointWords[Number]]) -> None: ...

    @overload
    def set(self, target: TorsionSpring, /, *, over: float = 0.0, **values: Unpack[TorsionWords[Number]]) -> None: ...

    @overload
    def set(self, target: Drag, /, *, over: float = 0.0, **values: Unpack[DragWords[Number]]) -> None: ...

    @overload
    def set(self, target: Fluid, /, *, over: float = 0.0, **values: Unpack[FluidWords[Number]]) -> None: ...

    @overload
    def set(
        self, target: Obstacle, /, *, over: float = 0.0, **values: Unpack[ObstacleWords[Number, Friction]]
    ) -> None: ...

    @overload
    def set(
        self, target: Support, /, *, over: float = 0.0, **values: Unpack[SupportWords[Number, RotationLike]]
    ) -> None: ...

    @overload
    def set(
        self, target: tuple[Toucher, Toucher], /, *, over: float = 0.0, **values: Unpack[PairWords[Number, Friction]]
    ) -> None: ...

    @overload
    def set(self, target: None = None, /, *, over: float = 0.0, **values: Unpack[SceneWords[Number]]) -> None: ...

    @overload
    def set(self, target: str, /, *, over: float = 0.0, **values: Any) -> None: ...

    def set(self, target: Settable | str | None = None, /, *, over: float = 0.0, **values: Any) -> None:
        """Set parameters of a part or of the scene.

        Parameters
        ----------
        target : handle or str
            Part to change. None for the scene; a pair such as ``(arm, floor)`` for the contact of two bodies.
        over : float [s]
            Duration of a linear ramp to the values, of natural shapes, of parameters of springs, torsion springs,
            tendons and revolute joints, and of poses of supports. By default the change is immediate.
        **values
            Parameters of the target:

            * rod: youngs_modulus, poisson_ratio, density, viscosity, stretch_stiffness, bend_stiffness,
              twist_stiffness, line_density, viscous_time, drag (one number, or one per edge)
            * rod: natural_curvature towards d1 and d2, (2,) or (stencils, 2) [1/m], or discrete_curvature, the same
              curvature as 2 tan(phi / 2) [-] with phi the angle between two edges
            * rod: natural_twist, one or (stencils,) [rad/m]
            * rod: natural_stretch s, one or (edges,) [-]. The tension is EA (l / L - s) with the drawn length L of an
              edge [Antman 2005, chapter 8].
            * load: force, moment, load or pressure, constant or a function of time
            * mass: mass
            * spring: stiffness, rest_length, damping
            * tendon: tension
            * torsion spring: stiffness, rest_angle
            * revolute joint: stiffness, rest_angle, damping, moment; see `Scene.join`
            * drag: drag
            * fluid: viscosity, and the regularization [m] of Stokeslets
            * obstacle: friction, rolling_friction, restitution; see `Scene.add_floor`
            * pair of bodies: friction, restitution, contact_stiffness [N/m]; see `Scene.set_friction`
            * support: position, rotation; see `move`; friction of a ring
            * scene: gravity, friction and restitution between rods, slip_tolerance, contact_stiffness [N/m] (None for a
              stiffness that follows the forces)

            youngs_modulus also sets stretch_stiffness, bend_stiffness, twist_stiffness and viscous_time of a rod;
            poisson_ratio sets twist_stiffness, density sets line_density, and viscosity sets viscous_time. If one call
            gives both, the special value holds. A later call with the general value replaces the special one.

        Raises
        ------
        ValueError
            A parameter that the target does not have, a parameter that `over` does not ramp, or a value out of range.
            Then nothing is changed.

        See Also
        --------
        get : Return the present value of a parameter.
        move : Move a support or an obstacle.
        Batch.set : Set parameters of many simulations.

        Notes
        -----
        Type checkers such as mypy and pyright know the parameters of each kind of handle, and refuse a misspelt one.
        They accept any parameter if the target is a name.

        Examples
        --------
        >>> simulation.set(arm, youngs_modulus=2e6, natural_stretch=1.01)
        >>> simulation.set(tip_load, force=lambda t: (0, 0, -t))
        >>> simulation.set(arm, natural_curvature=(0.0, 12.5), over=0.2)
        """
        set_values(self._session, target, values, over)

    @overload
    def get(self, target: Rod, word: MaterialWord) -> Any: ...

    @overload
    def get(self, target: Rod, word: RodArray) -> FloatArray: ...

    @overload
    def get(self, target: Load, word: LoadVector) -> FloatArray: ...

    @overload
    def get(self, target: Load, word: Literal["pressure"]) -> float | FloatArray: ...

    @overload
    def get(self, target: Mass, word: MassWord) -> float: ...

    @overload
    def get(self, target: Spring, word: SpringWord) -> float: ...

    @overload
    def get(self, target: Tendon, word: TendonWord) -> float: ...

    @overload
    def get(self, target: Joint, word: JointWord) -> float: ...

    @overload
    def get(self, target: TorsionSpring, word: TorsionWord) -> float: ...

    @overload
    def get(self, target: Drag, word: DragWord) -> float: ...

    @overload
    def get(self, target: Fluid, word: FluidNumber) -> float: ...

    @overload
    def get(self, target: Fluid, word: Literal["regularization"]) -> float | None: ...

    @overload
    def get(self, target: Obstacle, word: ObstacleNumber) -> float: ...

    @overload
    def get(self, target: Obstacle, word: ObstacleVector) -> FloatArray: ...

    @overload
    def get(self, target: Obstacle, word: Literal["friction"]) -> Any: ...

    @overload
    def get(self, target: Support, word: SupportVector) -> FloatArray: ...

    @overload
    def get(self, target: Support, word: Literal["friction"]) -> float: ...

    @overload
    def get(self, target: tuple[Toucher, Toucher], word: PairNumber) -> float: ...

    @overload
    def get(self, target: tuple[Toucher, Toucher], word: Literal["friction", "contact_stiffness"]) -> Any: ...

    @overload
    def get(self, target: Literal["gravity"], word: None = None) -> FloatArray: ...

    @overload
    def get(self, target: SceneNumber, word: None = None) -> float: ...

    @overload
    def get(self, target: Literal["contact_stiffness"], word: None = None) -> float | None: ...

    @overload
    def get(self, target: str, word: str | None = None) -> Any: ...

    def get(self, target: Settable | Support | str, word: str | None = None) -> Any:
        """Return the present value of a parameter of `set`.

        Parameters
        ----------
        target : handle or str
            Part to read. Or "gravity", "friction" or "restitution" between rods, "slip_tolerance" or
            "contact_stiffness".
        word : str
            Parameter, as in `set`. Obstacles also have "position" and "turn", rods "radius".

        Returns
        -------
        float or ndarray
            * stiffnesses and other parameters of edges: shape (edges,)
            * natural curvature (stencils, 2), natural twist (stencils,), natural stretch (edges,)
            * loads (3,), or (edges, 3) if given per edge
            * positions (3,) [m], rotations (3, 3), and turns (3,) [rad] since the drawing
            * parameters of a material: as they were set

        Raises
        ------
        ValueError
            A parameter that the target does not have.

        See Also
        --------
        set : Change a parameter.
        positions : Positions of nodes, and other read-outs of the motion.

        Examples
        --------
        >>> simulation.get(arm, "natural_curvature").shape
        (29, 2)
        """
        return get_value(self._session, target, word)

    # Loads and custom forces

    def remove(self, load: Load | str) -> None:
        """Remove a load that was added during the simulation.

        Parameters
        ----------
        load : Load or str
            Load, as returned by `add_force`, `add_moment`, `add_load` or `add_pressure` of the simulation.

        Raises
        ------
        ValueError
            The load was already removed, or belongs to the scene.

        See Also
        --------
        add_force : Add a force, as one of four kinds of loads.

        Examples
        --------
        >>> wind = simulation.add_load(arm, (0.1, 0, 0))
        >>> simulation.remove(wind)
        """
        remove_load(self._session, load)

    def check_jacobian(self, force: CustomForce | str | None = None) -> None:
        """Compare the jacobian of a custom force with finite differences at the present state.

        Parameters
        ----------
        force : CustomForce or str
            Force to check. By default all custom forces with a jacobian.

        Raises
        ------
        ValueError
            The jacobian differs; the message names the entry with the greatest error. Or there is no jacobian.
        """
        check_jacobian(self._session, force)


def _set_rod(session: Session, old: str, rod: Rod | str, word: str, value: npt.ArrayLike, over: float) -> None:
    """Set a natural shape by a method that goes in the next version."""
    name = session.directory.rod(rod).name
    old_word(old, f"set(rod, {word}=..., over=...)")
    set_values(session, name, {word: value}, over)
