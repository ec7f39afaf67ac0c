"""Cables in masks: counts, order, crossings and joints of scenes whose truth is known, and bad input."""

import numpy as np
import pytest

from scoring import score
from withe import _core
from withe.perception import trace_mask
from withe.perception.synthetic import CASES, make_case


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", [1, 2])
def test_synthetic_cables_are_found_in_order_within_two_pixels(case, seed):
    scene = make_case(case, seed)
    tracing = trace_mask(scene.mask)
    assert score(scene, tracing).right, score(scene, tracing)
    assert len(tracing.crossings) == len(scene.crossings)
    for crossing in scene.crossings:
        nearest = min(np.hypot(*(found.point - crossing.point)) for found in tracing.crossings)
        assert nearest < 6


@pytest.mark.parametrize(
    ("case", "seed", "scale"),
    [
        ("ragged 30", 1172, 1),  # a bay reaches into the crossing, and the skeleton runs around it
        ("ragged 30", 1250, 1),  # two cables cross, but the waist is as narrow as for one cable
        ("ragged 60", 6130, 1),  # the border recedes by 0.2 widths, but no strand ends there
        ("ragged 30", 3012, 1),  # the crossing has a hole, which has two sides
        ("crossing 15", 1126, 0.5),  # the left and the right flank differ by less than a pixel
        ("specks", 1049, 0.5),  # two specks side by side are twice as long as the cables are wide
    ],
)
def test_noise_as_large_as_the_cables_does_not_mislead(case, seed, scale):
    scene = make_case(case, seed, scale)
    assert score(scene, trace_mask(scene.mask)).right


@pytest.mark.parametrize(
    "seed",
    [
        709,  # the ring of the curl begins and ends in one zone
        713,
        614,  # the end behind the crossing is shorter than a fray
        712,
        723,
    ],
)
def test_curls_are_followed_to_the_end_behind_their_crossing(seed):
    scene = make_case("curls", seed)
    tracing = trace_mask(scene.mask)
    assert score(scene, tracing, tolerance=8, tip_tolerance=8).right


def test_curls_whose_end_is_not_found_are_ambiguous():
    scenes = [make_case("curls", seed) for seed in (606, 621, 631)]
    for scene in scenes:
        tracing = trace_mask(scene.mask)
        assert score(scene, tracing, tolerance=8, tip_tolerance=8).right or tracing.ambiguous


@pytest.mark.parametrize("scale", [0.5, 2])
def test_a_cable_that_crosses_itself_is_found_at_any_scale(scale):
    scene = make_case("self", 1, scale)
    tracing = trace_mask(scene.mask)
    assert score(scene, tracing, tip_tolerance=5 * max(scale, 1)).right
    assert len(tracing.crossings) == 1


def test_the_stem_of_a_t_is_a_joint():
    tracing = trace_mask(make_case("T", 1).mask)
    (joint,) = tracing.joints
    (end, row), (through, other_row) = joint.end, joint.through
    assert {end, through} == {0, 1}
    assert row in (0, len(tracing.centrelines[end]) - 1)
    distance = np.hypot(*(tracing.centrelines[through][other_row] - joint.point))
    assert distance == pytest.approx(tracing.widths[through][other_row] / 2, abs=1.5)


def test_a_ring_is_closed_and_repeats_no_row():
    tracing = trace_mask(make_case("loop", 1).mask)
    assert tracing.closed == [True]
    line = tracing.centrelines[0]
    assert 0.1 < np.hypot(*(line[0] - line[-1])) <= 2


@pytest.mark.parametrize("turn", np.arange(12) * 0.05)
def test_a_ring_lists_each_crossing_once_wherever_its_rows_begin(turn):
    """Three, of a curve that goes twice round a centre; one of them was listed again where it held the first row."""
    t = np.linspace(0.0, 2.0 * np.pi, 1500, endpoint=False)
    x = 160.0 + 45.0 * (2.0 + np.cos(3.0 * t)) * np.cos(2.0 * t + turn)
    y = 160.0 + 45.0 * (2.0 + np.cos(3.0 * t)) * np.sin(2.0 * t + turn)
    rows, columns = np.mgrid[:320, :320]
    mask = np.zeros((320, 320), bool)
    for u, v in zip(x, y, strict=True):
        mask |= (columns - u) ** 2 + (rows - v) ** 2 < 3.5**2
    tracing = trace_mask(mask)
    assert tracing.closed == [True]
    assert len(tracing.crossings) == 3


@pytest.mark.parametrize(
    "mask",
    [
        np.zeros((40, 50), bool),
        np.ones((40, 50), bool),
        np.ones((1, 80), bool),
        np.pad(np.ones((1, 1), bool), 10),
        np.pad(np.ones((1, 60), bool), 10),
        np.zeros((0, 5), bool),
    ],
)
def test_what_holds_no_cable_gives_an_empty_tracing(mask):
    tracing = trace_mask(mask)
    assert len(tracing) == 0
    assert tracing.labels.shape == mask.shape
    assert not tracing.labels.any()


@pytest.mark.parametrize(
    ("mask", "problem"),
    [
        (np.zeros((4, 5, 3)), "mask must have shape"),
        (np.zeros(5), "mask must have shape"),
        (np.full((4, 5), np.nan), "mask must be finite"),
        (np.full((4, 5), "a"), "mask must hold"),
        (None, "mask must"),
        ([[1, 2], [3]], "mask must be an array"),
    ],
)
def test_bad_masks_are_refused_by_name(mask, problem):
    with pytest.raises(ValueError, match=problem):
        trace_mask(mask)


def test_masks_of_any_layout_and_type_give_the_same():
    mask = make_case("crossing 60", 3).mask
    expected = trace_mask(mask)
    wide = np.zeros((mask.shape[0], 2 * mask.shape[1]), np.uint8)
    wide[:, ::2] = 255 * mask
    for other in (
        255 * mask.astype(np.uint8),
        mask.astype(float),
        np.asfortranarray(mask),
        wide[:, ::2],
        mask.tolist(),
    ):
        found = trace_mask(other)
        assert np.array_equal(found.labels, expected.labels)
        for a, b in zip(found.centrelines, expected.centrelines, strict=True):
            assert np.array_equal(a, b)


def random_mask(rng):
    """Noise, stripes, blobs, rectangles: whatever a segmentation may produce when it fails."""
    height, width = rng.integers(1, 120, 2)
    kind = rng.integers(3)
    if kind == 0:
        return rng.random((height, width)) < rng.random()
    if kind == 1:
        noise = rng.standard_normal((height + 20, width + 20))
        return noise[:-20, :-20] + noise[5:-15, 3:-17] + noise[1:-19, 1:-19] > rng.uniform(-1, 2)
    mask = np.zeros((height, width), bool)
    for _ in range(rng.integers(1, 9)):
        x, y = rng.integers(0, width), rng.integers(0, height)
        mask[y : y + rng.integers(1, 30), x : x + rng.integers(1, 60)] = True
    return mask


def test_two_thousand_random_masks_give_rows_in_order_and_labels_inside():
    rng = np.random.default_rng(20)
    for _ in range(2000):
        mask = random_mask(rng)
        tracing = trace_mask(mask)
        assert not tracing.labels[~mask].any()
        assert tracing.labels.max(initial=0) <= len(tracing)
        for line, widths, closed in zip(tracing.centrelines, tracing.widths, tracing.closed, strict=True):
            assert np.isfinite(line).all()
            assert line.shape == (len(widths), 2)
            steps = np.diff(np.vstack([line, line[:1]]) if closed else line, axis=0)
            assert np.hypot(*steps.T).max(initial=0) <= 2 + 1e-9


def test_thinning_is_that_of_scikit_image():
    skeletonize = pytest.importorskip("skimage.morphology").skeletonize
    rng = np.random.default_rng(4)
    for _ in range(200):
        mask = random_mask(rng)
        assert np.array_equal(_core.thin(mask.astype(np.uint8)) > 0, skeletonize(mask))


def test_sixty_cables_in_a_large_picture_are_all_found():
    mask = np.zeros((1500, 2000), bool)
    for k in range(60):
        row = 20 + 24 * k
        mask[row : row + 9, 10 + 5 * k : 1600 + 5 * k] = True
    tracing = trace_mask(mask)
    assert len(tracing) == 60
    assert np.array_equal(np.unique(tracing.labels), np.arange(61))
    assert np.array_equal(tracing.labels > 0, mask)


def test_cables_that_leave_the_picture_end_at_its_border():
    mask = np.zeros((100, 300), bool)
    mask[46:54] = True
    (line,) = trace_mask(mask).centrelines
    assert sorted([line[0, 0], line[-1, 0]]) == pytest.approx([0, 299], abs=3)
    assert line[:, 1] == pytest.approx(49.5, abs=0.6)
