"""Coulomb's law in its classical cases: slopes, cylinders that slide and roll, a stick that spins down, capstans."""

import numpy as np
import pytest

import withe
from cases import measured

G = 9.81
STIFF = withe.Material(youngs_modulus=1e9, poisson_ratio=0.3, density=1000.0)


def on_a_slope(degrees, friction, along, friction_model, step=2e-3, integrator="implicit_midpoint", **contact):
    """A cylinder that just touches a slope, and the direction down it."""
    angle = np.radians(degrees)
    normal = np.array((np.sin(angle), 0.0, np.cos(angle)))
    down = np.array((np.cos(angle), 0.0, -np.sin(angle)))
    axis = down if along else np.array((0.0, 1.0, 0.0))
    scene = withe.Scene()
    start = 0.02 * normal
    cylinder = scene.add_rod(start=start, end=start + 0.4 * axis, nodes=9, radius=0.02, material=STIFF)
    scene.add_plane((0, 0, 0), normal, friction=friction)
    scene.enable_contact(friction_model=friction_model, **contact)
    return scene.build(integrator=integrator, time_step=step), cylinder, down


FRICTION = 0.5
THRESHOLD = np.degrees(np.arctan(FRICTION))


@pytest.mark.case(
    "contact", "Block on a slope 0.001 steeper than friction holds", source="g (sin a - mu cos a) [Coulomb]"
)
@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
@pytest.mark.parametrize("beyond", [-0.001, 0.001])
def test_a_block_on_a_slope_slides_when_it_is_steeper_than_friction(beyond, friction_model):
    """Above the threshold with g (sin a - mu cos a); a thousandth of the angle to either side of it, it is told."""
    degrees = THRESHOLD * (1.0 + beyond)
    # The block slides a little while it comes to press on the slope, and loses this way within eight seconds. Backward
    # Euler is exact for constant acceleration.
    simulation, block, down = on_a_slope(
        degrees, FRICTION, True, friction_model, 5e-3, "backward_euler", slip_tolerance=1e-4
    )
    simulation.step(1600)
    before = simulation.velocities(block)[4] @ down
    simulation.step(100)
    after = simulation.velocities(block)[4] @ down
    angle = np.radians(degrees)
    exact = G * (np.sin(angle) - FRICTION * np.cos(angle))
    print(f"slope, {friction_model}, {beyond}:", after, (after - before) / 0.5 / exact - 1.0)
    if exact < 0.0:
        # Regularised friction creeps by less than its slip tolerance, anchors do not.
        assert abs(after) < (1e-7 if friction_model == "anchored" else 1e-4)
    else:
        assert after - before == pytest.approx(0.5 * exact, rel=1e-3)


@pytest.mark.case("contact", "Cylinder that rolls down a slope", source="2/3 g sin a")
@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
def test_a_cylinder_rolls_down_a_slope_at_two_thirds_of_what_slides(friction_model):
    simulation, cylinder, down = on_a_slope(20.0, 0.6, False, friction_model)
    simulation.step(100)
    before, spin = simulation.velocities(cylinder)[4] @ down, simulation.spins(cylinder)[4]
    simulation.step(200)
    gained = (simulation.velocities(cylinder)[4] @ down - before) / 0.4
    exact = 2.0 / 3.0 * G * np.sin(np.radians(20.0))
    print(f"rolling, {friction_model}:", gained / exact - 1.0)
    assert gained == pytest.approx(exact, rel=5e-4)
    assert (simulation.spins(cylinder)[4] - spin) / 0.4 * 0.02 == pytest.approx(exact, rel=2e-3)


@pytest.mark.case("contact", "Cylinder that slides until it rolls", source="2/3 v0 after v0 / (3 mu g)")
@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
def test_a_cylinder_that_slides_comes_to_roll_at_two_thirds_of_its_speed(friction_model):
    """After v0 / (3 mu g), whatever the friction."""
    simulation, cylinder, down = on_a_slope(0.0, 0.3, False, friction_model, step=1e-3)
    simulation.step(50)
    simulation.set_velocities(cylinder, np.tile(down, (9, 1)))
    simulation.step(80)
    sliding = simulation.velocities(cylinder)[4] @ down
    simulation.step(420)
    rolling = simulation.velocities(cylinder)[4] @ down
    print(f"to rolling, {friction_model}:", sliding / (1.0 - 0.3 * G * 0.08) - 1.0, 1.5 * rolling - 1.0)
    assert sliding == pytest.approx(1.0 - 0.3 * G * 0.08, rel=1e-3)
    assert rolling == pytest.approx(2.0 / 3.0, rel=2e-4)


def spin_lost(edges):
    """Angular deceleration of a rubber stick over three tenths of a second, of its angular momentum [rad/s^2]."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e7, poisson_ratio=0.5, density=1000.0)
    stick = scene.add_rod(start=(-0.5, 0, 0.02), end=(0.5, 0, 0.02), nodes=edges + 1, radius=0.02, material=rubber)
    scene.add_floor(friction=0.3)
    scene.enable_contact(friction_model="implicit", slip_tolerance=1e-3)
    simulation = scene.build(time_step=1e-3)
    simulation.step(400)
    velocities = np.zeros((edges + 1, 3))
    velocities[:, 1] = 8.0 * simulation.positions(stick)[:, 0]
    simulation.set_velocities(stick, velocities)

    def spin():
        """12 / L^3 times the integral of x v, both straight along every edge."""
        x, v = simulation.positions(stick), simulation.velocities(stick)
        middle = np.cross(0.5 * (x[1:] + x[:-1]), 0.5 * (v[1:] + v[:-1]))
        return float(12.0 * (middle + np.cross(np.diff(x, axis=0), np.diff(v, axis=0)) / 12.0)[:, 2].mean())

    simulation.step(50)
    before = spin()
    simulation.step(300)
    return (before - spin()) / 0.3


@pytest.mark.case("contact", "Stick that spins flat on a floor", source="3 mu g / L")
def test_a_stick_that_spins_flat_on_a_floor_slows_at_three_mu_g_over_its_length():
    """Torque mu m g L / 4 over m L^2 / 12. It is soft enough to press evenly along its length."""
    errors = [spin_lost(n) / (3.0 * 0.3 * G) - 1.0 for n in (4, 10, 40)]
    print("spinning stick:", errors)
    measured(errors)
    assert abs(errors[0]) < 1e-3
    assert np.abs(errors[1:]).max() < 3e-4


POST, ROPE, TAIL = 0.05, 0.005, 0.08  # [m]


def wound(nodes, wrap):
    """A rope that winds about a post and leaves straight; its tangents at both ends, and what it turns by."""
    reach = POST + ROPE
    rise = 3.0 * ROPE / (2.0 * np.pi) if wrap > np.pi else 0.0
    per = np.hypot(reach, rise)
    s = np.linspace(-TAIL, wrap * per + TAIL, nodes)
    angle = np.clip(s / per, 0.0, wrap)

    def tangent(a):
        return np.array((-reach * np.sin(a), rise, reach * np.cos(a))) / per

    points = np.stack([reach * np.cos(angle), rise * angle, reach * np.sin(angle)], axis=1)
    points += np.outer(np.minimum(s, 0.0), tangent(0.0)) + np.outer(np.maximum(s - wrap * per, 0.0), tangent(wrap))
    return points, tangent(0.0), tangent(wrap), wrap * reach / per


@pytest.mark.case(
    "contact", "Capstan: tension ratio over 0.25 to 2 turns", source="exp(mu phi) [Euler 1769, Eytelwein 1808]"
)
@pytest.mark.parametrize(("turns", "bound"), [(0.25, 2e-4), (1.0, 3e-4), (2.0, 1.5e-3)])
def test_a_rope_wound_about_a_post_multiplies_its_tension(turns, bound):
    """exp(mu phi) [Euler 1769, Eytelwein 1808]; beyond half a turn it climbs, and turns by a thousandth less."""
    friction, speed, step = 0.2, 0.01, 5e-3
    points, first, last, turned = wound(201, 2.0 * np.pi * turns)
    exact = np.exp(friction * turned)
    bending = 5e-4 * (POST + ROPE) ** 2  # hardly any
    scene = withe.Scene(gravity=(0, 0, 0))
    rope = scene.add_rod(
        points=points,
        radius=ROPE,
        stiffness=withe.Stiffness(stretch=2e3 * exact, bend=bending, twist=bending),
        line_density=0.02,
        natural="straight",
    )
    scene.add_capsule((0, -1, 0), (0, 1, 0), POST, friction=friction)
    # Hard surfaces. Surfaces that begin to press a tenth of the radius before they touch, and press a hundredth of it
    # deep, lead to an error of 0.0012 at one turn, for any number of nodes. With corners the error has the other sign.
    scene.enable_contact(
        slip_tolerance=1e-4,
        centreline_friction=True,
        friction_model="implicit",
        stiffness=1e6,
        distance_tolerance=0.01 * ROPE,
    )
    scene.ignore_contact(rope, rope)
    scene.add_force(rope.start, -first)
    scene.add_drag(0.02)
    grip = scene.pin(rope.end)
    simulation = scene.build(integrator="backward_euler", time_step=step)
    simulation.move(grip, position=points[-1] + 1.2 * speed * last, over=1.2)
    simulation.step(150)
    pulls = []
    for _ in range(50):
        simulation.step()
        pulls.append(simulation.reaction(grip).force @ last)
    error = float(np.mean(pulls)) / exact - 1.0
    print(f"capstan, {turns} turns:", exact, error)
    measured(error)
    assert abs(error) < bound


def grasped(friction_model, integrator):
    """Way by which a cylinder sinks in ten seconds, after four elastic fingers have gripped and lifted it [m]."""
    scene = withe.Scene()
    radius, thick = 8e-3, 3e-3
    foam = withe.Material(youngs_modulus=1e7, poisson_ratio=0.5, density=500.0, viscosity=2e3)
    rubber = withe.Material(youngs_modulus=1e7, poisson_ratio=0.5, density=1000.0, viscosity=2e3)
    cylinder = scene.add_rod(start=(0, -0.03, 0), end=(0, 0.03, 0), nodes=7, radius=radius, material=foam)
    hands = []
    for side, y in ((-1, -0.015), (-1, 0.015), (1, -0.015), (1, 0.015)):
        top = np.array((side * (radius + thick + 1e-4), y, 0.06))
        finger = scene.add_rod(start=top, end=(top[0], y, -0.004), nodes=15, radius=thick, material=rubber)
        hands.append((scene.clamp(finger.start), top - (side * 6e-3, 0, 0)))
    scene.add_floor(-radius)
    scene.enable_contact(friction=0.8, friction_model=friction_model)
    simulation = scene.build(integrator=integrator, time_step=5e-3)
    for up in (0.0, 0.02):
        for hand, place in hands:
            simulation.move(hand, position=place + np.array((0, 0, up)), over=0.3)
        simulation.run(1.0, progress=False)
    before = simulation.positions(cylinder)
    assert before[:, 2].min() > 0.015
    simulation.run(10.0, progress=False)
    return float((before - simulation.positions(cylinder))[:, 2].max())


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
def test_a_grasped_cylinder_does_not_creep_on_anchors(integrator):
    """Regularised friction lets it sink at about a tenth of the slip tolerance."""
    assert abs(grasped("anchored", integrator)) < 1e-7
    assert grasped("implicit", integrator) > 1e-4


def gathered(force, tolerance):
    """Speed beyond (F - mu m g) t / m of a block of 1 kg that a force begins to push at once [m/s]."""
    scene = withe.Scene()
    radius = 0.025
    foam = withe.Material(youngs_modulus=1e5, poisson_ratio=0.5, density=1.0 / (np.pi * radius**2))
    block = scene.add_rod(start=(0, 0, radius), end=(1, 0, radius), nodes=26, radius=radius, material=foam)
    scene.add_floor(friction=0.4)
    scene.enable_contact(distance_tolerance=tolerance)
    push = scene.add_load(block, (0.0, 0.0, 0.0))
    simulation = scene.build(time_step=1e-3)
    simulation.equilibrium()
    simulation.set(push, load=(force, 0.0, 0.0))
    simulation.run(0.5, progress=False)
    return simulation.velocities(block)[:, 0].mean() - (force - 0.4 * G) * 0.5


def test_a_block_that_is_pushed_at_once_gathers_the_speed_that_its_anchors_give_before_it_slides():
    """The block is on a spring that yields at mu m g, x = delta / 20 from its rest. Then it slides by Coulomb's law.

    The spring adds the velocity sqrt((2 F - mu m g) x / m), minus (F / mu m g - 1) g mu times the time in the spring.
    """
    for force in (4.121, 6.0):
        speeds = []
        for tolerance in (2e-3, 5e-4):
            give = 0.05 * tolerance
            rate, shift = np.sqrt(0.4 * G / give), force * give / (0.4 * G)
            until = np.arccos(1.0 - give / shift) / rate
            exact = shift * rate * np.sin(rate * until) - (force - 0.4 * G) * until
            speeds.append(gathered(force, tolerance))
            print(f"pushed at once, {force} N, tolerance {tolerance}:", speeds[-1], exact)
            assert 0.75 * exact < speeds[-1] < exact  # as contact is up to a quarter stiffer than it has to be
        assert speeds[0] / speeds[1] == pytest.approx(2.0, rel=0.1)  # goes with the root of the tolerance


@pytest.mark.parametrize("time_step", [2e-3, 5e-4, 1e-4, 2e-5])
def test_what_friction_takes_throws_no_rod_up(time_step):
    """A rod lies on two rails and is pushed along itself.

    The yielded depth of contact, 3 % of the radius as drawn, pressed again too fast, on energy that friction had
    dissipated. In short steps, rails then pressed up to thirty times as hard as the weight of the rod.
    """
    radius, length = 5e-3, 0.2
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1200.0)
    rod = scene.add_rod(start=(-0.5 * length, 0, 0), end=(0.5 * length, 0, 0), nodes=11, radius=radius, material=rubber)
    for x in (-0.0487, 0.0479):
        rail = scene.add_rod(
            start=(x, -0.06, -2 * radius),
            end=(x, 0.06, -2 * radius),
            nodes=7,
            radius=radius,
            material=withe.Material(youngs_modulus=1e11, poisson_ratio=0.4, density=1200.0),
        )
        for node in range(7):
            (scene.clamp if node in (0, 6) else scene.pin)(rail.node(node))
    scene.enable_contact(friction=0.3)
    simulation = scene.build(time_step=time_step)
    simulation.step(round(0.1 / time_step))
    simulation.set_velocities(rod, (0.5, 0, 0))
    height, dissipated = simulation.positions(rod)[:, 2].mean(), simulation.energy().dissipated
    work, risen, pressing = 0.0, 0.0, 0.0
    weight = 9.81 * 1200.0 * np.pi * radius**2 * length
    for _ in range(round(0.02 / time_step)):
        momentum, speed = simulation.momentum().linear, simulation.velocities(rod)[:, 0].mean()
        simulation.step()
        force = (simulation.momentum().linear - momentum) / time_step
        work -= force[0] * 0.5 * time_step * (speed + simulation.velocities(rod)[:, 0].mean())
        pressing = max(pressing, force[2] / weight + 1.0)
        risen = max(risen, simulation.positions(rod)[:, 2].mean() - height)
    heat = simulation.energy().dissipated - dissipated
    print(f"steps of {time_step} s: risen {risen:.2e} m, pressed {pressing:.2f}, heat {heat:.4e} of {work:.4e} J")
    assert risen < 0.03 * radius
    assert pressing < 4.0
    assert heat == pytest.approx(work - weight * risen, rel=0.02)


def test_contacts_say_what_pressed_as_a_step_ended():
    """And not what the next would begin with, once what has yielded presses again: that was 11 % more."""
    radius, length, step = 5e-3, 0.2, 2e-3
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1200.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=11, radius=radius, material=rubber)
    scene.add_floor(-radius, friction=0.3)
    simulation = scene.build(integrator="backward_euler", time_step=step, planar=False)
    simulation.step(100)
    simulation.set_velocities(rod, (0.5, 0, 0))
    weight = 9.81 * 1200.0 * np.pi * radius**2 * length
    for _ in range(10):
        before = simulation.momentum().linear[2]
        simulation.step()
        pressed = weight + (simulation.momentum().linear[2] - before) / step
        assert simulation.contacts()["normal_force"].sum() == pytest.approx(pressed, rel=1e-6)


def test_contacts_say_what_presses_at_a_stiffness_that_was_set():
    """No step has pressed at it yet: as hard as it makes surfaces where they are."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1200.0)
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=rubber)
    scene.add_floor(-5e-3, friction=0.3)
    scene.enable_contact(stiffness=5e3)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3, planar=False)
    simulation.step(100)
    before = simulation.contacts()["normal_force"]
    simulation.set(contact_stiffness=1e5)
    np.testing.assert_allclose(simulation.contacts()["normal_force"], 20.0 * before, rtol=1e-9)
