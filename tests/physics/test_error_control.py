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
    simulation = scene.build(time_step=0.1, tolerance=1e-6, max_halvings=2)
    with pytest.raises(withe.ConvergenceError, match="misses the tolerance"):
        simulation.step(10)
    simulation = scene.build(time_step=0.1, tolerance=1e-6)
    simulation.step(10)
    assert simulation.statistics.steps > 40
