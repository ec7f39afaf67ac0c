"""Gradients by where obstacles are and go, against differences of whole runs and equilibria."""

import numpy as np
import pytest

import withe
from gradient_scenes import TIGHT, extrapolated
from test_gradient_contact import FRICTIONS, INTEGRATORS, NODES, Touching

OBSTACLES = ("floor", "slope in a plane", "sphere", "capsule", "post", "floor slowly")
FIRST, SECOND = 3, 8  # steps before which an obstacle sets out


def run(touching, targets, roll=None, **options):
    """A run in which the obstacle goes to each of the targets, to the second one before it has come to the first."""
    steps = iter(range(100))

    def before_step(simulation):
        step = next(steps)
        if step in targets:
            turn = {} if roll is None else {"roll": roll}
            simulation.move(touching.other, position=targets[step], over=17e-3 if step == FIRST else 6e-3, **turn)
        touching.touched |= len(simulation.contacts()) > 0

    touching.touched = False
    return touching.simulation.run(30e-3, record_every=10e-3, progress=False, before_step=before_step, **options)


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("kind", OBSTACLES)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_gradient_by_where_an_obstacle_is_and_goes_is_that_of_differences(integrator, kind, friction):
    random = np.random.default_rng(8)
    touching = Touching(kind, friction, integrator)
    sim, flat = touching.simulation, (1, 0 if touching.planar else 1, 1)
    start, at, way = sim.snapshot(), sim.get(touching.other, "position"), random.normal(size=3) * flat
    targets = {FIRST: at + np.array((4e-3, 2e-3, 1e-3)) * flat, SECOND: at + np.array((2e-3, 1e-3, 1e-3)) * flat}
    weights = random.normal(size=(4, NODES, 3)) * flat
    record = run(touching, targets, differentiable=True)
    assert touching.touched
    found = record.gradient({"positions": weights}, [(touching.other, "position")])
    assert [(call.call, call.target) for call in found.calls] == 2 * [("move", touching.other.name)]

    def moved(step, h):
        sim.restore(start)
        return float((weights * run(touching, targets | {step: targets[step] + h * way}).positions()).sum())

    def drawn_elsewhere(h):
        other = Touching(kind, friction, integrator, offset=h * way)
        return float((weights * run(other, targets).positions()).sum())

    by_calls = [call.gradients["position"] @ way for call in found.calls]
    assert by_calls[0] == pytest.approx(extrapolated(lambda h: moved(FIRST, h), 4e-8), rel=1e-5)
    assert by_calls[1] == pytest.approx(extrapolated(lambda h: moved(SECOND, h), 4e-8), rel=1e-5)
    size = max(abs(value) for value in by_calls)
    assert found[0] @ way == pytest.approx(extrapolated(drawn_elsewhere, 4e-8), rel=1e-5, abs=1e-6 * size)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_obstacle_that_turns_has_gradients_by_where_it_goes_but_with_lagged_friction(integrator):
    targets = {FIRST: (0.0, 1e-3, 2e-3), SECOND: (1e-3, 0.0, 1e-3)}
    touching = Touching("floor", "implicit", integrator)
    sim, start, way = touching.simulation, touching.simulation.snapshot(), np.array((0.4, 0.7, -0.6))
    weights = np.random.default_rng(8).normal(size=(4, NODES, 3))
    found = run(touching, targets, 0.05, differentiable=True).gradient({"positions": weights}, ["gravity"])

    def moved(h):
        sim.restore(start)
        return float((weights * run(touching, targets | {SECOND: targets[SECOND] + h * way}, 0.05).positions()).sum())

    assert found.calls[1].gradients["position"] @ way == pytest.approx(extrapolated(moved, 1e-7), rel=1e-5)
    lagged = run(Touching("floor", "lagged", integrator), targets, 0.05, differentiable=True)
    with pytest.raises(ValueError, match="on an obstacle that turns: use friction_model='implicit'"):
        lagged.gradient({"positions": weights}, ["gravity"])


@pytest.mark.parametrize("planar", [True, False])
def test_gradient_of_an_equilibrium_by_where_an_obstacle_is_is_that_of_differences(planar):
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)
    arm = scene.add_rod(start=(0, 0, 0.03), end=(0.3, 0, 0.03), nodes=NODES, radius=5e-3, material=material)
    scene.clamp(arm.start)
    bar = scene.add_capsule((0.2, -0.1, 0.01), (0.2, 0.1, 0.01) if planar else (0.23, 0.1, 0.012), 1e-2)
    scene.enable_contact(stiffness=2e4, distance_tolerance=2e-3)
    sim = scene.build(integrator="static", planar=planar or None, **TIGHT)
    found, flat = sim.equilibrium(), (1, 0 if planar else 1, 1)
    assert len(sim.contacts()) > 0
    random = np.random.default_rng(21)
    weight, way, at = random.normal(size=(NODES, 3)) * flat, random.normal(size=3) * flat, sim.get(bar, "position")
    (by_place,) = found.gradient(weight, [(bar, "position")])
    (by_tip,) = found.jacobian(arm.end, [(bar, "position")])
    assert by_tip.shape == (3, 3)

    def of(h, weight=weight):
        sim.move(bar, position=at + h * way)
        sim.equilibrium()
        return float((weight * sim.positions()).sum())

    assert by_place @ way == pytest.approx(extrapolated(of, 1e-6), rel=1e-6)
    lift = np.zeros((NODES, 3))
    lift[-1, 2] = 1.0
    assert by_tip[2] @ way == pytest.approx(extrapolated(lambda h: of(h, lift), 1e-6), rel=1e-6)


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("kind", ["sphere", "post"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_rod_and_an_obstacle_that_are_displaced_alike_move_as_before(integrator, kind, friction):
    touching = Touching(kind, friction, integrator)
    weights = np.zeros((4, NODES, 3))
    weights[1:] = np.random.default_rng(2).normal(size=(3, NODES, 3))
    at = touching.simulation.get(touching.other, "position")
    targets = {FIRST: at + np.array((4e-3, 2e-3, 1e-3)), SECOND: at + np.array((2e-3, 1e-3, 1e-3))}
    record = run(touching, targets, differentiable=True)
    found = record.gradient({"positions": weights}, [(touching.other, "position"), "initial_positions"])
    total = found[0] + found[1].sum(axis=0) + sum(call.gradients["position"] for call in found.calls)
    np.testing.assert_allclose(total, weights.sum(axis=(0, 1)), rtol=1e-10, atol=1e-10 * np.abs(found[0]).max())
