"""The same beams and helices in PyElastica, set up as its documentation says, without damping and callbacks.

There are two clamps. PyElastica's own clamp holds the first element, and so shortens the rod by half an element. The
other clamp moves the wall to the middle of that element, by a first node half an element behind it.
"""

from __future__ import annotations

import math
import time

import elastica
import numpy as np
from elastica.timestepper.symplectic_steppers import PositionVerlet
from rods_in_motion import Case, Motion, centreline, first_mode, steps_of

__all__ = ["ElasticaRun", "frames_along", "largest_stable_step", "version"]


class _System(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing):
    """A system with clamps and gravity."""


def version() -> str:
    """Versions of PyElastica and numba."""
    from importlib.metadata import version as of

    return f"PyElastica {of('pyelastica')}, numba {of('numba')}"


def frames_along(tangents: np.ndarray) -> np.ndarray:
    """Frames (3, 3, elements) without twist: the first director is carried along by parallel transport."""
    normal = np.cross(tangents[0], (0.0, 1.0, 0.0))
    normal /= np.linalg.norm(normal)
    frames = np.empty((3, 3, len(tangents)))
    before = tangents[0]
    for i, t in enumerate(tangents):
        axis = np.cross(before, t)
        normal = normal + np.cross(axis, normal) + np.cross(axis, np.cross(axis, normal)) / (1.0 + before @ t)
        normal -= t * (t @ normal)
        normal /= np.linalg.norm(normal)
        frames[0, :, i], frames[1, :, i], frames[2, :, i] = normal, np.cross(t, normal), t
        before = t
    return frames


class ElasticaRun:
    """One run, in parts of any number of steps.

    Parameters
    ----------
    case : Case
    elements : int
    duration, time_step : float [s]
        The step is shortened to fit the duration.
    moved_wall : bool
        Whether the wall is half an element further out, where a clamped first element puts it.
    """

    def __init__(self, case: Case, elements: int, duration: float, time_step: float, *, moved_wall: bool) -> None:
        self.count = steps_of(duration, time_step)
        self._time_step = np.float64(duration / self.count)
        self._time = np.float64(0.0)
        edge = case.length / (elements - 0.5 if moved_wall else elements)
        s = case.length - edge * np.arange(elements, -1, -1)
        points = centreline(case, s)
        tangents = np.diff(points, axis=0)
        tangents /= np.linalg.norm(tangents, axis=1)[:, None]
        frames = frames_along(tangents)
        self._system = _System()
        self.rod = elastica.CosseratRod.straight_rod(
            elements,
            start=points[0],
            direction=tangents[0],
            normal=frames[0, :, 0],
            base_length=elements * edge,
            base_radius=case.radius,
            density=case.density,
            youngs_modulus=case.youngs_modulus,
            shear_modulus=case.youngs_modulus / 3.0,
            position=np.ascontiguousarray(points.T),
            directors=frames,
        )
        self._start(case, s, points, frames)
        self._system.append(self.rod)
        self._system.constrain(self.rod).using(
            elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        if case.gravity:
            self._system.add_forcing_to(self.rod).using(
                elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -case.gravity])
            )
        self._system.finalize()
        self._stepper = PositionVerlet()

    def _start(self, case: Case, s: np.ndarray, points: np.ndarray, frames: np.ndarray) -> None:
        """Stress-free as built; a beam moves, its elements turning with their edges."""
        rod = self.rod
        rod.compute_internal_forces_and_torques(0.0)
        rod.rest_kappa[:] = rod.kappa
        rod.rest_sigma[:] = rod.sigma
        if case.kind == "beam":
            velocity = first_mode(case, s)
            rod.velocity_collection[2] = velocity
            slope = np.diff(velocity) / np.diff(points[:, 0])
            rod.omega_collection[:] = np.einsum("ijk,j->ik", frames, np.array([0.0, -1.0, 0.0])) * slope

    def step(self, count: int) -> None:
        """Take `steps` steps."""
        step, system, now, time_step = self._stepper.step, self._system, self._time, self._time_step
        for _ in range(count):
            now = step(system, now, time_step)
        self._time = now

    @property
    def tip(self) -> np.ndarray:
        """Position of the last node [m]."""
        return self.rod.position_collection[:, -1].copy()

    def record(self, frames: int = 500) -> Motion | None:
        """Run to the end and note where the tip is; None when it blows up."""
        stride = max(1, self.count // frames)
        tips, times = [self.tip], [0.0]
        reach = 10.0 * np.abs(self.rod.position_collection).max()
        for done in range(0, self.count, stride):
            self.step(min(stride, self.count - done))
            tips.append(self.tip)
            times.append(float(self._time))
            if not np.abs(tips[-1]).max() < reach:
                return None
        return Motion(np.array(times), np.array(tips))

    def time_per_step(self, seconds: float) -> float:
        """Return the processor time of a step [s], over steps of about this total time, or over the whole run."""
        start, done = time.thread_time(), 0
        while done < self.count and time.thread_time() - start < seconds:
            now = min(500, self.count - done)
            self.step(now)
            done += now
        return (time.thread_time() - start) / done


def largest_stable_step(case: Case, elements: int, *, moved_wall: bool, steps: int = 4000) -> float:
    """Largest step [s] that survives so many steps, to 7 %.

    Searched down from the time that a sound wave takes along an element, and from the fastest turning of an element.
    """
    edge = case.length / elements
    speed = math.sqrt(case.youngs_modulus / case.density)
    step = 1.2 * min(edge / speed, 4.0 * case.radius / speed)
    while step > 1e-9:
        run = ElasticaRun(case, elements, step * steps, step, moved_wall=moved_wall)
        with np.errstate(all="ignore"):
            if run.record(40) is not None:
                return step
        step *= 0.93
    raise RuntimeError(f"no stable step of PyElastica found for {case.name} with {elements} elements")
