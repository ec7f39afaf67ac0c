"""Natural curvatures that no material can bear end in an error before the first step."""

import numpy as np
import pytest

import withe

RADIUS = 0.01


def arm(**options):
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(**({"start": (0, 0, 0), "end": (0.3, 0, 0), "nodes": 31, "material": rubber} | options))
    scene.clamp(rod.start)
    return scene, rod


def test_a_curvature_that_crushes_the_inner_fibre_is_refused_before_the_step():
    scene, rod = arm(radius=RADIUS)
    simulation = scene.build(time_step=1e-4)
    simulation.set(rod, natural_curvature=(0.0, 120.0))
    with pytest.raises(
        withe.ConvergenceError, match=r"rod 1.* by 120 1/m, with fibres up to 10 mm .* compressed to nothing.* over="
    ):
        simulation.step()
    assert simulation.time == 0.0
    simulation.set(rod, natural_curvature=(0.0, 50.0))
    simulation.step()
    assert simulation.time == 1e-4


def test_the_change_of_curvature_counts_and_not_the_curvature():
    turn = 0.9 * np.arange(31)  # an edge of 9 mm on a circle of 10 mm, as drawn without stress
    points = 1e-2 * np.column_stack([np.sin(turn), 0.02 * turn, 1.0 - np.cos(turn)])
    scene, rod = arm(start=None, end=None, nodes=None, points=points, radius=0.011)
    simulation = scene.build(time_step=1e-6)
    simulation.step()
    simulation.set(rod, natural_curvature=(0.0, 0.0))
    with pytest.raises(withe.ConvergenceError, match="compressed to nothing"):
        simulation.step()
    straight, rod = arm(start=None, end=None, nodes=None, points=points, radius=0.011, natural="straight")
    with pytest.raises(withe.ConvergenceError, match="compressed to nothing"):
        straight.build(time_step=1e-6).step()


def test_ramps_and_rods_of_a_given_stiffness_are_not_refused():
    scene, rod = arm(radius=RADIUS)
    simulation = scene.build(time_step=1e-4)
    simulation.set(rod, natural_curvature=(0.0, 120.0), over=1.0)
    simulation.step()
    given = withe.Stiffness(stretch=300.0, bend=8e-3, twist=5e-3)
    scene, rod = arm(material=None, radius=RADIUS, stiffness=given, line_density=0.3)
    simulation = scene.build(time_step=1e-6)
    simulation.set(rod, natural_curvature=(0.0, 120.0))
    simulation.step()


@pytest.mark.parametrize(("width", "height"), [(0.02, 0.002), (0.002, 0.02)])
def test_each_axis_of_a_rectangle_has_its_own_distance(width, height):
    scene, rod = arm(section=withe.Rectangle(width=width, height=height))
    simulation = scene.build(time_step=1e-5)
    thick, thin = ((150.0, 0.0), (0.0, 150.0)) if width > height else ((0.0, 150.0), (150.0, 0.0))
    simulation.set(rod, natural_curvature=thin)
    simulation.step()
    simulation.reset()
    simulation.set(rod, natural_curvature=thick)
    with pytest.raises(withe.ConvergenceError, match="fibres up to 10 mm"):
        simulation.step()


def test_other_simulations_of_a_batch_step_on():
    scene, _ = arm(radius=RADIUS, name="arm")
    batch = scene.build_batch(2, time_step=1e-4)
    batch.set("arm", natural_curvature=[[0.0, 5.0], [0.0, 120.0]])
    batch.step(2)
    assert list(batch.failed) == [False, True]
    assert "compressed to nothing" in str(batch.failures[1])
    assert list(batch.time) == [2e-4, 0.0]
