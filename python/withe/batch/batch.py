"""Batches: many simulations of one shape, stepped in one call."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, SupportsIndex, SupportsInt, overload

import numpy as np
import numpy.typing as npt

from withe.batch.lanes import Lanes
from withe.batch.reading import Reading
from withe.batch.records import BatchRecord, Equilibria
from withe.batch.running import BatchRun
from withe.batch.setting import Setting
from withe.common import validation
from withe.common.attributes import known_attributes
from withe.common.keywords import keyword_hints
from withe.common.progress import progress as progress_bar
from withe.common.user_warnings import Cause, each_cause_once, located_at, user_place
from withe.errors import ConvergenceError
from withe.simulation.functions import force_function, step_callback
from withe.simulation.hands import forget_left_rings
from withe.simulation.readouts import Equilibrium
from withe.simulation.running import listed_simulations, thread_count
from withe.simulation.session import Session
from withe.simulation.simulation import Simulation
from withe.simulation.snapshots import Snapshot, adopt, check_fits, matched
from withe.simulation.stepping import convergence_error, pass_on, report_left

__all__ = ["Batch"]

_MAX_STEPS = 2**31 - 1


@keyword_hints
@known_attributes("use set, such as set(gravity=[(0, 0, -1.6)])")
class Batch(Setting, Reading):
    """Step many simulations of one shape in one call over threads, and read them into one array.

    Each simulation gives the same bits as alone, for any number of workers. ``batch[i]`` is a `Simulation`, which may
    be set, read, moved and clamped between steps. A simulation whose step does not converge has failed: it keeps its
    last accepted state and does not step until it is restored, reset or replaced. The other simulations continue.

    Methods and properties by purpose:

    * describe: `set`, for every parameter; old names are `set_natural_curvature`, `set_natural_twist` and
      `set_natural_stretch`
    * hold: `move`
    * run: `step`, `run`, `equilibrium`, `failed`, `failures`, `snapshot`, `restore`, `reset`, `copy`
    * read the batch: `lanes`, `workers`, `time`, `time_step`, `rods`, `get`, `energy`, `momentum`, `statistics`
    * read rods: `positions`, `velocities`, `directors`, `spins`, `curvatures`, `twists`, `tensions`
    * read bodies: `position`, `rotation`, `velocity`, `angular_velocity`
    * read parts: `reaction`, `wrench`, `joint_angle`, `joint_rate`, `joint_torque`, `spring_tension`,
      `tendon_length`, `tendon_points`, `obstacle_position`, `contacts`

    Parameters
    ----------
    simulations : iterable of Simulation
        Different simulations with equal rods, nodes, number of obstacles and time_step. Materials, radii, places of
        obstacles and solver options may differ. `Scene.build_batch` makes a batch of one scene.
    workers : int, optional
        Number of threads. By default one per processor.

    Raises
    ------
    ValueError
        No simulation, an object that is not a simulation, a simulation given twice or of another shape, or workers
        below 1.

    See Also
    --------
    Scene.build_batch : Make a batch of one scene.
    run_many : Run many simulations in processes or on a cluster.
    withe.learning.VectorEnvironment : A batch as an environment for reinforcement learning.

    Examples
    --------
    >>> import withe
    >>> batch = withe.Batch([scene.build(time_step=5e-3) for _ in range(3)], workers=2)
    >>> batch.set(arm, natural_curvature=[(0, 2.0), (0, 4.0), (0, 6.0)], over=0.1)
    >>> batch.step(20)
    >>> batch.positions(arm).shape
    (3, 31, 3)
    """

    def __init__(self, simulations: Iterable[Simulation], workers: int | None = None) -> None:
        self._lanes = Lanes(listed_simulations(simulations), thread_count(workers))

    # Simulations

    def __len__(self) -> int:
        return len(self._lanes)

    def __iter__(self) -> Iterator[Simulation]:
        return iter(self._lanes.simulations)

    @overload
    def __getitem__(self, index: int) -> Simulation: ...

    @overload
    def __getitem__(self, index: str) -> Any: ...

    def __getitem__(self, index: int | str) -> Any:
        """Return a simulation by its number, or the handle of a part, node or edge by its name."""
        if isinstance(index, str):
            return self._lanes.first[index]
        return self._lanes.simulations[index]

    def __setitem__(self, index: int, simulation: Simulation) -> None:
        """Replace a simulation by another one of the same shape."""
        size = len(self)
        number = validation.integer(index, "index", -size, size - 1) % size
        if not isinstance(simulation, Simulation):
            raise ValueError(f"simulation must be a withe.Simulation, got {type(simulation).__name__}")
        self._lanes.replace(number, simulation)

    @property
    def lanes(self) -> npt.NDArray[np.intc]:
        """Return the numbers of all simulations, shape (n,)."""
        return self._lanes.numbers

    @property
    def workers(self) -> int:
        """Return the number of threads."""
        return int(self._lanes.engine.workers)

    @property
    def time_step(self) -> float:
        """Return the time step that was given to `Scene.build` [s]."""
        return self._lanes.first.time_step

    def __repr__(self) -> str:
        rods = ", ".join(rod.name for rod in self.rods)
        return f"Batch({len(self)} simulations, {self.workers} workers; rods {rods})"

    # Stepping

    def step(self, count: int = 1, lanes: npt.ArrayLike | None = None) -> None:
        """Advance all or some simulations by `count` time steps. Failed simulations do not step.

        Custom forces and functions of time are called one at a time, because they hold the interpreter lock.

        Parameters
        ----------
        count : int
            Number of time steps.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to step. By default all.

        Raises
        ------
        ValueError
            `count` is negative or not a whole number, or a lane does not exist.
        KeyboardInterrupt, or the exception of a callback
            Every simulation is in its last accepted state; times may differ.
        RuntimeError
            Called by a callback, or while another thread runs one of them.

        See Also
        --------
        run : Advance by a duration and record frames.
        failed : Simulations whose step did not converge.

        Examples
        --------
        >>> batch = scene.build_batch(4)
        >>> batch.step(2, lanes=[0, 3])
        >>> batch.time
        array([0.01, 0.  , 0.  , 0.01])
        """
        numbers = self._lanes.chosen(lanes)
        steps = validation.integer(count, "number of steps", 0, _MAX_STEPS)
        self._lanes.refuse_in_run("step")
        self._lanes.forgive_restored()
        self._advance(numbers, steps)

    def _advance(self, numbers: npt.NDArray[np.intc], steps: int) -> None:
        functions: dict[SupportsInt | SupportsIndex, tuple[Any, Any]] = {
            int(numbers[place]): (step_callback(simulation._session), force_function(simulation._session))
            for place, simulation in self._lanes.each(numbers)
            if _calls_python(simulation._session)
        }
        try:
            self._lanes.engine.step(numbers, steps, functions)
        finally:
            self._lanes.note_failures()
            left = self._left_rings(int(number) for number in functions)
            pass_on([each._session for each in self._lanes.simulations], self._lanes.engine.take_warnings())
            if left:
                lane, name, time = left[0]
                more = f", and {len(left) - 1} more" if len(left) > 1 else ""
                report_left(f"ring {name!r} of simulation {lane} (time {time:.6g} s){more}: the ring was released")

    def run(
        self,
        duration: float,
        record_every: float | None = None,
        *,
        progress: bool = True,
        before_step: Callable[[Batch], object] | None = None,
        until: Callable[[Batch], npt.ArrayLike] | None = None,
        record: Mapping[str, Callable[[Batch], npt.ArrayLike]] | None = None,
        lanes: npt.ArrayLike | None = None,
    ) -> BatchRecord:
        """Advance all simulations by a duration and record frames.

        This works as `Simulation.run`, except that callbacks get the batch, and frames lie at whole time steps.

        Parameters
        ----------
        duration : float [s]
            Duration of the run, a whole number of time steps.
        record_every : float [s]
            Interval of frames, a whole number of time steps. By default a hundredth of the duration, rounded up.
        progress : bool
            True to show a progress bar on a terminal and in a notebook.
        before_step : callable
            Called with the batch once before every time step.
        until : callable
            Called with the batch after every time step. Returns one truth value for all, or shape (n,): the runs of
            these simulations end with a last frame.
        record : mapping of str to callable
            Further quantities to record. Each function is called with the batch at every frame and returns one row per
            simulation.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to run. By default all.

        Returns
        -------
        BatchRecord
            One `Record` per simulation, in the order of `lanes`, also available as `record` of the simulation. The
            record of a failed simulation ends with its last frame; see `failed`.

        Raises
        ------
        ValueError
            A time that is not a whole number of steps, or a callback that returns a wrong shape.
        KeyboardInterrupt, or the exception of a callback
            The run ended early. `record` of each simulation holds the frames until then.

        See Also
        --------
        step : Advance without records.
        BatchRecord : The records of all simulations.
        Simulation.run : Run one simulation.

        Examples
        --------
        >>> batch = scene.build_batch(3, time_step=5e-3)
        >>> run = batch.run(0.1, until=lambda b: b.positions(arm)[:, -1, 2] < -0.5, progress=False)
        >>> run.times.shape
        (3, 21)
        """
        numbers = self._lanes.chosen(lanes)
        self._lanes.refuse_in_run("run")
        self._lanes.forgive_restored()
        loop = BatchRun(self, self._lanes, numbers, duration, record_every, before_step, until, record)
        with progress_bar(loop.duration, "simulating", progress) as bar:
            loop.go(self._advance, bar.update)
        return loop.record

    def equilibrium(self, lanes: npt.ArrayLike | None = None, *, stable: bool = True) -> Equilibria:
        """Move every simulation to its static equilibrium. See `Simulation.equilibrium`.

        Parameters
        ----------
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to change. By default all.
        stable : bool
            False to allow unstable equilibria.

        Returns
        -------
        Equilibria
            Arrays with one entry per simulation, and the `Equilibrium` of each. A simulation without an equilibrium
            keeps its state; `failures` of the result holds the errors.

        Raises
        ------
        ValueError
            A lane that does not exist.
        RuntimeError
            Called by a callback of a run.

        See Also
        --------
        Simulation.equilibrium : How an equilibrium is found.
        Equilibria : Results of all simulations.

        Examples
        --------
        >>> batch = scene.build_batch(3, integrator="static")
        >>> batch.set(arm, youngs_modulus=[0.8e6, 1.0e6, 1.2e6])
        >>> batch.equilibrium().stable
        array([ True,  True,  True])
        """
        chosen = [simulation for _, simulation in self._lanes.each(self._lanes.chosen(lanes))]
        self._lanes.refuse_in_run("equilibrium")
        heard: set[Cause] = set()
        place = user_place()

        def find(simulation: Simulation) -> Equilibrium | ConvergenceError:
            with located_at(place), each_cause_once(heard):
                try:
                    return simulation.equilibrium(stable=stable)
                except ConvergenceError as error:
                    return error

        with ThreadPoolExecutor(max(1, min(self.workers, len(chosen))), thread_name_prefix="withe") as pool:
            found = list(pool.map(find, chosen))
        return Equilibria(
            tuple(each if isinstance(each, ConvergenceError) else None for each in found),
            tuple(each if isinstance(each, Equilibrium) else None for each in found),
        )

    def _left_rings(self, heard: Iterable[int]) -> list[tuple[int, str, float]]:
        """Return rings that the engine has released: simulation, name and time [s]. `heard`: simulations to ask."""
        lanes = set(heard)
        for lane, support, time in self._lanes.engine.take_left_rings():
            forget_left_rings(self[lane]._session, [(support, time)])
            lanes.add(lane)
        left = []
        for lane in sorted(lanes):
            session = self[lane]._session
            left += [(lane, *ring) for ring in session.left_rings]
            session.left_rings = []
        return left

    @property
    def failed(self) -> npt.NDArray[np.bool_]:
        """Return True for each simulation that has failed, shape (n,)."""
        self._lanes.forgive_restored()
        return self._lanes.engine.failed()

    @property
    def failures(self) -> tuple[ConvergenceError | None, ...]:
        """Return the error of each failed simulation, and None for the others."""
        found = (self._lanes.engine.failure(i) if failed else None for i, failed in enumerate(self.failed))
        return tuple(
            None if numbers is None else convergence_error(simulation._session, numbers)
            for simulation, numbers in zip(self, found, strict=True)
        )

    # State

    def snapshot(self, lanes: npt.ArrayLike | None = None) -> tuple[Snapshot, ...]:
        """Return the whole state of each simulation. `restore` continues from it bit for bit.

        Parameters
        ----------
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to read. By default all.

        Returns
        -------
        tuple of Snapshot
            One snapshot per chosen simulation.

        Raises
        ------
        ValueError
            A lane that does not exist.

        See Also
        --------
        restore : Return to the states.
        """
        return tuple(simulation.snapshot() for _, simulation in self._lanes.each(self._lanes.chosen(lanes)))

    def restore(self, snapshots: Snapshot | Sequence[Snapshot], lanes: npt.ArrayLike | None = None) -> None:
        """Restore the states of snapshots. Failed simulations can step again.

        Parameters
        ----------
        snapshots : Snapshot or sequence of Snapshot
            One snapshot per simulation, or one for all.
        lanes : array_like of shape (n,), bool, or of numbers, optional
            Simulations to restore. By default all.

        Raises
        ------
        ValueError
            The number of snapshots differs from the number of simulations, or see `Simulation.restore`. Then no
            simulation is changed.
        RuntimeError
            Called by a callback of a run.

        See Also
        --------
        snapshot : Keep the present states.
        reset : Return to the states after `Scene.build`.

        Examples
        --------
        >>> batch = scene.build_batch(2)
        >>> before = batch.snapshot()
        >>> batch.step(5)
        >>> batch.restore(before)
        """
        numbers = self._lanes.chosen(lanes)
        given = [snapshots] * len(numbers) if isinstance(snapshots, Snapshot) else list(snapshots)
        for index, snapshot in enumerate(given):
            if not isinstance(snapshot, Snapshot):
                raise ValueError(f"snapshots must be withe.Snapshot, got {type(snapshot).__name__} at [{index}]")
        if len(given) != len(numbers):
            raise ValueError(f"snapshots must be one for each of {len(numbers)} simulations, got {len(given)}")
        self._lanes.refuse_in_run("restore")
        chosen = [simulation for _, simulation in self._lanes.each(numbers)]
        settings = [matched(each._session, snapshot) for each, snapshot in zip(chosen, given, strict=True)]
        for each, snapshot in zip(chosen, given, strict=True):
            check_fits(each._session, snapshot)
        self._lanes.engine.restore(numbers, [snapshot._state for snapshot in given])
        for simulation, own in zip(chosen, settings, strict=True):
            adopt(simulation._session, own)
            simulation._stepping.frame_time = None

    def reset(self, mask: npt.ArrayLike | None = None) -> None:
        """Restore the states after `Scene.build`, and undo every later change.

        Parameters
        ----------
        mask : array_like of shape (n,), bool, or of numbers, optional
            Simulations to reset. By default all.

        Raises
        ------
        ValueError
            A mask of another length.
        RuntimeError
            Called by a callback of a run.

        See Also
        --------
        restore : Return to any snapshots.

        Examples
        --------
        >>> batch = scene.build_batch(3)
        >>> batch.step(2)
        >>> batch.reset([True, False, False])
        >>> batch.time
        array([0.  , 0.01, 0.01])
        """
        numbers = self._lanes.chosen(mask, "mask")
        self.restore([simulation._initial for _, simulation in self._lanes.each(numbers)], numbers)

    def copy(self) -> Batch:
        """Return an independent batch in the same state, in which failed simulations can step again.

        Returns
        -------
        Batch
            A change of one of the two does not affect the other.
        """
        return Batch([simulation.copy() for simulation in self], self.workers)

    def __copy__(self) -> Batch:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Batch:
        return self.copy()

    def __reduce__(self) -> tuple[type[Batch], tuple[list[Simulation], int]]:
        return Batch, (list(self), self.workers)


def _calls_python(session: Session) -> bool:
    settings = session.settings
    return bool(settings.functions or settings.paths or settings.friction_fields or session.custom_forces)
