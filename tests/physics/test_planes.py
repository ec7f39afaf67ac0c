"""A scene is solved in a plane only where space gives the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0)
STIFF = withe.Material(youngs_modulus=1e11, density=1000.0)


def hinged(axis: tuple[float, float, float]) -> withe.Scene:
    """An arm that hangs aslant in the plane x = y, on a hinge at the foot of a stiff post."""
    scene = withe.Scene()
    post = scene.add_rod(start=(0, 0, 0.2), end=(0, 0, 0), nodes=6, radius=4e-3, material=STIFF)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.1, 0.1, -0.1), nodes=6, radius=4e-3, material=STIFF, name="arm")
    scene.clamp(post.start)
    scene.join(post.end, arm.start, "revolute", axis=axis)
    return scene


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (1, -0.99, 0), (1, -1, 0.1)])
def test_a_hinge_whose_axis_is_aslant_to_the_plane_turns_as_in_space(axis: tuple[float, float, float]) -> None:
    tips = []
    for planar in (None, False):
        simulation = hinged(axis).build(time_step=1e-3, planar=planar)
        assert not simulation.plan.planar
        simulation.run(0.3, progress=False)
        tips.append(simulation.positions("arm")[-1])
    np.testing.assert_array_equal(*tips)
    assert np.linalg.norm(tips[0] - (0.1, 0.1, -0.1)) > 0.1
    with pytest.raises(ValueError, match="axis of a revolute joint lies at an angle to the plane"):
        hinged(axis).build(planar=True)


@pytest.mark.parametrize("axis", [(1, -1, 0), (1, 1, 0), (0, 0, 1)])
def test_a_hinge_across_or_in_the_plane_keeps_a_scene_in_it(axis: tuple[float, float, float]) -> None:
    assert hinged(axis).build().plan.planar


def leaning(**options: Any) -> withe.Simulation:
    """A cantilever along (1, 1, 1), whose directors lie at an angle to the vertical plane that it sags in."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.15, 0.15, 0.15), nodes=16, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    return scene.build(**options)


@pytest.mark.parametrize("stiffness", [(2e-4, 1e-3), np.linspace((2e-4, 2e-4), (2e-4, 1e-3), 15)], ids=["all", "edges"])
def test_a_section_that_is_set_aslant_to_the_plane_bends_as_in_space(stiffness: Any) -> None:
    found = []
    for planar in (None, False):
        simulation = leaning(planar=planar)
        simulation.set("arm", bend_stiffness=stiffness)
        simulation.equilibrium()
        found.append(simulation.positions("arm"))
    np.testing.assert_allclose(*found, atol=1e-9)
    with pytest.raises(ValueError, match="section of rod 'arm'"):
        leaning(planar=True).set("arm", bend_stiffness=stiffness)


def test_a_round_section_that_is_set_stays_in_the_plane() -> None:
    simulation = leaning()
    simulation.set("arm", bend_stiffness=(1e-3, 1e-3))
    assert simulation.plan.planar


def in_scene(stiffness: Any, planar: bool | None) -> withe.Simulation:
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=RUBBER, normal=(0, 1, 1))
    scene.grasp(arm, at=0.15, length=0.02, stiffness=stiffness)
    return scene.build(planar=planar)


def while_running(stiffness: Any, planar: bool | None) -> withe.Simulation:
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=RUBBER, normal=(0, 1, 1))
    scene.clamp(arm.start)
    simulation = scene.build(planar=planar, time_step=2e-3)
    simulation.grasp(arm, at=0.29, length=0.01, stiffness=stiffness)
    return simulation


@pytest.mark.parametrize("grasped", [in_scene, while_running])
@pytest.mark.parametrize("stiffness", [((2.0, 200.0, 50.0), (0.5, 0.5, 0.5)), ((50.0, 50.0, 50.0), (0.01, 0.5, 0.5))])
def test_a_hand_that_is_aslant_to_the_plane_holds_as_in_space(
    grasped: Callable[[Any, bool | None], withe.Simulation], stiffness: Any
) -> None:
    found = []
    for planar in (None, False):
        simulation = grasped(stiffness, planar)
        simulation.equilibrium()
        found.append(simulation.positions())
    np.testing.assert_allclose(*found, atol=1e-8)
