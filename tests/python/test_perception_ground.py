"""Cables on bright ground under shadows, found by the default filter; dirty masks."""

import warnings

import numpy as np
import pytest

import withe
from scoring import score
from withe.perception import border_filter, ground_filter, trace, trace_mask
from withe.perception.backgrounds import cast_shadow, plain, wood
from withe.perception.disturbances import strip_across
from withe.perception.synthetic import make_case, render

COLOURS = [(200, 40, 40), (40, 90, 200)]
SHAPE = (480, 640)


def picture(seed, ground, colours=COLOURS, case="crossing 60", darkness=None):
    scene, rng = make_case(case, seed), np.random.default_rng(seed)
    shaded = cast_shadow(ground(rng, SHAPE), scene.mask, rng, darkness)
    return scene, render(scene, rng, colours, background=shaded, grain=3.0, shading=0.45)


def overlap(found, mask):
    return (found & mask).sum() / (found | mask).sum()


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("ground", [plain, wood])
def test_shadows_and_grain_are_no_cables(ground, seed):
    scene, image = picture(seed, ground)
    found = ground_filter(image)
    assert overlap(found, scene.mask) > (0.85 if ground is plain else 0.75)  # seams in shadow are dark
    assert overlap(border_filter(image), scene.mask) < overlap(found, scene.mask)
    assert len(trace(image)) == 2


@pytest.mark.parametrize("seed", [4, 5])
def test_white_and_black_cables_are_found_though_they_have_no_colour(seed):
    scene, image = picture(seed, plain, [(250, 250, 250), (12, 12, 14)], darkness=0.4)
    assert overlap(ground_filter(image), scene.mask) > 0.8


@pytest.mark.parametrize("seed", [119, 125])
def test_cables_go_on_beneath_others_whose_shadow_cuts_the_mask(seed):
    vivid = [*COLOURS, (40, 150, 60), (235, 200, 40), (120, 50, 140), (240, 240, 240)]
    scene, image = picture(seed, wood, vivid, case="six cables")
    assert score(scene, trace(image, mask="ground"), tolerance=8, tip_tolerance=8).right


def test_a_grey_cable_apart_from_others_is_no_shadow():
    scene, image = picture(6, plain, [(70, 70, 70)], case="self", darkness=0.2)
    assert overlap(ground_filter(image), scene.mask) > 0.75


def test_a_dark_ground_is_left_to_the_border_filter():
    scene = make_case("crossing 60", 7)
    image = render(scene, np.random.default_rng(7))
    np.testing.assert_array_equal(ground_filter(image), border_filter(image))


@pytest.mark.parametrize("factor", [0.6, 1.3])
def test_the_light_does_not_matter(factor):
    _, image = picture(8, plain)
    brighter = np.clip(factor * image.astype(float), 0, 255).round().astype(np.uint8)
    assert overlap(ground_filter(brighter), ground_filter(image)) > 0.9


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (5, 5), (64, 3)])
@pytest.mark.parametrize("level", [0, 90, 255])
def test_small_pictures_of_one_colour_have_no_cable(shape, level):
    assert not ground_filter(np.full((*shape, 3), level, np.uint8)).any()


# Pictures without an answer


def seamed_wood(seed):
    rng = np.random.default_rng(seed)
    return np.clip(wood(rng, SHAPE) + rng.normal(0, 2, (*SHAPE, 3)), 0, 255).round().astype(np.uint8)


@pytest.mark.parametrize("seed", range(4))
def test_wood_without_cables_has_none_or_warns(seed):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        tracing = trace(seamed_wood(seed))
    assert len(tracing) == 0 or any(issubclass(w.category, withe.PoorMaskWarning) for w in caught)


def test_noise_as_strong_as_the_cables_warns():
    _, image = picture(1, plain)
    noisy = np.clip(image + np.random.default_rng(0).normal(0, 60, image.shape), 0, 255).round().astype(np.uint8)
    with pytest.warns(withe.PoorMaskWarning, match="times as much as the ground itself"):
        tracing = trace(noisy)
    assert tracing.mask_quality.contrast < 1.1


def test_a_blurred_picture_warns():
    from scipy.ndimage import gaussian_filter

    _, image = picture(1, plain)
    with pytest.warns(withe.PoorMaskWarning, match="blurred"):
        tracing = trace(gaussian_filter(image, (5, 5, 0)))
    assert tracing.mask_quality.sharpness < 0.35


@pytest.mark.filterwarnings("error")
def test_a_sharp_picture_does_not_warn():
    _, image = picture(1, plain)
    quality = trace(image).mask_quality
    assert quality.is_good
    assert quality.contrast > 2
    assert quality.sharpness > 0.45


def test_a_given_mask_is_not_held_against_the_picture():
    scene, image = picture(1, plain)
    noisy = np.clip(image + np.random.default_rng(0).normal(0, 60, image.shape), 0, 255).round().astype(np.uint8)
    assert trace(noisy, mask=scene.mask).mask_quality.is_good


# Dirty masks


def crossing(seed):
    return make_case(f"crossing {(90, 60, 45)[seed % 3]}", 600 + seed)


@pytest.mark.parametrize("density", [0.005, 0.02, 0.05])
def test_salt_and_pepper_change_nothing(density):
    for seed in range(6):
        scene, rng = crossing(seed), np.random.default_rng(seed)
        found = score(scene, trace_mask(scene.mask ^ (rng.random(SHAPE) < density)))
        assert found.right, (seed, found)


def test_noise_alone_holds_no_cable():
    for seed in range(3):
        assert len(trace_mask(np.random.default_rng(seed).random(SHAPE) < 0.05)) == 0


@pytest.mark.parametrize("length", [12, 20, 28])
def test_a_gap_between_ends_that_face_each_other_is_bridged(length):
    for seed in range(6):
        scene = crossing(seed)
        line, place = scene.centrelines[0], scene.crossings[0].point
        away = np.hypot(*(line - place).T) > 45 + length
        away[:40] = away[-40:] = False
        middle = int(np.flatnonzero(away)[away.sum() // 2])
        gap = strip_across(line, middle, length, 2 * scene.widths[0], SHAPE)
        found = score(scene, trace_mask(scene.mask & ~gap))
        assert found.right, (seed, found)


def test_ends_that_do_not_face_each_other_stay_apart():
    mask = np.zeros((120, 300), bool)
    mask[40:50, 20:140] = True
    mask[60:70, 165:280] = True  # 25 px further on, and two widths aside
    assert len(trace_mask(mask)) == 2
    mask[60:70] = False
    mask[42:48, 165:280] = True  # 0.6 times as wide
    assert len(trace_mask(mask)) == 2


# Masks that are none


def planks_of(lines, shape=SHAPE):
    """Return a mask of rows and columns of lines, as the grout of tiles."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return ((y % lines) < 7) | ((x % lines) < 7)


@pytest.mark.parametrize(
    ("mask", "reason"),
    [
        (planks_of(18), "covers 63 % of the picture"),
        (np.random.default_rng(0).random(SHAPE) < 0.05, "100 % of it belongs to no cable"),
        (np.kron(np.random.default_rng(1).random((48, 64)) < 0.04, np.ones((10, 10))) > 0, "belongs to no cable"),
    ],
    ids=["grid", "noise", "blocks"],
)
def test_a_mask_that_is_none_warns(mask, reason):
    with pytest.warns(withe.PoorMaskWarning, match=reason):
        tracing = trace_mask(mask)
    assert not tracing.mask_quality.is_good


def test_a_page_of_print_warns():
    cv2 = pytest.importorskip("cv2")
    image, rng = np.full((*SHAPE, 3), 235, np.uint8), np.random.default_rng(3)
    for row in range(15, SHAPE[0], 22):
        words = "".join(chr(97 + rng.integers(26)) for _ in range(60))
        cv2.putText(image, words, (5, row), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (40, 40, 40), 1)
    with pytest.warns(withe.PoorMaskWarning, match="the mask does not look like cables"):
        trace(image)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("case", ["six cables", "specks", "loop", "gap", "ragged 30", "three at a point"])
def test_masks_of_cables_do_not_warn(case):
    for seed in range(3):
        assert trace_mask(make_case(case, seed).mask).mask_quality.is_good


@pytest.mark.filterwarnings("error")
def test_an_empty_mask_does_not_warn():
    assert trace_mask(np.zeros((50, 60), bool)).mask_quality.is_good
