"""Supports while a simulation runs: held, moved, turned, released, and what they bear."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from simple_scenes import RUBBER, cantilever, tripod


def test_supports_can_be_added_and_released_at_any_time():
    _, arm, simulation = cantilever(planar=False, time_step=2e-3)
    simulation.step(20)
    here = simulation.positions(arm)
    grip = simulation.clamp(arm.end, name="grip")
    assert np.allclose(simulation.positions(arm), here, atol=1e-14)
    simulation.release("wall")
    with pytest.raises(ValueError, match=r"'arm.start' is not held"):
        simulation.reaction(arm.start)
    simulation.step(50)
    after = simulation.positions(arm)
    assert np.allclose(after[-1], here[-1], atol=1e-12)
    assert after[0, 2] < -0.01
    simulation.release(arm.end)
    with pytest.raises(ValueError, match="no longer in the scene"):
        simulation.release(grip)
    simulation.step(50)
    assert simulation.positions(arm)[-1, 2] < here[-1, 2] - 0.01
    simulation.clamp(arm.start, name="again")
    simulation.step(5)


def test_a_released_name_of_the_scene_stays_its_own():
    _, arm, simulation = cantilever()
    simulation.release("wall")
    with pytest.raises(ValueError, match="'wall' is released"):
        simulation.reaction("wall")
    with pytest.raises(ValueError, match="must be new"):
        simulation.pin(arm.start, name="wall")


def test_a_support_slides_along_its_free_direction():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    scene.clamp(rod.start, free=(0, 0, 1))
    simulation = scene.build(time_step=1e-3)
    simulation.step(100)
    fall = 0.5 * 9.81 * 0.1**2
    assert np.allclose(simulation.positions(rod)[:, 2], -fall, rtol=1e-3)
    assert np.allclose(simulation.positions(rod)[0, :2], 0, atol=1e-14)


@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_support_moves_and_turns_to_where_it_is_told(hold, planar):
    scene = withe.Scene(gravity=(0, 0, -1e-3))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    support = scene.clamp(arm.start, hold=hold)
    simulation = scene.build(integrator="static", time_step=0.05, planar=planar)
    simulation.move(arm.start, position=(0.1, 0, 0.2), rotation=Rotation.from_euler("y", -90, degrees=True), over=0.5)
    simulation.step(5)
    assert np.allclose(simulation.positions(arm)[0], (0.05, 0, 0.1), atol=1e-12)
    simulation.step(5)
    assert np.allclose(simulation.positions(arm), [(0.1, 0, 0.2 + z) for z in np.linspace(0, 0.2, 11)], atol=1e-4)
    simulation.move(support, tangent=(-1, 0, 0))
    simulation.step()
    assert np.allclose(simulation.positions(arm)[0], (0.1, 0, 0.2), atol=1e-12)
    assert simulation.positions(arm)[-1] == pytest.approx((-0.1, 0, 0.2), abs=1e-2)


WAYS = {  # where a clamp was told to go in pairs of calls, the second at 0.3 s, and where it is at 0.5 s and in the end
    "position, rotation": [
        {"position": (0.1, 0, 0.2), "over": 1.0},
        {"rotation": Rotation.from_euler("y", -80, True), "over": 0.4},
    ],
    "rotation, position": [
        {"rotation": Rotation.from_euler("y", -80, True), "over": 1.0},
        {"position": (0.1, 0, 0.2), "over": 0.4},
    ],
    "position, tangent": [{"position": (0.1, 0, 0.2), "over": 1.0}, {"tangent": (0.5, 0, 1), "over": 0.4}],
    "tangent, position": [{"tangent": (0.5, 0, 1), "over": 1.0}, {"position": (0.1, 0, 0.2), "over": 0.4}],
    "path, rotation": [
        {"path": lambda t: (t, 0, 2 * t)},
        {"rotation": Rotation.from_euler("y", -80, True), "over": 0.4},
    ],
    "rotation, path": [
        {"rotation": Rotation.from_euler("y", -80, True), "over": 1.0},
        {"path": lambda t: (t - 0.3, 0, 2 * t - 0.6)},
    ],
    "tangent, path": [{"tangent": (0.5, 0, 1), "over": 1.0}, {"path": [(0.3, 0, 0, 0), (2, 1.7, 0, 3.4)]}],
}


@pytest.mark.parametrize("part", ["frame", "edge", "hand"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("pair", WAYS)
def test_a_position_and_a_rotation_go_on_when_the_other_is_given(pair, planar, part):
    first, second = WAYS[pair]

    def moved(*calls):
        """Poses of the support at 0.5 s and at 2 s, after calls (time, arguments)."""
        scene = withe.Scene(gravity=(0, 0, -1e-3))
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=9, radius=5e-3, material=RUBBER)
        if part != "hand":
            scene.clamp(arm.start, hold=part, name="grip")
        simulation = scene.build(integrator="backward_euler", time_step=0.05, planar=planar)
        if part == "hand":
            simulation.grasp(arm, 0.1, 0.03, pose=((0, 0, 0), np.eye(3)), name="grip")
        found = []
        for when in (0.3, 0.5, 2.0):
            for call in [call for time, call in calls if time < when - 0.01]:
                simulation.move("grip", **call)
            calls = [(time, call) for time, call in calls if time >= when - 0.01]
            simulation.step(round((when - simulation.time) / 0.05))
            found.append(simulation.pose("grip"))
        return found[1:]

    both = moved((0.0, first), (0.3, second))
    alone = dict(zip(pair.split(", "), (moved((0.0, first)), moved((0.3, second))), strict=True))
    place = alone.get("position", alone.get("path"))
    turn = alone.get("rotation", alone.get("tangent"))
    for pose, of_place, of_turn in zip(both, place, turn, strict=True):
        np.testing.assert_allclose(pose.position, of_place.position, atol=1e-12)
        np.testing.assert_allclose(pose.rotation, of_turn.rotation, atol=1e-12)
    assert np.linalg.norm(place[0].position - place[1].position) > 0.05
    assert np.linalg.norm(turn[1].rotation - np.eye(3)) > 0.5


def test_a_tangent_and_a_roll_go_on_when_the_other_is_given(tmp_path):
    _, arm, simulation = cantilever(planar=False, time_step=0.02, integrator="backward_euler")
    simulation.move("wall", tangent=(1, 0, 1), over=1.0)
    simulation.step(10)
    simulation.move("wall", roll=2.5 * np.pi, over=0.4)
    state = simulation.snapshot()
    state.save(tmp_path / "state.npz")
    simulation.step(50)
    end = simulation.pose("wall").rotation
    tangent = np.array([1, 0, 1]) / np.sqrt(2)
    np.testing.assert_allclose(end @ (1, 0, 0), tangent, atol=1e-12)
    _, other, straight = cantilever(planar=False, time_step=0.02, integrator="backward_euler")
    straight.move(other.start, tangent=tangent, roll=0.5 * np.pi)
    straight.step(1)
    np.testing.assert_allclose(end, straight.pose(other.start).rotation, atol=1e-12)
    simulation.restore(withe.Snapshot.load(tmp_path / "state.npz"))
    simulation.step(50)
    np.testing.assert_array_equal(simulation.pose(arm.start).rotation, end)
    # A rotation that is on its way, too.
    simulation.move("wall", rotation=np.eye(3), over=1.0)
    simulation.step(10)
    simulation.move("wall", roll=0.25, over=0.1)
    simulation.step(50)
    np.testing.assert_allclose(
        simulation.pose("wall").rotation, Rotation.from_rotvec((0.25, 0, 0)).as_matrix(), atol=1e-12
    )


@pytest.mark.parametrize("first", ["position", "roll"])
def test_an_obstacle_goes_on_when_it_is_told_to_turn(first):
    given = {"position": {"position": (0, 0, -0.3), "over": 0.1}, "roll": {"roll": 0.4, "over": 0.1}}
    second = "roll" if first == "position" else "position"
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=RUBBER)
    roller = scene.add_capsule((0, -0.1, -0.5), (0, 0.1, -0.5), 0.02)
    simulation = scene.build(time_step=1e-2)
    start = simulation.get(roller, "position")
    simulation.move(roller, **given[first])
    simulation.step(5)
    simulation.move(roller, **given[second])
    simulation.step(20)
    np.testing.assert_allclose(simulation.get(roller, "position"), (0, 0, -0.3), atol=1e-14)
    np.testing.assert_allclose(simulation.get(roller, "turn"), (0, 0.4, 0), atol=1e-14)
    assert np.linalg.norm(start - (0, 0, -0.3)) > 0.2


@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_stretched_and_turned_end_is_gripped_as_it_is(hold, planar):
    scene = withe.Scene(gravity=(0, 0, 0))
    soft = withe.Material(youngs_modulus=1e4, poisson_ratio=0.5, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=soft, normal=(0, 1, 0))
    scene.clamp(arm.start)
    pull = scene.add_force(arm.end, (0.1, 0, 0.1))
    simulation = scene.build(integrator="static", time_step=0.1, planar=planar)
    simulation.equilibrium()
    before, directors = simulation.positions(arm), simulation.directors(arm)
    stretched = np.linalg.norm(before[-1] - before[-2])
    assert stretched > 1.1 * 0.02
    grip = simulation.clamp(arm.end, hold=hold)
    simulation.step()
    assert np.allclose(simulation.positions(arm), before, atol=1e-9)
    assert np.allclose(simulation.directors(arm), directors, atol=1e-7)
    simulation.restore(simulation.snapshot())
    simulation.set(pull, force=(0, 0, 0))
    simulation.move(grip, position=before[-1] + (0.01, 0, 0), over=0.1)
    simulation.step()
    after = simulation.positions(arm)
    if hold == "edge":
        assert np.allclose(after[-2:] - before[-2:], (0.01, 0, 0), atol=1e-12)
        assert simulation.tensions(arm)[-1] == pytest.approx(1e4 * np.pi * 5e-3**2 * (stretched / 0.02 - 1.0))


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "backward_euler", "energy_momentum"])
def test_a_clamp_that_turns_out_of_the_plane_within_a_step_moves_the_rod_as_in_space(integrator):
    tips = []
    for planar in (None, False):
        _, arm, simulation = cantilever(21, planar=planar, integrator=integrator)
        simulation.move("wall", tangent=(1, -0.15, 0.1), over=0.1)
        simulation.step(20)
        tips.append(simulation.positions(arm))
    assert np.allclose(*tips, atol=1e-7)


@pytest.mark.parametrize("hold", ["frame", "edge"])
def test_rolls_count_full_turns(hold):
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    scene.clamp(arm.start, hold=hold)
    scene.clamp(arm.end, hold=hold)
    simulation = scene.build(integrator="static", time_step=0.02, planar=False)
    length = 0.2 if hold == "frame" else 0.2 - 0.02
    for target in (7.0, 9.0, -3.0):
        simulation.move(arm.end, roll=target, over=1.0)
        simulation.step(50)
        assert np.allclose(simulation.twists(arm), target / length, rtol=1e-6)
    simulation.move(arm.end, position=(0.21, 0, 0))
    simulation.step()
    assert np.allclose(simulation.twists(arm), -3.0 / length, rtol=1e-6)


@pytest.mark.parametrize("over", [0.0, 0.01, 0.012])
def test_a_roll_by_more_than_half_a_turn_in_a_step_is_refused_with_the_time_that_would_do(over):
    _, _, simulation = cantilever(planar=False, time_step=0.01)
    with pytest.raises(ValueError, match=r"at most half a turn per time step, got 4\.39823 rad .*use over=0\.021"):
        simulation.move("wall", roll=1.4 * np.pi, over=over)
    simulation.move("wall", roll=1.4 * np.pi, over=0.021)
    simulation.move("wall", roll=0.9 * np.pi)


def test_a_path_gives_the_position_at_the_end_of_every_step():
    _, arm, simulation = cantilever(planar=False, time_step=0.01)

    def path(t):
        return (0.1 * t, 0, 0), Rotation.from_rotvec([t, 0, 0]).as_matrix()

    simulation.move("wall", path=path)
    simulation.step(7)
    assert simulation.positions(arm)[0] == pytest.approx((0.007, 0, 0), abs=1e-14)
    simulation.move(arm.start, path=lambda t: np.array([0.1 * t, 0, t - 0.07]))
    simulation.step(3)
    assert simulation.positions(arm)[0] == pytest.approx((0.01, 0, 0.03), abs=1e-14)
    simulation.move(arm.start, position=(0, 0, 0))
    simulation.step(3)
    assert simulation.positions(arm)[0] == pytest.approx((0, 0, 0), abs=1e-14)


def test_a_path_of_positions_is_asked_no_more_once_a_position_is_given():
    _, arm, simulation = cantilever(planar=False, time_step=0.01)
    asked = []
    simulation.move(arm.start, path=lambda t: asked.append(t) or (0.0, 0.0, t))
    simulation.step(2)
    simulation.move(arm.start, position=(0, 0, 0))
    before = len(asked)
    simulation.step(2)
    assert len(asked) == before
    assert simulation.positions(arm)[0] == pytest.approx((0, 0, 0), abs=1e-14)


def test_a_pin_moves_but_does_not_turn():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=RUBBER)
    scene.pin(rod.start)
    simulation = scene.build()
    simulation.move(rod.start, (0, 0, 0.1), over=0.05)
    simulation.step(10)
    assert simulation.positions(rod)[0] == pytest.approx((0, 0, 0.1), abs=1e-14)
    with pytest.raises(ValueError, match="a pin does not hold directions"):
        simulation.move(rod.start, roll=1.0)
    with pytest.raises(ValueError, match="a pin does not hold directions"):
        simulation.move(rod.start, path=lambda t: ((0, 0, 0), np.eye(3)))


def test_reactions_balance_the_loads_at_every_support():
    _, _, simulation = tripod(integrator="static")
    simulation.equilibrium()
    total = sum(simulation.reaction(name).force for name in ("clamp 1", "clamp 2"))
    weight = sum(
        float(
            simulation.get(rod, "line_density")[0]
            * np.linalg.norm(np.ptp(simulation._session.scene.rod(rod).points, axis=0))
        )
        for rod in simulation.rods
    )
    assert total == pytest.approx((-0.01, -0.02, 9.81 * weight), abs=1e-7)


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
def test_a_clamp_may_jump_by_a_hundred_edges_at_once(integrator):
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=401, radius=0.01, material=RUBBER)
    scene.clamp(rod.start, name="wall")
    simulation = scene.build(integrator=integrator, time_step=0.02)
    simulation.move("wall", position=(0, 0, 0.3))
    simulation.step()
    assert simulation.positions(rod)[0] == pytest.approx((0, 0, 0.3), abs=1e-12)
    assert simulation.statistics.steps == 1
    assert simulation.statistics.iterations < 40


def test_parts_of_a_step_share_a_jump_evenly():
    """Shorter steps would be in vain if the first of them met all of it."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=21, radius=0.01, material=RUBBER)
    scene.clamp(rod.start, name="wall")
    simulation = scene.build(time_step=0.02, tolerance=1e-4, duration=0.04)
    simulation.step()
    simulation.move("wall", position=(0, 0, 0.1))
    kept = simulation.snapshot()
    jump = simulation.statistics.steps
    simulation.step()
    jump = simulation.statistics.steps - jump
    simulation.restore(kept)
    simulation.move("wall", position=(0, 0, 0.1), over=0.02)
    evenly = simulation.statistics.steps
    simulation.step()
    assert simulation.statistics.steps - evenly == jump > 1
    assert simulation.positions(rod)[0] == pytest.approx((0, 0, 0.1), abs=1e-12)


@pytest.mark.parametrize("time_step", [1e-5, 1e-7])
def test_short_steps_after_many_turns_take_no_more_iterations(time_step):
    def build(time_step):
        scene = withe.Scene(gravity=(0, 0, 0))
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=1e-3, material=RUBBER)
        grip = scene.clamp(arm.start)
        simulation = scene.build(integrator="backward_euler", time_step=time_step)
        simulation.move(grip, path=lambda t: (np.zeros(3), Rotation.from_euler("x", 20 * t).as_matrix()))
        return simulation

    spun = build(0.02)
    spun.step(2000)
    simulation = build(time_step)
    simulation.restore(spun.snapshot())
    simulation.step(5)
    assert simulation.statistics.iterations <= 10
    assert simulation.statistics.rejected_steps == 0


def test_clamping_and_letting_go_again_and_again_leaves_nothing_behind():
    _, arm, simulation = cantilever()
    simulation.release(simulation.pin(arm.end))
    size = len(simulation.snapshot()._state)
    for k in range(200):
        simulation.release(simulation.clamp(arm.end) if k % 2 else simulation.pin(arm.node(k % 7 + 2)))
    assert len(simulation.snapshot()._state) == size
    assert list(simulation._session.directory.parts) == ["arm", "wall"]


def test_the_handle_of_a_released_support_says_so_and_never_means_another():
    _, arm, simulation = cantilever()
    first = simulation.pin(arm.end)
    simulation.release(first)
    second = simulation.pin(arm.node(5))
    assert second.name != first.name
    for use in (simulation.move, simulation.reaction, simulation.release):
        with pytest.raises(ValueError, match=f"support '{first.name}' is released"):
            use(first)
    simulation.move(second, position=(0.1, 0, 0.01), over=0.01)
    simulation.step(5)
    assert simulation.positions(arm)[5, 2] == pytest.approx(0.01, abs=1e-12)


def test_a_support_in_the_row_of_another_survives_snapshots_and_copies():
    _, arm, simulation = cantilever(planar=False)
    first, second = simulation.pin(arm.end), simulation.pin(arm.node(5))
    simulation.release(first)
    third = simulation.clamp(arm.node(8))
    simulation.move(third, position=(0.15, 0, 0.02), over=0.1)
    simulation.step(3)
    snapshot, twin = simulation.snapshot(), simulation.copy()
    simulation.step(20)
    twin.step(20)
    assert np.array_equal(twin.positions(), simulation.positions())
    assert simulation.positions(arm)[8, 2] == pytest.approx(0.02, abs=1e-12)
    force = simulation.reaction(second).force
    simulation.restore(snapshot)
    simulation.step(20)
    assert np.array_equal(simulation.reaction(second).force, force)
    assert np.array_equal(twin.positions(), simulation.positions())


def _turned_end(hold):
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=5e-3, material=RUBBER, name="rod")
    scene.clamp(rod.start)
    end = scene.grasp(rod, at=0.2) if hold == "hand" else scene.clamp(rod.end, hold=hold)
    return rod, end, scene.build(integrator="static", time_step=0.1)


@pytest.mark.parametrize("hold", ["frame", "edge", "hand"])
@pytest.mark.parametrize("how", ["equilibrium", "step", "path"])
def test_a_roll_by_any_number_of_turns_at_once_twists_as_one_in_parts(hold, how):
    """The twist of a straight rod between its ends is the roll over the length: below Greenhill's load no rod bends."""
    generator = np.random.default_rng([ord(hold[0]), ord(how[0])])
    for roll in (*generator.uniform(3.0, 11.0, 3) * generator.choice([-1.0, 1.0], 3), 3.0 * np.pi, -2.0 * np.pi):
        rod, end, simulation = _turned_end(hold)
        simulation.move(end, roll=roll)
        if how == "step":
            simulation.step()
        else:
            simulation.equilibrium(**({"path": "arc_length"} if how == "path" else {}))
        twists = simulation.twists(rod)
        if hold != "hand":
            assert np.sum(twists) * 0.01 == pytest.approx(roll * len(twists) / (20 - 0.5 * (hold == "edge")), rel=1e-6)
        by_parts_rod, by_parts_end, by_parts = _turned_end(hold)
        for share in np.linspace(0.25, 1.0, 4):
            by_parts.move(by_parts_end, roll=share * roll)
            by_parts.equilibrium()
        assert np.allclose(twists, by_parts.twists(by_parts_rod), rtol=1e-6)
        # The roll is at rest: nothing goes on.
        simulation.equilibrium()
        assert np.allclose(twists, simulation.twists(rod), rtol=1e-9)


def test_a_roll_with_a_tangent_at_once_ends_as_one_after_the_other():
    for seed in range(3):
        generator = np.random.default_rng(seed)
        roll = float(generator.uniform(4.0, 9.0))
        tangent = np.array([1.0, 0.0, 0.0]) + generator.normal(0.0, 0.1, 3)
        (_, end, at_once), (_, last, in_turn) = _turned_end("frame"), _turned_end("frame")
        at_once.move(end, position=(0.19, 0, 0), tangent=tangent, roll=roll)
        at_once.equilibrium()
        in_turn.move(last, position=(0.19, 0, 0), tangent=tangent)
        for share in np.linspace(0.1, 1.0, 10):
            in_turn.move(last, roll=share * roll)
            in_turn.equilibrium()
        assert at_once.twists("rod").sum() == pytest.approx(in_turn.twists("rod").sum(), rel=1e-6)


def test_a_roll_on_its_way_or_undone_leaves_no_turns_behind():
    rod, end, simulation = _turned_end("frame")
    before = simulation.snapshot()
    simulation.move(end, roll=9.0)
    kept = simulation.snapshot()
    simulation.restore(before)
    simulation.equilibrium()
    assert np.allclose(simulation.twists(rod), 0.0)
    simulation.restore(kept)
    simulation.copy().equilibrium()
    simulation.move(end, rotation=np.eye(3))
    simulation.equilibrium()
    assert np.allclose(simulation.twists(rod), 0.0)
    simulation.restore(kept)
    simulation.equilibrium()
    assert np.sum(simulation.twists(rod)) * 0.01 == pytest.approx(9.0 * 19 / 20, rel=1e-6)
