"""Bodies that touch: balls that roll, slip and bounce, balls held by rods, impacts in free space, moving capsules."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import withe
from cases import measured
from convergence import assert_order, assert_order_at_least
from loose_bodies import G, assert_momenta_and_energy_stay, cloud, on_slope

Array = npt.NDArray[np.float64]
RADIUS = 0.02


def acceleration(scene: withe.Scene, ball: withe.Body, step: float) -> float:
    """Return the acceleration along x from rest, over 0.3 s [m/s^2]."""
    simulation = scene.build(time_step=step)
    simulation.step(round(0.3 / step))
    return float(simulation.position(ball)[0] / (0.5 * 0.3**2))


@pytest.mark.case("bodies", "Ball that rolls down a slope", source="5/7 g sin 25 degrees")
def test_a_ball_rolls_down_a_slope() -> None:
    """Second order in the step, for any orientation of the ball's axes."""
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        found = []
        for rotation in ((1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5), (0.6, 0.0, 0.8, 0.0)):
            scene = withe.Scene(gravity=on_slope(25.0))
            scene.add_floor(friction=0.5)
            ball = scene.add_body(withe.solids.Sphere(RADIUS), density=1000, position=(0, 0, RADIUS), rotation=rotation)
            found.append(acceleration(scene, ball, step))
        errors.append(np.abs(np.array(found) / (5.0 / 7.0 * G * np.sin(np.radians(25.0))) - 1.0).max())
    measured(errors[-1])
    assert errors[-1] < 2e-4
    assert_order(errors, 2.0)


@pytest.mark.case("bodies", "Hollow ball that rolls down a slope", source="3/5 g sin 25 degrees")
def test_a_hollow_ball_rolls_down_a_slope() -> None:
    """Its inertia is given; its solid is what touches."""
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene = withe.Scene(gravity=on_slope(25.0))
        scene.add_floor(friction=0.5)
        inertia = 2.0 / 3.0 * 0.05 * RADIUS**2
        ball = scene.add_body(withe.solids.Sphere(RADIUS), mass=0.05, inertia=inertia, position=(0, 0, RADIUS))
        errors.append(abs(acceleration(scene, ball, step) / (0.6 * G * np.sin(np.radians(25.0))) - 1.0))
    measured(errors[-1])
    assert errors[-1] < 2e-4
    assert_order(errors, 2.0)


@pytest.mark.case("bodies", "Capsule that rolls down a slope", source="g sin 25 degrees / (1 + J / m r^2)")
def test_a_capsule_rolls_down_a_slope() -> None:
    """It touches the floor at both ends of its cylinder."""
    solid = withe.solids.Capsule(RADIUS, 0.05)
    share = 1.0 / (1.0 + solid.inertia_per_mass[2, 2] / RADIUS**2)
    scene = withe.Scene(gravity=on_slope(25.0))
    scene.add_floor(friction=0.5)
    lying = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    body = scene.add_body(solid, density=1000, position=(0, 0, RADIUS), rotation=lying)
    error = acceleration(scene, body, 1e-3) / (share * G * np.sin(np.radians(25.0))) - 1.0
    measured(abs(error))
    assert error == pytest.approx(0.0, abs=1e-4)


@pytest.mark.case("bodies", "Ball in a V-groove on a slope", source="closed form")
def test_a_ball_rolls_in_a_groove() -> None:
    """It touches two walls; the arm of rolling is the distance of its centre from the line between both contacts."""
    exact = G * np.sin(np.radians(25.0)) / (1.0 + 0.4 / np.sin(np.radians(45.0)) ** 2)
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene = withe.Scene(gravity=on_slope(25.0))
        for side in (-1.0, 1.0):
            scene.add_plane((0, 0, 0), (0, side, 1), friction=0.5)
        ball = scene.add_body(withe.solids.Sphere(RADIUS), density=1000, position=(0, 0, RADIUS * np.sqrt(2.0)))
        errors.append(abs(acceleration(scene, ball, step) / exact - 1.0))
    measured(errors[-1])
    assert errors[-1] < 1e-3
    assert_order(errors, 2.0)


@pytest.mark.case("bodies", "Ball that slips down a slope", source="g (sin - mu cos), 5/2 mu g cos / r")
def test_a_ball_slips_where_friction_is_too_low_to_roll() -> None:
    """Friction 0.08 on 25 degrees, where rolling needs 0.133."""
    angle = np.radians(25.0)
    scene = withe.Scene(gravity=on_slope(25.0))
    scene.add_floor(friction=0.08)
    ball = scene.add_body(withe.solids.Sphere(RADIUS), density=1000, position=(0, 0, RADIUS))
    simulation = scene.build(time_step=1e-3)
    simulation.step(300)
    speed, spin = 0.3 * G * (np.sin(angle) - 0.08 * np.cos(angle)), 0.3 * 2.5 * 0.08 * G * np.cos(angle) / RADIUS
    error = max(abs(simulation.velocity(ball)[0] / speed - 1.0), abs(simulation.angular_velocity(ball)[1] / spin - 1.0))
    measured(error)
    assert error < 1e-3


@pytest.mark.case("bodies", "Ball that is thrown without spin", source="5/7 of its speed")
def test_a_thrown_ball_slips_until_it_rolls() -> None:
    """Angular momentum about a line of the floor stays."""
    scene = withe.Scene(gravity=(0, 0, -G))
    scene.add_floor(friction=0.2)
    ball = scene.add_body(withe.solids.Sphere(RADIUS), density=1000, position=(0, 0, RADIUS))
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(ball, (1, 0, 0))
    simulation.step(300)
    error = simulation.velocity(ball)[0] / (5.0 / 7.0) - 1.0
    measured(abs(error))
    assert error == pytest.approx(0.0, abs=1e-3)
    assert simulation.angular_velocity(ball)[1] * RADIUS == pytest.approx(5.0 / 7.0, rel=1e-3)


@pytest.mark.case("bodies", "Ball that bounces off a floor with friction", source="impulse mu (1 + e) v")
@pytest.mark.parametrize("restitution", [1.0, 0.6])
def test_a_ball_bounces_with_friction(restitution: float) -> None:
    """It slips through the whole impact: tangential impulse mu times the normal one. At (2, -3) m/s."""
    mu, arrived = 0.05, (2.0, 0.0, -3.0)
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_floor(friction=mu, restitution=restitution)
    ball = scene.add_body(withe.solids.Sphere(RADIUS), density=1000, position=(0, 0, RADIUS + 0.01))
    simulation = scene.build(time_step=2e-4)
    simulation.set_velocity(ball, arrived)
    simulation.step(100)
    kick = mu * (1.0 + restitution) * 3.0
    expected = np.array([2.0 - kick, restitution * 3.0, 2.5 * kick / RADIUS])
    velocity, spin = simulation.velocity(ball), simulation.angular_velocity(ball)[1]
    errors = np.abs(np.array([velocity[0], velocity[2], spin]) / expected - 1.0)
    measured(errors.max())
    assert errors.max() < 1e-4


@pytest.mark.case("bodies", "Ball that lies on two rods", source="elastica in the plane of each contact force")
def test_a_ball_lies_on_two_rods() -> None:
    """Guided ends. The ball comes to rest at a node or beside it, which spoils the second order of the edges.

    Each rod bends in the plane of its contact force. Balance of the ball and the elastica of half a rod, found by
    shooting, give the height of the ball.
    """
    length, radius, modulus, ball_radius, mass, gap = 0.4, 3e-3, 1e9, 0.03, 0.15, 0.04
    stiffness, height = modulus * np.pi * radius**4 / 4.0, 0.018660782238781
    errors = []
    for nodes in (21, 41, 81):
        scene = withe.Scene(gravity=(0, 0, -G))
        scene.enable_contact()
        section = withe.Stiffness(stretch=modulus * np.pi * radius**2, bend=stiffness, twist=stiffness)
        for side in (-0.5 * gap, 0.5 * gap):
            ends = [(-0.5 * length, side, 0), (0.5 * length, side, 0)]
            rod = scene.add_rod(
                start=ends[0], end=ends[1], nodes=nodes, radius=radius, stiffness=section, line_density=1e-6
            )
            for end in (rod.start, rod.end):
                scene.clamp(end, free=(1, 0, 0))
            scene.pin(rod.node(nodes // 2), free=[(0, 1, 0), (0, 0, 1)])
        drawn = np.sqrt((ball_radius + radius) ** 2 - 0.25 * gap**2) + 1e-4
        ball = scene.add_body(withe.solids.Sphere(ball_radius), mass=mass, position=(0, 0, drawn))
        simulation = scene.build(integrator="backward_euler", time_step=0.05)
        simulation.step(100)
        errors.append(abs(simulation.position(ball)[2] / height - 1.0))
    measured(errors[-1])
    assert errors[-1] < 1e-3
    assert_order_at_least(errors, 1.2)


def ball_or_capsule(draw: np.random.Generator) -> withe.solids.Solid:
    """Draw a solid with a round surface."""
    if draw.random() < 0.5:
        return withe.solids.Sphere(draw.uniform(0.008, 0.02))
    return withe.solids.Capsule(draw.uniform(0.006, 0.012), draw.uniform(0.02, 0.05))


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(6))
def test_bodies_and_rods_that_meet_keep_momenta_and_energy(seed: int, friction: float) -> None:
    """Both momenta, and the balance of energy; without friction energy, but for contacts that stiffen in impacts."""
    scene, things = cloud(seed, friction, ball_or_capsule)
    assert_momenta_and_energy_stay(scene, things, friction, angular=1e-8, total=1e-4)


def test_a_held_capsule_that_turns_pushes_rods_aside() -> None:
    """A held body is an obstacle that moves and turns in all directions; its work is booked."""
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact(friction=0.3)
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rods, half = [], np.array([0.0, 0.0, 0.05])
    for angle in np.pi * np.array([0.25, 0.75, 1.25, 1.75]):
        place = 0.08 * np.array([np.cos(angle), np.sin(angle), 0.0])
        ends = place - half, place + half
        rods.append(scene.add_rod(start=ends[0], end=ends[1], nodes=11, radius=0.004, material=rubber))
    along_x = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    wand = scene.add_body(withe.solids.Capsule(0.01, 0.2), density=500, rotation=along_x)
    scene.clamp(wand)
    simulation = scene.build(time_step=1e-3)
    energy = simulation.energy().total
    simulation.move(wand, path=lambda t: (np.zeros(3), (np.cos(1.5 * t), 0, 0, np.sin(1.5 * t))))
    simulation.step(600)
    now = simulation.energy()
    assert now.work > 1e-3
    assert now.total + now.dissipated - now.work == pytest.approx(energy, abs=1e-7 * now.work)
    assert sum(np.linalg.norm(simulation.velocities(rod).mean(axis=0)) > 0.05 for rod in rods) >= 2


def test_a_ball_on_rods_does_not_depend_on_the_axes_of_the_scene() -> None:
    """Rotation of the whole scene."""
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    found = []
    for axes in (np.eye(3), turn):
        scene = withe.Scene(gravity=axes @ (0, 0, -G))
        scene.enable_contact(friction=0.4)
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        for y in (-0.02, 0.02):
            rod = scene.add_rod(
                start=axes @ (-0.1, y, 0), end=axes @ (0.1, y, 0), nodes=15, radius=0.004, material=rubber
            )
            scene.clamp(rod.start)
            scene.clamp(rod.end)
        ball = scene.add_body(
            withe.solids.Sphere(0.025), density=300, position=axes @ (0.01, 0.002, 0.03), rotation=axes
        )
        simulation = scene.build(time_step=1e-3)
        simulation.step(60)
        assert len(simulation.contacts()) > 0
        found.append(axes.T @ simulation.position(ball))
    np.testing.assert_allclose(found[1], found[0], atol=1e-9)


@pytest.mark.parametrize("gap", [0.0, 1e-3, 0.01, 0.1])
def test_a_ball_comes_to_rest_below_where_it_was_drawn(gap: float) -> None:
    """In a search for an equilibrium: on a floor, where nothing has a stiffness, and between two rods."""
    scene = withe.Scene()
    scene.add_floor(friction=0.3)
    ball = scene.add_body(withe.solids.Sphere(RADIUS), density=300, position=(0, 0, RADIUS + gap))
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    assert simulation.position(ball)[2] == pytest.approx(RADIUS, rel=0.01)

    scene = withe.Scene()
    scene.enable_contact(friction=0.3)
    rubber = withe.Material(youngs_modulus=2e7, density=1100.0)
    for y in (-0.02, 0.02):
        rod = scene.add_rod(start=(-0.15, y, 0), end=(0.15, y, 0), nodes=31, radius=4e-3, material=rubber)
        scene.clamp(rod.start)
        scene.clamp(rod.end)
    ball = scene.add_body(withe.solids.Sphere(0.03), density=300, position=(0, 0, 0.0275 + gap))
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    assert simulation.position(ball)[2] == pytest.approx(0.0205, rel=0.01)


@pytest.mark.case("bodies", "Bar that a ball strikes off its centre", source="effective mass of the bar")
def test_a_ball_strikes_a_free_bar_off_its_centre() -> None:
    """Elastic, at 1 m/s: 1 / m = 1 / M + d^2 / J of the bar."""
    mass, ball, length, arm = 0.1, 0.05, 0.4, 0.15
    inertia = mass * length**2 / 12.0
    kick = 2.0 / (1.0 / ball + 1.0 / mass + arm**2 / inertia)
    expected = np.array([kick / ball - 1.0, -kick / mass, kick * arm / inertia])
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact()
    along_x = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    bar = scene.add_body(
        withe.solids.Capsule(5e-3, 0.39), mass=mass, inertia=(inertia, inertia, 1e-6), rotation=along_x
    )
    striker = scene.add_body(withe.solids.Sphere(0.01), mass=ball, position=(arm, 0, 0.03))
    simulation = scene.build(time_step=5e-4)
    simulation.set_velocity(striker, (0, 0, -1))
    simulation.step(200)
    velocity, spin = simulation.velocity(bar)[2], simulation.angular_velocity(bar)[1]
    found = np.array([simulation.velocity(striker)[2], velocity, spin])
    errors = np.abs(found / expected - 1.0)
    measured(errors.max())
    assert errors.max() < 1e-3


@pytest.mark.case("bodies", "Atwood's machine with a heavy rope on a pulley", source="Lagrange's equation")
def test_a_rope_turns_a_pulley() -> None:
    """The pulley is a capsule on a hinge of the world, and the rope does not slip."""
    heavy, light, density, radius, hang, pulley = 2.0, 1.0, 0.1, 0.05, 0.8, 2.0
    inertia, length = 0.5 * pulley * radius**2, 2.0 * hang + np.pi * radius
    mass = heavy + light + density * length + inertia / radius**2
    rate = np.sqrt(2.0 * density * G / mass)
    way = (heavy - light) / (2.0 * density) * (np.cosh(0.5 * rate) - 1.0)
    errors = []
    for nodes in (101, 201):
        scene = withe.Scene(gravity=(0, 0, -G))
        scene.enable_contact(friction=0.5)
        arc = np.linspace(0.0, length, nodes)
        turn = np.clip((arc - hang) / radius, 0.0, np.pi)
        below = np.minimum(arc - hang, 0.0) + np.minimum(length - hang - arc, 0.0)
        points = np.column_stack([-radius * np.cos(turn), 0.0 * arc, radius * np.sin(turn) + below])
        limp = withe.Stiffness(stretch=2e5, bend=1e-7, twist=1e-5)
        rope = scene.add_rod(points=points, radius=1e-3, stiffness=limp, line_density=density)
        inside = radius * np.cos(0.5 * length / (nodes - 1) / radius) - 1e-3  # of the chords
        along_y = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
        wheel = scene.add_body(
            withe.solids.Capsule(inside, 0.06), mass=pulley, inertia=(2e-3, 2e-3, inertia), rotation=along_y
        )
        scene.clamp(wheel, spin=(0, 1, 0))
        scene.add_mass(rope.start, heavy)
        scene.add_mass(rope.end, light)
        simulation = scene.build(time_step=2e-3, planar=False)
        simulation.step(250)
        errors.append(abs((points[0, 2] - simulation.positions(rope)[0, 2]) / way - 1.0))
    measured(errors[-1])
    assert errors[-1] < 2e-3
    assert_order_at_least(errors, 1.5)
