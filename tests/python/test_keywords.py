"""Wrong arguments of a call raise, with a suggestion of the argument that the user may have meant."""

import copy
import inspect
import pickle
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from simple_scenes import RUBBER, cantilever
from withe.common import keywords
from withe.common.attributes import SIMULATION_WORDS
from withe.common.keywords import keyword_hints

ENDS = {"start": (0, 0, 0), "end": (1, 0, 0), "radius": 0.01}
WRONG = [
    (lambda s, m: s.build(dt=0.01), "build() has no keyword 'dt'; did you mean time_step=?"),
    (lambda s, m: s.build(time_stp=0.01), "build() has no keyword 'time_stp'; did you mean time_step=?"),
    (lambda s, m: s.build_batch(2, dt=0.01), "build() has no keyword 'dt'; did you mean time_step=?"),
    (
        lambda s, m: s.build(tol=1e-6),
        "build() has no keyword 'tol'; did you mean tolerance= or solver=?",
    ),
    (
        lambda s, m: s.add_rod(**ENDS, material=RUBBER, n_elements=20),
        "add_rod() has no keyword 'n_elements'; did you mean nodes=, one more than the edges?",
    ),
    (
        lambda s, m: s.add_rod(**ENDS, material=RUBBER, n_nodes=20),
        "add_rod() has no keyword 'n_nodes'; did you mean nodes=?",
    ),
    (lambda s, m: s.add_rod(**ENDS, nodes=5, E=1e6), "add_rod() has no keyword 'E'; did you mean material=?"),
    (
        lambda s, m: s.add_rod(diameter=0.1),
        "add_rod() has no keyword 'diameter'; did you mean radius=, half of the diameter?",
    ),
    (lambda s, m: s.add_floor(0.0, mu=0.3), "add_floor() has no keyword 'mu'; did you mean friction=?"),
    (lambda s, m: s.clamp("arm.end", nme="x"), "clamp() has no keyword 'nme'; did you mean name=?"),
    (
        lambda s, m: s.add_force("arm.end", F=(0, 0, 1)),
        "add_force() has no keyword 'F'; did you mean force=?",
    ),
    (lambda s, m: withe.Scene(g=9.81), "Scene() has no keyword 'g'; did you mean gravity=?"),
    (
        lambda s, m: withe.Material(E=1e6, rho=1000.0),
        "Material() has no keyword 'E'; did you mean youngs_modulus=?\n"
        "Material() has no keyword 'rho'; did you mean density=?",
    ),
    (lambda s, m: withe.Material(nu=0.5), "Material() has no keyword 'nu'; did you mean poisson_ratio=?"),
    (lambda s, m: withe.Circle(r=0.5), "Circle() has no keyword 'r'; did you mean radius=?"),
    (lambda s, m: m.run(t=1), "run() has no keyword 't'; did you mean duration=?"),
    (lambda s, m: m.step(n=10), "step() has no keyword 'n'; did you mean count=?"),
    (lambda s, m: m.move("wall", pos=(0, 0, 0)), "move() has no keyword 'pos'; did you mean position=?"),
    (lambda s, m: m.plot(foo=3), "plot() has no keyword 'foo'; it has record=, shapes=, theme="),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_an_unknown_keyword_is_refused_with_what_may_have_been_meant(call, message):
    scene, _, simulation = cantilever()
    with pytest.raises(TypeError) as error:
        call(scene, simulation)
    assert str(error.value) == message


BY_POSITION = [
    (
        lambda s, m: s.add_rod((0, 0, 0), (1, 0, 0)),
        "add_rod() takes no arguments by position, got 2: name them, as in add_rod(start=..., end=...)",
    ),
    (
        lambda s, m: s.add_rod((0, 0, 0), (1, 0, 0), start=(0, 0, 0), nodes=5),
        "add_rod() takes no arguments by position, got 2: name them, as in add_rod(end=..., points=...)",
    ),
    (
        lambda s, m: s.build("static"),
        "build() takes no arguments by position, got 1: name them, as in build(integrator=...)",
    ),
    (
        lambda s, m: withe.Material(1e6, 0.5),
        "Material() takes no arguments by position, got 2: name them, as in Material(youngs_modulus=..., "
        "poisson_ratio=...)",
    ),
    (
        lambda s, m: m.run(0.1, 0.01, False),
        "run() takes 2 arguments by position, got 3: name the others, as in run(progress=...)",
    ),
    (
        lambda s, m: m.clamp("arm.end", "edge"),
        "clamp() takes 1 argument by position, got 2: name the others, as in clamp(hold=...)",
    ),
    (lambda s, m: m.step(1, 2), "Simulation.step() takes from 1 to 2 positional arguments but 3 were given"),
    (lambda s, m: m.snapshot(3), "Simulation.snapshot() takes 1 positional argument but 2 were given"),
]


@pytest.mark.parametrize(("call", "message"), BY_POSITION)
def test_what_must_not_be_given_by_position_is_refused_with_how_to_name_it(call, message):
    scene, _, simulation = cantilever()
    with pytest.raises(TypeError) as error:
        call(scene, simulation)
    assert str(error.value) == message


def test_type_errors_of_the_function_itself_pass_through():
    @keyword_hints
    def outer(time_step=1.0):
        return inner(dt=time_step)

    def inner(time_step):
        return time_step

    with pytest.raises(TypeError, match=r"inner\(\) got an unexpected keyword argument 'dt'"):
        outer()
    _, _, simulation = cantilever()
    with pytest.raises(TypeError, match="broken on purpose"):
        simulation.run(0.01, before_step=broken, progress=False)


def broken(simulation):
    raise TypeError("broken on purpose")


MISSING = [
    (lambda s, m: m.run(), "run() is missing duration="),
    (lambda s, m: s.build_batch(time_step=0.01), "build_batch() is missing count="),
    (lambda s, m: s.add_capsule((0, 0, 0)), "add_capsule() is missing end= and radius="),
    (lambda s, m: s.add_tendon(offset=(0.1, 0.0)), "add_tendon() is missing guides="),
    (lambda s, m: s.add_spring("arm.start"), "add_spring() is missing b= and stiffness="),
]


@pytest.mark.parametrize(("call", "message"), MISSING)
def test_a_missing_argument_is_named_without_the_class_that_defines_the_method(call, message):
    scene, _, simulation = cantilever()
    with pytest.raises(TypeError) as error:
        call(scene, simulation)
    assert str(error.value) == message


def test_an_argument_that_is_given_twice_is_explained_by_python():
    _, _, simulation = cantilever()
    with pytest.raises(TypeError, match="multiple values for argument 'duration'"):
        simulation.run(1.0, duration=2.0)


def test_signatures_and_docstrings_stay_in_view():
    assert "time_step" in inspect.signature(withe.Scene.build).parameters
    assert next(iter(inspect.signature(withe.Material).parameters)) == "youngs_modulus"
    assert withe.Simulation.run.__doc__.startswith("Advance by a duration")
    assert withe.Scene.add_rod.__module__ == "withe.scene.scene"


def test_words_of_other_packages_lead_to_words_that_there_are():
    owners = [
        *(withe.Scene, withe.Simulation, withe.Batch, withe.Material, withe.Stiffness),
        *(withe.Circle, withe.Tube, withe.Rectangle, withe.Solver),
    ]
    calls = [withe.view.plot, withe.view.picture, withe.view.animate]
    calls += [each for owner in owners for _, each in inspect.getmembers(owner, inspect.isfunction)]
    there = {word for call in calls for word in inspect.signature(call).parameters}
    offered = {word for words in keywords._ELSEWHERE.values() for word in words}
    offered |= {word for word, _ in keywords._COUNTED_OTHERWISE.values()}
    assert offered - there == set()


def public_functions():
    """Functions and methods of the package that take keywords only, by their names."""
    modules = [
        withe,
        withe.learning,
        withe.folding,
        withe.deployment,
        withe.perception,
        withe.real2sim,
        withe.shapes,
        withe.knots,
    ]
    for module in modules:
        for name in module.__all__:
            try:
                found = getattr(module, name)
            except ImportError:  # it needs an extra that is not installed
                continue
            if inspect.isclass(found):
                own = {n: f for n, f in vars(found).items() if n == "__init__" or not n.startswith("_")}
                yield from ((f"{module.__name__}.{name}.{n}", getattr(f, "__func__", f)) for n, f in own.items())
            else:
                yield f"{module.__name__}.{name}", found


def test_every_function_that_takes_keywords_only_says_so_alike():
    checked = 0
    for name, function in public_functions():
        if not inspect.isfunction(function):
            continue
        parameters = list(inspect.signature(function).parameters.values())
        kinds = [each.kind for each in parameters]
        by_name = kinds.count(inspect.Parameter.KEYWORD_ONLY)
        if not by_name or any(kind in kinds for kind in (inspect.Parameter.VAR_POSITIONAL,)):
            continue
        checked += 1
        with pytest.raises(TypeError) as error:
            function(*range(len(parameters) - by_name + 1 - (inspect.Parameter.VAR_KEYWORD in kinds)))
        assert "by position, got" in str(error.value), name
        assert "as in" in str(error.value), name
    assert checked > 45


WORDS = [
    (lambda: cantilever(integrator="implicit_midpont"), "did you mean 'implicit_midpoint'?"),
    (lambda: cantilever(integrator="Euler"), "did you mean 'backward_euler'?"),
    (lambda: cantilever(solver=withe.Solver(linear_solver="Sparse")), "did you mean 'sparse'?"),
    (lambda: cantilever(bending="tangents"), "did you mean 'tangent'?"),
    (lambda: withe.Scene().enable_contact(friction_model="anchor"), "did you mean 'anchored'?"),
    (lambda: cantilever()[2].positions("arn"), "did you mean 'arm'?"),
    (lambda: cantilever()[2].release("walls"), "did you mean 'wall'?"),
]


@pytest.mark.parametrize(("call", "message"), WORDS)
def test_near_misses_of_words_are_asked_about(call, message):
    with pytest.raises(ValueError, match=r"must be|is not in the scene") as error:
        call()
    assert str(error.value).endswith(message)
    with pytest.raises(ValueError, match="integrator must be") as error:
        cantilever(integrator="zzz")
    assert "did you mean" not in str(error.value)


def test_what_only_a_simulation_has_says_to_build_the_scene_first():
    scene, arm, _ = cantilever()
    for call in (lambda: scene.run(1.0), lambda: scene.equilibrium(), lambda: scene.step(3)):
        with pytest.raises(
            AttributeError, match=r"Scene has no '\w+': build the scene first, simulation = scene.build"
        ):
            call()
    for owner, name in ((arm, "arm"), (scene["wall"], "wall"), (arm.end, "arm.end")):
        message = f"has no 'positions': build the scene first, .* simulation.positions\\('{name}', ...\\)"
        with pytest.raises(AttributeError, match=message):
            _ = owner.positions
    with pytest.raises(
        AttributeError, match=r"Rod 'arm' has no attribute 'tip': use start, end, node\(i\) or edge\(i\)$"
    ):
        _ = arm.tip
    for owner in (scene, arm, arm.end):
        with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
            _ = owner.nonsense
        assert copy.deepcopy(owner) is not None
        assert not hasattr(owner, "__array__")
    assert pickle.loads(pickle.dumps(arm)) == arm
    for word in SIMULATION_WORDS:
        assert hasattr(withe.Simulation, word), word
        assert not hasattr(withe.Scene, word), word


def test_a_rotation_is_a_quaternion_a_rotation_of_scipy_or_a_matrix():
    for seed in range(5):
        turn = Rotation.random(random_state=seed)
        x, y, z, w = turn.as_quat()
        found = []
        for given in (turn, turn.as_matrix(), (w, x, y, z), np.array([-w, -x, -y, -z])):
            _, _, simulation = cantilever(planar=False)
            simulation.move("wall", rotation=given, over=1e-9)
            simulation.step()
            found.append(simulation.get("wall", "rotation"))
        for each in found:
            assert np.allclose(each, turn.as_matrix(), atol=1e-12)
    said = "rotation of support 'wall' must be a quaternion (w, x, y, z), a SciPy Rotation or a matrix of shape (3, 3)"
    for wrong in ((0, 0, 1), 3.0, "up", np.eye(4), Rotation.random(2, random_state=0)):
        with pytest.raises(ValueError, match=re.escape(said)):
            simulation.move("wall", rotation=wrong)
    with pytest.raises(ValueError, match="of length 1, got one of 2"):
        simulation.move("wall", rotation=(2, 0, 0, 0))
