"""A rod with a rigid body at its end, in withe and in MuJoCo; its frequencies in closed form.

MuJoCo has two ways:

- A *chain* of rigid links with hinges, whose stiffness is EI over the length of a link. The body is at the end of the
  last link, so that there is no gap. A clamp, and the body at the end, have hinges of the stiffness 2 EI / l, for the
  half link beside them. Without the hinge at the end, the chain converges at first order only.
- A *flex* of dimension 1 with a `connect` constraint to a free body. Constraints of MuJoCo yield, so there is a gap.

Both move in space or in a plane as MuJoCo does: hinges of the chain turn about one axis. withe is built as planar.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import j0, j1, y0, y1

import withe

__all__ = [
    "BodyRod",
    "FloatArray",
    "MujocoChain",
    "MujocoFlex",
    "WitheBody",
    "beam_mode",
    "beam_shape",
    "chain_frequencies",
    "hanging_frequencies",
    "withe_frequencies",
]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class BodyRod:
    """A rod whose end carries a rigid body.

    Attributes
    ----------
    length : float [m]
    line_density : float [kg/m]
    bending : float [N m^2]
        EI.
    stretching : float [N]
        EA of withe's rod; MuJoCo's links keep their length.
    mass, inertia, offset : float [kg], [kg m^2], [m]
        Of the body, about its centre, which is `offset` beyond the end of the rod.
    is_clamped : bool
        True if the start of the rod is clamped, level; otherwise it is pinned, and the rod hangs.
    gravity : float [m/s^2]
    tilt : float [rad]
        From the vertical, of a rod that hangs.
    """

    length: float
    line_density: float
    bending: float
    stretching: float
    mass: float
    inertia: float
    offset: float
    is_clamped: bool
    gravity: float = 0.0
    tilt: float = 0.0

    @property
    def along(self) -> FloatArray:
        """Direction of the drawn rod, shape (3,)."""
        if self.is_clamped:
            return np.array([1.0, 0.0, 0.0])
        return np.array([math.sin(self.tilt), 0.0, -math.cos(self.tilt)])


# --- closed forms ------------------------------------------------------------------------------------------------


def _basis(x: float | FloatArray) -> tuple[FloatArray, ...]:
    """Return cos - cosh and sin - sinh at x, and their three derivatives, each of shape (2, ...)."""
    c, s, ch, sh = np.cos(x), np.sin(x), np.cosh(x), np.sinh(x)
    return (
        np.array([c - ch, s - sh]),
        np.array([-s - sh, c - ch]),
        np.array([-c - ch, -s - sh]),
        np.array([s - sh, -c - ch]),
    )


def _end_conditions(rod: BodyRod, b: float) -> FloatArray:
    """Return the conditions on a clamped beam with a body at its end, shape (2, 2), for b = beta L.

    EI w'' = omega^2 (J w' + M c (w + c w')) and EI w''' = -omega^2 M (w + c w') [Bhat and Wagner 1976].
    """
    m = rod.mass / (rod.line_density * rod.length)
    inertia = rod.inertia / (rod.line_density * rod.length**3)
    c = rod.offset / rod.length
    w, slope, bend, shear = _basis(b)
    moved = w + c * b * slope
    return np.array(
        [
            b**2 * bend - b**4 * (inertia * b * slope + m * c * moved),
            b**3 * shear + b**4 * m * moved,
        ]
    )


def beam_mode(rod: BodyRod) -> tuple[float, float, FloatArray]:
    """Return the first angular frequency [rad/s], beta L, and the factors of both functions of the mode.

    The displacement at the end of the rod is one.
    """
    size = rod.bending / rod.line_density
    low, high = 1e-3, 1e-3
    while np.linalg.det(_end_conditions(rod, high)) * np.linalg.det(_end_conditions(rod, low)) > 0.0:
        low, high = high, high + 0.01
    b = brentq(lambda x: float(np.linalg.det(_end_conditions(rod, x))), low, high, xtol=1e-14)
    factors = np.linalg.svd(_end_conditions(rod, b))[2][-1]
    return b**2 / rod.length**2 * math.sqrt(size), b, factors / (factors @ _basis(b)[0])


def beam_shape(rod: BodyRod, s: FloatArray) -> tuple[FloatArray, float]:
    """Return the displacements of the first mode at shares of the length, and the slope at the end [1/m].

    The displacement at the end of the rod is one.
    """
    _, b, factors = beam_mode(rod)
    return factors @ _basis(b * s)[0], float(factors @ _basis(b)[1]) * b / rod.length


def hanging_frequencies(rod: BodyRod, count: int) -> FloatArray:
    """Return angular frequencies [rad/s] of a cable without bending stiffness, with a body at its end.

    The cable moves by A J0(2 w sqrt(x / g)) + B Y0(2 w sqrt(x / g)), with x from M / rho below its end.
    """
    below, g, c = rod.mass / rod.line_density, rod.gravity, rod.offset

    def determinant(w: float) -> float:
        top, end = (2.0 * w * math.sqrt(x / g) for x in (rod.length + below, below))
        slopes = -w / math.sqrt(below * g) * np.array([j1(end), y1(end)])
        values, tension = np.array([j0(end), y0(end)]), rod.mass * g
        return float(
            np.linalg.det(
                [
                    [j0(top), y0(top), 0.0],
                    [*(tension * slopes + w * w * rod.mass * values), -w * w * rod.mass * c],
                    [*(c * tension * slopes), w * w * rod.inertia - c * tension],
                ]
            )
        )

    grid = np.linspace(0.5, 80.0, 8000)
    values = np.array([determinant(w) for w in grid])
    places = np.flatnonzero(values[:-1] * values[1:] < 0.0)[:count]
    return np.array([brentq(determinant, grid[i], grid[i + 1], xtol=1e-13) for i in places])


# --- withe -------------------------------------------------------------------------------------------------------


class WitheBody:
    """The rod and its body in withe.

    Parameters
    ----------
    rod : BodyRod
    edges : int
    options
        Of `Scene.build`.
    """

    def __init__(self, rod: BodyRod, edges: int, **options: object) -> None:
        scene = withe.Scene(gravity=(0.0, 0.0, -rod.gravity))
        stiffness = withe.Stiffness(stretch=rod.stretching, bend=rod.bending, twist=rod.bending)
        end = rod.length * rod.along
        self._rod, self._edges = rod, edges
        self._up = 2 if rod.gravity else 1  # without gravity, the plane of a straight rod is that of x and y
        self._part = scene.add_rod(
            start=(0, 0, 0),
            end=end,
            nodes=edges + 1,
            radius=1e-3 * rod.length,
            stiffness=stiffness,
            line_density=rod.line_density,
        )
        center = end + rod.offset * rod.along
        self._body = scene.add_body(mass=rod.mass, inertia=rod.inertia, position=center)
        scene.join(self._part.end, self._body)
        if rod.is_clamped:
            scene.clamp(self._part.start)
        else:
            scene.pin(self._part.start)
        self.simulation = scene.build(planar=True, **options)

    def swing(self, velocities: FloatArray, of_body: float, spin: float) -> None:
        """Set upward velocities of the nodes, the upward velocity of the body, and its spin from x upwards."""
        upward = np.zeros((self._edges + 1, 3))
        upward[:, self._up] = velocities
        self.simulation.set_velocities(self._part, upward)
        self.simulation.set_velocity(self._body, of_body * np.eye(3)[self._up], angular=(0, 0, spin))

    def run(self, duration: float, frames: int) -> tuple[float, FloatArray]:
        """Processor time [s], and the centre of the body at equal times, shape (frames, 3) [m]."""
        places, count = [], round(duration / frames / self.simulation.time_step)
        start = time.thread_time()
        for _ in range(frames):
            self.simulation.step(count)
            places.append(self.simulation.position(self._body))
        seconds, found = time.thread_time() - start, np.array(places)
        return seconds, found if self._up == 2 else found[:, [0, 2, 1]]

    @property
    def gap(self) -> float:
        """Distance of the end of the rod from its place on the body [m]."""
        drawn = -self._rod.offset * self._rod.along
        place = self.simulation.position(self._body) + self.simulation.rotation(self._body) @ drawn
        return float(np.linalg.norm(place - self.simulation.positions(self._part)[-1]))


def withe_frequencies(rod: BodyRod, edges: int, count: int) -> FloatArray:
    """Return angular frequencies of withe's rod in its plane [rad/s]."""
    one = WitheBody(rod, edges, integrator="static")
    one.simulation.equilibrium()
    return 2.0 * np.pi * np.asarray(one.simulation.linearise().frequencies(count))


# --- MuJoCo ------------------------------------------------------------------------------------------------------

_OPTION = '<option timestep="{step!r}" integrator="{integrator}" solver="Newton" gravity="0 0 {down!r}"/>'


class MujocoChain:
    """The rod in MuJoCo as a chain of links, with the body at the last one.

    Parameters
    ----------
    rod : BodyRod
    links : int
    step : float [s]
    integrator : str
    """

    def __init__(self, rod: BodyRod, links: int, step: float = 1e-3, integrator: str = "RK4") -> None:
        import mujoco

        mujoco.set_mju_user_warning(lambda text: None)  # a run that diverges would write a file
        edge = rod.length / links
        mass = rod.line_density * edge
        spring = rod.bending / edge
        moment = mass * edge * edge / 12.0
        # A turn about -y moves the x axis up. The chain is drawn along x and turned as a whole.
        text = (
            f'<body name="body" pos="{edge!r} 0 0"><joint axis="0 -1 0" stiffness="{2.0 * spring!r}"/>'
            f'<inertial pos="{rod.offset!r} 0 0" mass="{rod.mass!r}" diaginertia="{rod.inertia!r} {rod.inertia!r} '
            f'{rod.inertia!r}"/></body>'
        )
        for link in reversed(range(links)):
            stiffness = spring if link else 2.0 * spring if rod.is_clamped else 0.0
            x, y, z = map(float, rod.along)
            place = f'pos="{edge!r} 0 0"' if link else f'xyaxes="{x!r} {y!r} {z!r} 0 1 0"'
            text = (
                f'<body {place}><joint axis="0 -1 0" stiffness="{stiffness!r}"/><inertial pos="{0.5 * edge!r} 0 0" '
                f'mass="{mass!r}" diaginertia="{moment!r} {moment!r} {moment!r}"/>{text}</body>'
            )
        option = _OPTION.format(step=step, integrator=integrator, down=-rod.gravity)
        option = option.replace("/>", '><flag contact="disable" constraint="disable"/></option>')
        self._mujoco, self._rod, self._links = mujoco, rod, links
        self._model = mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{text}</worldbody></mujoco>")
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._body = self._model.body("body").id

    def swing(self, velocities: FloatArray, of_body: float, spin: float) -> None:
        """Set upward velocities of the ends of the links, and the spin of the body. Its velocity follows."""
        edge = self._rod.length / self._links
        rates = np.concatenate([np.diff(velocities) / edge, [spin]])
        self._data.qvel[:] = np.diff(rates, prepend=0.0)

    def run(self, duration: float, frames: int) -> tuple[float, FloatArray]:
        """Processor time [s], and the centre of the body at equal times, shape (frames, 3) [m]; NaN if it diverged."""
        places = np.full((frames, 3), np.nan)
        count = max(1, round(duration / frames / self._model.opt.timestep))
        advance, kinematics, data = self._mujoco.mj_step, self._mujoco.mj_kinematics, self._data
        start = time.thread_time()
        for frame in range(frames):
            advance(self._model, data, nstep=count)
            kinematics(self._model, data)  # positions at the end of the step
            place = data.xipos[self._body]
            if not np.abs(place).max() < 10.0 * self._rod.length or data.time < 0.5 * (frame + 1) * duration / frames:
                break  # MuJoCo resets a run that diverges
            places[frame] = place
        return time.thread_time() - start, places

    @property
    def frequencies(self) -> FloatArray:
        """Angular frequencies about the drawn configuration [rad/s], by differences of the forces."""
        mujoco, model, data = self._mujoco, self._model, self._data
        count = model.nv
        mass, stiffness = np.zeros((count, count)), np.zeros((count, count))
        mujoco.mj_fullM(model, data, mass)
        for i in range(count):
            found = []
            for sign in (1.0, -1.0):
                data.qpos[:] = 0.0
                data.qpos[i] = sign * 1e-5
                mujoco.mj_forward(model, data)
                found.append(np.array(data.qfrc_passive - data.qfrc_bias))
            stiffness[:, i] = (found[1] - found[0]) / 2e-5
        data.qpos[:] = 0.0
        mujoco.mj_forward(model, data)
        return np.sqrt(np.maximum(eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True), 0.0))


def chain_frequencies(rod: BodyRod, links: int, count: int) -> FloatArray:
    """Return angular frequencies of MuJoCo's chain in its plane [rad/s]."""
    return MujocoChain(rod, links).frequencies[:count]


class MujocoFlex:
    """A hanging cable in MuJoCo as a flex of dimension 1, whose end a constraint connects to a free body.

    Parameters
    ----------
    rod : BodyRod
    edges : int
    step : float [s]
    stiff : float or None [s]
        Time constant of the constraints; None for the least that MuJoCo allows, two time steps.
    integrator : str
    """

    def __init__(
        self, rod: BodyRod, edges: int, step: float, stiff: float | None = None, integrator: str = "discrete"
    ) -> None:
        import mujoco

        mujoco.set_mju_user_warning(lambda text: None)
        edge, stiff = rod.length / edges, 2.0 * step if stiff is None else stiff
        radius = 0.1 * edge
        young = rod.bending / (0.25 * math.pi * radius**4)
        x, y, z = map(float, rod.along)
        text = f"""<mujoco>{_OPTION.format(step=step, integrator=integrator, down=-rod.gravity)}
<worldbody><body name="wall" xyaxes="{x!r} {y!r} {z!r} 0 1 0">
 <flexcomp name="rod" dim="1" type="grid" count="{edges + 1} 1 1" spacing="{edge!r} 1 1" pos="{0.5 * rod.length!r} 0 0"
  radius="{radius!r}" mass="{rod.line_density * rod.length!r}">
  <edge equality="true" solref="{stiff!r} 1" solimp=".9999 .9999 .001"/>
  <elasticity young="{young!r}" poisson=".499" damping="0"/><pin id="0"/>
  <contact selfcollide="none" contype="0" conaffinity="0"/></flexcomp></body>
 <body name="body" pos="{rod.length * x!r} 0 {rod.length * z!r}" xyaxes="{x!r} {y!r} {z!r} 0 1 0"><freejoint/>
  <inertial pos="{rod.offset!r} 0 0" mass="{rod.mass!r}" diaginertia="{rod.inertia!r} {rod.inertia!r} {rod.inertia!r}"/>
 </body></worldbody>
<equality><connect body1="body" body2="rod_{edges}" anchor="0 0 0" solref="{stiff!r} 1" solimp=".9999 .9999 .001"/>
</equality></mujoco>"""
        self._mujoco, self._rod, self._edges = mujoco, rod, edges
        self._model = model = mujoco.MjModel.from_xml_string(text)
        for node, body in enumerate(model.flex_vertbodyid[1:], start=1):
            model.body_mass[body] = rod.line_density * edge * (0.5 if node == edges else 1.0)
        self._data = mujoco.MjData(model)
        mujoco.mj_setConst(model, self._data)
        mujoco.mj_forward(model, self._data)
        self._body, self.gap = model.body("body").id, 0.0

    def run(self, duration: float, frames: int) -> tuple[float, FloatArray]:
        """Processor time [s], and the centre of the body at equal times, shape (frames, 3) [m]; NaN if it diverged.

        Sets `gap`, the mean distance of the end of the rod from its place on the body [m].
        """
        places, gaps = np.full((frames, 3), np.nan), []
        count = max(1, round(duration / frames / self._model.opt.timestep))
        data, seconds = self._data, 0.0
        for frame in range(frames):
            start = time.thread_time()
            self._mujoco.mj_step(self._model, data, nstep=count)
            self._mujoco.mj_kinematics(self._model, data)
            place = np.array(data.xipos[self._body])
            seconds += time.thread_time() - start
            if not np.abs(place).max() < 10.0 * self._rod.length or data.time < 0.5 * (frame + 1) * duration / frames:
                break
            places[frame] = place
            gaps.append(np.linalg.norm(data.xpos[self._body] - data.xpos[self._model.flex_vertbodyid[-1]]))
        self.gap = float(np.mean(gaps)) if gaps else math.inf
        return seconds, places
