"""A wide sheet of two strips: as a narrow one where both slide alike, and turned where they do not."""

from __future__ import annotations

import numpy as np
import pytest

from withe.folding import Noise, Paper, SimulatedSheet, WideSheet, find_edge, fold, overhead_camera, plan

A4 = Paper.a4()
MESH = {"edges": 60, "time_step": 0.02}


@pytest.fixture(scope="module")
def half():
    return plan(A4)


def test_strips_that_slide_alike_are_one_sheet(half):
    wide = WideSheet(A4, unevenness=0.0, **MESH).fold(half, progress=False)
    narrow = SimulatedSheet(A4, **MESH).fold(half, progress=False)
    assert wide.failure is None
    assert narrow.slide > 7e-3
    assert wide.slides == pytest.approx([narrow.slide, narrow.slide], abs=1.5e-4)
    assert wide.spin == pytest.approx(0.0, abs=1e-6)
    assert wide.error == pytest.approx(narrow.error, abs=1e-4)
    assert wide.length == pytest.approx(0.5 * A4.length + wide.error)


def test_the_side_that_is_more_slippery_slides_farther_and_the_crease_turns(half):
    sheet = WideSheet(A4, seed=3, unevenness=0.2, **MESH)
    assert sheet.frictions.mean() == pytest.approx(0.12)
    slick = int(np.argmin(sheet.frictions))
    found = sheet.fold(half, progress=False)
    assert found.failure is None
    assert found.slides[slick] > found.slides[1 - slick] + 1e-5
    # The side that slides away is too short: its edge comes down where the sheet is no longer.
    lengths = 0.5 * (half.target - found.slides)
    assert found.spin == pytest.approx(np.arctan2(lengths[0] - lengths[1], 0.5 * A4.width), rel=1e-3)


def test_a_camera_sees_how_both_sides_lie():
    pytest.importorskip("cv2")
    sheet, camera = WideSheet(A4, **MESH), overhead_camera(A4.length)
    flat = find_edge(sheet.picture(camera), camera, A4)
    assert flat.x == pytest.approx(A4.length, abs=5e-4)
    assert flat.angle == pytest.approx(0.0, abs=5e-3)
    narrow = find_edge(SimulatedSheet(A4, **MESH).picture(camera), camera, A4)
    assert flat.corners == pytest.approx(narrow.corners, abs=3e-4)


def test_the_edges_of_a_wide_sheet_meet_where_it_is_watched(half):
    pytest.importorskip("cv2")
    sheet = WideSheet(A4, seed=3, unevenness=0.2, **MESH)
    watched = fold(half, sheet, progress=False)
    assert watched.failure is None
    assert watched.slides.mean() > 5e-3
    assert abs(watched.error) < 1e-3
    assert len(watched.seen_slides) == 5
    assert watched.seen_slides[-1] == pytest.approx(watched.slides.mean(), abs=1e-3)


def test_without_slide_nothing_turns():
    planned = plan(A4, method="slip", grasp="free")
    found = WideSheet(A4, seed=3, unevenness=0.2, **MESH).fold(planned, progress=False)
    assert found.failure is None
    assert np.abs(found.slides).max() < 1e-4
    assert abs(np.degrees(found.spin)) < 0.02


def test_a_seed_says_what_differs():
    first, again, other = (WideSheet(A4, seed, Noise()) for seed in (1, 1, 2))
    assert (first.frictions == again.frictions).all()
    assert first.truth == again.truth
    assert (first.frictions != other.frictions).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"paper": "a4"}, "paper must be a Paper"),
        ({"paper": A4, "noise": "loud"}, "noise must be a Noise"),
        ({"paper": A4, "unevenness": 0.6}, "unevenness must be .5 at most"),
        ({"paper": A4, "edges": 3}, "edges"),
    ],
)
def test_a_wide_sheet_of_nonsense_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        WideSheet(**arguments)
