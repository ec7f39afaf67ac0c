"""Plans carried out in the rod engine, which knows nothing of how they were made."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.deployment import Cable, Pattern, deploy, deploying, place, plan, trial_cable
from withe.deployment.pattern import distances
from withe.deployment.world import Setup, lay
from withe.perception import trace
from withe.perception.synthetic import render_mask

PATTERNS = Path(__file__).resolve().parents[1] / "data" / "patterns"
CABLE = Cable(0.36, 1.6e-3, 0.02)  # short and soft, so that little is simulated
NODES = 60


def bend(turned, radius=0.06, straight=0.06):
    """A straight piece, then an arc into which it runs smoothly."""
    s = np.linspace(0.0, 0.2, 200)
    share = np.clip((s - straight) / 0.05, 0.0, 1.0)
    curvature = turned / radius * share**2 * (3 - 2 * share)
    heading = np.concatenate([[0.0], np.cumsum(0.5 * (curvature[1:] + curvature[:-1]) * np.diff(s))])
    steps = 0.5 * (np.cos(heading[1:]) + np.cos(heading[:-1])), 0.5 * (np.sin(heading[1:]) + np.sin(heading[:-1]))
    return np.concatenate([[[0.0, 0.0]], np.cumsum(np.stack(steps, 1) * s[1], axis=0)])


@pytest.fixture(scope="module")
def arc():
    return Pattern(bend(1.0), smoothing=3e-4)


@pytest.fixture(scope="module")
def laid(arc):
    return deploy(plan(CABLE, arc, speed=0.04), friction=0.6, nodes=NODES, progress=False)


def test_a_bend_is_laid_within_a_millimetre(laid):
    assert laid.error < 1e-3
    assert laid.nearest_error <= laid.error + 3e-4
    np.testing.assert_allclose(laid.laid[:, 2], CABLE.radius, rtol=0.03)  # it lies
    assert laid.slipped.max() < 3e-3
    assert laid.record.positions("cable").shape[1:] == (NODES, 3)


PIXEL = 5e-4  # [m]


def photographed(points, width, seed=2):
    """A picture from above of a line on a plain table, x to the right and y upwards, and where its corner is [m]."""
    corner = np.array([points[:, 0].min() - 0.03, points[:, 1].max() + 0.03])
    line = (points[:, :2] - corner) * [1.0, -1.0] / PIXEL
    columns, rows = np.ceil(line.max(0) + 60).astype(int)
    mask = render_mask([line], [width / PIXEL], [False], (rows, columns))
    noise = np.random.default_rng(seed).normal(0.0, 5.0, (rows, columns, 3))
    image = np.where(mask[..., None], (190, 60, 60), (230, 230, 235)) + noise
    return np.clip(image, 0, 255).astype(np.uint8), corner


def read_back(points):
    """Centreline that perception finds in a picture of the cable."""
    image, corner = photographed(points, 2.0 * CABLE.radius)
    (seen,) = trace(image).centrelines
    return corner + PIXEL * seen * [1.0, -1.0]


def test_a_camera_above_reads_what_the_nodes_say(laid):
    seen, nodes = read_back(laid.laid), laid.laid[:, :2]
    assert distances(nodes, seen).max() < 1e-3
    assert distances(seen, nodes).max() < 1e-3


def test_a_drawing_is_photographed_traced_laid_and_read_back():
    drawn = bend(1.0) + np.array([0.2, -0.1])
    image, corner = photographed(drawn, 4e-3)
    pattern = Pattern(image=image, scale=PIXEL)  # from the left upper corner; it may begin at either end
    motion = plan(CABLE, pattern)
    found = deploy(motion, friction=0.6, nodes=NODES, quasi_static=True, progress=False)
    s = np.linspace(0.0, motion.cable.length, NODES)
    away = distances(drawn, corner + read_back(found.laid[s <= pattern.length + 5e-3]))
    assert away.mean() < 2e-3
    assert away.max() < 6e-3


def test_the_intuitive_way_is_worse(arc, laid):
    guessed = deploy(plan(CABLE, arc, "intuitive", speed=0.04), friction=0.6, nodes=NODES, progress=False)
    assert guessed.error > 4 * laid.error


def test_noise_is_drawn_from_the_seed(arc):
    motion = plan(CABLE, Pattern(bend(0.0)), speed=0.06)
    first, again, other = (
        deploy(motion, friction=0.5, noise=1.0, seed=seed, nodes=30, progress=False) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.laid, again.laid)
    assert np.abs(first.laid - other.laid).max() > 1e-4


def test_the_cable_of_a_trial_is_that_which_is_laid(monkeypatch):
    motion, seen = plan(CABLE, Pattern(bend(0.0)), speed=0.06), []
    monkeypatch.setattr(deploying, "lay", lambda setup, plan, progress: seen.append(setup) or ([], [], None))
    monkeypatch.setattr(deploying, "_compared", lambda *given: None)
    for seed in (3, 4):
        deploy(motion, friction=0.5, noise=0.7, seed=seed, nodes=30, progress=False)
        true = trial_cable(CABLE, seed, 0.7)
        assert seen[-1].cable.gravito_bending_length == true.gravito_bending_length
        assert abs(np.log(true.gravito_bending_length / CABLE.gravito_bending_length)) < 0.15
    assert seen[0].cable != seen[1].cable
    assert trial_cable(CABLE, 3, 0.0) == CABLE


def test_the_world_imports_no_planner():
    folder = Path(withe.deployment.__file__).parent
    tree = ast.parse((folder / "world.py").read_text())
    names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    ours = {name for name in names if name.startswith("withe.deployment")}
    assert ours == {"withe.deployment.cable", "withe.deployment.posts"}  # sizes, and nothing that plans
    assert not {name for name in names if name.startswith("withe._core")}
    for module in ("cable.py", "posts.py"):
        tree = ast.parse((folder / module).read_text())
        names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not {name for name in names if name.startswith("withe.deployment")}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"friction": -0.1}, "friction must be positive"),
        ({"friction": 0.0}, "friction must be positive"),
        ({"friction": 0.4, "noise": -1.0}, "noise must not be negative"),
        ({"friction": 0.4, "nodes": 5}, "nodes must lie in"),
        ({"friction": 0.4, "time_step": 0.0}, "time_step must be positive"),
        ({"friction": 0.4, "seed": -1}, "seed"),
        ({"friction": 0.4, "cable": Cable(0.1, 1e-3, 0.02)}, "must be as long as planned"),
        ({"friction": 0.4, "cable": 0.4}, "cable must be a withe.deployment.Cable, got 0.4"),
    ],
)
def test_bad_input_says_what_is_wrong(arc, arguments, message):
    with pytest.raises(ValueError, match=message):
        deploy(plan(CABLE, arc), **arguments)


@pytest.mark.slow
def test_quasi_static_laying_is_what_slow_laying_tends_to(arc):
    motion = plan(CABLE, arc, speed=0.01)
    slow = deploy(motion, friction=0.6, nodes=NODES, progress=False)
    still = deploy(motion, friction=0.6, nodes=NODES, quasi_static=True, progress=False)
    assert np.linalg.norm(slow.laid - still.laid, axis=1).max() < 4e-4
    assert not np.any(still.record.energy().kinetic)


@pytest.mark.slow
def test_bends_of_a_thick_cable_are_laid_where_they_should_lie():
    """Had friction across acted where the cable lifts off, and not behind it, 0.97 mm."""
    sine = np.genfromtxt(PATTERNS / "sine.csv", delimiter=",", skip_header=1)
    found = deploy(plan(Cable.dlo(1), Pattern(sine)), friction=0.4, quasi_static=True, progress=False)
    assert found.error < 0.7e-3


@pytest.mark.slow
def test_a_push_holds_on_floors_on_which_a_bend_slips_without():
    pattern = Pattern(np.genfromtxt(PATTERNS / "letterU.csv", delimiter=",", skip_header=1), nodes=201)
    slips = {}
    for controller in ("exact", "least_friction"):
        motion = plan(Cable.dlo(2), pattern, controller)
        assert (motion.feasibility(0.25).lift_off[3:-3].max() < 0.25) == (controller == "least_friction")
        slips[controller] = deploy(motion, friction=0.25, nodes=200, quasi_static=True, progress=False).slipped.max()
    assert slips["exact"] > 1e-3
    assert slips["least_friction"] < 4e-4


@pytest.mark.parametrize("nodes", [80, pytest.param(200, marks=pytest.mark.slow)])
def test_equilibria_follow_a_cable_of_any_mesh_that_slips_along_its_length(nodes):
    """The border of what slips goes on by a node an iteration: the finer the mesh, the more of them it takes."""
    sine = np.genfromtxt(PATTERNS / "sine.csv", delimiter=",", skip_header=1)
    motion = plan(Cable.dlo(2), Pattern(sine))
    found = deploy(motion, friction=0.2, nodes=nodes, quasi_static=True, progress=False)
    assert found.slipped.max() > 5e-3
    assert found.error == pytest.approx(4.07e-3, abs=1e-4)  # in time, at 6 mm/s, 80 nodes: 4.12 mm


@pytest.mark.slow
def test_equilibria_are_found_where_the_border_of_slip_has_many_nodes_to_go():
    """Laid along L, half of what lies of the limpest cable turns its slip in one step: 50 of 200 nodes, one by one."""
    letter = np.genfromtxt(PATTERNS / "letterL.csv", delimiter=",", skip_header=1)
    motion = plan(Cable.dlo(3), Pattern(letter))
    coarse, fine = (
        deploy(motion, friction=0.2, nodes=nodes, quasi_static=True, progress=False).error for nodes in (100, 200)
    )
    assert fine == pytest.approx(coarse, abs=5e-5)


def test_a_cable_put_on_its_pattern_moves_only_where_friction_fails(arc):
    motion = plan(CABLE, arc)
    rough, smooth = (place(motion, friction=friction, nodes=NODES, progress=False) for friction in (0.6, 0.02))
    assert rough.error < 2e-4
    assert smooth.error > 5 * rough.error
    still, moving = (place(motion, friction=0.1, nodes=NODES, quasi_static=q, progress=False) for q in (True, False))
    assert np.abs(still.laid - moving.laid).max() < 1e-4


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the cable slips")
def test_optimising_makes_up_for_what_slips():
    pattern = Pattern(bend(1.0, radius=0.03), smoothing=3e-4)  # needs more friction than there is
    exact, better = (
        plan(CABLE, pattern, controller, friction=0.25, progress=False) for controller in ("exact", "optimised")
    )
    assert exact.needed_friction[5:].max() > 0.35
    slipped, laid, moving = (
        deploy(motion, friction=0.25, quasi_static=still, nodes=100, progress=False)
        for motion, still in ((exact, True), (better, True), (better, False))
    )
    assert slipped.error > 1e-3
    assert laid.error < 0.3 * slipped.error
    assert moving.error < 0.5 * slipped.error  # in motion too, which the plan was not made in


def test_a_quick_plan_does_not_lose_the_free_end_where_it_touches_down():
    """The jaw swings the cable no faster than it may, however fast it lays."""
    line = Pattern(np.stack([np.linspace(0.0, 0.25, 101), np.zeros(101)], 1))
    found = deploy(plan(CABLE, line, speed=0.15), friction=0.6, nodes=NODES, progress=False)
    assert found.error < 1e-3


def test_optimising_needs_the_friction(arc):
    with pytest.raises(ValueError, match="'optimised' needs friction"):
        plan(CABLE, arc, "optimised")


def test_a_jaw_that_is_a_millimetre_low_yields_to_the_floor(arc):
    motion = plan(CABLE, arc)
    setup = Setup(cable=motion.cable, friction=0.6, nodes=NODES, time_step=0.1, quasi_static=True)
    right, low = (lay(replace(setup, jaw_offset=(0.0, 0.0, z)), motion, progress=False)[1] for z in (0.0, -1e-3))
    assert low[:, 2].min() > 0.97 * CABLE.radius  # it lies on the floor, not in it
    assert np.linalg.norm(low - right, axis=1).max() < 2e-3


def test_a_held_end_stays_where_the_pattern_begins(arc):
    motion = plan(CABLE, arc, start="held")
    found = deploy(motion, friction=0.6, nodes=NODES, quasi_static=True, progress=False)
    assert np.linalg.norm(found.laid[0, :2] - arc.points[0]) < 3e-4
    assert found.error < 1e-3
    ends = found.record.positions("cable")[:, 0]
    assert np.ptp(ends[:, :2], axis=0).max() < 1e-6
    assert np.ptp(ends[:, 2]) > 0.01


def test_a_cable_as_thick_as_a_hose_is_laid_as_exactly_for_its_size():
    """A cable of ten times the size has ten times the error, because the jaw holds it as rigidly. It was led along
    another pattern."""
    errors = []
    for scale in (1.0, 10.0):
        cable = Cable(0.36 * scale, 1.6e-3 * scale, 0.03 * scale)
        pattern = Pattern(scale * bend(1.0), smoothing=3e-4 * scale)
        motion = plan(cable, pattern, speed=0.04 * np.sqrt(scale), progress=False)
        found = deploy(motion, friction=0.6, nodes=NODES, quasi_static=True, progress=False)
        errors.append(found.error / scale)
    print("error over size [mm]:", 1e3 * np.array(errors))
    assert errors[1] == pytest.approx(errors[0], rel=0.1)
