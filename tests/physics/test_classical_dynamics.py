"""Motions of the literature against ordinary differential equations: linkages of stiff bars, beams that bend far."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rods
import withe
from cases import measured
from convergence import assert_order, assert_order_at_least
from hermite_beam import fly

GRAVITY = 9.81
# Bars of unit length and mass that bend by 1e-5 of it under their weight.
STIFF = {
    "stiffness": withe.Stiffness(stretch=1e7, bend=1e5, twist=1e5),
    "line_density": 1.0,
    "radius": 1e-3,
}


def bar(scene, start, end, edges):
    return scene.add_rod(start=(start[0], 0, start[1]), end=(end[0], 0, end[1]), nodes=edges + 1, **STIFF)


def followed(simulation, rod, times):
    """End of a rod in the plane of x and z, at times that are whole numbers of steps apart."""
    found = []
    for t in times:
        simulation.step(round((t - simulation.time) / simulation.time_step))
        found.append(simulation.positions(rod)[-1, [0, 2]])
    return np.array(found)


def farthest(found, exact):
    return float(np.linalg.norm(found - exact, axis=1).max())


SWINGS = np.linspace(0.1, 1.5, 15)


def double_pendulum(first, second):
    """End of two bars let go at angles from the vertical, by Lagrange's equations."""

    def rates(t, y):
        a, b, u, v = y
        mass = np.array([[4.0 / 3.0, 0.5 * np.cos(a - b)], [0.5 * np.cos(a - b), 1.0 / 3.0]])
        force = (
            -0.5 * np.sin(a - b) * v**2 - 1.5 * GRAVITY * np.sin(a),
            0.5 * np.sin(a - b) * u**2 - 0.5 * GRAVITY * np.sin(b),
        )
        return [u, v, *np.linalg.solve(mass, force)]

    times = (0.0, SWINGS[-1])
    a, b = solve_ivp(rates, times, (first, second, 0, 0), t_eval=SWINGS, rtol=1e-10, atol=1e-11, method="DOP853").y[:2]
    return np.stack([np.sin(a) + np.sin(b), -np.cos(a) - np.cos(b)], axis=1)


@pytest.mark.case("dynamics", "Double pendulum of stiff bars", source="Lagrange's equations")
@pytest.mark.parametrize("kind", ["pinned", "revolute"])
def test_a_double_pendulum_swings_as_by_lagrange(kind):
    exact = double_pendulum(1.2, 0.4)
    knee = np.array((np.sin(1.2), -np.cos(1.2)))
    hand = knee + np.array((np.sin(0.4), -np.cos(0.4)))

    def missed(edges, step):
        scene = withe.Scene()
        upper, lower = bar(scene, (0.0, 0.0), knee, edges), bar(scene, knee, hand, edges)
        scene.pin(upper.start)
        scene.join(upper.end, lower.start, kind, **({"axis": (0, 1, 0)} if kind == "revolute" else {}))
        return farthest(followed(scene.build(time_step=step), lower, SWINGS), exact)

    meshes = [missed(n, 5e-4) for n in (1, 2, 10)]
    steps = [missed(20, dt) for dt in (2e-2, 1e-2, 5e-3)]
    print(f"double pendulum, {kind}:", meshes, steps)
    # Stiff bars carry their mass along them: one edge is enough, and only the step is left.
    measured(max(meshes), "L")
    assert max(meshes) < 1e-4
    assert_order_at_least(steps, 2.0, slack=0.3)


# A crank, a coupler and a rocker on a ground of unit length [any book on mechanisms].
CRANK, COUPLER, ROCKER = 0.4, 0.9, 0.7


def joints_of_four_bar(angle):
    """Ends of the crank and of the rocker."""
    crank = CRANK * np.array((np.cos(angle), np.sin(angle)))
    ground = np.array((1.0, 0.0))
    span = ground - crank
    size = np.linalg.norm(span)
    along = (COUPLER**2 - ROCKER**2 + size**2) / (2.0 * size)
    up = np.array((-span[1], span[0])) / size
    return crank, crank + along * span / size + np.sqrt(COUPLER**2 - along**2) * up


def four_bar(start, times):
    """One coordinate: E = m(a) u^2 / 2 + V(a), so that m u' = -V' - m' u^2 / 2; by derivatives of the joints."""
    tiny = 1e-5

    def inertia(angle):
        (c1, r1), (c0, r0) = joints_of_four_bar(angle + tiny), joints_of_four_bar(angle - tiny)
        c, r = (c1 - c0) / (2.0 * tiny), (r1 - r0) / (2.0 * tiny)
        # A bar whose ends move at u and v: its mass times (u.u + u.v + v.v) / 3.
        return (CRANK * c @ c + COUPLER * (c @ c + c @ r + r @ r) + ROCKER * r @ r) / 3.0

    def height(angle):
        c, r = joints_of_four_bar(angle)
        return GRAVITY * (CRANK * 0.5 * c[1] + COUPLER * 0.5 * (c[1] + r[1]) + ROCKER * 0.5 * r[1])

    def rates(t, y):
        a, u = y
        step = 1e-4
        slope = (height(a + step) - height(a - step)) / (2.0 * step)
        change = (inertia(a + step) - inertia(a - step)) / (2.0 * step)
        return [u, (-slope - 0.5 * change * u**2) / inertia(a)]

    y = solve_ivp(rates, (0.0, times[-1]), (start, 0.0), t_eval=times, rtol=1e-9, atol=1e-10, method="DOP853").y
    return np.array([joints_of_four_bar(a)[1] for a in y[0]])


@pytest.mark.case("dynamics", "Four-bar linkage of stiff bars", source="Lagrange's equations")
def test_a_four_bar_linkage_moves_as_by_lagrange():
    times = np.linspace(0.1, 1.0, 10)
    exact = four_bar(0.9, times)
    first, second = joints_of_four_bar(0.9)

    def missed(edges, step):
        scene = withe.Scene()
        crank = bar(scene, (0.0, 0.0), first, edges)
        coupler = bar(scene, first, second, edges)
        rocker = bar(scene, (1.0, 0.0), second, edges)
        scene.pin(crank.start)
        scene.pin(rocker.start)
        scene.join(crank.end, coupler.start, "pinned")
        scene.join(coupler.end, rocker.end, "pinned")
        return farthest(followed(scene.build(time_step=step), rocker, times), exact)

    meshes = [missed(n, 5e-4) for n in (1, 2, 10)]
    steps = [missed(20, dt) for dt in (2e-2, 1e-2, 5e-3)]
    print("four-bar:", meshes, steps)
    measured(max(meshes), "L")
    assert max(meshes) < 1e-4
    assert_order_at_least(steps, 2.0, slack=0.3)


def pulse(time):
    """Smooth, so that no wave of stretch runs up and down: 2.5 s long."""
    return float(np.sin(np.pi * time / 2.5) ** 2) if time < 2.5 else 0.0


FLIGHT = np.array((1.0, 2.0, 3.0, 4.0))


@pytest.fixture(scope="module")
def spaghetti():
    """Both ends of the beam at these times, good to 3e-5 of its length of 10."""

    def load(time):
        return 8.0 * pulse(time), 0.0, -80.0 * pulse(time)

    return fly(10.0, 8, 1e4, 500.0, direction=(0.6, 0.8), load=load, times=FLIGHT)


def flown(edges, step):
    scene = rods.weightless()
    beam = scene.add_rod(
        start=(0, 0, 0),
        end=(6, 0, 8),
        nodes=edges + 1,
        radius=1e-3,
        line_density=1.0,
        stiffness=withe.Stiffness(stretch=1e4, bend=500.0, twist=500.0),
    )
    scene.add_force(beam.end, lambda t: (8.0 * pulse(t), 0.0, 0.0))
    scene.add_moment(beam.end, lambda t: (0.0, 80.0 * pulse(t), 0.0))
    simulation = scene.build(time_step=step)
    found = []
    for t in FLIGHT:
        simulation.step(round((t - simulation.time) / step))
        found.append(simulation.positions(beam)[[0, -1]][:, [0, 2]])
    return np.array(found)


@pytest.mark.case(
    "dynamics", "Flying spaghetti, planar", source="beam of Hermite elements; scene of [Simo and Vu-Quoc 1986]"
)
@pytest.mark.slow
def test_spaghetti_flies_as_a_beam_of_smooth_elements(spaghetti):
    """[Simo and Vu-Quoc 1986], the flexible one, in a plane: EA 1e4, EI 500, 8 N and 80 N m at an end."""

    def missed(edges, step):
        return float(np.linalg.norm(flown(edges, step) - spaghetti, axis=2).max()) / 10.0

    meshes = [missed(n, 1e-3) for n in (10, 20, 40)]
    print("spaghetti by mesh:", meshes, "at 40 edges and 5 ms", missed(40, 5e-3))
    measured(meshes[-1], "L")
    assert meshes[-1] < 1e-4
    assert_order(meshes, slack=0.3)
    steps = [flown(20, dt) for dt in (2e-2, 1e-2, 5e-3, 2.5e-3)]
    assert_order([float(np.linalg.norm(a - b)) for a, b in zip(steps[:-1], steps[1:], strict=True)], slack=0.3)


@pytest.mark.case("dynamics", "Flexible pendulum that falls", source="beam of Hermite elements")
def test_a_flexible_pendulum_falls_as_a_beam_of_smooth_elements():
    """Let go level from a pin; EI = 0.02, w L^3 / EI = 490."""
    times = np.array((0.2, 0.4))
    exact = fly(1.0, 16, 1e3, 0.02, direction=(1.0, 0.0), gravity=(0.0, -GRAVITY), pinned=True, times=times)[:, 1]

    def fallen(edges, step):
        scene = withe.Scene()
        soft = withe.Stiffness(stretch=1e3, bend=0.02, twist=0.02)
        rope = scene.add_rod(
            start=(0, 0, 0), end=(1, 0, 0), nodes=edges + 1, radius=1e-3, line_density=1.0, stiffness=soft
        )
        scene.pin(rope.start)
        return followed(scene.build(time_step=step), rope, times)

    meshes = [farthest(fallen(n, 1e-3), exact) for n in (10, 20, 40)]
    print("flexible pendulum by mesh:", meshes, "at 40 edges and 5 ms", farthest(fallen(40, 5e-3), exact))
    measured(meshes[-1], "L")
    assert meshes[-1] < 7e-4
    assert_order(meshes, slack=0.3)
    steps = [fallen(20, dt) for dt in (2.5e-3, 1.25e-3, 6.25e-4, 3.125e-4)]
    assert_order_at_least(
        [float(np.linalg.norm(a - b)) for a, b in zip(steps[:-1], steps[1:], strict=True)], 2.0, slack=0.3
    )


@pytest.mark.case("dynamics", "Rod on a turning hub: stretch and kinetic energy", source="x + u = sin(k x) / (k cos k)")
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_a_rod_on_a_turning_hub_stretches_and_stores_as_in_theory_and_goes_on_so(integrator):
    """EA u'' + m w^2 (x + u) = 0, u(0) = u'(1) = 0: x + u = sin(k x) / (k cos k), k^2 = m w^2 / EA.

    So T = (m w^2 / 2) (1/2 - sin(2 k) / 4 k) / (k cos k)^2. Silicone at twice a turn a second, 0.294 for k; its slowest
    mode of bending would swing a sixteenth as fast were it not for the tension.
    """
    rate, stretch = 12.0, 2e6 * np.pi * 1e-4
    density = 1200.0 * np.pi * 1e-4
    k = rate * np.sqrt(density / stretch)
    kinetic = 0.5 * density * rate**2 * (0.5 - np.sin(2.0 * k) / (4.0 * k)) / (k * np.cos(k)) ** 2
    errors = []
    for edges in (8, 16, 32):
        scene = rods.weightless()
        silicone = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1200.0)
        rod = scene.add_rod(
            start=(0, 0, 0), end=(1, 0, 0), nodes=edges + 1, radius=1e-2, material=silicone, normal=(0, 0, 1)
        )
        hub = scene.clamp(rod.start)
        simulation = scene.build(integrator=integrator, time_step=0.016 / edges)
        x = np.linspace(0.0, 1.0, edges + 1)
        places = np.outer(np.sin(k * x) / (k * np.cos(k)), (1.0, 0.0, 0.0))
        simulation.set_state(rod, positions=places, velocities=np.cross((0.0, 0.0, rate), places))

        def path(t):
            c, s = np.cos(rate * t), np.sin(rate * t)
            return (0, 0, 0), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])

        simulation.move(hub, path=path)
        seen = []
        for _ in range(100):
            simulation.step(edges // 8)
            seen.append((simulation.energy().kinetic, np.linalg.norm(simulation.positions(rod)[-1])))
        ratio = np.array(seen) / (kinetic, np.tan(k) / k) - 1.0
        errors.append(np.abs(ratio).max(axis=0))
    errors = np.array(errors)
    print(integrator, "turning hub:", errors)
    assert_order_at_least(errors[:, 0], 2.0, slack=0.3)
    assert_order_at_least(errors[:, 1], 2.0, slack=0.3)
    measured(errors[-1])
    assert errors[-1].max() < 1e-3
