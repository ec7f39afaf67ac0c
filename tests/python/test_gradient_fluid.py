"""Gradients of runs in a fluid, against differences of whole runs."""

import numpy as np
import pytest

import withe
from gradient_scenes import NODES, TIGHT, difference, move_with_directors

VISCOSITY = 2.0


def swimming(integrator, *, planar, model="resistive", joint=False):
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=100.0)
    s = np.linspace(0.0, 1.0, NODES)
    points = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
    arm = scene.add_rod(points=points, radius=8e-3, material=material, name="arm")
    if joint:
        tip = points[6] + [0.02, 0.0 if planar else 0.1, 0.1]
        branch = scene.add_rod(start=points[6], end=tip, nodes=5, radius=8e-3, material=material)
        scene.join(arm.node(6), branch.start)
    scene.clamp(arm.start)
    water = scene.add_fluid(VISCOSITY, model=model)
    return (
        scene.build(integrator=integrator, planar=planar or None, time_step=2e-3, adaptive=False, **TIGHT),
        arm,
        water,
    )


@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_gradient_of_a_run_in_a_resistive_fluid_is_that_of_differences(integrator, planar, joint):
    sim, arm, water = swimming(integrator, planar=planar, joint=joint)
    random = np.random.default_rng(9)
    flat = (1, 0, 1) if planar else (1, 1, 1)
    velocities, ways, moved = random.normal(size=(3, NODES, 3)) * flat
    velocities[0] = ways[0] = moved[0] = 0.0
    sim.set_velocities(arm, 0.3 * velocities)
    nodes = len(sim.positions())
    zero = np.zeros((nodes - NODES, 3))
    weights = random.normal(size=(4, nodes, 3)) * flat

    def run(**options):
        return sim.run(24e-3, record_every=8e-3, progress=False, **options)

    def of():
        return float((weights * run().positions()).sum())

    cases = [
        ((water, "viscosity"), 1.0, lambda h: sim.set(water, viscosity=VISCOSITY + h), 1e-3),
        ((arm, "youngs_modulus"), 1.0, lambda h: sim.set(arm, youngs_modulus=1e6 + h), 100.0),
        ((arm, "density"), 1.0, lambda h: sim.set(arm, density=1200.0 + h), 0.1),
        (
            "initial_velocities",
            np.concatenate([ways, zero]),
            lambda h: sim.set_velocities(arm, 0.3 * velocities + h * ways),
            1e-4,
        ),
    ]
    if not joint:
        cases.append(("initial_positions", moved, lambda h: move_with_directors(sim, arm, h * moved), 1e-6))
    start = sim.snapshot()
    gradients = run(differentiable=True).gradient({"positions": weights}, [unknown for unknown, *_ in cases])
    sim.restore(start)
    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        wide, near = (difference(sim, of, change, times * size) for times in (4.0, 2.0))
        assert np.sum(gradient * along) == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6, abs=1e-11), unknown


def test_a_viscosity_that_was_set_while_a_run_went_has_a_gradient_of_its_own():
    sim, _, water = swimming("implicit_midpoint", planar=False)
    weights = np.random.default_rng(10).normal(size=(2, NODES, 3))
    start = sim.snapshot()

    def run(later=3.0, **options):
        sim.restore(start)
        steps = iter(range(100))

        def before_step(simulation):
            if next(steps) == 5:
                simulation.set(water, viscosity=later)

        return sim.run(24e-3, record_every=24e-3, progress=False, before_step=before_step, **options)

    found = run(differentiable=True).gradient({"positions": weights}, [(water, "viscosity")])
    (call,) = found.calls
    wide, near = (
        float((weights * (run(3.0 + h).positions() - run(3.0 - h).positions())).sum()) / (2.0 * h) for h in (4e-3, 2e-3)
    )
    assert call.gradients["viscosity"] == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6)
    assert found[0] != 0.0


def test_what_a_fluid_leaves_without_a_gradient_says_what_to_do():
    zeros = np.zeros((2, NODES, 3))

    def gradient(model, word):
        sim, arm, _ = swimming("backward_euler", planar=False, model=model)
        record = sim.run(4e-3, record_every=4e-3, progress=False, differentiable=True)
        return record.gradient({"positions": zeros}, [(arm, word)])

    with pytest.raises(ValueError, match="use model='resistive' or drag"):
        gradient("stokeslets", "density")
    with pytest.raises(ValueError, match="resistance would change with the radius"):
        gradient("resistive", "radius")
