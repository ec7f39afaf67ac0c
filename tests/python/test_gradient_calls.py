"""Gradients of runs by what was set while they went, call by call, against differences of whole runs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from gradient_scenes import NODES, Drawn

INTEGRATORS = [("backward_euler", 300.0), ("implicit_midpoint", 300.0), ("fourth_order", 0.0), ("energy_momentum", 0.0)]
DURATION, STEP = 20e-3, 2e-3
AWAY = {
    "first": np.array([0.01, 0.005, 0.02]),
    "first turn": np.array([0.1, 0.4, -0.2]),
    "second turn": np.array([-0.1, 0.3, 0.25]),
    "second": np.array([0.3, -0.2, 0.4]),
    "third": np.array([0.012, 0.003, 0.016]),
    "third turn": np.array([0.05, 0.2, 0.1]),
}
CURVATURES = ("bent", "first", "second", "third", "fourth")


def turned(vector):
    return Rotation.from_rotvec(vector).as_matrix()


class Run:
    """A run in which a controller sets one thing after another; `given` holds the values by a name of each."""

    def __init__(self, integrator, viscosity, *, planar, joint, acts, given, support="frame", spun=False):
        self.drawn = Drawn(
            planar=planar,
            joint=joint,
            integrator=integrator,
            viscosity=viscosity,
            support=support,
            adaptive=False,
            time_step=STEP,
        )
        self.acts, self.given = acts, given
        if spun:
            spins = 20.0 * np.random.default_rng(22).normal(size=NODES - 1)
            self.drawn.simulation.set_state(self.drawn.arm, spins=spins)
        self.start = self.drawn.simulation.snapshot()

    def __call__(self, change=None, **options):
        given = self.given if change is None else change
        self.drawn.simulation.restore(self.start)
        steps = iter(range(1000))

        def before_step(simulation):
            for act in self.acts.get(next(steps), ()):
                act(simulation, self.drawn, given)

        return self.drawn.simulation.run(
            DURATION, record_every=2 * STEP, progress=False, before_step=before_step, **options
        )


def check(run, weights, gradients, names, size=1e-3):
    """Each of `gradients` against differences by the value of a name, of two sizes, extrapolated."""

    def of(name, h, way):
        record = run(run.given | {name: run.given[name] + h * way})
        return float(
            sum(
                (by * (getattr(record, word)(*target))).sum()
                for word, parts in weights.items()
                for target, by in parts.items()
            )
        )

    random = np.random.default_rng(17)
    for gradient, name in zip(gradients, names, strict=True):
        value = np.asarray(run.given[name], float)
        assert np.shape(gradient) == value.shape, name
        way = max(np.abs(value).max(), 1e-3) * random.uniform(0.5, 1.0, size=value.shape)
        if name in CURVATURES:  # within the plane
            way = value * random.uniform(0.5, 1.0, size=(*value.shape[:-1], 1))
        elif name in ("gravity", "force") and run.drawn.planar:
            way[1] = 0.0
        ends = [(of(name, h, way) - of(name, -h, way)) / (2.0 * h) for h in (2 * size, size)]
        expected = (4.0 * ends[1] - ends[0]) / 3.0
        assert np.sum(gradient * way) == pytest.approx(expected, rel=2e-6, abs=1e-9), name


def weights_of(drawn, random):
    nodes, frames = len(drawn.simulation.positions()), 1 + round(DURATION / (2 * STEP))
    shape = drawn.simulation.curvatures(drawn.arm).shape
    return {
        "positions": {(): np.array([drawn.vectors(random, nodes) for _ in range(frames)])},
        "curvatures": {(drawn.arm,): 0.01 * random.normal(size=(frames, *shape))},
        "tensions": {(drawn.arm,): 0.01 * random.normal(size=(frames, NODES - 1))},
    }


def gradient_of(run, weights, wrt):
    record = run(differentiable=True)
    by = {
        word: {target[0]: value for target, value in parts.items()} if () not in parts else parts[()]
        for word, parts in weights.items()
    }
    return record.gradient(by, wrt)


@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("integrator", "viscosity"), INTEGRATORS)
def test_gradient_by_what_was_set_while_a_run_went_is_that_of_differences(integrator, viscosity, planar, joint):
    random = np.random.default_rng(16)
    acts = {
        0: [lambda s, d, g: s.set(d.force, force=g["force"])],
        1: [lambda s, d, g: s.set(d.arm, youngs_modulus=g["modulus"])],
        2: [
            lambda s, d, g: s.set(d.arm, poisson_ratio=g["poisson"]),
            lambda s, d, g: s.set(None, gravity=g["gravity"]),
        ],
        3: [lambda s, d, g: s.set(d.spring, stiffness=g["stiffness"]), lambda s, d, g: s.set(d.mass, mass=g["mass"])],
        4: [lambda s, d, g: s.set(d.arm, bend_stiffness=g["bend"], natural_curvature=g["bent"])],
        5: [lambda s, d, g: s.set(d.drag, drag=g["drag"])],
        6: [lambda s, d, g: s.set(d.arm, line_density=g["line"])],
        7: [lambda s, d, g: s.set(d.arm, youngs_modulus=g["later"])],
    }
    given = {
        "force": np.array([0.1, 0.0, 0.4]),
        "modulus": 1.2e6,
        "poisson": 0.3,
        "gravity": np.array([0.5, 0.0, -8.0]),
        "stiffness": 25.0,
        "mass": 0.012,
        "bend": np.array([0.05, 0.04]),
        "bent": None,
        "drag": 0.3,
        "line": np.linspace(0.8, 0.9, NODES - 1),
        "later": 0.9e6,
    }
    run = Run(integrator, viscosity, planar=planar, joint=joint, acts=acts, given=given)
    sim, arm = run.drawn.simulation, run.drawn.arm
    normal = sim.get(arm, "natural_curvature")[0] if planar else np.array([1.0, 0.7])
    given["bent"] = 3.0 * normal / np.linalg.norm(normal)
    weights = weights_of(run.drawn, random)
    found = gradient_of(run, weights, [(arm, "youngs_modulus"), "gravity", (arm, "density")])
    assert [call.call for call in found.calls] == ["set"] * 10
    assert [call.target for call in found.calls][:4] == ["force", "arm", "arm", None]
    assert found.calls[1].time == pytest.approx(STEP)
    words = ["force", "youngs_modulus", "poisson_ratio", "gravity", "stiffness", "mass", "bend_stiffness"]
    by_calls = [call.gradients[word] for call, word in zip(found.calls, words, strict=False)]
    by_calls += [
        found.calls[6].gradients["natural_curvature"],
        found.calls[7].gradients["drag"],
        found.calls[8].gradients["line_density"],
        found.calls[9].gradients["youngs_modulus"],
    ]
    check(run, weights, by_calls, list(given))


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("integrator", "viscosity"), INTEGRATORS)
def test_gradient_by_the_ends_of_ramps_is_that_of_differences(integrator, viscosity, planar):
    random = np.random.default_rng(18)
    acts = {
        1: [lambda s, d, g: s.set(d.arm, natural_curvature=g["first"], over=5.3e-3)],
        3: [lambda s, d, g: s.set(d.arm, natural_curvature=g["second"], over=4.1e-3)],  # while that is on its way
        6: [lambda s, d, g: s.set(d.arm, natural_curvature=g["third"])],
        7: [lambda s, d, g: s.set(d.arm, natural_stretch=g["stretch"], over=3e-3)],
        8: [lambda s, d, g: s.set(d.arm, natural_curvature=g["fourth"], over=1.0)],
    }
    if not planar:
        acts[2] = [lambda s, d, g: s.set(d.arm, natural_twist=g["twist"], over=3e-3)]
    run = Run(integrator, viscosity, planar=planar, joint=False, acts=acts, given={})
    sim, arm = run.drawn.simulation, run.drawn.arm
    now = sim.get(arm, "natural_curvature")
    unit = now[0] / np.linalg.norm(now[0])
    run.given = {
        "first": 3.0 * unit,
        "second": np.outer(np.linspace(-4.0, 4.0, len(now)), unit),
        "third": 2.0 * unit,
        "stretch": np.linspace(0.999, 1.001, NODES - 1),
        "fourth": -5.0 * unit,
    }
    order = ["first", "second", "third", "stretch", "fourth"]
    if not planar:
        run.given["twist"] = 4.0
        order.insert(1, "twist")
    weights = weights_of(run.drawn, random)
    found = gradient_of(run, weights, [(arm, "natural_curvature")])
    by_calls = [next(iter(call.gradients.values())) for call in found.calls]
    check(run, weights, by_calls, order, size=1e-2)
    # The initial value acts as long as it has a share in the ramp.
    start = sim.snapshot()
    sim.restore(run.start)
    way = np.outer(random.normal(size=len(now)), unit)

    def of(h):
        sim.restore(run.start)
        sim.set(arm, natural_curvature=now + h * way)
        before, run.start = run.start, sim.snapshot()
        record = run()
        run.start = before
        return float(sum((by * getattr(record, word)(*t)).sum() for word, p in weights.items() for t, by in p.items()))

    ends = [(of(h) - of(-h)) / (2.0 * h) for h in (2e-2, 1e-2)]
    assert np.sum(found[0] * way) == pytest.approx((4.0 * ends[1] - ends[0]) / 3.0, rel=2e-6)
    sim.restore(start)


def test_loads_that_are_functions_of_time_leave_runs_their_gradients():
    drawn = Drawn(planar=True, joint=False, integrator="implicit_midpoint", adaptive=False, time_step=STEP)
    sim, arm = drawn.simulation, drawn.arm
    start = sim.snapshot()
    weight = drawn.vectors(np.random.default_rng(19), NODES)

    def run(modulus=1e6, **options):
        sim.restore(start)
        sim.set(arm, youngs_modulus=modulus)
        sim.set(drawn.force, force=lambda t: (0, 0, 20.0 * t))
        return sim.run(DURATION, record_every=DURATION, progress=False, **options)

    (found,) = run(differentiable=True).gradient({"positions": [0.0 * weight, weight]}, [(arm, "youngs_modulus")])

    def of(modulus):
        return float((weight * run(modulus).positions()[-1]).sum())

    wide, near = ((of(1e6 + h) - of(1e6 - h)) / (2.0 * h) for h in (400.0, 200.0))
    assert found == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6)


def test_a_value_that_is_set_again_at_every_step_has_a_gradient_of_each():
    drawn = Drawn(planar=True, joint=False, integrator="backward_euler", time_step=STEP, adaptive=False)
    sim, arm = drawn.simulation, drawn.arm
    curvature = 2.0 * sim.get(arm, "natural_curvature")[0] / np.linalg.norm(sim.get(arm, "natural_curvature")[0])
    weight = np.zeros((2, NODES, 3))
    weight[-1, -1, 2] = 1.0
    start = sim.snapshot()
    record = sim.run(
        DURATION,
        record_every=DURATION,
        progress=False,
        differentiable=True,
        before_step=lambda s: s.set(arm, natural_curvature=curvature),
    )
    found = record.gradient({"positions": weight}, [(arm, "natural_curvature")])
    assert len(found.calls) == round(DURATION / STEP)
    assert np.all(found[0] == 0.0)
    calls_alone = record.gradient({"positions": weight}, [])
    assert list(calls_alone) == []
    for call, same in zip(found.calls, calls_alone.calls, strict=True):
        np.testing.assert_array_equal(call.gradients["natural_curvature"], same.gradients["natural_curvature"])
    sim.restore(start)
    sim.set(arm, natural_curvature=curvature)
    whole = sim.run(DURATION, record_every=DURATION, progress=False, differentiable=True)
    (together,) = whole.gradient({"positions": weight}, [(arm, "natural_curvature")])
    np.testing.assert_allclose(
        sum(call.gradients["natural_curvature"] for call in found.calls), together.sum(axis=0), rtol=1e-9
    )


def test_calls_without_a_gradient_have_none():
    drawn = Drawn(planar=True, joint=False, integrator="backward_euler", time_step=STEP)
    sim = drawn.simulation
    done = []

    def once(simulation):
        if not done:
            done.append(True)
            simulation.set(drawn.force, force=lambda t: (0, 0, t))
            simulation.copy().set(drawn.mass, mass=0.5)

    record = sim.run(DURATION, record_every=DURATION, progress=False, differentiable=True, before_step=once)
    zeros = np.zeros((2, NODES, 3))
    found = record.gradient({"positions": zeros}, ["gravity"])
    assert [(call.target, call.gradients) for call in found.calls] == [("force", {})]
    sim.set(drawn.mass, mass=0.02)
    assert len(record.gradient({"positions": zeros}, ["gravity"]).calls) == 1
    added = sim.run(
        DURATION,
        record_every=DURATION,
        progress=False,
        differentiable=True,
        before_step=lambda s: s.add_force(drawn.arm.end, (0, 0, 0.01)),
    )
    with pytest.raises(ValueError, match="loads were added or removed"):
        added.gradient({"positions": zeros}, ["gravity"])
    assert isinstance(record, withe.Record)


@pytest.mark.parametrize("support", ["frame", "edge"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("integrator", "viscosity"), [*INTEGRATORS, ("energy_momentum", 300.0)])
def test_gradient_by_where_supports_were_moved_is_that_of_differences(integrator, viscosity, planar, support):
    random = np.random.default_rng(21)
    acts = {
        1: [lambda s, d, g: s.move(d.wall, position=g["first"], rotation=turned(g["first turn"]), over=5.3e-3)],
        3: [lambda s, d, g: s.move(d.wall, rotation=turned(g["second turn"]), over=6e-3)],  # while it is on its way
        5: [lambda s, d, g: s.move(d.wall, position=g["second"], over=1.0)],  # while it still turns
        8: [lambda s, d, g: s.move(d.wall, position=g["third"], rotation=turned(g["third turn"]))],  # in a time step
    }
    run = Run(
        integrator, viscosity, planar=planar, joint=not planar, acts=acts, given=AWAY, support=support, spun=not planar
    )
    flat = np.array([1, 0, 1]) if planar else np.ones(3)
    about = np.array([0, 1, 0]) if planar else np.ones(3)
    run.given = {name: value * (about if "turn" in name else flat) for name, value in AWAY.items()}
    weights = weights_of(run.drawn, random)
    nodes, frames = len(run.drawn.simulation.positions()), len(weights["positions"][()])
    weights["velocities"] = {(): 0.01 * np.array([run.drawn.vectors(random, nodes) for _ in range(frames)])}
    found = gradient_of(run, weights, ["gravity"])
    by_calls = [
        (found.calls[0].gradients["position"], "first"),
        (found.calls[0].gradients["rotation"], "first turn"),
        (found.calls[1].gradients["rotation"], "second turn"),
        (found.calls[2].gradients["position"], "second"),
        (found.calls[3].gradients["position"], "third"),
        (found.calls[3].gradients["rotation"], "third turn"),
    ]

    def of(name, change):
        record = run(run.given | {name: change(run.given[name])})
        return float(
            sum((by * getattr(record, word)(*t)).sum() for word, parts in weights.items() for t, by in parts.items())
        )

    for gradient, name in by_calls:
        turns = "turn" in name
        way = random.normal(size=3) * (about if turns else flat)

        def moved(value, h, turns=turns, way=way):
            if not turns:
                return value + h * way
            return (Rotation.from_rotvec(h * way) * Rotation.from_rotvec(value)).as_rotvec()

        size = 1e-4 if turns else 1e-5
        ends = [
            (of(name, lambda v, h=h: moved(v, h)) - of(name, lambda v, h=h: moved(v, -h))) / (2.0 * h)
            for h in (2.0 * size, size)
        ]
        assert gradient @ way == pytest.approx((4.0 * ends[1] - ends[0]) / 3.0, rel=2e-6, abs=1e-8), name


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
@pytest.mark.parametrize("word", ["natural_curvature", "natural_twist", "natural_stretch"])
@pytest.mark.parametrize("over", [5e-3, 12e-3, 50e-3])
def test_gradient_by_a_natural_shape_that_was_on_its_way_as_the_run_began_is_by_where_it_was_then(
    integrator, word, over
):
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=300.0)
    scene = withe.Scene()
    shape = {"natural_curvature": (1.0, 0.5), "natural_twist": 1.0}
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=9, radius=4e-3, material=rubber, **shape)
    scene.clamp(arm.start)
    goal = {"natural_curvature": np.array([3.0, -2.0]), "natural_twist": -4.0, "natural_stretch": 1.05}[word]

    def run(start, twice, **options):
        simulation = scene.build(
            integrator=integrator,
            time_step=STEP,
            planar=False,
            solver=withe.Solver(step_tolerance=1e-12, force_tolerance=1e-12),
        )
        simulation.set(arm, **{word: start})
        getattr(simulation, f"set_{word}")(arm, goal, over=over)
        steps = iter(range(1000))

        def before_step(simulation):  # sets out anew from where it has come
            if next(steps) == 4 and twice:
                getattr(simulation, f"set_{word}")(arm, 0.5 * (1.0 + goal), over=over)

        return simulation.run(DURATION, record_every=2 * STEP, progress=False, before_step=before_step, **options)

    start = scene.build().get(arm, word)
    for twice in (False, True):
        record = run(start, twice, differentiable=True)
        weights = np.random.default_rng(3).normal(size=record.positions().shape)
        (found,) = record.gradient({"positions": weights}, [(arm, word)])
        way = np.random.default_rng(4).uniform(0.5, 1.0, size=np.shape(start))
        h = 1e-4
        ends = [(weights * run(start + sign * h * way, twice).positions()).sum() for sign in (1.0, -1.0)]
        assert (found * way).sum() == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=1e-5, abs=1e-10)
