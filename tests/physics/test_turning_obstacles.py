"""Obstacles that turn drag rods by friction: turntables, rollers, balls; what they do is what rods gain and lose."""

import numpy as np
import pytest

import withe

GRAVITY, RADIUS, LENGTH = 9.81, 5e-3, 0.2
STEEL = {"youngs_modulus": 2e8, "poisson_ratio": 0.3, "density": 1000.0}


def balances(simulation):
    energy = simulation.energy()
    return energy.total + energy.dissipated - energy.work


@pytest.mark.case("contact", "Rod on a turntable", source="3 mu g / L")
@pytest.mark.parametrize("friction_model", ["anchored", "implicit", "lagged"])
def test_turntable_turns_a_rod_by_the_torque_of_its_friction(friction_model):
    """mu w L^2 / 4 on m L^2 / 12: 3 mu g / L, until it turns with the table."""
    mu, rate = 0.2, 5.0
    scene = withe.Scene()
    rod = scene.add_rod(
        start=(-LENGTH / 2, 0, RADIUS),
        end=(LENGTH / 2, 0, RADIUS),
        nodes=21,
        radius=RADIUS,
        material=withe.Material(**STEEL),
    )
    table = scene.add_floor(friction=mu)
    scene.enable_contact(friction_model=friction_model)
    simulation = scene.build(time_step=1e-3, integrator="backward_euler")
    simulation.run(0.05, progress=False)
    before = balances(simulation)
    simulation.move(table, roll=rate * 1.0, over=1.0)
    simulation.run(0.1, progress=False)
    # along y, whose speed is that of the turn; a rod also rolls about itself, which takes from the slip at first
    turning = 3 * mu * GRAVITY / LENGTH * 0.1
    x, v = simulation.positions(rod), simulation.velocities(rod)
    assert np.cross(x[-1] - x[0], v[-1] - v[0])[2] / LENGTH**2 == pytest.approx(turning, rel=0.06)
    simulation.run(0.7, progress=False)
    x, v = simulation.positions(rod), simulation.velocities(rod)
    assert np.cross(x[-1] - x[0], v[-1] - v[0])[2] / LENGTH**2 == pytest.approx(rate, rel=0.01)
    energy = simulation.energy()
    assert energy.work == pytest.approx(energy.total + energy.dissipated - before, rel=0.05)


@pytest.mark.case("contact", "Rod on rollers", source="mu g t, up to the surface's speed")
@pytest.mark.parametrize("planar", [True, False])
def test_rollers_carry_a_rod_off_at_the_speed_of_their_surface(planar):
    """By mu g at first; in a plane that stands across them, and in space."""
    mu, drum, speed = 0.3, 0.03, 0.25
    scene = withe.Scene()
    height = drum + RADIUS
    rod = scene.add_rod(
        start=(-LENGTH, 0, height), end=(LENGTH, 0, height), nodes=41, radius=RADIUS, material=withe.Material(**STEEL)
    )
    drums = [scene.add_capsule((x, -0.1, 0), (x, 0.1, 0), drum, friction=mu, name=f"drum {x}") for x in (-0.1, 0.1)]
    simulation = scene.build(time_step=1e-3, planar=planar)
    simulation.run(0.05, progress=False)
    start, before = simulation.positions(rod).mean(axis=0), simulation.momentum().linear
    for one in drums:
        simulation.move(one, roll=speed / drum, over=1.0)
    simulation.run(0.05, progress=False)
    assert simulation.plan.planar == planar
    rise = simulation.momentum().linear[2] - before[2]
    pushed = mass(rod) * GRAVITY * 0.05 + rise  # by normal forces, which swing as the rod does on the drums
    # The rod sags between the drums, so that normal forces lean by half a hundredth.
    assert simulation.momentum().linear[0] == pytest.approx(mu * pushed, rel=0.02)
    contacts = simulation.contacts()
    assert contacts["friction"][:, 0].sum() == pytest.approx(mu * contacts["normal_force"].sum(), rel=1e-3)
    simulation.run(0.15, progress=False)
    assert simulation.velocities(rod)[:, 0].mean() == pytest.approx(speed, rel=0.01)
    slipping = speed / (mu * GRAVITY)
    way = simulation.positions(rod).mean(axis=0)[0] - start[0]
    assert way == pytest.approx(speed * (0.2 - slipping / 2), rel=0.02)


def mass(rod):
    return 1000.0 * np.pi * RADIUS**2 * 2 * LENGTH


@pytest.mark.case("contact", "Rod on bearings that a drum spins", source="gears, -R / r")
@pytest.mark.parametrize("kind", ["capsule", "sphere"])
def test_drum_spins_a_rod_on_bearings_as_gears_would(kind):
    """Surfaces that do not slip: -R / r times the drum's rate."""
    drum, rate = 0.03, 2.0
    height = drum + RADIUS
    scene = withe.Scene()
    rod = scene.add_rod(
        start=(0, -0.05, height), end=(0, 0.05, height), nodes=11, radius=RADIUS, material=withe.Material(**STEEL)
    )
    scene.pin(rod.start), scene.pin(rod.end)
    scene.add_load(rod, (0, 0, -2.0))
    if kind == "capsule":
        turning = scene.add_capsule((0, -0.04, 0), (0, 0.04, 0), drum, friction=0.5)
    else:
        turning = scene.add_sphere((0, 0, 0), drum, friction=0.5)
    simulation = scene.build(time_step=1e-3)
    simulation.move(turning, roll=rate, tangent=None if kind == "capsule" else (0, 1, 0), over=1.0)
    simulation.run(0.3, progress=False)
    spins = [simulation.spins(rod).mean()]
    for _ in range(50):
        simulation.step()
        spins.append(simulation.spins(rod).mean())
    assert np.mean(spins) == pytest.approx(-rate * drum / RADIUS, rel=0.02)


@pytest.mark.case("contact", "Work of a roller on a held rod", source="mu N R phi")
def test_work_of_a_roller_is_the_torque_of_friction_times_its_turn():
    """On a rod that is held: all of it is lost to friction, mu N R a turn of one radian."""
    mu, drum = 0.3, 0.03
    height = drum + RADIUS
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(
        start=(-0.05, 0, height), end=(0.05, 0, height), nodes=11, radius=RADIUS, material=withe.Material(**STEEL)
    )
    for end in (rod.start, rod.end):
        scene.clamp(end)
    scene.add_load(rod, (0, 0, -50.0))
    roller = scene.add_capsule((0, -0.1, 0), (0, 0.1, 0), drum, friction=mu)
    simulation = scene.build(time_step=1e-3, integrator="backward_euler")
    simulation.run(0.3, progress=False)
    simulation.move(roller, roll=10.0, over=10.0)
    simulation.run(0.2, progress=False)
    before = simulation.energy()
    simulation.run(0.2, progress=False)
    after, normal = simulation.energy(), simulation.contacts()["normal_force"].sum()
    assert after.work - before.work == pytest.approx(mu * normal * drum * 0.2, rel=1e-3)
    assert after.dissipated - before.dissipated == pytest.approx(mu * normal * drum * 0.2, rel=1e-3)


def test_full_turns_count_and_a_path_may_roll():
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 1), end=(1, 0, 1), nodes=3, radius=RADIUS, material=withe.Material(**STEEL))
    drum = scene.add_capsule((0, 0, 0), (0, 0.1, 0), 0.01)
    ball = scene.add_sphere((0.5, 0, 0), 0.01)
    simulation = scene.build(time_step=1e-3, planar=False)
    simulation.move(drum, roll=100.0, over=1e-2)
    simulation.move(ball, path=lambda t: ((0.5, 0, 0), (0, 0, 3 * t)))
    kept = simulation.snapshot()
    simulation.step(10)
    np.testing.assert_allclose(simulation._session.world.obstacle_turn(0), (0, 100, 0))
    np.testing.assert_allclose(simulation._session.world.obstacle_turn(1), (0, 0, 0.03))
    simulation.restore(kept)
    np.testing.assert_allclose(simulation._session.world.obstacle_turn(0), 0)


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        ("drum", {"rotation": np.eye(3)}, "obstacle turns by a roll about its axis"),
        ("drum", {"roll": 1.0, "tangent": (0, 0, 1)}, "tangent of 'drum' must be None"),
        ("ball", {"roll": 1.0}, "tangent of 'ball' must be given"),
        ("ball", {}, "position, roll or path of 'ball' must be given"),
    ],
)
def test_how_an_obstacle_turns_is_said_where_it_is_asked_wrongly(name, words, message):
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 1), end=(1, 0, 1), nodes=3, radius=RADIUS, material=withe.Material(**STEEL))
    scene.add_capsule((0, 0, 0), (0, 0.1, 0), 0.01, name="drum")
    scene.add_sphere((0.5, 0, 0), 0.01, name="ball")
    simulation = scene.build()
    with pytest.raises(ValueError, match=message):
        simulation.move(name, **words)
