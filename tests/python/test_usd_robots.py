"""Robots from USD files: units, axes, masses, joints, warnings and errors."""

import importlib
import re
import warnings

import numpy as np
import pytest

import withe
from robot_files import written
from withe.robots import read_robot

Usd = pytest.importorskip("pxr.Usd")
from pxr import Gf, Sdf, UsdGeom, UsdPhysics, UsdShade  # noqa: E402

NO_TURN = np.eye(3)


def new_stage(path, *, length=1.0, mass=1.0, up="Z"):
    """Return a stage with its units [m], [kg] and up axis."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, length)
    UsdPhysics.SetStageKilogramsPerUnit(stage, mass)
    UsdGeom.SetStageUpAxis(stage, up)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/robot").GetPrim())
    return stage


def quaternion(rotation, kind=Gf.Quatf):
    matrix = Gf.Matrix3d(*np.asarray(rotation, float).T.ravel().tolist())
    return kind(matrix.ExtractRotation().GetQuat())


def add_body(stage, name, position=(0, 0, 0), rotation=None):
    """Add a rigid body to a stage; positions are in units of the stage."""
    form = UsdGeom.Xform.Define(stage, f"/robot/{name}")
    form.AddTranslateOp().Set(Gf.Vec3d(*map(float, position)))
    form.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(
        quaternion(np.eye(3) if rotation is None else rotation, Gf.Quatd)
    )
    UsdPhysics.RigidBodyAPI.Apply(form.GetPrim())
    return form.GetPrim()


def set_mass(prim, mass=None, center=None, inertia=None, density=None):
    api = UsdPhysics.MassAPI.Apply(prim)
    if mass is not None:
        api.CreateMassAttr(float(mass))
    if density is not None:
        api.CreateDensityAttr(float(density))
    if center is not None:
        api.CreateCenterOfMassAttr(Gf.Vec3f(*map(float, center)))
    if inertia is not None:
        moments, axes = np.linalg.eigh(np.asarray(inertia, float))
        axes[:, 0] *= np.linalg.det(axes)
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
        api.CreatePrincipalAxesAttr(quaternion(axes))


def collider(stage, kind, path, **words):
    shape = getattr(UsdGeom, kind).Define(stage, path)
    for word, value in words.items():
        shape.GetPrim().GetAttribute(word).Set(value)
    UsdPhysics.CollisionAPI.Apply(shape.GetPrim())
    return shape


def add_joint(stage, kind, name, bodies, places, axis="Z", turns=(NO_TURN, NO_TURN)):
    joint = getattr(UsdPhysics, f"{kind}Joint").Define(stage, f"/robot/{name}")
    for i, (body, place, turn) in enumerate(zip(bodies, places, turns, strict=True)):
        if body is not None:
            getattr(joint, f"CreateBody{i}Rel")().SetTargets([body.GetPath()])
        getattr(joint, f"CreateLocalPos{i}Attr")(Gf.Vec3f(*map(float, place)))
        getattr(joint, f"CreateLocalRot{i}Attr")(quaternion(turn))
    if kind in ("Revolute", "Prismatic"):
        joint.CreateAxisAttr(axis)
    return joint


def drive(joint, kind, **words):
    api = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), kind)
    for word, value in words.items():
        getattr(api, f"Create{word}Attr")(value)


def quietly(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    return result, caught


UP = {"Z": np.eye(3), "Y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])}  # of the stage, by our axes


def stage_of(robot, path, length, mass, up):
    """Write a description as a USD file, by the definitions of UsdPhysics."""
    stage = new_stage(path, length=length, mass=mass, up=up)
    turn = UP[up]
    prims = []
    for body in robot.bodies:
        prim = add_body(stage, body.names[0].replace(" ", "_"), turn @ body.position / length, turn @ body.rotation)
        set_mass(prim, body.mass / mass, body.center / length, body.inertia / (mass * length**2))
        if body.is_fixed:
            add_joint(
                stage,
                "Fixed",
                "hold",
                (None, prim),
                (turn @ body.position / length, np.zeros(3)),
                turns=(turn @ body.rotation, np.eye(3)),
            )
        prims.append(prim)
    kinds = {"revolute": "Revolute", "sliding": "Prismatic", "pinned": "Spherical"}
    for number, joint in enumerate(robot.joints):
        ends = [None if joint.parent is None else robot.bodies[joint.parent], robot.bodies[joint.child]]
        letter = "XYZ"[number % 3]
        axes = np.eye(3)
        if joint.axis is not None:
            across = np.linalg.svd(joint.axis[None])[2][1]
            axes = np.roll(np.column_stack([joint.axis, across, np.cross(joint.axis, across)]), number % 3, axis=1)
        places, turns = [], []
        for body in ends:
            origin = np.zeros(3) if body is None else body.position
            own = turn.T if body is None else body.rotation
            places.append(own.T @ (joint.at - origin) / length)
            turns.append(own.T @ axes)
        pair = (None if joint.parent is None else prims[joint.parent], prims[joint.child])
        found = add_joint(stage, kinds[joint.kind], joint.name.replace(" ", "_"), pair, places, letter, turns)
        if joint.kind == "revolute":
            rate = np.radians(1.0) / (mass * length**2)  # per degree
            drive(
                found,
                "angular",
                Stiffness=rate * joint.stiffness,
                Damping=rate * joint.damping,
                TargetPosition=np.degrees(joint.rest_angle),
            )
        if joint.kind == "sliding":
            drive(
                found,
                "linear",
                Stiffness=joint.stiffness / mass,
                Damping=joint.damping / mass,
                TargetPosition=joint.rest_angle / length,
            )
    UsdPhysics.Scene.Define(stage, "/robot/physics").CreateGravityMagnitudeAttr(9.81 / length)
    stage.GetRootLayer().Save()
    return path


@pytest.mark.parametrize(
    ("length", "mass", "up", "suffix"),
    [(1.0, 1.0, "Z", ".usda"), (0.01, 0.001, "Y", ".usdc"), (0.0254, 14.6, "Z", ".usd")],
)
@pytest.mark.parametrize("name", ["double_pendulum", "scara", "tree"])
def test_a_robot_of_usd_equals_that_of_mjcf(name, length, mass, up, suffix, tmp_path):
    """USD stores places and masses in single precision."""
    pytest.importorskip("mujoco")
    expected = read_robot(written(tmp_path, name, ".xml"))
    found = read_robot(stage_of(expected, tmp_path / f"{name}{suffix}", length, mass, up))
    assert found.unsupported == ()
    assert found.doubts == ()
    np.testing.assert_allclose(found.gravity, (0, 0, -9.81), atol=1e-6 if length == 0.0254 else 1e-12)
    bodies = {body.names[0]: body for body in found.bodies}
    assert len(bodies) == len(expected.bodies)
    for body in expected.bodies:
        own = bodies[body.names[0]]
        assert own.is_fixed == body.is_fixed
        assert own.mass == pytest.approx(body.mass, rel=1e-6)
        np.testing.assert_allclose(own.center, body.center, atol=1e-7)
        np.testing.assert_allclose(own.inertia, body.inertia, atol=1e-6 * np.abs(body.inertia).max())
        np.testing.assert_allclose(own.position, body.position, atol=1e-7)
        np.testing.assert_allclose(own.rotation, body.rotation, atol=1e-6)
    joints = {joint.name: joint for joint in found.joints}
    assert len(joints) == len(expected.joints)
    order = [body.names[0] for body in found.bodies]
    for joint in expected.joints:
        own = joints[joint.name.replace(" ", "_")]
        assert own.kind == joint.kind
        assert order[own.child] == expected.bodies[joint.child].names[0]
        assert own.parent is None or order[own.parent] == expected.bodies[joint.parent].names[0]
        np.testing.assert_allclose(own.at, joint.at, atol=1e-6)
        if joint.axis is not None:
            np.testing.assert_allclose(own.axis, joint.axis, atol=1e-6)
        for word in ("stiffness", "rest_angle", "damping"):
            assert getattr(own, word) == pytest.approx(getattr(joint, word), rel=1e-5, abs=1e-6), word


def test_a_pendulum_in_centimetres_and_grams_with_y_up_has_its_period(tmp_path):
    """A rod of 0.3 m on a hinge swings with omega^2 = 3 g / (2 L) [Goldstein, chapter 5]."""
    stage = new_stage(tmp_path / "pendulum.usda", length=0.01, mass=0.001, up="Y")
    bar = add_body(stage, "bar", (0.3, 85.0, 0.0))
    shape = collider(stage, "Cube", "/robot/bar/shape", size=1.0)
    shape.AddScaleOp().Set(Gf.Vec3f(1.0, 30.0, 1.0))
    add_joint(stage, "Revolute", "hinge", (bar, None), ((-0.3, 15.0, 0.0), (0.0, 100.0, 0.0)))
    stage.GetRootLayer().Save()
    scene = withe.Scene()
    robot = scene.add_robot(tmp_path / "pendulum.usda", position=(2.0, 0.0, 0.0))
    assert isinstance(robot["hinge"], withe.Support)
    simulation = scene.build(time_step=1e-3)
    np.testing.assert_allclose(simulation.position(robot["bar"]), (2.003, 0.0, 0.85), atol=1e-7)
    part = scene._directory.parts["bar"]
    assert part.mass == pytest.approx(1000.0 * 0.3 * 1e-4)
    assert isinstance(part.solid, withe.solids.Box)
    squared = part.mass * 9.81 * np.hypot(0.15, 0.003) / (part.inertia[1, 1] + part.mass * (0.15**2 + 0.003**2))
    quarter = 0.5 * np.pi / np.sqrt(squared)
    simulation.step(round(quarter / 1e-3))
    swung = simulation.position(robot["bar"]) - (2.0, 0.0, 1.0)
    # At a quarter of its period the bar hangs, with its centre below the hinge.
    assert abs(swung[0]) < 0.01 * 0.003
    assert swung[2] == pytest.approx(-np.hypot(0.15, 0.003), rel=1e-4)


def test_a_drive_has_degrees_and_the_angle_at_which_the_file_draws_the_joint(tmp_path):
    """A servo of 2 N m/rad with its target at 50 degrees, whose body is drawn at 20 degrees."""
    stage = new_stage(tmp_path / "servo.usda")
    turn = withe.common.validation.rotation_matrix((np.cos(np.radians(10)), 0, 0, np.sin(np.radians(10))), "turn")
    base, arm = add_body(stage, "base"), add_body(stage, "arm", (1.0, 0.0, 0.0), turn)
    for body in (base, arm):
        set_mass(body, 1.0, (0, 0, 0), np.diag((0.1, 0.2, 0.25)))
    add_joint(stage, "Fixed", "hold", (None, base), np.zeros((2, 3)))
    for i, pair in enumerate([(base, arm), (arm, base)]):
        places = ((1.0, 0, 0), (0, 0, 0))
        joint = add_joint(stage, "Revolute", f"joint{i}", pair, places if i == 0 else places[::-1])
        drive(
            joint,
            "angular",
            Stiffness=2 * np.radians(1.0),
            TargetPosition=50.0 * (1 - 2 * i),
            Damping=0.1 * np.radians(1.0),
            MaxForce=0.75,
        )
        joint.GetJointEnabledAttr().Set(False)
    for i in range(2):
        for k in range(2):
            stage.GetPrimAtPath(f"/robot/joint{k}").GetAttribute("physics:jointEnabled").Set(k == i)
        stage.GetRootLayer().Save()
        robot = read_robot(tmp_path / "servo.usda")
        (joint,) = robot.joints
        assert (joint.parent, joint.child) == (0, 1)
        np.testing.assert_allclose(joint.axis * joint.rest_angle, (0, 0, np.radians(30.0)), atol=1e-6)
        assert joint.stiffness == pytest.approx(2.0, rel=1e-6)
        assert joint.damping == pytest.approx(0.1, rel=1e-6)
        assert joint.max_torque == 0.75
        assert robot.unsupported == (f"disabled joints 'joint{1 - i}'",)
    scene = withe.Scene(gravity=(0, 0, 0))
    robot, _ = quietly(lambda: scene.add_robot(tmp_path / "servo.usda"))
    simulation = scene.build(integrator="backward_euler", time_step=0.02)
    simulation.step(3000)
    x, y = simulation.rotation(robot["arm"])[:2, 0]
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(50.0, abs=1e-3)


def shapes_of_all_kinds(stage, body):
    """Add colliders of all kinds, turned and scaled, with masses and densities of their own."""
    root = str(body.GetPath())
    sphere = collider(stage, "Sphere", f"{root}/sphere", radius=0.3)
    sphere.AddTranslateOp().Set(Gf.Vec3d(0.2, 0.1, -0.3))
    capsule = collider(stage, "Capsule", f"{root}/capsule", radius=0.1, height=0.5, axis="X")
    capsule.AddTranslateOp().Set(Gf.Vec3d(-0.2, 0.4, 0.1))
    capsule.AddRotateXYZOp().Set(Gf.Vec3f(10, 40, 70))
    set_mass(capsule.GetPrim(), density=700.0)
    cylinder = collider(stage, "Cylinder", f"{root}/cylinder", radius=0.2, height=0.6, axis="Y")
    cylinder.AddTranslateOp().Set(Gf.Vec3d(0.5, 0.4, 0.1))
    set_mass(cylinder.GetPrim(), mass=31.0)
    cube = collider(stage, "Cube", f"{root}/cube", size=0.4)
    cube.AddTranslateOp().Set(Gf.Vec3d(-0.5, 0.0, 0.0))
    cube.AddRotateZOp().Set(30.0)
    material = UsdShade.Material.Define(stage, "/robot/lead")
    UsdPhysics.MaterialAPI.Apply(material.GetPrim()).CreateDensityAttr(3000.0)
    UsdShade.MaterialBindingAPI.Apply(cube.GetPrim()).Bind(material, UsdShade.Tokens.weakerThanDescendants, "physics")


@pytest.mark.parametrize(
    ("words", "total"),
    [
        ({}, None),
        ({"density": 500.0}, None),
        ({"mass": 12.0}, 12.0),
        ({"mass": 12.0, "center": (0.1, 0.2, 0.3), "inertia": np.diag((3.0, 4.0, 5.0))}, 12.0),
    ],
)
def test_mass_properties_equal_those_of_usd(words, total, tmp_path):
    """UsdPhysics asks for volumes and inertias of colliders, and combines them by its rules."""
    stage = new_stage(tmp_path / "body.usda")
    prim = add_body(stage, "body", (3.0, 2.0, 1.0), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]))
    shapes_of_all_kinds(stage, prim)
    set_mass(prim, **words)
    stage.GetRootLayer().Save()
    solids = {
        "sphere": withe.solids.Sphere(0.3),
        "capsule": withe.solids.Capsule(0.1, 0.5),
        "cylinder": withe.solids.Cylinder(0.2, 0.6),
        "cube": withe.solids.Box((0.4, 0.4, 0.4)),
    }
    order = {"sphere": (0, 1, 2), "cube": (0, 1, 2), "capsule": (2, 1, 0), "cylinder": (0, 2, 1)}

    def information(each):
        name = each.GetName()
        solid = solids[name]
        found = UsdPhysics.RigidBodyAPI.MassInformation()
        found.volume = solid.volume
        moments = np.diag(solid.volume * solid.inertia_per_mass)[list(order[name])]
        found.inertia = Gf.Matrix3f(*np.diag(moments).ravel().tolist())
        found.centerOfMass = Gf.Vec3f(0.0)
        matrix = UsdGeom.Xformable(each).GetLocalTransformation()
        found.localPos = Gf.Vec3f(matrix.ExtractTranslation())
        found.localRot = Gf.Quatf(matrix.ExtractRotation().GetQuat())
        return found

    mass, moments, center, axes = UsdPhysics.RigidBodyAPI(prim).ComputeMassProperties(information)
    robot, _ = quietly(lambda: read_robot(tmp_path / "body.usda"))
    (body,) = robot.bodies
    assert body.mass == pytest.approx(mass, rel=1e-5)
    assert total is None or body.mass == pytest.approx(total)
    np.testing.assert_allclose(body.center, center, atol=1e-5)
    turn = np.array(Gf.Matrix3d(Gf.Quatd(axes))).T
    np.testing.assert_allclose(body.inertia, (turn * np.array(moments)) @ turn.T, atol=1e-5 * max(moments))


def test_shapes_that_are_scaled_have_the_volume_and_inertia_of_their_picture(tmp_path):
    """A ball with three scales is an ellipsoid, J = m / 5 (b^2 + c^2, ...). Polyhedra have a little less volume."""
    stage = new_stage(tmp_path / "body.usda", length=0.1)
    add_body(stage, "body")
    ball = collider(stage, "Sphere", "/robot/body/ball", radius=2.0)
    ball.AddScaleOp().Set(Gf.Vec3f(1.0, 2.0, 0.5))
    stage.GetRootLayer().Save()
    (body,) = read_robot(tmp_path / "body.usda").bodies
    a, b, c = 0.2, 0.4, 0.1
    assert body.mass == pytest.approx(1000.0 * 4.0 / 3.0 * np.pi * a * b * c, rel=1e-6)
    expected = body.mass / 5.0 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(np.diag(body.inertia), expected, rtol=1e-6)
    assert body.solid.volume == pytest.approx(body.mass / 1000.0, rel=0.05)


@pytest.mark.parametrize("is_open", [False, True])
def test_a_mesh_of_quads_is_a_box(is_open, tmp_path):
    stage = new_stage(tmp_path / "body.usda")
    add_body(stage, "body", (1, 0, 0))
    corners = [(x, y, z) for x in (0.0, 0.2) for y in (0.0, 0.3) for z in (0.0, 0.5)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    quads = quads[: 5 if is_open else 6]
    mesh = collider(stage, "Mesh", "/robot/body/mesh")
    mesh.GetPointsAttr().Set([Gf.Vec3f(*corner) for corner in corners])
    mesh.GetFaceVertexIndicesAttr().Set(np.ravel(quads).tolist())
    mesh.GetFaceVertexCountsAttr().Set([4] * len(quads))
    stage.GetRootLayer().Save()
    robot = read_robot(tmp_path / "body.usda")
    (body,) = robot.bodies
    box = withe.solids.Box((0.2, 0.3, 0.5))
    assert body.mass == pytest.approx(1000.0 * box.volume, rel=1e-6)
    np.testing.assert_allclose(body.center, (0.1, 0.15, 0.25), atol=1e-7)
    np.testing.assert_allclose(body.inertia, body.mass * box.inertia_per_mass, atol=1e-6)
    hulls = ("surfaces that are not closed, and are replaced by convex hulls, of meshes 'mesh'",)
    assert robot.unsupported == (hulls if is_open else ())


def test_bodies_that_are_fixed_to_each_other_are_one(tmp_path):
    """Shapes that collide with nothing are drawn instead of colliders."""
    stage = new_stage(tmp_path / "body.usda")
    first, second = add_body(stage, "first"), add_body(stage, "second", (0.2, 0, 0))
    for name in ("first", "second"):
        collider(stage, "Cube", f"/robot/{name}/shape", size=0.2)
    ball = UsdGeom.Sphere.Define(stage, "/robot/second/picture")
    ball.GetRadiusAttr().Set(0.05)
    UsdGeom.Xform.Define(stage, "/robot/second/tool").AddTranslateOp().Set(Gf.Vec3d(0.1, 0, 0))
    add_joint(stage, "Fixed", "weld", (first, second), ((0.1, 0, 0), (-0.1, 0, 0)))
    stage.GetRootLayer().Save()
    scene = withe.Scene()
    robot = scene.add_robot(tmp_path / "body.usda", position=(0, 0, 1))
    assert robot["first"] == robot["second"]
    assert robot.name == "robot"
    np.testing.assert_allclose(robot["tool"].position, (0.3, 0, 1))
    part = scene._directory.parts["first"]
    box = withe.solids.Box((0.4, 0.2, 0.2))
    assert part.mass == pytest.approx(1000.0 * box.volume)
    np.testing.assert_allclose(part.center, (0.1, 0, 1), atol=1e-7)
    np.testing.assert_allclose(part.inertia, part.mass * box.inertia_per_mass, atol=1e-6)
    np.testing.assert_allclose(part.solid.center, (0.2, 0, 0), atol=1e-7)


def everything(path):
    """Write a stage with all that scenes lack."""
    stage = new_stage(path)
    bodies = [add_body(stage, name, (0.1 * i, 0, 0)) for i, name in enumerate(["one", "two", "three", "four"])]
    for body in bodies:
        set_mass(body, 1.0, (0, 0, 0), np.eye(3))
        collider(stage, "Sphere", f"{body.GetPath()}/ball", radius=0.01)
    collider(stage, "Cube", "/robot/floor", size=1.0)
    collider(stage, "Cone", "/robot/two/cone")
    joint = add_joint(stage, "Revolute", "hinge", bodies[:2], ((0.1, 0, 0), (0, 0, 0)))
    joint.CreateLowerLimitAttr(-30.0)
    joint.CreateBreakForceAttr(5.0)
    drive(joint, "angular", Type="acceleration", MaxForce=3.0, TargetVelocity=1.0)
    add_joint(stage, "Prismatic", "loop", bodies[:2], ((0.1, 0, 0), (0, 0, 0))).CreateExcludeFromArticulationAttr(True)
    add_joint(stage, "Distance", "string", bodies[1:3], np.zeros((2, 3)))
    add_joint(stage, "Spherical", "ball", (None, bodies[2]), ((0.2, 0, 0), (0, 0, 0))).CreateConeAngle0LimitAttr(20.0)
    UsdPhysics.RigidBodyAPI(bodies[3]).CreateKinematicEnabledAttr(True)
    UsdPhysics.RigidBodyAPI(bodies[0]).CreateVelocityAttr(Gf.Vec3f(1, 0, 0))
    move = UsdGeom.Xformable(bodies[3]).GetOrderedXformOps()[0]
    for time in (0.0, 1.0):
        move.Set(Gf.Vec3d(0.3, time, 0), time)
    bodies[0].AddAppliedSchema("PhysxRigidBodyAPI")
    UsdPhysics.Scene.Define(stage, "/robot/physics").CreateGravityMagnitudeAttr(1.6)
    stage.GetRootLayer().Save()


def test_one_warning_names_all_that_is_not_supported(tmp_path):
    everything(tmp_path / "all.usda")
    robot, caught = quietly(lambda: withe.Scene().add_robot(tmp_path / "all.usda"))
    (found,) = [each for each in caught if each.category is withe.UnsupportedRobotWarning]
    for line in (
        "colliders of the world 'floor'",
        "shapes of prims 'cone'",
        "limits of joints 'hinge', 'ball'",
        "breaking forces of joints 'hinge'",
        "drives by acceleration of joints 'hinge'",
        "force limits of joints 'hinge'",
        "target velocities of joints 'hinge'",
        "closed loops by joints 'loop'",
        "joints of type PhysicsDistanceJoint 'string'",
        "motion of kinematic bodies, which are fixed, 'four'",
        "initial velocities of bodies 'one'",
        "animation of bodies 'four'",
        "schema PhysxRigidBodyAPI of prims 'one'",
        "contact of bodies, such as 'one' with 'three'",
        "gravity (0.0, 0.0, -1.6) m/s^2",
    ):
        assert f"- {line}" in str(found.message), line
    assert set(robot.joints) == {"hinge", "ball"}
    assert found.filename == __file__


def test_a_stage_without_units_is_in_centimetres_and_warns(tmp_path):
    stage = new_stage(tmp_path / "body.usda")
    set_mass(add_body(stage, "body", (1, 0, 0)), 1.0, inertia=np.eye(3))
    stage.GetRootLayer().Save()
    path = tmp_path / "without.usda"
    path.write_text((tmp_path / "body.usda").read_text().replace("metersPerUnit = 1\n", ""))
    robot, caught = quietly(lambda: withe.Scene().add_robot(path))
    (found,) = caught
    assert found.category is withe.PlausibilityWarning
    assert "has no metersPerUnit, so its unit is 0.01 m" in str(found.message)
    np.testing.assert_allclose(robot.points["body"].position, (0.01, 0, 0))


def test_prims_of_one_name_are_named_by_their_paths(tmp_path):
    stage = new_stage(tmp_path / "arms.usda")
    for side in ("left", "right"):
        UsdGeom.Xform.Define(stage, f"/robot/{side}")
        set_mass(add_body(stage, f"{side}/hand"), 1.0, inertia=np.eye(3))
    stage.GetRootLayer().Save()
    robot = withe.Scene().add_robot(tmp_path / "arms.usda")
    assert set(robot.bodies) == {"/robot/left/hand", "/robot/right/hand"}


def empty(stage, body):
    body.RemoveAPI(UsdPhysics.RigidBodyAPI)


def without_mass(stage, body):
    body.RemoveAPI(UsdPhysics.MassAPI)
    for word in ("mass", "diagonalInertia", "principalAxes", "centerOfMass"):
        body.RemoveProperty(f"physics:{word}")


def without_inertia(stage, body):
    body.RemoveProperty("physics:diagonalInertia")


def impossible(stage, body):
    set_mass(add_body(stage, "last"), 1.0, (0, 0, 0), np.diag((1.0, 1.0, 3.0)))


def mirrored(stage, body):
    UsdGeom.Xformable(body).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))


def apart(stage, body):
    add_joint(stage, "Revolute", "hinge", (None, body), ((0, 0, 0.2), (0, 0, 0.1)))


def askew(stage, body):
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]])
    add_joint(stage, "Revolute", "hinge", (None, body), np.zeros((2, 3)), turns=(turn, np.eye(3)))


def twice(stage, body):
    add_joint(stage, "Revolute", "hinge", (body, body), np.zeros((2, 3)))


def lost(stage, body):
    joint = add_joint(stage, "Revolute", "hinge", (None, body), np.zeros((2, 3)))
    joint.GetBody1Rel().SetTargets([Sdf.Path("/robot/lost")])


def broken_mesh(stage, body):
    mesh = collider(stage, "Mesh", "/robot/body/mesh")
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2])
    mesh.GetFaceVertexCountsAttr().Set([3])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (empty, r"must have a rigid body \(PhysicsRigidBodyAPI\), got none"),
        (without_mass, r"body 'body' has neither a mass \(PhysicsMassAPI\) nor a collider"),
        (without_inertia, "body /robot/body has a mass, but neither diagonalInertia nor a collider"),
        (impossible, "inertia of body 'last' belongs to no body"),
        (mirrored, "axes of body /robot/body must not be mirrored"),
        (apart, "places of joint /robot/hinge on its two bodies are 0.1 m apart"),
        (askew, "axes of joint /robot/hinge on its two bodies differ by 90 degrees"),
        (twice, "joint /robot/hinge must connect two bodies, or a body and the world, got one twice"),
        (lost, "joint /robot/hinge names the body /robot/lost, which does not exist"),
        (broken_mesh, "mesh /robot/body/mesh must have points and faces"),
    ],
)
def test_stages_that_are_no_robot_are_refused(change, message, tmp_path):
    stage = new_stage(tmp_path / "body.usda")
    body = add_body(stage, "body")
    set_mass(body, 1.0, (0, 0, 0), np.eye(3))
    change(stage, body)
    stage.GetRootLayer().Save()
    scene = withe.Scene()
    with pytest.raises(ValueError, match=message):
        scene.add_robot(tmp_path / "body.usda")
    assert repr(scene) == "Scene()"


def test_files_that_are_missing_or_no_stage_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"does not exist: .*none\.usda"):
        withe.Scene().add_robot(tmp_path / "none.usda")
    (tmp_path / "text.usda").write_text("robot")
    with pytest.raises(ValueError, match=r"text\.usda is not a USD file"):
        withe.Scene().add_robot(tmp_path / "text.usda")
    stage = new_stage(tmp_path / "body.usda")
    stage.GetDefaultPrim().GetReferences().AddReference("lost.usda")
    stage.GetRootLayer().Save()
    with pytest.raises(FileNotFoundError, match=re.escape("cannot be read") + ".*lost"):
        withe.Scene().add_robot(tmp_path / "body.usda")


def test_without_usd_core_the_error_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "body.usda").write_text("")
    real = importlib.import_module

    def missing(name, *arguments):
        if name.startswith("pxr"):
            raise ModuleNotFoundError("No module named 'pxr'", name="pxr")
        return real(name, *arguments)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ImportError, match=r"needs the package pxr, .*\[robots\]"):
        withe.Scene().add_robot(tmp_path / "body.usda")
