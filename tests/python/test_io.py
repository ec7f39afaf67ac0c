"""Files: what is saved comes back bit for bit, and nothing that is not ours gets in."""

import errno
import json
import os
import pathlib
import pickle
import re
import zipfile
from dataclasses import fields

import numpy as np
import pytest

import withe
from curling_motion import CurlingSimulation, Handle
from simple_scenes import cantilever
from withe.io import load_arrays, load_poses, save_arrays, save_poses
from withe.recording import EnergyHistory, Record
from withe.recording.recorder import Recorder


@pytest.fixture
def record():
    simulation = CurlingSimulation()
    recorder = Recorder(simulation, {"tip/x": lambda s: s.positions("arm")[-1], "n": lambda s: 3})
    for _ in range(5):
        recorder.capture()
        simulation.step(0.05)
    return recorder.record


def test_a_record_comes_back_bit_for_bit(record, tmp_path):
    path = record.save(tmp_path / "arm.npz")
    loaded = Record.load(path)
    np.testing.assert_array_equal(loaded.times, record.times)
    np.testing.assert_array_equal(loaded.positions(), record.positions())
    np.testing.assert_array_equal(loaded.velocities(), record.velocities())
    for rod in ("arm", "hand", "ring"):
        for readout in ("directors", "curvatures", "twists", "tensions"):
            np.testing.assert_array_equal(getattr(loaded, readout)(rod), getattr(record, readout)(rod))
    for field in fields(EnergyHistory):
        ours, theirs = getattr(loaded.energy(), field.name), getattr(record.energy(), field.name)
        np.testing.assert_array_equal(ours, theirs)
    assert loaded.keys() == record.keys()
    np.testing.assert_array_equal(loaded["tip/x"], record["tip/x"])
    for ours, theirs in zip(loaded.rods, record.rods, strict=True):
        assert (ours.name, ours.closed) == (theirs.name, theirs.closed)
        np.testing.assert_array_equal(ours.rows, theirs.rows)
        np.testing.assert_array_equal(ours.radii, theirs.radii)
        np.testing.assert_array_equal(ours.widths, theirs.widths)


def test_the_file_tells_names_radii_units_and_version_to_numpy_alone(record, tmp_path):
    with np.load(record.save(tmp_path / "arm.npz"), allow_pickle=False) as archive:
        header = json.loads(str(archive["header"]))
        np.testing.assert_array_equal(archive["rod_0_radii"], np.linspace(6e-3, 4e-3, 20))
    assert header["format"] == "withe record"
    assert header["version"] == 1
    assert [rod["name"] for rod in header["rods"]] == ["arm", "hand", "ring"]
    assert header["units"]["positions"] == "m"


def test_a_failed_save_leaves_the_old_file_and_no_rubbish(record, tmp_path, monkeypatch):
    path = record.save(tmp_path / "arm.npz")
    before = path.read_bytes()
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        record.save(path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["arm.npz"]


def test_every_cut_of_a_file_is_refused_with_its_name(record, tmp_path):
    path = tmp_path / "arm.npz"
    data = record.save(path).read_bytes()
    for length in range(0, len(data), len(data) // 60):
        path.write_bytes(data[:length])
        with pytest.raises(ValueError, match=r"arm\.npz"):
            Record.load(path)


def test_flipped_bytes_are_refused_or_harmless(record, tmp_path):
    path = tmp_path / "arm.npz"
    data = record.save(path).read_bytes()
    rng = np.random.default_rng(5)
    refused = 0
    for place in rng.integers(0, len(data), 300):
        path.write_bytes(data[:place] + bytes([data[place] ^ 0x55]) + data[place + 1 :])
        try:
            loaded = Record.load(path)
        except ValueError:
            refused += 1
        else:
            np.testing.assert_array_equal(loaded.positions(), record.positions())
    assert refused > 250


class Bomb:
    def __reduce__(self):
        return (os.system, ("touch bomb_went_off",))


@pytest.mark.parametrize("name", ["text", "empty", "npy", "pickle", "object", "foreign", "zip"])
def test_foreign_files_are_refused_and_nothing_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f"{name}.npz"
    if name == "text":
        path.write_text("not an archive")
    elif name == "empty":
        path.touch()
    elif name == "npy":
        with path.open("wb") as stream:
            np.save(stream, np.arange(3))
    elif name == "pickle":
        path.write_bytes(pickle.dumps(Bomb()))
    elif name == "object":
        np.savez(path, header=np.array(Bomb(), object))
    elif name == "foreign":
        np.savez(path, header=np.array("{}"), times=np.arange(3.0))
    else:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("header.npy", b"\x93NUMPY\x01\x00garbage")
    with pytest.raises(ValueError, match=f"{name}.npz") as error:
        Record.load(path)
    assert "unsafely" not in str(error.value)
    assert not (tmp_path / "bomb_went_off").exists()


def test_another_version_and_another_kind_are_named(record, tmp_path):
    path = tmp_path / "later.npz"
    save_arrays(path, "record", 2, {}, {})
    with pytest.raises(ValueError, match=r"later\.npz is a record of version 2, this withe reads version 1"):
        Record.load(path)
    save_arrays(path, "snapshot", 1, {}, {})
    with pytest.raises(ValueError, match=r"later\.npz holds a withe snapshot, expected a withe record"):
        Record.load(path)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("times", np.zeros((5, 1))),
        ("times", np.zeros(5, int)),
        ("positions", np.zeros((4, 55, 3))),
        ("velocities", np.zeros((5, 54, 3))),
        ("rod_0_rows", np.arange(40, 61)),
        ("rod_0_rows", np.zeros(21)),
        ("rod_0_radii", np.zeros(3)),
        ("rod_1_tensions", None),
        ("energy_total", np.zeros(6)),
        ("extra_0", np.zeros(6)),
    ],
)
def test_arrays_that_do_not_fit_together_are_refused(record, tmp_path, key, value):
    header, arrays = load_arrays(record.save(tmp_path / "arm.npz"), "record", 1)
    if value is None:
        del arrays[key]
    else:
        arrays[key] = value
    save_arrays(tmp_path / "bad.npz", "record", 1, header, arrays)
    with pytest.raises(ValueError, match=r"bad\.npz is a damaged record"):
        Record.load(tmp_path / "bad.npz")


@pytest.mark.parametrize("rods", [3, [{"closed": False}], ["arm"], None])
def test_a_header_of_the_wrong_form_is_refused(record, tmp_path, rods):
    header, arrays = load_arrays(record.save(tmp_path / "arm.npz"), "record", 1)
    save_arrays(tmp_path / "bad.npz", "record", 1, {**header, "rods": rods}, arrays)
    with pytest.raises(ValueError, match=r"bad\.npz is a damaged record"):
        Record.load(tmp_path / "bad.npz")


def test_objects_are_not_saved(tmp_path):
    with pytest.raises(ValueError, match="must hold numbers"):
        save_arrays(tmp_path / "x.npz", "record", 1, {}, {"a": np.array([None])})


def test_a_missing_file_stays_a_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        Record.load(tmp_path / "none.npz")


def test_vtk_frames_are_read_back_by_vtk(record, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    collection = record.to_vtk(tmp_path / "frames")
    reader = pyvista.PVDReader(str(collection))
    np.testing.assert_array_equal(reader.time_values, record.times)
    reader.set_active_time_point(3)
    mesh = reader.read()[0]
    rods = ("arm", "hand", "ring")
    points = np.concatenate([record.positions(rod)[3] for rod in rods])
    np.testing.assert_array_equal(mesh.points, points)
    assert mesh.n_lines == 3
    np.testing.assert_array_equal(mesh.lines[:22], [21, *range(21)])
    np.testing.assert_array_equal(mesh.lines[34:], [25, *range(32, 56), 32])
    assert list(mesh.field_data["rod_names"]) == list(rods)
    np.testing.assert_array_equal(mesh.cell_data["rod"], [0, 1, 2])
    np.testing.assert_array_equal(mesh["radius"][21:32], 4e-3)
    np.testing.assert_array_equal(mesh["curvature"][1:20], record.curvatures("arm")[3])
    np.testing.assert_array_equal(mesh["curvature"][[0, 20]], mesh["curvature"][[1, 19]])
    tensions = record.tensions("arm")[3]
    np.testing.assert_allclose(mesh["tension"][1:20], (tensions[1:] + tensions[:-1]) / 2)
    assert mesh["tension"][0] == tensions[0]
    np.testing.assert_array_equal(mesh["twist"][32:], record.twists("ring")[3])


def test_a_collection_of_another_name_has_its_frames_in_a_folder_of_that_name(record, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    collection = record.export(tmp_path / "run 1.pvd")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run 1", "run 1.pvd"]
    reader = pyvista.PVDReader(str(collection))
    np.testing.assert_array_equal(reader.time_values, record.times)
    np.testing.assert_array_equal(reader.read()[0].points[:21], record.positions("arm")[0])


def test_vtk_that_is_cut_off_leaves_no_older_list_of_frames(record, tmp_path, monkeypatch):
    collection = record.to_vtk(tmp_path)

    def full_disk(self, *arguments, **options):
        raise OSError("No space left on device")

    monkeypatch.setattr(pathlib.Path, "write_text", full_disk)
    with pytest.raises(OSError, match="No space"):
        record.to_vtk(tmp_path)
    assert not collection.exists()


def test_vtk_of_no_frames_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no frames"):
        Recorder(CurlingSimulation()).record.to_vtk(tmp_path)


def test_a_rod_of_two_nodes_has_no_curvature_in_vtk(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    simulation = CurlingSimulation()
    simulation.rods = [Handle("stub", np.arange(2), False, 1e-3)]
    recorder = Recorder(simulation)
    recorder.capture()
    mesh = pyvista.PVDReader(str(recorder.record.to_vtk(tmp_path))).read()[0]
    np.testing.assert_array_equal(mesh["curvature"], np.zeros((2, 2)))


def cut_and_flipped(data):
    """A file with one byte changed, at every third place and in every other way, and ends cut off."""
    for place in range(0, len(data), 3):
        changed = bytearray(data)
        changed[place] ^= (0xFF, 0x01, 0x20, 0x80)[place % 4]
        yield bytes(changed)
    for end in range(0, len(data), 97):
        yield data[:end]


@pytest.mark.parametrize("kind", ["record", "snapshot"])
@pytest.mark.filterwarnings("error")
def test_a_damaged_file_raises_one_error_or_holds_what_was_saved(kind, tmp_path):
    _, _, simulation = cantilever(nodes=4)
    saved = simulation.run(0.01, progress=False) if kind == "record" else simulation.snapshot()
    path = saved.save(tmp_path / "file.npz")
    data = path.read_bytes()
    harmless = unnamed = 0
    for damaged in cut_and_flipped(data):
        path.write_bytes(damaged)
        try:
            loaded = type(saved).load(path)
        except ValueError as error:
            unnamed += str(path) not in str(error)
            continue
        harmless += 1  # a date in the archive, which says nothing
        assert pickle.dumps(loaded) == pickle.dumps(saved) if kind == "record" else loaded == saved
    assert unnamed == 0
    assert harmless < len(data) / 10


def test_a_header_that_no_tokenizer_reads_is_a_damaged_file(tmp_path):
    path = tmp_path / "file.npz"
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (3,), '''".ljust(117) + b"\n"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(24))
    with pytest.raises(ValueError, match=r"file.npz is not a withe file, or damaged"):
        Record.load(path)


@pytest.mark.parametrize("name", ["tip.csv", "arm.h5", "arm.vtk", "arm.json", "arm.txt", "arm"])
def test_records_and_snapshots_are_saved_as_npz_alone_and_say_so(name, record, tmp_path):
    _, _, simulation = cantilever(nodes=4)
    with pytest.raises(ValueError, match=rf"end in \.npz, got '.*{name}'; use export for other programs"):
        record.save(tmp_path / name)
    with pytest.raises(ValueError, match=rf"path must end in \.npz, got '.*{name}'$"):
        simulation.snapshot().save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_the_formats_that_a_refused_record_names_are_those_of_export(record, tmp_path):
    with pytest.raises(ValueError, match=r"must end in .npz") as refused:
        record.save(tmp_path / "tip.txt")
    with pytest.raises(ValueError, match=r"must end in one of") as known:
        record.export(tmp_path / "tip.txt")
    suffixes = re.findall(r"\.\w+", str(refused.value).split("programs")[1])
    assert suffixes
    assert set(suffixes) <= set(re.findall(r"\.\w+", str(known.value).split("one of")[1]))


def test_a_full_disk_leaves_the_file_that_was_there(record, tmp_path, monkeypatch):
    path = record.save(tmp_path / "arm.npz")
    before = path.read_bytes()

    def full(stream, **arrays):
        stream.write(b"PK")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match=r"No space left on device; nothing was written to.*arm.npz") as caught:
        record.save(path)
    assert caught.value.errno == errno.ENOSPC
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_does_not_take_the_place_of_a_device_or_a_pipe(record, tmp_path):
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match=r"device or a pipe: give another path than.*pipe.npz"):
        record.save(pipe)
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_file_name_may_be_as_long_as_the_system_allows(record, tmp_path):
    path = record.save(tmp_path / ("n" * 251 + ".npz"))
    np.testing.assert_array_equal(Record.load(path).times, record.times)
    assert list(tmp_path.iterdir()) == [path]


def test_poses_come_back_by_their_names_with_the_scalar_first(tmp_path):
    random = np.random.default_rng(4)
    times, poses = np.arange(5.0), random.normal(size=(5, 7))
    rows = load_poses(save_poses(tmp_path / "poses.csv", times, poses))
    np.testing.assert_allclose(rows, np.column_stack([times, poses[:, :3], poses[:, 6], poses[:, 3:6]]), rtol=1e-8)
    header, *lines = (tmp_path / "poses.csv").read_text().splitlines()
    assert header == "t,x,y,z,qx,qy,qz,qw"
    order = random.permutation(9)  # another tool's columns, and one more

    def shuffled(line, extra):
        cells = [*line.split(","), extra]
        return ",".join(cells[i] for i in order)

    other = tmp_path / "other.csv"
    other.write_text("\n".join([shuffled(header, "grip"), *(shuffled(line, "7") for line in lines)]))
    np.testing.assert_array_equal(load_poses(other), rows)
    other.write_text(other.read_text(), encoding="utf-8-sig")  # as spreadsheets save it
    np.testing.assert_array_equal(load_poses(other), rows)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,x,y,z,qw,qx,qy\n0,0,0,0,1,0,0\n", "none named 'qz'"),
        ("", "none named 't'"),
        ("t,x,y,z,qx,qy,qz,qw\n", "got none"),
        ("t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,zero,0,1\n", "must hold numbers"),
    ],
)
def test_tables_without_poses_say_what_they_lack(tmp_path, text, message):
    (tmp_path / "poses.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        load_poses(tmp_path / "poses.csv")


def test_a_hand_goes_where_a_table_of_poses_says(tmp_path):
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=16, radius=0.002, material=rubber)
    angles = np.linspace(0.0, 1.0, 11)
    zero = np.zeros(11)
    poses = np.column_stack([0.01 * angles, zero, 0.02 * angles, zero, np.sin(angles / 2), zero, np.cos(angles / 2)])
    rows = load_poses(save_poses(tmp_path / "lift.csv", np.linspace(0.0, 1.0, 11), poses))
    hand = scene.grasp(rod, at=0.005, length=0.01, pose=rows[0, 1:])
    simulation = scene.build(integrator="backward_euler", time_step=0.05)
    simulation.move(hand, path=rows)
    simulation.run(1.0, progress=False)
    position, rotation = simulation.pose(hand)
    np.testing.assert_allclose(position, poses[-1, :3], atol=1e-12)
    turned = [[np.cos(1), 0, np.sin(1)], [0, 1, 0], [-np.sin(1), 0, np.cos(1)]]
    np.testing.assert_allclose(rotation, turned, atol=1e-8)
