"""Linear and angular momentum as they are read out: what the kinetic energy says, and rigid bodies."""

import numpy as np
import pytest

import rods
import withe
from convergence import assert_order_at_least

RADIUS = 0.05


def star(flat, planar, integrator="implicit_midpoint", step=1e-3):
    """Two rods joined at a right angle, a mass at one end; drawn in a plane, or one limb bent out of it."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=2e3), "line_density": 1.0, "radius": RADIUS}
    s = np.linspace(0.0, 0.5, 7)
    body = scene.add_rod(start=(0.1, 0.2, 0), end=(0.9, 0.2, 0), nodes=9, name="body", **parts)
    limb = scene.add_rod(
        points=np.stack([0.9 + 0 * s, 0.2 + s, (0.0 if flat else 0.8) * s**2], axis=1), name="limb", **parts
    )
    scene.join(body.end, limb.start)
    scene.add_mass(limb.end, 0.3)
    return scene.build(integrator=integrator, time_step=step, planar=planar, adaptive=False)


def turning(simulation, omega, velocity):
    return np.cross(omega, simulation.positions()) + velocity


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_momenta_are_what_kinetic_energy_changes_by_with_a_common_motion(planar):
    """T(v + c + w x r) - T(v - c - w x r) = 2 (P . c + J . w), J without spins, which set_velocities leaves alone."""
    simulation = star(planar, planar)
    simulation.set_velocities(None, turning(simulation, (0, 0, 2.0), (0.3, -0.1, 0)))
    simulation.step(100)
    velocities = simulation.velocities()
    total = simulation.momentum()
    rest = simulation.copy()
    rest.set_velocities(None, 0.0 * velocities)
    spins = rest.momentum()
    np.testing.assert_allclose(spins.linear, 0.0, atol=1e-15)

    def kinetic(added):
        simulation.set_velocities(None, velocities + added)
        return simulation.energy().kinetic

    axes = np.eye(3)[:2] if planar else np.eye(3)
    for c in axes:
        common = np.broadcast_to(c, velocities.shape)
        assert 0.5 * (kinetic(common) - kinetic(-common)) == pytest.approx(total.linear @ c, abs=1e-11)
    for w in np.eye(3)[2:] if planar else np.eye(3):
        common = np.cross(w, simulation.positions())
        expected = (total.angular - spins.angular) @ w
        assert 0.5 * (kinetic(common) - kinetic(-common)) == pytest.approx(expected, abs=1e-11)


@pytest.mark.case("dynamics", "Angular momentum of a rod that turns", source="m L^2 w / 12")
def test_a_straight_rod_that_turns_carries_a_twelfth_of_its_mass_times_its_length_squared():
    scene = rods.weightless()
    rod = scene.add_rod(
        start=(1, 2, 0), end=(3, 2, 0), nodes=5, stiffness=rods.stiffness(), line_density=1.5, radius=RADIUS
    )
    simulation = scene.build()
    simulation.set_velocities(rod, turning(simulation, (0, 0, 3.0), (0, 0, 0)))
    mass, centre = 3.0, np.array([2.0, 2.0, 0.0])
    velocity = np.cross((0, 0, 3.0), centre)
    momentum = simulation.momentum()
    np.testing.assert_allclose(momentum.linear, mass * velocity, rtol=1e-14)
    expected = mass * np.cross(centre, velocity) + (0, 0, mass * 2.0**2 / 12.0 * 3.0)
    np.testing.assert_allclose(momentum.angular, expected, rtol=1e-14)


def test_a_shaft_that_spins_about_itself_carries_twice_its_energy_over_its_speed():
    """Edges and the frame of the clamp that drives them: rigid rotation has J = 2 T / omega.

    A frame's velocity is that of a vector of length 2 tan(angle / 2) a step, greater by (omega dt)^2 / 12.
    """
    scene = rods.weightless()
    shaft = rods.straight(scene, 6, radius=RADIUS, stiffness=rods.stiffness(viscous_time=0.5))
    scene.clamp(shaft.start)
    simulation = scene.build(integrator="backward_euler", time_step=1e-2, planar=False)
    speed = 2.0
    simulation.move(shaft.start, path=lambda t: ((0, 0, 0), rods.rotation((1, 0, 0), speed * t)))
    simulation.step(1000)
    np.testing.assert_allclose(simulation.spins(shaft), speed, rtol=1e-9)
    angular = simulation.momentum().angular
    assert angular[0] == pytest.approx(2.0 * simulation.energy().kinetic / speed, rel=(speed * 1e-2) ** 2 / 12.0)
    assert angular[0] > speed * 0.5 * RADIUS**2  # of the edges alone: rho (I1 + I2) L omega
    np.testing.assert_allclose(angular[1:], 0.0, atol=1e-14)


def test_a_scene_in_its_plane_and_in_space_has_the_same_momenta():
    """Frames of joints turn about the plane's normal, whichever way the plane was laid."""
    momenta = []
    for planar in (True, False):
        simulation = star(True, planar)
        simulation.set_velocities(None, turning(simulation, (0, 0, 2.0), (0.3, -0.1, 0)))
        simulation.step(50)
        momenta.append(simulation.momentum())
    np.testing.assert_allclose(momenta[0].linear, momenta[1].linear, atol=1e-10)
    np.testing.assert_allclose(momenta[0].angular, momenta[1].angular, atol=1e-10)


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "fourth_order"])
def test_angular_momentum_of_joined_rods_is_kept(integrator, planar):
    simulation = star(planar, planar, integrator, 2e-3)
    simulation.set_velocities(None, turning(simulation, (0, 0, 2.0), (0.3, -0.1, 0)))
    simulation.step(1)
    before = simulation.momentum()
    simulation.step(500)
    after = simulation.momentum()
    np.testing.assert_allclose(after.linear, before.linear, atol=1e-10)
    np.testing.assert_allclose(after.angular, before.angular, atol=1e-9)


def test_momentum_is_a_copy_with_names():
    simulation = star(False, False)
    momentum = simulation.momentum()
    assert isinstance(momentum, withe.Momentum)
    momentum.linear[:] = 7.0
    assert simulation.momentum().linear[0] == 0.0


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_reactions_of_a_clamp_are_what_momenta_change_by_and_what_does_the_work(integrator, planar):
    """A clamp that moves and turns evenly; `exact` is what of a step's balances is, the other is of second order.

    In space a step turns by its Cayley vector, and so do the moments of energy-momentum steps in a plane.
    """
    scene = rods.weightless()
    rod = rods.straight(scene, 11, stiffness=rods.stiffness(stretch=1e3), normal=(0, 0, 1))
    wall = scene.clamp(rod.start)
    axis = np.array((0.0, 1.0, 0.0) if planar else (0.36, 0.8, 0.48))
    cross = np.cross(np.eye(3), axis)

    def pose(t):
        turn = np.eye(3) + np.sin(0.8 * t) * cross + (1.0 - np.cos(0.8 * t)) * cross @ cross
        return (0.2 * t, 0.0, 0.1 * t), turn

    def balances(step):
        simulation = scene.build(
            integrator=integrator,
            time_step=step,
            planar=planar,
            adaptive=False,
            solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
        )
        simulation.move(wall, path=pose)
        simulation.step(2)
        errors, scales = np.zeros(2), np.zeros(2)
        for _ in range(round(1.0 / step)):
            t, work, angular = simulation.time, simulation.energy().work, simulation.momentum().angular
            simulation.step()
            reaction = simulation.reaction(wall)
            done = step * (reaction.force @ (0.2, 0.0, 0.1) + 0.8 * reaction.moment @ axis)
            middle = pose(t + 0.5 * step)[0]
            twirl = step * (np.cross(middle, reaction.force) + reaction.moment)
            off = np.linalg.norm(simulation.momentum().angular - angular - twirl)
            errors = np.maximum(errors, (abs(simulation.energy().work - work - done), off))
            scales = np.maximum(scales, (abs(done), np.linalg.norm(twirl)))
        return errors / scales

    found = np.array([balances(step) for step in (0.04, 0.02, 0.01)])
    exact = {"work": planar and integrator == "implicit_midpoint", "moment": True}
    for column, name in enumerate(exact):
        if exact[name]:
            assert found[:, column].max() < 1e-9
        else:
            assert_order_at_least(found[:, column], 2.0, slack=0.2)
            assert found[-1, column] < 1e-4


@pytest.mark.parametrize("stiffness", [None, (50.0, 0.5)], ids=["rigid", "yielding"])
@pytest.mark.parametrize(
    ("integrator", "options"),
    [
        ("fourth_order", {}),
        ("implicit_midpoint", {"tolerance": 1e-4, "duration": 1.0}),
        ("energy_momentum", {"tolerance": 1e-4, "duration": 1.0}),
        ("backward_euler", {"tolerance": 1e-2, "duration": 1.0}),
    ],
)
def test_wrenches_are_means_over_all_parts_of_a_time_step(integrator, options, stiffness):
    """By them momenta grow, of fourth-order steps and of those that error control cuts."""
    scene = rods.weightless()
    rod = rods.straight(scene, 11, stiffness=rods.stiffness(stretch=1e3), normal=(0, 0, 1))
    simulation = scene.build(
        integrator=integrator,
        time_step=0.02,
        solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
        **options,
    )
    hand = simulation.grasp(rod, 0.2, 0.2, stiffness=stiffness)
    turn = rods.rotation((1.0, 2.0, -1.0), 0.5) if stiffness else None  # what is turned itself has moments of 2nd order
    hand.move((0.3, 0.1, 0.2), turn, over=0.2)
    pieces = simulation.statistics.steps
    for _ in range(10):
        before = simulation.momentum()
        simulation.step()
        after, wrench = simulation.momentum(), simulation.wrench(hand, about=(0.0, 0.0, 0.0))
        np.testing.assert_allclose(after.linear - before.linear, 0.02 * wrench.force, atol=1e-11)
        if integrator != "backward_euler":  # which does not keep angular momentum
            np.testing.assert_allclose(after.angular - before.angular, 0.02 * wrench.moment, atol=1e-11)
    assert integrator == "fourth_order" or simulation.statistics.steps > pieces + 20
