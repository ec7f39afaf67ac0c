"""Trials of folding, side by side: the same as one by one, and handed out as they end."""

import os
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

from withe.folding import Paper, Trial, run_trials
from withe.folding.trials import _alike

pytest.importorskip("cv2")

COARSE = {"edges": 60, "time_step": 0.02}
TRIALS = [
    Trial(Paper.a4(), seed=3, sheet=COARSE, name="open"),
    Trial(Paper.a4(), seed=3, sheet=COARSE, replans=1, name="closed"),
    Trial(Paper.a4(), 0.29, sheet=COARSE, planner={"method": "slip", "grasp": "free", "curvature": 0.5}, name="bent"),
]


@pytest.fixture(scope="module")
def alone():
    return {outcome.trial.name: outcome for outcome in run_trials(TRIALS, workers=1, progress=False)}


def figures(outcome):
    return [outcome.gravito_bending_length, outcome.error, outcome.length, outcome.slide, outcome.max_curvature]


def test_a_trial_measures_plans_and_folds(alone):
    done = alone["open"]
    assert done.failure is None
    assert done.length == pytest.approx(0.5 * 0.297 + done.error)
    assert abs(done.gravito_bending_length / 0.048 - 1) < 0.12
    assert 0 < done.seconds < 300


def test_a_trial_without_a_plan_says_why(alone):
    assert alone["bent"].failure.startswith("no plan: no path brings the edge to 0.29 m")
    assert np.isnan(alone["bent"].error)


def test_trials_of_one_sheet_and_one_plan_are_carried_out_by_one_process():
    assert [[trial.name for trial in group] for group in _alike(TRIALS)] == [["open", "closed"], ["bent"]]
    asked = [(1, {}), (2, {}), (1, {"method": "local"})]
    others = [Trial(Paper.a4(), seed=seed, planner=planner) for seed, planner in asked]
    assert [len(group) for group in _alike(others)] == [1, 1, 1]


def test_processes_fold_as_one_does(alone):
    for outcome in run_trials(TRIALS, workers=2, progress=False):
        np.testing.assert_array_equal(figures(outcome), figures(alone[outcome.trial.name]))
        assert outcome.failure == alone[outcome.trial.name].failure


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_workers_of_dask_fold_as_one_does(alone):
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        found = {outcome.trial.name: outcome for outcome in run_trials(TRIALS, client=client, progress=False)}
    assert sorted(found) == sorted(alone)
    for name, outcome in found.items():
        np.testing.assert_array_equal(figures(outcome), figures(alone[name]))


@pytest.mark.slow
def test_ctrl_c_ends_processes_at_once_and_keeps_what_has_come(tmp_path):
    """The first trial has no plan and comes within seconds; of the others none could end."""
    script = tmp_path / "many.py"
    script.write_text(
        textwrap.dedent("""
        import os, signal, time
        from withe.folding import Paper, Trial, run_trials

        if __name__ == "__main__":
            fails = Trial(Paper.a4(), 0.29, planner={"method": "slip", "grasp": "free", "curvature": 0.5})
            slow = Trial(Paper.a4(), sheet={"edges": 400, "time_step": 1e-4})
            kept = []
            try:
                for outcome in run_trials([fails, slow, slow, slow], workers=2, progress=False):
                    kept.append(outcome)
                    os.kill(os.getpid(), signal.SIGINT)
            except KeyboardInterrupt:
                print("kept", len(kept), kept[0].failure[:7], flush=True)
        """)
    )
    began = time.monotonic()
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=120, check=False, env=dict(os.environ)
    )
    assert done.stdout.strip() == "kept 1 no plan", done.stderr
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert time.monotonic() - began < 100


def test_bad_input_is_named():
    with pytest.raises(ValueError, match="trials must be Trials"):
        run_trials(["a4"])
    with pytest.raises(ValueError, match="workers and client must not be given together"):
        run_trials(TRIALS, workers=2, client=object())
    with pytest.raises(ValueError, match="workers must lie in"):
        run_trials(TRIALS, workers=0)
    with pytest.raises(ValueError, match=r"client must be a dask\.distributed\.Client"):
        run_trials(TRIALS, client="here")
