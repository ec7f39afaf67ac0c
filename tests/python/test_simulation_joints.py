"""Joints behave as they are named, whatever the order in which they are described."""

import itertools

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER

STATIC = {"integrator": "static"}


def straight(scene, start, end, nodes, **options):
    return scene.add_rod(start=start, end=end, nodes=nodes, radius=5e-3, material=RUBBER, **options)


@pytest.mark.parametrize("integrator", ["static", "implicit_midpoint"])
@pytest.mark.parametrize("planar", [True, False])
def test_two_rods_joined_end_to_end_are_one_rod(integrator, planar):
    one, two = withe.Scene(), withe.Scene()
    whole = straight(one, (0, 0, 0), (0.2, 0, 0), 21)
    first = straight(two, (0, 0, 0), (0.08, 0, 0), 9)
    second = straight(two, (0.08, 0, 0), (0.2, 0, 0), 13)
    two.join(second.start, first.end)
    results = []
    for scene, rod in ((one, whole), (two, first)):
        scene.clamp(rod.start)
        scene.add_moment("rod 1.start" if scene is one else first.start, (0, 0, 0))
        simulation = scene.build(integrator=integrator, planar=planar)
        simulation.step(20)
        results.append(simulation.positions())
    assert np.allclose(*results, atol=1e-9)


def bent_corner(order, kind="rigid", axis=None, form="frame"):
    """Three limbs from one point, one clamped, one pulled; described in a given order."""
    scene = withe.Scene(gravity=(0, 0, 0))
    ends = {"post": (0, 0, -0.1), "left": (-0.1, 0.02, 0.03), "right": (0.08, 0.05, 0.0)}
    for name in order:
        straight(scene, (0, 0, 0), ends[name], 11, name=name)
    for a, b in itertools.pairwise(order):
        scene.join(f"{a}.start", f"{b}.start", kind=kind, axis=axis, form=form)
    scene.clamp("post.end")
    scene.add_force("left.end", (0.0, 0.02, -0.02))
    scene.add_force("right.end", (0.01, -0.03, 0.03))
    simulation = scene.build(**STATIC)
    simulation.equilibrium()
    return simulation


@pytest.mark.parametrize("form", ["frame", "pairs"])
def test_the_order_of_rods_and_joins_does_not_matter(form):
    expected = bent_corner(["post", "left", "right"], form=form)
    for order in itertools.permutations(["post", "left", "right"]):
        simulation = bent_corner(order, form=form)
        for name in order:
            assert np.allclose(simulation.positions(name), expected.positions(name), atol=1e-8)


def test_a_rigid_joint_keeps_the_angles_at_its_node():
    simulation = bent_corner(["post", "left", "right"])

    def tangents(state):
        """Tangents at the joint: the frame and the first node carry the bend of 5/12 and 13/12 of an edge."""
        result = []
        for name in ("post", "left", "right"):
            t = np.diff(state(name), axis=0)[:2]
            t /= np.linalg.norm(t, axis=1, keepdims=True)
            end = t[0] + 5 / 13 * (t[0] - t[1])
            result.append(end / np.linalg.norm(end))
        return np.array(result)

    now = tangents(simulation.positions)
    drawn = tangents(lambda name: simulation._session.scene.rod(name).points)
    assert np.abs(now - drawn).max() > 0.05  # it has turned
    assert np.allclose(now @ now.T, drawn @ drawn.T, atol=5e-3)


def test_a_pinned_joint_carries_no_moment():
    scene = withe.Scene()
    upper = straight(scene, (0, 0, 0), (0.1, 0, 0), 11)
    lower = straight(scene, (0.1, 0, 0), (0.2, 0, 0), 11)
    scene.join(upper.end, lower.start, kind="pinned")
    scene.clamp(upper.start)
    simulation = scene.build(**STATIC)
    simulation.equilibrium()
    hanging = simulation.positions(lower)
    assert np.allclose(hanging[:, 0], hanging[0, 0], atol=1e-7)
    assert np.all(np.diff(hanging[:, 2]) < -0.009)
    weight = 9.81 * simulation.get(lower, "line_density")[0] * 0.1
    assert simulation.tensions(lower)[0] == pytest.approx(0.95 * weight, rel=1e-6)


@pytest.mark.parametrize(("axis", "free"), [((0, 1, 0), True), ((0, 0, 1), False)])
def test_a_revolute_joint_turns_about_its_axis_only(axis, free):
    scene = withe.Scene(gravity=(0, 0, -2.0))
    fixed = straight(scene, (0, 0, 0), (0.05, 0, 0), 6)
    flap = straight(scene, (0.05, 0, 0), (0.15, 0, 0), 11)
    scene.join(fixed.end, flap.start, kind="revolute", axis=axis)
    scene.clamp(fixed.start)
    simulation = scene.build(**STATIC, planar=False)
    simulation.equilibrium()
    slope = np.diff(simulation.positions(flap), axis=0)[0]
    stiff = withe.Scene(gravity=(0, 0, -2.0))
    root = straight(stiff, (0, 0, 0), (0.05, 0, 0), 6)
    rod = straight(stiff, (0.05, 0, 0), (0.15, 0, 0), 11)
    twig = stiff.add_rod(start=(0.05, 0, 0), end=(0.05, 0, 0.01), nodes=2, radius=1e-6, material=RUBBER)
    stiff.join(root.end, rod.start)
    stiff.join(root.end, twig.start)  # three rods meet, so that they have a frame too
    stiff.clamp(root.start)
    rigid = stiff.build(**STATIC, planar=False)
    rigid.equilibrium()
    if free:
        assert abs(slope[0]) < 1e-6 * abs(slope[2])
    else:
        assert np.allclose(simulation.positions(flap), rigid.positions(rod), atol=1e-6)


def test_a_loop_closed_by_a_join_is_a_closed_rod():
    angle = np.linspace(0, 2 * np.pi, 33)
    ring = 0.05 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    results = []
    for closed in (True, False):
        scene = withe.Scene()
        rod = scene.add_rod(
            points=ring[:-1] if closed else ring, closed=closed, radius=2e-3, material=RUBBER, normal=(0, 1, 0)
        )
        if not closed:
            scene.join(rod.start, rod.end)
        scene.clamp(rod.node(8))
        simulation = scene.build(**STATIC)
        simulation.equilibrium()
        results.append(simulation.positions()[:32])
    assert np.ptp(results[0], axis=0)[2] > 0.11  # it sags
    assert np.allclose(*results, atol=1e-6)


def test_a_frame_of_four_rods_holds_together():
    scene = withe.Scene()
    corners = np.array([(0, 0, 0), (0.1, 0, 0), (0.1, 0, -0.1), (0, 0, -0.1)], float)
    rods = [straight(scene, corners[i], corners[(i + 1) % 4], 7) for i in range(4)]
    for i in range(4):
        scene.join(rods[i].end, rods[(i + 1) % 4].start)
    scene.pin(rods[0].start)
    scene.pin(rods[0].end)
    simulation = scene.build(planar=False)
    simulation.step(50)
    assert len(simulation.positions()) == 24
    for i in range(4):
        assert np.array_equal(simulation.positions(rods[i])[-1], simulation.positions(rods[(i + 1) % 4])[0])


def test_a_joint_in_the_middle_of_a_rod_leaves_its_own_stencil():
    """But for l^2 M / 12 B at its own node: a frame and its neighbours share what bends there another way."""
    changes = []
    for half in (10, 20, 40):
        results = []
        for branch in (False, True):
            scene = withe.Scene()
            beam = straight(scene, (0, 0, 0), (0.2, 0, 0), 2 * half + 1)
            scene.clamp(beam.start)
            if branch:
                twig = scene.add_rod(start=(0.1, 0, 0), end=(0.1, 0, 0.02), nodes=5, radius=1e-6, material=RUBBER)
                scene.join(beam.node(half), twig.start)
            simulation = scene.build(**STATIC)
            simulation.equilibrium()
            results.append(simulation.positions(beam))
        changes.append(np.abs(results[1] - results[0]).max())
    assert changes[1] < 1e-5
    assert changes[0] > 3.8 * changes[1] > 3.8**2 * changes[2]


@pytest.mark.parametrize("hold", ["frame", "edge"])
def test_a_clamp_that_may_spin_carries_no_torque_along_the_rod(hold):
    twist = 3.0
    torques = {}
    for spin in (False, True):
        scene = withe.Scene(gravity=(0, 0, 0))
        material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
        rod = scene.add_rod(
            start=(0, 0, 0), end=(0.2, 0.1, 0), nodes=11, radius=5e-3, material=material, natural_twist=twist
        )
        scene.clamp(rod.start, hold=hold)
        end = scene.clamp(rod.end, hold=hold, spin=spin)
        simulation = scene.build(integrator="static", planar=False)
        simulation.equilibrium()
        tangent = np.array([0.2, 0.1, 0.0]) / np.hypot(0.2, 0.1)
        torques[spin] = abs(simulation.reaction(end).moment @ tangent)
        if spin:
            np.testing.assert_allclose(simulation.twists(rod), twist, rtol=1e-6)
    assert torques[True] < 1e-9 * torques[False]


def test_a_clamp_that_spins_may_be_put_on_while_running():
    scene = withe.Scene()
    rod = scene.add_rod(
        start=(0, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=withe.Material(youngs_modulus=1e6, density=1e3)
    )
    simulation = scene.build()
    bearing = simulation.clamp(rod.start, spin=True)
    simulation.step()
    simulation.release(bearing)
    simulation.clamp(rod.start, hold="edge", spin=True)
