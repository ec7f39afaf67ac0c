"""The 99 labelled photographs, where they are present: WITHE_DATA/mbest."""

import os
from pathlib import Path

import numpy as np
import pytest

from labelled import RANGES, dice, orders, pictures
from withe.perception import color_filter, trace

cv2 = pytest.importorskip("cv2")
FOLDER = Path(os.environ.get("WITHE_DATA", "")) / "mbest"
pytestmark = pytest.mark.skipif(
    not os.environ.get("WITHE_DATA") or not FOLDER.is_dir(),
    reason="no labelled images: WITHE_DATA does not name a folder with mbest in it",
)


@pytest.fixture(scope="module")
def traced():
    mask = color_filter(RANGES)
    return [(tier, name, labels, trace(image, mask=mask)) for tier, name, image, labels in pictures(FOLDER)]


def test_the_number_of_cables_is_exact_on_every_image(traced):
    assert len(traced) == 99
    wrong = [(tier, name, len(tracing)) for tier, name, labels, tracing in traced if len(tracing) != labels.max()]
    assert wrong == []


def test_labels_agree_with_those_of_people(traced):
    scores = {}
    for tier, name, labels, tracing in traced:
        score, _ = dice(tracing.labels, labels)
        assert score >= 0.995, (tier, name, score)
        scores.setdefault(tier, []).append(score)
    means = {tier: 100 * np.mean(values) for tier, values in scores.items()}
    assert means["S1"] >= 99.9, means
    assert means["S2"] >= 99.8, means
    assert means["S3"] >= 99.7, means


def test_the_upper_cable_is_right_wherever_the_labels_tell_it(traced):
    right = total = 0
    for _, _, labels, tracing in traced:
        good, count = orders(tracing, labels)
        right, total = right + good, total + count
    assert total >= 280
    assert right == total


@pytest.mark.slow
def test_the_default_filter_finds_the_right_number_too():
    wrong = [(tier, name) for tier, name, image, labels in pictures(FOLDER) if len(trace(image)) != labels.max()]
    assert wrong == []
