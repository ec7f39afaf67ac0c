"""Hands and other supports beside joints: beams stay as soft as they are, energies do not jump."""

import numpy as np
import pytest

import rods
import withe
from cases import measured
from convergence import assert_order
from held_rods import SOFT, TIGHT, rope


def deflection_beyond_what_holds(edges, hold, joint, planar):
    """Deflection of a beam whose edges are held, relative to a cantilever from the middle of the last held edge.

    A weightless twig is joined to the beam, `joint` nodes from the end of the held part.
    """
    scene, length, stiffness = withe.Scene(gravity=(0, 0, 0)), 1.0 / edges, rods.stiffness(stretch=1e6)
    beam = scene.add_rod(
        start=(0, 0, 0), end=(1, 0, 0), nodes=edges + 1, stiffness=stiffness, line_density=1.0, radius=1e-3
    )
    held = {"edge": 1, "inner edge": 3, "two pins": 3}.get(hold, edges // 10)
    if "edge" in hold:
        scene.clamp(beam.node(held - 1), hold="edge")
    elif hold == "two pins":
        scene.pin(beam.node(held - 1))
        scene.pin(beam.node(held))
    else:
        more = {"stiffness": (1e9, 1e9)} if hold == "stiff hand" else {}
        scene.grasp(beam, 0.05, 0.1 - 1e-6, **more)
    fork = (held + joint) * length
    twig = scene.add_rod(
        start=(fork, 0, 0), end=(fork, 0, 0.2), nodes=3, stiffness=stiffness, line_density=1e-9, radius=1e-3
    )
    scene.join(beam.node(held + joint), twig.start)
    scene.add_force(beam.end, (0.0, 0.0, -1e-4))
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    bend = simulation.get(beam, "bend_stiffness").ravel()[0]
    free = 1.0 - (held - 0.5) * length
    return -simulation.positions(beam)[-1, 2] / (1e-4 * free**3 / (3.0 * bend))


@pytest.mark.case("statics", "Beam with a joint beside its support", source="linear beam theory")
@pytest.mark.parametrize("planar", [None, False])
@pytest.mark.parametrize("joint", [-1, 0, 1])
@pytest.mark.parametrize("hold", ["hand", "stiff hand", "edge", "inner edge", "two pins"])
def test_a_joint_beside_what_is_held_leaves_a_beam_as_soft_as_it_is(hold, joint, planar):
    errors = [abs(deflection_beyond_what_holds(edges, hold, joint, planar) - 1.0) for edges in (20, 40, 80)]
    measured(errors[-1])
    assert errors[0] < 3e-3  # a twelfth of an edge on the wrong side of what is held is 1.2e-2
    assert_order(errors, 2.0, 0.2)


@pytest.mark.parametrize("hold", ["frame", "edge", "inner frame", "hand", "yielding hand"])
@pytest.mark.parametrize("drawn", [True, False])
def test_what_supports_store_beside_joints_is_their_work_as_they_come_and_go(hold, drawn):
    scene = withe.Scene()
    beam = scene.add_rod(
        start=(0, 0, 0), end=(1, 0, 0), nodes=16, stiffness=SOFT, line_density=1.0, radius=0.02, name="beam"
    )
    fork = 4 / 15
    twig = scene.add_rod(
        start=(fork, 0, 0), end=(fork, 0, 0.2), nodes=3, stiffness=SOFT, line_density=1e-3, radius=0.02
    )
    scene.join(beam.node(4), twig.start)
    scene.clamp(beam.end)

    def put(on):
        if "hand" in hold:
            return on.grasp(beam, 0.23, 0.2, **({"stiffness": (1e4, 1e2)} if "yielding" in hold else {}))
        if hold == "inner frame":
            return on.clamp(beam.node(2))
        return on.clamp(beam.start, hold=hold)

    support = put(scene) if drawn else None
    simulation = scene.build(integrator="implicit_midpoint", time_step=2e-3, **TIGHT)
    simulation.step(20)

    def balance():
        energy = simulation.energy()
        return energy.total + energy.dissipated - energy.work

    stored = simulation.energy().bend
    assert stored > 1e-3
    for _ in range(2):
        before = balance()
        if support is None:
            support = put(simulation)
        else:
            simulation.release(support)
            support = None
        assert abs(balance() - before) < 1e-12 * stored
        simulation.step(5)


def deflections_before_in_and_after_a_hold(edges, after, planar):
    """Errors of how far the end of a beam sinks under a load that doubles while a hand holds an edge beside a joint.

    And by how much the moment at the wall jumps as it takes hold.
    """
    scene, length = withe.Scene(gravity=(0, 0, 0)), 1.0 / edges
    stiffness = rods.stiffness(stretch=1e6)
    beam = scene.add_rod(
        start=(0, 0, 0), end=(1, 0, 0), nodes=edges + 1, stiffness=stiffness, line_density=1.0, radius=1e-3
    )
    wall = scene.clamp(beam.start)
    fork = edges // 2
    twig = scene.add_rod(
        start=(0.5, 0, 0), end=(0.5, 0, 0.2), nodes=3, stiffness=stiffness, line_density=1e-9, radius=1e-3
    )
    scene.join(beam.node(fork), twig.start)
    load = scene.add_force(beam.end, (0.0, 0.0, -1e-4))
    simulation = scene.build(integrator="static", planar=planar)
    simulation.equilibrium()
    bend = simulation.get(beam, "bend_stiffness").ravel()[0]
    held = fork if after else fork - 1

    def deflection():
        return -simulation.positions(beam)[-1, 2] * 3.0 * bend / 1e-4

    def moment():
        simulation.equilibrium()
        return np.linalg.norm(simulation.reaction(wall).moment) / 1e-4

    found, moments = [deflection()], [moment()]
    hand = simulation.grasp(beam, (held + 0.5) * length, 0.1 * length)
    moments.append(moment())
    simulation.set(load, force=(0.0, 0.0, -2e-4))
    simulation.equilibrium()
    found.append(deflection())
    hand.release()
    simulation.equilibrium()
    found.append(deflection())
    return np.array(found) - (1.0, 1.0 + (1.0 - (held + 0.5) * length) ** 3, 2.0), np.diff(moments)[0]


@pytest.mark.parametrize("planar", [None, False])
@pytest.mark.parametrize("after", [True, False])
def test_a_hand_beside_a_joint_takes_what_bends_there_as_it_is_and_leaves_a_beam_as_soft_as_it_was(after, planar):
    for edges in (20, 40, 80):
        errors, jump = deflections_before_in_and_after_a_hold(edges, after, planar)
        # Error of second order; a twelfth of an edge too soft or too stiff makes an error of first order, 0.06 / edges.
        assert np.abs(errors[1:]).max() < 0.5 / edges**2
        assert abs(jump) < 0.5 / edges**2


def test_snapshots_copies_and_resets_know_of_the_rest_strains_that_a_hand_leaves_beside_a_joint():
    simulation, rod = rope(forked=True)

    def bits():
        simulation.step(20)
        return simulation.positions()

    fresh = bits()
    hand = simulation.grasp(rod, 0.54, 0.05)
    held, copy = simulation.snapshot(), simulation.copy()
    in_hand = bits()
    hand.release()
    left = simulation.snapshot()
    after = bits()
    simulation.restore(held)
    np.testing.assert_array_equal(bits(), in_hand)
    simulation.restore(left)
    np.testing.assert_array_equal(bits(), after)
    copy.step(20)
    np.testing.assert_array_equal(copy.positions(), in_hand)
    simulation.reset()
    np.testing.assert_array_equal(bits(), fresh)
    simulation.restore(left)
    np.testing.assert_array_equal(bits(), after)
