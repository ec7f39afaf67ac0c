"""A cable laid down by a moving jaw on a floor, in the rod engine: told of a motion, not of how it was planned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from withe.deployment.cable import Cable
from withe.parts.materials import Material
from withe.recording import Record
from withe.scene import Scene

__all__ = ["Motion", "Setup", "lay"]

FloatArray = npt.NDArray[np.float64]
_DENSITY, _VISCOUS_TIME, _GRAVITY = 1180.0, 0.02, 9.81  # [kg/m^3], [s], [m/s^2]
_SETTLING = 2.0  # [s] after the jaw has opened
_RECORD_EVERY = 0.1  # [s]


class Motion(Protocol):
    """What the world is told: where a jaw holds the end of a cable, when."""

    @property
    def times(self) -> FloatArray:
        """Shape (n,) [s]."""

    @property
    def positions(self) -> FloatArray:
        """Shape (n, 3) [m]."""

    @property
    def rotations(self) -> FloatArray:
        """Quaternions (x, y, z, w), shape (n, 4)."""


@dataclass(frozen=True)
class Setup:
    """What is there: the cable up to the jaw, the floor, and what is not as it should be."""

    cable: Cable
    friction: float
    nodes: int = 200
    time_step: float = 0.01  # [s]
    natural_curvature: tuple[float, float] = (0.0, 0.0)  # [1/m]
    jaw_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m]
    jaw_turn: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [rad], a rotation vector


def lay(setup: Setup, motion: Motion, *, progress: bool) -> tuple[FloatArray, FloatArray, Record]:
    """Simulate the whole motion of a jaw: a rod in space with thickness, torsion and inertia, on a rough floor.

    Returns
    -------
    held, laid : ndarray of shape (nodes, 3) [m]
        The centreline from the free end, when the jaw opens and after the cable has come to rest.
    record : Record
        Of the motion, every tenth of a second.
    """
    scene, cable = _scene(setup, motion.positions[0])
    simulation = scene.build(integrator="backward_euler", time_step=setup.time_step, planar=False)
    if any(setup.natural_curvature):
        simulation.set_natural_curvature(cable, setup.natural_curvature)
        simulation.equilibrium()
    simulation.move(cable.end, path=_path(setup, motion))
    record = simulation.run(float(motion.times[-1]), record_every=_RECORD_EVERY, progress=progress)
    held = simulation.positions(cable)
    simulation.release(cable.end)
    simulation.run(_SETTLING, progress=False)
    return held, simulation.positions(cable), record


def _scene(setup: Setup, jaw: FloatArray) -> tuple[Scene, Any]:
    cable = setup.cable
    weight = _DENSITY * np.pi * cable.radius**2 * _GRAVITY
    bend = 2.0 * weight * cable.gravito_bending_length**3
    modulus = 4.0 * bend / (np.pi * cable.radius**4)
    material = Material(youngs_modulus=modulus, poisson_ratio=0.5, density=_DENSITY, viscosity=_VISCOUS_TIME * modulus)
    scene = Scene(gravity=(0.0, 0.0, -_GRAVITY))
    start = jaw - [0.0, 0.0, cable.length]
    rod = scene.add_rod(start=start, end=jaw, nodes=setup.nodes, radius=cable.radius, material=material, name="cable")
    scene.clamp(rod.end)
    scene.add_floor(friction=setup.friction)
    scene.enable_contact(friction=setup.friction)
    return scene, rod


def _path(setup: Setup, motion: Motion) -> Any:
    """Position and rotation of the jaw by time, relative to the first one."""
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation

    where, turned = CubicSpline(motion.times, motion.positions), CubicSpline(motion.times, motion.rotations)
    first = Rotation.from_quat(motion.rotations[0]).inv()
    offset, turn = np.array(setup.jaw_offset), Rotation.from_rotvec(setup.jaw_turn)

    def at(time: float) -> tuple[FloatArray, Any]:
        time = float(np.clip(time, motion.times[0], motion.times[-1]))
        rise = min(1.0, time)  # [s]: what is wrong comes in smoothly
        place = where(time) + rise * offset
        place[2] = max(place[2], setup.cable.radius)  # the floor stops the jaw
        return place, turn**rise * Rotation.from_quat(turned(time)) * first

    return at
