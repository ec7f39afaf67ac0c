"""Viscosity, drag and dampers of joints and springs have no part in an equilibrium, nor in the way there."""

import numpy as np
import pytest

import withe


def arch(seed, resists):
    """A rod between two clamps that are tilted and moved together, to where the path of equilibria ends and jumps."""
    draw = np.random.default_rng([63, seed])
    nodes, tilt, share = int(draw.choice([31, 51, 101])), draw.uniform(0.2, 0.6), draw.uniform(0.85, 0.97)
    viscosity, drag = (10.0 ** draw.uniform(-1.0, 4.0), draw.uniform(0.1, 10.0)) if resists else (0.0, 0.0)
    scene = withe.Scene(gravity=(0, 0, -draw.choice([0.0, 1.0])))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=viscosity)
    rod = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=nodes, radius=5e-3, material=rubber)
    ends = scene.clamp(rod.start), scene.clamp(rod.end)
    if drag:
        scene.add_drag(drag)
    simulation = scene.build(planar=None if seed % 2 else False)
    simulation.move(ends[0], tangent=(np.cos(tilt), 0, np.sin(tilt)))
    simulation.move(ends[1], position=(share, 0, 0), tangent=(np.cos(tilt), 0, -np.sin(tilt)))
    return simulation, rod


@pytest.mark.parametrize("seed", range(12))
def test_what_resists_does_not_change_the_equilibrium_of_an_arch(seed):
    shapes = []
    for resists in (False, True):
        simulation, rod = arch(seed, resists)
        simulation.equilibrium()
        shapes.append(simulation.positions(rod))
    np.testing.assert_array_equal(*shapes)


@pytest.mark.parametrize("seed", range(6))
def test_dampers_do_not_change_an_equilibrium_beyond_a_jump(seed):
    """A two-bar truss on hinges and a spring that is pushed through."""
    shapes = []
    for damping in (0.0, 1.0):
        draw = np.random.default_rng([64, seed])
        scene = withe.Scene(gravity=(0, 0, 0))
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        left = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0.03), nodes=9, radius=5e-3, material=rubber)
        right = scene.add_rod(start=(0.2, 0, 0.03), end=(0.4, 0, 0), nodes=9, radius=5e-3, material=rubber)
        joint = {"stiffness": draw.uniform(0.0, 2e-3), "damping": damping}
        scene.join(left.end, right.start, "revolute", axis=(0, 1, 0), **joint)
        scene.pin(left.start)
        scene.pin(right.end)
        scene.add_spring(left.node(4), right.node(4), stiffness=draw.uniform(0.0, 5.0), damping=damping)
        scene.add_force(left.end, (0, 0, -draw.uniform(2.0, 6.0)))
        simulation = scene.build(planar=True)
        simulation.equilibrium()
        shapes.append(simulation.positions())
    np.testing.assert_array_equal(*shapes)
