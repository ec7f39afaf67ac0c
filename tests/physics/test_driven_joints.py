"""Motors, springs and dampers of revolute joints, against rigid bars, and what they conserve."""

import itertools
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rods
import withe
from cases import measured
from convergence import assert_order

SCHEMES = ("backward_euler", "implicit_midpoint", "energy_momentum", "fourth_order")
LENGTH, DENSITY = 0.3, 0.1  # [m], [kg/m]
INERTIA = DENSITY * LENGTH**3 / 3.0
STIFF = {"stiffness": rods.stiffness(bend=1e4, twist=1e4, stretch=1e8), "line_density": DENSITY, "radius": 1e-4}
SOFT = {"stiffness": rods.stiffness(bend=2e-2, twist=1e-2, stretch=1e3), "line_density": DENSITY, "radius": 3e-3}


def bar(planar, *, turn=None, swapped=False, gravity=(0, 0, 0), angle=0.0, step=1e-3, integrator="static", **numbers):
    """A rigid bar that hangs on a hinge, at an angle down from level, on a wall; its joint."""
    turn = np.eye(3) if turn is None else turn
    scene = withe.Scene(gravity=turn @ np.array(gravity, dtype=float))
    wall = scene.add_rod(start=turn @ (-0.1, 0, 0), end=(0, 0, 0), nodes=3, **STIFF)
    tip = LENGTH * np.array((np.cos(angle), 0.0, -np.sin(angle)))
    arm = scene.add_rod(start=(0, 0, 0), end=turn @ tip, nodes=4, name="arm", **STIFF)
    nodes, axis = ((arm.start, wall.end), (0, -1, 0)) if swapped else ((wall.end, arm.start), (0, 1, 0))
    scene.join(*nodes, "revolute", axis=turn @ axis, name="hinge", **numbers)
    scene.clamp(wall.start)
    return scene.build(planar=planar, integrator=integrator, time_step=step)


def settle(simulation):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", withe.OutOfPlaneWarning)
        return simulation.equilibrium()


@pytest.mark.case("actuation", "Bar on a hinge with spring and motor", source="k (theta - r) - M = W L / 2 cos(theta)")
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("planar", [True, False])
def test_a_spring_and_a_motor_hold_a_bar_where_its_weight_balances_them(planar, swapped):
    """k (theta - r) - m = W (L / 2) cos(theta), theta down from level."""
    weight = DENSITY * LENGTH * 9.81
    simulation = bar(planar, swapped=swapped, gravity=(0, 0, -9.81), stiffness=0.2, rest_angle=-0.3, moment=0.04)
    assert settle(simulation).stable
    down = brentq(lambda a: 0.2 * (a + 0.3) - 0.04 - 0.5 * weight * LENGTH * np.cos(a), -2.0, 2.0)
    angle = simulation.joint_angle("hinge")
    assert angle == pytest.approx(down, rel=1e-4)
    assert simulation.joint_torque("hinge") == pytest.approx(-0.5 * weight * LENGTH * np.cos(angle), rel=1e-4)
    tip = simulation.positions("arm")[-1]
    np.testing.assert_allclose(tip, LENGTH * np.array((np.cos(down), 0.0, -np.sin(down))), atol=1e-4)
    simulation.set("hinge", rest_angle=0.5, moment=0.0)
    settle(simulation)
    down = brentq(lambda a: 0.2 * (a - 0.5) - 0.5 * weight * LENGTH * np.cos(a), -2.0, 2.0)
    assert simulation.joint_angle("hinge") == pytest.approx(down, rel=1e-4)
    assert simulation.energy().spring == pytest.approx(0.1 * (down - 0.5) ** 2, rel=1e-3)


@pytest.mark.parametrize("planar", [True, False])
def test_an_upright_bar_falls_below_the_stiffness_that_balances_its_weight(planar):
    critical = 0.5 * DENSITY * LENGTH**2 * 9.81
    for share in (1.01, 0.99):
        simulation = bar(planar, gravity=(0, 0, -9.81), angle=-0.5 * np.pi, stiffness=share * critical)
        assert settle(simulation).stable
        leans = 0.0 if share > 1.0 else brentq(lambda a, k=share: k * a - np.sin(a), 0.1, 1.0)
        assert abs(simulation.joint_angle("hinge")) == pytest.approx(leans, abs=1e-3)


@pytest.mark.case("actuation", "Servo that moves a bar", source="Lagrange's equation")
@pytest.mark.parametrize("integrator", SCHEMES)
@pytest.mark.parametrize("planar", [True, False])
def test_a_servo_moves_a_bar_as_lagrange_has_it(planar, integrator):
    """I theta'' = m - k (theta - r) - c theta' + W (L / 2) cos(theta), from level."""
    damping = 0.0 if integrator == "fourth_order" else 2e-3
    numbers = {"stiffness": 0.05, "rest_angle": 1.5, "damping": damping, "moment": 0.01}
    weight = 0.5 * DENSITY * LENGTH**2 * 9.81

    def motion(_, y):
        torque = 0.01 - 0.05 * (y[0] - 1.5) - damping * y[1] + weight * np.cos(y[0])
        return y[1], torque / INERTIA

    exact = solve_ivp(motion, (0.0, 0.4), (0.0, 0.0), rtol=1e-10, atol=1e-12).y[:, -1]
    step = 5e-5 if integrator == "backward_euler" else 1e-3
    simulation = bar(planar, gravity=(0, 0, -9.81), integrator=integrator, step=step, **numbers)
    simulation.run(0.4, progress=False)
    measured(simulation.joint_angle("hinge") - exact[0], "rad")
    assert simulation.joint_angle("hinge") == pytest.approx(exact[0], abs=3e-3)
    energy = simulation.energy()
    assert energy.loads == pytest.approx(-0.01 * simulation.joint_angle("hinge"), rel=1e-9)
    if integrator == "energy_momentum":
        stored = 0.5 * 0.05 * 1.5**2
        assert energy.total + energy.dissipated - energy.work - stored == pytest.approx(0.0, abs=1e-9)
        assert energy.dissipated > 0.1 * stored


@pytest.mark.case("actuation", "Motor that turns a bar over two turns", source="ordinary differential equation")
@pytest.mark.parametrize("planar", [True, False])
def test_a_motor_turns_a_bar_round_and_whole_turns_are_counted(planar):
    simulation = bar(planar, integrator="energy_momentum", step=2e-3, moment=0.02)
    simulation.run(1.2, progress=False)
    expected = 0.5 * 0.02 / INERTIA * 1.2**2
    assert expected > 4.0 * np.pi
    measured(simulation.joint_angle("hinge") / expected - 1.0)
    assert simulation.joint_angle("hinge") == pytest.approx(expected, rel=1e-3)
    x = simulation.positions("arm")
    seen = np.arctan2(-(x[-1] - x[0])[2], (x[-1] - x[0])[0])
    assert np.angle(np.exp(1j * (seen - simulation.joint_angle("hinge")))) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("planar", [True, False])
def test_the_rate_of_a_joint_is_that_of_what_turns_against_what_it_turns_on(planar):
    """Two bars that swing about their hinge at rates of their own, in the plane of both."""
    scene = rods.weightless()
    left = scene.add_rod(start=(-0.1, 0, 0.1), end=(0, 0, 0), nodes=3, **STIFF)
    right = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=3, **STIFF)
    joint = scene.join(left.end, right.start, "revolute", axis=(0, 2, 0), damping=0.5, stiffness=2.0, rest_angle=0.3)
    simulation = scene.build(planar=planar)
    for rod, rate in ((left, 0.4), (right, -0.7)):
        simulation.set_state(rod, velocities=np.cross((0, rate, 0), simulation.positions(rod)))
    assert simulation.joint_rate(joint) == pytest.approx(-1.1, abs=1e-12)
    assert simulation.joint_torque(joint) == pytest.approx(2.0 * 0.3 + 0.5 * 1.1, abs=1e-12)


def test_what_leaves_its_plane_keeps_the_whole_turns_of_its_joints():
    simulation = bar(None, gravity=(0, 0, -1e-6), integrator="energy_momentum", step=2e-3, moment=0.02)
    assert simulation.plan.planar
    simulation.set("hinge", stiffness=1e-3)
    simulation.run(1.2, progress=False)
    angle, rate, energy = simulation.joint_angle("hinge"), simulation.joint_rate("hinge"), simulation.energy()
    assert angle > 2.5 * np.pi
    simulation.set(gravity=(0, -1e-6, -1e-6))
    assert not simulation.plan.planar
    assert simulation.joint_angle("hinge") == pytest.approx(angle, abs=1e-9)
    assert simulation.joint_rate("hinge") == pytest.approx(rate, rel=0.05)  # that of the last step
    assert simulation.energy().kinetic == pytest.approx(energy.kinetic, rel=1e-6)
    assert simulation.energy().spring == pytest.approx(energy.spring, rel=1e-9)


def test_what_a_joint_turns_out_of_the_plane_leaves_it():
    """About an axis in the plane; a spring that nothing winds keeps it there."""
    for numbers, planar in (({"stiffness": 0.1, "damping": 1e-3}, True), ({"moment": 1e-3}, False)):
        scene = withe.Scene()
        wall = scene.add_rod(start=(-0.1, 0, 0), end=(0, 0, 0), nodes=3, **STIFF)
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0.2), nodes=3, **STIFF)
        hinge = scene.join(wall.end, arm.start, "revolute", axis=(1, 0, 0), **numbers)
        scene.clamp(wall.start)
        simulation = scene.build(time_step=1e-3)
        assert simulation.plan.planar == planar
        assert simulation.joint_angle(hinge) == simulation.joint_rate(hinge) == 0.0
        simulation.set(hinge, stiffness=0.3)
        assert simulation.plan.planar == planar
        simulation.set(hinge, rest_angle=0.2)
        assert not simulation.plan.planar
        simulation.run(0.05, progress=False)
        assert simulation.joint_angle(hinge) > 1e-3


def two_soft_rods(planar, integrator, step, turn, fresh, **numbers):
    """Joined by a hinge, in free flight."""
    scene = rods.weightless()
    a = scene.add_rod(start=turn @ (-0.2, 0, 0.1), end=(0, 0, 0), nodes=9, **SOFT)
    b = scene.add_rod(start=(0, 0, 0), end=turn @ (0.3, 0, 0), nodes=12, **SOFT)
    joint = scene.join(a.end, b.start, "revolute", axis=turn @ (0, 1, 0), **numbers)
    tight = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
    simulation = scene.build(planar=planar, integrator=integrator, time_step=step, **tight)
    velocities = fresh.normal(size=(20, 3)) * (0.2, 0.0 if planar else 0.2, 0.2)
    simulation.set_velocities(None, velocities @ turn.T)
    return simulation, joint


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("planar", [True, False])
def test_momentum_is_kept_and_energy_booked_whatever_drives_a_joint(planar, integrator):
    fresh = np.random.default_rng(5)
    for _ in range(3):
        k, rest, m = fresh.uniform(0.01, 0.05), fresh.uniform(-1, 1), fresh.normal() * 5e-3
        numbers = {"stiffness": k, "rest_angle": rest, "damping": 1e-4, "moment": m}
        simulation, joint = two_soft_rods(planar, integrator, 3e-4, np.eye(3), fresh, **numbers)
        before, start = simulation.momentum(), simulation.energy().total
        assert simulation.energy().spring == pytest.approx(0.5 * k * rest**2, rel=1e-12)
        simulation.run(0.04, progress=False)
        simulation.set(joint, stiffness=2.0 * k, rest_angle=-rest, moment=-2.0 * m)
        simulation.run(0.08, progress=False)
        after, energy = simulation.momentum(), simulation.energy()
        np.testing.assert_allclose(after.linear, before.linear, atol=1e-10)
        np.testing.assert_allclose(after.angular, before.angular, atol=1e-11)
        near = 1e-9 if integrator == "energy_momentum" else 2e-3
        scale = energy.kinetic + energy.dissipated + energy.spring
        assert energy.total + energy.dissipated - energy.work - start == pytest.approx(0.0, abs=near * scale)


def test_the_same_joint_turned_in_space_does_the_same():
    turn = rods.rotation((0.3, -0.5, 0.8), 1.1)
    numbers = {"stiffness": 0.03, "rest_angle": 0.8, "damping": 1e-4, "moment": 2e-3}
    seen = []
    for of in (np.eye(3), turn):
        simulation, joint = two_soft_rods(False, "implicit_midpoint", 3e-4, of, np.random.default_rng(2), **numbers)
        simulation.run(0.05, progress=False)
        seen.append((simulation.positions() @ of, simulation.joint_angle(joint)))
    np.testing.assert_allclose(seen[0][0], seen[1][0], atol=1e-9)
    assert seen[0][1] == pytest.approx(seen[1][1], abs=1e-8)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler", "verlet"])
def test_a_plane_and_space_have_the_same_hinges(integrator):
    """On the same mesh. Rods are thin: in space hinges have inertia of their own, as much as half an edge's."""
    explicit = integrator == "verlet"  # whose steps follow that inertia
    thin = SOFT | {"radius": 3e-3 if explicit else 1e-4}
    numbers = {"stiffness": 0.03, "rest_angle": 0.8, "damping": 1e-4, "moment": 2e-3}
    step, near = (2e-5, 1e-5) if explicit else (3e-4, 1e-7)
    seen = []
    for planar in (True, False):
        scene = rods.weightless()
        a = scene.add_rod(start=(-0.2, 0, 0.1), end=(0, 0, 0), nodes=5, **thin)
        b = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=6, **thin)
        joint = scene.join(a.end, b.start, "revolute", axis=(0, -1, 0), **numbers)
        scene.clamp(a.start)
        scene.add_force(b.end, (0.0, 0.0, 0.02))
        simulation = scene.build(planar=planar, integrator=integrator, time_step=step)
        simulation.run(0.05, progress=False)
        seen.append((simulation.positions(), simulation.joint_angle(joint)))
    np.testing.assert_allclose(seen[0][0], seen[1][0], atol=near)
    assert seen[0][1] == pytest.approx(seen[1][1], abs=200.0 * near)  # frames vibrate


@pytest.mark.case("actuation", "Driven joints, convergence in time", source="refinement of the step")
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_driven_joints_converge_at_second_order(integrator, planar):
    numbers = {"stiffness": 0.03, "rest_angle": 0.3, "damping": 1e-3, "moment": 1e-3}
    angles = []
    for step in (4e-3, 2e-3, 1e-3, 5e-4):
        scene = rods.weightless()
        a = scene.add_rod(start=(-0.2, 0, 0.1), end=(0, 0, 0), nodes=2, **STIFF)
        b = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=2, **STIFF)
        joint = scene.join(a.end, b.start, "revolute", axis=(0, 1, 0), **numbers)
        simulation = scene.build(planar=planar, integrator=integrator, time_step=step, adaptive=False)
        simulation.run(0.2, progress=False)
        angles.append(simulation.joint_angle(joint))
    assert_order(np.abs(np.diff(angles)), order=2.0, slack=0.3)


def test_an_order_in_which_rods_are_joined_to_a_hub_makes_no_difference():
    """Hinges are hinges whichever of both is named first: none lets an arm turn about other axes."""
    tips = []
    for swapped in (False, True):
        scene = rods.weightless()
        hub = scene.add_rod(start=(0, -0.1, 0), end=(0, 0, 0), nodes=3, **SOFT)
        arms = [scene.add_rod(start=(0, 0, 0), end=(way, 0, 0.01), nodes=4, **SOFT) for way in (0.2, -0.2)]
        scene.join(hub.end, arms[0].start, "revolute", axis=(0, 1, 0))
        nodes = (arms[1].start, hub.end) if swapped else (hub.end, arms[1].start)
        scene.join(*nodes, "revolute", axis=(0, 1, 0))
        scene.clamp(hub.start)
        for arm in arms:
            scene.add_force(arm.end, (0, 1e-3, 0))
        simulation = scene.build(planar=False, time_step=2e-3)
        simulation.run(0.1, progress=False)
        tips.append([simulation.positions(arm)[-1] for arm in arms])
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-9)


@pytest.mark.case("actuation", "Angle of a hinge under a moment", source="k theta = M")
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("follower", [False, True])
@pytest.mark.parametrize("planar", [True, False])
def test_a_moment_on_what_turns_acts_at_its_hinge_on_any_mesh(planar, follower, swapped):
    """k theta = M, and the arm beyond it is straight."""
    for nodes in (2, 3, 9):
        scene = rods.weightless()
        post = scene.add_rod(start=(-0.1, 0, 0.02), end=(0, 0, 0), nodes=4, **SOFT)
        arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=nodes, **SOFT)
        ends, axis = ((arm.start, post.end), (0, -1, 0)) if swapped else ((post.end, arm.start), (0, 1, 0))
        hinge = scene.join(*ends, "revolute", axis=axis, stiffness=0.05)
        scene.clamp(post.start)
        scene.add_moment(arm.start, (0.0, 0.02, 0.0), follower=follower)
        simulation = rods.sharp(scene, planar=planar)
        settle(simulation)
        assert simulation.joint_angle(hinge) == pytest.approx(0.4, rel=1e-7)
        way = np.diff(simulation.positions(arm), axis=0)
        np.testing.assert_allclose(np.cross(way, way[0]), 0.0, atol=1e-10)


def test_custom_moments_act_on_what_others_turn_against_whichever_rod_came_first():
    angles = []
    for arm_first in (True, False):
        for planar in (True, False):
            scene = rods.weightless()
            hub = ((-0.2, 0, 0), (0, 0, 0), "hub")
            arm = ((0, 0, 0), (0.2, 0, 0.1), "arm")
            for start, end, name in (arm, hub) if arm_first else (hub, arm):
                scene.add_rod(start=start, end=end, nodes=4, name=name, **SOFT)
            hinge = scene.join("hub.end", "arm.start", "revolute", axis=(0, 1, 0), stiffness=0.05)
            scene.clamp("hub.start")
            moments = np.zeros((7, 3))
            at = 0 if arm_first else 3
            moments[at, 1] = 0.01
            scene.add_custom_force(lambda t, x, v, m=moments: (0.0 * x, m), moments=True)
            simulation = rods.sharp(scene, planar=planar)
            simulation.equilibrium()
            angles.append(simulation.joint_angle(hinge))
    np.testing.assert_allclose(angles, 0.0, atol=1e-9)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("swaps", list(itertools.product((False, True), repeat=2)))
def test_a_plane_lets_turn_what_space_does_however_rods_are_joined_to_a_hub(order, swaps):
    """One hinge about the normal, and one about an axis in the plane, which is rigid in it."""
    tips = []
    for planar in (True, False):
        scene = withe.Scene()
        ends = [((-0.2, 0, 0), (0, 0, 0)), ((0, 0, 0), (0.2, 0, -0.05)), ((0, 0, 0), (0.02, 0, 0.15))]
        names = ("hub", "arm", "horn")
        for i in order:
            scene.add_rod(start=ends[i][0], end=ends[i][1], nodes=4, name=names[i], **SOFT)
        for name, axis, swap in zip(("arm", "horn"), ((0, 1, 0), (1, 0, 0)), swaps, strict=True):
            nodes = ("hub.end", f"{name}.start")
            scene.join(*(nodes[::-1] if swap else nodes), "revolute", axis=axis, stiffness=0.2, name=f"{name} hinge")
        scene.clamp("hub.start")
        simulation = scene.build(integrator="static", planar=planar)
        settle(simulation)
        tips.append([simulation.positions(name)[-1] for name in names])
        sign = -1.0 if swaps[0] else 1.0
        assert sign * simulation.joint_angle("arm hinge") > 0.02
        assert simulation.joint_angle("horn hinge") == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-6)


@pytest.mark.parametrize("act", ["clamp", "clamp and release", "set_state"])
@pytest.mark.parametrize("planar", [True, False])
def test_what_takes_hold_at_a_hinge_or_is_told_where_it_is_changes_nothing(planar, act):
    """A servo that rests under a weight: a clamp on the side that turns, and its release, pull at nothing."""
    for stiffness in (5.0, 500.0):
        simulation = bar(planar, gravity=(0, 0, -9.81), stiffness=stiffness, integrator="implicit_midpoint", step=1e-4)
        settle(simulation)
        before = (simulation.joint_angle("hinge"), simulation.energy(), simulation.positions())
        if act == "set_state":
            simulation.set_state("arm", positions=simulation.positions("arm"))
        else:
            hold = simulation.clamp(simulation["arm"].start)
            if act != "clamp":
                simulation.release(hold)
        angle, energy = simulation.joint_angle("hinge"), simulation.energy()
        assert angle == pytest.approx(before[0], rel=1e-6)
        assert energy.spring == pytest.approx(before[1].spring, rel=1e-5)
        balance = [e.total + e.dissipated - e.work for e in (before[1], energy)]
        assert balance[1] == pytest.approx(balance[0], abs=1e-6 * before[1].spring)


@pytest.mark.parametrize("damping", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("planar", [True, False])
def test_rate_and_torque_of_a_damped_joint_are_those_that_are_booked(planar, damping):
    """A soft arm falls. The dissipation is c times the squared rate, as a mean over each step."""
    scene = withe.Scene()
    post = scene.add_rod(start=(-0.1, 0, 0), end=(0, 0, 0), nodes=3, **STIFF)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=9, **SOFT)
    hinge = scene.join(post.end, arm.start, "revolute", axis=(0, 1, 0), damping=damping)
    scene.clamp(post.start)
    step = 5e-4
    simulation = scene.build(planar=planar, integrator="energy_momentum", time_step=step)
    lost = 0.0
    for _ in range(100):
        before = simulation.joint_angle(hinge)
        simulation.step()
        rate = simulation.joint_rate(hinge)
        assert rate == pytest.approx((simulation.joint_angle(hinge) - before) / step, rel=1e-6, abs=1e-9)
        assert simulation.joint_torque(hinge) == pytest.approx(-damping * rate, rel=1e-9)
        lost += damping * rate**2 * step
    assert lost == pytest.approx(simulation.energy().dissipated, rel=1e-6)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("radius", [1e-3, 3e-3])
def test_frequencies_with_stiff_joints_are_those_with_rigid_ones(planar, radius):
    """However stiff, and on any mesh; between them those of theory are in `examples/servo_arm.py`."""
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    for nodes in (2, 4, 7):
        found = {}
        for stiffness in (None, 1.0, 1e3, 1e5, 1e6, 1e7, 1e8):
            scene = withe.Scene()
            post = scene.add_rod(start=(-0.1, 0, 0), end=(0, 0, 0), nodes=3, radius=radius, material=rubber)
            arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.2), nodes=nodes, radius=radius, material=rubber)
            turns = {} if stiffness is None else {"axis": (0, 1, 0), "stiffness": stiffness}
            scene.join(post.end, arm.start, "revolute" if turns else "rigid", **turns)
            scene.clamp(post.start)
            simulation = scene.build(planar=planar)
            settle(simulation)
            found[stiffness] = simulation.linearise().frequencies(3)
        soft = 1e7 * np.pi * radius**4 / 4 / 0.05  # [N m/rad] of half an edge, at most
        for stiffness in (1.0, 1e3, 1e5, 1e6, 1e7, 1e8):
            np.testing.assert_allclose(found[stiffness], found[None], rtol=1e-6 + 3.0 * soft / stiffness)


@pytest.mark.parametrize("planar", [True, False])
def test_hinges_are_relaxed_with_both_sides_in_whatever_order_rods_are_told(planar):
    """A hub that is held far away, and an arm that is told to have turned: the same angle, of least energy."""
    seen = []
    for order in (("arm",), ("hub", "arm"), ("arm", "hub")):
        scene = rods.weightless()
        scene.add_rod(start=(-0.2, 0, 0), end=(0, 0, 0), nodes=7, name="hub", **SOFT)
        scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=7, name="arm", **SOFT)
        hinge = scene.join("hub.end", "arm.start", "revolute", axis=(0, 1, 0), stiffness=0.02)
        scene.clamp("hub.start")
        simulation = scene.build(integrator="static", planar=planar)
        turned = simulation.positions("arm") @ rods.rotation((0, 1, 0), 0.5).T
        for name in order:
            simulation.set_state(name, positions=turned if name == "arm" else simulation.positions("hub"))
        energy = simulation.energy()
        seen.append((simulation.joint_angle(hinge), energy.spring + energy.bend))
    np.testing.assert_allclose(seen, [seen[0]] * 3, rtol=1e-6)
    # Half an edge at either side in a row with the spring, k (2 B / l) each: the energy of 0.5 rad over all three.
    share = 2.0 * 2e-2 / (0.2 / 6.0) * 6.0 / 5.0
    whole = 1.0 / (1.0 / 0.02 + 2.0 / share)
    assert seen[0][0] == pytest.approx(0.5 * whole / 0.02, rel=0.02)


@pytest.mark.parametrize("planar", [True, False])
def test_joints_stand_still_when_they_are_told_to(planar):
    simulation = bar(planar, gravity=(0, 0, -9.81), integrator="implicit_midpoint", step=1e-3, damping=0.1)
    simulation.run(0.1, progress=False)
    assert abs(simulation.joint_rate("hinge")) > 0.1
    simulation.set_velocities(None, np.zeros((6, 3)))
    assert simulation.joint_rate("hinge") == pytest.approx(0.0, abs=1e-9)
    assert simulation.joint_torque("hinge") == pytest.approx(0.0, abs=1e-9)
