"""Robots from URDF and MJCF files: motion, mass, names, warnings and errors."""

import importlib
import re
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest

import withe
from robot_files import MJCF, motion_in_mujoco, written
from withe.robots import read_robot

mujoco = pytest.importorskip("mujoco")


def mjcf(folder, body, rest="", name="robot.xml"):
    path = folder / name
    path.write_text(f'<mujoco model="robot"><worldbody>{body}</worldbody>{rest}</mujoco>')
    return path


def quietly(call):
    """Return the result of a call and its warnings about robots."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    return result, caught


ARM = """<body name="link" pos="0 0 1"><joint name="hinge" axis="0 1 0"/>
<geom name="bar" type="capsule" fromto="0 0 0 0.2 0 0" size="0.01" mass="0.1"/></body>"""


@pytest.mark.parametrize("suffix", [".xml", ".urdf"])
@pytest.mark.parametrize("name", ["double_pendulum", "scara", "tree"])
def test_a_robot_moves_as_in_mujoco(name, suffix, tmp_path):
    """The robot stands elsewhere and is turned; MuJoCo's gravity is turned instead."""
    path = written(tmp_path, name, suffix)
    scene = withe.Scene()
    place = np.array([0.3, -0.2, 0.1])
    quaternion = np.array([0.8, 0.36, 0.48, 0.0])
    robot = scene.add_robot(path, position=place, rotation=quaternion)
    simulation = scene.build(time_step=5e-4)
    axes = withe.common.validation.rotation_matrix(quaternion, "rotation")
    bodies = motion_in_mujoco(path, 0.3, axes.T @ scene.gravity)
    simulation.step(600)
    assert len(bodies) == {"double_pendulum": 2, "scara": 3, "tree": 4 if suffix == ".xml" else 3}[name]
    for body, (position, rotation) in bodies.items():
        np.testing.assert_allclose(simulation.position(robot[body]), place + axes @ position, atol=1e-4)
        np.testing.assert_allclose(simulation.rotation(robot[body]), axes @ rotation, atol=1e-4)


def test_bodies_that_are_fixed_to_each_other_have_a_common_mass_centre_and_inertia(tmp_path):
    """Two boxes side by side are a box of twice the length."""
    half = '<geom type="box" pos="0.1 0 0" size="0.1 0.05 0.02" mass="1.5"/>'
    path = mjcf(
        tmp_path,
        f'<body name="a" pos="1 2 3" euler="20 0 30"><freejoint/>{half}'
        f'<body name="b" pos="0.4 0 0" euler="0 0 180">{half}</body></body>',
    )
    robot = read_robot(path)
    (body,) = robot.bodies
    whole = withe.solids.Box((0.4, 0.1, 0.04))
    assert body.names == ("a", "b")
    assert body.mass == pytest.approx(3.0)
    np.testing.assert_allclose(body.center, (0.2, 0, 0), atol=1e-12)
    np.testing.assert_allclose(body.inertia, 3.0 * whole.inertia_per_mass, atol=1e-12)
    np.testing.assert_allclose(body.position, (1, 2, 3))
    assert body.solid.volume == pytest.approx(whole.volume)


def test_masses_of_a_urdf_tree_equal_those_of_mujoco(tmp_path):
    """MuJoCo fuses fixed links by itself."""
    path = written(tmp_path, "tree", ".urdf")
    model = mujoco.MjModel.from_xml_path(str(path))
    found = {body.names[0]: body for body in read_robot(path).bodies}
    for name in ("left", "right", "hand"):
        body = model.body(name)
        assert found[name].mass == pytest.approx(body.mass[0])
        np.testing.assert_allclose(found[name].center, body.ipos, atol=1e-9)
        np.testing.assert_allclose(np.linalg.eigvalsh(found[name].inertia), np.sort(body.inertia), rtol=1e-6)


def test_what_is_fixed_to_the_world_is_one_clamped_body(tmp_path):
    scene = withe.Scene()
    robot = scene.add_robot(written(tmp_path, "scara", ".xml"))
    assert isinstance(robot["column"], withe.Body)
    assert isinstance(robot.joints["first"], withe.Joint)
    simulation = scene.build(time_step=1e-3)
    simulation.step(50)
    np.testing.assert_allclose(simulation.position(robot["column"]), (0, 0, 0.1), atol=1e-12)


def test_joints_to_the_world_are_supports_unless_they_have_a_spring_or_a_motor(tmp_path):
    scene = withe.Scene()
    plain = scene.add_robot(mjcf(tmp_path, ARM))
    assert isinstance(plain["hinge"], withe.Support)
    assert list(plain.bodies) == ["link"]
    sprung = scene.add_robot(mjcf(tmp_path, ARM.replace('axis="0 1 0"', 'axis="0 1 0" stiffness="2"')), name="other")
    assert isinstance(sprung["hinge"], withe.Joint)
    assert list(sprung.bodies) == ["base", "link"]
    motor = '<actuator><motor name="motor" joint="hinge"/></actuator>'
    driven, _ = quietly(lambda: scene.add_robot(mjcf(tmp_path, ARM, motor), name="third"))
    assert isinstance(driven["hinge"], withe.Joint)


def test_a_ball_joint_to_the_world_is_a_pin(tmp_path):
    path = mjcf(tmp_path, ARM.replace('axis="0 1 0"', 'type="ball"'))
    scene = withe.Scene()
    robot = scene.add_robot(path)
    simulation = scene.build(time_step=5e-4)
    simulation.step(400)
    (position, rotation) = motion_in_mujoco(path, 0.2, scene.gravity)["link"]
    np.testing.assert_allclose(simulation.position(robot["link"]), position, atol=1e-9)
    np.testing.assert_allclose(simulation.rotation(robot["link"]), rotation, atol=1e-4)


def test_a_slide_to_the_world_falls_along_its_axis(tmp_path):
    path = mjcf(tmp_path, ARM.replace('axis="0 1 0"', 'type="slide" axis="1 0 1"'))
    scene = withe.Scene()
    robot = scene.add_robot(path)
    simulation = scene.build(time_step=1e-3)
    simulation.step(200)
    fall = 0.5 * 9.81 * np.sqrt(0.5) * 0.2**2
    np.testing.assert_allclose(
        simulation.position(robot["link"]), np.array([0, 0, 1]) - fall * np.sqrt(0.5) * np.array([1, 0, 1]), atol=1e-9
    )
    np.testing.assert_allclose(simulation.rotation(robot["link"]), np.eye(3), atol=1e-9)


def test_a_wrist_whose_axes_meet_moves_as_in_mujoco(tmp_path):
    """Three hinges at one point, and two arms on one axis."""
    wrist = """<body name="a" pos="0 0 1"><joint name="ja" axis="0 0 1"/><geom type="sphere" size="0.03" mass="0.2"
 pos="0.05 0 0"/><body name="b"><joint name="jb" axis="0 1 0"/><geom type="sphere" size="0.03" mass="0.2"
 pos="0 0 0.05"/><body name="c"><joint name="jc" axis="1 0 0"/>
 <geom type="sphere" size="0.03" mass="0.3" pos="0.02 0.05 -0.1"/></body>
 <body name="d"><joint name="jd" axis="0 1 0"/><geom type="sphere" size="0.03" mass="0.1" pos="-0.1 0 0"/></body>
 </body></body>"""
    path = mjcf(tmp_path, wrist)
    scene = withe.Scene(gravity=(1.0, 2.0, -9.0))
    robot, _ = quietly(lambda: scene.add_robot(path))
    simulation = scene.build(time_step=5e-4)
    simulation.step(400)
    for body, (position, rotation) in motion_in_mujoco(path, 0.2, scene.gravity).items():
        np.testing.assert_allclose(simulation.position(robot[body]), position, atol=1e-4)
        np.testing.assert_allclose(simulation.rotation(robot[body]), rotation, atol=2e-4)


def test_several_joints_of_one_body_converge_to_the_motion_of_mujoco_at_second_order(tmp_path):
    """Planar roots, hips of three hinges at one point, and slides with a hinge or ball: 10 joints of 4 bodies."""
    path = written(tmp_path, "several_joints", ".xml")
    scene = withe.Scene(gravity=(1.0, 2.0, -9.0))
    robot, _ = quietly(lambda: scene.add_robot(path))
    bodies = motion_in_mujoco(path, 0.2, scene.gravity)
    assert set(robot.bodies) == {"base", *bodies}
    assert len(robot.joints) == 10
    expected = np.concatenate([np.ravel(part) for pose in bodies.values() for part in pose])
    apart = []
    for time_step in (2e-3, 1e-3, 5e-4):
        simulation = scene.build(time_step=time_step)
        before = simulation.energy()
        simulation.step(round(0.2 / time_step))
        after = simulation.energy()
        gain = after.total + after.dissipated - before.total - before.dissipated
        assert abs(gain) < 1e-7 * after.kinetic
        poses = [(simulation.position(robot[body]), simulation.rotation(robot[body])) for body in bodies]
        apart.append(np.concatenate([np.ravel(part) for pose in poses for part in pose]) - expected)
    errors = np.abs(apart).max(axis=1)
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.05)
    assert np.abs(4.0 * apart[2] - apart[1]).max() / 3.0 < 1e-6  # Richardson's extrapolation


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass'")
def test_models_of_gymnasium_load_and_keep_their_energy():
    """Gravity acts across the planes of some robots, so that they fall or press on their joints."""
    folder = Path(pytest.importorskip("gymnasium").__file__).parent / "envs" / "mujoco" / "assets"
    paths = sorted(folder.glob("*.xml"))
    assert len(paths) >= 14
    for path in paths:
        scene = withe.Scene(gravity=(1.0, 2.0, -9.0))
        _, caught = quietly(lambda path=path, scene=scene: scene.add_robot(path))
        assert all(each.category in (withe.UnsupportedRobotWarning, UserWarning) for each in caught)
        simulation = scene.build(time_step=1e-3)
        before = simulation.energy()
        simulation.step(50)
        after = simulation.energy()
        gain = after.total + after.dissipated - before.total - before.dissipated
        assert after.kinetic > 0.0
        assert abs(gain) < 1e-6 * after.kinetic, path.name


def test_bodies_between_joints_are_parts_of_the_scene_and_not_of_the_robot(tmp_path):
    path = mjcf(tmp_path, ARM.replace("<geom", '<joint name="twist" axis="1 0 0"/><geom'))
    scene = withe.Scene()
    robot = scene.add_robot(path)
    assert list(robot.bodies) == ["link"]
    assert list(robot.joints) == ["hinge", "twist"]
    between = scene["link after hinge"]
    part = scene._directory.parts[between.name]
    assert part.mass == pytest.approx(1e-8 * 0.1)
    assert part.solid.volume < 1e-9


def test_a_servo_turns_a_joint_of_the_robot(tmp_path):
    motor = '<actuator><motor name="motor" joint="hinge"/></actuator>'
    scene = withe.Scene()
    robot, _ = quietly(lambda: scene.add_robot(mjcf(tmp_path, ARM, motor)))
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.set(robot.joints["hinge"], stiffness=50.0, damping=2.0)
    simulation.set(robot.joints["hinge"], rest_angle=-0.5, over=0.5)
    simulation.step(400)
    # The weight turns the servo by m g l cos(angle) / stiffness.
    sag = 0.1 * 9.81 * 0.1 * np.cos(0.5) / 50.0
    assert simulation.joint_angle(robot["hinge"]) == pytest.approx(-0.5 + sag, abs=1e-4)


def test_a_rod_is_joined_to_a_body_of_the_robot(tmp_path):
    scene = withe.Scene()
    robot = scene.add_robot(written(tmp_path, "scara", ".xml"))
    tip = robot.points["tip"]
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    end = np.add(tip.position, (0, 0, -0.2))
    cable = scene.add_rod(start=tip.position, end=end, nodes=11, radius=3e-3, material=rubber)
    scene.join(cable.start, robot["quill"])
    simulation = scene.build(time_step=2e-3)
    simulation.step(50)
    quill = simulation.position(robot["quill"]) + simulation.rotation(robot["quill"]) @ (0, 0, -0.08)
    np.testing.assert_allclose(simulation.positions(cable)[0], quill, atol=1e-12)


def test_names_are_those_of_the_file_with_the_robot_in_front_where_they_clash(tmp_path):
    scene = withe.Scene()
    path = mjcf(tmp_path, ARM.replace('"hinge"', '"link"'))
    first, second, third = (scene.add_robot(path, position=(0, y, 0)) for y in range(3))
    assert first.bodies["link"].name == "link"
    assert first.joints["link"].name == "robot link"
    names = [robot[kind].name for robot in (second, third) for kind in ("link",)]
    assert len({"link", "robot link", *names}) == 4
    named = scene.add_robot(path, position=(0, 4, 0), name="left")
    assert named["link"].name == "left link"
    assert scene["left link"] == named["link"]
    with pytest.raises(ValueError, match=r"robot 'left' has no 'lnk'; did you mean 'link'\?"):
        named["lnk"]


def test_fixed_bodies_and_sites_have_names_and_points(tmp_path):
    scene = withe.Scene()
    robot = scene.add_robot(written(tmp_path, "tree", ".urdf"), position=(1, 0, 0))
    assert robot["foot"] == robot["sole"] == robot["left"]
    assert set(robot.points) == {"base", "left", "foot", "sole", "right", "hand"}
    np.testing.assert_allclose(robot.points["left"].position, (1, 0.1, 0), atol=1e-12)
    assert robot.points["sole"].rod == "left"


ALL = """<mujoco model="all"><option gravity="0 0 -1.6" density="1000"/><asset>
<hfield name="hill" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="one" pos="0 0 1" gravcomp="1"><joint name="j1" axis="0 1 0" range="-10 10" armature="0.1"
 frictionloss="0.2"/><geom size="0.1" mass="1"/><site name="s1"/>
<body name="two" pos="0 0 -0.3"><joint name="j2" axis="0 1 0" stiffness="1" actuatorfrcrange="-1 1"/>
<geom size="0.1" mass="1"/></body>
</body><body name="three" pos="0.1 0 1"><joint name="j3" type="ball" damping="0.1"/>
<geom name="g3" size="0.1" mass="1"/>
</body></worldbody>
<actuator><motor name="m1" joint="j1"/></actuator><sensor><jointpos name="p1" joint="j1"/></sensor>
<equality><weld name="w1" body1="two" body2="three"/><joint joint1="j1" joint2="j2"/></equality>
<tendon><fixed name="t1"><joint joint="j1" coef="1"/></fixed></tendon>
<contact><pair name="c1" geom1="floor" geom2="g3"/></contact><keyframe><key name="home"/></keyframe></mujoco>"""


def test_one_warning_names_all_that_is_not_supported(tmp_path):
    path = tmp_path / "all.xml"
    path.write_text(ALL)
    _, caught = quietly(lambda: withe.Scene().add_robot(path))
    (found,) = [each for each in caught if each.category is withe.UnsupportedRobotWarning]
    for line in (
        "force limits of joints 'j2'",
        "armature of joints 'j1'",
        "friction loss of joints 'j1'",
        "damping of ball and free joints 'j3'",
        "equality constraints of type weld 'w1'",
        "equality constraints of type joint 'j1'",
        "actuators 'm1'",
        "tendons 't1'",
        "sensors 'p1'",
        "keyframes 'home'",
        "contact pairs 'c1'",
        "gravity compensation of bodies 'one'",
        "geoms of the world 'floor'",
        "density of the surrounding medium",
        "contact of bodies, such as",
        "gravity (0.0, 0.0, -1.6) m/s^2",
    ):
        assert f"- {line}" in str(found.message), line
    assert str(found.message).splitlines()[0].endswith("without:")
    assert __file__ == found.filename


@pytest.mark.parametrize("suffix", [".xml", ".urdf"])
@pytest.mark.parametrize("name", ["double_pendulum", "scara"])
def test_a_robot_that_is_supported_gives_no_warning(name, suffix, tmp_path):
    _, caught = quietly(lambda: withe.Scene().add_robot(written(tmp_path, name, suffix)))
    assert [str(each.message) for each in caught] == []


def test_limits_of_force_and_velocity_are_those_of_servos(tmp_path):
    """The least of those of a joint and of its actuators, times their gears; both sides of a range."""
    path = written(tmp_path, "double_pendulum", ".urdf")
    limit = '<limit lower="-1" upper="1" effort="3" velocity="2"/></joint></robot>'
    text = path.read_text().replace('"continuous"><parent link="upper"', '"revolute"><parent link="upper"')
    path.write_text(text.replace("</joint></robot>", limit))
    scene = withe.Scene()
    robot, caught = quietly(lambda: scene.add_robot(path))
    assert not caught
    simulation = scene.build()
    assert simulation.get(robot["elbow"], "max_torque") == 3.0
    assert simulation.get(robot["elbow"], "max_speed") == 2.0
    actuators = (
        '<actuator><position name="a" joint="hinge" gear="4" forcerange="-0.5 0.75"/>'
        '<motor name="b" joint="hinge" forcerange="-7 7"/></actuator>'
    )
    scene = withe.Scene()
    robot, _ = quietly(lambda: scene.add_robot(mjcf(tmp_path, ARM, actuators)))
    simulation = scene.build()
    assert simulation.get(robot["hinge"], "max_torque") == 2.0
    assert simulation.get(robot["hinge"], "max_speed") == np.inf
    both = ARM.replace('axis="0 1 0"', 'axis="0 1 0" actuatorfrcrange="-1.5 1.5"')
    scene = withe.Scene()
    robot, _ = quietly(lambda: scene.add_robot(mjcf(tmp_path, both, actuators)))
    assert scene.build().get(robot["hinge"], "max_torque") == 1.5


LINKAGE = """<body name="crank"><joint name="first" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 .1" size=".005" mass="0.1"/>
<body name="coupler" pos="0 0 .1"><joint name="second" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .2 0 .05" size=".005" mass="0.2"/>
<body name="rocker" pos=".2 0 .05"><joint name="third" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -.1" size=".005" mass="0.1"/></body></body></body>"""


def test_a_connect_constraint_closes_a_loop(tmp_path):
    loop = '<equality><connect name="loop" body1="rocker" anchor="0 0 -0.1"/></equality>'
    scene = withe.Scene()
    robot, caught = quietly(lambda: scene.add_robot(mjcf(tmp_path, LINKAGE, loop)))
    assert not any("equality" in str(each.message) for each in caught)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(robot["crank"], angular=(0, 2.0, 0))
    simulation.step(100)
    foot = simulation.position(robot["rocker"]) + simulation.rotation(robot["rocker"]) @ (0, 0, -0.1)
    np.testing.assert_allclose(foot, (0.2, 0, 0.05), atol=1e-9)
    assert np.abs(simulation.position(robot["coupler"])[0]) > 1e-3
    assert np.isfinite(simulation.reaction(robot["loop"]).force).all()


def test_a_connect_constraint_of_points_apart_is_a_warning(tmp_path):
    loop = '<equality><connect name="loop" site1="far" site2="near"/></equality>'
    sites = LINKAGE.replace('<joint name="third"', '<site name="near" pos="0 0 -0.1"/><joint name="third"')
    sites += '<site name="far" pos="0.3 0 0"/>'
    _, caught = quietly(lambda: withe.Scene().add_robot(mjcf(tmp_path, sites, loop)))
    assert any("equality constraints of type connect 'loop'" in str(each.message) for each in caught)


def test_elements_of_urdf_that_mujoco_does_not_read_are_named(tmp_path):
    path = written(tmp_path, "double_pendulum", ".urdf")
    limit = (
        '<limit lower="-1" upper="1" effort="3" velocity="2"/><mimic joint="shoulder"/></joint><transmission/></robot>'
    )
    text = path.read_text().replace('"continuous"><parent link="upper"', '"revolute"><parent link="upper"')
    path.write_text(text.replace("</joint></robot>", limit))
    _, caught = quietly(lambda: withe.Scene().add_robot(path))
    (found,) = caught
    assert "limits of joints" not in str(found.message)
    for line in (
        "elements <transmission> (1)",
        "equality constraints of type joint 'elbow', which the mimic of URDF is too",
    ):
        assert f"- {line}" in str(found.message), line


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [('mass="0.1"', 'mass="2e4"', "has the body 'link' of 2e+04 kg"), ("0.2 0 0", "200 0 0", "has a size of 227 m")],
)
def test_units_that_are_not_si_are_a_warning(old, new, word, tmp_path):
    _, caught = quietly(lambda: withe.Scene().add_robot(mjcf(tmp_path, ARM.replace(old, new))))
    (found,) = [each for each in caught if each.category is withe.PlausibilityWarning]
    assert word in str(found.message)
    assert "m, kg and s" in str(found.message)


def stl(path, triangles):
    """Write a binary STL file."""
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0) for triangle in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + rows)


def test_meshes_of_a_package_are_found_and_drawn(tmp_path):
    """The visual mesh is drawn, and the collision shape is not."""
    solid = withe.solids.Box((0.1, 0.2, 0.3))
    vertices, triangles = solid.surface()
    (tmp_path / "arm_description" / "meshes").mkdir(parents=True)
    (tmp_path / "arm_description" / "urdf").mkdir()
    stl(tmp_path / "arm_description" / "meshes" / "box.stl", vertices[triangles] + (0.5, 0, 0))
    path = written(tmp_path / "arm_description" / "urdf", "double_pendulum", ".urdf")
    shape = (
        '<visual><geometry><mesh filename="package://arm_description/meshes/box.stl"/></geometry></visual>'
        '<collision><geometry><sphere radius="1"/></geometry></collision></link>'
    )
    path.write_text(path.read_text().replace("</visual></link>", f"</visual>{shape}", 1))
    robot, _ = quietly(lambda: read_robot(path))
    upper = next(body for body in robot.bodies if body.names == ("upper",))
    assert upper.solid.volume == pytest.approx(0.04 * 0.04 * 0.2 + 0.1 * 0.2 * 0.3, rel=1e-5)
    corners = upper.solid.surface()[0]
    np.testing.assert_allclose(corners.max(axis=0), (0.55, 0.1, 0.15), atol=1e-6)


def test_an_open_mesh_is_drawn_as_its_hull_and_named(tmp_path):
    vertices, triangles = withe.solids.Box((0.1, 0.2, 0.3)).surface()
    stl(tmp_path / "open.stl", vertices[triangles[:-1]])
    asset = '<asset><mesh name="shell" file="open.stl" inertia="convex"/></asset>'
    body = '<body name="link"><freejoint/><geom type="mesh" mesh="shell" mass="1"/></body>'
    (path, scene) = (mjcf(tmp_path, body, asset), withe.Scene())
    _, caught = quietly(lambda: scene.add_robot(path))
    assert "drawn as convex hulls, of meshes 'shell'" in str(caught[0].message)
    assert read_robot(path).bodies[0].solid.volume == pytest.approx(6e-3, rel=1e-5)


@pytest.mark.parametrize(
    ("shape", "kind"),
    [
        ('type="sphere" size="0.1"', withe.solids.Sphere),
        ('type="box" size="0.1 0.2 0.3"', withe.solids.Box),
        ('type="capsule" size="0.1 0.2"', withe.solids.Capsule),
        ('type="cylinder" size="0.1 0.2"', withe.solids.Cylinder),
        ('type="ellipsoid" size="0.1 0.2 0.3"', withe.solids.Mesh),
    ],
)
def test_a_shape_has_the_volume_of_its_geom(shape, kind, tmp_path):
    """MuJoCo gives a geom the mass of its density times its volume; polyhedra have a little less."""
    for pose in ("", 'pos="0.1 0 0.2" euler="10 20 30"'):
        path = mjcf(tmp_path, f'<body name="link"><freejoint/><geom density="1" {shape} {pose}/></body>')
        (body,) = read_robot(path).bodies
        assert isinstance(body.solid, withe.solids.Mesh if pose else kind)
        assert body.solid.volume == pytest.approx(body.mass, rel=0.03 if pose or kind is withe.solids.Mesh else 1e-9)
        np.testing.assert_allclose(body.solid.center, body.center, atol=1e-9)


def test_a_robot_is_saved_as_bodies_and_joints(tmp_path):
    scene = withe.Scene()
    scene.add_robot(written(tmp_path, "double_pendulum", ".urdf"))
    calls = [call.method for call in scene._declarations]
    assert calls == ["add_body", "add_body", "add_body", "clamp", "join", "join"]


def test_a_saved_robot_moves_as_the_first_one(tmp_path):
    """Joints keep their kinds in scene files, sliding ones too."""
    path = written(tmp_path, "scara", ".urdf")
    path.write_text(re.sub("<visual>.*?</visual>", "", path.read_text()))
    scene = withe.Scene(gravity=(1.0, 0.5, -9.0))
    scene.add_robot(path)
    scene.save(tmp_path / "scene.toml")
    places = []
    for each in (scene, withe.Scene.load(tmp_path / "scene.toml")):
        simulation = each.build(time_step=2e-3)
        simulation.step(50)
        places.append(simulation.position("quill"))
    np.testing.assert_allclose(places[0], places[1], atol=1e-9)
    assert np.linalg.norm(places[0] - scene._directory.parts["quill"].position) > 1e-3


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda path: path.with_name("none.xml"), FileNotFoundError, r"does not exist: .*none\.xml"),
        (lambda path: path.rename(path.with_suffix(".txt")), ValueError, r"must end in \.urdf, \.xml"),
        (lambda path: path.rename(path.with_suffix(".xacro")), ValueError, "xacro robot.xacro > robot.urdf"),
        (lambda path: edited(path, "</worldbody>", ""), ValueError, "is not XML"),
        (lambda path: edited(path, "mujoco", "sdf"), ValueError, "root element robot .* got 'sdf'"),
        (lambda path: edited(path, 'mass="0.1"', 'mass="0"'), ValueError, "MuJoCo cannot read the robot: .*mass"),
        (lambda path: edited(path, ARM, ""), ValueError, "must have a body, got none"),
        (
            lambda path: edited(path, "<geom", '<joint name="twist" axis="0 1 0"/><geom'),
            ValueError,
            "joints 'hinge', 'twist' of body 'link' must move it in different ways, got two that move it alike",
        ),
        (
            lambda path: edited(
                path,
                "<geom",
                "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 0 1", "1 0 1")) + "<geom",
            ),
            ValueError,
            "joints 'hinge', 'joint 1', 'joint 2', 'joint 3' of body 'link' must move it in different ways",
        ),
        (
            lambda path: edited(path, "<worldbody>", '<asset><mesh name="m" file="lost.stl"/></asset><worldbody>'),
            FileNotFoundError,
            r"lost\.stl",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:Inertia matrix is too close to singular")
def test_files_that_are_no_robot_are_refused(change, error, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the working directory
    path = change(mjcf(tmp_path, ARM))
    scene = withe.Scene()
    with pytest.raises(error, match=message):
        scene.add_robot(path)
    assert repr(scene) == "Scene()"


def edited(path, old, new):
    path.write_text(path.read_text().replace(old, new))
    return path


@pytest.mark.parametrize(
    ("file", "error", "message"),
    [
        ("package://arm/lost.stl", FileNotFoundError, "mesh 'package://arm/lost.stl' is missing; looked for"),
        ("lost.stl", FileNotFoundError, "mesh 'lost.stl' is missing"),
        ("shape.dae", ValueError, r"mesh 'shape.dae' must be a file \.stl or \.obj"),
    ],
)
def test_meshes_of_urdf_that_cannot_be_read_are_refused(file, error, message, tmp_path):
    (tmp_path / "shape.dae").write_text("")
    path = written(tmp_path, "double_pendulum", ".urdf")
    edited(path, '<box size="0.04 0.04 0.2"/>', f'<mesh filename="{file}"/>')
    with pytest.raises(error, match=message):
        withe.Scene().add_robot(path)


@pytest.mark.parametrize(
    ("parent", "message"),
    [
        ("lower", "connect links 'upper', 'lower' to a cycle: remove one"),
        ("upper", "connect links 'upper' to a cycle: remove one"),
    ],
)
def test_a_cycle_of_urdf_is_refused(parent, message, tmp_path):
    path = written(tmp_path, "double_pendulum", ".urdf")
    edited(path, '<parent link="base"', f'<parent link="{parent}"')
    with pytest.raises(ValueError, match=message):
        withe.Scene().add_robot(path)


def test_a_link_with_two_parents_is_refused(tmp_path):
    path = written(tmp_path, "double_pendulum", ".urdf")
    edited(path, '<child link="lower"', '<child link="upper"')
    with pytest.raises(ValueError, match="link 'upper' must have one parent, got 'base' and 'upper'"):
        withe.Scene().add_robot(path)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"position": (0, 0)}, "position of the robot"),
        ({"rotation": (0, 0, 0, 2)}, "rotation of the robot"),
        ({"name": ""}, "name of the robot"),
    ],
)
def test_arguments_are_checked_before_anything_is_added(words, message, tmp_path):
    scene = withe.Scene()
    with pytest.raises(ValueError, match=message):
        scene.add_robot(mjcf(tmp_path, ARM), **words)
    assert repr(scene) == "Scene()"


def test_without_mujoco_the_error_names_the_extra(tmp_path, monkeypatch):
    real = importlib.import_module

    def missing(name, *arguments):
        if name == "mujoco":
            raise ModuleNotFoundError("No module named 'mujoco'", name="mujoco")
        return real(name, *arguments)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ImportError, match=r"needs the package mujoco, .*\[robots\]"):
        withe.Scene().add_robot(mjcf(tmp_path, ARM))


def test_a_solid_beside_an_inertia_is_only_drawn():
    scene = withe.Scene()
    box = withe.solids.Box((0.1, 0.1, 0.1))
    body = scene.add_body(box, mass=2.0, inertia=(0.1, 0.2, 0.25), center=(0, 0, 0.3))
    part = scene._directory.parts[body.name]
    np.testing.assert_allclose(np.diag(part.inertia), (0.1, 0.2, 0.25))
    np.testing.assert_allclose(part.center, (0, 0, 0.3))
    assert part.solid is box
    for words, message in (
        ({"density": 1.0, "inertia": 1.0}, "needs mass= and no density="),
        ({"inertia": 1.0}, "needs mass= and no density="),
        ({"mass": 1.0, "center": (0, 0, 1)}, "follows from its solid"),
    ):
        with pytest.raises(ValueError, match=message):
            scene.add_body(box, **words)


def test_the_files_of_these_tests_are_read_by_mujoco():
    """A fault of the files would otherwise look like one of the reader."""
    for text in MJCF.values():
        mujoco.MjModel.from_xml_string(text)


STOPPED = """
<mujoco><option gravity="0 0 -9.81" timestep="0.0005"/><worldbody>
  <body name="wall"><geom contype="0" conaffinity="0" type="box" size=".01 .01 .01"/>
    <body name="bar"><joint name="hinge" axis="0 1 0" range="-20 30" limited="true" damping="0.05"/>
      <geom contype="0" conaffinity="0" type="box" size=".15 .01 .01" pos=".15 0 0" mass=".3"/></body></body>
  <body name="sledge" pos="0 1 0"><joint name="rail" type="slide" axis="0 0 1" range="-.1 .2" damping="1"/>
    <geom contype="0" conaffinity="0" type="box" size=".02 .02 .02" mass=".2"/></body>
</worldbody></mujoco>
"""


def test_limits_of_joints_bear_loads_as_those_of_mujoco(tmp_path: Path) -> None:
    """A bar and a sledge fall on their stops, which yield by a similar amount."""
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "stopped.xml"
    path.write_text(STOPPED)
    scene = withe.Scene()
    robot = scene.add_robot(path)
    simulation = scene.build(time_step=2e-3, integrator="backward_euler")
    simulation.run(4.0, progress=False)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for _ in range(8000):
        mujoco.mj_step(model, data)
    for name, limit in (("hinge", np.radians(30.0)), ("rail", -0.1)):
        theirs = float(data.joint(name).qpos[0]) - limit
        ours = simulation.joint_angle(robot.joints[name]) - limit
        assert abs(theirs) > 1e-5
        assert ours == pytest.approx(theirs, rel=0.5)  # MuJoCo's stiffness doubles over the first 1e-3


def test_a_joint_drawn_outside_of_its_limits_is_named(tmp_path: Path) -> None:
    """It gets no limits."""
    pytest.importorskip("mujoco")
    path = tmp_path / "outside.xml"
    path.write_text(STOPPED.replace('range="-20 30"', 'range="10 30"'))
    with pytest.warns(withe.UnsupportedRobotWarning, match="limits that exclude the drawn place of joints 'hinge'"):
        withe.Scene().add_robot(path)
