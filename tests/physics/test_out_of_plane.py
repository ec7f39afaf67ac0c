"""Scenes that lie in a plane and buckle out of it: their equilibria leave the plane at the loads of the literature."""

import numpy as np
import pytest

import rods
import theory

STRONG = 400.0  # stiffness in the plane of x and z, over the one across


def strip(load, **build):
    """A deep cantilever along x, loaded downwards at its end."""
    scene = rods.weightless()
    rod = rods.straight(scene, 40, stiffness=rods.stiffness(bend=(1.0, STRONG)), normal=(0, 1, 0))
    scene.clamp(rod.start)
    scene.add_force(rod.end, (0.0, 0.0, -load), name="load")
    return rods.sharp(scene, **build), rod


def column(load, **build):
    """An upright strip, pressed on its end; pushed a little towards its strong side, which makes that its plane."""
    scene = rods.weightless()
    stiffness = rods.stiffness(bend=(1.0, STRONG))
    rod = rods.straight(scene, 40, direction=(0, 0, 1), stiffness=stiffness, normal=(0, 1, 0))
    scene.clamp(rod.start)
    scene.add_force(rod.end, (1e-3, 0.0, -load))
    return rods.sharp(scene, **build), rod


# Bending in its plane stiffens a strip by ((1 - B / B_strong) (1 - C / B_strong))^(-1/2) [Michell 1899, Phil. Mag. 48].
CASES = {"strip": (strip, theory.TIPPING_LOAD / (1.0 - 1.0 / STRONG)), "column": (column, theory.EULER_LOADS["free"])}


@pytest.mark.parametrize("case", CASES)
def test_an_equilibrium_leaves_its_plane_at_the_load_at_which_it_buckles_sideways(case):
    scene, critical = CASES[case]
    below, rod = scene(0.995 * critical)
    found = below.equilibrium()
    assert below.plan.planar
    assert found.stable
    assert not found.branch_changed
    above, rod = scene(1.005 * critical)
    found = above.equilibrium()
    assert not above.plan.planar
    assert found.stable
    assert found.branch_changed
    assert abs(above.positions(rod)[-1, 1]) > 0.05
    assert "stable against motions out of it" in str(above.plan)


@pytest.mark.parametrize("case", CASES)
def test_it_goes_where_a_scene_built_in_space_goes(case):
    scene, critical = CASES[case]
    ends = []
    for planar in (None, False):
        simulation, rod = scene(1.2 * critical, planar=planar)
        simulation.equilibrium()
        ends.append(simulation.positions(rod) * (1, np.sign(simulation.positions(rod)[-1, 1]), 1))
    np.testing.assert_allclose(*ends, atol=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_what_is_built_to_stay_in_its_plane_stays(case):
    scene, critical = CASES[case]
    simulation, rod = scene(1.5 * critical, planar=True)
    found = simulation.equilibrium()
    assert simulation.plan.planar
    assert found.stable
    assert not found.branch_changed
    assert (simulation.positions(rod)[:, 1] == 0.0).all()


def test_paths_tell_where_they_lose_their_stability_sideways_and_stay_in_the_plane():
    simulation, _rod = strip(theory.TIPPING_LOAD)
    path = simulation.equilibrium(path="arc_length", load="load", to=2.0)
    assert simulation.plan.planar
    loads = path.load_factors
    assert path.stable[loads < 0.99].all()
    assert not path.stable[loads > 1.01].any()


def test_checked_again_after_parameters_and_supports_have_changed():
    """The scene in space, which is kept from one equilibrium to the next, follows."""
    simulation, rod = strip(0.9 * theory.TIPPING_LOAD)
    assert simulation.equilibrium().stable
    assert simulation.plan.planar
    simulation.set(rod, twist_stiffness=0.5)
    simulation.equilibrium()
    assert not simulation.plan.planar
