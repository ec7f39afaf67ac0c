"""A cable that a moving jaw lays on a floor, in the rod engine. The module takes a motion, and no plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from withe.deployment.cable import JAW, Cable
from withe.deployment.posts import Post
from withe.parts.handles import Rod
from withe.parts.materials import Material
from withe.recording import Record
from withe.scene import Scene
from withe.simulation import Simulation
from withe.simulation.hands import RunningHand

__all__ = ["ROLLING_FRICTION", "Motion", "Setup", "hung", "jaw_path", "jaw_stiffness", "lay", "place"]

FloatArray = npt.NDArray[np.float64]
_DENSITY, _VISCOUS_TIME, _GRAVITY = 1180.0, 0.02, 9.81  # [kg/m^3], [s], [m/s^2]
_SETTLING = 2.0  # [s] after the jaw has opened
ROLLING_FRICTION = 0.01  # couple over normal force times radius: rubber on a hard floor
_JAW_STIFFNESS = (2e3, 0.05)  # [N/m, N m/rad], least stiffness of its pads; ratios to EI / Lgb^3, EI / Lgb follow
_JAW_RATIOS = (1e4, 300.0)
_STRESSED = 1.0  # [s], time in which a placed cable reaches its stress
_RECORD_EVERY = 0.1  # [s]


class Motion(Protocol):
    """Motion of the jaw that holds the end of a cable."""

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
    """Setup of the world: the cable up to the jaw, the floor, and deviations."""

    cable: Cable
    friction: float
    rolling_friction: float = ROLLING_FRICTION
    nodes: int = 200
    time_step: float = 0.01  # [s]
    jaw_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m]
    jaw_turn: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [rad], a rotation vector
    quasi_static: bool = False  # a row of equilibria: neither inertia nor viscosity
    start_held: bool = False  # the free end is guided: it slides up and down only, until the jaw opens
    posts: tuple[Post, ...] = ()

    @property
    def arc_length(self) -> FloatArray:
        """Return the arc length of each node, from the free end to the far side of the jaw [m]."""
        return np.linspace(0.0, self.cable.length + 0.5 * JAW, self.nodes)


def lay(setup: Setup, motion: Motion, *, progress: bool) -> tuple[FloatArray, FloatArray, Record]:
    """Simulate the whole motion of a jaw: a rod in space with thickness, torsion and inertia, on a rough floor.

    Returns
    -------
    held, laid : ndarray of shape (nodes, 3) [m]
        Centreline from the free end, when the jaw opens and after the cable has come to rest.
    record : Record
        Record of the motion, every tenth of a second.
    """
    scene, cable = _scene(setup, _hanging(setup, motion))
    jaw_part = scene.grasp(cable, at=setup.cable.length, length=JAW, stiffness=jaw_stiffness(setup.cable), name="jaw")
    if setup.start_held:
        scene.pin(cable.start, free=(0.0, 0.0, 1.0))
    simulation = scene.build(integrator=_integrator(setup), time_step=setup.time_step, planar=False)
    if any(setup.cable.natural_curvature) or setup.quasi_static:
        simulation.set(cable, natural_curvature=setup.cable.natural_curvature)
        simulation.equilibrium()
    held = simulation.hand(jaw_part)
    held.move(path=jaw_path(setup, motion, held.pose.rotation))
    every = max(_RECORD_EVERY, setup.time_step)
    record = simulation.run(float(motion.times[-1]), record_every=every, progress=progress)
    before = simulation.positions(cable)
    held.release()
    if setup.start_held:
        simulation.release(cable.start)
    if setup.quasi_static:
        simulation.step()
    else:
        simulation.run(_SETTLING, progress=False)
    return before, simulation.positions(cable), record


def hang(setup: Setup) -> FloatArray:
    """Shape of a cable at rest that hangs from a jaw, with its free end off the floor: (nodes, 3) [m]."""
    points = setup.arc_length[:, None] * [0.0, 0.0, 1.0]
    scene = Scene(gravity=(0.0, 0.0, -_GRAVITY))
    cable = _add_cable(scene, setup.cable, points, "cable")
    scene.grasp(cable, at=setup.cable.length, length=JAW, stiffness=jaw_stiffness(setup.cable), name="jaw")
    simulation = scene.build(planar=False)
    simulation.set(cable, natural_curvature=setup.cable.natural_curvature)
    simulation.equilibrium()
    return simulation.positions(cable)


def place(setup: Setup, points: FloatArray, *, progress: bool) -> tuple[FloatArray, Record]:
    """Put a cable on the floor in the shape of a curve, free of stress, and apply its stress within a second.

    Parameters
    ----------
    setup : Setup
    points : ndarray of shape (nodes, 2) [m]
        Nodes of the cable, from the free end.

    Returns
    -------
    laid : ndarray of shape (nodes, 3) [m]
        Centreline after the cable has come to rest, with both ends free.
    record : Record
    """
    scene, cable = _scene(setup, np.column_stack([points, np.full(len(points), setup.cable.radius)]))
    scene.ignore_contact(cable, cable)  # at places where a pattern touches itself, the cable overlaps itself
    simulation = scene.build(integrator=_integrator(setup), time_step=setup.time_step, planar=False)
    simulation.set(cable, natural_curvature=(0.0, 0.0), over=_STRESSED)
    duration = _STRESSED if setup.quasi_static else _STRESSED + _SETTLING
    record = simulation.run(duration, record_every=max(_RECORD_EVERY, setup.time_step), progress=progress)
    return simulation.positions(cable), record


def hung(
    setups: Sequence[Setup], motions: Sequence[Motion], heights: Sequence[float]
) -> tuple[Simulation, list[Rod], list[RunningHand]]:
    """Cables on one floor, each hanging from a jaw at the start of its motion, or higher by some distance [m].

    The first setup determines the floor. `jaw_path` leads the jaws.
    """
    scene = _floor(setups[0])
    cables, jaws = [], []
    for number, (setup, motion, height) in enumerate(zip(setups, motions, heights, strict=True)):
        points = _hanging(setup, motion) + np.array([0.0, 0.0, height])
        cable = _add_cable(scene, setup.cable, points, f"cable {number}")
        at, stiffness = setup.cable.length, jaw_stiffness(setup.cable)
        jaws.append(scene.grasp(cable, at=at, length=JAW, stiffness=stiffness, name=f"jaw {number}"))
        cables.append(cable)
    simulation = scene.build(integrator=_integrator(setups[0]), time_step=setups[0].time_step, planar=False)
    for setup, cable in zip(setups, cables, strict=True):
        if any(setup.cable.natural_curvature):
            simulation.set(cable, natural_curvature=setup.cable.natural_curvature)
    if any(any(setup.cable.natural_curvature) for setup in setups):
        simulation.equilibrium()
    return simulation, cables, [simulation.hand(jaw) for jaw in jaws]


def _hanging(setup: Setup, motion: Motion) -> FloatArray:
    """Straight down from where the jaw is at first."""
    below = setup.arc_length - setup.cable.length
    return np.asarray(motion.positions[0] + below[:, None] * [0.0, 0.0, 1.0])


def _integrator(setup: Setup) -> Literal["static", "backward_euler"]:
    return "static" if setup.quasi_static else "backward_euler"


def _scene(setup: Setup, points: FloatArray) -> tuple[Scene, Rod]:
    scene = _floor(setup)
    return scene, _add_cable(scene, setup.cable, points, "cable")


def _floor(setup: Setup) -> Scene:
    """The floor with its posts."""
    scene = Scene(gravity=(0.0, 0.0, -_GRAVITY))
    scene.add_floor(friction=setup.friction, rolling_friction=setup.rolling_friction)
    for post in setup.posts:
        foot, head = (post.x, post.y, 0.0), (post.x, post.y, post.height - post.radius)
        scene.add_capsule(foot, head, post.radius, friction=setup.friction)
    scene.enable_contact(friction=setup.friction)
    return scene


def _bending_stiffness(cable: Cable) -> float:
    """EI = 2 w Lgb^3 [N m^2]."""
    return 2.0 * _DENSITY * np.pi * cable.radius**2 * _GRAVITY * cable.gravito_bending_length**3


def jaw_stiffness(cable: Cable) -> tuple[float, float]:
    """Stiffness of a jaw's pads on a cable [N/m, N m/rad]; plans assume a rigid jaw."""
    lgb, bend = cable.gravito_bending_length, _bending_stiffness(cable)
    (along, about), (share, turning) = _JAW_STIFFNESS, _JAW_RATIOS
    return max(along, share * bend / lgb**3), max(about, turning * bend / lgb)


def _add_cable(scene: Scene, cable: Cable, points: FloatArray, name: str) -> Rod:
    bend = _bending_stiffness(cable)
    modulus = 4.0 * bend / (np.pi * cable.radius**4)
    material = Material(youngs_modulus=modulus, poisson_ratio=0.5, density=_DENSITY, viscosity=_VISCOUS_TIME * modulus)
    return scene.add_rod(points=points, radius=cable.radius, material=material, name=name)


def jaw_path(setup: Setup, motion: Motion, begin: Any) -> Any:
    """Position and rotation of the jaw by time; `begin` is the rotation of the hanging rod's frame."""
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation

    where, turned = CubicSpline(motion.times, motion.positions), CubicSpline(motion.times, motion.rotations)
    first = Rotation.from_quat(motion.rotations[0]).inv()
    offset, turn = np.array(setup.jaw_offset), Rotation.from_rotvec(setup.jaw_turn)
    drawn = Rotation.from_matrix(begin)

    def at(time: float) -> tuple[FloatArray, Any]:
        time = float(np.clip(time, motion.times[0], motion.times[-1]))
        rise = min(1.0, time)  # [s]: errors increase smoothly
        return where(time) + rise * offset, turn**rise * Rotation.from_quat(turned(time)) * first * drawn

    return at
