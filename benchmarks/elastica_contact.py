"""A knot without friction in PyElastica: its rod-on-itself contact, ends held and pulled apart."""

from __future__ import annotations

import time

import elastica
import numpy as np
from elastica.timestepper.symplectic_steppers import PositionVerlet
from elastica_rods import frames_along

__all__ = ["KnotRun", "largest_stable_step"]


class _System(elastica.BaseSystemCollection, elastica.Constraints, elastica.Contact):
    """A system with grips and contact."""


class _Grips(elastica.ConstraintBase):
    """Both end elements go apart along a line at a speed [m/s], without turning."""

    def __init__(self, velocity: np.ndarray, **keywords: object) -> None:
        super().__init__(**keywords)
        rod = self._system
        self._ends = [(slice(0, 2), slice(0, 1), -velocity), (slice(-2, None), slice(-1, None), velocity)]
        self._at = [rod.position_collection[:, nodes].copy() for nodes, _, _ in self._ends]
        self._turned = [rod.director_collection[:, :, element].copy() for _, element, _ in self._ends]

    def constrain_values(self, system: elastica.CosseratRod, time: np.float64) -> None:
        """Set the positions of the grips."""
        for (nodes, element, velocity), at, turned in zip(self._ends, self._at, self._turned, strict=True):
            system.position_collection[:, nodes] = at + time * velocity[:, None]
            system.director_collection[:, :, element] = turned

    def constrain_rates(self, system: elastica.CosseratRod, time: np.float64) -> None:
        """Set the velocities of the grips."""
        for nodes, element, velocity in self._ends:
            system.velocity_collection[:, nodes] = velocity[:, None]
            system.omega_collection[:, element] = 0.0


class KnotRun:
    """A rod drawn as a knot, straight by nature, pulled at its ends.

    Parameters
    ----------
    points : ndarray of shape (nodes, 3) [m]
    radius, youngs_modulus, density : float [m], [Pa], [kg/m^3]
    stiffness : float [N/m]
        Of contact.
    speed : float [m/s]
        Of each grip.
    time_step : float [s]
    """

    def __init__(
        self,
        points: np.ndarray,
        radius: float,
        youngs_modulus: float,
        density: float,
        stiffness: float,
        speed: float,
        time_step: float,
    ) -> None:
        edges = np.diff(points, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        frames = frames_along(edges / lengths[:, None])
        self._system = _System()
        self.rod = elastica.CosseratRod.straight_rod(
            len(edges),
            start=points[0],
            direction=frames[2, :, 0],
            normal=frames[0, :, 0],
            base_length=float(lengths.sum()),
            base_radius=radius,
            density=density,
            youngs_modulus=youngs_modulus,
            shear_modulus=youngs_modulus / 3.0,
            position=np.ascontiguousarray(points.T),
            directors=frames,
        )
        self._system.append(self.rod)
        along = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
        self._system.constrain(self.rod).using(_Grips, velocity=speed * along)
        self._system.detect_contact_between(self.rod, self.rod).using(elastica.RodSelfContact, k=stiffness, nu=0.0)
        self._system.finalize()
        self._stepper = PositionVerlet()
        self._time, self._time_step = np.float64(0.0), np.float64(time_step)

    def seconds_per_step(self, steps: int) -> float:
        """Processor time of a step [s]."""
        start = time.thread_time()
        for _ in range(steps):
            self._time = self._stepper.step(self._system, self._time, self._time_step)
        return (time.thread_time() - start) / steps

    def sound(self) -> bool:
        """True if the run has not diverged: no edge has doubled or halved its length."""
        with np.errstate(all="ignore"):
            stretch = self.rod.lengths / self.rod.rest_lengths
        return bool(np.all(np.abs(stretch - 1.25) < 0.75))


def largest_stable_step(run: dict, first: float, duration: float, parts: int = 10) -> float:
    """Return the largest stable step [s], to a fifth. `run`: arguments of `KnotRun` without the step."""
    step = first
    while step > 1e-9:
        one = KnotRun(**run, time_step=step)
        with np.errstate(all="ignore"):
            for _ in range(parts):
                one.seconds_per_step(round(duration / parts / step))
                if not one.sound():
                    break
            else:
                return step
        step *= 0.8
    raise RuntimeError("no stable step of PyElastica found for the knot")
