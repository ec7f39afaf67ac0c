"""Files for other programs: what their readers find there is what the record holds."""

import builtins
import csv
import importlib

import numpy as np
import pytest

import withe
from curling_motion import CurlingSimulation, Handle
from withe.export.gltf import node_frames
from withe.recording import Record
from withe.recording.recorder import Recorder, present
from withe.view.colors import linear, rod_color

COMPONENTS = {5126: np.float32, 5123: np.uint16, 5125: np.uint32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@pytest.fixture(scope="module")
def record():
    """A tapered rod, a rectangular one and a closed one."""
    simulation = CurlingSimulation()
    recorder = Recorder(simulation)
    for _ in range(5):
        recorder.capture()
        simulation.step(0.1)
    return recorder.record


@pytest.fixture(scope="module")
def among_obstacles():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=5e5, density=1000.0, viscosity=200.0)
    scene.add_rod(points=withe.shapes.helix(0.03, 0.02, 0.3, 20), radius=4e-3, material=rubber, name="4th arm")
    scene.add_floor(height=-0.03, name="floor")
    scene.add_sphere((0.06, 0.02, 0.0), 0.02, name="ball")
    scene.add_capsule((-0.08, -0.05, 0), (-0.08, 0.06, 0.02), 0.012, name="bar")
    scene.add_sphere((0, 0, -20.0), 19.8, name="hill")
    simulation = scene.build()
    simulation.move("ball", (0.06, 0.02, 0.05), over=0.04)
    return simulation.run(0.04, 0.01, progress=False)


# glTF


class Film:
    """A glTF file as a viewer evaluates it: poses of nodes over time, and skinned points [glTF 2.0, section 3.7.3]."""

    def __init__(self, path):
        self.gltf = pytest.importorskip("pygltflib").GLTF2().load(str(path))
        self.block = self.gltf.binary_blob()

    def read(self, index):
        accessor = self.gltf.accessors[index]
        view = self.gltf.bufferViews[accessor.bufferView]
        width = WIDTHS[accessor.type]
        kind = COMPONENTS[accessor.componentType]
        values = np.frombuffer(self.block, kind, accessor.count * width, view.byteOffset)
        return values.reshape(accessor.count, width) if width > 1 else values

    def channels(self, node):
        motion = self.gltf.animations[0]
        return {
            channel.target.path: motion.samplers[channel.sampler]
            for channel in motion.channels
            if channel.target.node == node
        }

    def matrix(self, node, frame):
        """Pose of a node in its parent, at a frame."""
        entry = self.gltf.nodes[node]
        pose = {"translation": entry.translation or (0, 0, 0), "rotation": entry.rotation or (0, 0, 0, 1)}
        if frame is not None:
            pose |= {path: self.read(sampler.output)[frame] for path, sampler in self.channels(node).items()}
        matrix = np.eye(4)
        matrix[:3, :3] = turned(np.asarray(pose["rotation"], float))
        matrix[:3, 3] = pose["translation"]
        return matrix

    def skinned(self, name, frame):
        """Points and normals of a rod in the axes of the file, and the joints of each point."""
        node = next(node for node in self.gltf.nodes if node.name == f"{name} surface")
        (primitive,) = self.gltf.meshes[node.mesh].primitives
        skin = self.gltf.skins[node.skin]
        inverse = self.read(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
        root = self.matrix(skin.skeleton, None)
        poses = np.array([root @ self.matrix(joint, frame) for joint in skin.joints]) @ inverse
        points, normals, joints, weights = (
            self.read(getattr(primitive.attributes, what)) for what in ("POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0")
        )
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-7)
        blended = np.einsum("pj,pjab->pab", weights, poses[joints])
        placed = np.einsum("pab,pb->pa", blended, np.column_stack([points, np.ones(len(points))]))[:, :3]
        turned_normals = np.einsum("pab,pb->pa", blended[:, :3, :3], normals)
        alone = np.where(weights[:, 0] == 1.0, joints[:, 0], -1)
        return placed, turned_normals, alone, self.read(primitive.indices).reshape(-1, 3)


def turned(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def upright(points):
    """Points of our axes, z up, in those of glTF, y up."""
    return points[..., [0, 2, 1]] * (1.0, 1.0, -1.0)


def volume(points, triangles):
    return np.linalg.det(points[triangles]).sum() / 6.0


@pytest.mark.parametrize("rod", ["arm", "hand", "ring"])
@pytest.mark.parametrize("frame", [0, 3])
def test_the_skin_of_a_rod_surrounds_its_nodes_at_every_frame(record, tmp_path, rod, frame):
    film = Film(record.export(tmp_path / "motion.glb"))
    points, _, alone, _ = film.skinned(rod, frame)
    nodes = upright(record.positions(rod)[frame])
    inner = range(1, len(nodes) - 1)  # at the ends of open rods caps belong to the joints too
    centres = np.array([points[alone == node].mean(axis=0) for node in inner])
    np.testing.assert_allclose(centres, nodes[1:-1], atol=2e-7 * np.abs(nodes).max())


def test_the_tube_has_the_radii_of_its_edges(record, tmp_path):
    points, *_ = Film(record.export(tmp_path / "motion.glb")).skinned("arm", 2)
    rings = points[6 * 16 : -6 * 16].reshape(-1, 16, 3)  # without caps; four rings per edge
    radii = np.linalg.norm(rings - rings.mean(axis=1, keepdims=True), axis=-1)
    np.testing.assert_allclose(radii[2::4], np.repeat(record.rods[0].radii[:, None], 16, axis=1), rtol=3e-3)
    ring, *_ = Film(tmp_path / "motion.glb").skinned("ring", 2)
    assert np.linalg.norm(ring.mean(axis=0) - upright(record.positions("ring")[2]).mean(axis=0)) < 2e-3


def test_the_rings_between_two_nodes_lie_on_the_arc(record, tmp_path):
    frame, kappa = 4, 8.0 * 0.4
    points, *_ = Film(record.export(tmp_path / "motion.glb")).skinned("arm", frame)
    centres = points[6 * 16 : -6 * 16].reshape(-1, 16, 3).mean(axis=1)
    distances = np.hypot(centres[:, 0] - 1.0 / kappa, centres[:, 1])
    edge = 0.2 / 20
    sag = kappa * edge**2 / 8.0
    np.testing.assert_allclose(distances, 1.0 / kappa, atol=0.02 * sag)


def test_a_rectangle_is_a_box_with_its_width_along_d1(tmp_path):
    simulation = CurlingSimulation()
    simulation.rods = [Handle("bar", np.arange(21), False, 5e-3, np.array([8e-3, 2e-3]))]
    film = Film(present(simulation).export(tmp_path / "bar.glb"))
    points, normals, _, triangles = film.skinned("bar", None)
    nodes = simulation.positions("bar")
    assert volume(points, triangles) == pytest.approx(8e-3 * 2e-3 * 0.2, rel=1e-4)
    first = upright(simulation.directors("bar")[10, 0])
    across = (points - upright(nodes[10])) @ first
    np.testing.assert_allclose([across.min(), across.max()], [-4e-3, 4e-3], atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    assert film.gltf.animations == []  # one frame


def test_a_tube_faces_outwards_and_encloses_its_volume(record, tmp_path):
    film = Film(record.export(tmp_path / "motion.glb"))
    points, _, _, triangles = film.skinned("ring", 1)
    polygon = 16.0 * np.sin(2.0 * np.pi / 16.0) / 2.0 / np.pi  # share of a circle in its 16 corners
    assert volume(points, triangles) == pytest.approx(
        2.0 * np.pi**2 * 0.05 * 2e-3**2 * polygon, rel=1e-2
    )  # 15 degrees an edge
    arm, normals, _, corners = film.skinned("arm", 1)
    assert volume(arm + 1e-4 * normals, corners) > volume(arm, corners) > 0.0


def test_colours_times_and_the_quaternions_are_those_of_a_film(record, tmp_path):
    film = Film(record.export(tmp_path / "motion.glb"))
    for index, material in enumerate(film.gltf.materials[:3]):
        found = material.pbrMetallicRoughness.baseColorFactor
        np.testing.assert_allclose(found, [*linear(rod_color(index)), 1.0])
    joint = film.gltf.skins[0].joints[7]
    channels = film.channels(joint)
    np.testing.assert_allclose(film.read(channels["translation"].input), record.times - record.times[0], rtol=1e-6)
    turns = film.read(channels["rotation"].output)
    assert np.all(np.sum(turns[1:] * turns[:-1], axis=1) > 0.0)
    assert film.gltf.accessors[channels["rotation"].input].min == [0.0]
    assert len(film.channels(joint)) == 2


def test_frames_without_time_are_shown_one_after_the_other(tmp_path):
    simulation = CurlingSimulation()
    recorder = Recorder(simulation)
    recorder.capture()
    recorder.capture()
    film = Film(recorder.record.export(tmp_path / "still.glb"))
    clock = film.channels(film.gltf.skins[0].joints[0])["rotation"].input
    np.testing.assert_allclose(film.read(clock), [0.0, 1.0 / 30.0])


def test_obstacles_are_meshes_at_their_places(among_obstacles, tmp_path):
    film = Film(among_obstacles.export(tmp_path / "scene.glb"))
    nodes = {node.name: index for index, node in enumerate(film.gltf.nodes)}
    assert {"floor", "ball", "bar"} <= set(nodes)
    assert "hill" not in nodes
    root = film.matrix(nodes["withe"], None)
    for name, radius, length in (("ball", 0.02, 0.0), ("bar", 0.012, np.hypot(0.11, 0.02))):
        (primitive,) = film.gltf.meshes[film.gltf.nodes[nodes[name]].mesh].primitives
        points = film.read(primitive.attributes.POSITION)
        triangles = film.read(primitive.indices).reshape(-1, 3)
        exact = 4.0 / 3.0 * np.pi * radius**3 + np.pi * radius**2 * length
        assert volume(points.astype(float), triangles) == pytest.approx(exact, rel=0.02)
        normals = film.read(primitive.attributes.NORMAL)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
        for frame in (0, 4):
            middle = root @ film.matrix(nodes[name], frame) @ [*points.mean(axis=0), 1.0]
            place = among_obstacles.obstacle_position(name)[frame]
            axis = among_obstacles.obstacles[1 if name == "ball" else 2].axis
            np.testing.assert_allclose(middle[:3], upright(place + 0.5 * axis), atol=2e-3)
    assert "translation" in film.channels(nodes["ball"])
    assert film.channels(nodes["bar"]) == {}


def test_the_frames_of_nodes_continue_the_turn_of_an_arc_to_its_ends():
    simulation = CurlingSimulation(0.5)
    nodes, first = simulation.positions("arm")[None], simulation.directors("arm")[None, :, 0]
    frames = node_frames(nodes, first, closed=False)
    np.testing.assert_allclose(frames @ np.swapaxes(frames, -1, -2), np.tile(np.eye(3), (1, 21, 1, 1)), atol=1e-12)
    arc = 8.0 * 0.5 * np.linspace(0.0, 0.2, 21)
    exact = np.stack([np.sin(arc), 0.0 * arc, -np.cos(arc)], axis=1)
    np.testing.assert_allclose(frames[0, :, 2], exact, atol=1e-9)


def test_an_edge_that_turns_back_leaves_frames_without_gaps():
    nodes = np.array([[[0.0, 0, 0], [1.0, 0, 0], [0.0, 0, 0], [0.0, 1.0, 0]]])
    frames = node_frames(nodes, np.tile([0.0, 0, 1.0], (1, 3, 1)), closed=False)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)


# USD


def test_usd_curves_have_the_nodes_of_the_record_at_its_times(record, tmp_path):
    usd, geometry = (pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom"))
    for suffix in (".usda", ".usdc"):
        stage = usd.Stage.Open(str(record.export(tmp_path / f"motion{suffix}")))
        assert geometry.GetStageMetersPerUnit(stage) == 1.0
        assert geometry.GetStageUpAxis(stage) == "Z"
        assert stage.GetTimeCodesPerSecond() == 10.0
        assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 4.0)
        for rod in record.rods:
            curves = geometry.BasisCurves(stage.GetPrimAtPath(f"/withe/{rod.name}"))
            attribute = curves.GetPointsAttr()
            assert attribute.GetTimeSamples() == [0.0, 1.0, 2.0, 3.0, 4.0]
            for frame in range(5):
                np.testing.assert_array_equal(
                    attribute.Get(float(frame)), record.positions(rod)[frame].astype(np.float32)
                )
            np.testing.assert_allclose(
                curves.GetVelocitiesAttr().Get(2.0), record.velocities(rod)[2].astype(np.float32)
            )
            assert curves.GetWrapAttr().Get() == ("periodic" if rod.closed else "pinned")
            assert list(curves.GetCurveVertexCountsAttr().Get()) == [len(rod.rows)]
        arm = geometry.BasisCurves(stage.GetPrimAtPath("/withe/arm"))
        widths = np.array(arm.GetWidthsAttr().Get())
        np.testing.assert_allclose(widths[[0, -1]], [12e-3, 8e-3], rtol=1e-6)
        normals = geometry.BasisCurves(stage.GetPrimAtPath("/withe/hand")).GetNormalsAttr().Get(3.0)
        d2 = record.directors("hand")[3, :, 1]  # the ribbon is 6 mm wide along d1
        np.testing.assert_allclose(normals[5], (d2[4] + d2[5]) / np.linalg.norm(d2[4] + d2[5]), atol=1e-6)


def test_usd_shapes_stand_where_the_obstacles_are(among_obstacles, tmp_path):
    usd, geometry = (pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom"))
    stage = usd.Stage.Open(str(among_obstacles.export(tmp_path / "scene.usda")))
    assert [prim.GetName() for prim in stage.GetDefaultPrim().GetChildren()] == ["_th_arm", "floor", "ball", "bar"]
    assert stage.GetPrimAtPath("/withe/_th_arm").GetCustomDataByKey("rod") == "4th arm"
    rate = stage.GetTimeCodesPerSecond()
    assert rate == 100.0
    ball = geometry.Sphere(stage.GetPrimAtPath("/withe/ball"))
    for frame in (0, 4):
        moved = ball.ComputeLocalToWorldTransform(float(frame)).ExtractTranslation()
        np.testing.assert_allclose(moved, among_obstacles.obstacle_position("ball")[frame])
    bar = geometry.Capsule(stage.GetPrimAtPath("/withe/bar"))
    half = 0.5 * bar.GetHeightAttr().Get()
    ends = [bar.ComputeLocalToWorldTransform(0.0).Transform((0.0, 0.0, side * half)) for side in (-1, 1)]
    np.testing.assert_allclose(ends, [(-0.08, -0.05, 0), (-0.08, 0.06, 0.02)], atol=1e-7)


def test_without_usd_the_error_names_the_extra(record, tmp_path, monkeypatch):
    def missing(name, *args, **kwargs):
        if name.split(".")[0] == "pxr":
            raise ModuleNotFoundError("No module named 'pxr'", name="pxr")
        return real(name, *args, **kwargs)

    real = importlib.import_module
    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ImportError, match=r'pip install "\.\[export\]"'):
        record.export(tmp_path / "motion.usda")
    assert not list(tmp_path.iterdir())


# Tables


def test_a_table_has_a_row_for_each_frame_and_node_with_units(record, tmp_path):
    with record.export(tmp_path / "motion.csv").open(newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header[:6] == ["time [s]", "rod", "node", "x [m]", "y [m]", "z [m]"]
    assert all(name.endswith("]") for name in header if name not in ("rod", "node"))
    assert len(rows) == 5 * sum(len(rod.rows) for rod in record.rods)
    column = {name: place for place, name in enumerate(header)}
    for rod in record.rods:
        of_rod = [row for row in rows if row[1] == rod.name]
        shape = (5, len(rod.rows))
        numbers = {
            name: np.array([float(row[place] or "nan") for row in of_rod]).reshape(shape)
            for name, place in column.items()
            if name != "rod"
        }
        np.testing.assert_array_equal(numbers["time [s]"][:, 0], record.times)
        np.testing.assert_array_equal(numbers["node"][0], np.arange(shape[1]))
        for axis, name in enumerate("xyz"):
            np.testing.assert_array_equal(numbers[f"{name} [m]"], record.positions(rod)[..., axis])
            np.testing.assert_array_equal(numbers[f"v{name} [m/s]"], record.velocities(rod)[..., axis])
        inner = slice(None) if rod.closed else slice(1, -1)
        np.testing.assert_array_equal(numbers["curvature_2 [1/m]"][:, inner], record.curvatures(rod)[..., 1])
        np.testing.assert_array_equal(numbers["twist [rad/m]"][:, inner], record.twists(rod))
        assert np.isnan(numbers["twist [rad/m]"][:, 0]).all() == (not rod.closed)
        tensions = record.tensions(rod)
        np.testing.assert_allclose(numbers["tension [N]"][:, 1], (tensions[:, 0] + tensions[:, 1]) / 2)


def test_numpy_reads_a_table_by_its_names(record, tmp_path):
    path = record.export(tmp_path / "motion.csv")
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    tip = table[(table["rod"] == "hand") & (table["node"] == 10)]
    np.testing.assert_array_equal(tip["z_m"], record.positions("hand")[:, -1, 2])


# Errors


@pytest.mark.parametrize("name", ["motion.fbx", "motion.gltf", "motion", "motion.npz"])
def test_an_unknown_suffix_is_refused_with_the_known_ones(record, tmp_path, name):
    known = r"path must end in one of \.csv, \.glb, \.pvd, \.usda, \.usdc, got"
    with pytest.raises(ValueError, match=known + (r".*use save" if name.endswith("npz") else "")):
        record.export(tmp_path / name)


@pytest.mark.parametrize("suffix", [".csv", ".glb", ".pvd", ".usda"])
def test_a_record_without_frames_is_not_exported(tmp_path, suffix):
    with pytest.raises(ValueError, match="no frames"):
        Recorder(CurlingSimulation()).record.export(tmp_path / f"none{suffix}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".csv", ".glb"])
def test_an_export_that_fails_leaves_the_old_file(record, tmp_path, monkeypatch, suffix):
    path = record.export(tmp_path / f"motion{suffix}")
    before = path.read_bytes()

    def fail(self, rod=None):
        raise KeyboardInterrupt

    monkeypatch.setattr(Record, "positions", fail)
    with pytest.raises(KeyboardInterrupt):
        record.export(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_glb_is_written_without_any_package(record, tmp_path, monkeypatch):
    def only(name, *args, **kwargs):
        if name.split(".")[0] in ("pygltflib", "trimesh", "pxr", "pyvista", "matplotlib"):
            raise ModuleNotFoundError(name)
        return real(name, *args, **kwargs)

    real = builtins.__import__
    monkeypatch.setattr(builtins, "__import__", only)
    assert record.export(tmp_path / "motion.glb").read_bytes()[:4] == b"glTF"
