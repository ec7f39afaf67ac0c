"""Gradients of runs by adjoints against derivatives carried forward, step by step."""

import numpy as np
import pytest

from gradient_scenes import NODES, Drawn
from test_gradient_contact import Touching

STEP, COUNT = 2e-3, 6


def nodes_of(simulation, readout):
    """Displacements (or velocities) of nodes by a state vector: (3 nodes, 2 unknowns); linear, so exact to rounding."""
    start, size = simulation.snapshot(), len(simulation.state_difference(simulation.copy()))
    before, columns = getattr(simulation, readout)(), []
    for axis in np.eye(size):
        simulation.displace_state(1e-3 * axis)
        columns.append((getattr(simulation, readout)() - before).ravel() / 1e-3)
        simulation.restore(start)
    return np.array(columns).T


@pytest.mark.case("inverse", "Gradients of runs by adjoints", source="derivatives carried forward")
@pytest.mark.parametrize(
    ("integrator", "planar", "kind"),
    [
        ("backward_euler", True, None),
        ("backward_euler", False, None),
        ("implicit_midpoint", False, None),
        ("fourth_order", False, None),
        ("energy_momentum", False, None),
        ("backward_euler", True, "implicit"),
        ("backward_euler", False, "implicit"),
        ("backward_euler", False, "lagged"),
    ],
)
def test_gradient_of_a_run_is_that_of_its_steps_one_after_the_other(integrator, planar, kind):
    random = np.random.default_rng(14)
    if kind is None:
        drawn = Drawn(planar=planar, joint=False, integrator=integrator, adaptive=False, time_step=STEP)
        sim, arm = drawn.simulation, drawn.arm
        wrt, count = [(arm, "youngs_modulus"), (arm, "natural_curvature"), (drawn.mass, "mass")], COUNT
    else:
        drawn = Touching("slope in a plane" if planar else "sphere", kind)
        sim, arm = drawn.simulation, drawn.arm
        wrt, count = [(arm, "youngs_modulus"), (drawn.other, "friction"), "slip_tolerance"], 12
    flat = (1, 0, 1) if planar else (1, 1, 1)
    start, weights = sim.snapshot(), random.normal(size=(2, NODES, 3)) * flat
    weights[0] = 0.0
    record = sim.run(count * STEP, record_every=count * STEP, progress=False, differentiable=True)
    assert kind is None or len(sim.contacts()) > 0
    found = record.gradient({"positions": weights}, [*wrt, "initial_velocities"])
    at_end = weights[1].ravel() @ nodes_of(sim, "positions")
    sim.restore(start)
    speeds = nodes_of(sim, "velocities")
    forward = np.eye(len(at_end))
    by_inputs = np.zeros((len(at_end), 1))
    for _ in range(count):
        A, B = sim.step_jacobian(wrt)
        forward, by_inputs = A @ forward, A @ by_inputs + B.toarray()
        sim.step(1)
    expected = at_end @ by_inputs
    together = np.concatenate([np.ravel(value) for value in found[:-1]])
    np.testing.assert_allclose(together, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).min())
    by_speeds = at_end @ forward
    free = found[-1].ravel() @ speeds
    moving = np.abs(speeds).sum(axis=0) > 0.0
    np.testing.assert_allclose(free[moving], by_speeds[moving], rtol=1e-10, atol=1e-10 * np.abs(by_speeds).max())
