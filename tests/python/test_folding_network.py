"""Networks that know how sheets hang, against exact equilibria; and plans made with one."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.__main__ import main
from withe.folding import Paper, SheetNetwork, elastica, plan, replan, train
from withe.folding.sheet_network import SHIPPED

torch = pytest.importorskip("torch")


@pytest.fixture(scope="module")
def small():
    return SheetNetwork.load()


@pytest.fixture(scope="module")
def exact():
    random = np.random.default_rng(31)  # not the seeds of training
    return elastica(random.uniform(0.0, 10.3, 8000), random.uniform(0.0, 4.7, 8000))


def test_the_small_one_comes_with_withe_and_is_small():
    assert SHIPPED.is_relative_to(Path(withe.__file__).parent)
    assert SHIPPED.stat().st_size < 300_000


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda network: pickle.loads(pickle.dumps(network))])
def test_networks_are_pickled_and_copied(copied, small):
    asked = small([3.0, 4.0], 2.25)  # it is used, and has what it is used with
    again = copied(small)
    assert type(again) is SheetNetwork
    np.testing.assert_array_equal(again([3.0, 4.0], 2.25).angle, asked.angle)


def test_the_small_one_is_near_exact_equilibria(small, exact):
    there = exact.valid
    pose = small(exact.x[there], exact.z[there])
    assert pose.valid.mean() > 0.995
    for name, median, most in (("angle", 5e-4, 4e-3), ("suspended", 1e-3, 8e-3)):
        error = np.abs(getattr(pose, name) - getattr(exact, name)[there])[pose.valid]
        assert np.median(error) < median, name
        assert np.percentile(error, 95) < most, name
    low = pose.valid & (exact.force_ratio[there] < 1)
    error = np.abs(pose.force_ratio - exact.force_ratio[there])[low]
    assert np.median(error) < 5e-4
    assert np.percentile(error, 95) < 2e-3
    assert np.max(error) < 2e-2


def test_its_forces_balance_nearly(small, exact):
    pose = small(exact.x[exact.valid], exact.z[exact.valid])
    left = (pose.suspended - pose.normal_force) * np.sin(pose.angle)
    right = pose.z - pose.tangential_force * (1 - np.cos(pose.angle))
    assert np.nanpercentile(np.abs(left - right), 95) < 0.03
    np.testing.assert_allclose(pose.force_ratio, np.abs(pose.tangential_force) / pose.normal_force, rtol=1e-6)


def test_what_exact_equilibria_refuse_it_refuses_too_but_where_the_sheet_would_touch_the_table(small, exact):
    random = np.random.default_rng(31)
    x, z = random.uniform(0.0, 10.3, 8000)[~exact.valid], random.uniform(0.0, 4.7, 8000)[~exact.valid]
    touching = (x > 9.1) & (z < 0.8)
    assert touching.mean() < 0.2
    assert small(x[~touching], z[~touching]).valid.mean() < 0.01
    assert not small([-1.0, 2.0, 0.0, 50.0, 1.0], [1.0, -0.1, 1.0, 50.0, 4.7]).valid.any()


def test_answers_have_the_shape_of_the_question(small):
    pose = small(np.linspace(2.0, 3.0, 4)[:, None], [1.0, 2.0, 2.25])
    assert pose.angle.shape == pose.valid.shape == (4, 3)
    assert small(3.0, 2.25).angle.shape == ()


def test_tensors_have_gradients_those_of_differences(small):
    x = torch.tensor([3.0, 0.4, 9.0], dtype=torch.float64, requires_grad=True)
    z = torch.tensor([2.25, 1.2, 0.5], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x, z: tuple(small.tensors(x, z).values()), (x, z))
    pose = small(x.detach().numpy(), z.detach().numpy())
    for name, value in small.tensors(x, z).items():
        np.testing.assert_allclose(
            value.detach().numpy(), getattr(pose, name), rtol=1e-5, atol=2e-6
        )  # single precision


@pytest.mark.parametrize("method", ["ucs", "slip"])
def test_a_plan_from_the_network_is_that_of_exact_equilibria_nearly(method):
    paper = Paper(0.297, 0.21, 0.048, friction=0.3)
    exact, learned = (plan(paper, method=method, manifold=manifold) for manifold in ("exact", "network"))
    assert learned.manifold == "network"
    assert abs(learned.slip_ratio.max() - exact.slip_ratio.max()) < 0.01
    np.testing.assert_allclose(learned.poses[-1], exact.poses[-1], atol=1e-4)
    lgb = paper.gravito_bending_length
    inner = learned.poses[:, [0, 2]] / lgb
    depth = learned.jaw.depth / lgb
    pose = elastica(inner[:, 0] - depth + depth * np.cos(learned.angles), inner[:, 1] - depth * np.sin(learned.angles))
    lifted = learned.sheet.suspended > 1.2
    np.testing.assert_allclose(learned.angles[lifted], pose.angle[lifted], atol=0.02)
    assert np.isfinite(learned.max_curvature).all()


def test_the_rest_of_a_plan_from_the_network_is_from_it_too():
    folded = plan(Paper.a4(), manifold="network")
    rest = replan(folded, folded.poses[150], 0.004)
    assert rest.manifold == "network"
    assert rest.poses[-1, 0] == pytest.approx(folded.poses[-1, 0] + 0.004, abs=1e-4)


@pytest.mark.parametrize("options", [{"method": "intuitive"}, {"method": "slip", "grasp": "free"}])
def test_poses_that_it_has_not_learned_are_refused(options):
    with pytest.raises(ValueError, match=r"manifold 'network' covers grasps without moment only"):
        plan(Paper.a4(), manifold="network", **options)


def test_the_command_takes_it(tmp_path, capsys):
    assert main(["fold", "--manifold", "network", "--out", str(tmp_path / "fold.json")]) == 0
    assert '"manifold": "network"' in (tmp_path / "fold.json").read_text()
    assert "predicted" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["small", "source"])
def test_training_of_either_learns_and_is_kept(name, tmp_path):
    network = train(name, seed=1, samples=5000, time_limit=1e-3, progress=False)
    assert network.network.training.stopped == "time"
    again = SheetNetwork.load(network.save(tmp_path / "again.pt"))
    pose = again(3.0, 2.25)
    assert pose.angle == network(3.0, 2.25).angle
    assert pose.angle == pytest.approx(2.376, abs=0.6)
    assert np.isnan(pose.normal_force) == (name == "source")


def test_a_network_of_something_else_is_refused(tmp_path):
    x = np.random.default_rng(1).uniform(size=(20, 2))
    other = withe.learning.train_network(x, x, hidden=(3,), schedule=withe.learning.Cosine(1), progress=False)
    with pytest.raises(ValueError, match="must have learned sheets"):
        SheetNetwork.load(other.save(tmp_path / "other.pt"))


def test_bad_input_is_named(small):
    with pytest.raises(ValueError, match="name must be 'small' or 'source'"):
        train("large")
    with pytest.raises(ValueError, match="seed must lie in"):
        train(seed=-1)
    with pytest.raises(ValueError, match="x must be finite"):
        small(np.nan, 1.0)
    with pytest.raises(ValueError, match="must be tensors"):
        small.tensors(1.0, 2.0)
    with pytest.raises(ValueError, match="manifold must be"):
        plan(Paper.a4(), manifold="guess")
