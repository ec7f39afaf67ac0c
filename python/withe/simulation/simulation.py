"""Simulations: running scenes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.attributes import known_attributes
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.parts.applied_loads import AppliedLoads
from withe.parts.directory import Directory
from withe.parts.handles import Load
from withe.parts.options import BuildOptions
from withe.recording.record import Record
from withe.recording.recorder import present
from withe.simulation.control import Control
from withe.simulation.in_balance import find_balance
from withe.simulation.linearisation import Linearisation
from withe.simulation.loads import RunningLoads
from withe.simulation.loop import Run
from withe.simulation.measurements import Measurements
from withe.simulation.outlines import outlines_of
from withe.simulation.paths import EquilibriumPath, path_options
from withe.simulation.placement import Placement
from withe.simulation.plausibility import check_scene
from withe.simulation.readouts import Equilibrium
from withe.simulation.session import Session
from withe.simulation.sliders import EquilibriumSliders
from withe.simulation.snapshots import Snapshot, restore
from withe.simulation.state_space import StateSpace
from withe.simulation.states import restore_frame
from withe.simulation.stepping import Stepping
from withe.simulation.surfaces import find_friction_fields
from withe.view.live import LiveView
from withe.view.sliders import SliderView

__all__ = ["Simulation"]

FloatArray = npt.NDArray[np.float64]

_MAX_STEPS = 2**31 - 1


@keyword_hints
@known_attributes("use set, such as set(gravity=(0, 0, -1.6)), or an option of Scene.build")
class Simulation(AppliedLoads, Control, Placement, Measurements, StateSpace):
    """Run a scene. `Scene.build` returns simulations.

    Methods and properties by purpose:

    * describe: `set`, for every parameter; old names are `set_natural_curvature`, `set_natural_twist` and
      `set_natural_stretch`
    * hold: `clamp`, `pin`, `grasp`, `release`, `move`, `hand`, `feed`
    * load: `add_force`, `add_moment`, `add_load`, `add_pressure`, `remove`
    * touch: ``set((a, b), friction=...)``; old names are `set_friction`, `set_restitution` and
      `set_contact_stiffness`
    * run: `step`, `run`, `equilibrium`, `set_state`, `set_velocities`, `set_velocity`, `snapshot`, `restore`, `reset`,
      `copy`
    * read the scene: `time`, `time_step`, `rods`, `get`, `energy`, `momentum`, `statistics`, `plan`, `record`
    * read rods: `positions`, `velocities`, `directors`, `spins`, `curvatures`, `twists`, `tensions`, `link`
    * read bodies: `position`, `rotation`, `velocity`, `angular_velocity`
    * read parts: `reaction`, `pose`, `wrench`, `deflection`, `passage`, `joint_angle`, `joint_rate`, `joint_torque`,
      `spring_tension`, `tendon_length`, `tendon_points`, `obstacle_position`, `contacts`
    * read pictures: `plot`, `view`, `picture`
    * differentiate: `linearise`, `step_jacobian`, `state_difference`, `displace_state`, `check_jacobian`, and
      `Record.gradient` for a whole run

    Arrays that methods return are copies. Rods, nodes, supports and loads are given by handle or by name.

    Raises
    ------
    TypeError
        The class is called: use `Scene.build`.

    See Also
    --------
    Scene.build : Build a simulation.
    Batch : Many simulations that step together.
    Record : Frames of a run.

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

    _stepping: Stepping
    _initial: Snapshot

    def __init__(self) -> None:
        raise TypeError("a Simulation is made by Scene.build")

    @classmethod
    def _build(cls, directory: Directory, gravity: FloatArray, options: BuildOptions) -> Simulation:
        """A simulation of a directory that nobody else changes."""
        in_balance = find_balance(directory, gravity, options)
        session = Session.begin(directory, gravity, options)
        for rod, stretch in in_balance:
            session.world.set_natural_stretch(rod, stretch, 0.0)
        find_friction_fields(session)
        stepping = Stepping(session)
        check_scene(stepping)
        return cls._of(stepping)

    @classmethod
    def _of(cls, stepping: Stepping, initial: Snapshot | None = None) -> Simulation:
        self = cls.__new__(cls)
        self._stepping = stepping
        self._session = stepping.session
        self._initial = self.snapshot() if initial is None else initial
        return self

    @property
    def _bearer(self) -> RunningLoads:
        return RunningLoads(self._session)

    # Stepping

    @property
    def time(self) -> float:
        """Return the time since the start [s]."""
        return self._stepping.time

    @property
    def time_step(self) -> float:
        """Return the time step that was given to `Scene.build` [s]."""
        return self._session.options.time_step

    def step(self, count: int = 1) -> None:
        """Advance by `count` time steps. Subdivision inside a step does not change the count.

        Parameters
        ----------
        count : int
            Number of time steps.

        Raises
        ------
        ConvergenceError
            A step did not converge, even after subdivision. The simulation keeps its last accepted state.
        ValueError
            `count` is negative or not a whole number.
        RuntimeError
            Called by a callback of `run`, or while another thread runs the simulation.

        See Also
        --------
        run : Advance by a duration and record frames.
        equilibrium : Move to the static equilibrium.
        Batch.step : Advance many simulations.
        """
        self._stepping.refuse_in_run("step")
        self._stepping.step(validation.integer(count, "number of steps", 0, _MAX_STEPS))

    @overload
    def equilibrium(self, *, stable: bool = True) -> Equilibrium: ...

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
        stable: bool = True,
        path: Literal["arc_length"] | None = None,
        load: Load | str | Sequence[Load | str] | None = None,
        start: float = 0.0,
        to: float = 1.0,
        steps: int = 1000,
        turn: float = 0.1,
    ) -> Equilibrium | EquilibriumPath:
        """Move to the static equilibrium that the present state leads to. Time does not advance.

        Targets that are still ramping (`over=`) are frozen at their current value. A warning reports ramps that have
        not begun.

        The solver follows the branch of equilibria that begins at the present state, in steps in which no edge turns
        far. If that branch ends (at a limit point) or becomes unstable, the scene moves dynamically to another
        equilibrium, and `branch_changed` is true. The solver leaves saddles, so that a straight column above its
        critical load buckles, unless ``stable=False``. A scene that is solved in a plane stays in it. If it would leave
        the plane in space, `OutOfPlaneWarning` is given.

        All changes since the last equilibrium act together, each in proportion to one factor from 0 to 1. Their order
        in Python does not matter. The factor drives these changes:

        - supports and grippers: from their present poses to their targets, in straight lines and uniform rotations
        - natural shapes and tensions of tendons: from their values at the last motion (at first from the drawn shape
          and slack tendons)
        - moments and follower forces: from the share that the present state balances
        - forces out of balance at the present state (of changed loads, gravity, moduli and obstacles): as dead forces
          that vanish

        Obstacles are at their new positions from the start. If the order of changes matters, call `equilibrium` after
        each change: ``move``, ``equilibrium``, ``set``, ``equilibrium``.

        With ``path="arc_length"`` pseudo-arc-length continuation follows the branch through limit points, stable or not
        [Riks 1979, Int. J. Solids Struct. 15; Crisfield 1981, Comput. Struct. 13]. The result contains all points, and
        the simulation ends at the last one.

        Parameters
        ----------
        stable : bool
            False to allow unstable equilibria: the straight shape of a column above Euler's load, or an arch in the
            shape of an M. `Equilibrium.stable` of the result is then False. Draw or set the rods near the desired
            shape. At a limit point the scene moves dynamically all the same. A path by arc length follows unstable
            branches in any case.
        path : "arc_length", optional
            Follow the branch by arc length, and return its points.
        load : Load, str, or several, optional
            Loads whose present values are multiplied by the load factor. Without loads, the factor multiplies all
            changes since the last equilibrium (in the drawn state: all loads), from 0 to 1. Changed loads, gravity and
            natural shapes then act as residual forces.
        start : float [-]
            Load factor at the start of the path. Needs loads.
        to : float [-]
            Load factor at the end of the path. The loads keep this factor.
        steps : int
            Maximum number of steps of the path.
        turn : float [rad]
            Greatest rotation of an edge from one point of the path to the next.

        Returns
        -------
        Equilibrium
            Result, or an `EquilibriumPath` along a path.

        Raises
        ------
        ConvergenceError
            No equilibrium was found, or none exists (a free rod under gravity).
        ValueError
            A load that is a function of time, or a load factor or number of steps out of range.

        See Also
        --------
        step : Advance in time.
        linearise : Stiffness, masses and modes about the equilibrium.
        Equilibrium.gradient : Derivatives of the equilibrium.

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
        self._stepping.refuse_in_run("equilibrium")
        self._session.world.check_idle()
        if path is None:
            return self._stepping.equilibrium(stable)
        validation.choice(path, "path", ("arc_length",))
        functions = self._session.settings.functions
        return self._stepping.path(path_options(self._session.directory, functions, load, start, to, steps, turn))

    def run(
        self,
        duration: float,
        record_every: float | None = None,
        *,
        progress: bool = True,
        before_step: Callable[[Simulation], object] | None = None,
        until: Callable[[Simulation], object] | None = None,
        record: Mapping[str, Callable[[Simulation], npt.ArrayLike]] | None = None,
        differentiable: bool = False,
        longest_step: Callable[[Simulation], float] | None = None,
    ) -> Record:
        """Advance by a duration and record frames.

        Frames are recorded at the start, at every multiple of `record_every`, and at the end. Time steps are shortened
        evenly if `record_every` is not a multiple of the time step.

        Parameters
        ----------
        duration : float [s]
            Duration of the run.
        record_every : float [s]
            Interval of frames. By default a hundredth of the duration, rounded up to whole time steps.
        progress : bool
            True to show a progress bar on a terminal and in a notebook.
        before_step : callable
            Controller: called with the simulation once before every time step, not before inner steps.
        until : callable
            Called with the simulation after every time step. The run ends when it returns True.
        record : mapping of str to callable
            Further quantities to record. Each function is called with the simulation at every frame; its results are
            ``record[name]``.
        differentiable : bool
            True to keep the data for `Record.gradient`: 8 bytes per unknown and step.
        longest_step : callable
            Called with the simulation before every time step. Returns the maximum duration of this step [s].

        Returns
        -------
        Record
            The recorded frames, also available as `simulation.record`.

        Raises
        ------
        ConvergenceError, KeyboardInterrupt, or the exception of a callback
            The run ended early. `simulation.record` holds the frames until then.
        ValueError
            A duration, record_every or longest step that is not positive or too short, or a callback that cannot be
            called.
        RuntimeError
            Called by a callback of a run. Callbacks may read, set, hold and copy the simulation, but neither advance
            nor restore it.

        See Also
        --------
        step : Advance without a record.
        Record : The frames of the run.
        Record.gradient : Derivatives of a differentiable run.
        run_many : Run many simulations in processes or on a cluster.
        """
        self._stepping.refuse_in_run("run")
        loop = Run(
            self, self._stepping, duration, record_every, before_step, until, record, differentiable, longest_step
        )
        with progress_bar(loop.duration, "simulating", progress) as bar:
            loop.go(bar.update, lambda: False)
        return loop.record

    @property
    def record(self) -> Record:
        """Return the record of the last `run`, also if the run ended early.

        Raises
        ------
        RuntimeError
            The simulation has not run yet.

        See Also
        --------
        run : Make a record.
        """
        if self._stepping.recorder is None:
            raise RuntimeError("simulation has no record: call run first")
        return self._stepping.recorder.record

    # At a moment

    def linearise(self) -> Linearisation:
        """Linearise the equations of motion about the present configuration, with supports held.

        Returns
        -------
        Linearisation
            Tangent stiffness, masses, natural frequencies and modes. They are meaningful at an equilibrium.

        See Also
        --------
        equilibrium : Find the equilibrium to linearise about.
        step_jacobian : Derivatives of a time step by the state.

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
        return self._stepping.linearise()

    def __getitem__(self, name: str) -> Any:
        """Return the handle of a part, node or edge by its name."""
        return self._session.directory.handle(name)

    def __repr__(self) -> str:
        rods = ", ".join(rod.name for rod in self.rods)
        return f"Simulation(t = {self.time:g} s; rods {rods})"

    # State

    def snapshot(self) -> Snapshot:
        """Return the whole state. `restore` continues from it bit for bit.

        Returns
        -------
        Snapshot

        See Also
        --------
        restore : Return to the state.
        copy : Make a second simulation in this state.
        Snapshot.save : Write the state to a file.
        """
        session = self._session
        return Snapshot(session.world.snapshot(), session.world.time, session.settings.copy(), scene=session.scene)

    def restore(self, snapshot: Snapshot | Record, frame: int = -1) -> None:
        """Restore the state of a snapshot or of a frame of a record.

        Snapshots may come from another simulation of the same scene. A record holds the time, and positions,
        velocities, frames and spins of rods only. Supports must be where they were in the frame; loads, natural shapes,
        materials, and the history of contact and friction keep their present values. Joints take the orientation of
        least stress; angles of revolute joints are the nearest to the present ones.

        Parameters
        ----------
        snapshot : Snapshot or Record
            State to restore.
        frame : int
            Frame of a record. By default the last one.

        Raises
        ------
        ValueError
            A snapshot or record of another scene or a damaged one; a snapshot file that needs functions of time which
            this simulation does not have; or a record with supported nodes in other places.
        RuntimeError
            Called by a callback of `run`.

        See Also
        --------
        snapshot : Keep the present state.
        reset : Return to the state after `Scene.build`.
        """
        self._stepping.refuse_in_run("restore")
        if isinstance(snapshot, Record):
            restore_frame(self._session, snapshot, frame)
        elif isinstance(snapshot, Snapshot):
            restore(self._session, snapshot)
        else:
            raise ValueError(f"snapshot must be a withe.Snapshot or a withe.Record, got {type(snapshot).__name__}")
        self._stepping.frame_time = None
        self._session.restorations += 1

    def reset(self) -> None:
        """Restore the state after `Scene.build`, and undo every later change.

        Raises
        ------
        RuntimeError
            Called by a callback of `run`.

        See Also
        --------
        restore : Return to any snapshot.
        """
        self._stepping.refuse_in_run("reset")
        self.restore(self._initial)

    def copy(self) -> Simulation:
        """Return an independent simulation in the same state.

        Returns
        -------
        Simulation
            A change of one of the two does not affect the other.

        See Also
        --------
        snapshot : Keep the state of one simulation.
        Batch : Step many simulations in one call.
        """
        return Simulation._of(self._stepping.copy(), self._initial)

    def __copy__(self) -> Simulation:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        return self.copy()

    def __getstate__(self) -> dict[str, Any]:
        session = self._session
        return {
            "scene": session.scene,
            "gravity": session.gravity,
            "options": session.options,
            "snapshot": self.snapshot(),
            "functions": session.settings.functions,
            "paths": session.settings.paths,
            "frictions": session.settings.frictions,
            "longest_meant": session.longest_meant,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        built = Simulation._build(state["scene"], state["gravity"], state["options"])
        self.__dict__.update(built.__dict__)
        self._session.settings.functions = state["functions"]
        self._session.settings.paths = state["paths"]
        self._session.settings.frictions = state["frictions"]
        self._session.longest_meant = state["longest_meant"]
        self.restore(state["snapshot"])

    # Pictures

    def plot(self, **options: Any) -> Any:
        """Plot the present shape as a matplotlib figure.

        Parameters
        ----------
        **options
            Options of `withe.view.plot`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ValueError
            An option out of range.
        ImportError
            matplotlib is not installed.

        See Also
        --------
        withe.view.plot : All options, and what they raise.
        """
        return self._frame().plot(**options)

    def view(self, *, sliders: Sequence[Any] | None = None, live: bool = False, **options: Any) -> Any:
        """Show the scene in a notebook or a window: the present shape, with sliders, or during a run.

        Parameters
        ----------
        sliders : sequence of tuple, optional
            Parameters of `set` to be changed by hand. Each move of a slider sets the parameter, finds the equilibrium
            and draws it. A slider is

            * ``(part, word, low, high)`` for a number, such as ``(cord, "tension", 0, 5)``
            * ``(part, word, (low, high))`` for a vector, with one slider per component, such as
              ``(arm, "natural_curvature", (-10, 10))``: towards d1 and towards d2

            Both forms mean the same. The ends may be given per component: ``(arm, "natural_curvature", (0, -10),
            (0, 10))`` has a slider towards d2 only. A part is a handle, a name, a pair of bodies, or None for the
            scene. Parameters of rods have the same value along the whole rod.
        live : bool
            True to return a context in which `step` and `run` draw the scene, at most 30 times per second::

                with simulation.view(live=True):
                    simulation.run(2.0)

            A run in a window or notebook is not faster than real time. ``speed=0.1`` makes it ten times slower, and
            ``speed=math.inf`` as fast as it can be.
        **options
            size, color_by, camera, ground, backend (not with `live`): see `withe.view.view`. speed: see `live`.

        Returns
        -------
        SliderView, LiveView or widget
            With sliders, a view with ``values``, ``move``, ``image`` and ``picture``. The simulation has the state that
            is shown. A window blocks until you close it. With ``live``, the context; at its end a window stays until
            you close it. Otherwise the widget in a notebook, and None elsewhere.

        Raises
        ------
        ValueError
            A slider of another form, of a parameter that cannot be set, or whose low end is not below its high end.
            Both `sliders` and `live`, or an option out of range.
        ConvergenceError
            With sliders: the simulation has no equilibrium at the start. While a slider moves, no error is raised: the
            last equilibrium stays, with a text in the picture.
        ImportError
            PyVista is not installed.
        RuntimeError
            Rendering is not possible here, or a callback of `run` calls this method with sliders.

        Notes
        -----
        Without a display, a warning is given, and views with sliders and live views are drawn into memory only:
        ``image()`` returns the picture. In a notebook, sliders need trame, which ``pip install ".[view]"`` installs.

        Examples
        --------
        >>> simulation.view(sliders=[(cord, "tension", 0, 5), (arm, "natural_curvature", (-10, 10))])  # doctest: +SKIP
        """
        if validation.truth(live, "live"):
            if sliders is not None:
                raise ValueError("sliders and live must not be given together: sliders show equilibria")
            return LiveView(self._frame, self._stepping.watchers, lambda: self.time, **options)
        if sliders is None:
            return self._frame().view(**options)
        self._stepping.refuse_in_run("view(sliders=...)")
        return SliderView(EquilibriumSliders(self, sliders), **options).show()

    def picture(self, path: str | os.PathLike[str], **options: Any) -> FilePath:
        """Render the present shape into a .png file.

        Parameters
        ----------
        path : str or path
            File to write.
        **options
            Options of `withe.view.picture`.

        Returns
        -------
        pathlib.Path
            Path of the file.

        Raises
        ------
        ValueError
            An option out of range, or a path with another suffix.
        ImportError
            PyVista is not installed.
        OSError
            The picture cannot be written.

        See Also
        --------
        withe.view.picture : All options, and what they raise.
        plot : Figure by matplotlib, which needs no rendering.
        """
        return self._frame().picture(path, **options)

    def _frame(self) -> Record:
        directory = self._session.directory
        return present(self, *outlines_of(directory))
