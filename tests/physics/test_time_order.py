"""Halving the step divides the error by two (backward Euler) or four (midpoint, energy-momentum, Verlet)."""

from itertools import pairwise

import numpy as np
import pytest

import rods
import theory
import withe
from convergence import assert_order

DURATION = 0.4


def waving(integrator, step, planar):
    """A soft cantilever let go level, which sinks and, in space, swings aside."""
    scene = withe.Scene(gravity=(0.0, 0.0, -6.0))
    # So coarse and so stretchable that the fastest motion is resolved by every step below.
    arm = rods.straight(scene, 6, stiffness=rods.stiffness(twist=0.7, stretch=40.0), radius=0.2)
    scene.clamp(arm.start)
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=None if planar else False,
        adaptive=False,
        step_tolerance=1e-12,
        force_tolerance=1e-12,
    )
    velocities = np.zeros((7, 3))
    velocities[:, 2] = 0.3 * np.linspace(0.0, 1.0, 7) ** 2
    if not planar:
        velocities[:, 1] = 0.6 * np.linspace(0.0, 1.0, 7) ** 2
    simulation.set_velocities(arm, velocities)
    simulation.step(round(DURATION / step))
    assert simulation.time == pytest.approx(DURATION, rel=1e-12)
    return simulation.positions(arm)


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize(
    ("integrator", "order", "steps"),
    [
        ("backward_euler", 1.0, (3200, 6400, 12800)),
        ("implicit_midpoint", 2.0, (400, 800, 1600)),
        ("energy_momentum", 2.0, (400, 800, 1600)),
        ("verlet", 2.0, (1600, 3200, 6400)),
    ],
)
def test_error_falls_at_the_order_of_the_scheme(integrator, order, steps, planar):
    results = [waving(integrator, DURATION / n, planar) for n in steps]
    # Differences of successive runs fall at the same order as the error.
    assert_order([np.abs(b - a).max() for a, b in pairwise(results)], order)


def test_schemes_agree_in_the_limit():
    reference = waving("implicit_midpoint", DURATION / 3200, False)
    for integrator, steps, allowed in (
        ("energy_momentum", 3200, 2e-5),
        ("verlet", 6400, 2e-5),
        ("backward_euler", 6400, 5e-3),
    ):
        np.testing.assert_allclose(waving(integrator, DURATION / steps, False), reference, atol=allowed)


def test_period_of_a_cantilever_is_theorys_and_the_midpoint_rule_stretches_it_at_second_order():
    """The phase error of midpoint is known: tan(W dt / 2) = w dt / 2 for the frequency W that is seen."""
    exact = theory.CANTILEVER_ROOTS[0] ** 2
    seen = []
    for steps in (20, 40, 80, 160):
        scene = rods.weightless()
        arm = rods.straight(scene, 50)
        scene.clamp(arm.start)
        simulation = scene.build(time_step=2.0 * np.pi / exact / steps, step_tolerance=1e-12, force_tolerance=1e-12)
        velocities = np.zeros((51, 3))
        velocities[:, 2] = 1e-4 * theory.cantilever_mode(np.linspace(0.0, 1.0, 51))
        simulation.set_velocities(arm, velocities)
        heights = []
        for _ in range(4 * steps):
            simulation.step()
            heights.append(simulation.positions(arm)[-1, 2])
        # A harmonic obeys x[n+1] + x[n-1] = 2 cos(W dt) x[n].
        x = np.array(heights)
        cosine = 0.5 * (x[2:] + x[:-2]) @ x[1:-1] / (x[1:-1] @ x[1:-1])
        dt = 2.0 * np.pi / exact / steps
        W = np.arccos(cosine) / dt
        seen.append(W / exact - 1.0)
        assert 2.0 / dt * np.tan(0.5 * W * dt) == pytest.approx(exact, rel=5e-4)
    # Differences, so that the small error of the mesh drops out.
    assert_order(np.diff(seen))
