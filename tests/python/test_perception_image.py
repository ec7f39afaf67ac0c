"""Pictures: filters, order of crossings, layouts and bad input, drawing, files and the command line."""

import json
import struct

import numpy as np
import pytest

from scoring import score
from withe import _core
from withe.__main__ import main
from withe.perception import Tracing, border_filter, color_filter, draw, network_mask, trace, trace_mask
from withe.perception.disturbances import add_occluder, strip_across
from withe.perception.synthetic import make_case, render


@pytest.fixture(scope="module")
def scene():
    return make_case("six cables", 11)


@pytest.fixture(scope="module")
def picture(scene):
    return render(scene, np.random.default_rng(1))


def right_orders(scene, tracing):
    """Number of the scene's crossings that are found with the right strand above, and number of all crossings."""
    right = 0
    for true in scene.crossings:
        found = min(tracing.crossings, key=lambda c: np.hypot(*(c.point - true.point)))
        line = scene.centrelines[true.over[0]]
        steps = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        at = int(np.searchsorted(steps, true.over[1]))
        way = line[min(at + 5, len(line) - 1)] - line[max(at - 5, 0)]
        cosines = []
        for cable, row in (found.over, found.under):
            ours = tracing.centrelines[cable]
            our_way = ours[min(row + 3, len(ours) - 1)] - ours[max(row - 3, 0)]
            cosines.append(abs(way @ our_way) / np.hypot(*way) / np.hypot(*our_way))
        right += cosines[0] > cosines[1]
    return right, len(scene.crossings)


def test_cables_are_found_in_a_shaded_picture_without_any_filter(scene, picture):
    tracing = trace(picture)
    assert score(scene, tracing).right, score(scene, tracing)
    assert set(tracing.timings) > {"mask", "thin", "fit"}


@pytest.mark.slow
def test_the_upper_strand_is_told_from_the_lower_one_even_where_a_cable_crosses_itself():
    right = total = 0
    for seed in range(20):
        case = make_case("self", 300 + seed)
        tracing = trace(render(case, np.random.default_rng(seed)), mask=case.mask)
        good, count = right_orders(case, tracing)
        right, total = right + good, total + count
        assert all(0 < crossing.confidence <= 1 for crossing in tracing.crossings)
    assert total == 20
    assert right >= 19


def test_a_mask_alone_says_nothing_about_the_order(scene):
    assert {crossing.confidence for crossing in trace_mask(scene.mask).crossings} == {0.0}


def test_the_upper_cable_has_its_whole_width_in_the_labels():
    case = make_case("crossing 60", 5)
    image = render(case, np.random.default_rng(0), colours=[(220, 60, 60), (60, 90, 230)])
    tracing = trace(image, mask=case.mask)
    crossing = tracing.crossings[0]
    x, y = np.round(crossing.point).astype(int)
    assert (tracing.labels[y - 2 : y + 3, x - 2 : x + 3] == crossing.over[0] + 1).all()
    assert np.array_equal(tracing.labels > 0, case.mask)


def test_grey_alpha_and_any_layout_give_the_same_as_rgb(scene, picture):
    expected = trace(picture, mask=scene.mask)
    wide = np.zeros((*picture.shape[:2], 6), np.uint8)
    wide[..., ::2] = picture
    alpha = np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)])
    for other in (wide[..., ::2], alpha, np.asfortranarray(picture)):
        found = trace(other, mask=lambda image: 255 * scene.mask.astype(np.uint8))
        assert np.array_equal(found.labels, expected.labels)
    grey = picture.mean(axis=2).astype(np.uint8)
    assert len(trace(grey, mask=scene.mask)) == len(expected)


@pytest.mark.parametrize(
    ("image", "mask", "problem"),
    [
        (np.zeros((4, 5, 2), np.uint8), None, "image must have shape"),
        (np.zeros((0, 5, 3), np.uint8), None, "image must have shape"),
        (np.zeros((4, 5, 3)), None, "image must be of type uint8"),
        (np.full((4, 5, 3), np.nan), None, "image must be finite"),
        ([[1, 2], [3]], None, "image must be an array"),
        ("zero\0byte.png", None, "image must be a file"),
        (np.zeros((4, 5, 3), np.uint8), np.zeros((5, 4), bool), "mask must be as large as the image"),
        (np.zeros((4, 5, 3), np.uint8), np.full((4, 5), np.inf), "mask must be finite"),
        (np.zeros((4, 5, 3), np.uint8), lambda image: image, "mask must have shape"),
    ],
)
def test_bad_pictures_are_refused_by_name(image, mask, problem):
    with pytest.raises(ValueError, match=problem):
        trace(image, mask=mask)


@pytest.mark.parametrize("seed", range(6))
def test_a_cable_goes_on_under_what_hides_a_piece_of_it(seed):
    case = make_case("crossing 60", 40 + seed)
    line = case.centrelines[seed % 2]
    from_crossing = np.hypot(*(line - case.crossings[0].point).T)
    free = np.flatnonzero((from_crossing > 50) & (np.minimum(np.arange(len(line)), np.arange(len(line))[::-1]) > 40))
    strip = strip_across(line, int(free[len(free) // 2]), 4 + 1.5 * seed, 20, case.mask.shape)
    rng = np.random.default_rng(seed)
    picture = add_occluder(render(case, rng, colours=[(220, 60, 60), (60, 90, 230)]), strip, rng)
    tracing = trace(picture, mask=lambda image: np.ptp(image.astype(int), axis=2) > 40)
    assert score(case, tracing).right, score(case, tracing)
    assert not tracing.labels[strip].any()


def test_an_unknown_method_is_refused():
    with pytest.raises(ValueError, match="method must be"):
        trace_mask(np.zeros((5, 5)), method="other")


def test_the_published_method_finds_plain_crossings():
    case = make_case("crossing 60", 2)
    tracing = trace_mask(case.mask, method="mbest")
    assert len(tracing) == 2
    assert len(tracing.crossings) == 1


def test_a_picture_of_noise_holds_no_cable():
    noise = np.random.default_rng(0).normal(90, 4, (120, 160, 3)).clip(0, 255).astype(np.uint8)
    assert len(trace(noise)) == 0


# Filters


def test_hue_saturation_and_value_are_those_of_opencv():
    cv2 = pytest.importorskip("cv2")
    levels = np.array([0, 1, 2, 3, 17, 40, 75, 76, 100, 127, 128, 129, 200, 254, 255], np.uint8)
    colours = np.stack(np.meshgrid(levels, levels, levels), axis=-1).reshape(1, -1, 3)
    hsv = cv2.cvtColor(colours, cv2.COLOR_RGB2HSV)[0].astype(int)
    for low, high in (((0, 20, 75), (20, 255, 255)), ((50, 20, 20), (120, 255, 255)), ((160, 0, 0), (180, 90, 200))):
        expected = ((hsv >= low) & (hsv <= high)).all(axis=1)
        found = _core.hsv_mask(colours, [(low, high)])[0] > 0
        assert (found == expected).mean() > 0.998  # OpenCV's own rounding differs between its builds


def test_a_range_of_hues_may_go_over_red():
    image = np.array([[[200, 30, 40], [200, 40, 30], [30, 200, 30]]], np.uint8)
    assert color_filter([((170, 50, 50), (10, 255, 255))], clean=False)(image).tolist() == [[True, True, False]]


@pytest.mark.parametrize(
    ("ranges", "problem"),
    [
        ([], "at least one pair"),
        ([((0, 0), (1, 1))], r"ranges\[0\] must be a pair"),
        ([((0, 0, 0), (181, 255, 255))], r"ranges\[0\] must hold integers"),
        ([((0, 9, 0), (10, 5, 255))], r"ranges\[0\] must go from"),
    ],
)
def test_bad_colour_ranges_are_refused(ranges, problem):
    with pytest.raises(ValueError, match=problem):
        color_filter(ranges)


@pytest.mark.parametrize("noise", [0, 4, 8])
@pytest.mark.parametrize(("width", "height"), [(640, 480), (1920, 1080)])
def test_a_thin_cable_is_found_in_a_noisy_picture(width, height, noise):
    """One pixel in a thousand is cable, and Otsu's two likeliest classes are both noise of the background."""
    random = np.random.default_rng(noise)
    picture = np.full((height, width, 3), 235.0)
    columns = np.arange(80, 380)
    rows = (200 + 15 * np.sin(columns / 40.0)).astype(int)
    for row in range(4):
        picture[rows + row, columns] = 60.0
    picture = np.clip(picture + noise * random.normal(size=picture.shape), 0, 255).astype(np.uint8)
    assert border_filter(picture).sum() == 4 * len(columns)
    assert len(trace(picture)) == 1


def test_the_border_filter_keeps_dark_cables_beside_bright_ones():
    image = np.full((60, 80, 3), 8, np.uint8)
    image[10:18] = (250, 240, 200)
    image[40:48] = (30, 70, 50)
    mask = border_filter(image[:, 5:])
    image[:, :5] = image[:, -5:] = 8
    mask = border_filter(image)
    assert mask[10:18, 5:-5].all()
    assert mask[40:48, 5:-5].all()
    assert mask.sum() == 16 * 70


def varint(number):
    result = b""
    while number > 127:
        result += bytes([number & 127 | 128])
        number >>= 7
    return result + bytes([number])


def field(number, value):
    """One field of a protocol buffer: a number, or bytes and messages."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


def two_layer_network():
    """ONNX, byte by byte: the mean of the channels by a 1 x 1 convolution, then a sigmoid around 0.5."""
    weights = struct.pack("<3f", 10, 10, 10)
    bias = struct.pack("<f", -15)

    def tensor(name, shape, data):
        return b"".join(field(1, n) for n in shape) + field(2, 1) + field(8, name) + field(9, data)

    def value(name, shape):
        dims = b"".join(field(1, field(1, n)) for n in shape)
        return field(1, name) + field(2, field(1, field(1, 1) + field(2, dims)))

    kernel = field(1, "kernel_shape") + field(8, 1) + field(8, 1) + field(20, 7)
    convolution = field(1, "x") + field(1, "w") + field(1, "b") + field(2, "h") + field(3, "c") + field(4, "Conv")
    sigmoid = field(1, "h") + field(2, "y") + field(3, "s") + field(4, "Sigmoid")
    graph = (
        field(1, convolution + field(5, kernel))
        + field(1, sigmoid)
        + field(2, "g")
        + field(5, tensor("w", (1, 3, 1, 1), weights))
        + field(5, tensor("b", (1,), bias))
        + field(11, value("x", (1, 3, 40, 60)))
        + field(12, value("y", (1, 1, 40, 60)))
    )
    return field(1, 8) + field(7, graph) + field(8, field(1, "") + field(2, 13))


def test_a_network_makes_the_mask(tmp_path):
    pytest.importorskip("cv2")
    path = tmp_path / "two_layers.onnx"
    path.write_bytes(two_layer_network())
    image = np.zeros((40, 60, 3), np.uint8)
    image[16:24, 4:56] = 220
    mask = network_mask(path)(image)
    assert np.array_equal(mask, image[..., 0] > 0)
    assert len(trace(image, mask=network_mask(str(path)))) == 1


def test_a_torch_network_makes_the_mask_as_module_and_as_file(tmp_path):
    torch = pytest.importorskip("torch")
    network = torch.nn.Sequential(torch.nn.Conv2d(3, 1, 1), torch.nn.Sigmoid())
    with torch.no_grad():
        network[0].weight.fill_(10)
        network[0].bias.fill_(-15)
    path = tmp_path / "two_layers.pt"
    torch.jit.trace(network, torch.zeros(1, 3, 40, 60)).save(str(path))
    image = np.zeros((40, 60, 3), np.uint8)
    image[16:24, 4:56] = 220
    for model in (network, path, str(path)):
        assert np.array_equal(network_mask(model)(image), image[..., 0] > 0)
    assert len(trace(image, mask=network_mask(network))) == 1
    pytest.importorskip("cv2")
    assert np.array_equal(network_mask(network, size=(80, 120))(image), image[..., 0] > 0)
    with torch.no_grad():
        network[0].bias.fill_(np.nan)
    with pytest.raises(ValueError, match="model must return finite values"):
        network_mask(network)(image)
    broken = tmp_path / "broken.pt"
    broken.write_bytes(b"no network")
    with pytest.raises(ValueError, match="model must be an ONNX or TorchScript file"):
        network_mask(broken)


def test_networks_that_are_none_are_refused(tmp_path):
    with pytest.raises(ValueError, match="model must be a file"):
        network_mask(tmp_path / "missing.onnx")
    with pytest.raises(ValueError, match="model must be a file or a torch module"):
        network_mask(3)


# Drawing, files, command line


def test_drawing_shows_every_cable(scene, picture):
    pytest.importorskip("cv2")
    tracing = trace(picture, mask=scene.mask)
    drawn = draw(picture, tracing)
    assert drawn.shape == picture.shape
    assert drawn.dtype == np.uint8
    plain = draw(picture, Tracing())
    changed = (drawn != plain).any(axis=2)
    for line in tracing.centrelines:
        x, y = np.round(line[len(line) // 2]).astype(int)
        assert changed[y, x]


def test_a_tracing_survives_json(scene, picture):
    tracing = trace(picture, mask=scene.mask)
    again = Tracing.from_dict(json.loads(json.dumps(tracing.to_dict())))
    assert np.array_equal(again.labels, tracing.labels)
    assert again.closed == tracing.closed
    assert [c.over for c in again.crossings] == [c.over for c in tracing.crossings]
    for a, b in zip(again.centrelines, tracing.centrelines, strict=True):
        assert np.array_equal(a, b)
    with pytest.raises(ValueError, match="version"):
        Tracing.from_dict({**tracing.to_dict(), "version": 99})


def test_the_command_writes_overlay_and_table(tmp_path, scene, picture, capsys):
    cv2 = pytest.importorskip("cv2")
    image, mask = tmp_path / "rope.png", tmp_path / "mask.png"
    cv2.imwrite(str(image), picture[..., ::-1])
    cv2.imwrite(str(mask), 255 * scene.mask.astype(np.uint8))
    assert main(["perceive", str(image), "--mask", str(mask), "--out", str(tmp_path / "out")]) == 0
    assert "6 cables" in capsys.readouterr().out
    table = json.loads((tmp_path / "out" / "rope_cables.json").read_text())
    assert table["version"] == 1
    assert len(Tracing.from_dict(table)) == 6
    assert cv2.imread(str(tmp_path / "out" / "rope_cables.png")).shape == picture.shape


def test_the_command_says_what_was_wrong_in_one_line(tmp_path, capsys):
    pytest.importorskip("cv2")
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no picture")
    for path in (broken, tmp_path / "missing.png"):
        assert main(["perceive", str(path)]) == 2
        error = capsys.readouterr().err
        assert error.startswith("withe: image must be a")
        assert error.count("\n") == 1
