"""Friction along a rod, either way, and across it: the force of the model, that it only takes, and gaits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import withe
from cases import measured

GRAVITY, RADIUS, DENSITY = 9.81, 5e-3, 1000.0
ALONG, ACROSS = 0.1, 0.35
FORWARD, BACKWARD = 0.1, 0.5
WEIGHT = DENSITY * np.pi * RADIUS**2 * GRAVITY  # [N/m]


def lying(length, nodes, friction, modulus=1e7, friction_model="anchored", **options):
    scene = withe.Scene()
    rod = scene.add_rod(
        start=(0, 0, RADIUS),
        end=(length, 0, RADIUS),
        nodes=nodes,
        radius=RADIUS,
        material=withe.Material(youngs_modulus=modulus, density=DENSITY, viscosity=options.pop("viscosity", 0.0)),
        normal=(0, 1, 0),
    )
    scene.add_floor(friction=friction)
    scene.enable_contact(friction_model=friction_model, centreline_friction=True)
    return rod, scene


@pytest.mark.case(
    "contact", "Force on a rod with directed friction that slides at an angle", source="N (mu_t cos a, mu_n sin a)"
)
@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.0, np.pi / 2])
def test_sliding_at_an_angle_takes_the_force_of_the_model(friction_model, angle):
    """A rod between two clamps that go at an angle to it: N (mu_along cos, mu_across sin) on them."""
    rod, scene = lying(0.2, 11, (ALONG, ACROSS), friction_model=friction_model)
    hands = scene.clamp(rod.start), scene.clamp(rod.end)
    simulation = scene.build(time_step=2e-3, integrator="backward_euler")
    simulation.run(0.1, progress=False)
    step = 0.05 * np.array((np.cos(angle), np.sin(angle), 0.0))
    for hand, place in zip(hands, simulation.positions(rod)[[0, -1]], strict=True):
        simulation.move(hand, place + step, over=0.5)
    simulation.run(0.4, progress=False)
    pulled = sum(simulation.reaction(hand).force for hand in hands)
    normal = simulation.contacts()["normal_force"].sum()
    np.testing.assert_allclose(
        pulled[:2], normal * np.array((ALONG * np.cos(angle), ACROSS * np.sin(angle))), atol=2e-3 * normal * ACROSS
    )


@pytest.mark.case(
    "contact", "Path of a rod with directed friction that slides to rest", source="ordinary differential equation"
)
def test_a_rod_that_slides_to_rest_goes_the_way_of_the_model():
    """v' = -g (mu_along v_x, mu_across v_y) / |v|: it turns into its own direction while it slows down."""
    found = solve_ivp(
        lambda t, y: (*y[2:], *(-GRAVITY * np.array((ALONG, ACROSS)) * y[2:] / np.hypot(*y[2:]))),
        (0, 0.15),
        (0, 0, 0.25, 0.4),
        rtol=1e-9,
        atol=1e-12,
    ).y[:, -1]
    errors = []
    for time_step in (2e-3, 1e-3):
        rod, scene = lying(0.1, 6, (ALONG, ACROSS))
        simulation = scene.build(time_step=time_step)
        simulation.run(0.1, progress=False)
        start = simulation.positions(rod).mean(axis=0)
        simulation.set_velocities(rod, (0.25, 0.4, 0))
        simulation.run(0.15, progress=False)
        way = (simulation.positions(rod).mean(axis=0) - start)[:2]
        errors.append(np.linalg.norm(way - found[:2]))
    measured(errors[-1] / np.linalg.norm(found[:2]))
    assert errors[-1] < 0.01 * np.linalg.norm(found[:2])


@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
def test_it_only_takes(friction_model):
    """From rods that are thrown onto a floor, turning: what is left and lost never grows."""
    random = np.random.default_rng(3)
    for _ in range(3):
        rod, scene = lying(0.2, 8, tuple(random.permutation((ALONG, ACROSS, 0.7))), 1e6, friction_model)
        simulation = scene.build(time_step=1e-3, integrator="backward_euler")
        x = simulation.positions(rod)
        turn = random.normal(0, 3)
        thrown = np.append(random.normal(0, 0.3, 2), 0.0)
        simulation.set_velocities(rod, thrown + np.column_stack([-turn * x[:, 1], turn * x[:, 0], 0 * x[:, 0]]))
        lost, kinetic = 0.0, simulation.energy().kinetic
        for _ in range(150):
            simulation.step()
            energy = simulation.energy()
            assert energy.dissipated >= lost - 1e-9 * kinetic
            lost = energy.dissipated
        assert simulation.energy().kinetic < kinetic


@pytest.mark.case("contact", "Sliding distance with friction forward and backward", source="v^2 / (2 mu g)")
@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
@pytest.mark.parametrize(("way", "friction"), [(1.0, FORWARD), (-1.0, BACKWARD)])
def test_a_rod_slides_towards_its_end_and_its_start_by_a_friction_each(way, friction, friction_model):
    rod, scene = lying(0.1, 6, (FORWARD, BACKWARD, ACROSS), friction_model=friction_model)
    simulation = scene.build(time_step=1e-3)
    simulation.run(0.1, progress=False)
    start, speed = simulation.positions(rod).mean(axis=0), 0.4
    simulation.set_velocities(rod, (way * speed, 0, 0))
    simulation.run(1.2 * speed / (FORWARD * GRAVITY), progress=False)
    slid = (simulation.positions(rod).mean(axis=0) - start)[0]
    assert slid == pytest.approx(way * speed**2 / (2.0 * friction * GRAVITY), rel=5e-3)


@pytest.mark.parametrize(("way", "holds"), [(1.0, False), (-1.0, True)])
def test_a_slope_holds_a_rod_the_one_way_only(way, holds):
    slope = 0.25
    scene = withe.Scene()
    down = np.array((np.cos(slope), 0.0, -np.sin(slope)))
    normal = np.array((np.sin(slope), 0.0, np.cos(slope)))
    ends = 0.1 * np.outer((-0.5, 0.5), way * down) + RADIUS * normal
    rod = scene.add_rod(
        start=ends[0],
        end=ends[1],
        nodes=6,
        radius=RADIUS,
        material=withe.Material(youngs_modulus=1e7, density=DENSITY),
    )
    scene.add_plane((0, 0, 0), normal, friction=(FORWARD, BACKWARD, 1.0))
    simulation = scene.build(time_step=1e-3)
    simulation.run(0.3, progress=False)
    slid = (simulation.positions(rod).mean(axis=0) - ends.mean(axis=0)) @ down
    expected = 0.0 if holds else 0.5 * GRAVITY * (np.sin(slope) - FORWARD * np.cos(slope)) * 0.3**2
    assert slid == pytest.approx(expected, rel=0.01, abs=2e-5)


@pytest.mark.case("contact", "Stride of a worm that stretches", source="e L (mu_b - mu_f) / (mu_b + mu_f)")
def test_a_worm_that_stretches_and_shortens_crawls_by_what_friction_differs():
    """All of a body that stretches evenly and slowly slides, mu_b / (mu_f + mu_b) of it forward in either half of a
    cycle: the middle goes by strain length (mu_b - mu_f) / (mu_b + mu_f) a cycle."""
    length, strain, period = 0.2, 0.2, 1.0
    rod, scene = lying(length, 41, (FORWARD, BACKWARD, 1.0), modulus=1e6, viscosity=1e3)
    simulation = scene.build(time_step=5e-3, integrator="backward_euler")
    middles = []
    for _ in range(4):
        middles.append(simulation.positions(rod)[:, 0].mean())
        for stretch in (1.0 + strain, 1.0):
            simulation.set(rod, natural_stretch=stretch, over=0.5 * period)
            simulation.run(0.5 * period, progress=False)
    step = strain * length * (BACKWARD - FORWARD) / (BACKWARD + FORWARD)
    np.testing.assert_allclose(np.diff(middles)[1:], step, rtol=0.03)


def snake_speed(length, amplitude, waves, period, forward, backward, across, points=200):
    """Mean velocity of the middle of a body of given curvature without inertia, for Coulomb friction along and across
    it.

    The sums of forces and moments vanish [Hu et al. 2009, PNAS 106, eq. 1-3; Guo and Mahadevan 2008, PNAS 105].
    """
    s = (np.arange(points) + 0.5) / points

    def shape(t):
        theta = amplitude * np.cos(2 * np.pi * (waves * s + t / period)) / (2 * np.pi * waves) * length
        theta = theta - theta.mean()
        tangent = np.stack([np.cos(theta), np.sin(theta)])
        x = np.cumsum(tangent, axis=1) * length / points
        return x - x.mean(axis=1)[:, None], tangent

    def unbalanced(motion, t):
        little = 1e-5 * period
        (x, tangent), (after, _), (before, _) = shape(t), shape(t + little), shape(t - little)
        v = (after - before) / (2 * little)
        v = v + motion[:2, None] + motion[2] * np.stack([-x[1], x[0]]) / length
        v = v / np.sqrt((v**2).sum(axis=0) + (1e-4 * length / period) ** 2)
        part = (v * tangent).sum(axis=0)
        f = np.where(part > 0.0, forward, backward) * part * tangent + across * (v - part * tangent)
        return (*f.mean(axis=1), (x[0] * f[1] - x[1] * f[0]).mean() / length)

    steps, motion, way, angle = 60, np.zeros(3), np.zeros(2), 0.0
    for k in range(steps):
        motion = fsolve(unbalanced, motion, args=((k + 0.5) / steps * period,), xtol=1e-10)
        angle += 0.5 * motion[2] / length * period / steps
        turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        way += turned @ motion[:2] * period / steps
        angle += 0.5 * motion[2] / length * period / steps
    return way / period


def crawl(*friction):
    length, nodes, period, waves, amplitude = 0.3, 31, 2.0, 1.0, 14.0
    rod, scene = lying(length, nodes, friction, modulus=3e6, viscosity=2e4)
    simulation = scene.build(time_step=1e-2, integrator="backward_euler")
    s = (np.arange(rod.stencils) + 1) / (nodes - 1)
    ways = []

    def bend(now):
        t = now.time
        kappa = -amplitude * np.sin(2 * np.pi * (waves * s + t / period)) * min(t / (0.5 * period), 1.0)
        now.set(rod, natural_curvature=np.column_stack([kappa, 0 * kappa]))

    simulation.run(2 * period, progress=False, before_step=bend)
    ways.append(simulation.positions(rod)[:, :2].mean(axis=0))
    simulation.run(period, progress=False, before_step=bend)
    ways.append(simulation.positions(rod)[:, :2].mean(axis=0))
    return np.linalg.norm(ways[1] - ways[0]) / period, snake_speed(length, amplitude, waves, period, *friction)


@pytest.mark.case(
    "contact", "Speed of a snake, three friction laws", source="quasi-static model [Hu et al. 2009, eq. 1-3]"
)
@pytest.mark.parametrize("friction", [(0.1, 0.1, 0.4), (0.1, 0.15, 0.2), (0.15, 0.1, 0.5)])
def test_a_snake_crawls_by_friction_that_differs(friction):
    """Scales resist one way more than the other; 1 : 1.5 : 2 are those of a snake of PyElastica's."""
    speed, expected = crawl(*friction)
    assert np.linalg.norm(expected) > 0.01
    assert speed == pytest.approx(np.linalg.norm(expected), rel=0.05)


def test_a_snake_stays_where_it_is_without():
    speed, expected = crawl(0.2, 0.2, 0.2)
    assert np.linalg.norm(expected) < 2e-3
    assert speed < 3e-3
