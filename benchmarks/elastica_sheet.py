"""A sheet of paper folded in PyElastica by the poses of a file: its own rod, plane and friction.

The sheet is a rod with the bending stiffness and the weight of the sheet. Two changes allow longer steps, and neither
matters to so slow a motion. The rod stretches and shears a hundred times as easily as paper, which is still hardly at
all. The rotary inertia of its elements is that of thin square plates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import elastica
import numpy as np
from elastica.timestepper.symplectic_steppers import PositionVerlet
from numba import njit
from rods_in_motion import steps_of

__all__ = ["SheetRun", "Strip"]

CONTACT_STIFFNESS = 1.0  # [N/m]; the plane supports any pressing force at every depth
CONTACT_DAMPING = 1e-3  # [kg/s]
FILTER_ORDER = 5  # order of the low-pass filter of velocities
POSES_APART = 5e-3  # [s]
ROUND = 5e-3  # radius of a rod before it gets the stiffness of a sheet [m]; thinner rods are refused


class _System(
    elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Contact, elastica.Damping
):
    """A system with the jaw, gravity, the table, and damping of oscillations."""


@dataclass(frozen=True)
class Strip:
    """A sheet, seen from its side.

    Attributes
    ----------
    length, thickness : float [m]
    bend_stiffness, stretch_stiffness : float [N m^2], [N]
    line_density : float [kg/m]
    friction : float
    """

    length: float
    thickness: float
    bend_stiffness: float
    stretch_stiffness: float
    line_density: float
    friction: float


@njit(cache=True)
def _put_jaw(positions, directors, velocities, turning, table, spacing, time, held, along_rod, up):
    """Poses and rates of the elements that the jaw holds, from rows x, z, angle at even times, by Hermite's cubics."""
    last = len(table) - 2
    i = min(max(int(time / spacing), 0), last)
    u = min(max(time / spacing - i, 0.0), 1.0)
    before, after = table[max(i - 1, 0)], table[min(i + 2, last + 1)]
    at, rate = np.empty(3), np.empty(3)
    for k in range(3):
        p, q = table[i, k], table[i + 1, k]
        m, n = 0.5 * (q - before[k]), 0.5 * (after[k] - p)
        at[k] = p + u * (m + u * (3.0 * (q - p) - 2.0 * m - n + u * (m + n - 2.0 * (q - p))))
        rate[k] = (m + u * (2.0 * (3.0 * (q - p) - 2.0 * m - n) + u * 3.0 * (m + n - 2.0 * (q - p)))) / spacing
    cosine, sine = np.cos(at[2]), np.sin(at[2])
    for i in range(held + 1):
        s = along_rod[i]
        positions[0, i], positions[1, i], positions[2, i] = at[0] + s * cosine, 0.0, at[1] + up - s * sine
        velocities[0, i], velocities[1, i] = rate[0] - s * sine * rate[2], 0.0
        velocities[2, i] = rate[1] - s * cosine * rate[2]
    for i in range(held):
        directors[:, :, i] = np.array([[sine, 0.0, cosine], [0.0, 1.0, 0.0], [cosine, 0.0, -sine]])
        turning[0, i], turning[1, i], turning[2, i] = 0.0, rate[2], 0.0


class _Jaw(elastica.ConstraintBase):
    """The first elements are where a motion has them: rows of x, z, angle of the first node, evenly in time."""

    def __init__(self, table: np.ndarray, spacing: float, held: int, offset: float, **keywords: object) -> None:
        super().__init__(**keywords)
        rod = self._system
        places = np.concatenate([[0.0], np.cumsum(rod.rest_lengths[:held])])
        self._given = (table, spacing), (held, places, offset)
        shape = held + 1
        self._scratch = [np.zeros((3, shape)), np.zeros((3, 3, held)), np.zeros((3, shape)), np.zeros((3, held))]
        self._held = held

    def _at(self, time: float) -> list[np.ndarray]:
        (table, spacing), (held, places, offset) = self._given
        _put_jaw(*self._scratch, table, spacing, float(time), held, places, offset)
        return self._scratch

    def constrain_values(self, system: elastica.CosseratRod, time: np.float64) -> None:
        """Set the position of the jaw."""
        positions, directors, _, _ = self._at(time)
        system.position_collection[:, : self._held + 1] = positions
        system.director_collection[:, :, : self._held] = directors

    def constrain_rates(self, system: elastica.CosseratRod, time: np.float64) -> None:
        """Set the velocity of the jaw."""
        _, _, velocities, turning = self._at(time)
        system.velocity_collection[:, : self._held + 1] = velocities
        system.omega_collection[:, : self._held] = turning


class SheetRun:
    """One fold from the flat sheet.

    Parameters
    ----------
    strip : Strip
    motion : ndarray of shape (n, 4)
        Time [s], x, z [m] and angle [rad] of the edge that the jaw holds, from the flat sheet on.
    depth : float [m]
        Of the sheet in the jaw; a whole number of elements of about the others' size.
    elements : int
    time_step : float [s]
    slip_tolerance : float [m/s]
        Of friction.
    softness : float
        By which the sheet stretches more easily than it does.
    """

    def __init__(
        self,
        strip: Strip,
        motion: np.ndarray,
        depth: float,
        *,
        elements: int = 40,
        time_step: float = 2e-5,
        slip_tolerance: float = 2e-5,
        softness: float = 100.0,
    ) -> None:
        duration = float(motion[-1, 0])
        self._count = steps_of(duration, time_step)
        self._time_step = np.float64(duration / self._count)
        held = max(1, round(elements * depth / strip.length))
        places = np.concatenate(
            [np.linspace(0.0, depth, held + 1), np.linspace(depth, strip.length, elements - held + 1)[1:]]
        )
        radius = 0.5 * strip.thickness
        points = np.stack([places, np.zeros_like(places), np.full_like(places, radius)])
        self._system = _System()
        self.rod = elastica.CosseratRod.straight_rod(
            elements,
            start=points[:, 0],
            direction=np.array([1.0, 0.0, 0.0]),
            normal=np.array([0.0, 0.0, 1.0]),
            base_length=strip.length,
            base_radius=ROUND,
            density=strip.line_density / (np.pi * ROUND**2),
            youngs_modulus=1e6,
            shear_modulus=1e6,
            position=points,
        )
        self._give_stiffness(strip, softness)
        plane = elastica.Plane(plane_origin=np.zeros(3), plane_normal=np.array([0.0, 0.0, 1.0]))
        system = self._system
        system.append(self.rod)
        system.append(plane)
        even = np.linspace(0.0, duration, round(duration / POSES_APART) + 1)
        table = np.stack([np.interp(even, motion[:, 0], motion[:, i]) for i in (1, 2, 3)], axis=1)
        system.constrain(self.rod).using(_Jaw, table=table, spacing=even[1], held=held, offset=radius)
        system.add_forcing_to(self.rod).using(elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -9.81]))
        system.detect_contact_between(self.rod, plane).using(
            elastica.RodPlaneContactWithAnisotropicFriction,
            k=CONTACT_STIFFNESS,
            nu=CONTACT_DAMPING,
            slip_velocity_tol=slip_tolerance,
            static_mu_array=np.full(3, strip.friction),
            kinetic_mu_array=np.full(3, strip.friction),
        )
        system.dampen(self.rod).using(elastica.LaplaceDissipationFilter, filter_order=FILTER_ORDER)
        system.finalize()
        self._stepper = PositionVerlet()

    def _give_stiffness(self, strip: Strip, softness: float) -> None:
        rod = self.rod
        stretch, bend = strip.stretch_stiffness / softness, strip.bend_stiffness
        rod.shear_matrix[:] = 0.0
        rod.bend_matrix[:] = 0.0
        for i in range(3):
            rod.shear_matrix[i, i, :] = stretch
            rod.bend_matrix[i, i, :] = bend
        lengths = rod.rest_lengths
        rod.volume[:] = np.pi * (0.5 * strip.thickness) ** 2 * lengths
        inertia = strip.line_density * lengths * lengths**2 / 3.0
        rod.mass_second_moment_of_inertia[:] = 0.0
        rod.inv_mass_second_moment_of_inertia[:] = 0.0
        for i in range(3):
            rod.mass_second_moment_of_inertia[i, i, :] = inertia
            rod.inv_mass_second_moment_of_inertia[i, i, :] = 1.0 / inertia

    def frames(self, count: int = 100) -> Iterator[tuple[float, np.ndarray]]:
        """Fold. Return times [s] and positions of the nodes [m], shape (nodes, 3), at some moments."""
        now = np.float64(0.0)
        stops = np.linspace(0, self._count, count + 1).astype(int)
        for first, last in pairwise(stops):
            for _ in range(last - first):
                now = self._stepper.step(self._system, now, self._time_step)
            yield float(now), self.rod.position_collection.T.copy()
