"""Gradients of scalars of every read-out, against differences of whole equilibria and whole runs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from gradient_scenes import NODES, Drawn, difference, move_with_directors, settings

OF_RODS = ("directors", "curvatures", "twists", "tensions")


def read(simulation, word, target):
    """A read-out by its word."""
    if word.startswith("reaction"):
        reaction = simulation.reaction(target)
        return reaction.force if word == "reaction_forces" else reaction.moment
    return getattr(simulation, word)(target)


def weights_of(drawn, random, frames, words):
    """Derivatives of a scalar by words of the read-outs of the arm and the wall, none of them small beside others."""
    out = {}
    for word in words:
        target = drawn.wall if word.startswith("reaction") else drawn.arm
        now = read(drawn.simulation, word, target)
        size = {"curvatures": 0.01, "twists": 0.01, "velocities": 0.01, "spins": 1e-3}.get(word, 0.1)
        out[word] = {target: size * random.normal(size=(*frames, *now.shape))}
        if word in ("positions", "velocities"):
            out[word] = {
                target: 10.0 * size * drawn.vectors(random, NODES * int(np.prod(frames))).reshape(*frames, NODES, 3)
            }
    return out


@pytest.mark.parametrize("word", [*OF_RODS, "positions", "reaction_forces", "reaction_moments"])
@pytest.mark.parametrize("support", ["frame", "edge"])
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
def test_gradient_of_a_read_out_of_an_equilibrium_is_that_of_differences(planar, joint, support, word):
    random = np.random.default_rng(13)
    drawn = Drawn(planar=planar, joint=joint, integrator="static", support=support)
    sim, arm, wall = drawn.simulation, drawn.arm, drawn.wall
    sim.set(arm, natural_curvature=sim.get(arm, "natural_curvature") + 2.0 * drawn.bent(random))
    if not planar:
        sim.set(arm, natural_twist=3.0)
    found = sim.equilibrium()
    weights = weights_of(drawn, random, (), [word])
    place, axis = sim.positions(arm)[0], np.array([0.0, 1.0, 0.0]) if planar else np.array([0.3, 0.5, -0.4])
    turned = sim.get(wall, "rotation")

    def of():
        sim.equilibrium()
        return float(sum((by * read(sim, word, target)).sum() for target, by in weights[word].items()))

    def turn(h):
        sim.move(wall, rotation=Rotation.from_rotvec(h * axis).as_matrix() @ turned)

    along = np.array([1.0, 0, 0])
    cases = [
        *settings(drawn, random),
        ((wall, "position"), along, lambda h: sim.move(wall, position=place + h * along), 1e-3),
        ((wall, "rotation"), axis, turn, 1e-4),
    ]
    gradients = found.gradient(weights, [unknown for unknown, *_ in cases])
    for gradient, (unknown, way, change, size) in zip(gradients, cases, strict=True):
        wide, near = (difference(sim, of, change, times * size) for times in (2.0, 1.0))
        assert np.sum(gradient * way) == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6, abs=1e-9), unknown


@pytest.mark.parametrize("support", ["frame", "edge", "moving frame", "moving edge"])
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(
    ("integrator", "viscosity"),
    [("backward_euler", 300.0), ("implicit_midpoint", 300.0), ("fourth_order", 0.0), ("energy_momentum", 300.0)],
)
def test_gradient_of_the_read_outs_of_a_run_is_that_of_differences(integrator, viscosity, planar, joint, support):
    random = np.random.default_rng(14)
    hold = support.removeprefix("moving ")
    drawn = Drawn(
        planar=planar,
        joint=joint,
        integrator=integrator,
        support=hold,
        viscosity=viscosity,
        adaptive=False,
        time_step=2e-3,
    )
    sim, arm = drawn.simulation, drawn.arm
    held = {"frame": 1, "edge": 2}[hold]
    velocities, way = drawn.vectors(random, NODES), drawn.vectors(random, NODES)
    velocities[:held], way[:held] = 0.0, 0.0
    sim.set_velocities(arm, 0.3 * velocities)
    if not planar:
        spins = 20.0 * random.normal(size=NODES - 1)
        sim.set_state(arm, spins=spins)
    if support != hold:
        turn = Rotation.from_rotvec((0, 0.4, 0) if planar else (0.1, 0.4, -0.2))
        sim.move(drawn.wall, position=(0.01, 0, 0.02), rotation=turn, over=15e-3)
    words = [*OF_RODS, "positions", "velocities", "spins", "reaction_forces", "reaction_moments"]
    weights = weights_of(drawn, random, (4,), words)
    for word, parts in weights.items():
        if word.startswith("reaction"):
            parts[drawn.wall][0] = 0.0
    extras = {
        "reaction_forces": lambda s: s.reaction(drawn.wall).force,
        "reaction_moments": lambda s: s.reaction(drawn.wall).moment,
    }

    def run(**options):
        return sim.run(18e-3, record_every=6e-3, progress=False, record=extras, **options)

    def of():
        record = run()
        return float(
            sum(
                (by * (record[word] if word in extras else getattr(record, word)(target))).sum()
                for word, parts in weights.items()
                for target, by in parts.items()
            )
        )

    cases = list(settings(drawn, random))
    nodes = len(sim.positions())
    cases.append(
        (
            "initial_velocities",
            np.concatenate([way, np.zeros((nodes - NODES, 3))]),
            lambda h: sim.set_velocities(arm, 0.3 * velocities + h * way),
            1e-4,
        )
    )
    if not joint and hold != "edge":
        cases.append(("initial_positions", way, lambda h: move_with_directors(sim, arm, h * way), 1e-6))
    start = sim.snapshot()
    record = run(differentiable=True)
    sim.restore(start)
    for word, parts in weights.items():
        by = {word: parts}
        gradients = record.gradient(by, [unknown for unknown, *_ in cases])
        assert len(gradients) == len(cases), word
    gradients = record.gradient(weights, [unknown for unknown, *_ in cases])
    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        wide, near = (difference(sim, of, change, times * size) for times in (4.0, 2.0))
        assert np.sum(gradient * along) == pytest.approx((4.0 * near - wide) / 3.0, rel=2e-6, abs=1e-9), unknown


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_gradient_of_reactions_is_that_of_their_means_over_a_time_step_that_was_cut(integrator):
    random = np.random.default_rng(17)
    drawn = Drawn(planar=False, joint=False, integrator=integrator, time_step=0.02, tolerance=1e-2, duration=1.0)
    sim, wall = drawn.simulation, drawn.wall
    start, steps = sim.snapshot(), sim.statistics.steps
    weights = random.normal(size=(2, 4, 3))
    weights[:, 0] = 0.0
    extras = {"force": lambda s: s.reaction(wall).force, "moment": lambda s: s.reaction(wall).moment}

    def run(**options):
        return sim.run(0.06, record_every=0.02, progress=False, record=extras, **options)

    def of():
        record = run()
        return float((weights[0] * record["force"]).sum() + (weights[1] * record["moment"]).sum())

    record = run(differentiable=True)
    assert sim.statistics.steps > steps + 30
    sim.restore(start)
    # by what hardly changes where steps are cut
    cases = [case for case in settings(drawn, random) if case[0][1] in ("youngs_modulus", "natural_twist", "force")]
    assert len(cases) == 3
    by = {"reaction_forces": {wall: weights[0]}, "reaction_moments": {wall: weights[1]}}
    gradients = record.gradient(by, [unknown for unknown, *_ in cases])
    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        assert np.sum(gradient * along) == pytest.approx(difference(sim, of, change, 0.1 * size), rel=1e-5), unknown


def test_the_jacobian_of_a_read_out_has_the_rows_of_its_gradients():
    random = np.random.default_rng(15)
    drawn = Drawn(planar=False, joint=True, integrator="static")
    arm, wall = drawn.arm, drawn.wall
    found = drawn.simulation.equilibrium()
    wrt = [(arm, "natural_curvature"), (arm, "youngs_modulus"), "gravity"]
    for of in ((arm, "curvatures"), (arm, "tensions"), (wall, "reaction_moments"), (arm, "positions")):
        target, word = of
        now = read(drawn.simulation, word, target)
        weight = random.normal(size=now.shape)
        gradients, jacobians = found.gradient({word: {target: weight}}, wrt), found.jacobian(of, wrt)
        for gradient, jacobian in zip(gradients, jacobians, strict=True):
            assert jacobian.shape == (*now.shape, *np.shape(gradient))
            np.testing.assert_allclose(
                np.tensordot(weight, jacobian, axes=weight.ndim), gradient, rtol=1e-9, atol=1e-12
            )


def test_what_is_no_read_out_says_so():
    drawn = Drawn(planar=True, joint=False, integrator="backward_euler")
    sim, arm, wall = drawn.simulation, drawn.arm, drawn.wall
    found = sim.equilibrium()
    curvatures = np.zeros((NODES, 2))
    for by, message in (
        ({"colours": {arm: curvatures}}, "derivatives with respect to positions"),
        ({"curvatures": curvatures}, "must be given for rods"),
        ({"curvatures": {arm: np.zeros((3, 2))}}, "shape"),
        ({"curvatures": {wall: curvatures}}, "for rods"),
        ({"reaction_forces": np.zeros(3)}, "must be given for supports"),
        ({"positions": {arm: np.ones((NODES, 3))}}, "plane"),
        ({}, "derivatives with respect to positions"),
    ):
        with pytest.raises(ValueError, match=message):
            found.gradient(by, ["gravity"])
    with pytest.raises(ValueError, match="no read-out"):
        found.jacobian((arm, "colours"), ["gravity"])
    record = sim.run(0.01, record_every=0.01, progress=False, differentiable=True)
    with pytest.raises(ValueError, match="give zeros for the first frame"):
        record.gradient({"reaction_forces": {wall: np.ones((2, 3))}}, ["gravity"])
    with pytest.raises(ValueError, match="not held"):
        record.gradient({"reaction_forces": {arm.end: np.ones((2, 3))}}, ["gravity"])
    with pytest.raises(ValueError, match="plane"):
        record.gradient({"positions": {arm: np.ones((2, NODES, 3))}}, ["gravity"])
    assert isinstance(record, withe.Record)


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_gradient_of_tensions_goes_by_the_natural_stretch_that_a_ramp_has_come_to_when_they_are_read(integrator):
    drawn = Drawn(planar=True, joint=False, integrator=integrator, adaptive=False, time_step=2e-3)
    sim, arm = drawn.simulation, drawn.arm
    start, weights = sim.snapshot(), np.random.default_rng(3).normal(size=(4, NODES - 1))

    def run(h=0.0, **options):
        sim.restore(start)
        sim.set(arm, youngs_modulus=1e6 + h)
        sim.set(arm, natural_stretch=1.02, over=20e-3)
        return sim.run(12e-3, record_every=4e-3, progress=False, **options)

    (found,) = run(differentiable=True).gradient({"tensions": {arm: weights}}, [(arm, "youngs_modulus")])

    def of(h):
        return float((weights * run(h).tensions(arm)).sum())

    wide, near = ((of(h) - of(-h)) / (2.0 * h) for h in (600.0, 300.0))
    assert found == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6)
