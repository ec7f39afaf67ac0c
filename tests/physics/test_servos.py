"""Servos at their limits: constant torque, ramps of the rest angle, energy, order of convergence, gradients."""

from __future__ import annotations

import numpy as np
import pytest

import withe
from cases import measured
from convergence import assert_order
from test_joint_limits import LENGTH, about_hinge, hammer


@pytest.mark.case("bodies", "Servo at its greatest torque", source="constant acceleration, T / J")
@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint", "backward_euler"])
def test_a_saturated_servo_is_a_constant_torque(integrator: str) -> None:
    """Angular acceleration T / J to 1e-6 while the rest angle is far away."""
    torque, duration = 0.03, 0.2
    scene, bar, joint = hammer(stiffness=5.0, rest_angle=1e3, max_torque=torque)
    simulation = scene.build(time_step=1e-3, integrator=integrator)  # type: ignore[arg-type]
    simulation.step(round(duration / 1e-3))
    rate = torque / about_hinge() * duration
    measured(abs(simulation.angular_velocity(bar)[1] / rate - 1.0))
    tolerance = 1e-4 if integrator == "backward_euler" else 1e-6
    assert simulation.angular_velocity(bar)[1] == pytest.approx(rate, rel=tolerance)
    assert simulation.joint_torque(joint) == torque
    if integrator != "backward_euler":
        assert simulation.joint_angle(joint) == pytest.approx(0.5 * rate * duration, rel=1e-6)


def test_a_saturated_slide_is_a_constant_force() -> None:
    """A bead on a held bar."""
    scene = withe.Scene(gravity=(0, 0, 0))
    wall = scene.add_body(mass=1.0, inertia=1e-3)
    scene.clamp(wall)
    bead = scene.add_body(withe.solids.Sphere(0.01), mass=0.1)
    scene.join(wall, bead, "sliding", at=(0, 0, 0), axis=(1, 0, 0), stiffness=1e3, rest_angle=1.0, max_torque=2.0)
    simulation = scene.build(time_step=1e-3)
    simulation.step(100)
    assert simulation.velocity(bead)[0] == pytest.approx(2.0, rel=1e-6)


def servo_motion(stiffness: float, most: float, inertia: float, rest: float, time: float) -> float:
    """Return the angle of a servo that starts at rest at 0: saturated, then a spring, until it turns back."""
    within = most / stiffness
    reach = np.sqrt(2.0 * (rest - within) * inertia / most)
    if time < reach:
        return float(0.5 * most / inertia * time**2)
    frequency = np.sqrt(stiffness / inertia)
    rate = most / inertia * reach
    phase = frequency * (time - reach)
    return float(rest - within * np.cos(phase) + rate / frequency * np.sin(phase))


@pytest.mark.case("bodies", "Servo that leaves its greatest torque", source="parabola, then a sine")
@pytest.mark.parametrize("integrator", ["energy_momentum", "implicit_midpoint"])
def test_a_servo_leaves_saturation(integrator: str) -> None:
    """Second order in the step; energy to rounding with the energy-momentum rule."""
    stiffness, most, rest, duration = 0.2, 0.05, 0.6, 0.32
    expected = servo_motion(stiffness, most, about_hinge(), rest, duration)
    errors = []
    for step in (8e-3, 4e-3, 2e-3):
        scene, _, joint = hammer(stiffness=stiffness, rest_angle=rest, max_torque=most)
        simulation = scene.build(time_step=step, integrator=integrator)  # type: ignore[arg-type]
        energy = simulation.energy()
        assert energy.spring == pytest.approx(most * (rest - 0.5 * most / stiffness), rel=1e-12)
        simulation.step(round(duration / step))
        errors.append(abs(simulation.joint_angle(joint) - expected))
        if integrator == "energy_momentum":
            assert simulation.energy().total == pytest.approx(energy.total, rel=1e-9)
    measured(errors[-1], "rad")
    assert_order(errors, 2.0, slack=0.5)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_energy_of_rods_with_weak_servos(seed: int, planar: bool) -> None:
    """Legs of rods whose servos saturate and are set again: total energy is work of actuation less the damping."""
    rng = np.random.default_rng(seed)
    scene = withe.Scene(gravity=(0, 0, 0))
    stiff = withe.Material(youngs_modulus=1e9, density=1100.0)
    words = {"nodes": 5, "radius": 5e-3, "material": stiff}
    weak = {"max_torque": 0.02, "max_speed": 30.0}
    corners = np.cumsum(np.vstack([np.zeros(3), 0.1 * rng.normal(size=(3, 3)) * (1, 0, 1)]), axis=0)
    limbs = [scene.add_rod(start=a, end=b, **words) for a, b in zip(corners, corners[1:], strict=False)]  # type: ignore[arg-type]
    joints = [
        scene.join(first.end, second.start, "revolute", axis=(0, 1, 0), stiffness=2.0, damping=1e-4, **weak)
        for first, second in zip(limbs, limbs[1:], strict=False)
    ]
    simulation = scene.build(time_step=5e-4, planar=planar)
    start = simulation.energy()
    for _ in range(4):
        for joint in joints:
            simulation.set(joint, rest_angle=rng.normal())
        simulation.step(20)
    energy = simulation.energy()
    assert energy.kinetic > 1e-5
    assert energy.total - start.total == pytest.approx(
        energy.work - energy.dissipated, abs=1e-7 * (abs(energy.work) + energy.kinetic)
    )
    momentum = simulation.momentum()
    assert np.abs(momentum.linear).max() < 1e-12
    assert np.abs(momentum.angular).max() < 1e-11


@pytest.mark.case("bodies", "Rest angle of a servo with a greatest speed", source="ramp")
def test_a_rest_angle_follows_its_ramp() -> None:
    """At most at its speed, from where it is; slower with a long `over`."""
    scene, _, joint = hammer(stiffness=1e3, damping=5.0, max_speed=2.0)
    simulation = scene.build(time_step=1e-3)
    simulation.set(joint, rest_angle=0.6)
    simulation.step(100)
    assert simulation.get(joint, "rest_angle") == pytest.approx(0.2, abs=1e-12)
    assert simulation.joint_angle(joint) == pytest.approx(0.2 - 5.0 * 2.0 / 1e3, rel=2e-2)  # behind by damping
    simulation.set(joint, rest_angle=-0.1)
    simulation.step(100)
    assert simulation.get(joint, "rest_angle") == pytest.approx(0.0, abs=1e-12)
    simulation.step(100)
    assert simulation.get(joint, "rest_angle") == pytest.approx(-0.1, abs=1e-12)
    simulation.set(joint, rest_angle=0.1, over=0.4)
    simulation.step(100)
    assert simulation.get(joint, "rest_angle") == pytest.approx(-0.05, abs=1e-12)
    simulation.set(joint, max_speed=np.inf)
    simulation.set(joint, rest_angle=0.3)
    assert simulation.get(joint, "rest_angle") == 0.3


def test_other_words_beside_a_rest_angle_are_set_at_once() -> None:
    """The ramp of the rest angle is its own."""
    scene, _, joint = hammer(stiffness=1.0, max_speed=2.0)
    simulation = scene.build(time_step=1e-3)
    simulation.set(joint, stiffness=3.0, rest_angle=0.6)
    assert simulation.get(joint, "stiffness") == 3.0
    assert simulation.get(joint, "rest_angle") == 0.0
    simulation.step(400)
    assert simulation.get(joint, "rest_angle") == pytest.approx(0.6)


def test_an_actuation_is_led_at_the_speed_of_the_servo() -> None:
    """As by `set`."""
    scene, _, joint = hammer(stiffness=1.0, max_speed=2.0)
    scene.actuate(joint, at=0.05, rest_angle=1.0)
    simulation = scene.build(time_step=1e-3)
    simulation.step(150)
    assert simulation.get(joint, "rest_angle") == pytest.approx(0.2, abs=1e-9)


def test_an_equilibrium_has_no_speeds() -> None:
    """A static simulation is led there at once."""
    scene, _, joint = hammer(stiffness=1.0, max_speed=2.0)
    simulation = scene.build(integrator="static")
    simulation.set(joint, rest_angle=0.5)
    simulation.equilibrium()
    assert simulation.joint_angle(joint) == pytest.approx(0.5)


def test_a_weak_servo_gives_way_in_equilibrium() -> None:
    """A bar hangs beside its servo, whose torque is the greatest one."""
    scene, _, joint = hammer(9.81, stiffness=50.0, rest_angle=-0.5, max_torque=0.1)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    angle = simulation.joint_angle(joint)
    assert 0.2 * 9.81 * 0.5 * LENGTH * np.cos(angle) == pytest.approx(0.1, rel=1e-6)
    assert simulation.joint_torque(joint) == pytest.approx(-0.1, rel=1e-12)
    assert simulation.reaction(joint).moment[1] == pytest.approx(-0.1, rel=1e-6)


@pytest.mark.parametrize("most", [0.004, 0.012, 10.0])
def test_gradients_of_servos(most: float) -> None:
    """Central differences give the same by stiffness, rest angle and greatest torque, below the limit and at it."""

    def run(**words: float) -> tuple[withe.Joint, withe.Record, float]:
        scene = withe.Scene(gravity=(0, 0, 0))
        stiff = withe.Material(youngs_modulus=1e8, density=1100.0)
        rods = [
            scene.add_rod(start=(0.1 * i, 0, 0), end=(0.1 * i + 0.1, 0, 0), nodes=4, radius=5e-3, material=stiff)
            for i in range(2)
        ]
        scene.clamp(rods[0].start)
        given = {"stiffness": 0.05, "rest_angle": 0.4, "max_torque": most} | words
        joint = scene.join(rods[0].end, rods[1].start, "revolute", axis=(0, 1, 0), **given)  # type: ignore[call-overload]
        simulation = scene.build(time_step=2e-3)
        record = simulation.run(0.04, record_every=0.04, differentiable=True, progress=False)
        return joint, record, float(record.positions(rods[1])[-1, -1, 2])

    joint, record, _ = run()
    by = np.zeros_like(record.positions())
    by[-1, -1, 2] = 1.0
    words = {"stiffness": 0.05, "rest_angle": 0.4, "max_torque": most}
    found = record.gradient({"positions": by}, [(joint, word) for word in words])
    for gradient, (word, value) in zip(found, words.items(), strict=True):
        h = 1e-4 * value
        expected = (run(**{word: value + h})[2] - run(**{word: value - h})[2]) / (2.0 * h)
        scale = abs(run()[2]) / value
        assert float(gradient) == pytest.approx(expected, rel=1e-4, abs=1e-6 * scale)


@pytest.mark.parametrize("word", ["max_torque", "max_speed"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, "much"])
def test_limits_of_servos_that_cannot_be_are_refused(word: str, value: object) -> None:
    """Both when described and when set."""
    with pytest.raises(ValueError, match=f"{word} of joint 'joint 1'"):
        hammer(**{word: value})
    scene, _, joint = hammer()
    simulation = scene.build()
    with pytest.raises(ValueError, match=word):
        simulation.set(joint, **{word: value})  # type: ignore[call-overload]


def test_a_rigid_joint_has_no_servo() -> None:
    """Nor has a pinned one."""
    scene = withe.Scene()
    wall, bar = (scene.add_body(mass=1.0, inertia=1e-3) for _ in range(2))
    with pytest.raises(ValueError, match="max_torque of joint 'joint 1' needs kind='revolute' or kind='sliding'"):
        scene.join(wall, bar, "pinned", at=(0, 0, 0), max_torque=1.0)


def test_a_scene_file_keeps_limits_of_servos(tmp_path: object) -> None:
    """And leaves those out that are infinite."""
    scene, _, _ = hammer(stiffness=1.0, max_torque=0.5, limits=(-1, np.inf), limit_stiffness=9.0, restitution=0.25)
    text = scene.to_toml() if hasattr(scene, "to_toml") else scene.save(tmp_path / "scene.toml").read_text()  # type: ignore[operator]
    assert "max_torque = 0.5" in text
    assert "restitution = 0.25" in text
    assert "max_speed" not in text
    again = withe.Scene.load(tmp_path / "scene.toml")  # type: ignore[operator]
    simulation = again.build()
    assert simulation.get("joint 1", "max_torque") == 0.5
    assert simulation.get("joint 1", "max_speed") == np.inf


def test_a_snapshot_keeps_a_servo_on_its_way() -> None:
    """Limits, and a ramp at the greatest speed."""
    scene, _, joint = hammer(stiffness=1.0, max_torque=0.01, max_speed=2.0)
    simulation = scene.build(time_step=1e-3)
    simulation.set(joint, rest_angle=1.0)
    simulation.step(100)
    state = simulation.snapshot()
    simulation.step(100)
    angle = simulation.joint_angle(joint)
    other = scene.build(time_step=1e-3)
    other.restore(state)
    other.step(100)
    assert other.joint_angle(joint) == angle
    assert other.get(joint, "rest_angle") == pytest.approx(0.4)
