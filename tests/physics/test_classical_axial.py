"""Columns that shorten before they buckle, beams under tension, and a tapered arm that a tendon bends."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import rods
import withe
from cases import measured
from convergence import assert_order


def is_stable(simulation: withe.Simulation) -> bool:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", withe.BranchChangedWarning)
        return simulation.equilibrium(stable=False).stable


@pytest.mark.case(
    "stability",
    "Buckling load of a compressible column (bracket)",
    source="P (1 - P / EA) = pi^2 EI / L^2 [Magnusson, Ristinmaa and Ljung 2001]",
)
@pytest.mark.parametrize("slenderness", [0.05, 0.15, 0.22])  # pi^2 B / (EA L^2)
def test_a_column_that_shortens_buckles_at_a_greater_load(slenderness: float) -> None:
    """P (1 - P / EA) = pi^2 B / L^2 [Magnusson, Ristinmaa and Ljung 2001, Int. J. Solids Struct. 38]."""
    axial = np.pi**2 / slenderness
    scene = rods.weightless()
    column = rods.straight(scene, 60, stiffness=rods.stiffness(stretch=axial))
    scene.pin(column.start)
    scene.pin(column.end, free=(1.0, 0.0, 0.0))
    push = scene.add_force(column.end, (0.0, 0.0, 0.0))
    critical = 0.5 * axial * (1.0 - np.sqrt(1.0 - 4.0 * slenderness))
    for share in (0.998, 1.002):
        simulation = rods.sharp(scene, planar=True)
        simulation.set(push, force=(-share * critical, 0.0, 0.0))
        measured(share - 1.0)
        assert is_stable(simulation) == (share < 1.0)


@pytest.mark.case(
    "stability", "Buckling strain of a column that grows between walls (bracket)", source="4 pi^2 EI / (EA L^2)"
)
def test_a_column_that_grows_between_walls_buckles_by_its_strain() -> None:
    """4 pi^2 B / (EA L^2), as under heat; of first order in the strain itself, and of second in the mesh."""
    axial = 1e5
    critical = 4.0 * np.pi**2 / axial
    for share in (0.995, 1.005):
        scene = rods.weightless()
        column = rods.straight(scene, 60, stiffness=rods.stiffness(stretch=axial))
        scene.clamp(column.start)
        scene.clamp(column.end)
        simulation = rods.sharp(scene, planar=True)
        simulation.set(column, natural_stretch=1.0 + share * critical)
        measured(share - 1.0)
        assert is_stable(simulation) == (share < 1.0)


def tensioned(w: float, tension: float) -> float:
    """Characteristic function of a clamped beam under tension, B = m = L = 1, over its growth; 0 at its frequencies."""
    root = np.hypot(0.5 * tension, w)
    a, b = np.sqrt(root - 0.5 * tension), np.sqrt(root + 0.5 * tension)
    return 2.0 * a * b * (1.0 / np.cosh(b) - np.cos(a)) + (b * b - a * a) * np.sin(a) * np.tanh(b)


@pytest.mark.case(
    "dynamics",
    "Frequencies of a clamped beam under tension, modes 1 to 3",
    source="characteristic equation of the beam",
)
@pytest.mark.parametrize("tension", [20.0, 400.0])
def test_a_clamped_beam_under_tension_vibrates_as_theory_says(tension: float) -> None:
    grid = np.linspace(1.0, 400.0, 4000)
    signs = np.sign([tensioned(w, tension) for w in grid])
    changes = np.flatnonzero(signs[:-1] * signs[1:] < 0.0)[:3]
    right = [brentq(tensioned, grid[i], grid[i + 1], args=(tension,)) for i in changes]
    errors = []
    for edges in (30, 60, 120):
        scene = rods.weightless()
        beam = rods.straight(scene, edges)
        scene.clamp(beam.start)
        scene.clamp(beam.end, free=(1.0, 0.0, 0.0))
        scene.add_force(beam.end, (tension, 0.0, 0.0))
        simulation = rods.sharp(scene, planar=True)
        simulation.equilibrium()
        errors.append(np.abs(2.0 * np.pi * simulation.linearise().frequencies(3) / right - 1.0).max())
    measured(errors[-1])
    assert errors[0] < 1.5e-3
    assert errors[-1] < 2.5e-4


@pytest.mark.case("actuation", "Tip of a tapered arm with a tendon", source="curvature T h / EI(s), by quadrature")
def test_a_tendon_bends_a_tapered_arm_by_its_stiffness_along_it() -> None:
    """Curvature T h / EI(s), by quadrature."""
    pull, offset = 2.0, 0.02

    def bend(s: float) -> float:
        return float((1.0 - 0.5 * s) ** 4)

    def turn(s: float) -> float:
        return float(quad(lambda x: pull * offset / bend(x), 0.0, s)[0])

    right = np.array((quad(lambda s: np.cos(turn(s)), 0.0, 1.0)[0], 0.0, quad(lambda s: np.sin(turn(s)), 0.0, 1.0)[0]))
    errors = []
    for edges in (20, 40, 80):
        scene = rods.weightless()
        middle = (np.arange(edges) + 0.5) / edges
        values = np.array([(bend(s), bend(s)) for s in middle])
        arm = rods.straight(scene, edges, stiffness=rods.stiffness(bend=values), normal=(0.0, 0.0, 1.0))
        scene.clamp(arm.start)
        scene.add_tendon(arm, offset=(offset, 0.0), tension=pull)
        simulation = rods.sharp(scene)
        simulation.equilibrium()
        errors.append(np.linalg.norm(simulation.positions(arm)[-1] - right))
    measured(errors[-1], "L")
    assert errors[-1] < 1e-4
    assert_order(np.array(errors), order=2.0, slack=0.3)
