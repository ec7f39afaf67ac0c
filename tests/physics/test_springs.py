"""Springs and dampers between nodes: closed forms, what they conserve, limits."""

import numpy as np
import pytest
from scipy.optimize import brentq

import rods
import withe
from cases import measured
from convergence import assert_order
from test_damping import fitted_oscillation

SCHEMES = ("backward_euler", "implicit_midpoint", "energy_momentum", "fourth_order", "verlet")
MASS, STIFFNESS = 0.5, 40.0
FREQUENCY = np.sqrt(2.0 * STIFFNESS / MASS)


def two_masses(integrator, step, damping=0.0, speed=1e-3, stretch=1e7, **more):
    """Two short rods in a line, all but rigid, with a spring between them; let go apart."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=stretch), "line_density": MASS / 0.1, "radius": 0.01, "nodes": 2}
    left = scene.add_rod(start=(-0.2, 0, 0), end=(-0.1, 0, 0), **parts)
    right = scene.add_rod(start=(0.2, 0, 0), end=(0.3, 0, 0), **parts)
    spring = scene.add_spring(left.end, right.start, stiffness=STIFFNESS, damping=damping)
    options = {
        "planar": False,
        "solver": withe.Solver(step_tolerance=1e-14, force_tolerance=1e-13),
        "adaptive": False,
    } | more
    simulation = scene.build(integrator=integrator, time_step=step, **options)
    simulation.set_velocities(left, [(-speed, 0, 0)] * 2)
    simulation.set_velocities(right, [(speed, 0, 0)] * 2)
    return simulation, spring


def lengths(simulation, steps):
    out = []
    for _ in range(steps):
        simulation.step()
        x = simulation.positions()
        out.append(x[2, 0] - x[1, 0] - 0.3)
    return out


@pytest.mark.case(
    "dynamics", "Frequency of two masses on a spring with a damper", source="trapezoidal rule of the oscillator"
)
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_two_masses_swing_and_decay_as_the_rule_says_to_the_last_digits(integrator, share):
    """x'' + 2 a x' + w^2 x = 0: the trapezoidal rule multiplies by (1 + s dt / 2) / (1 - s dt / 2) a step."""
    step = 0.05 / FREQUENCY
    damping = share * MASS * FREQUENCY
    simulation, _ = two_masses(integrator, step, damping)
    decay, seen = fitted_oscillation(lengths(simulation, 200), step)
    rate = share * FREQUENCY  # c over the reduced mass, halved
    s = complex(-rate, np.sqrt(FREQUENCY**2 - rate**2))
    expected = np.log((1.0 + 0.5 * s * step) / (1.0 - 0.5 * s * step)) / step
    measured(seen / expected.imag - 1.0)
    assert seen == pytest.approx(expected.imag, rel=1e-5)
    assert decay == pytest.approx(-expected.real, rel=1e-5, abs=1e-6 * FREQUENCY)


def test_damped_swings_converge_at_second_order_under_verlet():
    seen = []
    for part in (1, 2, 4, 8):
        step = 0.08 / FREQUENCY / part
        simulation, _ = two_masses("verlet", step, 0.1 * MASS * FREQUENCY, stretch=1e2)
        seen.append(lengths(simulation, 20 * part)[-1])
    assert_order(np.diff(seen), slack=0.25)


@pytest.mark.case("dynamics", "Frequencies of a beam with a spring at its tip", source="[Blevins 1979]")
@pytest.mark.parametrize("k", [0.5, 5.0, 200.0])
def test_frequencies_of_a_beam_with_a_spring_at_its_tip(k):
    """Clamped, B = L = m = 1: b^3 (1 + cos b cosh b) + k (sin b cosh b - cos b sinh b) = 0, w = b^2 [Blevins 1979]."""
    simulation, *_ = guyed(k, 80, planar=True)

    def characteristic(b):
        return b**3 * (1.0 + np.cos(b) * np.cosh(b)) + k * (np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b))

    exact = np.array([brentq(characteristic, 1.8, 4.0), brentq(characteristic, 4.5, 7.2)]) ** 2 / (2.0 * np.pi)
    found = simulation.linearise().frequencies(8)
    for frequency in exact:
        measured(np.abs(found - frequency).min() / frequency)
        assert np.abs(found - frequency).min() < 1e-4 * frequency


def tumbling(integrator, damping=0.0, step=4e-3, planar=False, turn=None, lift=False, **more):
    """Two bent rods that fly apart and tumble, with a slack, a tight and a lengthless spring between them."""
    turn = np.eye(3) if turn is None else turn
    scene = rods.weightless()
    s = np.linspace(-0.5, 0.5, 9)
    shape = np.stack([s, 0.25 * s**2, 0.0 * s if planar else 0.3 * s**3], axis=1)
    parts = {
        "stiffness": rods.stiffness(bend=(1.0, 1.0 if planar else 1.6), twist=0.8, stretch=2e3),
        "line_density": 1.0,
        "radius": 0.05,
        "normal": turn @ (0.0, 0.0, 1.0),
    }
    a = scene.add_rod(points=shape @ turn.T, **parts)
    b = scene.add_rod(points=(shape * (1.0, -1.0, 1.0) + (0.1, 0.4, 0.0)) @ turn.T, **parts)
    scene.add_spring(a.start, b.start, stiffness=30.0, damping=damping, name="slack", rest_length=0.6)
    scene.add_spring(a.end, b.node(5), stiffness=80.0, damping=damping, name="tight", rest_length=0.2)
    scene.add_spring(a.node(4), b.node(4), stiffness=20.0, damping=damping, name="lengthless", rest_length=0.0)
    options = {"planar": None if planar and not lift else False, "adaptive": False} | more
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
        **options,
    )
    spin = (0.0, 0.0, 3.0) if planar else (1.0, -2.0, 3.0)
    for rod, sign in ((a, 1.0), (b, -1.0)):
        x = simulation.positions(rod) @ turn
        velocities = np.cross(spin, x) + sign * np.array((0.3, -0.8, 0.0 if planar else 0.2))
        simulation.set_velocities(rod, velocities @ turn.T)
    return simulation


def balance(simulation):
    energy = simulation.energy()
    return energy.total + energy.dissipated - energy.work


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("integrator", SCHEMES)
def test_springs_keep_momenta(integrator, planar):
    damping = 0.0 if integrator == "fourth_order" else 0.5
    simulation = tumbling(integrator, damping, planar=planar, step=5e-4 if integrator == "verlet" else 4e-3)
    assert simulation.plan.planar == planar
    before = simulation.momentum()
    simulation.step(200)
    after = simulation.momentum()
    np.testing.assert_allclose(after.linear, before.linear, atol=1e-9 * 2.0)
    if integrator in ("implicit_midpoint", "energy_momentum", "fourth_order"):
        np.testing.assert_allclose(after.angular, before.angular, atol=1e-9 * np.linalg.norm(before.angular))


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_energy_momentum_steps_balance_energy_with_springs_and_dampers(planar, damping):
    simulation = tumbling("energy_momentum", damping, planar=planar, step=2e-2)
    before = balance(simulation)
    swing = []
    for _ in range(150):
        simulation.step()
        swing.append(simulation.energy().spring)
    assert max(swing) > 3.0 * min(swing)
    assert balance(simulation) == pytest.approx(before, rel=1e-9)
    assert (simulation.energy().dissipated > 0.05 * before) == (damping > 0.0)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "fourth_order", "verlet"])
def test_energy_balance_converges_with_springs(integrator):
    gains = []
    for part in (1, 2, 4):
        # The dissipation of dampers in explicit steps is known to first order, as that of viscosity.
        simulation = tumbling(integrator, 0.5 if integrator == "implicit_midpoint" else 0.0, step=1e-3 / part)
        before = balance(simulation)
        simulation.step(200 * part)
        gains.append(balance(simulation) - before)
    if integrator == "fourth_order":
        assert abs(gains[-1]) < 1e-9 * before
    else:
        assert_order(gains, slack=0.3)


def test_backward_euler_only_loses():
    simulation = tumbling("backward_euler", 0.5)
    before = balance(simulation)
    for _ in range(100):
        simulation.step()
        assert balance(simulation) <= before * (1.0 + 1e-9)
        before = balance(simulation)


def test_a_stiff_spring_that_turns_far_in_a_step_gains_no_energy():
    """Two rods that hardly turn, about each other on a stiff spring that turns far in each step."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=1e4), "line_density": 1.0, "radius": 0.01, "nodes": 3}
    a = scene.add_rod(start=(-1, 0, -0.05), end=(-1, 0, 0.05), **parts)
    b = scene.add_rod(start=(1, 0, -0.05), end=(1, 0, 0.05), **parts)
    scene.add_spring(a.node(1), b.node(1), stiffness=3e3, rest_length=1.7)
    simulation = scene.build(time_step=5e-2, planar=False)
    for rod, speed in ((a, 4.0), (b, -4.0)):
        simulation.set_velocities(rod, [(0, speed, 0)] * 3)
    before = balance(simulation)
    scale = simulation.energy().total
    with pytest.warns(withe.CoarseStepWarning):
        simulation.step(200)
    assert balance(simulation) == pytest.approx(before, abs=1e-6 * scale)


@pytest.mark.parametrize("integrator", SCHEMES)
def test_springs_turn_with_the_scene(integrator):
    damping = 0.0 if integrator == "fourth_order" else 0.5
    step = 5e-4 if integrator == "verlet" else 4e-3
    turn = rods.rotation((0.3, -0.8, 0.5), 2.1)
    straight, turned = tumbling(integrator, damping, step), tumbling(integrator, damping, step, turn=turn)
    for simulation in (straight, turned):
        simulation.step(40)
    np.testing.assert_allclose(turned.positions() @ turn, straight.positions(), atol=1e-9)
    for name in ("slack", "tight", "lengthless"):
        assert turned.spring_tension(name) == pytest.approx(straight.spring_tension(name), rel=1e-7)


def test_a_plane_gives_what_space_gives():
    plane, space = (tumbling("energy_momentum", 0.5, planar=True, lift=lift) for lift in (False, True))
    assert plane.plan.planar
    assert not space.plan.planar
    for simulation in (plane, space):
        simulation.step(50)
    np.testing.assert_allclose(space.positions(), plane.positions(), atol=1e-9)


def guyed(k, edges, **more):
    """A level cantilever pushed upwards at its tip, which a spring from above or below holds back."""
    scene = rods.weightless()
    arm = rods.straight(scene, edges)
    post = scene.add_rod(
        start=(1, 0, -2), end=(1, 0, -3), nodes=2, stiffness=rods.stiffness(), line_density=1.0, radius=1e-3
    )
    scene.clamp(arm.start)
    scene.clamp(post.start)
    scene.add_force(arm.end, (0, 0, 1e-4))
    spring = scene.add_spring(arm.end, post.start, stiffness=k)
    return rods.sharp(scene, **more), arm, spring, post


@pytest.mark.case("statics", "Cantilever on a spring", source="F / (3 EI / L^3 + k)")
@pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("k", [0.5, 3.0, 60.0])
def test_guyed_cantilever_under_a_small_force(k, planar):
    """Stiffnesses of cantilever and spring add up: u = F / (3 B / L^3 + k)."""
    simulation, arm, spring, post = guyed(k, 60, planar=planar)
    assert simulation.equilibrium().stable
    expected = 1e-4 / (3.0 + k)
    assert simulation.positions(arm)[-1, 2] == pytest.approx(expected, rel=1e-4)
    assert simulation.spring_tension(spring) == pytest.approx(k * simulation.positions(arm)[-1, 2], rel=1e-6)
    pull = simulation.reaction(post.start).force
    np.testing.assert_allclose(pull, (0, 0, -simulation.spring_tension(spring)), atol=1e-12)


@pytest.mark.case("statics", "Rod that hangs from a spring", source="m g / k")
def test_a_rod_hangs_from_a_spring_by_its_weight():
    scene = withe.Scene()
    parts = {"stiffness": rods.stiffness(), "line_density": 0.2, "radius": 1e-3}
    beam = scene.add_rod(start=(0, 0, 0), end=(0.5, 0, 0), nodes=2, **parts)
    rod = scene.add_rod(start=(0, 0, -0.4), end=(0, 0, -1.4), nodes=6, **parts)
    scene.clamp(beam.start)
    spring = scene.add_spring(beam.start, rod.start, stiffness=5.0)
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    weight = 0.2 * 9.81
    assert simulation.spring_tension(spring) == pytest.approx(weight, rel=1e-9)
    assert simulation.positions(rod)[0, 2] == pytest.approx(-0.4 - weight / 5.0, rel=1e-9)
    assert simulation.energy().spring == pytest.approx(0.5 * weight**2 / 5.0, rel=1e-9)


def bridge(stiffness):
    """A cantilever whose tip is held at a point by a lengthless spring (None: by a pin), under its weight."""
    scene = withe.Scene()
    parts = {"stiffness": rods.stiffness(stretch=1e2), "line_density": 0.3, "radius": 1e-3}
    arm = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=13, **parts)
    scene.clamp(arm.start)
    if stiffness is None:
        scene.pin(arm.end)
    else:
        post = scene.add_rod(start=(1, 0, 0), end=(2, 0, 0), nodes=2, **parts)
        scene.clamp(post.start)
        scene.add_spring(arm.end, post.start, stiffness=stiffness)
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    return simulation.positions(arm)


def test_stiff_springs_go_over_into_a_pin_and_soft_ones_into_nothing():
    pinned = bridge(None)
    errors = [np.abs(bridge(k) - pinned).max() for k in (1e5, 1e6, 1e7)]
    assert_order(errors, order=1.0, ratio=10.0, slack=0.02)
    loose = bridge(0.0)
    errors = [np.abs(bridge(k) - loose).max() for k in (1e-3, 1e-4, 1e-5)]
    assert_order(errors, order=1.0, ratio=10.0, slack=0.02)


def test_very_stiff_springs_converge_to_what_rounding_leaves():
    simulation = tumbling("energy_momentum")
    x = simulation.positions()
    simulation.set("tight", stiffness=1e12, rest_length=np.linalg.norm(x[8] - x[9 + 5]))
    simulation.step(20)
    assert simulation.statistics.rejected_steps == 0


@pytest.mark.case("dynamics", "Longest stable Verlet step with a spring", source="2 / w")
def test_explicit_steps_know_what_springs_allow():
    """A spring between light nodes: w^2 = k (1 / m + 1 / m) with half of a rod's mass at either."""
    simulation, _ = two_masses("verlet", 1e-5, stretch=1e-6)
    assert simulation.plan.stable_step == pytest.approx(2.0 / np.sqrt(STIFFNESS * 4.0 / MASS), rel=1e-3)
    with pytest.raises(ValueError, match="stable step"):
        two_masses("verlet", 1.01 * simulation.plan.stable_step, stretch=1e-6)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "backward_euler", "energy_momentum"])
def test_newton_takes_springs_between_rods_in_few_iterations(integrator):
    simulation = tumbling(integrator, 0.5, adaptive=False)
    simulation.step(50)
    statistics = simulation.statistics
    assert statistics.iterations <= 6 * statistics.steps
    assert statistics.rejected_steps == 0
