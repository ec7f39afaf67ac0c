"""Cables that are laid and then picked and placed."""

import numpy as np
import pytest

from withe.deployment import Cable, Move, Pattern, plan, tie

CABLE = Cable(0.2, 2e-3, 0.02)


def line(y=0.0):
    return plan(CABLE, Pattern([[0.0, y], [0.05, y], [0.1, y]]), speed=0.1, tail=0.05)


@pytest.fixture(scope="module")
def carried():
    """The free end is taken up and put down beside where it lay; time steps of 20 ms."""
    return tie(
        [line()], [[Move(0, 0.0, [(0.0, 0.03, 0.03), (0.0, 0.06, 0.001)])]], friction=0.8, nodes=40, time_step=0.02
    )


def test_a_cable_is_laid_and_its_end_put_where_it_was_asked_for(carried):
    assert carried.names == ("laid 0", "step 0")
    assert carried.missed == ()
    before, after = (shapes[0] for shapes in carried.shapes)
    assert np.abs(before[before[:, 0] < 0.1, 1]).max() < 1e-3
    np.testing.assert_allclose(carried.picks[0][0], before[0], atol=1e-12)
    # It springs a little when it is let go.
    assert after[0, 1] == pytest.approx(0.06, abs=0.01)
    length = before[-1, 0] - before[0, 0]
    dragged = length - np.sqrt(length**2 - 0.06**2)  # a straight cable would drag its other end by so much
    assert before[-1, 0] - after[-1, 0] == pytest.approx(dragged, abs=0.006)
    assert after[:, 2].max() < 2 * CABLE.radius


def test_the_record_of_a_tying_begins_hanging_and_ends_at_rest(carried):
    record = carried.record
    assert [rod.name for rod in record.rods] == ["cable 0"]
    assert [obstacle.kind for obstacle in record.obstacles] == ["plane"]
    positions = record.positions("cable 0")
    assert np.ptp(positions[0, :, 2]) > 0.15  # it hangs at first
    np.testing.assert_array_equal(positions[-1], carried.centrelines[0])
    assert np.diff(record.times).max() < 0.13
    assert np.diff(record.times).min() > 0.0


def test_a_gripper_that_reaches_to_where_the_cable_is_not_moves_nothing(carried):
    laid = carried.shapes[0][0]
    move = Move(0, 0.0, [(0.0, 0.03, 0.03)])
    found = tie([line()], [[move]], friction=0.8, nodes=40, time_step=0.02, picks=[[laid[0] + (0.0, 0.02, 0.0)]])
    assert found.missed == ((0, 0),)
    np.testing.assert_allclose(found.centrelines[0], laid, atol=1e-5)


def test_a_later_cable_is_laid_over_an_earlier_one():
    x = np.linspace(0.0, 0.1, 20)
    across = plan(CABLE, Pattern(np.stack([0.05 + 0 * x, x - 0.05], 1)), speed=0.1, tail=0.05)
    found = tie([line(), across], [], friction=0.8, nodes=40, time_step=0.02)
    first, second = found.centrelines
    over = second[np.abs(second[:, 1]).argmin(), 2] - first[np.abs(first[:, 0] - 0.05).argmin(), 2]
    assert over == pytest.approx(2 * CABLE.radius, rel=0.2)


@pytest.mark.parametrize(
    ("plans", "steps", "message"),
    [
        (0, [], "plans must be one or more"),
        (1, [[Move(1, 0.0, [(0, 0, 1)])]], "cable of step 0 must be less than 1, got 1"),
        (1, [[Move(0, 0.3, [(0, 0, 1)])]], "step 0 must hold cable 0 at most at 0.15"),
        (1, [[Move(0, 0.0, [(0, 0, 1)]), Move(0, 0.1, [(0, 0, 1), (0, 0, 0)])]], "must have the same number of legs"),
    ],
)
def test_bad_steps_are_named(plans, steps, message):
    with pytest.raises(ValueError, match=message):
        tie([line()] * plans, steps, friction=0.5)


def test_what_is_no_list_of_plans_or_moves_is_named():
    for plans, steps, message in (
        (line(), [], "plans must be one or more"),
        ([line()], [Move(0, 0.0, [(0, 0, 1)])], "step 0 must be a list of simultaneous moves"),
        ([line()], [[(0, 0.0, [(0, 0, 1)])]], "step 0 must hold withe.deployment.Move"),
    ):
        with pytest.raises(ValueError, match=message):
            tie(plans, steps, friction=0.5)


def test_bad_moves_and_picks_are_named():
    with pytest.raises(ValueError, match="by of a move must have shape"):
        Move(0, 0.0, [1.0, 2.0])
    with pytest.raises(ValueError, match="turn of a move must have shape"):
        Move(0, 0.0, [(0, 0, 1)], [0.0, 1.0])
    with pytest.raises(ValueError, match="at of a move must not be negative"):
        Move(0, -0.1, [(0, 0, 1)])
    with pytest.raises(ValueError, match="picks must be one for each move"):
        tie([line()], [[Move(0, 0.0, [(0, 0, 1)])]], friction=0.5, picks=[[]])
    with pytest.raises(ValueError, match="friction must be positive"):
        tie([line()], [[Move(0, 0.0, [(0, 0, 1)])]], friction=0.0)
