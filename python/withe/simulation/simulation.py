"""Simulations: a scene while it runs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import validation
from withe.errors import CoarseMeshWarning, CoarseStepWarning, ConvergenceError
from withe.parts.description import describe, parameters_of
from withe.parts.directory import Directory
from withe.parts.handles import Load
from withe.parts.kinds import CustomForcePart, DragPart, FluidPart, LoadPart, MassPart, RodPart, SupportPart
from withe.parts.options import check_tolerances, engine_options
from withe.simulation.control import Control
from withe.simulation.linearisation import Linearisation, Stability
from withe.simulation.measurements import Measurements
from withe.simulation.paths import EquilibriumPath, PathOptions, path_of, path_options
from withe.simulation.readouts import Equilibrium
from withe.simulation.snapshots import Settings, Snapshot, matched_settings

if TYPE_CHECKING:
    from withe.recording.record import Record
    from withe.recording.recorder import Recorder

__all__ = ["Simulation"]

FloatArray = npt.NDArray[np.float64]

_MAX_STEPS = 2**31 - 1


class Simulation(Control, Measurements):
    """A scene while it runs. Made by `Scene.build`.

    Read-outs are copies. Rods, nodes, supports and loads are given by their handles or their names.

    Examples
    --------
    >>> import withe
    >>> scene = withe.Scene()
    >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    >>> arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.3), nodes=31, radius=5e-3, material=rubber, name="arm")
    >>> support = scene.clamp(arm.start)
    >>> simulation = scene.build(time_step=5e-3)
    >>> simulation.step(10)
    >>> round(simulation.time, 6)
    0.05
    """

    def __init__(self) -> None:
        raise TypeError("a Simulation is made by Scene.build")

    @classmethod
    def _build(cls, directory: Directory, gravity: FloatArray, options: dict[str, Any]) -> Simulation:
        """A simulation of a directory that nobody else changes."""
        self = cls.__new__(cls)
        self._scene = directory
        self._scene_gravity = gravity
        self._options = options
        self._directory = directory.copy()
        self._loads = directory.all(LoadPart)
        self._custom_forces = directory.all(CustomForcePart)
        description = describe(directory, gravity, options["bending"])
        if rods := directory.all(RodPart):
            check_tolerances(
                options, max(float(rod.lengths.sum()) for rod in rods), min(float(rod.lengths.min()) for rod in rods)
            )
        supports = {part.name: (index, part) for index, part in enumerate(directory.all(SupportPart))}
        self._settings = Settings(
            rods=parameters_of(directory),
            masses={part.name: part.mass for part in directory.all(MassPart)},
            drags={part.name: part.coefficient for part in directory.all(DragPart)},
            fluids={part.name: part.viscosity for part in directory.all(FluidPart)},
            gravity=gravity.copy(),
            supports=supports,
            functions={part.name: part.function for part in directory.all(LoadPart) if part.function is not None},
        )
        self._world = _core.World(description, engine_options(options))
        self._recorder = None
        self._exact_time = None
        self._running = False
        self._initial = self.snapshot()
        return self

    # Stepping

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        now = self._world.time
        if self._exact_time is not None and self._exact_time[0] == now:
            return self._exact_time[1]
        return now

    @property
    def time_step(self) -> float:
        """As it was given to `Scene.build` [s]."""
        return float(self._options["time_step"])

    def step(self, count: int = 1) -> None:
        """Advance by exactly `count` time steps, whatever is cut inside.

        Raises
        ------
        ConvergenceError
            A step that cannot be solved even when cut; the state is then the last accepted one.
        ValueError
            A count that is not a whole number, or negative.
        RuntimeError
            Called by a callback of `run`, or while another thread runs the simulation.
        """
        self._refuse_in_run("step")
        self._step(validation.integer(count, "number of steps", 0, _MAX_STEPS))

    def _step(self, count: int) -> None:
        with self._convergence():
            self._world.step(count, self._step_callback(), self._force_function())

    def _advance_to(self, time: float) -> None:
        """Advance to a time, with steps of equal length that are no longer than the time step."""
        with self._convergence():
            self._world.advance_to(time, self._step_callback(), self._force_function())

    @overload
    def equilibrium(self) -> Equilibrium: ...

    @overload
    def equilibrium(
        self,
        *,
        path: Literal["arc_length"],
        load: Load | str | Sequence[Load | str] | None = None,
        start: float = 0.0,
        to: float = 1.0,
        steps: int = 1000,
        turn: float = 0.1,
    ) -> EquilibriumPath: ...

    def equilibrium(
        self,
        *,
        path: Literal["arc_length"] | None = None,
        load: Load | str | Sequence[Load | str] | None = None,
        start: float = 0.0,
        to: float = 1.0,
        steps: int = 1000,
        turn: float = 0.1,
    ) -> Equilibrium | EquilibriumPath:
        """Find the static equilibrium that the present state leads to, and go there. Time stands still.

        Supports that were moved go to their places, and loads that were changed come in, along the branch of equilibria
        that begins at the present state, in steps in which no edge turns far. Where that branch ends (at a limit point)
        or is not stable any more, the scene goes on dynamically: then `branch_changed` is true. Saddles are left, so
        that a straight column that carries too much buckles.

        With ``path="arc_length"`` the branch is followed through limit points, stable or not, by pseudo-arc-length
        continuation [Riks 1979, Int. J. Solids Struct. 15; Crisfield 1981, Comput. Struct. 13], and all its points are
        returned; the simulation ends at the last one.

        Parameters
        ----------
        path : "arc_length", optional
        load : Load, str, or several, optional
            Loads whose present values the load factor multiplies. Without any, the factor is that of all that has been
            changed since the last equilibrium (in the drawn state: of all loads), 0 before and 1 as it is asked for:
            supports that were moved, loads, gravity, natural shapes; the last three as forces out of balance.
        start : float
            Load factor at which the path begins, with the equilibrium to which the present state leads there. Needs
            loads.
        to : float
            Load factor at which the path ends, the first time that it is met. The loads keep that factor.
        steps : int
            The path also ends after so many steps.
        turn : float [rad]
            Greatest turn of an edge from one point of the path to the next.

        Returns
        -------
        Equilibrium
            Or, along a path, `EquilibriumPath`.

        Raises
        ------
        ConvergenceError
            None was found, or there is none (a free rod under gravity).
        ValueError
            A load that is a function of time, or a load factor or number of steps that cannot be.

        Examples
        --------
        Half a circle, pinned at both ends, snaps through at its first limit load:

        >>> import numpy as np
        >>> import withe
        >>> scene = withe.Scene(gravity=(0, 0, 0))
        >>> angle = np.linspace(-np.pi / 2, np.pi / 2, 41)
        >>> steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
        >>> arc = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
        >>> arch = scene.add_rod(points=arc, radius=5e-3, material=steel)
        >>> ends = scene.pin(arch.start), scene.pin(arch.end)
        >>> load = scene.add_force(arch.node(20), (0, 0, -1.0))
        >>> simulation = scene.build(integrator="static", planar=True)
        >>> path = simulation.equilibrium(path="arc_length", load=load, to=1000.0)
        >>> print(f"{path.load_factors[path.limit_points[0]]:.0f} N")
        992 N
        """
        self._refuse_in_run("equilibrium")
        self._world.check_idle()
        if path is not None:
            validation.choice(path, "path", ("arc_length",))
            return self._arc_length(
                path_options(self._directory, self._settings.functions, load, start, to, steps, turn)
            )
        self._apply_functions(self._world.time, self._world.time)
        with self._convergence():
            found = self._world.equilibrium(None, self._force_function())
        stability: Stability = "stable" if found.stable else "diverges"
        if not found.decided:
            stability = self.linearise().stability
        return Equilibrium(stability == "stable", stability, found.branch_changed, found.iterations, found.residual)

    def _arc_length(self, wanted: PathOptions) -> EquilibriumPath:
        self._apply_functions(self._world.time, self._world.time)
        loads = [self._load_index(part) for part in wanted.loads]
        with self._convergence():
            found = self._world.equilibrium_path(
                loads, wanted.start, wanted.end, wanted.steps + 1, wanted.turn, None, self._force_function()
            )
        return path_of(
            found, lambda rod: self._directory.layout.rows(self._rod(rod)), lambda support: self._support(support)[0]
        )

    def run(
        self,
        duration: float,
        record_every: float | None = None,
        *,
        progress: bool | Literal["always"] = True,
        before_step: Callable[[Simulation], object] | None = None,
        until: Callable[[Simulation], object] | None = None,
        record: Mapping[str, Callable[[Simulation], npt.ArrayLike]] | None = None,
    ) -> Record:
        """Advance by a duration and record what happens.

        Frames are taken at the start, at every multiple of `record_every` after it, and at the end. Where
        that is no multiple of the time step, steps are shortened evenly to land on the frames.

        Parameters
        ----------
        duration : float [s]
        record_every : float [s]
            By default a hundredth of the duration, rounded up to whole time steps.
        progress : bool or "always"
            Whether to show a progress bar; True shows one on a terminal and in a notebook.
        before_step : callable
            Called with the simulation once before every time step, never before an inner or repeated one:
            the place for a controller.
        until : callable
            Called with the simulation after every time step; the run ends when it returns true.
        record : mapping of str to callable
            What else to record: each is called with the simulation at every frame, and its results are
            ``record[name]``.

        Returns
        -------
        Record
            Also kept as `simulation.record`.

        Raises
        ------
        ConvergenceError, KeyboardInterrupt, or what a callback raised
            What was recorded until then is `simulation.record`.
        ValueError
            A duration or record_every that is not positive or too short to change the time, or a callback
            that cannot be called.
        RuntimeError
            Called by a callback of a run: those may read, set, hold and copy the simulation, but not advance it
            or take it back.
        """
        self._refuse_in_run("run")
        from withe.simulation.running import run

        return run(
            self,
            duration,
            record_every=record_every,
            progress=progress,
            before_step=before_step,
            until=until,
            record=record,
        )

    @contextmanager
    def _in_run(self) -> Iterator[None]:
        """While this lasts, only the loop of `run` may advance the simulation."""
        self._refuse_in_run("run")
        self._running = True
        try:
            yield
        finally:
            self._running = False

    def _refuse_in_run(self, what: str) -> None:
        """Refuse what would change the time or the state behind the back of a run, whose record were wrong then."""
        if self._running:
            raise RuntimeError(
                f"{what} cannot be called while the simulation runs: before_step may read, set and hold it, until and "
                "record may read it, and all may go on with a copy()"
            )

    @property
    def record(self) -> Record:
        """What the last `run` recorded, also when it ended early.

        Raises
        ------
        RuntimeError
            There was none.
        """
        if self._recorder is None:
            raise RuntimeError("there is no record: call run first")
        return self._recorder.record

    @contextmanager
    def _convergence(self) -> Iterator[None]:
        """Give the engine's failures the names of this scene."""
        try:
            yield
        except _core.ConvergenceFailure as failure:
            message, time, step, rod, node, residual = failure.args
            name = self._directory.layout.rods[rod].name if rod >= 0 else None
            raise ConvergenceError(message, time, step, name, node if node >= 0 else None, residual) from None
        finally:
            if warning := self._world.take_warning():
                warnings.warn(warning, CoarseMeshWarning, stacklevel=4)
            if warning := self._world.take_step_warning():
                warnings.warn(warning, CoarseStepWarning, stacklevel=4)

    # At a moment

    def linearise(self) -> Linearisation:
        """Equations of motion linearised about the present configuration, with supports held.

        Returns
        -------
        Linearisation
            Tangent stiffness, masses, natural frequencies and modes. Meaningful at an equilibrium.

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene(gravity=(0, 0, 0))
        >>> steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
        >>> beam = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=51, radius=5e-3, material=steel)
        >>> wall = scene.clamp(beam.start)
        >>> print(f"{scene.build().linearise().frequencies(1)[0]:.2f} Hz")
        7.06 Hz
        """
        found = self._world.linearise(self._force_function())
        return Linearisation(found.geometric, found.gradients, found.stiffnesses, found.mass, found.displacement)

    def __getitem__(self, name: str) -> Any:
        """The handle of the part, node or edge of that name."""
        return self._directory.handle(name)

    def __repr__(self) -> str:
        rods = ", ".join(rod.name for rod in self.rods)
        return f"Simulation(t = {self.time:g} s; rods {rods})"

    # State

    def snapshot(self) -> Snapshot:
        """The whole state, to go back to with `restore`, bit by bit."""
        return Snapshot(self._world.snapshot(), self._world.time, self._settings.copy())

    def restore(self, snapshot: Snapshot | Record, frame: int = -1) -> None:
        """Go back to a snapshot, of this simulation or another of the same scene, or to a frame of a record.

        A record holds positions, velocities, frames and spins of rods and their time, to the last digit or nearly;
        everything else stays as it is here: supports must be where they were then, and what was set (loads, natural
        shapes, materials) and the history that contact and friction remember are not in it. Joints are
        turned so that they stress the edges at them least, and turn as these do on the mean.

        Parameters
        ----------
        snapshot : Snapshot or Record
        frame : int
            Of a record; the last one by default.

        Raises
        ------
        ValueError
            A snapshot or record of another scene, a damaged one, a snapshot from a file that needs functions of time
            that this simulation does not have, or a record whose nodes are elsewhere than supports hold them.
        RuntimeError
            Called by a callback of `run`.
        """
        from withe.recording.record import Record

        self._refuse_in_run("restore")
        if isinstance(snapshot, Record):
            self._restore_record(snapshot, frame)
            self._exact_time = None
            return
        if not isinstance(snapshot, Snapshot):
            raise ValueError(
                f"snapshot must be a withe.Snapshot, got {type(snapshot).__name__}; a withe.Record will do too"
            )
        settings = matched_settings(snapshot, self._settings, self._directory, self._scene)
        self._world.restore(snapshot._state)
        for name in set(self._directory.parts) - set(self._scene.parts) - set(settings.supports):
            del self._directory.parts[name]
        for name, (_, part) in settings.supports.items():
            self._directory.parts[name] = part
        self._directory.parts.update(settings.loads)
        self._loads = [*self._scene.all(LoadPart), *settings.loads.values()]
        self._settings = settings
        self._exact_time = None

    def reset(self) -> None:
        """Go back to the scene as it was drawn, and undo everything that was set since.

        Raises
        ------
        RuntimeError
            Called by a callback of `run`.
        """
        self._refuse_in_run("reset")
        self.restore(self._initial)

    def copy(self) -> Simulation:
        """Another simulation in the same state, which goes its own way from here."""
        other = Simulation.__new__(Simulation)
        other.__dict__.update(self.__dict__)
        other._directory = self._directory.copy()
        other._settings = self._settings.copy()
        other._world = self._world.copy()
        other._recorder = None
        other._running = False
        return other

    def __copy__(self) -> Simulation:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        return self.copy()

    def __getstate__(self) -> dict[str, Any]:
        return {
            "scene": self._scene,
            "gravity": self._scene_gravity,
            "options": self._options,
            "snapshot": self.snapshot(),
            "functions": self._settings.functions,
            "paths": self._settings.paths,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        built = Simulation._build(state["scene"], state["gravity"], state["options"])
        self.__dict__.update(built.__dict__)
        self._settings.functions = state["functions"]
        self._settings.paths = state["paths"]
        self.restore(state["snapshot"])

    # Pictures

    def plot(self, **options: Any) -> Any:
        """The present shape as a matplotlib figure; see `withe.view.plot` for the options."""
        return self._frame().plot(**options)

    def view(self, **options: Any) -> Any:
        """The present shape to turn about, in a notebook or a window; see `withe.view.view`."""
        return self._frame().view(**options)

    def picture(self, path: str | os.PathLike[str], **options: Any) -> FilePath:
        """Render the present shape into a .png file; see `withe.view.picture`."""
        return self._frame().picture(path, **options)

    def _frame(self) -> Record:
        from withe.recording.recorder import present

        return present(self, self._obstacle_outlines())

    _recorder: Recorder | None
    _exact_time: tuple[float, float] | None
    _running: bool
    _initial: Snapshot
