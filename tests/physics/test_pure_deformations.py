"""Uniform bending, stretching and twisting, where closed forms hold, and sections as a user gives them."""

import warnings

import numpy as np
import pytest

import rods
import withe
from cases import measured
from convergence import assert_order


@pytest.mark.case("statics", "Gap of a rod that an end moment bends to a circle", source="M = 2 pi EI / L")
@pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])
def test_end_moment_closes_a_circle_at_second_order(planar):
    gaps = []
    for edges in (32, 64, 128):
        scene = rods.weightless()
        rod = rods.straight(scene, edges)
        scene.clamp(rod.start)
        moment = scene.add_moment(rod.end, (0.0, 0.0, 0.0))
        simulation = rods.sharp(scene, planar=planar)
        for share in np.linspace(0.1, 1.0, 10):
            simulation.set(moment, moment=(0.0, -2.0 * np.pi * share, 0.0))
            simulation.equilibrium()
        positions = simulation.positions(rod)
        gaps.append(np.linalg.norm(positions[-1] - positions[0]))
        assert np.ptp(positions[:, 2]) == pytest.approx(1.0 / np.pi, rel=2e-2)
    measured(gaps[-1], "L")
    assert_order(gaps)


@pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])
def test_end_moment_at_once_finds_the_same_circle(planar):
    scene = rods.weightless()
    rod = rods.straight(scene, 64)
    scene.clamp(rod.start)
    scene.add_moment(rod.end, (0.0, -2.0 * np.pi, 0.0))
    simulation = rods.sharp(scene, planar=planar)
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.positions(rod)[-1], 0.0, atol=5e-3)


@pytest.mark.case("actuation", "Circle by natural curvature", source="k = 2 pi / L")
@pytest.mark.parametrize("component", [0, 1])
def test_natural_curvature_closes_a_circle_to_rounding(component):
    scene = rods.weightless()
    rod = rods.straight(scene, 50, normal=(0.0, 1.0, 0.0), stiffness=rods.stiffness(bend=(1.0, 2.0)))
    scene.clamp(rod.start)
    simulation = rods.sharp(scene)
    curvature = np.zeros(2)
    curvature[component] = 2.0 * np.pi
    for share in np.linspace(0.1, 1.0, 10):
        simulation.set(rod, natural_curvature=share * curvature)
        assert simulation.equilibrium().stable
    positions = simulation.positions(rod)
    np.testing.assert_allclose(positions[-1], positions[0], atol=1e-9)
    # The rod bends towards the director: d1 is +y, d2 = t x d1 is +z.
    assert positions[:, 1 + component].max() == pytest.approx(1.0 / np.pi, rel=1e-2)
    assert positions[:, 1 + component].min() > -1e-2
    measured(simulation.curvatures(rod)[:, component] / (2.0 * np.pi) - 1.0)
    np.testing.assert_allclose(simulation.curvatures(rod)[:, component], 2.0 * np.pi, rtol=1e-9)
    assert simulation.energy().total == pytest.approx(0.0, abs=1e-12)


def round_bar(**more):
    scene = rods.weightless()
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.3, density=1000.0)
    bar = scene.add_rod(
        start=(0, 0, 0), end=(0.4, 0, 0), nodes=21, radius=5e-3, material=rubber, normal=(0, 1, 0), name="bar"
    )
    return scene, bar


@pytest.mark.case("statics", "Stretch of a bar", source="F L / EA")
@pytest.mark.parametrize("planar", [None, False], ids=["planar", "spatial"])
def test_pulled_bar_stretches_by_force_times_length_over_stiffness(planar):
    scene, bar = round_bar()
    wall = scene.clamp(bar.start)
    scene.add_force(bar.end, (3.0, 0.0, 0.0))
    simulation = rods.sharp(scene, planar=planar)
    simulation.equilibrium()
    area = np.pi * 5e-3**2
    assert simulation.positions(bar)[-1, 0] - 0.4 == pytest.approx(3.0 * 0.4 / (2e6 * area), rel=1e-9)
    np.testing.assert_allclose(simulation.tensions(bar), 3.0, rtol=1e-9)
    np.testing.assert_allclose(simulation.reaction(wall).force, (-3.0, 0.0, 0.0), atol=1e-9)
    assert simulation.energy().stretch == pytest.approx(3.0**2 * 0.4 / (2.0 * 2e6 * area), rel=1e-9)


def angle_about_x(directors):
    return np.arctan2(directors[:, 0, 2], directors[:, 0, 1])


@pytest.mark.case("statics", "Twist of a bar", source="M L / GJ")
def test_torque_at_the_end_turns_it_by_torque_times_length_over_stiffness():
    scene, bar = round_bar()
    wall = scene.clamp(bar.start)
    twist_stiffness = 2e6 / (2.0 * 1.3) * np.pi * 5e-3**4 / 2.0
    torque = 0.8 * twist_stiffness / 0.4
    scene.add_moment(bar.end, (torque, 0.0, 0.0))
    simulation = rods.sharp(scene)
    simulation.equilibrium()
    # Directors are those of the middles of edges.
    middles = (np.arange(20) + 0.5) * 0.02
    np.testing.assert_allclose(angle_about_x(simulation.directors(bar)), torque * middles / twist_stiffness, rtol=1e-9)
    np.testing.assert_allclose(simulation.twists(bar), torque / twist_stiffness, rtol=1e-9)
    np.testing.assert_allclose(simulation.reaction(wall).moment, (-torque, 0.0, 0.0), atol=1e-9 * torque)


def test_turned_clamp_is_resisted_by_stiffness_over_length_times_its_angle():
    scene, bar = round_bar()
    scene.clamp(bar.start)
    grip = scene.clamp(bar.end)
    simulation = rods.sharp(scene)
    simulation.move(bar.end, rotation=rods.rotation((1, 0, 0), 0.8))
    simulation.equilibrium()
    twist_stiffness = 2e6 / (2.0 * 1.3) * np.pi * 5e-3**4 / 2.0
    np.testing.assert_allclose(
        simulation.reaction(grip).moment, (0.8 * twist_stiffness / 0.4, 0.0, 0.0), atol=1e-9 * twist_stiffness
    )
    assert simulation.energy().twist == pytest.approx(0.5 * twist_stiffness / 0.4 * 0.8**2, rel=1e-9)


@pytest.mark.filterwarnings("ignore::withe.CoarseMeshWarning")
def test_clamp_that_turns_ten_times_winds_ten_turns():
    scene, bar = round_bar()
    scene.clamp(bar.start)
    grip = scene.clamp(bar.end, free=(1, 0, 0))
    scene.add_force(bar.end, (30.0, 0.0, 0.0))
    simulation = scene.build(integrator="static", time_step=0.01)
    simulation.move(bar.end, path=lambda t: ((0.4, 0, 0), rods.rotation((1, 0, 0), 20.0 * np.pi * min(t, 1.0))))
    simulation.step(100)
    twist_stiffness = 2e6 / (2.0 * 1.3) * np.pi * 5e-3**4 / 2.0
    assert simulation.reaction(grip).moment[0] == pytest.approx(20.0 * np.pi * twist_stiffness / 0.4, rel=1e-6)


def bends_of_twisted_cantilever(twist):
    """Bending of a round rod with twisted edges under a load on its end.

    Return the rotations of the first edge and from each edge to the next, the curvatures as read there, and the
    warnings. The edges are twisted against each other by `twist`.
    """
    scene, bar = round_bar()
    scene.clamp(bar.start)
    scene.add_force(bar.end, (0.0, 0.0, -1e-6))
    simulation = rods.sharp(scene, planar=False)
    edge = np.linalg.norm(np.diff(simulation.positions(bar)[:2], axis=0))
    simulation.set(bar, natural_twist=twist / edge)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation.equilibrium()
    slopes = np.diff(simulation.positions(bar)[:, 2]) / edge
    read = np.linalg.norm(simulation.curvatures(bar), axis=1)
    return np.diff(slopes, prepend=0.0), read, [str(warning.message) for warning in caught]


@pytest.mark.parametrize("degrees", [20, 85, 120, 180, 400])
def test_a_round_rod_that_is_twisted_bends_no_more(degrees):
    straight, curvatures, _ = bends_of_twisted_cantilever(0.0)
    twisted, read, said = bends_of_twisted_cantilever(np.radians(degrees))
    np.testing.assert_allclose(twisted, straight, rtol=1e-9)
    np.testing.assert_allclose(read, curvatures, rtol=1e-9)
    assert said == []


@pytest.mark.case("statics", "Rectangular section bent over either side", source="F L^3 / (3 EI)")
@pytest.mark.parametrize(("push", "moment"), [((0, 0, 1), "height"), ((0, 1, 0), "width")])
def test_rectangle_bends_over_the_side_that_is_pushed(push, moment):
    width, height = 2e-2, 1e-3
    scene = rods.weightless()
    steel = withe.Material(youngs_modulus=2e9, poisson_ratio=0.3, density=1000.0)
    tape = scene.add_rod(
        start=(0, 0, 0),
        end=(0.2, 0, 0),
        nodes=201,
        section=withe.Rectangle(width=width, height=height),
        material=steel,
        normal=(0, 1, 0),
    )
    scene.clamp(tape.start)
    # Width lies along d1 = +y, height along d2 = +z.
    inertia = width * height**3 / 12.0 if moment == "height" else height * width**3 / 12.0
    load = 1e-3 * 3.0 * 2e9 * inertia / 0.2**3 * 0.2
    scene.add_force(tape.end, load * np.array(push))
    simulation = rods.sharp(scene, planar=False)
    simulation.equilibrium()
    deflection = simulation.positions(tape)[-1] @ push
    assert deflection == pytest.approx(load * 0.2**3 / (3.0 * 2e9 * inertia), rel=1e-4)


@pytest.mark.case("statics", "Strain of a bar with varying stiffness", source="F / EA(x)")
def test_tapered_rod_stretches_edge_by_edge():
    scene = rods.weightless()
    moduli = np.linspace(1.0, 2.0, 10)
    rod = rods.straight(scene, 10, stiffness=rods.stiffness(stretch=moduli * 1e3))
    scene.clamp(rod.start)
    scene.add_force(rod.end, (5.0, 0.0, 0.0))
    simulation = rods.sharp(scene)
    simulation.equilibrium()
    strains = np.diff(simulation.positions(rod)[:, 0]) / 0.1 - 1.0
    np.testing.assert_allclose(strains, 5.0 / (moduli * 1e3), rtol=1e-8)
