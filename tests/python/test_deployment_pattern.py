"""Cables, patterns, and what friction they need."""

import numpy as np
import pytest

import withe
from withe.deployment import Cable, Pattern, measure
from withe.perception.synthetic import render_mask


def arc(radius, turned, count=400):
    angle = np.linspace(0.0, turned, count)
    return radius * np.stack([np.sin(angle), 1.0 - np.cos(angle)], 1)


def wave(height=0.03, count=300):
    x = np.linspace(0.0, 0.5, count)
    return np.stack([x, height * np.sin(4 * np.pi * x)], 1)


@pytest.fixture(scope="module")
def loop():
    """Shape of a cable that is folded back over itself, x and z [Lgb].

    theta'' = (R - s) cos(theta) / 2 from the floor to the layer below, where theta is back at pi and z at 0.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    def over(reaction):
        def turned(s, y):
            return y[0] - np.pi

        turned.terminal, turned.direction = True, -1

        def slopes(s, y):
            return [y[1], 0.5 * (reaction - s) * np.cos(y[0]), np.sin(y[0]), np.cos(y[0])]

        start = [0.0, 0.0, 0.0, 0.0]
        return solve_ivp(slopes, (0.0, 9.0), start, events=turned, rtol=1e-11, atol=1e-12, dense_output=True)

    reaction = brentq(lambda r: over(r).y[2, -1], 4.6, 4.85, xtol=1e-12)
    found = over(reaction)
    return found.sol(np.linspace(0.0, found.t[-1], 20001))[[3, 2]].T


def test_the_loop_that_hangs_on_a_floor_is_as_high_as_measure_says(loop):
    height = loop[:, 1].max()
    assert measure(height=height).gravito_bending_length == pytest.approx(1.0, abs=1e-5)
    assert measure(height=0.0366, error=1e-3).error == pytest.approx(1e-3 / 1.1422, rel=1e-4)


@pytest.mark.parametrize(("lgb", "radius"), [(0.018, 1.6e-3), (0.032, 1.6e-3), (0.034, 2e-3), (0.0286, 3.2e-3)])
def test_a_picture_of_a_loop_measures_the_cable_within_half_a_pixel(loop, lgb, radius):
    pixel, random = 2.5e-4, np.random.default_rng(5)
    for _ in range(3):
        away = random.uniform(0.0, 1.0, 2)
        line = np.concatenate([[[-3.0, 0.0]], loop[::50], [[loop[-1, 0] - 2.0, 0.0]]])
        line = (lgb * line * [1.0, -1.0] + [0.13, 0.07]) / pixel + away
        mask = render_mask([line], [2.0 * radius / pixel], [False], (380, 900))
        image = np.where(mask[..., None], (200, 70, 90), (235, 235, 230)) + random.normal(0.0, 4.0, (380, 900, 3))
        found = measure(image=np.clip(image, 0, 255).astype(np.uint8), scale=pixel)
        assert found.gravito_bending_length == pytest.approx(lgb, abs=0.75 * pixel)
        assert found.error == pytest.approx(0.5 * pixel / 1.1422, rel=1e-4)
    with pytest.raises(ValueError, match="scale must be in metres per pixel"):
        measure(image=np.clip(image, 0, 255).astype(np.uint8), scale=1.0 / pixel)


def test_cables_of_the_experiments():
    cable = Cable.dlo(3)
    assert (cable.length, cable.radius, cable.gravito_bending_length) == (0.89, 2e-3, 0.034)
    assert cable.stretch_stiffness == pytest.approx(4 * (34 / 2) ** 2)


def test_a_circle_has_its_curvature():
    pattern = Pattern(arc(0.1, 4.0), lead_in=0.2, smoothing=3e-4)
    bent = (pattern.arc_length > 0.25) & (pattern.arc_length < 0.55)
    np.testing.assert_allclose(pattern.curvature[bent], 10.0, rtol=0.02)
    assert abs(pattern.curvature[0]) < 0.2
    assert pattern.length == pytest.approx(0.6, abs=1e-3)


def test_pattern_and_its_derivatives_belong_together():
    pattern = Pattern(wave())
    s, heading = pattern.arc_length, np.unwrap(np.arctan2(*pattern.tangent.T[::-1]))
    np.testing.assert_allclose(np.linalg.norm(np.diff(pattern.points, axis=0), axis=1), s[1], rtol=1e-4)
    np.testing.assert_allclose(np.gradient(heading, s)[2:-2], pattern.curvature[2:-2], atol=0.05)
    np.testing.assert_allclose(np.gradient(pattern.curvature, s)[3:-3], pattern.curvature_slope[3:-3], atol=5.0)
    assert np.abs(np.gradient(pattern.curvature_slope, s) - pattern.curvature_bend)[5:-5].mean() < 200.0


@pytest.mark.parametrize("smoothing", [3e-4, 1e-3, 3e-3])
def test_smoothing_stays_within_its_bound_and_needs_less_the_wider_it_is(smoothing):
    rough = wave() + np.random.default_rng(3).normal(0.0, 1e-4, (300, 2))
    pattern = Pattern(rough, smoothing=smoothing)
    assert 0.5 * smoothing < pattern.deviation <= smoothing + 1e-4  # which the noise may be off between nodes
    wider = Pattern(rough, smoothing=2 * smoothing)
    cable = Cable.dlo(2)
    assert wider.feasibility(cable, 0.5).floor.max() < pattern.feasibility(cable, 0.5).floor.max()


def test_no_smoother_curve_within_the_bound_needs_less_without_tension():
    # A first-order check of the optimum: random smooth changes that stay inside do not lower the greatest x''''.
    from scipy.interpolate import make_interp_spline

    from withe.deployment.smoothing import fourth_differences, smooth

    raw = wave(count=200)
    spacing = float(np.linalg.norm(np.diff(raw, axis=0), axis=1).mean())
    best = smooth(raw, spacing, np.full(200, 1e-3))
    matrix = fourth_differences(200) / spacing**4

    def need(points):
        return np.linalg.norm(matrix @ points, axis=1).max()

    random = np.random.default_rng(5)
    at = np.linspace(0, 199, 12)
    for _ in range(200):
        bump = make_interp_spline(at, random.normal(0.0, 1.0, (12, 2)), k=5)(np.arange(200))
        other = best + 10 ** random.uniform(-7, -4) * bump
        if np.linalg.norm(other - raw, axis=1).max() < 1e-3:
            assert need(other) > 0.97 * need(best)


def test_function_that_begins_bent_gets_a_lead_in_of_one_radian():
    pattern = Pattern(function=lambda share: arc(0.1, 4.0)[0] + arc_at(0.1, 4.0 * share))
    assert pattern.lead_in == pytest.approx(0.2, rel=0.02)
    assert abs(pattern.curvature[0]) < 0.2


def arc_at(radius, angle):
    return radius * np.stack([np.sin(angle), 1.0 - np.cos(angle)], 1)


def test_image_gives_a_pattern_in_metres():
    image = np.full((200, 400, 3), 255, np.uint8)
    image[96:104, 50:350] = 20
    pattern = Pattern(image=image, scale=1e-3)
    assert pattern.length == pytest.approx(0.3, abs=0.02)
    assert np.abs(pattern.points[:, 1] + 0.1).max() < 5e-3


def test_a_steady_bend_needs_what_its_grasp_needs():
    # Far from both ends of a circle floor and lift-off have closed forms: nothing changes along it.
    cable = Cable(1.2, 1.6e-3, 0.032)
    pattern = Pattern(arc(0.064, 7.0, 800), lead_in=0.13, smoothing=1e-4)
    found = pattern.feasibility(cable, 0.5)
    middle = (found.arc_length > 0.3) & (found.arc_length < 0.45)
    np.testing.assert_allclose(found.lift_off[middle], withe.deployment.grasp(20.0, 0.5, 1600.0).friction, atol=0.03)
    pushed = pattern.feasibility(cable, 0.5, "least_friction")
    push = np.linspace(0.0, 0.6, 61)  # of which 3 Lgb of what lies carry a share
    force = withe.deployment.grasp(20.0, 0.5, 1600.0, axial_force=push).force
    needed = np.hypot(force[:, 0] / (force[:, 2] + 3.0), force[:, 1] / force[:, 2])
    np.testing.assert_allclose(pushed.lift_off[middle], needed.min(), atol=0.015)


def test_a_slow_wave_needs_its_second_derivative_of_curvature():
    # Nearly straight, tension helps little: 2 Lgb^3 |kappa''|, the first term of (9.2).
    height, cable = 2e-3, Cable.dlo(2)
    pattern = Pattern(wave(height), smoothing=2e-4)
    found = pattern.feasibility(cable, 0.5)
    middle = slice(60, 240)
    expected = 2 * 0.032**3 * np.abs(pattern.curvature_bend)[middle]
    assert np.corrcoef(found.floor[middle], expected)[0, 1] > 0.9
    assert found.floor[middle].max() == pytest.approx(expected.max(), rel=0.05)


def test_a_bent_free_end_slips_and_is_named():
    pattern = Pattern(arc(0.06, 2.0), smoothing=1e-4)
    found = pattern.feasibility(Cable.dlo(2), 0.4)
    assert not found.feasible
    slip = found.slips[0]
    assert slip.start < 0.005
    assert slip.test in {"free end", "floor"}
    assert slip.needed > 0.4
    assert "mm slips" in str(found)


def test_a_line_needs_nothing():
    found = Pattern([[0.0, 0.0], [0.2, 0.0], [0.5, 0.0]]).feasibility(Cable.dlo(1), 0.1)
    assert found.feasible
    assert found.needed.max() < 1e-3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "exactly one of"),
        ({"points": wave(), "function": wave}, "exactly one of"),
        ({"points": [[0.0, 0.0], [1.0, 0.0]]}, "at least 3, got 2"),
        ({"points": [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]}, "rows 1 and 2 are the same"),
        ({"points": [[0.0, 0.0], [1.0, float("nan")], [2.0, 0.0]]}, "points"),
        ({"points": wave(), "smoothing": 0.0}, "smoothing must be positive"),
        ({"image": np.full((80, 80, 3), 255, np.uint8), "scale": 1e-3}, "image must show a curve"),
        ({"image": np.full((80, 80, 3), 255, np.uint8)}, "needs scale"),
    ],
)
def test_bad_patterns_say_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        Pattern(**arguments)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Cable(0.0, 1e-3, 0.03), "length must be positive"),
        (lambda: Cable(1.0, -1e-3, 0.03), "radius must be positive"),
        (lambda: Cable(800.0, 1.6, 32.0), "1.6 m: are all sizes in metres"),
        (lambda: Cable(1.0, 1e-3, float("nan")), "gravito_bending_length"),
        (lambda: Cable(1e-3, 1e-3, 0.03), "thickness"),
        (lambda: Cable.dlo(6), "number"),
        (lambda: withe.deployment.plan(Cable(0.8, 1.6e-3, 32.0), Pattern(wave())), "32 m, in metres"),
        (
            lambda: withe.deployment.plan(Cable(8.0, 1.6e-3, 0.032), Pattern(wave()), posts=[(0, 0)]),
            "must be withe.dep",
        ),
        (
            lambda: Pattern(wave()).feasibility(Cable(8.0, 1.6e-3, 0.032), 0.4),
            "at most 100 gravito-bending lengths long, got 250",
        ),
        (lambda: measure(height=-1.0), "height must be positive"),
        (lambda: measure(height=36.5), "height must be less than 10 m, got 36.5 m: is it in metres"),
        (lambda: measure(), "exactly one of height and image"),
        (lambda: measure(image=np.zeros((50, 50, 3), np.uint8)), "needs scale"),
        (lambda: measure(image=np.zeros((50, 50, 3), np.uint8), scale=1e-3), "got a uniform image"),
        (lambda: Pattern(wave()).feasibility(Cable.dlo(2), -0.1), "friction"),
        (
            lambda: Pattern(wave()).feasibility(Cable.dlo(2), 40.0),
            "friction must be at most 10, got 40: is it in per cent",
        ),
        (lambda: Pattern(wave()).feasibility(Cable(0.3, 1e-3, 0.03), 0.4), "as long as the pattern, 0.5"),
        (lambda: Pattern(arc(0.03, 3.0)).feasibility(Cable(1.0, 0.04, 0.05), 0.4), "less than the radius of the cable"),
        (lambda: Pattern(arc(0.01, 6.0)).feasibility(Cable(1.0, 2e-3, 0.1), 0.4), "gravito-bending length over 6"),
    ],
)
def test_bad_input_says_what_is_wrong(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_what_lies_behind_a_bend_that_slips_at_lift_off_is_pulled_back_by_the_tail():
    cable = Cable.dlo(2)
    bend = Pattern.bends([1.5], [0.06], [0.12, 0.2])
    needed = bend.feasibility(cable, 5.0).lift_off
    worst = needed[3:-3].max()
    found = bend.feasibility(cable, 0.8 * worst)
    behind = bend.arc_length > bend.arc_length[(needed > 0.8 * worst).nonzero()[0][-1]]
    tail = [slip for slip in found.slips if slip.test == "tail"]
    assert tail[-1].end == bend.length
    assert tail[-1].needed == pytest.approx(worst)
    np.testing.assert_allclose(found.tail[behind], worst)
    assert "tail" not in {slip.test for slip in bend.feasibility(cable, 1.05 * worst).slips}


@pytest.mark.parametrize("points", [[[0, 0], [0.2, 0], [0.1, 0], [0.3, 0]], [[0, 0], [0.2, 0], [0, 0.005]]])
def test_a_pattern_that_turns_back_is_refused(points):
    with pytest.raises(ValueError, match=r"must not turn back on itself, but does at [23]0. mm"):
        Pattern(points)


def test_a_pattern_with_too_few_nodes_for_its_bends_says_so():
    with pytest.warns(UserWarning, match="301 nodes, one every 15.4 mm, are too coarse"):
        Pattern.word("the quick brown fox", 0.05)


@pytest.mark.parametrize("nodes", [50, 51])
def test_what_lies_between_samples_is_missed_aloud(nodes):
    x = np.linspace(0.0, 0.5, 20_001)
    waves = np.stack([x, 0.01 * np.sin(4.0 * np.pi * (nodes - 1) * x)], 1)  # one wave from node to node
    with pytest.warns(UserWarning, match=f"10.0 mm from the given points, .* {nodes} nodes, one every"):
        pattern = Pattern(waves, nodes=nodes)
    assert pattern.deviation == pytest.approx(0.01, rel=1e-3)


def test_a_pattern_of_a_millimetre_is_planned_or_refused_at_once():
    x = np.linspace(0.0, 1e-3, 101)
    pattern = Pattern(np.stack([x, 6e-5 * np.sin(4e3 * np.pi * x)], 1))
    withe.deployment.plan(Cable.dlo(2), pattern)


def test_a_pattern_that_ends_on_its_beginning_is_said_to_lie_on_itself():
    angle = np.linspace(0.0, 2 * np.pi, 300)
    ring = Pattern(0.1 * np.stack([np.sin(angle), 1 - np.cos(angle)], 1))
    found = ring.feasibility(Cable.dlo(2), 1.0)
    assert found.overlap[[0, -1]].all()
    assert not found.overlap[100:200].any()
    assert "lies on another part of the cable" in str(found)


def test_what_is_pushed_aside_drags_the_rest_along_as_a_beam_that_friction_loads():
    angle = np.linspace(0.0, 2 * np.pi, 1500)
    ring, cable, friction = Pattern(0.1 * np.stack([np.sin(angle), 1 - np.cos(angle)], 1)), Cable.dlo(2), 0.5
    found = ring.feasibility(cable, friction)
    last = [slip for slip in found.slips if slip.test == "overlap"][-1]
    here = np.flatnonzero(found.overlap[len(found.overlap) // 2 :])[0] + len(found.overlap) // 2
    reach = found.arc_length[here] - last.start
    # EI d^4y/ds^4 = -load, y = y' = y'' = 0 at s = 0: y = (shear s^3 / 6 - load s^4 / 24) / EI, until its slope is 0.
    load_over_stiffness = friction / (2.0 * cable.gravito_bending_length**3)

    def pushed(reach):
        deflection = load_over_stiffness * np.polynomial.Polynomial([0, 0, 0, reach / 3 / 6, -1 / 24])
        assert deflection.deriv()(reach) == pytest.approx(0.0, abs=1e-12)
        return deflection(reach)

    assert pushed(reach) <= 4.0 * cable.radius < pushed(reach + 1.01 * found.arc_length[1])


@pytest.mark.parametrize("length", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_a_straight_line_stays_where_it_is(length, angle):
    way = np.array([np.cos(angle), np.sin(angle)])
    pattern = withe.deployment.Pattern(np.linspace(0.0, length, 50)[:, None] * way)
    assert pattern.deviation < 1e-7
    assert np.abs(pattern.curvature).max() < 1e-3
