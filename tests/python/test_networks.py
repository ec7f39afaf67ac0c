"""Small networks: what they learn, that a file keeps them, and what is refused."""

import copy
import pickle
import sys

import numpy as np
import pytest

import withe
from simple_scenes import ctrl_c_once
from withe.learning import Alternating, Cosine, Network, train_network

torch = pytest.importorskip("torch")

RANDOM = np.random.default_rng(3)
X = RANDOM.uniform([-1.0, 500.0], [1.0, 900.0], (1500, 2))


def function(x):
    """Two outputs of very different size, of inputs of very different size."""
    a, b = x[..., 0], (x[..., 1] - 700.0) / 200.0
    return np.stack([40.0 + np.sin(2.0 * a + b), 1e-3 * a * b], axis=-1)


@pytest.fixture(scope="module")
def network():
    names = {"inputs": ("a", "b"), "outputs": ("wave", "product")}
    return train_network(
        X, function(X), hidden=(24, 24), schedule=Cosine(100, 64, 1e-2), seed=1, progress=False, **names
    )


def test_a_smooth_function_is_learned_to_a_hundredth_of_its_spread(network):
    new = np.random.default_rng(4).uniform(X.min(axis=0), X.max(axis=0), (500, 2))
    error = (network(new) - function(new)) / function(X).std(axis=0)
    assert np.sqrt((error**2).mean()) < 1e-2
    assert np.sqrt(network.training.loss) == pytest.approx(np.sqrt((error**2).mean()), rel=0.6)


def test_it_is_asked_in_any_shape_and_in_the_precision_of_the_question(network):
    rows = X[:1300]
    assert network(rows[0]).shape == (2,)
    assert network(rows[:12].reshape(3, 4, 2)).shape == (3, 4, 2)
    assert network(rows[:0]).shape == (0, 2)
    assert network(rows.tolist()).dtype == np.float64
    single = network(rows.astype(np.float32))
    assert single.dtype == np.float32
    assert np.allclose(single, network(rows), rtol=1e-5, atol=1e-6)


def test_rows_do_not_depend_on_which_others_are_asked_with_them(network):
    many = np.tile(X, (4, 1))
    assert np.allclose(network(many)[4500:], network(X), rtol=1e-13)


def test_tensors_have_gradients_those_of_differences(network):
    x = torch.tensor(X[:5] / [1.0, 100.0], requires_grad=True)
    assert torch.autograd.gradcheck(lambda scaled: network(scaled * torch.tensor([1.0, 100.0])), x)
    assert np.allclose(network(torch.tensor(X)).numpy(), network(X), rtol=1e-13)


def test_its_domain_is_that_of_its_data(network):
    assert np.array_equal(network.domain, [X.min(axis=0), X.max(axis=0)])


@pytest.mark.parametrize("spread", [30.0, 1000.0])
def test_data_far_from_zero_are_learned_as_those_about_zero_are(spread, tmp_path):
    u = np.linspace(-1.0, 1.0, 1000)[:, None]
    wave = np.sin(3.0 * u)
    time = 1.7e9 + 60.0  # [s], between two numbers of single precision, which are 128 apart
    options = {"hidden": (16, 16), "schedule": Cosine(20, 64, 1e-2), "progress": False}
    expected = train_network(u, wave, **options)
    of_times = train_network(time + spread * u, wave, **options)
    times = Network.load(train_network(u, time + spread * wave, **options).save(tmp_path / "times.pt"))
    np.testing.assert_allclose(of_times(time + spread * u), expected(u), atol=0.01)
    np.testing.assert_allclose((times(u) - time) / spread, expected(u), atol=0.01)
    x = torch.tensor(u, requires_grad=True)
    slopes = [torch.autograd.grad(y.sum(), x)[0].numpy() for y in (expected(x), of_times(time + spread * x))]
    np.testing.assert_allclose(slopes[1], slopes[0], atol=0.03)


def test_equal_seeds_give_equal_networks_and_leave_the_seed_and_the_threads_of_torch_alone():
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    threads = torch.get_num_threads()
    torch.set_num_threads(threads + 2)  # not as many as a network is trained with
    found = [
        train_network(X[:200], function(X[:200]), hidden=(8,), schedule=Cosine(3, 32), seed=seed, progress=False)(X)
        for seed in (7, 7, 8)
    ]
    assert torch.equal(torch.rand(3), expected)
    assert torch.get_num_threads() == threads + 2
    torch.set_num_threads(threads)
    assert np.array_equal(found[0], found[1])
    assert not np.allclose(found[0], found[2])


def test_a_file_keeps_everything(network, tmp_path):
    again = Network.load(network.save(tmp_path / "small.pt"))
    assert np.array_equal(again(X), network(X))
    assert (again.inputs, again.outputs, again.hidden, again.activation) == (
        ("a", "b"),
        ("wave", "product"),
        (24, 24),
        "silu",
    )
    assert again.training == network.training
    assert np.array_equal(again.domain, network.domain)
    assert np.array_equal(pickle.loads(pickle.dumps(network))(X), network(X))
    assert np.array_equal(copy.deepcopy(network)(X), network(X))


def test_weights_of_another_version_are_refused(network, tmp_path):
    path = network.save(tmp_path / "small.pt")
    content = torch.load(path, weights_only=True)
    torch.save({**content, "version": 99}, path)
    with pytest.raises(ValueError, match=r"version 99, this withe reads version 1"):
        Network.load(path)


class Dangerous:
    def __reduce__(self):
        return print, ("this ran",)


@pytest.mark.parametrize("content", [{"a": 1}, torch.zeros(2), Dangerous()])
def test_other_files_are_refused_and_run_no_code(content, tmp_path, capfd):
    torch.save(content, tmp_path / "other.pt")
    with pytest.raises(ValueError, match=r"other.pt is not a network of withe"):
        Network.load(tmp_path / "other.pt")
    assert "this ran" not in capfd.readouterr().out


def test_a_file_that_is_no_archive_is_refused(tmp_path):
    (tmp_path / "text.pt").write_text("hello")
    with pytest.raises(ValueError, match=r"text.pt is not a network"):
        Network.load(tmp_path / "text.pt")
    with pytest.raises(FileNotFoundError):
        Network.load(tmp_path / "missing.pt")


def test_weights_say_which_errors_count():
    x = np.linspace(0.0, 1.0, 400)[:, None]
    y = np.concatenate([np.sin(5.0 * x), np.cos(5.0 * x)], axis=1)
    options = {"hidden": (12,), "schedule": Cosine(120, 32, 2e-2), "seed": 0, "progress": False}
    errors = [np.abs(train_network(x, y, weights=w, **options)(x) - y).mean(axis=0) for w in ([1.0, 0.0], [0.0, 1.0])]
    assert errors[0][0] < 0.05 < 0.3 < errors[0][1]
    assert errors[1][1] < 0.05 < 0.3 < errors[1][0]


def test_alternating_training_is_done_at_its_loss_and_trains_on_all_below_another():
    schedule = Alternating(400, batch=32, largest_batch=256, patience=2, whole_below=0.08, until=0.03)
    options = {"activation": "relu", "loss": "absolute", "scale_outputs": False, "held_out": 0.2, "progress": False}
    y = function(X)[:, :1] - 40.0
    trained = train_network(X, y, hidden=(32, 32), schedule=schedule, **options)
    assert trained.training.stopped == "loss"
    assert trained.training.held_out_until < trained.training.epochs < 400
    assert np.abs(trained(X) - y).mean() < 0.035


def test_a_limit_of_time_ends_training_after_an_epoch():
    trained = train_network(X, function(X), schedule=Cosine(100_000), time_limit=1e-3, progress=False)
    assert (trained.training.epochs, trained.training.stopped) == (1, "time")


def test_ctrl_c_ends_training_with_the_best_so_far(monkeypatch):
    orders, draw = [], torch.randperm  # drawn anew for every epoch

    def draw_and_count(count):
        orders.append(count)
        return draw(count)

    monkeypatch.setattr(torch, "randperm", draw_and_count)
    with ctrl_c_once(lambda: len(orders) > 20):
        trained = train_network(X, function(X), hidden=(16,), schedule=Cosine(10_000_000), progress=False)
    assert trained.training.stopped == "interrupted"
    assert 0 < trained.training.best <= trained.training.epochs
    assert np.isfinite(trained(X)).all()


def test_a_rate_that_is_too_high_is_named():
    with pytest.raises(RuntimeError, match=r"loss is (nan|inf) after epoch \d+: a lower rate"):
        train_network(X, function(X), activation="relu", schedule=Alternating(50, rates=(1e9, 1e9)), progress=False)


def test_a_constant_column_is_no_trouble():
    x = np.concatenate([X[:100], np.full((100, 1), 3.0)], axis=1)
    trained = train_network(x, np.full((100, 1), 2.0), hidden=(4,), schedule=Cosine(2), progress=False)
    assert np.isfinite(trained(x)).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": X[:, 0]}, r"x must have shape \(samples, inputs\)"),
        ({"y": X[:7]}, r"y must have shape \(1500, outputs\)"),
        ({"x": X[:9], "y": X[:9]}, r"ten samples or more"),
        ({"held_out": 0.0}, r"some of them held out"),
        ({"x": np.where(X > 0.99, np.nan, X)}, r"x must be finite"),
        ({"inputs": ("a",)}, r"inputs must be 2 names"),
        ({"activation": "step"}, r"activation must be"),
        ({"loss": "cubic"}, r"loss must be"),
        ({"hidden": ()}, r"hidden must have one width"),
        ({"hidden": (0,)}, r"hidden must lie in 1"),
        ({"weights": -1.0}, r"weights must be finite, and not negative"),
        ({"weights": np.ones(3)}, r"weights must broadcast"),
        ({"schedule": "cosine"}, r"schedule must be a Cosine or an Alternating"),
        ({"schedule": Cosine(rate=0.0)}, r"rate of schedule must be positive"),
        ({"time_limit": 0.0}, r"time_limit must be positive"),
        ({"threads": 0}, r"threads must lie in"),
        ({"seed": -1}, r"seed must lie in"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        train_network(**({"x": X, "y": function(X), "progress": False} | change))


@pytest.mark.parametrize(
    ("x", "message"),
    [
        (3.0, r"x must have shape \(\.\.\., 2\)"),
        ([1.0, 2.0, 3.0], r"x must have shape \(\.\.\., 2\)"),
        ([1.0, np.nan], r"x must be finite"),
        (np.array([1.0, np.inf], np.float32), r"x must be finite"),
        (["a", "b"], r"x must be numbers"),
        (torch.zeros(3), r"x must have shape \(\.\.\., 2\)"),
        (torch.zeros(2, dtype=torch.int64), r"floating point"),
    ],
)
def test_bad_questions_are_named(network, x, message):
    with pytest.raises(ValueError, match=message):
        network(x)


def test_without_torch_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ImportError, match=r"needs the package torch.*\[learn\]"):
        withe.learning.train_network(X, function(X))
