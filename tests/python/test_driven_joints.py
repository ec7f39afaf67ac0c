"""Motors, springs and dampers of revolute joints as users meet them: what is refused, set, read and kept."""

import numpy as np
import pytest

import withe
from gradient_scenes import extrapolated

RUBBER = withe.Material(youngs_modulus=1e7, density=1000.0)
HINGE = {"axis": (0, 1, 0), "stiffness": 0.02, "rest_angle": 0.4, "damping": 1e-4, "moment": 1e-3}


def leg(join=None, **numbers):
    """A thigh that is clamped, and a shank that hangs from its end."""
    scene = withe.Scene()
    parts = {"nodes": 5, "radius": 5e-3, "material": RUBBER}
    thigh = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), name="thigh", **parts)
    shank = scene.add_rod(start=(0.1, 0, 0), end=(0.1, 0, -0.1), name="shank", **parts)
    scene.clamp(thigh.start)
    scene.join(thigh.end, shank.start, **({"kind": "revolute", "name": "knee"} | (join or HINGE) | numbers))
    return scene


def running(**build):
    return leg().build(**({"time_step": 2e-3} | build))


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"stiffness": -1.0}, "stiffness of joint 'knee' must"),
        ({"stiffness": float("nan")}, "stiffness of joint 'knee' must"),
        ({"stiffness": "stiff"}, "stiffness of joint 'knee' must"),
        ({"damping": -0.1}, "damping of joint 'knee' must"),
        ({"rest_angle": float("inf")}, "rest_angle of joint 'knee' must"),
        ({"moment": None}, "moment of joint 'knee' must"),
        ({"kind": "rigid", "axis": None}, "stiffness of joint 'knee' needs kind='revolute'"),
        (
            {"kind": "pinned", "axis": None, "stiffness": 0.0, "rest_angle": 0.0},
            "damping of joint 'knee' needs kind='revolute'",
        ),
    ],
)
def test_what_cannot_drive_a_joint_is_refused(numbers, message):
    with pytest.raises(ValueError, match=message):
        leg(**numbers)


def test_numbers_of_a_joint_are_set_and_read():
    simulation = running()
    for word in ("stiffness", "rest_angle", "damping", "moment"):
        assert simulation.get("knee", word) == HINGE[word]
    assert simulation.joint_angle("knee") == 0.0
    assert simulation.joint_torque("knee") == pytest.approx(0.02 * 0.4 + 1e-3, rel=1e-12)
    simulation.set("knee", rest_angle=-0.2, moment=0.0)
    assert simulation.get("knee", "rest_angle") == -0.2
    assert simulation.get("knee", "damping") == 1e-4
    for wrong in ({"stiffness": -1.0}, {"moment": float("nan")}):
        with pytest.raises(ValueError, match=f"{next(iter(wrong))} of joint 'knee' must"):
            simulation.set("knee", rest_angle=3.0, **wrong)
    assert simulation.get("knee", "rest_angle") == -0.2
    with pytest.raises(ValueError, match="joint 'knee' has no 'angle' to set; it has stiffness, rest_angle, damping"):
        simulation.set("knee", angle=1.0)
    with pytest.raises(ValueError, match="'knee' has no 'angle'; it has stiffness, rest_angle, damping, moment"):
        simulation.get("knee", "angle")


def test_joints_without_an_axis_have_no_angle():
    simulation = leg({"kind": "rigid"}).build()
    for read in (simulation.joint_angle, simulation.joint_rate, simulation.joint_torque):
        with pytest.raises(ValueError, match="joint 'knee' must be revolute to have an angle, got kind rigid"):
            read("knee")
        with pytest.raises(ValueError, match="joint must be a joint, got the rod 'shank'"):
            read("shank")


def test_each_of_several_joints_has_its_own_numbers():
    """In whatever order nodes are joined; rigid ones between them have none."""
    scene = leg()
    foot = scene.add_rod(start=(0.1, 0, -0.1), end=(0.13, 0, -0.1), nodes=3, radius=5e-3, material=RUBBER)
    fin = scene.add_rod(start=(0.05, 0, 0), end=(0.05, 0, 0.05), nodes=3, radius=5e-3, material=RUBBER)
    scene.join(foot.start, scene["shank.end"], "revolute", axis=(0, 1, 0), stiffness=0.3, name="ankle")
    scene.join(scene["thigh"].node(2), fin.start)
    other = scene.add_rod(start=(0.1, 0, 0), end=(0.15, 0, 0.05), nodes=3, radius=5e-3, material=RUBBER)
    scene.join(other.start, scene["thigh.end"], "revolute", axis=(0, -1, 0), stiffness=0.7, name="spur")
    simulation = scene.build()
    assert [simulation.get(name, "stiffness") for name in ("knee", "ankle", "spur")] == [0.02, 0.3, 0.7]
    simulation.set("ankle", rest_angle=0.2)
    assert [simulation.get(name, "rest_angle") for name in ("knee", "ankle", "spur")] == [0.4, 0.2, 0.0]
    simulation.set(gravity=(0, 0, 0))
    simulation.set("knee", rest_angle=0.0, moment=0.0)
    simulation.equilibrium()
    angles = [simulation.joint_angle(name) for name in ("knee", "ankle", "spur")]
    np.testing.assert_allclose(angles, (0.0, 0.2, 0.0), atol=1e-6)


def test_a_snapshot_of_other_joints_is_refused():
    kept = running().snapshot()
    with pytest.raises(ValueError, match="another scene"):
        leg({"kind": "pinned"}).build(time_step=2e-3).restore(kept)


def test_what_is_set_acts_at_once_in_every_scheme():
    for integrator in ("backward_euler", "implicit_midpoint", "energy_momentum", "verlet", "static"):
        step = {"integrator": integrator, "time_step": 1e-5 if integrator == "verlet" else 2e-3}
        simulation, other = running(**step), running(**step)
        simulation.step(1)
        other.step(1)
        simulation.set("knee", moment=5e-3)
        for each in (simulation, other):
            each.step(2)
        assert np.abs(simulation.positions() - other.positions()).max() > 1e-12


def test_fourth_order_takes_no_dampers():
    with pytest.raises(ValueError, match="does not support damping of joints"):
        running(integrator="fourth_order")
    simulation = leg(damping=0.0).build(integrator="fourth_order")
    with pytest.raises(ValueError, match="does not support damping of joints"):
        simulation.set("knee", damping=1.0)
    assert simulation.get("knee", "damping") == 0.0


def test_a_batch_drives_each_of_its_joints():
    batch = leg().build_batch(3, time_step=2e-3)
    rest = [0.0, 0.4, 1.2]
    batch.set("knee", rest_angle=rest)
    batch.step(20)
    angles, rates, torques = batch.joint_angle("knee"), batch.joint_rate("knee"), batch.joint_torque("knee")
    for lane, at in enumerate(rest):
        alone = running()
        alone.set("knee", rest_angle=at)
        alone.step(20)
        seen = (alone.joint_angle("knee"), alone.joint_rate("knee"), alone.joint_torque("knee"))
        assert (angles[lane], rates[lane], torques[lane]) == seen


@pytest.mark.parametrize("planar", [True, False])
def test_gradients_by_what_was_set_while_a_run_went_are_those_of_differences(planar):
    tight = {"solver": withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)}
    simulation = running(planar=planar, **tight)
    start, given = simulation.snapshot(), {"rest_angle": 0.9, "moment": -4e-3}
    weight = np.random.default_rng(3).normal(size=(2, *simulation.positions().shape)) * (1, 0, 1)

    def run(values, **options):
        def act(s):
            if s.time == pytest.approx(0.01):
                s.set("knee", **values)

        simulation.restore(start)
        return simulation.run(0.03, record_every=0.03, progress=False, before_step=act, **options)

    found = run(given, differentiable=True).gradient({"positions": weight}, [("knee", "stiffness")])
    (call,) = found.calls
    assert (call.call, call.target) == ("set", "knee")
    for word, value in given.items():

        def of(h, word=word):
            return (weight * run(given | {word: given[word] + h}).positions()).sum()

        assert call.gradients[word] == pytest.approx(extrapolated(of, 1e-2 * abs(value)), rel=1e-6)
