"""A wide sheet of two strips: as a narrow one where both slide alike, and turned where they do not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from withe.folding import Noise, Paper, SimulatedSheet, WideSheet, find_edge, fold, overhead_camera, plan

A4 = Paper.a4()
MESH = {"edges": 60, "time_step": 0.02}


@dataclass
class Over:
    """Over along half a circle, and down by 2 mm more than it can go."""

    paper: Paper

    def __post_init__(self):
        share, reach = np.linspace(0.0, 1.0, 41), 0.5 * self.paper.length
        angle = np.pi * share - 0.5 * np.sin(2.0 * np.pi * share)
        x, z = reach * (1.0 - np.cos(angle)) - 4e-3 * share, reach * np.sin(angle) + self.paper.thickness * share
        none = np.zeros_like(x)
        self.poses = np.stack([x, none, z, none, np.sin(0.5 * angle), none, np.cos(0.5 * angle)], axis=1)
        self.poses = np.vstack([self.poses, self.poses[-1] - [0.0, 0.0, 2e-3, 0.0, 0.0, 0.0, 0.0]])
        self.times = np.append(3.0 * share, 3.3)
        self.target = self.paper.length


@pytest.fixture(scope="module")
def half():
    return plan(A4)


@pytest.mark.parametrize("seed", [1, 2])
def test_layers_that_are_pressed_lie_on_each_other_and_not_side_by_side(seed):
    paper = replace(A4, friction=0.6)
    sheet = WideSheet(paper, seed, Noise(friction_variation=0.0), unevenness=0.2, **MESH)
    found = sheet.fold(Over(paper), progress=False)
    assert found.failure is None
    for strip in sheet.strips:
        assert sheet.simulation.positions(strip)[:2, 2].min() > 0.9 * paper.thickness


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


@pytest.mark.slow
def test_the_edges_of_a_wide_sheet_meet_where_it_is_watched(half):
    pytest.importorskip("cv2")
    sheet = WideSheet(A4, seed=3, unevenness=0.2, **MESH)
    watched = fold(half, sheet, progress=False)
    assert watched.failure is None
    assert watched.slides.mean() > 5e-3
    assert abs(watched.error) < 1e-3
    assert len(watched.seen_slides) == 5
    assert watched.seen_slides[-1] == pytest.approx(watched.slides.mean(), abs=1e-3)


@pytest.mark.slow
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
        ({"paper": A4, "unevenness": 0.6}, "unevenness must be at most 0.5"),
        ({"paper": A4, "edges": 3}, "edges"),
    ],
)
def test_a_wide_sheet_of_nonsense_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        WideSheet(**arguments)
