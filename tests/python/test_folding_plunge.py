"""An edge that has to be pressed down is led down quickly, and stays."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from withe.folding import Noise, Paper, SimulatedSheet, fold, plan, plunge

COARSE = {"edges": 75}


@pytest.fixture(scope="module")
def ways():
    paper = Paper.us_letter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # it slides
        slow = plan(paper, 0.2, method="slip", grasp="free", ending="slow")
    return paper, slow, plunge(slow, sheet=COARSE, progress=False)


@pytest.mark.slow
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
    assert quick.plunges_at == quick.times[same - 1]
    assert len(quick.before_plunge()) == same
    assert quick.poses[same - 1, 2] > 0.4 * paper.gravito_bending_length
    assert np.hypot(*np.diff(quick.poses[:same, [0, 2]], axis=0).T).max() < 0.01
    assert min(abs(quick.times[same] - quick.times[same - 1] - time) for time in (0.025, 0.05)) < 1e-12
    assert quick.poses[-1, 2] == pytest.approx(paper.thickness - 2e-3)
    assert np.isnan(quick.slip_ratio[-2:]).all()
    assert quick.slip_ratio[:same].max() < 0.5 * paper.friction
    assert quick.jumps_at == quick.times[same]
    assert np.abs(quick.slide[:same]).max() == 0.0


def test_what_becomes_of_a_plunge_is_resolved_whatever_the_time_step(ways):
    paper, _, quick = ways
    slides, errors = [], []
    for step in (0.01, 0.004, 0.0015):
        found = SimulatedSheet(paper, time_step=step, **COARSE).fold(quick, progress=False)
        assert found.failure is None
        slides.append(found.slide)
        errors.append(found.error)
    assert np.ptp(slides) < 1e-4
    assert np.ptp(errors) < 1e-4


@pytest.mark.parametrize(("stiffness", "friction"), [(0.9, 1.0), (1.1, 1.0), (0.9, 0.5), (1.1, 0.5)])
def test_a_plunge_holds_over_what_the_plan_is_uncertain_of(ways, stiffness, friction):
    paper, _, quick = ways
    lgb = stiffness * paper.gravito_bending_length
    other = replace(paper, gravito_bending_length=lgb, friction=friction * paper.friction)
    found = SimulatedSheet(other, **COARSE).fold(quick, progress=False)
    assert found.failure is None
    assert abs(found.error) < 2e-3


@pytest.mark.slow
def test_the_planner_plunges_where_a_paper_that_it_may_be_would_slide(ways):
    """Half of US Letter does not slide as it is thought to be, and does where it is stiffer."""
    paper = ways[0]
    slow = plan(paper, method="slip", grasp="free", ending="slow")
    assert slow.plunges_at is None
    slide, which = slow.worst_slide
    assert slow.slide[-1] == pytest.approx(0.0, abs=1e-6)
    assert slide > 1e-3
    assert which.friction == pytest.approx(0.5 * paper.friction)
    found = plan(paper, method="slip", grasp="free", progress=False)
    assert found.plunges_at is not None
    assert found.blocked is None
    assert found.worst_slide[0] < 1e-4
    assert "plunges at" in repr(found)
    assert found.to_dict()["plunges_at"] == found.plunges_at
    for seed in (7, 8):
        noisy = SimulatedSheet(paper, seed, Noise()).fold(found, progress=False)
        assert noisy.failure is None
        assert abs(noisy.error) < 1.5e-3  # Lgb, which it was not told, is off by up to a tenth


def test_the_planner_comes_down_slowly_where_no_paper_slides():
    found = plan(Paper.a4(), method="slip", grasp="free")
    assert found.plunges_at is None
    assert found.blocked is None
    assert found.worst_slide[0] < 1e-4


@pytest.mark.slow
def test_where_nothing_bears_the_uncertainty_the_plan_says_so():
    """Cardboard on a table that is all but without friction."""
    paper = replace(Paper.cardboard(), friction=0.02)
    with pytest.warns(
        UserWarning, match=r"the fold needs a friction coefficient of 0\.6\d+, and the paper has 0\.02; no plunge folds"
    ):
        found = plan(paper, method="slip", grasp="free", curvature=4.0, progress=False)
    assert found.plunges_at is None
    assert "would need friction 0.6" in found.blocked
    assert "fails within its uncertainty" in repr(found)


@pytest.mark.slow
def test_cardboard_is_folded_in_half_on_a_table_on_which_it_would_slide():
    """The plunge must fold all sheets; a way with less slide that misses some of them is not allowed."""
    paper = replace(Paper.cardboard(), friction=0.3)
    with pytest.warns(UserWarning, match="the sheet slides"):
        slow = plan(paper, method="slip", grasp="free", curvature=4.0, ending="slow")
    folded = SimulatedSheet(paper, **COARSE).fold(plunge(slow, sheet=COARSE, progress=False), progress=False)
    assert folded.failure is None
    assert abs(folded.error) < 1e-3


def test_a_watched_plunge_goes_down_where_the_sheet_is_then(ways):
    pytest.importorskip("cv2")
    paper, _, quick = ways
    sheet = SimulatedSheet(paper, **COARSE)
    watched = fold(quick, sheet, replans=2, progress=False)
    assert watched.failure is None
    assert len(watched.seen_slides) == 2
    assert abs(watched.error) < 1e-3
    moved = replace(quick, offset=-0.004)  # it is said to have slid before; a camera sees that it has not
    found = fold(moved, sheet, replans=1, progress=False)
    assert found.record.positions("sheet")[-1, 0, 0] == pytest.approx(quick.poses[-1, 0] + 0.004, abs=1e-3)


@pytest.mark.slow
def test_a_plunge_that_cannot_be_is_refused_with_the_friction_that_is_missing(ways):
    with pytest.raises(ValueError, match=r"would need friction 0\.2\d+, and the paper has 0\.12"):
        plunge(ways[1], within=1e-5, duration=0.025, sheet=COARSE, progress=False)


def test_nonsense_is_refused(ways):
    with pytest.raises(ValueError, match="plan must be a FoldPlan"):
        plunge("down")
    with pytest.raises(ValueError, match="plan must end slowly, but already plunges at"):
        plunge(ways[2])
    with pytest.raises(ValueError, match="press"):
        plunge(ways[1], press=0.0)
    with pytest.raises(ValueError, match="duration"):
        plunge(ways[1], duration=-1.0)
    with pytest.raises(ValueError, match="within"):
        plunge(ways[1], within=0.0)
