"""Rods along a curve: edges stand for the arcs that they are the chords of.

A quarter of a ring of unit radius, clamped at one end, gives way at the other by [Timoshenko: Strength of materials,
curved bars; the integral of moment times unit moment over the arc]
    pi / 4 / B                          to a force along the radius of the tip,
    (3 pi / 4 - 2) / B                  to one along its tangent,
    pi / 4 / B + (3 pi / 4 - 2) / C     to one out of the plane.
"""

import numpy as np
import pytest

import withe
from cases import measured
from convergence import assert_order_at_least
from rods import INEXTENSIBLE, sharp, stiffness, weightless

IN_PLANE, OUT_OF_PLANE, TWIST = 1.3, 0.8, 0.6
NORMAL = np.array([0.0, 0.0, 1.0])
FINE = 20_000


def arc(turn, edges):
    s = np.linspace(0.0, turn, edges + 1)
    return np.stack([np.sin(s), 1.0 - np.cos(s), np.zeros_like(s)], axis=1)


def drawn(scene, points, **more):
    # d1 in the plane: curvature towards d1 is resisted by the first bending stiffness.
    bent = stiffness(bend=(IN_PLANE, OUT_OF_PLANE), twist=TWIST, stretch=INEXTENSIBLE)
    return scene.add_rod(points=points, normal=(0, 1, 0), radius=1e-3, stiffness=bent, line_density=2.0, **more)


def compliance(edges, direction, **build):
    """Displacement of the tip along a unit force, per newton; what is even in the force cancels."""
    found = []
    for force in (1e-6, -1e-6):
        scene = weightless()
        rod = drawn(scene, arc(0.5 * np.pi, FINE), nodes=edges + 1)
        scene.clamp(rod.start)
        scene.add_force(rod.end, force * np.asarray(direction))
        simulation = sharp(scene, planar=False, **build)
        simulation.equilibrium()
        found.append((simulation.positions(rod)[-1] - rod_end(edges)) @ direction / force)
    return 0.5 * (found[0] + found[1])


def rod_end(edges):
    return arc(0.5 * np.pi, edges)[-1]


THEORY = {
    "radial": ((1.0, 0.0, 0.0), 0.25 * np.pi / IN_PLANE),
    "tangential": ((0.0, 1.0, 0.0), (0.75 * np.pi - 2.0) / IN_PLANE),
    "out of plane": ((0.0, 0.0, 1.0), 0.25 * np.pi / OUT_OF_PLANE + (0.75 * np.pi - 2.0) / TWIST),
}


@pytest.mark.case(
    "statics", "Compliance of a quarter ring in its plane", source="curved bars [Timoshenko, Strength of Materials]"
)
@pytest.mark.parametrize("way", ["radial", "tangential"])
def test_a_quarter_ring_gives_way_in_its_plane_as_in_theory_at_third_order(way):
    direction, exact = THEORY[way]
    errors = [compliance(edges, np.array(direction)) / exact - 1.0 for edges in (4, 8, 16)]
    measured(errors[-1])
    assert abs(errors[0]) < 2e-2
    assert_order_at_least(errors, 3.0, slack=0.2)


@pytest.mark.parametrize("edges", [4, 8, 16, 32])
def test_a_quarter_ring_gives_way_out_of_its_plane_as_in_theory(edges):
    direction, exact = THEORY["out of plane"]
    # Bending about the arc's normal is left at second order: 0.54 / edges^2 without arcs.
    assert abs(compliance(edges, np.array(direction)) / exact - 1.0) < 0.05 / edges**2


@pytest.mark.parametrize("way", THEORY)
def test_made_of_its_edges_the_ring_is_ten_times_farther_off(way):
    direction, exact = THEORY[way]
    chords = compliance(16, np.array(direction), bending="tangent") / exact - 1.0
    arcs = compliance(16, np.array(direction)) / exact - 1.0
    assert 10.0 * abs(arcs) < abs(chords) < 1e-2


@pytest.mark.case("dynamics", "Mass and moment of inertia of an arc", source="integrals over the circle")
@pytest.mark.parametrize("closed", [False, True])
def test_an_arc_has_the_mass_and_spin_of_the_curve(closed):
    turn = 2.0 * np.pi if closed else 2.5
    nodes = 9 if closed else 10
    scene = weightless()
    rod = drawn(scene, arc(turn, FINE), nodes=nodes, closed=closed)
    simulation = scene.build(planar=False)
    mass = 2.0 * turn
    simulation.set_velocities(rod, np.tile((0.0, 0.0, 1.0), (nodes, 1)))
    assert simulation.energy().kinetic == pytest.approx(0.5 * mass, rel=1e-7)
    simulation.set_velocities(rod, np.cross(NORMAL, simulation.positions(rod) - (0.0, 1.0, 0.0)))
    assert simulation.energy().kinetic == pytest.approx(0.5 * mass, rel=1e-7)


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "verlet"])
def test_the_weight_of_a_hanging_arc_is_that_of_the_curve(integrator):
    scene = withe.Scene(gravity=(0.0, 0.0, -10.0))
    rod = drawn(scene, arc(2.5, FINE), nodes=13)
    scene.clamp(rod.start)
    simulation = scene.build(integrator=integrator, time_step=1e-8)
    simulation.step(1)
    # Half of the first edge is carried by the wall from the start.
    falling = 2.0 * 2.5 * (1.0 - 0.5 / 12)
    assert simulation.reaction(rod.start).force[2] == pytest.approx(2.0 * 2.5 * 10.0 - falling * 10.0, rel=1e-3)


def test_points_that_are_the_nodes_are_the_rod():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    scene = weightless()
    rod = drawn(scene, square, closed=True)
    simulation = scene.build(planar=False)
    simulation.set_velocities(rod, np.tile((0.0, 0.0, 1.0), (4, 1)))
    assert simulation.energy().kinetic == pytest.approx(0.5 * 2.0 * 4.0, rel=1e-12)
