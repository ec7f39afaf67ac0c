"""Snapshot, restore, copy, reset, pickle: bit by bit, also through a file."""

import copy
import pickle

import numpy as np
import pytest

import withe
from simple_scenes import cantilever, same_state, tripod

BUILDERS = [
    lambda: cantilever()[2],
    lambda: cantilever(planar=False)[2],
    lambda: cantilever(integrator="backward_euler", tolerance=1e-4)[2],
    lambda: cantilever(integrator="verlet", time_step=1e-5)[2],
    lambda: cantilever(integrator="static")[2],
    lambda: tripod()[2],
    lambda: tripod(integrator="energy_momentum")[2],
]


@pytest.fixture(params=BUILDERS)
def simulation(request):
    return request.param()


def test_a_restored_snapshot_goes_on_bit_by_bit(simulation):
    simulation.step(7)
    state = simulation.snapshot()
    simulation.step(9)
    there = simulation.snapshot()
    simulation.restore(state)
    assert simulation.snapshot() == state
    simulation.step(9)
    assert simulation.snapshot() == there


def test_a_snapshot_travels_through_a_file_into_another_build(simulation, tmp_path):
    simulation.step(7)
    simulation.snapshot().save(tmp_path / "s.npz")
    state = withe.Snapshot.load(tmp_path / "s.npz")
    assert state == simulation.snapshot()
    assert state.time == simulation.time
    other = BUILDERS[0]()
    for build in BUILDERS:
        candidate = build()
        if candidate._session.options == simulation._session.options and len(candidate.rods) == len(simulation.rods):
            other = candidate
    other.restore(state)
    simulation.step(5)
    other.step(5)
    assert same_state(simulation, other)


@pytest.mark.parametrize(
    "duplicate", [lambda s: s.copy(), copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
def test_a_duplicate_goes_its_own_way_from_the_same_bits(simulation, duplicate):
    simulation.step(4)
    other = duplicate(simulation)
    assert same_state(simulation, other)
    other.step(3)
    assert not same_state(simulation, other)
    simulation.step(3)
    assert same_state(simulation, other)


def test_reset_undoes_everything():
    scene, arm, simulation = cantilever()
    load = scene.add_force(arm.end, (0, 0, -0.01), name="tip")
    scene.add_mass(arm.end, 0.001, name="lump")
    scene.add_drag(0.1, name="air")
    simulation = scene.build()
    fresh = scene.build()
    simulation.step(3)
    simulation.set(arm, youngs_modulus=2e6, natural_curvature=(0.0, 1.0))
    simulation.set(load, force=lambda t: (0, 0, t))
    simulation.set("lump", mass=1.0)
    simulation.set("air", drag=3.0)
    simulation.set(gravity=(0, 0, 1))
    simulation.release("wall")
    grip = simulation.pin(arm.end)
    simulation.move(grip, position=(0.2, 0.0, 0.1), over=0.1)
    simulation.step(3)
    simulation.reset()
    assert simulation.get(arm, "youngs_modulus") == 1e6
    assert simulation.get("lump", "mass") == 0.001
    assert np.array_equal(simulation.get("gravity"), (0, 0, -9.81))
    with pytest.raises(ValueError, match="no longer in the scene"):
        simulation.reaction(grip)
    simulation.step(5)
    fresh.step(5)
    assert np.array_equal(simulation.positions(), fresh.positions())
    assert np.array_equal(simulation.velocities(), fresh.velocities())


def test_a_snapshot_brings_back_supports_parameters_and_moves(tmp_path):
    _, arm, simulation = cantilever(planar=False)
    simulation.release("wall")
    grip = simulation.clamp(arm.end, name="grip")
    simulation.move(grip, position=(0.2, 0, 0.05), roll=9.0, over=0.1)
    simulation.set(arm, density=2000.0)
    simulation.step(5)
    simulation.snapshot().save(tmp_path / "s.npz")
    _, _, other = cantilever(planar=False)
    other.restore(withe.Snapshot.load(tmp_path / "s.npz"))
    assert other.get(arm.name, "density") == 2000.0
    simulation.step(20)
    other.step(20)
    assert same_state(simulation, other)
    assert np.allclose(other.reaction("grip").force, simulation.reaction(grip).force)
    with pytest.raises(ValueError, match="released"):
        other.reaction("wall")
    other.clamp("arm.start", name="again")


def test_functions_of_time_must_be_there_when_a_snapshot_from_a_file_needs_them(tmp_path):
    _, arm, simulation = cantilever(planar=False)
    simulation.move(arm.start, path=lambda t: (0, 0, t))
    simulation.step(3)
    state = simulation.snapshot()
    state.save(tmp_path / "s.npz")
    loaded = withe.Snapshot.load(tmp_path / "s.npz")
    _, _, other = cantilever(planar=False)
    with pytest.raises(ValueError, match="do not store functions of time: set the function of 'wall'"):
        other.restore(loaded)
    other.move(arm.name + ".start", path=lambda t: (0, 0, t))
    other.restore(loaded)
    simulation.step(3)
    other.step(3)
    assert same_state(simulation, other)
    simulation.restore(state)  # in memory the function is part of it
    simulation.step(3)
    assert same_state(simulation, other)


def test_a_load_function_of_the_scene_serves_snapshots_from_files(tmp_path):
    def build():
        scene = withe.Scene()
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=6, radius=5e-3,
                            material=withe.Material(youngs_modulus=1e6, density=1e3))  # fmt: skip
        scene.clamp(arm.start)
        scene.add_force(arm.end, lambda t: (0, np.sin(50 * t), 0))
        return scene.build()

    one, two = build(), build()
    one.step(4)
    one.snapshot().save(tmp_path / "s.npz")
    two.restore(withe.Snapshot.load(tmp_path / "s.npz"))
    one.step(4)
    two.step(4)
    assert same_state(one, two)


def test_a_snapshot_of_another_scene_is_refused():
    _, _, arm = cantilever()
    _, _, limbs = tripod()
    _, _, finer = cantilever(nodes=12)
    for other in (limbs, finer):
        before = arm.snapshot()
        with pytest.raises(ValueError, match="another scene"):
            arm.restore(other.snapshot())
        assert arm.snapshot() == before
    with pytest.raises(ValueError, match=r"must be a withe.Snapshot or a withe.Record, got bytes"):
        arm.restore(b"")


def test_the_same_scene_runs_the_same_bits_twice():
    runs = []
    for _ in range(2):
        _, _, simulation = tripod()
        simulation.step(50)
        runs.append(simulation)
    assert same_state(*runs)


@pytest.mark.parametrize("place", range(0, 4000, 37))
def test_a_damaged_snapshot_file_is_a_value_error_or_the_same_state(place, tmp_path):
    _, _, simulation = cantilever(nodes=3)
    path = simulation.snapshot().save(tmp_path / "s.npz")
    data = bytearray(path.read_bytes())
    data[place % len(data)] ^= 0xFF
    path.write_bytes(data)
    try:
        state = withe.Snapshot.load(path)
        simulation.restore(state)
        simulation.step(1)
    except (ValueError, withe.ConvergenceError):
        return
    assert np.isfinite(simulation.positions()).all()


@pytest.mark.parametrize("length", [0, 1, 8, 100, 500])
def test_damaged_engine_bytes_are_refused(length):
    _, _, simulation = cantilever(nodes=3)
    good = simulation.snapshot()
    bad = withe.Snapshot(good._state[:length], good.time, good._settings)
    with pytest.raises(ValueError, match="snapshot"):
        simulation.restore(bad)
    assert simulation.snapshot() == good


def test_a_record_is_no_snapshot(tmp_path):
    _, _, simulation = cantilever(nodes=3)
    simulation.run(0.01, progress=False).save(tmp_path / "r.npz")
    with pytest.raises(ValueError, match="expected a withe snapshot"):
        withe.Snapshot.load(tmp_path / "r.npz")


def rising(t):
    return (0, 0, 0.1 * t)


def test_a_simulation_pickles_with_functions_that_pickle(tmp_path):
    scene, arm, _ = cantilever(planar=False)
    scene.add_force(arm.end, (0, 0, 0))
    simulation = scene.build(planar=False)
    simulation.set("force 1", force=rising)
    simulation.move("wall", path=rising)
    simulation.step(3)
    again = pickle.loads(pickle.dumps(simulation))
    simulation.step(3)
    again.step(3)
    assert same_state(simulation, again)


def test_a_snapshot_pickles_also_with_functions_that_do_not():
    _, _, simulation = cantilever(planar=False)
    simulation.move("wall", path=lambda t: (0, 0, 0.1 * t))
    simulation.step(3)
    state = pickle.loads(pickle.dumps(simulation.snapshot()))
    assert state == simulation.snapshot()
    simulation.restore(state)
    simulation.step(3)


def test_a_snapshot_without_friction_starts_a_scene_that_has_some():
    """A scene is brought to rest without friction, and goes on with that of its own drawing."""

    rubber = withe.Material(youngs_modulus=1e6, density=1e3)

    def sled(friction, **options):
        scene = withe.Scene()
        rod = scene.add_rod(start=(0, 0, 5e-3), end=(0.2, 0, 5e-3), nodes=6, radius=5e-3, material=rubber)
        scene.add_floor(friction=friction)
        return rod, scene.build(integrator="backward_euler", time_step=2e-3, **options)

    _, smooth = sled(0.0)
    smooth.step(50)
    rod, rough = sled(0.5)
    rough.restore(smooth.snapshot())
    assert rough.get("floor 1", "friction") == 0.5
    rough.set_velocities(rod, np.tile((0.1, 0.0, 0.0), (6, 1)))
    rough.run(0.1)
    assert np.abs(rough.velocities(rod)).max() < 1e-3
    # A snapshot contains the values that were set before it, and restoring it resets later ones.
    before = rough.snapshot()
    rough.set("floor 1", friction=0.2)
    after = rough.snapshot()
    rough.restore(before)
    assert rough.get("floor 1", "friction") == 0.5
    rough.restore(after)
    assert rough.get("floor 1", "friction") == 0.2


def pinned_pair():
    """Without gravity, so that twist decays until steps find next to nothing to solve."""
    scene = withe.Scene(gravity=(0, 0, 0))
    soft = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0, viscosity=100.0)
    stiff = withe.Material(youngs_modulus=3e6, poisson_ratio=0.3, density=800.0)
    a = scene.add_rod(start=(0, 0, 0.1), end=(0.2, 0, 0.1), nodes=8, radius=4e-3, material=soft, normal=(0, 0, 1))
    b = scene.add_rod(start=(0.2, 0, 0.1), end=(0.2, 0.1, 0.2), nodes=6, radius=3e-3, material=stiff)
    scene.join(a.end, b.start, "pinned")
    scene.clamp(a.start, hold="edge")
    scene.pin(b.end)
    scene.add_drag(0.05, name="drag")
    scene.add_floor(0.09, friction=0.3)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    simulation.set(b, natural_twist=4.0)
    return simulation


def test_a_copy_takes_the_same_step_after_any_step():
    simulation = pinned_pair()
    for drag in (0.05, 0.13, 0.05):
        simulation.set("drag", drag=drag)
        for _ in range(8):
            copy_of_it = simulation.copy()
            copy_of_it.step()
            simulation.step()
            assert copy_of_it.positions().tobytes() == simulation.positions().tobytes()
            assert copy_of_it.velocities().tobytes() == simulation.velocities().tobytes()
