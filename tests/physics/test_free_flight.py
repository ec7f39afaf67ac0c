"""A free rod that tumbles keeps its momentum, its angular momentum and its energy, scheme by scheme."""

import numpy as np
import pytest

import rods
import withe
from cases import measured

EDGES = 16
RADIUS = 0.08
SCHEMES = ("backward_euler", "implicit_midpoint", "energy_momentum", "fourth_order", "verlet")


def rod_points(planar, edges=EDGES):
    s = np.linspace(-0.5, 0.5, edges + 1)
    return np.stack([s, np.zeros_like(s) if planar else 0.3 * s**3, 0.25 * s**2], axis=1)


def flight(
    integrator, step, planar, spin_rate=1.0, stretch=2e3, natural="straight", edges=EDGES, adaptive=False, viscosity=0.0
):
    """A free rod, drawn bent, that tumbles, drifts and, in space, twists; straight by nature, it springs open too."""
    scene = rods.weightless()
    points = rod_points(planar, edges)
    rod = scene.add_rod(
        points=points,
        natural=natural,
        stiffness=rods.stiffness(
            bend=(1.0, 1.0) if planar else (1.0, 1.6), twist=0.8, stretch=stretch, viscous_time=viscosity
        ),
        line_density=1.0,
        radius=RADIUS,
    )
    simulation = scene.build(
        integrator=integrator,
        time_step=step,
        planar=None if planar else False,
        solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
        adaptive=adaptive,
    )
    velocities = np.cross((0.0, spin_rate, 0.0), points) + np.array((0.1, 0.0, 0.2))
    if not planar:
        velocities += np.cross((0.7 * spin_rate, 0.0, 0.4 * spin_rate), points) + np.array((0.0, 0.3, 0.0))
    simulation.set_velocities(rod, velocities)
    return simulation, rod


def masses(simulation, rod):
    """Matrix of shape (nodes, nodes), taken from the kinetic energy of one or two moving nodes at a time."""
    kept = simulation.snapshot()

    def kinetic(*moving):
        velocities = np.zeros((rod.nodes, 3))
        velocities[list(moving), 0] = 1.0
        simulation.set_velocities(rod, velocities)
        spinning = simulation.energy().kinetic
        simulation.set_velocities(rod, 2.0 * velocities)
        found = (simulation.energy().kinetic - spinning) / 3.0
        simulation.restore(kept)
        return found

    out = 2.0 * np.diag([kinetic(i) for i in range(rod.nodes)])
    for i in range(rod.nodes - 1):
        out[i, i + 1] = out[i + 1, i] = kinetic(i, i + 1) - kinetic(i) - kinetic(i + 1)
    return out


def momenta(simulation, rod, mass):
    x, v = simulation.positions(rod), simulation.velocities(rod)
    return (mass @ v).sum(axis=0), np.cross(x, mass @ v).sum(axis=0)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "verlet"])
def test_edges_carry_their_mass_along_them_but_in_explicit_steps_at_their_nodes(integrator):
    simulation, rod = flight(integrator, 1e-3, True, edges=4)
    lengths = np.linalg.norm(np.diff(rod_points(True, 4), axis=0), axis=1)
    square = np.array([[1.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0]])
    if integrator == "verlet":
        square = 0.5 * np.eye(2)
    expected = np.zeros((5, 5))
    for e, length in enumerate(lengths):
        expected[e : e + 2, e : e + 2] += length * square
    np.testing.assert_allclose(masses(simulation, rod), expected, atol=1e-12)


@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("integrator", SCHEMES)
def test_linear_momentum_is_kept_to_solver_tolerance(integrator, planar):
    simulation, rod = flight(integrator, 1e-3, planar)
    mass = masses(simulation, rod)
    before, _ = momenta(simulation, rod, mass)
    simulation.step(500)
    after, _ = momenta(simulation, rod, mass)
    np.testing.assert_allclose(after, before, atol=1e-10)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "fourth_order"])
def test_angular_momentum_is_kept_to_solver_tolerance_in_a_plane(integrator):
    simulation, rod = flight(integrator, 5e-3, True)
    mass = masses(simulation, rod)
    _, before = momenta(simulation, rod, mass)
    simulation.step(1000)
    _, after = momenta(simulation, rod, mass)
    assert abs(before[1]) > 0.05
    np.testing.assert_allclose(after, before, atol=1e-10)


@pytest.mark.case("dynamics", "Angular momentum of a free rod that twists", source="conservation")
@pytest.mark.parametrize(
    ("integrator", "viscosity"),
    [
        ("implicit_midpoint", 0.0),
        ("implicit_midpoint", 0.02),
        ("energy_momentum", 0.0),
        ("energy_momentum", 0.02),
        ("fourth_order", 0.0),  # viscosity does not allow its steps back in time
    ],
)
def test_angular_momentum_with_twist_is_kept_to_solver_tolerance(integrator, viscosity):
    """Spin about the tangents included: rho J l omega t."""
    for steps in (100, 400):
        simulation, rod = flight(
            integrator,
            1.0 / steps,
            False,
            spin_rate=2.0,
            stretch=50.0,
            natural="as_built",
            edges=8,
            viscosity=viscosity,
        )
        mass = masses(simulation, rod)
        totals = []
        for count in (0, steps):
            simulation.step(count)
            lengths = np.linalg.norm(np.diff(rod_points(False, 8), axis=0), axis=1)
            inertia = 0.5 * RADIUS**2 * lengths
            spin = (inertia * simulation.spins(rod)) @ simulation.directors(rod)[:, 2]
            totals.append(momenta(simulation, rod, mass)[1] + spin)
        # The spin matters: it is far more than what may be lost.
        assert np.linalg.norm(spin) > 1e-5 * np.linalg.norm(totals[0])
        measured(np.linalg.norm(totals[1] - totals[0]) / np.linalg.norm(totals[0]))
        assert np.linalg.norm(totals[1] - totals[0]) < 1e-10 * np.linalg.norm(totals[0])


@pytest.mark.case("dynamics", "Energy of a free rod, energy-momentum steps", source="conservation")
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("step", [2e-3, 2e-2])
def test_energy_momentum_keeps_the_energy_of_a_free_rod(step, planar):
    simulation, _ = flight("energy_momentum", step, planar, spin_rate=3.0)
    before = simulation.energy()
    drift, swing = 0.0, 0.0
    for _ in range(50):
        simulation.step(10)
        energy = simulation.energy()
        drift = max(drift, abs(energy.total - before.total))
        swing = max(swing, abs(energy.kinetic - before.kinetic))
    assert simulation.statistics.rejected_steps == 0
    assert swing > 1e-3 * before.kinetic
    measured(drift / before.kinetic)
    assert drift < 1e-9 * before.kinetic


PERIOD = 2.0 * np.pi / 4.7300408**2  # of bending, free-free beam, b = 4.7300


def drift_and_range(simulation, steps, frames=200):
    """Slope over the whole flight, and range, of the total energy, over the kinetic energy at the start."""
    before = simulation.energy().kinetic
    totals = [simulation.energy().total]
    for _ in range(frames):
        simulation.step(steps // frames)
        totals.append(simulation.energy().total)
    slope = np.polyfit(np.linspace(0.0, 1.0, len(totals)), totals, 1)[0]
    return abs(slope) / before, np.ptp(totals) / before


def test_midpoint_keeps_the_energy_of_a_free_rod_over_a_hundred_thousand_steps():
    """Steps of a twentieth of the bending period, and edges that turn by less than 0.1 rad in each."""
    simulation, _ = flight("implicit_midpoint", PERIOD / 20.0, False, spin_rate=2.0, natural="as_built", edges=6)
    drift, swing = drift_and_range(simulation, 100_000)
    assert simulation.statistics.steps == 100_000
    assert simulation.statistics.largest_turn < 0.1
    assert drift < 1e-3
    assert swing < 0.01


@pytest.mark.parametrize("integrator", ["energy_momentum", "fourth_order"])
def test_the_energy_of_a_very_slender_rod_stays_from_the_first_step(integrator):
    """L/h = 1000, where one plain midpoint step adds a third of the kinetic energy."""
    simulation, _ = flight(
        integrator, PERIOD / 20.0, False, 2.0, stretch=4e6, natural="as_built", edges=6, adaptive=True
    )
    drift, swing = drift_and_range(simulation, 4000, frames=4000)
    assert drift < 1e-6
    assert swing < 1e-6


def test_midpoint_says_so_when_edges_turn_too_far_in_a_step():
    simulation, _ = flight("implicit_midpoint", 5e-2, False, spin_rate=4.0, stretch=2e2)
    simulation.step(10)
    assert simulation.statistics.largest_turn > 0.1
