"""Cables that lie side by side, for a while or along their whole length, so that the mask shows one wide line."""

import numpy as np
import pytest

from scoring import score
from withe.perception import trace, trace_mask
from withe.perception.synthetic import CASES, SyntheticScene, make_case, render, render_mask


def strand(radius, length, aside, crosses):
    """A line along an arc, `aside` px from it over the length in the middle, and away from it at both ends.

    Where it crosses, it goes to the other side of the arc within 40 px around the middle.
    """
    s = np.linspace(-length / 2 - 120, length / 2 + 120, 400)
    angle = s / radius
    arc = np.stack([radius * np.sin(angle), radius * (1 - np.cos(angle))], axis=1)
    normal = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    beyond = np.maximum(np.abs(s) - length / 2, 0)
    offset = aside + np.sign(aside) * beyond**2 / 200
    if crosses:
        offset *= np.cos(np.clip((s + 20) / 40, 0, 1) * np.pi)
    return arc + offset[:, None] * normal + [320, 240 if radius > 1e5 else 60]


def side_by_side(radius, length, widths, crosses):
    """A scene of two such strands that overlap a little."""
    aside = widths[0] / 2 - 0.3, -widths[1] / 2 + 0.3
    lines = [strand(radius, length, distance, crosses) for distance in aside]
    mask = render_mask(lines, widths, [False, False], (480, 640))
    return SyntheticScene(mask, lines, list(widths), [False, False], [], [True, True])


@pytest.mark.parametrize("crosses", [False, True])
@pytest.mark.parametrize("widths", [(10.0, 10.0), (8.0, 12.0)])
@pytest.mark.parametrize(("radius", "length"), [(1e6, 80), (300, 200), (150, 300)])
def test_strands_side_by_side_are_split_and_called_ambiguous(radius, length, widths, crosses):
    scene = side_by_side(radius, length, widths, crosses)
    tracing = trace_mask(scene.mask)
    assert score(scene, tracing).right, score(scene, tracing)
    assert len(tracing.crossings) == crosses
    assert "parallel strands" in [doubt.reason for doubt in tracing.ambiguous]


def test_colours_tell_strands_that_change_sides_unseen():
    scene = side_by_side(1e6, 200, (10.0, 10.0), False)
    picture = render(scene, np.random.default_rng(0), colours=[(220, 60, 60), (60, 90, 230)])
    kept = trace(picture, mask=scene.mask)
    assert score(scene, kept).right
    assert len(kept.crossings) == 0
    picture[:, 320:] = picture[::-1, 320:]  # the mask is symmetric, only the colours change
    changed = trace(picture, mask=scene.mask | scene.mask[::-1])
    assert len(changed) == 2
    assert len(changed.crossings) == 1
    for line in changed.centrelines:
        assert (line[0, 1] < 240) != (line[-1, 1] < 240)


def test_widths_tell_strands_that_change_sides_unseen():
    scene = side_by_side(1e6, 200, (8.0, 14.0), False)
    flipped = np.roll(scene.mask[::-1], 1, axis=0)  # about the arc, row 240
    mask = scene.mask.copy()
    mask[:, 320:] = flipped[:, 320:]
    tracing = trace_mask(mask)
    assert len(tracing) == 2
    assert len(tracing.crossings) == 1
    for line in tracing.centrelines:
        assert (line[0, 1] < 240) != (line[-1, 1] < 240)


@pytest.mark.parametrize("radius", [150, 300])
@pytest.mark.parametrize("overlap", [0, 6])
def test_two_bends_that_lie_on_each_other_may_touch_or_cross(radius, overlap):
    x = np.linspace(-150, 150, 300)
    bends = [np.stack([320 + x, 240 + side * (x**2 / 2 / radius - overlap / 2)], axis=1) for side in (1, -1)]
    tracing = trace_mask(render_mask(bends, [10, 10], [False, False], (480, 640)))
    assert len(tracing) == 2
    assert [doubt.reason for doubt in tracing.ambiguous] == ["similar energies"]
    assert np.hypot(*(tracing.ambiguous[0].point - [320, 240])) < 10


@pytest.mark.parametrize("case", [case for case in CASES if case != "curls"])  # they cross themselves at small angles
def test_plain_scenes_are_not_ambiguous(case):
    assert trace_mask(make_case(case, 3).mask).ambiguous == []


# Along their whole length, or to the end of one of them: no fork at both ends


def beside_arc(radius, first, last, aside):
    """A line beside an arc, from one arc length to another [px]."""
    angle = np.linspace(first, last, 300) / radius
    arc = np.stack([radius * np.sin(angle), radius * (1 - np.cos(angle))], axis=1)
    return arc + aside * np.stack([-np.sin(angle), np.cos(angle)], axis=1) + [320, 240]


def ring(radius):
    t = np.linspace(0, 2 * np.pi, 500, endpoint=False)
    return np.stack([320 + radius * np.cos(t), 200 + radius * np.sin(t)], axis=1)


def scene_of(lines, widths, closed=False):
    rings = [closed and len(line) == 500 for line in lines]
    mask = render_mask(lines, widths, rings, (480, 640))
    return SyntheticScene(mask, lines, list(widths), rings, [], [True] * len(lines))


def bundle(radius, count):
    """Cables of one length side by side."""
    return [beside_arc(radius, -200, 200, 10 * k - 5 * (count - 1)) for k in range(count)]


ALONE = beside_arc(1e6, -200, 200, 180)
RED, BLUE, GREEN = (220, 60, 60), (60, 90, 230), (60, 200, 80)


def leaving(radius):
    """Beside a cable at first, then away from it."""
    line = beside_arc(radius, -60, 240, 5)
    away = np.linspace(-60, 240, 300)
    return line + (np.maximum(away - 60, 0) ** 2 / 250)[:, None] * [0, 1]


@pytest.mark.parametrize("radius", [1e6, 300])
@pytest.mark.parametrize(
    ("strands", "widths"),
    [
        (lambda radius: [*bundle(radius, 2), ALONE], [10, 10, 10]),
        (lambda radius: [*bundle(radius, 3), ALONE], [10, 10, 10, 10]),
        (lambda radius: [beside_arc(radius, -200, 200, -5), beside_arc(radius, -100, 100, 5)], [10, 10]),
        (lambda radius: [beside_arc(radius, -240, 100, -6), beside_arc(radius, -100, 240, 4)], [12, 8]),
        (lambda radius: [beside_arc(radius, -200, 200, -5), leaving(radius)], [10, 10]),
    ],
    ids=["twice as wide as another", "three times", "one is longer", "one goes on at either end", "a fork at one end"],
)
def test_strands_that_touch_to_their_ends_are_split_by_widths(strands, widths, radius):
    scene = scene_of(strands(radius), widths)
    tracing = trace_mask(scene.mask)
    assert score(scene, tracing).right, score(scene, tracing)
    assert len(tracing.crossings) == 0
    assert "parallel strands" in [doubt.reason for doubt in tracing.ambiguous]
    assert np.array_equal(tracing.labels > 0, scene.mask)


@pytest.mark.parametrize("colours", [[RED, BLUE, GREEN], [RED, RED, RED]], ids=["hues", "shading"])
@pytest.mark.parametrize("lines", [bundle(1e6, 2), bundle(300, 2), [ring(100), ring(110)]])
def test_a_picture_tells_strands_where_there_is_no_width_to_compare_with(lines, colours):
    scene = scene_of(lines, [10, 10], closed=True)
    assert len(trace_mask(scene.mask)) == 1
    tracing = trace(render(scene, np.random.default_rng(0), colours=colours[: len(lines)]), mask=scene.mask)
    assert score(scene, tracing).right, score(scene, tracing)
    assert [doubt.reason for doubt in tracing.ambiguous] == ["parallel strands"]


def test_strands_that_touch_to_their_ends_are_crossed_by_another_cable():
    scene = scene_of([*bundle(300, 2), np.stack([np.full(300, 320.0), np.linspace(60, 400, 300)], axis=1)], [10] * 3)
    tracing = trace_mask(scene.mask)
    assert score(scene, tracing).right, score(scene, tracing)
    assert len(tracing.crossings) == 2


@pytest.mark.parametrize("seed", range(3))
def test_a_thick_cable_is_one_in_a_picture_and_so_is_a_cable_with_a_sleeve(seed):
    thick = scene_of([beside_arc(300, -200, 200, 0), ALONE], [20, 10])
    assert len(trace(render(thick, np.random.default_rng(seed)), mask=thick.mask)) == 2
    sleeve = scene_of([beside_arc(300, -200, 200, 0), beside_arc(300, -60, 60, 0)], [10, 20])
    assert len(trace_mask(sleeve.mask)) == 1
    assert len(trace(render(sleeve, np.random.default_rng(seed), colours=[RED, RED]), mask=sleeve.mask)) == 1
