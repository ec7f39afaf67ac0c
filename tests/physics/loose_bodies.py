"""Scenes of rigid bodies that slide, and of rods and bodies that fly at each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

import withe

Array = npt.NDArray[np.float64]
Things = list[tuple[withe.Rod | withe.Body, Array, Array | None]]
DrawSolid = Callable[[np.random.Generator], withe.solids.Solid]
G = 9.81


def on_slope(degrees: float) -> Array:
    """Return gravity on a slope that falls along x."""
    angle = np.radians(degrees)
    return G * np.array([np.sin(angle), 0.0, -np.cos(angle)])


def cloud(seed: int, friction: float, draw_solid: DrawSolid) -> tuple[withe.Scene, Things]:
    """Draw three rods and five bodies that fly at each other, with their velocities and spins."""
    draw = np.random.default_rng(seed)
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact(friction=friction)
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    axes = np.concatenate([np.eye(3), -np.eye(3), np.full((1, 3), 0.577), np.full((1, 3), -0.577)])
    draw.shuffle(axes)
    things: Things = []
    for i, axis in enumerate(axes):
        place = 0.13 * axis + draw.normal(size=3) * 0.005
        turn = np.linalg.qr(draw.normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        velocity = -0.5 * axis + draw.normal(size=3) * 0.05
        if i < 3:
            half = 0.05 * turn[:, 0]
            rod = scene.add_rod(start=place - half, end=place + half, nodes=11, radius=0.004, material=rubber)
            things.append((rod, velocity, None))
            continue
        solid = draw_solid(draw)
        body = scene.add_body(solid, density=10.0 ** draw.uniform(2.0, 4.0), position=place, rotation=turn)
        things.append((body, velocity, draw.normal(size=3) * 15.0))
    return scene, things


def assert_momenta_and_energy_stay(
    scene: withe.Scene, things: Things, friction: float, *, angular: float, total: float
) -> None:
    """Run a cloud; `angular` and, without friction, `total` are the allowed relative errors of momentum and energy."""
    simulation = scene.build(time_step=1e-3, solver=withe.Solver(force_tolerance=1e-10))
    for thing, velocity, spin in things:
        if isinstance(thing, withe.Body):
            simulation.set_velocity(thing, velocity, angular=spin)
        else:
            simulation.set_velocities(thing, np.tile(velocity, (11, 1)))
    before, energy = simulation.momentum(), simulation.energy().total
    scale = 2.0 * energy / 0.5  # sum of the moduli of linear momenta; times the size of the scene of angular ones
    met: set[tuple[str, ...]] = set()
    for _ in range(30):
        simulation.step(10)
        met |= {tuple(pair) for pair in simulation.contacts()["pair"]}
    after, now = simulation.momentum(), simulation.energy()
    assert len(met) >= 3
    np.testing.assert_allclose(after.linear, before.linear, atol=1e-9 * scale)
    np.testing.assert_allclose(after.angular, before.angular, atol=angular * 0.13 * scale)
    assert now.total + now.dissipated == pytest.approx(energy, rel=1e-6)
    if friction == 0.0:
        assert now.total == pytest.approx(energy, rel=total)
    else:
        assert now.dissipated > 0.01 * energy
