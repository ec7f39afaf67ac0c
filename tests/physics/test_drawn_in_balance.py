"""Rods whose natural shape is the one with which they hang as they are drawn."""

from __future__ import annotations

import numpy as np
import pytest

import withe
from cases import measured

STIFF = withe.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1200.0)


def drawn(seed: int, nodes: int, both_ends: bool = False, plane: bool = False) -> tuple[withe.Simulation, np.ndarray]:
    """A drawn curve 0.3 m long, clamped, with a load on its last node if that is free."""
    random = np.random.default_rng([61, seed])
    s = np.linspace(0.0, 1.0, nodes)
    waves = random.uniform(-0.03, 0.03, (3, 3)) * ((1, 0, 1) if plane else (1, 1, 1))
    points = np.outer(s, (0.1, 0.0, -0.28)) + np.sin(np.outer(s, (2.0, 4.0, 6.0))) @ waves
    scene = withe.Scene()
    rod = scene.add_rod(points=points, radius=1e-3, material=STIFF, natural="in_balance", name="rod")
    scene.clamp(rod.start)
    if both_ends:
        scene.clamp(rod.end)
    else:
        scene.add_force(rod.end, random.uniform(-5e-3, 5e-3, 3) * ((1, 0, 1) if plane else (1, 1, 1)))
    return scene.build(time_step=1e-3), points


def sag(seed: int, nodes: int, **options: bool) -> float:
    """By how much nodes move to the equilibrium [m]."""
    simulation, points = drawn(seed, nodes, **options)
    assert simulation.plan.planar == options.get("plane", False)
    simulation.equilibrium()
    return float(np.abs(simulation.positions("rod") - points).max())


@pytest.mark.case("inverse", "Natural shape of a rod that hangs as it is drawn", source="the drawn shape")
@pytest.mark.parametrize("plane", [False, True], ids=["space", "plane"])
@pytest.mark.parametrize("seed", range(4))
def test_a_rod_drawn_in_balance_hangs_as_it_is_drawn(seed: int, plane: bool) -> None:
    """Beside the clamp at second order: its bending there is that of the next stencil. It would sag by centimetres."""
    coarse, fine = (sag(seed, nodes, plane=plane) for nodes in (21, 61))
    measured(1e6 * fine, "um")
    assert fine < 2e-5
    assert fine < 0.25 * coarse


@pytest.mark.parametrize("plane", [False, True], ids=["space", "plane"])
@pytest.mark.parametrize("seed", range(4))
def test_a_rod_between_two_clamps_is_in_balance_as_drawn(seed: int, plane: bool) -> None:
    assert sag(seed, 41, both_ends=True, plane=plane) < 2e-5


def test_it_stays_at_rest_in_time() -> None:
    simulation, points = drawn(1, 61)
    simulation.run(0.2, progress=False)
    np.testing.assert_allclose(simulation.positions("rod"), points, atol=4e-5)


def test_a_rod_that_nothing_holds_is_refused() -> None:
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=11, radius=1e-2, material=STIFF, natural="in_balance")
    with pytest.raises(ValueError, match="finds no shape that holds 'rod 1' as drawn"):
        scene.build()


def test_natural_curvature_and_balance_exclude_each_other() -> None:
    with pytest.raises(ValueError, match="give neither"):
        withe.Scene().add_rod(
            start=(0, 0, 0),
            end=(1, 0, 0),
            nodes=11,
            radius=1e-2,
            material=STIFF,
            natural="in_balance",
            natural_curvature=(1.0, 0.0),
        )
