"""Two cameras that see a cable in space."""

from __future__ import annotations

import numpy as np

from withe.perception import Camera


def looking(eye, target=(0.0, 0.0, 0.05)):
    """A camera at a place that looks at a target, with z upwards in its picture."""
    forwards = np.subtract(target, eye)
    forwards = forwards / np.linalg.norm(forwards)
    right = np.cross(forwards, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.array([right, np.cross(forwards, right), forwards])
    matrix = [[900.0, 0.0, 447.5], [0.0, 900.0, 335.5], [0.0, 0.0, 1.0]]
    return Camera(matrix, (-0.16, 0.04, 0.001, -0.0008), rotation, -rotation @ eye)


VIEWS = looking((-0.1, -0.85, 0.2)), looking((0.1, -0.5, 0.75))


def curve(seed):
    """A cable of some 0.6 m in space."""
    phases = np.random.default_rng(seed).normal(0.0, 1.0, 5)
    t = np.linspace(0.0, 1.0, 600)
    x = 0.5 * (t - 0.5) + 0.03 * np.sin(2 * np.pi * t + phases[0]) + 0.02 * np.sin(9 * t + phases[1])
    y = 0.07 * np.sin(5 * t + phases[2]) + 0.03 * np.sin(11 * t + phases[3])
    return np.column_stack([x, y, 0.05 + 0.05 * np.sin(6 * t + phases[4])])
