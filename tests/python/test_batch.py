"""Many simulations in one call: the same bits as one by one, for any number of threads."""

import os
import pickle
import signal
import time

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, ctrl_c_once, same_state, steps_elsewhere, tripod

LANES = 4


def bends(step: int, count: int = LANES) -> np.ndarray:
    """Curvatures of every lane and stencil, different at each step [1/m]."""
    return 3.0 * np.random.default_rng(step).uniform(-1, 1, (count, 9, 2))


def arms(workers: int = 2, count: int = LANES, **build) -> withe.Batch:
    return cantilever(planar=False)[0].build_batch(count, planar=False, workers=workers, **build)


def lone(**build) -> list[withe.Simulation]:
    return [cantilever(planar=False, **build)[2] for _ in range(LANES)]


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_a_batch_has_the_bits_of_single_simulations_after_many_steps(workers):
    batch, singles = arms(workers), lone()
    for simulation, modulus in zip(singles, [0.7e6, 0.9e6, 1.1e6, 1.3e6], strict=True):
        simulation.set("arm", youngs_modulus=modulus)
    batch.set("arm", youngs_modulus=[0.7e6, 0.9e6, 1.1e6, 1.3e6])
    for step in range(100):
        batch.set("arm", natural_curvature=bends(step), over=0.05)
        for simulation, bend in zip(singles, bends(step), strict=True):
            simulation.set("arm", natural_curvature=bend, over=0.05)
            simulation.step(10)
        batch.step(10)
    for simulation, other in zip(singles, batch, strict=True):
        assert same_state(simulation, other)
        assert simulation.time == pytest.approx(5.0)


def test_read_outs_have_one_more_axis_and_go_into_arrays_of_the_user():
    batch = arms()
    batch.set("arm", natural_curvature=bends(0))
    batch.set("arm", natural_twist=np.linspace(-1, 1, LANES), over=0.02)
    batch.step(7)
    for word in ("positions", "velocities", "directors", "curvatures", "twists", "tensions", "spins"):
        found = getattr(batch, word)("arm")
        np.testing.assert_array_equal(found, [getattr(simulation, word)("arm") for simulation in batch])
        out = np.empty_like(found)
        assert getattr(batch, word)("arm", out=out) is out
        np.testing.assert_array_equal(out, found)
    np.testing.assert_array_equal(batch.positions(), [simulation.positions() for simulation in batch])
    np.testing.assert_array_equal(batch.time, [simulation.time for simulation in batch])
    np.testing.assert_array_equal(batch.energy().total, [simulation.energy().total for simulation in batch])
    np.testing.assert_array_equal(batch.reaction("wall").force, [s.reaction("wall").force for s in batch])
    np.testing.assert_array_equal(batch.get("arm", "natural_twist"), [s.get("arm", "natural_twist") for s in batch])
    assert batch.statistics.steps.tolist() == [7] * LANES
    assert batch.contacts()[0].shape == (0,)


def test_nodes_of_joined_rods_are_those_of_the_simulation():
    scene, rods, simulation = tripod()
    batch = scene.build_batch(2)
    batch.step(3)
    simulation.step(3)
    for rod in rods:
        np.testing.assert_array_equal(batch.positions(rod)[1], simulation.positions(rod))


def test_some_are_stepped_set_and_reset_by_number_or_mask():
    batch = arms()
    batch.step(4)
    batch.step(2, lanes=[0, -1])
    batch.step(1, lanes=[True, False, True, False])
    np.testing.assert_allclose(batch.time, [0.035, 0.02, 0.025, 0.03])
    batch.set("arm", natural_stretch=[1.01], lanes=[2])
    assert batch.get("arm", "natural_stretch")[:, 0].tolist() == [1.0, 1.0, 1.01, 1.0]
    batch.reset([False, True, True, False])
    np.testing.assert_allclose(batch.time, [0.035, 0.0, 0.0, 0.03])
    assert batch.get("arm", "natural_stretch")[:, 0].tolist() == [1.0] * LANES
    assert same_state(batch[1], batch[2])
    batch.step(0)
    batch.step(1, lanes=[])
    np.testing.assert_allclose(batch.time, [0.035, 0.0, 0.0, 0.03])


def test_snapshots_bring_back_every_bit():
    batch = arms()
    batch.set("arm", natural_curvature=bends(1), over=0.1)
    batch.step(5)
    before, twin = batch.snapshot(), batch.copy()
    batch.step(5)
    batch.restore(before)
    for wanted, found in zip(twin, batch, strict=True):
        assert same_state(wanted, found)
    batch.restore(before[3], lanes=[0])
    assert same_state(batch[0], twin[3])
    other = pickle.loads(pickle.dumps(batch))
    assert other.workers == 2
    assert same_state(other[2], batch[2])


def test_supports_move_each_to_a_place_of_its_own():
    batch = arms()
    places = np.linspace((0, 0, 0.01), (0, 0.02, 0.03), LANES)
    batch.move("wall", places, over=0.02)
    batch.step(4)
    np.testing.assert_allclose(batch.positions("arm")[:, 0], places, atol=1e-12)


@pytest.mark.parametrize("rolls", [0.7, [0.2, -0.4, 2.0, 7.0]])
def test_supports_roll_as_those_of_single_simulations_do(rolls):
    batch, singles = arms(), lone()
    tangents = np.linspace((1, 0, 0.1), (1, 0.3, -0.2), LANES)
    batch.move("wall", roll=rolls, over=0.05)
    batch.move("wall", tangent=tangents[2:], over=0.03, lanes=[2, 3])
    batch.step(3)
    batch.move("wall", roll=0.1, over=0.1, lanes=[True, False, False, False])
    batch.step(9)
    for lane, (single, roll) in enumerate(zip(singles, np.broadcast_to(rolls, LANES), strict=True)):
        single.move("wall", roll=float(roll), over=0.05)
        if lane >= 2:
            single.move("wall", tangent=tangents[lane], over=0.03)
        single.step(3)
        if lane == 0:
            single.move("wall", roll=0.1, over=0.1)
        single.step(9)
        assert same_state(single, batch[lane])
    frames = batch.directors("arm")[:, 0]
    assert np.abs(frames[0] - frames[1:]).max(axis=(1, 2)).min() > 0.02  # each where it was told


def test_obstacles_turn_each_by_a_roll_of_its_own():
    def on_a_drum():
        scene = withe.Scene()
        scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=9, radius=5e-3, material=RUBBER, name="arm")
        scene.add_capsule((0.1, -0.1, -0.0251), (0.1, 0.1, -0.0251), 0.02, friction=0.5, name="drum")
        scene.add_sphere((0.1, 0, 0.0251), 0.02, friction=0.5, name="ball")
        return scene.build()

    batch, singles = withe.Batch([on_a_drum() for _ in range(3)], workers=2), [on_a_drum() for _ in range(3)]
    rolls, axes = [0.0, 1.0, -2.0], [(0, 1, 0), (0, 1, 0.1), (0.2, 1, 0)]
    batch.move("drum", roll=rolls, over=0.1)
    batch.move("ball", roll=-1.0, tangent=axes, over=0.1)
    batch.step(10)
    for single, other, roll, axis in zip(singles, batch, rolls, axes, strict=True):
        single.move("drum", roll=roll, over=0.1)
        single.move("ball", roll=-1.0, tangent=axis, over=0.1)
        single.step(10)
        assert same_state(single, other)
    assert np.ptp(batch.positions("arm")[:, :, 0].mean(axis=1)) > 1e-3


def folded() -> np.ndarray:
    """Bends to and fro that no step of 5 ms reaches in 6 iterations."""
    return np.where(np.arange(9) % 2, 100.0, -100.0)[:, None] * np.ones(2)


def test_one_that_fails_stays_where_it_was_and_holds_up_nobody():
    batch = arms(adaptive=False, solver=withe.Solver(max_iterations=6))
    singles = lone(adaptive=False, solver=withe.Solver(max_iterations=6))
    batch.step(3)
    before = batch.snapshot([1])
    batch.set("arm", natural_curvature=[folded()], lanes=[1])
    for _ in range(3):
        batch.step()
    assert batch.failed.tolist() == [False, True, False, False]
    assert isinstance(batch.failures[1], withe.ConvergenceError)
    assert batch.failures[1].rod == "arm"
    np.testing.assert_allclose(batch.time, [0.03, 0.015, 0.03, 0.03])
    for index in (0, 2, 3):
        singles[index].step(6)
        assert same_state(singles[index], batch[index])
    batch.restore(before, lanes=[1])
    assert not batch.failed.any()
    batch.step(3, lanes=[1])
    assert same_state(batch[1], singles[0])


def test_snapshots_of_which_one_does_not_fit_change_no_simulation():
    def build(height, balls=1):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        scene.add_rod(start=(0, 0, height), end=(0.2, 0, height), nodes=9, radius=3e-3, material=rubber, name="arm")
        for ball in range(balls):
            scene.add_sphere((0, 0, -1.0 - ball), 0.1)
        return scene.build()

    batch = withe.Batch([build(0.0), build(0.0)], workers=1)
    batch.step(2)
    before = batch.snapshot()
    batch.set("arm", youngs_modulus=[4e6, 4e6])
    batch.step(2)
    positions = batch.positions("arm")
    for foreign in (build(0.1).snapshot(), build(0.0, balls=2).snapshot()):
        with pytest.raises(ValueError, match="snapshot belongs to another scene"):
            batch.restore([before[0], foreign])
        assert batch.time.tolist() == [0.02, 0.02]
        np.testing.assert_array_equal(batch.positions("arm"), positions)
        for simulation in batch:
            np.testing.assert_array_equal(simulation.get("arm", "youngs_modulus"), 4e6)
    batch.restore(pickle.loads(pickle.dumps(before[1])))
    np.testing.assert_array_equal(batch.time, 0.01)
    np.testing.assert_array_equal(batch[0].get("arm", "youngs_modulus"), 1e6)


@pytest.mark.parametrize("way", ["snapshot", "record", "reset"])
def test_one_that_failed_goes_on_when_it_is_restored_by_itself(way):
    batch = arms(adaptive=False, solver=withe.Solver(max_iterations=6))
    batch.step(3)
    before, record = batch[1].snapshot(), batch[1].copy().run(duration=0.005, progress=False)
    for _ in range(2):
        batch.set("arm", natural_curvature=[folded()], lanes=[1])
        batch.step()
        assert batch.failed.tolist() == [False, True, False, False]
        batch.step(2)
        batch[1].set("arm", natural_curvature=(0, 0))
        batch.step(2)
        assert batch.failed[1]
        batch[1].reset() if way == "reset" else batch[1].restore(before if way == "snapshot" else record, frame=0)
        assert batch.failures == (None,) * LANES
        assert not batch.failed.any()
        start = batch.time[1]
        batch.step(4)
        assert batch.time[1] == pytest.approx(start + 0.02)


def test_simulations_may_differ_in_numbers_but_not_in_shape():
    def falling(radius, nodes=9, height=-0.05):
        scene = withe.Scene()
        scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=radius, material=RUBBER, name="arm")
        scene.add_floor(height)
        return scene.build()

    batch = withe.Batch([falling(4e-3), falling(6e-3), falling(5e-3, height=-0.02)])
    twins = [falling(4e-3), falling(6e-3), falling(5e-3, height=-0.02)]
    batch.step(30)
    for twin, simulation in zip(twins, batch, strict=True):
        twin.step(30)
        assert same_state(twin, simulation)
    batch[0] = falling(5e-3)
    assert batch.time.tolist()[0] == 0.0
    with pytest.raises(ValueError, match="9 nodes of rod 'arm' there, 10 here"):
        batch[0] = falling(5e-3, nodes=10)
    with pytest.raises(ValueError, match="got one twice"):
        batch[0] = batch[1]


def test_functions_of_python_are_called_and_what_they_throw_comes_out():
    def pushed(force):
        scene = withe.Scene()
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=9, radius=5e-3, material=RUBBER, name="arm")
        scene.clamp(arm.start)
        scene.add_force(arm.end, lambda t: (0, 0, force * t), name="push")
        scene.add_custom_force(lambda time, x, v: np.full_like(x, 1e-3 * force))
        return scene.build()

    batch, twins = withe.Batch([pushed(0.1 * i) for i in range(4)]), [pushed(0.1 * i) for i in range(4)]
    batch.step(10)
    for twin, simulation in zip(twins, batch, strict=True):
        twin.step(10)
        assert same_state(twin, simulation)

    def broken(time):
        if time > 0.051:
            raise KeyError("broken")
        return 0, 0, 0

    batch[2].set("push", force=broken)
    with pytest.raises(KeyError, match="broken"):
        batch.step()
    batch[2].set("push", force=(0, 0, 0))
    batch.step()


@pytest.mark.parametrize("workers", [1, 3])
def test_ctrl_c_ends_a_step_and_leaves_all_usable(workers):
    batch = arms(workers)
    batch.step()
    with pytest.raises(KeyboardInterrupt), ctrl_c_once(lambda: steps_elsewhere(batch[0])):
        batch.step(100_000_000)
    assert batch.time.max() > 0.0
    batch.step()
    assert not batch.failed.any()


def test_a_forked_process_has_threads_of_its_own():
    batch = arms(3)
    batch.step(2)
    child = os.fork()
    if child == 0:
        batch.step(2)
        os._exit(0 if np.allclose(batch.time, 0.02) else 1)
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            assert status == 0
            return
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    pytest.fail("the forked process hangs")


BAD = [
    (lambda b: b.step(1.5), "number of steps must be a whole number, got 1.5"),
    (lambda b: b.step(-1), "number of steps must lie in 0.."),
    (lambda b: b.step(1, lanes=[True, False]), r"lanes must have shape (4,) as a mask, got (2,)"),
    (lambda b: b.step(1, lanes=[4]), "lanes must lie in -4..3, got 4"),
    (lambda b: b.step(1, lanes=[1, -3]), "lanes must be different numbers of simulations, got [1, -3]"),
    (
        lambda b: b.reset([0, 1, 0, 0]),
        "mask must be different numbers of simulations, got [0, 1, 0, 0]: a mask must hold booleans",
    ),
    (lambda b: b.step(1, lanes=[0.5]), "lanes must be a mask of shape (4,), or numbers of simulations, got [0.5]"),
    (lambda b: b.reset([True] * 5), "mask must have shape (4,) as a mask, got (5,)"),
    (lambda b: b.positions("leg"), "rod 'leg' is not in the scene, which has 'arm', 'wall'"),
    (lambda b: b.positions(out=np.empty((4, 11, 2))), "out must be a float64 array of shape (4, 11, 3), got float64"),
    (lambda b: b.positions(out=np.empty((4, 11, 3), np.float32)), "out must be a float64 array of shape (4, 11, 3)"),
    (lambda b: b.positions(out=np.empty((3, 11, 4)).T), "out must be contiguous (order C) and writeable"),
    (lambda b: b.positions(out=[1.0]), "out must be a float64 array of shape (4, 11, 3), got list"),
    (lambda b: b.set("arm", natural_curvature=(0, 1)), "natural_curvature of rod 'arm' must have shape (4, 2) or"),
    (
        lambda b: b.set("arm", natural_curvature=np.full((4, 2), np.nan)),
        "natural_curvature of rod 'arm' must be finite",
    ),
    (lambda b: b.set("arm", natural_curvature=np.full((4, 2), 900.0)), "must turn the rod by less than pi at every"),
    (lambda b: b.set("arm", natural_curvature=np.ones((4, 2)), over=-1), "over must not be negative, got -1"),
    (lambda b: b.set("arm", natural_twist=[1, 2, 3]), "natural_twist of rod 'arm' must have shape (4,) or (4, 9)"),
    (lambda b: b.set("arm", natural_stretch=[1, 1, 0, 1]), "natural_stretch of rod 'arm' must be positive, got 0"),
    (lambda b: b.set("arm", youngs_modulus=[1e6]), "youngs_modulus must have a row for each of 4 simulations, got 1"),
    (lambda b: b.move("wall", [(0, 0, 0)]), "position must have shape (4, 3), got (1, 3)"),
    (lambda b: b.move("wall", roll=[0.1, 0.2]), "roll must have shape (4,), got (2,)"),
    (lambda b: b.move("wall", roll=[0.1, 0.2], lanes=[1, 2, 3]), "roll must have shape (3,), got (2,)"),
    (lambda b: b.move("wall", roll=[0, 0, np.nan, 0]), "roll must be finite, got nan at [2]"),
    (lambda b: b.move("wall", roll=4.0), "roll of support 'wall' must be at most half a turn per time step"),
    (lambda b: b.move("wall", tangent=(1, 0, 0)), "tangent must have shape (4, 3), got (3,)"),
    (lambda b: b.restore(b.snapshot()[:2]), "snapshots must be one for each of 4 simulations, got 2"),
    (lambda b: b.restore([1, 2, 3, 4]), "snapshots must be withe.Snapshot, got int at [0]"),
    (lambda b: b.__setitem__(0, 3), "simulation must be a withe.Simulation, got int"),
    (lambda b: withe.Batch([]), "a batch needs one simulation at least"),
    (lambda b: withe.Batch(3), "simulations must be a list, got int"),
    (lambda b: withe.Batch([3]), "simulations must be withe.Simulation, got int at [0]"),
    (lambda b: withe.Batch([b[0], b[0]]), "got one twice"),
    (lambda b: withe.Batch([b[0]], workers=0), "workers must lie in 1..4096, got 0"),
    (lambda b: withe.Batch([b[0], tripod()[2]]), "must have the shape of the first"),
    (lambda b: withe.Batch([b[0], cantilever(time_step=1e-3)[2]]), "time_step"),
]


@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_input_is_a_value_error_that_says_what_was_expected(call, message):
    batch = arms()
    with pytest.raises(ValueError) as error:  # noqa: PT011
        call(batch)
    assert message in str(error.value)
    batch.step()


@pytest.mark.parametrize(("count", "workers"), [(0, None), (2.5, None), (2, 0)])
def test_a_batch_of_none_or_without_workers_is_refused(count, workers):
    with pytest.raises(ValueError, match=r"must"):
        cantilever()[0].build_batch(count, workers=workers)


def test_discrete_curvatures_mean_the_angles_of_each_simulations_own_nodes():
    simulations = []
    for length in (0.2, 0.5):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=11, radius=5e-3, material=rubber, name="arm")
        simulations.append(scene.build(time_step=5e-3))
    batch = withe.Batch(simulations, workers=1)
    batch.set("arm", discrete_curvature=[(0.0, 0.2), (0.0, 0.2)])
    for simulation, voronoi in zip(simulations, (0.02, 0.05), strict=True):
        natural = simulation.get("arm", "natural_curvature")
        np.testing.assert_allclose(natural[:, 1] * voronoi, 2.0 * np.arctan(0.1), rtol=1e-12)
    with pytest.raises(ValueError, match="less than pi at every node"):
        batch.set("arm", natural_curvature=[(0.0, 0.0), (0.0, 80.0)])
    assert simulations[0].get("arm", "natural_curvature")[0, 1] > 0.0


def stiffened(count, **options):
    """Cantilevers of unlike stiffness: batch, handle."""
    scene, arm, _ = cantilever()
    batch = scene.build_batch(count, workers=2, **options)
    batch.set(arm, youngs_modulus=np.linspace(0.7e6, 2e6, count))
    return batch, arm


def test_a_run_of_a_batch_is_that_of_each_simulation():
    batch, arm = stiffened(3, time_step=2e-3)
    alone = batch.copy()
    tip = {"tip": lambda b: b.positions(arm)[:, -1]}
    run = batch.run(0.03, record_every=6e-3, progress=False, record=tip)
    assert len(run) == 3
    assert run.positions(arm).shape == (3, 6, 11, 3)
    assert np.array_equal(run["tip"], run.positions(arm)[:, :, -1])
    for i, simulation in enumerate(alone):
        record = simulation.run(0.03, record_every=6e-3, progress=False)
        assert np.array_equal(record.positions(), run[i].positions())
        assert np.array_equal(record.times, run.times[i])
        for what in ("directors", "curvatures", "twists", "tensions", "spins", "velocities"):
            assert np.array_equal(getattr(record, what)(arm), getattr(run, what)(arm)[i])
        assert np.array_equal(batch[i].record.positions(), record.positions())
        assert batch[i].time == simulation.time


def test_a_run_of_a_batch_calls_back_with_the_batch_and_ends_each_by_itself():
    batch, arm = stiffened(4, time_step=2e-3)
    calls = []
    limit = -0.02

    def fallen(b):
        return b.positions(arm)[:, -1, 2] < limit

    run = batch.run(0.4, 2e-3, progress=False, before_step=lambda b: calls.append(b is batch), until=fallen)
    frames = [len(record) for record in run]
    assert all(calls)
    assert len(calls) == max(frames) - 1
    assert len(set(frames)) > 1
    for record in run:
        tips = record.positions(arm)[:, -1, 2]
        assert tips[-1] < limit
        assert (tips[:-1] >= limit).all()
    with pytest.raises(ValueError, match="must have equally many frames"):
        run.positions(arm)
    with pytest.raises(ValueError, match=r"until must return one boolean or an array of shape \(4,\)"):
        batch.run(0.01, progress=False, until=lambda b: [True])
    for wrong in ({"duration": 0.003}, {"duration": 0.004, "record_every": 0.003}):
        with pytest.raises(ValueError, match=r"of a batch must be a whole number of time steps of 0\.002 s"):
            batch.run(progress=False, **wrong)
    with pytest.raises(RuntimeError, match="step cannot be called while the simulation runs"):
        batch.run(0.004, progress=False, before_step=lambda b: b.step())
    assert len(batch.run(0.004, progress=False, lanes=[2, 0])) == 2


def test_equilibria_of_a_batch_are_those_of_each_simulation():
    batch, arm = stiffened(5, integrator="static")
    alone = batch.copy()
    batch[3].release("wall")  # it falls for ever
    found = batch.equilibrium()
    assert found.stable.tolist() == [True, True, True, False, True]
    assert [failure is None for failure in found.failures] == found.stable.tolist()
    assert np.isnan(found.residual).tolist() == [False, False, False, True, False]
    with pytest.raises(withe.ConvergenceError, match="no support holds the scene"):
        _ = found[3]
    for i, simulation in enumerate(alone):
        if i != 3:
            single = simulation.equilibrium()
            assert single.iterations == found.iterations[i] == found[i].iterations
            assert np.array_equal(simulation.positions(), batch[i].positions())
    (gradient,) = found[0].gradient(np.ones((11, 3)), [(arm, "youngs_modulus")])
    assert np.isfinite(gradient)
    assert len(batch.equilibrium(lanes=[0, 4])) == 2
