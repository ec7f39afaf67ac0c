"""A sheet that slides is folded right all the same, where a camera says by how much it slid."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from withe.folding import Noise, Paper, SimulatedSheet, fold, overhead_camera, plan, replan
from withe.folding.planning import plan_above
from withe.folding.watching import watched_parts

pytest.importorskip("cv2")

A4 = Paper.a4()
COARSE = {"edges": 75, "time_step": 0.02}


@pytest.fixture(scope="module")
def half():
    return plan(A4, method="ucs")


def test_the_edges_meet_though_the_sheet_slides(half):
    sheet = SimulatedSheet(A4, 2, Noise(), **COARSE)
    blind = sheet.fold(half, progress=False)
    watched = fold(half, sheet, progress=False)
    assert blind.seen_slides == ()
    assert abs(blind.error) > 2e-3
    assert watched.failure is None
    assert abs(watched.error) < 1e-3
    assert len(watched.seen_slides) == 5
    # The last seen slide is that of the sheet at this time. The sheet slid no farther than the error of the crease.
    assert watched.seen_slides[-1] == pytest.approx(watched.slide, abs=5e-4)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_large_sheets_that_slide_are_folded_within_a_millimetre(seed):
    """Sheets up to A3, whose far edges are wider than those of A4: a camera has to see both corners of the edge."""
    random = np.random.default_rng(seed)
    length, lgb, friction = random.uniform([0.33, 0.045, 0.2], [0.42, 0.07, 0.4])
    paper = Paper(length, length / np.sqrt(2.0), lgb, friction)
    noise = replace(Noise.none(), friction=0.1, friction_variation=0.1)
    found = fold(plan(paper, 0.8 * length), SimulatedSheet(paper, seed, noise, **COARSE), progress=False)
    assert found.failure is None
    assert found.slide > 3e-3
    assert np.isfinite(found.seen_slides[:-1]).all()
    assert abs(found.error) < 1e-3


@pytest.mark.parametrize("target", ["half", 0.25])
def test_no_slide_is_seen_where_there_is_none(target):
    # Not by the corners of the lifted edge over the far one, nor by those of a picture's pixels.
    planned = plan(A4, target, method="slip", grasp="free")
    watched = fold(planned, SimulatedSheet(A4, **COARSE), progress=False)
    assert abs(watched.slide) < 1e-4
    assert np.nanmax(np.abs(watched.seen_slides)) < 2e-4
    assert abs(watched.error) < 1e-4


def test_a_fold_that_is_not_corrected_goes_the_planned_way(half):
    sheet = SimulatedSheet(A4, **COARSE)
    blind = sheet.fold(half, progress=False)
    watched = fold(half, sheet, replans=2, tolerance=1.0, progress=False)
    assert watched.slide == pytest.approx(blind.slide, abs=2e-4)
    assert watched.record.positions("sheet")[-1, 0] == pytest.approx(half.poses[-1, :3], abs=1e-6)


@pytest.mark.slow
def test_a_watched_way_plunges_where_its_last_part_would_slide_unseen():
    sheet = SimulatedSheet(Paper.us_letter(), 1002, Noise(), **COARSE)
    paper = replace(sheet.paper, gravito_bending_length=sheet.truth.gravito_bending_length)
    slow = plan(paper)
    way = plan(paper, replans=5, uncertainty=(0.02, 0.3), progress=False)
    assert slow.plunges_at is None
    assert way.plunges_at is not None
    # For a sheet that has slid, the edge comes down at the place where the sheet was last seen.
    assert way.plunge_slide == pytest.approx(way.before_plunge().slide[-1], abs=1e-3)
    assert abs(fold(slow, sheet, progress=False).error) > 3e-3
    found = fold(way, sheet, progress=False)
    assert found.failure is None
    assert abs(found.error) < 5e-4


@pytest.mark.slow
def test_a_plunge_without_moment_begins_over_the_target():
    """Also of a fold whose slow way skims the sheet on its last half, as that of a square over its diagonal does."""
    paper = replace(Paper.origami(), friction=0.12)
    way = plan(paper, 0.3, replans=5, uncertainty=(0.02, 0.3), progress=False)
    slow = way.before_plunge()
    assert way.plunges_at is not None
    assert slow.rise >= 0.4 * paper.gravito_bending_length
    assert slow.poses[-1, 0] == pytest.approx(0.3, abs=1e-8)
    assert slow.poses[-1, 2] == pytest.approx(slow.rise + paper.thickness + way.jaw.finger, rel=0.2)
    sheet = SimulatedSheet(paper, 2003, Noise(), **COARSE)
    found = fold(way, sheet, progress=False)
    assert found.failure is None
    assert abs(found.error) < 2e-3


def test_a_sheet_that_slides_off_the_manifold_is_led_on_to_where_it_can_be_held():
    """The border is near where short parts are lifted: the rest begins at the next pose of the way that is within."""
    paper, slid = Paper.us_letter(), 0.01
    slow = plan_above(plan(paper, 0.2), 0.8 * paper.gravito_bending_length)
    parts = list(watched_parts(slow, 5, lambda _: slid))
    with pytest.raises(ValueError, match="none exists with the jaw's inner edge"):
        replan(slow, parts[0].poses[-1], slid)
    assert parts[-1].poses[-1, [0, 2]] == pytest.approx(slow.poses[-1, [0, 2]] + [slid, 0.0], abs=1e-8)
    for before, after in pairwise(parts):
        assert after.poses[0] == pytest.approx(before.poses[-1])
        assert np.abs(np.diff(after.poses[:, :3], axis=0)).max() < 5e-3


def test_a_hidden_edge_is_said_and_not_guessed(half):
    aside = overhead_camera(1.5)
    with pytest.warns(UserWarning, match="the camera never saw the sheet's far edge"):
        watched = fold(half, SimulatedSheet(A4, **COARSE), replans=1, camera=aside, progress=False)
    assert np.isnan(watched.seen_slides).all()


def test_nonsense_is_refused(half):
    sheet = SimulatedSheet(A4, **COARSE)
    with pytest.raises(ValueError, match="plan must be a FoldPlan"):
        fold("half", sheet)
    with pytest.raises(ValueError, match="sheet must be a SimulatedSheet or a WideSheet"):
        fold(half, A4)
    letter = SimulatedSheet(Paper.us_letter(), **COARSE)
    for carry in (lambda: fold(half, letter), lambda: letter.fold(half)):
        with pytest.raises(ValueError, match=r"for a sheet of 0.2794 m, got one for 0.297 m"):
            carry()
    with pytest.raises(ValueError, match=r"have times, poses and target, got 'fold.csv'"):
        sheet.fold("fold.csv")
    with pytest.raises(ValueError, match="replans"):
        fold(half, sheet, replans=-1)
    with pytest.raises(ValueError, match="tolerance"):
        fold(half, sheet, tolerance=-1.0)
