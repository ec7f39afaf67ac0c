"""Loads on a simulation: constant, functions of time, follower, custom."""

import pickle

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, weightless


def test_a_load_may_be_a_function_of_time():
    scene, arm, _ = cantilever()
    times = []

    def force(t):
        times.append(t)
        return (0, 0, 0.05 * np.sin(20 * t))

    load = scene.add_force(arm.end, force)
    simulation = scene.build(integrator="backward_euler", time_step=0.01, adaptive=False)
    times.clear()
    simulation.step(3)
    assert times == pytest.approx([0.01, 0.02, 0.03])
    assert simulation.get(load, "force")[2] == pytest.approx(0.05 * np.sin(0.6))
    simulation.set(load, force=(0, 0, 0.01))
    simulation.step(1)
    assert np.array_equal(simulation.get(load, "force"), (0, 0, 0.01))


def test_midpoint_steps_take_loads_at_the_midpoint():
    scene, arm, _ = cantilever()
    times = []
    scene.add_force(arm.end, lambda t: times.append(t) or (0, 0, 0))
    simulation = scene.build(time_step=0.01)
    times.clear()
    simulation.step(2)
    assert times == pytest.approx([0.005, 0.015])


def test_equilibrium_takes_loads_at_the_present_time():
    scene, arm, _ = cantilever()
    scene.add_force(arm.end, lambda t: (0, 0, 0.1 + t))
    simulation = scene.build(integrator="static", time_step=0.5)
    simulation.equilibrium()
    mass = simulation.get(arm, "line_density")[0] * 0.2
    assert simulation.reaction("wall").force[2] == pytest.approx(9.81 * mass - 0.1)
    simulation.step()
    assert simulation.reaction("wall").force[2] == pytest.approx(9.81 * mass - 0.6)


def test_a_constant_load_and_a_constant_function_are_the_same():
    ends = []
    for force in [(0, 0.01, 0.1), lambda t: (0, 0.01, 0.1)]:
        scene, arm, _ = cantilever()
        scene.add_force(arm.end, force)
        simulation = scene.build(planar=False)
        simulation.step(20)
        ends.append(simulation.positions())
    assert np.allclose(*ends, atol=1e-12)


@pytest.mark.parametrize("planar", [True, False])
def test_follower_forces_turn_with_their_edge(planar):
    scene, arm, _ = weightless()
    scene.add_force(arm.end, (0, 0, 0.05), follower=True)
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    tangent = simulation.directors(arm)[-1, 2]
    force = -simulation.reaction("wall").force
    assert np.linalg.norm(force) == pytest.approx(0.05, rel=1e-6)
    assert force @ tangent == pytest.approx(0, abs=1e-8)


def test_a_moment_bends_into_an_arc():
    scene, arm, _ = weightless()
    scene.add_moment(arm.end, (0, -1e-3, 0))
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    stiffness = simulation.get(arm, "bend_stiffness")[0, 0]
    assert np.allclose(np.linalg.norm(simulation.curvatures(arm), axis=1), 1e-3 / stiffness, rtol=1e-3)
    assert np.allclose(simulation.reaction("wall").moment, (0, 1e-3, 0), atol=1e-10)


def test_a_distributed_load_can_carry_the_weight():
    scene, arm, _ = cantilever()
    scene.add_load(arm, (0, 0, 9.81 * 1000 * np.pi * 25e-6))
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    assert np.allclose(simulation.positions(arm)[:, 2], 0, atol=1e-10)


def test_custom_forces_add_up_and_see_the_state():
    scene, _arm, _ = weightless()
    seen = []

    def push(time, positions, velocities):
        seen.append((time, positions.copy(), velocities.copy()))
        force = np.zeros_like(positions)
        force[-1, 2] = 0.005
        positions[:] = np.nan  # a copy: no harm
        return force

    scene.add_custom_force(push)
    scene.add_custom_force(push)
    simulation = scene.build(integrator="static")
    simulation.step(1)
    assert seen[0][0] == simulation.time  # the end of a static step is where its forces act
    assert seen[0][1].shape == seen[0][2].shape == (21, 3)
    assert simulation.reaction("wall").force == pytest.approx((0, 0, -0.01), abs=1e-9)


@pytest.mark.parametrize("force", [lambda t, x, v: np.zeros(3), lambda t, x, v: x * np.nan, lambda t, x, v: None])
def test_a_custom_force_of_the_wrong_kind_is_named(force):
    scene, _arm, _ = weightless()
    scene.add_custom_force(force, name="wind")
    simulation = scene.build()
    before = simulation.positions()
    with pytest.raises(ValueError, match="custom force 'wind' must"):
        simulation.step()
    assert np.array_equal(simulation.positions(), before)


def test_an_exception_in_a_function_of_time_propagates_and_the_simulation_lives_on():
    scene, arm, _ = cantilever()
    scene.add_force(arm.end, lambda t: (0, 0, 1 / (0.0 if t > 0.02 else 1.0)))
    simulation = scene.build()
    with pytest.raises(ZeroDivisionError):
        simulation.step(10)
    assert simulation.time == pytest.approx(0.02)
    simulation.set("force 1", force=(0, 0, 0))
    simulation.step(2)
    assert simulation.time == pytest.approx(0.03)


def test_a_callback_may_read_but_not_step():
    scene, arm, _ = cantilever()
    outcome = []

    def force(t):
        if "simulation" in globals_:
            s = globals_["simulation"]
            outcome.append(s.positions(arm).shape)
            for act in (s.step, s.equilibrium, s.reset, lambda: s.release("wall"), lambda: s.set(gravity=(0, 0, 0))):
                with pytest.raises(RuntimeError, match="in the middle of a step"):
                    act()
        return (0, 0, 0)

    globals_ = {}
    scene.add_force(arm.end, force)
    simulation = globals_["simulation"] = scene.build()
    simulation.step(2)
    assert outcome == [(11, 3)] * 2


@pytest.mark.parametrize("planar", [True, False])
def test_a_load_put_on_while_running_acts_as_one_of_the_scene(planar):
    """A force, a moment that follows, and a load along the rod: the same equilibrium, and the same steps."""
    ends = []
    for late in (False, True):
        scene, arm, _ = cantilever()
        simulation = None if not late else scene.build(planar=planar)
        target = scene if not late else simulation
        target.add_force(arm.end, (0.002, 0, 0.02), follower=True)
        target.add_moment(arm.node(5), (0, 1e-4, 0), follower=True)
        target.add_load(arm, (0, 0, 0.05))
        simulation = simulation or scene.build(planar=planar)
        assert simulation.plan.planar is planar
        simulation.step(10)
        simulation.equilibrium()
        ends.append(simulation.positions())
    assert np.allclose(*ends, rtol=0, atol=1e-9)


def test_a_load_put_on_out_of_the_plane_makes_the_scene_three_dimensional():
    scene, arm, _ = cantilever()
    simulation = scene.build()
    assert simulation.plan.planar
    simulation.add_force(arm.end, (0, 0.01, 0))
    assert not simulation.plan.planar
    simulation.step(5)
    assert simulation.positions(arm)[-1, 1] > 0
    held = scene.build(planar=True)
    with pytest.raises(ValueError, match="leaves the plane"):
        held.add_force(arm.end, (0, 0.01, 0), name="aside")
    held.add_force(arm.end, (0, 0, 0.01), name="aside")  # what was refused has left no trace


def growing_moment(t):
    return (0, 1e-4 * t, 0)


def test_loads_put_on_while_running_are_set_kept_in_snapshots_and_undone_by_reset(tmp_path):
    scene, arm, _ = cantilever()
    simulation = scene.build()
    fresh = simulation.snapshot()
    push = simulation.add_force(arm.end, (0, 0, 0.01), name="push")
    turn = simulation.add_moment(arm.end, growing_moment)
    simulation.step(3)
    simulation.set(push, force=(0.001, 0, 0.02))
    assert np.array_equal(simulation.get("push", "force"), (0.001, 0, 0.02))
    state = simulation.snapshot()
    copies = [simulation.copy(), pickle.loads(pickle.dumps(simulation)), scene.build()]
    copies[2].restore(state)
    simulation.step(3)
    for other in copies:
        other.step(3)
        assert other.snapshot() == simulation.snapshot()
        assert np.allclose(other.get(turn, "moment"), simulation.get(turn, "moment"))
    simulation.clamp(arm.end)  # equations are made anew, loads and all
    simulation.step()
    simulation.reset()
    assert simulation.snapshot() == fresh
    with pytest.raises(ValueError, match="not in the scene"):
        simulation.set(push, force=(0, 0, 0))
    from_file = withe.Snapshot.load(state.save(tmp_path / "state.npz"))
    with pytest.raises(ValueError, match="functions of time"):
        scene.build().restore(from_file)
    copies[2].restore(from_file)
    assert np.array_equal(copies[2].get("push", "force"), (0.001, 0, 0.02))


def test_a_torque_may_depend_on_the_state():
    """A torque against the spin, -c omega: omega decays as exp(-c t / I)."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(0, 0, 0), end=(0.01, 0, 0), nodes=3, radius=5e-3, material=RUBBER)
    simulation = scene.build(time_step=1e-3, planar=False, integrator="backward_euler")
    inertia = RUBBER.density * np.pi * 5e-3**4 / 2 * 0.01
    rate = 5.0
    simulation.add_moment(rod.node(1), lambda t: (-rate * inertia * simulation.spins(rod).mean(), 0, 0))
    simulation.set_state(rod, spins=10.0)
    simulation.step(200)
    assert simulation.spins(rod).mean() == pytest.approx(10.0 * np.exp(-1.0), rel=5e-3)


def test_a_moment_that_follows_stays_about_the_tangent_of_its_edge():
    """A twisting moment at the tip of a quarter circle does not care which way the whole is turned."""
    scene, arm, _ = weightless()
    found = []
    for natural in (0.0, np.pi / 2 / 0.2):
        simulation = scene.build(planar=False, integrator="static")
        simulation.set(arm, natural_curvature=(0.0, natural))
        simulation.equilibrium()
        simulation.add_moment(arm.end, (2e-4, 0, 0), follower=True)
        simulation.equilibrium()
        stiffness = simulation.get(arm, "twist_stiffness")[0]
        found.append(simulation.twists(arm)[-1] * stiffness)
    assert found[0] == pytest.approx(2e-4, rel=1e-9)
    assert found[1] == pytest.approx(2e-4, rel=2e-3)


def test_a_pressure_is_a_number_and_needs_a_normal_on_an_open_rod():
    scene, arm, _ = weightless()
    with pytest.raises(ValueError, match="must be given, because the rod is open"):
        scene.add_pressure(arm, 1.0)
    wind = scene.add_pressure(arm, 0.05, normal=(0, -1, 0))
    simulation = scene.build()
    assert simulation.get(wind, "pressure") == pytest.approx(0.05)
    simulation.equilibrium()
    assert simulation.positions(arm)[-1, 2] > 0.001  # normal x tangent is up
    simulation.set(wind, pressure=-0.05)
    simulation.equilibrium()
    assert simulation.positions(arm)[-1, 2] < -0.001
    with pytest.raises(ValueError, match="must be a number"):
        simulation.set(wind, pressure=(0, 0, 1))


@pytest.mark.parametrize("planar", [True, False])
def test_a_load_edge_by_edge_bends_as_beams_do(planar):
    """A load that grows from nothing at a wall to w at the end bends by 11 w L^4 / (120 EI) there [Roark]."""
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=81, radius=4e-3, material=material)
    scene.clamp(arm.start)
    middles = (np.arange(80) + 0.5) / 80
    load = scene.add_load(arm, 1e-4 * np.outer(middles, (0, 0, 1)))
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    stiffness = simulation.get(arm, "bend_stiffness")[0, 0]
    assert simulation.positions(arm)[-1, 2] == pytest.approx(11 * 1e-4 * 0.2**4 / (120 * stiffness), rel=1e-4)
    assert simulation.reaction(arm.start).force[2] == pytest.approx(-0.5e-4 * 0.2, rel=1e-9)
    assert np.array_equal(simulation.get(load, "load")[:, 2], 1e-4 * middles)
    simulation.set(load, load=(0, 0, 1e-4))  # of every edge
    simulation.equilibrium()
    assert simulation.positions(arm)[-1, 2] == pytest.approx(1e-4 * 0.2**4 / (8 * stiffness), rel=1e-4)


def test_pressure_edge_by_edge_balances_what_hangs_in_a_ring():
    """Water in a pipe: pressure that falls with height lifts by the weight of what the ring surrounds."""
    angle = np.linspace(0, 2 * np.pi, 65)[:-1]
    ring = 0.1 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1)
    middles = 0.5 * (ring + np.roll(ring, -1, 0))
    scene = withe.Scene(gravity=(0, 0, 0))
    steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7800.0)
    rod = scene.add_rod(points=ring, closed=True, radius=4e-3, material=steel)
    scene.clamp(rod.node(0))
    water = scene.add_pressure(rod, 0.5 - 2.0 * middles[:, 2])
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    x, z = ring[:, 0], ring[:, 2]
    area = 0.5 * abs(np.sum(x * np.roll(z, -1) - z * np.roll(x, -1)))
    assert simulation.reaction(rod.node(0)).force == pytest.approx(
        (0, 0, -2.0 * area), abs=2e-5 * area
    )  # steel gives by as much
    assert np.array_equal(simulation.get(water, "pressure"), 0.5 - 2.0 * middles[:, 2])


def test_loads_edge_by_edge_are_set_kept_and_refused_by_their_size(tmp_path):
    scene, arm, _ = cantilever()
    edges = len(arm.radii)
    even, rows = scene.add_load(arm, (0, 0, 0.1)), np.outer(np.linspace(0, 1, edges), (0.0, 0.0, 0.2))
    spread = scene.add_load(arm, lambda t: (1 + t) * rows)
    with pytest.raises(ValueError, match=r"must have shape \(3,\) or \(\d+, 3\)"):
        scene.add_load(arm, rows[1:])
    simulation = scene.build()
    simulation.add_load(arm, 2 * rows, name="gust")
    simulation.step(3)
    simulation.set(spread, load=-rows)
    with pytest.raises(ValueError, match=r"must have shape \(3,\)"):
        simulation.set(even, load=rows)
    state = simulation.snapshot()
    state.save(tmp_path / "s.npz")
    simulation.step(5)
    after = simulation.positions()
    simulation.remove("gust")
    simulation.restore(withe.Snapshot.load(tmp_path / "s.npz"))
    assert np.array_equal(simulation.get("gust", "load"), 2 * rows)
    assert np.array_equal(simulation.get(spread, "load"), -rows)
    simulation.step(5)
    assert np.array_equal(simulation.positions(), after)
    copy = simulation.copy()
    copy.step(2)
    simulation.step(2)
    assert np.array_equal(copy.positions(), simulation.positions())


def test_pressure_that_varies_may_stay_in_its_plane():
    scene, arm, _ = cantilever()
    scene.add_pressure(arm, lambda t: 0.1 * t, normal=(0, 1, 0))
    simulation = scene.build(planar=True)
    simulation.step(3)
    assert np.isfinite(simulation.positions()).all()
