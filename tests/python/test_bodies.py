"""Rigid bodies at the border of Python: copies, files and batches go on with the same bits, and bad input is named."""

import copy
import pickle

import numpy as np
import pytest

import withe
from withe.solids import Box, Capsule, Cylinder, Mesh, Sphere

RUBBER = withe.Material(youngs_modulus=1e7, density=1100.0)
V = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
T = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def robot():
    """A clamped arm that carries a body, a second body on a hinge with a spring, and a rod on it; and a free body."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=9, radius=4e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    palm = scene.add_body(Box((0.04, 0.03, 0.02)), density=900.0, position=(0.22, 0, 0.005), name="palm")
    scene.join(arm.end, palm)
    turn = (np.cos(0.2), 0.0, np.sin(0.2), 0.0)
    finger = scene.add_body(Cylinder(0.01, 0.04), density=900.0, position=(0.25, 0.02, 0), rotation=turn, name="finger")
    scene.join(
        palm, finger, "revolute", axis=(0, 1, 0.2), at=(0.24, 0, 0), stiffness=0.02, damping=1e-4, name="knuckle"
    )
    whip = scene.add_rod(start=(0.26, 0, 0), end=(0.32, 0, 0.05), nodes=5, radius=2e-3, material=RUBBER, name="whip")
    scene.join(whip.start, finger, "pinned")
    scene.add_force(palm, (0.0, 0.02, 0.0), at=(0.22, 0.01, 0.01), name="wind")
    scene.add_body(mass=0.1, inertia=(1e-5, 2e-5, 2.5e-5), position=(0, 0.3, 0), name="stone")
    return scene


def running(**options):
    simulation = robot().build(**({"time_step": 2e-3} | options))
    simulation.set_velocity("stone", (0.1, 0, 0.2), angular=(0.1, 8.0, 0.3))
    simulation.step(5)
    return simulation


def bits(simulation):
    bodies = ("palm", "finger", "stone")
    parts = [simulation.positions(), simulation.velocities()]
    for body in bodies:
        parts += [simulation.position(body), simulation.rotation(body), simulation.angular_velocity(body)]
    energy = simulation.energy()
    return b"".join(np.ascontiguousarray(part).tobytes() for part in parts), energy.total, energy.work


@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint", "backward_euler"])
def test_copies_pickles_and_snapshots_go_on_with_the_same_bits(integrator, tmp_path):
    simulation = running(integrator=integrator)
    snapshot = simulation.snapshot()
    others = [simulation.copy(), copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))]
    simulation.step(10)
    end = bits(simulation)
    for other in others:
        other.step(10)
        assert bits(other) == end
    for again in (
        snapshot,
        pickle.loads(pickle.dumps(snapshot)),
        withe.Snapshot.load(snapshot.save(tmp_path / "s.npz")),
    ):
        simulation.restore(again)
        simulation.step(10)
        assert bits(simulation) == end
    simulation.reset()
    fresh = robot().build(time_step=2e-3, integrator=integrator)
    assert bits(simulation) == bits(fresh)


def test_snapshots_keep_what_holds_bodies(tmp_path):
    """A clamp, a hinge of the world beside the centre of mass, and a moving pin; without any rod."""
    scene = withe.Scene()
    held, door, ball = (
        scene.add_body(Box((0.1, 0.1, 0.1)), density=500, position=(x, 0, 0), name=name)
        for x, name in ((0.0, "held"), (1.0, "door"), (2.0, "ball"))
    )
    scene.clamp(held)
    scene.clamp(door, at=(1.0, 0.05, 0.0), spin=(1, 0, 0), name="hinge")
    grip = scene.pin(ball, at=(2.0, 0.0, 0.05))
    simulation = scene.build(time_step=2e-3)

    def state():
        places = [simulation.position(door), simulation.position(ball), simulation.reaction("hinge").force]
        return np.concatenate([*places, simulation.rotation(door).ravel()]).tobytes()

    simulation.move(grip, position=(2.1, 0, 0.05), over=0.1)
    simulation.step(20)
    snapshot = simulation.snapshot()
    simulation.step(20)
    end = state()
    for again in (snapshot, withe.Snapshot.load(snapshot.save(tmp_path / "s.npz"))):
        simulation.restore(again)
        simulation.step(20)
        assert state() == end


def test_a_scene_with_bodies_is_copied_and_pickled():
    scene = robot()
    end = scene.build(time_step=2e-3)
    end.step(5)
    for other in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        simulation = other.build(time_step=2e-3)
        simulation.step(5)
        assert bits(simulation) == bits(end)
        other.add_body(Sphere(0.01), density=1.0)  # the copy may change alone
    assert len(scene.build().run(1e-3, progress=False).bodies) == 3


@pytest.mark.parametrize("workers", [1, 2])
def test_a_batch_has_the_bits_of_single_simulations(workers):
    batch = robot().build_batch(3, time_step=2e-3, workers=workers)
    for lane, simulation in enumerate(batch):
        simulation.set_velocity("stone", (0.1 * lane, 0, 0), angular=(0, 1.0 + lane, 0.1))
    alone = [simulation.copy() for simulation in batch]
    batch.step(10)
    for lane, simulation in enumerate(alone):
        simulation.step(10)
        assert bits(batch[lane]) == bits(simulation)
        for what in ("position", "rotation", "velocity", "angular_velocity"):
            np.testing.assert_array_equal(getattr(batch, what)("finger")[lane], getattr(simulation, what)("finger"))
    assert batch.position("stone").shape == (3, 3)
    assert batch.rotation("stone").shape == (3, 3, 3)
    run = batch.run(0.02, 0.01, progress=False)
    assert run.body_position("palm").shape == (3, 3, 3)
    np.testing.assert_array_equal(run.body_rotation("palm")[:, -1], batch.rotation("palm"))
    with pytest.raises(ValueError, match="body must be a body, got the rod 'arm'"):
        batch.position("arm")


def test_the_origin_of_the_axes_moves_as_its_velocity_says():
    simulation = running()
    for body in ("palm", "stone"):
        velocity = simulation.velocity(body)
        other = simulation.copy()
        other.set_velocity(body, velocity, angular=simulation.angular_velocity(body))
        np.testing.assert_allclose(other.velocity(body), velocity, atol=1e-12)
    stone = running()
    place, turn = stone.position("stone"), stone.rotation("stone")
    stone.set_velocity("stone", (1.0, 2.0, 3.0), angular=(0, 0, 4.0))
    np.testing.assert_allclose(stone.velocity("stone"), (1.0, 2.0, 3.0), atol=1e-12)
    np.testing.assert_allclose(stone.angular_velocity("stone"), (0, 0, 4.0), atol=1e-12)
    np.testing.assert_array_equal(stone.position("stone"), place)
    np.testing.assert_array_equal(stone.rotation("stone"), turn)


OK = {"mass": 1.0, "inertia": 1.0}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mass": 1.0, "inertia": (1, 1, 3)}, "inertia of body 'b' belongs to no body: .* got .*3.0"),
        ({"mass": 1.0, "inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "inertia of body 'b' must be symmetric, got"),
        ({"mass": 1.0, "inertia": (1, -1, 1)}, "inertia of body 'b' must be positive, got principal moments"),
        ({"mass": 1.0, "inertia": 0.0}, "inertia of body 'b' must be positive"),
        ({"mass": 1.0, "inertia": np.nan}, "inertia of body 'b' must be finite"),
        ({"mass": 1.0, "inertia": "large"}, "inertia of body 'b' must be numbers"),
        ({"mass": 1.0, "inertia": [[1, 2], [3]]}, "inertia of body 'b' must be numbers"),
        ({"mass": 1.0, "inertia": (1, 2)}, "inertia of body 'b' must have shape"),
        ({"mass": 0.0, "inertia": 1.0}, "mass of body 'b' must be positive, got 0"),
        ({"mass": -1.0, "inertia": 1.0}, "mass of body 'b' must be positive, got -1"),
        ({"mass": "1 kg", "inertia": 1.0}, "mass of body 'b' must be a number, got '1 kg'"),
        ({}, "body 'b' must have mass= and inertia=, or a solid with density="),
        ({"mass": 1.0}, "body 'b' must have mass= and inertia="),
        ({"solid": Sphere(1.0), "mass": 1.0, "density": 1.0}, "either density= or mass=, got both"),
        ({"solid": Sphere(1.0)}, "either density= or mass=, got neither"),
        ({"solid": Sphere(1.0), "mass": 1.0, "center": (0, 0, 1)}, "center of body .b. follows from its solid"),
        ({"solid": Sphere(1.0), "density": 0.0}, "density of body 'b' must be positive, got 0"),
        ({"density": 1.0, **OK}, "density of body 'b' needs a solid"),
        ({"solid": (1, 2, 3), "density": 1.0}, "solid of body 'b' must be one of withe.solids, .* got \\(1, 2, 3\\)"),
        ({"solid": Box, "density": 1.0}, "solid of body 'b' must be one of withe.solids"),
        (
            {"rotation": (1.0 + 2e-6, 0, 0, 0), **OK},
            "rotation of body 'b' must have a quaternion qw, qx, qy, qz .*1.000002",
        ),
        ({"rotation": (0, 0, 0, 0), **OK}, "quaternion qw, qx, qy, qz of length 1, got one of 0"),
        ({"rotation": (0, 0, 1), **OK}, "quaternion \\(w, x, y, z\\), a SciPy Rotation or a matrix"),
        ({"rotation": np.diag([1, 1, -1]), **OK}, "must be a rotation, got a reflection"),
        ({"rotation": np.ones((3, 3)), **OK}, "its rows are not orthonormal"),
        ({"position": (1, 2), **OK}, "position of body 'b' must have shape \\(3,\\), got \\(2,\\)"),
        ({"position": (1, 2, np.nan), **OK}, "position of body 'b' must be finite"),
        ({"center": "here", **OK}, "center of body 'b' must be numbers"),
    ],
)
def test_bodies_that_cannot_be_are_refused_with_the_argument(arguments, message):
    scene = withe.Scene()
    with pytest.raises(ValueError, match=message):
        scene.add_body(**arguments, name="b")
    scene.add_body(**OK, name="b")  # nothing was left behind
    assert scene.build().positions().shape == (1, 3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Sphere(-1.0), "radius of the sphere must be positive, got -1"),
        (lambda: Box((1, 2)), "size of the box must have shape \\(3,\\)"),
        (lambda: Box((1, 2, 0)), "size of the box must be positive"),
        (lambda: Cylinder(1.0, 0.0), "length of the cylinder must be positive, got 0"),
        (lambda: Capsule(1.0, np.nan), "length of the capsule must be finite"),
        (lambda: Mesh(np.eye(3), [[0, 1, 2]]), "the mesh must be closed"),
        (lambda: Mesh(V, np.array(T)[:, ::-1]), "counter-clockwise when seen from outside"),
        (lambda: Mesh(V, np.add(T, 1)), "triangles must be rows of vertices"),
        (lambda: Mesh(V, np.multiply(T, 1.0)), "triangles must be whole numbers"),
        (lambda: Mesh("cube.stl", T), "vertices of the mesh must be numbers"),
    ],
)
def test_solids_that_cannot_be_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def two():
    """Two rods end to end, with a body at their common point and one beside it."""
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=4e-3, material=RUBBER, name="arm")
    scene.add_rod(start=(0.2, 0, 0), end=(0.4, 0, 0), nodes=5, radius=4e-3, material=RUBBER, name="leg")
    for name, x in (("palm", 0.2), ("fist", 0.3)):
        scene.add_body(mass=0.1, inertia=1e-4, position=(x, 0, 0), name=name)
    return scene


P = {"at": (0.25, 0, 0)}


@pytest.mark.parametrize(
    ("nodes", "words", "message"),
    [
        (("palm", "fist", "pinned"), {}, "at must be given to join bodies"),
        (("palm", "fist"), P, "two bodies must not be joined rigidly: describe them by one body"),
        (("arm.end", "palm"), P, "at of the joint must be the node, but is 0.05 m away"),
        (("arm.end", "palm"), {"at": (0.2, 0, 1e-7)}, "at of the joint must be the node, but is 1e-07 m away"),
        (("arm.end", "leg.start"), {"at": (0.2, 0, 0)}, "at of the joint is for bodies"),
        (("arm.end", "palm", "revolute"), {}, "axis of the joint must be given for kind='revolute'"),
        (("arm.end", "palm"), {"axis": (0, 1, 0)}, "axis of the joint must be given for kind='revolute'"),
        (("palm", "palm", "pinned"), P, "nodes to join must be two, got 'palm' twice"),
        (("arm.end", "plam"), {}, "must be a node of a rod, .* or a body, got 'plam'; did you mean 'palm'"),
        (("arm.end", 3), {}, "second node to join must be a handle or a name, got int"),
        (("palm", "fist", "pinned"), {"at": (0, 0, np.nan)}, "at of the joint must be finite"),
        (("arm.end", "palm"), {"form": "pairs"}, "form of the joint must be 'frame' for a body, got form='pairs'"),
        (("arm.end", "palm"), {"stiffness": 1.0}, "stiffness of joint 'joint 1' needs kind='revolute'"),
        (
            ("arm.end", "palm", "welded"),
            {},
            "kind of the joint must be 'rigid' or 'pinned' or 'revolute' or 'sliding', got 'welded'",
        ),
    ],
)
def test_joints_of_bodies_that_cannot_be_are_refused(nodes, words, message):
    with pytest.raises(ValueError, match=message):
        two().join(*nodes, **words)


def test_read_outs_of_rods_name_those_of_bodies() -> None:
    scene = withe.Scene()
    palm = scene.add_body(Box((0.1, 0.1, 0.1)), density=1000, name="palm")
    simulation = scene.build()
    for read in (simulation.positions, simulation.velocities):
        with pytest.raises(ValueError, match="got the body 'palm': use `position`, `velocity`"):
            read(palm)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.clamp("palm", spin=True), "spin of a clamp of body 'palm' must be the axis"),
        (lambda s: s.clamp("palm", spin=(0, 0, 0)), "spin of the clamp must not be zero"),
        (lambda s: s.clamp("palm", hold="edge"), "hold='edge' is for rods, got body 'palm'"),
        (lambda s: s.clamp("arm.start", at=(0, 0, 0)), "at= is a point of a body, but 'arm.start' is a node of a rod"),
        (lambda s: s.clamp("arm.start", spin=(0, 0, 1)), "spin of the clamp must be True or False"),
        (lambda s: s.pin("palm", at=(0, 0)), "at of body 'palm' must have shape"),
        (lambda s: s.pin("plam"), "node to pin must be a node of a rod, .* or a body, got 'plam'; did you mean 'palm'"),
        (lambda s: s.pin(7), "node to pin must be a handle or a name, got int"),
        (
            lambda s: s.add_force("palm", (0, 0, 1), follower=True),
            "follower=True is for loads on rods, got body 'palm'",
        ),
        (lambda s: s.add_force("arm.end", (0, 0, 1), at=(0, 0, 0)), "'arm.end' is a node of a rod"),
        (lambda s: s.add_force("palm", 1.0), "force 'force 1' must have shape \\(3,\\), got a single number"),
        (lambda s: s.add_force("palm", (0, 0, 1), at=(0, np.inf, 0)), "at of body 'palm' must be finite"),
        (lambda s: s.add_moment("palm", lambda t: 1.0), "moment 'moment 1' at t = 0 must have shape"),
        (lambda s: s.add_load("palm", (0, 0, 1)), "rod of the load must be a rod, got the body 'palm'"),
        (lambda s: s.grasp("palm", 0.1), "rod to grasp must be a rod, got the body 'palm'"),
    ],
)
def test_supports_and_loads_of_bodies_that_cannot_be_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call(two())


def test_two_balls_between_two_bodies_are_a_hinge():
    scene = two()
    scene.join("palm", "fist", "pinned", at=(0.25, 0, 0), name="first")
    scene.join("palm", "fist", "pinned", at=(0.25, 0, 0.1), name="second")
    simulation = scene.build(planar=False)
    assert "1 closed loop(s) of joints: 5 multipliers" in str(simulation.plan)
    simulation.set_velocity("fist", angular=(0, 3.0, 0))
    simulation.step()
    apart = simulation.angular_velocity("fist") - simulation.angular_velocity("palm")
    np.testing.assert_allclose(apart[:2], 0.0, atol=1e-3 * np.abs(simulation.angular_velocity("fist")).max())


def test_a_joint_of_two_rods_closes_no_loop():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rods = [scene.add_rod(start=(0, y, 0), end=(0.1, 0, 0), nodes=5, radius=2e-3, material=rubber) for y in (-0.1, 0.1)]
    bodies = [scene.add_body(mass=0.1, inertia=1e-4, position=(0.15, y, 0)) for y in (-0.1, 0.1)]
    for rod, body in zip(rods, bodies, strict=True):
        scene.join(rod.end, body)
    scene.join(*bodies, kind="pinned", at=(0.2, 0, 0))
    scene.join(rods[0].end, rods[1].end, kind="pinned", name="both")
    with pytest.raises(ValueError, match="joint 'both' closes a loop of bodies, but joins two rods"):
        scene.build()


def test_a_second_support_of_bodies_is_named():
    scene = two()
    scene.clamp("palm", name="hold")
    scene.pin("palm", at=(0.1, 0, 0), name="nail")
    with pytest.raises(ValueError, match="'hold' and 'nail' hold two points of body 'palm': remove one"):
        scene.build()
    scene = two()
    scene.clamp("palm", name="hold")
    scene.join("palm", "fist", "pinned", at=(0.25, 0, 0))
    scene.pin("fist", name="nail")
    assert "1 closed loop(s)" in str(scene.build().plan)  # the fist turns about the line of both of its points


def test_points_of_a_running_body_are_those_of_its_scene():
    simulation = robot().build(time_step=2e-3)
    simulation.add_force("palm", (0, 0, 0.1))
    simulation.add_force("palm", (0, 0, 0.1), at=(0.22, 0.01, 0.01))
    with pytest.raises(ValueError, match="a body of a running simulation has no new points"):
        simulation.add_force("palm", (0, 0, 0.1), at=(0.3, 0, 0))


def test_what_bodies_do_not_have_yet_is_refused():
    with pytest.raises(ValueError, match="integrator 'verlet' does not support rigid bodies"):
        robot().build(integrator="verlet")
    for wrong, message in (
        (lambda s: s.set_velocity("palm", (1, 2)), "velocity of body 'palm' must have shape"),
        (lambda s: s.set_velocity("palm", angular="fast"), "angular velocity of body 'palm' must be numbers"),
        (lambda s: s.position("arm"), "body must be a body, got the rod 'arm'"),
        (lambda s: s.rotation("plam"), "did you mean 'palm'"),
        (lambda s: s.set("palm", mass=1.0), "'palm' has nothing to set"),
    ):
        with pytest.raises(ValueError, match=message):
            wrong(running())


def test_a_body_outside_the_plane_of_a_planar_scene_is_refused():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=4e-3, material=RUBBER)
    scene.clamp(arm.start)
    turn = (np.cos(0.1), np.sin(0.1), 0, 0)
    body = scene.add_body(mass=0.1, inertia=(1e-4, 1.5e-4, 2e-4), rotation=turn, position=(0.2, 0, 0), name="tilted")
    scene.join(arm.end, body)
    with pytest.raises(ValueError, match="no principal axis of body 'tilted' is normal to the plane"):
        scene.build(planar=True)
    assert "spatial" in str(scene.build().plan) or scene.build(planar=False) is not None


@pytest.mark.parametrize("planar", [None, False])
@pytest.mark.parametrize(
    ("velocity", "spin", "expected"),
    [
        ((0, 0.5, 0), None, 0.5 * 0.2),
        ((0, 0.5, 0), (0, 0, 1.0), 0.5 * 0.2 + (0.4**2 + 0.02**2) / 12 * 1.0),
        ((1.0, 0, 0), None, 0.0),
        (None, (0, 0, 2.0), 2.0 * ((0.4**2 + 0.02**2) / 12 + 0.2**2)),
    ],
)
def test_a_hinge_of_the_world_turns_a_set_velocity_into_a_rotation(velocity, spin, expected, planar):
    """The impulse of the hinge keeps the angular momentum about it [J s / kg], and the motion is then steady."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bar = scene.add_body(withe.solids.Box((0.4, 0.02, 0.02)), density=1000.0, position=(0.2, 0, 0), name="bar")
    scene.clamp(bar, at=(0, 0, 0), spin=(0, 0, 1), name="hinge")
    simulation = scene.build(time_step=1e-3, planar=planar)
    simulation.set_velocity("bar", velocity, angular=spin)
    rate = expected / ((0.4**2 + 0.02**2) / 12 + 0.2**2)
    for _ in range(5):
        simulation.step()
        assert simulation.angular_velocity("bar")[2] == pytest.approx(rate, rel=1e-4, abs=1e-9)


def test_a_clamp_keeps_a_body_at_rest_whose_velocity_is_set():
    """All six rates are held."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bar = scene.add_body(withe.solids.Box((0.4, 0.02, 0.02)), density=1000.0, position=(0.2, 0, 0), name="bar")
    scene.clamp(bar, at=(0, 0, 0))
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity("bar", (0.1, 0.5, 0.2), angular=(1.0, 2.0, 3.0))
    simulation.step(3)
    np.testing.assert_allclose(simulation.velocity("bar"), 0.0, atol=1e-12)
    np.testing.assert_allclose(simulation.angular_velocity("bar"), 0.0, atol=1e-12)
    np.testing.assert_allclose(simulation.position("bar"), (0.2, 0, 0), atol=1e-12)


def test_a_pinned_body_keeps_its_angular_momentum_about_the_pin():
    """A ball joint of the world: three impulses act at the pin, and no moment."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bar = scene.add_body(withe.solids.Box((0.4, 0.1, 0.02)), density=1000.0, position=(0.2, 0.1, 0), name="bar")
    scene.pin(bar, at=(0, 0, 0))
    simulation = scene.build(time_step=1e-6)
    velocity, spin, arm = np.array([0.1, 0.5, 0.2]), np.array([1.0, 2.0, 3.0]), np.array([0.2, 0.1, 0.0])
    simulation.set_velocity("bar", velocity, angular=spin)
    sides = np.array([0.4, 0.1, 0.02]) ** 2
    own = np.diag(sides.sum() - sides) / 12.0
    about_pin = own + arm @ arm * np.eye(3) - np.outer(arm, arm)
    expected = np.linalg.solve(about_pin, np.cross(arm, velocity) + own @ spin)
    for _ in range(3):
        simulation.step()
        np.testing.assert_allclose(simulation.angular_velocity("bar"), expected, rtol=1e-4)
        np.testing.assert_allclose(simulation.velocity("bar"), np.cross(expected, arm), rtol=1e-4, atol=1e-4)
