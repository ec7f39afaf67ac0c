"""Gradients of runs with contact in drawn scenes; `random_contacts.py` checks as many as one likes."""

import pytest

from random_contacts import drawn

NUMBERS = range(24)


@pytest.mark.parametrize("number", NUMBERS)
def test_gradients_of_a_drawn_scene_with_contact_are_those_of_differences(number):
    scene = drawn(number)
    if scene is None:
        pytest.skip("this one cannot be drawn or run, or its contacts stiffened")
    errors = scene.errors()
    assert max(errors.values()) < 1e-5, errors
