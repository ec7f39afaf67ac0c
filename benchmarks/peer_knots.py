"""An overhand knot without friction, pulled tight by forces at both ends of its rod, in withe, PyElastica and MuJoCo.

The rod is straight by nature, and its ends are free. At rest the force determines the size of the knot. The shortening,
which is the length of the rod less the distance of its ends, measures the size. Neither the rotation of the knot about
the line of its ends nor a slide along the rod changes the shortening. The start is a polynomial knot with straight
tails, which is symmetric about an axis [Shastri 1992, Tohoku Math. J. 44].
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from peer_rods import FloatArray

import withe

__all__ = ["ElasticaKnot", "Knot", "MujocoKnot", "shortening", "withe_knot"]


@dataclass(frozen=True)
class Knot:
    """Round and incompressible.

    Attributes
    ----------
    radius : float [m]
    modulus, density : float [Pa], [kg/m^3]
    pull : float
        Force at the ends, over EI / radius^2.
    """

    radius: float = 2e-3
    modulus: float = 1e6
    density: float = 1200.0
    pull: float = 0.01

    @property
    def line_density(self) -> float:
        """Mass per length [kg/m]."""
        return self.density * math.pi * self.radius**2

    @property
    def force(self) -> float:
        """Force at the ends [N]."""
        return self.pull * 0.25 * self.modulus * math.pi * self.radius**2

    @property
    def pace(self) -> float:
        """Angular frequency of bending waves of the length sqrt(EI / force), which is about the radius of the loop."""
        return self.pull * 0.5 * math.sqrt(self.modulus / self.density) / self.radius

    def points(self, edges: int) -> FloatArray:
        """Return the nodes of the loose knot, shape (edges + 1, 3) [m]."""
        t = np.linspace(-1.9, 1.9, 4001)
        curve = 1.24 * self.radius * np.stack([t**5 - 10.0 * t, 7.0 * (t**3 - 3.0 * t), 5.0 * (t**4 - 4.0 * t**2)], 1)
        tail = 25.0 * self.radius
        ways = [end / np.linalg.norm(end) for end in (curve[0] - curve[1], curve[-1] - curve[-2])]
        curve = np.vstack([curve[0] + tail * ways[0], curve, curve[-1] + tail * ways[1]])
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        return np.stack([np.interp(np.linspace(0.0, s[-1], edges + 1), s, x) for x in curve.T], axis=1)


def shortening(points: FloatArray) -> float:
    """Length of a stretched rod less the distance of its ends [m]."""
    return _length(points) - float(np.linalg.norm(points[-1] - points[0]))


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _along(points: FloatArray) -> FloatArray:
    way = points[-1] - points[0]
    return np.asarray(way / np.linalg.norm(way))


def withe_knot(knot: Knot, edges: int, damping: float = 0.0, **options: object) -> withe.Simulation:
    """Return the knot in withe, at a rate at which velocities decay [1/s]."""
    points = knot.points(edges)
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    material = withe.Material(youngs_modulus=knot.modulus, poisson_ratio=0.5, density=knot.density)
    rope = scene.add_rod(points=points, radius=knot.radius, material=material, natural="straight")
    for end, sign in ((rope.start, -1.0), (rope.end, 1.0)):
        scene.add_force(end, sign * knot.force * _along(points))
    if damping:
        scene.add_drag(damping * knot.line_density)
    scene.enable_contact()
    return scene.build(**options)


class ElasticaKnot:
    """The knot in PyElastica.

    Parameters
    ----------
    knot : Knot
    elements : int
    share : float
        Time step, over the time that sound takes along an element or a diameter, whichever is shorter.
    damping : float [1/s]
        Rate at which velocities decay.
    depth : float
        Depth by which the force at the ends would press two elements into each other, over the radius.
    """

    def __init__(self, knot: Knot, elements: int, share: float, damping: float, depth: float) -> None:
        import elastica
        from elastica.timestepper.symplectic_steppers import PositionVerlet
        from elastica_rods import frames_along

        class System(
            elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping, elastica.Contact
        ): ...

        points = knot.points(elements)
        edges = np.diff(points, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        frames = frames_along(edges / lengths[:, None])
        self._length = float(lengths.sum())
        sound = math.sqrt(knot.modulus / knot.density)
        self._step = np.float64(share * min(float(lengths.min()), 2.0 * knot.radius) / sound)
        self._system, self._stepper, self._time = System(), PositionVerlet(), np.float64(0.0)
        self.rod = elastica.CosseratRod.straight_rod(
            elements,
            start=points[0],
            direction=frames[2, :, 0],
            normal=frames[0, :, 0],
            base_length=self._length,
            base_radius=knot.radius,
            density=knot.density,
            youngs_modulus=knot.modulus,
            shear_modulus=knot.modulus / 3.0,
            position=np.ascontiguousarray(points.T),
            directors=frames,
        )
        self._system.append(self.rod)
        force = knot.force * _along(points)
        self._system.add_forcing_to(self.rod).using(elastica.EndpointForces, -force, force, ramp_up_time=self._step)
        self._system.dampen(self.rod).using(
            elastica.AnalyticalLinearDamper,
            translational_damping_constant=damping * self.rod.mass,
            rotational_damping_constant=0.0,
            time_step=float(self._step),
        )
        self._system.detect_contact_between(self.rod, self.rod).using(
            elastica.RodSelfContact, k=knot.force / (depth * knot.radius), nu=0.0
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
        return seconds, points if np.abs(points).max() < 10.0 * self._length else np.full_like(points, np.nan)

    @property
    def nodes(self) -> tuple[FloatArray, FloatArray]:
        """Share of the arc length, and positions [m]."""
        points = self.rod.position_collection.T.copy()
        return np.linspace(0.0, 1.0, len(points)), points


_SCENE = """
<mujoco>
  <option timestep="{step!r}" integrator="discrete" solver="Newton" gravity="0 0 0"/>
  <worldbody>
    <flexcomp name="rod" dim="1" type="grid" count="{nodes} 1 1" spacing="{edge!r} 1 1" radius="{radius!r}"
              mass="{mass!r}">
      <edge equality="true" solref="{stiff!r} 1" solimp=".9999 .9999 .001"/>
      <elasticity young="{modulus!r}" poisson=".499"/>
      <contact selfcollide="auto" condim="1" solref="{stiff!r} 1" solimp=".99 .999 1e-4"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""


class MujocoKnot:
    """The knot in MuJoCo: a straight rod whose nodes start at those of the knot.

    Parameters
    ----------
    knot : Knot
    edges : int
        Longer than a diameter, as MuJoCo demands: 97 at most.
    step : float [s]
    damping : float [1/s]
        Rate at which velocities decay.
    """

    def __init__(self, knot: Knot, edges: int, step: float, damping: float) -> None:
        import mujoco

        mujoco.set_mju_user_warning(lambda text: None)  # a run that diverges would write a file
        points = knot.points(edges)
        self._length = _length(points)
        edge = self._length / edges
        text = _SCENE.format(
            step=step,
            nodes=edges + 1,
            edge=edge,
            radius=knot.radius,
            mass=knot.line_density * self._length,
            stiff=2.0 * step,  # the stiffest that constraints may be
            modulus=knot.modulus,
        )
        self._model = model = mujoco.MjModel.from_xml_string(text)
        bodies = model.flex_vertbodyid
        for node, body in enumerate(bodies):
            mass = knot.line_density * edge * (0.5 if node in (0, edges) else 1.0)
            model.body_mass[body] = mass
            model.dof_damping[model.body_dofadr[body] + np.arange(3)] = damping * mass
        self._data = data = mujoco.MjData(model)
        mujoco.mj_setConst(model, data)
        mujoco.mj_forward(model, data)
        self._slides = model.jnt_qposadr[model.body_jntadr[bodies]][:, None] + np.arange(3)
        self._straight = data.flexvert_xpos - data.qpos[self._slides]
        data.qpos[self._slides] = points - self._straight
        force = knot.force * _along(points)
        data.xfrc_applied[bodies[0], :3], data.xfrc_applied[bodies[-1], :3] = -force, force
        self._advance = mujoco.mj_step

    def run(self, duration: float) -> tuple[float, FloatArray]:
        """Processor time [s], and positions of the nodes, shape (nodes, 3) [m]; NaN where it diverged."""
        count = max(1, round(duration / self._model.opt.timestep))
        start = time.thread_time()
        self._advance(self._model, self._data, nstep=count)
        seconds, points = time.thread_time() - start, self.nodes[1]
        return seconds, points if np.abs(points).max() < 10.0 * self._length else np.full_like(points, np.nan)

    @property
    def nodes(self) -> tuple[FloatArray, FloatArray]:
        """Share of the arc length, and positions [m]."""
        points = self._straight + self._data.qpos[self._slides]
        return np.linspace(0.0, 1.0, len(points)), points
