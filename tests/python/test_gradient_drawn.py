"""Gradients of equilibria and of runs by nodes as they were drawn, against scenes built anew."""

import numpy as np
import pytest

import withe
from gradient_scenes import TIGHT, extrapolated

NODES = 11
SUPPORTS = ("frame", "edge", "both", "end", "pins", "inner", "inner edge")
RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1200.0)

CASES = [
    *((planar, support, "as_built") for planar in (True, False) for support in (*SUPPORTS, "closed")),
    *((False, support, "straight") for support in SUPPORTS),
]


class Arm:
    """A curved arm of oval sections, held and loaded."""

    def __init__(self, points, *, planar, support, natural="as_built", integrator="static"):
        scene = withe.Scene()
        rubber = withe.Material(
            youngs_modulus=1e6,
            poisson_ratio=0.4,
            density=1200.0,
            viscosity=0.0 if integrator in ("static", "fourth_order") else 300.0,
        )
        self.arm = scene.add_rod(
            points=points,
            closed=support == "closed",
            section=withe.Rectangle(2.4e-2, 2e-2),
            material=rubber,
            natural=natural,
            name="arm",
            normal=(0, 1, 0.1 * (not planar)),
        )
        if support in ("pins", "closed"):
            self.held = [scene.pin(self.arm.node(0)), scene.pin(self.arm.node(7))]
        elif support == "both":
            self.held = [scene.clamp(self.arm.start), scene.clamp(self.arm.end)]
        elif support == "end":
            self.held = [scene.clamp(self.arm.end)]
        elif support.startswith("inner"):
            self.held = [scene.clamp(self.arm.node(4), hold="edge" if support == "inner edge" else "frame")]
        else:
            self.held = [scene.clamp(self.arm.start, hold="edge" if support == "edge" else "frame")]
        scene.add_force(self.arm.node(8), (0.05, 0, 0.3))
        scene.add_mass(self.arm.node(5), 0.02)
        scene.add_drag(0.2)
        options = {} if integrator == "static" else {"time_step": 2e-3, "adaptive": False}
        self.simulation = scene.build(integrator=integrator, planar=planar or None, **options, **TIGHT)
        if integrator not in ("static", "fourth_order"):
            uneven = np.linspace(1.0, 2.0, len(points) - (support != "closed"))
            self.simulation.set(self.arm, viscous_time=3e-4 * uneven)


def drawn(planar, closed=False):
    if closed:
        s = np.linspace(0.0, 2.0 * np.pi, NODES, endpoint=False)
        return np.stack([0.1 * np.cos(s), 0.02 * np.sin(2 * s) * (not planar), 0.08 * np.sin(s)], 1)
    s = np.linspace(0.0, 1.0, NODES)
    return np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)


@pytest.mark.parametrize("word", ["positions", "curvatures", "twists", "tensions", "reaction_moments"])
@pytest.mark.parametrize(("planar", "support", "natural"), CASES)
def test_gradient_by_drawn_nodes_is_that_of_scenes_built_anew(planar, support, natural, word):
    random = np.random.default_rng(30)
    points = drawn(planar, support == "closed")
    way = random.normal(size=(NODES, 3)) * ((1, 0, 1) if planar else (1, 1, 1))
    first = Arm(points, planar=planar, support=support, natural=natural)
    found = first.simulation.equilibrium()

    def shown(arm):
        if word == "reaction_moments":
            return arm.simulation.reaction(arm.held[0]).moment
        return getattr(arm.simulation, word)(arm.arm)

    weight = random.normal(size=shown(first).shape) * (0.01 if word in ("curvatures", "twists") else 1.0)
    if planar and word == "positions":
        weight[:, 1] = 0.0
    target = first.held[0] if word == "reaction_moments" else first.arm
    (gradient,) = found.gradient({word: {target: weight}}, [(first.arm, "points")])

    def of(h):
        other = Arm(points + h * way, planar=planar, support=support, natural=natural)
        other.simulation.equilibrium()
        return float((weight * shown(other)).sum())

    assert np.sum(gradient * way) == pytest.approx(extrapolated(of, 1e-5), rel=1e-6, abs=2e-7)


def test_a_shape_that_is_set_later_does_not_follow_drawn_nodes():
    points, way = drawn(False), np.random.default_rng(31).normal(size=(NODES, 3))

    def arm(h):
        made = Arm(points + h * way, planar=False, support="frame")
        made.simulation.set(made.arm, natural_curvature=(3.0, -2.0))
        return made, made.simulation.equilibrium()

    first, found = arm(0.0)
    weight = np.zeros((NODES, 3))
    weight[-1] = 1.0
    (gradient,) = found.gradient(weight, [(first.arm, "points")])
    expected = extrapolated(lambda h: tip(arm(h)[0]), 1e-5)
    assert np.sum(gradient * way) == pytest.approx(expected, rel=1e-6)


def tip(arm):
    return float(arm.simulation.positions()[-1].sum())


@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "fourth_order", "energy_momentum"])
@pytest.mark.parametrize(
    ("planar", "support", "natural"),
    [
        (True, "frame", "as_built"),
        (True, "edge", "straight"),
        (False, "frame", "as_built"),
        (False, "edge", "as_built"),
        (False, "pins", "straight"),
        (False, "closed", "as_built"),
        (True, "inner edge", "straight"),
        (False, "inner", "as_built"),
    ],
)
def test_gradient_of_a_run_by_drawn_nodes_is_that_of_scenes_built_anew(integrator, planar, support, natural):
    random, points = np.random.default_rng(32), drawn(planar, support == "closed")
    flat = (1, 0, 1) if planar else (1, 1, 1)
    way = random.normal(size=(NODES, 3)) * flat
    bent = 0.0 if planar else 2.0

    def run(h, **options):
        made = Arm(points + h * way, planar=planar, support=support, natural=natural, integrator=integrator)
        steps = iter(range(100))

        def before_step(simulation):
            if next(steps) == 3:
                simulation.set(made.arm, natural_curvature=(bent, 3.0), over=6e-3)

        return made, made.simulation.run(20e-3, record_every=4e-3, progress=False, before_step=before_step, **options)

    first, record = run(0.0, differentiable=True)
    weights = {
        "positions": random.normal(size=(6, NODES, 3)) * flat,
        "velocities": 0.01 * random.normal(size=(6, NODES, 3)) * flat,
        "curvatures": 1e-3 * random.normal(size=record.curvatures(first.arm).shape),
    }
    by = weights | {"curvatures": {first.arm: weights["curvatures"]}}
    (gradient,) = record.gradient(by, [(first.arm, "points")])

    def of(h):
        made, other = run(h)
        shown = {
            "positions": other.positions(),
            "velocities": other.velocities(),
            "curvatures": other.curvatures(made.arm),
        }
        return float(sum((weights[word] * shown[word]).sum() for word in weights))

    assert np.sum(gradient * way) == pytest.approx(extrapolated(of, 1e-5), rel=1e-6)


@pytest.mark.parametrize("friction", ["none", "implicit", "lagged"])
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_gradient_by_drawn_nodes_of_a_rod_that_falls_on_a_floor_is_that_of_scenes_built_anew(
    integrator, planar, friction
):
    random, flat = np.random.default_rng(33), (1, 0, 1) if planar else (1, 1, 1)
    s = np.linspace(0.0, 1.0, NODES)
    points = np.stack([0.3 * s, 0.0 * s if planar else 0.02 * np.sin(3.0 * s), 0.02 * np.sin(4.0 * s) - 0.015], 1)
    way, weight = random.normal(size=(NODES, 3)) * flat, random.normal(size=(3, NODES, 3)) * flat
    rough = 0.0 if friction == "none" else 0.4
    law = {} if friction == "none" else {"friction_model": friction}

    def run(h, **options):
        scene = withe.Scene()
        arm = scene.add_rod(points=points + h * way, radius=1e-2, material=RUBBER, normal=(0, 1, 0))
        scene.add_floor(height=-0.0525, friction=rough)
        scene.enable_contact(friction=rough, stiffness=3e5, distance_tolerance=4e-3, slip_tolerance=0.1, **law)
        simulation = scene.build(integrator=integrator, planar=planar, time_step=1e-3, adaptive=False, **TIGHT)
        simulation.set_velocities(arm, np.tile((0.5, 0.0 if planar else 0.2, -1.0), (NODES, 1)))
        record = simulation.run(30e-3, record_every=15e-3, progress=False, **options)
        return arm, len(simulation.contacts()), record

    arm, contacts, record = run(0.0, differentiable=True)
    assert contacts > 0
    (gradient,) = record.gradient({"positions": weight}, [(arm, "points")])

    def of(h):
        return float((weight * run(h)[2].positions()).sum())

    assert np.sum(gradient * way) == pytest.approx(extrapolated(of, 1e-7), rel=1e-5)


def test_drawn_nodes_that_have_no_gradient_say_so():
    def refusal(change, **rod):
        scene = withe.Scene()
        arm = scene.add_rod(**({"points": drawn(False)} | rod), radius=1e-2, material=RUBBER, name="arm")
        other = scene.add_rod(start=drawn(False)[-1], end=(0.5, 0, 0), nodes=5, radius=1e-2, material=RUBBER)
        wall = scene.clamp(arm.start)
        scene.clamp(other.end)
        simulation = change(scene, arm, other, wall) or scene.build(integrator="implicit_midpoint")
        found = simulation.equilibrium()
        with pytest.raises(ValueError, match="with respect to points") as refused:
            found.gradient(np.zeros_like(simulation.positions()), [(arm, "points")])
        return str(refused.value)

    def moved(scene, arm, other, wall):
        simulation = scene.build(integrator="static")
        simulation.move(wall, position=(0, 0, 1e-3))
        return simulation

    def joined(scene, arm, other, wall):
        found = scene.add_rod(
            points=drawn(False)[-1] + [[0, 0, 0], [0.1, 0, 0.1]], nodes=4, radius=1e-2, material=RUBBER
        )
        scene.join(arm.end, found.start)

    assert "has moved" in refusal(moved)
    assert "draw one point per node" in refusal(lambda *_: None, nodes=21)
    assert "which is joined to the rod" in refusal(joined)
    assert "spin" in refusal(lambda scene, arm, other, wall: scene.clamp(arm.end, spin=True) and None)
    assert "hand" in refusal(lambda scene, arm, other, wall: scene.grasp(arm, 0.1) and None)


def test_runs_by_drawn_nodes_that_have_no_gradient_say_so():
    def refusal(before=lambda made: None, within=lambda made: None):
        made = Arm(drawn(False), planar=False, support="frame", integrator="implicit_midpoint")
        before(made)
        record = made.simulation.run(
            4e-3, record_every=4e-3, progress=False, differentiable=True, before_step=lambda simulation: within(made)
        )
        with pytest.raises(ValueError, match="with respect to points of rod 'arm'") as refused:
            record.gradient({"positions": np.zeros((2, NODES, 3))}, [(made.arm, "points")])
        return str(refused.value)

    assert "began away from the drawn state" in refusal(lambda made: made.simulation.equilibrium())
    assert "has moved" in refusal(within=lambda made: made.simulation.move(made.held[0], position=(0, 0, 1e-3)))
    made = Arm(drawn(False), planar=False, support="frame", integrator="implicit_midpoint")
    with pytest.raises(ValueError, match="step_jacobian is not available with respect to points"):
        made.simulation.step_jacobian([(made.arm, "points")])
