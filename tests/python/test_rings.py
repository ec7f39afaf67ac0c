"""Rings at the border: their words in scene and simulation, what they refuse, and what goes on from a snapshot."""

import pickle
import warnings

import numpy as np
import pytest

import withe


def drawn():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.4, 0, 0), nodes=21, radius=4e-3, material=rubber, name="rod")
    return scene, rod


def built(**words):
    scene, rod = drawn()
    scene.clamp(rod.start)
    return scene.build(integrator="implicit_midpoint", time_step=1e-3, planar=False, **words), rod


def test_scene_and_simulation_have_the_same_words():
    answers = []
    for early in (True, False):
        scene, rod = drawn()
        words = {"at": 0.13, "slides": True, "stiffness": 300.0, "friction": 0.2, "name": "eye"}
        if early:
            scene.grasp(rod, **words)
        simulation = scene.build(time_step=1e-3, planar=False)
        if not early:
            simulation.grasp(rod, **words)
        simulation.step(20)
        answers.append((simulation.positions(), simulation.wrench("eye").force, simulation.passage("eye")))
    for one, other in zip(*answers, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_ring_is_as_stiff_as_an_edge_by_default():
    simulation, rod = built()
    ring = simulation.grasp(rod, 0.33, slides=True)
    simulation.step(5)
    edge = 1e6 * np.pi * 4e-3**2 / 0.02
    assert ring.passage.press == pytest.approx(edge * np.linalg.norm(ring.deflection.shift), rel=1e-12)
    assert ring.passage.press > 0.0


@pytest.mark.parametrize(
    "words", [{"friction": 0.4}, {"feed_rate": 0.3, "force_limit": 2.0}], ids=["friction", "drive"]
)
def test_snapshots_copies_pickles_and_files_go_on_with_the_same_bits(words, tmp_path):
    simulation, rod = built()
    simulation.step(3)
    ring = simulation.grasp(rod, 0.17, slides=True, **words)
    ring.move(path=[(0.0, 0.17, 0.0, 0.0), (0.2, 0.2, 0.05, 0.1)])
    simulation.step(5)
    if "feed_rate" in words:
        ring.feed(-0.2)
    state, copy, pickled = simulation.snapshot(), simulation.copy(), pickle.loads(pickle.dumps(simulation))
    state.save(tmp_path / "state.npz")
    fresh = built()[0]
    simulation.step(5)
    end, passage = simulation.positions(), ring.passage
    for other in (copy, pickled):
        other.step(5)
        np.testing.assert_array_equal(other.positions(), end)
        assert other.passage(ring.name) == passage
    ring.release()
    simulation.restore(state)
    simulation.step(5)
    np.testing.assert_array_equal(simulation.positions(), end)
    fresh.restore(withe.Snapshot.load(tmp_path / "state.npz"))
    fresh.step(5)
    np.testing.assert_array_equal(fresh.positions(), end)
    assert fresh.passage(ring.name) == passage


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"at": 0.5}, "must lie on rod 'rod', from 0 to 0.4 m"),
        ({"slides": 1}, "slides of 'hand 1' must be"),
        ({"length": 0.02}, "length of 'hand 1' must be 0 for a ring"),
        ({"stiffness": (1.0, 1.0)}, "stiffness of 'hand 1' must be one number"),
        ({"stiffness": 0.0}, "stiffness of 'hand 1' must be positive"),
        ({"friction": -0.1}, "friction of 'hand 1' must not be negative"),
        ({"friction": np.nan}, "friction of 'hand 1' must be"),
        ({"feed_rate": np.inf}, "feed_rate of 'hand 1' must be"),
        ({"feed_rate": 0.1, "friction": 0.2}, "friction of 'hand 1' must be 0 with a drive"),
        ({"force_limit": 1.0}, "force_limit of 'hand 1' needs a drive"),
        ({"feed_rate": 0.1, "force_limit": 0.0}, "force_limit of 'hand 1' must be positive"),
        ({"slides": False, "friction": 0.2}, "friction of 'hand 1' needs a ring"),
        ({"slides": False, "feed_rate": 0.0}, "feed_rate of 'hand 1' needs a ring"),
    ],
)
def test_bad_input_is_named(words, message):
    scene, rod = drawn()
    for where in (scene, scene.build()):
        with pytest.raises(ValueError, match=message):
            where.grasp(rod, **({"at": 0.1, "slides": True} | words))


def test_what_rings_do_not_go_with_says_so():
    simulation, rod = built()
    ring, hand = simulation.grasp(rod, 0.2, slides=True, name="eye"), simulation.grasp(rod, 0.3, name="grip")
    with pytest.raises(ValueError, match="'eye' has no drive"):
        ring.feed(0.1)
    with pytest.raises(ValueError, match="must be a ring returned by grasp"):
        simulation.passage(hand)
    with pytest.raises(ValueError, match="a rod slides through a ring"):
        simulation.run(0.01, differentiable=True).gradient({"positions": np.ones((11, 21, 3))}, ["gravity"])
    scene, rod = drawn()
    scene.clamp(rod.start)
    scene.grasp(rod, 0.2, slides=True, friction=0.1)
    with pytest.raises(ValueError, match="supports rigid hands only"):
        scene.build(integrator="verlet", time_step=1e-6)
    with pytest.raises(ValueError, match="does not support hands that slip"):
        scene.build(integrator="fourth_order", time_step=1e-3)


def flying(friction):
    """A rod that flies out of a ring on its way, another ring staying on it."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.4, 0, 0), nodes=21, radius=4e-3, material=rubber, name="rod")
    scene.grasp(rod, 0.07, slides=True, stiffness=50.0, friction=friction, name="eye")
    scene.grasp(rod, 0.35, slides=True, stiffness=50.0, name="other")
    scene.add_force(rod.end, lambda t: (0.02, 0.01 * np.sin(9.0 * t), 0.02), name="pull")
    return scene


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_rod_leaves_a_ring_in_the_same_step_whoever_takes_it(friction, integrator):
    """And all goes on with the same bits: single steps, one call, a run, a batch, a copy from just before."""

    def fresh():
        simulation = flying(friction).build(integrator=integrator, time_step=5e-3)
        simulation.set_velocities("rod", (1.0, 0.0, 0.0))
        simulation.move("eye", path=lambda t: (0.07, 0.004 * np.sin(20.0 * t), 0.0))
        return simulation

    steps, left, before = 40, [], None
    single = fresh()
    for k in range(steps):
        copy = single.copy()
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            single.step()
        if heard:
            left.append(k)
            before = copy
            assert issubclass(heard[0].category, withe.RingLeftWarning)
            assert f"ring 'eye' (time {single.time:.6g} s)" in str(heard[0].message)
    assert len(left) == 1
    assert 5 < left[0] < 30
    whole, run = fresh(), fresh()
    batch = withe.Batch([fresh() for _ in range(3)], workers=2)
    with pytest.warns(withe.RingLeftWarning, match="'eye'"):
        whole.step(steps)
    with pytest.warns(withe.RingLeftWarning, match="'eye'"):
        run.run(steps * 5e-3, record_every=5e-3)
    with pytest.warns(withe.RingLeftWarning, match="'eye' of simulation 0 .* 2 more: the ring was released"):
        batch.step(steps)
    with pytest.warns(withe.RingLeftWarning, match="'eye'"):
        before.step(steps - left[0])
    for other in (whole, run, before, *batch):
        np.testing.assert_array_equal(other.positions(), single.positions())
        np.testing.assert_array_equal(other.velocities(), single.velocities())
        assert other.energy() == single.energy()
        with pytest.raises(ValueError, match="'eye' is released"):
            other.passage("eye")
        assert other.passage("other") == single.passage("other")


def test_an_equilibrium_that_a_rod_leaves_a_ring_for_is_one_without_the_ring():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.4, 0, 0), nodes=21, radius=4e-3, material=rubber, name="rod")
    scene.clamp(rod.start)
    alone = scene.build()
    for integrator in ("implicit_midpoint", "static"):
        found = scene.build(integrator=integrator, time_step=0.1)
        ring = found.grasp(rod, 0.37, slides=True)
        found.move(ring, position=(0.45, 0.0, 0.0))
        with pytest.warns(withe.RingLeftWarning):
            found.step() if integrator == "static" else found.equilibrium()
        alone.equilibrium()
        np.testing.assert_allclose(found.positions(), alone.positions(), atol=1e-9)


def test_friction_of_a_ring_is_set_while_it_runs():
    """Less of it lets go what it has held, which is booked; more holds from where the rod is; and copies know it."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.4, 0, 0.1), nodes=21, radius=4e-3, material=rubber, name="rod")
    scene.grasp(rod, 0.1, slides=True)
    ring = scene.grasp(rod, 0.25, slides=True, friction=2.0, name="eye")
    simulation = scene.build(
        integrator="energy_momentum", time_step=1e-3, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13)
    )

    def balance():
        e = simulation.energy()
        return e.total - e.work + e.dissipated

    start = balance()
    for friction in (None, 0.05, 0.0, 5.0):
        if friction is not None:
            simulation.set(ring, friction=friction)
            assert simulation.get(ring, "friction") == friction
        at = simulation.passage(ring).at
        copy, fresh = (
            simulation.copy(),
            scene.build(
                integrator="energy_momentum",
                time_step=1e-3,
                solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13),
            ),
        )
        fresh.restore(simulation.snapshot())
        simulation.step(40)
        passage = simulation.passage(ring)
        assert abs(passage.pull) <= (friction if friction is not None else 2.0) * passage.press * (1.0 + 1e-9)
        assert balance() == pytest.approx(start, abs=1e-10)
        assert (abs(passage.at - at) < 1e-3) == (friction in (None, 5.0))
        for other in (copy, fresh):
            other.step(40)
            np.testing.assert_array_equal(other.positions(), simulation.positions())
            assert other.get("eye", "friction") == simulation.get(ring, "friction")
    simulation.reset()
    assert simulation.get(ring, "friction") == 2.0
    for bad in (-0.1, np.nan, "much"):
        with pytest.raises(ValueError, match="friction of 'eye' must"):
            simulation.set(ring, friction=bad)
    drive = simulation.grasp(rod, 0.3, slides=True, feed_rate=0.1, name="drive")
    with pytest.raises(ValueError, match="'drive' has no 'friction' to set"):
        simulation.set(drive, friction=0.1)
