"""Numbers set while a simulation runs: they act as if it had been built with them, and their work is accounted for."""

import itertools
import pickle

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER
from withe.parts.parameters import MADE_OF, NATURAL_WORDS, ROD_WORDS

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
    {"natural_stretch": 1.03},
    {"natural_stretch": np.linspace(0.98, 1.05, 20)},
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
    simulation.set("arm", youngs_modulus=3e6, natural_curvature=(0.0, 5.0), natural_stretch=0.99)
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
        driven.set("arm", natural_curvature=(0.0, 1e-4 * i))
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


def drawn_values(random, edges=20):
    """A value for every word of a rod: one number, or one an edge."""
    first = {
        "youngs_modulus": 1e6,
        "density": 1e3,
        "viscosity": 1e4,
        "stretch_stiffness": 80.0,
        "bend_stiffness": 5e-4,
        "twist_stiffness": 3e-4,
        "line_density": 0.08,
        "viscous_time": 0.01,
        "drag": 0.1,
        "natural_stretch": 1.0,
    }
    values = {
        word: one * random.uniform(0.9, 1.1, edges if random.random() < 0.5 else ()) for word, one in first.items()
    }
    values["bend_stiffness"] = 5e-4 * random.uniform(0.9, 1.1, (edges, 2))
    return values | {
        "poisson_ratio": random.uniform(0.0, 0.5),
        "natural_curvature": random.uniform(-2.0, 2.0, (edges - 1, 2)),
        "natural_twist": random.uniform(-2.0, 2.0, edges - 1),
    }


def test_words_set_together_are_as_given_in_whatever_order():
    random = np.random.default_rng(4)
    still = swinging()
    for pair in itertools.combinations([*ROD_WORDS, *NATURAL_WORDS], 2):
        values = drawn_values(random)
        ends = []
        for words in (pair, pair[::-1]):
            simulation = still.copy()
            simulation.set("arm", **{word: values[word] for word in words})
            for word in words:
                got = simulation.get("arm", word)
                assert np.array_equal(got, np.broadcast_to(values[word], np.shape(got))), pair
            ends.append(simulation.snapshot())
        assert ends[0] == ends[1], pair


def test_no_word_undoes_one_that_is_set_before_it():
    for place, word in enumerate(ROD_WORDS):
        assert not MADE_OF.get(word, {}).keys() & set(ROD_WORDS[:place])


def test_words_set_together_are_as_given_in_every_lane_of_a_batch():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=6, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    batch = scene.build_batch(2)
    batch.set(arm, viscous_time=[0.02, 0.03], twist_stiffness=[4e-4, 5e-4], youngs_modulus=[2e6, 3e6])
    assert [simulation.get(arm, "viscous_time")[0] for simulation in batch] == [0.02, 0.03]
    assert [simulation.get(arm, "twist_stiffness")[0] for simulation in batch] == [4e-4, 5e-4]
    assert [simulation.get(arm, "youngs_modulus") for simulation in batch] == [2e6, 3e6]


def test_a_ramp_ends_where_a_natural_curvature_is_set_at_once_to_what_it_is():
    simulation = swinging()
    simulation.set("arm", natural_curvature=(0.0, 5.0), over=1.0)
    simulation.step(5)
    now = simulation.get("arm", "natural_curvature")
    simulation.set("arm", natural_curvature=now)
    simulation.step(5)
    assert np.array_equal(simulation.get("arm", "natural_curvature"), now)


def sliding(
    friction=0.3,
    own=None,
    rods=0.2,
    pull=(2.0, 1.0, 0.0),
    own_stiffness=None,
    table_restitution=1.0,
    own_restitution=None,
    fall=0.0,
    **contact,
):
    """A block on a table that pulls at it, and a rod that lies across the block; or both fall onto it."""
    low, high = 0.01 + fall, 0.025 + 2.0 * fall
    scene = withe.Scene()
    block = scene.add_rod(start=(0, 0, low), end=(0.1, 0, low), nodes=6, radius=0.01, material=RUBBER, name="block")
    across = scene.add_rod(
        start=(0.05, -0.05, high),
        end=(0.05, 0.05, high),
        nodes=6,
        radius=0.005,
        material=RUBBER,
        name="across",
    )
    table = scene.add_floor(friction=friction, restitution=table_restitution, name="table")
    scene.enable_contact(friction=rods, **contact)
    if own is not None:
        scene.set_friction(block, table, own)
    if own_stiffness is not None:
        scene.set_contact_stiffness(block, table, own_stiffness)
    if own_restitution is not None:
        scene.set_restitution(block, table, own_restitution)
    scene.add_load(block, pull)
    return scene.build(time_step=2e-3, integrator="backward_euler"), across


CONTACT = [
    ({"friction": 0.1}, lambda s: s.set("table", friction=0.1)),
    ({"friction": (0.1, 0.4)}, lambda s: s.set("table", friction=(0.1, 0.4))),
    ({"own": 0.05}, lambda s: s.set(("block", "table"), friction=0.05)),
    (
        {"slip_tolerance": 1e-2, "friction_model": "implicit", "pull": (0.3, 0.1, 0.0)},
        lambda s: s.set(slip_tolerance=1e-2),
    ),
    ({"stiffness": 4e4}, lambda s: s.set(contact_stiffness=4e4)),
    ({"own_stiffness": 4e4}, lambda s: s.set(("block", "table"), contact_stiffness=4e4)),
    ({"restitution": 0.2}, lambda s: s.set(restitution=0.2)),
    ({"table_restitution": 0.2}, lambda s: s.set("table", restitution=0.2)),
    ({"own_restitution": 0.2}, lambda s: s.set(("block", "table"), restitution=0.2)),
]


@pytest.mark.parametrize(("drawn", "act"), CONTACT)
def test_contact_set_while_running_goes_on_as_if_it_had_been_drawn(drawn, act):
    model = {key: drawn[key] for key in ("friction_model", "pull") if key in drawn}
    model["fall"] = 0.01 if any("restitution" in key for key in drawn) else 0.0
    drawn = drawn | model
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
    with pytest.raises(ValueError, match="'wall' has no 'mass'; it has position, rotation"):
        simulation.get(wall, "mass")


def lying(stiffness=None, **build):
    """A rod at rest on a floor, with contact nearly without a tolerance, and its weight."""
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.01), end=(0.2, 0, 0.01), nodes=9, radius=0.01, material=RUBBER, name="rod")
    scene.add_floor(name="floor")
    scene.enable_contact(stiffness=stiffness, distance_tolerance=1e-6)
    simulation = scene.build(integrator="static", time_step=1e-2, **build)
    simulation.equilibrium()
    return simulation, 1000.0 * np.pi * 1e-4 * 0.2 * 9.81


def test_a_contact_stiffness_says_how_deep_a_weight_presses_and_its_work_is_accounted_for():
    simulation, weight = lying(5e3)
    for stiffness in (5e3, 2e4, 1e3):
        before, old = simulation.energy(), simulation.get("contact_stiffness")
        simulation.set(contact_stiffness=stiffness)
        after = simulation.energy()
        # E = k d^2 at the depth d that there is.
        assert after.contact == pytest.approx(before.contact * stiffness / old, rel=1e-9)
        assert after.work - before.work == pytest.approx(after.contact - before.contact, rel=1e-9, abs=1e-18)
        simulation.equilibrium()
        found = simulation.contacts()
        assert found["normal_force"].sum() == pytest.approx(weight, rel=1e-6)
        # Nine nodes, the outer two half as stiff: 2 k d each, 16 k d in all.
        assert -found["gap"] == pytest.approx(np.full(9, weight / (16.0 * stiffness)), rel=2e-2)
    simulation.set(contact_stiffness=None)
    assert simulation.get("contact_stiffness") is None
    simulation.step(5)
    assert simulation.contacts()["normal_force"].sum() == pytest.approx(weight, rel=1e-6)


def test_contact_that_was_set_comes_back_with_a_snapshot_and_in_copies():
    simulation, _ = sliding()
    simulation.step(10)
    simulation.set(contact_stiffness=3e4, restitution=0.4)
    simulation.set("table", restitution=0.3)
    simulation.set(("block", "table"), contact_stiffness=5e4)
    simulation.set(("block", "table"), restitution=0.2)
    fresh, _ = sliding()
    fresh.restore(simulation.snapshot())
    copies = [simulation.copy(), pickle.loads(pickle.dumps(simulation)), fresh]
    for each in (simulation, *copies):
        each.step(10)
    for each in copies:
        assert np.array_equal(each.positions(), simulation.positions())
        assert (each.get("contact_stiffness"), each.get("restitution")) == (3e4, 0.4)
        assert each.get("table", "restitution") == 0.3
    fresh.reset()
    assert fresh.get("contact_stiffness") is None
    assert fresh.get("table", "restitution") == 1.0


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_restitution_that_changes_between_two_bounces_acts_on_the_second(integrator):
    scene = withe.Scene()
    rod = scene.add_rod(start=(-0.06, 0, 0.03), end=(0.06, 0, 0.03), nodes=11, radius=0.01, material=RUBBER)
    scene.add_floor(restitution=0.8, name="floor")
    simulation = scene.build(integrator=integrator, time_step=1e-3)
    height, tops = 0.02, []
    for restitution in (0.8, 0.5):
        simulation.set("floor", restitution=restitution)
        simulation.step(round(1.15 * np.sqrt(2.0 * height / 9.81) / 1e-3))
        top = 0.0
        while simulation.velocities(rod)[:, 2].mean() > 0.0:
            simulation.step()
            top = max(top, float(simulation.positions(rod)[:, 2].mean()) - 0.01)
        tops.append(top / height)
        height = top
    assert tops == pytest.approx([0.64, 0.25], abs=0.03)


def test_what_is_wrong_with_contact_that_is_set_is_named():
    simulation, _ = sliding()
    table = "table"
    cases = [
        (lambda: simulation.set(restitution=1.5), "restitution must be from 0 to 1, got 1.5"),
        (lambda: simulation.set(contact_stiffness=0.0), "contact_stiffness must be positive, got 0"),
        (lambda: simulation.set(table, restitution=-0.1), "restitution of 'table' must be from 0 to 1, got -0.1"),
        (lambda: simulation.set(table, stiffness=1e3), "obstacle 'table' has no 'stiffness' to set; it has friction"),
        (
            lambda: simulation.set(("block", table), restitution=2.0),
            "restitution of 'block' and 'table' must be from 0",
        ),
        (
            lambda: simulation.set(("block", table), contact_stiffness=-1.0),
            "stiffness of 'block' and 'table' must be pos",
        ),
    ]
    before = simulation.snapshot()
    for call, message in cases:
        with pytest.raises(ValueError, match=message):
            call()
    assert simulation.snapshot() == before
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.1), end=(0.2, 0, 0.1), nodes=6, radius=5e-3, material=RUBBER)
    scene.add_floor(name="table")
    explicit = scene.build(integrator="verlet", time_step=1e-5)
    with pytest.raises(ValueError, match="'verlet' supports elastic impacts only"):
        explicit.set("table", restitution=0.5)
    with pytest.raises(ValueError, match="contact between rods, which is off: call Scene"):
        explicit.set(restitution=0.5)
    assert explicit.get("table", "restitution") == 1.0


def test_a_pose_that_is_set_is_that_of_a_support_that_is_moved_at_once():
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER, name="arm")
    wall, end = scene.clamp(arm.start, name="wall"), scene.clamp(arm.end, name="end")
    simulation = scene.build(integrator="static", planar=False)
    moved = simulation.copy()
    # A hundredth longer: the wall is pulled by EA eps.
    simulation.set(end, position=(0.202, 0, 0))
    moved.move(end, position=(0.202, 0, 0), over=0)
    for each in (simulation, moved):
        each.step()
    assert simulation.get(end, "position") == pytest.approx([0.202, 0, 0])
    assert simulation.reaction(wall).force == pytest.approx([-1e6 * np.pi * 25e-6 * 0.01, 0, 0], rel=1e-9, abs=1e-12)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    simulation.set("end", position=(0.15, 0.1, 0), rotation=turn)
    moved.move("end", position=(0.15, 0.1, 0), rotation=turn)
    for each in (simulation, moved):
        each.step()
    assert np.array_equal(simulation.positions(), moved.positions())
    assert simulation.get(end, "rotation") == pytest.approx(turn, abs=1e-12)
    with pytest.raises(ValueError, match="support 'wall' has no 'force' to set; it has position, rotation"):
        simulation.set(wall, force=(0, 0, 1))
    with pytest.raises(ValueError, match="position of support 'wall' must"):
        simulation.set(wall, position=(0, 0))
