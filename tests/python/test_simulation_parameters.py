"""Numbers set while a simulation runs: they act as if it had been built with them, and their work is accounted for."""

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER

ROD = [
    {"youngs_modulus": 2e6},
    {"youngs_modulus": np.linspace(0.5e6, 2e6, 20)},
    {"poisson_ratio": 0.1},
    {"density": 1700.0},
    {"stretch_stiffness": 33.0},
    {"bend_stiffness": (1e-3, 2e-3)},
    {"twist_stiffness": 3e-4},
    {"line_density": 0.2},
    {"natural_curvature": (1.0, -4.0)},
    {"natural_twist": 3.0},
]
OTHERS = [(None, {"gravity": (1.0, 2.0, 3.0)}), ("mass", {"mass": 0.05})]
SETTINGS = [("arm", values) for values in ROD] + OTHERS


def swinging(**build):
    """An arm with a mass in the middle of its motion, bent, stretched and twisted."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    scene.add_mass(arm.end, 0.01, name="mass")
    scene.add_moment(arm.end, (1e-3, 0, 0))
    simulation = scene.build(time_step=1e-3, planar=False, **build)
    simulation.step(20)
    return simulation


def stored(energy):
    return energy.kinetic + energy.stretch + energy.bend + energy.twist + energy.gravity + energy.contact


def named(setting):
    return next(iter(setting[1]))


@pytest.mark.parametrize("setting", SETTINGS, ids=named)
def test_what_a_setting_does_to_the_energy_is_work(setting):
    target, values = setting
    simulation = swinging()
    before = simulation.energy()
    simulation.set(target, **values)
    after = simulation.energy()
    assert stored(after) != stored(before)
    assert np.isclose(after.work - before.work, stored(after) - stored(before), rtol=1e-12, atol=1e-18)
    assert (after.loads, after.dissipated) == (before.loads, before.dissipated)
    # Not once more when time goes on, nor when it is asked for again.
    assert simulation.energy().work == after.work
    copy = simulation.copy()
    simulation.step()
    copy.step()
    assert np.isclose(simulation.energy().work, after.work, rtol=1e-12, atol=1e-18)
    assert copy.energy().work == simulation.energy().work


def test_the_work_of_several_settings_in_a_row_is_that_of_all():
    simulation = swinging()
    before = simulation.energy()
    simulation.set("arm", youngs_modulus=3e6, natural_curvature=(0.0, 5.0))
    simulation.set(gravity=(0, 0, 3.0))
    simulation.set("arm", density=500.0)
    simulation.set("mass", mass=0.5)
    after = simulation.energy()
    assert np.isclose(after.work - before.work, stored(after) - stored(before), rtol=1e-12)


@pytest.mark.parametrize("setting", SETTINGS, ids=named)
def test_a_setting_comes_back_with_a_snapshot(setting, tmp_path):
    target, values = setting
    simulation = swinging()
    simulation.set(target, **values)
    fresh = swinging()
    fresh.restore(withe.Snapshot.load(simulation.snapshot().save(tmp_path / "set.npz")))
    simulation.step(3)
    fresh.step(3)
    assert np.array_equal(fresh.positions(), simulation.positions())
    assert fresh.energy().work == simulation.energy().work
    for word in values:
        got = (target, word) if target else (word,)
        assert np.array_equal(fresh.get(*got), simulation.get(*got))


@pytest.mark.parametrize("setting", SETTINGS, ids=named)
def test_what_is_set_to_what_it_is_changes_nothing(setting):
    target, values = setting
    simulation, other = swinging(), swinging()
    for each in (simulation, other):
        each.set(target, **values)
        each.step(3)
    counted = simulation.statistics.factorizations
    for _ in range(5):
        simulation.set(target, **values)
        simulation.step()
        other.step()
    assert simulation.statistics.factorizations == other.statistics.factorizations
    assert simulation.statistics.factorizations >= counted
    assert np.array_equal(simulation.positions(), other.positions())
    assert simulation.energy().work == other.energy().work


def test_settings_go_on_with_the_factorisation_that_there_is():
    # A natural curvature that changes little from step to step asks for no more matrices than one that stays.
    still, driven = swinging(), swinging()
    for i in range(40):
        driven.set_natural_curvature("arm", (0.0, 1e-4 * i))
        still.step()
        driven.step()
    assert driven.statistics.factorizations <= still.statistics.factorizations + 1


def test_of_several_words_none_is_set_where_one_is_refused():
    simulation = swinging()
    before = simulation.snapshot()
    with pytest.raises(ValueError, match="must turn the rod by less than pi at every node"):
        simulation.set("arm", youngs_modulus=5e6, natural_twist=1.0, natural_curvature=(0.0, 1e4))
    assert simulation.snapshot() == before
    assert simulation.get("arm", "youngs_modulus") == 1e6


def test_a_ramp_ends_where_a_natural_curvature_is_set_at_once_to_what_it_is():
    simulation = swinging()
    simulation.set_natural_curvature("arm", (0.0, 5.0), over=1.0)
    simulation.step(5)
    now = simulation.get("arm", "natural_curvature")
    simulation.set("arm", natural_curvature=now)
    simulation.step(5)
    assert np.array_equal(simulation.get("arm", "natural_curvature"), now)


def sliding(friction=0.3, own=None, rods=0.2, pull=(2.0, 1.0, 0.0), **contact):
    """A block on a table that pulls at it, and a rod that lies across the block."""
    scene = withe.Scene()
    block = scene.add_rod(start=(0, 0, 0.01), end=(0.1, 0, 0.01), nodes=6, radius=0.01, material=RUBBER, name="block")
    across = scene.add_rod(
        start=(0.05, -0.05, 0.025), end=(0.05, 0.05, 0.025), nodes=6, radius=0.005, material=RUBBER, name="across"
    )
    table = scene.add_floor(friction=friction, name="table")
    scene.enable_contact(friction=rods, **contact)
    if own is not None:
        scene.set_friction(block, table, own)
    scene.add_load(block, pull)
    return scene.build(time_step=2e-3, integrator="backward_euler"), across


FRICTION = [
    ({"friction": 0.1}, lambda s: s.set("table", friction=0.1)),
    ({"friction": (0.1, 0.4)}, lambda s: s.set("table", friction=(0.1, 0.4))),
    ({"own": 0.05}, lambda s: s.set_friction("block", "table", 0.05)),
    (
        {"slip_tolerance": 1e-2, "friction_model": "implicit", "pull": (0.3, 0.1, 0.0)},
        lambda s: s.set(slip_tolerance=1e-2),
    ),
]


@pytest.mark.parametrize(("drawn", "act"), FRICTION)
def test_friction_set_while_running_goes_on_as_if_it_had_been_drawn(drawn, act):
    model = {key: drawn[key] for key in ("friction_model", "pull") if key in drawn}
    simulation, _ = sliding(**model)
    act(simulation)
    built, _ = sliding(**drawn)
    plain, _ = sliding(**model)
    for each in (simulation, built, plain):
        each.step(40)
    scale = np.ptp(built.positions())
    assert np.abs(simulation.positions() - built.positions()).max() <= 1e-9 * scale
    assert np.abs(simulation.positions() - plain.positions()).max() > 1e-5 * scale


def test_friction_that_changes_keeps_the_equations_and_its_work_is_accounted_for():
    simulation, _ = sliding()
    simulation.step(30)
    for i in range(20):
        before, counted = simulation.energy(), simulation.statistics.factorizations
        simulation.set("table", friction=0.3 + 0.01 * i)
        simulation.set(None, friction=0.2 + 0.01 * i, slip_tolerance=1e-3 + 1e-4 * i)
        after = simulation.energy()
        assert np.isclose(after.work - before.work, stored(after) - stored(before), rtol=1e-9, atol=1e-15)
        assert simulation.statistics.factorizations == counted
        simulation.step()
    assert simulation.get("slip_tolerance") == pytest.approx(1e-3 + 1e-4 * 19)
    assert simulation.get("table", "friction") == pytest.approx(0.49)
    # Read-outs between two steps go by what was set, and so does a snapshot in a simulation that was never told.
    fresh, _ = sliding()
    fresh.restore(simulation.snapshot())
    copy = simulation.copy()
    for each in (simulation, fresh, copy):
        each.step(5)
    assert np.array_equal(fresh.positions(), simulation.positions())
    assert np.array_equal(copy.positions(), simulation.positions())
    assert fresh.get("slip_tolerance") == simulation.get("slip_tolerance")


@pytest.mark.parametrize("to", [0.0, 0.3])
def test_friction_comes_and_goes(to):
    simulation, _ = sliding(friction=0.3 - to, rods=0.0, friction_model="implicit")
    simulation.set("table", friction=to)
    built, _ = sliding(friction=to, rods=0.0, friction_model="implicit")
    simulation.step(20)
    built.step(20)
    assert np.abs(simulation.positions() - built.positions()).max() <= 1e-9 * np.ptp(built.positions())


def test_a_slip_tolerance_out_of_range_is_named():
    simulation, _ = sliding()
    with pytest.raises(ValueError, match="slip_tolerance must be positive, got 0"):
        simulation.set(slip_tolerance=0.0)
    assert simulation.get("slip_tolerance") == 1e-3


def test_poses_of_supports_and_obstacles_are_read():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0.5), end=(0.2, 0, 0.5), nodes=6, radius=5e-3, material=RUBBER, name="arm")
    wall = scene.clamp(arm.start, name="wall")
    ball = scene.add_sphere((0, 0, 0), 0.1, name="ball")
    simulation = scene.build(planar=False, time_step=1e-3)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    simulation.move(wall, position=(0, 0.1, 0.5), rotation=turn, over=0.01)
    simulation.move(ball, position=(0, 0, -0.1), tangent=(0, 0, 1), roll=0.5, over=0.01)
    simulation.step(10)
    assert np.allclose(simulation.get(wall, "position"), (0, 0.1, 0.5), atol=1e-12)
    assert np.allclose(simulation.get("wall", "rotation"), turn, atol=1e-12)
    assert np.allclose(simulation.get(ball, "position"), (0, 0, -0.1), atol=1e-12)
    assert np.allclose(simulation.get(ball, "turn"), (0, 0, 0.5), atol=1e-12)
    with pytest.raises(ValueError, match="get reads its position and rotation"):
        simulation.get(wall, "mass")
