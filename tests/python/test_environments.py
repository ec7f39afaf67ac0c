"""Environments for reinforcement learning: Gymnasium's checker, equal seeds, what is refused."""

import itertools
import pickle

import numpy as np
import pytest

import withe
from touching_task import Touch
from withe.learning.arms import _segment_distance

gymnasium = pytest.importorskip("gymnasium")
withe.learning.register()

NAMES = ["Follow", "Reach", "Obstacles2D", "Obstacles3D", "Crawl", "Wrap"]
SIZES = {
    "Follow": (76, 10, 500),
    "Reach": (86, 15, 100),
    "Obstacles2D": (47, 5, 50),
    "Obstacles3D": (121, 10, 50),
    "Crawl": (94, 18, 100),
    "Wrap": (98, 20, 60),
}

pytestmark = [
    pytest.mark.filterwarnings("error::withe.CoarseStepWarning"),
    pytest.mark.filterwarnings("ignore:.*Box observation space.*:UserWarning"),
]


def episodes(environment, actions, seed):
    """Observations and rewards of an episode with given actions."""
    seen, rewards = [environment.reset(seed=seed)[0]], []
    for action in actions:
        observation, reward, *_ = environment.step(action)
        seen.append(observation)
        rewards.append(reward)
    return np.array(seen), np.array(rewards)


@pytest.mark.parametrize("name", NAMES)
def test_gymnasiums_checker_passes(name):
    environment = gymnasium.make(f"withe/{name}-v0", disable_env_checker=True).unwrapped
    seen, done, steps = SIZES[name]
    assert environment.observation_space.shape == (seen,)
    assert environment.action_space.shape == (done,)
    assert environment.task.steps == steps
    from gymnasium.utils.env_checker import check_env

    check_env(environment)


@pytest.mark.parametrize("name", NAMES)
def test_equal_seeds_give_equal_episodes_alone_and_in_a_batch_of_any_number_of_workers(name):
    actions = np.random.default_rng(5).uniform(-1, 1, (6, 3, SIZES[name][1]))
    alone = gymnasium.make(f"withe/{name}-v0", disable_env_checker=True)
    wanted = [episodes(alone, actions[:, lane], 11 + lane) for lane in range(3)]
    for workers in (1, 2, 3):
        many = gymnasium.make_vec(f"withe/{name}-v0", 3, "vector_entry_point", workers=workers)
        seen, rewards = episodes(many, actions, 11)
        for lane in range(3):
            np.testing.assert_array_equal(seen[:, lane], wanted[lane][0])
            np.testing.assert_array_equal(rewards[:, lane], wanted[lane][1])


def test_an_action_bends_the_segments_by_as_much_as_it_says():
    env = withe.learning.Environment(withe.learning.Follow())
    env.reset(seed=0)
    action = np.zeros((2, 5))
    action[0, 1], action[1, 4] = 1.0, -0.5
    for _ in range(50):
        env.step(action.ravel())
    natural = env.simulation.get("arm", "natural_curvature")
    turn = 2.0 * np.tan(0.5 * 0.05 * natural)  # discrete curvature of edges of 0.05 m
    np.testing.assert_allclose(turn[3:7, 0].sum(), 2.0, atol=1e-12)  # 50 times 0.05, held at 2
    np.testing.assert_allclose(turn[15:, 1].sum(), -1.25, atol=1e-12)
    assert np.abs(np.delete(turn, range(3, 7), axis=0)[:, 0]).max() == 0.0


def test_rewards_are_those_of_the_distance():
    env = withe.learning.Environment(withe.learning.Follow())
    env.reset(seed=0)
    task = env.task
    tip = env.simulation.positions("arm")[-1]
    for distance, bonus in ((0.3, 0.0), (0.11, 0.0), (0.09, 0.5), (0.06, 0.5), (0.04, 2.0)):
        task.target[0] = tip + distance * np.array([0.0, 1.0, 0.0])
        found = task.reward(env.unwrapped._episodes.robots)[0]
        np.testing.assert_allclose(found, bonus - distance**2, atol=1e-12)


def test_one_task_in_several_environments_has_what_it_remembers_in_each():
    task = withe.learning.Follow()
    train, check = withe.learning.Environment(task), withe.learning.Environment(task)
    seen, _ = train.reset(seed=1)
    check.reset(seed=2)
    after, *_ = train.step(np.zeros(10))
    assert np.linalg.norm(after[-6:-3] - seen[-6:-3]) < 0.05 + 1e-6  # 0.5 m/s for 0.1 s
    many = withe.learning.VectorEnvironment(task, 3, workers=1)
    many.reset(seed=5)
    train.step(np.zeros(10))
    several = gymnasium.vector.SyncVectorEnv([lambda: withe.learning.Environment(task)] * 3)
    several.reset(seed=5)
    for _ in range(2):
        np.testing.assert_array_equal(several.step(np.zeros((3, 10)))[0], many.step(np.zeros((3, 10)))[0])
    assert vars(task) == vars(withe.learning.Follow())


def test_the_pose_to_reach_is_rewarded_by_distance_and_orientation():
    env = withe.learning.Environment(withe.learning.Reach())
    env.reset(seed=0)
    task = env.task
    robots = env._episodes.robots
    task.target[0] = env.simulation.positions("arm")[-1]
    for yaw in (0.0, 0.3, 0.9, 1.5):
        task.goal[0] = (0, 0, np.sin(yaw / 2), np.cos(yaw / 2))
        o = np.sin(yaw / 2) ** 2
        bonus = (6.0 if o < 0.05 else 4.5 if o < 0.1 else 4.0) - 2.0 * o
        np.testing.assert_allclose(task.reward(robots)[0], bonus - 0.5 * o**2, atol=1e-9)


def test_targets_keep_their_speed_and_stay_in_their_box():
    env = withe.learning.VectorEnvironment(withe.learning.Follow(), 20, workers=1)
    env.reset(seed=3)
    task = env.task
    before, turns = task.target.copy(), 0
    for _ in range(200):
        way = task.way.copy()
        task_actions = np.zeros((20, 10))
        robots = env.robots
        task.act(robots, task_actions, np.arange(20, dtype=np.intc))
        assert np.all((task.target >= [-0.6, -0.6, 0.3]) & (task.target <= [0.6, 0.6, 0.9]))
        np.testing.assert_allclose(np.linalg.norm(task.way, axis=1), 0.5)
        assert np.linalg.norm(task.target - before, axis=1).max() <= 0.05 + 1e-12
        turns += int(np.sum(np.abs(task.way - way).max(axis=1) > 1e-12))
        before = task.target.copy()
    assert 0.02 < turns / 4000 < 0.3  # by chance, and at walls


@pytest.mark.parametrize(("task", "seed", "count"), [("Follow", 4, 300), ("Obstacles3D", 47, 20)])
def test_actions_drawn_at_random_bring_arms_to_no_speed_of_their_own(task, seed, count):
    """Midpoint steps that are not watched gain energy: tips came to 11 and 180 m/s, and arms were crushed."""
    env = withe.learning.Environment(getattr(withe.learning, task)())
    env.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, env.task.action_size))
    fastest = 0.0
    for action in actions:
        env.step(action)
        fastest = max(fastest, float(np.linalg.norm(env.simulation.velocities("arm"), axis=1).max()))
    assert fastest < 5.0


def test_drawn_capsules_are_in_their_box_apart_and_new_in_each_episode():
    env = withe.learning.VectorEnvironment(withe.learning.Obstacles3D(), 3, workers=1)
    env.reset(seed=1)
    task = env.task
    first = task.ends.copy()
    ends = first.reshape(3, 8, 2, 3)
    assert np.all((ends >= task.low) & (ends <= task.high))
    np.testing.assert_allclose(np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1), 1.0)
    for capsules in ends:
        for a, b in itertools.combinations(capsules, 2):
            s = np.linspace(0, 1, 400)[:, None]
            sampled = np.linalg.norm((a[0] + s * (a[1] - a[0]))[:, None] - (b[0] + s * (b[1] - b[0])), axis=-1).min()
            exact = _segment_distance(*a, *b)
            assert exact >= 0.015
            assert sampled - 3e-3 <= exact <= sampled + 1e-12
    env.reset(seed=2)
    np.testing.assert_array_equal(task.ends[0], first[1])
    assert not np.array_equal(task.ends[2], first[2])


def test_the_ball_to_wrap_is_where_it_is_seen_from_the_reset_on_and_elsewhere_in_each_episode():
    alone = withe.learning.Environment(withe.learning.Wrap())
    many = withe.learning.VectorEnvironment(withe.learning.Wrap(), 2, workers=1)
    together, _ = many.reset(seed=3)
    for lane in range(2):
        seen, _ = alone.reset(seed=3 + lane)
        np.testing.assert_array_equal(seen, together[lane])
        for robot in (alone.simulation, many.robots[lane]):
            np.testing.assert_array_equal(robot.obstacle_position("ball").astype(np.float32), seen[75:78])
        place = alone.simulation.obstacle_position("ball")
        alone.step(np.zeros(20))
        np.testing.assert_array_equal(alone.simulation.obstacle_position("ball"), place)
    assert np.abs(together[0, 75:77] - together[1, 75:77]).max() > 1e-3


@pytest.mark.parametrize("autoreset", ["next_step", "same_step"])
def test_robots_begin_again_by_themselves_as_gymnasium_has_it(autoreset):
    mode = gymnasium.vector.AutoresetMode[autoreset.upper()]
    reference = gymnasium.vector.SyncVectorEnv([lambda: withe.learning.Environment(Touch())] * 2, autoreset_mode=mode)
    many = withe.learning.VectorEnvironment(Touch(), 2, workers=1, autoreset=autoreset)
    by_mode = withe.learning.VectorEnvironment(Touch(), 2, workers=1, autoreset=mode)
    assert by_mode.metadata["autoreset_mode"] == many.metadata["autoreset_mode"] == mode
    np.testing.assert_array_equal(reference.reset(seed=4)[0], many.reset(seed=4)[0])
    for step in range(9):
        actions = np.random.default_rng(step).uniform(-1, 1, (2, 2)).astype(np.float32)
        for wanted, found in zip(reference.step(actions)[:4], many.step(actions)[:4], strict=True):
            np.testing.assert_array_equal(wanted, found)


def test_an_arm_alone_begins_again_after_its_last_step():
    class Short(withe.learning.Follow):
        steps = 2

    one = withe.learning.VectorEnvironment(Short(), 1)
    first, _ = one.reset(seed=4)
    for _ in range(2):
        _, _, _, truncated, _ = one.step(np.ones((1, 10)))
    assert truncated.all()
    again, reward, _, truncated, _ = one.step(np.ones((1, 10)))
    assert again.shape == first.shape
    assert not truncated.any()
    assert reward[0] == 0.0
    assert one.robots.time[0] == 0.0


def test_episodes_are_cut_short_by_max_episode_steps_alone_and_in_a_batch():
    alone = gymnasium.make("withe/Follow-v0", max_episode_steps=3, disable_env_checker=True)
    many = gymnasium.make_vec("withe/Follow-v0", 2, max_episode_steps=3)
    alone.reset(seed=6)
    many.reset(seed=6)
    for step in range(3):
        seen, _, _, truncated, _ = many.step(np.zeros((2, 10)))
        single, _, _, over, _ = alone.step(np.zeros(10))
        np.testing.assert_array_equal(seen[0], single)
        assert truncated.tolist() == [over, over] == [step == 2] * 2
    assert gymnasium.make_vec("withe/Follow-v0", 1, max_episode_steps=-1).task.steps == 500
    with pytest.raises(ValueError, match=r"max_episode_steps must lie in 1"):
        gymnasium.make_vec("withe/Follow-v0", 1, max_episode_steps=0)


def test_some_begin_again_by_a_mask():
    many = withe.learning.VectorEnvironment(Touch(), 3, workers=2, autoreset="disabled")
    many.reset(seed=0)
    for _ in range(3):
        _, _, _, truncated, _ = many.step(np.ones((3, 2)))
    assert truncated.all()
    many.reset(options={"reset_mask": np.array([True, False, True])})
    np.testing.assert_allclose(many.robots.time, [0.0, 0.3, 0.0])
    with pytest.raises(ValueError, match=r"episodes of robots \[1\] are over"):
        many.step(np.ones((3, 2)))


class Brittle(Touch):
    """Folds to and fro where an action is 1, which no step of 20 ms reaches in 6 iterations."""

    steps = 20

    def build(self, generator):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=self.viscosity)
        arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, 0.3), nodes=9, radius=1e-2, material=rubber, name="arm")
        scene.clamp(arm.start)
        return scene.build(time_step=0.02, adaptive=False, solver=withe.Solver(max_iterations=6))

    def act(self, robots, actions, chosen):
        zigzag = np.where(np.arange(7) % 2, 55.0, -55.0)[:, None] * np.ones(2)
        robots.set("arm", natural_curvature=(actions[:, :1] == 1.0)[..., None] * zigzag, lanes=chosen)


def test_a_robot_whose_simulation_fails_ends_its_episode_and_no_others():
    many = withe.learning.VectorEnvironment(Brittle(), 2, workers=2)
    many.reset(seed=0)
    _, _, terminated, truncated, infos = many.step(np.array([[1.0, 0.0], [0.0, 0.0]]))
    assert truncated.tolist() == [True, False]
    assert not terminated.any()
    assert infos["failed"].tolist() == [True, False]
    _, _, _, truncated, infos = many.step(np.zeros((2, 2)))
    assert not truncated.any()
    assert not infos
    np.testing.assert_allclose(many.robots.time, [0.0, 0.2])


def test_pictures_are_drawn():
    pytest.importorskip("matplotlib")
    env = withe.learning.Environment(withe.learning.Obstacles2D(), render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    assert first.shape == (480, 640, 3)
    assert first.dtype == np.uint8
    assert np.ptp(first) > 200
    for _ in range(2):
        env.step(np.ones(5))
    assert np.any(env.render() != first)
    many = withe.learning.VectorEnvironment(Touch(), 2, workers=1, render_mode="rgb_array")
    many.reset(seed=0)
    assert many.render()[0].shape == (480, 640, 3)


def test_the_floor_that_a_robot_stands_on_is_in_its_picture_and_labels_are_apart():
    pytest.importorskip("matplotlib")
    env = withe.learning.Environment(withe.learning.Crawl(), render_mode="rgb_array")
    env.reset(seed=0)
    env.render()
    axes = env._screen._axes
    feet = min(env.simulation.positions(f"leg {i}")[-1, 2] for i in range(6))
    floor = [z for *_, z in (line.get_data_3d() for line in axes.lines) if np.allclose(z, feet - 5e-3, atol=1e-3)]
    assert len(floor) > 10
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        low, high = axis.get_view_interval()
        boxes = [tick.label1.get_window_extent() for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
        assert len(boxes) >= 3
        # Upright labels on a slanted axis: their middles are as far apart as a label is high, or wide.
        for one, other in itertools.pairwise(boxes):
            apart = np.abs(np.subtract([one.x0 + one.x1, one.y0 + one.y1], [other.x0 + other.x1, other.y0 + other.y1]))
            assert apart[0] >= one.width + other.width or apart[1] >= one.height + other.height


def closed(env):
    env.close()
    return env


BAD = [
    (lambda env: env.step(np.full(2, 1.5)), ValueError, "action must lie in -1..1, got 1.5"),
    (lambda env: env.step([0, -1.00001]), ValueError, "action must lie in -1..1, got -1.00001"),
    (lambda env: env.step([0, 1.0000015]), ValueError, "action must lie in -1..1, got 1.0000015"),
    (lambda env: env.step(np.ones(3)), ValueError, "action must have shape (2,), got (3,)"),
    (lambda env: env.step(0.1), ValueError, "action must have shape (2,), got a single number"),
    (lambda env: env.step([[0.0, 0.0]]), ValueError, "action must have shape (2,), got (1, 2)"),
    (lambda env: env.step([np.nan, 0]), ValueError, "action must be finite, got nan"),
    (lambda env: closed(env).step(np.ones(2)), gymnasium.error.ClosedEnvironmentError, "the environment is closed"),
    (lambda env: closed(env).reset(), gymnasium.error.ClosedEnvironmentError, "the environment is closed"),
    (
        lambda env: withe.learning.Environment(Touch()).step(np.ones(2)),
        gymnasium.error.ResetNeeded,
        "call reset before step",
    ),
    (lambda env: withe.learning.Environment(Touch(), "ascii"), ValueError, "render_mode must be 'rgb_array' or"),
    (lambda env: withe.learning.Environment(3), ValueError, "task must be a withe.learning.Task, got int"),
    (lambda env: withe.learning.VectorEnvironment(Touch(), 0), ValueError, "number of environments must lie in 1.."),
    (lambda env: withe.learning.VectorEnvironment(Touch(), 2, 0), ValueError, "workers must lie in 1..4096, got 0"),
    (
        lambda env: withe.learning.VectorEnvironment(Touch(), 2, autoreset="never"),
        ValueError,
        "autoreset must be 'next_step' or",
    ),
    (
        lambda env: withe.learning.VectorEnvironment(Touch(), 2, 1).reset(options={"reset_mask": np.ones(3, bool)}),
        ValueError,
        "reset_mask must be bool of shape (2,), got bool of shape (3,)",
    ),
    (
        lambda env: withe.learning.VectorEnvironment(Touch(), 2, 1).reset(seed=[1, 2, 3]),
        ValueError,
        "seed must be one number, or one for each of 2 robots, got 3",
    ),
    (lambda env: many().reset(seed=1.5), ValueError, "seed must be a whole number, got 1.5"),
    (lambda env: many().reset(seed="ab"), ValueError, "seed must be a whole number, got 'ab'"),
    (lambda env: many().reset(seed=-1), ValueError, "seed must lie in 0..9223372036854775807, got -1"),
    (lambda env: many().reset(seed=[1, 0.5]), ValueError, "seed of robot 1 must be a whole number, got 0.5"),
    (lambda env: withe.learning.Environment(Touch), ValueError, "withe.learning.Task, got the class Touch itself"),
]


def many():
    return withe.learning.VectorEnvironment(Touch(), 2, workers=1)


def test_seeds_are_one_for_all_or_one_each_in_any_kind_of_row():
    seen = [many().reset(seed=seed)[0] for seed in (7, np.int64(7), [7, 8], (7, 8), np.array([7, 8]), [7, None])]
    for other in seen[1:]:
        np.testing.assert_array_equal(seen[0], other)


@pytest.mark.parametrize(("call", "kind", "message"), BAD)
def test_bad_input_says_what_was_expected(call, kind, message):
    env = withe.learning.Environment(Touch())
    env.reset(seed=0)
    with pytest.raises(kind) as error:
        call(env)
    assert message in str(error.value)


def test_actions_that_single_precision_rounds_beyond_the_box_are_taken_for_its_border():
    env = withe.learning.Environment(Touch())
    one = np.nextafter(np.float32(1.0), np.float32(2.0))
    env.reset(seed=0)
    wanted, *_ = env.step(np.array([1.0, -1.0]))
    env.reset(seed=0)
    np.testing.assert_array_equal(env.step(np.array([one, -one]))[0], wanted)


WRONG = [
    ("reward", lambda robots: np.zeros((len(robots), 1)), "must return shape (4,), got (4, 1)"),
    ("reward", lambda robots: 1.0, "must return shape (4,), got ()"),
    ("reward", lambda robots: np.array([0.0, 1.0, np.nan, 2.0]), "must be finite, got nan of robot 2"),
    ("finished", lambda robots: np.array([True]), "must return shape (4,), got (1,)"),
    ("observe", lambda robots: {"tip": 1.0}, "must return an array of numbers, got dict: float() argument"),
    ("reward", lambda robots: [None] * 3 + ["a"], "must return an array of numbers, got list"),
    ("observe", lambda robots: robots.positions("arm")[0, -1], "must return shape (4, ...), got (3,)"),
    ("observe", lambda robots: robots.positions("arm")[:, -1] * np.inf, "must be finite, got"),
    (
        "observe",
        lambda robots: np.zeros((4, 6 if robots.time[0] == 0.0 else 5)),
        "must return shape (4, 6), got (4, 5)",
    ),
]


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize(("method", "found", "message"), WRONG)
def test_what_a_task_returns_in_another_shape_or_not_finite_is_refused(method, found, message):
    kind = type("Careless", (Touch,), {method: lambda self, robots: found(robots)})

    def stepped():
        many = withe.learning.VectorEnvironment(kind(), 4, workers=1)
        many.reset(seed=0)
        many.step(np.zeros((4, 2)))

    with pytest.raises(ValueError, match=r"Careless") as error:
        stepped()
    assert str(error.value).startswith(f"Careless.{method} {message}")


@pytest.mark.parametrize("redraw", [False, True])
def test_a_task_that_builds_no_simulation_is_told_what_to_return(redraw):
    class Drawn(Touch):
        """Forgets to build what it has drawn, always or from the second episode on."""

        def build(self, generator):
            drawn = withe.Scene()
            self.builds = getattr(self, "builds", 0) + 1
            return super().build(generator) if self.redraw and self.builds == 1 else drawn

    Drawn.redraw = redraw
    with pytest.raises(ValueError, match=r"Drawn.build must return a withe.Simulation, as scene.build\(...\) does"):
        withe.learning.Environment(Drawn())


@pytest.mark.parametrize("name", ["Follow", "Reach", "Obstacles2D", "Obstacles3D"])
def test_steps_that_are_long_on_purpose_are_no_reason_for_a_warning_and_longer_ones_are(name):
    class Longer(getattr(withe.learning, name)):
        """Steps that nobody has measured."""

        time_step = 0.1

    def whip(task):
        many = withe.learning.VectorEnvironment(task, 8, workers=1)
        many.reset(seed=0)
        many.action_space.seed(0)
        alone = pickle.loads(pickle.dumps(many.robots[0])).copy()
        for _ in range(30):
            actions = many.action_space.sample()
            many.step(actions)
            alone.set("arm", natural_curvature=many.robots[0].get("arm", "natural_curvature"))
            alone.step()

    whip(getattr(withe.learning, name)())
    with pytest.raises(withe.CoarseStepWarning, match=r"is too long: |is longer than the impact"):
        whip(Longer())


@pytest.mark.filterwarnings("ignore:.*:DeprecationWarning")
def test_environments_by_name_say_which_options_they_have_and_how_to_make_others():
    for make, environment in ((gymnasium.make, "Environment"), (gymnasium.make_vec, "VectorEnvironment")):
        with pytest.raises(
            TypeError, match=r"withe/Follow-v0 has no option 'speed'; its options are .*render_mode"
        ) as it:
            make("withe/Follow-v0", speed=1.0)
        assert f"class Other(withe.learning.Follow) and use withe.learning.{environment}(Other())" in str(it.value)


def test_a_control_step_is_a_whole_number_of_time_steps():
    task = Touch()
    task.control_step = 0.05
    with pytest.raises(ValueError, match=r"control_step must be a whole number of time steps of 0.02 s, got 0.05 s"):
        withe.learning.Environment(task)


def test_a_task_that_cannot_be_copied_is_refused():
    task = Touch()
    task.numbers = (i for i in range(3))
    with pytest.raises(ValueError, match=r"task must be one that copy.deepcopy can copy: Touch, cannot pickle"):
        withe.learning.Environment(task)
