"""Shape of a hanging cable with natural curvature, and its measurement."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from withe.deployment import Cable, hang, measure_curvature
from withe.perception.synthetic import render_mask

LGB = 0.08


@pytest.mark.case("inverse", "Natural curvature from a hanging cable", source="linear theory of a heavy beam")
def test_the_free_end_hangs_aside_as_a_heavy_beam_does():
    # EI x'' = moment, moment' = w s x' for small slopes, s from the free end, EI = 2 w Lgb^3; upright far above.
    def slopes(s, y):
        return [y[1], y[2], 0.5 * s * y[1]]

    def ends(free, held):
        return [free[2] - 1.0, held[0], held[1]]

    s = np.linspace(0.0, 15.0, 400)
    found = solve_bvp(slopes, ends, s, np.zeros((3, 400)), tol=1e-9, max_nodes=20000)
    little = 1e-3 * found.y[0, 0]
    assert measure_curvature(1.0, aside=little).curvature == pytest.approx(1e-3, rel=1e-5)
    assert measure_curvature(1.0, aside=-little, error=0.1).error == pytest.approx(0.1 / found.y[0, 0], rel=1e-4)


@pytest.mark.case("inverse", "Natural curvature from cables in the rod engine", source="the curvature that was set")
@pytest.mark.parametrize("natural", [(0.5, 0.0), (-0.3, 0.4)])
def test_the_rod_engine_hangs_so(natural):
    for nodes, off in ((100, 0.02), (200, 0.005)):
        found = hang(Cable(0.87, 1.8e-3, LGB, natural), nodes=nodes)
        aside = found[0, :2] - found[int(0.7 * nodes), :2]
        seen = [measure_curvature(LGB, aside=x).curvature for x in aside]
        np.testing.assert_allclose(seen, natural, atol=off * np.hypot(*natural))


@pytest.mark.parametrize("natural", [(4.0, 0.0), (-14.0, 0.0), (6.0, -7.0)])
def test_a_cable_that_curls_is_measured_within_the_error_that_is_given(natural):
    found = hang(Cable(0.87, 1.8e-3, LGB, natural), nodes=400)
    aside = found[0, :2] - found[280, :2]
    random = np.random.default_rng(6)
    off = []
    for _ in range(200):
        x, y = aside + random.normal(0.0, 5e-4, 2)
        seen = measure_curvature(LGB, aside=x, depth=y), measure_curvature(LGB, aside=y, depth=x)
        off.append([(m.curvature - k) / m.error for m, k in zip(seen, natural, strict=True)])
    assert np.std(off, axis=0) == pytest.approx(1.0, abs=0.15)
    assert np.abs(np.mean(off, axis=0)).max() < 0.25


def photographed(line, radius, pixel, lean=0.0):
    """A picture of x and height before a plain background, by a camera that leans a little [rad]."""
    corner = np.array([line[:, 0].min() - 0.02, line[:, 1].max()])  # the cable goes on above
    seen = (line - corner) * [1.0, -1.0] / pixel
    seen[:, 0] += lean * seen[:, 1]
    columns, rows = np.ceil(seen.max(0) + 0.02 / pixel).astype(int)
    mask = render_mask([seen], [2.0 * radius / pixel], [False], (rows, columns))
    noise = np.random.default_rng(4).normal(0.0, 4.0, (rows, columns, 3))
    return np.clip(np.where(mask[..., None], (60, 60, 70), (225, 230, 230)) + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("natural", "lean"), [((0.5, -0.2), 0.0), ((-0.9, 0.3), 0.01), ((4.0, -5.0), 0.01)])
def test_pictures_from_two_sides_measure_both_components(natural, lean):
    pixel, cable = 5e-4, Cable(0.87, 1.8e-3, LGB, natural)
    line = hang(cable, nodes=400)
    aside = line[0, :2] - line[280, :2]
    lower = line[:, 2] < 6.0 * LGB
    for axis in range(2):
        image = photographed(line[lower][:, [axis, 2]], cable.radius, pixel, lean)
        found = measure_curvature(LGB, image=image, scale=pixel, depth=aside[1 - axis])
        assert found.curvature == pytest.approx(natural[axis], abs=1.5 * found.error)
        assert 0.5 * pixel / (2.044 * LGB**2) < found.error < 0.02 + 0.006 * np.hypot(*natural)


def curled():
    line = hang(Cable(0.87, 1.8e-3, LGB, (12.0, 0.0)))
    return photographed(line[line[:, 2] < 6.0 * LGB][:, [0, 2]], 1.8e-3, 5e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: measure_curvature(0.08), "exactly one of aside and image"),
        (lambda: measure_curvature(-0.08, aside=0.1), "gravito_bending_length must be positive"),
        (lambda: measure_curvature(0.08, aside=float("nan")), "aside"),
        (lambda: measure_curvature(0.08, aside=0.0, error=-1.0), "error must not be negative"),
        (lambda: measure_curvature(0.08, aside=-0.16), "aside must be at most 0.155 m, .* curls up"),
        (lambda: measure_curvature(0.08, aside=0.1, depth=float("inf")), "depth"),
        (lambda: measure_curvature(0.08, image=curled(), scale=5e-4), "image must show a cable whose end hangs at 70"),
        (lambda: measure_curvature(0.08, image=np.zeros((50, 50, 3), np.uint8)), "needs scale"),
        (lambda: measure_curvature(0.08, image=np.zeros((50, 50, 3), np.uint8), scale=1e-3), "must show 5 Lgb"),
        (lambda: Cable(0.5, 2e-3, 0.03, natural_curvature=(1.0,)), "natural_curvature must have shape"),
        (lambda: Cable(0.5, 2e-3, 0.03, natural_curvature=(600.0, 0.0)), "natural_curvature must be less than"),
    ],
)
def test_bad_input_says_what_is_wrong(call, message):
    with pytest.raises(ValueError, match=message):
        call()
