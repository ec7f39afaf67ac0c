"""The code of README.md runs as it stands there."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import withe
from soft_limb import LOG
from withe.perception.synthetic import make_case, render

README = Path(__file__).resolve().parent.parent.parent / "README.md"


def blocks(with_word):
    """Code of the sections in which a word occurs."""
    found = [
        block
        for section in README.read_text().split("\n## ")
        for block in re.findall(r"```python\n(.*?)```", section, re.DOTALL)
        if with_word in section
    ]
    assert found
    return found


def test_the_robot_of_the_readme_curls_its_fingers(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks("gripper.npz"):
        exec(compile(block, str(README), "exec"), names)
    assert (tmp_path / "gripper.png").stat().st_size > 10_000
    assert withe.Record.load("gripper.npz").times[-1] == names["simulation"].time == 1.0
    tips = np.array([names["record"].positions(finger)[:, -1, :2] for finger in names["simulation"].rods[1:]])
    first, last = (np.linalg.norm(tips[:, frame], axis=-1) for frame in (0, -1))
    np.testing.assert_allclose(first, 0.06, rtol=1e-3)
    assert np.all(last < 0.5 * first)


def test_the_knot_of_the_readme_is_pulled_tight():
    names = {}
    for block in blocks("overhand_knot"):
        exec(compile(block, str(README), "exec"), names)
    contacts, pull = names["simulation"].contacts(), names["simulation"].reaction(names["grips"][1]).force[0]
    assert len(contacts) > 3
    assert contacts["gap"].min() > -0.05 * 4e-3
    bending = 2e6 * np.pi * 4e-3**4 / 4.0
    assert pull > 5.5e-3 * bending / 4e-3**2  # what the knot takes without friction, at e / h = 75


def test_the_hand_of_the_readme_lifts_the_rope():
    names = {}
    for block in blocks("simulation.grasp"):
        names.clear()
        exec(compile(block.replace("hand.release()", "force = hand.wrench().force"), str(README), "exec"), names)
    weight = 9.81 * 700.0 * np.pi * 6e-3**2 * 0.9
    assert 0.3 * weight < names["force"][2] < weight
    assert names["simulation"].positions(names["rope"])[:, 2].max() == pytest.approx(0.3, abs=1e-6)


def test_gradients_of_the_readme_have_the_shapes_that_it_says():
    names = {}
    for block in blocks("differentiable=True"):
        exec(compile(block, str(README), "exec"), names)
    assert names["by_curvature"].shape == (3, 19, 2)
    assert names["by_gravity"][2] > 0.0
    assert names["by_modulus"] > 0.0
    assert names["by_start"].shape == (21, 3)


def test_cables_of_a_picture_become_rods(tmp_path, monkeypatch):
    cv2 = pytest.importorskip("cv2")
    monkeypatch.chdir(tmp_path)
    case = make_case("crossing 60", 1)
    cv2.imwrite("cables.jpg", render(case, np.random.default_rng(0))[..., ::-1])
    names = {}
    for block in blocks("withe.perception.trace"):
        exec(compile(block, str(README), "exec"), names)
    assert len(names["tracing"]) == 2
    (rod,) = names["scene"].build().rods
    assert rod.nodes == 101


def test_what_a_camera_saw_of_an_arm_is_explained(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = LOG.read_text().splitlines()
    Path("log.csv").write_text("\n".join(rows[:30]))
    scene = withe.Scene()
    silicone = withe.Material(youngs_modulus=1.793e6, density=1240.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.15, 0, 0), nodes=49, radius=0.01, material=silicone)
    scene.clamp(arm.start, hold="edge")
    pixels = withe.real2sim.read_log("log.csv", tags=range(101, 110), skip=7).pixels
    names = {"withe": withe, "arm": arm, "simulation": scene.build(integrator="static")}
    names["tracing"] = SimpleNamespace(centrelines=[pixels[10]])
    for block in blocks("read_log"):
        exec(compile(block, str(README), "exec"), names)
    assert names["found"].converged.all()
    assert names["found"].rms.max() < 5.4  # pixels: 1 % of the length, with one arm for two limbs
    assert names["simulation"].get(arm, "natural_curvature").any()


def test_the_cable_of_the_readme_is_laid(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks("deployment.plan"):
        assert "(motion, friction=0.4)" in block
        short = block.replace("(motion, friction=0.4)", "(motion, friction=0.4, nodes=50, progress=False)")
        exec(compile(short, str(README), "exec"), names)
    assert (tmp_path / "motion.csv").stat().st_size > 1000
    assert names["found"].error < 2e-3


@pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning")
def test_the_robots_of_the_readme_learn():
    pytest.importorskip("stable_baselines3")
    names = {"__name__": "readme"}
    (block,) = blocks("class Touch")
    exec(compile(block.replace("20_000", "256"), str(README), "exec"), names)
    assert names["seen"].shape == (100, 6)
    assert np.all(names["rewards"] < 0.0)
    assert names["policy"].predict(names["seen"][0])[0].shape == (2,)
