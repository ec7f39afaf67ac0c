"""Contact and friction against what a block, a slope and a knot would do."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import withe
from cases import measured

FloatArray = npt.NDArray[np.float64]

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
RADIUS = 5e-3
IMPLICIT = ["backward_euler", "implicit_midpoint", "energy_momentum"]
STABLE = ["backward_euler", "energy_momentum"]  # plain midpoint gains energy where edges turn far in a step


def excess(simulation: withe.Simulation, start: float) -> float:
    """Energy that nothing has put in [J]."""
    now = simulation.energy()
    return now.total - now.work + now.dissipated - start


def steps_in_contact_without_gain(simulation: withe.Simulation, steps: int, most: float) -> int:
    """Fails where energy comes back after it was lost, by more than `most` [J]; returns the steps in contact."""
    energy = simulation.energy()
    least, touched = energy.total - energy.work, 0
    for _ in range(steps):
        simulation.step()
        energy = simulation.energy()
        kept = energy.total - energy.work
        assert kept - least < most
        least = min(least, kept)
        touched += len(simulation.contacts()) > 0
    return touched


@pytest.mark.parametrize("integrator", STABLE)
def test_a_rod_that_falls_on_a_floor_comes_to_rest_on_it_and_never_gains_energy(integrator: Any) -> None:
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0.02), end=(0.3, 0, 0.03), nodes=21, radius=RADIUS, material=RUBBER)
    scene.add_floor()
    simulation = scene.build(integrator=integrator, time_step=2e-3)
    start = simulation.energy().total
    gained = 0.0
    for _ in range(400):
        simulation.step()
        gained = max(gained, excess(simulation, start))
    weight = 1200.0 * np.pi * RADIUS**2 * 0.3 * 9.81
    fallen = weight * 0.02
    assert gained < 0.01 * fallen
    height = simulation.positions(rod)[:, 2]
    assert height.min() > 0.96 * RADIUS
    if integrator == "backward_euler":
        assert simulation.contacts()["normal_force"].sum() == pytest.approx(weight, rel=2e-3)
        assert height.max() < 1.1 * RADIUS  # the distance tolerance


@pytest.mark.parametrize("integrator", IMPLICIT)
@pytest.mark.parametrize("speed", [1.0, 100.0])
def test_nothing_passes_through_a_floor_however_fast(integrator: Any, speed: float) -> None:
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(0, 0, 0.05), end=(0.3, 0, 0.06), nodes=21, radius=RADIUS, material=RUBBER)
    scene.add_floor()
    simulation = scene.build(integrator=integrator, time_step=2.5e-3)
    simulation.set_velocities(rod, np.tile([0.0, 0.0, -speed], (21, 1)))
    start = simulation.energy()
    for _ in range(30):
        simulation.step()
        assert simulation.positions(rod)[:, 2].min() > 0.95 * RADIUS
        assert excess(simulation, start.total) < 0.01 * start.kinetic


@pytest.mark.parametrize("integrator", STABLE)
def test_rods_that_cross_stop_each_other(integrator: Any) -> None:
    scene = withe.Scene(gravity=(0, 0, 0))
    stiff = withe.Material(youngs_modulus=1e9, poisson_ratio=0.5, density=1200.0)
    moving = scene.add_rod(start=(-0.15, 0.011, 0.03), end=(0.15, 0.01, 0.03), nodes=31, radius=RADIUS, material=stiff)
    bar = scene.add_rod(start=(0.003, -0.15, 0), end=(0, 0.15, 0), nodes=31, radius=RADIUS, material=stiff)
    scene.clamp(bar.start)
    scene.clamp(bar.end)
    scene.enable_contact()
    simulation = scene.build(integrator=integrator, time_step=2.5e-3)
    simulation.set_velocities(moving, np.tile([0.0, 0.0, -100.0], (31, 1)))
    start = simulation.energy()
    for _ in range(3):  # later they have whipped round each other
        simulation.step()
        assert simulation.positions(moving)[15, 2] > simulation.positions(bar)[15, 2]
    simulation.step(5)
    assert simulation.energy().work < 0.01 * start.kinetic
    assert excess(simulation, start.total) < 0.01 * start.kinetic


def rods_end_to_end(youngs_modulus: float, integrator: Any, friction: float) -> withe.Simulation:
    """One that flies at 100 m/s, its end on that of another one, which is held."""
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=youngs_modulus, poisson_ratio=0.5, density=1200.0)
    moving = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=RADIUS, material=material)
    held = scene.add_rod(start=(0.33, 0, 0), end=(0.63, 0, 0), nodes=31, radius=RADIUS, material=material)
    scene.clamp(held.end)
    scene.enable_contact(friction=friction)
    simulation = scene.build(integrator=integrator, time_step=2.5e-3)
    simulation.set_velocities(moving, np.tile([100.0, 0.0, 0.0], (31, 1)))
    return simulation


@pytest.mark.parametrize("integrator", IMPLICIT)
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_fast_rod_is_stopped_by_the_end_of_another(integrator: Any, friction: float) -> None:
    simulation = rods_end_to_end(1e9, integrator, friction)
    start = simulation.energy()
    for _ in range(10):
        simulation.step()
        moving, held = (simulation.positions(rod) for rod in simulation.rods)
        assert held[0, 0] - moving[-1, 0] > 1.95 * RADIUS
        assert excess(simulation, start.total) < 0.01 * start.kinetic
    assert simulation.velocities(simulation.rods[0])[:, 0].mean() < 5.0


def test_a_rod_that_a_blow_faster_than_sound_crushes_is_named() -> None:
    simulation = rods_end_to_end(1e6, "implicit_midpoint", 0.0)  # sound: 29 m/s
    with pytest.raises(withe.ConvergenceError, match=r"crushed to .* of its length at node .* of rod 'rod [12]'"):
        simulation.step(10)


def heavy_rod(friction_model: Any) -> tuple[withe.Scene, withe.Rod]:
    """A kilogram of rod on a floor, its limit of friction 3.92 N (Choi, dissertation, section 6.3.3)."""
    scene = withe.Scene(gravity=(0, 0, -9.8))
    material = withe.Material(youngs_modulus=1e5, poisson_ratio=0.5, density=509.2985)
    rod = scene.add_rod(start=(0, 0, 2.5e-2), end=(1, 0, 2.5e-2), nodes=26, radius=2.5e-2, material=material)
    scene.add_floor(friction=0.4)
    scene.enable_contact(friction_model=friction_model, distance_tolerance=5e-4)
    return scene, rod


@pytest.mark.case("contact", "Rod that is pushed along a floor", source="block with Coulomb friction")
@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "semi_explicit"])
def test_a_rod_pushed_along_a_floor_slides_as_a_block_does(friction_model: Any) -> None:
    scene, rod = heavy_rod(friction_model)
    push = scene.add_load(rod, (0, 0, 0))
    simulation = scene.build(time_step=5e-3)
    simulation.equilibrium()
    at_rest = simulation.snapshot()
    # With the direction of the step's start nothing sticks: it holds what moves, step by step.
    for force in (4.121, 6.0) if friction_model == "semi_explicit" else (3.0, 4.121, 6.0):
        simulation.restore(at_rest)
        simulation.set(push, load=(force, 0, 0))
        speeds = []
        for _ in range(3):
            simulation.step(100)
            v = simulation.velocities()[:, 0]
            speeds.append(0.5 * (v[1:] + v[:-1]).mean())  # momentum over mass
        # The sudden push shakes the rod, whose tail friction lifts; from then on it gains what a block does.
        pace = max(force - 0.4 * 9.8, 0.0)
        assert speeds[2] - speeds[0] == pytest.approx(pace, rel=5e-3, abs=1e-4)
        free = 5e-3 if friction_model == "semi_explicit" else 0.0  # the first step, from rest, is one without friction
        speed = 1.5 * pace + 0.4 * 9.8 * free
        assert simulation.energy().kinetic == pytest.approx(0.5 * speed**2, rel=0.01, abs=1e-4)


@pytest.mark.case("contact", "Friction force of a rod that sticks or slides", source="-F or -mu m g")
@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "anchored"])
@pytest.mark.parametrize(("force", "sticks"), [(1.5, True), (6.0, False)])
def test_friction_read_out_holds_a_block_or_is_at_its_limit(friction_model: Any, force: float, sticks: bool) -> None:
    scene, rod = heavy_rod(friction_model)
    push = scene.add_load(rod, (0, 0, 0))
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.equilibrium()
    simulation.set(push, load=(force, 0, 0))
    simulation.step(100)
    contacts = simulation.contacts()
    assert (contacts["sticking"] == sticks).all()
    friction = contacts["friction"].sum(axis=0)
    np.testing.assert_allclose(friction, (-force if sticks else -0.4 * 9.8, 0.0, 0.0), atol=0.01)
    limits = 0.4 * contacts["normal_force"]
    sizes = np.linalg.norm(contacts["friction"], axis=1)
    if sticks:
        assert (sizes < limits).all()
    else:
        np.testing.assert_allclose(sizes, limits, rtol=0.01)


@pytest.mark.parametrize(
    "contact", [{"model": "imcv1"}, {"model": "barrier"}, {"model": "spillmann_teschner"}, {"stiffness": "source"}]
)
def test_every_energy_and_stiffness_stops_a_rod_that_falls_on_another(contact: Any) -> None:
    scene = withe.Scene()
    bar = scene.add_rod(start=(0, -0.1, 0), end=(0, 0.1, 0), nodes=21, radius=RADIUS, material=RUBBER)
    scene.clamp(bar.start)
    scene.clamp(bar.end)
    rod = scene.add_rod(
        start=(-0.05, 0.0, 0.0102), end=(0.05, 0.0, 0.0102), nodes=11, radius=RADIUS, material=RUBBER, name="top"
    )
    scene.enable_contact(friction=0.5, **contact)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.set_velocities(rod, np.tile([0.0, 0.0, -0.5], (11, 1)))
    start = simulation.energy()
    lowest = np.inf
    for _ in range(40):
        simulation.step(10)
        gaps = simulation.contacts()["gap"]
        lowest = min(lowest, gaps.min(initial=np.inf))
        assert excess(simulation, start.total) < 0.01 * start.kinetic
    assert -0.05 * RADIUS < lowest < 0.1 * RADIUS
    assert (simulation.positions(rod)[5] > simulation.positions(bar)[10])[2]


def test_an_anchored_contact_does_not_creep_under_half_its_limit() -> None:
    scene, rod = heavy_rod("anchored")
    scene.add_load(rod, lambda t: (1.96 * min(t / 0.5, 1.0), 0, 0))
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.equilibrium()
    start = simulation.positions()[:, 0].mean()
    simulation.step(200)
    loaded = simulation.positions()[:, 0].mean()
    assert 0.0 < loaded - start < 5e-5
    simulation.step(2000)  # 10 s
    assert abs(simulation.positions()[:, 0].mean() - loaded) < 1e-5 * 2.5e-2


def test_a_rod_that_friction_holds_takes_few_iterations():
    """A matrix kept from one iteration to the next may serve worse than the first ones say."""
    scene = withe.Scene()
    soft = withe.Material(youngs_modulus=1e5, poisson_ratio=0.5, density=509.3)
    rod = scene.add_rod(start=(0, 0, 0.025), end=(1, 0, 0.025), nodes=26, radius=0.025, material=soft)
    scene.add_floor(friction=0.4)
    scene.enable_contact(distance_tolerance=5e-4)
    push = scene.add_load(rod, (0, 0, 0))
    simulation = scene.build(time_step=5e-3)
    simulation.equilibrium()
    simulation.set(push, load=(3.0, 0, 0))
    before = simulation.statistics.iterations
    simulation.step(60)
    assert simulation.statistics.iterations - before < 60 * 20
    assert abs(simulation.velocities(rod)).max() < 1e-3


def test_a_rope_that_runs_over_a_post_takes_no_energy_from_what_its_contacts_remember() -> None:
    post, radius = 0.05, 3e-3  # [m]
    angle = np.linspace(np.pi, 0.0, 60)
    arc = (post + 1.05 * radius) * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)
    drop = np.array([0.0, 0.0, 0.25])
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_capsule((0, -1, 0), (0, 1, 0), post)
    points = np.concatenate([[arc[0] - drop], arc, [arc[-1] - drop]])
    rope = scene.add_rod(points=points, nodes=81, radius=radius, material=RUBBER)
    scene.add_force(rope.start, (0, 0, -1.0))
    scene.add_force(rope.end, (0, 0, -1.3))
    scene.add_drag(0.5)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    simulation.step(75)  # until it hugs the post
    before = simulation.energy()
    simulation.step(75)  # nearly every edge on the post is another one now
    after = simulation.energy()
    assert before.loads - after.loads > 0.03  # [J]
    assert abs(after.work - before.work) < 1e-3 * (before.loads - after.loads)


@pytest.mark.parametrize("integrator", STABLE)
@pytest.mark.parametrize("post", [6e-3, 12e-3])  # [m]
def test_a_rod_that_wraps_a_post_within_a_step_gains_nothing_from_its_edges(integrator: Any, post: float) -> None:
    length, radius, speed = 0.31, 2.4e-3, 5.0  # [m], [m], [m/s]
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_capsule((0, -1, 0), (0, 1, 0), post)
    middle = np.array([0.27 * length, 0.0, post + 1.5 * radius])
    half = np.array([0.5 * length, 0.0, 0.0])
    soft = withe.Material(youngs_modulus=2.77e5, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=middle - half, end=middle + half, nodes=7, radius=radius, material=soft)
    simulation = scene.build(integrator=integrator, time_step=0.01)
    simulation.set_velocities(rod, np.tile([0.0, 0.0, -speed], (7, 1)))
    steps_in_contact_without_gain(simulation, 12, 5e-3 * simulation.energy().total)
    assert simulation.velocities(rod)[:, 2].max() > -0.9 * speed  # it has met the post, if only within a step


@pytest.mark.filterwarnings("ignore::withe.CoarseMeshWarning")
def test_coarse_rods_that_slide_over_each_other_only_lose_energy_in_energy_momentum_steps() -> None:
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_rod(start=(0, -0.15, 0), end=(0, 0.15, 0), nodes=6, radius=RADIUS, material=RUBBER)
    top = scene.add_rod(start=(-0.15, 0.011, 0.012), end=(0.15, -0.02, 0.012), nodes=7, radius=RADIUS, material=RUBBER)
    scene.enable_contact()
    simulation = scene.build(integrator="energy_momentum", time_step=2e-3, adaptive=False)
    velocity = np.zeros((7, 3))
    velocity[:, 1], velocity[:, 2] = 3.0, -2.0
    simulation.set_velocities(top, velocity)
    assert steps_in_contact_without_gain(simulation, 100, 1e-8 * simulation.energy().kinetic) > 5


def thrown(integrator: Any, on_a_post: bool, friction: float) -> withe.Simulation:
    """A fast rod that has met a post, or aslant a floor."""
    length, modulus, nodes, speed, step = (0.175, 1.3e7, 18, 42.0, 2.5e-4) if on_a_post else (0.4, 1e8, 30, 30.0, 1e-5)
    scene = withe.Scene(gravity=(0, 0, 0))
    if on_a_post:
        scene.add_capsule((0, -1, 0), (0, 1, 0), 0.02, friction=friction)
        middle, direction, along = np.array([0.227 * length, 0.0, 0.0275]), np.array([1.0, 0.0, 0.0]), 0.0
    else:
        scene.add_floor(friction=friction)
        direction, along = np.array([1.0, 0.0, 0.3]) / np.hypot(1.0, 0.3), 0.5
        middle = np.array([0.0, 0.0, 0.5 * length * direction[2] + 0.0075])
    half = 0.5 * length * direction
    stiff = withe.Material(youngs_modulus=modulus, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=middle - half, end=middle + half, nodes=nodes, radius=RADIUS, material=stiff)
    scene.enable_contact(friction=friction, friction_model="implicit")
    simulation = scene.build(integrator=integrator, time_step=step)
    simulation.set_velocities(rod, np.tile([along * speed, 0.0, -speed], (nodes, 1)))
    simulation.step(20)
    return simulation


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
@pytest.mark.parametrize("on_a_post", [False, True])
def test_fast_rods_that_friction_stops_within_a_step_need_no_shorter_ones(integrator: Any, on_a_post: bool) -> None:
    simulation, smooth = (thrown(integrator, on_a_post, friction) for friction in (0.7, 0.0))
    assert simulation.statistics.rejected_steps < 5 + smooth.statistics.rejected_steps
    assert simulation.energy().dissipated > 0.0


def test_friction_that_turns_round_within_a_step_is_found_without_cutting_it():
    # Over a slip of 1e-8 m, ten thousand times less than the rod moves in a step: Newton's method may go to and fro.
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 5e-3), end=(1, 0, 5e-3), nodes=31, radius=5e-3, material=rubber)
    scene.add_floor(friction=0.4)
    scene.enable_contact(friction_model="lagged", slip_tolerance=1e-5)
    push = scene.add_force(rod.end, (0.0, 0.3, 0.0))
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.step(20)
    simulation.set(push, force=(0.0, -0.3, 0.0))
    simulation.step(20)
    assert simulation.statistics.rejected_steps == 0
    assert simulation.statistics.iterations < 40 * 20


def test_a_pile_that_settles_takes_few_iterations():
    # Few of its many contacts stop at a time, and each may turn Newton's method round.
    scene = withe.Scene()
    random = np.random.default_rng(0)
    for i in range(48):
        layer, place = i % 12, i // 12
        middle = 0.02 * place + 2e-3 * random.random(2)
        ends = middle + 0.05 * np.array([[-1.0, 0.0], [1.0, 0.0]])
        height = np.full((2, 1), (1.005 + 2.005 * layer) * 2e-3)
        points = np.hstack([ends if layer % 2 == 0 else ends[:, ::-1], height])
        scene.add_rod(start=points[0], end=points[1], nodes=16, radius=2e-3, material=RUBBER)
    scene.add_floor(friction=0.3)
    scene.enable_contact(friction=0.3, friction_model="implicit")
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.step(20)
    assert simulation.statistics.iterations < 20 * 15


def explicit_rod(friction_model: Any, time_step: float, slip_tolerance: float = 1e-3) -> tuple[withe.Simulation, Any]:
    """The heavy rod, settled, and the push that it waits for."""
    scene, rod = heavy_rod(friction_model)
    scene.enable_contact(friction_model=friction_model, distance_tolerance=5e-4, slip_tolerance=slip_tolerance)
    push = scene.add_load(rod, (0, 0, 0))
    simulation = scene.build(integrator="verlet", time_step=time_step)
    simulation.equilibrium()
    return simulation, push


def test_an_explicit_rod_that_bounces_keeps_its_energy_and_books_no_loss():
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 8e-3), end=(0.3, 0, 9e-3), nodes=21, radius=RADIUS, material=RUBBER)
    scene.add_floor()
    simulation = scene.build(integrator="verlet", time_step=2e-5)
    start = simulation.energy().total
    lowest = 1.0
    for _ in range(100):
        simulation.step(50)
        lowest = min(lowest, simulation.positions(rod)[:, 2].min())
        assert abs(excess(simulation, start)) < 1e-3 * start
    assert lowest < RADIUS
    assert simulation.energy().dissipated == 0.0


def test_an_explicit_rod_rests_on_its_anchors_and_swings_about_where_they_hold_a_push():
    simulation, push = explicit_rod("anchored", 1e-4)
    simulation.step(500)
    assert np.abs(simulation.velocities()).max() < 1e-10
    start, place = simulation.energy(), simulation.positions()[:, 0].mean()
    simulation.set(push, load=(1.96, 0, 0))
    greatest = 0.0
    for _ in range(100):
        simulation.step(20)
        away = simulation.positions()[:, 0].mean() - place
        greatest = max(greatest, simulation.energy().kinetic)
        assert -1e-6 < away < 5e-5
        assert abs(excess(simulation, start.total)) < 0.02 * greatest
    assert greatest > 1e-6
    assert simulation.contacts()["sticking"].all()


@pytest.mark.parametrize("friction_model", ["implicit", "lagged"])
def test_an_explicit_step_that_friction_forbids_is_refused_with_the_one_that_it_allows(friction_model: Any) -> None:
    simulation, _ = explicit_rod(friction_model, 1e-4)
    with pytest.raises(withe.ConvergenceError, match=r"time_step below .* slip_tolerance") as caught:
        simulation.step()
    allowed = float(str(caught.value).split("below ")[1].split(" s")[0])
    # A node whose edges cannot turn: its mass over what slip at its speed meets, mu N K / 2.
    assert allowed < 1e-3 / (7.5 * 0.4 * 9.8)
    simulation, _ = explicit_rod(friction_model, 0.95 * allowed)
    start = simulation.energy().total
    simulation.step(5000)
    assert simulation.energy().kinetic < 1e-7
    assert abs(excess(simulation, start)) < 1e-7


@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "anchored"])
def test_what_friction_takes_in_explicit_steps_is_booked_to_second_order(friction_model: Any) -> None:
    errors = []
    for time_step in (1e-4, 5e-5):
        simulation, push = explicit_rod(friction_model, time_step, 2e-2)
        start = simulation.energy().total
        simulation.set(push, load=(6.0, 0, 0))
        simulation.step(round(0.4 / time_step))
        errors.append(excess(simulation, start) / simulation.energy().kinetic)
    print("explicit friction:", friction_model, errors)
    assert abs(errors[0]) < 1e-4
    # Lagged friction has its normal force from the start of the step.
    assert abs(errors[1]) < abs(errors[0]) / (1.8 if friction_model == "lagged" else 3.0)


@pytest.mark.case("contact", "Rod that slides, explicit steps", source="block with Coulomb friction")
@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "anchored"])
def test_explicit_steps_let_a_rod_slide_as_a_block_does(friction_model: Any) -> None:
    simulation, push = explicit_rod(friction_model, 1e-4, 2e-2)
    start = simulation.energy().total
    simulation.set(push, load=(6.0, 0, 0))
    simulation.step(4000)
    v = simulation.velocities()[:, 0]
    measured(0.5 * (v[1:] + v[:-1]).mean() / (0.4 * (6.0 - 0.4 * 9.8)) - 1.0)
    assert 0.5 * (v[1:] + v[:-1]).mean() == pytest.approx(0.4 * (6.0 - 0.4 * 9.8), rel=0.015)  # momentum over mass
    assert abs(excess(simulation, start)) < 1e-3 * simulation.energy().kinetic
    contacts = simulation.contacts()
    late = 0.03 if friction_model == "lagged" else 1e-3  # its normal forces are those of the step's start [N]
    np.testing.assert_allclose(-contacts["friction"][:, 0], 0.4 * contacts["normal_force"], rtol=0.01, atol=late)


@pytest.mark.case("contact", "Braking force between rods without friction, over weight", source="zero")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("angle", [90.0, 60.0])
@pytest.mark.parametrize("time_step", [2e-3, 5e-4])
def test_rods_that_slide_over_rods_without_friction_are_not_braked(integrator: Any, angle: float, time_step: float):
    """By the weight times v dt / 2 D they were, 0.075 of it in the longer steps: forces leaned against the motion."""
    radius, speed, duration, nodes = 2e-3, 0.3, 0.05, 12
    stiff = withe.Material(youngs_modulus=1e8, poisson_ratio=0.5, density=1100.0, viscosity=1e4)
    scene = withe.Scene()
    across = 0.05 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    for x in (0.08, 0.22):
        middle = np.array([x, 0.0, 0.0])
        rail = scene.add_rod(start=middle - across, end=middle + across, nodes=4, radius=radius, material=stiff)
        for node in range(4):
            scene.pin(rail.node(node))
    up = 2.0002 * radius
    rod = scene.add_rod(start=(0, 0, up), end=(0.3, 0, up), nodes=nodes, radius=radius, material=stiff)
    scene.enable_contact()
    simulation = scene.build(integrator=integrator, time_step=time_step)
    simulation.step(round(0.1 / time_step))
    simulation.set_velocities(rod, np.tile([speed, 0.0, 0.0], (nodes, 1)))
    simulation.step(round(duration / time_step))
    masses = np.r_[0.5, np.ones(nodes - 2), 0.5] / (nodes - 1)
    lost = speed - np.linalg.norm(masses @ simulation.velocities(rod)[:, :2])
    measured(abs(lost) / (9.81 * duration), "m g")
    assert abs(lost) / (9.81 * duration) < 2e-3


@pytest.mark.case("contact", "Contact forces of a rod on a sphere or cylinder", source="balance of forces")
@pytest.mark.parametrize("nodes", [6, 9, 17])
@pytest.mark.parametrize("kind", ["sphere", "capsule"])
def test_contacts_read_out_balance_weight_and_reaction_on_what_is_round(kind: str, nodes: int) -> None:
    """On a coarse rod the three distances that make one have normals of their own."""
    scene = withe.Scene()
    soft = withe.Material(youngs_modulus=3e5, density=1200.0)
    rod = scene.add_rod(start=(-0.12, 0, 0.105), end=(0.28, 0, 0.105), nodes=nodes, radius=5e-3, material=soft)
    wall = scene.clamp(rod.start)
    if kind == "sphere":
        scene.add_sphere((0.02, 0, 0), 0.1)
    else:
        scene.add_capsule((0.02, -0.5, 0), (0.02, 0.5, 0), 0.1)
    simulation = scene.build(integrator="static", planar=True)  # sideways it would roll off
    simulation.equilibrium()
    contacts = simulation.contacts()
    assert len(contacts) > 2
    np.testing.assert_allclose(np.linalg.norm(contacts["normal"], axis=1), 1.0, rtol=1e-12)
    pressing = (contacts["normal_force"][:, None] * contacts["normal"]).sum(axis=0)
    weight = np.array([0.0, 0.0, 1200.0 * np.pi * 5e-3**2 * 0.4 * 9.81])
    measured((pressing + simulation.reaction(wall).force - weight) / np.linalg.norm(weight))
    np.testing.assert_allclose(pressing + simulation.reaction(wall).force, weight, atol=1e-9)
