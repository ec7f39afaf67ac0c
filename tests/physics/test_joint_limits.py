"""Stops of joints: rebound without loss, contact time, balance at a stop, limits of slides and of planar joints."""

from __future__ import annotations

import numpy as np
import pytest

import withe
from cases import measured
from convergence import assert_order

LENGTH, MASS = 0.3, 0.2


def hammer(gravity: float = 0.0, planar: bool = False, **words: object) -> tuple[withe.Scene, withe.Body, withe.Joint]:
    """Draw a bar along x on a hinge about y at the origin, which a held body carries."""
    scene = withe.Scene(gravity=(0, 0, -gravity))
    wall = scene.add_body(mass=1.0, inertia=1e-3, name="wall")
    scene.clamp(wall)
    bar = scene.add_body(withe.solids.Box((LENGTH, 0.02, 0.02)), mass=MASS, position=(0.5 * LENGTH, 0, 0), name="bar")
    joint = scene.join(wall, bar, "revolute", at=(0, 0, 0), axis=(0, 1, 0), **words)  # type: ignore[call-overload]
    return scene, bar, joint


def about_hinge(bar_width: float = 0.02) -> float:
    """Return the moment of inertia of the bar about its hinge [kg m^2]."""
    return MASS * ((LENGTH**2 + bar_width**2) / 12.0 + 0.25 * LENGTH**2)


@pytest.mark.case("bodies", "Bar that rebounds from a stop", source="half a period of the stop, pi sqrt(J / k)")
def test_a_bar_rebounds_from_a_stop() -> None:
    """Energy stays, and the angle after the rebound is right."""
    stiffness, rate, limit, duration = 50.0, 2.0, 0.5, 0.5
    frequency = np.sqrt(stiffness / about_hinge())
    back = limit - rate * (duration - limit / rate - np.pi / frequency)
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        scene, bar, joint = hammer(limits=(-1.0, limit), limit_stiffness=stiffness)
        simulation = scene.build(time_step=step)
        simulation.set_velocity(bar, (0, 0, -0.5 * LENGTH * rate), angular=(0, rate, 0))
        energy = simulation.energy().total
        simulation.step(round(duration / step))
        assert simulation.energy().total == pytest.approx(energy, rel=1e-7)
        assert simulation.joint_rate(joint) == pytest.approx(-rate, rel=1e-3)
        errors.append(abs(simulation.joint_angle(joint) / back - 1.0))
    measured(errors[-1])
    assert errors[-1] < 1e-2
    assert_order(errors, 2.0, slack=0.7)  # the bar meets the stop at another share of a step each time


@pytest.mark.case("bodies", "Bar that meets a stop with restitution", source="rate after over rate before")
@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint"])
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("rate", [2.0, -7.0])
def test_a_bar_leaves_a_stop_at_a_share_of_its_rate(restitution: float, rate: float, integrator: str) -> None:
    """At either stop; the lost energy is dissipated. A restitution of 0 counts as 0.01."""
    share = max(restitution, 0.01)
    scene, bar, joint = hammer(limits=(-0.5, 0.5), limit_stiffness=50.0, restitution=restitution)
    simulation = scene.build(time_step=1e-3, integrator=integrator)  # type: ignore[arg-type]
    simulation.set_velocity(bar, (0, 0, -0.5 * LENGTH * rate), angular=(0, rate, 0))
    energy = simulation.energy().total
    simulation.step(round((0.6 / abs(rate) + np.pi / np.sqrt(50.0 / about_hinge()) * 3.0) / 1e-3))
    assert simulation.joint_rate(joint) == pytest.approx(-share * rate, abs=6e-3 * abs(rate))
    now = simulation.energy()
    assert now.total + now.dissipated == pytest.approx(energy, rel=1e-6)
    assert now.kinetic == pytest.approx(share**2 * energy, abs=6e-3 * energy)


def test_the_rate_after_a_stop_converges_at_second_order() -> None:
    """Phases of the steps at the impact vary, so that the mean over phases counts."""
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        found = []
        for phase in np.linspace(0.0, 1.0, 8, endpoint=False):
            scene, bar, joint = hammer(limits=(-0.5, 0.5 + phase * step * 2.0), limit_stiffness=50.0, restitution=0.5)
            simulation = scene.build(time_step=step)
            simulation.set_velocity(bar, (0, 0, -0.5 * LENGTH * 2.0), angular=(0, 2.0, 0))
            simulation.step(round(0.5 / step))
            found.append(abs(simulation.joint_rate(joint) / -1.0 - 1.0))
        errors.append(float(np.mean(found)))
    measured(errors[-1])
    assert_order(errors, 2.0, slack=0.7)


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_a_falling_bar_comes_to_rest_on_its_stop(restitution: float) -> None:
    """At the equilibrium angle, without a damper."""
    scene, _, joint = hammer(9.81, limits=(-0.2, 0.3), limit_stiffness=100.0, restitution=restitution)
    simulation = scene.build(time_step=2e-3)
    simulation.run(3.0, progress=False)
    angle = simulation.joint_angle(joint)
    weight = 0.5 * MASS * 9.81 * LENGTH * np.cos(angle)
    assert angle == pytest.approx(0.3 + weight / 100.0, rel=1e-3)
    assert abs(simulation.joint_rate(joint)) < 1e-3


@pytest.mark.parametrize("planar", [True, False])
def test_rods_lose_energy_at_stops_as_their_books_say(planar: bool) -> None:
    """A shank on a knee with stops; the total energy and what is dissipated are constant."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    stiff = withe.Material(youngs_modulus=1e9, density=1100.0)
    thigh = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.1), nodes=5, radius=5e-3, material=stiff)
    shank = scene.add_rod(start=(0, 0, -0.1), end=(0.1, 0, -0.1), nodes=5, radius=5e-3, material=stiff)
    stops = {"limits": (-0.2, 0.4), "limit_stiffness": 5.0, "restitution": 0.5}
    scene.join(thigh.end, shank.start, "revolute", axis=(0, 1, 0), **stops)  # type: ignore[call-overload]
    scene.clamp(thigh.start)
    simulation = scene.build(time_step=5e-4, planar=planar)
    energy = simulation.energy().total
    scale = 1100.0 * np.pi * 25e-6 * 0.1 * 9.81 * 0.05
    for _ in range(40):
        simulation.step(10)
        now = simulation.energy()
        assert now.total + now.dissipated == pytest.approx(energy, abs=1e-6 * scale)
    assert now.dissipated > 0.05 * scale


@pytest.mark.parametrize("integrator", ["static", "backward_euler"])
def test_a_bar_rests_on_a_stop(integrator: str) -> None:
    """Gravity bends the stop by m g l cos / 2 k; the torque of the joint is that of gravity."""
    scene, _, joint = hammer(9.81, limits=(-0.2, 0.3), limit_stiffness=100.0)
    simulation = scene.build(integrator=integrator, time_step=5e-3)
    if integrator == "static":
        simulation.equilibrium()
    else:
        simulation.run(3.0, progress=False)
    angle = simulation.joint_angle(joint)
    weight = 0.5 * MASS * 9.81 * LENGTH * np.cos(angle)
    assert angle == pytest.approx(0.3 + weight / 100.0, rel=1e-4)
    assert simulation.joint_torque(joint) == pytest.approx(-weight, rel=1e-4)


def test_between_its_limits_a_joint_is_free() -> None:
    """To the bit as without limits."""
    found = []
    for words in ({}, {"limits": (-10.0, 10.0), "limit_stiffness": 100.0}):
        scene, _, joint = hammer(9.81, **words)
        simulation = scene.build(time_step=2e-3)
        simulation.step(200)
        found.append(simulation.joint_angle(joint))
    assert found[0] == found[1]


def test_a_slide_stops_at_its_limits() -> None:
    """One limit is infinite; a bead on a held bar, that rebounds at the speed at which it came."""
    scene = withe.Scene(gravity=(0, 0, 0))
    wall = scene.add_body(mass=1.0, inertia=1e-3)
    scene.clamp(wall)
    bead = scene.add_body(withe.solids.Sphere(0.01), mass=0.1)
    joint = scene.join(wall, bead, "sliding", at=(0, 0, 0), axis=(1, 0, 0), limits=(-np.inf, 0.1), limit_stiffness=1e4)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(bead, (0.5, 0, 0))
    simulation.step(400)
    assert simulation.joint_angle(joint) < 0.1
    assert simulation.velocity(bead)[0] == pytest.approx(-0.5, rel=1e-9)


@pytest.mark.parametrize("planar", [True, False])
def test_rods_rebound_from_a_stop_in_a_plane_as_in_space(planar: bool) -> None:
    """A shank on a knee with a limit; energy stays."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    stiff = withe.Material(youngs_modulus=1e9, density=1100.0)
    thigh = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.1), nodes=5, radius=5e-3, material=stiff)
    shank = scene.add_rod(start=(0, 0, -0.1), end=(0.1, 0, -0.1), nodes=5, radius=5e-3, material=stiff)
    knee = scene.join(thigh.end, shank.start, "revolute", axis=(0, 1, 0), limits=(-0.2, 0.4), limit_stiffness=5.0)
    scene.clamp(thigh.start)
    simulation = scene.build(time_step=5e-4, planar=planar)
    energy, furthest = simulation.energy().total, 0.0
    scale = 1100.0 * np.pi * 25e-6 * 0.1 * 9.81 * 0.05
    for _ in range(40):
        simulation.step(10)
        furthest = max(furthest, simulation.joint_angle(knee))
        assert simulation.energy().total == pytest.approx(energy, abs=1e-6 * scale)
    assert 0.4 < furthest < 0.5


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"limits": (-0.1, 0.1)}, "need limit_stiffness="),
        ({"limit_stiffness": 1.0}, "limit_stiffness of joint 'joint 1' needs limits="),
        ({"limits": (0.1, 0.2), "limit_stiffness": 1.0}, r"must contain the drawn angle, 0, got \(0.1, 0.2\)"),
        ({"limits": (0.2, -0.2), "limit_stiffness": 1.0}, "must contain the drawn angle"),
        ({"limits": (0.0, 0.0), "limit_stiffness": 1.0}, "must contain the drawn angle"),
        ({"limits": (np.nan, 0.2), "limit_stiffness": 1.0}, "must contain the drawn angle"),
        ({"limits": 0.2, "limit_stiffness": 1.0}, "must be two angles"),
        ({"restitution": 0.5}, "restitution of joint 'joint 1' needs limits="),
        ({"limits": (-1, 1), "limit_stiffness": 1.0, "restitution": 1.5}, "must be from 0 to 1, got 1.5"),
        ({"limits": (-0.1, 0.1), "limit_stiffness": -1.0}, "limit_stiffness of joint 'joint 1' must be positive"),
    ],
)
def test_limits_that_cannot_be_are_refused(words: dict[str, object], message: str) -> None:
    """With what to do."""
    with pytest.raises(ValueError, match=message):
        hammer(**words)


def test_a_rigid_joint_has_no_limits() -> None:
    """Nor has a pinned one."""
    scene = withe.Scene()
    wall, bar = (scene.add_body(mass=1.0, inertia=1e-3) for _ in range(2))
    with pytest.raises(ValueError, match="limits of joint 'joint 1' need kind='revolute' or kind='sliding'"):
        scene.join(wall, bar, "pinned", at=(0, 0, 0), limits=(-1, 1), limit_stiffness=1.0)


@pytest.mark.parametrize("integrator", ["static", "energy_momentum"])
def test_a_joint_of_bodies_has_a_rate(integrator: str) -> None:
    """That of its frames: no edges of rods are there."""
    scene, bar, joint = hammer(stiffness=2.0, damping=0.1)
    simulation = scene.build(integrator=integrator, time_step=1e-3)
    assert simulation.joint_rate(joint) == 0.0
    assert simulation.joint_torque(joint) == 0.0
    if integrator != "static":
        simulation.set_velocity(bar, (0, 0, -0.5 * LENGTH * 3.0), angular=(0, 3.0, 0))
        assert simulation.joint_rate(joint) == pytest.approx(3.0, rel=1e-12)
        assert simulation.joint_torque(joint) == pytest.approx(-0.3, rel=1e-12)
