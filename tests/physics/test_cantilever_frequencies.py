"""Natural frequencies of a cantilever against Euler and Bernoulli."""

import numpy as np
import pytest

import rods
import theory
from cases import measured
from convergence import assert_order

PROBE = 1e-7


def frequencies(nodes, hold="frame"):
    """First three bending modes [rad/s]; in space each comes twice."""
    scene = rods.weightless()
    # Stretching and twisting are much faster, yet not so much that they cost digits.
    arm = rods.straight(scene, nodes - 1, stiffness=rods.stiffness(stretch=1e5, twist=100.0), radius=0.05)
    scene.clamp(arm.start, hold=hold)
    modes = 2.0 * np.pi * scene.build().linearise().frequencies(6)
    np.testing.assert_allclose(modes[::2], modes[1::2], rtol=1e-6)
    return modes[::2]


def frequencies_from_answers(nodes):
    """Column j of the flexibility is the deflection under a small force at node j; masses are twice energies."""
    scene = rods.weightless()
    arm = rods.straight(scene, nodes - 1)
    scene.clamp(arm.start)
    push = scene.add_force(arm.end, (0.0, 0.0, 0.0))
    free = np.arange(1, nodes)
    pushes = {int(i): scene.add_force(arm.node(int(i)), (0.0, 0.0, 0.0)) for i in free[:-1]}
    pushes[nodes - 1] = push
    simulation = rods.sharp(scene)

    flexibility = np.empty((len(free), len(free)))
    for column, i in enumerate(free):
        simulation.set(pushes[int(i)], force=(0.0, 0.0, PROBE))
        simulation.equilibrium()
        flexibility[:, column] = simulation.positions(arm)[free, 2] / PROBE
        simulation.set(pushes[int(i)], force=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(flexibility, flexibility.T, atol=1e-6 * flexibility.max())

    def kinetic(*moving):
        velocities = np.zeros((nodes, 3))
        velocities[list(moving), 2] = 1.0
        simulation.set_velocities(arm, velocities)
        return simulation.energy().kinetic

    masses = 2.0 * np.diag([kinetic(i) for i in free])
    for row, i in enumerate(free[:-1]):
        masses[row, row + 1] = masses[row + 1, row] = kinetic(i, i + 1) - kinetic(i) - kinetic(i + 1)
    root = np.linalg.cholesky(masses)
    values = np.linalg.eigvalsh(root.T @ flexibility @ root)
    return 1.0 / np.sqrt(values[::-1][:3])


EXACT = np.square(theory.CANTILEVER_ROOTS)


@pytest.mark.case(
    "dynamics", "Frequencies of a cantilever, modes 1 to 3, 201 nodes", source="Euler-Bernoulli beam, cos b cosh b = -1"
)
def test_first_three_frequencies_are_theirs_at_201_nodes():
    assert pytest.approx((1.87510, 4.69409, 7.85476), abs=1e-5) == theory.CANTILEVER_ROOTS
    errors = frequencies(201) / EXACT - 1.0
    print("frequencies off by", ", ".join(f"{error:.5%}" for error in errors))
    measured(errors)
    assert np.all(np.abs(errors) < (0.5e-4, 2e-4, 4e-4)), errors


def test_linearised_equations_have_the_frequencies_of_what_the_engine_answers():
    np.testing.assert_allclose(frequencies(51), frequencies_from_answers(51), rtol=1e-6)


@pytest.mark.case(
    "dynamics", "Frequencies of a cantilever, modes 1 to 3, 41 nodes", source="Euler-Bernoulli beam, cos b cosh b = -1"
)
def test_frequencies_of_a_cantilever_converge_at_third_order():
    errors = np.array([frequencies(n) for n in (11, 21, 41)]) / EXACT - 1.0
    measured(errors[-1])
    for mode in errors.T:
        assert_order(mode, order=3.0, slack=0.3)


def supported(edges, ends):
    """The first frequency of a beam in its plane, with free or pinned ends, over the exact one."""
    scene = rods.weightless()
    beam = rods.straight(
        scene, edges, stiffness=rods.stiffness(stretch=1e5, twist=100.0), radius=0.05, normal=(0, 1, 0)
    )
    if ends == "pinned":
        scene.pin(beam.start)
        scene.pin(beam.end, free=(1, 0, 0))
    rigid = {"free": 3, "pinned": 0}[ends]
    exact = {"free": 4.730040744862704, "pinned": np.pi}[ends] ** 2
    modes = 2.0 * np.pi * scene.build(planar=True).linearise().frequencies(rigid + 1)
    return modes[rigid] / exact - 1.0


@pytest.mark.case("dynamics", "Frequencies of free and pinned beams", source="Euler-Bernoulli beam")
@pytest.mark.parametrize(("ends", "lumped"), [("free", 4.11), ("pinned", 0.822)])
def test_frequencies_of_free_and_pinned_beams_converge_faster_than_with_lumped_masses(ends, lumped):
    """Mass that edges carry along them, to a pin too, leaves the edge length to the fourth power; lumped masses -4.11
    and -0.822 times its square over that of the beam."""
    edges = np.array((8, 16, 32))
    errors = np.array([supported(n, ends) for n in edges])
    measured(errors[-1])
    assert_order(errors, order=4.0, slack=0.3)
    assert abs(errors[-1]) * edges[-1] ** 2 < 0.01 * lumped


@pytest.mark.case(
    "dynamics", "Discretisation error of a cantilever's frequencies", source="Gregory's formula, s^2 b^2 l^3 / 6"
)
def test_frequencies_of_a_cantilever_are_off_by_what_its_clamp_bends_too_far():
    """Gregory's formula: with one correction at the wall, the bending energy there is too large.

    The excess is (l^3 / 24) (M^2)'' / 2 B = l^3 M'(0)^2 / (24 B). The frequency of a mode cosh - cos - s (sinh - sin)
    with wave number b is therefore too low by the relative error s^2 b^2 l^3 / 6.
    """
    edges = 40
    errors = frequencies(edges + 1) / EXACT - 1.0
    b = np.array(theory.CANTILEVER_ROOTS)
    s = (np.sinh(b) - np.sin(b)) / (np.cosh(b) + np.cos(b))
    np.testing.assert_allclose(errors[:2] * edges**3, -((s * b) ** 2)[:2] / 6.0, rtol=0.03)


def test_frequencies_of_a_rod_held_by_its_first_edge_converge_at_first_order_only():
    errors = np.array([frequencies(n, "edge") for n in (51, 101, 201)]) / EXACT - 1.0
    for mode in errors.T:
        assert_order(mode, order=1.0)
    # The beam is half an edge shorter, and otherwise right.
    np.testing.assert_allclose(errors[-1], (1.0 - 1.0 / 400.0) ** -2 - 1.0, atol=5e-5)


@pytest.mark.case("dynamics", "Torsional wave in a rod that is let go", source="wave equation, period 4 L / c")
def test_torsional_wave_returns_after_four_lengths():
    """Let go from even twist, the free end swings as a triangle wave: c = sqrt(C / rho J), period 4 L / c."""
    radius, twist = 0.1, 0.7
    inertia = 0.5 * radius**2  # rho J of a circle of unit mass per length
    scene = rods.weightless()
    rod = rods.straight(
        scene, 200, stiffness=rods.stiffness(twist=twist, stretch=1e3), radius=radius, normal=(0.0, 1.0, 0.0)
    )
    scene.clamp(rod.start)
    period = 4.0 / np.sqrt(twist / inertia)
    simulation = scene.build(time_step=period / 800, planar=False)
    simulation.set(rod, natural_twist=0.1)
    angles = []
    for _ in range(4):
        simulation.step(200)
        d1 = simulation.directors(rod)[-1, 0]
        angles.append(np.arctan2(d1[2], d1[1]))
    np.testing.assert_allclose(angles, (0.1, 0.2, 0.1, 0.0), atol=2e-3)
