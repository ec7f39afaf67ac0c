"""Scenes that hold very different stiffnesses, masses and lengths at once, or one that is very long, thin or turned."""

import numpy as np
import pytest
from scipy.optimize import brentq

import rods
import theory
import withe
from cases import measured
from convergence import assert_order, assert_order_at_least


@pytest.mark.case("statics", "Rubber of 1 kPa joined to steel of 200 GPa", source="elastica")
@pytest.mark.parametrize("load", [1.0, 5.0])
def test_rubber_joined_to_steel_bends_as_if_steel_were_a_wall(load):
    """1 kPa and 200 GPa, of one section: the elastica of a cantilever."""
    exact = theory.tip_loaded(load)
    errors = []
    for edges in (20, 40, 80):
        scene = rods.weightless()
        steel = scene.add_rod(
            start=(-1, 0, 0),
            end=(0, 0, 0),
            nodes=edges + 1,
            radius=1e-3,
            line_density=1.0,
            stiffness=rods.stiffness(stretch=2e14, bend=2e8, twist=2e8),
        )
        rubber = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e6))
        scene.join(steel.end, rubber.start)
        scene.clamp(steel.start)
        scene.add_force(rubber.end, (0.0, 0.0, -load))
        simulation = scene.build(integrator="static", planar=True)
        assert simulation.equilibrium().stable
        x, _, z = simulation.positions(rubber)[-1]
        errors.append(float(np.hypot(x - 1.0 + exact.inward, z + exact.down)))
    print(f"1 kPa joined to 200 GPa, {load}:", errors)
    measured(errors[-1], "L")
    assert errors[-1] < 3e-4
    assert_order(errors, slack=0.3)


@pytest.mark.case("dynamics", "Frequency of a beam with a tip mass of 1e9 beams", source="w^2 = 3 EI / (M L^3)")
def test_a_beam_swings_a_mass_a_thousand_million_times_its_own():
    """w^2 = 3 B / (M L^3), by its period in motion and by its matrices."""
    exact = np.sqrt(3.0 / 1e9)
    errors = []
    for edges in (10, 20, 40):
        scene = rods.weightless()
        beam = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e5), normal=(0, 0, 1))
        scene.clamp(beam.start)
        scene.add_mass(beam.end, 1e9)
        step = 2.0 * np.pi / exact / 200
        simulation = scene.build(
            time_step=step, planar=True, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
        )
        swing = 2.0 * np.pi * simulation.linearise().frequencies(1)[0]
        push = np.zeros((edges + 1, 3))
        s = np.linspace(0.0, 1.0, edges + 1)
        push[:, 2] = 1e-4 * exact * 0.5 * s**2 * (3.0 - s)
        simulation.set_velocities(beam, push)
        heights = []
        for _ in range(200):
            simulation.step()
            heights.append(simulation.positions(beam)[-1, 2])
        # A quarter, half and all of a turn, but for the phase that midpoint loses: 2 pi (w dt)^2 / 12.
        np.testing.assert_allclose(np.array(heights)[[49, 99, 199]] / 1e-4, (1.0, 0.0, 0.0), atol=3e-3)
        errors.append(swing / exact - 1.0)
    print("masses 1 : 1e9:", errors)
    measured(errors[-1])
    assert abs(errors[-1]) < 1e-3
    assert_order_at_least(errors, 2.0)


@pytest.mark.case(
    "statics", "Sag and pull of 10 km of steel cable", source="elastic catenary [Irvine 1981, section 1.3]"
)
def test_ten_kilometres_of_cable_hang_as_an_elastic_catenary():
    """[Irvine 1981, section 1.3]: H, and the sag, of a steel cable that is longer than its span by a fifth of it."""
    length, span, weight, stretch = 10e3, 8e3, 7850.0 * np.pi * 0.02**2 * 9.81, 2e11 * np.pi * 0.02**2

    def reach(pull):
        return 2.0 * pull / weight * np.arcsinh(0.5 * weight * length / pull) + pull * length / stretch

    pull = brentq(lambda h: reach(h) - span, 1e-2 * weight * length, 10.0 * weight * length, xtol=1e-9, rtol=1e-14)
    half = 0.5 * weight * length
    sag = (np.hypot(pull, half) - pull) / weight + half * length / (4.0 * stretch)
    errors = []
    for edges in (20, 40, 80):
        # Drawn as any curve of its length between its supports: two straight lines.
        drop = np.sqrt((0.5 * length) ** 2 - (0.5 * span) ** 2)
        share = np.linspace(-1.0, 1.0, edges + 1)
        curve = np.stack([0.5 * span * share, 0.0 * share, drop * (np.abs(share) - 1.0)], axis=1)
        scene = withe.Scene()
        steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
        cable = scene.add_rod(points=curve, radius=0.02, material=steel, natural="straight")
        grip = scene.pin(cable.start)
        scene.pin(cable.end)
        simulation = scene.build(integrator="static")
        assert simulation.equilibrium().stable
        lowest = simulation.positions(cable)[edges // 2, 2]
        errors.append((-lowest / sag - 1.0, -simulation.reaction(grip).force[0] / pull - 1.0))
    print("10 km:", errors)
    measured(errors[-1])
    assert np.abs(errors[-1]).max() < 1e-3
    for kind in np.array(errors).T:
        assert_order(kind, slack=0.3)


@pytest.mark.case("statics", "Glass fibre of radius 1 um", source="elastica")
def test_a_rod_one_micrometre_thick_bends_as_the_elastica():
    """Radius 1 um, length 1 mm, at default tolerances; P L^2 / B = 5, a quarter of a micronewton."""
    radius, length = 1e-6, 1e-3
    glass = withe.Material(youngs_modulus=7e10, poisson_ratio=0.2, density=2200.0)
    load = 5.0 * 7e10 * np.pi * radius**4 / 4.0 / length**2
    exact = theory.tip_loaded(5.0)
    errors = []
    for edges in (20, 40, 80):
        scene = rods.weightless()
        fibre = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=edges + 1, radius=radius, material=glass)
        scene.clamp(fibre.start)
        scene.add_force(fibre.end, (0.0, 0.0, -load))
        simulation = scene.build(integrator="static")
        assert simulation.equilibrium().stable
        x, _, z = simulation.positions(fibre)[-1] / length
        errors.append(float(np.hypot(x - 1.0 + exact.inward, z + exact.down)))
    print("1 um:", errors)
    measured(errors[-1], "L")
    assert errors[-1] < 2e-4
    assert_order(errors, slack=0.3)


@pytest.mark.case("statics", "Shaft whose end is turned 20 times", source="twist phi / L, moment GJ phi / L")
@pytest.mark.filterwarnings("ignore::withe.CoarseMeshWarning")
def test_an_end_turned_twenty_times_in_one_move_winds_the_rod_evenly():
    """Too stiff to buckle: twist of 40 pi per length, C of it as moment, and half C of its square as energy."""
    scene = rods.weightless()
    shaft = rods.straight(scene, 100, stiffness=rods.stiffness(bend=1e3, twist=0.7, stretch=1e6))
    scene.clamp(shaft.start)
    hand = scene.clamp(shaft.end)
    simulation = rods.sharp(scene, planar=False)
    simulation.move(hand, roll=40.0 * np.pi, over=0.5)
    simulation.step(round(0.5 / simulation.time_step))
    error = np.abs(simulation.twists(shaft) / (40.0 * np.pi) - 1.0).max()
    moment = simulation.reaction(hand).moment[0] / (0.7 * 40.0 * np.pi) - 1.0
    print("20 turns:", error, moment, simulation.energy().twist / (0.35 * (40.0 * np.pi) ** 2) - 1.0)
    measured([error, moment])
    assert error < 1e-9
    assert abs(moment) < 1e-9
    assert simulation.energy().twist == pytest.approx(0.35 * (40.0 * np.pi) ** 2, rel=1e-9)
