"""Rods that are drawn within touching distance of each other or of a floor start at rest, however stiff they are.

Contact has a force within its tolerance of touching; nothing presses what a scene draws there but what it weighs.
"""

import numpy as np
import pytest

import withe

RADIUS, LENGTH, DENSITY, GRAVITY = 5e-3, 0.3, 1200.0, 9.81
WEIGHT = DENSITY * np.pi * RADIUS**2 * LENGTH * GRAVITY
MODULI = [1e5, 1e7, 1e9, 2e11]
GAPS = [-0.03, 0.0, 0.01, 0.03, 0.06, 0.09]  # over the radius
SCHEMES = ["backward_euler", "implicit_midpoint", "energy_momentum", "verlet"]


def material(modulus):
    return withe.Material(youngs_modulus=modulus, poisson_ratio=0.3, density=DENSITY)


def pile(modulus, gap, turn, gravity=GRAVITY, floor=True):
    """One rod upon another, turned against it, on a floor."""
    scene = withe.Scene(gravity=(0, 0, -gravity))
    height, rods = RADIUS * (1.0 + gap), []
    for angle in (0.0, turn):
        half = 0.5 * LENGTH * np.array([np.cos(angle), np.sin(angle), 0.0])
        middle = np.array([0.0, 0.0, height])
        rods.append(
            scene.add_rod(start=middle - half, end=middle + half, nodes=21, radius=RADIUS, material=material(modulus))
        )
        height += RADIUS * (2.0 + gap)
    if floor:
        scene.add_floor()
    scene.enable_contact()
    return scene, rods


def heights(simulation, rods):
    return np.array([simulation.positions(rod)[:, 2].mean() for rod in rods])


@pytest.mark.parametrize("modulus", MODULI)
@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("turn", [0.0, 0.3, 1.5])
def test_a_pile_that_is_drawn_touching_is_not_pressed_apart(modulus, gap, turn):
    """It was by 27 N, for a weight of 0.28."""
    scene, rods = pile(modulus, gap, turn)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    assert simulation.contacts()["normal_force"].sum() <= 3.0 * WEIGHT
    drawn = heights(simulation, rods)
    for _ in range(40):
        simulation.step()
        assert (heights(simulation, rods) <= drawn + 2e-3 * RADIUS).all()


@pytest.mark.parametrize("modulus", MODULI)
@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rod_that_is_drawn_on_a_floor_stays_there(modulus, gap, scheme):
    scene = withe.Scene()
    height = RADIUS * (1.0 + gap)
    rod = scene.add_rod(
        start=(0, 0, height), end=(LENGTH, 0, height), nodes=21, radius=RADIUS, material=material(modulus)
    )
    scene.add_floor(friction=0.3)
    step = 1e-3 if scheme != "verlet" else 0.2 * LENGTH / 20 / np.sqrt(modulus / DENSITY)
    simulation = scene.build(integrator=scheme, time_step=min(step, 1e-3))
    assert simulation.contacts()["normal_force"].sum() <= 1.03 * WEIGHT
    fastest, fallen = 0.0, RADIUS * (max(gap, 0.0) + 0.05)
    for _ in range(60):
        simulation.step()
        fastest = max(fastest, np.abs(simulation.velocities(rod)).max())
        assert heights(simulation, [rod]) <= height + 2e-3 * RADIUS
    assert fastest <= np.sqrt(2.0 * GRAVITY * fallen)


@pytest.mark.parametrize("modulus", MODULI)
@pytest.mark.parametrize("turn", [0.0, 1.5])
def test_rods_that_are_drawn_touching_without_gravity_stay(modulus, turn):
    """The remaining force, a millionth, is far below the forces that bend the rods."""
    scene, rods = pile(modulus, 0.0, turn, gravity=0.0, floor=False)
    simulation = scene.build(integrator="implicit_midpoint", time_step=1e-3)
    drawn = heights(simulation, rods)
    stiff = modulus * np.pi * RADIUS**4 / 4 / (100 * RADIUS) ** 2  # EI / L^2 [N]
    contacts = simulation.contacts()
    assert contacts["normal_force"].max() <= 1.01e-6 * stiff
    simulation.step(20)
    share = np.abs(heights(simulation, rods) - drawn).max() / RADIUS
    mass = DENSITY * np.pi * RADIUS**2 * LENGTH
    assert share * RADIUS <= 1e-6 * stiff * len(contacts) / mass * 0.02**2


@pytest.mark.parametrize("gap", GAPS)
def test_what_contact_stores_as_a_scene_is_drawn_is_in_its_books(gap):
    scene, _ = pile(1e9, gap, 0.3)
    simulation = scene.build(integrator="energy_momentum", time_step=1e-3)
    drawn = simulation.energy().total
    scale = WEIGHT * RADIUS
    for _ in range(30):
        simulation.step()
        energy = simulation.energy()
        assert energy.total + energy.dissipated == pytest.approx(drawn, abs=1e-7 * scale)


def test_a_contact_whose_stiffness_is_given_keeps_its_law():
    scene, _ = pile(1e9, 0.0, 1.5)
    scene.enable_contact(stiffness=1e4)
    force = scene.build(time_step=1e-3).contacts()["normal_force"]
    expected = 2e4 * (np.log(2.0) / 15.0 * 0.1 * RADIUS) * 0.5
    assert force.max() == pytest.approx(expected, rel=1e-3)


def kinked(fresh, dip=0.0):
    """A rod that lies on a plane up to a kink and rises from there at up to 80 degrees, turned in space with it."""
    nodes, length, radius = int(fresh.integers(7, 60)), fresh.uniform(0.2, 2.0), fresh.uniform(1e-3, 5e-3)
    rise, corner = fresh.uniform(0.1, 1.4), int(fresh.integers(2, nodes - 2))
    along = np.linspace(0.0, length, nodes)
    beyond = np.maximum(along - along[corner], 0.0)
    points = np.stack(
        [along - (1.0 - np.cos(rise)) * beyond, 0.0 * along, radius - dip * radius + np.sin(rise) * beyond]
    )
    axes = np.linalg.qr(fresh.normal(size=(3, 3)))[0]
    weight = 1000.0 * np.pi * radius**2 * 9.81
    scene = withe.Scene(gravity=-9.81 * axes[:, 2])
    scene.add_rod(points=points.T @ axes.T, radius=radius, material=material(10.0 ** fresh.uniform(6, 9)), name="rope")
    scene.add_plane(point=(0, 0, 0), normal=axes[:, 2])
    return scene, weight * length, radius


@pytest.mark.parametrize("seed", range(12))
def test_a_rod_that_is_drawn_kinked_on_a_plane_begins_at_rest(seed):
    """Its curve swings below the corner of its edges, where nothing presses; its edges touch and do not overlap."""
    scene, weight, radius = kinked(np.random.default_rng(seed))
    simulation = scene.build(time_step=1e-3)
    assert simulation.contacts()["normal_force"].sum() < 1.5 * weight
    before = simulation.energy()
    assert before.contact < 0.01 * weight * radius
    simulation.step(20)
    after = simulation.energy()
    gained = after.total + after.dissipated - before.total - before.dissipated
    assert gained < 1e-3 * weight * 0.5 * 9.81 * simulation.time**2


@pytest.mark.parametrize("seed", range(12))
def test_a_kinked_rod_whose_edges_overlap_a_plane_is_refused(seed):
    fresh = np.random.default_rng(seed)
    dip = fresh.uniform(0.05, 0.5)
    scene, _, radius = kinked(fresh, dip)
    with pytest.raises(ValueError, match="of rod 'rope' and 'plane 1' overlap by") as refused:
        scene.build(time_step=1e-3)
    assert float(str(refused.value).split("overlap by ")[1].split()[0]) == pytest.approx(dip * radius, rel=1e-2)
