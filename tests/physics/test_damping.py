"""Viscosity and drag against theory."""

import numpy as np
import pytest

import rods
import theory
import withe
from convergence import assert_order


def fitted_oscillation(samples, step):
    """Decay rate and frequency of x[n+1] = 2 exp(-s dt) cos(w dt) x[n] - exp(-2 s dt) x[n-1]."""
    x = np.asarray(samples)
    (a, b), *_ = np.linalg.lstsq(np.stack([x[1:-1], x[:-2]], axis=1), x[2:], rcond=None)
    decay = -0.5 * np.log(-b) / step
    return decay, np.arccos(0.5 * a * np.exp(decay * step)) / step


def ringing(edges, steps, viscous_time, direction, integrator="implicit_midpoint"):
    """First bending mode, let go with a small velocity, of a Kelvin-Voigt cantilever."""
    exact = theory.CANTILEVER_ROOTS[0] ** 2
    scene = rods.weightless()
    arm = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e5, viscous_time=viscous_time))
    scene.clamp(arm.start)
    step = 2.0 * np.pi / exact / steps
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=False,
        solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12),
    )
    velocities = np.outer(1e-4 * theory.cantilever_mode(np.linspace(0.0, 1.0, edges + 1)), direction)
    simulation.set_velocities(arm, velocities)
    tips = []
    for _ in range(3 * steps):
        simulation.step()
        tips.append(simulation.positions(arm)[-1] @ direction)
    return fitted_oscillation(tips, step)


@pytest.mark.case(
    "dynamics", "Decay and frequency of a viscous rod in any plane", source="tau w^2 / 2, w sqrt(1 - zeta^2)"
)
@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.6, 0.8)])
def test_bending_of_a_kelvin_voigt_rod_decays_at_half_its_viscous_time_by_frequency_squared(direction):
    frequency = theory.CANTILEVER_ROOTS[0] ** 2
    viscous_time = 0.04 / frequency
    decay, seen = ringing(60, 200, viscous_time, np.array(direction))
    assert decay == pytest.approx(0.5 * viscous_time * frequency**2, rel=2e-3)
    assert seen == pytest.approx(frequency * np.sqrt(1.0 - 0.02**2), rel=1e-3)


def test_decay_rate_converges_at_second_order_in_the_step():
    frequency = theory.CANTILEVER_ROOTS[0] ** 2
    decays = [ringing(40, n, 0.04 / frequency, np.array((0.0, 0.0, 1.0)))[0] for n in (20, 40, 80, 160)]
    assert_order(np.diff(decays), slack=0.2)


@pytest.mark.case("dynamics", "Creep of a Kelvin-Voigt bar", source="F L / EA (1 - exp(-t / tau))")
def test_viscous_bar_creeps_to_its_length_in_its_viscous_time():
    """A massless Kelvin-Voigt bar under a sudden pull: u = (F L / EA) (1 - exp(-t / tau))."""
    scene = rods.weightless()
    bar = rods.straight(scene, 4, stiffness=rods.stiffness(stretch=10.0, viscous_time=0.5), line_density=1e-6)
    scene.clamp(bar.start)
    scene.add_force(bar.end, (0.1, 0.0, 0.0))
    simulation = scene.build(integrator="implicit_midpoint", time_step=1e-3)
    simulation.step(500)
    assert simulation.positions(bar)[-1, 0] - 1.0 == pytest.approx(0.01 * (1.0 - np.exp(-1.0)), rel=5e-3)


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("integrator", ["energy_momentum", "backward_euler"])
@pytest.mark.parametrize("turn", [0.05, 0.3, 0.6])
@pytest.mark.parametrize("planar", [True, False])
def test_viscosity_only_ever_takes_energy_however_far_a_step_turns(integrator, turn, planar):
    """A bent rod that flies and tumbles, by `turn` rad a step: mostly it turns as a body, which strains nothing."""
    scene = rods.weightless()
    s = np.linspace(-0.5, 0.5, 9)
    rod = scene.add_rod(
        points=np.stack([s, (0.0 if planar else 0.2) * s**3, 0.4 * s**2], axis=1),
        radius=0.01,
        line_density=1.0,
        stiffness=rods.stiffness(stretch=1e3, viscous_time=0.5),
    )
    rate = 2.0
    simulation = scene.build(integrator=integrator, time_step=turn / rate, planar=planar)
    spin = np.array((0.0, 1.0, 0.0) if planar else (0.5, 0.8, 0.3))
    x = simulation.positions(rod)
    simulation.set_velocities(rod, np.cross(rate * spin / np.linalg.norm(spin), x) + 0.1 * x)
    first = before = simulation.energy()
    for _ in range(400):
        simulation.step()
        now = simulation.energy()
        # Backward Euler's forces act where edges point at the end of a step, and work a little more on the way there.
        if integrator != "backward_euler":
            assert now.dissipated >= before.dissipated - 1e-9 * first.kinetic
        before = now
    assert now.total <= first.total * (1.0 + 1e-3)


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
def test_material_viscosity_is_that_of_its_modulus():
    """viscosity / youngs_modulus is the time by which every stiffness is delayed."""
    scene = rods.weightless()
    rubber = withe.Material(youngs_modulus=1e3, poisson_ratio=0.5, density=1e-3, viscosity=200.0)
    bar = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=5, radius=0.02, material=rubber)
    scene.clamp(bar.start)
    area = np.pi * 0.02**2
    scene.add_force(bar.end, (0.01 * 1e3 * area, 0.0, 0.0))
    simulation = scene.build(integrator="implicit_midpoint", time_step=1e-3)
    simulation.step(200)
    assert simulation.positions(bar)[-1, 0] - 1.0 == pytest.approx(0.01 * (1.0 - np.exp(-1.0)), rel=5e-3)


@pytest.mark.case("dynamics", "Terminal velocity of a rod in drag", source="rho A g / c")
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum", "verlet"])
def test_falling_rod_reaches_its_terminal_velocity(integrator):
    """rho A g / c, approached in the time rho A / c."""
    scene = withe.Scene()
    rod = rods.straight(scene, 6, stiffness=rods.stiffness(stretch=10.0), radius=0.1)
    scene.add_drag(4.0)
    simulation = scene.build(integrator=integrator, time_step=5e-3)
    simulation.step(2000)
    np.testing.assert_allclose(simulation.velocities(rod), np.tile((0.0, 0.0, -9.81 / 4.0), (7, 1)), atol=1e-8)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "verlet"])
def test_fall_through_drag_converges_at_second_order(integrator):
    errors = []
    for steps in (40, 80, 160):
        scene = withe.Scene()
        rod = rods.straight(scene, 6, stiffness=rods.stiffness(stretch=10.0), radius=0.1)
        scene.add_drag(4.0, rods=[rod])
        simulation = scene.build(integrator=integrator, time_step=0.5 / steps)
        simulation.step(steps)
        exact = 9.81 / 4.0 * (1.0 - np.exp(-4.0 * 0.5))
        errors.append(-simulation.velocities(rod)[3, 2] - exact)
    assert_order(errors)


def test_drag_takes_what_gravity_gives_at_terminal_velocity():
    scene = withe.Scene()
    rods.straight(scene, 6, stiffness=rods.stiffness(stretch=10.0), radius=0.1)
    scene.add_drag(4.0)
    simulation = scene.build(integrator="implicit_midpoint", time_step=5e-3)
    simulation.step(2000)
    before = simulation.energy()
    simulation.step(200)
    after = simulation.energy()
    assert after.dissipated - before.dissipated == pytest.approx(9.81 * 9.81 / 4.0, rel=1e-6)
    assert before.gravity - after.gravity == pytest.approx(9.81 * 9.81 / 4.0, rel=1e-6)


@pytest.mark.case("dynamics", "Decay of axial modes in drag", source="c / (2 m)")
@pytest.mark.parametrize("mode", [0, 2, 4])
def test_drag_damps_every_mode_alike(mode):
    """c x' on m x'': amplitudes fall by exp(-c t / 2 m), however few edges a wave has."""
    edges, drag = 10, 0.4
    scene = rods.weightless()
    rod = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e4), normal=(0, 0, 1))
    scene.pin(rod.start)
    scene.pin(rod.end, free=(1, 0, 0))
    scene.add_drag(drag)
    period = 1.0 / scene.build(planar=True).linearise().frequencies(mode + 1)[mode]
    step = period / 200.0
    simulation = scene.build(
        time_step=step, planar=True, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
    )
    shape = simulation.linearise().modes(mode + 1)[mode]
    simulation.set_velocities(rod, 1e-5 * shape)
    seen = []
    for _ in range(600):
        simulation.step()
        seen.append((simulation.positions(rod)[:, 2] * shape[:, 2]).sum())
    decay, _ = fitted_oscillation(seen, step)
    # Midpoint steps take 2 x / (1 + x^2 / 4) for x: less by (w dt)^2 / 4.
    assert decay == pytest.approx(0.5 * drag, rel=5e-4)
