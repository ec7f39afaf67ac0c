"""Obstacles that close on a rod: their force follows from the stiffness of contact, and a warning asks for one."""

import warnings

import numpy as np
import pytest

import withe


def squeezed(fresh, closing, stiffness=None):
    """A cable between two fingers that leave it less room than it is thick, by `closing` radii on each side.

    Returns the force of a finger [N], what the section resists with [N], and the warnings of squeezes.
    """
    modulus, radius, length = 10.0 ** fresh.uniform(5.5, 7.5), fresh.uniform(2e-3, 6e-3), fresh.uniform(0.2, 0.4)
    nodes, finger = int(fresh.integers(31, 61)), fresh.uniform(5e-3, 2e-2)
    rubber = withe.Material(youngs_modulus=modulus, poisson_ratio=0.45, density=1100.0, viscosity=1e-3 * modulus)
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.add_rod(
        start=(-0.5 * length, 0, 0), end=(0.5 * length, 0, 0), nodes=nodes, radius=radius, material=rubber, name="cable"
    )
    apart = radius + finger + 0.3 * radius
    fingers = [
        scene.add_capsule((0, side * apart, -0.05), (0, side * apart, 0.05), finger, name=f"finger {side}")
        for side in (-1, 1)
    ]
    edge = length / (nodes - 1)
    if stiffness is not None:
        scene.enable_contact(rods=False, stiffness=stiffness * 0.5 * modulus * edge)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        simulation = scene.build(integrator="backward_euler", time_step=5e-3)
        for side, part in zip((-1, 1), fingers, strict=True):
            simulation.move(part, position=(0, side * (apart - 0.3 * radius - closing * radius), 0), over=0.2)
        simulation.run(0.4, progress=False)
    contacts = simulation.contacts()
    force = 0.5 * np.abs(contacts["normal_force"]).sum()
    said = [str(w.message) for w in heard if w.category is withe.SqueezedRodWarning]
    return force, modulus * edge * closing * radius, said


@pytest.mark.parametrize("seed", range(5))
def test_a_squeeze_without_a_stiffness_says_which_one_is_needed(seed):
    fresh = np.random.default_rng(seed)
    _, _, (message,) = squeezed(fresh, fresh.uniform(0.005, 0.03))
    assert "Rod 'cable' is squeezed between 'finger " in message
    assert "stiffness=" in message


@pytest.mark.parametrize("seed", range(5))
def test_the_stiffness_that_is_named_presses_by_the_section(seed):
    """Young's modulus times the length in contact times the depth; fingers touch one node or two, or three a little."""
    fresh = np.random.default_rng(seed)
    force, section, said = squeezed(fresh, fresh.uniform(0.01, 0.03), 1.0)
    assert said == []
    assert 0.7 * section < force < 2.5 * section


@pytest.mark.parametrize("seed", range(5))
def test_fingers_that_leave_room_squeeze_nothing(seed):
    fresh = np.random.default_rng(seed)
    assert squeezed(fresh, -fresh.uniform(0.001, 0.03))[2] == []
