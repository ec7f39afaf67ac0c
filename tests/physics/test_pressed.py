"""Contact between parts that cannot yield, and reactions of supports and floors."""

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
STIFF = withe.Material(youngs_modulus=1e10, density=1000.0)
RADIUS = 5e-3
WEIGHT = 1200.0 * np.pi * RADIUS**2 * 0.3 * 9.81
SCHEMES = ["static", "backward_euler", "implicit_midpoint", "energy_momentum"]


def lying(material=RUBBER, height=RADIUS, held=True, contact=None, **options):
    scene = withe.Scene()
    rod = scene.add_rod(
        start=(0, 0, height), end=(0.3, 0, height), nodes=31, radius=RADIUS, material=material, name="rod"
    )
    if held:
        scene.clamp(rod.start, name="hand")
    scene.add_floor(name="floor")
    if contact is not None:
        scene.enable_contact(**contact)
    return scene.build(**options)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("share", [0.06, 0.3, 0.9])
def test_a_held_node_that_is_moved_into_a_floor_is_an_error_that_names_both(scheme, share):
    simulation = lying(integrator=scheme, time_step=1e-3)
    simulation.move("hand", position=(0, 0, (1.0 - share) * RADIUS), over=0.02)
    message = r"rod 'rod' is pressed .* into 'floor'.*: support and obstacle are both rigid"
    with pytest.raises(withe.ConvergenceError, match=message) as error:
        simulation.step(30)
    assert (error.value.rod, error.value.node) == ("rod", 0)
    assert np.isfinite(simulation.positions()).all()
    # At once: in the step in which 4 % of the radius are passed; and the rest of the rod knows nothing of it.
    assert simulation.get("hand", "position")[2] >= 0.95 * RADIUS
    assert np.abs(simulation.velocities()).max() < 2.0
    assert np.linalg.norm(simulation.reaction("hand").force) < 1e3 * WEIGHT


@pytest.mark.parametrize("share", [0.005, 0.01, 0.02, 0.03, 0.039])
def test_a_held_node_that_presses_by_less_stays_so_without_end(share):
    simulation = lying(integrator="backward_euler", time_step=2e-3)
    simulation.move("hand", position=(0, 0, (1.0 - share) * RADIUS), over=0.02)
    forces = []
    for _ in range(4):
        simulation.run(duration=0.25, progress=False)
        forces.append(np.linalg.norm(simulation.reaction("hand").force))
    assert max(forces) < 1e2 * WEIGHT
    assert forces[-1] <= 1.01 * forces[-2]


def test_a_floor_that_is_moved_into_a_held_node_is_the_same_error():
    simulation = lying(integrator="backward_euler", time_step=1e-3)
    simulation.move("floor", position=(0, 0, 0.3 * RADIUS), over=0.02)
    with pytest.raises(withe.ConvergenceError, match=r"rod 'rod' is pressed .* into 'floor'"):
        simulation.run(duration=0.03, progress=False)


@pytest.mark.parametrize("last", [1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_a_reaction_after_a_short_last_step_is_the_mass_times_the_acceleration_of_the_path(last):
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(0, 0, 0), end=(0.05, 0, 0), nodes=6, radius=RADIUS, material=RUBBER, name="rod")
    scene.clamp(rod.start, name="hand")
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.move("hand", path=lambda t: (0, 0, 0.01 * t**2))
    simulation.run(duration=0.5, progress=False)
    expected = 1200.0 * np.pi * RADIUS**2 * 0.05 * 0.02
    assert simulation.reaction("hand").force[2] == pytest.approx(expected, rel=1e-3)
    simulation.run(duration=last, progress=False)
    # The rod shakes; it was 200 times too great.
    assert simulation.reaction("hand").force[2] == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("height", [1.0, 1.04, 1.2])
@pytest.mark.parametrize("modulus", [1e6, 1e9])
def test_statics_take_a_balanced_cable_on_a_floor_as_balanced(modulus, height, friction):
    material = withe.Material(youngs_modulus=modulus, poisson_ratio=0.3, density=1200.0)
    scene = withe.Scene()
    scene.add_rod(
        start=(0, 0, height * RADIUS), end=(0.5, 0.1, height * RADIUS), nodes=51, radius=RADIUS, material=material
    )
    scene.add_floor(friction=friction)
    scene.enable_contact(friction=friction)
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.run(duration=0.3, progress=False)
    for _ in range(3):
        found = simulation.equilibrium()
        assert found.residual < 1e-6
    contacts = simulation.contacts()
    weight = 1200.0 * np.pi * RADIUS**2 * np.hypot(0.5, 0.1) * 9.81
    assert contacts["normal_force"].sum() == pytest.approx(weight, rel=1e-6)


def between(plate, scheme="backward_euler", friction=0.0, **options):
    """A rod on a floor, under a plate that is moved down to `plate` radii."""
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, RADIUS), end=(0.3, 0, RADIUS), nodes=31, radius=RADIUS, material=RUBBER, name="rod")
    scene.add_floor(name="floor", friction=friction)
    scene.add_plane((0, 0, 2.2 * RADIUS), (0, 0, -1), name="plate", friction=friction)
    simulation = scene.build(integrator=scheme, time_step=1e-3, **options)
    simulation.move("plate", position=(0, 0, plate * RADIUS), over=0.02)
    return simulation


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("plate", [0.5, 1.7, 1.9])
def test_a_rod_between_obstacles_that_leave_it_no_room_is_an_error_that_names_all(scheme, friction, plate):
    simulation = between(plate, scheme, friction)
    message = r"rod 'rod' is squeezed between '(floor|plate)' and '(floor|plate)'.* both are rigid"
    with pytest.raises(withe.ConvergenceError, match=message) as error:
        simulation.step(30)
    assert error.value.rod == "rod"
    assert np.isfinite(simulation.positions()).all()
    assert simulation.get("plate", "position")[2] >= 1.9 * RADIUS


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rod_that_obstacles_squeeze_by_less_stays_so(scheme):
    simulation = between(1.97, scheme)
    simulation.step(60)
    contacts = simulation.contacts()
    up = contacts["normal"][:, 2] > 0.0
    pressed = contacts["normal_force"][~up].sum()
    assert pressed > WEIGHT
    assert contacts["normal_force"][up].sum() == pytest.approx(pressed + WEIGHT, rel=1e-2)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(6))
def test_an_equilibrium_on_a_drum_or_a_rod_is_one(seed, friction):
    """However stiff contact becomes on the way down: it bears what the clamp does not, and nothing moves on."""
    drawn = np.random.default_rng(seed)
    nodes, place, size = int(drawn.integers(15, 45)), drawn.uniform(0.15, 0.24), drawn.uniform(0.03, 0.1)
    material = withe.Material(youngs_modulus=10 ** drawn.uniform(5.7, 6.5), poisson_ratio=0.4, density=1100.0)
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0.05), end=(0.3, 0.01, 0.05), nodes=nodes, radius=RADIUS, material=material)
    clamp = scene.clamp(rod.start)
    if seed % 2:
        scene.add_capsule((place, -0.1, 0.02 - size), (place, 0.2, 0.02 - size), size, friction=friction)
        scene.enable_contact(friction=friction)
    else:
        other = scene.add_rod(start=(place, -0.1, 0.01), end=(0.22, 0.15, 0.02), nodes=16, radius=4e-3, material=RUBBER)
        scene.enable_contact(friction=friction)
        for end in (other.start, other.end):
            scene.clamp(end)
    simulation = scene.build(integrator="static", planar=False)
    weight = 9.81 * 1100.0 * np.pi * RADIUS**2 * np.hypot(0.3, 0.01)
    found = simulation.equilibrium()
    contacts = simulation.contacts()
    borne = (contacts["normal"] * contacts["normal_force"][:, None] + contacts["friction"])[:, 2].sum()
    left = weight - simulation.reaction(clamp).force[2]
    print("on a drum or a rod:", seed, friction, found.residual, borne / left - 1.0)
    assert found.residual < 1e-9
    assert abs(borne / left - 1.0) < 2e-3
    before = simulation.positions(rod)
    simulation.equilibrium()
    assert np.abs(simulation.positions(rod) - before).max() < 1e-9 * RADIUS


@pytest.mark.parametrize("integrator", ["static", "backward_euler", "implicit_midpoint"])
@pytest.mark.parametrize("modulus", [1e6, 1e7])
def test_surfaces_are_no_deeper_in_an_equilibrium_than_it_promises(integrator, modulus):
    """The depth that yielded while a clamp pushed a short rod into a wall presses again, up to 2 % of the radius."""
    scene = withe.Scene(gravity=(0, 0, 0))
    material = withe.Material(youngs_modulus=modulus, poisson_ratio=0.4, density=1100.0, viscosity=1e-3 * modulus)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.02, 0, 0), nodes=5, radius=RADIUS, material=material)
    clamp = scene.clamp(rod.start)
    scene.add_plane((0.02 + RADIUS, 0, 0), (-1, 0, 0))
    simulation = scene.build(integrator=integrator, time_step=2e-3)
    simulation.move(clamp, position=(5e-4, 0, 0), over=0.1)
    simulation.run(duration=0.4, progress=False)
    found = simulation.equilibrium()
    contact = simulation.contacts()[0]
    assert found.residual < 1e-9
    assert -0.0601 * RADIUS < contact["gap"] < 0.0
    assert np.linalg.norm(simulation.reaction(clamp).force) == pytest.approx(contact["normal_force"], rel=1e-9)


def test_an_arc_onto_a_floor_goes_on_in_balance():
    """Yielding of contact under a growing load must not end the path."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0.04), end=(0.3, 0, 0.04), nodes=31, radius=4e-3, material=rubber)
    clamp = scene.clamp(arm.start)
    load = scene.add_force(arm.end, (0, 0, -0.05))
    scene.add_floor()
    simulation = scene.build(integrator="static")
    path = simulation.equilibrium(path="arc_length", load=load)
    assert path.finished
    borne = simulation.reaction(clamp).force[2] + simulation.contacts()["normal_force"].sum()
    assert borne == pytest.approx(0.05, rel=1e-3)
    before = simulation.positions(arm)
    simulation.equilibrium()
    assert np.abs(simulation.positions(arm) - before).max() < 0.05 * 4e-3


class Carried:
    """A soft rod across a stiff, smooth bar with edges of 20 mm, pressed by 3 mm and carried along by its ends."""

    def __init__(self, at, **contact):
        scene = withe.Scene(gravity=(0, 0, 0))
        soft = withe.Material(youngs_modulus=1e6, density=1000.0)
        bar = scene.add_rod(start=(0, 0, 0), end=(0.5, 0, 0), nodes=26, radius=0.01, material=STIFF)
        rod = scene.add_rod(start=(at, -0.2, 0.0201), end=(at, 0.2, 0.0201), nodes=21, radius=0.01, material=soft)
        scene.enable_contact(friction=0.0, **contact)
        for end in (bar.start, bar.end):
            scene.clamp(end)
        self.ends = scene.clamp(rod.start), scene.clamp(rod.end)
        self.simulation = scene.build()

    def force(self, at):
        """On the ends in an equilibrium."""
        for end, y in zip(self.ends, (-0.2, 0.2), strict=True):
            self.simulation.move(end, position=(at, y, 0.0201 - 3e-3))
        self.simulation.equilibrium()
        return sum(self.simulation.reaction(end).force for end in self.ends)


@pytest.mark.parametrize("contact", [{}, {"model": "barrier"}, {"stiffness": 1e4}], ids=["rule", "barrier", "given"])
def test_a_smooth_bar_does_not_hold_what_is_carried_along_it_from_edge_to_edge(contact):
    """Neighbouring edges press twice beside their node, which pushes either way by 1.6 % of what presses, and is none
    on the mean; contact that changes as it is handed on would hold like friction."""
    places = np.linspace(0.23, 0.27, 41)
    carried = Carried(0.23, **contact)
    there = np.array([carried.force(at) for at in places])
    carried = Carried(0.27, **contact)
    back = np.array([carried.force(at) for at in places[::-1]])[::-1]
    np.testing.assert_allclose(back, there, atol=1e-6 * np.abs(there).max())
    held = there[:, 0] / np.abs(there[:, 2])
    assert np.abs(held).max() < 0.02
    assert abs(held.mean()) < 2e-4


@pytest.mark.parametrize("press", [3e-3, 1e-2, 3e-2])
@pytest.mark.parametrize("at", [0.2037, 0.205, 0.3561])
def test_what_is_pressed_onto_a_smooth_bar_stays_within_the_edges_next_to_it(press, at):
    scene = withe.Scene(gravity=(0, 0, 0))
    soft = withe.Material(youngs_modulus=1e6, density=1000.0)
    bar = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=101, radius=0.01, material=STIFF)
    rod = scene.add_rod(start=(at, -0.2, 0.0201), end=(at, 0.2, 0.0201), nodes=21, radius=0.01, material=soft)
    scene.enable_contact(friction=0.0)
    for node in range(5, 100, 5):
        scene.pin(bar.node(node))
    for end in (bar.start, bar.end):
        scene.clamp(end)
    ends = [scene.clamp(end, free=(1, 0, 0)) for end in (rod.start, rod.end)]
    simulation = scene.build()
    for end, y in zip(ends, (-0.2, 0.2), strict=True):
        simulation.move(end, position=(at, y, 0.0201 - press))
    simulation.equilibrium()
    assert np.abs(simulation.positions(rod)[:, 0] - at).max() < 0.015


def crossing(friction, integrator, stiffness=None):
    """A soft rod on pins lies across another, and is pressed down at its ends by a load of its own."""
    scene = withe.Scene()
    soft = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1200.0, viscosity=2e3)
    below = scene.add_rod(start=(-0.1, 0, 0), end=(0.1, 0, 0), nodes=21, radius=4e-3, material=soft)
    above = scene.add_rod(start=(0, -0.1, 8.16e-3), end=(0, 0.1, 8.16e-3), nodes=21, radius=4e-3, material=soft)
    for end in (below.start, below.end):
        scene.clamp(end)
    for end in (above.start, above.end):
        scene.pin(end, free=(0, 0, 1))
        scene.add_force(end, (0, 0, 0))
    scene.enable_contact(friction=friction, stiffness=stiffness)
    return scene.build(integrator=integrator, time_step=5e-3)


def press(simulation, force):
    for load in ("force 1", "force 2"):
        simulation.set(load, force=(0, 0, -0.5 * force))
    simulation.equilibrium()
    return simulation.contacts()["gap"].min()


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("force", [0.01, 0.3])
def test_an_equilibrium_with_contact_is_one_for_steps_too_and_stays_where_it_is(friction, integrator, force):
    simulation = crossing(friction, integrator)
    press(simulation, force)
    before = simulation.positions()
    for _ in range(2):
        simulation.step(40)
        np.testing.assert_allclose(simulation.positions(), before, atol=1e-12)
        simulation.equilibrium()
        np.testing.assert_allclose(simulation.positions(), before, atol=1e-12)


@pytest.mark.parametrize("stiffness", [None, 20.0, 50.0, 200.0])
def test_however_soft_contact_begins_surfaces_are_not_deep_in_each_other_at_rest(stiffness):
    """A stiffness that is given grows where it is too small; what has been pressed comes back with the load."""
    simulation = crossing(0.0, "static", stiffness)
    gaps = [press(simulation, force) for force in (5e-3, 0.02, 0.05, 0.1, 0.2, 0.5, 0.2, 0.05, 5e-3)]
    assert min(gaps) > -0.045 * 4e-3
    assert np.all(np.diff(gaps[5:]) > 0.0)
    at_once = crossing(0.0, "static", stiffness)
    assert press(at_once, 0.5) == pytest.approx(gaps[5], abs=0.03 * 4e-3)
