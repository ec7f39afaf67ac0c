"""Impacts of rigid bodies with a restitution below 1: speeds by Newton's law, friction, levers, momenta, energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import withe
from cases import measured
from loose_bodies import cloud

G = 9.81  # [m/s^2]
RADIUS = 0.02  # [m]
SCHEMES = ["energy_momentum", "implicit_midpoint"]


def ball(scene: withe.Scene, x: float, z: float) -> withe.Body:
    return scene.add_body(withe.solids.Sphere(RADIUS), density=1000, position=(x, 0, z))


@pytest.mark.case("bodies", "Ball that falls, restitution 0.6", source="Newton's restitution")
@pytest.mark.parametrize("integrator", SCHEMES)
@pytest.mark.parametrize("time_step", [4e-3, 1e-3, 2.5e-4])
def test_a_ball_bounces_at_the_right_time_with_the_right_speed(time_step: float, integrator: Any) -> None:
    scene = withe.Scene(gravity=(0, 0, -G))
    scene.add_floor(restitution=0.6)
    body = ball(scene, 0.0, RADIUS + 0.1)
    simulation = scene.build(time_step=time_step, integrator=integrator)
    fall = np.sqrt(0.2 / G)
    simulation.run(1.6 * fall, progress=False)
    since = simulation.time - fall
    speed = 0.6 * G * fall - G * since
    height = RADIUS + 0.6 * G * fall * since - 0.5 * G * since**2
    measured(abs(simulation.position(body)[2] - height), "m")
    assert simulation.velocity(body)[2] == pytest.approx(speed, abs=1e-9)
    assert simulation.position(body)[2] == pytest.approx(height, abs=5e-5)
    energy = simulation.energy()
    first = body_mass() * G * (RADIUS + 0.1)
    assert energy.total + energy.dissipated == pytest.approx(first, rel=1e-6)
    assert energy.dissipated == pytest.approx((1.0 - 0.36) * body_mass() * G * 0.1, rel=1e-3)


def body_mass() -> float:
    return 1000.0 * 4.0 / 3.0 * np.pi * RADIUS**3


@pytest.mark.case("bodies", "Ball that bounces and sticks meanwhile, restitution 0.6", source="5/7 of its speed")
@pytest.mark.parametrize("time_step", [1e-3, 2e-4])
def test_a_ball_that_sticks_in_a_bounce_rolls_off(time_step: float) -> None:
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_floor(friction=0.5, restitution=0.6)
    body = ball(scene, 0.0, RADIUS + 0.0101)
    simulation = scene.build(time_step=time_step)
    simulation.set_velocity(body, (2.0, 0.0, -3.0))
    simulation.run(0.01, progress=False)
    found = [*simulation.velocity(body), RADIUS * simulation.angular_velocity(body)[1]]
    np.testing.assert_allclose(found, [10.0 / 7.0, 0.0, 1.8, 10.0 / 7.0], atol=1.5e3 * time_step**2)


@pytest.mark.case("bodies", "Ball on a bar with a hinge, restitution 0.5", source="angular momentum about the hinge")
@pytest.mark.parametrize("place", [0.05, 0.15])
def test_a_ball_that_meets_a_bar_on_a_hinge_turns_it(place: float) -> None:
    """Spin (1 + e) m r v / (I + m r^2)."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bar = scene.add_body(withe.solids.Box((0.2, 0.02, 0.02)), density=2000, position=(0.1, 0, 0))
    scene.pin(bar.at((0, 0, 0)))
    body = ball(scene, place, 0.01 + RADIUS + 0.003)
    scene.enable_contact(restitution=0.5)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(body, (0, 0, -1.0))
    simulation.step(5)
    mass = 2000.0 * 0.2 * 0.02 * 0.02
    inertia = mass * (0.2**2 + 0.02**2) / 12.0 + mass * 0.1**2
    spin = 1.5 * body_mass() * place / (inertia + body_mass() * place**2)
    measured(abs(simulation.angular_velocity(bar)[1] / spin - 1.0))
    assert simulation.angular_velocity(bar)[1] == pytest.approx(spin, rel=1e-3)
    assert simulation.velocity(body)[2] == pytest.approx(spin * -place + 0.5, rel=1e-3)


def test_a_ball_that_meets_a_linkage_moves_all_its_bars() -> None:
    """Two equal cranks on the ground carry a bar: it goes on in parallel, with the mass M + 2 I / r^2."""
    scene = withe.Scene(gravity=(0, 0, 0))
    cranks = []
    for x in (0.0, 0.2):
        crank = scene.add_body(withe.solids.Box((0.01, 0.01, 0.1)), density=2000, position=(x, 0, -0.05), touches=False)
        scene.clamp(crank.at((x, 0, -0.1)), spin=(0, 1, 0))
        cranks.append(crank)
    bar = scene.add_body(withe.solids.Box((0.22, 0.02, 0.02)), density=2000, position=(0.1, 0, 0))
    for x, crank in zip((0.0, 0.2), cranks, strict=True):
        scene.join(crank, bar, "revolute", at=(x, 0, 0), axis=(0, 1, 0))
    ball(scene, -0.01 - RADIUS - 0.0031, 0.0)
    scene.enable_contact(restitution=0.5)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity("body 4", (1.0, 0, 0))
    simulation.step(5)
    mass, crank_mass = 2000.0 * 0.22 * 4e-4, 2000.0 * 1e-5
    inertia = crank_mass * (0.1**2 + 0.01**2) / 12.0 + crank_mass * 0.05**2
    moved = mass + 2.0 * inertia / 0.1**2
    speed = 1.5 * body_mass() / (moved + body_mass())
    assert simulation.velocity(bar)[0] == pytest.approx(speed, rel=2e-3)
    assert simulation.velocity("body 4")[0] == pytest.approx(speed - 0.5, abs=2e-3)


def test_a_bat_gives_its_speed_and_does_the_work() -> None:
    """A held box that moves up at w meets a ball that comes at v: it leaves at w + e (v + w)."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bat = scene.add_body(withe.solids.Box((0.1, 0.1, 0.02)), density=1000, position=(0, 0, -0.01))
    scene.clamp(bat)
    body = ball(scene, 0.0, RADIUS + 0.0085)
    scene.enable_contact(restitution=0.5)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(body, (0, 0, -1.0))
    simulation.move(bat, path=lambda time: ((0, 0, -0.01 + 2.0 * time), np.eye(3)))
    first = simulation.energy()
    simulation.step(10)
    assert simulation.velocity(body)[2] == pytest.approx(3.5, rel=1e-6)
    energy = simulation.energy()
    gained = energy.total - first.total
    assert energy.work - energy.dissipated == pytest.approx(gained, rel=1e-4)
    assert energy.dissipated == pytest.approx(0.5 * body_mass() * 0.75 * 9.0, rel=1e-3)


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("seed", range(6))
def test_clouds_of_bodies_and_rods_lose_energy_and_keep_momenta(seed: int, friction: float) -> None:
    draw = np.random.default_rng([7, seed])
    scene, things = cloud(seed, friction, box_or_ball)
    scene.enable_contact(friction=friction, restitution=float(draw.uniform(0.0, 0.95)))
    simulation = scene.build(time_step=1e-3)
    for thing, velocity, spin in things:
        if isinstance(thing, withe.Body):
            simulation.set_velocity(thing, velocity, angular=spin)
        else:
            simulation.set_velocities(thing, np.tile(velocity, (11, 1)))
    first, momentum = simulation.energy(), simulation.momentum()
    last = first.total
    for _ in range(300):
        simulation.step()
        energy = simulation.energy()
        assert energy.total < last + 1e-3 * first.total
        last = min(last, energy.total)
        assert energy.total + energy.dissipated == pytest.approx(first.total, abs=1e-5 * first.total)
    assert last < first.total
    now = simulation.momentum()
    np.testing.assert_allclose(now.linear, momentum.linear, atol=1e-11)
    np.testing.assert_allclose(now.angular, momentum.angular, atol=1e-7 * 0.06)


def box_or_ball(draw: np.random.Generator) -> withe.solids.Solid:
    sides = draw.uniform(0.015, 0.05, 3)
    return withe.solids.Sphere(0.5 * sides[0]) if draw.random() < 0.4 else withe.solids.Box(tuple(sides))


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_boxes_that_fall_come_to_rest_in_steps_that_are_hardly_divided(restitution: float) -> None:
    """Steps once were as short as a twelfth of an impact, a thousandth of these."""
    draw = np.random.default_rng(3)
    scene = withe.Scene(gravity=(0, 0, -G))
    scene.add_floor(friction=0.4, restitution=restitution)
    scene.enable_contact(friction=0.4, restitution=restitution)
    boxes = []
    for i in range(4):
        turn = np.array([1.0, *(0.02 * draw.normal(size=3))])
        place = (0.2 * i, 0, 0.08)
        boxes.append(
            scene.add_body(
                withe.solids.Box((0.1, 0.1, 0.1)), density=1000, position=place, rotation=turn / np.linalg.norm(turn)
            )
        )
    simulation = scene.build(time_step=1e-3)
    simulation.step(400)
    assert simulation.statistics.steps < 500
    for box in boxes:
        assert simulation.position(box)[2] == pytest.approx(0.05, abs=1e-5)
        assert np.abs(simulation.velocity(box)).max() < 5e-4


def test_impacts_do_not_depend_on_the_axes_of_the_scene() -> None:
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    found = []
    for axes in (np.eye(3), turn):
        scene = withe.Scene(gravity=axes @ (0.0, 0.0, -G))
        scene.add_plane((0, 0, 0), axes @ (0, 0, 1), friction=0.3, restitution=0.4)
        lean = withe.solids.Box((0.05, 0.04, 0.03))
        tilt = np.linalg.qr(np.random.default_rng(6).normal(size=(3, 3)))[0]
        tilt *= np.linalg.det(tilt)
        box = scene.add_body(lean, density=1000, position=axes @ (0, 0, 0.06), rotation=axes @ tilt)
        simulation = scene.build(time_step=1e-3)
        simulation.set_velocity(box, axes @ (0.3, 0.1, -1.0))
        simulation.step(60)
        found.append(simulation.position(box) @ axes)
    np.testing.assert_allclose(found[1], found[0], atol=1e-7)
