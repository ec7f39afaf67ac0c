"""Tendons through points of rigid bodies, and rings on bodies: levers, pulleys, weights, conservation, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import withe
from cases import measured

Array = npt.NDArray[np.float64]
G = 9.81


@pytest.mark.case("bodies", "Finger bone that a tendon turns", source="tension times lever")
def test_a_tendon_turns_a_body_by_its_lever() -> None:
    """A finger bone on a hinge: tension times lever is the torque of the spring of the hinge."""
    scene = withe.Scene(gravity=(0, 0, 0))
    palm = scene.add_body(mass=1.0, inertia=1e-3, name="palm")
    scene.clamp(palm)
    bone = scene.add_body(mass=0.02, inertia=1e-5, position=(0.05, 0, 0), name="bone")
    hinge = scene.join(palm, bone, "revolute", at=(0.02, 0, 0), axis=(0, 1, 0), stiffness=0.5)
    tendon = scene.add_tendon([palm.at((-0.03, 0, -0.01)), "bone.at(0.06, 0.0, -0.015)"], tension=20.0)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    start, end = simulation.tendon_points(tendon)
    np.testing.assert_allclose(start, (-0.03, 0, -0.01), atol=1e-12)
    np.testing.assert_allclose(
        end, simulation.position(bone) + simulation.rotation(bone) @ (0.01, 0, -0.015), atol=1e-12
    )
    assert simulation.tendon_length(tendon) == pytest.approx(np.linalg.norm(end - start), rel=1e-12)
    pull = 20.0 * (start - end) / np.linalg.norm(start - end)
    torque = np.cross(end - (0.02, 0, 0), pull)[1]
    angle = simulation.joint_angle(hinge)
    measured(abs(0.5 * angle / torque - 1.0))
    assert abs(angle) > 0.1
    assert 0.5 * angle == pytest.approx(torque, rel=1e-9)
    np.testing.assert_allclose(simulation.reaction(hinge).force, -pull, atol=1e-7)


def test_a_block_hangs_in_the_bight_of_a_tendon() -> None:
    """Between two guides on a held body: both parts pull with the tension."""
    scene = withe.Scene()
    beam = scene.add_body(mass=1.0, inertia=1e-3)
    scene.clamp(beam)
    block = scene.add_body(mass=0.4, inertia=1e-4, position=(0, 0, -0.3))
    scene.join(beam, block, "sliding", at=(0, 0, -0.3), axis=(0, 0, 1), stiffness=50.0)
    places = [beam.at((-0.1, 0, 0)), block.at((0, 0, -0.3)), beam.at((0.1, 0, 0))]
    scene.add_tendon(places, tension=3.0)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    z = simulation.position(block)[2]
    upwards = 2.0 * 3.0 * -z / np.hypot(0.1, z)
    assert 50.0 * (z + 0.3) == pytest.approx(upwards - 0.4 * G, rel=1e-9)


def drawn(seed: int, planar: bool) -> tuple[withe.Scene, list[withe.Body]]:
    """Return a free robot of two bodies and a rod that tendons pull together and a ring holds."""
    rng = np.random.default_rng(seed)
    flat = np.array([1.0, 1.0, 0.0]) if planar else np.ones(3)

    def some(size: float) -> Array:
        return np.asarray(size * rng.normal(size=3) * flat)

    def turn() -> Array:
        if planar:
            return np.eye(3)
        matrix = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        return np.asarray(matrix * np.sign(np.linalg.det(matrix)))

    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=2e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0.02, 0), nodes=9, radius=5e-3, material=rubber)
    hub = scene.add_body(mass=0.05, inertia=np.diag((3e-5, 4e-5, 5e-5)), position=(0.2, 0.02, 0), rotation=turn())
    scene.join(rod.end, hub)
    at = np.array([0.24, 0.05, 0.0])
    arm = scene.add_body(mass=0.03, inertia=np.diag((2e-5, 3e-5, 4e-5)), position=at + some(0.01), rotation=turn())
    axis = (0, 0, 1) if planar else rng.normal(size=3)
    scene.join(hub, arm, "revolute", at=at, axis=axis, stiffness=0.02)
    scene.add_tendon([hub.at(at + some(0.05)), arm.at(at + some(0.05)), hub.at(at + some(0.05))], tension=0.4)
    offset = [(0.0, 0.0), (0.01, 0.0), (0.0, 0.0)]
    scene.add_tendon([arm.at(at + some(0.03)), rod.edge(4), hub.at(at + some(0.04))], offset=offset, tension=0.2)
    return scene, [hub, arm]


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_tendons_on_bodies_keep_momenta_and_energy(seed: int, planar: bool) -> None:
    """The work of a constant tension counts as minus the energy of loads."""
    scene, bodies = drawn(seed, planar)
    rng = np.random.default_rng(seed)
    simulation = scene.build(time_step=1e-3, planar=planar)
    spin = rng.normal(size=3) * ((0, 0, 1) if planar else 1.0)
    simulation.set_velocity(bodies[0], rng.normal(size=3) * ((1, 1, 0) if planar else 1.0), angular=10.0 * spin)
    energy, momentum = simulation.energy(), simulation.momentum()
    simulation.step(200)
    now = simulation.momentum()
    assert np.linalg.norm(now.linear - momentum.linear) < 1e-9 * np.linalg.norm(momentum.linear)
    assert np.linalg.norm(now.angular - momentum.angular) < 1e-8 * np.linalg.norm(momentum.angular)
    assert simulation.energy().total == pytest.approx(energy.total, abs=1e-6 * energy.kinetic)
    assert abs(simulation.energy().loads) > 1e-5


def bead(planar: bool = True, **words: object) -> tuple[withe.Scene, withe.Rod, withe.Body, withe.Hand]:
    """Draw a body whose ring is on a rope between two pins."""
    scene = withe.Scene()
    cord = withe.Material(youngs_modulus=1e8, density=100.0)
    rope = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=41, radius=2e-3, material=cord)
    scene.pin(rope.start)
    scene.pin(rope.end)
    body = scene.add_body(mass=0.2, inertia=1e-5, center=(0, 0, -0.05), position=(0.4, 0, 0))
    ring = scene.grasp(rope, at=0.4, slides=True, by=body, **words)  # type: ignore[arg-type]
    return scene, rope, body, ring


@pytest.mark.parametrize("planar", [True, False])
def test_a_ring_on_a_body_carries_its_weight(planar: bool) -> None:
    """Dry friction keeps the ring where it is; the pull of the ring on the rope is the weight."""
    scene, _, body, ring = bead(friction=5.0)
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.wrench(ring).force, (0, 0, -0.2 * G), atol=1e-6)
    np.testing.assert_allclose(simulation.pose(ring).position, simulation.position(body), atol=1e-12)
    passage = simulation.passage(ring)
    assert passage.at == pytest.approx(0.4, abs=1e-3)
    assert np.hypot(passage.pull, passage.press) == pytest.approx(0.2 * G, rel=1e-5)


def test_a_ring_on_a_clamped_body_is_a_ring_in_the_world() -> None:
    """A rope is drawn through it by its end."""
    found = []
    for on_body in (True, False):
        scene = withe.Scene()
        cord = withe.Material(youngs_modulus=1e7, density=1000.0)
        rope = scene.add_rod(start=(0, 0, 0), end=(0.5, 0, 0), nodes=26, radius=3e-3, material=cord)
        grip = scene.clamp(rope.start)
        words = {}
        if on_body:
            words["by"] = scene.add_body(mass=0.2, inertia=1e-5, position=(0.3, 0.1, 0))
            scene.clamp(words["by"])
        ring = scene.grasp(rope, at=0.3, slides=True, friction=0.2, **words)  # type: ignore[arg-type]
        simulation = scene.build(time_step=1e-3)
        simulation.move(grip, position=(-0.05, 0, 0), over=0.1)
        simulation.step(100)
        reaction = simulation.wrench(ring).force
        found.append([*simulation.positions(rope).ravel(), simulation.passage(ring).at, *reaction])
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_a_ring_on_a_free_body_keeps_momenta_and_energy(seed: int, planar: bool, friction: float) -> None:
    """Energy and what friction dissipates are constant; angular momentum is so to second order in the step."""
    rng = np.random.default_rng(seed)
    flat = np.array([1.0, 1.0, 0.0]) if planar else np.ones(3)
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=2e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=16, radius=5e-3, material=rubber)
    body = scene.add_body(mass=0.02, inertia=np.diag((2e-5, 3e-5, 4e-5)), position=(0.11, 0.01, 0))
    scene.grasp(rod, at=0.12, slides=True, by=body, friction=friction, stiffness=2e3)
    simulation = scene.build(time_step=5e-4, planar=planar)
    spin = rng.normal(size=3) * ((0, 0, 1) if planar else 1.0)
    simulation.set_velocity(body, 0.5 * rng.normal(size=3) * flat, angular=10.0 * spin)
    energy, momentum = simulation.energy(), simulation.momentum()
    simulation.step(100)
    now = simulation.momentum()
    assert np.linalg.norm(now.linear - momentum.linear) < 1e-9 * np.linalg.norm(momentum.linear)
    assert np.linalg.norm(now.angular - momentum.angular) < 3e-6 * np.linalg.norm(momentum.angular)
    after = simulation.energy()
    assert after.total + after.dissipated == pytest.approx(energy.total, abs=1e-6 * energy.kinetic)
    assert after.work == pytest.approx(0.0, abs=1e-12)
    assert (after.dissipated > 1e-9) == (friction > 0.0)


def test_a_record_keeps_guides_on_bodies(tmp_path: Path) -> None:
    """And a scene file the tendon and the ring."""
    scene, bodies = drawn(0, False)
    scene.grasp("rod 1", at=0.05, slides=True, by=bodies[1], friction=0.1)
    scene.save(tmp_path / "robot.toml")
    simulation = withe.Scene.load(tmp_path / "robot.toml").build(time_step=1e-3)
    record = simulation.run(0.01, record_every=0.005, progress=False)
    record.save(tmp_path / "robot.npz")
    again = withe.Record.load(tmp_path / "robot.npz")
    for tendon, name in zip(again.tendons, ("tendon 1", "tendon 2"), strict=True):
        points = withe.view.tendons.tendon_points(again, tendon)
        assert points.shape == (3, 3, 3)
        np.testing.assert_allclose(points[-1], simulation.tendon_points(name), atol=1e-12)
    other = scene.build(time_step=1e-3)
    other.step(10)
    np.testing.assert_array_equal(other.position(bodies[1]), simulation.position(bodies[1].name))
    state = other.snapshot()
    other.step(5)
    place = other.position(bodies[1])
    other.restore(state)
    other.step(5)
    np.testing.assert_array_equal(other.position(bodies[1]), place)


def test_what_guides_on_bodies_cannot_be() -> None:
    """With what to do."""
    scene, _, body, ring = bead()
    with pytest.raises(ValueError, match=r"guide of tendon .* must be a point of a body, such as hand.at"):
        scene.add_tendon([body, "rod 1.edge(3)"], offset=(0, 0))  # type: ignore[list-item]
    with pytest.raises(ValueError, match="offset of tendon 'tendon 1' must be given, because it has guides on rods"):
        scene.add_tendon([body.at((0, 0, 0)), "rod 1.edge(3)"])
    with pytest.raises(ValueError, match="offset of tendon 'tendon 1' must be zero at guides on bodies"):
        scene.add_tendon([body.at((0, 0, 0)), "rod 1.edge(3)"], offset=[(0.01, 0), (0, 0)])
    with pytest.raises(ValueError, match="guides 0 and 1 of tendon 'tendon 1' must not coincide"):
        scene.add_tendon([body.at((0, 0, 0)), body.at((0, 0, 0))])
    with pytest.raises(ValueError, match=r"by of 'hand 2' needs a ring: use slides=True, or hold the rod by a joint"):
        scene.grasp("rod 1", at=0.7, by=body)
    with pytest.raises(ValueError, match="by of 'hand 2' must be a rigid body of the scene, got 'rod 1'"):
        scene.grasp("rod 1", at=0.7, slides=True, by="rod 1")
    with pytest.raises(ValueError, match="pose of 'hand 2' must not be given with by="):
        scene.grasp("rod 1", at=0.7, slides=True, by=body, pose=((0, 0, 0), np.eye(3)))
    simulation = scene.build()
    with pytest.raises(ValueError, match="ring 'hand 1' is on a body and moves with the body"):
        simulation.move(ring, position=(0, 0, 1))


def test_a_ring_on_a_curved_rod_is_free_of_stress_as_drawn() -> None:
    """It is on the smooth curve of the rod, not on its chords."""
    scene = withe.Scene(gravity=(0, 0, 0))
    angles = np.linspace(0.0, 2.0, 12)
    points = 0.1 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    rubber = withe.Material(youngs_modulus=2e6, density=1000.0)
    rod = scene.add_rod(points=points, radius=3e-3, material=rubber)
    length = 0.2
    for i, at in enumerate(np.linspace(0.0, length, 7)[1:-1]):
        body = scene.add_body(mass=0.02, inertia=1e-5, position=(0.05 * i, 0, 0))
        scene.grasp(rod, at=float(at), slides=True, by=body)
    assert scene.build().energy().spring < 1e-18
