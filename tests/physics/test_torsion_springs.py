"""Torsion springs between edges: closed forms, what they conserve, gradients, ways to set them."""

import numpy as np
import pytest
from scipy.optimize import brentq

import rods
import withe
from cases import measured, measured_order

LENGTH, RADIUS, DENSITY, STIFFNESS = 0.2, 5e-3, 0.5, 0.03
INERTIA = DENSITY * LENGTH**3 / 3.0  # of a link about its end
AXES = {"plane": (0, 1, 0), "space": (0.2, 1.0, -0.3)}


def stiff(**more):
    return {
        "stiffness": rods.stiffness(stretch=1e6, bend=10.0, twist=10.0),
        "line_density": DENSITY,
        "radius": RADIUS,
        **more,
    }


def two_links(axis=(0, -1, 0), *, clamped=True, joint="pinned", stiffness=STIFFNESS, rest_angle=0.0, stretch=1e6):
    """Two links of one edge along x, the first held; the second turns about the joint."""
    scene = rods.weightless()
    links = stiff(stiffness=rods.stiffness(stretch=stretch, bend=10.0, twist=1e3))
    base = scene.add_rod(start=(-LENGTH, 0, 0), end=(0, 0, 0), nodes=2, name="base", **links)
    arm = scene.add_rod(start=(0, 0, 0), end=(LENGTH, 0, 0), nodes=2, name="arm", **links)
    if clamped:
        scene.clamp(base.start, hold="edge")
    if joint is not None:
        scene.join(base.end, arm.start, joint, **({"axis": axis} if joint == "revolute" else {}))
    spring = scene.add_torsion_spring(
        base.edge(0), arm.edge(0), axis=axis, stiffness=stiffness, rest_angle=rest_angle, name="spring"
    )
    return scene, spring


@pytest.mark.case("dynamics", "Frequency of a link on a torsion spring", source="w^2 = k / I")
def test_links_swing_at_the_frequency_of_theory():
    scene, _ = two_links()
    found = scene.build(planar=True).linearise().frequencies(1)[0]
    assert found == pytest.approx(np.sqrt(STIFFNESS / INERTIA) / (2.0 * np.pi), rel=1e-5)


@pytest.mark.case("dynamics", "Frequency of a bar that spins on a torsion spring", source="w^2 = k / J")
def test_links_oscillate_about_their_own_axis_at_the_frequency_of_theory():
    """A rigid bar of moment of inertia J = m r^2 / 2 about its axis: k / J = (2 pi f)^2."""
    scene, _ = two_links((1, 0, 0), joint="revolute")
    simulation = scene.build(planar=False)
    inertia = DENSITY * LENGTH * RADIUS**2 / 2.0
    found = simulation.linearise().frequencies(1)[0]
    assert found == pytest.approx(np.sqrt(STIFFNESS / inertia) / (2.0 * np.pi), rel=1e-6)


@pytest.mark.case("statics", "Arm on a torsion spring, extrapolated", source="F L^2 / k + F L^3 / (3 EI)")
def test_flexible_links_converge_to_the_cantilever_on_a_hinge():
    """Tip of an arm on a hinge with a torsion spring under a small force F: F L^2 / k + F L^3 / (3 EI).

    The spring measures the angle of the first edge's middle, so that errors are of first order in the edge's length.
    """
    force, bend, tips = 1e-6, 2e-3, []
    for nodes in (9, 17, 33):
        scene = rods.weightless()
        base = scene.add_rod(start=(-LENGTH, 0, 0), end=(0, 0, 0), nodes=2, name="base", **stiff())
        more = stiff(stiffness=rods.stiffness(stretch=1e5, bend=bend, twist=bend))
        arm = scene.add_rod(start=(0, 0, 0), end=(LENGTH, 0, 0), nodes=nodes, name="arm", **more)
        scene.clamp(base.start, hold="edge")
        scene.join(base.end, arm.start, "pinned")
        scene.add_torsion_spring(base.edge(0), arm.edge(0), axis=(0, -1, 0), stiffness=STIFFNESS)
        scene.add_force(arm.end, (0, 0, force))
        simulation = scene.build(planar=True, solver=withe.Solver(force_tolerance=1e-12))
        simulation.equilibrium()
        tips.append(simulation.positions("arm")[-1, 2])
    expected = force * LENGTH**2 / STIFFNESS + force * LENGTH**3 / (3.0 * bend)
    errors = np.array(tips) - expected
    measured((2.0 * tips[2] - tips[1]) / expected - 1.0)
    measured_order(np.log2(errors[:-1] / errors[1:]))
    assert errors[:-1] / errors[1:] == pytest.approx(2.0, rel=0.1)
    assert 2.0 * tips[2] - tips[1] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("seed", [5, 6])
def test_the_motion_turns_with_the_scene(seed):
    r = np.random.default_rng(seed)
    turn = rods.rotation(r.normal(size=3), float(r.uniform(0.5, 3.0)))
    axis, points, velocity = r.normal(size=3), r.uniform(-LENGTH, LENGTH, (5, 3)), r.uniform(-0.3, 0.3, (5, 3))
    ends = []
    for by in (np.eye(3), turn):
        scene = rods.weightless()
        first = scene.add_rod(points=points[:3] @ by.T, name="first", **stiff())
        second = scene.add_rod(points=points[3:] @ by.T, name="second", **stiff())
        spring = scene.add_torsion_spring(first.edge(1), second.edge(0), axis=by @ axis, stiffness=0.5, rest_angle=0.4)
        simulation = scene.build(
            time_step=1e-3, adaptive=False, planar=False, solver=withe.Solver(step_tolerance=1e-13)
        )
        for rod in (first, second):
            simulation.set_velocities(rod, velocity[rod.rows] @ by.T)
        simulation.step(50)
        ends.append((simulation.positions() @ by, simulation.get(spring, "angle")))
    assert np.ptp([angle for _, angle in ends]) < 1e-9
    assert abs(ends[0][1]) > 0.02
    assert np.abs(ends[0][0] - ends[1][0]).max() < 1e-9


@pytest.mark.case("statics", "Angle of a torsion spring under a force", source="k phi = F L cos(phi)")
@pytest.mark.parametrize("planar", [True, False])
def test_spring_holds_a_force_and_a_moment_at_the_angle_of_theory(planar):
    """k phi = F L cos(phi) under a dead force across the arm."""
    scene, spring = two_links()
    force = 0.1
    scene.add_force("arm.end", (0, 0, force))
    simulation = scene.build(planar=planar)
    simulation.equilibrium()
    expected = brentq(lambda phi: STIFFNESS * phi - force * LENGTH * np.cos(phi), 0.0, 1.5)
    assert simulation.get(spring, "angle") == pytest.approx(expected, abs=1e-6)
    tip = simulation.positions("arm")[-1] - simulation.positions("arm")[0]
    assert np.arctan2(tip[2], tip[0]) == pytest.approx(expected, abs=1e-6)


def test_spring_resists_twist_about_its_axis_too():
    """Two links on one line, free to turn about it: theta = M / k."""
    scene, spring = two_links((1, 0, 0))
    scene.add_moment("arm.end", (0.006, 0, 0))
    simulation = scene.build(planar=False)
    simulation.step(1)
    simulation.equilibrium()
    assert simulation.get(spring, "angle") == pytest.approx(0.006 / STIFFNESS, abs=1e-5)


@pytest.mark.parametrize("space", [False, True])
@pytest.mark.parametrize("joint", [None, "pinned"])
@pytest.mark.parametrize("seed", [1, 2])
def test_free_links_keep_energy_and_momenta_to_rounding(space, joint, seed):
    r = np.random.default_rng(seed)
    scene, spring = two_links(
        AXES["space" if space else "plane"], clamped=False, joint=joint, rest_angle=0.7, stiffness=0.5, stretch=1e3
    )
    simulation = scene.build(
        integrator="energy_momentum", time_step=1e-3, adaptive=False, planar=False,
        solver=withe.Solver(step_tolerance=1e-14, force_tolerance=1e-13),
    )  # fmt: skip
    velocity = r.uniform(-0.3, 0.3, (len(simulation.positions()), 3)) * (1, space, 1)
    for rod in simulation.rods:
        simulation.set_velocities(rod, velocity[rod.rows])
    start, energy = simulation.momentum(), simulation.energy()
    angles = []
    for _ in range(60):
        simulation.step(3)
        angles.append(simulation.get(spring, "angle"))
    now = simulation.momentum()
    assert np.ptp(angles) > 0.3
    assert simulation.energy().total == pytest.approx(energy.total, rel=1e-10)
    scale = DENSITY * LENGTH * 0.3
    assert np.abs(now.linear - start.linear).max() < 1e-11 * scale
    assert np.abs(now.angular - start.angular).max() < 1e-10 * scale * LENGTH


def test_energy_of_the_spring_is_that_of_its_angle():
    scene, spring = two_links(AXES["space"], rest_angle=0.4)
    simulation = scene.build(time_step=2e-3, planar=False)
    simulation.step(20)
    deviation = simulation.get(spring, "angle") - 0.4
    assert simulation.energy().spring == pytest.approx(0.5 * STIFFNESS * deviation**2, rel=1e-12)


@pytest.mark.parametrize("seed", [3, 4])
def test_a_ramp_of_rest_angle_and_stiffness_is_booked_as_work(seed):
    r = np.random.default_rng(seed)
    scene, spring = two_links(AXES["space"])
    simulation = scene.build(time_step=1e-3, planar=False)
    before = simulation.energy()
    target = float(r.uniform(-1.0, 1.0))
    simulation.set(spring, rest_angle=target, over=0.02)
    simulation.set(spring, stiffness=2.0 * STIFFNESS, over=0.03)
    simulation.step(10)
    assert simulation.get(spring, "rest_angle") == pytest.approx(0.5 * target, rel=1e-12)
    copy = simulation.copy()
    copy.restore(simulation.snapshot())
    for each in (simulation, copy):
        each.step(40)
        assert each.get(spring, "rest_angle") == target
        assert each.get(spring, "stiffness") == 2.0 * STIFFNESS
    assert np.array_equal(simulation.positions(), copy.positions())
    now = simulation.energy()
    assert now.work > 0.0
    assert now.total - now.work == pytest.approx(before.total - before.work, abs=1e-9 * now.work)


def test_setting_at_once_ends_a_ramp_and_leaves_the_other_alone():
    scene, spring = two_links()
    simulation = scene.build(time_step=1e-3)
    simulation.set(spring, rest_angle=0.5, stiffness=2.0 * STIFFNESS, over=0.01)
    simulation.step(5)
    simulation.set(spring, rest_angle=0.1)
    simulation.step(5)
    assert simulation.get(spring, "rest_angle") == 0.1
    assert simulation.get(spring, "stiffness") == 2.0 * STIFFNESS


@pytest.mark.parametrize("planar", [True, False])
def test_gradients_of_equilibria_are_those_of_differences(planar):
    scene, spring = two_links(rest_angle=0.3, joint="revolute")
    scene.add_force("arm.end", (0, 0, 0.1))
    simulation = scene.build(planar=planar, solver=withe.Solver(force_tolerance=1e-12))
    by = np.zeros((3, 3))
    by[-1] = (0.3, 0.0, 1.0)
    found = simulation.equilibrium().gradient(by, wrt=[(spring, "stiffness"), (spring, "rest_angle")])
    for word, gradient in zip(("stiffness", "rest_angle"), found, strict=True):
        value = simulation.get(spring, word)
        losses = []
        for sign in (1, -1):
            simulation.set(spring, **{word: value + sign * 1e-5})
            simulation.equilibrium()
            losses.append(np.vdot(by, simulation.positions()))
        simulation.set(spring, **{word: value})
        assert gradient == pytest.approx((losses[0] - losses[1]) / 2e-5, rel=1e-5)


@pytest.mark.parametrize("integrator", ["energy_momentum", "backward_euler", "implicit_midpoint"])
@pytest.mark.parametrize("space", [False, True])
def test_gradients_of_runs_are_those_of_differences(integrator, space):
    """Derivatives by a parameter, by the start of the run, and by the target of a ramp that starts during the run."""

    def end_of(stiffness, target, speed=0.1, *, differentiable=False):
        scene, spring = two_links(
            AXES["space" if space else "plane"], clamped=False, stiffness=stiffness, rest_angle=0.2
        )
        simulation = scene.build(
            integrator=integrator, time_step=2e-3, adaptive=False, planar=not space,
            solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12),
        )  # fmt: skip

        simulation.set_velocities(None, speed * way)

        def before(s):
            if abs(s.time - 0.02) < 1e-6:
                s.set(spring, rest_angle=target, over=0.02)

        record = simulation.run(0.06, 0.06, progress=False, before_step=before, differentiable=differentiable)
        return record, float(np.vdot(weights, simulation.positions())), spring

    weights, way = np.random.default_rng(5).uniform(-1, 1, (2, 3, 3)) * (1, space, 1)
    record, _, spring = end_of(STIFFNESS, 0.9, differentiable=True)
    by = np.zeros((2, 3, 3))
    by[-1] = weights
    found = record.gradient({"positions": by}, wrt=[(spring, "stiffness"), "initial_velocities"])
    h = 1e-5
    by_stiffness = (end_of(STIFFNESS + h, 0.9)[1] - end_of(STIFFNESS - h, 0.9)[1]) / (2 * h)
    by_target = (end_of(STIFFNESS, 0.9 + h)[1] - end_of(STIFFNESS, 0.9 - h)[1]) / (2 * h)
    by_speed = (end_of(STIFFNESS, 0.9, 0.1 + h)[1] - end_of(STIFFNESS, 0.9, 0.1 - h)[1]) / (2 * h)
    assert found[0] == pytest.approx(by_stiffness, rel=1e-5)
    assert np.vdot(found[1], way) == pytest.approx(by_speed, rel=1e-5)
    assert found.calls[0].gradients["rest_angle"] == pytest.approx(by_target, rel=1e-5)


def test_batches_set_and_read_each_simulation():
    scene, spring = two_links()
    batch = scene.build_batch(3)
    batch.set(spring, rest_angle=[0.1, 0.2, 0.3], over=0.004)
    batch.step(10)
    assert batch.get(spring, "rest_angle") == pytest.approx([0.1, 0.2, 0.3])
    assert np.all(np.diff(batch.get(spring, "angle")) > 0.0)


def test_records_keep_it_and_pictures_draw_it(tmp_path):
    scene, spring = two_links()
    record = scene.build().run(0.01, progress=False)
    record.save(tmp_path / "record.npz")
    assert spring.name in [each.name for each in withe.Record.load(tmp_path / "record.npz").tendons]
    record.plot()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"stiffness": -1.0}, "stiffness of torsion spring 'spring 2' must not be negative"),
        ({"stiffness": 1.0, "axis": (0, 0, 0)}, "axis of torsion spring"),
        (
            {"stiffness": 1.0, "axis": None},
            "axis of torsion spring 'spring 2' must be given, since both edges are drawn along one line",
        ),
        ({"stiffness": 1.0, "rest_angle": np.nan}, "rest_angle of torsion spring 'spring 2'"),
    ],
)
def test_bad_numbers_are_refused(words, message):
    scene, _ = two_links()
    with pytest.raises(ValueError, match=message):
        scene.add_torsion_spring("base.edge(0)", "arm.edge(0)", name="spring 2", **{"axis": (0, 1, 0)} | words)


def test_what_is_not_ramped_must_be_set_at_once():
    scene, spring = two_links()
    simulation = scene.build()
    with pytest.raises(ValueError, match=r"youngs_modulus of rod 'arm' must be set without over=|cannot be set"):
        simulation.set("arm", youngs_modulus=1e6, over=0.1)
    with pytest.raises(ValueError, match="has no 'angle' to set"):
        simulation.set(spring, angle=0.1)
