"""The code of README.md and of the pages in docs runs as it stands there, without a warning."""

import logging
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import withe
from cable_films import crossing_film, mask_of
from rendered_boards import pictures
from soft_limb import LOG
from two_views import VIEWS, curve
from withe.perception import Chessboard
from withe.perception.synthetic import make_case, render
from withe.view.graphics import probe_rendering

ROOT = Path(__file__).resolve().parent.parent.parent
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    if "generated" not in path.parts and "```python" in path.read_text()
)
# Names that a page begins with, changes that make its blocks quick, and checks of what it ends with.
CONTEXT, SHORTER, CHECKS = {}, {}, {}


def before(page):
    def register(function):
        CONTEXT[page] = function
        return function

    return register


def after(page):
    def register(function):
        CHECKS[page] = function
        return function

    return register


@pytest.mark.filterwarnings("error")
@pytest.mark.filterwarnings("ignore::DeprecationWarning:.*(gymnasium|torch|stable_baselines3).*")
@pytest.mark.parametrize("page", PAGES)
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "page", **CONTEXT.get(page, dict)()}
    for name, content in re.findall(r"```toml\n# (\S+)\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
        Path(name).write_text(content)
    for block in re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
        for old, new in SHORTER.get(page, {}).items():
            block = block.replace(old, new)
        exec(compile(block, page, "exec"), names)
    CHECKS.get(page, lambda names: None)(names)


def test_no_page_is_named_that_is_not_there():
    assert {*CONTEXT, *SHORTER, *CHECKS} <= set(PAGES)


@after("README.md")
def fingers_curl(names):
    assert Path("gripper.png").stat().st_size > 10_000
    assert withe.Record.load("gripper.npz").times[-1] == names["simulation"].time == 1.0
    tips = np.array([names["record"].positions(finger)[:, -1, :2] for finger in names["simulation"].rods[1:]])
    first, last = (np.linalg.norm(tips[:, frame], axis=-1) for frame in (0, -1))
    np.testing.assert_allclose(first, 0.06, rtol=1e-3)
    assert np.all(last < 0.5 * first)


@before("docs/how_to/robots_from_files.md")
def mujoco_reads_robots():
    pytest.importorskip("mujoco")
    return {}


@after("docs/how_to/robots_from_files.md")
def an_elbow_turns(names):
    arm, simulation = names["arm"], names["simulation"]
    assert simulation.joint_angle(arm["elbow"]) == pytest.approx(-0.8, abs=0.1)
    assert arm["gripper"] == arm["forearm"]


@after("docs/how_to/touch.md")
def a_knot_is_pulled_tight(names):
    contacts, pull = names["simulation"].contacts(), names["simulation"].reaction(names["grips"][1]).force[0]
    assert len(contacts) > 3
    assert contacts["gap"].min() > -0.05 * 4e-3
    bending = 2e6 * np.pi * 4e-3**4 / 4.0
    assert pull > 5.5e-3 * bending / 4e-3**2  # what the knot takes without friction, at e / h = 75


SHORTER["docs/how_to/hold.md"] = {"hand.release()": "force = hand.wrench().force"}


@after("docs/how_to/hold.md")
def a_hand_lifts_a_rope(names):
    weight = 9.81 * 700.0 * np.pi * 6e-3**2 * 0.9
    assert 0.3 * weight < names["force"][2] < weight
    assert names["simulation"].positions(names["rope"])[:, 2].max() == pytest.approx(0.3, abs=1e-6)


@after("docs/how_to/derivatives.md")
def gradients_have_their_shapes(names):
    assert names["by_curvature"].shape == (3, 19, 2)
    assert names["by_gravity"][2] > 0.0
    assert names["by_modulus"] > 0.0
    assert names["by_start"].shape == (21, 3)


@after("docs/how_to/convergence.md")
def the_solver_is_silent_again(names):
    assert names["found"].stable
    logging.getLogger("withe").setLevel(logging.NOTSET)


@before("docs/how_to/trace.md")
def a_picture_of_two_cables():
    cv2 = pytest.importorskip("cv2")
    case = make_case("crossing 60", 1)
    cv2.imwrite("cables.jpg", render(case, np.random.default_rng(0))[..., ::-1])
    Path("boards").mkdir()
    for number, board in enumerate(pictures(Chessboard(9, 6, 0.03), 4)):
        cv2.imwrite(f"boards/{number}.png", board)
    for number, camera in enumerate(VIEWS):
        cv2.imwrite(f"view_{number}.png", np.uint8(200) * mask_of([camera.project(curve(5))]))
    writer = cv2.VideoWriter("cables.avi", cv2.VideoWriter_fourcc(*"MJPG"), 30.0, (896, 672))
    for mask in crossing_film(201, frames=60).masks():
        writer.write(np.repeat(np.uint8(200) * mask[..., None], 3, axis=2))
    writer.release()
    return {"cameras": VIEWS}


@after("docs/how_to/trace.md")
def cables_become_rods(names):
    assert len(names["tracing"]) == 2
    assert names["lens"].reprojection_error < 0.2
    assert names["found"].length == pytest.approx(0.65, abs=0.01)
    assert [cable.name for cable in names["cables"]] == ["red", "blue"]
    assert names["tracker"].time is None
    (rod,) = names["scene"].build().rods
    assert rod.nodes == 101


@before("docs/how_to/fit.md")
def an_arm_and_its_log():
    Path("log.csv").write_text("\n".join(LOG.read_text().splitlines()[:30]))
    scene = withe.Scene()
    silicone = withe.Material(youngs_modulus=1.793e6, density=1240.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.15, 0, 0), nodes=49, radius=0.01, material=silicone)
    scene.clamp(arm.start, hold="edge")
    pixels = withe.real2sim.read_log("log.csv", tags=range(101, 110), skip=7).pixels
    tracing = SimpleNamespace(centrelines=[pixels[10]])
    return {"withe": withe, "arm": arm, "simulation": scene.build(integrator="static"), "tracing": tracing}


@after("docs/how_to/fit.md")
def an_arm_is_fitted(names):
    assert names["found"].converged.all()
    assert names["found"].rms.max() < 5.4  # pixels: 1 % of the length, with one arm for two limbs
    assert names["simulation"].get(names["arm"], "natural_curvature").any()


SHORTER["docs/how_to/lay.md"] = {"(motion, friction=0.4)": "(motion, friction=0.4, nodes=50, progress=False)"}


@after("docs/how_to/lay.md")
def a_cable_is_laid(names):
    assert Path("motion.csv").stat().st_size > 1000
    assert names["found"].error < 2e-3


SHORTER["docs/how_to/many_robots.md"] = {"20_000": "256"}


@before("docs/how_to/many_robots.md")
def learning_is_installed():
    pytest.importorskip("stable_baselines3")
    return {}


@after("docs/how_to/many_robots.md")
def robots_learn(names):
    assert names["seen"].shape == (100, 6)
    assert np.all(names["rewards"] < 0.0)
    assert names["policy"].predict(names["seen"][0])[0].shape == (2,)


@before("docs/how_to/view.md")
def views_are_drawn_into_memory():
    pyvista = pytest.importorskip("pyvista")
    try:
        probe_rendering()
    except RuntimeError as error:
        pytest.skip(str(error))
    before, pyvista.OFF_SCREEN = pyvista.OFF_SCREEN, True
    return {"off_screen_before": before}


@after("docs/how_to/view.md")
def a_cord_bends_its_arm(names):
    assert names["simulation"].get(names["cord"], "tension") == 1.0
    assert names["simulation"].positions(names["arm"])[-1, 0] > 0.02
    assert Path("finger.png").stat().st_size > 5_000
    pytest.importorskip("pyvista").OFF_SCREEN = names["off_screen_before"]


def test_every_error_and_warning_is_explained():
    text = (ROOT / "docs/how_to/convergence.md").read_text()
    overview, *remedies = text.split("\n## ")
    for name in withe.errors.__all__:
        assert f"| `{name}` |" in overview
        assert any(f"`{name}`" in remedy for remedy in remedies), name


def test_the_readme_is_one_page_whose_links_lead_to_files():
    text = (ROOT / "README.md").read_text()
    assert len(text.split()) <= 900
    links = [link for link in re.findall(r"\]\(([^)]+)\)", text) if "://" not in link]
    assert len(links) > 15
    assert [link for link in links if not (ROOT / link).exists()] == []
