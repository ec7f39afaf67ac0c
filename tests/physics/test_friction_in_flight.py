"""Rods that fly, meet and rub on each other: friction between them gives them no momentum, at any step."""

from typing import Any

import numpy as np
import pytest

import withe

DENSITY, HALF_LENGTH, SPEED = 1200.0, 0.1, 0.6


def tumbling(number: int) -> tuple[withe.Scene, list[Any], np.random.Generator]:
    """Three curled rods of different radii above each other."""
    random = np.random.default_rng([7, number])
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rods, height = [], 0.0
    for _ in range(3):
        radius = random.uniform(3e-3, 6e-3)
        height += radius
        s = np.linspace(-HALF_LENGTH, HALF_LENGTH, int(random.integers(9, 16)))
        angle = random.uniform(0.0, np.pi)
        line = np.stack([s, random.uniform(-2.0, 2.0) * s**2, 0.0 * s], axis=1)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        material = withe.Material(
            youngs_modulus=10.0 ** random.uniform(5.5, 6.5), poisson_ratio=0.5, density=DENSITY,
            viscosity=random.choice([0.0, 100.0]),
        )  # fmt: skip
        rods.append(scene.add_rod(points=line @ turn.T + (0, 0, height), radius=radius, material=material))
        height += radius + 1e-3
    return scene, rods, random


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("model", ["anchored", "implicit"])
@pytest.mark.parametrize("number", range(6))
def test_friction_between_rods_in_flight_changes_no_momentum(number: int, model: Any, integrator: Any) -> None:
    """Friction acts equally on both rubbing rods, about any point.

    It once acted where a step ends, and changed angular momentum at first order.
    """
    scene, rods, random = tumbling(number)
    scene.enable_contact(friction=random.uniform(0.2, 1.0), friction_model=model)
    time_step = 10.0 ** random.uniform(-4.0, -3.0)
    simulation = scene.build(integrator=integrator, time_step=time_step, planar=False)
    for k, rod in enumerate(rods):
        nodes = len(simulation.positions(rod))
        velocity = np.append(random.uniform(-0.5, 0.5, 2), SPEED * (1 - k))
        simulation.set_state(
            rod, velocities=np.tile(velocity, (nodes, 1)), spins=np.full(nodes - 1, random.uniform(-50.0, 50.0))
        )
    before, rubbed = simulation.momentum(), 0
    scale = DENSITY * np.pi * 3e-3**2 * 2.0 * HALF_LENGTH * SPEED  # momentum of the thinnest rod there could be
    for _ in range(60):
        simulation.step(3)
        rubbed += any(np.linalg.norm(c["friction"]) > 0.0 for c in simulation.contacts())
        now = simulation.momentum()
        np.testing.assert_allclose(now.angular, before.angular, atol=1e-8 * scale * HALF_LENGTH)
        np.testing.assert_allclose(now.linear, before.linear, atol=1e-8 * scale)
    assert rubbed > 3


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("rising", [0.0, 0.5])
def test_friction_only_takes_energy_from_rods_that_are_thrown_on_a_floor(integrator, rising):
    """Inertia of an energy-momentum step is the same if an edge turns by 2 pi more; friction at its surface is not.

    Newton's method came to such a turn, whose slip goes the other way: rods were thrown with 20 times their energy.
    """
    for seed in (5, 20, 24, 29, 37):
        random = np.random.default_rng(seed)
        way = random.normal(size=3) * [1.0, 1.0, 0.5]
        points = np.linspace(0.0, 0.15, 4)[:, None] * way / np.linalg.norm(way)
        points[:, 2] += 5.5e-3 - points[:, 2].min()
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        rod = scene.add_rod(points=points, radius=4e-3, material=rubber)
        floor = scene.add_floor(friction=0.8)
        scene.enable_contact()
        simulation = scene.build(integrator=integrator, time_step=5e-3, planar=False)
        lift = np.array([0.0, 0.0, rising])
        simulation.move(floor, path=lambda time, lift=lift: time * lift)
        thrown = random.normal(size=3) * [0.4, 0.4, 0.0] - [0.0, 0.0, 0.5]
        spin = 3.0 * random.normal(size=3)
        simulation.set_velocities(rod, lift + thrown + np.cross(spin, points - points.mean(0)))
        start = simulation.energy().kinetic
        dissipated = []
        for _ in range(20):
            simulation.step()
            dissipated.append(simulation.energy().dissipated)
        assert np.diff(dissipated).min() > -1e-3 * start
