"""Rods and balls in tubes, and beside solids that are given by their signed distance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import withe
from cases import measured

Array = npt.NDArray[np.float64]
BEND, PLAY = 0.05, 1e-3  # radius of the axis of a bent tube, and room of a rod in it [m]
SOFT = withe.Material(youngs_modulus=1e6, density=1000)


def arc(span: float, points: int, radius: float = BEND) -> Array:
    """Points of an arc in the plane of x and z, whose middle is at (0, 0, radius)."""
    angle = np.linspace(-0.5 * span, 0.5 * span, points)
    return radius * np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])


def straight_wire_in_a_bend(
    length: float, nodes: int, solid: withe.solids.Field | None = None
) -> tuple[withe.Simulation, withe.Rod, float]:
    """The equilibrium of a rod without natural curvature in a bent tube, the rod, and its bending stiffness."""
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_obstacle(solid or withe.solids.Tube(arc((length + 0.02) / BEND, 41), radius=1e-3 + PLAY))
    wire = scene.add_rod(
        points=arc(length / BEND, nodes), radius=1e-3, material=SOFT, natural_curvature=(0.0, 0.0), name="wire"
    )
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    return simulation, wire, 1e6 * np.pi * 1e-12 / 4.0


@pytest.mark.case("contact", "Straight rod in a bent tube: forces of the walls", source="elastica")
def test_a_straight_rod_touches_a_bend_at_three_places() -> None:
    """Its ends touch the outer wall, and its middle touches the inner wall."""
    simulation, _, bending = straight_wire_in_a_bend(0.034, 81)
    contacts = simulation.contacts()
    force, place = contacts["normal_force"] / bending, np.abs(contacts["point"][:, 0])
    # 575.6657 and 1085.7173 [1/m^2] by the elastica.
    errors = np.array([force[place > 0.015].sum() / 2.0 / 575.66571, force[place < 0.01].sum() / 1085.71727]) - 1.0
    measured(errors)
    assert np.abs(errors).max() < 5e-3


def elastica_in_a_bend(length: float) -> float:
    """Force of the outer wall at an end of a straight rod that touches the inner wall at two places, over EI [1/m^2].

    Between these places the rod is compressed, and arches away from the inner wall. Unknown are its place, curvature
    and compression in the middle, where it touches the inner wall, and with which force.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import fsolve

    def shoot(start: Array, force: Array, span: float) -> Array:
        def slope(_: float, y: Array) -> list[float]:
            return [np.cos(y[2]), np.sin(y[2]), y[3], np.sin(y[2]) * force[0] - np.cos(y[2]) * force[1]]

        return np.asarray(solve_ivp(slope, (0.0, span), start, rtol=1e-11, atol=1e-13).y[:, -1])

    def parts(unknown: Array) -> tuple[Array, Array, Array]:
        height, curvature, compression, place, force = unknown * sizes
        inside = shoot(np.array([0.0, height, 0.0, curvature]), np.array([-compression, 0.0]), place)
        beyond = np.array([-compression, 0.0]) - force * inside[:2] / np.hypot(*inside[:2])
        return inside, beyond, shoot(inside, beyond, 0.5 * length - place)

    def missing(unknown: Array) -> list[float]:
        inside, force, end = parts(unknown)
        return [
            (np.hypot(*inside[:2]) - (BEND - PLAY)) / PLAY,
            (np.cos(inside[2]) * inside[0] + np.sin(inside[2]) * inside[1]) / PLAY,
            end[3] * BEND,
            (np.hypot(*end[:2]) - (BEND + PLAY)) / PLAY,
            (force[0] * end[1] - force[1] * end[0]) / 40.0,
        ]

    sizes = np.array([BEND, -1.0 / BEND, 400.0, 0.02, 600.0])
    guess = np.array([BEND - PLAY, -1.0 / BEND, 400.0, 0.5 * length - 0.0235, 600.0]) / sizes
    return float(np.hypot(*parts(fsolve(missing, guess, xtol=1e-12))[1]))


@pytest.mark.case("contact", "Long straight rod in a bent tube: force at an end", source="elastica")
@pytest.mark.parametrize("length", [0.08, 0.1, 0.12])
def test_a_long_rod_arches_away_from_the_inner_wall_of_a_bend(length: float) -> None:
    """It touches the inner wall at two places, and the outer wall at its ends."""
    simulation, _, bending = straight_wire_in_a_bend(length, 1 + round(length / 7.5e-4))
    contacts = simulation.contacts()
    # Contacts of the outer wall press towards the middle of the bend.
    inwards = np.einsum("ij,ij->i", contacts["normal"], contacts["point"]) < 0.0
    error = contacts["normal_force"][inwards].sum() / 2.0 / bending / elastica_in_a_bend(length) - 1.0
    measured(error)
    assert abs(error) < 2e-3


@pytest.mark.parametrize("load", [6.0, 10.0])
@pytest.mark.case("stability", "Buckled column between walls: force of the wall", source="beam-column")
def test_a_buckled_column_leans_on_the_wall_of_its_tube(load: float) -> None:
    """Both ends are clamped [Domokos, Holmes, Royce 1997]; at ten it would rather wind round, out of its plane."""
    length, radius, bending = 1.0, 0.02, 1.0
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_obstacle(withe.solids.Tube([(-0.2, 0, 0), (1.2, 0, 0)], radius=radius + 0.01 * length, wall=0.01))
    x = np.linspace(0.0, length, 81)
    points = np.column_stack([x, 0.0 * x, 0.5 * 0.01 * (1.0 - np.cos(2.0 * np.pi * x))])
    stiffness = withe.Stiffness(stretch=1e7, bend=(bending, bending), twist=bending)
    column = scene.add_rod(points=points, radius=radius, stiffness=stiffness, line_density=1.0, natural="straight")
    scene.clamp(column.start)
    scene.clamp(column.end, free=(1, 0, 0))
    scene.add_force(column.end, (-load * np.pi**2 * bending / length**2, 0, 0))
    simulation = scene.build(integrator="static")
    simulation.equilibrium(stable=False)
    force = simulation.contacts()["normal_force"].sum()
    # w = A (cos kx - 1) + B (sin kx - kx) with w = 0.01 and w' = 0 in the middle.
    k = np.pi * np.sqrt(load)
    slopes = [[np.cos(0.5 * k) - 1.0, np.sin(0.5 * k) - 0.5 * k], [-np.sin(0.5 * k), np.cos(0.5 * k) - 1.0]]
    _, by_shear = np.linalg.solve(slopes, [0.01, 0.0])
    error = force / (2.0 * abs(k**3 * by_shear)) - 1.0
    measured(error)
    assert abs(error) < 0.02


@pytest.mark.case("contact", "Cord drawn through a bent tube: tension ratio", source="exp(mu phi)")
def test_a_cord_in_a_bend_multiplies_its_tension() -> None:
    """As on a capstan, whose place the inner wall takes."""
    friction, speed, hold = 0.2, 0.01, 1.0
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_obstacle(withe.solids.Tube(arc(0.5 * np.pi, 41), radius=2e-3), friction=friction)
    angle = np.linspace(-0.25 * np.pi, 0.25 * np.pi, 81)
    inner = BEND - 1.5e-3
    bow = inner * np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    along = np.linspace(0.0, 0.03, 25)[1:, None]
    ways = np.array([[-np.sqrt(0.5), 0, -np.sqrt(0.5)], [np.sqrt(0.5), 0, -np.sqrt(0.5)]])
    points = np.concatenate([bow[0] + along[::-1] * ways[0], bow, bow[-1] + along * ways[1]])
    bend = 1e-9
    stiffness = withe.Stiffness(stretch=1e4, bend=(bend, bend), twist=bend)
    cord = scene.add_rod(points=points, radius=5e-4, stiffness=stiffness, line_density=1e-3, natural="straight")
    scene.enable_contact(slip_tolerance=1e-4)
    scene.ignore_contact(cord, cord)
    scene.add_force(cord.start, hold * ways[0])
    scene.add_drag(0.01)
    grip = scene.pin(cord.end)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.move(grip, position=points[-1] + 2.0 * speed * ways[1], over=2.0)
    simulation.step(500)
    pulls = []
    for _ in range(200):
        simulation.step()
        pulls.append(simulation.reaction(grip).force @ ways[1])
    error = float(np.mean(pulls)) / hold / np.exp(friction * 0.5 * np.pi) - 1.0
    measured(error)
    assert abs(error) < 0.01


@pytest.mark.parametrize("kind", ["tube", "field"])
@pytest.mark.case("contact", "Ball that swings in a level tube without friction", source="pendulum of length R - r")
def test_a_ball_swings_in_a_tube(kind: str) -> None:
    """Through a quarter of a period, from 0.2 rad."""
    radius, ball = 0.05, 0.01
    if kind == "tube":
        solid: withe.solids.Tube | withe.solids.Field = withe.solids.Tube([(0, -0.1, 0), (0, 0.1, 0)], radius=radius)
    else:
        corner = np.array([0.07, 0.03, 0.07])
        solid = withe.solids.Field(lambda p: radius - np.hypot(p[:, 0], p[:, 2]), bounds=[-corner, corner])
    scene = withe.Scene(gravity=(0, 0, -9.81))
    scene.add_obstacle(solid)
    length, start = radius - ball, 0.2
    place = length * np.array([np.sin(start), 0.0, -np.cos(start)])
    body = scene.add_body(withe.solids.Sphere(ball), density=1000, position=place)
    simulation = scene.build(time_step=5e-4)
    k = np.sin(0.5 * start)
    quarter = np.sqrt(length / 9.81) * 0.5 * np.pi * (1.0 + k**2 / 4.0 + 9.0 * k**4 / 64.0)
    simulation.run(quarter)
    error = simulation.position(body)[0] / (length * start)
    measured(error)
    assert abs(error) < 2e-3


def wire_in_flight(kind: str, friction: float, seed: int) -> tuple[withe.Simulation, withe.Rod]:
    """A rod in a ring-shaped channel, with a drawn velocity."""
    draw = np.random.default_rng(seed)
    if kind == "tube":
        solid: withe.solids.Tube | withe.solids.Field = withe.solids.Tube(arc(5.0, 81), radius=5e-3)
    else:
        corner = np.array([0.065, 0.015, 0.065])
        solid = withe.solids.Field(
            lambda p: 5e-3 - np.hypot(np.hypot(p[:, 0], p[:, 2]) - BEND, p[:, 1]), bounds=[-corner, corner]
        )
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_obstacle(solid, friction=friction)
    points = arc(0.8, 31)
    wire = scene.add_rod(points=points, radius=1e-3, material=SOFT, natural_curvature=(0.0, 0.0))
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocities(wire, np.cross([0.0, 5.0, 0.0], points) + draw.normal(0.0, 0.1, 3))
    return simulation, wire


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("kind", ["tube", "field"])
def test_energy_in_a_channel_adds_up(kind: str, friction: float, seed: int) -> None:
    """Energy and what dissipates stay the same in sum, and no rod passes the wall."""
    simulation, wire = wire_in_flight(kind, friction, seed)
    before = simulation.energy()
    for _ in range(6):
        simulation.step(50)
        energy = simulation.energy()
        assert energy.total + energy.dissipated == pytest.approx(before.total, rel=1e-7)
        x = simulation.positions(wire)
        assert np.hypot(np.hypot(x[:, 0], x[:, 2]) - BEND, x[:, 1]).max() < 4.04e-3
    if friction == 0.0:
        assert energy.total == pytest.approx(before.total, rel=2e-3)
    else:
        assert energy.total < 0.9 * before.total


def test_a_field_and_a_tube_of_one_shape_touch_alike() -> None:
    """Equilibria, since impacts would amplify the difference of the spline."""
    bend = withe.solids.Field(
        lambda p: 1e-3 + PLAY - np.hypot(np.hypot(p[:, 0], p[:, 2]) - BEND, p[:, 1]),
        bounds=[(-0.022, -0.0025, 0.043), (0.022, 0.0025, 0.0525)],
        spacing=2.5e-4,
    )
    found = []
    for solid in (None, bend):
        simulation, wire, bending = straight_wire_in_a_bend(0.034, 41, solid)
        curvature = np.linalg.norm(simulation.curvatures(wire), axis=1)
        found.append(np.append(curvature / 10.0, simulation.contacts()["normal_force"].sum() / bending / 2237.0))
    np.testing.assert_allclose(found[1], found[0], atol=0.02)


def test_a_turned_tube_gives_the_turned_motion() -> None:
    """Axes of the scene do not matter."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec([0.4, -0.8, 1.1]).as_matrix()
    ends = []
    for axes in (np.eye(3), turn):
        scene = withe.Scene(gravity=axes @ (0.0, 0.0, -9.81))
        scene.add_obstacle(withe.solids.Tube(arc(2.0, 21) @ axes.T, radius=5e-3), friction=0.2)
        wire = scene.add_rod(points=arc(0.8, 21) @ axes.T, radius=1e-3, material=SOFT, normal=axes @ (0.0, 1.0, 0.0))
        simulation = scene.build(time_step=1e-3)
        simulation.step(60)
        ends.append(simulation.positions(wire) @ axes)
    assert np.abs(ends[0] - arc(0.8, 21)).max() > 1e-3
    assert np.abs(ends[1] - ends[0]).max() < 1e-8


def test_a_tube_that_moves_takes_its_rod_along() -> None:
    """The obstacle moves by its position."""
    scene = withe.Scene(gravity=(0, 0, 0))
    tube = scene.add_obstacle(withe.solids.Tube([(0, 0, 0), (0.1, 0, 0)], radius=3e-3))
    wire = scene.add_rod(start=(0.02, 0, 0), end=(0.08, 0, 0), nodes=13, radius=1e-3, material=SOFT)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.move(tube, position=(0, 0, 0.02), over=0.2)
    simulation.run(0.2)
    heights = simulation.positions(wire)[:, 2]
    assert (heights > 0.018 - 4e-5).all()
    assert (heights < 0.022 + 4e-5).all()
    with pytest.raises(ValueError, match="not turned"):
        simulation.move(tube, roll=0.3)


@pytest.mark.slow
def test_a_wire_is_pushed_into_a_tube_through_its_mouth() -> None:
    """Beside the axis it meets the round rim, and slides in."""
    scene = withe.Scene(gravity=(0, 0, 0))
    behind = arc(2.0, 41)[21:]
    behind[:, 0] += 0.02
    bent = np.concatenate([[(x, 0, BEND) for x in (0.0, 0.01, 0.02)], behind])
    scene.add_obstacle(withe.solids.Tube(bent, radius=2e-3, wall=1e-3), friction=0.1)
    wire = scene.add_rod(
        start=(-0.081, 0, BEND + 1.2e-3), end=(-0.001, 0, BEND + 1.2e-3), nodes=61, radius=7e-4, material=SOFT
    )
    grip = scene.clamp(wire.start)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    simulation.move(grip, position=(-0.021, 0, BEND + 1.2e-3), over=1.0)
    simulation.run(1.0)
    tip = simulation.positions(wire)[-1]
    # The tip lies in the bend, within the play about the axis.
    rho = np.hypot(np.hypot(tip[0] - 0.02, tip[2]) - BEND, tip[1])
    assert tip[0] > 0.04
    assert rho < 1.35e-3
