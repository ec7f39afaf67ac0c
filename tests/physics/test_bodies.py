"""Rigid bodies against rigid-body dynamics, beams with bodies at their ends, and conservation over drawn scenes."""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import j0, j1, y0, y1

import withe
from cases import measured
from convergence import assert_order, assert_order_at_least

Array = npt.NDArray[np.float64]
G = 9.81


def limp(scene: withe.Scene, nodes: int, end: npt.ArrayLike, bend: float, density: float, stretch: float) -> withe.Rod:
    """Return a rod from the origin."""
    stiffness = withe.Stiffness(stretch=stretch, bend=bend, twist=bend)
    return scene.add_rod(start=(0, 0, 0), end=end, nodes=nodes, radius=1e-3, stiffness=stiffness, line_density=density)


def frequencies(scene: withe.Scene, count: int = 12) -> Array:
    """Return angular frequencies about the equilibrium [rad/s]."""
    simulation = scene.build(integrator="static", planar=False)
    simulation.equilibrium()
    return 2.0 * np.pi * np.asarray(simulation.linearise().frequencies(count))


def nearest(found: Array, expected: float) -> float:
    """Return the relative error of the frequency that is nearest to the expected one."""
    return float(np.abs(found / expected - 1.0).min())


@pytest.mark.case("bodies", "Free body that turns about its middle axis", source="Euler's equations")
def test_a_free_body_tumbles() -> None:
    """Second order in the step; energy and angular momentum to rounding."""
    moments, rates = np.array([1e-4, 2e-4, 2.5e-4]), np.array([0.01, 10.0, 0.02])
    exact = solve_ivp(
        lambda _, w: np.cross(moments * w, w) / moments, (0.0, 1.0), rates, rtol=1e-12, atol=1e-12, method="DOP853"
    ).y[:, -1]
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene = withe.Scene(gravity=(0, 0, 0))
        body = scene.add_body(mass=0.1, inertia=moments)
        simulation = scene.build(time_step=step)
        simulation.set_velocity(body, angular=rates)
        energy, momentum = simulation.energy().kinetic, simulation.momentum().angular
        simulation.step(round(1.0 / step))
        errors.append(np.abs(simulation.rotation(body).T @ simulation.angular_velocity(body) - exact).max())
        assert simulation.energy().kinetic == pytest.approx(energy, rel=1e-10)
        np.testing.assert_allclose(simulation.momentum().angular, momentum, atol=1e-9 * np.linalg.norm(momentum))
    measured(errors[-1] / 10.0)
    assert_order(errors, 2.0)


@pytest.mark.case("bodies", "Heavy top on a ball joint", source="Lagrange's equations")
def test_a_heavy_top_nutates_and_precesses() -> None:
    """The pin is off the centre of mass; second order in the step."""
    mass, arm, across, along, spin, lean = 0.5, 0.06, 0.0024, 0.0006, 150.0, np.radians(30.0)
    about_axis, vertical = along * spin, along * spin * np.cos(lean)

    def rates(_: float, y: Array) -> list[float]:
        theta, rate, _phi = y
        precession = (vertical - about_axis * np.cos(theta)) / (across * np.sin(theta) ** 2)
        gyroscopic = across * precession**2 * np.sin(theta) * np.cos(theta) - about_axis * precession * np.sin(theta)
        return [rate, (gyroscopic + mass * G * arm * np.sin(theta)) / across, precession]

    exact = solve_ivp(rates, (0.0, 0.5), [lean, 0.0, 0.0], rtol=1e-12, atol=1e-12, method="DOP853").y[[0, 2], -1]
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        scene = withe.Scene()
        axis = np.array([np.sin(lean), 0.0, np.cos(lean)])
        turn = np.column_stack([np.cross((0, 1, 0), axis), (0, 1, 0), axis])
        inertia = (across - mass * arm**2, across - mass * arm**2, along)
        top = scene.add_body(mass=mass, inertia=inertia, center=(0, 0, arm), rotation=turn)
        scene.pin(top, at=(0, 0, 0))
        simulation = scene.build(time_step=step)
        simulation.set_velocity(top, angular=spin * axis)
        energy = simulation.energy().total
        simulation.step(round(0.5 / step))
        now = simulation.rotation(top)[:, 2]
        errors.append(np.abs([np.arccos(now[2]), np.arctan2(now[1], now[0])] - exact).max())
        assert simulation.energy().total == pytest.approx(energy, abs=1e-8 * abs(energy))
    measured(errors[-1], "rad")
    assert_order(errors, 2.0)


def tip_body_roots(mass: float, inertia: float, offset: float, count: int) -> list[float]:
    """Return beta L of a cantilever with a body at its end; lengths over L, masses over rho A L."""

    def determinant(b: float) -> float:
        c, s, ch, sh = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        w, d = np.array([c - ch, s - sh]), b * np.array([-s - sh, c - ch])
        second, third = b**2 * np.array([-c - ch, -s - sh]), b**3 * np.array([s - sh, -c - ch])
        moment = second - b**4 * (inertia * d + mass * offset * (w + offset * d))
        force = third + b**4 * mass * (w + offset * d)
        return float(np.linalg.det(np.array([moment, force])) / ch)

    grid = np.linspace(0.05, 12.0, 4000)
    values = [determinant(b) for b in grid]
    signs = [i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0.0]
    return [brentq(determinant, grid[i], grid[i + 1], xtol=1e-14) for i in signs[:count]]


@pytest.mark.case(
    "bodies", "Cantilever with a body at its end", source="transcendental equation [Bhat and Wagner 1976]"
)
@pytest.mark.parametrize("mass", [0.1, 1.0, 1000.0])
@pytest.mark.parametrize(("inertia", "offset"), [(0.1, 0.0), (0.01, 0.2)])
def test_frequencies_of_a_cantilever_with_a_body(mass: float, inertia: float, offset: float) -> None:
    """Two modes, mass and inertia over those of the beam; second order in the mesh or better."""
    length, bend, density = 0.5, 0.01, 0.1
    expected = np.square(tip_body_roots(mass, inertia * mass, offset, 2)) * np.sqrt(bend / density) / length**2
    errors = []
    for nodes in (11, 21, 41):
        scene = withe.Scene(gravity=(0, 0, 0))
        beam = limp(scene, nodes, (length, 0, 0), bend, density, 1e7)
        scene.clamp(beam.start)
        kilograms = mass * density * length
        body = scene.add_body(
            mass=kilograms,
            inertia=inertia * kilograms * length**2,
            center=(offset * length, 0, 0),
            position=(length, 0, 0),
        )
        scene.join(beam.end, body)
        found = frequencies(scene)
        errors.append(max(nearest(found, each) for each in expected))
    measured(errors[-1])
    assert errors[-1] < 1e-4
    assert_order_at_least(errors, 2.0)


@pytest.mark.case("bodies", "Plug on a hanging cable", source="Bessel functions")
def test_frequencies_of_a_plug_on_a_hanging_cable() -> None:
    """A cable without bending stiffness, whose plug turns about a point above its centre."""
    density, mass, inertia, arm = 0.1, 0.2, 2e-4, 0.05

    def determinant(w: float) -> float:
        x, tension = mass / density, mass * G
        shape = [np.array([f(2 * w * np.sqrt(z / G)) for f in (j0, y0)]) for z in (x, 1.0 + x)]
        slope = -w / np.sqrt(x * G) * np.array([f(2 * w * np.sqrt(x / G)) for f in (j1, y1)])
        rows = np.zeros((3, 3))
        rows[0, :2] = shape[1]
        rows[1, :2], rows[1, 2] = tension * slope + w**2 * mass * shape[0], -(w**2) * mass * arm
        rows[2, :2], rows[2, 2] = arm * tension * slope, -arm * tension + w**2 * inertia
        return float(np.linalg.det(rows))

    grid = np.linspace(0.5, 40.0, 4000)
    values = [determinant(w) for w in grid]
    expected = [brentq(determinant, grid[i], grid[i + 1]) for i in range(3999) if values[i] * values[i + 1] < 0.0][:3]
    errors = []
    for nodes in (21, 41, 81):
        scene = withe.Scene()
        cable = scene.add_rod(
            start=(0, 0, 0),
            end=(0, 0, -1),
            nodes=nodes,
            radius=1e-3,
            stiffness=withe.Stiffness(stretch=1e6, bend=1e-9, twist=1e3),
            line_density=density,
        )
        scene.pin(cable.start)
        plug = scene.add_body(mass=mass, inertia=inertia, center=(0, 0, -arm), position=(0, 0, -1))
        scene.join(cable.end, plug)
        found = frequencies(scene, 16)
        errors.append(max(nearest(found, each) for each in expected))
    measured(errors[-1])
    assert_order(errors, 2.0)


@pytest.mark.case("bodies", "Double pendulum of two bodies on hinges", source="Lagrange's equations")
def test_a_double_pendulum_of_two_bodies_swings() -> None:
    """A bar on a hinge of the world, and a box on a hinge of the bar; second order in the step."""
    bar, length, box, side = 0.1, 0.3, 0.4, 0.08
    inertia = bar * length**2 / 12.0

    def rates(_: float, y: Array) -> list[float]:
        p, q, dp, dq = y
        c, s, lever = np.cos(p - q), np.sin(p - q), box * length * side / 2
        rows = [[bar * length**2 / 3 + box * length**2, lever * c], [lever * c, box * (side**2 / 6 + side**2 / 4)]]
        pull = [
            -lever * s * dq**2 - (bar / 2 + box) * length * G * np.sin(p),
            lever * s * dp**2 - box * G * side / 2 * np.sin(q),
        ]
        return [dp, dq, *np.linalg.solve(rows, pull)]

    start = np.radians([60.0, -30.0])
    exact = solve_ivp(rates, (0.0, 0.5), [*start, 0.0, 0.0], rtol=1e-12, atol=1e-12, method="DOP853").y[:2, -1]
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene = withe.Scene()
        down = [np.array([np.sin(angle), 0.0, -np.cos(angle)]) for angle in start]
        axes = [np.column_stack([np.cross((0, 1, 0), -each), (0, 1, 0), -each]) for each in down]
        first = scene.add_body(
            mass=bar, inertia=(inertia, inertia, 1e-6), position=length / 2 * down[0], rotation=axes[0]
        )
        second = scene.add_body(
            withe.solids.Box((side, side, side)),
            mass=box,
            position=length * down[0] + side / 2 * down[1],
            rotation=axes[1],
        )
        scene.clamp(first, at=(0, 0, 0), spin=(0, 1, 0))
        joint = scene.join(first, second, "revolute", axis=(0, 1, 0), at=length * down[0])
        simulation = scene.build(time_step=step)
        energy = simulation.energy().total
        simulation.step(round(0.5 / step))
        found = [
            np.arctan2(-simulation.rotation(body)[0, 2], simulation.rotation(body)[2, 2]) for body in (first, second)
        ]
        errors.append(np.abs(np.array(found) - exact).max())
        assert simulation.energy().total == pytest.approx(energy, abs=1e-7)
        # The axis is y, about which the angles of both bodies from below turn backwards.
        assert simulation.joint_angle(joint) == pytest.approx((start[1] - found[1]) - (start[0] - found[0]), abs=1e-7)
    measured(errors[-1], "rad")
    assert_order(errors, 2.0)


def drawn(seed: int) -> tuple[withe.Scene, withe.Body]:
    """Return a free robot of rods and two bodies with joints of all kinds."""
    rng = np.random.default_rng(seed)
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    limb = {"nodes": 7, "radius": 5e-3, "material": rubber}
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moments = 1e-5 * rng.uniform(1.0, 1.8, 3)
    first = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), **limb)
    body = scene.add_body(
        mass=0.02, inertia=moments, center=0.02 * rng.normal(size=3), position=(0.3, 0, 0), rotation=turn
    )
    scene.join(first.end, body)
    kinds = ("rigid", "pinned", "revolute", "sliding")
    place = np.array([0.3, 0.0, 0.0]) + 0.03 * rng.normal(size=3)
    second = scene.add_rod(start=place, end=place + 0.15 * rng.normal(size=3), **limb)
    kind = kinds[seed % 4]
    axis = rng.normal(size=3) if kind in ("revolute", "sliding") else None
    scene.join(body, second.start, kind, axis=axis, stiffness=0.0 if axis is None else 1e-3)
    place = place + 0.03 * rng.normal(size=3)
    other = scene.add_body(mass=0.03, inertia=moments[::-1], position=place + 0.01, rotation=turn.T)
    joint = ("revolute", "pinned", "sliding")[seed % 3]
    if joint == "pinned":
        scene.join(body, other, "pinned", at=place)
    else:
        scene.join(
            body, other, joint, at=place, axis=rng.normal(size=3), stiffness=1e-3 if joint == "revolute" else 5.0
        )
    place = place + 0.02
    third = scene.add_rod(start=place, end=place + 0.1 * rng.normal(size=3), **limb)
    scene.join(third.start, other)
    scene.enable_contact(rods=False)
    return scene, body


@pytest.mark.parametrize("seed", range(8))
def test_drawn_scenes_of_rods_and_bodies_keep_momenta_and_energy(seed: int) -> None:
    """Momenta to 1e-9 of their size, energy to 1e-6 of the kinetic energy, over 250 steps."""
    scene, body = drawn(seed)
    rng = np.random.default_rng(seed)
    simulation = scene.build(time_step=2e-3)
    simulation.set_velocity(body, rng.normal(size=3), angular=20.0 * rng.normal(size=3))
    energy, momentum = simulation.energy(), simulation.momentum()
    simulation.step(250)
    now = simulation.momentum()
    assert np.linalg.norm(now.linear - momentum.linear) < 1e-9 * np.linalg.norm(momentum.linear)
    assert np.linalg.norm(now.angular - momentum.angular) < 1e-9 * np.linalg.norm(momentum.angular)
    assert simulation.energy().total == pytest.approx(energy.total, abs=1e-6 * energy.kinetic)


@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint", "backward_euler"])
def test_integrators_agree_on_a_swung_plug(integrator: str) -> None:
    """All implicit integrators converge to one motion."""

    def run(step: float, integrator: str) -> Array:
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e7, density=1100.0)
        cable = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=9, radius=3e-3, material=rubber)
        scene.clamp(cable.start)
        plug = scene.add_body(
            withe.solids.Cylinder(0.01, 0.04), mass=0.02, position=(0.32, 0.01, 0), rotation=(0.5, 0.5, 0.5, 0.5)
        )
        scene.join(cable.end, plug)
        simulation = scene.build(time_step=step, integrator=integrator)  # type: ignore[arg-type]
        simulation.step(round(0.1 / step))
        return np.concatenate([simulation.position(plug), simulation.rotation(plug).ravel()])

    exact = run(1e-4, "energy_momentum")
    coarse, fine = (np.abs(run(step, integrator) - exact).max() for step in (1e-3, 5e-4))
    assert fine < 0.6 * coarse < 0.03


def test_a_held_body_is_a_clamp() -> None:
    """Equilibrium of a rod on a body that is clamped, as of a rod that is clamped itself."""
    shapes = []
    for on_body in (True, False):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0.05, 0), nodes=21, radius=5e-3, material=rubber)
        if on_body:
            hub = scene.add_body(withe.solids.Sphere(0.02), density=2000.0, position=(-0.02, 0, 0))
            scene.join(arm.start, hub)
            scene.clamp(hub)
        else:
            scene.clamp(arm.start)
        simulation = scene.build(integrator="static", planar=False)
        assert simulation.equilibrium().stable
        shapes.append(simulation.positions(arm))
    np.testing.assert_allclose(shapes[0], shapes[1], atol=1e-9)


@pytest.mark.case("bodies", "Rigid mobile at rest", source="moments about its pivots")
def test_a_mobile_of_bodies_hangs_in_balance() -> None:
    """A bar with unequal weights on its arms turns until their moments balance: tan(angle) = (W1 a - W2 b) / sum."""
    scene = withe.Scene()
    left, right, above = 0.05, 0.09, 0.01
    masses = (0.2 / G, 0.1 / G)
    total = sum(masses)
    center = np.array([(masses[1] * right - masses[0] * left) / total, 0.0, -above])
    bar = scene.add_body(mass=total, inertia=1e-6, center=center)
    scene.clamp(bar, at=(0, 0, 0), spin=(0, 1, 0))
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    turn = simulation.rotation(bar)
    angle = np.arctan2(turn[0, 2], turn[0, 0])
    assert abs(angle) == pytest.approx(abs(np.arctan(center[0] / above)), rel=1e-9)


def test_a_body_in_a_plane_moves_as_in_space() -> None:
    """The planar path gives the motion of the general one."""
    found = []
    for planar in (True, False):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=rubber)
        scene.clamp(arm.start)
        body = scene.add_body(withe.solids.Box((0.04, 0.02, 0.03)), density=800.0, position=(0.22, 0, 0.01))
        scene.join(arm.end, body)
        simulation = scene.build(time_step=1e-3, planar=planar)
        energy = simulation.energy().total
        simulation.step(200)
        assert simulation.energy().total == pytest.approx(energy, abs=1e-8)
        found.append(np.concatenate([simulation.position(body), simulation.rotation(body).ravel()]))
    np.testing.assert_allclose(found[0], found[1], atol=1e-8)


@pytest.mark.case("bodies", "Bead on a straight wire that swings", source="Lagrange's equations")
@pytest.mark.parametrize("planar", [True, False])
def test_a_bead_slides_on_a_bar_that_swings(planar: bool) -> None:
    """A bar on a hinge with a bead on a spring along it; second order in the step, and energy to rounding."""
    bar, length, bead, stiffness = 0.2, 0.4, 0.1, 20.0
    inertia, small = bar * length**2 / 12.0, 1e-5

    def rates(_: float, y: Array) -> list[float]:
        angle, s, rate, speed = y
        r = length / 2 + s
        whole = bar * length**2 / 3.0 + small + bead * r**2
        torque = -(bar * length / 2 + bead * r) * G * np.sin(angle) - 2.0 * bead * r * speed * rate
        return [rate, speed, torque / whole, r * rate**2 + G * np.cos(angle) - stiffness / bead * s]

    exact = solve_ivp(rates, (0.0, 0.4), [np.pi / 3, 0.0, 0.0, 0.0], rtol=1e-12, atol=1e-12, method="DOP853").y[:2, -1]
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene = withe.Scene()
        down = np.array([np.sin(np.pi / 3), 0.0, -np.cos(np.pi / 3)])
        first = scene.add_body(mass=bar, inertia=inertia, position=length / 2 * down)
        second = scene.add_body(mass=bead, inertia=small, position=length / 2 * down)
        scene.clamp(first, at=(0, 0, 0), spin=(0, 1, 0))
        joint = scene.join(first, second, "sliding", axis=down, at=length / 2 * down, stiffness=stiffness)
        if planar:  # a scene needs a rod to lie in a plane
            feather = withe.Stiffness(stretch=1.0, bend=1e-6, twist=1e-6)
            points = ((1, 0, 0), (1.1, 0, 0), (1.2, 0, 0.1))
            scene.add_rod(points=points, radius=1e-3, stiffness=feather, line_density=1e-6)
        simulation = scene.build(time_step=step, planar=planar)
        energy = simulation.energy().total
        simulation.step(round(0.4 / step))
        place = simulation.position(second)
        found = [np.arctan2(place[0], -place[2]), simulation.joint_angle(joint)]
        errors.append(np.abs(np.array(found) - exact).max())
        assert simulation.energy().total == pytest.approx(energy, abs=1e-7)
    measured(errors[-1])
    assert_order(errors, 2.0)


@pytest.mark.case(
    "bodies", "Body on a spring at a point off its centre", source="M w^2, J w^2 [any textbook on vibrations]"
)
def test_a_body_on_a_spring_at_a_point_off_its_centre() -> None:
    """A spring of length 0 from the world to a point of a body: the mass matrix at that point has M and J."""
    scene = withe.Scene(gravity=(0, 0, 0))
    mass, inertia, arm, stiffness = 0.2, 1e-4, 0.03, 40.0
    post = limp(scene, 3, (0, 0, -0.1), 1.0, 1.0, 1e6)
    scene.clamp(post.start, hold="edge")
    body = scene.add_body(mass=mass, inertia=inertia, position=(arm, 0, 0))
    scene.add_spring(post.start, body.at((0, 0, 0)), stiffness=stiffness)
    simulation = scene.build(time_step=1e-4, planar=False)
    # Across the arm the point has the inverse mass 1 / M + arm^2 / J.
    rate = np.sqrt(stiffness * (1.0 / mass + arm**2 / inertia))
    spin = 1e-3
    simulation.set_velocity(body, (0, 0, spin * inertia / (mass * arm)), angular=(0, spin, 0))
    quarter = 0.5 * np.pi / rate
    simulation.step(round(2.0 * quarter / 1e-4))
    # After half a period the motion is reversed.
    assert simulation.angular_velocity(body)[1] == pytest.approx(-spin, rel=1e-3)


def test_names_of_points_stand_for_points() -> None:
    """A point of a body has a name, which is accepted wherever the point is."""
    scene = withe.Scene()
    body = scene.add_body(withe.solids.Sphere(0.01), mass=0.1, name="ball")
    assert body.at((0.1, -2e-3, 0)).name == "ball.at(0.1, -0.002, 0.0)"
    load = scene.add_force("ball.at(0.1, -2e-3, 0)", (0, 0, 1))
    scene.pin(body.at((0, 0, 0.01)))
    assert load.name == "force 1"
    with pytest.raises(ValueError, match="must not look like the name of a node or edge"):
        scene.add_body(withe.solids.Sphere(0.01), mass=0.1, name="ball.at(1, 2, 3)")


@pytest.mark.case("bodies", "Flexible balance with a hub", source="elastica and the moments on the hub")
@pytest.mark.parametrize("planar", [True, False])
def test_a_flexible_balance_hangs_as_two_elasticas(planar: bool) -> None:
    """A hub on a hinge with two weightless rods and two weights; second order in the mesh."""
    bend, length, weights, low, own = 0.02, 0.25, (0.30, 0.24), 0.02, 1.0

    def tip(weight: float, slope: float) -> Array:
        """Reach and drop of a cantilever that leaves with a slope."""

        def end(curvature: float) -> Array:
            return solve_ivp(
                lambda _, y: [y[1], -weight / bend * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])],
                (0.0, length),
                [slope, curvature, 0.0, 0.0],
                rtol=1e-11,
                atol=1e-13,
            ).y[:, -1]

        root = brentq(lambda curvature: end(curvature)[1], 0.0, 3.0 * weight * length / bend)
        return np.asarray(end(root)[2:])

    def moment(turn: float) -> float:
        left, right = tip(weights[0], turn), tip(weights[1], -turn)
        return float(weights[0] * left[0] - weights[1] * right[0] - own * low * np.sin(turn))

    turn = brentq(moment, 0.0, 1.0, xtol=1e-12)
    expected = [turn, *tip(weights[0], turn), *tip(weights[1], -turn)]
    scene = withe.Scene()
    hub = scene.add_body(mass=own / G, inertia=1e-5, center=(0, 0, -low))
    hold = scene.clamp(hub, at=(0, 0, 0), spin=(0, 1, 0))
    arms = []
    for side, weight in zip((-1, 1), weights, strict=True):
        arms.append(limp(scene, 31, (side * length, 0, 0), bend, 1e-9, 1e6))
        scene.join(arms[-1].start, hub)
        load = scene.add_body(mass=weight / G, inertia=1e-7, center=(0, 0, -0.05), position=(side * length, 0, 0))
        scene.join(arms[-1].end, load, "pinned")
    simulation = scene.build(integrator="static", planar=planar)
    assert simulation.equilibrium().stable
    left, right = (simulation.positions(arm)[-1] for arm in arms)
    angle = np.arctan2(-simulation.rotation(hub)[0, 2], simulation.rotation(hub)[0, 0])
    np.testing.assert_allclose([angle, -left[0], -left[2], right[0], -right[2]], expected, atol=2e-5)
    np.testing.assert_allclose(simulation.reaction(hold).force, (0, 0, own + sum(weights)), atol=1e-7)


def test_motions_of_a_free_body_are_neutral() -> None:
    """Nothing holds a free body: six frequencies of zero."""
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_body(mass=0.1, inertia=(1e-4, 2e-4, 2.5e-4), center=(0.01, 0, 0))
    frequencies = scene.build().linearise().frequencies(6)
    np.testing.assert_allclose(np.abs(frequencies), 0.0, atol=1e-6)


@pytest.mark.case("bodies", "Small oscillations of a compound pendulum", source="m g l / (J + m l^2)")
def test_small_oscillations_of_a_compound_pendulum() -> None:
    """A body on a hinge of the world, without a rod."""
    mass, arm, inertia = 0.4, 0.3, 2e-3
    scene = withe.Scene()
    body = scene.add_body(mass=mass, inertia=inertia, center=(0, 0, -arm))
    scene.clamp(body, at=(0, 0, 0), spin=(0, 1, 0))
    found = scene.build(integrator="static").linearise().frequencies(1)[0]
    expected = np.sqrt(mass * G * arm / (inertia + mass * arm**2)) / (2.0 * np.pi)
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.case(
    "bodies", "Bar on a hinge of the world that jumps to a speed and shakes", source="Lagrange's equation, integrated"
)
@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint"])
@pytest.mark.parametrize("jump", [0.0, 0.5])
def test_a_bar_on_a_hinge_that_jumps_and_shakes(jump: float, integrator: str) -> None:
    """Angle and rate are of second order from the first step on, and the work of the hinge is the kinetic energy."""
    arm, amplitude, rate = 0.2, 3.0, 7.0
    inertia = (0.4**2 + 0.02**2) / 12.0 + arm**2

    def slope(time: float, state: Array) -> list[float]:
        return [state[1], -arm * amplitude * np.cos(rate * time) * np.cos(state[0]) / inertia]

    expected = solve_ivp(slope, (0.0, 1.0), [0.0, -jump * arm / inertia], rtol=1e-11, atol=1e-13).y[:, -1]
    errors = []
    for steps in (100, 200, 400):
        scene = withe.Scene(gravity=(0, 0, 0))
        bar = scene.add_body(withe.solids.Box((0.4, 0.02, 0.02)), density=1000.0, position=(arm, 0, 0))
        hinge = scene.clamp(bar, at=(0, 0, 0), spin=(0, 0, 1))
        simulation = scene.build(time_step=1.0 / steps, integrator=integrator)
        simulation.move(hinge, path=lambda t: (0, jump * t + amplitude / rate**2 * (1.0 - np.cos(rate * t)), 0))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", withe.CoarseStepWarning)
            simulation.step(steps)
        energy = simulation.energy()
        assert energy.kinetic == pytest.approx(energy.work, rel=1e-7)
        axes = simulation.rotation(bar)
        turned = np.arctan2(axes[1, 0], axes[0, 0]) - expected[0]
        errors.append([(turned + np.pi) % (2.0 * np.pi) - np.pi, simulation.angular_velocity(bar)[2] - expected[1]])
    found = np.abs(errors)
    measured(found[-1].max())
    assert found[-1].max() < 2e-4
    for k in range(2):
        assert_order(list(found[:, k]), 2.0)


@pytest.mark.parametrize("planar", [True, False])
def test_a_held_body_does_not_ring(planar: bool) -> None:
    """After a clamp has moved and stopped, its body is at rest, and the reaction is that of a clamp of the rod."""
    forces, tips = [], []
    for offset in (None, 0.05):
        scene = withe.Scene(gravity=(0, 0, 0))
        rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
        arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=16, radius=5e-3, material=rubber, normal=(0, 0, 1))
        if offset is None:
            hold = scene.clamp(arm.start)
        else:
            hub = scene.add_body(mass=0.2, inertia=1e-4, position=(-offset, 0, 0.02))
            scene.join(arm.start, hub)
            hold = scene.clamp(hub, at=(0, 0, 0))
        simulation = scene.build(time_step=1e-3, planar=planar)
        simulation.move(hold, position=(0.05, 0, 0.02), rotation=(np.cos(0.4), 0, -np.sin(0.4), 0), over=0.05)
        start = simulation.energy()
        simulation.step(100)
        end = simulation.energy()
        balance = (end.total - end.work + end.dissipated) - (start.total - start.work + start.dissipated)
        assert abs(balance) < 1e-6 * abs(end.work)
        if offset is not None:
            np.testing.assert_allclose(simulation.velocity(hub), 0.0, atol=1e-12)
        forces.append(simulation.reaction(hold).force)
        tips.append(simulation.positions(arm)[-1])
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-8)
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-6 * np.linalg.norm(forces[0]))


def test_a_free_body_is_caught_by_a_clamp() -> None:
    """A clamp that is put on during a run brings the body to rest, and lets it go again."""
    scene = withe.Scene()
    body = scene.add_body(mass=0.2, inertia=1e-4, center=(0, 0, -0.1))
    hinge = scene.clamp(body, at=(0, 0, 0), spin=(0, 1, 0))
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(body, angular=(0, 2.0, 0))
    simulation.step(20)
    simulation.release(hinge)
    simulation.step(20)
    simulation.clamp(body)
    simulation.step(5)
    held = simulation.position(body)
    simulation.step(5)
    np.testing.assert_allclose(simulation.position(body), held, atol=1e-12)
    np.testing.assert_allclose(simulation.velocity(body), 0.0, atol=1e-12)


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.0), (0.07, 0.0, 0.01)])
def test_a_body_on_a_hinge_turns_about_it_from_the_start(at: tuple[float, float, float]) -> None:
    """The support keeps the point that it holds, though only an angular velocity is set."""
    scene = withe.Scene(gravity=(0, 0, 0))
    bar = scene.add_body(withe.solids.Box((0.2, 0.02, 0.02)), density=1000, position=(0.1, 0, 0))
    hinge = scene.clamp(bar.at(at), spin=(0, 1, 0))
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(bar, angular=(0.0, 2.0, 0.0))
    arm = np.array([0.1, 0, 0]) - at
    mass = 1000.0 * 0.2 * 4e-4
    np.testing.assert_allclose(simulation.velocity(bar), np.cross((0, 2, 0), arm), atol=1e-12)
    inertia = mass * ((0.2**2 + 0.02**2) / 12.0 + arm @ arm)
    assert simulation.energy().kinetic == pytest.approx(2.0 * inertia, rel=1e-12)
    for _ in range(20):
        simulation.step()
        np.testing.assert_allclose(simulation.angular_velocity(bar), (0, 2, 0), atol=1e-9)
        assert np.linalg.norm(simulation.reaction(hinge).force) == pytest.approx(
            mass * 4.0 * np.linalg.norm(arm), rel=1e-4
        )
