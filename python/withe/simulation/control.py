"""What may be changed on a simulation while it runs: the half of `Simulation` that acts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.parts.applied_loads import AppliedLoads, load_vector
from withe.parts.description import added_mass, describe_load, drag, rod_parameters
from withe.parts.friction import as_given, obstacle_friction
from withe.parts.handles import CustomForce, Drag, Fluid, Load, Mass, Obstacle, Rod
from withe.parts.kinds import (
    CustomForcePart,
    DragPart,
    FluidPart,
    JoinPart,
    LoadPart,
    MassPart,
    ObstaclePart,
    Part,
    RodPart,
    SupportPart,
)
from withe.parts.parameters import ROD_WORDS, RodParameters
from withe.parts.rods import curvature_array, twist_array
from withe.simulation.custom_forces import CustomForces
from withe.simulation.motion import Path, Turn, evaluate_path
from withe.simulation.states import States

__all__ = ["Control"]

FloatArray = npt.NDArray[np.float64]
_NATURAL_WORDS = ("natural_curvature", "natural_twist")


class Control(States, AppliedLoads):
    """Actuation, loads and parameters of a running simulation."""

    _scene_gravity: FloatArray
    _options: dict[str, Any]
    _loads: list[LoadPart]
    _custom_forces: list[CustomForcePart]

    # Natural shape

    def set_natural_curvature(
        self, rod: Rod | str, curvature: npt.ArrayLike, over: float = 0.0, *, discrete: bool = False
    ) -> None:
        """Actuate a rod by changing the curvature at which it is free of stress.

        A curvature out of the plane of a planar simulation makes it three-dimensional, unless it was
        built with planar=True.

        Parameters
        ----------
        rod : Rod or str
        curvature : array_like of shape (2,) or (stencils, 2) [1/m]
            Towards the two directors; one pair for the whole rod, or one a stencil.
        over : float [s]
            Reached after so long, evenly; at once by default.
        discrete : bool
            Whether the curvature is 2 tan(phi / 2) [-], phi the angle between two edges.

        Raises
        ------
        ValueError
            Wrong shape, not finite, a turn of pi or more at a node, or out of the plane of a simulation
            that was built with planar=True.

        Examples
        --------
        >>> simulation.set_natural_curvature(arm, (0.0, 12.5), over=0.2)
        """
        part = self._directory.rod(rod)
        values = curvature_array(curvature, part.voronoi, validation.truth(discrete, "discrete"), part.owner)
        self._world.set_natural_curvature(part.index, values, validation.non_negative(over, "over"))

    def set_natural_twist(self, rod: Rod | str, twist: npt.ArrayLike, over: float = 0.0) -> None:
        """Actuate a rod by changing the twist at which it is free of stress.

        Parameters
        ----------
        rod : Rod or str
        twist : float or array_like of shape (stencils,) [rad/m]
        over : float [s]
            Reached after so long, evenly; at once by default.

        Raises
        ------
        ValueError
            Wrong shape, not finite, or not zero in a simulation that was built with planar=True.
        """
        part = self._directory.rod(rod)
        values = twist_array(twist, part.voronoi, part.owner)
        self._world.set_natural_twist(part.index, values, validation.non_negative(over, "over"))

    # Parameters

    def set(self, target: Rod | Load | Mass | Drag | Fluid | Obstacle | str | None = None, /, **values: Any) -> None:
        """Change parameters while the simulation runs.

        Parameters
        ----------
        target : handle or str
            None for what belongs to the whole scene.
        **values
            Of a rod: youngs_modulus, poisson_ratio, density, viscosity, stretch_stiffness,
            bend_stiffness, twist_stiffness, line_density, viscous_time, drag (numbers, or one an edge),
            natural_curvature, natural_twist. Of a load: force, moment, load or pressure, constant or a function
            of time. Of a mass: mass. Of a drag: drag. Of a fluid: viscosity. Of an obstacle: friction, one coefficient
            or a pair, along and across rods. Of the scene: gravity, and friction between rods. See `set_friction` for
            two of them.

        Raises
        ------
        ValueError
            A word that the target does not have, or a value out of range; then nothing is changed.

        Examples
        --------
        >>> simulation.set(arm, youngs_modulus=2e6)
        >>> simulation.set(tip_load, force=lambda t: (0, 0, -t))
        """
        if not values:
            raise ValueError("set must be given what to set, such as youngs_modulus=1e6")
        if target is None:
            _only(values, ("gravity", "friction"), "the scene")
            gravity = validation.vector(values["gravity"], "gravity") if "gravity" in values else None
            if "friction" in values:
                self._set_rod_friction(values["friction"])
            if gravity is not None:
                self._world.set_gravity(gravity)
                self._settings.gravity = gravity
            return
        part = self._directory.find_any(target, "target")
        if isinstance(part, RodPart):
            self._set_rod(part, values)
        elif isinstance(part, LoadPart):
            _only(values, (part.kind,), f"{part.kind} {part.name!r}")
            self._set_load(part, values[part.kind])
        elif isinstance(part, MassPart):
            _only(values, ("mass",), f"mass {part.name!r}")
            masses = self._settings.masses | {part.name: validation.non_negative(values["mass"], f"mass {part.name!r}")}
            self._world.set_added_mass(added_mass(self._directory, masses))
            self._settings.masses = masses
        elif isinstance(part, DragPart):
            _only(values, ("drag",), f"drag {part.name!r}")
            self._set_drag(part, validation.non_negative(values["drag"], f"drag {part.name!r}"))
        elif isinstance(part, FluidPart):
            _only(values, ("viscosity",), f"fluid {part.name!r}")
            viscosity = validation.positive(values["viscosity"], f"viscosity of {part.name!r}")
            self._world.set_fluid_viscosity(viscosity)
            self._settings.fluids = self._settings.fluids | {part.name: viscosity}
        elif isinstance(part, ObstaclePart):
            _only(values, ("friction",), f"obstacle {part.name!r}")
            self._set_obstacle_friction(part, values["friction"])
        else:
            raise ValueError(_nothing_to_set(part))

    def get(self, target: Rod | Load | Mass | Drag | Fluid | Obstacle | str, word: str | None = None) -> Any:
        """The present value of what `set` sets.

        Parameters
        ----------
        target : handle or str
            Or "gravity", or "friction" of rods with each other.
        word : str
            As in `set`.

        Returns
        -------
        float or ndarray
            Stiffnesses and what else belongs to edges one an edge, (edges,); natural curvature
            (stencils, 2) and twist (stencils,); loads (3,). What belongs to a material as it was set.

        Raises
        ------
        ValueError
            A word that the target does not have.

        Examples
        --------
        >>> simulation.get(arm, "natural_curvature").shape
        (29, 2)
        """
        if word is None:
            if isinstance(target, str) and target == "friction":
                return float(self._world.contact.friction)
            if not isinstance(target, str) or target != "gravity":
                raise ValueError("word must be given, such as get(arm, 'youngs_modulus')")
            return self._settings.gravity.copy()
        part = self._directory.find_any(target, "target")
        if isinstance(part, RodPart):
            if word in _NATURAL_WORDS:
                readout = self._world.natural_curvature if word == _NATURAL_WORDS[0] else self._world.natural_twist
                return np.array(readout(part.index))
            if word in ROD_WORDS:
                return self._settings.rods[part.index].get(word)
            if word == "radius":
                return part.section.radii.copy()
        elif isinstance(part, LoadPart) and word == part.kind:
            value = np.array(self._world.load(self._load_index(part)))
            return value if part.axis is None else float(value @ part.axis)
        elif isinstance(part, MassPart) and word == "mass":
            return self._settings.masses[part.name]
        elif isinstance(part, DragPart) and word == "drag":
            return self._settings.drags[part.name]
        elif isinstance(part, FluidPart) and word == "viscosity":
            return self._settings.fluids[part.name]
        elif isinstance(part, ObstaclePart) and word == "friction":
            index = self._directory.all(ObstaclePart).index(part)
            return as_given(obstacle_friction(self._world.contact, index))
        words = _words_of(part)
        if not words:
            raise ValueError(_nothing_to_set(part))
        raise ValueError(f"{part.name!r} has no {word!r}; it has {', '.join(words)}")

    def _set_rod(self, part: RodPart, values: dict[str, Any]) -> None:
        _only(values, (*ROD_WORDS, *_NATURAL_WORDS), part.owner)
        parameters = self._settings.rods[part.index]
        for word, value in values.items():
            if word in ROD_WORDS:
                parameters = parameters.changed(word, value, part.section, part.owner)
        curvature = twist = None
        if "natural_curvature" in values:
            curvature = curvature_array(values["natural_curvature"], part.voronoi, False, part.owner)
        if "natural_twist" in values:
            twist = twist_array(values["natural_twist"], part.voronoi, part.owner)
        changes: list[Callable[[], None]] = []
        if curvature is not None:
            changes.append(lambda: self._world.set_natural_curvature(part.index, curvature, 0.0))
        if twist is not None:
            changes.append(lambda: self._world.set_natural_twist(part.index, twist, 0.0))
        if parameters is not self._settings.rods[part.index]:
            changes.append(lambda: self._apply_parameters(part.index, parameters))
        # A change that is refused, as it leaves the plane of planar=True, does nothing; those before it are taken back.
        before = self._world.snapshot() if len(changes) > 1 else b""
        try:
            for change in changes:
                change()
        except ValueError:
            if len(changes) > 1:
                self._world.restore(before)
            raise

    def _apply_parameters(self, rod: int, parameters: RodParameters) -> None:
        if parameters is not self._settings.rods[rod]:
            self._world.set_rod_parameters(rod, rod_parameters(parameters))
            self._settings.rods[rod] = parameters

    def _set_drag(self, part: DragPart, coefficient: float) -> None:
        drags = self._settings.drags | {part.name: coefficient}
        for rod in self._directory.all(RodPart):
            if part.rods is None or rod.index in part.rods:
                total = drag(self._directory, drags, rod)
                changed = self._settings.rods[rod.index].changed("drag", total, rod.section, rod.owner)
                self._apply_parameters(rod.index, changed)
        self._settings.drags = drags

    def _load_index(self, part: LoadPart) -> int:
        return self._loads.index(part)

    def _load_time(self) -> float:
        return self._world.time

    def _take_load(self, part: LoadPart) -> Load:
        """A load put on while running acts from now on, until the simulation is reset."""
        self._world.add_load(describe_load(part))
        self._loads = [*self._loads, part]
        self._settings.loads[part.name] = part
        if part.function is not None:
            self._settings.functions[part.name] = part.function
        return cast(Load, self._directory.add(part))

    def remove(self, load: Load | str) -> None:
        """Take off a load that was put on while running; it acts no more from now on.

        Parameters
        ----------
        load : Load or str
            As `add_force`, `add_moment`, `add_load` or `add_pressure` of the simulation returned it.

        Raises
        ------
        ValueError
            A load that is not there any more, or one of the scene as it was drawn.

        Examples
        --------
        >>> wind = simulation.add_load(arm, (0.1, 0, 0))
        >>> simulation.remove(wind)
        """
        part = self._directory.find(load, LoadPart, "load")
        if part.name not in self._settings.loads:
            raise ValueError(
                f"load {part.name!r} was drawn with the scene, and stays: set({part.name!r}, {part.kind}=...) to zero"
            )
        self._world.remove_load(self._load_index(part))
        self._loads = [other for other in self._loads if other is not part]
        del self._settings.loads[part.name]
        self._settings.functions.pop(part.name, None)
        self._directory.remove(part.name)

    def _set_load(self, part: LoadPart, value: Any) -> None:
        what = f"{part.kind} {part.name!r}"
        function = value if callable(value) else None
        now = load_vector(value(self._world.time) if callable(value) else value, part.axis, what)
        self._world.set_load(self._load_index(part), now)
        if function is None:
            self._settings.functions.pop(part.name, None)
        else:
            self._settings.functions[part.name] = function

    def set_velocities(self, rod: Rod | str | None, velocities: npt.ArrayLike) -> None:
        """Set the velocities of the nodes of a rod; those that are held stay at rest.

        Parameters
        ----------
        rod : Rod or str
            None for every node of the scene.
        velocities : array_like of shape (nodes, 3) or (3,) [m/s]

        Raises
        ------
        ValueError
            Wrong shape, or not finite.
        """
        now = np.array(self._world.velocities())
        if rod is None:
            now[:] = validation.number_array(velocities, "velocities", now.shape, (3,))
        else:
            part = self._directory.rod(rod)
            shape = part.points.shape
            now[self._directory.layout.rows(part.index)] = validation.number_array(
                velocities, f"velocities of {part.owner}", shape, (3,)
            )
        self._world.set_velocities(now)

    # Functions of time

    def _step_callback(self) -> Callable[[float, float], None] | None:
        """What to call before every inner step, if anything."""
        now = self._world.time
        moving = any(not _finished(path, now) for path in self._settings.paths.values())
        if moving or self._settings.functions:
            return self._apply_functions
        return None

    def _apply_functions(self, force_time: float, end_time: float) -> None:
        """Evaluate loads and paths for the coming inner step."""
        if self._settings.functions:
            for index, part in enumerate(self._loads):
                function = self._settings.functions.get(part.name)
                if function is not None:
                    what = f"{part.kind} {part.name!r} at t = {force_time:g}"
                    value = load_vector(function(force_time), part.axis, what)
                    self._check_in_plane(value, what, along_normal=part.kind == "moment")
                    self._world.set_load(index, value)
        for name, path in self._settings.paths.items():
            if name not in self._settings.supports and (obstacle := self._obstacle(name)) is not None:
                self._world.prescribe_obstacle(obstacle[0], *self._obstacle_pose(obstacle[0], path, end_time))
                continue
            index, support = self._settings.supports[name]
            if _finished(path, min(self._world.time, end_time)):
                continue
            present = np.array(self._world.support_rotation(index))
            owner = f"support {name!r}"
            position, rotation = evaluate_path(path, end_time, present, support.kind != "pin", owner)
            self._world.prescribe_support(index, position, rotation)

    def _force_function(self) -> CustomForces | None:
        """What finds the custom forces, if any."""
        if not self._custom_forces:
            return None
        shortest = min(float(rod.lengths.min()) for rod in self._directory.all(RodPart))
        return CustomForces(
            self._custom_forces,
            shortest,
            self._check_in_plane,
            lambda moments, what: self._check_in_plane(moments, what, along_normal=True),
        )

    def check_jacobian(self, force: CustomForce | str | None = None) -> None:
        """Compare the jacobian of a custom force with differences of its function, at the present state.

        Parameters
        ----------
        force : CustomForce or str
            By default all that have a jacobian, one after the other.

        Raises
        ------
        ValueError
            A jacobian that is wrong, with the entry that is farthest off; or none.
        """
        given = [part for part in self._custom_forces if part.jacobian is not None]
        if force is not None:
            given = [self._directory.find(force, CustomForcePart, "custom force")]
        custom = self._force_function()
        if custom is None or not given:
            raise ValueError("there is no jacobian to check: give add_custom_force one")
        positions, velocities = np.array(self._world.positions()), np.array(self._world.velocities())
        for part in given:
            custom.check(part, self._world.time, positions, velocities)

    def _check_in_plane(self, value: FloatArray, what: str, along_normal: bool = False) -> None:
        """Refuse what a function gave that leaves the plane of a simulation built with planar=True."""
        if not self._options["planar"]:
            return
        normal = np.array(self._world.plan.plane_normal)
        out = value - np.outer(value @ normal, normal).reshape(value.shape) if along_normal else value @ normal
        if np.linalg.norm(out) > 1e-8 * np.linalg.norm(value):
            must = "along the normal of" if along_normal else "in"
            raise ValueError(
                f"{what} must stay {must} the plane of a scene built with planar=True, whose normal is "
                f"({normal[0]:g}, {normal[1]:g}, {normal[2]:g}), got {np.array2string(value, threshold=9)}"
            )


def _finished(path: Path, time: float) -> bool:
    """Whether a path has come to its end, and was followed there."""
    if not isinstance(path, Turn):
        return False
    begin, end = path.times
    return bool(time > end or (time == end and begin < end))


def _words_of(part: Part) -> tuple[str, ...]:
    """The words of `get` that a part takes."""
    if isinstance(part, RodPart):
        return (*ROD_WORDS, *_NATURAL_WORDS, "radius")
    if isinstance(part, LoadPart):
        return (part.kind,)
    words: dict[type[Any], tuple[str, ...]] = {
        MassPart: ("mass",),
        DragPart: ("drag",),
        FluidPart: ("viscosity",),
        ObstaclePart: ("friction",),
    }
    return words.get(type(part), ())


_SETTABLE = (
    "set takes rods (youngs_modulus, natural_curvature, ...), loads (force, moment, load), masses (mass), "
    "drags (drag), fluids (viscosity), obstacles (friction), and None for the scene (gravity, friction)"
)


def _nothing_to_set(part: Part) -> str:
    """What drives a part instead."""
    if isinstance(part, JoinPart):
        first, second = part.node_names
        return (
            f"joint {part.name!r} has no motor and nothing to set. To drive it: equal and opposite moments on the rods "
            f"at both sides, scene.add_moment({first}, ...) and scene.add_moment({second}, ...), which "
            "set(load, moment=...) changes or makes a function of time; set_natural_curvature or set_natural_twist of "
            "a rod beside it; or, to prescribe where it is, clamp or pin its node and move that"
        )
    if isinstance(part, SupportPart):
        return f"support {part.name!r} has nothing to set: move, release or reaction take it. {_SETTABLE}"
    return f"{part.name!r} has nothing to set. {_SETTABLE}"


def _only(values: dict[str, Any], words: tuple[str, ...], owner: str) -> None:
    for word in values:
        if word not in words:
            raise ValueError(f"{owner} has no {word!r} to set; it has {', '.join(words)}")
