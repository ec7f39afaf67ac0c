"""Reactions of joints: weights, levers, centripetal forces, a double pendulum, and the balance of every body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

import withe
from cases import measured
from convergence import assert_order

Array = npt.NDArray[np.float64]
G = 9.81


@pytest.mark.parametrize("kind", ["pinned", "revolute", "sliding"])
def test_a_joint_carries_the_weight_below(kind: str) -> None:
    """Force on the second part, upwards; its opposite if the bodies are named in the other order."""
    scene = withe.Scene()
    masses = (0.4, 0.3, 0.2, 0.1)
    bodies = [scene.add_body(mass=mass, inertia=1e-3, position=(0, 0, -0.2 * i)) for i, mass in enumerate(masses)]
    scene.clamp(bodies[0])
    axis = {"pinned": None, "revolute": (0, 1, 0), "sliding": (1, 0, 0)}[kind]
    words = {"stiffness": 10.0} if kind == "sliding" else {}
    joints = []
    for i, (above, below) in enumerate(zip(bodies, bodies[1:], strict=False)):
        pair = (above, below) if i != 1 else (below, above)
        joints.append(scene.join(*pair, kind, at=(0, 0, -0.2 * i - 0.1), axis=axis, **words))  # type: ignore[call-overload]
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    for i, joint in enumerate(joints):
        weight = G * sum(masses[i + 1 :]) * (1.0 if i != 1 else -1.0)
        found = simulation.reaction(joint)
        np.testing.assert_allclose(found.force, (0, 0, weight), atol=1e-9)
        np.testing.assert_allclose(found.moment, 0.0, atol=1e-9)


def test_a_hinge_carries_the_moment_of_a_lever() -> None:
    """About its point: the weight times the lever, across the axis; along it the torque of the servo."""
    scene = withe.Scene()
    wall = scene.add_body(mass=1.0, inertia=1e-3)
    scene.clamp(wall)
    arm = scene.add_body(mass=0.5, inertia=1e-3, position=(0.3, 0.1, 0))
    upright = scene.join(wall, arm, "revolute", at=(0, 0, 0), axis=(0, 0, 1), stiffness=1.0)
    tip = scene.add_body(mass=0.2, inertia=1e-3, position=(0.8, 0, 0))
    elbow = scene.join(arm, tip, "revolute", at=(0.6, 0, 0), axis=(0, 1, 0), stiffness=50.0)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    place, far = simulation.position(arm), simulation.position(tip)
    weights = G * np.array([0.5, 0.2])
    found = simulation.reaction(upright)
    np.testing.assert_allclose(found.force, (0, 0, weights.sum()), atol=1e-9)
    moment = np.cross(place, (0, 0, weights[0])) + np.cross(far, (0, 0, weights[1]))
    np.testing.assert_allclose(found.moment, moment, atol=1e-9)
    found = simulation.reaction(elbow)
    np.testing.assert_allclose(found.force, (0, 0, weights[1]), atol=1e-9)
    np.testing.assert_allclose(found.moment, np.cross(far - (0.6, 0, 0), (0, 0, weights[1])), atol=1e-9)
    assert found.moment[1] == pytest.approx(simulation.joint_torque(elbow), abs=1e-9)


@pytest.mark.parametrize("planar", [True, False])
def test_a_weld_of_rod_and_body_carries_force_and_moment(planar: bool) -> None:
    """A body with a lever at the tip of a bent cantilever; the force of the user at the joint acts on the body."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=2e8, density=1e3)
    beam = scene.add_rod(start=(0, 0, 0), end=(0.5, 0, 0), nodes=21, radius=4e-3, material=rubber)
    scene.clamp(beam.start)
    body = scene.add_body(mass=0.05, inertia=1e-5, center=(0.04, 0, 0), position=(0.5, 0, 0))
    joint = scene.join(beam.end, body)
    scene.add_force(body, (0.1, 0, 0.05), at=(0.5, 0, 0))
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    found = simulation.reaction(joint)
    np.testing.assert_allclose(found.force, (-0.1, 0, 0.05 * G - 0.05), atol=1e-7)
    lever = simulation.rotation(body) @ (0.04, 0, 0)
    np.testing.assert_allclose(found.moment, np.cross(lever, (0, 0, 0.05 * G)), atol=1e-7)


@pytest.mark.case("bodies", "Reaction of a body on a spinning hub", source="centripetal force, m r Omega^2")
def test_a_body_on_a_spinning_hub_is_pulled_inwards() -> None:
    """Mean force over a step, along the middle of its arc; second order in the step."""
    mass, radius, rate = 0.3, 0.4, 5.0
    errors = []
    for step in (8e-3, 4e-3, 2e-3):
        scene = withe.Scene(gravity=(0, 0, 0))
        hub = scene.add_body(mass=1.0, inertia=0.2)
        scene.clamp(hub, spin=(0, 0, 1))
        arm = scene.add_body(mass=mass, inertia=1e-3, position=(radius, 0, 0))
        joint = scene.join(hub, arm, "revolute", at=(0.1, 0, 0), axis=(0, 0, 1))
        simulation = scene.build(time_step=step)
        simulation.set_velocity(hub, angular=(0, 0, rate))
        simulation.set_velocity(arm, (0, radius * rate, 0), angular=(0, 0, rate))
        simulation.step(round(0.4 / step))
        angle = rate * (0.4 - 0.5 * step)
        expected = -mass * radius * rate**2 * np.array([np.cos(angle), np.sin(angle), 0.0])
        found = simulation.reaction(joint)
        errors.append(np.abs(found.force - expected).max() / (mass * radius * rate**2))
        assert np.abs(found.moment).max() < 1e-6
    measured(errors[-1])
    assert_order(errors, 2.0)


@pytest.mark.case("bodies", "Reaction of the second hinge of a double pendulum", source="Lagrange's equations")
@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint", "backward_euler"])
def test_the_second_hinge_of_a_double_pendulum(integrator: str) -> None:
    """Mass times acceleration less weight of the lower body, in the middle of a step; second order in the step."""
    bar, length, box, half = 0.1, 0.3, 0.4, 0.04
    inertia, turning = bar * length**2 / 12.0, 2e-4

    def accelerations(p: float, q: float, dp: float, dq: float) -> Array:
        c, s, lever = np.cos(p - q), np.sin(p - q), box * length * half
        rows = [[bar * length**2 / 3 + box * length**2, lever * c], [lever * c, turning + box * half**2]]
        pull = [
            -lever * s * dq**2 - (bar / 2 + box) * length * G * np.sin(p),
            lever * s * dp**2 - box * G * half * np.sin(q),
        ]
        return np.linalg.solve(rows, pull)

    def force(state: Sequence[float]) -> Array:
        p, q, dp, dq = state
        ddp, ddq = accelerations(p, q, dp, dq)
        along = [np.array([np.sin(a), 0.0, -np.cos(a)]) for a in (p, q)]
        across = [np.array([np.cos(a), 0.0, np.sin(a)]) for a in (p, q)]
        motion = length * (ddp * across[0] - dp**2 * along[0]) + half * (ddq * across[1] - dq**2 * along[1])
        return box * (motion + np.array([0.0, 0.0, G]))

    start = np.radians([60.0, -30.0])
    end = 0.4
    errors = []
    for step in (5e-4, 2.5e-4, 1.25e-4) if integrator == "backward_euler" else (4e-3, 2e-3, 1e-3):
        scene = withe.Scene()
        down = [np.array([np.sin(angle), 0.0, -np.cos(angle)]) for angle in start]
        axes = [np.column_stack([np.cross((0, 1, 0), -each), (0, 1, 0), -each]) for each in down]
        first = scene.add_body(
            mass=bar, inertia=(inertia, inertia, 1e-6), position=length / 2 * down[0], rotation=axes[0]
        )
        second = scene.add_body(mass=box, inertia=turning, position=length * down[0] + half * down[1], rotation=axes[1])
        scene.clamp(first, at=(0, 0, 0), spin=(0, 1, 0))
        joint = scene.join(first, second, "revolute", axis=(0, 1, 0), at=length * down[0])
        simulation = scene.build(time_step=step, integrator=integrator, planar=False)  # type: ignore[arg-type]
        simulation.step(round(end / step))
        middle = end if integrator == "backward_euler" else end - 0.5 * step
        exact = solve_ivp(
            lambda _, y: [y[2], y[3], *accelerations(*y)], (0.0, middle), [*start, 0.0, 0.0], rtol=1e-12, atol=1e-12
        ).y[:, -1]
        errors.append(np.abs(simulation.reaction(joint).force - force(exact)).max() / (box * G))
        assert np.abs(simulation.reaction(joint).moment).max() < 1e-6
    measured(errors[-1])
    assert_order(errors, 1.0 if integrator == "backward_euler" else 2.0, slack=0.3)


class Robot:
    """A drawn robot of rods and four bodies, whose joints are of all kinds."""

    def __init__(self, seed: int, planar: bool, gravity: Sequence[float]) -> None:
        self.rng, self.planar = np.random.default_rng(seed), planar
        self.scene = withe.Scene(gravity=gravity)
        self.bodies: list[withe.Body] = []
        self.masses, self.inertias, self.centers, self.drawn = [], [], [], []  # type: ignore[var-annotated]
        # A joint, the indices of its bodies (None: a rod), and a node or a body with a point of it.
        self.joints: list[tuple[withe.Joint, int | None, int | None, object]] = []
        first, end = self.rod(np.zeros(3), np.array([0.15, 0.0, 0.0]))
        hub = self.body(end, 0.02)
        self.join(first.end, hub, "rigid", None, first.end)
        at = end + self.some(0.03)
        other = self.body(at + self.some(0.01), 0.01)
        pair = (hub, other) if seed % 2 else (other, hub)
        kind = ("revolute", "pinned", "sliding")[seed % 3]
        self.join(*pair, kind, at, (pair[1], at))
        at = at + self.some(0.03)
        second, end = self.rod(at, at + self.some(0.1))
        kind = ("rigid", "pinned", "revolute", "sliding")[seed % 4]
        self.join(other, second.start, kind, None, second.start)
        tip = self.body(end, 0.01)
        self.join(tip, second.end, "rigid", None, second.end)
        ball = self.body(end + self.some(0.03), 0.0)  # with its centre of mass at its joint
        at = self.drawn[ball][0]
        self.join(tip, ball, ("pinned", "revolute")[seed % 2], at, (ball, at))

    def some(self, size: float) -> Array:
        """Return a drawn displacement."""
        return size * self.rng.normal(size=3) * ((1.0, 1.0, 0.0) if self.planar else 1.0)

    def rod(self, start: Array, end: Array) -> tuple[withe.Rod, Array]:
        """Add a rod."""
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        return self.scene.add_rod(start=start, end=end, nodes=6, radius=5e-3, material=rubber), end

    def body(self, at: Array, away: float) -> int:
        """Add a body with its centre of mass at some distance from its origin."""
        turn = np.eye(3)
        if not self.planar:
            turn = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
            turn *= np.sign(np.linalg.det(turn))
        self.inertias.append(np.diag(1e-5 * self.rng.uniform(1.0, 1.8, 3)))
        self.masses.append(float(self.rng.uniform(0.02, 0.04)))
        self.centers.append(self.some(away))
        self.drawn.append((at, turn))
        self.bodies.append(
            self.scene.add_body(
                mass=self.masses[-1], inertia=self.inertias[-1], center=self.centers[-1], position=at, rotation=turn
            )
        )
        return len(self.bodies) - 1

    def join(self, a: object, b: object, kind: str, at: Array | None, place: object) -> None:
        """Join two bodies, or a body and a rod."""
        axis = None
        if kind in ("revolute", "sliding"):
            axis = self.some(1.0)
            if self.planar and kind == "revolute":
                axis = np.array([0.0, 0.0, 1.0])
        words = {} if axis is None else {"stiffness": 1e-3 if kind == "revolute" else 5.0, "damping": 1e-4}
        first, second = (self.bodies[each] if isinstance(each, int) else each for each in (a, b))
        joint = self.scene.join(first, second, kind, at=at, axis=axis, **words)  # type: ignore[call-overload]
        own = [each if isinstance(each, int) else None for each in (a, b)]
        self.joints.append((joint, own[0], own[1], place))

    def momentum(self, simulation: withe.Simulation, index: int) -> tuple[Array, Array, Array]:
        """Return linear momentum, angular momentum about the centre of mass, and its place."""
        body = self.bodies[index]
        turn, spin = simulation.rotation(body), simulation.angular_velocity(body)
        arm = turn @ self.centers[index]
        velocity = simulation.velocity(body) + np.cross(spin, arm)
        return (
            self.masses[index] * velocity,
            turn @ self.inertias[index] @ turn.T @ spin,
            simulation.position(body) + arm,
        )

    def place(self, simulation: withe.Simulation, place: object) -> Array:
        """Return the place of a joint."""
        if isinstance(place, tuple):
            index, at = place
            origin, turn = self.drawn[index]
            body = self.bodies[index]
            return np.asarray(simulation.position(body) + simulation.rotation(body) @ turn.T @ (at - origin))
        return np.asarray(simulation.positions(place.rod)[place.index])  # type: ignore[attr-defined]

    def acting(self, simulation: withe.Simulation, index: int, center: Array, places: Sequence[Array]) -> Array:
        """Return the sum of the reactions on a body, and of their moments about a point."""
        force, moment = np.zeros(3), np.zeros(3)
        for (joint, a, b, _), place in zip(self.joints, places, strict=True):
            for own, sign in ((a, -1.0), (b, 1.0)):
                if own != index:
                    continue
                found = simulation.reaction(joint)
                force += sign * found.force
                moment += sign * (found.moment + np.cross(place - center, found.force))
        return np.array([force, moment])


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_reactions_are_the_change_of_momentum_of_each_body(seed: int, planar: bool) -> None:
    """Drawn robots of rods and bodies with joints of all kinds, in motion; the middle of a step is of second order."""
    gravity = np.array([3.0, -9.0, 0.0])
    robot = Robot(seed, planar, gravity)  # type: ignore[arg-type]
    rng = np.random.default_rng(seed)
    step = 1e-4
    simulation = robot.scene.build(time_step=step, planar=planar)
    turns = np.array([0.0, 0.0, 1.0]) if planar else np.ones(3)
    velocity = rng.normal(size=3) * (1.0 - turns if planar else 1.0)
    simulation.set_velocity(robot.bodies[0], velocity, angular=10.0 * rng.normal(size=3) * turns)
    simulation.step(30)
    before = [robot.momentum(simulation, i) for i in range(4)]
    places = [robot.place(simulation, place) for *_, place in robot.joints]
    simulation.step()
    after = [robot.momentum(simulation, i) for i in range(4)]
    places = [0.5 * (old + robot.place(simulation, new[3])) for old, new in zip(places, robot.joints, strict=True)]
    for i in range(4):
        (p0, l0, x0), (p1, l1, x1) = before[i], after[i]
        force, moment = robot.acting(simulation, i, 0.5 * (x0 + x1), places)
        force += robot.masses[i] * gravity
        np.testing.assert_allclose(force, (p1 - p0) / step, atol=1e-5 * max(np.abs(p1 - p0).max() / step, 0.1))
        np.testing.assert_allclose(moment, (l1 - l0) / step, atol=1e-4 * max(np.abs(l1 - l0).max() / step, 1e-3))


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_reactions_in_equilibrium_balance_each_body(seed: int, planar: bool) -> None:
    """Drawn robots that hang from a clamp."""
    gravity = np.array([0.0, -9.81, 0.0])
    robot = Robot(seed, planar, gravity)  # type: ignore[arg-type]
    robot.scene.clamp("rod 1.start")
    simulation = robot.scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    places = [robot.place(simulation, place) for *_, place in robot.joints]
    for i in range(4):
        center = robot.momentum(simulation, i)[2]
        force, moment = robot.acting(simulation, i, center, places)
        np.testing.assert_allclose(force, -robot.masses[i] * gravity, atol=1e-6)
        np.testing.assert_allclose(moment, 0.0, atol=1e-7)


def test_a_body_without_further_points_has_a_reaction() -> None:
    """Its centre of mass is at the end of the rod."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e8, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=rubber)
    body = scene.add_body(mass=0.1, inertia=1e-4, position=(0.1, 0, 0))
    joint = scene.join(rod.end, body)
    scene.clamp(rod.start)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.reaction(joint).force, (0, 0, 0.1 * G), atol=1e-7)
    np.testing.assert_allclose(simulation.reaction(joint).moment, 0.0, atol=1e-7)


def test_reactions_of_rods_alone_are_refused() -> None:
    """With what to read instead."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    first = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=rubber)
    second = scene.add_rod(start=(0.1, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=rubber)
    joint = scene.join(first.end, second.start)
    body = scene.add_body(mass=0.1, inertia=1e-4, position=(0.2, 0, 0))
    scene.join(second.end, body)
    scene.clamp(first.start)
    simulation = scene.build(integrator="static")
    with pytest.raises(ValueError, match="read the tensions of their edges by tensions"):
        simulation.reaction(joint)


def test_rods_on_both_sides_of_a_joint_are_refused() -> None:
    """With what to read instead; the joint of the body is known."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    first = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=rubber)
    second = scene.add_rod(start=(0.1, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=rubber)
    body = scene.add_body(mass=0.1, inertia=1e-4, center=(0, 0, -0.02), position=(0.1, 0, 0))
    joint, of_body = scene.join(first.end, second.start, body)
    scene.clamp(first.start)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.reaction(of_body).force, (0, 0, 0.1 * G), atol=1e-7)
    with pytest.raises(ValueError, match="rods are on both sides of the joint: read the tensions"):
        simulation.reaction(joint)


def test_a_snapshot_keeps_reactions() -> None:
    """And a batch reads them."""
    robot = Robot(3, False, (0.0, -9.81, 0.0))
    simulation = robot.scene.build(time_step=1e-3)
    simulation.set_velocity(robot.bodies[0], (0.1, 0.2, 0.3), angular=(1, 2, 3))
    simulation.step(5)
    joint = robot.joints[1][0]
    found, state = simulation.reaction(joint), simulation.snapshot()
    simulation.step(5)
    assert np.abs(simulation.reaction(joint).force - found.force).max() > 1e-6
    simulation.restore(state)
    np.testing.assert_array_equal(simulation.reaction(joint).force, found.force)
    np.testing.assert_array_equal(simulation.reaction(joint).moment, found.moment)
    batch = withe.Batch([robot.scene.build(time_step=1e-3) for _ in range(2)])
    batch.step(2)
    assert batch.reaction(joint).force.shape == (2, 3)
