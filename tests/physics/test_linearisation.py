"""Frequencies, flutter and divergence of the linearised equations: slender, fine and free rods, turning loads."""

import pickle

import numpy as np
import pytest
from scipy.linalg import eig
from scipy.special import jn_zeros

import rods
import theory
import withe
from cases import measured
from convergence import assert_order

STEEL = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
# Wave numbers of a free beam, cosh b cos b = 1.
FREE_ROOTS = (4.730040744862704, 7.853204624095838, 10.995607838001671)


def steel_rod(slenderness, nodes, direction=(1.0, 0.0, 0.0), held=True, planar=None):
    """Angular frequencies of a rod over those of Euler's beam with wave number 1 / L: squares of its wave numbers."""
    scene = rods.weightless()
    radius = 1.0 / slenderness
    end = np.array(direction) / np.linalg.norm(direction)
    rod = scene.add_rod(start=(0, 0, 0), end=end, nodes=nodes, radius=radius, material=STEEL, normal=(0, 0, 1))
    if held:
        scene.clamp(rod.start)
    unit = 0.5 * radius * np.sqrt(STEEL.youngs_modulus / STEEL.density)
    return lambda count: scene.build(planar=planar).linearise().frequencies(count) * 2.0 * np.pi / unit


@pytest.mark.case("dynamics", "Frequencies of cantilevers, L / h = 100 to 1e5", source="Euler-Bernoulli beam")
@pytest.mark.parametrize("slenderness", [1e2, 1e4, 1e5])
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (1.0, 0.7, 0.0)])
def test_slender_rods_have_the_frequencies_of_thick_ones(slenderness, direction):
    roots = np.sqrt(steel_rod(slenderness, 201, direction, planar=True)(2))
    np.testing.assert_allclose(roots, theory.CANTILEVER_ROOTS[:2], rtol=3e-7)


def test_fine_rods_keep_their_digits():
    """The energy of the first mode is 1e-14 of the entries of this stiffness matrix."""
    np.testing.assert_allclose(steel_rod(1e3, 5001)(2), theory.CANTILEVER_ROOTS[0] ** 2, rtol=2e-7)


@pytest.mark.case("dynamics", "Frequency of a free beam, L / h = 1e3 and 1e5", source="Euler-Bernoulli beam")
@pytest.mark.parametrize("slenderness", [1e3, 1e5])
def test_a_free_rod_has_six_motions_without_frequency_and_then_those_of_a_free_beam(slenderness):
    found = steel_rod(slenderness, 201, (1.0, 0.7, 0.0), held=False, planar=False)(8)
    # Coordinates round too: edges that are drawn askew pull by E A 1e-14, no little where E I / L^2 is E A 1e-11.
    assert np.abs(found[:6]).max() < 1e-3 * found[6]
    np.testing.assert_allclose(found[6:], FREE_ROOTS[0] ** 2, rtol=1e-7)


@pytest.mark.parametrize("rods_in_all", [2, 5])
@pytest.mark.parametrize("extra", [2, 12])
def test_free_rods_have_six_motions_without_frequency_each_however_many_there_are(rods_in_all, extra):
    """More than a block of a Krylov space is wide."""
    scene = rods.weightless()
    for i in range(rods_in_all):
        # Round and all the same, so that the lowest frequency comes twice for each.
        scene.add_rod(start=(0, 0.1 * i, 0), end=(1, 0.1 * i, 0), nodes=41, radius=5e-3, material=STEEL)
    unit = 0.5 * 5e-3 * np.sqrt(STEEL.youngs_modulus / STEEL.density) / (2.0 * np.pi)
    neutral = 6 * rods_in_all
    found = scene.build(planar=False).linearise().frequencies(neutral + extra)
    moving = np.repeat(np.square(FREE_ROOTS), 2 * rods_in_all)[:extra] * unit
    assert np.abs(found[:neutral]).max() < 1e-5 * moving[0]
    np.testing.assert_allclose(found[neutral:][: len(moving)], moving[: len(found) - neutral], rtol=2e-3)


def test_frequencies_and_modes_are_those_of_the_matrices():
    scene = rods.weightless()
    arm = rods.straight(scene, 12, stiffness=rods.stiffness(stretch=1e3, bend=(1.0, 2.0)), radius=0.1)
    scene.clamp(arm.start)
    found = scene.build(planar=False).linearise()
    squares = np.sort(eig(found.stiffness, found.mass)[0].real)
    np.testing.assert_allclose((2.0 * np.pi * found.frequencies(len(squares))) ** 2, squares, rtol=1e-7)
    # A few come from a Krylov space.
    np.testing.assert_allclose((2.0 * np.pi * found.frequencies(4)) ** 2, squares[:4], rtol=1e-9)
    assert found.modes(4).shape == (4, 13, 3)
    np.testing.assert_allclose(np.linalg.norm(found.modes(4), axis=2).max(axis=1), 1.0)


def test_it_pickles_also_once_modes_are_found():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=41, radius=5e-3, material=STEEL)
    scene.clamp(rod.start)
    linearisation = scene.build().linearise()
    modes = linearisation.modes(4)
    again = pickle.loads(pickle.dumps(linearisation))
    np.testing.assert_array_equal(again.modes(4), modes)


def test_a_hanging_cable_swings_with_the_zeros_of_a_bessel_function():
    length = 100.0
    scene = withe.Scene()
    cable = scene.add_rod(start=(0, 0, 0), end=(0, 0, -length), nodes=201, radius=5e-4, material=STEEL)
    scene.pin(cable.start)
    simulation = scene.build()
    assert simulation.equilibrium().stability == "stable"
    found = simulation.linearise().frequencies(7)[1::2]  # it may spin about itself, and swings both ways
    np.testing.assert_allclose(found, jn_zeros(0, 3) / (4.0 * np.pi) * np.sqrt(9.81 / length), rtol=5e-4)


@pytest.mark.case("stability", "Frequency and growth rate of a hinged column", source="w^2 = pi^4 (1 - P / pi^2)")
@pytest.mark.parametrize("load", [6.0, 14.0])
def test_a_hinged_column_swings_below_eulers_load_and_diverges_above(load):
    """w^2 = pi^4 (1 - P / pi^2). At a hinge a follower force does as a dead one, which buckling would leave at once."""
    scene = rods.weightless()
    column = rods.straight(scene, 80, stiffness=rods.stiffness(stretch=1e9), normal=(0, 0, 1))
    scene.pin(column.start)
    scene.pin(column.end, free=(1, 0, 0))
    scene.add_force(column.end, (-load, 0.0, 0.0), follower=True)
    simulation = scene.build(planar=True, integrator="static")
    found = simulation.equilibrium()
    square = np.pi**4 * (1.0 - load / np.pi**2)
    assert found.stability == ("stable" if square > 0.0 else "diverges")
    assert found.stable == (square > 0.0)
    frequency = 2.0 * np.pi * simulation.linearise().frequencies(1)[0]
    assert frequency == pytest.approx(np.sign(square) * np.sqrt(abs(square)), rel=2e-3)


def becks_column(load, nodes, planar=True, mass=0.0):
    scene = rods.weightless()
    column = rods.straight(scene, nodes - 1, stiffness=rods.stiffness(stretch=1e9), normal=(0, 0, 1))
    scene.clamp(column.start)
    scene.add_force(column.end, (-load, 0.0, 0.0), follower=True)
    if mass:
        scene.add_mass(column.end, mass)
    simulation = scene.build(planar=planar, integrator="static")
    return simulation.equilibrium(), simulation.linearise()


def onset(says, low, high):
    """Value at which the result of `says` stops being stable."""
    for _ in range(16):
        middle = 0.5 * (low + high)
        if says(middle) == "stable":
            low = middle
        else:
            high = middle
    return low


@pytest.mark.case("stability", "Flutter load of Beck's column", source="20.0510 EI / L^2 [Beck 1952]")
def test_becks_column_flutters_from_twenty_on():
    """[Beck 1952]: P L^2 / B = 20.0510."""
    load = theory.flutter_load()
    assert load == pytest.approx(20.0510, abs=5e-5)
    errors = [onset(lambda p, n=n: becks_column(p, n)[0].stability, 15.0, 25.0) / load - 1.0 for n in (11, 21, 41)]
    measured(errors[-1])
    assert_order(np.array(errors), order=2.0, slack=0.2)
    assert abs(errors[-1]) < 1.5e-3


@pytest.mark.parametrize("planar", [True, False])
def test_becks_column_swings_below_and_grows_above_as_its_matrices_say(planar):
    found, linear = becks_column(10.0, 41, planar)
    assert found.stable
    assert np.isrealobj(linear.frequencies(4))
    found, linear = becks_column(25.0, 41, planar)
    assert not found.stable
    assert found.stability == "flutters"
    _, growth = theory.flutter(25.0)  # 4.9170 without a mesh
    assert np.abs(2.0 * np.pi * linear.frequencies(4).imag).max() == pytest.approx(growth, rel=4e-3)
    assert np.iscomplexobj(linear.modes(2))
    np.testing.assert_allclose(np.linalg.norm(linear.modes(2), axis=2).max(axis=1), 1.0)


def test_modes_that_flutter_solve_the_equations_of_motion():
    _, linear = becks_column(25.0, 21)
    squares = (2.0 * np.pi * linear.frequencies(2)) ** 2
    # In a plane every unknown moves a node.
    moves = np.linalg.pinv(linear.displacement) @ linear.modes(2).reshape(2, -1).T
    flexible = np.linalg.solve(linear.stiffness, linear.mass @ moves) * squares
    np.testing.assert_allclose(flexible, moves, atol=1e-5)


@pytest.mark.case(
    "stability", "Flutter load of Pflüger's column, three tip masses", source="characteristic equation [Pflüger 1955]"
)
@pytest.mark.parametrize(("mass", "load"), [(0.1, 17.595), (1.0, 16.212), (2.0, 16.717)])
def test_a_mass_at_the_tip_makes_becks_column_flutter_earlier(mass, load):
    """[Pflueger 1955]: P L^2 / B with so many of the column's masses, by the characteristic equation."""
    exact = theory.flutter_load(mass)
    assert exact == pytest.approx(load, abs=5e-4)
    found = [onset(lambda p, n=n: becks_column(p, n, mass=mass)[0].stability, 10.0, 25.0) for n in (11, 21, 41)]
    errors = np.array(found) / exact - 1.0
    measured(errors[-1])
    assert_order(errors, order=2.0, slack=0.2)
    assert abs(errors[-1]) < 2e-3


def twisted_shaft(moment, nodes, ends="hinged"):
    scene = rods.weightless()
    shaft = rods.straight(scene, nodes - 1, stiffness=rods.stiffness(stretch=1e6))
    if ends == "hinged":
        scene.pin(shaft.start)
        scene.pin(shaft.end, free=(1, 0, 0))
        scene.add_moment(shaft.start, (-moment, 0.0, 0.0))
    else:
        scene.clamp(shaft.start)
    scene.add_moment(shaft.end, (moment, 0.0, 0.0))
    simulation = scene.build(integrator="static")
    return simulation.equilibrium(), simulation.linearise()


@pytest.mark.case("stability", "Moment at which a hinged shaft diverges", source="2 pi EI / L [Greenhill 1883]")
def test_a_hinged_shaft_diverges_at_two_pi_of_moment():
    """[Greenhill 1883]: M L / B = 2 pi."""
    found = [onset(lambda m, n=n: twisted_shaft(m, n)[0].stability, 5.0, 7.0) for n in (21, 41, 81)]
    measured(found[-1] / (2.0 * np.pi) - 1.0)
    assert_order(np.array(found) / (2.0 * np.pi) - 1.0, order=2.0, slack=0.15)
    assert twisted_shaft(7.0, 21)[0].stability == "diverges"


def test_a_moment_on_the_free_end_of_a_shaft_makes_it_flutter_however_small():
    """[Ziegler 1952]: such a shaft has no other equilibrium at any moment, and is not stable at any."""
    growth = []
    for moment in (0.02, 0.1, 0.5):
        found, linear = twisted_shaft(moment, 21, "free")
        assert found.stability == "flutters"
        growth.append(np.abs(linear.frequencies(4).imag).max() / moment)
    np.testing.assert_allclose(growth, growth[0], rtol=0.05)


def test_neutral_motions_of_many_free_rods_are_all_found():
    """Seven each: three ways, three turns, and its spin; more than a Krylov block of a fixed width would hold."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    for z in range(3):
        scene.add_rod(start=(0, 0, z), end=(0.1, 0, z), nodes=11, radius=5e-3, material=rubber)
    found = scene.build(planar=False).linearise().frequencies(24)
    assert (np.abs(found[:18]) < 1e-6).all()
    free = np.abs(found) > 1e-6
    assert found[free].min() == pytest.approx(89.0, rel=0.02)  # 4.730^2 / (2 pi L^2) sqrt(EI / m)


def arc(turn, nodes, radius, youngs_modulus, closed=False, lift=0.0):
    """A free rod along a circle or a helix of radius 0.1 m."""
    s = np.linspace(0.0, turn, nodes, endpoint=not closed)
    rubber = withe.Material(youngs_modulus=youngs_modulus, poisson_ratio=0.3, density=1000.0)
    scene = rods.weightless()
    points = 0.1 * np.stack([np.cos(s), np.sin(s), lift * s], axis=1)
    scene.add_rod(points=points, closed=closed, radius=radius, material=rubber)
    return scene.build(planar=False).linearise()


@pytest.mark.parametrize(
    "free",
    [
        lambda: arc(4.5, 51, 3e-4, 1e6),
        lambda: arc(4.5, 21, 1e-3, 1e6),
        lambda: arc(20.0, 31, 1e-4, 1e6, lift=0.2),
        lambda: arc(2.0 * np.pi, 160, 1e-4, 1e9, closed=True),
    ],
)
def test_frequencies_of_free_bent_rods_do_not_depend_on_how_many_are_asked_for(free):
    linearisation = free()
    assert linearisation.stability == "stable"
    dense = np.sort(eig(linearisation.stiffness, linearisation.mass)[0].real)
    expected = np.sqrt(dense[6:8]) / (2.0 * np.pi)
    for count in (8, 10, 20, 40):
        found = linearisation.frequencies(count)
        assert (np.diff(np.sign(found) * found**2) >= 0.0).all()
        assert np.abs(found[:6]).max() < 1e-3 * expected[0]
        np.testing.assert_allclose(found[6:8], expected, rtol=1e-4)


@pytest.mark.parametrize("nodes", [21, 51, 101])
def test_a_free_bar_that_rounding_presses_is_stable(nodes):
    scene = rods.weightless()
    scene.add_rod(start=(0, 0, 0), end=(0.6, 0, 0), nodes=nodes, radius=1e-3, material=STEEL)
    simulation = scene.build()
    assert simulation.linearise().stability == "stable"
    assert simulation.equilibrium().stable


@pytest.mark.parametrize("beside", [0, 1])
def test_becks_column_flutters_beside_what_is_slower(beside):
    """Sixteen motions of a soft rod that nothing connects with it are slower than those that flutter."""
    scene = rods.weightless()
    column = scene.add_rod(
        start=(0, 0, 0),
        end=(0, 0, 1),
        nodes=41,
        radius=1e-3,
        stiffness=withe.Stiffness(stretch=1e5, bend=0.1, twist=0.1),
        line_density=0.1,
    )
    scene.clamp(column.start)
    scene.add_force(column.end, (0, 0, -1.3 * 20.05 * 0.1), follower=True)
    if beside:
        soft = withe.Stiffness(stretch=1e2, bend=1e-6, twist=1e-6)
        rod = scene.add_rod(start=(1, 0, 0), end=(1, 0, 2), nodes=61, radius=1e-3, stiffness=soft, line_density=0.1)
        scene.clamp(rod.start)
    found = scene.build().equilibrium()
    assert found.stability == "flutters"
    assert not found.stable


@pytest.mark.parametrize("moment", [4e-3, 6e-3, 8e-3])
def test_what_diverges_comes_first_where_loads_turn_with_the_rod(moment):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1100.0)
    strip = withe.Rectangle(width=1e-2, height=4e-3)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=16, normal=(0, 1, 0), section=strip, material=rubber)
    scene.clamp(rod.start)
    scene.pin(rod.end, free=(1, 0, 0))
    scene.add_moment(rod.node(8), (0.0, moment, 0.0), follower=True)
    simulation = scene.build(integrator="static", planar=False)
    simulation.equilibrium()
    linearisation = simulation.linearise()
    dense = eig(linearisation.stiffness, linearisation.mass)[0]
    expected = np.sort(dense.real)
    for count in (2, 6, 30):
        squares = (2.0 * np.pi * linearisation.frequencies(count)) ** 2 * np.where(
            np.real(linearisation.frequencies(count)) < 0.0, -1.0, 1.0
        )
        np.testing.assert_allclose(squares[:2].real, expected[:2], rtol=1e-4)
