"""A rod does not depend on unrelated changes: other parts of the scene, a common motion, the states of other rods."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import withe

SOFT = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0)
STEEL = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
THIN, THICK = 3e-3, 5e-3  # [m]


@pytest.mark.parametrize("bar", ["falls", "is pinned", "spins"])
def test_a_heavy_neighbour_gives_a_rod_no_energy(bar: str) -> None:
    """A soft cantilever swings down: its energy stays 0 to a thousandth of what it has in motion."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=21, radius=THIN, material=SOFT)
    scene.clamp(arm.start)
    heavy = scene.add_rod(start=(-0.5, 5, 0), end=(0.5, 5, 0), nodes=5, radius=0.02, material=STEEL)
    if bar == "is pinned":
        scene.pin(heavy.start)
    simulation = scene.build()
    if bar == "spins":
        x = np.linspace(-0.5, 0.5, 5)
        simulation.set_velocities(heavy, np.stack([0.0 * x, 0.0 * x, 8.0 * x], axis=1))
    energies = []
    for _ in range(20):
        simulation.step(20)
        energies.append(simulation.energy(arm).total)
    weight = 1000.0 * np.pi * THIN**2 * 0.3 * 9.81 * 0.3  # m g L, what it could have in motion [J]
    print("neighbour:", bar, np.abs(energies).max() / weight)
    assert np.abs(energies).max() < 2e-3 * weight


@pytest.mark.parametrize("integrator", ["fourth_order", "energy_momentum"])
def test_a_common_motion_gives_a_rod_no_energy(integrator: Any) -> None:
    """Free flight of a rod that spins and swings: energy about its centre of mass, for any speed of that."""
    inner = []
    for speed in (0.0, 10.0, 100.0):
        scene = withe.Scene(gravity=(0, 0, 0))
        rod = scene.add_rod(start=(-0.15, 0, 0), end=(0.15, 0, 0), nodes=21, radius=THIN, material=SOFT)
        simulation = scene.build(integrator=integrator)
        x = np.linspace(-0.15, 0.15, 21)
        v = np.stack([0.0 * x, 20.0 * x, np.cos(np.pi * x / 0.15)], axis=1)
        simulation.set_velocities(rod, v - v.mean(axis=0) + (speed, 0.0, 0.0))
        mass = 1000.0 * np.pi * THIN**2 * 0.3

        def energy(now: Any = simulation, mass: float = mass) -> float:
            middle = now.momentum().linear / mass
            return float(now.energy().total - 0.5 * mass * middle @ middle)

        before = energy()
        simulation.step(300)
        inner.append(energy() / before - 1.0)
    print("common motion:", integrator, inner)
    assert np.abs(inner).max() < 2e-3


def dropped(change: Any) -> float:
    """Height of a rod that bounces, 70 ms after something else happened in the middle of its impact [m]."""
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.03), end=(0.2, 0, 0.03), nodes=11, radius=THICK, material=SOFT, name="a")
    scene.add_rod(start=(0, 5, 1), end=(0.2, 5, 1), nodes=5, radius=THICK, material=SOFT, name="b")
    scene.add_floor()
    simulation = scene.build(time_step=1e-3)
    simulation.step(72)
    change(simulation)
    simulation.step(70)
    return float(simulation.positions("a")[:, 2].mean())


CHANGES = {
    "another is moved": lambda s: s.set_state("b", positions=s.positions("b") + np.array((0.0, 0.1, 0.0))),
    "another is twisted": lambda s: s.set_state("b", twist=0.0),
    "it stays where it is": lambda s: s.set_state("a", positions=s.positions("a"), velocities=s.velocities("a")),
    "displaced by nothing": lambda s: s.displace_state(np.zeros(len(s.state_difference(s)))),
}


@pytest.mark.parametrize("change", CHANGES)
def test_states_that_are_given_leave_contacts_alone(change: str) -> None:
    """The remainder of an impact continues while other rods get new states."""
    alone, changed = dropped(lambda _: None), dropped(CHANGES[change])
    print("given states:", change, changed / alone - 1.0)
    assert changed == pytest.approx(alone, rel=1e-4)


def test_displacements_by_nothing_do_not_sink_a_rod() -> None:
    """As a filter does whose correction is zero."""
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, THICK), end=(0.2, 0, THICK), nodes=11, radius=THICK, material=SOFT)
    scene.add_floor(friction=0.4)
    simulation = scene.build(integrator="backward_euler")
    simulation.step(100)
    low = simulation.positions(rod)[:, 2].min()
    for _ in range(60):
        simulation.displace_state(np.zeros(len(simulation.state_difference(simulation))))
        simulation.step()
    assert simulation.positions(rod)[:, 2].min() == pytest.approx(low, abs=1e-3 * THICK)


def test_gliding_on_a_smooth_floor_stiffens_no_contact() -> None:
    """A rod that falls as it glides is as deep in the floor as one that only falls."""
    deepest = []
    for speed in (0.0, 10.0):
        scene = withe.Scene()
        s = np.linspace(0.0, 0.3, 21)
        soft = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0, viscosity=500.0)
        rod = scene.add_rod(points=np.stack([s, 0.0 * s, 0.03 + 0.05 * s], 1), radius=THICK, material=soft)
        scene.add_floor()
        simulation = scene.build(time_step=2e-4)
        simulation.set_velocities(rod, (speed, 0.0, 0.0))
        deep = 0.0
        for _ in range(700):
            simulation.step()
            contacts = simulation.contacts()
            deep = max(deep, -contacts["gap"].min(initial=0.0))
        deepest.append(deep / THICK)
    print("gliding:", deepest)
    assert deepest[1] == pytest.approx(deepest[0], rel=0.2)


def test_a_snapshot_of_thinner_rods_is_refused() -> None:
    """They would touch elsewhere."""

    def scene(radius: float) -> Any:
        drawn = withe.Scene()
        drawn.add_rod(start=(0, 0, 0.01), end=(0.3, 0, 0.01), nodes=11, radius=radius, material=SOFT)
        drawn.add_floor()
        return drawn.build()

    with pytest.raises(ValueError, match="another scene"):
        scene(8e-3).restore(scene(5e-3).snapshot())
