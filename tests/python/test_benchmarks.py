"""The short form of each benchmark runs, and leaves a file that says what it should. Nothing is timed here."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from scripts import run_script

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
sys.path.insert(0, str(FOLDER))
HAVE_GYMNASIUM = importlib.util.find_spec("gymnasium") is not None
HAVE_PYVISTA = importlib.util.find_spec("pyvista") is not None


@pytest.fixture
def interpreted(monkeypatch):
    """PyElastica takes half a minute to compile, and these tests some hundred of its steps."""
    numba = pytest.importorskip("numba")
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    pytest.importorskip("elastica")


def run(name, folder, *arguments):
    environment = {"WITHE_BENCHMARK_OUT": str(folder), "NUMBA_DISABLE_JIT": "1"}  # as `interpreted` says
    return run_script(FOLDER / f"{name}.py", list(arguments), folder, environment)


def check_short_form(name, folder):
    printed = run(name, folder, "--quick")
    content = json.loads((folder / f"{name}.json").read_text())
    assert content["name"] == name
    assert content["command"] == f"python benchmarks/{name}.py --quick"  # that anybody can type
    assert content["quick"] is True
    assert content["machine"]["processor"]
    assert content["tables"]
    assert f"Goals of {name}" in printed
    assert content["goals"]
    for goal in content["goals"]:
        assert set(goal) == {"name", "value", "target", "sign", "met"}
        assert goal["met"] in (True, False)
        assert goal["value"] is not None or not goal["met"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "work_precision",
        "peers",
        "bodies",
        "friction_precision",
        "robustness",
        "ablation",
        "conservation",
        "skips",
        "settings",
        "gradients",
        "parallel",
        "contact",
        "contact_fold",
        "contact_robustness",
        "real2sim",
        "deployment",
        "deployment_uses",
        "folding",
        "folding_trials",
        "folding_spin",
        "folding_replay",
        pytest.param("drawing", marks=pytest.mark.skipif(not HAVE_PYVISTA, reason="needs pyvista")),
        pytest.param("rl_throughput", marks=pytest.mark.skipif(not HAVE_GYMNASIUM, reason="needs gymnasium")),
    ],
)
def test_the_short_form_writes_its_figures(name, tmp_path):
    check_short_form(name, tmp_path)


@pytest.mark.slow
def test_a_run_that_was_cut_off_goes_on_with_what_it_had(tmp_path):
    check_short_form("deployment_tables", tmp_path)
    file = tmp_path / "deployment_tables.jsonl"
    first, second = file.read_text().splitlines()
    kept = json.dumps(json.loads(first) | {"error": 123.4})
    file.write_text(kept + "\n" + second[:80])
    printed = run("deployment_tables", tmp_path, "--quick", "--resume")
    assert file.read_text().splitlines() == [kept, second]
    assert "123.40 ± " in printed
    file.write_text(kept + "\n")
    run("deployment_tables", tmp_path, "--quick", "--known")
    assert json.loads((tmp_path / "deployment_tables.json").read_text())["figures"]["interrupted"] == "1 of 2 runs"


def test_times_at_an_error_are_read_between_points_of_the_front():
    from work_precision import Point, front, time_at

    def point(error, time):
        return Point("beam a", "implicit_midpoint", 10, 0.1, error, time)

    points = [point(1e-1, 1.0), point(1e-2, 10.0), point(3e-2, 20.0), point(1e-3, 100.0), point(0.7, 0.1)]
    assert [p.time for p in front(points)] == [1.0, 10.0, 100.0]
    assert time_at(points, 1e-2) == pytest.approx(10.0)
    assert time_at(points, 10**-1.5) == pytest.approx(10**0.5)
    assert time_at(points, 0.3) == pytest.approx(1.0)
    assert time_at(points, 1e-4) is None


def test_errors_are_measured_against_the_limit_and_its_motion():
    from rods_in_motion import Motion

    times = np.linspace(0.0, 2.0 * np.pi, 401)
    limit = Motion(times, np.column_stack([np.sin(times), 0 * times, 0 * times]))
    shifted = Motion(times[::4], limit.tip[::4] + np.array([0.0, 0.1, 0.0]))
    assert limit.size == pytest.approx(np.sqrt(0.5), rel=1e-2)
    assert shifted.error(limit) == pytest.approx(0.1 / limit.size, rel=1e-6)
    assert Motion(times, np.full((401, 3), np.nan)).error(limit) == np.inf


def test_a_push_is_off_by_its_worst_force_above_the_limit():
    from friction_precision import SLIDING, block, greatest_error

    off = {force: 1.0 + 0.01 * i for i, force in enumerate(SLIDING)}
    assert greatest_error(lambda force: (off[force] * block(force), 1.0)) == pytest.approx(0.06)
    assert greatest_error(lambda force: (np.nan, 1.0)) == np.inf


def test_rods_of_three_simulators_sag_as_the_elastica(interpreted):
    pytest.importorskip("mujoco")
    from peer_rods import ElasticaRod, MujocoRod, Rod, elastica_tip, slowest, withe_rod

    light = Rod(weight=0.5)
    exact = elastica_tip(0.5)
    assert exact[1] == pytest.approx(-0.5 / 8.0, rel=0.01)
    simulation = withe_rod(light, 24, integrator="static")
    simulation.equilibrium()
    pace = slowest(light)
    stepped = MujocoRod(light, 24, 0.2 / pace, damping=2.0 * pace)
    stepped.run(40.0 / pace)
    for tip, most in ((simulation.positions()[-1], 1e-3), (stepped.nodes[1][-1], 1e-2)):
        assert tip[[0, 2]] / light.length == pytest.approx(exact, abs=most * abs(exact[1]))
    # Interpreted steps are slow: PyElastica falls freely at first, as does the rod of withe.
    falling, ours = ElasticaRod(light, 8, 0.5), withe_rod(light, 8, time_step=1e-4, planar=True)
    falling.run(2e-3, 1)
    ours.run(2e-3, progress=False)
    assert falling.nodes[1][-1, 2] == pytest.approx(ours.positions()[-1, 2], rel=0.02)


def test_a_knot_of_three_simulators_starts_alike_and_is_as_tight(interpreted):
    pytest.importorskip("mujoco")
    from peer_knots import ElasticaKnot, Knot, MujocoKnot, shortening, withe_knot

    knot = Knot()
    simulation = withe_knot(knot, 60, 0.2 * knot.pace, integrator="backward_euler", time_step=0.02)
    stepped = MujocoKnot(knot, 60, 2e-3, 0.2 * knot.pace)
    # Interpreted steps are slow: the ends of PyElastica's rod begin to part as those of the rod of MuJoCo.
    begun = ElasticaKnot(knot, 60, 0.5, 0.2 * knot.pace, 0.1)
    loose = shortening(begun.nodes[1])
    assert shortening(simulation.positions()) == pytest.approx(loose, rel=1e-12)
    assert shortening(stepped.nodes[1]) == pytest.approx(loose, rel=1e-12)
    begun.run(1e-3)
    ends = begun.nodes[1][[0, -1]] - knot.points(60)[[0, -1]]
    assert ends[1] == pytest.approx(ends[0] * (-1.0, -1.0, 1.0), rel=0.02)  # symmetric about the axis z
    assert ends[1] @ (knot.points(60)[-1] - knot.points(60)[0]) > 0.0

    simulation.step(30)
    stepped.run(0.6)
    tight = shortening(simulation.positions())
    assert 25.0 * knot.radius < tight < 0.6 * loose
    assert shortening(stepped.nodes[1]) == pytest.approx(tight, rel=0.03)


@pytest.mark.parametrize("method", ["backward_euler", "backward_euler, on centrelines", "PyElastica"])
def test_a_rod_that_is_pushed_sticks_or_slides_as_a_block_does(method, request):
    if method == "PyElastica":
        request.getfixturevalue("interpreted")
    from friction_precision import SLIDING, STICKING, Point, block, pusher

    pushed = pusher(Point("friction", method, 2, 0.015))
    errors = {force: abs(pushed(force)[0] / block(force) - 1.0) for force in SLIDING}
    # A force a fourth of a thousandth above the limit gathers speed up to the slip tolerance, 1 mm/s, before all of
    # friction acts; the block ends at about 0.5 m/s.
    slowest = min(errors)
    assert errors.pop(slowest) < 4e-3
    assert max(errors.values()) < 1e-6
    assert max(pushed(force)[0] for force in STICKING) < 1e-6


@pytest.mark.slow
def test_a_jaw_that_is_compiled_goes_as_one_that_is_interpreted(interpreted, monkeypatch):
    import numba
    from elastica_sheet import _put_jaw

    monkeypatch.setattr(numba.config, "DISABLE_JIT", 0)
    put_jaw = numba.njit(_put_jaw)
    table = np.random.default_rng(5).normal(size=(6, 3))
    along_rod = np.array([0.0, 0.01, 0.03])
    for moment in (-0.1, 0.0, 0.23, 0.4, 0.5, 0.7):
        plain, compiled = ([np.ones((3, 3)), np.ones((3, 3, 2)), np.ones((3, 3)), np.ones((3, 2))] for _ in range(2))
        _put_jaw(*plain, table, 0.1, moment, 2, along_rod, 2e-4)
        put_jaw(*compiled, table, 0.1, moment, 2, along_rod, 2e-4)
        for one, other in zip(plain, compiled, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-13)


def test_our_beam_approaches_its_stored_limit():
    from limits import load_limits
    from rods_in_motion import CASES, record

    limit, apart = load_limits("withe")["beam a"]
    assert apart < 1e-3
    errors = [record(CASES["beam a"], edges, 20.0, time_step=0.02).error(limit) for edges in (8, 16)]
    assert errors[1] < 0.2 * errors[0] < 2e-3


def test_a_case_of_the_stress_test_is_the_same_every_time():
    from stress_cases import draw_case

    first, again = draw_case(17), draw_case(17)
    assert {name: value for name, value in vars(first).items() if name != "direction"} == {
        name: value for name, value in vars(again).items() if name != "direction"
    }
    assert np.array_equal(first.direction, again.direction)
    assert draw_case(18).length != first.length


def test_damped_cases_are_the_same_scenes_with_viscosity_and_other_seeds_are_others():
    from stress_cases import DAMPING_RATIOS, draw_case

    for number in range(20):
        plain, damped = vars(draw_case(number)), vars(draw_case(number, damped=True))
        differing = {name for name in plain if not np.array_equal(plain[name], damped[name])}
        assert differing == {"damping_ratio"}
        assert DAMPING_RATIOS[0] <= damped["damping_ratio"] <= DAMPING_RATIOS[1]
    assert draw_case(0, seed=1).length != draw_case(0).length


def test_refusals_are_accepted_only_where_the_curvature_confirms_them():
    import dataclasses
    import functools

    import robustness
    from stress_cases import draw_case

    crushed = dataclasses.replace(draw_case(291), nodes=40, strength=1.0, radius=1.0, length=20.0)
    verdict = robustness.judge(291, draw=lambda number: crushed)
    assert verdict.refused
    assert not verdict.reason
    gentle = dataclasses.replace(crushed, radius=0.1)
    simulation = robustness.build(gentle)
    check = functools.partial(robustness._check_refusal, gentle, simulation, 0)
    with pytest.raises(robustness._RejectedError, match="unfounded refusal"):
        check("the inner fibre would be compressed to nothing")


def test_motion_that_is_not_chaotic_is_compared_to_its_end():
    import dataclasses

    import robustness
    from stress_cases import draw_case

    calm = dataclasses.replace(draw_case(24), nodes=6, method="error-controlled", strength=0.2)
    finer = robustness._within_limit(calm, tolerance=1e-4 * calm.length)
    assert robustness._horizon(calm, finer) == 1.0
    pushed = [positions + np.array((0.0, 0.0, 0.05 * calm.length)) for positions in finer]
    with pytest.raises(robustness._RejectedError, match="differs from a finer run"):
        robustness._compare(calm, pushed, robustness.Verdict(24))


@pytest.mark.parametrize("method", ["static", "backward_euler"])
def test_forces_summed_again_balance_and_a_wrong_load_shows(method):
    import dataclasses

    import balance
    from stress_cases import build, draw_case, events

    case = dataclasses.replace(draw_case(24), method=method, coarseness=5.0, nodes=22)  # a tip load in space

    def imbalance(judged):
        simulation = build(case)
        if method == "static":
            events(case, simulation, 0)
            simulation.equilibrium()
            return balance.static_residual(judged, simulation, 0)
        for i in range(case.steps):
            if i in (0, case.steps // 2):
                events(case, simulation, int(i > 0))
            before = balance.look(simulation)
            simulation.step()
        return balance.residual(judged, simulation, before)

    assert imbalance(case) < 1.0
    assert imbalance(dataclasses.replace(case, strength=1.001 * case.strength)) > 1.0


def test_a_page_shows_tables_and_goals_of_a_run():
    from tables import section

    content = {
        "name": "skips",
        "date": "2026-01-02T03:04:05+00:00",
        "command": "python benchmarks/skips.py",
        "machine": {"processor": "a processor", "processors": 2},
        "compiler": "a compiler",
        "versions": {"withe": "0.1.0", "python": "3.11"},
        "took": 12.0,
        "tables": {"Saved": [["row", "times"], ["planar | 2D", "3.1"]], "Fronts, long": [["a"], ["b"]]},
        "goals": [{"name": "planar", "value": 3.14159, "target": 2, "sign": "at least", "met": True}],
    }
    page = section(content)
    assert "| planar \\| 2D | 3.1 |" in page
    assert "| planar | 3.142 | at least 2 | met |" in page
    assert "a compiler" in page
    assert "2026-01-02" in page
    assert "Fronts" not in page


def test_the_picture_of_the_peers_has_the_run_times_of_the_page():
    from peers_picture import run_times

    page = (FOLDER / "README.md").read_text()
    found = run_times(page)
    assert len(found) == 6
    assert all(len(times["withe"]) == len(times["PyElastica"]) == 3 for times in found.values())
    assert found["Michell's ring"]["MuJoCo"] == []
    for scene, times in found.items():
        error, seconds = times["withe"][-1]
        assert f"| {scene} | {error:g} of the" in page
        assert f"| {1e3 * seconds:.3g} ms |" in page
    assert "](pictures/peers.png)" in page


def test_conservation_is_measured_by_what_theory_knows():
    """Backward Euler loses a known angular momentum in each step; midpoint in a plane loses nothing."""
    from conservation import driven, euler_identity, midpoint_in_a_plane

    coarse, apart = euler_identity(steps=100)
    fine, _ = euler_identity(steps=200)
    assert apart < 1e-10
    assert coarse > 0.01
    assert 1.6 < coarse / fine < 2.4
    assert midpoint_in_a_plane() < 1e-11
    assert max(driven("implicit_midpoint", True, 4e-3, even=True).values()) < 1e-9
    assert 1e-9 < driven("implicit_midpoint", True, 4e-3, even=False)["work"] < 1e-5


def test_drawn_flights_are_the_same_every_time_and_of_all_kinds():
    from conservation import fly
    from conservation_cases import KINDS, draw

    cases = [draw(i) for i in range(50)]
    assert {(c.kind, c.flat, c.viscous) for c in cases} == {
        (kind, flat, viscous) for kind in KINDS for flat in (True, False) for viscous in (True, False)
    }
    first, again = (fly(draw(7), "implicit_midpoint", 20, 50) for _ in range(2))
    assert first == again
    assert not first.failure
    assert first.linear < 1e-9
    euler = fly(draw(0), "backward_euler", 20, 50)
    assert euler.angular > 1e-6  # by its nature, which the instrument must see
    assert euler.gained < 1e-3 < euler.lost
