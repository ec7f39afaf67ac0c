"""Rods are fitted to lines of points, in metres and in pictures."""

import numpy as np
import pytest

import withe
from withe.real2sim import Centrelines, fit, rest_shape

CAMERA = withe.perception.Camera(
    [[1500.0, 0, 640], [0, 1500, 360], [0, 0, 1]],
    rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    translation=(-0.15, -0.05, 0.6),
)
SHARE = np.arange(1, 30) / 30


def arm(nodes=31, modulus=5e6):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=modulus, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=nodes, radius=4e-3, material=rubber, name="arm")
    scene.clamp(rod.start)
    return scene.build(integrator="static")


def sagging(start, end, nodes=31):
    """An arm whose natural curvature goes from one to another, at rest."""
    simulation = arm(nodes)
    share = np.arange(1, nodes - 1) / (nodes - 1)
    simulation.set("arm", natural_curvature=np.stack([0 * share, start + (end - start) * share], axis=1))
    simulation.equilibrium()
    return simulation.positions("arm")


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("camera", [None, CAMERA])
def test_the_rest_shape_of_a_sagging_rod_is_found(camera, reverse):
    points = sagging(2.0, 9.0)
    seen = (points if camera is None else camera.project(points))[:: -1 if reverse else 1]
    found = rest_shape(arm(), "arm", seen, camera)
    assert found.converged.all()
    assert found.values[0] == pytest.approx([2.0, 9.0], abs=0.02)


def test_a_photograph_is_traced_and_the_rest_shape_told():
    cv2 = pytest.importorskip("cv2")
    line = CAMERA.project(sagging(1.0, 6.0, nodes=121))
    picture = np.full((720, 1280, 3), 255, np.uint8)
    cv2.polylines(picture, [np.round(line * 16).astype(np.int32)], False, (30, 30, 160), 20, cv2.LINE_AA, 4)
    (traced,) = withe.perception.trace_mask(picture[..., 0] < 128).centrelines
    simulation = arm()
    found = rest_shape(simulation, "arm", traced, CAMERA)
    found.apply(simulation)
    assert simulation.get("arm", "natural_curvature")[:, 1] == pytest.approx(1.0 + 5.0 * SHARE, abs=0.6)


def curl(random):
    """A soft strand that hangs in a helix of drawn radius and turns, from a straight start; its scene and nodes."""
    arc, turns, radius = np.linspace(0.0, 0.2, 41), random.uniform(1.0, 2.5), random.uniform(0.006, 0.012)
    angle, grown = 2.0 * np.pi * turns * arc / 0.2, radius / (1.0 + np.exp(-(arc - 0.06) / 0.02))
    points = np.stack([grown * np.cos(angle), grown * np.sin(angle), -0.95 * arc], axis=1)
    scene = withe.Scene()
    hair = withe.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1300.0)
    rod = scene.add_rod(points=points, radius=3e-4, material=hair, name="hair")
    scene.clamp(rod.start)
    return scene.build(integrator="static"), points


@pytest.mark.parametrize("noise", [0.0, 5e-5])
def test_the_rest_shape_of_a_curl_has_as_many_functions_as_the_centreline_tells(noise):
    random = np.random.default_rng(15)
    for _ in range(3):
        simulation, points = curl(random)
        seen = points + random.normal(0.0, noise, points.shape)
        found = rest_shape(simulation, "hair", seen, sigma=noise or None)
        assert found.reasons == {}
        found.apply(simulation)
        simulation.equilibrium()
        off = np.linalg.norm(simulation.positions("hair") - points, axis=1).max()
        assert off < 1e-3
        few = rest_shape(simulation, "hair", points, basis="constant")
        assert "basis does not follow the centreline" in few.reasons[0]


def test_natural_twist_is_found_beside_natural_curvature():
    simulation, _ = curl(np.random.default_rng(16))
    start = simulation.get("hair", "natural_twist").copy()
    simulation.set("hair", natural_twist=start + 3.0)
    simulation.equilibrium()
    target = withe.real2sim.Tags(simulation.positions("hair")[None], [f"hair.node({i})" for i in range(41)])
    simulation.set("hair", natural_twist=start)
    found = fit(simulation, target, [("hair", "natural_twist", "segment")], progress=False)
    assert found.value("hair", "natural_twist")[0, 5:30] == pytest.approx(start[5:30] + 3.0, abs=0.01)
    with pytest.raises(ValueError, match="natural_twist of rod 'arm' cannot be unknown in a plane"):
        fit(arm(), Centrelines([[(0, 0, 0), (0.3, 0, 0)]], "arm"), [("arm", "natural_twist")], progress=False)


def test_derivatives_are_those_of_the_residuals():
    simulation = arm()
    simulation.equilibrium()
    positions = simulation.positions()
    rng = np.random.default_rng(4)
    changes = rng.normal(0, 1, (*positions.shape, 3))
    for camera, points in ((None, sagging(3.0, 5.0)), (CAMERA, CAMERA.project(sagging(3.0, 5.0)))):
        residual = Centrelines([points], "arm", camera, samples=23).bind(simulation)
        found = np.tensordot(residual.derivative(positions, 0), changes, axes=2)
        step = 1e-7
        for i in range(3):
            ahead = residual.value(positions + step * changes[:, :, i], 0)
            behind = residual.value(positions - step * changes[:, :, i], 0)
            scale = np.abs(found).max()
            told = np.isfinite(ahead)
            assert told.sum() == (69 if camera is None else 25)  # a distance each in pixels, and both ends
            assert found[told, i] == pytest.approx((ahead - behind)[told] / (2 * step), abs=1e-5 * scale)


def test_frames_without_points_are_skipped():
    found = fit(
        arm(),
        Centrelines([sagging(1.0, 1.0), [], sagging(4.0, 4.0)], "arm"),
        [("arm", "natural_curvature", "constant")],
        progress=False,
    )
    assert found.skipped == (1,)
    assert found.values[[0, 2], 0] == pytest.approx([1.0, 4.0], abs=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Centrelines([[(0, 0)]], "arm"), r"points of frame 0 must have shape \(n, 3\)"),
        (lambda: Centrelines([[(0, 0, 0), (0, 0, np.nan)]], "arm"), "points of frame 0 must be finite"),
        (lambda: Centrelines([[(0, 0, 0), (0, 0, 0)]], "arm"), "must differ from each other"),
        (lambda: Centrelines([[(0, 0, 0), (0, 0, 1)]], "arm", samples=1), "samples must lie in"),
        (lambda: Centrelines([[(0, 0, 0), (0, 0, 1)]], "leg").bind(arm()), "'leg' is not in the scene"),
        (lambda: Centrelines([[(0, 0, 0), (0, 0, 1)]], ["arm", "arm"]).bind(arm()), "end to end as one line"),
    ],
)
def test_bad_centrelines_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
