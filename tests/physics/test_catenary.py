"""A soft rope between two pins hangs as a catenary."""

import numpy as np
import pytest

import rods
import withe
from cases import measured
from convergence import assert_order

# z = a cosh(x / a) with a = 1 between x = -1 and 1: length 2 sinh 1.
HALF = np.sinh(1.0)


def hanging(edges, bend, weight=1.0):
    """Middle and ends of a rope that starts as a V with the same length."""
    depth = np.sqrt(HALF**2 - 1.0)
    s = np.linspace(-1.0, 1.0, edges + 1)
    points = np.stack([s, np.zeros(edges + 1), depth * (np.abs(s) - 1.0)], axis=1)
    scene = withe.Scene(gravity=(0.0, 0.0, -weight))
    rope = scene.add_rod(
        points=points,
        natural="straight",
        radius=1e-3,
        line_density=1.0,
        stiffness=rods.stiffness(bend=bend, stretch=1e7),
    )
    left, right = scene.pin(rope.start), scene.pin(rope.end)
    simulation = scene.build(integrator="static", solver=withe.Solver(force_tolerance=1e-11))
    assert simulation.equilibrium().stable
    return simulation, rope, left, right


@pytest.mark.case("statics", "Sag of a soft rope", source="catenary")
def test_soft_rope_converges_to_the_catenary_at_second_order():
    errors = []
    for edges in (16, 32, 64):
        simulation, rope, *_ = hanging(edges, 1e-9)
        sag = -simulation.positions(rope)[edges // 2, 2]
        errors.append(sag - (np.cosh(1.0) - 1.0))
    measured(errors[-1] / (np.cosh(1.0) - 1.0))
    assert_order(errors)
    assert abs(errors[-1]) < 1e-3


def test_every_node_of_a_soft_rope_lies_on_the_catenary():
    simulation, rope, *_ = hanging(128, 1e-9)
    x, _, z = simulation.positions(rope).T
    np.testing.assert_allclose(z, np.cosh(x) - np.cosh(1.0), atol=2e-4)


@pytest.mark.case("statics", "Forces of a soft rope on its pins", source="catenary")
def test_pins_of_a_rope_carry_its_weight_and_the_horizontal_pull_of_the_catenary():
    simulation, _, left, right = hanging(128, 1e-9)
    np.testing.assert_allclose(simulation.reaction(left).force, (-1.0, 0.0, HALF), rtol=5e-4, atol=1e-8)
    np.testing.assert_allclose(simulation.reaction(right).force, (1.0, 0.0, HALF), rtol=5e-4, atol=1e-8)


def test_bending_stiffness_lifts_a_rope_in_proportion_as_it_vanishes():
    softer, soft = (-hanging(256, bend)[0].positions()[128, 2] for bend in (1e-5, 2e-5))
    limit = -hanging(256, 1e-9)[0].positions()[128, 2]
    np.testing.assert_allclose((limit - soft) / (limit - softer), 2.0, rtol=0.03)
