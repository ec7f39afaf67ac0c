"""Equilibria are found from far away, at any slenderness, and what has none is an error."""

import numpy as np
import pytest

import rods
import withe


@pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])
def test_slender_rods_take_no_more_iterations_than_stout_ones(planar):
    """L / h = 100, 1e3, 1e4: EA L^2 / B = 4 (L / h)^2."""
    iterations = []
    for slenderness in (1e2, 1e3, 1e4):
        scene = withe.Scene(gravity=(0.0, 0.0, -10.0))
        arm = rods.straight(scene, 100, stiffness=rods.stiffness(stretch=4.0 * slenderness**2))
        scene.clamp(arm.start)
        simulation = scene.build(integrator="static", planar=planar)
        result = simulation.equilibrium()
        assert result.stable
        iterations.append(result.iterations)
    print("iterations at L/h = 100, 1e3, 1e4:", *iterations)
    assert max(iterations) <= 1.2 * min(iterations), iterations


@pytest.mark.parametrize(("nodes", "turns_per_edge"), [(42, 0.19), (20, 0.24), (408, 0.02)])
def test_a_straight_rod_coils_into_its_natural_shape_where_no_force_is_left_to_measure_by(nodes, turns_per_edge):
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    arm = rods.straight(scene, nodes, stiffness=rods.stiffness(stretch=4e4))
    scene.clamp(arm.start)
    simulation = scene.build(integrator="static", planar=False)
    before = simulation.energy().total
    simulation.set(arm, natural_curvature=(0.0, 2.0 * np.pi * turns_per_edge * (nodes - 1)))
    strained = simulation.energy().total
    assert simulation.equilibrium().stable
    assert simulation.energy().bend < 1e-18 * (strained - before)


def smooth_curve(random, nodes):
    """Unit-length curve that starts along +x and wanders through space."""
    s = (np.arange(nodes - 1) + 0.5) / (nodes - 1)
    waves = np.arange(1, 4)
    sines = np.sin(0.5 * np.pi * np.outer(s, waves))
    yaw, pitch = (sines @ (random.normal(size=3) * 1.5 / waves) for _ in range(2))
    tangents = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=1)
    return np.vstack([np.zeros(3), np.cumsum(tangents, axis=0) / (nodes - 1)])


def ragged_curve(random, nodes):
    """The straight rod with every node but the first two thrown off by up to half an edge."""
    points = np.zeros((nodes, 3))
    points[:, 0] = np.linspace(0.0, 1.0, nodes)
    points[2:] += random.uniform(-0.5, 0.5, size=(nodes - 2, 3)) / (nodes - 1)
    return points


@pytest.mark.parametrize("curve", [smooth_curve, ragged_curve])
def test_of_fifty_random_starts_nearly_all_reach_a_stable_equilibrium(curve):
    """With its twin, a hundred starts; at least 95 % reach one, and the rest say that they did not."""
    random = np.random.default_rng(20240607)
    failures = 0
    for _ in range(50):
        scene = withe.Scene(gravity=(0.0, 0.0, -10.0))
        arm = scene.add_rod(
            points=curve(random, 41),
            natural="straight",
            stiffness=rods.stiffness(stretch=4e4),
            line_density=1.0,
            radius=1e-2,
        )
        scene.clamp(arm.start)
        simulation = scene.build(integrator="static")
        try:
            result = simulation.equilibrium()
        except withe.ConvergenceError:
            failures += 1
            continue
        assert np.isfinite(simulation.positions(arm)).all()
        failures += not result.stable
        # An equilibrium indeed: the wall carries the weight.
        weight = 10.0 * np.linalg.norm(np.diff(simulation.positions(arm), axis=0), axis=1).sum()
        assert simulation.reaction(arm.start).force[2] == pytest.approx(weight, rel=2e-2)
    print("stable equilibria from 50 starts:", 50 - failures)
    assert failures <= 2


def test_rod_that_is_thrown_about_comes_back_to_its_one_stable_shape():
    random = np.random.default_rng(7)
    scene = withe.Scene(gravity=(0.0, 0.0, -10.0))
    arm = rods.straight(scene, 40, stiffness=rods.stiffness(stretch=4e4))
    scene.clamp(arm.start)
    grip = scene.add_force(arm.end, (0.0, 0.0, 0.0))
    simulation = scene.build(integrator="static", planar=False)
    tips = []
    for _ in range(10):
        simulation.set(grip, force=random.normal(size=3) * 20.0)
        simulation.equilibrium()
        simulation.set(grip, force=(0.0, 0.0, 0.0))
        assert simulation.equilibrium().stable
        tips.append(simulation.positions(arm)[-1])
    np.testing.assert_allclose(tips, np.tile(tips[0], (10, 1)), atol=1e-6)


@pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])
def test_free_rod_under_gravity_has_no_equilibrium(planar):
    scene = withe.Scene()
    rods.straight(scene, 10)
    simulation = scene.build(integrator="static", planar=planar)
    before = simulation.positions()
    with pytest.raises(withe.ConvergenceError):
        simulation.equilibrium()
    np.testing.assert_array_equal(simulation.positions(), before)


@pytest.mark.parametrize("seed", range(8))
def test_drawn_cables_that_are_pulled_over_a_rough_floor_find_equilibria_all_the_way(seed):
    """Bent as they lie, they straighten and follow a hand; forces are within Coulomb's cone and add up to nothing."""
    random = np.random.default_rng(seed)
    nodes, radius, length = (60, 200, 400)[seed % 3], random.uniform(5e-4, 3e-3), 0.5
    friction, lgb = 10 ** random.uniform(-1.3, 0.0), 10 ** random.uniform(-2.0, -0.8)
    weight = 1180.0 * np.pi * radius**2 * 9.81  # [N/m]
    rubber = withe.Material(
        youngs_modulus=8.0 * weight * lgb**3 / (np.pi * radius**4), poisson_ratio=0.5, density=1180.0
    )
    s = np.linspace(0.0, length, nodes)
    waves = [random.normal() * np.sin(2 * np.pi * (j + 1) * s / length + random.uniform(0, 6)) for j in range(3)]
    heading = np.cumsum(random.uniform(2.0, 12.0) * sum(waves)) * length / (nodes - 1)
    steps = np.column_stack([np.cos(heading), np.sin(heading)])[1:] * length / (nodes - 1)
    points = np.column_stack([np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), np.full(nodes, radius)])

    scene = withe.Scene(gravity=(0.0, 0.0, -9.81))
    scene.add_floor(friction=friction)
    cable = scene.add_rod(points=points, radius=radius, material=rubber)
    scene.enable_contact(rods=False)
    scene.pin(cable.end, free=(0.0, 0.0, 1.0), name="hand")
    # The residuals that Newton's method leaves at 400 nodes add up.
    simulation = scene.build(
        integrator="static", time_step=0.1, planar=False, solver=withe.Solver(step_tolerance=1e-11)
    )
    simulation.set(cable, natural_curvature=(0.0, 0.0), over=1.0)
    way = random.normal(size=2)
    way *= random.uniform(0.005, 0.05) / np.linalg.norm(way)
    simulation.move("hand", position=points[-1] + [*way, 0.0], over=1.0)
    for _ in range(10):
        simulation.step()
        contacts = simulation.contacts()
        pressed = contacts["normal_force"]
        assert (np.linalg.norm(contacts["friction"], axis=1) <= friction * pressed * (1 + 1e-9) + 1e-12).all()
        total = contacts["friction"].sum(axis=0) + contacts["normal"].T @ pressed
        total += simulation.reaction("hand").force - [0.0, 0.0, weight * length]
        assert np.abs(total).max() < 1e-6 * weight * length
