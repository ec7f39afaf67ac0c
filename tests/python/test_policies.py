"""Policies that are trained on environments: equal seeds, scales, interruption, and the examples of learning."""

import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import withe
from touching_task import Touch

gymnasium = pytest.importorskip("gymnasium")

pytestmark = [
    pytest.mark.filterwarnings("error::withe.CoarseStepWarning"),
    pytest.mark.filterwarnings("ignore:.*Box observation space.*:UserWarning"),
]


def test_a_policy_is_trained_the_same_for_equal_seeds():
    pytest.importorskip("stable_baselines3")

    def policy():
        return withe.learning.train_policy(
            Touch(), 96, environments=4, workers=2, seed=3, progress=False, batch_size=24, gradient_steps=2
        )

    seen = np.linspace(-0.1, 0.3, 6, dtype=np.float32)
    first, second = (policy().predict(seen, deterministic=True)[0] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert first.shape == (2,)


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("nodes", [1, 2, 3])
def test_a_policy_is_trained_on_observations_of_several_nodes(nodes, normalize):
    pytest.importorskip("stable_baselines3")

    class Nodes(Touch):
        def observe(self, robots):
            return robots.positions("arm")[:, -nodes:]

    policy = withe.learning.train_policy(
        Nodes(), 48, environments=2, workers=1, normalize=normalize, progress=False, batch_size=8
    )
    assert policy.predict(np.zeros((nodes, 3), np.float32), deterministic=True)[0].shape == (2,)
    if normalize:
        assert policy.actor.features_extractor.running_mean.shape == (3 * nodes,)


def generators(torch):
    """States of those that Stable-Baselines3 seeds."""
    return random.getstate(), np.random.get_state()[1].tolist(), torch.get_rng_state().tolist()  # noqa: NPY002


def test_training_leaves_threads_and_generators_as_they_were():
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(2)
        states = generators(torch)
        withe.learning.train_policy(Touch(), 16, environments=2, workers=1, seed=5, progress=False)
        assert torch.get_num_threads() == 2
        assert generators(torch) == states
    finally:
        torch.set_num_threads(before)


def test_training_that_is_interrupted_returns_what_has_been_learned_and_says_so():
    pytest.importorskip("stable_baselines3")
    calls = []

    def interrupt(policy):
        calls.append(policy.num_timesteps)
        if len(calls) == 5:
            raise KeyboardInterrupt

    with pytest.warns(UserWarning, match=r"training was interrupted: .* after 16 of 4000 control steps"):
        policy = withe.learning.train_policy(
            Touch(), 4000, environments=4, workers=1, progress=False, batch_size=8, callback=interrupt
        )
    assert calls == [0, 4, 8, 12, 16, 16]
    assert policy.predict(np.zeros(6, np.float32), deterministic=True)[0].shape == (2,)


def test_scales_of_observations_are_those_of_what_was_seen_and_kept_with_the_policy(tmp_path):
    baselines = pytest.importorskip("stable_baselines3")
    observed = []

    class Recorded(Touch):
        def observe(self, robots):
            found = super().observe(robots)
            observed.append(np.array(found))
            return found

    task = Recorded()
    policy = withe.learning.train_policy(task, 192, environments=4, workers=1, progress=False, batch_size=24)
    scaling = policy.actor.features_extractor
    assert policy.critic.features_extractor is scaling
    behind = policy.critic_target.features_extractor
    assert float(scaling.running_count[0]) == 192.0
    assert 144.0 < float(behind.running_count[0]) <= 192.0  # as of the last update
    seen = np.concatenate(observed)
    for mean in (scaling.running_mean.numpy(), behind.running_mean.numpy()):
        assert np.all(mean >= seen.min(axis=0) - 1e-6)
        assert np.all(mean <= seen.max(axis=0) + 1e-6)
    policy.save(tmp_path / "policy.zip")
    again = baselines.SAC.load(tmp_path / "policy.zip", device="cpu")
    some = seen[:5].astype(np.float32)
    np.testing.assert_array_equal(*(p.predict(some, deterministic=True)[0] for p in (policy, again)))


def test_running_means_and_deviations_are_those_of_all_at_once():
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    from withe.learning.training import _scaling

    scaling = _scaling()(gymnasium.spaces.Box(-1.0, 1.0, (3,)))
    drawn = np.random.default_rng(0).normal((5.0, 0.0, -1.0), (0.1, 2.0, 1.0), (4, 8, 6, 3)).astype(np.float32)
    for part in drawn:
        scaling.take_in(part)
    rows = drawn.reshape(-1, 3)
    scaled = scaling(torch.as_tensor(rows)).numpy()
    np.testing.assert_allclose(scaled, (rows - rows.mean(0)) / rows.std(0), atol=2e-3)


def test_a_policy_learns_to_hold_the_arc_that_is_nearest():
    pytest.importorskip("stable_baselines3")

    class Calm(Touch):
        steps, viscosity = 10, 1e5

    policy = withe.learning.train_policy(
        Calm(),
        4000,
        environments=8,
        workers=1,
        progress=False,
        gamma=0.8,
        batch_size=64,
        policy_kwargs={"net_arch": [32, 32]},
    )
    robots = withe.learning.VectorEnvironment(Calm(), 1, 1)
    seen, _ = robots.reset(seed=0)
    for _ in range(Calm.steps):
        seen, rewards, *_ = robots.step(policy.predict(seen, deterministic=True)[0])
    turned = np.linspace(0.01, 1.8, 1000)  # by arcs of 0.3 m, which the arm at rest is
    arcs = 0.3 / turned * np.array([1.0 - np.cos(turned), 0.0 * turned, np.sin(turned)])
    nearest = np.linalg.norm(arcs - Touch.goal[:, None], axis=0).min()
    assert nearest < 0.03
    assert -rewards[0] < nearest + 0.03  # 0.08 further away at the start


def test_training_refuses_what_is_no_task():
    pytest.importorskip("stable_baselines3")
    with pytest.raises(ValueError, match=r"steps must lie in 1"):
        withe.learning.train_policy(Touch(), 0)
    with pytest.raises(ValueError, match=r"task must be a withe.learning.Task, got int"):
        withe.learning.train_policy(3, 10)
    with pytest.raises(ValueError, match=r"seed must lie in 0"):
        withe.learning.train_policy(Touch(), 10, seed=-1)


@pytest.mark.parametrize("name", ["learn_follow", "follow_by_gradients", "follow_by_derivatives"])
def test_examples_of_learning_say_what_they_take(name):
    pytest.importorskip("torch")
    path = Path(__file__).resolve().parents[2] / "examples" / f"{name}.py"
    refused = subprocess.run([sys.executable, path, "many"], capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert refused.stderr.startswith(f"usage: {name}.py")
