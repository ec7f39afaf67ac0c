"""The rope on the capstan: friction against Euler's and Eytelwein's law, at the centreline and at the surface."""

from __future__ import annotations

import numpy as np
import pytest

import withe

POST, RADIUS, TAIL = 0.05, 0.005, 0.08  # [m]
HOLDING, SPEED = 1.0, 0.01  # [N], [m/s]


def wrapped_rope(nodes: int) -> np.ndarray:
    """Up, half a turn around the post, and down."""
    r = POST + RADIUS
    s = np.linspace(0.0, 2.0 * TAIL + np.pi * r, nodes)
    angle = np.clip((s - TAIL) / r, 0.0, np.pi)
    down = np.minimum(s - TAIL, 0.0) - np.maximum(s - TAIL - np.pi * r, 0.0)
    return np.stack([r * np.cos(angle), np.zeros(nodes), r * np.sin(angle) + down], axis=1)


def tension_ratio(friction: float, centreline: bool) -> float:
    """Pull over hold of a rope that slides slowly round the post."""
    r = POST + RADIUS
    bending = 5e-4 * HOLDING * r**2  # hardly any
    scene = withe.Scene(gravity=(0, 0, 0))
    rope = scene.add_rod(
        points=wrapped_rope(101),
        radius=RADIUS,
        stiffness=withe.Stiffness(stretch=2e3, bend=(bending, bending), twist=bending),
        line_density=0.02,
        natural="straight",
        normal=(0, 1, 0),
    )
    scene.add_capsule((0, -1, 0), (0, 1, 0), POST, friction=friction)
    scene.enable_contact(slip_tolerance=1e-4, centreline_friction=centreline)
    scene.ignore_contact(rope, rope)
    scene.add_force(rope.start, (0, 0, -HOLDING))
    scene.add_drag(0.02)
    grip = scene.pin(rope.end)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3, planar=True)
    simulation.move(grip, position=simulation.positions(rope)[-1] - [0, 0, 2.0 * SPEED], over=2.0)
    simulation.step(600)
    pulls = []
    for _ in range(300):
        simulation.step()
        pulls.append(-simulation.reaction(grip).force[2])
    return float(np.mean(pulls)) / HOLDING


@pytest.mark.case(
    "contact", "Capstan: tension ratio over half a turn, planar", source="exp(mu phi) [Euler 1769, Eytelwein 1808]"
)
@pytest.mark.parametrize("friction", [0.3, 0.5])
def test_a_rope_round_a_post_multiplies_its_tension(friction: float) -> None:
    assert tension_ratio(friction, centreline=True) == pytest.approx(np.exp(friction * np.pi), rel=0.01)
    # At the surface friction also bends the rope, which lowers the exponent.
    r = POST + RADIUS
    exponent = (np.sqrt(1.0 + 4.0 * friction**2 * RADIUS * POST / r**2) - 1.0) * r / (2.0 * friction * RADIUS)
    assert tension_ratio(friction, centreline=False) == pytest.approx(np.exp(exponent * np.pi), rel=0.01)
