"""Runs: frames on their times, callbacks, progress, interruption; many simulations side by side."""

import sys
import threading
import time
import warnings

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, ctrl_c_once, same_state, steps_elsewhere, tripod


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "static", "backward_euler"])
@pytest.mark.parametrize("every", [0.02, 0.005, 0.01])
def test_frames_land_exactly_on_their_times(integrator, every):
    _, _, simulation = cantilever(integrator=integrator)
    record = simulation.run(0.1, record_every=every, progress=False)
    assert np.array_equal(record.times, np.arange(round(0.1 / every) + 1) * every)
    _, _, stepped = cantilever(integrator=integrator)
    stepped.step(20)
    assert np.array_equal(record.positions()[-1], stepped.positions())
    assert same_state(simulation, stepped)


def test_frames_between_time_steps_shorten_the_steps_evenly():
    _, _, simulation = cantilever(time_step=0.01)
    times = []
    record = simulation.run(0.1, record_every=0.025, before_step=lambda s: times.append(s.time), progress=False)
    assert np.array_equal(record.times, [0.0, 0.025, 0.05, 0.025 * 3, 0.1])
    assert np.allclose(np.diff(times), 0.025 / 3)
    _, _, plain = cantilever(time_step=0.01)
    plain.run(0.1, record_every=0.025, progress=False)
    assert same_state(simulation, plain)


def test_a_second_run_goes_on_where_the_first_ended():
    _, _, simulation = cantilever()
    simulation.run(0.1, record_every=0.02, progress=False)
    record = simulation.run(0.1, record_every=0.02, progress=False)
    assert record.times[0] == pytest.approx(0.1)
    assert record.times[-1] == pytest.approx(0.2)
    assert len(record) == 6


@pytest.mark.parametrize(
    ("duration", "every", "frames"), [(0.1, None, 21), (2.0, None, 101), (0.1, np.inf, 2), (0.1, 0.03, 5)]
)
def test_frames_by_default_and_at_the_end(duration, every, frames):
    _, _, simulation = cantilever(nodes=4)
    record = simulation.run(duration, record_every=every, progress=False)
    assert len(record) == frames
    assert record.times[-1] == duration


def test_before_step_is_called_once_a_time_step():
    _, arm, simulation = cantilever()
    calls = []

    def controller(s):
        assert s is simulation
        calls.append(s.time)
        s.set(arm, natural_curvature=(0.0, 100 * np.sin(20 * s.time)))

    record = simulation.run(0.1, record_every=0.05, before_step=controller, progress=False)
    assert np.allclose(calls, 0.005 * np.arange(20))
    assert simulation.statistics.steps >= 20
    assert np.ptp(record.curvatures(arm)) > 0.1


def test_steps_are_no_longer_than_a_callback_says():
    _, _, simulation = cantilever(time_step=0.01)
    begun = []

    def longest(s):
        begun.append(s.time)
        return 0.002 if 0.03 <= s.time < 0.05 else 1.0

    record = simulation.run(0.1, record_every=0.025, longest_step=longest, progress=False)
    assert np.array_equal(record.times, [0.0, 0.025, 0.05, 0.025 * 3, 0.1])
    # 10, 10, 5 ms to the first frame, 10 to 35 ms, 2 from there to the next, and then again 10, 10, 5.
    expected = [*range(0, 21, 10), 25, *range(35, 50, 2), 50, 60, 70, 75, 85, 95]
    assert np.allclose(begun, 1e-3 * np.array(expected))
    with pytest.raises(ValueError, match="longest_step must be positive"):
        simulation.run(0.1, longest_step=lambda s: 0.0, progress=False)
    with pytest.raises(ValueError, match="longest_step must be a function"):
        simulation.run(0.1, longest_step=0.01, progress=False)


def test_until_ends_the_run_after_the_step_that_fulfils_it():
    _, arm, simulation = cantilever()
    record = simulation.run(10.0, record_every=0.02, until=lambda s: s.positions(arm)[-1, 2] < -0.02, progress=False)
    tips = record.positions(arm)[:, -1, 2]
    assert tips[-1] < -0.02
    assert np.all(tips[:-1] >= -0.02)
    assert simulation.time == record.times[-1] < 0.5


def test_record_takes_more_than_the_readouts():
    _, arm, simulation = cantilever()
    record = simulation.run(
        0.05,
        record_every=0.01,
        record={"grip": lambda s: s.reaction(arm.start).force, "t": lambda s: s.time},
        progress=False,
    )
    assert record["grip"].shape == (6, 3)
    assert np.array_equal(record["t"], record.times)
    assert record.positions(arm).shape == (6, 11, 3)
    assert record.directors("arm").shape == (6, 10, 3, 3)


@pytest.mark.parametrize("place", ["before_step", "until", "record", "force"])
def test_what_was_recorded_survives_an_exception(place):
    scene, arm, simulation = cantilever()

    def fail(*_):
        if simulation.time > 0.031:
            raise ArithmeticError("enough")
        return (0, 0, 0) if place == "force" else 0

    options = {"record": {"x": fail}} if place == "record" else {} if place == "force" else {place: fail}
    if place == "force":
        scene.add_force(arm.end, fail)
        simulation = scene.build()
    with pytest.raises(ArithmeticError, match="enough"):
        simulation.run(1.0, record_every=0.01, progress=False, **options)
    assert np.allclose(simulation.record.times, [0, 0.01, 0.02, 0.03])
    if place != "force":
        simulation.step()


def test_there_is_no_record_before_a_run():
    _, _, simulation = cantilever()
    with pytest.raises(RuntimeError, match="call run first"):
        _ = simulation.record


def test_progress_counts_up_to_the_duration(capsys, monkeypatch):
    _, _, simulation = cantilever(nodes=4)
    with monkeypatch.context() as on_a_terminal:
        on_a_terminal.setattr(sys.stderr, "isatty", lambda: True)
        simulation.run(0.5, progress=True)
    assert "0.5" in capsys.readouterr().err
    simulation.run(0.5)
    assert capsys.readouterr().err == ""


def test_ctrl_c_ends_a_long_step():
    _, _, simulation = cantilever(nodes=201, planar=False)
    simulation.step()
    with pytest.raises(KeyboardInterrupt), ctrl_c_once(lambda: steps_elsewhere(simulation)):
        simulation.step(10**9)
    assert simulation.time > 0.0
    simulation.step()


def test_ctrl_c_ends_a_run_with_the_record_kept():
    _, _, simulation = cantilever(nodes=201, planar=False)
    frames = []
    with pytest.raises(KeyboardInterrupt), ctrl_c_once(lambda: len(frames) > 2):
        simulation.run(
            1e4, record_every=0.01, record={"time": lambda s: frames.append(s.time) or s.time}, progress=False
        )
    assert len(simulation.record) > 2
    simulation.step()


@pytest.mark.filterwarnings("ignore:.*has not begun to go where over= leads it")
@pytest.mark.parametrize("act", ["equilibrium", "step"])
def test_ctrl_c_ends_a_static_solve_and_leaves_the_last_accepted_state(act):
    """The bend is too much for one solve of so fine a mesh: it would go on for minutes."""
    solving = threading.Event()

    def no_force(time, positions, velocities):  # asked when the solve begins
        solving.set()
        return np.zeros_like(positions)

    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=3001, radius=5e-3, material=RUBBER)
    scene.clamp(arm.start)
    scene.add_custom_force(no_force)
    simulation = scene.build(integrator="static", time_step=0.1, planar=False)
    simulation.set(arm, natural_curvature=(3.0, 2.0), over=0.2)
    before = simulation.positions()
    with pytest.raises(KeyboardInterrupt), ctrl_c_once(solving.is_set):
        getattr(simulation, act)()
    assert np.array_equal(simulation.positions(), before)
    assert simulation.time == 0.0


def test_other_threads_run_while_a_simulation_steps():
    _, _, simulation = cantilever(nodes=201, planar=False)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    simulation.step(400)
    end = time.monotonic()
    stop.set()
    thread.join()
    inside = [t for t in ticks if begin < t < end]
    assert len(inside) > 5


def test_a_simulation_that_steps_in_another_thread_refuses_to_be_read():
    _, _, simulation = cantilever(nodes=201, planar=False)
    outcomes = set()
    thread = threading.Thread(target=simulation.step, args=(200,))
    thread.start()
    while thread.is_alive():
        for act in (simulation.positions, simulation.step, simulation.snapshot, simulation.energy):
            try:
                act()
            except RuntimeError as error:
                outcomes.add(str(error)[:43])
    thread.join()
    assert outcomes <= {"the simulation is in the middle of a step: "}
    simulation.step()


def test_run_many_gives_what_single_runs_give():
    singles, many = [], []
    for i in range(5):
        _, _arm, simulation = cantilever(nodes=6 + i)
        many.append(simulation)
        singles.append(simulation.copy().run(0.1, record_every=0.02, progress=False))
    records = withe.run_many(many, 0.1, record_every=0.02, workers=3, progress=False)
    for a, b in zip(records, singles, strict=True):
        assert np.array_equal(a.positions(), b.positions())
    assert [s.record.times[-1] for s in many] == [0.1] * 5
    assert withe.run_many([], 1.0) == []


def test_run_many_returns_or_raises_errors():
    def build():
        simulations = [cantilever(nodes=4)[2] for _ in range(4)]
        scene, arm, _ = cantilever(nodes=4)
        scene.add_force(arm.end, lambda t: (0, 0, 0 if t < 0.02 else 1 / 0), name="bad")
        simulations.insert(2, scene.build())
        return simulations

    results = withe.run_many(build(), 0.1, record_every=0.01, errors="return", progress=False)
    assert isinstance(results[2], ZeroDivisionError)
    assert all(isinstance(result, withe.Record) for i, result in enumerate(results) if i != 2)
    simulations = build()
    with pytest.raises(ZeroDivisionError):
        withe.run_many(simulations, 0.1, record_every=0.01, progress=False)
    assert len(simulations[2].record) == 3
    simulations[0].step()


def test_run_many_stops_on_ctrl_c():
    _, _, slow = cantilever(nodes=101, planar=False)
    simulations = [slow, slow.copy()]
    begun = set()
    see = {"seen": lambda simulation: begun.add(id(simulation)) or 0.0}
    with pytest.raises(KeyboardInterrupt), ctrl_c_once(lambda: len(begun) == 2):
        withe.run_many(simulations, 1e5, record_every=0.1, workers=2, record=see, progress=False)
    assert all(len(simulation.record) >= 1 for simulation in simulations)
    slow.step()


def test_run_many_shows_one_bar(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    simulations = [tripod()[2] for _ in range(3)]
    withe.run_many(simulations, 0.2, progress=True)
    shown = capsys.readouterr().err
    assert "0.6" in shown


@pytest.mark.parametrize("moved", ["twisted", "folded", "resting"])
def test_a_mesh_too_coarse_for_the_motion_warns_once(moved, recwarn):
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=1e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    if moved == "twisted":
        scene.clamp(arm.end)
    simulation = scene.build(time_step=0.01)
    if moved == "twisted":
        simulation.move(arm.end, roll=3.0 * np.pi, over=1.0)  # 135 degrees an edge
    elif moved == "folded":
        simulation.set(arm, discrete_curvature=(2.5 / 0.05, 0.0), over=0.5)
    simulation.run(2.0, progress=False)
    simulation.equilibrium()
    said = [str(w.message) for w in recwarn.list if issubclass(w.category, withe.CoarseMeshWarning)]
    if moved == "resting":
        assert not recwarn.list
    else:
        assert len(said) == 1
        assert ("an edge twists by" if moved == "twisted" else "an edge turns by") in said[0]
        assert "of rod 'arm'" in said[0]


BEHIND_ITS_BACK = {
    "step": lambda s: s.step(),
    "run": lambda s: s.run(0.01, progress=False),
    "reset": lambda s: s.reset(),
    "restore": lambda s: s.restore(s.snapshot()),
    "equilibrium": lambda s: s.equilibrium(),
}


@pytest.mark.parametrize("what", BEHIND_ITS_BACK)
@pytest.mark.parametrize("callback", ["before_step", "until", "record"])
def test_a_callback_that_advances_the_simulation_or_takes_it_back_is_refused(what, callback):
    _, _, simulation = cantilever()
    simulation.step(2)
    function = BEHIND_ITS_BACK[what]
    with pytest.raises(RuntimeError, match=f"{what} cannot be called while the simulation runs"):
        simulation.run(0.1, progress=False, **{callback: {"x": function} if callback == "record" else function})
    assert simulation.time == 0.01 + (0.005 if callback == "until" else 0.0)
    simulation.step()  # and the run is over
    simulation.reset()


def test_a_callback_may_go_on_with_a_copy_and_take_snapshots():
    _, _, simulation = cantilever()
    _, _, other = cantilever()

    def ahead(s):
        twin = s.copy()
        twin.step(2)
        twin.restore(s.snapshot())
        return twin.run(0.01, progress=False).times[-1]

    record = simulation.run(
        0.05, 0.01, progress=False, before_step=ahead, until=lambda s: ahead(s) < 0, record={"t": ahead}
    )
    np.testing.assert_allclose(record["t"], record.times + 0.01, rtol=1e-12)
    np.testing.assert_allclose(record.positions(), other.run(0.05, 0.01, progress=False).positions(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("duration", [5e-324, 1e-300, 1e-25])
def test_a_duration_that_changes_no_time_is_refused(duration):
    _, _, simulation = cantilever()
    with pytest.raises(ValueError, match=r"duration must be long enough for the time_step, 0\.005 s"):
        simulation.run(duration, progress=False)
    assert np.isfinite(simulation.positions()).all()
    simulation.step()
    with pytest.raises(ValueError, match="duration must be long enough"):
        simulation.run(1e-19, progress=False)


def test_a_record_refuses_masked_entries():
    _, _, simulation = cantilever()
    with pytest.raises(ValueError, match="must have a value everywhere"):
        simulation.run(0.01, progress=False, record={"x": lambda s: np.ma.masked_greater(s.positions(), 0.1)})


def test_no_step_is_replaced_by_a_step_of_another_method():
    def replaced(integrator):
        scene = withe.Scene(gravity=(0, 0, -1.8))
        stiff = withe.Stiffness(stretch=1e5, bend=0.05, twist=0.05)
        rod = scene.add_rod(
            start=(0, 0, 0), end=(1, 0, 0), nodes=12, radius=1e-3, stiffness=stiff, line_density=1.0, name="rod"
        )
        scene.pin(rod.start)
        simulation = scene.build(time_step=0.1, integrator=integrator)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            simulation.step(3)
        statistics = simulation.statistics
        return statistics.energy_momentum_steps / statistics.steps

    assert replaced("implicit_midpoint") == 0.0
    assert replaced("backward_euler") == 0.0
    assert replaced("energy_momentum") == 1.0
