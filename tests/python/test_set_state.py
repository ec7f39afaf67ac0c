"""States from outside: set_state, and a simulation that goes on from a frame of a record."""

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever


def spiral(nodes, length=0.2):
    s = np.linspace(0.0, length, nodes)
    return np.stack([0.03 * np.sin(20 * s), 0.03 * (1 - np.cos(20 * s)), 0.8 * s], axis=1)


def free_rod(nodes=21, **options):
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(
        start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=2e-3, material=RUBBER, normal=(0, 0, 1), name="rod"
    )
    return rod, scene.build(time_step=1e-3, **options)


def test_positions_twist_velocities_and_spins_read_as_they_were_set():
    rod, simulation = free_rod()
    rng = np.random.default_rng(1)
    twist, spins = rng.uniform(-400, 400, 19), rng.normal(0, 20, 20)
    velocities = rng.normal(0, 0.1, (21, 3))
    simulation.set_state(rod, spiral(21), velocities, twist=twist, spins=spins)
    assert np.allclose(simulation.positions(rod), spiral(21), rtol=0, atol=1e-15)
    assert np.allclose(simulation.velocities(rod), velocities)
    assert np.allclose(simulation.twists(rod), twist)  # up to 4 rad a stencil: more than half a turn is kept
    assert np.allclose(simulation.spins(rod), spins)
    frames = simulation.directors(rod)
    assert np.allclose(frames @ frames.transpose(0, 2, 1), np.eye(3), atol=1e-14)


def test_positions_alone_keep_the_twist_and_directors_alone_fix_it():
    rod, simulation = free_rod()
    simulation.set_state(rod, twist=30.0)
    simulation.set_state(rod, spiral(21))
    assert np.allclose(simulation.twists(rod), 30.0)
    frames = simulation.directors(rod)
    other_rod, other = free_rod()
    other.set_state(other_rod, spiral(21), directors=frames)
    assert np.allclose(other.twists(other_rod), 30.0)
    assert np.allclose(other.curvatures(other_rod), simulation.curvatures(rod))
    assert np.allclose(other.directors(other_rod), frames)


def test_what_is_not_given_stays_to_the_bit():
    rod, simulation = free_rod(planar=False)
    simulation.set_state(rod, spiral(21), np.ones((21, 3)), twist=10.0, spins=3.0)
    before = [simulation.positions(), simulation.directors(rod), simulation.twists(rod), simulation.velocities()]
    simulation.set_state(rod, spins=5.0)
    after = [simulation.positions(), simulation.directors(rod), simulation.twists(rod), simulation.velocities()]
    for a, b in zip(before, after, strict=True):
        assert np.array_equal(a, b)
    assert np.array_equal(simulation.spins(rod), np.full(20, 5.0))


def test_a_rod_that_spins_about_its_axis_goes_on_spinning_with_its_energy():
    rod, simulation = free_rod()
    simulation.set_state(rod, spins=30.0)
    kinetic = simulation.energy().kinetic
    radius = 2e-3
    expected = 0.5 * RUBBER.density * np.pi * radius**4 / 2 * 0.2 * 30.0**2
    assert kinetic == pytest.approx(expected, rel=1e-12)
    simulation.step(50)
    assert np.allclose(simulation.spins(rod), 30.0, rtol=1e-9)
    turned = simulation.directors(rod)[0, 0]
    # 1.5 rad about x, from z; energy-momentum steps turn by 2 atan(w dt / 2), w dt (1 - (w dt)^2 / 12) in each.
    angle = 50 * 2.0 * np.arctan(0.5 * 30.0 * 1e-3)
    assert angle == pytest.approx(1.5, rel=0.03**2 / 11.0)
    assert np.allclose(turned, (0, -np.sin(angle), np.cos(angle)), atol=1e-9)


def test_a_rigid_motion_that_is_set_stays_rigid():
    rod, simulation = free_rod(integrator="energy_momentum", planar=False)
    omega = np.array([0.5, 1.0, 3.0])
    x = simulation.positions()
    tangents = simulation.directors(rod)[:, 2]
    simulation.set_state(rod, velocities=np.cross(omega, x), spins=tangents @ omega)
    simulation.step(50)
    assert np.abs(simulation.tensions(rod)).max() < 1e-3
    assert np.abs(simulation.curvatures(rod)).max() < 0.05


@pytest.mark.parametrize("what", ["positions", "velocities", "twist", "spins", "directors"])
def test_what_leaves_the_plane_leaves_it_or_is_refused(what):
    values = {
        "positions": spiral(21),
        "velocities": (0, 1, 0),
        "twist": 1.0,
        "spins": 1.0,
        "directors": np.tile((0, np.sin(0.3), np.cos(0.3)), (20, 1)),
    }[what]

    def build(planar):
        scene = withe.Scene()  # gravity and the rod share a plane
        rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=2e-3, material=RUBBER)
        return rod, scene.build(time_step=1e-3, planar=planar)

    rod, simulation = build(None)
    assert simulation.plan.planar
    simulation.set_state(rod, **{what: values})
    assert not simulation.plan.planar
    simulation.step(3)
    rod, simulation = build(True)
    before = simulation.snapshot()
    with pytest.raises(ValueError, match="leaves the plane"):
        simulation.set_state(rod, **{what: values})
    assert simulation.snapshot() == before


def test_a_planar_state_stays_planar_and_is_that_of_space():
    curve = np.stack([np.linspace(0, 0.19, 21), np.zeros(21), 0.02 * np.cos(np.linspace(0, 4, 21))], axis=1)
    ends = []
    for planar in (True, False):
        scene = withe.Scene()
        rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=2e-3, material=RUBBER)
        simulation = scene.build(time_step=1e-3, planar=planar, adaptive=False)
        simulation.set_state(rod, curve, (0.1, 0, 0.2))
        assert simulation.plan.planar is planar
        simulation.step(20)
        ends.append(simulation.positions())
    assert np.allclose(*ends, rtol=0, atol=1e-9)


def test_a_closed_rod_spreads_what_twist_its_new_shape_cannot_have():
    angles = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = np.stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), np.zeros(40)], axis=1)
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(points=ring, closed=True, radius=2e-3, material=RUBBER)
    simulation = scene.build(time_step=1e-3, planar=False)
    link = simulation.link(rod)
    wavy = ring + np.stack([0 * angles, 0 * angles, 0.03 * np.sin(2 * angles) + 0.02 * np.cos(3 * angles)], axis=1)
    simulation.set_state(rod, wavy)
    assert np.ptp(simulation.twists(rod)) < 1e-9
    assert simulation.link(rod) == pytest.approx(link, abs=1e-9)
    with pytest.raises(ValueError, match="must close the rod"):
        simulation.set_state(rod, ring, twist=1.0)
    length = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).sum()
    simulation.set_state(rod, ring, twist=2 * np.pi / length)
    assert abs(simulation.link(rod)) == pytest.approx(1.0, abs=1e-6)


def test_supports_are_not_moved_and_nothing_changes_where_they_would_be():
    scene, arm, _ = cantilever()
    simulation = scene.build()
    before = simulation.snapshot()
    with pytest.raises(ValueError, match=r"support holds, but do by 0\.1 m at node 0 of rod 'arm'"):
        simulation.set_state(arm, simulation.positions(arm) + np.array([0, 0, 0.1]))
    assert simulation.snapshot() == before
    bent = simulation.positions(arm)
    bent[1:, 2] += 0.1 * (bent[1:, 0] - bent[0, 0])
    simulation.set_state(arm, bent, np.ones((len(bent), 3)) * (0.1, 0, 0))
    assert np.array_equal(simulation.velocities(arm)[0], (0.1, 0, 0))
    simulation.step(5)
    assert np.array_equal(simulation.velocities(arm)[0], (0, 0, 0))
    assert simulation.positions(arm)[0] == pytest.approx(bent[0], abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"positions": np.zeros((21, 3))}, "edge zero length"),
        ({"positions": np.zeros((20, 3))}, "shape"),
        ({"directors": np.tile((1.0, 0, 0), (20, 1))}, "normal to their edges"),
        ({"directors": np.tile((0, 0, 1.0), (20, 1)), "twist": 0.0}, "together"),
        ({"spins": np.nan}, "finite"),
        ({"twist": np.zeros(20)}, "shape"),
    ],
)
def test_bad_states_are_refused(arguments, message):
    rod, simulation = free_rod()
    before = simulation.snapshot()
    with pytest.raises(ValueError, match=message):
        simulation.set_state(rod, **arguments)
    assert simulation.snapshot() == before


def test_surfaces_may_not_overlap_after_it():
    scene = withe.Scene(gravity=(0, 0, 0))
    rods = [scene.add_rod(start=(0, y, 0), end=(0.2, y, 0), nodes=11, radius=2e-3, material=RUBBER) for y in (0, 0.05)]
    scene.enable_contact()
    simulation = scene.build()
    with pytest.raises(ValueError, match="overlap"):
        simulation.set_state(rods[1], simulation.positions(rods[0]) + np.array([0, 1e-3, 0]))
    simulation.set_state(rods[1], simulation.positions(rods[0]) + np.array([0, 4.2e-3, 0]))
    simulation.step(5)


@pytest.mark.parametrize("kind", ["rigid", "pinned", "revolute"])
def test_joints_turn_with_the_rods_at_them(kind):
    """A chain that is turned as a whole, and bent at its hinge, is as free of stress as it was drawn."""
    scene = withe.Scene(gravity=(0, 0, 0))
    a = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=11, radius=2e-3, material=RUBBER, name="a")
    b = scene.add_rod(start=(0.1, 0, 0), end=(0.1, 0.1, 0), nodes=11, radius=2e-3, material=RUBBER, name="b")
    scene.join(a.end, b.start, kind=kind, **({"axis": (0, 0, 1)} if kind == "revolute" else {}))
    simulation = scene.build(planar=False)
    drawn = {rod: (simulation.positions(rod), simulation.directors(rod)) for rod in (a, b)}
    turn = rotation((1.0, 2.0, -0.5), 1.9)
    fold = rotation((0, 0, 1), 0.7 if kind == "revolute" else 0.0)
    for rod in (a, b):
        points, frames = drawn[rod]
        own = turn @ fold if rod is b else turn
        moved = (points - (0.1, 0, 0)) @ own.T
        simulation.set_state(rod, moved, directors=frames @ own.T)
    energy = simulation.energy()
    assert energy.bend + energy.twist < 1e-12


def rotation(axis, angle):
    axis = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def test_a_simulation_goes_on_from_a_frame_of_a_record(tmp_path):
    """Released from rest at the end of a run with twist, spin and a joint: as the run would have gone on."""
    scene, arm, _ = cantilever()
    scene.add_moment(arm.end, (2e-4, 1e-4, 0))
    simulation = scene.build(time_step=1e-3, planar=False)
    record = simulation.run(0.1, 0.02, progress=False)
    record = withe.Record.load(record.save(tmp_path / "record.npz"))
    other = scene.build(time_step=1e-3, planar=False)
    other.restore(record)
    assert other.time == pytest.approx(simulation.time)
    for readout in ("positions", "velocities", "directors", "twists", "curvatures", "spins"):
        # The wall's half stencil is found anew; all else to the last digits.
        scale = np.abs(getattr(simulation, readout)(arm)).max()
        assert np.allclose(getattr(other, readout)(arm), getattr(simulation, readout)(arm), rtol=0, atol=1e-9 * scale)
    simulation.step(50)
    other.step(50)
    assert np.allclose(other.positions(arm), simulation.positions(arm), rtol=0, atol=1e-5)
    # Tensions belong to the step, which a frame of a record does not contain.
    pull = simulation.tensions(arm)
    assert np.allclose(other.tensions(arm), pull, rtol=0, atol=1e-3 * np.abs(pull).max())
    other.restore(record, frame=2)
    assert other.time == pytest.approx(0.04)
    assert np.allclose(other.positions(), record.positions()[2], rtol=0, atol=1e-15)


def test_a_record_of_another_scene_or_frame_is_refused():
    scene, _, _ = cantilever()
    record = scene.build().run(0.05, progress=False)
    _, other = free_rod()
    with pytest.raises(ValueError, match="another scene"):
        other.restore(record)
    simulation = scene.build()
    with pytest.raises(ValueError, match="frame"):
        simulation.restore(record, frame=1000)


@pytest.mark.parametrize("how", ["spins", "velocities", "positions", "set_velocities"])
def test_what_is_held_goes_on_with_a_support_that_moves(how):
    way = np.array([1.0, 0.0, 0.0])
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.2), nodes=11, radius=4e-3, material=rubber)
    wall = scene.clamp(rod.start)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocities(None, way)
    simulation.move(wall, path=lambda time: time * way)
    simulation.step(5)
    if how == "set_velocities":
        simulation.set_velocities(rod, way)
    else:
        value = {"spins": 0.0, "velocities": way, "positions": simulation.positions(rod)}[how]
        simulation.set_state(rod, **{how: value})
    np.testing.assert_allclose(simulation.velocities(rod)[0], way, atol=1e-9)


@pytest.mark.parametrize("held", ["pin", "clamp", "edge", "free"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_support_that_was_moved_is_where_its_rod_is_placed(held, planar):
    """A state that fits where supports are to be at once is taken as well as one where they are."""
    for seed in range(4):
        generator = np.random.default_rng([seed, len(held)])
        scene = withe.Scene(gravity=(0, 0, -1e-6))
        rod = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=21, radius=5e-3, material=RUBBER)
        scene.clamp(rod.start)
        if held == "pin":
            end = scene.pin(rod.end)
        elif held == "free":
            end = scene.clamp(rod.end, free=(1, 0, 0))
        else:
            end = scene.clamp(rod.end, hold="edge" if held == "edge" else "frame")
        simulation = scene.build(time_step=1e-3, planar=planar)
        shift = generator.uniform(-0.1, 0.1, 3) * (1, 0 if planar else 1, 1)
        share = np.linspace(0.0, 1.0, 21)[:, None]
        positions = np.array([1.0, 0, 0]) * share + shift * share
        positions[[0, 1]] = [(0, 0, 0), (0.05, 0, 0)]
        positions[[-2, -1]] = np.array([(0.95, 0, 0), (1, 0, 0)]) + shift
        with pytest.raises(ValueError, match="move the support there first"):
            simulation.set_state(rod, positions=positions)
        simulation.move(end, position=np.array([1.0, 0, 0]) + shift)
        simulation.set_state(rod, positions=positions)
        assert np.allclose(simulation.positions(rod), positions, rtol=0, atol=1e-14)
        simulation.step(2)
        if held != "free":
            assert np.allclose(simulation.positions(rod)[-1], positions[-1], rtol=0, atol=1e-12)


def test_a_support_on_its_way_says_how_it_gets_there():
    _, arm, simulation = cantilever(planar=False)
    place = simulation.positions(arm) + np.array([0.01, 0, 0])
    simulation.move("wall", position=(0.01, 0, 0), over=0.1)
    with pytest.raises(ValueError, match=r"on a ramp \(over=\), so move the support without over="):
        simulation.set_state(arm, positions=place)
    simulation.move("wall", position=(0.01, 0, 0))
    simulation.set_state(arm, positions=place)
    assert np.allclose(simulation.positions(arm), place)
