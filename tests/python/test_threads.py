"""`build(threads=)`: several threads share the work of a step, and change no bit of it."""

import os
import pickle

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
CORDS = 17  # large enough that the engine divides the matrix


def _net() -> withe.Scene:
    """A square net of cords, pinned at each crossing, that hangs from its border."""
    scene = withe.Scene()
    length, edges = 0.05 * (CORDS + 1), 2 * (CORDS + 1)
    lines = 0.05 * np.arange(1, CORDS + 1)
    along = [
        scene.add_rod(start=(0, y, 0), end=(length, y, 0), nodes=edges + 1, radius=2e-3, material=RUBBER) for y in lines
    ]
    across = [
        scene.add_rod(start=(x, 0, 0), end=(x, length, 0), nodes=edges + 1, radius=2e-3, material=RUBBER) for x in lines
    ]
    for i, a in enumerate(along):
        for j, b in enumerate(across):
            scene.join(a.node(2 * (j + 1)), b.node(2 * (i + 1)), kind="pinned")
    for cord in (*along, *across):
        scene.pin(cord.start)
        scene.pin(cord.end)
    return scene


def _pile() -> withe.Scene:
    """Three layers of rods that fall on a floor and on each other."""
    scene = withe.Scene()
    random = np.random.default_rng(1)
    for i in range(60):
        layer, place = divmod(i, 20)
        across = np.array([0.02 * (place - 9.5), 0.0]) + 2e-3 * random.random(2)
        ends = np.array([[0.0, -0.25], [0.0, 0.25]]) + across
        flat = ends if layer % 2 == 0 else ends[:, ::-1]
        points = np.column_stack([flat, np.full(2, 5.1e-3 + 0.011 * layer)])
        scene.add_rod(start=points[0], end=points[1], nodes=16, radius=5e-3, material=RUBBER)
    scene.add_floor(friction=0.3)
    scene.enable_contact(friction=0.3)
    return scene


@pytest.mark.parametrize(
    ("describe", "integrator", "steps"),
    [(_net, "energy_momentum", 4), (_net, "backward_euler", 4), (_pile, "backward_euler", 8)],
)
def test_every_number_of_threads_gives_the_same_bits(describe, integrator, steps):
    """Positions and velocities agree bit for bit."""
    scene = describe()
    found = []
    for threads in (1, 2, 3, 4):
        simulation = scene.build(integrator=integrator, time_step=2e-3, threads=threads)
        assert simulation.plan.unknowns > 2000
        simulation.step(steps)
        found.append((simulation.positions(), simulation.velocities()))
    assert np.linalg.norm(found[0][1]) > 0.0
    for positions, velocities in found[1:]:
        np.testing.assert_array_equal(positions, found[0][0])
        np.testing.assert_array_equal(velocities, found[0][1])


def test_equilibria_do_not_depend_on_threads():
    """Equilibria agree bit for bit."""
    shapes = []
    for threads in (1, 2):
        simulation = _net().build(threads=threads)
        assert simulation.equilibrium().stable
        shapes.append(simulation.positions())
    np.testing.assert_array_equal(shapes[1], shapes[0])


def test_copies_and_pickles_go_on_with_the_same_bits():
    """A copy has threads of its own."""
    simulation = _net().build(threads=2, time_step=2e-3)
    simulation.step(2)
    others = [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    simulation.step(2)
    for other in others:
        other.step(2)
        np.testing.assert_array_equal(other.positions(), simulation.positions())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_has_threads_of_its_own():
    """The threads of the parent do not exist in the child, which steps on nevertheless."""
    simulation = _net().build(threads=2, time_step=2e-3)
    simulation.step()
    ours, theirs = os.pipe()
    child = os.fork()
    if child == 0:
        simulation.step()
        os.write(theirs, simulation.positions().tobytes())
        os._exit(0)
    os.close(theirs)
    with os.fdopen(ours, "rb") as sent:
        found = np.frombuffer(sent.read())
    os.waitpid(child, 0)
    simulation.step()
    np.testing.assert_array_equal(found, simulation.positions().ravel())


def test_small_scenes_accept_threads():
    """A single rod has a band matrix, which one thread factorises."""
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=21, radius=0.01, material=RUBBER)
    scene.clamp(rod.start)
    shapes = []
    for threads in (1, 3):
        simulation = scene.build(threads=threads)
        simulation.step(5)
        shapes.append(simulation.positions())
    np.testing.assert_array_equal(shapes[1], shapes[0])


@pytest.mark.parametrize("threads", [0, -1, 1.5, "two", 257])
def test_threads_must_be_a_positive_integer(threads):
    """The message names the argument."""
    with pytest.raises(ValueError, match="threads"):
        _net().build(threads=threads)


def test_a_batch_refuses_threads():
    """Each simulation of a batch steps on one thread."""
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=5, radius=0.01, material=RUBBER)
    with pytest.raises(ValueError, match=r"threads of build_batch must be 1: workers="):
        scene.build_batch(2, threads=2)
