"""Cables that are laid between posts."""

import numpy as np
import pytest

from withe.deployment import Cable, Pattern, Post, deploy, plan, posts_along
from withe.deployment.placing import passed

CABLE = Cable(0.45, 1.6e-3, 0.03)


@pytest.fixture(scope="module")
def bend():
    return Pattern.bends([1.2], [0.05], [0.08, 0.06], easing=0.05)


def test_bends_turn_as_far_as_is_asked_and_are_as_long():
    turns, radii, straights = [2.0, -1.2], [0.06, 0.08], [0.05, 0.03, 0.07]
    pattern = Pattern.bends(turns, radii, straights, easing=0.04, smoothing=1e-5)
    assert pattern.length == pytest.approx(0.15 + 2.0 * 0.06 + 1.2 * 0.08, abs=2e-5)
    np.testing.assert_allclose(pattern.tangent[-1], [np.cos(0.8), np.sin(0.8)], atol=2e-4)
    assert np.abs(pattern.curvature).max() == pytest.approx(1 / 0.06, rel=0.04)  # smoothing rounds it


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radii": [-0.1]}, "radii must be positive, got -0.1"),
        ({"straights": [0.01, 0.1]}, "at least half of easing, 0.05 m"),
        ({"straights": [0.1]}, "straights must have shape"),
        ({"easing": 0.0}, "easing must be positive"),
    ],
)
def test_bends_that_cannot_be_are_refused(given, message):
    usual = {"turns": [1.0], "radii": [0.1], "straights": [0.1, 0.1], "easing": 0.1}
    with pytest.raises(ValueError, match=message):
        Pattern.bends(**(usual | given))


def test_posts_stand_in_pairs_as_far_from_the_pattern_as_the_gap_says(bend):
    left, right = posts_along(bend, CABLE, [0.5 * bend.length], gap=0.002, radius=0.003)
    middle = np.array([np.interp(0.5 * bend.length, bend.arc_length, bend.points[:, i]) for i in range(2)])
    for post in (left, right):
        assert np.hypot(*(middle - (post.x, post.y))) == pytest.approx(0.002 + 0.003 + CABLE.radius)
    along = np.array([np.interp(0.5 * bend.length, bend.arc_length, bend.tangent[:, i]) for i in range(2)])
    assert along[0] * (left.y - middle[1]) - along[1] * (left.x - middle[0]) > 0.0


def test_a_cable_that_lies_beyond_a_post_or_on_it_has_not_passed_it(bend):
    posts = posts_along(bend, CABLE, [0.03])
    laid = np.column_stack([bend.points, np.full(len(bend.points), CABLE.radius)])
    assert passed(posts, bend, CABLE, laid).all()
    assert passed(posts, bend, CABLE, np.add(laid, (0.0, 0.02, 0.0))).tolist() == [False, True]
    assert not passed(posts, bend, CABLE, np.add(laid, (0.0, 0.0, 0.01))).any()


def test_what_stands_in_the_way_is_refused(bend):
    with pytest.raises(ValueError, match=r"Post\(.*\) is too close to the pattern: the distance is 0.4 mm"):
        plan(CABLE, bend, posts=[Post(0.02, 0.0)])
    with pytest.raises(ValueError, match="height of a post must be at least its radius"):
        Post(0.0, 0.0, radius=0.01, height=0.005)
    with pytest.raises(ValueError, match="at must be from 0 to the pattern's length"):
        posts_along(bend, CABLE, [1.0])


def test_a_bend_without_friction_is_held_by_posts_alone(bend):
    posts = posts_along(bend, CABLE, np.linspace(0.2, 0.95, 5) * bend.length, gap=0.001)
    motion = plan(CABLE, bend, posts=posts)
    free = deploy(plan(CABLE, bend), friction=0.02, quasi_static=True, nodes=70, progress=False)
    held = deploy(motion, friction=0.02, quasi_static=True, nodes=70, progress=False)
    assert held.passed.all()
    assert held.nearest_error < 2e-3 < free.nearest_error
    assert motion.to_dict()["posts"][0] == {"x": posts[0].x, "y": posts[0].y, "radius": 0.004, "height": 0.008}
