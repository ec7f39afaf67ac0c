"""Rings under pressure: the critical pressure, and the work of the pressure.

Inextensible rings of radius R buckle into two lobes. The critical pressure is 3 EI / R^3 if the pressure stays normal
to the ring. For loads of constant direction it is 4 EI / R^3 [Levy 1884; Timoshenko and Gere 1961, section 7.3;
Bodner 1958].
"""

import numpy as np
import pytest

import withe
from cases import measured, measured_order

RADIUS, BENDING, STRETCHING = 0.1, 1e-4, 1e4  # [m], [N m^2], [N]: strains at buckling of 3e-5
CLASSICAL = BENDING / RADIUS**3


def ring(nodes):
    angles = 2.0 * np.pi * np.arange(nodes) / nodes
    points = RADIUS * np.stack([np.cos(angles), np.sin(angles), np.zeros(nodes)], axis=1)
    scene = withe.Scene(gravity=(0, 0, 0))
    stiffness = withe.Stiffness(stretch=STRETCHING, bend=(BENDING, BENDING), twist=BENDING)
    rod = scene.add_rod(points=points, closed=True, stiffness=stiffness, line_density=0.1, radius=2e-3)
    return scene, rod, points


def softest(simulation, rod, points, pressure):
    """Square of the frequency of the mode of two lobes, of the ring that the pressure has made smaller."""
    smaller = 1.0 - pressure * RADIUS / STRETCHING
    simulation.set_state(rod, smaller * points)
    linearised = simulation.linearise()
    squares = np.sign(linearised.frequencies(6)) * linearised.frequencies(6) ** 2
    # Two translations and a rotation have none: of what is left, the pair of the first mode is least.
    rest = squares[np.argsort(np.abs(squares))[3:]]
    return float(rest.min())


def critical(nodes, load):
    scene, rod, points = ring(nodes)
    parts = load(scene, rod, points)
    simulation = scene.build(planar=True)
    squares = []
    pressures = np.array([1.0, 2.0]) * CLASSICAL
    for pressure in pressures:
        parts(simulation, pressure)
        squares.append(softest(simulation, rod, points, pressure))
    return (pressures[0] - squares[0] * (pressures[1] - pressures[0]) / (squares[1] - squares[0])) / CLASSICAL


def following(scene, rod, points):
    load = scene.add_pressure(rod, 0.0)
    return lambda simulation, pressure: simulation.set(load, pressure=pressure)


def dead(scene, rod, points):
    return lambda simulation, pressure: None  # it has no Jacobian, so that only the ring's compression tells


@pytest.mark.case(
    "stability", "Critical pressure of a ring", source="3 or 4 EI / R^3 [Levy 1884; Timoshenko and Gere 1961]"
)
@pytest.mark.parametrize(("load", "expected"), [(following, 3.0), (dead, 4.0)])
def test_a_ring_buckles_where_theory_says_at_second_order(load, expected):
    errors = [critical(nodes, load) / expected - 1.0 for nodes in (24, 48, 96)]
    measured(errors[-1])
    assert abs(errors[-1]) < 3e-3
    orders = np.log2(np.abs(np.array(errors[:-1]) / errors[1:]))
    measured_order(orders)
    assert orders.min() > 1.8


def test_a_ring_collapses_above_its_pressure_and_not_below():
    for times, buckles in ((2.9, False), (3.2, True)):
        scene, rod, points = ring(40)
        scene.add_pressure(rod, times * CLASSICAL)
        for node in (0, 20):
            scene.pin(rod.node(node), free=(1, 0, 0))  # no rigid motion but along x, which the next takes
        scene.pin(rod.node(10), free=(0, 1, 0))
        simulation = scene.build(planar=True)
        simulation.equilibrium()
        spread = np.ptp(np.linalg.norm(simulation.positions(rod) - points.mean(axis=0), axis=1))
        assert bool(spread > 0.1 * RADIUS) is buckles


@pytest.mark.case("actuation", "Work of a pressure", source="p times the swept area")
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum"])
def test_the_work_of_a_pressure_is_the_area_that_it_takes(planar, integrator):
    scene, rod, points = ring(24)
    pressure = 0.5 * CLASSICAL
    scene.add_pressure(rod, pressure)
    simulation = scene.build(planar=planar, integrator=integrator, time_step=2e-4)
    simulation.set_velocities(rod, points[:, [1, 0, 2]] * (5.0, 5.0, 0.0))

    def area():
        x = simulation.positions(rod)
        return 0.5 * np.cross(x, np.roll(x, -1, axis=0))[:, 2].sum()

    before, start = area(), simulation.energy()
    simulation.step(100)
    now = simulation.energy()
    measured(now.loads / (pressure * (area() - before)) - 1.0)
    assert now.loads == pytest.approx(pressure * (area() - before), rel=1e-9)
    assert abs(now.total - start.total) < 1e-3 * start.kinetic
    assert np.abs(simulation.velocities(rod).mean(axis=0)).max() < 1e-9  # a closed rod is not pushed away
