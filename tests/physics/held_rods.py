"""Rods for tests of hands, and tolerances that leave rounding alone."""

import numpy as np

import rods
import withe

TIGHT = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-13)}
SOFT = rods.stiffness(stretch=200.0, twist=0.7)


def curve(edges, closed):
    """Nodes of a rod in space, and the lengths of its edges."""
    if closed:
        angle = np.linspace(0.0, 2.0 * np.pi, edges, endpoint=False)
        x = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.sin(2.0 * angle)], axis=1) / (2.0 * np.pi)
        return x, np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1)
    s = np.linspace(0.0, 1.0, edges + 1)
    x = np.stack([s, 0.1 * s**2, 0.05 * np.sin(4.0 * s)], axis=1)
    return x, np.linalg.norm(np.diff(x, axis=0), axis=1)


def rope(edges=12, weight=1.0, closed=False, forked=False, **build):
    """A soft rod in space, free, or clamped and with a twig."""
    scene = withe.Scene(gravity=(0.0, 0.0, -weight))
    points, _ = curve(edges, closed)
    rod = scene.add_rod(points=points, closed=closed, stiffness=SOFT, line_density=1.0, radius=0.02, name="rope")
    if forked:
        fork = points[edges // 2]
        twig = scene.add_rod(
            start=fork,
            end=fork + np.array([0, 0.2, 0]),
            nodes=4,
            stiffness=SOFT,
            line_density=1.0,
            radius=0.02,
            name="twig",
        )
        scene.join(rod.node(edges // 2), twig.start)
        scene.clamp(rod.start)
    options = {"time_step": 1e-3, "planar": False} | TIGHT | build
    return scene.build(**options), rod
