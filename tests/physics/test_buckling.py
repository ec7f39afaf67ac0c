"""Loads at which straight columns buckle: Euler's four cases and Greenhill's column under its own weight.

A small side load measures the stiffness that is left; it is read off where it would vanish. The same columns are
then loaded just below and just above, where they must stay straight and must not.
"""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rods
import theory
import withe
from cases import measured
from convergence import assert_order, zero_crossing

SIDE = 1e-5
SHARES = (0.93, 0.95, 0.97, 0.98, 0.99)


def column(case, edges, load, side, **more):
    """A vertical column, pressed at its upper end."""
    scene = rods.weightless()
    rod = rods.straight(scene, edges, direction=(0.0, 0.0, 1.0), **more)
    (scene.pin if case == "pinned" else scene.clamp)(rod.start)
    if case in ("pinned", "clamped-pinned"):
        scene.pin(rod.end, free=(0.0, 0.0, 1.0))
    elif case == "clamped":
        scene.clamp(rod.end, free=(0.0, 0.0, 1.0))
    scene.add_force(rod.end, (0.0, 0.0, -load))
    probe = rod.end if case == "free" else rod.node(edges // 2)
    if side:
        scene.add_force(probe, (side, 0.0, 0.0))
    return scene, rod, -1 if case == "free" else edges // 2


def heavy_column(edges, load, side, **more):
    scene = withe.Scene(gravity=(0.0, 0.0, -load))
    rod = rods.straight(scene, edges, direction=(0.0, 0.0, 1.0), **more)
    scene.clamp(rod.start)
    if side:
        scene.add_force(rod.end, (side, 0.0, 0.0))
    return scene, rod, -1


def buckling_load(make, exact):
    loads = [share * exact for share in SHARES]
    deflections = []
    for load in loads:
        scene, rod, probe = make(load, SIDE)
        simulation = rods.sharp(scene, planar=None)
        simulation.equilibrium()
        deflections.append(simulation.positions(rod)[probe, 0] / SIDE)
    return zero_crossing(loads, deflections)


@pytest.mark.case(
    "stability", "Buckling load of a column with four pairs of ends", source="P = pi^2 EI / (K L)^2 [Euler 1744]"
)
@pytest.mark.parametrize("case", theory.EULER_LOADS)
def test_euler_load_converges_at_second_order(case):
    exact = theory.EULER_LOADS[case]
    errors = [buckling_load(lambda p, s, n=n: column(case, n, p, s), exact) / exact - 1.0 for n in (32, 64, 128)]
    assert_order(errors)
    measured(errors[-1])
    assert abs(errors[-1]) < 1e-3


@pytest.mark.parametrize(("case", "K"), [("pinned", 1.0), ("free", 2.0), ("clamped", 0.5), ("clamped-pinned", 0.699)])
def test_effective_lengths_are_eulers(case, K):
    assert theory.EULER_LOADS[case] == pytest.approx((np.pi / K) ** 2, rel=1.5e-3)


@pytest.mark.case(
    "stability", "Buckling of a column under its own weight", source="w L^3 / EI = 7.837 [Greenhill 1881]"
)
def test_self_weight_at_which_a_column_buckles_converges_at_second_order():
    assert pytest.approx(7.837, abs=5e-4) == theory.GREENHILL
    errors = [
        buckling_load(lambda p, s, n=n: heavy_column(n, p, s), theory.GREENHILL) / theory.GREENHILL - 1.0
        for n in (32, 64, 128)
    ]
    assert_order(errors)
    measured(errors[-1])
    assert abs(errors[-1]) < 5e-5


@pytest.mark.parametrize("slenderness", [1e2, 1e3, 1e4])
@pytest.mark.parametrize("case", [*theory.EULER_LOADS, "own weight"])
def test_column_stands_below_its_load_and_leaves_the_saddle_above(case, slenderness):
    """L / h = 100, 1e3, 1e4; a straight rod lies in no plane of its own, so it is free to choose one."""
    exact = theory.GREENHILL if case == "own weight" else theory.EULER_LOADS[case]
    for share, straight in ((0.97, True), (1.03, False)):
        stiffness = rods.stiffness(stretch=4.0 * slenderness**2)
        make = heavy_column if case == "own weight" else partial(column, case)
        scene, rod, _ = make(64, share * exact, 0.0, stiffness=stiffness)
        simulation = rods.sharp(scene)
        result = simulation.equilibrium()
        sway = np.abs(simulation.positions(rod)[:, :2]).max()
        assert result.stable
        assert sway < 1e-9 if straight else sway > 0.01


def swayed_tip(turn, stronger):
    """Tip of a column that falls, in axes of the scene; oblique stays pull it alike, but one is ten times as stiff."""
    scene = rods.weightless()

    def rod(start, end, nodes, name):
        return scene.add_rod(
            start=turn @ start,
            end=turn @ end,
            nodes=nodes,
            radius=1e-3,
            normal=turn @ (0.0, 1.0, 0.0),
            stiffness=withe.Stiffness(stretch=1e4, bend=(0.1, 0.01), twist=0.05),
            line_density=0.1,
            name=name,
        )

    column = rod((0.0, 0.0, 0.0), (0.0, 0.0, 0.3), 13, "column")
    scene.clamp(column.start)
    for name, side, stiffness, stretch in (("stiff", stronger, 2.0, 0.02), ("soft", -stronger, 0.2, 0.2)):
        post = rod((0.15 * side, 0.0, 0.45), (0.15 * side, 0.0, 0.55), 3, name)
        scene.clamp(post.start)
        scene.add_spring(column.end, post.start, stiffness=stiffness, rest_length=0.15 * np.sqrt(2.0) - stretch)
    scene.add_force(column.end, turn @ (0.0, 0.0, -1.3))
    simulation = scene.build(integrator="static", planar=False)
    assert simulation.equilibrium().stable
    return simulation.positions(column)[-1] @ turn


def test_to_which_side_a_column_falls_does_not_depend_on_how_the_scene_lies_in_space():
    first = swayed_tip(np.eye(3), 1.0)
    assert abs(first[0]) > 0.1
    for turn in Rotation.random(20, random_state=1).as_matrix():
        np.testing.assert_allclose(swayed_tip(turn, 1.0), first, atol=1e-8)
        mirrored = swayed_tip(turn, -1.0)
        np.testing.assert_allclose(mirrored, first * (-1.0, 1.0, 1.0), atol=1e-8)


def loaded_column(nodes, overload):
    """One that stands on a clamp, with more on it than Euler's load of a straight rod by that share."""
    scene = rods.weightless()
    steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
    column = scene.add_rod(start=(0.0, 0.0, 0.0), end=(1.0, 0.0, 0.0), nodes=nodes, radius=5e-3, material=steel)
    scene.clamp(column.start)
    euler = 0.25 * np.pi**2 * 2e11 * 0.25 * np.pi * 5e-3**4
    load = scene.add_force(column.end, (-euler * (1.0 + overload), 0.0, 0.0))
    return scene.build(), column, load


@pytest.mark.case(
    "stability",
    "Deflection of a column just above its buckling load",
    source="post-buckling expansion [Timoshenko and Gere 1961, 2.7]",
)
@pytest.mark.parametrize("nodes", [41, 101, 201])
def test_column_buckles_however_little_more_than_its_load_it_carries(nodes):
    """A sideways force that is taken away again leads to the same shape, so far aside as the elastica says.

    P / P_c = 1 + (w / L)^2 pi^2 / 32 + ... [Timoshenko and Gere 1961, 2.7: P / P_c = (2 K(k) / pi)^2,
    w = 2 k L / K(k)], P_c being that of the mesh: the slope of squares tells.
    """
    widths, overloads = [], np.array([4e-5, 7e-5, 1.1e-4, 2e-4, 3e-4, 5e-4, 1e-3])
    for overload in overloads:
        simulation, column, _ = loaded_column(nodes, overload)
        assert simulation.equilibrium().stable
        widths.append(np.linalg.norm(simulation.positions(column)[-1, 1:]))
        nudged, column, _ = loaded_column(nodes, overload)
        nudge = nudged.add_force(column.end, (0.0, 0.1, 0.0))
        nudged.equilibrium()
        nudged.set(nudge, force=(0.0, 0.0, 0.0))
        assert nudged.equilibrium().stable
        assert np.linalg.norm(nudged.positions(column)[-1, 1:]) == pytest.approx(widths[-1], rel=1e-4)
    slope = np.diff(np.square(widths)) / np.diff(overloads)
    np.testing.assert_allclose(slope, 32.0 / np.pi**2, rtol=5e-3)


def stable_column(nodes, overload):
    """Sideways displacement of the tip in equilibrium, and two frequencies there, after a check that it is stable."""
    simulation, column, _ = loaded_column(nodes, overload)
    found = simulation.equilibrium()
    assert found.stable
    assert found.stability == "stable"
    assert simulation.linearise().stability == "stable"
    return np.linalg.norm(simulation.positions(column)[-1, 1:]), simulation.linearise().frequencies(2)


@pytest.mark.parametrize("nodes", [101, 201])
def test_a_column_below_its_buckling_load_is_straight_stable_and_sways_alike_to_all_sides(nodes):
    aside, frequencies = stable_column(nodes, -1e-4)
    assert aside < 1e-3
    assert frequencies[0] == pytest.approx(frequencies[1], rel=1e-3)


@pytest.mark.case(
    "stability", "Stiffness of a column just above its buckling load", source="twice the lost stiffness [Koiter 1945]"
)
@pytest.mark.parametrize("nodes", [101, 201])
@pytest.mark.parametrize("overload", [2e-5, 1e-4])
def test_a_column_above_its_buckling_load_is_bent_stable_and_sways_against_koiters_stiffness(nodes, overload):
    """The bent column may turn about its axis, which is neutral.

    Off a symmetric bifurcation the way out has twice the stiffness that the straight column has lost [Koiter 1945].
    """
    aside, frequencies = stable_column(nodes, overload)
    assert aside > 1e-3
    assert abs(frequencies[0]) < 0.05 * frequencies[1]
    straight, _, load = loaded_column(nodes, -1e-3)
    straight.equilibrium()
    softest = straight.linearise().frequencies(1)[0]
    # Squares of the straight column's frequencies fall linearly with the load.
    euler = 0.25 * np.pi**2 * 2e11 * 0.25 * np.pi * 5e-3**4
    straight.set(load, force=(-euler * (1.0 - 5e-4), 0.0, 0.0))
    straight.equilibrium()
    softer = straight.linearise().frequencies(1)[0]
    lost = -(softer**2 + (softer**2 - softest**2) / 5e-4 * (overload + 5e-4))
    assert lost > 0.0
    measured(frequencies[1] ** 2 / (2.0 * lost) - 1.0)
    assert frequencies[1] ** 2 == pytest.approx(2.0 * lost, rel=0.03)
