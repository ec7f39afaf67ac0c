"""Twisted rods and rings leave their axis or plane: Michell's ring, and clamped and pinned rods.

As for columns, a small side load measures the stiffness that is left.
"""

import numpy as np
import pytest

import rods
import theory
from cases import measured
from convergence import assert_order, zero_crossing

SIDE = 1e-5
SHARES = np.array((0.93, 0.95, 0.97, 0.98, 0.99))
BEND, TWIST = 1.0, 2.5


def ring(nodes, side):
    """A naturally straight rod closed to a ring of unit length, held by pins against rigid motion only."""
    angles = 2.0 * np.pi * np.arange(nodes) / nodes
    points = np.stack([np.cos(angles), np.sin(angles), np.zeros(nodes)], axis=1)
    points /= nodes * np.linalg.norm(points[1] - points[0])
    scene = rods.weightless()
    rod = scene.add_rod(
        points=points,
        closed=True,
        natural="straight",
        normal=(0.0, 0.0, 1.0),
        radius=1e-3,
        stiffness=rods.stiffness(bend=BEND, twist=TWIST),
        line_density=1.0,
    )
    scene.pin(rod.node(0))
    scene.pin(rod.node(nodes // 2), free=(1.0, 0.0, 0.0))
    scene.pin(rod.node(nodes // 4), free=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    if side:
        scene.add_force(rod.node(3 * nodes // 4), (0.0, 0.0, side))
    return scene, rod


MICHELL = 2.0 * np.pi * np.sqrt(3.0) * BEND / TWIST  # total twist [rad], [Michell 1889, Zajac 1962]


def ring_out_of_plane(nodes, twist, side):
    scene, rod = ring(nodes, side)
    simulation = rods.sharp(scene, planar=False)
    simulation.set(rod, natural_twist=twist)
    simulation.equilibrium()
    return simulation.positions(rod)[3 * nodes // 4, 2]


@pytest.mark.case("stability", "Twist at which a ring leaves its plane", source="2 pi sqrt(3) EI / GJ [Michell 1889]")
def test_twist_at_which_a_ring_leaves_its_plane_converges_at_second_order():
    errors = []
    for nodes in (32, 64, 128):
        twists = SHARES * MICHELL
        sways = [ring_out_of_plane(nodes, twist, SIDE) for twist in twists]
        errors.append(zero_crossing(twists, sways) / MICHELL - 1.0)
    measured(errors[-1])
    assert_order(errors)
    assert abs(errors[-1]) < 5e-3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ring_stays_flat_below_michells_twist_and_leaves_its_plane_above(sign):
    assert abs(ring_out_of_plane(60, sign * 0.97 * MICHELL, 0.0)) < 1e-9
    scene, rod = ring(60, 0.0)
    simulation = rods.sharp(scene, planar=False)
    simulation.set(rod, natural_twist=sign * 1.03 * MICHELL)
    assert simulation.equilibrium().stable
    assert np.ptp(simulation.positions(rod)[:, 2]) > 0.01


def cut_ring_out_of_plane(edges, twist, side):
    """Both ends of a cut ring clamped where they meet, one of them turned about its tangent."""
    angles = 2.0 * np.pi * np.arange(edges + 1) / edges
    line = np.stack([np.sin(angles), 1.0 - np.cos(angles), np.zeros(edges + 1)], axis=1)
    line /= edges * np.linalg.norm(line[1] - line[0])
    scene = rods.weightless()
    rod = scene.add_rod(
        points=line,
        natural="straight",
        normal=(0.0, 0.0, 1.0),
        radius=1e-3,
        stiffness=rods.stiffness(bend=BEND, twist=TWIST),
        line_density=1.0,
    )
    scene.clamp(rod.start)
    scene.clamp(rod.end)
    # The ring of an isotropic rod that is straight by nature turns about its clamp for nothing, rolling as it goes.
    scene.pin(rod.node(edges // 2), free=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    scene.add_force(rod.node(edges // 4), (0.0, 0.0, side))
    simulation = rods.sharp(scene, planar=False)
    for part in (0.5, 1.0):
        simulation.move(rod.end, rotation=rods.rotation((1, 0, 0), part * twist))
        simulation.equilibrium()
    return simulation.positions(rod)[edges // 4, 2]


@pytest.mark.case("stability", "Twist of a cut ring with one end turned", source="[Michell 1889]")
def test_cut_ring_with_one_end_turned_has_the_same_critical_twist():
    """The clamp is a small imperfection of the discrete ring, so that pushes both ways are compared."""
    errors = []
    for edges in (64, 128, 256):
        ups, downs = (
            [cut_ring_out_of_plane(edges, share * MICHELL, side) for share in SHARES] for side in (SIDE, -SIDE)
        )
        errors.append(zero_crossing(SHARES, np.subtract(ups, downs)) - 1.0)
    measured(errors[-1])
    assert_order(errors)
    assert abs(errors[-1]) < 1e-3


def clamped_rod(edges, tension, side):
    scene = rods.weightless()
    # So stiff in twist that the ends turn by less than a radian.
    rod = rods.straight(scene, edges, stiffness=rods.stiffness(twist=10.0), normal=(0.0, 1.0, 0.0))
    scene.clamp(rod.start)
    scene.clamp(rod.end, free=(1.0, 0.0, 0.0))
    scene.add_force(rod.end, (tension, 0.0, 0.0))
    if side:
        scene.add_force(rod.node(edges // 2), (0.0, side, 0.0))
    return scene, rod


def twisted(edges, tension, moment, side):
    scene, rod = clamped_rod(edges, tension, side)
    simulation = rods.sharp(scene, planar=False)
    turns = max(1, int(np.ceil(moment / 10.0)))
    for k in range(turns):
        simulation.move(rod.end, rotation=rods.rotation((1, 0, 0), moment / 10.0 * (k + 1) / turns))
        result = simulation.equilibrium()
    return simulation, rod, result


@pytest.mark.case(
    "stability", "Critical moment of a clamped rod, with and without tension", source="linear theory, by determinant"
)
@pytest.mark.parametrize(("tension", "edges"), [(0.0, (16, 32, 64)), (100.0, (32, 64, 128))])
def test_critical_moment_of_a_clamped_rod_converges_at_second_order(tension, edges):
    exact = theory.critical_twisting_moment(tension)
    errors = []
    for n in edges:
        sways = []
        for share in SHARES:
            simulation, rod, _ = twisted(n, tension, share * exact, SIDE)
            sways.append(simulation.positions(rod)[n // 2, 1])
        errors.append(zero_crossing(SHARES, sways) - 1.0)
    measured(errors[-1])
    assert_order(errors)
    assert abs(errors[-1]) < 5e-3


def test_critical_moment_of_a_clamped_rod_without_tension_is_8_987():
    assert theory.critical_twisting_moment(0.0) == pytest.approx(8.987, abs=5e-4)
    simulation, rod, result = twisted(128, 0.0, 0.99 * 8.987, 0.0)
    assert result.stable
    assert np.abs(simulation.positions(rod)[:, 1:]).max() < 1e-9
    assert simulation.reaction(rod.end).moment[0] == pytest.approx(0.99 * 8.987, rel=1e-9)
    simulation, rod, result = twisted(128, 0.0, 1.01 * 8.987, 0.0)
    assert result.stable
    assert np.abs(simulation.positions(rod)[:, 1:]).max() > 0.01


def test_critical_moment_of_a_long_rod_under_tension_is_twice_the_root_of_tension_by_stiffness():
    """M^2 = 4 B T for an endless rod; at T L^2 / B = 2500 clamped ends add 0.2 % to M, and more tension less."""
    assert theory.critical_twisting_moment(2500.0) ** 2 == pytest.approx(4.0 * 2500.0, rel=5e-3)
    for share, straight in ((0.99, True), (1.01, False)):
        simulation, rod, result = twisted(400, 2500.0, share * theory.critical_twisting_moment(2500.0), 0.0)
        assert result.stable
        assert (np.abs(simulation.positions(rod)[:, 1:]).max() < 1e-9) == straight


@pytest.mark.case("stability", "Critical axial torque of a pinned rod", source="2 pi EI / L [Greenhill 1883]")
def test_critical_axial_torque_of_a_pinned_rod_converges_to_two_pi():
    """Torques that keep the direction of the axis have no potential: the stiffness is read off before it vanishes."""
    exact = 2.0 * np.pi
    errors = []
    for edges in (16, 32, 64):
        sways = []
        for share in SHARES:
            scene = rods.weightless()
            rod = rods.straight(scene, edges, normal=(0.0, 1.0, 0.0))
            scene.pin(rod.start)
            scene.pin(rod.end, free=(1.0, 0.0, 0.0))
            scene.add_moment(rod.end, (share * exact, 0.0, 0.0))
            scene.add_moment(rod.start, (-share * exact, 0.0, 0.0))
            scene.add_force(rod.node(edges // 2), (0.0, SIDE, 0.0))
            simulation = rods.sharp(scene, planar=False)
            simulation.equilibrium()
            sways.append(simulation.positions(rod)[edges // 2, 1])
        errors.append(zero_crossing(SHARES, sways) - 1.0)
    measured(errors[-1])
    assert_order(errors)
    assert abs(errors[-1]) < 5e-3
