"""Floors, belts and spheres that move: what they lift, drag and shove, and the work that it takes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import withe
from cases import measured

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
RADIUS = 5e-3


def lying(friction: float = 0.0, restitution: float = 1.0) -> tuple[withe.Scene, withe.Rod, withe.Obstacle]:
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, RADIUS), end=(0.3, 0, RADIUS), nodes=21, radius=RADIUS, material=RUBBER)
    return scene, rod, scene.add_floor(friction=friction, restitution=restitution, name="table")


@pytest.mark.case("contact", "Work of a floor that lifts a rod", source="m g h")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_a_floor_that_lifts_a_rod_works_as_much_as_the_rod_gains(integrator: Any) -> None:
    scene, rod, table = lying(restitution=0.0)  # or the start and the stop of the lift would throw it
    simulation = scene.build(integrator=integrator, time_step=2e-3)
    simulation.step(100)
    start = simulation.energy()
    simulation.move(table, position=(0, 0, 0.1), over=0.5)
    simulation.step(350)
    end = simulation.energy()
    assert simulation.positions(rod)[:, 2].mean() == pytest.approx(0.1 + RADIUS, abs=0.1 * RADIUS)
    weight = 1200.0 * np.pi * RADIUS**2 * 0.3 * 9.81
    measured((end.gravity - start.gravity) / (0.1 * weight) - 1.0)
    assert end.gravity - start.gravity == pytest.approx(0.1 * weight, rel=0.01)
    work, lost = end.work - start.work, end.dissipated - start.dissipated
    assert lost > 0.0
    assert end.total - start.total == pytest.approx(work - lost, rel=1e-6)


@pytest.mark.case("contact", "Speed of a rod on a belt", source="mu g t, up to the belt's speed")
@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "anchored", "semi_explicit"])
def test_a_belt_drags_a_rod_to_its_own_speed(friction_model: Any) -> None:
    scene, _, table = lying(friction=0.4)
    scene.enable_contact(friction_model=friction_model)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.step(200)
    start = simulation.energy()
    simulation.move(table, path=lambda t: (0.5 * (t - 0.2), 0.0, 0.0))
    for steps in range(1, 5):
        simulation.step(50)
        v = simulation.velocities()[:, 0]
        speed = 0.5 * (v[1:] + v[:-1]).mean()
        measured(speed / min(0.4 * 9.81 * 0.05 * steps, 0.5) - 1.0)
        assert speed == pytest.approx(min(0.4 * 9.81 * 0.05 * steps, 0.5), rel=2e-3)
    end = simulation.energy()
    kinetic = 0.5 * 1200.0 * np.pi * RADIUS**2 * 0.3 * 0.5**2
    # While it slips a belt at constant speed gives twice what the rod gains.
    assert end.work - start.work == pytest.approx(2.0 * kinetic, rel=0.01)
    assert end.dissipated - start.dissipated == pytest.approx(kinetic, rel=0.02)


@pytest.mark.parametrize("speed", [1.0, 45.0])
def test_a_sphere_never_passes_through_the_rod_that_it_shoves(speed: float) -> None:
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(-0.15, 0.001, 0), end=(0.15, 0.001, 0), nodes=31, radius=RADIUS, material=RUBBER)
    ball = scene.add_sphere((0.0, -0.05, 0.0), 0.02)
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.move(ball, position=(0.0, 0.45, 0.0), over=0.5 / speed)
    for _ in range(int(0.5 / speed / 5e-3) + 4):
        simulation.step()
        gaps = simulation.contacts()["gap"]
        assert gaps.min(initial=0.0) > -0.05 * RADIUS
    assert simulation.positions(rod)[15, 1] > 0.45
    assert simulation.energy().work > 0.0


def test_a_moved_obstacle_is_part_of_the_state() -> None:
    scene, _, table = lying(friction=0.2)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    simulation.move(table, position=(0.02, 0, 0.05), over=0.2)
    simulation.step(50)
    half_way = simulation.snapshot()
    simulation.step(60)
    expected = simulation.positions()
    simulation.restore(half_way)
    copy = simulation.copy()
    for one in (simulation, copy):
        one.step(60)
        np.testing.assert_array_equal(one.positions(), expected)
    simulation.reset()
    simulation.step(50)
    assert simulation.positions()[:, 2].max() < 1.1 * RADIUS


def test_a_cantilever_follows_the_floor_that_bends_it() -> None:
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=21, radius=RADIUS, material=RUBBER)
    scene.clamp(rod.start)
    floor = scene.add_floor(height=-0.15)
    simulation = scene.build(integrator="static", time_step=1.0)
    simulation.move(floor, position=(0, 0, -0.02), over=4.0)
    for height in (-0.1175, -0.085, -0.0525, -0.02):
        simulation.step()
        if height > -0.1:
            assert simulation.positions(rod)[-1, 2] == pytest.approx(height + RADIUS, abs=0.02 * RADIUS)


def test_what_an_obstacle_cannot_do_is_refused() -> None:
    scene, _, table = lying()
    simulation = scene.build()
    with pytest.raises(ValueError, match="an obstacle turns by a roll about its axis"):
        simulation.move(table, position=(0, 0, 0), rotation=[[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(ValueError, match="position, roll or path of 'table' must be given"):
        simulation.move(table)
    with pytest.raises(ValueError, match="position of 'table'"):
        simulation.move("table", position=(0, 0))
    with pytest.raises(ValueError, match="path of 'table' must not be combined with position"):
        simulation.move(table, position=(0, 0, 0), path=lambda t: (0, 0, t))
    with pytest.raises(ValueError, match="over"):
        simulation.move(table, position=(0, 0, 0.1), over=-1.0)


@pytest.mark.parametrize("shape", ["floor", "ball"])
@pytest.mark.parametrize(
    ("integrator", "restitution"),
    [("implicit_midpoint", 0.0), ("implicit_midpoint", 0.5), ("energy_momentum", 0.0), ("backward_euler", 0.5)],
)
@pytest.mark.parametrize("speed", [0.5, 5.0])
def test_an_obstacle_that_meets_a_rod_at_rest_sends_it_off_as_if_the_rod_had_come(
    shape: str, integrator: Any, restitution: float, speed: float
) -> None:
    """Galilei: the energy by which gains of contact are judged is none in a frame in which the rods rest."""

    def parted(moving: bool) -> float:
        scene = withe.Scene(gravity=(0, 0, 0))
        rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
        rod = scene.add_rod(start=(-0.1, 0, 0.05), end=(0.1, 0, 0.05), nodes=6, radius=5e-3, material=rubber)
        if shape == "floor":
            body = scene.add_floor(restitution=restitution)
        else:
            body = scene.add_sphere((0, 0, -0.02), 0.02, restitution=restitution)
        duration = 0.07 / speed
        simulation = scene.build(integrator=integrator, time_step=duration / 16)
        if moving:
            height = speed * duration - (0.0 if shape == "floor" else 0.02)
            simulation.move(body, position=(0, 0, height), over=duration)
        else:
            simulation.set_velocities(rod, (0, 0, -speed))
        simulation.run(duration, progress=False)
        return float(simulation.momentum().linear[2] / (1000.0 * np.pi * 25e-6 * 0.2) / speed + (0 if moving else 1))

    assert parted(True) == pytest.approx(parted(False), abs=1e-6)
    if shape == "floor":
        assert parted(True) == pytest.approx(1.0 + restitution, abs=0.06)


@pytest.mark.parametrize("time_step", [5e-3, 5e-4])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_what_rests_on_a_floor_is_sent_off_by_restitution_when_the_floor_jumps_up(
    restitution: float, time_step: float
) -> None:
    scene = withe.Scene(gravity=(0, 0, -1.0))
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    rod = scene.add_rod(start=(-0.1, 0, 0.0051), end=(0.1, 0, 0.0051), nodes=6, radius=5e-3, material=rubber)
    floor = scene.add_floor(restitution=restitution)
    simulation = scene.build(time_step=time_step)
    simulation.run(0.2, progress=False)
    assert abs(simulation.velocities(rod)[:, 2]).max() < 5e-3
    speed, duration = 2.0, 0.03
    simulation.move(floor, position=(0, 0, speed * duration), over=duration)
    simulation.run(duration, progress=False)
    parted = simulation.momentum().linear[2] / (1000.0 * np.pi * 25e-6 * 0.2) / speed
    fallen = duration / speed if restitution > 0.0 else 0.0
    assert parted + fallen == pytest.approx(1.0 + restitution, abs=0.03)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("how", ["at once", "over a step", "by a function that jumps"])
def test_what_an_obstacle_does_at_once_it_does_within_a_time_step(how: str, restitution: float) -> None:
    """However the step is cut: 1 mm in 5 ms are 0.2 m/s, and a rod that rests on it parts with (1 + e) times that."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    rod = scene.add_rod(start=(-0.1, 0, 0.005), end=(0.1, 0, 0.005), nodes=6, radius=5e-3, material=rubber)
    floor = scene.add_floor(restitution=restitution)
    simulation = scene.build(time_step=5e-3)
    simulation.equilibrium()
    simulation.step(20)
    start = simulation.time
    if how == "by a function that jumps":  # to the same place within a shorter part at most
        simulation.move(floor, path=lambda t: (0.0, 0.0, 1e-3 if t > start else 0.0))
    else:
        simulation.move(floor, position=(0, 0, 1e-3), over=0.0 if how == "at once" else 5e-3)
    simulation.step()
    assert simulation.obstacle_position(floor)[2] == pytest.approx(1e-3, rel=1e-9)
    speed = simulation.velocities(rod)[:, 2].max()
    assert speed < (1.0 if how == "by a function that jumps" else (1.0 + restitution) * 0.2 + 0.02)


def test_an_obstacle_that_an_equilibrium_went_along_with_stays_there() -> None:
    scene = withe.Scene()
    rod = scene.add_rod(start=(-0.1, 0, 0.005), end=(0.1, 0, 0.005), nodes=6, radius=5e-3, material=RUBBER)
    floor = scene.add_floor()
    simulation = scene.build(time_step=5e-3)
    simulation.equilibrium()
    simulation.move(floor, position=(0, 0, 1e-3))
    simulation.equilibrium()
    assert simulation.obstacle_position(floor)[2] == pytest.approx(1e-3, rel=1e-12)
    simulation.step()
    assert simulation.obstacle_position(floor)[2] == pytest.approx(1e-3, rel=1e-12)
    assert abs(simulation.velocities(rod)).max() < 1e-2


def pushed(seed: int, steps: int) -> tuple[withe.Simulation, float]:
    """A rod between two clamps, and an obstacle that static steps push into it by 0.01 to 1 radii; the radius [m]."""
    draw = np.random.default_rng(seed)
    radius, nodes, weight = 3e-2 * 10 ** draw.uniform(-1.0, 0.0), int(draw.integers(11, 41)), draw.choice([0.0, 9.81])
    material = withe.Material(youngs_modulus=10 ** draw.uniform(5.0, 9.0), poisson_ratio=0.5, density=1000.0)
    scene = withe.Scene(gravity=(0.0, 0.0, -weight))
    rod = scene.add_rod(start=(0, 0, 0), end=(50 * radius, 0, 0), nodes=nodes, radius=radius, material=material)
    for end in (rod.start, rod.end):
        scene.clamp(end)
    x = 50.0 * radius * draw.uniform(0.3, 0.7)
    if draw.random() < 0.5:
        obstacle = scene.add_sphere((x, 0.0, -3.0 * radius), radius)
    else:
        obstacle = scene.add_capsule((x, -50.0 * radius, -3.0 * radius), (x, 50.0 * radius, -3.0 * radius), radius)
    simulation = scene.build(integrator="static", time_step=1.0)
    simulation.equilibrium()
    at = simulation.positions(rod)
    height = at[np.argmin(np.abs(at[:, 0] - x)), 2] - 2.0 * radius + 10 ** draw.uniform(-2.0, 0.0) * radius
    place = simulation.obstacle_position(obstacle)
    simulation.move(obstacle, position=np.add(place, (0.0, 0.0, height + 3.0 * radius)), over=float(steps))
    simulation.step(steps)
    return simulation, radius


@pytest.mark.filterwarnings("ignore::withe.BranchChangedWarning", "ignore::withe.OutOfPlaneWarning")
@pytest.mark.parametrize("steps", [1, 10])
@pytest.mark.parametrize("seed", range(12))
def test_contact_with_an_obstacle_that_is_pushed_in_static_steps_becomes_no_stiffer_than_it_need_be(
    seed: int, steps: int
) -> None:
    """Contact stores its force times a depth of some 1e-4 to 1e-2 radii; a stiffer one stores less."""
    simulation, radius = pushed(seed, steps)
    force = simulation.contacts()["normal_force"].sum()
    assert force > 0.0
    assert simulation.energy().contact > 3e-5 * force * radius


@pytest.mark.filterwarnings("ignore::withe.BranchChangedWarning", "ignore::withe.OutOfPlaneWarning")
def test_an_obstacle_that_is_pushed_in_a_static_step_ends_in_an_equilibrium() -> None:
    """Surfaces are no deeper than contact lets them be, and a second search moves nothing."""
    for seed in range(40):
        simulation, radius = pushed(seed, 1)
        before, gap = simulation.positions(), simulation.contacts()["gap"].min(initial=0.0)
        assert gap > -0.04 * radius, seed
        simulation.equilibrium()
        assert np.abs(simulation.positions() - before).max() < 1e-6 * radius, seed
