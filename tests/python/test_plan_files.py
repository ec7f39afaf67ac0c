"""Files of plans: version 0.1 wrote those in tests/data/plans, and they are read and written as they are."""

import json
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.io import listed, with_gaps

DATA = Path(__file__).resolve().parent.parent / "data" / "plans"
KINDS = [("fold", withe.folding.FoldPlan), ("lay", withe.deployment.LayPlan)]


@pytest.mark.parametrize(("name", "kind"), KINDS)
def test_an_old_plan_is_written_as_it_was_read(name, kind, tmp_path):
    old = DATA / f"{name}.json"
    plan = kind.load(old)
    assert isinstance(plan, kind)
    before, after = (json.loads(file.read_text()) for file in (old, plan.save(tmp_path / "again.json")))
    predicted = [content.pop("prediction", {}) for content in (before, after)]  # computed anew: rounding may differ
    assert list(predicted[0]) == list(predicted[1])
    assert after == before
    assert list(after) == list(before)


@pytest.mark.parametrize(("name", "kind"), KINDS)
def test_a_table_of_poses_is_that_of_the_plan(name, kind, tmp_path):
    plan = kind.load(DATA / f"{name}.json")
    # Tables have nine digits.
    np.testing.assert_allclose(withe.io.load_poses(plan.save(tmp_path / "poses.csv")), plan.path, rtol=0, atol=1e-7)


def test_a_plan_of_another_kind_is_refused():
    with pytest.raises(ValueError, match="holds a withe plan of a fold, expected a withe plan of a deployment"):
        withe.deployment.LayPlan.load(DATA / "fold.json")


@pytest.mark.parametrize("seed", range(5))
def test_numbers_with_gaps_come_back(seed):
    random = np.random.default_rng(seed)
    values = np.where(random.random(20) < 0.3, np.nan, random.normal(size=20))
    np.testing.assert_array_equal(with_gaps(listed(values), "values", 20), values)
