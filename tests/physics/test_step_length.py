"""Time steps that are too long for a motion give one warning with a suitable step; others give none."""

import re
import warnings

import numpy as np
import pytest

import rods
import withe

STEEL = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)
SPEED = 0.5  # [m/s]


def string(step, integrator="implicit_midpoint", mode=1):
    """A string under tension that swings in one of its modes, and its frequency [Hz]."""
    scene = rods.weightless()
    wire = scene.add_rod(start=(0, 0, 0), end=(0.65, 0, 0), nodes=41, radius=2e-4, material=STEEL, normal=(0, 0, 1))
    scene.pin(wire.start)
    scene.pin(wire.end, free=(1, 0, 0))
    scene.add_force(wire.end, (60.0, 0.0, 0.0))
    simulation = scene.build(time_step=step, planar=True, integrator=integrator, adaptive=False)
    simulation.equilibrium()
    shape = simulation.linearise().modes(mode)[-1]
    simulation.set_velocities(wire, SPEED * shape)
    return simulation, simulation.linearise().frequencies(mode)[-1]


def heard(simulation, steps=64):
    """Warnings of steps, with the suitable step."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulation.step(steps)
    found = [str(w.message) for w in caught if w.category is withe.CoarseStepWarning]
    assert len(found) <= 1
    return [(message, float(message.split("Use time_step <= ")[1].split(" s")[0])) for message in found]


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler"])
@pytest.mark.parametrize("mode", [1, 3])
def test_a_vibration_warns_where_a_step_turns_it_by_more_than_a_radian(integrator, mode):
    _, frequency = string(1e-3, mode=mode)
    radian = 1.0 / (2.0 * np.pi * frequency)
    assert not heard(string(0.8 * radian, integrator, mode)[0])
    for times in (1.25, 5.0, 50.0):
        (found,) = heard(string(times * radian, integrator, mode)[0])
        message, step = found
        # The step that would do is that of half a radian, and does. Far too long midpoint steps see hardly more than
        # that velocities turn round; then it may be shorter than it need be.
        assert step < 0.55 * radian
        if times < 10.0 or integrator == "backward_euler":
            assert step > 0.45 * radian
        assert ("damps" in message) == (integrator == "backward_euler")
        assert not heard(string(step, integrator, mode)[0])


def test_the_frequency_that_is_said_is_the_one_that_moves():
    simulation, frequency = string(5e-3)
    ((message, _),) = heard(simulation)
    assert float(message.split(" m at ")[1].split(" Hz")[0]) == pytest.approx(frequency, rel=0.05)
    # On the mean over the string and in time.
    size = SPEED / 2.0 / (2.0 * np.pi * frequency)
    assert float(message.split("of about ")[1].split(" m")[0]) == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("step", [0.05, 0.03, 0.02, 0.01])
def test_two_seconds_of_a_fall_are_long_enough_to_see_that_steps_are_too_long(step):
    """A cantilever does not vibrate at first; then its tip is 0.05 to 0.8 of its length off."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    beam = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=2e-3, material=rubber)
    scene.clamp(beam.start)
    assert len(heard(scene.build(time_step=step), round(2.0 / step))) == 1


def test_it_is_said_once():
    simulation, _ = string(5e-3)
    assert heard(simulation, 64)
    assert not heard(simulation, 256)


@pytest.mark.parametrize("integrator", ["energy_momentum", "backward_euler"])
def test_slow_motions_of_stiff_rods_do_not_warn(integrator):
    """An arm that falls and swings slowly has axial vibrations of w dt = 5,000, which carry no energy."""
    scene = withe.Scene()
    arm = rods.straight(scene, 30, stiffness=rods.stiffness(stretch=1e8, bend=5.0), radius=0.01)
    scene.clamp(arm.start)
    simulation = scene.build(time_step=0.02, integrator=integrator)
    assert not heard(simulation, 600)


def test_rest_does_not_warn():
    scene = withe.Scene()
    arm = rods.straight(scene, 30, stiffness=rods.stiffness(stretch=1e8, bend=20.0), radius=0.01)
    scene.clamp(arm.start)
    simulation = scene.build(time_step=1.0)
    simulation.equilibrium()
    assert not heard(simulation, 128)


def test_a_rod_that_spins_freely_and_falls_does_not_warn():
    scene = withe.Scene()
    rod = rods.straight(scene, 20, stiffness=rods.stiffness(stretch=1e6, bend=10.0), radius=0.01)
    simulation = scene.build(time_step=5e-3, planar=True)
    x = simulation.positions(rod)[:, 0] - 0.5
    simulation.set_velocities(rod, np.stack([0.0 * x, 0.0 * x, 10.0 * x], axis=1))
    assert not heard(simulation, 128)


@pytest.mark.parametrize("step", [1e-3, 1e-5])
def test_a_plan_says_which_vibrations_steps_resolve(step):
    scene = rods.weightless()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=1e-3, material=STEEL)
    scene.clamp(arm.start)
    simulation = scene.build(time_step=step, integrator="backward_euler")
    first = simulation.linearise().frequencies(1)[0]
    (note,) = [note for note in simulation.plan.notes if "resolve" in note]
    assert float(note.split("first is at ")[1].split(" Hz")[0]) == pytest.approx(first, rel=5e-3)
    (note,) = [note for note in simulation.plan.notes if "damps" in note]
    # Loss per period of this mode, by stepping through one period.
    angle = 2.0 * np.pi * first * step
    lost = 100.0 * (1.0 - abs(1.0 / (1.0 - 1j * angle)) ** (2.0 * np.pi / np.arctan(angle)))
    assert float(note.split("these modes by ")[1].split(" %")[0]) == pytest.approx(lost, rel=0.05)
    assert "resolve" not in str(scene.build(integrator="static").plan)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler"])
@pytest.mark.parametrize("beside", ["nothing", "an arm that swings", "a rod at rest on a floor"])
def test_other_parts_of_a_scene_do_not_drown_what_swings_too_fast(beside, integrator):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    whisker = scene.add_rod(start=(0, 0, 0.5), end=(0.03, 0, 0.5), nodes=11, radius=1e-4, material=STEEL)
    scene.clamp(whisker.start)
    if beside == "an arm that swings":
        scene.clamp(scene.add_rod(start=(0, 1, 0), end=(0.3, 1, 0), nodes=21, radius=5e-3, material=rubber).start)
    elif beside == "a rod at rest on a floor":
        scene.add_rod(start=(0, 1, 1e-3), end=(0.03, 1, 1e-3), nodes=5, radius=1e-3, material=rubber)
        scene.add_floor()
    assert len(heard(scene.build(time_step=4e-3, integrator=integrator))) == 1


def dropped(step, slope=0.05, integrator="implicit_midpoint", restitution=1.0):
    """Rebound of the middle of a soft viscous rod after a fall of 50 mm, over that height, and the warnings."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1200.0, viscosity=2e3)
    ends = 0.2 * np.array([(0, 0, 0), (np.cos(slope), 0, np.sin(slope))]) + (0, 0, 0.05)
    rod = scene.add_rod(start=ends[0], end=ends[1], nodes=21, radius=5e-3, material=rubber)
    scene.add_floor(friction=0.4, restitution=restitution)
    simulation = scene.build(time_step=step, integrator=integrator)
    found = heard(simulation, round(0.13 / step))
    heights = []
    for _ in range(round(0.12 / step)):
        simulation.step()
        heights.append(simulation.positions(rod)[:, 2].mean())
    return (max(heights) - 5e-3) / (ends[:, 2].mean() - 5e-3), found


def test_an_impact_that_steps_do_not_resolve_is_said_and_the_step_that_does():
    """Such a rod stays where it falls, by what its vibrations lose; long steps throw it back as if it were rigid."""
    converged, nothing = dropped(1e-4)
    assert converged < 0.15
    assert not nothing
    high, (found,) = dropped(5e-3)
    message, step = found
    assert high > 0.9
    assert re.match(r"impact at node \d+ of rod '.*' \(time [\d.]+ s\): the time_step of [\d.e-]+ s is longer", message)
    enough, nothing = dropped(step)
    assert enough < 0.3
    assert not nothing


def test_impacts_that_lose_what_they_are_told_to_are_resolved_as_they_are():
    for options in ({"integrator": "backward_euler"}, {"restitution": 0.0}):
        high, found = dropped(5e-3, **options)
        assert high < 0.15
        assert not any("an impact" in message for message, _ in found)


@pytest.mark.parametrize("speed", [0.005, 0.02])
def test_what_is_pressed_slowly_is_no_impact(speed):
    """Its first touch takes up much of what little moves, and nothing of what bends."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1200.0, viscosity=2e3)
    below = scene.add_rod(start=(-0.1, 0, 0), end=(0.1, 0, 0), nodes=21, radius=4e-3, material=rubber)
    above = scene.add_rod(start=(0, -0.1, 0.012), end=(0, 0.1, 0.012), nodes=21, radius=4e-3, material=rubber)
    for end in (below.start, below.end):
        scene.clamp(end)
    hands = [scene.clamp(end) for end in (above.start, above.end)]
    scene.enable_contact(friction=0.3)
    simulation = scene.build()
    for hand, y in zip(hands, (-0.1, 0.1), strict=True):
        simulation.move(hand, position=(0, y, -0.02), over=0.032 / speed)
    assert not heard(simulation, round(0.032 / speed / 5e-3))
    assert simulation.contacts()["normal_force"].sum() > 0.1
