"""Stiffness, damping and the delay between two clocks are found from how a rod rings."""

import warnings

import numpy as np
import pytest

import withe
from gradient_scenes import TIGHT
from ringing_rod import UNKNOWNS, let_go, ringing
from withe.common.progress import Progress
from withe.real2sim import Tags, fit_motion
from withe.real2sim.motions import _Motion
from withe.real2sim.parsing import parse_unknowns
from withe.real2sim.targets import bind
from withe.real2sim.unknowns import Delay


def seen(delay, noise=0.0, seed=0, **options):
    """Tags of the middle and the tip, 25 a second."""
    times = np.arange(0.04, 2.0, 0.04)
    simulation = ringing(time_step=1e-3, **options)
    nodes = (simulation.rods[0].nodes - 1) // 2
    shapes = []
    for time in times + delay:
        simulation.run(time - simulation.time, progress=False)
        shapes.append(simulation.positions("arm")[[nodes, -1]])
    shapes = np.array(shapes) + np.random.default_rng(seed).normal(0, noise, (len(times), 2, 3)) * (1, 0, 1)
    return Tags(shapes, ["arm.node(6)", "arm.end"], times=times)


def test_stiffness_damping_and_delay_are_found_to_a_percent_from_two_seconds_of_ringing():
    found = fit_motion(
        ringing(modulus=1.2e6, viscosity=2000.0),
        seen(0.013, noise=2e-4, nodes=25, viscosity=3000.0),
        UNKNOWNS,
        begin=let_go,
        progress=False,
    )
    assert found.converged.all()
    assert found.value("arm", "youngs_modulus")[0] == pytest.approx([1e6], rel=1e-2)
    assert found.value("arm", "viscosity")[0] == pytest.approx([3000.0], rel=3e-2)
    assert found.value("delay")[0] == pytest.approx([0.013], abs=2e-3)
    assert found.unobservable == ()
    assert found.solves[0] <= 24  # 42 by differences in every iteration


def test_what_is_seen_later_has_moved_on_with_its_velocity():
    simulation, target = ringing(viscosity=3000.0), seen(0.013, viscosity=3000.0)
    motion = _Motion(
        simulation.copy(),
        [*parse_unknowns(simulation, UNKNOWNS[:1]), Delay(0.0, 2.0)],
        bind([target], simulation),
        target.times,
        0.0,
        let_go,
        Progress(1),
    )
    at, step = np.array([0.0, 0.0132]), np.array([0.0, 1e-6])  # between two frames
    _, state = motion.residual(at, 0)
    ahead, behind = (motion.residual(at + way, 0)[0] for way in (step, -step))
    by_delay = motion.jacobian(at, state, 0)[:, 1]
    assert by_delay == pytest.approx((ahead - behind) / 2e-6, abs=1e-7 * np.abs(by_delay).max())


@pytest.mark.case("inverse", "Modulus, viscosity and delay from ringing", source="the values of the made data")
def test_without_noise_a_coarser_mesh_and_step_leave_damping_within_a_percent():
    start = ringing(modulus=1.2e6, viscosity=2000.0)
    found = fit_motion(start, seen(0.013, nodes=25, viscosity=3000.0), UNKNOWNS, begin=let_go, progress=False)
    assert found.value("arm", "youngs_modulus")[0] == pytest.approx([1e6], rel=1e-3)
    assert found.value("arm", "viscosity")[0] == pytest.approx([3000.0], rel=1e-2)
    assert found.value("delay")[0] == pytest.approx([0.013], abs=1e-5)


def swung(nodes, time_step, modulus, swings):
    """A cable whose clamp swings in the plane with three frequencies."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=modulus, density=1000.0)
    cable = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.4), nodes=nodes, radius=4e-3, material=rubber, name="cable")
    scene.clamp(cable.start, name="wall")
    simulation = scene.build(time_step=time_step, planar=True, integrator="energy_momentum")

    def way(time):
        return (min(1.0, 5.0 * time) * float(np.sum(0.02 * np.sin(swings * time))), 0.0, 0.0)

    return simulation, lambda copy: copy.move("wall", path=way)


@pytest.mark.parametrize(
    ("nodes", "time_step", "cause"),
    [pytest.param(5, 2e-3, "mesh too coarse", marks=pytest.mark.slow), (31, 1.5e-2, "time step too long")],
)
def test_sigmas_count_what_a_coarse_mesh_and_a_long_step_leave(nodes, time_step, cause):
    random = np.random.default_rng(60)
    scaled = []
    for _ in range(4):
        modulus, swings = 1e6 * random.uniform(0.5, 2.0), random.uniform(6.0, 16.0, 3)
        simulation, start = swung(41, 1e-3, modulus, swings)
        start(simulation)
        record = simulation.run(0.9, record_every=0.03, progress=False)
        tags = Tags(
            record.positions("cable")[1:, 10::10], [("cable", 0.1 * i) for i in range(1, 5)], times=record.times[1:]
        )
        coarse, start = swung(nodes, time_step, 1.1 * modulus, swings)
        found = fit_motion(coarse, tags, [("cable", "youngs_modulus")], begin=start, progress=False)
        assert cause in found.reasons[0]
        scaled.append((found.values[0, 0] - modulus) / found.sigma("cable", "youngs_modulus")[0, 0])
    assert np.abs(scaled).max() < 2.5
    assert np.abs(scaled).max() > 0.05  # they are no larger than they need be


@pytest.mark.slow
def test_errors_have_the_size_that_the_covariance_says():
    exact = seen(0.0, viscosity=3000.0)
    rng = np.random.default_rng(7)
    scaled = []
    for _ in range(8):
        noise = rng.normal(0, 3e-4, np.shape(exact.points)) * (1, 0, 1)
        target = Tags(exact.points + noise, exact.places, times=exact.times, sigma=3e-4)
        found = fit_motion(
            ringing(viscosity=3000.0, time_step=1e-3), target, UNKNOWNS[:2], begin=let_go, progress=False
        )
        truth = np.array([1e6, 3000.0])
        scaled.append((found.values[0] - truth) / np.sqrt(np.diag(found.covariance[0])))
    assert 0.6 < np.sqrt(np.mean(np.square(scaled))) < 1.4  # 16 numbers


def test_a_local_minimum_is_named_where_sigma_is_given_and_the_first_swings_lead_out_of_it():
    whole = seen(0.0, noise=2e-4)
    stiff = ringing(modulus=3e6)

    def found(frames, start):
        target = Tags(np.asarray(whole.points)[:frames], whole.places, times=whole.times[:frames], sigma=2e-4)
        return fit_motion(start, target, UNKNOWNS[:1], begin=let_go, progress=False)

    local = found(None, stiff)
    assert local.converged.all()
    assert local.values[0, 0] > 2e6
    assert list(local.reasons) == [0]
    assert "times sigma, more than noise explains. Possible causes: a local minimum" in local.reasons[0]
    assert local.reasons[0] in repr(local)
    found(8, stiff).apply(stiff)
    best = found(None, stiff)
    assert best.values[0, 0] == pytest.approx(1e6, rel=1e-3)
    assert best.reasons == {}


@pytest.mark.parametrize("method", ["gauss_newton", "lbfgs"])
@pytest.mark.parametrize("words", [("youngs_modulus", "viscous_time"), ("viscous_time", "youngs_modulus")])
def test_damping_is_found_with_the_modulus_that_sets_it_whichever_comes_first(words, method):
    truth = ringing(modulus=1.1e6)
    truth.set("arm", viscous_time=2e-3)
    record = truth.run(0.5, record_every=0.02, progress=False)
    tags = Tags(record.positions("arm")[1:, [6, 12]], ["arm.node(6)", "arm.end"], times=record.times[1:])
    start = ringing(viscosity=1e3)
    found = fit_motion(start, tags, [("arm", word) for word in words], begin=let_go, method=method, progress=False)
    assert found.value("arm", "youngs_modulus")[0] == pytest.approx([1.1e6], rel=1e-4)
    assert found.value("arm", "viscous_time")[0] == pytest.approx([2e-3], rel=1e-2)


def test_a_drag_and_that_of_a_rod_are_one_unknown_whichever_is_named_first():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    for name in ("arm", "leg"):
        scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.2), nodes=4, radius=5e-3, material=rubber, name=name)
    scene.add_drag(0.3, name="air")
    simulation = scene.build()
    simulation.set("arm", drag=0.1)
    for parts in (("air", "arm"), ("arm", "air")):
        copy = simulation.copy()
        (drag,) = parse_unknowns(copy, [(parts, "drag")])
        drag.write(copy, np.log([2.0]))
        assert [copy.get(part, "drag") for part in ("air", "leg", "arm")] == [
            pytest.approx(value) for value in (0.6, np.full(3, 0.6), np.full(3, 0.2))
        ]


@pytest.mark.case("inverse", "Friction from a rod that slides to a stop", source="the value of the made data")
def test_friction_is_told_by_how_a_rod_slides_to_a_stop():
    def sliding(friction):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        rod = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=rubber, name="arm")
        scene.add_plane(point=(0, 0, -5e-3), normal=(0, 0, 1), friction=friction, name="floor")
        scene.enable_contact()
        simulation = scene.build(time_step=2e-3, integrator="backward_euler")
        simulation.set_velocities(rod, (0.5, 0, 0))
        return simulation

    record = sliding(0.35).run(0.2, record_every=0.02, progress=False)
    seen = Tags(record.positions("arm")[1:, [0, 4]], ["arm.start", "arm.end"], times=record.times[1:])
    found = fit_motion(sliding(0.5), seen, [("floor", "friction")], progress=False)
    assert found.value("floor", "friction")[0] == pytest.approx([0.35], rel=1e-2)


@pytest.mark.parametrize(
    "unknown", [("arm", "points", "constant"), ("arm", "natural_curvature", "linear"), ("wall", "rotation")]
)
def test_the_shape_of_what_rings_is_told_with_its_stiffness(unknown):
    def turned():
        simulation = ringing(viscosity=3000.0)
        (shape,) = parse_unknowns(simulation, [unknown])
        shape.write(simulation, np.array([0.1, 0.3])[: len(shape)] * shape.scales)
        let_go(simulation)
        return simulation

    record = turned().run(1.0, record_every=0.04, progress=False)
    target = Tags(record.positions("arm")[1:, [6, 12]], ["arm.node(6)", "arm.end"], times=record.times[1:])
    start = ringing(modulus=1.1e6, viscosity=3000.0)
    found = fit_motion(start, target, [unknown, UNKNOWNS[0]], begin=let_go, progress=False)
    assert found.value("arm", "youngs_modulus")[0] == pytest.approx([1e6], rel=1e-6)
    assert found.value(*unknown[:2])[0] / found._unknowns[0].scales == pytest.approx(
        np.array([0.1, 0.3])[: len(found.names) - 1], abs=1e-6
    )


@pytest.mark.parametrize(
    ("targets", "unknowns", "options", "message"),
    [
        (Tags([[(0, 0, 0)]], ["arm.end"]), UNKNOWNS, {}, "times of targets must be given"),
        (Tags([[(0, 0, 0)]], ["arm.end"], times=[0.1]), ["dealy"], {}, "must be tuples, or 'delay' once"),
        (Tags([[(0, 0, 0)]], ["arm.end"], times=[0.1]), [], {}, "unknowns must be at least one"),
        (Tags([[(0, 0, 0)]], ["arm.end"], times=[0.1]), UNKNOWNS, {"delay": -0.2}, "times plus delay must not be"),
        (Tags([[[np.nan] * 3]], ["arm.end"], times=[0.1]), UNKNOWNS, {}, "show something at some time"),
        (Tags([[(0, 0, 0)]], ["arm.end"], times=[0.1]), UNKNOWNS, {"begin": lambda s: s.release("leg")}, "leg"),
        (
            [Tags([[(0, 0, 0)]], ["arm.end"], times=[t], sigma=1) for t in (0.1, 0.2)],
            UNKNOWNS,
            {},
            "times of all targets must be the same",
        ),
    ],
)
def test_bad_input_is_refused(targets, unknowns, options, message):
    with pytest.raises(ValueError, match=message):
        fit_motion(ringing(), targets, unknowns, progress=False, **options)


def test_times_in_milliseconds_are_asked_about_and_long_runs_that_are_seen_often_are_not():
    class RunError(Exception):
        """A run has begun."""

    def begin(simulation):
        raise RunError

    def asked(times):
        target = Tags(np.zeros((len(times), 1, 3)), ["arm.end"], times=times)
        with pytest.raises(RunError):
            fit_motion(ringing(), target, UNKNOWNS, begin=begin, progress=False)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        asked(np.arange(0.04, 2.0, 0.04))
        asked(np.arange(0.04, 2000.0, 0.04))
        asked(np.arange(40.0, 120.0, 40.0))  # rarely seen, but no long run
    assert not caught
    with pytest.warns(UserWarning, match=r"at least 40 s apart, .* periods of the .* in milliseconds\?") as caught:
        asked(1e3 * np.arange(0.04, 2.0, 0.04))
    assert caught[0].filename == __file__


def test_a_run_that_fails_with_the_first_guess_says_why():
    def fall(simulation):
        raise withe.ConvergenceError("it does not come to rest")

    target = Tags([[(0, 0, 0)]], ["arm.end"], times=[0.1])
    with pytest.raises(withe.ConvergenceError, match="does not come to rest"):
        fit_motion(ringing(), target, UNKNOWNS, begin=fall, progress=False)


def test_the_gradient_of_a_motion_is_that_of_differences():
    start, target = ringing(viscosity=2000.0, adaptive=False, **TIGHT), seen(0.013, viscosity=3000.0)
    unknowns = [("arm", "natural_curvature", "linear"), *UNKNOWNS[:2]]
    motion = _Motion(
        start.copy(),
        [*parse_unknowns(start, unknowns), Delay(0.0, 2.0)],
        bind([target], start),
        target.times,
        0.0,
        let_go,
        Progress(1),
    )
    motion.differentiable = True
    at = np.array([0.3, -0.2, 0.05, -0.1, 0.0132])
    residual, state = motion.residual(at, 0)
    found = motion.slope(at, state, residual)

    def of(coordinates):
        return 0.5 * np.sum(motion.residual(coordinates, 0)[0] ** 2)

    for i, size in enumerate((1e-3, 1e-3, 1e-4, 1e-3, 1e-6)):
        step = np.zeros(5)
        step[i] = size
        near, far = ((of(at + k * step) - of(at - k * step)) / (2.0 * k * size) for k in (1.0, 2.0))
        assert found[i] == pytest.approx((4.0 * near - far) / 3.0, rel=1e-6, abs=1e-7 * np.abs(found).max()), i


def test_lbfgs_finds_what_gauss_newton_does():
    start, target = ringing(modulus=1.1e6, viscosity=2600.0), seen(0.013, viscosity=3000.0)
    found = fit_motion(start, target, UNKNOWNS, begin=let_go, method="lbfgs", progress=False)
    assert found.converged.all()
    assert found.value("arm", "youngs_modulus")[0] == pytest.approx([1e6], rel=1e-3)
    assert found.value("arm", "viscosity")[0] == pytest.approx([3000.0], rel=1e-2)
    assert found.value("delay")[0] == pytest.approx([0.013], abs=1e-4)


@pytest.mark.parametrize("in_pixels", [False, True])
def test_in_a_planar_scene_lbfgs_takes_tags_with_noise_along_its_normal_and_in_pixels(in_pixels):
    target, camera = seen(0.0, viscosity=3000.0), None
    points = np.asarray(target.points)
    noise = np.random.default_rng(2).normal(0.0, 1.0, points.shape)
    if in_pixels:
        turn = withe.common.drawing.rotation_about(np.array((0.0, 0.0, 0.3)))
        rotation = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) @ turn
        camera = withe.perception.Camera([[1500, 0, 640], [0, 1500, 360], [0, 0, 1]], None, rotation, (0, 0, 1))
        points = camera.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2) + 0.3 * noise[..., :2]
    else:
        points = points + 2e-4 * noise
    target = Tags(points, target.places, camera, times=target.times)
    start = ringing(modulus=1.1e6, viscosity=3000.0)
    found, other = (
        fit_motion(start, target, UNKNOWNS[:1], begin=let_go, method=method, progress=False)
        for method in ("lbfgs", "gauss_newton")
    )
    assert found.values == pytest.approx(other.values, rel=1e-4)
    assert found.values[0, 0] == pytest.approx(1e6, rel=1e-2)


@pytest.mark.parametrize(
    ("unknowns", "options", "message"),
    [
        ([("wall", "rotation")], {}, "cannot be unknown with method='lbfgs'"),
        (UNKNOWNS, {"method": "newton"}, "method must be 'gauss_newton' or 'lbfgs'"),
    ],
)
def test_what_lbfgs_does_not_go_with_says_what_to_do(unknowns, options, message):
    target = Tags([[(0, 0, 0)]], ["arm.end"], times=[0.1])
    with pytest.raises(ValueError, match=message):
        fit_motion(ringing(), target, unknowns, progress=False, **({"method": "lbfgs"} | options))


@pytest.mark.case("inverse", "Stiffness and damping of a joint from its swing", source="the values of the made data")
@pytest.mark.parametrize("planar", [None, False])
def test_stiffness_and_damping_of_a_joint_are_found_from_how_it_swings(planar):
    def leg(stiffness, damping):
        scene = withe.Scene()
        rubber = withe.Material(youngs_modulus=1e7, density=1000.0)
        thigh = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=rubber)
        shank = scene.add_rod(start=(0.1, 0, 0), end=(0.2, 0, 0), nodes=5, radius=5e-3, material=rubber, name="shank")
        scene.clamp(thigh.start)
        turns = {"axis": (0, 1, 0), "stiffness": stiffness, "rest_angle": 0.4, "damping": damping}
        scene.join(thigh.end, shank.start, "revolute", name="knee", **turns)
        return scene.build(planar=planar, time_step=2e-3)

    true, times, seen = leg(0.3, 3e-4), np.arange(0.02, 0.4, 0.02), []
    for time in times:
        true.run(time - true.time, progress=False)
        seen.append(true.positions("shank")[[2, 4]])
    tags = Tags(np.array(seen), ["shank.node(2)", "shank.end"], times=times)
    found = fit_motion(leg(0.2, 1e-4), tags, [("knee", "stiffness"), ("knee", "damping")], progress=False)
    np.testing.assert_allclose(found.values[0], (0.3, 3e-4), rtol=1e-4)
    assert found.unobservable == ()
