"""A small task for tests of environments and policies."""

import numpy as np

import withe


class Touch(withe.learning.Task):
    """The tip of a short arm is to touch a point: the example of the docstring."""

    action_size, control_step, steps = 2, 0.1, 3
    goal, viscosity = np.array([0.1, 0.0, 0.25]), 1e3

    def build(self, generator):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=self.viscosity)
        arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, 0.3), nodes=9, radius=1e-2, material=rubber, name="arm")
        scene.clamp(arm.start)
        return scene.build(time_step=0.02)

    def act(self, robots, actions, chosen):
        robots.set("arm", natural_curvature=6.0 * actions, over=self.control_step, lanes=chosen)

    def observe(self, robots):
        return np.hstack([robots.positions("arm")[:, -1], robots.velocities("arm")[:, -1]])

    def reward(self, robots):
        return -np.linalg.norm(robots.positions("arm")[:, -1] - self.goal, axis=1)
