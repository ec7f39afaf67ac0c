"""Two cables that lie side by side for a while, so that the mask shows one wide line."""

import numpy as np
import pytest

from scoring import score
from withe.perception import trace, trace_mask
from withe.perception.synthetic import SyntheticScene, render, render_mask


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
