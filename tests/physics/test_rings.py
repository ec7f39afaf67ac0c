"""Rings: rods slide through them; friction and drives act along the rod, and whatever they do is booked."""

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

import rods
import withe
from cases import measured
from convergence import assert_order

TIGHT = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13)}


def balance(simulation):
    e = simulation.energy()
    return e.total - e.work + e.dissipated


def catenary(span, length, weight):
    """Tension at the ends of a cable between two points at one height."""
    c = brentq(lambda c: 2.0 * c * np.sinh(span / (2.0 * c)) - length, span / 20.0, 100.0 * span)
    return weight * c * np.cosh(span / (2.0 * c))


def cable(edges=200, **build):
    """A cable of unit length and weight, pinned at both ends, in a ring at 0.4 of it."""
    scene = withe.Scene(gravity=(0.0, 0.0, -1.0))
    rod = rods.straight(scene, edges, stiffness=rods.stiffness(bend=1e-4, twist=1e-4, stretch=1e4))
    scene.pin(rod.start)
    scene.pin(rod.end)
    ring = scene.grasp(rod, 0.4, slides=True)
    return rods.sharp(scene, **build), rod, ring


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_a_heavy_cable_slides_through_a_ring_until_it_pulls_alike_on_both_sides(planar):
    simulation, rod, ring = cable(planar=planar)
    for part in np.linspace(0.2, 1.0, 5):
        simulation.move(ring, (0.4 + 0.06 * part, 0.0, 0.0))
        simulation.move(rod.end, (1.0 - 0.08 * part, 0.0, 0.0))
        assert simulation.equilibrium().stable
    passage = simulation.passage(ring)
    assert passage.at == pytest.approx(0.5, abs=1e-9)
    assert passage.pull == 0.0
    assert passage.press == pytest.approx(0.5, rel=0.05)  # and a little more, since the cable is not quite limp
    carried = sum(simulation.reaction(end).force[2] for end in (rod.start, rod.end))
    assert carried + passage.press == pytest.approx(1.0, abs=1e-9)
    assert simulation.wrench(ring).force == pytest.approx((0.0, 0.0, passage.press), abs=1e-9)
    simulation.move(rod.end, (0.9, 0.0, 0.0))
    simulation.equilibrium()

    def pull(at):
        return catenary(0.46, at, 1.0) - catenary(0.44, 1.0 - at, 1.0)

    assert simulation.passage(ring).at == pytest.approx(brentq(pull, 0.48, 0.55), abs=1.5e-3)


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_one_move_leads_where_many_small_ones_do(planar):
    """Over some twenty edges that go through the ring, while the cable becomes slack."""
    ends = []
    for parts in (1, 2, 20):
        simulation, rod, ring = cable(planar=planar)
        simulation.equilibrium()
        for part in np.arange(1, parts + 1) / parts:
            simulation.move(ring, (0.4 + 0.06 * part, 0.0, 0.0))
            simulation.move(rod.end, (1.0 - 0.08 * part, 0.0, 0.0))
            found = simulation.equilibrium()
            assert found.stable
            assert not found.branch_changed
            assert found.iterations < 400
        ends.append(simulation.positions(rod))
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], atol=1e-9)


def overhang(edges):
    """Deflection of the end of a light rod that lies in two rings and is loaded at its end, over that of beams."""
    scene = rods.weightless()
    rod = rods.straight(scene, edges)
    scene.grasp(rod, 0.513, slides=True)
    scene.grasp(rod, 0.806, slides=True, feed_rate=0.0)
    load = 1e-5
    scene.add_force(rod.end, (0.0, 0.0, load))
    simulation = rods.sharp(scene)
    simulation.equilibrium()
    a, b = 1.0 - 0.806, 0.806 - 0.513
    return simulation.positions(rod)[-1, 2] / (load * a**2 * (a + b) / 3.0)


@pytest.mark.case("statics", "Overhang of a rod in two rings", source="beam on two supports")
def test_a_rod_in_two_rings_is_a_beam_on_two_supports():
    errors = [overhang(edges) - 1.0 for edges in (20, 40, 80, 160)]
    measured(errors[-1])
    assert_order(errors, 2.0)
    assert abs(errors[-1]) < 2e-4


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
def test_a_rod_that_is_fed_hangs_longer_by_what_was_fed(planar):
    scene = withe.Scene(gravity=(0.0, 0.0, -1.0))
    rod = rods.straight(scene, 40, direction=(0.0, 0.0, -1.0), stiffness=rods.stiffness(stretch=1e7))
    drive = scene.grasp(rod, 0.63, slides=True, feed_rate=0.2)
    scene.grasp(rod, 0.71, slides=True)
    simulation = rods.sharp(scene, time_step=0.1, planar=planar)
    for _ in range(5):
        simulation.step()
        fed = 0.2 * simulation.time
        assert simulation.positions(rod)[-1, 2] == pytest.approx(-1.0 - fed, abs=1e-6)
        assert simulation.passage(drive) == pytest.approx((0.63 - fed, 1.0, 0.0, 0.2), abs=1e-6)
    simulation.feed(drive, 0.0)
    simulation.step(3)
    assert simulation.passage(drive).at == pytest.approx(0.53, abs=1e-7)
    simulation.feed(drive, -0.1)
    simulation.step(2)
    assert simulation.passage(drive).at == pytest.approx(0.55, abs=1e-7)


def test_a_cantilever_that_is_fed_swings_as_slowly_as_it_is_long():
    """With as much of it between two rings as beyond: as with pins at the nodes that it then has there."""

    def slowest(simulation):
        return simulation.linearise().frequencies(1)[0]

    def pinned(at):
        scene = rods.weightless()
        rod = rods.straight(scene, 100)
        for node in (at, at - 20):
            scene.pin(rod.node(node))
        return slowest(rods.sharp(scene, planar=True))

    scene = rods.weightless()
    rod = rods.straight(scene, 100)
    drive = scene.grasp(rod, 0.7, slides=True, feed_rate=0.1)
    scene.grasp(rod, 0.5, slides=True)
    simulation = rods.sharp(scene, time_step=1.0, planar=True)
    assert slowest(simulation) == pytest.approx(pinned(70), rel=1e-3)
    simulation.step()
    assert simulation.passage(drive).at == pytest.approx(0.6, abs=1e-9)
    assert slowest(simulation) == pytest.approx(pinned(60), rel=1e-3)


def bent(friction, edges=120):
    """A light rod over two rings that do not rub, and under one between them that is pushed down."""
    scene = rods.weightless()
    rod = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e6), normal=(0.0, 0.0, 1.0))
    outer = [scene.grasp(rod, at, slides=True) for at in (0.33, 0.67)]
    middle = scene.grasp(rod, 0.5, slides=True, friction=friction, name="middle")
    return scene, rod, outer, middle


@pytest.mark.case("statics", "Forces of three rings that bend a rod", source="beam on three supports")
def test_three_rings_bend_a_rod_as_a_beam():
    scene, rod, outer, middle = bent(0.0)
    scene.pin(rod.end, free=(0, 0, 1))
    simulation = rods.sharp(scene, planar=True)
    simulation.move(middle, (0.5, 0.0, -0.005))
    simulation.equilibrium()
    press = 48.0 * 0.005 / 0.34**3
    assert simulation.passage(middle).press == pytest.approx(press, rel=5e-3)
    assert [simulation.passage(ring).press for ring in outer] == pytest.approx([0.5 * press] * 2, rel=5e-3)


@pytest.mark.case("contact", "Pull through a ring with friction", source="mu N")
def test_a_rod_is_drawn_through_a_ring_by_friction_times_what_presses():
    scene, rod, _, middle = bent(0.3)
    end = scene.pin(rod.end, free=(0, 0, 1))
    simulation = rods.sharp(scene, time_step=0.1, planar=True)
    simulation.move(middle, (0.5, 0.0, -0.005))
    simulation.equilibrium()
    assert abs(simulation.passage(middle).pull) < (0.3 + 1e-9) * simulation.passage(middle).press
    for way in (0.01, 0.03, 0.06):
        simulation.move(end, (1.0 + way, 0.0, 0.0))
        simulation.equilibrium()
        passage = simulation.passage(middle)
        measured(passage.pull / (0.3 * passage.press) - 1.0)
        assert passage.pull == pytest.approx(0.3 * passage.press, rel=1e-8)
        assert passage.at == pytest.approx(0.5 - way, abs=2e-3)
        assert simulation.reaction(end).force[0] == pytest.approx(passage.pull, rel=2e-3)


@pytest.mark.case("contact", "Distance in which a ring stops a rod", source="m v^2 / (2 mu N)")
def test_friction_stops_a_rod_that_slides():
    scene, rod, _, middle = bent(0.2)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3, planar=True)
    simulation.move(middle, (0.5, 0.0, -0.005), over=0.5)
    simulation.run(2.0)
    simulation.set_velocities(rod, (0.5, 0.0, 0.0))
    at, press = simulation.passage(middle).at, simulation.passage(middle).press
    simulation.run(1.0 / (0.2 * press))
    assert at - simulation.passage(middle).at == pytest.approx(0.125 / (0.2 * press), rel=0.02)
    assert abs(simulation.momentum().linear[0]) < 1e-3


def swinging(integrator, time_step, friction=0.0, feed_rate=None, limit=None, planar=False, edges=16):
    """A rod that falls and turns about a ring that goes to and fro, sliding over several edges."""
    scene = withe.Scene(gravity=(0.0, 0.0, -3.0))
    s = np.linspace(0.0, 1.0, edges + 1)
    points = np.stack([s, 0.0 * s if planar else 0.1 * s**2, 0.1 * np.sin(3.0 * s)], axis=1)
    rod = scene.add_rod(points=points, stiffness=rods.stiffness(bend=0.05, twist=0.05, stretch=60.0), line_density=1.0,
                        radius=0.02)  # fmt: skip
    ring = scene.grasp(rod, 0.43, slides=True, stiffness=400.0, friction=friction, feed_rate=feed_rate,
                       force_limit=limit)  # fmt: skip
    simulation = scene.build(integrator=integrator, time_step=time_step, adaptive=False, planar=planar, **TIGHT)
    simulation.set_velocities(rod, (0.5, 0.0, 0.0))
    place = simulation.pose(ring).position
    sideways = np.array([0.0, 0.0 if planar else 0.5, 1.0])
    simulation.move(ring, path=lambda t: place + 0.05 * np.sin(12.0 * t) * sideways)
    return simulation, rod, ring


ALONG = [
    pytest.param({}, id="frictionless"),
    pytest.param({"friction": 0.3}, id="friction"),
    pytest.param({"feed_rate": 0.5}, id="drive"),
    pytest.param({"feed_rate": 0.5, "limit": 0.8}, id="slipping drive"),
]


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("along", ALONG)
def test_energy_momentum_steps_balance_what_rings_do_store_and_take(along, planar):
    simulation, _, ring = swinging("energy_momentum", 2e-3, planar=planar, **along)
    start, at = balance(simulation), []
    for _ in range(200):
        simulation.step()
        at.append(simulation.passage(ring).at)
        e = simulation.energy()
        assert balance(simulation) == pytest.approx(start, abs=1e-9 * (e.kinetic + e.bend + e.spring + 1.0))
    assert np.ptp(at) > 0.1
    assert abs(simulation.energy().work) > 1e-3
    assert (simulation.energy().dissipated > 1e-3) == ("friction" in along or "limit" in along)


@pytest.mark.parametrize("along", ALONG[:3:2])
def test_midpoint_steps_balance_it_at_second_order(along):
    def error(step):
        simulation, _, _ = swinging("implicit_midpoint", step, **along)
        start = balance(simulation)
        simulation.step(round(0.2 / step))
        return abs(balance(simulation) - start)

    assert_order([error(step) for step in (1e-3, 5e-4, 2.5e-4)], 2.0, slack=0.4)


@pytest.mark.parametrize("along", ALONG)
def test_momenta_grow_by_the_wrench(along):
    simulation, rod, ring = swinging("implicit_midpoint", 1e-3, **along)
    total = 0.0
    lengths = np.linalg.norm(np.diff(simulation.positions(rod), axis=0), axis=1)
    node = 0.5 * (np.append(lengths, 0.0) + np.append(0.0, lengths))
    weight = node[:, None] * np.array([0.0, 0.0, -3.0])
    for _ in range(20):
        before, x, t = simulation.momentum(), simulation.positions(rod), simulation.time
        simulation.step()
        after, dt = simulation.momentum(), simulation.time - t
        wrench = simulation.wrench(ring, about=(0.0, 0.0, 0.0))
        total += np.linalg.norm(wrench.force)
        middle = 0.5 * (x + simulation.positions(rod))
        np.testing.assert_allclose(after.linear - before.linear, dt * (wrench.force + weight.sum(axis=0)), atol=1e-11)
        turned = wrench.moment + np.cross(middle, weight).sum(axis=0)
        np.testing.assert_allclose(after.angular - before.angular, dt * turned, atol=1e-10)
    assert total > 1.0


@pytest.mark.parametrize("along", ALONG)
def test_a_turned_scene_gives_the_turned_answer(along):
    turn, answers = rods.rotation((0.2, -1.0, 0.7), 1.1), []
    for R in (np.eye(3), turn):
        scene = withe.Scene(gravity=R @ (0.0, 0.0, -3.0))
        s = np.linspace(0.0, 1.0, 17)
        points = np.stack([s, 0.1 * s**2, 0.1 * np.sin(3.0 * s)], axis=1) @ R.T
        rod = scene.add_rod(points=points, stiffness=rods.stiffness(bend=0.05, twist=0.05, stretch=60.0),
                            line_density=1.0, radius=0.02, normal=R @ (0.0, 1.0, 0.0))  # fmt: skip
        words = {key: value for key, value in along.items() if key != "limit"}
        ring = scene.grasp(rod, 0.43, slides=True, stiffness=400.0, force_limit=along.get("limit"), **words)
        simulation = scene.build(time_step=2e-3, planar=False, **TIGHT)
        simulation.move(ring, simulation.pose(ring).position + R @ (0.02, 0.1, 0.1), over=0.1)
        simulation.step(100)
        answers.append((simulation.positions(rod) @ R, simulation.wrench(ring).force @ R, simulation.passage(ring).at))
    for one, other in zip(*answers, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-8)


def test_a_rod_flies_through_a_ring_leaves_it_and_says_so():
    scene = rods.weightless()
    rod = rods.straight(scene, 20, stiffness=rods.stiffness(stretch=1e3))
    simulation = scene.build(time_step=1e-2, planar=False)
    ring = simulation.grasp(rod, 0.3, slides=True, name="eye")
    simulation.set_velocities(rod, (1.0, 0.0, 0.0))
    start = simulation.energy().total
    for _ in range(20):
        simulation.step()
        assert simulation.passage(ring).at == pytest.approx(0.3 - simulation.time, abs=1e-12)
        assert simulation.passage(ring).press < 1e-9
    with pytest.warns(withe.RingLeftWarning, match="'eye'"):
        simulation.step(12)
    with pytest.raises(ValueError, match="'eye' is released"):
        ring.passage  # noqa: B018
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.step(10)
    assert simulation.positions(rod)[0, 0] == pytest.approx(simulation.time, abs=1e-12)
    assert balance(simulation) == pytest.approx(start, rel=1e-12)


def test_grasping_and_releasing_by_a_ring_changes_nothing():
    simulation, rod, ring = swinging("implicit_midpoint", 1e-3)
    simulation.step(20)
    x, start = simulation.positions(rod), balance(simulation)
    other = simulation.grasp(rod, 0.713, slides=True, friction=0.5)
    assert simulation.energy().spring == pytest.approx(0.5 * 400.0 * (simulation.passage(ring).press / 400.0) ** 2)
    np.testing.assert_array_equal(simulation.positions(rod), x)
    assert balance(simulation) == pytest.approx(start, abs=1e-13)
    simulation.step(20)
    start = balance(simulation)
    simulation.release(other)
    simulation.release(ring)
    assert simulation.energy().spring == 0.0
    assert balance(simulation) == pytest.approx(start, abs=1e-13)


def test_a_rod_through_an_eye_converges_as_its_mesh_and_step_are_refined():
    def end(edges, step):
        simulation, rod, ring = swinging("implicit_midpoint", step, edges=edges)
        simulation.step(round(0.16 / step))
        return np.append(simulation.positions(rod)[[0, -1]].ravel(), simulation.passage(ring).at)

    fine = [end(edges, step) for edges, step in ((16, 2e-3), (32, 1e-3), (64, 5e-4))]
    first, second = np.abs(fine[1] - fine[0]).max(), np.abs(fine[2] - fine[1]).max()
    assert second < 0.35 * first


@pytest.mark.parametrize("along", ALONG)
def test_a_rod_that_is_put_elsewhere_passes_its_rings_there(along):
    """Along itself by several edges, where a drive allows that, and across; nothing comes from nowhere then."""
    simulation, rod, ring = swinging("energy_momentum", 1e-3, **along)
    simulation.step(20)
    at, way = simulation.passage(ring).at, 1e-4 if along.get("feed_rate") and "limit" not in along else 0.15
    tangent = simulation.directors(rod)[7, 2]
    simulation.set_state(rod, positions=simulation.positions(rod) - way * tangent + (0.0, 0.0, 1e-3))
    assert simulation.passage(ring).at == pytest.approx(at + way, abs=0.1 * way + 5e-3)
    start = balance(simulation)
    simulation.step(20)
    assert balance(simulation) == pytest.approx(start, abs=1e-9 * (simulation.energy().kinetic + 1.0))


def test_a_closed_rod_goes_round_through_a_ring():
    scene = rods.weightless()
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    points = 0.2 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    rod = scene.add_rod(points=points, closed=True, stiffness=rods.stiffness(), line_density=1.0, radius=0.01)
    ring = scene.grasp(rod, 0.1, slides=True, feed_rate=1.0)
    simulation = scene.build(integrator="backward_euler", time_step=0.05)
    whole = np.linalg.norm(np.diff(points, axis=0, append=points[:1]), axis=1).sum()
    for _ in range(60):
        simulation.step()
        at = simulation.passage(ring).at
        assert 0.0 <= at < whole
        assert (at - 0.1 + simulation.time + 0.5 * whole) % whole == pytest.approx(0.5 * whole, abs=0.02)


def test_a_rod_that_is_put_beyond_a_ring_has_left_it():
    scene = rods.weightless()
    rod = rods.straight(scene, 20, stiffness=rods.stiffness(stretch=1e3))
    scene.grasp(rod, 0.1, slides=True, name="eye")
    simulation = scene.build(time_step=1e-2)
    simulation.set_state(rod, positions=simulation.positions(rod) + np.array([0.2, 0.0, 0.0]))
    with pytest.warns(withe.RingLeftWarning, match="'eye'"):
        simulation.step()
    assert np.abs(simulation.velocities(rod)).max() < 1e-12
