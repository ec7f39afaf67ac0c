"""Equilibria that are not stable are found on request, with as many falling motions as theory has."""

import numpy as np
import pytest

import rods
import withe


def falling(simulation):
    """Number of motions that lower the potential."""
    return int((np.real(simulation.linearise().frequencies(12)) < 0.0).sum())


def column(load, planar=True):
    """Pinned at both ends, unit length and bending stiffness, pressed by a load at the end that slides."""
    scene = rods.weightless()
    rod = rods.straight(scene, 60, normal=(0, 0, 1))
    scene.pin(rod.start)
    scene.pin(rod.end, free=(1, 0, 0))
    scene.add_force(rod.end, (-load, 0, 0))
    return scene.build(integrator="static", planar=planar), rod


@pytest.mark.case("stability", "Unstable modes of a straight column", source="Euler's loads below it", exact=True)
@pytest.mark.parametrize("modes", [0, 1, 2, 4])
def test_a_column_stays_straight_on_request_with_a_falling_motion_for_every_euler_load_that_it_carries_more_than(modes):
    load = 0.5 * (modes**2 + (modes + 1) ** 2) * np.pi**2
    simulation, rod = column(load)
    found = simulation.equilibrium(stable=False)
    assert found.stable == (modes == 0)
    assert not found.branch_changed
    np.testing.assert_allclose(simulation.positions(rod)[:, 1:], 0.0, atol=1e-12)
    assert falling(simulation) == modes
    assert simulation.equilibrium().stable
    assert (simulation.positions(rod)[-1, 0] < 0.9) == (modes > 0)


@pytest.mark.case("stability", "Unstable modes of a buckled strut", source="n - 1 [Maddocks 1984]", exact=True)
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("humps", [1, 2, 3])
def test_a_strut_between_clamps_stays_in_each_of_its_modes_on_request(humps, planar):
    """The n-th mode of a strut between held ends has n - 1 motions in its plane that lower the energy.

    One hump is stable, an S has one such motion, and an M has two [Maddocks 1984, Arch. Rational Mech. Anal. 85].
    """
    x = np.linspace(0.0, 1.0, 81)
    shape = {
        1: 1.0 - np.cos(2.0 * np.pi * x),
        2: np.sin(8.98682 * (x - 0.5)) / np.sin(0.5 * 8.98682) - 2.0 * (x - 0.5),
        3: 1.0 - np.cos(4.0 * np.pi * x),
    }[humps]
    scene = rods.weightless()
    strut = scene.add_rod(
        points=np.stack([x, 0.0 * x, 0.06 * shape], axis=1),
        radius=1e-3,
        stiffness=withe.Stiffness(stretch=1e6, bend=(1.0, 50.0), twist=50.0),
        line_density=1.0,
        natural="straight",
        normal=(0, 0, 1),
    )
    scene.clamp(strut.start)
    scene.clamp(strut.end)
    simulation = scene.build(integrator="static", planar=planar)
    found = simulation.equilibrium(stable=False)
    assert found.stable == (humps == 1)
    assert falling(simulation) == humps - 1
    height = simulation.positions(strut)[:, 2]
    peaks = (np.diff(np.sign(np.diff(height))) != 0).sum()
    assert peaks == {1: 1, 2: 2, 3: 3}[humps]
    assert simulation.equilibrium().stable


def test_a_batch_finds_unstable_equilibria_too():
    simulation, rod = column(15.0)
    batch = withe.Batch([simulation, simulation.copy()])
    assert not batch.equilibrium(stable=False).stable.any()
    np.testing.assert_allclose(batch.positions(rod)[..., 1:], 0.0, atol=1e-12)
    assert batch.equilibrium().stable.all()
