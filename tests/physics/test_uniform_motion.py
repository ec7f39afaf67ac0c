"""Uniform motion: a scene whose rods and supports all move at one more velocity behaves as it does without it."""

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0)
IMPLICIT = ["energy_momentum", "implicit_midpoint", "backward_euler"]
KINDS = ["pin", "frame", "edge", "hand"]


def hold(scene, rod, kind, length):
    """A support of the start of the rod, or a hand about its middle."""
    if kind == "pin":
        return scene.pin(rod.start)
    if kind == "hand":
        return scene.grasp(rod, at=0.5 * length, length=0.3 * length)
    return scene.clamp(rod.start, hold=kind)


@pytest.mark.parametrize("integrator", [*IMPLICIT, "verlet"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("path_first", [True, False])
def test_a_rod_and_its_support_that_fly_together_stay_as_they_are(integrator, kind, path_first):
    """Galileo: nothing bends, and the support has nothing to hold; drawn rods, velocities and steps."""
    for seed in range(4):
        fresh = np.random.default_rng(seed)
        nodes, length, planar = int(fresh.integers(6, 31)), fresh.uniform(0.1, 0.4), seed % 2 == 0
        along = np.linspace(0.0, length, nodes)
        points = np.stack([along, fresh.uniform(-2, 2) * along**2, 0.0 * along], axis=1)
        turn = np.eye(3) if planar else np.linalg.qr(fresh.normal(size=(3, 3)))[0]
        velocity = turn @ (fresh.normal(size=3) * (1, 1, 0 if planar else 1))
        step = 1e-5 if integrator == "verlet" else float(fresh.choice([1e-3, 5e-3]))
        scene = withe.Scene(gravity=(0, 0, 0))
        rod = scene.add_rod(points=points @ turn.T, radius=fresh.uniform(2e-3, 5e-3), material=RUBBER)
        support = hold(scene, rod, kind, length)
        simulation = scene.build(time_step=step, integrator=integrator)
        start, drawn = simulation.pose(support).position.copy(), simulation.positions(rod).copy()
        for is_path in (path_first, not path_first):
            if is_path:
                simulation.move(support, path=lambda t, start=start, velocity=velocity: start + velocity * t)
            else:
                simulation.set_velocities(rod, velocity)
        assert simulation.velocities(rod) == pytest.approx(np.tile(velocity, (nodes, 1)), abs=1e-12)
        momentum = 2.0 * simulation.energy().kinetic / np.linalg.norm(velocity)
        for _ in range(20):
            simulation.step()
            moved = simulation.positions(rod) - velocity * simulation.time
            assert np.abs(moved - drawn).max() < 1e-9 * length
            assert np.linalg.norm(simulation.reaction(support).force) * step < 1e-8 * momentum


@pytest.mark.parametrize("integrator", IMPLICIT)
@pytest.mark.parametrize("kind", ["frame", "edge", "hand"])
def test_a_shaft_and_its_clamp_that_spin_together_are_not_twisted(integrator, kind):
    """A round shaft that spins about its straight axis: no part of it falls behind."""
    for seed in range(3):
        fresh = np.random.default_rng(seed)
        nodes, length, rate = int(fresh.integers(6, 31)), fresh.uniform(0.1, 0.4), fresh.uniform(-20, 20)
        axis = fresh.normal(size=3)
        axis /= np.linalg.norm(axis)
        scene = withe.Scene(gravity=(0, 0, 0))
        shaft = scene.add_rod(start=(0, 0, 0), end=length * axis, nodes=nodes, radius=4e-3, material=RUBBER)
        support = hold(scene, shaft, kind, length)
        simulation = scene.build(time_step=2e-3, integrator=integrator, planar=False)
        pose = simulation.pose(support)
        place, drawn = pose.position.copy(), pose.rotation.copy()
        cross = np.cross(np.eye(3), axis)

        def spin(t, rate=rate, cross=cross, place=place, drawn=drawn):
            return place, (np.eye(3) + np.sin(rate * t) * cross + (1 - np.cos(rate * t)) * cross @ cross) @ drawn

        simulation.move(support, path=spin)
        simulation.set_state(shaft, spins=rate)
        for _ in range(20):
            simulation.step()
            assert np.abs(simulation.twists(shaft)).max() < 1e-5 * abs(rate) / length


@pytest.mark.parametrize("integrator", IMPLICIT)
@pytest.mark.parametrize("kind", KINDS)
def test_rest_and_uniform_motion_differ_by_the_motion_alone(integrator, kind):
    """Random velocities of a heavy arm over a floor, which its support stops or carries along in the first step."""
    for seed in range(3):
        fresh = np.random.default_rng(seed)
        nodes, length = int(fresh.integers(6, 16)), fresh.uniform(0.1, 0.4)
        radius, level = fresh.uniform(2e-3, 5e-3), fresh.uniform(0.005, 0.02)
        random, own = 0.2 * fresh.normal(size=(nodes, 3)), 0.3 * np.abs(fresh.normal(size=3))
        found = []
        for added in (np.zeros(3), np.array([*fresh.normal(size=2), 0.0])):
            scene = withe.Scene()
            rod = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=nodes, radius=radius, material=RUBBER)
            scene.add_mass(rod.start, 0.01)
            support = hold(scene, rod, kind, length)
            scene.add_floor(height=-radius - level)
            simulation = scene.build(
                time_step=1e-3,
                integrator=integrator,
                planar=False,
                solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
            )
            start = simulation.pose(support).position.copy()
            velocity = own + added
            simulation.set_velocities(rod, random + added)
            simulation.move(support, path=lambda t, start=start, velocity=velocity: start + velocity * t)
            before = simulation.energy()
            places, forces = [], []
            for _ in range(15):
                simulation.step()
                places.append(simulation.positions(rod) - added * simulation.time)
                forces.append(simulation.reaction(support).force)
            after = simulation.energy()
            found.append((np.array(places), np.array(forces)))
            if integrator == "energy_momentum":
                balance = after.total - after.work - before.total + before.work + after.dissipated - before.dissipated
                assert abs(balance) < 1e-6 * max(before.kinetic, after.kinetic)
        (places, forces), (moved, moved_forces) = found
        assert np.abs(moved - places).max() < 1e-8 * length
        assert np.abs(moved_forces - forces).max() < 1e-6 * np.abs(forces).max()
