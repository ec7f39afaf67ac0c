"""Knots told apart by their Alexander polynomial and signature: against tables, from all sides, bent and moved."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from withe import knots
from withe.common import diagrams


def torus(p, q, count=300):
    t = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    r = 2.0 + np.cos(q * t)
    return np.stack([r * np.cos(p * t), r * np.sin(p * t), -np.sin(q * t)], 1)


def figure_eight(count=300):
    t = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    r = 2.0 + np.cos(2.0 * t)
    return np.stack([r * np.cos(3.0 * t), r * np.sin(3.0 * t), np.sin(4.0 * t)], 1)


# Published polynomials and signatures [Rolfsen 1976]; torus knots of positive numbers are right-handed.
TABLE = {
    "unknot": (torus(1, 0), [1], 0),
    "an unknot that winds": (torus(1, 7), [1], 0),
    "trefoil": (torus(2, 3), [1, -1, 1], -2),
    "trefoil, the other way": (torus(3, 2), [1, -1, 1], -2),
    "figure eight": (figure_eight(), [-1, 3, -1], 0),
    "5_1": (torus(2, 5), [1, -1, 1, -1, 1], -4),
    "8_19": (torus(3, 4), [1, -1, 0, 1, 0, -1, 1], -6),
    "10_124": (torus(3, 5), [1, -1, 0, 1, -1, 1, 0, -1, 1], -8),
}


@pytest.mark.case("knots", "Alexander polynomial and signature of tabulated knots", source="knot tables", exact=True)
@pytest.mark.parametrize("name", TABLE)
def test_polynomial_and_signature_are_those_of_the_tables_from_every_side(name):
    points, polynomial, signature = TABLE[name]
    random = np.random.default_rng(3)
    for _ in range(8):
        axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
        seen = diagrams._seen(points @ axes * [1.0, 1.0, np.sign(np.linalg.det(axes))])
        assert diagrams.alexander(seen).tolist() == polynomial
        assert diagrams.signature(seen) == signature
    assert knots.alexander_polynomial(points, closed=True).tolist() == polynomial
    assert knots.signature(points, closed=True) == signature


def test_a_mirror_keeps_the_polynomial_and_turns_the_signature():
    for points, polynomial, signature in TABLE.values():
        mirrored = diagrams._seen(points * [1.0, 1.0, -1.0])
        assert diagrams.alexander(mirrored).tolist() == polynomial
        assert diagrams.signature(mirrored) == -signature


def test_reef_and_granny_differ_by_the_signature_alone():
    reef, granny = knots.reef_knot(), knots.granny_knot()
    assert knots.alexander_polynomial(reef).tolist() == [1, -2, 3, -2, 1]  # that of a trefoil, squared
    assert knots.alexander_polynomial(granny).tolist() == [1, -2, 3, -2, 1]
    assert knots.signature(reef) == 0
    assert abs(knots.signature(granny)) == 4


@pytest.mark.parametrize("n", [1, 2, 3])
def test_open_overhand_knots_are_torus_knots(n):
    points = knots.overhand_knot(n)
    assert knots.alexander_polynomial(points).tolist() == [(-1) ** k for k in range(2 * n + 1)]
    assert abs(knots.signature(points)) == 2 * n


DRAWN = {  # polynomial and signature
    "trefoil": (knots.overhand_knot, [1, -1, 1], -2),
    "7_1": (lambda **options: knots.overhand_knot(3, **options), [1, -1, 1, -1, 1, -1, 1], -6),
    "reef": (knots.reef_knot, [1, -2, 3, -2, 1], 0),
    "granny": (lambda **options: knots.granny_knot(tails="sideways", **options), [1, -2, 3, -2, 1], -4),
}


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize(("length", "radius"), [(1.0, 2e-3), (0.7, 4e-4)])
def test_knots_are_what_they_are_called_or_are_refused_however_few_their_nodes(name, length, radius):
    draw, polynomial, signature = DRAWN[name]
    least = int(np.ceil(length / (9.0 * radius))) + 1  # edges of 9 radii
    for nodes in (None, least, least + 7):
        points = draw(length=length, radius=radius, nodes=nodes)
        assert knots.alexander_polynomial(points).tolist() == polynomial
        assert knots.signature(points) == signature
        assert nearest_strands(points, 14.0 * radius) > 2.0 * radius
    with pytest.raises(ValueError, match=f"nodes must be at least {least} for a knot in {length:g} m of radius"):
        draw(length=length, radius=radius, nodes=least - 1)


def nearest_strands(points, apart):
    """Least distance of points of a polygon that are farther from each other along it."""
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    dense = np.linspace(0.0, s[-1], 4 * int(s[-1] / (0.1 * apart)))
    x = np.stack([np.interp(dense, s, points[:, k]) for k in range(3)], 1)
    pairs = cKDTree(x).query_pairs(0.5 * apart, output_type="ndarray")
    far = pairs[np.abs(np.diff(dense[pairs], axis=1)[:, 0]) > apart]
    return np.linalg.norm(np.diff(x[far], axis=1), axis=-1).min()


def test_a_knot_of_many_turns_has_the_nodes_it_takes():
    points = knots.overhand_knot(50)
    assert len(points) > 301
    assert knots.signature(points) == -100


def test_a_curve_that_is_laid_down_from_its_end_is_no_knot():
    # Each strand lies on those before: a descending diagram.
    s = np.linspace(0.0, 4.0 * np.pi, 400)
    laid = np.stack([np.sin(2 * s), np.cos(3 * s + 0.4) + 0.1 * s, 1e-3 * s], 1)
    assert len(diagrams._seen(laid).sign) > 2
    assert knots.alexander_polynomial(laid).tolist() == [1]
    assert knots.signature(laid) == 0


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((3, 3)), "points must have at least 4"),
        (np.zeros((5, 2)), "points"),
        (np.full((5, 3), np.nan), "points"),
    ],
)
def test_bad_input_says_what_is_wrong(points, message):
    for function in (knots.alexander_polynomial, knots.signature):
        with pytest.raises(ValueError, match=message):
            function(points)


@pytest.mark.parametrize("apart", [0.0, 1e-16])
def test_closed_curves_may_have_their_first_point_repeated_at_the_end(apart):
    random = np.random.default_rng(4)
    closing = np.linspace(0.0, 2.0 * np.pi, 41)
    circle = np.stack([np.cos(closing), np.sin(closing), 0.0 * closing], axis=1)
    for _ in range(20):
        axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
        turned = circle @ axes.T
        turned[-1] = turned[0] + apart * random.normal(size=3)
        assert abs(knots.writhe(turned, closed=True)) < 1e-6
    polygon = random.normal(size=(14, 3))
    repeated = np.concatenate([polygon, polygon[:1] + apart])
    np.testing.assert_allclose(knots.writhe(repeated, closed=True), knots.writhe(polygon, closed=True), atol=1e-9)
    assert knots.signature(repeated, closed=True) == knots.signature(polygon, closed=True)
    np.testing.assert_array_equal(*(knots.alexander_polynomial(x, closed=True) for x in (repeated, polygon)))
    edges = np.roll(polygon, -1, axis=0) - polygon
    frames = np.stack([np.linalg.qr(np.stack([edge, *np.eye(3)[:2]], axis=1))[0].T for edge in edges])[:, [1, 2, 0]]
    np.testing.assert_allclose(knots.link(repeated, frames, True), knots.link(polygon, frames, True), atol=1e-9)
    middle = 0.5 * (polygon[:1] + polygon[1:2])
    elsewhere = np.concatenate([middle, polygon[1:], polygon[:1], middle])
    for view in random.normal(size=(20, 3)):
        assert knots.signed_crossings(repeated, view) == knots.signed_crossings(elsewhere, view)


def test_points_that_repeat_change_nothing_and_too_few_are_refused():
    curve = knots.overhand_knot(nodes=80)
    repeated = np.concatenate([curve[:1], curve, curve[-1:]])
    assert knots.writhe(repeated) == knots.writhe(curve)
    assert knots.signature(repeated) == knots.signature(curve)
    with pytest.raises(ValueError, match="at least 3 different rows"):
        knots.writhe(curve[:1])
