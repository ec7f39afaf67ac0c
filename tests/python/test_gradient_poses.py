"""Gradients of runs by poses of supports that they began with, against differences of whole runs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradient_scenes import NODES, Drawn

STEP = 2e-3
INTEGRATORS = ("backward_euler", "implicit_midpoint", "fourth_order", "energy_momentum")


def turned(vector):
    return Rotation.from_rotvec(vector)


class Run:
    """A run whose support is elsewhere all the while, by an offset and a turn, what is free beginning as it was."""

    def __init__(self, integrator, *, planar, support, moves):
        viscosity = 0.0 if integrator == "fourth_order" else 300.0
        self.drawn = Drawn(
            planar=planar,
            joint=False,
            integrator=integrator,
            viscosity=viscosity,
            support=support,
            adaptive=False,
            time_step=STEP,
        )
        self.held = 2 if support == "edge" else 1
        self.moves = moves
        self.start = self.drawn.simulation.snapshot()

    def __call__(self, offset=(0, 0, 0), turn=(0, 0, 0), **options):
        sim, arm, wall = self.drawn.simulation, self.drawn.arm, self.drawn.wall
        sim.restore(self.start)
        place, spin = np.array(sim.get(wall, "position")) + offset, turned(turn)
        positions, directors = sim.positions(arm), sim.directors(arm)[:, 0]
        sim.move(wall, position=place, rotation=spin)
        sim.equilibrium()
        positions[: self.held] = sim.positions(arm)[: self.held]
        if self.held == 2:
            directors[0] = sim.directors(arm)[0, 0]
        tangents = np.diff(positions, axis=0)
        tangents /= np.linalg.norm(tangents, axis=1)[:, None]
        directors -= np.sum(directors * tangents, axis=1)[:, None] * tangents
        directors /= np.linalg.norm(directors, axis=1)[:, None]
        sim.set_state(arm, positions=positions, directors=directors, velocities=np.zeros((NODES, 3)))
        steps = iter(range(100))

        def before_step(simulation):
            step = next(steps)
            if step == 3 and self.moves:
                simulation.move(wall, position=(0.01, 0.0, 0.02), rotation=turned((0, 0.4, 0)), over=1.0)

        return sim.run(20e-3, record_every=4e-3, progress=False, before_step=before_step, **options)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("support", ["frame", "edge"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_gradient_by_the_pose_that_a_run_began_with_is_that_of_differences(integrator, planar, support, moves):
    run = Run(integrator, planar=planar, support=support, moves=moves)
    random = np.random.default_rng(11)
    nodes = len(run.drawn.simulation.positions())
    weights = np.array([run.drawn.vectors(random, nodes) for _ in range(6)])
    wall = run.drawn.wall
    record = run(differentiable=True)
    by_place, by_turn = record.gradient({"positions": weights}, [(wall, "position"), (wall, "rotation")])
    assert by_place.shape == by_turn.shape == (3,)

    def of(**pose):
        return float((weights * run(**pose).positions()).sum())

    for gradient, name, axis, size in (
        (by_place, "offset", np.array([0.6, 0.0 if planar else 0.3, 0.7]), 1e-5),
        (by_turn, "turn", np.array([0.0, 1.0, 0.0] if planar else [0.3, 0.5, -0.4]), 1e-4),
    ):
        wide, near = ((of(**{name: h * axis}) - of(**{name: -h * axis})) / (2.0 * h) for h in (2.0 * size, size))
        assert gradient @ axis == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6, abs=1e-9), name


def test_poses_of_runs_that_have_no_gradient_say_what_to_do():
    drawn = Drawn(planar=True, joint=False, integrator="implicit_midpoint", adaptive=False, time_step=STEP)
    sim, wall = drawn.simulation, drawn.wall
    record = sim.run(8e-3, record_every=8e-3, progress=False, differentiable=True)
    moments = {"reaction_moments": {wall: np.zeros((2, 3))}}
    with pytest.raises(ValueError, match="use integrator='energy_momentum' or 'backward_euler'"):
        record.gradient(moments, [(wall, "position")])
    with pytest.raises(ValueError, match="step_jacobian is not available with respect to the pose"):
        sim.step_jacobian([(wall, "position")])


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["energy_momentum", "backward_euler"])
def test_gradient_of_a_reaction_moment_by_the_pose_that_a_run_began_with_is_that_of_differences(
    integrator, planar, moves
):
    run = Run(integrator, planar=planar, support="frame", moves=moves)
    wall = run.drawn.wall
    weights = np.random.default_rng(3).normal(size=(6, 3))
    weights[0] = 0.0
    moments = {"moment": lambda simulation: simulation.reaction(wall).moment}
    record = run(differentiable=True, record=moments)
    found = record.gradient({"reaction_moments": {wall: weights}}, [(wall, "position"), (wall, "rotation")])
    for gradient, name, axis, size in (
        (found[0], "offset", np.array([0.6, 0.0 if planar else 0.3, 0.7]), 1e-5),
        (found[1], "turn", np.array([0.0, 1.0, 0.0] if planar else [0.3, 0.5, -0.4]), 1e-4),
    ):

        def of(h, name=name, axis=axis):
            return float((weights * run(record=moments, **{name: h * axis})["moment"]).sum())

        wide, near = ((of(h) - of(-h)) / (2.0 * h) for h in (2.0 * size, size))
        assert gradient @ axis == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6), name
