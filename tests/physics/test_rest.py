"""A cable that is dropped on a floor comes to rest, and stays so."""

import numpy as np
import pytest

import withe


@pytest.mark.parametrize("friction_model", ["anchored", "implicit", "lagged", "semi_explicit"])
@pytest.mark.parametrize("model", ["imcv2", "barrier"])
def test_a_dropped_cable_comes_to_rest_for_a_minute(model, friction_model):
    """.5 m long, 5 mm thick, yawed by 10 degrees against the axes; kinetic energy falls to rounding of the weight's."""
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
    yaw, middle = np.radians(10.0), np.array([0.0, 0.0, 0.05])
    half = 0.25 * np.array([np.cos(yaw), np.sin(yaw), 0.0])
    scene = withe.Scene()
    scene.add_rod(start=middle - half, end=middle + half, nodes=51, radius=5e-3, material=rubber)
    scene.add_floor(friction=0.4)
    scene.enable_contact(friction=0.4, model=model, friction_model=friction_model)
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    fallen = simulation.energy().gravity
    simulation.run(duration=5.0, progress=False)
    fallen -= simulation.energy().gravity
    for _ in range(11):
        simulation.run(duration=5.0, progress=False)
        assert simulation.energy().kinetic < 1e-15 * fallen
