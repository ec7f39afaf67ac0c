"""An edge that has to be pressed down is led down quickly, and stays."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from withe.folding import Noise, Paper, SimulatedSheet, plan, plunge

COARSE = {"edges": 75}


@pytest.fixture(scope="module")
def ways():
    paper = Paper.us_letter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # it slides
        slow = plan(paper, 0.2, method="slip", grasp="free")
    return paper, slow, plunge(slow, sheet=COARSE, progress=False)


def test_us_letter_is_folded_short_on_a_slick_table(ways):
    paper, slow, quick = ways
    assert slow.slip_ratio.max() > 2 * paper.friction
    sheet = SimulatedSheet(paper, **COARSE)
    before, found = sheet.fold(slow, progress=False), sheet.fold(quick, progress=False)
    assert abs(before.error) > 0.015
    assert found.failure is None
    assert abs(found.error) < 5e-4
    noisy = SimulatedSheet(paper, 1, Noise(), **COARSE).fold(quick, progress=False)
    assert noisy.failure is None
    assert abs(noisy.error) < 5e-3


def test_a_plunge_is_the_plan_until_it_begins(ways):
    _, slow, quick = ways
    same = len(quick.times) - 2
    assert quick.poses[:same] == pytest.approx(slow.poses[:same])
    assert quick.times[same] - quick.times[same - 1] in (pytest.approx(0.05), pytest.approx(0.1))
    assert quick.poses[-1, 2] == pytest.approx(slow.paper.thickness - 5e-4)
    assert np.isnan(quick.slip_ratio[-2:]).all()
    assert quick.slip_ratio[:same] == pytest.approx(slow.slip_ratio[:same], abs=1e-6)


def test_nonsense_is_refused(ways):
    with pytest.raises(ValueError, match="plan must be a Plan"):
        plunge("down")
    with pytest.raises(ValueError, match="press"):
        plunge(ways[1], press=0.0)
