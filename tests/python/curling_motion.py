"""A motion known in closed form that answers to the read-outs of a Simulation, without an engine.

Rod "arm" hangs from the origin and curls into an arc in the x-z plane, with a curvature that grows linearly in time.
Rod "hand" continues at the end of the arm, at a joint. Rod "ring" is closed and rises at 0.1 m/s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

CURVATURE_RATE = 8.0  # [1/(m s)]
RISE = 0.1  # [m/s]


@dataclass
class Handle:
    name: str
    rows: np.ndarray
    closed: bool
    radii: np.ndarray | float
    widths: np.ndarray | None = None


@dataclass
class CurlingSimulation:
    time: float = 0.0
    rods: list[Handle] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rods = [
            Handle("arm", np.arange(0, 21), False, np.linspace(6e-3, 4e-3, 20)),
            Handle("hand", np.arange(20, 31), False, 4e-3, np.array([6e-3, 2e-3])),
            Handle("ring", np.arange(31, 55), True, 2e-3),
        ]

    def step(self, duration: float) -> None:
        self.time += duration

    def positions(self, rod: str | None = None) -> np.ndarray:
        arc = np.linspace(0.0, 0.3, 31)
        kappa = max(CURVATURE_RATE * self.time, 1e-9)
        chain = np.stack([(1 - np.cos(kappa * arc)) / kappa, 0 * arc, -np.sin(kappa * arc) / kappa], axis=1)
        angle = np.arange(24) * 2 * np.pi / 24
        ring = np.stack([0.05 * np.cos(angle), 0.1 + 0.05 * np.sin(angle), 0 * angle + RISE * self.time], axis=1)
        points = np.concatenate([chain, ring])
        return points if rod is None else points[self._rod(rod).rows]

    def velocities(self, rod: str | None = None) -> np.ndarray:
        later = CurlingSimulation(self.time + 1e-6)
        earlier = CurlingSimulation(self.time - 1e-6)
        return (later.positions(rod) - earlier.positions(rod)) / 2e-6

    def directors(self, rod: str) -> np.ndarray:
        edges = self._edges(rod)
        tangents = edges / np.linalg.norm(edges, axis=1, keepdims=True)
        fixed = np.array([0.0, 0.0, 1.0] if self._rod(rod).closed else [0.0, 1.0, 0.0])
        first = np.broadcast_to(fixed, tangents.shape)
        return np.stack([first, np.cross(tangents, first), tangents], axis=1)

    def curvatures(self, rod: str) -> np.ndarray:
        kappa = 20.0 if self._rod(rod).closed else CURVATURE_RATE * self.time
        return np.stack([np.zeros(self._stencils(rod)), np.full(self._stencils(rod), kappa)], axis=1)

    def twists(self, rod: str) -> np.ndarray:
        return np.zeros(self._stencils(rod))

    def tensions(self, rod: str) -> np.ndarray:
        return np.linspace(1.0, 0.0, len(self._edges(rod))) * self.time

    def spins(self, rod: str) -> np.ndarray:
        return np.linspace(-1.0, 1.0, len(self._edges(rod))) * self.time

    def energy(self) -> SimpleNamespace:
        bend = 1e-3 * (CURVATURE_RATE * self.time) ** 2
        return SimpleNamespace(
            kinetic=1e-3, stretch=0.0, bend=bend, twist=0.0, gravity=-1e-3 * self.time, loads=0.0,
            contact=0.0, spring=0.0, total=1e-3 + bend - 1e-3 * self.time, work=bend, dissipated=0.0,
        )  # fmt: skip

    def _rod(self, name: str) -> Handle:
        return next(rod for rod in self.rods if rod.name == name)

    def _edges(self, name: str) -> np.ndarray:
        points = self.positions(name)
        return (np.roll(points, -1, axis=0) - points)[: len(points) - (not self._rod(name).closed)]

    def _stencils(self, name: str) -> int:
        return len(self._rod(name).rows) - (0 if self._rod(name).closed else 2)
