"""Natural frequencies of beams, rings, strings and cables, and how their modes decay."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jn_zeros

import rods
import withe
from cases import measured
from convergence import assert_order, assert_order_at_least

UP = (0.0, 0.0, 1.0)


def characteristic(ends):
    """Function with zeros at b L of a beam's modes; w = b^2 sqrt(B / rho A) [Euler; Timoshenko: Vibration problems]."""
    return {
        "clamped-free": lambda b: np.cos(b) + 1.0 / np.cosh(b),
        "clamped-clamped": lambda b: np.cos(b) - 1.0 / np.cosh(b),
        "free-free": lambda b: np.cos(b) - 1.0 / np.cosh(b),
        "clamped-pinned": lambda b: np.sin(b) - np.cos(b) * np.tanh(b),
        "pinned-free": lambda b: np.sin(b) - np.cos(b) * np.tanh(b),
        "pinned-pinned": np.sin,
        "clamped-guided": lambda b: np.sin(b) + np.cos(b) * np.tanh(b),
        "guided-free": lambda b: np.sin(b) + np.cos(b) * np.tanh(b),
        "guided-pinned": np.cos,
        "guided-guided": np.sin,
    }[ends]


def wave_numbers(ends, count):
    """First positive roots, one in every interval of pi."""
    grid = np.linspace(0.5, np.pi * (count + 2), 400 * (count + 2))
    value = characteristic(ends)
    signs = np.sign(value(grid))
    changes = np.flatnonzero(signs[:-1] * signs[1:] < 0.0)[:count]
    return np.array([brentq(value, grid[i], grid[i + 1], xtol=1e-14) for i in changes])


RIGID = {"free-free": 2, "pinned-free": 1, "guided-free": 1, "guided-guided": 1}


def held(scene, node, end):
    if end == "clamped":
        scene.clamp(node, free=(1, 0, 0))
    elif end == "pinned":
        scene.pin(node, free=(1, 0, 0))
    elif end == "guided":  # free to go sideways, not to turn
        scene.clamp(node, free=((1, 0, 0), UP))


def beam_frequencies(edges, ends, count=3):
    """First frequencies of bending in a plane [rad/s]; the beam may slide along itself, as a rigid body."""
    scene = rods.weightless()
    beam = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e4), normal=UP)
    for node, end in zip((beam.start, beam.end), ends.split("-"), strict=True):
        held(scene, node, end)
    skipped = 1 + RIGID.get(ends, 0)
    found = 2.0 * np.pi * scene.build(planar=True).linearise().frequencies(skipped + count)
    assert np.all(np.abs(found[:skipped]) < 1e-2 * found[skipped])
    return found[skipped:]


@pytest.mark.case("dynamics", "Frequencies of beams with any two ends, modes 1 to 3", source="Euler-Bernoulli beam")
@pytest.mark.parametrize(
    "ends",
    [
        "clamped-free",
        "clamped-clamped",
        "clamped-pinned",
        "pinned-free",
        "clamped-guided",
        "guided-free",
        "guided-pinned",
        "guided-guided",
    ],
)
def test_three_frequencies_of_beams_with_any_two_ends_converge(ends):
    exact = np.square(wave_numbers(ends, 3))
    errors = np.array([beam_frequencies(n, ends) for n in (20, 40, 80)]) / exact - 1.0
    print(f"beam, {ends}:", errors.tolist())
    measured(errors[-1])
    assert abs(errors[1, 0]) < 1.2e-4
    assert np.abs(errors[1]).max() < 7e-4
    for mode in errors.T:
        assert_order_at_least(mode, 2.5)


@pytest.mark.case("dynamics", "Frequencies of a ring in its plane", source="[Hoppe 1871; Love 1927, section 293]")
@pytest.mark.parametrize("n", [2, 3])
def test_a_ring_vibrates_in_its_plane_as_hoppe_has_it(n):
    """w^2 = B / (rho A R^4) n^2 (n^2 - 1)^2 / (n^2 + 1), without stretch [Hoppe 1871; Love 1927, section 293]."""
    exact = np.sqrt(n**2 * (n**2 - 1.0) ** 2 / (n**2 + 1.0))
    turn = np.linspace(0.0, 2.0 * np.pi, 9601)
    circle = np.stack([np.cos(turn), np.zeros_like(turn), np.sin(turn)], axis=1)
    errors = []
    for edges in (24, 48, 96):
        scene = rods.weightless()
        scene.add_rod(
            points=circle[:-1],
            closed=True,
            nodes=edges,
            normal=(0, 1, 0),
            radius=1e-3,
            stiffness=rods.stiffness(stretch=1e6),
            line_density=1.0,
        )
        found = 2.0 * np.pi * scene.build(planar=True).linearise().frequencies(7)
        # Three rigid motions, then every frequency twice, as waves may stand at two places.
        pair = found[3 + 2 * (n - 2) : 5 + 2 * (n - 2)]
        np.testing.assert_allclose(pair[0], pair[1], rtol=1e-4)
        errors.append(pair.mean() / exact - 1.0)
    print(f"ring, n = {n}:", errors)
    measured(errors[-1])
    assert abs(errors[-1]) < 1e-3 * (n**2 - 1.0) / 3.0
    assert_order(errors, slack=0.2)


@pytest.mark.case(
    "dynamics", "Frequencies of a pinned beam under axial force", source="w^2 = (k^4 EI + k^2 T) / (rho A)"
)
@pytest.mark.parametrize("tension", [100.0, -5.0])
def test_a_pinned_beam_under_tension_or_pressure_converges_to_its_closed_form(tension):
    """w^2 = k^4 B / rho A + k^2 T / rho A, k = n pi / L."""
    waves = np.pi * np.arange(1, 4)
    exact = np.sqrt(waves**4 + waves**2 * tension)
    errors = []
    for edges in (40, 80, 160, 320):
        scene = rods.weightless()
        beam = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e6 * abs(tension)), normal=UP)
        scene.pin(beam.start)
        scene.pin(beam.end, free=(1, 0, 0))
        scene.add_force(beam.end, (tension, 0.0, 0.0))
        simulation = rods.sharp(scene, planar=True)
        assert simulation.equilibrium().stable
        errors.append(2.0 * np.pi * simulation.linearise().frequencies(3) / exact - 1.0)
    print(f"tension {tension}:", np.array(errors).tolist())
    measured(errors[-1])
    assert np.abs(errors[0]).max() < 1.5e-3
    for mode in np.array(errors[1:]).T:
        assert_order_at_least(mode, 2.0)


@pytest.mark.case(
    "dynamics", "Frequencies of a hanging cable, modes 1 to 3", source="zeros of J0 [Daniel Bernoulli 1732]"
)
def test_a_hanging_cable_converges_to_bernoullis_frequencies():
    """w_n = j_0n / 2 sqrt(g / L), j_0n the roots of J0 [Daniel Bernoulli 1732]; it hardly bends or stretches."""
    exact = 0.5 * jn_zeros(0, 3)
    errors = []
    for edges in (25, 50, 100):
        scene = withe.Scene(gravity=(0.0, 0.0, -1.0))
        cable = rods.straight(
            scene, edges, (0, 0, -1), stiffness=rods.stiffness(bend=1e-9, twist=1e-9, stretch=1e6), normal=(1, 0, 0)
        )
        scene.pin(cable.start)
        simulation = rods.sharp(scene, planar=True)
        simulation.equilibrium()
        errors.append(2.0 * np.pi * simulation.linearise().frequencies(3) / exact - 1.0)
    print("hanging cable:", np.array(errors).tolist())
    measured(errors[-1])
    assert np.abs(errors[-1]).max() < 6e-3
    for mode in np.array(errors).T:
        assert_order_at_least(mode, 2.0)


def decay_rate(mode, edges, steps, viscous_time=0.0, drag=0.0):
    """Decay rate of a mode of a pinned beam that starts in its shape [1/s]."""
    frequency = (mode * np.pi) ** 2
    scene = rods.weightless()
    beam = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e5, viscous_time=viscous_time), normal=UP)
    scene.pin(beam.start)
    scene.pin(beam.end, free=(1, 0, 0))
    scene.add_drag(drag)
    step = 2.0 * np.pi / frequency / steps
    simulation = scene.build(
        time_step=step, planar=True, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
    )
    shape = np.sin(mode * np.pi * np.linspace(0.0, 1.0, edges + 1))
    simulation.set_velocities(beam, np.outer(1e-5 * frequency * shape, UP))
    heights = [0.0]
    for _ in range(3 * steps):
        simulation.step()
        heights.append(float(simulation.positions(beam)[:, 2] @ shape))
    # x[n+1] = 2 exp(-s dt) cos(w dt) x[n] - exp(-2 s dt) x[n-1]
    x = np.array(heights)
    _, last = np.linalg.lstsq(np.stack([x[1:-1], x[:-2]], axis=1), x[2:], rcond=None)[0]
    return -0.5 * np.log(-last) / step


@pytest.mark.case("dynamics", "Decay rate of a Kelvin-Voigt beam, modes 1 to 3", source="tau w^2 / 2")
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_modes_of_a_kelvin_voigt_beam_decay_by_half_their_frequency_squared_and_its_viscous_time(mode):
    frequency = (mode * np.pi) ** 2
    found = [decay_rate(mode, 40, n, viscous_time=0.04 / frequency) for n in (50, 100, 200)]
    errors = np.array(found) / (0.02 * frequency) - 1.0
    print(f"decay by viscosity, mode {mode}:", errors.tolist())
    measured(errors[-1])
    assert abs(errors[-1]) < 1.5e-3
    assert_order(np.diff(found))


@pytest.mark.case("dynamics", "Decay rate of a beam in drag, modes 1 to 3", source="c / (2 rho A)")
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_modes_of_a_beam_in_drag_decay_by_drag_over_twice_its_mass(mode):
    frequency = (mode * np.pi) ** 2
    drag = 0.04 * frequency
    found = [decay_rate(mode, n, 2 * n, drag=drag) for n in (40, 80, 160)]
    errors = np.array(found) / (0.5 * drag) - 1.0
    print(f"decay by drag, mode {mode}:", errors.tolist())
    # Drag acts at nodes and mass along edges, which differ by (k l)^2 / 6.
    measured(errors[-1])
    assert abs(errors[-1]) < 1e-3
    assert_order(errors, slack=0.2)
