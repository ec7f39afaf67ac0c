"""Rings that roll and cables that slide: the smooth curve of a rod touches, and not the edges between its nodes."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import withe
from cases import measured
from rods import ring_on_slope

G = 9.81
RING, THICK = 0.1, 2e-3  # [m]


def rolling_ring(degrees: float, edges: int, step: float = 1e-3, **options: Any) -> tuple[Any, Any, NDArray[Any]]:
    """A stiff ring that just touches a slope, and the direction down it."""
    points, normal, down = ring_on_slope(degrees, RING, THICK, edges)
    scene = withe.Scene()
    stiff = withe.Material(youngs_modulus=2e10, poisson_ratio=0.3, density=2000.0)
    ring = scene.add_rod(points=points, radius=THICK, material=stiff, closed=True)
    scene.add_plane((0, 0, 0), normal, friction=0.8)
    scene.ignore_contact(ring, ring)
    return scene.build(time_step=step, planar=True, **options), ring, down


def acceleration(degrees: float, edges: int, **options: Any) -> float:
    """Acceleration over that of a hoop that rolls on its surface, g sin a / (1 + k), with k = I / m (R + r)^2.

    The mass is that of straight edges, I = m R^2 (2 + cos f) / 3, where f is the angle between two edges. The
    acceleration is therefore greater by k f^2 / (6 (1 + k)) than for a round hoop, which is of second order in the
    length of an edge.
    """
    simulation, ring, down = rolling_ring(degrees, edges, **options)
    simulation.step(500)
    before = simulation.velocities(ring).mean(axis=0) @ down
    simulation.step(1000)
    gained = simulation.velocities(ring).mean(axis=0) @ down - before
    inertia = (2.0 + np.cos(2.0 * np.pi / edges)) / 3.0 * (RING / (RING + THICK)) ** 2
    return float(gained / (G * np.sin(np.radians(degrees)) / (1.0 + inertia)))


def out_of_round(edges: int) -> float:
    """Height that the curve between nodes on a circle rises and falls by: the fourth power of an edge's length [m]."""
    turn = 2.0 * np.pi / edges
    s = np.linspace(-0.5, 0.5, 101)
    radius = np.hypot(1.0 - s**2 * (1.0 - np.cos(turn)), s * np.sin(turn))
    return float(RING * np.ptp(radius))


def unevenness(degrees: float) -> float:
    """Relative change per metre of height of the speed gained between 0.5 s and 1.5 s: G = (1 + k) v dv."""
    gain = 0.5 * G * np.sin(np.radians(degrees))
    return float(0.5 * G * (1.0 / (0.5 * gain) + 1.0 / (1.5 * gain)) / gain)


@pytest.mark.case("contact", "Ring of 12 to 48 edges that rolls down a slope", source="hoop, g sin a / 2")
@pytest.mark.parametrize("degrees", [1.0, 3.0, 10.0])
def test_a_ring_of_few_edges_rolls_down_a_slope_as_a_hoop(degrees: float) -> None:
    """On its edges one of 24 stands still on 3 degrees, and is 13 to 20 % too slow on 10."""
    errors = [acceleration(degrees, n) - 1.0 for n in (12, 24, 48)]
    print("rolling ring:", degrees, errors)
    measured(errors)
    for n, error in zip((12, 24, 48), errors, strict=True):
        assert abs(error) < 0.004 + out_of_round(n) * unevenness(degrees)


@pytest.mark.parametrize("integrator", ["energy_momentum", "backward_euler"])
def test_a_ring_rolls_in_every_scheme(integrator: Any) -> None:
    """Backward Euler presses where the ring touches at the end of a step, and so resists rolling by about dt."""
    error = acceleration(3.0, 24, integrator=integrator) - 1.0
    print("rolling ring:", integrator, error)
    assert abs(error) < (0.005 if integrator == "energy_momentum" else 0.03)


def rolled(edges: int, step: float, friction: float, speed: float) -> tuple[NDArray[Any], float]:
    """Speeds of a ring on a level floor in each quarter of a second, over that with which it was sent off, and what is
    dissipated of its energy then."""
    ring, thick = 0.05, 2e-3
    turn = np.linspace(0.0, 2.0 * np.pi, edges, endpoint=False)
    points = np.stack([ring * np.sin(turn), 0.0 * turn, ring + thick - ring * np.cos(turn)], axis=1)
    scene = withe.Scene()
    stiff = withe.Material(youngs_modulus=1e9, poisson_ratio=0.3, density=1000.0)
    hoop = scene.add_rod(points=points, closed=True, radius=thick, material=stiff)
    scene.add_floor(friction=friction)
    simulation = scene.build(time_step=step)
    rate = speed / (ring + thick)
    simulation.set_velocities(hoop, rate * points[:, [2, 1, 0]] * (1.0, 0.0, -1.0))
    before = simulation.energy().kinetic
    centres = []
    for _ in range(4):
        simulation.run(0.25, progress=False)
        centres.append(simulation.positions(hoop)[:, 0].mean())
    speeds = np.diff(centres) / 0.25 / speed
    lost = simulation.energy().dissipated / before
    print("level floor:", edges, step, friction, speed, speeds, lost)
    return speeds, lost


@pytest.mark.parametrize("friction", [0.1, 0.6])
@pytest.mark.parametrize(
    ("edges", "step"), [(30, 5e-3), (60, 5e-3), (120, 1e-2), (120, 5e-3), (120, 1e-3), (240, 5e-3)]
)
def test_a_ring_that_rolls_on_a_level_floor_rolls_on(edges: int, step: float, friction: float) -> None:
    """The energy of a piece of the curve that comes onto the floor equals that of a piece that leaves. The ring begins
    with a small jump: it is drawn as it just touches, and sinks in."""
    speeds, lost = rolled(edges, step, friction, 0.2)
    assert np.all(np.abs(speeds - 1.0) < 0.01)
    assert speeds.max() < 1.0005
    assert speeds[-1] > speeds[0] - 0.002
    assert lost < 0.01


@pytest.mark.parametrize("edges", [60, 240, 480])
def test_a_ring_rolls_on_slowly_on_fine_meshes_too(edges: int) -> None:
    """The contact is a few pieces long. The initial loss is that of sinking in, m g p / 2 of m v^2."""
    speeds, _ = rolled(edges, 5e-3, 0.5, 0.05)
    assert speeds[0] > 0.9
    np.testing.assert_allclose(speeds[2:], speeds[1], rtol=5e-3)


RAIL, CABLE, PULL, FRICTION, LINE = 0.1, 2e-3, 10.0, 0.3, 0.05


def pulled_cable(edges: int, past: float) -> tuple[Any, Any, float]:
    """A cable over a rail, pulled harder than its friction holds by `past`; the length of its straight parts [m]."""
    reach, length = RAIL + CABLE, 1.2
    straight = 0.5 * (length - np.pi * reach)
    drawn = reach / np.cos(0.5 * length / edges / reach)
    s = np.linspace(0.0, length, edges + 1)
    angle = np.clip((s - straight) / reach, 0.0, np.pi)
    down = np.minimum(s - straight, 0.0) - np.maximum(s - straight - np.pi * reach, 0.0)
    points = np.stack([-drawn * np.cos(angle), 0.0 * s, drawn * np.sin(angle) + down], axis=1)
    scene = withe.Scene(gravity=(0, 0, 0))
    bending = 1e-4 * reach**2  # hardly any
    cable = scene.add_rod(
        points=points,
        radius=CABLE,
        stiffness=withe.Stiffness(stretch=2e4, bend=bending, twist=bending),
        line_density=LINE,
        natural="straight",
        normal=(0, 1, 0),
    )
    scene.add_capsule((0, -1, 0), (0, 1, 0), RAIL, friction=FRICTION)
    scene.enable_contact(slip_tolerance=1e-4, centreline_friction=True, friction_model="implicit")
    scene.ignore_contact(cable, cable)
    scene.add_force(cable.start, (0, 0, -PULL))
    scene.add_force(cable.end, (0, 0, -PULL * np.exp(FRICTION * np.pi) * (1.0 + past)))
    return scene.build(integrator="backward_euler", time_step=5e-4, planar=True), cable, straight


def sliding_speed(past: float, straight: float, time: float) -> float:
    """Speed of a cable with mass, by T' = mu (T - rho v^2) + rho a r along the rail."""
    grown, reach, speed, way, step = np.exp(FRICTION * np.pi), RAIL + CABLE, 0.0, 0.0, time / 5000
    for _ in range(5000):
        driving = PULL * grown * (1.0 + past) - LINE * speed**2 - (PULL - LINE * speed**2) * grown
        carried = straight + way + (straight - way) * grown + reach * (grown - 1.0) / FRICTION
        speed += step * driving / (LINE * carried)
        way += step * speed
    return float(speed)


@pytest.mark.parametrize("edges", [24, 48, 96])
def test_a_cable_over_a_rail_holds_below_its_limit(edges: int) -> None:
    simulation, cable, _ = pulled_cable(edges, -0.1)
    simulation.step(400)  # it is drawn off the rail, and its straight parts swing
    before = simulation.positions(cable)
    simulation.step(100)
    moved = np.abs(simulation.positions(cable) - before)[[0, -1], 2].max()
    print("cable below its limit:", moved)
    assert moved < 1e-4  # past its limit it slides by centimetres


@pytest.mark.case("contact", "Speed of a cable over a rail, 10 % past its limit", source="capstan equation")
def test_a_cable_pulled_past_its_limit_over_a_rail_slides_nearly_as_theory_has_it() -> None:
    """At a tenth past it an error of the tension ratio counts ten times."""
    errors = []
    for edges in (24, 48, 96):
        simulation, cable, straight = pulled_cable(edges, 0.1)
        simulation.step(200)
        errors.append(-simulation.velocities(cable)[-1, 2] / sliding_speed(0.1, straight, 0.1) - 1.0)
    print("cable past its limit:", errors)
    measured(errors[1:])
    assert abs(errors[0]) < 0.3
    assert np.abs(errors[1:]).max() < 0.06


def test_a_rod_of_few_edges_lies_on_a_great_sphere_with_its_curve() -> None:
    radius, sphere = 5e-3, 0.2
    scene = withe.Scene()
    soft = withe.Material(youngs_modulus=1e5, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=(-0.1, 0, sphere + radius), end=(0.1, 0, sphere + radius), nodes=9, radius=radius,
                        material=soft)  # fmt: skip
    ball = scene.add_sphere((0, 0, 0), sphere)
    scene.enable_contact(friction=0.5)
    scene.set_friction(rod, ball, 0.5)
    simulation = scene.build(time_step=2e-3, integrator="backward_euler")
    simulation.step(500)
    table = simulation.contacts()
    assert len(table) >= 5
    assert np.abs(table["gap"]).max() < 0.1 * radius
    weight = 1000.0 * np.pi * radius**2 * 0.2 * G
    forces = table["normal_force"][:, None] * table["normal"] + table["friction"]
    np.testing.assert_allclose(forces.sum(axis=0), (0.0, 0.0, weight), atol=2e-3 * weight)


def test_a_snapshot_of_a_ring_that_rolls_is_restored_to_the_bit() -> None:
    simulation, ring, _ = rolling_ring(3.0, 24)
    simulation.step(300)
    kept = simulation.snapshot()
    simulation.step(100)
    first = simulation.positions(ring)
    simulation.restore(kept)
    simulation.step(100)
    np.testing.assert_array_equal(simulation.positions(ring), first)


def cylinder(degrees: float = 0.0, friction_model: Any = "anchored", **options: Any) -> tuple[Any, Any]:
    """A straight rod of 1 cm radius and 0.2 m on a rough plane, across the fall of a slope along x."""
    slope = np.radians(degrees)
    scene = withe.Scene(gravity=(G * np.sin(slope), 0, -G * np.cos(slope)))
    rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
    rod = scene.add_rod(start=(0, -0.1, 0.01), end=(0, 0.1, 0.01), nodes=5, radius=0.01, material=rubber)
    scene.add_floor(friction=1.0)
    scene.enable_contact(rods=False, friction_model=friction_model)
    if options.pop("beside_a_tumbling_rod", False):
        soft = withe.Material(youngs_modulus=1e6, density=1000.0)
        other = scene.add_rod(start=(0, 5, 50), end=(0.3, 5, 50), nodes=11, radius=4e-3, material=soft)
        simulation = scene.build(**options)
        x = simulation.positions(other)[:, 0]
        bent = 3.0 * np.cos(3.0 * np.pi * x / 0.3)
        simulation.set_velocities(other, np.stack([0.0 * x, bent, 40.0 * (x - 0.15)], axis=1))
        return simulation, rod
    return scene.build(**options), rod


@pytest.mark.case("contact", "Cylinder that rolls by 2 rad a step", source="conservation")
@pytest.mark.parametrize("friction_model", ["anchored", "implicit", "lagged"])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_a_cylinder_that_turns_far_in_a_step_rolls_on_as_fast_as_it_came(integrator: Any, friction_model: Any) -> None:
    """2 rad a step. Friction that knew the angle and not the rate of finite turns made it spin up by a fifth."""
    simulation, rod = cylinder(integrator=integrator, friction_model=friction_model)
    simulation.set_state(rod, velocities=(4.0, 0, 0), spins=400.0)
    before = simulation.energy()
    simulation.step(100)
    after = simulation.energy()
    assert simulation.velocities(rod)[:, 0] == pytest.approx(4.0, rel=2e-3)
    assert simulation.spins(rod) == pytest.approx(400.0, rel=2e-3)
    assert after.kinetic == pytest.approx(before.kinetic, rel=2e-3)
    assert after.dissipated > -1e-9 * before.kinetic


def test_a_cylinder_rolls_down_a_slope_as_fast_whatever_else_makes_steps_conserve_energy() -> None:
    """v = 2/3 g sin(a) t, while a rod far away tumbles so that all is stepped by energy-momentum steps."""
    simulation, rod = cylinder(40.0, beside_a_tumbling_rod=True)
    simulation.step(200)
    assert simulation.statistics.energy_momentum_steps == simulation.statistics.steps
    speed = 2.0 / 3.0 * G * np.sin(np.radians(40.0)) * simulation.time
    assert simulation.velocities(rod)[:, 0].mean() == pytest.approx(speed, rel=1e-3)
    assert simulation.spins(rod).mean() == pytest.approx(speed / 0.01, rel=1e-3)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_a_cylinder_that_is_thrown_keeps_two_thirds_of_its_speed(integrator: Any) -> None:
    simulation, rod = cylinder(integrator=integrator)
    simulation.set_state(rod, velocities=(6.0, 0, 0))
    kinetic = simulation.energy().kinetic
    simulation.step(300)
    assert simulation.velocities(rod)[:, 0].mean() == pytest.approx(4.0, rel=2e-3)
    assert simulation.energy().dissipated == pytest.approx(kinetic / 3.0, rel=5e-3)


@pytest.mark.parametrize("surface", ["floor", "capsule"])
@pytest.mark.parametrize("parts", [1, 2])
def test_a_hoop_of_joined_rods_rolls_as_one_closed_rod(parts: int, surface: str) -> None:
    """The smooth curve that touches goes on from rod to rod.

    Up to the stiffness of contacts, which follows the forces on each rod.
    """
    angle = 2.0 * np.pi * np.arange(13) / 12 - np.pi / 2.0 + 0.1
    circle = 0.1 * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1) + (0.0, 0.0, 0.104)
    circle[-1] = circle[0]
    stiff = withe.Material(youngs_modulus=1e9, poisson_ratio=0.3, density=1000.0, viscosity=1e5)
    ends = []
    for pieces in (0, parts):
        scene = withe.Scene(gravity=(1.7, 0.0, -9.66))
        if pieces == 0:
            row = [scene.add_rod(points=circle[:-1], closed=True, radius=4e-3, material=stiff)]
        else:
            cuts = np.linspace(0, 12, pieces + 1).astype(int)
            row = [scene.add_rod(points=circle[a : b + 1], radius=4e-3, material=stiff) for a, b in pairwise(cuts)]
            for rod, after in zip(row, [*row[1:], row[0]], strict=True):
                scene.join(rod.end, after.start)
        if surface == "floor":
            scene.add_floor(friction=0.8)
        else:
            scene.add_capsule((-1.0, 0.0, -1.0), (1.0, 0.0, -1.0), 1.0, friction=0.8)
        scene.enable_contact(rods=False)
        simulation = scene.build(time_step=2e-3)
        simulation.step(150)
        ends.append(np.concatenate([simulation.positions(rod)[: 12 // max(pieces, 1)] for rod in row]))
    assert ends[0][:, 0].mean() > 0.01  # it has rolled
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-4)
