"""A square of origami paper folded over its diagonal: width from corner to corner in planner and simulation."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from withe.folding import Noise, Paper, SimulatedSheet, WideSheet, elastica, find_edge, overhead_camera, plan
from withe.folding.widths import free_width

COARSE = {"edges": 75, "time_step": 0.02}
STRIP = ((0.0, 1.0), (1.0, 1.0))


@pytest.fixture(scope="module")
def paper():
    return Paper.origami()


@pytest.fixture(scope="module")
def gentle(paper):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return plan(paper, 0.30, method="slip")


def test_a_square_is_as_wide_as_its_distance_from_the_corners(paper):
    assert paper.length == pytest.approx(0.35 * np.sqrt(2))
    assert paper.width_at([0.0, 0.05, 0.5 * paper.length, paper.length - 0.03]) == pytest.approx(
        [0.0, 0.10, paper.length, 0.06]
    )
    area = np.trapezoid(paper.width_at(np.linspace(0, paper.length, 2001)), dx=paper.length / 2000)
    assert area == pytest.approx(0.35**2, rel=1e-6)
    assert not paper.is_strip
    assert Paper.a4().is_strip


def test_what_hangs_begins_at_the_jaw(paper):
    width = free_width(paper, 0.01)
    lgb = paper.gravito_bending_length
    assert width.widths[0] == pytest.approx(0.02 / paper.length)
    places = np.linspace(0.0, (paper.length - 0.01) / lgb, 50)
    weights = [np.trapezoid(paper.width_at(0.01 + lgb * np.linspace(0, t, 4001)), dx=t / 4000) for t in places]
    assert width.weight(places) == pytest.approx(np.array(weights) / paper.width, abs=1e-6)
    assert free_width(Paper.a4(), 0.01).even


def test_the_uniform_strip_is_wrong_for_it(paper):
    """By 0.1 to 0.2 rad and 0.1 to 0.16 in the ratio of forces, somewhere on the way."""
    width = free_width(paper, 0.01)
    rows = np.stack([width.places[:2], width.widths[:2]], axis=1)
    x, z = np.meshgrid(np.linspace(1.0, 4.0, 7), np.linspace(1.0, 3.0, 5))
    strip, square = elastica(x, z), elastica(x, z, width=rows)
    both = strip.valid & square.valid
    assert both.sum() > 20
    assert 0.1 < np.abs(strip.angle - square.angle)[both].max() < 0.6


def test_its_plan_bears_the_way_without_moment(paper):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        way = plan(paper, 0.30)
    lgb = paper.gravito_bending_length
    assert way.poses[-1, 0] == pytest.approx(0.30, abs=1e-8)
    assert np.abs(way.sheet.tip_moment).max() < 1e-3
    width = free_width(paper, way.jaw.depth)
    lying = width.weight((paper.length - 0.01) / lgb) - width.weight(way.sheet.suspended)
    ratio = np.abs(way.sheet.tangential_force) / (way.sheet.normal_force + lying)
    assert way.slip_ratio == pytest.approx(ratio)


def test_it_is_folded_without_slide(paper, gentle):
    assert gentle.slip_ratio.max() < paper.friction
    assert gentle.clearance > 0.0
    found = SimulatedSheet(paper, **COARSE).fold(gentle, progress=False)
    assert found.failure is None
    assert abs(found.error) < 5e-4
    assert abs(found.slide) < 1e-3


def test_it_slides_as_the_continuum_says(paper):
    """The way of least accumulated ratio slides: elastica of that width, Coulomb with the weight of what lies."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        way = plan(paper, 0.30)
        strip = plan(replace(paper, outline=STRIP), 0.30)
    found = SimulatedSheet(paper, edges=100, time_step=0.02).fold(way, progress=False)
    assert way.slide[-1] > 5e-3
    assert found.slide == pytest.approx(way.slide[-1], abs=4e-4)
    # As the dissertation plans it, as a strip, jaws are turned wrongly, and it slides farther.
    other = SimulatedSheet(paper, **COARSE).fold(strip, progress=False)
    assert other.slide > 2.0 * found.slide


def test_a_plan_that_another_paper_within_its_uncertainty_slides_on_says_so(paper):
    with pytest.warns(
        UserWarning, match=r"the sheet slides by 2\d\d.* mm for a paper within the uncertainty, with Lgb 0.0473 m"
    ):
        plan(paper, 0.30, method="slip")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        plan(paper, 0.30, method="slip", uncertainty=(0.0, 0.0))


def test_its_far_corner_is_seen(paper):
    camera = overhead_camera(paper.length)
    for seed in range(5):
        sheet = SimulatedSheet(paper, seed, Noise())
        seen = find_edge(sheet.picture(camera), camera, paper)
        assert seen.x == pytest.approx(paper.length, abs=1e-3)
        assert seen.corners.shape == (1, 2)
        assert np.isnan(seen.angle)


def test_what_needs_a_strip_says_so(paper):
    with pytest.raises(ValueError, match="paper must have uniform width"):
        WideSheet(paper)
    with pytest.raises(ValueError, match="manifold 'network' needs a sheet of uniform width"):
        plan(paper, 0.30, manifold="network")
    with pytest.raises(ValueError, match="grasp 'free' needs a sheet of uniform width"):
        plan(paper, 0.30, method="slip", grasp="free")


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (((0.0, 1.0), (0.9, 1.0)), "outline must have shares of the length"),
        (((0.0, 1.0), (0.5, 1.0), (0.5, 0.5), (1.0, 0.2)), "outline must have shares of the length"),
        (((0.0, 0.5), (1.0, 0.5)), "outline must have shares of the width"),
        (((0.0, 1.0), (0.5, 0.0), (1.0, 1.0)), "outline must have shares of the width"),
        (((0.0, 1.0), (1.0, -0.5)), "outline must have shares of the width"),
        ((0.0, 1.0), "outline"),
    ],
)
def test_an_outline_of_nonsense_is_refused(outline, message):
    with pytest.raises(ValueError, match=message):
        Paper(0.3, 0.2, 0.05, outline=outline)
