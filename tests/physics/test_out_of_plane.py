"""Planar scenes that would buckle out of their plane: equilibria warn at the loads of the literature."""

import warnings

import numpy as np
import pytest

import rods
import theory
import withe
from cases import measured

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
CASES = {
    "strip": (strip, theory.TIPPING_LOAD / (1.0 - 1.0 / STRONG)),
    "column": (column, theory.EULER_LOADS["free"]),
}


@pytest.mark.case(
    "stability", "Sideways buckling that a planar scene warns of (bracket)", source="[Michell 1899], [Euler 1744]"
)
@pytest.mark.parametrize("case", CASES)
def test_an_equilibrium_warns_from_the_load_on_at_which_it_would_buckle_sideways(case):
    scene, critical = CASES[case]
    below, _rod = scene(0.995 * critical)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert below.equilibrium().stable
    above, rod = scene(1.005 * critical)
    with pytest.warns(withe.OutOfPlaneWarning, match=r"Use build\(planar=False\) to allow this"):
        found = above.equilibrium()
    measured(0.005)
    assert not found.stable
    assert found.stability == "diverges"
    assert above.plan.planar
    assert (above.positions(rod)[:, 1] == 0.0).all()


@pytest.mark.parametrize("case", CASES)
def test_built_in_space_it_buckles_there(case):
    scene, critical = CASES[case]
    simulation, rod = scene(1.005 * critical, planar=False)
    assert simulation.equilibrium().stable
    assert abs(simulation.positions(rod)[-1, 1]) > 0.05


@pytest.mark.parametrize("case", CASES)
def test_what_is_built_to_stay_in_its_plane_is_not_looked_at_in_space(case):
    scene, critical = CASES[case]
    simulation, _rod = scene(1.5 * critical, planar=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert simulation.equilibrium().stable


def test_it_warns_once_but_tells_of_every_equilibrium():
    simulation, _rod = strip(1.1 * theory.TIPPING_LOAD)
    with pytest.warns(withe.OutOfPlaneWarning):
        assert not simulation.equilibrium().stable
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not simulation.equilibrium().stable


def test_paths_tell_where_they_lose_their_stability_sideways():
    simulation, _rod = strip(theory.TIPPING_LOAD)
    path = simulation.equilibrium(path="arc_length", load="load", to=2.0)
    loads = path.load_factors
    assert path.stable[loads < 0.99].all()
    assert not path.stable[loads > 1.01].any()


def test_static_steps_warn_too():
    simulation, _rod = strip(1.1 * theory.TIPPING_LOAD)
    with pytest.warns(withe.OutOfPlaneWarning):
        simulation.step()


def test_the_scene_in_space_follows_parameters_loads_and_supports():
    """It is kept from one equilibrium to the next."""
    simulation, rod = strip(0.9 * theory.TIPPING_LOAD)
    assert simulation.equilibrium().stable
    simulation.set(rod, twist_stiffness=0.5)
    with pytest.warns(withe.OutOfPlaneWarning):
        assert not simulation.equilibrium().stable
    simulation.set(rod, twist_stiffness=1.0)
    assert simulation.equilibrium().stable
    simulation.set("load", force=(0.0, 0.0, -1.1 * theory.TIPPING_LOAD))
    assert not simulation.equilibrium().stable
    simulation.pin(rod.end, free=(0.0, 0.0, 1.0))  # in the plane and sideways too
    assert simulation.equilibrium().stable


def test_a_scene_that_can_be_built_in_its_plane_only_is_not_looked_at_in_space():
    """A clamp on what turns about a hinge, which in its plane is a pin."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(), "line_density": 1.0, "radius": 1e-3, "nodes": 9}
    post = scene.add_rod(start=(0, 0, 0), end=(0, 0, -1), **parts)
    arms = [scene.add_rod(start=(0, 0, -1), end=(way, 0, -1), **parts) for way in (1, -1)]
    for arm in arms:
        scene.join(post.end, arm.start, "revolute", axis=(0, 1, 0))
    scene.clamp(arms[0].start)
    scene.pin(post.start)
    with pytest.raises(
        ValueError, match=r"must hold the rod that the hinge turns against, not rod .*, which turns: clamp rod"
    ):
        scene.build(planar=False)
    simulation = rods.sharp(scene, planar=None)
    assert simulation.plan.planar
    with pytest.warns(withe.OutOfPlaneWarning, match="tested in its plane only: in space, a clamp cannot hold"):
        assert simulation.equilibrium().stable


def test_hinges_follow_into_space_at_every_equilibrium():
    """An arm that hangs from a hinge on a stiff post, which is turned round by half a turn in steps."""
    scene = withe.Scene()
    post = scene.add_rod(
        start=(0, 0, 0),
        end=(0, 0, 0.2),
        nodes=5,
        radius=1e-3,
        line_density=1.0,
        stiffness=rods.stiffness(bend=1e3, twist=1e3),
    )
    arm = scene.add_rod(
        start=(0, 0, 0.2),
        end=(0.1, 0, -0.3),
        nodes=9,
        radius=1e-3,
        line_density=1.0,
        stiffness=rods.stiffness(bend=10.0),
    )
    scene.join(post.end, arm.start, "revolute", axis=(0, 1, 0))
    clamp = scene.clamp(post.start)
    simulation = scene.build(integrator="static")
    assert simulation.plan.planar
    for degrees in (0, 40, 80, 120, 160):
        turn = np.radians(degrees)
        simulation.move(clamp, tangent=(np.sin(turn), 0.0, np.cos(turn)))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert simulation.equilibrium().stable, degrees


def test_friction_of_a_pair_reaches_the_scene_in_space():
    """A pair that gets coefficients of its own between two equilibria, as in the scene in space."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    line = {"start": (0, 0, 0.05), "end": (0.2, 0, 0.05), "nodes": 11}
    arm = scene.add_rod(**line, radius=4e-3, material=rubber, normal=(0, 0, 1))
    scene.clamp(arm.start)
    floor = scene.add_floor(0.0, friction=0.0)
    bar = scene.add_capsule((0.15, -0.1, 0.02), (0.15, 0.1, 0.02), 0.02, friction=0.0)
    simulation = scene.build(integrator="static")
    for pair in (floor, bar):
        assert simulation.equilibrium().stable
        simulation.set((arm, pair), friction=0.3)
    assert simulation.equilibrium().stable
    assert simulation.plan.planar
