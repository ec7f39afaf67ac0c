"""Hands of scenes and simulations: words, bad input, snapshots, copies, pickles."""

import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

import withe


def drawn(nodes=21):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=2e3)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.4, 0, 0), nodes=nodes, radius=5e-3, material=rubber, name="rod")
    return scene, rod


def built(**more):
    scene, rod = drawn()
    return scene.build(time_step=5e-3, planar=False, **more), rod


def test_scene_and_simulation_have_the_same_words():
    scene, rod = drawn()
    hand = scene.grasp(rod, 0.1, 0.03, stiffness=(100.0, 0.1), force_limit=3.0, name="left")
    simulation = scene.build(time_step=5e-3, planar=False)
    other = simulation.grasp(rod, 0.3, 0.03, stiffness=(100.0, 0.1), force_limit=3.0, name="right")
    simulation.step(5)
    assert isinstance(hand, withe.Hand)
    assert isinstance(other, withe.Hand)
    assert np.linalg.norm(simulation.wrench(hand).force) > 0.0
    np.testing.assert_array_equal(simulation.hand("left").wrench().force, simulation.wrench(hand).force)
    np.testing.assert_array_equal(other.deflection.shift, simulation.deflection("right").shift)
    np.testing.assert_array_equal(other.pose.position, simulation.get(other, "position"))
    simulation.release(hand)
    other.release()
    with pytest.raises(ValueError, match="'right' is released"):
        other.wrench()
    simulation.reset()
    assert simulation.hand("left").pose.position == pytest.approx((0.1, 0.0, 0.0))


def test_a_pose_may_be_given_in_every_form_and_is_read_back():
    turn = Rotation.from_rotvec((0.3, -0.2, 0.5))
    x, y, z, w = turn.as_quat()
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), (0.1, 0.2, 0.3)
    for pose in (((0.1, 0.2, 0.3), turn), (0.1, 0.2, 0.3, w, x, y, z), matrix):
        simulation, rod = built()
        hand = simulation.grasp(rod, 0.2, pose=pose)
        np.testing.assert_allclose(hand.pose.position, (0.1, 0.2, 0.3))
        np.testing.assert_allclose(hand.pose.rotation, turn.as_matrix(), atol=1e-15)
        before = simulation.positions(rod)[10:12]
        hand.move(position=(0.1, 0.2, 0.4))
        simulation.step()
        np.testing.assert_allclose(simulation.positions(rod)[10:12], before + np.array((0, 0, 0.1)), atol=1e-14)


def test_paths_may_be_rows_splines_and_functions():
    ends = []
    times = np.linspace(0.0, 0.1, 21)
    turns = Rotation.from_rotvec(np.outer(times, (0.0, 3.0, 0.0)))
    places = np.stack([0.21 + times, 0.0 * times, 2.0 * times], axis=1)
    x, y, z, w = turns.as_quat().T
    rows = np.column_stack([times, places, w, x, y, z])
    spline = CubicSpline(times, places), RotationSpline(times, turns)
    for path in (
        rows,
        spline,
        lambda t: (spline[0](t), spline[1](t)),
        lambda t: np.concatenate([spline[0](t), _wxyz(spline[1](t))]),
    ):
        simulation, rod = built()
        place = (np.array((0.21, 0.0, 0.0)), np.eye(3))
        hand = simulation.grasp(rod, 0.21, 0.03, pose=place)
        hand.move(path=path)
        simulation.step(20)
        np.testing.assert_allclose(hand.pose.position, places[-1], atol=1e-12)
        np.testing.assert_allclose(hand.pose.rotation, turns[-1].as_matrix(), atol=1e-12)
        ends.append(simulation.positions())
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], atol=1e-9)


def _wxyz(rotation):
    x, y, z, w = rotation.as_quat()
    return np.array([w, x, y, z])


@pytest.mark.parametrize("stiffness", [None, (100.0, 0.1)], ids=["rigid", "yielding"])
def test_snapshots_copies_pickles_and_files_go_on_with_the_same_bits(stiffness, tmp_path):
    simulation, rod = built()
    simulation.step(3)
    hand = simulation.grasp(rod, 0.17, 0.05, stiffness=stiffness, force_limit=0.2 if stiffness else None)
    hand.move(path=[(0.0, 0.17, 0.0, 0.0), (0.2, 0.2, 0.05, 0.1)])
    simulation.step(5)
    state, copy, pickled = simulation.snapshot(), simulation.copy(), pickle.loads(pickle.dumps(simulation))
    state.save(tmp_path / "state.npz")
    fresh = built()[0]
    simulation.step(5)
    end, wrench = simulation.positions(), hand.wrench().moment
    for other in (copy, pickled):
        other.step(5)
        np.testing.assert_array_equal(other.positions(), end)
        np.testing.assert_array_equal(other.wrench(hand.name).moment, wrench)
    hand.release()
    simulation.restore(state)
    simulation.step(5)
    np.testing.assert_array_equal(simulation.positions(), end)
    fresh.restore(withe.Snapshot.load(tmp_path / "state.npz"))
    fresh.step(5)
    np.testing.assert_array_equal(fresh.positions(), end)
    assert pickle.loads(pickle.dumps(hand)) == simulation[hand.name]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"at": 0.5}, "must lie on rod 'rod', from 0 to 0.4 m"),
        ({"at": -0.01}, "must lie on rod 'rod'"),
        ({"at": 0.01, "length": 0.05}, "must lie on rod 'rod'"),
        ({"at": 0.1, "length": -0.05}, "length of 'hand 1' must not be negative"),
        ({"at": 0.1, "stiffness": (0.0, 1.0)}, "stiffness of 'hand 1' along directions must be positive"),
        ({"at": 0.1, "stiffness": (1.0, -1.0)}, "stiffness of 'hand 1' about them must be positive"),
        ({"at": 0.1, "stiffness": 3.0}, "stiffness of 'hand 1' must be a pair"),
        ({"at": 0.1, "stiffness": (1.0, 1.0), "force_limit": 0.0}, "force_limit of 'hand 1' must be positive"),
        ({"at": 0.1, "force_limit": 1.0}, "force_limit of 'hand 1' needs a hand that yields"),
        ({"at": 0.1, "pose": (0, 0, 0, 2.0, 0, 0, 0)}, "quaternion qw, qx, qy, qz of length 1"),
        ({"at": 0.1, "pose": np.ones((3, 3))}, "pose of 'hand 1' must have shape"),
    ],
)
def test_bad_input_is_named(words, message):
    scene, rod = drawn()
    for where in (scene, scene.build()):
        with pytest.raises(ValueError, match=message):
            where.grasp(rod, **words)


def test_what_is_held_already_is_refused_by_name():
    scene, rod = drawn()
    scene.clamp(rod.start, name="wall")
    scene.pin(rod.node(20), name="peg")
    scene.grasp(rod, 0.2, 0.05, name="left")
    simulation = scene.build(planar=False)
    for stiffness in (None, (100.0, 0.1)):
        with pytest.raises(ValueError, match=r"overlaps 'left'"):
            simulation.grasp(rod, 0.23, 0.03, stiffness=stiffness)
        with pytest.raises(ValueError, match=r"overlaps 'wall' at 'rod.start'"):
            simulation.grasp(rod, 0.01, stiffness=stiffness)
        with pytest.raises(ValueError, match=r"overlaps 'peg'"):
            simulation.grasp(rod, 0.395, stiffness=stiffness)
    with pytest.raises(ValueError, match=r"overlaps 'left'"):
        simulation.clamp(rod.node(10), name="new")
    with pytest.raises(ValueError, match=r"overlaps 'left'"):
        simulation.pin(rod.node(9))
    with pytest.raises(ValueError, match="hand must be a hand returned by grasp, got the support 'wall'"):
        simulation.wrench("wall")


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ([(0.0, 0, 0, 0)], "must have at least two rows"),
        ([(0.0, 0, 0, 0), (0.0, 0, 0, 1)], "must have increasing times, got 0 s and then 0 s"),
        ([(0.0, 0, 0), (1.0, 0, 0)], r"must have shape \(poses, 4\) or \(poses, 8\)"),
        ([(0.0, 0, 0, 0, 1, 1, 0, 0), (1.0, 0, 0, 0, 1, 0, 0, 0)], "row 0 of the path of hand 'hand 1'"),
        ([(0.0, 0, 0, np.nan), (1.0, 0, 0, 0)], "must be finite"),
        (lambda t: (0.0, 1.0), "path of hand 'hand 1' at t = 0"),
    ],
)
def test_a_path_that_is_no_motion_is_refused(path, message):
    simulation, rod = built()
    hand = simulation.grasp(rod, 0.2)
    with pytest.raises(ValueError, match=message):
        hand.move(path=path)


def test_what_hands_do_not_go_with_says_so():
    scene, rod = drawn()
    scene.grasp(rod, 0.2, stiffness=(100.0, 0.1), force_limit=1.0)
    with pytest.raises(ValueError, match="supports rigid hands only"):
        scene.build(integrator="verlet", time_step=1e-6)
