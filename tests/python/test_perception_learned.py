"""The learned mask: its network file, sizes and bad input, the default of trace, and its training."""

import warnings

import numpy as np
import pytest

import withe
from scoring import score
from withe.__main__ import main
from withe.perception import ground_filter, learned_filter, learned_mask, network_mask, trace, train_mask
from withe.perception.backgrounds import cast_shadow
from withe.perception.clutter import GROUNDS
from withe.perception.cluttered_pictures import make_picture
from withe.perception.onnx_file import Graph
from withe.perception.synthetic import make_case, render
from withe.perception.unseen_clutter import UNSEEN_GROUNDS

cv2 = pytest.importorskip("cv2")
SHAPE = (240, 320)


def overlap(found, mask):
    return (found & mask).sum() / max((found | mask).sum(), 1)


@pytest.fixture(scope="module")
def cluttered():
    return make_picture([5, 1], SHAPE, UNSEEN_GROUNDS, "bricks", cables=True)


# The network


def test_the_shipped_network_is_small_and_says_how_it_was_trained():
    content = learned_mask.SHIPPED.read_bytes()
    assert len(content) < 1_000_000
    for word in (b"seed", b"steps", b"seconds"):
        assert word in content


@pytest.mark.parametrize("kind", ["herringbone", "bricks", "leaves"])
def test_cables_are_found_on_kinds_of_ground_that_no_training_saw(kind):
    pictures = [make_picture([5, seed], SHAPE, UNSEEN_GROUNDS, kind, cables=True) for seed in range(3)]
    assert np.mean([overlap(learned_filter(each.image), each.mask) for each in pictures]) > 0.4


def test_no_training_imports_the_unseen_kinds():
    assert not set(GROUNDS) & set(UNSEEN_GROUNDS)
    for module in ("mask_training", "cluttered_pictures", "clutter"):
        names = vars(__import__(f"withe.perception.{module}", fromlist=["x"]))
        assert not any("UNSEEN" in name for name in names)


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (3, 5), (17, 33), (64, 64), (47, 95)])
def test_the_mask_is_as_large_as_any_picture(shape):
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (*shape, 3), dtype=np.uint8)
    mask = learned_filter(image)
    assert mask.shape == shape
    assert mask.dtype == bool
    trace(image, mask="learned")


def test_padding_does_not_change_what_is_far_from_it(cluttered):
    whole = learned_mask.cable_probability(cluttered.image)
    part = learned_mask.cable_probability(np.ascontiguousarray(cluttered.image[:-5, :-7]))
    np.testing.assert_allclose(part[:80, :160], whole[:80, :160], atol=0.02)


def test_large_pictures_are_reduced_and_the_mask_enlarged():
    picture = make_picture([5, 2], (480, 960), UNSEEN_GROUNDS, "leaves", cables=True)
    image = cv2.resize(picture.image, (2880, 1440), interpolation=cv2.INTER_LINEAR)
    mask = learned_filter(image)
    assert mask.shape == (1440, 2880)
    expected = cv2.resize(learned_filter(picture.image).astype(np.uint8), (2880, 1440), interpolation=cv2.INTER_LINEAR)
    assert overlap(mask, expected > 0) > 0.8


def test_grey_pictures_are_accepted(cluttered):
    grey = cluttered.image.mean(axis=2).astype(np.uint8)
    tracing = trace(grey, mask="learned")
    assert tracing.labels.shape == SHAPE


def test_a_missing_network_names_the_command(cluttered, tmp_path, monkeypatch):
    monkeypatch.setattr(learned_mask, "SHIPPED", tmp_path / "mask.onnx")
    with pytest.raises(FileNotFoundError, match="withe train-mask"):
        learned_mask.cable_probability(cluttered.image, tmp_path / "mask.onnx")
    assert not learned_mask.can_run()


def test_other_files_are_refused(cluttered, tmp_path):
    path = tmp_path / "other.onnx"
    path.write_bytes(b"no network")
    with pytest.raises(ValueError, match="must be a network of withe train-mask"):
        learned_mask.cable_probability(cluttered.image, path)
    path = tmp_path / "small.onnx"
    path.write_bytes(small_network((1, 3, "height", "width")))
    with pytest.raises(ValueError, match="got a result of shape"):
        learned_mask.cable_probability(cluttered.image, path)


@pytest.mark.parametrize("threshold", [-0.1, 1.5, np.nan])
def test_a_threshold_is_a_probability(cluttered, threshold):
    with pytest.raises(ValueError, match="threshold"):
        learned_filter(cluttered.image, threshold)


# ONNX files


def small_network(shape, reshaped=None):
    """Return a file whose network is the mean of the channels."""
    graph = Graph()
    kernel = np.full((1, 3, 1, 1), 1 / 3, np.float32)
    result = graph.add("Conv", ["image", "kernel"], {"kernel": kernel}, kernel_shape=[1, 1])
    if reshaped is not None:
        sizes = {"sizes": np.array(reshaped, np.int64)}
        result = graph.add("Reshape", [result, "sizes"], sizes)
    return graph.to_bytes(("image", shape), (result, (1, 1, *shape[2:])), {"note": "mean"})


def test_a_written_file_is_read_by_opencv(tmp_path):
    path = tmp_path / "mean.onnx"
    path.write_bytes(small_network((1, 3, "height", "width")))
    image = np.random.default_rng(0).integers(0, 255, (20, 30, 3), dtype=np.uint8)
    np.testing.assert_array_equal(network_mask(path)(image), image.mean(axis=2) / 255 > 0.5)


def test_a_network_of_a_fixed_size_unlike_the_picture_asks_for_its_size(tmp_path):
    path = tmp_path / "fixed.onnx"
    path.write_bytes(small_network((1, 3, 32, 32), (1, 1, 32, 32)))
    image = np.zeros((40, 50, 3), np.uint8)
    with pytest.raises(ValueError, match="fixed size"):
        network_mask(path)(image)
    assert network_mask(path, size=(32, 32))(image).shape == (40, 50)


# The default of trace


def test_a_plain_ground_is_left_to_the_ground_filter():
    picture = render(make_case("crossing 60", 5), np.random.default_rng(1))
    default, ground = trace(picture), trace(picture, mask="ground")
    assert default.mask_method == ground.mask_method == "ground"
    np.testing.assert_array_equal(default.labels, ground.labels)
    assert trace(picture, mask=ground_filter(picture)).mask_method == "given"
    assert withe.perception.Tracing.from_dict(default.to_dict()).mask_method == "ground"


def test_the_network_adds_white_cables_on_a_light_ground():
    scene = make_case("crossing 60", 3008)
    rng = np.random.default_rng(8)
    ground = cast_shadow(np.full((*scene.mask.shape, 3), [196.0, 200.0, 202.0]), scene.mask, rng)
    image = render(scene, rng, [(245, 245, 245), (20, 20, 22)], background=ground, grain=3, shading=0.45)
    assert len(trace(image, mask="ground")) < 2
    tracing = trace(image)
    assert tracing.mask_method == "both"
    assert score(scene, tracing, tolerance=8, tip_tolerance=8).right
    np.testing.assert_array_equal(trace(image, mask="both").labels, tracing.labels)


def test_a_cluttered_ground_is_left_to_the_network(cluttered):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", withe.PoorMaskWarning)
        tracing = trace(cluttered.image)
    assert tracing.mask_method == "learned"
    assert 0 < tracing.mask_quality.certainty <= 1


def test_without_the_network_the_ground_filter_is_the_default(cluttered, monkeypatch, tmp_path):
    monkeypatch.setattr(learned_mask, "SHIPPED", tmp_path / "mask.onnx")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", withe.PoorMaskWarning)
        assert trace(cluttered.image).mask_method == "ground"


def test_an_unknown_word_for_the_mask_is_refused(cluttered):
    with pytest.raises(ValueError, match="mask must be 'ground', 'both', 'learned'"):
        trace(cluttered.image, mask="clever")


# Pictures and training


def test_equal_seeds_give_equal_pictures():
    first, second, other = (make_picture([0, seed], (64, 96)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.image, second.image)
    np.testing.assert_array_equal(first.mask, second.mask)
    assert not np.array_equal(first.image, other.image)


@pytest.mark.parametrize("kind", [*GROUNDS, *UNSEEN_GROUNDS])
def test_every_kind_of_ground_can_be_drawn(kind):
    grounds = {**GROUNDS, **UNSEEN_GROUNDS}
    empty = make_picture([1], (64, 96), grounds, kind, cables=False)
    assert empty.image.shape == (64, 96, 3)
    assert not empty.mask.any()
    assert make_picture([1], (64, 96), grounds, kind, cables=True).mask.any()


@pytest.mark.slow
def test_training_lowers_the_loss_and_resumes_to_the_same_network(tmp_path, monkeypatch):
    pytest.importorskip("torch")
    from withe.perception import mask_training

    monkeypatch.setattr(mask_training, "_SIZE", 64)
    monkeypatch.setattr(mask_training, "_SAVE_EVERY", 10)
    options = {"seed": 3, "steps": 40, "workers": 0, "progress": False}
    record = train_mask(tmp_path / "whole.onnx", **options)
    assert len(record.losses) == 40
    assert np.mean(record.losses[-10:]) < np.mean(record.losses[:10]) - 0.1
    assert [path.name for path in tmp_path.iterdir()] == ["whole.onnx"]

    class StoppedError(Exception):
        pass

    def interrupted(*_):
        raise StoppedError

    with monkeypatch.context() as patch:
        patch.setattr(mask_training, "_finish", interrupted)
        with pytest.raises(StoppedError):
            train_mask(tmp_path / "parts.onnx", **options)
    assert (tmp_path / "parts.checkpoint.pt").exists()
    with pytest.raises(ValueError, match="must be a checkpoint of the seed 4"):
        train_mask(tmp_path / "parts.onnx", **{**options, "seed": 4})
    again = train_mask(tmp_path / "parts.onnx", **options)
    np.testing.assert_allclose(again.losses, record.losses, rtol=1e-4)
    probabilities = [
        learned_mask.cable_probability(make_picture(1, (64, 64)).image, tmp_path / f"{name}.onnx")
        for name in ("whole", "parts")
    ]
    np.testing.assert_allclose(*probabilities, atol=1e-3)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"path": "mask.pt"}, "path must end in .onnx"),
        ({"steps": 0}, "steps"),
        ({"seed": -1}, "seed"),
        ({"workers": -1}, "workers"),
        ({"threads": 0}, "threads"),
    ],
)
def test_bad_options_of_training_are_refused(tmp_path, options, problem):
    path = tmp_path / options.pop("path", "mask.onnx")
    with pytest.raises(ValueError, match=problem):
        train_mask(path, **options)


def test_a_file_that_is_no_checkpoint_is_refused(tmp_path):
    pytest.importorskip("torch")
    (tmp_path / "mask.checkpoint.pt").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="must be a checkpoint of train_mask"):
        train_mask(tmp_path / "mask.onnx", steps=1, workers=0, progress=False)


@pytest.mark.slow
def test_the_command_trains(tmp_path, capsys, monkeypatch):
    pytest.importorskip("torch")
    from withe.perception import mask_training

    monkeypatch.setattr(mask_training, "_SIZE", 64)
    assert main(["train-mask", "--out", str(tmp_path / "m.onnx"), "--steps", "2", "--workers", "0"]) == 0
    assert "2 steps" in capsys.readouterr().out
    assert (tmp_path / "m.onnx").is_file()
