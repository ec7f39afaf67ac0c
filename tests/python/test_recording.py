"""Records: the same read-outs as a simulation with one more axis in front, copies, nothing lost."""

import pickle
from dataclasses import fields

import numpy as np
import pytest

from curling_motion import CURVATURE_RATE, CurlingSimulation
from withe.recording import EnergyHistory
from withe.recording import recorder as recorder_room
from withe.recording.recorder import Recorder, present


@pytest.fixture
def simulation():
    return CurlingSimulation()


def record_of(simulation, frames=50, extra=None):
    recorder = Recorder(simulation, extra)
    for _ in range(frames):
        recorder.capture()
        simulation.step(0.02)
    return recorder.record


def test_read_outs_are_those_of_the_simulation_at_every_frame(simulation):
    record = record_of(simulation)
    np.testing.assert_allclose(record.times, 0.02 * np.arange(50), atol=1e-15)
    for frame in (0, 17, 49):
        then = CurlingSimulation(record.times[frame])
        np.testing.assert_array_equal(record.positions()[frame], then.positions())
        np.testing.assert_array_equal(record.velocities()[frame], then.velocities())
        for rod in ("arm", "hand", "ring"):
            for readout in (
                "positions",
                "velocities",
                "directors",
                "curvatures",
                "twists",
                "tensions",
                "spins",
            ):
                ours = getattr(record, readout)(rod)
                np.testing.assert_array_equal(ours[frame], getattr(then, readout)(rod))
        for field in fields(EnergyHistory):
            assert getattr(record.energy(), field.name)[frame] == getattr(then.energy(), field.name)


def test_shapes_have_frames_in_front_and_closed_rods_one_edge_more(simulation):
    record = record_of(simulation, frames=3)
    assert record.positions().shape == (3, 55, 3)
    assert record.positions("arm").shape == (3, 21, 3)
    assert record.directors("ring").shape == (3, 24, 3, 3)
    assert record.curvatures("ring").shape == (3, 24, 2)
    assert record.curvatures("arm").shape == (3, 19, 2)
    assert record.tensions("arm").shape == (3, 20)
    assert len(record) == 3


def test_joined_rods_share_the_row_of_their_joint(simulation):
    record = record_of(simulation, frames=4)
    np.testing.assert_array_equal(record.positions("arm")[:, -1], record.positions("hand")[:, 0])


def test_a_handle_and_its_name_are_the_same(simulation):
    record = record_of(simulation, frames=2)
    np.testing.assert_array_equal(record.positions(simulation.rods[2]), record.positions("ring"))


@pytest.mark.parametrize("rod", ["leg", 0, object(), ("arm",)])
def test_an_unknown_rod_is_refused_by_name(simulation, rod):
    with pytest.raises(ValueError, match="rod must be one of 'arm', 'hand', 'ring'"):
        record_of(simulation, frames=1).positions(rod)


def test_read_outs_are_copies(simulation):
    record = record_of(simulation, frames=2, extra={"grip": lambda s: np.ones(3)})
    for read in (
        lambda: record.times,
        lambda: record.positions(),
        lambda: record.positions("arm"),
        lambda: record.directors("arm"),
        lambda: record.energy().total,
        lambda: record["grip"],
    ):
        before = read()
        read()[...] = 7.0
        np.testing.assert_array_equal(read(), before)


def test_an_earlier_record_does_not_change_while_recording_goes_on(simulation):
    recorder = Recorder(simulation, {})
    recorder.capture()
    early = recorder.record
    simulation.step(0.5)
    recorder.capture()
    assert len(early) == 1
    assert len(recorder.record) == 2
    assert early.times[0] == 0.0


def test_extras_are_recorded_frame_by_frame(simulation):
    extra = {
        "curvature": lambda s: CURVATURE_RATE * s.time,
        "tip": lambda s: s.positions("arm")[-1],
    }
    record = record_of(simulation, extra=extra)
    np.testing.assert_array_equal(record["tip"], record.positions("arm")[:, -1])
    np.testing.assert_allclose(record["curvature"], CURVATURE_RATE * record.times)
    assert record.keys() == ("curvature", "tip")
    assert "tip" in record
    assert "grip" not in record
    with pytest.raises(KeyError, match="'curvature', 'tip'"):
        record["grip"]


def test_an_extra_that_starts_as_integers_keeps_its_fractions_later(simulation):
    record = record_of(simulation, frames=3, extra={"x": lambda s: 0 if s.time == 0 else 0.5})
    np.testing.assert_array_equal(record["x"], [0.0, 0.5, 0.5])


def test_an_extra_that_changes_shape_is_refused_and_leaves_no_half_frame(simulation):
    recorder = Recorder(simulation, {"x": lambda s: np.zeros(2 if s.time == 0 else 3)})
    recorder.capture()
    simulation.step(0.1)
    with pytest.raises(ValueError, match=r"record\['x'\] must keep its shape \(2,\), got \(3,\)"):
        recorder.capture()
    assert len(recorder.record) == 1


@pytest.mark.parametrize("value", ["text", None, [[1], [1, 2]], {}])
def test_an_extra_that_is_not_numbers_is_refused(simulation, value):
    with pytest.raises(ValueError, match=r"record\['x'\] must return numbers"):
        Recorder(simulation, {"x": lambda s: value}).capture()


def test_an_exception_of_an_extra_propagates_and_keeps_the_frames_before(simulation):
    def fail(s):
        if s.time > 0.05:
            raise ZeroDivisionError
        return 1.0

    recorder = Recorder(simulation, {"x": fail})
    for _ in range(3):
        recorder.capture()
        simulation.step(0.02)
    with pytest.raises(ZeroDivisionError):
        recorder.capture()
    assert len(recorder.record) == 3


@pytest.mark.parametrize("extra", [{"x": 3}, {1: lambda s: 0}])
def test_extras_must_be_functions_with_names(simulation, extra):
    with pytest.raises(ValueError, match="record"):
        Recorder(simulation, extra)


def test_a_record_without_frames_has_empty_read_outs(simulation):
    record = Recorder(simulation, {"x": lambda s: 1.0}).record
    assert len(record) == 0
    assert record.positions("arm").shape == (0, 21, 3)
    assert record["x"].shape == (0,)
    assert "no frames" in repr(record)


def test_records_pickle(simulation):
    record = record_of(simulation, frames=3, extra={"x": lambda s: s.time})
    copy = pickle.loads(pickle.dumps(record))
    np.testing.assert_array_equal(copy.positions(), record.positions())
    np.testing.assert_array_equal(copy["x"], record["x"])
    assert [rod.name for rod in copy.rods] == ["arm", "hand", "ring"]


def test_outlines_tell_radii_sections_and_units(simulation):
    record = present(simulation)
    arm, hand, ring = record.rods
    np.testing.assert_array_equal(arm.radii, np.linspace(6e-3, 4e-3, 20))
    assert arm.widths is None
    assert hand.widths.shape == (10, 2)
    assert ring.closed
    assert ring.radii.shape == (24,)
    assert record.units["curvatures"] == "1/m"


def test_an_interrupt_within_a_frame_leaves_whole_frames_only(simulation, monkeypatch):
    recorder = Recorder(simulation)
    recorder.capture()
    simulation.step(0.1)
    write, calls = recorder_room._Column.write, []

    def interrupted(self, frame, value):
        calls.append(frame)
        if len(calls) == 5:
            raise KeyboardInterrupt
        write(self, frame, value)

    monkeypatch.setattr(recorder_room._Column, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        recorder.capture()
    assert len(recorder.record) == 1
    recorder.capture()
    assert len(recorder.record) == 2
    np.testing.assert_array_equal(recorder.record.times, [0.0, 0.1])
