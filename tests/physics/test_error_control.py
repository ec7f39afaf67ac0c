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
    # Steps change by the fourth root of two, and the error with their square.
    assert max(ratios) < 3.0 * min(ratios)


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

    simulation = stiff(solver=withe.Solver(max_steps=2000))
    with pytest.raises(withe.ConvergenceError, match=r"2000 inner steps .* larger tolerance, .*or a greater max_steps"):
        simulation.step()
    assert simulation.statistics.steps + simulation.statistics.rejected_steps == 2000
    assert simulation.time < 0.5  # where it can be looked at, and continued
    simulation = stiff(solver=withe.Solver(max_steps=10**7))
    simulation.step()
    assert simulation.time == 0.5
    with pytest.raises(ValueError, match="max_steps needs a tolerance"):
        withe.Scene().build(solver=withe.Solver(max_steps=10))
