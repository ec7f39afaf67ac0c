"""The camera is found with the robot's shapes, and what the frames cannot tell is said."""

import numpy as np
import pytest

import withe
from cases import measured
from soft_limb import CONSTANT, LIMB, log, robot
from withe.real2sim import Tags, calibrate, fit
from withe.real2sim.parsing import parse_unknowns


def made(places, turns, camera, noise=0.0, tilt=0.0):
    """Pixels of tags for whole turns of both limbs."""
    simulation, _ = robot()
    simulation.set(gravity=9.8 * np.array([np.sin(tilt), 0.0, -np.cos(tilt)]))
    still = Tags(np.zeros((1, len(places), 3)), places).bind(simulation)
    frames = []
    for turn in turns:
        for rod, part in zip(("upper", "lower"), turn, strict=True):
            simulation.set(rod, natural_curvature=(0.0, part / LIMB))
        simulation.equilibrium()
        frames.append(camera.project(still.value(simulation.positions(), 0).reshape(-1, 3)))
    return np.array(frames) + np.random.default_rng(5).normal(0, noise, (len(turns), len(places), 2))


def level(roll=0.0, scale=3600.0):
    """A camera a metre away that looks along y."""
    cosine, sine = np.cos(roll), np.sin(roll)
    right, down = np.array([cosine, 0, sine]), np.array([sine, 0, -cosine])
    return withe.perception.Camera(
        np.diag([scale, scale, 1.0]), rotation=[right, down, np.cross(right, down)], translation=(0.01, 0.02, 1.0)
    )


TURNS = np.stack([np.linspace(-1.0, 0.8, 12), np.cos(np.arange(12.0))], axis=1)


@pytest.mark.case("inverse", "Camera and places of tags", source="the made camera")
def test_a_made_camera_and_the_places_of_tags_are_found_again():
    simulation, places = robot()
    shifts = [0, 2e-3, -1e-3, 1e-3, -2e-3, 3e-3, 1e-3, 0, 0]
    shifted = [(rod, arc + shift) for (rod, arc), shift in zip(places, shifts, strict=True)]
    camera = level(roll=0.2)
    pixels = made(shifted, TURNS, camera)
    found = calibrate(simulation, Tags(pixels, places), progress=False)
    assert found.rms < 1e-3
    assert found.roll == pytest.approx(0.2, abs=1e-5)
    measured(found.scale / 3600.0 - 1.0)
    assert found.scale == pytest.approx(3600.0, rel=1e-5)
    assert [arc for _, arc in found.places] == pytest.approx([arc for _, arc in shifted], abs=1e-6)
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (5, 3)) * (1, 0, 1)
    assert found.project(points) == pytest.approx(camera.project(points), abs=1e-2)
    curvatures = fit(simulation, Tags(pixels, found.places, found), CONSTANT, progress=False)
    assert curvatures.values * LIMB == pytest.approx(TURNS, abs=1e-4)


@pytest.mark.slow
def test_sigmas_of_a_fit_take_the_camera_for_exact_as_their_documentation_says():
    scene = withe.Scene()
    silicone = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1100.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=21, radius=5e-3, material=silicone, name="arm")
    scene.clamp(arm.start)
    still = scene.build(integrator="static", planar=True)
    places, curvatures, seen = [arm.node(i) for i in range(0, 21, 4)], np.linspace(-6.0, 9.0, 6), []
    for curvature in curvatures:
        still.set(arm, natural_curvature=(0.0, curvature))
        still.equilibrium()
        seen.append(np.array([300.0, 200.0]) + 1500.0 * still.positions(arm)[::4, [0, 2]] * (1.0, -1.0))
    still.set(arm, natural_curvature=(0.0, 0.0))
    exact = calibrate(still, Tags(seen, places), progress=False)
    errors = {"exact": [], "calibrated": []}
    for seed in range(8):
        noisy = seen + np.random.default_rng(seed).normal(0.0, 0.3, np.shape(seen))
        calibrated = calibrate(still, Tags(noisy, places), progress=False)
        for name, camera in (("exact", exact), ("calibrated", calibrated)):
            tags = Tags(noisy, camera.places, camera, sigma=0.3)
            found = fit(still, tags, [(arm, "natural_curvature", "constant")], progress=False)
            errors[name].append((found.values[:, 0] - curvatures) / np.sqrt(found.covariance[:, 0, 0]))
    factor = {name: np.sqrt(np.mean(np.square(each))) for name, each in errors.items()}
    assert factor["exact"] == pytest.approx(1.0, abs=0.25)
    assert factor["calibrated"] == pytest.approx(2.2, abs=0.6)


def test_a_robot_seen_from_behind_is_not_mirrored():
    simulation, places = robot()
    pixels = made(places, TURNS, level(roll=0.1)) * (-1.0, 1.0)
    found = calibrate(simulation, Tags(pixels, places), free=("roll", "scale"), progress=False)
    assert found.rms < 1e-3
    assert found.roll == pytest.approx(-0.1, abs=1e-5)


def hanging(end, curvatures, side=1):
    """An arm in the plane of x and z, and pixels of tags for natural curvatures of it, seen from one of both sides."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1100.0)
    rod = scene.add_rod(start=(0, 0, 0), end=end, nodes=26, radius=5e-3, material=rubber, name="arm", normal=(0, 1, 0))
    scene.clamp(rod.start)
    simulation = scene.build(integrator="static", planar=True)
    (along,) = parse_unknowns(simulation, [("arm", "natural_curvature", "constant")])
    moved, places = simulation.copy(), [5, 10, 15, 20, 25]
    pixels = []
    for curvature in curvatures:
        along.write(moved, np.array([curvature]))
        moved.equilibrium()
        points = moved.positions("arm")[places]
        pixels.append((900, 300) + 2000 * points[:, [0, 2]] * (side, -1))
    noise = np.random.default_rng(0).normal(0, 0.3, (len(curvatures), 5, 2))
    return simulation, Tags(pixels + noise, [f"arm.node({place})" for place in places])


@pytest.mark.parametrize("side", [1, -1])
def test_an_arm_that_bends_past_the_vertical_is_not_mirrored(side):
    bends = np.linspace(-10.0, 2.0, 13)
    simulation, tags = hanging((0.12, 0, -0.22), bends, side)
    found = calibrate(simulation, tags, progress=False)
    curvatures = fit(simulation, Tags(tags.points, found.places, found), [("arm", "natural_curvature")], progress=False)
    assert curvatures.values[:, 0] == pytest.approx(bends, abs=0.2)
    assert found.rms < 0.5
    assert not any("side of the plane" in str(item) for item in found.unobservable)


def test_from_which_side_a_vertical_arm_is_seen_is_not_told_and_that_is_said():
    simulation, tags = hanging((0, 0, -0.25), np.linspace(-6.0, 4.0, 6))
    found = calibrate(simulation, tags, progress=False)
    assert any("side of the plane" in str(item) for item in found.unobservable)


def test_with_weight_to_tell_it_the_tilt_of_the_base_is_found():
    simulation, places = robot()
    pixels = made(places, TURNS, level(roll=0.2), tilt=0.15)
    found = calibrate(simulation, Tags(pixels, places), free=("roll", "scale", "tilt"), progress=False)
    assert found.unobservable == ()
    assert abs(found.tilt) == pytest.approx(0.15, abs=1e-4)
    assert found.gravity == pytest.approx(9.8 * np.array([np.sin(0.15), 0.0, -np.cos(0.15)]), abs=1e-3)


def test_noise_hides_the_tilt_of_the_base_and_that_is_said():
    simulation, places = robot()
    found = calibrate(simulation, Tags(made(places, TURNS[::3], level(), noise=1.0), places), progress=False)
    assert any("tilt of the base" in item.weights for item in found.unobservable)


@pytest.mark.slow
def test_without_a_tag_at_the_tip_scale_and_places_are_told_as_one():
    simulation, places = robot()
    seen = Tags(log().pixels[:85:8, :8], places[:8])
    found = calibrate(simulation, seen, progress=False)
    assert any(sum("place of tag" in name for name in item.weights) > 2 for item in found.unobservable)


@pytest.mark.slow
def test_the_soft_limb_is_seen_as_well_in_frames_that_did_not_calibrate():
    simulation, places = robot()
    pixels = log().pixels
    camera = calibrate(simulation, Tags(pixels, places), slice(0, 85), progress=False)
    found = fit(simulation, Tags(pixels, camera.places, camera), CONSTANT, progress=False)
    off = 1e3 * np.linalg.norm(found.residuals.reshape(169, 9, 2), axis=2)[85:] / camera.scale  # mm
    assert off[:, -1].mean() < 0.6
    assert off[:, -1].max() < 1.0
    assert np.sqrt((off**2).mean()) < 0.8
    assert (9, 7) in [(outlier.frame, outlier.tag) for outlier in found.outliers]  # tag 108


@pytest.mark.slow
def test_linear_curvature_sees_it_better():
    simulation, places = robot()
    pixels = log().pixels
    linear = [(rod, "natural_curvature", "linear") for rod in ("upper", "lower")]
    camera = calibrate(simulation, Tags(pixels, places), slice(0, 85, 4), unknowns=linear, progress=False)
    found = fit(simulation, Tags(pixels[85:], camera.places, camera), linear, progress=False)
    off = 1e3 * np.linalg.norm(found.residuals.reshape(-1, 9, 2), axis=2) / camera.scale
    assert np.sqrt((off**2).mean()) < 0.4


@pytest.mark.slow
def test_the_stills_of_the_soft_limb_do_not_tell_its_stiffness():
    simulation, places = robot()
    pixels = log().pixels
    camera = calibrate(simulation, Tags(pixels, places), slice(0, 85, 4), progress=False)
    seen = Tags(pixels[:85:8], camera.places, camera)
    found = fit(simulation, seen, [*CONSTANT, (("upper", "lower"), "youngs_modulus")], progress=False)
    (only,) = found.unobservable
    assert list(only.weights) == ["youngs_modulus of 'upper', 'lower'"]


@pytest.mark.parametrize(
    ("tags", "options", "message"),
    [
        (lambda places: Tags(np.zeros((1, 9, 3)), places), {}, "tags must be real2sim.Tags in pixels"),
        (lambda places: Tags(np.zeros((1, 1, 2)), places[:1]), {}, "two places at least, got 1"),
        (lambda places: Tags(np.full((2, 9, 2), np.nan), places), {}, "seen in some of the 2 frames"),
        (lambda places: Tags(np.zeros((2, 9, 2)), places), {"free": ("zoom",)}, "free must be 'roll' or 'scale'"),
        (lambda places: Tags(np.zeros((2, 9, 2)), places), {"frames": [2]}, "frames must lie in 0..1, got 2"),
    ],
)
def test_bad_input_is_refused(tags, options, message):
    simulation, places = robot()
    with pytest.raises(ValueError, match=message):
        calibrate(simulation, tags(places), progress=False, **options)


def test_a_simulation_in_space_is_refused():
    simulation, places = robot(planar=False)
    with pytest.raises(ValueError, match="must be planar"):
        calibrate(simulation, Tags(log().pixels, places), progress=False)
