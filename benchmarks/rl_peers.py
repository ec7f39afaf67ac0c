"""The free arm of the learning tasks in PyElastica, driven by the same bends.

A Cosserat rod of 20 elements with rest curvatures, in explicit steps.
"""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

__all__ = [
    "ElasticaArm",
    "bends_of",
    "chain_tip",
    "converged_error",
    "many_steps_a_second",
    "settled_tip",
    "steps_a_second",
    "tips_of",
]

EDGES, LENGTH, RADIUS, MODULUS, DENSITY, DRAG = 20, 1.0, 0.05, 1e7, 1000.0, 10.0
CONTROL_STEP = 0.1  # [s]
_SEGMENTS = np.array([3, 4, 4, 4, 4])
_AREA = np.pi * RADIUS**2


def bends_of(actions: np.ndarray) -> np.ndarray:
    """Turns of the inner nodes [rad] towards x and y after every action, shape (count, 2, 19)."""
    bends, out = np.zeros((2, 5)), []
    for action in actions:
        bends = np.clip(bends + 0.05 * action.reshape(2, 5), -2.0, 2.0)
        out.append(2.0 * np.arctan(0.5 * np.repeat(bends / _SEGMENTS, _SEGMENTS, axis=1)))
    return np.array(out)


class ElasticaArm:
    """The arm in PyElastica.

    Parameters
    ----------
    time_step : float [s]
    drag : float [Pa s]
    shear : float
        How much stiffer in shear than it is.
    gravity : float [m/s^2]
    """

    def __init__(self, time_step: float, drag: float = DRAG, shear: float = 1.0, gravity: float = 9.81) -> None:
        import elastica
        from elastica.timestepper.symplectic_steppers import PositionVerlet

        class System(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping): ...

        self._count = round(CONTROL_STEP / time_step)
        self._time_step, self._time = np.float64(CONTROL_STEP / self._count), np.float64(0.0)
        self._system = System()
        self.rod = elastica.CosseratRod.straight_rod(
            EDGES,
            start=np.zeros(3),
            direction=np.array([0.0, 0.0, 1.0]),
            normal=np.array([1.0, 0.0, 0.0]),
            base_length=LENGTH,
            base_radius=RADIUS,
            density=DENSITY,
            youngs_modulus=MODULUS,
            shear_modulus=MODULUS / 3.0,
        )
        self.rod.shear_matrix[:2] *= shear
        self._system.append(self.rod)
        self._system.constrain(self.rod).using(
            elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        self._system.add_forcing_to(self.rod).using(elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -gravity]))
        self._system.dampen(self.rod).using(
            elastica.AnalyticalLinearDamper,
            # Damping of nodes [kg/s], not per mass or length: the velocity decays as exp(-constant / mass t).
            translational_damping_constant=drag * self.rod.mass / (DENSITY * _AREA),
            rotational_damping_constant=0.0,
            time_step=float(self._time_step),
        )
        self._system.finalize()
        self._stepper = PositionVerlet()
        self._turns = np.zeros((2, EDGES - 1))

    def act(self, turns: np.ndarray) -> None:
        """One control step, to which the turns of the nodes are led evenly [rad]."""
        step, system, now, dt = self._stepper.step, self._system, self._time, self._time_step
        rest, before = self.rod.rest_kappa, self._turns
        for i in range(1, self._count + 1):
            share = i / self._count
            # A turn towards d1 is one about d2, a turn towards d2 one about -d1.
            rest[0] = -(before[1] + share * (turns[1] - before[1])) * (EDGES / LENGTH)
            rest[1] = (before[0] + share * (turns[0] - before[0])) * (EDGES / LENGTH)
            now = step(system, now, dt)
        self._time, self._turns = now, turns

    @property
    def tip(self) -> np.ndarray:
        """Position of the last node [m]."""
        return self.rod.position_collection[:, -1].copy()


def tips_of(arm: ElasticaArm, actions: np.ndarray) -> np.ndarray:
    """Tip after each action [m]."""
    found = []
    for turns in bends_of(actions):
        arm.act(turns)
        found.append(arm.tip)
    return np.array(found)


def settled_tip(turns: np.ndarray, gravity: float, shear: float = 1.0, time_step: float = 1e-4) -> np.ndarray:
    """Tip at rest, bent by these turns [m]: after 6 s in much drag."""
    arm = ElasticaArm(time_step, 20.0 * DENSITY * _AREA, shear, gravity)
    for _ in range(60):
        arm.act(turns)
    return arm.tip


def chain_tip(turns: np.ndarray) -> np.ndarray:
    """Tip of a chain of straight edges that turns so at its nodes [m]: the arm without weight."""
    from scipy.spatial.transform import Rotation

    edge, frame = LENGTH / EDGES, Rotation.identity()
    tip = np.array([0.0, 0.0, edge])
    for towards_d1, towards_d2 in turns.T:
        frame = frame * Rotation.from_rotvec([-towards_d2, towards_d1, 0.0])
        tip = tip + frame.apply([0.0, 0.0, edge])
    return np.asarray(tip)


def converged_error(time_step: float, fine: float, actions: np.ndarray) -> float:
    """Return the RMS distance of the tip from a run with short steps [m]."""
    apart = tips_of(ElasticaArm(time_step), actions) - tips_of(ElasticaArm(fine), actions)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def steps_a_second(time_step: float, actions: np.ndarray) -> float:
    """Control steps a second of one arm, after one that warms up."""
    arm, turns = ElasticaArm(time_step), bends_of(actions)
    arm.act(turns[0])
    start = time.perf_counter()
    for row in turns[1:]:
        arm.act(row)
    return (len(turns) - 1) / (time.perf_counter() - start)


def many_steps_a_second(time_step: float, actions: np.ndarray, processes: int) -> float:
    """Steps per second of as many parallel processes as there are processors, summed over processes."""
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        return sum(pool.map(steps_a_second, [time_step] * processes, [actions] * processes))
