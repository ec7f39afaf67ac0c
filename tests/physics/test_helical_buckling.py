"""Localised buckling of a long twisted rod into a helix under its envelope [van der Heijden and Thompson 2000]."""

import numpy as np
import pytest

import rods
from cases import measured
from convergence import assert_order

# x = M L / B and y = T L^2 / B; slack d = sqrt(16 / y (1 - x^2 / 4y)), turns R = x B / C + 4 acos(x / (2 sqrt y)).
# Both ends clamped, B = 1.345, C = 0.789, L = 100, slack 3, 27 turns: the root of the two equations.
BEND, TWIST, SLACK, TURNS = 1.345, 0.789, 0.03, 27.0
MOMENT, TENSION = 98.541496, 2900.9932
STRETCH = 1e8


def wound_up(edges, bending):
    """Rod of unit length and B: wound 27 turns while held taut, then let in until it is slack by 3 %."""
    scene = rods.weightless()
    rod = rods.straight(
        scene, edges, stiffness=rods.stiffness(twist=TWIST / BEND, stretch=STRETCH), normal=(0.0, 1.0, 0.0)
    )
    scene.clamp(rod.start)
    grip = scene.clamp(rod.end)
    nudge = scene.add_force(rod.node(edges // 2), (0.0, 0.0, 0.0))
    simulation = scene.build(integrator="static", time_step=0.01, planar=False, bending=bending)
    taut, slack = 1.0 + 4000.0 / STRETCH, 1.0 + TENSION / STRETCH - SLACK

    def path(time):
        wind, let_in = min(time, 1.0), min(max(time - 1.0, 0.0), 1.0)
        return (taut + let_in * (slack - taut), 0.0, 0.0), rods.rotation((1, 0, 0), 2.0 * np.pi * TURNS * wind)

    simulation.move(rod.end, path=path)
    simulation.step(100)
    simulation.set(nudge, force=(0.0, 0.1, 0.0))
    simulation.step(50)
    simulation.set(nudge, force=(0.0, 0.0, 0.0))
    simulation.step(50)
    result = simulation.equilibrium()
    return simulation, rod, grip, result


def test_numbers_solve_the_two_equations():
    root = MOMENT / (2.0 * np.sqrt(TENSION))
    assert np.sqrt(16.0 / TENSION * (1.0 - root**2)) == pytest.approx(SLACK, rel=1e-6)
    assert MOMENT * BEND / TWIST + 4.0 * np.arccos(root) == pytest.approx(2.0 * np.pi * TURNS, rel=1e-7)


@pytest.mark.case("stability", "Moment and tension of a localised helix", source="[van der Heijden and Thompson 2000]")
@pytest.mark.parametrize(
    ("bending", "bounds"), [("tangent", (1e-5, 8e-4)), pytest.param("angle", (2.5e-5, 1.5e-3), marks=pytest.mark.slow)]
)
def test_moment_and_tension_of_a_localised_helix_converge_at_second_order(bending, bounds):
    """Either measure of bending; edges longer than the chords of the helix and 2 tan(phi / 2) partly make up for each
    other here."""
    errors = []
    for edges in (400, 800, 1600):
        simulation, rod, grip, result = wound_up(edges, bending)
        assert result.stable
        reaction = simulation.reaction(grip)
        errors.append((reaction.moment[0] / MOMENT - 1.0, reaction.force[0] / TENSION - 1.0))
        # Localised: the middle swings out, the quarters hardly do.
        sway = np.linalg.norm(simulation.positions(rod)[:, 1:], axis=1)
        assert sway.max() > 20.0 * max(sway[edges // 8], sway[-edges // 8])
    errors = np.array(errors)
    for column in errors.T:
        assert_order(column, slack=0.25)
    measured(errors[-1])
    assert np.all(np.abs(errors[-1]) < bounds)
    # The tension is the more sensitive of the two; without the error of second order it is right to 1e-3 too.
    assert np.all(np.abs((4.0 * errors[-1] - errors[-2]) / 3.0) < (1e-4, 1e-3))
