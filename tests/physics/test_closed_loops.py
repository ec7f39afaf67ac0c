"""Closed loops of joints between rigid bodies, against linkages with one unknown, and conservation over drawn loops."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import withe
from cases import measured
from convergence import assert_order, assert_order_at_least

Array = npt.NDArray[np.float64]
G = 9.81
NORMAL = np.array([0.0, 1.0, 0.0])


def bar(scene: withe.Scene, start: npt.ArrayLike, end: npt.ArrayLike, mass: float, turn: Array | None = None) -> Any:
    """Add a thin uniform bar between two points; its axes are those of the drawing before `turn`."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(b - a))
    inertia = mass * length**2 / 12.0 * (np.eye(3) - np.outer(b - a, b - a) / length**2) + 1e-9 * np.eye(3)
    axes = np.eye(3) if turn is None else turn
    middle = axes @ (0.5 * (a + b))
    return scene.add_body(mass=mass, inertia=axes @ inertia @ axes.T, position=middle)


class FourBar:
    """A four-bar linkage in the plane y = 0, with its motion by the angle of the crank."""

    lengths = (0.1, 0.25, 0.2)  # crank, coupler, rocker [m]
    base = 0.22  # between the pivots [m]
    masses = (0.2, 0.3, 0.25)

    def points(self, angle: float) -> Array:
        """Return both pivots and both moving joints, (4, 2): pivot, crank pin, rocker pin, pivot."""
        a, b, c = self.lengths
        pin = a * np.array([np.cos(angle), np.sin(angle)])
        pivot = np.array([self.base, 0.0])
        apart = pivot - pin
        size = float(np.linalg.norm(apart))
        along = (b**2 - c**2 + size**2) / (2.0 * size)
        across = np.sqrt(b**2 - along**2)
        other = pin + (along * apart + across * np.array([-apart[1], apart[0]])) / size
        return np.array([np.zeros(2), pin, other, pivot])

    def configuration(self, angle: float) -> Array:
        """Return the middles (x, z) and angles of the three bars, (3, 3)."""
        p = self.points(angle)
        ways = np.diff(p, axis=0)
        return np.column_stack([0.5 * (p[1:] + p[:-1]), np.arctan2(ways[:, 1], ways[:, 0])])

    def slope(self, angle: float) -> Array:
        """Return derivatives of the configuration by the angle."""
        h = 1e-5
        far = self.configuration(angle + 2 * h) - self.configuration(angle - 2 * h)
        near = self.configuration(angle + h) - self.configuration(angle - h)
        return np.asarray((8.0 * near - far) / (12.0 * h))

    def inertia(self, angle: float) -> float:
        """Return the moment of inertia of the linkage at the crank [kg m^2]."""
        m = np.array(self.masses)
        about = m * np.array(self.lengths) ** 2 / 12.0 + 1e-9
        s = self.slope(angle)
        return float((m * (s[:, 0] ** 2 + s[:, 1] ** 2) + about * s[:, 2] ** 2).sum())

    def acceleration(self, angle: float, rate: float) -> float:
        """Return the angular acceleration of the crank under gravity along -z [rad/s^2]."""
        h = 1e-4
        by_angle = (self.inertia(angle + h) - self.inertia(angle - h)) / (2.0 * h)
        weight = G * float(np.dot(self.masses, self.slope(angle)[:, 1]))
        return -(0.5 * by_angle * rate**2 + weight) / self.inertia(angle)

    def scene(self, angle: float, turn: Array | None = None, base: str = "body") -> tuple[withe.Scene, list[Any]]:
        """Draw the linkage, `turn` about the origin, with hinges whose axes are normal to its plane."""
        axes = np.eye(3) if turn is None else turn
        p = [np.array([x, 0.0, z]) for x, z in self.points(angle)]
        scene = withe.Scene(gravity=axes @ (0.0, 0.0, -G))
        bars = [bar(scene, a, b, m, axes) for a, b, m in zip(p, p[1:], self.masses, strict=False)]
        axis = axes @ NORMAL
        ground = scene.add_body(mass=1.0, inertia=1e-2, name="ground")
        scene.clamp(ground)
        chain = [ground, *bars, ground]
        for k, (one, two) in enumerate(zip(chain, chain[1:], strict=False)):
            scene.join(one, two, "revolute", at=axes @ p[k], axis=axis, name=f"hinge {k}")
        return scene, bars

    def set_rate(self, simulation: withe.Simulation, bars: list[Any], angle: float, rate: float, axes: Array) -> None:
        """Set consistent velocities of all bars. An angle in the plane turns about -y."""
        for each, (x, z, turn) in zip(bars, rate * self.slope(angle), strict=True):
            simulation.set_velocity(each, axes @ (x, 0.0, z), angular=axes @ (-turn * NORMAL))


def crank_angle(simulation: withe.Simulation, crank: Any, pivot: npt.ArrayLike = (0, 0, 0)) -> float:
    """Return the angle of the crank in the plane."""
    way = simulation.position(crank) - pivot
    return float(np.arctan2(way[2], way[0]))


@pytest.mark.case("bodies", "Four-bar linkage that swings under gravity", source="Lagrange's equation of its crank")
@pytest.mark.parametrize(("integrator", "order"), [("energy_momentum", 2.0), ("implicit_midpoint", 2.0)])
def test_a_four_bar_linkage_swings(integrator: str, order: float) -> None:
    """The angle of the crank after half a second."""
    linkage, start, rate = FourBar(), 1.0, 6.0
    exact = solve_ivp(
        lambda _, y: [y[1], linkage.acceleration(y[0], y[1])], (0.0, 0.5), [start, rate], rtol=1e-10, atol=1e-10
    ).y[0, -1]
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene, bars = linkage.scene(start)
        simulation = scene.build(time_step=step, integrator=integrator)
        linkage.set_rate(simulation, bars, start, rate, np.eye(3))
        energy = simulation.energy().total
        simulation.step(round(0.5 / step))
        difference = crank_angle(simulation, bars[0]) - exact
        errors.append(abs((difference + np.pi) % (2.0 * np.pi) - np.pi))
        if integrator == "energy_momentum":
            assert simulation.energy().total == pytest.approx(energy, rel=1e-7)
    measured(errors[-1], "rad")
    assert_order(errors, order)


class SliderCrank:
    """A crank that turns evenly, a uniform coupler, and a slider on the line of the crank's pivot; no gravity."""

    crank, coupler, rate = 0.15, 0.30, 20.0  # [m], [m], [rad/s]
    coupler_mass, slider_mass = 0.1, 0.2

    def kinematics(self, time: float) -> tuple[Array, Array]:
        """Return pin, coupler's middle, slider (x, z), and the coupler's angle, as (7,); and second derivatives."""

        def place(t: float) -> Array:
            theta = self.rate * t
            pin = self.crank * np.array([np.cos(theta), np.sin(theta)])
            phi = -np.arcsin(pin[1] / self.coupler)
            way = self.coupler * np.array([np.cos(phi), np.sin(phi)])
            return np.array([*pin, *(pin + 0.5 * way), *(pin + way), phi])

        h = 2e-4
        terms = [place(time + k * h) for k in (-2, -1, 0, 1, 2)]
        second = (-terms[0] + 16 * terms[1] - 30 * terms[2] + 16 * terms[3] - terms[4]) / (12 * h * h)
        return terms[2], np.asarray(second)

    def velocity(self, time: float) -> Array:
        """Return the rates of the kinematics."""
        h = 1e-4
        terms = [self.kinematics(time + k * h)[0] for k in (-2, -1, 1, 2)]
        return np.asarray((terms[0] - 8 * terms[1] + 8 * terms[2] - terms[3]) / (12 * h))

    def forces(self, time: float) -> Array:
        """Return the force of the guide on the slider, the force of the crank on the coupler (2), and the torque."""
        place, second = self.kinematics(time)
        half = 0.5 * (place[4:6] - place[0:2])
        turning = self.coupler_mass * self.coupler**2 / 12.0 + 1e-9
        slider_x = -self.slider_mass * second[4]  # force on the coupler at the slider
        # Moments about the middle of the coupler: half x (slider force - pin force) = turning phi''.
        weight = self.coupler_mass * second[2:4]
        slider_z = (turning * second[6] + half[1] * (2.0 * slider_x - weight[0])) / (2.0 * half[0]) + 0.5 * weight[1]
        on_coupler = weight - (slider_x, slider_z)
        torque = place[0] * on_coupler[1] - place[1] * on_coupler[0]
        return np.array([slider_z, *on_coupler, torque])

    def build(self, step: float) -> tuple[Any, ...]:
        """Return the simulation at rest, with a motor that turns the crank from the first step on, and its parts."""
        scene = withe.Scene(gravity=(0, 0, 0))
        frame = scene.add_body(mass=1.0, inertia=1e-2, name="frame")
        scene.clamp(frame)
        crank = scene.add_body(mass=1e-3, inertia=1e-5, position=(0, 0, 0), name="crank")
        motor = scene.clamp(crank)
        tip = self.kinematics(0.0)[0][4:6]
        coupler = bar(scene, (self.crank, 0, 0), (tip[0], 0, 0), self.coupler_mass)
        slider = scene.add_body(mass=self.slider_mass, inertia=1e-4, position=(tip[0], 0, 0))
        pin = scene.join(crank, coupler, "revolute", at=(self.crank, 0, 0), axis=NORMAL)
        scene.join(coupler, slider, "revolute", at=(tip[0], 0, 0), axis=NORMAL)
        guide = scene.join(frame, slider, "sliding", at=(tip[0], 0, 0), axis=(1, 0, 0))
        simulation = scene.build(time_step=step)
        simulation.move(motor, path=lambda t: ((0, 0, 0), Rotation.from_rotvec(-self.rate * t * NORMAL).as_matrix()))
        return simulation, crank, coupler, slider, pin, guide, motor


@pytest.mark.case("bodies", "Slider-crank at an even rate: forces", source="d'Alembert's principle")
@pytest.mark.parametrize("angle", [np.pi / 3.0, 2.0])
def test_a_slider_crank_moves_and_pulls(angle: float) -> None:
    """Position and speed of the slider, of second order; forces in the middle of the last step, of first order.

    Forces have a part of the order of the step that alternates, because the drawn velocities are consistent, while
    those of the midpoint rule are so to second order.
    """
    case = SliderCrank()
    errors, force_errors = [], []
    for steps in (250, 500, 1000):
        end = angle / case.rate
        step = end / steps
        simulation, crank, coupler, slider, pin, guide, motor = case.build(step)
        v = case.velocity(0.0)
        simulation.set_velocity(crank, angular=-case.rate * NORMAL)
        simulation.set_velocity(coupler, (v[2], 0, v[3]), angular=-v[6] * NORMAL)
        simulation.set_velocity(slider, (v[4], 0, 0))
        simulation.step(steps)
        found = np.array([simulation.position(slider)[0], simulation.velocity(slider)[0]])
        expected = np.array([case.kinematics(end)[0][4], case.velocity(end)[4]])
        errors.append(np.abs(found / expected - 1.0))
        on_slider, on_coupler = simulation.reaction(guide).force, simulation.reaction(pin).force
        torque = -simulation.reaction(motor).moment[1]
        forces = case.forces(end - 0.5 * step)
        scale = np.array([10.0, 10.0, 10.0, 1.0])
        force_errors.append(
            np.abs((np.array([on_slider[2], on_coupler[0], on_coupler[2], torque]) - forces) / scale).max()
        )
    measured(force_errors[-1])
    assert errors[-1][0] < 1e-6
    assert errors[-1][1] < 1e-4
    assert force_errors[-1] < 1e-3
    assert_order([error.max() for error in errors], 2.0)
    assert_order_at_least(force_errors, 1.0)


def test_a_crank_whose_motor_starts_at_once() -> None:
    """The other parts have their rates after the first step, and keep them to second order."""
    case = SliderCrank()
    errors = []
    for steps in (100, 200, 400):
        end = 1.0 / case.rate
        simulation, _, coupler, slider, *_ = case.build(end / steps)
        worst = 0.0
        for _ in range(steps):
            simulation.step()
            v = case.velocity(simulation.time)
            found = np.array([-simulation.angular_velocity(coupler)[1], simulation.velocity(slider)[0]])
            worst = max(worst, float(np.abs((found - v[[6, 4]]) / (case.rate, case.rate * case.crank)).max()))
        errors.append(worst)
        energy = simulation.energy()
        assert energy.kinetic == pytest.approx(energy.work, rel=1e-6)
    assert errors[-1] < 1e-4
    assert_order(errors, 2.0)


def ring(seed: int, kinds: list[str], spring: bool = False) -> tuple[withe.Scene, list[Any]]:
    """Draw a free ring of bodies, not in a plane, with joints of these kinds, and a spring across it."""
    rng = np.random.default_rng(seed)
    count = len(kinds)
    scene = withe.Scene(gravity=(0, 0, 0))
    turn = 2.0 * np.pi * np.arange(count) / count
    points = 0.1 * np.column_stack([np.cos(turn), np.sin(turn), 0.3 * rng.normal(size=count)])
    bodies = []
    for i in range(count):
        moments = 1e-5 * rng.uniform(1.0, 1.8, 3)
        axes = Rotation.random(rng=rng)
        middle = 0.5 * (points[i] + points[(i + 1) % count]) + 0.01 * rng.normal(size=3)
        bodies.append(
            scene.add_body(
                mass=rng.uniform(0.02, 0.06),
                inertia=moments,
                center=0.01 * rng.normal(size=3),
                position=middle,
                rotation=axes,
            )
        )
    for i, kind in enumerate(kinds):
        axis = rng.normal(size=3) if kind in ("revolute", "sliding") else None
        words: dict[str, Any] = {"stiffness": 2.0} if kind == "sliding" else {}
        scene.join(bodies[i - 1], bodies[i], kind, at=points[i], axis=axis, **words)  # type: ignore[call-overload]
    if spring:
        ends = [bodies[0].at(points[0] + 0.01), bodies[count // 2].at(points[count // 2] - 0.01)]
        scene.add_spring(*ends, stiffness=5.0)
    return scene, bodies


RINGS = {
    "pinned": (["pinned"] * 4, False),
    "spring": (["pinned"] * 4, True),
    "hinges": (["revolute"] * 7, False),
    "mixed": (["pinned", "revolute", "sliding", "pinned", "revolute", "pinned"], True),
    "slides": (["sliding", "pinned", "pinned", "sliding", "pinned"], False),
}


@pytest.mark.case("bodies", "Drawn closed loops of joints: energy and momenta", source="conservation")
@pytest.mark.parametrize("name", RINGS)
@pytest.mark.parametrize("seed", range(3))
def test_drawn_loops_keep_momenta_and_energy(name: str, seed: int) -> None:
    """Momenta to 1e-9 of their size, energy to 1e-6, over 1,000 steps; the loop stays closed."""
    scene, bodies = ring(seed, *RINGS[name])
    rng = np.random.default_rng(seed)
    simulation = scene.build(time_step=1e-3)
    for body in bodies:
        simulation.set_velocity(body, 0.3 * rng.normal(size=3), angular=5.0 * rng.normal(size=3))
    simulation.step()  # makes the velocities consistent
    energy, momentum = simulation.energy(), simulation.momentum()
    simulation.step(1000)
    now = simulation.momentum()
    linear = np.linalg.norm(now.linear - momentum.linear) / np.linalg.norm(momentum.linear)
    angular = np.linalg.norm(now.angular - momentum.angular) / np.linalg.norm(momentum.angular)
    measured(max(linear, angular))
    assert max(linear, angular) < 1e-9
    assert simulation.energy().total == pytest.approx(energy.total, abs=1e-6 * energy.kinetic)


@pytest.mark.case(
    "bodies", "Four-bar linkage at rest: angle and frequency", source="potential and inertia of its crank"
)
@pytest.mark.parametrize("turn", [None, Rotation.from_rotvec((0.4, -1.1, 0.7)).as_matrix()])
def test_a_four_bar_linkage_hangs_in_stable_balance(turn: Array | None) -> None:
    """From a drawing on the far side of the unstable equilibrium, wherever the scene points."""
    linkage, axes = FourBar(), np.eye(3) if turn is None else turn

    def slope(angle: float) -> float:
        return G * float(np.dot(linkage.masses, linkage.slope(angle)[:, 1]))

    lowest = brentq(slope, 4.0, 5.0, xtol=1e-13)
    scene, bars = linkage.scene(2.2, turn)
    simulation = scene.build(integrator="static")
    result = simulation.equilibrium()
    assert result.stable
    way = axes.T @ simulation.position(bars[0])
    error = (np.arctan2(way[2], way[0]) - lowest + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(error) < 1e-7
    h = 1e-4
    stiffness = (slope(lowest + h) - slope(lowest - h)) / (2.0 * h)
    found = simulation.linearise().frequencies(1)[0]
    expected = np.sqrt(stiffness / linkage.inertia(lowest)) / (2.0 * np.pi)
    measured(abs(found / expected - 1.0))
    assert found == pytest.approx(expected, rel=1e-5)
    forces = [simulation.reaction(f"hinge {k}").force for k in range(4)]
    np.testing.assert_allclose(forces[0] - forces[3], G * sum(linkage.masses) * axes[:, 2], atol=1e-8)


def test_an_unstable_balance_of_a_linkage_is_unstable() -> None:
    """Its highest position."""
    linkage = FourBar()

    def slope(angle: float) -> float:
        return float(np.dot(linkage.masses, linkage.slope(angle)[:, 1]))

    highest = brentq(slope, 1.4, 1.8, xtol=1e-14)
    simulation = linkage.scene(highest)[0].build(integrator="static")
    assert not simulation.equilibrium(stable=False).stable


def test_a_linkage_moves_alike_wherever_it_points() -> None:
    """Rotation of the whole scene, 1e-9 of its size."""
    linkage, places = FourBar(), []
    turn = Rotation.from_rotvec((0.4, -1.1, 0.7)).as_matrix()
    for axes in (np.eye(3), turn):
        scene, bars = linkage.scene(1.0, axes)
        tight = withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12)
        simulation = scene.build(time_step=1e-3, solver=tight)
        linkage.set_rate(simulation, bars, 1.0, 6.0, axes)
        simulation.step(200)
        places.append([axes.T @ simulation.position(each) for each in bars])
    np.testing.assert_allclose(places[1], places[0], atol=1e-9 * linkage.base)


@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint", "backward_euler", "fourth_order"])
def test_every_implicit_integrator_keeps_loops_closed(integrator: str) -> None:
    """Points of the last hinge on both of its bodies, to rounding."""
    linkage = FourBar()
    scene, bars = linkage.scene(1.0)
    simulation = scene.build(time_step=2e-3, integrator=integrator)  # type: ignore[arg-type]
    linkage.set_rate(simulation, bars, 1.0, 6.0, np.eye(3))
    simulation.step(50)
    rocker = simulation.position(bars[2]) + simulation.rotation(bars[2]) @ (
        np.array([linkage.base, 0.0, 0.0]) - [linkage.configuration(1.0)[2, 0], 0.0, linkage.configuration(1.0)[2, 1]]
    )
    np.testing.assert_allclose(rocker, (linkage.base, 0, 0), atol=1e-9)


def test_a_bar_between_two_walls_is_a_loop() -> None:
    """A bar on a hinge and on a ball that slides: statically determinate, half of its weight on each."""
    scene = withe.Scene()
    left, right = (scene.add_body(mass=1.0, inertia=1.0, position=(x, 0, 0)) for x in (-1.0, 1.0))
    scene.clamp(left)
    scene.clamp(right)
    beam = bar(scene, (-0.5, 0, 0), (0.5, 0, 0), 2.0)
    scene.join(left, beam, "revolute", at=(-0.5, 0, 0), axis=NORMAL)
    carriage = scene.add_body(mass=1e-6, inertia=1e-9, position=(0.5, 0, 0))
    scene.join(beam, carriage, "pinned", at=(0.5, 0, 0))
    guide = scene.join(right, carriage, "sliding", at=(0.5, 0, 0), axis=(1, 0, 0))
    simulation = scene.build(integrator="static")
    assert simulation.equilibrium().stable
    np.testing.assert_allclose(simulation.position(beam), 0.0, atol=1e-9)
    np.testing.assert_allclose(simulation.reaction(guide).force, (0, 0, G * (1.0 + 1e-6)), rtol=1e-7, atol=1e-6)


def test_supports_of_two_bodies_close_a_loop() -> None:
    """Crank and rocker on hinges of the world move as on a clamped body."""
    linkage, angles = FourBar(), []
    for base in (False, True):
        if base:
            scene, bars = linkage.scene(1.0)
        else:
            p = [np.array([x, 0.0, z]) for x, z in linkage.points(1.0)]
            scene = withe.Scene()
            bars = [bar(scene, a, b, m) for a, b, m in zip(p, p[1:], linkage.masses, strict=False)]
            scene.clamp(bars[0], at=p[0], spin=NORMAL)
            scene.clamp(bars[2], at=p[3], spin=NORMAL)
            scene.join(bars[0], bars[1], "revolute", at=p[1], axis=NORMAL)
            scene.join(bars[1], bars[2], "revolute", at=p[2], axis=NORMAL)
        simulation = scene.build(time_step=1e-3)
        simulation.step(200)
        angles.append(crank_angle(simulation, bars[0]))
    assert angles[0] == pytest.approx(angles[1], abs=1e-7)


def with_boom() -> tuple[withe.Scene, list[Any]]:
    """Draw the four-bar linkage with a flexible boom on its coupler."""
    linkage = FourBar()
    scene, bars = linkage.scene(1.0)
    rubber = withe.Material(youngs_modulus=1e8, density=1e3)
    tip = np.array([linkage.points(1.0)[2][0], 0.0, linkage.points(1.0)[2][1]])
    boom = scene.add_rod(start=tip, end=tip + np.array([0.1, 0.0, 0.05]), nodes=6, radius=3e-3, material=rubber)
    scene.join(bars[1], boom.start)
    return scene, bars


def test_a_loop_with_a_rod_moves_in_its_plane_as_in_space() -> None:
    """Angle of the crank, energy, and reaction of the hinge that closes the loop."""
    found = []
    for planar in (True, False):
        scene, bars = with_boom()
        simulation = scene.build(time_step=1e-3, planar=planar)
        assert ("3D" in str(simulation.plan).splitlines()[0]) != planar
        energy = simulation.energy().total
        simulation.step(100)
        assert simulation.energy().total == pytest.approx(energy, rel=1e-7)
        found.append([crank_angle(simulation, bars[0]), *simulation.reaction("hinge 3").force])
    np.testing.assert_allclose(found[0], found[1], atol=2e-5)


@pytest.mark.parametrize("planar", [True, False])
def test_a_loop_with_a_rod_comes_to_stable_rest(planar: bool) -> None:
    """The path of equilibria leads to the highest position, which is left."""
    scene, bars = with_boom()
    simulation = scene.build(integrator="static", planar=planar)
    result = simulation.equilibrium()
    assert result.stable
    assert result.branch_changed
    assert simulation.linearise().frequencies(1)[0] > 1.0
    assert crank_angle(simulation, bars[0]) < -1.0


def test_constraints_that_follow_from_others_are_left_out() -> None:
    """Four hinges with parallel axes need three multipliers, four balls six."""
    linkage = FourBar()
    assert "3 multipliers" in str(linkage.scene(1.0)[0].build().plan)
    scene, _ = ring(0, ["pinned"] * 4)
    assert "6 multipliers" in str(scene.build().plan)


def test_velocities_that_contradict_each_other_become_consistent() -> None:
    """The crank alone is set in motion; an impulse of the joints takes energy, and reactions do not ring."""
    linkage = FourBar()
    scene, bars = linkage.scene(1.0)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(bars[0], np.cross((0, -6.0, 0), simulation.position(bars[0])), angular=(0, -6.0, 0))
    before = simulation.energy()
    forces = []
    for _ in range(20):
        simulation.step()
        forces.append(simulation.reaction("hinge 3").force)
    now = simulation.energy()
    assert now.dissipated > 0.1 * before.kinetic
    assert now.total + now.dissipated == pytest.approx(before.total + before.dissipated, abs=1e-6 * before.kinetic)
    assert np.abs(np.diff(forces, 2, axis=0)).max() < 0.03 * np.abs(forces).max()


def test_loops_continue_from_copies_pickles_snapshots_and_files(tmp_path: Path) -> None:
    """All to the bit."""
    linkage = FourBar()
    scene, _ = linkage.scene(1.0)
    simulation = scene.build(time_step=1e-3)
    simulation.step(5)
    others = [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    snapshot = simulation.snapshot()
    simulation.step(10)
    expected = simulation.positions()
    for other in others:
        other.step(10)
        np.testing.assert_array_equal(other.positions(), expected)
    simulation.restore(snapshot)
    simulation.step(10)
    np.testing.assert_array_equal(simulation.positions(), expected)
    scene.save(tmp_path / "linkage.toml")
    again = withe.Scene.load(tmp_path / "linkage.toml").build(time_step=1e-3)
    again.step(15)
    np.testing.assert_array_equal(again.positions(), expected)


def test_a_joint_of_a_loop_has_an_angle_a_spring_and_stops() -> None:
    """The servo of the hinge that closes the loop holds the linkage; its angle is that of the bodies."""
    linkage, angles = FourBar(), []
    scene, bars = linkage.scene(1.0)
    servo = scene["hinge 3"]
    simulation = scene.build(integrator="static")
    simulation.set(servo, stiffness=50.0)
    assert simulation.equilibrium().stable
    turn = simulation.rotation(bars[2])
    angles = [simulation.joint_angle(servo), float(np.arctan2(-turn[0, 2], turn[0, 0]))]
    assert angles[0] == pytest.approx(angles[1], abs=1e-9)
    assert abs(angles[0]) > 1e-4
    assert simulation.joint_torque(servo) == pytest.approx(-50.0 * angles[0], abs=1e-9)


def test_a_drawing_in_a_dead_centre_is_refused() -> None:
    """A parallelogram that is drawn flat may leave this position in two ways."""
    scene = withe.Scene(gravity=(0, 0, 0))
    points = np.array([(0, 0, 0), (0.1, 0, 0), (0.4, 0, 0), (0.3, 0, 0)], float)
    frame = scene.add_body(mass=1.0, inertia=1e-2)
    scene.clamp(frame)
    bars = [bar(scene, a, b, 0.1) for a, b in zip(points, points[1:], strict=False)]
    chain = [frame, *bars, frame]
    for k, (one, two) in enumerate(zip(chain, chain[1:], strict=False)):
        scene.join(one, two, "revolute", at=points[k], axis=NORMAL)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(bars[0], (0, 0, 0.5), angular=(0, -10.0, 0))
    with pytest.raises(withe.ConvergenceError):
        simulation.step(300)


def test_a_linkage_may_be_released_and_held_while_it_moves() -> None:
    """Without its support, the frame moves too; both momenta stay, and the loop stays closed."""
    linkage = FourBar()
    scene, bars = linkage.scene(1.0)
    scene.gravity = (0.0, 0.0, 0.0)
    simulation = scene.build(time_step=1e-3)
    linkage.set_rate(simulation, bars, 1.0, 6.0, np.eye(3))
    simulation.step(20)
    simulation.release("clamp 1")
    simulation.step()
    before = simulation.momentum()
    simulation.step(100)
    now = simulation.momentum()
    np.testing.assert_allclose(now.linear, before.linear, atol=1e-9 * np.linalg.norm(before.linear))
    np.testing.assert_allclose(now.angular, before.angular, atol=1e-9 * np.linalg.norm(before.angular))
    assert np.linalg.norm(simulation.position("ground")) > 1e-3
    simulation.clamp("ground")
    simulation.step(20)
    gap = simulation.position("ground") + simulation.rotation("ground") @ (linkage.base, 0.0, 0.0)
    place = linkage.configuration(1.0)[2]
    rocker = simulation.position(bars[2]) + simulation.rotation(bars[2]) @ (
        linkage.base - place[0],
        0.0,
        -place[1],
    )
    np.testing.assert_allclose(rocker, gap, atol=1e-9)


def test_an_inverted_pendulum_on_a_body_is_unstable() -> None:
    """A hinge between bodies has no inertia of its own."""
    scene = withe.Scene()
    base = scene.add_body(mass=1.0, inertia=1e-2)
    scene.clamp(base)
    upper = scene.add_body(mass=1.0, inertia=1e-2, position=(0, 0, 0.3))
    scene.join(base, upper, "revolute", at=(0, 0, 0.1), axis=NORMAL)
    simulation = scene.build(integrator="static")
    assert not simulation.equilibrium(stable=False).stable
    assert simulation.equilibrium().stable
    np.testing.assert_allclose(simulation.position(upper), (0, 0, -0.1), atol=1e-9)


@pytest.mark.parametrize("joint", ["pinned", "revolute"])
def test_a_body_that_hangs_on_a_ball_is_stable(joint: str) -> None:
    """Nothing resists its rotation about the vertical: a neutral motion is not an unstable one."""
    scene = withe.Scene()
    base = scene.add_body(mass=1.0, inertia=1e-2)
    scene.clamp(base)
    upper, lower = (scene.add_body(mass=0.1, inertia=2e-4, position=(0, 0, z)) for z in (-0.1, -0.2))
    scene.join(base, upper, "pinned", at=(0, 0, -0.05))
    axis = {"axis": NORMAL} if joint == "revolute" else {}
    scene.join(upper, lower, joint, at=(0, 0, -0.15), **axis)  # type: ignore[call-overload]
    assert scene.build(integrator="static").equilibrium().stability == "stable"


def test_a_hexapod_carries_its_load() -> None:
    """Five loops: six legs with ball joints at both ends, and springs along them. Its height is that of rest."""
    scene = withe.Scene()
    base = scene.add_body(mass=1.0, inertia=1e-2)
    scene.clamp(base)
    top = scene.add_body(mass=2.0, inertia=(0.02, 0.02, 0.04), position=(0, 0, 0.3))
    legs, rise = [], []
    for i in range(6):
        one, other = np.radians(60.0 * i + np.array([-5.0, 25.0]) * (-1.0) ** i)
        foot = 0.25 * np.array([np.cos(one), np.sin(one), 0.0])
        head = np.array([0.15 * np.cos(other), 0.15 * np.sin(other), 0.3])
        way = head - foot
        lower, upper = (scene.add_body(mass=0.1, inertia=2e-4, position=foot + share * way) for share in (0.25, 0.75))
        scene.join(base, lower, "pinned", at=foot)
        axis = way / np.linalg.norm(way)
        legs.append(scene.join(lower, upper, "sliding", at=0.5 * (foot + head), axis=axis, stiffness=2e4, damping=40.0))
        scene.join(upper, top, "pinned", at=head)
        rise.append(axis[2])
    simulation = scene.build(time_step=2e-3)
    assert "5 closed loop(s) of joints: 30 multipliers" in str(simulation.plan)
    simulation.step(1000)
    # The springs carry the platform and the upper halves of the legs.
    load = (2.0 + 6 * 0.1) * G
    lift = sum(simulation.reaction(leg).force[2] for leg in legs)
    assert lift == pytest.approx(load, rel=1e-5)
    shortened = [-simulation.joint_angle(leg) for leg in legs]
    np.testing.assert_allclose(shortened, np.mean(shortened), rtol=1e-3)
    height = 0.3 - simulation.position(top)[2]
    assert height == pytest.approx(np.mean(shortened) / np.mean(rise), rel=1e-2)
