"""Axial forces of rods that turn: those that act, whatever the step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe

LENGTH, RADIUS, DENSITY, RATE, RAMP = 0.3, 5e-3, 1000.0, 10.0, 0.5


def whirled(modulus: float, **options: Any) -> tuple[withe.Simulation, withe.Rod, withe.Support]:
    """A damped arm on a hub that turns steadily in the end."""
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=modulus, density=DENSITY, viscosity=1e-2 * modulus)
    arm = scene.add_rod(start=(0, 0, 0), end=(LENGTH, 0, 0), nodes=31, radius=RADIUS, material=material)
    hub = scene.clamp(arm.start)
    simulation = scene.build(**options)

    def turned(t: float) -> tuple[tuple[float, float, float], Rotation]:
        angle = RATE * (0.5 * t * t / RAMP if t < RAMP else t - 0.5 * RAMP)
        return (0.0, 0.0, 0.0), Rotation.from_rotvec([0.0, 0.0, angle])

    simulation.move(hub, path=turned)
    simulation.run(1.5, progress=False)
    return simulation, arm, hub


@pytest.mark.case("dynamics", "Tension of an arm that turns steadily", source="N = rho A w^2 (L^2 - x^2) / 2")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler"])
@pytest.mark.parametrize("step", [1e-3, 5e-3])
@pytest.mark.parametrize("modulus", [1e8, 1e9])
def test_an_arm_that_turns_steadily_pulls_as_its_mass_does(modulus: float, step: float, integrator: Any) -> None:
    """N = rho A w^2 (L^2 - x^2) / 2: where midpoint steps end, edges are longer by what EA makes 70 times that."""
    simulation, arm, hub = whirled(modulus, time_step=step, integrator=integrator)
    x = LENGTH * (np.arange(30) + 0.5) / 30
    pull = 0.5 * DENSITY * np.pi * RADIUS**2 * RATE**2 * (LENGTH**2 - x**2)
    for _ in range(3):
        np.testing.assert_allclose(simulation.tensions(arm), pull, atol=0.02 * pull[0])
        simulation.step()
    assert np.linalg.norm(simulation.reaction(hub).force) == pytest.approx(pull[0], rel=0.02)


def test_axial_forces_in_records_batches_and_copies_are_those_of_the_simulation(tmp_path: Any) -> None:
    simulation, arm, _ = whirled(1e8, time_step=2e-3)
    now = simulation.tensions(arm)
    np.testing.assert_array_equal(simulation.copy().tensions(arm), now)
    np.testing.assert_array_equal(withe.Batch([simulation.copy(), simulation.copy()]).tensions(arm)[1], now)
    snapshot = simulation.snapshot()
    record = simulation.run(0.01, progress=False)
    np.testing.assert_array_equal(record.tensions(arm)[-1], simulation.tensions(arm))
    simulation.restore(snapshot)
    np.testing.assert_array_equal(simulation.tensions(arm), now)
