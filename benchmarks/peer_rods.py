"""A straight rod, clamped level at one end, in withe, PyElastica and MuJoCo; and a twisted ring in the first two.

The clamps of PyElastica and MuJoCo hold the first element. The wall of both is therefore in the middle of that
element, by a first node half an element behind it; otherwise the rods would be half an element too short. All masses
are lumped at nodes as the simulator does, and MuJoCo's ends have half of the mass of inner nodes.

MuJoCo has rods since version 3.17, as flexes of dimension 1: discrete elastic rods whose edges keep their length by
constraints. They replace the cable plugin, which version 4 removed.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import withe

__all__ = [
    "ElasticaRing",
    "ElasticaRod",
    "MujocoRod",
    "Ring",
    "Rod",
    "elastica_tip",
    "out_of_plane",
    "slowest",
    "withe_ring",
    "withe_rod",
]

FloatArray = npt.NDArray[np.float64]
GRAVITY = 9.81  # [m/s^2]


@dataclass(frozen=True)
class Rod:
    """Round and incompressible.

    Attributes
    ----------
    length, radius : float [m]
    weight : float
        w L^3 / EI.
    density : float [kg/m^3]
    height : float or None [m]
        Of the wall above a floor without friction.
    """

    length: float = 0.2
    radius: float = 2e-3
    weight: float = 10.0
    density: float = 1200.0
    height: float | None = None

    @property
    def modulus(self) -> float:
        """Young's modulus [Pa], from the weight."""
        return 4.0 * self.density * GRAVITY * self.length**3 / (self.weight * self.radius**2)

    @property
    def line_density(self) -> float:
        """Mass per length [kg/m]."""
        return self.density * math.pi * self.radius**2


def slowest(rod: Rod) -> float:
    """Angular frequency of the first mode of the level rod [rad/s], by which runs to a rest are damped."""
    return 1.8751**2 / rod.length**2 * 0.5 * rod.radius * math.sqrt(rod.modulus / rod.density)


def elastica_tip(weight: float) -> FloatArray:
    """Tip of an inextensible cantilever under its own weight over its length, shape (2,): along the wall's normal, up.

    theta'' = -G (1 - s) cos theta, theta(0) = theta'(1) = 0, by shooting.
    """

    def end(slope: float) -> FloatArray:
        def rates(s: float, y: FloatArray) -> list[float]:
            return [y[1], -weight * (1.0 - s) * math.cos(y[0]), math.cos(y[0]), math.sin(y[0])]

        found = solve_ivp(rates, (0.0, 1.0), [0.0, slope, 0.0, 0.0], rtol=1e-11, atol=1e-13, method="DOP853")
        return np.asarray(found.y[:, -1])

    slope = brentq(lambda value: end(value)[1], 0.0, 0.5 * weight, xtol=1e-13)
    tip = end(slope)
    return np.array([tip[2], -tip[3]])


@dataclass(frozen=True)
class Ring:
    """A straight rod that is closed to a ring without twist, and whose natural twist then grows.

    The ring leaves its plane at a total twist of 2 pi sqrt(3) EI / GJ [Michell 1889]. With GJ = 2.5 EI it does so
    gradually; with the stiffness of a round section it folds over itself.

    Attributes
    ----------
    radius, thickness : float [m]
        Of the ring, and of its section.
    modulus, density : float [Pa], [kg/m^3]
    twist_ratio : float
        GJ / EI.
    share : float
        Natural twist, over the critical one.
    """

    radius: float = 0.05
    thickness: float = 1.5e-3
    modulus: float = 1e7
    density: float = 1200.0
    twist_ratio: float = 2.5
    share: float = 1.1

    @property
    def area(self) -> float:
        """Area of the section [m^2]."""
        return math.pi * self.thickness**2

    @property
    def bending(self) -> float:
        """EI [N m^2]."""
        return 0.25 * self.modulus * math.pi * self.thickness**4

    @property
    def natural_twist(self) -> float:
        """Natural twist per length [rad/m]."""
        return self.share * math.sqrt(3.0) / (self.twist_ratio * self.radius)

    @property
    def pace(self) -> float:
        """Angular frequency of bending waves as long as the ring's radius [rad/s]."""
        return math.sqrt(self.bending / (self.density * self.area)) / self.radius**2


def out_of_plane(points: FloatArray) -> float:
    """RMS distance of points from their plane, over the RMS of their greatest extent; zero for a flat ring."""
    centred = points - points.mean(axis=0)
    least, *_, greatest = np.linalg.eigvalsh(centred.T @ centred)
    return math.sqrt(max(least, 0.0) / greatest)


# --- withe -----------------------------------------------------------------------------------------------------


def withe_rod(rod: Rod, edges: int, **options: object) -> withe.Simulation:
    """The rod in withe, ready to run."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    material = withe.Material(youngs_modulus=rod.modulus, poisson_ratio=0.5, density=rod.density)
    height = rod.height or 0.0
    part = scene.add_rod(
        start=(0.0, 0.0, height), end=(rod.length, 0.0, height), nodes=edges + 1, radius=rod.radius, material=material
    )
    scene.clamp(part.start)
    if rod.height is not None:
        scene.add_floor()
    return scene.build(**options)


def withe_ring(ring: Ring, nodes: int) -> withe.Simulation:
    """The twisted ring in withe, held by pins against rigid motion only."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    stiffness = withe.Stiffness(
        stretch=ring.modulus * ring.area, bend=(ring.bending, ring.bending), twist=ring.twist_ratio * ring.bending
    )
    rod = scene.add_rod(
        points=withe.shapes.circle(ring.radius, nodes),
        closed=True,
        natural="straight",
        normal=(0.0, 0.0, 1.0),
        radius=ring.thickness,
        stiffness=stiffness,
        line_density=ring.density * ring.area,
    )
    scene.pin(rod.node(0))
    scene.pin(rod.node(nodes // 2), free=(1.0, 0.0, 0.0))
    scene.pin(rod.node(nodes // 4), free=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    simulation = scene.build(integrator="static", planar=False)
    simulation.set(rod, natural_twist=ring.natural_twist)
    return simulation


# --- PyElastica ------------------------------------------------------------------------------------------------


class ElasticaRod:
    """The rod in PyElastica.

    Parameters
    ----------
    rod : Rod
    elements : int
    share : float
        Time step, over the time that sound takes along an element or a diameter, whichever is shorter.
    damping : float [1/s]
        Rate at which velocities decay.
    stiffness : float [Pa]
        Of the floor, per length.
    """

    def __init__(self, rod: Rod, elements: int, share: float, damping: float = 0.0, stiffness: float = 0.0) -> None:
        import elastica
        from elastica.timestepper.symplectic_steppers import PositionVerlet

        class System(
            elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping, elastica.Contact
        ): ...

        edge = rod.length / (elements - 0.5)
        self._step = np.float64(share * min(edge, 2.0 * rod.radius) / math.sqrt(rod.modulus / rod.density))
        self._system, self._stepper, self._time = System(), PositionVerlet(), np.float64(0.0)
        self._reach = 2.0 * rod.length
        self.rod = elastica.CosseratRod.straight_rod(
            elements,
            start=np.array([-0.5 * edge, 0.0, rod.height or 0.0]),
            direction=np.array([1.0, 0.0, 0.0]),
            normal=np.array([0.0, 0.0, 1.0]),
            base_length=elements * edge,
            base_radius=rod.radius,
            density=rod.density,
            youngs_modulus=rod.modulus,
            shear_modulus=rod.modulus / 3.0,
        )
        self._system.append(self.rod)
        self._system.constrain(self.rod).using(
            elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        self._system.add_forcing_to(self.rod).using(elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -GRAVITY]))
        if damping:
            self._system.dampen(self.rod).using(
                elastica.AnalyticalLinearDamper,
                translational_damping_constant=damping * self.rod.mass,
                rotational_damping_constant=0.0,
                time_step=float(self._step),
            )
        if rod.height is not None:
            plane = elastica.Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
            self._system.append(plane)
            # Its floor damps what comes nearer, at a rate per length.
            self._system.detect_contact_between(self.rod, plane).using(
                elastica.RodPlaneContact, k=stiffness * edge, nu=0.0
            )
        self._system.finalize()

    def run(self, duration: float, frames: int = 1) -> tuple[float, FloatArray]:
        """Processor time [s], and positions of the tip at equal times, shape (frames, 3) [m]; NaN where it diverged."""
        tips = np.full((frames, 3), np.nan)
        count = max(1, round(duration / frames / self._step))
        step, system, now, dt = self._stepper.step, self._system, self._time, np.float64(duration / frames / count)
        start = time.thread_time()
        with np.errstate(all="ignore"):
            for frame in range(frames):
                for _ in range(count):
                    now = step(system, now, dt)
                tip = self.rod.position_collection[:, -1]
                if not np.abs(tip).max() < self._reach:
                    break
                tips[frame] = tip
        self._time = now
        return time.thread_time() - start, tips

    @property
    def nodes(self) -> tuple[FloatArray, FloatArray]:
        """Arc length from the wall over the length, and positions [m]."""
        rest = np.concatenate([[0.0], np.cumsum(self.rod.rest_lengths)])
        return (rest - 0.5 * rest[1]) / (rest[-1] - 0.5 * rest[1]), self.rod.position_collection.T.copy()


class ElasticaRing:
    """The twisted ring in PyElastica, which a small velocity across its plane disturbs.

    Parameters
    ----------
    ring : Ring
    elements : int
    share : float
        Time step, as that of `ElasticaRod`.
    damping : float [1/s]
        Rate at which velocities decay.
    """

    def __init__(self, ring: Ring, elements: int, share: float, damping: float) -> None:
        import elastica
        from elastica.timestepper.symplectic_steppers import PositionVerlet

        class System(elastica.BaseSystemCollection, elastica.Constraints, elastica.Damping): ...

        length = 2.0 * math.pi * ring.radius
        edge = min(length / elements, 2.0 * ring.thickness)
        self._step = np.float64(share * edge / math.sqrt(ring.modulus / ring.density))
        self._system, self._stepper, self._time = System(), PositionVerlet(), np.float64(0.0)
        self._reach = 10.0 * ring.radius
        self.rod = elastica.CosseratRod.ring_rod(
            elements,
            ring_center_position=np.zeros(3),
            direction=np.array([1.0, 0.0, 0.0]),
            normal=np.array([0.0, 0.0, 1.0]),
            base_length=length,
            base_radius=ring.thickness,
            density=ring.density,
            youngs_modulus=ring.modulus,
            shear_modulus=ring.modulus / 3.0,
        )
        self.rod.bend_matrix[2, 2] = ring.twist_ratio * ring.bending
        self.rod.rest_kappa[:] = np.array([[0.0], [0.0], [ring.natural_twist]])
        turns = 4.0 * np.pi * np.arange(elements) / elements
        self.rod.velocity_collection[2] += 5e-3 * ring.pace * ring.radius * np.sin(turns)
        self._system.append(self.rod)
        self._system.dampen(self.rod).using(
            elastica.AnalyticalLinearDamper, uniform_damping_constant=damping, time_step=float(self._step)
        )
        self._system.finalize()

    def run(self, duration: float) -> tuple[float, FloatArray]:
        """Processor time [s], and positions of the nodes, shape (nodes, 3) [m]; NaN where it diverged."""
        count = max(1, round(duration / self._step))
        step, system, now = self._stepper.step, self._system, self._time
        start = time.thread_time()
        with np.errstate(all="ignore"):
            for _ in range(count):
                now = step(system, now, self._step)
        self._time = now
        seconds, points = time.thread_time() - start, self.rod.position_collection.T.copy()
        return seconds, points if np.abs(points).max() < self._reach else np.full_like(points, np.nan)

    @property
    def nodes(self) -> tuple[FloatArray, FloatArray]:
        """Share of the circumference, and positions [m]."""
        points = self.rod.position_collection.T.copy()
        return np.arange(len(points)) / len(points), points


# --- MuJoCo ----------------------------------------------------------------------------------------------------

_SCENE = """
<mujoco>
  <option timestep="{step!r}" integrator="{integrator}" solver="Newton" gravity="0 0 -9.81"/>
  <worldbody>
    {floor}
    <flexcomp name="rod" dim="1" type="grid" count="{nodes} 1 1" spacing="{edge!r} 1 1" pos="{middle!r} 0 {height!r}"
              radius="{radius!r}" mass="{mass!r}">
      <edge equality="true" solref="{stiff!r} 1" solimp=".9999 .9999 .001"/>
      <elasticity young="{modulus!r}" poisson=".499" damping="{viscous!r}"/>
      <pin id="0 1"/>
      <contact selfcollide="none" {contact}/>
    </flexcomp>
  </worldbody>
</mujoco>
"""
_FLOOR = '<geom type="plane" size="1 1 .1" condim="1" solref="{stiff!r} 1" solimp=".99 .999 1e-4"/>'


class MujocoRod:
    """The rod in MuJoCo.

    Parameters
    ----------
    rod : Rod
    edges : int
        Longer than a diameter, as MuJoCo demands.
    step : float [s]
    integrator : {"discrete", "Euler", "RK4"}
        Those that know rods.
    damping : float [1/s]
        Rate at which velocities decay.
    """

    def __init__(self, rod: Rod, edges: int, step: float, integrator: str = "discrete", damping: float = 0.0) -> None:
        import mujoco

        mujoco.set_mju_user_warning(lambda text: None)  # a run that diverges would write a file
        edge, stiff = rod.length / (edges - 0.5), 2.0 * step  # the stiffest that constraints may be
        floor = rod.height is not None
        text = _SCENE.format(
            step=step,
            integrator=integrator,
            floor=_FLOOR.format(stiff=stiff) if floor else "",
            nodes=edges + 1,
            edge=edge,
            middle=0.5 * rod.length - 0.25 * edge,
            height=rod.height or 0.0,
            radius=rod.radius,
            mass=rod.line_density * edges * edge,
            stiff=stiff,
            modulus=rod.modulus,
            viscous=0.0,
            contact='condim="1"' if floor else 'contype="0" conaffinity="0"',
        )
        self._model = model = mujoco.MjModel.from_xml_string(text)
        for node, body in enumerate(model.flex_vertbodyid[2:], start=2):
            mass = rod.line_density * edge * (0.5 if node == edges else 1.0)
            model.body_mass[body] = mass
            model.dof_damping[model.body_dofadr[body] + np.arange(3)] = damping * mass
        mujoco.mj_setConst(model, mujoco.MjData(model))
        self._data, self._forward, self._advance = mujoco.MjData(model), mujoco.mj_kinematics, mujoco.mj_step
        self._reach, self._edges = 2.0 * rod.length, edges
        mujoco.mj_forward(model, self._data)

    def run(self, duration: float, frames: int = 1) -> tuple[float, FloatArray]:
        """Processor time [s], and positions of the tip at equal times, shape (frames, 3) [m]; NaN where it diverged."""
        tips = np.full((frames, 3), np.nan)
        count = max(1, round(duration / frames / self._model.opt.timestep))
        start = time.thread_time()
        for frame in range(frames):
            self._advance(self._model, self._data, nstep=count)
            tip = self.nodes[1][-1]
            if not np.abs(tip).max() < self._reach:
                break
            tips[frame] = tip
        return time.thread_time() - start, tips

    @property
    def nodes(self) -> tuple[FloatArray, FloatArray]:
        """Arc length from the wall over the length, and positions [m]."""
        model, data = self._model, self._data
        free = model.flex_vertbodyid[2:]
        # Positions as the step ended: those of bodies in the data are of its start.
        slides = model.jnt_qposadr[model.body_jntadr[free]][:, None] + np.arange(3)
        moved = data.qpos[slides] - model.qpos0[slides]
        places = np.vstack([data.flexvert_xpos[:2], model.body_pos[free] + moved])
        s = (np.arange(self._edges + 1) - 0.5) / (self._edges - 0.5)
        return s, places
