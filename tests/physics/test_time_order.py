"""Halving the step divides the error by two (backward Euler), four (midpoint, energy-momentum, Verlet) or sixteen
(fourth order)."""

from itertools import pairwise

import numpy as np
import pytest

import rods
import theory
import withe
from convergence import assert_order

DURATION = 0.4


def waving(integrator, step, planar, edges=6):
    """A soft cantilever let go level, which sinks and, in space, swings aside."""
    scene = withe.Scene(gravity=(0.0, 0.0, -6.0))
    # So coarse and so stretchable that the fastest motion is resolved by every step below.
    arm = rods.straight(scene, edges, stiffness=rods.stiffness(twist=0.7, stretch=40.0), radius=0.2)
    scene.clamp(arm.start)
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=None if planar else False,
        adaptive=False,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    )
    velocities = np.zeros((edges + 1, 3))
    velocities[:, 2] = 0.3 * np.linspace(0.0, 1.0, edges + 1) ** 2
    if not planar:
        velocities[:, 1] = 0.6 * np.linspace(0.0, 1.0, edges + 1) ** 2
    simulation.set_velocities(arm, velocities)
    simulation.step(round(DURATION / step))
    assert simulation.time == pytest.approx(DURATION, rel=1e-12)
    return simulation.positions(arm)


@pytest.mark.case("dynamics", "Order of five integrators in time", source="1 (backward Euler), 2, 4 (fourth order)")
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize(
    ("integrator", "order", "steps"),
    [
        ("backward_euler", 1.0, (3200, 6400, 12800)),
        ("implicit_midpoint", 2.0, (400, 800, 1600)),
        ("energy_momentum", 2.0, (400, 800, 1600)),
        ("fourth_order", 4.0, (100, 200, 400)),
        ("verlet", 2.0, (1600, 3200, 6400)),
    ],
)
def test_error_falls_at_the_order_of_the_scheme(integrator, order, steps, planar):
    results = [waving(integrator, DURATION / n, planar) for n in steps]
    # Differences of successive runs fall at the same order as the error.
    assert_order([np.abs(b - a).max() for a, b in pairwise(results)], order)


@pytest.mark.case("dynamics", "Integrators in the limit of short steps", source="each other")
def test_schemes_agree_in_the_limit():
    reference = waving("implicit_midpoint", DURATION / 3200, False)
    for integrator, steps, allowed in (
        ("energy_momentum", 3200, 2e-5),
        ("fourth_order", 200, 2e-5),
        ("backward_euler", 6400, 5e-3),
    ):
        np.testing.assert_allclose(waving(integrator, DURATION / steps, False), reference, atol=allowed)


def test_verlet_with_its_masses_at_nodes_agrees_with_the_others_on_ever_finer_meshes():
    errors = []
    for edges in (6, 12, 24):
        verlet, midpoint = (
            waving(integrator, DURATION / steps, True, edges)[:: edges // 6]
            for integrator, steps in (("verlet", 3200), ("implicit_midpoint", 1600))
        )
        errors.append(np.linalg.norm(verlet - midpoint))
    assert_order(errors, slack=0.3)
    assert errors[-1] < 2e-3


def driven(integrator, step, planar):
    """A curved rod whose clamp moves and turns while a force at its tip comes and goes, drag and actuation included."""
    scene = withe.Scene(gravity=(0.0, 0.0, -3.0))
    s = np.linspace(0.0, 1.0, 7)
    points = np.stack([s, np.zeros_like(s) if planar else 0.2 * s**3, 0.3 * s**2], axis=1)
    arm = scene.add_rod(
        points=points,
        stiffness=rods.stiffness(bend=(1.0, 1.0) if planar else (1.0, 1.5), twist=0.7, stretch=40.0),
        line_density=1.0,
        radius=0.2,
    )
    scene.clamp(arm.start)
    scene.add_drag(0.3)
    scene.add_force(arm.end, lambda t: (0.5 * np.sin(9.0 * t), 0.0 if planar else 0.4 * np.cos(7.0 * t), 0.3 * t))
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=None if planar else False,
        adaptive=False,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    )
    axis = (0.0, 1.0, 0.0) if planar else (0.4, 1.0, 0.2)
    simulation.move(
        arm.start, path=lambda t: ((0.1 * np.sin(5.0 * t) ** 2, 0.0, 0.2 * t**2), rods.rotation(axis, 0.8 * t**2))
    )
    simulation.set(arm, natural_curvature=(0.0, -2.0) if planar else (1.0, -2.0), over=2.0 * DURATION)
    simulation.step(round(DURATION / step))
    return simulation.positions(arm)


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize(
    ("integrator", "order", "steps"),
    [("implicit_midpoint", 2.0, (200, 400, 800)), ("fourth_order", 4.0, (100, 200, 400))],
)
def test_error_falls_at_the_order_of_the_scheme_where_everything_changes_in_time(integrator, order, steps, planar):
    results = [driven(integrator, DURATION / n, planar) for n in steps]
    assert_order([np.abs(b - a).max() for a, b in pairwise(results)], order, slack=0.3)


def test_fourth_order_steps_can_be_taken_back():
    """Symmetric: with velocities turned around, a free motion goes back to where it began, to solver tolerance."""
    scene = rods.weightless()
    s = np.linspace(0.0, 1.0, 9)
    arm = scene.add_rod(
        points=np.stack([s, 0.2 * s**3, 0.3 * s**2], axis=1),
        natural="straight",
        stiffness=rods.stiffness(twist=0.7, stretch=400.0),
        line_density=1.0,
        radius=1e-3,
    )
    scene.clamp(arm.start)
    simulation = scene.build(
        integrator="fourth_order",
        time_step=0.02,
        adaptive=False,
        solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
    )
    start = simulation.positions(arm)
    simulation.step(20)
    far = np.abs(simulation.positions(arm) - start).max()
    simulation.set_velocities(arm, -simulation.velocities(arm))
    simulation.step(20)
    assert far > 0.05
    np.testing.assert_allclose(simulation.positions(arm), start, atol=1e-6 * far)


def test_phase_error_of_fourth_order_is_that_of_five_midpoint_steps():
    """9.3e-4 (w dt)^4, where midpoint has (w dt)^2 / 12."""
    exact = theory.CANTILEVER_ROOTS[0] ** 2
    seen = []
    for steps in (6, 12, 48):
        scene = rods.weightless()
        arm = rods.straight(scene, 30)
        scene.clamp(arm.start)
        dt = 2.0 * np.pi / exact / steps
        simulation = scene.build(
            integrator="fourth_order", time_step=dt, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
        )
        velocities = np.zeros((31, 3))
        velocities[:, 2] = 1e-4 * theory.cantilever_mode(np.linspace(0.0, 1.0, 31))
        simulation.set_velocities(arm, velocities)
        x = np.empty(8 * steps)
        for i in range(len(x)):
            simulation.step()
            x[i] = simulation.positions(arm)[-1, 2]
        seen.append(np.arccos(0.5 * (x[2:] + x[:-2]) @ x[1:-1] / (x[1:-1] @ x[1:-1])) / dt / exact)
    for steps, value in zip((6, 12), seen, strict=False):
        assert abs(value / seen[-1] - 1.0) == pytest.approx(9.3e-4 * (2.0 * np.pi / steps) ** 4, rel=0.15)


@pytest.mark.case("dynamics", "Period of a cantilever and phase error of midpoint", source="tan(W dt / 2) = w dt / 2")
def test_period_of_a_cantilever_is_theorys_and_the_midpoint_rule_stretches_it_at_second_order():
    """The phase error of midpoint is known: tan(W dt / 2) = w dt / 2 for the frequency W that is seen."""
    exact = theory.CANTILEVER_ROOTS[0] ** 2
    seen = []
    for steps in (20, 40, 80, 160):
        scene = rods.weightless()
        arm = rods.straight(scene, 50)
        scene.clamp(arm.start)
        simulation = scene.build(
            time_step=2.0 * np.pi / exact / steps, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
        )
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
