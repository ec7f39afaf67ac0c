"""Rods that pass through each other because contact was forgotten: one warning, which names them."""

import warnings

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0)


def falling(fresh, clearance=None):
    """A bar that is held at both ends, and a rod that falls past it: across it, or `clearance` beside its end."""
    length, radius = fresh.uniform(0.1, 0.3), fresh.uniform(2e-3, 5e-3)
    angle, height = fresh.uniform(0.3, np.pi - 0.3), fresh.uniform(0.01, 0.1)
    across = np.array([np.cos(angle), np.sin(angle), 0.0])
    middle = np.array([fresh.uniform(-0.3, 0.3) * length, 0.0, height + 2 * radius])
    if clearance is not None:
        middle[1] += 0.5 * length * abs(across[1]) + 2 * radius + clearance
    scene = withe.Scene()
    nodes = int(fresh.integers(5, 30))
    bar = scene.add_rod(
        start=(-length, 0, 0), end=(length, 0, 0), nodes=nodes, radius=radius, material=RUBBER, name="bar"
    )
    scene.clamp(bar.start)
    scene.clamp(bar.end)
    half = 0.5 * length * across
    rod = scene.add_rod(
        start=middle - half,
        end=middle + half,
        nodes=int(fresh.integers(3, 30)),
        radius=radius,
        material=RUBBER,
        name="rod",
    )
    return scene, bar, rod


def warned(scene, integrator="energy_momentum", time_step=2e-3):
    """Warnings of crossings in the time of the fall."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        simulation = scene.build(time_step=time_step, integrator=integrator)
        simulation.run(0.24, progress=False)
        simulation.copy().step(2)
    return [str(w.message) for w in heard if w.category is withe.RodCrossingWarning]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("time_step", [1e-3, 4e-2])
def test_a_rod_that_falls_through_another_is_named_once(seed, time_step):
    """In steps in which it goes less than its radius, and in some in which it goes farther than its diameter."""
    scene, _, _ = falling(np.random.default_rng(seed))
    (message,) = warned(scene, time_step=time_step)
    assert "rod 'bar' and rod 'rod' pass through each other" in message
    assert "scene.enable_contact()" in message


@pytest.mark.parametrize("seed", range(6))
def test_a_rod_that_falls_past_another_is_not_named(seed):
    fresh = np.random.default_rng(seed)
    scene, _, _ = falling(fresh, clearance=fresh.uniform(1e-4, 1e-2))
    assert warned(scene) == []


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("said", ["on", "off", "ignored"])
def test_nothing_is_said_where_the_scene_says_whether_rods_touch(seed, said):
    scene, bar, rod = falling(np.random.default_rng(seed))
    if said == "ignored":
        scene.ignore_contact(bar, rod)
    else:
        scene.enable_contact(rods=said == "on")
    assert warned(scene, "backward_euler") == []


def test_rods_that_are_joined_or_drawn_in_each_other_may_cross():
    """A scissor whose bars share a node, and a third bar that is drawn through one of them."""
    scene = withe.Scene()
    ends = [0.1 * np.array([np.cos(angle), 0.0, np.sin(angle)]) for angle in (0.4, -0.4)]
    bars = [scene.add_rod(start=-end, end=end, nodes=11, radius=3e-3, material=RUBBER) for end in ends]
    scene.join(bars[0].node(5), bars[1].node(5), kind="pinned")
    scene.pin(bars[0].node(5))
    scene.add_rod(start=(0.05, -0.1, 0.02), end=(0.05, 0.1, 0.02), nodes=11, radius=3e-3, material=RUBBER)
    assert warned(scene) == []
