"""Papers, and how stiff they are: strips that hang from a clamp, against beam theory, a table and a rod."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.folding import Paper, droop, measure

STRIPS = np.genfromtxt(
    Path(__file__).resolve().parent.parent / "data" / "hanging_strips.csv", delimiter=",", names=True
)


@pytest.mark.case("planners", "Droop of a hanging strip", source="table, six decimals")
def test_every_strip_of_the_table_droops_so():
    rows = STRIPS[(STRIPS["lbar_l_over_Lgb"] > 0.3) & (STRIPS["lbar_l_over_Lgb"] < 20)]
    found = [droop(length) / length for length in rows["lbar_l_over_Lgb"]]
    np.testing.assert_allclose(found, rows["epsilon_lh_over_l"], atol=1e-6)


@pytest.mark.case("planners", "Droop of a short strip", source="L^4 / 16")
def test_a_short_strip_droops_by_linear_theory():
    assert droop(0.1) == pytest.approx(0.1**4 / 16, rel=1e-5)  # w l^4 / 8 EI with EI = 2 w Lgb^3


STIFFNESS, WEIGHT = 3e-5, 0.5  # [N m^2], [N/m]
LGB = (STIFFNESS / (2 * WEIGHT)) ** (1 / 3)


def drop_of_rod(length, curl=0.0):
    """Drop of the tip of a rod with a natural curvature `curl` [1/m], extrapolated from two meshes."""
    drops = []
    for nodes in (81, 161):
        scene = withe.Scene(gravity=(0, 0, -9.81))
        strip = scene.add_rod(
            start=(0, 0, 0),
            end=(length, 0, 0),
            nodes=nodes,
            radius=1e-3,
            stiffness=withe.Stiffness(stretch=1e3, bend=STIFFNESS, twist=STIFFNESS),
            line_density=WEIGHT / 9.81,
        )
        scene.clamp(strip.start)
        simulation = scene.build(planar=True)
        simulation.set(strip, natural_curvature=(0.0, curl))
        simulation.equilibrium()
        drops.append(-simulation.positions(strip)[-1, 2])
    return (4 * drops[1] - drops[0]) / 3


@pytest.mark.case("planners", "Droop of a strip in the rod engine", source="elastica")
def test_a_rod_of_many_nodes_droops_as_a_strip():
    assert drop_of_rod(2 * LGB) == pytest.approx(LGB * droop(2.0), rel=1e-4)


@pytest.mark.parametrize("strip", [1.6, 2.0, 2.9])
def test_what_droops_is_measured(strip):
    lgb = 0.05
    found = measure(length=strip * lgb, drop=lgb * droop(strip))
    assert found.gravito_bending_length == pytest.approx(lgb, rel=1e-8)
    assert found.strip == pytest.approx(strip, rel=1e-8)


def test_the_error_is_that_of_drawn_readings():
    random = np.random.default_rng(5)
    error = 2e-4
    exact = measure(length=0.1, drop=0.043, error=error)
    drawn = [
        measure(length=0.1 + error * a, drop=0.043 + error * b).gravito_bending_length
        for a, b in random.normal(size=(30, 2))
    ]
    assert np.std(drawn) == pytest.approx(exact.error, rel=0.3)


def test_a_strip_that_curls_is_measured_from_both_of_its_sides():
    curl, length = 0.8, 0.06  # [1/m], [m]
    one, other = sorted((drop_of_rod(length, sign * curl) for sign in (1.0, -1.0)), reverse=True)
    found = measure(length=length, drop=one, turned=other)
    assert found.gravito_bending_length == pytest.approx(LGB, rel=2e-4)
    assert found.curl == pytest.approx(curl, rel=2e-3)
    assert measure(length=length, drop=one).gravito_bending_length != pytest.approx(LGB, rel=0.01)


def test_two_readings_of_a_strip_that_does_not_curl_say_what_one_says_with_less_error():
    once = measure(length=0.1, drop=0.043)
    twice = measure(length=0.1, drop=0.043, turned=0.043)
    assert twice.gravito_bending_length == pytest.approx(once.gravito_bending_length, rel=1e-8)
    assert twice.curl == pytest.approx(0.0, abs=1e-8)
    assert once.error / np.sqrt(2.0) < twice.error < once.error  # the length is read once


def test_strips_that_say_little_are_named():
    with pytest.warns(UserWarning, match="measure a strip of 75 to 150 mm"):
        measure(length=0.05, drop=0.05 * droop(1.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measure(length=0.1, drop=0.05 * droop(2.0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"length": 0.0, "drop": 0.1}, "length must be positive"),
        ({"length": 100, "drop": 30}, "length must be less than 10 m, got 100 m: are all sizes in metres"),
        ({"length": 0.1, "drop": 0.2}, "does not determine Lgb"),
        ({"length": 0.1, "drop": -0.1}, "drop must be positive"),
        ({"length": 0.1, "drop": 0.04, "error": -1.0}, "error must not be negative"),
        ({"length": 0.1, "drop": 0.04, "turned": 0.2}, "turned does not determine Lgb at 2 of length"),
        ({"length": 0.1, "drop": 0.09, "turned": 0.001}, "a reading of the same strip"),
    ],
)
def test_readings_that_cannot_be_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        measure(**arguments)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ((297, 210, 48), "length must be at most 20 m, got 297 m: are all sizes in metres"),
        ((0.297, 210, 0.048), "width must be at most 20 m, got 210 m: are all sizes in metres"),
        ((0.297, 0.21, 48), "gravito_bending_length must be at most 10 lengths, got 48 m: are all sizes in metres"),
        ((0.297, 0.21, 0.048, 0.12, 0.1), "thickness must be at most a tenth of the length of 0.297 m, got 0.1 m"),
    ],
)
def test_sizes_in_millimetres_are_refused(sizes, message):
    with pytest.raises(ValueError, match=message):
        Paper(*sizes)
    assert Paper(19.0, 19.0, 19.0, thickness=1.0).length == 19.0


def test_papers_are_as_published():
    sizes = {"a4": 0.048, "us_letter": 0.060, "cardboard": 0.132}
    assert {name: getattr(Paper, name)().gravito_bending_length for name in sizes} == sizes
    assert Paper.a4().length > Paper.a4().width
    with pytest.raises(ValueError, match="width must be positive"):
        Paper(0.3, 0.0, 0.05)
    for friction in (-0.1, 0.0):
        with pytest.raises(ValueError, match="friction must be positive"):
            Paper(0.3, 0.2, 0.05, friction=friction)
