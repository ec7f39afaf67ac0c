"""Bodies with flat faces: boxes that slide, tip, rock, stack and meet, and what lies on them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import withe
from cases import measured
from loose_bodies import G, assert_momenta_and_energy_stay, cloud, on_slope

Array = npt.NDArray[np.float64]
BLOCK = (0.04, 0.04, 0.10)


def table(scene: withe.Scene, friction: float) -> withe.Body:
    """Add a held box whose upper face is at z = 0."""
    body = scene.add_body(withe.solids.Box((1.0, 1.0, 0.1)), density=1000, position=(0, 0, -0.05))
    scene.clamp(body)
    scene.enable_contact(friction=friction)
    return body


def ground(scene: withe.Scene, kind: str, friction: float) -> None:
    """Add a floor, or a table."""
    if kind == "floor":
        scene.add_floor(friction=friction)
    else:
        table(scene, friction)


@pytest.mark.parametrize("kind", ["floor", "table"])
@pytest.mark.case("bodies", "Box that slides down a slope", source="g (sin 20 - 0.2 cos 20 degrees)")
def test_a_box_slides_down_a_slope(kind: str) -> None:
    """With the acceleration of Coulomb's law, and does not turn."""
    scene = withe.Scene(gravity=on_slope(20.0))
    ground(scene, kind, 0.2)
    box = scene.add_body(withe.solids.Box((0.1, 0.08, 0.04)), density=1000, position=(0, 0, 0.02), friction=0.2)
    simulation = scene.build(time_step=2e-3)
    simulation.step(150)
    way = 0.5 * 0.3**2 * G * (np.sin(np.radians(20.0)) - 0.2 * np.cos(np.radians(20.0)))
    error = abs(simulation.position(box)[0] / way - 1.0)
    measured(error)
    assert error < 1e-6
    np.testing.assert_allclose(simulation.rotation(box), np.eye(3), atol=1e-6)


@pytest.mark.parametrize("kind", ["floor", "table"])
@pytest.mark.case("bodies", "Least friction that holds a box", source="tan 20 degrees")
def test_a_box_slides_below_the_angle_of_friction_only(kind: str) -> None:
    """The threshold is within a thousandth."""
    moved = []
    for share in (0.999, 1.001):
        mu = share * np.tan(np.radians(20.0))
        scene = withe.Scene(gravity=on_slope(20.0))
        ground(scene, kind, mu)
        box = scene.add_body(withe.solids.Box((0.1, 0.08, 0.04)), density=1000, position=(0, 0, 0.02), friction=mu)
        simulation = scene.build(time_step=2e-3)
        simulation.step(500)
        moved.append(simulation.position(box)[0])
    assert moved[0] > 1e-3
    assert moved[1] < 1e-6
    measured(1e-3)


@pytest.mark.parametrize("kind", ["floor", "table"])
@pytest.mark.case("bodies", "Slope on which a box tips", source="arctan(b / h)")
def test_a_box_tips_from_its_edge(kind: str) -> None:
    """The threshold is within 0.02 degrees, rounded edges included."""
    leaning = []
    for degrees in (21.78, 21.82):
        scene = withe.Scene(gravity=on_slope(degrees))
        ground(scene, kind, 1.0)
        box = scene.add_body(withe.solids.Box(BLOCK), density=1000, position=(0, 0, 0.05), friction=1.0)
        simulation = scene.build(time_step=2e-3)
        most = 0.0
        for _ in range(10):
            simulation.step(100)
            most = max(most, float(simulation.rotation(box)[0, 2]))
        leaning.append(most)
    assert leaning[0] < 1e-3
    assert leaning[1] > 0.1
    measured(0.02 / 21.8)


@pytest.mark.case("bodies", "Rocking block, first quarter", source="Housner 1963, elliptic integral")
def test_a_block_rocks() -> None:
    """From half of the angle at which it would fall, until it strikes with its other edge."""
    base, height = BLOCK[0], BLOCK[2]
    half = np.arctan2(base, height)
    angle = 0.5 * half
    rate = np.sqrt(3.0 * G / (2.0 * np.hypot(base, height)))
    u = np.sqrt(angle) * (0.5 - 0.5 * np.cos(np.pi * (np.arange(2000) + 0.5) / 2000))
    weights = np.sqrt(angle) * 0.5 * np.sin(np.pi * (np.arange(2000) + 0.5) / 2000) * np.pi / 2000
    fall = np.cos(half - angle) - np.cos(half - angle + u**2)
    exact = float((2.0 * u / (rate * np.sqrt(2.0 * fall)) * weights).sum())
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    scene = withe.Scene(gravity=(0, 0, -G))
    table(scene, 2.0)
    place = turn @ [-0.5 * base, 0, 0.5 * height] + np.array([0, 0, 1e-9])
    box = scene.add_body(withe.solids.Box(BLOCK), density=1000, position=place, rotation=turn, restitution=0.0)
    simulation = scene.build(time_step=2e-4)
    times, leans = [], []
    while simulation.time < 0.13:
        simulation.step(1)
        times.append(simulation.time)
        leans.append(np.arcsin(simulation.rotation(box)[0, 2]))
    upright = int(np.argmax(np.array(leans) < 0.0))
    found = float(np.interp(0.0, leans[upright - 1 : upright + 1][::-1], times[upright - 1 : upright + 1][::-1]))
    before, after = np.diff(leans)[[upright - 3, upright + 2]] / 2e-4
    measured(abs(found / exact - 1.0))
    assert found == pytest.approx(exact, rel=1e-3)
    assert after / before == pytest.approx(1.0 - 1.5 * np.sin(half) ** 2, rel=0.012)  # weight acts meanwhile


@pytest.mark.case("bodies", "Block on a wedge that slides", source="m g sin a cos a / (M + m sin^2 a)")
def test_a_block_pushes_a_wedge_aside() -> None:
    """Hulls on a box and on a floor, without friction."""
    angle = np.radians(30.0)
    rise = 0.2 * np.tan(angle)
    corners = [(x, y, z) for y in (-0.1, 0.1) for x, z in ((0, 0), (0.2, 0), (0.2, rise))]
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    scene = withe.Scene(gravity=(0, 0, -G))
    scene.add_floor()
    scene.enable_contact()
    wedge = scene.add_body(withe.solids.Hull(corners), mass=1.0)
    place = np.array([0.15, 0, 0.15 * np.tan(angle)]) + turn @ [0, 0, 0.02]
    scene.add_body(withe.solids.Box((0.04, 0.04, 0.04)), mass=1.0, position=place, rotation=turn)
    simulation = scene.build(time_step=1e-3)
    simulation.step(100)
    exact = G * np.sin(angle) * np.cos(angle) / (1.0 + np.sin(angle) ** 2)
    error = abs(simulation.velocity(wedge)[0] / (0.1 * exact) - 1.0)
    measured(error)
    assert error < 1e-4


@pytest.mark.parametrize("ratio", [1.0, 100.0])
def test_ten_boxes_stand(ratio: float) -> None:
    """Equal boxes on each other, also with a heavy one on top."""
    scene = withe.Scene()
    scene.add_floor(friction=0.5)
    scene.enable_contact(friction=0.5)
    side = 0.05
    boxes = [
        scene.add_body(
            withe.solids.Box((0.1, 0.1, side)),
            density=1000 * (ratio if k == 9 else 1.0),
            position=(0, 0, (k + 0.5) * side),
        )
        for k in range(10)
    ]
    simulation = scene.build(time_step=4e-3)
    simulation.step(50)
    before = np.array([simulation.position(box) for box in boxes])
    simulation.step(200)
    np.testing.assert_allclose([simulation.position(box) for box in boxes], before, atol=1e-7)
    forces = simulation.contacts()["normal_force"].sum()
    weights = np.array([1.0] * 9 + [ratio]) * 1000 * 0.1 * 0.1 * side * G
    assert forces == pytest.approx(np.cumsum(weights[::-1]).sum(), rel=1e-3)


def test_boxes_cross_without_corners_on_each_other() -> None:
    """A long box across another one rests where their edges cross."""
    scene = withe.Scene()
    scene.add_floor(friction=0.5)
    scene.enable_contact(friction=0.5)
    long = withe.solids.Box((0.4, 0.04, 0.04))
    scene.add_body(long, density=1000, position=(0, 0, 0.02))
    upper = scene.add_body(long, density=1000, position=(0, 0, 0.06), rotation=(np.sqrt(0.5), 0, 0, np.sqrt(0.5)))
    simulation = scene.build(time_step=2e-3)
    simulation.step(500)
    np.testing.assert_allclose(simulation.position(upper), (0, 0, 0.06), atol=1e-5)


@pytest.mark.parametrize("triangles", [1, 20])
def test_a_ball_does_not_notice_triangles(triangles: int) -> None:
    """A plate of 12 and of 1,760 triangles, to rounding."""
    scene = withe.Scene(gravity=(1.0, 0.3, -G))
    plate = scene.add_body(divided_plate(triangles), density=1000)
    scene.clamp(plate)
    scene.enable_contact(friction=0.5)
    ball = scene.add_body(withe.solids.Sphere(0.02), density=1000, position=(-0.3, -0.1, 0.02))
    simulation = scene.build(time_step=2e-3)
    simulation.step(200)
    way = 0.5 * 0.4**2 * 5.0 / 7.0 * np.array([1.0, 0.3])
    np.testing.assert_allclose(simulation.position(ball)[:2] - (-0.3, -0.1), way, rtol=1e-3)
    assert len(simulation.contacts()) == 1


def divided_plate(n: int) -> withe.solids.Mesh:
    """Return a plate below z = 0, with n x n squares on both faces."""
    grid = np.linspace(-0.5, 0.5, n + 1)
    top = np.array([(x, y, 0.0) for x in grid for y in grid])
    count = len(top)
    triangles = []
    for i in range(n):
        for j in range(n):
            a, b = i * (n + 1) + j, (i + 1) * (n + 1) + j
            for triangle in ((a, b, b + 1), (a, b + 1, a + 1)):
                triangles += [triangle, tuple(count + k for k in triangle[::-1])]
    rim = [i * (n + 1) for i in range(n)] + [n * (n + 1) + j for j in range(n)]
    rim += [i * (n + 1) + n for i in range(n, 0, -1)] + list(range(n, -1, -1))
    for a, b in zip(rim, rim[1:], strict=False):
        triangles += [(a, count + a, count + b), (a, count + b, b)]
    return withe.solids.Mesh(np.concatenate([top, top - (0, 0, 0.05)]), np.array(triangles))


def box_or_ball(draw: np.random.Generator) -> withe.solids.Solid:
    """Draw a box, or less often a ball."""
    sides = draw.uniform(0.015, 0.05, 3)
    return withe.solids.Sphere(0.5 * sides[0]) if draw.random() < 0.25 else withe.solids.Box(tuple(sides))


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(5))
def test_boxes_and_rods_that_meet_keep_momenta_and_energy(seed: int, friction: float) -> None:
    """Both momenta, and the balance of energy."""
    scene, things = cloud(seed, friction, box_or_ball)
    assert_momenta_and_energy_stay(scene, things, friction, angular=1e-7, total=1e-3)


def test_what_lies_on_a_box_does_not_depend_on_the_axes_of_the_scene() -> None:
    """A rod and a box slide on a held box, in two orientations of the whole scene."""
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    found = []
    for axes in (np.eye(3), turn):
        scene = withe.Scene(gravity=axes @ on_slope(15.0))
        below = scene.add_body(
            withe.solids.Box((0.5, 0.5, 0.1)), density=1000, position=axes @ [0, 0, -0.05], rotation=axes
        )
        scene.clamp(below)
        scene.enable_contact(friction=0.1)
        rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
        ends = [axes @ [-0.05, y, 0.004] for y in (-0.05, 0.04)]
        rod = scene.add_rod(start=ends[0], end=ends[1], nodes=9, radius=0.004, material=rubber)
        place = axes @ [0.1, 0.02, 0.015]
        box = scene.add_body(withe.solids.Box((0.05, 0.04, 0.03)), density=1000, position=place, rotation=axes)
        simulation = scene.build(time_step=1e-3, planar=False)
        simulation.step(100)
        found.append(np.concatenate([simulation.positions(rod), simulation.position(box)[None]]) @ axes)
    np.testing.assert_allclose(found[1], found[0], atol=1e-8)


def test_balls_pass_on_their_speed() -> None:
    """Newton's cradle without weight: only the last of six balls goes on."""
    radius = 0.02
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact()
    places = [-0.06, *(2.0 * radius * 1.01 * np.arange(5))]
    balls = [scene.add_body(withe.solids.Sphere(radius), density=7800, position=(x, 0, 0)) for x in places]
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(balls[0], (1, 0, 0))
    simulation.step(150)
    np.testing.assert_allclose([simulation.velocity(ball)[0] for ball in balls], [0, 0, 0, 0, 0, 1], atol=1e-4)


def test_a_rope_slides_over_the_edge_of_a_table() -> None:
    """It falls off as a whole, and no node enters the table."""
    scene = withe.Scene(gravity=(0, 0, -G))
    below = scene.add_body(withe.solids.Box((0.4, 0.4, 0.1)), density=1000, position=(-0.2, 0, -0.05))
    scene.clamp(below)
    scene.enable_contact(friction=0.2)
    soft = withe.Material(youngs_modulus=1e6, density=1000.0)
    rope = scene.add_rod(start=(-0.2, 0, 0.004), end=(0.2, 0, 0.004), nodes=41, radius=0.004, material=soft)
    simulation = scene.build(time_step=2e-3)
    for _ in range(20):
        simulation.step(10)
        x, z = simulation.positions(rope)[:, [0, 2]].T
        assert not ((x < -1e-4) & (z < 0.0039) & (z > -0.1)).any()
    assert z.max() < -0.05


def over_an_edge(angle: float, friction: float) -> float:
    """Ratio of tensions over the smallest that the elastica needs to be pulled over a sharp edge, by its own angle."""
    from scipy.optimize import fsolve

    def missing(unknown: Array) -> list[float]:
        ratio, first = unknown
        second = angle - first
        slip = ratio * np.cos(second) - np.cos(first)
        normal = np.sin(first) + ratio * np.sin(second)
        return [1.0 - np.cos(first) - ratio * (1.0 - np.cos(second)), slip - friction * normal]

    return float(fsolve(missing, [np.exp(friction * angle), 0.5 * angle], xtol=1e-12)[0])


@pytest.mark.parametrize(("angle", "friction"), [(90.0, 0.3), (90.0, 0.1), (80.0, 0.3)])
@pytest.mark.case("bodies", "Rod drawn over a sharp edge: tension ratio", source="elastica; not exp(mu phi)")
def test_a_rod_is_drawn_over_the_edge_of_a_box(angle: float, friction: float) -> None:
    """Bending shares the angle between both sides, so the ratio is below that of a capstan."""
    half, radius, size, speed = 0.5 * np.radians(angle), 1e-4, 2e-3, 0.02
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact(friction=friction, slip_tolerance=1e-4)
    block = scene.add_body(withe.solids.Box((0.4, 0.1, 0.4)), density=1000, position=(-0.2, 0, -0.2), friction=friction)
    scene.clamp(block)
    up, along = np.array([1, 0, 1]) / np.sqrt(2.0), np.array([1, 0, -1]) / np.sqrt(2.0)
    ways = [side * along * np.cos(half) - up * np.sin(half) for side in (-1, 1)]
    turn = np.linspace(-half, half, 1 + round(2.0 * half * 0.02 / size))[:, None]
    bow = 0.02 * (np.sin(turn) * along + (np.cos(turn) - 1.0) * up)
    reach = size * np.arange(1, 81)[:, None]
    points = np.concatenate([bow[0] + reach[::-1] * ways[0], bow, bow[-1] + reach * ways[1]]) + (radius + 1e-6) * up
    stiffness = withe.Stiffness(stretch=1e4, bend=(4e-4, 4e-4), twist=4e-4)
    rod = scene.add_rod(points=points, radius=radius, stiffness=stiffness, line_density=5e-3, natural="straight")
    scene.ignore_contact(rod, rod)
    scene.add_force(rod.start, ways[0])
    scene.add_drag(0.02)
    grip = scene.pin(rod.end)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.move(grip, position=points[-1] + 2.0 * speed * ways[1], over=2.0)
    simulation.step(500)
    pulls = []
    for _ in range(300):
        simulation.step()
        pulls.append(simulation.reaction(grip).force)
    pull = np.mean(pulls, axis=0)
    tension = float(np.linalg.norm(pull))
    error = tension / over_an_edge(float(np.arccos(-(pull @ ways[0]) / tension)), friction) - 1.0
    measured(error)
    assert abs(error) < 5e-3


@pytest.mark.parametrize("kind", ["floor", "table"])
@pytest.mark.case("bodies", "Ball on a turntable, after a second", source="circle of 7/2 turns")
def test_a_ball_on_a_turntable_rolls_in_a_circle(kind: str) -> None:
    """Slower than the table by 2/7."""
    rate, radius, friction = 2.0 * np.pi, 0.02, 0.8
    scene = withe.Scene()
    scene.enable_contact(friction=friction)
    if kind == "floor":
        turning: withe.Obstacle | withe.Support = scene.add_floor(friction=friction)
    else:
        body = scene.add_body(
            withe.solids.Box((0.4, 0.4, 0.05)), density=1000, position=(0, 0, -0.025), friction=friction
        )
        turning = scene.clamp(body)
    ball = scene.add_body(withe.solids.Sphere(radius), density=1000, position=(0.1, 0, radius), friction=friction)
    simulation = scene.build(time_step=2e-3)
    velocity, surface = np.array([0.0, 0.05, 0.0]), np.array([0.0, 0.1 * rate, 0.0])
    simulation.set_velocity(ball, velocity, angular=np.cross([0, 0, 1], velocity - surface) / radius)
    if kind == "floor":
        simulation.move(turning, roll=rate, over=1.0)
    else:

        def path(time: float) -> tuple[tuple[float, ...], Array]:
            c, s = np.cos(rate * time), np.sin(rate * time)
            return (0.0, 0.0, -0.025), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

        simulation.move(turning, path=path)
    simulation.run(1.0, progress=False)
    error = np.linalg.norm(simulation.position(ball)[:2] - (0.06595021, 0.02715380)) / 0.02785212
    measured(error)
    assert error < 5e-3
