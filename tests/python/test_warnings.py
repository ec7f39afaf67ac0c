"""Warnings: numbers that point to a slip, whose line a warning names, and how often it comes."""

import re
import runpy
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER
from withe.common.user_warnings import each_cause_once, warn

STEEL = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0)


def caught_of(call, category=withe.PlausibilityWarning):
    """Messages of a category that a call gives."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught if each.category is category]


def first_clause(message):
    return re.split(r"[,:;(](?=\s)", message)[0]


def arm(material=RUBBER, length=0.3, radius=5e-3, gravity=-9.81, build=True, **options):
    scene = withe.Scene(gravity=(0, 0, gravity))
    rod = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=11, radius=radius, material=material, name="arm")
    scene.clamp(rod.start, name="wall")
    return scene.build(**options) if build else (scene, rod)


def material(**numbers):
    return withe.Material(**({"youngs_modulus": 1e6, "density": 1000.0} | numbers))


def add_tendon(offset, tension=0.0, radius=5e-3):
    scene, rod = arm(build=False, radius=radius)
    scene.add_tendon(rod, offset=offset, tension=tension)


def stub():
    """A short hub, thicker than long, that an arm is joined to."""
    scene, rod = arm(build=False)
    hub = scene.add_rod(start=(0.3, 0, 0), end=(0.302, 0, 0), nodes=2, radius=5e-3, material=RUBBER)
    scene.join(rod.end, hub.start)
    return scene


def can(**options):
    scene = withe.Scene()
    scene.add_floor()
    scene.add_body(withe.solids.Cylinder(0.03, 0.1), density=1000, position=(0, 0, 0.05), name="can", **options)
    return scene


def joint(rest_angle):
    scene, rod = arm(build=False)
    other = scene.add_rod(start=(0.3, 0, 0), end=(0.5, 0, 0), nodes=6, radius=5e-3, material=RUBBER)
    scene.join(rod.end, other.start, "revolute", axis=(0, 1, 0), stiffness=1.0, rest_angle=rest_angle, name="knee")
    return scene


def set_rest_angle(angle):
    joint(0.0).build().set("knee", rest_angle=angle)


def turn(angle):
    arm(planar=False).move("wall", roll=angle, over=10.0)


# The input, the number that the warning names, and the slip of the user.
SLIPS = {
    "length": (lambda: arm(length=300.0), "300 m long at a radius of 5 mm", "millimetres"),
    "light": (lambda: arm(material(density=1.2)), r"density of rod 'arm' is 1\.2 kg/m\^3", r"g/cm\^3"),
    "heavy": (lambda: arm(material(density=1.1e6)), r"density of rod 'arm' is 1\.1e\+06 kg/m\^3", r"kg/m\^3"),
    "soft": (lambda: arm(material(youngs_modulus=1.0)), "youngs_modulus of rod 'arm' is 1 Pa", "MPa"),
    "soft without gravity": (lambda: arm(material(youngs_modulus=2.0), gravity=0.0), "is 2 Pa", "MPa"),
    "offset": (lambda: add_tendon((6.0, 0.0)), r"offset of tendon 'tendon 1' is 6 m, 1\.2e\+03 radii", "millimetres"),
    "wide offset": (lambda: add_tendon((0.0, 0.1)), r"offset of tendon 'tendon 1' is 0\.1 m, 20 radii", "in metres"),
    "thickness": (lambda: arm(length=0.1, radius=0.06), "0.12 m thick and 0.1 m long", "radius in metres"),
    "no offset": (lambda: add_tendon((0.0, 0.0), 1.0), "offset of tendon 'tendon 1' is zero", "bends nothing"),
    "rest angle": (lambda: joint(-45.0), "rest_angle of joint 'knee' is -45 rad", "degrees"),
    "set rest angle": (lambda: set_rest_angle(90.0), "rest_angle of joint 'knee' is 90 rad", "degrees"),
    "roll": (lambda: turn(180.0), "roll of support 'wall' is 180 rad", "degrees"),
    "cylinder": (lambda: can().build(), "body 'can' is a cylinder, which touches nothing", "capsule or hull"),
    "time step": (lambda: arm(STEEL, time_step=5.0), "time_step is 5 s, longer than the slowest period", "in seconds"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_warned_of_once_with_the_number_and_what_it_may_be(slip):
    call, number, likely = SLIPS[slip]
    found = caught_of(call)
    assert len(found) == 1, found
    assert re.search(number, found[0])
    assert re.search(likely, found[0])
    assert len(first_clause(found[0]).split()) <= 12


@pytest.mark.parametrize(
    "call",
    [
        lambda: arm(length=300.0, radius=0.02),  # a cable in the sea
        lambda: arm(material(density=1e-3), gravity=0.0),  # next to no mass, on purpose
        lambda: arm(material(youngs_modulus=50.0), length=1e-3, radius=1e-4),  # a scaled model that bears its weight
        lambda: add_tendon((0.0, 0.0)),
        lambda: add_tendon((0.03, 0.0), radius=1e-3),  # disks along a thin backbone
        lambda: add_tendon((0.039, 0.0)),
        lambda: arm(length=0.1, radius=0.049),
        lambda: stub().build(),
        lambda: can(touches=False).build(),
        lambda: joint(4.0 * np.pi),
        lambda: turn(40.0 * np.pi),
        lambda: turn(9.0),
        lambda: arm(STEEL, length=0.1),  # stiff for the time step by default
        lambda: arm(STEEL, integrator="static", time_step=5.0),
    ],
)
def test_what_is_meant_so_is_not_warned_of(call):
    assert caught_of(call) == []


def test_usual_scenes_of_any_size_and_stuff_are_not_warned_of():
    generator = np.random.default_rng(5)
    for _ in range(40):
        length = 10.0 ** generator.uniform(-4, 1.5)
        stuff = withe.Material(
            youngs_modulus=10.0 ** generator.uniform(3.5, 12.0),
            poisson_ratio=generator.uniform(0.0, 0.5),
            density=10.0 ** generator.uniform(1.5, 4.3),
        )
        radius = length * 10.0 ** generator.uniform(-3, -1.2)
        scene, rod = arm(stuff, length, radius, build=False)
        scene.add_tendon(rod, offset=radius * generator.uniform(0.5, 5.0, 2), tension=1e-6)
        period = 2.0 * np.pi * length**2 / 3.516 * np.sqrt(stuff.density / stuff.youngs_modulus) * 2.0 / radius
        assert caught_of(lambda scene=scene, period=period: scene.build(time_step=period * 0.5)) == []


def test_a_step_of_which_nothing_is_resolved_is_told_from_one_of_some_periods():
    """The first period of a cantilever: 2 pi L^2 sqrt(rho A / (E I)) / 3.516."""
    period = 2.0 * np.pi * 0.09 / 3.516 * np.sqrt(7850.0 / 2e11) * 2.0 / 5e-3
    assert caught_of(lambda: arm(STEEL, time_step=8.0 * period)) == []
    (found,) = caught_of(lambda: arm(STEEL, time_step=12.0 * period))
    assert float(re.search(r"period of ([\d.e-]+) s", found)[1]) == pytest.approx(period, rel=0.05)
    assert caught_of(lambda: free_rod(12.0 * period)) == []  # it flies: there is no slowest period


def free_rod(time_step):
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=11, radius=5e-3, material=STEEL)
    return scene.build(time_step=time_step)


def test_a_warning_is_located_in_the_file_of_the_user_also_where_a_package_calls_withe(tmp_path, monkeypatch):
    """A package, as are gymnasium and stable-baselines3, stands in a library's folder and is called by the user."""
    packages = next(Path(p) for p in sys.path if p.endswith("site-packages"))
    code = compile("def call(function):\n    return function()\n", str(packages / "trainer" / "loop.py"), "exec")
    trainer = {"__name__": "trainer.loop"}
    exec(code, trainer)
    script = tmp_path / "mine.py"
    script.write_text("import withe\n\n\ndef go(call, function):\n    call(function)\n")
    go = runpy.run_path(str(script))["go"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        go(trainer["call"], FROM_A_PACKAGE["build"])
    (found,) = [each for each in caught if each.category is withe.PlausibilityWarning]
    assert (found.filename, found.lineno) == (str(script), 5)


# A function of a package too: what it calls is located where the user called the package.
FROM_A_PACKAGE = {"__name__": "trainer.scenes", "withe": withe, "arm": arm, "material": material}
exec(
    compile(
        "def build():\n"
        "    withe.Scene().add_rod(start=(0, 0, 0), end=(300, 0, 0), nodes=11, radius=5e-3, material=material())\n",
        next(p for p in sys.path if p.endswith("site-packages")) + "/trainer/scenes.py",
        "exec",
    ),
    FROM_A_PACKAGE,
)


def test_a_run_in_threads_is_warned_of_where_it_was_started():
    simulations = [coarse() for _ in range(2)]
    with pytest.warns(withe.CoarseStepWarning) as caught:
        withe.run_many(simulations, 0.4, workers=2, progress=False)
    assert {each.filename for each in caught} == {__file__}


def coarse():
    """A cantilever that is plucked, in steps too long for its swing."""
    simulation = arm(material(youngs_modulus=1e9), gravity=0.0, time_step=0.02)
    simulation.set_velocities("arm", np.linspace(0, 1, 11)[:, None] ** 2 * (0, 0, 1.0))
    return simulation


def test_the_first_clause_of_the_engine_s_warnings_says_what_is_wrong():
    found = caught_of(lambda: coarse().step(40), withe.CoarseStepWarning)
    found += caught_of(lambda: folded().equilibrium(), withe.CoarseMeshWarning)
    found += caught_of(lambda: deep_beam().equilibrium(), withe.OutOfPlaneWarning)
    assert len(found) == 3
    for message in found:
        assert len(first_clause(message).split()) <= 12, message


def folded():
    simulation = arm(gravity=0.0, integrator="static")
    simulation.set("arm", natural_curvature=(0.0, 78.0))
    return simulation


def deep_beam():
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(
        start=(0, 0, 0),
        end=(0.5, 0, 0),
        nodes=21,
        section=withe.Rectangle(1e-2, 5e-4),
        normal=(0, 0, 1),
        material=RUBBER,
    )
    scene.clamp(rod.start)
    scene.add_force(rod.end, (0, 0, -2e-4))
    return scene.build(integrator="static")


def test_each_cause_is_reported_once_within_a_set_of_causes():
    def three():
        heard = set()
        for cause in ("a", "b", "a"):
            with each_cause_once(heard):
                warn(f"cause {cause}", cause=cause)

    assert caught_of(three, UserWarning) == ["cause a", "cause b"]


class Drawn(withe.learning.Task):
    """A plucked arm, whose steps are too long; its length is drawn."""

    control_step = 0.4
    steps = 2

    def build(self, generator):
        simulation = coarse()
        self.length = generator.uniform()
        return simulation

    def act(self, robots, actions, chosen):
        pass

    def observe(self, robots):
        return robots.positions("arm")[:, -1]

    def reward(self, robots):
        return np.zeros(len(robots))


class Redrawn(Drawn):
    redraw = True


def test_a_task_that_draws_one_robot_for_all_is_warned_of():
    pytest.importorskip("gymnasium")
    (found,) = caught_of(lambda: withe.learning.VectorEnvironment(Drawn(), 3))
    assert first_clause(found) == "Drawn.build draws random numbers"
    assert "redraw = True" in found
    assert caught_of(lambda: withe.learning.VectorEnvironment(Redrawn(), 3)) == []


def test_a_cause_is_reported_once_in_a_training_run_of_many_robots_and_scenes():
    pytest.importorskip("gymnasium")

    def train():
        environments = [withe.learning.Environment(Redrawn()) for _ in range(3)]
        for each in environments:
            for episode in range(2):
                each.reset(seed=episode)
                each.step([0.0])

    assert len(caught_of(train, withe.CoarseStepWarning)) == 1
    assert len(caught_of(train, withe.CoarseStepWarning)) == 1  # another run
