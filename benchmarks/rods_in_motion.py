"""The beams and helices of table 6.1 of A. Choi's dissertation, for our engine: scenes, runs, the motion of the tip.

A beam starts straight with the velocity of its first mode and vibrates; a helix is let go in its natural shape and
falls into its weight. Nothing damps them.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

import withe

__all__ = ["CASES", "INTEGRATORS", "Case", "Motion", "centreline", "integrators", "record", "run_time", "simulation"]

FloatArray = npt.NDArray[np.float64]

INTEGRATORS = ("implicit_midpoint", "fourth_order", "energy_momentum", "backward_euler", "verlet")

# A wave number times length of a clamped beam's first mode, and the mode's ratio of the two families of terms.
_BETA = 1.8751040687119611
_SIGMA = (math.sinh(_BETA) - math.sin(_BETA)) / (math.cosh(_BETA) + math.cos(_BETA))


@dataclass(frozen=True)
class Case:
    """One column of the table.

    Attributes
    ----------
    name : str
    kind : {"beam", "helix"}
    youngs_modulus : float [Pa]
    radius : float [m]
    density : float [kg/m^3]
    length : float [m]
        Along the centreline.
    duration : float [s]
        Over which errors are measured.
    whole : float [s]
        As the source ran it.
    edges, time_step, elastica_step
        The source's own choice; steps in s.
    marks : tuple of float
        Errors at which times are compared, relative to the motion's RMS.
    """

    name: str
    kind: str
    youngs_modulus: float
    radius: float
    density: float
    length: float
    duration: float
    whole: float
    edges: int
    time_step: float
    elastica_step: float
    marks: tuple[float, ...]

    @property
    def gravity(self) -> float:
        """Downwards [m/s^2]."""
        return 9.8 if self.kind == "helix" else 0.0


_BEAM = (3e-2, 1e-2, 1e-3)
_HELIX = (1e-1, 3e-2, 1e-2)
CASES = {
    case.name: case
    for case in (
        Case("beam a", "beam", 1e5, 0.02, 500.0, 1.0, 100.0, 100.0, 200, 0.5, 2.5e-4, _BEAM),
        Case("beam b", "beam", 1e7, 0.02, 500.0, 1.0, 20.0, 20.0, 200, 0.05, 3e-5, _BEAM),
        Case("helix a", "helix", 1e7, 5e-3, 1273.52, 0.5, 1.0, 10.0, 99, 6e-3, 4e-5, _HELIX),
        Case("helix b", "helix", 1e9, 1e-3, 1273.52, 0.5, 0.5, 2.0, 99, 3e-3, 1e-6, _HELIX),
    )
}


def centreline(case: Case, s: FloatArray) -> FloatArray:
    """Points at arc lengths s [m] from the wall, shape (n, 3) [m]; s may be negative, behind the wall."""
    if case.kind == "beam":
        return np.column_stack([s, 0 * s, 0 * s])
    radius, rise = 0.02, 0.05 / (2 * math.pi)
    turn = s / math.hypot(radius, rise)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), -rise * turn])


def first_mode(case: Case, s: FloatArray) -> FloatArray:
    """Velocities along z that start the beam, 5 mm/s at the tip, zero behind the wall [m/s]."""

    def shape(x: FloatArray) -> FloatArray:
        return np.cosh(x) - np.cos(x) - _SIGMA * (np.sinh(x) - np.sin(x))

    x = _BETA * np.maximum(s, 0.0) / case.length
    return 5e-3 * shape(x) / shape(np.array(_BETA))


def simulation(case: Case, edges: int, **options: object) -> withe.Simulation:
    """A case ready to run, clamped at its wall."""
    scene = withe.Scene(gravity=(0.0, 0.0, -case.gravity))
    material = withe.Material(youngs_modulus=case.youngs_modulus, poisson_ratio=0.5, density=case.density)
    s = np.linspace(0.0, case.length, edges + 1)
    beam = case.kind == "beam"
    fine = np.linspace(0.0, case.length, edges * (1 if beam else 200) + 1)
    rod = scene.add_rod(
        points=centreline(case, fine),
        nodes=edges + 1,
        radius=case.radius,
        material=material,
        normal=(0, 0, 1) if beam else None,
    )
    scene.clamp(rod.start)
    if beam:
        options.setdefault("planar", True)
    built = scene.build(**options)
    if beam:
        built.set_velocities(rod, np.column_stack([0 * s, 0 * s, first_mode(case, s)]))
    return built


def integrators() -> tuple[str, ...]:
    """Return the integrators of `INTEGRATORS` that this version has."""
    found = []
    for name in INTEGRATORS:
        try:
            simulation(CASES["beam a"], 4, integrator=name, time_step=1e-3)
        except ValueError:
            continue
        found.append(name)
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the tip.

    Attributes
    ----------
    times : ndarray of shape (frames,) [s]
    tip : ndarray of shape (frames, 3) [m]
    """

    times: FloatArray
    tip: FloatArray

    @property
    def size(self) -> float:
        """RMS distance of the tip from its mean [m]."""
        return float(np.sqrt(np.mean(np.sum((self.tip - self.tip.mean(axis=0)) ** 2, axis=1))))

    def error(self, limit: Motion) -> float:
        """RMS over time of the distance from a limit, over the size of the limit's motion."""
        if not np.all(np.isfinite(self.tip)):
            return math.inf
        inside = self.times <= limit.times[-1] * (1 + 1e-9)
        wanted = CubicSpline(limit.times, limit.tip)(np.minimum(self.times[inside], limit.times[-1]))
        apart = np.sum((self.tip[inside] - wanted) ** 2, axis=1)
        return float(np.sqrt(np.mean(apart))) / limit.size


def steps_of(duration: float, time_step: float) -> int:
    """Whole steps that fit a duration best, at least one."""
    return max(1, round(duration / time_step))


def record(case: Case, edges: int, duration: float, *, frames: int = 500, **options: object) -> Motion:
    """Run a case and note where its tip is, at whole steps."""
    count = steps_of(duration, float(options["time_step"]))
    options["time_step"] = duration / count
    built = simulation(case, edges, **options)
    stride = max(1, count // frames)
    tips, times = [built.positions()[-1]], [0.0]
    for done in range(0, count, stride):
        built.step(min(stride, count - done))
        tips.append(built.positions()[-1])
        times.append(built.time)
    return Motion(np.array(times), np.array(tips))


def run_time(case: Case, edges: int, duration: float, *, limit: float = math.inf, **options: object) -> float:
    """Processor time of a run without recording, build left out [s]; beyond `limit`, scaled from its first part."""
    count = steps_of(duration, float(options["time_step"]))
    options["time_step"] = duration / count
    built = simulation(case, edges, **options)
    built.step(1)
    built.reset()
    if case.kind == "beam":
        s = np.linspace(0.0, case.length, edges + 1)
        built.set_velocities(built.rods[0], np.column_stack([0 * s, 0 * s, first_mode(case, s)]))
    start, done, chunk = time.thread_time(), 0, count if limit == math.inf else max(1, count // 64)
    while done < count and (done == 0 or time.thread_time() - start < limit):
        now = min(chunk, count - done)
        built.step(now)
        done += now
    return (time.thread_time() - start) * count / done
