"""The free loop of a heavy strip that is folded back onto itself: level and without moment at both ends.

Lengths in units of Lgb = (B / 2w)^(1/3). Clamps hold a strip of the loop's length level where the loop lifts off and
where it comes down; then they must have nothing to do but lift. (Were the upper one free to slide, the loop could
roll along at no cost, and nothing would hold it.)
"""

import numpy as np
import pytest

import rods
import theory
from cases import measured
from convergence import assert_order_at_least

LOOP = theory.fold_loop()


def test_theory_of_the_loop_is_the_tabulated_one():
    assert LOOP.length == pytest.approx(5.9008, abs=5e-5)
    assert LOOP.height == pytest.approx(1.1422, abs=5e-5)
    assert LOOP.greatest_curvature == pytest.approx(2.011, abs=5e-4)
    assert LOOP.pull == pytest.approx(0.0, abs=1e-8)


def held_loop(edges):
    """A strip of unit length and stiffness, drawn as the loop, with its ends where the loop's are."""
    weight = 0.5 * LOOP.length**3
    tangents = LOOP.tangents(edges) / edges
    scene = rods.weightless()
    scene.gravity = (0.0, 0.0, -weight)
    strip = scene.add_rod(
        points=np.vstack([np.zeros(3), np.cumsum(tangents, axis=0)]),
        natural="straight",
        normal=(0.0, 1.0, 0.0),
        stiffness=rods.stiffness(),
        line_density=1.0,
        radius=1e-3,
    )
    scene.clamp(strip.start)
    scene.clamp(strip.end)
    simulation = rods.sharp(scene, planar=True)  # a strip as stiff across as this one would fall over
    simulation.move(strip.start, tangent=(1.0, 0.0, 0.0))
    simulation.move(strip.end, position=(LOOP.end / LOOP.length, 0.0, 0.0), tangent=(-1.0, 0.0, 0.0))
    simulation.step()
    assert simulation.equilibrium().stable
    return simulation, strip, weight


def peak(values):
    """The top of the parabola through the greatest of the values and its neighbours."""
    i = int(np.argmax(values))
    square, slope, top = np.polyfit((-1.0, 0.0, 1.0), values[i - 1 : i + 2], 2)
    return top - slope**2 / (4.0 * square)


@pytest.mark.case(
    "statics", "Free loop of a folded heavy strip: shape and lift-off", source="elastica, solved by shooting"
)
def test_free_fold_loop_converges_at_second_order_or_better():
    """Errors of height, greatest curvature and lift-off force; horizontal force and moments at the ends, all zero."""
    errors = []
    for edges in (100, 200, 400):
        simulation, strip, weight = held_loop(edges)
        height = peak(simulation.positions(strip)[:, 2]) * LOOP.length
        curvature = peak(np.linalg.norm(simulation.curvatures(strip), axis=1)) / LOOP.length
        start, end = simulation.reaction(strip.start), simulation.reaction(strip.end)
        pull, _, lift = start.force / weight * LOOP.length
        moments = np.array((start.moment[1], end.moment[1])) / LOOP.length
        sizes = (height / LOOP.height, curvature / LOOP.greatest_curvature, lift / LOOP.lift)
        errors.append([*np.subtract(sizes, 1.0), pull, *moments])
    measured(errors[-1])
    for error in np.transpose(errors):
        assert_order_at_least(error, order=2.0)
    assert np.all(np.abs(errors[-2]) < (5e-4, 1e-3, 3e-4, 6e-4, 2e-3, 1e-3)), errors[-2]
