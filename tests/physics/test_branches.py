"""Equilibria follow their branch, say where they leave it, and are traced through limit points."""

import warnings

import numpy as np
import pytest

import rods
import withe
from cases import measured, measured_order

LEE = {"stretch": 7.2e6 * 6.0, "bend": 7.2e6 * 2.0, "length": 120.0}


def propped_beam(edges):
    """A clamped beam of unit length and bending stiffness whose end may slide along it."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    beam = scene.add_rod(
        start=(0, 0, 0),
        end=(1, 0, 0),
        nodes=edges + 1,
        radius=1e-3,
        normal=(0, 0, 1),
        stiffness=rods.stiffness(stretch=1e6),
        line_density=1.0,
    )
    scene.clamp(beam.start)
    tip = scene.pin(beam.end, free=(1, 0, 0))
    return scene.build(integrator="static", planar=True), beam, tip


@pytest.mark.parametrize("edges", [2, 20, 100, 400])
def test_a_support_that_moves_takes_the_beam_along_one_branch_up_and_down(edges):
    simulation, _, tip = propped_beam(edges)
    there, back = [], []
    for d in (0.1, 0.2, 0.3, 0.4, 0.5):
        simulation.move(tip, position=(1, 0, -d))
        result = simulation.equilibrium()
        assert result.stable
        assert not result.branch_changed
        assert result.iterations <= 8
        there.append(simulation.energy().bend)
    for d in (0.4, 0.3, 0.2, 0.1):
        simulation.move(tip, position=(1, 0, -d))
        assert not simulation.equilibrium().branch_changed
        back.append(simulation.energy().bend)
    assert back == pytest.approx(there[-2::-1], rel=1e-6)
    simulation.move(tip, position=(1, 0, 0.5))
    assert not simulation.equilibrium().branch_changed
    assert simulation.energy().bend == pytest.approx(there[-1], rel=1e-6)
    if edges > 2:
        # Small deflections: 3/2 d^2.
        assert there[0] == pytest.approx(1.5 * 0.1**2, rel=2e-2)


@pytest.mark.parametrize("planar", [True, False])
def test_one_long_move_ends_where_many_short_ones_do(planar):
    def turned(count):
        scene = withe.Scene(gravity=(0.0, 0.0, -2.0))
        arm = rods.straight(scene, 31, stiffness=rods.stiffness(stretch=1e5))
        hand = scene.clamp(arm.start)
        scene.pin(arm.end)
        simulation = scene.build(integrator="static", planar=planar)
        for k in range(1, count + 1):
            part = k / count
            angle = 1.2 * part
            simulation.move(hand, position=(0.3 * part, 0, 0.1 * part), tangent=(np.cos(angle), 0, np.sin(angle)))
            result = simulation.equilibrium()
            assert result.stable
        return simulation.positions(arm)

    assert turned(1) == pytest.approx(turned(16), abs=1e-6)


def test_steps_of_the_static_integrator_follow_the_same_branch():
    stepped, beam, tip = propped_beam(100)
    stepped.move(tip, position=(1, 0, -0.5), over=5 * stepped.time_step)
    stepped.step(5)
    found, other_beam, other_tip = propped_beam(100)
    found.move(other_tip, position=(1, 0, -0.5))
    found.equilibrium()
    assert stepped.statistics.branch_changes == 0
    assert stepped.positions(beam) == pytest.approx(found.positions(other_beam), abs=1e-6)


def lee(edges):
    """Lee's frame: a column and a beam, rigidly joined, pinned at their far ends, loaded at a fifth of the beam."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    common = {
        "stiffness": rods.stiffness(stretch=LEE["stretch"], bend=LEE["bend"], twist=LEE["bend"]),
        "line_density": 1.0,
        "radius": 1.0,
        "nodes": edges + 1,
    }
    length = LEE["length"]
    column = scene.add_rod(start=(0, 0, 0), end=(0, 0, length), **common)
    beam = scene.add_rod(start=(0, 0, length), end=(length, 0, length), **common)
    scene.join(column.end, beam.start)
    scene.pin(column.start)
    scene.pin(beam.end)
    return scene, beam.node(edges // 5)


UNIT = LEE["bend"] / LEE["length"] ** 2


def buckled_beam(planar, friction=None):
    """A beam between clamps that are nearer to each other than it is long, on its upper side; its height. `friction`:
    of a floor far below."""
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    x = np.linspace(-0.1, 0.1, 41)
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    beam = scene.add_rod(
        points=np.stack([x, 0.0 * x, 0.01 * (1.0 + np.cos(np.pi * x / 0.1))], axis=1),
        section=withe.Rectangle(width=1e-3, height=10e-3),
        normal=(0, 0, 1),
        material=rubber,
        natural="straight",
    )
    scene.clamp(beam.start)
    scene.clamp(beam.end)
    if friction is not None:
        scene.add_floor(height=-0.5, friction=friction)
    simulation = scene.build(planar=planar)
    assert simulation.equilibrium().stable
    return simulation, beam, simulation.positions(beam)[20, 2]


@pytest.mark.parametrize("friction", [None, 0.4], ids=["alone", "rough floor"])
@pytest.mark.parametrize("planar", [True, False], ids=["planar", "spatial"])
@pytest.mark.parametrize("share", [0.3, 0.05, -0.05, -0.3, -0.6, -0.9, -1.0])
def test_what_is_pushed_through_and_let_go_comes_to_rest_on_the_side_where_it_was(planar, share, friction):
    """Energy alone keeps it there: on its way back to the other side it would have to climb. A floor to rub on, which
    it does not touch, changes nothing; equilibria are then found by unsymmetric matrices."""
    simulation, beam, top = buckled_beam(planar, friction)
    pin = simulation.pin(beam.node(20))
    simulation.move(pin, position=(0.0, 0.0, share * top))
    simulation.equilibrium()
    simulation.release(pin)
    assert simulation.equilibrium().stable
    assert simulation.positions(beam)[20, 2] == pytest.approx(np.copysign(top, share), rel=2e-3)


@pytest.mark.parametrize("share", [0.6, -0.2, -0.6])
def test_what_is_set_to_a_state_between_two_wells_falls_into_its_own(share):
    simulation, beam, top = buckled_beam(True)
    simulation.set_state(beam, positions=simulation.positions(beam) * (1.0, 1.0, share))
    assert simulation.equilibrium().stable
    assert simulation.positions(beam)[20, 2] == pytest.approx(np.copysign(top, share), rel=2e-3)


@pytest.mark.case(
    "stability", "Limit load of Lee's frame, published value", source="18.55 EI / L^2 [Lee, Manuel and Rossow 1968]"
)
def test_limit_loads_of_lees_frame_by_force_and_by_displacement():
    """18.55 EI / L^2 [Lee, Manuel and Rossow 1968], at second order in the mesh; snap-through to a negative load."""
    by_force, by_displacement = [], []
    for edges in (20, 40, 80):
        scene, node = lee(edges)
        load = scene.add_force(node, (0, 0, -UNIT))
        simulation = scene.build(integrator="static", planar=True)
        path = simulation.equilibrium(path="arc_length", load=load, to=20.0)
        assert path.finished
        assert path.load_factors[0] == 0.0
        assert path.load_factors[-1] == pytest.approx(20.0, rel=1e-9)
        assert simulation.get(load, "force")[2] == pytest.approx(-20.0 * UNIT, rel=1e-9)
        first, second = path.limit_points
        assert path.stable[:first].all()
        assert not path.stable[first + 1 : second].any()
        assert path.stable[second + 1 :].all()
        assert path.load_factors[second] < -9.0
        by_force.append(path.load_factors[first])

        scene, node = lee(edges)
        grip = scene.pin(node, free=(1, 0, 0))
        simulation = scene.build(integrator="static", planar=True)
        heights = np.arange(46.0, 52.0, 0.25)
        forces = []
        for drop in heights:
            simulation.move(grip, position=(0, 0, LEE["length"] - drop))
            assert not simulation.equilibrium().branch_changed
            forces.append(-simulation.reaction(grip).force[2] / UNIT)
        top = int(np.argmax(forces))
        by_displacement.append(
            np.polyval(
                parabola := np.polyfit(heights[top - 2 : top + 3], forces[top - 2 : top + 3], 2),
                -0.5 * parabola[1] / parabola[0],
            )
        )
    print("limit loads", by_force, by_displacement)
    for loads in (by_force, by_displacement):
        measured(loads[-1] / 18.55 - 1.0)
        measured_order(np.log2((loads[0] - loads[1]) / (loads[1] - loads[2])))
        assert loads[-1] == pytest.approx(18.55, rel=1e-3)
        assert (loads[0] - loads[1]) / (loads[1] - loads[2]) == pytest.approx(4.0, abs=1.0)
    assert by_displacement == pytest.approx(by_force, rel=1e-4)


def test_a_load_beyond_the_limit_snaps_through_to_the_far_branch_and_says_so():
    scene, node = lee(20)
    load = scene.add_force(node, (0, 0, -UNIT))
    traced = scene.build(integrator="static", planar=True)
    traced.equilibrium(path="arc_length", load=load, to=20.0)

    simulation = scene.build(integrator="static", planar=True)
    changes = []
    for factor in (9.0, 18.0, 18.5, 18.6, 20.0):
        simulation.set(load, force=(0, 0, -factor * UNIT))
        result = simulation.equilibrium()
        assert result.stable
        changes.append(result.branch_changed)
    assert changes == [False, False, False, True, False]
    assert simulation.positions() == pytest.approx(traced.positions(), abs=1e-4)
    for factor in (10.0, 0.0, -9.0, -9.5):
        simulation.set(load, force=(0, 0, -factor * UNIT))
        changes.append(simulation.equilibrium().branch_changed)
    assert changes[-4:] == [False, False, False, True]


def test_a_support_that_moves_beyond_a_limit_point_says_so_and_its_path_is_traced():
    """Pushed down by a support that slides, the frame snaps where the path of displacements turns back."""
    scene, node = lee(20)
    grip = scene.pin(node, free=(1, 0, 0))
    traced = scene.build(integrator="static", planar=True)
    traced.move(grip, position=(0, 0, 20.0))
    path = traced.equilibrium(path="arc_length")
    assert path.finished
    assert path.load_factors[-1] == pytest.approx(1.0, rel=1e-9)
    assert -path.forces(grip)[:, 2].min() / UNIT > 18.0
    turn = 100.0 * path.load_factors[path.limit_points[0]]
    drops = LEE["length"] - path.positions()[:, traced.rods[1].rows][:, 4, 2]
    assert drops == pytest.approx(100.0 * path.load_factors, abs=1e-6)

    simulation = scene.build(integrator="static", planar=True)
    simulation.move(grip, position=(0, 0, LEE["length"] - turn + 0.2))
    assert not simulation.equilibrium().branch_changed
    simulation.move(grip, position=(0, 0, LEE["length"] - turn - 0.2))
    result = simulation.equilibrium()
    assert result.branch_changed
    assert result.stable
    simulation.move(grip, position=(0, 0, 20.0))
    assert not simulation.equilibrium().branch_changed
    assert simulation.positions() == pytest.approx(traced.positions(), abs=1e-4)


def test_a_static_step_that_leaves_its_branch_says_so_once():
    scene, node = lee(20)
    load = scene.add_force(node, (0, 0, 0))
    simulation = scene.build(integrator="static", planar=True)

    def step(factor):
        simulation.set(load, force=(0, 0, -factor * UNIT))
        simulation.step()

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        step(9.0)
        step(18.0)
    other = simulation.copy()
    with pytest.warns(withe.BranchChangedWarning, match="left its branch of equilibria"):
        step(20.0)
    assert simulation.statistics.branch_changes == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        step(-20.0)
    assert simulation.statistics.branch_changes == 2
    other.set(load, force=(0, 0, -20.0 * UNIT))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert other.equilibrium().branch_changed
    batch = withe.Batch([other])
    other.set(load, force=(0, 0, 20.0 * UNIT))
    with pytest.warns(withe.BranchChangedWarning):
        batch.step()


def arch(edges):
    """Clamped at one end, hinged at the other: 215 degrees of a circle of unit radius."""
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    angle = np.radians(np.linspace(-107.5, 107.5, edges + 1))
    curve = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    arc = scene.add_rod(points=curve, stiffness=rods.stiffness(stretch=1e6), line_density=1.0, radius=1e-3)
    scene.clamp(arc.start)
    scene.pin(arc.end)
    return scene, arc.node(edges // 2)


@pytest.mark.case(
    "stability", "Limit load of a deep arch, published value", source="8.97 EI / R^2 [DaDeppo and Schmidt 1975]"
)
def test_limit_load_of_a_deep_arch_by_force_and_by_displacement():
    """8.97 EI / R^2 [DaDeppo and Schmidt 1975], 897 in their numbers."""
    scene, crown = arch(64)
    load = scene.add_force(crown, (0, 0, -1.0))
    simulation = scene.build(integrator="static", planar=True)
    path = simulation.equilibrium(path="arc_length", load=load, to=12.0)
    assert path.finished
    limit = path.load_factors[path.limit_points[0]]
    assert limit == pytest.approx(8.97, rel=1e-3)
    assert path.stable[: path.limit_points[0]].all()
    assert not path.stable[path.limit_points[0] + 1]

    scene, crown = arch(64)
    grip = scene.pin(crown, free=(1, 0, 0))
    simulation = scene.build(integrator="static", planar=True)
    simulation.move(grip, position=(0, 0, -0.25))
    path = simulation.equilibrium(path="arc_length", turn=0.02)
    assert path.finished
    assert -path.forces(grip)[:, 2].min() == pytest.approx(limit, rel=1e-3)


def test_what_a_path_cannot_be_asked_for_is_refused():
    simulation, _, _ = propped_beam(4)
    with pytest.raises(ValueError, match="path"):
        simulation.equilibrium(path="riks")
    with pytest.raises(ValueError, match="start must be 0"):
        simulation.equilibrium(path="arc_length", start=0.5)
    with pytest.raises(ValueError, match="to must differ from start"):
        simulation.equilibrium(path="arc_length", to=0.0)
    scene, node = lee(10)
    load = scene.add_force(node, lambda t: (0, 0, -t))
    with pytest.raises(ValueError, match="function of time"):
        scene.build(integrator="static").equilibrium(path="arc_length", load=load)


@pytest.mark.parametrize("curvature", [10.0, 30.0, -60.0])
def test_muscles_curl_an_arm_along_its_branch(curvature):
    """Through circles of every curvature on the way, and not by a jump: nothing but the muscles bends it."""
    scene = rods.weightless()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=41, radius=4e-3, material=rubber, normal=(0, 1, 0))
    scene.clamp(arm.start)
    simulation = scene.build()
    simulation.set(arm, natural_curvature=(curvature, 0.0))
    found = simulation.equilibrium()
    assert found.stable
    assert not found.branch_changed
    assert simulation.energy().total < 1e-20
    turned = curvature * 0.2
    tip = np.array([np.sin(turned), 1.0 - np.cos(turned)]) / curvature
    np.testing.assert_allclose(simulation.positions(arm)[-1, [0, 1]] ** 2, tip**2, atol=3e-3 * np.abs(tip).max())


@pytest.mark.parametrize(
    "shape",
    [
        {"natural_curvature": (30.0, 10.0)},
        {"natural_twist": 60.0},
        {"natural_stretch": 1.5},
        {"natural_curvature": (-20.0, 30.0), "natural_twist": 40.0, "natural_stretch": 0.7},
    ],
)
@pytest.mark.parametrize("at_once", [True, False])
def test_muscles_move_a_heavy_arm_along_its_branch_at_once_and_in_steps(shape, at_once):
    """One equilibrium far off is that of many on the way there."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.4, density=1200.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0.05), nodes=31, radius=4e-3, material=rubber)
    scene.clamp(arm.start)
    simulation = scene.build(integrator="static", time_step=1.0, planar=False)
    simulation.equilibrium()
    if at_once:
        simulation.set(arm, **shape)
        found = simulation.equilibrium()
        assert found.stable
        assert not found.branch_changed
    else:
        for word, value in shape.items():
            getattr(simulation, f"set_{word}")(arm, value, over=20.0)
        simulation.step(20)  # which would warn of another branch
    small = scene.build(integrator="static", time_step=1.0, planar=False)
    small.equilibrium()
    for word, value in shape.items():
        getattr(small, f"set_{word}")(arm, value, over=100.0)
    small.step(100)
    np.testing.assert_allclose(simulation.positions(arm), small.positions(arm), atol=1e-8)


@pytest.mark.parametrize("share", [0.15, 0.45, 0.75])
def test_a_tendon_bends_an_arm_along_its_branch_at_once_and_in_steps(share):
    """By up to 8.4 rad in one call: the tension grows along the path, and its forces turn with the arm."""
    length, offset, bend = 0.28, 0.025, 8e-3

    def bent(steps):
        scene = rods.weightless()
        arm = scene.add_rod(
            start=(0, 0, 0),
            end=(length, 0, 0),
            nodes=71,
            radius=1e-3,
            normal=(0, 0, 1),
            stiffness=rods.stiffness(stretch=1e6, bend=bend, twist=bend),
            line_density=1.0,
        )
        scene.clamp(arm.start)
        tendon = scene.add_tendon(arm, offset=(offset, 0.0), tension=0.0)
        simulation = scene.build(integrator="static", planar=True)
        for k in range(1, steps + 1):
            simulation.set(tendon, tension=share * bend / offset**2 * k / steps)
            found = simulation.equilibrium()
            assert found.stable
            assert not found.branch_changed
        return simulation.positions(arm)

    assert bent(1) == pytest.approx(bent(10), abs=1e-9 * length)


def pulled_arm(seed, steps):
    """An arm with muscles, a tendon, loads and perhaps a hinge; all grow in so many calls. Flags, and positions."""
    rng = np.random.default_rng([61, seed])
    radius, length, young = rng.uniform(2e-3, 5e-3), 0.2, 10 ** rng.uniform(5.5, 6.5)
    rubber = withe.Material(youngs_modulus=young, poisson_ratio=0.4, density=1000.0)
    bend = young * np.pi * radius**4 / 4
    planar = bool(rng.random() < 0.5)
    scene = rods.weightless()
    nodes = int(rng.integers(8, 30))
    arm = scene.add_rod(
        start=(0, 0, 0), end=(length, 0, 0), nodes=nodes, radius=radius, material=rubber, normal=(0, 0, 1)
    )
    scene.clamp(arm.start)
    tip = arm.end
    if rng.random() < 0.4:
        end = (1.6 * length, 0.0, 0.2 * length * rng.normal())
        hand = scene.add_rod(
            start=(length, 0, 0), end=end, nodes=nodes, radius=radius, material=rubber, normal=(0, 1, 0)
        )
        scene.join(arm.end, hand.start, "revolute", axis=(0, 1, 0), stiffness=bend / length * rng.uniform(0.3, 3.0))
        tip = hand.end
    offset = radius * rng.uniform(1.5, 4.0)
    tendon = scene.add_tendon(arm, offset=(offset, 0.0 if planar else 0.3 * offset * rng.normal()), tension=0.0)
    load = scene.add_force(tip, (0, 0, 0))
    force = rng.normal(size=3) * (1.0, not planar, 1.0) * bend / length**2 * rng.uniform(0.0, 3.0)
    curvature = rng.normal() * np.pi / length * rng.uniform(0.0, 1.5)
    tension = min(bend / offset / length * rng.uniform(0.0, 6.0), 0.8 * bend / offset**2)
    weight = 9.81 * rng.random() * rng.integers(0, 2)
    simulation = scene.build(integrator="static", planar=planar)
    changes = []
    for k in range(1, steps + 1):
        part = k / steps
        simulation.set(arm, natural_curvature=(part * curvature, 0.0))
        simulation.set(load, force=part * force)
        simulation.set(tendon, tension=part * tension)
        simulation.set(gravity=(0.0, 0.0, -part * weight))
        changes.append(simulation.equilibrium().branch_changed)
    return any(changes), simulation.positions() / length


def test_one_call_goes_where_ten_calls_do_and_reports_a_jump_only_where_they_meet_one():
    jumps = 0
    for seed in range(60):
        (at_once, there), (in_steps, reached) = pulled_arm(seed, 1), pulled_arm(seed, 10)
        jumps += in_steps
        if not in_steps:
            assert not at_once, f"seed {seed}"
            assert there == pytest.approx(reached, abs=1e-6), f"seed {seed}"
    assert jumps < 10
