"""Gradients of runs through contact, with friction and without, against differences of whole runs."""

import numpy as np
import pytest

import withe
from gradient_scenes import NODES, TIGHT, difference, move_with_directors

CONTACTS = (
    *("floor", "slope in a plane", "sphere", "capsule", "post", "crossing", "floor lying", "floor slowly"),
    *("tube", "field"),
)
FRICTIONS = ("none", "implicit", "lagged", "directed", "scaly", "rolling")
INTEGRATORS = ("backward_euler", "implicit_midpoint", "energy_momentum")


class Touching:
    """A soft arm that meets what is below it within 30 ms, by contact of a given stiffness."""

    def __init__(self, kind, friction="none", integrator="backward_euler", offset=(0.0, 0.0, 0.0)):
        """`offset`: of the obstacle."""
        self.planar = "plane" in kind
        offset = np.array(offset)
        scene = withe.Scene()
        material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0, viscosity=100.0)
        s = np.linspace(0.0, 1.0, NODES)
        low = {"floor lying": 1.05e-2, "floor slowly": 1.41e-2}.get(kind, 1.6e-2)
        # So slowly that an impact is elastic in part: surfaces that meet at the slip tolerance rest.
        self.tolerance = 1e-3 if friction == "none" else 0.1
        slow = -0.02 if friction == "none" else -0.14
        self.velocity = np.array([0.1, 0.0, slow if kind == "floor slowly" else -0.6])
        points = np.stack([0.3 * s, 0.0 * s if self.planar else 0.02 * np.sin(3.0 * s), low + 0.03 * s * (1 - s)], 1)
        self.arm = scene.add_rod(points=points, radius=1e-2, material=material, name="arm")
        scene.add_drag(0.1)
        rubs = {"none": 0.0, "directed": (0.3, 0.5), "scaly": (0.3, 0.4, 0.5)}.get(friction, 0.4)
        self.other = None
        self.rolling = 0.5 if friction == "rolling" else 0.0
        kept = {"friction": rubs, "rolling_friction": self.rolling}
        if kind.startswith("floor"):
            self.other = scene.add_plane(offset, (0, 0, 1), **kept)
        elif kind == "slope in a plane":
            self.other = scene.add_plane(offset, (0.1, 0, 1), **kept)
        elif kind == "sphere":
            self.other = scene.add_sphere(offset + np.array((0.13, 0.01, -0.05)), 0.05, **kept)
        elif kind == "capsule":
            ends = offset + np.array([(0.1, -0.1, -0.03), (0.14, 0.1, -0.02)])
            self.other = scene.add_capsule(*ends, 0.03, **kept)
        elif kind == "post":  # smaller than an edge, so that it touches straight ones
            ends = offset + np.array([(0.1, -0.1, -0.008), (0.14, 0.1, -0.004)])
            self.other = scene.add_capsule(*ends, 8e-3, **kept)
        elif kind == "tube":
            axis = [(-0.1, 0, 0.08), (0.15, 0, 0.085), (0.4, 0, 0.08)]
            self.other = scene.add_obstacle(withe.solids.Tube(axis, radius=0.08), position=offset, **kept)
        elif kind == "field":
            waves = withe.solids.Field(
                lambda p: p[:, 2] - 2e-3 * np.sin(30.0 * p[:, 0]), bounds=[(-0.2, -0.1, -0.05), (0.5, 0.1, 0.1)]
            )
            self.other = scene.add_obstacle(waves, position=offset, **kept)
        else:
            ends = {"start": (0.11, -0.1, -0.008), "end": (0.15, 0.1, -0.004)}
            rod = scene.add_rod(**ends, nodes=7, radius=1e-2, material=material)
            scene.clamp(rod.start)
        law = "lagged" if friction == "lagged" else "implicit"
        scene.enable_contact(
            stiffness=2e5,
            distance_tolerance=4e-3,
            friction=rubs if kind == "crossing" else 0.0,
            slip_tolerance=self.tolerance,
            friction_model=law,
        )
        self.simulation = scene.build(integrator=integrator, time_step=2e-3, adaptive=False, **TIGHT)
        self.simulation.set_velocities(self.arm, self.velocity)
        if not self.planar:
            self.simulation.set_state(self.arm, spins=10.0 * np.sin(np.arange(NODES - 1)))
        self.rubs = rubs

    def ways(self, random, count):
        return random.normal(size=(count, NODES, 3)) * (1, 0 if self.planar else 1, 1)

    def run(self, **options):
        return self.simulation.run(30e-3, record_every=10e-3, progress=False, **options)

    def cases(self, random):
        sim, arm = self.simulation, self.arm
        ways = self.ways(random, 2)
        zero = np.zeros((len(sim.positions()) - NODES, 3))
        yield (arm, "youngs_modulus"), 1.0, lambda h: sim.set(arm, youngs_modulus=1e6 + h), 30.0
        yield (arm, "density"), 1.0, lambda h: sim.set(arm, density=1200.0 + h), 0.03
        yield "gravity", np.array([0, 0, 1.0]), lambda h: sim.set(None, gravity=(0, 0, -9.81 + h)), 4e-4
        moved = np.concatenate([ways[0], zero])
        yield "initial_velocities", moved, lambda h: sim.set_velocities(arm, self.velocity + h * ways[0]), 2e-6
        moved = np.concatenate([ways[1], zero])
        yield "initial_positions", moved, lambda h: move_with_directors(sim, arm, h * ways[1]), 4e-8
        yield "slip_tolerance", self.tolerance, lambda h: sim.set(None, slip_tolerance=self.tolerance * (1.0 + h)), 5e-4
        if self.rubs == 0.0:
            return
        rubs, way = np.asarray(self.rubs), np.array([1.0, 0.7, -0.4])[: np.size(self.rubs)].reshape(np.shape(self.rubs))
        if self.other is None:
            yield "friction", 1.0, lambda h: sim.set(None, friction=rubs + h), 1e-5
        else:
            yield (self.other, "friction"), way, lambda h: sim.set(self.other, friction=rubs + h * way), 1e-5
        if self.rolling > 0.0:
            yield (self.other, "rolling_friction"), 1.0, self._set_rolling, 1e-5

    def _set_rolling(self, h):
        self.simulation.set(self.other, rolling_friction=self.rolling + h)


def check(touching, *, seed=8, rel=1e-5, **kept):
    """Gradients of a weighted sum of positions by everything, against differences of two sizes, extrapolated."""
    random = np.random.default_rng(seed)
    sim = touching.simulation
    weights = random.normal(size=(4, len(sim.positions()), 3)) * (1, 0 if touching.planar else 1, 1)
    cases = list(touching.cases(random))
    start = sim.snapshot()
    record = touching.run(differentiable=True)
    assert len(sim.contacts()) > 0
    gradients = record.gradient({"positions": weights}, [unknown for unknown, *_ in cases])
    sim.restore(start)

    def of():
        return float((weights * touching.run().positions()).sum())

    for gradient, (unknown, along, change, size) in zip(gradients, cases, strict=True):
        wide, near = (difference(sim, of, change, times * size) for times in (2.0, 1.0))
        expected = (4.0 * near - wide) / 3.0
        assert np.sum(gradient * along) == pytest.approx(expected, rel=rel, abs=1e-10), unknown


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("kind", CONTACTS)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_gradient_of_a_run_through_contact_is_that_of_differences(integrator, kind, friction):
    if friction in ("directed", "scaly", "rolling") and kind == "crossing":
        pytest.skip("friction of two rods has no directions, and they roll freely on each other")
    check(Touching(kind, friction, integrator))


def test_contact_that_no_gradient_goes_through_says_what_to_do():
    def refusal(integrator="backward_euler", friction=0.0, restitution=1.0, stiffness=None, law="implicit"):
        scene = withe.Scene()
        material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)
        scene.add_rod(start=(0, 0, 0.011), end=(0.2, 0, 0.012), nodes=5, radius=1e-2, material=material)
        scene.add_floor(0.0, friction=friction, restitution=restitution)
        scene.enable_contact(stiffness=stiffness, friction_model=law)
        simulation = scene.build(integrator=integrator, time_step=1e-3)
        record = simulation.run(0.05, record_every=0.05, progress=False, differentiable=True)
        with pytest.raises(ValueError, match="no gradient of this run is available") as refused:
            record.gradient({"positions": np.full((2, 5, 3), (0.0, 0.0, 1.0))}, ["gravity"])
        return str(refused.value)

    for law in ("anchored", "semi_explicit"):
        assert "use friction_model='implicit' or 'lagged'" in refusal(friction=0.3, stiffness=1e5, law=law)
    assert "use restitution=1" in refusal(restitution=0.5, stiffness=1e5)
    for integrator in INTEGRATORS:
        assert "use enable_contact(stiffness=)" in refusal(integrator=integrator)
        assert "use enable_contact(stiffness=)" in refusal(integrator=integrator, stiffness=5.0)  # repeated stiffer


@pytest.mark.parametrize("friction", ["implicit", "lagged"])
def test_friction_that_was_set_while_a_run_went_has_a_gradient_of_each_call(friction):
    touching = Touching("floor", friction)
    sim, arm, floor = touching.simulation, touching.arm, touching.other
    sim.set((arm, floor), friction=0.35)
    start, random = sim.snapshot(), np.random.default_rng(4)
    weights = random.normal(size=(4, NODES, 3))
    given = {"own": 0.35, "tolerance": 0.08, "pair": 0.45}

    def run(change, **options):
        values, steps = given | change, iter(range(100))
        sim.restore(start)
        sim.set((arm, floor), friction=values["own"])

        def before_step(simulation):
            step = next(steps)
            if step == 6:
                simulation.set(None, slip_tolerance=values["tolerance"])
            elif step == 10:
                simulation.set((floor, arm), friction=values["pair"])

        return touching.run(before_step=before_step, **options)

    record = run({}, differentiable=True)
    wrt = [((arm, floor), "friction"), (floor, "friction"), "slip_tolerance"]
    found = record.gradient({"positions": weights}, wrt)
    assert found[1] == 0.0  # what the pair has of its own acts in its place
    assert [(call.call, call.target) for call in found.calls] == [("set", None), ("set", f"arm, {floor.name}")]
    gradients = {
        "own": found[0],
        "tolerance": found.calls[0].gradients["slip_tolerance"],
        "pair": found.calls[1].gradients["friction"],
    }
    for name, gradient in gradients.items():

        def of(h, name=name):
            return float((weights * run({name: given[name] + h}).positions()).sum())

        wide, near = ((of(h) - of(-h)) / (2.0 * h) for h in (2e-5, 1e-5))
        assert gradient == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-6), name


def test_friction_without_a_gradient_says_what_to_do():
    touching = Touching("floor", "implicit")
    sim, arm, floor = touching.simulation, touching.arm, touching.other
    zeros = np.zeros((4, NODES, 3))
    record = touching.run(differentiable=True)
    for unknown, message in (
        ((floor, "rotation"), "no gradient with respect to 'rotation'"),
        ("friction", "set a small value"),
        (((arm, floor), "friction"), "have no friction of their own"),
        (((arm, floor, arm), "friction"), "wrt must name two bodies by a pair"),
        (((arm, "nobody"), "friction"), "nobody"),
    ):
        with pytest.raises(ValueError, match=message):
            record.gradient({"positions": zeros}, [unknown])
    with pytest.raises(ValueError, match="an equilibrium with friction"):
        sim.equilibrium().gradient(zeros[0], ["gravity"])


@pytest.mark.parametrize("pair", [False, True])
def test_runs_in_which_friction_comes_or_goes_say_so(pair):
    touching = Touching("floor", "implicit")
    steps = iter(range(100))

    def before_step(simulation):
        if next(steps) != 8:
            return
        if pair:
            simulation.set((touching.arm, touching.other), friction=0.2)
        else:
            simulation.set(touching.other, friction=0.0)

    record = touching.run(differentiable=True, before_step=before_step)
    with pytest.raises(ValueError, match="friction, or a coefficient of a pair of bodies, was added or removed"):
        record.gradient({"positions": np.zeros((4, NODES, 3))}, ["gravity"])


def leaning(stiffness, friction=0.0):
    """A clamped arm that lies on a floor with its end, in equilibrium."""
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)
    arm = scene.add_rod(start=(0, 0, 0.03), end=(0.3, 0, 0.03), nodes=NODES, radius=5e-3, material=material)
    scene.clamp(arm.start)
    scene.add_floor(0.0, friction=friction)
    scene.enable_contact(stiffness=stiffness, distance_tolerance=2e-3)
    simulation = scene.build(integrator="static", **TIGHT)
    found = simulation.equilibrium()
    assert len(simulation.contacts()) > 0
    return simulation, arm, found


def test_gradient_of_an_equilibrium_in_contact_of_a_given_stiffness_is_that_of_differences():
    sim, arm, found = leaning(2e4)
    weight = np.random.default_rng(21).normal(size=(NODES, 3)) * (1, 0, 1)
    (by_modulus,) = found.gradient(weight, [(arm, "youngs_modulus")])

    def of():
        sim.equilibrium()
        return float((weight * sim.positions()).sum())

    wide, near = (difference(sim, of, lambda h: sim.set(arm, youngs_modulus=1e6 + h), size) for size in (200.0, 100.0))
    assert by_modulus == pytest.approx((4.0 * near - wide) / 3.0, rel=1e-5)


def test_equilibria_in_contact_without_a_gradient_say_what_to_do():
    _, arm, found = leaning(None)
    with pytest.raises(ValueError, match=r"use enable_contact\(stiffness=\)"):
        found.gradient(np.zeros((NODES, 3)), [(arm, "youngs_modulus")])
    _, arm, found = leaning(2e4, friction=0.3)
    with pytest.raises(ValueError, match="an equilibrium with friction"):
        found.gradient(np.zeros((NODES, 3)), [(arm, "youngs_modulus")])


@pytest.mark.parametrize("integrator", ["verlet", "static"])
def test_runs_of_integrators_without_a_gradient_say_so(integrator):
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=5, radius=5e-3, material=material)
    scene.clamp(arm.start)
    simulation = scene.build(integrator=integrator, time_step=1e-5)
    record = simulation.run(2e-5, record_every=2e-5, progress=False, differentiable=True)
    with pytest.raises(ValueError, match=f"integrator '{integrator}' has no gradients; use another integrator"):
        record.gradient({"positions": np.zeros((2, 5, 3))}, ["gravity"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s, arm, floor: s.set(contact_stiffness=3e5), "the contact stiffness was set"),
        (lambda s, arm, floor: s.set((arm, floor), contact_stiffness=3e5), "the contact stiffness was set"),
        (lambda s, arm, floor: s.set(floor, restitution=0.5), "use restitution=1"),
    ],
)
def test_runs_in_which_contact_becomes_stiffer_or_loses_energy_say_so(change, message):
    touching = Touching("floor", "implicit")
    steps = iter(range(100))

    def before_step(simulation):
        if next(steps) == 8:
            change(simulation, touching.arm, touching.other)

    record = touching.run(differentiable=True, before_step=before_step)
    with pytest.raises(ValueError, match=message):
        record.gradient({"positions": np.zeros((4, NODES, 3))}, ["gravity"])
