"""Bad input is a ValueError that names the argument, says what was expected and what came; or a ConvergenceError."""

import contextlib
import math
import re

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, tripod

NAN, INF = math.nan, math.inf


def rod(**options):
    scene = withe.Scene()
    defaults = {"start": (0, 0, 0), "end": (1, 0, 0), "nodes": 5, "radius": 0.01, "material": RUBBER, "name": "arm"}
    return scene.add_rod(**(defaults | options))


def from_points(points, **options):
    return rod(start=None, end=None, nodes=None, points=points, **options)


RINGS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
STIFF = {"material": None, "line_density": 1.0}


def stiff(**options):
    return withe.Stiffness(**({"stretch": 1.0, "bend": 1.0, "twist": 1.0} | options))


RODS = [
    (lambda: rod(radius=-0.001), "radius of rod 'arm' must be positive, got -0.001"),
    (lambda: rod(radius=0), "radius of rod 'arm' must be positive, got 0"),
    (lambda: rod(radius=NAN), "radius of rod 'arm' must be finite, got nan"),
    (lambda: rod(radius=INF), "radius of rod 'arm' must be finite, got inf"),
    (lambda: rod(radius="thick"), "radius of rod 'arm' must be a number, got 'thick'"),
    (lambda: rod(radius=True), "radius of rod 'arm' must be a number, got True"),
    (lambda: rod(radius=1j), "radius of rod 'arm' must be a number, got 1j"),
    (lambda: rod(radius=[1, 2]), "radius of rod 'arm' must have shape (4,), got (2,)"),
    (lambda: rod(radius=[1, 2, 0, 3]), "radius of rod 'arm' must be positive, got 0 at edges [2]"),
    (lambda: rod(radius=[1, NAN, 2, 3]), "radius of rod 'arm' must be finite, got nan at [1]"),
    (lambda: rod(radius=1e200), "radius of rod 'arm' must be less than 1e+50 in size, got 1e+200"),
    (lambda: rod(radius=1e-200), "of rod 'arm' must be positive and finite"),
    (lambda: rod(radius=10**400), "radius of rod 'arm' must be finite"),
    (
        lambda: rod(end=(0.1, 0, 0), radius=5),
        "radius of rod 'arm' must be no more than 10 times the length of the rod, 0.1 m, got 5 m: are all lengths in "
        "metres?",
    ),
    (lambda: rod(radius=[0.1, 0.1, 10.1, 0.1]), "radius of rod 'arm' must be no more than 10 times the length of the"),
    (lambda: rod(contact_radius=50), "contact_radius of rod 'arm' must be no more than 10 times the length of the rod"),
    (
        lambda: rod(radius=None, section=withe.Rectangle(width=200, height=40)),
        "half the thickness of rod 'arm' must be no more than 10 times the length of the rod, 1 m, got 20 m",
    ),
    (lambda: rod(radius=None), "rod 'arm' must have either a radius or a section"),
    (lambda: rod(section=withe.Circle(0.1)), "rod 'arm' must have either a radius or a section"),
    (lambda: rod(radius=None, section=3), "section of rod 'arm' must be a withe.Circle, withe.Tube or"),
    (
        lambda: rod(radius=None, section=withe.Tube(outer_radius=1, inner_radius=1)),
        "inner_radius of rod 'arm' must be below its outer_radius 1, got 1",
    ),
    (lambda: rod(radius=None, section=withe.Rectangle(width=1, height=-1)), "height of rod 'arm' must be positive"),
    (lambda: rod(nodes=1), "nodes of rod 'arm' must lie in 2.."),
    (lambda: rod(nodes=2.0), "nodes of rod 'arm' must be a whole number, got 2.0"),
    (lambda: rod(nodes=None), "nodes of rod 'arm' must be given"),
    (lambda: rod(nodes=10**15), "nodes of rod 'arm' must lie in 2.."),
    (lambda: rod(end=(0, 0, 0)), "points of rod 'arm' must differ from each other: edge 0 has length 0"),
    (lambda: rod(end=(1, 0)), "end of rod 'arm' must have shape (3,), got (2,)"),
    (lambda: rod(end=(1, 0, NAN)), "end of rod 'arm' must be finite, got nan at [2]"),
    (lambda: rod(end=("a", 0, 0)), "end of rod 'arm' must be numbers of shape (3,)"),
    (lambda: rod(end=None), "end of rod 'arm' must be numbers of shape (3,), got None"),
    (lambda: rod(end=(0, 1e60, 0)), "end of rod 'arm' must be less than 1e+50 in size, got 1e+60"),
    (lambda: rod(points=RINGS), "rod 'arm' must have either points, or start and end"),
    (lambda: rod(start=None, end=None), "rod 'arm' must have either points, or start and end"),
    (lambda: rod(closed=True), "closed of rod 'arm' must be False for a rod from start to end"),
    (lambda: rod(closed=1), "closed of rod 'arm' must be True or False, got 1"),
    (lambda: from_points([(0, 0, 0)]), "points of rod 'arm' must be 2 or more, got 1"),
    (lambda: from_points(RINGS[:2], closed=True), "points of rod 'arm' must be 3 or more, got 2"),
    (lambda: from_points(np.zeros((4, 2))), "points of rod 'arm' must have shape (n, 3), got (4, 2)"),
    (lambda: from_points(np.zeros((4, 3))), "points of rod 'arm' must differ from each other"),
    (lambda: from_points([(0, 0, 0), (1, 0, 0), (1, 0, 0)]), "edge 1 has length 0"),
    (
        lambda: from_points([(0, 0, 0), (1, 0, 0), (0.5, 0, 0)]),
        "points of rod 'arm' must not fold straight back, but do after edge 0",
    ),
    (lambda: from_points([[0, 0, 0], [1, 0]]), "points of rod 'arm' must be numbers of shape (n, 3)"),
    (lambda: from_points([(0, 0, 0), (1, 0, INF)]), "points of rod 'arm' must be finite, got inf at [1, 2]"),
    (lambda: from_points({"a": 1}), "points of rod 'arm' must be numbers"),
    (lambda: rod(normal=(1, 0, 0)), "normal of rod 'arm' must not lie along edge 0"),
    (lambda: rod(normal=(0, 0, 0)), "normal of rod 'arm' must not be zero"),
    (lambda: rod(normal=np.ones((3, 3))), "normal of rod 'arm' must have shape (3,) or (4, 3), got (3, 3)"),
    (lambda: rod(material=None), "rod 'arm' must have either a material or a stiffness"),
    (lambda: rod(material="rubber"), "material of rod 'arm' must be a withe.Material, got str"),
    (lambda: rod(stiffness=stiff()), "rod 'arm' must have either a material or a stiffness"),
    (lambda: rod(**STIFF, stiffness=3.0), "stiffness of rod 'arm' must be a withe.Stiffness, got float"),
    (lambda: rod(material=None, stiffness=stiff()), "line_density of rod 'arm' must be given with stiffness="),
    (lambda: rod(line_density=1.0), "line_density of rod 'arm' must be given with stiffness="),
    (lambda: rod(**STIFF, stiffness=stiff(stretch=0)), "stretch stiffness of rod 'arm' must be positive, got 0"),
    (lambda: rod(**STIFF, stiffness=stiff(bend=(1, -1))), "bend stiffness of rod 'arm' must be positive, got -1"),
    (
        lambda: rod(**STIFF, stiffness=stiff(bend=(1, 1, 1))),
        "bend stiffness of rod 'arm' must have shape (2,) or (4, 2)",
    ),
    (lambda: rod(**STIFF, stiffness=stiff(viscous_time=-1)), "viscous_time of rod 'arm' must not be negative, got -1"),
    (
        lambda: rod(natural="curly"),
        "natural of rod 'arm' must be 'as_built' or 'straight' or 'in_balance', got 'curly'",
    ),
    (
        lambda: rod(natural_curvature=1.0),
        "natural_curvature of rod 'arm' must have shape (2,) or (3, 2), got a single number",
    ),
    (lambda: rod(natural_curvature=(0, 13)), "natural_curvature of rod 'arm' must turn the rod by less than pi"),
    (lambda: rod(natural_twist=[1, 2]), "natural_twist of rod 'arm' must have shape (3,), got (2,)"),
    (lambda: rod(natural_twist=NAN), "natural_twist of rod 'arm' must be finite, got nan"),
    (lambda: rod(name=""), "name of the rod must be printable text, got ''"),
    (lambda: rod(name=3), "name of the rod must be printable text, got 3"),
    (lambda: rod(name="arm.end"), "name of the rod must not look like the name of a node or edge"),
]


@pytest.mark.parametrize(("act", "message"), RODS)
def test_rods(act, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        act()


def test_a_stub_may_be_thicker_than_long_and_a_band_wider():
    rod(radius=9.9)
    rod(radius=None, section=withe.Rectangle(width=200, height=0.1))


MATERIALS = [
    ({"youngs_modulus": 0}, "youngs_modulus of the material must be positive, got 0"),
    ({"youngs_modulus": NAN}, "youngs_modulus of the material must be finite, got nan"),
    ({"density": -1}, "density of the material must be positive, got -1"),
    ({"viscosity": -1}, "viscosity of the material must not be negative, got -1"),
    ({"poisson_ratio": 0.51}, "poisson_ratio of the material must lie in (-1, 0.5], got 0.51"),
    ({"poisson_ratio": -1}, "poisson_ratio of the material must lie in (-1, 0.5], got -1"),
    ({"poisson_ratio": None}, "poisson_ratio of the material must be a number, got None"),
]


@pytest.mark.parametrize(("values", "message"), MATERIALS)
def test_materials(values, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        withe.Material(**({"youngs_modulus": 1e6, "density": 1000.0} | values))


def scene_with_two_rods():
    scene = withe.Scene()
    a = scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=5, radius=0.01, material=RUBBER, name="arm")
    b = scene.add_rod(start=(1, 0, 0), end=(1, 1, 0), nodes=5, radius=0.01, material=RUBBER, name="hand")
    return scene, a, b


SCENES = [
    (lambda s, a, b: s.join(a.start, b.start), "nodes 'arm.start' and 'hand.start' must coincide to be joined"),
    (lambda s, a, b: s.join(a.end, a.end), "nodes to join must be two, got 'arm.end' twice"),
    (
        lambda s, a, b: s.join(a.end, b.start, kind="glued"),
        "kind of the joint must be 'rigid' or 'pinned' or 'revolute'",
    ),
    (lambda s, a, b: s.join(a.end, b.start, kind="revolute"), "axis of the joint must be given for kind='revolute'"),
    (lambda s, a, b: s.join(a.end, b.start, axis=(0, 0, 1)), "axis of the joint must be given for kind='revolute'"),
    (lambda s, a, b: s.join(a.end, b.start, kind="revolute", axis=(0, 0, 0)), "axis of the joint must not be zero"),
    (lambda s, a, b: s.join(a.end, b.start, kind="pinned", form="pairs"), "form of the joint must be 'frame' when"),
    (
        lambda s, a, b: s.join(a, b),
        "first node to join must be a node of a rod, such as arm.end or arm.node(3), or a body, got 'arm'",
    ),
    (lambda s, a, b: s.join("arm.edge(1)", b.start), "first node to join must be a node of a rod"),
    (lambda s, a, b: a.node(5), "node of rod 'arm' must lie in -5..4, got 5"),
    (lambda s, a, b: a.node(1.5), "node of rod 'arm' must be a whole number, got 1.5"),
    (lambda s, a, b: a.edge(-5), "edge of rod 'arm' must lie in -4..3, got -5"),
    (lambda s, a, b: s.clamp("arm.node(99)"), "node of rod 'arm' must lie in -5..4, got 99"),
    (lambda s, a, b: s.clamp("tentacle.end"), "node to clamp 'tentacle.end' is not in the scene: it has no rod"),
    (lambda s, a, b: s.clamp(None), "node to clamp must be a handle or a name, got NoneType"),
    (lambda s, a, b: s.clamp(a.start, hold="tight"), "hold of the clamp must be 'frame' or 'edge', got 'tight'"),
    (lambda s, a, b: s.clamp(a.start, free=(0, 0)), "free of the clamp must have shape (3,) or (1, 3) or (2, 3)"),
    (lambda s, a, b: s.pin(a.start, free=(0, 0, 0)), "free of the pin must not be zero"),
    (
        lambda s, a, b: s.pin(a.start, free=[(0, 0, 1), (0, 0, 2)]),
        "free of the pin must be directions that are not parallel",
    ),
    (lambda s, a, b: s.add_force(a.end, (0, 1)), "force 'force 1' must have shape (3,), got (2,)"),
    (
        lambda s, a, b: s.add_force(a.end, lambda t: NAN),
        "force 'force 1' at t = 0 must have shape (3,), got a single number",
    ),
    (lambda s, a, b: s.add_force(a.end, (0, 0, 1), follower="yes"), "follower must be True or False, got 'yes'"),
    (lambda s, a, b: s.add_force(a, (0, 0, 1)), "node of the force must be a node of a rod"),
    (lambda s, a, b: s.add_load(a.end, (0, 0, 1)), "rod of the load must not be a node or an edge, got 'arm.end'"),
    (lambda s, a, b: s.add_mass(a.end, -1), "mass at 'arm.end' must not be negative, got -1"),
    (lambda s, a, b: s.add_drag(NAN), "drag coefficient must be finite, got nan"),
    (lambda s, a, b: s.add_drag(1, rods=a), "rods of the drag must be a list of rods"),
    (lambda s, a, b: s.add_drag(1, rods=[a.end]), "rod of the drag must not be a node or an edge"),
    (lambda s, a, b: s.add_custom_force(3), "custom force must be a function, got 3"),
    (
        lambda s, a, b: s.add_mass(a.end, 1, name="hand"),
        "name of the mass must be new: 'hand' is already the name of a rod",
    ),
    (lambda s, a, b: s["leg"], "name must be a node of a rod"),
    (lambda s, a, b: setattr(s, "gravity", (0, 0)), "gravity must have shape (3,), got (2,)"),
    (lambda s, a, b: s.build(integrator="euler"), "integrator must be 'implicit_midpoint' or"),
    (lambda s, a, b: s.build(time_step=0), "time_step must be positive, got 0"),
    (lambda s, a, b: s.build(time_step=INF), "time_step must be finite, got inf"),
    (lambda s, a, b: s.build(tolerance=-1), "tolerance must be positive, got -1"),
    (lambda s, a, b: s.build(duration=1), "duration needs a tolerance"),
    (lambda s, a, b: s.build(integrator="static", tolerance=1), "tolerance must be None with integrator='static'"),
    (lambda s, a, b: s.build(adaptive=0), "adaptive must be True or False, got 0"),
    (lambda s, a, b: s.build(planar="yes"), "planar must be True or False, got 'yes'"),
    (lambda s, a, b: s.build(solver=withe.Solver(max_iterations=0)), "max_iterations must lie in 1..10000, got 0"),
    (
        lambda s, a, b: s.build(solver=withe.Solver(linear_solver="umfpack")),
        "linear_solver must be 'automatic' or 'band' or 'sparse'",
    ),
    (lambda s, a, b: s.build(planar=True), "planar=True, but"),
    (lambda s, a, b: s.build(integrator="verlet", time_step=1.0), "time_step must not exceed the stable step"),
    (lambda s, a, b: withe.Scene().build(), "the scene must have at least one rod"),
]


@pytest.mark.parametrize(("act", "message"), SCENES)
def test_scenes(act, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        act(*scene_with_two_rods())


SIMULATIONS = [
    (lambda s, a: s.step(-1), "number of steps must lie in 0.."),
    (lambda s, a: s.step(1.0), "number of steps must be a whole number, got 1.0"),
    (lambda s, a: s.run(0), "duration must be positive, got 0"),
    (lambda s, a: s.run(NAN), "duration must be finite, got nan"),
    (lambda s, a: s.run(1, record_every=-1), "record_every must be positive, got -1"),
    (lambda s, a: s.run(1e9, record_every=1e-3), "record_every must fit the duration, 1e+09 s, got 0.001"),
    (lambda s, a: s.run(0.1, progress="often"), "progress must be True or False, got"),
    (lambda s, a: s.run(0.1, until=3), "until must be a function, got 3"),
    (lambda s, a: s.run(0.1, before_step="x"), "before_step must be a function, got 'x'"),
    (lambda s, a: s.run(0.1, record=[len]), "record must be a mapping of names to functions, got list"),
    (lambda s, a: s.run(0.1, record={"x": 3}), "record['x'] must be a function, got 3"),
    (lambda s, a: s.run(0.1, record={"x": str}), "record['x'] must return numbers"),
    (lambda s, a: s.positions("leg"), "rod 'leg' is not in the scene, which has 'arm', 'wall'"),
    (lambda s, a: s.positions(a.end), "rod must not be a node or an edge, got 'arm.end'"),
    (lambda s, a: s.curvatures("wall"), "rod must be a rod, got the support 'wall'"),
    (lambda s, a: s.reaction(a.end), "node 'arm.end' is not held: clamp or pin the node first"),
    (lambda s, a: s.reaction("arm"), "support must be a support, got the rod 'arm'"),
    (lambda s, a: s.release(a.end), "node 'arm.end' is not held"),
    (lambda s, a: s.clamp(a.start), "node 'arm.start' is already held by 'wall'"),
    (lambda s, a: s.set(a, natural_curvature=3.0), "natural_curvature of rod 'arm' must have shape (2,) or (9, 2)"),
    (lambda s, a: s.set(a, natural_curvature=(0, 200)), "must turn the rod by less than pi at every node"),
    (lambda s, a: s.set(a, natural_curvature=(0, 1), over=-1), "over must not be negative, got -1"),
    (lambda s, a: s.set(a, natural_twist=(1, 2)), "natural_twist of rod 'arm' must have shape (9,), got (2,)"),
    (lambda s, a: s.set_velocities(a, np.zeros((3, 3))), "velocities of rod 'arm' must have shape (11, 3) or (3,)"),
    (lambda s, a: s.set_velocities(a, (0, 0, NAN)), "velocities of rod 'arm' must be finite"),
    (lambda s, a: s.set(a), "set needs at least one parameter"),
    (lambda s, a: s.set(a, colour=3), "rod 'arm' has no 'colour' to set; it has youngs_modulus"),
    (lambda s, a: s.set(a, youngs_modulis=1), "discrete_curvature. Did you mean 'youngs_modulus'?"),
    (lambda s, a: s.set(a, youngs_modulus=-1), "youngs_modulus of rod 'arm' must be positive, got -1"),
    (lambda s, a: s.set(a, poisson_ratio=2), "poisson_ratio of rod 'arm' must lie in (-1, 0.5], got 2"),
    (lambda s, a: s.set(a, bend_stiffness=[1, 2, 3]), "bend_stiffness of rod 'arm' must have shape (2,) or (10, 2)"),
    (lambda s, a: s.set("wall", force=(0, 0, 1)), "support 'wall' has no 'force' to set; it has position, rotation"),
    (lambda s, a: s.set(wind=1), "the scene has no 'wind' to set; it has gravity"),
    (lambda s, a: s.set(a.end, force=(0, 0, 1)), "target must not be a node or an edge"),
    (lambda s, a: s.get(a, "colour"), "'arm' has no 'colour'; it has youngs_modulus"),
    (lambda s, a: s.get(a, "natural_curvatur"), "radius. Did you mean 'natural_curvature'?"),
    (lambda s, a: s.get("wall", "force"), "'wall' has no 'force'; it has position, rotation"),
    (
        lambda s, a: s.set_velocities(a, np.ma.masked_less(np.ones((11, 3)) - np.eye(11, 3), 0.5)),
        "velocities of rod 'arm' must have a value everywhere, got a masked array with masked entries",
    ),
    (lambda s, a: s.set(gravity=(0, np.ma.array([1.0], mask=True), 0)), "gravity must have a value everywhere"),
    (lambda s, a: s.run(5e-324), "duration must be long enough for the time_step, 0.005 s, got 4.94066e-324 s"),
    (lambda s, a: s.get(a), "get needs a parameter"),
    (lambda s, a: s.move(a.end, (0, 0, 0)), "node 'arm.end' is not held"),
    (lambda s, a: s.move(a.start, (0, 0)), "position of support 'wall' must have shape (3,), got (2,)"),
    (lambda s, a: s.move(a.start, rotation=np.ones((3, 3))), "rotation of support 'wall' must be a rotation"),
    (
        lambda s, a: s.move(a.start, rotation=-np.eye(3)),
        "rotation of support 'wall' must be a rotation, got a reflection",
    ),
    (lambda s, a: s.move(a.start, rotation=np.eye(3), roll=1), "must not be given together with tangent or roll"),
    (lambda s, a: s.move(a.start, tangent=(0, 0, 0)), "tangent of support 'wall' must not be zero"),
    (lambda s, a: s.move(a.start, over=NAN), "over must be finite, got nan"),
    (lambda s, a: s.move(a.start, (0, 0, 0), path=len), "path of support 'wall' must not be combined with position"),
    (
        lambda s, a: s.move(a.start, path=lambda t: "up"),
        "path of support 'wall' at t = 0 must be numbers of shape (3,)",
    ),
    (lambda s, a: s.restore("s"), "snapshot must be a withe.Snapshot or a withe.Record, got str"),
    (lambda s, a: withe.run_many([s, s], 1.0), "simulations must be different objects, got one twice"),
    (lambda s, a: withe.run_many([s, 3], 1.0), "simulations must be withe.Simulation, got int at [1]"),
    (lambda s, a: withe.run_many(3, 1.0), "simulations must be a list, got int"),
    (lambda s, a: withe.run_many([s], 1.0, workers=0), "workers must lie in 1..4096, got 0"),
    (lambda s, a: withe.run_many([s], 1.0, errors="ignore"), "errors must be 'raise' or 'return', got 'ignore'"),
]


@pytest.mark.parametrize(("act", "message"), SIMULATIONS)
def test_simulations(act, message):
    _, arm, simulation = cantilever()
    before = simulation.snapshot()
    with pytest.raises(ValueError, match=re.escape(message)):
        act(simulation, arm)
    if "run_many" not in message and "must return numbers" not in message:
        assert simulation.snapshot() == before


def test_a_closed_rod_has_no_ends():
    ring = from_points(RINGS, closed=True)
    with pytest.raises(ValueError, match=r"rod 'arm' is closed and has no end: use one of its nodes"):
        _ = ring.end


@pytest.mark.parametrize("time_step", [1e-20, 5e-324])
def test_steps_that_no_duration_is_made_of_are_refused(time_step):
    _, _, simulation = cantilever(time_step=time_step)
    with pytest.raises(ValueError, match=r"time_step must fit the duration, 0.01 s, got"):
        simulation.run(0.01)


def test_stiffness_given_directly_has_no_material_to_set():
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=3, radius=0.1, stiffness=stiff(), line_density=1.0, name="arm")
    with pytest.raises(ValueError, match="stiffness of the rod was given directly, without a material"):
        scene.build().set("arm", youngs_modulus=1.0)


def lying_free(gravity=0.0):
    """A rod that nothing holds: its scene and its handle."""
    scene = withe.Scene(gravity=(0, 0, -gravity))
    return scene, scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0.1), nodes=5, radius=5e-3, material=RUBBER)


def test_a_rod_that_nothing_holds_or_loads_is_in_equilibrium_where_it_lies():
    simulation = lying_free()[0].build(integrator="static")
    before = simulation.positions()
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.positions(), before, atol=1e-12)


@pytest.mark.parametrize("load", ["gravity", "moment", "one pin"])
def test_a_static_problem_without_an_answer_is_a_convergence_error(load):
    scene, arm = lying_free(9.81 if load == "gravity" else 0.0)
    if load == "moment":
        scene.add_moment(arm.end, (0, 0, 1e-3))
    if load == "one pin":
        scene.pin(arm.start)
        scene.add_moment(arm.end, (0, 1e-3, 0))
    simulation = scene.build(integrator="static")
    before = simulation.snapshot()
    with pytest.raises(withe.ConvergenceError):
        simulation.equilibrium()
    assert simulation.snapshot() == before


@pytest.mark.filterwarnings("ignore::withe.CoarseMeshWarning")
@pytest.mark.parametrize("force", [1e3, 1e9, 1e49])
@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler", "static"])
def test_absurd_forces_end_in_a_result_or_a_convergence_error(force, integrator):
    _, _rods, simulation = tripod(integrator=integrator)
    simulation.set("pull", force=(force, -force, force))
    with contextlib.suppress(withe.ConvergenceError):
        simulation.step(3)
    assert np.isfinite(simulation.positions()).all()
    assert np.isfinite(simulation.velocities()).all()


def test_an_explicit_blow_up_is_found_by_its_energy():
    _, arm, simulation = cantilever(integrator="verlet", time_step=1e-5)
    limit = simulation.plan.stable_step
    _, arm, simulation = cantilever(integrator="verlet", time_step=0.99 * limit)
    simulation.step()
    simulation.set(arm, youngs_modulus=4e6)  # twice as fast: now the step is too long
    with pytest.raises(withe.ConvergenceError, match=r"gains energy|broke down"):
        simulation.step(100_000)
    assert np.isfinite(simulation.positions()).all()


def test_an_explicit_run_that_would_blow_up_is_refused_before_its_first_step():
    _, arm, simulation = cantilever(integrator="verlet", time_step=1e-5)
    limit = simulation.plan.stable_step
    _, arm, simulation = cantilever(integrator="verlet", time_step=0.99 * limit)
    simulation.set(arm, youngs_modulus=4e6)
    with pytest.raises(withe.ConvergenceError, match=r"not stable here: take a time_step below") as caught:
        simulation.step()
    assert float(str(caught.value).split("below ")[1].split(" s")[0]) == pytest.approx(0.5 * limit, rel=0.01)


def test_fourth_order_refuses_what_cannot_go_back_in_time_and_nothing_changes():
    scene, arm, _ = cantilever()
    scene.build(integrator="fourth_order")
    simulation = scene.build(integrator="fourth_order", time_step=1e-3)
    with pytest.raises(ValueError, match=r"'fourth_order'.*viscosity.*'implicit_midpoint'"):
        simulation.set(arm, viscosity=10.0)
    with pytest.raises(ValueError, match=r"'fourth_order'.*drag"):
        simulation.set(arm, drag=1e6)
    assert simulation.get(arm, "viscosity") == 0.0
    simulation.step(3)
    scene.add_drag(1e6)
    with pytest.raises(ValueError, match=r"'fourth_order'.*time_step"):
        scene.build(integrator="fourth_order")
