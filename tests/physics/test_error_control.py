"""`tolerance` is what the error of positions comes out at, over four decades."""

import numpy as np
import pytest

import rods
import theory
import withe

PERIODS = 3.0


def waving_tip(integrator, step, tolerance=None):
    """Height of a cantilever's tip over a few periods of its first mode."""
    duration = PERIODS * 2.0 * np.pi / theory.CANTILEVER_ROOTS[0] ** 2
    scene = rods.weightless()
    arm = rods.straight(scene, 20)
    scene.clamp(arm.start)
    control = {} if tolerance is None else {"tolerance": tolerance, "duration": duration}
    simulation = scene.build(integrator=integrator, time_step=step * duration, **control)
    velocities = np.zeros((21, 3))
    velocities[:, 2] = 0.2 * theory.cantilever_mode(np.linspace(0.0, 1.0, 21))
    simulation.set_velocities(arm, velocities)
    record = simulation.run(duration, record_every=0.02 * duration, progress=False)
    return record.positions(arm)[:, -1, 2]


@pytest.mark.parametrize(
    ("integrator", "tolerances"),
    [
        ("implicit_midpoint", 10.0 ** np.arange(-6.0, -1.9, 0.5)),
        ("energy_momentum", (1e-5, 1e-4, 1e-3)),
        ("backward_euler", (1e-3, 1e-2)),
    ],
)
def test_error_is_within_the_tolerance_and_proportional_to_it(integrator, tolerances):
    reference = waving_tip("fourth_order", 1e-3)
    ratios = []
    for tolerance in tolerances:
        tip = waving_tip(integrator, 0.02, tolerance)
        ratios.append(np.abs(tip - reference).max() / tolerance)
    assert all(0.05 < ratio < 3.0 for ratio in ratios)
    # Steps change by the fourth root of two, and the error with their square; under "energy_momentum" with the fourth
    # power where steps are of fourth order.
    assert max(ratios) < (12.0 if integrator == "energy_momentum" else 3.0) * min(ratios)


def small_vibrations(number):
    """Draw a straight rod, what sets off its small vibrations, and their duration of one to five periods [s].

    Either a load acts at once, or nodes have velocities: smooth ones, or rough ones that excite every mode of the mesh.
    """
    rng = np.random.default_rng([31, number])
    nodes = int(rng.integers(6, 32))
    scene = rods.weightless()
    rod = rods.straight(scene, nodes - 1, stiffness=rods.stiffness(stretch=4e4))
    scene.clamp(rod.start)
    held_at_both_ends = number % 3 == 0
    if held_at_both_ends:
        scene.clamp(rod.end)
    load = scene.add_force(rod.node(nodes // 2), (0.0, 0.0, 0.0))
    period = 2.0 * np.pi / (22.37 if held_at_both_ends else 3.516)
    velocities, force = np.zeros((nodes, 3)), rng.normal(size=3) * (0.0, 1.0, 1.0)
    if number % 2:
        force[:] = 0.0
        x = np.linspace(0.0, 1.0, nodes)
        for mode in range(1, nodes):
            share = rng.normal(size=2) * mode ** -rng.choice((1.0, 2.0))
            velocities[:, 1:] += np.outer(np.sin(np.pi * mode * x), share)
        velocities[[0, -1]] = 0.0
        velocities *= 6e-3 / period / np.abs(velocities).max()
    force *= 0.1 if held_at_both_ends else 5e-3

    def begin(simulation):
        simulation.set(load, force=tuple(force))
        simulation.set_velocities(rod, velocities)

    return scene, begin, rng.uniform(1.0, 5.0) * period


def end_of(scene, begin, duration, tolerance, **options):
    """Positions at the end, and the statistics, of an error-controlled run in 20 time steps."""
    simulation = scene.build(time_step=duration / 20, duration=duration, tolerance=tolerance, **options)
    begin(simulation)
    simulation.step(20)
    return simulation.positions(), simulation.statistics


@pytest.mark.parametrize("number", range(8))
def test_small_vibrations_of_drawn_rods_end_within_the_tolerance(number):
    scene, begin, duration = small_vibrations(number)
    reference, _ = end_of(scene, begin, duration, 3e-8, integrator="fourth_order")
    steps = []
    for tolerance in (3e-6, 3e-5, 3e-4):
        found, statistics = end_of(scene, begin, duration, tolerance)
        error = np.linalg.norm(found - reference, axis=1).max()
        assert 1e-3 * tolerance < error < tolerance
        steps.append(statistics.steps + 5 * statistics.fourth_order_steps)
    assert steps[0] > steps[1] > steps[2]


def test_error_control_chooses_fourth_order_where_it_costs_less():
    scene, begin, duration = small_vibrations(1)
    _, chosen = end_of(scene, begin, duration, 1e-7)
    _, fourth = end_of(scene, begin, duration, 1e-7, integrator="fourth_order")
    assert chosen.fourth_order_steps > 0.9 * chosen.steps
    assert chosen.iterations < 1.5 * fourth.iterations
    _, coarse = end_of(scene, begin, duration, 1e-2)
    assert coarse.fourth_order_steps == 0


@pytest.mark.parametrize("what", ["viscosity", "drag", "contact", "motion", "path"])
def test_error_control_keeps_second_order_where_fourth_is_not_accurate(what):
    scene = rods.weightless()
    arm = rods.straight(scene, 10, stiffness=rods.stiffness(viscous_time=1e-6 * (what == "viscosity")))
    wall = scene.clamp(arm.start)
    if what == "drag":
        scene.add_drag(1e-3)
    if what == "contact":
        scene.add_floor(height=-10.0)
    simulation = scene.build(time_step=0.1, tolerance=1e-6)
    if what == "motion":
        simulation.move(wall, position=(0.0, 0.0, 1e-3), over=2.0)
    if what == "path":
        simulation.move(wall, path=lambda time: ((0.0, 0.0, 1e-3 * np.sin(time)), np.eye(3)))
    simulation.set_velocities(arm, np.outer(np.linspace(0.0, 1.0, 11) ** 2, (0.0, 0.0, 0.01)))
    simulation.step(10)
    assert simulation.statistics.fourth_order_steps == 0
    assert simulation.statistics.steps > 100


def fast_and_slow(amplitude, tolerance):
    """Run a cantilever in its first mode and, with an amplitude, in its third; return the statistics."""
    scene = rods.weightless()
    arm = rods.straight(scene, 40)
    scene.clamp(arm.start)
    x = np.linspace(0.0, 1.0, 41)
    duration = 3.0 * 2.0 * np.pi / theory.CANTILEVER_ROOTS[0] ** 2
    simulation = scene.build(time_step=duration / 20, duration=duration, tolerance=tolerance)
    velocities = np.zeros((41, 3))
    fast = amplitude * theory.CANTILEVER_ROOTS[2] ** 2 * theory.cantilever_mode(x, 2)
    velocities[:, 2] = 5e-3 * theory.cantilever_mode(x) + fast
    simulation.set_velocities(arm, velocities)
    simulation.step(20)
    return simulation.statistics


def test_motion_that_steps_do_not_resolve_is_reported_with_its_amplitude():
    amplitude = 1e-4
    loose = fast_and_slow(amplitude, 8.0 * amplitude)
    assert 0.5 * amplitude < loose.unresolved_amplitude < 2.0 * amplitude
    tight = fast_and_slow(amplitude, 0.2 * amplitude)
    assert tight.unresolved_amplitude < 0.1 * amplitude
    assert tight.iterations > 3 * loose.iterations


def test_a_tolerance_that_the_smallest_step_misses_ends_in_an_error():
    scene = rods.weightless()
    arm = rods.straight(scene, 20)
    scene.clamp(arm.start)
    scene.add_force(arm.end, (0.0, 0.0, 1.0))
    simulation = scene.build(time_step=0.1, tolerance=1e-6, solver=withe.Solver(max_halvings=2))
    with pytest.raises(withe.ConvergenceError, match="misses the tolerance"):
        simulation.step(10)
    simulation = scene.build(time_step=0.1, tolerance=1e-6)
    simulation.step(10)
    assert simulation.statistics.steps > 40


def dropped(integrator, tolerance, duration):
    """A rod of rubber that falls on a floor at an angle: its centreline at the end, and how many steps it took."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
    rod = scene.add_rod(start=(0, 0, 0.0055), end=(0.1, 0, 0.0105), nodes=6, radius=5e-3, material=rubber)
    scene.add_floor()
    simulation = scene.build(integrator=integrator, time_step=1e-2, tolerance=tolerance)
    simulation.run(duration, progress=False)
    return simulation.positions(rod), simulation.statistics.steps


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_impacts_keep_the_tolerance_too(integrator):
    reference, _ = dropped(integrator, 1e-6, 0.03)
    steps = []
    for tolerance in (1e-3, 1e-4, 1e-5):
        places, count = dropped(integrator, tolerance, 0.03)
        assert np.abs(places - reference).max() < 2.0 * tolerance
        steps.append(count)
    assert steps[0] < steps[1] < steps[2]


def test_first_order_error_control_gets_through_a_hard_impact():
    """By error per unit of time alone a blow of 3 m/s in 0.1 ms took steps below 1e-8 s, and the run ended there."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
    end = (0.3 * np.cos(0.3), 0.3 * np.sin(0.3), 0.0305)
    rod = scene.add_rod(start=(0, 0, 0.0105), end=end, nodes=21, radius=5e-3, material=rubber)
    scene.add_floor(friction=0.3)
    simulation = scene.build(integrator="backward_euler", time_step=1e-2, tolerance=1e-4)
    simulation.run(0.0656, progress=False)
    assert simulation.positions(rod)[:, 2].min() > 0.98 * 5e-3


def test_error_control_has_a_limit_of_work_and_names_remedies():
    def stiff(**options):
        scene = withe.Scene(gravity=(0, 0, 0))
        rod = rods.straight(scene, 11, stiffness=rods.stiffness(stretch=4e6), radius=1e-3)
        scene.clamp(rod.start)
        simulation = scene.build(time_step=0.5, tolerance=1e-3, duration=2.0, **options)
        simulation.set(rod, natural_curvature=(12.0, 0.0))
        return simulation

    simulation = stiff(solver=withe.Solver(max_steps=200))
    with pytest.raises(withe.ConvergenceError, match=r"200 inner steps .* larger tolerance, .*or a greater max_steps"):
        simulation.step()
    assert simulation.statistics.steps + simulation.statistics.rejected_steps == 200
    assert simulation.time < 0.5  # where it can be looked at, and continued
    simulation = stiff(solver=withe.Solver(max_steps=10**7))
    simulation.step()
    assert simulation.time == 0.5
    with pytest.raises(ValueError, match="max_steps needs a tolerance"):
        withe.Scene().build(solver=withe.Solver(max_steps=10))
