"""Joints carry what they should and nothing else."""

from itertools import pairwise

import numpy as np
import pytest

import rods
import withe
from cases import measured
from convergence import assert_order_at_least


def beam(edges, load, split, stub=0, form="frame", **options):
    """Tip of a cantilever, whole or of two rods; `stub` adds a third rod that hangs free at the joint."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    half = edges // 2
    if split:
        first = scene.add_rod(start=(0, 0, 0), end=(0.5, 0, 0), nodes=half + 1, **parts)
        last = scene.add_rod(start=(0.5, 0, 0), end=(1, 0, 0), nodes=half + 1, **parts)
        scene.join(first.end, last.start, form=form)
        if stub:
            side = scene.add_rod(start=(0.5, 0, 0), end=(0.5, 0, 0.2), nodes=stub + 1, **parts)
            scene.join(first.end, side.start, form=form)
    else:
        first = last = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=edges + 1, **parts)
    scene.clamp(first.start)
    scene.add_force(last.end, load)
    simulation = rods.sharp(scene, **options)
    assert simulation.equilibrium().stable
    return simulation.positions(last)[-1]


LOADS = pytest.mark.parametrize("load", [(0.0, 0.0, -1.0), (0.0, 0.8, -0.6)], ids=["in plane", "aslant"])


@LOADS
def test_two_rods_end_to_end_are_one(load):
    np.testing.assert_allclose(beam(40, load, True), beam(40, load, False), atol=1e-9)


def half_way(edges, put, parts, name):
    """Nodes of a cantilever of one, two or four rods in a row, with what `put(scene, node)` puts half-way along it."""
    scene = rods.weightless()
    corners = np.linspace(0.0, 1.0, parts + 1)
    row = [
        scene.add_rod(
            start=(a, 0, 0),
            end=(b, 0, 0),
            nodes=edges // parts + 1,
            stiffness=rods.stiffness(),
            line_density=1.0,
            radius=1e-3,
        )
        for a, b in pairwise(corners)
    ]
    for one, next_one in pairwise(row):
        scene.join(one.end, next_one.start)
    scene.clamp(row[0].start)
    before, after = row[(parts - 1) // 2], row[parts // 2]
    put(scene, before.node(edges // 2) if parts == 1 else before.end if name == "end" else after.start)
    simulation = rods.sharp(scene, planar=False)
    simulation.equilibrium()
    directors = simulation.directors(row[-1])[-1]
    return np.vstack([simulation.positions(row[-1])[-1], directors])


@pytest.mark.parametrize("follower", [False, True])
@pytest.mark.parametrize("kind", ["force", "moment"])
@pytest.mark.parametrize(("parts", "name"), [(2, "end"), (2, "start"), (4, "end"), (4, "start")])
def test_loads_where_rods_are_joined_in_a_row_act_as_on_one_rod(parts, name, kind, follower):
    """By the end of one rod and by the start of the next, which are the same node."""

    def put(scene, node):
        if kind == "force":
            scene.add_force(node, (0.2, 1.0, -0.5), follower=follower)
        else:
            scene.add_moment(node, (0.3, 0.5, -1.0), follower=follower)

    np.testing.assert_allclose(half_way(8, put, parts, name), half_way(8, put, 1, name), atol=1e-9)


@pytest.mark.case("statics", "Deflection by a moment in the middle of a beam", source="M h (L - h / 2) / EI")
def test_a_moment_half_way_bends_and_twists_as_beams_do():
    """M h (L - h / 2) of deflection, T h of twist, for unit stiffnesses, at second order."""
    errors = []
    for edges in (8, 16, 32):
        tip = half_way(edges, lambda scene, node: scene.add_moment(node, (0.0, 0.0, 1e-4)), 2, "start")
        errors.append(tip[0, 1] / (1e-4 * 0.5 * 0.75) - 1.0)
        still, turned = (
            half_way(edges, lambda scene, node, M=M: scene.add_moment(node, (M, 0.0, 0.0)), 2, "start")
            for M in (0.0, 1e-3)
        )
        assert np.linalg.norm(np.cross(still[1], turned[1])) == pytest.approx(0.5e-3, rel=1e-6)
    measured(errors[-1])
    assert abs(errors[-1]) < 3e-4
    assert_order_at_least(errors, 2.0)


def test_a_follower_force_within_a_rod_acts_alike_whichever_end_the_rod_is_drawn_from():
    """And its error is of second order."""
    tips = []
    for edges in (20, 40, 80, 160):
        ends = []
        for way in (1, -1):
            scene = rods.weightless()
            points = np.stack([np.linspace(0.0, 1.0, edges + 1), *np.zeros((2, edges + 1))], axis=1)[::way]
            rod = scene.add_rod(points=points, stiffness=rods.stiffness(), line_density=1.0, radius=1e-3)
            scene.clamp(rod.node(0 if way == 1 else edges))
            scene.add_force(rod.node(edges // 2), (0.0, 0.0, 6.0), follower=True)
            scene.add_force(rod.node(edges if way == 1 else 0), (0.0, 0.0, 4.0))  # so that it bends there
            simulation = rods.sharp(scene)
            simulation.equilibrium()
            ends.append(simulation.positions(rod)[::way][-1])
        np.testing.assert_allclose(*ends, atol=1e-10)
        tips.append(ends[0])
    # The clamp and what a force leaves of the curvature's slope come to their order late, as under dead forces.
    assert_order_at_least(np.linalg.norm(np.diff(tips, axis=0), axis=1), 2.0, slack=0.25)


@LOADS
def test_t_joint_leaves_a_beam_as_stiff_as_it_was(load):
    """The beam changes only at third order of the edge length: each end of the frame adds l^3 / 24 (M m)'' to the
    deflection.

    M m is the square of the lever, so the sum is l^3 / 2 relative to a third.
    """
    light = 1e-3 * np.array(load)
    for edges in (40, 80):
        change = beam(edges, light, True, stub=5) - beam(edges, light, False)
        np.testing.assert_allclose(change, 0.5 / edges**3 * light / 3.0, atol=0.02 / edges**3 * 1e-3)


@LOADS
def test_t_joint_under_a_large_load_converges_to_the_whole_beam_at_second_order(load):
    errors = [
        np.linalg.norm(beam(n, 3.0 * np.array(load), True, stub=5) - beam(n, 3.0 * np.array(load), False))
        for n in (20, 40, 80)
    ]
    assert errors[-1] < 1e-5
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 1.8)


@pytest.mark.case(
    "statics", "Joint that bends every pair of edges", source="closed form for [Choi, dissertation, 6.2.2]"
)
def test_joint_of_the_source_is_stiffer_where_three_rods_meet():
    """[Choi, dissertation 6.2.2] bends every pair of edges: two right angles in series stand beside the straight pair.

    The strain 2 tan(phi / 2) is four times as stiff at a right angle, so that the joint is 1 + 4 / 2 times as stiff.
    """
    load = np.array((0.0, 0.0, -1e-3))
    whole, frame, pairs = (
        beam(10, load, False),
        beam(10, load, True, stub=2),
        beam(10, load, True, stub=2, form="pairs", bending="tangent"),
    )
    assert frame[2] == pytest.approx(whole[2], rel=1e-3)
    # Two thirds of the bend at the joint are missing: of l M / B, with lever and moment half of those at the wall.
    assert (pairs[2] - whole[2]) / load[2] == pytest.approx(-0.1 * 0.5**2 * 2.0 / 3.0, rel=1e-3)


def square_frame(edges, pull):
    """Four sides of unit length; stretch of the diagonal under a pull at two opposite corners."""
    scene = rods.weightless()
    corners = np.sqrt(0.5) * np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)])
    sides = [
        scene.add_rod(
            start=corners[i],
            end=corners[(i + 1) % 4],
            nodes=edges + 1,
            stiffness=rods.stiffness(stretch=1e7),
            line_density=1.0,
            radius=1e-3,
        )
        for i in range(4)
    ]
    for i in range(4):
        scene.join(sides[i].end, sides[(i + 1) % 4].start)
    scene.pin(sides[0].start)
    scene.add_force(sides[1].end, (0.0, 0.0, -pull))
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    return simulation.positions(sides[0])[0, 2] - simulation.positions(sides[1])[-1, 2] - np.sqrt(2.0)


@pytest.mark.case("statics", "Closed frame of four rigid joints", source="P a^3 / (24 EI)")
def test_closed_frame_of_four_rigid_joints_converges_to_beam_theory_at_third_order():
    """Each side bends with both ends held: the diagonal grows by P a^3 / (24 B)."""
    pull = 1e-3
    errors = [square_frame(n, pull) / (pull / 24.0) - 1.0 for n in (8, 16, 32)]
    measured(errors[-1])
    assert_order_at_least(errors, order=3.0)
    assert abs(errors[-1]) < 1e-4


def hinged(kind, tip_force, axis=(0.0, 1.0, 0.0)):
    """A stub clamped along +x, and a link of half a metre that is joined to it."""
    scene = rods.weightless()
    stiff = {"stiffness": rods.stiffness(bend=1e4, twist=1e4, stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    soft = {"stiffness": rods.stiffness(stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    stub = scene.add_rod(start=(-0.1, 0, 0), end=(0, 0, 0), nodes=3, **stiff)
    link = scene.add_rod(start=(0, 0, 0), end=(0.5, 0, 0), nodes=41, **soft)
    scene.join(stub.end, link.start, kind, **({"axis": axis} if kind == "revolute" else {}))
    scene.clamp(stub.start)
    scene.add_force(link.end, tip_force)
    simulation = rods.sharp(scene, planar=False)
    simulation.equilibrium()
    return simulation, stub, link


def test_revolute_joint_turns_freely_about_its_axis():
    simulation, stub, link = hinged("revolute", (0.0, 0.0, -1.0))
    np.testing.assert_allclose(simulation.positions(link)[-1], (0.0, 0.0, -0.5), atol=1e-6)
    reaction = simulation.reaction(stub.start)
    np.testing.assert_allclose(reaction.force, (0.0, 0.0, 1.0), atol=1e-8)
    # The stub is loaded by a force at its end alone.
    np.testing.assert_allclose(reaction.moment, (0.0, -0.1, 0.0), atol=1e-6)


def test_revolute_joint_holds_the_other_axes():
    """Pushed along its axis the link bends as a cantilever, while a pull keeps it level."""
    push = 1e-4
    simulation, stub, link = hinged("revolute", (1e-3, push, 0.0))
    # Cantilever with a side force and a small pull: P L^3 / 3B, lessened by the pull T L^2 / B to first order.
    expected = push * 0.5**3 / 3.0 * (1.0 - 0.4 * 1e-3 * 0.5**2)
    assert simulation.positions(link)[-1, 1] == pytest.approx(expected, rel=1e-3)
    assert simulation.reaction(stub.start).moment[2] == pytest.approx(-0.6 * push, rel=2e-3)


@pytest.mark.case("dynamics", "Link that swings on a revolute joint", source="T = 2 pi sqrt(2 L / (3 g))")
def test_revolute_joint_lets_a_link_swing_like_a_pendulum():
    """A stiff uniform link: T = 2 pi sqrt(2 L / 3 g), and its bearing turns through any angle."""
    scene = withe.Scene()
    stiff = {"stiffness": rods.stiffness(bend=1e3, twist=1e3, stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    stub = scene.add_rod(start=(0, -0.1, 0), end=(0, 0, 0), nodes=2, **stiff)
    angle = 0.02
    link = scene.add_rod(start=(0, 0, 0), end=(0.5 * np.sin(angle), 0, -0.5 * np.cos(angle)), nodes=81, **stiff)
    scene.join(stub.end, link.start, "revolute", axis=(0, 1, 0))
    scene.clamp(stub.start)
    period = 2.0 * np.pi * np.sqrt(2.0 * 0.5 / (3.0 * 9.81))
    simulation = scene.build(integrator="implicit_midpoint", time_step=period / 200)
    heights = []
    for _ in range(200):
        simulation.step()
        heights.append(simulation.positions(link)[-1, 0])
    # Back where it was let go after one period, through the lowest point after a quarter.
    measured(heights[-1] / (0.5 * np.sin(angle)) - 1.0)
    assert heights[-1] == pytest.approx(0.5 * np.sin(angle), rel=2e-3)
    assert abs(heights[49]) < 0.02 * 0.5 * angle


@pytest.mark.case("statics", "Two beams that are hinged over the middle support", source="P L^3 / (48 EI)")
def test_pinned_joint_carries_no_moment():
    """Two beams in line on three supports, hinged over the middle one: each carries its load alone."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    left = scene.add_rod(start=(-1, 0, 0), end=(0, 0, 0), nodes=41, **parts)
    right = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=41, **parts)
    scene.join(left.end, right.start, "pinned")
    scene.pin(left.start, free=(1, 0, 0))
    scene.pin(left.end)
    scene.pin(right.end, free=(1, 0, 0))
    load = 1e-4
    scene.add_force(left.node(20), (0.0, 0.0, -load))
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    np.testing.assert_allclose(simulation.positions(right)[:, 2], 0.0, atol=1e-12)
    # Simply supported: P L^3 / 48 B, with the end slopes of its own.
    assert simulation.positions(left)[20, 2] == pytest.approx(-load / 48.0, rel=2e-3)
    assert simulation.reaction(left.start).force[2] == pytest.approx(0.5 * load, rel=1e-6)
    assert simulation.reaction(right.end).force[2] == pytest.approx(0.0, abs=1e-9 * load)


@pytest.mark.case("statics", "Far reaction of a continuous beam", source="-3 P / 32")
def test_rigid_joint_over_the_same_supports_carries_the_moment():
    """Continuous over the middle support: the far end is pulled down, by 3 P / 32."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    left = scene.add_rod(start=(-1, 0, 0), end=(0, 0, 0), nodes=41, **parts)
    right = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=41, **parts)
    scene.join(left.end, right.start)
    scene.pin(left.start, free=(1, 0, 0))
    scene.pin(left.end)
    scene.pin(right.end, free=(1, 0, 0))
    load = 1e-4
    scene.add_force(left.node(20), (0.0, 0.0, -load))
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    assert simulation.reaction(right.end).force[2] == pytest.approx(-3.0 / 32.0 * load, rel=2e-3)


@pytest.mark.case("statics", "Axial forces of a truss of three links", source="statics of a truss")
def test_ring_of_three_pinned_links_is_a_truss():
    """A triangle with hinged corners carries a load at its top by axial forces alone."""
    scene = rods.weightless()
    parts = {"stiffness": rods.stiffness(stretch=1e6), "line_density": 1.0, "radius": 1e-3}
    a, b, top = np.array((-1.0, 0, 0)), np.array((1.0, 0, 0)), np.array((0.0, 0, 1.0))
    base = scene.add_rod(start=a, end=b, nodes=11, **parts)
    right = scene.add_rod(start=b, end=top, nodes=11, **parts)
    left = scene.add_rod(start=top, end=a, nodes=11, **parts)
    scene.join(base.end, right.start, "pinned")
    scene.join(right.end, left.start, "pinned")
    scene.join(left.end, base.start, "pinned")
    scene.pin(base.start)
    scene.pin(base.end, free=(1, 0, 0))
    scene.add_force(right.end, (0.0, 0.0, -1.0))
    simulation = rods.sharp(scene, planar=True)  # in space it would tip over
    assert simulation.equilibrium().stable
    np.testing.assert_allclose(simulation.tensions(base), 0.5, rtol=1e-5)
    np.testing.assert_allclose(simulation.tensions(left), -np.sqrt(0.5), rtol=1e-5)
    np.testing.assert_allclose(simulation.tensions(right), -np.sqrt(0.5), rtol=1e-5)
