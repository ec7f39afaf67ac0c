"""Assigning an attribute of a scene or a simulation acts, or raises."""

import warnings

import numpy as np
import pytest

import withe


def arm():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=11, radius=5e-3, material=rubber, name="arm")
    scene.clamp(rod.start, name="wall")
    return scene


@pytest.mark.parametrize(
    ("make", "name", "message"),
    [
        (arm, "gravty", "Scene has no attribute 'gravty' to assign: did you mean gravity?"),
        (arm, "integrator", "Scene has no attribute 'integrator' to assign: .* or an option of build"),
        (lambda: arm().build(), "gravity", "Simulation has no attribute 'gravity' to assign: use set, such as"),
        (
            lambda: arm().build(),
            "tolerance",
            "Simulation has no attribute 'tolerance' to assign: .* or an option of Scene.build",
        ),
        (lambda: arm().build_batch(2), "gravity", "Batch has no attribute 'gravity' to assign: use set, such as"),
    ],
)
def test_what_would_act_on_nothing_is_refused(make, name, message):
    thing = make()
    with pytest.raises(AttributeError, match=message):
        setattr(thing, name, (0, 0, 0))
    assert not hasattr(thing, name)


def test_gravity_of_a_scene_is_assigned():
    scene = arm()
    scene.gravity = (0, 0, -1.6)
    assert scene.build().get("gravity")[2] == -1.6


@pytest.mark.parametrize("integrator", ["static", "implicit_midpoint"])
def test_an_equilibrium_of_what_has_not_begun_says_so(integrator):
    simulation = arm().build(integrator=integrator)
    simulation.set("arm", natural_curvature=(0, 3.0), over=1.0)
    with pytest.warns(UserWarning, match="the ramp of 'arm' .over=. has not begun, and time does not advance"):
        simulation.equilibrium()
    simulation.set("arm", natural_curvature=(0, 3.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.equilibrium()
    simulation.move("wall", position=(0, 0, 0.1), over=0.5)
    with pytest.warns(UserWarning, match="the ramp of 'wall' .over=. has not begun"):
        simulation.equilibrium()
    simulation.step(3)  # a ramp on its way is a state like any other
    simulation.equilibrium()
    assert 0.0 < simulation.positions("arm")[0, 2] < 0.1


def test_a_ramp_that_was_restored_away_is_forgotten():
    simulation = arm().build()
    drawn = simulation.snapshot()
    simulation.move("wall", position=(0, 0, 0.1), over=0.5)
    simulation.restore(drawn)
    simulation.equilibrium()
    simulation.move("wall", position=(0, 0, 0.1), over=0.5)
    simulation.reset()
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.positions("arm")[0], (0, 0, 0))


def test_what_derives_from_a_scene_may_have_attributes_of_its_own():
    class Robot(withe.Scene):
        def __init__(self):
            super().__init__()
            self.legs = [
                self.add_rod(
                    start=(0, 0, 0),
                    end=(1, 0, 0),
                    nodes=3,
                    radius=0.01,
                    line_density=1.0,
                    stiffness=withe.Stiffness(stretch=1.0, bend=1.0, twist=1.0),
                )
            ]

    robot = Robot()
    robot.height = 0.3
    assert (robot.height, len(robot.legs)) == (0.3, 1)


def test_a_support_that_was_released_has_nothing_to_begin():
    simulation = arm().build()
    simulation.move("wall", position=(0, 0, 0.1), over=0.5)
    simulation.release("wall")
    simulation.clamp("arm.start")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.equilibrium()
