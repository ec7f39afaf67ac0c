"""Rigid bodies in records, pictures and files: what is drawn and written is what the simulation computes."""

import csv
import json
import pickle
import struct
import zipfile

import numpy as np
import pytest

import withe
from withe.common.outlines import BodyOutline
from withe.recording import Record
from withe.recording.recorder import present
from withe.view import rendering
from withe.view.bodies import body_points, mixed_rotations, shaded, silhouette

SOLIDS = {
    "sphere": withe.solids.Sphere(0.02),
    "box": withe.solids.Box((0.03, 0.02, 0.05)),
    "cylinder": withe.solids.Cylinder(0.02, 0.05),
    "capsule": withe.solids.Capsule(0.01, 0.04),
    "mesh": withe.solids.Mesh(
        np.array([[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0], [0, 0, 0.04]]), [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    ),
}


def plugged():
    """A cable with a plug, a block without shape on it, and a ball in a fall."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e7, density=1100.0)
    cable = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=3e-3, material=rubber, name="cable")
    scene.clamp(cable.start)
    plug = scene.add_body(
        withe.solids.Box((0.03, 0.02, 0.05)),
        density=1200.0,
        position=(0.21, 0, 0),
        rotation=(0.5, 0.5, 0.5, 0.5),
        name="plug",
    )
    scene.join(cable.end, plug)
    scene.add_body(mass=0.1, inertia=(1e-5, 2e-5, 2e-5), center=(0.01, 0, 0), position=(0, 0.1, 0), name="stone")
    scene.add_body(withe.solids.Sphere(0.02), density=500.0, position=(0.1, 0.1, 0.1), name="ball")
    return scene


@pytest.fixture(scope="module")
def simulation():
    made = plugged().build(time_step=2e-3)
    made.set_velocity("stone", angular=(3.0, 1.0, 2.0))
    return made


@pytest.fixture(scope="module")
def record(simulation):
    return simulation.copy().run(0.04, 0.01, progress=False)


@pytest.fixture(scope="module")
def tumbling():
    """A body alone: a scene without rods."""
    scene = withe.Scene(gravity=(0, 0, 0))
    body = scene.add_body(withe.solids.Box((0.1, 0.06, 0.02)), density=500.0, name="block")
    simulation = scene.build(time_step=5e-3)
    simulation.set_velocity(body, (0.2, 0, 0), angular=(0.1, 6.0, 0.2))
    return simulation.run(0.2, 0.05, progress=False)


def volume(points, triangles):
    return float(np.linalg.det(points[triangles]).sum() / 6.0)


def test_poses_of_bodies_are_those_of_the_simulation(simulation, record):
    again = simulation.copy()
    assert [body.name for body in record.bodies] == ["plug", "stone", "ball"]
    for frame in range(len(record)):
        for name in ("plug", "stone", "ball"):
            np.testing.assert_array_equal(record.body_position(name)[frame], again.position(name))
            np.testing.assert_array_equal(record.body_rotation(name)[frame], again.rotation(name))
        again.step(5)
    assert "bodies plug, stone, ball" in repr(record)


def test_a_body_is_given_by_handle_outline_or_name(record):
    handle = plugged()["plug"]
    for body in ("plug", handle, record.bodies[0]):
        np.testing.assert_array_equal(record.body_position(body), record.body_position("plug"))
    record.body_position("plug")[:] = 0.0  # a copy
    assert record.body_position("plug").any()
    with pytest.raises(ValueError, match="body must be one of 'plug', 'stone', 'ball' or its handle, got 'cable'"):
        record.body_rotation("cable")


def test_records_with_bodies_come_back_bit_for_bit(record, tmp_path):
    for kept in (Record.load(record.save(tmp_path / "kept.npz")), pickle.loads(pickle.dumps(record))):
        for name in ("plug", "stone", "ball"):
            np.testing.assert_array_equal(kept.body_position(name), record.body_position(name))
            np.testing.assert_array_equal(kept.body_rotation(name), record.body_rotation(name))
        for ours, theirs in zip(kept.bodies, record.bodies, strict=True):
            np.testing.assert_array_equal(ours.vertices, theirs.vertices)
            np.testing.assert_array_equal(ours.triangles, theirs.triangles)
        assert kept.positions().shape == record.positions().shape


def test_a_file_without_the_entry_of_bodies_is_still_read(tmp_path):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e7, density=1100.0)
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=3e-3, material=rubber)
    path = scene.build().run(0.01, 0.01, progress=False).save(tmp_path / "new.npz")
    with np.load(path) as arrays:
        kept = dict(arrays)
    header = json.loads(str(kept["header"]))
    del header["bodies"]
    kept["header"] = np.array(json.dumps(header))
    np.savez(tmp_path / "old.npz", **kept)
    assert Record.load(tmp_path / "old.npz").bodies == ()


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("body_0_position", np.zeros((3, 3)), "body_0_position"),
        ("body_1_rotation", np.zeros((5, 4)), "body_1_rotation"),
        ("body_0_triangles", np.array([[0, 1, 99]]), "triangles of body 'plug' must lie in"),
        ("body_0_triangles", np.zeros((0, 3), int), "triangles of body 'plug'"),
        ("body_0_vertices", np.zeros((8, 2)), "vertices of body 'plug'"),
    ],
)
def test_damaged_bodies_in_a_file_are_named(record, tmp_path, key, value, message):
    path = record.save(tmp_path / "kept.npz")
    with np.load(path) as arrays:
        kept = dict(arrays) | {key: value}
    np.savez(path, **kept)
    with pytest.raises(ValueError, match=message):
        Record.load(path)


@pytest.mark.parametrize("kind", SOLIDS)
def test_surfaces_are_closed_face_outwards_and_enclose_their_volume(kind):
    solid = SOLIDS[kind]
    scene = withe.Scene()
    scene.add_body(solid, density=1000.0, name="body")
    (body,) = present(scene.build(), bodies=_bodies(scene)).bodies
    assert volume(body.vertices, body.triangles) == pytest.approx(solid.volume, rel=0.03)
    edges = np.concatenate([body.triangles[:, [0, 1]], body.triangles[:, [1, 2]], body.triangles[:, [2, 0]]])
    assert len({tuple(edge) for edge in edges.tolist()}) == len(edges)
    assert {tuple(edge) for edge in edges.tolist()} == {tuple(edge[::-1]) for edge in edges.tolist()}
    points, normals = shaded(body)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    outwards = points - body.vertices.mean(axis=0)
    assert (np.einsum("ni,ni->n", outwards, normals) > 0.0).all()


def _bodies(scene):
    return scene.build().run(1e-3, 1e-3, progress=False).bodies


def test_a_body_without_a_solid_is_a_ball_of_its_radius_of_gyration(record):
    stone = record.bodies[1]
    assert volume(stone.vertices, stone.triangles) == pytest.approx(4.0 / 3.0 * np.pi * (5e-5 / 0.3) ** 1.5, rel=0.03)
    np.testing.assert_allclose(stone.vertices.mean(axis=0), (0.01, 0, 0), atol=1e-9)


def test_edges_of_a_box_are_sharp_and_a_ball_is_smooth():
    box, ball = (BodyOutline(name, *SOLIDS[name].surface()) for name in ("box", "sphere"))
    normals = np.unique(np.round(shaded(box)[1], 12), axis=0)
    np.testing.assert_array_equal(np.sort(np.abs(normals), axis=1), np.tile([0.0, 0, 1.0], (6, 1)))
    points, normals = shaded(ball)
    inner = np.abs(points[:, 2]) < 0.015
    assert (np.einsum("ni,ni->n", points, normals)[inner] > 0.0198).all()


def test_the_silhouette_of_a_box_is_its_outline():
    box = BodyOutline("box", *SOLIDS["box"].surface())
    edges = silhouette(box.vertices, box.triangles, np.array([0.0, 1.0, 0.0]))
    lengths = np.linalg.norm(np.diff(box.vertices[edges], axis=1)[:, 0], axis=1)
    assert sorted(np.round(lengths, 12)) == [0.03, 0.03, 0.05, 0.05]


def test_rotations_between_frames_are_rotations():
    half = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    mixed = mixed_rotations(np.eye(3), half, 0.5)
    np.testing.assert_allclose(mixed @ (1, 0, 0), np.array([1, 1, 0]) / np.sqrt(2.0), atol=1e-12)
    assert np.linalg.det(mixed) == pytest.approx(1.0)


# Figures and pictures


def test_a_planar_motion_of_bodies_is_drawn_by_silhouettes():
    pytest.importorskip("matplotlib").use("Agg")
    scene = withe.Scene()
    bar = scene.add_body(withe.solids.Box((0.2, 0.02, 0.02)), density=500.0, position=(0.1, 0, 0))
    scene.clamp(bar, at=(0, 0, 0), spin=(0, 1, 0))
    record = scene.build(time_step=5e-3).run(0.1, 0.05, progress=False)
    axes = record.plot(shapes=3).axes[0]
    assert axes.name != "3d"
    lines = [each for each in axes.collections if type(each).__name__ == "LineCollection"]
    assert [len(each.get_segments()) for each in lines] == [4, 4, 4]
    _, high = axes.dataLim.get_points()
    np.testing.assert_allclose(high[0], 200.5, atol=0.6)  # mm: the corner of the bar, not only its joint


def test_a_tumbling_body_is_drawn_in_space(tumbling):
    pytest.importorskip("matplotlib").use("Agg")
    assert tumbling.plot(shapes=2).axes[0].name == "3d"


def test_the_axis_of_a_constant_energy_does_not_magnify_rounding(tumbling):
    pytest.importorskip("matplotlib").use("Agg")
    energies = next(axes for axes in tumbling.plot().axes if axes.get_ylabel().startswith("energy"))
    assert energies.get_ylim()[0] == 0.0


@pytest.mark.slow
def test_bodies_stand_in_the_picture_turn_and_cast_shadows(tumbling, renderer):
    stage = rendering.Stage(tumbling, size=(160, 120), ground=-0.15)
    try:
        first = stage.image().astype(int)
        stage.show(2.5)
        half = stage.image().astype(int)
        (actor,) = stage._bodies._actors
        matrix = np.asarray(actor.user_matrix)
        mean = 0.5 * (tumbling.body_position("block")[2] + tumbling.body_position("block")[3])
        np.testing.assert_allclose(matrix[:3, 3], mean)
        np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-12)
        ((_, areas),) = stage._bodies.casting
        turn = matrix[:3, :3]
        exact = sum(abs(turn[2, i]) * np.prod(np.delete((0.1, 0.06, 0.02), i)) for i in range(3))
        assert areas.sum() == pytest.approx(exact, rel=1e-9)
        assert np.abs(half - first).max() > 40
        stage.show_present(tumbling)
        np.testing.assert_allclose(np.asarray(actor.user_matrix)[:3, 3], tumbling.body_position("block")[0])
    finally:
        stage.close()
    with pytest.raises(ValueError, match="color_by must be 'rod' for a record without rods, got 'tension'"):
        rendering.Stage(tumbling, color_by="tension")


@pytest.mark.slow
def test_live_views_and_sliders_draw_bodies(renderer):
    scene = withe.Scene(gravity=(0, 0, 0))
    body = scene.add_body(withe.solids.Box((0.1, 0.06, 0.02)), density=500.0, name="block")
    scene.pin(body, at=(0.05, 0, 0))
    push = scene.add_moment(body, (0, 0.01, 0))
    simulation = scene.build(time_step=5e-3)
    with simulation.view(live=True, size=(160, 120)) as view:
        first = view.image().astype(int)
        simulation.step(30)
        view.update()
        assert np.abs(view.image() - first).max() > 40
    view.close()
    assert simulation.get(push, "moment")[1] == 0.01


def test_the_camera_sees_the_surfaces_of_bodies(tumbling):
    points = body_points(tumbling)
    assert np.ptp(body_points(tumbling, [0]), axis=0) == pytest.approx((0.1, 0.06, 0.02))
    assert points[:, 0].max() > tumbling.positions()[:, 0, 0].max() + 0.02


# Files for other programs


def test_a_glb_has_a_node_for_each_body_that_moves_and_turns(record, tmp_path):
    data = record.export(tmp_path / "motion.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document, block = json.loads(data[20 : 20 + length]), data[28 + length :]

    def numbers(index, width):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        return np.frombuffer(block, "<f4", accessor["count"] * width, view["byteOffset"]).reshape(-1, width)

    index = next(i for i, node in enumerate(document["nodes"]) if node.get("name") == "stone")
    assert "mesh" in document["nodes"][index]
    assert index in document["nodes"][0]["children"]
    motion = document["animations"][0]
    channels = {
        each["target"]["path"]: motion["samplers"][each["sampler"]]["output"]
        for each in motion["channels"]
        if each["target"]["node"] == index
    }
    np.testing.assert_allclose(numbers(channels["translation"], 3), record.body_position("stone"), atol=1e-6)
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_quat(numbers(channels["rotation"], 4)).as_matrix()
    np.testing.assert_allclose(turns, record.body_rotation("stone"), atol=1e-6)


def test_usd_meshes_stand_where_the_bodies_are(record, tmp_path):
    usd, geometry = (pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom"))
    stage = usd.Stage.Open(str(record.export(tmp_path / "motion.usda")))
    for body in record.bodies:
        mesh = geometry.Mesh(stage.GetPrimAtPath(f"/withe/{body.name}"))
        assert mesh.GetPrim().GetCustomDataByKey("body") == body.name
        for frame, code in ((0, 0.0), (3, 3.0)):
            pose = mesh.ComputeLocalToWorldTransform(code)
            points = [pose.Transform(point) for point in mesh.GetPointsAttr().Get()]
            exact = body.placed(record.body_position(body), record.body_rotation(body))[frame]
            np.testing.assert_allclose(points, exact, atol=1e-7)


def test_a_table_has_a_row_for_each_frame_and_body(record, tmp_path):
    with record.export(tmp_path / "motion.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(record) * (11 + 3)
    mine = [row for row in rows if row["body"] == "plug"]
    np.testing.assert_array_equal([float(row["z [m]"]) for row in mine], record.body_position("plug")[:, 2])
    assert [float(mine[0][f"q{each} [-]"]) for each in "wxyz"] == pytest.approx([0.5] * 4, abs=1e-9)
    assert {row["node"] for row in mine} == {row["rod"] for row in mine} == {""}
    assert {row["qw [-]"] for row in rows if row["rod"]} == {""}


def test_vtk_reads_rods_and_bodies_as_two_parts(record, tumbling, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = record.to_vtk(tmp_path / "both")
    assert path.read_text().count('part="0"') == path.read_text().count('part="1"') == len(record)
    surfaces = pyvista.read(tmp_path / "both" / "bodies_0003.vtp")
    exact = [body.placed(record.body_position(body), record.body_rotation(body))[3] for body in record.bodies]
    np.testing.assert_array_equal(surfaces.points, np.concatenate(exact))
    assert list(np.unique(surfaces.cell_data["body"])) == [0, 1, 2]
    assert list(surfaces.field_data["body_names"]) == ["plug", "stone", "ball"]
    assert len(list(tumbling.to_vtk(tmp_path / "alone").parent.glob("frame_*"))) == 0


def test_every_format_takes_a_scene_without_rods(tumbling, tmp_path):
    pytest.importorskip("pxr.Usd")
    for suffix in ("glb", "usda", "csv", "pvd", "npz"):
        path = tmp_path / f"alone.{suffix}"
        assert (tumbling.save(path) if suffix == "npz" else tumbling.export(path)).stat().st_size > 100
    assert zipfile.is_zipfile(tmp_path / "alone.npz")
