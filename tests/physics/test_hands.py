"""Hands: what they hold does not jump, rigid ones are clamps, yielding ones springs, and their wrench balances."""

import numpy as np
import pytest

import rods
import withe
from convergence import assert_order
from held_rods import SOFT, TIGHT, curve, rope


def stored(simulation):
    e = simulation.energy()
    return np.array([e.kinetic, e.stretch, e.bend, e.twist, e.gravity, e.spring])


def balance(simulation):
    e = simulation.energy()
    return e.total - e.work + e.dissipated


class Still:
    """All that a grasp and a release leave as it is."""

    def __init__(self, simulation, rod):
        self.simulation, self.rod = simulation, rod
        self.shape = simulation.positions(), simulation.velocities(), simulation.directors(rod)
        self.energies, self.balance, self.momentum = stored(simulation), balance(simulation), simulation.momentum()

    def check(self, kept=0.0):
        """`kept`: stored in a hand that has let go [J]."""
        now = Still(self.simulation, self.rod)
        np.testing.assert_array_equal(now.shape[0], self.shape[0])
        np.testing.assert_array_equal(now.shape[1], self.shape[1])
        np.testing.assert_allclose(now.shape[2], self.shape[2], atol=1e-14)
        size = 1e-13 * (1.0 + np.abs(self.energies).max())
        np.testing.assert_allclose(now.energies, self.energies - (0, 0, 0, 0, 0, kept), atol=size)
        np.testing.assert_allclose(now.momentum.linear, self.momentum.linear, atol=1e-14)
        np.testing.assert_allclose(now.momentum.angular, self.momentum.angular, atol=1e-14)
        assert now.balance == pytest.approx(self.balance, abs=size)


@pytest.mark.parametrize("yields", [False, True], ids=["rigid", "yielding"])
@pytest.mark.parametrize("shape", ["open", "closed", "forked"])
def test_grasp_and_release_anywhere_at_any_time_change_nothing(yields, shape):
    closed = shape == "closed"
    simulation, rod = rope(closed=closed, forked=shape == "forked")
    lengths = curve(12, closed)[1]
    whole, clear = lengths.sum(), 1.001 * lengths[0] if shape == "forked" else 0.0
    random = np.random.default_rng(7)
    velocities = 0.3 * random.normal(size=(rod.nodes, 3))
    velocities[0] *= shape != "forked"  # clamped
    simulation.set_velocities(rod, velocities)
    for _ in range(100):
        simulation.step(int(random.integers(1, 3)))
        span = random.uniform(0.0, 0.3) * whole
        at = random.uniform(0.0, whole) if closed else random.uniform(clear + 0.5 * span, whole - 0.5 * span)
        before = Still(simulation, rod)
        hand = simulation.grasp(rod, at, span, stiffness=(30.0, 0.4) if yields else None)
        before.check()
        simulation.step()
        before = Still(simulation, rod)
        assert (before.energies[-1] > 0.0) == yields
        hand.release()
        before.check(kept=before.energies[-1])


@pytest.mark.parametrize("integrator", ["static", "backward_euler", "energy_momentum"])
def test_a_rigid_hand_is_a_clamp_that_holds_the_edge(integrator):
    turn, shift = rods.rotation((0.3, 1.0, -0.2), 0.7), np.array([0.1, -0.05, 0.2])
    answers = []
    for hand in (False, True):
        scene = withe.Scene(gravity=(0.0, 0.0, -2.0))
        arm = rods.straight(scene, 10, line_density=1.0)
        scene.pin(arm.end)
        held = scene.grasp(arm, 0.03) if hand else scene.clamp(arm.start, hold="edge")
        simulation = scene.build(integrator=integrator, time_step=1e-3, planar=False, **TIGHT)
        if hand:
            # The clamp turns about the node, so the hand's point goes around it.
            place, axes = simulation.pose(held)
            node = simulation.positions(arm)[0]
            simulation.move(held, node + shift + turn @ (place - node), turn @ axes, over=0.1)
        else:
            simulation.move(held, shift, turn, over=0.1)
        if integrator == "static":
            simulation.step(100)
        else:
            # On the same circle, and not on its chord.
            pose = simulation.pose(held)
            start = pose.position.copy()

            def path(t, hand=hand, start=start, axes=pose.rotation):
                part = min(t / 0.1, 1.0)
                now = rods.rotation((0.3, 1.0, -0.2), 0.7 * part)
                return (part * shift + now @ start, now @ axes) if hand else (part * shift, now)

            simulation.move(held, path=path)
            simulation.step(120)
        answers.append((simulation.positions(), simulation.directors(arm), simulation.energy().total))
    for clamp, hand in zip(*answers, strict=True):
        np.testing.assert_allclose(hand, clamp, atol=1e-9)


def cantilever(stiffness=None, edges=20, planar=True, limit=None):
    """A light rod from a wall, and a hand at its end."""
    scene = rods.weightless()
    arm = rods.straight(scene, edges)
    scene.clamp(arm.start)
    hand = scene.grasp(arm, 1.0, stiffness=stiffness, force_limit=limit)
    return rods.sharp(scene, planar=planar), arm, hand


@pytest.mark.case("statics", "Cantilever pushed by a compliant hand", source="springs in series, 3 EI / L^3")
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_a_cantilever_pushed_through_a_spring_takes_the_share_of_springs_in_series(planar):
    k, push = 5.0, 1e-5
    simulation, arm, hand = cantilever((k, 1e-9), planar=planar)
    sideways = np.array([0.0, 0.6, 0.8])
    if planar:
        sideways = np.cross(simulation.plan.plane_normal, (1.0, 0.0, 0.0))
    simulation.move(hand, simulation.pose(hand).position + push * sideways)
    simulation.step()
    wrench = simulation.wrench(hand)
    expected = push / (1.0 / k + 1.0 / 3.0)  # 3 EI / L^3
    assert wrench.force @ sideways == pytest.approx(expected, rel=2e-3)
    moved = simulation.positions(arm)[-1] @ sideways
    assert wrench.force @ sideways == pytest.approx(k * (push - moved), rel=1e-9)
    assert simulation.deflection(hand).shift == pytest.approx(
        simulation.pose(hand).rotation.T @ ((moved - push) * sideways), abs=1e-10
    )


@pytest.mark.case("statics", "Cantilever turned by a compliant hand", source="springs in series, EI / L")
def test_a_cantilever_turned_through_a_spring_takes_its_share_too():
    """M = c (angle - turn) = EI / L turn with the tip free to move: the hand holds it by next to nothing."""
    c, angle = 2.0, 1e-4
    simulation, _, hand = cantilever((1e-9, c), edges=80, planar=False)
    place, axes = simulation.pose(hand)
    simulation.move(hand, place, rods.rotation((0.0, 1.0, 0.0), angle) @ axes)
    simulation.step()
    moment = simulation.wrench(hand).moment
    assert moment == pytest.approx((0.0, angle / (1.0 / c + 1.0), 0.0), rel=1e-2, abs=1e-9)
    turn = simulation.deflection(hand).turn
    assert np.linalg.norm(turn) * c == pytest.approx(np.linalg.norm(moment), rel=1e-6)


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_a_stiff_hand_converges_to_a_rigid_one(planar):
    def place(stiffness, length=0.12):
        scene = withe.Scene(gravity=(0.0, 0.0, -2.0))
        arm = rods.straight(scene, 20)
        scene.clamp(arm.start)
        hand = scene.grasp(arm, 0.73, length, stiffness=stiffness)
        simulation = rods.sharp(scene, planar=planar)
        at, axes = simulation.pose(hand)
        simulation.move(hand, np.add(at, (-0.02, 0.0, 0.05)), rods.rotation((0.0, 1.0, 0.0), 0.3) @ axes, over=5e-3)
        simulation.step(2)
        return simulation.positions(arm), simulation.wrench(hand)

    rigid, wrench = place(None)
    off, forces = [], []
    for k in (1e5, 1e6, 1e7):
        soft, found = place((k, 0.1 * k))
        off.append(np.abs(soft - rigid).max())
        forces.append(np.linalg.norm(found.force - wrench.force))
    assert_order(off, 1.0, ratio=10.0)
    assert_order(forces, 1.0, ratio=10.0)
    assert off[-1] < 2e-5


@pytest.mark.parametrize("stiffness", [None, (200.0, 5.0)], ids=["rigid", "yielding"])
def test_the_wrench_carries_the_weight_about_any_point(stiffness):
    scene = withe.Scene(gravity=(0.0, 0.0, -9.0))
    rod = rods.straight(scene, 20, stiffness=rods.stiffness(stretch=1e4))
    hand = scene.grasp(rod, 0.37, 0.11, stiffness=stiffness)
    simulation = rods.sharp(scene, planar=False)
    assert simulation.equilibrium().stable
    x = simulation.positions(rod)
    mass = np.full(21, 0.05)
    mass[[0, -1]] = 0.025
    for point in ((0.0, 0.0, 0.0), (0.3, -2.0, 1.0)):
        wrench = simulation.wrench(hand, about=point)
        np.testing.assert_allclose(wrench.force, (0.0, 0.0, 9.0), atol=1e-9)
        weight = np.cross(x - point, mass[:, None] * np.array([0.0, 0.0, -9.0])).sum(axis=0)
        np.testing.assert_allclose(wrench.moment, -weight, atol=1e-9)


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("stiffness", [None, (50.0, 0.5)], ids=["rigid", "yielding"])
def test_momenta_grow_by_the_wrench(stiffness, closed):
    simulation, rod = rope(weight=2.0, closed=closed, adaptive=False)
    simulation.step(20)
    hand = simulation.grasp(rod, 0.41, 0.2, stiffness=stiffness)
    if stiffness:
        place, axes = hand.pose
        hand.move(np.add(place, (0.1, 0.2, 0.3)), rods.rotation((1.0, 2.0, -1.0), 1.0) @ axes, over=0.1)
    simulation.step(3)
    lengths = curve(12, closed)[1]
    mass = (
        0.5 * (np.append(lengths, 0.0) + np.append(0.0, lengths))
        if not closed
        else 0.5 * (lengths + np.roll(lengths, 1))
    )
    weight = mass[:, None] * np.array([0.0, 0.0, -2.0])
    for _ in range(10):
        before, x, t = simulation.momentum(), simulation.positions(rod), simulation.time
        simulation.step()
        after, dt = simulation.momentum(), simulation.time - t
        middle = 0.5 * (x + simulation.positions(rod))
        wrench = simulation.wrench(hand, about=(0.0, 0.0, 0.0))
        np.testing.assert_allclose(after.linear - before.linear, dt * (wrench.force + weight.sum(axis=0)), atol=1e-11)
        turned = wrench.moment + np.cross(middle, weight).sum(axis=0)
        np.testing.assert_allclose(after.angular - before.angular, dt * turned, atol=1e-10)


@pytest.mark.parametrize("stiffness", [None, (300.0, 3.0)], ids=["rigid", "yielding"])
def test_what_hands_do_is_work(stiffness):
    """To rounding in energy-momentum steps, at second order in midpoint ones."""

    def error(step, integrator="implicit_midpoint"):
        simulation, rod = rope(weight=2.0, time_step=step, adaptive=False, integrator=integrator)
        hand = simulation.grasp(rod, 0.41, 0.2, stiffness=stiffness)
        at, axes = hand.pose
        hand.move(
            path=lambda t: (
                at + 0.1 * np.array([np.sin(3 * t) ** 2, t**2, 1 - np.cos(4 * t)]),
                rods.rotation((1, 2, -1), 1.5 * t**2) @ axes,
            )
        )
        start = balance(simulation)
        simulation.step(round(0.2 / step))
        assert abs(simulation.energy().work) > 1e-2
        return abs(balance(simulation) - start)

    steps = (2e-3, 1e-3, 5e-4)
    assert_order([error(step) for step in steps], 2.0)
    assert max(error(step, "energy_momentum") for step in steps) < 1e-10


def drawn_motion(number, planar):
    """A rod, and a weak or firm hand that yields on its way to and fro."""
    random = np.random.default_rng([3, number])
    scene = withe.Scene(gravity=(0.0, -9.81, 0.0))
    rubber = withe.Material(youngs_modulus=1e6, density=1e3, poisson_ratio=0.5)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=15, radius=4e-3, material=rubber)
    simulation = scene.build(integrator="energy_momentum", time_step=10.0 ** random.uniform(-3.0, -2.1), planar=planar)
    hand = simulation.grasp(
        rod, at=random.uniform(0.03, 0.17), length=random.uniform(0.0, 0.04),
        stiffness=(200.0, 10.0 ** random.uniform(-6.0, -1.0)), force_limit=random.choice([0.5, 1e3]),
    )  # fmt: skip
    place, axes = hand.pose
    axis = np.array((0.0, 0.0, 1.0) if planar else (0.36, 0.48, 0.8))
    way = random.uniform(-0.03, 0.03, 3) * (1.0, 1.0, 0.0 if planar else 1.0)
    swing, speed = random.uniform(0.5, 2.0), random.uniform(5.0, 12.0)

    def path(t):
        return place + way * np.sin(12.0 * t), rods.rotation(axis, swing * np.sin(speed * t)) @ axes

    hand.move(path=path)
    return simulation, hand


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("number", range(8))
def test_energy_momentum_steps_balance_what_a_yielding_hand_does_and_stores(number, planar):
    """Turns in the hand beyond 120 degrees, where a step once found no place for it, and slips among them."""
    simulation, _ = drawn_motion(number, planar)
    start = balance(simulation)
    while simulation.time < 0.6:
        simulation.step()
        e = simulation.energy()
        assert balance(simulation) == pytest.approx(start, abs=1e-7 * (e.kinetic + e.bend + e.spring + 1e-3))


def test_what_a_weak_hand_holds_may_turn_far_in_it():
    turned = 0.0
    for number in range(8):
        simulation, hand = drawn_motion(number, False)
        while simulation.time < 0.6:
            simulation.step()
            turned = max(turned, np.degrees(np.linalg.norm(hand.deflection.turn)))
    assert turned > 150.0


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_an_equilibrium_follows_a_hand_that_yields_as_it_turns(planar):
    """All at once as in parts, on one branch: the rod takes M L / B of the turn, the hand the rest."""

    def turned(parts, degrees=170.0):
        scene = rods.weightless()
        arm = rods.straight(scene, 40, normal=(0, 0, 1))
        scene.clamp(arm.start)
        hand = scene.grasp(arm, 0.99, stiffness=(8000.0, 10.0))
        simulation = scene.build(integrator="static", planar=planar)
        axes = simulation.pose(hand).rotation
        for k in range(parts):
            turn = rods.rotation((0.0, 1.0, 0.0), np.radians(degrees) * (k + 1) / parts)
            simulation.move(hand, rotation=turn @ axes)
            found = simulation.equilibrium()
            assert found.stable
            assert not found.branch_changed
        return simulation.positions(arm), np.linalg.norm(simulation.deflection(hand).turn)

    at_once, in_parts = turned(1), turned(34)
    np.testing.assert_allclose(at_once[0], in_parts[0], atol=1e-8)
    assert at_once[1] == pytest.approx(in_parts[1], abs=1e-7)
    assert at_once[1] > 1.0


def test_a_weak_hand_that_turns_on_and_on_lets_what_it_holds_turn_by_nearly_half_a_turn():
    scene = withe.Scene(gravity=(0.0, -9.81, 0.0))
    rubber = withe.Material(youngs_modulus=1e6, density=1e3, poisson_ratio=0.5)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=15, radius=4e-3, material=rubber)
    simulation = scene.build(integrator="energy_momentum", time_step=5e-3, planar=False)
    hand = simulation.grasp(rod, at=0.05, stiffness=(200.0, 1e-6))
    place, axes = hand.pose
    hand.move(path=lambda t: (place, rods.rotation((0.36, 0.48, 0.8), 10.0 * t) @ axes))
    start, turned = balance(simulation), 0.0
    for _ in range(200):
        simulation.step()
        e = simulation.energy()
        assert balance(simulation) == pytest.approx(start, abs=1e-7 * (e.kinetic + e.bend + e.spring + 1e-3))
        turned = max(turned, float(np.linalg.norm(simulation.deflection(hand).turn)))
    assert turned > np.radians(165.0)


@pytest.mark.case("contact", "Rod that slips out of a hand", source="force limit F, slip d - F / k")
def test_a_rod_drawn_out_of_a_hand_slips_at_the_limit_and_what_that_takes_is_dissipated():
    limit, k = 0.3, 200.0
    scene = rods.weightless()
    rod = rods.straight(scene, 20)
    end = scene.clamp(rod.end, hold="edge")
    hand = scene.grasp(rod, 0.2, stiffness=(k, 5.0), force_limit=limit)
    simulation = scene.build(time_step=1e-2, planar=False, integrator="static", **TIGHT)
    simulation.move(end, (1.1, 0.0, 0.0), over=1.0)
    simulation.step(100)
    wrench = simulation.wrench(hand)
    np.testing.assert_allclose(wrench.force, (-limit, 0.0, 0.0), atol=1e-9)
    found = simulation.deflection(hand)
    axes = simulation.pose(hand).rotation
    np.testing.assert_allclose(axes @ found.shift, (limit / k, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(axes @ found.slip, (0.1 - limit / k, 0.0, 0.0), atol=1e-8)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_what_slipping_takes_closes_the_energy_balance(integrator):
    scene = rods.weightless()
    rod = rods.straight(scene, 10, stiffness=rods.stiffness(stretch=50.0))
    hand = scene.grasp(rod, 0.5, stiffness=(100.0, 1.0), force_limit=0.05)
    simulation = scene.build(time_step=1e-3, planar=False, integrator=integrator, adaptive=False, **TIGHT)
    simulation.set_velocities(rod, (1.0, 0.0, 0.0))
    start = balance(simulation)
    simulation.step(300)
    assert simulation.deflection(hand).slip @ (0, 0, 1) > 0.1
    e = simulation.energy()
    assert e.dissipated > 0.01
    assert balance(simulation) == pytest.approx(start, abs=1e-6)


@pytest.mark.parametrize("stiffness", [None, (40.0, 0.5)], ids=["rigid", "yielding"])
@pytest.mark.parametrize("integrator", ["static", "implicit_midpoint"])
def test_a_planar_scene_stays_planar_and_is_the_spatial_one(stiffness, integrator):
    answers = []
    for planar in (True, False):
        scene = withe.Scene(gravity=(0.0, 0.0, -2.0))
        rod = rods.straight(scene, 12, direction=(0.8, 0.0, 0.6), stiffness=rods.stiffness(stretch=1e4))
        hand = scene.grasp(rod, 0.4, 0.2, stiffness=stiffness)
        simulation = scene.build(integrator=integrator, time_step=5e-3, planar=planar, **TIGHT)
        at, axes = simulation.pose(hand)
        simulation.move(hand, np.add(at, (0.1, 0.0, 0.1)), rods.rotation((0, 1, 0), 0.4) @ axes, over=0.05)
        simulation.step(15)
        assert simulation.plan.planar == planar
        wrench = simulation.wrench(hand)
        answers.append((simulation.positions(rod), simulation.directors(rod), wrench.force, wrench.moment))
    for flat, spatial in zip(*answers, strict=True):
        np.testing.assert_allclose(flat, spatial, atol=1e-9 if integrator != "static" else 1e-8)


@pytest.mark.parametrize("stiffness", [None, (40.0, 60.0, 50.0, 0.5, 0.3, 0.4)], ids=["rigid", "yielding"])
def test_a_turned_scene_gives_the_turned_answer(stiffness):
    answers = []
    for turn in (np.eye(3), rods.rotation((0.3, -0.8, 0.5), 2.1)):
        scene = withe.Scene(gravity=turn @ (0.0, 0.0, -2.0))
        s = np.linspace(0.0, 1.0, 13)
        points = np.stack([s, 0.1 * s**2, 0.05 * np.sin(4.0 * s)], axis=1) @ turn.T
        rod = scene.add_rod(points=points, normal=turn @ (0, 0, 1), stiffness=SOFT, line_density=1.0, radius=0.02)
        hand = scene.grasp(rod, 0.4, 0.2, stiffness=stiffness)
        simulation = scene.build(time_step=5e-3, planar=False, **TIGHT)
        at, axes = simulation.pose(hand)
        move = turn @ rods.rotation((0.2, 1, 0.3), 0.4) @ turn.T
        simulation.move(hand, at + turn @ (0.1, 0.05, 0.1), move @ axes, over=0.05)
        simulation.step(20)
        wrench = simulation.wrench(hand)
        answers.append((simulation.positions(rod) @ turn, wrench.force @ turn, wrench.moment @ turn))
    for here, there in zip(*answers, strict=True):
        np.testing.assert_allclose(there, here, atol=1e-9)


def test_two_hands_on_neighbouring_edges_hold_each_its_own_and_hand_over_the_node_between_them():
    simulation, rod = rope(edges=10, weight=1.0)
    first, second = simulation.grasp(rod, 0.45), simulation.grasp(rod, 0.55)
    third = simulation.grasp(rod, 0.3, stiffness=(50.0, 1.0))
    for hand, way in ((first, (0.0, 0.0, 0.05)), (second, (0.0, 0.0, 0.03))):
        hand.move(np.add(hand.pose.position, way), over=0.1)
    simulation.step(120)
    x = simulation.positions(rod)
    first.release()
    np.testing.assert_array_equal(simulation.positions(rod), x)
    simulation.step(10)
    np.testing.assert_allclose(simulation.positions(rod)[5:7], x[5:7], atol=1e-12)  # the second holds both now
    third.release()
    second.release()
    simulation.step(10)
    assert np.abs(simulation.positions(rod)[5:7] - x[5:7]).max() > 1e-3
