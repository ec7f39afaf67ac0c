"""Supports and held bodies are where they are moved to, whatever is in their way."""

from __future__ import annotations

import numpy as np
import pytest

import withe

SOFT = withe.Material(youngs_modulus=1e6, density=1000)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_a_clamp_that_lifts_a_pile_is_in_its_place_after_each_step(integrator: str, seed: int) -> None:
    """Rods stop the guess of a step, but not the clamp."""
    draw = np.random.default_rng(seed)
    speed, step = 10.0 ** draw.uniform(-0.5, 1.2), 10.0 ** draw.uniform(-3.0, -2.0)
    scene = withe.Scene(gravity=(0, 0, -9.81))
    arm = scene.add_rod(start=(0, 0, 0.01), end=(0.1, 0, 0.01), nodes=11, radius=2e-3, material=SOFT)
    for k in range(5):
        angle, centre = draw.uniform(0.0, 3.1), np.array([0.05 + 0.01 * draw.normal(), 0.0, 0.017 + 0.006 * k])
        half = 0.05 * np.array([np.cos(angle), np.sin(angle), 0.0])
        scene.add_rod(start=centre - half, end=centre + half, nodes=9, radius=2e-3, material=SOFT)
    grip = scene.clamp(arm.start)
    scene.add_floor(0.0)
    scene.enable_contact(friction=0.2)
    simulation = scene.build(integrator=integrator, time_step=step)
    simulation.move(grip, position=(0, 0, 0.05), over=0.04 / speed)
    for _ in range(int(0.05 / speed / step) + 2):
        try:
            simulation.step()
        except withe.ConvergenceError:
            break  # a clamp may strike too violently for such steps
        height = 0.01 + min(simulation.time * speed, 0.04)
        assert simulation.positions(arm)[0, 2] == pytest.approx(height, abs=1e-12)


def jaws_about_a_box(share: float, step: float) -> tuple[withe.Simulation, withe.Support]:
    """Jaws that press with a share of the least force for lifting, after 0.1 s, and what holds their hand."""
    friction, mass = 0.5, 0.2
    force = share * mass * 9.81 / (2.0 * friction)
    scene = withe.Scene()
    scene.enable_contact(friction=friction)
    scene.add_floor(friction=friction)
    scene.add_body(withe.solids.Box((0.05, 0.05, 0.05)), mass=mass, position=(0, 0, 0.025), name="box")
    hand = scene.add_body(withe.solids.Box((0.16, 0.04, 0.02)), mass=0.5, position=(0, 0, 0.11), name="hand")
    for side in (-1, 1):
        jaw = scene.add_body(withe.solids.Box((0.01, 0.04, 0.07)), mass=0.05, position=(side * 0.032, 0, 0.055))
        at = (side * 0.032, 0, 0.095)
        scene.join(hand, jaw, "sliding", at=at, axis=(-side, 0, 0), moment=force, damping=20.0)
    grip = scene.clamp(hand)
    simulation = scene.build(time_step=step)
    simulation.run(0.1, progress=False)
    return simulation, grip


@pytest.mark.parametrize("step", [2e-3, 1e-3])
def test_jaws_that_are_too_weak_slip_off_a_box(step: float) -> None:
    """Their edges pass those of the box, and the hand goes on along its path."""
    simulation, grip = jaws_about_a_box(0.9, step)
    simulation.move(grip, position=(0, 0, 0.16), over=0.4)
    simulation.run(0.3, progress=False)
    assert simulation.position("hand")[2] == pytest.approx(0.11 + 0.05 * 0.75, abs=1e-12)
    assert simulation.position("box")[2] == pytest.approx(0.025, abs=1e-5)


def test_jaws_carry_a_box_without_cut_steps() -> None:
    """Rounding of stiff contacts of edges is no imbalance of the bodies that carry these edges.

    The box rocks between the jaws, so the number of rejected steps varies with the time step.
    """

    def path(time: float) -> tuple[float, float, float]:
        share = min(max(time - 0.1, 0.0) / 1.2, 1.0)
        return 0.0, 0.0, 0.11 + 0.06 * share**2 * (3.0 - 2.0 * share)

    rejected = []
    for step in (1.8e-3, 2e-3, 2.2e-3):
        simulation, grip = jaws_about_a_box(1.5, step)
        simulation.move(grip, path=path)
        simulation.run(1.2, progress=False)
        assert simulation.position("box")[2] == pytest.approx(0.085, abs=1e-4)
        rejected.append(simulation.statistics.rejected_steps)
    assert np.mean(rejected) < 40
