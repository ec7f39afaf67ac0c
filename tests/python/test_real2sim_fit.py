"""Fits find what was drawn, say how sure they are, and what the targets do not tell."""

import itertools

import numpy as np
import pytest

import withe
from cases import measured
from soft_limb import CONSTANT, LIMB, published, robot, seen_curvatures
from withe.real2sim import Centrelines, Curvatures, Tags, fit
from withe.real2sim.parsing import parse_unknowns
from withe.real2sim.stills import Stills
from withe.real2sim.unknowns import Tilt

ARM = [("arm", "natural_curvature", "constant")]
DENSITIES = [("arm", "density"), ("arm", "line_density")]


def arm(nodes=31, space=False, **options):
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=nodes, radius=5e-3, material=rubber, name="arm")
    scene.clamp(rod.start)
    return scene.build(integrator="static", planar=False if space else None, **options)


def drawn(simulation, curvatures, places):
    """Positions of places for a series of natural curvatures, shape (frames, places, 3)."""
    simulation = simulation.copy()
    tags = []
    for curvature in curvatures:
        simulation.set("arm", natural_curvature=curvature)
        simulation.equilibrium()
        tags.append([simulation.positions("arm")[place] for place in places])
    return np.array(tags)


def names(places):
    return [f"arm.node({place})" for place in places]


@pytest.mark.case("inverse", "Natural curvatures of a soft limb in 169 frames", source="published turns")
def test_the_limbs_of_the_dissertation_are_explained_in_three_iterations_a_frame():
    simulation, places = robot()
    found = fit(simulation, seen_curvatures(places), CONSTANT, progress=False)
    assert found.converged.all()
    assert np.abs(found.residuals).sum(axis=1).max() < 1e-9
    assert found.iterations.max() <= 3
    measured(np.degrees(np.abs(found.values * LIMB - published()[1])), "degrees")
    assert np.degrees(np.abs(found.values * LIMB - published()[1])).max() < 0.6
    assert found.unobservable == ()


def test_what_is_found_in_a_frame_does_not_depend_on_the_frames_before_it():
    """Their derivatives and their shape are where a frame begins, however far off they are, and whatever was seen."""
    simulation = arm()
    rng = np.random.default_rng(5)
    curvatures = np.stack([np.zeros(14), rng.uniform(-9.0, 9.0, 14)], axis=1)
    points = drawn(simulation, curvatures, [10, 20, 30])
    points[3, 1] = points[8, :2] = np.nan
    tags = Tags(points, names((10, 20, 30)), sigma=1e-4)
    found = fit(simulation, tags, ARM, progress=False)
    alone = [fit(simulation, Tags(points[[f]], tags.places, sigma=1e-4), ARM, progress=False) for f in range(14)]
    assert np.abs(found.values[:, 0] - curvatures[:, 1]).max() < 1e-7
    assert np.allclose(found.values[:, 0], [one.values[0, 0] for one in alone], rtol=0.0, atol=1e-7)
    assert np.allclose(found.covariance[:, 0, 0], [one.covariance[0, 0, 0] for one in alone], rtol=1e-6)


def test_published_turns_reach_the_published_tolerance():
    simulation, places = robot()
    residual = seen_curvatures(places).bind(simulation)
    for frame, turns in enumerate(published()[1]):
        for rod, turn in zip(("upper", "lower"), turns, strict=True):
            simulation.set(rod, natural_curvature=(0.0, turn / LIMB))
        simulation.equilibrium()
        assert np.abs(residual.value(simulation.positions(), frame)).sum() < 2.5e-3


def test_the_published_descent_takes_fewer_than_2000_equilibria():
    simulation, places = robot()
    found = fit(simulation, seen_curvatures(places), CONSTANT, method="source", progress=False)
    assert found.converged.all()
    assert np.abs(found.residuals).sum(axis=1).max() < 2.5e-3
    assert found.solves.sum() < 2000


@pytest.mark.parametrize("method", ["gauss_newton", "lbfgs"])
@pytest.mark.parametrize(
    ("basis", "curvature"),
    [
        ("constant", np.full(29, 4.0)),
        ("linear", np.linspace(1 / 30, 29 / 30, 29) * 10 - 2),
        (np.stack([np.ones(29), np.arange(29) < 15], axis=1), 2 + 5.0 * (np.arange(29) < 15)),
    ],
)
def test_curvature_along_a_rod_is_found(basis, curvature, method):
    simulation = arm()
    places = range(5, 31, 5)
    tags = drawn(simulation, [np.stack([0 * curvature, curvature], axis=1)], places)
    found = fit(simulation, Tags(tags, names(places)), [("arm", "natural_curvature", basis)], method, progress=False)
    assert found.converged.all()
    found.apply(simulation, 0)
    tolerance = 1e-5 if method == "gauss_newton" else 1e-2
    assert simulation.get("arm", "natural_curvature")[:, 1] == pytest.approx(curvature, abs=tolerance)
    assert np.abs(found.residuals).max() < tolerance * 1e-2


WAVES = 4.0 + 3.0 * np.sin(np.arange(29) / 5.0)
HATS = np.stack([np.interp(np.arange(29), (7 * i - 7, 7 * i, 7 * i + 7), (0, 1, 0)) for i in range(5)], axis=1)


@pytest.mark.parametrize(
    ("basis", "curvature"),
    [("segment", WAVES), ("segment", np.full(29, 4.0)), (HATS, HATS @ (1, -2, 5, 4, 3)), (HATS, np.full(29, 4.0))],
)
def test_curvature_stencil_by_stencil_and_over_functions_of_ones_own_is_found(basis, curvature):
    simulation = arm()
    places = range(2, 31)
    tags = Tags(drawn(simulation, [np.stack([0 * curvature, curvature], axis=1)], places), names(places))
    found = fit(simulation, tags, [("arm", "natural_curvature", basis)], progress=False)
    assert found.converged.all()
    found.apply(simulation, 0)
    assert simulation.get("arm", "natural_curvature")[:, 1] == pytest.approx(curvature, abs=1e-5)
    constant = fit(simulation, tags, ARM, progress=False)
    alike = np.ptp(curvature) == 0.0
    assert (constant.rms[0] < 1e-7) == alike  # which explains no more than it can
    if alike:
        assert constant.values[0, 0] == pytest.approx(found.values[0].mean(), abs=1e-6)


@pytest.mark.parametrize("basis", ["constant", "segment", HATS])
def test_errors_of_every_basis_have_the_size_that_the_covariance_says(basis):
    simulation, places = arm(), range(2, 31)
    exact = drawn(simulation, [(0.0, 4.0)], places)[0]
    noise = np.random.default_rng(8).normal(0.0, 1e-5, (40, *exact.shape))
    frames = Tags(exact + noise, names(places), sigma=1e-5)
    found = fit(simulation, frames, [("arm", "natural_curvature", basis)], progress=False)
    off = found.values - 4.0
    scaled = np.array([np.linalg.solve(np.linalg.cholesky(c), x) for c, x in zip(found.covariance, off, strict=True)])
    assert np.sqrt(np.mean(scaled**2)) == pytest.approx(1.0, abs=3.0 / np.sqrt(2.0 * scaled.size))


def test_in_space_both_curvatures_are_found():
    simulation = arm(space=True)
    tags = drawn(simulation, [(3.0, -5.0), (3.5, -5.0)], range(5, 31, 5))
    found = fit(simulation, Tags(tags, names(range(5, 31, 5))), ARM, progress=False)
    assert found.values == pytest.approx(np.array([(3.0, -5.0), (3.5, -5.0)]), abs=1e-6)
    assert found.names[0] == "natural_curvature of 'arm' towards d1"


def test_the_simulation_is_left_as_it_was():
    simulation = arm()
    tags = drawn(simulation, [(0.0, 5.0)], [30])
    before = simulation.snapshot()
    fit(simulation, Tags(tags, ["arm.end"]), ARM, progress=False)
    assert np.array_equal(simulation.get("arm", "natural_curvature"), np.zeros((29, 2)))
    simulation.equilibrium()
    simulation.restore(before)


@pytest.mark.case("inverse", "Young's modulus and curvatures from stills", source="the values of the made data")
def test_a_stiffness_that_all_frames_share_is_found_with_the_curvature_of_each():
    truth = arm()
    truth.set("arm", youngs_modulus=2.3e6)
    places = range(3, 31, 3)
    tags = drawn(truth, [(0.0, k) for k in (-3.0, 0.0, 4.0)], places)
    found = fit(arm(), Tags(tags, names(places)), [*ARM, ("arm", "youngs_modulus")], progress=False)
    assert found.value("arm", "youngs_modulus") == pytest.approx(2.3e6, rel=1e-6)
    assert found.value("arm")[:, 0] == pytest.approx([-3.0, 0.0, 4.0], abs=1e-5)
    assert found.unobservable == ()


def test_a_curvature_shared_by_several_loads_is_found_with_the_stiffness():
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=rubber, name="arm")
    scene.clamp(rod.start)
    load = scene.add_force(rod.end, (0, 0, 0))
    forces = np.array([0.0, 1e-3, 3e-3])
    simulation = scene.build(integrator="static", planar=False)

    def hang(simulation, frame):
        simulation.set(load, force=(0, 0, -forces[frame]))

    truth = simulation.copy()
    truth.set(rod, youngs_modulus=7e5, natural_curvature=(0, 2.0))
    tags = []
    for frame in range(3):
        hang(truth, frame)
        truth.equilibrium()
        tags.append(truth.positions(rod)[[15, 30]])
    found = fit(
        simulation,
        Tags(tags, names([15, 30])),
        [(rod, "youngs_modulus")],
        shared=ARM,
        conditions=hang,
        progress=False,
    )
    assert found.value(rod, "youngs_modulus")[0] == pytest.approx(7e5, rel=1e-6)
    assert found.value(rod)[0] == pytest.approx([0.0, 2.0], abs=1e-6)


@pytest.mark.case("inverse", "Mass at the tip from stills", source="the value of the made data")
def test_a_mass_at_the_tip_is_weighed():
    def loaded(mass):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=2e7, density=1000.0)
        rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=rubber, name="arm")
        scene.clamp(rod.start)
        scene.add_mass(rod.end, mass, name="weight")
        return scene.build(integrator="static")

    truth = loaded(0.02)
    truth.equilibrium()
    tags = truth.positions("arm")[None, [15, 30]]
    found = fit(loaded(0.01), Tags(tags, names([15, 30])), [("weight", "mass")], progress=False)
    assert found.value("weight", "mass")[0] == pytest.approx([0.02], rel=1e-6)


def test_stiffness_and_weight_are_told_as_one_number():
    truth = arm()
    truth.set("arm", youngs_modulus=1.5e6)
    places = range(3, 31, 3)
    tags = drawn(truth, [(0.0, 0.0)], places)
    unknowns = [("arm", "youngs_modulus"), ("arm", "density")]
    found = fit(arm(), Tags(tags, names(places)), unknowns, progress=False)
    assert found.converged.all()
    (only,) = found.unobservable
    assert set(only.weights) == {"youngs_modulus of 'arm'", "density of 'arm'"}
    assert np.prod(list(only.weights.values())) == pytest.approx(0.5, abs=0.01)
    ratio = found.value("arm", "youngs_modulus") / found.value("arm", "density")
    assert ratio == pytest.approx(1500.0, rel=1e-6)
    assert np.isinf(found.sigma("arm", "density")).all()


def test_frames_in_which_nothing_was_seen_are_skipped_and_lost_tags_left_out():
    simulation = arm()
    places = range(5, 31, 5)
    tags = drawn(simulation, [(0.0, k) for k in (1.0, 2.0, 3.0)], places)
    tags[1] = np.nan
    tags[2, 4] = np.nan
    found = fit(simulation, Tags(tags, names(places)), ARM, progress=False)
    assert found.skipped == (1,)
    assert found.reasons == {1: "nothing was seen"}
    assert list(found.converged) == [True, False, True]
    assert found.values[[0, 2], 0] == pytest.approx([1.0, 3.0], abs=1e-6)
    with pytest.raises(ValueError, match="frame 1 was skipped"):
        found.apply(simulation, 1)


def test_a_shape_out_of_reach_leaves_its_residual():
    simulation = arm()
    simulation.set("arm", youngs_modulus=2e7)
    found = fit(simulation, Tags([[(0.4, 0.0, 0.0)]], ["arm.end"]), ARM, progress=False)
    assert found.converged.all()
    reached = drawn(simulation, [(0.0, k) for k in np.linspace(0, 15, 151)], [30])[:, 0]
    least = np.linalg.norm(reached - (0.4, 0, 0), axis=1).min()
    assert np.linalg.norm(found.residuals[0]) == pytest.approx(least, rel=1e-3)


def test_what_a_fit_leaves_beyond_sigma_is_named_and_what_chance_leaves_is_not():
    simulation, places = arm(), range(5, 31, 5)
    points = drawn(simulation, [(0.0, 0.1 * k) for k in range(100)], places)
    points += np.random.default_rng(4).normal(0.0, 5e-4, points.shape)
    points[7] += 0.01 * np.sin(np.arange(18.0)).reshape(6, 3)
    for sigma, beyond in ((5e-4, [7]), (5e-5, list(range(100)))):
        found = fit(simulation, Tags(points, names(places), sigma=sigma), ARM, progress=False)
        assert found.converged.all()
        assert list(found.reasons) == beyond
    assert fit(simulation, Tags(points, names(places)), ARM, progress=False).reasons == {}


@pytest.mark.parametrize("sigma", [5e-4, None])
def test_targets_beside_the_plane_of_a_scene_are_said_to_be_and_unknowns_are_no_less_observable(sigma):
    """As if the camera's axes were shifted along the normal: the fit is the same, and says what is wrong."""
    simulation, places = arm(), range(5, 31, 5)
    points = drawn(simulation, [(0.0, 1.0)], places)
    points += np.random.default_rng(4).normal(0.0, 5e-4, points.shape)
    right, beside = (
        fit(simulation, Tags(points + np.array((0.0, off, 0.0)), names(places), sigma=sigma), ARM, progress=False)
        for off in (0.0, 0.03)
    )
    np.testing.assert_allclose(beside.values, right.values, rtol=1e-9)
    np.testing.assert_allclose(beside.covariance, right.covariance, rtol=1e-6)
    assert beside.unobservable == right.unobservable
    assert right.reasons == {}
    assert "targets lie outside of the plane of the scene by" in beside.reasons[0]


def test_a_tag_that_jumps_in_one_frame_is_named():
    simulation = arm()
    places = range(5, 31, 5)
    tags = drawn(simulation, [(0.0, 0.1 * k) for k in range(20)], places)
    tags += np.random.default_rng(3).normal(0, 1e-4, tags.shape) * (1, 0, 1)
    tags[12, 3] += (0.0, 0.0, 5e-3)
    targets = Tags(tags, names(places))
    found = fit(simulation, targets, ARM, progress=False)
    (outlier,) = found.outliers
    assert (outlier.frame, outlier.tag) == (12, 3)
    assert outlier.jump == pytest.approx(5e-3, rel=0.2)
    cleaned = fit(simulation, targets.without([(o.frame, o.tag) for o in found.outliers]), ARM, progress=False)
    assert cleaned.outliers == ()
    assert cleaned.rms[12] < 0.1 * found.rms[12]


def seen_with_gaps(seed, missing, frames=40, whole=None):
    """Tags of an arm that goes to and fro, with errors of half a millimetre, and with gaps but in one frame."""
    simulation, places = arm(), range(6, 31, 6)
    points = drawn(simulation, [(0.0, k) for k in 5.0 * np.sin(np.arange(frames) / 6.0)], places)
    rng = np.random.default_rng(seed)
    points += rng.normal(0.0, 5e-4, points.shape)
    gone = rng.random(points.shape[:2]) < missing
    if whole is not None:
        gone[whole] = False
    points[gone] = np.nan
    return simulation, points, names(places)


@pytest.mark.parametrize("missing", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("frame", [0, 1, 20, 39])
@pytest.mark.parametrize("jump", [0.01, 0.05])
def test_a_tag_that_jumps_is_named_in_every_frame_and_where_others_are_missing(frame, missing, jump):
    simulation, points, places = seen_with_gaps(2, missing, whole=frame)
    points[frame, 3] += jump * np.array((0.8, 0.0, 0.6))
    found = fit(simulation, Tags(points, places), ARM, progress=False)
    assert [(each.frame, each.tag) for each in found.outliers] == [(frame, 3)]
    assert found.outliers[0].jump == pytest.approx(jump, rel=0.3)


@pytest.mark.parametrize("sigma", [None, 5e-4])
def test_without_jumps_no_tag_is_named(sigma):
    for seed in range(20):
        simulation, points, places = seen_with_gaps(seed, (0.0, 0.3)[seed % 2], frames=20)
        assert fit(simulation, Tags(points, places, sigma=sigma), ARM, progress=False).outliers == ()


def test_a_jump_of_thirteen_sigma_is_named_though_the_fit_follows_it():
    named = 0
    for seed in range(10):
        simulation, points, places = seen_with_gaps(seed, 0.0, frames=20)
        points[10, 3] += (6e-3, 0.0, 3e-3)
        found = fit(simulation, Tags(points, places, sigma=5e-4), ARM, progress=False)
        named += [(each.frame, each.tag) for each in found.outliers] == [(10, 3)]
    assert named >= 8


@pytest.mark.parametrize("missing", [0.0, 0.1, 0.3])
def test_what_a_wrong_model_leaves_is_hardly_taken_for_jumps(missing):
    """Curvature that doubles along the arm, fitted by a constant: residuals are up to 40 times the errors."""
    simulation, places = arm(), range(6, 31, 6)
    field = np.stack([np.zeros(29), np.linspace(0.6, 1.4, 29)], axis=1)
    exact = drawn(simulation, [k * field for k in 5.0 * np.sin(np.arange(40) / 6.0)], places)
    named = seen = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        points = exact + rng.normal(0.0, 1e-4, exact.shape)
        points[rng.random(points.shape[:2]) < missing] = np.nan
        found = fit(simulation, Tags(points, names(places)), ARM, progress=False)
        named, seen = named + len(found.outliers), seen + int(np.isfinite(points[:, :, 0]).sum())
    assert named < 0.01 * seen


def test_without_noise_no_tag_is_named_for_what_solvers_leave():
    simulation, places = arm(), range(6, 31, 6)
    points = drawn(simulation, [(0.0, k) for k in 5.0 * np.sin(np.arange(30) / 6.0)], places)
    assert fit(simulation, Tags(points, names(places)), ARM, progress=False).outliers == ()


def test_tags_of_which_nothing_tells_whether_they_jump_are_listed():
    simulation, points, places = seen_with_gaps(2, 0.0, frames=30)
    points[10:, 0] = np.nan  # no frame around the last one shows it
    points[29, 0] = points[5, 0]
    points[15, [1, 2, 4]] = np.nan  # no other tag
    found = fit(simulation, Tags(points, places), ARM, progress=False)
    assert found.unchecked == ((15, 3), (29, 0))
    assert "outliers were not checked at 2 tags in 2 frames" in repr(found)
    few = fit(simulation, Tags(points[:3], places), ARM, progress=False)
    assert few.unchecked == tuple((frame, tag) for frame in range(3) for tag in range(5))


def test_errors_have_the_size_that_the_covariance_says():
    coarse, fine = arm(), arm(nodes=121)
    truth = np.array([(0.0, 3.0)])
    exact = drawn(fine, truth, range(20, 121, 20))
    camera = withe.perception.Camera(
        [[1500.0, 0, 640], [0, 1500, 360], [0, 0, 1]],
        rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        translation=(0, 0, 1),
    )
    pixels = camera.project(exact[0])
    rng = np.random.default_rng(11)
    frames = pixels + rng.normal(0, 0.5, (100, *pixels.shape))
    found = fit(coarse, Tags(frames, names(range(5, 31, 5)), camera, sigma=0.5), ARM, progress=False)
    scaled = (found.value("arm")[:, 0] - 3.0) / found.sigma("arm")[:, 0]
    assert 0.9 < np.sqrt(np.mean(scaled**2)) < 1.1
    unknown = fit(coarse, Tags(frames, names(range(5, 31, 5)), camera), ARM, progress=False)
    assert unknown.sigma("arm") == pytest.approx(found.sigma("arm"), rel=0.1)


def arm_across(normal):
    """An arm in the upright plane with some normal."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    end = 0.3 * np.array((normal[1], -normal[0], 0.0))
    rod = scene.add_rod(start=(0, 0, 0), end=end, nodes=31, radius=5e-3, material=rubber, name="arm")
    scene.clamp(rod.start)
    return scene.build(integrator="static", planar=True)


@pytest.mark.parametrize(("normal", "across"), [((0.0, 1.0, 0.0), 0.0), ((0.6, 0.8, 0.0), 50.0)])
@pytest.mark.parametrize("kind", ["tags", "centrelines"])
def test_in_a_plane_an_estimated_error_does_not_depend_on_what_lies_across_it(normal, across, kind):
    simulation, places = arm_across(normal), range(3, 31, 3)
    exact = drawn(simulation, [(0.0, 3.0)], places)[0]
    rng = np.random.default_rng(11)
    inside, out = rng.normal(0.0, 5e-4, (30, *exact.shape)), rng.normal(0.0, 5e-4 * across, (30, len(exact), 1))
    points = exact + inside - (inside @ normal)[..., None] * np.array(normal) + out * np.array(normal)
    targets = [
        Tags(points, names(places), sigma=sigma)
        if kind == "tags"
        else Centrelines(points, "arm", ends=False, sigma=sigma)
        for sigma in (5e-4, None)
    ]
    given, estimated = (fit(simulation, target, ARM, progress=False).sigma("arm") for target in targets)
    assert estimated == pytest.approx(given, rel=0.1)


def test_exact_tags_beside_the_plane_have_no_error_in_it():
    normal = np.array((0.6, 0.8, 0.0))
    simulation, places = arm_across(normal), range(3, 31, 3)
    points = drawn(simulation, [(0.0, k) for k in np.linspace(-5.0, 5.0, 10)], places)
    for shift in np.linspace(0.01, 0.1, 10):
        found = fit(simulation, Tags(points + shift * normal, names(places)), ARM, progress=False)
        assert (found.covariance >= 0.0).all()
        assert found.sigma("arm").max() < 1e-3


@pytest.mark.parametrize(
    ("targets", "unknowns", "options", "message"),
    [
        (Tags([[(1, 0, 0)]], ["arm.end"]), [], {}, "unknowns must be at least one"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), "arm", {}, "unknowns must be a list"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [("arm", "colour")], {}, "unknowns must be of natural_curvature"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [*ARM, *ARM], {}, "natural_curvature of rod 'arm' twice"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [(("arm", "arm"), "density")], {}, "'density' of 'arm' is given twice"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), ARM, {"shared": ARM}, "in unknowns or in shared, got both"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [*DENSITIES], {}, "density of 'arm' cannot be unknown, because"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), DENSITIES[::-1], {}, "density of 'arm' cannot be unknown, because"),
        (
            Tags([[(1, 0, 0)]], ["arm.end"]),
            DENSITIES[:1],
            {"shared": DENSITIES[1:]},
            "because other unknowns determine all",
        ),
        (
            Tags([[(1, 0, 0)]], ["arm.end"]),
            [*ARM, ("arm", "points")],
            {},
            "points of 'arm' determine its natural_curvature",
        ),
        (
            Tags([[(1, 0, 0)]], ["arm.end"]),
            [("arm", "points"), *ARM],
            {},
            "points of 'arm' determine its natural_curvature",
        ),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [("arm", "viscosity")], {}, "must have a positive initial value"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [("arm", "natural_curvature", "cubic")], {}, "'constant' or 'linear' or"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [("arm", "natural_curvature", np.ones((3, 1)))], {}, r"\(29, n\)"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), ARM, {"method": "newton"}, "method must be"),
        (Tags([[(1, 0, 0)]], ["arm.end"]), [("arm", "density")], {"method": "source"}, "where frames share unknowns"),
        (Tags([[[np.nan] * 3]] * 2, ["arm.end"]), ARM, {}, "show something in some frame, got nothing in all 2"),
        ([Tags([[(1, 0, 0)]], ["arm.end"], sigma=1)] * 2 + [3], ARM, {}, "targets must be Curvatures"),
        ([Tags([[(1, 0, 0)]] * n, ["arm.end"], sigma=1) for n in (1, 2)], ARM, {}, "same number of frames, got 1, 2"),
        ([Tags([[(1, 0, 0)]], ["arm.end"])] * 2, ARM, {}, "sigma of every target must be given"),
        (Tags([[(1, 0)]], ["arm.end"]), ARM, {}, "camera must be given for tags in pixels"),
        (Tags([[(1, 0, 0)]], ["leg.end"]), ARM, {}, "no rod 'leg'"),
        (Tags([[(1, 0, 0)]], [("arm", 0.5)]), ARM, {}, "must lie on rod 'arm', from 0 to 0.3 m, got 0.5"),
    ],
)
def test_bad_input_is_refused(targets, unknowns, options, message):
    with pytest.raises(ValueError, match=message):
        fit(arm(), targets, unknowns, progress=False, **options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Tags([[(1, 0)]], ["a", "b"]), r"points in pixels must have shape \(frames, 2, 2\), got \(1, 1, 2\)"),
        (lambda: Tags([[1, 0, 0]], ["a"]), r"points in metres must have shape \(frames, 1, 3\), got \(1, 3\)"),
        (lambda: Tags([[(1, 0, np.inf)]], ["a"]), "must be finite, or NaN where nothing was seen"),
        (lambda: Tags([[(1, 0, 0)]], ["a"], sigma=0), "sigma must be positive"),
        (lambda: Tags([[(1, 0, 0)]] * 2, ["a"], times=[1, 1]), "times must increase"),
        (lambda: Curvatures([[0.1]], ["a", "b"], [(1,)]), "places must be three at least"),
        (lambda: Curvatures([[0.1]], ["a", "b", "c"], [(2,)]), "tags of groups must lie in 1..1, got 2"),
        (lambda: Curvatures([[0.1]], ["a", "b", "c"], [()]), "at least one tag each"),
        (lambda: Curvatures([[0.1, 0.2]], ["a", "b", "c"], [(1,)]), r"must have shape \(frames, 1\), got \(1, 2\)"),
    ],
)
def test_bad_targets_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_what_is_wrong_with_conditions_is_heard():
    with pytest.raises(ValueError, match="leg"):
        fit(arm(), Tags([[(1, 0, 0)]], ["arm.end"]), ARM, conditions=lambda s, f: s.set("leg", density=1.0))


def test_turns_in_space_need_an_axis():
    targets = Curvatures([[0.1]], names([0, 15, 30]), [(1,)])
    with pytest.raises(ValueError, match="normal must be given"):
        fit(arm(space=True), targets, ARM, progress=False)


@pytest.mark.parametrize("space", [False, True])
def test_derivatives_are_those_of_equilibria(space):
    simulation = arm(space=space)
    unknowns = parse_unknowns(simulation, [("arm", "natural_curvature", "linear"), ("arm", "youngs_modulus")])
    unknowns += parse_unknowns(simulation, [("arm", "density")]) + ([] if space else [Tilt(simulation)])
    stills = Stills(simulation, unknowns, Tags(np.zeros((1, 6, 3)), names(range(5, 31, 5))).bind(simulation))
    coordinates = np.array([3.0, -2.0, 0.1, -0.2, 0.3] if not space else [3.0, -2.0, 1.0, 4.0, 0.1, -0.2])
    found = stills.residual(coordinates, 0)
    jacobian = stills.jacobian(coordinates, found[1], 0)
    for i, step in enumerate(1e-4 * stills.scales):
        ahead, behind = (stills.residual(coordinates + s * np.eye(len(coordinates))[i], 0)[0] for s in (step, -step))
        scale = np.abs(jacobian[:, i]).max()
        assert jacobian[:, i] == pytest.approx((ahead - behind) / (2 * step), abs=1e-5 * scale)


def crooked():
    """A rod in space that its weight bends, twists and stretches."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.4, density=1000.0, viscosity=1e3)
    s = np.linspace(0.0, 1.0, 16)
    points = np.stack([0.2 * s, 0.03 * np.cos(2.0 * s), 0.02 * np.sin(3.0 * s)], axis=1)
    rod = scene.add_rod(points=points, radius=4e-3, material=rubber, name="arm")
    scene.clamp(rod.start)
    return scene.build(integrator="static")


STATIC = ("youngs_modulus", "density", "stretch_stiffness", "bend_stiffness", "twist_stiffness", "line_density")
PAIRS = [pair for pair in itertools.permutations(STATIC, 2) if {*pair} != {"density", "line_density"}]


@pytest.mark.parametrize("pair", PAIRS, ids="-".join)
def test_derivatives_by_two_unknowns_are_those_of_equilibria_whichever_comes_first(pair):
    simulation = crooked()
    tags = Tags(np.zeros((1, 3, 3)), names((5, 10, 15))).bind(simulation)
    stills = Stills(simulation, parse_unknowns(simulation, [("arm", word) for word in pair]), tags)
    at = np.array([0.1, -0.2])
    stills.residual(at + np.array([0.3, 0.0]), 0)  # the first alone changes after this
    found = stills.residual(at, 0)
    jacobian = stills.jacobian(at, found[1], 0)
    firsts = [np.mean(crooked().get("arm", word)) for word in pair]
    assert [np.mean(simulation.get("arm", word)) for word in pair] == pytest.approx(firsts * np.exp(at), rel=1e-12)
    for i in range(2):
        step = 1e-3 * np.eye(2)[i]
        near, far = ((stills.residual(at + k * step, 0)[0] - stills.residual(at - k * step, 0)[0]) / k for k in (1, 2))
        assert jacobian[:, i] == pytest.approx((4 * near - far) / 6e-3, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("words", [("youngs_modulus", "twist_stiffness"), ("twist_stiffness", "youngs_modulus")])
def test_a_stiffness_is_found_with_the_modulus_that_sets_it(words):
    truth = crooked()
    truth.set("arm", youngs_modulus=1.3e6, twist_stiffness=1.5 * truth.get("arm", "twist_stiffness"))
    truth.equilibrium()
    tags = Tags(truth.positions("arm")[None, 3::3], names(range(3, 16, 3)), sigma=1e-7)
    found = fit(crooked(), tags, [("arm", word) for word in words], progress=False)
    fitted = crooked()
    found.apply(fitted)
    for word in words:
        assert found.value("arm", word)[0] == pytest.approx(np.mean(truth.get("arm", word)), rel=1e-6)
        assert np.mean(fitted.get("arm", word)) == pytest.approx(np.mean(truth.get("arm", word)), rel=1e-6)


def test_where_the_engine_knows_no_gradient_differences_take_its_place():
    def hanging(modulus):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=modulus, density=1000.0)
        rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=21, radius=8e-3, material=rubber, name="arm")
        scene.clamp(rod.start)
        scene.add_custom_force(
            lambda time, positions, velocities: np.array([[0.0, 0.0, 0.05]] * 21) * (np.arange(21) == 20)[:, None]
        )
        simulation = scene.build(integrator="static", planar=False)
        simulation.equilibrium()
        return simulation

    tags = hanging(3e6).positions("arm")[None, [10, 20]]
    found = fit(hanging(2e6), Tags(tags, names([10, 20])), [("arm", "youngs_modulus")], progress=False)
    assert found.values[0, 0] == pytest.approx(3e6, rel=1e-5)


def test_a_rod_that_is_free_to_spin_is_fitted():
    def rope(modulus):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=modulus, density=1000.0)
        rod = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=21, radius=5e-3, material=rubber, name="arm")
        scene.pin(rod.start)
        scene.pin(rod.end, free=(1, 0, 0))
        simulation = scene.build(integrator="static", planar=False)
        simulation.equilibrium()
        return simulation

    tags = rope(3e6).positions("arm")[None, [5, 10]]
    found = fit(rope(2e6), Tags(tags, names([5, 10])), [("arm", "youngs_modulus")], progress=False)
    assert found.values[0, 0] == pytest.approx(3e6, rel=1e-4)


@pytest.mark.parametrize("more", [[], [("arm", "youngs_modulus")]])
def test_a_frame_without_equilibrium_says_so_and_the_others_are_fitted(more):
    simulation = arm()
    tags = drawn(simulation, [(0.0, 1.0), (0.0, 2.0)], [15, 30])

    def conditions(simulation, frame):
        simulation.set(gravity=(0, 0, -9.81))
        if frame == 0:
            raise withe.ConvergenceError("there is none")

    found = fit(simulation, Tags(tags, names([15, 30])), [*ARM, *more], conditions=conditions, progress=False)
    assert list(found.converged) == [False, True]
    assert found.reasons == {0: "no equilibrium at the initial guess"}
    assert found.values[1, 0] == pytest.approx(2.0, abs=1e-6)
    assert np.isnan(found.rms[0])


def test_a_fit_prints_what_it_found_in_a_few_lines():
    simulation = arm()
    points = drawn(simulation, [(0.0, 2.0), (0.0, 3.0), (0.0, 4.0)], [10, 20, 30])
    points[1] = np.nan
    shown = repr(fit(simulation, Tags(points, names((10, 20, 30)), sigma=1e-4), ARM, progress=False)).split("\n")
    assert shown[0].startswith("Fit(2 of 3 frames converged")
    assert shown[1].startswith("  natural_curvature of 'arm': 2 to 4, sigma 0.01")
    assert shown[2].startswith("  outliers were not checked at 6 tags in 2 frames")
    assert shown[3:] == ["  frame 1: nothing was seen"]
    many = repr(fit(simulation, Tags(points, names((10, 20, 30))), [("arm", "natural_curvature", "segment")]))
    assert len(many.split("\n")) < 40


def test_of_two_or_three_frames_none_is_called_an_outlier_for_what_the_others_lack():
    simulation = arm()
    points = drawn(simulation, [(0.0, 2.0), (0.0, 3.0), (0.0, 4.0)], [10, 20, 30])
    points += np.random.default_rng(3).normal(0.0, 1e-4, points.shape) * (1, 0, 1)
    assert fit(simulation, Tags(points, names((10, 20, 30))), ARM, progress=False).outliers == ()
