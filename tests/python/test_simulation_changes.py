"""Changes of a running simulation: loads that are removed again, friction that changes."""

import copy
import pickle

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e7, density=1000.0)


def cantilever():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=6, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    scene.add_force(arm.end, (0, 0, 0.01), name="drawn")
    return arm, scene


def put_on(simulation, arm):
    return (
        simulation.add_force(arm.end, (0.0, 0.01, 0.0)),
        simulation.add_moment(arm.node(3), lambda t: (0, 1e-4 * np.sin(30 * t), 0)),
        simulation.add_load(arm, (0, 0.02, 0)),
        simulation.add_pressure(arm, 0.05, normal=(0, 0, 1)),
    )


@pytest.mark.parametrize("gone", [(0,), (1,), (3, 0), (2, 1), (0, 1, 2, 3)])
def test_a_load_that_was_taken_off_acts_no_more(gone):
    """And the others go on as if it had never been there."""
    arm, scene = cantilever()
    left, never = scene.build(planar=False), scene.build(planar=False)
    loads = put_on(left, arm)
    for index in gone:
        left.remove(loads[index])
    for index, load in enumerate(put_on(never, arm)):
        if index in gone:
            never.set(load, **{load_word(index): 0.0 if index == 3 else (0, 0, 0)})
    for simulation in (left, never):
        simulation.step(20)
    np.testing.assert_allclose(left.positions(arm), never.positions(arm), atol=1e-12)


def load_word(index):
    return ("force", "moment", "load", "pressure")[index]


def test_what_was_taken_off_comes_back_with_a_snapshot_and_goes_with_reset():
    arm, scene = cantilever()
    simulation = scene.build(planar=False)
    wind = simulation.add_load(arm, (0, 0.1, 0), name="wind")
    simulation.step(5)
    kept = simulation.snapshot()
    simulation.step(5)
    expected = simulation.positions(arm)
    simulation.restore(kept)
    simulation.remove(wind)
    with pytest.raises(ValueError, match="wind"):
        simulation.get("wind", "load")
    for twin in (copy.copy(simulation), pickle.loads(pickle.dumps(simulation))):
        with pytest.raises(ValueError, match="wind"):
            twin.remove("wind")
    simulation.step(3)
    simulation.restore(kept)
    np.testing.assert_array_equal(simulation.get("wind", "load"), (0, 0.1, 0))
    simulation.step(5)
    np.testing.assert_array_equal(simulation.positions(arm), expected)
    simulation.reset()
    with pytest.raises(ValueError, match="wind"):
        simulation.remove("wind")
    again = simulation.add_load(arm, (0, 0.1, 0), name="wind")
    simulation.remove(again)


def test_a_load_of_the_drawing_stays_and_one_is_taken_off_once():
    arm, scene = cantilever()
    simulation = scene.build()
    with pytest.raises(
        ValueError, match=r"load 'drawn' belongs to the scene and cannot be removed: use set\('drawn', force"
    ):
        simulation.remove("drawn")
    load = simulation.add_force(arm.end, (0, 0, 1.0))
    simulation.remove(load)
    with pytest.raises(ValueError, match="force 1"):
        simulation.remove(load)


def sliding(friction=0.5, rods=0.0):
    scene = withe.Scene()
    block = scene.add_rod(start=(0, 0, 5e-3), end=(0.1, 0, 5e-3), nodes=6, radius=5e-3, material=RUBBER, name="block")
    floor = scene.add_floor(friction=friction, name="floor")
    scene.enable_contact(friction=rods)
    return block, floor, scene


def way(simulation, block, speed=0.2, steps=20):
    simulation.step(30)
    start = simulation.positions(block)[:, 0].mean()
    simulation.set_velocities(block, (speed, 0, 0))
    simulation.step(steps)
    return simulation.positions(block)[:, 0].mean() - start


@pytest.mark.parametrize(("drawn", "changed"), [(0.5, 0.0), (0.0, 0.5), (0.1, 0.6), ((0.6, 0.1), (0.1, 0.6))])
def test_friction_that_was_changed_acts_as_if_it_had_been_drawn(drawn, changed):
    block, floor, scene = sliding(drawn)
    simulation = scene.build(time_step=1e-3)
    before = simulation.snapshot()
    simulation.set(floor, friction=changed)
    assert simulation.get(floor, "friction") == changed
    other, _, drawn_so = sliding(changed)
    expected = way(drawn_so.build(time_step=1e-3), other)
    assert way(simulation.copy(), block) == pytest.approx(expected, rel=1e-6)
    assert way(simulation, block) == pytest.approx(expected, rel=1e-6)
    simulation.restore(before)
    assert simulation.get(floor, "friction") == drawn
    first, _, same = sliding(drawn)
    assert way(simulation, block) == pytest.approx(way(same.build(time_step=1e-3), first), rel=1e-6)


def test_friction_of_a_pair_and_of_rods_is_set_while_running():
    block, floor, scene = sliding(0.0)
    simulation = scene.build(time_step=1e-3)
    simulation.set((block, floor), friction=(0.6, 0.1))
    other, ground, drawn = sliding(0.0)
    drawn.set_friction(other, ground, (0.6, 0.1))
    assert way(simulation, block) == pytest.approx(way(drawn.build(time_step=1e-3), other), rel=1e-6)
    simulation.set(friction=0.3, gravity=(0, 0, -1))
    assert simulation.get("friction") == 0.3
    kept = pickle.loads(pickle.dumps(simulation))
    assert kept.get("friction") == 0.3
    simulation.set(("block", "block"), friction=0.2)


@pytest.mark.parametrize("friction", [0.1, (0.3, 0.1), (0.1, 0.3, 0.2), np.linspace(0.1, 0.3, 5)])
def test_friction_of_a_pair_is_read_as_it_acts_from_copies_pickles_files_and_batches(friction, tmp_path):
    _, _, scene = sliding(0.4, rods=0.2)
    simulation = scene.build(time_step=1e-3)
    before = simulation.snapshot()
    simulation.set(("block", "floor"), friction=friction)
    simulation.set(("block", "block"), friction=0.7)
    from_file, from_pickle = scene.build(time_step=1e-3), scene.build(time_step=1e-3)
    from_file.restore(withe.Snapshot.load(simulation.snapshot().save(tmp_path / "pair.npz")))
    from_pickle.restore(pickle.loads(pickle.dumps(simulation.snapshot())))
    twins = [simulation, simulation.copy(), pickle.loads(pickle.dumps(simulation)), from_file, from_pickle]
    twins += list(pickle.loads(pickle.dumps(withe.Batch([simulation, from_file]))))
    for twin in twins:
        np.testing.assert_array_equal(twin.get(("block", "floor"), "friction"), friction)
        assert twin.get(("block", "block"), "friction") == 0.7
        assert twin.get("floor", "friction") == 0.4
    for twin in twins:
        twin.restore(before)
        assert twin.get(("block", "floor"), "friction") == 0.4
        assert twin.get(("block", "block"), "friction") == 0.2


def test_three_coefficients_of_a_rod_of_three_edges_are_directions_as_a_tuple_and_edges_as_an_array():
    scene = withe.Scene()
    block = scene.add_rod(start=(0, 0, 5e-3), end=(0.1, 0, 5e-3), nodes=4, radius=5e-3, material=RUBBER, name="block")
    floor = scene.add_floor()
    simulation = scene.build()
    for friction in ((0.1, 0.2, 0.3), np.array((0.1, 0.2, 0.3))):
        simulation.set((block, floor), friction=friction)
        assert type(simulation.get((block, floor), "friction")) is type(friction)


def test_friction_along_a_rod_stays_its_own_where_the_floor_has_a_field(tmp_path):
    table = withe.FrictionMap([[0.1, 0.9]], (-1.0, 1.0, -1.0, 1.0))
    block, _, scene = sliding(table)
    rows = np.linspace(0.1, 0.3, 5)
    simulation = scene.build(time_step=1e-3)
    simulation.set((block, "floor"), friction=rows)
    other = scene.build(time_step=1e-3)
    other.restore(withe.Snapshot.load(simulation.snapshot().save(tmp_path / "rows.npz")))
    for twin in (other, pickle.loads(pickle.dumps(simulation))):
        np.testing.assert_array_equal(twin.get((block, "floor"), "friction"), rows)
        np.testing.assert_array_equal(twin.get("floor", "friction").image, table.image)
        assert way(twin, block) == way(simulation.copy(), block)


def test_a_file_of_a_field_of_friction_needs_the_field(tmp_path):
    block, floor, scene = sliding(0.4)
    simulation = scene.build(time_step=1e-3)
    simulation.set((block, floor), friction=withe.FrictionMap([[0.1, 0.9]], (-1.0, 1.0, -1.0, 1.0)))
    snapshot = withe.Snapshot.load(simulation.snapshot().save(tmp_path / "field.npz"))
    other = scene.build(time_step=1e-3)
    with pytest.raises(
        ValueError, match=r"do not store functions of position: set the friction of 'block' and 'floor'"
    ):
        other.restore(snapshot)
    other.set((block, floor), friction=simulation.get((block, floor), "friction"))
    other.restore(snapshot)
    assert way(other, block) == way(simulation, block)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.set("floor", friction=-1), "friction of 'floor' must"),
        (lambda s: s.set("floor", friction=(1, 2, 3, 4)), "friction of 'floor' must"),
        (lambda s: s.set("floor", friction=(0.1, -2, 0.1)), "friction of 'floor' towards its start must"),
        (lambda s: s.set("floor", friction=(0.1, -2)), "friction of 'floor' across must"),
        (lambda s: s.set("floor", radius=1), "obstacle 'floor' has no 'radius' to set; it has friction"),
        (lambda s: s.set(("floor", "floor"), friction=0.1), "both obstacles"),
        (
            lambda s: s.set(("block", "block"), friction=(0.1, 0.2)),
            "must be one number, got .*: friction along and across",
        ),
        (lambda s: s.set(friction="much"), "friction must be"),
    ],
)
def test_friction_out_of_range_is_named_and_changes_nothing(call, message):
    _, floor, scene = sliding(0.25)
    simulation = scene.build()
    with pytest.raises(ValueError, match=message):
        call(simulation)
    assert simulation.get(floor, "friction") == 0.25


def test_friction_of_rods_that_do_not_touch_and_directions_with_lagged_friction_are_refused():
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 5e-3), end=(0.1, 0, 5e-3), nodes=6, radius=5e-3, material=RUBBER, name="block")
    floor = scene.add_floor()
    with pytest.raises(ValueError, match="contact between rods, which is off"):
        scene.build().set(friction=0.1)
    scene.enable_contact(friction_model="lagged")
    with pytest.raises(ValueError, match="along and across a rod must be the same with friction_model='lagged'"):
        scene.build().set(floor, friction=(0.1, 0.2))
    scene.add_plane((0, 0, -1), (0, 0, 1), friction=(0.1, 0.2))
    with pytest.raises(ValueError, match="use 'anchored' or 'implicit'"):
        scene.build()
