"""Gradients of equilibria and of runs with hands, against differences of the whole."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from gradient_scenes import TIGHT, extrapolated
from test_gradient_forward import nodes_of

STEP, NODES = 2e-3, 11
HELD, HELD_EDGES = slice(2, 6), slice(2, 5)  # by a rigid hand
INTEGRATORS = ("backward_euler", "implicit_midpoint", "fourth_order", "energy_momentum")
# Fourth-order steps go back in time, which hands that slip do not allow.
YIELDING = [(scheme, "yielding") for scheme in INTEGRATORS] + [
    (scheme, "slipping") for scheme in INTEGRATORS if scheme != "fourth_order"
]
STIFFNESS = np.array([300.0, 400.0, 500.0, 0.2, 0.3, 0.25])
LIMIT = 0.25


class Held:
    """A curved rod that hangs from a hand on its way, and a load at its end. Kinds: rigid, yielding, slipping."""

    def __init__(self, kind, *, planar, integrator="energy_momentum", stiffness=STIFFNESS, limit=LIMIT, clamped=False):
        self.planar = planar
        scene = withe.Scene()
        viscosity = 0.0 if integrator == "fourth_order" else 300.0
        material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=viscosity)
        s = np.linspace(0.0, 1.0, NODES)
        points = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
        self.arm = scene.add_rod(points=points, radius=8e-3, material=material, name="arm")
        if clamped:
            scene.clamp(self.arm.end)
        more = {} if kind == "rigid" else {"stiffness": stiffness}
        if kind == "slipping":
            more["force_limit"] = limit
        self.hand = scene.grasp(self.arm, 0.12, 0.055, name="hand", **more)
        self.force = scene.add_force(self.arm.node(8), (0, 0, 0.1))
        options = {} if integrator == "static" else {"time_step": STEP, "adaptive": False}
        self.simulation = scene.build(integrator=integrator, planar=planar or None, **options, **TIGHT)

    def move(self, simulation, shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), **over):
        target = np.array((0.125, 0.0, 0.03)) + shift
        about = Rotation.from_rotvec(turn) * Rotation.from_rotvec((0.0, 0.35, 0.0) if self.planar else (0.2, 0.3, -0.1))
        drawn = Rotation.from_matrix(self.start_rotation)
        simulation.move(self.hand, position=target, rotation=about * drawn, **over)

    def run(self, *, shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), **options):
        self.start_rotation = self.simulation.pose(self.hand).rotation
        steps = iter(range(1000))

        def before_step(simulation):
            if next(steps) == 2:
                self.move(simulation, shift, turn, over=12e-3)

        return self.simulation.run(24e-3, record_every=4e-3, progress=False, before_step=before_step, **options)

    def axes(self):
        """A direction to displace the hand along, and one to turn it about."""
        return (
            (np.array((0.6, 0, 0.7)), np.array((0, 1.0, 0)))
            if self.planar
            else (np.array((0.6, 0.3, 0.7)), np.array((0.3, 0.5, -0.4)))
        )


def weights_of(random, planar, frames=7):
    out = random.normal(size=(2, frames, NODES, 3)) * ((1, 0, 1) if planar else (1, 1, 1))
    out[1] *= 0.01
    return {"positions": out[0], "velocities": out[1]}


def scalar(weights, record):
    return sum(float((weights[word] * getattr(record, word)()).sum()) for word in weights)


def slips(record_or_simulation, held):
    return np.linalg.norm(record_or_simulation.deflection(held.hand).slip)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("integrator", "kind"), [*((scheme, "rigid") for scheme in INTEGRATORS), *YIELDING])
def test_gradient_of_a_run_with_a_moving_hand_is_that_of_differences(integrator, planar, kind):
    random = np.random.default_rng(31)
    weights = weights_of(random, planar)
    held = Held(kind, planar=planar, integrator=integrator)
    sim, arm = held.simulation, held.arm
    start = sim.snapshot()
    wrt = [(arm, "youngs_modulus"), (held.force, "force"), "gravity", "initial_velocities"]
    record = held.run(differentiable=True)
    assert (slips(sim, held) > 1e-5) == (kind == "slipping")
    found = record.gradient(weights, wrt)

    def check(gradient, of, size, name):
        assert gradient == pytest.approx(extrapolated(of, size), rel=1e-6, abs=1e-9), name

    def after(change, **options):
        sim.restore(start)
        change()
        return scalar(weights, held.run(**options))

    check(found[0], lambda h: after(lambda: sim.set(arm, youngs_modulus=1e6 + h)), 3e2, "youngs_modulus")
    check(found[1][2], lambda h: after(lambda: sim.set(held.force, force=(0, 0, 0.1 + h))), 1e-3, "force")
    check(found[2][2], lambda h: after(lambda: sim.set(None, gravity=(0, 0, -9.81 + h))), 1e-2, "gravity")
    way = random.normal(size=(NODES, 3)) * ((1, 0, 1) if planar else (1, 1, 1))
    if kind == "rigid":
        way[HELD] = 0.0
    check(
        float((found[3] * way).sum()),
        lambda h: after(lambda: sim.set_velocities(arm, h * way)),
        1e-4,
        "initial_velocities",
    )
    (call,) = record.gradient(weights, wrt).calls
    shift, turn = held.axes()
    nothing = lambda: None  # noqa: E731
    check(call.gradients["position"] @ shift, lambda h: after(nothing, shift=h * shift), 1e-4, "position of the call")
    check(call.gradients["rotation"] @ turn, lambda h: after(nothing, turn=h * turn), 1e-3, "rotation of the call")


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("integrator", "kind"), YIELDING)
def test_gradient_of_a_run_by_what_a_moving_hand_yields_with_is_that_of_differences(integrator, planar, kind):
    random = np.random.default_rng(32)
    weights, uneven = weights_of(random, planar), random.uniform(0.5, 1.5, size=6)
    held = Held(kind, planar=planar, integrator=integrator)
    wrt = [(held.hand, "stiffness")] + ([(held.hand, "force_limit")] if kind == "slipping" else [])
    found = held.run(differentiable=True).gradient(weights, wrt)

    def run(change=0.0, limit=LIMIT):
        other = Held(kind, planar=planar, integrator=integrator, stiffness=STIFFNESS * (1.0 + change), limit=limit)
        return scalar(weights, other.run())

    by_stiffness = extrapolated(lambda h: run(h * uneven), 1e-3)
    assert found[0] @ (uneven * STIFFNESS) == pytest.approx(by_stiffness, rel=1e-6, abs=1e-9)
    if kind == "slipping":
        assert found[1] == pytest.approx(extrapolated(lambda h: run(limit=LIMIT + h), 1e-4), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("kind", ["rigid", "yielding"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_gradient_by_the_pose_that_a_hand_began_with_is_that_of_differences(integrator, planar, kind):
    random = np.random.default_rng(32)
    weights = weights_of(random, planar)
    held = Held(kind, planar=planar, integrator=integrator)
    sim, arm, hand = held.simulation, held.arm, held.hand
    start, pose = sim.snapshot(), sim.pose(hand)

    def run(shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), **options):
        """Elsewhere all the while; what is free begins as it does."""
        sim.restore(start)
        positions, directors = sim.positions(arm), sim.directors(arm)[:, 0]
        sim.move(
            hand,
            position=pose.position + np.asarray(shift),
            rotation=Rotation.from_rotvec(turn).as_matrix() @ pose.rotation,
        )
        sim.equilibrium()
        if kind == "rigid":
            positions[HELD] = sim.positions(arm)[HELD]
            directors[HELD_EDGES] = sim.directors(arm)[HELD_EDGES, 0]
        tangents = np.diff(positions, axis=0)
        tangents /= np.linalg.norm(tangents, axis=1)[:, None]
        before = np.diff(first, axis=0)
        before /= np.linalg.norm(before, axis=1)[:, None]
        along = np.sum(directors * tangents, axis=1) / (1.0 + np.sum(before * tangents, axis=1))
        carried = directors - along[:, None] * (before + tangents)
        if kind == "rigid":
            carried[HELD_EDGES] = directors[HELD_EDGES]
        sim.set_state(arm, positions=positions, directors=carried, velocities=np.zeros((NODES, 3)))
        return sim.run(24e-3, record_every=4e-3, progress=False, **options)

    first = sim.positions(arm)
    by_place, by_turn = run(differentiable=True).gradient(weights, [(hand, "position"), (hand, "rotation")])
    shift, turn = held.axes()
    for gradient, of, size in (
        (by_place @ shift, lambda h: scalar(weights, run(shift=h * shift)), 1e-5),
        (by_turn @ turn, lambda h: scalar(weights, run(turn=h * turn)), 1e-4),
    ):
        assert gradient == pytest.approx(extrapolated(of, size), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("kind", ["rigid", "yielding"])
@pytest.mark.parametrize("planar", [True, False])
def test_gradient_of_an_equilibrium_in_a_hand_is_that_of_differences(planar, kind):
    random = np.random.default_rng(33)
    held = Held(kind, planar=planar, integrator="static", clamped=True)
    sim, arm, hand = held.simulation, held.arm, held.hand
    held.start_rotation = sim.pose(hand).rotation
    held.move(sim)
    weight = random.normal(size=(NODES, 3)) * ((1, 0, 1) if planar else (1, 1, 1))
    wrt = [(arm, "youngs_modulus"), (held.force, "force"), (hand, "position"), (hand, "rotation")]
    found = sim.equilibrium().gradient(weight, wrt)
    start = sim.snapshot()
    shift, turn = held.axes()

    def of(change):
        sim.restore(start)
        change()
        sim.equilibrium()
        return float((weight * sim.positions()).sum())

    for gradient, change, size in (
        (found[0], lambda h: sim.set(arm, youngs_modulus=1e6 + h), 1e3),
        (found[1][2], lambda h: sim.set(held.force, force=(0, 0, 0.1 + h)), 1e-3),
        (found[2] @ shift, lambda h: held.move(sim, shift=h * shift), 1e-4),
        (found[3] @ turn, lambda h: held.move(sim, turn=h * turn), 1e-3),
    ):
        assert gradient == pytest.approx(extrapolated(lambda h, c=change: of(lambda: c(h)), size), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("planar", [True, False])
def test_gradient_of_an_equilibrium_by_the_stiffness_of_a_hand_is_that_of_differences(planar):
    random = np.random.default_rng(35)
    weight = random.normal(size=(NODES, 3)) * ((1, 0, 1) if planar else (1, 1, 1))
    uneven = random.uniform(0.5, 1.5, size=6)

    def in_equilibrium(h=0.0):
        stiffness = STIFFNESS * (1.0 + h * uneven)
        held = Held("yielding", planar=planar, integrator="static", clamped=True, stiffness=stiffness)
        held.start_rotation = held.simulation.pose(held.hand).rotation
        held.move(held.simulation)
        return held, held.simulation.equilibrium()

    held, equilibrium = in_equilibrium()
    (found,) = equilibrium.gradient(weight, [(held.hand, "stiffness")])
    by_differences = extrapolated(lambda h: float((weight * in_equilibrium(h)[0].simulation.positions()).sum()), 1e-3)
    assert found @ (uneven * STIFFNESS) == pytest.approx(by_differences, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_gradient_of_what_a_rigid_hand_holds_with_is_that_of_differences(integrator, planar):
    held = Held("rigid", planar=planar, integrator=integrator)
    sim, arm, hand = held.simulation, held.arm, held.hand
    random = np.random.default_rng(34)
    weights = random.normal(size=(2, 4, 3))
    weights[:, 0] = 0.0
    start = sim.snapshot()

    def run(h=0.0, **options):
        sim.restore(start)
        sim.set(arm, youngs_modulus=1e6 + h)
        return sim.run(12e-3, record_every=4e-3, progress=False, **options)

    by = {"reaction_forces": {hand: weights[0]}, "reaction_moments": {hand: weights[1]}}
    record = run(differentiable=True)
    (found,) = record.gradient(by, [(arm, "youngs_modulus")])

    def of(h):
        sim.restore(start)
        sim.set(arm, youngs_modulus=1e6 + h)
        total = 0.0
        for frame in range(1, 4):
            sim.step(2)
            wrench = sim.wrench(hand)
            total += float(weights[0, frame] @ wrench.force + weights[1, frame] @ wrench.moment)
        return total

    assert found == pytest.approx(extrapolated(of, 1e3), rel=1e-6, abs=1e-12)


class Wrench:
    """A weighted sum of what a hand that yields holds with on its way, after every second step."""

    def __init__(self, kind, *, planar, integrator):
        self.made = {"kind": kind, "planar": planar, "integrator": integrator}
        self.weights = np.random.default_rng(35).normal(size=(2, 4, 3))
        self.weights[:, 0] = 0.0

    def held(self, youngs_modulus=1e6, force=0.1, **hand):
        held = Held(**self.made, **hand)
        held.start_rotation = held.simulation.pose(held.hand).rotation
        held.simulation.set(held.arm, youngs_modulus=youngs_modulus)
        held.simulation.set(held.force, force=(0, 0, force))
        return held

    def run(self, held):
        steps = iter(range(100))

        def before_step(simulation):
            if next(steps) == 1:
                held.move(simulation, over=9e-3)

        options = {"progress": False, "before_step": before_step, "differentiable": True}
        return held.simulation.run(12e-3, record_every=4e-3, **options)

    def of(self, shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), **given):
        held, total = self.held(**given), 0.0
        for step in range(6):
            if step == 1:
                held.move(held.simulation, shift, turn, over=9e-3)
            held.simulation.step(1)
            if step % 2 == 1:
                wrench = held.simulation.wrench(held.hand)
                force, moment = self.weights[:, step // 2 + 1]
                total += float(force @ wrench.force + moment @ wrench.moment)
        return total


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("integrator", "kind"), YIELDING)
def test_gradient_of_what_a_yielding_hand_holds_with_is_that_of_differences(integrator, planar, kind):
    case = Wrench(kind, planar=planar, integrator=integrator)
    held, way = case.held(), np.array((0.8, 1.2, -0.5, 0.7, 1.1, -0.9)) * STIFFNESS
    wrt = [(held.arm, "youngs_modulus"), (held.force, "force"), (held.hand, "stiffness")]
    wrt += [(held.hand, "force_limit")] if kind == "slipping" else []
    record = case.run(held)
    assert (slips(held.simulation, held) > 1e-5) == (kind == "slipping")
    by = zip(("reaction_forces", "reaction_moments"), case.weights, strict=True)
    found = record.gradient({word: {held.hand: weights} for word, weights in by}, wrt)
    checks = [
        ("youngs_modulus", found[0], lambda h: case.of(youngs_modulus=1e6 + h), 1e3),
        ("force", found[1][2], lambda h: case.of(force=0.1 + h), 1e-3),
        ("stiffness", found[2] @ way, lambda h: case.of(stiffness=STIFFNESS + h * way), 1e-3),
    ]
    if kind == "slipping":
        checks.append(("force_limit", found[3], lambda h: case.of(limit=LIMIT + h), 1e-4))
    (call,) = found.calls
    if call.gradients:
        shift, turn = held.axes()
        checks += [
            ("position", call.gradients["position"] @ shift, lambda h: case.of(shift=h * shift), 1e-5),
            ("rotation", call.gradients["rotation"] @ turn, lambda h: case.of(turn=h * turn), 1e-4),
        ]
    for name, gradient, of, size in checks:
        assert gradient == pytest.approx(extrapolated(of, size), rel=1e-6, abs=1e-9), name


@pytest.mark.parametrize("planar", [True, False])
def test_jacobian_of_what_a_yielding_hand_holds_with_in_equilibrium_is_that_of_differences(planar):
    def moved(shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), stiffness=STIFFNESS):
        held = Held("yielding", planar=planar, integrator="static", clamped=True, stiffness=stiffness)
        held.start_rotation = held.simulation.pose(held.hand).rotation
        held.move(held.simulation, shift, turn)
        return held, held.simulation.equilibrium()

    def of(**changed):
        held, _ = moved(**changed)
        wrench = held.simulation.wrench(held.hand)
        return np.stack([wrench.force, wrench.moment])

    held, found = moved()
    shift, turn = held.axes()
    wrt = [(held.hand, "position"), (held.hand, "rotation"), (held.hand, "stiffness")]
    by = [found.jacobian((held.hand, f"reaction_{word}"), wrt) for word in ("forces", "moments")]
    for i, (way, change, size) in enumerate(
        (
            (shift, lambda h: of(shift=h * shift), 1e-5),
            (turn, lambda h: of(turn=h * turn), 1e-4),
            (STIFFNESS, lambda h: of(stiffness=(1.0 + h) * STIFFNESS), 1e-3),
        )
    ):
        expected = extrapolated(change, size)
        for word in range(2):
            np.testing.assert_allclose(by[word][i] @ way, expected[word], rtol=1e-6, atol=1e-7 * np.abs(expected).max())


def test_what_has_no_gradient_with_hands_says_what_to_do():
    held = Held("slipping", planar=True, integrator="static", clamped=True)
    sim = held.simulation
    held.start_rotation = sim.pose(held.hand).rotation
    held.move(sim)
    equilibrium = sim.equilibrium()
    assert slips(sim, held) > 1e-5
    with pytest.raises(ValueError, match="give a greater force_limit, or run with differentiable=True"):
        equilibrium.gradient(np.zeros((NODES, 3)), [(held.arm, "youngs_modulus")])
    moving = Held("yielding", planar=True)
    record = moving.run(differentiable=True)
    with pytest.raises(ValueError, match="has no force_limit to differentiate by"):
        record.gradient({"positions": np.zeros((7, NODES, 3))}, [(moving.hand, "force_limit")])
    rigid = Held("rigid", planar=True)
    record = rigid.run(differentiable=True)
    with pytest.raises(ValueError, match="is not a hand that yields"):
        record.gradient({"positions": np.zeros((7, NODES, 3))}, [(rigid.hand, "stiffness")])


@pytest.mark.parametrize("kind", ["rigid", "yielding"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_gradient_of_a_run_in_a_hand_is_that_of_its_steps_one_after_the_other(integrator, planar, kind):
    held, count = Held(kind, planar=planar, integrator=integrator), 4
    sim, arm = held.simulation, held.arm
    wrt = [(arm, "youngs_modulus"), "gravity", *([(held.hand, "stiffness")] if kind == "yielding" else [])]
    weights = np.random.default_rng(36).normal(size=(2, NODES, 3)) * ((1, 0, 1) if planar else (1, 1, 1))
    weights[0] = 0.0
    start = sim.snapshot()
    record = sim.run(count * STEP, record_every=count * STEP, progress=False, differentiable=True)
    found = record.gradient({"positions": weights}, wrt)
    at_end = weights[1].ravel() @ nodes_of(sim, "positions")
    sim.restore(start)
    by_inputs = np.zeros((len(at_end), 1))
    for _ in range(count):
        A, B = sim.step_jacobian(wrt)
        by_inputs = A @ by_inputs + B.toarray()
        sim.step(1)
    assert at_end @ by_inputs == pytest.approx(np.concatenate([np.ravel(part) for part in found]), rel=1e-10, abs=1e-13)
