"""Bent cantilevers against the elastica, in the plane and in space, with the order at which the mesh converges.

Numbers: [Bisshopp and Drucker 1945] for the tip load; the heavy elastica solved by shooting.
"""

import numpy as np
import pytest

import rods
import theory
import withe
from cases import measured
from convergence import assert_order, assert_order_at_least

EDGES = (40, 80, 160)
SPACES = pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])


def tip(simulation, arm):
    positions, directors = simulation.positions(arm), simulation.directors(arm)
    return -positions[-1, 2], 1.0 - positions[-1, 0], np.arctan2(-directors[-1, 2, 2], directors[-1, 2, 0])


def tip_loaded(load, edges, planar):
    scene = rods.weightless()
    arm = rods.straight(scene, edges)
    scene.clamp(arm.start)
    scene.add_force(arm.end, (0.0, 0.0, -load))
    simulation = rods.sharp(scene, planar=planar)
    assert simulation.equilibrium().stable
    return tip(simulation, arm)


@pytest.mark.parametrize(
    ("load", "down", "inward", "degrees"), [(1.0, 0.30172, 0.05643, 26.4335), (5.0, 0.71379, 0.38763, 69.636)]
)
def test_theory_of_a_tip_load_is_that_of_bisshopp_and_drucker(load, down, inward, degrees):
    exact = theory.tip_loaded(load)
    assert exact.down == pytest.approx(down, abs=6e-6)
    assert exact.inward == pytest.approx(inward, abs=6e-6)
    assert np.degrees(exact.tip_angle) == pytest.approx(degrees, abs=6e-4)


@pytest.mark.parametrize(("weight", "down", "inward"), [(1.0, 0.12347, 0.00875), (10.0, 0.70020, 0.34365)])
def test_theory_of_self_weight_is_the_tabulated_one(weight, down, inward):
    exact = theory.self_weight(weight)
    assert exact.down == pytest.approx(down, abs=6e-6)
    assert exact.inward == pytest.approx(inward, abs=6e-6)


@pytest.mark.case(
    "statics", "Tip of a cantilever under a load at its tip", source="elastica [Bisshopp and Drucker 1945]"
)
@SPACES
@pytest.mark.parametrize("load", [1.0, 5.0])
def test_tip_loaded_cantilever_converges_at_second_order(load, planar):
    exact = theory.tip_loaded(load)
    errors = np.array([tip_loaded(load, n, planar) for n in EDGES]) - (exact.down, exact.inward, exact.tip_angle)
    # All three together: a single one may pass through zero.
    measured(errors[-1], "L")
    assert_order(np.linalg.norm(errors, axis=1))
    assert np.all(np.abs(errors[-1]) < 3e-5)


@pytest.mark.case("statics", "Tip of a cantilever under its own weight", source="elastica, solved by shooting")
@SPACES
@pytest.mark.parametrize("weight", [1.0, 10.0])
def test_tip_of_a_self_weight_cantilever_converges_at_second_order_or_better(weight, planar):
    exact = theory.self_weight(weight)
    errors = []
    for edges in EDGES:
        simulation, arm = rods.heavy_cantilever(weight, edges, planar=planar)
        assert simulation.equilibrium().stable
        errors.append(np.subtract(tip(simulation, arm), (exact.down, exact.inward, exact.tip_angle)))
    measured(errors[-1], "L")
    assert_order_at_least(np.linalg.norm(errors, axis=1), order=2.0)
    assert np.all(np.abs(errors[-1]) < {1.0: 3e-7, 10.0: 1e-5}[weight])


@pytest.mark.case("statics", "Sag of a cantilever under a small weight", source="w L^4 / (8 EI)")
def test_small_self_weight_sinks_by_an_eighth_of_it():
    errors = []
    for edges in EDGES:
        simulation, arm = rods.heavy_cantilever(1e-4, edges)
        simulation.equilibrium()
        errors.append(tip(simulation, arm)[0] / (1e-4 / 8.0) - 1.0)
    measured(errors[-1])
    assert_order(errors, order=3.0)
    assert abs(errors[-1]) < 1e-6


@SPACES
@pytest.mark.parametrize("edges", [1000, 3000, 5000])
def test_small_self_weight_sinks_by_an_eighth_of_it_on_the_finest_meshes(edges, planar):
    """The whole weight of a node may be less than the bound of what rounding leaves of its row."""
    scene = withe.Scene(gravity=(0.0, 0.0, -1e-3))
    arm = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=4e5))
    scene.clamp(arm.start)
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    assert tip(simulation, arm)[0] == pytest.approx(1e-3 / 8.0, rel=2e-6)


@pytest.mark.case("statics", "Force and moment of a clamp", source="balance of forces and moments")
def test_support_of_a_cantilever_carries_its_load_exactly():
    scene = rods.weightless()
    arm = rods.straight(scene, 40, stiffness=rods.stiffness(stretch=1e4))
    wall = scene.clamp(arm.start)
    scene.add_force(arm.end, (0.0, 0.0, -5.0))
    simulation = rods.sharp(scene)
    simulation.equilibrium()
    reaction = simulation.reaction(wall)
    arm_of_lever = simulation.positions(arm)[-1]
    np.testing.assert_allclose(reaction.force, (0.0, 0.0, 5.0), atol=1e-8)
    np.testing.assert_allclose(reaction.moment, -np.cross(arm_of_lever, (0.0, 0.0, -5.0)), atol=1e-8)


# Heavy strip clamped level, its length in units of (B / 2w)^(1/3), and the drop of its end over the length.
HEAVY_STRIP = {0.5: 0.0078, 1.0: 0.0623, 2.0: 0.4252, 3.0: 0.7666, 4.0: 0.8785, 6.0: 0.9401, 10.0: 0.9731}


@pytest.mark.case("statics", "Drop of a heavy strip, seven lengths", source="tabulated elastica, four decimals")
@pytest.mark.parametrize("length", HEAVY_STRIP)
def test_end_of_a_heavy_strip_drops_as_tabulated(length):
    simulation, arm = rods.heavy_cantilever(0.5 * length**3, 400)
    assert simulation.equilibrium().stable
    measured(tip(simulation, arm)[0] - HEAVY_STRIP[length], "L")
    assert tip(simulation, arm)[0] == pytest.approx(HEAVY_STRIP[length], abs=6e-5)


@pytest.mark.case("statics", "Tip of a heavy strip", source="elastica, solved by shooting")
def test_heavy_strip_converges_at_second_order():
    exact = theory.self_weight(0.5 * 3.0**3)
    errors = []
    for edges in EDGES:
        simulation, arm = rods.heavy_cantilever(0.5 * 3.0**3, edges)
        simulation.equilibrium()
        errors.append(np.subtract(tip(simulation, arm), (exact.down, exact.inward, exact.tip_angle)))
    measured(errors[-1], "L")
    assert_order(np.linalg.norm(errors, axis=1))
