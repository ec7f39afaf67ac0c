"""Rods as they were drawn, and poses of supports, are found from stills."""

import numpy as np
import pytest

import withe
from withe.real2sim import Tags, fit, rest_shape
from withe.real2sim.parsing import parse_unknowns
from withe.real2sim.stills import Stills

CAMERA = withe.perception.Camera(
    [[1500.0, 0, 640], [0, 1500, 360], [0, 0, 1]],
    rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    translation=(-0.15, -0.05, 0.6),
)
POINTS = [("arm", "points", "linear")]


def line(nodes, turn=0.0, curvature=0.0):
    """Nodes of an arc of 0.3 m that begins along x but for a turn upwards."""
    edge = 0.3 / (nodes - 1)
    angles = turn + curvature * edge * (np.arange(nodes - 1) + 0.5)
    ways = edge * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(ways, axis=0)])


def arm(nodes=31, turn=0.0, curvature=1.5, hold="frame", far=None):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=5e6, density=1000.0)
    rod = scene.add_rod(points=line(nodes, turn, curvature), radius=4e-3, material=rubber, name="arm")
    scene.clamp(rod.start, hold=hold, name="wall")
    if far:
        getattr(scene, far)(rod.end, name="hand")
    return scene.build(integrator="static", planar=True)


def at_rest(**options):
    simulation = arm(**options)
    simulation.equilibrium()
    return simulation.positions("arm")


def stills(simulation, unknowns):
    tags = Tags(np.zeros((1, 4, 3)), [f"arm.node({n})" for n in (7, 15, 22, 29)])
    return Stills(simulation, parse_unknowns(simulation, unknowns), tags.bind(simulation))


@pytest.mark.parametrize("basis", ["constant", "linear", "segment"])
@pytest.mark.parametrize("hold", ["frame", "edge"])
@pytest.mark.parametrize("far", [None, "pin", "clamp"])
def test_a_shape_that_is_found_is_that_of_a_scene_drawn_so(basis, hold, far):
    simulation = arm(hold=hold, far=far)
    (unknown,) = parse_unknowns(simulation, [("arm", "points", basis)])
    coordinates = np.random.default_rng(2).normal(0, 0.05, len(unknown))
    unknown.write(simulation, coordinates)
    simulation.equilibrium()
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=5e6, density=1000.0)
    rod = scene.add_rod(points=unknown.points(coordinates), radius=4e-3, material=rubber, name="arm")
    scene.clamp(rod.start, hold=hold)
    if far:
        getattr(scene, far)(rod.end)
    anew = scene.build(integrator="static", planar=True)
    anew.equilibrium()
    assert simulation.positions("arm") == pytest.approx(anew.positions("arm"), abs=1e-8)


@pytest.mark.parametrize("far", [None, "pin", "clamp"])
def test_derivatives_by_the_drawn_shape_are_those_of_the_residuals(far):
    problem = stills(arm(far=far), [("arm", "points", "segment")])
    coordinates = 0.1 * np.sin(np.arange(30.0))
    _, state = problem.residual(coordinates, 0)
    found = problem.jacobian(coordinates, state, 0)
    for i in (0, 1, 14, 29):
        step = 1e-4 * np.eye(30)[i]
        ahead, behind = (problem.residual(coordinates + way, 0)[0] for way in (step, -step))
        assert found[:, i] == pytest.approx((ahead - behind) / 2e-4, abs=1e-5 * np.abs(found).max())


def test_as_drawn_they_are_the_gradients_that_the_engine_has_by_points():
    simulation = arm()
    problem = stills(simulation, [("arm", "points", "segment")])
    zero = np.zeros(30)
    _, state = problem.residual(zero, 0)
    found = problem.jacobian(zero, state, 0)
    equilibrium = simulation.equilibrium()
    (by_points,) = equilibrium.jacobian("arm.node(29)", [("arm", "points")])
    shape, step = problem.unknowns[0], 1e-6
    for i in (0, 13, 29):
        way = step * np.eye(30)[i]
        moved = (shape.points(way) - shape.points(-way)) / (2 * step)
        assert found[9:, i] == pytest.approx(np.tensordot(by_points, moved, 2), abs=1e-6)


@pytest.mark.parametrize("space", [False, True])
def test_derivatives_by_poses_are_those_of_the_residuals(space):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=5e6, density=1000.0)
    rod = scene.add_rod(points=line(31, 0.3, 2.0), radius=4e-3, material=rubber, name="arm")
    scene.clamp(rod.start, name="wall")
    scene.pin(rod.end, name="hand")
    simulation = scene.build(integrator="static", planar=not space)
    problem = stills(simulation, [("wall", "position"), ("wall", "rotation"), ("hand", "position")])
    coordinates = 0.03 * np.cos(np.arange(len(problem.names)))
    _, state = problem.residual(coordinates, 0)
    found = problem.jacobian(coordinates, state, 0)
    for i, step in enumerate(1e-5 * np.eye(len(coordinates))):  # the rod is nearly taut
        ahead, behind = (problem.residual(coordinates + way, 0)[0] for way in (step, -step))
        assert found[:, i] == pytest.approx((ahead - behind) / 2e-5, abs=1e-5 * np.abs(found).max())


@pytest.mark.case("inverse", "Pose of a clamp from stills", source="the made pose")
def test_the_pose_of_a_clamp_is_found():
    simulation = arm()
    simulation.move("wall", (0.01, 0.0, -0.02), withe.common.drawing.rotation_about(np.array([0.0, 0.1, 0.0])))
    simulation.equilibrium()
    tags = Tags(simulation.positions("arm")[None, [10, 20, 30]], [f"arm.node({n})" for n in (10, 20, 30)])
    found = fit(arm(), tags, [("wall", "position"), ("wall", "rotation")], progress=False)
    at = dict(zip(found.names, found.values[0], strict=True))
    assert at["position of 'wall' along x"] == pytest.approx(0.01, abs=1e-6)
    assert at["position of 'wall' along z"] == pytest.approx(-0.02, abs=1e-6)
    assert at["rotation of 'wall' about y"] == pytest.approx(0.1, abs=1e-6)
    again = arm()
    found.apply(again)
    again.equilibrium()
    assert again.positions("arm") == pytest.approx(simulation.positions("arm"), abs=1e-6)


def test_a_photograph_of_a_sagging_rod_tells_its_shape_and_how_it_was_clamped():
    seen = CAMERA.project(at_rest(nodes=121, turn=0.15, curvature=-2.0))
    found = rest_shape(arm(), "arm", seen, CAMERA, unknown="points")
    assert found.converged.all()
    shape = found.points("arm")
    assert np.linalg.norm(shape - line(31, 0.15, -2.0), axis=1).max() < 1e-3
    simulation = arm()
    found.apply(simulation)
    simulation.equilibrium()
    assert np.linalg.norm(simulation.positions("arm") - at_rest(nodes=121, turn=0.15, curvature=-2.0)[::4]) < 1e-3


@pytest.mark.parametrize("points", [50, pytest.param(400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("known", [True, False])
def test_errors_of_the_shape_have_the_size_that_the_covariance_says(points, known):
    simulation = arm()
    fine = CAMERA.project(at_rest(nodes=121, turn=0.15, curvature=-2.0))
    exact = np.stack([np.interp(np.linspace(0, 120, points), np.arange(121), column) for column in fine.T], axis=1)
    coordinates = rest_shape(simulation, "arm", exact, CAMERA, unknown="points").values[0]
    rng, scaled = np.random.default_rng(5), []
    for _ in range(50):
        seen = exact + rng.normal(0.0, 0.5, exact.shape)
        options = {"unknown": "points", "sigma": 0.5 if known else None}
        found = rest_shape(simulation, "arm", seen, CAMERA, **options)
        scaled.append(np.linalg.solve(np.linalg.cholesky(found.covariance[0]), found.values[0] - coordinates))
    assert 0.85 < np.sqrt(np.mean(np.square(scaled))) < 1.15  # 100 numbers: 0.07 of it is chance


def test_what_has_no_drawn_shape_says_so():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=5e6, density=1000.0)
    a = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=9, radius=4e-3, material=rubber, name="arm")
    wall = scene.pin(a.start, name="wall")
    space = scene.build(integrator="static", planar=False)
    target = Tags([[(0.3, 0, 0)]], ["arm.end"])
    with pytest.raises(ValueError, match="in a planar scene only"):
        fit(space, target, POINTS, progress=False)
    with pytest.raises(ValueError, match="a pin does not hold directions"):
        fit(space, target, [(wall, "rotation")], progress=False)
    with pytest.raises(ValueError, match="points of 'arm' determine its supports"):
        fit(arm(), target, [*POINTS, ("wall", "position")], progress=False)
    b = scene.add_rod(start=(0.3, 0, 0), end=(0.5, 0, 0), nodes=9, radius=4e-3, material=rubber)
    scene.join(a.end, b.start)
    with pytest.raises(ValueError, match="the rod is joined or closed: make natural_curvature unknown"):
        fit(scene.build(integrator="static", planar=True), target, POINTS, progress=False)
    found = fit(arm(), target, [("arm", "natural_curvature")], progress=False)
    with pytest.raises(ValueError, match="points of rod 'arm' was not fitted"):
        found.points("arm")
