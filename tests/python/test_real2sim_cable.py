"""A cable that a gripper drops is found from how it swings: where it was held, its stiffness and its damping."""

import pytest

from dropped_cable import DELAY, GUESS, NOISE, TIMES, TRUTH, UNKNOWNS, distances, held, lift, lines_seen, shapes_at
from dropped_cable import true_shapes as truth
from withe.real2sim import fit_motion


def test_a_dropped_cable_is_found_from_noisy_pictures():
    exact = truth(TIMES + DELAY)
    start = held(21, 4e-3, **GUESS)
    found = fit_motion(start, lines_seen(exact, NOISE, seed=0), UNKNOWNS, begin=lift, progress=False)
    assert found.converged.all()
    assert found.unobservable == ()
    for word, value in TRUTH.items():
        assert found.value("cable", word)[0] == pytest.approx([value], rel=1e-2 if word == "youngs_modulus" else 5e-2)
    assert found.value("delay")[0] == pytest.approx([DELAY], abs=1e-3)
    found.apply(start)
    lift(start)
    assert distances(shapes_at(start, TIMES + DELAY), exact).mean() < 1e-3
    assert found.solves[0] <= 50
