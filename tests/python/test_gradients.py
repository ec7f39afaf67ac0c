"""Gradients of equilibria and of runs, against differences of whole equilibria and whole runs."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from gradient_scenes import NODES, TIGHT, Drawn, difference, move_with_directors, settings, weighted


@pytest.mark.case("inverse", "Gradients of equilibria", source="central differences")
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
def test_gradient_of_an_equilibrium_is_that_of_differences(planar, joint):
    random = np.random.default_rng(3)
    drawn = Drawn(planar=planar, joint=joint, integrator="static")
    sim, arm, wall = drawn.simulation, drawn.arm, drawn.wall
    sim.set(arm, natural_curvature=sim.get(arm, "natural_curvature") + 2.0 * drawn.bent(random))
    found = sim.equilibrium()
    weight = drawn.vectors(random, len(sim.positions()))
    place, axis = sim.positions(arm)[0], np.array([0.0, 1.0, 0.0]) if planar else np.array([0.3, 0.5, -0.4])

    def of():
        sim.equilibrium()
        return float((weight * sim.positions()).sum())

    cases = [
        *settings(drawn, random),
        (
            (wall, "position"),
            np.array([1.0, 0, 0]),
            lambda h: sim.move(wall, position=place + np.array([h, 0, 0])),
            1e-6,
        ),
        ((wall, "rotation"), axis, lambda h: sim.move(wall, rotation=Rotation.from_rotvec(h * axis)), 1e-5),
    ]
    gradients = found.gradient(weight, [unknown for unknown, *_ in cases])
    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        assert np.sum(gradient * along) == pytest.approx(difference(sim, of, change, size), rel=1e-6, abs=1e-12), (
            unknown
        )


@pytest.mark.parametrize("nodes", [9, 41, 401])
@pytest.mark.parametrize("hangs", [False, True])
def test_what_drives_the_spin_of_a_rod_that_is_free_to_has_no_gradient(nodes, hangs):
    """The angle to which the rod spins does not follow from the loads; the result was rounding error. Scalars that do
    not drive the spin have a gradient."""
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1100.0)
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0.05), nodes=nodes, radius=4e-3, material=rubber)
    if hangs:  # from the end of another, which is held
        other = scene.add_rod(start=(-0.2, 0, 0), end=(0, 0, 0), nodes=nodes, radius=4e-3, material=rubber)
        scene.clamp(other.start)
        scene.join(other.end, rod.start, kind="pinned")
    else:
        scene.pin(rod.start)
    scene.pin(rod.end)
    load = scene.add_force(rod.node(nodes // 2), (0, 0.01, -0.02))
    simulation = scene.build(integrator="static", planar=False)
    found = simulation.equilibrium()
    weight = np.random.default_rng(1).normal(size=simulation.positions().shape)
    wrt = [(load, "force"), (rod, "natural_curvature")]
    for refused in (lambda: found.gradient(weight, wrt), lambda: found.jacobian((rod, "positions"), wrt)):
        with pytest.raises(
            ValueError,
            match=r"no gradient with respect to natural_curvature of .* is available, because .* drives a motion",
        ):
            refused()
    by_load, _ = found.gradient(weight, [(load, "force"), (rod, "natural_twist")])  # which turns ends alone

    def scalar(force):
        moved = simulation.copy()
        moved.set(load, force=force)
        moved.equilibrium()
        return float((weight * moved.positions()).sum())

    step = 1e-5 * np.eye(3)
    force = np.array((0, 0.01, -0.02))
    differences = [(scalar(force + h) - scalar(force - h)) / 2e-5 for h in step]
    np.testing.assert_allclose(by_load, differences, rtol=1e-4, atol=1e-4 * np.abs(differences).max())


def test_velocities_of_what_is_held_go_with_none_at_the_start():
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1100.0)
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=6, radius=4e-3, material=rubber)
    scene.clamp(rod.start)
    simulation = scene.build(time_step=2e-3)
    record = simulation.run(0.02, record_every=0.01, differentiable=True, progress=False)
    weight = np.zeros(record.velocities().shape)
    weight[0, :, ::2] = 1.0  # of the frame before the first step
    (gradient,) = record.gradient({"velocities": weight}, ["initial_velocities"])
    held = (simulation.velocities() == 0.0).all(axis=1)
    assert held[0]
    assert not held[2:].any()
    np.testing.assert_array_equal(gradient[held], 0.0)
    np.testing.assert_array_equal(gradient[~held], np.tile((1.0, 0.0, 1.0), ((~held).sum(), 1)))


def test_what_is_free_to_spin_has_gradients_of_what_spinning_leaves_alone():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)
    cable = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=21, radius=6e-3, material=rubber)
    pins = scene.pin(cable.start), scene.pin(cable.end)
    simulation = scene.build(integrator="static", planar=False, **TIGHT)
    sag = np.zeros((21, 3))
    sag[10, 2] = 1.0
    (by_modulus,) = simulation.equilibrium().gradient(sag, [(cable, "youngs_modulus")])

    def of():
        simulation.equilibrium()
        return simulation.positions()[10, 2]

    expected = difference(simulation, of, lambda h: simulation.set(cable, youngs_modulus=1e6 + h), 100.0)
    assert by_modulus == pytest.approx(expected, rel=1e-6)

    for pin in pins:
        simulation.release(pin)
    simulation.set(gravity=(0, 0, 0))
    found = simulation.equilibrium()
    length = np.zeros((21, 3))
    length[[0, -1], 0] = -1.0, 1.0
    assert found.gradient(length, [(cable, "youngs_modulus")])[0] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(ValueError, match="can move or spin freely"):
        found.gradient(sag, [(cable, "youngs_modulus")])


def test_gradients_have_the_shape_of_get_and_the_jacobian_their_rows():
    random = np.random.default_rng(4)
    drawn = Drawn(planar=False, joint=False, integrator="static")
    sim, arm = drawn.simulation, drawn.arm
    words = ("youngs_modulus", "natural_curvature", "natural_twist", "bend_stiffness", "line_density", "poisson_ratio")
    wrt = [(arm, word) for word in words]
    found = sim.equilibrium()
    weight = random.normal(size=(NODES, 3))
    gradients, jacobians = found.gradient(weight, wrt), found.jacobian(arm, wrt)
    for word, gradient, jacobian in zip(words, gradients, jacobians, strict=True):
        shape = np.shape(sim.get(arm, word))
        assert np.shape(gradient) == shape
        assert jacobian.shape == (NODES, 3, *shape)
        np.testing.assert_allclose(np.tensordot(weight, jacobian, axes=2), gradient, rtol=1e-10, atol=1e-14)
    (tip,) = found.jacobian(arm.end, [(arm, "natural_twist")])
    np.testing.assert_array_equal(tip, jacobians[2][-1])


@pytest.mark.case("inverse", "Gradients of runs", source="central differences, extrapolated")
@pytest.mark.parametrize("support", [None, "frame", "edge", "moving frame", "moving edge"])
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(
    ("integrator", "viscosity"),
    [
        ("backward_euler", 0.0),
        ("backward_euler", 300.0),
        ("implicit_midpoint", 0.0),
        ("implicit_midpoint", 300.0),
        ("fourth_order", 0.0),
        ("energy_momentum", 0.0),
        ("energy_momentum", 300.0),
    ],
)
def test_gradient_of_a_run_is_that_of_differences(integrator, viscosity, planar, joint, support):
    random = np.random.default_rng(5)
    hold = (support or "").removeprefix("moving ")
    drawn = Drawn(
        planar=planar,
        joint=joint,
        integrator=integrator,
        support=hold or None,
        viscosity=viscosity,
        adaptive=False,
        time_step=2e-3,
    )
    sim, arm = drawn.simulation, drawn.arm
    held = {"": 0, "frame": 1, "edge": 2}[hold]
    velocities, directions = (drawn.vectors(random, NODES) for _ in range(2))
    velocities[:held], directions[:held] = 0.0, 0.0
    sim.set_velocities(arm, 0.3 * velocities)
    if not planar:
        sim.set_state(arm, spins=20.0 * random.normal(size=NODES - 1))
    if support != (hold or None):
        turn = Rotation.from_rotvec((0, 0.4, 0) if planar else (0.1, 0.4, -0.2))
        sim.move(drawn.wall, position=(0.01, 0, 0.02), rotation=turn, over=15e-3)
    frames, nodes = 5, len(sim.positions())
    weights = {
        "positions": np.array([drawn.vectors(random, nodes) for _ in range(frames)]),
        "velocities": np.array([0.01 * drawn.vectors(random, nodes) for _ in range(frames)]),
    }

    def run(**options):
        return sim.run(24e-3, record_every=6e-3, progress=False, **options)

    def of():
        return weighted(run(), weights)

    cases = [
        *settings(drawn, random),
        ((drawn.drag, "drag"), 1.0, lambda h: sim.set(drawn.drag, drag=0.2 + h), 1e-3),
        (
            "initial_velocities",
            np.concatenate([directions, np.zeros((nodes - NODES, 3))]),
            lambda h: sim.set_velocities(arm, 0.3 * velocities + h * directions),
            1e-4,
        ),
    ]
    if integrator != "fourth_order":
        cases.append(((drawn.spring, "damping"), 1.0, lambda h: sim.set(drawn.spring, damping=0.5 + h), 1e-2))
    if viscosity:
        cases.append(((arm, "viscosity"), 1.0, lambda h: sim.set(arm, viscosity=viscosity + h), 0.05))
    if not joint and hold != "edge":
        cases.append(("initial_positions", directions, lambda h: move_with_directors(sim, arm, h * directions), 1e-6))
    start = sim.snapshot()
    gradients = run(differentiable=True).gradient(weights, [unknown for unknown, *_ in cases])
    sim.restore(start)
    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        # Differences of two sizes, extrapolated, leave rounding alone.
        wide, near = (difference(sim, of, change, times * size) for times in (4.0, 2.0))
        assert np.sum(gradient * along) == pytest.approx((4.0 * near - wide) / 3.0, rel=2e-6, abs=1e-11), unknown


@pytest.mark.parametrize(
    ("kind", "planar"), [("rigid", False), ("revolute", False), ("revolute", True), ("pinned", False)]
)
@pytest.mark.parametrize("viscosity", [0.0, 300.0])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "fourth_order", "energy_momentum"])
def test_gradient_of_a_run_through_joints_that_turn_is_that_of_differences(integrator, viscosity, kind, planar):
    if integrator == "fourth_order" and viscosity:
        pytest.skip("refused: fourth order steps go back in time")
    random = np.random.default_rng(20)
    drawn = Drawn(planar=planar, joint=kind, integrator=integrator, viscosity=viscosity, adaptive=False, time_step=4e-3)
    sim, arm = drawn.simulation, drawn.arm
    put_on, about = ((0, -0.01, 0), np.array([0, 1.0, 0])) if planar else ((0.02, -0.01, 0.015), np.array([1.0, 0, 0]))
    moment = sim.add_moment(arm.node(6), put_on)
    beside = [sim.add_moment(sim.rods[1].start, 0.3 * np.array(put_on), follower=follows) for follows in (False, True)]
    nodes = len(sim.positions())
    velocities, way = drawn.vectors(random, nodes), drawn.vectors(random, nodes)
    seen, fast = (np.stack([drawn.vectors(random, nodes) for _ in range(3)]) for _ in range(2))
    velocities[0] = way[0] = 0.0
    sim.set_velocities(None, 2.0 * velocities)
    weights = {"positions": seen, "velocities": 0.01 * fast}

    def run(**options):
        return sim.run(24e-3, record_every=12e-3, progress=False, **options)

    def of():
        return weighted(run(), weights)

    cases = [
        *settings(drawn, random),
        ((moment, "moment"), about, lambda h: sim.set(moment, moment=put_on + h * about), 5e-4),
        *(
            ((load, "moment"), about, lambda h, m=load: sim.set(m, moment=0.3 * np.array(put_on) + h * about), 5e-4)
            for load in beside
        ),
        ("initial_velocities", way, lambda h: sim.set_velocities(None, 2.0 * velocities + h * way), 1e-4),
    ]
    start = sim.snapshot()
    gradients = run(differentiable=True).gradient(weights, [unknown for unknown, *_ in cases])
    sim.restore(start)
    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        wide, near = (difference(sim, of, change, times * size) for times in (4.0, 2.0))
        assert np.sum(gradient * along) == pytest.approx((4.0 * near - wide) / 3.0, rel=2e-6, abs=1e-9), unknown


def tapered(radii, run, *, planar, joint, material=True):
    """A tapered arm in space or in a plane, in equilibrium or let go from its straight shape."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=200.0 * run)
    stiffness = withe.Stiffness(stretch=400.0, bend=0.02, twist=0.015)
    rod = {"material": rubber} if material else {"stiffness": stiffness, "line_density": 0.6}
    s = np.linspace(0.0, 1.0, NODES)
    points = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
    arm = scene.add_rod(points=points, radius=radii, name="arm", **rod)
    scene.clamp(arm.start)
    if joint:
        tip = points[6] + [0.02, 0.0 if planar else 0.1, 0.1]
        branch = scene.add_rod(start=points[6], end=tip, nodes=5, radius=1e-2, material=rubber)
        scene.join(arm.node(6), branch.start)
    scene.add_drag(0.2)
    options = {"integrator": "implicit_midpoint", "time_step": 2e-3, "adaptive": False} if run else {}
    return scene.build(planar=planar or None, **({"integrator": "static"} | options), **TIGHT)


@pytest.mark.case("inverse", "Gradients by radii", source="differences of rebuilt scenes")
@pytest.mark.parametrize("material", [True, False])
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("run", [False, True])
def test_gradient_by_radii_is_that_of_scenes_built_anew(run, planar, joint, material):
    random = np.random.default_rng(12)
    radii = np.linspace(1.8e-2, 1e-2, NODES - 1)
    way = radii * random.uniform(-1.0, 1.0, size=NODES - 1)
    nodes = NODES + (4 if joint else 0)
    weight = random.normal(size=(3 if run else 1, nodes, 3)) * ((1, 0, 1) if planar else (1, 1, 1))

    def shown(simulation, **options):
        if run:
            if not planar:
                simulation.set_state("arm", spins=20.0 * np.sin(np.arange(NODES - 1)))
            return simulation.run(24e-3, record_every=12e-3, progress=False, **options)
        return simulation.equilibrium()

    simulation = tapered(radii, run, planar=planar, joint=joint, material=material)
    found = shown(simulation, **{"differentiable": True} if run else {})
    (gradient,) = found.gradient({"positions": weight} if run else weight[0], [("arm", "radius")])
    assert gradient.shape == (NODES - 1,)

    def of(change):
        other = tapered(radii + change * way, run, planar=planar, joint=joint, material=material)
        record = shown(other)
        return float((weight * (record.positions() if run else other.positions()[None])).sum())

    wide, near = ((of(h) - of(-h)) / (2.0 * h) for h in (2e-3, 1e-3))
    assert gradient @ way == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6, abs=1e-11)


def test_steps_that_were_cut_are_differentiated_as_they_ran():
    random = np.random.default_rng(6)
    drawn = Drawn(planar=True, joint=False, integrator="backward_euler", tolerance=1e-4, time_step=0.02)
    sim = drawn.simulation
    record = sim.run(0.1, record_every=0.1, progress=False, differentiable=True)
    assert sim.statistics.steps > 5
    weight = np.zeros((2, NODES, 3))
    weight[-1] = drawn.vectors(random, NODES)
    (by_gravity,) = record.gradient({"positions": weight}, ["gravity"])
    assert np.linalg.norm(by_gravity) > 0.0


def test_what_has_no_gradient_says_so():
    drawn = Drawn(planar=True, joint=False, integrator="implicit_midpoint", adaptive=False)
    sim, arm = drawn.simulation, drawn.arm
    found = sim.equilibrium()
    out_of_plane = np.zeros((NODES, 3))
    out_of_plane[:, 1] = 1.0
    for value, wrt, message in (
        (out_of_plane, [(arm, "youngs_modulus")], "plane"),
        (np.zeros((3, 3)), [(arm, "youngs_modulus")], "shape"),
        (np.zeros((NODES, 3)), [(arm, "colour")], "no 'colour'"),
        (np.zeros((NODES, 3)), [], "wrt must be a list"),
        (np.zeros((NODES, 3)), ["initial_positions"], "is a parameter of runs, not of equilibria"),
    ):
        with pytest.raises(ValueError, match=message):
            found.gradient(value, wrt)
    sim.set(drawn.force, force=(0, 0, 1.0))
    with pytest.raises(ValueError, match="is not in equilibrium"):
        found.gradient(np.zeros((NODES, 3)), ["gravity"])
    sim.equilibrium()
    with pytest.raises(ValueError, match="has left this equilibrium"):
        found.gradient(np.zeros((NODES, 3)), ["gravity"])

    zeros = np.zeros((2, NODES, 3))
    with pytest.raises(ValueError, match="differentiable=True"):
        sim.run(0.01, record_every=0.01, progress=False).gradient({"positions": zeros}, ["gravity"])
    record = sim.run(0.01, record_every=0.01, progress=False, differentiable=True)
    assert np.all(record.gradient({"positions": zeros}, ["gravity"])[0] == 0.0)
    with pytest.raises(ValueError, match="derivatives by"):
        record.gradient({"curvatures": zeros}, ["gravity"])
    with pytest.raises(ValueError, match="before the record is saved"):
        pickle.loads(pickle.dumps(record)).gradient({"positions": zeros}, ["gravity"])
    upwards = np.outer(np.arange(NODES), (0, 0, 1e-3))
    changed = sim.run(
        0.01,
        record_every=0.01,
        progress=False,
        differentiable=True,
        before_step=lambda s: s.set_velocities(arm, upwards),
    )
    with pytest.raises(ValueError, match="the state was changed during the run"):
        changed.gradient({"positions": zeros}, ["gravity"])
    held = []
    pinned = sim.run(
        0.02,
        record_every=0.02,
        progress=False,
        differentiable=True,
        before_step=lambda s: held or held.append(s.pin(arm.end)),
    )
    with pytest.raises(ValueError, match="supports were added or removed"):
        pinned.gradient({"positions": zeros}, ["gravity"])


def test_a_differentiable_run_is_the_same_run():
    runs = []
    for differentiable in (False, True):
        drawn = Drawn(planar=False, joint=True, integrator="implicit_midpoint", time_step=5e-3)
        runs.append(drawn.simulation.run(0.1, progress=False, differentiable=differentiable))
    np.testing.assert_array_equal(runs[0].positions(), runs[1].positions())


def test_gradients_by_loads_edge_by_edge():
    drawn = Drawn(planar=False, joint=False, integrator="static")
    rows = np.random.default_rng(3).normal(size=(NODES - 1, 3))
    spread, even = drawn.simulation.add_load(drawn.arm, 0.1 * rows), drawn.simulation.add_load(drawn.arm, (0, 0, 0.05))
    found = drawn.simulation.equilibrium()
    random = np.random.default_rng(4)
    by, way = random.normal(size=(NODES, 3)), random.normal(size=(NODES - 1, 3))
    of_spread, of_even = found.gradient(by, wrt=[(spread, "load"), (even, "load")])
    assert of_spread.shape == (NODES - 1, 3)
    assert of_even == pytest.approx(of_spread.sum(axis=0), rel=1e-12)

    def loss():
        drawn.simulation.equilibrium()
        return float((by * drawn.simulation.positions()).sum())

    expected = difference(
        drawn.simulation, loss, lambda step: drawn.simulation.set(spread, load=0.1 * rows + step * way), 1e-4
    )
    assert (of_spread * way).sum() == pytest.approx(expected, rel=1e-6)


def test_radii_that_have_no_gradient_say_so():
    def gradient(section, floor):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, section=section, material=rubber)
        scene.clamp(arm.start)
        if floor:
            scene.add_plane(point=(0, 0, -1.0), normal=(0, 0, 1))
            scene.enable_contact()
        simulation = scene.build(integrator="static", planar=False)
        return simulation.equilibrium().gradient(np.ones((5, 3)), [(arm, "radius")])

    with pytest.raises(ValueError, match=r"not a withe\.Circle"):
        gradient(withe.Rectangle(0.01, 0.02), floor=False)
    with pytest.raises(ValueError, match=r"not a withe\.Circle"):
        gradient(withe.Tube(0.02, 0.01), floor=False)
    with pytest.raises(ValueError, match="surfaces would move"):
        gradient(withe.Circle(0.01), floor=True)


@pytest.mark.parametrize(
    "word", ["positions", "directors", "curvatures", "twists", "reaction_forces", "reaction_moments"]
)
def test_gradients_of_a_planar_equilibrium_know_what_leads_out_of_its_plane(word):
    """The scene is built planar by default; `set` makes it spatial where it has to."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
    section = withe.Rectangle(width=9e-3, height=7e-3)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=11, section=section, normal=(0, 1, 0), material=rubber)
    wall = scene.clamp(arm.start)
    tip = scene.add_force(arm.end, (0.0, 0.0, -1e-3))
    options = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13)}
    simulation = scene.build(integrator="static", **options)
    found = simulation.equilibrium()
    whose = wall if word.startswith("reaction") else arm

    def read(simulation):
        reaction = simulation.reaction(wall)
        return {
            "positions": lambda: simulation.positions(arm),
            "directors": lambda: simulation.directors(arm),
            "curvatures": lambda: simulation.curvatures(arm),
            "twists": lambda: simulation.twists(arm),
            "reaction_forces": lambda: reaction.force,
            "reaction_moments": lambda: reaction.moment,
        }[word]()

    weights = np.random.default_rng(2).normal(size=np.shape(read(simulation)))
    wrt = [(tip, "force"), "gravity", (arm, "natural_curvature"), (arm, "natural_twist")]
    gradients = found.gradient({word: {whose: weights}}, wrt)
    jacobians = found.jacobian((whose, word), wrt)

    def scalar(part, name, value):
        moved = scene.build(integrator="static", planar=False, **options)
        moved.set(part, **{name: value})
        moved.equilibrium()
        return float((weights * read(moved)).sum())

    given = {
        "force": (tip, np.array([0.0, 0.0, -1e-3]), 1e-7),
        "gravity": (None, np.array([0.0, 0.0, -9.81]), 1e-3),
        "natural_curvature": (arm, simulation.get(arm, "natural_curvature"), 1e-3),
        "natural_twist": (arm, simulation.get(arm, "natural_twist"), 1e-3),
    }
    for (name, (part, value, h)), gradient, jacobian in zip(given.items(), gradients, jacobians, strict=True):
        np.testing.assert_allclose(np.tensordot(weights, jacobian, weights.ndim), gradient, rtol=1e-9, atol=1e-9)
        way = np.random.default_rng(3).normal(size=value.shape)
        difference = scalar(part, name, value + h * way) - scalar(part, name, value - h * way)
        assert (gradient * way).sum() == pytest.approx(difference / (2.0 * h), rel=1e-4, abs=1e-9), name
