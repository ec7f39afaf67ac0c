"""Tendons through guides, against strains that minimise the energy of a section, elastica, and conservation."""

import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve, minimize

import rods
import withe
from cases import measured
from convergence import assert_order

SCHEMES = ("backward_euler", "implicit_midpoint", "energy_momentum", "fourth_order", "verlet")
LENGTH, EI, GJ, EA, TENSION, OFFSET = 0.3, 5e-3, 4e-3, 400.0, 0.8, 6e-3
SOFT = {"stiffness": rods.stiffness(bend=EI, twist=GJ, stretch=EA), "line_density": 0.1, "radius": 5e-3}


def arm(scene, nodes, turn=None, **options):
    turn = np.eye(3) if turn is None else turn
    ends = {"start": (0, 0, 0), "end": turn @ (0, 0, LENGTH), "normal": turn @ (1, 0, 0)}
    return scene.add_rod(nodes=nodes, name="arm", **ends, **SOFT, **options)


def settle(scene, **options):
    simulation = scene.build(integrator="static", **options)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", withe.OutOfPlaneWarning)
        found = simulation.equilibrium()
    return simulation, found


def strains_of_least_energy(tensions, offsets, slopes):
    """Curvatures towards d1 and d2 [1/m], twist [rad/m] and stretch: without loads every section has its own minimum.

    Of EI (k1^2 + k2^2) / 2 + GJ u3^2 / 2 + EA (v - 1)^2 / 2 + sum T |v t + u x r + r'|, u = k1 d2 - k2 d1 + u3 t.
    """

    def energy(x):
        k1, k2, twist, stretch = x
        out = 0.5 * EI * (k1**2 + k2**2) + 0.5 * GJ * twist**2 + 0.5 * EA * (stretch - 1.0) ** 2
        for tension, r, slope in zip(tensions, offsets, slopes, strict=True):
            along = np.cross((-k2, k1, twist), (*r, 0.0)) + np.array((*slope, stretch))
            out += tension * np.linalg.norm(along)
        return out

    return minimize(energy, (0.0, 0.0, 0.0, 1.0), method="BFGS", options={"gtol": 1e-11}).x


@pytest.mark.case(
    "actuation", "Tip of an arm with a straight tendon", source="section of least energy [Rucker and Webster 2011]"
)
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("offset", [OFFSET, -2.0 * OFFSET])
def test_a_straight_tendon_bends_a_rod_to_an_arc(planar, offset):
    curvature, _, _, stretch = strains_of_least_energy([TENSION], [(offset, 0.0)], [(0.0, 0.0)])
    assert abs(curvature) == pytest.approx(TENSION * abs(offset) / EI, rel=1e-3)
    tip = stretch * np.array((1.0 - np.cos(curvature * LENGTH), 0.0, np.sin(curvature * LENGTH))) / curvature
    errors = []
    for nodes in (11, 21, 41, 81):
        scene = rods.weightless()
        rod = arm(scene, nodes)
        support = scene.clamp(rod.start)
        tendon = scene.add_tendon(rod, offset=(offset, 0), tension=TENSION)
        simulation, found = settle(scene, planar=planar)
        assert found.stable
        errors.append(np.linalg.norm(simulation.positions(rod)[-1] - tip))
        length = LENGTH * (stretch - curvature * offset)
        assert simulation.tendon_length(tendon) == pytest.approx(length, rel=2.0 / nodes**2)
        reaction = simulation.reaction(support)
        np.testing.assert_allclose(reaction.force, 0.0, atol=1e-10)
        np.testing.assert_allclose(reaction.moment, 0.0, atol=1e-12)
    measured(errors[-1] / LENGTH, "L")
    assert errors[0] < 3e-3 * np.linalg.norm(tip[:1])
    assert_order(np.array(errors), order=2.0, slack=0.2)


@pytest.mark.parametrize("seed", range(4))
def test_what_a_motor_takes_in_of_a_straight_tendon_is_that_of_an_arc_on_any_mesh(seed):
    """The section has least energy; half an edge at the free end counts as an arc."""
    random = np.random.default_rng([62, seed])
    bend, offset = random.uniform(2e-3, 8e-3, 2), random.uniform(-8e-3, 8e-3, 2)
    curvature = TENSION * offset / bend
    for nodes in (4, 11, 41):
        scene = rods.weightless()
        stiffness = withe.Stiffness(stretch=1e9, bend=tuple(bend), twist=1e3)
        rod = scene.add_rod(
            start=(0, 0, 0),
            end=(0, 0, LENGTH),
            nodes=nodes,
            normal=(1, 0, 0),
            stiffness=stiffness,
            line_density=0.1,
            radius=5e-3,
        )
        scene.clamp(rod.start)
        tendon = scene.add_tendon(rod, offset=tuple(offset), tension=TENSION)
        simulation, _ = settle(scene)
        taken = LENGTH - simulation.tendon_length(tendon)
        turn = LENGTH / (nodes - 1) * np.linalg.norm(curvature)
        assert taken == pytest.approx(LENGTH * curvature @ offset, rel=0.2 * turn**2 + 1e-5)


@pytest.mark.case("actuation", "Curvature of an arm up to the whole tendon", source="q / h, q = T h^2 / EI")
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("twigs", [(), (20, 45)], ids=["bare", "with twigs"])
def test_a_tendon_bends_its_rod_until_nothing_of_it_is_left(planar, twigs):
    """A tendon of length L (1 - q), q = T h^2 / EI, leaves a stable arc of curvature q / h for every q below 1.

    At a frame (a clamp, or a node with another rod joined) an edge turns by 5/12 of an edge's rotation, and by 13/12 at
    its other end. A piece of tendon as long as the edge would therefore be used up at q = 12/13.
    """
    offset = 0.025
    soft = {"stiffness": rods.stiffness(bend=EI, twist=GJ, stretch=1e7), "line_density": 0.1, "radius": 5e-3}
    scene = rods.weightless()
    rod = scene.add_rod(start=(0, 0, 0), end=(0, 0, LENGTH), nodes=61, normal=(1, 0, 0), **soft)
    for node in twigs:
        root = np.array((0.0, 0.0, LENGTH * node / 60))
        scene.join(rod.node(node), scene.add_rod(start=root, end=root - (0.02, 0, 0), nodes=4, **soft).start)
    scene.clamp(rod.start)
    tendon = scene.add_tendon(rod, offset=(offset, 0), tension=0.0)
    simulation = scene.build(integrator="static", planar=planar)
    for q in (0.5, 0.9, 0.95, 0.99):
        simulation.set(tendon, tension=q * EI / offset**2)
        found = simulation.equilibrium()
        assert found.stable
        assert not found.branch_changed
        np.testing.assert_allclose(np.abs(simulation.curvatures(rod)[:, 0]), q / offset, rtol=1e-4)


@pytest.mark.case("actuation", "Curvature of an arm, 11 to 41 nodes", source="T h / EI")
@pytest.mark.parametrize("nodes", [11, 21, 41])
def test_arcs_have_the_curvature_of_theory_to_fourth_order_in_the_turn_of_an_edge(nodes):
    scene = rods.weightless()
    rod = scene.add_rod(
        start=(0, 0, 0), end=(0, 0, LENGTH), nodes=nodes, radius=5e-3, normal=(1, 0, 0),
        stiffness=rods.stiffness(bend=EI, twist=GJ, stretch=1e6), line_density=0.1,
    )  # fmt: skip
    scene.clamp(rod.start)
    tension = 1.2 * EI / (OFFSET * LENGTH)  # for a turn of 1.2 rad in all
    scene.add_tendon(rod, offset=(OFFSET, 0), tension=tension)
    simulation, _ = settle(scene)
    turn = 1.2 / (nodes - 1)
    np.testing.assert_allclose(simulation.curvatures(rod)[:, 0], 1.2 / LENGTH, rtol=0.02 * turn**4 + 1e-7)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("place", ["start", "middle", "end"])
@pytest.mark.parametrize("pulled", ["tendon", "moment", "follower"])
def test_a_clamp_takes_hold_of_a_bent_rod_without_moving_it(pulled, place, planar):
    """If a moment acts, or a tendon ends, the half edge in between is bent as the rod is, which costs nothing."""
    scene = rods.weightless()
    rod = arm(scene, 11)
    scene.clamp(rod.end if place == "start" else rod.start)
    node = {"start": rod.start, "middle": rod.node(5), "end": rod.end}[place]
    if pulled == "tendon":
        scene.add_tendon(rod, offset=(OFFSET, 0), tension=TENSION)
    else:
        scene.add_moment(node, (0, TENSION * OFFSET, 0), follower=pulled == "follower")
    simulation = scene.build(planar=planar, integrator="energy_momentum", time_step=5e-4)
    assert simulation.equilibrium().stable
    before, shape = simulation.energy(), simulation.positions()
    hold = simulation.clamp(node)
    simulation.step(20)
    energy = simulation.energy()
    np.testing.assert_allclose(simulation.positions(), shape, atol=1e-9)
    assert energy.total - energy.work == pytest.approx(before.total, rel=1e-8)
    simulation.release(hold)
    simulation.step(20)
    np.testing.assert_allclose(simulation.positions(), shape, atol=1e-9)


def test_a_tendon_that_is_drawn_from_tip_to_base_does_the_same():
    tips = []
    for backwards in (False, True):
        scene = rods.weightless()
        rod = arm(scene, 16)
        scene.clamp(rod.start)
        guides = [rod.start, *(rod.edge(i) for i in range(15)), rod.end]
        scene.add_tendon(guides[::-1] if backwards else rod, offset=(OFFSET, -OFFSET), tension=TENSION)
        simulation, _ = settle(scene)
        tips.append(simulation.positions(rod))
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-12)


@pytest.mark.case(
    "actuation", "Strains by tendons that wind about an arm", source="section of least energy [Rucker and Webster 2011]"
)
@pytest.mark.parametrize("turns", [0.0, 0.5, pytest.param(2.0, marks=pytest.mark.slow)])
def test_tendons_that_wind_about_a_rod_bend_and_twist_it(turns):
    """One that winds and a straight one."""
    rate = 2.0 * np.pi * turns / LENGTH

    def winding(s):
        r = OFFSET * np.array((np.cos(rate * s), np.sin(rate * s)))
        return r, rate * np.array((-r[1], r[0]))

    errors = []
    for nodes in (41, 81):
        scene = rods.weightless()
        rod = arm(scene, nodes)
        scene.clamp(rod.start)
        length = LENGTH / (nodes - 1)
        places = np.array([0.0, *(np.arange(nodes - 1) + 0.5), nodes - 1]) * length
        scene.add_tendon(rod, offset=np.array([winding(s)[0] for s in places]), tension=2.0 * TENSION)
        scene.add_tendon(rod, offset=(0, OFFSET), tension=TENSION)
        simulation, _ = settle(scene, planar=False)
        seen = np.column_stack([simulation.curvatures(rod), simulation.twists(rod)])
        exact = []
        for node in range(1, nodes - 1):
            r, slope = winding(node * length)
            exact.append(strains_of_least_energy([2.0 * TENSION, TENSION], [r, (0, OFFSET)], [slope, (0.0, 0.0)])[:3])
        errors.append(np.abs(seen - exact)[1:-1].max())
    if turns:
        assert np.abs(simulation.twists(rod)).min() > 0.1
    measured(errors[-1] / np.abs(exact).max())
    assert errors[0] < 1e-2 * np.abs(exact).max()
    assert errors[1] < 0.3 * errors[0] + 5e-6  # which differences leave of the minimum


@pytest.mark.case("actuation", "Tip of an arm with a tendon along its chord", source="elastica")
def test_a_tendon_from_the_base_to_the_tip_pulls_along_its_chord():
    """Elastica of a cantilever: from the tip back, EI theta' is the moment of T about each section."""
    scene = rods.weightless()
    rod = arm(scene, 201)
    scene.clamp(rod.start)
    height, tension = 0.04, 0.4
    scene.add_tendon([rod.start, rod.end], offset=(height, 0), tension=tension)
    simulation, _ = settle(scene, planar=True)
    base = np.array((height, 0.0))

    def shape(unknown):
        tip, angle = unknown[:2], unknown[2]
        guide = tip + height * np.array((np.cos(angle), -np.sin(angle)))
        force = tension * (base - guide) / np.linalg.norm(base - guide)

        def back(_, y):
            x, z, a = y
            arm = guide - (x, z)
            moment = arm[1] * force[0] - arm[0] * force[1]  # about y, which turns z to x
            return -np.sin(a), -np.cos(a), -moment / EI

        return solve_ivp(back, (0.0, LENGTH), (*tip, angle), rtol=1e-10, atol=1e-12).y[:, -1]

    near = simulation.positions(rod)[-1]
    found = fsolve(shape, (near[0], near[2], np.arctan2(near[0], near[2])), xtol=1e-12)
    measured((near[[0, 2]] - found[:2]) / LENGTH, "L")
    np.testing.assert_allclose(near[[0, 2]], found[:2], atol=2.0 * LENGTH * tension / EA)
    assert found[2] > 0.5


@pytest.mark.parametrize("planar", [True, False])
def test_a_tendon_buckles_a_rod_only_where_it_leaves_it(planar):
    """From the base to the tip its chord goes through the base: pi^2 EI / L^2. Guides all along never let it."""
    critical = np.pi**2 * EI / LENGTH**2
    hardly = rods.stiffness(bend=EI, twist=GJ, stretch=1e5)
    for share in (0.99, 1.01):
        scene = rods.weightless()
        rod = scene.add_rod(
            start=(0, 0, 0), end=(0, 0, LENGTH), nodes=81, radius=1e-4, stiffness=hardly, line_density=0.1
        )
        scene.clamp(rod.start)
        scene.add_tendon([rod.start, rod.end], offset=(0, 0), tension=share * critical)
        simulation, found = settle(scene, planar=planar)
        assert found.stable
        across = np.linalg.norm(simulation.positions(rod)[:, :2], axis=1).max()
        assert (across < 1e-9) if share < 1.0 else (across > 0.02 * LENGTH)
    scene = rods.weightless()
    rod = arm(scene, 41)
    scene.clamp(rod.start)
    tendon = scene.add_tendon(rod, offset=(0, 0))
    simulation = scene.build(integrator="static", planar=planar)
    before = simulation.linearise().frequencies(1)[0]
    simulation.set(tendon, tension=5.0 * critical)
    assert simulation.equilibrium().stable
    assert simulation.linearise().frequencies(1)[0] == pytest.approx(before, rel=0.05)  # shorter by T / EA


def flying(planar, integrator, step, turn, fresh, **options):
    """A free arm with two tendons, on which nothing else acts."""
    scene = rods.weightless()
    rod = arm(scene, 12, turn)
    guides = [rod.start, rod.edge(2), rod.edge(3), rod.edge(7), rod.end]
    across = 0.0 if planar else OFFSET
    tendons = [
        scene.add_tendon(rod, offset=(OFFSET, across), tension=TENSION),
        scene.add_tendon(guides, offset=(-OFFSET, 0.5 * across), tension=0.3 * TENSION),
    ]
    tight = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)} if integrator != "verlet" else {}
    simulation = scene.build(planar=planar, integrator=integrator, time_step=step, **tight, **options)
    velocities = fresh.normal(size=(12, 3)) * (0.2, 0.0 if planar else 0.2, 0.2)
    simulation.set_velocities(None, velocities @ turn.T)
    return simulation, tendons


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("planar", [True, False])
def test_momentum_is_kept_and_work_booked(planar, integrator):
    fresh = np.random.default_rng(5)
    for _ in range(3):
        simulation, tendons = flying(planar, integrator, 3e-4, np.eye(3), fresh)
        before, start = simulation.momentum(), simulation.energy().total
        lengths = simulation.tendon_length(tendons[0])
        simulation.run(0.04, progress=False)
        simulation.set(tendons[1], tension=0.0)
        half = simulation.energy()
        simulation.run(0.04, progress=False)
        after, energy = simulation.momentum(), simulation.energy()
        np.testing.assert_allclose(after.linear, before.linear, atol=1e-10)
        np.testing.assert_allclose(after.angular, before.angular, atol=1e-12)
        if integrator == "energy_momentum":
            assert energy.total - energy.work - start == pytest.approx(0.0, abs=1e-9 * energy.kinetic)
            done = TENSION * (simulation.tendon_length(tendons[0]) - lengths)
            other = energy.loads - done
            assert abs(other) < abs(0.3 * TENSION * 0.1 * LENGTH)
            assert half.loads != energy.loads


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("kind", ["rigid", "revolute", "pinned"])
def test_momentum_is_kept_and_work_booked_where_tendons_end_at_joints(kind, planar, integrator):
    fresh = np.random.default_rng(11)
    across = 0.0 if planar else 1.0
    for nodes in (4, 7):
        scene = rods.weightless()
        bent = (0.15, 0.05 * across, 0.08)
        a = scene.add_rod(start=(-0.2, 0.02 * across, 0.03), end=(0, 0, 0), nodes=nodes, normal=(0, 1, 0), **SOFT)
        b = scene.add_rod(start=(0, 0, 0), end=bent, nodes=nodes + 1, normal=(0, 1, 0), **SOFT)
        axis = (0, 1, 0) if planar else (0.3, 0.9, -0.2)
        hinge = {"axis": axis, "stiffness": 0.02, "rest_angle": 0.3} if kind == "revolute" else {}
        scene.join(a.end, b.start, kind, **hinge)
        offset = (0.004 * across, OFFSET)
        scene.add_tendon(a, offset=offset, tension=0.5)
        scene.add_tendon([a.edge(-2), a.end, b.edge(0), b.edge(2), b.end], offset=offset, tension=0.4)
        scene.add_tendon([b.end, b.edge(1), b.start], offset=(0.002 * across, -OFFSET), tension=0.3)
        tight = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
        simulation = scene.build(planar=planar, integrator=integrator, time_step=3e-4, **tight)
        simulation.set_velocities(None, fresh.normal(size=simulation.positions().shape) * (0.2, 0.2 * across, 0.2))
        before, start = simulation.momentum(), simulation.energy().total
        simulation.run(0.06, progress=False)
        after, energy = simulation.momentum(), simulation.energy()
        np.testing.assert_allclose(after.linear, before.linear, atol=1e-12)
        np.testing.assert_allclose(after.angular, before.angular, atol=1e-12)
        if integrator == "energy_momentum":
            assert energy.total - energy.work - start == pytest.approx(0.0, abs=1e-9 * energy.kinetic)


def test_the_same_tendons_turned_in_space_do_the_same():
    turn = rods.rotation((0.3, -0.5, 0.8), 1.1)
    seen = []
    for of in (np.eye(3), turn):
        simulation, tendons = flying(False, "implicit_midpoint", 3e-4, of, np.random.default_rng(2))
        simulation.run(0.05, progress=False)
        seen.append((simulation.positions() @ of, simulation.tendon_points(tendons[1]) @ of))
    np.testing.assert_allclose(seen[0][0], seen[1][0], atol=1e-9)
    np.testing.assert_allclose(seen[0][1], seen[1][1], atol=1e-9)


@pytest.mark.parametrize("integrator", SCHEMES)
def test_a_plane_and_space_have_the_same_tendons(integrator):
    seen = []
    step = 1e-5 if integrator == "verlet" else 3e-4
    for planar in (True, False):
        scene = rods.weightless()
        rod = arm(scene, 12)
        scene.clamp(rod.start)
        scene.add_tendon(rod, offset=(OFFSET, 0), tension=TENSION)
        tendon = scene.add_tendon([rod.start, rod.edge(4), rod.end], offset=(-OFFSET, 0), tension=0.2 * TENSION)
        scene.add_force(rod.end, (0.02, 0.0, 0.01))
        simulation = scene.build(planar=planar, integrator=integrator, time_step=step)
        simulation.run(0.06, progress=False)
        seen.append((simulation.positions(), simulation.tendon_points(tendon)))
    np.testing.assert_allclose(seen[0][0], seen[1][0], atol=1e-7)
    np.testing.assert_allclose(seen[0][1], seen[1][1], atol=1e-7)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_pulled_arms_converge_at_second_order(integrator, planar):
    tips = []
    for step in (8e-4, 4e-4, 2e-4, 1e-4):
        scene = rods.weightless()
        rod = arm(scene, 7)
        scene.clamp(rod.start)
        tendon = scene.add_tendon(rod, offset=(OFFSET, 0 if planar else 0.4 * OFFSET))
        simulation = scene.build(planar=planar, integrator=integrator, time_step=step, adaptive=False)

        def pull(of, tendon=tendon, step=step):
            of.set(tendon, tension=TENSION * np.sin(np.pi * (of.time + 0.5 * step) / 0.05) ** 2)

        simulation.run(0.05, before_step=pull, progress=False)
        tips.append(simulation.positions(rod)[-1])
    assert_order(np.linalg.norm(np.diff(tips, axis=0), axis=1), order=2.0, slack=0.3)


def test_tendons_between_rods_of_a_gripper_close_it_and_leave_its_base_at_rest():
    """From the tip of one finger through the palm to the other's: forces and moments on the whole are in balance."""
    scene = rods.weightless()
    palm = scene.add_rod(start=(-0.05, 0, 0), end=(0.05, 0, 0), nodes=6, **SOFT)
    fingers = [
        scene.add_rod(start=(x, 0, 0), end=(x, 0, 0.2), nodes=9, normal=(1, 0, 0), **SOFT) for x in (-0.05, 0.05)
    ]
    scene.join(palm.start, fingers[0].start)
    scene.join(palm.end, fingers[1].start)
    support = scene.clamp(palm.node(3))
    inwards = [fingers[0].edge(i) for i in range(7, -1, -1)], [fingers[1].edge(i) for i in range(8)]
    guides = [*inwards[0], palm.edge(2), *inwards[1]]
    offsets = [(OFFSET, 0)] * 8 + [(0, 0)] + [(-OFFSET, 0)] * 8
    scene.add_tendon(guides, offset=offsets, tension=TENSION)
    simulation, found = settle(scene)
    assert found.stable
    tips = [simulation.positions(finger)[-1] for finger in fingers]
    assert tips[1][0] - tips[0][0] < 0.1 - 2.0 * 0.5 * (TENSION * OFFSET / EI) * 0.15**2
    reaction = simulation.reaction(support)
    np.testing.assert_allclose(reaction.force, 0.0, atol=1e-10)
    np.testing.assert_allclose(reaction.moment, 0.0, atol=1e-12)
