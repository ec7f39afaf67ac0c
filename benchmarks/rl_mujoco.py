"""The free arm of the learning tasks in MuJoCo: its rods (1D flexes), many at once by its batches.

MuJoCo takes the natural curvature of a rod from its reference configuration, so actions change this configuration.
Every update moves the drawn bodies and the zeros of their joints together, so that the state does not move. It also
sets the rotations of the nodes in the reference. Constraints keep the lengths of edges, as usual for a rod of MuJoCo.
"""

from __future__ import annotations

import time

import mujoco
import numpy as np
from mujoco.batch import Batch
from rl_peers import CONTROL_STEP, DENSITY, DRAG, EDGES, LENGTH, MODULUS, RADIUS

__all__ = ["MujocoArms", "converged_error", "steps_a_second", "tips_of"]

_EDGE, _LINE = LENGTH / EDGES, DENSITY * np.pi * RADIUS**2
# Square sections alone keep a curvature in both directions: one as stiff in bending as the arm's circle.
_HALF = 0.5 * (3.0 * np.pi) ** 0.25 * RADIUS
_UPDATES = 4  # updates of the bends in a control step
_SCENE = """
<mujoco>
  <option timestep="{step!r}" integrator="discrete" solver="Newton" gravity="0 0 -9.81"/>
  <worldbody>
    <flexcomp name="arm" dim="1" type="grid" count="{nodes} 1 1" spacing="{edge!r} 1 1" pos="0 0 {middle!r}"
              euler="0 -90 0" mass="{mass!r}">
      <edge equality="true" solref="{soft!r} 1" solimp=".9999 .9999 .001"/>
      <elasticity young="{modulus!r}" poisson=".499" section="box" sectionsize="{half!r} {half!r}"/>
      <pin id="0 1"/>
      <contact selfcollide="none" contype="0" conaffinity="0"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""


def _model(time_step: float) -> mujoco.MjModel:
    """The arm, upright, with masses of its nodes and drag as ours has them."""
    model = mujoco.MjModel.from_xml_string(
        _SCENE.format(
            step=time_step,
            nodes=EDGES + 1,
            edge=_EDGE,
            middle=0.5 * LENGTH,
            mass=_LINE * LENGTH,
            soft=2.0 * time_step,  # the stiffest that constraints may be
            modulus=MODULUS,
            half=_HALF,
        )
    )
    for node, body in enumerate(model.flex_vertbodyid[2:], start=2):
        share = _EDGE * (0.5 if node == EDGES else 1.0)
        model.body_mass[body] = _LINE * share
        model.dof_damping[model.body_dofadr[body] + np.arange(3)] = DRAG * share
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _chains(bends: np.ndarray) -> np.ndarray:
    """Nodes from the third on of upright chains with discrete curvatures (n, 2, 19), shape (n, 19, 3) [m]."""
    count = len(bends)
    size = np.linalg.norm(bends, axis=1)  # 2 tan(turn / 2)
    axis = np.stack([-bends[:, 1], bends[:, 0]], axis=1) / np.where(size > 0.0, size, 1.0)[:, None]
    turn = 2.0 * np.arctan(0.5 * size)
    cos, sin = np.cos(turn), np.sin(turn)
    frames = np.broadcast_to(np.eye(3), (count, 3, 3))  # rows d1, d2, tangent
    here = np.tile([0.0, 0.0, _EDGE], (count, 1))
    found = np.empty((count, EDGES - 1, 3))
    for i in range(EDGES - 1):
        about = np.einsum("nk,nkj->nj", axis[:, :, i], frames[:, :2])[:, None]
        across = np.cross(about, frames)
        along = about * np.einsum("nij,nkj->ni", frames, about)[..., None]
        frames = along + cos[:, i, None, None] * (frames - along) + sin[:, i, None, None] * across
        here = here + _EDGE * frames[:, 2]
        found[:, i] = here
    return found


def ways_of(bends: np.ndarray, updates: int = _UPDATES) -> list[tuple[np.ndarray, np.ndarray]]:
    """Reference configurations on the way to each of the discrete curvatures (steps, 2, 19), which are led evenly.

    For each control step nodes from the third on, (updates, 19, 3) [m], and how much inner nodes turn, (updates, 19).
    """
    before = np.concatenate([np.zeros_like(bends[:1]), bends[:-1]])
    shares = (np.arange(updates) + 0.5) / updates
    return [
        (_chains(ramp), np.linalg.norm(ramp, axis=1))
        for ramp in (a + shares[:, None, None] * (b - a) for a, b in zip(before, bends, strict=True))
    ]


class MujocoArms:
    """Arms side by side that are led alike.

    Parameters
    ----------
    count : int
    time_step : float [s]
        Of which there is a whole number between updates.
    threads : int
    updates : int
        Of the bends in a control step.
    """

    def __init__(self, count: int, time_step: float, threads: int = 1, updates: int = _UPDATES) -> None:
        model = _model(time_step)
        self._substeps = round(CONTROL_STEP / (updates * time_step))
        if not np.isclose(self._substeps * updates * time_step, CONTROL_STEP):
            raise ValueError(f"time_step must divide {CONTROL_STEP / updates:g} s, got {time_step:g}")
        self._bodies = model.flex_vertbodyid[2:]
        self._joints = (model.body_dofadr[self._bodies][:, None] + np.arange(3)).ravel()
        self._drawn, self._zeros = model.body_pos[self._bodies].copy(), model.qpos0[self._joints].copy()
        self._batch = Batch(model, nsim=count, nthread=threads)
        self._places, self._origins = self._batch.expand("body_pos"), self._batch.expand("qpos0")
        self._records = self._batch.expand("flex_bending")[:, 1:].reshape(count, EDGES - 1, -1)
        self._qpos = self._batch.bind("qpos")

    def act(self, way: tuple[np.ndarray, np.ndarray]) -> None:
        """One control step on its way, see `ways_of`."""
        for places, turns in zip(*way, strict=True):
            self._places[:, self._bodies] = places
            self._origins[:, self._joints] = self._zeros + (places - self._drawn).ravel()
            self._records[:, :, 6] = turns
            self._batch.step(nstep=self._substeps)

    @property
    def tips(self) -> np.ndarray:
        """Positions of the last nodes, shape (count, 3) [m]."""
        last = self._joints[-3:]
        return np.asarray(self._places[:, self._bodies[-1]] + self._qpos[:, last] - self._origins[:, last])


def tips_of(time_step: float, bends: np.ndarray, updates: int = _UPDATES) -> np.ndarray:
    """Tip of one arm after each of the bends (steps, 2, 19), shape (steps, 3) [m]."""
    arm = MujocoArms(1, time_step, updates=updates)
    found = []
    for way in ways_of(bends, updates):
        arm.act(way)
        found.append(arm.tips[0])
    return np.array(found)


def converged_error(time_step: float, fine: float, bends: np.ndarray) -> float:
    """Return the RMS distance of the tip from a run with short steps and evenly changing bends [m]."""
    apart = tips_of(time_step, bends) - tips_of(fine, bends, updates=100)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def steps_a_second(time_step: float, bends: np.ndarray, count: int, threads: int) -> float:
    """Return control steps per second of some arms, after a warm-up step. All actions are known beforehand."""
    arms, ways = MujocoArms(count, time_step, threads), ways_of(bends)
    arms.act(ways[0])
    start = time.perf_counter()
    for way in ways[1:]:
        arms.act(way)
    return count * (len(ways) - 1) / (time.perf_counter() - start)
