"""Networks that know where to hold a rod, against exact grasps; and plans made with one."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.deployment import Cable, GraspNetwork, Pattern, deploy, grasp, plan, train
from withe.deployment.grasp_network import SHIPPED
from withe.learning import Network

torch = pytest.importorskip("torch")
DATA = Path(__file__).resolve().parent.parent / "data"
ROWS = np.genfromtxt(DATA / "rod_grasps.csv", delimiter=",", names=True)


@pytest.fixture(scope="module")
def small():
    return GraspNetwork.load()


def new_questions(count=2000):
    random = np.random.default_rng(31)  # not the seeds of training
    length = np.exp(random.uniform(np.log(0.5), np.log(50.0), count))
    return length, random.uniform(-4.0, 4.0, count), random.uniform(300.0, 8000.0, count)


def distances(found, exact, name):
    return np.linalg.norm(getattr(found, name) - getattr(exact, name), axis=-1)


def test_the_small_one_comes_with_withe_and_is_small():
    assert SHIPPED.is_relative_to(Path(withe.__file__).parent)
    assert SHIPPED.stat().st_size < 300_000


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda network: pickle.loads(pickle.dumps(network))])
def test_networks_are_pickled_and_copied(copied, small):
    asked = small(5.0, [0.25, -1.0])  # it is used, and has what it is used with
    again = copied(small)
    assert type(again) is GraspNetwork
    np.testing.assert_array_equal(again(5.0, [0.25, -1.0]).position, asked.position)


@pytest.mark.parametrize("question", [new_questions(), (ROWS["lsbar"], ROWS["kappabar"], ROWS["ksbar"])])
@pytest.mark.parametrize("name", ["position", "rotation"])
def test_the_small_one_is_near_exact_grasps(small, question, name):
    away = distances(small(*question), grasp(*question), name)
    assert np.median(away) < 1e-3
    assert np.percentile(away, 95) < 3e-3


def test_shortest_and_longest_rods_are_known_too(small):
    for length in (0.1, 0.3, 50.0):
        question = length, np.linspace(-4.0, 4.0, 9), 2087.0
        assert distances(small(*question), grasp(*question), "position").max() < 0.01


def test_a_straight_rod_is_laid_straight_and_a_mirrored_one_mirrored(small):
    straight = small([0.5, 5.0, 30.0], 0.0)
    np.testing.assert_array_equal(straight.position[:, 1], 0.0)
    np.testing.assert_array_equal(straight.rotation[:, [0, 2]], 0.0)
    right, left = small(4.0, 0.8), small(4.0, -0.8)
    np.testing.assert_allclose(left.position, right.position * [1, -1, 1], rtol=1e-12)
    np.testing.assert_allclose(left.rotation, right.rotation * [-1, 1, -1], rtol=1e-12)


def test_answers_have_the_shape_of_the_question_and_no_forces(small):
    found = small(np.linspace(2.0, 3.0, 4)[:, None], [0.0, 0.5, 1.0])
    assert found.position.shape == found.rotation.shape == found.force.shape == (4, 3, 3)
    assert found.stable.shape == found.residual.shape == (4, 3)
    assert np.isnan(found.force).all()
    assert small(3.0, 0.5).position.shape == (3,)


def test_tensors_have_gradients_those_of_differences(small):
    question = [
        torch.tensor(values, dtype=torch.float64, requires_grad=True)
        for values in ([0.7, 4.0, 30.0], [0.3, -0.8, 3.0], [400.0, 2087.0, 7000.0])
    ]
    assert torch.autograd.gradcheck(lambda *asked: tuple(small.tensors(*asked).values()), question)
    found = small(*(values.detach().numpy() for values in question))
    for name, axis in (("x", 0), ("y", 1), ("z", 2)):
        np.testing.assert_allclose(small.tensors(*question)[name].detach().numpy(), found.position[:, axis], rtol=1e-9)


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ((0.09, 0.5, 2087.0), "suspended must be from 0.1 to 50 for a network, got 0.09"),
        ((51.0, 0.5, 2087.0), "suspended must be from 0.1 to 50 for a network, got 51"),
        ((5.0, [0.5, -4.1], 2087.0), "the size of curvature must be from 0 to 4 for a network, got 4.1"),
        ((5.0, 0.5, 250.0), "stretch_stiffness must be from 300 to 8000 for a network, got 250"),
        ((5.0, np.nan, 2087.0), "curvature must be finite"),
    ],
)
def test_what_it_has_not_learned_is_refused(small, question, message):
    with pytest.raises(ValueError, match=message):
        small(*question)


def bend():
    return Pattern.bends([1.2, -1.2], [0.07, 0.07], [0.08, 0.0, 0.08], easing=0.06)


def test_a_plan_from_the_network_is_that_of_exact_grasps_nearly():
    cable = Cable.dlo(2)
    exact, learned = (plan(cable, bend(), controller) for controller in ("exact", "network"))
    assert learned.method == "network"
    s = np.linspace(0.01, 0.95, 50) * exact.pattern.length

    def along(motion, rows):
        return np.stack([np.interp(s, motion.laid, row) for row in rows.T], 1)

    away = along(learned, learned.positions) - along(exact, exact.positions)
    thin = 0.25 * cable.radius  # is what the network leaves out
    assert np.abs(away).max() < 0.005 * cable.gravito_bending_length + thin
    turned = np.abs((along(learned, learned.rotations) * along(exact, exact.rotations)).sum(1))
    assert 2.0 * np.arccos(np.minimum(turned, 1.0)).max() < 0.01
    assert np.isnan(learned.needed_friction).all()
    np.testing.assert_allclose(learned.feasibility(0.4).needed, exact.feasibility(0.4).needed)


@pytest.mark.slow
def test_the_network_lays_as_well_as_exact_grasps():
    cable, pattern = Cable(0.42, 1.6e-3, 0.03), bend()
    exact, learned = (
        deploy(plan(cable, pattern, controller), friction=0.6, quasi_static=True, nodes=70, progress=False)
        for controller in ("exact", "network")
    )
    assert abs(learned.error - exact.error) < 5e-4


def test_a_cable_beyond_the_network_is_refused_in_its_words():
    with pytest.raises(ValueError, match="stretch_stiffness must be from 300 to 8000 for a network, got 24025"):
        plan(Cable(0.5, 4e-4, 0.031), bend(), "network")


@pytest.mark.parametrize(("name", "limit", "stopped"), [("small", None, "epochs"), ("source", 1e-3, "time")])
def test_training_of_either_learns_and_is_kept(name, limit, stopped, tmp_path):
    network = train(name, seed=1, samples=2000, time_limit=limit, progress=False)
    assert network.network.training.stopped == stopped
    again = GraspNetwork.load(network.save(tmp_path / "again.pt"))
    np.testing.assert_array_equal(again(5.0, 0.25).position, network(5.0, 0.25).position)
    if name == "small":  # it knows a string from the start
        assert np.linalg.norm(again(5.0, 0.25).position - grasp(5.0, 0.25).position) < 1.0


def test_a_file_of_another_version_or_of_something_else_is_refused(small, tmp_path):
    content = torch.load(SHIPPED, weights_only=True)
    content["version"] = 0
    torch.save(content, tmp_path / "old.pt")
    with pytest.raises(ValueError, match="is a network of version 0, this withe reads version 1"):
        GraspNetwork.load(tmp_path / "old.pt")
    with pytest.raises(ValueError, match="network must have learned grasps"):
        GraspNetwork(Network.load(withe.folding.SheetNetwork.SHIPPED))


def test_bad_input_is_named(small):
    with pytest.raises(ValueError, match="name must be 'small' or 'source'"):
        train("large")
    with pytest.raises(ValueError, match="seed must lie in"):
        train(seed=-1)
    with pytest.raises(ValueError, match="must be tensors"):
        small.tensors(1.0, 0.5, 2087.0)
