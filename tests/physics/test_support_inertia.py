"""Inertia of edges at nodes that supports hold, and what a clamp that may spin holds."""

import numpy as np
import pytest

import withe

STEEL = {"radius": 5e-3, "material": withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)}


@pytest.mark.case("dynamics", "Period of a bar on a pin", source="2 pi sqrt(2 L / (3 g))")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "fourth_order"])
@pytest.mark.parametrize("support", ["pin", "stub", "revolute"])
@pytest.mark.parametrize("edges", [1, 3])
def test_a_bar_on_a_pin_swings_with_its_moment_of_inertia(integrator, support, edges):
    """m l^2 / 3 about the pin: a period of 2 pi sqrt(2 l / 3 g)."""
    scene = withe.Scene()
    angle = 0.01
    tip = (np.sin(angle), 0, -np.cos(angle))
    bar = scene.add_rod(start=(0, 0, 0), end=tip, nodes=edges + 1, **STEEL)
    if support == "pin":
        scene.pin(bar.start)
    elif support == "stub":
        stub = scene.add_rod(start=(0, 0, 1e-3), end=(0, 0, 0), nodes=2, **STEEL)
        scene.clamp(stub.start)
        scene.join(stub.end, bar.start, "pinned")
    else:
        # Short, for on a long one the bar bounces faster than steps of 2 ms see.
        wall = scene.add_rod(start=(0, -0.02, 0), end=(0, 0, 0), nodes=3, **STEEL)
        scene.clamp(wall.start)
        scene.join(wall.end, bar.start, "revolute", axis=(0, 1, 0))
    simulation = scene.build(time_step=2e-3, integrator=integrator)
    period = 2 * np.pi * np.sqrt(2 / 3 / 9.81)
    simulation.run(0.25 * period, progress=False)  # through the lowest point
    x, v = simulation.positions(bar)[-1, 0], simulation.velocities(bar)[-1, 0]
    assert 0.25 * period - x / v == pytest.approx(0.25 * period, rel=2e-4)


@pytest.mark.parametrize("planar", [True, False])
def test_a_support_that_moves_books_its_work_to_the_last_digit(planar):
    """A pin of a stiff bar with few edges is shaken: its work equals the energy of the bar."""
    scene = withe.Scene()
    bar = scene.add_rod(
        start=(0, 0, 0),
        end=(0.3, 0, -1),
        nodes=3,
        radius=2e-2,
        material=withe.Material(youngs_modulus=1e7, density=1e3),
    )
    hand = scene.pin(bar.start)
    simulation = scene.build(
        time_step=2e-3,
        integrator="energy_momentum",
        planar=planar,
        solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
    )
    simulation.move(hand, path=lambda t: (0.1 * np.sin(9.0 * t) ** 2, 0.0, 0.05 * np.sin(7.0 * t) ** 2))
    first = simulation.energy()
    given = 0.0
    for _ in range(300):
        before = simulation.positions(bar)[0]
        simulation.step()
        given += simulation.reaction(hand).force @ (simulation.positions(bar)[0] - before)
        now = simulation.energy()
        assert now.total - now.work == pytest.approx(first.total - first.work, abs=1e-7)
    # The force over the way, too, to what a velocity at the end of a step differs from that over it.
    assert given == pytest.approx(now.work, abs=1e-3 * now.kinetic)


@pytest.mark.case("dynamics", "Free end of a bar whose other end is jerked", source="-v / 2, centre of percussion")
def test_the_free_end_of_a_bar_falls_behind_where_its_other_end_is_jerked():
    """A bar whose end is given a velocity turns about a point a third of its length from the other: -1/2 there."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bar = scene.add_rod(start=(0, 0, 0), end=(0, 0, 1), nodes=2, **STEEL)
    hand = scene.pin(bar.start)
    simulation = scene.build(time_step=1e-4)
    simulation.move(hand, position=(1e-3, 0, 0), over=1e-2)
    simulation.step(3)
    assert simulation.velocities(bar)[1, 0] == pytest.approx(-0.05, rel=1e-3)


@pytest.mark.case("dynamics", "Work of a support that starts at full speed", source="m v^2 / 2")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_support_that_starts_at_full_speed_works_with_half_of_it(integrator, planar):
    """An impulse m v from rest to v does the work m v^2 / 2, though the support goes on at v through the whole step."""
    scene = withe.Scene(gravity=(0, 0, 0))
    light = withe.Material(youngs_modulus=1e4, poisson_ratio=0.5, density=1.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0.1), nodes=6, radius=2e-3, material=light, normal=(0, 0, 1))
    hand = scene.pin(rod.start)
    heavy, speed, step = 2.0, 0.3, 1e-3
    scene.add_mass(rod.start, heavy)
    simulation = scene.build(integrator=integrator, time_step=step, planar=planar)
    simulation.move(hand, path=lambda t: (speed * t, 0, 0))
    simulation.step()
    force = simulation.reaction(hand).force[0]
    assert force * step == pytest.approx(heavy * speed, rel=1e-4)
    assert simulation.energy().work == pytest.approx(0.5 * heavy * speed**2, rel=1e-4)
    assert simulation.energy().kinetic == pytest.approx(simulation.energy().work, rel=1e-4)
    simulation.step()
    assert abs(simulation.reaction(hand).force[0]) < 1e-4 * force
    assert simulation.energy().work == pytest.approx(0.5 * heavy * speed**2, rel=1e-4)


@pytest.mark.parametrize("nodes", [11, 21])
@pytest.mark.parametrize("while_running", [False, True])
def test_a_shaft_turns_in_a_bearing_without_a_motion_of_its_line(nodes, while_running):
    """A naturally straight round shaft, bent into a quarter circle: it turns about its tangent at the bearing."""
    angle = np.linspace(0, np.pi / 2, 401)
    scene = withe.Scene(gravity=(0, 0, 0))
    shaft = scene.add_rod(
        points=0.3 * np.stack([np.sin(angle), 0 * angle, 1 - np.cos(angle)], 1),
        nodes=nodes,
        radius=3e-3,
        natural="straight",
        material=withe.Material(youngs_modulus=1e8, poisson_ratio=0.5, density=1200.0, viscosity=1e5),
    )
    motor = scene.clamp(shaft.start)
    bearing = scene.clamp(shaft.end, spin=not while_running)
    simulation = scene.build(integrator="static", time_step=0.1)
    if while_running:
        # The bearing is moved away from its drawn pose.
        simulation.move(bearing, tangent=(0.3, 0.0, 1.0), over=0.5)
        simulation.step(6)
        simulation.release(bearing)
        simulation.clamp(shaft.end, spin=True)
    simulation.equilibrium()
    before, stored = simulation.positions(shaft), simulation.energy().bend
    simulation.move(motor, roll=np.pi, over=2.0)
    simulation.step(21)
    assert np.abs(simulation.positions(shaft) - before).max() < 2e-6
    assert simulation.energy().bend == pytest.approx(stored, rel=1e-5)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("planar", [True, False])
def test_reactions_of_a_held_edge_do_the_work_that_is_booked(integrator, planar):
    """Its moment is about the node in the middle of a step: times 2 tan of half the turn it is the work of the step."""
    along = np.linspace(0, 0.3, 21)
    apart = []
    for step in (4e-3, 2e-3):
        scene = withe.Scene(gravity=(0, 0, 0))
        rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
        arm = scene.add_rod(points=np.stack([along, along**2, 0 * along], 1), radius=5e-3, material=rubber)
        wall = scene.clamp(arm.start, hold="edge")
        simulation = scene.build(integrator=integrator, time_step=step, planar=planar)

        def turn(t):
            return 20 * t**3 / (1 + t)

        def way(t):
            c, s = np.cos(turn(t)), np.sin(turn(t))
            return (0.02 * t * t, 0, 0), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

        simulation.move(wall, path=way)
        work = 0.0
        while simulation.time < 0.4 - 1e-9:
            before = simulation.time
            simulation.step()
            turned = 2 * np.tan(0.5 * (turn(simulation.time) - turn(before)))
            held = simulation.reaction(wall)
            work += held.moment[2] * turned + held.force[0] * 0.02 * (simulation.time**2 - before**2)
        apart.append(work / simulation.energy().work - 1)
    assert abs(apart[0]) < 2e-6
    assert apart[0] / apart[1] == pytest.approx(4, rel=0.2)


@pytest.mark.case("dynamics", "Moment that spins up a shaft", source="J dw/dt")
@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("nodes", [5, 21])
def test_a_shaft_that_is_spun_up_asks_for_its_own_inertia(nodes, hold):
    """Edges do not count the rotary inertia that frames carry for them."""
    scene = withe.Scene(gravity=(0, 0, 0))
    stiff = withe.Material(youngs_modulus=1e8, density=1000.0, viscosity=1e5)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=0.01, material=stiff)
    wall = scene.clamp(rod.start, hold=hold)
    simulation = scene.build(time_step=1e-3)
    rate, inertia = 20.0, 0.5 * 1000.0 * np.pi * 1e-4 * 0.2 * 1e-4

    def turned(t):
        c, s = np.cos(0.5 * rate * t * t), np.sin(0.5 * rate * t * t)
        return (0.0, 0.0, 0.0), ((1, 0, 0), (0, c, -s), (0, s, c))

    simulation.move(wall, path=turned)
    simulation.step(500)
    moments = []
    for _ in range(500):
        simulation.step()
        moments.append(simulation.reaction(wall).moment[0])
    assert np.mean(moments) == pytest.approx(inertia * rate, rel=1e-4)
    assert simulation.momentum().angular[0] == pytest.approx(inertia * rate * simulation.time, rel=1e-4)


@pytest.mark.parametrize("kind", ["rigid", "revolute"])
def test_joined_shafts_have_the_inertia_of_one(kind):
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    parts = [
        scene.add_rod(start=(x, 0, 0), end=(x + 0.1, 0, 0), nodes=3, radius=0.01, material=rubber) for x in (0.0, 0.1)
    ]
    if kind == "rigid":
        scene.join(parts[0].end, parts[1].start, "rigid", form="frame")
    else:
        scene.join(parts[0].end, parts[1].start, "revolute", axis=(0, 1, 0))
    simulation = scene.build()
    for part in parts:
        simulation.set_state(part, spins=10.0)
    inertia = 0.5 * 1000.0 * np.pi * 1e-4 * 0.2 * 1e-4
    assert simulation.momentum().angular[0] == pytest.approx(10.0 * inertia, rel=1e-12)
    assert simulation.energy().kinetic == pytest.approx(50.0 * inertia, rel=1e-12)


@pytest.mark.parametrize("nodes", [5, 41])
@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "fourth_order"])
def test_a_shaft_that_its_clamp_spins_fast_turns_as_fast(integrator, hold, nodes):
    """1.5 rad a step: the middle of a frame's turn is not that of an edge's, which twisted what is between."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=0.01, material=rubber)
    wall = scene.clamp(rod.start, hold=hold)
    simulation = scene.build(integrator=integrator, time_step=5e-3)

    def turned(t):  # from rest to 300 rad/s within 0.2 s
        angle = 300.0 * (t - 0.1 if t > 0.2 else 2.5 * t * t)
        c, s = np.cos(angle), np.sin(angle)
        return (0.0, 0.0, 0.0), ((1, 0, 0), (0, c, -s), (0, s, c))

    simulation.move(wall, path=turned)
    simulation.step(100)
    assert simulation.spins(rod) == pytest.approx(300.0, rel=0.08)
    energy = simulation.energy()
    assert energy.total - energy.work == pytest.approx(0.0, abs=3e-3 * energy.kinetic)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("word", ["roll", "tangent and roll"])
def test_a_clamp_turns_at_once_evenly_within_a_time_step(integrator, hold, word):
    """However the step is cut: in its first part alone it would do many times the work."""
    works = []
    for over in (0.0, 5e-3):
        scene = withe.Scene(gravity=(0, 0, 0))
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=100.0)
        rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=5e-3, material=rubber)
        wall = scene.clamp(rod.start, hold=hold)
        simulation = scene.build(integrator=integrator, time_step=5e-3, planar=False)
        where = {"tangent": (1.0, 0.01, 0.0)} if word != "roll" else {}
        simulation.move(wall, roll=1.0, over=over, **where)
        simulation.step()
        works.append(simulation.energy().work)
        after = simulation.get(wall, "rotation")
        simulation.step(3)
        np.testing.assert_allclose(simulation.get(wall, "rotation"), after, atol=1e-12)
    assert works[0] == pytest.approx(works[1], rel=0.02)


def test_a_roll_that_is_led_on_at_once_before_every_step_counts_full_turns():
    spins = []
    for at_once in (True, False):
        scene = withe.Scene(gravity=(0, 0, 0))
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=100.0)
        rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=rubber)
        wall = scene.clamp(rod.start)
        simulation = scene.build(time_step=5e-3, planar=False)
        if not at_once:
            simulation.move(wall, roll=9.0, over=0.15)
        for k in range(1, 31):
            if at_once:
                simulation.move(wall, roll=0.3 * k)
            simulation.step()
        c, s = np.cos(9.0), np.sin(9.0)
        np.testing.assert_allclose(simulation.get(wall, "rotation"), [(1, 0, 0), (0, c, -s), (0, s, c)], atol=1e-9)
        spins.append(simulation.spins(rod))
    np.testing.assert_allclose(spins[0], spins[1], rtol=1e-6)
