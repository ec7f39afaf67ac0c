"""Old words of the public API: each works, warns once at the user's line, and gives the answer of the new word."""

import io
import sys
import warnings

import numpy as np
import pytest

import withe
from withe.common.deprecation import renamed
from withe.deployment import Cable, Move, Pattern, deploy, place, plan, tie
from withe.folding import Paper, Trial, run_trials

CABLE = Cable(0.3, 1.6e-3, 0.02)
LINE = Pattern(np.stack([np.linspace(0.0, 0.1, 50), np.zeros(50)], 1))
QUICK = {"nodes": 25, "progress": False, "quasi_static": True}


def warned(call, *words):
    """Return the result of a call that must warn once per old word, at the line of the call, and name the new word."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DeprecationWarning)
        found = call()
    told = [each for each in caught if each.category is DeprecationWarning]
    assert [each.filename for each in told] == [__file__] * len(words)
    for word, each in zip(words, told, strict=True):
        assert f"use {word}" in str(each.message)
    return found


@pytest.fixture(scope="module")
def motion():
    return plan(CABLE, LINE, speed=0.06)


@pytest.mark.parametrize("call", [deploy, place])
def test_floor_of_deployments_is_friction(motion, call):
    old = warned(lambda: call(motion, floor=0.5, **QUICK), "friction=")
    assert np.array_equal(old.laid, call(motion, friction=0.5, **QUICK).laid)


def test_floor_of_knots_is_friction(motion):
    steps = [[Move(0, 0.0, [(0.0, 0.03, 0.03)])]]
    old = warned(lambda: tie([motion], steps, floor=0.8, nodes=25, time_step=0.05), "friction=")
    new = tie([motion], steps, friction=0.8, nodes=25, time_step=0.05)
    assert np.array_equal(old.shapes[-1], new.shapes[-1])


def test_processes_of_trials_are_workers():
    trial = Trial("no fold", Paper.a4(), "middle")
    with pytest.raises(ValueError, match="workers must lie in"):
        warned(lambda: run_trials([trial], processes=0), "workers=")
    assert list(warned(lambda: run_trials([], processes=1, progress=False), "workers=")) == []


def scene_of_an_arm():
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=6, radius=5e-3, material=rubber, name="arm")
    scene.clamp(arm.start)
    return scene


def test_n_of_batches_is_count():
    old = warned(lambda: scene_of_an_arm().build_batch(n=3), "count=")
    assert len(old) == len(scene_of_an_arm().build_batch(count=3)) == 3


def test_progress_always_draws_and_is_a_boolean(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    record = warned(lambda: scene_of_an_arm().build().run(0.02, progress="always"), "progress=True")
    assert "100 %" in stream.getvalue()
    new = scene_of_an_arm().build().run(0.02, progress=True)
    assert np.array_equal(record.positions("arm"), new.positions("arm"))


def test_plans_have_names_of_their_own():
    assert warned(lambda: withe.folding.Plan, "withe.folding.FoldPlan") is withe.folding.FoldPlan
    assert warned(lambda: withe.deployment.Plan, "withe.deployment.LayPlan") is withe.deployment.LayPlan
    assert isinstance(scene_of_an_arm().build().plan, withe.Plan)
    with pytest.raises(AttributeError, match=r"module 'withe\.folding' has no attribute 'Plans'"):
        _ = withe.folding.Plans


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        (withe.shapes, withe.knots, ["granny_knot", "overhand_knot", "reef_knot"]),
        (withe.real2sim, withe.perception, ["TagDetection", "detect_tags"]),
    ],
)
def test_knots_and_tags_have_one_module_each(old, new, names):
    for name in names:
        assert warned(lambda name=name: getattr(old, name), f"{new.__name__}.{name}") is getattr(new, name)
        assert name not in old.__all__
        assert name in new.__all__


def test_controller_of_a_plan_is_method():
    old = warned(lambda: plan(CABLE, LINE, controller="least_friction"), "method=")
    new = plan(CABLE, LINE, method="least_friction")
    assert np.array_equal(old.path, new.path)
    assert warned(lambda: old.controller, "LayPlan.method") == new.method == "least_friction"
    found = warned(lambda: LINE.feasibility(CABLE, 0.5, controller="exact"), "method=")
    assert np.array_equal(found.needed, LINE.feasibility(CABLE, 0.5, method="exact").needed)


def test_time_step_of_a_plan_is_its_sampling_interval():
    old = warned(lambda: plan(CABLE, LINE, time_step=0.05), "sampling_interval=")
    new = plan(CABLE, LINE, sampling_interval=0.05)
    assert np.array_equal(old.path, new.path)
    assert len(new.times) < len(plan(CABLE, LINE).times)


def test_an_old_and_a_new_word_together_are_refused(motion):
    with pytest.raises(TypeError, match=r"deploy\(\) got floor= and friction=, which is its new name: give one"):
        deploy(motion, floor=0.5, friction=0.5)


def test_hints_know_the_new_words_only(motion):
    with pytest.raises(TypeError, match=r"deploy\(\) has no keyword 'mu'; did you mean friction="):
        deploy(motion, mu=0.5)


def test_a_type_error_within_a_renamed_function_passes_through():
    @renamed(old="new")
    def fails(*, new):
        return len(new)

    with pytest.raises(TypeError, match="has no len"):
        fails(new=3)


OLD_OPTIONS = [
    ("mixed", False),
    ("step_tolerance", 1e-6),
    ("force_tolerance", 1e-5),
    ("max_iterations", 7),
    ("max_halvings", 3),
]


@pytest.mark.parametrize(("word", "value"), OLD_OPTIONS)
def test_options_of_the_solver_are_fields_of_one_value(word, value):
    old = warned(lambda: scene_of_an_arm().build(**{word: value}), f"solver=withe.Solver({word}={value!r})")
    new = scene_of_an_arm().build(solver=withe.Solver(**{word: value}))
    for simulation in (old, new):
        simulation.step(5)
    assert np.array_equal(old.positions("arm"), new.positions("arm"))
    assert old._session.options == new._session.options != scene_of_an_arm().build()._session.options


def test_solver_as_a_word_is_its_linear_solver():
    new = "solver=withe.Solver(linear_solver='sparse', max_halvings=3)"
    old = warned(lambda: scene_of_an_arm().build(solver="sparse", max_halvings=3), new)
    assert "sparse" in old.plan.solver
    assert "band" in scene_of_an_arm().build(solver=withe.Solver(linear_solver="band")).plan.solver


def test_options_of_the_solver_pass_through_batches():
    old = warned(
        lambda: scene_of_an_arm().build_batch(2, max_steps=10, tolerance=1e-3), "solver=withe.Solver(max_steps=10)"
    )
    new = scene_of_an_arm().build_batch(2, solver=withe.Solver(max_steps=10), tolerance=1e-3)
    assert old[1]._session.options == new[1]._session.options


def test_a_solver_beside_one_of_its_fields_is_refused():
    with pytest.raises(
        TypeError, match=r"build\(\) got mixed= and solver=, of which they are fields: give solver= only"
    ):
        scene_of_an_arm().build(mixed=False, solver=withe.Solver())


def test_a_solver_is_a_value_that_is_checked():
    assert withe.Solver(max_iterations=7) == withe.Solver(max_iterations=7) != withe.Solver()
    with pytest.raises(ValueError, match=r"max_iterations must lie in 1\.\.10000, got 0"):
        withe.Solver(max_iterations=0)
    with pytest.raises(ValueError, match=r"solver must be a withe\.Solver, got dict"):
        scene_of_an_arm().build(solver={})
    with pytest.raises(TypeError, match=r"build\(\) has no keyword 'rtol'"):
        scene_of_an_arm().build(rtol=1e-9)
    with pytest.raises(TypeError, match=r"build\(\) has no keyword 'max_iter'; did you mean solver="):
        scene_of_an_arm().build(max_iter=9)
