"""A rod whose natural length changes, as a muscle's does: forces, lengths, work and waves are those of theory."""

import numpy as np
import pytest
from scipy.optimize import brentq

import rods
import withe

EA = 40.0
INTEGRATORS = ("static", "backward_euler", "implicit_midpoint", "energy_momentum", "fourth_order", "verlet")


def muscle(integrator, planar, *, held=True, mass=0.0, **build):
    """A straight rod of 1 m, clamped at its start, and at its end if held."""
    scene = rods.weightless()
    direction = (1.0, 0.0, 0.0) if planar else (0.6, 0.48, 0.64)
    rod = rods.straight(scene, 16, direction, stiffness=rods.stiffness(stretch=EA), radius=0.02)
    scene.clamp(rod.start)
    if held:
        scene.clamp(rod.end)
    if mass:
        scene.add_mass(rod.end, mass)
    options = {"time_step": 5e-4, "solver": withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)} | build
    return scene.build(integrator=integrator, planar=planar, **options), rod, np.array(direction)


@pytest.mark.case("actuation", "Force of a held rod whose natural length changes", source="EA e")
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("strain", [0.01, -0.01])
def test_a_held_rod_pulls_by_what_its_natural_length_is_shorter(integrator, planar, strain):
    simulation, rod, along = muscle(integrator, planar)
    simulation.set(rod, natural_stretch=1.0 + strain)
    assert simulation.tensions(rod) == pytest.approx(np.full(16, -EA * strain), rel=1e-12)
    energy = simulation.energy()
    assert (energy.stretch, energy.work) == pytest.approx((0.5 * EA * strain**2,) * 2, rel=1e-12)
    simulation.step(3)
    assert simulation.tensions(rod) == pytest.approx(np.full(16, -EA * strain), rel=1e-9)
    # The support at the end pulls as the rod does, the other way.
    assert simulation.reaction(rod.end).force == pytest.approx(-EA * strain * along, abs=1e-9 * EA)
    assert simulation.energy().work == pytest.approx(energy.work, rel=1e-9)


@pytest.mark.parametrize("planar", [True, False])
def test_a_free_rod_becomes_as_long_as_it_is_by_nature(planar):
    simulation, rod, along = muscle("static", planar, held=False)
    stretch = np.linspace(0.7, 1.4, 16)
    simulation.set(rod, natural_stretch=stretch)
    simulation.equilibrium()
    lengths = np.linalg.norm(np.diff(simulation.positions(rod), axis=0), axis=1)
    assert lengths == pytest.approx(stretch / 16.0, rel=1e-10)
    assert simulation.energy().stretch < 1e-18
    assert np.array_equal(simulation.get(rod, "natural_stretch"), stretch)
    assert simulation.positions(rod)[-1] == pytest.approx(along * stretch.mean(), rel=1e-10)


@pytest.mark.case("actuation", "Work of a muscle that lifts a weight", source="m g e L and energy of stretching")
def test_a_muscle_lifts_a_weight_by_its_strain_and_does_the_work_of_it():
    # In a quasi-static ramp of the strain s the force W stays, and so does the stretching: the work is W L s.
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = rods.straight(scene, 8, (0, 0, -1.0), stiffness=rods.stiffness(stretch=EA), radius=0.02)
    scene.clamp(rod.start)
    scene.add_force(rod.end, (0, 0, -2.0))
    simulation = scene.build(
        integrator="static", time_step=0.1, solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
    )
    simulation.equilibrium()
    before, height = simulation.energy(), simulation.positions(rod)[-1, 2]
    simulation.set(rod, natural_stretch=0.8, over=1.0)
    simulation.step(10)
    after = simulation.energy()
    assert simulation.positions(rod)[-1, 2] - height == pytest.approx(0.2, rel=1e-10)
    # Each of ten steps changes the natural length before the weight follows: EA ds^2 / 2 of each is lost.
    assert after.work - before.work == pytest.approx(2.0 * 0.2 + 10 * 0.5 * EA * 0.02**2, rel=1e-9)
    assert after.stretch == pytest.approx(before.stretch, rel=1e-9)


@pytest.mark.case("actuation", "Overshoot of a muscle with a mass at its end", source="2 e L [Rao, section 9.4]")
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "fourth_order", "verlet"])
def test_a_sudden_natural_length_swings_to_twice_itself(integrator, planar):
    # A mass M at the end of a rod of mass m: w = x sqrt(EA / m), cot x = x M / m [Rao, Vibration of Continuous Systems,
    # section 9.4]. The error of the mesh is of second order.
    mass, strain = 50.0, 0.02
    x = brentq(lambda x: x * np.tan(x) - 1.0 / mass, 1e-3, 1.0)
    steps = 20000 if integrator == "verlet" else 2000
    period = 2.0 * np.pi / (x * np.sqrt(EA))
    simulation, rod, along = muscle(integrator, planar, held=False, mass=mass, time_step=period / steps)
    simulation.set(rod, natural_stretch=1.0 + strain)
    simulation.step(steps // 2)
    assert simulation.positions(rod)[-1] @ along - 1.0 == pytest.approx(2.0 * strain, rel=2e-3)
    assert simulation.energy().kinetic < 1e-3 * simulation.energy().work
    simulation.step(steps // 2)
    assert simulation.positions(rod)[-1] @ along - 1.0 == pytest.approx(0.0, abs=2e-3 * strain)


def test_a_step_in_which_edges_turn_far_keeps_its_energy_at_another_natural_length():
    # A rod that spins while it is 20 % longer by nature than drawn.
    scene = rods.weightless()
    rod = rods.straight(scene, 8, stiffness=rods.stiffness(stretch=1e3), radius=0.02)
    simulation = scene.build(
        time_step=0.05, planar=False, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
    )
    simulation.set(rod, natural_stretch=1.2)
    start = np.linspace(0.0, 1.0, 9)[:, None] * np.array([1.0, 0.0, 0.0])
    simulation.set_state(rod, positions=1.2 * start, velocities=np.cross((0.0, 3.0, 0.5), start - [0.5, 0, 0]))
    energy = simulation.energy().total
    simulation.step(100)
    assert simulation.energy().total == pytest.approx(energy, rel=1e-9)


def test_what_is_wrong_with_a_natural_stretch_is_named():
    simulation, rod, _ = muscle("static", planar=True)
    name = rod.name
    with pytest.raises(ValueError, match=f"natural_stretch of rod '{name}' must be positive, got 0"):
        simulation.set(rod, natural_stretch=0.0)
    with pytest.raises(ValueError, match=rf"natural_stretch of rod '{name}' must have shape \(16,\), got \(15,\)"):
        simulation.set(rod, natural_stretch=np.ones(15))
    with pytest.raises(ValueError, match="over must not be negative"):
        simulation.set(rod, natural_stretch=1.1, over=-1.0)
    assert np.array_equal(simulation.get(rod, "natural_stretch"), np.ones(16))
