"""A rod pushed along a plane with friction in PyElastica, without damping and callbacks."""

from __future__ import annotations

import time

import elastica
import numpy as np
from elastica.timestepper.symplectic_steppers import PositionVerlet
from rods_in_motion import steps_of

__all__ = ["PushRun"]

# Too small to limit the step. The rod does not sink: the plane supports any pressing force at every depth.
STIFFNESS = 100.0  # [N/m]
SLIP_TOLERANCE = 1e-3  # [m/s]


class _System(elastica.BaseSystemCollection, elastica.Forcing, elastica.Contact):
    """A system with gravity, the push, and contact."""


class PushRun:
    """One push of a straight rod that lies on a plane, from rest.

    Parameters
    ----------
    rod : dict
        `length`, `radius` [m], `density` [kg/m^3], `youngs_modulus` [Pa].
    elements : int
    friction : float
    gravity : float [m/s^2]
    force : float [N]
        In all, along the rod.
    duration, time_step : float [s]
        The step is shortened to fit the duration.
    """

    def __init__(
        self,
        rod: dict[str, float],
        elements: int,
        *,
        friction: float,
        gravity: float,
        force: float,
        duration: float,
        time_step: float,
    ) -> None:
        self._count = steps_of(duration, time_step)
        self._time_step = np.float64(duration / self._count)
        up, along = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
        self._system = _System()
        self.rod = elastica.CosseratRod.straight_rod(
            elements,
            start=rod["radius"] * up,
            direction=along,
            normal=up,
            base_length=rod["length"],
            base_radius=rod["radius"],
            density=rod["density"],
            youngs_modulus=rod["youngs_modulus"],
            shear_modulus=rod["youngs_modulus"] / 3.0,
        )
        plane = elastica.Plane(plane_origin=np.zeros(3), plane_normal=up)
        self._system.append(self.rod)
        self._system.append(plane)
        self._system.add_forcing_to(self.rod).using(elastica.GravityForces, acc_gravity=-gravity * up)
        self._system.add_forcing_to(self.rod).using(elastica.UniformForces, force=force, direction=along)
        self._system.detect_contact_between(self.rod, plane).using(
            elastica.RodPlaneContactWithAnisotropicFriction,
            k=STIFFNESS,
            nu=0.0,
            slip_velocity_tol=SLIP_TOLERANCE,
            static_mu_array=np.full(3, friction),
            kinetic_mu_array=np.full(3, friction),
        )
        self._system.finalize()
        self._stepper = PositionVerlet()

    def run(self) -> float:
        """Push to the end; processor time [s]."""
        start, now = time.thread_time(), np.float64(0.0)
        with np.errstate(all="ignore"):
            for _ in range(self._count):
                now = self._stepper.step(self._system, now, self._time_step)
        return time.thread_time() - start

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of the nodes [J]."""
        return float(0.5 * np.sum(self.rod.mass * self.rod.velocity_collection**2))
