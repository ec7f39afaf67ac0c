"""Rolling friction: a couple against the turning of rods on what they touch, against theory and its own invariances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import withe
from cases import measured
from rods import ring_on_slope

G, THICK, LENGTH = 9.81, 5e-3, 0.2  # [m/s^2], [m]
GRIP = 0.6
STIFF = withe.Material(youngs_modulus=2e9, poisson_ratio=0.3, density=1200.0)
# Moment of inertia of a solid cylinder, over its mass times its radius squared.
CYLINDER = 0.5


def rod_on_slope(degrees: float, rolling: float, *, turn: float = 0.0, step: float = 1e-3, **options: Any) -> Any:
    """A straight rod across a slope, which is turned about its normal, and the direction down it."""
    angle = np.radians(degrees)
    normal = np.array((np.sin(angle), 0.0, np.cos(angle)))
    across = np.array((np.sin(turn) * np.cos(angle), np.cos(turn), -np.sin(turn) * np.sin(angle)))
    middle = (THICK + 1e-6) * normal
    scene = withe.Scene()
    rod = scene.add_rod(
        start=middle - 0.5 * LENGTH * across,
        end=middle + 0.5 * LENGTH * across,
        nodes=7,
        radius=THICK,
        material=STIFF,
    )
    scene.add_plane((0, 0, 0), normal, friction=GRIP, restitution=0.0, rolling_friction=rolling, name="slope")
    model = options.pop("friction_model", "anchored")
    scene.enable_contact(friction_model=model, slip_tolerance=1e-5)
    return scene.build(time_step=step, planar=False, **options), rod, np.cross(across, normal)


def speed_down(simulation: Any, rod: Any, down: NDArray[Any]) -> float:
    """Velocity of the centre of mass along the slope."""
    return float(mean_by_mass(simulation.velocities(rod)) @ down)


def mean_by_mass(values: NDArray[Any]) -> NDArray[Any]:
    """By mass: nodes at the ends have half."""
    return (values.sum(0) - 0.5 * (values[0] + values[-1])) / (len(values) - 1)


SCHEMES = ("backward_euler", "implicit_midpoint", "energy_momentum")


@pytest.mark.case(
    "contact", "Rod that rolls down a slope with rolling friction", source="g (sin a - c cos a) / (1 + I / (m r^2))"
)
@pytest.mark.parametrize("model", ["anchored", "implicit"])
@pytest.mark.parametrize("integrator", SCHEMES)
def test_a_rod_rolls_down_a_slope_against_its_couple(integrator: Any, model: str) -> None:
    """m a = m g sin A - f, I a / r = f r - c r N: a = g (sin A - c cos A) / (1 + I / m r^2)."""
    rolling = 0.05
    simulation, rod, down = rod_on_slope(6.0, rolling, integrator=integrator, friction_model=model)
    simulation.step(100)
    before = speed_down(simulation, rod, down)
    simulation.step(300)
    gained = (speed_down(simulation, rod, down) - before) / 0.3
    angle = np.radians(6.0)
    expected = G * (np.sin(angle) - rolling * np.cos(angle)) / (1.0 + CYLINDER)
    print("rolls:", integrator, model, gained / expected - 1.0)
    measured(gained / expected - 1.0)
    assert abs(gained / expected - 1.0) < 5e-3


@pytest.mark.parametrize("turn", [0.0, 0.4])
@pytest.mark.parametrize(("share", "holds"), [(0.9, True), (1.1, False)])
def test_a_rod_is_held_on_a_slope_up_to_its_coefficient(turn: float, share: float, holds: bool) -> None:
    """By an anchored couple, where tan A is at most the coefficient; nothing creeps."""
    angle = 4.0
    limit = np.tan(np.radians(angle)) * np.cos(turn)  # what drives it is the part of the slope across the rod
    simulation, rod, down = rod_on_slope(angle, limit / share, turn=turn, integrator="backward_euler")
    simulation.step(500)
    start = simulation.positions(rod)
    simulation.step(1000)
    moved = float(mean_by_mass(simulation.positions(rod) - start) @ down)
    print("held:", turn, share, moved)
    if holds:
        assert abs(moved) < 1e-6 * THICK
    else:
        assert moved > THICK


@pytest.mark.case("contact", "Distance in which rolling friction stops a rod", source="v^2 / (2 a)")
def test_a_rolling_rod_comes_to_rest_and_stays() -> None:
    """v0^2 = 2 a s, with a = c g / (1 + I / m r^2)."""
    rolling, speed = 0.02, 0.1
    simulation, rod, down = rod_on_slope(0.0, rolling, integrator="backward_euler", step=5e-4)
    simulation.step(50)
    start = mean_by_mass(simulation.positions(rod)) @ down
    simulation.set_state(rod, velocities=np.tile(speed * down, (7, 1)), spins=np.full(6, speed / THICK))
    simulation.run(2.0, progress=False)
    way = mean_by_mass(simulation.positions(rod)) @ down - start
    expected = 0.5 * speed**2 * (1.0 + CYLINDER) / (rolling * G)
    print("stops:", way / expected - 1.0)
    measured(way / expected - 1.0)
    assert abs(way / expected - 1.0) < 0.02
    rest = simulation.positions(rod)
    simulation.run(1.0, progress=False)
    assert np.abs(simulation.positions(rod) - rest).max() < 1e-9


@pytest.mark.parametrize("integrator", SCHEMES)
@pytest.mark.parametrize("seed", range(4))
def test_books_of_thrown_rods_balance(seed: int, integrator: Any) -> None:
    """Rods that fall on a floor and roll lose what is said to be dissipated, and gain nothing; backward Euler more.

    The midpoint rule itself adds 2 % of the energy in impacts at 1 ms, and 0.02 % at 0.25 ms.
    """
    random = np.random.default_rng(seed)
    scene = withe.Scene()
    soft = withe.Material(youngs_modulus=2e6, poisson_ratio=0.3, density=1200.0)
    direction = random.normal(size=3) * (1.0, 1.0, 0.1)
    direction /= np.linalg.norm(direction)
    start = np.array((0.0, 0.0, 0.03)) - 0.5 * LENGTH * direction * (1, 1, 0)
    scene.add_rod(start=start, end=start + LENGTH * direction, nodes=9, radius=THICK, material=soft, name="rod")
    floor = float(min(start[2], start[2] + LENGTH * direction[2])) - 1.5 * THICK
    scene.add_floor(floor, friction=0.5, restitution=0.0, rolling_friction=random.uniform(0.01, 0.3))
    scene.enable_contact()
    time_step = 2.5e-4 if integrator == "implicit_midpoint" else 1e-3
    simulation = scene.build(time_step=time_step, integrator=integrator, planar=False)
    simulation.set_state("rod", velocities=np.tile(random.normal(size=3) * (0.5, 0.5, 0.1), (9, 1)))
    first = simulation.energy()
    book, lost = [first.total], [0.0]
    for _ in range(60):
        simulation.step(round(5e-3 / time_step))
        now = simulation.energy()
        book.append(now.total + now.dissipated - now.work)
        lost.append(now.dissipated)
    gained, missing = max(book) - first.total, first.total - min(book)
    print("books:", seed, integrator, gained / first.kinetic, missing / first.kinetic)
    assert np.diff(lost).min() > -1e-6 * first.kinetic
    assert gained < (1e-6 if integrator == "energy_momentum" else 1e-3) * first.kinetic
    if integrator != "backward_euler":
        assert missing < 1e-3 * first.kinetic


def acceleration(planar: bool, rolling: float) -> float:
    """Acceleration of a stiff ring down 5 degrees."""
    radius, edges, thick, angle = 0.1, 48, 2e-3, np.radians(5.0)
    points, normal, down = ring_on_slope(5.0, radius, thick, edges)
    scene = withe.Scene()
    stiff = withe.Material(youngs_modulus=2e10, poisson_ratio=0.3, density=2000.0)
    ring = scene.add_rod(points=points, radius=thick, material=stiff, closed=True)
    scene.add_plane((0, 0, 0), normal, friction=GRIP, rolling_friction=rolling)
    scene.ignore_contact(ring, ring)
    simulation = scene.build(time_step=1e-3, planar=planar)
    simulation.step(200)
    before = simulation.velocities(ring).mean(0) @ down
    simulation.step(500)
    gained = (simulation.velocities(ring).mean(0) @ down - before) / 0.5
    # m a (1 + k) = m g sin A - c r N / (R + r), k that of a hoop, see test_rolling.
    k = (2.0 + np.cos(2.0 * np.pi / edges)) / 3.0 * (radius / (radius + thick)) ** 2
    expected = (G * np.sin(angle) - rolling * thick * G * np.cos(angle) / (radius + thick)) / (1.0 + k)
    return float(gained / expected)


@pytest.mark.parametrize("planar", [True, False])
def test_a_ring_is_braked_by_the_couple_of_its_section(planar: bool) -> None:
    """Its couple is that of the rod's radius, whatever the ring's."""
    free, braked = acceleration(planar, 0.0), acceleration(planar, 1.5)
    print("ring:", planar, free, braked)
    assert abs(braked / free - 1.0) < 0.01


def test_rolling_friction_is_set_and_read_and_kept_by_snapshots() -> None:
    """A rod that is held rolls once it is let, and is held again from a snapshot of before."""
    simulation, rod, down = rod_on_slope(3.0, 0.1, integrator="backward_euler")
    simulation.step(300)
    held, start = simulation.snapshot(), simulation.positions(rod)
    simulation.set("slope", rolling_friction=0.01)
    assert simulation.get("slope", "rolling_friction") == 0.01
    simulation.step(300)
    assert mean_by_mass(simulation.positions(rod) - start) @ down > THICK
    simulation.restore(held)
    assert simulation.get("slope", "rolling_friction") == 0.1
    simulation.step(300)
    assert abs(mean_by_mass(simulation.positions(rod) - start) @ down) < 1e-6 * THICK


def test_what_has_no_rolling_friction_says_so() -> None:
    """Negative ones, and laws of friction at the start of a step."""
    scene = withe.Scene()
    with pytest.raises(ValueError, match="rolling_friction of 'floor 1' must not be negative"):
        scene.add_floor(rolling_friction=-0.1)
    scene.add_rod(start=(0, 0, 0.1), end=(0.2, 0, 0.1), nodes=5, radius=THICK, material=STIFF)
    scene.add_floor(friction=0.3, rolling_friction=0.1)
    scene.enable_contact(friction_model="lagged")
    with pytest.raises(ValueError, match="rolling_friction of 'floor 1' needs friction_model 'anchored' or 'implicit'"):
        scene.build()


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", SCHEMES)
def test_what_turns_with_a_drum_does_not_roll_on_it(integrator: Any, planar: bool) -> None:
    """A ring that fits tightly: the drum does no more work with rolling friction than without."""
    drum_radius, thick, rate = 0.05, 3e-3, 5.0

    def work(rolling: float) -> tuple[float, float]:
        scene = withe.Scene(gravity=(0, 0, 0))
        angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        points = (drum_radius + thick) * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], 1)
        rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
        ring = scene.add_rod(points=points, closed=True, radius=thick, material=rubber)
        axis = ((0, 0, -0.1), (0, 0, 0.1))
        scene.add_capsule(*axis, drum_radius, friction=0.5, rolling_friction=rolling, restitution=0.0, name="drum")
        simulation = scene.build(integrator=integrator, time_step=2e-3, planar=planar)
        simulation.set(ring, natural_stretch=0.98, over=0.05)
        simulation.run(0.2, progress=False)
        simulation.set_velocities(ring, np.cross((0, 0, rate), simulation.positions(ring)))
        simulation.move("drum", roll=0.3 * rate, over=0.3)
        simulation.run(0.1, progress=False)
        before = simulation.energy().work
        simulation.run(0.1, progress=False)
        pressed = float(simulation.contacts()["normal_force"].sum())
        return simulation.energy().work - before, thick * pressed * 0.1 * rate

    (free, _), (rolled, scale) = work(0.0), work(0.1)
    print("turns with it:", integrator, planar, free / scale, rolled / scale)
    assert abs(rolled - free) < 0.01 * 0.1 * scale


@pytest.mark.case("contact", "Moment between a drum and a rod", source="(mu + mu_r) r N or (mu - mu_r) r N")
@pytest.mark.parametrize(("turning", "nodes"), [("rod", 11), ("drum", 11), ("drum", 21)])
def test_a_drum_and_a_rod_resist_turning_against_each_other(turning: str, nodes: int) -> None:
    """Clamps of a rod that is pressed onto it bear (mu + mu_r) r N where the rod turns.

    A drum turns it as a gear would, against its own sense, by mu r N, and along with it by mu_r r N.
    """
    drum_radius, slipping, rolling = 0.03, 0.3, 0.1
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=2e8, poisson_ratio=0.3, density=1000.0)
    height = drum_radius + THICK
    rod = scene.add_rod(start=(0, -0.05, height), end=(0, 0.05, height), nodes=nodes, radius=THICK, material=material)
    clamps = [scene.clamp(end) for end in (rod.start, rod.end)]
    scene.add_load(rod, (0, 0, -20.0))
    drum = scene.add_capsule(
        (0, -0.1, 0), (0, 0.1, 0), drum_radius, friction=slipping, rolling_friction=rolling, name="drum"
    )
    simulation = scene.build(time_step=1e-3, integrator="backward_euler")
    simulation.run(0.2, progress=False)
    for what in clamps if turning == "rod" else [drum]:
        simulation.move(what, roll=-2.0 if turning == "rod" else 1.0, over=0.3)
    simulation.run(0.25, progress=False)
    pressed = simulation.contacts()["normal_force"].sum()
    moment = sum(simulation.reaction(clamp).moment[1] for clamp in clamps)
    print("rolls on it:", turning, nodes, moment / (THICK * pressed))
    expected = slipping + rolling if turning == "rod" else slipping - rolling
    measured(abs(moment) / (THICK * pressed) / expected - 1.0)
    assert abs(abs(moment) / (THICK * pressed) - expected) < 2e-3
