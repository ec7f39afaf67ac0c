"""What may be changed while a simulation runs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from simple_scenes import RUBBER, cantilever, tripod


def weightless(planar=None, nodes=21, **build):
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start, name="wall")
    return scene, arm, scene.build(planar=planar, **build)


# Natural shape


@pytest.mark.parametrize(("component", "axis"), [(0, 1), (1, 2)])
def test_natural_curvature_bends_towards_its_director(component, axis):
    _, arm, simulation = weightless(integrator="static")
    assert np.allclose(simulation.directors(arm)[0, component], np.eye(3)[axis])
    kappa = np.zeros(2)
    kappa[component] = 2.0
    simulation.set_natural_curvature(arm, kappa)
    simulation.equilibrium()
    tip = simulation.positions(arm)[-1]
    expected = np.array([np.sin(0.4) / 2, 0, 0])
    expected[axis] = (1 - np.cos(0.4)) / 2
    assert np.allclose(tip, expected, atol=1e-5)
    assert np.allclose(simulation.curvatures(arm), kappa, atol=1e-8)
    assert simulation.energy().bend < 1e-15


def test_natural_curvature_is_ramped_over_time():
    _, arm, simulation = weightless(integrator="static", time_step=0.1)
    simulation.set_natural_curvature(arm, (0.0, 3.0), over=1.0)
    assert np.allclose(simulation.get(arm, "natural_curvature"), 0)
    simulation.step(5)
    assert np.allclose(simulation.get(arm, "natural_curvature"), (0, 1.5))
    assert np.allclose(simulation.curvatures(arm), (0, 1.5), atol=1e-7)
    simulation.step(20)
    assert np.allclose(simulation.get(arm, "natural_curvature"), (0, 3))


def test_discrete_natural_curvature_is_the_sources_number():
    _, arm, simulation = weightless()
    simulation.set_natural_curvature(arm, (0.0, 2 * np.tan(0.05)), discrete=True)
    assert np.allclose(simulation.get(arm, "natural_curvature"), (0, 0.1 / 0.01))


def test_natural_twist_turns_the_tip():
    _, arm, simulation = weightless(integrator="static", planar=False)
    simulation.set_natural_twist(arm, 5.0)
    simulation.equilibrium()
    assert np.allclose(simulation.twists(arm), 5.0, atol=1e-8)
    d1 = simulation.directors(arm)[-1, 0]
    assert np.allclose(d1, (0, np.cos(5 * 0.195), np.sin(5 * 0.195)), atol=1e-8)
    rows = np.linspace(0, 1, 19)
    simulation.set(arm, natural_twist=rows)
    assert np.array_equal(simulation.get(arm, "natural_twist"), rows)


def test_a_planar_simulation_leaves_its_plane_when_it_is_actuated_out_of_it():
    _, arm, simulation = cantilever(integrator="static")
    assert simulation.plan.planar
    simulation.equilibrium()
    before = simulation.positions(arm)
    simulation.set_natural_curvature(arm, (3.0, 0.0))
    assert not simulation.plan.planar
    assert np.allclose(simulation.positions(arm), before, atol=1e-14)
    simulation.equilibrium()
    _, _, spatial = cantilever(integrator="static", planar=False)
    spatial.set_natural_curvature("arm", (3.0, 0.0))
    spatial.equilibrium()
    assert abs(simulation.positions(arm)[-1, 1]) > 1e-3
    assert np.allclose(simulation.positions(arm), spatial.positions("arm"), atol=1e-8)


@pytest.mark.parametrize("act", [
    lambda s, arm: s.set_natural_curvature(arm, (3.0, 0.0)),
    lambda s, arm: s.set_natural_twist(arm, 1.0),
    lambda s, arm: s.set("tip", force=(0, 1, 0)),
    lambda s, arm: s.set("turn", moment=(0, 0, 1)),
    lambda s, arm: s.set(gravity=(0, 1, 0)),
    lambda s, arm: s.set_velocities(arm, (0, 1, 0)),
    lambda s, arm: s.move("wall", position=(0, 0.01, 0)),
    lambda s, arm: s.pin(arm.end, free=(1, 1, 0)),
])  # fmt: skip
def test_a_simulation_that_was_asked_to_be_planar_refuses_to_leave_its_plane(act):
    scene, arm, _ = cantilever()
    scene.add_force(arm.end, (0, 0, 0), name="tip")
    scene.add_moment(arm.end, (0, 0, 0), name="turn")
    simulation = scene.build(planar=True)
    before = simulation.snapshot()
    with pytest.raises(ValueError, match=r"leaves the plane|out of the plane"):
        act(simulation, arm)
    assert simulation.snapshot() == before


def test_a_straight_scene_can_be_asked_into_the_plane_of_its_first_director():
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    beam = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=11, radius=0.02, material=rubber, normal=(0, 0.6, 0.8))
    scene.clamp(beam.start)
    velocities = np.outer(np.linspace(0, 1, 11) ** 2, (0, 0.6, 0.8))
    motions = []
    for planar in (True, None):
        simulation = scene.build(planar=planar, time_step=0.01)
        assert simulation.plan.planar == (planar is True)
        simulation.set_velocities(beam, velocities)
        simulation.step(20)
        motions.append(simulation.positions())
    assert np.allclose(*motions, atol=1e-9)
    assert np.abs(motions[0] - scene.build().positions()).max() > 0.05
    with pytest.raises(ValueError, match="leaves the plane"):
        scene.build(planar=True).set_velocities(beam, velocities[:, [0, 2, 1]] * (1, 1, -1))


# Parameters


def test_set_and_get_share_their_words():
    scene, arm, _ = cantilever()
    parts = {
        "force": scene.add_force(arm.end, (0, 0, -1)),
        "moment": scene.add_moment(arm.end, (0, 1, 0)),
        "load": scene.add_load(arm, (0, 0, 1)),
        "mass": scene.add_mass(arm.end, 1.0),
        "drag": scene.add_drag(1.0),
    }
    simulation = scene.build()
    for word, handle in parts.items():
        value = 0.5 if word in ("mass", "drag") else (0.0, 0.0, 0.5)
        if word == "moment":
            value = (0.0, 0.5, 0.0)
        simulation.set(handle, **{word: value})
        assert np.array_equal(simulation.get(handle.name, word), value)
    assert np.array_equal(simulation.get(arm, "drag"), np.full(10, 0.5))
    words = {
        "youngs_modulus": 2e6,
        "poisson_ratio": 0.25,
        "density": 500.0,
        "viscosity": 3.0,
        "stretch_stiffness": np.full(10, 3.0),
        "bend_stiffness": np.full((10, 2), 4.0),
        "twist_stiffness": np.arange(1, 11.0),
        "line_density": np.full(10, 5.0),
        "viscous_time": np.full(10, 0.1),
        "drag": np.full(10, 0.7),
        "natural_curvature": np.zeros((9, 2)),
        "natural_twist": np.zeros(9),
    }
    for word, value in words.items():
        simulation.set(arm, **{word: value})
        assert np.array_equal(simulation.get(arm, word), value)
    assert np.array_equal(simulation.get(arm, "radius"), np.full(10, 5e-3))
    simulation.set(gravity=(0, 0, -1))
    assert np.array_equal(simulation.get("gravity"), (0, 0, -1))
    simulation.step(2)


def test_a_changed_material_acts_as_one_that_was_so_from_the_start():
    _scene, arm, simulation = cantilever(integrator="static")
    simulation.set(arm, youngs_modulus=3e6, density=2000.0)
    simulation.equilibrium()
    other = withe.Scene()
    stiff = withe.Material(youngs_modulus=3e6, density=2000.0)
    rod = other.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=stiff)
    other.clamp(rod.start)
    expected = other.build(integrator="static")
    expected.equilibrium()
    assert np.allclose(simulation.positions(), expected.positions(), atol=1e-12)
    assert np.allclose(simulation.get(arm, "bend_stiffness"), expected.get(rod, "bend_stiffness"))
    assert np.allclose(simulation.get(arm, "twist_stiffness"), expected.get(rod, "twist_stiffness"))


def test_a_refused_set_changes_nothing():
    _, arm, simulation = cantilever()
    before = simulation.snapshot()
    with pytest.raises(ValueError, match="density of rod 'arm' must be positive"):
        simulation.set(arm, youngs_modulus=2e6, density=-1.0)
    with pytest.raises(ValueError, match="natural_twist"):
        simulation.set(arm, youngs_modulus=2e6, natural_twist="left")
    assert simulation.get(arm, "youngs_modulus") == 1e6
    assert simulation.snapshot() == before
    _, arm, simulation = cantilever(planar=True)
    before = simulation.snapshot()
    with pytest.raises(ValueError, match="leaves the plane"):
        simulation.set(arm, natural_curvature=(0.0, 1.0), natural_twist=1.0, density=10.0)
    assert simulation.snapshot() == before


def test_viscosity_and_drag_dissipate():
    for word in ("viscosity", "drag"):
        _, arm, simulation = cantilever()
        simulation.set(arm, **{word: 20.0})
        simulation.step(100)
        assert simulation.energy().dissipated > 1e-7
        _, _, free = cantilever()
        free.step(100)
        assert free.energy().dissipated == 0.0


def test_initial_velocities_are_those_of_the_nodes():
    _, arm, simulation = weightless()
    velocities = np.zeros((21, 3))
    velocities[:, 2] = np.linspace(0, 1, 21) ** 2
    simulation.set_velocities(arm, velocities)
    assert np.array_equal(simulation.velocities(arm), velocities)
    assert simulation.energy().kinetic > 0
    simulation.set_velocities(None, (0, 0, 1))
    assert np.array_equal(simulation.velocities(arm)[0], (0, 0, 0))  # held
    assert np.array_equal(simulation.velocities(arm)[1:], np.tile((0, 0, 1), (20, 1)))


# Loads


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
    assert seen[0][0] == 0.0
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


# Supports


def test_supports_can_be_added_and_released_at_any_time():
    _, arm, simulation = cantilever(planar=False, time_step=2e-3)
    simulation.step(20)
    here = simulation.positions(arm)
    grip = simulation.clamp(arm.end, name="grip")
    assert np.allclose(simulation.positions(arm), here, atol=1e-14)
    simulation.release("wall")
    with pytest.raises(ValueError, match=r"'arm.start' is not held"):
        simulation.reaction(arm.start)
    simulation.step(50)
    after = simulation.positions(arm)
    assert np.allclose(after[-1], here[-1], atol=1e-12)
    assert after[0, 2] < -0.01
    simulation.release(arm.end)
    with pytest.raises(ValueError, match="not in the scene"):
        simulation.release(grip)
    simulation.step(50)
    assert simulation.positions(arm)[-1, 2] < here[-1, 2] - 0.01
    simulation.clamp(arm.start, name="again")
    simulation.step(5)


def test_a_released_name_of_the_scene_stays_its_own():
    _, arm, simulation = cantilever()
    simulation.release("wall")
    with pytest.raises(ValueError, match="'wall' is released"):
        simulation.reaction("wall")
    with pytest.raises(ValueError, match="must be new"):
        simulation.pin(arm.start, name="wall")


def test_a_support_slides_along_its_free_direction():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    scene.clamp(rod.start, free=(0, 0, 1))
    simulation = scene.build(time_step=1e-3)
    simulation.step(100)
    fall = 0.5 * 9.81 * 0.1**2
    assert np.allclose(simulation.positions(rod)[:, 2], -fall, rtol=1e-3)
    assert np.allclose(simulation.positions(rod)[0, :2], 0, atol=1e-14)


@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_support_moves_and_turns_to_where_it_is_told(hold, planar):
    scene = withe.Scene(gravity=(0, 0, -1e-3))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    support = scene.clamp(arm.start, hold=hold)
    simulation = scene.build(integrator="static", time_step=0.05, planar=planar)
    simulation.move(arm.start, position=(0.1, 0, 0.2), rotation=Rotation.from_euler("y", -90, degrees=True), over=0.5)
    simulation.step(5)
    assert np.allclose(simulation.positions(arm)[0], (0.05, 0, 0.1), atol=1e-12)
    simulation.step(5)
    assert np.allclose(simulation.positions(arm), [(0.1, 0, 0.2 + z) for z in np.linspace(0, 0.2, 11)], atol=1e-4)
    simulation.move(support, tangent=(-1, 0, 0))
    simulation.step()
    assert np.allclose(simulation.positions(arm)[0], (0.1, 0, 0.2), atol=1e-12)
    assert simulation.positions(arm)[-1] == pytest.approx((-0.1, 0, 0.2), abs=1e-2)


@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_stretched_and_turned_end_is_gripped_as_it_is(hold, planar):
    scene = withe.Scene(gravity=(0, 0, 0))
    soft = withe.Material(youngs_modulus=1e4, poisson_ratio=0.5, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=soft, normal=(0, 1, 0))
    scene.clamp(arm.start)
    pull = scene.add_force(arm.end, (0.1, 0, 0.1))
    simulation = scene.build(integrator="static", time_step=0.1, planar=planar)
    simulation.equilibrium()
    before, directors = simulation.positions(arm), simulation.directors(arm)
    stretched = np.linalg.norm(before[-1] - before[-2])
    assert stretched > 1.1 * 0.02
    grip = simulation.clamp(arm.end, hold=hold)
    simulation.step()
    assert np.allclose(simulation.positions(arm), before, atol=1e-9)
    assert np.allclose(simulation.directors(arm), directors, atol=1e-7)
    simulation.restore(simulation.snapshot())
    simulation.set(pull, force=(0, 0, 0))
    simulation.move(grip, position=before[-1] + (0.01, 0, 0), over=0.1)
    simulation.step()
    after = simulation.positions(arm)
    if hold == "edge":
        assert np.allclose(after[-2:] - before[-2:], (0.01, 0, 0), atol=1e-12)
        assert simulation.tensions(arm)[-1] == pytest.approx(1e4 * np.pi * 5e-3**2 * (stretched / 0.02 - 1.0))


@pytest.mark.parametrize("hold", ["frame", "edge"])
def test_rolls_count_full_turns(hold):
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    scene.clamp(arm.start, hold=hold)
    scene.clamp(arm.end, hold=hold)
    simulation = scene.build(integrator="static", time_step=0.02, planar=False)
    length = 0.2 if hold == "frame" else 0.2 - 0.02
    for target in (7.0, 9.0, -3.0):
        simulation.move(arm.end, roll=target, over=1.0)
        simulation.step(50)
        assert np.allclose(simulation.twists(arm), target / length, rtol=1e-6)
    simulation.move(arm.end, position=(0.21, 0, 0))
    simulation.step()
    assert np.allclose(simulation.twists(arm), -3.0 / length, rtol=1e-6)


def test_a_path_gives_the_position_at_the_end_of_every_step():
    _, arm, simulation = cantilever(planar=False, time_step=0.01)

    def path(t):
        return (0.1 * t, 0, 0), Rotation.from_rotvec([t, 0, 0]).as_matrix()

    simulation.move("wall", path=path)
    simulation.step(7)
    assert simulation.positions(arm)[0] == pytest.approx((0.007, 0, 0), abs=1e-14)
    simulation.move(arm.start, path=lambda t: np.array([0.1 * t, 0, t - 0.07]))
    simulation.step(3)
    assert simulation.positions(arm)[0] == pytest.approx((0.01, 0, 0.03), abs=1e-14)
    simulation.move(arm.start, position=(0, 0, 0))
    simulation.step(3)
    assert simulation.positions(arm)[0] == pytest.approx((0, 0, 0), abs=1e-14)


def test_a_pin_moves_but_does_not_turn():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=RUBBER)
    scene.pin(rod.start)
    simulation = scene.build()
    simulation.move(rod.start, (0, 0, 0.1), over=0.05)
    simulation.step(10)
    assert simulation.positions(rod)[0] == pytest.approx((0, 0, 0.1), abs=1e-14)
    with pytest.raises(ValueError, match="a pin holds no direction"):
        simulation.move(rod.start, roll=1.0)
    with pytest.raises(ValueError, match="a pin holds no direction"):
        simulation.move(rod.start, path=lambda t: ((0, 0, 0), np.eye(3)))


def test_reactions_balance_the_loads_at_every_support():
    _, _, simulation = tripod(integrator="static")
    simulation.equilibrium()
    total = sum(simulation.reaction(name).force for name in ("clamp 1", "clamp 2"))
    weight = sum(
        float(
            simulation.get(rod, "line_density")[0] * np.linalg.norm(np.ptp(simulation._scene.rod(rod).points, axis=0))
        )
        for rod in simulation.rods
    )
    assert total == pytest.approx((-0.01, -0.02, 9.81 * weight), abs=1e-7)
