"""An edge that has to be pressed down is led down quickly, and stays."""

from __future__ import annotations

import warnings
from dataclasses import replace

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
    assert abs(found.error) < 1e-3
    noisy = SimulatedSheet(paper, 1, Noise(), **COARSE).fold(quick, progress=False)
    assert noisy.failure is None
    assert abs(noisy.error) < 5e-3


def test_a_plunge_is_a_slow_way_without_slide_until_it_begins(ways):
    paper, _, quick = ways
    same = len(quick.times) - 2
    assert quick.poses[same - 1, 2] > 0.6 * paper.gravito_bending_length
    assert np.hypot(*np.diff(quick.poses[:same, [0, 2]], axis=0).T).max() < 0.01
    assert quick.times[same] - quick.times[same - 1] == pytest.approx(0.05)
    assert quick.poses[-1, 2] == pytest.approx(paper.thickness - 2e-3)
    assert np.isnan(quick.slip_ratio[-2:]).all()
    assert quick.slip_ratio[:same].max() < 0.5 * paper.friction
    assert np.abs(quick.slide[:same]).max() == 0.0


@pytest.mark.parametrize(("stiffness", "friction"), [(0.9, 1.0), (1.1, 1.0), (0.9, 0.5), (1.1, 0.5)])
def test_a_plunge_holds_over_what_the_plan_is_uncertain_of(ways, stiffness, friction):
    paper, _, quick = ways
    lgb = stiffness * paper.gravito_bending_length
    other = replace(paper, gravito_bending_length=lgb, friction=friction * paper.friction)
    found = SimulatedSheet(other, **COARSE).fold(quick, progress=False)
    assert found.failure is None
    assert abs(found.error) < 2e-3


def test_a_plunge_that_cannot_be_is_refused_with_the_friction_that_is_missing(ways):
    with pytest.raises(ValueError, match=r"would need friction 0\.2\d+, and the paper has 0\.12"):
        plunge(ways[1], within=1e-5, sheet=COARSE, progress=False)


def test_nonsense_is_refused(ways):
    with pytest.raises(ValueError, match="plan must be a Plan"):
        plunge("down")
    with pytest.raises(ValueError, match="press"):
        plunge(ways[1], press=0.0)
    with pytest.raises(ValueError, match="duration"):
        plunge(ways[1], duration=-1.0)
    with pytest.raises(ValueError, match="within"):
        plunge(ways[1], within=0.0)
