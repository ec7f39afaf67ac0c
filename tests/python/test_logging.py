"""The logger `withe`: what it reports, its silence, and that it changes no result."""

import logging
import re
import subprocess
import sys

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, cantilever, same_state

pytestmark = pytest.mark.filterwarnings("ignore::withe.CoarseStepWarning", "ignore::withe.EnergyDriftWarning")

QUARTER = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]


def turning(**options):
    """A rod whose clamp turns by 90 degrees in 50 ms, above a floor."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER, name="arm")
    wall = scene.clamp(arm.start)
    scene.add_floor(-0.05)
    simulation = scene.build(**{"time_step": 0.02, **options})
    simulation.move(wall, rotation=QUARTER, over=0.05)
    return simulation


@pytest.fixture
def lines(caplog):
    """Lines at a level so far, without their logger."""
    caplog.set_level(logging.DEBUG, logger="withe")
    return lambda level: [line.getMessage() for line in caplog.records if line.levelname == level]


def test_a_build_and_a_run_are_lines_at_info(lines):
    _, _, simulation = cantilever()
    assert lines("INFO") == [f"build: {str(simulation.plan).splitlines()[0]}"]
    assert [f"build: {note}" for note in simulation.plan.notes] == lines("DEBUG")
    simulation.run(0.05, progress=False)
    line = lines("INFO")[1]
    counts = simulation.statistics
    found = re.fullmatch(r"run from t = 0 to 0\.05 s: (\d+) steps, (\d+) rejected, (\d+) iterations, in \S+ s", line)
    assert [int(count) for count in found.groups()] == [counts.steps, counts.rejected_steps, counts.iterations]


def test_subdivided_steps_are_lines_with_time_and_shortest_step(lines):
    simulation = turning()
    for _ in range(5):
        start, before = simulation.time, simulation.statistics
        written = len(lines("DEBUG"))
        simulation.step()
        now = simulation.statistics
        steps, rejected = now.steps - before.steps, now.rejected_steps - before.rejected_steps
        new = lines("DEBUG")[written:]
        if steps == 1 and rejected == 0:
            assert new == []
            continue
        (line,) = new
        found = re.fullmatch(
            r"step from t = (\S+) s: subdivided into (\d+) inner steps \(shortest (\S+) s\), (\d+) rejected, "
            r"(\d+) iterations",
            line,
        )
        assert float(found[1]) == pytest.approx(start)
        assert (int(found[2]), int(found[4])) == (steps, rejected)
        assert int(found[5]) == now.iterations - before.iterations
        assert 0.0 < float(found[3]) <= 0.02 / steps * (1.0 + 1e-9)
    assert any("subdivided" in line for line in lines("DEBUG"))


def test_several_steps_in_one_call_have_their_own_lines(lines):
    turning().step(5)
    starts = [re.search("t = (.*?) s:", line)[1] for line in lines("DEBUG") if "subdivided" in line]
    assert len(set(starts)) == len(starts) > 1


def test_equilibria_files_and_failures_are_details(lines, tmp_path):
    simulation = cantilever()[2]
    found = simulation.equilibrium()
    path = simulation.run(0.01, progress=False).save(tmp_path / "arm.npz")
    assert f"equilibrium at t = 0 s: {found.iterations} iterations, residual {found.residual:.2g} N, stable" in lines(
        "DEBUG"
    )
    assert f"wrote {path}: {path.stat().st_size} bytes" in lines("DEBUG")
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=RUBBER)
    with pytest.raises(withe.ConvergenceError) as failed:
        scene.build().equilibrium()
    assert lines("DEBUG")[-1] == f"no convergence: {failed.value}"


@pytest.mark.parametrize("integrator", ["energy_momentum", "backward_euler", "implicit_midpoint", "static", "verlet"])
def test_logging_changes_no_bit_of_a_result(integrator, caplog):
    options = {"integrator": integrator} | ({"time_step": 2e-4} if integrator == "verlet" else {})
    results = []
    for level in (logging.WARNING, logging.DEBUG):
        with caplog.at_level(level, logger="withe"):
            simulation = turning(**options)
            simulation.step(8)
            simulation.run(5 * simulation.time_step, progress=False)
            results.append(simulation)
    assert np.ptp(results[0].positions()) > 0.0
    assert same_state(*results)


def test_without_a_handler_nothing_is_written():
    code = (
        "import logging, withe\n"
        "assert [type(handler) for handler in logging.getLogger('withe').handlers] == [logging.NullHandler]\n"
        "scene = withe.Scene()\n"
        "rubber = withe.Material(youngs_modulus=1e6, density=1000.0)\n"
        "arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=11, radius=5e-3, material=rubber)\n"
        "scene.clamp(arm.start)\n"
        "scene.build().run(0.01, progress=False)\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout + result.stderr == ""


def test_a_silent_logger_costs_no_statistics(monkeypatch, caplog):
    """Lines are not composed, and steps are taken in one call of the engine."""
    simulation = turning()
    made = []
    caplog.set_level(logging.INFO, logger="withe")
    monkeypatch.setattr("withe.simulation.stepping.StepLog", lambda *arguments: made.append(arguments))
    simulation.step(3)
    assert made == []
