"""Scenes of the stress test: drawn by number from a fixed seed, each with one violent event or more.

Young's modulus, radius, slenderness, nodes and step are drawn uniformly in their logarithms, over the whole range that
the package supports. The event is scaled by the stiffness of the rod, so that all rods bend and no case is trivial.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

import withe

__all__ = [
    "EVENTS",
    "METHODS",
    "StressCase",
    "build",
    "draw_case",
    "events",
    "load_of",
    "natural_curvature_of",
    "wall_of",
]

SEED = 20_240_917
# Damping of the slowest mode, over its critical damping, in the damped set: rubber and foam have the most, metal the
# least.
DAMPING_RATIOS = (1e-3, 1e-1)
EVENTS = ("load", "jump", "flip", "curl", "drawn curl", "weight")
# The default twice. Plain midpoint steps gain energy in such scenes, and warn (`EnergyDriftWarning`).
METHODS = ("static", "energy_momentum", "backward_euler", "energy_momentum", "error-controlled")


@dataclass(frozen=True)
class StressCase:
    """One case.

    Attributes
    ----------
    number : int
    method : str
        Integrator; "error-controlled" is the default one with a tolerance of a thousandth of the length.
    event : str
        Kind of the event: a sudden load, a clamp that jumps, actuation that flips sign, or sudden weight. "curl" is a
        strong natural curvature of a straight rod. A rod drawn with strong curvature is straight by nature or gets a
        load.
    youngs_modulus : float [Pa]
    radius : float [m]
    length : float [m]
    nodes : int
    coarseness : float
        Time step over a hundredth of the slowest period.
    strength : float
        Of the event; its scale depends on the event.
    direction : ndarray of shape (3,)
        Of load or jump or weight.
    both_ends : bool
        Whether the far end is clamped too.
    planar : bool
        Whether everything lies in a plane.
    damping_ratio : float
        Damping of the slowest mode by the material's viscosity, over its critical damping.
    """

    number: int
    method: str
    event: str
    youngs_modulus: float
    radius: float
    length: float
    nodes: int
    coarseness: float
    strength: float
    direction: np.ndarray = field(repr=False)
    both_ends: bool = False
    planar: bool = False
    damping_ratio: float = 0.0

    @property
    def slenderness(self) -> float:
        """Length over radius."""
        return self.length / self.radius

    @property
    def stiffness(self) -> float:
        """EI [N m^2]."""
        return self.youngs_modulus * math.pi * self.radius**4 / 4

    @property
    def line_density(self) -> float:
        """Mass per length [kg/m]."""
        return 1000.0 * math.pi * self.radius**2

    @property
    def gravity(self) -> float:
        """Weight that gives w L^3 / EI its drawn value, where that is the event [m/s^2]."""
        return self.strength * self.stiffness / (self.line_density * self.length**3) if self.event == "weight" else 0.0

    @property
    def period(self) -> float:
        """Period of the slowest mode, for bending and, with weight, swinging [s]."""
        factor = 22.373 if self.both_ends else 3.516
        square = factor**2 * self.stiffness / (self.line_density * self.length**4) + 1.44 * self.gravity / self.length
        return 2 * math.pi / math.sqrt(square)

    @property
    def viscosity(self) -> float:
        """Kelvin-Voigt viscosity that damps the slowest mode by `damping_ratio` [Pa s]."""
        return self.youngs_modulus * 2 * self.damping_ratio * self.period / (2 * math.pi)

    @property
    def time_step(self) -> float:
        """Between a hundredth of the period and all of it [s]."""
        return 0.01 * self.coarseness * self.period

    @property
    def steps(self) -> int:
        """Two periods, or 200."""
        return max(2, min(200, math.ceil(2 * self.period / self.time_step)))

    @property
    def curvature(self) -> float:
        """Natural curvature of the event: `strength` of one turn every four edges, or turns of the rod [1/m]."""
        edge = self.length / (self.nodes - 1)
        most = 2 * math.pi / (4 * edge)
        return self.strength * most if "curl" in self.event else min(most, self.strength / self.length)


def draw_case(number: int, methods: tuple[str, ...] = METHODS, *, seed: int = SEED, damped: bool = False) -> StressCase:
    """Return the case of a number and a seed, with or without viscosity: always the same."""
    rng = np.random.default_rng([seed, number])

    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    event = EVENTS[number % len(EVENTS)]
    planar = bool(rng.random() < 0.4)
    direction = rng.normal(size=3) * ((1.0, 0.0, 1.0) if planar else (1.0, 1.0, 1.0))
    strengths = {
        "load": (0.1, 100.0),  # P L^2 / EI
        "jump": (0.01, 0.3),  # relative to the length
        "flip": (0.5, 30.0),  # radians of the rod's turn
        "curl": (0.01, 1.0),  # relative to one turn per four edges
        "drawn curl": (0.01, 1.0),
        "weight": (0.1, 1000.0),  # w L^3 / EI
    }
    radius = log(1e-5, 0.1)
    return StressCase(
        number=number,
        method=str(rng.choice(methods)),
        event=event,
        youngs_modulus=log(1e4, 1e11),
        radius=radius,
        length=radius * log(10.0, 1e4),
        nodes=round(log(2, 5000)),
        coarseness=log(1.0, 100.0),
        strength=log(*strengths[event]),
        direction=direction / np.linalg.norm(direction),
        both_ends=bool(rng.random() < 0.3),
        planar=planar,
        damping_ratio=log(*DAMPING_RATIOS) if damped else 0.0,
    )


def _coil(case: StressCase) -> np.ndarray:
    """Points of a helix drawn with the case's curvature, its nodes evenly spaced; its pitch shows in three dimensions.

    Starts at the origin along x, and stays in the plane x-z where the case is planar.
    """
    rise = 0.0 if case.planar else 0.2
    turn = case.curvature * case.length / (case.nodes - 1)
    angle = turn * np.arange(case.nodes - 1)
    edges = np.column_stack([np.cos(angle), np.full_like(angle, rise), np.sin(angle)]) / math.hypot(1.0, rise)
    return np.vstack([np.zeros(3), np.cumsum(edges, axis=0)]) * case.length / (case.nodes - 1)


def build(case: StressCase, **changes: object) -> withe.Simulation:
    """The simulation of a case, before its event; `changes` replace options of `Scene.build`."""
    weight = case.gravity * case.direction
    scene = withe.Scene(gravity=tuple(weight))
    material = withe.Material(
        youngs_modulus=case.youngs_modulus, poisson_ratio=0.5, density=1000.0, viscosity=case.viscosity
    )
    drawn = case.event == "drawn curl"
    x = np.linspace(0.0, case.length, case.nodes)
    points = _coil(case) if drawn else np.column_stack([x, 0 * x, 0 * x])
    curl = case.event == "curl" and case.nodes > 2
    rod = scene.add_rod(
        points=points,
        radius=case.radius,
        material=material,
        normal=None if drawn else (0, 0, 1),
        natural="straight" if drawn and case.number % 2 else "as_built",
        natural_curvature=natural_curvature_of(case, 0) if curl else None,
        name="rod",
    )
    scene.clamp(rod.start, name="wall")
    if case.both_ends and case.nodes > 2:
        scene.clamp(rod.end, name="far wall")
    scene.add_force(rod.node(load_of(case, 0)[0]), (0, 0, 0), name="load")
    options: dict[str, object] = {"time_step": case.time_step}
    if case.method == "error-controlled":
        options |= {"tolerance": 1e-3 * case.length, "duration": case.steps * case.time_step}
    else:
        options["integrator"] = case.method
    return scene.build(**(options | changes))


def natural_curvature_of(case: StressCase, moment: int) -> tuple[float, float]:
    """After the event of a moment: in the plane x-z, or at an angle to both directors [1/m]."""
    if case.event not in ("curl", "flip") or case.nodes == 2:
        return 0.0, 0.0
    k = case.curvature * (-1.0 if case.event == "flip" and moment == 1 else 1.0)
    return (k, 0.0) if case.planar else (0.8 * k, 0.6 * k)


def load_of(case: StressCase, moment: int) -> tuple[int, np.ndarray]:
    """Node and force [N] after the event of a moment."""
    node = case.nodes // 2 if case.both_ends else case.nodes - 1
    # A rod that is curved as drawn and naturally has no other drive.
    strength = {"load": case.strength, "drawn curl": 3.0 * (case.number % 2 == 0)}.get(case.event, 0.0)
    size = strength * case.stiffness / case.length**2
    return node, size * case.direction * (1.0 if moment == 0 else -1.0)


def wall_of(case: StressCase, moment: int) -> np.ndarray:
    """Return directors of the wall of a straight rod, rows d1, d2, tangent; -1: of the far wall."""
    frame = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    return frame @ _jump(case, moment).T if case.event == "jump" and moment >= 0 else frame


def _jump(case: StressCase, moment: int) -> np.ndarray:
    axis = np.array([0.0, 1.0, 0.0]) if case.planar else case.direction
    return _rotation(0.5 * math.pi * case.strength * (1.0 if moment == 0 else -1.0) * axis)


def events(case: StressCase, simulation: withe.Simulation, moment: int) -> None:
    """Apply the event before the first step (moment 0) and halfway (moment 1)."""
    if case.event in ("load", "drawn curl"):
        simulation.set("load", force=tuple(load_of(case, moment)[1]))
    elif case.event == "jump":
        place = case.strength * case.length * case.direction * (moment == 0)
        simulation.move("wall", position=place, rotation=_jump(case, moment))
    elif case.event == "flip" and case.nodes > 2:
        simulation.set("rod", natural_curvature=natural_curvature_of(case, moment))


def _rotation(vector: np.ndarray) -> np.ndarray:
    """Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
