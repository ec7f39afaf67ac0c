"""Parameters that may change while a simulation runs: natural shape and others."""

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, tripod, weightless

# Natural shape


@pytest.mark.parametrize(("component", "axis"), [(0, 1), (1, 2)])
def test_natural_curvature_bends_towards_its_director(component, axis):
    _, arm, simulation = weightless(integrator="static")
    assert np.allclose(simulation.directors(arm)[0, component], np.eye(3)[axis])
    kappa = np.zeros(2)
    kappa[component] = 2.0
    simulation.set(arm, natural_curvature=kappa)
    simulation.equilibrium()
    tip = simulation.positions(arm)[-1]
    expected = np.array([np.sin(0.4) / 2, 0, 0])
    expected[axis] = (1 - np.cos(0.4)) / 2
    assert np.allclose(tip, expected, atol=1e-5)
    assert np.allclose(simulation.curvatures(arm), kappa, atol=1e-8)
    assert simulation.energy().bend < 1e-15


def test_natural_curvature_is_ramped_over_time():
    _, arm, simulation = weightless(integrator="static", time_step=0.1)
    simulation.set(arm, natural_curvature=(0.0, 3.0), over=1.0)
    assert np.allclose(simulation.get(arm, "natural_curvature"), 0)
    simulation.step(5)
    assert np.allclose(simulation.get(arm, "natural_curvature"), (0, 1.5))
    assert np.allclose(simulation.curvatures(arm), (0, 1.5), atol=1e-7)
    simulation.step(20)
    assert np.allclose(simulation.get(arm, "natural_curvature"), (0, 3))


def test_discrete_natural_curvature_is_the_sources_number():
    _, arm, simulation = weightless()
    simulation.set(arm, discrete_curvature=(0.0, 2 * np.tan(0.05)))
    assert np.allclose(simulation.get(arm, "natural_curvature"), (0, 0.1 / 0.01))


def test_natural_twist_turns_the_tip():
    _, arm, simulation = weightless(integrator="static", planar=False)
    simulation.set(arm, natural_twist=5.0)
    simulation.equilibrium()
    assert np.allclose(simulation.twists(arm), 5.0, atol=1e-8)
    d1 = simulation.directors(arm)[-1, 0]
    assert np.allclose(d1, (0, np.cos(5 * 0.195), np.sin(5 * 0.195)), atol=1e-8)
    rows = np.linspace(0, 1, 19)
    simulation.set(arm, natural_twist=rows)
    assert np.array_equal(simulation.get(arm, "natural_twist"), rows)


def test_a_planar_simulation_leaves_its_plane_when_it_is_actuated_out_of_it():
    _, arm, simulation = cantilever(integrator="static")
    assert simulation.plan.planar
    simulation.equilibrium()
    before = simulation.positions(arm)
    simulation.set(arm, natural_curvature=(3.0, 0.0))
    assert not simulation.plan.planar
    assert np.allclose(simulation.positions(arm), before, atol=1e-14)
    simulation.equilibrium()
    _, _, spatial = cantilever(integrator="static", planar=False)
    spatial.set("arm", natural_curvature=(3.0, 0.0))
    spatial.equilibrium()
    assert abs(simulation.positions(arm)[-1, 1]) > 1e-3
    assert np.allclose(simulation.positions(arm), spatial.positions("arm"), atol=1e-8)


@pytest.mark.parametrize("act", [
    lambda s, arm: s.set(arm, natural_curvature=(3.0, 0.0)),
    lambda s, arm: s.set(arm, natural_twist=1.0),
    lambda s, arm: s.set("tip", force=(0, 1, 0)),
    lambda s, arm: s.set("turn", moment=(0, 0, 1)),
    lambda s, arm: s.set(gravity=(0, 1, 0)),
    lambda s, arm: s.set_velocities(arm, (0, 1, 0)),
    lambda s, arm: s.move("wall", position=(0, 0.01, 0)),
    lambda s, arm: s.pin(arm.end, free=(1, 1, 0)),
])  # fmt: skip
def test_a_simulation_that_was_asked_to_be_planar_refuses_to_leave_its_plane(act):
    scene, arm, _ = cantilever()
    scene.add_force(arm.end, (0, 0, 0), name="tip")
    scene.add_moment(arm.end, (0, 0, 0), name="turn")
    simulation = scene.build(planar=True)
    before = simulation.snapshot()
    with pytest.raises(ValueError, match=r"leaves the plane|out of the plane"):
        act(simulation, arm)
    assert simulation.snapshot() == before


def test_a_straight_scene_can_be_asked_into_the_plane_of_its_first_director():
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    beam = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=11, radius=0.02, material=rubber, normal=(0, 0.6, 0.8))
    scene.clamp(beam.start)
    velocities = np.outer(np.linspace(0, 1, 11) ** 2, (0, 0.6, 0.8))
    motions = []
    for planar in (True, None):
        simulation = scene.build(planar=planar, time_step=0.01)
        assert simulation.plan.planar == (planar is True)
        simulation.set_velocities(beam, velocities)
        simulation.step(20)
        motions.append(simulation.positions())
    assert np.allclose(*motions, atol=1e-9)
    assert np.abs(motions[0] - scene.build().positions()).max() > 0.05
    with pytest.raises(ValueError, match="leaves the plane"):
        scene.build(planar=True).set_velocities(beam, velocities[:, [0, 2, 1]] * (1, 1, -1))


# Parameters


def test_set_and_get_share_their_words():
    scene, arm, _ = cantilever()
    parts = {
        "force": scene.add_force(arm.end, (0, 0, -1)),
        "moment": scene.add_moment(arm.end, (0, 1, 0)),
        "load": scene.add_load(arm, (0, 0, 1)),
        "mass": scene.add_mass(arm.end, 1.0),
        "drag": scene.add_drag(1.0),
    }
    simulation = scene.build()
    for word, handle in parts.items():
        value = 0.5 if word in ("mass", "drag") else (0.0, 0.0, 0.5)
        if word == "moment":
            value = (0.0, 0.5, 0.0)
        simulation.set(handle, **{word: value})
        assert np.array_equal(simulation.get(handle.name, word), value)
    assert np.array_equal(simulation.get(arm, "drag"), np.full(10, 0.5))
    words = {
        "youngs_modulus": 2e6,
        "poisson_ratio": 0.25,
        "density": 500.0,
        "viscosity": 3.0,
        "stretch_stiffness": np.full(10, 3.0),
        "bend_stiffness": np.full((10, 2), 4.0),
        "twist_stiffness": np.arange(1, 11.0),
        "line_density": np.full(10, 5.0),
        "viscous_time": np.full(10, 0.1),
        "drag": np.full(10, 0.7),
        "natural_curvature": np.zeros((9, 2)),
        "natural_twist": np.zeros(9),
    }
    for word, value in words.items():
        simulation.set(arm, **{word: value})
        assert np.array_equal(simulation.get(arm, word), value)
    assert np.array_equal(simulation.get(arm, "radius"), np.full(10, 5e-3))
    simulation.set(gravity=(0, 0, -1))
    assert np.array_equal(simulation.get("gravity"), (0, 0, -1))
    simulation.step(2)


def test_a_changed_material_acts_as_one_that_was_so_from_the_start():
    _scene, arm, simulation = cantilever(integrator="static")
    simulation.set(arm, youngs_modulus=3e6, density=2000.0)
    simulation.equilibrium()
    other = withe.Scene()
    stiff = withe.Material(youngs_modulus=3e6, density=2000.0)
    rod = other.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=stiff)
    other.clamp(rod.start)
    expected = other.build(integrator="static")
    expected.equilibrium()
    assert np.allclose(simulation.positions(), expected.positions(), atol=1e-12)
    assert np.allclose(simulation.get(arm, "bend_stiffness"), expected.get(rod, "bend_stiffness"))
    assert np.allclose(simulation.get(arm, "twist_stiffness"), expected.get(rod, "twist_stiffness"))


def test_a_refused_set_changes_nothing():
    _, arm, simulation = cantilever()
    before = simulation.snapshot()
    with pytest.raises(ValueError, match="density of rod 'arm' must be positive"):
        simulation.set(arm, youngs_modulus=2e6, density=-1.0)
    with pytest.raises(ValueError, match="natural_twist"):
        simulation.set(arm, youngs_modulus=2e6, natural_twist="left")
    assert simulation.get(arm, "youngs_modulus") == 1e6
    assert simulation.snapshot() == before
    _, arm, simulation = cantilever(planar=True)
    before = simulation.snapshot()
    with pytest.raises(ValueError, match="leaves the plane"):
        simulation.set(arm, natural_curvature=(0.0, 1.0), natural_twist=1.0, density=10.0)
    assert simulation.snapshot() == before


def test_viscosity_and_drag_dissipate():
    for word in ("viscosity", "drag"):
        _, arm, simulation = cantilever()
        simulation.set(arm, **{word: 20.0})
        simulation.step(100)
        assert simulation.energy().dissipated > 1e-7
        _, _, free = cantilever()
        free.step(100)
        assert free.energy().dissipated == 0.0


def test_initial_velocities_are_those_of_the_nodes():
    _, arm, simulation = weightless()
    velocities = np.zeros((21, 3))
    velocities[:, 2] = np.linspace(0, 1, 21) ** 2
    simulation.set_velocities(arm, velocities)
    assert np.array_equal(simulation.velocities(arm), velocities)
    assert simulation.energy().kinetic > 0
    simulation.set_velocities(None, (0, 0, 1))
    assert np.array_equal(simulation.velocities(arm), np.tile((0, 0, 1), (21, 1)))
    simulation.step()
    assert np.array_equal(simulation.velocities(arm)[0], (0, 0, 0))  # stopped by its support


# Values that cannot be set


def test_a_joint_that_is_to_be_set_says_how_to_drive_it():
    _, _, simulation = tripod()
    for act in (lambda: simulation.set("joint 1", angle=1.0), lambda: simulation.get("joint 1", "angle")):
        with pytest.raises(
            ValueError, match=r"joint 'joint 1' is rigid and has nothing to set.* scene.add_moment\(limb 0.start, ...\)"
        ):
            act()


def test_moments_at_both_sides_drive_a_revolute_joint():
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=6, radius=4e-3, material=RUBBER)
    hand = scene.add_rod(start=(0.1, 0, 0), end=(0.2, 0, 0), nodes=6, radius=4e-3, material=RUBBER)
    scene.clamp(arm.start)
    scene.join(arm.end, hand.start, kind="revolute", axis=(0, 1, 0))
    motor = scene.add_moment(hand.start, (0, 1e-5, 0)), scene.add_moment(arm.end, (0, -1e-5, 0))
    simulation = scene.build(time_step=1e-3)
    simulation.step(50)
    assert simulation.velocities(hand)[-1, 2] < -0.001
    same = simulation.copy()
    for load, sign in zip(motor, (-1, 1), strict=True):
        simulation.set(load, moment=(0, sign * 1e-5, 0))
    for each in (simulation, same):
        each.step(20)
    assert simulation.velocities(hand)[-1, 2] > same.velocities(hand)[-1, 2] + 0.001


# Meshes too coarse for the motion


def shaft(nodes=11):
    scene, arm, _ = weightless(nodes)
    return arm, scene.build(planar=False)


@pytest.mark.filterwarnings("error::withe.CoarseMeshWarning")
def test_a_natural_twist_that_grows_like_a_motor_does_not_warn():
    arm, simulation = shaft()
    twist = np.zeros(arm.stencils)
    twist[2] = 2 * np.pi * 5 / 0.02
    simulation.set(arm, natural_twist=twist, over=1.0)
    simulation.step(240)
    turned = simulation.directors(arm)
    assert np.abs(simulation.twists(arm)).max() == pytest.approx(twist[2], rel=0.01)
    assert np.isfinite(turned).all()


@pytest.mark.filterwarnings("error::withe.CoarseMeshWarning")
def test_a_free_shaft_that_its_clamp_turns_many_times_does_not_warn():
    arm, simulation = shaft()
    turns = 20
    simulation.move("wall", roll=2 * np.pi * turns, over=1.0)
    simulation.step(240)
    # Start and stop each send a wave of twist w / c along it, c^2 = G / rho [d'Alembert]; dispersion doubles its crest.
    wave = 2 * np.pi * turns * np.sqrt(RUBBER.density / RUBBER.shear_modulus)
    assert np.abs(simulation.twists(arm)).max() < 4.0 * wave
    assert 4.0 * wave < 0.1 * 2 * np.pi * turns / 0.2  # that of a shaft whose end does not follow


@pytest.mark.parametrize(
    ("section", "curvature", "stencils", "warns"),
    [
        (withe.Circle(3e-3), 0.0, slice(None), False),
        (withe.Circle(3e-3), 5.0, slice(None), True),
        (withe.Rectangle(2e-3, 8e-3), 0.0, slice(None), True),
        (withe.Rectangle(2e-3, 8e-3), 5.0, slice(4, 5), False),
    ],
    ids=["round", "curved", "strip", "motor"],
)
def test_natural_twist_warns_where_it_winds_what_bends_unevenly_faster_than_the_mesh(
    section, curvature, stencils, warns, recwarn
):
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, section=section, material=rubber)
    scene.clamp(rod.start)
    simulation = scene.build()
    twist = np.zeros(rod.stencils)
    twist[stencils] = 2.0 * np.pi / 0.01
    simulation.set(rod, natural_curvature=(curvature, 0.0))
    simulation.set(rod, natural_twist=twist)
    simulation.equilibrium()
    said = [str(w.message) for w in recwarn.list if issubclass(w.category, withe.CoarseMeshWarning)]
    assert len(said) == warns
    assert all("is naturally twisted by 360 degrees" in message for message in said)


@pytest.mark.parametrize(
    "advance",
    [
        lambda simulation: simulation.step(70),
        lambda simulation: simulation.run(70 * simulation.time_step, progress=False),
    ],
    ids=["step", "run"],
)
def test_a_shaft_that_is_wound_up_between_two_clamps_warns(advance):
    arm, simulation = shaft(6)
    simulation.clamp(arm.end)
    simulation.move(arm.end, roll=2 * np.pi * 5, over=0.2)
    with pytest.warns(withe.CoarseMeshWarning, match=r"twists by \d+ degrees against the next") as caught:
        advance(simulation)
    assert [warning.filename for warning in caught] == [__file__]  # the line of the user


# Old names

OLD_NAMES = {
    "set_natural_curvature": (("rod", (0.0, 2.0)), {"natural_curvature": (0.0, 2.0)}),
    "set_natural_twist": (("rod", 3.0), {"natural_twist": 3.0}),
    "set_natural_stretch": (("rod", 1.02), {"natural_stretch": 1.02}),
}


@pytest.mark.parametrize("old", OLD_NAMES)
@pytest.mark.parametrize("over", [0.0, 0.02])
def test_old_names_of_set_warn_and_do_the_same(old, over):
    arguments, words = OLD_NAMES[old]
    _, arm, simulation = weightless(planar=False)
    copy = simulation.copy()
    with pytest.warns(DeprecationWarning, match=f"{old} is deprecated"):
        getattr(simulation, old)(arm, *arguments[1:], over=over)
    copy.set(arm, **words, over=over)
    for each in (simulation, copy):
        each.step(3)
    assert np.array_equal(simulation.positions(), copy.positions())
    batch = weightless(planar=False)[0].build_batch(2)
    value = np.repeat(np.array(arguments[1])[None], 2, axis=0)
    with pytest.warns(DeprecationWarning, match=f"{old} is deprecated"):
        getattr(batch, old)(arm.name, value, over=over)


def test_old_names_of_pairs_warn_and_set_the_pair():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0.01), end=(0.1, 0, 0.01), nodes=5, radius=0.01, material=RUBBER)
    floor = scene.add_floor(0.0, friction=0.3)
    simulation = scene.build()
    for word, value in {"friction": 0.2, "restitution": 0.4, "contact_stiffness": 2e3}.items():
        old = f"set_{word}"
        with pytest.warns(DeprecationWarning, match=f"{old} is deprecated"):
            getattr(simulation, old)(arm, floor, value)
        assert simulation.get((floor, arm), word) == value
        simulation.set((arm, floor), **{word: 0.5 * value})
        assert simulation.get((arm, floor), word) == 0.5 * value


def test_words_are_set_together_or_not_at_all():
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0.01), end=(0.1, 0, 0.01), nodes=5, radius=0.01, material=RUBBER)
    floor = scene.add_floor(0.0, friction=0.3)
    simulation = scene.build(planar=True)
    with pytest.raises(ValueError, match="restitution of"):
        simulation.set((arm, floor), friction=0.1, restitution=2.0)
    assert simulation.get((arm, floor), "friction") == 0.3
    with pytest.raises(ValueError, match="planar=False"):
        simulation.set(arm, natural_stretch=1.1, natural_twist=1.0, over=0.01)
    simulation.step(5)
    assert np.all(simulation.get(arm, "natural_stretch") == 1.0)


@pytest.mark.parametrize("word", ["stiffness", "rest_length", "damping"])
def test_numbers_of_springs_are_led_to_their_values(word):
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=3, radius=0.01, material=RUBBER)
    post = scene.add_rod(start=(0.2, 0, 0), end=(0.3, 0, 0), nodes=3, radius=0.01, material=RUBBER)
    spring = scene.add_spring(arm.end, post.start, stiffness=10.0, damping=0.1)
    simulation = scene.build(time_step=1e-3)
    first = simulation.get(spring, word)
    simulation.set(spring, **{word: 2.0 * first}, over=0.01)
    assert simulation.get(spring, word) == first
    simulation.step(5)
    assert simulation.get(spring, word) == pytest.approx(1.5 * first)
    simulation.step(10)
    assert simulation.get(spring, word) == 2.0 * first
    energy = simulation.energy()
    assert energy.total - energy.work + energy.dissipated == pytest.approx(0.0, abs=1e-12)


def test_what_is_not_ramped_must_be_set_at_once():
    _, arm, simulation = weightless()
    with pytest.raises(ValueError, match=r"youngs_modulus of rod .* must be set without over="):
        simulation.set(arm, youngs_modulus=1e6, over=0.1)
    with pytest.raises(ValueError, match="gravity of the scene must be set without over="):
        simulation.set(gravity=(0, 0, -1), over=0.1)


@pytest.mark.parametrize("word", ["friction", "restitution"])
@pytest.mark.parametrize("seed", range(4))
def test_setting_the_value_that_a_pair_has_changes_no_motion(word, seed):
    """The first value of its own that a pair is given leaves the stiffness of its contacts alone."""
    scene = withe.Scene()
    height = 0.012 + 0.02 * np.random.default_rng(seed).random()
    arm = scene.add_rod(start=(0, 0, 0.012), end=(0.2, 0, height), nodes=9, radius=0.01, material=RUBBER, name="arm")
    floor = scene.add_floor(0.0, friction=0.3)
    scene.add_force(arm.end, (0, 0, -5.0))
    simulation = scene.build(time_step=2e-3)
    simulation.step(60)
    other = simulation.copy()
    other.set((arm, floor), **{word: other.get((arm, floor), word)})
    for each in (simulation, other):
        each.step(60)
    assert np.array_equal(simulation.positions(), other.positions())
    assert simulation.energy().work == other.energy().work


def test_the_engine_refuses_numbers_of_surfaces_out_of_range():
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.1), end=(0.1, 0, 0.1), nodes=3, radius=0.01, material=RUBBER)
    scene.add_floor(0.0, friction=0.3)
    scene.enable_contact(friction=0.2)
    world = scene.build()._session.world
    index = world.own_contact(0, -1)
    for owner, settings, message in (
        (0, {"friction": 0.1, "restitution": 1.5}, "restitution must be from 0 to 1, got 1.5"),
        (0, {"slip_tolerance": 0.0}, "slip tolerance must be positive and finite"),
        (0, {"obstacle_friction": (0.1, -0.1, 0.1)}, "obstacle friction must be finite and not negative"),
        (1, {"obstacle_rolling": 0.1}, "no such part: 1"),
        (index, {"pair_friction": (0.1, np.nan, 0.1)}, "pair friction must be finite"),
        (index + 1, {"pair_restitution": 0.1}, "no such part: 1"),
    ):
        with pytest.raises(ValueError, match=message):
            world.set(owner, settings)
    assert world.contact.friction == 0.2
    with pytest.raises(ValueError, match="no such pair of bodies: 0, -2"):
        world.own_contact(0, -2)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_a_pose_from_a_function_turns_far_and_out_of_the_plane_in_a_step(integrator: str) -> None:
    """The step is taken back and divided; in a plane nothing was kept to return to."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=11, radius=0.01, material=rubber)
    hold = scene.clamp(arm.start)
    simulation = scene.build(time_step=2e-3, integrator=integrator)
    assert simulation.plan.planar
    turned = (np.cos(0.2), 0.0, 0.0, np.sin(0.2))
    simulation.move(hold, path=lambda t: (np.zeros(3), turned if t > 0.003 else (1.0, 0.0, 0.0, 0.0)))
    simulation.step(4)
    assert not simulation.plan.planar
    assert simulation.time == pytest.approx(8e-3)
    assert simulation.positions(arm)[1, 1] > 5e-3
