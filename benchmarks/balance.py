"""Independent sum of the forces and moments of a result, in NumPy, from positions and directors alone.

The sum shares no code with the engine, and uses another method. The engine differentiates energies by unknowns. Here
each stencil applies a moment to its two edges, the derivative of its energy by the rotation of one frame (by complex
steps). Each edge passes the transverse part of the moment to its nodes as a couple, and the axial part must vanish. The
cases are straight drawn, open rods with walls at one or both ends, and midpoint and backward Euler steps that were not
subdivided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from stress_cases import StressCase, load_of, natural_curvature_of, wall_of

import withe

__all__ = ["Look", "look", "residual", "static_residual"]

FloatArray = npt.NDArray[np.float64]
_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Look:
    """State of a simulation: positions [m], velocities [m/s], directors (edges, 3, 3), spins [rad/s]."""

    positions: FloatArray
    velocities: FloatArray
    directors: FloatArray
    spins: FloatArray
    steps: int
    replaced: int


def look(simulation: withe.Simulation) -> Look:
    """Take down the present state."""
    rod, statistics = simulation.rods[0], simulation.statistics
    return Look(
        simulation.positions(),
        simulation.velocities(),
        simulation.directors(rod),
        simulation.spins(rod) if simulation.plan.planar is False else np.zeros(len(simulation.directors(rod))),
        statistics.steps,
        statistics.energy_momentum_steps,
    )


def static_residual(case: StressCase, simulation: withe.Simulation, moment: int) -> float | None:
    """Return the greatest imbalance of forces, relative to 1e-6 of the acting forces plus rounding errors."""
    if case.event == "drawn curl":
        return None
    state = look(simulation)
    return _Sum(case, moment).add_forces(state.positions, state.directors).over_allowed()


def residual(case: StressCase, simulation: withe.Simulation, before: Look) -> float | None:
    """The same for the last time step; None where it was cut, is of another scheme, or has viscous forces."""
    after = look(simulation)
    schemes = {"implicit_midpoint": 0.5, "backward_euler": 1.0}
    if (
        case.event == "drawn curl"
        or case.method not in schemes
        or case.damping_ratio > 0.0
        or case.steps < 4
        or after.steps != before.steps + 1
        or after.replaced != before.replaced
    ):
        return None
    share = schemes[case.method]
    h = share * case.time_step
    z = (1.0 - share) * before.positions + share * after.positions
    edges = np.diff(z, axis=0)
    tangents = edges / np.linalg.norm(edges, axis=1)[:, None]
    start = before.directors[:, 2]
    turn = share * _angle(_transport(before.directors[:, 0], start, after.directors[:, 2]), after.directors)
    first = _transport(before.directors[:, 0], start, tangents)
    first = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(tangents, first)
    frames = np.stack([first, np.cross(tangents, first), tangents], axis=1)
    total = _Sum(case, 1).add_forces(z, frames, source=start)
    total.add_inertia(z - before.positions, before, h)
    if case.method == "backward_euler":
        total.add_spin(z - before.positions, before, h, turn)
    else:
        total.add_mean_spin(before, after.directors[:, 2], h, turn)
    return total.over_allowed()


# --- frames ----------------------------------------------------------------------------------------------------


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.sum(a * b, axis=-1)


def _transport(vector: np.ndarray, t0: np.ndarray, t1: np.ndarray) -> np.ndarray:
    """Turn vectors by the smallest rotation that takes t0 to t1."""
    b = np.cross(t0, t1)
    once = np.cross(b, vector)
    return vector + once + np.cross(b, once) / (1.0 + _dot(t0, t1))[..., None]


def _angle(carried: FloatArray, frames: FloatArray) -> FloatArray:
    """From carried directors to the first directors of frames, about the tangent [rad]."""
    return np.arctan2(-_dot(carried, frames[:, 1]), _dot(carried, frames[:, 0]))


def _strains(f0: np.ndarray, f1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both curvatures, and cosine and sine of the twist, between frames (stencils, 3, 3)."""
    t0, t1 = f0[:, 2], f1[:, 2]
    binormal = 2.0 * np.cross(t0, t1) / (1.0 + _dot(t0, t1))[:, None]
    bent = np.stack([_dot(binormal, f0[:, 1] + f1[:, 1]), -_dot(binormal, f0[:, 0] + f1[:, 0])], axis=1) / 2
    carried = _transport(f0[:, 0], t0, t1)
    return bent, np.stack([_dot(carried, f1[:, 0]), -_dot(carried, f1[:, 1])], axis=1)


def _factor(bent: np.ndarray) -> np.ndarray:
    """(phi / 2) / tan(phi / 2) as the engine has it, from curvatures (..., 2) of length 2 tan(phi / 2)."""
    square = np.sum(bent**2, axis=-1)
    return (1.0 + square / 15.0) / (1.0 + 0.15 * square)


def _measured(bent: np.ndarray) -> np.ndarray:
    return _factor(bent)[..., None] * bent


class _Sum:
    """Forces on nodes and moments along edges as they add up, and their absolute values."""

    def __init__(self, case: StressCase, moment: int) -> None:
        self._case, self._moment = case, moment
        self._edge = case.length / (case.nodes - 1)
        self._force = np.zeros((case.nodes, 3))
        self._size = np.zeros(case.nodes)
        self._couple = np.zeros(case.nodes - 1)
        self._couple_size = np.zeros(case.nodes - 1)
        mass = case.line_density * self._edge
        self._mass = np.full(case.nodes, mass)
        self._mass[[0, -1]] = mass / 2

    def _on_nodes(self, force: np.ndarray, where: slice) -> None:
        self._force[where] += force
        self._size[where] += np.linalg.norm(force, axis=1)

    def _pair(self, force: np.ndarray) -> None:
        """Forces on the heads of edges, and their opposites on the tails."""
        self._on_nodes(force, slice(1, None))
        self._on_nodes(-force, slice(None, -1))

    def _along(self, couple: np.ndarray, where: slice) -> None:
        self._couple[where] += couple
        self._couple_size[where] += np.abs(couple)

    def add_forces(self, x: FloatArray, frames: FloatArray, source: FloatArray | None = None) -> _Sum:
        """All but inertia; `source` are tangents from which frames were carried directly."""
        case = self._case
        edges = np.diff(x, axis=0)
        lengths = np.linalg.norm(edges, axis=1)[:, None]
        t = edges / lengths
        area = math.pi * case.radius**2
        self._pair(-case.youngs_modulus * area * (lengths / self._edge - 1.0) * t)
        turning = np.zeros_like(t) if source is None else np.cross(source, t) / (1.0 + _dot(source, t))[:, None]
        self._spin = turning / lengths
        self._t, self._lengths = t, lengths

        def moments(moment: np.ndarray, where: slice) -> None:
            along = _dot(moment, t[where])
            force = np.zeros_like(t)
            force[where] = np.cross(moment, t[where]) / lengths[where] + along[:, None] * self._spin[where]
            self._pair(force)
            self._along(along, where)

        if case.nodes > 2:
            # The next stencil carries a twelfth of the bending of an edge at a wall.
            carrying = np.full(case.nodes - 2, self._edge)
            carrying[0] += self._edge / 12
            if case.both_ends:
                carrying[-1] += self._edge / 12
            moment = self._stencil_moments(frames[:-1], frames[1:], self._edge, carrying)
            moments(moment, slice(1, None))
            moments(-moment, slice(None, -1))
        wall, half = wall_of(case, self._moment), self._edge / 2
        carrying = np.array([half - self._edge / 12 if case.nodes > 2 else half])
        moments(self._stencil_moments(wall[None], frames[:1], half, carrying), slice(0, 1))
        if case.both_ends and case.nodes > 2:
            last = self._stencil_moments(frames[-1:], wall_of(case, -1)[None], half, carrying)
            moments(-last, slice(case.nodes - 2, None))
        self._on_nodes(self._mass[:, None] * case.gravity * case.direction, slice(None))
        node, load = load_of(case, self._moment)
        self._on_nodes(load[None], slice(node, node + 1))
        return self

    def _stencil_moments(self, f0: FloatArray, f1: FloatArray, length: float, carrying: FloatArray) -> np.ndarray:
        """Moment of each stencil on its second edge; the first gets the opposite [N m].

        It twists over its length and bends over what it is `carrying` of the rod.
        """
        case = self._case
        smooth = np.asarray(natural_curvature_of(case, self._moment))
        bend = float(np.linalg.norm(smooth))
        natural = _measured(2.0 * math.tan(bend * length / 2) / bend * smooth if bend > 0 else smooth)
        bent, twist = _strains(f0, f1)
        tau = np.arctan2(twist[:, 1], twist[:, 0])
        twist_stiffness = case.stiffness * 2.0 / 3.0
        factor = _factor(bent)
        strain = factor[:, None] * bent - natural
        moment = np.empty((len(f1), 3))
        for axis in range(3):
            turned = f1 + 1e-30j * np.cross(np.eye(3)[axis], f1)
            bent_there, twist_there = _strains(f0, turned)
            strain_by = _measured(bent_there).imag / 1e-30
            twist_by = twist_there.imag / 1e-30
            tau_by = twist[:, 0] * twist_by[:, 1] - twist[:, 1] * twist_by[:, 0]
            twisted_by = factor * tau_by + _factor(bent_there).imag / 1e-30 * tau
            bending = case.stiffness * _dot(strain, strain_by) / carrying
            moment[:, axis] = -(bending + twist_stiffness / length * factor * tau * twisted_by)
        return moment

    def add_inertia(self, moved: FloatArray, before: Look, h: float) -> None:
        """Add the inertia of nodes, in a step over h from `before`."""
        case = self._case
        acceleration = (moved / h - before.velocities) / h
        self._on_nodes(-self._mass[:, None] * acceleration, slice(None))
        # An edge carries its mass along it: m / 3, m / 6, m / 3.
        self._pair(case.line_density * self._edge / 6 * np.diff(acceleration, axis=0))

    @property
    def _rotary(self) -> float:
        """Moment of inertia of an edge about itself [kg m^2]."""
        return 1000.0 * math.pi * self._case.radius**4 / 2 * self._edge

    def add_spin(self, moved: FloatArray, before: Look, h: float, turned: FloatArray) -> None:
        """Add torque and couple of edges that spin and turn, in their positions at the end."""
        torque = self._rotary * (turned / h - before.spins) / h
        self._along(-torque, slice(None))
        turning = np.cross(np.diff(moved, axis=0) / h, self._t)
        couple = (self._rotary * turned / h)[:, None] * turning / self._lengths**2
        self._pair(-couple - torque[:, None] * self._spin)

    def add_mean_spin(self, before: Look, tangents: FloatArray, h: float, turned: FloatArray) -> None:
        """Add the mean spin of midpoint steps: the moment I (w1 t1 - w0 t0) / dt, on edges in mid-step positions."""
        after = 2.0 * turned / h - before.spins
        gain = after[:, None] * tangents - before.spins[:, None] * before.directors[:, 2]
        moment = self._rotary / (2.0 * h) * gain
        torque = _dot(moment, self._t)
        self._along(-torque, slice(None))
        self._pair(-np.cross(moment, self._t) / self._lengths - torque[:, None] * self._spin)

    def over_allowed(self) -> float:
        """Return the greatest imbalance of forces and couples, relative to the allowed imbalance."""
        case = self._case
        free = slice(1, -1 if case.both_ends and case.nodes > 2 else None)
        # A node's place rounds as the length does, which shows in strains and in turns of edges.
        stretch = case.youngs_modulus * math.pi * case.radius**2
        noise = 100 * _EPS * (case.nodes + 1) * (stretch + case.stiffness / self._edge**2)
        forces = np.linalg.norm(self._force[free], axis=1).max() / (1e-6 * self._size.max() + noise)
        couples = np.abs(self._couple).max() / (
            1e-6 * (self._couple_size.max() + self._size.max() * self._edge) + noise * self._edge
        )
        return float(max(forces, couples))
